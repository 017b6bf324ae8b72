//! Values that are far from all others, as fill values are, and functions whose knots are far nearer to each other than
//! values are: what such do to a picture is what the reference says, and nothing else.

#![allow(clippy::expect_used, clippy::unwrap_used, clippy::panic, clippy::print_stderr, reason = "tests")]

mod common;

use common::draw::{self, LOOKS, Look, Random, SIZE, Shape};
use common::{ENGINES, Engine, Report, Scene, set};
use glam::{DMat3, DVec3, dvec3};
use halite::field::{Association, Component, Field};
use halite::host::Log;
use halite::image::Image;
use halite::integral::options::{Form, IntegrationOptions};
use halite::mesh::cells::Tetrahedra;
use halite::mesh::{Array, Mesh, Values, generate};
use halite::render::{self, Renderer};
use halite::scene;
use halite::transfer::{Convention, Emission, TransferFunction};
use halite::view::{Blend, Projection, View};
use std::path::Path;

const TWIN: Engine = Engine::Twin { threads: 2 };

const SWEEP: Engine = Engine::Sweep { threads: 2 };

/// Of any channel of any pixel.
const BOUND: f64 = 2e-5;

/// A field of a kind, without outliers, and a function for it.
fn clean(case: &str, look: &Look, association: Association, components: usize) -> Scene {
    let mesh = generate::mixed(3);
    let lot = draw::Lot { name: "s", association, components, missing: false };
    draw::scene(&mesh, &lot, look, &mut Random::of(case))
}

/// The same with outliers of this size, in some of the last components (`all`: in all of the others of some, too).
fn with_outliers(scene: &Scene, size: f64, all: bool) -> Scene {
    let Array { name, components, values } = scene.array().clone();
    let Values::F64(mut values) = values else { panic!("fields of tests are f64") };
    let mut random = Random::of(&format!("{size:e}"));
    let n = values.len() / components;
    for tuple in 0..n {
        if random.below(30) == 0 || tuple == n / 2 {
            let fill = if random.below(4) == 0 { -size } else { size };
            let from = if all { 0 } else { components - 1 };
            values[tuple * components + from..(tuple + 1) * components].fill(fill);
        }
    }
    let array = Array { name, components, values: Values::F64(values) };
    Scene::new(&scene.mesh, array, scene.field.association(), |_| scene.transfer.clone())
}

fn view(blend: Blend) -> View {
    let projection = Projection::Perspective { view_angle: 30.0 };
    draw::camera(dvec3(2.4137, 1.7291, 2.8873), dvec3(0.011, -0.017, 0.013), DVec3::Y, projection).with_blend(blend)
}

/// Looks whose pictures do not change with what values are rounded by, nor with how rays graze a cell.
fn looks() -> Vec<&'static Look> {
    let steep = |l: &&Look| l.peak >= 1e3 || l.convention == Convention::Opacity && l.peak >= 1.0;
    LOOKS.iter().filter(|l| !steep(l)).collect()
}

/// In points and cells, of one component, two and four; every magnitude, both signs.
#[test]
fn outliers_of_any_size_change_nothing_else() {
    let mut report = Report::default();
    let (looks, kinds) =
        (looks(), [(Association::Point, 1), (Association::Cell, 1), (Association::Point, 2), (Association::Cell, 4)]);
    for exponent in 2..=38 {
        for (k, (association, components)) in kinds.into_iter().enumerate() {
            let look = looks[(exponent + 3 * k) % looks.len()];
            let blend = if (exponent + k) % 5 == 0 { Blend::Maximum } else { Blend::Composite };
            let case = format!("1e{exponent}, {}, {association:?}, {components}, {blend:?}", look.name);
            let scene = with_outliers(
                &clean(&case, look, association, components),
                10f64.powi(exponent as i32),
                components == 2,
            );
            let expected = Engine::Reference.image(&scene, &view(blend));
            for engine in ENGINES {
                let got = engine.image(&scene, &view(blend));
                report.hold(&format!("{engine:?}, {case}"), &got, &expected, BOUND.max(look.bound(blend)));
            }
        }
    }
    report.finish("outliers");
}

/// The walk, and projected cells of one colour, which need no order.
#[test]
fn devices_draw_outliers_too() {
    let mut report = Report::default();
    for engine in [render::Engine::Traverse, render::Engine::Project] {
        let Some(mut renderer) = common::on_device(engine) else { return };
        let projects = engine == render::Engine::Project;
        let (looks, kinds) = (looks(), [(Association::Point, 1), (Association::Cell, 1), (Association::Point, 2)]);
        for (k, exponent) in [2, 3, 4, 6, 9, 20, 38].into_iter().enumerate() {
            let (look, (association, components)) = (looks[k % looks.len()], kinds[k % kinds.len()]);
            if projects && look.emission != Emission::Chromatic {
                continue;
            }
            let blend = if k == 3 && !projects { Blend::Maximum } else { Blend::Composite };
            let case = format!("{engine:?}, 1e{exponent}, {}, {association:?}, {components}, {blend:?}", look.name);
            let mut scene =
                with_outliers(&clean(&case, look, association, components), 10f64.powi(exponent), components == 2);
            if projects {
                let t = &scene.transfer;
                let color = vec![(0.0, [0.3, 0.6, 0.9])];
                let one = TransferFunction::new(color, t.opacity().to_vec(), t.unit_distance()).unwrap();
                scene.transfer = one.with_convention(t.convention());
            }
            let expected = Engine::Reference.image(&scene, &view(blend));
            set(&mut renderer, &scene);
            let got = renderer.render(&view(blend), &|_| ()).unwrap();
            report.hold(&case, &got, &expected, 5e-5);
        }
    }
    report.finish("outliers on devices");
}

/// Where values are beyond a table's, the function is constant and the integral exact: pictures are as near to the exact
/// ones as they are without outliers.
#[test]
fn tables_are_for_what_the_function_tells() {
    let look = LOOKS.iter().find(|l| matches!(l.shape, Shape::Knots(6))).expect("there is one");
    let look = Look { peak: 3.0, ..*look };
    let scene = clean("tables", &look, Association::Point, 1);
    let outliers = with_outliers(&scene, 1e20, false);
    let mut renderers = vec![("twin", Renderer::with_device(2, halite::gpu::DeviceChoice::Cpu).unwrap())];
    renderers.extend(common::on_device(render::Engine::Traverse).map(|r| ("device", r)));
    for (name, mut renderer) in renderers {
        for form in [Form::Volume, Form::Polynomial, Form::Cylindrical] {
            let errors = [&scene, &outliers].map(|scene| {
                let expected = Engine::Reference.image(scene, &view(Blend::Composite));
                renderer.set_integral(IntegrationOptions::of(form));
                set(&mut renderer, scene);
                renderer.render(&view(Blend::Composite), &|_| ()).unwrap().compare(&expected).unwrap().max
            });
            eprintln!("{name}, {form:?}: {errors:?}");
            assert!(errors[1] <= 2.0 * errors[0] + 1e-4, "{name}, {form:?}: {errors:?}");
        }
    }
}

/// What `transfer` makes of `values` at points or cells.
fn scene_of(mesh: &Mesh, values: Vec<f64>, association: Association, transfer: TransferFunction) -> Scene {
    let array = Array { name: "s".into(), components: 1, values: Values::F64(values) };
    Scene::new(mesh, array, association, |_| transfer)
}

/// A peak far narrower than the values' range over 2²⁴; cell values among steps where a knot is far away; a range next to
/// nothing; a step between two values.
#[test]
fn knots_may_be_anywhere() {
    let mesh = generate::tetrahedra(4);
    let wave = |p: &DVec3| (2.0 * p.x + p.y).sin() + 0.4 * p.z;
    let at_points: Vec<f64> = mesh.points().iter().map(wave).collect();
    let mut random = Random::of("cells");
    let mut jump = || random.within(0.0, 1.0) * if random.below(20) == 0 { 1e6 } else { 1.0 };
    let at_cells: Vec<f64> = (0..mesh.cells().len()).map(|_| jump()).collect();
    let color = |s: f64, w: f64| vec![(s - w, [1.0, 0.2, 0.1]), (s, [0.9; 3]), (s + w, [0.0, 0.3, 1.0])];
    let of = |color, opacity, unit| TransferFunction::new(color, opacity, unit).unwrap();
    let spike = |s: f64, w: f64, a: f64| vec![(-2.0, 0.0), (s - w, 0.0), (s, a), (s + w, 0.0), (2.0, 0.0)];
    let steps = vec![(0.0, 0.0), (0.2, 0.0), (0.2, 1.0), (0.5, 1.0), (0.5, 0.1), (1.0, 0.3), (1.0, 0.0), (1e6, 4.0)];
    let bands = vec![(0.0, [1.0, 0.0, 0.0]), (0.3, [1.0, 0.0, 0.0]), (0.3, [0.0, 1.0, 0.0]), (1e6, [1.0, 1.0, 0.0])];
    // Powers of two, so that these are exact: the same picture as in units of them, where the reference has all digits.
    let tiny = 2f64.powi(-40);
    let rounded: Vec<f64> = at_points.iter().map(|v| (v * 64.0).round() / 64.0).collect();
    let near_one = rounded.iter().map(|v| 1.0 + v * tiny).collect();
    let bumps = [(-1.0, 0.0), (0.25, 1.0), (0.5, 0.0), (1.0, 0.6)];
    let plain = scene_of(&mesh, rounded, Association::Point, of(color(0.0, 1.0), bumps.to_vec(), 0.4));
    let near = bumps.map(|(s, a)| (1.0 + s * tiny, a)).to_vec();
    let two = (0..mesh.cells().len()).map(|i| if i % 9 == 0 { 1e20 } else { 0.3 }).collect();
    let (point, cell) = (Association::Point, Association::Cell);
    let scenes = [
        ("a narrow peak", scene_of(&mesh, at_points.clone(), point, of(color(0.1, 1.0), spike(0.1, 1e-7, 1e5), 0.2))),
        ("a narrower peak", scene_of(&mesh, at_points, point, of(color(-0.7, 0.1), spike(-0.7, 1e-10, 1e8), 0.2))),
        ("steps and jumps", scene_of(&mesh, at_cells, cell, of(bands, steps, 0.1))),
        ("a tiny range", scene_of(&mesh, near_one, point, of(color(1.0, tiny), near, 0.4))),
        ("one step", scene_of(&mesh, two, cell, of(vec![(0.0, [0.5; 3])], vec![(0.5, 0.0), (0.5, 1.0)], 0.4))),
    ];
    let mut device = common::on_device(render::Engine::Traverse);
    let mut report = Report::default();
    for (case, scene) in scenes {
        let view = view(Blend::Composite);
        let compared = if case == "a tiny range" { &plain } else { &scene };
        let expected = Engine::Reference.image(compared, &view);
        assert!(expected.pixels.iter().any(|p| p[3] > 0.01), "{case}: there is something to see");
        for engine in ENGINES {
            report.hold(&format!("{engine:?}, {case}"), &engine.image(&scene, &view), &expected, BOUND);
        }
        if let Some(renderer) = &mut device {
            set(renderer, &scene);
            report.hold(&format!("device, {case}"), &renderer.render(&view, &|_| ()).unwrap(), &expected, BOUND);
        }
    }
    report.finish("knots");
}

/// Knots that move over the same values cost their own upload; those that ask for it bring the values again.
#[test]
fn an_edit_hands_values_over_only_if_it_must() {
    let Some(mut renderer) = common::on_device(render::Engine::Traverse) else { return };
    let mesh = generate::hexahedra(20);
    let mut values: Vec<f64> = mesh.points().iter().map(|p| (3.0 * p.x).sin() + p.y).collect();
    values[77] = 1e30;
    let bytes = 4 * values.len() as u64;
    let transfer = |at: f64, width: f64| {
        let opacity = vec![(at - width, 0.0), (at, 1.0), (at + width, 0.2)];
        TransferFunction::new(vec![(at, [1.0, 0.5, 0.2])], opacity, 0.3).unwrap()
    };
    let mut scene = scene_of(&mesh, values, Association::Point, transfer(0.1, 0.8));
    set(&mut renderer, &scene);
    let view = view(Blend::Composite);
    renderer.render(&view, &|_| ()).unwrap();
    let mut report = Report::default();
    for (at, width, must) in
        [(0.15, 0.8, false), (-0.4, 0.9, false), (0.3, 0.1, false), (0.3, 1e-7, true), (0.31, 0.5, true)]
    {
        scene.transfer = transfer(at, width);
        renderer.set_transfer(&scene.transfer);
        let got = renderer.render(&view, &|_| ()).unwrap();
        let uploaded = renderer.stats().uploaded_bytes;
        assert_eq!(uploaded >= bytes, must, "{at} ± {width}: {uploaded} bytes");
        report.hold(&format!("{at} ± {width}"), &got, &TWIN.image(&scene, &view), BOUND);
    }
    report.finish("edits");
}

/// Two narrow peaks far apart are more than one map can tell.
#[test]
fn knots_that_are_too_close_are_named() {
    let log = Log::default();
    let mesh = generate::tetrahedra(2);
    let values = mesh.points().iter().map(|p| p.x * 1.5).collect();
    let peak = |s: f64| [(s - 1e-9, 0.0), (s, 1e6), (s + 1e-9, 0.0)];
    let opacity = [peak(-0.75), peak(0.625)].concat();
    let scene = scene_of(
        &mesh,
        values,
        Association::Point,
        TransferFunction::new(vec![(0.0, [1.0; 3])], opacity, 0.3).unwrap(),
    );
    log.collect(|| TWIN.image(&scene, &view(Blend::Composite)));
    let log = log.take().join("\n");
    let named = |a: f64, b: f64| log.contains(&format!("{a} and {b}"));
    assert!(log.contains("WARN") && (named(-0.750000001, -0.75) || named(0.624999999, 0.625)), "{log}");
}

/// What is not transparent is opaque, however the extinction comes to be beyond all numbers.
#[test]
fn a_tiny_unit_distance_is_opaque() {
    let mesh = generate::tetrahedra(3);
    let values: Vec<f64> = mesh.points().iter().map(|p| p.x).collect();
    let mut device = common::on_device(render::Engine::Traverse);
    let mut projected = common::on_device(render::Engine::Project);
    for convention in [Convention::Opacity, Convention::Extinction] {
        for emission in [Emission::Chromatic, Emission::Direct { scale: 1e-3 }] {
            for unit in [1e-320, 1e-300, 1e-100, 1e-30] {
                let opacity = vec![(-0.5, 0.0), (0.0, 0.0), (0.3, 0.6), (1.0, 0.2)];
                let transfer = TransferFunction::new(vec![(0.0, [0.8, 0.4, 0.2])], opacity, unit).unwrap();
                let transfer = transfer.with_convention(convention).with_emission(emission).unwrap();
                let scene = scene_of(&mesh, values.clone(), Association::Point, transfer);
                let view = draw::camera(
                    dvec3(0.2, 0.1, 4.0),
                    DVec3::ZERO,
                    DVec3::Y,
                    Projection::Parallel { parallel_scale: 1.3 },
                );
                let mut images = vec![
                    ("reference", Engine::Reference.image(&scene, &view)),
                    ("twin", TWIN.image(&scene, &view)),
                    ("sweep", SWEEP.image(&scene, &view)),
                ];
                for (name, renderer) in [("device", &mut device), ("projected", &mut projected)] {
                    if let Some(renderer) = renderer {
                        set(renderer, &scene);
                        images.push((name, renderer.render(&view, &|_| ()).unwrap()));
                    }
                }
                for (name, image) in &images {
                    let case = format!("{name}, {convention:?}, {emission:?}, {unit:e}");
                    assert!(image.pixels.as_flattened().iter().all(|v| v.is_finite()), "{case}");
                    for (i, p) in image.pixels.iter().enumerate() {
                        // The view is nearly along z: x is where a ray is, but for 0.15.
                        let x =
                            ((i as u32 % SIZE[0]) as f64 + 0.5 - f64::from(SIZE[0]) / 2.0) / f64::from(SIZE[1]) * 2.6;
                        let y =
                            (f64::from(SIZE[1]) / 2.0 - (i as u32 / SIZE[0]) as f64 - 0.5) / f64::from(SIZE[1]) * 2.6;
                        let inside = x.abs().max(y.abs()) < 0.8;
                        assert!(!(inside && x > 0.2) || (p[3] - 1.0).abs() < 1e-6, "{case}: {x} {y} {p:?}");
                        assert!(!(inside && x < -0.2) || p[3] == 0.0, "{case}: {x} {y} {p:?}");
                    }
                }
            }
        }
    }
}

/// Sheets and needles that f32 tells no lengths across, in any direction, on every engine.
#[test]
fn very_flat_meshes_are_drawn() {
    let turn = DMat3::from_axis_angle(dvec3(0.3, -0.5, 0.8).normalize(), 0.7);
    let mut report = Report::default();
    let mut devices = [render::Engine::Traverse, render::Engine::Project].map(common::on_device);
    for (k, size) in [dvec3(1.0, 1.0, 1e-6), dvec3(1.0, 1e-7, 1e-7), dvec3(0.5, 1e-8, 1.0)].into_iter().enumerate() {
        let mesh = draw::moved(&generate::tetrahedra(3), |p| turn * (p * size));
        let values: Vec<f64> = generate::tetrahedra(3).points().iter().map(|p| p.x + 0.3 * p.z).collect();
        let opacity = vec![(-0.8, 0.1), (0.0, 1.0), (0.3, 0.2), (1.0, 0.7)];
        let color = vec![(-1.0, [0.1, 0.3, 0.9]), (1.0, [0.9, 0.5, 0.1])];
        let transfer = TransferFunction::new(color, opacity, size.min_element()).unwrap();
        let scene = scene_of(&mesh, values, Association::Point, transfer);
        // A needle is seen from its end.
        let along = Projection::Parallel { parallel_scale: 1.3e-7 };
        let view = match k {
            1 => draw::camera(turn * dvec3(3.0, 0.0, 0.0), DVec3::ZERO, turn * dvec3(0.0, 0.8, 0.6), along),
            _ => view(Blend::Composite),
        };
        let expected = Engine::Reference.image(&scene, &view);
        assert!(expected.pixels.iter().filter(|p| p[3] > 0.1).count() > 5, "{k}: there is something to see");
        // The reference moves rays that lie in a face aside by 1e-11, which is much of a needle's width.
        let bound = if k == 1 { 2e-3 } else { BOUND };
        report.hold(&format!("twin, {k}"), &TWIN.image(&scene, &view), &expected, bound);
        report.hold(&format!("sweep, {k}"), &SWEEP.image(&scene, &view), &expected, bound);
        for renderer in devices.iter_mut().flatten() {
            set(renderer, &scene);
            let got = renderer.render(&view, &|_| ()).unwrap();
            report.hold(&format!("{}, {k}", renderer.stats().engine), &got, &expected, bound);
        }
    }
    // A mesh that becomes flat, and is no longer.
    let thick = generate::tetrahedra(3);
    let values: Vec<f64> = thick.points().iter().map(|p| p.x).collect();
    let transfer = TransferFunction::new(vec![(0.0, [0.5; 3])], vec![(-1.0, 0.2), (1.0, 1.0)], 0.5).unwrap();
    let scene = scene_of(&thick, values, Association::Point, transfer);
    for renderer in devices.iter_mut().flatten() {
        set(renderer, &scene);
        for z in [1.0, 1e-9, 0.7] {
            let mesh = draw::moved(&scene.mesh, |p| p * dvec3(1.0, 1.0, z));
            renderer.set_points(mesh.points()).unwrap();
            let moved = Scene { tetrahedra: Tetrahedra::new(&mesh).unwrap(), mesh, ..scene.clone() };
            let expected = TWIN.image(&moved, &view(Blend::Composite));
            let got = renderer.render(&view(Blend::Composite), &|_| ()).unwrap();
            report.hold(&format!("moved to {z}"), &got, &expected, 5e-5);
        }
    }
    report.finish("flat meshes");
}

/// A layer of flat cells in a thick mesh: under a function that shows little else, and under one that lengths are good for.
#[test]
fn flat_cells_in_a_thick_mesh_are_drawn() {
    let turn = DMat3::from_axis_angle(dvec3(0.3, -0.5, 0.8).normalize(), 0.7);
    let mut report = Report::default();
    let mut devices = [render::Engine::Traverse, render::Engine::Project].map(common::on_device);
    let lattice = generate::tetrahedra(3);
    for height in [1e-3, 1e-5, 1e-6, 1e-7] {
        // Of four layers of points the inner two come together.
        let squeezed = |z: f64| if z.abs() > 0.5 { z } else { height * f64::from(z > 0.0) };
        let mesh = draw::moved(&lattice, |p| turn * dvec3(p.x, p.y, squeezed(p.z)));
        let values: Vec<f64> = lattice.points().iter().map(|p| f64::from(p.z > 0.0)).collect();
        for (name, unit) in [("dense", 0.4 * height), ("mild", 0.5)] {
            let opacity = vec![(0.0, 0.0), (0.2, 1.0), (0.8, 0.5), (1.0, 0.0)];
            let transfer = TransferFunction::new(vec![(0.0, [0.3, 0.6, 0.9])], opacity, unit).unwrap();
            let scene = scene_of(&mesh, values.clone(), Association::Point, transfer);
            let view = view(Blend::Composite);
            let expected = Engine::Reference.image(&scene, &view);
            let seen = expected.pixels.iter().filter(|p| p[0] > 0.1).count();
            assert!(name == "mild" || seen > 100, "{name}, {height:e}: {seen} pixels");
            for engine in [TWIN, SWEEP] {
                report.hold(&format!("{engine:?}, {name}, {height:e}"), &engine.image(&scene, &view), &expected, 1e-4);
            }
            for renderer in devices.iter_mut().flatten() {
                set(renderer, &scene);
                let got = renderer.render(&view, &|_| ()).unwrap();
                let engine = renderer.stats().engine.clone();
                report.hold(&format!("device, {engine}, {name}, {height:e}"), &got, &expected, 2e-4);
                assert!(name != "mild" || renderer.stats().device == "gpu", "{engine} draws what it can");
            }
        }
    }
    report.finish("flat cells");
}

/// Extinction that falls from next to infinite to nothing between two knots is rounded to less than nothing, by much.
#[test]
fn extinction_that_falls_to_nothing_gives_numbers() {
    let mesh = generate::tetrahedra(4);
    let values: Vec<f64> = mesh.points().iter().map(|p| (3.0 * p.x + p.y).sin() + 0.2 * p.z * p.y).collect();
    let mut devices = [render::Engine::Traverse, render::Engine::Project].map(common::on_device);
    for k in 0..8 {
        let end = 0.07 * f64::from(k) - 0.3;
        let opacity = vec![(-1.3, 0.3), (end - 0.4, 0.02), (end, 0.0), (end + 0.3, 0.06), (1.2, 0.5)];
        for (unit, convention) in
            [(1e-320, Convention::Opacity), (1e-20, Convention::Opacity), (1e-20, Convention::Extinction)]
        {
            let color = vec![(-1.0, [0.8, 0.4, 0.2]), (end, [0.1, 0.9, 0.3]), (1.0, [0.2, 0.3, 0.9])];
            let transfer = TransferFunction::new(color, opacity.clone(), unit).unwrap().with_convention(convention);
            let scene = scene_of(&mesh, values.clone(), Association::Point, transfer);
            let view = view(Blend::Composite);
            let mut images = vec![("twin", TWIN.image(&scene, &view)), ("sweep", SWEEP.image(&scene, &view))];
            for renderer in devices.iter_mut().flatten() {
                set(renderer, &scene);
                images.push(("device", renderer.render(&view, &|_| ()).unwrap()));
            }
            for (name, image) in images {
                let seen = image.pixels.iter().filter(|p| p[3] > 0.0).count();
                let right = |p: &[f32; 4]| {
                    p.iter().all(|v| (0.0..=1.0 + 1e-5).contains(v)) && (p[3] == 0.0 || p[3] > 1.0 - 1e-5)
                };
                let wrong = image.pixels.iter().find(|p| !right(p));
                assert!(seen > 100 && wrong.is_none(), "{name}, {end}, {unit:e}, {convention:?}: {wrong:?}");
            }
        }
    }
}

/// Cases of the same kinds that users met, as far as they are at hand.
#[test]
fn what_users_met_is_right() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/cases/truth");
    let names = [
        "m01_fill_c1e+20",
        "m01_fill_c1e+06",
        "m01_fill_c-9999",
        "n05_celljump",
        "m03_pspike",
        "m06_spike",
        "m02_flat1e-7",
    ];
    let mut report = Report::default();
    let mut device = common::on_device(render::Engine::Traverse);
    for name in names {
        let file = folder.join(format!("{name}.json"));
        if !file.exists() {
            eprintln!("skipped: there is no {}", file.display());
            return;
        }
        let scene = scene::Scene::open(&file).unwrap();
        let mesh = halite::io::open(&scene.mesh, &|_| ()).unwrap();
        let (field, (view, _)) = (scene.scalars.field(&mesh).unwrap(), scene.view().unwrap());
        let scene = Scene { tetrahedra: Tetrahedra::new(&mesh).unwrap(), mesh, field, transfer: scene.transfer };
        let truth = Image::open(&file.with_extension("npy")).unwrap();
        for engine in ENGINES {
            report.hold(&format!("{engine:?}, {name}"), &engine.image(&scene, &view), &truth, 1e-4);
        }
        if let Some(renderer) = &mut device {
            set(renderer, &scene);
            report.hold(&format!("device, {name}"), &renderer.render(&view, &|_| ()).unwrap(), &truth, 1e-4);
        }
    }
    report.finish("cases");
}

/// Values are as the array has them, whatever their type, and outliers do not stretch them.
#[test]
fn a_field_keeps_its_values() {
    let mesh = generate::tetrahedra(3);
    let n = mesh.points().len();
    let mut values: Vec<f64> = (0..n).map(|i| 1.0 + i as f64 * 1e-13).collect();
    values[0] = -1e300;
    let field = Field::from_slice("s", &values, 1, Association::Point, Component::Index(0)).unwrap();
    assert_eq!((field.len(), &*field.values()), (n, &values[..]));
    assert_eq!(field.range(0), [-1e300, values[n - 1]]);
    let whole: Vec<i32> = (0..n as i32).map(|i| i32::MAX - i).collect();
    let field = Field::from_slice("i", &whole, 1, Association::Point, Component::Index(0)).unwrap();
    assert_eq!(field.value(1), f64::from(i32::MAX - 1));
}
