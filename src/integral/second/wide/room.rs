//! Where segments are put side by side.

use super::{MOST_ACTIVE, MOST_LIGHTS};
use crate::integral::floats::{Floats, LANES};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// Numbers in a row of [`Room::rows`]: a segment for each pixel of all blocks that are found together, and a vector more.
pub(super) const MOST: usize = 65 * LANES;

/// Segments that are put together, and what is made anew for them, in memory that stays.
#[derive(Debug)]
pub(crate) struct Room {
    /// A number of each segment in each row: [`Row`].
    pub(crate) rows: Vec<[f32; MOST]>,
    /// Of widgets whose box ends in the cell, where that is, and 1 where they are seen.
    pub(super) clips: [[[f32; LANES]; 2]; MOST_ACTIVE],
    pub(super) on: [[f32; LANES]; MOST_ACTIVE],
    /// Of lights, half way between them and the eye.
    pub(super) half: [[[f32; LANES]; 3]; MOST_LIGHTS],
    /// Of four texels and each channel, its value at the first, how it rises along either axis, and along both.
    pub(super) texels: [[[f32; LANES]; 4]; 4],
}

/// The rows of segments with `N` values.
pub(crate) struct Row<const N: usize>;

impl<const N: usize> Row<N> {
    /// What they emit: three rows, and the fourth is their opacity.
    pub(crate) const LIGHT: usize = 0;
    pub(crate) const LENGTH: usize = 4;
    /// Their values in front, and by how much these rise.
    pub(crate) const AT: usize = 5;
    pub(crate) const RISE: usize = 5 + N;
    /// The direction of their rays, and where they begin, in depth; not used if they are not lit.
    pub(crate) const ALONG: usize = 5 + 2 * N;
    pub(crate) const FIRST: usize = 8 + 2 * N;
    const ALL: usize = 9 + 2 * N;
}

impl Default for Room {
    fn default() -> Self {
        let none = [0.0; LANES];
        Room {
            rows: vec![],
            clips: [[none; 2]; MOST_ACTIVE],
            on: [none; MOST_ACTIVE],
            half: [[none; 3]; MOST_LIGHTS],
            texels: [[none; 4]; 4],
        }
    }
}

impl Room {
    /// Makes room for segments of `N` values.
    pub(crate) fn make<const N: usize>(&mut self) {
        self.rows.resize(Row::<N>::ALL, [0.0; MOST]);
    }

    #[inline(always)]
    pub(super) fn load<S: Simd>(&self, simd: S, row: usize, at: usize) -> Floats<S> {
        load(simd, window(&self.rows[row], at))
    }
}

/// Sixteen numbers of a row.
#[inline(always)]
pub(crate) fn window(row: &[f32; MOST], at: usize) -> &[f32; LANES] {
    row[at..].first_chunk().unwrap_or(&[0.0; LANES])
}

/// As [`window`].
#[inline(always)]
pub(super) fn window_mut(row: &mut [f32; MOST], at: usize) -> &mut [f32; LANES] {
    &mut row[at..at + LANES].as_chunks_mut::<LANES>().0[0]
}

#[inline(always)]
pub(super) fn load<S: Simd>(simd: S, v: &[f32; LANES]) -> Floats<S> {
    Floats::load_array_ref(simd, v)
}
