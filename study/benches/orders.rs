//! How long the order of a whole mesh takes, at 512 x 512 pixels on two threads: `cargo bench --bench orders`; with `small` after that
//! the meshes of 1.3 million cells alone, with `large` those of 10 million, with `threads=N` on N threads.
//!
//! Convex meshes, and any by shared faces alone, need no edges of the boundary; those with holes and parts need them. The device draws
//! its cells in this order; what a frame takes besides is reported by `halite bench --engine project --views 8`: `order_ms` in its JSON.

#![allow(clippy::expect_used, clippy::print_stdout, reason = "tests fail by panicking")]

use glam::{DVec3, dvec3};
use halite::geometry::TetMesh;
use halite::mesh::{Mesh, cells::Tetrahedra, faces::Faces, generate};
use halite::order::mpvo::{Mpvo, Rule};
use halite::view::{Camera, Projection, View};
use std::time::Instant;

/// Views, all around, of which the median and the longest time are printed.
const VIEWS: u32 = 9;

/// Points along each axis of the convex meshes and of those with holes, of about 1.3 and 10 million cells.
const SIZES: [(&str, [usize; 2]); 2] = [("small", [61, 67]), ("large", [119, 131])];

fn main() {
    let said: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let threads = said.iter().find_map(|a| a.strip_prefix("threads=")?.parse().ok()).unwrap_or(2);
    let sizes: Vec<&str> = said.iter().map(String::as_str).filter(|a| !a.starts_with("threads=")).collect();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    println!(
        "{threads} threads, 512 x 512 pixels, {VIEWS} views: ms, the median, the longest, and of all processors on average\n"
    );
    println!("{:28} {:>10}  {:24} {:>8} {:>8} {:>10}", "mesh", "cells", "edges", "median", "longest", "processors");
    for (_, [convex, holes]) in SIZES.into_iter().filter(|(name, _)| sizes.is_empty() || sizes.contains(name)) {
        pool.install(|| measure("box", &generate::tetrahedra(convex)));
        pool.install(|| measure("parts, a tunnel, a cavity", &generate::islands(holes)));
    }
}

fn measure(name: &str, mesh: &Mesh) {
    let geometry = {
        let tetrahedra = Tetrahedra::new(mesh).expect("cells");
        let points = tetrahedra.points(mesh.points());
        TetMesh::new(&points, &tetrahedra, &Faces::new(&points, &tetrahedra.corners))
    };
    for (edges, rule) in [("shared faces", Rule::Faces), ("and of the boundary", Rule::Mpvo)] {
        let mut mpvo = Mpvo::default();
        // Whether the mesh is convex is found once.
        let start = Instant::now();
        let first = mpvo.sequence(&geometry, &view(0), rule);
        let first_ms = start.elapsed().as_secs_f64() * 1e3;
        let before = processor_ms();
        let mut times: Vec<f64> = (1..=VIEWS)
            .map(|i| {
                let view = view(i);
                let start = Instant::now();
                std::hint::black_box(mpvo.sequence(&geometry, &view, rule));
                start.elapsed().as_secs_f64() * 1e3
            })
            .collect();
        let processors = processor_ms()
            .zip(before)
            .map_or("-".into(), |(after, before)| format!("{:.1}", (after - before) / f64::from(VIEWS)));
        times.sort_by(f64::total_cmp);
        let (median, longest) = (times[times.len() / 2], times[times.len() - 1]);
        let needed = if rule == Rule::Mpvo && mpvo.is_convex() { "(convex: none of those)" } else { edges };
        println!(
            "{name:28} {:>10}  {needed:24} {median:>8.1} {longest:>8.1} {processors:>10}   the first {first_ms:.1}",
            first.cells.len()
        );
    }
}

/// What all threads of this process have computed for, in steps of 10 ms; `None` where the system does not say.
fn processor_ms() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    let mut ticks = stat.rsplit_once(')')?.1.split_whitespace().skip(11).map(|n| n.parse::<f64>().ok());
    Some(10.0 * (ticks.next()?? + ticks.next()??))
}

/// From one side or another, so that all of the mesh is seen.
fn view(i: u32) -> View {
    let turn = f64::from(i) * 0.7;
    let camera = Camera {
        position: dvec3(turn.cos() * 4.3, (1.7 * turn).sin() * 2.0, turn.sin() * 4.3),
        focal_point: DVec3::ZERO,
        view_up: DVec3::Y,
        projection: Projection::Perspective { view_angle: 35.0 },
    };
    View::new(camera, [512, 512]).expect("a view")
}
