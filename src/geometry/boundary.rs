//! The boundary of a mesh, in a bounding-volume hierarchy: where rays enter.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// A face that belongs to one cell only.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct BoundaryFace {
    /// Its corners: seen from outside they turn counter-clockwise. The smallest index comes first.
    pub points: [u32; 3],
    /// The cell behind it.
    pub cell: u32,
}

/// Faces in each leaf.
pub(crate) const LEAF: usize = 4;

/// The boundary faces along a space-filling curve, under a complete binary tree of boxes.
#[derive(Debug, Clone, Default)]
pub struct Boundary {
    /// The faces; leaf i holds `faces[i * 4..]`, up to four.
    pub faces: Vec<BoundaryFace>,
    /// Smallest and largest corner of each node; the children of node i are 2i + 1 and 2i + 2, the leaves come last.
    boxes: Vec<[DVec3; 2]>,
}

/// The space between the rays through the corners of a part of the image: what lies on the inner side of all planes.
#[derive(Debug, Clone, Copy)]
pub struct Beam {
    /// Normal and offset of each: inside, normal · p + offset ≥ 0.
    planes: [(DVec3, f64); 4],
    /// True if the rays meet in a point inside the mesh, so that lines run through it on both sides of that point.
    pub both_ways: bool,
}

impl Beam {
    /// The beam between four rays (origin, direction), in order around it.
    pub fn new(rays: [(DVec3, DVec3); 4], both_ways: bool) -> Self {
        let inside = rays.iter().map(|r| r.0 + r.1).sum::<DVec3>() / 4.0;
        let planes = [0, 1, 2, 3].map(|i| {
            let ((origin, direction), (next_origin, next_direction)) = (rays[i], rays[(i + 1) % 4]);
            let normal = direction.cross(next_direction + next_origin - origin).normalize_or_zero();
            let offset = -normal.dot(origin);
            if normal.dot(inside) + offset < 0.0 { (-normal, -offset) } else { (normal, offset) }
        });
        Beam { planes, both_ways }
    }

    /// False only if no ray of the beam meets the box.
    fn meets(&self, [low, high]: [DVec3; 2]) -> bool {
        let (middle, half) = (low / 2.0 + high / 2.0, high / 2.0 - low / 2.0);
        // Rounding is far below this; boxes are within [−1, 1]³.
        let slack = 1e-12 * (1.0 + middle.abs().max_element());
        let mut side = [true; 2];
        for (normal, offset) in self.planes {
            let (height, reach) = (normal.dot(middle) + offset, normal.abs().dot(half) + slack * (1.0 + offset.abs()));
            side = [side[0] && height + reach >= 0.0, side[1] && height - reach <= 0.0];
        }
        side[0] || (side[1] && self.both_ways)
    }
}

impl Boundary {
    /// Sorts `faces` and builds the hierarchy; `points` are within [−1, 1]³.
    pub fn new(points: &[DVec3], mut faces: Vec<BoundaryFace>) -> Self {
        faces.par_iter_mut().for_each(|f| {
            let first = (0..3).min_by_key(|&k| f.points[k]).unwrap_or(0);
            f.points.rotate_left(first);
        });
        faces.par_sort_by_cached_key(|f| (super::morton(centre(points, f)), f.points));
        let mut boundary = Boundary { faces, boxes: Vec::new() };
        boundary.refit(points);
        boundary
    }

    /// Fits the boxes to moved `points`.
    pub fn refit(&mut self, points: &[DVec3]) {
        let leaves = self.faces.len().div_ceil(LEAF).next_power_of_two();
        let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        self.boxes = vec![none; 2 * leaves - 1];
        for (leaf, faces) in self.faces.chunks(LEAF).enumerate() {
            let corners = faces.iter().flat_map(|f| f.points).map(|p| points[p as usize]);
            self.boxes[leaves - 1 + leaf] = corners.fold(none, |[l, h], p| [l.min(p), h.max(p)]);
        }
        for i in (0..leaves - 1).rev() {
            let ([l, h], [m, n]) = (self.boxes[2 * i + 1], self.boxes[2 * i + 2]);
            self.boxes[i] = [l.min(m), h.max(n)];
        }
    }

    /// The box around all faces.
    pub fn bounds(&self) -> [DVec3; 2] {
        self.boxes.first().copied().unwrap_or([DVec3::ZERO; 2])
    }

    /// The nodes; those of no face have `low.x > high.x`.
    pub(crate) fn boxes(&self) -> &[[DVec3; 2]] {
        &self.boxes
    }

    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        (size_of_val(&*self.faces) + size_of_val(&*self.boxes)) as u64
    }

    /// Calls `found` with the index of every face that a ray of `beam` may meet, and perhaps of others near it.
    pub fn for_each_in(&self, beam: &Beam, mut found: impl FnMut(usize)) {
        self.for_each_where(
            |b| b[0].x <= b[1].x && beam.meets(b),
            |face| {
                found(face);
                false
            },
        );
    }

    /// Calls `found` with the index of every face in a box that `wants` is true of, and of all boxes around it; until `found`
    /// answers true.
    pub(crate) fn for_each_where(&self, wants: impl Fn([DVec3; 2]) -> bool, mut found: impl FnMut(usize) -> bool) {
        let first_leaf = self.boxes.len() / 2;
        let mut stack = vec![0];
        while let Some(node) = stack.pop() {
            if self.faces.is_empty() || !wants(self.boxes[node]) {
                continue;
            }
            if node < first_leaf {
                stack.extend([2 * node + 2, 2 * node + 1]);
            } else {
                let start = (node - first_leaf) * LEAF;
                if (start..self.faces.len().min(start + LEAF)).any(&mut found) {
                    return;
                }
            }
        }
    }
}

fn centre(points: &[DVec3], face: &BoundaryFace) -> DVec3 {
    face.points.map(|p| points[p as usize]).iter().sum::<DVec3>() / 3.0
}

/// A face that rays of one part of the image may enter through, and the pixels that it may cover.
#[derive(Debug, Clone, Copy)]
pub struct Candidate {
    /// Index into [`Boundary::faces`].
    pub face: usize,
    /// Smallest and largest pixel coordinates.
    pub pixels: [DVec2; 2],
}
