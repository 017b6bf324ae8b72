//! The whole flow behind one door: mesh, field, transfer function and view in, image out.

use crate::error::{Error, Result};
use crate::field::Field;
use crate::image::Image;
use crate::mesh::Mesh;
use crate::mesh::cells::Tetrahedra;
use crate::transfer::TransferFunction;
use crate::view::View;

/// Draws one mesh, as often as wanted; keeps what did not change between frames.
#[derive(Debug, Default)]
pub struct Renderer {}

/// What a renderer did and how long it took.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct Stats {
    /// Name of the engine: "traverse".
    pub engine: String,
    /// "cpu" or "gpu".
    pub device: String,
    /// The processor or adapter.
    pub adapter: String,
    /// Cells that were drawn.
    pub cells: u64,
    /// Tetrahedra that they were split into.
    pub tetrahedra: u64,
    /// Splitting, matching faces and building the boundary hierarchy, in ms.
    pub faces_ms: f64,
    /// Handing mesh, field and transfer function to the device, in ms.
    pub upload_ms: f64,
    /// The last frame, in ms.
    pub frame_ms: f64,
    /// Tetrahedra visited in the last frame, over all rays.
    pub steps: u64,
    /// Rays of the last frame that had to be traced again beside an edge.
    pub repaired_rays: u64,
    /// Memory held on the device for mesh, field and transfer function, in bytes.
    pub device_bytes: u64,
}

impl Renderer {
    /// A renderer on `threads` threads of its own (0: one for each core).
    ///
    /// # Errors
    /// [`Error::Render`] if the threads cannot be started.
    pub fn new(threads: usize) -> Result<Self> {
        let _ = threads;
        Ok(Renderer {})
    }

    /// Draws another mesh from now on; the field must be set again.
    ///
    /// # Errors
    /// [`Error::Mesh`] if it has no 3D cell.
    pub fn set_mesh(&mut self, mesh: &Mesh, tetrahedra: Tetrahedra) -> Result<()> {
        let _ = (mesh, tetrahedra);
        Ok(())
    }

    /// Draws another field of the mesh from now on.
    ///
    /// # Errors
    /// [`Error::Render`] if there is no mesh; [`Error::Field`] if the field does not fit it.
    pub fn set_field(&mut self, field: &Field) -> Result<()> {
        let _ = field;
        Ok(())
    }

    /// Draws with another transfer function from now on.
    ///
    /// # Errors
    /// [`Error::Transfer`] if it cannot be drawn.
    pub fn set_transfer(&mut self, transfer: &TransferFunction) -> Result<()> {
        let _ = transfer;
        Ok(())
    }

    /// Draws a frame. `progress` is told the share that is done, in [0, 1], and may be called from several threads.
    ///
    /// # Errors
    /// [`Error::Render`] if mesh, field or transfer function were never set.
    pub fn render(&mut self, view: &View, progress: &(dyn Fn(f64) + Sync)) -> Result<Image> {
        let _ = (view, progress);
        Err(Error::Render("no engine yet".into()))
    }

    /// What the last calls did.
    pub fn stats(&self) -> &Stats {
        static NONE: std::sync::LazyLock<Stats> = std::sync::LazyLock::new(Stats::default);
        &NONE
    }
}
