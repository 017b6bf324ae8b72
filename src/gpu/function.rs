//! The transfer function as `shaders/integral.wgsl` reads it.

use super::Gpu;
use super::buffers::Buffer;
use super::raster::Texture;
use crate::error::Result;
use crate::integral::{Exact, Knots};
use bytemuck::{Pod, Zeroable};
use wgpu::BufferUsages as Usage;

/// `Function` in the shader.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Function {
    pub(crate) opacity: u32,
    pub(crate) color: u32,
    pub(crate) end: u32,
    pub(crate) scale: f32,
}

/// `Knot` in the shader.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Knot {
    pub(crate) value: [f32; 4],
    pub(crate) slope: [f32; 4],
    pub(crate) ends: [f32; 2],
    pub(crate) padding: [f32; 2],
}

/// Intervals in a row of [`lines`].
pub(crate) const LINES_ACROSS: usize = 4096;

fn functions(exact: &Exact<f32>) -> impl Iterator<Item = &Knots<f32>> {
    [Some(&exact.opacity), exact.color.as_ref()].into_iter().flatten()
}

fn knots(exact: &Exact<f32>) -> Vec<Knot> {
    let of = |f: &Knots<f32>, i: usize| {
        let ends = [f.s[i], *f.s.get(i + 1).unwrap_or(&f.s[i])];
        Knot { value: f.value[i], slope: f.slope[i], ends, padding: [0.0; 2] }
    };
    functions(exact).flat_map(|f| (0..f.len()).map(move |i| of(f, i))).collect()
}

/// `Function`, its knots and its buckets: bindings 0 to 2 of group 0.
pub(crate) fn upload(gpu: &Gpu, exact: &Exact<f32>) -> Result<[Buffer; 3]> {
    let (mut first, mut buckets) = (0, Vec::<u32>::new());
    for f in functions(exact) {
        buckets.extend(f.bucket.iter().map(|b| b + first));
        first += f.len() as u32;
    }
    let function = Function { opacity: 0, color: exact.opacity.len() as u32, end: first, scale: exact.scale };
    Ok([
        Buffer::holding(gpu, "function", &[function], Usage::UNIFORM)?,
        Buffer::holding(gpu, "knots", &knots(exact), Usage::STORAGE)?,
        Buffer::holding(gpu, "buckets", &buckets, Usage::STORAGE)?,
    ])
}

/// The knots as a texture: value, slope, and below each other the two ends and the next interval that is not empty (of
/// the last, itself), [`LINES_ACROSS`] in a row.
///
/// # Errors
/// Those of [`Texture::new`].
pub(crate) fn lines(gpu: &Gpu, exact: &Exact<f32>) -> Result<Texture> {
    let mut knots = knots(exact);
    let across = knots.len().clamp(1, LINES_ACROSS);
    let down = knots.len().div_ceil(across).max(1);
    let mut next: Vec<f32> = (0..across * down).map(|i| i as f32).collect();
    for i in (1..knots.len()).rev() {
        let is_empty = knots[i].ends[0] >= knots[i].ends[1];
        next[i - 1] = if is_empty { next[i] } else { i as f32 };
    }
    knots.resize(across * down, Knot::zeroed());
    let ends: Vec<_> = knots.iter().zip(&next).map(|(k, n)| [k.ends[0], k.ends[1], *n, 0.0]).collect();
    let texels: Vec<[f32; 4]> = knots
        .chunks(across)
        .zip(ends.chunks(across))
        .flat_map(|(row, ends)| {
            row.iter().map(|k| k.value).chain(row.iter().map(|k| k.slope)).chain(ends.iter().copied())
        })
        .collect();
    let size = [across as u32, 3 * down as u32];
    let format = wgpu::TextureFormat::Rgba32Float;
    let usage = wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_DST;
    let texture = Texture::new(gpu, "lines", wgpu::TextureDimension::D2, [size[0], size[1], 1], format, usage)?;
    texture.write(gpu, [0; 3], size, bytemuck::cast_slice(&texels));
    Ok(texture)
}
