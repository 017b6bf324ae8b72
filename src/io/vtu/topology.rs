//! The cells of pieces: the points that they name, and the faces of polyhedra.

use super::grid::{Grid, joined};
use super::head::Piece;
use crate::error::Result;
use crate::io::data::DataArray;
use crate::io::number::{Number, with_kind};
use crate::memory;
use crate::mesh::{Cells, POLYHEDRON, Polyhedra};
use rayon::prelude::*;

/// The cells of a piece. Offsets and all other lists are as in the file, without the 0 in front.
#[derive(Default)]
pub(super) struct Topology {
    pub(super) cells: Cells,
    pub(super) polyhedra: Option<Polyhedra>,
}

impl Grid<'_> {
    /// The cells of all pieces.
    pub(super) fn topology(&self) -> Result<Topology> {
        let bases = self.pieces.iter().scan(0, |base, piece| {
            *base += piece.points;
            Some(*base - piece.points)
        });
        let pieces: Vec<(u64, &Piece)> = bases.zip(&self.pieces).collect();
        let read = |(i, (base, piece)): (usize, &(u64, &Piece))| self.topology_of(i, piece, *base);
        let parts = pieces.par_iter().enumerate().map(read).collect::<Result<Vec<_>>>()?;
        let has_polyhedra = parts.iter().any(|part| part.polyhedra.is_some());
        let (mut types, mut connectivity, mut offsets) = (vec![], vec![], vec![]);
        let (mut of_cells, mut faces, mut points) = (vec![], vec![], vec![]);
        for Topology { cells, polyhedra } in parts {
            let n = cells.types.len();
            types.push(cells.types);
            connectivity.push(cells.connectivity);
            append(&mut offsets, cells.offsets)?;
            if has_polyhedra {
                let polyhedra = polyhedra.unwrap_or_default();
                append(&mut of_cells, if polyhedra.cells.is_empty() { vec![0; n] } else { polyhedra.cells })?;
                append(&mut faces, polyhedra.faces)?;
                points.push(polyhedra.points);
            }
        }
        let closed = |mut list: Vec<u64>| {
            if list.is_empty() {
                list.push(0);
            }
            list
        };
        let points = joined("the faces of its polyhedra", points)?;
        let polyhedra = Polyhedra { cells: closed(of_cells), faces: closed(faces), points };
        let (types, connectivity) = (joined("the types of its cells", types)?, joined("its cells", connectivity)?);
        let cells = Cells { types, offsets: closed(offsets), connectivity };
        Ok(Topology { cells, polyhedra: has_polyhedra.then_some(polyhedra) })
    }

    /// The cells of piece `i`, whose points come after `base` others.
    fn topology_of(&self, i: usize, piece: &Piece, base: u64) -> Result<Topology> {
        if piece.cells == 0 {
            return Ok(Topology::default());
        }
        let find = |name: &str| {
            let found = piece.find(name);
            found.ok_or_else(|| self.malformed(piece, format!("the Cells of piece {i} have no array \"{name}\"")))
        };
        let (offsets, types, connectivity) = (find("offsets")?, find("types")?, find("connectivity")?);
        let offsets = self.indices(piece, offsets, Some(piece.cells), Some, |cell, _| {
            format!("the offset of cell {cell} is not a whole number from 0 up")
        })?;
        let narrow = |kind| u8::try_from(kind).ok();
        let types = self.indices(piece, types, Some(piece.cells), narrow, |cell, _| {
            format!("the type of cell {cell} is not in 0..=255")
        })?;
        let length = offsets.last().copied().unwrap_or_default();
        let numbered = piece.numbered_from(base);
        let mut connectivity = self.indices(piece, connectivity, Some(length), numbered, |entry, point| {
            piece.no_point(&format!("cell {}", offsets.partition_point(|end| *end <= entry as u64)), point)
        })?;
        if piece.old_numbering && offsets.is_sorted() && length == connectivity.len() as u64 {
            renumber(&[72], &types, &offsets, &mut connectivity);
        }
        let polyhedra = types.contains(&POLYHEDRON).then(|| self.polyhedra_of(piece, &types, base)).transpose()?;
        Ok(Topology { cells: Cells { types, offsets, connectivity }, polyhedra })
    }

    /// The faces of a piece's polyhedra: in the layout of VTK 9.4, or in that before.
    fn polyhedra_of(&self, piece: &Piece, types: &[u8], base: u64) -> Result<Polyhedra> {
        let arrays = |names: [&str; 4]| names.map(|name| piece.find(name));
        match arrays(["face_connectivity", "face_offsets", "polyhedron_to_faces", "polyhedron_offsets"]) {
            [Some(points), Some(faces), Some(lists), Some(cells)] => {
                self.listed_faces(piece, [points, faces, lists, cells], base)
            }
            _ => match (piece.find("faces"), piece.find("faceoffsets")) {
                (Some(stream), Some(ends)) => self.streamed_faces(piece, types, [stream, ends], base),
                _ => Err(self.malformed(piece, "it has polyhedra, but no arrays that tell their faces")),
            },
        }
    }

    /// Of lists: the points of faces, where each ends, the faces of cells, and where each ends.
    fn listed_faces(
        &self,
        piece: &Piece,
        [points, ends, lists, cells]: [&DataArray; 4],
        base: u64,
    ) -> Result<Polyhedra> {
        let cells = self.indices(piece, cells, Some(piece.cells), Some, no_index)?;
        let lists = self.indices(piece, lists, None, Some, no_index)?;
        let ends = self.indices(piece, ends, None, Some, no_index)?;
        let points = self.indices(piece, points, None, piece.numbered_from(base), |i, p| {
            piece.no_point(&format!("face {}", ends.partition_point(|end| *end <= i as u64)), p)
        })?;
        let fits =
            |ends: &[u64], length: usize| ends.is_sorted() && ends.last().is_none_or(|end| *end <= length as u64);
        if !fits(&cells, lists.len()) || !fits(&ends, points.len()) {
            return Err(self.malformed(piece, "the lists of the polyhedra's faces do not fit together"));
        }
        // As many as lists of two cells to a face have.
        let mut polyhedra = room(2 * points.len(), lists.len(), cells.len())?;
        let mut start = 0;
        for (cell, end) in cells.iter().enumerate() {
            for face in &lists[start as usize..*end as usize] {
                let Some(end) = ends.get(*face as usize).filter(|_| *face < ends.len() as u64) else {
                    let what = format!("polyhedron {cell} names face {face}, but there are {} faces", ends.len());
                    return Err(self.malformed(piece, what));
                };
                let from = if *face == 0 { 0 } else { ends[*face as usize - 1] };
                polyhedra.points.extend_from_slice(&points[from as usize..*end as usize]);
                // A face has two sides: what is named far more often makes much of little.
                if polyhedra.points.len() > 8 * points.len() {
                    let what =
                        format!("by polyhedron {cell} its faces are named 8 times each, but a face has two sides");
                    return Err(self.malformed(piece, what));
                }
                polyhedra.faces.push(polyhedra.points.len() as u64);
            }
            start = *end;
            polyhedra.cells.push(polyhedra.faces.len() as u64);
        }
        Ok(polyhedra)
    }

    /// Of a stream: for each polyhedron the number of its faces; for each face, the number of its points, and these.
    /// The other array says where the faces of each cell end in the stream; −1 for those that are no polyhedra.
    fn streamed_faces(
        &self,
        piece: &Piece,
        types: &[u8],
        [stream, ends]: [&DataArray; 2],
        base: u64,
    ) -> Result<Polyhedra> {
        let ends = self.signed(piece, ends, piece.cells)?;
        let stream = self.indices(piece, stream, None, Some, no_index)?;
        let numbered = piece.numbered_from(base);
        let mut polyhedra = room(stream.len(), stream.len() / 4, ends.len())?;
        let mut at = 0;
        for (cell, end) in ends.iter().enumerate() {
            if let (Ok(end), true) = (usize::try_from(*end), types[cell] == POLYHEDRON) {
                let short =
                    || self.malformed(piece, format!("the faces of polyhedron {cell} do not fit its offset {end}"));
                let mut rest = stream.get(at..end).ok_or_else(short)?;
                let mut count = *rest.split_off_first().ok_or_else(short)?;
                while count > 0 {
                    let n = usize::try_from(*rest.split_off_first().ok_or_else(short)?).map_err(|_| short())?;
                    for p in rest.split_off(..n).ok_or_else(short)? {
                        let no_point =
                            || self.malformed(piece, piece.no_point(&format!("polyhedron {cell}"), Some(*p)));
                        polyhedra.points.push(numbered(*p).ok_or_else(no_point)?);
                    }
                    polyhedra.faces.push(polyhedra.points.len() as u64);
                    count -= 1;
                }
                at = end;
            }
            polyhedra.cells.push(polyhedra.faces.len() as u64);
        }
        Ok(polyhedra)
    }

    /// Reads numbers of any type as i64; those that are none are −1.
    fn signed(&self, piece: &Piece, array: &DataArray, count: u64) -> Result<Vec<i64>> {
        self.store(piece).array(array)?.read(count, &self.progress, &|_, numbers, out| {
            let out = bytemuck::cast_slice_mut::<u8, i64>(out);
            with_kind!(array.kind, T => for (number, out) in bytemuck::cast_slice::<u8, T>(numbers).iter().zip(out) {
                *out = number.index().and_then(|i| i64::try_from(i).ok()).unwrap_or(-1);
            });
            Ok(())
        })
    }
}

impl Piece {
    /// What each of its points is in the mesh, after `base` others; none for numbers of no point.
    fn numbered_from(&self, base: u64) -> impl Fn(u64) -> Option<u32> + Sync + use<> {
        let points = self.points;
        move |point| (point < points).then(|| (base + point) as u32)
    }

    fn no_point(&self, whose: &str, point: Option<u64>) -> String {
        let point = point.map_or("a negative point".to_owned(), |point| format!("point {point}"));
        format!("{whose} names {point}, but there are {} points", self.points)
    }
}

/// Empty lists, with room for so many points of faces, faces and cells.
fn room(points: usize, faces: usize, cells: usize) -> Result<Polyhedra> {
    let mut polyhedra = Polyhedra::default();
    let what = "the faces of its polyhedra";
    memory::reserve(what, &mut polyhedra.points, points)?;
    memory::reserve(what, &mut polyhedra.faces, faces)?;
    memory::reserve(what, &mut polyhedra.cells, cells)?;
    Ok(polyhedra)
}

fn no_index(_: usize, _: Option<u64>) -> String {
    "an entry is not a whole number from 0 up".to_owned()
}

/// Appends the ends of lists to those before them, which start with 0.
fn append(all: &mut Vec<u64>, ends: Vec<u64>) -> Result<()> {
    let what = "the ends of its cells";
    if all.is_empty() {
        *all = ends;
        memory::reserve(what, all, 1)?;
        all.insert(0, 0);
    } else {
        let base = all.last().copied().unwrap_or_default();
        memory::reserve(what, all, ends.len())?;
        all.extend(ends.iter().map(|end| base.saturating_add(*end)));
    }
    Ok(())
}

/// Hexahedra of these VTK types had, before VTK 9, the third and fourth of their upright edges the other way round.
pub(in crate::io) fn renumber(of: &[u8], types: &[u8], ends: &[u64], connectivity: &mut [u32]) {
    let mut start = 0;
    for (vtk_type, end) in types.iter().zip(ends) {
        let points = &mut connectivity[start..*end as usize];
        start = *end as usize;
        let degree = (2..=10).find(|p: &usize| (p + 1).pow(3) == points.len());
        if let (true, Some(degree)) = (of.contains(vtk_type), degree) {
            let (edge, upright) = (degree - 1, 8 + 8 * (degree - 1));
            let (third, fourth) = points[upright + 2 * edge..upright + 4 * edge].split_at_mut(edge);
            third.swap_with_slice(fourth);
        }
    }
}
