//! Which cells are seen, and in which order they are drawn.

use super::frame::{Frame, Seen};
use super::keys::{self, Parts};
use super::lines::Lines;
use super::{BATCH, Pass, Project, Slice, groups_of, unprepared};
use crate::error::{Error, Result};
use crate::geometry::{Geometry, Values};
use crate::gpu::buffers::Buffer;
use crate::gpu::sort::Sorter;
use crate::order::PART;
use crate::order::depth::{self, HIDDEN};
use crate::project::{Order, Switches};
use rayon::prelude::*;
use wgpu::BufferUsages as Usage;

/// Entries of one buffer of the order, a multiple of [`BATCH`].
pub(super) const ORDER_CHUNK: usize = BATCH << 6;

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

impl Project {
    /// Finds the cells that are seen, and sorts them.
    pub(super) fn order<const N: usize>(
        &mut self,
        frame: &Pass,
        seen: &Seen,
        geometry: &Geometry,
        values: &Values<N>,
        switches: &Switches,
        lines: Lines,
    ) -> Result<Ordered> {
        let (cells, by) = (geometry.cells.len(), switches.order);
        if cells > 1 << PART {
            let what = format!("the projection engine draws {} cells at most, not {cells}", 1 << PART);
            return Err(Error::Render(format!("{what}; the engine \"traverse\" draws more")));
        }
        let parts = Parts::new(switches, lines);
        let ordered = |cells, entries, chunk, chunks| Ordered {
            frame: seen.frame,
            planes: seen.planes.clone(),
            by,
            parts,
            cells,
            entries,
            chunk,
            chunks,
        };
        // Cells in parts are sorted on the host, which can make several entries of one, and spheres in f64.
        if self.sorts && parts == Parts::None && by == Order::Depth && Sorter::fits(&self.gpu, cells) {
            if self.sorter.is_none() {
                self.sorter = Some(Sorter::new(&self.gpu, HIDDEN)?);
            }
            let keys = self.classify(frame, cells)?;
            let sorter = self.sorter.as_ref().ok_or_else(unprepared)?;
            let (order, entries) = sorter.sort(&self.gpu, &keys, cells)?;
            return Ok(ordered(entries, entries, usize::MAX, vec![order]));
        }
        let bins = &self.function.as_ref().ok_or_else(unprepared)?.ends;
        let keys = keys::keys(geometry, values, bins, seen, by, parts);
        let order = depth::order(&keys, by != Order::None).entries;
        let cells = keys.into_par_iter().filter(|&key| key != HIDDEN).count();
        let chunks = order.chunks(ORDER_CHUNK).map(|part| Buffer::holding(&self.gpu, "order", part, Usage::STORAGE));
        Ok(ordered(cells, order.len(), ORDER_CHUNK, chunks.collect::<Result<_>>()?))
    }

    /// The keys of all cells, on the device.
    fn classify(&self, frame: &Pass, cells: usize) -> Result<Buffer> {
        let gpu = &self.gpu;
        let classify = self.programs.first().and_then(|p| p.classify.as_ref()).ok_or_else(unprepared)?;
        let keys = Buffer::new(gpu, "keys", 4 * cells as u64, Usage::STORAGE)?;
        let (row, groups) = groups_of(cells);
        let slice = Slice { first: 0, count: cells as u32, row, rank: 0 };
        let slice = Buffer::holding(gpu, "slice", &[slice], Usage::UNIFORM)?;
        let none = [Buffer::new(gpu, "none", 16, Usage::STORAGE)?, Buffer::new(gpu, "none", 512, Usage::STORAGE)?];
        let records = none[1].raw.as_entire_binding();
        let own = self.own_group(frame, slice.raw.as_entire_binding(), &keys, &none[0], records);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(classify);
            pass.set_bind_group(0, &frame.shared, &[]);
            pass.set_bind_group(1, &frame.arrays, &[]);
            pass.set_bind_group(2, &own, &[]);
            pass.dispatch_workgroups(groups[0], groups[1], 1);
        }
        gpu.queue.submit([encoder.finish()]);
        gpu.check()?;
        Ok(keys)
    }
}
