//! Find: the pixels of cells' blocks whose rays are inside the cells.
//!
//! A ray that is inside a cell must have been outside of all others until there: see [`super::fine`].

use super::fine::{Canvas, PIXELS, SLACK, STRIPS, window, window_mut};
use super::lanes::{Floats, LANES};
use super::outline::first_pixel;
use super::setup::{Look, Record, Records};
use crate::order::crossings::Crossings;
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// Blocks that are kept: as many as a cell can have in a tile.
pub(super) const MOST_BLOCKS: usize = 64;

/// Blocks that are copied together.
const TOGETHER: usize = 8;

/// Columns and rows of the pixels of a block.
const ACROSS_BLOCK: [f32; LANES] = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0, 3.0, 3.0, 3.0, 3.0];
const DOWN_BLOCK: [f32; LANES] = [0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0];

/// The pixels of a block, a bit each, by its columns, a bit each.
const OF_COLUMNS: [u64; 16] = {
    let mut table = [0; 16];
    let mut columns = 0;
    while columns < 16 {
        let mut k = 0;
        while k < 4 {
            table[columns] |= (columns as u64 >> k & 1) * (15 << (4 * k));
            k += 1;
        }
        columns += 1;
    }
    table
};

/// What to add to the second and third face by the number of faces turned to the eye, which come first: so that they are none of
/// those, and so that they are none of the others.
const OTHERS: [[[f32; 2]; 2]; 5] = {
    // Infinity would make NaN of what is infinite itself.
    const EVER: f32 = 1e38;
    const NEVER: f32 = -EVER;
    [
        [[NEVER, NEVER], [0.0, 0.0]],
        [[NEVER, NEVER], [0.0, 0.0]],
        [[0.0, NEVER], [EVER, 0.0]],
        [[0.0, 0.0], [EVER, EVER]],
        // Rounding: no ray is inside.
        [[EVER, EVER], [EVER, EVER]],
    ]
};

/// Blocks of cells, in the order of these, and their fragments.
#[derive(Debug)]
pub(super) struct Found {
    block: [u8; MOST_BLOCKS + TOGETHER],
    record: [u32; MOST_BLOCKS + TOGETHER],
    pub(super) count: usize,
    /// Where each pixel's ray enters and leaves: v ([`super::setup`]), later the values there. 0 for a ray that misses the cell.
    pub(super) enter: [[f32; LANES]; MOST_BLOCKS],
    pub(super) leave: [[f32; LANES]; MOST_BLOCKS],
    /// 0 for a ray that misses the cell.
    pub(super) length: [[f32; LANES]; MOST_BLOCKS],
}

impl Default for Found {
    fn default() -> Self {
        let none = [[0.0; LANES]; MOST_BLOCKS];
        let (block, record) = ([0; MOST_BLOCKS + TOGETHER], [0; MOST_BLOCKS + TOGETHER]);
        Found { block, record, count: 0, enter: none, leave: none, length: none }
    }
}

impl Found {
    pub(super) fn clear(&mut self) {
        self.count = 0;
    }

    /// Whether a cell's blocks can be kept, too.
    #[inline(always)]
    pub(super) fn has_room<const N: usize>(&self, r: &Record<N>) -> bool {
        self.count + usize::from(r.blocks) <= MOST_BLOCKS
    }

    /// Keeps the blocks of record `i`, for which there is room.
    #[inline(always)]
    pub(super) fn take<const N: usize>(&mut self, records: &Records<N>, i: usize) {
        let r = &records.all[i];
        let n = usize::from(r.blocks);
        // Always some at a time: most cells have few, but how many is hard for a processor to foresee.
        for k in (0..n).step_by(TOGETHER) {
            let (to, from) = (self.count + k, r.first_block as usize + k);
            self.block[to..to + TOGETHER].copy_from_slice(&records.blocks[from..from + TOGETHER]);
            self.record[to..to + TOGETHER].fill(i as u32);
        }
        self.count += n;
    }

    /// The record of the cell of the `i`-th block.
    #[inline(always)]
    pub(super) fn record<'a, const N: usize>(&self, records: &'a Records<N>, i: usize) -> &'a Record<N> {
        &records.all[self.record[i] as usize]
    }

    /// The place of the first pixel of the `i`-th block.
    #[inline(always)]
    pub(super) fn place(&self, i: usize) -> usize {
        place_of(self.block[i])
    }

    /// Columns and rows of the pixels of the `i`-th block from R.
    #[inline(always)]
    pub(super) fn pixels_from<S: Simd, const N: usize>(&self, simd: S, r: &Record<N>, i: usize) -> [Floats<S>; 2] {
        pixels_from(simd, r, self.block[i])
    }

    /// Which pixels of the `i`-th block have fragments, once their lengths are known.
    pub(super) fn pixels(&self, i: usize) -> impl Iterator<Item = usize> + use<> {
        let length = self.length[i];
        (0..LANES).filter(move |l| length[*l] != 0.0)
    }

    /// Cuts off what lies outside the keys `limits` of each pixel.
    #[inline(always)]
    pub(super) fn limit<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        limits: &[[f32; PIXELS]; 2],
        records: &Records<N>,
    ) {
        let zero = Floats::splat(simd, 0.0);
        let load = |v: &[f32; LANES]| Floats::load_array_ref(simd, v);
        for i in 0..self.count.min(MOST_BLOCKS) {
            let ([base, ratio], at) = (self.record(records, i).key, self.place(i));
            let [low, high] = [0, 1].map(|k| (load(window(&limits[k], at)) - base) / ratio);
            let (enter, leave) = (load(&self.enter[i]), load(&self.leave[i]));
            let (enter, leave, inside) = (enter.max(low), leave.min(high), enter.simd_lt(leave));
            let inside = inside & enter.simd_lt(leave);
            inside.select(enter, zero).store_array(&mut self.enter[i]);
            inside.select(leave, zero).store_array(&mut self.leave[i]);
        }
    }
}

impl<const N: usize> Canvas<N> {
    /// Finds the pixels of the blocks kept whose rays are inside the cells, and checks that they were outside until there. Blocks of
    /// which nothing is seen are dropped.
    #[inline(always)]
    pub(super) fn find<S: Simd>(&mut self, simd: S, crossings: &Crossings, records: &Records<N>) {
        let of = |v: f32| Floats::splat(simd, v);
        let load = |v: &[f32; LANES]| Floats::load_array_ref(simd, v);
        let (zero, slack) = (of(0.0), of(SLACK));
        let mut kept = 0;
        for i in 0..self.found.count.min(MOST_BLOCKS) {
            let (block, r) = (self.found.block[i], self.found.record(records, i));
            let [column, row] = first_pixel(block);
            let alive = self.alive[row / 4 % STRIPS] >> column & 15;
            if alive == 0 {
                continue;
            }
            let at = place_of(block);
            let [x, y] = pixels_from(simd, r, block);
            let v = |f: usize| x.mul_add(of(r.plane[1][f]), y.mul_add(of(r.plane[2][f]), of(r.plane[0][f])));
            let [a, b, c, d] = [v(0), v(1), v(2), v(3)];
            // Of faces that are turned to the eye the last, of others the first: one of each kind at least, or the eye is inside.
            let [not_front, not_back] = OTHERS[usize::from(r.fronts) % 5];
            let (mut enter, mut leave) =
                (a.max(b + not_front[0]).max(c + not_front[1]), d.min(c + not_back[1]).min(b + not_back[0]));
            if r.fronts == 0 {
                // From very near to the eye.
                enter = of(if r.kappa > 0.0 { -1e7 / (r.kappa * r.kappa) } else { f32::NEG_INFINITY });
                leave = leave.min(a);
            }
            // What lies behind the eye is beyond what is infinitely far.
            let leave = leave.min(of(r.end));
            let inside = enter.simd_lt(leave);
            let last = load(window(&self.last, at));
            let (base, ratio) = (of(r.key[0]), of(r.key[1]));
            let (key_in, key_out) = (ratio.mul_add(enter, base), ratio.mul_add(leave, base));
            let allowed = key_in.abs().mul_add(slack, slack);
            let apart = !(key_in - last).abs().simd_le(allowed) & inside;
            let apart = apart.to_bitmask() & OF_COLUMNS[alive as usize];
            if apart != 0 {
                self.check_gaps(crossings, at, apart, last.to_array(), key_in.to_array());
            }
            // Not a selection from what was there: that would become a masked store, which some processors do slowly.
            let end = inside.select(key_out, of(f32::NEG_INFINITY));
            last.max(end).store_array(window_mut(&mut self.last, at));
            let pixels = if r.look == Look::Seen { inside.to_bitmask().count_ones() } else { 0 };
            let found = &mut self.found;
            inside.select(enter, zero).store_array(&mut found.enter[kept % MOST_BLOCKS]);
            inside.select(leave, zero).store_array(&mut found.leave[kept % MOST_BLOCKS]);
            (found.block[kept], found.record[kept]) = (block, found.record[i]);
            kept += usize::from(pixels > 0);
            self.fragments += u64::from(pixels);
        }
        self.found.count = kept;
    }
}

/// The place of a block's first pixel.
#[inline(always)]
fn place_of(block: u8) -> usize {
    (usize::from(block) * 4).min(PIXELS - LANES)
}

/// Columns and rows of a block's pixels from R.
#[inline(always)]
pub(super) fn pixels_from<S: Simd, const N: usize>(simd: S, r: &Record<N>, block: u8) -> [Floats<S>; 2] {
    let [column, row] = first_pixel(block).map(|v| v as f32);
    let load = |v: &[f32; LANES]| Floats::load_array_ref(simd, v);
    // Whole pixels first, which are exact.
    [(load(&ACROSS_BLOCK) + (column - r.at[0])) - r.rest[0], (load(&DOWN_BLOCK) + (row - r.at[1])) - r.rest[1]]
}
