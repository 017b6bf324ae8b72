//! Where the boundary of a mesh touches or enters other cells: what `info` tells of a mesh, and no frame needs.
//!
//! From a place on each boundary face a line goes outwards. What it leaves and enters further on adds up to the number
//! of cells outside the face there (the winding number of the boundary): none, or one that touches it, or one that it
//! lies in.

use super::TetMesh;
use super::boundary::LEAF;
use glam::DVec3;
use rayon::prelude::*;

/// At most so many faces are looked at.
const MOST: usize = 1 << 20;

/// How near a face touches another, relative to its own size.
const NEAR: f64 = 1e-6;

/// Where on a face, as barycentric weights, and in which direction, give or take its sign: where no mesh has its edges.
const PLACE: [f64; 3] = [0.413_729_1, 0.331_207_7, 0.255_063_2];
const DIRECTION: DVec3 = DVec3::new(0.471_305_9, 0.682_171_3, 0.558_943_7);

/// How many boundary faces touch other cells.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Contacts {
    /// Faces looked at: all, or an even sample of them.
    pub faces: usize,
    /// Those that lie on a face of another cell, which lies beyond: T-junctions, blocks that share no points, faults.
    pub touching: usize,
    /// Those that lie in another cell, or on the same side of a face as another: cells overlap.
    pub overlapping: usize,
}

impl Contacts {
    /// Looks at the boundary of a mesh, on the current rayon pool.
    pub fn new(geometry: &TetMesh) -> Self {
        let count = geometry.boundary.faces.len();
        let step = count.div_ceil(MOST).max(1);
        let one = |face: usize| match contact(geometry, face * step) {
            Contact::None => Contacts { faces: 1, touching: 0, overlapping: 0 },
            Contact::Touches => Contacts { faces: 1, touching: 1, overlapping: 0 },
            Contact::Overlaps => Contacts { faces: 1, touching: 0, overlapping: 1 },
        };
        (0..count.div_ceil(step)).into_par_iter().map(one).reduce(Contacts::default, |a, b| Contacts {
            faces: a.faces + b.faces,
            touching: a.touching + b.touching,
            overlapping: a.overlapping + b.overlapping,
        })
    }
}

enum Contact {
    None,
    Touches,
    Overlaps,
}

fn contact(geometry: &TetMesh, face: usize) -> Contact {
    let (faces, points) = (&geometry.boundary.faces, &geometry.points);
    let corners = |f: usize| faces[f].points.map(|p| points[p as usize]);
    let own @ [a, b, c] = corners(face);
    let normal = (b - a).cross(c - a);
    let origin = (0..3).map(|k| own[k] * PLACE[k]).sum::<DVec3>();
    let direction = if normal.dot(DIRECTION) < 0.0 { -DIRECTION } else { DIRECTION };
    let near = NEAR * a.distance(b).max(b.distance(c)).max(c.distance(a));
    // Where the face hardly rises over the line, a near plane is met far away.
    let steep = normal.dot(direction) / normal.length();
    if steep.is_nan() || steep <= 1e-9 {
        return Contact::None;
    }
    let near = near / steep;
    let (mut outside, mut opposite, mut alike) = (0_i32, 0_i32, 0_i32);
    for_each_on_line(geometry, origin, direction, near, |other| {
        if other == face {
            return;
        }
        let [a, b, c] = corners(other).map(|p| p - origin);
        // Six times the volumes between the line and the edges: all of one sign if it passes inside.
        let sides = [direction.dot(b.cross(c)), direction.dot(c.cross(a)), direction.dot(a.cross(b))];
        let leaves = sides.iter().all(|s| *s >= 0.0);
        let sum: f64 = sides.iter().sum();
        if !(leaves || sides.iter().all(|s| *s <= 0.0)) || sum == 0.0 {
            return;
        }
        let t = (sides[0] * a + sides[1] * b + sides[2] * c).dot(direction) / sum;
        if t > near {
            outside += if leaves { 1 } else { -1 };
        } else if t >= -near {
            *(if leaves { &mut alike } else { &mut opposite }) += 1;
        }
    });
    if alike > 0 || outside > opposite {
        Contact::Overlaps
    } else if outside > 0 {
        Contact::Touches
    } else {
        Contact::None
    }
}

/// Calls `found` with each face whose box the line from `origin` on meets, or that is as near as `near` behind it.
fn for_each_on_line(geometry: &TetMesh, origin: DVec3, direction: DVec3, near: f64, mut found: impl FnMut(usize)) {
    let (boxes, faces) = (geometry.boundary.boxes(), &geometry.boundary.faces);
    let (inverse, first_leaf) = (direction.recip(), boxes.len() / 2);
    let mut stack = vec![0];
    while let Some(node) = stack.pop() {
        let [low, high] = boxes[node];
        let (t0, t1) = ((low - origin) * inverse, (high - origin) * inverse);
        let (enter, leave) = (t0.min(t1).max_element(), t0.max(t1).min_element());
        if low.x > high.x || leave < -near || enter > leave + 1e-12 {
            continue;
        }
        if node < first_leaf {
            stack.extend([2 * node + 2, 2 * node + 1]);
        } else {
            let start = (node - first_leaf) * LEAF;
            (start..faces.len().min(start + LEAF)).for_each(&mut found);
        }
    }
}
