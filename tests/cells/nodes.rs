//! Curved cells are split through all their nodes, and fit to each other.

use crate::common::draw::{self, Random};
use crate::kinds::KINDS;
use crate::{Cut, near, one};
use glam::{DVec3, dvec3};
use halite::mesh::faces::BOUNDARY;
use halite::mesh::{Array, Mesh, Values};

#[test]
fn a_cell_of_every_type_is_filled_through_all_its_nodes() {
    for kind in &KINDS {
        let mesh = one(kind.vtk_type, kind.points(|p| p));
        let cut = Cut::new(&mesh);
        let what = kind.vtk_type;
        let volumes = cut.volumes();
        assert_eq!(volumes.len(), kind.tetrahedra, "{what}");
        assert!(near(volumes.iter().sum(), kind.volume) && volumes.iter().all(|v| *v > 1e-4), "{what}: {volumes:?}");
        assert!(near(cut.surface(), kind.surface), "{what}: {}", cut.surface());
        let f = &cut.faces;
        assert_eq!((f.components(), f.folded, f.non_manifold, f.flat, f.degenerate), (1, 0, 0, 0, 0), "{what}");
        let mut used = vec![false; cut.points.len()];
        cut.tetrahedra.corners.iter().flatten().for_each(|p| used[*p as usize] = true);
        // Bézier control points need not lie in the cell.
        assert!(used.iter().all(|u| *u) || what >= 78, "{what}: a node is not used");
        // What is linear at the nodes is linear at what was added.
        let linear = |p: &DVec3| p.dot(dvec3(0.3, -0.7, 0.2)) + 0.1;
        let values: Vec<f64> = mesh.points().iter().flat_map(|p| [linear(p), 1.0]).collect();
        let values = cut.tetrahedra.values(values.into(), 2);
        for (i, p) in cut.points.iter().enumerate() {
            assert!((values[2 * i] - linear(p)).abs() < 1e-6 && (values[2 * i + 1] - 1.0).abs() < 1e-6, "{what}");
        }
        // Every value counts: moving one moves the value somewhere in the cell.
        for n in 0..mesh.points().len() {
            let values: Vec<f64> = (0..mesh.points().len()).map(|i| if i == n { 1.0 } else { 0.0 }).collect();
            let spread = cut.tetrahedra.values(values.into(), 1);
            assert!(cut.tetrahedra.corners.iter().flatten().any(|p| spread[*p as usize] != 0.0), "{what}: node {n}");
        }
    }
}

/// Of two cells on either side of x = 0, mirror images of each other, each with its own numbering: what is between them
/// fits.
#[test]
fn neighbours_agree_on_their_face() {
    let mut random = Random::of("neighbours");
    for round in 0..400 {
        let kind = &KINDS[round % KINDS.len()];
        // The face x = 0 is of all kinds a face; bend it, and the rest of each side.
        let bend: [DVec3; 4] = [(); 4].map(|()| random.point(0.15));
        let warp = |p: DVec3| {
            let at = p.with_x(0.0);
            at + bend[0] * (3.0 * at.y).sin()
                + bend[1] * (2.0 * at.z + at.y).cos()
                + p.x * (DVec3::X + bend[2] + bend[3] * at.y * at.z)
        };
        let there = kind.points(|p| warp(p.with_x(-p.x)));
        let turned = |p: &DVec3| {
            // The face has the same nodes at the same places.
            there.iter().copied().find(|q| q.distance(*p) < 1e-12).unwrap_or(*p)
        };
        let here: Vec<DVec3> = kind.points(warp).iter().map(turned).collect();
        let n = here.len() as u32;
        let (mut a, mut b): (Vec<u32>, Vec<u32>) = ((0..n).collect(), (n..2 * n).collect());
        if round % 3 == 0 {
            std::mem::swap(&mut a, &mut b);
        }
        let points = if round % 3 == 0 { [there, here].concat() } else { [here, there].concat() };
        let weights: Vec<f64> = (0..points.len()).map(|_| random.within(0.5, 2.0)).collect();
        // Points at one place have one weight, as they do in a file.
        let weight = |i: usize| weights[points.iter().position(|p| p == &points[i]).unwrap()];
        let rational: Vec<f64> = (0..points.len()).map(weight).collect();
        let mesh = draw::mesh_of(points.clone(), [(kind.vtk_type, &a[..]), (kind.vtk_type, &b[..])]);
        let rational = Array { name: "RationalWeights".into(), components: 1, values: Values::F64(rational) };
        let arrays = if round % 2 == 0 { vec![rational] } else { vec![] };
        let mesh = Mesh::new(mesh.points().to_vec(), mesh.cells().clone(), arrays, vec![]).unwrap();
        let cut = Cut::new(&mesh);
        let cells = cut.tetrahedra.cell.clone().unwrap();
        let mut shared = 0;
        for (t, beyond) in cut.faces.neighbours.iter().enumerate() {
            shared += beyond.iter().filter(|u| **u != BOUNDARY && cells[**u as usize] != cells[t]).count();
        }
        let single = Cut::new(&one(kind.vtk_type, mesh.points()[..n as usize].to_vec()));
        let open = cut.faces.boundary.len();
        assert_eq!(open + shared, 2 * single.faces.boundary.len(), "type {}, round {round}", kind.vtk_type);
        let on_face = single.faces.boundary.len() - open / 2;
        assert!(on_face >= 2 && shared == 2 * on_face, "type {}, round {round}: {shared} shared", kind.vtk_type);
    }
}

/// GetFEM writes triquadratic hexahedra without the point in their middle.
#[test]
fn hexahedra_without_their_middle() {
    let mut points = KINDS[4].points(|p| p);
    points.pop();
    let cut = Cut::new(&one(29, points));
    assert!(near(cut.volumes().iter().sum(), 1.0) && cut.tetrahedra.added.len() == 1);
    assert_eq!(cut.points[26], DVec3::splat(0.5));
}
