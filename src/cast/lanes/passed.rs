//! What eight rays pass in some steps: where in which voxels, and the values along that.

use super::Scene;
use super::corners::{Pairs, STEPS, fetch, fetch_cells};
use super::march::SLABS;
use super::walk::LANES;
use crate::cast::reconstruction::ReconstructionOrder;
use crate::integral::cubic::{Cubic, trilinear};
use crate::mesh::with_values;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, i32x8, u32x8};

/// A number for each ray.
pub(super) type Lanes = [f32; LANES];

#[inline(always)]
pub(super) fn lanes<S: Simd>(simd: S, row: &Lanes) -> f32x8<S> {
    f32x8::load_array_ref(simd, row)
}

/// A chunk of steps.
#[derive(Debug)]
pub(super) struct Passed {
    start: [[Lanes; 3]; STEPS],
    rise: [[Lanes; 3]; STEPS],
    pub(super) length: [Lanes; STEPS],
    first: [[u32; LANES]; STEPS],
    pairs: Pairs,
    /// Lengths of slabs, if the steps are samples of such.
    pub(super) slabs: [Lanes; SLABS],
    /// How many there are.
    pub(super) count: usize,
}

impl Default for Passed {
    fn default() -> Self {
        let none = [0.0; LANES];
        Passed {
            start: [[none; 3]; STEPS],
            rise: [[none; 3]; STEPS],
            length: [none; STEPS],
            first: [[0; LANES]; STEPS],
            pairs: [[[0; LANES]; 4]; STEPS],
            slabs: [none; SLABS],
            count: 0,
        }
    }
}

impl Passed {
    /// Keeps what is passed in step `s`: the indices of the first values; where in the voxels it begins, how many of them
    /// it is wide, how long it is; and the voxels' own indices, if some are hidden.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "lanes of one thing each")]
    pub(super) fn keep<S: Simd>(
        &mut self,
        scene: &Scene,
        s: usize,
        index: u32x8<S>,
        voxel: Option<u32x8<S>>,
        start: [f32x8<S>; 3],
        rise: [f32x8<S>; 3],
        length: f32x8<S>,
    ) {
        for a in 0..3 {
            start[a].store_array(&mut self.start[s][a]);
            rise[a].store_array(&mut self.rise[s][a]);
        }
        length.store_array(&mut self.length[s]);
        index.store_array(&mut self.first[s]);
        if let Some(voxel) = voxel {
            let voxels: [u32; LANES] = voxel.into();
            for (l, voxel) in voxels.into_iter().enumerate() {
                if scene.frame.volume.is_hidden(voxel as usize) {
                    self.length[s][l] = 0.0;
                }
            }
        }
    }

    /// Fetches the values.
    pub(super) fn fetch(&mut self, scene: &Scene) {
        let samples = scene.frame.samples;
        let (map, first) = (&scene.lines.map, &self.first[..self.count]);
        with_values!(&*samples.values, v => {
            if samples.of_cells {
                fetch_cells(v, first, map, &mut self.pairs, &mut self.length);
            } else {
                fetch(v, first, scene.rows, map, &mut self.pairs, &mut self.length);
            }
        });
    }

    /// Values along the stretches of step `s`, as polynomials.
    #[inline(always)]
    pub(super) fn cubic<S: Simd>(&self, simd: S, scene: &Scene, s: usize) -> [f32x8<S>; 4] {
        let (x, e) = (&self.start[s], &self.rise[s]);
        let zero = f32x8::splat(simd, 0.0);
        let mid = f32x8::splat(simd, scene.map.mid as f32);
        let factor = f32x8::splat(simd, scene.map.factor as f32);
        let (mut p, mut q) = ([zero; 4], [zero; 4]);
        let (x0, e0) = (lanes(simd, &x[0]), lanes(simd, &e[0]));
        for r in 0..4 {
            let [front, back] = ends(simd, &self.pairs[s][r], scene.integers);
            let rise = (back - front) * factor;
            p[r] = rise.mul_add(x0, (front - mid) * factor);
            q[r] = rise * e0;
        }
        let (x1, e1) = (lanes(simd, &x[1]), lanes(simd, &e[1]));
        let (u, v) = (bilinear(p[0], p[1], q[0], q[1], x1, e1), bilinear(p[2], p[3], q[2], q[3], x1, e1));
        let (x2, e2) = (lanes(simd, &x[2]), lanes(simd, &e[2]));
        let h = [v[0] - u[0], v[1] - u[1], v[2] - u[2]];
        [
            h[0].mul_add(x2, u[0]),
            h[0].mul_add(e2, h[1].mul_add(x2, u[1])),
            h[1].mul_add(e2, h[2].mul_add(x2, u[2])),
            h[2] * e2,
        ]
    }

    /// Values at the samples of step `s`; NaN in what is hidden.
    #[inline(always)]
    pub(super) fn value<S: Simd>(&self, simd: S, scene: &Scene, s: usize) -> f32x8<S> {
        let x = three(simd, &self.start[s]);
        let mid = f32x8::splat(simd, scene.map.mid as f32);
        let factor = f32x8::splat(simd, scene.map.factor as f32);
        let mut p = [mid; 4];
        for r in 0..4 {
            let [front, back] = ends(simd, &self.pairs[s][r], scene.integers);
            p[r] = ((back - front) * factor).mul_add(x[0], (front - mid) * factor);
        }
        let (u, v) = ((p[1] - p[0]).mul_add(x[1], p[0]), (p[3] - p[2]).mul_add(x[1], p[2]));
        let there = lanes(simd, &self.length[s]).simd_gt(f32x8::splat(simd, 0.0));
        there.select((v - u).mul_add(x[2], u), f32x8::splat(simd, f32::NAN))
    }

    /// The value at ray `l`'s sample of step `s`, as f64 has it.
    pub(super) fn sample(&self, scene: &Scene, s: usize, l: usize) -> f64 {
        let samples = scene.frame.samples;
        let first = self.first[s][l] as usize;
        if self.length[s][l] == 0.0 {
            return f64::NAN;
        }
        if samples.of_cells {
            return samples.of_cell(first, 0);
        }
        trilinear(&samples.corners_from(first, 0), [0, 1, 2].map(|a| f64::from(self.start[s][a][l])))
    }

    /// The value that ray `l` passes in step `s`, as f64 has it. NaN beyond the grid, which a ray may leave a rounding
    /// before its end.
    pub(super) fn exactly(&self, scene: &Scene, s: usize, l: usize) -> Cubic {
        let samples = scene.frame.samples;
        let first = self.first[s][l] as usize;
        let last = if samples.of_cells { first } else { first + scene.rows[3] + 1 };
        if last >= samples.values.len() {
            return Cubic::constant(f64::NAN);
        }
        if samples.of_cells {
            return Cubic::constant(samples.of_cell(first, 0));
        }
        let (start, rise) = (&self.start[s], &self.rise[s]);
        let (p, q) = ([0, 1, 2].map(|a| start[a][l]), [0, 1, 2].map(|a| start[a][l] + rise[a][l]));
        Cubic::along(&samples.corners_from(first, 0), p.map(f64::from), q.map(f64::from))
    }
}

#[inline(always)]
fn three<S: Simd>(simd: S, rows: &[Lanes; 3]) -> [f32x8<S>; 3] {
    [lanes(simd, &rows[0]), lanes(simd, &rows[1]), lanes(simd, &rows[2])]
}

/// The first and the second values of pairs.
#[inline(always)]
fn ends<S: Simd>(simd: S, pairs: &[u64; LANES], integers: bool) -> [f32x8<S>; 2] {
    let (front, back) = if integers {
        let both: &[[i32; LANES]; 2] = bytemuck::cast_ref(pairs);
        let low = f32x8::float_from(i32x8::load_array_ref(simd, &both[0]));
        simd.deinterleave_f32x8(low, f32x8::float_from(i32x8::load_array_ref(simd, &both[1])))
    } else {
        let both: &[[f32; LANES]; 2] = bytemuck::cast_ref(pairs);
        simd.deinterleave_f32x8(f32x8::load_array_ref(simd, &both[0]), f32x8::load_array_ref(simd, &both[1]))
    };
    [front, back]
}

/// What is linear, p + q u, at both ends of an axis, where the place along it is x + e u.
#[inline(always)]
fn bilinear<S: Simd>(
    p0: f32x8<S>,
    p1: f32x8<S>,
    q0: f32x8<S>,
    q1: f32x8<S>,
    x: f32x8<S>,
    e: f32x8<S>,
) -> [f32x8<S>; 3] {
    let (p, q) = (p1 - p0, q1 - q0);
    [p.mul_add(x, p0), p.mul_add(e, q.mul_add(x, q0)), q * e]
}

/// The samples of a cubic: at its ends and midway.
#[inline(always)]
pub(super) fn samples_of<S: Simd>(simd: S, a: [f32x8<S>; 4]) -> [f32x8<S>; 3] {
    let half = f32x8::splat(simd, 0.5);
    [a[0], a[3].mul_add(half, a[2]).mul_add(half, a[1]).mul_add(half, a[0]), (a[0] + a[1]) + (a[2] + a[3])]
}

/// What stands for the values between three samples in a part of a slab: as [`ReconstructionOrder::part`].
#[inline(always)]
pub(super) fn stands_for<S: Simd>(
    simd: S,
    order: ReconstructionOrder,
    part: usize,
    [front, middle, back]: [f32x8<S>; 3],
) -> [f32x8<S>; 4] {
    let zero = f32x8::splat(simd, 0.0);
    let [from, to] = if part == 0 { [front, middle] } else { [middle, back] };
    match order {
        ReconstructionOrder::Exact | ReconstructionOrder::Two => {
            let bend = (front - middle) + (back - middle);
            [front, (back - front) - (bend + bend), bend + bend, zero]
        }
        ReconstructionOrder::One => [from, to - from, zero, zero],
        ReconstructionOrder::Midpoint => [middle, zero, zero, zero],
        ReconstructionOrder::Left => [from, zero, zero, zero],
        ReconstructionOrder::Right => [to, zero, zero, zero],
    }
}
