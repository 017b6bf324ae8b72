//! Meshes that nobody should write, and that somebody does: the engines against the reference, cases that fail shrunk.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test fails by panicking")]

mod common;

use common::draw::{self, MESHES, Random};
use common::{ENGINES, Engine, Scene, rounds};
use glam::{DMat3, DQuat, DVec3, dvec2, dvec3};
use halite::field::Association;
use halite::mesh::cells::Tetrahedra;
use halite::mesh::faces::Faces;
use halite::mesh::{Array, Mesh, Values, generate};
use halite::transfer::TransferFunction;
use halite::view::{Camera, Projection, View};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// What the engines must reach.
const BOUND: f64 = 5e-4;
const SIZE: [u32; 2] = [11, 9];

fn config(cases: usize) -> ProptestConfig {
    // The same cases in every run: a test that fails now and then tells nobody what broke it.
    let rng_seed = RngSeed::Fixed(2004);
    ProptestConfig { cases: rounds(cases) as u32, failure_persistence: None, rng_seed, ..ProptestConfig::default() }
}

/// A mesh of `cells`, and an array of as many values as it has points, which are made of `value`.
fn scene(mesh: &Mesh, value: impl Fn(usize) -> f64) -> Option<Scene> {
    let values = Values::F64((0..mesh.points().len()).map(value).collect());
    let array = Array { name: "s".into(), components: 1, values };
    let finite = (0..array.values.len()).any(|i| array.values.get(i).is_finite());
    let size = size(mesh);
    (finite && Tetrahedra::new(mesh).is_ok()).then(|| {
        Scene::new(mesh, array, Association::Point, |field| {
            let [lo, hi] = field.range(0);
            let at = |share: f64| lo + (hi / 2.0 - lo / 2.0) * 2.0 * share;
            let color = vec![(at(0.0), [0.9, 0.2, 0.1]), (at(0.6), [0.1, 0.8, 0.3]), (at(1.0), [0.2, 0.3, 1.0])];
            let opacity = vec![(at(0.0), 0.1), (at(0.45), 0.9), (at(0.5), 0.2), (at(1.0), 0.7)];
            TransferFunction::new(color, opacity, size / 4.0).unwrap()
        })
    })
}

/// Half the diagonal of the box around the finite points; 1 if that is nothing.
fn size(mesh: &Mesh) -> f64 {
    let finite = mesh.points().iter().filter(|p| p.is_finite());
    let (lo, hi) = finite.fold((DVec3::MAX, DVec3::MIN), |(lo, hi), p| (lo.min(*p), hi.max(*p)));
    let half = (hi / 2.0 - lo / 2.0).max_element();
    if half > 0.0 { half } else { 1.0 }
}

fn view(mesh: &Mesh, from: DVec3, angle: f64) -> View {
    let finite = mesh.points().iter().filter(|p| p.is_finite());
    let (lo, hi) = finite.fold((DVec3::MAX, DVec3::MIN), |(lo, hi), p| (lo.min(*p), hi.max(*p)));
    let (middle, size) = (lo / 2.0 + hi / 2.0, size(mesh));
    let camera = Camera {
        position: middle + from * (4.0 * size),
        focal_point: middle,
        view_up: from.any_orthonormal_vector(),
        projection: Projection::Perspective { view_angle: angle },
    };
    View::new(camera, SIZE).unwrap()
}

/// The mesh with some cells left out, some turned inside out, some points at one place with others.
fn shaken(mesh: &Mesh, random: &mut Random, kept: f64, turned: f64) -> Mesh {
    let cells = mesh.cells();
    let mut list: Vec<(u8, Vec<u32>)> = vec![];
    for c in 0..cells.len() {
        if random.within(0.0, 1.0) < kept {
            let mut ids = cells.points(c).to_vec();
            if cells.types[c] == 10 && random.within(0.0, 1.0) < turned {
                ids.swap(0, 1);
            }
            list.push((cells.types[c], ids));
        }
    }
    if list.is_empty() {
        list.push((cells.types[0], cells.points(0).to_vec()));
    }
    random.shuffle(&mut list);
    draw::mesh_of(mesh.points().to_vec(), list.iter().map(|(t, ids)| (*t, &ids[..])))
}

/// Whether no tetrahedron of a warped cell is turned over, and so lies in others.
fn fits_together(mesh: &Mesh) -> bool {
    let tetrahedra = Tetrahedra::new(mesh).unwrap();
    let faces = Faces::new(&tetrahedra.points(mesh.points()), &tetrahedra.corners);
    faces.folded == 0 && (faces.orientation.iter().all(|o| *o >= 0) || faces.orientation.iter().all(|o| *o <= 0))
}

fn check(scene: &Scene, view: &View, bound: f64) -> Result<(), TestCaseError> {
    let truth = Engine::Reference.image(scene, view);
    for engine in ENGINES {
        let got = engine.image(scene, view);
        prop_assert!(got.pixels.as_flattened().iter().all(|v| v.is_finite()), "{engine:?} draws what is not finite");
        let worst = got.compare(&truth).unwrap();
        prop_assert!(worst.max <= bound, "{engine:?} is off by {:e} at {:?}", worst.max, worst.at);
    }
    Ok(())
}

proptest! {
    #![proptest_config(config(400))]

    /// Cells that fit together, however thin, small, large or far away, with holes, inverted cells and values of any size, some
    /// of them missing.
    #[test]
    fn meshes_that_fit_together(
        kind in 0..MESHES.len(), seed: u64, thin in 0..13i32, scale in -20..21i32, offset in 0..7i32, kept in 0.2..1.0f64,
        values in -30..31i32, missing in prop::bool::weighted(0.3), angle in 15.0..60.0f64,
    ) {
        let mut random = Random::of(&format!("{kind} {seed}"));
        // A ring that is squeezed is flat in f64: thin cells of it would cut each other.
        let is_lattice = MESHES[kind].0 != "ring";
        let flat = if is_lattice { 10f64.powi(-thin) } else { 1.0 };
        let turn = DQuat::from_axis_angle(random.direction(), random.within(0.0, 6.0));
        let squeeze = DMat3::from_quat(turn) * DMat3::from_diagonal(dvec3(1.0, 1.0, flat));
        // What is thin must be near, or rounding makes it flat.
        let far = if thin == 0 && is_lattice { random.direction() * (10f64.powi(offset) - 1.0) } else { DVec3::ZERO };
        let mesh = draw::moved(&MESHES[kind].1(), |p| (squeeze * p + far) * 10f64.powi(scale));
        prop_assume!(fits_together(&mesh));
        let mesh = shaken(&mesh, &mut random, kept, 0.3);
        let height = 10f64.powi(values);
        let wave = random.direction() * 2.0;
        let places: Vec<DVec3> = MESHES[kind].1().points().to_vec();
        let gaps: Vec<bool> = places.iter().map(|_| missing && random.below(40) == 0).collect();
        let value = |i: usize| if gaps[i] { f64::NAN } else { (wave.dot(places[i]) + 0.3).sin() * height };
        let view = view(&mesh, random.direction(), angle);
        if let Some(scene) = scene(&mesh, value) {
            check(&scene, &view, BOUND)?;
        }
    }

    /// Any heap of cells: they overlap, are flat, the same twice, of one point. Engines differ where cells overlap, but lose no
    /// ray, and draw nothing where there is nothing.
    #[test]
    fn heaps_of_cells(
        points in prop::collection::vec([-3..4i8, -3..4i8, -3..4i8], 4..12),
        cells in prop::collection::vec((prop::sample::select(vec![10u8, 12, 13, 14, 24]), prop::collection::vec(any::<u8>(), 10)), 1..12),
        odd in prop::collection::vec((any::<u8>(), prop::sample::select(vec![f64::NAN, f64::INFINITY, 1e30, -1e30, 0.0])), 0..3),
        from in [-1.0..1.0f64, -1.0..1.0f64, 0.1..1.0f64],
    ) {
        // A little off the lattice, and off the middle of the pixels, so that no ray lies in a face: then either side is right.
        let place = |p: &[i8; 3]| DVec3::from(p.map(f64::from)) * dvec3(1.0, 0.97, 1.03) + dvec3(0.013, 0.007, -0.011);
        let all: Vec<DVec3> = points.iter().map(place).collect();
        let size = |t: u8| match t { 10 => 4, 12 => 8, 13 => 6, 14 => 5, _ => 10 };
        let lists: Vec<(u8, Vec<u32>)> =
            cells.iter().map(|(t, ids)| (*t, ids[..size(*t)].iter().map(|i| u32::from(*i) % all.len() as u32).collect())).collect();
        let mesh = draw::mesh_of(all, lists.iter().map(|(t, ids)| (*t, &ids[..])));
        let value = |i: usize| {
            let odd = odd.iter().find(|(at, _)| usize::from(*at) % points.len() == i).map(|o| o.1);
            odd.unwrap_or(i as f64)
        };
        let from = DVec3::from(from).normalize();
        let view = view(&mesh, from, 30.0).with_pixel_offset(dvec2(0.1372, 0.2113));
        if let Some(scene) = scene(&mesh, value) {
            let truth = Engine::Reference.image(&scene, &view);
            for engine in ENGINES {
                let got = engine.image(&scene, &view);
                for (a, b) in got.pixels.iter().zip(&truth.pixels) {
                    prop_assert!(a.iter().all(|v| v.is_finite() && (0.0..=1.0 + 1e-5).contains(v)), "{engine:?}: {a:?}");
                    prop_assert!(b[3] < 0.02 || a[3] > 0.0, "{engine:?} lost a ray: {a:?} for {b:?}");
                    prop_assert!(b[3] > 0.0 || a[3] < 1e-3, "{engine:?} drew {a:?} where nothing is");
                }
            }
        }
    }
}

/// Coordinates and values at the ends of what a float holds.
#[test]
fn extremes_are_drawn_or_refused() {
    let mesh = generate::mixed(3);
    for scale in [1e-300, 1e-150, 1e-45, 1e45, 1e150, 1e300] {
        for height in [1e-300, 1e300, 1e30] {
            let mesh = draw::moved(&mesh, |p| p * scale);
            let Some(scene) = scene(&mesh, |i| (i as f64).sin() * height) else { continue };
            let finite = mesh.points().iter().all(|p| p.is_finite());
            // A camera may not be able to look at that.
            let camera = Camera {
                position: dvec3(0.3, 0.4, 4.0) * scale,
                focal_point: DVec3::ZERO,
                view_up: DVec3::Y,
                projection: Projection::Parallel { parallel_scale: 1.5 * scale },
            };
            let Ok(view) = View::new(camera, SIZE) else { continue };
            let image = ENGINES[0].image(&scene, &view);
            assert!(finite && image.pixels.as_flattened().iter().all(|v| v.is_finite()), "{scale:e} {height:e}");
        }
    }
}

/// Schönhardt's twisted prism cannot be cut into tetrahedra without another point: as a polyhedron it has one in its middle.
#[test]
fn the_twisted_prism() {
    let corner = |i: usize, twist: f64, z: f64| {
        let (s, c) = (std::f64::consts::TAU * i as f64 / 3.0 + twist).sin_cos();
        dvec3(c, s, z)
    };
    let points: Vec<DVec3> = (0..3).map(|i| corner(i, 0.0, -0.5)).chain((0..3).map(|i| corner(i, 0.5, 0.5))).collect();
    let faces: [[u32; 3]; 8] = [[0, 2, 1], [3, 4, 5], [0, 1, 3], [1, 4, 3], [1, 2, 4], [2, 5, 4], [2, 0, 5], [0, 3, 5]];
    let polyhedra =
        halite::mesh::Polyhedra { cells: vec![0, 8], faces: (0..=8).map(|f| 3 * f).collect(), points: faces.concat() };
    let bare = draw::mesh_of(points, [(42, &[0, 1, 2, 3, 4, 5][..])]).with_polyhedra(polyhedra).unwrap();
    let tetrahedra = Tetrahedra::new(&bare).unwrap();
    assert_eq!((tetrahedra.corners.len(), tetrahedra.crooked), (8, 0));
}
