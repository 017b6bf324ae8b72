//! Slabs of grids by tables: pictures beside those of the integrals that tables stand for, and beside the field's own.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use glam::{DMat3, DVec3};
use halite::cast::{Reconstruction, ReconstructionOrder, Sampling};
use halite::field::{Component, Field};
use halite::gpu::DeviceChoice;
use halite::grid::{Grid, Lattice};
use halite::image::Image;
use halite::integral::options::{Form, IntegrationOptions, Texels};
use halite::mesh::{Array, Values};
use halite::render::Renderer;
use halite::transfer::{Emission, TransferFunction};
use halite::view::{Camera, Projection, View};

const SIZE: [usize; 3] = [9, 8, 10];

/// A turned image of a wave, of bytes.
fn grid(value: impl Fn([f64; 3]) -> f64) -> Grid {
    let [nx, ny, nz] = SIZE;
    let points = (0..nx * ny * nz).map(|p| [p % nx, p / nx % ny, p / (nx * ny)].map(|i| i as f64));
    let values = points.map(|p| (128.0 + 100.0 * value(p)) as u8).collect();
    let lattice = Lattice {
        origin: DVec3::new(0.1, -0.2, 0.3),
        spacing: DVec3::new(0.11, 0.14, 0.1),
        direction: DMat3::from_rotation_z(0.4),
        size: SIZE,
        ..Lattice::default()
    };
    let array = Array { name: "s".into(), components: 1, values: Values::U8(values) };
    Grid::regular(&lattice, vec![array], vec![]).unwrap()
}

fn wave([x, y, z]: [f64; 3]) -> f64 {
    (0.9 * x + 0.1 * y * z).sin() * 0.6 + (0.7 * z - 0.8 * y).cos() * 0.4
}

fn transfer() -> TransferFunction {
    let color = vec![(30.0, [0.9, 0.2, 0.1]), (128.0, [0.2, 0.8, 0.3]), (230.0, [0.1, 0.3, 1.0])];
    TransferFunction::new(color, vec![(60.0, 0.0), (110.0, 0.9), (150.0, 0.1), (220.0, 1.2)], 0.3).unwrap()
}

fn view() -> View {
    let camera = Camera {
        position: DVec3::new(2.6, -1.9, 2.2),
        focal_point: DVec3::new(0.3, 0.4, 0.7),
        view_up: DVec3::Z,
        projection: Projection::Perspective { view_angle: 30.0 },
    };
    View::new(camera, [48, 40]).unwrap()
}

fn renderer(grid: &Grid, transfer: &TransferFunction) -> Renderer {
    let mut renderer = Renderer::with_device(2, DeviceChoice::Cpu).unwrap();
    renderer.set_grid(grid).unwrap();
    renderer.set_field(&Field::new(grid, "s", None, Component::Index(0)).unwrap()).unwrap();
    renderer.set_transfer(transfer);
    renderer
}

fn draw(renderer: &mut Renderer, order: ReconstructionOrder, sampling: Sampling, choice: IntegrationOptions) -> Image {
    renderer.set_reconstruction(Reconstruction { order, sampling });
    renderer.set_integral(choice);
    let image = renderer.render(&view(), &|_| ()).unwrap();
    assert_eq!(renderer.stats().integral, choice.form.name());
    image
}

/// Every form with the reconstructions that read it, and how far its pictures may be from those of the integral.
fn forms() -> Vec<(ReconstructionOrder, Sampling, IntegrationOptions, f64)> {
    let steps = Sampling::Steps(0.1);
    let small = |form| IntegrationOptions::of(form).with_table(Some([64, 64, 64]));
    vec![
        (ReconstructionOrder::Two, Sampling::Voxels, IntegrationOptions::of(Form::SecondOrderPolynomial), 2e-2),
        (ReconstructionOrder::Two, steps, IntegrationOptions::of(Form::SecondOrderPolynomial), 2e-2),
        (ReconstructionOrder::Two, steps, small(Form::SecondOrderPolynomial).with_degree(1), 2e-2),
        (ReconstructionOrder::Two, steps, small(Form::SecondOrderPolynomial).with_texels(Texels::Unorm16), 2e-2),
        (ReconstructionOrder::One, Sampling::Voxels, IntegrationOptions::of(Form::Volume), 2e-3),
        (ReconstructionOrder::One, steps, IntegrationOptions::of(Form::Polynomial), 2e-3),
        (ReconstructionOrder::One, steps, IntegrationOptions::of(Form::Volume).with_texels(Texels::Unorm16), 2e-3),
    ]
}

#[test]
fn tables_show_what_they_stand_for() {
    let grid = grid(wave);
    for direct in [false, true] {
        let emission = if direct { Emission::Direct { scale: 2.0 } } else { Emission::Chromatic };
        let transfer = transfer().with_emission(emission).unwrap();
        let mut renderer = renderer(&grid, &transfer);
        for (order, sampling, choice, bound) in forms() {
            let want = draw(&mut renderer, order, sampling, IntegrationOptions::default());
            let got = draw(&mut renderer, order, sampling, choice);
            assert!(renderer.stats().table_bytes > 0 && renderer.stats().table_ms > 0.0);
            let (error, name) = (got.compare(&want).unwrap(), choice.form.name());
            let most = want.pixels.iter().map(|p| p[3]).fold(0.0, f32::max);
            assert!(most > 0.8, "{most}");
            assert!(error.max < bound, "{name} {order:?} {sampling:?}, direct {direct}: {:.1e}", error.max);
            assert!(error.max > 0.0, "{name}: no table was read");
        }
    }
}

/// The published table is of whole slabs: what is left of a ray behind the last one is not drawn. It is the nearer, the more
/// texels and steps it has.
#[test]
fn published_tables_end_with_the_last_whole_slab() {
    let (grid, transfer) = (grid(wave), transfer());
    let mut renderer = renderer(&grid, &transfer);
    let sampling = Sampling::Steps(0.02);
    let want = draw(&mut renderer, ReconstructionOrder::Two, sampling, IntegrationOptions::default());
    let off = |renderer: &mut Renderer, n: u32, iterations: u32, texels| {
        let choice = IntegrationOptions::of(Form::SecondOrder)
            .with_table(Some([n; 3]))
            .with_iterations(iterations)
            .with_texels(texels);
        draw(renderer, ReconstructionOrder::Two, sampling, choice).compare(&want).unwrap().rmse
    };
    let coarse = off(&mut renderer, 16, 64, Texels::Float);
    let fine = off(&mut renderer, 128, 64, Texels::Float);
    let bytes = off(&mut renderer, 128, 64, Texels::Unorm8);
    // The last slab of a ray is up to 0.04 of the unit distance of 0.3.
    assert!(fine < coarse && fine < 0.03, "{coarse:.1e} {fine:.1e}");
    assert!(bytes != fine && bytes < 0.06, "{bytes:.1e}");
    // Of one value all over, with slabs as long as the whole grid is thick, nothing is whole.
    let flat = self::grid(|_| 0.2);
    let mut renderer = self::renderer(&flat, &transfer);
    let long = Sampling::Steps(5.0);
    let plain = draw(&mut renderer, ReconstructionOrder::Two, long, IntegrationOptions::default());
    let none = draw(
        &mut renderer,
        ReconstructionOrder::Two,
        long,
        IntegrationOptions::of(Form::SecondOrder).with_table(Some([8; 3])),
    );
    assert!(plain.pixels.iter().any(|p| p[3] > 0.1) && none.pixels.iter().all(|p| *p == [0.0; 4]));
    // For all lengths there is a table, whose diagonal is right.
    // The one value is 0 as it is mapped, and one of an odd number of texels.
    let all = IntegrationOptions::of(Form::SecondOrderPolynomial).with_table(Some([9; 3]));
    let error = draw(&mut renderer, ReconstructionOrder::Two, long, all).compare(&plain).unwrap();
    assert!(error.max < 1e-5, "{:.1e}", error.max);
}

/// Where the function's knots lie beyond the values, or values beyond the knots.
#[test]
fn knots_and_values_may_lie_beyond_each_other() {
    let grid = grid(wave);
    let knots = |lo: f64, hi: f64| {
        let at = |x: f64| lo + (hi - lo) * x;
        let color = vec![(at(0.0), [1.0, 0.2, 0.1]), (at(1.0), [0.1, 0.4, 1.0])];
        TransferFunction::new(color, vec![(at(0.0), 0.1), (at(0.5), 0.8), (at(1.0), 0.2)], 0.3).unwrap()
    };
    for (lo, hi) in [(-400.0, 900.0), (120.0, 140.0), (0.0, 100.0), (300.0, 400.0)] {
        for clamp in [true, false] {
            let transfer = knots(lo, hi).with_clamp(clamp);
            let mut renderer = renderer(&grid, &transfer);
            let want = draw(&mut renderer, ReconstructionOrder::Two, Sampling::Voxels, IntegrationOptions::default());
            let choice = IntegrationOptions::of(Form::SecondOrderPolynomial).with_table(Some([96; 3]));
            let got = draw(&mut renderer, ReconstructionOrder::Two, Sampling::Voxels, choice).compare(&want).unwrap();
            assert!(got.max < 0.1 && got.rmse < 0.02, "{lo} to {hi}, {clamp}: {:.1e} {:.1e}", got.max, got.rmse);
        }
    }
}

/// A frame after an edit does not wait for the table; it shows the new function, and later ones do by its table.
#[test]
fn edits_do_not_stall_frames() {
    let grid = grid(wave);
    let mut renderer = renderer(&grid, &transfer());
    let choice = IntegrationOptions::of(Form::SecondOrderPolynomial).with_table(Some([64; 3]));
    draw(&mut renderer, ReconstructionOrder::Two, Sampling::Voxels, choice);
    let other = TransferFunction::new(vec![(0.0, [0.2, 0.9, 0.4])], vec![(90.0, 0.0), (200.0, 1.0)], 0.3).unwrap();
    renderer.set_transfer(&other);
    let first = renderer.render(&view(), &|_| ()).unwrap();
    assert_eq!(renderer.stats().integral, "exact");
    let mut plain = self::renderer(&grid, &other);
    let want = draw(&mut plain, ReconstructionOrder::Two, Sampling::Voxels, IntegrationOptions::default());
    assert!(first == want);
    let begun = std::time::Instant::now();
    while renderer.stats().integral != "second-order-polynomial" {
        assert!(begun.elapsed().as_secs() < 120, "the table is never there");
        let image = renderer.render(&view(), &|_| ()).unwrap();
        assert!(image.compare(&want).unwrap().max < 2e-2);
    }
}

#[test]
fn what_has_no_table_is_said() {
    let grid = grid(wave);
    let mut renderer = renderer(&grid, &transfer());
    for (order, sampling, form, part) in [
        (ReconstructionOrder::Two, Sampling::Voxels, Form::SecondOrder, "--sampling LENGTH"),
        (ReconstructionOrder::Two, Sampling::Voxels, Form::Volume, "second-order"),
        (ReconstructionOrder::One, Sampling::Voxels, Form::SecondOrderPolynomial, "--reconstruction 2"),
        (ReconstructionOrder::Exact, Sampling::Voxels, Form::Volume, "--integral exact"),
        (ReconstructionOrder::Midpoint, Sampling::Voxels, Form::Volume, "--integral exact"),
    ] {
        renderer.set_reconstruction(Reconstruction { order, sampling });
        renderer.set_integral(IntegrationOptions::of(form));
        let error = renderer.render(&view(), &|_| ()).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
    // Meshes have no slabs.
    let mesh = halite::mesh::generate::tetrahedra(2);
    renderer.set_mesh(&mesh).unwrap();
    let name = mesh.point_arrays()[0].name.clone();
    renderer.set_field(&Field::new(&mesh, &name, None, Component::Index(0)).unwrap()).unwrap();
    renderer.set_integral(IntegrationOptions::of(Form::SecondOrderPolynomial));
    let error = renderer.render(&view(), &|_| ()).unwrap_err().to_string();
    assert!(error.contains("grids"), "{error}");
}
