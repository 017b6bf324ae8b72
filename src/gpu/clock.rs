//! Timestamps and counts of passes, where a device has them.

use super::Gpu;
use super::buffers::Buffer;
use crate::error::Result;
use wgpu::BufferUsages as Usage;

/// Timestamps of a frame at most.
pub(crate) const CLOCKS: u32 = 1024;

/// Measures the passes of the first batches, and counts their fragments, where the device can.
pub(crate) struct Clock {
    queries: wgpu::QuerySet,
    pub(crate) fragments: Option<wgpu::QuerySet>,
    resolved: Buffer,
}

impl Clock {
    /// For the batches of a projection.
    pub(crate) fn new(gpu: &Gpu) -> Result<Option<Self>> {
        let counts = gpu.device.features().contains(wgpu::Features::PIPELINE_STATISTICS_QUERY);
        Self::with(gpu, CLOCKS, counts)
    }

    /// For a single compute pass, the 0th.
    pub(crate) fn of_one_pass(gpu: &Gpu) -> Result<Option<Self>> {
        Self::with(gpu, 2, false)
    }

    /// With so many timestamps, and room for as many counts of fragments if there are any.
    fn with(gpu: &Gpu, timestamps: u32, counts: bool) -> Result<Option<Self>> {
        if !gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return Ok(None);
        }
        let descriptor = wgpu::QuerySetDescriptor { label: None, ty: wgpu::QueryType::Timestamp, count: timestamps };
        let queries = gpu.device.create_query_set(&descriptor);
        let usage = Usage::QUERY_RESOLVE | Usage::COPY_SRC;
        let count = wgpu::QuerySetDescriptor {
            label: None,
            ty: wgpu::QueryType::PipelineStatistics(wgpu::PipelineStatisticsTypes::FRAGMENT_SHADER_INVOCATIONS),
            count: CLOCKS / 4,
        };
        let fragments = counts.then(|| gpu.device.create_query_set(&count));
        let resolved = Buffer::new(gpu, "clock", 16 * u64::from(timestamps), usage)?;
        Ok(Some(Clock { queries, fragments, resolved }))
    }

    pub(crate) fn compute(&self, batch: usize) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        let first = 4 * batch as u32;
        (first + 4 <= CLOCKS).then_some(wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(first),
            end_of_pass_write_index: Some(first + 1),
        })
    }

    pub(crate) fn render(&self, batch: usize) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        let first = 4 * batch as u32 + 2;
        (first + 2 <= CLOCKS).then_some(wgpu::RenderPassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(first),
            end_of_pass_write_index: Some(first + 1),
        })
    }

    pub(crate) fn resolve(&self, encoder: &mut wgpu::CommandEncoder, into: &wgpu::Buffer, offset: u64, batches: usize) {
        let half = 8 * u64::from(CLOCKS);
        encoder.resolve_query_set(&self.queries, 0..4 * batches as u32, &self.resolved.raw, 0);
        if let Some(fragments) = &self.fragments {
            encoder.resolve_query_set(fragments, 0..batches as u32, &self.resolved.raw, half);
        }
        encoder.copy_buffer_to_buffer(&self.resolved.raw, 0, into, offset, 2 * half);
    }

    /// Copies both timestamps of the 0th compute pass, 16 bytes.
    pub(crate) fn resolve_one_pass(&self, encoder: &mut wgpu::CommandEncoder, into: &wgpu::Buffer, offset: u64) {
        encoder.resolve_query_set(&self.queries, 0..2, &self.resolved.raw, 0);
        encoder.copy_buffer_to_buffer(&self.resolved.raw, 0, into, offset, 16);
    }
}
