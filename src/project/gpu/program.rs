//! What the programs are compiled from, and for.

use super::Project;
use super::frame::{GROWTH, Limits};
use super::lines::{BINS, LINES_ACROSS};
use super::primitive::Layout;
use crate::error::Result;
use crate::field::Kind;
use crate::gpu::arrays;
use crate::gpu::raster::{self, Slot};
use crate::gpu::rays::FAR;
use crate::gpu::second;
use crate::gpu::shader::{self, ShaderArray, ShaderVariant};
use crate::gpu::table::{self, TABLE};
use crate::integral::PreintegratedTable;
use crate::integral::second::Rows;
use crate::order::depth::HIDDEN;
use crate::order::{MOST_PARTS, PART};
use crate::project::{Compositing, Fragments, ProjectionOptions, Thickness};
use crate::view::Blend;
use std::fmt::Write;
use wgpu::ShaderStages as Stages;

const SHARED: &str = include_str!("../../../shaders/project.wgsl");
const CELLS: &str = include_str!("../../../shaders/project_cells.wgsl");
const LINES: &str = include_str!("../../../shaders/project_lines.wgsl");
const SHADE: &str = include_str!("../../../shaders/project_shade.wgsl");
const SECOND: &str = include_str!("../../../shaders/project_second.wgsl");

/// For each form: its primitives, and how they are drawn.
const INTERSECTED: [&str; 2] = [
    include_str!("../../../shaders/project_intersected.wgsl"),
    include_str!("../../../shaders/project_intersected_draw.wgsl"),
];

const INTERPOLATED: [&str; 2] = [
    include_str!("../../../shaders/project_interpolated.wgsl"),
    include_str!("../../../shaders/project_interpolated_draw.wgsl"),
];

/// What a fragment is: light; or the larger of its two values, and a depth that rises with it. Of the value's bits, in a sequence
/// that ascends, 29 fit between 0 and 1.
const BLENDED: &str = "struct Fragment { @location(0) color: vec4f }
fn fragment_of(front: Value, back: Value, length: f32, attributes: Attributes, at: vec2f, rank: u32) -> Fragment {
    return Fragment(quantised(colored(front, back, length, attributes), at, rank));
}\n";
const LARGEST: &str = "struct Fragment { @location(0) values: vec4f, @builtin(frag_depth) depth: f32 }
fn fragment_of(front: Value, back: Value, length: f32, attributes: Attributes, at: vec2f, rank: u32) -> Fragment {
    let is_front = last_of(front) > last_of(back);
    let largest = select(back, front, is_front);
    let bits = bitcast<u32>(last_of(largest));
    let ascending = select(bits | 0x80000000u, ~bits, (bits >> 31u) == 1u);
    return Fragment(padded(largest), bitcast<f32>(0x1f800000u + (ascending >> 3u)));
}\n";

/// How a frame is drawn.
#[derive(Clone, Copy)]
pub(super) struct DrawSettings<'a> {
    pub(super) options: &'a ProjectionOptions,
    pub(super) blend: Blend,
}

/// Programs that are kept: edits of the function, and what cuts rays off, go to and fro between some.
const KEPT: usize = 4;

/// Pixels along a side of the blocks that rasterisers do at once.
const BLOCK: f64 = 2.0;

/// Opacity of fragments that f32 is too coarse for: 16-bit floats hold it.
const COARSE: f32 = -3e4;

/// Opacities below this are of pixels with such fragments.
pub(super) const LEFT: f32 = -0.5;

/// Loop iterations of a fragment that llvmpipe surely makes: see `traverse::gpu`.
const MOST_WORK: u32 = 8000;

/// What the programs are compiled for.
pub(super) struct Program {
    source: String,
    format: wgpu::TextureFormat,
    compositing: Compositing,
    pub(super) layout: Layout,
    pub(super) arrays: wgpu::BindGroupLayout,
    pub(super) classify: wgpu::ComputePipeline,
    pub(super) project: wgpu::ComputePipeline,
    pub(super) draw: wgpu::RenderPipeline,
}

impl Project {
    pub(super) fn compile(
        &mut self,
        arrays: &[ShaderArray],
        source: String,
        drawn: DrawSettings,
        layout: Layout,
        format: wgpu::TextureFormat,
        second: Option<&wgpu::BindGroupLayout>,
    ) -> Result<()> {
        let DrawSettings { options, blend } = drawn;
        let compositing = options.compositing;
        let same = |p: &Program| p.source == source && p.format == format && p.compositing == compositing;
        if let Some(known) = self.programs.iter().position(same) {
            self.programs[..=known].rotate_right(1);
            return Ok(());
        }
        let gpu = &self.gpu;
        let bindings = arrays.iter().map(|a| a.chunks).sum();
        let array_layout = raster::layout(gpu, Stages::COMPUTE, &vec![Slot::Read; bindings]);
        let module = raster::module(gpu, "project", &source);
        let cells = raster::pipeline_layout(gpu, &[Some(&self.shared), Some(&array_layout), Some(&self.own)]);
        let groups: Vec<_> = [&self.shared].into_iter().chain(second).map(Some).collect();
        let drawing = raster::pipeline_layout(gpu, &groups);
        let blend = (blend == Blend::Composite).then_some(wgpu::BlendComponent {
            src_factor: wgpu::BlendFactor::One,
            dst_factor: match compositing {
                Compositing::Over => wgpu::BlendFactor::OneMinusSrcAlpha,
                Compositing::Additive => wgpu::BlendFactor::One,
            },
            operation: wgpu::BlendOperation::Add,
        });
        // The outline of an intersected cell may be no more than that: grown, it need not turn one way.
        let culled = (options.fragments != Fragments::Intersected).then_some(wgpu::Face::Back);
        let program = Program {
            classify: raster::compute(gpu, &module, "classify", &cells),
            project: raster::compute(gpu, &module, "project_all", &cells),
            draw: raster::render(
                gpu,
                &module,
                &drawing,
                (layout.part_bytes(), &layout.vertex_attributes()),
                format,
                blend,
                culled,
            ),
            layout,
            arrays: array_layout,
            source,
            format,
            compositing,
        };
        gpu.check()?;
        self.programs.insert(0, program);
        self.programs.truncate(KEPT);
        Ok(())
    }
}

/// The whole program.
pub(super) fn program(
    variant: &ShaderVariant,
    association: &str,
    DrawSettings { options, blend }: DrawSettings,
    layout: &Layout,
    table: Option<&PreintegratedTable>,
    limits: Limits,
    arrays: &[ShaderArray],
) -> String {
    let drawn = DrawSettings { options, blend };
    let text = constants(variant, association, drawn, layout, table, limits, arrays);
    joined(&text, options, &[], ["", ""])
}

/// The whole program for functions of two variables, and light.
pub(super) fn program_of_two(
    rows: &Rows,
    association: &str,
    drawn: DrawSettings,
    layout: &Layout,
    limits: Limits,
    arrays: &[ShaderArray],
) -> String {
    let variant = ShaderVariant { kind: Kind::Pair, direct: rows.forms.direct };
    let mut text = String::from(second::VECTOR);
    text += &constants(&variant, association, drawn, layout, None, limits, arrays);
    let _ = writeln!(text, "const COARSE = {COARSE:?}f;");
    let defined = second::defined(&rows.forms);
    // Fragments have no other second group.
    let integral = second::program(rows).replace("@group(2)", "@group(1)");
    joined(&text, drawn.options, &defined, [&integral, SECOND])
}

/// All parts of a program behind what precedes it; last what finds the integral of two variables, and what asks for it.
fn joined(text: &str, options: &ProjectionOptions, defined: &[&str], [integral, second]: [&str; 2]) -> String {
    // How primitives are made, and drawn.
    let [primitives, drawing] = if options.fragments == Fragments::Intersected { INTERSECTED } else { INTERPOLATED };
    let [cells, primitives, drawing, second] = [CELLS, primitives, drawing, second].map(|of| shader::with(of, defined));
    let shared = [text, shader::CELL, shader::INTEGRAL, integral, TABLE, SHARED, LINES];
    [&shared[..], &[&cells, &primitives, SHADE, &drawing, &second]].concat().join("\n")
}

/// What precedes all programs: constants, primitives and the mesh's arrays.
fn constants(
    variant: &ShaderVariant,
    association: &str,
    DrawSettings { options, blend }: DrawSettings,
    layout: &Layout,
    table: Option<&PreintegratedTable>,
    limits: Limits,
    arrays: &[ShaderArray],
) -> String {
    let mut text = shader::prelude(variant);
    // Twice the area of the blocks that a line of unit length passes, by its mean direction.
    let doubled = 2.0 * BLOCK * 4.0 / std::f64::consts::PI;
    for (name, value) in
        [("FAR", f64::from(FAR)), ("GROWTH", f64::from(GROWTH)), ("BESIDE", 1e-18), ("DOUBLED", doubled)]
    {
        text += &format!("const {name} = {value:?}f;\n");
    }
    let form = match options.fragments {
        Fragments::Intersected => "INTERSECTED",
        Fragments::Interpolated => "INTERPOLATED",
        Fragments::Linear => "LINEAR",
    };
    for (name, value) in [
        ("BY_DEPTH", options.thickness == Thickness::Depth),
        ("DITHERED", options.dithers()),
        ("ADDITIVE", options.compositing == Compositing::Additive),
        ("HAS_ENDS", limits.ends),
        ("HAS_PLANES", limits.planes),
        ("IS_CLIPPED", limits.range),
        ("PERSPECTIVE", limits.perspective),
        // Of two variables, the bits of cells say what may be seen.
        ("SHOWS_ALL", blend == Blend::Maximum || layout.is_of_two()),
    ] {
        text += &format!("const {name} = {value};\n");
    }
    text += &format!(
        "const LINES_ACROSS = {LINES_ACROSS}u;\nconst HIDDEN = {HIDDEN}u;\nconst BINS = {BINS}u;\nconst PART = {PART}u;\nconst MOST_PARTS = {MOST_PARTS}u;\nconst MOST_WORK = {MOST_WORK}u;\n\
         const INTERSECTED = 0u;\nconst INTERPOLATED = 1u;\nconst LINEAR = 2u;\nconst FORM = {form};\n\
         const POINT = 0u;\nconst CORNER = 1u;\nconst CELL = 2u;\nconst ASSOCIATION = {association};\n"
    );
    text += arrays::POINT;
    text += &layout.wgsl();
    text += &shader::accessors(arrays);
    text += &table::constants(table, limits.plane_per_cell);
    text += &table::declarations(0, 6);
    text += if blend == Blend::Maximum { LARGEST } else { BLENDED };
    text
}
