use super::*;

const SIZE: [u32; 2] = [64, 48];

fn camera(projection: Projection) -> View {
    let [position, focal_point, view_up] = [[1.0, -2.0, 3.5], [0.3, 0.1, -0.4], [0.1, 1.0, 0.2]].map(DVec3::from_array);
    let camera = Camera { position, focal_point, view_up, projection };
    View::new(camera, SIZE).unwrap().with_clipping_range([0.5, 90.0]).unwrap()
}

fn to_eye(eye: DVec3, forward: DVec3, up: DVec3) -> DMat4 {
    let forward = forward.normalize();
    let right = forward.cross(up).normalize();
    let axes = DMat3::from_cols(right, right.cross(forward), -forward).transpose();
    DMat4::from_mat3(axes) * DMat4::from_translation(-eye)
}

/// With the near plane at n and the far plane at f; `half` is half the height at depth 1.
fn perspective(half: f64, aspect: f64, n: f64, f: f64) -> DMat4 {
    let (z, w) = (-(f + n) / (f - n), -2.0 * f * n / (f - n));
    let column = glam::DVec4::new;
    DMat4::from_cols(
        column(1.0 / (half * aspect), 0.0, 0.0, 0.0),
        column(0.0, 1.0 / half, 0.0, 0.0),
        column(0.0, 0.0, z, -1.0),
        column(0.0, 0.0, w, 0.0),
    )
}

/// OpenGL's matrices of the same camera, but for rows and columns of the projection that `change` alters.
fn matrices(projection: Projection, change: impl Fn(&mut DMat4)) -> View {
    let view = camera(projection);
    let c = *view.camera().unwrap();
    let to_eye = to_eye(c.position, c.focal_point - c.position, c.view_up);
    let aspect = 64.0 / 48.0;
    let mut to_clip = match c.projection {
        Projection::Perspective { view_angle } => perspective((view_angle.to_radians() / 2.0).tan(), aspect, 0.5, 90.0),
        Projection::Parallel { parallel_scale: s } => {
            DMat4::from_scale(DVec3::new(1.0 / (s * aspect), 1.0 / s, -2.0 / 89.5))
                * DMat4::from_translation(DVec3::new(0.0, 0.0, 45.25))
        }
    };
    change(&mut to_clip);
    View::from_matrices(to_eye, to_clip, SIZE).unwrap()
}

const PROJECTIONS: [Projection; 2] =
    [Projection::Perspective { view_angle: 40.0 }, Projection::Parallel { parallel_scale: 2.0 }];

fn ends(ray: &Ray) -> [DVec3; 2] {
    [ray.t_min, ray.t_max].map(|t| ray.origin + ray.direction * t)
}

#[test]
fn matrices_and_camera_say_the_same() {
    for projection in PROJECTIONS {
        let depth = |view: View| {
            let values = (0..64 * 48).map(|i| f64::from(i) / (64.0 * 48.0)).collect();
            view.with_depth(DepthBuffer { kind: DepthKind::Window, values }).unwrap()
        };
        let (a, b) = (depth(camera(projection)), depth(matrices(projection, |_| ())));
        assert!(a.forward().distance(b.forward()) < 1e-12);
        assert_eq!(a.eye().is_some(), b.eye().is_some());
        for (i, j) in [(0, 0), (63, 0), (10, 40), (63, 47)] {
            let (a, b) = (a.ray(i, j), b.ray(i, j));
            assert!(a.direction.distance(b.direction) < 1e-12, "{a:?} {b:?}");
            for (a, b) in ends(&a).into_iter().zip(ends(&b)) {
                assert!(a.distance(b) < 1e-9, "{projection:?}: {a} {b}");
            }
        }
    }
}

/// A lens shifted in the image plane, and one whose rays lean as those of one of two eyes do.
fn altered() -> Vec<View> {
    let shift = |m: &mut DMat4| {
        *m = DMat4::from_translation(DVec3::new(0.7, -0.3, 0.0)) * *m;
    };
    let lean = |m: &mut DMat4| {
        let mut shear = DMat4::IDENTITY;
        shear.z_axis.x = 0.2;
        shear.w_axis.x = 0.5;
        *m *= shear;
    };
    PROJECTIONS.into_iter().flat_map(|p| [matrices(p, shift), matrices(p, lean), camera(p)]).collect()
}

#[test]
fn points_of_a_ray_are_seen_where_it_passes() {
    for view in altered() {
        for (x, y) in [(0.5, 0.5), (40.25, 3.0), (63.5, 47.5)] {
            let ray = view.ray_through(x, y);
            for t in [1.0, 7.0] {
                let at = view.pixel(ray.origin + ray.direction * t).unwrap();
                assert!(at.distance(DVec2::new(x, y)) < 1e-9, "{at} {x} {y}");
            }
        }
    }
}

#[test]
fn fan_and_rays_are_the_same_lines() {
    let (centre, scale) = (DVec3::new(0.2, 0.1, -0.3), 0.25);
    for view in altered() {
        let fan = view.fan(centre, scale, 0.0);
        for (i, j) in [(0, 0), (20, 33), (63, 47)] {
            let (x, y) = ((2.0 * f64::from(i) + 1.0) / 64.0 - 1.0, 1.0 - (2.0 * f64::from(j) + 1.0) / 48.0);
            let at = |[m, r, u]: [DVec3; 3]| m + r * x + u * y;
            let (origin, direction) = (at(fan.origin), at(fan.direction));
            assert!((direction.dot(view.forward()) - 1.0).abs() < 1e-12);
            let ray = view.ray(i, j);
            let normalised = ends(&ray).map(|p| (p - centre) * scale);
            for (t, end) in [fan.near, fan.far].into_iter().zip(normalised) {
                assert!((origin + direction * t).distance(end) < 1e-9, "{view:?} {t} {end}");
            }
        }
    }
}

#[test]
fn a_far_plane_far_away_costs_no_digits() {
    let eye = DVec3::new(5e5, 4e6, 120.0);
    let to_clip = perspective(0.3, 64.0 / 48.0, 1e-3, 1e9);
    let view = View::from_matrices(to_eye(eye, DVec3::NEG_Z, DVec3::Y), to_clip, SIZE).unwrap();
    assert!(view.eye().unwrap().distance(eye) < 1e-8);
    assert!(view.ray_through(32.0, 24.0).direction.distance(DVec3::NEG_Z) < 1e-14);
}

#[test]
fn useless_matrices_are_refused() {
    let good = perspective(0.3, 1.0, 0.1, 10.0);
    let nan = DMat4::from_scale(DVec3::splat(f64::NAN));
    let flat = DMat4::from_scale(DVec3::new(1.0, 0.0, 1.0));
    for (view, projection) in
        [(nan, good), (flat, good), (DMat4::IDENTITY, flat), (DMat4::IDENTITY, DMat4::ZERO), (good, good)]
    {
        assert!(View::from_matrices(view, projection, SIZE).is_err(), "{view} {projection}");
    }
}
