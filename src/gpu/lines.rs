//! The transfer function as `shaders/stretch.wgsl` reads it: lines in f32, over values that are counted in the spread of
//! its knots.

use super::Gpu;
use super::buffers::Buffer;
use crate::error::Result;
use crate::field::Normalization;
use crate::integral::Exact;
use crate::integral::lines::{self, Map};
use bytemuck::{Pod, Zeroable};
use wgpu::BufferUsages as Usage;

/// Extinction and colours steeper than this, in the greatest values per half the spread of the knots, leave f32 too few digits.
const STEEPEST: [f64; 2] = [300.0, 1000.0];

/// Beyond every value.
const BEYOND: f32 = f32::MAX;

/// `SHOWS` and `NARROW` in the shader.
const FLAG_SHOWS: u32 = 1;
const FLAG_NARROW: u32 = 2;

/// `Line` in the shader.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Line {
    value: [f32; 4],
    slope: [f32; 4],
    low: f32,
    high: f32,
    start: f32,
    curve: f32,
    inner: [f32; 2],
    shown: u32,
    narrow: u32,
    steps: u32,
    flags: u32,
    unused: [u32; 2],
}

/// `Lines` in the shader.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Ends {
    color: u32,
    end: u32,
    scale: f32,
    unused: u32,
}

/// The lines of one function.
#[derive(Debug)]
struct Function {
    map: Map,
    lines: Vec<Line>,
    buckets: Vec<u32>,
}

/// Those of a transfer function.
#[derive(Debug)]
pub(crate) struct Lines {
    opacity: Function,
    color: Option<Function>,
    scale: f32,
    /// Whether extinction is the logarithm of a line.
    pub(crate) are_curved: bool,
}

impl Function {
    /// That of `source`; `shows` says whether anything is seen at a knot of these values. Nothing if f32 cannot hold it.
    fn new(source: &lines::Function, shows: impl Fn(&[f64; 4]) -> bool) -> Option<Self> {
        let (map, all) = source.lines(shows)?;
        let (mut shown, mut narrow, mut steps) = (0, 0, 0);
        let of_shader = |line: &lines::Line| {
            let [low, high] = [line.ends[0].unwrap_or(-BEYOND), line.ends[1].unwrap_or(BEYOND)];
            shown += u32::from(line.shows);
            narrow += u32::from(line.is_narrow);
            steps += u32::from(line.begins_with_step);
            Line {
                value: line.value,
                slope: line.slope,
                low,
                high,
                start: line.start,
                curve: line.curve,
                inner: if line.is_narrow { [BEYOND, -BEYOND] } else { [low + line.margins[0], high - line.margins[1]] },
                shown,
                narrow,
                steps,
                flags: u32::from(line.shows) * FLAG_SHOWS + u32::from(line.is_narrow) * FLAG_NARROW,
                unused: [0; 2],
            }
        };
        let lines: Vec<_> = all.iter().map(of_shader).collect();
        let lows: Vec<_> = lines.iter().map(|line| line.low).collect();
        Some(Function { map, lines, buckets: lines::buckets(&lows) })
    }
}

impl Lines {
    /// Those of `exact` over values whose components `normal` maps, and which f32 holds if they are `plain`. Nothing if f32
    /// cannot hold the function.
    pub(crate) fn new(exact: &Exact<f64>, normal: &[Normalization; 4], plain: bool) -> Option<Self> {
        let (knots, curved) = exact.curved.as_ref().map_or((&exact.opacity, None), |c| (&c.knots, Some(c.unit)));
        let components = exact.kind.components();
        // Emission of its own may show whatever the opacity is.
        let alone = exact.direct && components > 1;
        let channels = if exact.direct { 4 } else { 1 };
        let shows = |v: &[f64; 4]| alone || v[..channels].iter().any(|c| *c > 0.0);
        let steepest = STEEPEST;
        let opacity = lines::Function { knots, curved, normal: normal[components - 1], plain, steepest };
        let opacity = Function::new(&opacity, shows)?;
        let color = match &exact.color {
            Some(knots) => {
                let color = lines::Function { knots, curved: None, normal: normal[0], plain, steepest };
                Some(Function::new(&color, |_| true)?)
            }
            None => None,
        };
        Some(Lines { opacity, color, scale: exact.scale as f32, are_curved: curved.is_some() })
    }

    /// The maps of the components.
    pub(crate) fn maps(&self, components: usize, normal: &[Normalization; 4]) -> [Map; 4] {
        let mut maps = normal.map(Map::of);
        if let Some(color) = &self.color {
            maps[0] = color.map;
        }
        maps[components - 1] = self.opacity.map;
        maps
    }

    /// `function`, `lines` and `buckets`: bindings 0 to 2 of group 0.
    pub(crate) fn upload(&self, gpu: &Gpu) -> Result<[Buffer; 3]> {
        let (mut lines, mut buckets) = (self.opacity.lines.clone(), self.opacity.buckets.clone());
        let color = lines.len() as u32;
        if let Some(of_color) = &self.color {
            lines.extend(&of_color.lines);
            buckets.extend(of_color.buckets.iter().map(|b| b + color));
        }
        let ends = Ends { color, end: lines.len() as u32, scale: self.scale, unused: 0 };
        Ok([
            Buffer::holding(gpu, "function", &[ends], Usage::UNIFORM)?,
            Buffer::holding(gpu, "lines", &lines, Usage::STORAGE)?,
            Buffer::holding(gpu, "buckets", &buckets, Usage::STORAGE)?,
        ])
    }
}

/// Where fields of [`Line`] and [`Ends`] are.
#[cfg(test)]
pub(crate) const OFFSETS: &[(&str, usize)] =
    &offsets!(Line: value, slope, low, high, start, curve, inner, shown, narrow, steps, flags, unused);
#[cfg(test)]
pub(crate) const OFFSETS_OF_ENDS: &[(&str, usize)] = &offsets!(Ends: color, end, scale, unused);
