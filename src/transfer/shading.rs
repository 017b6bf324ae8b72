//! Light on the gradient: Phong's terms, and silhouettes.
//!
//! The normal n is the unit vector of the gradient, whose components are linear inside a cell; d is the ray's direction.
//! A silhouette multiplies extinction by (1 − |n·d|)ᵖ, as Song et al. (2009) do with |1 − n·d| of normals that are turned
//! to the eye. Shading lights the colour, with unit vectors l to each light, h = (l − d)/|l − d|, and I intensity times
//! colour of the light:
//!
//! lit c = c (ambient + diffuse Σ I ⟨n·l⟩) + specular Σ I ⟨n·h⟩^power, the last over lights with ⟨n·l⟩ > 0,
//!
//! ⟨x⟩ = |x| if both sides are lit, else max(x, 0). A reflected highlight has max(0, −r·d)^power in place of the last term,
//! r = 2 (n·l) n − l. Where there is no gradient there is no normal: ambient light alone is left, and a silhouette changes
//! nothing. The light of a position that is δ world units away is I/(a + b δ + c δ²); in a cone of half angle β about the
//! axis a, it is multiplied by (−l·a)^exponent where that is cos β at least, and 0 elsewhere.

use crate::error::{Error, Result};
use glam::DVec3;
use serde::Deserialize;

/// Light on the gradient.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Shading {
    silhouette: Option<f64>,
    shade: Option<Shade>,
    lights: Vec<Light>,
}

/// How much of the light comes back, and how.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shade {
    /// Share of the colour that is seen without light, at least 0.
    pub ambient: f64,
    /// Share that is scattered to all sides, at least 0.
    pub diffuse: f64,
    /// Height of the highlight, at least 0.
    pub specular: f64,
    /// Its power, at least 0.
    pub power: f64,
    /// Whether both sides are lit; else only that to which the gradient points.
    pub two_sided: bool,
    /// What the highlight is computed from.
    pub highlight: Highlight,
}

impl Default for Shade {
    /// VTK's: ambient 0.1, diffuse 0.7, specular 0.2, power 10; both sides.
    fn default() -> Self {
        Shade {
            ambient: 0.1,
            diffuse: 0.7,
            specular: 0.2,
            power: 10.0,
            two_sided: true,
            highlight: Highlight::default(),
        }
    }
}

/// What a highlight is computed from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Highlight {
    /// The vector h half way between those to the light and to the eye: ⟨n·h⟩^power.
    #[default]
    Half,
    /// The vector r to which the light is reflected: max(0, −r·d)^power, as in the shaders of VTK's image mappers.
    Reflected,
}

/// A light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light {
    /// Where it comes from.
    pub origin: Origin,
    /// Its colour, at least 0.
    pub color: [f64; 3],
    /// What its colour is multiplied by, at least 0.
    pub intensity: f64,
    /// Of a position, the numbers (a, b, c) by which it gets weaker with the distance δ, in world units:
    /// 1/(a + b δ + c δ²). At least 0, and not all of them 0; (1, 0, 0) for other lights.
    pub attenuation: [f64; 3],
    /// Of a position, what it lights; else all around it.
    pub cone: Option<Cone>,
}

/// What a light lights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cone {
    /// Where its axis goes, of any length but 0.
    pub axis: DVec3,
    /// The angle between its axis and its side, in degrees: above 0, and 90 at most.
    pub angle: f64,
    /// The power of the cosine by which it gets weaker off the axis, at least 0.
    pub exponent: f64,
}

impl Light {
    /// What it is multiplied by `from` itself: the vector from the light to what is lit, in world units times `scale`.
    pub(crate) fn weakened(&self, from: DVec3, scale: f64) -> f64 {
        let distance = from.length();
        let [a, b, c] = self.attenuation;
        let (delta, mut share) = (distance / scale, 1.0);
        if let Some(Cone { axis, angle, exponent }) = self.cone {
            let cosine = from.dot(axis.normalize()) / distance.max(f64::MIN_POSITIVE);
            share = if cosine >= angle.to_radians().cos() { cosine.max(0.0).powf(exponent) } else { 0.0 };
        }
        share / (a + delta * (b + delta * c)).max(f64::MIN_POSITIVE)
    }
}

/// Where light comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Origin {
    /// The eye, along each ray.
    Headlight,
    /// Far away: this is where it goes, of any length but 0.
    Direction(DVec3),
    /// A place, in world coordinates; nothing throws a shadow.
    Position(DVec3),
}

impl Origin {
    /// The same light in coordinates (world − `centre`) · `scale`; directions of length 1, towards the light.
    pub(crate) fn moved(self, centre: DVec3, scale: f64) -> Self {
        match self {
            Origin::Headlight => self,
            Origin::Direction(d) => Origin::Direction(-d.normalize()),
            Origin::Position(p) => Origin::Position((p - centre) * scale),
        }
    }
}

impl Default for Light {
    /// A white headlight.
    fn default() -> Self {
        Light { origin: Origin::Headlight, color: [1.0; 3], intensity: 1.0, attenuation: [1.0, 0.0, 0.0], cone: None }
    }
}

impl Shading {
    /// The power p of silhouettes, if such are drawn.
    pub fn silhouette(&self) -> Option<f64> {
        self.silhouette
    }

    /// Takes the silhouettes away, and says their power.
    pub(crate) fn take_silhouette(&mut self) -> Option<f64> {
        self.silhouette.take()
    }

    /// How the colour is lit, if it is.
    pub fn shade(&self) -> Option<&Shade> {
        self.shade.as_ref()
    }

    /// The lights, if the colour is lit.
    pub fn lights(&self) -> &[Light] {
        &self.lights
    }

    /// With extinction multiplied by (1 − |n·d|)ᵖ.
    ///
    /// # Errors
    /// [`Error::Transfer`] if p is negative or not finite.
    pub fn with_silhouette(mut self, p: f64) -> Result<Self> {
        if !(p >= 0.0 && p.is_finite()) {
            return Err(Error::Transfer(format!("silhouette: {p} is no power, which is 0 or more")));
        }
        self.silhouette = Some(p);
        Ok(self)
    }

    /// With the colour lit by `lights`.
    ///
    /// # Errors
    /// [`Error::Transfer`] for a number that is negative or not finite, or a light that goes nowhere; named as scenes do.
    pub fn with_lights(mut self, shade: Shade, lights: Vec<Light>) -> Result<Self> {
        let bad = |x: &f64| !(*x >= 0.0 && x.is_finite());
        let terms = [
            ("ambient", shade.ambient),
            ("diffuse", shade.diffuse),
            ("specular", shade.specular),
            ("power", shade.power),
        ];
        if let Some((name, x)) = terms.iter().find(|(_, x)| bad(x)) {
            return Err(Error::Transfer(format!("shade.{name}: {x} is not 0 or more")));
        }
        for (i, light) in lights.iter().enumerate() {
            let fail = |what: String| Err(Error::Transfer(format!("lights[{i}].{what}")));
            if let Some(c) = light.color.iter().find(|c| bad(c)) {
                return fail(format!("color: {c} is not 0 or more"));
            }
            if bad(&light.intensity) {
                return fail(format!("intensity: {} is not 0 or more", light.intensity));
            }
            match light.origin {
                Origin::Direction(d) if !d.is_finite() || d == DVec3::ZERO => {
                    return fail(format!("direction: {d} leads nowhere"));
                }
                Origin::Position(p) if !p.is_finite() => return fail(format!("position: {p} is not finite")),
                _ => {}
            }
            let plain = Light::default();
            if light.attenuation.iter().any(bad) || light.attenuation == [0.0; 3] {
                let [a, b, c] = light.attenuation;
                return fail(format!("attenuation: ({a}, {b}, {c}) are three numbers of 0 or more, one of them above"));
            }
            if let Some(Cone { axis, angle, exponent }) = light.cone {
                if !axis.is_finite() || axis == DVec3::ZERO {
                    return fail(format!("cone.direction: {axis} leads nowhere"));
                }
                if !(angle > 0.0 && angle <= 90.0) {
                    return fail(format!("cone.angle: {angle} is not above 0 and 90 degrees at most"));
                }
                if bad(&exponent) {
                    return fail(format!("cone.exponent: {exponent} is not 0 or more"));
                }
            }
            let alike = light.attenuation == plain.attenuation && light.cone.is_none();
            if !matches!(light.origin, Origin::Position(_)) && !alike {
                return fail("position: only a light that has one has an attenuation or a cone".into());
            }
        }
        (self.shade, self.lights) = (Some(shade), lights);
        Ok(self)
    }

    /// Whether anything is lit, or a silhouette drawn.
    pub(crate) fn needs_normals(&self) -> bool {
        self.silhouette.is_some() || self.shade.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_is_named() {
        let shade = Shade::default();
        let told = |shade, light| Shading::default().with_lights(shade, vec![light]).unwrap_err().to_string();
        let light = Light::default();
        let place = Light { origin: Origin::Position(DVec3::X), ..light };
        let cone = Cone { axis: DVec3::Z, angle: 30.0, exponent: 1.0 };
        for (message, part) in [
            (told(Shade { diffuse: -0.1, ..shade }, light), "shade.diffuse: -0.1"),
            (told(shade, Light { intensity: f64::NAN, ..light }), "lights[0].intensity"),
            (told(shade, Light { color: [0.0, -1.0, 0.0], ..light }), "lights[0].color"),
            (told(shade, Light { origin: Origin::Direction(DVec3::ZERO), ..light }), "lights[0].direction"),
            (told(shade, Light { origin: Origin::Position(DVec3::NAN), ..light }), "lights[0].position"),
            (told(shade, Light { attenuation: [0.0; 3], ..place }), "lights[0].attenuation"),
            (told(shade, Light { attenuation: [1.0, -1.0, 0.0], ..place }), "lights[0].attenuation"),
            (told(shade, Light { cone: Some(Cone { angle: 91.0, ..cone }), ..place }), "lights[0].cone.angle: 91"),
            (
                told(shade, Light { cone: Some(Cone { axis: DVec3::ZERO, ..cone }), ..place }),
                "lights[0].cone.direction",
            ),
            (told(shade, Light { cone: Some(Cone { exponent: -1.0, ..cone }), ..place }), "lights[0].cone.exponent"),
            (told(shade, Light { cone: Some(cone), ..light }), "lights[0].position"),
            (Shading::default().with_silhouette(-1.0).unwrap_err().to_string(), "silhouette: -1"),
        ] {
            assert!(message.contains(part), "{message}");
        }
        let lit = Shading::default().with_lights(shade, vec![light]).unwrap();
        assert!(lit.needs_normals() && !Shading::default().needs_normals());
    }
}
