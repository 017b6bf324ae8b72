//! Order by the power of the eye with respect to the cells' circumspheres, which the host finds in f64: spheres of slivers and
//! of cells far away ask for that.

use super::frame::SeenView;
use crate::geometry::TetMesh;
use crate::gpu::rays::FAR;
use crate::order::MOST_PARTS;
use crate::order::depth::HIDDEN;
use glam::DVec3;
use rayon::prelude::*;

/// How far a cell is: the power of the eye with respect to the sphere through the corners, which are seen from the eye; in a
/// parallel view, whose eye is beyond all, how deep the sphere's centre is. Of a cell that is all but flat, the same of its
/// middle.
fn power(p: [DVec3; 4], forward: Option<DVec3>) -> f64 {
    let [b, c, d] = [p[1] - p[0], p[2] - p[0], p[3] - p[0]];
    let sum = b.length_squared() * c.cross(d) + c.length_squared() * d.cross(b) + d.length_squared() * b.cross(c);
    let centre = sum / (2.0 * b.dot(c.cross(d)));
    if centre.length_squared() < f64::from(FAR) {
        // Without the radius, whose square is that of the way from the first corner to the centre.
        return forward.map_or_else(|| p[0].dot(p[0] + 2.0 * centre), |forward| (p[0] + centre).dot(forward));
    }
    let middle = p.iter().sum::<DVec3>() / 4.0;
    forward.map_or_else(|| middle.length_squared(), |forward| middle.dot(forward))
}

/// `keys` by rank, from the farthest cell on: with as many parts, and hidden where they are.
pub(super) fn ranked(geometry: &TetMesh, seen: &SeenView, keys: &[u32]) -> Vec<u32> {
    let (eye, parallel) = (seen.eye.unwrap_or_default(), seen.eye.is_none().then_some(seen.direction));
    let power = |cell: usize| power(geometry.cells[cell].corners.map(|c| geometry.points[c as usize] - eye), parallel);
    let cells = keys.par_iter().enumerate().filter(|(_, key)| **key != HIDDEN);
    let mut cells: Vec<(f64, usize)> = cells.map(|(cell, _)| (power(cell), cell)).collect();
    cells.par_sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut ranked = vec![HIDDEN; keys.len()];
    for (rank, (_, cell)) in (0..).zip(cells) {
        ranked[cell] = (rank * MOST_PARTS) | (keys[cell] % MOST_PARTS);
    }
    ranked
}
