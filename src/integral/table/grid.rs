//! The transfer function between the values of a table's texels: what all constructions but the exact one read.

use super::{for_each_piece, is_scalar, value};
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
}

/// The function at and between `size` values.
#[derive(Debug, Clone)]
pub(super) struct Grid {
    pub(super) size: usize,
    pub(super) direct: bool,
    /// Colours are weights of those at a segment's ends: within an interval, the shares of it that are below and above.
    pub(super) weights: bool,
    /// Pieces of all intervals, as a rising scalar passes them, and of which interval each is.
    pub(super) parts: Vec<Part>,
    pub(super) interval: Vec<u32>,
    /// Each interval is one piece.
    pub(super) plain: bool,
    /// Extinction and colour of a segment that has this value all along.
    pub(super) constant: Vec<[f32; 4]>,
    /// Integrals up to each value, an interval being 1 wide, of colour times extinction (direct: of emission), and of
    /// extinction; and what these sums lack.
    sums: Vec<[f64; 4]>,
    rests: Vec<[f64; 4]>,
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
        let (mut parts, mut interval, weights) = (Vec::new(), Vec::new(), !is_scalar(exact));
        let mut sums = vec![[Sum::default(); 4]];
        for i in 1..size {
            let mut of = sums[i as usize - 1];
            for_each_piece(exact, value(i - 1, size), value(i, size), |mut f, mut b, share| {
                if share <= 0.0 {
                    return;
                }
                interval.push(i - 1);
                if weights {
                    // Blue is all that emits: runs of intervals are put together by it.
                    (f[3], b[3]) = (1.0, 1.0);
                }
                parts.push(Part { front: f.map(|v| v as f32), back: b.map(|v| v as f32), share: share as f32 });
                for k in 1..4 {
                    let mean = match exact.direct {
                        true => (f[k] + b[k]) / 2.0,
                        false => (f[0] * (2.0 * f[k] + b[k]) + b[0] * (f[k] + 2.0 * b[k])) / 6.0,
                    };
                    of[k - 1] = of[k - 1].plus(share * mean);
                }
                if weights && !exact.direct {
                    // From the first value on, and not from the interval's.
                    of[0] = of[0].plus(f64::from(i - 1) * share * (f[0] + b[0]) / 2.0);
                }
                of[3] = of[3].plus(share * (f[0] + b[0]) / 2.0);
            });
            sums.push(of);
        }
        let colour = |s: f64| [1, 2, 3].map(|k| exact.opacity.color_at(s, k));
        Grid {
            size: size as usize,
            direct: exact.direct,
            weights,
            constant: (0..size).map(|i| constant(exact, value(i, size)).map(|v| v as f32)).collect(),
            colour: (0..size).map(|i| colour(value(i, size))).collect(),
            plain: interval.len() + 1 == size as usize && (0..).zip(&interval).all(|(i, &of): (u32, _)| i == of),
            parts,
            interval,
            sums: sums.iter().map(|s| s.map(|s| s.high)).collect(),
            rests: sums.iter().map(|s| s.map(|s| s.low)).collect(),
        }
    }

    /// What colour over opacity (direct: over the length that is seen) becomes between two values where nothing hides
    /// anything, and the mean extinction ρ̂. Which of the values is in front does not matter.
    ///
    /// Of weights, of a scalar that rises; of one that falls, those of both ends change places.
    #[inline(always)]
    pub(super) fn limit(&self, i: usize, j: usize) -> [f32; 4] {
        if self.weights {
            return self.limit_of_weights(i, j);
        }
        if i == j {
            let [density, r, g, b] = self.constant[i];
            return [r, g, b, density];
        }
        let (sums, rests) = ([&self.sums[i], &self.sums[j]], [&self.rests[i], &self.rests[j]]);
        let between: [f64; 4] = std::array::from_fn(|k| (sums[1][k] - sums[0][k]) + (rests[1][k] - rests[0][k]));
        let texels = j as f64 - i as f64;
        let over = 1.0 / if self.direct { texels } else { between[3] };
        let density = (between[3] / texels).max(0.0) as f32;
        if !over.is_finite() {
            let [r, g, b] = [0, 1, 2].map(|k| ((self.colour[i][k] + self.colour[j][k]) / 2.0) as f32);
            return [r, g, b, density];
        }
        let [r, g, b] = [0, 1, 2].map(|k| (between[k] * over).max(0.0) as f32);
        [r, g, b, density]
    }

    fn limit_of_weights(&self, i: usize, j: usize) -> [f32; 4] {
        let between = |k: usize| (self.sums[j][k] - self.sums[i][k]) + (self.rests[j][k] - self.rests[i][k]);
        let (texels, extinction) = (j as f64 - i as f64, between(3));
        let density = if i == j { self.constant[i][0] } else { (extinction / texels).max(0.0) as f32 };
        let middle = (between(0) / extinction - i as f64) / texels;
        let middle = if self.direct || !middle.is_finite() { 0.5 } else { middle.clamp(0.0, 1.0) };
        [middle as f32, (1.0 - middle) as f32, 0.0, density]
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
        let begin = (0..size).map(|i| grid.interval.partition_point(|&of| of < i) as u32).collect();
        let node = |i: usize| {
            let mut sums = [[0.0; 4]; 3];
            // Here extinction is first.
            for (k, of) in [3, 0, 1, 2].into_iter().enumerate() {
                let first = grid.sums[i][of] as f32;
                let rest = (grid.sums[i][of] - f64::from(first)) + grid.rests[i][of];
                let second = rest as f32;
                for (of, part) in sums.iter_mut().zip([first, second, (rest - f64::from(second)) as f32]) {
                    of[k] = part;
                }
            }
            let [r, g, b] = grid.colour[i].map(|c| c as f32);
            Node { sums, constant: grid.constant[i], colour: [r, g, b, 0.0] }
        };
        let part = |p: &Part| PartOf { front: p.front, back: p.back, share: p.share, padding: [0.0; 3] };
        Nodes { parts: grid.parts.iter().map(part).collect(), begin, nodes: (0..grid.size).map(node).collect() }
    }
}
