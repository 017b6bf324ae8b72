#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stderr, reason = "tests")]

use super::*;
use crate::field::{Association, Component, Field, Kind};
use crate::gpu::raster::Readback;
use crate::gpu::testing::{bindings, gpu, validated};
use crate::integral::lookup::tests::{choices, exact};
use crate::mesh::generate;
use crate::order::MOST_PARTS;
use crate::order::depth::{self, HIDDEN};
use crate::project::gpu::frame::{Limits, ViewUniforms};
use crate::project::{CellOrder, Compositing};
use crate::render::{Engine, Renderer};
use crate::transfer::{Emission, TransferFunction};
use crate::view::{Camera, ClippingPlane, Projection, View};
use glam::{DVec3, dvec3};
use wgpu::naga;

mod second;

fn arrays(chunks: usize) -> Vec<ShaderArray> {
    ARRAYS.map(|(name, element)| ShaderArray { name, element, chunks, shift: 22 }).to_vec()
}

const KINDS: [Kind; 3] = [Kind::Scalar, Kind::Pair, Kind::Rgba];
const FORMS: [Fragments; 3] = [Fragments::Intersected, Fragments::Interpolated, Fragments::Linear];

#[test]
fn every_program_is_valid() {
    for kind in KINDS {
        for fragments in FORMS {
            for (direct, chunks, association) in [(false, 1, "POINT"), (true, 3, "CORNER"), (false, 2, "CELL")] {
                let tables = choices()
                    .into_iter()
                    .map(|c| Some(PreintegratedTable::new(&exact(Emission::Chromatic), &c, 2.0).unwrap()));
                for (i, table) in std::iter::once(None).chain(tables).enumerate() {
                    let has_line = table.is_none() && kind != Kind::Pair;
                    let options = ProjectionOptions {
                        fragments,
                        compositing: if i % 3 == 1 { Compositing::Additive } else { Compositing::Over },
                        dither: true,
                        target: Target::Rgba8,
                        ..ProjectionOptions::default()
                    };
                    let limits = Limits {
                        ends: direct,
                        planes: chunks > 1,
                        range: chunks == 3,
                        perspective: chunks < 3,
                        plane_per_cell: direct && fragments != Fragments::Intersected,
                    };
                    let variant = ShaderVariant { kind, direct };
                    let arrays = arrays(chunks);
                    let layout =
                        Layout::new(fragments, kind.components(), has_line, fragments == Fragments::Intersected);
                    for blend in [Blend::Composite, Blend::Maximum] {
                        let drawn = DrawSettings { options: &options, blend };
                        validated(&program(&variant, association, drawn, &layout, table.as_ref(), limits, &arrays));
                    }
                }
            }
        }
    }
}

#[test]
fn layouts_match_their_rust_twins() {
    for kind in KINDS {
        for (fragments, has_line) in FORMS.into_iter().flat_map(|f| [false, kind != Kind::Pair].map(|line| (f, line))) {
            let layout = Layout::new(
                fragments,
                kind.components(),
                has_line,
                kind == Kind::Pair && fragments == Fragments::Intersected,
            );
            let options = ProjectionOptions { fragments, ..ProjectionOptions::default() };
            let module = validated(&program(
                &ShaderVariant { kind, direct: false },
                "POINT",
                DrawSettings { options: &options, blend: Blend::Composite },
                &layout,
                None,
                Limits::default(),
                &arrays(1),
            ));
            let members = |name: &str| {
                let (_, t) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name)).unwrap();
                let naga::TypeInner::Struct { span, members } = &t.inner else { panic!("{name} is no struct") };
                let at = |m: &naga::StructMember| (m.name.clone().unwrap(), u64::from(m.offset));
                (u64::from(*span), members.iter().map(at).collect::<Vec<_>>())
            };
            let rust = [
                ("Primitive", layout.bytes()),
                ("Vertex", layout.part_bytes()),
                ("ViewUniforms", size_of::<ViewUniforms>() as u64),
                ("Part", size_of::<Slice>() as u64),
                ("Point", 24),
            ];
            for (name, size) in rust {
                assert_eq!(members(name).0, size, "{name}, {kind:?}, {fragments:?}, {has_line}");
            }
            let (_, vertex) = members("Vertex");
            let attributes = layout.vertex_attributes();
            for (location, (name, offset)) in vertex.iter().enumerate() {
                assert_eq!(attributes[0][location].offset, *offset, "{name}, {kind:?}, {fragments:?}, {has_line}");
            }
            let locations: Vec<_> = attributes.iter().flatten().map(|a| a.shader_location as usize).collect();
            assert!(locations.iter().copied().eq(0..locations.len()), "{locations:?}");
            // What all devices can do.
            assert!(locations.len() <= 16, "{locations:?}");
        }
    }
}

#[test]
fn the_device_sorts_as_the_host_does() {
    let Some(gpu) = gpu() else { return };
    let sorter = Sorter::new(&gpu, HIDDEN).unwrap();
    let mut seed = 5u64;
    for (n, mask) in [(1, !0), (255, !0), (2048, 15), (5000, !0), (70_001, 0xff), (70_000, !0)] {
        let keys: Vec<u32> = (0..n)
            .map(|_| {
                seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                let hidden = (seed >> 20).is_multiple_of(5);
                if hidden { HIDDEN } else { (seed >> 32) as u32 & mask & !(MOST_PARTS - 1) }
            })
            .collect();
        let expected = depth::order(&keys, true).entries;
        let usage = Usage::STORAGE | Usage::COPY_SRC;
        let buffer = Buffer::holding(&gpu, "keys", &keys, usage).unwrap();
        let (numbers, count) = sorter.sort(&gpu, &buffer, keys.len()).unwrap();
        let back = Readback::new(&gpu, 4 * count as u64).unwrap();
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(&numbers.raw, 0, back.raw(), 0, 4 * count as u64);
        let sorted: Vec<u32> =
            back.submit(&gpu, encoder, |bytes| bytemuck::cast_slice(&bytes[..4 * count]).to_vec()).unwrap();
        assert_eq!(sorted.len(), expected.len(), "{n} keys");
        assert!(sorted == expected, "{n} keys are in another order");
    }
}

/// A renderer with a mesh of `n` × `n` × `n` cubes, and a view of it.
fn prepared(engine: Engine, choice: DeviceChoice, n: usize, size: [u32; 2]) -> (Renderer, View) {
    let mut renderer = Renderer::with_engine(2, choice, engine).unwrap();
    let mesh = generate::tetrahedra(n);
    renderer.set_mesh(&mesh).unwrap();
    let field = Field::new(&mesh, "s", Some(Association::Point), Component::Index(0)).unwrap();
    renderer.set_field(&field).unwrap();
    let [low, high] = field.range(0);
    let color = vec![(low, [1.0, 0.0, 0.0]), (high, [0.0, 1.0, 0.0])];
    renderer.set_transfer(&TransferFunction::new(color, vec![(0.0, 0.0), (high, 4.0)], 1.0).unwrap());
    let projection = Projection::Perspective { view_angle: 50.0 };
    let camera = Camera { position: dvec3(1.0, 2.0, 3.0), focal_point: DVec3::ZERO, view_up: DVec3::Y, projection };
    (renderer, View::new(camera, size).unwrap())
}

/// The device that tests draw on.
fn chosen(gpu: &Gpu) -> DeviceChoice {
    DeviceChoice::Named(gpu.adapter.index.to_string())
}

#[test]
fn pictures_do_not_depend_on_who_sorts() {
    let Some(gpu) = gpu() else { return };
    let (mut renderer, outside) = prepared(Engine::Project, chosen(&gpu), 8, [48, 40]);
    let camera = *outside.camera().unwrap();
    let of = |camera: Camera| View::new(camera, [48, 40]).unwrap();
    let parallel = of(Camera { projection: Projection::Parallel { parallel_scale: 0.9 }, ..camera });
    let plane = ClippingPlane { origin: dvec3(0.1, 0.0, 0.0), normal: dvec3(1.0, 0.3, 0.0) };
    let views = [
        outside.clone(),
        outside.clone().with_clipping_range([2.9, 3.6]).unwrap(),
        outside.clone().with_clipping_planes(vec![plane]).unwrap(),
        parallel.clone(),
        parallel.with_clipping_range([3.0, 4.0]).unwrap(),
        of(Camera { position: dvec3(0.1, 0.2, 0.3), ..camera }),
        // Most cells are between the centres of pixels.
        of(Camera { position: dvec3(10.0, 20.0, 30.0), ..camera }),
    ];
    let mut drawn = vec![];
    let (mut walk, _) = prepared(Engine::Traverse, DeviceChoice::Cpu, 8, [48, 40]);
    for order in [CellOrder::Depth, CellOrder::Circumsphere, CellOrder::Mpvo] {
        renderer.set_projection(ProjectionOptions { order, ..ProjectionOptions::default() });
        for (i, view) in views.iter().enumerate() {
            let [host, device] = [false, true].map(|on_device| {
                renderer.backend().project().unwrap().sort_on_device(on_device);
                let image = renderer.render(view, &|_| ()).unwrap();
                (image, renderer.stats().projection.unwrap().drawn_cells)
            });
            assert!(host.0 == device.0, "{order:?}, view {i}: {:e}", host.0.compare(&device.0).unwrap().max);
            // The order of the mesh is right for every pixel: nothing is taken for hidden that the walk finds.
            if order == CellOrder::Mpvo {
                let error = host.0.compare(&walk.render(view, &|_| ()).unwrap()).unwrap().max;
                assert!(error < 2e-5, "view {i}: {error:e} from the walk");
            }
            assert_eq!(host.1, device.1, "{order:?}, view {i}: cells drawn");
            assert!(host.0.pixels.iter().any(|p| p[3] > 0.1), "{order:?}, view {i} is empty");
            drawn.push(host.1);
        }
    }
    let all = 6 * 8 * 8 * 8;
    assert!(drawn[0] > all / 4 && drawn[0] < all, "some cells are empty: {drawn:?}");
    for limited in [1, 2, 4, 5, 6] {
        assert!(drawn[limited] < drawn[0], "view {limited} hides nothing: {drawn:?}");
    }
}

/// The sequence goes on from one buffer to the next, and cells and points from one binding to the next.
#[test]
fn orders_of_several_buffers_are_one() {
    let Some(gpu) = gpu() else { return };
    let (mut renderer, view) = prepared(Engine::Project, chosen(&gpu), 33, [64, 64]);
    let everything =
        TransferFunction::new(vec![(-1.0, [1.0, 0.5, 0.0]), (1.0, [0.0, 0.5, 1.0])], vec![(-1.0, 9.0)], 1.0);
    renderer.set_transfer(&everything.unwrap());
    for order in [CellOrder::Mpvo, CellOrder::Depth] {
        renderer.set_projection(ProjectionOptions { order, ..ProjectionOptions::default() });
        let one = renderer.render(&view, &|_| ()).unwrap();
        let project = renderer.backend().project().unwrap();
        let whole = project.gpu().binding;
        assert_eq!(bindings(project.chunks()), [1; 3]);
        project.sort_on_device(false);
        project.keep_in_chunks_of(BATCH);
        let several = renderer.render(&view, &|_| ()).unwrap();
        assert!(renderer.stats().projection.unwrap().drawn_cells > BATCH as u64);
        assert!(several.compare(&one).unwrap().max < 2e-6, "{order:?}");
        let project = renderer.backend().project().unwrap();
        project.gpu_mut().binding = 512 << 10;
        project.invalidate(Part::Mesh);
        let spread = renderer.render(&view, &|_| ()).unwrap();
        let project = renderer.backend().project().unwrap();
        let arrays = bindings(project.chunks());
        assert!(arrays[0] > 4 && arrays[1] > 1, "{arrays:?}");
        // A fragment is the same wherever its cell comes from.
        assert!(spread == several, "{order:?}: {:e}", spread.compare(&several).unwrap().max);
        project.keep_in_chunks_of(BATCH << 6);
        project.gpu_mut().binding = whole;
        project.invalidate(Part::Mesh);
    }
}

/// The order of a mesh is found once for a view: edits of function and field draw by it again.
#[test]
fn the_order_of_a_mesh_outlives_edits() {
    let Some(gpu) = gpu() else { return };
    let (mut renderer, view) = prepared(Engine::Project, chosen(&gpu), 6, [32, 32]);
    // A new sequence is found before the old one goes, so it is at another place.
    let place = |renderer: &mut Renderer, view: &View| {
        renderer.render(view, &|_| ()).unwrap();
        let sorts = renderer.stats().projection.unwrap().sorts;
        (renderer.backend().project().unwrap().sequence.as_ref().unwrap().cells.cells.as_ptr(), sorts)
    };
    let (first, sorts) = place(&mut renderer, &view);
    assert_eq!(sorts, 1);
    assert_eq!(place(&mut renderer, &view), (first, 0));
    let everything = TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(-1.0, 0.5), (1.0, 2.0)], 1.0).unwrap();
    renderer.set_transfer(&everything);
    assert_eq!(place(&mut renderer, &view), (first, 1));
    let mesh = generate::tetrahedra(6);
    renderer.set_field(&Field::new(&mesh, "c", Some(Association::Cell), Component::Index(0)).unwrap()).unwrap();
    assert_eq!(place(&mut renderer, &view), (first, 1));
    let camera = Camera { position: dvec3(-1.0, 2.0, 3.0), ..*view.camera().unwrap() };
    let (second, sorts) = place(&mut renderer, &View::new(camera, [32, 32]).unwrap());
    assert!(second != first && sorts == 1);
    let moved: Vec<DVec3> = mesh.points().iter().map(|p| *p * 0.9).collect();
    renderer.set_points(&moved).unwrap();
    assert!(renderer.backend().project().unwrap().sequence.is_none());
    assert_eq!(place(&mut renderer, &View::new(camera, [32, 32]).unwrap()).1, 1);
}

#[test]
fn a_lost_device_is_survived() {
    let Some(gpu) = gpu() else { return };
    let (mut renderer, view) = prepared(Engine::Project, chosen(&gpu), 4, [24, 24]);
    let before = renderer.render(&view, &|_| ()).unwrap();
    for _ in 0..3 {
        renderer.backend().project().unwrap().gpu().device.destroy();
        assert!(renderer.render(&view, &|_| ()).unwrap() == before);
        assert_eq!(renderer.stats().device, "gpu");
    }
}

/// More cells than one binding holds, and more entries than one buffer of the order.
#[test]
fn ten_million_tetrahedra_are_drawn() {
    let Some(gpu) = gpu() else { return };
    if std::env::var_os("HALITE_LONG").is_none() {
        eprintln!("skipped: it takes minutes, HALITE_LONG=1 runs it");
        return;
    }
    let [(mut project, view), (mut traverse, _)] =
        [(Engine::Project, chosen(&gpu)), (Engine::Traverse, DeviceChoice::Cpu)]
            .map(|(engine, choice)| prepared(engine, choice, 119, [256, 256]));
    let everything = TransferFunction::new(vec![(-1.0, [1.0, 0.5, 0.0])], vec![(-1.0, 0.5), (1.0, 2.0)], 1.0).unwrap();
    project.set_transfer(&everything);
    traverse.set_transfer(&everything);
    let (got, want) = (project.render(&view, &|_| ()).unwrap(), traverse.render(&view, &|_| ()).unwrap());
    let bindings: usize = bindings(project.backend().project().unwrap().chunks()).iter().sum();
    let drawn = project.stats().projection.unwrap().drawn_cells;
    let error = got.compare(&want).unwrap();
    eprintln!("{bindings} bindings, {drawn} cells, error {:e}, {:?}", error.max, project.stats());
    assert!(bindings > 3 && drawn > (BATCH << 6) as u64);
    assert!(error.max < 1e-3);
}
