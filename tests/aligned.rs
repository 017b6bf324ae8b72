//! Rays that run exactly through vertices, edges and faces: in an even medium each must see the chord of the box that
//! the mesh fills, whichever cells it touches on the way. A ray that slips between two cells, or counts one twice,
//! shows.

#![allow(clippy::expect_used, clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use common::draw::{Random, moved};
use common::{ENGINES, Engine, Report, Scene, rounds};
use glam::{DVec2, DVec3, dvec2, dvec3};
use halite::field::Association;
use halite::mesh::{Array, Mesh, Values, generate};
use halite::render;
use halite::transfer::TransferFunction;
use halite::view::{Camera, Projection, Ray, View};

/// Extinction of the medium: the longest chord has a depth of 1.7, where f32 still tells lengths to 1e-6.
const EXTINCTION: f64 = 0.5;

/// Of a length, where the mesh is 2 wide.
const BOUND: f64 = 1e-5;

/// `mesh` with its points at multiples of 1/8, filled with an even medium.
fn even(mesh: &Mesh) -> Scene {
    let mesh = moved(mesh, |p| (p * 8.0).round() / 8.0);
    let array = Array { name: "one".into(), components: 1, values: Values::F64(vec![1.0; mesh.points().len()]) };
    let transfer = TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, EXTINCTION)], 1.0).expect("a function");
    Scene::new(&mesh, array, Association::Point, |_| transfer)
}

/// Lattices with lines at multiples of 1/2, and the half size of the box that they fill.
fn lattices() -> Vec<(&'static str, Scene, DVec3)> {
    let block = dvec3(1.0, 0.5, 0.5);
    vec![
        ("tetrahedra", even(&generate::tetrahedra(5)), DVec3::ONE),
        ("hexahedra", even(&generate::hexahedra(5)), DVec3::ONE),
        ("wedges", even(&generate::wedges(5)), DVec3::ONE),
        ("pyramids", even(&generate::pyramids(5)), DVec3::ONE),
        ("mixed", even(&generate::mixed(5)), DVec3::ONE),
        ("unwelded", even(&generate::unwelded(&generate::mixed(5))), DVec3::ONE),
        ("t-junction", even(&generate::t_junction(2)), block),
        ("finer t-junction", even(&generate::t_junction(4)), block),
    ]
}

/// How far `ray` is inside the box [−half, half].
fn chord(ray: &Ray, half: DVec3) -> f64 {
    let [mut t0, mut t1] = [ray.t_min, ray.t_max];
    for axis in 0..3 {
        let (at, slope) = (ray.origin[axis], ray.direction[axis]);
        if slope == 0.0 {
            if at.abs() > half[axis] {
                return 0.0;
            }
        } else {
            let [a, b] = [-1.0, 1.0].map(|side| (side * half[axis] - at) / slope);
            (t0, t1) = (t0.max(a.min(b)), t1.min(a.max(b)));
        }
    }
    (t1 - t0).max(0.0)
}

/// Holds every pixel's length to the chord of its ray. One in the box's own side may see that side's cells or nothing.
/// With 32 bits, lengths may be anything that the box's sides leave where they are known as well as that.
fn hold(report: &mut Report, engines: &[Engine], case: &str, (scene, half): (&Scene, DVec3), views: &[(String, View)]) {
    let only: Vec<View> = views.iter().map(|v| v.1.clone()).collect();
    for engine in engines {
        for (image, (name, view)) in engine.draw(scene, &only).iter().zip(views) {
            let [w, h] = view.size();
            let pixels = (0..h).flat_map(|j| (0..w).map(move |i| [i, j]));
            let error = |[i, j]: [u32; 2]| {
                let length = -(1.0 - f64::from(image.pixels[(j * w + i) as usize][3])).ln() / EXTINCTION;
                let around = |e: f64| [-e, e].map(|e| chord(&view.ray(i, j), half + e));
                let [less, more] = around(1e-8).map(|c| (length - c).abs());
                let [least, most] = around(1e-6);
                let error = match engine {
                    Engine::Device(_) => (least - length).max(length - most).max(0.0),
                    _ => less.min(more),
                };
                (error, [i, j], length, around(1e-8)[1])
            };
            let worst = pixels.map(error).max_by(|a, b| a.0.total_cmp(&b.0)).expect("there are pixels");
            let (error, at, length, expected) = worst;
            report.measure(&format!("{engine:?}, {case}, {name}"), error, BOUND, || {
                format!("the ray of pixel {at:?} sees {length} of {expected}: {:?}", view.ray(at[0], at[1]))
            });
        }
    }
}

fn view([position, focal_point, view_up]: [DVec3; 3], projection: Projection, offset: DVec2) -> View {
    let camera = Camera { position, focal_point, view_up, projection };
    View::new(camera, [16, 16]).expect("a view").with_pixel_offset(offset)
}

const AXES: [DVec3; 3] = [DVec3::X, DVec3::Y, DVec3::Z];

/// Parallel rays along axes and diagonals, on and beside the lattice's lines and diagonals.
fn parallel_views() -> Vec<(String, View)> {
    let mut directions: Vec<(DVec3, DVec3)> = Vec::new();
    for (k, axis) in AXES.into_iter().enumerate() {
        let [next, last] = [AXES[(k + 1) % 3], AXES[(k + 2) % 3]];
        for sign in [1.0, -1.0] {
            directions.extend([(axis * sign, next), (axis * sign, last - next), (next + last * sign, axis)]);
            directions.push((DVec3::ONE - axis * (1.0 - sign), next - last * sign));
        }
    }
    let mut views = Vec::new();
    for (along, up) in directions {
        for (offset, scale) in [(0.5, 1.0), (0.5, 2.0), (0.0, 1.0), (0.0, 0.5_f64.sqrt())] {
            let name = format!("along {along}, offset {offset}, scale {scale}");
            let projection = Projection::Parallel { parallel_scale: scale };
            views.push((name, view([-4.0 * along, DVec3::ZERO, up], projection, DVec2::splat(offset))));
        }
    }
    views
}

/// Rays that fan out from vertices, edges and faces of the lattice, inside and outside.
fn perspective_views() -> Vec<(String, View)> {
    let eyes = [
        DVec3::ZERO,
        dvec3(0.5, 0.0, -0.5),
        dvec3(0.25, 0.5, 0.0),
        dvec3(0.25, 0.25, 0.5),
        dvec3(0.25, 0.25, 0.25),
        dvec3(1.0, 0.0, 0.0),
        dvec3(-1.0, 0.5, 0.5),
        dvec3(2.0, 0.0, 0.0),
        dvec3(0.5, 0.5, 3.0),
        dvec3(2.0, 2.0, 2.0),
    ];
    let mut views = Vec::new();
    for eye in eyes {
        for (along, up) in [(-DVec3::X, DVec3::Z), (-DVec3::Z, DVec3::Y), (-DVec3::ONE, DVec3::Y), (DVec3::X, DVec3::Y)]
        {
            for offset in [0.5, 0.0] {
                let projection = Projection::Perspective { view_angle: 90.0 };
                let name = format!("from {eye} along {along}, offset {offset}");
                views.push((name, view([eye, eye + along, up], projection, DVec2::splat(offset))));
            }
        }
    }
    views
}

#[test]
fn parallel_rays_through_lattice_lines_lose_nothing() {
    let mut report = Report::default();
    for (name, scene, half) in lattices() {
        hold(&mut report, ENGINES, name, (&scene, half), &parallel_views());
    }
    report.finish("parallel");
}

#[test]
fn fans_from_lattice_points_lose_nothing() {
    let mut report = Report::default();
    for (name, scene, half) in lattices() {
        hold(&mut report, ENGINES, name, (&scene, half), &perspective_views());
    }
    report.finish("perspective");
}

/// Faces that lie beside one another without being shared: rounding must not open a gap between them.
#[test]
fn t_junctions_hold_light_from_everywhere() {
    let mut report = Report::default();
    for n in [1, 2, 4] {
        let scene = even(&generate::t_junction(n));
        let views: Vec<_> = (0..rounds(20))
            .map(|i| {
                let mut r = Random::of(&format!("t-junction {n}, {i}"));
                // Looks at a point of the common plane, where corners of the one block lie in faces of the other.
                let on_plane = dvec3(0.0, r.below(5) as f64 / 8.0 - 0.25, r.below(5) as f64 / 8.0 - 0.25);
                let at = on_plane + r.direction() * 3.0;
                let projection = Projection::Perspective { view_angle: 5.0 };
                (format!("view {i}"), view([at, on_plane, r.direction()], projection, dvec2(0.5, 0.5)))
            })
            .collect();
        hold(&mut report, ENGINES, &format!("n = {n}"), (&scene, dvec3(1.0, 0.5, 0.5)), &views);
    }
    report.finish("t-junction");
}

/// Devices have 32 bits, and see all of it too. Of two projected cells that share a face in which a ray lies, one is met;
/// in an even medium their order does not matter.
#[test]
fn devices_lose_nothing_either() {
    let mut report = Report::default();
    let views: Vec<_> = parallel_views().into_iter().chain(perspective_views()).collect();
    let engines = [render::Engine::Traverse, render::Engine::Project].map(Engine::Device);
    for (name, scene, half) in lattices() {
        hold(&mut report, &engines, name, (&scene, half), &views);
    }
    report.finish("devices");
}

/// The reference is held to the same: what it says of rays in faces is no guess.
#[test]
fn the_judge_loses_nothing_either() {
    let mut report = Report::default();
    let (parallel, fans) = (parallel_views(), perspective_views());
    for (name, scene, half) in lattices() {
        let some: Vec<_> = parallel.iter().chain(&fans).step_by(7).cloned().collect();
        hold(&mut report, &[Engine::Reference], name, (&scene, half), &some);
    }
    report.finish("reference");
}
