//! Voxels in which the value meets a knot of the function, or much is absorbed: cut where it crosses knots, eight at a time.
//!
//! What waits is monotone along the ray, or on one line all along; so each is followed from line to line until none of the
//! eight has any more. Where f32 has too few digits, and where a piece is deep, f64 does the same by itself.

use super::Scene;
use super::corners::STEPS;
use super::lines::{FLAT, Line};
use super::walk::LANES;
use crate::integral::Light;
use crate::integral::cubic::Cubic;
use crate::integral::cubic::stretch::Stretch;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, mask32x8};

/// Stretches of a chunk: a step may have two.
pub(super) const SLOTS: usize = 2 * STEPS;

/// As many as can wait: a cubic has three monotone parts.
const ROOM: usize = 3 * LANES * SLOTS;

/// How near to a knot a root is.
const NEAR: f32 = 2e-7;

/// Transmittance of a stretch below which the rest of it is not seen.
const DARK: f32 = 1e-8;

/// After a step of Newton's this short, what is left is about its square.
const SHORT: f32 = 1e-3;

/// Light and opacity of stretches, and those that wait to be cut.
#[derive(Debug)]
pub(super) struct Cut {
    /// By slot: red, green, blue and opacity of each ray's stretch.
    pub(super) light: [[[f32; LANES]; 4]; SLOTS],
    /// Values as polynomials, from the constant on.
    a: [[f32; ROOM]; 4],
    length: [f32; ROOM],
    /// The lines they begin on.
    line: [u32; ROOM],
    slot: [u32; ROOM],
    ray: [u32; ROOM],
    count: usize,
}

impl Default for Cut {
    fn default() -> Self {
        let none = [0.0; ROOM];
        Cut {
            light: [[[0.0; LANES]; 4]; SLOTS],
            a: [none; 4],
            length: none,
            line: [0; ROOM],
            slot: [0; ROOM],
            ray: [0; ROOM],
            count: 0,
        }
    }
}

/// One value of each lane as a column.
#[inline(always)]
fn column<S: Simd>(simd: S, rows: [[f32; 4]; LANES]) -> [f32x8<S>; 4] {
    let flat = rows.as_flattened();
    let (mut low, mut high) = ([0.0; 16], [0.0; 16]);
    low.copy_from_slice(&flat[..16]);
    high.copy_from_slice(&flat[16..]);
    let (low, high) = (simd.load_four_interleaved_f32x4(&low), simd.load_four_interleaved_f32x4(&high));
    [low[0].combine(high[0]), low[1].combine(high[1]), low[2].combine(high[2]), low[3].combine(high[3])]
}

/// What f64 makes of a voxel.
#[inline(never)]
pub(super) fn exactly(scene: &Scene, value: &Cubic, length: f32) -> [f32; 4] {
    let mut light = Light::none();
    let shows = |i: usize| scene.visible.shows([i, i]);
    scene.frame.exact.add_cubic(value, f64::from(length), shows, &mut light);
    let [r, g, b] = light.color;
    [r, g, b, 1.0 - light.transmittance].map(|v| v as f32)
}

impl Cut {
    /// Takes the stretch of ray `ray` in `slot` along which the value is the polynomial `a`; `corners` gives the voxel's value
    /// as f64 has it. Says which line the ray is on behind it, if one can say.
    #[inline(never)]
    pub(super) fn meet(
        &mut self,
        scene: &Scene,
        [slot, ray]: [usize; 2],
        a: [f32; 4],
        length: f32,
        corners: impl FnOnce() -> Cubic,
    ) -> Option<usize> {
        let lines = &scene.lines;
        let third = 1.0 / 3.0;
        let b = [a[0], a[0] + a[1] * third, a[0] + (2.0 * a[1] + a[2]) * third, a[0] + a[1] + (a[2] + a[3])];
        let (low, high) = (b[0].min(b[1]).min(b[2].min(b[3])), b[0].max(b[1]).max(b[2].max(b[3])));
        if !b.iter().all(|v| v.is_finite()) {
            self.set(slot, ray, of_any(scene, &corners(), length));
            return None;
        }
        let between = lines.between(low, high);
        let behind = Some(lines.find(b[3]));
        if !lines.shows(between) {
            return behind;
        }
        if lines.is_narrow(between) || lines.is_stepped(between) && high - low < FLAT {
            self.set(slot, ray, of_any(scene, &corners(), length));
            return behind;
        }
        let (from, to) = (b[0].min(b[3]), b[0].max(b[3]));
        if between[0] == between[1] || from == low && to == high {
            self.wait([slot, ray], a, length, lines.find(a[0]));
            return behind;
        }
        let mut start = 0.0;
        for end in Cubic(b.map(f64::from)).turns().into_iter().chain([1.0]) {
            let end = end as f32;
            if end > start {
                let h = end - start;
                let bend = a[2] + 3.0 * start * a[3];
                let part = [
                    a[0] + start * (a[1] + start * (a[2] + start * a[3])),
                    h * (a[1] + start * (a[2] + bend)),
                    h * h * bend,
                    h * h * h * a[3],
                ];
                self.wait([slot, ray], part, length * h, lines.find(part[0]));
                start = end;
            }
        }
        behind
    }

    /// Has the stretch of a ray wait in a slot: the polynomial `a`, monotone or on `line` all along.
    pub(super) fn wait(&mut self, [slot, ray]: [usize; 2], a: [f32; 4], length: f32, line: usize) {
        let i = self.count.min(ROOM - 1);
        for k in 0..4 {
            self.a[k][i] = a[k];
        }
        (self.length[i], self.line[i], self.slot[i], self.ray[i]) = (length, line as u32, slot as u32, ray as u32);
        self.count = i + 1;
    }

    fn set(&mut self, slot: usize, ray: usize, light: [f32; 4]) {
        for k in 0..4 {
            self.light[slot][k][ray] = light[k];
        }
    }

    /// Puts a stretch behind what a slot holds.
    fn add(&mut self, slot: usize, ray: usize, light: [f32; 4]) {
        let of = &mut self.light[slot];
        let through = 1.0 - of[3][ray];
        for k in 0..4 {
            of[k][ray] += through * light[k];
        }
    }

    /// Cuts and integrates all that wait.
    #[inline(always)]
    pub(super) fn flush<S: Simd>(&mut self, simd: S, scene: &Scene) {
        let count = std::mem::take(&mut self.count).min(ROOM);
        // Lanes without a stretch hold nothing of earlier ones: what is there could show in when the others are done.
        for i in (count..count.next_multiple_of(LANES)).take(LANES) {
            self.a.iter_mut().for_each(|a| a[i] = 0.0);
            self.length[i] = 0.0;
        }
        for at in (0..count).step_by(LANES) {
            self.eight(simd, scene, at, (count - at).min(LANES));
        }
    }

    #[inline(always)]
    fn eight<S: Simd>(&mut self, simd: S, scene: &Scene, at: usize, count: usize) {
        let load = |v: &[f32; ROOM]| f32x8::from_slice(simd, &v[at..at + LANES]);
        let a = [load(&self.a[0]), load(&self.a[1]), load(&self.a[2]), load(&self.a[3])];
        let length = load(&self.length);
        let (zero, one) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 1.0));
        let mut line = [0; LANES];
        for l in 0..count {
            line[l] = self.line[at + l] as usize;
        }
        let last = a[0] + a[1] + (a[2] + a[3]);
        let rises = last.simd_gt(a[0]);
        let (mut u, mut s, mut on) = (zero, a[0], length.simd_gt(zero));
        let (mut color, mut alpha) = ([zero; 3], zero);
        loop {
            let rows = line.map(|i| scene.lines.all[i]);
            let value = column(simd, rows.map(|r: Line| r.value));
            let slope = column(simd, rows.map(|r: Line| r.slope));
            let [low, high, start, curve] = column(simd, rows.map(|r: Line| [r.low, r.high, r.start, r.curve]));
            let knot = rises.select(high, low);
            let crosses = on & ((rises & last.simd_gt(high)) | (!rises & last.simd_lt(low)));
            let to = if crosses.to_bitmask() == 0 {
                one
            } else {
                crosses.select(root(simd, &a, [u, s, last], knot, rises, crosses), one)
            };
            let are_curved = scene.lines.are_curved;
            let whole = Stretch { offset: s - start, rise: [a[1], a[2], a[3]], length, value, slope, curve };
            let (h, cut) = whole.shallow(simd, u, to - u, on, are_curved);
            let (part, direct) = (whole.part(simd, u, h), scene.frame.exact.direct);
            let light = if are_curved { part.integrate_logarithm(simd, direct) } else { part.integrate(simd, direct) };
            // What has no length that f32 could tell, and yet is deep, shows what it begins with.
            let behind = if cut == 0 { to } else { mask32x8::from_bitmask(simd, cut).select(u + h, to) };
            let stuck = on & mask32x8::from_bitmask(simd, cut) & behind.simd_le(u);
            let own = stuck.select(one, light.alpha);
            let through = one - alpha;
            for k in 0..3 {
                let shown = slope[k + 1].mul_add(s - start, value[k + 1]);
                let shown = if scene.frame.exact.direct { zero } else { shown };
                let sum = through.mul_add(stuck.select(shown, light.color[k]), color[k]);
                color[k] = on.select(sum, color[k]);
            }
            alpha = on.select(through.mul_add(own, alpha), alpha);
            let goes_on = (crosses | (on & mask32x8::from_bitmask(simd, cut)))
                & !stuck
                & (one - alpha).simd_gt(f32x8::splat(simd, DARK));
            let more = goes_on.to_bitmask();
            if more == 0 {
                break;
            }
            let (up, passes) = (rises.to_bitmask(), more & !cut);
            for l in 0..LANES {
                if passes >> l & 1 == 1 {
                    line[l] = if up >> l & 1 == 1 { line[l] + 1 } else { line[l].wrapping_sub(1) }
                        .min(scene.lines.all.len() - 1);
                }
            }
            let within = mask32x8::from_bitmask(simd, cut);
            let value = a[3].mul_add(behind, a[2]).mul_add(behind, a[1]).mul_add(behind, a[0]);
            (u, s, on) = (behind, within.select(value, knot), goes_on);
        }
        let light: [[f32; LANES]; 4] = [color[0].into(), color[1].into(), color[2].into(), alpha.into()];
        for l in 0..count {
            let i = at + l;
            let own = [light[0][l], light[1][l], light[2][l], light[3][l]];
            self.add(self.slot[i] as usize % SLOTS, self.ray[i] as usize % LANES, own);
        }
    }
}

/// What f64 makes of a voxel whose values may not be finite, which then is not seen.
fn of_any(scene: &Scene, value: &Cubic, length: f32) -> [f32; 4] {
    if value.0.iter().all(|v| v.is_finite()) { exactly(scene, value, length) } else { [0.0; 4] }
}

/// Where in [u, 1], over which they go monotonely from s to `last`, polynomials have the values `knot`, where they do.
#[inline(always)]
fn root<S: Simd>(
    simd: S,
    a: &[f32x8<S>; 4],
    [u, s, last]: [f32x8<S>; 3],
    knot: f32x8<S>,
    rises: mask32x8<S>,
    wanted: mask32x8<S>,
) -> f32x8<S> {
    let (zero, one) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 1.0));
    let (mut low, mut high) = (u, one);
    let share = ((knot - s) / (last - s)).max(zero).min(one);
    let mut x = (one - u).mul_add(share, u);
    for _ in 0..40 {
        let off = a[3].mul_add(x, a[2]).mul_add(x, a[1]).mul_add(x, a[0]) - knot;
        let before = (rises & off.simd_lt(zero)) | (!rises & off.simd_gt(zero));
        (low, high) = (before.select(x, low), before.select(high, x));
        let slope = (a[3] * 3.0).mul_add(x, a[2] * 2.0).mul_add(x, a[1]);
        let newton = x - off / slope;
        let inside = newton.simd_ge(low) & newton.simd_le(high);
        let there = off.abs().simd_le(f32x8::splat(simd, NEAR));
        let next = there.select(x, inside.select(newton, (low + high) * 0.5));
        let settled = there | (inside & (next - x).abs().simd_le(f32x8::splat(simd, SHORT)));
        x = next;
        if (wanted & !settled).to_bitmask() == 0 {
            break;
        }
    }
    x
}
