//! What is seen of a segment whose emission is direct, while one widget absorbs: the length ∫ e^{−T} du, that times the
//! colour is the light (Song et al. 2009, equations 5 and 7 to 10).
//!
//! - Where extinction is linear, as in a uniform widget and on a side of a triangle wave, the length has a closed form.
//!   With depths x in front and y behind, δ = (y − x)/2 and z = x/2√|δ|: rising it is √π/2√δ (erfcx z − e^{−D} erfcx(z +
//!   √δ)), falling 1/√|δ| (F(z) − e^{−D} F(z − √|δ|)) with Dawson's integral F. Neither has the great exponentials that
//!   differences of erf and of ∫ e^{t²} dt cancel in; where little changes both cancel, and a series stands for them.
//! - Of Gaussians, ∫ exp(P (erf B − erf t)) dt has no closed form, nor has the sine's ∫ exp(P (cos t − cos d)) dt: the
//!   depth up to a place has, so that one sum is left in place of two. Its panels follow what is still seen, at most
//!   some 20 of six nodes.
//! - Whole periods of a wave show the same, each behind the depth of the last: a geometric series, whatever their number.

use super::closed::{Profile, STILL, Turn};
use super::special::{Erf, LAST, dawson, erfcx};
use crate::integral::{GAUSS_6, Piece};
use std::f64::consts::PI;

/// Depth of a panel at most.
const DEEPEST: f64 = 2.0;
/// By how many √2 σ a Gaussian's argument moves in a panel at most.
const STEP: f64 = 0.7;
/// Depth behind which nothing is seen.
const DARK: f64 = 40.0;
/// The shortest panels, as shares of all.
const THINNEST: f64 = 1e-13;
/// Depth up to which the series stands for the closed form.
const MILD: f64 = 0.5;

/// Depth of a part of a segment, and what is seen of its length from its front.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Seen {
    pub(super) depth: f64,
    pub(super) length: f64,
}

impl Seen {
    const NONE: Self = Seen { depth: 0.0, length: 0.0 };

    /// Of a length that absorbs nothing.
    fn clear(length: f64) -> Self {
        Seen { depth: 0.0, length }
    }

    /// This with another part behind it.
    fn then(self, behind: Self) -> Self {
        Seen { depth: self.depth + behind.depth, length: self.length + (-self.depth).exp() * behind.length }
    }

    /// This so many times.
    fn repeated(self, times: f64) -> Self {
        let depth = self.depth * times;
        let shares = if self.depth > 0.0 { (-depth).exp_m1() / (-self.depth).exp_m1() } else { times };
        Seen { depth, length: self.length * shares }
    }

    /// Of a length of even extinction.
    pub(super) fn uniform(depth: f64, length: f64) -> Self {
        let share = if depth > 0.0 { -(-depth).exp_m1() / depth } else { 1.0 };
        Seen { depth, length: length * share }
    }

    /// Of a length whose extinction is linear, `x` in front and `y` behind, both times the length.
    pub(super) fn linear(x: f64, y: f64, length: f64) -> Self {
        let (depth, change) = (0.5 * (x + y), 0.5 * (y - x));
        let root = change.abs().sqrt();
        let share = if depth.max(root) < MILD {
            let piece = Piece::by_series(x, y, true);
            piece.front + piece.back
        } else if depth * 1e-8 > change.abs() {
            return Seen::uniform(depth, length);
        } else {
            let (z, behind) = (0.5 * x / root, 0.5 * y / root);
            let dim = (-depth).exp();
            if change > 0.0 {
                0.5 * PI.sqrt() / root * (erfcx(z) - dim * erfcx(behind))
            } else {
                (dawson(z) - dim * dawson(behind)) / root
            }
        };
        Seen { depth, length: length * share }
    }

    /// Of what is smooth from `a` to `b`, of which `total` says the depth up to a place; what else bends it does little
    /// within a `step`.
    fn smooth(total: impl Fn(f64) -> f64, [a, b]: [f64; 2], step: f64) -> Self {
        let start = total(a);
        let (mut u, mut before, mut h, mut sum) = (a, start, step, Seen::NONE);
        while u < b && sum.depth < DARK {
            let rest = b - u;
            // No sliver is left to the last.
            h = if rest <= h {
                rest
            } else if rest < 2.0 * h {
                0.5 * rest
            } else {
                h
            };
            let (mut to, mut after) = (u + h, total(u + h));
            while after - before > DEEPEST && h > THINNEST * (b - a) {
                h *= (DEEPEST / (after - before)).clamp(0.05, 0.7);
                (to, after) = (u + h, total(u + h));
            }
            if h >= rest {
                to = b;
            }
            let seen = GAUSS_6.map(|[x, w]| w * (before - total(u + h * x)).min(0.0).exp());
            let panel = Seen { depth: after - before, length: h * seen.iter().sum::<f64>() };
            sum = sum.then(panel);
            (u, before, h) = (to, after, (2.0 * h).min(step));
        }
        Seen { depth: (total(b) - start).max(0.0), ..sum }
    }

    /// Of a Gaussian between two places, of such a depth over a length of 1 at its peak; see [`Erf::gaussian`].
    pub(super) fn gaussian(erf: &Erf, depth: f64, x: [f64; 2], d: [f64; 2], ends: [f64; 2]) -> Self {
        let square = d[0] * d[0] + d[1] * d[1];
        let length = ends[1] - ends[0];
        if square * length * length < 1e-6 {
            return Seen::smooth(|u| depth * erf.gaussian(x, d, [ends[0], u]), ends, length);
        }
        let steep = (square / 2.0).sqrt();
        let before = (x[0] * d[0] + x[1] * d[1]) / (2.0 * steep);
        let aside = x[0] * d[1] - x[1] * d[0];
        let most = depth * (-aside * aside / (2.0 * square)).exp() * PI.sqrt() / (2.0 * steep);
        // In steps of √2 σ; where erf does not change any more, nothing is absorbed.
        let [from, to] = ends.map(|u| steep * u + before);
        let [first, last] = [from, to].map(|t| t.clamp(-LAST, LAST));
        let peak = Seen::smooth(|t| most * erf.at(t), [first, last], STEP);
        let all = Seen::clear(first - from).then(peak).then(Seen::clear(to - last));
        Seen { length: all.length / steep, ..all }
    }

    /// Of a wave whose phase runs from `p` to `q` over a `length`, of such a depth over a length of 1 at its peak.
    pub(super) fn wave(wave: &Profile, depth: f64, [p, q]: [f64; 2], length: f64) -> Self {
        let travel = (q - p).abs();
        if travel < STILL {
            return Seen::uniform(depth * length * wave.height((p + q) / 2.0), length);
        }
        let way = Way { wave, start: p - p.floor(), sign: (q - p).signum(), depth, scale: length / travel };
        let first = if q > p { p.ceil() - p } else { p - p.floor() };
        let whole = (travel - first).floor();
        if whole < 2.0 {
            return way.part([0.0, travel]);
        }
        // The last period looks the same from its beginning, which is no great number.
        let rest = travel - first - whole;
        let period = way.part([first, first + 1.0]);
        way.part([0.0, first]).then(period.repeated(whole)).then(way.part([first, first + rest]))
    }
}

/// A way through a wave, by how many phases it is from its start.
struct Way<'a> {
    wave: &'a Profile,
    start: f64,
    sign: f64,
    depth: f64,
    /// Lengths per phase.
    scale: f64,
}

impl Way<'_> {
    fn phase(&self, x: f64) -> f64 {
        self.start + self.sign * x
    }

    /// The next place beyond `x` where the wave turns.
    fn next(&self, x: f64) -> f64 {
        // Distances that rounding leaves of a turn that is here.
        const HERE: f64 = 1e-12;
        let to_turn = |turn: &f64| {
            let apart = (turn - self.phase(x)) * self.sign;
            let ahead = apart - apart.floor();
            if ahead < HERE * (1.0 + x) { ahead + 1.0 } else { ahead }
        };
        x + self.wave.turns().iter().map(to_turn).fold(f64::INFINITY, f64::min)
    }

    /// What is seen between two places.
    fn part(&self, [from, to]: [f64; 2]) -> Seen {
        let (mut x, mut sum) = (from, Seen::NONE);
        while x < to {
            let next = self.next(x).min(to);
            let span = next - x;
            sum = sum.then(if self.wave.turn == Turn::Triangle {
                // From places inside: at the ends is what either side has.
                let [h, k] = [0.25, 0.75].map(|share| self.wave.height(self.phase(x + span * share)));
                let length = span * self.scale;
                let [f, b] = [1.5 * h - 0.5 * k, 1.5 * k - 0.5 * h].map(|h| h.max(0.0) * self.depth * length);
                Seen::linear(f, b, length)
            } else {
                let total = |x: f64| self.sign * self.depth * self.scale * self.wave.total(self.phase(x));
                let sixth = PI / 3.0 / self.wave.turn.radians();
                let seen = Seen::smooth(total, [x, next], sixth);
                Seen { length: seen.length * self.scale, ..seen }
            });
            x = next;
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By Simpson's rule over e^{−T}.
    fn simpson(total: impl Fn(f64) -> f64) -> f64 {
        let n = 40_000;
        let weight = |i: i32| if i == 0 || i == n { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
        (0..=n).map(|i| weight(i) * (-total(f64::from(i) / f64::from(n))).exp()).sum::<f64>() / (3.0 * f64::from(n))
    }

    /// Rising and falling, from next to nothing to far more than anything is seen through.
    #[test]
    fn linear_extinction_shows_its_closed_form() {
        for depth in [0.0, 1e-9, 1e-3, 0.2, 0.499, 0.501, 1.0, 3.0, 12.0, 70.0] {
            for bend in [0.0, 1e-12, 1e-6, 1e-3, 0.1, 0.5, 0.9, 0.999, 1.0] {
                for sign in [-1.0, 1.0] {
                    let (x, y) = (depth * (1.0 - sign * bend), depth * (1.0 + sign * bend));
                    let got = Seen::linear(x, y, 1.0);
                    let wanted = simpson(|u| x * u + 0.5 * (y - x) * u * u);
                    let error = (got.length - wanted).abs();
                    assert!(error < 3e-8 && got.depth == 0.5 * (x + y), "{x} {y}: {} is not {wanted}", got.length);
                }
            }
        }
        for (x, y) in [(0.0, 1e300), (1e300, 0.0), (1e300, 1e300), (1e-300, 0.0), (1e12, 1e12 + 1.0)] {
            let Seen { length, .. } = Seen::linear(x, y, 1.0);
            assert!((0.0..=1.0 + 1e-12).contains(&length), "{x} {y}: {length}");
        }
        // √(π/2k) of a rise from nothing, and 1/x in front of what is even.
        assert!((Seen::linear(0.0, 1e6, 1.0).length * (2e6 / PI).sqrt() - 1.0).abs() < 1e-9);
        assert!((Seen::linear(1e6, 1e6, 1.0).length * 1e6 - 1.0).abs() < 1e-9);
    }

    #[test]
    fn periods_are_a_geometric_series() {
        let one = Seen { depth: 0.3, length: 0.8 };
        let five = one.then(one).then(one).then(one).then(one);
        let all = one.repeated(5.0);
        assert!((all.depth - five.depth).abs() < 1e-15 && (all.length - five.length).abs() < 1e-14);
        assert_eq!(Seen { depth: 0.0, length: 2.0 }.repeated(1e9), Seen { depth: 0.0, length: 2e9 });
        let wave = Profile::new(Turn::Triangle, 0.0);
        // A million periods are as thin as their mean.
        let many = Seen::wave(&wave, 2.0, [0.3, 1e6 + 0.8], 1.0);
        let even = Seen::uniform(1.0, 1.0);
        assert!((many.length - even.length).abs() < 1e-6 && (many.depth - even.depth).abs() < 1e-6);
    }
}
