//! Which tetrahedra are neighbours: whatever the order, scale and orientation of cells, and where they are flat or folded.

use super::*;

#[test]
fn half_of_the_tetrahedra_inverted_changes_no_neighbour() {
    let m = generate::tetrahedra(5);
    let upright = Tetrahedra::new(&m).unwrap().corners;
    let expected = faces(m.points(), &upright);
    let mut corners = upright.clone();
    corners.iter_mut().step_by(2).for_each(|t| t.swap(0, 2));
    let f = faces(m.points(), &corners);
    assert_eq!(pairs(&f, m.points(), &corners), pairs(&expected, m.points(), &upright));
    assert!(f.orientation.iter().enumerate().all(|(t, &o)| o == if t % 2 == 0 { -1 } else { 1 }));
    assert_eq!(f.boundary.len(), expected.boundary.len());
    assert!((surface(&f, m.points(), &corners).0 - 24.0).abs() < 1e-12);
}

#[test]
fn neither_scale_nor_threads_change_the_result() {
    let m = generate::islands(12);
    let corners = Tetrahedra::new(&m).unwrap().corners;
    let expected = Faces::new(m.points(), &corners);
    for scale in [1e-300, 1e-160, 1e-20, 1e150, 1e300] {
        let points: Vec<DVec3> = m.points().iter().map(|&p| p * scale).collect();
        assert_eq!(Faces::new(&points, &corners), expected, "{scale}");
    }
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert_eq!(pool.install(|| Faces::new(m.points(), &corners)), expected);
        let mixed = generate::mixed(9);
        assert_eq!(pool.install(|| Tetrahedra::new(&mixed).unwrap()), Tetrahedra::new(&mixed).unwrap());
    }
}

#[test]
fn duplicate_and_folded_cells_are_boundary() {
    let f = faces(&few(), &[[0, 1, 2, 3], [2, 0, 1, 3]]);
    assert_eq!((f.folded, f.boundary.len(), f.components()), (4, 8, 2));
    let f = faces(&few(), &[[0, 1, 2, 3], [0, 1, 2, 4]]);
    assert_eq!((f.folded, f.boundary.len(), f.components()), (1, 8, 2));
}

#[test]
fn a_face_of_three_or_four_joins_one_of_each_side() {
    let three = [[0, 1, 2, 4], [0, 1, 2, 3], [0, 1, 2, 5]];
    let f = faces(&few(), &three);
    assert_eq!((f.non_manifold, f.folded, f.boundary.len()), (1, 0, 10));
    assert_eq!((f.neighbours[0][3], f.neighbours[1][3], f.neighbours[2][3]), (BOUNDARY, 2, 1));
    let f = faces(&few(), &[three[0], [0, 1, 2, 6], three[1], three[2]]);
    assert_eq!((f.neighbours[2][3], f.neighbours[3][3], f.boundary.len()), (3, 2, 14));
}

#[test]
fn a_collapsed_cell_takes_no_part() {
    let mut points = few();
    points.push(dvec3(0.0, 1.0, -0.0));
    let corners = [[0, 1, 2, 3], [0, 1, 7, 5], [0, 1, 2, 7]];
    let f = faces(&points, &corners);
    assert_eq!(f.degenerate, 1);
    assert_eq!((f.neighbours[0][3], f.neighbours[1][3]), (1, 0));
    assert_eq!(f.neighbours[2], [BOUNDARY; 4]);
    assert_eq!((f.boundary.len(), f.components()), (6, 1));

    // A hexahedron with one edge collapsed is a wedge.
    let hex = generate::hexahedra(2);
    let mut points = hex.points().to_vec();
    let list = list(&hex);
    points[list[0].1[2] as usize] = points[list[0].1[1] as usize];
    points[list[0].1[6] as usize] = points[list[0].1[5] as usize];
    let m = mesh(points, &list);
    let t = Tetrahedra::new(&m).unwrap();
    let f = faces(m.points(), &t.corners);
    let sum: f64 = t.corners.iter().map(|&c| volume(m.points(), c)).sum();
    assert!((sum - 4.0).abs() < 1e-12);
    assert_eq!((f.boundary.len(), f.components(), f.folded), (8, 1, 0));
}

#[test]
fn flat_cells_fit_their_neighbours_however_they_are_listed() {
    let points =
        [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.], [0.5, 0.4, 1.], [0.4, 0.5, -1.]].map(DVec3::from);
    // Above, the square 0 1 2 3 is cut from 0 to 2, below from 1 to 3: a flat cell lies between.
    let around = [[0, 1, 2, 4], [0, 2, 3, 4], [1, 0, 3, 5], [3, 2, 1, 5]];
    for flat in [[0, 1, 2, 3], [1, 0, 2, 3], [3, 1, 0, 2]] {
        let mut corners = around.to_vec();
        corners.insert(1, flat);
        let f = faces(&points, &corners);
        assert_eq!((f.flat, f.folded, f.boundary.len(), f.components()), (1, 0, 8, 1));
        assert!(!f.neighbours[1].contains(&BOUNDARY));
    }
    // Cells on both sides that are cut alike need no flat cell: two of its faces then have three cells.
    let around = [[0, 1, 2, 4], [0, 2, 3, 4], [0, 1, 2, 5], [0, 2, 3, 5]];
    let mut corners = vec![[0, 1, 2, 3]];
    corners.extend(around);
    let f = faces(&points, &corners);
    assert_eq!((f.flat, f.non_manifold), (1, 2));
    // Nothing but flat cells.
    let f = faces(&points[..4], &[[0, 1, 2, 3]]);
    assert_eq!((f.flat, f.boundary.len(), f.orientation[0]), (1, 4, 1));
}

#[test]
fn a_chain_of_flat_cells_is_oriented_from_its_end() {
    // A strip of points in the plane z = 0; each four in a row make a flat tetrahedron, the next shares a face with it.
    let mut points: Vec<DVec3> = (0..40).map(|i| dvec3(f64::from(i), f64::from(i % 2), 0.0)).collect();
    points.push(dvec3(0.3, 0.3, 1.0));
    let mut corners: Vec<[u32; 4]> = (0..36u32).map(|i| [i, i + 1, i + 2, i + 3]).collect();
    corners.iter_mut().step_by(3).for_each(|t| t.swap(1, 2));
    corners.push([0, 1, 2, 40]);
    let f = faces(&points, &corners);
    assert_eq!((f.flat, f.folded, f.components()), (36, 0, 1));
}
