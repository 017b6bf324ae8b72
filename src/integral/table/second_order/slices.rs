//! The published construction: parabolas as slices of one value each, eight texels side by side.

use super::super::{Storage, value};
use super::{REACH, parabola};
use crate::integral::Exact;
use crate::integral::cubic::stretch::LANES;
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x4, f32x8, u32x8};
use rayon::prelude::*;

/// The least entries of the function where it is summed in steps.
const ENTRIES: u32 = 2048;

/// Room for entries: as many as a table of [`super::MOST_OF_ONE_LENGTH`] texels has, and a power of two.
const ROOM: usize = 4096;

/// A number to whose lowest bits f32 rounds what is added.
const WHOLE: f32 = (1u32 << 23) as f32;

/// What slices do by their value: red, green, blue and opacity, from the least value that a parabola reaches to the greatest.
pub(crate) struct Slices {
    entries: Box<[[f32; 4]; ROOM]>,
    last: usize,
    /// Entries for each normalised unit.
    per_unit: f32,
    size: u32,
    iterations: u32,
}

impl Slices {
    /// Of slabs of `length` in so many `iterations`, for a table of `size` texels along each axis.
    pub(crate) fn new(exact: &Exact<f64>, size: u32, length: f64, iterations: u32) -> Self {
        // Between two texels are as many entries as let each texel's value have one, by a multiple of 8.
        let between_texels = 8 * ENTRIES.div_ceil(10 * (size - 1));
        let per_unit = f64::from((size - 1) * between_texels) / 2.0;
        let last = (2.0 * REACH * per_unit).round() as usize;
        let slice = length / f64::from(iterations);
        let of_value = |i: usize| parabola(exact, [i as f64 / per_unit - REACH; 3], slice).map(|v| v as f32);
        let mut entries = Box::new([[0.0; 4]; ROOM]);
        let last = last.min(ROOM - 1);
        entries[..=last].par_iter_mut().enumerate().for_each(|(i, entry)| *entry = of_value(i));
        Slices { entries, last, per_unit: per_unit as f32, size, iterations }
    }

    /// What slices do by their value, entries for each normalised unit.
    pub(crate) fn entries(&self) -> (&[[f32; 4]], f32) {
        (&self.entries[..=self.last], self.per_unit)
    }

    /// How far an entry may be from the value that it stands for.
    pub(super) fn rounding(size: u32) -> f64 {
        0.5 / (f64::from((size - 1) * 8 * ENTRIES.div_ceil(10 * (size - 1))) / 2.0)
    }

    /// Fills a table of floats.
    pub(super) fn fill(&self, texels: &mut Storage) {
        let n = self.size as usize;
        texels.par_chunks_mut(n * n).enumerate().for_each(|(b, layer)| {
            dispatch!(Level::new(), simd => self.layer(simd, b, |i, texel| layer[i] = texel));
        });
    }

    /// Fills a table of bytes, of which 255 stands for `span` in colours, and for 1 in opacities.
    pub(super) fn fill_bytes(&self, texels: &mut [[u8; 4]], span: f32) {
        let n = self.size as usize;
        let over = [255.0 / span, 255.0 / span, 255.0 / span, 255.0];
        texels.par_chunks_mut(n * n).enumerate().for_each(|(b, layer)| {
            let mut put = |i: usize, t: [f32; 4]| layer[i] = std::array::from_fn(|k| (t[k] * over[k] + 0.5) as u8);
            dispatch!(Level::new(), simd => self.layer(simd, b, &mut put));
        });
    }

    /// Calls `put` with each texel of the layer of the sample `b` behind, by number.
    #[inline(always)]
    fn layer<S: Simd>(&self, simd: S, b: usize, mut put: impl FnMut(usize, [f32; 4])) {
        let n = self.size as usize;
        let scaled = |i: usize| value(i.min(n - 1) as u32, self.size) as f32 * self.per_unit;
        for m in 0..n {
            for first in (0..n).step_by(LANES) {
                let front: [f32; LANES] = std::array::from_fn(|l| scaled(first + l));
                let eight = self.eight(simd, front, scaled(m), scaled(b));
                eight.into_iter().take(n - first).enumerate().for_each(|(l, texel)| put(m * n + first + l, texel));
            }
        }
    }

    /// The texels of eight samples in front, with one in the middle and one behind, in entries: from back to front, each
    /// slice over what lies behind it, C ← c + (1 − α) C, and opacity likewise.
    #[inline(always)]
    fn eight<S: Simd>(&self, simd: S, front: [f32; LANES], m: f32, b: f32) -> [[f32; 4]; LANES] {
        let f = f32x8::load_array(simd, front);
        let second = f + f + (2.0 * b - 4.0 * m);
        let first = f * -3.0 + (4.0 * m - b);
        let start = f + (REACH as f32) * self.per_unit;
        let most = f32x8::splat(simd, self.last as f32);
        let over = 1.0 / self.iterations as f32;
        let mut sums = [f32x4::splat(simd, 0.0); LANES];
        for step in (0..self.iterations).rev() {
            let u = f32x8::splat(simd, (step as f32 + 0.5) * over);
            let at = second.mul_add(u, first).mul_add(u, start).max(f32x8::splat(simd, 0.0)).min(most);
            let bits: u32x8<S> = (at + WHOLE).bitcast();
            let bits: [u32; LANES] = bits.into();
            for l in 0..LANES {
                let slice = &self.entries[bits[l] as usize % ROOM];
                let (sum, alpha) = (sums[l], f32x4::splat(simd, -slice[3]));
                sums[l] = alpha.mul_add(sum, sum + f32x4::load_array_ref(simd, slice));
            }
        }
        let mut texels = [[0.0; 4]; LANES];
        sums.iter().zip(&mut texels).for_each(|(sum, texel)| sum.store_array(texel));
        texels
    }
}
