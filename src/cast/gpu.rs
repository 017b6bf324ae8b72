//! The caster on a GPU: what `shaders/cast.wgsl` needs, handed over once and kept until it changes.
//!
//! One invocation follows one ray, as [`lanes`](super::lanes) do eight side by side: from plane to plane by differences of
//! planes and of places that f32 knows exactly; values in their own type become a cubic in the units of the function's knots,
//! which is cut where it meets a line's end and summed up by the same rule. What f32 has too few digits for, a device finds and
//! leaves: the CPU draws the whole ray then ([`ray`](super::ray), in f64).

mod frame;
mod texels;

use super::ray::{self, Frame, Visible, least_light};
use super::reconstruction::{Reconstruction, ReconstructionOrder, Sampling};
use super::volume::{BLOCK, Samples};
use crate::error::Result;
use crate::gpu::arrays::{self, INVISIBLE};
use crate::gpu::bands::{Bands, Drawn};
use crate::gpu::buffers::{Buffer, Chunks};
use crate::gpu::lines::Lines;
use crate::gpu::raster::Slot;
use crate::gpu::rays::FAR;
use crate::gpu::shader::{self, ShaderArray};
use crate::gpu::stretch::{self, StretchVariant};
use crate::gpu::{Gpu, Part, raster};
use crate::integral::lines::Map;
use crate::view::Blend;
use frame::{CastUniforms, FINEST, fineness, planes_of};
use rayon::prelude::*;
use std::fmt::Write;
use texels::Texel;
use wgpu::ShaderStages as Stages;

const CAST: &str = include_str!("../../shaders/cast.wgsl");

/// The arrays that the caster reads, and what WGSL calls their elements.
const ARRAYS: [(&str, &str); 4] = [("words", "u32"), ("axes", "vec2f"), ("hidden", "u32"), ("seen", "u32")];

/// Rays of one dispatch at most: a driver ends work that takes seconds.
const RAYS: u64 = 1 << 20;

/// Loop iterations of one ray that llvmpipe surely makes: an eighth of those that 8 rays may make together.
const LLVMPIPE_WORK: u32 = 8000;

/// Opacity of a pixel whose ray the device did not finish.
const UNFINISHED: f32 = -2e30;

/// Of a picture, what the device may leave unfinished: with more than one pixel in so many, the CPU draws all, eight rays at a
/// time.
const FEW: usize = 4;

/// How near to a plane a ray that stays beside it is in it, in widths of a voxel.
const SNAP: f32 = 1e-6;

/// How much worse than a map of their own the one that values were handed over by may be.
const WORSE: f64 = 8.0;

/// A frame as the device drew it.
pub(crate) struct CastFrame {
    /// Premultiplied colours.
    pub(crate) pixels: Vec<[f32; 4]>,
    /// Voxels passed.
    pub(crate) steps: u64,
    /// Pixels that the CPU drew.
    pub(crate) by_cpu: u64,
    /// What the device itself says that the frame took, in ms.
    pub(crate) device_ms: Option<f64>,
}

/// What a device holds of the transfer function.
#[derive(Debug)]
struct HeldFunction {
    buffers: [Buffer; 3],
    are_curved: bool,
    /// What lines are over.
    maps: [Map; 4],
    /// A bit for each block, for composited rays and for the largest values.
    seen: [Chunks; 2],
    skips: [bool; 2],
}

/// What a device holds of a grid, its values and their function.
#[derive(Debug, Default)]
pub(crate) struct Caster {
    grid: Option<[Chunks; 2]>,
    values: Option<(Chunks, [Map; 4])>,
    function: Option<HeldFunction>,
    program: Option<Program>,
}

#[derive(Debug)]
struct Program {
    source: String,
    pipeline: wgpu::ComputePipeline,
    layouts: [wgpu::BindGroupLayout; 2],
}

impl Caster {
    /// Takes `part` for changed.
    pub(crate) fn invalidate(&mut self, part: Part) {
        match part {
            Part::Mesh | Part::Points => (self.grid, self.values, self.function) = (None, None, None),
            Part::Field => (self.values, self.function) = (None, None),
            Part::Function => self.function = None,
        }
    }

    /// Draws a frame on the current rayon pool; nothing if it is none for f32. What the device leaves unfinished, the CPU
    /// draws.
    ///
    /// # Errors
    /// Those of [`Gpu::check`] and [`Buffer::new`]; [`Error::Aborted`] if progress wanted no more.
    pub(crate) fn draw(&mut self, gpu: &Gpu, frame: &Frame) -> Result<Option<CastFrame>> {
        let Some(mut drawn) = self.on_device(gpu, frame)? else { return Ok(None) };
        let unfinished = drawn.pixels.par_iter().enumerate().filter(|(_, p)| p[3] == UNFINISHED);
        let unfinished: Vec<usize> = unfinished.map(|(i, _)| i).collect();
        drawn.by_cpu = unfinished.len() as u64;
        if unfinished.len() * FEW > drawn.pixels.len() {
            drawn.pixels = ray::render(frame).0;
            return Ok(Some(drawn));
        }
        if frame.view.blend() == Blend::Maximum {
            let color = |p: &[f32; 4]| match self.largest(frame.samples, p) {
                Some(values) => (frame.pixel)(&values[..frame.samples.components]),
                None => [0.0; 4],
            };
            drawn.pixels.par_iter_mut().for_each(|p| *p = color(p));
        }
        let by_cpu = ray::render_pixels(frame, &unfinished);
        unfinished.iter().zip(by_cpu).for_each(|(&i, p)| drawn.pixels[i] = p);
        Ok(Some(drawn))
    }

    /// What the device draws of a frame; nothing if it is none for f32.
    fn on_device(&mut self, gpu: &Gpu, frame: &Frame) -> Result<Option<CastFrame>> {
        if !self.upload(gpu, frame)? {
            return Ok(None);
        }
        let blend = frame.view.blend();
        let (Some(grid), Some(values), Some(function)) = (&self.grid, &self.values, &self.function) else {
            return Ok(None);
        };
        let chunks = chunks(grid, &values.0, function, blend);
        let arrays = arrays::named(ARRAYS, chunks);
        let source = program(frame, function.are_curved, &arrays);
        if self.program.as_ref().is_none_or(|p| p.source != source) {
            use Slot::{Read, Uniform, Write};
            let own = [Uniform, Read, Read, Uniform, Read, Read, Write, Write];
            let shared = vec![Read; arrays.iter().map(|a| a.chunks).sum()];
            let layouts = [&own[..], &shared].map(|slots| raster::layout(gpu, Stages::COMPUTE, slots));
            let module = raster::module(gpu, "cast", &source);
            let layout = raster::pipeline_layout(gpu, &layouts.each_ref().map(Some));
            let pipeline = raster::compute(gpu, &module, "main", &layout);
            gpu.check()?;
            self.program = Some(Program { source, pipeline, layouts });
        }
        let Some(program) = &self.program else { return Ok(None) };
        cast(gpu, frame, values, function, program, chunks).map(Some)
    }

    /// Hands over what the device does not hold yet; false if it is none for f32.
    fn upload(&mut self, gpu: &Gpu, frame: &Frame) -> Result<bool> {
        let Frame { volume, samples, exact, .. } = *frame;
        let fits = samples.values.len() <= u32::MAX as usize && volume.cell_count() <= u32::MAX as usize;
        if !fits || fineness(volume) > FINEST {
            return Ok(false);
        }
        if self.grid.is_none() {
            let axes = planes_of(volume);
            let hidden = volume.hidden.as_deref().unwrap_or_default();
            let word = |i: usize| (hidden[i / 2] >> (32 * (i % 2))) as u32;
            self.grid = Some([
                Chunks::new(gpu, "axes", &axes, |p| *p)?,
                Chunks::generated(gpu, "hidden", 2 * hidden.len(), word)?,
            ]);
        }
        let texel = Texel::of(&samples.values);
        if self.function.is_none() {
            let Some(lines) = Lines::new(exact, &samples.normal, texel.is_plain()) else { return Ok(false) };
            let maps = lines.maps(samples.components, &samples.normal);
            if !maps[..samples.components].iter().all(Map::is_in_reach) && texel.is_plain() {
                return Ok(false);
            }
            let visible = Visible::new(exact, samples.components);
            let shown = samples.seen(|low, high| visible.shows(exact.opacity.intervals(low, high)));
            let held = samples.seen(|_, _| true);
            let bits = |seen: &[bool]| {
                let word =
                    |w: usize| (0..32).fold(0, |word, k| word | u32::from(seen.get(32 * w + k) == Some(&true)) << k);
                Chunks::generated(gpu, "seen", seen.len().div_ceil(32), word)
            };
            self.function = Some(HeldFunction {
                buffers: lines.upload(gpu)?,
                are_curved: lines.are_curved,
                maps,
                seen: [bits(&shown)?, bits(&held)?],
                skips: [shown.contains(&false), held.contains(&false)],
            });
        }
        let Some(function) = &self.function else { return Ok(false) };
        let is_worse = |held: &[Map; 4]| {
            let own = |k: usize| held[k].then(&function.maps[k]);
            let worst = (0..samples.components).map(|k| 1.0 + (own(k).mid * own(k).factor).abs()).fold(0.0, f64::max);
            !texel.is_plain() && worst > WORSE
        };
        if self.values.as_ref().is_none_or(|(_, held)| is_worse(held)) {
            self.values = None;
            let words = texels::upload(gpu, &samples.values, samples.components, &function.maps)?;
            self.values = Some((words, function.maps));
        }
        Ok(true)
    }

    /// The largest values along the ray of a pixel drawn with [`Blend::Maximum`], as the field maps them; none if it met
    /// nothing.
    fn largest(&self, samples: &Samples, pixel: &[f32; 4]) -> Option<[f64; 4]> {
        let maps = &self.function.as_ref().filter(|_| pixel[3] > -FAR)?.maps;
        // The first values come first, the last one last.
        let value = |k: usize| {
            let own = pixel[if k + 1 == samples.components { 3 } else { k }];
            let [times, plus] = maps[k].back(samples.normal[k]);
            f64::from(own) * times + plus
        };
        Some([0, 1, 2, 3].map(|k| if k < samples.components { value(k) } else { 0.0 }))
    }

    /// Bindings of the arrays.
    #[cfg(test)]
    fn bindings(&self) -> Vec<usize> {
        match (&self.grid, &self.values, &self.function) {
            (Some(grid), Some((words, _)), Some(function)) => {
                chunks(grid, words, function, Blend::Composite).map(|c| c.buffers.len()).to_vec()
            }
            _ => vec![],
        }
    }
}

/// The arrays of group 1, in the order of [`ARRAYS`].
fn chunks<'a>(grid: &'a [Chunks; 2], words: &'a Chunks, function: &'a HeldFunction, blend: Blend) -> [&'a Chunks; 4] {
    let [axes, hidden] = grid;
    [words, axes, hidden, &function.seen[usize::from(blend == Blend::Maximum)]]
}

/// Draws what the device can of a frame; pixels of [`Blend::Maximum`] are as [`Caster::largest`] reads them.
fn cast(
    gpu: &Gpu,
    frame: &Frame,
    (_, held): &(Chunks, [Map; 4]),
    function: &HeldFunction,
    program: &Program,
    chunks: [&Chunks; 4],
) -> Result<CastFrame> {
    let Frame { volume, samples, view, reconstruction, .. } = *frame;
    let texel = Texel::of(&samples.values);
    let maps = [0, 1, 2, 3].map(|k| if texel.is_plain() { function.maps[k] } else { held[k].then(&function.maps[k]) });
    let (mut uniforms, planes, ends) = frame::uniforms(volume, view, samples.of_cells, &maps);
    uniforms.most_work = if gpu.adapter.is_software() { LLVMPIPE_WORK } else { u32::MAX };
    uniforms.skips = u32::from(function.skips[usize::from(view.blend() == Blend::Maximum)]);
    let missing = |v: f64| function.maps[0].apply(samples.normal[0].invert(v)) as f32;
    uniforms.missing = samples.missing.map_or(INVISIBLE, missing);
    if let Sampling::Steps(step) = reconstruction.sampling {
        uniforms.pace = (step * volume.scale) as f32;
    }
    let bands = Bands::new::<CastUniforms>(gpu, view.size(), RAYS, &planes, &ends)?;
    let [parameters, lines, buckets] = &function.buffers;
    let own = [parameters, lines, buckets].into_iter().chain(bands.bindings());
    let own = raster::group_of(gpu, &program.layouts[0], own);
    let shared = raster::group_of(gpu, &program.layouts[1], chunks.into_iter().flat_map(|c| &c.buffers));
    let mut steps = 0;
    let band = |first_row, rows| {
        (uniforms.first_row, uniforms.rows) = (first_row, rows);
        uniforms
    };
    let count = |[low, carry, _, _]: [u32; 4]| steps += u64::from(carry) << 32 | u64::from(low);
    let Drawn { pixels, device_ms } = bands.draw(&program.pipeline, &[&own, &shared], band, count, frame.progress)?;
    Ok(CastFrame { pixels, steps, by_cpu: 0, device_ms })
}

/// The whole program.
fn program(frame: &Frame, are_curved: bool, arrays: &[ShaderArray]) -> String {
    let Frame { volume, samples, exact, reconstruction, .. } = *frame;
    let Reconstruction { order, sampling } = reconstruction;
    let mut text = stretch::prelude(&StretchVariant {
        kind: exact.kind,
        direct: exact.direct,
        are_curved,
        is_maximum: frame.view.blend() == Blend::Maximum,
        has_means: false,
        least: least_light(exact.direct) as f32,
    });
    let _ = writeln!(text, "const UNFINISHED = {UNFINISHED:?}f;\nconst SNAP = {SNAP:?}f;");
    let number = |of: ReconstructionOrder| ReconstructionOrder::ALL.iter().position(|(_, o)| *o == of).unwrap_or(0);
    for (name, of) in [
        ("EXACT", ReconstructionOrder::Exact),
        ("TWO", ReconstructionOrder::Two),
        ("ONE", ReconstructionOrder::One),
        ("MIDPOINT", ReconstructionOrder::Midpoint),
        ("LEFT", ReconstructionOrder::Left),
        ("RIGHT", ReconstructionOrder::Right),
        ("ORDER", order),
    ] {
        let _ = writeln!(text, "const {name} = {}u;", number(of));
    }
    let by_length = order != ReconstructionOrder::Exact && matches!(sampling, Sampling::Steps(_));
    for (name, value) in [
        ("EVEN", volume.even),
        ("HIDES", volume.hidden.is_some()),
        ("OF_CELLS", samples.of_cells),
        ("STEPPED", by_length),
    ] {
        let _ = writeln!(text, "const {name} = {value};");
    }
    let _ = writeln!(text, "const BLOCK = {}u;\nconst PARTS = {}u;", 1 << BLOCK, order.parts());
    text += &Texel::of(&samples.values).accessor();
    text += &shader::accessors(arrays);
    [&text, shader::CELL, shader::REAL, stretch::STRETCH, CAST].join("\n")
}

#[cfg(test)]
mod tests;
