//! Cells of every type: they fill what they should, fit to their neighbours, and use all their nodes.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "helpers of tests fail like tests do")]

mod common;

use common::draw::{self, Random};
use glam::{DMat3, DVec3, dvec3};
use halite::mesh::cells::Tetrahedra;
use halite::mesh::faces::{BOUNDARY, Faces};
use halite::mesh::{Array, Cells, Mesh, Polyhedra, Values};
use std::collections::HashMap;

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

/// The nodes of one cell in [0, 1]³, from VTK's documentation of each type: corners, then what is between which of them.
struct Kind {
    vtk_type: u8,
    corners: &'static [[f64; 3]],
    between: &'static [&'static [usize]],
    volume: f64,
    surface: f64,
    tetrahedra: usize,
}

const CUBE: [[f64; 3]; 8] =
    [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.], [0., 0., 1.], [1., 0., 1.], [1., 1., 1.], [0., 1., 1.]];
const PRISM: [[f64; 3]; 6] = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.], [1., 0., 1.], [0., 1., 1.]];
const TENT: [[f64; 3]; 5] = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.], [0., 0., 1.]];
const SIMPLEX: [[f64; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]];
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
const PRISM_NODES: [&[usize]; 12] = [
    &[0, 1],
    &[1, 2],
    &[2, 0],
    &[3, 4],
    &[4, 5],
    &[5, 3],
    &[0, 3],
    &[1, 4],
    &[2, 5],
    &[0, 1, 3, 4],
    &[1, 2, 4, 5],
    &[2, 0, 5, 3],
];
const PRISM_21: [&[usize]; 15] = [
    &[0, 1],
    &[1, 2],
    &[2, 0],
    &[3, 4],
    &[4, 5],
    &[5, 3],
    &[0, 3],
    &[1, 4],
    &[2, 5],
    &[0, 1, 2],
    &[3, 4, 5],
    &[0, 1, 3, 4],
    &[1, 2, 4, 5],
    &[2, 0, 5, 3],
    &[0, 1, 2, 3, 4, 5],
];
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

const KINDS: [Kind; 14] = [
    Kind {
        vtk_type: 24,
        corners: &SIMPLEX,
        between: SIMPLEX_NODES.split_at(6).0,
        volume: 1.0 / 6.0,
        surface: SIMPLEX_SURFACE,
        tetrahedra: 8,
    },
    Kind {
        vtk_type: 71,
        corners: &SIMPLEX,
        between: &SIMPLEX_NODES,
        volume: 1.0 / 6.0,
        surface: SIMPLEX_SURFACE,
        tetrahedra: 24,
    },
    Kind {
        vtk_type: 25,
        corners: &CUBE,
        between: CUBE_NODES.split_at(12).0,
        volume: 1.0,
        surface: 6.0,
        tetrahedra: 48,
    },
    Kind {
        vtk_type: 33,
        corners: &CUBE,
        between: CUBE_NODES.split_at(16).0,
        volume: 1.0,
        surface: 6.0,
        tetrahedra: 48,
    },
    Kind { vtk_type: 29, corners: &CUBE, between: &CUBE_NODES, volume: 1.0, surface: 6.0, tetrahedra: 48 },
    Kind { vtk_type: 72, corners: &CUBE, between: &CUBE_NODES, volume: 1.0, surface: 6.0, tetrahedra: 48 },
    Kind { vtk_type: 79, corners: &CUBE, between: &CUBE_NODES, volume: 1.0, surface: 6.0, tetrahedra: 48 },
    Kind {
        vtk_type: 31,
        corners: &PRISM,
        between: PRISM_NODES.split_at(6).0,
        volume: 0.5,
        surface: PRISM_SURFACE,
        tetrahedra: 12,
    },
    Kind {
        vtk_type: 26,
        corners: &PRISM,
        between: PRISM_NODES.split_at(9).0,
        volume: 0.5,
        surface: PRISM_SURFACE,
        tetrahedra: 24,
    },
    Kind { vtk_type: 32, corners: &PRISM, between: &PRISM_NODES, volume: 0.5, surface: PRISM_SURFACE, tetrahedra: 24 },
    Kind { vtk_type: 73, corners: &PRISM, between: &PRISM_21, volume: 0.5, surface: PRISM_SURFACE, tetrahedra: 36 },
    Kind { vtk_type: 80, corners: &PRISM, between: &PRISM_NODES, volume: 0.5, surface: PRISM_SURFACE, tetrahedra: 24 },
    Kind {
        vtk_type: 27,
        corners: &TENT,
        between: TENT_NODES.split_at(8).0,
        volume: 1.0 / 3.0,
        surface: TENT_SURFACE,
        tetrahedra: 16,
    },
    Kind {
        vtk_type: 37,
        corners: &TENT,
        between: &TENT_NODES,
        volume: 1.0 / 3.0,
        surface: TENT_SURFACE,
        tetrahedra: 32,
    },
];

impl Kind {
    /// The cell with straight edges, moved by `to`, which must be affine.
    fn points(&self, to: impl Fn(DVec3) -> DVec3) -> Vec<DVec3> {
        let mut points: Vec<DVec3> = self.corners.iter().map(|c| DVec3::from(*c)).collect();
        for between in self.between {
            points.push(between.iter().map(|c| DVec3::from(self.corners[*c])).sum::<DVec3>() / between.len() as f64);
        }
        points.into_iter().map(to).collect()
    }
}

fn one(vtk_type: u8, points: Vec<DVec3>) -> Mesh {
    let ids: Vec<u32> = (0..points.len() as u32).collect();
    draw::mesh_of(points, [(vtk_type, &ids[..])])
}

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
        let linear = |p: &DVec3| (p.dot(dvec3(0.3, -0.7, 0.2)) + 0.1) as f32;
        let values: Vec<f32> = mesh.points().iter().flat_map(|p| [linear(p), 1.0]).collect();
        let values = cut.tetrahedra.values(&values, 2);
        for (i, p) in cut.points.iter().enumerate() {
            assert!((values[2 * i] - linear(p)).abs() < 1e-6 && (values[2 * i + 1] - 1.0).abs() < 1e-6, "{what}");
        }
        // Every value counts: moving one moves the value somewhere in the cell.
        for n in 0..mesh.points().len() {
            let values: Vec<f32> = (0..mesh.points().len()).map(|i| if i == n { 1.0 } else { 0.0 }).collect();
            let spread = cut.tetrahedra.values(&values, 1);
            assert!(cut.tetrahedra.corners.iter().flatten().any(|p| spread[*p as usize] != 0.0), "{what}: node {n}");
        }
    }
}

/// Of two cells on either side of x = 0, mirror images of each other, each with its own numbering: what is between them fits.
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

/// Adds cells with faces given by positions.
#[derive(Default)]
struct Builder {
    ids: HashMap<[u64; 3], u32>,
    points: Vec<DVec3>,
    cells: Cells,
    polyhedra: Polyhedra,
}

impl Builder {
    fn new() -> Self {
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

    fn polyhedron(&mut self, faces: &[Vec<DVec3>]) {
        let mut points: Vec<DVec3> = faces.concat();
        points.sort_by(|a, b| a.to_array().partial_cmp(&b.to_array()).unwrap());
        points.dedup();
        self.cell(42, &points, faces);
    }

    fn mesh(self) -> Mesh {
        Mesh::new(self.points, self.cells, vec![], vec![]).unwrap().with_polyhedra(self.polyhedra).unwrap()
    }
}

/// Faces of a box, outward, as corners of [0, 1]³.
const BOX: [[usize; 4]; 6] = [[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]];

/// Coarse and fine boxes as OpenFOAM and its like have them: a coarse box is a polyhedron with four faces where it meets fine
/// ones, and their points hang on the edges of its other faces.
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
        assert_eq!((cut.faces.components(), cut.faces.non_manifold, cut.tetrahedra.crooked), (1, 0, 0), "{round}");
        let closed = cut.faces.boundary.iter().all(|face| {
            let corners =
                cut.faces.outward(&cut.tetrahedra.corners, *face).map(|p| m.inverse() * cut.points[p as usize] * 10.0);
            (0..3).any(|k| [0.0, 3.0].iter().any(|wall| corners.iter().all(|c| (c[k] - wall).abs() < 1e-9)))
        });
        assert!(closed, "{round}: a face inside the mesh is open");
    }
}

/// Prisms over a polygon with any number of corners.
fn prism(polygon: &[[f64; 2]]) -> Vec<Vec<DVec3>> {
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
        assert!(volumes.iter().all(|v| *v >= -1e-15) && cut.tetrahedra.crooked == 0, "{shape:?}");
        assert_eq!((cut.faces.components(), cut.faces.folded), (1, 0), "{shape:?}");
    }
    // No point sees all of a U: it is drawn as well as that allows, and counted.
    let mut build = Builder::new();
    build.polyhedron(&prism(&[[0., 0.], [3., 0.], [3., 5.], [2., 5.], [2., 1.], [1., 1.], [1., 5.], [0., 5.]]));
    let cut = Cut::new(&build.mesh());
    assert_eq!(cut.tetrahedra.crooked, 1);
    assert!(cut.faces.boundary.len() >= 28);
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

/// GetFEM writes triquadratic hexahedra without the point in their middle.
#[test]
fn hexahedra_without_their_middle() {
    let mut points = KINDS[4].points(|p| p);
    points.pop();
    let cut = Cut::new(&one(29, points));
    assert!(near(cut.volumes().iter().sum(), 1.0) && cut.tetrahedra.added.len() == 1);
    assert_eq!(cut.points[26], DVec3::splat(0.5));
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
