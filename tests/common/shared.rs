//! Meshes of other programs, where they are at hand.

use std::path::{Path, PathBuf};

/// The `.vtu` and `.pvtu` files in a folder of shared data, and below it; none if there is no such folder.
pub(crate) fn meshes_in(folder: &str) -> Vec<PathBuf> {
    files_in(folder, &["vtu", "pvtu"])
}

/// The files with one of these extensions in a folder of shared data, and below it.
pub(crate) fn files_in(folder: &str, extensions: &[&str]) -> Vec<PathBuf> {
    let mut files = Vec::new();
    let mut folders = vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared").join(folder)];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| extensions.iter().any(|known| e == *known)) {
                files.push(path);
            }
        }
    }
    files.sort();
    files
}
