//! erf, its scaled complement erfcx(x) = e^{x²} erfc(x), and Dawson's integral F(x) = e^{−x²} ∫₀ˣ e^{t²} dt.
//!
//! Each is a table, and Taylor's series around its entries, whose coefficients follow from the function's differential
//! equation.

use crate::integral::GAUSS_6;
use std::f64::consts::{FRAC_2_SQRT_PI, PI};
use std::sync::LazyLock;

/// Steps of the tables per unit.
const STEPS: f64 = 16.0;
/// Beyond it erf is 1 in f64.
pub(super) const LAST: f64 = 6.0;
/// Beyond it erfcx and Dawson's integral are their asymptotic series.
const FAR: f64 = 10.0;
/// Terms of Taylor's series within half a step: the next one is below 1e-15.
const TERMS: u32 = 9;

/// The error function.
#[derive(Debug, Clone)]
pub(super) struct Erf {
    /// erf, and its derivative.
    entries: Vec<[f64; 2]>,
}

impl Default for Erf {
    fn default() -> Self {
        let slope = |x: f64| FRAC_2_SQRT_PI * (-x * x).exp();
        let entries = (0..=(LAST * STEPS) as usize).map(|i| {
            let x = i as f64 / STEPS;
            // Maclaurin's series e^{−x²} Σ 2ⁿ x^{2n+1}/(2n+1)‼: all of its terms are positive.
            let (mut term, mut sum, mut n) = (x, 0.0, 0.0);
            while term > 1e-18 * sum {
                sum += term;
                n += 1.0;
                term *= 2.0 * x * x / (2.0 * n + 1.0);
            }
            [slope(x) * sum, slope(x)]
        });
        Erf { entries: entries.collect() }
    }
}

impl Erf {
    /// The table, which is made once.
    pub(super) fn shared() -> &'static Self {
        &ERF
    }

    /// erf(x), to 1e-14.
    pub(super) fn at(&self, x: f64) -> f64 {
        let size = x.abs();
        if size >= LAST {
            return x.signum();
        }
        let i = (size * STEPS).round();
        let (middle, d) = (i / STEPS, size - i / STEPS);
        let [erf, slope] = self.entries[i as usize];
        // Σ (−1)ⁿ Hₙ(middle) dⁿ⁺¹/(n + 1)!, by Hermite's recurrence.
        let (mut before, mut h, mut power, mut sum) = (0.0, 1.0, d, d);
        for n in 0..8 {
            let n = f64::from(n);
            (before, h) = (h, 2.0 * middle * h - 2.0 * n * before);
            power *= -d / (n + 2.0);
            sum += h * power;
        }
        (erf + slope * sum).copysign(x)
    }
}

static ERF: LazyLock<Erf> = LazyLock::new(Erf::default);

/// erfcx and Dawson's integral at the steps from 0 to [`FAR`].
static ENTRIES: LazyLock<[Vec<f64>; 2]> = LazyLock::new(|| {
    let places = || (0..=(FAR * STEPS) as u32 + 1).map(|i| f64::from(i) / STEPS);
    // ∫ f over [0, end], by panels of six nodes.
    let integral = |f: &dyn Fn(f64) -> f64, end: f64| -> f64 {
        let h = 1.0 / 32.0;
        let panel = |k: u32| GAUSS_6.map(|[x, w]| w * h * f(h * (f64::from(k) + x))).iter().sum::<f64>();
        (0..(end / h).round() as u32).map(panel).sum()
    };
    // (2/√π) ∫ e^{−t² − 2xt} dt.
    let erfcx = places().map(|x| FRAC_2_SQRT_PI * integral(&|t| (-t * (t + 2.0 * x)).exp(), LAST + 0.5));
    let dawson = places().map(|x| integral(&|t| ((t - x) * (t + x)).exp(), x));
    [erfcx.collect(), dawson.collect()]
});

/// Taylor's series at `x` in [0, FAR[, by y″ = `sign` (2 x y′ + 2 y), of what has the values `entries` and the derivative
/// `slope(x, y)`.
#[inline]
fn taylor(entries: &[f64], x: f64, sign: f64, slope: impl Fn(f64, f64) -> f64) -> f64 {
    let i = (x * STEPS).round();
    let (middle, d) = (i / STEPS, x - i / STEPS);
    let (mut before, mut now) = (entries[i as usize], slope(middle, entries[i as usize]));
    let (mut sum, mut power) = (before + now * d, d);
    for n in 1..TERMS {
        // (n + 1) y_{n+1} = ±2 (x y_n + y_{n−1}).
        (before, now) = (now, sign * 2.0 * (middle * now + before) / f64::from(n + 1));
        power *= d;
        sum += now * power;
    }
    sum
}

/// Σ (±1)ⁿ (2n − 1)‼/(2x²)ⁿ: what erfcx and Dawson's integral are near to, times what they fall like.
fn asymptotic(x: f64, sign: f64) -> f64 {
    let share = sign / (2.0 * x * x);
    let (mut term, mut sum) = (1.0, 1.0);
    for n in 0..12 {
        term *= share * f64::from(2 * n + 1);
        sum += term;
    }
    sum
}

/// erfcx(x) for x ≥ 0, to 1e-13 of itself.
pub(super) fn erfcx(x: f64) -> f64 {
    if x >= FAR {
        return asymptotic(x, -1.0) / (x * PI.sqrt());
    }
    taylor(&ENTRIES[0], x, 1.0, |x, y| 2.0 * x * y - FRAC_2_SQRT_PI)
}

/// Dawson's integral for x ≥ 0, to 1e-13.
pub(super) fn dawson(x: f64) -> f64 {
    if x >= FAR {
        return asymptotic(x, 1.0) / (2.0 * x);
    }
    taylor(&ENTRIES[1], x, -1.0, |x, y| 1.0 - 2.0 * x * y)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Simpson's rule with so many intervals that it is the truth.
    fn simpson(f: impl Fn(f64) -> f64, [a, b]: [f64; 2]) -> f64 {
        let n = 20_000;
        let h = (b - a) / f64::from(n);
        let weight = |i: i32| if i == 0 || i == n { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
        (0..=n).map(|i| weight(i) * f(a + h * f64::from(i))).sum::<f64>() * h / 3.0
    }

    #[test]
    fn erf_is_erf() {
        let erf = Erf::default();
        // Abramowitz & Stegun, table 7.1.
        for (x, wanted) in [
            (0.0, 0.0),
            (0.5, 0.520_499_877_8),
            (1.0, 0.842_700_792_9),
            (1.9, 0.992_790_429_2),
            (-1.0, -0.842_700_792_9),
        ] {
            assert!((erf.at(x) - wanted).abs() < 1e-10, "{x}");
        }
        let slope = |x: f64| FRAC_2_SQRT_PI * (-x * x).exp();
        for i in 0..400 {
            let x = f64::from(i) * 0.0171;
            let wanted = simpson(slope, [0.0, x]);
            assert!((erf.at(x) - wanted).abs() < 1e-13, "{x}: {} is not {wanted}", erf.at(x));
        }
        assert_eq!((erf.at(7.0), erf.at(-1e300)), (1.0, -1.0));
    }

    #[test]
    fn the_others_are_their_integrals() {
        // Abramowitz & Stegun, tables 7.5 and 7.1 with e^{x²}.
        for (x, wanted) in [(0.5, 0.424_436_383_5), (1.0, 0.538_079_506_9), (2.0, 0.301_340_388_9)] {
            assert!((dawson(x) - wanted).abs() < 1e-10, "{x}: {}", dawson(x));
        }
        for (x, wanted) in [(0.0, 1.0), (0.5, 0.615_690_344_2), (1.0, 0.427_583_576_2)] {
            assert!((erfcx(x) - wanted).abs() < 1e-10, "{x}: {}", erfcx(x));
        }
        for i in 0..300 {
            // Beyond the tables' end, too.
            let x = f64::from(i) * 0.0413;
            let scaled = FRAC_2_SQRT_PI * simpson(|t| (-t * (t + 2.0 * x)).exp(), [0.0, 60.0 / (8.0 + 2.0 * x)]);
            assert!((erfcx(x) / scaled - 1.0).abs() < 1e-11, "erfcx({x}): {} is not {scaled}", erfcx(x));
            let wanted = simpson(|t| ((t - x) * (t + x)).exp(), [(x - 80.0 / (8.0 + x)).max(0.0), x]);
            assert!((dawson(x) - wanted).abs() < 1e-11, "F({x}): {} is not {wanted}", dawson(x));
        }
        assert!((erfcx(1e9) * 1e9 * PI.sqrt() - 1.0).abs() < 1e-15 && (dawson(1e9) * 2e9 - 1.0).abs() < 1e-15);
    }
}
