//! Eight rays side by side: the caster's way for scalars, by far the fastest.
//!
//! A packet of neighbouring rays goes from plane to plane ([`walk`]) for some steps; the values at the corners of what they
//! pass are fetched ([`corners`]); along each ray they make a cubic, in f32 and in the units of the function's knots
//! ([`lines`]). A ray stays on its line of the function until the cubic's Bernstein coefficients leave that: so nothing is
//! looked up where no knot is met, and the integral is in closed form but for one sum (`integral::cubic::stretch`). The others are cut
//! where they meet knots ([`cut`]). What f32 has too few digits for, a voxel at a time, [`Exact`] does in f64.
//!
//! [`Exact`]: crate::integral::Exact

#![allow(clippy::needless_range_loop, reason = "axes, lanes and channels of several arrays are counted at once")]

mod corners;
mod cut;
mod lines;
mod march;
mod near;
mod packet;
mod passed;
mod taken;
#[cfg(test)]
pub(super) mod tests;
mod walk;

use super::ray::{Frame, Visible, enter, least_light};
use super::reconstruction::{Reconstruction, ReconstructionOrder, Sampling};
use super::volume::Volume;
use crate::field::Normalization;
use crate::integral::lines::Map;
use crate::mesh::{Values, with_values};
use crate::view::Blend;
use corners::{STEPS, Texel};
use fearless_simd::{Level, Simd};
use lines::Lines;
use packet::Packet;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering::Relaxed};
use walk::{LANES, Ray, Way};

/// Rows of pixels that are drawn at a time, and the pixels of a packet.
const BAND: usize = 8;
const WIDE: usize = 4;
const HIGH: usize = LANES / WIDE;

/// Optical depth of a voxel from which on rays may end soon, and steps to begin with then.
const STEEP: f64 = 2.0;
const FEW: usize = 2;

/// What all packets of a frame share.
pub(super) struct Scene<'a> {
    frame: &'a Frame<'a>,
    visible: &'a Visible,
    lines: Lines,
    voxels: Way<'a>,
    /// Where blocks are passed, and which are seen; nothing if all are.
    blocks: Option<(Way<'a>, &'a [bool])>,
    /// How far the rows of a voxel are behind its first value.
    rows: [usize; 4],
    /// Whether what is fetched are integers, and its map.
    integers: bool,
    map: Map,
    /// From values that lines are over to those that the field's own map gives: times the first, plus the second.
    back: [f64; 2],
    least: f32,
    /// The length of equal steps, if there are such.
    step: Option<f64>,
    /// Steps of a packet's first chunk: few where rays soon end.
    pace: usize,
}

impl<'a> Scene<'a> {
    /// Nothing if the frame is none for lanes: they have scalars, composited, and equal steps on even axes only.
    fn new(frame: &'a Frame<'a>, visible: &'a Visible, seen: &'a [bool]) -> Option<Self> {
        let Frame { volume, samples, exact, .. } = *frame;
        let step = match frame.reconstruction {
            Reconstruction { order: ReconstructionOrder::Exact, .. }
            | Reconstruction { sampling: Sampling::Voxels, .. } => None,
            Reconstruction { sampling: Sampling::Steps(step), .. } => Some(step),
        };
        let uneven = step.is_some() && !volume.even;
        if samples.components != 1 || frame.view.blend() != Blend::Composite || uneven {
            return None;
        }
        // Lanes hand what is missing to f64, and look up nothing of it.
        if frame.table.is_some() && samples.missing.is_some() || volume.point_count() > u32::MAX as usize {
            return None;
        }
        let normal: Normalization = samples.normal[0];
        let (plain, integers) = kind(&samples.values);
        let lines = Lines::new(exact, normal, plain)?;
        let map = if plain { lines.map } else { Map { mid: 0.0, factor: 1.0 } };
        let back = [1.0 / (lines.map.factor * normal.half), (lines.map.mid - normal.mid) / normal.half];
        let hides = volume.hidden.is_some();
        let blocks = seen.contains(&false).then(|| (Way::blocks(volume, samples), seen));
        let [row, layer] = samples.stride;
        let width = volume.diagonal() * volume.scale / volume.cells.iter().sum::<usize>() as f64;
        let steepest = exact.opacity.value.iter().fold(0.0, |most: f64, v| most.max(v[0]));
        Some(Scene {
            frame,
            visible,
            lines,
            voxels: Way::voxels(volume, samples, hides),
            blocks,
            rows: [0, row, layer, layer + row],
            integers,
            map,
            back,
            step,
            least: least_light(exact.direct) as f32,
            pace: if steepest * width > STEEP { FEW } else { STEPS },
        })
    }

    /// The ray of pixel (`i`, `j`).
    fn ray(&self, i: usize, j: usize) -> Option<Ray> {
        let Volume { axes, cells, even, .. } = self.frame.volume;
        let (mut o, mut d, limits) = enter(self.frame, i as u32, j as u32)?;
        if *even {
            for a in 0..3 {
                let per = cells[a] as f64 / (axes[a][cells[a]] - axes[a][0]);
                (o[a], d[a]) = ((o[a] - axes[a][0]) * per, d[a] * per);
            }
        }
        Some(Ray { o, d, limits })
    }
}

/// Whether f32 holds values of this type, and whether they are integers then.
fn kind(values: &Values) -> (bool, bool) {
    fn of<T: Texel>(_: &[T]) -> (bool, bool) {
        (T::PLAIN, T::INTEGER)
    }
    with_values!(values, v => of(v))
}

/// Draws a frame, and says how many voxels its rays passed; nothing if it is none for lanes.
pub(super) fn render(frame: &Frame, visible: &Visible, seen: &[bool]) -> Option<(Vec<[f32; 4]>, u64)> {
    let scene = Scene::new(frame, visible, seen)?;
    let level = Level::new();
    let [w, h] = frame.view.size().map(|n| n as usize);
    let mut pixels = vec![[0.0; 4]; w * h];
    let (stopped, steps, done) = (AtomicBool::new(false), AtomicU64::new(0), AtomicUsize::new(0));
    pixels.par_chunks_mut(w * BAND).enumerate().for_each_init(Box::<Packet>::default, |packet, (band, rows)| {
        if stopped.load(Relaxed) {
            return;
        }
        packet.steps = 0;
        for corner in (0..w).step_by(WIDE) {
            for top in (0..rows.len() / w).step_by(HIGH) {
                let mut rays = [None; LANES];
                for (l, ray) in rays.iter_mut().enumerate() {
                    let (i, j) = (corner + l % WIDE, top + l / WIDE);
                    if i < w && j < rows.len() / w {
                        *ray = scene.ray(i, band * BAND + j);
                    }
                }
                if rays.iter().all(Option::is_none) {
                    continue;
                }
                let light = draw(level, packet, &scene, &rays);
                for (l, light) in light.iter().enumerate().filter(|(l, _)| rays[*l].is_some()) {
                    rows[(top + l / WIDE) * w + corner + l % WIDE] = *light;
                }
            }
        }
        steps.fetch_add(packet.steps, Relaxed);
        let share = (done.fetch_add(rows.len(), Relaxed) + rows.len()) as f64 / (w * h) as f64;
        if (frame.progress)(share).is_break() {
            stopped.store(true, Relaxed);
        }
    });
    Some((pixels, steps.into_inner()))
}

/// Draws eight rays in the instructions of `level`.
#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
fn draw(level: Level, packet: &mut Packet, scene: &Scene, rays: &[Option<Ray>; LANES]) -> [[f32; 4]; LANES] {
    // Two forms are enough: each is a good part of the library.
    if let Some(avx2) = level.as_avx2() {
        avx2.vectorize(
            #[inline(always)]
            || packet.draw(avx2, scene, rays),
        )
    } else if let Some(sse2) = level.as_sse2() {
        sse2.vectorize(
            #[inline(always)]
            || packet.draw(sse2, scene, rays),
        )
    } else {
        [[0.0; 4]; LANES]
    }
}

/// Draws eight rays in the instructions of `level`.
#[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
fn draw(level: Level, packet: &mut Packet, scene: &Scene, rays: &[Option<Ray>; LANES]) -> [[f32; 4]; LANES] {
    fearless_simd::dispatch!(level, simd => packet.draw(simd, scene, rays))
}
