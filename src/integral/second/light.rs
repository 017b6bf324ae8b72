//! Light in a panel: what comes back of it, and how much of it may change.

use super::lanes::{Lanes, each, power};
use super::panel::{FACTOR, roots};
use super::{Second, Segment};
use crate::transfer::shading::{Cone, Highlight, Origin, Shade, Shading};
use glam::DVec3;

/// By what angle a normal, or the way to a light, turns in a panel at most; for highlights and cones this over the root of
/// their power.
pub(super) const ANGLES: [f64; 2] = [0.35, 1.2];
/// Powers from which on a highlight begins so smoothly that no panel must.
const SMOOTH: f64 = 6.0;
/// See [`SHORTEST`]: of panels that are halved towards the edge of a highlight.
const EDGE: f64 = 1e-4;

/// Whether nothing of a light has to be judged along a segment: none has a position, and no highlight begins at an edge.
pub(super) fn is_even(shading: &Shading) -> bool {
    let Some(shade) = shading.shade() else { return true };
    !begins(shade) && shading.lights().iter().all(|l| !matches!(l.origin, Origin::Position(_)))
}

/// Whether a highlight begins so sharply that panels end there.
pub(super) fn begins(shade: &Shade) -> bool {
    shade.highlight == Highlight::Reflected && shade.specular > 0.0 && shade.power < SMOOTH
}

impl Second {
    /// Whether lights that have a position, and highlights that begin, change little enough in a panel of length `h` at `u`:
    /// by a `share` of what may change in one.
    pub(super) fn is_evenly_lit(&self, segment: &Segment, u: f64, h: f64, share: f64) -> bool {
        if self.is_even {
            return true;
        }
        let Some(shade) = self.shading.as_ref().and_then(Shading::shade) else { return true };
        let Segment { vector, turn, place, along, length, .. } = *segment;
        let begins = begins(shade) && h > EDGE;
        self.lights.iter().all(|light| {
            let to = |u: f64| match light.origin {
                Origin::Headlight => -along,
                Origin::Direction(to) => to,
                Origin::Position(p) => p - place - along * (length * u),
            };
            if let Origin::Position(_) = light.origin {
                let (first, last) = (to(u), to(u + h));
                let (near, far) = (first.length(), last.length());
                let exponent = light.cone.map_or(1.0, |c| c.exponent);
                let most = angle(shade).min(ANGLES[1] / exponent.max(1.0).sqrt()) * share;
                let factor = 1.0 + (FACTOR - 1.0) * share;
                if first.dot(last) < most.cos() * near * far || near.max(far) > factor * near.min(far) {
                    return false;
                }
            }
            let shines = |x: f64| {
                let (normal, to) = (vector + turn * (u + h * x), to(u + h * x));
                to.dot(along) * normal.length_squared() > 2.0 * normal.dot(to) * normal.dot(along)
            };
            !begins || [0.25, 0.5, 0.75, 1.0].iter().all(|&x| shines(x) == shines(0.0))
        })
    }

    /// Turns the colours that places emit, whose white would be `white`, into the light that comes back of them.
    #[inline(always)]
    pub(super) fn lit(
        &self,
        shade: &Shade,
        segment: &Segment,
        u: Lanes,
        normal: [Lanes; 3],
        color: &mut [Lanes; 3],
        white: Lanes,
    ) {
        let along = segment.along;
        let with = |v: DVec3| each(|i| normal[0][i] * v.x + normal[1][i] * v.y + normal[2][i] * v.z);
        let side = |x: Lanes| each(|i| if shade.two_sided { x[i].abs() } else { x[i].max(0.0) });
        let on_ray = with(along);
        let (mut diffuse, mut specular) = ([[0.0; 4]; 3], [[0.0; 4]; 3]);
        for light in &self.lights {
            let intensity = light.color.map(|c| c * light.intensity);
            // Towards the light, and what of it comes.
            let (to, share) = match light.origin {
                Origin::Headlight => ([-along.x, -along.y, -along.z].map(|x| [x; 4]), [1.0; 4]),
                Origin::Direction(to) => (to.to_array().map(|x| [x; 4]), [1.0; 4]),
                Origin::Position(p) => {
                    let from = u.map(|u| segment.place + along * (segment.length * u) - p);
                    let to = from.map(|from| (-from).normalize_or_zero());
                    let to = [0, 1, 2].map(|k| each(|i| to[i][k]));
                    (to, from.map(|from| light.weakened(from, self.scale)))
                }
            };
            let cosine = each(|i| normal[0][i] * to[0][i] + normal[1][i] * to[1][i] + normal[2][i] * to[2][i]);
            let falls = side(cosine);
            for (sum, intensity) in diffuse.iter_mut().zip(intensity) {
                *sum = each(|i| sum[i] + intensity * share[i] * falls[i]);
            }
            if shade.specular == 0.0 {
                continue;
            }
            let shines = match (shade.highlight, light.origin) {
                (Highlight::Reflected, _) => each(|i| {
                    let toward = to[0][i] * along.x + to[1][i] * along.y + to[2][i] * along.z;
                    (toward - 2.0 * cosine[i] * on_ray[i]).max(0.0)
                }),
                // Half way to a headlight is the way to it.
                (Highlight::Half, Origin::Headlight) => falls,
                (Highlight::Half, _) => {
                    let half = [0, 1, 2].map(|k| each(|i| to[k][i] - along[k]));
                    let length =
                        each(|i| (half[0][i] * half[0][i] + half[1][i] * half[1][i] + half[2][i] * half[2][i]).sqrt());
                    let on_half =
                        each(|i| normal[0][i] * half[0][i] + normal[1][i] * half[1][i] + normal[2][i] * half[2][i]);
                    let seen = side(on_half);
                    each(|i| if length[i] > 1e-12 { seen[i] / length[i] } else { 0.0 })
                }
            };
            let bright = power(shines, shade.power);
            // A highlight is where light falls, and without a highlight's power it is everywhere there.
            let bright = each(|i| if falls[i] > 0.0 { bright[i] * share[i] } else { 0.0 });
            for (sum, intensity) in specular.iter_mut().zip(intensity) {
                *sum = each(|i| sum[i] + intensity * bright[i]);
            }
        }
        for k in 0..3 {
            color[k] = each(|i| {
                color[k][i] * (shade.ambient + shade.diffuse * diffuse[k][i])
                    + shade.specular * specular[k][i] * white[i]
            });
        }
    }
}

/// By what angle normals may turn in a panel.
pub(super) fn angle(shade: &Shade) -> f64 {
    // What is reflected turns twice as far as the normal, and once as far as the way to the light.
    let power = match (shade.specular > 0.0, shade.highlight) {
        (false, _) => 1.0,
        (true, Highlight::Half) => shade.power,
        (true, Highlight::Reflected) => 9.0 * shade.power,
    };
    ANGLES[0].min(ANGLES[1] / power.max(1.0).sqrt())
}

/// Where the line `from` + u `step`, of which the apex is the origin, passes through the side of a cone.
pub(super) fn cone_sides(cone: &Cone, from: DVec3, step: DVec3) -> [f64; 2] {
    let (axis, cosine) = (cone.axis.normalize(), cone.angle.to_radians().cos());
    if cone.angle == 90.0 {
        return [-from.dot(axis) / step.dot(axis), f64::NAN];
    }
    let (p, q, square) = (from.dot(axis), step.dot(axis), cosine * cosine);
    roots(
        q * q - square * step.length_squared(),
        2.0 * (p * q - square * from.dot(step)),
        p * p - square * from.length_squared(),
    )
}
