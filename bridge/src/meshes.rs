//! What C++ asks a mesh.

use super::bridge::{ArrayInfo, CellCount, Type};
use glam::DVec3;
use halite::error::{Error, Result};
use halite::host::guard;
use halite::memory;
use halite::mesh::cells::name;
use halite::mesh::{Array, Mesh, Values};

/// Arrays of points first, then those of cells.
fn all_arrays(mesh: &Mesh) -> impl Iterator<Item = (bool, &Array)> {
    mesh.point_arrays().iter().map(|a| (false, a)).chain(mesh.cell_arrays().iter().map(|a| (true, a)))
}

pub(super) fn array(mesh: &Mesh, index: usize) -> Result<(bool, &Array)> {
    all_arrays(mesh).nth(index).ok_or_else(|| Error::Field(format!("the mesh has no array {index}")))
}

pub(super) fn arrays(mesh: &Mesh) -> Result<Vec<ArrayInfo>> {
    let kind = |v: &Values| match v {
        Values::I8(_) => Type::I8,
        Values::U8(_) => Type::U8,
        Values::I16(_) => Type::I16,
        Values::U16(_) => Type::U16,
        Values::I32(_) => Type::I32,
        Values::U32(_) => Type::U32,
        Values::I64(_) => Type::I64,
        Values::U64(_) => Type::U64,
        Values::F32(_) => Type::F32,
        Values::F64(_) => Type::F64,
    };
    let info = |(of_cells, a): (bool, &Array)| ArrayInfo {
        name: a.name.clone(),
        of_cells,
        kind: kind(&a.values),
        components: a.components,
        tuples: a.tuples(),
    };
    guard(|| Ok(all_arrays(mesh).map(info).collect()))
}

pub(super) fn array_values(mesh: &Mesh, index: usize) -> Result<Vec<f64>> {
    guard(|| {
        let (_, array) = array(mesh, index)?;
        memory::check_array::<f64>("the values of an array", array.values.len())?;
        Ok((0..array.values.len()).map(|i| array.values.get(i)).collect())
    })
}

pub(super) fn cell_counts(mesh: &Mesh) -> Result<Vec<CellCount>> {
    guard(|| {
        let mut counts = [0; 256];
        mesh.cells().types.iter().for_each(|&t| counts[usize::from(t)] += 1);
        let count = |t: u8| CellCount { vtk_type: t, name: name(t).into(), count: counts[usize::from(t)] };
        Ok((0..=255).map(count).filter(|c| c.count > 0).collect())
    })
}

pub(super) fn points(mesh: &Mesh) -> Result<Vec<f64>> {
    guard(|| {
        memory::check_array::<DVec3>("the points of a mesh", mesh.points().len())?;
        Ok(mesh.points().iter().flat_map(DVec3::to_array).collect())
    })
}

pub(super) fn types(mesh: &Mesh) -> Result<Vec<u8>> {
    guard(|| Ok(mesh.cells().types.clone()))
}

pub(super) fn offsets(mesh: &Mesh) -> Result<Vec<u64>> {
    guard(|| Ok(mesh.cells().offsets.clone()))
}

pub(super) fn connectivity(mesh: &Mesh) -> Result<Vec<u32>> {
    guard(|| Ok(mesh.cells().connectivity.clone()))
}
