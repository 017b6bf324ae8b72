//! The weights that make an added point of a polyhedron's own: what is linear at those is linear there, and what lies
//! within bounds stays there.

use glam::{DMat3, DVec3};

/// Mean value coordinates of a point that sees all of a closed surface of outward triangles from inside (Ju, Schaefer &
/// Warren, Mean Value Coordinates for Closed Triangular Meshes, 2005): positive there. For each triangle a share for each
/// of its corners; they add up to 1. `None` if the point is on the surface.
pub(super) fn mean_value(x: DVec3, surface: &[[DVec3; 3]]) -> Option<Vec<[f64; 3]>> {
    let of = |t: &[DVec3; 3]| {
        let arms = t.map(|p| p - x);
        let units = arms.map(DVec3::normalize);
        let [u, v, w] = units;
        // The mean of the unit normals over the triangle, as seen from x, is a sum over its edges.
        let edge = |a: DVec3, b: DVec3| {
            let normal = a.cross(b);
            normal.normalize_or_zero() * normal.length().atan2(a.dot(b)) / 2.0
        };
        let mean = edge(u, v) + edge(v, w) + edge(w, u);
        // It is a sum of the three directions.
        let [a, b, c] = [v.cross(w), w.cross(u), u.cross(v)].map(|n| n.dot(mean));
        let whole = DMat3::from_cols(u, v, w).determinant();
        [a / whole / arms[0].length(), b / whole / arms[1].length(), c / whole / arms[2].length()]
    };
    let shares: Vec<[f64; 3]> = surface.iter().map(of).collect();
    let whole: f64 = shares.iter().flatten().sum();
    (whole.is_finite() && whole > 0.0).then(|| shares.into_iter().map(|s| s.map(|s| s / whole)).collect())
}

/// The weights of each added point for the `own` first ones: the points that are added, all inside, are each the mean of
/// those around it. `None` if that has no solution.
pub(super) fn harmonic(places: &[DVec3], tetrahedra: &[[u32; 4]], own: usize) -> Option<Vec<Vec<f64>>> {
    let n = places.len() - own;
    let width = n + own;
    // The rows of (1 − A) X = B, both sides in one.
    let mut rows = vec![0.0; n * width];
    for i in 0..n {
        let (s, row) = ((own + i) as u32, &mut rows[i * width..(i + 1) * width]);
        let around = tetrahedra.iter().filter_map(|t| t.iter().position(|p| *p == s).map(|k| (t, k)));
        let link: Vec<[u32; 3]> = around.map(|(t, k)| super::inward::OUTWARD[k].map(|j| t[j])).collect();
        let surface: Vec<[DVec3; 3]> = link.iter().map(|t| t.map(|p| places[p as usize])).collect();
        let shares = mean_value(places[s as usize], &surface)?;
        row[i] = 1.0;
        for (t, shares) in link.iter().zip(shares) {
            for (p, share) in t.iter().zip(shares) {
                match (*p as usize).checked_sub(own) {
                    Some(added) => row[added] -= share,
                    None => row[n + *p as usize] += share,
                }
            }
        }
    }
    // Gauss's elimination; sums of rows are positive and pivots need no search.
    for i in 0..n {
        let (above, below) = rows.split_at_mut((i + 1) * width);
        let pivot = &mut above[i * width..];
        let scale = 1.0 / pivot[i];
        pivot[i..].iter_mut().for_each(|x| *x *= scale);
        for row in below.chunks_exact_mut(width) {
            let factor = row[i];
            if factor != 0.0 {
                row[i..].iter_mut().zip(&pivot[i..]).for_each(|(x, p)| *x -= factor * p);
            }
        }
    }
    for i in (0..n).rev() {
        let (above, below) = rows.split_at_mut(i * width);
        let pivot = &below[..width];
        for row in above.chunks_exact_mut(width) {
            let factor = row[i];
            if factor != 0.0 {
                row[n..].iter_mut().zip(&pivot[n..]).for_each(|(x, p)| *x -= factor * p);
            }
        }
    }
    rows.chunks_exact(width)
        .map(|row| {
            let weights = &row[n..];
            let whole: f64 = weights.iter().sum();
            let fits = whole.is_finite() && (whole - 1.0).abs() < 1e-6;
            fits.then(|| weights.iter().map(|w| w / whole).collect())
        })
        .collect()
}
