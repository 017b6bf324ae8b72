//! Meshes of several files to one.

use super::validated;
use crate::error::{Error, Result};
use crate::memory;
use crate::mesh::with_values;
use crate::mesh::{Array, Attributes, Cells, Mesh, MeshParts, Polyhedra, Values};
use std::path::Path;

/// One mesh of all, in this sequence. An array that some have not, or with other components, is not a number there; of
/// several types, it becomes f64.
pub(super) fn joined(path: &Path, mut meshes: Vec<Mesh>) -> Result<Mesh> {
    if meshes.len() == 1 {
        return Ok(meshes.swap_remove(0));
    }
    let points = meshes.iter().fold(0, |sum, mesh| sum + mesh.points().len());
    if points >= u32::MAX as usize {
        let what = format!("{points} points are more than Halite can index (2^32 - 2)");
        return Err(Error::unsupported(path, what));
    }
    let bytes: u64 = meshes.iter().map(Mesh::bytes).sum();
    memory::check_array::<u8>("one mesh of all its files", bytes as usize)?;
    let mut parts: Vec<MeshParts> = meshes.into_iter().map(Mesh::into_parts).collect();
    let arrays = [0, 1].map(|of| {
        let tuples = |part: &MeshParts| if of == 0 { part.points.len() } else { part.cells.len() };
        let mut names: Vec<(String, usize)> = vec![];
        for array in parts.iter().flat_map(|part| &part.arrays[of]) {
            if names.iter().all(|(name, _)| *name != array.name) {
                names.push((array.name.clone(), array.components));
            }
        }
        let join = |(name, components): (String, usize)| {
            let found = parts.iter().map(|part| {
                let array = part.arrays[of].iter().find(|a| a.name == name && a.components == components);
                (tuples(part), array)
            });
            let found = found.collect::<Vec<_>>();
            array(path, &name, components, &found)
        };
        names.into_iter().map(join).collect::<Vec<_>>()
    });
    let attributes = [0, 1].map(|of| {
        let mut all = Attributes::default();
        for part in &mut parts {
            let own = std::mem::take(&mut part.attributes[of]);
            own.roles.iter().for_each(|(role, name)| all.add_role(*role, name));
            all.left_out.extend(own.left_out);
        }
        all
    });
    let (mut points, mut cells) = (vec![], Cells { offsets: vec![0], ..Cells::default() });
    let has_polyhedra = parts.iter().any(|part| part.polyhedra.is_some());
    let mut polyhedra = Polyhedra { cells: vec![0], faces: vec![0], points: vec![] };
    for part in parts {
        let base = points.len() as u32;
        points.extend(part.points);
        let ends = cells.connectivity.len() as u64;
        cells.offsets.extend(part.cells.offsets.iter().skip(1).map(|end| ends + end));
        cells.connectivity.extend(part.cells.connectivity.iter().map(|point| base + point));
        let count = part.cells.types.len();
        cells.types.extend(part.cells.types);
        let (first, faces) = (polyhedra.faces.len() as u64 - 1, polyhedra.points.len() as u64);
        match part.polyhedra {
            Some(own) => {
                polyhedra.cells.extend(own.cells.iter().skip(1).map(|end| first + end));
                polyhedra.faces.extend(own.faces.iter().skip(1).map(|end| faces + end));
                polyhedra.points.extend(own.points.iter().map(|point| base + point));
            }
            None => polyhedra.cells.extend(std::iter::repeat_n(first, count)),
        }
    }
    let [of_points, of_cells] = arrays;
    let mesh = Mesh::new(points, cells, of_points, of_cells);
    let mesh = mesh.and_then(|mesh| if has_polyhedra { mesh.with_polyhedra(polyhedra) } else { Ok(mesh) });
    let mut mesh = validated(path, mesh)?;
    let [of_points, of_cells] = attributes;
    mesh.set_attributes(of_points, of_cells);
    Ok(mesh)
}

/// One array of its parts, each with the number of its tuples.
fn array(path: &Path, name: &str, components: usize, parts: &[(usize, Option<&Array>)]) -> Array {
    // No mark is a mark for nothing hidden.
    let missing = if name == "vtkGhostType" { 0.0 } else { f64::NAN };
    let lacking = parts.iter().filter(|(tuples, array)| *tuples > 0 && array.is_none()).count();
    if lacking > 0 && missing.is_nan() {
        let (path, all) = (path.display(), parts.len());
        tracing::warn!("{path}: {lacking} of its {all} files have no array \"{name}\": it is not a number there");
    }
    let first = parts.iter().find_map(|(_, array)| *array);
    let alike = |of: &Array| {
        parts.iter().all(|(tuples, array)| array.map_or(*tuples == 0, |array| same_type(&array.values, &of.values)))
    };
    let values = match first {
        Some(first) if alike(first) => concatenated(&first.values, parts.iter().filter_map(|(_, array)| *array)),
        _ => {
            let mut all = vec![];
            for (tuples, array) in parts {
                match array {
                    Some(array) => all.extend((0..array.values.len()).map(|i| array.values.get(i))),
                    None => all.resize(all.len() + tuples * components, missing),
                }
            }
            Values::F64(all)
        }
    };
    Array { name: name.to_owned(), components, values }
}

fn same_type(a: &Values, b: &Values) -> bool {
    std::mem::discriminant(a) == std::mem::discriminant(b)
}

/// All values, which are of the type of `first`.
fn concatenated<'a>(first: &Values, arrays: impl Iterator<Item = &'a Array>) -> Values {
    let mut all = first.clone();
    with_values!(&mut all, v => v.clear());
    for array in arrays {
        append(&mut all, &array.values);
    }
    all
}

/// Appends values of the same type.
fn append(all: &mut Values, more: &Values) {
    macro_rules! append {
        ($($variant:ident),*) => {
            match (all, more) {
                $((Values::$variant(all), Values::$variant(more)) => all.extend_from_slice(more),)*
                _ => {}
            }
        };
    }
    append!(I8, U8, I16, U16, I32, U32, I64, U64, F32, F64);
}
