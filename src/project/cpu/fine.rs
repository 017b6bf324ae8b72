//! Fine: the pixels of a cell, eight (4 × 2) at a time: found, checked, measured, integrated, composited.
//!
//! A pixel keeps the key where its last cell ended. The next one must begin there, or a gap must lie between the two where the ray
//! is outside the mesh, by its crossings of the boundary; at the end nothing of the mesh may be left. A pixel of which that is not
//! true is flagged, and drawn again by other means. So the picture does not rest on the order of the cells.

use super::coarse::{ASIDE, NEAREST, TILE};
use super::lanes::piece;
use super::order::{Crossings, place};
use super::setup::{Look, Record, Scene};
use crate::integral::{Batch, Integral, Light};
use crate::traverse::cpu::least_light;
use crate::view::{Blend, View};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

pub(super) const PIXELS: usize = (TILE * TILE) as usize;
const BLOCKS_ACROSS: usize = TILE as usize / 4;

/// How far from the end of the last cell the next may begin, in keys, of 1 and of the key; and how much of the mesh may be missed
/// in a gap.
const SLACK: f32 = 2e-6;

/// A cell on more lines of the function than this and one is integrated pixel by pixel: most pixels are on few of them.
const MOST_LINES: u16 = 6;

/// Transmittance below which rounding of a dense cell's lengths is not seen.
const DARK: f32 = 1e-3;

/// Why a pixel is drawn again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Flaw {
    None,
    /// A cell began before the last one ended.
    Overlap,
    /// A cell began after the last one ended, or none did, but the mesh goes on there.
    Gap,
    /// The ray enters the mesh not as often as it leaves, or a cell was drawn where it is outside.
    Boundary,
    /// Light comes through a cell so dense that f32 does not tell how much, or the largest value is of a cell whose values
    /// f32 does not tell.
    Coarse,
}

/// The pixels of a tile, block by block.
#[derive(Debug)]
pub(super) struct Canvas<const N: usize> {
    /// Red, green, blue, transmittance.
    light: [Vec<f32>; 4],
    largest: Vec<[f32; N]>,
    last: Vec<f32>,
    limits: [Vec<f32>; 2],
    stretch: Vec<f32>,
    flaws: Vec<Flaw>,
    /// A bit for each block through which light still comes.
    alive: u128,
    corner: [u32; 2],
    eye_inside: bool,
    /// The key of the nearest place that is drawn for sure.
    nearest: f64,
    batch: Batch,
    pub(super) fragments: u64,
}

impl<const N: usize> Canvas<N> {
    pub(super) fn new() -> Self {
        let zeros = || vec![0.0; PIXELS];
        Canvas {
            light: [zeros(), zeros(), zeros(), zeros()],
            largest: vec![[0.0; N]; PIXELS],
            last: zeros(),
            limits: [zeros(), zeros()],
            stretch: zeros(),
            flaws: vec![Flaw::None; PIXELS],
            alive: 0,
            corner: [0; 2],
            eye_inside: false,
            nearest: f64::NEG_INFINITY,
            batch: Batch::default(),
            fragments: 0,
        }
    }

    /// Begins the tile whose first pixel is `corner`.
    pub(super) fn clear(&mut self, scene: &Scene<N>, view: &View, crossings: &Crossings, corner: [u32; 2]) {
        let [r, g, b, t] = &mut self.light;
        [r, g, b].into_iter().for_each(|c| c.fill(0.0));
        t.fill(1.0);
        self.largest.fill([f32::NEG_INFINITY; N]);
        self.flaws.fill(Flaw::None);
        let lens = scene.lens;
        (self.alive, self.corner, self.eye_inside) = (u128::MAX, corner, lens.meet);
        self.nearest = if lens.meet { lens.key(4.0 * NEAREST) } else { f64::NEG_INFINITY };
        for j in 0..TILE {
            for i in 0..TILE {
                let (at, x, y) = (place(i, j), corner[0] + i, corner[1] + j);
                self.last[at] = crossings.first(at);
                self.stretch[at] = lens.stretch(f64::from(x) + ASIDE.x, f64::from(y) + ASIDE.y) as f32;
                if lens.limited && x < lens.size[0] && y < lens.size[1] {
                    let [low, high] = lens.limits(scene.geometry, view, x, y);
                    (self.limits[0][at], self.limits[1][at]) = (low as f32, high as f32);
                }
            }
        }
    }

    /// Whether no more light comes through any pixel.
    pub(super) fn is_done(&self) -> bool {
        self.alive == 0
    }

    /// Draws a cell.
    #[inline(always)]
    pub(super) fn draw<S: Simd>(
        &mut self,
        simd: S,
        scene: &Scene<N>,
        integral: &Integral,
        crossings: &Crossings,
        r: &Record<N>,
    ) {
        match r.look {
            Look::Empty => return,
            Look::Flat => return self.draw_flat(scene, integral, crossings, r),
            Look::Seen | Look::Unseen => {}
        }
        let of = |v: f32| f32x8::splat(simd, v);
        let (zero, one) = (of(0.0), of(1.0));
        let least = least_light(integral.exact.direct);
        let limited = scene.lens.limited;
        // Whole pixels first, which are exact.
        let ramp = f32x8::from_slice(simd, &[0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0]) - r.at[0];
        let pair = f32x8::from_slice(simd, &[0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0]) - r.at[1];
        let [beside, below] = r.rest;
        let slope = r.plane[1].map(of);
        let down = r.plane[2].map(of);
        let start = r.plane[0].map(of);
        let [base, ratio, inverse] = r.key.map(of);
        let kappa = of(r.kappa);
        // The eye inside: from very near to it.
        let beyond = of(1.0 / r.kappa);
        let eye = if r.kappa > 0.0 { -1e7 / (r.kappa * r.kappa) } else { f32::NEG_INFINITY };
        let [x0, x1, y0, y1] = r.pixels.map(usize::from);
        for by in y0 / 2..=y1 / 2 {
            let y = (pair + (2 * by) as f32) - below;
            let row = [0, 1, 2, 3].map(|f| y.mul_add(down[f], start[f]));
            for bx in x0 / 4..=x1 / 4 {
                let block = by * BLOCKS_ACROSS + bx;
                if self.alive >> block & 1 == 0 {
                    continue;
                }
                let x = (ramp + (4 * bx) as f32) - beside;
                let v = [0, 1, 2, 3].map(|f| x.mul_add(slope[f], row[f]));
                let (mut enter, mut leave) = match r.fronts {
                    1 => (v[0], v[1].min(v[2]).min(v[3])),
                    2 => (v[0].max(v[1]), v[2].min(v[3])),
                    3 => (v[0].max(v[1]).max(v[2]), v[3]),
                    0 => (of(eye), v[0].min(v[1]).min(v[2].min(v[3]))),
                    _ => return,
                };
                // What lies behind the eye is beyond what is infinitely far.
                leave = leave.min(beyond);
                let mut inside = enter.simd_lt(leave);
                if inside.to_bitmask() == 0 {
                    continue;
                }
                let at = 8 * block;
                let lanes = at..at + 8;
                let last = f32x8::from_slice(simd, &self.last[lanes.clone()]);
                let (key_in, key_out) = (ratio.mul_add(enter, base), ratio.mul_add(leave, base));
                let slack = key_in.abs().mul_add(of(SLACK), of(SLACK));
                let apart = !(key_in - last).abs().simd_le(slack) & inside;
                let bits = apart.to_bitmask();
                if bits != 0 {
                    let (from, to): ([f32; 8], [f32; 8]) = (last.into(), key_in.into());
                    for l in (0..8).filter(|l| bits >> l & 1 == 1) {
                        self.check_gap(crossings, at + l, from[l], to[l]);
                    }
                }
                inside.select(key_out, last).store_slice(&mut self.last[lanes.clone()]);
                if r.look == Look::Unseen {
                    continue;
                }
                if limited {
                    let limit = |v: &[f32]| (f32x8::from_slice(simd, &v[lanes.clone()]) - base) * inverse;
                    enter = enter.max(limit(&self.limits[0]));
                    leave = leave.min(limit(&self.limits[1]));
                    inside = enter.simd_lt(leave);
                    if inside.to_bitmask() == 0 {
                        continue;
                    }
                }
                // What is outside has no length.
                leave = inside.select(leave, enter);
                let (p, q) = (one - kappa * enter, one - kappa * leave);
                let over = one / (p * q);
                let (first, second) = (enter * q * over, leave * p * over);
                let stretch = f32x8::from_slice(simd, &self.stretch[lanes.clone()]);
                let length = inside.select((leave - enter) * over * stretch, zero);
                self.fragments += u64::from((inside.to_bitmask() as u32).count_ones());
                let few = r.lines[1] - r.lines[0] <= MOST_LINES;
                if N == 1 && few && integral.table.is_none() && scene.blend == Blend::Composite {
                    let [s, gx, gy, gz] = r.field[0].map(of);
                    let side = x * gx + y * gy;
                    let (base, along) = (s + side, side.mul_add(kappa, gz));
                    let [low, high] = r.span[0].map(of);
                    let value = |t: f32x8<S>| inside.select(t.mul_add(along, base).max(low).min(high), low);
                    let lit = pieces(simd, integral, r.lines, value(first), value(second), length);
                    let t = f32x8::from_slice(simd, &self.light[3][lanes.clone()]);
                    for k in 0..3 {
                        let c = f32x8::from_slice(simd, &self.light[k][lanes.clone()]);
                        t.mul_add(lit[k + 1], c).store_slice(&mut self.light[k][lanes.clone()]);
                    }
                    let t = t * lit[0];
                    t.store_slice(&mut self.light[3][lanes.clone()]);
                    if r.coarse {
                        self.doubt((inside & t.simd_gt(of(DARK))).to_bitmask(), at);
                    }
                    if t.simd_lt(of(least)).to_bitmask() == 0xff {
                        self.alive &= !(1 << block);
                    }
                } else {
                    let bits = inside.to_bitmask();
                    let (x, y): ([f32; 8], [f32; 8]) = (x.into(), y.into());
                    let (first, second): ([f32; 8], [f32; 8]) = (first.into(), second.into());
                    let length: [f32; 8] = length.into();
                    for l in (0..8).filter(|l| bits >> l & 1 == 1) {
                        let value = |t: f32| {
                            std::array::from_fn(|n| {
                                let [s, gx, gy, gz] = r.field[n];
                                let side = x[l] * gx + y[l] * gy;
                                (s + side + t * (gz + r.kappa * side)).max(r.span[n][0]).min(r.span[n][1])
                            })
                        };
                        self.gather(scene.blend, integral, at + l, &value(first[l]), &value(second[l]), length[l]);
                    }
                    if r.coarse {
                        let lit = f32x8::from_slice(simd, &self.light[3][lanes.clone()]).simd_gt(of(DARK));
                        self.doubt((inside & lit).to_bitmask(), at);
                    }
                    self.rest(block, least, scene.blend);
                }
            }
        }
    }

    /// Flags these lanes of the block at `at`.
    #[cold]
    fn doubt(&mut self, lanes: u64, at: usize) {
        for l in (0..8).filter(|l| lanes >> l & 1 == 1) {
            if self.flaws[at + l] == Flaw::None {
                self.flaws[at + l] = Flaw::Coarse;
            }
        }
    }

    /// Forgets a block of which no pixel lets light through.
    fn rest(&mut self, block: usize, least: f32, blend: Blend) {
        if blend == Blend::Composite && self.light[3][8 * block..8 * block + 8].iter().all(|t| *t < least) {
            self.alive &= !(1 << block);
        }
    }

    /// Adds one segment to one pixel.
    fn gather(&mut self, blend: Blend, integral: &Integral, at: usize, front: &[f32; N], back: &[f32; N], length: f32) {
        if blend == Blend::Maximum {
            for v in [front, back] {
                if v[N - 1] > self.largest[at][N - 1] {
                    self.largest[at] = *v;
                }
            }
            return;
        }
        let [r, g, b, t] = &mut self.light;
        let mut light = Light { color: [r[at], g[at], b[at]], through: t[at] };
        match integral.table {
            None => {
                self.batch.add(integral.exact, front, back, length, &mut light);
                self.batch.flush(integral.exact.direct, &mut light);
            }
            Some(table) => table.add(integral.exact, front[N - 1], back[N - 1], length, &mut light),
        }
        ([r[at], g[at], b[at]], t[at]) = (light.color, light.through);
    }

    /// Draws a cell whose thickness f32 cannot tell, pixel by pixel in f64.
    #[cold]
    #[inline(never)]
    fn draw_flat(&mut self, scene: &Scene<N>, integral: &Integral, crossings: &Crossings, r: &Record<N>) {
        let Scene { geometry, lens, .. } = scene;
        let corners = geometry.cells[r.cell as usize].corners;
        let values = scene.corner_values(r.cell, corners);
        let least = least_light(integral.exact.direct);
        let cell = super::flat::Cell::new(lens, corners.map(|p| geometry.points[p as usize]));
        let [x0, x1, y0, y1] = r.pixels.map(u32::from);
        for j in y0..=y1 {
            for i in x0..=x1 {
                let at = place(i, j);
                if self.alive >> (at / 8) & 1 == 0 {
                    continue;
                }
                let (column, row) = (f64::from(self.corner[0] + i), f64::from(self.corner[1] + j));
                let Some([mut enter, mut leave]) = cell.depths(column + ASIDE.x, row + ASIDE.y) else { continue };
                let key = |w: f64| lens.key(w) as f32;
                let (key_in, key_out) = (key(enter), key(leave));
                let apart = (key_in - self.last[at]).abs();
                if apart.is_nan() || apart > SLACK * (1.0 + key_in.abs()) {
                    self.check_gap(crossings, at, self.last[at], key_in);
                }
                self.last[at] = key_out;
                if lens.limited {
                    enter = enter.max(lens.depth(f64::from(self.limits[0][at])));
                    leave = leave.min(lens.depth(f64::from(self.limits[1][at])));
                }
                if enter >= leave {
                    continue;
                }
                self.fragments += 1;
                let value = |w: f64| {
                    let b = cell.weights(column + ASIDE.x, row + ASIDE.y, w);
                    std::array::from_fn(|n| {
                        let v: f64 = (0..4).map(|k| b[k] * f64::from(values[k][n])).sum();
                        (v as f32).max(r.span[n][0]).min(r.span[n][1])
                    })
                };
                let length = ((leave - enter) * f64::from(self.stretch[at])) as f32;
                self.gather(scene.blend, integral, at, &value(enter), &value(leave), length);
                if r.coarse && scene.blend == Blend::Maximum {
                    self.doubt(1, at);
                }
                self.rest(at / 8, least, scene.blend);
            }
        }
    }

    /// Flags a pixel unless the mesh is absent between two keys.
    #[cold]
    #[inline(never)]
    fn check_gap(&mut self, crossings: &Crossings, at: usize, from: f32, to: f32) {
        if self.flaws[at] != Flaw::None {
            return;
        }
        let slack = SLACK * (1.0 + to.abs());
        if to < from - slack {
            self.flaws[at] = Flaw::Overlap;
            return;
        }
        // A gap begins where the ray leaves the mesh, and ends where it enters.
        let held = |key: f32| {
            let slack = SLACK * (1.0 + key.abs());
            crossings.holds(at, f64::from(key), 2.0 * f64::from(slack))
        };
        let held = held(to) && (from == f32::NEG_INFINITY || held(from));
        // Nothing is drawn that is nearer to the eye.
        let from = f64::from(from).max(self.nearest);
        self.flaws[at] = match crossings.between(at, from, f64::from(to), self.eye_inside) {
            Some(missed) if missed > 2.0 * f64::from(slack) => Flaw::Gap,
            Some(_) if held => Flaw::None,
            _ => Flaw::Boundary,
        };
    }

    /// Checks what is left of the mesh behind the last cells; then calls `pixel` with each pixel of the tile within `size`: where it
    /// is in it, what it is, and why it must be drawn again.
    pub(super) fn finish(
        &mut self,
        scene: &Scene<N>,
        integral: &Integral,
        crossings: &Crossings,
        size: [u32; 2],
        color: &dyn Fn(&[f32; N]) -> [f32; 4],
        mut pixel: impl FnMut(u32, u32, [f32; 4], Flaw),
    ) {
        let least = least_light(integral.exact.direct);
        for j in 0..size[1] {
            for i in 0..size[0] {
                let at = place(i, j);
                let ended = scene.blend == Blend::Composite && self.light[3][at] < least;
                let (last, end) = (self.last[at], crossings.last(at));
                if !ended && end > last + SLACK * (1.0 + end.abs()) {
                    self.check_gap(crossings, at, last, end);
                }
                // Not compared with an end at −∞: that is where no ray meets the mesh.
                let beyond = last > if crossings.any(at) { end + SLACK * (1.0 + end.abs()) } else { end };
                if beyond && self.flaws[at] == Flaw::None {
                    self.flaws[at] = Flaw::Boundary;
                }
                let light = match scene.blend {
                    Blend::Composite => {
                        let [r, g, b, t] = [0, 1, 2, 3].map(|k| self.light[k][at]);
                        [r, g, b, 1.0 - t]
                    }
                    Blend::Maximum if self.largest[at][N - 1] == f32::NEG_INFINITY => [0.0; 4],
                    Blend::Maximum => color(&self.largest[at]),
                };
                pixel(i, j, light, self.flaws[at]);
            }
        }
    }
}

/// Transmittance and emission of segments between values on these lines of the function.
#[inline(always)]
fn pieces<S: Simd>(
    simd: S,
    integral: &Integral,
    [first, last]: [u16; 2],
    front: f32x8<S>,
    back: f32x8<S>,
    length: f32x8<S>,
) -> [f32x8<S>; 4] {
    let of = |v: f32| f32x8::splat(simd, v);
    let (zero, one) = (of(0.0), of(1.0));
    let (knots, direct) = (&integral.exact.opacity, integral.exact.direct);
    let on_line = |k: usize, f: f32x8<S>, b: f32x8<S>, l: f32x8<S>| {
        let (low, value, slope) = (of(knots.s[k]), &knots.value[k], &knots.slope[k]);
        let (f, b) = (f - low, b - low);
        let at = |c: usize, s: f32x8<S>| s.mul_add(of(slope[c]), of(value[c]));
        let [alpha, front, back] = piece(simd, at(0, f) * l, at(0, b) * l, direct);
        let [front, back] = if direct { [front * l, back * l] } else { [front, back] };
        let color = |c: usize| at(c, f) * front + at(c, b) * back;
        [one - alpha, color(1), color(2), color(3)]
    };
    if first == last {
        return on_line(usize::from(first), front, back, length);
    }
    let rise = back - front;
    let flat = rise.simd_eq(zero);
    let per = flat.select(zero, length / flat.select(one, rise));
    let rises = rise.simd_ge(zero);
    let mut sum = [one, zero, zero, zero];
    for falls in [false, true] {
        let wanted = if falls { !rises } else { rises };
        if wanted.to_bitmask() == 0 {
            continue;
        }
        for k in first..=last {
            let k = usize::from(if falls { first + last - k } else { k });
            let (low, high) = (knots.s[k], knots.s[k + 1]);
            if low >= high {
                continue;
            }
            let (low, high) = (of(low), of(high));
            let (f, b) = (front.max(low).min(high), back.max(low).min(high));
            // A constant is on one line only.
            let on = flat & front.simd_ge(low) & front.simd_lt(high);
            let some = wanted & (on | f.simd_lt(b) | b.simd_lt(f));
            if some.to_bitmask() == 0 {
                continue;
            }
            let l = some.select(on.select(length, (b - f) * per), zero);
            let lit = on_line(k, f, b, l);
            let t = sum[0];
            sum = [t * lit[0], t.mul_add(lit[1], sum[1]), t.mul_add(lit[2], sum[2]), t.mul_add(lit[3], sum[3])];
        }
    }
    sum
}
