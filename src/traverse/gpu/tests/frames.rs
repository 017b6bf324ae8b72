//! What a frame hands over, and what becomes of it where the device fails.

use super::draw;
use super::random::{Random, plain, random_transfer, random_view};
use crate::error::Error;
use crate::field::{Association, Component, Field};
use crate::gpu::testing::choice;
use crate::gpu::{DeviceChoice, Gpu};
use crate::mesh::{Mesh, generate};
use crate::render::Renderer;
use crate::traverse::gpu::RayUniforms;
use crate::view::{Camera, Projection, View};
use glam::DVec3;

#[test]
fn only_what_changed_is_handed_over() {
    let Some(choice) = choice() else { return };
    let mesh = plain(generate::tetrahedra(9));
    let mut random = Random(1);
    let mut renderer = Renderer::with_device(0, choice).unwrap();
    renderer.set_mesh(&mesh).unwrap();
    let field = |name: &str| Field::new(&mesh, name, Some(Association::Point), Component::All).unwrap();
    renderer.set_field(&field("scalar")).unwrap();
    renderer.set_transfer(&random_transfer(&mut random, false));
    let camera = Camera {
        position: DVec3::new(3.0, 2.0, 1.0),
        focal_point: DVec3::ZERO,
        view_up: DVec3::Z,
        projection: Projection::Perspective { view_angle: 40.0 },
    };
    let view = View::new(camera, [32, 32]).unwrap();
    let points = mesh.points().len() as u64;
    let bytes = |renderer: &mut Renderer| {
        draw(renderer, &view);
        renderer.stats().uploaded_bytes
    };
    let first = bytes(&mut renderer);
    assert!(first > 36 * 6 * 512);
    let still = bytes(&mut renderer);
    assert_eq!(still, size_of::<RayUniforms>() as u64, "a still frame needs its view only");
    renderer.set_transfer(&random_transfer(&mut random, false));
    let function = bytes(&mut renderer) - still;
    assert!(function > 0 && function < 200_000);
    renderer.set_field(&field("scalar")).unwrap();
    assert_eq!(bytes(&mut renderer) - still - function, 4 * points);
    renderer.set_field(&field("rgba")).unwrap();
    let rgba = bytes(&mut renderer) - still;
    assert!(rgba >= 16 * points && rgba < 16 * points + 200_000);
    let moved: Vec<DVec3> = mesh.points().iter().map(|p| *p * 0.5).collect();
    renderer.set_points(&moved).unwrap();
    let placed = bytes(&mut renderer) - still;
    assert!(placed > 24 * points && placed < 24 * points + 100_000, "{placed}");
}

#[test]
fn moved_points_are_drawn_where_they_are() {
    let Some(choice) = choice() else { return };
    let mesh = plain(generate::islands(8));
    let to = |p: DVec3| DVec3::new(2.0 * p.x + 5.0, p.y + 0.3 * p.x, p.z - 7.0);
    let moved = Mesh::new(
        mesh.points().iter().map(|&p| to(p)).collect(),
        mesh.cells().clone(),
        mesh.point_arrays().to_vec(),
        mesh.cell_arrays().to_vec(),
    );
    let mut random = Random(21);
    let transfer = random_transfer(&mut random, false);
    let camera = Camera {
        position: to(DVec3::new(3.0, 2.0, 1.0)),
        focal_point: to(DVec3::ZERO),
        view_up: DVec3::Z,
        projection: Projection::Perspective { view_angle: 50.0 },
    };
    let view = View::new(camera, [40, 40]).unwrap();
    let moved = moved.unwrap();
    let [got, want] = [(&mesh, choice), (&moved, DeviceChoice::Cpu)].map(|(mesh, choice)| {
        let mut renderer = Renderer::with_device(0, choice).unwrap();
        renderer.set_mesh(mesh).unwrap();
        renderer.set_field(&Field::new(mesh, "scalar", Some(Association::Point), Component::All).unwrap()).unwrap();
        renderer.set_transfer(&transfer);
        draw(&mut renderer, &view);
        renderer.set_points(moved.points()).unwrap();
        draw(&mut renderer, &view)
    });
    assert!(want.pixels.iter().any(|p| p[3] > 0.1));
    for (g, w) in got.pixels.iter().flatten().zip(want.pixels.iter().flatten()) {
        assert!((g - w).abs() <= 2e-5, "{g}, not {w}");
    }
}

#[test]
fn a_lost_device_is_survived() {
    let Some(choice) = choice() else { return };
    let mesh = plain(generate::tetrahedra(6));
    let mut random = Random(9);
    let mut renderer = Renderer::with_device(0, choice).unwrap();
    renderer.set_mesh(&mesh).unwrap();
    renderer.set_field(&Field::new(&mesh, "scalar", None, Component::All).unwrap()).unwrap();
    renderer.set_transfer(&random_transfer(&mut random, false));
    let view = random_view(&mut random, [24, 24]);
    let before = draw(&mut renderer, &view);
    for _ in 0..3 {
        renderer.backend().traverse().unwrap().gpu().device.destroy();
        assert_eq!(draw(&mut renderer, &view), before);
        assert_eq!(renderer.stats().device, "gpu");
    }
}

#[test]
fn the_budget_is_kept() {
    let Some(choice) = choice() else { return };
    let mesh = plain(generate::tetrahedra(9));
    let mut random = Random(2);
    let mut renderer = Renderer::with_device(0, choice).unwrap();
    renderer.set_mesh(&mesh).unwrap();
    renderer.set_field(&Field::new(&mesh, "scalar", None, Component::All).unwrap()).unwrap();
    renderer.set_transfer(&random_transfer(&mut random, false));
    let view = random_view(&mut random, [24, 24]);
    renderer.backend().traverse().unwrap().gpu.budget = 10_000;
    let refused = renderer.render(&view, &|_| ());
    assert!(matches!(refused, Err(Error::Memory { allowed: 10_000, .. })), "{refused:?}");
    renderer.backend().traverse().unwrap().gpu.budget = 1 << 30;
    draw(&mut renderer, &view);
}

#[test]
fn names_of_devices_are_parsed() {
    assert_eq!(DeviceChoice::parse("CPU"), DeviceChoice::Cpu);
    assert_eq!(DeviceChoice::parse("auto"), DeviceChoice::Auto);
    assert_eq!(DeviceChoice::parse(" llvmpipe "), DeviceChoice::Named("llvmpipe".into()));
    if choice().is_some() {
        let refused = Gpu::open(&DeviceChoice::Named("no such device".into()));
        assert!(matches!(refused, Err(Error::Device(what)) if what.contains("cpu")));
    }
}
