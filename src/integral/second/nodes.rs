//! What four places of a segment emit and absorb.

use super::closed::{Profile, Turn};
use super::lanes::{Lanes, cos, each, exp, fraction, power, sin};
use super::{Bounded, Ready, Second, Segment};
use crate::transfer::Convention;
use crate::transfer::bivariate::{Shape, Sine, Table};

/// What is linear between two places of a segment, at them; and what is there.
pub(super) struct Piece<'a> {
    pub(super) ends: [f64; 2],
    /// Red, green, blue and opacity of the functions of s.
    pub(super) knots: [[f64; 4]; 2],
    pub(super) factor: [f64; 2],
    pub(super) active: &'a [usize],
    /// Nothing is absorbed in it.
    pub(super) clear: bool,
}

/// What places emit and absorb over the whole segment.
#[derive(Clone, Copy, Default)]
pub(super) struct Nodes {
    pub(super) color: [Lanes; 3],
    pub(super) depth: Lanes,
    /// What is left of 1 by the greatest opacity, where its logarithm counts.
    pub(super) left: Lanes,
}

/// What a table has at (s, g).
///
/// Not inlined: what is no table would be divided as if it were one ahead of the decision, and its bits are denormal numbers.
#[inline(never)]
pub(super) fn texel(table: &Table, at: [f64; 2]) -> [f64; 4] {
    table.at(at)
}

/// The greatest opacity below 1.
const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

impl Bounded {
    /// The greatest opacity that places of a segment may have. A peak of opacity 1 that the segment runs over is solid at
    /// one place only, which no integral sees; a node there would count as solid for all of its share.
    fn most(&self, segment: &Segment, convention: Convention) -> f64 {
        let is_flat = match (&self.widget.shape, &self.wave) {
            (Shape::Gaussian { .. }, _) => segment.rise == [0.0; 2],
            (_, Some((wave, _))) => wave.rise(segment.rise) == 0.0,
            _ => true,
        };
        if is_flat || convention == Convention::Extinction { f64::INFINITY } else { BELOW_ONE }
    }

    /// How high it is at places of a segment, in its box or not, as a share of its greatest opacity.
    #[inline(always)]
    fn heights(&self, segment: &Segment, u: Lanes) -> Lanes {
        if let Shape::Gaussian { center, sigma } = &self.widget.shape {
            let linear = |k: usize| {
                let scale = 1.0 / sigma[k];
                ((segment.at[k] - center[k]) * scale, segment.rise[k] * scale)
            };
            let ((s, ds), (g, dg)) = (linear(0), linear(1));
            return exp(each(|i| {
                let (x, y) = (s + ds * u[i], g + dg * u[i]);
                -0.5 * (x * x + y * y)
            }));
        }
        let Some((wave, profile)) = &self.wave else { return [1.0; 4] };
        let (p, d) = (wave.phase(segment.at), wave.rise(segment.rise));
        profile.heights(each(|i| p + d * u[i]))
    }
}

impl Profile {
    /// [`Self::height`] at four phases.
    #[inline(always)]
    pub(super) fn heights(&self, p: Lanes) -> Lanes {
        let z = fraction(p);
        let heights = match self.turn {
            Turn::Triangle => each(|i| 2.0 * z[i].abs()),
            Turn::Sine(Sine::Abs) => {
                let sin = sin(z);
                each(|i| sin[i].abs())
            }
            Turn::Sine(Sine::Positive) => {
                let (sin, cos) = (sin(z), cos(z));
                each(|i| (2.0 * sin[i] * cos[i]).max(0.0))
            }
            Turn::Sine(Sine::Raised) => {
                let sin = sin(z);
                each(|i| sin[i] * sin[i])
            }
        };
        if self.floor > 0.0 {
            let scale = 1.0 / (1.0 - self.floor);
            return each(|i| ((heights[i] - self.floor) * scale).max(0.0));
        }
        heights
    }
}

impl Second {
    /// What is at the places `u`; of a `piece`, or what they are by themselves, whatever is between them.
    #[inline(always)]
    pub(super) fn nodes(&self, segment: &Segment, piece: Option<&Piece>, u: Lanes) -> Nodes {
        let absorbing = segment.length / self.unit;
        let shining = self.direct.map(|e| e * segment.length);
        let (mut color, mut white, mut depth, mut most) = ([[0.0; 4]; 3], [0.0; 4], [0.0; 4], [0.0_f64; 4]);
        let mut add = |rgb: [Lanes; 3], a: Lanes, seen: Lanes| {
            let tau = match self.convention {
                Convention::Extinction => each(|i| a[i] * absorbing),
                Convention::Opacity => a.map(|a| self.extinction(a) * absorbing),
            };
            let q = shining.map_or(tau, |e| each(|i| e * seen[i]));
            for k in 0..3 {
                color[k] = each(|i| color[k][i] + rgb[k][i] * q[i]);
            }
            white = each(|i| white[i] + q[i]);
            depth = each(|i| depth[i] + tau[i]);
            most = each(|i| most[i].max(a[i]));
        };
        let mut factor = [1.0; 4];
        match (&self.source, piece) {
            (Ready::Widgets(widgets), Some(piece)) => {
                for &i in piece.active {
                    let bounded = &widgets[i];
                    let (heights, most) = (bounded.heights(segment, u), bounded.most(segment, self.convention));
                    let a = each(|i| (bounded.widget.opacity * heights[i]).min(most));
                    add(bounded.widget.color.map(|c| [c; 4]), a, [1.0; 4]);
                }
            }
            (Ready::Widgets(widgets), None) => {
                for bounded in widgets {
                    let holds = u.map(|u| f64::from(bounded.widget.holds(segment.values(u))));
                    let (heights, most) = (bounded.heights(segment, u), bounded.most(segment, self.convention));
                    let a = each(|i| (bounded.widget.opacity * heights[i] * holds[i]).min(most));
                    add(bounded.widget.color.map(|c| [c; 4]), a, holds);
                }
            }
            (Ready::Table(table), _) => {
                let texels = u.map(|u| texel(table, segment.values(u)));
                let channel = |k: usize| each(|i| texels[i][k]);
                add([0, 1, 2].map(channel), channel(3), [1.0; 4]);
            }
            (Ready::Scalar { .. }, Some(Piece { ends, knots, .. })) => {
                let scale = 1.0 / (ends[1] - ends[0]);
                let channel = |k: usize| {
                    let rise = (knots[1][k] - knots[0][k]) * scale;
                    each(|i| knots[0][k] + rise * (u[i] - ends[0]))
                };
                add([0, 1, 2].map(channel), channel(3), [1.0; 4]);
            }
            (Ready::Scalar { .. }, None) => {
                let all = u.map(|u| self.scalar(segment.values(u)[0]));
                let channel = |k: usize| each(|i| all[i][k]);
                add([0, 1, 2].map(channel), channel(3), [1.0; 4]);
            }
        }
        match piece {
            _ if self.factor.is_empty() => {}
            Some(Piece { ends, factor: [from, to], .. }) => {
                let rise = (to - from) / (ends[1] - ends[0]);
                factor = each(|i| from + rise * (u[i] - ends[0]));
            }
            None => factor = u.map(|u| self.gradient_factor(segment.values(u)[1])),
        }
        if let Some(shading) = &self.shading {
            let normal = self.normals(segment, u);
            if let Some(p) = shading.silhouette() {
                let edge = each(|i| {
                    let [x, y, z] = normal.map(|n| n[i]);
                    (1.0 - (x * segment.along.x + y * segment.along.y + z * segment.along.z).abs()).max(0.0)
                });
                let edge = power(edge, p);
                factor = each(|i| factor[i] * edge[i]);
            }
            if let Some(shade) = shading.shade() {
                self.lit(shade, segment, u, normal, &mut color, white);
            }
        }
        if self.direct.is_none() {
            color = color.map(|c| each(|i| c[i] * factor[i]));
        }
        Nodes { color, depth: each(|i| depth[i] * factor[i]), left: each(|i| (1.0 - most[i]).max(1e-9)) }
    }

    /// The gradient's directions at places; zero where it is as good as none.
    #[inline(always)]
    fn normals(&self, segment: &Segment, u: Lanes) -> [Lanes; 3] {
        let Segment { vector, turn, .. } = *segment;
        let v = [0, 1, 2].map(|k| each(|i| vector[k] + turn[k] * u[i]));
        let scale = each(|i| {
            let length = (v[0][i] * v[0][i] + v[1][i] * v[1][i] + v[2][i] * v[2][i]).sqrt();
            if length > self.flat { 1.0 / length } else { 0.0 }
        });
        v.map(|v| each(|i| v[i] * scale[i]))
    }
}
