//! Which cells are seen, and in which order they are drawn.

use super::{BATCH, Pass, Project, Slice, groups_of, unprepared};
use crate::error::{Error, Result};
use crate::gpu::buffers::Buffer;
use crate::gpu::raster::Readback;
use crate::gpu::sort::Sorter;
use crate::order::depth::{self, HIDDEN};
use crate::project::frame::{Frame, Seen};
use crate::project::lines::Lines;
use crate::project::{Fragments, Order, Switches};
use wgpu::BufferUsages as Usage;

/// Entries of one buffer of the order, a multiple of [`BATCH`].
pub(super) const ORDER_CHUNK: usize = BATCH << 6;

/// The bit of an entry from which on it says how many parts of the cell came before; those below it are the cell.
pub(super) const PIECE: u32 = 30;

/// Cells that are classified at once.
const CLASSIFIED: usize = 1 << 24;

/// Somebody who is shown keys, some at a time.
type Reader<'a> = &'a mut dyn FnMut(&[u32]);

/// Which cells are drawn in parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Parts {
    /// None.
    None,
    /// Those of more lines of the function than a record holds.
    OfLines,
    /// Those around the eye.
    AroundEye,
}

impl Parts {
    fn new(switches: &Switches, lines: Lines) -> Self {
        match switches.fragments {
            Fragments::Intersected if lines.are_all() => Parts::OfLines,
            Fragments::Intersected => Parts::None,
            _ => Parts::AroundEye,
        }
    }
}

/// The order of a frame, and what it holds for.
pub(super) struct Ordered {
    frame: Frame,
    planes: Vec<[f32; 4]>,
    by: Order,
    parts: Parts,
    /// Cells, and entries: one for each part of a cell; and the buffers that they are in, so many in each.
    pub(super) cells: usize,
    pub(super) entries: usize,
    pub(super) chunk: usize,
    pub(super) chunks: Vec<Buffer>,
}

impl Ordered {
    pub(super) fn holds_for(&self, seen: &Seen, switches: &Switches, lines: Lines) -> bool {
        self.frame == seen.frame
            && self.planes == seen.planes
            && self.by == switches.order
            && self.parts == Parts::new(switches, lines)
    }
}

/// Writes into the entries of each cell, which come one after another, how many came before, and counts cells.
fn number_parts(order: &mut [u32]) -> usize {
    let (mut last, mut part, mut cells) = (None, 0, 0);
    for entry in order {
        part = if last == Some(*entry) { part + 1 } else { 0 };
        cells += usize::from(part == 0);
        last = Some(*entry);
        *entry |= part << PIECE;
    }
    cells
}

impl Project {
    /// Finds the cells that are seen, and sorts them.
    pub(super) fn order(
        &mut self,
        frame: &Pass,
        seen: &Seen,
        cells: usize,
        switches: &Switches,
        lines: Lines,
    ) -> Result<Ordered> {
        if cells > 1 << PIECE {
            let what = format!("the projection engine draws {} cells at most, not {cells}", 1 << PIECE);
            return Err(Error::Render(format!("{what}; the engine \"traverse\" draws more")));
        }
        let parts = Parts::new(switches, lines);
        let ordered = |cells, entries, chunk, chunks| Ordered {
            frame: seen.frame,
            planes: seen.planes.clone(),
            by: switches.order,
            parts,
            cells,
            entries,
            chunk,
            chunks,
        };
        // Cells in parts are sorted on the host, which can make several entries of one.
        if self.sorts && parts == Parts::None && switches.order != Order::None && Sorter::fits(&self.gpu, cells) {
            if self.sorter.is_none() {
                self.sorter = Some(Sorter::new(&self.gpu, HIDDEN)?);
            }
            let keys = self.classify(frame, cells, None)?;
            let sorter = self.sorter.as_ref().ok_or_else(unprepared)?;
            let (order, entries) = sorter.sort(&self.gpu, &keys, cells)?;
            return Ok(ordered(entries, entries, usize::MAX, vec![order]));
        }
        let mut all: Vec<u32> = Vec::with_capacity(cells);
        self.classify(frame, cells, Some(&mut |keys: &[u32]| all.extend_from_slice(keys)))?;
        let mut order = depth::order(&all, switches.order != Order::None).cells;
        drop(all);
        let cells = number_parts(&mut order);
        let chunks = order.chunks(ORDER_CHUNK).map(|part| Buffer::holding(&self.gpu, "order", part, Usage::STORAGE));
        Ok(ordered(cells, order.len(), ORDER_CHUNK, chunks.collect::<Result<_>>()?))
    }

    /// The keys of all cells. If somebody wants to read them, they are shown some at a time, and only the last are
    /// returned.
    fn classify(&self, frame: &Pass, cells: usize, mut read: Option<Reader>) -> Result<Buffer> {
        let gpu = &self.gpu;
        let program = self.programs.first().ok_or_else(unprepared)?;
        let at_once = if read.is_some() { CLASSIFIED } else { cells };
        let size = 4 * cells.min(at_once) as u64;
        let keys = Buffer::new(gpu, "keys", size, Usage::STORAGE | Usage::COPY_SRC)?;
        let back = Readback::new(gpu, if read.is_some() { size } else { 4 })?;
        let slice = Buffer::new(gpu, "slice", size_of::<Slice>() as u64, Usage::UNIFORM | Usage::COPY_DST)?;
        let none = [Buffer::new(gpu, "none", 16, Usage::STORAGE)?, Buffer::new(gpu, "none", 512, Usage::STORAGE)?];
        let records = none[1].raw.as_entire_binding();
        let own = self.own_group(frame, slice.raw.as_entire_binding(), &keys, &none[0], records);
        for first in (0..cells).step_by(at_once.max(1)) {
            let count = (cells - first).min(at_once);
            let (row, groups) = groups_of(count);
            let part = Slice { first: first as u32, count: count as u32, row, rank: 0 };
            slice.write(gpu, 0, bytemuck::bytes_of(&part));
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            {
                let mut pass = encoder.begin_compute_pass(&Default::default());
                pass.set_pipeline(&program.classify);
                pass.set_bind_group(0, &frame.shared, &[]);
                pass.set_bind_group(1, &frame.arrays, &[]);
                pass.set_bind_group(2, &own, &[]);
                pass.dispatch_workgroups(groups[0], groups[1], 1);
            }
            match &mut read {
                Some(read) => {
                    encoder.copy_buffer_to_buffer(&keys.raw, 0, back.raw(), 0, 4 * count as u64);
                    back.submit(gpu, encoder, |bytes| read(bytemuck::cast_slice(&bytes[..4 * count])))?;
                }
                None => {
                    gpu.queue.submit([encoder.finish()]);
                    gpu.check()?;
                }
            }
        }
        Ok(keys)
    }
}
