//! Meshes and cells that are flat, on devices: lengths across them are differences of places in 32 bits.

#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "a test fails by panicking, and tells what it measured")]

mod common;

use common::{Engine, Scene, draw, set};
use glam::{DMat3, DVec3, dvec3};
use halite::field::Association;
use halite::mesh::{Array, Mesh, Values, generate};
use halite::render;
use halite::transfer::TransferFunction;
use halite::view::{Camera, Projection, View};

/// What opacities and colours may be off.
const BOUND: f64 = 3e-4;

const FLATNESS: [f64; 7] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-7, 1e-9];

/// A mesh of side 2, bent in its own plane so that its edges are no straight lines, and turned. Its third coordinate z becomes
/// `height(z)`.
fn squeezed(height: impl Fn(f64) -> f64, place: DVec3) -> Mesh {
    let turn = DMat3::from_rotation_x(0.9) * DMat3::from_rotation_z(0.4);
    draw::moved(&generate::tetrahedra(6), |p| {
        let q = dvec3(p.x + 0.1 * (3.0 * p.y).sin(), p.y + 0.1 * (2.0 * p.x).cos(), height(p.z));
        turn * q + place
    })
}

fn views(place: DVec3) -> Vec<View> {
    let mut views = vec![];
    for (from, projection) in [
        (dvec3(0.3, 0.5, 1.0), Projection::Perspective { view_angle: 35.0 }),
        (dvec3(1.0, 0.3, 0.2), Projection::Perspective { view_angle: 35.0 }),
        (dvec3(0.2, -0.8, 0.5), Projection::Parallel { parallel_scale: 1.4 }),
    ] {
        let position = place + from.normalize() * 5.0;
        let camera = Camera { position, focal_point: place, view_up: dvec3(0.1, 1.0, 0.2), projection };
        views.push(View::new(camera, [72, 60]).unwrap());
    }
    views
}

/// Holds pictures of the device's projection to those of the walk on the CPU. `knots` are the opacities over the values' range, from 0 to 1,
/// for each `unit` of length.
fn compare(name: &str, mesh: &Mesh, values: Vec<f64>, place: DVec3, unit: f64, knots: &[(f64, f64)]) {
    let Some(mut renderer) = common::on_device(render::Engine::Project) else { return };
    let array = Array { name: "s".into(), components: 1, values: Values::F64(values) };
    let scene = Scene::new(mesh, array, Association::Point, |field| {
        let [lo, hi] = field.range(0);
        let at = |u: f64| lo + (hi - lo) * u;
        let color = vec![(at(0.0), [0.1, 0.2, 0.9]), (at(0.5), [0.9, 0.8, 0.1]), (at(1.0), [0.9, 0.1, 0.1])];
        TransferFunction::new(color, knots.iter().map(|k| (at(k.0), k.1)).collect(), unit).unwrap()
    });
    set(&mut renderer, &scene);
    let views = views(place);
    let walked = Engine::Twin { threads: 2 }.draw(&scene, &views);
    for (v, (view, want)) in views.iter().zip(walked).enumerate() {
        let got = renderer.render(view, &|_| ()).unwrap();
        let stats = renderer.stats();
        assert_eq!(
            [stats.engine.as_str(), stats.device.as_str()],
            ["project", "gpu"],
            "{name}: it is left to the walk"
        );
        let seen = want.pixels.iter().filter(|p| p[3] > 0.1).count();
        let error = got.compare(&want).unwrap();
        eprintln!("{name}, view {v}: {:.1e}, {seen} pixels", error.max);
        assert!(seen > 100 && error.max < BOUND, "{name}, view {v}: {:.1e}, {seen} pixels", error.max);
    }
}

#[test]
fn flat_meshes_are_projected_on_devices() {
    for place in [DVec3::ZERO, dvec3(1e4, 3e3, -7e3)] {
        for flat in FLATNESS {
            let mesh = squeezed(|z| z * flat, place);
            let plain = generate::tetrahedra(6);
            let values = plain.points().iter().map(|p| (3.0 * p.x).sin() * (2.0 * p.y).cos() + 0.7 * p.z).collect();
            let knots = [(0.0, 0.0), (0.4, 1.0), (0.5, 0.1), (1.0, 1.0)];
            compare(&format!("{flat:e} at {}", place.x), &mesh, values, place, flat, &knots);
        }
    }
}

/// A thin layer of a thick mesh that a ray does not see through.
#[test]
fn dense_layers_are_projected_on_devices() {
    for thin in FLATNESS {
        for dense in [1.0, 30.0] {
            // The middle layer lies between -0.2 and 0.2.
            let mesh = squeezed(|z| if z.abs() < 0.34 { z * thin } else { z }, DVec3::ZERO);
            let plain = generate::tetrahedra(6);
            let values = plain.points().iter().map(|p| p.z + 0.02 * p.x).collect();
            let knots = [(0.0, 0.0), (0.4, 0.0), (0.47, dense), (0.53, 0.2 * dense), (0.6, 0.0), (1.0, 0.0)];
            compare(&format!("{thin:e}, dense {dense}"), &mesh, values, DVec3::ZERO, thin, &knots);
        }
    }
}
