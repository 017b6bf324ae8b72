//! Measure: what the fragments of a cell emit and absorb. A fragment is a pixel's ray inside the cell. Those that were found are kept
//! side by side, so all lanes have work: measured, split where the value crosses a knot of the transfer function, integrated, and
//! added to their pixels. No pixel occurs twice in a cell but with pieces of one ray, which are in order.

use super::fine::{Canvas, PIXELS};
use super::lanes::{Floats, Ints, LANES, Mask, NUMBERS, keep, keep_ints, piece};
use super::setup::{Record, Scene};
use crate::integral::{Exact, Integral};
use crate::view::Blend;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4};

/// As many fragments as a tile has pixels, and the lanes beyond the last.
const ROOM: usize = PIXELS + LANES;

/// So many lines are tried one after another.
const FEW_LINES: usize = 3;

/// So many pieces are integrated at a time.
const ENOUGH: usize = 256;

/// There is room for those of one more cell.
const WAITING: usize = ENOUGH + ROOM + LANES;

/// The fragments of a cell: v ([`super::setup`]) where the ray enters and leaves, and the pixel.
#[derive(Debug)]
pub(super) struct Fragments {
    enter: [f32; ROOM],
    leave: [f32; ROOM],
    pub(super) pixel: [i32; ROOM],
    pub(super) count: usize,
    waiting: Box<Waiting>,
    parts: Vec<Part>,
}

/// Pieces of a scalar's fragments, from front to back: optical depths if extinction were as at either end all along, values from the
/// lower knot of the line at both ends, length, and pixel + line · 2¹⁶. Then what they do.
#[derive(Debug)]
struct Waiting {
    depth: [[f32; WAITING]; 2],
    value: [[f32; WAITING]; 2],
    length: [f32; WAITING],
    id: [i32; WAITING],
    count: usize,
    /// Opacity; the sum of the weights of the emission at both ends; and of weights times values.
    alpha: [f32; WAITING],
    sum: [f32; WAITING],
    moment: [f32; WAITING],
}

/// A piece of any fragment: extinction and colour at both ends, length, pixel.
#[derive(Debug, Clone, Copy, Default)]
struct Part {
    front: [f32; 4],
    back: [f32; 4],
    length: f32,
    pixel: i32,
}

impl Default for Fragments {
    fn default() -> Self {
        let none = [0.0; WAITING];
        let waiting = Waiting {
            depth: [none; 2],
            value: [none; 2],
            length: none,
            id: [0; WAITING],
            count: 0,
            alpha: none,
            sum: none,
            moment: none,
        };
        let waiting = Box::new(waiting);
        Fragments { enter: [0.0; ROOM], leave: [0.0; ROOM], pixel: [0; ROOM], count: 0, waiting, parts: vec![] }
    }
}

impl Fragments {
    /// Keeps the lanes that are `inside` behind the first `at` fragments; returns how many they are.
    #[inline(always)]
    pub(super) fn add<S: Simd>(
        &mut self,
        simd: S,
        at: usize,
        inside: Mask<S>,
        enter: Floats<S>,
        leave: Floats<S>,
        pixel: Ints<S>,
    ) -> usize {
        // No block begins behind the last pixel but one block.
        let at = at % PIXELS;
        keep(simd, enter, inside, &mut self.enter[at..at + LANES]);
        keep(simd, leave, inside, &mut self.leave[at..at + LANES]);
        keep_ints(simd, pixel, inside, &mut self.pixel[at..at + LANES]);
        inside.to_bitmask().count_ones() as usize
    }
}

impl Fragments {
    /// Cuts off what lies outside the keys `limits` of each pixel.
    pub(super) fn limit(&mut self, limits: impl Fn(usize) -> [f32; 2], [base, _, inverse]: [f32; 3]) {
        let mut kept = 0;
        for i in 0..self.count {
            let pixel = self.pixel[i];
            let [low, high] = limits(pixel as usize % PIXELS).map(|key| (key - base) * inverse);
            let (enter, leave) = (self.enter[i].max(low), self.leave[i].min(high));
            if enter < leave {
                (self.enter[kept], self.leave[kept], self.pixel[kept]) = (enter, leave, pixel);
                kept += 1;
            }
        }
        self.count = kept;
    }
}

impl Waiting {
    /// Whether eight pieces more do not fit, with zeros for the lanes beyond the last.
    #[inline(always)]
    fn is_full(&self) -> bool {
        self.count > WAITING - 2 * LANES
    }

    /// Keeps up to eight pieces behind the others; `count` says how many they are.
    #[inline(always)]
    fn add<S: Simd>(
        &mut self,
        depth: [Floats<S>; 2],
        value: [Floats<S>; 2],
        length: Floats<S>,
        id: Ints<S>,
        count: usize,
    ) {
        let at = self.count.min(WAITING - 2 * LANES);
        depth[0].store_slice(&mut self.depth[0][at..at + LANES]);
        depth[1].store_slice(&mut self.depth[1][at..at + LANES]);
        value[0].store_slice(&mut self.value[0][at..at + LANES]);
        value[1].store_slice(&mut self.value[1][at..at + LANES]);
        length.store_slice(&mut self.length[at..at + LANES]);
        id.store_slice(&mut self.id[at..at + LANES]);
        self.count = at + count;
    }

    /// Integrates all, in loops of their own: so the processor finds work that does not wait for its like.
    #[inline(always)]
    fn integrate<S: Simd>(&mut self, simd: S, direct: bool) {
        let count = self.count.min(WAITING - LANES);
        // Which series is taken for eight pieces must not depend on what was here before.
        for v in self.depth.iter_mut().chain(&mut self.value).chain([&mut self.length]) {
            v[count..count + LANES].fill(0.0);
        }
        for i in (0..count).step_by(LANES) {
            let load = |v: &[f32; WAITING]| Floats::from_slice(simd, &v[i..i + LANES]);
            let (x, y) = (load(&self.depth[0]), load(&self.depth[1]));
            let [alpha, front, back] = piece(simd, x, y, direct);
            let (f, b) = (load(&self.value[0]), load(&self.value[1]));
            let moment = f.mul_add(front, b * back);
            alpha.store_slice(&mut self.alpha[i..i + LANES]);
            if direct {
                let length = load(&self.length);
                ((front + back) * length).store_slice(&mut self.sum[i..i + LANES]);
                (moment * length).store_slice(&mut self.moment[i..i + LANES]);
            } else {
                moment.store_slice(&mut self.moment[i..i + LANES]);
            }
        }
    }

    /// Adds all to their pixels, in order, and forgets them. `colors` are red, green and blue of each line at its lower knot, and
    /// their slopes.
    #[inline(always)]
    fn composite<S: Simd>(&mut self, simd: S, light: &mut [[f32; 4]; PIXELS], colors: &[[[f32; 4]; 2]], direct: bool) {
        let count = std::mem::take(&mut self.count).min(WAITING - LANES);
        let sum = if direct { &self.sum } else { &self.alpha };
        for i in (0..count).step_by(LANES) {
            let range = i..i + LANES;
            let (ids, alpha, sum, moment) =
                (&self.id[range.clone()], &self.alpha[range.clone()], &sum[range.clone()], &self.moment[range]);
            let some = (count - i).min(LANES);
            let line = ids[0] as u32 >> 16;
            let on_it = (Ints::from_slice(simd, ids) >> 16).simd_eq(Ints::splat(simd, ids[0] >> 16)).to_bitmask();
            let all = on_it.trailing_ones() as usize >= some;
            if let (true, Some([value, slope])) = (all, colors.get(line as usize)) {
                let [alpha, sum, moment] = [alpha, sum, moment].map(|v| Floats::from_slice(simd, v));
                let color = |c: usize| Floats::splat(simd, slope[c]).mul_add(moment, sum * value[c]);
                add(simd, light, [color(0), color(1), color(2), alpha], &ids[..some]);
                continue;
            }
            // As above, piece by piece.
            let absorbed = f32x4::load_array(simd, [0.0, 0.0, 0.0, -1.0]);
            for (((&id, &sum), &alpha), &moment) in ids[..some].iter().zip(sum).zip(alpha).zip(moment) {
                let Some([value, slope]) = colors.get((id as u32 >> 16) as usize) else { continue };
                let (value, slope) = (f32x4::load_array_ref(simd, value), f32x4::load_array_ref(simd, slope));
                let lit = slope.mul_add(f32x4::splat(simd, moment), value * sum);
                add_one(simd, light, absorbed.mul_add(f32x4::splat(simd, alpha), lit), id);
            }
        }
    }
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

impl<const N: usize> Canvas<N> {
    /// Adds what the fragments found of a cell emit and absorb.
    #[inline(always)]
    pub(super) fn measure<S: Simd>(&mut self, simd: S, scene: &Scene<N>, integral: &Integral, r: &Record<N>) {
        let exact = integral.table.is_none() && scene.blend == Blend::Composite;
        match (N, exact, r.lines[0] == r.lines[1]) {
            (1, true, true) => self.on_one_line(simd, integral.exact, r),
            (1, true, false) => self.on_lines(simd, scene, integral.exact, r),
            _ => {
                self.flush(simd, scene, integral.exact.direct);
                self.any(simd, scene, integral, r);
            }
        }
        if self.found.waiting.count >= ENOUGH {
            self.flush(simd, scene, integral.exact.direct);
        }
    }

    /// Integrates what waits, and adds it to the pixels.
    #[inline(always)]
    pub(super) fn flush<S: Simd>(&mut self, simd: S, scene: &Scene<N>, direct: bool) {
        if self.found.waiting.count > 0 {
            self.found.waiting.integrate(simd, direct);
            self.found.waiting.composite(simd, &mut self.light, scene.colors, direct);
        }
    }

    /// Depths beyond R's at which eight fragments from `i` on begin and end, their lengths (0 beyond the last), and x and y from R.
    #[inline(always)]
    fn spans<S: Simd>(&self, simd: S, r: &Record<N>, i: usize) -> [Floats<S>; 5] {
        let of = |v: f32| Floats::splat(simd, v);
        let one = of(1.0);
        let found = &self.found;
        let enter = Floats::from_slice(simd, &found.enter[i..i + LANES]);
        let leave = Floats::from_slice(simd, &found.leave[i..i + LANES]);
        let id = Ints::from_slice(simd, &found.pixel[i..i + LANES]);
        // The inverse of `place`.
        let column = Floats::float_from((id & 3) | ((id >> 2) & 28));
        let row = Floats::float_from(((id >> 2) & 3) | ((id >> 5) & 28));
        let c = |k: usize| of(self.stretch[k]);
        let across = column.mul_add(c(3), row.mul_add(c(5), c(1)));
        let square = column.mul_add(across, row.mul_add(row.mul_add(c(4), c(2)), c(0)));
        let kappa = of(r.kappa);
        let (p, q) = (one - kappa * enter, one - kappa * leave);
        let over = one / (p * q);
        let (first, second) = (enter * q * over, leave * p * over);
        let length = (leave - enter) * over * square.sqrt();
        let there = Ints::load_array(simd, NUMBERS).simd_lt(Ints::splat(simd, (found.count - i).min(LANES) as i32));
        let length = there.select(length, of(0.0));
        // Whole pixels first, which are exact.
        [first, second, length, (column - r.at[0]) - r.rest[0], (row - r.at[1]) - r.rest[1]]
    }

    /// As [`Self::spans`]: the scalar at both ends, and lengths.
    #[inline(always)]
    fn scalars<S: Simd>(&self, simd: S, r: &Record<N>, i: usize) -> [Floats<S>; 3] {
        let of = |v: f32| Floats::splat(simd, v);
        let [first, second, length, x, y] = self.spans(simd, r, i);
        let [s, gx, gy, gz] = r.field[0];
        let (low, high) = (of(r.span[0][0]), of(r.span[0][1]));
        let side = x.mul_add(of(gx), y * gy);
        let (base, along) = (side + s, side.mul_add(of(r.kappa), of(gz)));
        let value = |t: Floats<S>| t.mul_add(along, base).max(low).min(high);
        [value(first), value(second), length]
    }

    /// A scalar on one line of the function.
    #[inline(always)]
    fn on_one_line<S: Simd>(&mut self, simd: S, exact: &Exact<f32>, r: &Record<N>) {
        let k = usize::from(r.lines[0]);
        let low = exact.opacity.s[k];
        let (value, slope) =
            (Floats::splat(simd, exact.opacity.value[k][0]), Floats::splat(simd, exact.opacity.slope[k][0]));
        let line = Ints::splat(simd, (k as i32) << 16);
        let count = self.found.count.min(PIXELS);
        for i in (0..count).step_by(LANES) {
            let [front, back, length] = self.scalars(simd, r, i);
            let (f, b) = (front - low, back - low);
            let depth = [f.mul_add(slope, value) * length, b.mul_add(slope, value) * length];
            let id = Ints::from_slice(simd, &self.found.pixel[i..i + LANES]) | line;
            self.found.waiting.add(depth, [f, b], length, id, (count - i).min(LANES));
        }
    }

    /// A scalar on several lines of the function: upwards where it rises along the ray, downwards where it falls.
    #[inline(always)]
    fn on_lines<S: Simd>(&mut self, simd: S, scene: &Scene<N>, exact: &Exact<f32>, r: &Record<N>) {
        let of = |v: f32| Floats::splat(simd, v);
        let (zero, one) = (of(0.0), of(1.0));
        let knots = &exact.opacity;
        for i in (0..self.found.count.min(PIXELS)).step_by(LANES) {
            let [front, back, length] = self.scalars(simd, r, i);
            let id = Ints::from_slice(simd, &self.found.pixel[i..i + LANES]);
            let there = length.simd_gt(zero);
            let rise = back - front;
            let flat = rise.simd_eq(zero);
            let (least, most) = (front.min(back), front.max(back));
            let mut left = there;
            // Lines that only the cell's other fragments are on.
            let [mut first, mut last] = r.lines.map(usize::from);
            if last - first > FEW_LINES {
                let low = there.select(least, of(f32::INFINITY)).reduce_min();
                let high = there.select(most, of(f32::NEG_INFINITY)).reduce_max();
                first += knots.s[first + 1..=last].iter().take_while(|&&s| s < low).count();
                last -= knots.s[first + 1..=last].iter().rev().take_while(|&&s| s > high).count();
            }
            // Most are on one line. A constant is on the one that begins there.
            for k in first..=last {
                let (low, high) = (of(knots.s[k]), of(knots.s[k + 1]));
                let within = left & least.simd_ge(low) & most.simd_le(high) & !(flat & most.simd_ge(high));
                if within.to_bitmask() != 0 {
                    self.add_piece(simd, scene, exact, k, within, [front, back], length, id);
                    left &= !within;
                }
            }
            if left.to_bitmask() == 0 {
                continue;
            }
            let per = flat.select(zero, length / flat.select(one, rise));
            let rises = rise.simd_ge(zero);
            for falls in [false, true] {
                let wanted = left & if falls { !rises } else { rises };
                if wanted.to_bitmask() == 0 {
                    continue;
                }
                for k in first..=last {
                    let k = if falls { first + last - k } else { k };
                    let (low, high) = (of(knots.s[k]), of(knots.s[k + 1]));
                    let ends = [front.max(low).min(high), back.max(low).min(high)];
                    let some = wanted & (ends[0].simd_lt(ends[1]) | ends[1].simd_lt(ends[0]));
                    if some.to_bitmask() != 0 {
                        self.add_piece(simd, scene, exact, k, some, ends, (ends[1] - ends[0]) * per, id);
                    }
                }
            }
        }
    }

    /// Has the lanes of `some` wait: pieces between these values on line `k`.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "lanes of one thing each")]
    fn add_piece<S: Simd>(
        &mut self,
        simd: S,
        scene: &Scene<N>,
        exact: &Exact<f32>,
        k: usize,
        some: Mask<S>,
        ends: [Floats<S>; 2],
        length: Floats<S>,
        id: Ints<S>,
    ) {
        if self.found.waiting.is_full() {
            self.flush(simd, scene, exact.direct);
        }
        let knots = &exact.opacity;
        let (f, b) = ((ends[0] - knots.s[k]).compress(some), (ends[1] - knots.s[k]).compress(some));
        let length = length.compress(some);
        let id = (id | ((k as i32) << 16)).compress(some);
        let (value, slope) = (Floats::splat(simd, knots.value[k][0]), Floats::splat(simd, knots.slope[k][0]));
        let depth = [f.mul_add(slope, value) * length, b.mul_add(slope, value) * length];
        self.found.waiting.add(depth, [f, b], length, id, some.to_bitmask().count_ones() as usize);
    }

    /// Any field and integral, fragment by fragment.
    #[inline(always)]
    fn any<S: Simd>(&mut self, simd: S, scene: &Scene<N>, integral: &Integral, r: &Record<N>) {
        for i in (0..self.found.count.min(PIXELS)).step_by(LANES) {
            let spans = simd.vectorize(
                #[inline(always)]
                || self.spans(simd, r, i).map(Floats::to_array),
            );
            self.split(scene, integral, r, i, &spans);
            if self.found.parts.len() > ENOUGH {
                self.integrate_parts(simd, integral.exact.direct);
            }
        }
        self.integrate_parts(simd, integral.exact.direct);
    }

    /// Splits eight fragments from `i` on into pieces, or adds what they are to their pixels where that is not a sum of pieces.
    #[inline(never)]
    fn split(
        &mut self,
        scene: &Scene<N>,
        integral: &Integral,
        r: &Record<N>,
        i: usize,
        [first, second, length, x, y]: &[[f32; LANES]; 5],
    ) {
        for l in 0..(self.found.count - i).min(LANES) {
            let value = |t: f32| {
                std::array::from_fn(|n| {
                    let [s, gx, gy, gz] = r.field[n];
                    let side = x[l] * gx + y[l] * gy;
                    (s + side + t * (gz + r.kappa * side)).max(r.span[n][0]).min(r.span[n][1])
                })
            };
            let pixel = self.found.pixel[i + l];
            let (front, back): ([f32; N], [f32; N]) = (value(first[l]), value(second[l]));
            if integral.table.is_some() || scene.blend == Blend::Maximum {
                self.gather(scene.blend, integral, pixel as usize % PIXELS, &front, &back, length[l]);
                continue;
            }
            integral.exact.for_each_piece(&front, &back, |front, back, share| {
                self.found.parts.push(Part { front, back, length: share * length[l], pixel });
            });
        }
    }

    /// Integrates pieces of any fragments.
    #[inline(always)]
    fn integrate_parts<S: Simd>(&mut self, simd: S, direct: bool) {
        simd.vectorize(
            #[inline(always)]
            || {
                for parts in self.found.parts.chunks(LANES) {
                    let mut some = [Part::default(); LANES];
                    some[..parts.len()].copy_from_slice(parts);
                    let (front, back) = (columns(simd, some.map(|p| p.front)), columns(simd, some.map(|p| p.back)));
                    let length = Floats::load_array(simd, some.map(|p| p.length));
                    let [alpha, f, b] = piece(simd, front[0] * length, back[0] * length, direct);
                    let [f, b] = if direct { [f * length, b * length] } else { [f, b] };
                    let color = |c: usize| front[c].mul_add(f, back[c] * b);
                    let pixels = some.map(|p| p.pixel);
                    add(simd, &mut self.light, [color(1), color(2), color(3), alpha], &pixels[..parts.len()]);
                }
                self.found.parts.clear();
            },
        );
    }
}

/// Adds what pieces emit and absorb (red, green, blue, opacity) to their pixels, in order.
#[inline(always)]
fn add<S: Simd>(simd: S, light: &mut [[f32; 4]; PIXELS], [r, g, b, alpha]: [Floats<S>; 4], pixels: &[i32]) {
    let quarters = |v: Floats<S>| {
        let ((a, b), (c, d)) = (v.split().0.split(), v.split().1.split());
        [a, b, c, d]
    };
    let (r, g, b, a) = (quarters(r), quarters(g), quarters(b), quarters(-alpha));
    let mut rows = [[0.0; 16]; LANES / 4];
    for (k, rows) in rows.iter_mut().enumerate() {
        simd.store_four_interleaved_f32x4([r[k], g[k], b[k], a[k]], rows);
    }
    let (rows, _) = rows.as_flattened().as_chunks::<4>();
    for (&pixel, row) in pixels.iter().zip(rows) {
        add_one(simd, light, f32x4::load_array_ref(simd, row), pixel);
    }
}

/// Adds red, green, blue and less transmittance to a pixel.
#[inline(always)]
fn add_one<S: Simd>(simd: S, light: &mut [[f32; 4]; PIXELS], lit: f32x4<S>, pixel: i32) {
    let pixel = &mut light[pixel as usize % PIXELS];
    let transmittance = f32x4::splat(simd, pixel[3]);
    transmittance.mul_add(lit, f32x4::load_array_ref(simd, pixel)).store_array(pixel);
}
