//! Integrals of widgets along a straight line in the plane of the two variables, in closed form.
//!
//! Along a segment the place x(u) = x₀ + u Δ is linear in u. Where opacity is extinction and one widget of one colour
//! emits, its chromatic light is c (1 − e^{−T}), and T needs the antiderivative of the widget's height alone:
//!
//! - Gaussian, with x in units of σ: |x|²/2 = (A u + B)² + C₀ with A = |Δ|/√2, B = x₀·Δ/(2A) and C₀ = (x₀ × Δ)²/2|Δ|²,
//!   whose integral is e^{−C₀} √π/2A (erf(A u + B))ᵇₐ (Song et al. 2009, equation 7, without its cancellation in C₀);
//! - waves, over the phase p: whole periods, and a polynomial or a cosine of what is left of one, so that the cost does
//!   not depend on the frequency.

use crate::transfer::bivariate::{Shape, Sine, Wave};
use std::f64::consts::PI;

/// Steps of the table of erf per unit.
const STEPS: f64 = 16.0;
/// Beyond it is 1 in f64.
const LAST: f64 = 6.0;
/// Phases that a wave is as good as constant in.
const STILL: f64 = 1e-7;

/// The error function: a table, and Taylor's series around its entries.
#[derive(Debug, Clone)]
pub(super) struct Erf {
    /// erf, and its derivative.
    entries: Vec<[f64; 2]>,
}

impl Default for Erf {
    fn default() -> Self {
        let slope = |x: f64| std::f64::consts::FRAC_2_SQRT_PI * (-x * x).exp();
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

    /// ∫ exp(−|x₀ + u Δ|²/2) du over [a, b].
    pub(super) fn gaussian(&self, x: [f64; 2], d: [f64; 2], [a, b]: [f64; 2]) -> f64 {
        let square = d[0] * d[0] + d[1] * d[1];
        if square * (b - a) * (b - a) < 1e-6 {
            // The height in the middle, and its curvature: e^{−E} with E″ = Δ².
            let u = (a + b) / 2.0;
            let [p, q] = [x[0] + d[0] * u, x[1] + d[1] * u];
            let along = p * d[0] + q * d[1];
            let curved = 1.0 + (along * along - square) * (b - a) * (b - a) / 24.0;
            return (-0.5 * (p * p + q * q)).exp() * curved * (b - a);
        }
        let steep = (square / 2.0).sqrt();
        let before = (x[0] * d[0] + x[1] * d[1]) / (2.0 * steep);
        let aside = x[0] * d[1] - x[1] * d[0];
        let peak = (-aside * aside / (2.0 * square)).exp();
        peak * PI.sqrt() / (2.0 * steep) * (self.at(steep * b + before) - self.at(steep * a + before))
    }
}

/// What a wave of a shape is integrated to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Turn {
    Triangle,
    Sine(Sine),
}

/// The wave of a shape, and its form.
pub(super) fn wave(shape: &Shape) -> Option<(&Wave, Turn)> {
    match shape {
        Shape::Triangle(wave) => Some((wave, Turn::Triangle)),
        Shape::Sinusoid(wave, sine) => Some((wave, Turn::Sine(*sine))),
        Shape::Uniform | Shape::Gaussian { .. } => None,
    }
}

impl Turn {
    /// The height at a phase, in [0, 1].
    fn height(self, p: f64) -> f64 {
        let f = p - p.floor();
        match self {
            Turn::Triangle => 1.0 - (2.0 * f - 1.0).abs(),
            Turn::Sine(Sine::Abs) => (PI * f).sin(),
            Turn::Sine(Sine::Positive) => (2.0 * PI * f).sin().max(0.0),
            Turn::Sine(Sine::Raised) => (1.0 - (2.0 * PI * f).cos()) / 2.0,
        }
    }

    /// The phases, from 0 to 1, at which the wave has a kink.
    pub(super) fn kinks(self) -> &'static [f64] {
        match self {
            Turn::Triangle | Turn::Sine(Sine::Positive) => &[0.0, 0.5],
            Turn::Sine(Sine::Abs) => &[0.0],
            Turn::Sine(Sine::Raised) => &[],
        }
    }

    /// The phases, from 0 to 1, at which the wave passes a height.
    pub(super) fn reaches(self, height: f64) -> [f64; 2] {
        let (first, sum) = match self {
            Turn::Triangle => (height / 2.0, 1.0),
            Turn::Sine(Sine::Abs) => (height.asin() / PI, 1.0),
            Turn::Sine(Sine::Positive) => (height.asin() / (2.0 * PI), 0.5),
            Turn::Sine(Sine::Raised) => ((1.0 - 2.0 * height).acos() / (2.0 * PI), 1.0),
        };
        [first, sum - first]
    }

    /// Radians of a sine that one phase is.
    pub(super) fn radians(self) -> f64 {
        match self {
            Turn::Triangle => 0.0,
            Turn::Sine(Sine::Abs) => PI,
            Turn::Sine(Sine::Positive | Sine::Raised) => 2.0 * PI,
        }
    }

    /// The integral over a whole period.
    fn whole(self) -> f64 {
        match self {
            Turn::Triangle | Turn::Sine(Sine::Raised) => 0.5,
            Turn::Sine(Sine::Abs) => 2.0 / PI,
            Turn::Sine(Sine::Positive) => 1.0 / PI,
        }
    }

    /// The integral from the start of a period to the share `f` of it.
    fn part(self, f: f64) -> f64 {
        match self {
            Turn::Triangle if f < 0.5 => f * f,
            Turn::Triangle => 0.5 - (1.0 - f) * (1.0 - f),
            Turn::Sine(Sine::Abs) => (1.0 - (PI * f).cos()) / PI,
            Turn::Sine(Sine::Positive) if f < 0.5 => (1.0 - (2.0 * PI * f).cos()) / (2.0 * PI),
            Turn::Sine(Sine::Positive) => 1.0 / PI,
            Turn::Sine(Sine::Raised) => f / 2.0 - (2.0 * PI * f).sin() / (4.0 * PI),
        }
    }

    /// The mean height while the phase runs from `p` to `q`.
    pub(super) fn mean(self, p: f64, q: f64) -> f64 {
        if (q - p).abs() < STILL {
            return self.height((p + q) / 2.0);
        }
        let (m, n) = (p.floor(), q.floor());
        ((n - m) * self.whole() + (self.part(q - n) - self.part(p - m))) / (q - p)
    }
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
        let slope = |x: f64| std::f64::consts::FRAC_2_SQRT_PI * (-x * x).exp();
        for i in 0..400 {
            let x = f64::from(i) * 0.0171;
            let wanted = simpson(slope, [0.0, x]);
            assert!((erf.at(x) - wanted).abs() < 1e-13, "{x}: {} is not {wanted}", erf.at(x));
        }
        assert_eq!((erf.at(7.0), erf.at(-1e300)), (1.0, -1.0));
    }

    #[test]
    fn gaussians_have_their_integral() {
        let erf = Erf::default();
        let mut seed = 7_u64;
        let mut random = move || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        for i in 0..600 {
            let size = 10_f64.powf(-6.0 + 7.5 * random());
            let x = [6.0 * random() - 3.0, 6.0 * random() - 3.0];
            let d = [size * (random() - 0.5), if i % 3 == 0 { 0.0 } else { size * (random() - 0.5) }];
            let a = random();
            let ends = [a, a + (1.0 - a) * random()];
            let wanted = simpson(
                |u| {
                    let [p, q] = [x[0] + d[0] * u, x[1] + d[1] * u];
                    (-0.5 * (p * p + q * q)).exp()
                },
                ends,
            );
            let got = erf.gaussian(x, d, ends);
            assert!((got - wanted).abs() < 1e-11, "{x:?} {d:?} {ends:?}: {got} is not {wanted}");
        }
        assert!((erf.gaussian([0.0; 2], [0.0; 2], [0.2, 0.7]) - 0.5).abs() < 1e-15);
    }

    #[test]
    fn waves_have_their_mean() {
        for turn in [Turn::Triangle, Turn::Sine(Sine::Abs), Turn::Sine(Sine::Positive), Turn::Sine(Sine::Raised)] {
            for (p, q) in [(0.1, 0.3), (0.2, 1.9), (-1.3, 2.6), (2.6, -1.3), (0.7, 0.7 + 1e-6), (-0.4, -0.4)] {
                let wanted = simpson(|u| turn.height(p + (q - p) * u), [0.0, 1.0]);
                assert!((turn.mean(p, q) - wanted).abs() < 1e-7, "{turn:?} {p} {q}");
            }
            // Many periods cost nothing, and are their mean.
            assert!((turn.mean(0.25, 1_000_000.25) - turn.whole()).abs() < 1e-12);
        }
    }
}
