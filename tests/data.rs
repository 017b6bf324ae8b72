//! Real meshes, where they are at hand: those that fill a box exactly are seen to.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::print_stderr, reason = "a test tells what it saw")]

mod common;

use common::draw::Random;
use common::shared::meshes_in;
use common::{Engine, Scene, rounds};
use glam::{DVec3, dvec3};
use halite::field::Association;
use halite::mesh::cells::Tetrahedra;
use halite::mesh::faces::Faces;
use halite::mesh::{Array, Mesh, Values};
use halite::transfer::TransferFunction;
use halite::view::{Camera, Projection, Ray, View};

/// Meshes of more tetrahedra are left to the eye.
const MOST: usize = 600_000;

/// The length of a ray in a box.
fn chord(ray: &Ray, [low, high]: [DVec3; 2]) -> f64 {
    let (a, b) = ((low - ray.origin) / ray.direction, (high - ray.origin) / ray.direction);
    (a.max(b).min_element() - a.min(b).max_element().max(0.0)).max(0.0)
}

fn volume([low, high]: [DVec3; 2]) -> f64 {
    (high - low).element_product()
}

fn bounds(points: impl Iterator<Item = DVec3>) -> [DVec3; 2] {
    points.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[l, h], p| [l.min(p), h.max(p)])
}

/// The box that the mesh fills, and the one that is left out of it, if it does.
fn boxes(mesh: &Mesh, tetrahedra: &Tetrahedra) -> Option<[[DVec3; 2]; 2]> {
    let points = tetrahedra.points(mesh.points());
    let place = |p: &u32| points[*p as usize];
    let outer = bounds(tetrahedra.corners.iter().flatten().map(place));
    let six = |t: &[u32; 4]| {
        let [a, b, c, d] = t.map(|p| place(&p) - outer[0]);
        (b - a).cross(c - a).dot(d - a).abs()
    };
    let filled = tetrahedra.corners.iter().map(six).sum::<f64>() / 6.0;
    let size = (outer[1] - outer[0]).max_element();
    let faces = Faces::new(&points, &tetrahedra.corners);
    let on_wall = |corners: &[DVec3; 3]| {
        let near = |c: &DVec3, k: usize, wall: f64| (c[k] - wall).abs() < 1e-9 * size;
        (0..3).any(|k| outer.iter().any(|wall| corners.iter().all(|c| near(c, k, wall[k]))))
    };
    let corners = |face: &(u32, u8)| faces.outward(&tetrahedra.corners, *face).map(|p| place(&p));
    let inner = faces.boundary.iter().map(corners).filter(|c| !on_wall(c)).flatten();
    let inner = bounds(inner);
    let left_out = if inner[0].x > inner[1].x { [outer[0]; 2] } else { inner };
    let fits = (filled - (volume(outer) - volume(left_out))).abs() <= 1e-9 * volume(outer);
    (fits && volume(outer) > 0.0).then_some([outer, left_out])
}

/// Where cells of any kind fill a box, and polyhedra of adaptive meshes do, what a ray covers is the chord of the box.
#[test]
fn covered_length_is_the_chord_of_the_box() {
    let (mut found, mut seen) = (vec![], 0);
    for path in meshes_in("data") {
        let Ok(mesh) = halite::io::open(&path, &|_| ()) else { continue };
        seen += 1;
        let Ok(tetrahedra) = Tetrahedra::new(&mesh) else { continue };
        if tetrahedra.corners.len() > MOST {
            continue;
        }
        let Some([outer, left_out]) = boxes(&mesh, &tetrahedra) else { continue };
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let size = (outer[1] - outer[0]).length();
        let mut random = Random::of(&name);
        let mesh = Mesh::new(mesh.points().to_vec(), mesh.cells().clone(), vec![], vec![]).unwrap();
        let array = Array { name: "one".into(), components: 1, values: Values::F32(vec![1.0; mesh.points().len()]) };
        let field =
            halite::field::Field::from_array(&array, Association::Point, halite::field::Component::Index(0)).unwrap();
        let even = |v: f64| vec![(0.0, v), (2.0, v)];
        let colors = vec![(0.0, [1.0; 3]), (2.0, [1.0; 3])];
        let transfer = TransferFunction::new(colors, even(1.0), size / 2.0).unwrap();
        let scene = Scene { mesh, tetrahedra, field, transfer };
        let mut worst = 0.0f64;
        let mut views = vec![];
        for round in 0..rounds(2).min(6) {
            let projection = match round % 2 {
                0 => Projection::Perspective { view_angle: 28.0 },
                _ => Projection::Parallel { parallel_scale: 0.5 * size },
            };
            let middle = outer[0].midpoint(outer[1]);
            let camera = Camera {
                position: middle + random.direction() * (1.3 * size),
                focal_point: middle + dvec3(0.01, -0.02, 0.013) * size,
                view_up: random.direction(),
                projection,
            };
            views.push(View::new(camera, [48, 36]).unwrap());
        }
        for (view, image) in views.iter().zip(Engine::Twin { threads: 2 }.draw(&scene, &views)) {
            for (i, pixel) in image.pixels.iter().enumerate() {
                let ray = view.ray(i as u32 % 48, i as u32 / 48);
                let covered = -f64::from(1.0 - pixel[3]).ln() * size / 2.0;
                let expected = chord(&ray, outer) - chord(&ray, left_out);
                worst = worst.max((covered - expected).abs() / size);
            }
        }
        eprintln!("{worst:.1e} {name}");
        found.push((worst, name));
    }
    if seen == 0 {
        return eprintln!("skipped: there is no ../shared/data");
    }
    let missed: Vec<_> = found.iter().filter(|f| f.0.is_nan() || f.0 > 1e-5).collect();
    assert!(missed.is_empty(), "of {}: {missed:?}", found.len());
    assert!(found.len() >= 10 && found.iter().any(|f| f.1 == "of_dambreak_amr.vtu"), "{found:?}");
}
