//! Reading meshes from files.

use crate::error::Result;
use crate::mesh::Mesh;
use std::path::Path;

/// Reads a mesh: the file's grid as it is, nothing welded, dropped or repaired. `progress` is told the share of the work
/// that is done, in [0, 1].
///
/// # Errors
/// [`crate::Error::File`], [`crate::Error::Malformed`] or [`crate::Error::Unsupported`], naming the file and the place in it.
pub fn open(path: &Path, progress: &(dyn Fn(f64) + Sync)) -> Result<Mesh> {
    let _ = progress;
    Err(crate::Error::unsupported(path, "no reader yet"))
}
