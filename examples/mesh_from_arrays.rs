//! Draws a mesh that a program has in its own arrays: `cargo run --release --example mesh_from_arrays -- PICTURE.png`

use glam::DVec3;
use halite::field::{Component, Field};
use halite::image::Backdrop;
use halite::mesh::{Array, Cells, Mesh, Values};
use halite::render::Renderer;
use halite::transfer::TransferFunction;
use halite::view::{Camera, Projection, View};
use std::path::Path;

/// VTK's number of a hexahedron (`vtkCellType.h`).
const HEXAHEDRON: u8 = 12;

/// Bricks along each axis.
const SIDE: u32 = 8;

/// A cube of bricks: their corners, and which corners each brick has, in VTK's order.
fn bricks() -> (Vec<DVec3>, Vec<u32>) {
    let n = SIDE + 1;
    let lattice = |n: u32| (0..n * n * n).map(move |i| [i % n, i / n % n, i / n / n]);
    let points = lattice(n).map(|place| DVec3::from(place.map(f64::from)) / f64::from(SIDE)).collect();
    let corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
    let ids = lattice(SIDE).flat_map(|[i, j, k]| corners.map(|[a, b, c]| i + a + n * (j + b + n * (k + c))));
    (points, ids.collect())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let picture = std::env::args().nth(1).ok_or("usage: mesh_from_arrays PICTURE.png")?;

    let (points, connectivity) = bricks();
    let count = connectivity.len() / 8;
    let cells =
        Cells { types: vec![HEXAHEDRON; count], offsets: (0..=count as u64).map(|i| 8 * i).collect(), connectivity };
    // The distance from the middle, at each point.
    let distance = points.iter().map(|p| p.distance(DVec3::splat(0.5)) as f32).collect();
    let array = Array { name: "distance".into(), components: 1, values: Values::F32(distance) };
    let mesh = Mesh::new(points, cells, vec![array], vec![])?;

    let color = vec![(0.0, [1.0, 0.8, 0.3]), (0.5, [0.2, 0.4, 0.9])];
    let opacity = vec![(0.1, 1.0), (0.2, 0.0), (0.35, 0.0), (0.4, 0.8), (0.45, 0.0)];
    let camera = Camera {
        position: DVec3::new(2.5, 1.8, 3.0),
        focal_point: DVec3::splat(0.5),
        view_up: DVec3::Y,
        projection: Projection::Perspective { view_angle: 25.0 },
    };

    let mut renderer = Renderer::new(0)?;
    renderer.set_mesh(&mesh)?;
    renderer.set_field(&Field::new(&mesh, "distance", None, Component::Magnitude)?)?;
    // Opacities count per 0.1 of length.
    renderer.set_transfer(&TransferFunction::new(color, opacity, 0.1)?);
    let image = renderer.render(&View::new(camera, [640, 480])?, &|_| ())?;
    Ok(image.save(Path::new(&picture), Backdrop::Color([0.1; 3]))?)
}
