//! A packet of eight rays, from where they enter the grid to where they leave it or nothing behind can be seen.

use super::Scene;
use super::corners::STEPS;
use super::march::{March, SLABS};
use super::near::Near;
use super::passed::{Lanes, Passed, lanes};
use super::taken::Taken;
use super::walk::{LANES, Ray, Runs, Walker, find_runs, load};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

/// Bits of all rays.
const ALL: u64 = (1 << LANES) - 1;

/// The rays of a packet, and what they pass in some steps.
#[derive(Debug, Default)]
pub(super) struct Packet {
    walker: Walker,
    near: Near,
    march: March,
    /// The parts of each ray to come, and the bits of rays that have some.
    runs: [Runs; LANES],
    more: u64,
    passed: Passed,
    taken: Taken,
    color: [Lanes; 3],
    through: Lanes,
    /// Voxels that rays passed.
    pub(super) steps: u64,
}

impl Packet {
    /// Follows rays; gives their premultiplied colours and opacities.
    #[inline(always)]
    pub(super) fn draw<S: Simd>(&mut self, simd: S, scene: &Scene, rays: &[Option<Ray>; LANES]) -> [[f32; 4]; LANES] {
        self.runs.iter_mut().for_each(Runs::clear);
        match &scene.blocks {
            Some((way, seen)) => find_runs(simd, &mut self.walker, way, rays, seen, &mut self.runs),
            None => {
                for (runs, ray) in self.runs.iter_mut().zip(rays) {
                    ray.iter().for_each(|ray| runs.add(ray.limits));
                }
            }
        }
        (self.color, self.through, self.more) = ([[0.0; LANES]; 3], [1.0; LANES], ALL);
        self.taken.clear();
        if let Some(step) = scene.step {
            (0..LANES).for_each(|l| self.march.set(l, &rays[l]));
            while self.march.go_on(step, &mut self.runs) {
                self.march.walk(simd, scene, step, &mut self.passed);
                self.passed.count = 2 * SLABS + 1;
                self.passed.fetch(scene);
                self.taken.take(simd, scene, &self.passed);
                self.steps += self.passed.slabs.as_flattened().iter().filter(|l| **l > 0.0).count() as u64;
                self.composite(simd, scene, SLABS);
            }
            return self.pixels();
        }
        for (l, ray) in rays.iter().enumerate() {
            self.walker.clear(l);
            if let Some(ray) = ray {
                self.walker.set(l, ray);
            }
        }
        self.go_on(scene, ALL);
        if scene.frame.volume.even {
            (0..LANES).for_each(|l| self.near.begin(&self.walker, &scene.voxels, l));
        }
        self.passed.count = scene.pace;
        while self.walker.t.iter().zip(&self.walker.end).any(|(t, end)| t < end) {
            self.walk(simd, scene);
            self.passed.fetch(scene);
            self.taken.take(simd, scene, &self.passed);
            self.composite(simd, scene, self.passed.count);
            self.passed.count = (2 * self.passed.count).min(STEPS);
        }
        self.pixels()
    }

    fn pixels(&self) -> [[f32; 4]; LANES] {
        std::array::from_fn(|l| [self.color[0][l], self.color[1][l], self.color[2][l], 1.0 - self.through[l]])
    }

    /// Has the rays of the bits `ended` start their next parts, where there are some; gives the bits of these.
    #[inline(never)]
    fn go_on(&mut self, scene: &Scene, ended: u64) -> u64 {
        let mut begun = 0;
        for l in (0..LANES).filter(|l| ended >> l & 1 == 1) {
            match self.runs[l].take() {
                Some(run) => {
                    self.walker.start(&scene.voxels, l, run);
                    begun |= 1 << l;
                }
                None => self.more &= !(1 << l),
            }
        }
        begun
    }

    /// Takes the steps of a chunk.
    #[inline(always)]
    fn walk<S: Simd>(&mut self, simd: S, scene: &Scene) {
        if scene.frame.volume.even {
            self.walk_near(simd, scene);
        } else {
            self.walk_far(simd, scene);
        }
        for length in &self.passed.length[..self.passed.count] {
            let there = lanes(simd, length).simd_gt(f32x8::splat(simd, 0.0));
            self.steps += u64::from(there.to_bitmask().count_ones());
        }
    }

    /// Along even axes.
    #[inline(always)]
    fn walk_near<S: Simd>(&mut self, simd: S, scene: &Scene) {
        let hides = scene.voxels.of_voxels.is_some();
        self.near.begin_again(simd, &self.walker);
        for s in 0..self.passed.count.min(STEPS) {
            let stretch = self.near.advance(simd, hides);
            let voxel = hides.then_some(stretch.voxel);
            self.passed.keep(scene, s, stretch.index, voxel, stretch.start, stretch.rise, stretch.length);
            if stretch.ended & self.more != 0 {
                let begun = self.go_on(scene, stretch.ended & self.more);
                for l in (0..LANES).filter(|l| begun >> l & 1 == 1) {
                    self.near.begin(&self.walker, &scene.voxels, l);
                }
            }
        }
        self.near.finish(simd, &mut self.walker);
    }

    /// Along any axes.
    #[inline(always)]
    fn walk_far<S: Simd>(&mut self, simd: S, scene: &Scene) {
        let hides = scene.voxels.of_voxels.is_some();
        for s in 0..self.passed.count.min(STEPS) {
            let stretch = self.walker.advance(simd, &scene.voxels);
            let voxel = hides.then_some(stretch.voxel);
            self.passed.keep(scene, s, stretch.index, voxel, stretch.start, stretch.rise, stretch.length);
            let ended = stretch.to.simd_ge(load(simd, &self.walker.end)).to_bitmask();
            if ended & self.more != 0 {
                self.go_on(scene, ended & self.more);
            }
        }
    }

    /// Adds what the stretches of `count` steps emit and absorb to the rays; those that let no light through end.
    #[inline(always)]
    fn composite<S: Simd>(&mut self, simd: S, scene: &Scene, count: usize) {
        let mut through = lanes(simd, &self.through);
        let mut color = [lanes(simd, &self.color[0]), lanes(simd, &self.color[1]), lanes(simd, &self.color[2])];
        let slots = count * scene.frame.reconstruction.order.parts();
        for light in &self.taken.cut.light[..slots] {
            for k in 0..3 {
                color[k] = through.mul_add(lanes(simd, &light[k]), color[k]);
            }
            through -= through * lanes(simd, &light[3]);
        }
        for k in 0..3 {
            color[k].store_array(&mut self.color[k]);
        }
        through.store_array(&mut self.through);
        let dark = through.simd_lt(f32x8::splat(simd, scene.least)).to_bitmask();
        for l in (0..LANES).filter(|l| dark >> l & 1 == 1) {
            self.runs[l].clear();
            self.more &= !(1 << l);
            self.walker.end[l] = self.walker.t[l];
            self.march.end(l);
        }
    }
}
