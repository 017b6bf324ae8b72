//! A stable radix sort on the device, for order by depth without a way through the host.

use super::Gpu;
use super::buffers::Buffer;
use super::raster::{self, Readback, Slot};
use crate::error::Result;
use bytemuck::{Pod, Zeroable};
use wgpu::{BufferUsages as Usage, ShaderStages as Stages};

const SORT: &str = include_str!("../../shaders/sort.wgsl");

/// Items of one block, as the shader has it.
const BLOCK: usize = 2048;

/// Passes, of 4 bits each.
const PASSES: u32 = 8;

const MOST_GROUPS: u32 = 65_535;

/// `SortPass` in the shader.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct SortPass {
    items: u32,
    shift: u32,
    blocks: u32,
    is_first: u32,
    row: u32,
}

/// The sort, compiled.
pub(crate) struct Sorter {
    layout: wgpu::BindGroupLayout,
    pipelines: [wgpu::ComputePipeline; 3],
}

impl Sorter {
    /// A sort that leaves out items whose key is `skipped`.
    ///
    /// # Errors
    /// Those of [`Gpu::check`].
    pub(crate) fn new(gpu: &Gpu, skipped: u32) -> Result<Self> {
        use Slot::{Read, Uniform, Write};
        let layout = raster::layout(gpu, Stages::COMPUTE, &[Uniform, Read, Read, Write, Write, Write, Write]);
        let module = raster::module(gpu, "sort", &format!("const SKIPPED = {skipped}u;\n{SORT}"));
        let all = raster::pipeline_layout(gpu, &[Some(&layout)]);
        let pipelines = ["count", "sum", "scatter"].map(|entry| raster::compute(gpu, &module, entry, &all));
        gpu.check()?;
        Ok(Sorter { layout, pipelines })
    }

    /// Whether `items` keys are few enough for the device's bindings.
    pub(crate) fn fits(gpu: &Gpu, items: usize) -> bool {
        4 * items as u64 <= gpu.binding
    }

    /// The numbers of the items of `keys`, which is as long as `items` and is overwritten, by ascending key; equal ones
    /// in sequence. How many they are comes with it.
    ///
    /// # Errors
    /// Those of [`Gpu::wait`] and [`Buffer::new`].
    pub(crate) fn sort(&self, gpu: &Gpu, keys: &Buffer, items: usize) -> Result<(Buffer, usize)> {
        let blocks = items.div_ceil(BLOCK).max(1) as u32;
        let bytes = 4 * items as u64;
        let other_keys = Buffer::new(gpu, "keys", bytes, Usage::STORAGE)?;
        let numbers = Buffer::new(gpu, "order", bytes, Usage::STORAGE | Usage::COPY_SRC)?;
        let other_numbers = Buffer::new(gpu, "numbers", bytes, Usage::STORAGE)?;
        let counts = Buffer::new(gpu, "counts", 64 * u64::from(blocks), Usage::STORAGE)?;
        let total = Buffer::new(gpu, "total", 4, Usage::STORAGE | Usage::COPY_SRC)?;
        let back = Readback::new(gpu, 4)?;
        let row = blocks.min(MOST_GROUPS);
        // An even number of passes: what the first writes to is the other pair, the last writes the order.
        let passes = (0..PASSES)
            .map(|p| {
                let pass = SortPass { items: items as u32, shift: 4 * p, blocks, is_first: u32::from(p == 0), row };
                Buffer::holding(gpu, "pass", &[pass], Usage::UNIFORM)
            })
            .collect::<Result<Vec<_>>>()?;
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        for (p, pass) in passes.iter().enumerate() {
            let (from, to) = ([keys, &numbers], [&other_keys, &other_numbers]);
            let (from, to) = if p % 2 == 0 { (from, to) } else { (to, from) };
            let all = [pass, from[0], from[1], to[0], to[1], &counts, &total];
            let group = raster::group_of(gpu, &self.layout, all);
            for (k, pipeline) in self.pipelines.iter().enumerate() {
                let mut pass = encoder.begin_compute_pass(&Default::default());
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, &group, &[]);
                let groups = if k == 1 { [1, 1] } else { [row, blocks.div_ceil(row)] };
                pass.dispatch_workgroups(groups[0], groups[1], 1);
            }
        }
        encoder.copy_buffer_to_buffer(&total.raw, 0, back.raw(), 0, 4);
        let sorted = back.submit(gpu, encoder, |bytes| bytemuck::pod_read_unaligned::<u32>(&bytes[..4]))?;
        Ok((numbers, sorted as usize))
    }
}
