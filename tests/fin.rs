//! A structured grid is a mesh of hexahedra: the blunt fin, where it is at hand, as either.

#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "a test tells what it saw")]

use glam::DVec3;
use halite::field::{Component, Field};
use halite::gpu::DeviceChoice;
use halite::image::Image;
use halite::mesh::cells::Tetrahedra;
use halite::mesh::{Mesh, Values};
use halite::render::{Engine, Renderer};
use halite::scene::automatic;
use halite::transfer::TransferFunction;
use halite::view::{Projection, View};
use std::fmt::Write;
use std::path::Path;

/// Points along each axis.
const SIZE: [usize; 3] = [40, 32, 32];

/// The same points and values as a structured grid's file.
fn written(mesh: &Mesh, values: &[f32]) -> String {
    let extent = SIZE.map(|n| format!("0 {}", n - 1)).join(" ");
    let mut text = format!(
        "<VTKFile type=\"StructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\"><StructuredGrid WholeExtent=\"{extent}\">\
         <Piece Extent=\"{extent}\"><PointData><DataArray type=\"Float32\" Name=\"Density\" format=\"ascii\">"
    );
    values.iter().for_each(|v| write!(text, "{v} ").unwrap());
    text += "</DataArray></PointData><CellData/><Points>\
             <DataArray type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\" format=\"ascii\">";
    mesh.points().iter().for_each(|p| write!(text, "{} {} {} ", p.x, p.y, p.z).unwrap());
    text + "</DataArray></Points></Piece></StructuredGrid></VTKFile>"
}

fn draw(mesh: &Mesh, engine: Engine) -> Image {
    let field = Field::new(mesh, "Density", None, Component::Index(0)).unwrap();
    let tetrahedra = Tetrahedra::new(mesh).unwrap();
    let mut camera = automatic::camera(mesh, &tetrahedra, Some(&field), [160, 120]);
    camera.position += DVec3::new(0.7, -1.1, 0.4);
    camera.projection = Projection::Perspective { view_angle: 30.0 };
    let color = vec![(0.2, [0.1, 0.3, 0.9]), (2.0, [0.9, 0.8, 0.2]), (4.9, [0.9, 0.1, 0.1])];
    let transfer = TransferFunction::new(color, vec![(0.2, 0.0), (1.1, 0.3), (1.3, 0.02), (4.9, 1.0)], 0.8).unwrap();
    let mut renderer = Renderer::with_engine(2, DeviceChoice::Cpu, engine).unwrap();
    renderer.set_tetrahedra(mesh, tetrahedra);
    renderer.set_field(&field).unwrap();
    renderer.set_transfer(&transfer);
    renderer.render(&View::new(camera, [160, 120]).unwrap(), &|_| ()).unwrap()
}

#[test]
fn a_structured_grid_is_drawn_bit_for_bit_as_its_hexahedra() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/papers/bluntfin_hex.vtu");
    let Ok(hexahedra) = halite::io::open(&path, &|_| ()) else {
        return eprintln!("skipped: there is no ../shared/data/papers/bluntfin_hex.vtu");
    };
    assert_eq!(hexahedra.points().len(), SIZE.iter().product::<usize>());
    let array = hexahedra.point_arrays().iter().find(|a| a.name == "Density").unwrap();
    let Values::F32(values) = &array.values else { unreachable!("the density is of 32 bits") };
    let file = tempfile::Builder::new().suffix(".vts").tempfile().unwrap();
    std::fs::write(file.path(), written(&hexahedra, values)).unwrap();
    let structured = halite::io::open(file.path(), &|_| ()).unwrap();
    assert!(structured.cells().types.iter().all(|t| *t == 12));
    for engine in [Engine::Traverse, Engine::Project] {
        let [got, want] = [&structured, &hexahedra].map(|mesh| draw(mesh, engine));
        assert!(want.pixels.iter().any(|p| p[3] > 0.5), "nothing is seen");
        let bits = |image: &Image| image.pixels.as_flattened().iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&got), bits(&want), "{engine:?}");
    }
}
