//! A transfer function in f32 along cubics: lines over values that are counted in the spread of its knots.

use super::{Knots, OPAQUE_EXTINCTION};
use crate::field::Normalization;

/// A line narrower than this, in half the spread of the knots, leaves f32 too few digits.
const NARROW: f64 = 1e-5;

/// How far f32 may be off.
pub(crate) const OFF: f32 = 1e-6;

/// Parts of the knots' spread in which lines are looked for.
pub(crate) const BUCKETS: usize = 256;

/// Greater numbers are for f64.
const GREATEST: f64 = 1e18;

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

/// One line.
pub(crate) struct Line {
    /// Extinction and colour (or emission) at the value `start`, and what they grow by.
    pub(crate) value: [f32; 4],
    pub(crate) slope: [f32; 4],
    pub(crate) start: f32,
    /// What `Stretch::curve` is; 0 where extinction is linear.
    pub(crate) curve: f32,
    /// Where it holds: from the first to the second, which is none beyond the outer knots.
    pub(crate) ends: [Option<f32>; 2],
    /// By how much of it, from either end, f32 may miss a step of the function there.
    pub(crate) margins: [f32; 2],
    pub(crate) shows: bool,
    /// Too narrow for f32, or too steep.
    pub(crate) is_narrow: bool,
    /// The function steps where it begins.
    pub(crate) begins_with_step: bool,
}

/// What lines are made of.
pub(crate) struct Function<'a> {
    pub(crate) knots: &'a Knots<f64>,
    /// The unit distance, if the first channel is the logarithm of a line.
    pub(crate) curved: Option<f64>,
    pub(crate) normal: Normalization,
    /// Values are f32: the map's middle is one, too.
    pub(crate) plain: bool,
    /// Extinction and colours steeper than this, in the greatest values per half the spread of the knots, leave f32 too few
    /// digits.
    pub(crate) steepest: [f64; 2],
}

impl Function<'_> {
    /// Its lines, ascending, and the map to the values that they are over; `shows` says whether anything is seen at a knot
    /// of these values. Nothing if f32 cannot hold the function.
    pub(crate) fn lines(&self, shows: impl Fn(&[f64; 4]) -> bool) -> Option<(Map, Vec<Line>)> {
        let Function { knots, curved, normal, plain, steepest } = *self;
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
        let mut lines = vec![];
        for i in (0..n - 1).filter(|&i| knots.s[i] < knots.s[i + 1]) {
            let [from, to] = [place(knots.s[i]), place(knots.s[i + 1])];
            let (first, last) = (i == 0, i + 2 == n);
            let mut slope = if first || last {
                [0.0; 4]
            } else {
                [0, 1, 2, 3].map(|k| (knots.value[i + 1][k] - knots.value[i][k]) / (to - from))
            };
            let (mut value, mut start) = (knots.value[i], if first { if last { 0.0 } else { to } } else { from });
            let (mut curve, mut steep) = (0.0, slope);
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
                steep[0] = slope[0] * (most / least);
            }
            if !knots.value[i].iter().all(|v| v.abs() <= GREATEST) {
                return None;
            }
            let stepped = [i > 0 && knots.s[i - 1] == knots.s[i], i + 2 < n && knots.s[i + 1] == knots.s[i + 2]];
            let is_steep = |k: usize| steep[k].abs() > steepest[usize::from(k > 0)] * most[usize::from(k > 0)];
            lines.push(Line {
                value: value.map(|v| v as f32),
                slope: slope.map(|v| v as f32),
                start: start as f32,
                curve: curve as f32,
                ends: [(!first).then_some(from as f32), (!last).then_some(to as f32)],
                margins: stepped.map(|stepped| if stepped { OFF } else { 0.0 }),
                shows: shows(&knots.value[i]) || shows(&knots.value[i + 1]),
                is_narrow: !first && !last && (to - from < NARROW || (0..4).any(is_steep)),
                begins_with_step: stepped[0],
            });
        }
        Some((map, lines))
    }
}

/// The line that each of [`BUCKETS`] parts of [−1, 1] begins in, of lines that begin at `lows`.
pub(crate) fn buckets(lows: &[f32]) -> Vec<u32> {
    let below = |s: f32| lows.partition_point(|low| *low <= s).max(1) - 1;
    (0..BUCKETS).map(|b| below(2.0 * b as f32 / BUCKETS as f32 - 1.0) as u32).collect()
}
