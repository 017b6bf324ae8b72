//! Pre-integrated tables on a device, as `shaders/table.wgsl` reads them.

use super::Gpu;
use super::buffers::Buffer;
use super::construct::{TableBuilder, Texels as BuiltTexels};
use super::raster::{Slot, Texture};
use crate::error::{Error, Result};
use crate::integral::lookup::{Range, TableData};
use crate::integral::options::{Alpha, Build, Form, IntegrationOptions, Planes, Texels};
use crate::integral::table::{Cylindrical, Kind, length};
use crate::integral::{Exact, PreintegratedTable};
use bytemuck::{Pod, Zeroable};
use std::sync::Arc;
use wgpu::{BufferUsages as Usage, TextureDimension, TextureFormat, TextureUsages};

pub(crate) const TABLE: &str = include_str!("../../shaders/table.wgsl");

/// What a program binds to look tables up, in the order of [`declarations`].
pub(crate) const SLOTS: [Slot; 4] = [Slot::Volume, Slot::Layers, Slot::Sampler, Slot::Uniform];

/// Powers of a polynomial at most.
const POWERS: usize = 9;

/// Columns of a tile with two triangles besides those of a plane, so that a filter on one reads nothing of the other.
const GAP: u32 = 3;

/// Bytes that are handed over at once.
const AT_ONCE: u64 = 64 << 20;

/// The bindings of a table, from `first` on in `group`.
pub(crate) fn declarations(group: u32, first: u32) -> String {
    let names = [
        "var table_volume: texture_3d<f32>",
        "var table_layers: texture_2d_array<f32>",
        "var table_filter: sampler",
        "var<uniform> table: Table",
    ];
    (first..).zip(names).map(|(binding, name)| format!("@group({group}) @binding({binding}) {name};\n")).collect()
}

/// The constants that a program with this table is compiled for; `per_cell` if a cylinder's planes are known from the
/// cell.
pub(crate) fn constants(table: Option<&PreintegratedTable>, per_cell: bool) -> String {
    let mut text = String::new();
    let forms = ["EXACT", "UNIFORM", "LOG", "LOG_NORMALISED", "POLYNOMIAL", "CYLINDRICAL"];
    for (i, form) in forms.iter().enumerate() {
        text += &format!("const {form} = {i}u;\n");
    }
    let form = match table.map(PreintegratedTable::stored) {
        None => "EXACT",
        Some(TableData::Volume(t)) => match t.kind {
            Kind::Uniform => "UNIFORM",
            Kind::Log => "LOG",
            Kind::LogNormalised => "LOG_NORMALISED",
        },
        Some(TableData::Polynomial(_)) => "POLYNOMIAL",
        Some(TableData::Cylindrical(_)) => "CYLINDRICAL",
        // Devices have no slabs of three samples yet, and refuse their tables.
        Some(TableData::SecondOrder(_) | TableData::SecondOrderPolynomial(_)) => "EXACT",
    };
    let choice = table.map(|t| *t.options()).unwrap_or_default();
    text += &format!(
        "const COLORING = {form};\nconst DEGREE = {}u;\nconst LINEAR_OPACITY = {};\nconst ONE_PLANE = {};\nconst PACKED = {};\n\
         const PLANE_PER_CELL = {};\n",
        choice.degree,
        choice.alpha == Alpha::Linear && form == "POLYNOMIAL",
        choice.planes == Planes::One,
        choice.planes == Planes::Packed,
        per_cell && form == "CYLINDRICAL",
    );
    text
}

/// `Table` in the shader.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Parameters {
    size: [f32; 4],
    tiles: [f32; 4],
    span: [[f32; 4]; POWERS],
    least: [[f32; 4]; POWERS],
}

/// A table, or what takes its place where there is none.
#[derive(Debug)]
pub(crate) struct OnDevice {
    volume: Texture,
    layers: (Texture, wgpu::TextureView),
    filter: wgpu::Sampler,
    parameters: Buffer,
}

/// The table that a device holds, and its twin on the host.
#[derive(Debug, Default)]
pub(crate) struct TableCache {
    table: Option<(Option<Arc<PreintegratedTable>>, OnDevice)>,
    builder: Option<TableBuilder>,
}

impl TableCache {
    /// Hands over `table` unless it is there, or has the device build it of the function that `function` tells; without
    /// one, the smallest that can be bound.
    ///
    /// # Errors
    /// Those of [`OnDevice::holding`] and [`OnDevice::building`].
    pub(crate) fn prepare(
        &mut self,
        gpu: &Gpu,
        table: Option<&Arc<PreintegratedTable>>,
        function: &[Buffer; 3],
    ) -> Result<()> {
        let same = |(held, _): &(Option<Arc<PreintegratedTable>>, OnDevice)| match (held, table) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            (None, None) => true,
            _ => false,
        };
        if self.table.as_ref().is_none_or(|h| !same(h)) {
            // The old one's memory first.
            self.table = None;
            let on_device = match table.map(|t| (t, t.source())) {
                None => OnDevice::none(gpu)?,
                Some((table, None)) => OnDevice::holding(gpu, table)?,
                Some((table, Some(exact))) => {
                    let builder = match self.builder.take().filter(|b| b.suits(exact)) {
                        Some(builder) => builder,
                        None => TableBuilder::new(gpu, exact.direct)?,
                    };
                    OnDevice::building(gpu, table, exact, self.builder.insert(builder), function)?
                }
            };
            self.table = Some((table.cloned(), on_device));
        }
        Ok(())
    }

    /// What was prepared last.
    pub(crate) fn get(&self) -> Option<&OnDevice> {
        self.table.as_ref().map(|h| &h.1)
    }
}

fn no_slabs() -> Error {
    Error::Device("devices have no tables of second order: the CPU's ray caster of grids reads them".into())
}

/// Whether `gpu` is to build the tables of `choice` itself, rather than be handed them.
pub(crate) fn builds(gpu: &Gpu, choice: &IntegrationOptions) -> bool {
    let wanted = match choice.build {
        Build::Auto => !gpu.adapter.is_software(),
        Build::Host => false,
        Build::Device => true,
    };
    let packed = choice.form == Form::Cylindrical && choice.planes == Planes::Packed;
    wanted && choice.texels == Texels::Float && !packed
}

impl OnDevice {
    /// The smallest that can be bound.
    fn none(gpu: &Gpu) -> Result<Self> {
        let format = TextureFormat::Rgba8Unorm;
        let (volume, layers) =
            (texture(gpu, TextureDimension::D3, [1; 3], format)?, texture(gpu, TextureDimension::D2, [1; 3], format)?);
        Self::new(gpu, volume, layers, Parameters::zeroed())
    }

    fn new(gpu: &Gpu, volume: Texture, layers: Texture, parameters: Parameters) -> Result<Self> {
        let filter = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        let view = layers.raw.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..Default::default()
        });
        let parameters = Buffer::holding(gpu, "table", &[parameters], Usage::UNIFORM)?;
        gpu.check()?;
        Ok(OnDevice { volume, layers: (layers, view), filter, parameters })
    }

    /// Hands `table` over.
    ///
    /// # Errors
    /// [`Error::Device`] if the device does not filter such texels or has no textures so large, and those of
    /// [`Gpu::check`] and [`Buffer::new`].
    pub(crate) fn holding(gpu: &Gpu, table: &PreintegratedTable) -> Result<Self> {
        let format = texel_format(gpu, table.options().texels)?;
        let on_device = Self::empty(gpu, table, format)?;
        let (OnDevice { volume, layers: (layers, _), .. }, ranges) = (&on_device, table.ranges());
        let mut writer = Writer { gpu, format, pending: 0 };
        match table.stored() {
            TableData::Volume(t) => {
                let [w, h, _] = t.size;
                for (z, slice) in (0..).zip(t.texels.chunks((w * h) as usize)) {
                    writer.write(volume, [0, 0, z], [w, h], slice, &ranges[0])?;
                }
            }
            TableData::Polynomial(t) => {
                for (power, (texels, range)) in (0..).zip(t.texels.iter().zip(ranges)) {
                    writer.write(layers, [0, 0, power], [t.size; 2], texels, range)?;
                }
            }
            TableData::Cylindrical(t) => {
                let tiles = Tiles::new(gpu, t, table.options().planes == Planes::Packed);
                for tile in 0..tiles.count {
                    let texels = tiles.texels(t, tile);
                    writer.write(layers, tiles.corner(tile), tiles.tile, &texels, &ranges[0])?;
                }
            }
            TableData::SecondOrder(_) | TableData::SecondOrderPolynomial(_) => return Err(no_slabs()),
        }
        Ok(on_device)
    }

    /// Has the device build `table` of the function `exact`, which `function` tells it. Does not wait for it: what the
    /// device is asked to do later comes after.
    ///
    /// # Errors
    /// [`Error::Device`] if it cannot build such a table or has no bindings so large, and those of [`Self::holding`].
    pub(crate) fn building(
        gpu: &Gpu,
        table: &PreintegratedTable,
        exact: &Exact<f64>,
        builder: &TableBuilder,
        function: &[Buffer; 3],
    ) -> Result<Self> {
        let on_device = Self::empty(gpu, table, texel_format(gpu, Texels::Float)?)?;
        let (OnDevice { volume, layers: (layers, _), .. }, [w, h, depth]) = (&on_device, table.size());
        let Some(built) = builder.build(gpu, exact, function, table.stored())? else {
            let name = &gpu.adapter.name;
            return Err(Error::Device(format!("{name} cannot build a table of {w} x {h} x {depth} texels itself")));
        };
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        match table.stored() {
            TableData::Volume(_) => copy(&mut encoder, &built, 0, volume, [0; 3], [w, h, depth]),
            TableData::Polynomial(_) => copy(&mut encoder, &built, 0, layers, [0; 3], [w, h, depth]),
            TableData::Cylindrical(t) => {
                let tiles = Tiles::new(gpu, t, false);
                for tile in 0..tiles.count {
                    copy(&mut encoder, &built, tile * h, layers, tiles.corner(tile), [w, h, 1]);
                }
            }
            TableData::SecondOrder(_) | TableData::SecondOrderPolynomial(_) => return Err(no_slabs()),
        }
        gpu.queue.submit([encoder.finish()]);
        gpu.check()?;
        Ok(on_device)
    }

    /// Textures that have room for `table`, and what shaders must know of it.
    fn empty(gpu: &Gpu, table: &PreintegratedTable, format: TextureFormat) -> Result<Self> {
        let ([x, y, z], longest) = (table.size().map(|n| n as f32), table.longest() as f32);
        let mut parameters = Parameters { size: [x, y, z, longest], ..Parameters::zeroed() };
        for (i, range) in table.ranges().iter().enumerate().take(POWERS) {
            (parameters.span[i], parameters.least[i]) = (range.span, range.least);
        }
        let small = TextureFormat::Rgba8Unorm;
        let layered = |size| {
            Ok((texture(gpu, TextureDimension::D3, [1; 3], small)?, texture(gpu, TextureDimension::D2, size, format)?))
        };
        let (volume, layers) = match table.stored() {
            TableData::Volume(t) => {
                if t.kind != Kind::Uniform {
                    parameters.size[3] = length(t.kind, t.size[2], t.longest, 1) as f32;
                }
                let volume = texture(gpu, TextureDimension::D3, t.size, format)?;
                (volume, texture(gpu, TextureDimension::D2, [1; 3], small)?)
            }
            TableData::Polynomial(_) => layered(table.size())?,
            TableData::Cylindrical(t) => {
                let tiles = Tiles::new(gpu, t, table.options().planes == Planes::Packed);
                parameters.tiles = tiles.parameters();
                layered(tiles.size())?
            }
            TableData::SecondOrder(_) | TableData::SecondOrderPolynomial(_) => return Err(no_slabs()),
        };
        Self::new(gpu, volume, layers, parameters)
    }

    /// What to bind, as [`SLOTS`] say.
    pub(crate) fn bindings(&self) -> [wgpu::BindingResource<'_>; SLOTS.len()] {
        [
            wgpu::BindingResource::TextureView(&self.volume.view),
            wgpu::BindingResource::TextureView(&self.layers.1),
            wgpu::BindingResource::Sampler(&self.filter),
            self.parameters.raw.as_entire_binding(),
        ]
    }
}

fn texture(gpu: &Gpu, dimension: TextureDimension, size: [u32; 3], format: TextureFormat) -> Result<Texture> {
    let most = gpu.device.limits().max_texture_array_layers;
    if dimension == TextureDimension::D2 && size[2] > most {
        let name = &gpu.adapter.name;
        return Err(Error::Device(format!(
            "{name} has no table of {} layers, but of {most} at most; use fewer planes",
            size[2]
        )));
    }
    Texture::new(gpu, "table", dimension, size, format, TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST)
}

/// Copies rows of what was built, from the row `first` on, to where `texture` has `size` texels.
fn copy(
    encoder: &mut wgpu::CommandEncoder,
    built: &BuiltTexels,
    first: u32,
    texture: &Texture,
    [x, y, z]: [u32; 3],
    [width, height, depth]: [u32; 3],
) {
    let row = 16 * built.pitch;
    encoder.copy_buffer_to_texture(
        wgpu::TexelCopyBufferInfo {
            buffer: &built.buffer.raw,
            layout: wgpu::TexelCopyBufferLayout {
                offset: u64::from(first) * u64::from(row),
                bytes_per_row: Some(row),
                rows_per_image: Some(height),
            },
        },
        wgpu::TexelCopyTextureInfo { origin: wgpu::Origin3d { x, y, z }, ..texture.raw.as_image_copy() },
        wgpu::Extent3d { width, height, depth_or_array_layers: depth },
    );
}

/// Hands texels over, some at a time.
struct Writer<'a> {
    gpu: &'a Gpu,
    format: TextureFormat,
    pending: u64,
}

impl Writer<'_> {
    fn write(
        &mut self,
        texture: &Texture,
        at: [u32; 3],
        size: [u32; 2],
        texels: &[[f32; 4]],
        range: &Range,
    ) -> Result<()> {
        let shares = || texels.iter().flat_map(|t| range.share(*t));
        let bytes: Vec<u8> = match self.format {
            TextureFormat::Rgba32Float => bytemuck::cast_slice(texels).to_vec(),
            TextureFormat::Rgba16Unorm => shares().flat_map(|v| ((v * 65535.0).round() as u16).to_ne_bytes()).collect(),
            _ => shares().map(|v| (v * 255.0).round() as u8).collect(),
        };
        let gpu = self.gpu;
        texture.write(gpu, at, size, &bytes);
        self.pending += bytes.len() as u64;
        if self.pending >= AT_ONCE {
            self.pending = 0;
            gpu.queue.submit([]);
            gpu.wait()?;
        }
        Ok(())
    }
}

/// Where the planes of a cylinder are: as tiles of one layer, or of several where one would be too large.
struct Tiles {
    /// Width and height of one, in texels.
    tile: [u32; 2],
    count: u32,
    across: u32,
    down: u32,
    packed: bool,
}

impl Tiles {
    fn new(gpu: &Gpu, planes: &Cylindrical, packed: bool) -> Self {
        Self::within(gpu.device.limits().max_texture_dimension_2d, planes.size, planes.planes, packed)
    }

    fn within(most: u32, size: u32, planes: u32, packed: bool) -> Self {
        let (width, count) = if packed { (size + GAP, planes / 4 * 3 + 1) } else { (size, planes) };
        let across = (f64::from(count).sqrt().ceil() as u32).min(most / width).max(1);
        let down = count.div_ceil(across).min(most / size).max(1);
        Tiles { tile: [width, size], count, across, down, packed }
    }

    /// Width and height of a layer, and how many there are.
    fn size(&self) -> [u32; 3] {
        let [w, h] = self.tile;
        [w * self.across, h * self.down, self.count.div_ceil(self.across * self.down)]
    }

    fn parameters(&self) -> [f32; 4] {
        let [w, h, _] = self.size().map(|n| n as f32);
        [self.across as f32, (self.across * self.down) as f32, 1.0 / w, 1.0 / h]
    }

    /// The place of a tile, and its layer.
    fn corner(&self, tile: u32) -> [u32; 3] {
        let within = tile % (self.across * self.down);
        let [w, h] = self.tile;
        [within % self.across * w, within / self.across * h, tile / (self.across * self.down)]
    }

    /// What a tile holds: a plane; or, of those that are triangles, two.
    fn texels<'a>(&self, planes: &'a Cylindrical, tile: u32) -> std::borrow::Cow<'a, [[f32; 4]]> {
        let n = planes.size as usize;
        let plane = |k: u32| &planes.texels[k as usize * n * n..][..n * n];
        if !self.packed {
            return plane(tile).into();
        }
        // S_f = t + s of the first quarter ends at 1, t − s of the last at 0. What is between the last of these planes
        // and the next needs more of it.
        let whole = tile >= planes.planes / 4;
        let second = if tile == 0 || whole { tile } else { planes.planes - tile };
        let (first, second) = (plane(tile), plane(second));
        let texel = |(j, c): (usize, usize)| {
            if whole || c <= n - j {
                first[j * n + c.min(n - 1)]
            } else {
                second[j * n + (n + GAP as usize - 1 - c).min(n - 1)]
            }
        };
        (0..n).flat_map(|j| (0..n + GAP as usize).map(move |c| (j, c))).map(texel).collect::<Vec<_>>().into()
    }
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

#[cfg(test)]
mod tests;
