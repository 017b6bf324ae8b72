//! The reader of mesh files: what writers write is read as it was meant, what is damaged is refused by name.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod damage;
mod encodings;
#[path = "../common/files.rs"]
mod files;
mod grids;
mod left_out;
mod legacy;
mod pieces;
mod series;
#[path = "../common/shared.rs"]
mod shared;

use files::Piece;
use halite::mesh::{Mesh, Values};
use halite::{Error, Result};
use std::sync::Mutex;

/// Reads bytes as if they were a file of that name, and checks what `progress` is told.
fn read_as(name: &str, bytes: &[u8]) -> Result<Mesh> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    let last = Mutex::new(0.0);
    let mesh = halite::io::open(&path, &|share| {
        let mut last = last.lock().unwrap();
        assert!(share >= *last && share <= 1.0, "the share went from {last} to {share}");
        *last = share;
    });
    assert!(mesh.is_err() || *last.lock().unwrap() == 1.0);
    mesh
}

fn read(bytes: &[u8]) -> Result<Mesh> {
    read_as("mesh.vtu", bytes)
}

/// The message of a damaged file, which must be of the right kind and name the file.
fn malformed(bytes: &[u8]) -> String {
    match read(bytes) {
        Err(Error::Malformed { path, what }) if path.ends_with("mesh.vtu") => what,
        other => panic!("not refused as malformed: {other:?}"),
    }
}

fn floats(values: &Values) -> Vec<f64> {
    (0..values.len()).map(|i| values.get(i)).collect()
}

fn coordinates(mesh: &Mesh) -> Vec<f64> {
    mesh.points().iter().flat_map(glam::DVec3::to_array).collect()
}

fn assert_holds(mesh: &Mesh, piece: &Piece, what: impl std::fmt::Debug) {
    assert_eq!(coordinates(mesh), floats(&piece.points), "{what:?}");
    assert_eq!(mesh.cells().types, [10, 13], "{what:?}");
    assert_eq!(mesh.cells().offsets, [0, 4, 10], "{what:?}");
    assert_eq!(mesh.cells().connectivity, [0, 1, 2, 3, 4, 5, 6, 7, 8, 9], "{what:?}");
    assert_eq!(mesh.point_arrays(), piece.point_data, "{what:?}");
    assert_eq!(mesh.cell_arrays(), piece.cell_data, "{what:?}");
}
