//! Where segments are put side by side.

use super::pieces::Pieces;
use super::{MOST_ACTIVE, MOST_LIGHTS};
use crate::integral::floats::{Floats, LANES};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// Numbers in a row of [`Room::rows`]: a segment for each pixel of all blocks that are found together, and a vector more.
pub(super) const MOST: usize = 65 * LANES;

/// Rows of numbers: as many as the most values need.
pub(super) type Numbers = Box<[[f32; MOST]; Row::<5>::ALL]>;

/// Segments that are put together, and what is made anew for them, in memory that stays.
#[derive(Debug)]
pub(crate) struct Room {
    /// A number of each segment in each row: [`Row`].
    pub(crate) rows: Numbers,
    /// Of widgets whose box ends in the cell, where that is, and 1 where they are seen.
    pub(super) clips: [[[f32; LANES]; 2]; MOST_ACTIVE],
    pub(super) on: [[f32; LANES]; MOST_ACTIVE],
    /// Of lights that have a direction, what is linear along segments, in front and its rise: the gradient towards it, and half way
    /// between it and the eye; or of what is reflected the cosine of the light with the ray.
    pub(super) lamps: [[[f32; LANES]; 4]; MOST_LIGHTS],
    /// Of four texels and each channel, its value at the first, how it rises along either axis, and along both.
    pub(super) texels: [[[f32; LANES]; 4]; 4],
    pub(super) pieces: Pieces,
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
    pub(super) const ALL: usize = 9 + 2 * N;
}

impl Default for Room {
    fn default() -> Self {
        let zeros = [0.0; LANES];
        Room {
            rows: none(),
            clips: [[zeros; 2]; MOST_ACTIVE],
            on: [zeros; MOST_ACTIVE],
            lamps: [[zeros; 4]; MOST_LIGHTS],
            texels: [[zeros; 4]; 4],
            pieces: Pieces::default(),
        }
    }
}

/// Zeros in all rows.
pub(super) fn none() -> Numbers {
    bytemuck::zeroed_box()
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
