//! Any cells on few points: what is split and matched must hang together. `cargo fuzz run mesh -- -max_len=2048`
#![no_main]

use glam::DVec3;
use halite::mesh::cells::Tetrahedra;
use halite::mesh::faces::{BOUNDARY, Faces};
use halite::mesh::{Array, Cells, Mesh, Polyhedra, Values};
use libfuzzer_sys::fuzz_target;

/// Coordinates that a byte stands for: some equal, some extreme, most near each other.
fn coordinate(byte: u8) -> f64 {
    match byte {
        0..=9 => f64::from(byte),
        250 => f64::NAN,
        251 => f64::INFINITY,
        252 => 1e300,
        253 => -1e-300,
        254 => 5e-324,
        255 => -0.0,
        _ => f64::from(byte) / 37.0,
    }
}

const TYPES: [u8; 32] = [
    1, 5, 10, 10, 11, 12, 12, 13, 14, 15, 16, 24, 25, 26, 27, 29, 31, 32, 33, 37, 41, 42, 42, 42, 71, 72, 73, 74, 78, 79, 80, 99,
];
/// The numbers of points that these need; of lists of faces, of points in them.
fn size(vtk_type: u8, byte: u8) -> usize {
    match vtk_type {
        1 => 1,
        5 => 3,
        10 => 4,
        11 | 12 => 8,
        13 => 6,
        14 => 5,
        15 => 10,
        16 => 12,
        24 => 10,
        25 => 20,
        26 => 15,
        27 => 13,
        29 => 27,
        31 => 12,
        32 => 18,
        33 => 24,
        37 => 19,
        71 | 78 => [4, 10, 15, 20][usize::from(byte) % 4],
        72 | 79 => [8, 27, 12, 18][usize::from(byte) % 4],
        73 | 80 => [6, 18, 21, 12][usize::from(byte) % 4],
        _ => usize::from(byte) % 9,
    }
}

fuzz_target!(|bytes: &[u8]| {
    let mut bytes = bytes.iter().copied();
    let mut next = || bytes.next();
    let Some(n) = next() else { return };
    let n = usize::from(n) % 40 + 1;
    let mut points = vec![];
    for _ in 0..n {
        let p = [(); 3].map(|()| coordinate(next().unwrap_or(0)));
        points.push(DVec3::from(p));
    }
    let id = |byte: u8| u32::from(byte) % n as u32;
    let mut cells = Cells { types: vec![], offsets: vec![0], connectivity: vec![] };
    let mut faces = Polyhedra { cells: vec![0], faces: vec![0], points: vec![] };
    let mut degrees = vec![];
    while let (Some(t), Some(extra)) = (next(), next()) {
        let vtk_type = TYPES[usize::from(t) % TYPES.len()];
        for _ in 0..size(vtk_type, extra) {
            cells.connectivity.push(id(next().unwrap_or(0)));
        }
        if vtk_type == 42 {
            for _ in 0..extra % 12 {
                for _ in 0..next().unwrap_or(0) % 9 {
                    faces.points.push(id(next().unwrap_or(0)));
                }
                faces.faces.push(faces.points.len() as u64);
            }
        }
        degrees.extend([extra % 4, extra / 4 % 4, extra / 16 % 4]);
        cells.types.push(vtk_type);
        cells.offsets.push(cells.connectivity.len() as u64);
        faces.cells.push(faces.faces.len() as u64 - 1);
    }
    let count = cells.types.len();
    let array = |name: &str, components, values| Array { name: name.to_owned(), components, values };
    let ghosts = array("vtkGhostType", 1, Values::U8((0..count).map(|c| u8::from(c % 7 == 6)).collect()));
    let of_cells = vec![array("HigherOrderDegrees", 3, Values::U8(degrees)), ghosts];
    let weights = array("RationalWeights", 1, Values::F64(points.iter().map(|p| p.x).collect()));
    let Ok(mesh) = Mesh::new(points, cells, vec![weights], of_cells).and_then(|m| m.with_polyhedra(faces)) else {
        panic!("the parts fit together");
    };
    let Ok(tetrahedra) = Tetrahedra::new(&mesh) else { return };
    let points = tetrahedra.points(mesh.points());
    assert!(tetrahedra.corners.iter().flatten().all(|p| (*p as usize) < points.len()));
    let faces = Faces::new(&points, &tetrahedra.corners);
    for (t, beyond) in faces.neighbours.iter().enumerate() {
        for u in beyond.iter().filter(|u| **u != BOUNDARY) {
            assert!(faces.neighbours[*u as usize].contains(&(t as u32)), "neighbours are mutual");
        }
    }
    faces.components();
});
