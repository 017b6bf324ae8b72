#![allow(clippy::unwrap_used, reason = "tests")]

use crate::field::{Component, Field};
use crate::gpu::DeviceChoice;
use crate::image::Image;
use crate::integral::options::{FEW_KNOTS, Form, IntegrationOptions};
use crate::mesh::generate;
use crate::render::Renderer;
use crate::transfer::TransferFunction;
use crate::view::{Camera, Projection, View};
use glam::{DVec3, dvec3};

fn view() -> View {
    let projection = Projection::Perspective { view_angle: 40.0 };
    let camera = Camera { position: dvec3(2.0, 1.0, 4.0), focal_point: DVec3::ZERO, view_up: DVec3::Y, projection };
    View::new(camera, [32, 24]).unwrap()
}

fn renderer() -> Renderer {
    let mut renderer = Renderer::with_device(2, DeviceChoice::Cpu).unwrap();
    let mesh = generate::tetrahedra(3);
    renderer.set_mesh(&mesh).unwrap();
    renderer.set_field(&Field::new(&mesh, "s", None, Component::Index(0)).unwrap()).unwrap();
    renderer
}

/// A function with so many knots.
fn function(knots: usize, peak: f64) -> TransferFunction {
    let at = |i: usize| -2.0 + 4.0 * i as f64 / (knots - 1) as f64;
    let opacity = (0..knots).map(|i| (at(i), if i % 2 == 0 { 0.2 } else { peak })).collect();
    TransferFunction::new(vec![(-1.0, [1.0, 0.3, 0.0]), (1.0, [0.0, 0.5, 1.0])], opacity, 1.0).unwrap()
}

fn draw(renderer: &mut Renderer) -> (Image, String) {
    let image = renderer.render(&view(), &|_| ()).unwrap();
    (image, renderer.stats().integral.clone())
}

fn table() -> IntegrationOptions {
    IntegrationOptions { table: Some([128, 128, 16]), ..IntegrationOptions::of(Form::Volume) }
}

/// The first frame has its table. After an edit frames are exact, until the new table is there.
#[test]
fn an_edit_does_not_wait_for_its_table() {
    let mut renderer = renderer();
    renderer.set_transfer(&function(5, 2.0));
    let (exact, form) = draw(&mut renderer);
    assert_eq!(form, "exact");
    renderer.set_integral(table());
    let (tabulated, form) = draw(&mut renderer);
    assert_eq!(form, "volume");
    assert!(renderer.stats().table_ms > 0.0 && renderer.stats().table_bytes == 128 * 128 * 16 * 16);
    let difference = tabulated.compare(&exact).unwrap();
    assert!(difference.max > 1e-7 && difference.max < 2e-2, "{difference:?}");

    // An edit: whatever is drawn at once is of the new function.
    renderer.set_transfer(&function(5, 8.0));
    let (now, form) = draw(&mut renderer);
    assert_eq!(form, "exact");
    renderer.wait_for_table();
    let (later, form) = draw(&mut renderer);
    assert_eq!(form, "volume");
    let (edit, settled) = (now.compare(&tabulated).unwrap(), now.compare(&later).unwrap());
    assert!(edit.max > 0.1 && settled.max < 3e-2, "{edit:?} {settled:?}");

    // Many edits at once: the last one counts, and those between are not built.
    for peak in [1.0, 3.0, 5.0, 7.0] {
        renderer.set_transfer(&function(5, peak));
        assert_eq!(draw(&mut renderer).1, "exact");
    }
    let (last, _) = draw(&mut renderer);
    renderer.wait_for_table();
    let (settled, form) = draw(&mut renderer);
    assert_eq!(form, "volume");
    assert!(settled.compare(&last).unwrap().max < 3e-2);
}

#[test]
fn only_what_must_is_built_again() {
    let mut renderer = renderer();
    renderer.set_transfer(&function(5, 2.0));
    renderer.set_integral(table());
    let (first, _) = draw(&mut renderer);
    // The same function, for all that it says.
    renderer.set_transfer(&function(5, 2.0));
    let (same, form) = draw(&mut renderer);
    assert!(form == "volume" && same == first);
    // Another view asks for nothing.
    let mesh = generate::tetrahedra(3);
    renderer.set_field(&Field::new(&mesh, "s", None, Component::Index(0)).unwrap()).unwrap();
    let built = renderer.stats().table_ms;
    assert!(draw(&mut renderer).0 == first);
    assert_eq!(renderer.stats().table_ms, built);
    renderer.set_integral(IntegrationOptions::default());
    assert_eq!(draw(&mut renderer).1, "exact");
    assert_eq!(renderer.stats().table_bytes, 0);
}

#[test]
fn auto_counts_the_knots_of_cells() {
    let mut renderer = renderer();
    renderer.set_integral(IntegrationOptions { table: Some([64, 64, 0]), ..IntegrationOptions::of(Form::Auto) });
    renderer.set_transfer(&function(5, 2.0));
    assert_eq!(draw(&mut renderer).1, "exact");
    let few = renderer.stats().knots_per_cell;
    assert!(few > 0.1 && few < FEW_KNOTS, "{few}");
    renderer.set_transfer(&function(200, 2.0));
    // A table that nobody named is not waited for, unless somebody says so.
    assert_eq!(draw(&mut renderer).1, "exact");
    renderer.wait_for_table();
    assert_eq!(draw(&mut renderer).1, "polynomial");
    let many = renderer.stats().knots_per_cell;
    // 199 intervals instead of 4.
    assert!((many / few / (199.0 / 4.0) - 1.0).abs() < 0.3, "{few}, {many}");
}

#[test]
fn what_no_table_can_hold_is_refused() {
    let mut renderer = renderer();
    renderer.set_transfer(&function(5, 2.0));
    renderer.set_integral(IntegrationOptions { table: Some([1, 1, 1]), ..table() });
    let refused = renderer.render(&view(), &|_| ()).unwrap_err().to_string();
    assert!(refused.contains("at least 2, 2 and 3"), "{refused}");
    renderer.set_integral(table());
    assert_eq!(draw(&mut renderer).1, "volume");
}
