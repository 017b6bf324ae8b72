//! Where boundaries touch or cells overlap, as `halite info` tells: meshes of which that is known.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use glam::{DVec3, dvec3};
use halite::geometry::TetMesh;
use halite::geometry::contacts::Contacts;
use halite::mesh::cells::Tetrahedra;
use halite::mesh::faces::Faces;
use halite::mesh::{Cells, Mesh, generate};

/// Faces looked at, touching ones, those in other cells.
fn contacts(mesh: &Mesh) -> [usize; 3] {
    let tetrahedra = Tetrahedra::new(mesh).unwrap();
    let points = tetrahedra.points(mesh.points());
    let faces = Faces::new(&points, &tetrahedra.corners);
    let found = Contacts::new(&TetMesh::new(&points, &tetrahedra, &faces));
    assert_eq!(found.faces, faces.boundary.len());
    [found.faces, found.touching, found.overlapping]
}

/// Some meshes in one, each moved.
fn together(parts: &[(&Mesh, &dyn Fn(DVec3) -> DVec3)]) -> Mesh {
    let (mut points, mut cells) = (vec![], Cells { offsets: vec![0], ..Cells::default() });
    for (mesh, to) in parts {
        let (first, own) = (points.len() as u32, mesh.cells());
        points.extend(mesh.points().iter().map(|p| to(*p)));
        cells.types.extend(&own.types);
        let start = cells.connectivity.len() as u64;
        cells.offsets.extend(own.offsets[1..].iter().map(|end| start + end));
        cells.connectivity.extend(own.connectivity.iter().map(|p| first + p));
    }
    Mesh::new(points, cells, vec![], vec![]).unwrap()
}

fn tetrahedra(points: &[[f64; 3]], cells: &[[u32; 4]]) -> Mesh {
    let cells = Cells {
        types: vec![10; cells.len()],
        offsets: (0..=cells.len() as u64).map(|c| 4 * c).collect(),
        connectivity: cells.concat(),
    };
    Mesh::new(points.iter().map(|p| DVec3::from(*p)).collect(), cells, vec![], vec![]).unwrap()
}

/// A box of n³ cubes, [−1, 1]³, has 12 n² triangles around it.
fn block(n: usize) -> Mesh {
    let half = n as f64 / 2.0;
    together(&[(&generate::hexahedra(n + 1), &|p| ((p + 1.0) * half).round() / half - 1.0)])
}

#[test]
fn boundaries_alone_touch_nothing() {
    assert_eq!(contacts(&block(1)), [12, 0, 0]);
    assert_eq!(contacts(&block(5)), [300, 0, 0]);
    // Points of their own at the same places are one place.
    assert_eq!(contacts(&generate::unwelded(&generate::mixed(4)))[1..], [0, 0]);
    for mesh in [generate::islands(9), generate::demo(5), generate::ring(7), generate::pyramids(4)] {
        assert_eq!(contacts(&mesh)[1..], [0, 0]);
    }
    // Blocks with a gap between them, and two that share an edge.
    let right = |by: f64| move |p: DVec3| p + dvec3(by, 0.0, 0.0);
    assert_eq!(contacts(&together(&[(&block(3), &right(0.0)), (&block(3), &right(2.01))])), [216, 0, 0]);
    let beside = |p: DVec3| p + dvec3(2.0, 2.0, 0.0);
    assert_eq!(contacts(&together(&[(&block(3), &right(0.0)), (&block(3), &beside)])), [216, 0, 0]);
}

#[test]
fn blocks_that_are_not_welded_touch() {
    // Where rounding keeps two blocks apart, or makes them overlap by nothing to speak of, all faces between them
    // touch.
    for gap in [1e-9, -1e-9, 1e-12] {
        let both = together(&[(&block(3), &|p| p), (&block(3), &|p| p + dvec3(2.0 + gap, 0.0, 0.0))]);
        assert_eq!(contacts(&both), [216, 2 * 18, 0], "{gap}");
    }
    // Welded, they are one.
    let both = together(&[(&block(3), &|p| p), (&block(3), &|p| p + dvec3(2.0, 0.0, 0.0))]);
    assert_eq!(contacts(&both)[1..], [0, 0]);
}

#[test]
fn t_junctions_touch() {
    for n in [1, 2, 3] {
        // 2 n² triangles on the coarse side, four times as many on the fine one.
        let found = contacts(&generate::t_junction(n));
        assert_eq!(found[1..], [10 * n * n, 0], "{n}");
    }
    // A fault: of two blocks of 4³ hexahedra one is pushed up by half a block, so half of the faces between have a
    // neighbour.
    let pushed = together(&[(&block(4), &|p| p), (&block(4), &|p| p + dvec3(2.0, 0.0, 1.0))]);
    assert_eq!(contacts(&pushed), [2 * 192 - 2 * 16, 0, 0]);
    let pushed = together(&[(&block(4), &|p| p), (&block(4), &|p| p + dvec3(2.0, 0.0, 1.0 + 1e-3))]);
    assert_eq!(contacts(&pushed), [2 * 192, 2 * 16, 0]);
}

#[test]
fn cells_in_cells_overlap() {
    // A small box in a large one: its faces lie in that, but not the other way round.
    let small = |p: DVec3| p * 0.3 + dvec3(0.1, 0.02, -0.03);
    assert_eq!(contacts(&together(&[(&block(1), &|p| p), (&block(2), &small)])), [12 + 48, 0, 48]);
    // One that stands at the large one's wall: 8 of its faces lie on one that looks the same way.
    let at_wall = |p: DVec3| p * 0.3 + dvec3(0.7, 0.02, -0.03);
    let [_, touching, overlapping] = contacts(&together(&[(&block(1), &|p| p), (&block(2), &at_wall)]));
    assert_eq!((touching, overlapping), (0, 48));
    // The same box twice.
    assert_eq!(contacts(&together(&[(&block(1), &|p| p), (&block(1), &|p| p + 1e-9)])), [24, 0, 24]);
}

#[test]
fn odd_faces() {
    let points = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.], [0.2, 0.2, 20.], [0., 0., -1.]];
    // A face of two tetrahedra that are on different sides of it is none of the boundary.
    assert_eq!(contacts(&tetrahedra(&points, &[[0, 1, 2, 3], [0, 1, 2, 5]])), [6, 0, 0]);
    // On the same side: the face itself, twice, and that of the lower one which lies in the higher.
    assert_eq!(contacts(&tetrahedra(&points, &[[0, 1, 2, 3], [0, 1, 2, 4]])), [8, 0, 3]);
    // A face of three: one of those above has the neighbour, the other's lies on that one.
    assert_eq!(contacts(&tetrahedra(&points, &[[0, 1, 2, 4], [0, 1, 2, 3], [0, 1, 2, 5]])), [10, 0, 2]);
    // An edge of three cells is nothing odd.
    let fan = [
        [0., 0., 0.],
        [0., 0., 1.],
        [1., 0., 0.],
        [1., 1., 0.],
        [-1., 0., 0.],
        [-1., -1., 0.],
        [1., -1., 0.],
        [1., -2., 0.],
    ];
    assert_eq!(contacts(&tetrahedra(&fan, &[[0, 1, 2, 3], [0, 1, 4, 5], [0, 1, 6, 7]])), [12, 0, 0]);
}
