//! What of the transfer function comes with the record of a cell.
//!
//! A look-up of the function is dear in software. Most cells have no more than three lines of it, and are thin: then a
//! record holds these, and fragments go through those that they cross. Cells of more lines are drawn in parts, each between
//! two of the values where lines meet.

use crate::error::Result;
use crate::field::Kind;
use crate::geometry::{Geometry, Values};
use crate::gpu::Gpu;
use crate::gpu::raster::Texture;
use crate::gpu::rays::FAR;
use crate::integral::{Exact, Knots, Line, MILD};
use crate::order::MOST_PARTS;
use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

const STRAIGHT: &str = include_str!("../../../shaders/project_straight.wgsl");

/// Optical depth of the longest segment up to which fragments go straight, and up to which they take slight pieces of a
/// series that is short.
const DEEPEST: f64 = 64.0;
const SLIGHT: f64 = 2.0;

/// The greatest depth of a piece that is slight.
const SLIGHT_PIECE: f64 = 0.3;

/// The most lines that a record holds.
const MOST: usize = 3;

/// Knots closer than this ask for values that are accurate relative to themselves.
const SHARP: f32 = 1e-3;

/// Lines in a row of the image of them.
pub(super) const LINES_ACROSS: usize = 4096;

/// Equal bins of the values' range, [−1, 1].
pub(super) const BINS: usize = 1024;

/// What of the function comes with a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Lines {
    /// Nothing: fragments look up a table, or functions of several components.
    None,
    /// The number of the least value's line: fragments look that up and those above one by one.
    First,
    /// So many lines, one to three. Cells may be drawn in parts; values are counted from the least.
    All { count: usize, slight: bool },
}

/// The greatest extent of cells, in space and in values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Extent {
    /// The longest edge, in normalised units.
    edge: f64,
    /// The greatest difference between two values of the last component in a cell, and the mean.
    values: f32,
    mean: f32,
}

impl Extent {
    pub(super) fn new<const N: usize>(geometry: &Geometry, values: &Values<N>) -> Self {
        let between = |v: [f32; 4]| v.into_iter().fold(f32::MIN, f32::max) - v.into_iter().fold(f32::MAX, f32::min);
        let extent = |cells: &(dyn Fn(usize) -> [f32; 4] + Sync), n: usize| {
            // Cells with a value that is not finite are not drawn.
            let all = (0..n).into_par_iter().map(|i| between(cells(i))).filter(|d| d.is_finite());
            all.map(|d| (d, f64::from(d), 1.0)).reduce(|| (0.0, 0.0, 0.0), |a, b| (a.0.max(b.0), a.1 + b.1, a.2 + b.2))
        };
        let (greatest, sum, count) = match values {
            Values::Cell(_) => (0.0, 0.0, 0.0),
            Values::Point(v) => {
                let at = |i: usize| geometry.cells[i].corners.map(|p| v[p as usize][N - 1]);
                extent(&at, geometry.cells.len())
            }
            Values::Corner(v) => extent(&|i: usize| v[i].map(|v| v[N - 1]), v.len()),
        };
        Extent { edge: geometry.longest_edge(), values: greatest, mean: (sum / f64::max(count, 1.0)) as f32 }
    }
}

impl Lines {
    /// For look-ups by fragments.
    pub(super) fn looked_up(kind: Kind) -> Self {
        if kind == Kind::Pair { Lines::None } else { Lines::First }
    }

    /// What suits a function and cells of this extent. Cells can be drawn in parts if `in_parts`.
    pub(super) fn new(exact: &Exact<f32>, extent: Extent, in_parts: bool) -> Self {
        if exact.kind != Kind::Scalar {
            return Lines::looked_up(exact.kind);
        }
        // Shaders count the lines of bins, with one bin more on both sides.
        let within = |values: f32| exact.opacity.lines_within(values + 5.0 * (2.0 / BINS as f32));
        let depth = f64::from(exact.opacity.steepest()) * extent.edge;
        let most = if in_parts { MOST * MOST_PARTS as usize } else { MOST };
        // Counted from a cell's least value, others are known to 1e-7 only.
        if extent.values > 4.0 || exact.opacity.is_sharp(SHARP) {
            return Lines::looked_up(exact.kind);
        }
        match within(extent.values) {
            lines if depth <= DEEPEST && lines <= most && within(extent.mean) <= MOST => {
                Lines::All { count: lines.min(MOST), slight: depth <= SLIGHT }
            }
            _ => Lines::looked_up(exact.kind),
        }
    }

    /// The words that they take in a record.
    pub(super) fn words(self) -> usize {
        match self {
            Lines::None => 0,
            Lines::First => 1,
            Lines::All { count, .. } => 2 * count + 1,
        }
    }

    pub(super) fn are_all(self) -> bool {
        matches!(self, Lines::All { .. })
    }

    /// `lines_between`, which finds the words for a part of a cell, and `integrated`, the exact integral of a segment by
    /// them, the first being words[at].
    pub(super) fn wgsl(self, at: usize, rare: bool) -> String {
        let (lines, find, integral) = match self {
            Lines::None => {
                let integral = "light = vec4f(0.0, 0.0, 0.0, 1.0);
                    add_segment(front, back, length);
                    return vec4f(light.xyz, 1.0 - light.w);";
                (0, String::new(), integral)
            }
            Lines::First => {
                let find = "fn lines_between(low: f32, high: f32, eye: f32, piece: u32) -> array<vec4f, 1> {
                    return array<vec4f, 1>(vec4f(f32(line_at(low, high)), 0.0, 0.0, 0.0));
                }";
                (0, find.into(), "return by_lookups(front, back, length, u32(words[LINES_AT].x));")
            }
            Lines::All { count, slight } => {
                let greatest = if slight { SLIGHT_PIECE } else { MILD };
                let find = format!(
                    "const SLIGHT = {slight};\nconst GREATEST = {greatest:?}f;\nconst MOST_PARTS = {MOST_PARTS}u;\n{STRAIGHT}"
                );
                (count, find, "return by_lines(last_of(front), last_of(back), length, words);")
            }
        };
        format!(
            "const LINES = {lines}u;
            const LINES_AT = {at}u;
            const PIECES_AT = {}u;
            {find}
            fn integrated(front: Value, back: Value, length: f32, words: Words) -> vec4f {{
                {integral}
            }}",
            at - 1 - usize::from(rare)
        )
    }
}

/// The lines as an image: value, slope, and below each other the two ends and the number of the line of a single value,
/// [`LINES_ACROSS`] in a row. After them come some that no value is on, as many as a cell's parts may look for in vain.
///
/// # Errors
/// Those of [`Texture::new`].
pub(super) fn image(gpu: &Gpu, exact: &Exact<f32>) -> Result<Texture> {
    let mut lines = exact.opacity.lines();
    let none = Line { value: [0.0; 4], slope: [0.0; 4], ends: [FAR; 2], single: 0 };
    lines.resize(lines.len() + MOST * MOST_PARTS as usize, none);
    let across = lines.len().clamp(1, LINES_ACROSS);
    let size = [across as u32, 3 * lines.len().div_ceil(across).max(1) as u32];
    let mut texels = vec![[0.0; 4]; size[0] as usize * size[1] as usize];
    for (i, line) in lines.iter().enumerate() {
        let at = i % across + 3 * across * (i / across);
        texels[at] = line.value;
        texels[at + across] = line.slope;
        texels[at + 2 * across] = [line.ends[0], line.ends[1], line.single as f32, 0.0];
    }
    let format = wgpu::TextureFormat::Rgba32Float;
    let usage = wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_DST;
    let texture = Texture::new(gpu, "lines", wgpu::TextureDimension::D2, [size[0], size[1], 1], format, usage)?;
    texture.write(gpu, [0; 3], size, bytemuck::cast_slice(&texels));
    Ok(texture)
}

/// What is known of an end of a bin.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(super) struct End {
    /// The number of bins below it in which something may be seen.
    pub(super) shown: u32,
    /// The line that it is on.
    pub(super) line: u32,
}

/// The [`BINS`] + 1 ends of bins.
pub(super) fn bins(exact: &Exact<f32>) -> Vec<End> {
    // Where emission is not bound to extinction, another component may shine.
    let shines = exact.direct && exact.kind != Kind::Scalar;
    let begins: Vec<f32> = exact.opacity.lines().iter().filter(|l| l.ends[0] < l.ends[1]).map(|l| l.ends[0]).collect();
    let at = |b: usize| (2.0 * b as f64 / BINS as f64 - 1.0) as f32;
    let shows = |knots: &Knots<f32>, b: usize| shines || knots.shows(at(b), at(b + 1), exact.direct);
    let mut ends = vec![End::default(); BINS + 1];
    for b in 0..=BINS {
        ends[b].line = begins.partition_point(|&s| s <= at(b)).max(1) as u32 - 1;
        if b > 0 {
            ends[b].shown = ends[b - 1].shown + u32::from(shows(&exact.opacity, b - 1));
        }
    }
    ends
}
