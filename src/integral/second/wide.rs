//! Segments of a cell side by side, in f32: what [`Second`] does one by one, for what needs no more than that.
//!
//! All segments of a cell see the same widgets and lines of functions, so decisions are taken for the cell ([`Cell`]), and the
//! segments of cells that see the same are taken together, sixteen at a time, wherever they are on the image. One Gaussian
//! alone is its closed form. Else each segment goes its own way from place to place in panels of three nodes ([`panel`]), one
//! where nothing turns and little bends. What f32 is too coarse for is left to [`Second`]: segments that take very many or very short panels, what is nearly
//! opaque under the opacity convention, and whole functions with lights that have a position, highlights that begin at an
//! edge, or silhouettes of a power that is no whole number.

#![allow(clippy::needless_range_loop, reason = "closures over arrays of vectors are not inlined")]

mod nodes;
mod panel;
mod pieces;
mod room;
mod rows;
#[cfg(test)]
mod tests;

use super::closed::{Profile, Turn};
use super::light::{ANGLES, angle};
use super::panel::STEP;
use super::{Bounded, Ready, Second};
use crate::field::Normalization;
use crate::integral::Knots;
use crate::integral::floats::{Floats, LANES};
use crate::integral::knots::{Side, compile, sample};
use crate::integral::options::Method;
use crate::transfer::Convention;
use crate::transfer::bivariate::{Shape, Table};
use crate::transfer::shading::{Origin, Shading};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, mask32x16};
use panel::{LONGER, Rule, SHARE};
use room::{Numbers, load, window_mut};
pub(crate) use room::{Room, Row, window};
#[cfg(test)]
pub(crate) use rows::Head;
pub(crate) use rows::{Forms, Kind, Rows, lacks};

/// Widgets that the segments of a cell may see.
const MOST_ACTIVE: usize = 8;
/// Lights.
const MOST_LIGHTS: usize = 6;
/// By how much shorter panels of logarithms are.
const LOGARITHMIC: f32 = 1.4;
/// Lines of a function that are tried one after another.
const MOST_LINES: u16 = 24;
/// Extinction times the unit distance at an opacity of 1, as far as what is dense is told.
const DENSEST: f64 = 1e4;

/// A function of two variables, or with light, in f32 and for values as they are handed over.
#[derive(Debug, Clone)]
pub(crate) struct Wide {
    source: Source,
    /// h(g) in the first channel.
    factor: Option<Knots<f32>>,
    /// Per normalised unit of length: optical depth at an extinction of 1, and emission of a white of 1 if it is direct.
    absorbing: f32,
    shining: Option<f32>,
    is_logarithmic: bool,
    light: Option<Lighting>,
    silhouette: Option<f32>,
    /// Something depends on how the gradient is turned to the ray, whichever side it is.
    on_ray: bool,
    /// The cosines of the angles by which normals may turn in a panel of three nodes, and in one of four.
    cosines: [f32; 2],
    /// What the way between the ends of normals is multiplied by to be panels.
    turn: f32,
    /// Of three nodes, and of four.
    rules: [Rule; 2],
    /// Nothing of it is for vectors.
    by_hand: bool,
}

#[derive(Debug, Clone)]
enum Source {
    /// Opacity, red, green and blue.
    Scalar(Knots<f32>),
    Widgets(Vec<Widget>),
    Texels(Texels),
}

#[derive(Debug, Clone)]
struct Widget {
    form: Form,
    color: [f32; 3],
    opacity: f32,
    domain: [[f32; 2]; 2],
    /// Outside of it, nothing is seen.
    support: [[f32; 2]; 2],
}

#[derive(Debug, Clone)]
enum Form {
    Uniform,
    /// 1/σ, and −centre/σ.
    Gaussian {
        scale: [f32; 2],
        offset: [f32; 2],
    },
    /// The phase of (s, g) is axis · (s, g) + start.
    Wave {
        axis: [f32; 2],
        start: f32,
        profile: Profile,
    },
}

/// A table: the place of s is scale · s + offset, counted in texels from the centre of the first.
#[derive(Debug, Clone)]
struct Texels {
    all: Vec<[f32; 4]>,
    size: [usize; 2],
    scale: [f32; 2],
    offset: [f32; 2],
    /// The greatest opacity.
    densest: f32,
}

#[derive(Debug, Clone)]
struct Lighting {
    ambient: f32,
    diffuse: f32,
    specular: f32,
    power: f32,
    two_sided: bool,
    reflected: bool,
    /// All light is.
    is_white: bool,
    /// Colour times intensity, and where it comes from; the eye, if nowhere else.
    lights: Vec<([f32; 3], Option<[f32; 3]>)>,
}

/// What all segments of a cell have in common.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Cell {
    active: [u8; MOST_ACTIVE],
    count: u8,
    /// A bit for each that is active: its box ends in the cell; and its wave turns there.
    clipped: u8,
    turning: u8,
    /// The lines of the functions of s, and of g.
    lines: [u16; 2],
    factors: [u16; 2],
    /// Something jumps or turns in it.
    breaks: bool,
    /// A Gaussian alone.
    is_gaussian: bool,
    by_hand: bool,
}

impl Cell {
    fn count(&self) -> usize {
        usize::from(self.count).min(MOST_ACTIVE)
    }

    /// Whether the box of the `k`th widget ends in the cell.
    fn clips(&self, k: usize) -> bool {
        self.clipped >> k & 1 == 1
    }
}

/// Segments: s and g in front, and if they are lit the gradient; by how much all of that rises; the direction of rays; lengths.
struct Segments<S: Simd, const N: usize> {
    at: [Floats<S>; N],
    rise: [Floats<S>; N],
    along: [Floats<S>; 3],
    length: Floats<S>,
    there: mask32x16<S>,
}

impl<S: Simd, const N: usize> Segments<S, N> {
    /// Sixteen of those in `rows`.
    #[inline(always)]
    fn new(simd: S, rows: &Numbers, at: usize, there: u64) -> Self {
        let of = |row: usize| load(simd, window(&rows[row], at));
        let mut segments = Segments {
            at: [Floats::splat(simd, 0.0); N],
            rise: [Floats::splat(simd, 0.0); N],
            along: [Floats::splat(simd, 0.0); 3],
            length: of(Row::<N>::LENGTH),
            there: mask32x16::from_bitmask(simd, there),
        };
        for n in 0..N {
            segments.at[n] = of(Row::<N>::AT + n);
            segments.rise[n] = of(Row::<N>::RISE + n);
        }
        if N == 5 {
            for k in 0..3 {
                segments.along[k] = of(Row::<N>::ALONG + k);
            }
        }
        segments
    }
}

/// What segments emit and absorb, but for those that must be taken one by one, a bit each; panels.
struct Taken<S: Simd> {
    color: [Floats<S>; 3],
    alpha: Floats<S>,
    left: u64,
    panels: u32,
}

/// An interval of values as they are handed over, never narrower.
fn handed_over([lo, hi]: [f64; 2], normal: Normalization) -> [f32; 2] {
    [(normal.apply(lo) as f32).next_down(), (normal.apply(hi) as f32).next_up()]
}

impl Widget {
    fn new(bounded: &Bounded, normal: [Normalization; 2]) -> Self {
        let Bounded { widget, support, wave, .. } = bounded;
        let form = match (&widget.shape, wave) {
            (Shape::Gaussian { center, sigma }, _) => Form::Gaussian {
                scale: [0, 1].map(|k| (normal[k].half / sigma[k]) as f32),
                offset: [0, 1].map(|k| ((normal[k].mid - center[k]) / sigma[k]) as f32),
            },
            (_, Some((wave, profile))) => {
                let start = wave.phase(normal.map(|n| n.mid));
                Form::Wave {
                    axis: [0, 1].map(|k| (wave.axis[k] * normal[k].half / wave.period) as f32),
                    // Whole periods change nothing.
                    start: (start - start.floor()) as f32,
                    profile: *profile,
                }
            }
            _ => Form::Uniform,
        };
        Widget {
            form,
            color: widget.color.map(|c| c as f32),
            opacity: widget.opacity as f32,
            domain: [0, 1].map(|k| widget.domain[k].map(|end| normal[k].apply(end) as f32)),
            support: [0, 1].map(|k| handed_over(support[k], normal[k])),
        }
    }
}

impl Texels {
    fn new(table: &Table, normal: [Normalization; 2]) -> Self {
        let place = |at: [f64; 2]| table.place(at);
        let (middle, end) = (place(normal.map(|n| n.mid)), place(normal.map(|n| n.mid + n.half)));
        Texels {
            all: table.texels().iter().map(|t| t.map(|c| c as f32)).collect(),
            size: table.size(),
            scale: [0, 1].map(|k| (end[k] - middle[k]) as f32),
            offset: middle.map(|m| m as f32),
            densest: table.texels().iter().fold(0.0, |most, t| t[3].max(most)) as f32,
        }
    }
}

impl Wide {
    pub(super) fn new(second: &Second) -> Self {
        let normal = second.normal;
        let source = match &second.source {
            Ready::Widgets(all) => Source::Widgets(all.iter().map(|b| Widget::new(b, normal)).collect()),
            Ready::Table(table) => Source::Texels(Texels::new(table, normal)),
            Ready::Scalar { color, opacity, clamp } => {
                let opacity: Vec<_> = opacity.iter().map(|&(s, a)| (s, [a])).collect();
                let places = opacity.iter().map(|k| k.0).chain(color.iter().map(|k| k.0)).collect();
                Source::Scalar(compile(places, normal[0], |s, side| {
                    let side = plain(side);
                    let ([a], [r, g, b]) = (sample(&opacity, *clamp, s, side), sample(color, *clamp, s, side));
                    [a, r, g, b]
                }))
            }
        };
        let h: Vec<_> = second.factor.iter().map(|&(g, h)| (g, [h])).collect();
        let factor = (!h.is_empty()).then(|| {
            compile(h.iter().map(|k| k.0).collect(), normal[1], |g, side| {
                [sample(&h, true, g, plain(side))[0], 0.0, 0.0, 0.0]
            })
        });
        let shading = second.shading.as_ref();
        let most_turn = shading.and_then(Shading::shade).map_or(ANGLES[0], angle) * SHARE;
        let silhouette = shading.and_then(Shading::silhouette);
        let texels = if let Source::Texels(t) = &source { t.size } else { [0; 2] };
        Wide {
            source,
            factor,
            absorbing: (1.0 / second.unit) as f32,
            shining: second.direct.map(|e| e as f32),
            is_logarithmic: second.convention == Convention::Opacity,
            light: shading.and_then(|s| Lighting::new(s, second)),
            silhouette: silhouette.map(|p| p as f32),
            on_ray: silhouette.is_some() || second.lights.iter().any(|l| l.origin == Origin::Headlight),
            cosines: [1.0, f64::from(LONGER)].map(|longer| (most_turn * longer).cos() as f32),
            turn: (0.5 / (0.5 * most_turn).sin()) as f32,
            rules: [Rule::new(&second.rules.three, 3), Rule::new(&second.rules.four, 4)],
            by_hand: second.two.method != Method::Adaptive
                || second.published.is_some()
                || !second.is_even
                || silhouette.is_some_and(|p| p.fract() != 0.0)
                || second.lights.len() > MOST_LIGHTS
                || texels.iter().any(|&n| n > 4096),
        }
    }

    /// What the segments of a cell have in common, whose values are within `span`; and the greatest extinction there, per
    /// normalised unit of length.
    pub(crate) fn cell(&self, span: &[[f32; 2]]) -> (Cell, f32) {
        let mut cell = Cell { by_hand: self.by_hand, ..Cell::default() };
        let [s, g] = [span[0], span[1]];
        let lines = |of: [usize; 2]| of.map(|i| i.min(u16::MAX.into()) as u16);
        let (mut most, mut densest) = (1.0, 0.0);
        if let Some(factor) = &self.factor {
            cell.factors = lines(factor.intervals(g[0], g[1]));
            cell.breaks |= cell.factors[0] != cell.factors[1];
            most = factor.densest(cell.factors);
        }
        let extinction = |a: f32| {
            let a = f64::from(a);
            if self.is_logarithmic { (-(-a.min(1.0)).ln_1p()).min(DENSEST) as f32 } else { a as f32 }
        };
        match &self.source {
            Source::Scalar(knots) => {
                cell.lines = lines(knots.intervals(s[0], s[1]));
                cell.breaks |= cell.lines[0] != cell.lines[1];
                densest = extinction(knots.densest(cell.lines));
            }
            Source::Widgets(widgets) => {
                for (i, widget) in widgets.iter().enumerate() {
                    let misses = |k: usize| span[k][1] < widget.support[k][0] || span[k][0] > widget.support[k][1];
                    if misses(0) || misses(1) {
                        continue;
                    }
                    let k = cell.count();
                    if k == MOST_ACTIVE || i > u8::MAX.into() {
                        cell.by_hand = true;
                        break;
                    }
                    let leaves = |k: usize| span[k][0] < widget.domain[k][0] || span[k][1] > widget.domain[k][1];
                    cell.clipped |= u8::from(leaves(0) || leaves(1)) << k;
                    if let Form::Wave { axis, start, profile } = &widget.form {
                        let phase = |k: usize| [axis[k] * span[k][0], axis[k] * span[k][1]];
                        let ([a, b], [c, d]) = (phase(0), phase(1));
                        let [low, high] = [start + a.min(b) + c.min(d), start + a.max(b) + c.max(d)];
                        cell.turning |= u8::from(panel::turns(profile, [low, high])) << k;
                        cell.by_hand |= low.abs().max(high.abs()) > panel::FAR;
                    }
                    cell.is_gaussian = k == 0 && matches!(widget.form, Form::Gaussian { .. });
                    cell.active[k] = i as u8;
                    cell.count += 1;
                    densest += extinction(widget.opacity);
                }
                cell.breaks |= cell.clipped != 0 || cell.turning != 0;
                cell.is_gaussian &= cell.count == 1 && cell.clipped == 0 && self.factor.is_none();
                cell.is_gaussian &= self.shining.is_none() && !self.is_logarithmic;
                cell.is_gaussian &= self.light.is_none() && self.silhouette.is_none();
            }
            Source::Texels(texels) => {
                let ends = [0, 1].map(|k| span[k].map(|v| v.mul_add(texels.scale[k], texels.offset[k])));
                cell.breaks |= (0..2).any(|k| panel::passes_whole(ends[k], [0.0, texels.size[k] as f32 - 1.0]));
                densest = extinction(texels.densest);
            }
        }
        (cell, densest * most * self.absorbing)
    }

    /// Finds what segments `from`..`to` of `room` emit and absorb, of cells that see the same. Calls `left` for those that must be
    /// taken one by one, of which nothing is there so far. Returns the number of panels.
    ///
    /// Not inlined: it is large, and called for many segments at a time.
    #[inline(never)]
    pub(crate) fn integrate<S: Simd, const N: usize>(
        &self,
        simd: S,
        cell: &Cell,
        room: &mut Room,
        [from, to]: [usize; 2],
        left: &mut dyn FnMut(usize),
    ) -> u64 {
        simd.vectorize(
            #[inline(always)]
            || {
                let mut panels = 0;
                for first in (from..to).step_by(LANES) {
                    let there = u64::MAX >> (64 - (to - first).min(LANES));
                    // None if they are cut in pieces, which come later.
                    let Some(taken) = self.light::<S, N>(simd, cell, room, first, there) else {
                        if room.pieces.is_full() {
                            panels += self.join::<S, N>(simd, cell, room, left);
                        }
                        continue;
                    };
                    panels += u64::from(taken.panels);
                    for k in 0..3 {
                        taken.color[k].store_array(window_mut(&mut room.rows[Row::<N>::LIGHT + k], first));
                    }
                    taken.alpha.store_array(window_mut(&mut room.rows[Row::<N>::LIGHT + 3], first));
                    (0..LANES).filter(|l| taken.left >> l & 1 == 1).for_each(|l| left(first + l));
                }
                panels + self.join::<S, N>(simd, cell, room, left)
            },
        )
    }

    /// What sixteen segments emit and absorb; none if they were put to the pieces.
    #[inline(always)]
    fn light<S: Simd, const N: usize>(
        &self,
        simd: S,
        cell: &Cell,
        room: &mut Room,
        at: usize,
        there: u64,
    ) -> Option<Taken<S>> {
        let zero = Floats::splat(simd, 0.0);
        if cell.by_hand {
            return Some(Taken { color: [zero; 3], alpha: zero, left: there, panels: 0 });
        }
        let segments = Segments::<S, N>::new(simd, &room.rows, at, there);
        if N == 2 && cell.is_gaussian {
            return Some(self.gaussian(simd, cell, &segments));
        }
        let bend = self.bend(simd, cell, &segments);
        let breaks = cell.breaks || self.light_turns(simd, &segments);
        let bends = (segments.there & bend.simd_gt(Floats::splat(simd, self.most_bend()))).to_bitmask();
        if !breaks && bends == 0 {
            let four = self.takes_four(simd, &segments, bend);
            return Some(self.step(simd, cell, &segments, None, four, room));
        }
        if self.cut(simd, cell, &segments, (breaks, bend), at, room) {
            return None;
        }
        Some(self.step(simd, cell, &segments, Some((breaks, bend)), false, room))
    }

    /// The panels of three nodes that bends of a piece may ask for.
    #[inline(always)]
    fn most_bend(&self) -> f32 {
        // The logarithm's panels are of three.
        if self.is_logarithmic { 1.0 } else { LONGER }
    }

    /// Whether one of some pieces asks for more than a panel of three nodes.
    #[inline(always)]
    fn takes_four<S: Simd, const N: usize>(&self, simd: S, segments: &Segments<S, N>, bend: Floats<S>) -> bool {
        let one = Floats::splat(simd, 1.0);
        let mut more = bend.simd_gt(one);
        if N == 5 {
            more |= !nodes::turn_little(simd, segments, one * 0.0, one, self.cosines[0]);
        }
        !self.is_logarithmic && (segments.there & more).to_bitmask() != 0
    }

    /// Panels that the bends of widgets ask for.
    #[inline(always)]
    fn bend<S: Simd, const N: usize>(&self, simd: S, cell: &Cell, segments: &Segments<S, N>) -> Floats<S> {
        let mut most = Floats::splat(simd, 0.0);
        if N == 5 {
            let (start, all) = (most, Floats::splat(simd, 1.0));
            let little = nodes::turn_little(simd, segments, start, all, self.cosines[0]);
            if (segments.there & !little).to_bitmask() != 0 {
                most = nodes::way(simd, segments) * self.turn;
            }
        }
        let Source::Widgets(widgets) = &self.source else { return most };
        for &i in &cell.active[..cell.count()] {
            let bend = match &widgets[usize::from(i)].form {
                Form::Uniform => continue,
                Form::Gaussian { scale, .. } => {
                    let (x, y) = (segments.rise[0] * scale[0], segments.rise[1] * scale[1]);
                    x.mul_add(x, y * y).sqrt() * (1.0 / STEP[0] / SHARE) as f32
                }
                Form::Wave { profile, .. } if profile.turn == Turn::Triangle => continue,
                Form::Wave { axis, profile, .. } => {
                    let rise = segments.rise[0].mul_add(Floats::splat(simd, axis[0]), segments.rise[1] * axis[1]);
                    rise.abs() * (profile.turn.radians() / STEP[1] / SHARE) as f32
                }
            };
            most = most.max(bend);
        }
        // A logarithm of what bends bends more.
        if self.is_logarithmic { most * LOGARITHMIC } else { most }
    }
}

/// Without what stands at a knot alone.
fn plain(side: Side) -> Side {
    match side {
        Side::Densest => Side::Above,
        side => side,
    }
}
