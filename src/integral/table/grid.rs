//! The transfer function between the values of a table's texels: what all constructions but the exact one read.

use super::value;
use crate::integral::Exact;
use bytemuck::{Pod, Zeroable};

/// A linear piece of the function, as the scalar passes it: extinction and colour at both ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Part {
    pub(super) front: [f32; 4],
    pub(super) back: [f32; 4],
    /// Its part of the interval between two values.
    pub(super) share: f32,
}

/// A sum and what it lacks (Neumaier 1974): differences of such sums keep digits that a step of 1e15 would swallow.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Sum {
    pub(super) high: f64,
    pub(super) low: f64,
}

impl Sum {
    pub(super) fn plus(self, x: f64) -> Self {
        let high = self.high + x;
        let lost = if self.high.abs() >= x.abs() { (self.high - high) + x } else { (x - high) + self.high };
        Sum { high, low: self.low + lost }
    }

    #[inline(always)]
    pub(super) fn minus(self, other: Sum) -> f64 {
        (self.high - other.high) + (self.low - other.low)
    }
}

/// The function at and between `size` values.
#[derive(Debug, Clone)]
pub(super) struct Grid {
    pub(super) size: usize,
    pub(super) direct: bool,
    /// Pieces of all intervals, as a rising scalar passes them and as a falling one does, and of which interval each is, as numbered
    /// in that order.
    pub(super) rising: (Vec<Part>, Vec<u32>),
    pub(super) falling: (Vec<Part>, Vec<u32>),
    /// Each interval is one piece.
    pub(super) plain: bool,
    /// Extinction and colour of a segment that has this value all along.
    pub(super) constant: Vec<[f32; 4]>,
    /// Integrals up to each value, an interval being 1 wide: of extinction, and of colour times extinction (direct: of emission).
    depth: Vec<Sum>,
    emitted: Vec<[Sum; 3]>,
    /// The colour at each value.
    colour: Vec<[f64; 3]>,
}

/// Extinction and colour (direct: emission) of a segment whose value is `s` all along.
pub(super) fn constant(exact: &Exact<f64>, s: f64) -> [f64; 4] {
    let mut of = [0, 1, 2, 3].map(|k| if k == 0 { 0.0 } else { exact.opacity.color_at(s, k) });
    exact.for_each_piece(&[s], &[s], |f, _, _| of = f);
    of
}

impl Grid {
    pub(super) fn new(exact: &Exact<f64>, size: u32) -> Self {
        let mut rising = (Vec::new(), Vec::new());
        let (mut depth, mut emitted) = (vec![Sum::default()], vec![[Sum::default(); 3]]);
        for i in 1..size {
            let (mut of_depth, mut of_emitted) = (depth[i as usize - 1], emitted[i as usize - 1]);
            exact.for_each_piece(&[value(i - 1, size)], &[value(i, size)], |f, b, share| {
                if share <= 0.0 {
                    return;
                }
                rising.1.push(i - 1);
                rising.0.push(Part { front: f.map(|v| v as f32), back: b.map(|v| v as f32), share: share as f32 });
                of_depth = of_depth.plus(share * (f[0] + b[0]) / 2.0);
                for k in 1..4 {
                    let mean = match exact.direct {
                        true => (f[k] + b[k]) / 2.0,
                        false => (f[0] * (2.0 * f[k] + b[k]) + b[0] * (f[k] + 2.0 * b[k])) / 6.0,
                    };
                    of_emitted[k - 1] = of_emitted[k - 1].plus(share * mean);
                }
            });
            depth.push(of_depth);
            emitted.push(of_emitted);
        }
        let falling = (
            rising.0.iter().rev().map(|p| Part { front: p.back, back: p.front, share: p.share }).collect(),
            rising.1.iter().rev().map(|i| size - 2 - i).collect(),
        );
        let colour = |s: f64| [1, 2, 3].map(|k| exact.opacity.color_at(s, k));
        Grid {
            size: size as usize,
            direct: exact.direct,
            constant: (0..size).map(|i| constant(exact, value(i, size)).map(|v| v as f32)).collect(),
            colour: (0..size).map(|i| colour(value(i, size))).collect(),
            plain: rising.1.len() + 1 == size as usize && (0..).zip(&rising.1).all(|(i, &of): (u32, _)| i == of),
            rising,
            falling,
            depth,
            emitted,
        }
    }

    /// ρ̂: the mean extinction from value `i` to value `j`.
    #[inline]
    pub(super) fn density(&self, i: usize, j: usize) -> f64 {
        match i == j {
            true => f64::from(self.constant[i][0]),
            false => (self.depth[j].minus(self.depth[i]) / (j as f64 - i as f64)).max(0.0),
        }
    }

    /// What colour over opacity (direct: over the length that is seen) becomes where nothing hides anything.
    #[inline]
    pub(super) fn limit(&self, i: usize, j: usize) -> [f64; 3] {
        if i == j {
            let [_, r, g, b] = self.constant[i].map(f64::from);
            return [r, g, b];
        }
        let emitted = [0, 1, 2].map(|k| self.emitted[j][k].minus(self.emitted[i][k]));
        let whole = if self.direct { j as f64 - i as f64 } else { self.depth[j].minus(self.depth[i]) };
        match whole.abs() > 0.0 {
            true => {
                let over = 1.0 / whole;
                emitted.map(|e| (e * over).max(0.0))
            }
            false => [0, 1, 2].map(|k| (self.colour[i][k] + self.colour[j][k]) / 2.0),
        }
    }
}

/// A [`Grid`] as shaders read it.
pub(crate) struct Nodes {
    pub(crate) parts: Vec<PartOf>,
    /// Where the parts of each interval begin, and their number.
    pub(crate) begin: Vec<u32>,
    pub(crate) nodes: Vec<Node>,
}

/// `Part` in the shader.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct PartOf {
    front: [f32; 4],
    back: [f32; 4],
    share: f32,
    padding: [f32; 3],
}

/// `Node` in the shader: integrals as sums of three, as an opaque stretch is 1e15.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Node {
    sums: [[f32; 4]; 3],
    constant: [f32; 4],
    colour: [f32; 4],
}

impl Nodes {
    pub(crate) fn new(exact: &Exact<f64>, size: u32) -> Self {
        let grid = Grid::new(exact, size);
        let (parts, interval) = &grid.rising;
        let begin = (0..size).map(|i| interval.partition_point(|&of| of < i) as u32).collect();
        let node = |i: usize| {
            let mut sums = [[0.0; 4]; 3];
            let [r, g, b] = grid.emitted[i];
            for (k, Sum { high, low }) in [grid.depth[i], r, g, b].into_iter().enumerate() {
                let first = high as f32;
                let rest = (high - f64::from(first)) + low;
                let second = rest as f32;
                for (of, part) in sums.iter_mut().zip([first, second, (rest - f64::from(second)) as f32]) {
                    of[k] = part;
                }
            }
            let [r, g, b] = grid.colour[i].map(|c| c as f32);
            Node { sums, constant: grid.constant[i], colour: [r, g, b, 0.0] }
        };
        let part = |p: &Part| PartOf { front: p.front, back: p.back, share: p.share, padding: [0.0; 3] };
        Nodes { parts: parts.iter().map(part).collect(), begin, nodes: (0..grid.size).map(node).collect() }
    }
}
