//! Pictures of the device against those of the walk on the CPU.

use super::draw;
use super::random::{Random, meshes, plain, random_transfer, random_view};
use crate::error::Error;
use crate::field::{Association, Component, Field};
use crate::gpu::testing::{bindings, choice};
use crate::gpu::{DeviceChoice, Part};
use crate::mesh::{Mesh, generate};
use crate::render::{Engine, Renderer};
use crate::view::{Blend, Camera, Projection, View};
use glam::DVec3;

/// Draws `frames` frames of each of `rounds` times eight meshes on the device and on the CPU, and compares them. Where
/// a ray grazes the surface that a step of the function makes, the last digit of a value decides: one pixel in 100,000
/// may differ by more.
fn compare(rounds: usize, frames: usize, size: [u32; 2], seed: u64) {
    let Some(choice) = choice() else { return };
    let mut random = Random(seed);
    let (mut beyond, mut pixels) = (0, 0);
    let all: Vec<_> = (0..rounds).flat_map(|_| meshes(&mut random)).collect();
    for (name, mesh) in all {
        let mut pair =
            [choice.clone(), DeviceChoice::Cpu].map(|c| Renderer::with_engine(0, c, Engine::Traverse).unwrap());
        for r in &mut pair {
            r.set_mesh(&mesh).unwrap();
        }
        for frame in 0..frames {
            let array = ["scalar", "pair", "rgba"][random.below(3)];
            let association = [Association::Point, Association::Cell][random.below(2)];
            let field = Field::new(&mesh, array, Some(association), Component::All).unwrap();
            let transfer = random_transfer(&mut random, frame % 5 == 4);
            let blend = if random.below(5) == 0 { Blend::Maximum } else { Blend::Composite };
            let view = random_view(&mut random, size).with_blend(blend);
            let [got, want] = pair.each_mut().map(|r| {
                r.set_field(&field).unwrap();
                r.set_transfer(&transfer);
                draw(r, &view)
            });
            assert_eq!(pair[0].stats().device, "gpu");
            let mut apart = 0.0;
            // Where two places have the largest opacity but for rounding, either's colour is right.
            let compared = if blend == Blend::Maximum && array != "scalar" { 3..4 } else { 0..4 };
            for (g, w) in got.pixels.iter().zip(&want.pixels) {
                let d = compared.clone().fold(0.0, |m, k| f32::max(m, (g[k] - w[k]).abs() / w[k].max(1.0)));
                assert!(g.iter().all(|v| v.is_finite()), "{name} {frame}: {g:?}, not {w:?}");
                (beyond, pixels) = (beyond + usize::from(d > 2e-5), pixels + 1);
                apart = f32::max(apart, d);
            }
            let what =
                format!("{apart:.2e}: {name}, frame {frame}: {array} {association:?} {blend:?} {:?}", view.camera());
            if apart > 2e-5 {
                eprintln!("{what} {transfer:?}");
            }
            assert!(apart <= 2e-4, "{what}");
        }
    }
    eprintln!("{beyond} of {pixels} pixels are more than 2e-5 apart");
    assert!(100_000 * beyond <= pixels);
}

#[test]
fn the_twins_agree() {
    compare(1, 4, [40, 36], 11);
}

/// Planes of the lattice seen edge-on, their lines along rays: what decides there is nothing but rounding, of numbers
/// that f32 has not.
#[test]
fn the_twins_agree_where_rays_lie_in_faces() {
    let Some(choice) = choice() else { return };
    let projections = |distance: f64| {
        let perspective = Projection::Perspective { view_angle: if distance < 2.0 { 80.0 } else { 30.0 } };
        [perspective, Projection::Parallel { parallel_scale: 1.25 }]
    };
    let eyes = [
        ([8.124, 0.0, 0.0], [0.0; 3], DVec3::Z),
        ([0.0, 0.0, -6.0], [0.0; 3], DVec3::Y),
        ([6.0, 6.0, 6.0], [0.0; 3], DVec3::Y),
        ([0.0, 5.0, 5.0], [0.0; 3], DVec3::X),
        ([1.0 / 3.0, 1.0 / 3.0, 7.0], [1.0 / 3.0, 1.0 / 3.0, 0.0], DVec3::Y),
        // In faces and on corners.
        ([0.0, 0.0, 1.0], [0.0; 3], DVec3::Y),
        ([1.0 / 3.0, 0.0, -1.0 / 3.0], [0.0; 3], DVec3::Y),
    ];
    let transfer = random_transfer(&mut Random(6), false);
    let meshes = [
        ("tetrahedra", generate::tetrahedra(7)),
        ("hexahedra", generate::hexahedra(7)),
        ("wedges", generate::wedges(7)),
    ];
    for (name, mesh) in meshes {
        let points = mesh.points().iter().map(|p| (p * 3.0).round() / 3.0).collect();
        let mesh = plain(Mesh::new(points, mesh.cells().clone(), vec![], vec![]).unwrap());
        let mut pair =
            [choice.clone(), DeviceChoice::Cpu].map(|c| Renderer::with_engine(0, c, Engine::Traverse).unwrap());
        for r in &mut pair {
            r.set_mesh(&mesh).unwrap();
            r.set_field(&Field::new(&mesh, "scalar", Some(Association::Point), Component::All).unwrap()).unwrap();
            r.set_transfer(&transfer);
        }
        for (eye, focal_point, view_up) in eyes {
            let (position, focal_point) = (DVec3::from(eye), DVec3::from(focal_point));
            for projection in projections(position.distance(focal_point)) {
                for size in [[33, 33], [32, 32]] {
                    let camera = Camera { position, focal_point, view_up, projection };
                    let view = View::new(camera, size).unwrap();
                    let [got, want] = pair.each_mut().map(|r| draw(r, &view));
                    let pixels = got.pixels.iter().flatten().zip(want.pixels.iter().flatten());
                    let apart = pixels.fold(0.0, |m: f32, (g, w)| m.max((g - w).abs()));
                    assert!(apart <= 2e-5, "{apart:e}: {name}, {size:?}, {camera:?}");
                }
            }
        }
    }
}

#[test]
fn the_twins_agree_a_thousand_times() {
    if is_long() {
        compare(25, 5, [40, 40], 17);
    }
}

/// Whether tests that take minutes were asked for.
fn is_long() -> bool {
    let asked = std::env::var_os("HALITE_LONG").is_some();
    if !asked {
        eprintln!("skipped: it takes minutes, HALITE_LONG=1 runs it");
    }
    asked
}

#[test]
fn ten_million_tetrahedra_are_drawn() {
    if !is_long() {
        return;
    }
    let Some(choice) = choice() else { return };
    let mesh = generate::tetrahedra(119);
    let mut renderer = Renderer::with_device(0, choice).unwrap();
    renderer.set_mesh(&mesh).unwrap();
    renderer.set_field(&Field::new(&mesh, "s", None, Component::All).unwrap()).unwrap();
    let mut random = Random(4);
    renderer.set_transfer(&random_transfer(&mut random, false));
    let camera = Camera {
        position: DVec3::new(3.0, 2.5, 2.0),
        focal_point: DVec3::ZERO,
        view_up: DVec3::Z,
        projection: Projection::Perspective { view_angle: 40.0 },
    };
    let view = View::new(camera, [256, 256]).unwrap();
    let got = draw(&mut renderer, &view);
    eprintln!("{:#?}", renderer.stats());
    draw(&mut renderer, &view);
    eprintln!("again {} ms", renderer.stats().frame_ms);
    renderer.backend().traverse().unwrap();
    renderer.draw_on_cpu(&Error::Render("to compare".into()));
    let want = draw(&mut renderer, &view);
    eprintln!("cpu {} ms", renderer.stats().frame_ms);
    let apart =
        got.pixels.iter().flatten().zip(want.pixels.iter().flatten()).fold(0.0, |m: f32, (g, w)| m.max((g - w).abs()));
    assert!(apart <= 2e-5, "{apart:e}");
}

/// Arrays that no single binding holds are read as one, by both engines and in the order of the mesh, whatever the field.
#[test]
fn arrays_of_several_bindings_are_one() {
    let Some(choice) = choice() else { return };
    let mesh = plain(generate::islands(11));
    let mut random = Random(23);
    let transfer = random_transfer(&mut random, false);
    let view = random_view(&mut random, [40, 32]);
    for engine in [Engine::Traverse, Engine::Project] {
        let mut renderer = Renderer::with_engine(0, choice.clone(), engine).unwrap();
        renderer.set_mesh(&mesh).unwrap();
        renderer.set_transfer(&transfer);
        for (array, association) in
            [("scalar", Association::Cell), ("pair", Association::Cell), ("rgba", Association::Point)]
        {
            renderer.set_field(&Field::new(&mesh, array, Some(association), Component::All).unwrap()).unwrap();
            let [one, several] = [u64::MAX, 16 << 10].map(|bytes| {
                if let Some(traverse) = renderer.backend().traverse() {
                    traverse.gpu_mut().binding = bytes.min(128 << 20);
                    traverse.invalidate(Part::Mesh);
                }
                if let Some(project) = renderer.backend().project() {
                    project.gpu_mut().binding = bytes.min(128 << 20);
                    project.invalidate(Part::Mesh);
                }
                let image = draw(&mut renderer, &view);
                let mut all = vec![];
                all.extend(renderer.backend().traverse().map(|t| bindings(t.chunks())));
                all.extend(renderer.backend().project().map(|p| bindings(p.chunks())));
                (image, all.concat())
            });
            assert!(one.1.iter().all(|&n| n == 1) && one.0.pixels.iter().any(|p| p[3] > 0.1), "{:?}", one.1);
            // Cells and points; scalars of cells have room in one.
            let spread = several.1.iter().filter(|&&n| n > 1).count();
            assert!(spread > usize::from(array != "scalar") + 1, "{engine:?}, {array}: {:?}", several.1);
            assert!(several.0 == one.0, "{engine:?}, {array}: {:e}", several.0.compare(&one.0).unwrap().max);
        }
    }
}
