//! Second-order tables, built on a device layer by layer: the published one in K steps, and that of all lengths by the integral of
//! stretches.

use super::Constructor;
use crate::error::Result;
use crate::field::{Kind, Normalization};
use crate::gpu::buffers::Buffer;
use crate::gpu::lines::Lines;
use crate::gpu::raster::{self, Readback, Slot};
use crate::gpu::shader;
use crate::gpu::stretch::{self, StretchVariant};
use crate::integral::table::{
    MOST_OF_ALL_LENGTHS, MOST_OF_ONE_LENGTH, SecondOrder, SecondOrderPolynomial, Slabs, Slices, Storage, inverse,
    samples, span,
};
use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;
use std::time::Instant;
use wgpu::{BufferUsages as Usage, ShaderStages as Stages};

const SECOND_ORDER: &str = include_str!("../../../shaders/second_order.wgsl");
const PARABOLAS: &str = include_str!("../../../shaders/parabolas.wgsl");

/// Texels of one dispatch at most where each is several integrals.
const MOST_PARABOLAS: u64 = 1 << 20;

/// Tables are over normalised values.
const SAME: [Normalization; 4] = [Normalization { mid: 0.0, half: 1.0 }; 4];

/// Texels of one dispatch at most, times steps: a driver ends work that takes seconds.
const MOST: u64 = 1 << 31;

/// `SlabJob` in the shader.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct SlabJob {
    size: u32,
    first: u32,
    layers: u32,
    iterations: u32,
    between: u32,
    before: u32,
    entries: u32,
    span: f32,
}

/// `ParabolaJob` in the shader.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct ParabolaJob {
    size: u32,
    first: u32,
    layers: u32,
    degree: u32,
    longest: f32,
    mid: f32,
    factor: f32,
    unused: u32,
    weights: [[f32; 8]; 5],
}

/// The program of tables for all lengths.
fn source_of_parabolas(direct: bool, are_curved: bool) -> String {
    let variant = StretchVariant {
        kind: Kind::Scalar,
        direct,
        are_curved,
        is_maximum: false,
        has_means: true,
        least: f32::MIN_POSITIVE,
    };
    [&stretch::prelude(&variant), shader::REAL, stretch::STRETCH, PARABOLAS].join("\n")
}

/// The program: texels are floats or bytes.
fn source(bytes: bool) -> String {
    let stored = if bytes {
        "alias Texel = u32;
fn stored(t: vec4f) -> Texel {
    let b = min(vec4u(t * vec4f(vec3f(255.0 / job.span), 255.0) + 0.5), vec4u(255u));
    return b.x | b.y << 8u | b.z << 16u | b.w << 24u;
}
"
    } else {
        "alias Texel = vec4f;
fn stored(t: vec4f) -> Texel { return t; }
"
    };
    [stored, SECOND_ORDER].join("\n")
}

impl Constructor {
    /// The published table of slabs of one `length`, with so many texels along each axis, summed in so many `iterations`, of
    /// floats or in `bytes`; and the milliseconds that the device took, without the way back. `None` as
    /// [`SecondOrder::published`].
    ///
    /// # Errors
    /// [`crate::Error::Memory`] if the device has no room, and those of a device that fails.
    pub fn second_order(
        &self,
        size: u32,
        length: f64,
        iterations: u32,
        bytes: bool,
    ) -> Result<Option<(SecondOrder, f64)>> {
        if !(2..=MOST_OF_ONE_LENGTH).contains(&size) || iterations == 0 {
            return Ok(None);
        }
        let (gpu, layer) = (&self.gpu, u64::from(size).pow(2));
        let each = if bytes { 4 } else { 16 };
        let fits = (gpu.binding / (layer * each)).min(MOST / (layer * u64::from(iterations))).max(1);
        let layers = fits.min(u64::from(size)) as u32;
        let module = raster::module(gpu, "second order", &source(bytes));
        let layout = raster::layout(gpu, Stages::COMPUTE, &[Slot::Uniform, Slot::Read, Slot::Write]);
        let pipeline = raster::compute(gpu, &module, "main", &raster::pipeline_layout(gpu, &[Some(&layout)]));
        gpu.check()?;

        let start = Instant::now();
        let slices = Slices::new(&self.exact, size, length, iterations);
        let (entries, per_unit) = slices.entries();
        let between = (2.0 * per_unit / (size - 1) as f32).round() as u32;
        let span = span(&self.exact, length);
        // From the least value that parabolas reach to −1.
        let before = (entries.len() as u32 - 1 - between * (size - 1)) / 2;
        let job = SlabJob { size, first: 0, layers, iterations, between, before, entries: entries.len() as u32, span };
        let entries = Buffer::holding(gpu, "entries", entries, Usage::STORAGE)?;
        let room = layer * u64::from(layers) * each;
        let texels = Buffer::new(gpu, "texels", room, Usage::STORAGE | Usage::COPY_SRC)?;
        let mut ms = start.elapsed().as_secs_f64() * 1e3;

        let back = Readback::new(gpu, room)?;
        let count = layer as usize * size as usize;
        let mut made = match bytes {
            false => Slabs::Float(Storage::zeroed(count)),
            true => Slabs::Bytes { texels: vec![[0; 4]; count], span },
        };
        for first in (0..size).step_by(layers as usize) {
            let own = layers.min(size - first);
            let start = Instant::now();
            let job = Buffer::holding(gpu, "job", &[SlabJob { first, layers: own, ..job }], Usage::UNIFORM)?;
            let group = raster::group_of(gpu, &layout, [&job, &entries, &texels]);
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            {
                let mut pass = encoder.begin_compute_pass(&Default::default());
                pass.set_pipeline(&pipeline);
                pass.set_bind_group(0, &group, &[]);
                pass.dispatch_workgroups(size.div_ceil(64), size, own);
            }
            gpu.queue.submit([encoder.finish()]);
            gpu.wait()?;
            ms += start.elapsed().as_secs_f64() * 1e3;
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            encoder.copy_buffer_to_buffer(&texels.raw, 0, back.raw(), 0, layer * u64::from(own) * each);
            let places = layer as usize * first as usize..layer as usize * (first + own) as usize;
            back.submit(gpu, encoder, |read| {
                let read = &read[..places.len() * each as usize];
                match &mut made {
                    Slabs::Float(texels) => texels[places].copy_from_slice(bytemuck::cast_slice(read)),
                    Slabs::Bytes { texels, .. } => texels[places].copy_from_slice(bytemuck::cast_slice(read)),
                }
            })?;
        }
        Ok(Some((SecondOrder { size, length, iterations: Some(iterations), texels: made }, ms)))
    }

    /// The table of all lengths up to `longest`, and the milliseconds that the device took, without the way back. Texels of
    /// which f32 could not say on which side of a step they are come from the CPU. `None` as [`SecondOrderPolynomial::new`],
    /// and for functions that f32 does not hold.
    ///
    /// # Errors
    /// As [`Self::second_order`].
    pub fn second_order_polynomial(
        &self,
        degree: u32,
        size: u32,
        longest: f64,
    ) -> Result<Option<(SecondOrderPolynomial, f64)>> {
        if !(2..=MOST_OF_ALL_LENGTHS).contains(&size) || !(1..=4).contains(&degree) {
            return Ok(None);
        }
        let (gpu, exact, layer) = (&self.gpu, &self.exact, u64::from(size).pow(2));
        let Some(lines) = Lines::new(exact, &SAME, false) else { return Ok(None) };
        let map = lines.maps(1, &SAME)[0];
        let powers = u64::from(degree + 1);
        let fits = (gpu.binding / (layer * 16 * powers)).min(MOST_PARABOLAS / layer).max(1);
        let layers = fits.min(u64::from(size)) as u32;
        let module = raster::module(gpu, "parabolas", &source_of_parabolas(exact.direct, lines.are_curved));
        let slots = [&[Slot::Uniform, Slot::Read, Slot::Read][..], &[Slot::Uniform, Slot::Write]];
        let layouts = slots.map(|slots| raster::layout(gpu, Stages::COMPUTE, slots));
        let layout = raster::pipeline_layout(gpu, &layouts.each_ref().map(Some));
        let pipeline = raster::compute(gpu, &module, "main", &layout);
        gpu.check()?;

        let start = Instant::now();
        let points = inverse(degree as usize);
        let mut job = ParabolaJob { size, layers, degree, longest: longest as f32, ..ParabolaJob::zeroed() };
        (job.mid, job.factor) = (map.mid as f32, map.factor as f32);
        for (row, of) in job.weights.iter_mut().zip(&points) {
            row.iter_mut().zip(of).for_each(|(w, of)| *w = *of as f32);
        }
        let room = layer * u64::from(layers) * powers * 16;
        let texels = Buffer::new(gpu, "texels", room, Usage::STORAGE | Usage::COPY_SRC)?;
        let function = lines.upload(gpu)?;
        let function = raster::group_of(gpu, &layouts[0], &function);
        let mut ms = start.elapsed().as_secs_f64() * 1e3;

        let back = Readback::new(gpu, room)?;
        let count = layer as usize * size as usize;
        let mut made: Vec<Storage> = (0..powers).map(|_| Storage::zeroed(count)).collect();
        for first in (0..size).step_by(layers as usize) {
            let own = layers.min(size - first);
            let start = Instant::now();
            let job = Buffer::holding(gpu, "job", &[ParabolaJob { first, layers: own, ..job }], Usage::UNIFORM)?;
            let group = raster::group_of(gpu, &layouts[1], [&job, &texels]);
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            {
                let mut pass = encoder.begin_compute_pass(&Default::default());
                pass.set_pipeline(&pipeline);
                pass.set_bind_group(0, &function, &[]);
                pass.set_bind_group(1, &group, &[]);
                pass.dispatch_workgroups(size.div_ceil(64), size, own);
            }
            gpu.queue.submit([encoder.finish()]);
            gpu.wait()?;
            ms += start.elapsed().as_secs_f64() * 1e3;
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            encoder.copy_buffer_to_buffer(&texels.raw, 0, back.raw(), 0, layer * u64::from(own) * powers * 16);
            let place = layer as usize * first as usize;
            let length = layer as usize * own as usize;
            back.submit(gpu, encoder, |read| {
                let read: &[[f32; 4]] = bytemuck::cast_slice(read);
                for (of, read) in made.iter_mut().zip(read.chunks_exact(length)) {
                    of[place..place + length].copy_from_slice(read);
                }
            })?;
        }
        let start = Instant::now();
        let doubtful: Vec<usize> = made[0].par_iter().enumerate().filter(|(_, t)| t[3] < 0.0).map(|(i, _)| i).collect();
        let by_cpu: Vec<[[f32; 4]; 5]> = doubtful
            .par_iter()
            .map(|&i| SecondOrderPolynomial::texel(exact, &points, samples(i, size), longest))
            .collect();
        for (&i, texel) in doubtful.iter().zip(&by_cpu) {
            made.iter_mut().zip(texel).for_each(|(of, texel)| of[i] = *texel);
        }
        ms += start.elapsed().as_secs_f64() * 1e3;
        Ok(Some((SecondOrderPolynomial { degree, size, longest, direct: exact.direct, texels: made }, ms)))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;
    use crate::gpu::testing;
    use crate::integral::table::tests::transfers;

    #[test]
    fn slab_programs_are_valid() {
        for flag in [false, true] {
            testing::validated(&source(flag));
            testing::validated(&source_of_parabolas(flag, false));
            testing::validated(&source_of_parabolas(flag, true));
        }
    }

    /// Texels of the device are the CPU's, but for some of which a value is as near to one entry as to the next.
    #[test]
    fn second_order_tables_are_those_of_the_cpu() {
        let Some(choice) = testing::choice() else { return };
        for (name, transfer) in transfers(77) {
            let device = Constructor::open(&choice, &transfer, &SAME, 1.0).unwrap().unwrap();
            for (size, iterations, bytes, near) in [(9, 8, false, 1e-6), (40, 64, false, 1e-6), (33, 7, true, 0.01)] {
                let (got, ms) = device.second_order(size, 0.3, iterations, bytes).unwrap().unwrap();
                let build = if bytes { SecondOrder::published_in_bytes } else { SecondOrder::published };
                let want = build(&device.exact, size, 0.3, iterations).unwrap();
                let slices = Slices::new(&device.exact, size, 0.3, iterations);
                let apart = |a: [f32; 4], b: [f32; 4]| (0..4).map(|k| (a[k] - b[k]).abs()).fold(0.0, f32::max);
                // What one step of the sum is off by if it takes the entry beside.
                let beside = slices.entries().0.windows(2).map(|w| apart(w[0], w[1])).fold(0.0, f32::max);
                let count = size.pow(3) as usize;
                let off: Vec<f32> = (0..count).map(|i| apart(got.texels.get(i), want.texels.get(i))).collect();
                let far = off.iter().filter(|off| **off > near).count();
                let most = off.iter().fold(0.0, |most: f32, off| most.max(*off));
                assert!(far * 100 <= count, "{name}, {size}, {iterations}: {far} of {count} texels differ");
                assert!(most <= near + 0.25 * iterations as f32 * beside, "{name}, {size}, {iterations}: {most}");
                assert!(ms > 0.0 && got.bytes() == want.bytes());
            }
            assert!(device.second_order(1, 0.3, 8, false).unwrap().is_none());
        }
    }

    #[test]
    fn tables_of_all_lengths_are_those_of_the_cpu() {
        let Some(choice) = testing::choice() else { return };
        for (name, transfer) in transfers(77) {
            let device = Constructor::open(&choice, &transfer, &SAME, 1.0).unwrap().unwrap();
            for degree in [1, 2, 4] {
                let (got, ms) = device.second_order_polynomial(degree, 12, 0.4).unwrap().unwrap();
                let want = SecondOrderPolynomial::new(&device.exact, degree, 12, 0.4).unwrap();
                // Slabs that are texels: what lies between is the same filter.
                for i in 0..12_usize.pow(3) {
                    let slab = samples(i, 12);
                    for l in [0.01, 0.2, 0.37] {
                        let (got, want) = (got.look_up(slab, l), want.look_up(slab, l));
                        let off = (0..4).map(|k| (got[k] - want[k]).abs()).fold(0.0, f64::max);
                        assert!(off < 2e-5, "{name}, degree {degree}, {slab:?}, {l}: {got:?}, not {want:?}");
                    }
                }
                assert!(ms > 0.0);
            }
            assert!(device.second_order_polynomial(5, 12, 0.4).unwrap().is_none());
        }
    }
}
