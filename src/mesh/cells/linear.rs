//! Linear cells: their faces, and the split of one.

use glam::DVec3;
use std::cmp::Ordering;

/// How a cell type is split: its faces, as local points, seen counter-clockwise from outside a cell that is numbered as
/// VTK documents it (`vtkTetra.h` and so on; the wedge's triangle 0 1 2 looks outward).
#[derive(Debug)]
pub(super) struct Shape {
    pub(super) points: usize,
    /// Tetrahedra that the cell gives, whichever of its points is smallest.
    pub(super) tetrahedra: usize,
    faces: &'static [&'static [u8]],
}

pub(super) static TETRA: Shape =
    Shape { points: 4, tetrahedra: 1, faces: &[&[0, 1, 3], &[1, 2, 3], &[2, 0, 3], &[0, 2, 1]] };
static VOXEL: Shape = Shape {
    points: 8,
    tetrahedra: 6,
    faces: &[&[0, 4, 6, 2], &[1, 3, 7, 5], &[0, 1, 5, 4], &[2, 6, 7, 3], &[0, 2, 3, 1], &[4, 5, 7, 6]],
};
pub(super) static HEXAHEDRON: Shape = Shape {
    points: 8,
    tetrahedra: 6,
    faces: &[&[0, 4, 7, 3], &[1, 2, 6, 5], &[0, 1, 5, 4], &[3, 7, 6, 2], &[0, 3, 2, 1], &[4, 5, 6, 7]],
};
pub(super) static WEDGE: Shape =
    Shape { points: 6, tetrahedra: 3, faces: &[&[0, 1, 2], &[3, 5, 4], &[0, 3, 4, 1], &[1, 4, 5, 2], &[2, 5, 3, 0]] };
pub(super) static PYRAMID: Shape =
    Shape { points: 5, tetrahedra: 2, faces: &[&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]] };

/// Between the small tetrahedra of a lattice: corners 0 and 5, 1 and 4, 2 and 3 are opposite.
pub(super) static OCTAHEDRON: Shape = Shape {
    points: 6,
    tetrahedra: 4,
    faces: &[&[0, 1, 2], &[0, 2, 4], &[0, 4, 3], &[0, 3, 1], &[5, 2, 1], &[5, 4, 2], &[5, 3, 4], &[5, 1, 3]],
};

/// The faces of prisms over a pentagon and a hexagon (`vtkPentagonalPrism.h`, `vtkHexagonalPrism.h`).
pub(super) static PRISM_5: [&[u8]; 7] =
    [&[0, 4, 3, 2, 1], &[5, 6, 7, 8, 9], &[0, 1, 6, 5], &[1, 2, 7, 6], &[2, 3, 8, 7], &[3, 4, 9, 8], &[4, 0, 5, 9]];
pub(super) static PRISM_6: [&[u8]; 8] = [
    &[0, 5, 4, 3, 2, 1],
    &[6, 7, 8, 9, 10, 11],
    &[0, 1, 7, 6],
    &[1, 2, 8, 7],
    &[2, 3, 9, 8],
    &[3, 4, 10, 9],
    &[4, 5, 11, 10],
    &[5, 0, 6, 11],
];

/// How `vtk_type` is split, if it is linear.
pub(super) fn shape(vtk_type: u8) -> Option<&'static Shape> {
    match vtk_type {
        10 => Some(&TETRA),
        11 => Some(&VOXEL),
        12 => Some(&HEXAHEDRON),
        13 => Some(&WEDGE),
        14 => Some(&PYRAMID),
        _ => None,
    }
}

/// Splits one linear cell with the points `ids` into `out`, by the rule that the module describes.
pub(super) fn split(shape: &Shape, ids: &[u32], place: impl Fn(u32) -> DVec3, out: &mut [[u32; 4]]) {
    if let ([out], &[a, b, c, d]) = (&mut *out, ids) {
        *out = [a, b, c, d];
        return;
    }
    let smaller = |&a: &u8, &b: &u8| {
        let [a, b] = [a, b].map(|i| ids[i as usize]);
        by_place(place(a), place(b)).then_with(|| a.cmp(&b))
    };
    let apex = (0..ids.len() as u8).min_by(smaller).unwrap_or(0);
    let mut at = 0;
    for face in shape.faces.iter().filter(|f| !f.contains(&apex)) {
        let first = (0..face.len()).min_by(|&i, &j| smaller(&face[i], &face[j])).unwrap_or(0);
        let corner = |i: usize| ids[face[(first + i) % face.len()] as usize];
        for i in 2..face.len() {
            out[at] = [ids[apex as usize], corner(0), corner(i - 1), corner(i)];
            at += 1;
        }
    }
}

/// The order of all points: by x, then y, then z, then index.
pub(super) fn order(points: &[DVec3], a: u32, b: u32) -> Ordering {
    by_place(points[a as usize], points[b as usize]).then_with(|| a.cmp(&b))
}

fn by_place(p: DVec3, q: DVec3) -> Ordering {
    // Points of drawn cells are finite, so that a comparison always has an answer; −0 equals 0.
    let by = |x: f64, y: f64| x.partial_cmp(&y).unwrap_or(Ordering::Equal);
    by(p.x, q.x).then_with(|| by(p.y, q.y)).then_with(|| by(p.z, q.z))
}
