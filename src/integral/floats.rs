//! Sixteen places of rays side by side, and functions of them.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, i32x16, u32x16};

/// As wide as the widest instructions: others do it in parts, with the same result.
pub(crate) const LANES: usize = 16;
pub(crate) type Floats<S> = f32x16<S>;

/// c₀ + c₁ x + c₂ x² + …
#[inline(always)]
pub(crate) fn series<S: Simd, const K: usize>(simd: S, x: Floats<S>, c: &[f32; K]) -> Floats<S> {
    let mut sum = Floats::splat(simd, c[K - 1]);
    for k in (0..K - 1).rev() {
        sum = x.mul_add(sum, Floats::splat(simd, c[k]));
    }
    sum
}

/// eˣ for x ≤ 0, or little more: `real::exp`.
#[inline(always)]
#[allow(clippy::excessive_precision, reason = "ln 2 in two parts: the first is exact in f32")]
pub(crate) fn exp<S: Simd>(simd: S, x: Floats<S>) -> Floats<S> {
    const ROUND: f32 = 12_582_912.0;
    let of = |v: f32| Floats::splat(simd, v);
    let clamped = x.max(of(-87.0));
    let shifted = clamped * std::f32::consts::LOG2_E + ROUND;
    let k = shifted - ROUND;
    let r = (clamped - k * 0.693_359_375) - k * -2.121_944_4e-4;
    let mut p = of(1.0 / 5040.0);
    for c in [1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0] {
        p = p * r + of(c);
    }
    let bits: u32x16<S> = shifted.bitcast();
    let biased = bits - u32x16::splat(simd, ROUND.to_bits() - 127);
    let scale: Floats<S> = (biased << 23).bitcast();
    x.simd_lt(of(-87.0)).select(of(0.0), p * scale)
}

/// e^{−d} for d from 0 to [`FAINT`], to 1e-7.
#[inline(always)]
pub(crate) fn faded<S: Simd>(simd: S, d: Floats<S>) -> Floats<S> {
    const SERIES: [f32; 8] = [1.0, -1.0, 1.0 / 2.0, -1.0 / 6.0, 1.0 / 24.0, -1.0 / 120.0, 1.0 / 720.0, -1.0 / 5040.0];
    series(simd, d, &SERIES)
}

/// Optical depth up to which short series hold.
pub(crate) const FAINT: f32 = 0.5;

/// 1 − e^{−d} for d from 0 to [`FAINT`], to 1e-6 of itself.
#[inline(always)]
pub(crate) fn faint_opacity<S: Simd>(simd: S, d: Floats<S>) -> Floats<S> {
    const SERIES: [f32; 7] = [1.0, -1.0 / 2.0, 1.0 / 6.0, -1.0 / 24.0, 1.0 / 120.0, -1.0 / 720.0, 1.0 / 5040.0];
    d * series(simd, d, &SERIES)
}

/// 1 − e^{−d} for d ≥ 0, to 1e-6 of itself.
#[inline(always)]
pub(crate) fn opacity<S: Simd>(simd: S, d: Floats<S>) -> Floats<S> {
    let most = Floats::splat(simd, FAINT);
    let near = faint_opacity(simd, d.min(most));
    let deep = d.simd_gt(most);
    if deep.to_bitmask() == 0 {
        return near;
    }
    deep.select(Floats::splat(simd, 1.0) - exp(simd, d * -1.0), near)
}

/// erf x, to 5e-7.
#[inline(always)]
pub(crate) fn erf<S: Simd>(simd: S, x: Floats<S>) -> Floats<S> {
    // Abramowitz & Stegun, 7.1.26.
    const SERIES: [f32; 5] = [0.254_829_6, -0.284_496_74, 1.421_413_7, -1.453_152, 1.061_405_4];
    let (one, size) = (Floats::splat(simd, 1.0), x.abs());
    let t = one / size.mul_add(Floats::splat(simd, 0.327_591_1), one);
    let rest = t * series(simd, t, &SERIES) * exp(simd, size * size * -1.0);
    (one - rest).copysign(x)
}

/// ln x for x > 0 that is no denormal number.
#[inline(always)]
#[allow(clippy::excessive_precision, reason = "ln 2 in two parts: the first is exact in f32")]
pub(crate) fn ln<S: Simd>(simd: S, x: Floats<S>) -> Floats<S> {
    // √½ · 2ᵏ ≤ x < √2 · 2ᵏ.
    const ROOT: u32 = 0x3f35_04f3;
    const SERIES: [f32; 9] = [
        0.333_333_31,
        -0.25,
        0.200_007_15,
        -0.166_680_58,
        0.142_493_23,
        -0.124_201_41,
        0.116_769_99,
        -0.115_146_1,
        0.070_376_836,
    ];
    let bits: u32x16<S> = x.bitcast();
    let above: i32x16<S> = (bits - u32x16::splat(simd, ROOT)).bitcast();
    let exponent = above >> 23;
    let shift: u32x16<S> = (exponent << 23).bitcast();
    let mantissa: Floats<S> = (bits - shift).bitcast();
    let k: Floats<S> = exponent.to_float();
    let f = mantissa - 1.0;
    let square = f * f;
    let y = f * square * series(simd, f, &SERIES);
    let y = k.mul_add(Floats::splat(simd, -2.121_944_4e-4), y) - square * 0.5;
    k.mul_add(Floats::splat(simd, 0.693_359_375), f + y)
}

/// −ln(1 − a) for a from 0 to below 1.
#[inline(always)]
pub(crate) fn depth_of_opacity<S: Simd>(simd: S, a: Floats<S>) -> Floats<S> {
    let left = Floats::splat(simd, 1.0) - a;
    // What 1 − a rounds off counts where a is small.
    ((left - 1.0) + a) / left - ln(simd, left)
}

/// xᵖ for x from 0 to 1, or little more; for small whole powers a few products.
#[inline(always)]
pub(crate) fn power<S: Simd>(simd: S, x: Floats<S>, p: f32) -> Floats<S> {
    let one = Floats::splat(simd, 1.0);
    if p.fract() != 0.0 || p > 64.0 {
        let some = x.max(Floats::splat(simd, f32::MIN_POSITIVE));
        let zero = Floats::splat(simd, 0.0);
        return x.simd_gt(zero).select(exp(simd, ln(simd, some) * p), zero);
    }
    let p = p as u32;
    if p == 0 {
        return one;
    }
    // From the second highest bit on.
    let mut product = x;
    for k in (0..p.ilog2()).rev() {
        product *= product;
        if p >> k & 1 == 1 {
            product *= x;
        }
    }
    product
}

/// What is left of a phase by the nearest whole one, in [−½, ½].
#[inline(always)]
pub(crate) fn fraction<S: Simd>(p: Floats<S>) -> Floats<S> {
    p - p.round_ties_even()
}

/// sin πz for |z| ≤ ½.
#[inline(always)]
pub(crate) fn sine<S: Simd>(simd: S, z: Floats<S>) -> Floats<S> {
    const SERIES: [f32; 6] = [1.0, -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0, 1.0 / 362_880.0, -1.0 / 39_916_800.0];
    let x = z * std::f32::consts::PI;
    x * series(simd, x * x, &SERIES)
}

#[cfg(test)]
mod tests {
    use super::*;
    use fearless_simd::{Level, dispatch};

    /// Of each number what a function of vectors makes of it.
    macro_rules! all {
        ($x:expr, $f:expr) => {{
            let x: Vec<f32> = $x.collect();
            let mut got = vec![];
            for some in x.chunks(LANES) {
                let mut lanes = [some[0]; LANES];
                lanes[..some.len()].copy_from_slice(some);
                let of: [f32; LANES] =
                    dispatch!(Level::new(), simd => $f(simd, Floats::load_array(simd, lanes)).to_array());
                got.extend_from_slice(&of[..some.len()]);
            }
            x.into_iter().map(f64::from).zip(got.into_iter().map(f64::from)).collect::<Vec<(f64, f64)>>()
        }};
    }

    fn within(what: &str, all: &[(f64, f64)], wanted: impl Fn(f64) -> f64, bound: impl Fn(f64) -> f64) {
        for &(x, got) in all {
            let wanted = wanted(x);
            assert!((got - wanted).abs() <= bound(wanted), "{what} of {x}: {got} is not {wanted}");
        }
    }

    #[test]
    fn functions_are_those_of_f64() {
        let steps = || (0..=20_000).map(|i| i as f32 / 20_000.0);
        let of_itself = |share: f64| move |wanted: f64| share * wanted.abs();
        within("e^-", &all!(steps().map(|x| 80.0 * x), |s, x: Floats<_>| exp(s, -x)), |x| (-x).exp(), of_itself(3e-6));
        within("e^-", &all!(steps().map(|x| FAINT * x), faded), |x| (-x).exp(), of_itself(4e-7));
        let depths = steps().map(|x| 20.0 * x * x * x * x);
        within("opacity", &all!(depths, opacity), |x| -(-x).exp_m1(), of_itself(1e-6));
        let integral = |x: f64| {
            let weight = |i: i32| if i == 0 || i == 400 { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
            let at = |i: i32| weight(i) * (-(x * f64::from(i) / 400.0).powi(2)).exp();
            std::f64::consts::FRAC_2_SQRT_PI * x / 1200.0 * (0..=400).map(at).sum::<f64>()
        };
        within("erf", &all!(steps().map(|x| 10.0 * x - 5.0), erf), integral, |_| 5e-7);
        within("ln", &all!(steps().skip(1).map(|x| x * x * x * x), ln), f64::ln, |w| 2e-7 * (w.abs() + 1.0));
        let most = steps().map(|x| 0.9999 * x);
        within("depth", &all!(most, depth_of_opacity), |x| -(-x).ln_1p(), |w| 3e-7 * w + 1e-7 * w.min(0.1));
        within("sine", &all!(steps().map(|x| x - 0.5), sine), |x| (std::f64::consts::PI * x).sin(), |_| 2e-7);
        for p in [0.0_f32, 1.0, 7.0, 20.0, 64.0, 2.5, 99.0] {
            let got = all!(steps(), |s, x: Floats<_>| power(s, x, p));
            within("power", &got, |x| x.powf(f64::from(p)), |w| 1e-5 * w + 1e-12);
        }
        within(
            "fraction",
            &all!([2.25_f32, -7.5, -0.125].into_iter(), |_, x| fraction(x)),
            |x| x - x.round_ties_even(),
            |_| 0.0,
        );
    }
}
