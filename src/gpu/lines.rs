//! The transfer function as `shaders/stretch.wgsl` reads it: lines in f32, over values that are counted in the spread of
//! its knots.

use super::Gpu;
use super::buffers::Buffer;
use crate::error::Result;
use crate::field::Normalization;
use crate::integral::{Exact, Knots, OPAQUE_EXTINCTION};
use bytemuck::{Pod, Zeroable};
use wgpu::BufferUsages as Usage;

/// A line narrower than this, in half the spread of the knots, or steeper, in the greatest values per that, leaves f32 too
/// few digits: extinction, and colours.
const NARROW: f64 = 1e-5;
const STEEP: [f64; 2] = [300.0, 1000.0];

/// How far f32 may be off.
pub(crate) const OFF: f32 = 1e-6;

/// Parts of the knots' spread in which lines are looked for.
pub(crate) const BUCKETS: usize = 256;

/// Greater numbers are for f64.
const GREATEST: f64 = 1e18;

/// Beyond every value.
const BEYOND: f32 = f32::MAX;

/// `SHOWS` and `NARROW` in the shader.
const FLAG_SHOWS: u32 = 1;
const FLAG_NARROW: u32 = 2;

/// From an array's values to those that lines are over: `(v − mid) · factor`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Map {
    pub(crate) mid: f64,
    pub(crate) factor: f64,
}

impl Map {
    /// Of a component that no function is over: as the field maps it.
    pub(crate) fn of(normal: Normalization) -> Self {
        Map { mid: normal.mid, factor: 1.0 / normal.half }
    }

    /// What it makes of `v`.
    pub(crate) fn apply(&self, v: f64) -> f64 {
        (v - self.mid) * self.factor
    }

    /// From what it makes of values to what `normal` makes of them: times the first, plus the second.
    pub(crate) fn back(&self, normal: Normalization) -> [f64; 2] {
        [1.0 / (self.factor * normal.half), (self.mid - normal.mid) / normal.half]
    }

    /// From what `self` makes of values to what another makes of them.
    pub(crate) fn then(&self, other: &Map) -> Map {
        let factor = other.factor / self.factor;
        Map { mid: (other.mid - self.mid) * self.factor, factor }
    }

    /// Whether f32 holds it.
    pub(crate) fn is_in_reach(&self) -> bool {
        let holds = |v: f64| v == 0.0 || (v.abs() > 1e-30 && v.abs() < 1e30);
        self.factor.is_normal() && holds(self.factor) && holds(self.mid)
    }
}

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
    /// That of `knots`, whose first channel is the logarithm of a line if there is a unit distance `curved`, over values that
    /// `normal` maps; `shows` says whether anything is seen between two knots of these values. The map's middle is an f32
    /// if values are `plain`. Nothing if f32 cannot hold the function.
    fn new(
        knots: &Knots<f64>,
        curved: Option<f64>,
        normal: Normalization,
        plain: bool,
        shows: impl Fn(&[f64; 4]) -> bool,
    ) -> Option<Self> {
        let n = knots.s.len();
        // The outer knots lie beyond every value.
        let inner = &knots.s[1..n - 1];
        let [low, high] = [inner.first().copied().unwrap_or(-1.0), inner.last().copied().unwrap_or(1.0)];
        let [low, high] = if low.max(-1.0) < high.min(1.0) { [low.max(-1.0), high.min(1.0)] } else { [-1.0, 1.0] };
        let (half, mut mid) = (normal.half * (high - low) / 2.0, normal.mid + normal.half * f64::midpoint(low, high));
        if plain {
            mid = f64::from(mid as f32);
        }
        let map = Map { mid, factor: 1.0 / half };
        if !(map.factor.is_normal() && mid.is_finite()) || plain && !map.is_in_reach() {
            return None;
        }
        // From the normal's values, which tell apart what the field's own units may not.
        let (scale, shift) = (normal.half * map.factor, (normal.mid - mid) * map.factor);
        let place = |s: f64| s * scale + shift;
        let most = [0..1, 1..4].map(|channels| {
            let values = knots.value.iter().flat_map(|v| &v[channels.clone()]);
            values.fold(f64::MIN_POSITIVE, |most, v| most.max(*v))
        });
        let (mut lines, mut shown, mut narrow, mut steps) = (Vec::<Line>::new(), 0, 0, 0);
        for i in (0..n - 1).filter(|&i| knots.s[i] < knots.s[i + 1]) {
            let [from, to] = [place(knots.s[i]), place(knots.s[i + 1])];
            let (first, last) = (i == 0, i + 2 == n);
            let mut slope = if first || last {
                [0.0; 4]
            } else {
                [0, 1, 2, 3].map(|k| (knots.value[i + 1][k] - knots.value[i][k]) / (to - from))
            };
            let (mut value, mut start) = (knots.value[i], if first { if last { 0.0 } else { to } } else { from });
            let (mut curve, mut steepest) = (0.0, slope);
            let depths = [i, i + 1].map(|i| knots.value[i][0]);
            if let Some(unit) = curved.filter(|_| slope[0] != 0.0 && depths[0].max(depths[1]) < OPAQUE_EXTINCTION) {
                // From where more of it passes: there the logarithm's series begins.
                let passes = depths.map(|depth| (-depth * unit).exp());
                let [most, least] = [passes[0].max(passes[1]), passes[0].min(passes[1])];
                if passes[1] > passes[0] {
                    (value, start) = (knots.value[i + 1], to);
                }
                curve = (passes[0] - passes[1]) / (to - from) / most;
                slope[0] = curve / unit;
                steepest[0] = slope[0] * (most / least);
            }
            if !knots.value[i].iter().all(|v| v.abs() <= GREATEST) {
                return None;
            }
            let stepped = [i > 0 && knots.s[i - 1] == knots.s[i], i + 2 < n && knots.s[i + 1] == knots.s[i + 2]];
            let margin = |stepped: bool| if stepped { OFF } else { 0.0 };
            let low = if first { -BEYOND } else { from as f32 };
            let high = if last { BEYOND } else { to as f32 };
            let is_shown = shows(&knots.value[i]) || shows(&knots.value[i + 1]);
            let steep = |k: usize| steepest[k].abs() > STEEP[usize::from(k > 0)] * most[usize::from(k > 0)];
            let is_narrow = !first && !last && (to - from < NARROW || (0..4).any(steep));
            let margins = [low + margin(stepped[0]), high - margin(stepped[1])];
            shown += u32::from(is_shown);
            narrow += u32::from(is_narrow);
            steps += u32::from(stepped[0]);
            lines.push(Line {
                value: value.map(|v| v as f32),
                slope: slope.map(|v| v as f32),
                low,
                high,
                start: start as f32,
                curve: curve as f32,
                inner: if is_narrow { [BEYOND, -BEYOND] } else { margins },
                shown,
                narrow,
                steps,
                flags: u32::from(is_shown) * FLAG_SHOWS + u32::from(is_narrow) * FLAG_NARROW,
                unused: [0; 2],
            });
        }
        let below = |s: f32| lines.partition_point(|line| line.low <= s).max(1) - 1;
        let buckets = (0..BUCKETS).map(|b| below(2.0 * b as f32 / BUCKETS as f32 - 1.0) as u32).collect();
        Some(Function { map, lines, buckets })
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
        let opacity = Function::new(knots, curved, normal[components - 1], plain, shows)?;
        let color = match &exact.color {
            Some(color) => Some(Function::new(color, None, normal[0], plain, |_| true)?),
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
