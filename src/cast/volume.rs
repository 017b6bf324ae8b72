//! A grid as the caster reads it: axes that ascend, what is left out, and what blocks of voxels hold.

use crate::error::{Error, Result};
use crate::field::{Association, Field, Normalization};
use crate::grid::Grid;
use crate::mesh::{Values, with_values};
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use std::sync::Arc;

/// Voxels of a block along each axis, as a power of two.
pub(super) const BLOCK: usize = 3;

/// Where the voxels of a grid are, and which of them are drawn.
#[derive(Debug)]
pub(crate) struct Volume {
    /// Coordinates along each axis, ascending, relative to the centre.
    pub(super) axes: [Vec<f64>; 3],
    /// One over the width of each voxel along each axis.
    pub(super) inverse: [Vec<f64>; 3],
    /// Voxels along each axis.
    pub(super) cells: [usize; 3],
    /// From directions in the world to such along the axes.
    pub(super) to_axes: DMat3,
    /// The middle of the grid, in world coordinates.
    pub(super) centre: DVec3,
    /// What lengths in the world are multiplied by; a power of two.
    pub(crate) scale: f64,
    /// From corner to corner, in world units.
    diagonal: f64,
    /// Whether planes are as far from each other all along each axis.
    pub(super) even: bool,
    /// A bit for each voxel that is left out; none if none is.
    pub(super) hidden: Option<Vec<u64>>,
}

impl Volume {
    /// Prepares `grid`.
    ///
    /// # Errors
    /// [`Error::Empty`] if there is but one point along an axis, or every cell is a ghost or hidden.
    pub(crate) fn new(grid: &Grid) -> Result<Self> {
        let size = grid.size();
        if !grid.has_volume() {
            let [x, y, z] = size;
            return Err(Error::Empty(format!("a grid of {x} x {y} x {z} points has no volume")));
        }
        let middle = |axis: &[f64]| axis[0] / 2.0 + axis[axis.len() - 1] / 2.0;
        let signs = grid.axes().each_ref().map(|axis| if axis[0] < axis[axis.len() - 1] { 1.0 } else { -1.0 });
        let axes = [0, 1, 2].map(|a| {
            let axis = &grid.axes()[a];
            axis.iter().map(|c| (c - middle(axis)) * signs[a]).collect::<Vec<f64>>()
        });
        let half = DVec3::from_array(axes.each_ref().map(|axis| axis[axis.len() - 1]));
        let centre = grid.origin() + grid.direction() * DVec3::from_array(grid.axes().each_ref().map(|a| middle(a)));
        let to_axes = DMat3::from_diagonal(DVec3::from_array(signs)) * grid.direction().inverse();
        let inverse = axes.each_ref().map(|axis| axis.windows(2).map(|w| 1.0 / (w[1] - w[0])).collect());
        let extent = (grid.direction() * half).length().max(f64::MIN_POSITIVE);
        let scale = (-extent.log2().ceil()).clamp(-1000.0, 1000.0).exp2();
        let hidden = grid.hidden();
        if hidden
            .as_ref()
            .is_some_and(|bits| bits.iter().map(|b| b.count_ones() as usize).sum::<usize>() == grid.cell_count())
        {
            return Err(Error::Empty("all of its cells are ghosts or hidden".into()));
        }
        let diagonal = 2.0 * extent;
        let even = axes.iter().all(|axis| is_even(axis));
        Ok(Volume { axes, inverse, cells: grid.cells(), to_axes, centre, scale, diagonal, even, hidden })
    }

    /// Whether voxel `c` is left out.
    #[inline(always)]
    pub(super) fn is_hidden(&self, c: usize) -> bool {
        self.hidden.as_ref().is_some_and(|bits| bits.get(c / 64).is_some_and(|word| word >> (c % 64) & 1 == 1))
    }

    /// The middle of the grid, in world coordinates.
    pub(crate) fn centre(&self) -> DVec3 {
        self.centre
    }

    /// From corner to corner, in world units.
    pub(crate) fn diagonal(&self) -> f64 {
        self.diagonal
    }

    /// The longest way through a voxel, in world units.
    pub(crate) fn longest_chord(&self) -> f64 {
        let width = |a: usize| self.inverse[a].iter().fold(0.0, |most: f64, i| most.max(1.0 / i));
        let [x, y, z] = [width(0), width(1), width(2)];
        let to_world = self.to_axes.inverse();
        let along = |(y, z): (f64, f64)| (to_world * DVec3::new(x, y, z)).length();
        [(y, z), (-y, z), (y, -z), (-y, -z)].map(along).into_iter().fold(0.0, f64::max)
    }

    /// Number of voxels.
    pub(crate) fn cell_count(&self) -> usize {
        self.cells.iter().product()
    }

    /// Number of points.
    pub(super) fn point_count(&self) -> usize {
        self.axes.iter().map(Vec::len).product()
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        let axes: usize = self.axes.iter().map(|a| 16 * a.len()).sum();
        axes as u64 + self.hidden.as_ref().map_or(0, |bits| 8 * bits.len() as u64)
    }
}

/// How far from its place a plane of an even axis may be, in widths of a voxel.
const UNEVEN: f64 = 1e-9;

/// Whether these planes are as far from each other all along.
fn is_even(axis: &[f64]) -> bool {
    let (first, last) = (axis[0], axis[axis.len() - 1]);
    let width = (last - first) / (axis.len() - 1) as f64;
    axis.iter().enumerate().all(|(i, c)| (c - (first + i as f64 * width)).abs() <= UNEVEN * width)
}

/// The values of a field on a grid, in their own type.
#[derive(Debug)]
pub(crate) struct Samples {
    pub(super) values: Arc<Values>,
    pub(super) components: usize,
    pub(super) of_cells: bool,
    pub(super) normal: [Normalization; 4],
    /// What stands for values that are not finite, normalised: all over their voxels.
    pub(super) missing: Option<f64>,
    /// Points along x, and in a layer of x and y: what corners of a voxel are apart.
    pub(super) stride: [usize; 2],
    /// Blocks along each axis.
    pub(super) blocks: [usize; 3],
    /// The least and the greatest value of the last component in each, normalised; the first is greater if there is none.
    bounds: Vec<[f32; 2]>,
}

impl Samples {
    /// Brings `field` to `volume`.
    ///
    /// # Errors
    /// [`Error::Field`] if there are not as many values as points or cells.
    pub(crate) fn new(volume: &Volume, field: &Field) -> Result<Self> {
        let of_cells = field.association() == Association::Cell;
        let (what, count) = if of_cells { ("cells", volume.cell_count()) } else { ("points", volume.point_count()) };
        let components = field.kind().components();
        if field.len() != count * components {
            return Err(Error::Field(format!("the field has {} values for {count} {what}", field.len() / components)));
        }
        let row = volume.axes[0].len();
        let mut samples = Samples {
            values: Arc::clone(field.shared()),
            components,
            of_cells,
            normal: [0, 1, 2, 3].map(|k| field.normal(k)),
            missing: field.missing().map(|v| field.normal(0).apply(v)),
            stride: [row, row * volume.axes[1].len()],
            blocks: volume.cells.map(|n| (n >> BLOCK) + usize::from(n & ((1 << BLOCK) - 1) > 0)),
            bounds: vec![],
        };
        let [x, y, z] = samples.blocks;
        let bounds = |b: usize| samples.bounds_of(volume, [b % x, b / x % y, b / (x * y)]);
        samples.bounds = (0..x * y * z).into_par_iter().map(bounds).collect();
        Ok(samples)
    }

    /// The block that a voxel is in.
    #[inline(always)]
    pub(super) fn block(&self, [i, j, k]: [usize; 3]) -> usize {
        ((k >> BLOCK) * self.blocks[1] + (j >> BLOCK)) * self.blocks[0] + (i >> BLOCK)
    }

    /// Whether anything is to be seen in each block, if `shows` says that of values from one to another.
    pub(super) fn seen(&self, shows: impl Fn(f64, f64) -> bool + Sync) -> Vec<bool> {
        let seen = |&[low, high]: &[f32; 2]| low <= high && shows(low.into(), high.into());
        self.bounds.par_iter().map(seen).collect()
    }

    fn bounds_of(&self, volume: &Volume, block: [usize; 3]) -> [f32; 2] {
        let last = self.components - 1;
        let low = block.map(|b| b << BLOCK);
        let high = [0, 1, 2].map(|a| (low[a] + (1 << BLOCK)).min(volume.cells[a]));
        let mut bounds = [f64::INFINITY, f64::NEG_INFINITY];
        for (k, j) in (low[2]..high[2]).flat_map(|k| (low[1]..high[1]).map(move |j| (k, j))) {
            for i in low[0]..high[0] {
                let c = (k * volume.cells[1] + j) * volume.cells[0] + i;
                if volume.is_hidden(c) {
                    continue;
                }
                let own = if self.of_cells { [self.of_cell(c, last); 8] } else { self.corners([i, j, k], last) };
                for v in own {
                    bounds = [bounds[0].min(v), bounds[1].max(v)];
                }
            }
        }
        // Rounded outward: f32 holds no f64.
        let [low, high] = bounds.map(|v| v as f32);
        [low.next_down(), high.next_up()]
    }

    /// Component `k` of cell `c`, normalised.
    #[inline(always)]
    pub(super) fn of_cell(&self, c: usize, k: usize) -> f64 {
        let value = self.normal[k].apply(self.values.get(c * self.components + k));
        self.missing.filter(|_| !value.is_finite()).unwrap_or(value)
    }

    /// Component `k` at the corners of voxel (i, j, k), normalised; x fastest, then y.
    #[inline(always)]
    pub(super) fn corners(&self, [x, y, z]: [usize; 3], k: usize) -> [f64; 8] {
        let [row, layer] = self.stride;
        self.corners_from(z * layer + y * row + x, k)
    }

    /// The same of the voxel whose first corner is point `p`.
    #[inline(always)]
    pub(super) fn corners_from(&self, p: usize, k: usize) -> [f64; 8] {
        let [row, layer] = self.stride;
        let n = self.components;
        let first = p * n + k;
        let at = [0, n, row * n, (row + 1) * n, layer * n, (layer + 1) * n, (layer + row) * n, (layer + row + 1) * n];
        let Normalization { mid, half } = self.normal[k];
        let factor = 1.0 / half;
        #[allow(clippy::unnecessary_cast, clippy::cast_lossless, reason = "one cast for ten types")]
        let raw: [f64; 8] = with_values!(&*self.values, v => {
            let v = &v[first..=first + at[7]];
            at.map(|i| v[i] as f64)
        });
        let values = raw.map(|s| (s - mid) * factor);
        match self.missing {
            Some(missing) if !values.iter().all(|v| v.is_finite()) => [missing; 8],
            _ => values,
        }
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        let values = with_values!(&*self.values, v => size_of_val(&**v));
        (values + size_of_val(&*self.bounds)) as u64
    }
}
