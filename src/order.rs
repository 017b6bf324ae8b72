//! Visibility order: in which sequence cells are drawn, from back to front.
//!
//! [`depth`] sorts cells by a key; [`mpvo`] finds the order of a mesh whose cells know their neighbours, of which `published`
//! has the forms of the literature; [`check`] counts where an order is wrong.

pub mod check;
mod convex;
pub(crate) mod crossings;
mod cycles;
pub mod depth;
mod facing;
mod gaps;
mod graph;
pub mod mpvo;
mod published;
pub(crate) mod screen;

/// The bit of an entry from which on it says how many parts of the cell came before; those below it are the cell.
pub const PART: u32 = 30;

/// Parts that a cell is drawn in at most.
pub const MOST_PARTS: u32 = 1 << (u32::BITS - PART);

/// The cells of a frame from back to front, and where the sequence comes from.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct VisibilityOrder {
    /// Indices of the cells to draw, below 2³⁰. A cell that is drawn in several parts is there as often, one after another,
    /// with the number of the part from bit [`PART`] on.
    pub entries: Vec<u32>,
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
    /// Which cell is before which, by the faces between them, and by the rays that leave the mesh and enter it again.
    Mesh,
}
