//! Meshes whose cells get to know their neighbours only when a frame needs that.

use super::Renderer;
use crate::error::Result;
use crate::gpu::Part;

/// Meshes in a row that were drawn once each, from which on the next is taken for one that changes with each frame.
const BRIEF: u32 = 2;

/// How long meshes stay.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Stay {
    /// Frames of the mesh.
    frames: u32,
    /// Meshes in a row that were drawn once.
    brief: u32,
    /// That cells are drawn by depth has been said.
    told: bool,
}

impl Stay {
    /// A mesh takes the place of the last one.
    pub(super) fn change(&mut self) {
        self.brief = if self.frames == 1 { self.brief + 1 } else { 0 };
        self.told &= self.brief >= BRIEF;
        self.frames = 0;
    }

    /// A frame was drawn.
    pub(super) fn draw(&mut self) {
        self.frames = self.frames.saturating_add(1);
    }

    /// Whether the mesh will not be worth to be looked at closely.
    fn is_short(&self) -> bool {
        self.brief >= BRIEF && self.frames == 0
    }
}

impl Renderer {
    /// Whether cells must know their neighbours for their order. Those of meshes that change with each frame need not.
    pub(super) fn orders_by_neighbours(&self) -> bool {
        self.backend.needs().order && self.projection.order.rule().is_some() && !self.stay.is_short()
    }

    /// Finds the neighbours of cells if the next frame's order needs them, or says that it does without.
    pub(super) fn connect_for_order(&mut self) -> Result<()> {
        if self.mesh.as_ref().is_none_or(|m| m.connected) || self.engine_needs_no_order() {
            return Ok(());
        }
        if self.orders_by_neighbours() {
            return self.connect_in_place();
        }
        if !std::mem::replace(&mut self.stay.told, true) {
            tracing::warn!("the mesh changes with each frame; its cells are drawn in the order of their depths");
        }
        Ok(())
    }

    fn engine_needs_no_order(&self) -> bool {
        !self.backend.needs().order || self.projection.order.rule().is_none()
    }

    /// Finds the neighbours of the cells of a mesh that was laid out without.
    pub(super) fn connect_in_place(&mut self) -> Result<()> {
        let Some(mesh) = &mut self.mesh else { return Ok(()) };
        self.pool.install(|| mesh.geometry.connect());
        mesh.connected = true;
        self.extra.invalidate_field();
        if let Some(field) = &mut self.field {
            self.pool.install(|| field.bring_to(mesh))?;
        }
        self.backend.invalidate(Part::Mesh);
        Ok(())
    }
}
