//! Segments as published: so many equal pieces, whatever the function does between their ends (Song et al. 2009, §5).
//!
//! A piece is classified at its ends, and opacity and colour are taken for linear between them: C = c_f F + c_b B with
//! the weights F and B of the depths x = τ_f l and y = τ_b l, and α = 1 − e^{−(x + y)/2} (equations 2 and 3).

use super::lanes::{each, opacity};
use super::nodes::Nodes;
use super::{Gathered, Scratch, Second, Segment};
use crate::integral::Piece;
use crate::integral::options::{Two, Weights};

/// Texels of the table along each axis.
const SIZE: usize = 256;
/// The greatest depth in it; what is deeper is read there, as textures are.
const DEEPEST: f64 = 8.0;

/// The weights of the light at a piece's ends: the closed form, or the texture of the paper.
#[derive(Debug, Clone)]
pub(super) enum Ends {
    Closed,
    /// F and B over (x, y), bilinear, for chromatic or for direct light.
    Texture(Vec<[f32; 2]>),
}

impl Ends {
    pub(super) fn new(two: &Two, direct: bool) -> Self {
        match two.weights {
            Weights::Closed => Ends::Closed,
            Weights::Texture => {
                let depth = |i: usize| i as f64 * DEEPEST / (SIZE - 1) as f64;
                let texel = |i: usize| {
                    let piece = Piece::new(depth(i % SIZE), depth(i / SIZE), direct);
                    [piece.front as f32, piece.back as f32]
                };
                Ends::Texture((0..SIZE * SIZE).map(texel).collect())
            }
        }
    }

    /// F and B.
    fn at(&self, x: f64, y: f64, direct: bool) -> [f64; 2] {
        let Ends::Texture(texels) = self else {
            let Piece { front, back, .. } = Piece::new(x, y, direct);
            return [front, back];
        };
        let place = |depth: f64| {
            let at = depth.clamp(0.0, DEEPEST) / DEEPEST * (SIZE - 1) as f64;
            let below = (at as usize).min(SIZE - 2);
            (below, at - below as f64)
        };
        let ((i, u), (j, v)) = (place(x), place(y));
        let texel = |i: usize, j: usize, k: usize| f64::from(texels[i + SIZE * j][k]);
        [0, 1].map(|k| {
            let row = |j: usize| texel(i, j, k) + (texel(i + 1, j, k) - texel(i, j, k)) * u;
            row(j) + (row(j + 1) - row(j)) * v
        })
    }
}

impl Second {
    /// Adds all of `segment` in `pieces` equal ones.
    pub(super) fn add_segmented(
        &self,
        segment: &Segment,
        pieces: u32,
        scratch: &mut Scratch,
        light: &mut Gathered<f64>,
    ) {
        let direct = self.direct.is_some();
        let share = 1.0 / f64::from(pieces);
        let mut nodes = Nodes::default();
        for i in 0..pieces {
            // Four ends at a time make three pieces.
            let first = i % 3;
            if first == 0 {
                let last = f64::from(pieces);
                nodes = self.nodes(segment, None, each(|k| (f64::from(i) + k as f64).min(last) * share));
            }
            let (front, back) = (first as usize, first as usize + 1);
            let [x, y] = [front, back].map(|k| nodes.depth[k] * share);
            let weights = self.ends.at(x, y, direct);
            let color = |channel: usize| {
                let emitted = &nodes.color[channel];
                if direct {
                    return (emitted[front] * weights[0] + emitted[back] * weights[1]) * share;
                }
                // Where nothing is absorbed, the colour is that of the other end.
                let of = |k: usize, other: usize| {
                    let k = if nodes.depth[k] > 0.0 { k } else { other };
                    if nodes.depth[k] > 0.0 { emitted[k] / nodes.depth[k] } else { 0.0 }
                };
                of(front, back) * weights[0] + of(back, front) * weights[1]
            };
            light.add([0, 1, 2].map(color), opacity(0.5 * (x + y)));
        }
        scratch.panels += u64::from(pieces);
    }
}
