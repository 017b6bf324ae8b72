//! Pre-integrated tables on a device, as `shaders/table.wgsl` reads them.

use super::Gpu;
use super::buffers::Buffer;
use super::raster::{Slot, Texture};
use crate::error::{Error, Result};
use crate::integral::table::{self, Table};
use crate::project::Texels;
use wgpu::{BufferUsages as Usage, TextureDimension, TextureFormat, TextureUsages};

pub(crate) const TABLE: &str = include_str!("../../shaders/table.wgsl");

/// What a program binds to look tables up, in the order of [`declarations`].
pub(crate) const SLOTS: [Slot; 3] = [Slot::Volume, Slot::Sampler, Slot::Uniform];

/// The bindings of a table, from `first` on in `group`.
pub(crate) fn declarations(group: u32, first: u32) -> String {
    let names = ["var table_volume: texture_3d<f32>", "var table_filter: sampler", "var<uniform> table: Table"];
    (first..).zip(names).map(|(binding, name)| format!("@group({group}) @binding({binding}) {name};\n")).collect()
}

/// A table, or what takes its place where there is none.
pub(crate) struct OnDevice {
    texels: Texture,
    filter: wgpu::Sampler,
    /// `Table` in the shader.
    parameters: Buffer,
}

impl OnDevice {
    /// The smallest that can be bound.
    ///
    /// # Errors
    /// Those of [`Gpu::check`] and [`Buffer::new`].
    pub(crate) fn none(gpu: &Gpu) -> Result<Self> {
        Self::new(gpu, [1; 3], TextureFormat::Rgba8Unorm, &[0; 4], [0.0; 8])
    }

    fn new(gpu: &Gpu, size: [u32; 3], format: TextureFormat, bytes: &[u8], parameters: [f32; 8]) -> Result<Self> {
        let usage = TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST;
        let texels = Texture::new(gpu, "table", TextureDimension::D3, size, format, usage)?;
        let [width, height, depth] = size;
        gpu.queue.write_texture(
            texels.raw.as_image_copy(),
            bytes,
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(width * format.block_copy_size(None).unwrap_or(16)),
                rows_per_image: Some(height),
            },
            wgpu::Extent3d { width, height, depth_or_array_layers: depth },
        );
        let filter = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        let parameters = Buffer::holding(gpu, "table", &parameters, Usage::UNIFORM)?;
        Ok(OnDevice { texels, filter, parameters })
    }

    /// Hands `table` over.
    ///
    /// # Errors
    /// [`Error::Device`] if the device does not filter such texels, and those of [`Gpu::check`] and [`Buffer::new`].
    pub(crate) fn holding(gpu: &Gpu, table: &Table, texels: Texels) -> Result<Self> {
        let format = texel_format(gpu, texels)?;
        let greatest = table.greatest();
        let (scale, bytes) = match format {
            TextureFormat::Rgba32Float => ([1.0; 4], bytemuck::cast_slice(&table.texels).to_vec()),
            TextureFormat::Rgba16Unorm => {
                let texels: Vec<u16> = shares(table, greatest).map(|v| (v * 65535.0).round() as u16).collect();
                (greatest, bytemuck::cast_slice(&texels).to_vec())
            }
            _ => (greatest, shares(table, greatest).map(|v| (v * 255.0).round() as u8).collect()),
        };
        let [w, h, d] = table.size;
        let step = match table.kind {
            table::Kind::Uniform => table.longest,
            table::Kind::Log | table::Kind::LogNormalised => table::length(table.kind, d, table.longest, 1),
        };
        let [x, y, z] = [w, h, d].map(|n| n as f32);
        let [r, g, b, a] = scale;
        Self::new(gpu, table.size, format, &bytes, [x, y, z, step as f32, r, g, b, a])
    }

    /// What to bind, as [`SLOTS`] say.
    pub(crate) fn bindings(&self) -> [wgpu::BindingResource<'_>; SLOTS.len()] {
        [
            wgpu::BindingResource::TextureView(&self.texels.view),
            wgpu::BindingResource::Sampler(&self.filter),
            self.parameters.raw.as_entire_binding(),
        ]
    }
}

/// All channels of all texels, each over the greatest.
fn shares(table: &Table, greatest: [f32; 4]) -> impl Iterator<Item = f32> {
    table.texels.iter().flat_map(move |t| [0, 1, 2, 3].map(|k| t[k] / greatest[k]))
}

/// The texture format of a table.
fn texel_format(gpu: &Gpu, texels: Texels) -> Result<TextureFormat> {
    let (format, feature, what) = match texels {
        Texels::Unorm8 => return Ok(TextureFormat::Rgba8Unorm),
        Texels::Unorm16 => (TextureFormat::Rgba16Unorm, wgpu::Features::TEXTURE_FORMAT_16BIT_NORM, "16-bit textures"),
        Texels::Float => {
            (TextureFormat::Rgba32Float, wgpu::Features::FLOAT32_FILTERABLE, "filtered 32-bit float textures")
        }
    };
    if gpu.device.features().contains(feature) {
        return Ok(format);
    }
    Err(Error::Device(format!("{} has no {what}; use other texels for the table", gpu.adapter.name)))
}
