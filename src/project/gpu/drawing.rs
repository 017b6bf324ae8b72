//! Projecting and drawing the batches of a frame.

use super::primitive::Layout;
use super::{BATCH, Pass, Project, Slice, groups_of, unprepared};
use crate::error::Result;
use crate::gpu::buffers::Buffer;
use crate::gpu::clock::{CLOCKS, Clock};
use crate::gpu::raster::{self, Readback, Texture};
use crate::gpu::rays::FAR;
use crate::project::ProjectionCounts;
use crate::view::View;
use wgpu::{BufferUsages as Usage, TextureUsages};

/// Batches that are handed over at once: a driver ends work that takes seconds.
const AT_ONCE: usize = 8;

/// What a frame's batches are drawn with and into.
pub(super) struct Canvas {
    layout: Layout,
    size: [u32; 2],
    format: wgpu::TextureFormat,
    primitives: Buffer,
    indices: Buffer,
    picture: Texture,
    /// Where the greatest of something is kept, how great that is.
    depth: Option<Texture>,
    back: Readback,
}

impl Project {
    pub(super) fn prepare_canvas(
        &mut self,
        layout: &Layout,
        size: [u32; 2],
        format: wgpu::TextureFormat,
        keeps_greatest: bool,
    ) -> Result<()> {
        let is_same =
            |c: &Canvas| (&c.layout, c.size, c.format, c.depth.is_some()) == (layout, size, format, keeps_greatest);
        if self.canvas.as_ref().is_some_and(is_same) {
            return Ok(());
        }
        self.canvas = None;
        let gpu = &self.gpu;
        let Layout { triangles, parts, .. } = *layout;
        let all: Vec<u32> = (0..BATCH as u32).flat_map(|r| triangles.iter().map(move |c| r * parts + c)).collect();
        let [w, h] = size;
        let texture =
            |name, format, usage| Texture::new(gpu, name, wgpu::TextureDimension::D2, [w, h, 1], format, usage);
        let canvas = Canvas {
            // One more, as the last one's vertices look for attributes beyond it.
            primitives: Buffer::new(
                gpu,
                "primitives",
                layout.bytes() * (BATCH as u64 + 1),
                Usage::STORAGE | Usage::VERTEX,
            )?,
            indices: Buffer::holding(gpu, "indices", &all, Usage::INDEX)?,
            picture: texture("picture", format, TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC)?,
            depth: keeps_greatest
                .then(|| texture("depth", raster::DEPTH, TextureUsages::RENDER_ATTACHMENT))
                .transpose()?,
            back: Readback::new(gpu, u64::from(row_bytes(w, format)) * u64::from(h) + 16 * u64::from(CLOCKS))?,
            layout: layout.clone(),
            size,
            format,
        };
        self.canvas = Some(canvas);
        Ok(())
    }

    /// Projects and draws all batches.
    pub(super) fn draw(&self, frame: &Pass, view: &View, counts: &mut ProjectionCounts) -> Result<Vec<[f32; 4]>> {
        let gpu = &self.gpu;
        let (Some(program), Some(canvas), Some(ordered)) = (self.programs.first(), &self.canvas, &self.ordered) else {
            return Err(unprepared());
        };
        let format = canvas.format;
        counts.cells = ordered.cells as u64;
        // Each batch's slice at its own offset, as uniforms are aligned.
        let step = gpu.device.limits().min_uniform_buffer_offset_alignment.max(size_of::<Slice>() as u32) as usize;
        let firsts: Vec<usize> = (0..ordered.entries).step_by(BATCH).collect();
        let mut slices = vec![0u8; step * firsts.len().max(1)];
        for (i, &first) in firsts.iter().enumerate() {
            let count = (ordered.entries - first).min(BATCH);
            let within = first % ordered.chunk;
            let slice =
                Slice { first: within as u32, count: count as u32, row: groups_of(count).0, rank: first as u32 };
            slices[step * i..][..size_of::<Slice>()].copy_from_slice(bytemuck::bytes_of(&slice));
        }
        let slices = Buffer::holding(gpu, "slices", &slices, Usage::UNIFORM)?;
        let none = Buffer::new(gpu, "none", 16, Usage::STORAGE)?;
        let clock = Clock::new(gpu)?;

        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        self.clear(&mut encoder, canvas);
        for (i, &first) in firsts.iter().enumerate() {
            let count = (ordered.entries - first).min(BATCH);
            let slice = wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                buffer: &slices.raw,
                offset: (step * i) as u64,
                size: std::num::NonZeroU64::new(size_of::<Slice>() as u64),
            });
            let order = &ordered.chunks[first / ordered.chunk];
            let own = self.own_group(frame, slice, &none, order, canvas.primitives.raw.as_entire_binding());
            {
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                    label: Some("project"),
                    timestamp_writes: clock.as_ref().and_then(|c| c.compute(i)),
                });
                let groups = groups_of(count).1;
                pass.set_pipeline(&program.project);
                pass.set_bind_group(0, &frame.shared, &[]);
                pass.set_bind_group(1, &frame.arrays, &[]);
                pass.set_bind_group(2, &own, &[]);
                pass.dispatch_workgroups(groups[0], groups[1], 1);
            }
            {
                let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                    label: Some("draw"),
                    color_attachments: &[Some(attachment(&canvas.picture, wgpu::LoadOp::Load))],
                    depth_stencil_attachment: canvas.depth.as_ref().map(|d| depth(d, wgpu::LoadOp::Load)),
                    timestamp_writes: clock.as_ref().and_then(|c| c.render(i)),
                    ..Default::default()
                });
                pass.set_pipeline(&program.draw);
                pass.set_bind_group(0, &frame.shared, &[]);
                if let Some(second) = &frame.second {
                    pass.set_bind_group(1, second, &[]);
                }
                for part in 0..program.layout.parts {
                    let from = u64::from(part) * program.layout.part_bytes();
                    pass.set_vertex_buffer(part, canvas.primitives.raw.slice(from..));
                }
                pass.set_index_buffer(canvas.indices.raw.slice(..), wgpu::IndexFormat::Uint32);
                let counter = clock.as_ref().and_then(|c| c.fragments.as_ref()).filter(|_| i < CLOCKS as usize / 4);
                if let Some(counter) = counter {
                    pass.begin_pipeline_statistics_query(counter, i as u32);
                }
                pass.draw_indexed(0..(count * program.layout.triangles.len()) as u32, 0, 0..1);
                if counter.is_some() {
                    pass.end_pipeline_statistics_query();
                }
            }
            if (i + 1) % AT_ONCE == 0 {
                gpu.queue.submit([encoder.finish()]);
                encoder = gpu.device.create_command_encoder(&Default::default());
            }
        }
        let [w, h] = view.size();
        let row = row_bytes(w, format);
        let picture_bytes = u64::from(row) * u64::from(h);
        encoder.copy_texture_to_buffer(
            canvas.picture.raw.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: canvas.back.raw(),
                layout: wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None },
            },
            wgpu::Extent3d { width: w, height: h, depth_or_array_layers: 1 },
        );
        let measured = firsts.len().min(CLOCKS as usize / 4);
        if let Some(clock) = clock.as_ref().filter(|_| measured > 0) {
            clock.resolve(&mut encoder, canvas.back.raw(), picture_bytes, measured);
        }
        canvas.back.submit(gpu, encoder, |bytes| {
            let (picture, times) = bytes.split_at(picture_bytes as usize);
            if clock.is_some() && measured == firsts.len() {
                let (times, fragments): (&[u64], &[u64]) = bytemuck::cast_slice(times).split_at(CLOCKS as usize);
                let times = &times[..4 * measured];
                let counted = clock.as_ref().is_some_and(|c| c.fragments.is_some());
                counts.fragments = counted.then(|| fragments[..measured].iter().sum());
                let period = f64::from(gpu.queue.get_timestamp_period()) / 1e6;
                let sum =
                    |at: usize| times.chunks(4).map(|t| t[at + 1].saturating_sub(t[at])).sum::<u64>() as f64 * period;
                (counts.project_ms, counts.draw_ms) = (Some(sum(0)), Some(sum(2)));
            }
            picture.chunks(row as usize).flat_map(|line| pixels(&line[..w as usize * texel(format)], format)).collect()
        })
    }

    fn clear(&self, encoder: &mut wgpu::CommandEncoder, canvas: &Canvas) {
        // A ray that meets nothing has no largest value.
        let none = f64::from(if canvas.depth.is_some() { -FAR } else { 0.0 });
        let clear = wgpu::LoadOp::Clear(wgpu::Color { r: none, g: none, b: none, a: none });
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("clear"),
            color_attachments: &[Some(attachment(&canvas.picture, clear))],
            depth_stencil_attachment: canvas.depth.as_ref().map(|d| depth(d, wgpu::LoadOp::Clear(0.0))),
            ..Default::default()
        });
    }
}

fn attachment(texture: &Texture, load: wgpu::LoadOp<wgpu::Color>) -> wgpu::RenderPassColorAttachment<'_> {
    wgpu::RenderPassColorAttachment {
        view: &texture.view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
    }
}

fn depth(texture: &Texture, load: wgpu::LoadOp<f32>) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment {
        view: &texture.view,
        depth_ops: Some(wgpu::Operations { load, store: wgpu::StoreOp::Store }),
        stencil_ops: None,
    }
}

fn texel(format: wgpu::TextureFormat) -> usize {
    match format {
        wgpu::TextureFormat::Rgba32Float => 16,
        wgpu::TextureFormat::Rgba16Float => 8,
        _ => 4,
    }
}

/// Bytes of a row of pixels, as copies want it.
fn row_bytes(width: u32, format: wgpu::TextureFormat) -> u32 {
    (width * texel(format) as u32).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
}

/// The pixels of a row.
fn pixels(bytes: &[u8], format: wgpu::TextureFormat) -> Vec<[f32; 4]> {
    match format {
        wgpu::TextureFormat::Rgba32Float => bytemuck::cast_slice(bytes).to_vec(),
        wgpu::TextureFormat::Rgba16Float => {
            let half = |b: &[u8]| half::f16::from_le_bytes([b[0], b[1]]).to_f32();
            bytes.chunks_exact(8).map(|p| [0, 2, 4, 6].map(|k| half(&p[k..]))).collect()
        }
        _ => bytes.chunks_exact(4).map(|p| [0, 1, 2, 3].map(|k| f32::from(p[k]) / 255.0)).collect(),
    }
}
