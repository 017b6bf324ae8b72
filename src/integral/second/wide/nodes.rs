//! What places of segments side by side emit and absorb.

#![allow(clippy::needless_range_loop, reason = "closures over arrays of vectors are not inlined")]

use super::panel::{Held, towards};
use super::room::load;
use super::{Cell, Form, Lighting, Room, Segments, Source, Wide};
use crate::integral::floats::{Floats, depth_of_opacity, exp, fraction, power, sine};
use crate::integral::second::Second;
use crate::integral::second::closed::{Profile, Turn};
use crate::transfer::bivariate::Sine;
use crate::transfer::shading::{Highlight, Light as Lamp, Origin, Shading};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, mask32x16};

/// The opacity under the opacity convention beyond which f32 does not tell its logarithm well enough.
pub(super) const OPAQUE: f32 = 0.99;

/// Lengths of gradients that are as good as none.
const FLAT: f32 = 1e-12;

/// What places emit and absorb: colours, by extinction or as they are if emission is direct; extinction; the greatest opacity.
#[derive(Clone, Copy)]
pub(super) struct Node<S: Simd> {
    pub(super) color: [Floats<S>; 3],
    pub(super) tau: Floats<S>,
    pub(super) most: Floats<S>,
}

/// The line of a function that places are on: where it begins, its value there, and its slope.
#[derive(Clone, Copy)]
pub(super) struct Line<S: Simd, const C: usize> {
    pub(super) start: Floats<S>,
    pub(super) value: [Floats<S>; C],
    pub(super) slope: [Floats<S>; C],
}

impl<S: Simd, const C: usize> Line<S, C> {
    /// Channel `c`, not below 0: what is, is rounding.
    #[inline(always)]
    fn at(&self, simd: S, x: Floats<S>, c: usize) -> Floats<S> {
        (x - self.start).mul_add(self.slope[c], self.value[c]).max(Floats::splat(simd, 0.0))
    }
}

impl Form {
    /// Shares of the greatest opacity at (s, g), whether in the widget's box or not.
    #[inline(always)]
    fn height<S: Simd>(&self, simd: S, s: Floats<S>, g: Floats<S>) -> Floats<S> {
        match self {
            Form::Uniform => Floats::splat(simd, 1.0),
            Form::Gaussian { scale, offset } => {
                let x = s.mul_add(Floats::splat(simd, scale[0]), Floats::splat(simd, offset[0]));
                let y = g.mul_add(Floats::splat(simd, scale[1]), Floats::splat(simd, offset[1]));
                exp(simd, x.mul_add(x, y * y) * -0.5)
            }
            Form::Wave { axis, start, profile } => {
                let along = g.mul_add(Floats::splat(simd, axis[1]), Floats::splat(simd, *start));
                profile.wide_height(simd, s.mul_add(Floats::splat(simd, axis[0]), along))
            }
        }
    }
}

impl Profile {
    /// The height at phases.
    #[inline(always)]
    fn wide_height<S: Simd>(&self, simd: S, p: Floats<S>) -> Floats<S> {
        let zero = Floats::splat(simd, 0.0);
        let z = fraction(p);
        let height = match self.turn {
            Turn::Triangle => z.abs() * 2.0,
            Turn::Sine(kind) => {
                // sin 2πz is a sine that runs twice as fast, folded back.
                let twice = z * 2.0;
                let folded = twice.min(Floats::splat(simd, 1.0) - twice).max(zero);
                let sine = sine(simd, if kind == Sine::Positive { folded } else { z });
                match kind {
                    Sine::Abs => sine.abs(),
                    Sine::Positive => sine,
                    Sine::Raised => sine * sine,
                }
            }
        };
        if self.floor > 0.0 {
            let scale = (1.0 / (1.0 - self.floor)) as f32;
            return ((height - self.floor as f32) * scale).max(zero);
        }
        height
    }
}

impl Wide {
    /// What is at the places `u`.
    #[inline(always)]
    pub(super) fn node<S: Simd, const N: usize>(
        &self,
        simd: S,
        cell: &Cell,
        segments: &Segments<S, N>,
        held: &Held<S>,
        room: &Room,
        u: Floats<S>,
    ) -> Node<S> {
        let (zero, one) = (Floats::splat(simd, 0.0), Floats::splat(simd, 1.0));
        let direct = self.shining.is_some();
        let s = segments.rise[0].mul_add(u, segments.at[0]);
        let g = segments.rise[1].mul_add(u, segments.at[1]);
        let (mut red, mut green, mut blue, mut white) = (zero, zero, zero, zero);
        let (mut tau, mut most) = (zero, zero);
        match &self.source {
            Source::Widgets(widgets) => {
                for k in 0..cell.count() {
                    let widget = &widgets[usize::from(cell.active[k])];
                    let mut a = widget.form.height(simd, s, g) * widget.opacity;
                    let mut q = one;
                    if cell.clips(k) {
                        q = load(simd, &room.on[k]);
                        a *= q;
                    }
                    if self.is_logarithmic {
                        most = most.max(a);
                        a = depth_of_opacity(simd, a.min(Floats::splat(simd, OPAQUE)));
                    }
                    if !direct {
                        q = a;
                    }
                    red = q.mul_add(Floats::splat(simd, widget.color[0]), red);
                    green = q.mul_add(Floats::splat(simd, widget.color[1]), green);
                    blue = q.mul_add(Floats::splat(simd, widget.color[2]), blue);
                    white += q;
                    tau += a;
                }
            }
            Source::Scalar(_) | Source::Texels(_) => {
                if let Source::Texels(texels) = &self.source {
                    let x = s.mul_add(Floats::splat(simd, texels.scale[0]), Floats::splat(simd, texels.offset[0]));
                    let y = g.mul_add(Floats::splat(simd, texels.scale[1]), Floats::splat(simd, texels.offset[1]));
                    let last = |k: usize| Floats::splat(simd, texels.size[k] as f32 - 1.0);
                    let x = x.max(zero).min(last(0)) - held.texel[0];
                    let y = y.max(zero).min(last(1)) - held.texel[1];
                    tau = texel(simd, &room.texels[3], x, y);
                    red = texel(simd, &room.texels[0], x, y);
                    green = texel(simd, &room.texels[1], x, y);
                    blue = texel(simd, &room.texels[2], x, y);
                } else {
                    tau = held.line.at(simd, s, 0);
                    red = held.line.at(simd, s, 1);
                    green = held.line.at(simd, s, 2);
                    blue = held.line.at(simd, s, 3);
                }
                if self.is_logarithmic {
                    most = tau;
                    tau = depth_of_opacity(simd, tau.min(Floats::splat(simd, OPAQUE)));
                }
                white = one;
                if !direct {
                    (red, green, blue, white) = (red * tau, green * tau, blue * tau, tau);
                }
            }
        }
        let mut factor = one;
        if self.factor.is_some() {
            factor = held.factor.at(simd, g, 0);
        }
        if N == 5 {
            let over = over_length(simd, segments, u);
            let on_ray = held.on_ray[1].mul_add(u, held.on_ray[0]) * over;
            if let Some(p) = self.silhouette {
                factor *= power(simd, (one - on_ray.abs()).max(zero), p);
            }
            if let Some(light) = &self.light {
                let [diffuse, specular] = light.coming(simd, room, u, over, on_ray);
                if light.is_white {
                    let shining = specular[0] * white;
                    red = red.mul_add(diffuse[0], shining);
                    green = green.mul_add(diffuse[0], shining);
                    blue = blue.mul_add(diffuse[0], shining);
                } else {
                    red = red.mul_add(diffuse[0], specular[0] * white);
                    green = green.mul_add(diffuse[1], specular[1] * white);
                    blue = blue.mul_add(diffuse[2], specular[2] * white);
                }
            }
        }
        if !direct {
            (red, green, blue) = (red * factor, green * factor, blue * factor);
        }
        Node { color: [red, green, blue], tau: tau * factor, most }
    }
}

/// A channel at places of one texel: its value at the first corner, how it rises along either axis, and along both.
#[inline(always)]
fn texel<S: Simd>(simd: S, of: &[[f32; 16]; 4], x: Floats<S>, y: Floats<S>) -> Floats<S> {
    let [start, right, up, both] = [load(simd, &of[0]), load(simd, &of[1]), load(simd, &of[2]), load(simd, &of[3])];
    y.mul_add(x.mul_add(both, up), x.mul_add(right, start)).max(Floats::splat(simd, 0.0))
}

/// The gradient at places.
#[inline(always)]
fn gradient<S: Simd, const N: usize>(segments: &Segments<S, N>, u: Floats<S>) -> [Floats<S>; 3] {
    let [x, y, z] = [2.min(N - 1), 3.min(N - 1), 4.min(N - 1)];
    let Segments { at, rise, .. } = segments;
    [rise[x].mul_add(u, at[x]), rise[y].mul_add(u, at[y]), rise[z].mul_add(u, at[z])]
}

/// One over its length; zero where it is as good as none.
#[inline(always)]
fn over_length<S: Simd, const N: usize>(simd: S, segments: &Segments<S, N>, u: Floats<S>) -> Floats<S> {
    let v = gradient(segments, u);
    let length = dot(v, v).sqrt();
    let some = length.simd_gt(Floats::splat(simd, FLAT));
    some.select(Floats::splat(simd, 1.0) / length, Floats::splat(simd, 0.0))
}

/// Its direction; zero where it is as good as none.
#[inline(always)]
fn normal<S: Simd, const N: usize>(simd: S, segments: &Segments<S, N>, u: Floats<S>) -> [Floats<S>; 3] {
    let (v, over) = (gradient(segments, u), over_length(simd, segments, u));
    [v[0] * over, v[1] * over, v[2] * over]
}

#[inline(always)]
pub(super) fn dot<S: Simd>(a: [Floats<S>; 3], b: [Floats<S>; 3]) -> Floats<S> {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

#[inline(always)]
pub(super) fn splat<S: Simd>(simd: S, v: [f32; 3]) -> [Floats<S>; 3] {
    [Floats::splat(simd, v[0]), Floats::splat(simd, v[1]), Floats::splat(simd, v[2])]
}

impl Lighting {
    pub(super) fn new(shading: &Shading, second: &Second) -> Option<Self> {
        let shade = shading.shade()?;
        let light = |l: &Lamp| {
            let to = match l.origin {
                Origin::Direction(to) => Some(to.to_array().map(|x| x as f32)),
                Origin::Headlight | Origin::Position(_) => None,
            };
            (l.color.map(|c| (c * l.intensity) as f32), to)
        };
        Some(Lighting {
            ambient: shade.ambient as f32,
            diffuse: shade.diffuse as f32,
            specular: shade.specular as f32,
            power: shade.power as f32,
            two_sided: shade.two_sided,
            reflected: shade.highlight == Highlight::Reflected,
            lights: second.lights.iter().map(light).collect(),
            is_white: second.lights.iter().all(|l| l.color == [l.color[0]; 3]),
        })
    }

    /// By what colours are multiplied, and what is added for white, at the places `u` of pieces: one over the lengths of gradients, and
    /// the cosines of normals with the rays, are there already. White light is in the first channel alone.
    #[inline(always)]
    fn coming<S: Simd>(
        &self,
        simd: S,
        room: &Room,
        u: Floats<S>,
        over: Floats<S>,
        on_ray: Floats<S>,
    ) -> [[Floats<S>; 3]; 2] {
        let zero = Floats::splat(simd, 0.0);
        let channels = if self.is_white { 1 } else { 3 };
        let (mut diffuse, mut specular) = ([Floats::splat(simd, self.ambient); 3], [zero; 3]);
        for ((intensity, to), lamp) in self.lights.iter().zip(&room.lamps) {
            let along = |k: usize| load(simd, &lamp[k + 1]).mul_add(u, load(simd, &lamp[k]));
            let cosine = if to.is_none() { zero - on_ray } else { along(0) * over };
            let falls = if self.two_sided { cosine.abs() } else { cosine.max(zero) };
            let scattered = falls * self.diffuse;
            diffuse[0] = scattered.mul_add(Floats::splat(simd, intensity[0]), diffuse[0]);
            if channels > 1 {
                diffuse[1] = scattered.mul_add(Floats::splat(simd, intensity[1]), diffuse[1]);
                diffuse[2] = scattered.mul_add(Floats::splat(simd, intensity[2]), diffuse[2]);
            }
            if self.specular == 0.0 {
                continue;
            }
            let mut shines = falls;
            if self.reflected {
                let toward = if to.is_none() { Floats::splat(simd, -1.0) } else { load(simd, &lamp[2]) };
                shines = (toward - cosine * on_ray * 2.0).max(zero);
            } else if to.is_some() {
                let on_half = along(2) * over;
                shines = if self.two_sided { on_half.abs() } else { on_half.max(zero) };
            }
            let bright = falls.simd_gt(zero).select(power(simd, shines, self.power), zero) * self.specular;
            specular[0] = bright.mul_add(Floats::splat(simd, intensity[0]), specular[0]);
            if channels > 1 {
                specular[1] = bright.mul_add(Floats::splat(simd, intensity[1]), specular[1]);
                specular[2] = bright.mul_add(Floats::splat(simd, intensity[2]), specular[2]);
            }
        }
        [diffuse, specular]
    }

    /// Finds, of each light that has a direction, what is linear along segments: the gradient towards it, and half way between it and
    /// the eye; or of what is reflected the cosine of the light with the ray.
    #[inline(always)]
    pub(super) fn prepare<S: Simd, const N: usize>(&self, simd: S, segments: &Segments<S, N>, room: &mut Room) {
        for ((_, to), lamp) in self.lights.iter().zip(&mut room.lamps) {
            let Some(to) = to else { continue };
            let to = splat(simd, *to);
            let [front, rise] = towards(segments, to);
            front.store_array(&mut lamp[0]);
            rise.store_array(&mut lamp[1]);
            if self.specular == 0.0 {
                continue;
            }
            if self.reflected {
                dot(segments.along, to).store_array(&mut lamp[2]);
                continue;
            }
            let sum = [to[0] - segments.along[0], to[1] - segments.along[1], to[2] - segments.along[2]];
            let length = dot(sum, sum).sqrt();
            let some = length.simd_gt(Floats::splat(simd, 1e-6));
            let scale = some.select(Floats::splat(simd, 1.0) / length, Floats::splat(simd, 0.0));
            let [front, rise] = towards(segments, [sum[0] * scale, sum[1] * scale, sum[2] * scale]);
            front.store_array(&mut lamp[2]);
            rise.store_array(&mut lamp[3]);
        }
    }
}

/// Whether normals turn little between places `u` and `u` + `h`: by an angle of such a cosine at most.
#[inline(always)]
pub(super) fn turn_little<S: Simd, const N: usize>(
    simd: S,
    segments: &Segments<S, N>,
    u: Floats<S>,
    h: Floats<S>,
    cosine: f32,
) -> mask32x16<S> {
    let (a, b) = (gradient(segments, u), gradient(segments, u + h));
    let (front, back, both) = (dot(a, a), dot(b, b), dot(a, b));
    let flat = front.min(back).simd_le(Floats::splat(simd, FLAT * FLAT));
    let aside = both.simd_lt(Floats::splat(simd, 0.0)) | (both * both).simd_lt(front * back * (cosine * cosine));
    flat | !aside
}

/// How far apart the ends of the normals at both ends of segments are.
#[inline(always)]
pub(super) fn way<S: Simd, const N: usize>(simd: S, segments: &Segments<S, N>) -> Floats<S> {
    let (a, b) = (normal(simd, segments, Floats::splat(simd, 0.0)), normal(simd, segments, Floats::splat(simd, 1.0)));
    let d = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
    dot(d, d).sqrt()
}
