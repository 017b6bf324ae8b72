//! Whether a mesh is convex: rays then enter it once.

use crate::geometry::TetMesh;
use glam::DVec3;
use rayon::prelude::*;

/// How far a point may be outside the plane of a boundary face, in normalised units: rounding of points.
const SLACK: f64 = 1e-10;

/// Whether all of the mesh is behind the plane of each of its boundary faces.
pub(super) fn is_convex(geometry: &TetMesh) -> bool {
    let boundary = &geometry.boundary;
    let behind = |face: &crate::geometry::boundary::BoundaryFace| {
        let [a, b, c] = face.points.map(|p| geometry.points[p as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        // Of a face without area nothing is known.
        normal != DVec3::ZERO && !reaches_beyond(geometry, normal, normal.dot(a) + SLACK)
    };
    !boundary.faces.is_empty() && boundary.faces.par_iter().with_min_len(256).all(behind)
}

/// Whether a boundary point p has n · p > `most`.
fn reaches_beyond(geometry: &TetMesh, normal: DVec3, most: f64) -> bool {
    let boundary = &geometry.boundary;
    let beyond = |[low, high]: [DVec3; 2]| {
        let farthest = DVec3::select(normal.cmpgt(DVec3::ZERO), high, low);
        low.x <= high.x && normal.dot(farthest) > most
    };
    let mut found = false;
    boundary.for_each_where(beyond, |face| {
        found |= boundary.faces[face].points.iter().any(|&p| normal.dot(geometry.points[p as usize]) > most);
        found
    });
    found
}
