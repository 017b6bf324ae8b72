//! Legacy .vtk files, read by vtkio.

use super::vtu::renumber;
use super::{refuse, validated};
use crate::error::{Error, Result};
use crate::mesh::{Array, Cells, Mesh, POLYHEDRON, Polyhedra, Values};
use glam::DVec3;
use std::fs::File;
use std::io::{Read, Seek};
use std::panic::catch_unwind;
use std::path::Path;
use vtkio::model::{Attribute, CellType, DataSet, IOBuffer, Piece, UnstructuredGridPiece, VertexNumbers};

/// Reads the unstructured grid in a legacy file, ascii or binary, versions 1 to 5.1.
///
/// vtkio does not read every array that VTK writes (NaN in ascii, ids, field data before the points): it then fails, or stops in
/// the middle of the file. Either is an error here, so that no array is lost without a word.
pub(super) fn read(path: &Path, file: &mut File) -> Result<Mesh> {
    let mut bytes = Vec::new();
    file.rewind().and_then(|()| file.read_to_end(&mut bytes)).map_err(|e| Error::file(path, e))?;
    // "# vtk DataFile Version 4.2": from 5.1 on Lagrange hexahedra are numbered as now.
    let version = bytes.get(23..26).and_then(|v| std::str::from_utf8(v).ok()?.trim().parse().ok());
    let old_numbering = version.is_some_and(|version: f64| version < 5.1);
    skip_field_data(&mut bytes);
    let bytes = rename_types(&bytes);
    let help = "; a .vtu file of the same grid will do";
    let parsed = catch_unwind(|| match vtkio::parser::parse_be(&bytes) {
        Ok((rest, vtk)) => Some((rest.len(), vtk.data)),
        Err(_) => None,
    });
    let Ok(Some((rest, data))) = parsed else {
        return Err(Error::malformed(path, format!("vtkio cannot parse this legacy file{help}")));
    };
    let piece = match data {
        DataSet::UnstructuredGrid { pieces, .. } => pieces.into_iter().next(),
        DataSet::ImageData { .. } => return Err(refuse(path, "ImageData")),
        DataSet::StructuredGrid { .. } => return Err(refuse(path, "StructuredGrid")),
        DataSet::RectilinearGrid { .. } => return Err(refuse(path, "RectilinearGrid")),
        DataSet::PolyData { .. } => return Err(refuse(path, "PolyData")),
        DataSet::Field { .. } => return Err(refuse(path, "FieldData")),
    };
    if rest > 0 {
        let at = bytes.len() - rest;
        let next: String = String::from_utf8_lossy(&bytes[at..bytes.len().min(at + 40)]).escape_debug().collect();
        return Err(Error::unsupported(path, format!("vtkio stops at byte {at}, at \"{next}\"{help}")));
    }
    let Some(Piece::Inline(piece)) = piece else { return Err(Error::malformed(path, "there is no grid in it")) };
    mesh(path, *piece, old_numbering)
}

fn mesh(path: &Path, piece: UnstructuredGridPiece, old_numbering: bool) -> Result<Mesh> {
    let fail = |what: &str| Error::malformed(path, what);
    let coordinates = values(piece.points).ok_or_else(|| fail("the points are not numbers"))?;
    let points =
        (0..coordinates.len() / 3).map(|p| DVec3::from_array([0, 1, 2].map(|i| coordinates.get(3 * p + i)))).collect();
    let types: Vec<u8> = piece.cells.types.iter().map(|kind: &CellType| *kind as u8).collect();
    let (offsets, connectivity) = match piece.cells.cell_verts {
        VertexNumbers::Legacy { vertices, .. } => {
            let (mut offsets, mut connectivity, mut rest) = (vec![0], Vec::new(), &vertices[..]);
            while let Some((count, after)) = rest.split_first() {
                let cell = offsets.len() - 1;
                let points = after.split_at_checked(*count as usize);
                let (points, after) =
                    points.ok_or_else(|| fail(&format!("cell {cell} has more points than CELLS lists")))?;
                connectivity.extend_from_slice(points);
                offsets.push(connectivity.len() as u64);
                rest = after;
            }
            (offsets, connectivity)
        }
        VertexNumbers::XML { connectivity, offsets } => {
            // An index that does not fit is out of range in any case.
            let narrow = |point: u64| u32::try_from(point).unwrap_or(u32::MAX);
            (offsets, connectivity.into_iter().map(narrow).collect())
        }
    };
    let mut cells = Cells { types, offsets, connectivity };
    let fits = cells.offsets.is_sorted() && cells.offsets.last() == Some(&(cells.connectivity.len() as u64));
    if old_numbering && fits && cells.offsets.len() == cells.types.len() + 1 {
        // VTK's reader takes Bézier hexahedra for such too.
        renumber(&[72, 79], &cells.types, &cells.offsets[1..], &mut cells.connectivity);
    }
    let (cells, polyhedra) = unfold(cells)
        .map_err(|c| fail(&format!("the faces of polyhedron {c} do not fit the numbers that CELLS lists for it")))?;
    let mesh = Mesh::new(points, cells, arrays(piece.data.point), arrays(piece.data.cell));
    validated(path, mesh.and_then(|mesh| if let Some(p) = polyhedra { mesh.with_polyhedra(p) } else { Ok(mesh) }))
}

/// In these files a polyhedron has no points, but its faces: their number, and for each the number of its points, and these. Takes
/// them apart; the error is the cell for which that fails.
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

/// Gives number types the names by which vtkio knows them, in the lines that announce arrays.
fn rename_types(bytes: &[u8]) -> Vec<u8> {
    let names: [(&[u8], &[u8]); 3] =
        [(b" vtktypeint64", b" long"), (b" vtktypeuint64", b" unsigned_long"), (b" signed_char", b" char")];
    let mut out = Vec::with_capacity(bytes.len());
    for (i, line) in bytes.split(|b| *b == b'\n').enumerate() {
        if i > 0 {
            out.push(b'\n');
        }
        let announces = line.len() < 1000 && line.iter().all(|b| b.is_ascii_graphic() || *b == b' ' || *b == b'\r');
        let words = line.split(|b| *b == b' ').take(4).count();
        // The cells' own lines have two words, and vtkio knows their types.
        let renamed = |(from, to): &(&'static [u8], &'static [u8])| {
            let at = line.windows(from.len()).position(|w| w == *from)?;
            Some([&line[..at], *to, &line[at + from.len()..]])
        };
        let found = if announces && words >= 3 { names.iter().find_map(renamed) } else { None };
        match found {
            Some(parts) => parts.iter().for_each(|part| out.extend_from_slice(part)),
            None => out.extend_from_slice(line),
        }
    }
    out
}

/// Takes out the field data between DATASET and POINTS, such as the time of a step, which vtkio does not expect there. Leaves
/// what does not look like that.
fn skip_field_data(bytes: &mut Vec<u8>) {
    let line = |at: usize| {
        let end = bytes[at..].iter().position(|b| *b == b'\n').map_or(bytes.len(), |n| at + n);
        (String::from_utf8_lossy(&bytes[at..end]).into_owned(), (end + 1).min(bytes.len()))
    };
    let (mut at, mut lines) = (0, Vec::new());
    for _ in 0..4 {
        let (text, next) = line(at);
        lines.push(text);
        at = next;
    }
    let (binary, start) = (lines[2].trim().eq_ignore_ascii_case("BINARY"), at);
    let (field, mut at) = line(at);
    let words: Vec<&str> = field.split_whitespace().collect();
    let (["FIELD", _, count], true) = (&words[..], lines[3].starts_with("DATASET")) else { return };
    for _ in 0..count.parse().unwrap_or(0_usize) {
        let (mut text, mut next) = line(at);
        while text.trim().is_empty() && next > at {
            at = next;
            (text, next) = line(at);
        }
        let words: Vec<&str> = text.split_whitespace().collect();
        let [_, components, tuples, kind] = words[..] else { return };
        let (Ok(components), Ok(tuples)) = (components.parse::<usize>(), tuples.parse::<usize>()) else { return };
        let Some(numbers) = components.checked_mul(tuples) else { return };
        let size = match kind {
            "char" | "unsigned_char" | "signed_char" => 1,
            "short" | "unsigned_short" => 2,
            "int" | "unsigned_int" | "float" | "vtkIdType" => 4,
            "long" | "unsigned_long" | "double" | "vtktypeint64" | "vtktypeuint64" => 8,
            // Of strings, each takes a line in ascii.
            "string" if !binary => 0,
            _ => return,
        };
        at = next;
        if size == 0 {
            for _ in 0..numbers.min(bytes.len()) {
                at = line(at).1;
            }
        } else if binary {
            let Some(end) = numbers.checked_mul(size).and_then(|n| at.checked_add(n)).filter(|end| *end <= bytes.len())
            else {
                return;
            };
            at = end;
        } else {
            for _ in 0..numbers {
                if at == bytes.len() {
                    return;
                }
                at += bytes[at..].iter().take_while(|b| b.is_ascii_whitespace()).count();
                at += bytes[at..].iter().take_while(|b| !b.is_ascii_whitespace()).count();
            }
        }
    }
    // Up to the next keyword; a description of the arrays may be in between.
    if let Some(points) = bytes[at - 1..].windows(7).position(|w| w.eq_ignore_ascii_case(b"\nPOINTS")) {
        let points = at - 1 + points;
        let between = String::from_utf8_lossy(&bytes[at..points.max(at)]).into_owned();
        if between.trim().is_empty() || between.trim_start().starts_with("METADATA") {
            bytes.drain(start..=points);
        }
    }
}

fn arrays(attributes: Vec<Attribute>) -> Vec<Array> {
    let mut arrays = Vec::new();
    let mut add = |name: &str, components: u32, data: IOBuffer| match values(data) {
        Some(values) => arrays.push(Array { name: decoded(name), components: components as usize, values }),
        None => tracing::warn!("array \"{name}\" is left out: its type is bit"),
    };
    for attribute in attributes {
        match attribute {
            Attribute::DataArray(array) if array.elem != vtkio::model::ElementType::LookupTable => {
                add(&array.name, array.elem.num_comp(), array.data);
            }
            Attribute::DataArray(_) => {}
            Attribute::Field { data_array, .. } => {
                data_array.into_iter().for_each(|array| add(&array.name, array.elem, array.data));
            }
        }
    }
    arrays
}

fn values(data: IOBuffer) -> Option<Values> {
    Some(match data {
        IOBuffer::Bit(_) => return None,
        IOBuffer::I8(v) => Values::I8(v),
        IOBuffer::U8(v) => Values::U8(v),
        IOBuffer::I16(v) => Values::I16(v),
        IOBuffer::U16(v) => Values::U16(v),
        IOBuffer::I32(v) => Values::I32(v),
        IOBuffer::U32(v) => Values::U32(v),
        IOBuffer::I64(v) => Values::I64(v),
        IOBuffer::U64(v) => Values::U64(v),
        IOBuffer::F32(v) => Values::F32(v),
        IOBuffer::F64(v) => Values::F64(v),
    })
}

/// VTK writes the spaces and other odd characters of a name as `%20`.
fn decoded(name: &str) -> String {
    let mut bytes = Vec::with_capacity(name.len());
    let mut rest = name.as_bytes();
    while let Some((byte, after)) = rest.split_first() {
        let code = after.get(..2).and_then(|hex| u8::from_str_radix(std::str::from_utf8(hex).ok()?, 16).ok());
        match code {
            Some(code) if *byte == b'%' => {
                bytes.push(code);
                rest = &after[2..];
            }
            _ => {
                bytes.push(*byte);
                rest = after;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}
