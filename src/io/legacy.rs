//! Legacy .vtk files, versions 1 to 5.1, ascii or binary (VTK File Formats, "Simple Legacy Formats").
//!
//! A file is a list of sections, each a keyword, a line that says what follows, and numbers. Points and cells must be
//! whole. Of what describes them (`data`), anything that is not is left out by name, and reading goes on where the next
//! section starts. Files whose points or cells are written as the scanner (`scan`) does not know are tried with vtkio
//! (`parsed`).

mod data;
mod parsed;
mod scan;
mod structured;

use super::input::Input;
use super::vtu::renumber;
use super::{DataSet, MOST_WARNINGS, refuse, validated, warn_of_left_out};
use crate::error::{Error, Result};
use crate::memory;
use crate::mesh::{Array, Attributes, Cells, Mesh, POLYHEDRON, Polyhedra, Values};
use glam::DVec3;
use scan::{Scanner, Type};
use std::path::Path;
use structured::{Axes, Kind};

/// Reads the grid in a legacy file.
pub(super) fn read(input: &Input) -> Result<DataSet> {
    let path = &input.path;
    let bytes = input.bytes().map_err(|e| Error::file(path, e))?;
    let mut scanner = Scanner::new(&bytes);
    // "# vtk DataFile Version 4.2", a title, and how it is written.
    let version = scanner.line();
    let version: f64 = version.rsplit(' ').next().and_then(|word| word.parse().ok()).unwrap_or(1.0);
    scanner.line();
    scanner.binary = match scanner.line().to_ascii_uppercase().as_str() {
        "ASCII" => false,
        "BINARY" => true,
        other => {
            let what = format!("its third line is \"{}\", not ASCII or BINARY", other.escape_debug());
            return Err(Error::malformed(path, what));
        }
    };
    let kind = if scanner.pass("DATASET") { scanner.word("the kind of data set").ok() } else { None };
    match kind.map(|kind| kind.to_ascii_uppercase()).as_deref() {
        Some("UNSTRUCTURED_GRID") => {}
        Some("STRUCTURED_POINTS") => return structured::read(path, &mut scanner, Kind::Image),
        Some("STRUCTURED_GRID") => return structured::read(path, &mut scanner, Kind::Structured),
        Some("RECTILINEAR_GRID") => return structured::read(path, &mut scanner, Kind::Rectilinear),
        Some("POLYDATA") => return Err(refuse(path, "PolyData")),
        Some(other) => return Err(refuse(path, other)),
        None => return Err(Error::malformed(path, "there is no data set in it")),
    }
    let mut parts = Parts::default();
    let scanned = parts.scan(&mut scanner);
    if let Some(error) = scanner.lacking {
        return Err(error);
    }
    if let Err(what) = scanned {
        // Its numbers once as they are, and once as they are kept.
        memory::check_array::<u8>("another reading of the file", 2 * bytes.len())?;
        parts = Parts::parsed(&bytes).ok_or_else(|| Error::malformed(path, what))?;
    }
    parts.mesh(path, version).map(DataSet::Mesh)
}

/// What was read so far.
#[derive(Default)]
struct Parts {
    points: Option<Vec<DVec3>>,
    offsets: Option<Vec<u64>>,
    connectivity: Vec<u32>,
    types: Option<Vec<u8>>,
    /// Of points and of cells.
    arrays: [Vec<Array>; 2],
    attributes: [Attributes; 2],
    /// Which of these come now, and how many tuples they have.
    current: Option<(usize, usize)>,
    /// Which of these the file has, and how many tuples it says.
    counts: Vec<(usize, usize)>,
    /// What else was passed over.
    notes: Vec<String>,
    /// What a grid that lists no cells says of its axes.
    axes: Option<Axes>,
}

/// What the sections are called that have data of points (0) and of cells (1).
const SECTIONS: [&str; 2] = ["POINT_DATA", "CELL_DATA"];

impl Parts {
    /// Reads all sections. The error is one of points or cells.
    fn scan(&mut self, from: &mut Scanner<'_>) -> Result<(), String> {
        while !from.is_at_end() {
            let at = from.at();
            let keyword = from.word("a keyword")?.to_ascii_uppercase();
            let named = |what: String| format!("{keyword}, at byte {at}: {what}");
            match keyword.as_str() {
                "POINTS" | "CELLS" | "CELL_TYPES" => {
                    self.geometry(from, &keyword).map_err(named)?;
                    if !from.binary && from.is_at_number() {
                        return Err(named("it holds more numbers than it says".to_owned()));
                    }
                }
                "POINT_DATA" | "CELL_DATA" => {
                    let of = usize::from(keyword == SECTIONS[1]);
                    let count = from.count("its number of tuples").map_err(named)?;
                    self.current = Some((of, count));
                    self.counts.push((of, count));
                    // What follows cannot be understood.
                    if self.wrong_count().is_some() {
                        return Ok(());
                    }
                }
                _ if self.axes.as_mut().is_some_and(|axes| axes.has(&keyword)) => {
                    self.axis(from, &keyword).map_err(named)?;
                }
                _ => self.data(from, &keyword, at),
            }
            from.pass_metadata();
        }
        Ok(())
    }

    fn geometry(&mut self, from: &mut Scanner<'_>, keyword: &str) -> Result<(), String> {
        match keyword {
            "POINTS" => {
                let count = from.count("the number of points")?;
                let kind = Type::from_name(&from.word("their type")?, from.binary)?;
                let values = from.values(kind, count.checked_mul(3))?.ok_or("they are strings")?;
                from.had(memory::check_array::<DVec3>("its points", count))?;
                let coordinate = |i| values.get(i);
                let point = |p: usize| DVec3::from_array([0, 1, 2].map(|i| coordinate(3 * p + i)));
                self.points = Some((0..count).map(point).collect());
            }
            "CELLS" => self.cells(from)?,
            _ => {
                let count = from.count("the number of cells")?;
                from.enter_numbers();
                let types = from.numbers::<i32>(count)?;
                from.had(memory::check_array::<u8>("the types of its cells", count))?;
                let types = types.into_iter().enumerate();
                let narrow = |(c, kind)| u8::try_from(kind).map_err(|_| format!("the type of cell {c} is {kind}"));
                self.types = Some(types.map(narrow).collect::<Result<_, _>>()?);
            }
        }
        Ok(())
    }

    /// Cells: the number of points of each, and these; from version 5 on where each ends, and all points.
    fn cells(&mut self, from: &mut Scanner<'_>) -> Result<(), String> {
        let (count, size) = (from.count("the number of cells")?, from.count("the size of the list")?);
        self.connectivity.clear();
        if count == 0 {
            self.offsets = Some(vec![0]);
            return Ok(());
        }
        if !from.pass("OFFSETS") {
            from.enter_numbers();
            let list = from.numbers::<i32>(size)?;
            if count > size {
                return Err(format!("it says {count} cells, and lists {size} numbers"));
            }
            // What is negative is out of range in any case.
            from.had(memory::check_array::<u32>("its cells", 2 * size + 2 * count))?;
            let list: Vec<u32> = list.into_iter().map(|n| u32::try_from(n).unwrap_or(u32::MAX)).collect();
            return self.unpack(&list, count).map_err(|what| {
                let turned = list.first().is_some_and(|n| (n.swap_bytes() as usize) < size.min(1 << 16));
                let hint = if from.binary && turned {
                    "; the lowest byte seems to be first, where VTK's files have the highest"
                } else {
                    ""
                };
                what + hint
            });
        }
        let list = |from: &mut Scanner<'_>, count| -> Result<Values, String> {
            let kind = Type::from_name(&from.word("the type of the list")?, from.binary)?;
            from.values(kind, Some(count))?.ok_or_else(|| "it is a list of strings".to_owned())
        };
        let offsets = list(from, count)?;
        if !from.pass("CONNECTIVITY") {
            return Err("no CONNECTIVITY follows".to_owned());
        }
        let points = list(from, size)?;
        // Exact to 2^53; what is negative is out of range, as is what is larger.
        from.had(memory::check_array::<u64>("its cells", offsets.len() + points.len() / 2))?;
        let index = |x: f64| if x < 0.0 { u64::MAX } else { x as u64 };
        self.offsets = Some((0..offsets.len()).map(|i| index(offsets.get(i))).collect());
        let point = |i| u32::try_from(index(points.get(i))).unwrap_or(u32::MAX);
        self.connectivity = (0..points.len()).map(point).collect();
        Ok(())
    }

    /// Takes apart a list of cells: the number of points of each, and these.
    fn unpack(&mut self, list: &[u32], count: usize) -> Result<(), String> {
        let mut rest = list;
        let mut offsets = Vec::with_capacity(count.min(list.len()) + 1);
        offsets.push(0);
        while let Some((own, after)) = rest.split_first() {
            let cell = offsets.len() - 1;
            let (points, after) = after
                .split_at_checked(*own as usize)
                .ok_or_else(|| format!("cell {cell} has more points than it lists"))?;
            self.connectivity.extend_from_slice(points);
            offsets.push(self.connectivity.len() as u64);
            rest = after;
        }
        let found = offsets.len() - 1;
        if count != found {
            return Err(format!("it says {count} cells, and its {} numbers are {found}", list.len()));
        }
        self.offsets = Some(offsets);
        Ok(())
    }

    /// Says which section of data has not as many tuples as there are points or cells.
    fn wrong_count(&self) -> Option<String> {
        let there = match &self.axes {
            Some(axes) => axes.counts(),
            None => [self.points.as_ref().map(Vec::len), self.types.as_ref().map(Vec::len)],
        };
        let wrong = |(of, count): &&(usize, usize)| there[*of].is_some_and(|there| there != *count);
        let (of, count) = self.counts.iter().find(wrong)?;
        let (section, what) = (SECTIONS[*of], ["points", "cells"][*of]);
        Some(format!("{section} has {count} tuples where there are {} {what}", there[*of]?))
    }

    fn mesh(mut self, path: &Path, version: f64) -> Result<Mesh> {
        // Where a file has no points or cells at all, it has none.
        self.points.get_or_insert_default();
        self.types.get_or_insert_default();
        let wrong = self.wrong_count();
        let (points, types) = (self.points.unwrap_or_default(), self.types.unwrap_or_default());
        let (offsets, mut connectivity) = (self.offsets.unwrap_or_else(|| vec![0]), self.connectivity);
        if offsets.len() != types.len() + 1 {
            let (types, cells) = (types.len(), offsets.len().saturating_sub(1));
            return Err(Error::malformed(path, format!("CELL_TYPES has {types} types where there are {cells} CELLS")));
        }
        if let Some(what) = wrong {
            return Err(Error::malformed(path, what));
        }
        let fits = offsets.is_sorted() && offsets.last() == Some(&(connectivity.len() as u64));
        if version < 5.1 && fits {
            // From 5.1 on Lagrange hexahedra are numbered as now. VTK's reader takes Bézier hexahedra for such too.
            renumber(&[72, 79], &types, &offsets[1..], &mut connectivity);
        }
        let cells = Cells { types, offsets, connectivity };
        let (cells, polyhedra) = unfold(cells).map_err(|c| {
            let what = format!("the faces of polyhedron {c} do not fit the numbers that CELLS lists for it");
            Error::malformed(path, what)
        })?;
        let [of_points, of_cells] = self.arrays;
        let mesh = Mesh::new(points, cells, of_points, of_cells);
        let mesh = mesh.and_then(|mesh| if let Some(p) = polyhedra { mesh.with_polyhedra(p) } else { Ok(mesh) });
        let mut mesh = validated(path, mesh)?;
        let [of_points, of_cells] = told(path, self.attributes, &self.notes);
        mesh.set_attributes(of_points, of_cells);
        Ok(mesh)
    }
}

/// What is known of arrays, after the log has it.
fn told(path: &Path, mut attributes: [Attributes; 2], notes: &[String]) -> [Attributes; 2] {
    for note in notes.iter().take(MOST_WARNINGS) {
        tracing::warn!("{}: {note}", path.display());
    }
    attributes.iter_mut().for_each(|known| warn_of_left_out(path, &mut known.left_out));
    attributes
}

/// In these files a polyhedron has no points, but its faces: their number, and for each the number of its points, and
/// these. Takes them apart; the error is the cell for which that fails.
fn unfold(cells: Cells) -> Result<(Cells, Option<Polyhedra>), usize> {
    if !cells.types.contains(&POLYHEDRON) || cells.offsets.len() != cells.types.len() + 1 {
        return Ok((cells, None));
    }
    let (mut connectivity, mut offsets) = (Vec::new(), vec![0]);
    let mut polyhedra = Polyhedra { cells: vec![0], faces: vec![0], points: vec![] };
    for (c, &vtk_type) in cells.types.iter().enumerate() {
        let range = (cells.offsets[c] as usize)..(cells.offsets[c + 1] as usize);
        let mut rest = cells.connectivity.get(range).ok_or(c)?;
        if vtk_type == POLYHEDRON {
            let first = polyhedra.points.len();
            for _ in 0..*rest.split_off_first().ok_or(c)? {
                let n = *rest.split_off_first().ok_or(c)? as usize;
                polyhedra.points.extend_from_slice(rest.split_off(..n).ok_or(c)?);
                polyhedra.faces.push(polyhedra.points.len() as u64);
            }
            let mut own = polyhedra.points[first..].to_vec();
            own.sort_unstable();
            own.dedup();
            connectivity.extend(own);
        } else {
            connectivity.extend_from_slice(rest);
        }
        offsets.push(connectivity.len() as u64);
        polyhedra.cells.push(polyhedra.faces.len() as u64 - 1);
    }
    Ok((Cells { types: cells.types, offsets, connectivity }, Some(polyhedra)))
}
