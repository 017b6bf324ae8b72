//! The projection engine against the reference, and each of its published faults against its cure.

#![allow(clippy::expect_used, clippy::unwrap_used, clippy::panic, clippy::print_stderr, reason = "tests")]

mod common;

use common::draw::{self, FIELDS, LOOKS, MESHES, Random, VIEWS};
use common::{Engine, Report, Scene, rounds, set};
use glam::{DVec3, dvec3};
use halite::field::Association;
use halite::image::Image;
use halite::integral::options::{Form, IntegrationOptions, Texels};
use halite::integral::table::Kind;
use halite::mesh::{Array, Mesh, Values, generate};
use halite::project::{CellOrder, Compositing, Cycles, Fragments, ProjectionOptions, Target, Thickness};
use halite::render::{self, Renderer};
use halite::transfer::{Convention, Emission, TransferFunction};
use halite::view::{Blend, Camera, Projection, View};

fn renderer() -> Option<Renderer> {
    common::on_device(render::Engine::Project)
}

fn image(renderer: &mut Renderer, options: ProjectionOptions, view: &View) -> Image {
    renderer.set_projection(options);
    renderer.render(view, &|_| ()).unwrap()
}

fn rmse(a: &Image, b: &Image) -> f64 {
    a.compare(b).unwrap().rmse
}

const INTERPOLATED: Fragments = Fragments::Interpolated;

/// In all colours, so that what is drawn in the wrong sequence shows; and the largest values, which need none.
#[test]
fn every_mesh_is_drawn_as_it_is() {
    let Some(mut renderer) = renderer() else { return };
    let (mut report, mut largest) = (Report::default(), Report::default());
    // An opaque step is drawn in full where a value of 32 bits touches it: on a wall's outline single pixels are off.
    let looks: Vec<_> = LOOKS.iter().filter(|l| !l.name.contains("wall")).collect();
    let lots = FIELDS;
    let mut walked = 0;
    for round in 0..rounds(1) {
        for (m, (name, mesh)) in MESHES.iter().enumerate() {
            for v in [0, 1] {
                let (look, lot) = (looks[(m + 3 * v + round) % looks.len()], &lots[(2 * m + v + round) % lots.len()]);
                let (view_name, view) = VIEWS[(5 * m + 8 * v + 3 * round) % VIEWS.len()];
                let case = format!("{name}, {}, {}, {view_name}, {round}", look.name, lot.name);
                let mut random = Random::of(&case);
                let scene = draw::scene(&mesh(), lot, look, &mut random);
                let view = view(&mut random);
                set(&mut renderer, &scene);
                for (blend, report) in [(Blend::Composite, &mut report), (Blend::Maximum, &mut largest)] {
                    let view = view.clone().with_blend(blend);
                    let expected = Engine::Reference.image(&scene, &view);
                    let got = image(&mut renderer, ProjectionOptions::default(), &view);
                    report.hold(&case, &got, &expected, 5e-5);
                    walked += renderer.stats().projection.map_or(0, |p| p.walked_pixels);
                }
            }
        }
    }
    report.finish(&format!("composites, {walked} pixels of them walked,"));
    largest.finish("the largest values");
}

/// The cell that is drawn, and so many others that no ray meets.
fn one_cell(others: usize) -> Mesh {
    let cell = [dvec3(-1.0, -0.8, -0.9), dvec3(0.9, -1.0, -0.2), dvec3(-0.1, 1.0, -0.6), dvec3(0.2, 0.1, 1.0)];
    let at = |i: usize| cell[0] - dvec3(0.01, 1e-4 * i as f64, 0.0);
    let other = |i: usize| [at(i), at(i) + DVec3::X * 1e-5, at(i) + DVec3::Y * 1e-5, at(i) + DVec3::Z * 1e-5];
    let points: Vec<DVec3> = cell.into_iter().chain((0..others).flat_map(other)).collect();
    let cells: Vec<[u32; 4]> = (0..=others as u32).map(|i| [0, 1, 2, 3].map(|k| 4 * i + k)).collect();
    draw::mesh_of(points, cells.iter().map(|c| (10, &c[..])))
}

/// One cell has no order. Up to three lines of the function come with it; where most cells have no more, those of more are
/// drawn in parts, else lines are looked up. Deep cells take steps.
#[test]
fn one_cell_is_exact() {
    let Some(mut renderer) = renderer() else { return };
    let mut report = Report::default();
    for (lines, others) in (1..=7).flat_map(|lines| [(lines, 0), (lines, 31)]) {
        let mesh = one_cell(others);
        for depth in [0.1, 2.0, 20.0, 400.0] {
            for emission in [Emission::Chromatic, Emission::Direct { scale: 1.0 }] {
                let case = format!("{lines} lines, {others} others, depth {depth}, {emission:?}");
                let mut random = Random::of(&case);
                let mut values: Vec<f64> = (0..4).map(|_| random.within(-0.2, 0.2)).chain([0.0, 1.0]).skip(2).collect();
                values.resize(4 + 4 * others, 0.5);
                // The last knot is above all values, or below some.
                let span = if (lines + others) % 2 == 0 { 1.6 } else { 1.0 };
                let mut places: Vec<f64> = (0..=lines).map(|i| -0.3 + span * i as f64 / lines as f64).collect();
                // A step, and values where lines meet.
                places.insert(lines / 2, places[lines / 2]);
                values[..2].copy_from_slice(&[places[lines / 2], places[lines + 1]]);
                let opacity = places.iter().map(|&s| (s, random.within(0.0, depth))).collect();
                let color = places.iter().map(|&s| (s, [0; 3].map(|_| random.within(0.0, 1.0)))).collect();
                let transfer = TransferFunction::new(color, opacity, 1.0).unwrap().with_emission(emission).unwrap();
                let array = Array { name: "s".into(), components: 1, values: Values::F64(values) };
                let scene = Scene::new(&mesh, array, Association::Point, |_| transfer);
                set(&mut renderer, &scene);
                let near = [dvec3(0.4, 0.3, 4.0), dvec3(-3.0, 1.0, -2.5), dvec3(0.05, 0.0, -0.2)];
                let mut views: Vec<View> = near.into_iter().map(|p| perspective(p, 60.0)).collect();
                let parallel = Projection::Parallel { parallel_scale: 1.2 };
                views
                    .push(View::new(Camera { projection: parallel, ..*views[1].camera().unwrap() }, [72, 64]).unwrap());
                for (i, view) in views.iter().enumerate() {
                    let expected = Engine::Reference.image(&scene, view);
                    let got = image(&mut renderer, ProjectionOptions::default(), view);
                    // What f32 tells of lengths.
                    report.hold(&format!("{case}, view {i}"), &got, &expected, 2e-6 + 4e-7 * depth);
                }
            }
        }
    }
    report.finish("one cell");
}

/// The edges of an opaque stretch let light through where the field passes them, but not as constants: as on the CPU.
#[test]
fn constants_are_opaque_as_single_values() {
    let Some(mut renderer) = renderer() else { return };
    let mut report = Report::default();
    let mesh = one_cell(2);
    for (value, is_opaque) in [(0.5, false), (1.0, true), (1.5, true), (2.0, true), (2.5, false)] {
        let array = Array { name: "s".into(), components: 1, values: Values::F64(vec![value, 0.0, 3.0]) };
        let opacity = vec![(0.0, 0.1), (1.0, 0.1), (1.0, 1.0), (2.0, 1.0), (2.0, 0.05), (3.0, 0.05)];
        let color = vec![(0.0, [1.0, 0.0, 0.0]), (3.0, [0.0, 1.0, 0.5])];
        let transfer = TransferFunction::new(color, opacity, 1.0).unwrap().with_convention(Convention::Opacity);
        let scene = Scene::new(&mesh, array, Association::Cell, |_| transfer);
        set(&mut renderer, &scene);
        let view = perspective(dvec3(0.4, 0.3, 4.0), 60.0);
        let expected = Engine::Twin { threads: 2 }.image(&scene, &view);
        let got = image(&mut renderer, ProjectionOptions::default(), &view);
        assert_eq!(got.pixels.iter().any(|p| p[3] > 0.999), is_opaque, "{value}");
        report.hold(&format!("constant {value}"), &got, &expected, 2e-6);
    }
    report.finish("constants");
}

/// A peak of opacity in a field, seen at 60 degrees from near.
fn peak() -> (Scene, View) {
    let mesh = generate::tetrahedra(9);
    let scene = Scene::new(&mesh, mesh.point_arrays()[0].clone(), Association::Point, |field| {
        let [lo, hi] = field.range(0);
        let at = |x: f64| lo + (hi - lo) * x;
        let opacity = vec![(at(0.0), 0.0), (at(0.57), 0.0), (at(0.6), 12.0), (at(0.63), 0.0), (at(1.0), 0.0)];
        TransferFunction::new(vec![(0.0, [0.9, 0.7, 0.4])], opacity, 0.2).unwrap()
    });
    (scene, perspective(dvec3(0.7, 1.3, 1.9), 75.0))
}

fn perspective(position: DVec3, view_angle: f64) -> View {
    let projection = Projection::Perspective { view_angle };
    View::new(Camera { position, focal_point: DVec3::ZERO, view_up: DVec3::Y, projection }, [72, 64]).unwrap()
}

/// A lattice of small cells in the middle of a big tetrahedron's neighbourhood: its edges are 400 times longer.
fn huge_neighbour() -> (Scene, View) {
    let small = generate::tetrahedra(7);
    let (mut points, cells) = (small.points().to_vec(), small.cells());
    let first = points.len() as u32;
    // Behind the lattice, and beside the view.
    points.extend([
        dvec3(-60.0, -60.0, -9.0),
        dvec3(60.0, -60.0, -9.0),
        dvec3(0.0, 60.0, -9.0),
        dvec3(0.0, 0.0, -90.0),
    ]);
    let own = [first, first + 1, first + 2, first + 3];
    let all = (0..cells.len()).map(|c| (cells.types[c], cells.points(c))).chain([(10, &own[..])]);
    let mesh = draw::mesh_of(points, all);
    let values = mesh.points().iter().map(|p| if p.z > -2.0 { 1.0 + 0.3 * p.x } else { 0.0 }).collect();
    let array = Array { name: "s".into(), components: 1, values: Values::F64(values) };
    let scene = Scene::new(&mesh, array, Association::Point, |_| {
        let opacity = vec![(0.0, 0.0), (0.5, 0.0), (0.7, 0.5), (1.3, 0.8)];
        TransferFunction::new(vec![(0.0, [0.2, 0.5, 0.9]), (1.3, [0.9, 0.5, 0.2])], opacity, 1.0).unwrap()
    });
    (scene, perspective(dvec3(0.3, 0.5, 6.0), 25.0))
}

/// Many cells of little opacity each.
fn thin() -> (Scene, View) {
    let mesh = generate::tetrahedra(15);
    let scene = Scene::new(&mesh, mesh.point_arrays()[0].clone(), Association::Point, |field| {
        let [lo, hi] = field.range(0);
        TransferFunction::new(vec![(0.0, [0.8, 0.5, 0.3])], vec![(lo, 0.1), (hi, 0.3)], 1.0).unwrap()
    });
    (scene, perspective(dvec3(1.0, 2.0, 5.0), 25.0))
}

/// The same, so faint that most of a cell is less than what 8 bits can tell; white, so that colours are rounded as
/// opacities are.
fn faint() -> (Scene, View) {
    let (mut scene, view) = thin();
    let [lo, hi] = scene.field.range(0);
    scene.transfer = TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(lo, 0.01), (hi, 0.04)], 1.0).unwrap();
    (scene, view)
}

/// Two parts with a gap, a tunnel, a cavity and bays, in colours that tell which hides which.
fn holes() -> (Scene, View) {
    let mesh = generate::islands(10);
    let scene = Scene::new(&mesh, mesh.point_arrays()[0].clone(), Association::Point, |field| {
        let [lo, hi] = field.range(0);
        let color = vec![(lo, [1.0, 0.1, 0.0]), ((lo + hi) / 2.0, [0.1, 0.9, 0.1]), (hi, [0.0, 0.1, 1.0])];
        TransferFunction::new(color, vec![(lo, 2.0), (hi, 4.0)], 1.0).unwrap()
    });
    (scene, perspective(dvec3(2.5, 1.5, 4.0), 35.0))
}

/// The error of `fault` and of `cure` in a scene, against the reference.
fn errors<const N: usize>((scene, view): &(Scene, View), variants: [ProjectionOptions; N]) -> Option<[f64; N]> {
    let mut renderer = renderer()?;
    set(&mut renderer, scene);
    let expected = Engine::Reference.image(scene, view);
    Some(variants.map(|s| rmse(&image(&mut renderer, s, view), &expected)))
}

#[test]
fn perspective_interpolation_cures_linear() {
    let form = |fragments| ProjectionOptions::default().with_fragments(fragments);
    let by_depth = form(INTERPOLATED).with_thickness(Thickness::Depth);
    let variants = [form(Fragments::Linear), by_depth, form(INTERPOLATED), form(Fragments::Intersected)];
    let Some([linear, by_depth, interpolated, intersected]) = errors(&peak(), variants) else { return };
    eprintln!(
        "linear {linear:.1e}, by depth {by_depth:.1e}, interpolated {interpolated:.1e}, intersected {intersected:.1e}"
    );
    assert!(linear > 20.0 * interpolated && by_depth > 5.0 * interpolated);
    assert!(interpolated < 5e-4 && intersected < 1e-5);
}

/// The errors of tables of three parameters in a scene, against the reference.
fn table_errors<const N: usize>((scene, view): &(Scene, View), volumes: [IntegrationOptions; N]) -> Option<[f64; N]> {
    let mut renderer = renderer()?;
    set(&mut renderer, scene);
    let expected = Engine::Reference.image(scene, view);
    Some(volumes.map(|choice| {
        renderer.set_integral(choice);
        rmse(&image(&mut renderer, ProjectionOptions::default(), view), &expected)
    }))
}

fn volume(lengths: Kind, texels: Texels, table: [u32; 3]) -> IntegrationOptions {
    IntegrationOptions::of(Form::Volume).with_lengths(lengths).with_texels(texels).with_table(Some(table))
}

#[test]
fn more_bits_cure_the_table() {
    let of = |lengths| move |texels| volume(lengths, texels, [256, 256, 16]);
    let normalised = [Texels::Unorm8, Texels::Unorm16, Texels::Float].map(of(Kind::LogNormalised));
    let Some([eight, sixteen, float]) = table_errors(&thin(), normalised) else { return };
    let published = [Texels::Unorm8, Texels::Unorm16].map(of(Kind::Log));
    let Some([published_eight, published_sixteen]) = table_errors(&thin(), published) else { return };
    eprintln!(
        "8 bits {eight:.1e}, 16 {sixteen:.1e}, float {float:.1e}; as published {published_eight:.1e}, {published_sixteen:.1e}"
    );
    assert!(eight > 10.0 * sixteen && float < 2.0 * sixteen && sixteen < 2e-4);
    // The bias of the published table is greater than what 8 bits add to it.
    assert!(published_eight > published_sixteen);
}

#[test]
fn logarithmic_lengths_cure_uniform_ones() {
    let volumes = [Kind::Uniform, Kind::Log, Kind::LogNormalised].map(|k| volume(k, Texels::Float, [64, 64, 16]));
    let Some([uniform, log, normalised]) = table_errors(&huge_neighbour(), volumes) else { return };
    eprintln!("uniform {uniform:.1e}, log {log:.1e}, normalised {normalised:.1e}");
    assert!(uniform > 2.0 * log && log > 5.0 * normalised && normalised < 1e-3);
}

#[test]
fn floats_and_dithering_cure_8_bits() {
    let Some(mut renderer) = renderer() else { return };
    let (scene, view) = faint();
    set(&mut renderer, &scene);
    let expected = Engine::Reference.image(&scene, &view);
    let eight = ProjectionOptions::default().with_target(Target::Rgba8);
    let variants =
        [eight, eight.with_dither(true), eight.with_target(Target::Rgba16float), ProjectionOptions::default()];
    let [plain, dithered, half, float] =
        variants.map(|s| rmse(&blurred(&image(&mut renderer, s, &view)), &blurred(&expected)));
    eprintln!("8 bits {plain:.1e}, dithered {dithered:.1e}, 16-bit floats {half:.1e}, floats {float:.1e}");
    assert!(plain > 3.0 * dithered && plain > 10.0 * half && half > 5.0 * float && float < 1e-5);
    // Cells that only add up dither their colours.
    let additive = |s: ProjectionOptions| s.with_compositing(Compositing::Additive);
    let [sum, plain, dithered] = [ProjectionOptions::default(), eight, eight.with_dither(true)]
        .map(|s| blurred(&colours(image(&mut renderer, additive(s), &view))));
    let [plain, dithered] = [plain, dithered].map(|i| rmse(&i, &sum));
    eprintln!("additive: 8 bits {plain:.1e}, dithered {dithered:.1e}");
    assert!(plain > 3.0 * dithered);
}

/// Without opacities, which no dithering helps where cells add up; within what 8 bits can hold.
fn colours(mut image: Image) -> Image {
    image.pixels.iter_mut().for_each(|p| *p = [p[0].min(1.0), p[1].min(1.0), p[2].min(1.0), 0.0]);
    image
}

/// Means of 8 × 8 pixels.
fn blurred(image: &Image) -> Image {
    let [w, h] = image.size;
    let mut small = Image::new([w / 8, h / 8]);
    for (i, pixel) in small.pixels.iter_mut().enumerate() {
        let (x, y) = (i as u32 % (w / 8), i as u32 / (w / 8));
        for (dx, dy) in (0..64).map(|k| (k % 8, k / 8)) {
            let at = image.pixels[((8 * y + dy) * w + 8 * x + dx) as usize];
            (0..4).for_each(|k| pixel[k] += at[k] / 64.0);
        }
    }
    small
}

#[test]
fn orders_cure_one_another() {
    let order = |order| ProjectionOptions::default().with_order(order);
    let variants = [
        CellOrder::None,
        CellOrder::MpvoConvex,
        CellOrder::Mpvonc,
        CellOrder::Depth,
        CellOrder::Xmpvo,
        CellOrder::Mpvo,
    ]
    .map(order);
    let Some([none, convex, nonconvex, depth, xmpvo, mpvo]) = errors(&holes(), variants) else { return };
    eprintln!(
        "no order {none:.1e}, MPVO {convex:.1e}, MPVONC {nonconvex:.1e}, depth {depth:.1e}, XMPVO {xmpvo:.1e}, ours {mpvo:.1e}"
    );
    assert!(none > 10.0 * depth && depth.min(convex).min(nonconvex) > 100.0 * mpvo.max(xmpvo));
    assert!(mpvo < 1e-6 && xmpvo < 1e-6);
}

/// Of cells that hide each other in a circle some are in the wrong sequence; the walk draws the pixels that see these.
#[test]
fn circles_are_left_to_the_walk() {
    let mesh = generate::ring(6);
    let scene = Scene::new(&mesh, mesh.point_arrays()[0].clone(), Association::Point, |field| {
        let [lo, hi] = field.range(0);
        TransferFunction::new(vec![(lo, [1.0, 0.1, 0.0]), (hi, [0.0, 0.1, 1.0])], vec![(lo, 9.0)], 1.0).unwrap()
    });
    let Some(mut renderer) = renderer() else { return };
    set(&mut renderer, &scene);
    let view = perspective(dvec3(0.01, 0.02, 4.0), 35.0);
    let expected = Engine::Reference.image(&scene, &view);
    let [cut, walked] = [Cycles::Cut, Cycles::Walk].map(|cycles| {
        let max = image(&mut renderer, ProjectionOptions::default().with_cycles(cycles), &view)
            .compare(&expected)
            .unwrap()
            .max;
        (max, renderer.stats().projection.unwrap())
    });
    assert_eq!((cut.1.cycles, cut.1.walked_pixels, walked.1.cycles), (1, 0, 1));
    assert!(walked.1.walked_pixels > 0 && walked.1.cuts > 0, "{:?}", walked.1);
    assert!(cut.0 > 1e-2 && walked.0 < 2e-5, "{} {}", cut.0, walked.0);
}

/// What is new with each frame is not worth the search for neighbours.
#[test]
fn a_mesh_that_changes_with_each_frame_is_drawn_by_depth() {
    let Some(mut renderer) = renderer() else { return };
    let (scene, view) = holes();
    let order = |renderer: &Renderer| renderer.stats().projection.unwrap().order;
    let log = halite::host::Log::default();
    for wanted in [(CellOrder::Mpvo, 0), (CellOrder::Mpvo, 0), (CellOrder::Depth, 1), (CellOrder::Depth, 0)] {
        set(&mut renderer, &scene);
        log.collect(|| image(&mut renderer, ProjectionOptions::default(), &view));
        let said = log.take().iter().filter(|line| line.contains("in the order of their depths")).count();
        assert_eq!((order(&renderer), said), wanted);
    }
    let still = image(&mut renderer, ProjectionOptions::default(), &view);
    assert_eq!(order(&renderer), CellOrder::Mpvo);
    assert!(still.compare(&Engine::Reference.image(&scene, &view)).unwrap().max < 2e-5);
}

#[test]
fn a_still_camera_keeps_its_order() {
    let Some(mut renderer) = renderer() else { return };
    let (scene, view) = holes();
    set(&mut renderer, &scene);
    let sorts = |r: &Renderer| r.stats().projection.unwrap().sorts;
    let first = image(&mut renderer, ProjectionOptions::default(), &view);
    assert_eq!(sorts(&renderer), 1);
    assert!(image(&mut renderer, ProjectionOptions::default(), &view) == first);
    assert_eq!(sorts(&renderer), 0);
    image(&mut renderer, ProjectionOptions::default(), &perspective(dvec3(-2.5, 1.5, 4.0), 35.0));
    assert_eq!(sorts(&renderer), 1);
    // Another function may show other cells.
    renderer.set_transfer(&TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, 0.0)], 1.0).unwrap());
    let empty = image(&mut renderer, ProjectionOptions::default(), &view);
    assert!(empty.pixels.iter().all(|p| *p == [0.0; 4]));
    assert_eq!(renderer.stats().projection.unwrap().drawn_cells, 0);
}

#[test]
fn cells_that_are_not_seen_are_not_sorted() {
    let Some(mut renderer) = renderer() else { return };
    let (scene, _) = holes();
    set(&mut renderer, &scene);
    // A view of a corner, from inside.
    let view = perspective(dvec3(0.5, 0.5, 0.5), 20.0);
    image(&mut renderer, ProjectionOptions::default(), &view);
    let drawn = renderer.stats().projection.unwrap().drawn_cells;
    assert!(drawn > 0 && drawn < scene.mesh.cells().len() as u64 / 3, "{drawn} of {}", scene.mesh.cells().len());
}

#[test]
fn what_it_cannot_draw_it_says() {
    let Some(mut renderer) = renderer() else { return };
    let (scene, view) = holes();
    set(&mut renderer, &scene);
    renderer.set_integral(volume(Kind::Log, Texels::Float, [1, 1, 1]));
    let table = renderer.render(&view, &|_| ()).unwrap_err();
    assert!(table.to_string().contains("table"), "{table}");
    renderer.set_integral(IntegrationOptions::default());
    assert!(image(&mut renderer, ProjectionOptions::default(), &view).pixels.iter().any(|p| p[3] > 0.1));
}

/// A wedge of cells around the eye: some hold it, some are beside and behind it.
#[test]
fn cells_that_hold_the_eye_are_clipped_not_dropped() {
    let mesh: Mesh = generate::tetrahedra(5);
    let scene = Scene::new(&mesh, mesh.point_arrays()[0].clone(), Association::Point, |field| {
        let [lo, hi] = field.range(0);
        TransferFunction::new(vec![(0.0, [0.8, 0.5, 0.3])], vec![(lo, 0.2), (hi, 1.5)], 1.0).unwrap()
    });
    for (at, bound) in [(dvec3(0.13, 0.21, 0.33), 1e-3), (dvec3(-0.4, 0.33, 0.9), 1e-3)] {
        let view = perspective(at, 100.0);
        let form = |fragments| ProjectionOptions::default().with_fragments(fragments);
        let Some([interpolated, intersected]) =
            errors(&(scene.clone(), view), [form(INTERPOLATED), form(Fragments::Intersected)])
        else {
            return;
        };
        eprintln!("from {at}: interpolated {interpolated:.1e}, intersected {intersected:.1e}");
        assert!(interpolated < bound && intersected < 1e-5);
    }
}

/// Cells that the eye is in or beside are cut at the plane through it: their parts must be blended in sequence, which
/// bands of many colours in a single cell show.
#[test]
fn parts_of_a_cell_are_drawn_from_back_to_front() {
    let Some(mut renderer) = renderer() else { return };
    let mut report = Report::default();
    for i in 0..rounds(24) {
        let mut r = Random::of(&format!("a cell around the eye {i}"));
        let points: Vec<DVec3> = (0..4).map(|_| r.point(1.0)).collect();
        let volume = (points[1] - points[0]).cross(points[2] - points[0]).dot(points[3] - points[0]).abs() / 6.0;
        if volume < 0.1 {
            continue;
        }
        // Inside, or a little outside.
        let shares = [(); 4].map(|()| r.within(-0.1, 1.0));
        let eye = points.iter().zip(shares).map(|(p, s)| *p * s).sum::<DVec3>() / shares.iter().sum::<f64>();
        let mesh = draw::mesh_of(points, [(10, &[0, 1, 2, 3][..])]);
        let values = Values::F64(vec![-1.0, -0.4, 0.3, 1.0]);
        let array = Array { name: "s".into(), components: 1, values };
        let scene = Scene::new(&mesh, array, Association::Point, |_| {
            let color = vec![(-1.0, [1.0, 0.1, 0.0]), (0.0, [0.1, 0.9, 0.1]), (1.0, [0.0, 0.1, 1.0])];
            TransferFunction::new(color, vec![(-1.0, 2.0), (0.0, 0.5), (1.0, 3.0)], 0.5).unwrap()
        });
        let projection = Projection::Perspective { view_angle: 100.0 };
        let camera = Camera { position: eye, focal_point: eye + r.direction(), view_up: r.direction(), projection };
        let view = View::new(camera, [40, 40]).unwrap();
        let view = if i % 3 == 0 { view.with_clipping_range([0.15, 10.0]).unwrap() } else { view };
        let expected = Engine::Reference.image(&scene, &view);
        set(&mut renderer, &scene);
        let options = ProjectionOptions::default().with_fragments(INTERPOLATED);
        report.hold(&format!("cell {i}"), &image(&mut renderer, options, &view), &expected, 2e-3);
    }
    report.finish("parts of a cell");
}

/// In a parallel view nothing is near an eye: cells are drawn once, with a clipping range too.
#[test]
fn parallel_views_with_a_clipping_range_draw_cells_once() {
    let Some(mut renderer) = renderer() else { return };
    let (scene, _) = holes();
    set(&mut renderer, &scene);
    let camera = Camera {
        position: dvec3(3.0, 2.0, 4.0),
        focal_point: DVec3::ZERO,
        view_up: DVec3::Y,
        projection: Projection::Parallel { parallel_scale: 1.5 },
    };
    let all = View::new(camera, [40, 40]).unwrap();
    let part = all.clone().with_clipping_range([3.0, 5.4]).unwrap();
    let expected = Engine::Reference.image(&scene, &part);
    for fragments in [INTERPOLATED, Fragments::Linear, Fragments::Intersected] {
        let options = ProjectionOptions::default().with_fragments(fragments);
        image(&mut renderer, options, &all);
        let whole = renderer.stats().projection.unwrap().drawn_cells;
        let error = image(&mut renderer, options, &part).compare(&expected).unwrap();
        let drawn = renderer.stats().projection.unwrap().drawn_cells;
        eprintln!("{fragments:?}: {drawn} of {whole} cells, rmse {:.1e}, max {:.1e}", error.rmse, error.max);
        assert!(drawn <= whole && error.rmse < 2e-3);
    }
}
