//! Buffers: counted against the budget, and in chunks where one binding cannot hold them.

use super::Gpu;
use crate::error::{Error, Result};
use bytemuck::{NoUninit, Zeroable};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Bytes that are converted and handed over at a time, so that the copies on the way stay small.
const SLICE: usize = 8 << 20;

/// A buffer that gives its bytes back to the budget when it goes.
#[derive(Debug)]
pub(crate) struct Buffer {
    pub(crate) raw: wgpu::Buffer,
    allocated: Arc<AtomicU64>,
}

impl Buffer {
    /// A buffer of `size` bytes, a multiple of 4 and at least 16.
    ///
    /// # Errors
    /// [`Error::Memory`] if the budget does not allow it, and those of [`Gpu::check`].
    pub(crate) fn new(gpu: &Gpu, label: &str, size: u64, usage: wgpu::BufferUsages) -> Result<Self> {
        let size = size.next_multiple_of(4).max(16);
        let before = gpu.allocated.fetch_add(size, Relaxed);
        // From here on the bytes are given back on drop, whatever fails.
        let allocated = Arc::clone(&gpu.allocated);
        let needed = before + size;
        if needed > gpu.budget {
            allocated.fetch_sub(size, Relaxed);
            return Err(Error::Memory { device: gpu.adapter.name.clone(), needed, allowed: gpu.budget });
        }
        let descriptor = wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false };
        let buffer = Buffer { raw: gpu.device.create_buffer(&descriptor), allocated };
        gpu.check()?;
        Ok(buffer)
    }

    /// A buffer that holds `data`.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(crate) fn holding<T: NoUninit>(gpu: &Gpu, label: &str, data: &[T], usage: wgpu::BufferUsages) -> Result<Self> {
        let buffer = Self::new(gpu, label, size_of_val(data) as u64, usage | wgpu::BufferUsages::COPY_DST)?;
        buffer.write(gpu, 0, bytemuck::cast_slice(data));
        Ok(buffer)
    }

    /// Hands `bytes` over, to be at `offset`; both are multiples of 4.
    pub(crate) fn write(&self, gpu: &Gpu, offset: u64, bytes: &[u8]) {
        gpu.uploaded.fetch_add(bytes.len() as u64, Relaxed);
        gpu.queue.write_buffer(&self.raw, offset, bytes);
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        self.allocated.fetch_sub(self.raw.size(), Relaxed);
    }
}

/// An array in as many buffers as bindings of this device need; element i is in chunk i >> `shift`.
#[derive(Debug)]
pub(crate) struct Chunks {
    pub(crate) buffers: Vec<Buffer>,
    pub(crate) shift: u32,
}

impl Chunks {
    /// An array of `source`, each element as `convert` makes it.
    ///
    /// # Errors
    /// [`Error::Memory`] if the budget does not allow it, and those of [`Gpu::check`].
    pub(crate) fn new<S, T: NoUninit + Zeroable>(
        gpu: &Gpu,
        label: &str,
        source: &[S],
        convert: impl Fn(&S) -> T,
    ) -> Result<Self> {
        Self::generated(gpu, label, source.len(), |i| convert(&source[i]))
    }

    /// An array of `count` elements, each as `element` makes it of its number.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(crate) fn generated<T: NoUninit + Zeroable>(
        gpu: &Gpu,
        label: &str,
        count: usize,
        element: impl Fn(usize) -> T,
    ) -> Result<Self> {
        let shift = (gpu.binding / size_of::<T>() as u64).max(1).ilog2().min(31);
        let mut buffers = Vec::new();
        let mut slice = vec![T::zeroed(); (SLICE / size_of::<T>()).min(count)];
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        // An empty array still needs something to bind.
        let starts = (0..count).step_by(1 << shift).chain((count == 0).then_some(0));
        for start in starts {
            let end = count.min(start + (1 << shift));
            let buffer = Buffer::new(gpu, label, size_of::<T>() as u64 * (end - start) as u64, usage)?;
            let mut offset = 0;
            for from in (start..end).step_by(slice.len().max(1)) {
                let length = slice.len().min(end - from);
                for (i, to) in (from..).zip(&mut slice[..length]) {
                    *to = element(i);
                }
                let bytes: &[u8] = bytemuck::cast_slice(&slice[..length]);
                buffer.write(gpu, offset, bytes);
                offset += bytes.len() as u64;
                if offset % (8 * SLICE as u64) == 0 {
                    gpu.queue.submit([]);
                    gpu.wait()?;
                }
            }
            buffers.push(buffer);
        }
        gpu.queue.submit([]);
        gpu.check()?;
        Ok(Chunks { buffers, shift })
    }
}
