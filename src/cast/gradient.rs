//! The gradient at the points of a grid, by central differences.
//!
//! Along each axis it is, of the difference quotients D₊ and D₋ over the two edges of lengths h₊ and h₋ that a point has,
//! (h₋ D₊ + h₊ D₋)/(h₋ + h₊), which is right for quadratics; with one edge alone its D, with none 0. Only edges of cells that
//! are drawn count, and those between values that are finite.

use super::volume::{Samples, Volume};
use crate::error::Result;
use crate::memory;
use glam::DVec3;
use rayon::prelude::*;

/// Gradients in world units, over the length of the longest.
#[derive(Debug)]
pub(crate) struct Gradients {
    vectors: Vec<[f32; 3]>,
    longest: f64,
}

impl Gradients {
    /// Those of the first component of point values, on the current rayon pool.
    ///
    /// # Errors
    /// [`crate::Error::NoMemory`].
    pub(crate) fn new(volume: &Volume, samples: &Samples) -> Result<Self> {
        let [nx, ny, _] = volume.cells.map(|n| n + 1);
        let all = |p: usize| gradient(volume, samples, [p % nx, p / nx % ny, p / (nx * ny)]);
        let mut vectors = memory::filled("the gradient of a grid", [0.0f32; 3], volume.point_count())?;
        let longest = (0..vectors.len()).into_par_iter().map(|p| all(p).length()).reduce(|| 0.0, f64::max);
        let over = if longest > 0.0 { 1.0 / longest } else { 0.0 };
        vectors.par_iter_mut().enumerate().for_each(|(p, v)| *v = (all(p) * over).as_vec3().to_array());
        Ok(Gradients { vectors, longest })
    }

    /// The greatest length, in the field's units per world unit.
    pub(crate) fn longest(&self) -> f64 {
        self.longest
    }

    /// At point `p`.
    #[inline(always)]
    pub(super) fn at(&self, p: usize) -> DVec3 {
        let [x, y, z] = self.vectors[p].map(f64::from);
        DVec3::new(x, y, z)
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        size_of_val(&*self.vectors) as u64
    }
}

/// The gradient at a point, in world units.
fn gradient(volume: &Volume, samples: &Samples, at: [usize; 3]) -> DVec3 {
    let [row, layer] = samples.stride;
    let stride = [1, row, layer];
    let p = at[2] * layer + at[1] * row + at[0];
    let own = samples.of_cell(p, 0);
    let mut along = [0.0; 3];
    for a in 0..3 {
        // The quotient over the edge that begins at `from` along the axis, and its length.
        let quotient = |from: usize| {
            let edge = {
                let mut edge = at;
                edge[a] = from;
                edge
            };
            let other = if from == at[a] { p + stride[a] } else { p - stride[a] };
            let h = volume.axes[a][from + 1] - volume.axes[a][from];
            let rise = (samples.of_cell(other, 0) - own) * if from == at[a] { 1.0 } else { -1.0 };
            (rise.is_finite() && is_drawn(volume, edge, a)).then_some((rise / h, h))
        };
        let after = if at[a] < volume.cells[a] { quotient(at[a]) } else { None };
        let before = if at[a] > 0 { quotient(at[a] - 1) } else { None };
        along[a] = match (before, after) {
            (Some((d, h)), Some((e, k))) => (h * e + k * d) / (h + k),
            (one, other) => one.or(other).map_or(0.0, |(d, _)| d),
        };
    }
    volume.to_axes.transpose() * DVec3::from_array(along) * samples.normal[0].half
}

/// Whether a cell is drawn around the edge along axis `a` that begins at a point.
fn is_drawn(volume: &Volume, edge: [usize; 3], a: usize) -> bool {
    if volume.hidden.is_none() {
        return true;
    }
    let [b, c] = [(a + 1) % 3, (a + 2) % 3];
    let [nx, ny, _] = volume.cells;
    [[0, 0], [0, 1], [1, 0], [1, 1]].into_iter().any(|[i, j]| {
        let mut cell = edge;
        if cell[b] < i || cell[c] < j {
            return false;
        }
        (cell[b], cell[c]) = (cell[b] - i, cell[c] - j);
        let inside = cell[b] < volume.cells[b] && cell[c] < volume.cells[c];
        inside && !volume.is_hidden((cell[2] * ny + cell[1]) * nx + cell[0])
    })
}
