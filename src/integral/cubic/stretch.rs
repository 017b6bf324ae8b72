//! What eight stretches of rays emit and absorb along which the value is a cubic on one line of the function.
//!
//! With the optical depth T(u) of what lies before u, a quartic in closed form, opacity is α = 1 − e^{−T(1)}. Of a value σ(u),
//! counted from where the stretch begins, the colour needs one integral more, by parts: ∫ σ dα = σ(1) α − ∫ σ′ (1 − e^{−T}) du.
//! Its integrand is 0 at the front and known at the back, so the Gauss–Lobatto rule of five points, exact where T is
//! small, takes three. Direct emission has ∫ e^{−T} and ∫ σ e^{−T} by the same rule.
//!
//! Where opacity is a line of the value, extinction is the logarithm of one, τ₀ + s σ P(κ σ) with P(w) = −ln(1 − w)/w: it is
//! evaluated at the rule's points, and T(u) is the integral of the polynomial through these.

#![allow(clippy::needless_range_loop, reason = "channels and lanes of several arrays are counted at once")]

use crate::integral::MOST_OF_PART;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, mask32x8, u32x8};

/// Stretches side by side.
pub(crate) const LANES: usize = 8;

/// Optical depth up to which the series of e^{−T} holds.
const THIN: f32 = 0.25;

/// Optical depth up to which five points do.
pub(crate) const DEEPEST: f32 = 1.0;

/// Optical depth up to which Simpson's rule does, the Gauss–Lobatto rule of three points, if the value bends little: what
/// its bend times the change of depth is off by is below this times 0.015.
const FAINT: f32 = 0.1;
const STRAIGHT: f32 = 1e-6;

/// Terms of −ln(1 − w)/w for w up to a little above [`MOST_OF_PART`], to 1e-7 of itself.
pub(crate) const LOGARITHM: [f32; 8] =
    [1.0, 0.500_000_2, 0.333_297_95, 0.251_321, 0.181_874_4, 0.281_617_58, -0.211_392_15, 0.596_919_96];

/// By how much of itself what passes may change along a stretch at most, and the square of that times the part of its bend,
/// so that the polynomial through five points is the logarithm to 1e-6; and for three points.
pub(crate) const MOST: f32 = 0.5;
pub(crate) const MOST_BENT: f32 = 1e-3;
const LITTLE: f32 = 0.1;

/// Steps in which a depth of any size becomes a small one.
const TRIES: usize = 30;

/// Inner nodes in [0, 1], and weights, of the Gauss–Lobatto rule of five points, and the ends' weight.
pub(crate) const NODES: [f32; 3] = [0.172_673_16, 0.5, 0.827_326_84];
pub(crate) const WEIGHTS: [f32; 3] = [49.0 / 180.0, 16.0 / 45.0, 49.0 / 180.0];
pub(crate) const END: f32 = 1.0 / 20.0;

/// Integrals, from 0 to each inner node, of the polynomials that are 1 at one of the five points and 0 at the others.
pub(crate) const UP_TO: [[f32; 5]; 3] = [
    [0.067_728_43, 0.119_744_77, -0.021_735_722, 0.010_635_824, -0.003_700_139_2],
    [0.040_625, 0.303_184_18, 0.177_777_78, -0.030_961_96, 0.009_375],
    [0.053_700_14, 0.261_586_4, 0.377_291_3, 0.152_477_45, -0.017_728_432],
];

/// The same of Simpson's rule.
const MIDDLE: [f32; 1] = [0.5];
const WEIGHT: [f32; 1] = [2.0 / 3.0];
const OUTER: f32 = 1.0 / 6.0;
const UP_TO_MIDDLE: [f32; 3] = [5.0 / 24.0, 1.0 / 3.0, -1.0 / 24.0];

/// 1 − e^{−x} over x.
const SERIES: [f32; 6] = [1.0, -1.0 / 2.0, 1.0 / 6.0, -1.0 / 24.0, 1.0 / 120.0, -1.0 / 720.0];
const SHORT: [f32; 4] = [1.0, -1.0 / 2.0, 1.0 / 6.0, -1.0 / 24.0];

/// A stretch: its value is σ₀ + a₁ u + a₂ u² + a₃ u³ above the line's start.
pub(crate) struct Stretch<S: Simd> {
    pub(crate) offset: f32x8<S>,
    pub(crate) rise: [f32x8<S>; 3],
    pub(crate) length: f32x8<S>,
    /// Extinction and colour at the line's start, and their slopes.
    pub(crate) value: [f32x8<S>; 4],
    pub(crate) slope: [f32x8<S>; 4],
    /// Where extinction is the logarithm of a line: the share of what passes at the start that is lost by unit of the value.
    pub(crate) curve: f32x8<S>,
}

/// What it does: optical depth, opacity, light.
pub(crate) struct Light<S: Simd> {
    pub(crate) depth: f32x8<S>,
    pub(crate) alpha: f32x8<S>,
    pub(crate) color: [f32x8<S>; 3],
}

impl<S: Simd> Stretch<S> {
    /// Its integral, where its depth is up to [`DEEPEST`].
    #[inline(always)]
    pub(crate) fn integrate(&self, simd: S, direct: bool) -> Light<S> {
        let of = f32x8::splat;
        let [a, b, c] = self.rise;
        let scaled = self.length * self.slope[0];
        let first = scaled.mul_add(self.offset, self.length * self.value[0]);
        let second = scaled * a * of(simd, 1.0 / 2.0);
        let third = scaled * b * of(simd, 1.0 / 3.0);
        let fourth = scaled * c * of(simd, 1.0 / 4.0);
        let depth = (first + second + (third + fourth)).max(of(simd, 0.0));
        let bend = b.abs() + c.abs();
        let bent = bend * scaled.abs() * (a.abs() + bend);
        let faint = depth.simd_le(of(simd, FAINT)) & bent.simd_le(of(simd, STRAIGHT));
        let terms = [first, second, third, fourth];
        let sums = if faint.to_bitmask() == (1 << LANES) - 1 {
            self.by(simd, direct, MIDDLE, quartic(simd, terms, MIDDLE), depth, WEIGHT, OUTER, &SHORT)
        } else {
            self.by_five(simd, direct, quartic(simd, terms, NODES), depth)
        };
        self.light(direct, depth, sums)
    }

    /// Its integral where extinction is the logarithm of a line, and its depth is up to [`DEEPEST`], unless
    /// [`Self::is_bent`].
    #[inline(always)]
    pub(crate) fn integrate_logarithm(&self, simd: S, direct: bool) -> Light<S> {
        let of = f32x8::splat;
        let [a, b, c] = self.rise;
        let (front, middle, back) = (self.depth_by(simd, 0.0), self.depth_by(simd, 0.5), self.depth_by(simd, 1.0));
        let depth = (front + back).mul_add(of(simd, OUTER), middle * WEIGHT[0]);
        let (bend, change) = (b.abs() + c.abs(), self.change(simd));
        let bent = bend * (self.length * self.slope[0]).abs() * (a.abs() + bend);
        let faint = depth.simd_le(of(simd, FAINT))
            & bent.simd_le(of(simd, STRAIGHT))
            & (change[0] + change[1]).simd_le(of(simd, LITTLE));
        if faint.to_bitmask() == (1 << LANES) - 1 {
            let [x, y, z] = UP_TO_MIDDLE;
            let before = of(simd, x).mul_add(front, of(simd, y).mul_add(middle, back * z));
            let sums = self.by(simd, direct, MIDDLE, [before], depth, WEIGHT, OUTER, &SHORT);
            return self.light(direct, depth, sums);
        }
        let inner = [self.depth_by(simd, NODES[0]), middle, self.depth_by(simd, NODES[2])];
        let depth = (front + back).mul_add(of(simd, END), (inner[0] + inner[2]) * WEIGHTS[0] + middle * WEIGHTS[1]);
        let mut before = [depth; 3];
        for (before, [x, y, z, v, w]) in before.iter_mut().zip(UP_TO) {
            let near = of(simd, x).mul_add(front, of(simd, y).mul_add(inner[0], middle * z));
            *before = near + of(simd, v).mul_add(inner[2], back * w);
        }
        let sums = self.by_five(simd, direct, before, depth);
        self.light(direct, depth, sums)
    }

    /// Extinction at `u`, where it is the logarithm of a line, times the length.
    #[inline(always)]
    fn depth_by(&self, simd: S, u: f32) -> f32x8<S> {
        let (zero, u) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, u));
        let [a, b, c] = self.rise;
        let offset = c.mul_add(u, b).mul_add(u, a).mul_add(u, self.offset);
        let w = self.curve * offset;
        let mut sum = f32x8::splat(simd, LOGARITHM[LOGARITHM.len() - 1]);
        for k in (0..LOGARITHM.len() - 1).rev() {
            sum = sum.mul_add(w, f32x8::splat(simd, LOGARITHM[k]));
        }
        ((self.slope[0] * offset).mul_add(sum, self.value[0]) * self.length).max(zero)
    }

    /// By how much of itself what passes changes at most, as far as the value is linear, and as far as it is bent.
    #[inline(always)]
    fn change(&self, simd: S) -> [f32x8<S>; 2] {
        let [a, b, c] = self.rise;
        let share = self.curve.abs() * f32x8::splat(simd, (1.0 / (1.0 - MOST_OF_PART)) as f32);
        [share * a.abs(), share * (b.abs() + c.abs())]
    }

    /// Where the polynomial through five points is not its logarithm.
    #[inline(always)]
    pub(crate) fn is_bent(&self, simd: S) -> mask32x8<S> {
        let [even, bent] = self.change(simd);
        let all = even + bent;
        all.simd_gt(f32x8::splat(simd, MOST)) | (all * all * bent).simd_gt(f32x8::splat(simd, MOST_BENT))
    }

    /// The part of it that is `h` long, from `u` on, where the value is `offset` above the line's start.
    #[inline(always)]
    pub(crate) fn part(&self, simd: S, u: f32x8<S>, h: f32x8<S>) -> Self {
        let [a, b, c] = self.rise;
        let bend = (u * c).mul_add(f32x8::splat(simd, 3.0), b);
        let rise = [h * u.mul_add(b + bend, a), h * h * bend, h * h * h * c];
        Stretch { rise, length: self.length * h, ..*self }
    }

    /// How long the parts of stretches from `u` on, up to `h` long, are that can be integrated, and which of the lanes `on`
    /// end before `h`, as bits; the values at `u` are `offset` above the line's start.
    #[inline(always)]
    pub(crate) fn shallow(
        &self,
        simd: S,
        u: f32x8<S>,
        h: f32x8<S>,
        on: mask32x8<S>,
        is_curved: bool,
    ) -> (f32x8<S>, u64) {
        let of = f32x8::splat;
        let (mut h, mut cut) = (h, 0);
        for _ in 0..TRIES {
            let part = self.part(simd, u, h);
            let (depth, bent) = if is_curved {
                let (front, middle, back) =
                    (part.depth_by(simd, 0.0), part.depth_by(simd, 0.5), part.depth_by(simd, 1.0));
                ((front + back).mul_add(of(simd, OUTER), middle * WEIGHT[0]), part.is_bent(simd))
            } else {
                let [a, b, c] = part.rise;
                let mean = self.offset + (a * (1.0 / 2.0) + b * (1.0 / 3.0) + c * (1.0 / 4.0));
                (self.slope[0].mul_add(mean, self.value[0]) * part.length, mask32x8::from_bitmask(simd, 0))
            };
            let deep = on & (bent | depth.simd_gt(of(simd, DEEPEST)));
            if deep.to_bitmask() == 0 {
                break;
            }
            cut |= deep.to_bitmask();
            // Right at once where extinction grows from 0; where it is even, in some such steps.
            let share = (of(simd, 0.8 * DEEPEST) / depth).sqrt();
            let share = bent.select(share.min(of(simd, 0.5)), share);
            h = deep.select(h * share, h);
        }
        (h, cut)
    }

    /// Opacity, and two sums of what is taken, by the rule of five points: see [`Self::by`].
    #[inline(always)]
    fn by_five(&self, simd: S, direct: bool, before: [f32x8<S>; 3], depth: f32x8<S>) -> [f32x8<S>; 3] {
        if depth.simd_gt(f32x8::splat(simd, THIN)).to_bitmask() == 0 {
            self.by(simd, direct, NODES, before, depth, WEIGHTS, END, &SERIES)
        } else {
            self.by(simd, direct, NODES, before, depth, WEIGHTS, END, &[])
        }
    }

    /// Opacity; what is absorbed (chromatic), or comes through (direct); the value's integral over that: by a rule with these
    /// inner nodes, the depths before them and their weights, and the ends' weight. The terms of 1 − e^{−x} over x, or none,
    /// where that is no series.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "a rule's constants, each of a type of its own")]
    fn by<const N: usize, const K: usize>(
        &self,
        simd: S,
        direct: bool,
        nodes: [f32; N],
        before: [f32x8<S>; N],
        depth: f32x8<S>,
        weights: [f32; N],
        end: f32,
        terms: &[f32; K],
    ) -> [f32x8<S>; 3] {
        let of = f32x8::splat;
        let zero = of(simd, 0.0);
        let [a, b, c] = self.rise;
        let (twice, thrice) = (b + b, c * 3.0);
        let alpha = absorbed(simd, depth, terms);
        let (mut sum, mut moment) = (zero, zero);
        for k in 0..N {
            let (u, weight) = (of(simd, nodes[k]), of(simd, weights[k]));
            let lost = absorbed(simd, before[k].max(zero), terms) * weight;
            if direct {
                let passed = weight - lost;
                sum += passed;
                moment = passed.mul_add(c.mul_add(u, b).mul_add(u, a) * u, moment);
            } else {
                moment = lost.mul_add(thrice.mul_add(u, twice).mul_add(u, a), moment);
            }
        }
        let all = a + b + c;
        let end = of(simd, end);
        if direct {
            let last = end * (of(simd, 1.0) - alpha);
            return [alpha, sum + end + last, last.mul_add(all, moment)];
        }
        let last = (end * alpha).mul_add(thrice + twice + a, moment);
        [alpha, alpha, all.mul_add(alpha, zero - last)]
    }

    /// What it does, by opacity and the sums of [`Self::by`].
    #[inline(always)]
    fn light(&self, direct: bool, depth: f32x8<S>, [alpha, sum, moment]: [f32x8<S>; 3]) -> Light<S> {
        let (sum, moment) = if direct { (sum * self.length, moment * self.length) } else { (sum, moment) };
        // The value's integral, from the line's start.
        let moment = self.offset.mul_add(sum, moment);
        let mut color = [sum; 3];
        for k in 0..3 {
            color[k] = self.slope[k + 1].mul_add(moment, self.value[k + 1] * sum);
        }
        Light { depth, alpha, color }
    }
}

/// Polynomials without a constant term at the nodes.
#[inline(always)]
fn quartic<S: Simd, const N: usize>(simd: S, [a, b, c, d]: [f32x8<S>; 4], nodes: [f32; N]) -> [f32x8<S>; N] {
    let mut at = [a; N];
    for k in 0..N {
        let u = f32x8::splat(simd, nodes[k]);
        at[k] = d.mul_add(u, c).mul_add(u, b).mul_add(u, a) * u;
    }
    at
}

/// 1 − e^{−x}, to 1e-6 of itself: by a series with these terms, or, without, for any x.
#[inline(always)]
fn absorbed<S: Simd, const K: usize>(simd: S, x: f32x8<S>, terms: &[f32; K]) -> f32x8<S> {
    if K == 0 {
        let near = absorbed(simd, x, &SERIES);
        let far = f32x8::splat(simd, 1.0) - exp_of_minus(simd, x);
        return x.simd_gt(f32x8::splat(simd, THIN)).select(far, near);
    }
    let mut sum = f32x8::splat(simd, terms[K - 1]);
    for k in (0..K - 1).rev() {
        sum = sum.mul_add(x, f32x8::splat(simd, terms[k]));
    }
    sum * x
}

/// e^{−x} for x from 0 on; as `real::exp`.
#[inline(always)]
#[allow(clippy::excessive_precision, reason = "ln 2 in two parts: the first is exact in f32")]
fn exp_of_minus<S: Simd>(simd: S, x: f32x8<S>) -> f32x8<S> {
    const ROUND: f32 = 12_582_912.0;
    let of = f32x8::splat;
    let clamped = of(simd, 0.0) - x.min(of(simd, 87.0));
    let shifted = clamped.mul_add(of(simd, std::f32::consts::LOG2_E), of(simd, ROUND));
    let k = shifted - of(simd, ROUND);
    let r = (clamped - k * of(simd, 0.693_359_375)) - k * of(simd, -2.121_944_4e-4);
    let mut p = of(simd, 1.0 / 720.0);
    for c in [1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0] {
        p = p.mul_add(r, of(simd, c));
    }
    let bits: u32x8<S> = shifted.bitcast();
    let biased = bits - u32x8::splat(simd, ROUND.to_bits() - 127);
    let scale: f32x8<S> = (biased << 23).bitcast();
    p * scale
}

#[cfg(test)]
mod tests;
