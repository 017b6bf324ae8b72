//! The transfer function as `shaders/integral.wgsl` reads it.

use super::Gpu;
use super::buffers::Buffer;
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
