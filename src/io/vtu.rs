//! VTK XML files of grids: `.vtu`, and `.pvtu`, which lists such; likewise `.vti`, `.vtr` and `.vts`; `.pvd`, which lists
//! any.
//!
//! `head` reads the XML up to the numbers: which pieces and arrays there are, and where; `place` where pieces of grids are
//! whose points are counted along axes. `grid` makes one mesh of all pieces: points and data; `topology` the cells;
//! `structured` one grid of pieces along axes.

mod grid;
mod head;
mod place;
mod structured;
mod topology;

pub(super) use topology::renumber;

use super::input::{Input, Place, find};
use super::series::Series;
use super::{DataSet, Progress, warn_of_left_out};
use crate::error::{Error, Result};
use crate::grid::Lattice;
use crate::mesh::Attributes;
use grid::Grid;
use head::{Head, Piece};
use place::Kind;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering::Relaxed;

/// What a VTK XML file holds.
pub(super) enum Opened {
    Grid(Document),
    Collection(Series),
}

/// A grid in a file, or in several; nothing but their heads is read yet.
pub(super) struct Document {
    path: PathBuf,
    kind: Kind,
    /// Where image data is.
    lattice: Lattice,
    heads: Vec<Head>,
    /// The numbers of the time steps in the file, and the time of each; none if it tells none apart.
    steps: Vec<usize>,
    times: Vec<f64>,
}

/// Reads the head of a VTK XML file, and of the files that it lists the pieces of.
pub(super) fn open(input: &Input) -> Result<Opened> {
    let mut head = Head::read(input)?;
    let path = &input.path;
    if let Some(entries) = head.collection.take() {
        let entries = entries.into_iter().map(|entry| (entry.time.unwrap_or_default(), entry.file));
        return Series::new(path, entries.collect()).map(Opened::Collection);
    }
    let mut heads = vec![];
    if head.is_list {
        let sources = std::mem::take(&mut head.sources);
        for piece in pieces(path, &sources)? {
            let own = Head::read(&Input::file(&piece))?;
            if own.is_list || own.collection.is_some() {
                return Err(Error::malformed(path, format!("it lists {}, which is a list itself", piece.display())));
            }
            if own.kind != head.kind {
                let (piece, is, not) = (piece.display(), own.kind.name(), head.kind.name());
                return Err(Error::malformed(path, format!("it lists {piece}, which holds \"{is}\", not \"{not}\"")));
            }
            heads.push(own);
        }
    }
    heads.insert(0, head);
    let times = heads.iter().map(|head| &head.times).find(|times| !times.is_empty()).cloned().unwrap_or_default();
    let steps: Vec<usize> = match times.len() {
        0 => {
            let named: BTreeSet<usize> = heads.iter().flat_map(|head| &head.pieces).flat_map(Piece::steps).collect();
            named.into_iter().collect()
        }
        count => (0..count).collect(),
    };
    let times = if times.is_empty() { steps.iter().map(|step| *step as f64).collect() } else { times };
    let (kind, first) = (heads[0].kind, heads.iter().find(|head| !head.pieces.is_empty()));
    let lattice = first.map_or_else(Lattice::default, |head| head.lattice);
    Ok(Opened::Grid(Document { path: path.clone(), kind, lattice, heads, steps, times }))
}

/// The files that a list names, as far as they are there.
fn pieces(list: &Path, sources: &[String]) -> Result<Vec<PathBuf>> {
    let (mut found, mut moved, mut missing) = (vec![], vec![], vec![]);
    for source in sources {
        match find(list, source) {
            Place::There(path) => found.push(path),
            Place::Moved(path) => {
                moved.push(path.clone());
                found.push(path);
            }
            Place::Missing(path, answer) => missing.push((path, answer)),
        }
    }
    if let Some((path, answer)) = missing.first() {
        let (path, count, all) = (path.display(), missing.len(), sources.len());
        if found.is_empty() {
            return Err(Error::malformed(list, format!("it lists {path}, which cannot be read: {answer}")));
        }
        let list = list.display();
        tracing::warn!("{list}: {count} of its {all} files are missing, and left out; the first is {path}: {answer}");
    }
    if let Some(first) = moved.first() {
        let (list, count, first) = (list.display(), moved.len(), first.display());
        tracing::warn!("{list}: {count} of its files are not where it says; they are read from its folder, as {first}");
    }
    Ok(found)
}

impl Document {
    /// The times of its steps.
    pub(super) fn times(&self) -> &[f64] {
        &self.times
    }

    /// Reads the grid at a step, counted from 0.
    pub(super) fn read(&self, step: usize, tell: &(dyn Fn(f64) + Sync)) -> Result<DataSet> {
        let step = self.steps.get(step).copied().unwrap_or(step);
        let (mut stores, mut pieces) = (vec![], vec![]);
        let mut attributes: [Attributes; 2] = Default::default();
        for head in &self.heads {
            for piece in &head.pieces {
                let mut piece = piece.at_step(step);
                piece.store = stores.len();
                pieces.push(piece);
            }
            head.store.used.store(0, Relaxed);
            stores.push(&head.store);
            for (all, own) in attributes.iter_mut().zip(&head.attributes) {
                own.roles.iter().for_each(|(role, name)| all.add_role(*role, name));
                all.left_out.extend_from_slice(&own.left_out);
            }
        }
        let expected = pieces.iter().map(Piece::expected).sum::<f64>().max(1.0);
        let progress = Progress::new(tell, expected);
        let grid = Grid { path: &self.path, stores, pieces, progress };
        let (mut read, left_out) = match self.kind {
            Kind::Unstructured => grid.mesh().map(|(mesh, left_out)| (DataSet::Mesh(mesh), left_out))?,
            kind => grid.structured(kind, self.lattice)?,
        };
        for (all, more) in attributes.iter_mut().zip(left_out) {
            all.left_out.extend(more);
            warn_of_left_out(&self.path, &mut all.left_out);
        }
        let [of_points, of_cells] = attributes;
        read.set_attributes(of_points, of_cells);
        Ok(read)
    }
}
