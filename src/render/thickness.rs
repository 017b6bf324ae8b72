//! Meshes that the backend leaves to the walk on the CPU, for the lengths across their cells.

use super::{Engine, Renderer};
use crate::error::Result;
use crate::project::Switches;

impl Renderer {
    /// Leaves the mesh to the walk, or no longer, as cells are too flat for the transfer function and the backend. Variants
    /// of the projection are what somebody wants to see.
    pub(super) fn judge_thickness(&mut self) -> Result<()> {
        let is_variant = self.engine != Engine::Auto && self.switches != Switches::default();
        let (needs, Some(mesh), Some(transfer)) = (self.backend.needs(), &mut self.mesh, &self.transfer) else {
            return Ok(());
        };
        if is_variant || !self.pool.install(|| mesh.judge(needs, transfer)) {
            return Ok(());
        }
        if mesh.left_to_walk && !mesh.connected {
            self.connect_in_place()?;
        }
        self.name_device();
        Ok(())
    }
}
