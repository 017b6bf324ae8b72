//! Light in a panel: what comes back of it, and how much of it may change.

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

impl Second {
    /// Whether lights that have a position, and highlights that begin, change little enough in a panel of length `h` at `u`:
    /// by a `share` of what may change in one.
    pub(super) fn is_evenly_lit(&self, segment: &Segment, u: f64, h: f64, share: f64) -> bool {
        let Some(shade) = self.shading.as_ref().and_then(Shading::shade) else { return true };
        let Segment { vector, turn, place, along, length, .. } = *segment;
        let begins =
            shade.highlight == Highlight::Reflected && shade.specular > 0.0 && shade.power < SMOOTH && h > EDGE;
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

    /// The light that comes back of the colours `emitted`, whose white would be `white`.
    pub(super) fn lit(
        &self,
        shade: &Shade,
        normal: Option<DVec3>,
        place: DVec3,
        along: DVec3,
        emitted: DVec3,
        white: f64,
    ) -> DVec3 {
        let Some(normal) = normal else { return emitted * shade.ambient };
        let side = |x: f64| if shade.two_sided { x.abs() } else { x.max(0.0) };
        let (mut diffuse, mut specular) = (DVec3::ZERO, DVec3::ZERO);
        for light in &self.lights {
            let mut intensity = DVec3::from(light.color) * light.intensity;
            let to = match light.origin {
                Origin::Headlight => -along,
                Origin::Direction(to) => to,
                Origin::Position(p) => {
                    intensity *= light.weakened(place - p, self.scale);
                    (p - place).normalize_or_zero()
                }
            };
            let falls = side(normal.dot(to));
            if falls <= 0.0 {
                continue;
            }
            diffuse += intensity * falls;
            if shade.specular == 0.0 {
                continue;
            }
            let shines = match (shade.highlight, light.origin) {
                (Highlight::Reflected, _) => (to.dot(along) - 2.0 * normal.dot(to) * normal.dot(along)).max(0.0),
                // Half way to a headlight is the way to it.
                (Highlight::Half, Origin::Headlight) => falls,
                (Highlight::Half, _) => {
                    let half = to - along;
                    let length = half.length();
                    if length > 1e-12 { side(normal.dot(half)) / length } else { continue }
                }
            };
            specular += intensity * power(shines, shade.power);
        }
        emitted * (shade.ambient + shade.diffuse * diffuse) + specular * (shade.specular * white)
    }
}

/// xᵖ, which for small whole powers is a few products.
pub(super) fn power(x: f64, p: f64) -> f64 {
    if p.fract() == 0.0 && p <= 64.0 { x.powi(p as i32) } else { x.powf(p) }
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
