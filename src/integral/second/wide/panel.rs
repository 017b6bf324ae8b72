//! Panels of segments side by side.

#![allow(clippy::needless_range_loop, reason = "closures over arrays of vectors are not inlined")]

use super::nodes::{Line, Node, OPAQUE, dot, splat, turn_little};
use super::room::load;
use super::{Cell, Form, MOST_LINES, Room, Segments, Source, Taken, Texels, Wide};
use crate::integral::Knots;
use crate::integral::floats::{FAINT, Floats, LANES, faded, faint_opacity};
use crate::integral::second::closed::Profile;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, mask32x16};

/// The share of what may change in a panel of four nodes that may in one of three: by what a Gaussian's argument moves then, its
/// integral is off by 6e-6 of its peak.
pub(super) const SHARE: f64 = 0.8;
/// By what factor the argument of a logarithm changes in a panel.
const FACTOR: f32 = 1.4;
/// The most panels that bends may ask for.
const MOST_PANELS: f32 = 32.0;
/// By how often a panel in which a normal turns too far is halved before it is summed up.
const HALVES: usize = 8;
/// Steps of one segment after another, taken or not.
const MOST_STEPS: usize = 128;
/// The shortest panels, as shares of a segment, unless they end where something turns.
const SHORTEST: f32 = 1e-3;
/// Places that are one, and phases.
const SAME: f32 = 1e-6;
const NEAR: f32 = 1e-5;
/// Transmittance of a segment below which nothing is told from nothing.
const DARK: f32 = 1e-12;
/// The greatest phase: f32 tells 1e-5 of it.
pub(super) const FAR: f32 = 200.0;
const EVERYWHERE: [f32; 2] = [f32::NEG_INFINITY, f32::INFINITY];

/// Gauss's rule of three nodes in f32, and of each polynomial through them the integral to each.
#[derive(Debug, Clone)]
pub(super) struct Rule {
    nodes: [f32; 3],
    weights: [f32; 3],
    to_node: [[f32; 3]; 3],
}

impl Rule {
    pub(super) fn new(rule: &crate::integral::second::panel::Rule) -> Self {
        let three = |v: &[f64; 4]| [v[0] as f32, v[1] as f32, v[2] as f32];
        let to = &rule.to_node;
        Rule {
            nodes: three(&rule.nodes),
            weights: three(&rule.weights),
            to_node: [three(&to[0]), three(&to[1]), three(&to[2])],
        }
    }

    /// Nodes, weights, and of each polynomial the integral to each node.
    pub(super) fn parts(&self) -> ([f32; 3], [f32; 3], [[f32; 3]; 3]) {
        (self.nodes, self.weights, self.to_node)
    }
}

/// What holds in all of a panel.
pub(super) struct Held<S: Simd> {
    pub(super) line: Line<S, 4>,
    pub(super) factor: Line<S, 1>,
    /// The first of four texels.
    pub(super) texel: [Floats<S>; 2],
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

/// `place`, if it is beyond `u` and before `next`; else `next`.
#[inline(always)]
fn nearer<S: Simd>(next: Floats<S>, place: Floats<S>, u: Floats<S>) -> Floats<S> {
    place.simd_gt(u + SAME).select(next.min(place), next)
}

/// The sooner of `next` and where beyond `u` a whole number from `least` to `most` is passed.
#[inline(always)]
fn next_whole<S: Simd>(
    simd: S,
    next: Floats<S>,
    at: Floats<S>,
    rise: Floats<S>,
    [least, most]: [f32; 2],
    u: Floats<S>,
) -> Floats<S> {
    let (zero, least, most) = (Floats::splat(simd, 0.0), Floats::splat(simd, least), Floats::splat(simd, most));
    let now = rise.mul_add(u, at);
    let up = rise.simd_gt(zero);
    let whole = up.select((now + NEAR).floor() + 1.0, (now - NEAR).ceil() - 1.0);
    let whole = up.select(whole.max(least), whole.min(most));
    let over = Floats::splat(simd, 1.0) / rise;
    let place = (whole - at) * over;
    // What is as good as here is followed by the next.
    let place = place.simd_gt(u + SAME).select(place, place + over.abs());
    let some = whole.simd_ge(least) & whole.simd_le(most) & !rise.simd_eq(zero);
    nearer(next, some.select(place, Floats::splat(simd, f32::INFINITY)), u)
}

/// The sooner of `next` and where beyond `u` the start of one of the lines after the first is passed.
#[inline(always)]
fn next_knot<S: Simd>(
    simd: S,
    mut next: Floats<S>,
    knots: &Knots<f32>,
    lines: [u16; 2],
    at: Floats<S>,
    rise: Floats<S>,
    u: Floats<S>,
) -> Floats<S> {
    let over = Floats::splat(simd, 1.0) / rise;
    for k in usize::from(lines[0]) + 1..=usize::from(lines[1]) {
        next = nearer(next, (Floats::splat(simd, knots.s[k]) - at) * over, u);
    }
    next
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
        room: &mut Room,
    ) -> Held<S> {
        let zero = Floats::splat(simd, 0.0);
        let mut held = Held {
            line: Line { start: zero, value: [zero; 4], slope: [zero; 4] },
            factor: Line { start: zero, value: [zero; 1], slope: [zero; 1] },
            texel: [zero; 2],
        };
        let s = segments.rise[0].mul_add(middle, segments.at[0]);
        let g = segments.rise[1].mul_add(middle, segments.at[1]);
        match &self.source {
            Source::Widgets(_) if cell.clipped == 0 => {}
            Source::Widgets(_) => {
                for k in 0..cell.count() {
                    if cell.clips(k) {
                        let [from, to] = [load(simd, &room.clips[k][0]), load(simd, &room.clips[k][1])];
                        let inside = from.simd_lt(middle) & to.simd_gt(middle);
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

    /// Finds where along segments the boxes of widgets are that end in the cell.
    #[inline(always)]
    fn clip<S: Simd, const N: usize>(&self, simd: S, cell: &Cell, segments: &Segments<S, N>, room: &mut Room) {
        let Source::Widgets(widgets) = &self.source else { return };
        let zero = Floats::splat(simd, 0.0);
        for k in 0..cell.count() {
            if !cell.clips(k) {
                continue;
            }
            let domain = &widgets[usize::from(cell.active[k])].domain;
            let (mut from, mut to) = (Floats::splat(simd, f32::NEG_INFINITY), Floats::splat(simd, f32::INFINITY));
            for v in 0..2 {
                let (at, rise) = (segments.at[v], segments.rise[v]);
                let [low, high] = [Floats::splat(simd, domain[v][0]), Floats::splat(simd, domain[v][1])];
                let over = Floats::splat(simd, 1.0) / rise;
                let (a, b) = ((low - at) * over, (high - at) * over);
                let still = rise.simd_eq(zero);
                let outside = still & (at.simd_lt(low) | at.simd_gt(high));
                from = still.select(from, from.max(a.min(b)));
                to = still.select(to, to.min(a.max(b)));
                to = outside.select(Floats::splat(simd, f32::NEG_INFINITY), to);
            }
            from.store_array(&mut room.clips[k][0]);
            to.store_array(&mut room.clips[k][1]);
        }
    }

    /// Where beyond `u` segments next turn or jump, or end.
    #[inline(always)]
    fn next<S: Simd, const N: usize>(
        &self,
        simd: S,
        cell: &Cell,
        segments: &Segments<S, N>,
        room: &Room,
        u: Floats<S>,
    ) -> Floats<S> {
        let mut next = Floats::splat(simd, 1.0);
        let Segments { at, rise, .. } = segments;
        match &self.source {
            Source::Widgets(widgets) => {
                for k in 0..cell.count() {
                    if cell.clips(k) {
                        next = nearer(next, load(simd, &room.clips[k][0]), u);
                        next = nearer(next, load(simd, &room.clips[k][1]), u);
                    }
                    let Form::Wave { axis, start, profile } = &widgets[usize::from(cell.active[k])].form else {
                        continue;
                    };
                    if cell.turning >> k & 1 == 0 {
                        continue;
                    }
                    let [x, y] = [Floats::splat(simd, axis[0]), Floats::splat(simd, axis[1])];
                    let p = at[0].mul_add(x, at[1].mul_add(y, Floats::splat(simd, *start)));
                    let d = rise[0].mul_add(x, rise[1] * y);
                    if profile.turns() == [0.0, 0.5] {
                        next = next_whole(simd, next, p * 2.0, d * 2.0, EVERYWHERE, u);
                        continue;
                    }
                    for &turn in profile.turns() {
                        next = next_whole(simd, next, p - turn as f32, d, EVERYWHERE, u);
                    }
                }
            }
            Source::Scalar(knots) => next = next_knot(simd, next, knots, cell.lines, at[0], rise[0], u),
            Source::Texels(texels) => {
                for k in 0..2 {
                    let scale = texels.scale[k];
                    let place = at[k].mul_add(Floats::splat(simd, scale), Floats::splat(simd, texels.offset[k]));
                    next = next_whole(simd, next, place, rise[k] * scale, [0.0, texels.size[k] as f32 - 1.0], u);
                }
            }
        }
        if let Some(factor) = &self.factor {
            next = next_knot(simd, next, factor, cell.factors, at[1], rise[1], u);
        }
        if N == 5 {
            let zero = Floats::splat(simd, 0.0);
            let lights = self.light.as_ref().map_or(&[][..], |l| &l.lights);
            if self.on_ray {
                let [front, rise] = towards(segments, segments.along);
                next = nearer(next, (zero - front) / rise, u);
            }
            for (_, to) in lights {
                let Some(to) = to else { continue };
                let [front, rise] = towards(segments, splat(simd, *to));
                next = nearer(next, (zero - front) / rise, u);
            }
        }
        next
    }

    /// Light of panels of length `h`, and their opacity, which is that of `depth`.
    #[inline(always)]
    fn panel<S: Simd>(
        &self,
        simd: S,
        nodes: &[Node<S>; 3],
        depths: [Floats<S>; 3],
        depth: Floats<S>,
        shone: Floats<S>,
    ) -> ([Floats<S>; 3], Floats<S>) {
        let zero = Floats::splat(simd, 0.0);
        let (mut red, mut green, mut blue, mut absorbed) = (zero, zero, zero, zero);
        let Rule { weights, to_node, .. } = &self.rule;
        for i in 0..3 {
            let of = |j: usize| Floats::splat(simd, to_node[j][i]);
            let before = depths[0].mul_add(of(0), depths[1].mul_add(of(1), depths[2] * of(2)));
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

    /// Segments that go each their own way.
    #[inline(always)]
    pub(super) fn step<S: Simd, const N: usize>(
        &self,
        simd: S,
        cell: &Cell,
        segments: &Segments<S, N>,
        breaks: bool,
        bend: Floats<S>,
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
        let mut left = (there & bend.simd_gt(Floats::splat(simd, MOST_PANELS))).to_bitmask();
        if cell.lines[1] - cell.lines[0] > MOST_LINES || cell.factors[1] - cell.factors[0] > MOST_LINES {
            left = there.to_bitmask();
        }
        if cell.clipped != 0 {
            self.clip(simd, &cell, segments, room);
        }
        if let Some(light) = self.light.as_ref().filter(|_| N == 5) {
            light.half_ways(simd, segments, room);
        }
        let absorbing = segments.length * self.absorbing;
        let shining = segments.length * self.shining.unwrap_or(0.0);
        let longest = one / bend.max(one);
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
            if N == 5 {
                for _ in 0..HALVES {
                    let far = open & !turn_little(simd, segments, u, h, self.cosine);
                    turns = far.to_bitmask();
                    if turns == 0 {
                        break;
                    }
                    h = far.select(h * 0.5, h);
                }
            }
            let all = h.simd_ge(rest);
            let held = self.hold(simd, &cell, segments, h.mul_add(Floats::splat(simd, 0.5), u), room);
            let mut nodes = [Node { color: [zero; 3], tau: zero, most: zero }; 3];
            for (node, &x) in nodes.iter_mut().zip(&self.rule.nodes) {
                let place = h.mul_add(Floats::splat(simd, x), u);
                *node = self.node(simd, &cell, segments, &held, room, place);
            }
            let scale = absorbing * h;
            let depths = [nodes[0].tau * scale, nodes[1].tau * scale, nodes[2].tau * scale];
            let [a, b, _] = self.rule.weights;
            let depth = (depths[0] + depths[2]).mul_add(Floats::splat(simd, a), depths[1] * b);
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
            let (color, alpha) = self.panel(simd, &nodes, depths, depth, shining * h);
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
