//! The mesh's arrays as shaders of all engines read them.

use super::buffers::Chunks;
use super::shader::ShaderArray;
use super::{Gpu, rays};
use crate::error::Result;
use crate::geometry::{TetMesh, Values};
use bytemuck::{NoUninit, Zeroable};

/// An element of [`points`]: each coordinate is the sum of two.
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
pub(crate) fn points(gpu: &Gpu, geometry: &TetMesh) -> Result<Chunks> {
    Chunks::new(gpu, "points", &geometry.points, |&p| {
        let [[x, y, z], [x_low, y_low, z_low]] = rays::double_single(p);
        [x, y, z, x_low, y_low, z_low]
    })
}

/// The values, one after another.
///
/// # Errors
/// Those of [`Chunks::new`].
pub(crate) fn values<const N: usize>(gpu: &Gpu, values: &Values<N>) -> Result<Chunks> {
    some_of(gpu, "values", values, |v: &[f32; N]| *v)
}

/// Some numbers of each of the values, as `some` picks them.
///
/// # Errors
/// Those of [`Chunks::new`].
pub(crate) fn some_of<const N: usize, const M: usize>(
    gpu: &Gpu,
    label: &str,
    values: &Values<N>,
    some: impl Fn(&[f32; N]) -> [f32; M],
) -> Result<Chunks>
where
    [f32; M]: NoUninit + Zeroable,
{
    let all = match values {
        Values::Point(v) | Values::Cell(v) => v.as_slice(),
        Values::Corner(v) => v.as_flattened(),
    };
    Chunks::new(gpu, label, all, |v| some(v).map(|v| if v.is_finite() { v } else { INVISIBLE }))
}

/// `chunks` as shaders see them, by the names of the arrays and of their elements.
pub(crate) fn named<const N: usize>(
    names: [(&'static str, &'static str); N],
    chunks: [&Chunks; N],
) -> [ShaderArray; N] {
    std::array::from_fn(|i| of_name(names[i], chunks[i]))
}

/// One of them.
pub(crate) fn of_name((name, element): (&'static str, &'static str), chunks: &Chunks) -> ShaderArray {
    ShaderArray { name, element, chunks: chunks.buffers.len(), shift: chunks.shift }
}

/// What the shaders call their way of looking values up.
pub(crate) fn association<const N: usize>(values: &Values<N>) -> &'static str {
    match values {
        Values::Point(_) => "POINT",
        Values::Corner(_) => "CORNER",
        Values::Cell(_) => "CELL",
    }
}
