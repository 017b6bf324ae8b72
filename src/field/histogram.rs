//! The joint histogram of a scalar and a second variable, by the volume that has such values (Kindlmann & Durkin,
//! Semi-Automatic Generation of Transfer Functions for Direct Volume Rendering, 1998): what one looks at to place a widget.

use super::{Association, Field, Gradient};
use crate::error::{Error, Result};
use crate::mesh::cells::Tetrahedra;
use glam::DVec3;
use rayon::prelude::*;

/// Parts that the cells are added up in: each has bins of its own.
const PARTS: usize = 32;

/// How much of a mesh's volume has which values.
#[derive(Debug, Clone, PartialEq)]
pub struct Histogram {
    /// Bins of s (columns), and of g (rows).
    pub size: [usize; 2],
    /// The ranges of s and g that the bins divide evenly.
    pub ranges: [[f64; 2]; 2],
    /// The volume in each bin, row by row from the least g.
    pub volumes: Vec<f64>,
}

impl Histogram {
    /// The histogram of `field` and its second variable, or its gradient's length, in `size` bins over the ranges of both.
    /// In each of `tetrahedra`, whose corners index into `points`, the two are linear; they are looked at in 20 parts of
    /// equal volume. On the current rayon pool; its bits do not depend on the number of threads.
    ///
    /// # Errors
    /// [`Error::Field`] if the field is one of cells, or has no gradient; [`Error::NoMemory`].
    pub fn new(points: &[DVec3], tetrahedra: &Tetrahedra, field: &Field, size: [usize; 2]) -> Result<Self> {
        if field.association() == Association::Cell {
            return Err(Error::Field("values of cells have no gradient; choose an array of points".into()));
        }
        let own = field.len();
        let all = |of: &Field| {
            let added = tetrahedra.added_values(1, |i| of.value(i));
            (0..own).map(|i| of.value(i)).chain(added).collect::<Vec<f64>>()
        };
        let (second, range) = match field.second() {
            Some(second) => (all(second), second.range(0)),
            None => {
                let gradient = Gradient::new(points, tetrahedra, field)?;
                (gradient.vectors().par_iter().map(|&v| super::gradient::length(v)).collect(), gradient.range())
            }
        };
        let first = all(field);
        let none = || [f64::INFINITY, f64::NEG_INFINITY];
        let drawn = tetrahedra.corners.par_iter().filter(|c| c.iter().all(|&p| first[p as usize].is_finite()));
        let seen =
            drawn.fold(none, |r, c| c.iter().map(|&p| first[p as usize]).fold(r, |[lo, hi], v| [lo.min(v), hi.max(v)]));
        let seen = seen.reduce(none, |a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        let wide = |[lo, hi]: [f64; 2]| if lo < hi { [lo, hi] } else { [lo - 0.5, lo + 0.5] };
        let ranges = [if seen[0] <= seen[1] { seen } else { [0.0; 2] }, range].map(wide);
        let [columns, rows] = size.map(|n| n.max(1));
        let bin = |x: f64, k: usize, n: usize| {
            let [lo, hi] = ranges[k];
            (((x - lo) / (hi - lo) * n as f64).max(0.0) as usize).min(n - 1)
        };
        let lattice = lattice();
        let part = |corners: &[[u32; 4]]| {
            let mut volumes = vec![0.0; columns * rows];
            for c in corners {
                let at = c.map(|p| [first[p as usize], second[p as usize]]);
                let [a, b, d, e] = c.map(|p| points[p as usize]);
                let volume = (b - a).dot((d - a).cross(e - a)).abs() / 6.0;
                if !at.as_flattened().iter().all(|v| v.is_finite()) || !volume.is_finite() {
                    continue;
                }
                for weights in &lattice {
                    let mean = |k: usize| (0..4).map(|i| weights[i] * at[i][k]).sum::<f64>();
                    let place = bin(mean(0), 0, columns) + columns * bin(mean(1), 1, rows);
                    volumes[place] += volume / lattice.len() as f64;
                }
            }
            volumes
        };
        // In the sequence of the cells, whoever added them up.
        let parts: Vec<Vec<f64>> =
            tetrahedra.corners.par_chunks(tetrahedra.corners.len().div_ceil(PARTS).max(1)).map(part).collect();
        let mut volumes = vec![0.0; columns * rows];
        for part in parts {
            volumes.iter_mut().zip(part).for_each(|(sum, v)| *sum += v);
        }
        Ok(Histogram { size: [columns, rows], ranges, volumes })
    }
}

/// Weights of the corners at the middles of parts of a tetrahedron: all sums of three whole numbers and a quarter of
/// four fourths.
fn lattice() -> Vec<[f64; 4]> {
    let mut all = Vec::new();
    for i in 0..4_u8 {
        for j in 0..4 - i {
            for k in 0..4 - i - j {
                let l = 3 - i - j - k;
                all.push([i, j, k, l].map(|n| (f64::from(n) + 0.25) / 4.0));
            }
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Component;
    use crate::mesh::generate;

    #[test]
    fn all_of_the_volume_is_there_and_where_its_values_are() {
        let mesh = generate::demo(4);
        let tetrahedra = Tetrahedra::new(&mesh).unwrap();
        let points = tetrahedra.points(mesh.points());
        let field = |f: &dyn Fn(DVec3) -> f64| {
            let values: Vec<f64> = mesh.points().iter().map(|&p| f(p)).collect();
            Field::from_slice("s", &values, 1, Association::Point, Component::Index(0)).unwrap()
        };
        let whole: f64 = tetrahedra
            .corners
            .iter()
            .map(|c| {
                let [a, b, c, d] = c.map(|p| points[p as usize]);
                (b - a).dot((c - a).cross(d - a)).abs() / 6.0
            })
            .sum();
        let both = field(&|p| p.z).with_second(field(&|p| 2.0 * p.z)).unwrap();
        let histogram = Histogram::new(&points, &tetrahedra, &both, [8, 8]).unwrap();
        assert!((histogram.volumes.iter().sum::<f64>() - whole).abs() < 1e-12 * whole);
        // One is twice the other: all is on the diagonal.
        for (i, v) in histogram.volumes.iter().enumerate() {
            assert!(i % 9 == 0 || *v < 0.02 * whole, "{i}: {v}");
        }
        assert!(histogram.volumes[27] > 0.05 * whole);
        // A linear field has one gradient.
        let linear = Histogram::new(&points, &tetrahedra, &field(&|p| 3.0 * p.x), [4, 4]).unwrap();
        assert!((linear.ranges[1][0] - 3.0).abs() < 0.6 && linear.volumes.len() == 16);
        let values = vec![1.0; mesh.cells().len()];
        let cells = Field::from_slice("c", &values, 1, Association::Cell, Component::Index(0)).unwrap();
        assert!(Histogram::new(&points, &tetrahedra, &cells, [4, 4]).unwrap_err().to_string().contains("no gradient"));
    }

    #[test]
    fn parts_have_one_middle() {
        let lattice = lattice();
        assert_eq!(lattice.len(), 20);
        for k in 0..4 {
            assert!((lattice.iter().map(|w| w[k]).sum::<f64>() - 5.0).abs() < 1e-12);
        }
        assert!(lattice.iter().all(|w| (w.iter().sum::<f64>() - 1.0).abs() < 1e-12));
    }
}
