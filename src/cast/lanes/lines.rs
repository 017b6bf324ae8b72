//! The transfer function as lanes read it: lines in f32, over values that are counted in the spread of its knots.

use crate::field::Normalization;
use crate::integral::{Exact, OPAQUE_EXTINCTION};

/// A line narrower than this, in half the spread of the knots, or steeper, in the greatest values per that, leaves f32 too
/// few digits: extinction, and colours.
const NARROW: f64 = 1e-5;
const STEEP: [f64; 2] = [30.0, 100.0];

/// Values that differ by less, along a ray through a voxel, meet a step of the function where f32 cannot say.
pub(super) const FLAT: f32 = 2e-3;

/// How far f32 may be off.
const OFF: f32 = 1e-6;

/// Parts of the knots' spread in which lines are looked for.
const BUCKETS: usize = 256;

/// Greater numbers are for f64.
const GREATEST: f64 = 1e18;

/// The map of an array's values to those that lines are over: `(v − mid) · factor`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Map {
    pub(super) mid: f64,
    pub(super) factor: f64,
}

/// One line.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Line {
    /// Extinction and colour (or emission) at the value `start`.
    pub(super) value: [f32; 4],
    /// What they grow by.
    pub(super) slope: [f32; 4],
    /// Between these values it holds, and counts from `start`; 1 if anything shows on it.
    pub(super) low: f32,
    pub(super) high: f32,
    pub(super) start: f32,
    pub(super) shows: f32,
    /// Between these a value is on it whatever f32 is off by; nowhere if that is too much.
    pub(super) inner: [f32; 2],
    /// What `Stretch::curve` is; 0 where extinction is linear.
    pub(super) curve: f32,
    rest: f32,
}

/// All of them, ascending.
#[derive(Debug)]
pub(super) struct Lines {
    pub(super) map: Map,
    pub(super) all: Vec<Line>,
    /// Whether extinction is the logarithm of a line.
    pub(super) are_curved: bool,
    /// The line that each of [`BUCKETS`] parts of [−1, 1] begins in.
    bucket: Vec<u32>,
    /// Of lines before each: how many show, how many are too narrow for f32, and, counted with what ends there, steps.
    shown: Vec<u32>,
    narrow: Vec<u32>,
    steps: Vec<u32>,
}

impl Lines {
    /// Those of a scalar's function over values that `normal` maps; their map is in f32's reach, if the values are
    /// `exact_in_f32`. Nothing if f32 cannot hold the function.
    pub(super) fn new(exact: &Exact<f64>, normal: Normalization, exact_in_f32: bool) -> Option<Self> {
        let (knots, curved) = exact.curved.as_ref().map_or((&exact.opacity, None), |c| (&c.knots, Some(c.unit)));
        let n = knots.s.len();
        // The outer knots lie beyond every value.
        let inner = &knots.s[1..n - 1];
        let [low, high] = [inner.first().copied().unwrap_or(-1.0), inner.last().copied().unwrap_or(1.0)];
        let [low, high] = if low.max(-1.0) < high.min(1.0) { [low.max(-1.0), high.min(1.0)] } else { [-1.0, 1.0] };
        let (half, mut mid) = (normal.half * (high - low) / 2.0, normal.mid + normal.half * f64::midpoint(low, high));
        if exact_in_f32 {
            mid = f64::from(mid as f32);
        }
        let factor = 1.0 / half;
        let in_reach = |v: f64| v == 0.0 || (v.abs() > 1e-30 && v.abs() < 1e30);
        if !(factor.is_normal() && mid.is_finite()) || exact_in_f32 && !(in_reach(factor) && in_reach(mid)) {
            return None;
        }
        // From the normal's values, which tell apart what the field's own units may not.
        let (scale, shift) = (normal.half * factor, (normal.mid - mid) * factor);
        let place = |s: f64| s * scale + shift;
        let shows = |v: &[f64; 4]| v[..if exact.direct { 4 } else { 1 }].iter().any(|c| *c > 0.0);
        let mut lines = Lines {
            map: Map { mid, factor },
            all: vec![],
            are_curved: curved.is_some(),
            bucket: vec![],
            shown: vec![0],
            narrow: vec![0],
            steps: vec![0],
        };
        let most = [0..1, 1..4].map(|channels| {
            let values = knots.value.iter().flat_map(|v| &v[channels.clone()]);
            values.fold(f64::MIN_POSITIVE, |most, v| most.max(*v))
        });
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
            let low = if first { f32::NEG_INFINITY } else { from as f32 };
            let high = if last { f32::INFINITY } else { to as f32 };
            let seen = shows(&knots.value[i]) || shows(&knots.value[i + 1]);
            let steep = |k: usize| steepest[k].abs() > STEEP[usize::from(k > 0)] * most[usize::from(k > 0)];
            let narrow = !first && !last && (to - from < NARROW || (0..4).any(steep));
            let margins = [low + margin(stepped[0]), high - margin(stepped[1])];
            lines.all.push(Line {
                value: value.map(|v| v as f32),
                slope: slope.map(|v| v as f32),
                low,
                high,
                start: start as f32,
                shows: f32::from(u8::from(seen)),
                inner: if narrow { [f32::INFINITY, f32::NEG_INFINITY] } else { margins },
                curve: curve as f32,
                rest: 0.0,
            });
            lines.shown.push(lines.shown[lines.shown.len() - 1] + u32::from(seen));
            lines.narrow.push(lines.narrow[lines.narrow.len() - 1] + u32::from(narrow));
            lines.steps.push(lines.steps[lines.steps.len() - 1] + u32::from(stepped[0]));
        }
        let below = |s: f32| lines.all.partition_point(|line| line.low <= s).max(1) - 1;
        lines.bucket = (0..BUCKETS).map(|b| below(2.0 * b as f32 / BUCKETS as f32 - 1.0) as u32).collect();
        Some(lines)
    }

    /// The line that a value is on.
    #[inline(always)]
    pub(super) fn find(&self, s: f32) -> usize {
        let b = ((s + 1.0) * (BUCKETS as f32 / 2.0)).clamp(0.0, (BUCKETS - 1) as f32) as usize;
        let mut i = self.bucket[b] as usize;
        while self.all[i].high <= s && i + 1 < self.all.len() {
            i += 1;
        }
        while self.all[i].low > s && i > 0 {
            i -= 1;
        }
        i
    }

    /// The lines that values between two may be on.
    #[inline(always)]
    pub(super) fn between(&self, low: f32, high: f32) -> [usize; 2] {
        [self.find(low - OFF), self.find(high + OFF)]
    }

    /// Whether anything shows on the lines from one to another.
    #[inline(always)]
    pub(super) fn shows(&self, [first, last]: [usize; 2]) -> bool {
        self.shown[last + 1] > self.shown[first]
    }

    /// Whether one of these lines is too narrow for f32.
    #[inline(always)]
    pub(super) fn is_narrow(&self, [first, last]: [usize; 2]) -> bool {
        self.narrow[last + 1] > self.narrow[first]
    }

    /// Whether there is a step between two of these lines.
    #[inline(always)]
    pub(super) fn is_stepped(&self, [first, last]: [usize; 2]) -> bool {
        self.steps[last + 1] > self.steps[first + 1]
    }
}
