//! Each stage of the pipeline by itself: `cargo bench`, or `cargo bench -- faces` for one. `halite bench` measures
//! whole frames of real meshes.

#![allow(clippy::expect_used, reason = "a benchmark that cannot start has nothing to tell")]

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use halite::engine::Engine;
use halite::field::{Component, Field, Kind, Normalization};
use halite::geometry::TetMesh;
use halite::gpu::{self, DeviceChoice};
use halite::integral::{Exact, Light};
use halite::mesh::{Mesh, cells::Tetrahedra, faces::Faces, generate};
use halite::order::mpvo::{Mpvo, Rule};
use halite::render::Renderer;
use halite::transfer::{Convention, TransferFunction};
use halite::view::{Camera, Projection, View};
use std::hint::black_box;
use std::io::Write;

/// 6 · 30³ = 162,000 tetrahedra.
const SIDE: usize = 30;

fn transfer(convention: Convention) -> TransferFunction {
    let color = vec![(-1.0, [0.1, 0.2, 0.9]), (0.0, [0.9, 0.9, 0.2]), (1.0, [0.9, 0.1, 0.1])];
    let opacity = vec![(-1.0, 0.0), (-0.2, 0.1), (0.1, 0.9), (0.3, 0.0), (1.0, 0.3)];
    TransferFunction::new(color, opacity, 0.5).expect("a valid function").with_convention(convention)
}

/// The mesh as an uncompressed .vtu, its arrays appended raw.
fn vtu(mesh: &Mesh) -> Vec<u8> {
    let cells = mesh.cells();
    let points = mesh.points().iter().flat_map(DVec3::to_array).flat_map(f64::to_le_bytes).collect::<Vec<u8>>();
    let ids = cells.connectivity.iter().flat_map(|&p| u64::from(p).to_le_bytes()).collect::<Vec<u8>>();
    let ends = (1..=cells.len() as u64).flat_map(|c| (4 * c).to_le_bytes()).collect::<Vec<u8>>();
    let types = vec![10u8; cells.len()];
    let mut offset = 0;
    let mut array = |head: &str, bytes: &[u8]| {
        let text = format!("<DataArray {head} format=\"appended\" offset=\"{offset}\"/>");
        offset += 8 + bytes.len();
        text
    };
    let head = [
        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">",
        &format!(
            "<UnstructuredGrid><Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\"><Points>",
            mesh.points().len(),
            cells.len()
        ),
        &array("type=\"Float64\" NumberOfComponents=\"3\"", &points),
        "</Points><Cells>",
        &array("type=\"Int64\" Name=\"connectivity\"", &ids),
        &array("type=\"Int64\" Name=\"offsets\"", &ends),
        &array("type=\"UInt8\" Name=\"types\"", &types),
        "</Cells></Piece></UnstructuredGrid><AppendedData encoding=\"raw\">_",
    ]
    .concat();
    let mut file = head.into_bytes();
    for bytes in [points, ids, ends, types] {
        file.extend((bytes.len() as u64).to_le_bytes());
        file.extend(bytes);
    }
    file.extend(b"</AppendedData></VTKFile>");
    file
}

fn before_drawing(c: &mut Criterion) {
    let mesh = generate::tetrahedra(SIDE);
    let bytes = vtu(&mesh);
    let mut file = tempfile::Builder::new().suffix(".vtu").tempfile().expect("a temporary file");
    file.write_all(&bytes).expect("room for a temporary file");
    let mut group = c.benchmark_group("before drawing");
    group.sample_size(20).throughput(Throughput::Elements(mesh.cells().len() as u64));
    group.bench_function("read", |b| b.iter(|| halite::io::open(file.path(), &|_| ()).expect("a readable file")));
    let hexahedra = generate::hexahedra(SIDE);
    group.bench_function("split hexahedra", |b| b.iter(|| Tetrahedra::new(&hexahedra).expect("cells")));
    let tetrahedra = Tetrahedra::new(&mesh).expect("cells");
    group.bench_function("faces", |b| b.iter(|| Faces::new(mesh.points(), &tetrahedra.corners)));
    let faces = Faces::new(mesh.points(), &tetrahedra.corners);
    group.bench_function("geometry", |b| b.iter(|| TetMesh::new(mesh.points(), &tetrahedra, &faces)));
    group.finish();
}

fn integral(c: &mut Criterion) {
    let normal = [Normalization { mid: 0.0, half: 1.0 }; 4];
    let mut group = c.benchmark_group("integral");
    for convention in [Convention::Extinction, Convention::Opacity] {
        let transfer = transfer(convention);
        group.bench_function(format!("knots, {convention:?}"), |b| {
            b.iter(|| Exact::<f32>::new(black_box(&transfer), Kind::Scalar, &normal, 1.0));
        });
    }
    let exact = Exact::<f32>::new(&transfer(Convention::Extinction), Kind::Scalar, &normal, 1.0);
    let values: Vec<f32> = (0..1000).map(|i| (i as f32 * 0.61).sin()).collect();
    group.throughput(Throughput::Elements(values.len() as u64 - 1));
    group.bench_function("segments", |b| {
        b.iter_batched(
            Light::none,
            |mut light| {
                values.windows(2).for_each(|v| exact.add(&[v[0]], &[v[1]], 1e-4, &mut light));
                light
            },
            BatchSize::SmallInput,
        );
    });
    group.finish();
}

fn view() -> View {
    let camera = Camera {
        position: DVec3::new(3.0, 2.5, 2.0),
        focal_point: DVec3::ZERO,
        view_up: DVec3::Z,
        projection: Projection::Perspective { view_angle: 40.0 },
    };
    View::new(camera, [256, 256]).expect("a valid view")
}

/// The visibility order of a whole mesh, as devices draw it; `cargo bench --bench orders` has larger ones.
fn order(c: &mut Criterion) {
    let mesh = generate::tetrahedra(SIDE);
    let tetrahedra = Tetrahedra::new(&mesh).expect("cells");
    let geometry = TetMesh::new(mesh.points(), &tetrahedra, &Faces::new(mesh.points(), &tetrahedra.corners));
    let mut group = c.benchmark_group("order");
    group.sample_size(20).throughput(Throughput::Elements(mesh.cells().len() as u64));
    for (name, rule) in [("shared faces", Rule::Faces), ("and of the boundary", Rule::Mpvo)] {
        let (mut mpvo, view) = (Mpvo::default(), view());
        group.bench_function(name, |b| b.iter(|| black_box(mpvo.sequence(&geometry, &view, rule))));
    }
    group.finish();
}

/// Frames, by every engine on every device.
fn frames(c: &mut Criterion) {
    let mesh = generate::tetrahedra(SIDE);
    let mut group = c.benchmark_group("frame");
    group.sample_size(10);
    let devices = gpu::devices().into_iter().filter(|d| d.lacks.is_none());
    let named = devices.map(|d| (d.name, DeviceChoice::Named(d.index.to_string())));
    for (device, choice) in [("cpu".to_owned(), DeviceChoice::Cpu)].into_iter().chain(named) {
        for (name, engine) in [("walk", Engine::Traverse), ("projection", Engine::Project)] {
            let mut renderer = Renderer::with_engine(0, choice.clone(), engine).expect("a device");
            renderer.set_mesh(&mesh).expect("cells");
            renderer.set_field(&Field::new(&mesh, "s", None, Component::All).expect("a field")).expect("a field");
            renderer.set_transfer(&transfer(Convention::Extinction));
            let view = view();
            renderer.render(&view, &|_| ()).expect("a frame");
            group.throughput(Throughput::Elements(renderer.stats().steps.max(1)));
            group.bench_function(format!("{name}, {device}"), |b| {
                b.iter(|| renderer.render(&view, &|_| ()).expect("a frame"));
            });
        }
    }
    group.finish();
}

criterion_group!(stages, before_drawing, integral, order, frames);
criterion_main!(stages);
