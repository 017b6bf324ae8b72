//! What eight stretches of rays emit and absorb along which the value is a cubic on one line of the function.
//!
//! With the optical depth T(u) of what lies before u, a quartic in closed form, opacity is α = 1 − e^{−T(1)}. Of a value σ(u),
//! counted from where the stretch begins, the colour needs one integral more, by parts: ∫ σ dα = σ(1) α − ∫ σ′ (1 − e^{−T}) du.
//! Its integrand is 0 at the front and known at the back, so the Gauss–Lobatto rule of five points, exact where T is
//! small, takes three. Direct emission has ∫ e^{−T} and ∫ σ e^{−T} by the same rule.

#![allow(clippy::needless_range_loop, reason = "channels and lanes of several arrays are counted at once")]

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

/// Steps in which a depth of any size becomes a small one.
const TRIES: usize = 30;

/// Inner nodes in [0, 1], and weights, of the Gauss–Lobatto rule of five points, and the ends' weight.
const NODES: [f32; 3] = [0.172_673_16, 0.5, 0.827_326_84];
const WEIGHTS: [f32; 3] = [49.0 / 180.0, 16.0 / 45.0, 49.0 / 180.0];
const END: f32 = 1.0 / 20.0;

/// The same of Simpson's rule.
const MIDDLE: [f32; 1] = [0.5];
const WEIGHT: [f32; 1] = [2.0 / 3.0];
const OUTER: f32 = 1.0 / 6.0;

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
        let zero = of(simd, 0.0);
        let depth = (first + second + (third + fourth)).max(zero);
        let bend = b.abs() + c.abs();
        let bent = bend * scaled.abs() * (a.abs() + bend);
        let faint = depth.simd_le(of(simd, FAINT)) & bent.simd_le(of(simd, STRAIGHT));
        let taken = Taken { a, b, c, depth: [first, second, third, fourth], total: depth, direct };
        let [alpha, sum, moment] = if faint.to_bitmask() == (1 << LANES) - 1 {
            taken.by(simd, MIDDLE, WEIGHT, OUTER, &SHORT)
        } else if depth.simd_gt(of(simd, THIN)).to_bitmask() == 0 {
            taken.by(simd, NODES, WEIGHTS, END, &SERIES)
        } else {
            taken.by(simd, NODES, WEIGHTS, END, &[])
        };
        let (sum, moment) = if direct { (sum * self.length, moment * self.length) } else { (sum, moment) };
        let mut color = [zero; 3];
        // The value's integral, from the line's start.
        let moment = self.offset.mul_add(sum, moment);
        for k in 0..3 {
            color[k] = self.slope[k + 1].mul_add(moment, self.value[k + 1] * sum);
        }
        Light { depth, alpha, color }
    }
}

/// A value a u + b u² + c u³, and the coefficients, from that of u on, of the depth before u.
struct Taken<S: Simd> {
    a: f32x8<S>,
    b: f32x8<S>,
    c: f32x8<S>,
    depth: [f32x8<S>; 4],
    total: f32x8<S>,
    direct: bool,
}

impl<S: Simd> Taken<S> {
    /// Opacity; what is absorbed (chromatic), or comes through (direct); the value's integral over that: by a rule with these
    /// inner nodes and weights, and the ends' weight. The terms of 1 − e^{−x} over x, or none, where that is no series.
    #[inline(always)]
    fn by<const N: usize, const K: usize>(
        &self,
        simd: S,
        nodes: [f32; N],
        weights: [f32; N],
        end: f32,
        terms: &[f32; K],
    ) -> [f32x8<S>; 3] {
        let of = f32x8::splat;
        let zero = of(simd, 0.0);
        let [first, second, third, fourth] = self.depth;
        let (twice, thrice) = (self.b + self.b, self.c * 3.0);
        let alpha = absorbed(simd, self.total, terms);
        let (mut sum, mut moment) = (zero, zero);
        for k in 0..N {
            let (u, weight) = (of(simd, nodes[k]), of(simd, weights[k]));
            let before = (fourth.mul_add(u, third).mul_add(u, second).mul_add(u, first) * u).max(zero);
            let lost = absorbed(simd, before, terms) * weight;
            if self.direct {
                let passed = weight - lost;
                sum += passed;
                moment = passed.mul_add(self.c.mul_add(u, self.b).mul_add(u, self.a) * u, moment);
            } else {
                moment = lost.mul_add(thrice.mul_add(u, twice).mul_add(u, self.a), moment);
            }
        }
        let all = self.a + self.b + self.c;
        let end = of(simd, end);
        if self.direct {
            let last = end * (of(simd, 1.0) - alpha);
            return [alpha, sum + end + last, last.mul_add(all, moment)];
        }
        let last = (end * alpha).mul_add(thrice + twice + self.a, moment);
        [alpha, alpha, all.mul_add(alpha, zero - last)]
    }
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

/// The growth over a part `h` long from `u` on of polynomials, and how far the value's mean there is above that at `u`.
#[inline(always)]
pub(crate) fn part<S: Simd>(simd: S, a: &[f32x8<S>; 4], u: f32x8<S>, h: f32x8<S>) -> ([f32x8<S>; 3], f32x8<S>) {
    let bend = (u * a[3]).mul_add(f32x8::splat(simd, 3.0), a[2]);
    let rise = [h * u.mul_add(a[2] + bend, a[1]), h * h * bend, h * h * h * a[3]];
    (rise, rise[0] * (1.0 / 2.0) + rise[1] * (1.0 / 3.0) + rise[2] * (1.0 / 4.0))
}

/// How long the parts of pieces from `u` on, `h` long, are whose depths are up to [`DEEPEST`], and which of the lanes `on`
/// end before `h`, as bits. The values are `offset` above the line's start there; extinction is a line with this value
/// and slope.
#[inline(always)]
pub(crate) fn shallow<S: Simd>(
    simd: S,
    a: &[f32x8<S>; 4],
    [u, h, offset]: [f32x8<S>; 3],
    length: f32x8<S>,
    [value, slope]: [f32x8<S>; 2],
    on: mask32x8<S>,
) -> (f32x8<S>, u64) {
    let most = f32x8::splat(simd, DEEPEST);
    let (mut h, mut cut) = (h, 0);
    for _ in 0..TRIES {
        let (_, mean) = part(simd, a, u, h);
        let depth = slope.mul_add(offset + mean, value) * (length * h);
        let deep = on & depth.simd_gt(most);
        if deep.to_bitmask() == 0 {
            break;
        }
        cut |= deep.to_bitmask();
        // Right at once where extinction grows from 0; where it is even, in some such steps.
        let share = (f32x8::splat(simd, 0.8 * DEEPEST) / depth).sqrt();
        h = deep.select(h * share, h);
    }
    (h, cut)
}
