//! Drawing triangles: pictures on the device, pipelines that blend, and groups of more than buffers.

use super::Gpu;
use super::buffers::Buffer;
use crate::error::{Error, Result};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};

/// A texture that gives its bytes back to the budget when it goes.
#[derive(Debug)]
pub(crate) struct Texture {
    pub(crate) raw: wgpu::Texture,
    pub(crate) view: wgpu::TextureView,
    bytes: u64,
    allocated: Arc<AtomicU64>,
}

impl Texture {
    /// A texture of one level.
    ///
    /// # Errors
    /// [`Error::Device`] if the device knows none so large, [`Error::Memory`] if the budget does not allow it, and
    /// those of [`Gpu::check`].
    pub(crate) fn new(
        gpu: &Gpu,
        label: &str,
        dimension: wgpu::TextureDimension,
        size: [u32; 3],
        format: wgpu::TextureFormat,
        usage: wgpu::TextureUsages,
    ) -> Result<Self> {
        let (limits, is_solid) = (gpu.device.limits(), dimension == wgpu::TextureDimension::D3);
        let most = if is_solid { limits.max_texture_dimension_3d } else { limits.max_texture_dimension_2d };
        if size.iter().any(|&n| n > most) {
            let ([w, h, d], name) = (size, &gpu.adapter.name);
            let size = if is_solid { format!("{w}x{h}x{d}") } else { format!("{w}x{h}") };
            return Err(Error::Device(format!(
                "{label}: {size} pixels are too many for {name}, which has {most} at most along each side"
            )));
        }
        let texel = u64::from(format.block_copy_size(None).unwrap_or(16));
        let bytes = size.iter().fold(texel, |n, &s| n * u64::from(s));
        let needed = gpu.allocated.fetch_add(bytes, Relaxed) + bytes;
        if needed > gpu.budget {
            gpu.allocated.fetch_sub(bytes, Relaxed);
            return Err(Error::Memory { device: gpu.adapter.name.clone(), needed, allowed: gpu.budget });
        }
        let raw = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: size[2] },
            mip_level_count: 1,
            sample_count: 1,
            dimension,
            format,
            usage,
            view_formats: &[],
        });
        let view = raw.create_view(&wgpu::TextureViewDescriptor::default());
        let texture = Texture { raw, view, bytes, allocated: Arc::clone(&gpu.allocated) };
        gpu.check()?;
        Ok(texture)
    }

    /// Hands over `bytes`, which fill a rectangle of `width` and `height` at `x`, `y` of the layer or slice `z`.
    pub(crate) fn write(&self, gpu: &Gpu, [x, y, z]: [u32; 3], [width, height]: [u32; 2], bytes: &[u8]) {
        gpu.uploaded.fetch_add(bytes.len() as u64, Relaxed);
        gpu.queue.write_texture(
            wgpu::TexelCopyTextureInfo { origin: wgpu::Origin3d { x, y, z }, ..self.raw.as_image_copy() },
            bytes,
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(bytes.len() as u32 / height),
                rows_per_image: Some(height),
            },
            wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        );
    }
}

impl Drop for Texture {
    fn drop(&mut self) {
        self.allocated.fetch_sub(self.bytes, Relaxed);
    }
}

/// A buffer that the host can read once work that was submitted is done.
pub(crate) struct Readback {
    buffer: Buffer,
    mapped: Arc<AtomicBool>,
}

impl Readback {
    /// Room for `size` bytes.
    ///
    /// # Errors
    /// Those of [`Buffer::new`].
    pub(crate) fn new(gpu: &Gpu, size: u64) -> Result<Self> {
        let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
        Ok(Readback { buffer: Buffer::new(gpu, "readback", size, usage)?, mapped: Arc::default() })
    }

    pub(crate) fn raw(&self) -> &wgpu::Buffer {
        &self.buffer.raw
    }

    /// Submits `encoder`, which copies into this, waits for it, and shows the bytes to `read`.
    ///
    /// # Errors
    /// Those of [`Gpu::wait`].
    pub(crate) fn submit<T>(
        &self,
        gpu: &Gpu,
        encoder: wgpu::CommandEncoder,
        read: impl FnOnce(&[u8]) -> T,
    ) -> Result<T> {
        let done = Arc::clone(&self.mapped);
        encoder.map_buffer_on_submit(self.raw(), wgpu::MapMode::Read, .., move |r| done.store(r.is_ok(), Relaxed));
        gpu.queue.submit([encoder.finish()]);
        gpu.wait()?;
        let failed = |e: &str| Error::Lost(format!("{} does not hand its results back {e}", gpu.adapter.name));
        if !self.mapped.swap(false, Relaxed) {
            return Err(failed(""));
        }
        let read = read(&self.raw().get_mapped_range(..).map_err(|e| failed(&e.to_string()))?);
        self.raw().unmap();
        Ok(read)
    }
}

/// What one binding is, and who sees it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Slot {
    Uniform,
    Read,
    Write,
    /// A three-dimensional texture that is filtered.
    Volume,
    /// An array of two-dimensional textures that are filtered.
    Layers,
    /// A two-dimensional texture of four floats that is read texel by texel.
    Texels,
    /// A sampler that filters.
    Sampler,
}

/// The layout of a group whose bindings are numbered from 0, for `stages`.
pub(crate) fn layout(gpu: &Gpu, stages: wgpu::ShaderStages, slots: &[Slot]) -> wgpu::BindGroupLayout {
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let texture = |view_dimension| wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: true },
        view_dimension,
        multisampled: false,
    };
    let entries: Vec<_> = (0..)
        .zip(slots)
        .map(|(binding, slot)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: stages,
            ty: match slot {
                Slot::Uniform => buffer(wgpu::BufferBindingType::Uniform),
                Slot::Read => buffer(wgpu::BufferBindingType::Storage { read_only: true }),
                Slot::Write => buffer(wgpu::BufferBindingType::Storage { read_only: false }),
                Slot::Volume => texture(wgpu::TextureViewDimension::D3),
                Slot::Layers => texture(wgpu::TextureViewDimension::D2Array),
                Slot::Texels => wgpu::BindingType::StorageTexture {
                    access: wgpu::StorageTextureAccess::ReadOnly,
                    format: wgpu::TextureFormat::Rgba32Float,
                    view_dimension: wgpu::TextureViewDimension::D2,
                },
                Slot::Sampler => wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
            },
            count: None,
        })
        .collect();
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries })
}

/// A group of `resources`, bound from 0 on.
pub(crate) fn group<'a>(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    resources: impl IntoIterator<Item = wgpu::BindingResource<'a>>,
) -> wgpu::BindGroup {
    let entries: Vec<_> =
        (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

/// A group of whole buffers, bound from 0 on.
pub(crate) fn group_of<'a>(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    buffers: impl IntoIterator<Item = &'a Buffer>,
) -> wgpu::BindGroup {
    group(gpu, layout, buffers.into_iter().map(|b| b.raw.as_entire_binding()))
}

pub(crate) fn pipeline_layout(gpu: &Gpu, layouts: &[Option<&wgpu::BindGroupLayout>]) -> wgpu::PipelineLayout {
    gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: layouts,
        immediate_size: 0,
    })
}

pub(crate) fn module(gpu: &Gpu, label: &str, source: &str) -> wgpu::ShaderModule {
    gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(label),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    })
}

/// A compute pipeline of the entry point `entry`.
pub(crate) fn compute(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    entry: &str,
    layout: &wgpu::PipelineLayout,
) -> wgpu::ComputePipeline {
    gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(entry),
        layout: Some(layout),
        module,
        entry_point: Some(entry),
        compilation_options: wgpu::PipelineCompilationOptions {
            zero_initialize_workgroup_memory: false,
            ..Default::default()
        },
        cache: None,
    })
}

/// What pipelines without blending keep the greatest of.
pub(crate) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// A pipeline of the entry points "vertex" and "fragment" that draws triangles of vertices with these `attributes`,
/// each `stride` bytes apart in every binding, onto one picture, but for those `culled`.
pub(crate) fn render(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    layout: &wgpu::PipelineLayout,
    (stride, attributes): (u64, &[Vec<wgpu::VertexAttribute>]),
    format: wgpu::TextureFormat,
    blend: Option<wgpu::BlendComponent>,
    culled: Option<wgpu::Face>,
) -> wgpu::RenderPipeline {
    let binding = |attributes| {
        Some(wgpu::VertexBufferLayout { array_stride: stride, step_mode: wgpu::VertexStepMode::Vertex, attributes })
    };
    let buffers: Vec<_> = attributes.iter().map(|a| binding(a.as_slice())).collect();
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("draw"),
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("vertex"),
            compilation_options: Default::default(),
            buffers: &buffers,
        },
        primitive: wgpu::PrimitiveState { cull_mode: culled, ..Default::default() },
        depth_stencil: blend.is_none().then(|| wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some("fragment"),
            compilation_options: Default::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format,
                blend: blend.map(|blend| wgpu::BlendState { color: blend, alpha: blend }),
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}
