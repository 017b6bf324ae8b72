//! Second: what the fragments of a cell emit and absorb where functions are of two variables, or lit. Those of a block are
//! integrated side by side as far as f32 goes ([`Wide`](crate::integral::second::Wide)), and the rest one by one in f64.

use super::find::MOST_BLOCKS;
use super::fine::{Canvas, PIXELS, window, window_mut};
use super::lanes::{Floats, LANES};
use super::setup::{Record, Records, Scene};
use crate::integral::Light;
use crate::integral::second::{self, Cell, OfTwo, Room, Row, Scratch, Segment};
use crate::order::crossings::pixel_at;
use crate::order::screen::ASIDE;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, mask32x16};
use glam::DVec3;

/// Optical depth over a cell's extent in depth, times the transmittance behind it, from which on rounding of lengths shows; and
/// the transmittance below which it does not: as in [`super::setup`].
const DENSE: f64 = 30.0;
const DARK: f32 = 1e-3;

/// What a canvas keeps for such functions.
#[derive(Debug)]
pub(super) struct Kept {
    /// Fragments of the blocks that were found, those of cells that see the same side by side.
    room: Room,
    /// What cells see, and the first of their fragments.
    runs: Vec<(Cell, usize)>,
    /// Of each block its run, its first fragment, which pixels have one, and the greatest extinction in the cell.
    run: [u8; MOST_BLOCKS],
    start: [u16; MOST_BLOCKS],
    there: [u16; MOST_BLOCKS],
    densest: [f32; MOST_BLOCKS],
    /// Fragments that are taken one by one.
    left: Vec<usize>,
    scratch: Scratch,
    /// Of each pixel, the direction of its ray; none where nothing is lit.
    along: Vec<[f32; PIXELS]>,
}

impl Default for Kept {
    fn default() -> Self {
        Kept {
            room: Room::default(),
            runs: vec![],
            run: [0; MOST_BLOCKS],
            start: [0; MOST_BLOCKS],
            there: [0; MOST_BLOCKS],
            densest: [0.0; MOST_BLOCKS],
            left: vec![],
            scratch: Scratch::default(),
            along: vec![],
        }
    }
}

impl Kept {
    /// Begins a tile whose first pixel is `corner`.
    pub(super) fn clear<const N: usize>(&mut self, scene: &Scene<N>, corner: [u32; 2]) {
        if N < 5 {
            return;
        }
        self.along.resize(3, [0.0; PIXELS]);
        let [column, row] = corner.map(f64::from);
        for at in 0..PIXELS {
            let [i, j] = pixel_at(at).map(f64::from);
            let along = scene.lens.direction(column + i + ASIDE.x, row + j + ASIDE.y);
            (0..3).for_each(|k| self.along[k][at] = along[k] as f32);
        }
    }

    /// Panels since it was asked last.
    pub(super) fn take_panels(&mut self) -> u64 {
        std::mem::take(&mut self.scratch.panels)
    }
}

impl<const N: usize> Canvas<N> {
    /// Adds what the fragments found emit and absorb.
    #[inline(never)]
    pub(super) fn measure_two<S: Simd>(&mut self, simd: S, scene: &Scene<N>, two: &OfTwo, records: &Records<N>) {
        let all = simd.vectorize(
            #[inline(always)]
            || self.pack(simd, two, records),
        );
        for k in 0..self.kept.runs.len() {
            let (cell, from) = self.kept.runs[k];
            let to = self.kept.runs.get(k + 1).map_or(all, |run| run.1);
            let Kept { room, left, scratch, .. } = &mut self.kept;
            scratch.panels += two.wide.integrate::<S, N>(simd, &cell, room, [from, to], &mut |i| left.push(i));
        }
        if !self.kept.left.is_empty() {
            self.by_hand(scene, two, records);
        }
        simd.vectorize(
            #[inline(always)]
            || self.composite(simd, scene, two, records),
        );
    }

    /// Finds which blocks are of cells that see the same: their runs.
    #[inline(always)]
    fn sort(&mut self, two: &OfTwo, records: &Records<N>) {
        self.kept.runs.clear();
        let (mut last, mut run, mut densest) = (None, 0, 0.0);
        for i in 0..self.found.count.min(MOST_BLOCKS) {
            let r = self.found.record(records, i);
            if last != Some(r.first_block) {
                last = Some(r.first_block);
                let (cell, most) = two.wide.cell(&r.span);
                densest = most;
                run = self.kept.runs.iter().position(|run| run.0 == cell).unwrap_or(self.kept.runs.len());
                if run == self.kept.runs.len() {
                    self.kept.runs.push((cell, 0));
                }
            }
            (self.kept.run[i], self.kept.densest[i]) = (run as u8, densest);
        }
    }

    /// Puts the fragments found side by side, run by run, and says how many they are.
    #[inline(always)]
    fn pack<S: Simd>(&mut self, simd: S, two: &OfTwo, records: &Records<N>) -> usize {
        self.kept.left.clear();
        self.sort(two, records);
        let mut all = 0;
        for run in 0..self.kept.runs.len() {
            self.kept.runs[run].1 = all;
            for i in 0..self.found.count.min(MOST_BLOCKS) {
                if usize::from(self.kept.run[i]) == run {
                    all += self.put_block(simd, records, i, all);
                }
            }
        }
        all
    }

    /// Puts the fragments of the `i`-th block to place `all` and behind; says how many they are.
    #[inline(always)]
    fn put_block<S: Simd>(&mut self, simd: S, records: &Records<N>, i: usize, all: usize) -> usize {
        let load = |v: &[f32; LANES]| Floats::load_array_ref(simd, v);
        let r = self.found.record(records, i);
        let [x, y] = self.found.pixels_from(simd, r, i);
        let [first, second, length] = self.span(simd, r, i);
        let there = load(&self.found.enter[i]).simd_lt(load(&self.found.leave[i]));
        let at = self.found.place(i);
        let bits = there.to_bitmask();
        (self.kept.start[i], self.kept.there[i]) = (all as u16, bits as u16);
        let rows = &mut *self.kept.room.rows;
        for n in 0..N {
            let [s, gx, gy, gz] = r.field[n];
            let side = x * gx + y * gy;
            let (base, along) = (side + s, side * r.kappa + gz);
            let (low, high) = (Floats::splat(simd, r.span[n][0]), Floats::splat(simd, r.span[n][1]));
            let front = first.mul_add(along, base).max(low).min(high);
            let back = second.mul_add(along, base).max(low).min(high);
            put(simd, rows, Row::<N>::AT + n, all, front, there);
            put(simd, rows, Row::<N>::RISE + n, all, back - front, there);
        }
        put(simd, rows, Row::<N>::LENGTH, all, length, there);
        if N == 5 {
            for k in 0..3 {
                put(simd, rows, Row::<N>::ALONG + k, all, load(window(&self.kept.along[k], at)), there);
            }
            put(simd, rows, Row::<N>::FIRST, all, first, there);
        }
        length.store_array(&mut self.found.length[i]);
        bits.count_ones() as usize
    }

    /// Adds what the fragments emit and absorb to their pixels.
    #[inline(always)]
    fn composite<S: Simd>(&mut self, simd: S, scene: &Scene<N>, two: &OfTwo, records: &Records<N>) {
        let load = |v: &[f32; LANES]| Floats::load_array_ref(simd, v);
        for i in 0..self.found.count.min(MOST_BLOCKS) {
            let at = self.found.place(i);
            let there = mask32x16::from_bitmask(simd, self.kept.there[i].into());
            let start = usize::from(self.kept.start[i]);
            let rows = &self.kept.room.rows;
            let transmittance = load(window(&self.light[3], at));
            for k in 0..3 {
                let color = simd.expand_f32x16(load(second::window(&rows[Row::<N>::LIGHT + k], start)), there);
                let light = window_mut(&mut self.light[k], at);
                transmittance.mul_add(color, load(light)).store_array(light);
            }
            let alpha = simd.expand_f32x16(load(second::window(&rows[Row::<N>::LIGHT + 3], start)), there);
            (-transmittance).mul_add(alpha, transmittance).store_array(window_mut(&mut self.light[3], at));
            if f64::from(self.kept.densest[i]) * two.longest > DENSE {
                self.doubt_dense(scene, self.found.record(records, i), i, &alpha.to_array());
            }
        }
    }

    /// Fragments that f32 is too coarse for, one by one.
    #[cold]
    #[inline(never)]
    fn by_hand(&mut self, scene: &Scene<N>, two: &OfTwo, records: &Records<N>) {
        let lens = scene.lens;
        for k in 0..self.kept.left.len() {
            let at = self.kept.left[k];
            // Its block is the one that it is behind the start of, and its pixel the one after so many others.
            let start = |block: usize| usize::from(self.kept.start[block]);
            let holds = |&block: &usize| (start(block)..start(block) + self.count_there(block)).contains(&at);
            let block = (0..self.found.count.min(MOST_BLOCKS)).find(holds).unwrap_or_default();
            let mut there = self.kept.there[block];
            (start(block)..at).for_each(|_| there &= there.wrapping_sub(1));
            let pixel = self.found.place(block) + there.trailing_zeros() as usize;
            let [column, row] = self.column_row(pixel);
            let r = self.found.record(records, block);
            let start = if lens.meet { f64::from(r.end) } else { f64::from(r.key[0]) + lens.reference };
            let of = |row: usize| f64::from(self.kept.room.rows[row][at]);
            let front: [f64; N] = std::array::from_fn(|n| of(Row::<N>::AT + n));
            let back = std::array::from_fn(|n| front[n] + of(Row::<N>::RISE + n));
            let first = if N == 5 { of(Row::<N>::FIRST) } else { 0.0 };
            let (length, place) = (of(Row::<N>::LENGTH), lens.point(column, row, start + first));
            let light = self.kept.integrate(two, [front, back], place, lens.direction(column, row), length);
            let [red, green, blue] = light.color;
            for (k, v) in [red, green, blue, 1.0 - light.transmittance].into_iter().enumerate() {
                self.kept.room.rows[Row::<N>::LIGHT + k][at] = v;
            }
        }
    }

    /// Flags pixels through which too much light comes after fragments so dense that f32 does not tell their lengths.
    #[cold]
    #[inline(never)]
    fn doubt_dense(&mut self, scene: &Scene<N>, r: &Record<N>, i: usize, alpha: &[f32; LANES]) {
        let corners = scene.geometry.cells[r.cell as usize].corners.map(|p| scene.geometry.points[p as usize]);
        let depths = corners.map(|p| scene.lens.place(p).z);
        let least = depths.iter().fold(f64::INFINITY, |m, d| m.min(*d));
        let extent = depths.iter().fold(f64::NEG_INFINITY, |m, d| m.max(*d)) - least;
        for l in self.found.pixels(i) {
            let density = -(-f64::from(alpha[l])).ln_1p() / f64::from(self.found.length[i][l]);
            let depth = density.min(f64::from(self.kept.densest[i])) * extent;
            if depth > DENSE {
                self.doubt_pixel(i, l, ((DENSE / depth) as f32).max(DARK));
            }
        }
    }

    /// How many fragments a block has.
    fn count_there(&self, block: usize) -> usize {
        self.kept.there[block].count_ones() as usize
    }

    /// Column and row of the ray of a pixel.
    fn column_row(&self, at: usize) -> [f64; 2] {
        let [i, j] = pixel_at(at).map(f64::from);
        let [column, row] = self.corner.map(f64::from);
        [column + i + ASIDE.x, row + j + ASIDE.y]
    }

    /// Adds one segment of a pixel's ray, which begins at depth `enter`.
    pub(super) fn gather_two(
        &mut self,
        scene: &Scene<N>,
        two: &OfTwo,
        at: usize,
        ends: [[f64; N]; 2],
        [enter, length]: [f64; 2],
    ) {
        let [column, row] = self.column_row(at);
        let (place, along) = (scene.lens.point(column, row, enter), scene.lens.direction(column, row));
        let light = self.kept.integrate(two, ends, place, along, length);
        let through = self.light[3][at];
        for (channel, emitted) in self.light.iter_mut().zip(light.color) {
            channel[at] += through * emitted;
        }
        self.light[3][at] = through * light.transmittance;
    }
}

/// Puts those of some numbers that are there next to each other, in a row from place `at` on.
#[inline(always)]
fn put<S: Simd, const M: usize, const R: usize>(
    simd: S,
    rows: &mut [[f32; M]; R],
    row: usize,
    at: usize,
    v: Floats<S>,
    there: mask32x16<S>,
) {
    if let Some(to) = rows[row][at..].first_chunk_mut() {
        simd.compress_f32x16(v, there).store_array(to);
    }
}

impl Kept {
    /// One segment, in f64.
    fn integrate<const N: usize>(
        &mut self,
        two: &OfTwo,
        [front, back]: [[f64; N]; 2],
        place: DVec3,
        along: DVec3,
        length: f64,
    ) -> Light<f32> {
        let mut light = Light::none();
        if let Some(segment) = Segment::new(two.second, &front, &back, place, along, length) {
            two.second.add(&segment, &mut self.scratch, &mut light);
        }
        light
    }
}
