//! Arithmetic on four places of a segment at once: loops that take no decisions, which become vector instructions.

use std::f64::consts::{LOG2_E, PI};

/// Four numbers, one for each place.
pub(super) type Lanes = [f64; 4];

/// 1.5 · 2⁵²: adding and taking it away again rounds to a whole number.
const ROUND: f64 = 6_755_399_441_055_744.0;

#[inline(always)]
pub(super) fn each(f: impl Fn(usize) -> f64) -> Lanes {
    std::array::from_fn(f)
}

/// eˣ for x ≤ 0, or little more, to 1e-14 of itself; 0 below −700.
#[inline(always)]
#[allow(clippy::excessive_precision, reason = "ln 2 in two parts: the first is exact times a small whole number")]
pub(super) fn exp(x: Lanes) -> Lanes {
    // x = k ln 2 + r with |r| ≤ ln 2/2.
    each(|i| {
        let bounded = if x[i] > -700.0 { x[i] } else { -700.0 };
        let shifted = bounded * LOG2_E + ROUND;
        let k = shifted - ROUND;
        let r = (bounded - k * 0.693_147_180_369_123_8) - k * 1.908_214_929_270_587_7e-10;
        let mut p = 1.0 / 39_916_800.0;
        for factorial in [3_628_800.0, 362_880.0, 40_320.0, 5040.0, 720.0, 120.0, 24.0, 6.0, 2.0, 1.0, 1.0] {
            p = p * r + 1.0 / factorial;
        }
        let scale = f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52);
        if x[i] > -700.0 { p * scale } else { 0.0 }
    })
}

/// 1 − e^{−d} for d ≥ 0, accurate relative to itself.
#[inline(always)]
pub(super) fn opacity(d: f64) -> f64 {
    if d > 0.25 {
        return -(-d).exp_m1();
    }
    let mut p = 1.0 / 39_916_800.0;
    for factorial in [3_628_800.0, 362_880.0, 40_320.0, 5040.0, 720.0, 120.0, 24.0, 6.0, 2.0, 1.0] {
        p = 1.0 / factorial - d * p;
    }
    d * p
}

/// What is left of a phase by the nearest whole one, in [−½, ½].
#[inline(always)]
pub(super) fn fraction(p: Lanes) -> Lanes {
    each(|i| p[i] - ((p[i] + ROUND) - ROUND))
}

/// sin πz for |z| ≤ ½, to 1e-13.
#[inline(always)]
pub(super) fn sin(z: Lanes) -> Lanes {
    each(|i| {
        let x = PI * z[i];
        let square = x * x;
        let mut p = 1.0;
        for n in [16.0, 14.0, 12.0, 10.0, 8.0, 6.0, 4.0, 2.0] {
            p = 1.0 - square * p * (1.0 / (n * (n + 1.0)));
        }
        x * p
    })
}

/// cos πz for |z| ≤ ½, to 1e-12.
#[inline(always)]
pub(super) fn cos(z: Lanes) -> Lanes {
    each(|i| {
        let square = PI * PI * z[i] * z[i];
        let mut p = 1.0;
        for n in [15.0, 13.0, 11.0, 9.0, 7.0, 5.0, 3.0, 1.0] {
            p = 1.0 - square * p * (1.0 / (n * (n + 1.0)));
        }
        p
    })
}

/// xᵖ for x ≥ 0, which for small whole powers is a few products.
#[inline(always)]
pub(super) fn power(x: Lanes, p: f64) -> Lanes {
    if !(p.fract() == 0.0 && p <= 64.0) {
        return x.map(|x| x.powf(p));
    }
    let (mut rest, mut square, mut product) = (p as u32, x, [1.0; 4]);
    while rest > 0 {
        if rest % 2 == 1 {
            product = each(|i| product[i] * square[i]);
        }
        square = each(|i| square[i] * square[i]);
        rest /= 2;
    }
    product
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_are_the_libraries() {
        for i in 0..=20_000 {
            let x = f64::from(i) * 0.0351;
            let [got, ..] = exp([-x; 4]);
            let wanted = if x > 700.0 { 0.0 } else { (-x).exp() };
            assert!((got - wanted).abs() <= 1e-14 * wanted * (1.0 + x), "e^-{x}: {got} is not {wanted}");
            let z = f64::from(i) / 20_000.0 - 0.5;
            assert!((sin([z; 4])[0] - (PI * z).sin()).abs() < 1e-13, "{z}");
            assert!((cos([z; 4])[0] - (PI * z).cos()).abs() < 1e-12, "{z}");
            let d = f64::from(i) * 1e-4;
            assert!((opacity(d) + (-d).exp_m1()).abs() <= 1e-15 * d, "{d}");
        }
        assert_eq!([0.0, f64::NEG_INFINITY, -1e300].map(|x| exp([x; 4])[3]), [1.0, 0.0, 0.0]);
        assert!((exp([1e-3; 4])[0] - 1e-3_f64.exp()).abs() < 1e-15);
        assert_eq!(fraction([2.25, -7.5, 1e9 + 0.25, -0.125]).map(f64::abs), [0.25, 0.5, 0.25, 0.125]);
        for (p, wanted) in [(0.0, 1.0), (1.0, 0.5), (7.0, 0.5_f64.powi(7)), (2.5, 0.5_f64.powf(2.5))] {
            assert_eq!(power([0.5; 4], p), [wanted; 4]);
        }
    }
}
