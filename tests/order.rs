//! Visibility orders against a checker that asks each pixel's ray.

#![allow(clippy::expect_used, clippy::unwrap_used, clippy::panic, clippy::print_stderr, reason = "tests")]

mod common;

use common::draw::{self, Random};
use common::{rounds, shared};
use glam::{DMat3, DVec3, dvec3};
use halite::geometry::TetMesh;
use halite::mesh::cells::Tetrahedra;
use halite::mesh::faces::Faces;
use halite::mesh::{Mesh, generate};
use halite::order::check::{Verdict, check};
use halite::order::mpvo::{Mpvo, Rule, Sequence};
use halite::view::{Camera, Projection, View};
use robust::Coord3D;

fn geometry(mesh: &Mesh) -> TetMesh {
    geometry_of(mesh).unwrap()
}

/// The geometry of a mesh that can be split into tetrahedra.
fn geometry_of(mesh: &Mesh) -> Option<TetMesh> {
    let tetrahedra = Tetrahedra::new(mesh).ok()?;
    let points = tetrahedra.points(mesh.points());
    Some(TetMesh::new(&points, &tetrahedra, &Faces::new(&points, &tetrahedra.corners)))
}

/// A mesh of these tetrahedra.
fn mesh_of(points: Vec<DVec3>, cells: &[[u32; 4]]) -> Mesh {
    draw::mesh_of(points, cells.iter().map(|c| (10, &c[..])))
}

fn checked(geometry: &TetMesh, view: &View, rule: Rule) -> (Sequence, Verdict) {
    let sequence = Mpvo::default().sequence(geometry, view, rule);
    let entries: Vec<u32> = sequence.cells.iter().rev().copied().collect();
    let mut all = entries.clone();
    all.sort_unstable();
    assert!(all.into_iter().eq(0..geometry.cells.len() as u32), "each cell is there once");
    let verdict = check(geometry, view, &entries);
    (sequence, verdict)
}

/// The tetrahedra of a Delaunay triangulation (Bowyer 1981, Watson 1981), by exact predicates.
fn delaunay(points: &[DVec3]) -> (Vec<DVec3>, Vec<[u32; 4]>) {
    let coord = |p: DVec3| Coord3D { x: p.x, y: p.y, z: p.z };
    let n = points.len() as u32;
    let mut all = points.to_vec();
    let far = 40.0;
    all.extend([dvec3(-far, -far, -far), dvec3(far, far, -far), dvec3(-far, far, far), dvec3(far, -far, far)]);
    let positive = |all: &[DVec3], c: [u32; 4]| {
        let [a, b, c2, d] = c.map(|i| coord(all[i as usize]));
        if robust::orient3d(a, b, c2, d) > 0.0 { c } else { [c[0], c[2], c[1], c[3]] }
    };
    let mut cells = vec![positive(&all, [n, n + 1, n + 2, n + 3])];
    for p in 0..n {
        let is_near = |c: &[u32; 4]| {
            let [a, b, d, e] = c.map(|i| coord(all[i as usize]));
            robust::insphere(a, b, d, e, coord(all[p as usize])) > 0.0
        };
        let (near, rest): (Vec<_>, Vec<_>) = cells.into_iter().partition(is_near);
        let mut faces: Vec<[u32; 3]> = near
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, b, d], [a, c, d], [b, c, d]])
            .map(|mut f| {
                f.sort_unstable();
                f
            })
            .collect();
        faces.sort_unstable();
        cells = rest;
        let single = faces.chunk_by(|a, b| a == b).filter(|g| g.len() == 1);
        cells.extend(single.map(|g| positive(&all, [g[0][0], g[0][1], g[0][2], p])));
    }
    cells.retain(|c| c.iter().all(|&i| i < n));
    all.truncate(n as usize);
    (all, cells)
}

fn without_some(mesh: &Mesh, share: f64, random: &mut Random) -> Mesh {
    let tetrahedra = Tetrahedra::new(mesh).unwrap();
    let kept: Vec<[u32; 4]> = tetrahedra.corners.iter().filter(|_| random.within(0.0, 1.0) > share).copied().collect();
    mesh_of(tetrahedra.points(mesh.points()).into_owned(), &kept)
}

/// A ring of `n` blocks whose sides are inclined as the blades of a fan are: seen along z each hides a part of the next.
fn twisted_ring(n: usize, twist: f64) -> Mesh {
    let mut points = vec![];
    for (i, z) in (0..n).flat_map(|i| [0.0, 1.0].map(|z| (i, z))) {
        let (y, x) = (std::f64::consts::TAU * (i as f64 + twist * z) / n as f64).sin_cos();
        points.extend([0.8, 1.0].map(|r| dvec3(x * r, y * r, 0.4 * z)));
    }
    let at = |i: usize, z: usize, r: usize| (4 * (i % n) + 2 * z + r) as u32;
    let block = |i| {
        [(i, 0, 0), (i, 0, 1), (i + 1, 0, 1), (i + 1, 0, 0), (i, 1, 0), (i, 1, 1), (i + 1, 1, 1), (i + 1, 1, 0)]
            .map(|(i, z, r)| at(i, z, r))
    };
    let cells: Vec<[u32; 8]> = (0..n).map(block).collect();
    draw::mesh_of(points, cells.iter().map(|c| (12, &c[..])))
}

const KINDS: [&str; 8] =
    ["holes", "components", "sheared", "Delaunay", "Delaunay with holes", "hanging nodes", "slivers", "ball"];

fn drawn(kind: &str, random: &mut Random) -> Mesh {
    let turn = DMat3::from_axis_angle(random.direction(), random.within(0.0, 6.0));
    let spread = |n: usize, random: &mut Random| (0..n).map(|_| random.point(1.0)).collect::<Vec<_>>();
    match kind {
        "holes" => without_some(&generate::tetrahedra(4 + random.below(2)), random.within(0.05, 0.5), random),
        "components" => draw::moved(&generate::islands(6 + random.below(3)), |p| turn * p),
        "sheared" => {
            let shear = DMat3::from_cols(random.point(1.0), random.point(1.0), random.direction()) * 0.7 + turn * 0.3;
            draw::moved(&generate::tetrahedra(4 + random.below(2)), |p| shear * p)
        }
        "Delaunay" => {
            let (points, cells) = delaunay(&spread(50, random));
            mesh_of(points, &cells)
        }
        "Delaunay with holes" => {
            let (points, cells) = delaunay(&spread(60, random));
            without_some(&mesh_of(points, &cells), 0.4, random)
        }
        "hanging nodes" => draw::moved(&generate::t_junction(2), |p| turn * p),
        // Nearly on planes, which leaves cells of no thickness to speak of.
        "slivers" => {
            let flat = |p: DVec3, random: &mut Random| {
                dvec3(p.x, p.y, (2.0 * p.z).round() / 2.0 + random.within(-1.0, 1.0) * 1e-6)
            };
            let points: Vec<_> = spread(60, random).into_iter().map(|p| flat(p, random)).collect();
            let (points, cells) = delaunay(&points);
            mesh_of(points, &cells)
        }
        _ => draw::moved(&generate::demo(2), |p| turn * p),
    }
}

fn seen(i: usize, random: &mut Random) -> View {
    let from = random.direction();
    let position = from * if i.is_multiple_of(5) { random.within(0.1, 1.2) } else { random.within(2.5, 6.0) };
    let projection = if i.is_multiple_of(3) {
        Projection::Parallel { parallel_scale: 1.3 }
    } else {
        Projection::Perspective { view_angle: if i.is_multiple_of(5) { 90.0 } else { 40.0 } }
    };
    let camera = Camera { position, focal_point: random.point(0.2), view_up: random.direction(), projection };
    View::new(camera, [40, 32]).unwrap()
}

/// What follows from neighbours and rays is right; what is not, as cells hide each other in circles, is known pixel by pixel.
#[test]
fn a_thousand_meshes_are_in_order() {
    let mut tallies = KINDS.map(|_| Tally::default());
    for i in 0..1000 * rounds(1) {
        let kind = KINDS[i % KINDS.len()];
        let tally = &mut tallies[i % KINDS.len()];
        let mut random = Random::of(&format!("{kind} {i}"));
        let geometry = geometry(&drawn(kind, &mut random));
        let view = seen(i, &mut random);
        let (sequence, verdict) = checked(&geometry, &view, Rule::Mpvo);
        tally.add(&sequence, &verdict, &checked(&geometry, &view, Rule::Depth).1);
        assert_eq!(verdict.overlaps, 0, "{kind} {i}");
        assert_eq!((sequence.cycles > 0, sequence.cuts > 0), (sequence.cycle_cells > 0, sequence.cycles > 0));
        assert!(sequence.cycles > 0 || verdict.inversions == 0, "{kind} {i}: {verdict:?}");
        let told = |p: &u32| sequence.disordered.binary_search(p).is_ok();
        assert!(verdict.wrong.iter().all(told), "{kind} {i}: {sequence:?} {verdict:?}");
    }
    for (kind, tally) in KINDS.iter().zip(&tallies) {
        eprintln!("{kind}: {tally}");
        assert_eq!(tally.inversions, 0, "{kind}");
    }
    let of = |count: fn(&Tally) -> u64| tallies.iter().map(count).sum::<u64>();
    assert!(of(|t| t.by_depth) > 0 && of(|t| t.circles) < 30);
}

/// What the order of many meshes is, and that by depth.
#[derive(Default)]
struct Tally {
    meshes: u64,
    pixels: u64,
    pairs: u64,
    /// Of meshes without circles.
    inversions: u64,
    circles: u64,
    /// Pixels that see a cut of circles.
    cut: u64,
    depth_inversions: u64,
    /// Pixels that are wrong by depth.
    by_depth: u64,
}

impl Tally {
    fn add(&mut self, sequence: &Sequence, verdict: &Verdict, depth: &Verdict) {
        self.meshes += 1;
        self.pixels += verdict.pixels;
        self.pairs += verdict.pairs;
        self.inversions += if sequence.cycles == 0 { verdict.inversions } else { 0 };
        self.circles += u64::from(sequence.cycles > 0);
        self.cut += sequence.disordered.len() as u64;
        self.depth_inversions += depth.inversions;
        self.by_depth += depth.wrong.len() as u64;
    }
}

impl std::fmt::Display for Tally {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{} meshes, {} pairs in {} pixels: {} inverted without a circle, circles in {} ({} pixels see a cut); by depth {} inverted, \
             {} pixels wrong",
            self.meshes,
            self.pairs,
            self.pixels,
            self.inversions,
            self.circles,
            self.cut,
            self.depth_inversions,
            self.by_depth
        )
    }
}

/// Seen along its axis nothing of a ring is first, by gaps or by shared faces; from aside there is an order.
#[test]
fn rings_are_circles() {
    let view = |position: DVec3, size| {
        let projection = Projection::Perspective { view_angle: 35.0 };
        View::new(Camera { position, focal_point: DVec3::ZERO, view_up: DVec3::Y, projection }, size).unwrap()
    };
    for n in [3, 5, 8, 13, 40] {
        // Few blades are too wide to be blocks: their tetrahedra overlap.
        let blades = [1.3, -1.3].map(|twist| ("blades", twisted_ring(n + 45, twist)));
        for (name, mesh) in [("beams", generate::ring(n))].into_iter().chain(blades) {
            let geometry = geometry(&mesh);
            for from in [dvec3(0.01, 0.02, 4.0), dvec3(0.0, 0.05, -4.0)] {
                let (sequence, verdict) = checked(&geometry, &view(from, [96, 96]), Rule::Mpvo);
                assert_eq!(sequence.cycles, 1, "{name} {n}: {sequence:?}");
                assert!(sequence.cycle_cells >= n as u64 && sequence.cuts >= 1, "{name} {n}: {sequence:?}");
                // Between blades there may be a face that no pixel sees.
                assert!(!verdict.wrong.is_empty() || name == "blades", "{name} {n}: a circle has no order");
                let told = |p: &u32| sequence.disordered.binary_search(p).is_ok();
                assert_eq!(verdict.overlaps, 0, "{name} {n}");
                let untold: Vec<_> = verdict.wrong.iter().filter(|p| !told(p)).collect();
                assert!(untold.is_empty(), "{name} {n}: {untold:?} of {} wrong, {sequence:?}", verdict.wrong.len());
                // One of the n places where a cell hides the next.
                let share = sequence.disordered.len() as f64 / verdict.pixels as f64;
                assert!(share < 2.0 / n as f64, "{name} {n}: {share}");
            }
            let (sequence, verdict) = checked(&geometry, &view(dvec3(4.0, 0.3, 0.2), [96, 96]), Rule::Mpvo);
            assert_eq!((sequence.cycles, verdict.inversions), (0, 0), "{name} {n} from aside");
        }
    }
}

/// Rings of any number of blades, twisted either way and turned anyhow, are circles for whoever looks along their axis: some rays pass
/// from each blade through the next.
#[test]
fn every_twisted_ring_is_found() {
    let (mut found, mut tally) = (0, Tally::default());
    for i in 0..200 {
        let mut random = Random::of(&format!("ring {i}"));
        let n = 45 + random.below(40);
        let twist = random.within(1.5, 2.0) * if i % 2 == 0 { 1.0 } else { -1.0 };
        let turn = DMat3::from_axis_angle(random.direction(), random.within(0.0, 6.0));
        let geometry = geometry(&draw::moved(&twisted_ring(n, twist), |p| turn * p));
        let side = if i % 4 < 2 { 1.0 } else { -1.0 };
        let position = turn * dvec3(random.within(-0.05, 0.05), random.within(-0.05, 0.05), 4.0 * side);
        let projection = Projection::Perspective { view_angle: 35.0 };
        let camera = Camera { position, focal_point: DVec3::ZERO, view_up: turn * DVec3::Y, projection };
        let (sequence, verdict) = checked(&geometry, &View::new(camera, [96, 96]).unwrap(), Rule::Mpvo);
        found += usize::from(sequence.cycles == 1 && sequence.cycle_cells >= n as u64);
        // A circle that any pixel sees has a wrong pair in whatever order: without one that is found there is none.
        assert!(sequence.cycles > 0 || verdict.inversions == 0, "{i}: {n} blades, twist {twist}");
        let told = |p: &u32| sequence.disordered.binary_search(p).is_ok();
        assert!(verdict.overlaps == 0 && verdict.wrong.iter().all(told), "{i}: {n} blades, {sequence:?}");
        tally.add(&sequence, &verdict, &checked(&geometry, &View::new(camera, [96, 96]).unwrap(), Rule::Depth).1);
    }
    eprintln!("a circle is found in {found} of 200 rings; {tally}");
    assert_eq!(found, 200);
}

/// The orders of the literature have the faults that they are known for.
#[test]
fn published_orders_are_right_where_they_say() {
    let mut random = Random::of("published");
    let (points, cells) = delaunay(&(0..80).map(|_| random.point(1.0)).collect::<Vec<_>>());
    let (convex, islands) = (geometry(&mesh_of(points, &cells)), geometry(&generate::islands(8)));
    let mut wrong = [0; 3];
    for i in 0..20 {
        let view = seen(3 * i + 1, &mut random);
        for rule in [Rule::Convex, Rule::Nonconvex, Rule::Xmpvo] {
            assert_eq!(checked(&convex, &view, rule).1.inversions, 0, "{rule:?}");
        }
        for (count, rule) in wrong.iter_mut().zip([Rule::Convex, Rule::Nonconvex, Rule::Xmpvo]) {
            *count += checked(&islands, &view, rule).1.wrong.len();
        }
    }
    eprintln!("pixels wrong of islands: MPVO {}, MPVONC {}, XMPVO {}", wrong[0], wrong[1], wrong[2]);
    assert!(wrong[0] > wrong[1] && wrong[1] > 0 && wrong[2] == 0);
}

/// A million cells, convex and not; the time is told.
#[test]
fn large_meshes_are_put_in_order() {
    if std::env::var_os("HALITE_LONG").is_none() {
        eprintln!("skipped: it takes a minute, HALITE_LONG=1 runs it");
        return;
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    for (name, mesh) in [("convex", generate::tetrahedra(61)), ("islands", generate::islands(67))] {
        let geometry = pool.install(|| geometry(&mesh));
        let mut mpvo = Mpvo::default();
        for i in 0..6 {
            let mut random = Random::of(&format!("{name} {i}"));
            let camera = Camera {
                position: random.direction() * 5.0,
                focal_point: DVec3::ZERO,
                view_up: random.direction(),
                projection: Projection::Perspective { view_angle: 30.0 },
            };
            let view = View::new(camera, [512, 512]).unwrap();
            let start = std::time::Instant::now();
            let sequence = pool.install(|| mpvo.sequence(&geometry, &view, Rule::Mpvo));
            let ms = start.elapsed().as_secs_f64() * 1e3;
            eprintln!("{name}: {} cells in {ms:.0} ms, {} cycles", sequence.cells.len(), sequence.cycles);
            assert_eq!(sequence.cycles, 0);
        }
    }
}

/// Meshes of the literature and of what other programs write, where they are at hand. Where cells overlap, no order is right.
#[test]
fn meshes_of_others_are_in_order() {
    let files = shared::meshes_in("data");
    if files.is_empty() {
        eprintln!("skipped: there are no shared meshes");
        return;
    }
    let (mut looked_at, mut left_out, mut overlapping) = (0, [0; 2], vec![]);
    for path in files {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let Some(geometry) = halite::io::open(&path, &|_| ()).ok().and_then(|mesh| geometry_of(&mesh)) else {
            left_out[0] += 1;
            continue;
        };
        if geometry.cells.is_empty() {
            left_out[1] += 1;
            continue;
        }
        looked_at += 1;
        let [low, high] = geometry.boundary.bounds();
        let radius = (high - low).length() / 2.0 / geometry.scale;
        let mut random = Random::of(&name);
        let projection = Projection::Perspective { view_angle: 35.0 };
        let position = geometry.centre + random.direction() * (3.0 * radius);
        let camera = Camera { position, focal_point: geometry.centre, view_up: random.direction(), projection };
        let view = View::new(camera, [64, 64]).unwrap();
        let (sequence, verdict) = checked(&geometry, &view, Rule::Mpvo);
        let depth = checked(&geometry, &view, Rule::Depth).1;
        eprintln!(
            "{name}: {} cells, {} pairs, {} inverted, {} overlap; by depth {} inverted, {} of {} pixels wrong; {} cycles, {} pixels \
             see a cut",
            geometry.cells.len(),
            verdict.pairs,
            verdict.inversions,
            verdict.overlaps,
            depth.inversions,
            depth.wrong.len(),
            depth.pixels,
            sequence.cycles,
            sequence.disordered.len(),
        );
        if verdict.overlaps > 0 {
            overlapping.push(name);
            continue;
        }
        assert!(sequence.cycles > 0 || verdict.inversions == 0, "{name}: {:?}", verdict.wrong);
        let told = |p: &u32| sequence.disordered.binary_search(p).is_ok();
        assert!(verdict.wrong.iter().all(told), "{name}: {:?}", verdict.wrong);
    }
    let [unread, flat] = left_out;
    eprintln!(
        "{looked_at} meshes, of which {} overlap: {}; left out: {unread} that cannot be read or split, {flat} without cells in space",
        overlapping.len(),
        overlapping.join(", ")
    );
    assert!(looked_at > 10 && 10 * overlapping.len() < looked_at);
}
