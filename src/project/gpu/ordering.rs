//! Which cells are seen, and in which order they are drawn.

use super::frame::{SeenView, ViewUniforms};
use super::{Pass, Project, Slice, circumsphere, groups_of, unprepared};
use crate::error::{Error, Result};
use crate::geometry::TetMesh;
use crate::gpu::buffers::Buffer;
use crate::gpu::raster::Readback;
use crate::gpu::sort::Sorter;
use crate::order::PART;
use crate::order::depth::{self, HIDDEN};
use crate::order::mpvo::{Rule, Sequence};
use crate::project::CellOrder;
use crate::view::View;
use rayon::prelude::*;
use wgpu::BufferUsages as Usage;

/// Keys that one dispatch finds and the host reads at once, at most.
const MOST_KEYS: u64 = 1 << 24;

/// How cells are put in sequence.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Sequencing {
    pub(super) by: CellOrder,
    /// Whether cells around the eye are drawn in parts.
    pub(super) splits: bool,
    /// Whether cells are drawn that the function shows nothing of.
    pub(super) all: bool,
}

/// The order of a frame, and what it holds for.
pub(super) struct Ordered {
    frame: ViewUniforms,
    planes: Vec<[f32; 4]>,
    asked: Sequencing,
    /// Cells, and entries: one for each part of a cell; and the buffers that they are in, so many in each.
    pub(super) cells: usize,
    pub(super) entries: usize,
    pub(super) chunk: usize,
    pub(super) chunks: Vec<Buffer>,
}

impl Ordered {
    pub(super) fn holds_for(&self, seen: &SeenView, asked: Sequencing) -> bool {
        self.frame == seen.frame && self.planes == seen.planes && self.asked == asked
    }

    /// Whether it is that of the mesh.
    pub(super) fn is_of_mesh(&self) -> bool {
        self.asked.by.rule().is_some()
    }
}

/// The order of all cells of the mesh, and what it holds for.
pub(super) struct Sequenced {
    frame: ViewUniforms,
    rule: Rule,
    pub(super) cells: Sequence,
}

impl Project {
    /// Finds the order of the mesh, unless it is known.
    pub(super) fn find_sequence(&mut self, geometry: &TetMesh, view: &View, seen: &SeenView, rule: Rule) {
        if !self.sequence.as_ref().is_some_and(|s| s.frame == seen.frame && s.rule == rule) {
            let cells = self.mpvo.sequence(geometry, view, rule);
            self.sequence = Some(Sequenced { frame: seen.frame, rule, cells });
        }
    }

    /// Finds the cells that are seen, and sorts them.
    pub(super) fn order(
        &mut self,
        frame: &Pass,
        seen: &SeenView,
        geometry: &TetMesh,
        asked: Sequencing,
    ) -> Result<Ordered> {
        let (cells, Sequencing { by, splits, .. }) = (geometry.cells.len(), asked);
        if cells > 1 << PART {
            let what = format!("the projection engine draws {} cells at most, not {cells}", 1 << PART);
            return Err(Error::Render(format!("{what}; the engine \"traverse\" draws more")));
        }
        let ordered = |cells, entries, chunk, chunks| Ordered {
            frame: seen.frame,
            planes: seen.planes.clone(),
            asked,
            cells,
            entries,
            chunk,
            chunks,
        };
        // Cells in parts are sorted on the host, which can make several entries of one, and spheres in f64.
        if self.sorts && !splits && by == CellOrder::Depth && Sorter::fits(&self.gpu, cells) {
            if self.sorter.is_none() {
                self.sorter = Some(Sorter::new(&self.gpu, HIDDEN)?);
            }
            let keys = self.classify(frame, 0, cells)?;
            let sorter = self.sorter.as_ref().ok_or_else(unprepared)?;
            let (order, entries) = sorter.sort(&self.gpu, &keys, cells)?;
            return Ok(ordered(entries, entries, usize::MAX, vec![order]));
        }
        let mut keys = self.keys(frame, cells)?;
        if by == CellOrder::Circumsphere {
            keys = circumsphere::ranked(geometry, seen, &keys);
        }
        let order = match self.sequence.as_ref().filter(|_| by.rule().is_some()) {
            Some(sequence) => sequence.cells.order(&keys),
            None => depth::order(&keys, by != CellOrder::None),
        };
        let order = order.entries;
        let cells = keys.into_par_iter().filter(|&key| key != HIDDEN).count();
        let chunks =
            order.chunks(self.order_chunk).map(|part| Buffer::holding(&self.gpu, "order", part, Usage::STORAGE));
        Ok(ordered(cells, order.len(), self.order_chunk, chunks.collect::<Result<_>>()?))
    }

    /// The keys of all cells, on the host.
    fn keys(&self, frame: &Pass, cells: usize) -> Result<Vec<u32>> {
        let gpu = &self.gpu;
        let most = (gpu.binding / 4).min(MOST_KEYS) as usize;
        let mut all = Vec::with_capacity(cells);
        for first in (0..cells).step_by(most) {
            let count = (cells - first).min(most);
            let keys = self.classify(frame, first, count)?;
            let bytes = 4 * count as u64;
            let back = Readback::new(gpu, bytes)?;
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            encoder.copy_buffer_to_buffer(&keys.raw, 0, back.raw(), 0, bytes);
            back.submit(gpu, encoder, |read| all.extend_from_slice(bytemuck::cast_slice(&read[..bytes as usize])))?;
        }
        Ok(all)
    }

    /// The keys of `count` cells from `first` on, on the device.
    fn classify(&self, frame: &Pass, first: usize, count: usize) -> Result<Buffer> {
        let gpu = &self.gpu;
        let classify = &self.programs.first().ok_or_else(unprepared)?.classify;
        let keys = Buffer::new(gpu, "keys", 4 * count as u64, Usage::STORAGE | Usage::COPY_SRC)?;
        let (row, groups) = groups_of(count);
        let slice = Slice { first: first as u32, count: count as u32, row, rank: 0 };
        let slice = Buffer::holding(gpu, "slice", &[slice], Usage::UNIFORM)?;
        let none = [Buffer::new(gpu, "none", 16, Usage::STORAGE)?, Buffer::new(gpu, "none", 512, Usage::STORAGE)?];
        let primitives = none[1].raw.as_entire_binding();
        let own = self.own_group(frame, slice.raw.as_entire_binding(), &keys, &none[0], primitives);
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
