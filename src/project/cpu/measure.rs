//! Measure: what the fragments of a cell emit and absorb. A fragment is a pixel's ray inside the cell. Those that were found are kept
//! side by side, so all lanes have work: measured, split where the value crosses a knot of the transfer function, integrated, and
//! added to their pixels. No pixel occurs twice in a cell but with pieces of one ray, which are in order.

use super::fine::{Canvas, PIXELS};
use super::lanes::piece;
use super::setup::{Record, Scene};
use crate::integral::{Exact, Integral};
use crate::view::Blend;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4, f32x8, i32x8, mask32x8};

/// As many fragments as a tile has pixels, and the lanes beyond the last.
const ROOM: usize = PIXELS + 8;

/// A cell on more lines of the function than this and one is split fragment by fragment: most are on few of them.
const MOST_LINES: u16 = 8;

/// So many pieces are integrated at a time.
const ENOUGH: usize = 256;

/// There is room for those of one more cell.
const WAITING: usize = ENOUGH + ROOM + 8;

/// The lanes' numbers.
const LANES: [i32; 8] = [0, 1, 2, 3, 4, 5, 6, 7];

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
        at: usize,
        inside: mask32x8<S>,
        enter: f32x8<S>,
        leave: f32x8<S>,
        pixel: i32x8<S>,
    ) -> usize {
        // Of 128 blocks none begins behind the last pixel but one block.
        let at = at % PIXELS;
        enter.compress(inside).store_slice(&mut self.enter[at..at + 8]);
        leave.compress(inside).store_slice(&mut self.leave[at..at + 8]);
        pixel.compress(inside).store_slice(&mut self.pixel[at..at + 8]);
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
        self.count > WAITING - 16
    }

    /// Keeps up to eight pieces behind the others; `count` says how many they are.
    #[inline(always)]
    fn add<S: Simd>(
        &mut self,
        depth: [f32x8<S>; 2],
        value: [f32x8<S>; 2],
        length: f32x8<S>,
        id: i32x8<S>,
        count: usize,
    ) {
        let at = self.count.min(WAITING - 16);
        depth[0].store_slice(&mut self.depth[0][at..at + 8]);
        depth[1].store_slice(&mut self.depth[1][at..at + 8]);
        value[0].store_slice(&mut self.value[0][at..at + 8]);
        value[1].store_slice(&mut self.value[1][at..at + 8]);
        length.store_slice(&mut self.length[at..at + 8]);
        id.store_slice(&mut self.id[at..at + 8]);
        self.count = at + count;
    }

    /// Integrates all, in loops of their own: so the processor finds work that does not wait for its like.
    #[inline(always)]
    fn integrate<S: Simd>(&mut self, simd: S, direct: bool) {
        let count = self.count.min(WAITING - 8);
        // Which series is taken for eight pieces must not depend on what was here before.
        for v in self.depth.iter_mut().chain(&mut self.value).chain([&mut self.length]) {
            v[count..count + 8].fill(0.0);
        }
        for i in (0..count).step_by(8) {
            let load = |v: &[f32; WAITING]| f32x8::from_slice(simd, &v[i..i + 8]);
            let (x, y) = (load(&self.depth[0]), load(&self.depth[1]));
            let [alpha, front, back] = piece(simd, x, y, direct);
            let (f, b) = (load(&self.value[0]), load(&self.value[1]));
            let moment = f.mul_add(front, b * back);
            alpha.store_slice(&mut self.alpha[i..i + 8]);
            if direct {
                let length = load(&self.length);
                ((front + back) * length).store_slice(&mut self.sum[i..i + 8]);
                (moment * length).store_slice(&mut self.moment[i..i + 8]);
            } else {
                moment.store_slice(&mut self.moment[i..i + 8]);
            }
        }
    }

    /// Adds all to their pixels, in order, and forgets them. `colors` are red, green and blue of each line at its lower knot, and
    /// their slopes.
    #[inline(always)]
    fn composite<S: Simd>(&mut self, simd: S, light: &mut [[f32; 4]; PIXELS], colors: &[[[f32; 4]; 2]], direct: bool) {
        let count = std::mem::take(&mut self.count).min(WAITING - 8);
        let sum = if direct { &self.sum } else { &self.alpha };
        let absorbed = f32x4::load_array(simd, [0.0, 0.0, 0.0, -1.0]);
        let pieces = self.id[..count].iter().zip(&sum[..count]).zip(&self.alpha[..count]).zip(&self.moment[..count]);
        for (((&id, &sum), &alpha), &moment) in pieces {
            let id = id as u32;
            let Some([value, slope]) = colors.get((id >> 16) as usize) else { continue };
            let (value, slope) = (f32x4::load_array_ref(simd, value), f32x4::load_array_ref(simd, slope));
            let lit = slope.mul_add(f32x4::splat(simd, moment), value * sum);
            let lit = absorbed.mul_add(f32x4::splat(simd, alpha), lit);
            let pixel = &mut light[id as usize % PIXELS];
            let transmittance = f32x4::splat(simd, pixel[3]);
            transmittance.mul_add(lit, f32x4::load_array_ref(simd, pixel)).store_array(pixel);
        }
    }
}

/// Eight rows of four as four columns.
#[inline(always)]
fn columns<S: Simd>(simd: S, rows: [[f32; 4]; 8]) -> [f32x8<S>; 4] {
    let flat = rows.as_flattened();
    let half = |k: usize| {
        let mut four = [0.0; 16];
        four.copy_from_slice(&flat[16 * k..16 * k + 16]);
        simd.load_four_interleaved_f32x4(&four)
    };
    let (low, high) = (half(0), half(1));
    let both = |c: usize| low[c].combine(high[c]);
    [both(0), both(1), both(2), both(3)]
}

impl<const N: usize> Canvas<N> {
    /// Adds what the fragments found of a cell emit and absorb.
    #[inline(always)]
    pub(super) fn measure<S: Simd>(&mut self, simd: S, scene: &Scene<N>, integral: &Integral, r: &Record<N>) {
        let exact = integral.table.is_none() && scene.blend == Blend::Composite;
        let few = r.lines[1] - r.lines[0] <= MOST_LINES;
        match (N, exact && few, r.lines[0] == r.lines[1]) {
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
    fn spans<S: Simd>(&self, simd: S, r: &Record<N>, i: usize) -> [f32x8<S>; 5] {
        let of = |v: f32| f32x8::splat(simd, v);
        let one = of(1.0);
        let found = &self.found;
        let enter = f32x8::from_slice(simd, &found.enter[i..i + 8]);
        let leave = f32x8::from_slice(simd, &found.leave[i..i + 8]);
        let id = i32x8::from_slice(simd, &found.pixel[i..i + 8]);
        // The inverse of `place`.
        let column = f32x8::float_from((id & 3) | ((id >> 1) & 28));
        let row = f32x8::float_from(((id >> 2) & 1) | ((id >> 5) & 30));
        let c = |k: usize| of(self.stretch[k]);
        let across = column.mul_add(c(3), row.mul_add(c(5), c(1)));
        let square = column.mul_add(across, row.mul_add(row.mul_add(c(4), c(2)), c(0)));
        let kappa = of(r.kappa);
        let (p, q) = (one - kappa * enter, one - kappa * leave);
        let over = one / (p * q);
        let (first, second) = (enter * q * over, leave * p * over);
        let length = (leave - enter) * over * square.sqrt();
        let there = i32x8::load_array(simd, LANES).simd_lt(i32x8::splat(simd, (found.count - i).min(8) as i32));
        let length = there.select(length, of(0.0));
        // Whole pixels first, which are exact.
        [first, second, length, (column - r.at[0]) - r.rest[0], (row - r.at[1]) - r.rest[1]]
    }

    /// As [`Self::spans`]: the scalar at both ends, and lengths.
    #[inline(always)]
    fn scalars<S: Simd>(&self, simd: S, r: &Record<N>, i: usize) -> [f32x8<S>; 3] {
        let of = |v: f32| f32x8::splat(simd, v);
        let [first, second, length, x, y] = self.spans(simd, r, i);
        let [s, gx, gy, gz] = r.field[0];
        let (low, high) = (of(r.span[0][0]), of(r.span[0][1]));
        let side = x.mul_add(of(gx), y * gy);
        let (base, along) = (side + s, side.mul_add(of(r.kappa), of(gz)));
        let value = |t: f32x8<S>| t.mul_add(along, base).max(low).min(high);
        [value(first), value(second), length]
    }

    /// A scalar on one line of the function.
    #[inline(always)]
    fn on_one_line<S: Simd>(&mut self, simd: S, exact: &Exact<f32>, r: &Record<N>) {
        let k = usize::from(r.lines[0]);
        let low = exact.opacity.s[k];
        let (value, slope) =
            (f32x8::splat(simd, exact.opacity.value[k][0]), f32x8::splat(simd, exact.opacity.slope[k][0]));
        let line = i32x8::splat(simd, (k as i32) << 16);
        let count = self.found.count.min(PIXELS);
        for i in (0..count).step_by(8) {
            let [front, back, length] = self.scalars(simd, r, i);
            let (f, b) = (front - low, back - low);
            let depth = [f.mul_add(slope, value) * length, b.mul_add(slope, value) * length];
            let id = i32x8::from_slice(simd, &self.found.pixel[i..i + 8]) | line;
            self.found.waiting.add(depth, [f, b], length, id, (count - i).min(8));
        }
    }

    /// A scalar on several lines of the function: upwards where it rises along the ray, downwards where it falls.
    #[inline(always)]
    fn on_lines<S: Simd>(&mut self, simd: S, scene: &Scene<N>, exact: &Exact<f32>, r: &Record<N>) {
        let of = |v: f32| f32x8::splat(simd, v);
        let (zero, one) = (of(0.0), of(1.0));
        let knots = &exact.opacity;
        let [first, last] = r.lines;
        for i in (0..self.found.count.min(PIXELS)).step_by(8) {
            let [front, back, length] = self.scalars(simd, r, i);
            let id = i32x8::from_slice(simd, &self.found.pixel[i..i + 8]);
            let there = length.simd_gt(zero);
            let rise = back - front;
            let flat = rise.simd_eq(zero);
            let (least, most) = (front.min(back), front.max(back));
            let mut left = there;
            // Most are on one line. A constant is on the one that begins there.
            for k in usize::from(first)..=usize::from(last) {
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
                    let k = usize::from(if falls { first + last - k } else { k });
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
        some: mask32x8<S>,
        ends: [f32x8<S>; 2],
        length: f32x8<S>,
        id: i32x8<S>,
    ) {
        if self.found.waiting.is_full() {
            self.flush(simd, scene, exact.direct);
        }
        let knots = &exact.opacity;
        let (f, b) = ((ends[0] - knots.s[k]).compress(some), (ends[1] - knots.s[k]).compress(some));
        let length = length.compress(some);
        let id = (id | ((k as i32) << 16)).compress(some);
        let (value, slope) = (f32x8::splat(simd, knots.value[k][0]), f32x8::splat(simd, knots.slope[k][0]));
        let depth = [f.mul_add(slope, value) * length, b.mul_add(slope, value) * length];
        self.found.waiting.add(depth, [f, b], length, id, some.to_bitmask().count_ones() as usize);
    }

    /// Any field and integral, fragment by fragment.
    #[inline(always)]
    fn any<S: Simd>(&mut self, simd: S, scene: &Scene<N>, integral: &Integral, r: &Record<N>) {
        for i in (0..self.found.count.min(PIXELS)).step_by(8) {
            let spans = simd.vectorize(
                #[inline(always)]
                || self.spans(simd, r, i).map(f32x8::to_array),
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
        [first, second, length, x, y]: &[[f32; 8]; 5],
    ) {
        for l in 0..(self.found.count - i).min(8) {
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
                for parts in self.found.parts.chunks(8) {
                    let mut eight = [Part::default(); 8];
                    eight[..parts.len()].copy_from_slice(parts);
                    let (front, back) = (columns(simd, eight.map(|p| p.front)), columns(simd, eight.map(|p| p.back)));
                    let length = f32x8::load_array(simd, eight.map(|p| p.length));
                    let [alpha, f, b] = piece(simd, front[0] * length, back[0] * length, direct);
                    let [f, b] = if direct { [f * length, b * length] } else { [f, b] };
                    let color = |c: usize| front[c].mul_add(f, back[c] * b);
                    add(
                        simd,
                        &mut self.light,
                        [color(1), color(2), color(3), alpha],
                        eight.map(|p| p.pixel),
                        parts.len(),
                    );
                }
                self.found.parts.clear();
            },
        );
    }
}

/// Adds what up to eight pieces emit and absorb to their pixels, in order.
#[inline(always)]
fn add<S: Simd>(simd: S, light: &mut [[f32; 4]; PIXELS], lit: [f32x8<S>; 4], pixels: [i32; 8], count: usize) {
    let [r, g, b, alpha] = lit;
    let (r, g, b, a) = (r.split(), g.split(), b.split(), (-alpha).split());
    let mut rows = [[0.0; 16]; 2];
    simd.store_four_interleaved_f32x4([r.0, g.0, b.0, a.0], &mut rows[0]);
    simd.store_four_interleaved_f32x4([r.1, g.1, b.1, a.1], &mut rows[1]);
    let (rows, _) = rows.as_flattened().as_chunks::<4>();
    let mut one = |l: usize| {
        let pixel = &mut light[pixels[l] as usize % PIXELS];
        let transmittance = f32x4::splat(simd, pixel[3]);
        transmittance.mul_add(f32x4::load_array(simd, rows[l]), f32x4::load_array(simd, *pixel)).store_array(pixel);
    };
    if count >= 8 {
        (0..8).for_each(&mut one);
    } else {
        (0..count).for_each(&mut one);
    }
}
