//! Which faces of a cell are turned to the eye, in f64, the same from both of its sides.
//!
//! The side of a face that the eye is on is the sign of n · (eye − a), n = (b − a) × (c − a), of its corners in ascending sequence of
//! their indices: so both cells that share it compute the same number. On which side of it the cell is follows from the sequence of
//! the cell's corners and [`TetMesh`]'s exact orientation. Where the number is no more than rounding may have made of 0, the face is
//! edge-on, and no ray tells the two cells apart.

use crate::geometry::TetMesh;
use crate::mesh::faces::BOUNDARY;
use crate::view::View;
use glam::DVec3;

/// What n · (eye − a) may be off by, of the product of the three lengths in it, each the sum of its coordinates' sizes.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Where the rays of a view come from, in normalised coordinates.
#[derive(Debug, Clone, Copy)]
pub(super) enum Source {
    /// They meet in the eye.
    Eye(DVec3),
    /// They run in this direction.
    Along(DVec3),
}

impl Source {
    pub(super) fn new(geometry: &TetMesh, view: &View) -> Self {
        match view.eye() {
            Some(eye) => Source::Eye((eye - geometry.centre) * geometry.scale),
            None => Source::Along(view.fan(geometry.centre, geometry.scale, 0.0).direction[0].normalize_or_zero()),
        }
    }

    /// How far a point is: ascending with depth.
    #[inline(always)]
    pub(super) fn depth(self, p: DVec3) -> f64 {
        match self {
            Source::Eye(eye) => p.distance(eye),
            Source::Along(direction) => p.dot(direction),
        }
    }

    /// The least and the greatest depth of points in a box.
    pub(super) fn depths(self, [low, high]: [DVec3; 2]) -> [f64; 2] {
        let (middle, radius) = ((low + high) / 2.0, (high - low).length() / 2.0);
        let depth = self.depth(middle);
        match self {
            Source::Eye(eye) => [eye.clamp(low, high).distance(eye), depth + radius],
            Source::Along(_) => [depth - radius, depth + radius],
        }
    }

    /// From a point towards where its ray comes from.
    #[inline(always)]
    fn towards(self, p: DVec3) -> DVec3 {
        match self {
            Source::Eye(eye) => eye - p,
            Source::Along(direction) => -direction,
        }
    }
}

/// Whether a permutation is odd, by its four numbers of two bits each, the first one lowest.
static ODD: [bool; 256] = {
    let mut odd = [false; 256];
    let mut code = 0;
    while code < 256 {
        let (mut i, mut count) = (0, 0);
        while i < 4 {
            let mut j = i + 1;
            while j < 4 {
                count += ((code >> (2 * i)) & 3 > (code >> (2 * j)) & 3) as usize;
                j += 1;
            }
            i += 1;
        }
        odd[code] = count % 2 == 1;
        code += 1;
    }
    odd
};

/// The sum of the sizes of the coordinates.
#[inline(always)]
fn size(v: DVec3) -> f64 {
    v.x.abs() + v.y.abs() + v.z.abs()
}

/// A cell among its neighbours.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Facing {
    /// A bit for each corner beyond whose opposite face lies a neighbour that is behind this cell.
    pub(super) behind: u8,
    /// Likewise, of neighbours before it.
    pub(super) before: u8,
}

impl Facing {
    /// Of cell `i`, and the middle of it.
    #[inline(always)]
    pub(super) fn new(geometry: &TetMesh, source: Source, i: usize) -> (Self, DVec3) {
        let cell = &geometry.cells[i];
        let mut q: [u64; 4] = std::array::from_fn(|k| u64::from(cell.corners[k]) << 2 | k as u64);
        for (a, b) in [(0, 1), (2, 3), (0, 2), (1, 3), (1, 2)] {
            (q[a], q[b]) = (q[a].min(q[b]), q[a].max(q[b]));
        }
        let k = q.map(|q| (q & 3) as usize);
        let p = q.map(|q| geometry.points[(q >> 2) as usize]);
        let [from, to] = [source.towards(p[0]), source.towards(p[1])];
        let (e, f) = ([p[1] - p[0], p[2] - p[0], p[3] - p[0]], [p[2] - p[1], p[3] - p[1]]);
        // Of the faces opposite to each corner, in sequence: outward and inward in turn in a right-handed sequence.
        let of = |u: DVec3, v: DVec3, d: DVec3| (u.cross(v).dot(d), size(u) * size(v) * size(d) * ROUNDING);
        let sides = [of(f[0], f[1], to), of(e[1], e[2], from), of(e[0], e[2], from), of(e[0], e[1], from)];
        let odd = ODD[k[0] | k[1] << 2 | k[2] << 4 | k[3] << 6];
        let turned = odd != geometry.is_left_handed(i);
        let mut facing = Facing::default();
        for (i, (side, rounding)) in sides.into_iter().enumerate() {
            let is_real = u8::from(cell.neighbours[k[i]] != BOUNDARY && side.abs() > rounding);
            let is_before = u8::from((side > 0.0) != (turned != (i % 2 == 1)));
            facing.before |= (is_real & is_before) << k[i];
            facing.behind |= (is_real & (is_before ^ 1)) << k[i];
        }
        (facing, (p[0] + p[1] + p[2] + p[3]) / 4.0)
    }
}
