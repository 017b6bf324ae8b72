//! The walk on a GPU: what `shaders/traverse.wgsl` needs, handed over once and kept until it changes.

mod second;

use super::cpu::{Counts, least_transmittance};
use crate::error::{Error, Result};
use crate::geometry::boundary::{BoundaryFace, LEAF};
use crate::geometry::{Cell, TetMesh, Values};
use crate::gpu::bands::{Bands, Drawn};
use crate::gpu::buffers::{Buffer, Chunks};
use crate::gpu::function;
use crate::gpu::raster::Slot;
use crate::gpu::rays::{self, FAR};
use crate::gpu::scene::DeviceScene;
use crate::gpu::second::Held;
use crate::gpu::shader::{self, ShaderArray, ShaderVariant};
use crate::gpu::table::{self, TABLE};
use crate::gpu::{Gpu, Part, arrays, raster};
use crate::integral::{Exact, PreintegratedTable};
use crate::mesh::faces::BOUNDARY;
use crate::view::{Blend, View};
use bytemuck::{Pod, Zeroable};
use glam::DVec3;
use rayon::prelude::*;
use std::ops::ControlFlow;
use std::sync::Arc;
use wgpu::ShaderStages as Stages;

const TRAVERSE: &str = include_str!("../../shaders/traverse.wgsl");

/// The arrays that the walk reads, and what WGSL calls their elements.
const ARRAYS: [(&str, &str); 6] = [
    ("cells", "Cell"),
    ("faces", "Outer"),
    ("points", "Point"),
    ("volumes", "f32"),
    ("boxes", "Box"),
    ("values", "Value"),
];

/// How a segment joins the light before it.
const ADD_EXACT: &str = "fn add(front: Value, back: Value, length: f32) { add_segment(front, back, length); }\n";
const ADD_TABULATED: &str = "fn add(front: Value, back: Value, length: f32) { add_tabulated(front, back, length); }\n";

/// Rays of one dispatch at most: a driver ends work that takes seconds.
const RAYS: u64 = 1 << 21;

/// Loop iterations of one ray that llvmpipe surely makes: an eighth of those that 8 rays may make together.
const LLVMPIPE_WORK: u32 = 4000;

/// Opacity of a pixel whose ray the device did not finish.
const UNFINISHED: f32 = -2e30;

/// Added to the boxes of the hierarchy on all sides: above all rounding in their intersection with a ray, as eyes that
/// rays start from are at most [`NEAR_EYE`] away.
const MARGIN: f32 = 2e-6;

/// How well lengths along a ray are known when they come from the depths of a cell's corners, relative to the cell's
/// extent. Lengths that come from its volume are kept within this of them.
const BLUR: f32 = 5e-7;

/// Up to this distance from the mesh's centre, in normalised units, rays start at the eye.
const NEAR_EYE: f64 = 2.0;

/// Entries that a ray finds at a time.
const AHEAD: usize = 8;

/// A ray this close to an edge of the boundary, relative to the face's extent across it, is tried again beside its
/// place: above most rounding of places across a ray.
const CLOSE: f32 = 2e-7;

/// How far rays that are traced again are moved, in normalised units.
const PERTURBATION: f32 = 2e-7;

/// `RayUniforms` in the shader.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct RayUniforms {
    origin: [[[f32; 4]; 2]; 3],
    direction: [[[f32; 4]; 2]; 3],
    size: [u32; 2],
    first_row: u32,
    rows: u32,
    near: f32,
    far: f32,
    planes: u32,
    has_ends: u32,
    leaves: u32,
    faces: u32,
    most_steps: u32,
    most_work: u32,
}

/// `Outer` in the shader.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Outer {
    points: [u32; 3],
    cell: u32,
}

/// `Box` in the shader.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Bounds {
    low: [f32; 4],
    high: [f32; 4],
}

/// `Counts` in the shader.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct RawCounts {
    steps: u32,
    carry: u32,
    retraced: u32,
    panels: u32,
}

/// A frame as the device drew it.
pub(crate) struct WalkedFrame {
    /// Premultiplied colours; for [`Blend::Maximum`] the largest values instead.
    pub(crate) pixels: Vec<[f32; 4]>,
    pub(crate) counts: Counts,
    /// What the device itself says that the frame took, in ms.
    pub(crate) device_ms: Option<f64>,
}

/// A device, and what of the mesh, field and function it holds.
#[derive(Debug)]
pub(crate) struct Traverse {
    gpu: Gpu,
    layout: wgpu::BindGroupLayout,
    cells: Option<[Chunks; 2]>,
    points: Option<[Chunks; 3]>,
    values: Option<Chunks>,
    function: Option<[Buffer; 3]>,
    program: Option<(String, wgpu::ComputePipeline, wgpu::BindGroupLayout)>,
    /// Tables have a group of their own, in programs that read them.
    tables: wgpu::BindGroupLayout,
    table: table::TableCache,
    /// What functions of two variables, and light, need.
    second: Held,
}

impl Traverse {
    pub(crate) fn new(gpu: Gpu) -> Self {
        use Slot::{Read, Uniform, Write};
        let own = [Uniform, Read, Read, Uniform, Read, Read, Write, Write];
        let [layout, tables] = [&own[..], &table::SLOTS[..]].map(|slots| raster::layout(&gpu, Stages::COMPUTE, slots));
        let (table, second) = (table::TableCache::default(), Held::default());
        Traverse {
            gpu,
            layout,
            cells: None,
            points: None,
            values: None,
            function: None,
            program: None,
            tables,
            table,
            second,
        }
    }

    pub(crate) fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// The device, whose limits tests lower.
    #[cfg(test)]
    pub(crate) fn gpu_mut(&mut self) -> &mut Gpu {
        &mut self.gpu
    }

    /// Takes `part` for changed.
    pub(crate) fn invalidate(&mut self, part: Part) {
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
    ///
    /// # Errors
    /// Those of [`Gpu::check`] and [`Buffer::new`].
    pub(crate) fn upload<const N: usize>(
        &mut self,
        geometry: &TetMesh,
        values: &Values<N>,
        exact: &Exact<f32>,
    ) -> Result<()> {
        self.upload_mesh(geometry)?;
        let gpu = &self.gpu;
        if self.values.is_none() {
            self.values = Some(arrays::values(gpu, values)?);
        }
        if self.function.is_none() {
            self.function = Some(function::upload(gpu, exact)?);
        }
        Ok(())
    }

    /// Hands over what the device does not hold yet of the mesh alone.
    fn upload_mesh(&mut self, geometry: &TetMesh) -> Result<()> {
        let gpu = &self.gpu;
        if self.cells.is_none() {
            let cells = Chunks::new(gpu, "cells", &geometry.cells, |c| *c)?;
            let outer = |f: &BoundaryFace| Outer { points: f.points, cell: f.cell };
            self.cells = Some([cells, Chunks::new(gpu, "faces", &geometry.boundary.faces, outer)?]);
        }
        if self.points.is_none() {
            let points = arrays::points(gpu, geometry)?;
            let volume = |c: &Cell| six_volumes(c.corners.map(|p| geometry.points[p as usize]));
            let volumes = Chunks::new(gpu, "volumes", &geometry.cells, volume)?;
            let boxes = Chunks::new(gpu, "boxes", geometry.boundary.boxes(), outward)?;
            self.points = Some([points, volumes, boxes]);
        }
        Ok(())
    }

    /// Has the device hold `table`, or build it, unless it does.
    ///
    /// # Errors
    /// Those of [`table::TableCache::prepare`].
    pub(crate) fn prepare_table(&mut self, exact: &Exact<f32>, table: Option<&Arc<PreintegratedTable>>) -> Result<()> {
        let function = match self.function.take() {
            Some(function) => function,
            None => function::upload(&self.gpu, exact)?,
        };
        self.table.prepare(&self.gpu, table, self.function.insert(function))
    }

    /// Draws a frame.
    ///
    /// # Errors
    /// Those of [`Gpu::check`] and [`Buffer::new`].
    pub(crate) fn render<const N: usize>(&mut self, scene: &DeviceScene<'_, N>) -> Result<WalkedFrame> {
        let DeviceScene { geometry, values, exact, table, view } = *scene;
        self.second = Held::default();
        self.upload(geometry, values, exact)?;
        self.prepare_table(exact, table)?;
        let association = arrays::association(values);
        let arrays = self.arrays()?;
        let variant = ShaderVariant { kind: exact.kind, direct: exact.direct };
        let source = program(&variant, association, view.blend(), table.map(|t| &**t), &arrays);
        let tables = table.is_some().then_some(self.tables.clone());
        self.compile(source, &arrays, tables.as_ref())?;
        let own = self.table.get().filter(|_| table.is_some());
        let tables = own.map(|t| raster::group(&self.gpu, &self.tables, t.bindings()));
        let function = self.function.as_ref().ok_or_else(unprepared)?;
        self.draw(geometry, function, &self.chunks()?, tables.as_ref(), view)
    }

    /// Compiles a program that reads `arrays`, and a third group, unless it is the last one.
    fn compile(&mut self, source: String, arrays: &[ShaderArray], third: Option<&wgpu::BindGroupLayout>) -> Result<()> {
        if self.program.as_ref().is_some_and(|p| p.0 == source) {
            return Ok(());
        }
        let bindings = arrays.iter().map(|a| a.chunks).sum();
        let gpu = &self.gpu;
        let layout = raster::layout(gpu, Stages::COMPUTE, &vec![Slot::Read; bindings]);
        let layouts: Vec<_> = [&self.layout, &layout].into_iter().chain(third).map(Some).collect();
        let module = raster::module(gpu, "traverse", &source);
        let pipeline = raster::compute(gpu, &module, "main", &raster::pipeline_layout(gpu, &layouts));
        gpu.check()?;
        self.program = Some((source, pipeline, layout));
        Ok(())
    }

    /// The pixels whose rays the device did not finish, as indices.
    pub(crate) fn unfinished(pixels: &[[f32; 4]]) -> Vec<usize> {
        pixels.par_iter().enumerate().filter(|(_, p)| p[3] == UNFINISHED).map(|(i, _)| i).collect()
    }

    /// The largest values along the ray of a pixel drawn with [`Blend::Maximum`]; none if it met nothing.
    pub(crate) fn largest<const N: usize>(pixel: &[f32; 4]) -> Option<[f32; N]> {
        // The first values come first, the last one last.
        let values = std::array::from_fn(|k| pixel[if k + 1 == N { 3 } else { k }]);
        (pixel[3] > -FAR).then_some(values)
    }

    /// The arrays of group 1, in the order of [`Self::chunks`].
    fn arrays(&self) -> Result<[ShaderArray; 6]> {
        Ok(arrays::named(ARRAYS, self.chunks()?))
    }

    pub(crate) fn chunks(&self) -> Result<[&Chunks; 6]> {
        match (&self.cells, &self.points, &self.values) {
            (Some([cells, faces]), Some([points, volumes, boxes]), Some(values)) => {
                Ok([cells, faces, points, volumes, boxes, values])
            }
            _ => Err(unprepared()),
        }
    }

    /// Draws with the program that was compiled last: `function` in its first group, `chunks` in the second, and the `third`.
    fn draw(
        &self,
        geometry: &TetMesh,
        function: &[Buffer; 3],
        chunks: &[&Chunks],
        third: Option<&wgpu::BindGroup>,
        view: &View,
    ) -> Result<WalkedFrame> {
        let gpu = &self.gpu;
        let (_, pipeline, group_layout) = self.program.as_ref().ok_or_else(unprepared)?;
        let [w, h] = view.size();
        let fan = view.fan(geometry.centre, geometry.scale, NEAR_EYE);
        let planes = rays::planes(view, geometry, DVec3::ZERO);
        let ends = rays::ends(view, &fan, geometry.scale, true);
        let frame = RayUniforms {
            origin: rays::affine(fan.by_pixel(fan.origin, [w, h])),
            direction: rays::affine(fan.by_pixel(fan.direction, [w, h])),
            size: [w, h],
            first_row: 0,
            rows: 0,
            near: rays::limit(fan.near),
            far: rays::limit(fan.far),
            planes: planes.len() as u32,
            has_ends: u32::from(!ends.is_empty()),
            leaves: geometry.boundary.boxes().len().div_ceil(2) as u32,
            faces: geometry.boundary.faces.len() as u32,
            most_steps: geometry.cells.len() as u32,
            most_work: if gpu.adapter.is_software() { LLVMPIPE_WORK } else { u32::MAX },
        };
        let bands = Bands::new::<RayUniforms>(gpu, view.size(), RAYS, &planes, &ends)?;
        let [parameters, knots, buckets] = function;
        let own = [parameters, knots, buckets].into_iter().chain(bands.bindings());
        let own = raster::group_of(gpu, &self.layout, own);
        let shared = raster::group_of(gpu, group_layout, chunks.iter().flat_map(|c| &c.buffers));
        let groups: Vec<_> = [&own, &shared].into_iter().chain(third).collect();
        let mut counts = Counts::default();
        let band = |first_row, rows| RayUniforms { first_row, rows, ..frame };
        let count = |read: [u32; 4]| {
            let c: RawCounts = bytemuck::cast(read);
            counts.steps += u64::from(c.carry) << 32 | u64::from(c.steps);
            counts.retraced += u64::from(c.retraced);
            counts.panels += u64::from(c.panels);
        };
        let Drawn { pixels, device_ms } = bands.draw(pipeline, &groups, band, count, &|_| ControlFlow::Continue(()))?;
        Ok(WalkedFrame { pixels, counts, device_ms })
    }
}

fn unprepared() -> Error {
    Error::Render("the device is not prepared for a frame".into())
}

/// The whole program.
fn program(
    variant: &ShaderVariant,
    association: &str,
    blend: Blend,
    table: Option<&PreintegratedTable>,
    arrays: &[ShaderArray],
) -> String {
    let mut text = constants(variant, association, blend, arrays);
    let walk = shader::with(TRAVERSE, &[]);
    if table.is_none() {
        text += ADD_EXACT;
        return [&text, shader::CELL, shader::INTEGRAL, &walk].join("\n");
    }
    text += ADD_TABULATED;
    text += &table::constants(table, false);
    text += &table::declarations(2, 0);
    [&text, shader::CELL, shader::INTEGRAL, TABLE, &walk].join("\n")
}

/// What precedes all programs: constants, and the mesh's arrays.
fn constants(variant: &ShaderVariant, association: &str, blend: Blend, arrays: &[ShaderArray]) -> String {
    let mut text = shader::prelude(variant);
    for (name, value) in [
        ("FAR", f64::from(FAR)),
        ("UNFINISHED", f64::from(UNFINISHED)),
        ("INVISIBLE", f64::from(arrays::INVISIBLE)),
        ("BLUR", f64::from(BLUR)),
        ("SLACK", f64::from(MARGIN)),
        ("CLOSE", f64::from(CLOSE)),
        ("PERTURBATION", f64::from(PERTURBATION)),
        ("LEAST_TRANSMITTANCE", f64::from(least_transmittance(variant.direct))),
    ] {
        text += &format!("const {name} = {value:?}f;\n");
    }
    text += &format!(
        "const NONE = {BOUNDARY}u;\nconst LEAF = {LEAF}u;\nconst AHEAD = {AHEAD}u;\nconst MAXIMUM = {};\n",
        blend == Blend::Maximum
    );
    text += "const POINT = 0u;\nconst CORNER = 1u;\nconst CELL = 2u;\n";
    text += &format!("const ASSOCIATION = {association};\n\n");
    text += arrays::POINT;
    text += &shader::accessors(arrays);
    text
}

/// Six times the volume of a tetrahedron.
fn six_volumes([a, b, c, d]: [DVec3; 4]) -> f32 {
    (b - a).cross(c - a).dot(d - a).abs() as f32
}

/// A box in f32 that holds one in f64 with a margin.
fn outward([low, high]: &[DVec3; 2]) -> Bounds {
    if low.x > high.x {
        return Bounds { low: [1.0; 4], high: [-1.0; 4] };
    }
    Bounds {
        low: (low.as_vec3() - MARGIN).extend(0.0).to_array(),
        high: (high.as_vec3() + MARGIN).extend(0.0).to_array(),
    }
}

#[cfg(test)]
mod tests;
