//! The joint histogram of a field on a grid and its second variable: see [`Histogram`].

use super::gradient::Gradients;
use super::volume::{Samples, Volume};
use crate::error::{Error, Result};
use crate::field::histogram::Histogram;
use crate::field::{Association, Field};
use crate::grid::Grid;
use crate::integral::cubic::trilinear;
use rayon::prelude::*;

/// Parts of a voxel along each axis, each of which counts as what is in its middle: three, but of many voxels two.
const PARTS: [usize; 2] = [3, 2];
const MANY: usize = 1 << 21;

/// The histogram of `field` on `grid` and its second variable, or the length of its gradient by central differences, in `size`
/// bins over the ranges of both. On the current rayon pool.
///
/// # Errors
/// [`Error::Field`] if the field is one of cells, or not of one component; [`Error::Empty`] if no cell is drawn;
/// [`Error::NoMemory`].
pub fn histogram(grid: &Grid, field: &Field, size: [usize; 2]) -> Result<Histogram> {
    if field.association() == Association::Cell || field.kind().components() != 1 {
        return Err(Error::Field(
            "values of cells have no gradient, and several have several; choose one of points".into(),
        ));
    }
    let volume = Volume::new(grid)?;
    let samples = Samples::new(&volume, field)?;
    let array = field.second().map(|second| Samples::new(&volume, second)).transpose()?;
    let gradients = if array.is_none() { Some(Gradients::new(&volume, &samples)?) } else { None };
    let of_second = match (field.second(), &gradients) {
        (Some(second), _) => second.range(0),
        (None, gradients) => [0.0, gradients.as_ref().map_or(0.0, Gradients::longest)],
    };
    let wide = |[lo, hi]: [f64; 2]| if lo < hi { [lo, hi] } else { [lo - 0.5, lo + 0.5] };
    let ranges = [field.range(0), of_second].map(wide);
    let [columns, rows] = size.map(|n| n.max(1));
    let bin = |x: f64, k: usize, n: usize| {
        let [lo, hi] = ranges[k];
        (((x - lo) / (hi - lo) * n as f64).max(0.0) as usize).min(n - 1)
    };
    let parts = PARTS[usize::from(volume.cell_count() > MANY)];
    let places = (0..parts.pow(3)).map(|i| [i % parts, i / parts % parts, i / (parts * parts)]);
    let places: Vec<[f64; 3]> = places.map(|p| p.map(|i| (i as f64 + 0.5) / parts as f64)).collect();
    let of_unit = volume.to_axes.determinant().abs();
    let [nx, ny, nz] = volume.cells;
    let [row, layer] = samples.stride;
    let own = |samples: &Samples, at| samples.corners(at, 0).map(|s| samples.normal[0].invert(s));
    let layer_of = |k: usize| {
        let mut volumes = vec![0.0; columns * rows];
        for (i, j) in (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j))) {
            if volume.is_hidden((k * ny + j) * nx + i) {
                continue;
            }
            let at = [i, j, k];
            let first = k * layer + j * row + i;
            let s = own(&samples, at);
            let g = match (&array, &gradients) {
                (Some(array), _) => own(array, at),
                (None, Some(g)) => [0, 1, row, row + 1, layer, layer + 1, layer + row, layer + row + 1]
                    .map(|p| g.at(first + p).length() * g.longest()),
                (None, None) => [0.0; 8],
            };
            if !s.iter().chain(&g).all(|v| v.is_finite()) {
                continue;
            }
            let width: f64 = (0..3).map(|a| 1.0 / volume.inverse[a][at[a]]).product();
            let share = width / of_unit / places.len() as f64;
            for p in &places {
                volumes[bin(trilinear(&s, *p), 0, columns) + columns * bin(trilinear(&g, *p), 1, rows)] += share;
            }
        }
        volumes
    };
    // Layers are added up in their sequence, whoever looked at them.
    let mut volumes = vec![0.0; columns * rows];
    for layers in (0..nz).collect::<Vec<_>>().chunks(64) {
        let all: Vec<Vec<f64>> = layers.par_iter().map(|k| layer_of(*k)).collect();
        for part in all {
            volumes.iter_mut().zip(part).for_each(|(sum, v)| *sum += v);
        }
    }
    Ok(Histogram { size: [columns, rows], ranges, volumes })
}
