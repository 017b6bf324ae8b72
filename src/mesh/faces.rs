//! The faces of a tetrahedral mesh: neighbours by exact point position, the boundary, connected components.

use glam::DVec3;

/// Stands for "no neighbour" in [`Faces::neighbours`].
pub const BOUNDARY: u32 = u32::MAX;

/// How the tetrahedra of a mesh hang together.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Faces {
    /// For each point, the smallest index of a point at exactly the same position (its own, if there is no other).
    pub weld: Option<Vec<u32>>,
    /// `neighbours[t][k]`: the tetrahedron beyond the face of `t` opposite to corner `k`, or [`BOUNDARY`].
    pub neighbours: Vec<[u32; 4]>,
    /// The boundary faces `(tetrahedron, opposite corner)`, ascending.
    pub boundary: Vec<(u32, u8)>,
}

impl Faces {
    /// Matches the faces of `corners`.
    pub fn new(points: &[DVec3], corners: &[[u32; 4]]) -> Self {
        let _ = (points, corners);
        Self::default()
    }
}
