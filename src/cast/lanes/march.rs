//! Equal steps: samples along eight rays, three of which make a slab, and the first of each is the last of the one before.

use super::Scene;
use super::corners::STEPS;
use super::passed::Passed;
use super::walk::{LANES, Ray, Row, Runs, indices, load, narrow};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x8};

/// Slabs of a chunk.
pub(super) const SLABS: usize = (STEPS - 1) / 2;

/// Where eight rays are.
#[derive(Debug, Default)]
pub(super) struct March {
    o: [Row; 3],
    d: [Row; 3],
    /// Where they enter and leave the grid.
    enter: Row,
    leave: Row,
    /// The slab that comes next, and up to where something is seen.
    slab: Row,
    until: Row,
}

impl March {
    /// Has lane `l` follow a ray, if there is one.
    pub(super) fn set(&mut self, l: usize, ray: &Option<Ray>) {
        let ray = ray.unwrap_or(Ray { o: [0.0; 3], d: [0.0; 3], limits: [0.0; 2] });
        for a in 0..3 {
            (self.o[a][l], self.d[a][l]) = (ray.o[a], ray.d[a]);
        }
        [self.enter[l], self.leave[l]] = ray.limits;
        (self.slab[l], self.until[l]) = (0.0, ray.limits[0]);
    }

    /// Has the ray of lane `l` end.
    pub(super) fn end(&mut self, l: usize) {
        self.leave[l] = self.enter[l];
    }

    /// Takes rays that are behind what is seen of them to the next part that is; whether there is one of any.
    pub(super) fn go_on(&mut self, step: f64, runs: &mut [Runs; LANES]) -> bool {
        let mut any = false;
        for (l, runs) in runs.iter_mut().enumerate() {
            loop {
                let front = self.enter[l] + 2.0 * step * self.slab[l];
                if front >= self.leave[l] {
                    break;
                }
                if front < self.until[l] {
                    any = true;
                    break;
                }
                let Some([from, to]) = runs.take() else {
                    self.end(l);
                    break;
                };
                self.slab[l] = ((from - self.enter[l]) / (2.0 * step)).floor().max(self.slab[l]);
                self.until[l] = to;
            }
        }
        any
    }

    /// Takes the samples of [`SLABS`] slabs.
    #[inline(always)]
    pub(super) fn walk<S: Simd>(&mut self, simd: S, scene: &Scene, step: f64, passed: &mut Passed) {
        let (enter, leave) = (load(simd, &self.enter), load(simd, &self.leave));
        let (zero, long) = (f64x8::splat(simd, 0.0), f64x8::splat(simd, 2.0 * step));
        let slab = load(simd, &self.slab);
        let until = load(simd, &self.until).min(leave);
        let (mut front, mut count) = (slab.mul_add(long, enter).min(leave), zero);
        let one = f64x8::splat(simd, 1.0);
        for s in 0..SLABS {
            let back = (slab + (s + 1) as f64).mul_add(long, enter).min(leave);
            self.sample(simd, scene, 2 * s, front, passed);
            self.sample(simd, scene, 2 * s + 1, (front + back) * 0.5, passed);
            let seen = front.simd_lt(until);
            count += seen.select(one, zero);
            let length = seen.select(back - front, zero);
            narrow(simd, length).store_array(&mut passed.slabs[s]);
            front = back;
        }
        self.sample(simd, scene, 2 * SLABS, front, passed);
        // What is seen next may begin in a slab of these.
        (slab + count).store_array(&mut self.slab);
    }

    /// Takes the samples at `t` as step `s`.
    #[inline(always)]
    fn sample<S: Simd>(&self, simd: S, scene: &Scene, s: usize, t: f64x8<S>, passed: &mut Passed) {
        let way = &scene.voxels;
        let zero = f64x8::splat(simd, 0.0);
        let (mut index, mut voxel) = (way.first(simd), way.first(simd));
        let mut start = [narrow(simd, zero); 3];
        for a in 0..3 {
            let x = load(simd, &self.d[a]).mul_add(t, load(simd, &self.o[a]));
            let last = f64x8::splat(simd, (scene.frame.volume.cells[a] - 1) as f64);
            let low = x.floor().max(zero).min(last);
            index = low.mul_add(f64x8::splat(simd, way.strides[a]), index);
            if let Some(strides) = way.of_voxels {
                voxel = low.mul_add(f64x8::splat(simd, strides[a]), voxel);
            }
            let one = f64x8::splat(simd, 1.0);
            start[a] = narrow(simd, (x - low).max(zero).min(one));
        }
        let none = narrow(simd, zero);
        let voxel = way.of_voxels.map(|_| indices(simd, voxel));
        passed.keep(scene, s, indices(simd, index), voxel, start, [none; 3], none + 1.0);
    }
}
