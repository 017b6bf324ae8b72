//! Lanes against f64, ray by ray: pictures of random grids, by random functions, from anywhere.

use super::super::ray::{Frame, Visible, one_by_one};
use super::super::{Reconstruction, ReconstructionOrder, Sampling};
use super::*;
use crate::cast::Samples;
use crate::field::{Association, Component, Field};
use crate::grid::{Grid, Lattice};
use crate::integral::Exact;
use crate::mesh::{Array, Values};
use crate::transfer::{Convention, Emission, TransferFunction};
use crate::view::{Camera, ClippingPlane, Projection, View};
use glam::{DMat3, DVec3};
use std::ops::ControlFlow;

/// What pictures may be off: f32 sums along rays.
const BOUND: f32 = 5e-6;

pub(in crate::cast) struct Random(pub(in crate::cast) u64);

impl Random {
    pub(in crate::cast) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(in crate::cast) fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    pub(in crate::cast) fn below(&mut self, n: usize) -> usize {
        (self.next() * n as f64) as usize
    }

    pub(in crate::cast) fn point(&mut self, most: f64) -> DVec3 {
        DVec3::new(self.within(-most, most), self.within(-most, most), self.within(-most, most))
    }
}

/// Values in [0, 1]: noise, a wave, or `plateaus`.
pub(in crate::cast) fn values(random: &mut Random, count: usize, row: usize, plateaus: bool) -> Vec<f64> {
    let (kind, long) = (random.below(if plateaus { 3 } else { 2 }), random.within(0.05, 0.6));
    (0..count)
        .map(|i| {
            let wave = 0.5 + 0.45 * ((i % row) as f64 * long + (i / row) as f64 * 0.37).sin();
            match kind {
                0 => random.next(),
                1 => wave,
                _ => (wave * 4.0).round() / 4.0,
            }
        })
        .collect()
}

/// The same in some type, and what 0 and 1 became.
pub(in crate::cast) fn typed(random: &mut Random, values: &[f64]) -> (Values, [f64; 2]) {
    let scaled = |low: f64, high: f64| values.iter().map(move |v| low + (high - low) * v);
    match random.below(7) {
        0 => (Values::U8(scaled(0.0, 255.0).map(|v| v as u8).collect()), [0.0, 255.0]),
        1 => (Values::I8(scaled(-100.0, 100.0).map(|v| v as i8).collect()), [-100.0, 100.0]),
        2 => (Values::U16(scaled(10.0, 60_000.0).map(|v| v as u16).collect()), [10.0, 60_000.0]),
        3 => (Values::I64(scaled(-1e15, 1e15).map(|v| v as i64).collect()), [-1e15, 1e15]),
        4 => (Values::F64(scaled(1.0, 1.0 + 1e-9).collect()), [1.0, 1.0 + 1e-9]),
        5 => (Values::F64(scaled(-2.0, 5.0).collect()), [-2.0, 5.0]),
        _ => (Values::F32(scaled(33.0, 277.0).map(|v| v as f32).collect()), [33.0, 277.0]),
    }
}

pub(in crate::cast) fn grid(random: &mut Random, plateaus: bool) -> (Grid, Field, [f64; 2]) {
    let size = [0; 3].map(|_| 2 + random.below(19));
    let of_cells = random.below(4) == 0;
    let dimensions = if of_cells { size.map(|n| n - 1) } else { size };
    let count = dimensions.iter().product();
    let mut plain = values(random, count, dimensions[0], plateaus);
    // Some value or other is left.
    (plain[0], plain[count - 1]) = (0.0, 1.0);
    let (mut values, ends) = typed(random, &plain);
    if let (Values::F32(v), true) = (&mut values, random.below(2) == 0) {
        for _ in 0..3 {
            let at = random.below(count);
            v[at] = f32::NAN;
        }
    }
    let array = Array { name: "s".into(), components: 1, values };
    let (mut points, mut cells) = if of_cells { (vec![], vec![array]) } else { (vec![array], vec![]) };
    if random.below(3) == 0 {
        let ghosts = (0..size.map(|n| n - 1).iter().product()).map(|_| u8::from(random.next() < 0.1)).collect();
        cells.push(Array { name: "vtkGhostType".into(), components: 1, values: Values::U8(ghosts) });
    }
    let direction = DMat3::from_axis_angle(random.point(1.0).normalize(), random.within(-3.0, 3.0));
    let spacing = DVec3::new(random.within(0.05, 0.2), random.within(-0.2, -0.05), random.within(0.05, 0.2));
    let lattice = Lattice { origin: random.point(0.3), spacing, direction, size, first: [-3, 5, 0] };
    let grid = if random.below(3) > 0 {
        Grid::regular(&lattice, std::mem::take(&mut points), std::mem::take(&mut cells))
    } else {
        let axes = size.map(|n| {
            let mut at = -0.5;
            (0..n)
                .map(|_| {
                    at += random.within(0.02, 0.2);
                    at
                })
                .collect()
        });
        Grid::rectilinear(axes, std::mem::take(&mut points), std::mem::take(&mut cells))
    };
    let grid = grid.unwrap();
    let field = Field::new(&grid, "s", None, Component::Index(0)).unwrap();
    assert_eq!(field.association() == Association::Cell, of_cells);
    (grid, field, ends)
}

pub(in crate::cast) fn transfer(random: &mut Random, [low, high]: [f64; 2]) -> TransferFunction {
    let place = |u: f64| low + (high - low) * u;
    let count = 2 + random.below(9);
    let mut places: Vec<f64> = (0..count).map(|_| random.within(-0.1, 1.1)).collect();
    places.sort_by(f64::total_cmp);
    // Steps, narrow ramps, and knots where plateaus are.
    for i in 1..count {
        match random.below(8) {
            0 => places[i] = places[i - 1],
            1 => places[i] = places[i - 1] + 1e-5,
            2 => places[i] = places[i - 1].max((places[i] * 4.0).round() / 4.0),
            _ => {}
        }
    }
    places.sort_by(f64::total_cmp);
    let most = [0.05, 0.4, 1.0][random.below(3)];
    let mut alpha = |_| if random.below(3) == 0 { 0.0 } else { random.within(0.0, most) };
    let opacity: Vec<(f64, f64)> = places.iter().enumerate().map(|(i, u)| (place(*u), alpha(i))).collect();
    let color =
        (0..3).map(|k| (place(f64::from(k) * 0.4), [random.next(), random.next(), random.next()])).collect::<Vec<_>>();
    let unit = [0.02, 0.2, 1.0][random.below(3)];
    let transfer = TransferFunction::new(color, opacity, unit).unwrap().with_clamp(random.below(4) > 0);
    let transfer = if random.below(4) == 0 { transfer.with_convention(Convention::Opacity) } else { transfer };
    if random.below(4) == 0 { transfer.with_emission(Emission::Direct { scale: 0.5 }).unwrap() } else { transfer }
}

pub(in crate::cast) fn view(random: &mut Random) -> View {
    let inside = random.below(4) == 0;
    let position = if inside { random.point(0.3) } else { random.point(1.0).normalize() * 4.0 };
    // Along the axes of what is not turned, too.
    let position = if random.below(4) == 0 { DVec3::Z * 4.0 } else { position };
    let projection = if random.below(3) == 0 {
        Projection::Parallel { parallel_scale: 1.0 }
    } else {
        Projection::Perspective { view_angle: 40.0 }
    };
    let camera = Camera { position, focal_point: random.point(0.2), view_up: DVec3::new(0.1, 1.0, 0.2), projection };
    let view = View::new(camera, [13, 11]).unwrap();
    if random.below(3) == 0 {
        let plane = ClippingPlane { origin: random.point(0.2), normal: random.point(1.0) };
        return view.with_clipping_planes(vec![plane]).unwrap();
    }
    view
}

/// Draws a frame in some way: what is seen of it is known then.
pub(in crate::cast) fn drawn<T>(
    (grid, field): (&Grid, &Field),
    transfer: &TransferFunction,
    view: &View,
    how: Reconstruction,
    way: impl FnOnce(&Frame, &Visible, &[bool]) -> T,
) -> T {
    let volume = Volume::new(grid).unwrap();
    let samples = Samples::new(&volume, field).unwrap();
    let normal = [0, 1, 2, 3].map(|k| field.normal(k));
    let exact = Exact::new(transfer, field.kind(), &normal, volume.scale);
    let frame = Frame {
        volume: &volume,
        samples: &samples,
        exact: &exact,
        reconstruction: how,
        table: None,
        view,
        pixel: &|_| [0.0; 4],
        progress: &|_| ControlFlow::Continue(()),
    };
    let visible = Visible::new(&exact, 1);
    let seen = frame.samples.seen(|low, high| visible.shows(exact.opacity.intervals(low, high)));
    way(&frame, &visible, &seen)
}

/// The greatest difference of both ways, and the greatest opacity.
fn difference(grid: &Grid, field: &Field, transfer: &TransferFunction, view: &View, how: Reconstruction) -> [f32; 2] {
    drawn((grid, field), transfer, view, how, |frame, visible, seen| {
        let Some((got, _)) = render(frame, visible, seen) else { return [0.0; 2] };
        let (want, _) = one_by_one(frame, visible, &vec![true; seen.len()]);
        let pairs = got.as_flattened().iter().zip(want.as_flattened());
        let off = pairs.map(|(a, b)| if a.is_finite() { (a - b).abs() } else { f32::INFINITY }).fold(0.0, f32::max);
        [off, want.iter().fold(0.0, |most, p| most.max(p[3]))]
    })
}

/// A thread draws packet after packet in the same memory: nothing of an earlier one may show in a later one.
#[test]
fn bits_do_not_depend_on_threads() {
    let pools = [1, 2, 7].map(|n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap());
    let mut shown = 0;
    for seed in 0..150_u64 {
        let mut random = Random(seed * 104_729 + 7);
        let (grid, field, ends) = grid(&mut random, true);
        let (transfer, view) = (transfer(&mut random, ends), view(&mut random));
        let order = ReconstructionOrder::ALL[random.below(ReconstructionOrder::ALL.len())].1;
        let sampling = if seed % 3 == 0 { Sampling::Steps(0.07) } else { Sampling::Voxels };
        let how = Reconstruction { order, sampling };
        let bits = pools.each_ref().map(|pool| {
            pool.install(|| {
                drawn((&grid, &field), &transfer, &view, how, |frame, visible, seen| {
                    let pixels = render(frame, visible, seen).map_or(vec![], |(pixels, _)| pixels);
                    pixels.as_flattened().iter().map(|v| v.to_bits()).collect::<Vec<_>>()
                })
            })
        });
        shown += usize::from(bits[0].iter().any(|b| *b != 0));
        assert!(bits[1] == bits[0] && bits[2] == bits[0], "{seed}: {how:?}");
    }
    assert!(shown > 80, "{shown} pictures show something");
}

#[test]
fn lanes_draw_what_f64_draws() {
    let (mut shown, mut wrong) = (0, vec![]);
    for seed in 0..400 {
        let mut random = Random(seed * 7919 + 1);
        let order = ReconstructionOrder::ALL[[0, 0, 0, 1, 2, 3, 4, 5][random.below(8)]].1;
        // A sample on a face of a plateau is at once on both sides of a step there, by a rounding.
        let (grid, field, ends) = grid(&mut random, order == ReconstructionOrder::Exact);
        let (transfer, view) = (transfer(&mut random, ends), view(&mut random));
        let step = random.within(0.01, 0.4);
        // The middle of a grid may be a face of cells, and then in both.
        let by_length = random.below(3) == 0 && field.association() == Association::Point;
        let sampling = if by_length { Sampling::Steps(step) } else { Sampling::Voxels };
        let how = Reconstruction { order, sampling };
        let [off, most] = difference(&grid, &field, &transfer, &view, how);
        if off > BOUND {
            wrong.push(format!("{seed}: {off:.1e}, {order:?}, {transfer:?}"));
        }
        shown += usize::from(most > 0.1);
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(shown > 200, "{shown} pictures show something");
}
