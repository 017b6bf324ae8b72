//! Cropping regions, in every engine and on grids: what some regions show and what all others do is all.

#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "a test tells what it saw")]

use glam::{DMat4, DVec3};
use halite::field::{Component, Field};
use halite::gpu::DeviceChoice;
use halite::grid::{Grid, Lattice};
use halite::image::Image;
use halite::mesh::{Array, Values, generate};
use halite::render::{Engine, Renderer};
use halite::transfer::TransferFunction;
use halite::view::{Blend, Camera, ClippingPlane, Cropping, Projection, REGIONS, View};

const ALL: u32 = (1 << 27) - 1;

fn transfer(field: &Field) -> TransferFunction {
    let [lo, hi] = field.range(0);
    let at = |x: f64| lo + (hi - lo) * x;
    let color = vec![(at(0.0), [0.9, 0.2, 0.1]), (at(0.5), [0.2, 0.8, 0.3]), (at(1.0), [0.1, 0.3, 1.0])];
    TransferFunction::new(color, vec![(at(0.0), 0.2), (at(0.4), 0.9), (at(0.6), 0.1), (at(1.0), 0.8)], 0.8).unwrap()
}

/// Renderers of a mesh in each engine, and of a grid, by name, with the middle of what they draw and its half width.
fn renderers() -> Vec<(String, Renderer, DVec3, f64)> {
    let mesh = generate::demo(5);
    let field =
        Field::from_array(&mesh.point_arrays()[0], halite::field::Association::Point, Component::Index(0)).unwrap();
    let (low, high) =
        mesh.points().iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
    let mut all = vec![];
    for (engine, device) in [
        (Engine::Traverse, DeviceChoice::Cpu),
        (Engine::Project, DeviceChoice::Cpu),
        (Engine::Traverse, DeviceChoice::Auto),
    ] {
        let mut renderer = Renderer::with_engine(2, device.clone(), engine).unwrap();
        if device == DeviceChoice::Auto && renderer.stats().device == "cpu" {
            eprintln!("skipped in part: there is no device");
            continue;
        }
        renderer.set_mesh(&mesh).unwrap();
        renderer.set_field(&field).unwrap();
        renderer.set_transfer(&transfer(&field));
        let name = format!("{engine:?} on {}", renderer.stats().device);
        all.push((name, renderer, low.midpoint(high), (high - low).max_element() / 2.0));
    }
    let values = (0..6 * 7 * 8).map(|i| f64::from(i % 6) - 0.3 * f64::from(i / 6 % 7) + f64::from(i * i % 5)).collect();
    let array = Array { name: "s".into(), components: 1, values: Values::F64(values) };
    let grid = Grid::regular(&Lattice { size: [6, 7, 8], ..Lattice::default() }, vec![array], vec![]).unwrap();
    let field = Field::new(&grid, "s", None, Component::Index(0)).unwrap();
    let name = std::env::var("HALITE_TEST_DEVICE").unwrap_or_else(|_| "0".into());
    for device in [DeviceChoice::Cpu, DeviceChoice::Named(name)] {
        let mut renderer = match Renderer::with_device(2, device.clone()) {
            Ok(renderer) => renderer,
            Err(e) => {
                let required = std::env::var("HALITE_REQUIRE_GPU").is_ok_and(|v| v == "1");
                assert!(device != DeviceChoice::Cpu && !required, "{e}");
                eprintln!("skipped in part: there is no device: {e}");
                continue;
            }
        };
        renderer.set_grid(&grid).unwrap();
        renderer.set_field(&field).unwrap();
        renderer.set_transfer(&transfer(&field));
        let name = format!("the caster on {}", renderer.stats().device);
        all.push((name, renderer, DVec3::new(2.5, 3.0, 3.5), 3.5));
    }
    all
}

fn view(middle: DVec3, half: f64, parallel: bool, inside: bool) -> View {
    let away = DVec3::new(1.3, -2.1, 1.6) * half * if inside { 0.1 } else { 1.5 };
    let projection = match parallel {
        true => Projection::Parallel { parallel_scale: 1.3 * half },
        false => Projection::Perspective { view_angle: 40.0 },
    };
    let camera = Camera { position: middle + away, focal_point: middle, view_up: DVec3::Z, projection };
    View::new(camera, [36, 30]).unwrap()
}

fn planes(middle: DVec3, half: f64) -> [[f64; 2]; 3] {
    [0, 1, 2].map(|a| [middle[a] - half * (0.3 + 0.05 * a as f64), middle[a] + half * (0.25 - 0.06 * a as f64)])
}

fn draw(renderer: &mut Renderer, view: &View) -> Image {
    renderer.render(view, &|_| ()).unwrap()
}

#[test]
fn regions_and_the_others_are_all() {
    for (name, mut renderer, middle, half) in renderers() {
        for (kind, regions) in REGIONS.into_iter().chain([("some", 0x1b6_ca53)]) {
            for (parallel, inside) in [(false, false), (true, false), (false, true)] {
                let whole = view(middle, half, parallel, inside);
                let cropped = |regions| {
                    let cropping = Cropping::new(planes(middle, half), regions, DMat4::IDENTITY).unwrap();
                    whole.clone().with_cropping(cropping)
                };
                let all = draw(&mut renderer, &whole);
                let [some, others] = [regions, ALL & !regions].map(|r| draw(&mut renderer, &cropped(r)));
                let mut seen = 0;
                for ((a, b), c) in some.pixels.iter().zip(&others.pixels).zip(&all.pixels) {
                    let off = ((1.0 - a[3]) * (1.0 - b[3]) - (1.0 - c[3])).abs();
                    assert!(off < 2e-5, "{name}, {kind}: {off:.1e}");
                    seen += usize::from(a[3] > 0.01 && b[3] > 0.01);
                }
                assert!(seen > 20, "{name}, {kind}: {seen} pixels show both");
                // The largest value is in either.
                let maximum = |view: &View| view.clone().with_blend(Blend::Maximum);
                let all = draw(&mut renderer, &maximum(&whole));
                let [some, others] = [regions, ALL & !regions].map(|r| draw(&mut renderer, &maximum(&cropped(r))));
                for ((a, b), c) in some.pixels.iter().zip(&others.pixels).zip(&all.pixels) {
                    let near = |p: &[f32; 4]| p.iter().zip(c).all(|(p, c)| (p - c).abs() < 1e-4);
                    assert!(near(a) || near(b), "{name}, {kind}: {a:?} and {b:?}, not {c:?}");
                }
            }
        }
    }
}

/// One region is what six planes keep; colours from front to back are those of one picture, whatever is between.
#[test]
fn one_region_is_six_planes() {
    for (name, mut renderer, middle, half) in renderers() {
        let whole = view(middle, half, false, false);
        let planes = planes(middle, half);
        let cropping = Cropping::new(planes, REGIONS[0].1, DMat4::IDENTITY).unwrap();
        let cropped = draw(&mut renderer, &whole.clone().with_cropping(cropping));
        let clipping = (0..6).map(|k| {
            let (a, side) = (k / 2, k % 2);
            let sign = if side == 0 { 1.0 } else { -1.0 };
            ClippingPlane { origin: DVec3::AXES[a] * planes[a][side], normal: DVec3::AXES[a] * sign }
        });
        let clipped = draw(&mut renderer, &whole.clone().with_clipping_planes(clipping.collect()).unwrap());
        assert_eq!(cropped.pixels, clipped.pixels, "{name}");
        // Two halves of everything, cut between regions that are all drawn but one that is empty anyway.
        let far = [[middle.x, middle.x + 100.0 * half], [-1e9, 1e9], [-1e9, 1e9]];
        let cut = Cropping::new(far, ALL & !(1 << 26), DMat4::IDENTITY).unwrap();
        let error =
            draw(&mut renderer, &whole.clone().with_cropping(cut)).compare(&draw(&mut renderer, &whole)).unwrap();
        assert!(error.max < 2e-5, "{name}: {:.1e}", error.max);
        let none = Cropping::new(planes, 0, DMat4::IDENTITY).unwrap();
        assert!(draw(&mut renderer, &whole.with_cropping(none)).pixels.iter().all(|p| *p == [0.0; 4]), "{name}");
    }
}
