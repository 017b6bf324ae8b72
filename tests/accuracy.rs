//! What the README says about accuracy: pictures by the engine against the reference's, on every kind of mesh that can
//! be generated. `cargo test --release --test accuracy -- --nocapture` prints the figures.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests fail by panicking")]

use glam::DVec3;
use halite::field::{Association, Component, Field};
use halite::mesh::cells::Tetrahedra;
use halite::mesh::{Mesh, generate};
use halite::render::Renderer;
use halite::transfer::{Convention, Emission, TransferFunction};
use halite::view::{Blend, Camera, Projection, View};

/// Of any channel of any pixel, and over all of them.
const MAX: f64 = 2e-5;
const RMSE: f64 = 2e-6;

/// Maximum and root mean square of the differences between the engine's picture and the reference's.
fn errors(mesh: &Mesh, of: Association, transfer: &TransferFunction, projection: Projection, blend: Blend) -> [f64; 2] {
    let tetrahedra = Tetrahedra::new(mesh).unwrap();
    let name = if of == Association::Point { "s" } else { "c" };
    let field = Field::new(mesh, name, Some(of), Component::Index(0)).unwrap();
    let camera =
        Camera { position: DVec3::new(2.1, -3.7, 2.4), focal_point: DVec3::ZERO, view_up: DVec3::Z, projection };
    let view = View::new(camera, [80, 60]).unwrap().with_blend(blend);
    let truth = halite::reference::render(mesh, &tetrahedra, &field, transfer, &view).unwrap();
    let mut renderer = Renderer::new(0).unwrap();
    renderer.set_tetrahedra(mesh, tetrahedra);
    renderer.set_field(&field).unwrap();
    renderer.set_transfer(transfer);
    let image = renderer.render(&view, &|_| {}).unwrap();
    let pairs = || image.pixels.as_flattened().iter().zip(truth.pixels.as_flattened());
    assert!(pairs().any(|(_, t)| *t > 0.1), "there is something to see");
    let squares = pairs().map(|(a, b)| f64::from(a - b).powi(2));
    let mean = squares.clone().sum::<f64>() / squares.clone().count() as f64;
    [squares.fold(0.0, f64::max).sqrt(), mean.sqrt()]
}

#[test]
fn the_engine_draws_what_the_reference_draws() {
    let color = vec![(-0.8, [0.1, 0.2, 0.9]), (0.0, [0.9; 3]), (0.3, [0.9, 0.8, 0.1]), (0.9, [0.8, 0.1, 0.1])];
    // A flat part, a narrow peak, a step.
    let opacity = vec![(-0.5, 0.02), (0.1, 0.02), (0.15, 0.7), (0.2, 0.02), (0.5, 0.05), (0.5, 0.4), (0.9, 0.9)];
    let extinction = TransferFunction::new(color, opacity, 0.2).unwrap();
    let opacity = extinction.clone().with_convention(Convention::Opacity);
    let direct = extinction.clone().with_emission(Emission::Direct { scale: 1.0 }).unwrap();
    let (near, parallel) = (Projection::Perspective { view_angle: 30.0 }, Projection::Parallel { parallel_scale: 1.4 });
    let (point, cell) = (Association::Point, Association::Cell);
    let (sum, maximum) = (Blend::Composite, Blend::Maximum);
    let demo = generate::demo(9);
    let scenes = [
        ("tetrahedra", errors(&generate::tetrahedra(10), point, &extinction, near, sum)),
        ("hexahedra", errors(&generate::hexahedra(10), point, &extinction, near, sum)),
        ("wedges", errors(&generate::wedges(10), point, &extinction, near, sum)),
        ("pyramids", errors(&generate::pyramids(10), point, &extinction, near, sum)),
        ("all of them, mixed", errors(&generate::mixed(10), point, &extinction, near, sum)),
        ("islands", errors(&generate::islands(10), point, &extinction, near, sum)),
        ("ball with a hole", errors(&demo, point, &extinction, near, sum)),
        ("parallel view", errors(&demo, point, &extinction, parallel, sum)),
        ("cell scalars", errors(&demo, cell, &extinction, near, sum)),
        ("opacity convention", errors(&demo, point, &opacity, near, sum)),
        ("direct emission", errors(&demo, point, &direct, near, sum)),
        ("maximum", errors(&demo, point, &extinction, near, maximum)),
    ];
    for (name, [max, rmse]) in scenes {
        println!("{name:20} max {max:.1e}  rmse {rmse:.1e}");
    }
    let [max, rmse] = [0, 1].map(|k| scenes.iter().fold(0.0, |m: f64, s| m.max(s.1[k])));
    println!("{:20} max {max:.1e}  rmse {rmse:.1e}", "worst");
    assert!(max <= MAX && rmse <= RMSE);
}
