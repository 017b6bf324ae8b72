//! Outline: which pixels of a tile a cell may cover, as blocks of 4 × 4. They begin at any column, so few hold no pixel of the cell.
//!
//! Four rows of pixels are a strip. An edge's part in a strip lies between its places at the strip's ends, or its own where it does
//! not reach these; so the outline's part lies between the least and the greatest of those of all edges.

use super::setup::EIGHT;
use crate::order::screen::TILE;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, f32x16, i32x16};

/// Pixels by which outlines are taken for larger than they are, as f32 rounds them.
const ROUNDED: f32 = 0.01;

/// Pixels from the tile from which on f32 rounds more than that: all of the cell's box is taken then.
const FAR: f32 = 1024.0;

/// Rows below which an edge's rise is none: its slope is finite, so that it may be multiplied by no rows.
const LEVEL: f32 = 1e-20;

const STRIPS: usize = TILE as usize / 4;

/// The corners of the six edges.
const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// Bytes after the last block: so that eight can be read from any on.
const PADDING: usize = 8;

/// The blocks of cells: each is a byte, the column of its first pixels and 32 times its strip.
pub(super) type Blocks = Vec<u8>;

/// Where a block's first column and first row are in the tile.
#[inline(always)]
pub(super) fn first_pixel(block: u8) -> [usize; 2] {
    [usize::from(block) % TILE as usize, usize::from(block) / TILE as usize * 4]
}

/// Appends the blocks of up to eight cells that have corners at columns `x` and rows `y` of the tile, and pixels of the boxes `pixels`
/// alone; NaN or infinite corners mean all of these. Returns where each cell's begin, and how many they are.
#[inline(always)]
pub(super) fn add_blocks<S: Simd>(
    simd: S,
    x: [f32x8<S>; 4],
    y: [f32x8<S>; 4],
    pixels: &[[u8; 4]],
    blocks: &mut Blocks,
) -> [(u32, u8); EIGHT] {
    let of = |v: f32| f32x8::splat(simd, v);
    let [mut left, mut right, mut top] = [[0.0; EIGHT]; 3];
    let mut strips = 0;
    for (l, b) in pixels.iter().enumerate() {
        (left[l], right[l], top[l]) = (f32::from(b[0]), f32::from(b[1]), f32::from(b[2] / 4 * 4));
        strips = strips.max(b[3] / 4 + 1 - b[2] / 4);
    }
    let top = f32x8::load_array(simd, top) - ROUNDED;
    let size = |v: [f32x8<S>; 4]| v[0].abs().max(v[1].abs()).max(v[2].abs().max(v[3].abs()));
    // NaN is not below it either: a sum keeps it.
    let sum = (x[0] + x[1]) + (x[2] + x[3]) + ((y[0] + y[1]) + (y[2] + y[3]));
    let near = size(x).max(size(y)).simd_lt(of(FAR)) & sum.simd_eq(sum);
    // Two strips are done at a time.
    let twice = |v: f32x8<S>| v.combine(v);
    let none = twice(of(0.0));
    let mut edges = [Edge { from: none, at: none, slope: none, low: none, high: none }; 6];
    for (edge, [a, b]) in edges.iter_mut().zip(EDGES) {
        let rise = y[b] - y[a];
        let slope = (x[b] - x[a]) / rise.abs().max(of(LEVEL)).copysign(rise);
        *edge = Edge {
            from: twice(y[a]),
            at: twice(x[a]),
            slope: twice(slope),
            low: twice(y[a].min(y[b])),
            high: twice(y[a].max(y[b])),
        };
    }
    let (left, right, near) = (
        twice(f32x8::load_array(simd, left)),
        twice(f32x8::load_array(simd, right)),
        twice(near.select(of(1.0), of(0.0))),
    );
    let of = |v: f32| f32x16::splat(simd, v);
    let near = near.simd_gt(of(0.0));
    let (least, most) = (of(f32::NEG_INFINITY), of(f32::INFINITY));
    // Of each strip of each cell, columns where its blocks begin, and their number.
    let mut found = [[[0; 2 * EIGHT]; 2]; TILE as usize / 8];
    for (k, found) in found.iter_mut().enumerate().take(usize::from(strips.div_ceil(2))) {
        let top = (top + 8.0 * k as f32).combine(top + (8.0 * k as f32 + 4.0));
        let bottom = top + (3.0 + 2.0 * ROUNDED);
        let (mut low, mut high) = (most, least);
        for e in &edges {
            let here = e.low.simd_le(bottom) & e.high.simd_ge(top);
            let (a, b) = (e.column(top), e.column(bottom));
            low = low.min(here.select(a.min(b), most));
            high = high.max(here.select(a.max(b), least));
        }
        let first = near.select((low - ROUNDED).ceil(), least).max(left);
        let last = near.select((high + ROUNDED).floor(), most).min(right);
        let number = ((last - first) * 0.25 + 1.0).floor().max(of(0.0));
        // The last ends in the tile.
        let first = first.min(number.mul_add(of(-4.0), of(TILE as f32)));
        *found = [first, number].map(|v| i32x16::truncate_from(v).to_array());
    }
    let mut all = [(0, 0); EIGHT];
    let mut at = blocks.len().saturating_sub(PADDING);
    // Eight blocks of a strip are written at a time, and those that are none again by the next.
    blocks.resize(at + pixels.len() * STRIPS * PADDING + PADDING, 0);
    for (l, b) in pixels.iter().enumerate() {
        let begin = at;
        let (top, bottom) = (b[2] / 4, b[3] / 4);
        for (k, strip) in (top..=bottom).enumerate() {
            let [first, number] = found[k / 2 % (STRIPS / 2)].map(|v| v[k % 2 * EIGHT + l]);
            let first = u32::from(strip) * TILE + first as u32;
            let eight = (u64::from(first & 0xff) * 0x0101_0101_0101_0101).wrapping_add(0x1c18_1410_0c08_0400);
            blocks[at..at + 8].copy_from_slice(&eight.to_le_bytes());
            at += number as usize;
        }
        all[l] = (begin as u32, (at - begin) as u8);
    }
    blocks.truncate(at + PADDING);
    all
}

/// An edge: a corner's row and column, columns for each row, and between which rows it is.
#[derive(Clone, Copy)]
struct Edge<S: Simd> {
    from: f32x16<S>,
    at: f32x16<S>,
    slope: f32x16<S>,
    low: f32x16<S>,
    high: f32x16<S>,
}

impl<S: Simd> Edge<S> {
    /// The column at a row, or at its end that is nearer to that.
    #[inline(always)]
    fn column(&self, row: f32x16<S>) -> f32x16<S> {
        (row.max(self.low).min(self.high) - self.from).mul_add(self.slope, self.at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fearless_simd::{Level, dispatch};

    /// The blocks of eight cells, each with its corners and box of pixels.
    fn blocks_of(corners: &[[[f32; 2]; 4]; EIGHT], pixels: &[[u8; 4]; EIGHT]) -> Vec<Vec<u8>> {
        let mut all = vec![];
        let own = dispatch!(Level::new(), simd => {
            let of = |k: usize, x: usize| f32x8::load_array(simd, corners.map(|c| c[k][x]));
            let [x, y] = [0, 1].map(|x| [of(0, x), of(1, x), of(2, x), of(3, x)]);
            // Others' blocks come first.
            add_blocks(simd, x, y, pixels, &mut all);
            add_blocks(simd, x, y, pixels, &mut all)
        });
        own.iter().map(|&(first, n)| all[first as usize..][..usize::from(n)].to_vec()).collect()
    }

    #[test]
    fn blocks_hold_each_pixel_of_a_cell_once() {
        let mut seed = 7_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as f32 / (1_u64 << 31) as f32
        };
        let (mut blocks, mut idle) = (0, 0);
        for round in 0..4000 {
            let size = [2.0, 8.0, 40.0, 300.0][round % 4];
            let corners: [[[f32; 2]; 4]; EIGHT] = std::array::from_fn(|_| {
                let middle = [random() * 32.0, random() * 32.0];
                let mut corners = [[0.0; 2]; 4].map(|_| middle.map(|m: f32| m + (random() - 0.5) * size));
                if round % 5 == 0 {
                    // Edges along rows and columns of pixels.
                    corners = corners.map(|p| p.map(f32::round));
                }
                corners
            });
            let pixels = corners.map(|c| {
                let ends = |x: usize| {
                    let (low, high) = c.iter().fold((f32::MAX, f32::MIN), |(l, h), p| (l.min(p[x]), h.max(p[x])));
                    [low.ceil().clamp(0.0, 31.0) as u8, high.floor().clamp(0.0, 31.0) as u8]
                };
                let ([left, right], [top, bottom]) = (ends(0), ends(1));
                [left, right.max(left), top, bottom.max(top)]
            });
            for ((corners, pixels), own) in corners.iter().zip(&pixels).zip(blocks_of(&corners, &pixels)) {
                let mut covered = [[0; TILE as usize]; TILE as usize];
                for &block in &own {
                    let [column, row] = first_pixel(block);
                    assert!(column + 4 <= TILE as usize, "a block leaves the tile");
                    (0..4).for_each(|j| covered[row + j][column..column + 4].iter_mut().for_each(|n| *n += 1));
                    let holds = |j: usize| (0..4).any(|i| is_inside(corners, [column + i, row + j]));
                    (blocks, idle) = (blocks + 1, idle + usize::from(!(0..4).any(holds)));
                }
                for (j, i) in (pixels[2]..=pixels[3]).flat_map(|j| (pixels[0]..=pixels[1]).map(move |i| (j, i))) {
                    let (i, j) = (usize::from(i), usize::from(j));
                    assert!(covered[j][i] <= 1, "pixel ({i}, {j}) is in {} blocks", covered[j][i]);
                    assert!(covered[j][i] == 1 || !is_inside(corners, [i, j]), "{corners:?} miss pixel ({i}, {j})");
                }
            }
        }
        assert!(idle * 4 < blocks, "{idle} of {blocks} blocks hold no pixel of their cell");
    }

    /// Whether a pixel's centre is in the outline of these corners: in one of their triangles.
    fn is_inside(corners: &[[f32; 2]; 4], pixel: [usize; 2]) -> bool {
        let [x, y] = pixel.map(|v| v as f64);
        (0..4).any(|left_out| {
            let p: Vec<[f64; 2]> = (0..4).filter(|k| *k != left_out).map(|k| corners[k].map(f64::from)).collect();
            let side = |a: [f64; 2], b: [f64; 2]| (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]);
            let sides = [side(p[0], p[1]), side(p[1], p[2]), side(p[2], p[0])];
            sides.iter().all(|s| *s > 0.0) || sides.iter().all(|s| *s < 0.0)
        })
    }

    #[test]
    fn corners_that_f32_does_not_tell_mean_all_of_the_box() {
        for far in [f32::NAN, f32::INFINITY, 1e7] {
            let corners = [[[3.0, 3.0], [far, 4.0], [5.0, far], [9.0, 9.0]]; EIGHT];
            for own in blocks_of(&corners, &[[2, 20, 3, 9]; EIGHT]) {
                assert_eq!(own.len(), 5 * 3, "columns 2 to 20 of strips 0 to 2");
            }
        }
    }
}
