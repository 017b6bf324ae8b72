//! What vtkio parses of a legacy file.

use super::Parts;
use super::data::decoded;
use crate::mesh::{Array, Values};
use glam::DVec3;
use std::panic::catch_unwind;
use vtkio::model::{Attribute, CellType, DataSet, ElementType, IOBuffer, Piece, VertexNumbers};

impl Parts {
    /// The grid in `bytes`, if vtkio parses all of it and keeps each array that it finds. It panics on some input, stops
    /// without a word before what it does not know (NaN in text, ids, types that are not C's, field data before the
    /// points), and forgets all but the last section of data of points and of cells: so it is asked last.
    pub(super) fn parsed(bytes: &[u8]) -> Option<Self> {
        let (rest, vtk) = catch_unwind(|| vtkio::parser::parse_be(bytes).ok()).ok().flatten()?;
        if !rest.is_empty() {
            return None;
        }
        let DataSet::UnstructuredGrid { pieces, .. } = vtk.data else { return None };
        let Some(Piece::Inline(piece)) = pieces.into_iter().next() else { return None };
        let coordinates = values(piece.points)?;
        let point = |p: usize| DVec3::from_array([0, 1, 2].map(|i| coordinates.get(3 * p + i)));
        let points: Vec<DVec3> = (0..coordinates.len() / 3).map(point).collect();
        let types: Vec<u8> = piece.cells.types.iter().map(|kind: &CellType| *kind as u8).collect();
        let arrays = [arrays(piece.data.point, points.len())?, arrays(piece.data.cell, types.len())?];
        let mut parts = Parts { points: Some(points), types: Some(types), arrays, ..Parts::default() };
        match piece.cells.cell_verts {
            VertexNumbers::Legacy { num_cells, vertices } => parts.unpack(&vertices, num_cells as usize).ok()?,
            VertexNumbers::XML { connectivity, offsets } => {
                // An index that does not fit is out of range in any case.
                let narrow = |point: u64| u32::try_from(point).unwrap_or(u32::MAX);
                parts.offsets = Some(offsets);
                parts.connectivity = connectivity.into_iter().map(narrow).collect();
            }
        }
        Some(parts)
    }
}

/// None if one would be lost, or is not as long as `tuples` ask: bits are taken for bytes.
fn arrays(attributes: Vec<Attribute>, tuples: usize) -> Option<Vec<Array>> {
    let mut arrays = Vec::new();
    for attribute in attributes {
        let found = match attribute {
            Attribute::DataArray(array) if array.elem == ElementType::LookupTable => vec![],
            Attribute::DataArray(array) => vec![(array.name, array.elem.num_comp(), array.data)],
            Attribute::Field { data_array, .. } => data_array.into_iter().map(|a| (a.name, a.elem, a.data)).collect(),
        };
        for (name, components, data) in found {
            let (values, components) = (values(data)?, components as usize);
            if Some(values.len()) != components.checked_mul(tuples) {
                return None;
            }
            arrays.push(Array { name: decoded(&name), components, values });
        }
    }
    Some(arrays)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_vtkio_would_lose_is_not_taken_from_it() {
        let file = |value: &str| {
            let head = "# vtk DataFile Version 3.0\none cell\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n";
            let cells = "0 0 0 1 0 0 0 1 0 0 0 1\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n";
            format!("{head}{cells}POINT_DATA 4\nSCALARS s float 1\nLOOKUP_TABLE default\n1 2 3 {value}\n")
        };
        let parts = Parts::parsed(file("4").as_bytes());
        assert!(parts.is_some_and(|p| p.connectivity == [0, 1, 2, 3] && p.arrays[0][0].values.get(3) == 4.0));
        assert!(Parts::parsed(file("nan").as_bytes()).is_none());
    }
}
