//! The engine on a device: what it holds, and the passes of a frame.
//!
//! 1. `classify` (compute) finds the cells that are seen, and a key of depth for each.
//! 2. These are put in order: by the keys, which the device sorts where it can; or that of the mesh, which the host finds.
//! 3. Batch by batch, in that order, `project` (compute) makes a primitive of each cell, and the primitives are drawn.

mod circumsphere;
mod drawing;
mod frame;
mod lines;
mod ordering;
mod primitive;
mod program;
mod second;

use super::{CellOrder, Fragments, ProjectionCounts, ProjectionOptions, Target};
use crate::error::{Error, Result};
use crate::field::Kind;
use crate::geometry::{TetMesh, Values};
use crate::gpu::buffers::{Buffer, Chunks};
use crate::gpu::raster::{self, Slot, Texture};
use crate::gpu::scene::DeviceScene;
use crate::gpu::second::Held;
use crate::gpu::shader::{ShaderArray, ShaderVariant};
use crate::gpu::sort::Sorter;
use crate::gpu::{DeviceChoice, Gpu, Part, arrays, function, table};
use crate::integral::{Exact, PreintegratedTable};
use crate::order::mpvo::Mpvo;
use crate::view::{Blend, View};
use bytemuck::{Pod, Zeroable};
use drawing::Canvas;
use frame::SeenView;
use ordering::{Ordered, Sequenced, Sequencing};
use primitive::Layout;
use program::{DrawSettings, Program, program};
pub(crate) use second::left;
use std::sync::Arc;
use std::time::Instant;
use wgpu::{BufferUsages as Usage, ShaderStages as Stages};

/// Primitives of one batch.
const BATCH: usize = 1 << 17;

/// The arrays that the compute stages read, and what WGSL calls their elements.
const ARRAYS: [(&str, &str); 3] = [("cells", "vec4u"), ("points", "Point"), ("values", "Value")];

/// Invocations of a compute group, and groups along one axis at most.
const GROUP: u32 = 64;
const MOST_GROUPS: u32 = 65_535;

/// `Part` in the shaders.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
struct Slice {
    first: u32,
    count: u32,
    row: u32,
    rank: u32,
}

/// The transfer function on the device.
struct FunctionBuffers {
    buffers: [Buffer; 3],
    lines: Texture,
    bins: Buffer,
}

/// A device, and what of the mesh, field and function it holds.
pub(crate) struct Project {
    gpu: Gpu,
    shared: wgpu::BindGroupLayout,
    own: wgpu::BindGroupLayout,
    cells: Option<Chunks>,
    points: Option<Chunks>,
    values: Option<Chunks>,
    function: Option<FunctionBuffers>,
    /// What is known of the order of the mesh, and the last one.
    mpvo: Mpvo,
    sequence: Option<Sequenced>,
    /// The last ones, that of this frame first.
    programs: Vec<Program>,
    canvas: Option<Canvas>,
    ordered: Option<Ordered>,
    table: table::TableCache,
    sorter: Option<Sorter>,
    /// What functions of two variables, and light, need; and what stands for the lines and bins of one variable then.
    second: Held,
    even: Option<(Texture, Buffer)>,
    /// Whether the device sorts where it can; tests have the host do it.
    sorts: bool,
    /// Entries of one buffer of an order that the host finds, a multiple of [`BATCH`].
    order_chunk: usize,
}

impl std::fmt::Debug for Project {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Project").field("adapter", &self.gpu.adapter.name).finish_non_exhaustive()
    }
}

impl Project {
    /// Opens the device that `choice` says; with [`DeviceChoice::Auto`] the first GPU, or else the first device in
    /// software.
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
        let shared = raster::layout(
            &gpu,
            Stages::COMPUTE | Stages::VERTEX_FRAGMENT,
            &[&[Uniform, Read, Read, Uniform, Read, Read], &table::SLOTS[..], &[Slot::Texels]].concat(),
        );
        let own = raster::layout(&gpu, Stages::COMPUTE, &[Uniform, Read, Write, Read, Write]);
        Ok(Project {
            gpu,
            shared,
            own,
            cells: None,
            points: None,
            values: None,
            function: None,
            mpvo: Mpvo::default(),
            sequence: None,
            programs: vec![],
            canvas: None,
            ordered: None,
            table: table::TableCache::default(),
            sorter: None,
            second: Held::default(),
            even: None,
            sorts: true,
            order_chunk: BATCH << 6,
        })
    }

    pub(crate) fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Sorts on the device, where it can, or on the host from now on.
    #[cfg(test)]
    pub(crate) fn sort_on_device(&mut self, sorts: bool) {
        (self.sorts, self.ordered) = (sorts, None);
    }

    /// Keeps so many entries of an order in one buffer from now on.
    #[cfg(test)]
    pub(crate) fn keep_in_chunks_of(&mut self, entries: usize) {
        (self.order_chunk, self.ordered) = (entries, None);
    }

    /// The device, whose limits tests lower.
    #[cfg(test)]
    pub(crate) fn gpu_mut(&mut self) -> &mut Gpu {
        &mut self.gpu
    }

    /// Takes `part` for changed.
    pub(crate) fn invalidate(&mut self, part: Part) {
        self.ordered = None;
        if matches!(part, Part::Mesh | Part::Points) {
            (self.mpvo, self.sequence) = (Mpvo::default(), None);
        }
        match part {
            Part::Mesh => {
                (self.cells, self.points, self.values) = (None, None, None);
                self.second = Held::default();
            }
            Part::Points => self.points = None,
            Part::Field => self.values = None,
            Part::Function => self.function = None,
        }
    }

    /// Hands over what the device does not hold yet.
    fn upload<const N: usize>(&mut self, geometry: &TetMesh, values: &Values<N>) -> Result<()> {
        self.upload_mesh(geometry)?;
        if self.values.is_none() {
            self.values = Some(arrays::values(&self.gpu, values)?);
        }
        Ok(())
    }

    /// Hands over what the device does not hold yet of the mesh alone.
    fn upload_mesh(&mut self, geometry: &TetMesh) -> Result<()> {
        let gpu = &self.gpu;
        if self.cells.is_none() {
            self.cells = Some(Chunks::new(gpu, "cells", &geometry.cells, |c| c.corners)?);
        }
        if self.points.is_none() {
            self.points = Some(arrays::points(gpu, geometry)?);
        }
        Ok(())
    }

    /// Has the device hold the function and `table`, or build that, unless it does.
    ///
    /// # Errors
    /// Those of [`table::TableCache::prepare`].
    pub(crate) fn prepare_table(&mut self, exact: &Exact<f32>, table: Option<&Arc<PreintegratedTable>>) -> Result<()> {
        let gpu = &self.gpu;
        let function = match self.function.take() {
            Some(function) => function,
            None => FunctionBuffers {
                buffers: function::upload(gpu, exact)?,
                lines: lines::image(gpu, exact)?,
                bins: Buffer::holding(gpu, "bins", &lines::bins(exact), Usage::STORAGE)?,
            },
        };
        self.table.prepare(gpu, table, &self.function.insert(function).buffers)
    }

    /// Draws a frame; premultiplied colours, row by row; for [`Blend::Maximum`] the largest values instead, as
    /// [`crate::traverse::gpu::Traverse::largest`] reads them.
    ///
    /// # Errors
    /// [`Error::Device`] if the device cannot blend into the target, and those of [`Gpu::check`] and [`Buffer::new`].
    pub(crate) fn render<const N: usize>(
        &mut self,
        scene: &DeviceScene<'_, N>,
        options: &ProjectionOptions,
    ) -> Result<(Vec<[f32; 4]>, ProjectionCounts)> {
        let DeviceScene { geometry, values, exact, table, view } = *scene;
        let is_maximum = view.blend() == Blend::Maximum;
        // Nothing is blended, and no segment integrated.
        let format = if is_maximum { wgpu::TextureFormat::Rgba32Float } else { self.format(options.target)? };
        let table = table.filter(|_| !is_maximum);
        self.second = Held::default();
        self.upload(geometry, values)?;
        self.prepare_table(exact, table)?;
        let association = arrays::association(values);
        let arrays = self.arrays()?;
        let seen = SeenView::new(geometry, view);
        let is_rare = options.fragments == Fragments::Intersected && (options.dithers() || seen.limits().any());
        let has_line = table.is_none() && !is_maximum && exact.kind != Kind::Pair;
        let layout = Layout::new(options.fragments, exact.kind.components(), has_line, is_rare);
        let variant = ShaderVariant { kind: exact.kind, direct: exact.direct };
        let mut limits = seen.limits();
        // In parallel views all segments of a cell are on one plane.
        let one_plane = table.is_some_and(|t| t.options().per_cell) || view.eye().is_none();
        limits.plane_per_cell = one_plane && options.fragments != Fragments::Intersected;
        let drawn = DrawSettings { options, blend: view.blend() };
        let source = program(&variant, association, drawn, &layout, table.map(|t| &**t), limits, &arrays);
        self.prepare_canvas(&layout, view.size(), format, is_maximum)?;
        self.compile(&arrays, source, drawn, layout, format, None)?;
        let FunctionBuffers { buffers, lines, bins } = self.function.as_ref().ok_or_else(unprepared)?;
        let frame = Pass::new(self, &seen, buffers, (lines, bins), &self.chunks()?, None)?;
        self.finish(geometry, view, &seen, frame, options)
    }

    /// Orders and draws the cells, with the program that was compiled last.
    fn finish(
        &mut self,
        geometry: &TetMesh,
        view: &View,
        seen: &SeenView,
        frame: Pass,
        options: &ProjectionOptions,
    ) -> Result<(Vec<[f32; 4]>, ProjectionCounts)> {
        let is_maximum = view.blend() == Blend::Maximum;
        // Without neighbours there is depth.
        let by = match options.order {
            // The largest value needs none.
            _ if is_maximum => CellOrder::None,
            order if geometry.is_connected() || order.rule().is_none() => order,
            _ => CellOrder::Depth,
        };
        let mut counts = ProjectionCounts { order: by, ..ProjectionCounts::default() };
        let splits = options.fragments != Fragments::Intersected && view.eye().is_some();
        let asked = Sequencing { by, splits, all: is_maximum };
        if !self.ordered.as_ref().is_some_and(|o| o.holds_for(seen, asked)) {
            let start = Instant::now();
            self.ordered = None;
            if let Some(rule) = by.rule() {
                self.find_sequence(geometry, view, seen, rule);
            }
            self.ordered = Some(self.order(&frame, seen, geometry, asked)?);
            counts.sorts = 1;
            counts.order_ms = start.elapsed().as_secs_f64() * 1e3;
        }
        if let Some(sequence) = self.sequence.as_ref().map(|s| &s.cells).filter(|_| by.rule().is_some()) {
            (counts.cycles, counts.cycle_cells) = (sequence.cycles, sequence.cycle_cells);
            (counts.cuts, counts.overlapping) = (sequence.cuts, sequence.overlapping);
        }
        self.draw(&frame, view, &mut counts).map(|pixels| (pixels, counts))
    }

    /// The pixels of the last frame, ascending, whose cells are not in order: see [`crate::order::mpvo::Sequence::disordered`].
    pub(crate) fn disordered(&self) -> &[u32] {
        let of_mesh = self.ordered.as_ref().is_some_and(Ordered::is_of_mesh);
        self.sequence.as_ref().filter(|_| of_mesh).map_or(&[], |s| &s.cells.disordered)
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
    fn arrays(&self) -> Result<[ShaderArray; 3]> {
        Ok(arrays::named(ARRAYS, self.chunks()?))
    }

    pub(crate) fn chunks(&self) -> Result<[&Chunks; 3]> {
        match (&self.cells, &self.points, &self.values) {
            (Some(cells), Some(points), Some(values)) => Ok([cells, points, values]),
            _ => Err(Error::Render("the device does not hold the mesh".into())),
        }
    }

    fn own_group(
        &self,
        frame: &Pass,
        slice: wgpu::BindingResource,
        keys: &Buffer,
        order: &Buffer,
        primitives: wgpu::BindingResource,
    ) -> wgpu::BindGroup {
        let [keys, order] = [keys, order].map(|b| b.raw.as_entire_binding());
        raster::group(&self.gpu, &self.own, [slice, frame.bins.as_entire_binding(), keys, order, primitives])
    }
}

/// The groups that all passes of a frame share, and the buffers in them.
struct Pass {
    shared: wgpu::BindGroup,
    arrays: wgpu::BindGroup,
    /// The function of two variables, for fragments.
    second: Option<wgpu::BindGroup>,
    bins: wgpu::Buffer,
    _buffers: [Buffer; 3],
}

impl Pass {
    fn new(
        project: &Project,
        seen: &SeenView,
        function: &[Buffer; 3],
        (lines, bins): (&Texture, &Buffer),
        chunks: &[&Chunks],
        second: Option<wgpu::BindGroup>,
    ) -> Result<Self> {
        let gpu = &project.gpu;
        let (Some(program), Some(table)) = (project.programs.first(), project.table.get()) else {
            return Err(unprepared());
        };
        let buffers = [
            Buffer::holding(gpu, "frame", &[seen.frame], Usage::UNIFORM)?,
            Buffer::holding(gpu, "planes", &seen.planes, Usage::STORAGE)?,
            Buffer::holding(gpu, "ends", &seen.ends, Usage::STORAGE)?,
        ];
        let shared = function.iter().chain(&buffers).map(|b| b.raw.as_entire_binding()).chain(table.bindings());
        let shared = shared.chain([wgpu::BindingResource::TextureView(&lines.view)]);
        let arrays = chunks.iter().flat_map(|c| &c.buffers);
        Ok(Pass {
            shared: raster::group(gpu, &project.shared, shared),
            arrays: raster::group_of(gpu, &program.arrays, arrays),
            second,
            bins: bins.raw.clone(),
            _buffers: buffers,
        })
    }
}

fn unprepared() -> Error {
    Error::Render("the device is not prepared for a frame".into())
}

/// Invocations of a row, and groups of a dispatch that is as many rows as `count` invocations need.
fn groups_of(count: usize) -> (u32, [u32; 2]) {
    let groups = (count as u32).div_ceil(GROUP).max(1);
    let across = groups.min(MOST_GROUPS);
    (across * GROUP, [across, groups.div_ceil(across)])
}

#[cfg(test)]
mod tests;
