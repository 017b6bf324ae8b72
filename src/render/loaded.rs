//! The mesh that is drawn, laid out as a backend reads it.

use super::backend::Needs;
use crate::geometry::TetMesh;
use crate::mesh::cells::Tetrahedra;
use crate::mesh::faces::Faces;
use glam::DVec3;

/// The mesh that is drawn.
#[derive(Debug)]
pub(super) struct Loaded {
    pub(super) tetrahedra: Tetrahedra,
    pub(super) geometry: TetMesh,
    pub(super) points: usize,
    pub(super) cells: usize,
    /// Whether cells know their neighbours.
    pub(super) connected: bool,
    /// Whether the backend leaves it to the walk on the CPU, as it is too flat or thin.
    pub(super) left_to_walk: bool,
    /// The longest edge of a cell, in normalised units, once somebody asked.
    pub(super) longest: Option<f64>,
}

impl Loaded {
    /// `tetrahedra` of `points`, of a mesh of so many cells, for a backend with these `needs`.
    pub(super) fn new(
        points: &[DVec3],
        cells: usize,
        tetrahedra: Tetrahedra,
        needs: Needs,
        report: &(dyn Fn(f64) + Sync),
    ) -> Self {
        let count = points.len();
        let points = tetrahedra.points(points);
        let mut geometry = TetMesh::default();
        if !needs.neighbours {
            geometry = TetMesh::unconnected(&points, &tetrahedra);
        }
        // The walk needs neighbours.
        let connected = needs.neighbours || !needs.are_met_by(&geometry);
        if connected {
            // Laying the mesh out takes about as long as matching its faces.
            let faces = Faces::with_progress(&points, &tetrahedra.corners, &|share| report(share / 2.0));
            geometry = TetMesh::new(&points, &tetrahedra, &faces);
        }
        drop(points);
        let left_to_walk = !needs.are_met_by(&geometry);
        Loaded { tetrahedra, geometry, points: count, cells, connected, left_to_walk, longest: None }
    }

    /// Points have moved.
    pub(super) fn judge_again(&mut self, needs: Needs) {
        (self.left_to_walk, self.longest) = (!needs.are_met_by(&self.geometry), None);
    }
}
