//! Pieces in which everything is smooth, as panels of Gauss's collocation with four nodes.
//!
//! The light of a segment solves C′ = q e^{−T}, T′ = τ. With the nodes of Gauss's rule, and T at each of them from the
//! polynomial through τ at all, one panel is a step of the implicit Runge–Kutta method of order 8 (Butcher, Implicit
//! Runge–Kutta Processes, 1964), which for this system takes no iteration.

use super::lanes::{Lanes, each, exp, opacity};
use super::light::{ANGLES, angle, cone_sides};
use super::nodes::{Nodes, Piece};
use super::{Bounded, Gathered, Ready, Scratch, Second, Segment, Table};
use crate::transfer::shading::{Origin, Shading};
use crate::transfer::{Convention, bivariate::Shape, interpolate, interpolate_all};

/// Nodes of a panel.
const NODES: usize = 4;
/// The share of what may change in a panel up to which three nodes are enough: they are exact for degree 5.
pub(super) const EASY: f64 = 0.5;
/// The greatest depth of a panel of three nodes.
const SHALLOW: f64 = 0.3;
/// The greatest depth of a panel.
pub(super) const DEEPEST: f64 = 1.5;
/// By how many σ a Gaussian's argument moves in a panel, and by how many radians a sinusoid's, at most.
pub(super) const STEP: [f64; 2] = [1.2, 1.5];
/// By what factor the argument of a power or a logarithm changes between the nodes of a panel at most.
pub(super) const FACTOR: f64 = 2.0;
/// The shortest panels that are halved as they bend, and those that are shortened as they are deep, as shares of a segment.
const SHORTEST: f64 = 1e-7;
/// See [`SHORTEST`].
const THINNEST: f64 = 1e-14;
/// Transmittance of a segment below which f32 tells nothing from nothing.
const DARK: f64 = 1e-12;
/// Places of a segment that are one.
const SAME: f64 = 1e-12;

/// Gauss's rule on [0, 1], and the integrals of the polynomials through its nodes from 0 to each of them.
#[derive(Debug, Clone)]
pub(super) struct Rule {
    pub(super) nodes: Lanes,
    pub(super) weights: Lanes,
    /// Of each polynomial, to each node.
    pub(super) to_node: [Lanes; NODES],
}

impl Rule {
    /// Of `N` nodes; where they are fewer than lanes, the last stands in the others without weight.
    fn new<const N: usize>(nodes: [f64; N], weights: [f64; N]) -> Self {
        let polynomial = |j: usize, x: f64| -> f64 {
            let factor = |k: usize| (x - nodes[k]) / (nodes[j] - nodes[k]);
            (0..N).filter(|&k| k != j).map(factor).product()
        };
        // The rule itself is exact for them.
        let integral = |i: usize, j: usize| -> f64 {
            (0..N).map(|k| nodes[i] * weights[k] * polynomial(j, nodes[i] * nodes[k])).sum()
        };
        let to_node = |j: usize| each(|i| if j < N { integral(i.min(N - 1), j) } else { 0.0 });
        Rule {
            nodes: each(|i| nodes[i.min(N - 1)]),
            weights: each(|i| if i < N { weights[i] } else { 0.0 }),
            to_node: std::array::from_fn(to_node),
        }
    }

    /// The places of a panel of length `h` at `u`.
    #[inline(always)]
    fn places(&self, u: f64, h: f64) -> Lanes {
        each(|i| u + h * self.nodes[i])
    }

    /// Adds a panel of length `h`, of `depth`, with such nodes.
    #[inline(always)]
    fn add(&self, nodes: &Nodes, h: f64, depth: f64, direct: bool, light: &mut Gathered<f64>) {
        let before = each(|i| (0..NODES).map(|j| self.to_node[j][i] * nodes.depth[j]).sum::<f64>() * -h);
        let seen = exp(before);
        let seen = each(|i| seen[i] * self.weights[i] * h);
        let sum = |of: &Lanes| (0..NODES).map(|i| seen[i] * of[i]).sum::<f64>();
        let (emitted, opacity) = (nodes.color.each_ref().map(sum), opacity(depth));
        // What one colour emits is that times the opacity, whatever the nodes miss of it.
        let absorbed = if direct { 0.0 } else { sum(&nodes.depth) };
        let right = if absorbed > 0.0 { opacity / absorbed } else { 1.0 };
        light.add(emitted.map(|c| c * right), opacity);
    }

    /// The depth of a panel of length `h`.
    #[inline(always)]
    fn depth(&self, nodes: &Nodes, h: f64) -> f64 {
        (0..NODES).map(|i| self.weights[i] * nodes.depth[i]).sum::<f64>() * h
    }
}

/// The rules of three and of four nodes.
#[derive(Debug, Clone)]
pub(super) struct Rules {
    pub(super) three: Rule,
    pub(super) four: Rule,
}

impl Default for Rules {
    fn default() -> Self {
        let root = |sign: f64| (3.0 / 7.0 + sign * 2.0 / 7.0 * 1.2_f64.sqrt()).sqrt();
        let nodes = [-root(1.0), -root(-1.0), root(-1.0), root(1.0)].map(|x| 0.5 + 0.5 * x);
        let weights = [-1.0, 1.0, 1.0, -1.0].map(|sign: f64| (18.0 + sign * 30_f64.sqrt()) / 72.0);
        let three = [-1.0, 0.0, 1.0].map(|sign: f64| 0.5 + sign * 0.15_f64.sqrt());
        let three = Rule::new(three, [5.0, 8.0, 5.0].map(|w| w / 18.0));
        Rules { three, four: Rule::new(nodes, weights) }
    }
}

impl Bounded {
    /// Panels per unit of u that its bends ask for.
    fn rate(&self, segment: &Segment) -> f64 {
        match (&self.widget.shape, &self.wave) {
            (Shape::Gaussian { sigma, .. }, _) => {
                let [x, y] = [0, 1].map(|k| segment.rise[k] / sigma[k]);
                (x * x + y * y).sqrt() / STEP[0]
            }
            (_, Some((wave, profile))) => (wave.rise(segment.rise) * profile.turn.radians()).abs() / STEP[1],
            _ => 0.0,
        }
    }
}

/// The cosines of the angles by which normals may turn in a panel, and in an easy one.
pub(super) fn cosines(shading: Option<&Shading>) -> [f64; 2] {
    let most = shading.and_then(Shading::shade).map_or(ANGLES[0], angle);
    [1.0, EASY].map(|share| (most * share).cos())
}

/// Where beyond `u` a linear function, `at` where it is 0 and with such a `rise`, has `value`.
fn pass(at: f64, rise: f64, value: f64, u: f64) -> f64 {
    let place = (value - at) / rise;
    if place > u + SAME { place } else { f64::INFINITY }
}

/// Where beyond `u` it next is a whole number from `least` to `most`.
fn pass_whole(at: f64, rise: f64, [least, most]: [f64; 2], u: f64) -> f64 {
    let now = at + rise * u;
    let next = if rise > 0.0 {
        ((now + 1e-9).floor() + 1.0).max(least)
    } else if rise < 0.0 {
        ((now - 1e-9).ceil() - 1.0).min(most)
    } else {
        return f64::INFINITY;
    };
    if (least..=most).contains(&next) { pass(at, rise, next, u) } else { f64::INFINITY }
}

/// Where beyond `u` a segment next passes a line between the texels of a table.
///
/// Not inlined: what is no table would be divided as if it were one ahead of the decision, and its bits are denormal numbers.
#[inline(never)]
fn next_texel(table: &Table, segment: &Segment, u: f64) -> f64 {
    let (first, last) = (table.place(segment.at), table.place(segment.values(1.0)));
    let next = |k: usize| pass_whole(first[k], last[k] - first[k], [0.0, table.size()[k] as f64 - 1.0], u);
    next(0).min(next(1))
}

/// Where beyond `u` it next passes a knot.
fn pass_knot<T>(knots: &[(f64, T)], at: f64, rise: f64, u: f64) -> f64 {
    let now = at + rise * (u + SAME);
    let next = if rise > 0.0 {
        knots.get(knots.partition_point(|k| k.0 <= now))
    } else if rise < 0.0 {
        knots[..knots.partition_point(|k| k.0 < now)].last()
    } else {
        None
    };
    next.map_or(f64::INFINITY, |k| pass(at, rise, k.0, u))
}

impl Second {
    /// Adds the part of `segment` between `ends`, where the widgets of `scratch.active` are.
    #[inline(always)]
    pub(super) fn smooth(&self, segment: &Segment, ends: [f64; 2], scratch: &mut Scratch, light: &mut Gathered<f64>) {
        let mut u = ends[0];
        while u < ends[1] && light.transmittance > DARK {
            let next = self.next(segment, &scratch.active, u).min(ends[1]);
            let piece = self.piece(segment, [u, next], &scratch.active);
            if self.direct.is_some() || !piece.clear {
                scratch.panels += self.panels(segment, &piece, light);
            }
            u = next;
        }
    }

    /// Where beyond `u` the function next turns or jumps.
    fn next(&self, segment: &Segment, active: &[usize], u: f64) -> f64 {
        let [at, rise] = [segment.at, segment.rise];
        let mut next = pass_knot(&self.factor, at[1], rise[1], u);
        match &self.source {
            Ready::Widgets(widgets) => {
                for (wave, profile) in active.iter().filter_map(|&i| widgets[i].wave.as_ref()) {
                    let (p, d) = (wave.phase(at), wave.rise(rise));
                    let far = [f64::NEG_INFINITY, f64::INFINITY];
                    next = profile.turns().iter().fold(next, |next, turn| next.min(pass_whole(p - turn, d, far, u)));
                }
            }
            Ready::Table(table) => {
                next = next.min(next_texel(table, segment, u));
            }
            Ready::Scalar { color, opacity, .. } => {
                next = next.min(pass_knot(color, at[0], rise[0], u)).min(pass_knot(opacity, at[0], rise[0], u));
            }
        }
        if let Some(shading) = &self.shading {
            let Segment { vector, turn, place, along, length, .. } = *segment;
            if shading.silhouette().is_some() || self.lights.iter().any(|l| l.origin == Origin::Headlight) {
                next = next.min(pass(vector.dot(along), turn.dot(along), 0.0, u));
            }
            for light in &self.lights {
                match light.origin {
                    Origin::Headlight => {}
                    Origin::Direction(to) => next = next.min(pass(vector.dot(to), turn.dot(to), 0.0, u)),
                    Origin::Position(p) => {
                        let (to, step) = (p - place, along * -length);
                        let (a, b, c) = (turn.dot(step), vector.dot(step) + turn.dot(to), vector.dot(to));
                        let beyond = |next: f64, x: f64| if x > u + SAME { next.min(x) } else { next };
                        next = roots(a, b, c).into_iter().fold(next, beyond);
                        if let Some(cone) = &light.cone {
                            next = cone_sides(cone, -to, -step).into_iter().fold(next, beyond);
                        }
                    }
                }
            }
        }
        next
    }

    /// What is linear between two such places.
    fn piece<'a>(&self, segment: &Segment, ends: [f64; 2], active: &'a [usize]) -> Piece<'a> {
        // From places inside: at the ends is what either side has.
        let inside = [0.25, 0.75].map(|x| segment.values(ends[0] + (ends[1] - ends[0]) * x));
        let outward = |[p, q]: [f64; 2]| [p - (q - p) * 0.5, q + (q - p) * 0.5].map(|x| x.max(0.0));
        let mut knots = [[0.0; 4]; 2];
        if matches!(self.source, Ready::Scalar { .. }) {
            let all = inside.map(|[s, _]| self.scalar(s));
            for k in 0..4 {
                [knots[0][k], knots[1][k]] = outward([all[0][k], all[1][k]]);
            }
        }
        let factor =
            if self.factor.is_empty() { [1.0; 2] } else { outward(inside.map(|[_, g]| self.gradient_factor(g))) };
        let clear = matches!(self.source, Ready::Scalar { .. }) && knots[0][3] == 0.0 && knots[1][3] == 0.0;
        Piece { ends, knots, factor, active, clear: clear || factor == [0.0; 2] }
    }

    /// Adds panels until the piece is done, and counts them.
    #[inline(always)]
    fn panels(&self, segment: &Segment, piece: &Piece, light: &mut Gathered<f64>) -> u64 {
        let [begin, end] = piece.ends;
        let bend = (end - begin) * self.rate(segment, piece);
        // A logarithm is no low polynomial.
        let may_be_easy = bend < EASY && self.convention == Convention::Extinction;
        if may_be_easy && self.add_easy(segment, piece, light) {
            return 1;
        }
        let longest = (end - begin) / bend.ceil().max(1.0);
        let (mut u, mut h, mut count) = (begin, longest, 0);
        while u < end && light.transmittance > DARK {
            let left = end - u;
            // No sliver is left to the last.
            h = if left < h * (1.0 + SAME) {
                left
            } else if left < 2.0 * h {
                left / 2.0
            } else {
                h
            };
            // What lights do is judged before it is computed.
            if h > SHORTEST && !self.is_evenly_lit(segment, u, h, 1.0) {
                h *= 0.5;
                continue;
            }
            let rule = &self.rules.four;
            let nodes = self.nodes(segment, Some(piece), rule.places(u, h));
            let depth = rule.depth(&nodes, h);
            if depth > DEEPEST && h > THINNEST {
                h *= (1.0 / depth).clamp(0.01, 0.6);
                continue;
            }
            if h > SHORTEST && !self.is_tame(segment, &nodes, [u, u + h], 1.0) {
                h *= 0.5;
                continue;
            }
            rule.add(&nodes, h, depth, self.direct.is_some(), light);
            count += 1;
            u += h;
            h = (2.0 * h).min(longest);
        }
        count
    }

    /// Adds all of a piece as one panel of three nodes, if little enough changes in it; else nothing, and says so.
    #[inline(always)]
    fn add_easy(&self, segment: &Segment, piece: &Piece, light: &mut Gathered<f64>) -> bool {
        let ([begin, end], rule) = (piece.ends, &self.rules.three);
        let h = end - begin;
        if !self.is_evenly_lit(segment, begin, h, EASY) {
            return false;
        }
        let nodes = self.nodes(segment, Some(piece), rule.places(begin, h));
        let depth = rule.depth(&nodes, h);
        let is_easy = depth <= SHALLOW && self.is_tame(segment, &nodes, [begin, end], EASY);
        if is_easy {
            rule.add(&nodes, h, depth, self.direct.is_some(), light);
        }
        is_easy
    }

    /// Panels per unit of u that the bends of widgets ask for.
    #[inline(always)]
    fn rate(&self, segment: &Segment, piece: &Piece) -> f64 {
        let Ready::Widgets(widgets) = &self.source else { return 0.0 };
        piece.active.iter().map(|&i| widgets[i].rate(segment)).fold(0.0, f64::max)
    }

    /// Whether a widget bends so little between two places that one panel of three nodes may do.
    pub(super) fn is_short(&self, bounded: &Bounded, segment: &Segment, ends: [f64; 2]) -> bool {
        let length = ends[1] - ends[0];
        // A wave that turns is more than one piece.
        let turns = bounded.wave.as_ref().map_or(0.0, |(wave, _)| wave.rise(segment.rise).abs());
        length * bounded.rate(segment).max(turns) < EASY
            && length * self.depth_of_peak(&bounded.widget, segment) < SHALLOW
    }

    /// Whether what is no polynomial changes little enough between two places: by a `share` of what may change in a panel.
    #[inline(always)]
    fn is_tame(&self, segment: &Segment, nodes: &Nodes, [from, to]: [f64; 2], share: f64) -> bool {
        let factor = 1.0 + (FACTOR - 1.0) * share;
        if self.convention == Convention::Opacity {
            let [least, most] = nodes.left.iter().fold([f64::MAX, 0.0], |[l, m], n| [n.min(l), n.max(m)]);
            if most > factor * least {
                return false;
            }
        }
        let Some(shading) = &self.shading else { return true };
        let [a, b] = [from, to].map(|u| segment.vector + segment.turn * u);
        let cosine = self.cosines[usize::from(share < 1.0)];
        let product = (a.length_squared() * b.length_squared()).sqrt();
        if product > self.flat * self.flat && a.dot(b) < cosine * product {
            return false;
        }
        if shading.silhouette().is_some_and(|p| p.fract() != 0.0) {
            let edge = |u: f64| {
                let v = segment.vector + segment.turn * u;
                (1.0 - v.dot(segment.along).abs() / v.length().max(self.flat)).max(1e-5)
            };
            let edges = self.rules.four.nodes.map(|x| edge(from + (to - from) * x));
            let [least, most] = edges.iter().fold([f64::MAX, 0.0], |[l, m], e| [e.min(l), e.max(m)]);
            return most <= factor * least;
        }
        true
    }

    /// Red, green, blue and opacity of the functions of s.
    pub(super) fn scalar(&self, s: f64) -> [f64; 4] {
        let Ready::Scalar { color, opacity, clamp } = &self.source else { return [0.0; 4] };
        let [r, g, b] = interpolate_all(color, s, *clamp, |c| *c);
        [r, g, b, interpolate(opacity, s, *clamp, |a| *a)]
    }

    /// h(g).
    pub(super) fn gradient_factor(&self, g: f64) -> f64 {
        interpolate(&self.factor, g, true, |h| *h)
    }
}

/// The real roots of a x² + b x + c.
pub(super) fn roots(a: f64, b: f64, c: f64) -> [f64; 2] {
    let d = b * b - 4.0 * a * c;
    if d < 0.0 {
        return [f64::NAN; 2];
    }
    let q = -0.5 * (b + d.sqrt().copysign(b));
    [q / a, c / q]
}
