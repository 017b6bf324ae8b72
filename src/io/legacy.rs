//! Legacy .vtk files, read by vtkio.

use super::{refuse, validated};
use crate::error::{Error, Result};
use crate::mesh::{Array, Cells, Mesh, Values};
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
    mesh(path, *piece)
}

fn mesh(path: &Path, piece: UnstructuredGridPiece) -> Result<Mesh> {
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
    let cells = Cells { types, offsets, connectivity };
    validated(path, Mesh::new(points, cells, arrays(piece.data.point), arrays(piece.data.cell)))
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
