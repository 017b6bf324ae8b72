//! The integral of a segment whose extinction depends on two variables, or whose colour is lit.
//!
//! Inside a tetrahedron the scalar s, the second variable g and the components of the gradient are linear along the ray.
//! A segment is cut where the function jumps or turns: at the boxes of widgets, the turns of their waves, the lines
//! between a table's texels, the knots of functions of s and of g, and where a face of the light turns away. Where one
//! widget emits alone, its integral has a closed form ([`closed`]). Elsewhere a piece is panels ([`panel`]) of Gauss's
//! collocation, each so short that
//!
//! - a Gaussian's argument moves by at most 1.2 σ, a sinusoid's by 1.5 radians, a normal by 0.35 (less for sharp
//!   highlights), and likewise the way to a light that has a position,
//! - its optical depth is at most 1.5,
//! - and the argument of the logarithm of the opacity convention changes by a factor of at most 2.
//!
//! The collocation is exact for integrands of degree 7, so in such panels it is off by less than 1e-6 of the piece; the
//! number of panels follows the function, and is never fixed. Pieces in which half of that changes at most, and whose
//! optical depth is at most 0.3, are one panel of three nodes, exact for degree 5.

mod closed;
mod cull;
mod direct;
mod lanes;
mod light;
mod nodes;
mod panel;
mod segmented;
mod special;
mod wide;

use super::Light as Gathered;
use super::options::{Method, Silhouettes, Two};
use crate::field::Normalization;
use crate::transfer::bivariate::{Shape, Source, Table, Wave, Widget};
use crate::transfer::shading::{Light, Shading};
use crate::transfer::{Bivariate, Convention, Emission, TransferFunction};
use closed::{Profile, Turn};
pub(crate) use cull::Pairs;
use cull::Solid;
use direct::Seen;
use glam::DVec3;
use panel::Rules;
use segmented::Ends;
use special::Erf;
#[cfg(test)]
pub(crate) use wide::Head;
pub(crate) use wide::{Cell, Forms, Kind, Room, Row, Rows, Wide, lacks, window};

/// Extinction, times the unit distance, of what is opaque.
const SOLID: f64 = 1e8;

/// Depth of a ray through all of the mesh that a Gaussian's tail may be short of.
const TAIL: f64 = 1e-6;

/// The length of the longest ray through a mesh, in normalised units.
pub(crate) const LONGEST: f64 = 3.5;

/// A transfer function of two variables, or with light, made ready for the fields of one mesh.
#[derive(Debug, Clone)]
pub(crate) struct Second {
    solid: Solid,
    source: Ready,
    /// The function h(g), if there is one.
    factor: Vec<(f64, f64)>,
    shading: Option<Shading>,
    /// The power of silhouettes of whole segments.
    published: Option<f64>,
    /// Of each light, in normalised coordinates, but for its attenuation.
    lights: Vec<Light>,
    /// What world units were multiplied by.
    scale: f64,
    convention: Convention,
    /// The unit distance, in normalised units.
    unit: f64,
    /// Direct emission of a colour of 1 per normalised unit of length.
    direct: Option<f64>,
    /// What values are mapped by: of s and of g.
    normal: [Normalization; 2],
    two: Two,
    /// Of segments in equal pieces.
    ends: Ends,
    /// What lengths of gradients as they are handed over are as good as none.
    flat: f64,
    erf: &'static Erf,
    rules: Rules,
    /// See [`panel::cosines`].
    cosines: [f64; 2],
    /// See [`light::is_even`].
    is_even: bool,
}

/// What says colour and opacity.
#[derive(Debug, Clone)]
enum Ready {
    Scalar { color: Vec<(f64, [f64; 3])>, opacity: Vec<(f64, f64)>, clamp: bool },
    Widgets(Vec<Bounded>),
    Table(Table),
}

/// A widget, the box outside of which nothing is seen of it, and what its wave is, if it is one.
#[derive(Debug, Clone)]
struct Bounded {
    widget: Widget,
    support: [[f64; 2]; 2],
    wave: Option<(Wave, Profile)>,
    /// See [`reach`].
    reach: Option<f64>,
}

impl Bounded {
    fn new(widget: &Widget, transfer: &TransferFunction, longest: f64) -> Self {
        Bounded {
            widget: widget.clone(),
            support: support(widget, transfer, longest),
            wave: closed::wave(&widget.shape),
            reach: reach(widget, transfer, longest),
        }
    }

    /// Where along a segment it may be seen; none if nowhere.
    fn clip(&self, at: [f64; 2], rise: [f64; 2]) -> Option<[f64; 2]> {
        let mut ends = [0.0_f64, 1.0_f64];
        for k in 0..2 {
            let [lo, hi] = self.support[k];
            if rise[k] == 0.0 {
                if at[k] < lo || at[k] > hi {
                    return None;
                }
            } else {
                let (a, b) = ((lo - at[k]) / rise[k], (hi - at[k]) / rise[k]);
                ends = [ends[0].max(a.min(b)), ends[1].min(a.max(b))];
            }
        }
        (ends[0] < ends[1]).then_some(ends)
    }
}

/// Where something is seen along a segment.
#[derive(Debug, Clone, Copy)]
struct Clip {
    widget: usize,
    ends: [f64; 2],
}

/// What is made anew for every segment, in memory that stays.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    clips: Vec<Clip>,
    active: Vec<usize>,
    /// Panels that were summed up.
    pub(crate) panels: u64,
}

/// A segment of a ray: the values of s and g where it enters, and by how much they rise; the same of the gradient, and
/// of the place, in normalised coordinates; its direction, of length 1.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Segment {
    pub(crate) at: [f64; 2],
    pub(crate) rise: [f64; 2],
    pub(crate) vector: DVec3,
    pub(crate) turn: DVec3,
    pub(crate) place: DVec3,
    pub(crate) along: DVec3,
    /// In normalised units.
    pub(crate) length: f64,
}

/// The ranges of s and g in which `transfer` tells values apart; infinite where that is everywhere.
pub(crate) fn places(transfer: &TransferFunction, longest: f64) -> [[f64; 2]; 2] {
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    let join = |a: [f64; 2], b: [f64; 2]| [a[0].min(b[0]), a[1].max(b[1])];
    let hull = |knots: &mut dyn Iterator<Item = f64>| knots.fold(none, |hull, k| join(hull, [k, k]));
    let [mut s, mut g] = [none; 2];
    match transfer.bivariate().map(Bivariate::source) {
        Some(Source::Widgets(widgets)) => {
            for widget in widgets {
                let [of_s, of_g] = support(widget, transfer, longest);
                (s, g) = (join(s, of_s), join(g, of_g));
            }
        }
        Some(Source::Table(table)) => [s, g] = table.ranges(),
        Some(Source::Scalar) | None => {
            let (color, opacity) = (transfer.color().iter().map(|k| k.0), transfer.opacity().iter().map(|k| k.0));
            s = hull(&mut color.chain(opacity));
        }
    }
    let knots = transfer.bivariate().and_then(Bivariate::gradient_opacity).unwrap_or_default();
    g = join(g, hull(&mut knots.iter().map(|k| k.0)));
    [s, g]
}

/// By how many σ rays of `longest` world units see a Gaussian; without, all of it is.
fn reach(widget: &Widget, transfer: &TransferFunction, longest: f64) -> Option<f64> {
    // What is emitted whatever the opacity has no tail.
    if !matches!(widget.shape, Shape::Gaussian { .. }) || transfer.emission() != Emission::Chromatic {
        return None;
    }
    let depth = widget.opacity * longest / transfer.unit_distance();
    // Where the depth of the longest ray is TAIL.
    Some((2.0 * (depth / TAIL).ln().max(0.0)).sqrt())
}

/// The box of a widget, a Gaussian's as far as anything of it can be seen along rays of `longest` world units.
fn support(widget: &Widget, transfer: &TransferFunction, longest: f64) -> [[f64; 2]; 2] {
    let Shape::Gaussian { center, sigma } = widget.shape else { return widget.domain };
    let Some(reach) = reach(widget, transfer, longest) else { return widget.domain };
    [0, 1].map(|k| {
        let [lo, hi] = widget.domain[k];
        [lo.max(center[k] - reach * sigma[k]), hi.min(center[k] + reach * sigma[k])]
    })
}

/// A function of two variables, or with light, and what frames that are drawn with it need besides.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OfTwo<'a> {
    pub(crate) second: &'a Second,
    pub(crate) wide: &'a Wide,
    /// A bit for each cell that may be seen; without, all may.
    pub(crate) seen: Option<&'a [u64]>,
    /// Of each cell, whether it may be seen, as the sweep reads it.
    pub(crate) lines: &'a [[u16; 2]],
    /// The longest edge of a cell, in normalised units.
    pub(crate) longest: f64,
}

impl Segment {
    /// Of `N` values as they are handed over, in front and behind: s and g, and the gradient if there are five. None if one is not
    /// finite.
    #[inline(always)]
    pub(crate) fn new<const N: usize>(
        second: &Second,
        front: &[f64; N],
        back: &[f64; N],
        place: DVec3,
        along: DVec3,
        length: f64,
    ) -> Option<Self> {
        if !front.iter().chain(back).all(|v| v.is_finite()) {
            return None;
        }
        let [values, ends] = [front, back].map(|v| second.own([v[0], v[1]]));
        let vector = |v: &[f64; N]| match v[..] {
            [_, _, x, y, z] => DVec3::new(x, y, z),
            _ => DVec3::ZERO,
        };
        let (vector, turn) = (vector(front), vector(back) - vector(front));
        let rise = [ends[0] - values[0], ends[1] - values[1]];
        Some(Segment { at: values, rise, vector, turn, place, along, length })
    }

    /// s and g at `u`.
    fn values(&self, u: f64) -> [f64; 2] {
        [0, 1].map(|k| self.at[k] + self.rise[k] * u)
    }
}

/// Where a segment is around a Gaussian's centre, and by how much that rises, in units of σ.
fn in_sigmas(segment: &Segment, center: &[f64; 2], sigma: &[f64; 2]) -> [[f64; 2]; 2] {
    [[0, 1].map(|k| (segment.at[k] - center[k]) / sigma[k]), [0, 1].map(|k| segment.rise[k] / sigma[k])]
}

/// The next place beyond `u` where something begins or ends; none if nothing does.
fn next_end(clips: &[Clip], u: f64) -> Option<f64> {
    let ends = clips.iter().flat_map(|c| c.ends).filter(|&end| end > u);
    ends.reduce(f64::min)
}

impl Second {
    /// Prepares `transfer` for values mapped by `normal`, those of s and of g, and gradients of a length up to 1, on a
    /// mesh whose coordinates were made (world − `centre`) · `scale`.
    pub(crate) fn new(
        transfer: &TransferFunction,
        normal: [Normalization; 2],
        centre: DVec3,
        scale: f64,
        two: Two,
    ) -> Self {
        let source = match transfer.bivariate().map(Bivariate::source) {
            Some(Source::Widgets(widgets)) => {
                let bounded = |w: &Widget| Bounded::new(w, transfer, LONGEST / scale);
                Ready::Widgets(widgets.iter().map(bounded).collect())
            }
            Some(Source::Table(table)) => Ready::Table(table.clone()),
            Some(Source::Scalar) | None => Ready::Scalar {
                color: transfer.color().to_vec(),
                opacity: transfer.opacity().to_vec(),
                clamp: transfer.clamp(),
            },
        };
        let moved = |light: &Light| Light { origin: light.origin.moved(centre, scale), ..*light };
        let factor = transfer.bivariate().and_then(Bivariate::gradient_opacity).unwrap_or_default().to_vec();
        let is_direct = transfer.emission() != Emission::Chromatic;
        let (mut shading, mut published) = (transfer.shading().cloned(), None);
        if two.silhouettes == Silhouettes::Published {
            published = shading.as_mut().and_then(Shading::take_silhouette);
        }
        Second {
            solid: Solid::new(&source, &factor, is_direct),
            source,
            factor,
            shading,
            published,
            lights: transfer.shading().map_or(vec![], |s| s.lights().iter().map(moved).collect()),
            scale,
            convention: transfer.convention(),
            unit: transfer.unit_distance() * scale,
            direct: match transfer.emission() {
                Emission::Chromatic => None,
                Emission::Direct { scale: e } => Some(e / scale),
            },
            normal,
            two,
            ends: Ends::new(&two, is_direct),
            flat: 1e-12,
            erf: Erf::shared(),
            rules: Rules::default(),
            cosines: panel::cosines(transfer.shading()),
            is_even: transfer.shading().is_none_or(light::is_even),
        }
    }

    /// Adds `segment` to `light`.
    #[inline(always)]
    pub(crate) fn add(&self, segment: &Segment, scratch: &mut Scratch, light: &mut Gathered<f32>) {
        // Of many panels, f32 would round each.
        let mut own = Gathered::none();
        if self.two.method == Method::Segmented {
            self.add_segmented(segment, self.two.pieces, scratch, &mut own);
        } else {
            self.gather(segment, scratch, &mut own);
        }
        if let Some(p) = self.published {
            let normal = (segment.vector + segment.turn * 0.5).normalize_or_zero();
            let share = (1.0 - normal.dot(segment.along).abs()).max(0.0).powf(p);
            own = Gathered {
                color: own.color.map(|c| c * share),
                transmittance: 1.0 - (1.0 - own.transmittance) * share,
            };
        }
        light.add(own.color.map(|c| c as f32), (1.0 - own.transmittance) as f32);
    }

    #[inline(always)]
    fn gather(&self, segment: &Segment, scratch: &mut Scratch, light: &mut Gathered<f64>) {
        let Ready::Widgets(widgets) = &self.source else {
            self.smooth(segment, [0.0, 1.0], scratch, light);
            return;
        };
        scratch.clips.clear();
        for (widget, bounded) in widgets.iter().enumerate() {
            scratch.clips.extend(bounded.clip(segment.at, segment.rise).map(|ends| Clip { widget, ends }));
        }
        let mut u = 0.0;
        while let Some(next) = next_end(&scratch.clips, u) {
            scratch.active.clear();
            let middle = (u + next) / 2.0;
            let active = scratch.clips.iter().filter(|c| c.ends[0] < middle && c.ends[1] > middle);
            scratch.active.extend(active.map(|c| c.widget));
            match scratch.active[..] {
                [] => {}
                [one] if self.has_closed(&widgets[one], segment, [u, next]) => {
                    self.add_closed(&widgets[one], segment, [u, next], light);
                }
                _ => self.smooth(segment, [u, next], scratch, light),
            }
            u = next;
        }
    }

    /// Whether the light of a widget alone between two places is known in closed form, and that is as fast as panels.
    fn has_closed(&self, bounded: &Bounded, segment: &Segment, ends: [f64; 2]) -> bool {
        if self.shading.is_some() || !self.factor.is_empty() {
            return false;
        }
        if matches!(bounded.widget.shape, Shape::Uniform) {
            return true;
        }
        // A logarithm of what bends has none.
        if self.convention == Convention::Opacity {
            return false;
        }
        match (&bounded.wave, self.direct) {
            (_, None) => true,
            (Some((_, profile)), Some(_)) if profile.turn == Turn::Triangle => true,
            _ => self.two.method == Method::Analytic || !self.is_short(bounded, segment, ends),
        }
    }

    /// Adds the light of a widget alone between two places, for which [`Self::has_closed`].
    fn add_closed(&self, bounded: &Bounded, segment: &Segment, ends: [f64; 2], light: &mut Gathered<f64>) {
        let color = bounded.widget.color;
        if let Some(shining) = self.direct {
            let seen = self.seen(bounded, segment, ends);
            let emitted = shining * segment.length * seen.length;
            light.add(color.map(|c| c * emitted), -(-seen.depth).exp_m1());
        } else {
            let opacity = -(-self.depth(bounded, segment, ends)).exp_m1();
            light.add(color.map(|c| c * opacity), opacity);
        }
    }

    /// The optical depth, over a whole segment, of what is as opaque as a widget at its peak.
    fn depth_of_peak(&self, widget: &Widget, segment: &Segment) -> f64 {
        self.extinction(widget.opacity) * segment.length / self.unit
    }

    /// The optical depth of a widget alone between two places of a segment.
    fn depth(&self, bounded: &Bounded, segment: &Segment, ends: [f64; 2]) -> f64 {
        let length = ends[1] - ends[0];
        let share = match (&bounded.widget.shape, &bounded.wave) {
            (Shape::Gaussian { center, sigma }, _) => {
                let [x, d] = in_sigmas(segment, center, sigma);
                self.erf.gaussian(x, d, ends)
            }
            (_, Some((wave, profile))) => {
                let [p, q] = ends.map(|u| wave.phase(segment.values(u)));
                profile.mean(p, q) * length
            }
            _ => length,
        };
        self.depth_of_peak(&bounded.widget, segment) * share
    }

    /// The same, and what is seen of the length between them, as a share of the segment.
    fn seen(&self, bounded: &Bounded, segment: &Segment, ends: [f64; 2]) -> Seen {
        let (depth, length) = (self.depth_of_peak(&bounded.widget, segment), ends[1] - ends[0]);
        match (&bounded.widget.shape, &bounded.wave) {
            (Shape::Gaussian { center, sigma }, _) => {
                let [x, d] = in_sigmas(segment, center, sigma);
                Seen::gaussian(self.erf, depth, x, d, ends)
            }
            (_, Some((wave, profile))) => {
                Seen::wave(profile, depth, ends.map(|u| wave.phase(segment.values(u))), length)
            }
            _ => Seen::uniform(depth * length, length),
        }
    }

    /// Extinction times the unit distance, at an opacity.
    fn extinction(&self, a: f64) -> f64 {
        match self.convention {
            Convention::Extinction => a,
            Convention::Opacity if a >= 1.0 => SOLID,
            Convention::Opacity => -(-a).ln_1p(),
        }
    }

    /// It for segments side by side.
    pub(crate) fn wide(&self) -> Wide {
        Wide::new(self)
    }

    /// Whether emission is not multiplied by extinction.
    pub(crate) fn is_direct(&self) -> bool {
        self.direct.is_some()
    }

    /// Values as they are handed over, s and g, in their own units.
    pub(crate) fn own(&self, [s, g]: [f64; 2]) -> [f64; 2] {
        [self.normal[0].invert(s), self.normal[1].invert(g)]
    }
}

#[cfg(test)]
mod tests;
