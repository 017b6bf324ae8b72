//! Numeric integration, as Röttger & Ertl (2002, section 3) have it: the function is a list of entries, a segment is
//! cut into n equal parts, and in each colour and extinction are those in its middle (Stein, Becker & Max 1994). They
//! give n two ways: for all texels of a slice as many as the list has entries, times an oversampling, as graphics
//! hardware blends them; or as a program may, at least twice as many as the segment touches.

use super::volume::{Kind, Table, length};
use super::{Storage, grid, is_scalar, value};
use crate::integral::Exact;
use crate::integral::opacity_of_depth;
use crate::real::Real;
use rayon::prelude::*;

/// How many samples a texel gets, and in what they are summed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sampling {
    /// Entries m of the function.
    pub entries: u32,
    /// How many.
    pub steps: Steps,
    /// Bits of each channel, of the list as of the sum, as frame buffers then had: to study what they cost. None:
    /// floats.
    pub bits: Option<u32>,
}

/// Samples of one texel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Steps {
    /// As many for all texels.
    Same(u32),
    /// As many as there are entries between the two values of the texel, times this; at least 1.
    Touched(f64),
}

impl Sampling {
    /// Entries times `oversampling`, for all texels alike: the hardware's rule, published with 1.
    pub fn same(entries: u32, oversampling: f64) -> Self {
        let steps = Steps::Same((f64::from(entries) * oversampling).ceil().max(1.0) as u32);
        Sampling { entries, steps, bits: None }
    }

    /// ⌈o m |S_f − S_b|⌉ samples: the software's rule, published with an oversampling o of 2.
    pub fn touched(entries: u32, oversampling: f64) -> Self {
        Sampling { entries, steps: Steps::Touched(oversampling), bits: None }
    }

    /// Samples of a segment between scalars `apart` in [0, 2].
    pub(crate) fn count(&self, apart: f64) -> u32 {
        match self.steps {
            Steps::Same(n) => n.max(1),
            Steps::Touched(o) => ((o * f64::from(self.entries) * apart / 2.0 - ROUNDING).ceil() as u32).max(1),
        }
    }
}

/// Whole numbers of entries that rounding makes a little more are still that.
const ROUNDING: f64 = 1e-3;

/// The function as a list of `m` entries over [−1, 1]: colour (direct: emission) and extinction.
pub(crate) fn entries(exact: &Exact<f64>, m: u32) -> Vec<[f32; 4]> {
    let at = |i| {
        let [tau, r, g, b] = grid::constant(exact, value(i, m));
        [r, g, b, tau].map(|v| v as f32)
    };
    (0..m).map(at).collect()
}

/// `x` in [0, 1] as `most` + 1 levels hold it.
#[inline(always)]
fn rounded(x: f32, most: f32) -> f32 {
    (x * most).round() / most
}

impl Table {
    /// A table of premultiplied colour and opacity, uniform or logarithmic in length, by numeric integration in f32.
    /// `None` as [`Table::new`], for [`Kind::LogNormalised`], and for less than 2 entries.
    pub fn sampled(exact: &Exact<f64>, kind: Kind, size: [u32; 3], longest: f64, sampling: Sampling) -> Option<Self> {
        let [w, h, n] = size;
        if !is_scalar(exact) || w < 2 || h < 2 || n < 3 || kind == Kind::LogNormalised || sampling.entries < 2 {
            return None;
        }
        let list = entries(exact, sampling.entries);
        let levels = sampling.bits.map(|b| (2f32).powi(b as i32) - 1.0);
        let row = |at: usize, row: &mut [[f32; 4]]| {
            let (j, k) = ((at as u32) % h, (at as u32) / h);
            let (back, l) = (value(j, h), length(kind, n, longest, k) as f32);
            for (i, texel) in (0..w).zip(row) {
                let front = value(i, w);
                let count = sampling.count((front - back).abs());
                *texel = match levels {
                    None => texel_of(&list, [front as f32, back as f32], l, count, exact.direct),
                    Some(levels) => coarse(&list, [front as f32, back as f32], l, count, exact.direct, levels),
                };
            }
        };
        let mut texels = Storage::zeroed(w as usize * h as usize * n as usize);
        texels.par_chunks_mut(w as usize).enumerate().for_each(|(at, texels)| row(at, texels));
        Some(Table { kind, size, longest, direct: exact.direct, texels })
    }
}

/// The list at a place, interpolated.
#[inline(always)]
fn entry(list: &[[f32; 4]], at: f32) -> [f32; 4] {
    let at = at.max(0.0).min((list.len() - 1) as f32);
    let low = (at as usize).min(list.len() - 2);
    let (share, a, b) = (at - low as f32, &list[low], &list[low + 1]);
    std::array::from_fn(|k| a[k] + (b[k] - a[k]) * share)
}

/// One texel, from front to back.
#[inline(always)]
fn texel_of(list: &[[f32; 4]], [front, back]: [f32; 2], l: f32, count: u32, direct: bool) -> [f32; 4] {
    let (step, scale) = (l / count as f32, (list.len() - 1) as f32 / 2.0);
    let (mut at, rise) = ((front + 1.0) * scale, (back - front) * scale / count as f32);
    at += rise / 2.0;
    let (mut sum, mut transmittance) = ([0.0; 3], 1.0);
    for i in 0..count {
        let [r, g, b, tau] = entry(list, at + rise * i as f32);
        let alpha = opacity_of_depth(tau * step);
        let seen = match direct {
            false => alpha,
            true if tau * step > 1e-6 => alpha / tau,
            true => step,
        };
        for (sum, c) in sum.iter_mut().zip([r, g, b]) {
            *sum += transmittance * seen * c;
        }
        transmittance *= 1.0 - alpha;
    }
    [sum[0], sum[1], sum[2], 1.0 - transmittance]
}

/// One texel, from back to front, as a frame buffer of few bits blends it.
fn coarse(list: &[[f32; 4]], [front, back]: [f32; 2], l: f32, count: u32, direct: bool, levels: f32) -> [f32; 4] {
    let (step, scale) = (l / count as f32, (list.len() - 1) as f32 / 2.0);
    let mut sum = [0.0f32; 4];
    for i in (0..count).rev() {
        let s = front + (back - front) * ((i as f32 + 0.5) / count as f32);
        let [r, g, b, tau] = entry(list, (s + 1.0) * scale);
        let alpha = rounded(1.0 - Real::exp(-tau * step), levels);
        let seen = if direct { step } else { 1.0 - Real::exp(-tau * step) };
        let emitted = [r, g, b].map(|c| rounded((c * seen).min(1.0), levels));
        for (k, e) in emitted.into_iter().chain([alpha]).enumerate() {
            sum[k] = rounded((sum[k] * (1.0 - alpha) + e).min(1.0), levels);
        }
    }
    sum
}
