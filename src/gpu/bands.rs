//! A picture drawn in bands of rows, a compute pass each: a driver ends work that takes seconds.

use super::Gpu;
use super::buffers::Buffer;
use super::clock::Clock;
use super::raster::Readback;
use crate::error::{Error, Result};
use bytemuck::Pod;
use std::ops::ControlFlow;
use wgpu::BufferUsages as Usage;

/// What passes read of a view and where they write, besides what they read of a scene.
pub(crate) struct Bands<'a> {
    gpu: &'a Gpu,
    size: [u32; 2],
    /// Rows of a band.
    rows: u32,
    uniforms: Buffer,
    planes: Buffer,
    ends: Buffer,
    pixels: Buffer,
    counts: Buffer,
    readback: Readback,
    clock: Option<Clock>,
}

/// A picture.
pub(crate) struct Drawn {
    /// A row after the other.
    pub(crate) pixels: Vec<[f32; 4]>,
    /// What the device itself says that it took, in ms.
    pub(crate) device_ms: Option<f64>,
}

impl<'a> Bands<'a> {
    /// For pictures of a size, in bands of at most `rays` pixels, whose uniforms are `U`s; see [`super::rays`] for the others.
    pub(crate) fn new<U: Pod>(
        gpu: &'a Gpu,
        size: [u32; 2],
        rays: u64,
        planes: &[[f32; 4]],
        ends: &[f32],
    ) -> Result<Self> {
        let [w, h] = size;
        let rows = (rays / u64::from(w)).clamp(1, u64::from(h)) as u32;
        let bytes = u64::from(w) * u64::from(rows) * 16;
        Ok(Bands {
            gpu,
            size,
            rows,
            uniforms: Buffer::new(gpu, "frame", size_of::<U>() as u64, Usage::UNIFORM | Usage::COPY_DST)?,
            planes: Buffer::holding(gpu, "planes", planes, Usage::STORAGE)?,
            ends: Buffer::holding(gpu, "ends", ends, Usage::STORAGE)?,
            pixels: Buffer::new(gpu, "pixels", bytes, Usage::STORAGE | Usage::COPY_SRC)?,
            counts: Buffer::new(gpu, "counts", 16, Usage::STORAGE | Usage::COPY_SRC | Usage::COPY_DST)?,
            readback: Readback::new(gpu, bytes + 32)?,
            clock: Clock::of_one_pass(gpu)?,
        })
    }

    /// Bindings of a program's first group: uniforms, planes, ends, pixels, counts.
    pub(crate) fn bindings(&self) -> [&Buffer; 5] {
        [&self.uniforms, &self.planes, &self.ends, &self.pixels, &self.counts]
    }

    /// Draws all bands; `uniforms` are those of a band by its first row and their number, `count` gets what was counted in
    /// each, `progress` the share that is done.
    ///
    /// # Errors
    ///
    /// [`Error::Aborted`] if `progress` breaks off; [`Error::Render`] if the device fails.
    pub(crate) fn draw<U: Pod>(
        &self,
        pipeline: &wgpu::ComputePipeline,
        groups: &[&wgpu::BindGroup],
        mut uniforms: impl FnMut(u32, u32) -> U,
        mut count: impl FnMut([u32; 4]),
        progress: &dyn Fn(f64) -> ControlFlow<()>,
    ) -> Result<Drawn> {
        let (gpu, [w, h]) = (self.gpu, self.size);
        let bytes = self.pixels.raw.size();
        let mut drawn = Drawn { pixels: Vec::with_capacity(w as usize * h as usize), device_ms: None };
        for first_row in (0..h).step_by(self.rows as usize) {
            let rows = self.rows.min(h - first_row);
            self.uniforms.write(gpu, 0, bytemuck::bytes_of(&uniforms(first_row, rows)));
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.clear_buffer(&self.counts.raw, 0, None);
            {
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                    label: Some("band"),
                    timestamp_writes: self.clock.as_ref().and_then(|c| c.compute(0)),
                });
                pass.set_pipeline(pipeline);
                for (i, group) in groups.iter().enumerate() {
                    pass.set_bind_group(i as u32, *group, &[]);
                }
                pass.dispatch_workgroups(w.div_ceil(8), rows.div_ceil(8), 1);
            }
            encoder.copy_buffer_to_buffer(&self.pixels.raw, 0, self.readback.raw(), 0, bytes);
            encoder.copy_buffer_to_buffer(&self.counts.raw, 0, self.readback.raw(), bytes, 16);
            if let Some(clock) = &self.clock {
                clock.resolve_one_pass(&mut encoder, self.readback.raw(), bytes + 16);
            }
            self.readback.submit(gpu, encoder, |read| {
                let (image, rest) = read.split_at(bytes as usize);
                drawn.pixels.extend_from_slice(&bytemuck::cast_slice(image)[..w as usize * rows as usize]);
                count(bytemuck::pod_read_unaligned(&rest[..16]));
                if self.clock.is_some() {
                    let [start, end]: [u64; 2] = bytemuck::pod_read_unaligned(&rest[16..32]);
                    let ms = end.saturating_sub(start) as f64 * f64::from(gpu.queue.get_timestamp_period()) / 1e6;
                    drawn.device_ms = Some(drawn.device_ms.unwrap_or(0.0) + ms);
                }
            })?;
            if progress(f64::from(first_row + rows) / f64::from(h)).is_break() {
                return Err(Error::Aborted);
            }
        }
        Ok(drawn)
    }
}
