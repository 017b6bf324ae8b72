//! Cells to tetrahedra: every 3D cell is split so that two neighbours split their shared face by the same diagonal.
//!
//! The rule needs no adjacency, only a total order of the points that all cells agree on (Dompierre, Labbé, Vallet &
//! Camarero, How to Subdivide Pyramids, Prisms and Hexahedra into Tetrahedra, 1999): a cell is coned from its smallest
//! point, and each face without that point is fanned from its own smallest point. A face is thus always fanned from
//! its smallest point, whichever cell looks at it. The order is that of exact positions (x, then y, then z), so cells
//! that do not share point indices agree too; indices only break ties.
//!
//! Linear cells (`linear`) are split so; cells of higher order are, through all their nodes (`curved`), and polyhedra
//! around points inside (`polyhedron`). Both may add points to those of the mesh.

mod curved;
pub(crate) mod ghosts;
mod linear;
mod polyhedron;
mod splitter;
mod types;

pub use types::{dimension, name};

use crate::error::{Error, Result};
use crate::memory;
use crate::mesh::Mesh;
use crate::progress::Progress;
use glam::DVec3;
use polyhedron::Cut;
use rayon::prelude::*;
use splitter::{Count, Splitter};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;

/// The most tetrahedra that can be indexed: a face is numbered by four times its tetrahedron plus its corner.
pub const MAX_TETRAHEDRA: usize = (1 << 30) - 1;

/// Whether an array of this name tells how cells are split, or which are left out: a mesh or grid needs it whatever is drawn.
pub fn reads_array(name: &str) -> bool {
    use {ghosts::GHOST_ARRAY, ghosts::GHOST_LEVELS_ARRAY, splitter::DEGREES_ARRAY, splitter::WEIGHTS_ARRAY};
    [GHOST_ARRAY, GHOST_LEVELS_ARRAY, DEGREES_ARRAY, WEIGHTS_ARRAY].contains(&name)
}

/// Cells that one task splits.
const CHUNK: usize = 1 << 14;

/// The tetrahedra that a mesh's 3D cells are split into.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Tetrahedra {
    /// The four points of each tetrahedron: indices into [`Tetrahedra::points`]. A cell that is not inverted gives
    /// tetrahedra with det(p1 − p0, p2 − p0, p3 − p0) > 0, but meshes hold cells of both kinds: [`super::faces`] finds
    /// out which is which.
    pub corners: Vec<[u32; 4]>,
    /// The cell that each tetrahedron is a part of, ascending; `None` if tetrahedron `i` is cell `i`.
    pub cell: Option<Vec<u32>>,
    /// Number of cells that `corners` holds.
    pub cells: usize,
    /// The points that the split added.
    pub added: SteinerPoints,
    /// The cells that were left out, by reason.
    pub skipped: Skipped,
    /// Polyhedra whose surface crosses itself: some of their tetrahedra overlap.
    pub crooked: Listed,
}

/// Cells that have something in common.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Listed {
    /// How many there are.
    pub count: usize,
    /// The first of them, at most [`Listed::MOST`], ascending.
    pub first: Vec<usize>,
}

impl Listed {
    /// So many cells are named.
    pub const MOST: usize = 3;

    fn add(&mut self, cell: usize) {
        self.count += 1;
        if self.first.len() < Self::MOST {
            self.first.push(cell);
        }
    }

    fn merge(&mut self, other: &Self) {
        self.count += other.count;
        self.first.extend(&other.first);
        self.first.truncate(Self::MOST);
    }
}

/// The cells that are named: "cell 7", "cells 7, 8, 9 and more".
impl std::fmt::Display for Listed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let names: Vec<String> = self.first.iter().map(usize::to_string).collect();
        let (s, more) =
            (if self.count == 1 { "" } else { "s" }, if self.count > names.len() { " and more" } else { "" });
        write!(f, "cell{s} {}{more}", names.join(", "))
    }
}

/// Points that a split added, each the weighted mean of points of the mesh. Values at points are made likewise.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SteinerPoints {
    /// The index of the first added point: the number of points of the mesh.
    pub first: u32,
    /// Added point `i` is made of the entries `ends[i − 1]..ends[i]` of the other two, the first from 0 on.
    pub ends: Vec<u64>,
    /// Points of the mesh.
    pub sources: Vec<u32>,
    /// The weight of each, which add up to 1 for each added point.
    pub weights: Vec<f64>,
}

impl SteinerPoints {
    /// Number of points.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// True if there is none.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// The points and weights that added point `i` is made of.
    ///
    /// # Panics
    /// If `i` is not below [`SteinerPoints::len`].
    pub fn of(&self, i: usize) -> impl Iterator<Item = (u32, f64)> + '_ {
        let range = if i == 0 { 0 } else { self.ends[i - 1] as usize }..self.ends[i] as usize;
        self.sources[range.clone()].iter().copied().zip(self.weights[range].iter().copied())
    }

    fn push(&mut self, entries: impl Iterator<Item = (u32, f64)>) {
        for (source, weight) in entries {
            self.sources.push(source);
            self.weights.push(weight);
        }
        self.ends.push(self.sources.len() as u64);
    }
}

/// How many cells were left out, by reason; each cell counts once, for the first reason that holds.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Skipped {
    /// Cells of dimension 0, 1 or 2.
    pub lower_dimensional: usize,
    /// 3D cells of a type that is not drawn yet, by VTK cell type; see [`name`].
    pub unsupported: BTreeMap<u8, usize>,
    /// Cells that the array `vtkGhostType` marks as duplicate, refined or hidden, or with a point that it hides.
    pub ghost: usize,
    /// Cells with a point that is NaN or infinite.
    pub invisible: usize,
    /// Polyhedra without a face of three points or more.
    pub empty: usize,
    /// Polyhedra whose faces do not close a surface.
    pub open: Listed,
    /// Polyhedra with faces, but without volume.
    pub flat: Listed,
}

impl Skipped {
    /// The number of cells left out for any reason.
    pub fn total(&self) -> usize {
        let polyhedra = self.empty + self.open.count + self.flat.count;
        self.lower_dimensional + self.unsupported.values().sum::<usize>() + self.ghost + self.invisible + polyhedra
    }

    /// Tells the log: what might be missed as a warning.
    pub fn log(&self) {
        for (&kind, count) in &self.unsupported {
            tracing::warn!("{count} cells are left out: {} is not drawn yet", name(kind));
        }
        if self.invisible > 0 {
            tracing::warn!("{} cells are left out: they have a point that is not finite", self.invisible);
        }
        if self.open.count > 0 {
            let (count, cells) = (self.open.count, &self.open);
            tracing::warn!(
                "{count} cells are left out: they are polyhedra whose faces do not close a surface ({cells})"
            );
        }
        if self.flat.count > 0 {
            let (count, cells) = (self.flat.count, &self.flat);
            tracing::warn!("{count} cells are left out: they are polyhedra without volume ({cells})");
        }
        if self.lower_dimensional > 0 {
            tracing::info!("{} cells are left out: they have no volume (2D or less)", self.lower_dimensional);
        }
        if self.ghost > 0 {
            tracing::info!("{} cells are left out: they are ghosts", self.ghost);
        }
        if self.empty > 0 {
            tracing::info!("{} cells are left out: they are polyhedra without faces", self.empty);
        }
    }

    fn merge(mut self, other: Self) -> Self {
        self.lower_dimensional += other.lower_dimensional;
        self.ghost += other.ghost;
        self.invisible += other.invisible;
        self.empty += other.empty;
        self.open.merge(&other.open);
        self.flat.merge(&other.flat);
        for (t, n) in other.unsupported {
            *self.unsupported.entry(t).or_default() += n;
        }
        self
    }
}

impl Tetrahedra {
    /// Splits the cells of `mesh`, on the current rayon pool.
    ///
    /// # Errors
    /// [`Error::Empty`] if no 3D cell is left to draw; [`Error::Mesh`] if a cell has not the number of points that its
    /// type demands, or if there would be more than [`MAX_TETRAHEDRA`], or 2³² points.
    pub fn new(mesh: &Mesh) -> Result<Self> {
        Self::with_progress(mesh, &|_| {})
    }

    /// As [`Tetrahedra::new`]; `report` is called, on any thread, with the share of the work that is done: from 0 to 1,
    /// never falling.
    ///
    /// # Errors
    /// Likewise.
    pub fn with_progress(mesh: &Mesh, report: &(dyn Fn(f64) + Sync)) -> Result<Self> {
        report(0.0);
        let splitter = Splitter::new(mesh);
        let n = mesh.cells().len();
        // Each chunk is gone through twice.
        let progress = Progress::new(report, 2.0 * n.div_ceil(CHUNK) as f64);
        let mut counts: Vec<Count> = (0..n.div_ceil(CHUNK))
            .into_par_iter()
            .map_init(Cut::default, |cut, i| {
                let count = splitter.count(chunk(i, n), cut);
                progress.add(1);
                count
            })
            .collect::<Result<_>>()?;
        let skipped = counts.iter().fold(Skipped::default(), |all, count| all.merge(count.skipped.clone()));
        let counted: Vec<usize> = counts.iter().map(|count| count.tetrahedra).collect();
        let (total, first) = (counted.iter().sum::<usize>(), mesh.points().len());
        if total == 0 {
            return Err(Error::Empty(nothing_left(mesh, &skipped)));
        }
        let added: usize = counts.iter().map(|count| count.added).sum();
        if total > MAX_TETRAHEDRA || first + added >= u32::MAX as usize {
            let what = format!(
                "its cells make {total} tetrahedra of {} points, more than Halite can index ({MAX_TETRAHEDRA}, 2^32 - 2)",
                first + added
            );
            return Err(Error::Mesh(what));
        }
        let bytes = total * (size_of::<[u32; 4]>() + size_of::<u32>()) + added * 200;
        memory::check(&format!("{total} tetrahedra of its cells"), bytes as u64)?;
        let firsts = counts.iter().scan(first, |at, count| {
            *at += count.added;
            Some((*at - count.added) as u32)
        });
        let firsts: Vec<u32> = firsts.collect();
        let solved: Vec<_> = counts.iter_mut().map(|count| std::mem::take(&mut count.solved)).collect();
        let mut corners = memory::filled("the tetrahedra of its cells", [0; 4], total)?;
        let one_to_one = skipped.total() == 0 && mesh.cells().types.par_iter().all(|&t| t == 10);
        let mut cell = if one_to_one { Vec::new() } else { memory::filled("the cells of tetrahedra", 0, total)? };
        let parts: Vec<(SteinerPoints, Listed)> = split_by(&mut corners, &counted)
            .into_par_iter()
            .zip(if one_to_one {
                counts.iter().map(|_| <&mut [u32]>::default()).collect()
            } else {
                split_by(&mut cell, &counted)
            })
            .enumerate()
            .map(|(i, (corners, cell))| {
                let part = splitter.fill(chunk(i, n), &solved[i], firsts[i], corners, cell);
                progress.add(1);
                part
            })
            .collect();
        let mut added = SteinerPoints { first: first as u32, ..SteinerPoints::default() };
        for (part, _) in &parts {
            let base = added.sources.len() as u64;
            added.ends.extend(part.ends.iter().map(|end| base + end));
            added.sources.extend_from_slice(&part.sources);
            added.weights.extend_from_slice(&part.weights);
        }
        let mut crooked = Listed::default();
        parts.iter().for_each(|part| crooked.merge(&part.1));
        let cells = n - skipped.total();
        Ok(Tetrahedra { corners, cell: (!one_to_one).then_some(cell), cells, added, skipped, crooked })
    }

    /// Tells the log what is left out, and what cannot be drawn right.
    pub fn log(&self) {
        self.skipped.log();
        if self.crooked.count > 0 {
            let (count, cells) = (self.crooked.count, &self.crooked);
            tracing::warn!("{count} cells are drawn with overlaps: they are polyhedra that cross themselves ({cells})");
        }
    }

    /// The points that [`Tetrahedra::corners`] index: those of the mesh, and after them those that the split added.
    ///
    /// # Panics
    /// If there are fewer points than the mesh had that was split.
    pub fn points<'a>(&self, of_mesh: &'a [DVec3]) -> Cow<'a, [DVec3]> {
        if self.added.is_empty() {
            return Cow::Borrowed(of_mesh);
        }
        let added = (0..self.added.len()).into_par_iter().map(|i| mean(of_mesh, self.added.of(i)));
        Cow::Owned(of_mesh.par_iter().copied().chain(added).collect())
    }

    /// The values at the points that the split added, `components` for each, from `value` of those of the mesh.
    pub fn added_values(&self, components: usize, value: impl Fn(usize) -> f64 + Sync) -> Vec<f64> {
        let at = |i: usize| {
            let (point, k) = (i / components, i % components);
            let share = |(source, weight): (u32, f64)| weight * value(source as usize * components + k);
            self.added.of(point).map(share).sum()
        };
        (0..self.added.len() * components).into_par_iter().map(at).collect()
    }

    /// All values at [`Self::points`], `components` for each: those of the mesh, and after them those that the split
    /// added.
    ///
    /// # Panics
    /// If there are fewer values than the mesh that was split has points, times `components`.
    pub fn values<'a>(&self, of_mesh: Cow<'a, [f64]>, components: usize) -> Cow<'a, [f64]> {
        if self.added.is_empty() {
            return of_mesh;
        }
        let added = self.added_values(components, |i| of_mesh[i]);
        let mut all = of_mesh.into_owned();
        all.extend(added);
        Cow::Owned(all)
    }
}

/// The weighted mean of points; of the same bits for the same entries in the same order.
fn mean(points: &[DVec3], entries: impl Iterator<Item = (u32, f64)>) -> DVec3 {
    entries.map(|(source, weight)| points[source as usize] * weight).sum()
}

/// The cells of chunk `i` of `n`.
fn chunk(i: usize, n: usize) -> Range<usize> {
    i * CHUNK..n.min((i + 1) * CHUNK)
}

/// Cuts `all` into parts of the given lengths.
fn split_by<'a, T>(mut all: &'a mut [T], lengths: &[usize]) -> Vec<&'a mut [T]> {
    lengths
        .iter()
        .map(|&n| {
            let (part, rest) = std::mem::take(&mut all).split_at_mut(n);
            all = rest;
            part
        })
        .collect()
}

/// Says what a mesh has instead of 3D cells to draw.
fn nothing_left(mesh: &Mesh, skipped: &Skipped) -> String {
    if mesh.cells().is_empty() {
        return format!("it has no cells, only {} points", mesh.points().len());
    }
    let mut types = BTreeMap::<u8, usize>::new();
    for &t in &mesh.cells().types {
        *types.entry(t).or_default() += 1;
    }
    let types: Vec<String> = types.into_iter().map(|(t, n)| format!("{n} of type {}", name(t))).collect();
    let unsupported: usize = skipped.unsupported.values().sum();
    let reasons: Vec<String> = [
        (skipped.lower_dimensional, "below three dimensions"),
        (unsupported, "of a type that Halite does not draw"),
        (skipped.ghost, "ghosts or hidden"),
        (skipped.invisible, "with points that are NaN or infinite"),
        (skipped.empty, "polyhedra without faces"),
        (skipped.open.count, "polyhedra whose faces do not close a surface"),
        (skipped.flat.count, "polyhedra without volume"),
    ]
    .into_iter()
    .filter(|(n, _)| *n > 0)
    .map(|(n, why)| format!("{n} {why}"))
    .collect();
    format!("it has no 3D cell to draw; its cells are {}: {}", types.join(", "), reasons.join(", "))
}
