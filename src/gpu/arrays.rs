//! The mesh's arrays as shaders of all engines read them.

use super::Gpu;
use super::buffers::Chunks;
use crate::error::Result;
use crate::geometry::{Geometry, Values};
use glam::DVec3;

/// An element of [`points`]: each coordinate is the sum of two. They are read in pairs, as devices in software take
/// each read for itself.
pub(crate) const POINT: &str = "\
struct Point { xy: vec2f, z_and_low_x: vec2f, low_yz: vec2f }
fn high_of(p: Point) -> vec3f { return vec3f(p.xy, p.z_and_low_x.x); }
fn low_of(p: Point) -> vec3f { return vec3f(p.z_and_low_x.y, p.low_yz); }
";

/// Stands for a value that is not finite; shaders take all above 1e38 for such.
pub(crate) const INVISIBLE: f32 = 3e38;

/// The normalised positions.
///
/// # Errors
/// Those of [`Chunks::new`].
pub(crate) fn points(gpu: &Gpu, geometry: &Geometry) -> Result<Chunks> {
    Chunks::new(gpu, "points", &geometry.points, |&p| {
        let [[x, y, z], [x_low, y_low, z_low]] = twice(p);
        [x, y, z, x_low, y_low, z_low]
    })
}

/// The values, one after another.
///
/// # Errors
/// Those of [`Chunks::new`].
pub(crate) fn values<const N: usize>(gpu: &Gpu, values: &Values<N>) -> Result<Chunks> {
    let all = match values {
        Values::Point(v) | Values::Cell(v) => v.as_slice(),
        Values::Corner(v) => v.as_flattened(),
    };
    let finite = |v: &[f32; N]| v.map(|v| if v.is_finite() { v } else { INVISIBLE });
    Chunks::new(gpu, "values", all, finite)
}

/// What the shaders call their way of looking values up.
pub(crate) fn association<const N: usize>(values: &Values<N>) -> &'static str {
    match values {
        Values::Point(_) => "POINT",
        Values::Corner(_) => "CORNER",
        Values::Cell(_) => "CELL",
    }
}

/// `v` as a sum of two vectors of f32.
pub(crate) fn twice(v: DVec3) -> [[f32; 3]; 2] {
    let high = v.as_vec3();
    [high, (v - high.as_dvec3()).as_vec3()].map(|v| v.to_array())
}

/// What the shader computes v · (1, i, j) from: the products of pixels and high parts are exact.
pub(crate) fn affine([first, by_column, by_row]: [DVec3; 3]) -> [[[f32; 4]; 2]; 3] {
    let short = |v: DVec3| {
        let high = v.as_vec3().to_array().map(|x| f32::from_bits(x.to_bits() & !0x3fff));
        let low = (v - DVec3::from(high.map(f64::from))).as_vec3();
        [[high[0], high[1], high[2], 0.0], low.extend(0.0).to_array()]
    };
    [twice(first).map(|[x, y, z]| [x, y, z, 0.0]), short(by_column), short(by_row)]
}
