//! What a walk hands its segments to: integrals of one variable, or of two.

use super::least_transmittance;
use crate::integral::second::{Scratch, Second, Segment};
use crate::integral::{Batch, Integral, Light};
use crate::real::Real;
use glam::DVec3;

/// What integrates the segments of rays, one ray after another.
pub(super) trait Segments<const N: usize> {
    /// What values along a ray are rounded to.
    type Value: Real;
    /// A ray begins, from `origin` along a direction of length 1, in normalised coordinates.
    fn begin(&mut self, origin: DVec3, along: DVec3);
    /// Whether nothing of a cell is seen: its segments are not taken.
    #[inline(always)]
    fn skips(&self, _cell: u32) -> bool {
        false
    }
    /// Takes a segment with these values at its ends, between two places on the ray.
    fn add(&mut self, front: &[Self::Value; N], back: &[Self::Value; N], t: [f64; 2], light: &mut Light<f32>);
    /// All of the ray is to be in `light`.
    fn end(&mut self, light: &mut Light<f32>);
    /// Transmittance below which nothing behind counts.
    fn least_transmittance(&self) -> f32;
    /// Panels so far.
    fn panels(&self) -> u64;
}

/// Segments of one variable, or of values with functions of their own.
pub(super) struct One<'a> {
    integral: Integral<'a>,
    batch: Batch,
}

impl<'a> One<'a> {
    pub(super) fn new(integral: Integral<'a>) -> Self {
        One { integral, batch: Batch::default() }
    }
}

impl<const N: usize> Segments<N> for One<'_> {
    type Value = f32;

    #[inline(always)]
    fn begin(&mut self, _: DVec3, _: DVec3) {
        self.batch.clear();
    }

    #[inline(always)]
    fn add(&mut self, front: &[f32; N], back: &[f32; N], [from, to]: [f64; 2], light: &mut Light<f32>) {
        let length = (to - from) as f32;
        match self.integral.table {
            None => self.batch.add(self.integral.exact, front, back, length, light),
            Some(table) => table.add_components(self.integral.exact, front, back, length, light),
        }
    }

    #[inline(always)]
    fn end(&mut self, light: &mut Light<f32>) {
        self.batch.flush(self.integral.exact.direct, light);
    }

    #[inline(always)]
    fn least_transmittance(&self) -> f32 {
        least_transmittance(self.integral.exact.direct)
    }

    fn panels(&self) -> u64 {
        0
    }
}

/// Segments of two variables: s and g; or with the gradient, of five.
pub(super) struct Two<'a> {
    second: &'a Second,
    /// A bit for each cell that may be seen; without, all may.
    seen: Option<&'a [u64]>,
    scratch: Scratch,
    origin: DVec3,
    along: DVec3,
}

impl<'a> Two<'a> {
    pub(super) fn new(second: &'a Second, seen: Option<&'a [u64]>) -> Self {
        Two { second, seen, scratch: Scratch::default(), origin: DVec3::ZERO, along: DVec3::Z }
    }
}

impl<const N: usize> Segments<N> for Two<'_> {
    // The logarithm of the opacity convention tells values apart that are closer than f32 does.
    type Value = f64;

    #[inline(always)]
    fn skips(&self, cell: u32) -> bool {
        self.seen.is_some_and(|seen| seen[cell as usize / 64] >> (cell % 64) & 1 == 0)
    }

    #[inline(always)]
    fn begin(&mut self, origin: DVec3, along: DVec3) {
        (self.origin, self.along) = (origin, along);
    }

    #[inline(always)]
    fn add(&mut self, front: &[f64; N], back: &[f64; N], [from, to]: [f64; 2], light: &mut Light<f32>) {
        let place = self.origin + self.along * from;
        if let Some(segment) = Segment::new(self.second, front, back, place, self.along, to - from) {
            self.second.add(&segment, &mut self.scratch, light);
        }
    }

    fn end(&mut self, _: &mut Light<f32>) {}

    fn least_transmittance(&self) -> f32 {
        least_transmittance(self.second.is_direct())
    }

    fn panels(&self) -> u64 {
        self.scratch.panels
    }
}
