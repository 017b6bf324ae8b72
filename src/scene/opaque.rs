//! Opaque objects, at which rays end.

use crate::view::Ray;
use glam::DVec3;
use serde::Deserialize;

/// An opaque object.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "lowercase", deny_unknown_fields)]
pub enum Opaque {
    /// An infinite plane.
    Plane {
        /// A point in it, in world coordinates.
        point: [f64; 3],
        /// Its normal, of any length but 0.
        normal: [f64; 3],
        /// Its colour, in [0, 1].
        #[serde(default = "white")]
        color: [f64; 3],
    },
    /// A sphere, seen from outside or inside.
    Sphere {
        /// Its centre, in world coordinates.
        center: [f64; 3],
        /// Its radius, in world units.
        radius: f64,
        /// Its colour, in [0, 1].
        #[serde(default = "white")]
        color: [f64; 3],
    },
}

impl Opaque {
    /// Says what is wrong with it, if anything.
    pub(super) fn check(&self) -> Result<(), &'static str> {
        match *self {
            Opaque::Plane { normal, .. } if normal == [0.0; 3] => Err("the normal is zero"),
            Opaque::Sphere { radius, .. } if radius <= 0.0 => Err("the radius is not above 0"),
            _ => Ok(()),
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

fn white() -> [f64; 3] {
    [1.0; 3]
}
