//! Measure: what the fragments of a cell emit and absorb. A fragment is a pixel's ray inside the cell; those of a block are a
//! vector. A scalar's are integrated line by line of the transfer function and added to the pixels as they are; the rest, of any
//! field and integral, one by one.

use super::fine::{ACROSS, ACROSS_BLOCK, BLOCKS, Canvas, DOWN_BLOCK, PIXELS};
use super::lanes::{Floats, LANES, piece};
use super::setup::{Record, Scene};
use crate::integral::{Exact, Integral};
use crate::view::Blend;
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// So many lines are tried one after another.
const FEW_LINES: usize = 3;

/// So many pieces of any fragments are integrated at a time.
const ENOUGH: usize = 256;

/// The fragments of a cell, block by block: v ([`super::setup`]) where each pixel's ray enters and leaves. Both are 0 for a ray that
/// misses the cell.
#[derive(Debug)]
pub(super) struct Fragments {
    pub(super) enter: [[f32; LANES]; BLOCKS],
    pub(super) leave: [[f32; LANES]; BLOCKS],
    pub(super) block: [u32; BLOCKS],
    /// Blocks, and fragments.
    pub(super) count: usize,
    pub(super) fragments: u32,
    parts: Vec<Part>,
}

/// A piece of any fragment: extinction and colour at both ends, length, pixel.
#[derive(Debug, Clone, Copy, Default)]
struct Part {
    front: [f32; 4],
    back: [f32; 4],
    length: f32,
    pixel: usize,
}

impl Default for Fragments {
    fn default() -> Self {
        let none = [[0.0; LANES]; BLOCKS];
        Fragments { enter: none, leave: none, block: [0; BLOCKS], count: 0, fragments: 0, parts: vec![] }
    }
}

impl Fragments {
    /// Keeps a block as the one with number `at`.
    #[inline(always)]
    pub(super) fn keep<S: Simd>(&mut self, at: usize, block: usize, enter: Floats<S>, leave: Floats<S>) {
        let at = at % BLOCKS;
        enter.store_array(&mut self.enter[at]);
        leave.store_array(&mut self.leave[at]);
        self.block[at] = block as u32;
    }

    /// Cuts off what lies outside the keys `limits` of each pixel.
    #[inline(always)]
    pub(super) fn limit<S: Simd>(
        &mut self,
        simd: S,
        limits: &[[[f32; LANES]; BLOCKS]; 2],
        [base, _, inverse]: [f32; 3],
    ) {
        let zero = Floats::splat(simd, 0.0);
        self.fragments = 0;
        for i in 0..self.count.min(BLOCKS) {
            let [low, high] = [0, 1].map(|k| {
                let limit = Floats::load_array_ref(simd, &limits[k][self.block[i] as usize % BLOCKS]);
                (limit - base) * inverse
            });
            let (enter, leave) =
                (Floats::load_array_ref(simd, &self.enter[i]), Floats::load_array_ref(simd, &self.leave[i]));
            let inside = enter.simd_lt(leave);
            let (enter, leave) = (enter.max(low), leave.min(high));
            let inside = inside & enter.simd_lt(leave);
            self.fragments += inside.to_bitmask().count_ones();
            inside.select(enter, zero).store_array(&mut self.enter[i]);
            inside.select(leave, zero).store_array(&mut self.leave[i]);
        }
    }
}

/// What vectors of fragments emit and absorb: red, green and blue, and opacity.
type Lit<S> = ([Floats<S>; 3], Floats<S>);

/// What pieces on line `k` of the function do, between these values and of this length.
#[inline(always)]
fn lit<S: Simd, const N: usize>(
    simd: S,
    scene: &Scene<N>,
    exact: &Exact<f32>,
    k: usize,
    ends: [Floats<S>; 2],
    length: Floats<S>,
) -> Lit<S> {
    let of = |v: f32| Floats::splat(simd, v);
    let knots = &exact.opacity;
    let (value, slope) = (of(knots.value[k][0]), of(knots.slope[k][0]));
    let (f, b) = (ends[0] - knots.s[k], ends[1] - knots.s[k]);
    let [alpha, front, back] =
        piece(simd, f.mul_add(slope, value) * length, b.mul_add(slope, value) * length, exact.direct);
    let moment = f.mul_add(front, b * back);
    let (sum, moment) = if exact.direct { ((front + back) * length, moment * length) } else { (alpha, moment) };
    let [value, slope] = &scene.colors[k];
    let color = |c: usize| of(slope[c]).mul_add(moment, sum * value[c]);
    ([color(0), color(1), color(2)], alpha)
}

impl<const N: usize> Canvas<N> {
    /// Adds what the fragments found of a cell emit and absorb.
    #[inline(always)]
    pub(super) fn measure<S: Simd>(&mut self, simd: S, scene: &Scene<N>, integral: &Integral, r: &Record<N>) {
        let exact = integral.table.is_none() && scene.blend == Blend::Composite;
        simd.vectorize(
            #[inline(always)]
            || match (N, exact) {
                (1, true) => self.scalars(simd, scene, integral.exact, r),
                _ => self.any(simd, scene, integral, r),
            },
        );
    }

    /// Depths beyond R's at which the fragments of the `i`-th block begin and end, their lengths (0 where there is none), and x and y
    /// from R.
    #[inline(always)]
    fn spans<S: Simd>(&self, simd: S, r: &Record<N>, i: usize) -> [Floats<S>; 5] {
        let one = Floats::splat(simd, 1.0);
        let (found, block) = (&self.found, self.found.block[i] as usize % BLOCKS);
        let load = |v: &[f32; LANES]| Floats::load_array_ref(simd, v);
        let (enter, leave) = (load(&found.enter[i]), load(&found.leave[i]));
        let kappa = Floats::splat(simd, r.kappa);
        let (p, q) = (one - kappa * enter, one - kappa * leave);
        let over = one / (p * q);
        let (first, second) = (enter * q * over, leave * p * over);
        let length = (leave - enter) * over * load(&self.stretch[block]);
        // Whole pixels first, which are exact.
        let (left, top) = ((block % ACROSS * 4) as f32 - r.at[0], (block / ACROSS * 4) as f32 - r.at[1]);
        [first, second, length, (load(&ACROSS_BLOCK) + left) - r.rest[0], (load(&DOWN_BLOCK) + top) - r.rest[1]]
    }

    /// Adds fragments of a scalar.
    #[inline(always)]
    fn scalars<S: Simd>(&mut self, simd: S, scene: &Scene<N>, exact: &Exact<f32>, r: &Record<N>) {
        let of = |v: f32| Floats::splat(simd, v);
        let [s, gx, gy, gz] = r.field[0];
        let (low, high) = (of(r.span[0][0]), of(r.span[0][1]));
        let lines = r.lines.map(usize::from);
        for i in 0..self.found.count.min(BLOCKS) {
            let [first, second, length, x, y] = self.spans(simd, r, i);
            let side = x.mul_add(of(gx), y * gy);
            let (base, along) = (side + s, side.mul_add(of(r.kappa), of(gz)));
            let ends = [first, second].map(|t| t.mul_add(along, base).max(low).min(high));
            let (color, alpha) = if lines[0] == lines[1] {
                lit(simd, scene, exact, lines[0], ends, length)
            } else {
                on_lines(simd, scene, exact, lines, ends, length)
            };
            let light = &mut self.light[self.found.block[i] as usize % BLOCKS];
            let transmittance = Floats::load_array_ref(simd, &light[3]);
            for k in 0..3 {
                let sum = transmittance.mul_add(color[k], Floats::load_array_ref(simd, &light[k]));
                sum.store_array(&mut light[k]);
            }
            (-transmittance).mul_add(alpha, transmittance).store_array(&mut light[3]);
        }
    }

    /// Any field and integral, fragment by fragment.
    #[inline(always)]
    fn any<S: Simd>(&mut self, simd: S, scene: &Scene<N>, integral: &Integral, r: &Record<N>) {
        for i in 0..self.found.count.min(BLOCKS) {
            let spans = self.spans(simd, r, i).map(Floats::to_array);
            self.split(scene, integral, r, i, &spans);
            if self.found.parts.len() > ENOUGH {
                self.integrate_parts(simd, integral.exact.direct);
            }
        }
        self.integrate_parts(simd, integral.exact.direct);
    }

    /// Splits the fragments of the `i`-th block into pieces, or adds what they are to their pixels where that is not a sum of pieces.
    #[inline(never)]
    fn split(
        &mut self,
        scene: &Scene<N>,
        integral: &Integral,
        r: &Record<N>,
        i: usize,
        [first, second, length, x, y]: &[[f32; LANES]; 5],
    ) {
        for l in 0..LANES {
            if self.found.enter[i][l] >= self.found.leave[i][l] {
                continue;
            }
            let value = |t: f32| {
                std::array::from_fn(|n| {
                    let [s, gx, gy, gz] = r.field[n];
                    let side = x[l] * gx + y[l] * gy;
                    (s + side + t * (gz + r.kappa * side)).max(r.span[n][0]).min(r.span[n][1])
                })
            };
            let pixel = (self.found.block[i] as usize * LANES + l) % PIXELS;
            let (front, back): ([f32; N], [f32; N]) = (value(first[l]), value(second[l]));
            if integral.table.is_some() || scene.blend == Blend::Maximum {
                self.gather(scene.blend, integral, pixel, &front, &back, length[l]);
                continue;
            }
            integral.exact.for_each_piece(&front, &back, |front, back, share| {
                self.found.parts.push(Part { front, back, length: share * length[l], pixel });
            });
        }
    }

    /// Integrates pieces of any fragments, and adds them to their pixels, in order.
    #[inline(always)]
    fn integrate_parts<S: Simd>(&mut self, simd: S, direct: bool) {
        for parts in self.found.parts.chunks(LANES) {
            let mut some = [Part::default(); LANES];
            some[..parts.len()].copy_from_slice(parts);
            let (front, back) = (columns(simd, some.map(|p| p.front)), columns(simd, some.map(|p| p.back)));
            let length = Floats::load_array(simd, some.map(|p| p.length));
            let [alpha, f, b] = piece(simd, front[0] * length, back[0] * length, direct);
            let [f, b] = if direct { [f * length, b * length] } else { [f, b] };
            let color = |c: usize| front[c].mul_add(f, back[c] * b);
            let lit = [color(1), color(2), color(3), -alpha].map(Floats::to_array);
            for (l, part) in parts.iter().enumerate() {
                let pixel = part.pixel % PIXELS;
                let light = &mut self.light[pixel / LANES];
                let transmittance = light[3][pixel % LANES];
                for k in 0..4 {
                    light[k][pixel % LANES] += transmittance * lit[k][l];
                }
            }
        }
        self.found.parts.clear();
    }
}

/// What fragments do between these values, on the lines of the function from one to another: from the least value upward. Pieces come
/// before those so far where the value falls along the ray, behind them where it rises.
#[inline(always)]
fn on_lines<S: Simd, const N: usize>(
    simd: S,
    scene: &Scene<N>,
    exact: &Exact<f32>,
    [mut first, mut last]: [usize; 2],
    [front, back]: [Floats<S>; 2],
    length: Floats<S>,
) -> Lit<S> {
    let of = |v: f32| Floats::splat(simd, v);
    let (zero, one) = (of(0.0), of(1.0));
    let knots = &exact.opacity;
    let there = length.simd_gt(zero);
    let rise = back - front;
    let (flat, rises) = (rise.simd_eq(zero), rise.simd_ge(zero));
    let (least, most) = (front.min(back), front.max(back));
    // Lines that only the cell's other fragments are on.
    if last - first > FEW_LINES {
        let low = there.select(least, of(f32::INFINITY)).reduce_min();
        let high = there.select(most, of(f32::NEG_INFINITY)).reduce_max();
        first += knots.s[first + 1..=last].iter().take_while(|&&s| s < low).count();
        last -= knots.s[first + 1..=last].iter().rev().take_while(|&&s| s > high).count();
    }
    let per = length / flat.select(one, rise);
    let (mut color, mut alpha) = ([zero; 3], zero);
    for k in first..=last {
        let (low, high) = (of(knots.s[k]), of(knots.s[k + 1]));
        let ends = [front.max(low).min(high), back.max(low).min(high)];
        // All of it, or a part. A constant is on the line that begins there.
        let within = least.simd_ge(low) & most.simd_le(high) & !(flat & most.simd_ge(high));
        let some = there & (within | ends[0].simd_lt(ends[1]) | ends[1].simd_lt(ends[0]));
        if some.to_bitmask() == 0 {
            continue;
        }
        let part = some.select(within.select(length, (ends[1] - ends[0]) * per), zero);
        let (own, opacity) = lit(simd, scene, exact, k, ends, part);
        let (seen_so_far, seen_own) = (rises.select(one, one - opacity), rises.select(one - alpha, one));
        for c in 0..3 {
            color[c] = color[c].mul_add(seen_so_far, own[c] * seen_own);
        }
        alpha = (one - alpha).mul_add(opacity, alpha);
    }
    (color, alpha)
}

/// Rows of four as four columns.
#[inline(always)]
fn columns<S: Simd>(simd: S, rows: [[f32; 4]; LANES]) -> [Floats<S>; 4] {
    let flat = rows.as_flattened();
    let four = |k: usize| {
        let mut four = [0.0; 16];
        four.copy_from_slice(&flat[16 * k..16 * k + 16]);
        simd.load_four_interleaved_f32x4(&four)
    };
    let all = [four(0), four(1), four(2), four(3)];
    let column = |c: usize| all[0][c].combine(all[1][c]).combine(all[2][c].combine(all[3][c]));
    [column(0), column(1), column(2), column(3)]
}
