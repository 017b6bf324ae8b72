//! The fragments of WGSL against their Rust twins in f64.

use super::random::{Random, random_transfer};
use crate::cell::{Face, Projected};
use crate::field::{Kind, Normalization};
use crate::gpu::function::{Function, Knot};
use crate::gpu::rays::double_single;
use crate::gpu::testing::{gpu, validated};
use crate::integral::Light;
use crate::traverse::gpu::*;
use wgpu::BufferUsages as Usage;
use wgpu::naga;

const KINDS: [Kind; 3] = [Kind::Scalar, Kind::Pair, Kind::Rgba];

fn arrays(chunks: usize) -> Vec<ShaderArray> {
    ARRAYS.map(|(name, element)| ShaderArray { name, element, chunks, shift: 22 }).to_vec()
}

#[test]
fn every_program_is_valid() {
    for kind in KINDS {
        for (direct, chunks) in [(false, 1), (true, 3)] {
            for association in ["POINT", "CORNER", "CELL"] {
                for blend in [Blend::Composite, Blend::Maximum] {
                    validated(&program(&ShaderVariant { kind, direct }, association, blend, None, &arrays(chunks)));
                }
            }
        }
    }
}

#[test]
fn layouts_match_their_rust_twins() {
    use std::mem::offset_of;
    let variant = ShaderVariant { kind: Kind::Scalar, direct: false };
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
    check!("Counts", RawCounts, steps carry retraced panels);
    check!("RayUniforms", RayUniforms, origin direction size first_row rows near far planes has_ends leaves faces most_steps most_work);
    check("Point", 24, &[0, 8, 16]);
}

/// Runs a kernel over `cases`, whose bindings are 0 and, for as many results, 1 of group 1.
fn run<C: Pod, R: Pod>(gpu: &Gpu, source: &str, group_0: &[(Slot, &Buffer)], cases: &[C]) -> Vec<R> {
    let layouts = [
        raster::layout(gpu, Stages::COMPUTE, &group_0.iter().map(|g| g.0).collect::<Vec<_>>()),
        raster::layout(gpu, Stages::COMPUTE, &[Slot::Read, Slot::Write]),
    ];
    let layout = raster::pipeline_layout(gpu, &layouts.each_ref().map(Some));
    let pipeline = raster::compute(gpu, &raster::module(gpu, "test", source), "main", &layout);
    let size = (cases.len() * size_of::<R>()) as u64;
    let cases_buffer = Buffer::holding(gpu, "cases", cases, Usage::STORAGE).unwrap();
    let results = Buffer::new(gpu, "results", size, Usage::STORAGE | Usage::COPY_SRC).unwrap();
    let back = Buffer::new(gpu, "back", size, Usage::COPY_DST | Usage::MAP_READ).unwrap();
    let groups = [
        raster::group_of(gpu, &layouts[0], group_0.iter().map(|g| g.1)),
        raster::group_of(gpu, &layouts[1], [&cases_buffer, &results]),
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
    let variant = ShaderVariant { kind: Kind::Scalar, direct: false };
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

/// Faces seen edge-on are nothing but what products leave when they cancel.
#[test]
fn areas_are_as_accurate_as_they_are_small() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(5);
    let cases: Vec<[[f32; 4]; 4]> = (0..100_000)
        .map(|_| {
            let (line, off) = (random.direction(), 10f64.powf(random.within(-9.0, -3.0)));
            [(); 4].map(|()| {
                let (s, h) = (random.within(-1.0, 1.0), random.within(-off, off));
                [(s * line.x - h * line.y) as f32, (s * line.y + h * line.x) as f32, 0.0, 0.0]
            })
        })
        .collect();
    let variant = ShaderVariant { kind: Kind::Scalar, direct: false };
    let source = [&shader::prelude(&variant), shader::CELL, CELL_TEST].join("\n");
    let outcomes: Vec<Outcome> = run(&gpu, &source, &[], &cases);
    for (case, outcome) in cases.iter().zip(&outcomes) {
        let area = |a: [f32; 4], b: [f32; 4]| {
            let [ax, ay, bx, by] = [a[0], a[1], b[0], b[1]].map(f64::from);
            // Both products are exact.
            ax * by - ay * bx
        };
        let [a, b, c, _] = *case;
        let want = [area(b, c), area(c, a), area(a, b)];
        for (got, want) in outcome.areas.iter().zip(want) {
            assert!((f64::from(*got) - want).abs() <= 1e-6 * want.abs() + 1e-15, "{got:e}, not {want:e}: {case:?}");
        }
    }
}

const PLACE_TEST: &str = "
struct Case { origin: DoubleSingle, direction: DoubleSingle, point: DoubleSingle }
struct Outcome { place: vec4f, right: vec4f, up: vec4f, sum: DoubleSingle }
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
                .map(|v| double_single(v).map(|[x, y, z]| [x, y, z, 0.0]))
        })
        .collect();
    let variant = ShaderVariant { kind: Kind::Scalar, direct: false };
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
        let normal = [Normalization { mid: 0.0, half: 1.0 }; 4];
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
                let (mut front, mut back) = ([(); 4].map(|()| value()), [(); 4].map(|()| value()));
                if i % 7 == 0 {
                    back = front;
                }
                if i % 11 == 0 {
                    // An outlier, at one end or both.
                    let k = kind.components() - 1;
                    let outlier = 10f64.powf(random.within(0.0, 12.0)) as f32 * [1.0, -1.0][random.below(2)];
                    back[k] = outlier;
                    if i % 33 == 0 {
                        front[k] = -outlier * random.unit() as f32;
                    }
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
        let variant = ShaderVariant { kind, direct: fast.direct };
        let convert = format!("fn value_of(v: vec4f) -> Value {{ return {value}; }}");
        let source = [&shader::prelude(&variant), &convert, shader::INTEGRAL, INTEGRAL_TEST].join("\n");
        let [function, knots, buckets] = function::upload(&gpu, &fast).unwrap();
        let group = [(Slot::Uniform, &function), (Slot::Read, &knots), (Slot::Read, &buckets)];
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
    [light.color[0], light.color[1], light.color[2], light.transmittance]
}

fn add_fast(exact: &Exact<f32>, kind: Kind, f: &[f32; 4], b: &[f32; 4], length: f32) -> [f32; 4] {
    let mut light = Light::none();
    match kind {
        Kind::Scalar => exact.add(&[f[0]], &[b[0]], length, &mut light),
        Kind::Pair => exact.add(&[f[0], f[1]], &[b[0], b[1]], length, &mut light),
        Kind::Rgba => exact.add(f, b, length, &mut light),
    }
    [light.color[0], light.color[1], light.color[2], light.transmittance]
}
