//! What a piece of a ray emits and absorbs in which extinction and emission are cubics.
//!
//! With optical depths τ(u) over the piece, u in [0, 1], and T(u) = ∫₀ᵘ τ, a quartic in closed form, it is α = 1 − e^{−T(1)},
//! chromatic emission ∫ e τ e^{−T} and direct emission ∫ e e^{−T}, for any cubic e: the value itself, of which all colours
//! of a transfer function's line are affine functions, or the colours of a field that holds such. The integrals are
//! Gauss–Legendre sums over parts of small optical depth, in f64 and as accurate as f32 can tell. What is deep is halved,
//! from the front, until nothing behind can be seen.

use super::Cubic;
use crate::integral::{GAUSS_6, OPAQUE_DEPTH};

/// Nodes in [0, 1] and weights of the 4-point Gauss–Legendre rule.
const GAUSS_4: [[f64; 2]; 4] = [
    [0.069_431_844_202_973_71, 0.173_927_422_568_726_93],
    [0.330_009_478_207_571_87, 0.326_072_577_431_273_07],
    [0.669_990_521_792_428_1, 0.326_072_577_431_273_07],
    [0.930_568_155_797_026_3, 0.173_927_422_568_726_93],
];

/// Optical depth up to which 4 nodes do.
const THIN: f64 = 0.03;

/// Optical depth up to which 6 nodes do.
const THICK: f64 = 0.35;

/// Halvings of a piece: so thin a part of a voxel is nothing, whatever its extinction.
const HALVINGS: u32 = 60;

/// A piece: extinction times length, and what is emitted, M cubics.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Piece<const M: usize> {
    pub(crate) depth: Cubic,
    pub(crate) emission: [Cubic; M],
}

/// What a piece does: its opacity, and the integral of each emission, per length for direct ones.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sum<const M: usize> {
    pub(crate) alpha: f64,
    pub(crate) emitted: [f64; M],
}

impl<const M: usize> Piece<M> {
    /// Its optical depth.
    #[inline(always)]
    pub(crate) fn total(&self) -> f64 {
        let [a, b, c, d] = self.depth.0;
        // Bernstein coefficients may lie below a cubic that is nowhere negative.
        ((a + b + c + d) * 0.25).max(0.0)
    }

    /// Its integral: error at most 1e-6, and 1e-5 of α, of what is emitted, where that is up to 1.
    #[inline(always)]
    pub(crate) fn integrate(&self, direct: bool) -> Sum<M> {
        let total = self.total();
        if total <= THIN {
            return self.sum(&GAUSS_4, total, direct);
        }
        if total <= THICK {
            return self.sum(&GAUSS_6, total, direct);
        }
        let mut whole = Sum { alpha: 0.0, emitted: [0.0; M] };
        let mut through = 1.0;
        self.halve(direct, HALVINGS, 1.0, &mut through, &mut whole);
        whole.alpha = 1.0 - (-total).exp();
        whole
    }

    /// Adds to `whole` what it emits as `share` of a piece that lets `through` what is before.
    fn halve(&self, direct: bool, halvings: u32, share: f64, through: &mut f64, whole: &mut Sum<M>) {
        let total = self.total();
        if total > THICK && halvings > 0 {
            let part = |from: f64, to: f64| {
                let depth = self.depth.part(from, to);
                let emission = self.emission.map(|e| e.part(from, to));
                Piece { depth: Cubic(depth.0.map(|d| d * 0.5)), emission }
            };
            part(0.0, 0.5).halve(direct, halvings - 1, share * 0.5, through, whole);
            if *through > (-OPAQUE_DEPTH).exp() {
                part(0.5, 1.0).halve(direct, halvings - 1, share * 0.5, through, whole);
            }
            return;
        }
        let own = self.sum(&GAUSS_6, total, direct);
        let weight = *through * if direct { share } else { 1.0 };
        for (all, one) in whole.emitted.iter_mut().zip(own.emitted) {
            *all += weight * one;
        }
        *through *= 1.0 - own.alpha;
    }

    #[inline(always)]
    fn sum<const N: usize>(&self, rule: &[[f64; 2]; N], total: f64, direct: bool) -> Sum<M> {
        let [a, b, c, _] = self.depth.0;
        let alpha = opacity(total);
        let (mut emitted, mut absorbed) = ([0.0; M], 0.0);
        // Bernstein coefficients of T over u.
        let t = [a * 0.25, (a + b) * 0.25, (a + b + c) * 0.25];
        for &[u, weight] in rule {
            let v = 1.0 - u;
            let (uu, vv) = (u * u, v * v);
            let passed = u * (4.0 * v * vv * t[0] + 6.0 * u * vv * t[1] + 4.0 * uu * v * t[2] + u * uu * total);
            // The series takes no decisions: a loop over it becomes vector instructions.
            let seen = weight * if total <= THICK { series(passed) } else { (-passed.max(0.0)).exp() };
            let density = if direct { seen } else { seen * self.depth.at(u).max(0.0) };
            absorbed += density;
            for (sum, e) in emitted.iter_mut().zip(&self.emission) {
                *sum += density * e.at(u);
            }
        }
        // The sum of the weights is known: what the rule is off by is taken off.
        if !direct && absorbed > 0.0 {
            emitted = emitted.map(|e| e * (alpha / absorbed));
        }
        Sum { alpha, emitted }
    }
}

/// 1 − e^{−depth}, accurate relative to itself.
#[inline(always)]
fn opacity(d: f64) -> f64 {
    if d <= THICK { series_of_opacity(d) } else { 1.0 - (-d).exp() }
}

/// e^{−x} for x up to [`THICK`], to 1e-8.
#[inline(always)]
fn series(x: f64) -> f64 {
    1.0 - series_of_opacity(x)
}

/// 1 − e^{−x} for x up to [`THICK`], to 2e-8 of itself.
#[inline(always)]
fn series_of_opacity(x: f64) -> f64 {
    let mut sum = x * (1.0 / 5040.0);
    for factorial in [720.0, 120.0, 24.0, 6.0, 2.0, 1.0] {
        sum = x * (1.0 / factorial - sum);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By many steps that shrink towards the front.
    fn truth(piece: &Piece<1>, direct: bool) -> [f64; 2] {
        let n = 20_000;
        let (mut depth, mut emitted) = (0.0, 0.0);
        for i in 0..n {
            let end = |i: usize| (i as f64 / n as f64).powi(3);
            let (u, v) = (end(i), end(i + 1));
            for [node, weight] in GAUSS_6 {
                // Depth within the step by its own rule.
                let x = u + (v - u) * node;
                let within: f64 =
                    GAUSS_6.iter().map(|[n, w]| piece.depth.at(u + (x - u) * n) * w).sum::<f64>() * (x - u);
                let seen = (-(depth + within)).exp() * (v - u) * weight;
                emitted += seen * piece.emission[0].at(x) * if direct { 1.0 } else { piece.depth.at(x) };
            }
            depth += GAUSS_6.iter().map(|[n, w]| piece.depth.at(u + (v - u) * n) * w).sum::<f64>() * (v - u);
        }
        [1.0 - (-depth).exp(), emitted]
    }

    #[test]
    fn pieces_match_their_integrals() {
        let shapes =
            [[1.0; 4], [0.0, 0.0, 0.0, 4.0], [4.0, 0.0, 0.0, 0.0], [0.0, 2.0, 2.0, 0.0], [1.0, -0.2, 2.0, 0.3]];
        let emissions = [[1.0; 4], [0.0, 0.3, 0.6, 1.0], [1.0, -1.0, 2.0, 0.0]];
        for shape in shapes {
            for total in [1e-12, 1e-4, 0.1, 0.25, 0.6, 1.0, 1.01, 3.0, 17.0, 60.0, 2e3] {
                for emission in emissions {
                    let depth = Cubic(shape.map(|d| d * total));
                    let piece = Piece { depth, emission: [Cubic(emission)] };
                    for direct in [false, true] {
                        let ([alpha, emitted], got) = (truth(&piece, direct), piece.integrate(direct));
                        let slack = if direct { 1e-6 } else { (1e-5 * alpha).min(1e-6) + 1e-15 };
                        assert!(
                            (got.alpha - alpha).abs() <= 1e-7 * alpha + 1e-14,
                            "{shape:?} {total}: {got:?}, not {alpha}"
                        );
                        let off = (got.emitted[0] - emitted).abs();
                        assert!(off <= slack, "{shape:?} {total} {emission:?} {direct}: {got:?}, not {emitted}");
                    }
                }
            }
        }
    }

    #[test]
    fn what_is_opaque_shows_its_front() {
        let piece = Piece { depth: Cubic([1e15; 4]), emission: [Cubic([0.3, 0.5, 0.7, 0.9])] };
        let sum = piece.integrate(false);
        assert!((sum.alpha - 1.0).abs() < 1e-12 && (sum.emitted[0] - 0.3).abs() < 1e-6, "{sum:?}");
    }
}
