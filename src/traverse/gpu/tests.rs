#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stderr, reason = "tests")]

use super::*;
use crate::cell::{Face, Projected};
use crate::field::{Association, Component, Field, Kind, Normal};
use crate::gpu::DeviceChoice;
use crate::gpu::arrays::twice;
use crate::gpu::function::{Function, Knot};
use crate::gpu::testing::{choice, gpu, validated};
use crate::image::Image;
use crate::integral::Light;
use crate::mesh::cells::Tetrahedra;
use crate::mesh::{Array as MeshArray, Mesh, Values as MeshValues, generate};
use crate::render::Renderer;
use crate::transfer::{Convention, Emission, TransferFunction};
use crate::view::{Camera, ClippingPlane, DepthBuffer, DepthKind, Projection};
use wgpu::naga;

/// Marsaglia's xorshift64 (2003).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() >> 33) as usize % n
    }

    fn direction(&mut self) -> DVec3 {
        loop {
            let v = DVec3::from([(); 3].map(|()| self.within(-1.0, 1.0)));
            if v.length() > 0.1 && v.length() < 1.0 {
                return v.normalize();
            }
        }
    }
}

const KINDS: [Kind; 3] = [Kind::Scalar, Kind::Pair, Kind::Rgba];

fn arrays(chunks: usize) -> Vec<Array> {
    let names = [
        ("cells", "Cell"),
        ("faces", "Outer"),
        ("points", "Point"),
        ("volumes", "f32"),
        ("boxes", "Box"),
        ("values", "Value"),
    ];
    names.map(|(name, element)| Array { name, element, chunks, shift: 22 }).to_vec()
}

#[test]
fn every_program_is_valid() {
    for kind in KINDS {
        for (direct, chunks) in [(false, 1), (true, 3)] {
            for association in ["POINT", "CORNER", "CELL"] {
                for blend in [Blend::Composite, Blend::Maximum] {
                    validated(&program(&Variant { kind, direct }, association, blend, None, &arrays(chunks)));
                }
            }
        }
    }
}

#[test]
fn layouts_match_their_rust_twins() {
    use std::mem::offset_of;
    let variant = Variant { kind: Kind::Scalar, direct: false };
    let module = validated(&program(&variant, "POINT", Blend::Composite, None, &arrays(1)));
    let check = |name: &str, size: usize, offsets: &[usize]| {
        let (_, t) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name)).unwrap();
        let naga::TypeInner::Struct { members, span } = &t.inner else { panic!("{name} is no struct") };
        let found: Vec<usize> = members.iter().map(|m| m.offset as usize).collect();
        assert_eq!((*span as usize, &found[..]), (size, offsets), "{name}");
    };
    macro_rules! check {
        ($name:literal, $rust:ty, $($field:ident)*) => {
            check($name, size_of::<$rust>(), &[$(offset_of!($rust, $field)),*])
        };
    }
    check!("Cell", Cell, corners neighbours);
    check!("Outer", Outer, points cell);
    check!("Box", Bounds, low high);
    check!("Knot", Knot, value slope ends);
    check!("Function", Function, opacity color end scale);
    check!("Counts", RawCounts, steps carry repaired unused);
    check!("Frame", Frame, origin direction size first_row rows near far planes has_ends leaves faces most_steps most_work);
    check("Point", 24, &[0, 8, 16]);
}

/// Runs a kernel over `cases`, whose bindings are 0 and, for as many results, 1 of group 1.
fn run<C: Pod, R: Pod>(gpu: &Gpu, source: &str, group_0: &[(Binding, &Buffer)], cases: &[C]) -> Vec<R> {
    let layouts = [
        shader::group_layout(gpu, &group_0.iter().map(|g| g.0).collect::<Vec<_>>()),
        shader::group_layout(gpu, &[Binding::Read, Binding::Write]),
    ];
    let pipeline = shader::compile(gpu, "test", source, &[&layouts[0], &layouts[1]]);
    let size = (cases.len() * size_of::<R>()) as u64;
    let cases_buffer = Buffer::holding(gpu, "cases", cases, Usage::STORAGE).unwrap();
    let results = Buffer::new(gpu, "results", size, Usage::STORAGE | Usage::COPY_SRC).unwrap();
    let back = Buffer::new(gpu, "back", size, Usage::COPY_DST | Usage::MAP_READ).unwrap();
    let groups = [
        shader::group(gpu, &layouts[0], group_0.iter().map(|g| g.1)),
        shader::group(gpu, &layouts[1], [&cases_buffer, &results]),
    ];
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &groups[0], &[]);
        pass.set_bind_group(1, &groups[1], &[]);
        pass.dispatch_workgroups((cases.len() as u32).div_ceil(64), 1, 1);
    }
    encoder.copy_buffer_to_buffer(&results.raw, 0, &back.raw, 0, size);
    encoder.map_buffer_on_submit(&back.raw, wgpu::MapMode::Read, .., |r| r.unwrap());
    gpu.queue.submit([encoder.finish()]);
    gpu.wait().unwrap();
    let bytes = back.raw.get_mapped_range(..).unwrap();
    bytemuck::cast_slice(&bytes[..]).to_vec()
}

const CELL_TEST: &str = "
struct Case { points: array<vec4f, 4> }
struct Outcome { areas: vec4f, next: vec4f, entered: u32, dropped: u32 }
@group(1) @binding(0) var<storage, read> cases: array<Case>;
@group(1) @binding(1) var<storage, read_write> outcomes: array<Outcome>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&cases) { return; }
    let a = cases[id.x].points[0];
    let b = cases[id.x].points[1];
    let c = cases[id.x].points[2];
    let areas = areas_of(a, b, c);
    let stepped = step(Face(a, b, c, areas), cases[id.x].points[3]);
    outcomes[id.x] = Outcome(vec4f(areas, 0.0), vec4f(stepped.areas, 0.0), u32(holds(a, b, c, areas)), stepped.dropped);
}";

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Outcome {
    areas: [f32; 4],
    next: [f32; 4],
    entered: u32,
    dropped: u32,
    padding: [u32; 2],
}

#[test]
fn cells_are_walked_as_in_f64() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(3);
    let cases: Vec<[[f32; 4]; 4]> = (0..200_000)
        .map(|i| {
            let span = [1.0, 3.0, 1000.0][i % 3];
            let mut points = [(); 4].map(|()| {
                let mut coordinate = || match (i / 3) % 3 {
                    // Small integers make ties common; tiny and great numbers meet; anything.
                    0 => random.within(-span - 0.5, span + 0.5).round() as f32,
                    1 => (random.within(-1.0, 1.0) * 10f64.powf(random.within(-14.0, 0.0))) as f32,
                    _ => random.within(-1.0, 1.0) as f32,
                };
                [coordinate(), coordinate(), coordinate(), 0.0]
            });
            // Nearly or wholly on one line with the origin.
            if random.below(3) == 0 {
                let f = random.within(-2.0, 2.0) as f32;
                let to = random.below(4);
                points[to] = points[(to + 1) % 4].map(|x| x * f);
            }
            points
        })
        .collect();
    let variant = Variant { kind: Kind::Scalar, direct: false };
    let source = [&shader::prelude(&variant), shader::CELL, CELL_TEST].join("\n");
    let outcomes: Vec<Outcome> = run(&gpu, &source, &[], &cases);
    let mut entered = 0;
    for (case, outcome) in cases.iter().zip(&outcomes) {
        let [a, b, c, d] = case.map(|p| Projected { x: f64::from(p[0]), y: f64::from(p[1]), t: f64::from(p[2]) });
        let face = Face::enter([a, b, c]);
        assert_eq!(face.is_some(), outcome.entered == 1, "{case:?}");
        let Some(mut face) = face else { continue };
        entered += 1;
        let size = [a, b, c, d].iter().fold(0.0, |m: f64, p| m.max(p.x.abs()).max(p.y.abs()));
        let near =
            |got: [f32; 4], want: [f64; 3]| (0..3).all(|k| (f64::from(got[k]) - want[k]).abs() <= 3e-7 * size * size);
        assert!(near(outcome.areas, face.areas), "{case:?}");
        assert_eq!(face.step(d) as u32, outcome.dropped, "{case:?}");
        assert!(near(outcome.next, face.areas), "{case:?}");
    }
    assert!(entered > 10_000);
}

const PLACE_TEST: &str = "
struct Case { origin: Twice, direction: Twice, point: Twice }
struct Outcome { place: vec4f, right: vec4f, up: vec4f, sum: Twice }
@group(1) @binding(0) var<storage, read> cases: array<Case>;
@group(1) @binding(1) var<storage, read_write> outcomes: array<Outcome>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&cases) { return; }
    let given = cases[id.x];
    let ray = ray_along(given.origin, given.direction);
    let total = sum(given.origin.high, given.point.high);
    outcomes[id.x] = Outcome(project(ray, given.point), vec4f(ray.right, 0.0), vec4f(ray.up, 0.0), total);
}";

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct PlaceOutcome {
    place: [f32; 4],
    right: [f32; 4],
    up: [f32; 4],
    sum: [[f32; 4]; 2],
}

#[test]
fn places_beside_a_ray_are_as_accurate_as_they_are_near() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(7);
    let cases: Vec<[[[f32; 4]; 2]; 3]> = (0..100_000)
        .map(|_| {
            let origin = random.direction() * random.within(0.0, 4.0);
            let direction = random.direction() * random.within(0.5, 2.0);
            let aside = random.direction() * 10f64.powf(random.within(-7.0, 0.0));
            [origin, direction, origin + direction * random.within(-2.0, 4.0) + aside]
                .map(|v| twice(v).map(|[x, y, z]| [x, y, z, 0.0]))
        })
        .collect();
    let variant = Variant { kind: Kind::Scalar, direct: false };
    let source = [&shader::prelude(&variant), shader::CELL, PLACE_TEST].join("\n");
    let outcomes: Vec<PlaceOutcome> = run(&gpu, &source, &[], &cases);
    let whole = |[high, low]: [[f32; 4]; 2]| {
        let [high, low] = [high, low].map(|v| DVec3::new(v[0].into(), v[1].into(), v[2].into()));
        high + low
    };
    for (case, got) in cases.iter().zip(&outcomes) {
        let high = |i: usize| whole([case[i][0], [0.0; 4]]);
        let exact = high(0) + high(2);
        assert!((whole(got.sum) - exact).length() <= 1e-13 * exact.length().max(1e-3), "{case:?}");
        let [origin, direction, point] = case.map(whole);
        let q = point - origin;
        let along = q.dot(direction) / direction.length_squared();
        let aside = q - direction * along;
        let [x, y, high, low] = got.place.map(f64::from);
        let [right, up] = [got.right, got.up].map(|v| whole([v, [0.0; 4]]));
        // What is not beside the ray leaves 2⁻¹² of itself before it is rounded.
        let near = 4e-7 * aside.length() + 2e-9;
        let (dx, dy) = ((x - aside.dot(right)).abs(), (y - aside.dot(up)).abs());
        let dt = ((high + low - along) * direction.length()).abs();
        let what = format!("{dx:e} {dy:e} {dt:e} of {near:e}: {case:?}");
        assert!(dx <= near && dy <= near && dt <= near, "{what}");
    }
}

const INTEGRAL_TEST: &str = "
fn most_work() -> u32 { return 0xffffffffu; }
struct Case { front: vec4f, back: vec4f, length: vec4f }
@group(1) @binding(0) var<storage, read> cases: array<Case>;
@group(1) @binding(1) var<storage, read_write> outcomes: array<vec4f>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&cases) { return; }
    light = vec4f(0.0, 0.0, 0.0, 1.0);
    add_segment(value_of(cases[id.x].front), value_of(cases[id.x].back), cases[id.x].length.x);
    outcomes[id.x] = light;
}";

#[test]
fn segments_are_integrated_as_in_f64() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(5);
    for (round, kind) in KINDS.into_iter().chain(KINDS).enumerate() {
        let transfer = random_transfer(&mut random, round % 2 == 1);
        let normal = [Normal { mid: 0.0, half: 1.0 }; 4];
        let (fast, slow) =
            (Exact::<f32>::new(&transfer, kind, &normal, 1.0), Exact::<f64>::new(&transfer, kind, &normal, 1.0));
        let places: Vec<f32> = fast.opacity.s.clone();
        let cases: Vec<[[f32; 4]; 3]> = (0..40_000)
            .map(|i| {
                let mut value = || match i % 4 {
                    0 => places[random.below(places.len())].clamp(-1.0, 1.0),
                    1 => 1e-4 * random.within(-1.0, 1.0) as f32,
                    _ => random.within(-1.0, 1.0) as f32,
                };
                let (front, mut back) = ([(); 4].map(|()| value()), [(); 4].map(|()| value()));
                if i % 7 == 0 {
                    back = front;
                }
                let rgb = |v: [f32; 4]| if kind == Kind::Rgba { [v[0].abs(), v[1].abs(), v[2].abs(), v[3]] } else { v };
                let length =
                    [0.0, 1e-7, 1.0][i % 3] * random.unit() as f32 + 10f64.powf(random.within(-9.0, 1.0)) as f32;
                [rgb(front), rgb(back), [length; 4]]
            })
            .collect();
        let value = match kind {
            Kind::Scalar => "v.x",
            Kind::Pair => "v.xy",
            Kind::Rgba => "v",
        };
        let variant = Variant { kind, direct: fast.direct };
        let convert = format!("fn value_of(v: vec4f) -> Value {{ return {value}; }}");
        let source = [&shader::prelude(&variant), &convert, shader::INTEGRAL, INTEGRAL_TEST].join("\n");
        let [function, knots, buckets] = function::upload(&gpu, &fast).unwrap();
        let group = [(Binding::Uniform, &function), (Binding::Read, &knots), (Binding::Read, &buckets)];
        let outcomes: Vec<[f32; 4]> = run(&gpu, &source, &group, &cases);
        for ([front, back, length], got) in cases.iter().zip(&outcomes) {
            let want = add(&slow, kind, front, back, length[0]);
            let twin = add_fast(&fast, kind, front, back, length[0]);
            for k in 0..4 {
                let (got, want) = (f64::from(got[k]), want[k]);
                // Where an end rounds across a step of the function, f32 itself differs from f64.
                let tolerance = 4e-6 * want.abs().max(1.0) + 2.0 * (f64::from(twin[k]) - want).abs();
                assert!((got - want).abs() <= tolerance, "{kind:?} {front:?} {back:?} {length:?}: {got}, not {want}");
            }
        }
    }
}

fn add(exact: &Exact<f64>, kind: Kind, front: &[f32; 4], back: &[f32; 4], length: f32) -> [f64; 4] {
    let mut light = Light::none();
    let (f, b, l) = (front.map(f64::from), back.map(f64::from), f64::from(length));
    match kind {
        Kind::Scalar => exact.add(&[f[0]], &[b[0]], l, &mut light),
        Kind::Pair => exact.add(&[f[0], f[1]], &[b[0], b[1]], l, &mut light),
        Kind::Rgba => exact.add(&f, &b, l, &mut light),
    }
    [light.color[0], light.color[1], light.color[2], light.through]
}

fn add_fast(exact: &Exact<f32>, kind: Kind, f: &[f32; 4], b: &[f32; 4], length: f32) -> [f32; 4] {
    let mut light = Light::none();
    match kind {
        Kind::Scalar => exact.add(&[f[0]], &[b[0]], length, &mut light),
        Kind::Pair => exact.add(&[f[0], f[1]], &[b[0], b[1]], length, &mut light),
        Kind::Rgba => exact.add(f, b, length, &mut light),
    }
    [light.color[0], light.color[1], light.color[2], light.through]
}

fn random_transfer(random: &mut Random, direct: bool) -> TransferFunction {
    // Ramps no steeper than values of 32 bits can tell.
    let mut places = |n: usize| {
        let mut places: Vec<f64> = (0..n).map(|_| random.within(-1.1, 1.1)).collect();
        places.sort_by(f64::total_cmp);
        places.into_iter().enumerate().map(|(i, s)| s + 0.02 * i as f64).collect::<Vec<f64>>()
    };
    let (colors, opacities) = (places(5), places(6));
    let color = colors.into_iter().map(|s| (s, [random.unit(), random.unit(), random.unit()])).collect();
    let mut opacity: Vec<_> = opacities.into_iter().map(|s| (s, (random.unit() * 1.5 - 0.5).max(0.0))).collect();
    // A step.
    opacity[3].0 = opacity[2].0;
    let convention = if random.below(2) == 0 { Convention::Extinction } else { Convention::Opacity };
    let emission = if direct { Emission::Direct { scale: random.within(0.2, 2.0) } } else { Emission::Chromatic };
    let distance = 10f64.powf(random.within(-1.5, 0.3));
    TransferFunction::new(color, opacity, distance)
        .unwrap()
        .with_convention(convention)
        .with_clamp(random.below(4) > 0)
        .with_emission(emission)
        .unwrap()
}

fn random_view(random: &mut Random, size: [u32; 2]) -> View {
    let focal_point = random.direction() * 0.3;
    let distance = [0.2, 1.5, 4.0, 6.0, 40.0][random.below(5)];
    let mut away = random.direction();
    if random.below(4) == 0 {
        // Along an axis, so that faces are seen edge-on.
        away = [DVec3::X, DVec3::NEG_Y, DVec3::Z][random.below(3)];
    }
    let projection = if random.below(3) == 0 {
        Projection::Parallel { parallel_scale: random.within(0.5, 2.0) }
    } else {
        let fit = 2.0 * (1.8f64 / distance).atan().to_degrees();
        Projection::Perspective { view_angle: fit.min(random.within(60.0, 110.0)) }
    };
    let camera =
        Camera { position: focal_point + away * distance, focal_point, view_up: random.direction(), projection };
    let mut view = View::new(camera, size).unwrap();
    if random.below(4) == 0 {
        view = view.with_clipping_range([distance * 0.8, distance * 1.1]).unwrap();
    }
    if random.below(4) == 0 {
        let plane = ClippingPlane { origin: random.direction() * 0.4, normal: random.direction() * 3.0 };
        view = view.with_clipping_planes(vec![plane]).unwrap();
    }
    if random.below(4) == 0 {
        let pixels = size[0] as usize * size[1] as usize;
        let kind = [DepthKind::Eye, DepthKind::Ray, DepthKind::Window][random.below(3)];
        let mut far = 1.0;
        if kind == DepthKind::Window {
            view = view.with_clipping_range([distance * 0.6, distance * 1.2]).unwrap();
        } else {
            far = distance + 0.5;
        }
        let values = (0..pixels).map(|_| far * random.within(0.5, 1.2)).collect();
        view = view.with_depth(DepthBuffer { kind, values }).unwrap();
    }
    view
}

/// `mesh` with arrays "scalar", "pair" and "rgba" at its points and cells; `change` may change the i-th value at points.
fn with_arrays(mesh: Mesh, change: impl Fn(usize, usize, f64) -> f64) -> Mesh {
    let fields = |p: DVec3| {
        let (x, y, z) = (p.x, p.y, p.z);
        [0.5 + 0.5 * (3.0 * x).sin(), 0.5 + 0.5 * (2.0 * y).cos(), 0.5 + 0.4 * z, (4.0 * x * y).sin()]
    };
    let array = |(name, n): (&str, usize), places: &[DVec3], change: &dyn Fn(usize, usize, f64) -> f64| {
        let values = places.iter().flat_map(|&p| fields(p).into_iter().skip(4 - n));
        let values = values.enumerate().map(|(i, v)| change(i, n, v)).collect();
        MeshArray { name: name.into(), components: n, values: MeshValues::F64(values) }
    };
    let (points, cells) = (mesh.points().to_vec(), mesh.cells().clone());
    let firsts: Vec<DVec3> = (0..cells.len()).map(|c| points[cells.points(c)[0] as usize]).collect();
    let names = [("scalar", 1), ("pair", 2), ("rgba", 4)];
    let at_points = names.map(|n| array(n, &points, &change)).to_vec();
    let at_cells = names.map(|n| array(n, &firsts, &|_, _, v| v)).to_vec();
    Mesh::new(points, cells, at_points, at_cells).unwrap()
}

fn plain(mesh: Mesh) -> Mesh {
    with_arrays(mesh, |_, _, v| v)
}

/// One of each kind, of random size, bent at random: points of one place stay together.
fn meshes(random: &mut Random) -> Vec<(&'static str, Mesh)> {
    let mut size = |least: usize, most: usize| least + random.below(most + 1 - least);
    let tetrahedra = generate::tetrahedra(size(4, 10));
    let hexahedra = generate::hexahedra(size(3, 7));
    let islands = generate::islands(size(9, 14));
    let parts = generate::unwelded(&generate::tetrahedra(size(3, 6)));
    let junction = generate::t_junction(size(2, 3));
    let ring = generate::ring(size(3, 11));
    let demo = generate::demo(size(4, 6));
    let holed = generate::hexahedra(size(4, 6));
    let [wave, phase] = [(); 2].map(|()| random.direction() * 3.0);
    let bend = random.direction() * random.within(0.0, 0.1);
    let bent = |mesh: Mesh| {
        let points = mesh.points().iter().map(|&p| p + bend * (wave.dot(p) + phase.x).sin()).collect();
        Mesh::new(points, mesh.cells().clone(), mesh.point_arrays().to_vec(), mesh.cell_arrays().to_vec()).unwrap()
    };
    vec![
        ("tetrahedra", plain(bent(tetrahedra))),
        ("hexahedra", plain(bent(hexahedra))),
        ("islands", plain(bent(islands))),
        ("unwelded", with_arrays(bent(parts), |i, n, v| v + 0.05 * ((i / (4 * n)) % 3) as f64)),
        ("t_junction", plain(bent(junction))),
        ("ring", plain(bent(ring))),
        ("demo", plain(bent(demo))),
        ("invalid values", with_arrays(bent(holed), |i, _, v| if i % 37 == 0 { f64::NAN } else { v })),
    ]
}

fn draw(renderer: &mut Renderer, view: &View) -> Image {
    renderer.render(view, &|_| ()).unwrap()
}

/// Draws `frames` frames of each of `rounds` times eight meshes on the device and on the CPU, and compares them. Where a ray grazes
/// the surface that a step of the function makes, the last digit of a value decides: one pixel in 100,000 may differ by more.
fn compare(rounds: usize, frames: usize, size: [u32; 2], seed: u64) {
    let Some(choice) = choice() else { return };
    let mut random = Random(seed);
    let (mut beyond, mut pixels) = (0, 0);
    let all: Vec<_> = (0..rounds).flat_map(|_| meshes(&mut random)).collect();
    for (name, mesh) in all {
        let mut pair = [choice.clone(), DeviceChoice::Cpu].map(|c| Renderer::with_device(0, c).unwrap());
        for r in &mut pair {
            r.set_mesh(&mesh, Tetrahedra::new(&mesh).unwrap());
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
        eprintln!("not run: HALITE_LONG is not set");
    }
    asked
}

#[test]
fn only_what_changed_is_handed_over() {
    let Some(choice) = choice() else { return };
    let mesh = plain(generate::tetrahedra(9));
    let mut random = Random(1);
    let mut renderer = Renderer::with_device(0, choice).unwrap();
    renderer.set_mesh(&mesh, Tetrahedra::new(&mesh).unwrap());
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
    assert_eq!(still, size_of::<Frame>() as u64, "a still frame needs its view only");
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
        renderer.set_mesh(mesh, Tetrahedra::new(mesh).unwrap());
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
    renderer.set_mesh(&mesh, Tetrahedra::new(&mesh).unwrap());
    renderer.set_field(&Field::new(&mesh, "scalar", None, Component::All).unwrap()).unwrap();
    renderer.set_transfer(&random_transfer(&mut random, false));
    let view = random_view(&mut random, [24, 24]);
    let before = draw(&mut renderer, &view);
    for _ in 0..3 {
        renderer.device().unwrap().gpu().device.destroy();
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
    renderer.set_mesh(&mesh, Tetrahedra::new(&mesh).unwrap());
    renderer.set_field(&Field::new(&mesh, "scalar", None, Component::All).unwrap()).unwrap();
    renderer.set_transfer(&random_transfer(&mut random, false));
    let view = random_view(&mut random, [24, 24]);
    renderer.device().unwrap().gpu.budget = 10_000;
    let refused = renderer.render(&view, &|_| ());
    assert!(matches!(refused, Err(Error::Memory { allowed: 10_000, .. })), "{refused:?}");
    renderer.device().unwrap().gpu.budget = 1 << 30;
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

#[test]
fn ten_million_tetrahedra_are_drawn() {
    if !is_long() {
        return;
    }
    let Some(choice) = choice() else { return };
    let mesh = generate::tetrahedra(119);
    let mut renderer = Renderer::with_device(0, choice).unwrap();
    renderer.set_mesh(&mesh, Tetrahedra::new(&mesh).unwrap());
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
    renderer.device().unwrap();
    renderer.draw_on_cpu(&Error::Render("to compare".into()));
    let want = draw(&mut renderer, &view);
    eprintln!("cpu {} ms", renderer.stats().frame_ms);
    let apart =
        got.pixels.iter().flatten().zip(want.pixels.iter().flatten()).fold(0.0, |m: f32, (g, w)| m.max((g - w).abs()));
    assert!(apart <= 2e-5, "{apart:e}");
}
