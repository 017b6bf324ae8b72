//! The engines against the reference: every generated mesh with every kind of transfer function, field and view.
//!
//! Each test draws one mesh with every look in turn; views and fields pass by at other strides, so that all
//! combinations come up in the end (HALITE_LONG=1). A wrong neighbour, order, entry, clip, unit or knot shows here.

#![allow(clippy::expect_used, clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use common::draw::{self, FIELDS, LOOKS, MESHES, Random, SIZE, VIEWS};
use common::{ENGINES, Engine, Report, rounds};
use halite::transfer::TransferFunction;

/// Draws the mesh of this name with every look.
fn check(name: &str) {
    let m = MESHES.iter().position(|m| m.0 == name).expect("it is in the table");
    let mut report = Report::default();
    for round in 0..rounds(2) {
        for (l, look) in LOOKS.iter().enumerate() {
            let lot = &FIELDS[(m + l + 3 * round) % FIELDS.len()];
            let (view_name, view) = VIEWS[(5 * m + l + 7 * round) % VIEWS.len()];
            let case = format!("{name}, {}, {}, {view_name}, {round}", look.name, lot.name);
            let mut random = Random::of(&case);
            let scene = draw::scene(&MESHES[m].1(), lot, look, &mut random);
            let view = view(&mut random);
            let expected = Engine::Reference.image(&scene, &view);
            for engine in ENGINES {
                report.hold(
                    &format!("{engine:?}, {case}"),
                    &engine.image(&scene, &view),
                    &expected,
                    look.bound(view.blend()),
                );
            }
        }
    }
    report.finish(name);
}

macro_rules! meshes {
    ($($test:ident: $name:literal,)*) => {
        $(#[test] fn $test() { check($name); })*

        #[test]
        fn every_mesh_is_judged() {
            assert_eq!(MESHES.iter().map(|m| m.0).collect::<Vec<_>>(), [$($name),*]);
        }
    };
}

meshes! {
    tetrahedra: "tetrahedra",
    hexahedra: "hexahedra",
    wedges: "wedges",
    pyramids: "pyramids",
    mixed: "mixed",
    islands: "islands",
    unwelded: "unwelded",
    t_junction: "t-junction",
    ring: "ring",
    demo: "demo",
}

/// A test of images of nothing would pass: most scenes show something.
#[test]
fn the_scenes_are_worth_drawing() {
    let mut seen = 0;
    for (name, view) in VIEWS {
        let mut random = Random::of(name);
        let scene = draw::scene(&MESHES[0].1(), &FIELDS[0], &LOOKS[0], &mut random);
        let image = Engine::Reference.image(&scene, &view(&mut random));
        let covered = image.pixels.iter().filter(|p| p[3] > 0.01).count();
        assert!(covered > image.pixels.len() / 20, "{name}: {covered} pixels");
        seen += covered;
    }
    assert!(seen > VIEWS.len() * (SIZE[0] * SIZE[1]) as usize / 3, "{seen} pixels");
}

/// Colour maps of 256 entries, of which a cell has many: smooth, of any colours, and of bands. Lines along which extinction is one line
/// are integrated at once where little is absorbed.
#[test]
fn colour_maps_of_many_entries_are_drawn() {
    let mut report = Report::default();
    for (kind, steps) in [("smooth", false), ("any", false), ("bands", true)] {
        for (m, peak) in [(0, 0.3), (1, 3.0), (4, 0.3), (0, 30.0)] {
            let case = format!("{}, {kind}, {peak}", MESHES[m].0);
            let mut random = Random::of(&case);
            let mut scene = draw::scene(&MESHES[m].1(), &FIELDS[0], &LOOKS[0], &mut random);
            let [low, high] = scene.field.range(0);
            let mut color = vec![];
            for i in 0..256 {
                let u = f64::from(i) / 255.0;
                let entry = if kind == "any" {
                    [(); 3].map(|()| random.within(0.0, 1.0))
                } else {
                    [0.0, 2.0, 4.0].map(|k| 0.5 + 0.5 * (7.0 * u + k).sin())
                };
                color.push((low + (high - low) * u, entry));
                if steps {
                    color.push((low + (high - low) * (u + 1.0 / 255.0), entry));
                }
            }
            scene.transfer = TransferFunction::new(color, vec![(low, 0.0), (high, peak)], 0.7).unwrap();
            let view = VIEWS[m % 2].1(&mut random);
            let expected = Engine::Reference.image(&scene, &view);
            for engine in ENGINES {
                report.hold(&format!("{engine:?}, {case}"), &engine.image(&scene, &view), &expected, 1e-5);
            }
        }
    }
    report.finish("colour maps");
}
