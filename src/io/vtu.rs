//! VTK XML files of unstructured grids: `.vtu`, and `.pvtu`, which lists such.
//!
//! `head` reads the XML up to the numbers: which pieces and arrays there are, and where. `grid` makes one mesh of all
//! pieces: points and data; `topology` the cells.

mod grid;
mod head;
mod topology;

pub(super) use topology::renumber;

use super::Progress;
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use grid::Grid;
use head::{Head, Piece};
use std::fs::File;
use std::path::Path;

/// Reads the unstructured grid in a VTK XML file, or in the files that it lists.
pub(super) fn read(path: &Path, tell: &(dyn Fn(f64) + Sync)) -> Result<Mesh> {
    let head = Head::read(path)?;
    let mut files = vec![];
    if head.is_list {
        let folder = path.parent().unwrap_or(Path::new(""));
        for source in &head.sources {
            let piece = folder.join(source);
            let missing = |e: std::io::Error| {
                let what = format!("it lists {}, which cannot be read: {e}", piece.display());
                Error::malformed(path, what)
            };
            File::open(&piece).map_err(missing)?;
            let head = Head::read(&piece)?;
            if head.is_list {
                return Err(Error::malformed(path, format!("it lists {}, which is a list itself", piece.display())));
            }
            files.push(head);
        }
    } else {
        files.push(head);
    }
    let (mut stores, mut pieces) = (vec![], vec![]);
    for file in files {
        for mut piece in file.pieces {
            piece.store = stores.len();
            pieces.push(piece);
        }
        stores.push(file.store);
    }
    let expected = pieces.iter().map(Piece::expected).sum::<f64>().max(1.0);
    let progress = Progress::new(tell, expected);
    Grid { path, stores, pieces, progress }.mesh()
}
