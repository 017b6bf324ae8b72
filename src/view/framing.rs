//! Cameras that points fill the picture of.

use super::{Camera, Projection};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

impl Camera {
    /// A perspective camera that looks along −`towards` and sees all of `points`: it is as near as they allow within the
    /// share `fill`, in (0, 1], of the width and height of pictures of this `size`, so that they span that much of one of
    /// the two and lie in its middle. The focal point is amid them. `view_angle` is in degrees, from bottom to top.
    ///
    /// For a point at (x, y) across and z along the view, |x − c| ≤ t (z − e) must hold for a camera at (c, e) whose
    /// pictures are t wide at depth 1: that is x − t z ≤ c − t e and −x − t z ≤ −c − t e, so the extremes of x − t z and
    /// −x − t z say where it is.
    ///
    /// None if there is no point, one is not finite, or `towards` or `view_up` is zero.
    pub fn filled<'a, P>(
        points: P,
        towards: DVec3,
        view_up: DVec3,
        view_angle: f64,
        size: [u32; 2],
        fill: f64,
    ) -> Option<Self>
    where
        P: IntoParallelIterator<Item = &'a DVec3>,
    {
        let forward = -super::direction(towards)?;
        let up = super::direction(view_up)?;
        // Any axis will do where up lies along the view: there is a camera, though not one that can draw.
        let right = super::direction(forward.cross(up)).unwrap_or(forward.any_orthonormal_vector());
        let up = right.cross(forward);
        let tan = (view_angle.to_radians() / 2.0).tan() * fill;
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        let (wide, high) = (tan * aspect, tan);
        let none = [f64::NEG_INFINITY; 6];
        let most =
            |a: [f64; 6], b: [f64; 6]| std::array::from_fn(|k| if b[k] > a[k] || b[k].is_nan() { b[k] } else { a[k] });
        let [left, rightmost, low, top, near, far] = points
            .into_par_iter()
            .map(|p| {
                let (x, y, z) = (p.dot(right), p.dot(up), p.dot(forward));
                [-x - wide * z, x - wide * z, -y - high * z, y - high * z, -z, z]
            })
            .reduce(|| none, most);
        let (across, aloft) = ((rightmost - left) / 2.0, (top - low) / 2.0);
        let reach = (-(left + rightmost) / (2.0 * wide)).min(-(low + top) / (2.0 * high));
        // Not in the points themselves, which may be one, or lie on a line that is looked along.
        let depth = near + far;
        let apart =
            if depth > 0.0 { 1e-3 * depth } else { (1e-3 * (across.abs() + aloft.abs() + far.abs())).max(1e-3) };
        let back = reach.min(-near - apart);
        let position = right * across + up * aloft + forward * back;
        let focal_point = position + forward * ((far - near) / 2.0 - back);
        let projection = Projection::Perspective { view_angle };
        let camera = Camera { position, focal_point, view_up, projection };
        (position.is_finite() && focal_point.is_finite()).then_some(camera)
    }
}

/// The area of the convex hull of `points` (Andrew's monotone chain, 1979).
pub(crate) fn hull_area(points: &mut [DVec2]) -> f64 {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let half = |points: &mut dyn Iterator<Item = &DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for &p in points {
            while let [.., a, b] = chain[..] {
                if (b - a).perp_dot(p - a) > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(p);
        }
        chain.windows(2).map(|w| w[0].perp_dot(w[1])).sum::<f64>()
    };
    (half(&mut points.iter()) + half(&mut points.iter().rev())) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::View;

    /// Points of any shape at any place fill the picture, and none is outside.
    #[test]
    fn points_fill_the_picture() {
        let mut seed = 7_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        for round in 0..200 {
            let stretch = DVec3::new(1.0, 10_f64.powf(4.0 * random()), 10_f64.powf(4.0 * random()));
            let at = DVec3::new(random(), random(), random()) * [0.0, 1.0, 1e6][round % 3];
            let count = 4 + round;
            let points: Vec<DVec3> =
                (0..count).map(|_| at + DVec3::new(random(), random(), random()) * stretch).collect();
            let towards = DVec3::new(random(), random(), random());
            let size = [[1024, 768], [300, 900], [640, 640]][round % 3];
            let camera = Camera::filled(&points, towards, DVec3::Z, 30.0, size, 0.94).unwrap();
            let view = View::new(camera, size).unwrap();
            let places: Vec<DVec2> = points.iter().map(|&p| view.pixel(p).unwrap()).collect();
            let [w, h] = size.map(f64::from);
            let span = |of: fn(DVec2) -> f64, full: f64| {
                let (lo, hi) = places.iter().fold((full, 0.0_f64), |(l, h), &p| (l.min(of(p)), h.max(of(p))));
                assert!(lo > 0.0 && hi < full, "{lo} to {hi} of {full}");
                (hi - lo) / full
            };
            let most = span(|p| p.x, w).max(span(|p| p.y, h));
            assert!((most - 0.94).abs() < 1e-3, "{round}: {most}");
        }
    }

    #[test]
    fn points_that_fill_nothing_have_a_camera() {
        let all = |points: &[DVec3]| Camera::filled(points, DVec3::NEG_Y, DVec3::Z, 30.0, [4, 3], 0.9);
        for points in [&[DVec3::ONE][..], &[DVec3::ZERO], &[DVec3::ZERO, DVec3::Y], &[DVec3::ONE * 1e9; 3]] {
            let camera = all(points).unwrap();
            View::new(camera, [4, 3]).unwrap();
            assert!(camera.position.y < points[0].y);
        }
        assert!(all(&[]).is_none() && all(&[DVec3::NAN]).is_none());
        assert!(Camera::filled(&[DVec3::ONE], DVec3::ZERO, DVec3::Z, 30.0, [4, 3], 0.9).is_none());
    }

    #[test]
    fn areas_of_hulls() {
        let mut square: Vec<DVec2> = (0..9).map(|i| DVec2::new(f64::from(i % 3), f64::from(i / 3))).collect();
        assert_eq!(hull_area(&mut square), 4.0);
        assert_eq!(hull_area(&mut [DVec2::ZERO, DVec2::X]), 0.0);
        assert_eq!(hull_area(&mut []), 0.0);
    }
}
