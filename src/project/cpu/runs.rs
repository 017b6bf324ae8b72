//! Runs of lines of the transfer function along which extinction is one line, though colours are many: those of a colour map with
//! 256 entries, say. A piece of a ray on a run is integrated at once.
//!
//! Of the colour c, the line at the beginning of a run and what it *bends* by at the knots behind, jumps J and turns of its slope M,
//! a piece on which the value goes from s_f to s_b emits ∫ c dA, where A(u) = 1 − e^{−T(u)}. With B(u) = ∫ A, from 0 on, and u where the
//! value is that of a knot s_k (0 or 1 beyond the ends), a bend adds by parts
//!     M (max(s_b − s_k, 0) A(1) − (s_b − s_f) Q) + J P,
//! where Q = B(1) − B(u) and P = A(1) − A(u) if the value rises, Q = B(u) and P = A(u) if it falls. Up to an optical depth of 1/8, A and B
//! are short polynomials: T = x u + d u², d = (y − x)/2, and
//!     A = x u + (d − x²/2) u² + (x³/6 − x d) u³ + … .

use super::lanes::Floats;
use crate::integral::Knots;
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// The most lines of a run, and the most that turns of slopes along it amount to, each over all of its width, in the brightest
/// colours: their roundings add up.
const LONGEST: usize = 32;
const CROOKED: f32 = 16.0;

/// By how much of itself, and of the places of knots, extinction may be beside the line of a run: what f32 has rounded.
const BESIDE: f64 = 2e-7;

/// Greater than one over the distance of two values.
const STEEP: f32 = 1e30;

/// What a colour bends by at the lower knot of a line.
#[derive(Debug, Clone, Copy, Default)]
struct Bend {
    jump: Option<[f32; 3]>,
    turn: Option<[f32; 3]>,
}

/// The lines of a function, and their runs.
#[derive(Debug)]
pub(super) struct Runs {
    /// Red, green and blue of each line at its lower knot, and their slopes.
    pub(super) colors: Vec<[[f32; 4]; 2]>,
    /// Of each line the last of its run, and the slope of extinction along it.
    last: Vec<(u16, f32)>,
    bends: Vec<Bend>,
}

impl Runs {
    pub(super) fn new(knots: &Knots<f32>) -> Self {
        let count = knots.len();
        let of = |k: usize| [&knots.value, &knots.slope].map(|v| [v[k][1], v[k][2], v[k][3], 0.0]);
        let colors: Vec<_> = (0..count).map(of).collect();
        let bends: Vec<_> = (0..count).map(|k| if k == 0 { Bend::default() } else { Bend::new(knots, k) }).collect();
        let mut last = Vec::with_capacity(count);
        while last.len() < count {
            let first = last.len();
            let (end, slope) = run(knots, &bends, first);
            last.extend((first..=end).map(|_| (end as u16, slope)));
        }
        Runs { colors, last, bends }
    }

    /// The last line of the run that line `k` is on.
    #[inline(always)]
    pub(super) fn last(&self, k: usize) -> usize {
        usize::from(self.last[k].0)
    }

    /// The slope of extinction along that run.
    #[inline(always)]
    pub(super) fn slope(&self, k: usize) -> f32 {
        self.last[k].1
    }

    /// Adds to `color` what the bends at the lower knots `at` do to pieces with these values at their ends, of the optical depths `x`
    /// and `y` there, up to 1/8, and the opacity `alpha`.
    #[inline(always)]
    pub(super) fn bend<S: Simd>(
        &self,
        simd: S,
        knots: &Knots<f32>,
        at: std::ops::RangeInclusive<usize>,
        [front, back]: [Floats<S>; 2],
        [x, y, alpha]: [Floats<S>; 3],
        color: &mut [Floats<S>; 3],
    ) {
        let of = |v: f32| Floats::splat(simd, v);
        let (zero, one) = (of(0.0), of(1.0));
        let rise = back - front;
        let per = rise.simd_eq(zero).select(of(STEEP), one / rise);
        let falls = rise.simd_lt(zero);
        let a = absorbed(simd, x, y);
        let whole = integral(simd, &a, one);
        for (bend, &s) in self.bends[at.clone()].iter().zip(&knots.s[at]) {
            let u = ((of(s) - front) * per).max(zero).min(one);
            if let Some(turn) = bend.turn {
                let sum = integral(simd, &a, u);
                let sum = falls.select(sum, whole - sum);
                let own = (back - s).max(zero).mul_add(alpha, -(rise * sum));
                for c in 0..3 {
                    color[c] = own.mul_add(of(turn[c]), color[c]);
                }
            }
            if let Some(jump) = bend.jump {
                let before =
                    a[5].mul_add(u, a[4]).mul_add(u, a[3]).mul_add(u, a[2]).mul_add(u, a[1]).mul_add(u, a[0]) * u;
                let own = falls.select(before, alpha - before);
                for c in 0..3 {
                    color[c] = own.mul_add(of(jump[c]), color[c]);
                }
            }
        }
    }
}

/// The last line of the run that begins with line `first`, and the slope of extinction along it.
fn run(knots: &Knots<f32>, bends: &[Bend], first: usize) -> (usize, f32) {
    let count = knots.len();
    let brightest = |k: usize| knots.value[k][1..].iter().fold(0.0, |most: f32, v| most.max(*v));
    let (mut turns, mut bright) = (0.0, brightest(first));
    let (place, depth) = (|k: usize| f64::from(knots.s[k]), |k: usize| f64::from(knots.value[k][0]));
    let (mut end, mut slope) = (first, knots.slope[first][0]);
    // The outer lines are no part of any: they are as long as f32 can tell.
    while first > 0 && end + 3 < count && end + 1 < first + LONGEST {
        // From the first knot to the one behind the next line.
        let to = end + 2;
        let (width, high) = (place(to) - place(first), depth(first).max(depth(to)));
        if width <= 0.0 {
            break;
        }
        let own = (depth(to) - depth(first)) / width;
        let most = BESIDE * (high + own.abs() * place(first).abs().max(place(to).abs()));
        let is_beside = |k: usize| (depth(first) + own * (place(k) - place(first)) - depth(k)).abs() > most;
        turns += bends[end + 1].turn.map_or(0.0, |turn| turn.iter().fold(0.0, |most: f32, v| most.max(v.abs())));
        bright = bright.max(brightest(end + 1));
        if turns * width as f32 > CROOKED * bright || (first + 1..to).any(is_beside) {
            break;
        }
        (end, slope) = (end + 1, own as f32);
    }
    (end, slope)
}

impl Bend {
    /// At the knot from line `k` − 1 to line `k`.
    fn new(knots: &Knots<f32>, k: usize) -> Self {
        let (value, slope) = (&knots.value, &knots.slope);
        let width = f64::from(knots.s[k]) - f64::from(knots.s[k - 1]);
        let (mut jump, mut turn) = ([0.0; 3], [0.0; 3]);
        let mut is_jump = false;
        for c in 0..3 {
            let before = f64::from(value[k - 1][c + 1]) + f64::from(slope[k - 1][c + 1]) * width;
            let own = f64::from(value[k][c + 1]) - before;
            jump[c] = own as f32;
            is_jump |= own.abs() > 1e-6 * (before.abs() + f64::from(value[k][c + 1]).abs());
            turn[c] = slope[k][c + 1] - slope[k - 1][c + 1];
        }
        Bend { jump: is_jump.then_some(jump), turn: (turn != [0.0; 3]).then_some(turn) }
    }
}

/// The coefficients, from that of u on, of the opacity A before u.
#[inline(always)]
fn absorbed<S: Simd>(simd: S, x: Floats<S>, y: Floats<S>) -> [Floats<S>; 6] {
    let of = |v: f32| Floats::splat(simd, v);
    let d = (y - x) * 0.5;
    let (square, both, bent) = (x * x, x * d, d * d);
    [
        x,
        d - square * 0.5,
        (square * (1.0 / 6.0) - d) * x,
        square.mul_add(d * 0.5 - square * (1.0 / 24.0), bent * -0.5),
        x * bent.mul_add(of(0.5), square * (square * (1.0 / 120.0) - d * (1.0 / 6.0))),
        d * bent.mul_add(of(1.0 / 6.0), square * (square * (1.0 / 24.0)) - x * both * 0.25),
    ]
}

/// ∫ A from 0 to `u`.
#[inline(always)]
fn integral<S: Simd>(simd: S, a: &[Floats<S>; 6], u: Floats<S>) -> Floats<S> {
    let mut sum = a[5] * (1.0 / 7.0);
    for k in (0..5).rev() {
        sum = sum.mul_add(u, a[k] * Floats::splat(simd, 1.0 / (k + 2) as f32));
    }
    sum * (u * u)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::{Kind, Normalization};
    use crate::integral::Exact;
    use crate::transfer::TransferFunction;

    fn knots_of(color: Vec<(f64, [f64; 3])>, opacity: Vec<(f64, f64)>) -> Knots<f32> {
        let transfer = TransferFunction::new(color, opacity, 1.0).unwrap();
        Exact::<f32>::new(&transfer, Kind::Scalar, &[Normalization { mid: 0.0, half: 1.0 }; 4], 1.0).opacity
    }

    #[test]
    fn lines_of_one_extinction_are_runs() {
        let color = (0..=10).map(|i| (f64::from(i) / 10.0, [f64::from(i % 3), 0.5, 0.0])).collect();
        let knots = knots_of(color, vec![(0.0, 0.1), (0.45, 0.55), (0.73, 0.0), (1.0, 0.0)]);
        let runs = Runs::new(&knots);
        let of: Vec<usize> = (0..knots.len()).map(|k| runs.last(k)).collect();
        // Bands, whose edges are too steep.
        let color = (0..5).flat_map(|i| [0.001, 0.199].map(|e| (f64::from(i) / 5.0 + e, [f64::from(i % 2), 0.5, 0.0])));
        let bands = Runs::new(&knots_of(color.collect(), vec![(0.0, 1.0), (1.0, 1.0)]));
        assert!((0..bands.colors.len()).all(|k| bands.last(k) <= k + 1));
        // Lines begin beyond all, then at 0, 0.1 … 0.4, 0.45, 0.5 … 0.7, 0.73, 0.8, 0.9, and the last knots'.
        assert_eq!(of[..14], [0, 5, 5, 5, 5, 5, 9, 9, 9, 9, 12, 12, 12, 13]);
        for (k, want) in [(1, 1.0), (5, 1.0), (6, -0.55 / 0.28), (10, 0.0)] {
            assert!((f64::from(runs.slope(k)) - want).abs() < 1e-5, "{k}: {}", runs.slope(k));
        }
    }
}
