//! Grids, as brute force draws them: every voxel is tested against every ray, and what lies inside is chopped into many
//! pieces in which the field is taken for linear.

use super::{COMPONENTS, Interval, Reference};
use crate::error::{Error, Result};
use crate::field::{Association, Field, Kind};
use crate::grid::Grid;
use crate::image::Image;
use crate::transfer::TransferFunction;
use crate::view::View;
use glam::{DMat3, DVec3};

/// Pieces of the part of a ray inside a voxel: a line is off by their square over 8 times the second derivative.
const PIECES: usize = 1024;

/// The voxels of a grid that are drawn.
#[derive(Debug)]
pub(super) struct Boxes {
    /// From the world to coordinates along the grid's axes.
    to_axes: DMat3,
    voxels: Vec<Voxel>,
}

#[derive(Debug)]
struct Voxel {
    /// Along the axes, relative to the middle; the second corner need not be above the first.
    corners: [DVec3; 2],
    /// The field's components at its corners, x fastest, then y.
    values: [[f64; COMPONENTS]; 8],
}

/// Draws `view` of a regular or rectilinear grid, in f32.
///
/// # Errors
/// [`Error::Field`] if the field does not fit the grid.
pub fn render_grid(grid: &Grid, field: &Field, transfer: &TransferFunction, view: &View) -> Result<Image> {
    let pixels = Reference::of_grid(grid, field, transfer)?.render(view);
    Ok(Image { size: view.size(), pixels: pixels.iter().map(|p| p.map(|v| v as f32)).collect() })
}

impl<'a> Reference<'a> {
    /// Prepares a scene of a regular or rectilinear grid. Voxels that touch a value that is not finite are invisible.
    ///
    /// # Errors
    /// [`Error::Field`] if the field does not fit the grid.
    pub fn of_grid(grid: &Grid, field: &Field, transfer: &'a TransferFunction) -> Result<Self> {
        let (n, size, cells) = (field.kind().components(), grid.size(), grid.cells());
        let of_cells = field.association() == Association::Cell;
        let count = if of_cells { grid.cell_count() } else { grid.point_count() };
        if field.len() != count * n {
            return Err(Error::Field(format!("the field has {} values for {count} tuples", field.len())));
        }
        if !transfer.is_of_one_variable() {
            return Err(Error::Field("grids are drawn with one variable, and without light".into()));
        }
        let full = if field.kind() == Kind::Rgba { field.normal(0).half } else { 1.0 };
        let tuple = |i: usize| {
            let own = |k: usize| if k < n { field.value(i * n + k) / if k < 3 { full } else { 1.0 } } else { 0.0 };
            [own(0), own(1), own(2), own(3), 0.0]
        };
        let hidden = grid.hidden();
        let [first, last] = [[0; 3], size.map(|n| n - 1)].map(|p| grid.point(p));
        let (centre, extent) = (first / 2.0 + last / 2.0, (last / 2.0 - first / 2.0).length());
        let to_axes = grid.direction().inverse();
        let mut voxels = vec![];
        for c in 0..if grid.has_volume() { grid.cell_count() } else { 0 } {
            let at = [c % cells[0], c / cells[0] % cells[1], c / (cells[0] * cells[1])];
            if hidden.as_ref().is_some_and(|bits| bits[c / 64] >> (c % 64) & 1 == 1) {
                continue;
            }
            let corner = |i: usize| [0, 1, 2].map(|a| at[a] + (i >> a & 1));
            let values = std::array::from_fn(|i| {
                let [x, y, z] = corner(i);
                tuple(if of_cells { c } else { (z * size[1] + y) * size[0] + x })
            });
            let corners = [0, 7].map(|i| to_axes * (grid.point(corner(i)) - centre));
            if values.as_flattened().iter().all(|v| v.is_finite()) {
                voxels.push(Voxel { corners, values });
            }
        }
        let boxes = Some(Boxes { to_axes, voxels });
        Ok(Reference { transfer, kind: field.kind(), cells: vec![], boxes, centre, extent, steepest: 0.0 })
    }
}

impl Boxes {
    /// What of a ray is in each voxel, in pieces.
    pub(super) fn intervals(&self, origin: DVec3, direction: DVec3) -> Vec<Interval> {
        let (o, d) = (self.to_axes * origin, self.to_axes * direction);
        self.voxels.iter().flat_map(|voxel| voxel.pieces(o, d)).collect()
    }
}

impl Voxel {
    fn pieces(&self, o: DVec3, d: DVec3) -> Vec<Interval> {
        let [a, b] = self.corners;
        let (low, high) = (a.min(b), a.max(b));
        let (mut enters, mut leaves) = (f64::NEG_INFINITY, f64::INFINITY);
        for k in 0..3 {
            if d[k] == 0.0 {
                if o[k] < low[k] || o[k] >= high[k] {
                    return vec![];
                }
                continue;
            }
            let (s, t) = ((low[k] - o[k]) / d[k], (high[k] - o[k]) / d[k]);
            (enters, leaves) = (enters.max(s.min(t)), leaves.min(s.max(t)));
        }
        if leaves <= enters {
            return vec![];
        }
        let place = |i: usize| enters + (leaves - enters) * i as f64 / PIECES as f64;
        let value = |t: f64| {
            let w = (o + d * t - a) / (b - a);
            let weight =
                |i: usize| -> f64 { (0..3).map(|k| if i >> k & 1 == 1 { w[k] } else { 1.0 - w[k] }).product() };
            std::array::from_fn(|c| (0..8).map(|i| weight(i) * self.values[i][c]).sum())
        };
        let ends: Vec<(f64, [f64; COMPONENTS])> = (0..=PIECES).map(|i| (place(i), value(place(i)))).collect();
        ends.windows(2).map(|w| Interval { t: [w[0].0, w[1].0], values: [w[0].1, w[1].1] }).collect()
    }
}
