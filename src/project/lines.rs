//! What of the transfer function comes with the record of a cell.
//!
//! A look-up of the function is dear in software, and so is a loop over the intervals that a segment crosses. Most
//! functions have few of them within a cell, and most cells are thin: then a record holds the lines of all of them, and
//! fragments go through these straight.

use crate::field::Kind;
use crate::geometry::{Geometry, Values};
use crate::integral::Exact;
use rayon::prelude::*;

const STRAIGHT: &str = include_str!("../../shaders/project_straight.wgsl");

/// Optical depth of the longest segment up to which fragments go straight: as many steps as that, at most.
const DEEPEST: f64 = 64.0;

/// The most lines that a record holds.
const MOST: usize = 4;

/// What of the function comes with a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Lines {
    /// Nothing: fragments look up a table, or functions of several components.
    None,
    /// The interval of the least value: fragments look up its line and those above one by one.
    First,
    /// All lines that a cell's values may be on, so many at most.
    All(usize),
}

/// The greatest extent of cells, in space and in values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Extent {
    /// The longest edge, in normalised units.
    edge: f64,
    /// The greatest difference between two values of the last component in a cell.
    values: f32,
}

impl Extent {
    pub(super) fn new<const N: usize>(geometry: &Geometry, values: &Values<N>) -> Self {
        let between = |v: [f32; 4]| v.into_iter().fold(f32::MIN, f32::max) - v.into_iter().fold(f32::MAX, f32::min);
        let greatest = match values {
            Values::Cell(_) => 0.0,
            Values::Point(v) => {
                let cells = geometry.cells.par_iter().map(|c| between(c.corners.map(|p| v[p as usize][N - 1])));
                // Cells with a value that is not finite are not drawn.
                cells.filter(|d| d.is_finite()).reduce(|| 0.0, f32::max)
            }
            Values::Corner(v) => {
                let cells = v.par_iter().map(|v| between(v.map(|v| v[N - 1])));
                cells.filter(|d| d.is_finite()).reduce(|| 0.0, f32::max)
            }
        };
        Extent { edge: geometry.longest_edge(), values: greatest }
    }
}

impl Lines {
    /// What suits a function and cells of this extent, with `words` of four floats at most.
    pub(super) fn new(exact: &Exact<f32>, extent: Extent, words: usize) -> Self {
        match exact.kind {
            Kind::Pair => return Lines::None,
            Kind::Rgba => return Lines::First,
            Kind::Scalar => {}
        }
        let (lines, steepest) = (exact.opacity.lines_within(extent.values), exact.opacity.steepest());
        let all = Lines::All(lines);
        let is_mild = f64::from(steepest) * extent.edge <= DEEPEST;
        if is_mild && lines <= MOST && all.words() <= words { all } else { Lines::First }
    }

    /// The words that they take in a record.
    pub(super) fn words(self) -> usize {
        match self {
            Lines::None => 0,
            Lines::First => 1,
            Lines::All(n) => 2 * n + 1,
        }
    }

    /// `lines_between`, which finds the words for cells whose values go from one to another, and `integrated`, the exact
    /// integral of a segment by them, the first being words[at].
    pub(super) fn wgsl(self, at: usize) -> String {
        let integrated = "fn integrated(front: Value, back: Value, length: f32, least: Value, words: Words) -> vec4f";
        let lines = match self {
            Lines::None => {
                return format!(
                    "{integrated} {{
                        light = vec4f(0.0, 0.0, 0.0, 1.0);
                        add_segment(front, back, length);
                        return vec4f(light.xyz, 1.0 - light.w);
                    }}"
                );
            }
            Lines::First => {
                return format!(
                    "fn lines_between(low: f32, high: f32) -> array<vec4f, 1> {{
                        return array<vec4f, 1>(vec4f(f32(interval_of(low)), 0.0, 0.0, 0.0));
                    }}
                    {integrated} {{ return by_intervals(front, back, length, u32(words[{at}].x)); }}"
                );
            }
            Lines::All(n) => n,
        };
        // Where lines begin but for the first.
        let kinks = ["x", "y", "z"];
        let above = |k: usize| {
            format!(
                "begin.{} = line.ends.y;
                line = line_of(line.next);
                words[{}] = line.value;
                words[{}] = line.slope;
                steepest = max(steepest, extinction_between(line, low, high));
                ",
                kinks[k - 1],
                2 * k,
                2 * k + 1
            )
        };
        let through = |k: usize| {
            let [value, slope] = [at + 2 * k, at + 2 * k + 1];
            let (begin, start, a) = match k.checked_sub(1).map(|k| kinks[k]) {
                None => ("least".into(), "start".into(), "low - least".into()),
                Some(c) => (format!("begin.{c}"), format!("at.{c}"), format!("max(low - begin.{c}, 0.0)")),
            };
            let (end, b) = match kinks.get(k).filter(|_| k + 1 < lines) {
                None => ("end".into(), "high".into()),
                Some(c) => (format!("at.{c}"), format!("min(high, begin.{c})")),
            };
            let part = format!("on_line(ramp, {start}, {end}, words[{value}], words[{slope}], {a}, {b} - {begin})");
            match k {
                0 => format!("var sum = {part};\n"),
                _ => format!("sum = joined(ramp, sum, {part});\n"),
            }
        };
        let last = self.words() - 1;
        [
            format!(
                "const LAST_LINE_WORD = {}u;
                fn lines_between(low: f32, high: f32) -> array<vec4f, {}> {{
                var words: array<vec4f, {}>;
                var line = line_of(interval_of(low));
                words[0] = line.value + line.slope * (low - line.ends.x);
                words[1] = line.slope;
                var steepest = extinction_between(line, low, high);
                var begin = vec3f(FAR);
                ",
                at + last,
                last + 1,
                last + 1
            ),
            (1..lines).map(above).collect(),
            format!(
                "words[{last}] = vec4f(begin, steepest);
                return words;
                }}
                fn through_lines(ramp: Ramp, start: f32, end: f32, least: f32, words: Words) -> vec4f {{
                let begin = words[LAST_LINE_WORD].xyz;
                let at = clamp((begin - ramp.low) * ramp.share, vec3f(start), vec3f(end));
                let low = fma(ramp.range, start, ramp.low);
                let high = fma(ramp.range, end, ramp.low);
                "
            ),
            (0..lines).map(through).collect(),
            format!(
                "return sum;
                }}
                {integrated} {{ return by_lines(last_of(front), last_of(back), length, last_of(least), words); }}
                {STRAIGHT}"
            ),
        ]
        .concat()
    }
}
