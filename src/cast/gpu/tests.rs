//! The device against f64, ray by ray.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stderr, reason = "tests")]

use super::*;
use crate::cast::Volume;
use crate::cast::lanes::tests::{Random, grid, transfer, typed, values, view};
use crate::cast::ray::one_by_one;
use crate::field::{Association, Component, Field, Kind};
use crate::gpu::{lines, testing};
use crate::grid::{Grid, Lattice};
use crate::integral::Exact;
use crate::mesh::{Array, Values};
use crate::transfer::TransferFunction;
use crate::view::{DepthBuffer, DepthKind, View};
use glam::{DMat3, DVec3};
use std::ops::ControlFlow;

/// What pictures may be off: f32 sums along rays.
const BOUND: f32 = 2e-5;

/// What is drawn.
struct Case {
    grid: Grid,
    field: Field,
    transfer: TransferFunction,
    view: View,
    how: Reconstruction,
}

impl Case {
    /// Draws it in some way.
    fn drawn<T>(&self, way: impl FnOnce(&Frame) -> T) -> T {
        let Case { grid, field, transfer, view, how } = self;
        let volume = Volume::new(grid).unwrap();
        let samples = Samples::new(&volume, field).unwrap();
        let normal = [0, 1, 2, 3].map(|k| field.normal(k));
        let exact = Exact::new(transfer, field.kind(), &normal, volume.scale);
        // Largest values are compared as such.
        let pixel = |v: &[f64]| {
            let mut pixel = [0.0; 4];
            v.iter().zip(&mut pixel).for_each(|(v, p)| *p = *v as f32);
            if field.kind() == Kind::Pair {
                // Of equally large ones, either's other value.
                pixel[0] = 0.0;
            }
            pixel
        };
        way(&Frame {
            volume: &volume,
            samples: &samples,
            exact: &exact,
            reconstruction: *how,
            table: None,
            view,
            pixel: &pixel,
            progress: &|_| ControlFlow::Continue(()),
        })
    }
}

/// The greatest difference between both ways, the greatest opacity, and the share of pixels that the CPU drew.
fn difference(gpu: &Gpu, caster: &mut Caster, case: &Case) -> [f32; 3] {
    caster.invalidate(Part::Mesh);
    case.drawn(|frame| {
        let Some(got) = caster.draw(gpu, frame).unwrap() else { return [0.0, 0.0, 1.0] };
        let visible = Visible::new(frame.exact, frame.samples.components);
        let seen = vec![true; frame.samples.seen(|_, _| true).len()];
        let (want, _) = one_by_one(frame, &visible, &seen);
        let pairs = got.pixels.as_flattened().iter().zip(want.as_flattened());
        let off = pairs.map(|(a, b)| if a.is_finite() { (a - b).abs() } else { f32::INFINITY }).fold(0.0, f32::max);
        let most = want.iter().fold(0.0, |most: f32, p| most.max(p[3]));
        [off, most, got.by_cpu as f32 / want.len() as f32]
    })
}

/// A grid with values of two or four components.
fn colored(random: &mut Random, of: usize) -> (Grid, Field, [f64; 2]) {
    let size = [0; 3].map(|_| 2 + random.below(12));
    let of_cells = random.below(4) == 0;
    let dimensions = if of_cells { size.map(|n| n - 1) } else { size };
    let count: usize = dimensions.iter().product();
    let mut plain = values(random, count * of, dimensions[0] * of, false);
    for k in 0..of {
        // The range of each is all there is.
        (plain[k], plain[(count - 1) * of + k]) = (0.0, 1.0);
    }
    let (values, ends) = match of {
        4 => (Values::U8(plain.iter().map(|v| (v * 255.0) as u8).collect()), [0.0, 255.0]),
        _ => typed(random, &plain),
    };
    let array = Array { name: "s".into(), components: of, values };
    let (points, cells) = if of_cells { (vec![], vec![array]) } else { (vec![array], vec![]) };
    let direction = DMat3::from_axis_angle(random.point(1.0).normalize(), random.within(-3.0, 3.0));
    let lattice =
        Lattice { origin: random.point(0.3), spacing: DVec3::new(0.1, 0.12, -0.09), direction, size, first: [0; 3] };
    let grid = Grid::regular(&lattice, points, cells).unwrap();
    let field = Field::new(&grid, "s", None, Component::All).unwrap();
    (grid, field, ends)
}

/// Depths at random, or none.
fn limited(random: &mut Random, view: View) -> View {
    if random.below(3) > 0 {
        return view;
    }
    let [w, h] = view.size();
    let values = (0..w * h).map(|_| random.within(3.0, 5.0)).collect();
    view.with_depth(DepthBuffer { kind: DepthKind::Ray, values }).unwrap()
}

fn case(random: &mut Random, of: usize) -> Case {
    let order = ReconstructionOrder::ALL[[0, 0, 0, 0, 1, 2, 3, 4, 5][random.below(9)]].1;
    let (grid, field, ends) =
        if of == 1 { grid(random, order == ReconstructionOrder::Exact) } else { colored(random, of) };
    let (transfer, mut view) = (transfer(random, ends), view(random));
    view = limited(random, view);
    if order == ReconstructionOrder::Exact && random.below(4) == 0 {
        view = view.with_blend(Blend::Maximum);
    }
    let step = random.within(0.01, 0.4);
    // The middle of a grid may be a face of cells, and then in both.
    let by_length = random.below(3) == 0 && field.association() == Association::Point;
    let sampling = if by_length { Sampling::Steps(step) } else { Sampling::Voxels };
    Case { grid, field, transfer, view, how: Reconstruction { order, sampling } }
}

/// Structures of the program, and what lies where in them.
#[test]
fn layouts_match_their_rust_twins() {
    let mut seen = std::collections::BTreeSet::new();
    for seed in 0..60 {
        let mut random = Random(seed * 7919 + 3);
        let of = [1, 2, 4][random.below(3)];
        case(&mut random, of).drawn(|frame| {
            let count = |(name, element)| ShaderArray { name, element, chunks: 1 + random.below(3), shift: 8 };
            let source = program(frame, frame.exact.curved.is_some(), &ARRAYS.map(count));
            let module = testing::validated(&source);
            for (name, size, twin) in [
                ("CastUniforms", size_of::<CastUniforms>(), frame::OFFSETS),
                ("Line", size_of::<lines::Line>(), lines::OFFSETS),
                ("Lines", size_of::<lines::Ends>(), lines::OFFSETS_OF_ENDS),
            ] {
                let (_, of) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name)).unwrap();
                let wgpu::naga::TypeInner::Struct { span, members } = &of.inner else { panic!("{name} is no struct") };
                assert_eq!(*span as usize, size, "{name}");
                let got: Vec<_> = members.iter().map(|m| (m.name.as_deref().unwrap(), m.offset as usize)).collect();
                assert_eq!(got, twin, "{name}");
            }
            seen.insert((frame.samples.components, frame.exact.direct, frame.exact.curved.is_some()));
        });
    }
    assert!(seen.len() > 8, "{seen:?}");
}

#[test]
fn a_device_draws_what_f64_draws() {
    let Some(gpu) = testing::gpu() else { return };
    let mut caster = Caster::default();
    let (mut shown, mut wrong, mut by_cpu) = (0, vec![], 0.0);
    let count = 60;
    for seed in 0..count {
        let mut random = Random(seed * 7919 + 3);
        let of = [1, 1, 1, 2, 4][random.below(5)];
        let case = case(&mut random, of);
        let [off, most, share] = difference(&gpu, &mut caster, &case);
        if off > BOUND {
            wrong.push(format!(
                "{seed}: {off:.1e}, {of} components, {:?}, {:?}, {:?}",
                case.how,
                case.view.blend(),
                case.transfer
            ));
        }
        shown += usize::from(most > 0.1);
        by_cpu += share / count as f32;
    }
    eprintln!("{shown} pictures show something; the CPU drew {by_cpu:.3} of the pixels");
    assert!(wrong.is_empty(), "{} are wrong:\n{}", wrong.len(), wrong.join("\n"));
    assert!(shown > 20, "{shown} pictures show something");
    assert!(by_cpu < 0.5, "the CPU drew {by_cpu} of the pixels");
}

/// Values, and what is hidden, in as many buffers as a device with small bindings needs.
#[test]
fn arrays_may_be_in_chunks() {
    let Some(mut gpu) = testing::gpu() else { return };
    let mut caster = Caster::default();
    let mut chunks = 0;
    for seed in 0..12 {
        let mut random = Random(seed * 104_729 + 5);
        let case = case(&mut random, if seed % 4 == 3 { 2 } else { 1 });
        gpu.binding = 1 << 30;
        let whole = {
            caster.invalidate(Part::Mesh);
            case.drawn(|frame| caster.draw(&gpu, frame).unwrap().map(|f| f.pixels))
        };
        gpu.binding = 4096;
        caster.invalidate(Part::Mesh);
        let parts = case.drawn(|frame| caster.draw(&gpu, frame).unwrap().map(|f| f.pixels));
        assert!(parts == whole, "{seed}");
        chunks = chunks.max(caster.bindings().into_iter().max().unwrap_or(0));
    }
    assert!(chunks > 1, "{chunks} chunks at most");
}
