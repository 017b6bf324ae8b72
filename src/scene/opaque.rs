//! Opaque objects, at which rays end.

use crate::view::Ray;
use glam::DVec3;
use serde::Deserialize;

/// An opaque object.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "Written")]
pub enum Opaque {
    /// An infinite plane.
    Plane {
        /// A point in it, in world coordinates.
        point: [f64; 3],
        /// Its normal, of any length but 0.
        normal: [f64; 3],
        /// Its colour, in [0, 1].
        color: [f64; 3],
    },
    /// A sphere, seen from outside or inside.
    Sphere {
        /// Its centre, in world coordinates.
        center: [f64; 3],
        /// Its radius, in world units.
        radius: f64,
        /// Its colour, in [0, 1].
        color: [f64; 3],
    },
}

impl Opaque {
    /// Its colour.
    pub(super) fn color(&self) -> &[f64; 3] {
        match self {
            Opaque::Plane { color, .. } | Opaque::Sphere { color, .. } => color,
        }
    }

    /// Where `ray` meets it first, and its colour.
    pub(super) fn hit(&self, ray: &Ray) -> Option<(f64, [f64; 3])> {
        let (t, color) = match *self {
            Opaque::Plane { point, normal, color } => {
                let normal = DVec3::from(normal);
                ((DVec3::from(point) - ray.origin).dot(normal) / ray.direction.dot(normal), color)
            }
            Opaque::Sphere { center, radius, color } => {
                let to = DVec3::from(center) - ray.origin;
                let middle = to.dot(ray.direction);
                // The distance of the centre from the line, not its square's difference: that cancels far away.
                let across = (to - ray.direction * middle).length();
                let half = ((radius - across) * (radius + across)).sqrt();
                (if middle - half >= ray.t_min { middle - half } else { middle + half }, color)
            }
        };
        (t >= ray.t_min && t < ray.t_max).then_some((t, color))
    }
}

/// An object as a scene's file has it: what kinds have in common, and what they have not.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    #[serde(rename = "type")]
    kind: Kind,
    point: Option<[f64; 3]>,
    normal: Option<[f64; 3]>,
    center: Option<[f64; 3]>,
    radius: Option<f64>,
    color: Option<[f64; 3]>,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Kind {
    Plane,
    Sphere,
}

impl TryFrom<Written> for Opaque {
    type Error = String;

    fn try_from(written: Written) -> Result<Self, String> {
        let Written { kind, point, normal, center, radius, color } = written;
        let color = color.unwrap_or([1.0; 3]);
        let missing = |key: &str| format!("the key \"{key}\" is missing");
        let strange = |what: &str, keys: [(&str, bool); 2]| match keys.iter().find(|key| key.1) {
            Some((key, _)) => Err(format!("a {what} has no key \"{key}\"")),
            None => Ok(()),
        };
        match kind {
            Kind::Plane => {
                strange("plane", [("center", center.is_some()), ("radius", radius.is_some())])?;
                let point = point.ok_or_else(|| missing("point"))?;
                let normal = normal.ok_or_else(|| missing("normal"))?;
                if normal == [0.0; 3] {
                    Err("the normal is zero".into())
                } else {
                    Ok(Opaque::Plane { point, normal, color })
                }
            }
            Kind::Sphere => {
                strange("sphere", [("point", point.is_some()), ("normal", normal.is_some())])?;
                let center = center.ok_or_else(|| missing("center"))?;
                let radius = radius.ok_or_else(|| missing("radius"))?;
                if radius > 0.0 {
                    Ok(Opaque::Sphere { center, radius, color })
                } else {
                    Err("the radius is not above 0".into())
                }
            }
        }
    }
}
