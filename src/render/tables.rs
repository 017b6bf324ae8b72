//! Tables, built while frames are drawn.
//!
//! A frame that cannot wait is drawn with the exact integral until its table is there: it is never of another function
//! than it should be. Tables that the device builds are there as soon as they were asked for, as it does one thing
//! after another; that is asked for after the frame that did not wait.

use super::Renderer;
use crate::error::{Error, Result};
use crate::geometry::{TetMesh, Values};
use crate::integral::{Exact, IntegrationOptions, PreintegratedTable};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::Instant;

/// Cells that are looked at, to tell how many knots the mean one spans.
const SAMPLES: usize = 1 << 16;

/// All that a table depends on.
#[derive(Debug, PartialEq)]
pub(super) struct TableKey {
    pub(super) exact: Exact<f64>,
    pub(super) choice: IntegrationOptions,
    pub(super) longest: f64,
    /// The device that draws builds it.
    pub(super) on_device: bool,
}

/// A table, and the ms that building it took.
#[derive(Debug, Clone)]
pub(super) struct Built {
    pub(super) table: Arc<PreintegratedTable>,
    pub(super) ms: f64,
}

/// The table of the frames now, and the one that is being built.
#[derive(Debug, Default)]
pub(super) struct Tables {
    ready: Option<(Arc<TableKey>, Built)>,
    building: Option<(Arc<TableKey>, Receiver<Result<Built>>)>,
    /// The last one, whose memory the next takes.
    spare: Option<Arc<PreintegratedTable>>,
    /// Not the renderer's: frames would wait behind the table's work.
    pool: Option<rayon::ThreadPool>,
}

impl TableKey {
    fn build(&self, spare: Option<Arc<PreintegratedTable>>) -> Result<Built> {
        let start = Instant::now();
        let TableKey { exact, choice, longest, .. } = self;
        let table = match spare.and_then(Arc::into_inner) {
            _ if self.on_device => PreintegratedTable::outline(exact, choice, *longest),
            Some(old) => PreintegratedTable::renewed(old, exact, choice, *longest),
            None => PreintegratedTable::new(exact, choice, *longest),
        }?;
        Ok(Built { table: Arc::new(table), ms: start.elapsed().as_secs_f64() * 1e3 })
    }
}

impl Tables {
    /// The table of `key`; none if it is not there yet, and the caller does not `wait` for it. `own` is the pool of a
    /// caller that waits.
    ///
    /// # Errors
    /// Those of [`PreintegratedTable::new`].
    pub(super) fn get(&mut self, key: &Arc<TableKey>, wait: bool, own: &rayon::ThreadPool) -> Result<Option<Built>> {
        self.collect(key, wait)?;
        if let Some((ready, built)) = &self.ready
            && ready == key
        {
            return Ok(Some(built.clone()));
        }
        if let Some((_, old)) = self.ready.take() {
            self.spare = Some(old.table);
        }
        if wait {
            let spare = self.spare.take();
            let built = own.install(|| key.build(spare))?;
            self.ready = Some((Arc::clone(key), built.clone()));
            return Ok(Some(built));
        }
        Ok(None)
    }

    /// Begins to build the table of `key`, unless it is there; after the frame that it was too late for, so that it
    /// does not take that frame's time. `own` is the caller's pool.
    ///
    /// # Errors
    /// [`Error::Render`] if no thread can be started.
    pub(super) fn start(&mut self, key: &Arc<TableKey>, own: &rayon::ThreadPool) -> Result<()> {
        // One at a time: what is asked for last comes next.
        if self.building.is_some() || self.ready.as_ref().is_some_and(|r| r.0 == *key) {
            return Ok(());
        }
        if key.on_device {
            self.ready = Some((Arc::clone(key), key.build(self.spare.take())?));
            return Ok(());
        }
        let (sender, receiver) = channel();
        let (own_key, spare) = (Arc::clone(key), self.spare.take());
        self.pool(own)?.spawn(move || {
            // A renderer that is gone wants no table.
            let _ = sender.send(own_key.build(spare));
        });
        self.building = Some((Arc::clone(key), receiver));
        Ok(())
    }

    /// The table of `key`, if it is there.
    pub(super) fn ready(&self, key: &Arc<TableKey>) -> Option<&Built> {
        self.ready.as_ref().filter(|r| r.0 == *key).map(|r| &r.1)
    }

    /// Notes what building the table of `key` took.
    pub(super) fn took(&mut self, key: &Arc<TableKey>, ms: f64) {
        if let Some((_, built)) = self.ready.as_mut().filter(|r| r.0 == *key) {
            built.ms += ms;
        }
    }

    /// Takes what has been built, waiting for it if it is `key`'s.
    fn collect(&mut self, key: &Arc<TableKey>, wait: bool) -> Result<()> {
        let Some((building, receiver)) = self.building.take() else { return Ok(()) };
        let same = building == *key;
        let got =
            if wait && same { receiver.recv().map_err(|_| TryRecvError::Disconnected) } else { receiver.try_recv() };
        match got {
            Ok(built) if same => self.ready = Some((building, built?)),
            // Of a function that is no more; or its builder is gone, and another is asked.
            Ok(_) | Err(TryRecvError::Disconnected) => {}
            Err(TryRecvError::Empty) => self.building = Some((building, receiver)),
        }
        Ok(())
    }

    fn pool(&mut self, own: &rayon::ThreadPool) -> Result<&rayon::ThreadPool> {
        let pool = match self.pool.take() {
            Some(pool) => pool,
            // Half of the threads, so that frames have the others.
            None => rayon::ThreadPoolBuilder::new()
                .num_threads((own.current_num_threads() / 2).max(1))
                .thread_name(|i| format!("halite-tables-{i}"))
                .build()
                .map_err(|e| Error::Render(format!("cannot start threads for tables: {e}")))?,
        };
        Ok(self.pool.insert(pool))
    }
}

impl Renderer {
    /// Has the table built that a frame was drawn without.
    pub(super) fn build_next(&mut self, late: Option<Arc<TableKey>>) -> Result<()> {
        let Some(key) = late else { return Ok(()) };
        self.tables.start(&key, &self.pool)?;
        if let (true, Some(built), Some(exact)) = (key.on_device, self.tables.ready(&key), &self.exact) {
            // What fails now fails again in the next frame, which says so.
            let _ = self.backend.ensure_resident(exact, &built.table, false);
        }
        Ok(())
    }
}

/// How many knots of the function the values of the mean cell have between them, those of opacity where that has a component of its
/// own; of a sample, where there are many cells.
pub(super) fn knots_in_cells<const N: usize>(geometry: &TetMesh, values: &Values<N>, exact: &Exact<f32>) -> f64 {
    let knots = exact.opacity.places();
    let step = geometry.cells.len().div_ceil(SAMPLES).max(1);
    let (mut sum, mut count) = (0u64, 0u64);
    for (i, cell) in geometry.cells.iter().enumerate().step_by(step) {
        let corners = match values {
            Values::Point(v) => cell.corners.map(|p| v[p as usize][N - 1]),
            Values::Corner(v) => v[i].map(|s| s[N - 1]),
            Values::Cell(v) => [v[i][N - 1]; 4],
        };
        let [low, high] = [corners.into_iter().fold(f32::MAX, f32::min), corners.into_iter().fold(f32::MIN, f32::max)];
        if low <= high {
            let between = knots.partition_point(|&s| s < high).saturating_sub(knots.partition_point(|&s| s <= low));
            sum += between as u64;
        }
        count += 1;
    }
    sum as f64 / count.max(1) as f64
}

#[cfg(test)]
mod tests;
