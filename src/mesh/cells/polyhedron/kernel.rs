//! The point that lies deepest inside of half-spaces: what sees all faces of a polyhedron, if anything does.

use glam::{DMat4, DVec3, DVec4, dvec3};

/// Exchanges of a half-space; a dozen is usual.
const STEPS: usize = 500;

/// The half-space of points x with normal · x ≤ offset; the normal has length 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Plane {
    pub(super) normal: DVec3,
    pub(super) offset: f64,
}

impl Plane {
    /// What lies behind a triangle that is counter-clockwise as seen from outside; `None` if that is flat.
    pub(super) fn of([a, b, c]: [DVec3; 3]) -> Option<Self> {
        let normal = (b - a).cross(c - a);
        let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
        let normal = (normal.length() > 1e-13 * longest).then(|| normal.normalize())?;
        Some(Plane { normal, offset: normal.dot((a + b + c) / 3.0) })
    }

    /// How far a point is from the plane, above 0 inside.
    pub(super) fn depth(&self, x: DVec3) -> f64 {
        self.offset - self.normal.dot(x)
    }

    /// The other half-space.
    pub(super) fn turned(self) -> Self {
        Plane { normal: -self.normal, offset: -self.offset }
    }
}

/// A point, how deep it is in the half-space that it is least deep in, and which four of these hold it where it is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Deepest {
    pub(super) place: DVec3,
    pub(super) depth: f64,
    pub(super) held_by: [usize; 4],
}

/// The deepest point of all, for half-spaces whose intersection, if any, lies within a distance of 4 from the origin: by
/// the dual simplex method (Lemke 1954) for max t with n · x + t ≤ d. A depth of 0 or less means that no point is inside.
pub(super) fn deepest(planes: &[Plane]) -> Deepest {
    let s = 1.0 / 3f64.sqrt();
    let around = [dvec3(s, s, s), dvec3(s, -s, -s), dvec3(-s, s, -s), dvec3(-s, -s, s)];
    let mut basis = around.map(|normal| Plane { normal, offset: 4.0 });
    let mut held_by = [usize::MAX; 4];
    let mut best = Deepest { place: DVec3::ZERO, depth: f64::NEG_INFINITY, held_by };
    for _ in 0..STEPS {
        let [a, b, c, d] = basis.map(|p| p.normal.extend(1.0));
        let inverse = DMat4::from_cols(a, b, c, d).inverse();
        let solution = inverse.transpose() * DVec4::from(basis.map(|p| p.offset));
        let place = solution.truncate();
        if !solution.is_finite() {
            break;
        }
        let depths = planes.iter().map(|p| p.depth(place)).enumerate();
        let Some((enters, depth)) = depths.min_by(|a, b| a.1.total_cmp(&b.1)) else { break };
        if depth > best.depth {
            best = Deepest { place, depth, held_by };
        }
        if depth >= solution.w - 1e-13 || held_by.contains(&enters) {
            break;
        }
        let share = (inverse * DVec4::W).to_array();
        let change = (inverse * planes[enters].normal.extend(1.0)).to_array();
        // The one whose share is used up first leaves; of several, that of the greatest change.
        let leaves = (0..4).filter(|&k| change[k] > 1e-11).min_by(|&i, &j| {
            let [a, b] = [i, j].map(|k| share[k].max(0.0) / change[k]);
            if (a - b).abs() < 1e-14 { change[j].total_cmp(&change[i]) } else { a.total_cmp(&b) }
        });
        let Some(leaves) = leaves else { break };
        basis[leaves] = planes[enters];
        held_by[leaves] = enters;
    }
    best
}
