//! Changes of a scene that must not change its image.

#![allow(clippy::expect_used, clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use common::draw::{Random, camera, mesh_of, moved, scenes};
use common::{ENGINES, Engine, Report, Scene, rounds};
use glam::{DQuat, DVec3, dvec3};
use halite::field::Association;
use halite::mesh::{Array, Values};
use halite::transfer::{Emission, TransferFunction};
use halite::view::{Blend, ClippingPlane, Projection, View};

/// Two images of one scene, told in two ways.
const BOUND: f64 = 1e-5;

/// Draws `scene` and `same` with every engine and holds their images to `bound` of one another.
fn hold(report: &mut Report, case: &str, [scene, same]: [(&Scene, &[View]); 2], bound: f64) {
    for engine in ENGINES {
        let (expected, got) = (engine.draw(scene.0, scene.1), engine.draw(same.0, same.1));
        // Planes of cells are f32 there, and each of two pictures may be off.
        let bound = if matches!(engine, Engine::Sweep { .. }) { 2.0 * bound } else { bound };
        for (v, (a, b)) in got.iter().zip(&expected).enumerate() {
            report.hold(&format!("{engine:?}, {case}, view {v}"), a, b, bound);
        }
    }
}

/// Sums that depend on which thread draws what, and searches that depend on what they found before.
#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let mut report = Report::default();
    for (case, scene, views) in (0..rounds(2)).flat_map(scenes) {
        for engine in [|threads| Engine::Twin { threads }, |threads| Engine::Sweep { threads }] {
            let expected = engine(1).draw(&scene, &views);
            for threads in [2, 3] {
                let got = engine(threads).draw(&scene, &views);
                let case = format!("{:?}, {case}", engine(threads));
                got.iter().zip(&expected).for_each(|(a, b)| report.hold(&case, a, b, 0.0));
            }
        }
    }
    report.finish("threads");
}

/// Entries, neighbours or splits that depend on which cell comes first.
#[test]
fn any_order_of_the_cells_gives_the_same_bits() {
    let mut report = Report::default();
    for (case, scene, views) in (0..rounds(2)).flat_map(scenes) {
        let mut order: Vec<usize> = (0..scene.mesh.cells().len()).collect();
        Random::of(&case).shuffle(&mut order);
        let shuffled = reordered(&scene, &order);
        hold(&mut report, &format!("shuffled, {case}"), [(&scene, &views), (&shuffled, &views)], 0.0);
    }
    report.finish("order of cells");
}

/// The same scene with its cells in another order.
fn reordered(scene: &Scene, order: &[usize]) -> Scene {
    let Scene { mesh, field, transfer, .. } = scene;
    let cells = order.iter().map(|&c| (mesh.cells().types[c], mesh.cells().points(c)));
    let mut array = scene.array().clone();
    if field.association() == Association::Cell {
        let n = array.components;
        let value = |c: &usize| (c * n..c * n + n).map(|i| scene.array().values.get(i));
        array.values = Values::F64(order.iter().flat_map(value).collect());
    }
    Scene::new(&mesh_of(mesh.points().to_vec(), cells), array, field.association(), |_| transfer.clone())
}

/// Values that are not linear in a cell, or a length that depends on how many cells it is cut into.
#[test]
fn splitting_every_tetrahedron_changes_nothing() {
    let mut report = Report::default();
    for (case, scene, views) in (0..rounds(2)).flat_map(scenes) {
        let split = split(&scene);
        hold(&mut report, &format!("split, {case}"), [(&scene, &views), (&split, &views)], BOUND);
    }
    report.finish("split");
}

/// The same scene with each tetrahedron cut into the four around its barycentre, which has the mean of their values.
fn split(scene: &Scene) -> Scene {
    let Scene { mesh, tetrahedra, field, transfer } = scene;
    let array = scene.array();
    let n = array.components;
    let tuple = |t: usize| (t * n..t * n + n).map(|i| array.values.get(i));
    let at_points = field.association() == Association::Point;
    let mut points = mesh.points().to_vec();
    let mut values: Vec<f64> = if at_points { (0..points.len()).flat_map(tuple).collect() } else { vec![] };
    let mut parts = Vec::new();
    for (t, corners) in tetrahedra.corners.iter().enumerate() {
        let middle = points.len() as u32;
        points.push(corners.iter().map(|&p| points[p as usize]).sum::<DVec3>() / 4.0);
        parts.extend((0..4).map(|k| {
            let mut part = *corners;
            part[k] = middle;
            part
        }));
        if at_points {
            let mean = |k: usize| corners.iter().map(|&p| array.values.get(p as usize * n + k)).sum::<f64>() / 4.0;
            values.extend((0..n).map(mean));
        } else {
            let cell = tetrahedra.cell.as_ref().map_or(t, |c| c[t] as usize);
            values.extend((0..4).flat_map(|_| tuple(cell)));
        }
    }
    let array = Array { values: Values::F64(values), ..array.clone() };
    let mesh = mesh_of(points, parts.iter().map(|p| (10, &p[..])));
    Scene::new(&mesh, array, field.association(), |_| transfer.clone())
}

/// Where a scene is, how large and how turned.
#[derive(Debug, Clone, Copy)]
struct Motion {
    turn: DQuat,
    scale: f64,
    shift: DVec3,
}

const STILL: Motion = Motion { turn: DQuat::IDENTITY, scale: 1.0, shift: DVec3::ZERO };

impl Motion {
    fn point(&self, p: DVec3) -> DVec3 {
        self.turn * p * self.scale + self.shift
    }

    /// The scene with all its lengths.
    fn scene(&self, scene: &Scene) -> Scene {
        let old = &scene.transfer;
        let emission = match old.emission() {
            Emission::Direct { scale } => Emission::Direct { scale: scale / self.scale },
            chromatic => chromatic,
        };
        let transfer =
            TransferFunction::new(old.color().to_vec(), old.opacity().to_vec(), old.unit_distance() * self.scale)
                .and_then(|t| t.with_convention(old.convention()).with_clamp(old.clamp()).with_emission(emission))
                .expect("as good as the old one");
        let mesh = moved(&scene.mesh, |p| self.point(p));
        Scene { mesh, transfer, ..scene.clone() }
    }

    /// Perspective and parallel, from outside and inside, with clipping planes and ranges: the same for each case.
    fn views(&self, case: &str) -> Vec<View> {
        let mut r = Random::of(case);
        [(4.0, false), (4.0, true), (0.4, false), (0.4, true)]
            .map(|(distance, parallel)| {
                let projection = if parallel {
                    Projection::Parallel { parallel_scale: 1.1 * self.scale }
                } else {
                    Projection::Perspective { view_angle: if distance > 1.0 { 32.0 } else { 100.0 } }
                };
                let (at, to, up) = (r.direction() * distance, r.point(0.2), r.direction());
                let plane =
                    ClippingPlane { origin: self.point(r.direction() * 0.7), normal: self.turn * -r.direction() };
                camera(self.point(at), self.point(to), self.turn * up, projection)
                    .with_clipping_planes(vec![plane])
                    .and_then(|v| v.with_clipping_range([0.02 * self.scale, (distance + 0.5) * self.scale]))
                    .expect("a view")
            })
            .to_vec()
    }
}

/// Lengths in the wrong unit, coordinates that lose their digits or overflow, and axes taken for granted.
#[test]
fn moving_scene_and_camera_together_changes_nothing() {
    let turn = DQuat::from_axis_angle(dvec3(1.0, -2.0, 0.5).normalize(), 1.234);
    let motions = [
        ("turned", Motion { turn, ..STILL }),
        ("shifted", Motion { shift: dvec3(1e6, -1e6, 3e6), ..STILL }),
        ("tiny", Motion { scale: 1e-20, ..STILL }),
        ("huge", Motion { scale: 1e20, ..STILL }),
        ("all at once", Motion { turn, scale: 3e7, shift: dvec3(-2e10, 1e10, 1e10) }),
    ];
    let mut report = Report::default();
    for (case, scene, _) in (0..rounds(1)).flat_map(scenes) {
        for (name, motion) in &motions[..] {
            let views = [STILL.views(&case), motion.views(&case)];
            let same = motion.scene(&scene);
            hold(&mut report, &format!("{name}, {case}"), [(&scene, &views[0]), (&same, &views[1])], BOUND);
        }
    }
    report.finish("motions");
}

/// A field in other units with its function in the same units; falling scalars find steps from their other side.
#[test]
fn other_units_of_the_field_change_nothing() {
    let units = [("huge", 1e27, 0.0), ("tiny", 1e-30, 0.0), ("offset", 1.0, 1e7), ("falling", -2.5, 300.0)];
    let mut report = Report::default();
    for (case, scene, mut views) in (0..rounds(1)).flat_map(scenes) {
        // The largest of falling values is another.
        views.retain(|v| v.blend() == Blend::Composite);
        for (name, factor, offset) in units {
            let same = in_units(&scene, |s| factor * s + offset, factor < 0.0);
            hold(&mut report, &format!("{name}, {case}"), [(&scene, &views), (&same, &views)], BOUND);
        }
    }
    report.finish("units");
}

/// The scene with `unit` of every value that a function is asked at.
fn in_units(scene: &Scene, unit: impl Fn(f64) -> f64, falling: bool) -> Scene {
    let (array, old, n) = (scene.array(), &scene.transfer, scene.array().components);
    // The colours of RGBA are no arguments, and have no other unit.
    let changes = |k: usize| n != 4 || k == 3;
    let value = |i: usize| if changes(i % n) { unit(array.values.get(i)) } else { array.values.get(i) };
    let values = Values::F64((0..array.values.len()).map(value).collect());
    let mut color: Vec<_> = old.color().iter().map(|&(s, c)| (unit(s), c)).collect();
    let mut opacity: Vec<_> = old.opacity().iter().map(|&(s, a)| (unit(s), a)).collect();
    if falling {
        color.reverse();
        opacity.reverse();
    }
    let transfer = TransferFunction::new(color, opacity, old.unit_distance())
        .and_then(|t| t.with_convention(old.convention()).with_clamp(old.clamp()).with_emission(old.emission()))
        .expect("as good as the old one");
    let array = Array { values, ..array.clone() };
    Scene::new(&scene.mesh, array, scene.field.association(), |_| transfer)
}

/// Colours in bytes are 255ths, whichever engine draws them and however they are blended.
#[test]
fn colors_in_bytes_are_shares_of_255() {
    let mesh = halite::mesh::generate::tetrahedra(3);
    let mut random = Random::of("bytes");
    let bytes: Vec<u8> = (0..4 * mesh.points().len()).map(|_| random.below(256) as u8).collect();
    let share = |(i, b): (usize, &u8)| if i % 4 == 3 { f64::from(*b) } else { f64::from(*b) / 255.0 };
    let shares = Values::F64(bytes.iter().enumerate().map(share).collect());
    let opacity = vec![(0.0, 0.0), (60.0, 0.1), (180.0, 0.9), (255.0, 0.4)];
    let scene = |values| {
        let array = Array { name: "rgba".into(), components: 4, values };
        let transfer = TransferFunction::new(vec![(0.0, [1.0; 3])], opacity.clone(), 0.6).unwrap();
        Scene::new(&mesh, array, Association::Point, |_| transfer.clone())
    };
    let [as_bytes, as_shares] = [scene(Values::U8(bytes)), scene(shares)];
    let view = camera(dvec3(1.0, 2.0, 3.0), DVec3::ZERO, DVec3::Y, Projection::Perspective { view_angle: 40.0 });
    let views = [view.clone(), view.with_blend(Blend::Maximum)];
    for engine in ENGINES {
        let drawn = engine.draw(&as_shares, &views);
        let dim = |p: &[f32; 4]| p[3] > 0.3 && p[..3].iter().all(|c| *c < 0.8 * p[3]);
        assert!(drawn.iter().all(|image| image.pixels.iter().any(dim)), "{engine:?}: some colours are not full");
    }
    let mut report = Report::default();
    hold(&mut report, "bytes", [(&as_shares, &views), (&as_bytes, &views)], BOUND);
    report.finish("bytes");
}
