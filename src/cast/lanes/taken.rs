//! What stretches of rays emit and absorb: in closed form while a ray is on one line of the function, else by way of
//! [`Cut`]. Each part of that is a loop of its own, so that the processor finds work that does not wait for its like.

use super::Scene;
use super::corners::STEPS;
use super::cut::{Cut, SLOTS};
use super::march::SLABS;
use super::passed::{Lanes, Passed, lanes, samples_of, stands_for};
use super::walk::LANES;
use crate::cast::reconstruction::ReconstructionOrder;
use crate::integral::cubic::stretch::{DEEPEST, Stretch};
use fearless_simd::Simd;
use fearless_simd::f32x8;
use fearless_simd::prelude::*;

/// The lines that eight rays are on.
#[derive(Debug)]
struct OnLines {
    number: [usize; LANES],
    inner: [Lanes; 2],
    start: Lanes,
    shows: Lanes,
    curve: Lanes,
    value: [Lanes; 4],
    slope: [Lanes; 4],
}

/// Stretches of a chunk, and what they do.
#[derive(Debug)]
pub(super) struct Taken {
    lines: OnLines,
    /// Values along them as polynomials, from the constant on, and their lengths, by slot.
    a: [[Lanes; 4]; SLOTS],
    length: [Lanes; SLOTS],
    /// Lengths, or 0 where it is cut.
    kept: [Lanes; SLOTS],
    pub(super) cut: Cut,
}

impl Default for Taken {
    fn default() -> Self {
        let none = [0.0; LANES];
        let lines = OnLines {
            number: [0; LANES],
            inner: [none; 2],
            start: none,
            shows: none,
            curve: none,
            value: [none; 4],
            slope: [none; 4],
        };
        Taken { lines, a: [[none; 4]; SLOTS], length: [none; SLOTS], kept: [none; SLOTS], cut: Cut::default() }
    }
}

impl OnLines {
    /// Has ray `l` be on no line.
    fn clear(&mut self, l: usize) {
        (self.inner[0][l], self.inner[1][l], self.shows[l]) = (f32::INFINITY, f32::NEG_INFINITY, 1.0);
    }

    fn set(&mut self, scene: &Scene, l: usize, number: usize) {
        let line = &scene.lines.all[number];
        self.number[l] = number;
        (self.inner[0][l], self.inner[1][l]) = (line.inner[0], line.inner[1]);
        (self.start[l], self.shows[l], self.curve[l]) = (line.start, line.shows, line.curve);
        for k in 0..4 {
            (self.value[k][l], self.slope[k][l]) = (line.value[k], line.slope[k]);
        }
    }
}

#[inline(always)]
fn four<S: Simd>(simd: S, rows: &[Lanes; 4]) -> [f32x8<S>; 4] {
    [lanes(simd, &rows[0]), lanes(simd, &rows[1]), lanes(simd, &rows[2]), lanes(simd, &rows[3])]
}

impl Taken {
    /// Has all rays be new.
    pub(super) fn clear(&mut self) {
        (0..LANES).for_each(|l| self.lines.clear(l));
    }

    /// Finds light and opacity of all that was passed.
    #[inline(always)]
    pub(super) fn take<S: Simd>(&mut self, simd: S, scene: &Scene, passed: &Passed) {
        let order = scene.frame.reconstruction.order;
        let parts = order.parts();
        let scale = f32x8::splat(simd, scene.frame.volume.scale as f32 / parts as f32);
        if scene.frame.table.is_some() {
            return self.look_up(simd, scene, passed);
        }
        let slots = if scene.step.is_some() {
            let mut front = passed.value(simd, scene, 0);
            for s in 0..SLABS {
                let (middle, back) = (passed.value(simd, scene, 2 * s + 1), passed.value(simd, scene, 2 * s + 2));
                let length = lanes(simd, &passed.slabs[s]) * scale;
                for part in 0..parts {
                    let a = stands_for(simd, order, part, [front, middle, back]);
                    self.keep(s * parts + part, a, length);
                }
                front = back;
            }
            SLABS * parts
        } else {
            for s in 0..passed.count.min(STEPS) {
                let cubic = passed.cubic(simd, scene, s);
                let length = lanes(simd, &passed.length[s]) * scale;
                if order == ReconstructionOrder::Exact {
                    self.keep(s, cubic, length);
                    continue;
                }
                for part in 0..parts {
                    let a = stands_for(simd, order, part, samples_of(simd, cubic));
                    self.keep(s * parts + part, a, length);
                }
            }
            passed.count * parts
        };
        let mut from = 0;
        while from < slots {
            let (to, met) = self.stay(simd, from, slots);
            let behind = (to + 1).min(slots);
            self.integrate(simd, scene, from, behind);
            if met != 0 {
                self.meet(scene, passed, to, met);
            }
            from = behind;
        }
        self.cut.flush(simd, scene);
    }

    /// Finds light and opacity of slabs in a table.
    #[inline(always)]
    fn look_up<S: Simd>(&mut self, simd: S, scene: &Scene, passed: &Passed) {
        let steps = scene.step.is_some();
        let mut front = passed.value(simd, scene, 0);
        for s in 0..if steps { SLABS } else { passed.count.min(STEPS) } {
            let (samples, length) = if steps {
                let (middle, back) = (passed.value(simd, scene, 2 * s + 1), passed.value(simd, scene, 2 * s + 2));
                let samples = [front, middle, back];
                front = back;
                (samples, passed.slabs[s])
            } else {
                (samples_of(simd, passed.cubic(simd, scene, s)), passed.length[s])
            };
            self.read(scene, s, samples.map(Into::into), length);
        }
    }

    /// Reads what the slabs of step `s` do.
    #[inline(never)]
    fn read(&mut self, scene: &Scene, s: usize, samples: [Lanes; 3], length: Lanes) {
        let Some(table) = &scene.frame.table else { return };
        let parts = scene.frame.reconstruction.order.parts();
        let scale = scene.frame.volume.scale / parts as f64;
        let [times, plus] = scene.back;
        for part in 0..parts {
            let light = &mut self.cut.light[(s * parts + part) % SLOTS];
            for l in 0..LANES {
                let own = if length[l] > 0.0 {
                    let samples = samples.map(|v| f64::from(v[l]) * times + plus);
                    table.part(samples, part, f64::from(length[l]) * scale)
                } else {
                    [0.0; 4]
                };
                (0..4).for_each(|k| light[k][l] = own[k]);
            }
        }
    }

    #[inline(always)]
    fn keep<S: Simd>(&mut self, slot: usize, a: [f32x8<S>; 4], length: f32x8<S>) {
        let slot = slot % SLOTS;
        for k in 0..4 {
            a[k].store_array(&mut self.a[slot][k]);
        }
        length.store_array(&mut self.length[slot]);
    }

    /// The first slot from one on, up to another, in which rays leave their lines, and their bits.
    #[inline(always)]
    fn stay<S: Simd>(&mut self, simd: S, from: usize, to: usize) -> (usize, u64) {
        let zero = f32x8::splat(simd, 0.0);
        let third = f32x8::splat(simd, 1.0 / 3.0);
        let (least, most) = (lanes(simd, &self.lines.inner[0]), lanes(simd, &self.lines.inner[1]));
        for slot in from..to.min(SLOTS) {
            let a = four(simd, &self.a[slot]);
            let length = lanes(simd, &self.length[slot]);
            // Bernstein coefficients.
            let b = a[1].mul_add(third, a[0]);
            let c = (a[1] + a[1] + a[2]).mul_add(third, a[0]);
            let d = (a[0] + a[1]) + (a[2] + a[3]);
            let (low, high) = (a[0].min(b).min(c.min(d)), a[0].max(b).max(c.max(d)));
            let within = low.simd_ge(least) & high.simd_le(most);
            within.select(length, zero).store_array(&mut self.kept[slot]);
            let met = (!within & length.simd_gt(zero)).to_bitmask();
            if met != 0 {
                return (slot, met);
            }
        }
        (to, 0)
    }

    /// Integrates what is kept in the slots from one up to another.
    #[inline(always)]
    fn integrate<S: Simd>(&mut self, simd: S, scene: &Scene, from: usize, to: usize) {
        let zero = f32x8::splat(simd, 0.0);
        if lanes(simd, &self.lines.shows).simd_gt(zero).to_bitmask() == 0 {
            self.cut.light[from..to].fill([[0.0; LANES]; 4]);
            return;
        }
        let direct = scene.frame.exact.direct;
        let (start, curve) = (lanes(simd, &self.lines.start), lanes(simd, &self.lines.curve));
        let (value, slope) = (four(simd, &self.lines.value), four(simd, &self.lines.slope));
        for slot in from..to.min(SLOTS) {
            let a = four(simd, &self.a[slot]);
            let length = lanes(simd, &self.kept[slot]);
            let stretch = Stretch { offset: a[0] - start, rise: [a[1], a[2], a[3]], length, value, slope, curve };
            let most = f32x8::splat(simd, DEEPEST);
            let (own, deep) = if scene.lines.are_curved {
                let own = stretch.integrate_logarithm(simd, direct);
                let deep = stretch.is_bent(simd) | own.depth.simd_gt(most);
                (own, deep)
            } else {
                let own = stretch.integrate(simd, direct);
                let deep = own.depth.simd_gt(most);
                (own, deep)
            };
            let done = length.simd_gt(zero) & !deep;
            let light = &mut self.cut.light[slot];
            for k in 0..3 {
                done.select(own.color[k], zero).store_array(&mut light[k]);
            }
            done.select(own.alpha, zero).store_array(&mut light[3]);
            let deep = (deep & length.simd_gt(zero)).to_bitmask();
            if deep != 0 {
                self.wait(slot, deep);
            }
        }
    }

    /// Has the rays of the bits `deep` wait, whose depths are too great, or values too bent for a logarithm.
    #[inline(never)]
    fn wait(&mut self, slot: usize, deep: u64) {
        let a = &self.a[slot];
        for l in (0..LANES).filter(|l| deep >> l & 1 == 1) {
            let polynomial = [a[0][l], a[1][l], a[2][l], a[3][l]];
            self.cut.wait([slot, l], polynomial, self.length[slot][l], self.lines.number[l]);
        }
    }

    /// Has the rays of the bits `met` cut, and finds the lines that they are on behind that.
    #[inline(never)]
    fn meet(&mut self, scene: &Scene, passed: &Passed, slot: usize, met: u64) {
        let order = scene.frame.reconstruction.order;
        let parts = order.parts();
        let a = &self.a[slot];
        for l in (0..LANES).filter(|l| met >> l & 1 == 1) {
            let value = || {
                let s = slot / parts;
                if scene.step.is_some() {
                    let samples = [2 * s, 2 * s + 1, 2 * s + 2].map(|s| passed.sample(scene, s, l));
                    return order.part(slot % parts, samples);
                }
                let cubic = passed.exactly(scene, s, l);
                match order {
                    ReconstructionOrder::Exact => cubic,
                    order => order.part(slot % parts, [cubic.0[0], cubic.at(0.5), cubic.0[3]]),
                }
            };
            let polynomial = [a[0][l], a[1][l], a[2][l], a[3][l]];
            match self.cut.meet(scene, [slot, l], polynomial, self.length[slot][l], value) {
                Some(line) => self.lines.set(scene, l, line),
                None => self.lines.clear(l),
            }
        }
    }
}
