//! Tables in both engines: pictures by each form against the exact ones, and against the oracle's where its scenes are
//! there.

#![allow(clippy::expect_used, clippy::unwrap_used, clippy::print_stderr, reason = "tests fail by panicking")]

mod common;

use common::draw::{self, FIELDS, LOOKS, Lot, MESHES, Random};
use common::{Scene, set};
use glam::{DVec3, dvec3};
use halite::field::Association;
use halite::gpu::DeviceChoice;
use halite::image::Image;
use halite::integral::options::{Alpha, Build, Form, IntegrationOptions, Planes, Texels};
use halite::integral::table::Kind;
use halite::mesh::cells::Tetrahedra;
use halite::mesh::{Array, Values, generate};
use halite::project::{Fragments, ProjectionOptions};
use halite::render::{Engine, Renderer};
use halite::scene;
use halite::transfer::{Emission, TransferFunction};
use halite::view::{Blend, Camera, Projection, View};
use std::path::Path;

/// A renderer with each engine, if there is a device; without any, the CPU's alone.
fn renderers() -> Vec<(&'static str, Renderer)> {
    let cpu = Renderer::with_device(2, DeviceChoice::Cpu).unwrap();
    let others = [(Engine::Traverse, "traverse"), (Engine::Project, "project")];
    let opened = others.into_iter().filter_map(|(engine, name)| Some((name, common::on_device(engine)?)));
    std::iter::once(("cpu", cpu)).chain(opened).collect()
}

fn image(renderer: &mut Renderer, choice: IntegrationOptions, view: &View) -> Image {
    renderer.set_integral(choice);
    let image = renderer.render(view, &|_| ()).unwrap();
    assert_eq!(renderer.stats().integral, choice.form.name());
    image
}

fn view(projection: Projection) -> View {
    let camera = Camera { position: dvec3(1.3, 2.1, 3.2), focal_point: DVec3::ZERO, view_up: DVec3::Y, projection };
    View::new(camera, [48, 40]).unwrap()
}

const PERSPECTIVE: Projection = Projection::Perspective { view_angle: 40.0 };
const PARALLEL: Projection = Projection::Parallel { parallel_scale: 1.2 };

/// Of one colour.
fn waves(emission: Emission) -> Scene {
    diluted(emission, 1.0)
}

/// The same, with so much of the extinction.
fn diluted(emission: Emission, share: f64) -> Scene {
    let mesh = generate::tetrahedra(5);
    Scene::new(&mesh, mesh.point_arrays()[0].clone(), Association::Point, |field| {
        let [lo, hi] = field.range(0);
        let at = |x: f64| lo + (hi - lo) * x;
        let opacity =
            [0.1, 1.5, 0.3, 2.0, 0.0, 0.7].iter().enumerate().map(|(i, a)| (at(i as f64 / 5.0), share * a)).collect();
        TransferFunction::new(vec![(0.0, [0.9, 0.6, 0.3])], opacity, 0.5).unwrap().with_emission(emission).unwrap()
    })
}

/// Eight bands of two colours, and much extinction in single cells: what differs between polynomials is seen.
fn bands() -> Scene {
    let mesh = generate::tetrahedra(2);
    Scene::new(&mesh, mesh.point_arrays()[0].clone(), Association::Point, |field| {
        let [lo, hi] = field.range(0);
        let at = |x: f64| lo + (hi - lo) * x;
        let colour = |k: usize| if k.is_multiple_of(2) { [1.0, 0.5, 0.1] } else { [0.1, 0.3, 1.0] };
        let edge = |k: usize| [(at((k as f64 + 0.02) / 8.0), colour(k)), (at((k as f64 + 0.98) / 8.0), colour(k))];
        TransferFunction::new((0..8).flat_map(edge).collect(), vec![(lo, 1.0), (hi, 1.0)], 0.2).unwrap()
    })
}

fn volume(lengths: Kind, table: [u32; 3]) -> IntegrationOptions {
    IntegrationOptions::of(Form::Volume).with_lengths(lengths).with_table(Some(table))
}

fn polynomial(degree: u32) -> IntegrationOptions {
    IntegrationOptions::of(Form::Polynomial).with_degree(degree).with_table(Some([128, 128, 0]))
}

fn cylindrical(planes: Planes) -> IntegrationOptions {
    IntegrationOptions::of(Form::Cylindrical).with_planes(planes).with_table(Some([64, 64, 64]))
}

/// How much of the extinction a medium has that is thin: the approximations of every form are near to what is right there.
const THIN: f64 = 0.02;

/// Every form, and how far from the exact picture it may be, in the medium as it is and in a thin one. In the former
/// some forms are of no use: no bound would tell a wrong table.
fn forms() -> Vec<(IntegrationOptions, Option<f64>, f64)> {
    vec![
        (volume(Kind::Uniform, [128, 128, 32]), Some(5e-3), 4e-4),
        (volume(Kind::Log, [128, 128, 32]), None, 8.5e-3),
        (volume(Kind::LogNormalised, [128, 128, 12]), Some(2e-3), 4e-4),
        (polynomial(1), Some(3e-3), 4e-4),
        (polynomial(2), Some(2e-3), 4e-4),
        (polynomial(2).with_alpha(Alpha::Linear), None, 5e-3),
        (cylindrical(Planes::Two), Some(2e-2), 1.6e-3),
        (cylindrical(Planes::Packed), Some(2e-2), 1.6e-3),
        (cylindrical(Planes::One), None, 4e-3),
        (volume(Kind::LogNormalised, [128, 128, 12]).with_texels(Texels::Unorm8), None, 6e-4),
    ]
}

/// What is wrong with the pictures of `scene` by the `forms`, each with its bound.
fn wrong_forms(
    all: &mut [(&'static str, Renderer)],
    scene: &Scene,
    forms: &[(IntegrationOptions, f64)],
) -> Vec<String> {
    let view = view(PERSPECTIVE);
    let emission = scene.transfer.emission();
    let mut wrong = vec![];
    all.iter_mut().for_each(|(_, r)| set(r, scene));
    let exact: Vec<Image> = all.iter_mut().map(|(_, r)| image(r, IntegrationOptions::default(), &view)).collect();
    let most = exact[0].pixels.iter().map(|p| p[3]).fold(0.0, f32::max);
    assert!(most > 0.5 || (0.02..0.2).contains(&most), "{most}");
    for (choice, bound) in forms {
        let mut first: Option<Image> = None;
        for ((engine, renderer), exact) in all.iter_mut().zip(&exact) {
            let got = image(renderer, *choice, &view);
            let error = got.compare(exact).unwrap();
            let planes = choice.planes;
            let name = format!("{engine}, {} {:?} {planes:?}, {emission:?}", choice.form.name(), choice.lengths);
            eprintln!("{name}: max {:.1e}, bound {bound:.1e}", error.max);
            // Direct emission knows no 1.
            let bound = if emission == Emission::Chromatic { *bound } else { 2.0 * bound };
            if !(error.max < bound && error.max > 1e-8) {
                wrong.push(format!("{name}: {error:?}"));
            }
            // The same table gives the same picture, but where a real device's filter has fewer bits.
            let first = first.get_or_insert_with(|| got.clone());
            let apart = got.compare(first).unwrap();
            if apart.rmse > 1e-3 * f64::from(most) {
                wrong.push(format!("{name}: {apart:?} from the CPU's"));
            }
        }
    }
    wrong
}

#[test]
fn both_engines_draw_with_each_form() {
    let (mut all, mut wrong) = (renderers(), vec![]);
    for emission in [Emission::Chromatic, Emission::Direct { scale: 0.4 }] {
        let dense: Vec<_> = forms().into_iter().filter_map(|(choice, bound, _)| Some((choice, bound?))).collect();
        wrong.extend(wrong_forms(&mut all, &waves(emission), &dense));
        let thin: Vec<_> = forms().into_iter().map(|(choice, _, bound)| (choice, bound)).collect();
        let direct = if emission == Emission::Chromatic { emission } else { Emission::Direct { scale: 0.4 * THIN } };
        wrong.extend(wrong_forms(&mut all, &diluted(direct, THIN), &thin));
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Tables that the device builds draw what those do that it is handed; and after an edit the exact frame comes first,
/// as ever.
#[test]
fn devices_build_what_they_draw_with() {
    let (scene, other) = (waves(Emission::Chromatic), waves(Emission::Direct { scale: 0.4 }));
    let view = view(PERSPECTIVE);
    for (engine, renderer) in &mut renderers() {
        for choice in [volume(Kind::LogNormalised, [128, 128, 12]), polynomial(2), cylindrical(Planes::Two)] {
            let [handed, built] = [Build::Host, Build::Device].map(|build| {
                set(renderer, &scene);
                let choice = choice.with_build(build);
                let first = image(renderer, choice, &view);
                let uploaded = renderer.stats().uploaded_bytes;
                assert!(renderer.stats().table_ms > 0.0, "{engine}, {build:?}");
                renderer.set_transfer(&other.transfer);
                renderer.render(&view, &|_| ()).unwrap();
                assert_eq!(renderer.stats().integral, "exact", "{engine}, {build:?}");
                renderer.wait_for_table();
                (first, image(renderer, choice, &view), uploaded)
            });
            let apart = [(&handed.0, &built.0), (&handed.1, &built.1)].map(|(a, b)| a.compare(b).unwrap().max);
            eprintln!("{engine}, {}: {apart:?}, {} and {} bytes", choice.form.name(), handed.2, built.2);
            // Filters of real devices mix the same texels alike.
            assert!(apart.iter().all(|&a| a < 2e-4), "{engine}, {choice:?}: {apart:?}");
            assert!(*engine == "cpu" || built.2 + 100_000 < handed.2, "{engine}: {} {}", built.2, handed.2);
        }
        // What a device cannot build, the host does.
        let degree = polynomial(6).with_build(Build::Device);
        assert!(image(renderer, degree, &view).pixels.iter().any(|p| p[3] > 0.5), "{engine}");
    }
}

#[test]
fn each_degree_is_clearly_better_than_the_one_before() {
    let scene = bands();
    let view = view(PERSPECTIVE);
    for (engine, renderer) in &mut renderers() {
        set(renderer, &scene);
        let exact = image(renderer, IntegrationOptions::default(), &view);
        let [linear, quadratic, quartic] =
            [1, 2, 4].map(|degree| image(renderer, polynomial(degree), &view).compare(&exact).unwrap().rmse);
        eprintln!("{engine}: degree 1 {linear:.1e}, 2 {quadratic:.1e}, 4 {quartic:.1e}");
        assert!(linear > 1.5 * quadratic && quadratic > 1.5 * quartic, "{engine}: {linear} {quadratic} {quartic}");
    }
}

/// In a parallel view all of a cell is on one plane; in a perspective one it is not.
#[test]
fn a_plane_serves_a_cell_in_parallel_views() {
    let scene = waves(Emission::Chromatic);
    let mut all = renderers();
    let Some((_, renderer)) = all.iter_mut().find(|r| r.0 == "project") else { return };
    set(renderer, &scene);
    let per_cell = cylindrical(Planes::Two).with_per_cell(true);
    let mut errors = |projection| {
        let view = view(projection);
        renderer.set_projection(ProjectionOptions::default());
        let by_fragment = image(renderer, cylindrical(Planes::Two), &view);
        renderer.set_projection(ProjectionOptions::default().with_fragments(Fragments::Interpolated));
        image(renderer, per_cell, &view).compare(&by_fragment).unwrap().max
    };
    let (parallel, perspective) = (errors(PARALLEL), errors(PERSPECTIVE));
    eprintln!("a plane for each cell: parallel {parallel:.1e}, perspective {perspective:.1e}");
    assert!(parallel < 2e-4 && perspective > 2.0 * parallel && perspective < 5e-2);
}

/// Forms that fields of several components are looked up by, and how far from the reference's pictures: of smooth functions at most,
/// and of peaks and steps between texels on average.
fn forms_of_components() -> [(IntegrationOptions, f64, f64); 4] {
    [
        (IntegrationOptions::of(Form::Volume), 4e-3, 4e-3),
        (IntegrationOptions::of(Form::Polynomial), 1e-3, 2e-3),
        (volume(Kind::Uniform, [128, 128, 32]), 6e-3, 2e-2),
        (cylindrical(Planes::Two), 2e-2, 5e-2),
    ]
}

/// Pairs and RGBA: the reference's pictures, by every form and in every engine.
#[test]
fn colours_of_their_own_are_tabulated() {
    let mut all = renderers();
    all.push(("walk", Renderer::with_engine(2, DeviceChoice::Cpu, Engine::Traverse).unwrap()));
    let (mut wrong, view) = (vec![], view(PERSPECTIVE));
    let own: Vec<&Lot> = FIELDS.iter().filter(|lot| lot.components > 1).collect();
    let looks = LOOKS.iter().filter(|look| !look.name.contains("wall") && look.name != "dense");
    let smooth = ["ramp", "opacity", "direct"];
    for (i, look) in looks.clone().chain(looks.filter(|look| smooth.contains(&look.name))).enumerate() {
        let lot = own[(i + i / own.len()) % own.len()];
        let (name, mesh) = MESHES[i % MESHES.len()];
        let case = format!("{name}, {}, {}", look.name, lot.name);
        let scene = draw::scene(&mesh(), lot, look, &mut Random::of(&case));
        let truth = common::Engine::Reference.image(&scene, &view);
        // Direct emission knows no 1.
        let most = if scene.transfer.emission() == Emission::Chromatic { 1.0 } else { 8.0 };
        let mut first: Vec<Image> = vec![];
        for (engine, renderer) in &mut all {
            set(renderer, &scene);
            for (k, (choice, greatest, mean)) in forms_of_components().into_iter().enumerate() {
                let got = image(renderer, choice, &view);
                let error = got.compare(&truth).unwrap();
                if first.len() == k {
                    first.push(got.clone());
                }
                let apart = got.compare(&first[k]).unwrap();
                let what = format!("{case}, {engine}, {} {:?}", choice.form.name(), choice.lengths);
                eprintln!("{what}: max {:.1e}, rmse {:.1e}, {:.1e} from the CPU's", error.max, error.rmse, apart.max);
                let is_near =
                    if smooth.contains(&look.name) { error.max < most * greatest } else { error.rmse < most * mean };
                if !(is_near && apart.rmse < 1e-4) {
                    wrong.push(format!("{what}: {error:?}, {apart:?}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Outliers of the component that opacity is of are beyond a table's range, and colours are as linear there.
#[test]
fn outliers_beside_colours_of_their_own_are_exact() {
    let mesh = generate::tetrahedra(4);
    let view = view(PERSPECTIVE);
    for components in [2, 4] {
        let value = |(i, p): (usize, &DVec3)| {
            let s = if i.is_multiple_of(7) { 30.0 * p.x } else { 0.6 * p.y };
            let colours = [0.5 + 0.4 * p.z, 0.5 - 0.3 * p.x, 0.2 + 0.1 * p.y];
            colours.into_iter().take(components - 1).chain([s]).collect::<Vec<f64>>()
        };
        let values = mesh.points().iter().enumerate().flat_map(value).collect();
        let array = Array { name: "own".into(), components, values: Values::F64(values) };
        let scene = Scene::new(&mesh, array, Association::Point, |_| {
            let color = vec![(0.1, [1.0, 0.1, 0.0]), (0.45, [0.1, 0.9, 0.2]), (0.9, [0.0, 0.2, 1.0])];
            TransferFunction::new(color, vec![(-1.0, 0.3), (0.2, 1.2), (1.0, 0.6)], 1.0).unwrap()
        });
        let truth = common::Engine::Reference.image(&scene, &view);
        for (engine, renderer) in &mut renderers() {
            set(renderer, &scene);
            for form in [Form::Volume, Form::Polynomial] {
                let got = image(renderer, IntegrationOptions::of(form), &view);
                let of = |k: usize| {
                    got.pixels.iter().zip(&truth.pixels).map(|(g, t)| (g[k] - t[k]).abs()).fold(0.0, f32::max)
                };
                let [color, alpha] = [of(0).max(of(1)).max(of(2)), of(3)];
                eprintln!("{components} components, {engine}, {form:?}: colours {color:.1e}, opacity {alpha:.1e}");
                // What is off is the opacity of cells that all of the function is in.
                assert!(alpha < 2e-2 && color < 1.5 * alpha + 1e-3, "{components} components, {engine}, {form:?}");
            }
        }
    }
}

/// A function of opacity with many knots is looked up, where nobody says how, whatever the colours come from.
#[test]
fn auto_tabulates_many_knots_of_colours_of_their_own() {
    let mesh = generate::tetrahedra(3);
    let view = view(PERSPECTIVE);
    for lot in FIELDS.iter().filter(|lot| lot.components > 1 && lot.association == Association::Point && !lot.missing) {
        for (knots, form) in [(3, "exact"), (400, "polynomial")] {
            let mut scene = draw::scene(&mesh, lot, &LOOKS[0], &mut Random::of("auto"));
            let [lo, hi] = scene.field.range(lot.components - 1);
            let opacity = (0..knots)
                .map(|i| (lo + (hi - lo) * i as f64 / (knots - 1) as f64, 1.0 + 0.5 * (0.1 * f64::from(i)).sin()))
                .collect();
            scene.transfer =
                TransferFunction::new(vec![(0.0, [1.0, 0.5, 0.2]), (1.0, [0.1, 0.5, 1.0])], opacity, 1.0).unwrap();
            for (engine, renderer) in &mut renderers() {
                set(renderer, &scene);
                let exact = image(renderer, IntegrationOptions::default(), &view);
                renderer.set_integral(IntegrationOptions::of(Form::Auto));
                renderer.wait_for_table();
                let got = renderer.render(&view, &|_| ()).unwrap();
                assert_eq!(renderer.stats().integral, form, "{engine}, {}, {knots} knots", lot.name);
                assert!(got.compare(&exact).unwrap().max < 2e-2, "{engine}, {}, {knots} knots", lot.name);
            }
        }
    }
}

#[test]
fn the_largest_value_needs_no_table() {
    let view = view(PERSPECTIVE);
    // The largest value along a ray needs no table, and has its own picture.
    let (_, cpu) = &mut renderers()[0];
    set(cpu, &waves(Emission::Chromatic));
    let maximum = view.with_blend(Blend::Maximum);
    let exact = image(cpu, IntegrationOptions::default(), &maximum);
    cpu.set_integral(polynomial(2));
    assert!(cpu.render(&maximum, &|_| ()).unwrap() == exact);
}

/// A scene of the oracle's with its picture; none where that folder is not.
fn reference(name: &str) -> Option<(Scene, View, Image)> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/reference").join(name).with_extension("json");
    if !file.exists() {
        eprintln!("skipped: there is no {}", file.display());
        return None;
    }
    let scene = scene::Scene::open(&file).unwrap();
    let mesh = halite::io::open(&scene.mesh, &|_| ()).unwrap();
    let (field, (view, _)) = (scene.scalars.field(&mesh).unwrap(), scene.view().unwrap());
    let tetrahedra = Tetrahedra::new(&mesh).unwrap();
    let truth = Image::open(&file.with_extension("npy")).unwrap();
    Some((Scene { tetrahedra, mesh, field, transfer: scene.transfer }, view, truth))
}

#[test]
fn reference_scenes_by_tables() {
    // Devices in software take their time, and are near to the CPU in all that is drawn above.
    let long = std::env::var("HALITE_LONG").is_ok_and(|v| v == "1");
    let mut all = renderers();
    all.truncate(if long { all.len() } else { 1 });
    if !long {
        eprintln!("skipped in part: the CPU alone draws, HALITE_LONG=1 has devices draw too");
    }
    for name in ["wavelet_smooth", "wavelet_parallel", "wavelet_inside90"] {
        let Some((scene, view, truth)) = reference(name) else { return };
        for (engine, renderer) in &mut all {
            set(renderer, &scene);
            for form in [Form::Volume, Form::Polynomial] {
                let error = image(renderer, IntegrationOptions::of(form), &view).compare(&truth).unwrap();
                eprintln!("{name}, {engine}, {form:?}: max {:.1e}, rmse {:.1e}", error.max, error.rmse);
                assert!(error.max <= 2e-3 && error.rmse <= 2e-4, "{name}, {engine}, {form:?}: {error:?}");
            }
        }
    }
    let Some((scene, view, truth)) = reference("coarse_bands") else { return };
    for (engine, renderer) in &mut all {
        set(renderer, &scene);
        let [linear, quadratic, quartic] = [1, 2, 4].map(|degree| {
            let choice = IntegrationOptions::of(Form::Polynomial).with_degree(degree);
            image(renderer, choice, &view).compare(&truth).unwrap().rmse
        });
        eprintln!("coarse_bands, {engine}: degree 1 {linear:.1e}, 2 {quadratic:.1e}, 4 {quartic:.1e}");
        assert!(linear > 3.0 * quadratic && quadratic > 3.0 * quartic);
    }
}
