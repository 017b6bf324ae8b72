//! Measure: what the fragments of a cell emit and absorb. A fragment is a pixel's ray inside the cell; those of a block are a
//! vector. A scalar's are integrated line by line of the transfer function and added to the pixels as they are; the rest, of any
//! field and integral, one by one.

use super::find::MOST_BLOCKS;
use super::fine::{Canvas, PIXELS, window, window_mut};
use super::lanes::{FAINT, Floats, LANES, piece};
use super::setup::{Record, Records, Scene};
use crate::integral::{Exact, Integral};
use crate::view::Blend;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, mask32x16};

/// So many lines are tried one after another.
const FEW_LINES: usize = 3;

/// So many pieces of any fragments are integrated at a time.
const ENOUGH: usize = 256;

/// Pieces of any fragments, in the order of their cells.
pub(super) type Parts = Vec<Part>;

/// A piece of any fragment: extinction and colour at both ends, length, pixel.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Part {
    front: [f32; 4],
    back: [f32; 4],
    length: f32,
    pixel: usize,
}

/// What vectors of fragments emit and absorb: red, green and blue, and opacity.
type Lit<S> = ([Floats<S>; 3], Floats<S>);

/// What pieces on line `k` of the function do, between these values, of this length, and of these optical depths at their ends.
#[inline(always)]
fn lit<S: Simd, const N: usize>(
    simd: S,
    scene: &Scene<N>,
    exact: &Exact<f32>,
    k: usize,
    ends: [Floats<S>; 2],
    length: Floats<S>,
    [x, y]: [Floats<S>; 2],
) -> Lit<S> {
    let of = |v: f32| Floats::splat(simd, v);
    let (f, b) = (ends[0] - exact.opacity.s[k], ends[1] - exact.opacity.s[k]);
    let [alpha, front, back] = piece(simd, x, y, exact.direct);
    let moment = f.mul_add(front, b * back);
    let (sum, moment) = if exact.direct { ((front + back) * length, moment * length) } else { (alpha, moment) };
    let [value, slope] = &scene.runs.colors[k];
    let color = |c: usize| of(slope[c]).mul_add(moment, sum * value[c]);
    ([color(0), color(1), color(2)], alpha)
}

/// The optical depths of pieces of this length where they begin and end with these values, by the extinction at the lower knot of
/// line `k` and its slope from there on.
#[inline(always)]
fn depths<S: Simd>(
    simd: S,
    exact: &Exact<f32>,
    k: usize,
    slope: f32,
    ends: [Floats<S>; 2],
    length: Floats<S>,
) -> [Floats<S>; 2] {
    let (value, slope) = (Floats::splat(simd, exact.opacity.value[k][0]), Floats::splat(simd, slope));
    let (f, b) = (ends[0] - exact.opacity.s[k], ends[1] - exact.opacity.s[k]);
    [f.mul_add(slope, value) * length, b.mul_add(slope, value) * length]
}

impl<const N: usize> Canvas<N> {
    /// Adds what the fragments found emit and absorb.
    #[inline(always)]
    pub(super) fn measure<S: Simd>(&mut self, simd: S, scene: &Scene<N>, integral: &Integral, records: &Records<N>) {
        // Other numbers of values have no second variable, nor its code.
        if let (2 | 5, Some(two)) = (N, &integral.second) {
            return self.measure_two(simd, scene, two, records);
        }
        if N == 1 && integral.table.is_none() && scene.blend == Blend::Composite {
            self.find_values(simd, records);
            return self.add_scalars(simd, scene, integral.exact, records);
        }
        for i in 0..self.found.count.min(MOST_BLOCKS) {
            let r = self.found.record(records, i);
            let [x, y] = self.found.pixels_from(simd, r, i);
            let [first, second, length] = self.span(simd, r, i);
            length.store_array(&mut self.found.length[i]);
            let ends = [&self.found.enter[i], &self.found.leave[i]].map(|v| Floats::load_array_ref(simd, v));
            let fragments = ends[0].simd_lt(ends[1]).to_bitmask();
            self.split(scene, integral, r, i, fragments, &[first, second, length, x, y].map(Floats::to_array));
            if self.parts.len() > ENOUGH || r.dark < f32::INFINITY {
                self.integrate_parts(simd, integral.exact.direct);
            }
            if r.dark < f32::INFINITY {
                self.doubt(i, r.dark);
            }
        }
        self.integrate_parts(simd, integral.exact.direct);
    }

    /// Depths beyond R's at which the fragments of the `i`-th block begin and end, and their lengths.
    #[inline(always)]
    pub(super) fn span<S: Simd>(&self, simd: S, r: &Record<N>, i: usize) -> [Floats<S>; 3] {
        let load = |v: &[f32; LANES]| Floats::load_array_ref(simd, v);
        let one = Floats::splat(simd, 1.0);
        let (enter, leave) = (load(&self.found.enter[i]), load(&self.found.leave[i]));
        let (p, q) = (one - enter * r.kappa, one - leave * r.kappa);
        let over = one / (p * q);
        let stretch = load(window(&self.stretch, self.found.place(i)));
        [enter * q * over, leave * p * over, (leave - enter) * over * stretch]
    }

    /// Finds the values of a scalar where the fragments begin and end, and their lengths.
    #[inline(always)]
    fn find_values<S: Simd>(&mut self, simd: S, records: &Records<N>) {
        for i in 0..self.found.count.min(MOST_BLOCKS) {
            let r = self.found.record(records, i);
            let [first, second, length] = self.span(simd, r, i);
            let [x, y] = self.found.pixels_from(simd, r, i);
            let [s, gx, gy, gz] = r.field[0];
            let side = x * gx + y * gy;
            let (base, along) = (side + s, side * r.kappa + gz);
            let value = |t: Floats<S>| (t.mul_add(along, base)).max(Floats::splat(simd, r.span[0][0]));
            let value = |t: Floats<S>| value(t).min(Floats::splat(simd, r.span[0][1]));
            value(first).store_array(&mut self.found.enter[i]);
            value(second).store_array(&mut self.found.leave[i]);
            length.store_array(&mut self.found.length[i]);
        }
    }

    /// Adds fragments of a scalar, of which the values are found.
    #[inline(always)]
    fn add_scalars<S: Simd>(&mut self, simd: S, scene: &Scene<N>, exact: &Exact<f32>, records: &Records<N>) {
        let load = |v: &[f32; LANES]| Floats::load_array_ref(simd, v);
        for i in 0..self.found.count.min(MOST_BLOCKS) {
            let r = self.found.record(records, i);
            let (front, back, length) =
                (load(&self.found.enter[i]), load(&self.found.leave[i]), load(&self.found.length[i]));
            let lines = r.lines.map(usize::from);
            let (color, alpha) = if lines[0] == lines[1] {
                let depths = depths(simd, exact, lines[0], exact.opacity.slope[lines[0]][0], [front, back], length);
                lit(simd, scene, exact, lines[0], [front, back], length, depths)
            } else {
                on_lines(simd, scene, exact, lines, [front, back], length)
            };
            let at = self.found.place(i);
            let transmittance = load(window(&self.light[3], at));
            for (light, &color) in self.light.iter_mut().zip(&color) {
                let light = window_mut(light, at);
                transmittance.mul_add(color, load(light)).store_array(light);
            }
            (-transmittance).mul_add(alpha, transmittance).store_array(window_mut(&mut self.light[3], at));
            if r.dark < f32::INFINITY {
                self.doubt(i, r.dark);
            }
        }
    }

    /// Splits fragments of a block into pieces, or adds what they are to their pixels where that is not a sum of pieces.
    #[inline(never)]
    fn split(
        &mut self,
        scene: &Scene<N>,
        integral: &Integral,
        r: &Record<N>,
        i: usize,
        fragments: u64,
        [first, second, length, x, y]: &[[f32; LANES]; 5],
    ) {
        let at = self.found.place(i);
        for l in (0..LANES).filter(|l| fragments >> l & 1 == 1) {
            let value = |t: f32| {
                std::array::from_fn(|n| {
                    let [s, gx, gy, gz] = r.field[n];
                    let side = x[l] * gx + y[l] * gy;
                    (s + side + t * (gz + r.kappa * side)).max(r.span[n][0]).min(r.span[n][1])
                })
            };
            let pixel = (at + l) % PIXELS;
            let (front, back): ([f32; N], [f32; N]) = (value(first[l]), value(second[l]));
            if integral.table.is_some() || scene.blend == Blend::Maximum {
                self.gather(scene.blend, integral, pixel, &front, &back, length[l]);
                continue;
            }
            integral.exact.for_each_piece(&front, &back, |front, back, share| {
                self.parts.push(Part { front, back, length: share * length[l], pixel });
            });
        }
    }

    /// Integrates pieces of any fragments, and adds them to their pixels, in order.
    #[inline(always)]
    pub(super) fn integrate_parts<S: Simd>(&mut self, simd: S, direct: bool) {
        for parts in self.parts.chunks(LANES) {
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
                let transmittance = self.light[3][pixel];
                for (light, lit) in self.light.iter_mut().zip(&lit) {
                    light[pixel] += transmittance * lit[l];
                }
            }
        }
        self.parts.clear();
    }
}

/// What fragments do between these values, on the lines of the function from one to another: from the least value upward, run by run
/// where little is absorbed, else line by line. Pieces come before those so far where the value falls along the ray, behind them
/// where it rises.
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
    let (runs, mut by_runs) = (scene.runs, !exact.direct && last - first > FEW_LINES);
    // Two runs are tried before it is known which lines the block is on.
    if !by_runs || runs.last((runs.last(first) + 1).min(last)) < last {
        [first, last] = of_block(simd, exact, [first, last], there, [least, most]);
    }
    let per = length / flat.select(one, rise);
    let (mut color, mut alpha) = ([zero; 3], zero);
    let mut next = first;
    while next <= last {
        let k = next;
        let until = if by_runs { runs.last(k).min(last) } else { k };
        let (low, high) = (of(knots.s[k]), of(knots.s[until + 1]));
        let ends = [front.max(low).min(high), back.max(low).min(high)];
        // All of it, or a part. A constant is on the line that begins there.
        let within = least.simd_ge(low) & most.simd_le(high) & !(flat & most.simd_ge(high));
        let some = there & (within | ends[0].simd_lt(ends[1]) | ends[1].simd_lt(ends[0]));
        if some.to_bitmask() == 0 {
            next = until + 1;
            continue;
        }
        let part = some.select(within.select(length, (ends[1] - ends[0]) * per), zero);
        let slope = if until > k { runs.slope(k) } else { knots.slope[k][0] };
        let depths = depths(simd, exact, k, slope, ends, part);
        if until > k && depths[0].max(depths[1]).simd_gt(of(FAINT)).to_bitmask() != 0 {
            by_runs = false;
            [next, last] = of_block(simd, exact, [next, last], there, [least, most]);
            continue;
        }
        next = until + 1;
        let (mut own, opacity) = lit(simd, scene, exact, k, ends, part, depths);
        if until > k {
            runs.bend(simd, knots, k + 1..=until, ends, [depths[0], depths[1], opacity], &mut own);
        }
        let (seen_so_far, seen_own) = (rises.select(one, one - opacity), rises.select(one - alpha, one));
        for c in 0..3 {
            color[c] = color[c].mul_add(seen_so_far, own[c] * seen_own);
        }
        alpha = (one - alpha).mul_add(opacity, alpha);
    }
    (color, alpha)
}

/// Of a cell's lines, from one to another, those that the fragments of a block are on.
#[inline(always)]
fn of_block<S: Simd>(
    simd: S,
    exact: &Exact<f32>,
    [first, last]: [usize; 2],
    there: mask32x16<S>,
    [least, most]: [Floats<S>; 2],
) -> [usize; 2] {
    if last - first <= FEW_LINES {
        return [first, last];
    }
    let low = there.select(least, Floats::splat(simd, f32::INFINITY)).reduce_min();
    let high = there.select(most, Floats::splat(simd, f32::NEG_INFINITY)).reduce_max();
    [first.max(exact.opacity.interval(low)), last.min(exact.opacity.interval(high))]
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
