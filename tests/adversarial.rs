//! Meshes that nobody should write, and that somebody does: the engines against the reference, cases that fail shrunk.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod common;

use common::draw::{self, MESHES, Random};
use common::{ENGINES, Engine, Scene, rounds};
use glam::{DMat3, DQuat, DVec3, dvec2, dvec3};
use halite::field::Association;
use halite::geometry::TetMesh;
use halite::geometry::contacts::Contacts;
use halite::gpu::DeviceChoice;
use halite::image::Image;
use halite::mesh::cells::Tetrahedra;
use halite::mesh::faces::Faces;
use halite::mesh::{Array, Mesh, Values, generate};
use halite::render::Renderer;
use halite::transfer::TransferFunction;
use halite::view::{Camera, Projection, View};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{LazyLock, Mutex};

/// What the engines must reach.
const BOUND: f64 = 5e-4;
const SIZE: [u32; 2] = [11, 9];

fn config(cases: usize) -> ProptestConfig {
    // The same cases in every run: a test that fails now and then tells nobody what broke it. HALITE_SEED asks for
    // others.
    let seed = std::env::var("HALITE_SEED").map_or(2004, |seed| seed.parse().unwrap());
    let rng_seed = RngSeed::Fixed(seed);
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

/// How many faces of cells lie in other cells, of which none is turned over against the others.
fn overlaps(mesh: &Mesh) -> usize {
    let tetrahedra = Tetrahedra::new(mesh).unwrap();
    let points = tetrahedra.points(mesh.points());
    let faces = Faces::new(&points, &tetrahedra.corners);
    let turned = faces.orientation.iter().filter(|o| **o < 0).count();
    let turned = turned.min(faces.orientation.len() - turned);
    turned + faces.folded + Contacts::new(&TetMesh::new(&points, &tetrahedra, &faces)).overlapping
}

/// Pictures by all engines: the CPU's, and for some that of the device `HALITE_TEST_DEVICE`, or the first, if there is
/// one.
fn images(scene: &Scene, view: &View) -> Vec<(&'static str, Image)> {
    /// One of so many: devices in software take a second to compile what most scenes need anew.
    const SOME: usize = 40;
    static COUNT: AtomicUsize = AtomicUsize::new(0);
    static DEVICE: LazyLock<Option<Mutex<Renderer>>> = LazyLock::new(|| {
        let name = std::env::var("HALITE_TEST_DEVICE").unwrap_or_else(|_| "0".into());
        match Renderer::with_device(2, DeviceChoice::Named(name)) {
            Err(e) if std::env::var("HALITE_REQUIRE_GPU").is_ok_and(|v| v == "1") => panic!("{e}"),
            renderer => renderer.ok().map(Mutex::new),
        }
    });
    let mut images = vec![("CPU", ENGINES[0].image(scene, view))];
    if COUNT.fetch_add(1, Relaxed).is_multiple_of(SOME)
        && let Some(renderer) = &*DEVICE
    {
        let mut renderer = renderer.lock().unwrap();
        renderer.set_tetrahedra(&scene.mesh, scene.tetrahedra.clone());
        renderer.set_field(&scene.field).unwrap();
        renderer.set_transfer(&scene.transfer);
        images.push(("device", renderer.render(view, &|_| ()).unwrap()));
    }
    images
}

fn check(scene: &Scene, view: &View, bound: f64) -> Result<(), TestCaseError> {
    let truth = Engine::Reference.image(scene, view);
    for (engine, got) in images(scene, view) {
        prop_assert!(got.pixels.as_flattened().iter().all(|v| v.is_finite()), "{engine:?} draws what is not finite");
        let worst = got.compare(&truth).unwrap();
        prop_assert!(worst.max <= bound, "{engine:?} is off by {:e} at {:?}", worst.max, worst.at);
    }
    Ok(())
}

/// Cells that fit together, and what is done to them.
#[derive(Debug, Clone, Copy)]
struct Fitting {
    kind: usize,
    /// Orders of magnitude by which it is squeezed, scaled and moved away; that of the values.
    thin: i32,
    scale: i32,
    offset: i32,
    values: i32,
    kept: f64,
    missing: bool,
    angle: f64,
}

impl Fitting {
    /// The whole mesh, squeezed, turned, scaled and moved.
    fn whole(&self, random: &mut Random) -> Mesh {
        let name = MESHES[self.kind].0;
        // A ring that is squeezed is flat in f64: thin cells of it would cut each other.
        let is_lattice = name != "ring";
        let flat = if is_lattice { 10f64.powi(-self.thin) } else { 1.0 };
        let turn = DQuat::from_axis_angle(random.direction(), random.within(0.0, 6.0));
        // Tetrahedra stand on quadrilaterals there, cut as the cells beyond are, by the order of positions: a turn
        // would change that of the latter only. This keeps it.
        let cut = matches!(name, "mixed" | "unwelded");
        let [p, q, r] = random.point(0.7).to_array();
        let keep = DMat3::from_cols(dvec3(1.0, p, q), dvec3(0.0, 1.0, r), DVec3::Z);
        let squeeze = if cut { keep } else { DMat3::from_quat(turn) } * DMat3::from_diagonal(dvec3(1.0, 1.0, flat));
        // What is thin must be near, or rounding makes it flat.
        let far = random.direction() * (10f64.powi(self.offset) - 1.0);
        let far = if self.thin == 0 && is_lattice { far } else { DVec3::ZERO };
        draw::moved(&MESHES[self.kind].1(), |p| (squeeze * p + far) * 10f64.powi(self.scale))
    }

    /// The scene, if there is something to draw.
    fn scene(&self, whole: &Mesh, mut random: Random) -> (Option<Scene>, View) {
        let mesh = shaken(whole, &mut random, self.kept, 0.3);
        let height = 10f64.powi(self.values);
        let wave = random.direction() * 2.0;
        let places: Vec<DVec3> = MESHES[self.kind].1().points().to_vec();
        let gaps: Vec<bool> = places.iter().map(|_| self.missing && random.below(40) == 0).collect();
        let value = |i: usize| if gaps[i] { f64::NAN } else { (wave.dot(places[i]) + 0.3).sin() * height };
        let view = view(&mesh, random.direction(), self.angle);
        (scene(&mesh, value), view)
    }
}

proptest! {
    #![proptest_config(config(400))]

    /// Cells that fit together, however thin, small, large or far away, with holes, inverted cells and values of any
    /// size, some of them missing.
    #[test]
    fn meshes_that_fit_together(
        kind in 0..MESHES.len(), seed: u64, thin in 0..13i32, scale in -20..21i32, offset in 0..7i32, kept in 0.2..1.0f64,
        values in -30..31i32, missing in prop::bool::weighted(0.3), angle in 15.0..60.0f64,
    ) {
        let case = Fitting { kind, thin, scale, offset, values, kept, missing, angle };
        let mut random = Random::of(&format!("{kind} {seed}"));
        let mesh = case.whole(&mut random);
        prop_assume!(overlaps(&mesh) == 0);
        if let (Some(scene), view) = case.scene(&mesh, random) {
            check(&scene, &view, BOUND)?;
        }
    }

    /// Any heap of cells: they overlap, are flat, the same twice, of one point. Engines differ where cells overlap, but
    /// lose no ray, and draw nothing where there is nothing.
    #[test]
    fn heaps_of_cells(
        points in prop::collection::vec([-3..4i8, -3..4i8, -3..4i8], 4..12),
        cells in prop::collection::vec((prop::sample::select(vec![10u8, 12, 13, 14, 24]), prop::collection::vec(any::<u8>(), 10)), 1..12),
        odd in prop::collection::vec((any::<u8>(), prop::sample::select(vec![f64::NAN, f64::INFINITY, 1e30, -1e30, 0.0])), 0..3),
        from in [-1.0..1.0f64, -1.0..1.0f64, 0.1..1.0f64],
    ) {
        // A little off the lattice, and off the middle of the pixels, so that no ray lies in a face: then either side
        // is right.
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
            for (engine, got) in images(&scene, &view) {
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

/// Schönhardt's twisted prism cannot be cut into tetrahedra without another point: as a polyhedron it has one in its
/// middle.
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
    assert_eq!((tetrahedra.corners.len(), tetrahedra.crooked.count), (8, 0));
}

/// Two tetrahedra and a pyramid on one warped quadrilateral, which these cut along one diagonal and it along the other:
/// what lies between the cuts is empty, or covered twice. There the reference goes through both cells in turn, the
/// engine through one and then the other, as an overlap has no right order. So they agree on the opacity, but not on
/// the colour.
#[test]
fn a_quadrilateral_that_is_cut_both_ways() {
    // By position the pyramid below is cut from point 0 to point 2: along a ridge, or through a valley.
    let three = |height: f64, cut: [[u32; 4]; 2]| {
        let [up, down] = [height, -height];
        let corners = [[0., 0., up], [1., 0., down], [1., 1., up], [0., 1., down], [0.5, 0.5, -1.], [0.5, 0.5, 1.]];
        let cells = [(10, &cut[0][..]), (10, &cut[1]), (14, &[0, 3, 2, 1, 4])];
        draw::mesh_of(corners.map(DVec3::from).to_vec(), cells)
    };
    let off = |mesh: &Mesh| {
        let scene = scene(mesh, |i| [0.0, 1.0, 0.3, 0.8, 0.1, 0.9][i]).unwrap();
        let view = view(mesh, dvec3(0.3, 0.2, 1.0).normalize(), 30.0);
        let (got, truth) = (ENGINES[0].image(&scene, &view), Engine::Reference.image(&scene, &view));
        let opacities = got.pixels.iter().zip(&truth.pixels).map(|(a, b)| f64::from((a[3] - b[3]).abs()));
        (got.compare(&truth).unwrap().max, opacities.fold(0.0, f64::max))
    };
    let (alike, across) = ([[0, 1, 2, 5], [0, 2, 3, 5]], [[0, 1, 3, 5], [1, 2, 3, 5]]);
    for height in [0.2, -0.2] {
        let mesh = three(height, alike);
        assert_eq!(overlaps(&mesh), 0);
        assert!(off(&mesh).0 < 1e-5, "{:?}", off(&mesh));
    }
    let (twice, gap) = (three(0.2, across), three(-0.2, across));
    assert_eq!(overlaps(&gap), 0);
    assert!(off(&gap).0 < 1e-5, "{:?}", off(&gap));
    assert_eq!(overlaps(&twice), 4);
    let (color, opacity) = off(&twice);
    assert!(color > 1e-3 && opacity < 1e-5, "{color} {opacity}");
}
