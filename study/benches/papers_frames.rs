//! Frame rates that the papers on pre-integrated tables report, measured again: `cargo bench --bench papers_frames`;
//! with `tiles` or `sorts` after that, one of them. Graphics cards of 2002 and whatever draws here are no match; what
//! one form takes beside another is.

#![allow(clippy::expect_used, clippy::print_stdout, reason = "tests fail by panicking")]

use glam::DVec3;
use halite::field::{Association, Component, Field};
use halite::gpu::DeviceChoice;
use halite::integral::options::{Form, IntegrationOptions, Planes, Texels};
use halite::integral::table::Kind;
use halite::mesh::{Array, Cells, Mesh, Values, cells::Tetrahedra};
use halite::project::{CellOrder, Fragments, ProjectionOptions, Target};
use halite::render::{Engine, Renderer};
use halite::transfer::TransferFunction;
use halite::view::{Camera, Projection, View};
use std::path::Path;
use std::time::Instant;

/// Frames of which the median is taken; of small pictures and of large ones.
const FRAMES: [usize; 2] = [9, 3];

fn main() {
    let chosen: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let wanted = |name: &str| chosen.is_empty() || chosen.iter().any(|c| name.contains(c.as_str()));
    let renderer = || Renderer::with_engine(0, DeviceChoice::Auto, Engine::Project).expect("a device that projects");
    println!("on {}\n", renderer().stats().adapter);
    if wanted("tiles") {
        tiles_against_volumes(renderer());
    }
    if wanted("sorts") {
        sorts_and_data(renderer());
    }
}

/// Frames in a second: the median. With `moving`, each from another side, so that cells are sorted anew.
fn rate(renderer: &mut Renderer, camera: impl Fn(f64) -> Camera, size: [u32; 2], moving: bool) -> f64 {
    let mut times: Vec<f64> = (0..=FRAMES[usize::from(moving)])
        .map(|i| {
            let view = View::new(camera(if moving { i as f64 } else { 0.0 }), size).expect("a view");
            let start = Instant::now();
            renderer.render(&view, &|_| ()).expect("a frame");
            start.elapsed().as_secs_f64()
        })
        .skip(1)
        .collect();
    times.sort_by(f64::total_cmp);
    1.0 / times[times.len() / 2]
}

/// From a ball of `radius` around `middle`, all of which is seen; each `step` turns by 10 degrees.
fn around(middle: DVec3, radius: f64, step: f64) -> Camera {
    let turn = (25.0 + 10.0 * step).to_radians();
    let direction = DVec3::new(turn.sin() * 0.9, turn.cos() * 0.9, 0.43);
    Camera {
        position: middle + direction * (radius * 4.2),
        focal_point: middle,
        view_up: DVec3::Z,
        projection: Projection::Perspective { view_angle: 30.0 },
    }
}

/// A ball of 2,560 tetrahedra: a sphere of 160 triangles, over its centre and in five layers of wedges. The scalar is
/// the distance from the centre.
fn distance_ball() -> Mesh {
    const ACROSS: usize = 16;
    const DOWN: usize = 6;
    const LAYERS: usize = 6;
    let per_layer = ACROSS * (DOWN - 1) + 2;
    let mut points = vec![DVec3::ZERO];
    for layer in 1..=LAYERS {
        let r = layer as f64 / LAYERS as f64;
        points.push(DVec3::Z * r);
        for j in 1..DOWN {
            let polar = std::f64::consts::PI * j as f64 / DOWN as f64;
            for i in 0..ACROSS {
                let turn = std::f64::consts::TAU * i as f64 / ACROSS as f64;
                points.push(DVec3::new(polar.sin() * turn.cos(), polar.sin() * turn.sin(), polar.cos()) * r);
            }
        }
        points.push(DVec3::NEG_Z * r);
    }
    let at = |j: usize, i: usize| match j {
        0 => 0,
        DOWN => per_layer - 1,
        _ => 1 + (j - 1) * ACROSS + i % ACROSS,
    };
    let mut triangles = vec![];
    for (j, i) in (0..DOWN).flat_map(|j| (0..ACROSS).map(move |i| (j, i))) {
        let [a, b, c, d] = [at(j, i), at(j + 1, i), at(j + 1, i + 1), at(j, i + 1)];
        if j + 1 < DOWN {
            triangles.push([a, b, c]);
        }
        if j > 0 {
            triangles.push([a, c, d]);
        }
    }
    let mut cells = Cells { offsets: vec![0], ..Cells::default() };
    let mut add = |vtk_type: u8, ids: &[usize]| {
        cells.types.push(vtk_type);
        cells.connectivity.extend(ids.iter().map(|&p| p as u32));
        cells.offsets.push(cells.connectivity.len() as u64);
    };
    for [a, b, c] in triangles {
        let of = |layer: usize| [a, b, c].map(|p| 1 + (layer - 1) * per_layer + p);
        let [p, q, r] = of(1);
        add(10, &[0, p, q, r]);
        for layer in 1..LAYERS {
            add(13, &[of(layer), of(layer + 1)].concat());
        }
    }
    let distance = points.iter().map(|p| p.length()).collect();
    let array = Array { name: "distance".into(), components: 1, values: Values::F64(distance) };
    Mesh::new(points, cells, vec![array], vec![]).expect("a mesh")
}

/// Röttger & Ertl 2002, table 8 (printed as figure 8).
fn tiles_against_volumes(mut renderer: Renderer) {
    let mesh = distance_ball();
    let tetrahedra = Tetrahedra::new(&mesh).expect("cells");
    println!("Röttger & Ertl 2002, table 8: a distance ball of {} tetrahedra, 512 x 384", tetrahedra.corners.len());
    renderer.set_tetrahedra(&mesh, tetrahedra);
    let field = Field::new(&mesh, "distance", Some(Association::Point), Component::Index(0)).expect("a field");
    renderer.set_field(&field).expect("a field");
    let band = |k: usize| {
        let color = if k.is_multiple_of(2) { [1.0, 0.5, 0.0] } else { [0.0, 0.3, 1.0] };
        [(k as f64 / 4.0, color), ((k + 1) as f64 / 4.0, color)]
    };
    let color = (0..4).flat_map(band).collect();
    renderer.set_transfer(&TransferFunction::new(color, vec![(0.0, 1.0)], 0.5).expect("a function"));
    let projection = ProjectionOptions::default().with_fragments(Fragments::Interpolated).with_target(Target::Rgba8);
    let texels = Texels::Unorm8;
    let volume =
        IntegrationOptions::of(Form::Volume).with_lengths(Kind::Uniform).with_table(Some([64; 3])).with_texels(texels);
    let tiles = |planes, per_cell| {
        IntegrationOptions::of(Form::Cylindrical)
            .with_planes(planes)
            .with_per_cell(per_cell)
            .with_table(Some([64; 3]))
            .with_texels(texels)
    };
    println!("  {:44} {:>8}", "", "frames/s");
    for (name, choice, projection) in [
        ("3D texture", volume, projection),
        ("tiles, two planes of each cell", tiles(Planes::Two, true), projection),
        ("tiles, one plane of each cell", tiles(Planes::One, true), projection),
        ("tiles, two planes of each fragment", tiles(Planes::Two, false), projection),
        ("tiles with two triangles", tiles(Planes::Packed, true), projection),
        ("exact", IntegrationOptions::default(), projection),
        ("exact, intersected, 32-bit floats", IntegrationOptions::default(), ProjectionOptions::default()),
    ] {
        renderer.set_projection(projection);
        renderer.set_integral(choice);
        let rate = rate(&mut renderer, |_| around(DVec3::ZERO, 1.0, 0.0), [512, 384], false);
        println!("  {name:44} {rate:>8.1}");
    }
    println!(
        "  reported, 3D texture against tiles: GeForce3 47.6 and 79.0, Radeon 7200 13.0 and 30.6, Radeon 8500 33.8"
    );
    println!("  and 38.2, Octane MXI 8.5 and 12.7, Octane2 V8 11.4 and 32.2, Onyx 3000 11.3 and 24.1\n");
}

/// Guthe et al. 2002, table 5.
fn sorts_and_data(mut renderer: Renderer) {
    println!("Guthe et al. 2002, table 5: polynomials of degree 2, 1280 x 960, each frame from another side");
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/papers");
    for (name, file, array, reported) in [
        (
            "Blunt Fin",
            "bluntfin_tet5.vtu",
            "Density",
            "187k: 3.18, 2.64 and 2.35 (GeForce4), 2.51, 2.20 and 1.99 (Radeon 8500)",
        ),
        (
            "Bucky Ball",
            "bucky32_tet5.vtu",
            "density",
            "177k: 2.46, 2.19 and 2.05 (GeForce4), 2.09, 1.98 and 1.87 (Radeon 8500)",
        ),
    ] {
        let path = folder.join(file);
        if !path.exists() {
            println!("  skipped: there is no {}", path.display());
            continue;
        }
        let mesh = halite::io::open(&path, &|_| ()).expect("a mesh");
        let tetrahedra = Tetrahedra::new(&mesh).expect("cells");
        let count = tetrahedra.corners.len();
        let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (low, high) = mesh.points().iter().fold(none, |(l, h), &p| (l.min(p), h.max(p)));
        renderer.set_tetrahedra(&mesh, tetrahedra);
        let field = Field::new(&mesh, array, Some(Association::Point), Component::Index(0)).expect("a field");
        let [least, most] = field.range(0);
        renderer.set_field(&field).expect("a field");
        let at = |x: f64| least + (most - least) * x;
        let color = vec![(at(0.0), [0.1, 0.2, 0.9]), (at(0.4), [0.9, 0.9, 0.2]), (at(1.0), [0.9, 0.1, 0.1])];
        let opacity = vec![(at(0.0), 0.0), (at(0.3), 0.1), (at(0.45), 0.6), (at(0.6), 0.1), (at(1.0), 0.8)];
        let unit = (high - low).length() / 10.0;
        renderer.set_transfer(&TransferFunction::new(color, opacity, unit).expect("a function"));
        renderer.set_integral(IntegrationOptions::of(Form::Polynomial));
        println!("  {name}, {count} tetrahedra");
        let mut numeric = None;
        for (sort, order) in [
            ("by depth (numeric)", CellOrder::Depth),
            ("MPVO", CellOrder::MpvoConvex),
            ("XMPVO", CellOrder::Xmpvo),
            ("mpvo, Halite's own", CellOrder::Mpvo),
            ("by circumspheres", CellOrder::Circumsphere),
            ("none", CellOrder::None),
        ] {
            let projection = ProjectionOptions::default().with_order(order).with_fragments(Fragments::Interpolated);
            renderer.set_projection(projection);
            let camera = |step: f64| around(low.midpoint(high), (high - low).length() / 2.0, step);
            let rate = rate(&mut renderer, camera, [1280, 960], true);
            let ratio = *numeric.get_or_insert(rate) / rate;
            println!("    {sort:42} {rate:>8.2}, frames take {ratio:.2} times the numeric ones'");
        }
        println!("    reported for numeric, MPVO and XMPVO sorting, {reported}");
    }
}
