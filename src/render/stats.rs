//! What a renderer tells of its work.

use crate::project::CellOrder;

/// What a renderer did and how long it took.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct Stats {
    /// Name of the engine: "traverse", "project", or "grid" for regular and rectilinear grids.
    pub engine: String,
    /// "cpu" or "gpu".
    pub device: String,
    /// The processor or adapter.
    pub adapter: String,
    /// Cells of the mesh, of all types.
    pub cells: u64,
    /// Tetrahedra that the 3D cells were split into.
    pub tetrahedra: u64,
    /// Matching faces, ordering cells and building the boundary hierarchy, in ms.
    pub faces_ms: f64,
    /// Handing field and transfer function to the device, in ms.
    pub upload_ms: f64,
    /// The last frame, in ms.
    pub frame_ms: f64,
    /// The form of the ray integral that it was drawn with.
    pub integral: String,
    /// Building its table, in ms (on a device: 0 unless the frame waited for that), and what that takes, in bytes; 0
    /// without one.
    pub table_ms: f64,
    /// See [`Self::table_ms`].
    pub table_bytes: u64,
    /// Knots of the function that the values of the mean cell have between them; 0 unless the form is chosen by that.
    pub knots_per_cell: f64,
    /// Tetrahedra, or voxels of a grid, visited in the last frame, over all rays.
    pub steps: u64,
    /// Rays of the last frame that had to be traced again beside an edge.
    pub retraced_rays: u64,
    /// Rays of the last frame that the device left to the CPU, as they take more work than its driver allows.
    pub cpu_rays: u64,
    /// Panels that segments of two variables, or with light, were summed up in, over all rays of the last frame.
    pub panels: u64,
    /// Cells of which nothing can be seen with a function of two variables, which the last frame left out.
    pub culled_cells: u64,
    /// Finding them, in ms, after the last edit.
    pub culling_ms: f64,
    /// Memory held on the device for mesh and field, in bytes.
    pub device_bytes: u64,
    /// What had to be handed to the device for the last frame, in bytes; 0 on the CPU.
    pub uploaded_bytes: u64,
    /// The last frame by the device's own clock, in ms, where it has one.
    pub device_ms: Option<f64>,
    /// What the projection engine did.
    pub projection: Option<ProjectionStats>,
    /// What the projection on the CPU did.
    pub sweep: Option<SweepStats>,
}

/// What the projection engine did in the last frame.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize)]
pub struct ProjectionStats {
    /// Cells that were drawn, each once, also where it is drawn in parts.
    pub drawn_cells: u64,
    /// What decided the sequence of cells.
    pub order: CellOrder,
    /// Finding the cells that are seen and sorting them, in ms; 0 if the camera stood still.
    pub order_ms: f64,
    /// How often cells were sorted: once, or not at all where the order of the frame before holds.
    pub sorts: u32,
    /// Groups of cells that hide each other in a circle, as seen from here.
    pub cycles: u32,
    /// The cells of these.
    pub cycle_cells: u64,
    /// Pairs of cells whose sequence is wrong, as circles had to be cut.
    pub cuts: u64,
    /// Pixels that the walk drew, as they see such a pair.
    pub walked_pixels: u64,
    /// Pixels whose rays are in several cells at a time: such cells have no order. None are looked for in a convex mesh.
    pub overlapping_pixels: u64,
    /// Projecting them, by the device's own clock, in ms, where it has one.
    pub project_ms: Option<f64>,
    /// Drawing them, likewise.
    pub draw_ms: Option<f64>,
    /// Fragments that were computed, where the device counts them.
    pub fragments: Option<u64>,
}

/// What the projection on the CPU did in the last frame.
#[derive(Debug, Clone, Default, PartialEq, Eq, serde::Serialize)]
pub struct SweepStats {
    /// Cells of the tiles that the image is drawn in, each as often as it is in a tile.
    pub dealt_cells: u64,
    /// Segments of rays in cells.
    pub fragments: u64,
    /// Pixels that the walk drew again, as a cell began there before the last one ended.
    pub redrawn_overlaps: u64,
    /// Likewise, as a part of the mesh was missing.
    pub redrawn_gaps: u64,
    /// Likewise, as the ray enters the mesh not as often as it leaves, or is outside where a cell was drawn.
    pub redrawn_boundary: u64,
    /// Likewise, as light comes through cells so dense that lengths in f32 are too coarse, or as the largest value is of a
    /// cell with such a large one that values in f32 are.
    pub redrawn_dense: u64,
    /// Why the walk drew all of the frame, if it did.
    pub handed_over: Option<String>,
}
