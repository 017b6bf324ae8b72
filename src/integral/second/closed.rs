//! Integrals of widgets along a straight line in the plane of the two variables, in closed form.
//!
//! Along a segment the place x(u) = x₀ + u Δ is linear in u. Where opacity is extinction and one widget of one colour
//! emits, its chromatic light is c (1 − e^{−T}), and T needs the antiderivative of the widget's height alone:
//!
//! - Gaussian, with x in units of σ: |x|²/2 = (A u + B)² + C₀ with A = |Δ|/√2, B = x₀·Δ/(2A) and C₀ = (x₀ × Δ)²/2|Δ|²,
//!   whose integral is e^{−C₀} √π/2A (erf(A u + B))ᵇₐ (Song et al. 2009, equation 7, without its cancellation in C₀);
//! - waves, over the phase p: whole periods, and a polynomial or a cosine of what is left of one, so that the cost does
//!   not depend on the frequency.

use super::special::Erf;
use crate::transfer::bivariate::{Shape, Sine, Wave};
use std::f64::consts::PI;

/// Phases that a wave is as good as constant in.
pub(super) const STILL: f64 = 1e-7;

impl Erf {
    /// ∫ exp(−|x₀ + u Δ|²/2) du over [a, b].
    pub(super) fn gaussian(&self, x: [f64; 2], d: [f64; 2], [a, b]: [f64; 2]) -> f64 {
        let square = d[0] * d[0] + d[1] * d[1];
        // From the middle on, |x|²/2 is E + b t + c t²/2 for t from −½ to ½.
        let (u, length) = ((a + b) / 2.0, b - a);
        let [p, q] = [x[0] + d[0] * u, x[1] + d[1] * u];
        let slope = (p * d[0] + q * d[1]) * length;
        let (s, c) = (slope * slope, square * length * length);
        if s < 0.25 && c < 0.1 {
            // The even part of e^{−bt − ct²/2} is a series in t², and ∫ t²ᵏ is 1/(2k + 1)4ᵏ.
            let two = 0.5 * (s - c);
            let four = s * s / 24.0 - s * c / 4.0 + c * c / 8.0;
            let six = s * s * s / 720.0 - s * s * c / 48.0 + s * c * c / 16.0 - c * c * c / 48.0;
            let eight = s * s * (s * s / 40_320.0 - s * c / 1440.0 + c * c / 192.0) - s * c * c * c / 96.0
                + c * c * c * c / 384.0;
            let mean = 1.0 + two / 12.0 + four / 80.0 + six / 448.0 + eight / 2304.0;
            return (-0.5 * (p * p + q * q)).exp() * mean * length;
        }
        let steep = (square / 2.0).sqrt();
        let before = (x[0] * d[0] + x[1] * d[1]) / (2.0 * steep);
        let aside = x[0] * d[1] - x[1] * d[0];
        let peak = (-aside * aside / (2.0 * square)).exp();
        peak * PI.sqrt() / (2.0 * steep) * (self.at(steep * b + before) - self.at(steep * a + before))
    }
}

/// The form of a wave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Turn {
    Triangle,
    Sine(Sine),
}

/// A wave as its floor leaves it, over its phase.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Profile {
    pub(super) turn: Turn,
    pub(super) floor: f64,
    /// The phases, from 0 to 1, between which it is above the floor.
    pub(super) above: [f64; 2],
    /// Its integral over a period.
    whole: f64,
    turns: [f64; 4],
    count: usize,
}

/// The wave of a shape, and its profile.
pub(super) fn wave(shape: &Shape) -> Option<(Wave, Profile)> {
    match shape {
        Shape::Triangle(wave) => Some((*wave, Profile::new(Turn::Triangle, wave.floor))),
        Shape::Sinusoid(wave, sine) => Some((*wave, Profile::new(Turn::Sine(*sine), wave.floor))),
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
    fn kinks(self) -> &'static [f64] {
        match self {
            Turn::Triangle | Turn::Sine(Sine::Positive) => &[0.0, 0.5],
            Turn::Sine(Sine::Abs) => &[0.0],
            Turn::Sine(Sine::Raised) => &[],
        }
    }

    /// The phases, from 0 to 1, at which the wave passes a height.
    fn reaches(self, height: f64) -> [f64; 2] {
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
}

impl Profile {
    /// Of a wave whose peaks above `floor`, in [0, 1[, are left.
    pub(super) fn new(turn: Turn, floor: f64) -> Self {
        let reaches = if floor > 0.0 { turn.reaches(floor) } else { [0.0, 1.0] };
        let mut profile = Profile { turn, floor, above: reaches, whole: turn.whole(), turns: [0.0; 4], count: 0 };
        let passed = if floor > 0.0 { &reaches[..] } else { &[] };
        for (slot, place) in profile.turns.iter_mut().zip(turn.kinks().iter().chain(passed)) {
            *slot = *place;
            profile.count += 1;
        }
        if floor > 0.0 {
            profile.whole = profile.part(1.0);
        }
        profile
    }

    /// The phases, from 0 to 1, at which it turns.
    pub(super) fn turns(&self) -> &[f64] {
        &self.turns[..self.count]
    }

    /// The phases between which it is above the floor, its integral without a floor to the first of them, and that over a period.
    pub(super) fn told(&self) -> [f64; 4] {
        let [from, to] = self.above;
        [from, to, self.turn.part(from), self.whole]
    }

    /// The height at a phase, in [0, 1].
    pub(super) fn height(&self, p: f64) -> f64 {
        let height = self.turn.height(p);
        if self.floor > 0.0 { ((height - self.floor) / (1.0 - self.floor)).max(0.0) } else { height }
    }

    /// The integral from the start of a period to the share `f` of it.
    fn part(&self, f: f64) -> f64 {
        if self.floor == 0.0 {
            return self.turn.part(f);
        }
        let [from, to] = self.above;
        let f = f.clamp(from, to);
        (self.turn.part(f) - self.turn.part(from) - self.floor * (f - from)) / (1.0 - self.floor)
    }

    /// The integral from phase 0 to `p`.
    pub(super) fn total(&self, p: f64) -> f64 {
        let begun = p.floor();
        begun * self.whole + self.part(p - begun)
    }

    /// The mean height while the phase runs from `p` to `q`, at a cost that does not depend on how many periods that are.
    pub(super) fn mean(&self, p: f64, q: f64) -> f64 {
        if (q - p).abs() < STILL {
            return self.height((p + q) / 2.0);
        }
        let (m, n) = (p.floor(), q.floor());
        ((n - m) * self.whole + (self.part(q - n) - self.part(p - m))) / (q - p)
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
            for floor in [0.0, 0.3, 0.95] {
                let wave = Profile::new(turn, floor);
                for (p, q) in [(0.1, 0.3), (0.2, 1.9), (-1.3, 2.6), (2.6, -1.3), (0.7, 0.7 + 1e-6), (-0.4, -0.4)] {
                    let wanted = simpson(|u| wave.height(p + (q - p) * u), [0.0, 1.0]);
                    // The rule does not know of kinks.
                    let bound = 1e-7 / (1.0 - floor);
                    assert!((wave.mean(p, q) - wanted).abs() < bound, "{turn:?} {floor} {p} {q}");
                }
                // Many periods cost nothing, and are their mean.
                assert!((wave.mean(0.25, 1_000_000.25) - wave.whole).abs() < 1e-12);
            }
        }
    }
}
