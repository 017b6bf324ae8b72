//! Means and colours along parabolas, eight side by side, with everything about where they cross knots in closed form.
//!
//! Values are counted in texels, so that the parabola A u² + B u + C of three texels has whole coefficients. Above a knot k it
//! is where A u² + B u + C − k > 0: outside its two roots if it is convex, between them if it is concave. So the measure of
//! that part of [0, 1], and the integrals of s and s² over it, are differences of antiderivatives at the roots; what lies
//! between two knots is the difference of two such parts, and over it the mean extinction and the mean of colour times
//! extinction, products of lines of s, follow exactly. Nothing of this depends on the order of the values along the ray.
//!
//! Colours of slabs of some length do. A parabola is followed from knot to knot: one that is convex leaves an interval where
//! it first meets the lower knot, or else where it last meets the upper one, and a concave one the other way round.

#![allow(clippy::needless_range_loop, reason = "channels and lanes of several arrays are counted at once")]

use super::super::grid::constant;
use super::super::polynomial::inverse;
use super::super::{OPAQUE_DEPTH, THINNEST};
use crate::integral::Exact;
use crate::integral::cubic::stretch::{DEEPEST, LANES, Stretch};
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x8, f64x8, mask32x8, mask64x8};
use rayon::prelude::*;

/// The highest degree.
const MOST: usize = 4;

/// Panels of a piece that is deep: the first of them let nothing through.
const PANELS: usize = 64;

/// Transmittance below which nothing behind is seen.
const DARK: f32 = 1e-8;

/// Opacities below this have no colour over them but the limit, and optical depths below that have no curve.
const NOTHING: f32 = 1e-30;
const FAINT: f32 = 1e-6;

/// A line of the function between two knots, over values in texels.
#[derive(Debug, Clone, Copy)]
struct Line {
    low: f64,
    high: f64,
    /// What values count from.
    start: f64,
    /// Extinction and colour there, and what they grow by.
    value: [f64; 4],
    slope: [f64; 4],
}

/// The function, ready for parabolas of a table.
pub(super) struct Parabolas {
    size: usize,
    degree: usize,
    direct: bool,
    lengths: [f32; MOST],
    lines: Vec<Line>,
    narrow: Vec<Narrow>,
    /// Extinction and colour of what has the value of a texel all along.
    constants: Vec<[f64; 4]>,
    weights: [[f32; MOST + 1]; MOST + 1],
    most: f32,
}

/// A [`Line`] in f32.
#[derive(Debug, Clone, Copy, Default)]
struct Narrow {
    value: [f32; 4],
    slope: [f32; 4],
}

/// Coefficients A, B, C of eight parabolas.
type Eight<S> = [f64x8<S>; 3];

/// The mean extinction, of colours the mean by extinction, and that by length.
type Means<S> = (f64x8<S>, [f64x8<S>; 3], [f64x8<S>; 3]);

impl Parabolas {
    /// For slabs of up to `longest` normalised units, and polynomials of this degree, from 1 to 4.
    pub(super) fn new(exact: &Exact<f64>, degree: u32, size: u32, longest: f64) -> Self {
        let knots = &exact.opacity;
        let per_unit = f64::from(size - 1) / 2.0;
        let place = |s: f64| (s + 1.0) * per_unit;
        let intervals = (1..knots.s.len()).filter(|&i| knots.s[i - 1] < knots.s[i]).map(|i| i - 1);
        let lines: Vec<Line> = intervals
            .map(|i| Line {
                low: place(knots.s[i]),
                high: place(knots.s[i + 1]),
                // The outer lines are constant.
                start: if i == 0 { 0.0 } else { place(knots.s[i]) },
                value: knots.value[i],
                slope: if i == 0 { [0.0; 4] } else { knots.slope[i].map(|v| v / per_unit) },
            })
            .collect();
        let narrow = |l: &Line| Narrow { value: l.value.map(|v| v as f32), slope: l.slope.map(|v| v as f32) };
        let mut weights = [[0.0; MOST + 1]; MOST + 1];
        for (row, of) in weights.iter_mut().zip(&inverse(degree as usize)) {
            row.iter_mut().zip(of).for_each(|(w, of)| *w = *of as f32);
        }
        let length = |i: usize| longest * (i + 1).min(degree as usize) as f64 / f64::from(degree);
        Parabolas {
            size: size as usize,
            degree: degree as usize,
            direct: exact.direct,
            lengths: std::array::from_fn(|i| length(i) as f32),
            narrow: lines.iter().map(narrow).collect(),
            lines,
            constants: (0..size).map(|i| constant(exact, super::super::value(i, size))).collect(),
            weights,
            most: (OPAQUE_DEPTH / (longest * THINNEST)) as f32,
        }
    }

    /// Fills a table: a row for each sample in the middle, and in it those behind, of all powers.
    pub(super) fn fill(&self, texels: &mut [impl std::ops::DerefMut<Target = [[f32; 4]]>]) {
        let n = self.size;
        let mut rows: Vec<Vec<&mut [[f32; 4]]>> = (0..n * n).map(|_| vec![]).collect();
        for of in texels {
            of.chunks_exact_mut(n).zip(&mut rows).for_each(|(row, rows)| rows.push(row));
        }
        rows.par_iter_mut().enumerate().for_each(|(at, rows)| {
            dispatch!(Level::new(), simd => self.row(simd, [at % n, at / n], rows));
        });
    }

    #[inline(always)]
    fn row<S: Simd>(&self, simd: S, [m, b]: [usize; 2], rows: &mut [&mut [[f32; 4]]]) {
        let n = self.size;
        for first in (0..n).step_by(LANES) {
            let front: [f64; LANES] = std::array::from_fn(|l| (first + l).min(n - 1) as f64);
            let texels = self.eight(simd, f64x8::load_array(simd, front), m as f64, b as f64);
            for l in 0..LANES.min(n - first) {
                let f = first + l;
                let diagonal = f == m && f == b;
                for (k, row) in rows.iter_mut().enumerate() {
                    row[f] = if diagonal { self.constant(f, k) } else { std::array::from_fn(|c| texels[k][c][l]) };
                }
            }
        }
    }

    /// Coefficient `k` of a slab that has the value of texel `i` all along.
    fn constant(&self, i: usize, k: usize) -> [f32; 4] {
        let [density, r, g, b] = self.constants[i].map(|v| v as f32);
        if k == 0 { [r, g, b, density.min(self.most)] } else { [0.0; 4] }
    }

    /// Coefficients of all powers, by channel and parabola.
    #[inline(always)]
    fn eight<S: Simd>(&self, simd: S, f: f64x8<S>, m: f64, b: f64) -> [[[f32; LANES]; 4]; MOST + 1] {
        let parabola = [f + f + (2.0 * b - 4.0 * m), f * -3.0 + (4.0 * m - b), f];
        let (density, weighed, plain) = self.means(simd, &parabola);
        let zero = f32x8::splat(simd, 0.0);
        let density = narrow(simd, density).max(zero);
        let sums = self.colours(simd, &parabola);
        // Points of the polynomial, by channel.
        let mut points = [[zero; MOST + 1]; 3];
        let absorbs = density.simd_gt(zero);
        for k in 0..3 {
            let by_extinction = narrow(simd, weighed[k]) / density;
            let plain = narrow(simd, plain[k]);
            points[k][0] = if self.direct { plain } else { absorbs.select(by_extinction, plain) };
        }
        for i in 0..self.degree {
            let [r, g, b, alpha] = sums[i];
            let l = f32x8::splat(simd, self.lengths[i]);
            let depth = l * density;
            let (there, over) = if self.direct {
                let thin = depth.simd_lt(f32x8::splat(simd, FAINT));
                (l.simd_gt(zero), thin.select(depth.mul_add(l * -0.5, l), alpha / density))
            } else {
                (alpha.simd_gt(f32x8::splat(simd, NOTHING)), alpha)
            };
            for (k, color) in [r, g, b].into_iter().enumerate() {
                points[k][i + 1] = there.select(color / over, points[k][0]);
            }
        }
        let mut texels = [[[0.0; LANES]; 4]; MOST + 1];
        for (row, texel) in self.weights.iter().zip(&mut texels).take(self.degree + 1) {
            for k in 0..3 {
                let mut sum = zero;
                for (i, weight) in row.iter().enumerate().take(self.degree + 1) {
                    sum = points[k][i].mul_add(f32x8::splat(simd, *weight), sum);
                }
                sum.store_array(&mut texel[k]);
            }
        }
        density.min(f32x8::splat(simd, self.most)).store_array(&mut texels[0][3]);
        texels
    }

    /// Means along parabolas, by the parts of them that are above each knot.
    #[inline(always)]
    fn means<S: Simd>(&self, simd: S, parabola: &Eight<S>) -> Means<S> {
        let zero = f64x8::splat(simd, 0.0);
        let mut sums = (zero, [zero; 3], [zero; 3]);
        let whole = moments(simd, parabola, f64x8::splat(simd, 1.0));
        let mut above = whole;
        for line in &self.lines {
            let next = if line.high > self.size as f64 * 4.0 {
                [zero; 3]
            } else {
                beyond(simd, parabola, f64x8::splat(simd, line.high), &whole)
            };
            let [w0, w1, w2] = [above[0] - next[0], above[1] - next[1], above[2] - next[2]];
            above = next;
            let x1 = w1 - w0 * line.start;
            let x2 = w2 - (w1 * 2.0 - w0 * line.start) * line.start;
            let (v, m) = (line.value[0], line.slope[0]);
            sums.0 += w0 * v + x1 * m;
            for k in 0..3 {
                let (c, e) = (line.value[k + 1], line.slope[k + 1]);
                sums.1[k] += w0 * (v * c) + x1 * (v * e + m * c) + x2 * (m * e);
                sums.2[k] += w0 * c + x1 * e;
            }
        }
        sums
    }

    /// Premultiplied colours and opacities of slabs of all lengths.
    #[inline(always)]
    fn colours<S: Simd>(&self, simd: S, parabola: &Eight<S>) -> [[f32x8<S>; 4]; MOST] {
        let [a, b, c] = *parabola;
        let (zero, one) = (f64x8::splat(simd, 0.0), f64x8::splat(simd, 1.0));
        let mut sums = [[f32x8::splat(simd, 0.0); 4]; MOST];
        let mut on = !(a.simd_eq(zero) & b.simd_eq(zero));
        let convex = a.simd_ge(zero);
        let mut at = self.begin(&[a.into(), b.into(), c.into()]);
        let bends_up = convex.to_bitmask();
        let mut u = zero;
        let turn = b * -0.5 / a;
        // Each line is passed twice at most, and one is turned on.
        for _ in 0..2 * self.lines.len() + 3 {
            let column = |of: &dyn Fn(&Line) -> f64| f64x8::load_array(simd, at.map(|i| of(&self.lines[i])));
            let (low, high, start) = (column(&|l| l.low), column(&|l| l.high), column(&|l| l.start));
            let [first, _] = roots(simd, parabola, convex.select(low, high));
            let [_, second] = roots(simd, parabola, convex.select(high, low));
            let meets_first = first.simd_gt(u);
            let to = meets_first.select(first, second).min(one).max(u);
            // Where it turns it is cut: what rises and falls in one piece is of too high a degree for few nodes.
            let turns = turn.simd_gt(u) & turn.simd_lt(to);
            let to = turns.select(turn, to);
            let h = on.select(to - u, zero);
            let offset = a.mul_add(u, b).mul_add(u, c) - start;
            let rise = [h * (a * (u + u) + b), h * h * a];
            let rise = [narrow(simd, rise[0]), narrow(simd, rise[1])];
            self.add(simd, &at, narrow(simd, offset), rise, narrow(simd, h), &mut sums);
            on &= to.simd_lt(one);
            let (more, first) = (on.to_bitmask(), meets_first.to_bitmask());
            if more == 0 {
                break;
            }
            let leaves = more & !turns.to_bitmask();
            for (l, at) in at.iter_mut().enumerate().filter(|(l, _)| leaves >> l & 1 == 1) {
                // A convex one meets the lower knot first, a concave one the upper.
                let down = (bends_up ^ !first) >> l & 1 == 1;
                *at = if down { at.saturating_sub(1) } else { (*at + 1).min(self.lines.len() - 1) };
            }
            u = to;
        }
        sums
    }

    /// The lines that parabolas begin on; at a knot, those that they go to.
    fn begin(&self, [a, b, c]: &[[f64; LANES]; 3]) -> [usize; LANES] {
        std::array::from_fn(|l| {
            let rises = b[l] > 0.0 || b[l] == 0.0 && a[l] > 0.0;
            let before = self.lines.partition_point(|line| if rises { line.low <= c[l] } else { line.low < c[l] });
            before.max(1) - 1
        })
    }

    /// Puts pieces behind what there is: a share `h` of the lengths on the lines `at`, with values from `offset` on.
    #[inline(always)]
    fn add<S: Simd>(
        &self,
        simd: S,
        at: &[usize; LANES],
        offset: f32x8<S>,
        [first, second]: [f32x8<S>; 2],
        h: f32x8<S>,
        sums: &mut [[f32x8<S>; 4]; MOST],
    ) {
        let zero = f32x8::splat(simd, 0.0);
        let (mut value, mut slope) = ([zero; 4], [zero; 4]);
        for k in 0..4 {
            value[k] = f32x8::load_array(simd, at.map(|i| self.narrow[i].value[k]));
            slope[k] = f32x8::load_array(simd, at.map(|i| self.narrow[i].slope[k]));
        }
        let rise = [first, second, zero];
        for (sum, l) in sums.iter_mut().zip(self.lengths).take(self.degree) {
            let stretch = Stretch { offset, rise, length: h * l, value, slope, curve: zero };
            let own = stretch.integrate(simd, self.direct);
            let deep = own.depth.simd_gt(f32x8::splat(simd, DEEPEST));
            if deep.to_bitmask() == 0 {
                composite(simd, sum, own.color, own.alpha);
            } else {
                self.panels(simd, &stretch, sum);
            }
        }
    }

    /// Puts pieces of any depth behind what there is, in panels.
    #[inline(always)]
    fn panels<S: Simd>(&self, simd: S, whole: &Stretch<S>, sum: &mut [f32x8<S>; 4]) {
        let (zero, one) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 1.0));
        let [first, second, _] = whole.rise;
        let mut on = whole.length.simd_gt(zero);
        let mut u = zero;
        for panel in 0..PANELS {
            let offset = second.mul_add(u, first).mul_add(u, whole.offset);
            let rest = Stretch { offset, ..*whole };
            let (h, cut) = rest.shallow(simd, u, one - u, on, false);
            let part = rest.part(simd, u, h);
            let own = Stretch { length: on.select(part.length, zero), ..part }.integrate(simd, self.direct);
            let cut = mask32x8::from_bitmask(simd, cut);
            let to = cut.select(u + h, one);
            // What is too thin to tell and still deep, or has taken all panels, is opaque.
            let stuck = on & cut & (to.simd_le(u) | if panel + 1 == PANELS { on } else { on & !on });
            let mut color = own.color;
            for k in 0..3 {
                let shown = whole.slope[k + 1].mul_add(offset, whole.value[k + 1]);
                let shown = if self.direct { own.color[k] } else { shown };
                color[k] = stuck.select(shown, color[k]);
            }
            composite(simd, sum, color, stuck.select(one, own.alpha));
            on = on & cut & !stuck & sum[3].simd_lt(f32x8::splat(simd, 1.0 - DARK));
            if on.to_bitmask() == 0 {
                break;
            }
            u = to;
        }
    }
}

/// Puts colour and opacity behind a sum of such.
#[inline(always)]
fn composite<S: Simd>(simd: S, sum: &mut [f32x8<S>; 4], color: [f32x8<S>; 3], alpha: f32x8<S>) {
    let transmittance = f32x8::splat(simd, 1.0) - sum[3];
    for k in 0..3 {
        sum[k] = transmittance.mul_add(color[k], sum[k]);
    }
    sum[3] = transmittance.mul_add(alpha, sum[3]);
}

#[inline(always)]
fn narrow<S: Simd>(simd: S, v: f64x8<S>) -> f32x8<S> {
    let (low, high) = v.split();
    simd.narrow_f64x4(low, high)
}

/// Antiderivatives of 1, s and s² at `u`, from 0 on.
#[inline(always)]
fn moments<S: Simd>(_: S, [a, b, c]: &Eight<S>, u: f64x8<S>) -> [f64x8<S>; 3] {
    let (a, b, c) = (*a, *b, *c);
    let first = (a * (1.0 / 3.0)).mul_add(u, b * 0.5).mul_add(u, c) * u;
    let second = (a * a * (1.0 / 5.0)).mul_add(u, a * b * 0.5).mul_add(u, (b * b + a * c * 2.0) * (1.0 / 3.0));
    [u, first, second.mul_add(u, b * c).mul_add(u, c * c) * u]
}

/// Where parabolas have the values `k`, ascending; nowhere, from −∞ to ∞. Those that are linear have one root at infinity.
#[inline(always)]
fn roots<S: Simd>(simd: S, [a, b, c]: &Eight<S>, k: f64x8<S>) -> [f64x8<S>; 2] {
    let (a, b, zero) = (*a, *b, f64x8::splat(simd, 0.0));
    let off = *c - k;
    let square = b * b - a * off * 4.0;
    let root = square.max(zero).sqrt();
    // The stable of the two formulas for each.
    let q = (b + b.simd_ge(zero).select(root, zero - root)) * -0.5;
    let far = q / a;
    let near = q.simd_eq(zero).select(zero, off / q);
    let none = square.simd_lt(zero);
    let [least, most] = [f64::NEG_INFINITY, f64::INFINITY].map(|v| f64x8::splat(simd, v));
    let below = near.simd_lt(far);
    [none.select(least, below.select(near, far)), none.select(most, below.select(far, near))]
}

/// The integrals of 1, s and s² over where parabolas are above `k`, if they are `whole` over [0, 1].
#[inline(always)]
fn beyond<S: Simd>(simd: S, parabola: &Eight<S>, k: f64x8<S>, whole: &[f64x8<S>; 3]) -> [f64x8<S>; 3] {
    let (zero, one) = (f64x8::splat(simd, 0.0), f64x8::splat(simd, 1.0));
    let [from, to] = roots(simd, parabola, k);
    let none: mask64x8<S> =
        from.simd_eq(f64x8::splat(simd, f64::NEG_INFINITY)) & to.simd_eq(f64x8::splat(simd, f64::INFINITY));
    let [from, to] = [from, to].map(|u| none.select(zero, u.max(zero).min(one)));
    let (from, to) = (moments(simd, parabola, from), moments(simd, parabola, to));
    let convex = parabola[0].simd_ge(zero);
    let mut all = [zero; 3];
    for k in 0..3 {
        let inside = to[k] - from[k];
        all[k] = convex.select(whole[k] - inside, inside);
    }
    all
}
