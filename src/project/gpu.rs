//! The engine on a device: what it holds, and the passes of a frame.
//!
//! 1. `classify` (compute) finds the cells that are seen, and a key of depth for each.
//! 2. These are sorted.
//! 3. Batch by batch, in that order, `project` (compute) makes a record of each cell, and the records are drawn.

use super::frame::{FAR, FILLED, Frame, Limits, Seen, filled};
use super::{Compositing, Counts, Fragments, Order, Switches, Target, Thickness};
use crate::error::{Error, Result};
use crate::geometry::{Geometry, Values};
use crate::gpu::buffers::{Buffer, Chunks};
use crate::gpu::raster::{self, Readback, Slot, Texture};
use crate::gpu::shader::{self, Array, Variant};
use crate::gpu::sort::Sorter;
use crate::gpu::table::{self, TABLE};
use crate::gpu::{DeviceChoice, Gpu, Part, arrays, function};
use crate::integral::{Exact, Lookup};
use crate::order::depth::{self, HIDDEN, IN_PARTS};
use crate::view::{Blend, View};
use bytemuck::{Pod, Zeroable};
use std::sync::Arc;
use std::time::Instant;
use wgpu::{BufferUsages as Usage, ShaderStages as Stages, TextureUsages};

const SHARED: &str = include_str!("../../shaders/project.wgsl");
const CELLS: &str = include_str!("../../shaders/project_cells.wgsl");
const SHADE: &str = include_str!("../../shaders/project_shade.wgsl");

/// For each form: its records, and how they are drawn.
const INTERSECTED: [&str; 2] = [
    include_str!("../../shaders/project_intersected.wgsl"),
    include_str!("../../shaders/project_intersected_draw.wgsl"),
];
const INTERPOLATED: [&str; 2] = [
    include_str!("../../shaders/project_interpolated.wgsl"),
    include_str!("../../shaders/project_interpolated_draw.wgsl"),
];

/// Records of one batch.
const BATCH: usize = 1 << 17;

/// Batches that are handed over at once: a driver ends work that takes seconds.
const AT_ONCE: usize = 8;

/// Entries of one buffer of the order, a multiple of [`BATCH`]; and those before each that it repeats.
const ORDER_CHUNK: usize = BATCH << 6;
const REPEATED: usize = 2;

/// Cells that are classified at once.
const CLASSIFIED: usize = 1 << 24;

/// Invocations of a compute group, and groups along one axis at most.
const GROUP: u32 = 64;
const MOST_GROUPS: u32 = 65_535;

/// How much an outline is grown, in pixels: rasterisers round corners to this.
const GROWTH: f64 = 1.0 / 256.0;

/// Loop iterations of a fragment that llvmpipe surely makes: see `traverse::gpu`.
const MOST_WORK: u32 = 8000;

/// Vertices and triangles' corners of a record, for each form.
const INTERSECTED_INDICES: (u32, &[u32]) = (4, &[0, 1, 2, 0, 2, 3]);
const INTERPOLATED_INDICES: (u32, &[u32]) = (5, &[4, 0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0]);

/// `Part` in the shaders.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
struct Slice {
    first: u32,
    count: u32,
    row: u32,
    rank: u32,
}

/// Somebody who is shown keys, some at a time.
type Reader<'a> = &'a mut dyn FnMut(&[u32]);

/// What the programs are compiled for.
struct Program {
    source: String,
    format: wgpu::TextureFormat,
    compositing: Compositing,
    arrays: wgpu::BindGroupLayout,
    classify: wgpu::ComputePipeline,
    project: wgpu::ComputePipeline,
    draw: wgpu::RenderPipeline,
}

/// What a frame's batches are drawn with and into; depends on the form and the size of the picture.
struct Canvas {
    corners: usize,
    records: Buffer,
    indices: Buffer,
    picture: Texture,
    back: Readback,
}

/// The order of a frame, and what it holds for.
struct Ordered {
    frame: Frame,
    planes: Vec<[f32; 4]>,
    by: Order,
    form: Fragments,
    /// Entries, and the buffers that they are in, so many in each.
    entries: usize,
    chunk: usize,
    chunks: Vec<Buffer>,
}

/// A device, and what of the mesh, field and function it holds.
pub(crate) struct Project {
    gpu: Gpu,
    shared: wgpu::BindGroupLayout,
    own: wgpu::BindGroupLayout,
    drawn: wgpu::BindGroupLayout,
    cells: Option<Chunks>,
    points: Option<Chunks>,
    values: Option<Chunks>,
    function: Option<([Buffer; 3], Buffer)>,
    program: Option<Program>,
    canvas: Option<(Fragments, [u32; 2], wgpu::TextureFormat, u64, Canvas)>,
    ordered: Option<Ordered>,
    table: table::Held,
    sorter: Option<Sorter>,
    /// Whether the device sorts, and not the host.
    sorts: bool,
}

impl std::fmt::Debug for Project {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Project").field("adapter", &self.gpu.adapter.name).finish_non_exhaustive()
    }
}

impl Project {
    /// Opens the device that `choice` says; with [`DeviceChoice::Auto`] the first GPU, or else the first device in software.
    ///
    /// # Errors
    /// [`Error::Device`] if there is none, or it cannot be used.
    pub(crate) fn open(choice: &DeviceChoice) -> Result<Self> {
        let none = |why: &str| {
            let help = "name another device, or use the engine \"traverse\", which the CPU can draw with";
            Error::Device(format!("the projection engine needs a graphics device, and {why}; {help}"))
        };
        if *choice == DeviceChoice::Cpu {
            return Err(none("the CPU itself is none"));
        }
        let gpu = match Gpu::open(choice)? {
            Some(gpu) => gpu,
            None => {
                let usable = crate::gpu::devices().into_iter().find(|d| d.lacks.is_none());
                let usable = usable.ok_or_else(|| none("there is none"))?;
                Gpu::open(&DeviceChoice::Named(usable.index.to_string()))?.ok_or_else(|| none("there is none"))?
            }
        };
        use Slot::{Read, Uniform, Write};
        let sorts = gpu.adapter.kind != "CPU";
        let shared = raster::layout(
            &gpu,
            Stages::COMPUTE | Stages::VERTEX_FRAGMENT,
            &[&[Uniform, Read, Read, Uniform, Read, Read], &table::SLOTS[..]].concat(),
        );
        let own = raster::layout(&gpu, Stages::COMPUTE, &[Uniform, Read, Write, Read, Write]);
        let drawn = raster::layout(&gpu, Stages::VERTEX_FRAGMENT, &[Read]);
        Ok(Project {
            gpu,
            shared,
            own,
            drawn,
            cells: None,
            points: None,
            values: None,
            function: None,
            program: None,
            canvas: None,
            ordered: None,
            table: table::Held::default(),
            sorter: None,
            sorts,
        })
    }

    pub(crate) fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Sorts on the device or on the host from now on, whatever suits it.
    #[cfg(test)]
    pub(crate) fn sort_on_device(&mut self, sorts: bool) {
        (self.sorts, self.ordered) = (sorts, None);
    }

    /// Takes `part` for changed.
    pub(crate) fn forget(&mut self, part: Part) {
        self.ordered = None;
        match part {
            Part::Mesh => (self.cells, self.points, self.values) = (None, None, None),
            Part::Points => self.points = None,
            Part::Field => self.values = None,
            Part::Function => self.function = None,
        }
    }

    /// Hands over what the device does not hold yet.
    fn upload<const N: usize>(&mut self, geometry: &Geometry, values: &Values<N>) -> Result<()> {
        let gpu = &self.gpu;
        if self.cells.is_none() {
            self.cells = Some(Chunks::new(gpu, "cells", &geometry.cells, |c| c.corners)?);
        }
        if self.points.is_none() {
            self.points = Some(arrays::points(gpu, geometry)?);
        }
        if self.values.is_none() {
            self.values = Some(arrays::values(gpu, values)?);
        }
        Ok(())
    }

    /// Has the device hold the function and `table`, or build that, unless it does.
    ///
    /// # Errors
    /// Those of [`table::Held::prepare`].
    pub(crate) fn prepare_table(&mut self, exact: &Exact<f32>, table: Option<&Arc<Lookup>>) -> Result<()> {
        let gpu = &self.gpu;
        let function = match self.function.take() {
            Some(function) => function,
            None => {
                let filled = Buffer::holding(gpu, "filled", &filled(exact), Usage::STORAGE)?;
                (function::upload(gpu, exact)?, filled)
            }
        };
        self.table.prepare(gpu, table, &self.function.insert(function).0)
    }

    /// Draws a frame; premultiplied colours, row by row.
    ///
    /// # Errors
    /// [`Error::View`] for [`Blend::Maximum`], [`Error::Device`] if the device cannot blend into the target, and those of
    /// [`Gpu::check`] and [`Buffer::new`].
    pub(crate) fn render<const N: usize>(
        &mut self,
        geometry: &Geometry,
        values: &Values<N>,
        exact: &Exact<f32>,
        table: Option<&Arc<Lookup>>,
        view: &View,
        switches: &Switches,
    ) -> Result<(Vec<[f32; 4]>, Counts)> {
        if view.blend() == Blend::Maximum {
            let what = "the projection engine does not draw the maximum along rays; the engine \"traverse\" does";
            return Err(Error::View(what.into()));
        }
        let format = self.format(switches.target)?;
        self.upload(geometry, values)?;
        self.prepare_table(exact, table)?;
        let association = arrays::association(values);
        let arrays = self.arrays()?;
        let seen = Seen::new(geometry, view);
        let variant = Variant { kind: exact.kind, direct: exact.direct };
        let mut limits = seen.limits();
        // In parallel views all segments of a cell are on one plane.
        let one_plane = table.is_some_and(|t| t.choice().per_cell) || view.eye().is_none();
        limits.plane_per_cell = one_plane && switches.fragments != Fragments::Intersected;
        let source = program(&variant, association, switches, table.map(|t| &**t), limits, &arrays);
        self.compile(&arrays, source, switches, format)?;
        self.prepare_canvas::<N>(switches.fragments, view.size(), format)?;
        let frame = Pass::new(self, &seen)?;
        let mut counts = Counts::default();
        if !self.ordered.as_ref().is_some_and(|o| o.holds_for(&seen, switches)) {
            let start = Instant::now();
            self.ordered = None;
            self.ordered = Some(self.order(&frame, &seen, geometry.cells.len(), switches)?);
            counts.order_ms = start.elapsed().as_secs_f64() * 1e3;
        }
        self.draw(&frame, view, &mut counts).map(|pixels| (pixels, counts))
    }

    /// The texture that a target is.
    fn format(&self, target: Target) -> Result<wgpu::TextureFormat> {
        let can = self.gpu.device.features().contains(wgpu::Features::FLOAT32_BLENDABLE);
        match target {
            Target::Rgba32float if !can => {
                let name = &self.gpu.adapter.name;
                let what =
                    "cannot blend 32-bit floats; draw into rgba16float, which costs accuracy, or with \"traverse\"";
                Err(Error::Device(format!("{name} {what}")))
            }
            Target::Rgba32float => Ok(wgpu::TextureFormat::Rgba32Float),
            Target::Rgba16float => Ok(wgpu::TextureFormat::Rgba16Float),
            Target::Rgba8 => Ok(wgpu::TextureFormat::Rgba8Unorm),
        }
    }

    /// The arrays of group 1 of the compute stages, in the order of [`Self::chunks`].
    fn arrays(&self) -> Result<[Array; 3]> {
        let names = [("cells", "vec4u"), ("points", "Point"), ("values", "Value")];
        let chunks = self.chunks()?;
        Ok(std::array::from_fn(|i| {
            let (name, element) = names[i];
            Array { name, element, chunks: chunks[i].buffers.len(), shift: chunks[i].shift }
        }))
    }

    fn chunks(&self) -> Result<[&Chunks; 3]> {
        match (&self.cells, &self.points, &self.values) {
            (Some(cells), Some(points), Some(values)) => Ok([cells, points, values]),
            _ => Err(Error::Render("the device does not hold the mesh".into())),
        }
    }

    fn compile(
        &mut self,
        arrays: &[Array],
        source: String,
        switches: &Switches,
        format: wgpu::TextureFormat,
    ) -> Result<()> {
        let compositing = switches.compositing;
        let same = |p: &Program| p.source == source && p.format == format && p.compositing == compositing;
        if self.program.as_ref().is_some_and(same) {
            return Ok(());
        }
        let gpu = &self.gpu;
        let bindings = arrays.iter().map(|a| a.chunks).sum();
        let array_layout = raster::layout(gpu, Stages::COMPUTE, &vec![Slot::Read; bindings]);
        let module = raster::module(gpu, "project", &source);
        let cells = raster::pipeline_layout(gpu, &[Some(&self.shared), Some(&array_layout), Some(&self.own)]);
        let drawing = raster::pipeline_layout(gpu, &[Some(&self.shared), None, None, Some(&self.drawn)]);
        let blend = wgpu::BlendComponent {
            src_factor: wgpu::BlendFactor::One,
            dst_factor: match compositing {
                Compositing::Over => wgpu::BlendFactor::OneMinusSrcAlpha,
                Compositing::Additive => wgpu::BlendFactor::One,
            },
            operation: wgpu::BlendOperation::Add,
        };
        // The outline of an intersected cell may be no more than that: grown, it need not turn one way.
        let culled = (switches.fragments != Fragments::Intersected).then_some(wgpu::Face::Back);
        let program = Program {
            classify: raster::compute(gpu, &module, "classify", &cells),
            project: raster::compute(gpu, &module, "project_all", &cells),
            draw: raster::render(gpu, &module, &drawing, format, blend, culled),
            arrays: array_layout,
            source,
            format,
            compositing,
        };
        gpu.check()?;
        self.program = Some(program);
        Ok(())
    }

    fn prepare_canvas<const N: usize>(
        &mut self,
        form: Fragments,
        size: [u32; 2],
        format: wgpu::TextureFormat,
    ) -> Result<()> {
        let stride = stride::<N>(form);
        if self.canvas.as_ref().is_some_and(|c| (c.0, c.1, c.2, c.3) == (form, size, format, stride)) {
            return Ok(());
        }
        self.canvas = None;
        let gpu = &self.gpu;
        let (vertices, corners) = indices(form);
        let all: Vec<u32> = (0..BATCH as u32).flat_map(|r| corners.iter().map(move |c| r * vertices + c)).collect();
        let [w, h] = size;
        let canvas = Canvas {
            corners: corners.len(),
            records: Buffer::new(gpu, "records", stride * BATCH as u64, Usage::STORAGE)?,
            indices: Buffer::holding(gpu, "indices", &all, Usage::INDEX)?,
            picture: Texture::new(
                gpu,
                "picture",
                wgpu::TextureDimension::D2,
                [w, h, 1],
                format,
                TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC,
            )?,
            back: Readback::new(gpu, u64::from(row_bytes(w, format)) * u64::from(h) + 16 * u64::from(CLOCKS))?,
        };
        self.canvas = Some((form, size, format, stride, canvas));
        Ok(())
    }

    /// Finds the cells that are seen, and sorts them.
    fn order(&mut self, frame: &Pass, seen: &Seen, cells: usize, switches: &Switches) -> Result<Ordered> {
        let ordered = |entries, chunk, chunks| Ordered {
            frame: seen.frame,
            planes: seen.planes.clone(),
            by: switches.order,
            form: switches.fragments,
            entries,
            chunk,
            chunks,
        };
        // Cells in parts are sorted on the host, which can make several entries of one.
        let whole = switches.fragments == Fragments::Intersected && switches.order != Order::None;
        if self.sorts && whole && Sorter::fits(&self.gpu, cells, REPEATED) {
            if self.sorter.is_none() {
                self.sorter = Some(Sorter::new(&self.gpu, HIDDEN)?);
            }
            let keys = self.classify(frame, cells, None)?;
            let sorter = self.sorter.as_ref().ok_or_else(unprepared)?;
            let (order, entries) = sorter.sort(&self.gpu, &keys, cells, REPEATED)?;
            return Ok(ordered(entries, usize::MAX, vec![order]));
        }
        let mut all: Vec<u32> = Vec::with_capacity(cells);
        self.classify(frame, cells, Some(&mut |keys: &[u32]| all.extend_from_slice(keys)))?;
        let order = depth::order(&all, switches.order != Order::None).cells;
        drop(all);
        let chunks = (0..order.len())
            .step_by(ORDER_CHUNK)
            .map(|first| {
                let end = (first + ORDER_CHUNK).min(order.len());
                if first == 0 {
                    let own = [&[HIDDEN; REPEATED][..], &order[..end]].concat();
                    return Buffer::holding(&self.gpu, "order", &own, Usage::STORAGE);
                }
                Buffer::holding(&self.gpu, "order", &order[first - REPEATED..end], Usage::STORAGE)
            })
            .collect::<Result<_>>()?;
        Ok(ordered(order.len(), ORDER_CHUNK, chunks))
    }

    /// The keys of all cells. If somebody wants to read them, they are shown some at a time, and only the last are returned.
    fn classify(&self, frame: &Pass, cells: usize, mut read: Option<Reader>) -> Result<Buffer> {
        let gpu = &self.gpu;
        let program = self.program.as_ref().ok_or_else(unprepared)?;
        let at_once = if read.is_some() { CLASSIFIED } else { cells };
        let size = 4 * cells.min(at_once) as u64;
        let keys = Buffer::new(gpu, "keys", size, Usage::STORAGE | Usage::COPY_SRC)?;
        let back = Readback::new(gpu, if read.is_some() { size } else { 4 })?;
        let slice = Buffer::new(gpu, "slice", size_of::<Slice>() as u64, Usage::UNIFORM | Usage::COPY_DST)?;
        let none = [Buffer::new(gpu, "none", 16, Usage::STORAGE)?, Buffer::new(gpu, "none", 512, Usage::STORAGE)?];
        let records = none[1].raw.as_entire_binding();
        let own = self.own_group(frame, slice.raw.as_entire_binding(), &keys, &none[0], records);
        for first in (0..cells).step_by(at_once.max(1)) {
            let count = (cells - first).min(at_once);
            let (row, groups) = groups_of(count);
            let part = Slice { first: first as u32, count: count as u32, row, rank: 0 };
            slice.write(gpu, 0, bytemuck::bytes_of(&part));
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            {
                let mut pass = encoder.begin_compute_pass(&Default::default());
                pass.set_pipeline(&program.classify);
                pass.set_bind_group(0, &frame.shared, &[]);
                pass.set_bind_group(1, &frame.arrays, &[]);
                pass.set_bind_group(2, &own, &[]);
                pass.dispatch_workgroups(groups[0], groups[1], 1);
            }
            match &mut read {
                Some(read) => {
                    encoder.copy_buffer_to_buffer(&keys.raw, 0, back.raw(), 0, 4 * count as u64);
                    back.submit(gpu, encoder, |bytes| read(bytemuck::cast_slice(&bytes[..4 * count])))?;
                }
                None => {
                    gpu.queue.submit([encoder.finish()]);
                    gpu.check()?;
                }
            }
        }
        Ok(keys)
    }

    fn own_group(
        &self,
        frame: &Pass,
        slice: wgpu::BindingResource,
        keys: &Buffer,
        order: &Buffer,
        records: wgpu::BindingResource,
    ) -> wgpu::BindGroup {
        let [keys, order] = [keys, order].map(|b| b.raw.as_entire_binding());
        raster::group(&self.gpu, &self.own, [slice, frame.filled.clone(), keys, order, records])
    }

    /// Projects and draws all batches.
    fn draw(&self, frame: &Pass, view: &View, counts: &mut Counts) -> Result<Vec<[f32; 4]>> {
        let gpu = &self.gpu;
        let (Some(program), Some((_, _, format, _, canvas)), Some(ordered)) =
            (&self.program, &self.canvas, &self.ordered)
        else {
            return Err(unprepared());
        };
        counts.records = ordered.entries as u64;
        // Each batch's slice at its own offset, as uniforms are aligned.
        let step = gpu.device.limits().min_uniform_buffer_offset_alignment.max(size_of::<Slice>() as u32) as usize;
        let firsts: Vec<usize> = (0..ordered.entries).step_by(BATCH).collect();
        let mut slices = vec![0u8; step * firsts.len().max(1)];
        for (i, &first) in firsts.iter().enumerate() {
            let count = (ordered.entries - first).min(BATCH);
            let within = first % ordered.chunk + REPEATED;
            let slice =
                Slice { first: within as u32, count: count as u32, row: groups_of(count).0, rank: first as u32 };
            slices[step * i..][..size_of::<Slice>()].copy_from_slice(bytemuck::bytes_of(&slice));
        }
        let slices = Buffer::holding(gpu, "slices", &slices, Usage::UNIFORM)?;
        let none = Buffer::new(gpu, "none", 16, Usage::STORAGE)?;
        let drawn = raster::group(gpu, &self.drawn, [canvas.records.raw.as_entire_binding()]);
        let clock = Clock::new(gpu)?;

        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        self.clear(&mut encoder, canvas);
        // Devices in software tell no times of their parts: the host waits for each, which costs them nothing.
        let is_software = gpu.adapter.kind == "CPU";
        let (mut project_ms, mut since) = (0.0, Instant::now());
        let begun = since;
        for (i, &first) in firsts.iter().enumerate() {
            let count = (ordered.entries - first).min(BATCH);
            let slice = wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                buffer: &slices.raw,
                offset: (step * i) as u64,
                size: std::num::NonZeroU64::new(size_of::<Slice>() as u64),
            });
            let order = &ordered.chunks[first / ordered.chunk];
            let own = self.own_group(frame, slice, &none, order, canvas.records.raw.as_entire_binding());
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
            if is_software {
                gpu.queue.submit([encoder.finish()]);
                gpu.wait()?;
                project_ms += since.elapsed().as_secs_f64() * 1e3;
                encoder = gpu.device.create_command_encoder(&Default::default());
            }
            {
                let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                    label: Some("draw"),
                    color_attachments: &[Some(attachment(&canvas.picture, wgpu::LoadOp::Load))],
                    timestamp_writes: clock.as_ref().and_then(|c| c.render(i)),
                    ..Default::default()
                });
                pass.set_pipeline(&program.draw);
                pass.set_bind_group(0, &frame.shared, &[]);
                pass.set_bind_group(3, &drawn, &[]);
                pass.set_index_buffer(canvas.indices.raw.slice(..), wgpu::IndexFormat::Uint32);
                let counter = clock.as_ref().and_then(|c| c.fragments.as_ref()).filter(|_| i < CLOCKS as usize / 4);
                if let Some(counter) = counter {
                    pass.begin_pipeline_statistics_query(counter, i as u32);
                }
                pass.draw_indexed(0..(count * canvas.corners) as u32, 0, 0..1);
                if counter.is_some() {
                    pass.end_pipeline_statistics_query();
                }
            }
            if is_software || (i + 1) % AT_ONCE == 0 {
                gpu.queue.submit([encoder.finish()]);
                encoder = gpu.device.create_command_encoder(&Default::default());
            }
            if is_software {
                gpu.wait()?;
                since = Instant::now();
            }
        }
        if is_software {
            let all = begun.elapsed().as_secs_f64() * 1e3;
            (counts.project_ms, counts.draw_ms) = (Some(project_ms), Some(all - project_ms));
        }
        let [w, h] = view.size();
        let row = row_bytes(w, *format);
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
                if !is_software {
                    (counts.project_ms, counts.draw_ms) = (Some(sum(0)), Some(sum(2)));
                }
            }
            picture
                .chunks(row as usize)
                .flat_map(|line| pixels(&line[..w as usize * texel(*format)], *format))
                .collect()
        })
    }

    fn clear(&self, encoder: &mut wgpu::CommandEncoder, canvas: &Canvas) {
        let clear = wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT);
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("clear"),
            color_attachments: &[Some(attachment(&canvas.picture, clear))],
            ..Default::default()
        });
    }
}

/// The groups that all passes of a frame share, and the buffers in them.
struct Pass {
    shared: wgpu::BindGroup,
    arrays: wgpu::BindGroup,
    filled: FilledBinding,
    _buffers: [Buffer; 3],
}

/// A binding of a buffer that lives as long as a frame.
struct FilledBinding(wgpu::Buffer);

impl FilledBinding {
    fn clone(&self) -> wgpu::BindingResource<'_> {
        self.0.as_entire_binding()
    }
}

impl Pass {
    fn new(project: &Project, seen: &Seen) -> Result<Self> {
        let gpu = &project.gpu;
        let (Some((function, filled)), Some(program), Some(table)) =
            (&project.function, &project.program, project.table.get())
        else {
            return Err(unprepared());
        };
        let buffers = [
            Buffer::holding(gpu, "frame", &[seen.frame], Usage::UNIFORM)?,
            Buffer::holding(gpu, "planes", &seen.planes, Usage::STORAGE)?,
            Buffer::holding(gpu, "ends", &seen.ends, Usage::STORAGE)?,
        ];
        let shared = function.iter().chain(&buffers).map(|b| b.raw.as_entire_binding()).chain(table.bindings());
        let arrays = project.chunks()?.into_iter().flat_map(|c| &c.buffers).map(|b| b.raw.as_entire_binding());
        Ok(Pass {
            shared: raster::group(gpu, &project.shared, shared),
            arrays: raster::group(gpu, &program.arrays, arrays),
            filled: FilledBinding(filled.raw.clone()),
            _buffers: buffers,
        })
    }
}

impl Ordered {
    fn holds_for(&self, seen: &Seen, switches: &Switches) -> bool {
        let parts = |form| form != Fragments::Intersected;
        self.frame == seen.frame
            && self.planes == seen.planes
            && self.by == switches.order
            && parts(self.form) == parts(switches.fragments)
    }
}

fn unprepared() -> Error {
    Error::Render("the device is not prepared for a frame".into())
}

/// Timestamps of a frame at most.
const CLOCKS: u32 = 1024;

/// Measures the passes of the first batches, and counts their fragments, where the device can.
struct Clock {
    queries: wgpu::QuerySet,
    fragments: Option<wgpu::QuerySet>,
    resolved: Buffer,
}

impl Clock {
    fn new(gpu: &Gpu) -> Result<Option<Self>> {
        if !gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return Ok(None);
        }
        let descriptor = wgpu::QuerySetDescriptor { label: None, ty: wgpu::QueryType::Timestamp, count: CLOCKS };
        let queries = gpu.device.create_query_set(&descriptor);
        let usage = Usage::QUERY_RESOLVE | Usage::COPY_SRC;
        let count = wgpu::QuerySetDescriptor {
            label: None,
            ty: wgpu::QueryType::PipelineStatistics(wgpu::PipelineStatisticsTypes::FRAGMENT_SHADER_INVOCATIONS),
            count: CLOCKS / 4,
        };
        let counts = gpu.device.features().contains(wgpu::Features::PIPELINE_STATISTICS_QUERY);
        let fragments = counts.then(|| gpu.device.create_query_set(&count));
        let resolved = Buffer::new(gpu, "clock", 16 * u64::from(CLOCKS), usage)?;
        Ok(Some(Clock { queries, fragments, resolved }))
    }

    fn compute(&self, batch: usize) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        let first = 4 * batch as u32;
        (first + 4 <= CLOCKS).then_some(wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(first),
            end_of_pass_write_index: Some(first + 1),
        })
    }

    fn render(&self, batch: usize) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        let first = 4 * batch as u32 + 2;
        (first + 2 <= CLOCKS).then_some(wgpu::RenderPassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(first),
            end_of_pass_write_index: Some(first + 1),
        })
    }

    fn resolve(&self, encoder: &mut wgpu::CommandEncoder, into: &wgpu::Buffer, offset: u64, batches: usize) {
        let half = 8 * u64::from(CLOCKS);
        encoder.resolve_query_set(&self.queries, 0..4 * batches as u32, &self.resolved.raw, 0);
        if let Some(fragments) = &self.fragments {
            encoder.resolve_query_set(fragments, 0..batches as u32, &self.resolved.raw, half);
        }
        encoder.copy_buffer_to_buffer(&self.resolved.raw, 0, into, offset, 2 * half);
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

/// Invocations of a row, and groups of a dispatch that is as many rows as `count` invocations need.
fn groups_of(count: usize) -> (u32, [u32; 2]) {
    let groups = (count as u32).div_ceil(GROUP).max(1);
    let across = groups.min(MOST_GROUPS);
    (across * GROUP, [across, groups.div_ceil(across)])
}

fn indices(form: Fragments) -> (u32, &'static [u32]) {
    if form == Fragments::Intersected { INTERSECTED_INDICES } else { INTERPOLATED_INDICES }
}

/// Bytes of a record: `Record` in the shaders.
fn stride<const N: usize>(form: Fragments) -> u64 {
    let values = 4 * N as u64;
    let align = if N == 4 || form == Fragments::Intersected { 16 } else { 8 };
    let bytes = match form {
        Fragments::Intersected => 128 + 6 * values,
        Fragments::Interpolated | Fragments::Linear => 88u64.next_multiple_of(align) + 8 * values,
    };
    bytes.next_multiple_of(align)
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

/// The whole program.
fn program(
    variant: &Variant,
    association: &str,
    switches: &Switches,
    table: Option<&Lookup>,
    limits: Limits,
    arrays: &[Array],
) -> String {
    let mut text = shader::prelude(variant);
    for (name, value) in [("FAR", f64::from(FAR)), ("GROWTH", GROWTH), ("BESIDE", 1e-6)] {
        text += &format!("const {name} = {value:?}f;\n");
    }
    let form = match switches.fragments {
        Fragments::Intersected => "INTERSECTED",
        Fragments::Interpolated => "INTERPOLATED",
        Fragments::Linear => "LINEAR",
    };
    let corners = indices(switches.fragments).0;
    for (name, value) in [
        ("BY_DEPTH", switches.thickness == Thickness::Depth),
        ("DITHERED", switches.dither && switches.target == Target::Rgba8),
        ("ADDITIVE", switches.compositing == Compositing::Additive),
        ("HAS_ENDS", limits.ends),
        ("HAS_PLANES", limits.planes),
        ("BY_SPHERE", switches.order == Order::Circumsphere),
    ] {
        text += &format!("const {name} = {value};\n");
    }
    text += &format!(
        "const HIDDEN = {HIDDEN}u;\nconst IN_PARTS = {IN_PARTS}u;\nconst FILLED = {FILLED}u;\nconst MOST_WORK = {MOST_WORK}u;\n\
         const INTERSECTED = 0u;\nconst INTERPOLATED = 1u;\nconst LINEAR = 2u;\nconst FORM = {form};\nconst CORNERS = {corners}u;\n\
         const POINT = 0u;\nconst CORNER = 1u;\nconst CELL = 2u;\nconst ASSOCIATION = {association};\n"
    );
    text += arrays::POINT;
    let [records, drawing] = if form == "INTERSECTED" { INTERSECTED } else { INTERPOLATED };
    text += &shader::accessors(arrays);
    text += &table::constants(table, limits.plane_per_cell);
    text += &table::declarations(0, 6);
    [&text, shader::CELL, shader::INTEGRAL, TABLE, SHARED, CELLS, records, SHADE, drawing].join("\n")
}
#[cfg(test)]
mod tests;
