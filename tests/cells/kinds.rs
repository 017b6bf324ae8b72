//! Where each type of cell has its nodes, and what a straight one is.

use glam::DVec3;

/// The nodes of one cell in [0, 1]³, from VTK's documentation of each type: corners, then what is between which of
/// them.
pub(crate) struct Kind {
    pub(crate) vtk_type: u8,
    pub(crate) corners: &'static [[f64; 3]],
    /// Groups of nodes, each a mean of corners.
    pub(crate) between: &'static [&'static [&'static [usize]]],
    pub(crate) volume: f64,
    pub(crate) surface: f64,
    pub(crate) tetrahedra: usize,
}

pub(crate) const CUBE: [[f64; 3]; 8] =
    [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.], [0., 0., 1.], [1., 0., 1.], [1., 1., 1.], [0., 1., 1.]];
const PRISM: [[f64; 3]; 6] = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.], [1., 0., 1.], [0., 1., 1.]];
const TENT: [[f64; 3]; 5] = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.], [0., 0., 1.]];
pub(crate) const SIMPLEX: [[f64; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]];
const CUBE_NODES: [&[usize]; 19] = [
    &[0, 1],
    &[1, 2],
    &[2, 3],
    &[3, 0],
    &[4, 5],
    &[5, 6],
    &[6, 7],
    &[7, 4],
    &[0, 4],
    &[1, 5],
    &[2, 6],
    &[3, 7],
    &[0, 3, 4, 7],
    &[1, 2, 5, 6],
    &[0, 1, 4, 5],
    &[2, 3, 6, 7],
    &[0, 1, 2, 3],
    &[4, 5, 6, 7],
    &[0, 1, 2, 3, 4, 5, 6, 7],
];
const PRISM_EDGES: &[&[usize]] = &[&[0, 1], &[1, 2], &[2, 0], &[3, 4], &[4, 5], &[5, 3], &[0, 3], &[1, 4], &[2, 5]];
const PRISM_SIDES: &[&[usize]] = &[&[0, 1, 3, 4], &[1, 2, 4, 5], &[2, 0, 5, 3]];
const TENT_NODES: [&[usize]; 14] = [
    &[0, 1],
    &[1, 2],
    &[2, 3],
    &[3, 0],
    &[0, 4],
    &[1, 4],
    &[2, 4],
    &[3, 4],
    &[0, 1, 2, 3],
    &[0, 1, 4],
    &[1, 2, 4],
    &[2, 3, 4],
    &[3, 0, 4],
    &[0, 1, 2, 3, 4],
];
const SIMPLEX_NODES: [&[usize]; 11] = [
    &[0, 1],
    &[1, 2],
    &[2, 0],
    &[0, 3],
    &[1, 3],
    &[2, 3],
    &[0, 1, 2],
    &[0, 1, 3],
    &[1, 2, 3],
    &[0, 2, 3],
    &[0, 1, 2, 3],
];
const PRISM_SURFACE: f64 = 3.0 + std::f64::consts::SQRT_2;
const TENT_SURFACE: f64 = 2.0 + std::f64::consts::SQRT_2;
/// 3/2 + √3/2.
const SIMPLEX_SURFACE: f64 = 2.366_025_403_784_438_4;

pub(crate) const KINDS: [Kind; 14] = [
    Kind {
        vtk_type: 24,
        corners: &SIMPLEX,
        between: &[SIMPLEX_NODES.split_at(6).0],
        volume: 1.0 / 6.0,
        surface: SIMPLEX_SURFACE,
        tetrahedra: 8,
    },
    Kind {
        vtk_type: 71,
        corners: &SIMPLEX,
        between: &[&SIMPLEX_NODES],
        volume: 1.0 / 6.0,
        surface: SIMPLEX_SURFACE,
        tetrahedra: 24,
    },
    Kind {
        vtk_type: 25,
        corners: &CUBE,
        between: &[CUBE_NODES.split_at(12).0],
        volume: 1.0,
        surface: 6.0,
        tetrahedra: 48,
    },
    Kind {
        vtk_type: 33,
        corners: &CUBE,
        between: &[CUBE_NODES.split_at(16).0],
        volume: 1.0,
        surface: 6.0,
        tetrahedra: 48,
    },
    Kind { vtk_type: 29, corners: &CUBE, between: &[&CUBE_NODES], volume: 1.0, surface: 6.0, tetrahedra: 48 },
    Kind { vtk_type: 72, corners: &CUBE, between: &[&CUBE_NODES], volume: 1.0, surface: 6.0, tetrahedra: 48 },
    Kind { vtk_type: 79, corners: &CUBE, between: &[&CUBE_NODES], volume: 1.0, surface: 6.0, tetrahedra: 48 },
    Kind {
        vtk_type: 31,
        corners: &PRISM,
        between: &[PRISM_EDGES.split_at(6).0],
        volume: 0.5,
        surface: PRISM_SURFACE,
        tetrahedra: 12,
    },
    Kind {
        vtk_type: 26,
        corners: &PRISM,
        between: &[PRISM_EDGES],
        volume: 0.5,
        surface: PRISM_SURFACE,
        tetrahedra: 24,
    },
    Kind {
        vtk_type: 32,
        corners: &PRISM,
        between: &[PRISM_EDGES, PRISM_SIDES],
        volume: 0.5,
        surface: PRISM_SURFACE,
        tetrahedra: 24,
    },
    Kind {
        vtk_type: 73,
        corners: &PRISM,
        between: &[PRISM_EDGES, &[&[0, 1, 2], &[3, 4, 5]], PRISM_SIDES, &[&[0, 1, 2, 3, 4, 5]]],
        volume: 0.5,
        surface: PRISM_SURFACE,
        tetrahedra: 36,
    },
    Kind {
        vtk_type: 80,
        corners: &PRISM,
        between: &[PRISM_EDGES, PRISM_SIDES],
        volume: 0.5,
        surface: PRISM_SURFACE,
        tetrahedra: 24,
    },
    Kind {
        vtk_type: 27,
        corners: &TENT,
        between: &[TENT_NODES.split_at(8).0],
        volume: 1.0 / 3.0,
        surface: TENT_SURFACE,
        tetrahedra: 16,
    },
    Kind {
        vtk_type: 37,
        corners: &TENT,
        between: &[&TENT_NODES],
        volume: 1.0 / 3.0,
        surface: TENT_SURFACE,
        tetrahedra: 32,
    },
];

impl Kind {
    /// The cell with straight edges, moved by `to`, which must be affine.
    pub(crate) fn points(&self, to: impl Fn(DVec3) -> DVec3) -> Vec<DVec3> {
        let mut points: Vec<DVec3> = self.corners.iter().map(|c| DVec3::from(*c)).collect();
        for between in self.between.iter().copied().flatten() {
            points.push(between.iter().map(|c| DVec3::from(self.corners[*c])).sum::<DVec3>() / between.len() as f64);
        }
        points.into_iter().map(to).collect()
    }
}
