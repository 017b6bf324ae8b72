//! Which array is drawn when nobody says.

use crate::error::{Error, Result};
use crate::field::{Association, Component};
use crate::mesh::{Array, Mesh, Role, Values};
use crate::scene::Scalars;
use glam::DVec3;

/// Tuples that are looked at, at most.
const SAMPLES: usize = 1 << 12;

/// How useful a picture of an array is: the later, the less.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Use {
    /// It holds values.
    Values,
    /// It serves the drawing of surfaces, or the shape of cells.
    Auxiliary,
    /// It tells points, cells or materials apart.
    Identifiers,
    /// It says where points or cells are, which is seen anyway.
    Coordinates,
    /// It marks what is hidden.
    Marks,
    /// It has no finite value.
    Nothing,
}

/// The array that says most, and why it is that one: the active scalars or vectors of the file before others, real
/// numbers before integers, points before cells, scalars before vectors. Identifiers and coordinates, by role, name or
/// value, only where there is nothing else.
///
/// # Errors
/// [`Error::Field`] if there is no array.
pub fn chosen(mesh: &Mesh, of: Option<Association>) -> Result<(Scalars, String)> {
    let points = mesh.point_arrays().iter().map(|a| (Association::Point, mesh.point_attributes(), a));
    let cells = mesh.cell_arrays().iter().map(|a| (Association::Cell, mesh.cell_attributes(), a));
    let all: Vec<_> = points.chain(cells).filter(|(a, ..)| of.is_none_or(|of| of == *a)).collect();
    let ranked = all.iter().map(|(association, known, array)| {
        let role = known.role(&array.name);
        let usage = usage(mesh, *association, array, role);
        let active = match role {
            Some(Role::Scalars) => 0,
            Some(Role::Vectors) => 1,
            _ => 2,
        };
        let integer = !is_real(array);
        let key = (usage, active, !varies(array), integer, *association == Association::Cell, array.components > 1);
        (key, *association, *array)
    });
    let Some(((usage, active, ..), association, array)) = ranked.min_by_key(|(key, ..)| *key) else {
        let of = match of {
            Some(Association::Point) => "points",
            Some(Association::Cell) => "cells",
            None => "points or cells",
        };
        return Err(Error::Field(format!("it has no array of {of}, so no values to draw")));
    };
    let why = match (usage, active) {
        _ if all.len() == 1 => "it is the only array",
        (Use::Values, 0) => "the file says that it is the active scalars",
        (Use::Values, 1) => "the file says that it is the active vectors",
        (Use::Values, _) => {
            "no array is said to be active; values that vary come first, then real numbers, then points"
        }
        _ => "the others are identifiers, coordinates, marks or not finite, too",
    };
    let component = if array.components > 1 { Component::Magnitude } else { Component::Index(0) };
    let scalars = Scalars { name: array.name.clone(), association: Some(association), component: Some(component) };
    Ok((scalars, why.to_owned()))
}

fn is_real(array: &Array) -> bool {
    matches!(array.values, Values::F32(_) | Values::F64(_))
}

fn varies(array: &Array) -> bool {
    let mut finite = (0..array.values.len()).map(|i| array.values.get(i)).filter(|v| v.is_finite());
    let first = finite.next();
    finite.any(|v| Some(v) != first)
}

fn usage(mesh: &Mesh, association: Association, array: &Array, role: Option<Role>) -> Use {
    let words = words(&array.name);
    let joined = words.concat();
    let has = |list: &[&str]| words.iter().any(|word| list.contains(&word.as_str()));
    if (0..array.values.len()).all(|i| !array.values.get(i).is_finite()) {
        return Use::Nothing;
    }
    if ["vtkghosttype", "vtkghostlevels", "vtkvalidpointmask", "vtkghostnodes"].contains(&joined.as_str()) {
        return Use::Marks;
    }
    let named = array.components == 3 && has(&["coordinate", "coordinates", "coord", "coords", "xyz", "centroid"]);
    if named || association == Association::Point && (are_points(mesh, array) || are_axis(mesh, array, &words)) {
        return Use::Coordinates;
    }
    match role {
        Some(Role::GlobalIds | Role::PedigreeIds) => return Use::Identifiers,
        Some(Role::Scalars | Role::Vectors | Role::Tensors) | None => {}
        Some(_) => return Use::Auxiliary,
    }
    if array.components == 1 && (is_numbering(array) || is_named_identifier(&words) && is_whole(array)) {
        return Use::Identifiers;
    }
    if array.components > 1 && has(&["normal", "normals", "tcoords", "tangents"]) {
        return Use::Auxiliary;
    }
    Use::Values
}

/// The words of a name in lower case: parted by what is no letter or digit, and where a capital follows a small letter.
fn words(name: &str) -> Vec<String> {
    let (mut words, mut last) = (vec![String::new()], ' ');
    for c in name.chars() {
        let starts = c.is_uppercase() && last.is_lowercase();
        if starts || !c.is_alphanumeric() {
            words.push(String::new());
        }
        if let (true, Some(word)) = (c.is_alphanumeric(), words.last_mut()) {
            word.extend(c.to_lowercase());
        }
        last = c;
    }
    words.retain(|word| !word.is_empty());
    words
}

/// Words that say by themselves that numbers are names of something.
const IDENTIFIERS: [&str; 14] =
    ["id", "ids", "gid", "gids", "eid", "nid", "label", "labels", "tag", "tags", "marker", "markers", "rank", "ranks"];

/// What things are called that are numbered: alone, or before "id", they name an identifier.
const THINGS: [&str; 36] = [
    "attribute",
    "block",
    "blocks",
    "body",
    "cell",
    "domain",
    "elem",
    "element",
    "entity",
    "face",
    "geometrical",
    "geometry",
    "global",
    "group",
    "layer",
    "mat",
    "material",
    "materials",
    "mesh",
    "node",
    "object",
    "original",
    "owner",
    "part",
    "partition",
    "pedigree",
    "physical",
    "point",
    "proc",
    "process",
    "processor",
    "region",
    "set",
    "subdomain",
    "vertex",
    "zone",
];

/// Words that say nothing more.
const FILLERS: [&str; 9] = ["gmsh", "medit", "vtk", "mpi", "number", "no", "num", "ref", "index"];

fn is_named_identifier(words: &[String]) -> bool {
    let is = |list: &[&str], word: &str| list.contains(&word);
    let numbered = |word: &str| {
        let stem = word.strip_suffix("ids").or_else(|| word.strip_suffix("id"));
        stem.is_some_and(|stem| THINGS.iter().any(|thing| stem.ends_with(thing)))
    };
    let all = words.iter().all(|word| is(&THINGS, word) || is(&FILLERS, word));
    words.iter().any(|word| is(&IDENTIFIERS, word) || numbered(word))
        || all && words.iter().any(|word| is(&THINGS, word))
}

/// Indices of some of `count` tuples.
fn sample(count: usize) -> impl Iterator<Item = usize> {
    (0..count).step_by(count.div_ceil(SAMPLES).max(1))
}

fn is_whole(array: &Array) -> bool {
    !is_real(array) || sample(array.values.len()).all(|i| array.values.get(i).fract() == 0.0)
}

/// Whether integers count on by one from tuple to tuple.
fn is_numbering(array: &Array) -> bool {
    let first = array.values.get(0);
    !is_real(array)
        && array.values.len() > 2
        && (0..array.values.len()).all(|i| array.values.get(i) == first + i as f64)
}

/// What rounding to f32 changes of coordinates at most.
fn tolerance(mesh: &Mesh) -> f64 {
    let finite = mesh.points().iter().filter(|p| p.is_finite());
    1e-6 * finite.fold(0.0, |most: f64, p| most.max(p.abs().max_element()))
}

/// Whether an array of points holds their coordinates.
fn are_points(mesh: &Mesh, array: &Array) -> bool {
    let (points, tolerance) = (mesh.points(), tolerance(mesh));
    let same = |i: usize| {
        let own = DVec3::from_array([0, 1, 2].map(|k| array.values.get(3 * i + k)));
        (own - points[i]).abs().max_element() <= tolerance || !own.is_finite()
    };
    array.components == 3 && points.len() > 1 && sample(points.len()).all(same)
}

/// Whether an array of points holds a coordinate, and is called so.
fn are_axis(mesh: &Mesh, array: &Array, words: &[String]) -> bool {
    let called = ["x", "y", "z", "coordinate", "coordinates", "coord", "coords", "points", "point"];
    let (points, tolerance) = (mesh.points(), tolerance(mesh));
    let same = |k: usize| sample(points.len()).all(|i| (array.values.get(i) - points[i][k]).abs() <= tolerance);
    array.components == 1
        && !words.is_empty()
        && words.iter().all(|word| called.contains(&word.as_str()))
        && (0..3).any(same)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Attributes, generate};

    fn array(name: &str, components: usize, values: Values) -> Array {
        Array { name: name.to_owned(), components, values }
    }

    /// The name of what is chosen of a mesh with these arrays of points.
    fn of(arrays: Vec<Array>, roles: &[(Role, &str)]) -> String {
        let plain = generate::tetrahedra(2);
        let mut mesh = Mesh::new(plain.points().to_vec(), plain.cells().clone(), arrays, vec![]).unwrap();
        let roles = roles.iter().map(|(role, name)| (*role, (*name).to_owned())).collect();
        mesh.set_attributes(Attributes { roles, left_out: vec![] }, Attributes::default());
        chosen(&mesh, None).unwrap().0.name
    }

    #[test]
    fn identifiers_and_coordinates_come_last() {
        let points = generate::tetrahedra(2).points().to_vec();
        let n = points.len();
        let odd = |name: &str| array(name, 1, Values::I32((0..n as i32).map(|i| i * 7 % 5).collect()));
        for name in [
            "GLOBAL_IDS_POINTS",
            "MaterialIDs",
            "materialids",
            "GlobalNodeId",
            "vtkOriginalPointIds",
            "cell_id",
            "id",
            "gmsh:physical",
            "medit:ref",
            "material",
            "mpi_rank",
            "PartitionId",
            "region",
            "node_tags",
            "procid",
        ] {
            let named = is_named_identifier(&words(name));
            assert!(named || name == "medit:ref", "{name}");
            let expected = if named { "plain" } else { name };
            assert_eq!(of(vec![odd(name), odd("plain")], &[(Role::Scalars, name)]), expected);
        }
        for name in ["Temp", "solid", "fluid fraction", "pressure", "V", "partial pressure", "index of refraction"] {
            assert_eq!(of(vec![odd(name), odd("plain")], &[]), name);
        }
        // Real numbers are identifiers by name only if they are whole.
        let real =
            |name: &str, step: f64| array(name, 1, Values::F64((0..n).map(|i| step * (i * 7 % 5) as f64).collect()));
        assert_eq!(of(vec![real("id", 1.0), odd("plain")], &[]), "plain");
        assert_eq!(of(vec![real("id", 0.3), odd("plain")], &[]), "id");
        assert_eq!(of(vec![array("n", 1, Values::I64((5..5 + n as i64).collect())), odd("plain")], &[]), "plain");
        let places: Vec<f32> = points.iter().flat_map(|p| p.as_vec3().to_array()).collect();
        let places = array("CartesianCoordinate", 3, Values::F32(places));
        assert_eq!(of(vec![places.clone(), odd("plain")], &[(Role::Vectors, "CartesianCoordinate")]), "plain");
        assert_eq!(of(vec![Array { name: "r".into(), ..places.clone() }, odd("id")], &[]), "id");
        assert_eq!(of(vec![places.clone()], &[]), "CartesianCoordinate");
        let nothing = array("nan", 1, Values::F64(vec![f64::NAN; n]));
        assert_eq!(of(vec![nothing, places], &[]), "CartesianCoordinate");
    }

    #[test]
    fn the_active_array_comes_first() {
        let n = generate::tetrahedra(2).points().len();
        let real = |name: &str| array(name, 1, Values::F64((0..n).map(|i| 0.3 * i as f64).collect()));
        let vectors = array("v", 3, Values::F32((0..3 * n).map(|i| i as f32 * 0.7).collect()));
        let all = || vec![real("a"), vectors.clone(), real("b")];
        assert_eq!(of(all(), &[]), "a");
        assert_eq!(of(all(), &[(Role::Scalars, "b")]), "b");
        assert_eq!(of(all(), &[(Role::Vectors, "v")]), "v");
        assert_eq!(of(all(), &[(Role::Vectors, "v"), (Role::Scalars, "b")]), "b");
        assert_eq!(of(all(), &[(Role::GlobalIds, "a")]), "b");
        assert_eq!(of(all(), &[(Role::Scalars, "gone")]), "a");
    }
}
