//! Cells of every type: they fill what they should, fit to their neighbours, and use all their nodes.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "helpers of tests fail like tests do")]

#[path = "../common/mod.rs"]
mod common;
mod kinds;
mod nodes;
mod polyhedra;
mod solids;

use common::draw;
use glam::{DMat3, DVec3, dvec3};
use halite::mesh::cells::Tetrahedra;
use halite::mesh::faces::Faces;
use halite::mesh::{Array, Mesh, Values};

/// A cell that was split.
struct Cut {
    tetrahedra: Tetrahedra,
    points: Vec<DVec3>,
    faces: Faces,
}

impl Cut {
    fn new(mesh: &Mesh) -> Self {
        let tetrahedra = Tetrahedra::new(mesh).unwrap();
        let points = tetrahedra.points(mesh.points()).into_owned();
        let faces = Faces::new(&points, &tetrahedra.corners);
        Cut { tetrahedra, points, faces }
    }

    /// Volumes, all positive if no tetrahedron is inverted against its neighbours.
    fn volumes(&self) -> Vec<f64> {
        let volume = |(t, o): (&[u32; 4], &i8)| {
            let [a, b, c, d] = t.map(|p| self.points[p as usize]);
            DMat3::from_cols(b - a, c - a, d - a).determinant() / 6.0 * f64::from(*o)
        };
        self.tetrahedra.corners.iter().zip(&self.faces.orientation).map(volume).collect()
    }

    fn surface(&self) -> f64 {
        let area = |face: &(u32, u8)| {
            let [a, b, c] = self.faces.outward(&self.tetrahedra.corners, *face).map(|p| self.points[p as usize]);
            (b - a).cross(c - a).length() / 2.0
        };
        self.faces.boundary.iter().map(area).sum()
    }
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-12
}

fn one(vtk_type: u8, points: Vec<DVec3>) -> Mesh {
    let ids: Vec<u32> = (0..points.len() as u32).collect();
    draw::mesh_of(points, [(vtk_type, &ids[..])])
}

#[test]
fn cells_that_cannot_be_what_they_say() {
    let told = |vtk_type: u8, n: usize, part: &str| {
        let said = Tetrahedra::new(&one(vtk_type, vec![DVec3::ZERO; n])).unwrap_err().to_string();
        assert!(said.contains(part), "{said}");
    };
    told(24, 9, "cell 0 is a quadratic tetrahedron with 9 points, but that has 10");
    told(72, 28, "cell 0 is a Lagrange hexahedron with 28 points, which fits no degree up to 10");
    told(72, 12 * 12 * 12, "fits no degree");
    told(74, 30, "cell 0 is a Lagrange pyramid with 30 points, whose order VTK leaves open");
    told(16, 10, "cell 0 is a hexagonal prism with 10 points, but that has 12");
    told(41, 8, "1 of type convex point set: 1 of a type that Halite does not draw");
    // Degrees that differ by direction come from an array.
    let points: Vec<DVec3> = (0..12).map(|i| dvec3(f64::from(i % 3), f64::from(i / 3 % 2), f64::from(i / 6))).collect();
    let order = [0, 2, 5, 3, 6, 8, 11, 9, 1, 4, 7, 10];
    let points = order.map(|i: usize| points[i]).to_vec();
    let degrees = Array { name: "HigherOrderDegrees".into(), components: 3, values: Values::F64(vec![2.0, 1.0, 1.0]) };
    let mesh = one(72, points);
    assert!(Tetrahedra::new(&mesh).is_err());
    let mesh = Mesh::new(mesh.points().to_vec(), mesh.cells().clone(), vec![], vec![degrees]).unwrap();
    let cut = Cut::new(&mesh);
    assert!(near(cut.volumes().iter().sum(), 2.0) && cut.tetrahedra.corners.len() == 12);
}
