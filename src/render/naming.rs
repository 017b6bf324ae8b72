//! Who draws, as [`Stats`](super::Stats) and the log have it.

use super::Renderer;
use super::backend::Backend;
use crate::engine::Engine;

impl Renderer {
    /// Names the engine and the device that draw, and says what another draws than was asked for.
    pub(super) fn name_device(&mut self) {
        // Whether tables are built on the device depends on it.
        self.key = None;
        if self.grid.is_some() {
            return self.name_caster();
        }
        let left = self.mesh.as_ref().is_some_and(|m| m.left_to_walk);
        let second = self.transfer.as_ref().filter(|t| !t.is_of_one_variable() && !left);
        let lacking = second.and_then(|t| self.backend.lacks_second(t, &self.integral.two, &self.projection));
        let by_cpu = left || lacking.is_some();
        self.stats.engine = match by_cpu {
            true if !left && self.backend.projects_second(self.engine) => "project",
            true => Backend::Walk.engine(),
            false => self.backend.engine(),
        }
        .into();
        if left && self.backend.gpu().is_some() && self.stats.device != "cpu" {
            tracing::warn!(
                "the mesh is too flat or thin for the 32-bit floats of the device; the CPU draws it, by the walk"
            );
        }
        // Nobody who left the choice to Halite on a CPU asked for another engine.
        let chosen = self.engine != Engine::Auto || self.backend.gpu().is_some();
        let lacking = lacking.filter(|_| chosen);
        if let Some(what) = lacking.as_ref().filter(|_| lacking != self.lacking) {
            tracing::warn!("{what}; the CPU draws this");
        }
        self.lacking = lacking;
        (self.stats.device, self.stats.adapter) = match self.backend.gpu().filter(|_| !by_cpu) {
            Some(gpu) => ("gpu".into(), gpu.adapter.name.clone()),
            None => ("cpu".into(), format!("{} threads", self.pool.current_num_threads())),
        };
    }
}
