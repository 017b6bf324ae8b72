//! Steps from voxel to voxel of even axes, in f32: from where the rays are, so near that f32 does. After some steps they are
//! where f64 says again.

use super::walk::{LANES, Walker, Way, load, narrow};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, u32x8};

type Lanes = [f32; LANES];

/// Farther than any plane that a ray meets.
const NEVER: f32 = 1e30;

/// What makes no stretch of its own at a ray's end, of the way from plane to plane: some roundings of f32.
const SHORT: f32 = 4e-6;

/// Rays relative to where they began some steps ago, in voxels from the lower planes of the voxel they were in.
#[derive(Debug, Default)]
pub(super) struct Near {
    /// Where a ray began, its direction, and one over that.
    x: [Lanes; 3],
    d: [Lanes; 3],
    slope: [Lanes; 3],
    /// Where the lower planes of the voxel are that it is in, and the steps from plane to plane: −1, 0 or 1.
    low: [Lanes; 3],
    step: [Lanes; 3],
    /// How far behind the lower plane the first one is that comes next.
    ahead: [Lanes; 3],
    /// Where it meets the planes that come next, and how far apart these are.
    next: [Lanes; 3],
    width: [Lanes; 3],
    /// What the indices of values and of voxels grow by at a plane.
    strides: [[u32; LANES]; 3],
    voxel_strides: [[u32; LANES]; 3],
    index: [u32; LANES],
    voxel: [u32; LANES],
    t: Lanes,
    end: Lanes,
    short: Lanes,
}

/// What eight rays pass in a step: as `walk::Stretch`.
pub(super) struct NearStretch<S: Simd> {
    pub(super) index: u32x8<S>,
    pub(super) voxel: u32x8<S>,
    pub(super) start: [f32x8<S>; 3],
    pub(super) rise: [f32x8<S>; 3],
    pub(super) length: f32x8<S>,
    /// Rays that are at their end, as bits.
    pub(super) ended: u64,
}

impl Near {
    /// Begins where lane `l` of `walker` is.
    #[inline(never)]
    pub(super) fn begin(&mut self, walker: &Walker, way: &Way, l: usize) {
        let (t, end) = (walker.t[l], walker.end[l]);
        let (mut index, mut voxel) = (0.0, 0.0);
        for a in 0..3 {
            let (d, step) = (walker.d[a][l], walker.step[a][l]);
            let low = walker.plane[a][l] - walker.behind[a][l];
            let slope = (1.0 / d as f32).clamp(-NEVER, NEVER);
            (self.d[a][l], self.slope[a][l], self.width[a][l]) = (d as f32, slope, slope.abs());
            self.x[a][l] = (d * t + walker.o[a][l] - low) as f32;
            // A ray along the planes never meets what is so far.
            self.ahead[a][l] = if d == 0.0 { 4.0 } else { walker.behind[a][l] as f32 };
            self.next[a][l] = ((self.ahead[a][l] - self.x[a][l]) * slope).max(0.0);
            (self.low[a][l], self.step[a][l]) = (0.0, step as f32);
            self.strides[a][l] = (step * way.strides[a]) as i64 as u32;
            index += low * way.strides[a];
            if let Some(strides) = way.of_voxels {
                self.voxel_strides[a][l] = (step * strides[a]) as i64 as u32;
                voxel += low * strides[a];
            }
        }
        (self.index[l], self.voxel[l]) = (index as i64 as u32, voxel as i64 as u32);
        (self.t[l], self.end[l]) = (0.0, (end - t) as f32);
        self.short[l] = SHORT * self.width.iter().fold(NEVER, |least, width| least.min(width[l]));
    }

    /// Begins again where all lanes of `walker` are, in the same voxels.
    #[inline(always)]
    pub(super) fn begin_again<S: Simd>(&mut self, simd: S, walker: &Walker) {
        let zero = f32x8::splat(simd, 0.0);
        let (t, end) = (load(simd, &walker.t), load(simd, &walker.end));
        for a in 0..3 {
            let low = load(simd, &walker.plane[a]) - load(simd, &walker.behind[a]);
            let x = narrow(simd, load(simd, &walker.d[a]).mul_add(t, load(simd, &walker.o[a])) - low);
            let next = (lanes(simd, &self.ahead[a]) - x) * lanes(simd, &self.slope[a]);
            x.store_array(&mut self.x[a]);
            next.max(zero).store_array(&mut self.next[a]);
            zero.store_array(&mut self.low[a]);
        }
        zero.store_array(&mut self.t);
        narrow(simd, end - t).store_array(&mut self.end);
    }

    /// Has the lanes of `walker` be where this is.
    #[inline(always)]
    pub(super) fn finish<S: Simd>(&self, simd: S, walker: &mut Walker) {
        for a in 0..3 {
            let (first, second) = simd.widen_f32x8(lanes(simd, &self.low[a]));
            (load(simd, &walker.plane[a]) + first.combine(second)).store_array(&mut walker.plane[a]);
        }
        for l in 0..LANES {
            walker.t[l] = if self.t[l] >= self.end[l] { walker.end[l] } else { walker.t[l] + f64::from(self.t[l]) };
        }
    }

    /// Passes a voxel with each ray.
    #[inline(always)]
    pub(super) fn advance<S: Simd>(&mut self, simd: S, of_voxels: bool) -> NearStretch<S> {
        let zero = f32x8::splat(simd, 0.0);
        let none = u32x8::splat(simd, 0);
        let (from, end) = (lanes(simd, &self.t), lanes(simd, &self.end));
        let next = [lanes(simd, &self.next[0]), lanes(simd, &self.next[1]), lanes(simd, &self.next[2])];
        let plane = next[0].min(next[1]).min(next[2].min(end));
        // What would be left is a rounding's, in a voxel that may be beyond the grid.
        let to = (end - plane).simd_lt(lanes(simd, &self.short)).select(end, plane);
        let length = to - from;
        let (index, voxel) = (u32x8::load_array_ref(simd, &self.index), u32x8::load_array_ref(simd, &self.voxel));
        let (mut index_behind, mut voxel_behind) = (index, voxel);
        let (mut start, mut rise) = ([zero; 3], [zero; 3]);
        for a in 0..3 {
            // What is so small does not matter that it adds up.
            let passed = next[a].simd_le(to);
            (next[a] + passed.select(lanes(simd, &self.width[a]), zero)).store_array(&mut self.next[a]);
            let (d, low) = (lanes(simd, &self.d[a]), lanes(simd, &self.low[a]));
            start[a] = d.mul_add(from, lanes(simd, &self.x[a]) - low);
            rise[a] = d * length;
            (low + passed.select(lanes(simd, &self.step[a]), zero)).store_array(&mut self.low[a]);
            index_behind += passed.select(u32x8::load_array_ref(simd, &self.strides[a]), none);
            if of_voxels {
                voxel_behind += passed.select(u32x8::load_array_ref(simd, &self.voxel_strides[a]), none);
            }
        }
        index_behind.store_array(&mut self.index);
        voxel_behind.store_array(&mut self.voxel);
        to.store_array(&mut self.t);
        NearStretch { index, voxel, start, rise, length, ended: to.simd_ge(end).to_bitmask() }
    }
}

#[inline(always)]
fn lanes<S: Simd>(simd: S, row: &Lanes) -> f32x8<S> {
    f32x8::load_array_ref(simd, row)
}
