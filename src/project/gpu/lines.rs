//! What cells and fragments look up of the transfer function: its lines, and which values show anything.

use crate::error::Result;
use crate::field::Kind;
use crate::gpu::Gpu;
use crate::gpu::raster::Texture;
use crate::gpu::rays::FAR;
use crate::integral::{Exact, Knots, Line};
use bytemuck::{Pod, Zeroable};

/// Lines in a row of the image of them.
pub(super) const LINES_ACROSS: usize = 4096;

/// Equal bins of the values' range, [−1, 1].
pub(super) const BINS: usize = 1024;

/// The lines as an image: value, slope, and below each other the two ends and the number of the line of a single value,
/// [`LINES_ACROSS`] in a row. After them comes one that no value is on.
///
/// # Errors
/// Those of [`Texture::new`].
pub(super) fn image(gpu: &Gpu, exact: &Exact<f32>) -> Result<Texture> {
    let mut lines = exact.opacity.lines();
    let none = Line { value: [0.0; 4], slope: [0.0; 4], ends: [FAR; 2], single: 0 };
    lines.push(none);
    let across = lines.len().min(LINES_ACROSS);
    let size = [across as u32, 3 * lines.len().div_ceil(across) as u32];
    let mut texels = vec![[0.0; 4]; size[0] as usize * size[1] as usize];
    for (i, line) in lines.iter().enumerate() {
        let at = i % across + 3 * across * (i / across);
        texels[at] = line.value;
        texels[at + across] = line.slope;
        texels[at + 2 * across] = [line.ends[0], line.ends[1], line.single as f32, 0.0];
    }
    let format = wgpu::TextureFormat::Rgba32Float;
    let usage = wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_DST;
    let texture = Texture::new(gpu, "lines", wgpu::TextureDimension::D2, [size[0], size[1], 1], format, usage)?;
    texture.write(gpu, [0; 3], size, bytemuck::cast_slice(&texels));
    Ok(texture)
}

/// What is known of an end of a bin.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(super) struct BinEnd {
    /// The number of bins below it in which something may be seen.
    pub(super) shown: u32,
    /// The line that it is on.
    pub(super) line: u32,
}

/// The [`BINS`] + 1 ends of bins.
pub(super) fn bins(exact: &Exact<f32>) -> Vec<BinEnd> {
    // Where emission is not bound to extinction, another component may shine.
    let shines = exact.direct && exact.kind != Kind::Scalar;
    let begins: Vec<f32> = exact.opacity.lines().iter().filter(|l| l.ends[0] < l.ends[1]).map(|l| l.ends[0]).collect();
    let at = |b: usize| (2.0 * b as f64 / BINS as f64 - 1.0) as f32;
    let shows = |knots: &Knots<f32>, b: usize| shines || knots.shows(at(b), at(b + 1), exact.direct);
    let mut ends = vec![BinEnd::default(); BINS + 1];
    for b in 0..=BINS {
        ends[b].line = begins.partition_point(|&s| s <= at(b)).max(1) as u32 - 1;
        if b > 0 {
            ends[b].shown = ends[b - 1].shown + u32::from(shows(&exact.opacity, b - 1));
        }
    }
    ends
}
