//! Meshes, their split into tetrahedra, and the faces of these.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "helpers of tests fail like tests do")]

mod neighbours;

use glam::{DMat3, DVec3, dvec3};
use halite::mesh::cells::{self, Tetrahedra};
use halite::mesh::faces::{BOUNDARY, Faces};
use halite::mesh::{Array, Cells, Mesh, Values, generate};
use proptest::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

fn volume(points: &[DVec3], t: [u32; 4]) -> f64 {
    let [a, b, c, d] = t.map(|p| points[p as usize]);
    DMat3::from_cols(b - a, c - a, d - a).determinant() / 6.0
}

fn mesh(points: Vec<DVec3>, list: &[(u8, Vec<u32>)]) -> Mesh {
    with_arrays(points, list, vec![], vec![])
}

fn with_arrays(points: Vec<DVec3>, list: &[(u8, Vec<u32>)], of_points: Vec<Array>, of_cells: Vec<Array>) -> Mesh {
    let mut offsets = vec![0];
    offsets.extend(list.iter().scan(0, |at, (_, ids)| {
        *at += ids.len() as u64;
        Some(*at)
    }));
    let cells = Cells {
        types: list.iter().map(|c| c.0).collect(),
        offsets,
        connectivity: list.iter().flat_map(|c| c.1.clone()).collect(),
    };
    Mesh::new(points, cells, of_points, of_cells).unwrap()
}

fn list(mesh: &Mesh) -> Vec<(u8, Vec<u32>)> {
    (0..mesh.cells().len()).map(|c| (mesh.cells().types[c], mesh.cells().points(c).to_vec())).collect()
}

fn bits(p: DVec3) -> [u64; 3] {
    (p + 0.0).to_array().map(f64::to_bits)
}

/// The positions of a tetrahedron's points, in an order that depends on nothing else.
fn place(points: &[DVec3], t: [u32; 4]) -> [[u64; 3]; 4] {
    let mut place = t.map(|p| bits(points[p as usize]));
    place.sort_unstable();
    place
}

/// Makes the faces, and checks what must hold for those of any mesh.
fn faces(points: &[DVec3], corners: &[[u32; 4]]) -> Faces {
    let f = Faces::new(points, corners);
    let sorted = |t: usize, k: usize| {
        let mut ids: Vec<u32> = (0..4).filter(|&i| i != k).map(|i| f.welded(corners[t][i])).collect();
        ids.sort_unstable();
        ids
    };
    let mut boundary = Vec::new();
    for (t, beyond) in f.neighbours.iter().enumerate() {
        let w = corners[t].map(|p| f.welded(p));
        let degenerate = (1..4).any(|i| w[..i].contains(&w[i]));
        assert_eq!(f.orientation[t] == 0, degenerate);
        for (k, &u) in beyond.iter().enumerate() {
            if u == BOUNDARY {
                boundary.extend((!degenerate).then_some((t as u32, k as u8)));
            } else {
                assert!(!degenerate);
                let back = (0..4).find(|&l| sorted(u as usize, l) == sorted(t, k)).expect("they share the face");
                assert_eq!(f.neighbours[u as usize][back], t as u32, "neighbours are mutual");
                let [a, b, c] = f.outward(corners, (t as u32, k as u8));
                let other = f.outward(corners, (u, back as u8));
                assert!([[a, c, b], [c, b, a], [b, a, c]].contains(&other), "their orientations are coherent");
            }
            if !degenerate && volume(points, corners[t]).abs() > 1e-12 {
                let [a, b, c] = f.outward(corners, (t as u32, k as u8)).map(|p| points[p as usize]);
                assert!((b - a).cross(c - a).dot(points[corners[t][k] as usize] - a) < 0.0);
            }
        }
    }
    assert_eq!(f.boundary, boundary);
    f
}

/// Area of the boundary, and the sum of its normals: 0 for a closed surface.
fn surface(f: &Faces, points: &[DVec3], corners: &[[u32; 4]]) -> (f64, DVec3) {
    f.boundary.iter().fold((0.0, DVec3::ZERO), |(area, sum), &face| {
        let [a, b, c] = f.outward(corners, face).map(|p| points[p as usize]);
        let normal = (b - a).cross(c - a) / 2.0;
        (area + normal.length(), sum + normal)
    })
}

/// All pairs of neighbours, as positions.
fn pairs(f: &Faces, points: &[DVec3], corners: &[[u32; 4]]) -> BTreeSet<[[[u64; 3]; 4]; 2]> {
    let of = |t: usize| place(points, corners[t]);
    f.neighbours
        .iter()
        .enumerate()
        .flat_map(|(t, n)| n.iter().filter(|&&u| u != BOUNDARY).map(move |&u| [of(t), of(u as usize)]))
        .collect()
}

fn shuffle<T>(items: &mut [T], seed: &mut u64) {
    for i in (1..items.len()).rev() {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        items.swap(i, (*seed >> 33) as usize % (i + 1));
    }
}

/// The same mesh with its points and cells in another order.
fn permuted(mesh: &Mesh, mut seed: u64) -> Mesh {
    let mut from: Vec<usize> = (0..mesh.points().len()).collect();
    shuffle(&mut from, &mut seed);
    let mut to = vec![0; from.len()];
    from.iter().enumerate().for_each(|(new, &old)| to[old] = new as u32);
    let mut cells = list(mesh);
    cells.iter_mut().for_each(|c| c.1.iter_mut().for_each(|p| *p = to[*p as usize]));
    shuffle(&mut cells, &mut seed);
    self::mesh(from.iter().map(|&p| mesh.points()[p]).collect(), &cells)
}

/// Corners 0 to 3, and two more points on either side of the face 0 1 2.
fn few() -> Vec<DVec3> {
    [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.], [0.2, 0.2, 2.], [0., 0., -1.], [0.2, 0.2, -2.]]
        .map(DVec3::from)
        .to_vec()
}

#[test]
fn every_lattice_fills_the_cube_and_fits_together() {
    let n = 7;
    let kinds: [(&str, Mesh); 5] = [
        ("hexahedra", generate::hexahedra(n)),
        ("tetrahedra", generate::tetrahedra(n)),
        ("wedges", generate::wedges(n)),
        ("pyramids", generate::pyramids(n)),
        ("mixed", generate::mixed(n)),
    ];
    for (kind, mesh) in kinds {
        let t = Tetrahedra::new(&mesh).unwrap();
        assert_eq!(t.cell.is_none(), kind == "tetrahedra");
        assert_eq!((t.cells, t.skipped.total()), (mesh.cells().len(), 0), "{kind}");
        for c in [&mesh, &generate::unwelded(&mesh)] {
            let t = Tetrahedra::new(c).unwrap();
            let sum: f64 = t.corners.iter().map(|&x| volume(c.points(), x)).sum();
            assert!((sum - 8.0).abs() < 1e-12, "{kind}: {sum}");
            let f = faces(c.points(), &t.corners);
            assert!(f.orientation.iter().all(|&o| o == 1), "{kind}: an inverted tetrahedron");
            assert_eq!(f.boundary.len(), 6 * 2 * (n - 1) * (n - 1), "{kind}");
            assert_eq!((f.non_manifold, f.folded, f.degenerate, f.flat, f.components()), (0, 0, 0, 0, 1), "{kind}");
            let (area, sum) = surface(&f, c.points(), &t.corners);
            assert!((area - 24.0).abs() < 1e-12 && sum.length() < 1e-12, "{kind}: {area} {sum}");
        }
    }
    let types: BTreeSet<u8> = generate::mixed(n).cells().types.iter().copied().collect();
    assert_eq!(types, BTreeSet::from([10, 11, 12, 13, 14]));
}

#[test]
fn the_other_generated_meshes_are_what_they_say() {
    let islands = generate::islands(25);
    let t = Tetrahedra::new(&islands).unwrap();
    let f = faces(islands.points(), &t.corners);
    assert_eq!((f.components(), f.non_manifold, f.folded), (2, 0, 0));
    assert!(surface(&f, islands.points(), &t.corners).1.length() < 1e-12);

    let n = 3;
    let junction = generate::t_junction(n);
    let t = Tetrahedra::new(&junction).unwrap();
    let f = faces(junction.points(), &t.corners);
    assert_eq!(f.boundary.len(), 12 * n * n + 12 * 4 * n * n);
    assert_eq!(f.components(), 2);
    assert!(f.weld.is_some());

    let demo = generate::demo(12);
    let t = Tetrahedra::new(&demo).unwrap();
    let f = faces(demo.points(), &t.corners);
    assert!(f.orientation.iter().all(|&o| o == 1));
    assert_eq!((f.components(), f.boundary.len()), (1, 4 * 36 * 12 * 2));
    let Values::F64(s) = &demo.point_arrays()[0].values else { panic!("s is f64") };
    let range = s.iter().fold((0.0f64, 0.0f64), |r, &s| (r.0.min(s), r.1.max(s)));
    assert!(range.0 < -0.2 && range.1 > 0.6, "{range:?}");
}

#[test]
fn each_tetrahedron_of_the_ring_lies_over_the_start_of_the_next() {
    for n in [3, 5, 8] {
        let ring = generate::ring(n);
        let t = Tetrahedra::new(&ring).unwrap();
        let f = faces(ring.points(), &t.corners);
        assert_eq!((f.components(), f.boundary.len()), (n, 4 * n));
        let inside = |i: usize, p: DVec3| {
            let [a, b, c, d] = t.corners[i].map(|q| ring.points()[q as usize]);
            let l = DMat3::from_cols(b - a, c - a, d - a).inverse() * (p - a);
            l.min_element() >= 0.0 && l.element_sum() <= 1.0
        };
        let height = |i: usize, x: f64, y: f64| {
            let z = (-500..500).map(|z| f64::from(z) * 1e-3).filter(|&z| inside(i, dvec3(x, y, z)));
            z.fold((f64::MAX, f64::MIN), |r, z| (r.0.min(z), r.1.max(z)))
        };
        for i in 0..n {
            let (y, x) = (std::f64::consts::TAU * (i + 1) as f64 / n as f64).sin_cos();
            let (over, under) = (height(i, 0.8 * x, 0.8 * y), height((i + 1) % n, 0.8 * x, 0.8 * y));
            assert!(under.0 <= under.1 && under.1 < over.0 && over.0 <= over.1, "{over:?} {under:?}");
        }
    }
}

/// A quarter turn of a hexahedron's numbering about z, and one about x.
const TURNS: [[usize; 8]; 2] = [[1, 2, 3, 0, 5, 6, 7, 4], [3, 2, 6, 7, 0, 1, 5, 4]];

fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![4 => -1.0..1.0f64, 1 => (-2i8..3).prop_map(f64::from), 1 => Just(-0.0)]
}

fn point() -> impl Strategy<Value = DVec3> {
    [coordinate(), coordinate(), coordinate()].prop_map(DVec3::from)
}

proptest! {
    #[test]
    fn the_split_of_a_hexahedron_depends_on_positions_alone(
        points in prop::collection::vec(point(), 8), turns in prop::collection::vec(0..2usize, 0..6), seed: u64
    ) {
        // Points at one position are told apart by their index only.
        let distinct: BTreeSet<_> = points.iter().map(|&p| bits(p)).collect();
        prop_assume!(distinct.len() == 8);
        let cube = mesh(points, &[(12, (0..8).collect())]);
        let mut ids: [usize; 8] = std::array::from_fn(|i| i);
        for &turn in &turns {
            ids = TURNS[turn].map(|i| ids[i]);
        }
        let turned = mesh(cube.points().to_vec(), &[(12, ids.iter().map(|&i| i as u32).collect())]);
        let places = |m: &Mesh| -> BTreeSet<_> {
            Tetrahedra::new(m).unwrap().corners.iter().map(|&t| place(m.points(), t)).collect()
        };
        prop_assert_eq!(places(&cube), places(&turned));
        prop_assert_eq!(places(&cube), places(&permuted(&turned, seed)));
    }

    #[test]
    fn the_split_keeps_the_volume(columns in [point(), point(), point()], at in point(), turns in prop::collection::vec(0..2usize, 0..6)) {
        let m = DMat3::from_cols(columns[0], columns[1], columns[2]);
        let unit: Vec<DVec3> = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.], [0., 0., 1.], [1., 0., 1.], [1., 1., 1.], [0., 1., 1.]]
            .into_iter().map(|p| m * DVec3::from(p) + at).collect();
        let mut ids: [u32; 8] = std::array::from_fn(|i| i as u32);
        for &turn in &turns {
            ids = TURNS[turn].map(|i| ids[i]);
        }
        let [a, b, c, d, e, f, g, h] = ids;
        let shapes = [
            (vec![(12, ids.to_vec())], 1.0),
            (vec![(11, vec![a, b, d, c, e, f, h, g])], 1.0),
            (vec![(13, vec![a, d, b, e, h, f])], 0.5),
            (vec![(14, vec![a, b, c, d, e])], 1.0 / 3.0),
            (vec![(14, vec![a, b, c, d, g])], 1.0 / 3.0),
            (vec![(10, vec![a, b, d, e])], 1.0 / 6.0),
        ];
        for (cells, share) in shapes {
            let m3 = mesh(unit.clone(), &cells);
            let t = Tetrahedra::new(&m3).unwrap();
            let parts: Vec<f64> = t.corners.iter().map(|&c| volume(&unit, c)).collect();
            let expected = share * m.determinant();
            prop_assert!((parts.iter().sum::<f64>() - expected).abs() < 1e-12, "{cells:?} {parts:?} {expected}");
            prop_assert!(parts.iter().all(|v| v * expected > -1e-12), "{cells:?} {parts:?} {expected}");
        }
    }

    #[test]
    fn the_order_of_points_and_cells_does_not_matter(seed: u64, apart: bool) {
        let mut m = generate::mixed(4);
        if apart {
            m = generate::unwelded(&m);
        }
        let p = permuted(&m, seed);
        let [(a, fa), (b, fb)] = [&m, &p].map(|m| {
            let t = Tetrahedra::new(m).unwrap();
            let f = faces(m.points(), &t.corners);
            (t, f)
        });
        prop_assert_eq!(pairs(&fa, m.points(), &a.corners), pairs(&fb, p.points(), &b.corners));
        prop_assert_eq!(fa.boundary.len(), fb.boundary.len());
    }

    /// Few positions and many cells, so that nearly everything that can be wrong with a mesh is.
    #[test]
    fn any_heap_of_tetrahedra_is_matched_coherently(
        points in prop::collection::vec([0..3i8, 0..3i8, 0..2i8], 4..14),
        heap in prop::collection::vec([any::<u32>(), any::<u32>(), any::<u32>(), any::<u32>()], 1..40),
        seed: u64,
    ) {
        let points: Vec<DVec3> = points.into_iter().map(|p| DVec3::from(p.map(f64::from))).collect();
        let mut corners: Vec<[u32; 4]> = heap.into_iter().map(|t| t.map(|p| p % points.len() as u32)).collect();
        // The order of cells decides only between duplicates.
        let mut seen = BTreeSet::new();
        corners.retain(|&t| seen.insert(place(&points, t)));
        let f = faces(&points, &corners);

        let mut naive = BTreeMap::<[[u64; 3]; 3], Vec<f64>>::new();
        for (t, &c) in corners.iter().enumerate().filter(|(t, _)| f.orientation[*t] != 0) {
            prop_assert!(volume(&points, c) * f64::from(f.orientation[t]) >= 0.0);
            for k in 0..4u8 {
                let mut ids = f.outward(&corners, (t as u32, k)).map(|p| bits(points[p as usize]));
                let turned = ids[0] < ids[1];
                let turned = turned ^ (ids[1] < ids[2]) ^ (ids[0] < ids[2]);
                ids.sort_unstable();
                naive.entry(ids).or_default().push(if turned { 1.0 } else { -1.0 });
            }
        }
        let matched = naive.values().filter(|s| s.contains(&1.0) && s.contains(&-1.0)).count();
        let halves: usize = naive.values().map(Vec::len).sum();
        prop_assert_eq!(f.boundary.len(), halves - 2 * matched);
        prop_assert_eq!(f.non_manifold, naive.values().filter(|s| s.len() > 2).count());
        prop_assert_eq!(f.folded, naive.values().filter(|s| s.len() == 2 && s[0] == s[1]).count());
        prop_assert_eq!(f.flat, corners.iter().zip(&f.orientation).filter(|(c, o)| **o != 0 && volume(&points, **c) == 0.0).count());

        let mut shuffled = corners.clone();
        shuffle(&mut shuffled, &mut seed.clone());
        let g = faces(&points, &shuffled);
        prop_assert_eq!(pairs(&f, &points, &corners), pairs(&g, &points, &shuffled));
    }
}

#[test]
fn cells_that_are_not_drawn_are_counted() {
    let mut points = few();
    points.push(dvec3(0.0, f64::NAN, 0.0));
    points.push(dvec3(5.0, 0.0, 0.0));
    let list = vec![
        (10, vec![0, 1, 2, 3]),
        (5, vec![0, 1, 2]),
        (42, vec![0, 1, 2, 3]),
        (10, vec![0, 1, 2, 7]),
        (10, vec![0, 1, 2, 4]),
        (10, vec![0, 1, 2, 8]),
        (0, vec![]),
        (41, vec![0; 10]),
        (10, vec![0, 1, 2, 5]),
    ];
    let array =
        |values: Vec<u8>| vec![Array { name: "vtkGhostType".into(), components: 1, values: Values::U8(values) }];
    let hidden_point = array(vec![0, 0, 0, 0, 1, 0, 0, 0, 2]);
    let ghost_cells = array(vec![2, 0, 0, 0, 1, 0, 0, 0, 0]);
    let m = with_arrays(points, &list, hidden_point, ghost_cells);
    let t = Tetrahedra::new(&m).unwrap();
    assert_eq!(t.corners, [[0, 1, 2, 3], [0, 1, 2, 5]]);
    assert_eq!(t.cell, Some(vec![0, 8]));
    assert_eq!(t.cells, 2);
    let s = &t.skipped;
    assert_eq!((s.lower_dimensional, s.ghost, s.invisible, s.total()), (2, 2, 1, 7));
    assert_eq!(s.unsupported, BTreeMap::from([(41, 1), (42, 1)]));
}

#[test]
fn a_mesh_with_nothing_to_draw_says_what_it_has() {
    let error = |list: &[(u8, Vec<u32>)]| Tetrahedra::new(&mesh(few(), list)).unwrap_err().to_string();
    let said = error(&[(5, vec![0, 1, 2]), (5, vec![0, 1, 3]), (42, vec![0, 1, 2, 3])]);
    for part in ["2 of type triangle", "1 of type polyhedron", "2 below three dimensions", "1 of a type"] {
        assert!(said.contains(part), "{said}");
    }
    assert!(error(&[]).contains("no cells"));
    let said = error(&[(10, vec![0, 1, 2, 3]), (12, vec![0, 1, 2])]);
    assert!(said.contains("cell 1 is a hexahedron with 3 points, but that has 8"), "{said}");
}

#[test]
fn cell_types_have_names_and_dimensions() {
    for (t, name, dimension) in [
        (9, "quad", Some(2)),
        (12, "hexahedron", Some(3)),
        (24, "quadratic tetrahedron", Some(3)),
        (255, "unknown cell type", None),
    ] {
        assert_eq!((cells::name(t), cells::dimension(t)), (name, dimension));
    }
}

#[test]
fn malformed_parts_make_no_mesh() {
    let array = |components, n| Array { name: "a".into(), components, values: Values::F32(vec![0.0; n]) };
    let tet = || Cells { types: vec![10], offsets: vec![0, 4], connectivity: vec![0, 1, 2, 3] };
    let check = |cells: Cells, of_points: Vec<Array>, of_cells: Vec<Array>, part: &str| {
        let said = Mesh::new(few(), cells, of_points, of_cells).unwrap_err().to_string();
        assert!(said.contains(part), "{said}");
    };
    assert!(Mesh::new(few(), tet(), vec![array(1, 7), array(3, 21)], vec![array(2, 2)]).is_ok());
    check(Cells { offsets: vec![0], ..tet() }, vec![], vec![], "1 cells need 2 offsets");
    check(Cells { offsets: vec![1, 4], ..tet() }, vec![], vec![], "the first of them 0");
    check(Cells { offsets: vec![0, 3], ..tet() }, vec![], vec![], "the offsets end at 3");
    check(Cells { offsets: vec![0, 5], ..tet() }, vec![], vec![], "the offsets end at 5");
    let two = Cells { types: vec![10; 2], offsets: vec![0, 5, 4], ..tet() };
    check(two, vec![], vec![], "the offsets decrease at cell 1");
    check(Cells { connectivity: vec![0, 1, 2, 7], ..tet() }, vec![], vec![], "cell 0 names point 7");
    check(tet(), vec![array(1, 6)], vec![], "point array \"a\" has 6 values");
    check(tet(), vec![array(0, 0)], vec![], "not 0 components");
    check(tet(), vec![], vec![array(1, 2)], "cell array \"a\" has 2 values");
    assert!(Tetrahedra::new(&Mesh::default()).is_err());
}

/// From 0 to 1 without a step back, in steps that a bar can show.
#[test]
fn the_share_that_is_done_is_reported() {
    let mesh = generate::hexahedra(41);
    let told = std::sync::Mutex::new(Vec::new());
    let check = || {
        let told: Vec<f64> = std::mem::take(&mut *told.lock().unwrap());
        assert!(told.first() == Some(&0.0) && told.last() == Some(&1.0) && told.is_sorted(), "{told:?}");
        assert!(told.len() > 8 && told.windows(2).all(|w| w[1] - w[0] < 0.3), "{told:?}");
    };
    let report = |share: f64| told.lock().unwrap().push(share);
    let tetrahedra = Tetrahedra::with_progress(&mesh, &report).unwrap();
    check();
    assert_eq!(tetrahedra, Tetrahedra::new(&mesh).unwrap());
    let faces = Faces::with_progress(mesh.points(), &tetrahedra.corners, &report);
    check();
    assert_eq!(faces, Faces::new(mesh.points(), &tetrahedra.corners));
}
