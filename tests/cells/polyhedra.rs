//! Polyhedra and prisms.

use crate::common::draw::{self, Random};
use crate::kinds::{CUBE, SIMPLEX};
use crate::{Cut, near};
use glam::{DMat3, DVec3, dvec3};
use halite::mesh::cells::Tetrahedra;
use halite::mesh::{Cells, Mesh, Polyhedra};
use std::collections::HashMap;

/// Adds cells with faces given by positions.
#[derive(Default)]
pub(crate) struct Builder {
    ids: HashMap<[u64; 3], u32>,
    points: Vec<DVec3>,
    cells: Cells,
    polyhedra: Polyhedra,
}

impl Builder {
    pub(crate) fn new() -> Self {
        let starts = || vec![0];
        let cells = Cells { offsets: starts(), ..Cells::default() };
        Builder {
            cells,
            polyhedra: Polyhedra { cells: starts(), faces: starts(), points: vec![] },
            ..Builder::default()
        }
    }

    fn id(&mut self, p: DVec3) -> u32 {
        let points = &mut self.points;
        *self.ids.entry(p.to_array().map(f64::to_bits)).or_insert_with(|| {
            points.push(p);
            points.len() as u32 - 1
        })
    }

    fn cell(&mut self, vtk_type: u8, points: &[DVec3], faces: &[Vec<DVec3>]) {
        let ids: Vec<u32> = points.iter().map(|p| self.id(*p)).collect();
        for face in faces {
            let face: Vec<u32> = face.iter().map(|p| self.id(*p)).collect();
            self.polyhedra.points.extend(face);
            self.polyhedra.faces.push(self.polyhedra.points.len() as u64);
        }
        self.cells.types.push(vtk_type);
        self.cells.connectivity.extend(ids);
        self.cells.offsets.push(self.cells.connectivity.len() as u64);
        self.polyhedra.cells.push(self.polyhedra.faces.len() as u64 - 1);
    }

    pub(crate) fn polyhedron(&mut self, faces: &[Vec<DVec3>]) {
        let mut points: Vec<DVec3> = faces.concat();
        points.sort_by(|a, b| a.to_array().partial_cmp(&b.to_array()).unwrap());
        points.dedup();
        self.cell(42, &points, faces);
    }

    pub(crate) fn mesh(self) -> Mesh {
        Mesh::new(self.points, self.cells, vec![], vec![]).unwrap().with_polyhedra(self.polyhedra).unwrap()
    }
}

/// Faces of a box, outward, as corners of [0, 1]³.
const BOX: [[usize; 4]; 6] = [[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]];

/// Coarse and fine boxes as OpenFOAM and its like have them: a coarse box is a polyhedron with four faces where it
/// meets fine ones, and their points hang on the edges of its other faces.
fn hanging(refined: impl Fn([i32; 3]) -> bool, to: impl Fn(DVec3) -> DVec3 + Copy) -> (Mesh, usize) {
    let n = 3;
    let mut build = Builder::new();
    let is_fine = |c: [i32; 3]| c.iter().all(|x| (0..n).contains(x)) && refined(c);
    let mut hung = 0;
    for at in (0..n * n * n).map(|i| [i % n, i / n % n, i / n / n]) {
        let low = DVec3::from(at.map(f64::from));
        if refined(at) {
            for o in 0..8 {
                let low = low + dvec3(f64::from(o & 1), f64::from(o >> 1 & 1), f64::from(o >> 2)) / 2.0;
                let corners = CUBE.map(|c| to(low + DVec3::from(c) / 2.0));
                build.cell(12, &corners, &[]);
            }
            continue;
        }
        // A point in the middle of an edge is there if any box around the edge is fine.
        let halved = |a: DVec3, b: DVec3| {
            let middle = (a + b) / 2.0;
            (0..8).any(|o| {
                let near =
                    middle + dvec3(f64::from(o & 1) - 0.5, f64::from(o >> 1 & 1) - 0.5, f64::from(o >> 2) - 0.5) / 2.0;
                is_fine(near.floor().to_array().map(|x| x as i32))
            })
        };
        let mut faces = vec![];
        for face in BOX {
            let corners = face.map(|i| low + DVec3::from(CUBE[i]));
            let centre = corners.iter().sum::<DVec3>() / 4.0;
            let beyond = low + (centre - low - 0.5) * 2.0;
            let middles = [0, 1, 2, 3].map(|i| (corners[i] + corners[(i + 1) % 4]) / 2.0);
            if is_fine(beyond.to_array().map(|x| x.round() as i32)) {
                faces.extend((0..4).map(|i| vec![corners[i], middles[i], centre, middles[(i + 3) % 4]]));
                hung += 1;
                continue;
            }
            let mut around = vec![];
            for i in 0..4 {
                around.push(corners[i]);
                if halved(corners[i], corners[(i + 1) % 4]) {
                    around.push(middles[i]);
                }
            }
            hung += usize::from(around.len() > 4);
            faces.push(around);
        }
        let faces: Vec<Vec<DVec3>> = faces.iter().map(|f| f.iter().map(|p| to(*p)).collect()).collect();
        build.polyhedron(&faces);
    }
    (build.mesh(), hung)
}

#[test]
fn hanging_nodes_tile_exactly() {
    let mut random = Random::of("hanging");
    for round in 0..60 {
        let fine: u32 =
            random.below(1 << 27) as u32 & if round % 2 == 0 { random.below(1 << 27) as u32 } else { u32::MAX };
        let refined = |c: [i32; 3]| fine >> (c[0] + 3 * c[1] + 9 * c[2]) & 1 == 1;
        // A shear, and a scale whose products are rounded; planes stay planes, nearly.
        let m = if round % 3 == 0 {
            DMat3::IDENTITY
        } else {
            DMat3::IDENTITY + DMat3::from_cols(random.point(0.2), random.point(0.2), random.point(0.2))
        };
        let (mesh, hung) = hanging(refined, |p| m * p * 0.1);
        let cut = Cut::new(&mesh);
        let volumes = cut.volumes();
        let whole = 0.027 * m.determinant();
        assert!(hung > 0 || fine == 0 || round > 0);
        assert!((volumes.iter().sum::<f64>() - whole).abs() < 1e-14, "{round}");
        assert!(volumes.iter().all(|v| *v > -1e-16), "{round}");
        assert!(cut.surface() < 6.0 * 0.09 * m.determinant().cbrt().powi(2) * 1.5, "{round}: {}", cut.surface());
        assert_eq!(
            (cut.faces.components(), cut.faces.non_manifold, cut.tetrahedra.crooked.count),
            (1, 0, 0),
            "{round}"
        );
        let closed = cut.faces.boundary.iter().all(|face| {
            let corners =
                cut.faces.outward(&cut.tetrahedra.corners, *face).map(|p| m.inverse() * cut.points[p as usize] * 10.0);
            (0..3).any(|k| [0.0, 3.0].iter().any(|wall| corners.iter().all(|c| (c[k] - wall).abs() < 1e-9)))
        });
        assert!(closed, "{round}: a face inside the mesh is open");
    }
}

/// Prisms over a polygon with any number of corners.
pub(crate) fn prism(polygon: &[[f64; 2]]) -> Vec<Vec<DVec3>> {
    let layer = |z: f64| polygon.iter().map(|p| dvec3(p[0], p[1], z)).collect::<Vec<_>>();
    let (low, high) = (layer(0.0), layer(1.0));
    let n = polygon.len();
    let mut faces: Vec<Vec<DVec3>> =
        (0..n).map(|i| vec![low[i], low[(i + 1) % n], high[(i + 1) % n], high[i]]).collect();
    faces.push(low.into_iter().rev().collect());
    faces.push(high);
    faces
}

#[test]
fn polyhedra_of_any_shape() {
    let mut random = Random::of("polyhedra");
    let area = |polygon: &[[f64; 2]]| {
        let n = polygon.len();
        (0..n)
            .map(|i| (polygon[i][0] * polygon[(i + 1) % n][1] - polygon[(i + 1) % n][0] * polygon[i][1]) / 2.0)
            .sum::<f64>()
    };
    let mut shapes: Vec<Vec<[f64; 2]>> = vec![
        // Both arms are seen from the inner corner's square only.
        vec![[0., 0.], [5., 0.], [5., 1.], [1., 1.], [1., 5.], [0., 5.]],
        // A T whose foot is long.
        vec![[0., 0.], [3., 0.], [3., 1.], [2., 1.], [2., 9.], [1., 9.], [1., 1.], [0., 1.]],
        // A star with five points.
        (0..10)
            .map(|i| {
                let (s, c) = (std::f64::consts::TAU * i as f64 / 10.0).sin_cos();
                let r = if i % 2 == 0 { 1.0 } else { 0.45 };
                [r * c, r * s]
            })
            .collect(),
    ];
    for n in 3..40 {
        shapes.push(
            (0..n)
                .map(|i| {
                    let (s, c) = (std::f64::consts::TAU * (i as f64 + random.within(0.0, 0.8)) / n as f64).sin_cos();
                    [c, s]
                })
                .collect(),
        );
    }
    for shape in &shapes {
        let mut build = Builder::new();
        let mut faces = prism(shape);
        let turn = random.below(faces.len());
        faces.rotate_left(turn);
        build.polyhedron(&faces);
        let cut = Cut::new(&build.mesh());
        let volumes = cut.volumes();
        assert!((volumes.iter().sum::<f64>() - area(shape)).abs() < 1e-12 * area(shape), "{shape:?}: {volumes:?}");
        assert!(volumes.iter().all(|v| *v >= -1e-15) && cut.tetrahedra.crooked.count == 0, "{shape:?}");
        assert_eq!((cut.faces.components(), cut.faces.folded), (1, 0), "{shape:?}");
    }
}

#[test]
fn polyhedra_and_prisms_fit_to_other_cells() {
    // A pentagonal prism of VTK's own type, a polyhedron on top of it, a hexahedron beside.
    let polygon = [[0., 0.], [2., 0.], [2.5, 1.], [1., 2.], [0., 1.]];
    let low = prism(&polygon);
    let raised: Vec<Vec<DVec3>> = low.iter().map(|f| f.iter().map(|p| *p + DVec3::Z).collect()).collect();
    for vtk_type in [15, 42] {
        let mut build = Builder::new();
        if vtk_type == 15 {
            let corners: Vec<DVec3> = [0.0, 1.0].iter().flat_map(|z| polygon.map(|p| dvec3(p[0], p[1], *z))).collect();
            build.cell(15, &corners, &[]);
        } else {
            build.polyhedron(&low);
        }
        build.polyhedron(&raised);
        let beside = |x: f64, y: f64, z: f64| dvec3(x, y, z);
        build.cell(
            12,
            &[
                beside(0., -1., 0.),
                beside(2., -1., 0.),
                beside(2., 0., 0.),
                beside(0., 0., 0.),
                beside(0., -1., 1.),
                beside(2., -1., 1.),
                beside(2., 0., 1.),
                beside(0., 0., 1.),
            ],
            &[],
        );
        let cut = Cut::new(&build.mesh());
        assert!(near(cut.volumes().iter().sum(), 2.0 * 3.5 + 2.0));
        assert_eq!(
            (cut.faces.components(), cut.faces.boundary.len()),
            (1, 2 * (2 * 3 + 5 * 2) - 2 * 3 + 12 - 2 * 2),
            "{vtk_type}"
        );
    }
    // A hexahedron as a polyhedron is split like one: same tetrahedra, no added point.
    let corners = CUBE.map(DVec3::from);
    let mut build = Builder::new();
    build.polyhedron(&BOX.map(|f| f.map(|i| corners[i]).to_vec()));
    let tetrahedra = Tetrahedra::new(&build.mesh()).unwrap();
    assert_eq!((tetrahedra.corners.len(), tetrahedra.added.len()), (6, 0));
}

#[test]
fn degenerate_polyhedra_are_harmless() {
    let o = DVec3::ZERO;
    let mut build = Builder::new();
    build.polyhedron(&[]);
    build.polyhedron(&[vec![o, DVec3::X]]);
    build.polyhedron(&[vec![o, o, o, o, o]]);
    build.polyhedron(&[vec![o, DVec3::X, DVec3::Y, o], vec![DVec3::X, DVec3::X, DVec3::Z, o, DVec3::Z]]);
    build.polyhedron(&[vec![o, DVec3::X, DVec3::X * 2.0, DVec3::X * 3.0, DVec3::X * 4.0], vec![o, DVec3::X, DVec3::Y]]);
    build.cell(10, &[o, DVec3::X, DVec3::Y, DVec3::Z], &[]);
    let cut = Cut::new(&build.mesh());
    assert_eq!(cut.tetrahedra.skipped.empty, 3);
    assert!(cut.points.iter().all(|p| p.is_finite()));
    // Without faces a polyhedron cannot be drawn.
    let bare = draw::mesh_of(SIMPLEX.map(DVec3::from).to_vec(), [(42, &[0, 1, 2, 3][..]), (10, &[0, 1, 2, 3][..])]);
    assert_eq!(Tetrahedra::new(&bare).unwrap().skipped.unsupported[&42], 1);
}

/// What is no solid is left out by name; what can be mended without doubt is.
#[test]
fn faces_that_do_not_bound_a_solid() {
    let cube: Vec<Vec<DVec3>> = BOX.iter().map(|f| f.iter().map(|i| DVec3::from(CUBE[*i])).collect()).collect();
    let at = |faces: &[Vec<DVec3>], by: DVec3| -> Vec<Vec<DVec3>> {
        faces.iter().map(|f| f.iter().map(|p| *p + by).collect()).collect()
    };
    let mut build = Builder::new();
    build.polyhedron(&cube);
    // Without a side; without two that are opposite.
    build.polyhedron(&at(&cube[1..], DVec3::X * 2.0));
    build.polyhedron(&at(&cube[2..], DVec3::X * 4.0));
    // In a plane.
    let [a, b, c, d] = [[6., 0.], [8., 0.], [7., 2.], [7., 1.]].map(|[x, y]| dvec3(x, y, 0.));
    build.polyhedron(&[vec![a, b, c], vec![a, b, d], vec![b, c, d], vec![c, a, d]]);
    let cut = Cut::new(&build.mesh());
    let skipped = &cut.tetrahedra.skipped;
    assert_eq!((skipped.open.count, skipped.open.first.clone()), (2, vec![1, 2]));
    assert_eq!((skipped.flat.count, skipped.flat.to_string()), (1, "cell 3".to_owned()));
    assert!(near(cut.volumes().iter().sum(), 1.0) && cut.tetrahedra.cells == 1);

    let whole = |faces: &[Vec<DVec3>]| {
        let mut build = Builder::new();
        build.polyhedron(faces);
        let cut = Cut::new(&build.mesh());
        assert_eq!((cut.tetrahedra.skipped.total(), cut.tetrahedra.crooked.count), (0, 0));
        let volumes = cut.volumes();
        assert!(volumes.iter().all(|v| *v > 0.0), "{volumes:?}");
        volumes.iter().sum::<f64>()
    };
    // A face twice, and the other way round.
    assert!(near(whole(&[&cube[..], &cube[..1]].concat()), 1.0));
    let turned: Vec<DVec3> = cube[0].iter().rev().copied().collect();
    assert!(near(whole(&[&cube[..], &[turned][..]].concat()), 1.0));
    // A wall inside, listed from both sides.
    let wall: Vec<DVec3> = [[0.2, 0.2], [0.8, 0.2], [0.5, 0.8]].iter().map(|p| dvec3(p[0], p[1], 0.5)).collect();
    let back: Vec<DVec3> = wall.iter().rev().copied().collect();
    assert!(near(whole(&[&cube[..], &[wall, back][..]].concat()), 1.0));
    // A side in two parts, whose neighbours know nothing of their ends.
    let half = |y: f64| vec![dvec3(0., y, 0.), dvec3(0., y, 1.), dvec3(0., y + 0.5, 1.), dvec3(0., y + 0.5, 0.)];
    assert!(near(whole(&[&cube[1..], &[half(0.0), half(0.5)][..]].concat()), 1.0));
    // Points that differ by rounding only.
    let mut frayed = cube.clone();
    frayed.iter_mut().enumerate().for_each(|(i, f)| f.iter_mut().for_each(|p| *p += 1e-13 * i as f64));
    assert!((whole(&frayed) - 1.0).abs() < 1e-11);
    // Two solids, apart, and touching in an edge.
    assert!(near(whole(&[cube.clone(), at(&cube, DVec3::X * 3.0)].concat()), 2.0));
    assert!(near(whole(&[cube.clone(), at(&cube, DVec3::X + DVec3::Y)].concat()), 2.0));
    // A concave quad over a concave quad: as many points and faces as a hexahedron has.
    assert!(near(whole(&prism(&[[0., 0.], [2., -1.], [0.5, 0.], [2., 1.]])), 0.5));

    // What crosses itself is drawn as well as that allows, and named.
    let mut build = Builder::new();
    build.polyhedron(&cube);
    build.polyhedron(&at(&prism(&[[0., 0.], [3., 3.], [3., 0.], [0., 1.]]), DVec3::X * 3.0));
    let cut = Cut::new(&build.mesh());
    assert_eq!((cut.tetrahedra.crooked.count, cut.tetrahedra.crooked.to_string()), (1, "cell 1".to_owned()));
}
