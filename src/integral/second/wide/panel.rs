//! Panels of segments side by side.

#![allow(clippy::needless_range_loop, reason = "closures over arrays of vectors are not inlined")]

use super::nodes::{Line, Node, OPAQUE, dot, turn_little};
use super::{Cell, Form, MOST_LINES, Room, Segments, Source, Taken, Texels, Wide};
use crate::integral::Knots;
use crate::integral::floats::{FAINT, Floats, LANES, erf, exp, faded, faint_opacity, opacity};
use crate::integral::second::closed::Profile;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, mask32x16};

/// The share of what may change in a panel of four nodes that may in one of three: by what a Gaussian's argument moves then, its
/// integral is off by 6e-6 of its peak.
pub(super) const SHARE: f64 = 0.8;
/// Nodes of a panel.
const MOST_NODES: usize = 4;
/// By how much longer panels of four nodes are than those of three.
pub(super) const LONGER: f32 = 1.8;
/// By what factor the argument of a logarithm changes in a panel.
const FACTOR: f32 = 1.4;
/// The most panels that bends may ask for.
pub(super) const MOST_PANELS: f32 = 32.0;
/// By how often a panel in which a normal turns too far is halved before it is summed up.
pub(super) const HALVES: usize = 8;
/// Steps of one segment after another, taken or not.
const MOST_STEPS: usize = 128;
/// The shortest panels, as shares of a segment, unless they end where something turns.
const SHORTEST: f32 = 1e-3;
/// Places that are one, and phases.
pub(super) const SAME: f32 = 1e-6;
pub(super) const NEAR: f32 = 1e-5;
/// Transmittance of a segment below which nothing is told from nothing.
const DARK: f32 = 1e-12;
/// The greatest phase: f32 tells 1e-5 of it.
pub(super) const FAR: f32 = 200.0;
pub(super) const EVERYWHERE: [f32; 2] = [f32::NEG_INFINITY, f32::INFINITY];

/// Gauss's rule of three or four nodes in f32, and of each polynomial through them the integral to each.
#[derive(Debug, Clone)]
pub(super) struct Rule {
    count: usize,
    nodes: [f32; MOST_NODES],
    weights: [f32; MOST_NODES],
    to_node: [[f32; MOST_NODES]; MOST_NODES],
}

impl Rule {
    /// Of the first `count` nodes of `rule`.
    pub(super) fn new(rule: &crate::integral::second::panel::Rule, count: usize) -> Self {
        let all = |v: &[f64; MOST_NODES]| v.map(|x| x as f32);
        let (nodes, weights) = (all(&rule.nodes), all(&rule.weights));
        Rule { count, nodes, weights, to_node: rule.to_node.each_ref().map(all) }
    }

    /// Nodes, weights, and of each polynomial the integral to each node: of three.
    pub(super) fn parts(&self) -> ([f32; 3], [f32; 3], [[f32; 3]; 3]) {
        let three = |v: &[f32; MOST_NODES]| [v[0], v[1], v[2]];
        let to = &self.to_node;
        (three(&self.nodes), three(&self.weights), [three(&to[0]), three(&to[1]), three(&to[2])])
    }
}

/// What holds in all of a panel.
pub(super) struct Held<S: Simd> {
    pub(super) line: Line<S, 4>,
    pub(super) factor: Line<S, 1>,
    /// The first of four texels.
    pub(super) texel: [Floats<S>; 2],
    /// In all of a segment, the gradient along the ray in front, and by how much that rises.
    pub(super) on_ray: [Floats<S>; 2],
}

/// Whether what runs from one to the other end passes a whole number from `least` to `most`.
pub(super) fn passes_whole([a, b]: [f32; 2], [least, most]: [f32; 2]) -> bool {
    let (low, high) = (a.min(b) - NEAR, a.max(b) + NEAR);
    low.ceil().max(least) <= high.min(most)
}

/// Whether a wave turns between two phases.
pub(super) fn turns(profile: &Profile, [low, high]: [f32; 2]) -> bool {
    profile.turns().iter().any(|&turn| passes_whole([low - turn as f32, high - turn as f32], EVERYWHERE))
}

/// The gradient along a direction in front, and by how much that rises.
#[inline(always)]
pub(super) fn towards<S: Simd, const N: usize>(segments: &Segments<S, N>, to: [Floats<S>; 3]) -> [Floats<S>; 2] {
    let [x, y, z] = [2.min(N - 1), 3.min(N - 1), 4.min(N - 1)];
    let Segments { at, rise, .. } = segments;
    [dot([at[x], at[y], at[z]], to), dot([rise[x], rise[y], rise[z]], to)]
}

/// The line, of some, that values are on.
#[inline(always)]
fn line<S: Simd, const C: usize>(simd: S, knots: &Knots<f32>, lines: [u16; 2], at: Floats<S>) -> Line<S, C> {
    let [first, last] = [usize::from(lines[0]), usize::from(lines[1])];
    let zero = Floats::splat(simd, 0.0);
    let mut line = Line { start: Floats::splat(simd, knots.s[first]), value: [zero; C], slope: [zero; C] };
    for c in 0..C {
        line.value[c] = Floats::splat(simd, knots.value[first][c]);
        line.slope[c] = Floats::splat(simd, knots.slope[first][c]);
    }
    for k in first + 1..=last {
        let start = Floats::splat(simd, knots.s[k]);
        let beyond = at.simd_ge(start);
        line.start = beyond.select(start, line.start);
        for c in 0..C {
            line.value[c] = beyond.select(Floats::splat(simd, knots.value[k][c]), line.value[c]);
            line.slope[c] = beyond.select(Floats::splat(simd, knots.slope[k][c]), line.slope[c]);
        }
    }
    line
}

/// The lines of a cell that some of its segments are on.
#[inline(always)]
fn lines_of<S: Simd>(
    simd: S,
    knots: &Knots<f32>,
    lines: [u16; 2],
    at: Floats<S>,
    rise: Floats<S>,
    there: mask32x16<S>,
) -> [u16; 2] {
    let [first, last] = lines;
    if last - first <= 2 {
        return lines;
    }
    let (low, high) = (at.min(at + rise), at.max(at + rise));
    let low = there.select(low, Floats::splat(simd, f32::INFINITY)).reduce_min();
    let high = there.select(high, Floats::splat(simd, f32::NEG_INFINITY)).reduce_max();
    let [a, b] = knots.intervals(low, high);
    let a = (a as u16).max(first);
    [a, (b as u16).min(last).max(a)]
}

impl Texels {
    /// Finds the texels that places are in, and what they hold.
    #[inline(always)]
    fn hold<S: Simd>(&self, simd: S, s: Floats<S>, g: Floats<S>, room: &mut Room) -> [Floats<S>; 2] {
        let (zero, mut first) = (Floats::splat(simd, 0.0), [s, g]);
        for k in 0..2 {
            let last = self.size[k] as f32 - 1.0;
            let at = first[k].mul_add(Floats::splat(simd, self.scale[k]), Floats::splat(simd, self.offset[k]));
            let below = at.max(zero).min(Floats::splat(simd, last)).floor();
            first[k] = below.min(Floats::splat(simd, (last - 1.0).max(0.0)));
        }
        self.gather(first[0].to_array(), first[1].to_array(), room);
        first
    }

    #[inline(never)]
    fn gather(&self, i: [f32; LANES], j: [f32; LANES], room: &mut Room) {
        let [columns, rows] = self.size;
        let [right, up] = [usize::from(columns > 1), columns * usize::from(rows > 1)];
        for l in 0..LANES {
            let first = i[l] as usize + columns * j[l] as usize;
            let four = [first, first + right, first + up, first + right + up].map(|t| self.all[t]);
            for c in 0..4 {
                let [a, b, d, e] = four.map(|t| t[c]);
                let (across, along) = (b - a, d - a);
                (room.texels[c][0][l], room.texels[c][1][l]) = (a, across);
                (room.texels[c][2][l], room.texels[c][3][l]) = (along, (e - d) - across);
            }
        }
    }
}

impl Wide {
    /// What is on the places `middle` of panels.
    #[inline(always)]
    fn hold<S: Simd, const N: usize>(
        &self,
        simd: S,
        cell: &Cell,
        segments: &Segments<S, N>,
        middle: Floats<S>,
        on_ray: [Floats<S>; 2],
        room: &mut Room,
    ) -> Held<S> {
        let zero = Floats::splat(simd, 0.0);
        let mut held = Held {
            line: Line { start: zero, value: [zero; 4], slope: [zero; 4] },
            factor: Line { start: zero, value: [zero; 1], slope: [zero; 1] },
            texel: [zero; 2],
            on_ray,
        };
        let s = segments.rise[0].mul_add(middle, segments.at[0]);
        let g = segments.rise[1].mul_add(middle, segments.at[1]);
        match &self.source {
            Source::Widgets(_) if cell.clipped == 0 => {}
            Source::Widgets(widgets) => {
                for k in 0..cell.count() {
                    if cell.clips(k) {
                        let [of_s, of_g] = &widgets[usize::from(cell.active[k])].domain;
                        let between = |v: Floats<S>, [low, high]: [f32; 2]| {
                            v.simd_ge(Floats::splat(simd, low)) & v.simd_le(Floats::splat(simd, high))
                        };
                        let inside = between(s, *of_s) & between(g, *of_g);
                        inside.select(Floats::splat(simd, 1.0), zero).store_array(&mut room.on[k]);
                    }
                }
            }
            Source::Scalar(knots) => held.line = line(simd, knots, cell.lines, s),
            Source::Texels(texels) => held.texel = texels.hold(simd, s, g, room),
        }
        if let Some(factor) = &self.factor {
            held.factor = line(simd, factor, cell.factors, g);
        }
        held
    }

    /// Light of panels of length `h`, and their opacity, which is that of `depth`.
    #[inline(always)]
    fn panel<S: Simd>(
        &self,
        simd: S,
        rule: &Rule,
        nodes: &[Node<S>; MOST_NODES],
        depths: [Floats<S>; MOST_NODES],
        depth: Floats<S>,
        shone: Floats<S>,
    ) -> ([Floats<S>; 3], Floats<S>) {
        let zero = Floats::splat(simd, 0.0);
        let (mut red, mut green, mut blue, mut absorbed) = (zero, zero, zero, zero);
        let Rule { count, weights, to_node, .. } = rule;
        for i in 0..*count {
            let of = |j: usize| Floats::splat(simd, to_node[j][i]);
            let mut before = depths[0].mul_add(of(0), depths[1].mul_add(of(1), depths[2] * of(2)));
            if *count > 3 {
                before = depths[3].mul_add(of(3), before);
            }
            let seen = faded(simd, before) * weights[i];
            red = seen.mul_add(nodes[i].color[0], red);
            green = seen.mul_add(nodes[i].color[1], green);
            blue = seen.mul_add(nodes[i].color[2], blue);
            absorbed = seen.mul_add(nodes[i].tau, absorbed);
        }
        let alpha = faint_opacity(simd, depth);
        let mut scale = shone;
        if self.shining.is_none() {
            // What one colour emits is that times the opacity, whatever the nodes miss of it.
            let some = absorbed.simd_gt(Floats::splat(simd, f32::MIN_POSITIVE));
            scale = some.select(alpha / absorbed, zero);
        }
        ([red * scale, green * scale, blue * scale], alpha)
    }

    /// One Gaussian alone: the closed form of [`super::closed`], or its series where little bends.
    #[inline(always)]
    pub(super) fn gaussian<S: Simd, const N: usize>(
        &self,
        simd: S,
        cell: &Cell,
        segments: &Segments<S, N>,
    ) -> Taken<S> {
        let (zero, of) = (Floats::splat(simd, 0.0), Floats::splat);
        let mut taken = Taken { color: [zero; 3], alpha: zero, left: 0, panels: 0 };
        let Source::Widgets(widgets) = &self.source else { return taken };
        let widget = &widgets[usize::from(cell.active[0])];
        let Form::Gaussian { scale, offset } = &widget.form else { return taken };
        let (dx, dy) = (segments.rise[0] * scale[0], segments.rise[1] * scale[1]);
        // In the middle.
        let (half, one) = (of(simd, 0.5), of(simd, 1.0));
        let x = half.mul_add(dx, segments.at[0].mul_add(of(simd, scale[0]), of(simd, offset[0])));
        let y = half.mul_add(dy, segments.at[1].mul_add(of(simd, scale[1]), of(simd, offset[1])));
        let slope = x.mul_add(dx, y * dy);
        let (s, c) = (slope * slope, dx.mul_add(dx, dy * dy));
        let two = (s - c) * 0.5;
        let four = s * (s * (1.0 / 24.0) - c * 0.25) + c * c * 0.125;
        let six = s * (s * (s * (1.0 / 720.0) - c * (1.0 / 48.0)) + c * c * (1.0 / 16.0)) - c * c * c * (1.0 / 48.0);
        let mean = two.mul_add(of(simd, 1.0 / 12.0), one) + four.mul_add(of(simd, 1.0 / 80.0), six * (1.0 / 448.0));
        let mut mean = exp(simd, x.mul_add(x, y * y) * -0.5) * mean;
        let bends = s.simd_ge(of(simd, 0.25)) | c.simd_ge(of(simd, 0.1));
        if bends.to_bitmask() != 0 {
            // |x|²/2 is (A t + B)² + C₀ for t from −½ to ½.
            let steep = (c * 0.5).max(of(simd, 1e-6)).sqrt();
            let over = one / steep;
            let before = slope * 0.5 * over;
            let aside = x * dy - y * dx;
            let peak = exp(simd, aside * aside * -0.25 * over * over);
            let ends = erf(simd, steep.mul_add(half, before)) - erf(simd, before - steep * half);
            let whole = peak * ends * over * (0.5 * std::f32::consts::PI.sqrt());
            mean = bends.select(whole, mean);
        }
        let depth = (mean * segments.length * (widget.opacity * self.absorbing)).max(zero);
        let alpha = segments.there.select(opacity(simd, depth), zero);
        taken.color = [alpha * widget.color[0], alpha * widget.color[1], alpha * widget.color[2]];
        taken.alpha = alpha;
        taken
    }

    /// Segments that go each their own way: by `own`, what some of them turn at, and panels of three nodes that bends ask for; or
    /// without, pieces that are one panel, of `four` nodes or of three, unless they are deep.
    ///
    /// Not inlined: it is large, and called for both.
    #[inline(never)]
    pub(super) fn step<S: Simd, const N: usize>(
        &self,
        simd: S,
        cell: &Cell,
        segments: &Segments<S, N>,
        own: Option<(bool, Floats<S>)>,
        four: bool,
        room: &mut Room,
    ) -> Taken<S> {
        let rule = &self.rules[usize::from(four)];
        simd.vectorize(
            #[inline(always)]
            || self.step_here(simd, cell, segments, own, rule, room),
        )
    }

    #[inline(always)]
    fn step_here<S: Simd, const N: usize>(
        &self,
        simd: S,
        cell: &Cell,
        segments: &Segments<S, N>,
        own: Option<(bool, Floats<S>)>,
        rule: &Rule,
        room: &mut Room,
    ) -> Taken<S> {
        let (zero, one) = (Floats::splat(simd, 0.0), Floats::splat(simd, 1.0));
        let there = segments.there;
        let mut cell = *cell;
        if let Source::Scalar(knots) = &self.source {
            cell.lines = lines_of(simd, knots, cell.lines, segments.at[0], segments.rise[0], there);
        }
        if let Some(factor) = &self.factor {
            cell.factors = lines_of(simd, factor, cell.factors, segments.at[1], segments.rise[1], there);
        }
        let (mut left, mut longest) = (0, one);
        if cell.lines[1] - cell.lines[0] > MOST_LINES || cell.factors[1] - cell.factors[0] > MOST_LINES {
            left = there.to_bitmask();
        }
        let breaks = own.is_some_and(|(breaks, _)| breaks);
        if let Some((_, bend)) = own {
            left |= (there & bend.simd_gt(Floats::splat(simd, MOST_PANELS))).to_bitmask();
            longest = one / bend.max(one);
            if breaks && cell.clipped != 0 {
                self.clip(simd, &cell, segments, room);
            }
        }
        if let Some(light) = self.light.as_ref().filter(|_| N == 5) {
            light.prepare(simd, segments, room);
        }
        let on_ray = if N == 5 { towards(segments, segments.along) } else { [zero; 2] };
        let absorbing = segments.length * self.absorbing;
        let shining = segments.length * self.shining.unwrap_or(0.0);
        let mut open = there & !mask32x16::from_bitmask(simd, left);
        let (mut u, mut h, mut end) = (zero, longest, one);
        let (mut red, mut green, mut blue, mut opacity, mut through) = (zero, zero, zero, zero, one);
        let mut panels = 0;
        for _ in 0..MOST_STEPS {
            if open.to_bitmask() == 0 {
                break;
            }
            if breaks {
                end = self.next(simd, &cell, segments, room, u);
            }
            let rest = end - u;
            let ends = rest.simd_lt(h * (1.0 + NEAR));
            // No sliver is left to the last.
            h = ends.select(rest, rest.simd_lt(h * 2.0).select(rest * 0.5, h));
            let mut turns = 0;
            if N == 5 && own.is_some() {
                for _ in 0..HALVES {
                    let far = open & !turn_little(simd, segments, u, h, self.cosines[0]);
                    turns = far.to_bitmask();
                    if turns == 0 {
                        break;
                    }
                    h = far.select(h * 0.5, h);
                }
            }
            let all = h.simd_ge(rest);
            let held = self.hold(simd, &cell, segments, h.mul_add(Floats::splat(simd, 0.5), u), on_ray, room);
            let mut nodes = [Node { color: [zero; 3], tau: zero, most: zero }; MOST_NODES];
            let (scale, mut depths, mut depth) = (absorbing * h, [zero; MOST_NODES], zero);
            for i in 0..rule.count {
                let place = h.mul_add(Floats::splat(simd, rule.nodes[i]), u);
                nodes[i] = self.node(simd, &cell, segments, &held, room, place);
                depths[i] = nodes[i].tau * scale;
                depth = depths[i].mul_add(Floats::splat(simd, rule.weights[i]), depth);
            }
            let fits = depth.simd_le(Floats::splat(simd, FAINT));
            let mut tame = fits;
            if turns != 0 {
                tame &= !mask32x16::from_bitmask(simd, turns);
            }
            let mut opaque = 0;
            if self.is_logarithmic {
                let most = nodes[0].most.max(nodes[1].most).max(nodes[2].most);
                let least = nodes[0].most.min(nodes[1].most).min(nodes[2].most);
                tame &= (one - least).simd_le((one - most) * FACTOR);
                opaque = (open & most.simd_gt(Floats::splat(simd, OPAQUE))).to_bitmask();
            }
            let takes = open & tame;
            let (color, alpha) = self.panel(simd, rule, &nodes, depths, depth, shining * h);
            let seen = takes.select(through, zero);
            red = seen.mul_add(color[0], red);
            green = seen.mul_add(color[1], green);
            blue = seen.mul_add(color[2], blue);
            opacity = seen.mul_add(alpha, opacity);
            through -= seen * alpha;
            u = takes.select(all.select(end, u + h), u);
            panels += takes.to_bitmask().count_ones();
            let shorter = (one / depth).max(Floats::splat(simd, 0.02)).min(one) * 0.45;
            let shorter = h * fits.select(Floats::splat(simd, 0.5), shorter);
            let longer = all.select(longest, (h * 2.0).min(longest));
            h = takes.select(longer, shorter);
            let short = (open & !takes & h.simd_lt(Floats::splat(simd, SHORTEST))).to_bitmask();
            left |= short | opaque;
            let goes_on = u.simd_lt(Floats::splat(simd, 1.0 - SAME)) & through.simd_gt(Floats::splat(simd, DARK));
            open &= goes_on & !mask32x16::from_bitmask(simd, short | opaque);
        }
        left |= open.to_bitmask();
        let keep = there & !mask32x16::from_bitmask(simd, left);
        let color = [keep.select(red, zero), keep.select(green, zero), keep.select(blue, zero)];
        Taken { color, alpha: keep.select(opacity, zero), left, panels }
    }
}
