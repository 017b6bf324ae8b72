//! Functions of two variables, light and silhouettes: pictures against the reference's, on meshes of every kind of cell.

#![allow(clippy::expect_used, clippy::unwrap_used, clippy::panic, clippy::print_stderr, reason = "tests")]

mod common;

use common::{ENGINES, Engine, Report, Scene, on_device, set};
use glam::DVec3;
use halite::field::{Association, Component, Field};
use halite::gpu::DeviceChoice;
use halite::integral::options::{IntegrationOptions, Method, Silhouettes, Two};
use halite::mesh::cells::Tetrahedra;
use halite::mesh::{Array, Mesh, Values, generate};
use halite::reference::Reference;
use halite::render::{self, Renderer};
use halite::transfer::bivariate::{OPEN, Shape, Sine, Table, Wave, Widget};
use halite::transfer::shading::{Cone, Highlight, Light, Origin, Shade};
use halite::transfer::{Bivariate, Convention, Emission, Shading, TransferFunction};
use halite::view::{Blend, Camera, ClippingPlane, Projection, View};

/// Of any channel of any pixel.
const BOUND: f64 = 2e-5;
/// The same of devices, whose segments have ends that f32 rounds.
const ON_DEVICES: f64 = 5e-5;

/// The engines that have a device draw two variables, and light.
const DEVICES: &[render::Engine] = &[render::Engine::Traverse, render::Engine::Project];

fn wave(period: f64) -> Wave {
    Wave { axis: [1.0, 0.0], start: 0.1, period, floor: 0.0 }
}

fn widget(shape: Shape, color: [f64; 3], opacity: f64) -> Widget {
    Widget { shape, color, opacity, domain: OPEN }
}

/// What covers much of what the test's field has.
fn gaussian() -> Widget {
    widget(Shape::Gaussian { center: [0.2, 2.0], sigma: [0.3, 0.8] }, [0.2, 0.8, 0.3], 0.9)
}

fn boxed() -> Widget {
    Widget { domain: [[0.1, 0.6], [0.5, f64::INFINITY]], ..widget(Shape::Uniform, [0.9, 0.5, 0.2], 0.5) }
}

fn of(widgets: Vec<Widget>) -> TransferFunction {
    TransferFunction::of_two(Bivariate::default().with_widgets(widgets).unwrap(), 0.3).unwrap()
}

fn knots() -> TransferFunction {
    let color = vec![(-0.6, [0.1, 0.2, 0.9]), (0.2, [0.1, 0.9, 0.4]), (0.9, [1.0, 0.3, 0.1])];
    let opacity = vec![(-0.6, 0.4), (-0.2, 0.0), (0.0, 0.0), (0.2, 0.8), (0.4, 0.1), (0.9, 0.6)];
    TransferFunction::new(color, opacity, 0.3).unwrap()
}

fn shade(power: f64, two_sided: bool) -> Shade {
    Shade { ambient: 0.2, diffuse: 0.7, specular: 0.5, power, two_sided, ..Shade::default() }
}

fn lit(transfer: TransferFunction, shade: Shade, origins: &[Origin]) -> TransferFunction {
    let light = |(i, &origin): (usize, &Origin)| {
        let color = if i == 0 { [1.0; 3] } else { [0.4, 0.7, 1.0] };
        Light { origin, color, intensity: 0.9, ..Light::default() }
    };
    let lights = origins.iter().enumerate().map(light).collect();
    transfer.with_shading(Shading::default().with_lights(shade, lights).unwrap())
}

/// Light of a position inside the mesh, within a cone and weaker with the distance; and highlights of reflected light.
fn spot(transfer: TransferFunction, power: f64, exponent: f64) -> TransferFunction {
    let cone = Some(Cone { axis: DVec3::new(-1.0, -1.0, 0.2), angle: 25.0, exponent });
    let lights = vec![
        Light {
            origin: Origin::Position(DVec3::new(0.7, 0.8, 0.1)),
            attenuation: [0.3, 0.5, 0.2],
            cone,
            ..Light::default()
        },
        Light { origin: Origin::Direction(DVec3::new(0.2, -1.0, 0.5)), intensity: 0.4, ..Light::default() },
    ];
    let shade = Shade { highlight: Highlight::Reflected, ..shade(power, true) };
    transfer.with_shading(Shading::default().with_lights(shade, lights).unwrap())
}

fn table() -> Table {
    let texel = |i: usize| {
        let (s, g) = ((i % 7) as f64 / 6.0, (i / 7) as f64 / 4.0);
        [s, g, 1.0 - s, if i.is_multiple_of(3) { 0.0 } else { s * 0.6 }]
    };
    Table::new([7, 5], (0..35).map(texel).collect(), [[-0.7, 0.9], [0.0, 4.0]]).unwrap()
}

/// A field that is linear nowhere, and another one.
fn scene(mesh: &Mesh, transfer: TransferFunction, second: bool) -> Scene {
    let at = |f: &dyn Fn(DVec3) -> f64| mesh.points().iter().map(|&p| f(p)).collect::<Vec<f64>>();
    let values = at(&|p| (2.0 * p.x).sin() * 0.5 + p.y * p.z * 0.7 + 0.2 * p.z);
    let array = Array { name: "s".into(), components: 1, values: Values::F64(values) };
    let mut scene = Scene::new(mesh, array, Association::Point, |_| transfer);
    if second {
        let g = at(&|p| 2.0 + p.x - p.z);
        let g = Field::from_slice("g", &g, 1, Association::Point, Component::Index(0)).unwrap();
        scene.field = scene.field.with_second(g).unwrap();
    }
    scene
}

fn view(size: u32) -> View {
    let projection = Projection::Perspective { view_angle: 32.0 };
    let position = DVec3::new(2.4137, 1.7291, 2.8873);
    View::new(
        Camera { position, focal_point: DVec3::new(0.011, -0.017, 0.013), view_up: DVec3::Y, projection },
        [size; 2],
    )
    .unwrap()
}

/// Transfer functions of every kind, and what they are called.
fn functions() -> Vec<(&'static str, TransferFunction)> {
    let oblique = Wave { axis: [1.0, -0.2], ..wave(0.3) };
    let floor = Wave { floor: 0.6, ..wave(0.25) };
    let sine = |w, kind| widget(Shape::Sinusoid(w, kind), [1.0, 0.4, 0.8], 0.6);
    let triangle = |w| widget(Shape::Triangle(w), [0.3, 0.5, 1.0], 0.7);
    let direct = |t: TransferFunction| t.with_emission(Emission::Direct { scale: 0.4 }).unwrap();
    let logarithmic = |t: TransferFunction| t.with_convention(Convention::Opacity);
    let h = |b: Bivariate| b.with_gradient_opacity(vec![(0.5, 0.1), (1.4, 1.0), (1.4, 0.3), (3.0, 2.0)]).unwrap();
    let silhouette = |t: TransferFunction, p| t.with_shading(Shading::default().with_silhouette(p).unwrap());
    let from = [Origin::Direction(DVec3::new(-1.0, -2.0, 0.5)), Origin::Position(DVec3::new(0.3, 0.4, 0.2))];
    let mix = || vec![gaussian(), triangle(wave(0.3)), sine(oblique, Sine::Abs), boxed()];
    vec![
        ("uniform", of(vec![boxed()])),
        ("gaussian", of(vec![gaussian()])),
        ("gaussian, direct", direct(of(vec![gaussian()]))),
        ("gaussian, opacity", logarithmic(of(vec![gaussian()]))),
        ("triangle", of(vec![triangle(wave(0.3))])),
        ("fast triangle", of(vec![triangle(wave(0.011))])),
        ("full triangle, opacity", logarithmic(of(vec![Widget { opacity: 1.0, ..triangle(wave(0.3)) }]))),
        ("triangle, direct", direct(of(vec![triangle(wave(0.3))]))),
        ("sine", of(vec![sine(wave(0.3), Sine::Abs)])),
        ("positive sine", of(vec![sine(oblique, Sine::Positive)])),
        ("raised sine", of(vec![sine(oblique, Sine::Raised)])),
        ("sine, direct", direct(of(vec![sine(wave(0.4), Sine::Abs)]))),
        ("peaks of a triangle", of(vec![triangle(floor)])),
        ("peaks of sines", of(vec![sine(floor, Sine::Abs), sine(Wave { start: 0.2, ..floor }, Sine::Positive)])),
        ("peaks of a raised sine", of(vec![sine(floor, Sine::Raised)])),
        ("a mix", of(mix())),
        ("a mix, opacity", logarithmic(of(mix()))),
        ("a mix, direct", direct(of(mix()))),
        ("a table", TransferFunction::of_two(Bivariate::default().with_table(table()), 0.3).unwrap()),
        ("h(g)", knots().with_bivariate(h(Bivariate::default()))),
        ("h(g), opacity, direct", direct(logarithmic(knots())).with_bivariate(h(Bivariate::default()))),
        ("a table with h(g)", TransferFunction::of_two(h(Bivariate::default().with_table(table())), 0.3).unwrap()),
        ("headlight", lit(knots(), shade(20.0, true), &[Origin::Headlight])),
        ("one side", lit(knots(), shade(8.0, false), &[from[0], Origin::Headlight])),
        ("two lights", lit(of(mix()), shade(20.0, true), &from)),
        ("direct light", direct(lit(knots(), shade(5.0, true), &from[..1]))),
        ("a spot", spot(knots(), 9.0, 3.0)),
        ("a wide highlight and a cone that ends at once", spot(of(mix()), 1.0, 0.0)),
        ("silhouette", silhouette(knots(), 2.0)),
        ("a silhouette of 3.5", silhouette(of(vec![gaussian()]), 3.5)),
        ("full raised sine, opacity", logarithmic(of(vec![Widget { opacity: 1.0, ..sine(wave(0.3), Sine::Raised) }]))),
        ("full gaussian, opacity", logarithmic(of(vec![Widget { opacity: 1.0, ..gaussian() }]))),
    ]
}

/// Some pixels of each picture: the reference is slow.
#[test]
fn pictures_are_the_references() {
    let mut report = Report::default();
    let view = view(48);
    let meshes = [("tetrahedra", generate::demo(4)), ("cells of all kinds", generate::mixed(2))];
    for (of_mesh, mesh) in &meshes {
        for (name, transfer) in functions() {
            for second in [false, true] {
                let scene = scene(mesh, transfer.clone(), second);
                let images: Vec<_> = ENGINES.iter().map(|&engine| (engine, engine.image(&scene, &view))).collect();
                let judge = Reference::new(&scene.mesh, &scene.tetrahedra, &scene.field, &scene.transfer).unwrap();
                let mut seen = false;
                // A prime divides no width: all columns come up.
                for i in (0..48 * 48).step_by(if second { 101 } else { 53 }) {
                    let at = [i as u32 % 48, i as u32 / 48];
                    let wanted = judge.ray(&view.ray(at[0], at[1]), Blend::Composite);
                    for (engine, image) in &images {
                        let got = image.pixels[i];
                        let error = (0..4).map(|k| (f64::from(got[k]) - wanted[k]).abs()).fold(0.0, f64::max);
                        let case = format!("{name}, {of_mesh}{}, {engine:?}", if second { ", an array" } else { "" });
                        report.measure(&case, error, BOUND, || format!("pixel {at:?} is {got:?}, not {wanted:?}"));
                    }
                    seen |= wanted[3] > 0.02;
                }
                assert!(seen, "{name}: there is something to see");
            }
        }
    }
    report.finish("bivariate");
}

/// Every engine draws the picture of the walk, and says who did.
#[test]
fn engines_draw_the_same_and_say_who_did() {
    let view = view(40);
    let scene = scene(&generate::demo(3), lit(of(vec![gaussian()]), shade(20.0, true), &[Origin::Headlight]), false);
    let wanted = Engine::Twin { threads: 2 }.image(&scene, &view);
    assert!(wanted.pixels.iter().any(|p| p[3] > 0.1));
    let mut renderer = Renderer::with_engine(2, DeviceChoice::Cpu, render::Engine::Project).unwrap();
    set(&mut renderer, &scene);
    assert!(renderer.render(&view, &|_| ()).unwrap().compare(&wanted).unwrap().max < BOUND);
    let stats = renderer.stats();
    assert_eq!((&*stats.engine, &*stats.device, &*stats.integral), ("project", "cpu", "adaptive"));
    let sweep = stats.sweep.as_ref().unwrap();
    assert!(stats.panels > 0 && sweep.fragments > 0 && sweep.handed_over.is_none());
    // And is itself again without.
    renderer.set_transfer(&knots());
    let one = renderer.render(&view, &|_| ()).unwrap();
    assert_eq!(renderer.stats().engine, "project");
    let plain = Scene { transfer: knots(), ..scene.clone() };
    let walked = Engine::Twin { threads: 2 }.image(&plain, &view);
    assert!(one.compare(&walked).unwrap().max < 2e-5);
    for engine in [render::Engine::Traverse, render::Engine::Project] {
        for image in Engine::Device(engine).draw(&scene, std::slice::from_ref(&view)) {
            assert!(image.compare(&wanted).unwrap().max <= BOUND, "{engine:?}");
        }
    }
}

/// What changes between frames is made again, and nothing is left of before.
#[test]
fn edits_are_drawn() {
    let view = view(32);
    let mesh = generate::demo(3);
    let first = scene(&mesh, of(vec![gaussian()]), false);
    let mut renderer = Renderer::with_device(2, DeviceChoice::Cpu).unwrap();
    set(&mut renderer, &first);
    renderer.render(&view, &|_| ()).unwrap();
    let hold = |renderer: &mut Renderer, scene: &Scene| {
        let fresh = Engine::Twin { threads: 2 }.image(scene, &view);
        let kept = renderer.render(&view, &|_| ()).unwrap();
        assert!(kept.compare(&fresh).unwrap().max < 1e-5);
        fresh
    };
    let narrow = widget(Shape::Gaussian { center: [0.2, 2.0], sigma: [0.01, 0.05] }, [1.0, 0.0, 0.0], 3.0);
    let mut pictures = vec![];
    for transfer in [
        of(vec![narrow]),
        lit(knots(), shade(20.0, true), &[Origin::Headlight]),
        lit(knots(), shade(20.0, true), &[Origin::Direction(DVec3::X)]),
        knots(),
        of(vec![boxed()]),
    ] {
        renderer.set_transfer(&transfer);
        pictures.push(hold(&mut renderer, &Scene { transfer, ..first.clone() }));
    }
    assert!(pictures.windows(2).all(|w| w[0].compare(&w[1]).unwrap().max > 1e-3));
    // Points that move change gradients; so does another field.
    let points: Vec<DVec3> = mesh.points().iter().map(|p| *p * DVec3::new(1.0, 0.5, 1.5)).collect();
    let moved = Mesh::new(points.clone(), mesh.cells().clone(), vec![], vec![]).unwrap();
    renderer.set_points(&points).unwrap();
    let mut other = first.clone();
    (other.mesh, other.transfer) = (moved, of(vec![boxed()]));
    hold(&mut renderer, &other);
    let twice: Vec<f64> = first.field.values().iter().map(|v| 1.3 * v).collect();
    other.field = Field::from_slice("s", &twice, 1, Association::Point, Component::Index(0)).unwrap();
    renderer.set_field(&other.field).unwrap();
    hold(&mut renderer, &other);
}

#[test]
fn what_has_no_gradient_is_refused() {
    let mesh = generate::demo(2);
    let tetrahedra = Tetrahedra::new(&mesh).unwrap();
    let values: Vec<f64> = (0..mesh.cells().len()).map(|i| (i % 7) as f64 / 7.0).collect();
    let cells = Field::from_slice("c", &values, 1, Association::Cell, Component::Index(0)).unwrap();
    let pairs = Field::from_slice("p", &values, 1, Association::Cell, Component::Index(0)).unwrap();
    let draw = |field: &Field, transfer: &TransferFunction, blend: Blend| {
        let mut renderer = Renderer::with_device(2, DeviceChoice::Cpu).unwrap();
        renderer.set_tetrahedra(&mesh, tetrahedra.clone());
        renderer.set_field(field).unwrap();
        renderer.set_transfer(transfer);
        renderer.render(&view(16).with_blend(blend), &|_| ())
    };
    let h = knots().with_bivariate(Bivariate::default().with_gradient_opacity(vec![(0.0, 1.0)]).unwrap());
    let silhouette = knots().with_shading(Shading::default().with_silhouette(1.0).unwrap());
    for transfer in [&h, &silhouette] {
        let message = draw(&cells, transfer, Blend::Composite).unwrap_err().to_string();
        assert!(message.contains("values of cells have no gradient"), "{message}");
        let refused = Reference::new(&mesh, &tetrahedra, &cells, transfer).unwrap_err().to_string();
        assert!(refused.contains("no gradient"), "{refused}");
    }
    let message = draw(&cells, &of(vec![gaussian()]), Blend::Maximum).unwrap_err().to_string();
    assert!(message.contains("a maximum along rays"), "{message}");
    // With an array of cells, or none where widgets alone say, cells are drawn.
    let both = cells.clone().with_second(pairs).unwrap();
    let open = of(vec![widget(Shape::Sinusoid(wave(0.7), Sine::Abs), [1.0; 3], 0.5)]);
    for (field, transfer) in [(&both, &h), (&both, &open), (&cells, &open)] {
        let image = draw(field, transfer, Blend::Composite).unwrap();
        let wanted = halite::reference::render(&mesh, &tetrahedra, field, transfer, &view(16)).unwrap();
        assert!(image.compare(&wanted).unwrap().max < BOUND);
        assert!(image.pixels.iter().any(|p| p[3] > 0.05));
    }
    let few = Field::from_slice("f", &[1.0; 3], 1, Association::Point, Component::Index(0)).unwrap();
    assert!(cells.with_second(few).unwrap_err().to_string().contains("both must be of the same"));
}

/// What a projection on the CPU leaves to the walk, or takes one by one: cells too thin for f32, extinction too dense for its
/// lengths, planes that cut cells, eyes among them, and few rows.
#[test]
fn the_projection_is_the_walk_everywhere() {
    let mut report = Report::default();
    let dense = |t: TransferFunction| t.with_unit_distance(1e-4).unwrap();
    let lamp = [Origin::Headlight];
    let functions = [
        ("a mix", of(vec![gaussian(), boxed(), widget(Shape::Triangle(wave(0.3)), [0.3, 0.5, 1.0], 0.7)])),
        ("lit", lit(knots(), shade(20.0, true), &lamp)),
        ("dense", dense(of(vec![gaussian(), boxed()]))),
        ("dense, lit", dense(lit(knots(), shade(20.0, true), &lamp))),
    ];
    let flat: Vec<DVec3> = generate::demo(3).points().iter().map(|p| *p * DVec3::new(1.0, 1.0, 1e-6)).collect();
    let flat = Mesh::new(flat, generate::demo(3).cells().clone(), vec![], vec![]).unwrap();
    let inside = {
        let projection = Projection::Perspective { view_angle: 70.0 };
        let (position, focal_point) = (DVec3::new(0.31, 0.21, 0.11), DVec3::new(-0.4, -0.2, -0.9));
        View::new(Camera { position, focal_point, view_up: DVec3::Y, projection }, [40, 3]).unwrap()
    };
    let cut = view(40)
        .with_clipping_planes(vec![ClippingPlane {
            origin: DVec3::new(0.1, 0.2, 0.05),
            normal: DVec3::new(-1.0, -0.4, -0.7),
        }])
        .unwrap();
    let parallel = Camera { projection: Projection::Parallel { parallel_scale: 1.3 }, ..*view(40).camera().unwrap() };
    let parallel = View::new(parallel, [40, 40]).unwrap();
    for (of_mesh, mesh) in [("demo", generate::demo(3)), ("flat", flat), ("islands", generate::islands(5))] {
        for (name, transfer) in &functions {
            let scene = scene(&mesh, transfer.clone(), false);
            for (from, view) in [("outside", &view(40)), ("inside", &inside), ("cut", &cut), ("parallel", &parallel)] {
                let [walk, sweep] = [ENGINES[0], ENGINES[1]].map(|engine| engine.image(&scene, view));
                // Where extinction is 1e4, f32 tells what is seen of a cell's front to 1e-4.
                let bound = if name.starts_with("dense") { 2e-4 } else { BOUND };
                report.hold(&format!("{name}, {of_mesh}, {from}"), &sweep, &walk, bound);
            }
        }
    }
    report.finish("projection of two variables");
}

/// Devices draw the pictures of the walk on the CPU, and leave no ray of these to it.
#[test]
fn devices_draw_the_pictures_of_the_walk() {
    let mut report = Report::default();
    let outside = view(40);
    let inside = {
        let projection = Projection::Perspective { view_angle: 70.0 };
        let (position, focal_point) = (DVec3::new(0.31, 0.21, 0.11), DVec3::new(-0.4, -0.2, -0.9));
        View::new(Camera { position, focal_point, view_up: DVec3::Y, projection }, [24, 24]).unwrap()
    };
    let parallel = Camera { projection: Projection::Parallel { parallel_scale: 1.3 }, ..*outside.camera().unwrap() };
    let parallel = View::new(parallel, [24, 24]).unwrap();
    let plane = ClippingPlane { origin: DVec3::new(0.1, 0.2, 0.05), normal: DVec3::new(-1.0, -0.4, -0.7) };
    let cut = view(24).with_clipping_planes(vec![plane]).unwrap();
    let views = [("outside", outside), ("inside", inside), ("parallel", parallel), ("cut", cut)];
    let meshes = [
        ("tetrahedra", generate::demo(4)),
        ("cells of all kinds", generate::mixed(2)),
        ("islands", generate::islands(7)),
    ];
    for engine in DEVICES {
        let Some(mut renderer) = on_device(*engine) else { return };
        for (of_mesh, mesh) in &meshes {
            for (i, (name, transfer)) in functions().into_iter().enumerate() {
                let scene = scene(mesh, transfer, i % 2 == 1);
                set(&mut renderer, &scene);
                let mut walk = Renderer::with_engine(2, DeviceChoice::Cpu, render::Engine::Traverse).unwrap();
                set(&mut walk, &scene);
                for (from, view) in &views {
                    let got = renderer.render(view, &|_| ()).unwrap();
                    let stats = renderer.stats();
                    // Round peaks of opacity 1 are left to the CPU.
                    let round = ["full raised sine, opacity", "full gaussian, opacity"].contains(&name);
                    let device = if round { "cpu" } else { "gpu" };
                    assert_eq!((&*stats.device, &*stats.integral), (device, "adaptive"), "{name}");
                    assert!(stats.cpu_rays <= 2, "{name}, {of_mesh}, {from}: {} rays are left", stats.cpu_rays);
                    let wanted = walk.render(view, &|_| ()).unwrap();
                    report.hold(&format!("{name}, {of_mesh}, {from}, {engine:?}"), &got, &wanted, ON_DEVICES);
                }
            }
        }
    }
    report.finish("two variables on devices");
}

/// Segments in equal pieces, and silhouettes of whole ones, are those of the walk on the CPU on devices, too.
#[test]
fn devices_draw_what_was_published() {
    let mut report = Report::default();
    let view = view(32);
    let of = |two: Two| IntegrationOptions::default().with_two(two);
    let (method, silhouettes) = (Method::Segmented, Silhouettes::Published);
    let forms = [
        ("pieces", of(Two::default().with_method(method).with_pieces(7))),
        ("whole", of(Two::default().with_silhouettes(silhouettes))),
        ("pieces and whole", of(Two::default().with_method(method).with_silhouettes(silhouettes))),
    ];
    for engine in DEVICES {
        let Some(mut renderer) = on_device(*engine) else { return };
        let mut walk = Renderer::with_engine(2, DeviceChoice::Cpu, render::Engine::Traverse).unwrap();
        for (name, transfer) in functions() {
            let has_silhouette = transfer.shading().is_some_and(|s| s.silhouette().is_some());
            let scene = scene(&generate::demo(3), transfer, false);
            set(&mut renderer, &scene);
            set(&mut walk, &scene);
            let mut adaptive = None;
            for (form, integral) in &forms {
                if form.ends_with("whole") && !has_silhouette {
                    continue;
                }
                renderer.set_integral(*integral);
                walk.set_integral(*integral);
                let got = renderer.render(&view, &|_| ()).unwrap();
                let stats = renderer.stats();
                let round = ["full raised sine, opacity", "full gaussian, opacity"].contains(&name);
                assert_eq!(&*stats.device, if round { "cpu" } else { "gpu" }, "{name}, {form}");
                assert!(stats.cpu_rays <= 2, "{name}, {form}: {} rays are left", stats.cpu_rays);
                let wanted = walk.render(&view, &|_| ()).unwrap();
                report.hold(&format!("{name}, {form}, {engine:?}"), &got, &wanted, ON_DEVICES);
                if has_silhouette {
                    let other = adaptive.get_or_insert_with(|| {
                        walk.set_integral(IntegrationOptions::default());
                        walk.render(&view, &|_| ()).unwrap()
                    });
                    assert!(other.compare(&wanted).unwrap().max > 1e-4, "{name}, {form} is another picture");
                }
            }
        }
    }
    report.finish("published forms on devices");
}
