//! Visibility order: in which sequence cells are drawn, from back to front.

pub mod depth;

/// The cells of a frame from back to front, and where the sequence comes from.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct VisibilityOrder {
    /// Indices of the cells to draw. A cell that is drawn in several parts is there as often, one after another.
    pub cells: Vec<u32>,
    /// What decided.
    pub provenance: Provenance,
}

/// What an order comes from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Provenance {
    /// Cells as they are stored: right by chance only.
    #[default]
    None,
    /// The distance of the cells' centres from the eye: right where cells are alike and meet face to face.
    Depth,
}
