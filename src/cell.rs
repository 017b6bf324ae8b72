//! A ray and a tetrahedron.
//!
//! Points are projected along the ray: the ray becomes the origin of a plane, and everything that can be asked about a
//! cell is answered by the sides on which the origin lies of the projected edges. Those signs are exact, so they are
//! the same for every cell that shares the edge; an origin on an edge is moved aside by an infinitesimal step that is
//! the same for all of them. Then of the four faces of a tetrahedron exactly none or two hold the origin, whatever its
//! shape, and a walk from cell to cell through such faces can neither get lost nor return (Garrity 1990 gives the walk;
//! Edelsbrunner & Mücke 1990 the infinitesimal step).

use glam::DVec3;

/// A ray's own coordinates: two axes across it and one along it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayFrame {
    origin: DVec3,
    across: [DVec3; 2],
    along: DVec3,
}

/// A point in the coordinates of a ray: `x` and `y` across, `t` along it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Projected {
    /// Along the first axis across the ray.
    pub x: f64,
    /// Along the second.
    pub y: f64,
    /// Along the ray, from its origin.
    pub t: f64,
}

impl RayFrame {
    /// The frame of the ray from `origin` along the unit vector `along`.
    pub fn new(origin: DVec3, along: DVec3) -> Self {
        let (a, b) = along.any_orthonormal_pair();
        RayFrame { origin, across: [a, b], along }
    }

    /// The ray's origin and direction.
    pub fn ray(&self) -> (DVec3, DVec3) {
        (self.origin, self.along)
    }

    /// The same ray, moved sideways by `(x, y)`.
    pub fn shifted(self, x: f64, y: f64) -> Self {
        RayFrame { origin: self.origin + self.across[0] * x + self.across[1] * y, ..self }
    }

    /// `p` in the coordinates of the ray.
    #[inline(always)]
    pub fn project(&self, p: DVec3) -> Projected {
        let q = p - self.origin;
        Projected { x: q.dot(self.across[0]), y: q.dot(self.across[1]), t: q.dot(self.along) }
    }
}

/// Twice the area of the triangle (origin, a, b): positive if it turns counter-clockwise.
#[inline(always)]
pub fn orient2d(a: Projected, b: Projected) -> f64 {
    a.x * b.y - a.y * b.x
}

/// Whether the origin lies to the left of the line from `a` to `b`; `cross` is theirs. Exact, and never the same for
/// (b, a) unless the two coincide.
#[inline(always)]
pub fn is_left(a: Projected, b: Projected, cross: f64) -> bool {
    // Each product is off by half a unit in the last place, their difference by one more.
    let doubt = 4.0 * f64::EPSILON * ((a.x * b.y).abs() + (a.y * b.x).abs());
    if cross.abs() > doubt { cross > 0.0 } else { is_left_exactly(a, b) }
}

#[cold]
#[inline(never)]
fn is_left_exactly(a: Projected, b: Projected) -> bool {
    let coord = |p: Projected| robust::Coord { x: p.x, y: p.y };
    let side = robust::orient2d(coord(a), coord(b), robust::Coord { x: 0.0, y: 0.0 });
    if side != 0.0 {
        return side > 0.0;
    }
    // The origin moves to (ε, ε²): cross grows by ε (a.y − b.y) + ε² (b.x − a.x).
    let step = a.y - b.y;
    if step != 0.0 { step > 0.0 } else { b.x > a.x }
}

/// The face that a ray passes through: three projected corners, counter-clockwise around the origin.
#[derive(Debug, Clone, Copy)]
pub struct Face {
    /// The corners.
    pub corners: [Projected; 3],
    /// Twice the areas of the triangles (origin, corner k + 1, corner k + 2): barycentric weights, not normalised.
    pub areas: [f64; 3],
}

impl Face {
    /// The face `corners` if the origin lies in it and it turns counter-clockwise.
    #[inline(always)]
    pub fn enter(corners: [Projected; 3]) -> Option<Self> {
        let [a, b, c] = corners;
        let areas = [orient2d(b, c), orient2d(c, a), orient2d(a, b)];
        (is_left(b, c, areas[0]) && is_left(c, a, areas[1]) && is_left(a, b, areas[2]))
            .then_some(Face { corners, areas })
    }

    /// Walks through the cell that has this face and the further corner `apex`, to the other face that holds the
    /// origin: there `apex` takes the place of the corner whose index is returned.
    #[inline(always)]
    pub fn step(&mut self, apex: Projected) -> usize {
        let [a, b, c] = self.corners;
        let to = [orient2d(apex, a), orient2d(apex, b), orient2d(apex, c)];
        let left = [is_left(apex, a, to[0]), is_left(apex, b, to[1]), is_left(apex, c, to[2])];
        // Of three signs around a triangle that holds the origin exactly one falls from left to right.
        let dropped = if left[0] && !left[1] {
            2
        } else if left[1] && !left[2] {
            0
        } else {
            1
        };
        let [next, last] = [(dropped + 1) % 3, (dropped + 2) % 3];
        self.corners[dropped] = apex;
        self.areas[next] = -to[last];
        self.areas[last] = to[next];
        dropped
    }

    /// Barycentric coordinates of the point where the ray passes through the face.
    #[inline(always)]
    pub fn weights(&self) -> [f64; 3] {
        let [a, b, c] = self.areas;
        let sum = a + b + c;
        if sum > 0.0 {
            let scale = 1.0 / sum;
            [a * scale, b * scale, c * scale]
        } else {
            // The face is seen edge-on: any of its points is as good as another.
            [1.0, 0.0, 0.0]
        }
    }

    /// Where along the ray that is, given the weights.
    #[inline(always)]
    pub fn t(&self, weights: &[f64; 3]) -> f64 {
        let [a, b, c] = self.corners;
        weights[0] * a.t + weights[1] * b.t + weights[2] * c.t
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Small integers make ties, flat cells and coinciding corners common.
    fn corner(seed: &mut u64, span: u64) -> Projected {
        let mut next = || {
            *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((*seed >> 33) % (2 * span + 1)) as f64 - span as f64
        };
        Projected { x: next(), y: next(), t: next() }
    }

    fn holds(a: Projected, b: Projected, c: Projected) -> bool {
        Face::enter([a, b, c]).is_some() || Face::enter([a, c, b]).is_some()
    }

    #[test]
    fn a_ray_passes_through_no_face_or_two() {
        let mut seed = 1;
        for i in 0..400_000 {
            let span = [1, 2, 3, 1000][i % 4];
            let [a, b, c, d] = [(); 4].map(|()| corner(&mut seed, span));
            let faces = [holds(b, c, d), holds(a, c, d), holds(a, b, d), holds(a, b, c)];
            let count = faces.iter().filter(|f| **f).count();
            assert!(count == 0 || count == 2, "{a:?} {b:?} {c:?} {d:?}: {faces:?}");
        }
    }

    #[test]
    fn a_step_finds_the_other_face() {
        let mut seed = 7;
        let mut walked = 0;
        for i in 0..400_000 {
            let span = [1, 2, 3, 1000][i % 4];
            let [a, b, c, d] = [(); 4].map(|()| corner(&mut seed, span));
            let Some(mut face) = Face::enter([a, b, c]) else { continue };
            walked += 1;
            let dropped = face.step(d);
            assert!(face.corners[dropped] == d);
            let fresh = Face::enter(face.corners).expect("the other face turns the same way");
            assert_eq!(fresh.areas, face.areas);
        }
        assert!(walked > 10_000);
    }

    #[test]
    fn weights_find_the_point_on_the_face() {
        let frame = RayFrame::new(DVec3::new(0.2, 0.3, -5.0), DVec3::Z);
        let face = [DVec3::new(0.0, 0.0, 1.0), DVec3::new(1.0, 0.0, 2.0), DVec3::new(0.0, 1.0, 4.0)];
        let corners = face.map(|p| frame.project(p));
        let face =
            Face::enter(corners).or_else(|| Face::enter([corners[0], corners[2], corners[1]])).expect("it is hit");
        assert!((face.t(&face.weights()) - (5.0 + 1.0 + 0.2 + 0.9)).abs() < 1e-12);
    }
}
