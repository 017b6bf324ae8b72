//! The transfer function as lanes read it: lines in f32, over values that are counted in the spread of its knots.

use crate::field::Normalization;
use crate::integral::Exact;
use crate::integral::lines::{self, BUCKETS, Map, OFF};

/// Extinction and colours steeper than this, in the greatest values per half the spread of the knots, leave f32 too few digits.
const STEEPEST: [f64; 2] = [30.0, 100.0];

/// Values that differ by less, along a ray through a voxel, meet a step of the function where f32 cannot say.
pub(super) const FLAT: f32 = 2e-3;

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
        let shows = |v: &[f64; 4]| v[..if exact.direct { 4 } else { 1 }].iter().any(|c| *c > 0.0);
        let function = lines::Function { knots, curved, normal, plain: exact_in_f32, steepest: STEEPEST };
        let (map, all) = function.lines(shows)?;
        let of_lanes = |line: &lines::Line| {
            let low = line.ends[0].unwrap_or(f32::NEG_INFINITY);
            let high = line.ends[1].unwrap_or(f32::INFINITY);
            let inner = [low + line.margins[0], high - line.margins[1]];
            Line {
                value: line.value,
                slope: line.slope,
                low,
                high,
                start: line.start,
                shows: f32::from(u8::from(line.shows)),
                inner: if line.is_narrow { [f32::INFINITY, f32::NEG_INFINITY] } else { inner },
                curve: line.curve,
                rest: 0.0,
            }
        };
        let before = |counts: fn(&lines::Line) -> bool| {
            let sum = |sum: &mut u32, line: &lines::Line| {
                *sum += u32::from(counts(line));
                Some(*sum)
            };
            [0].into_iter().chain(all.iter().scan(0, sum)).collect()
        };
        Some(Lines {
            map,
            all: all.iter().map(of_lanes).collect(),
            are_curved: curved.is_some(),
            bucket: lines::buckets(
                &all.iter().map(|line| line.ends[0].unwrap_or(f32::NEG_INFINITY)).collect::<Vec<_>>(),
            ),
            shown: before(|line| line.shows),
            narrow: before(|line| line.is_narrow),
            steps: before(|line| line.begins_with_step),
        })
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
