//! The sweep's own tests.

/// What is done to the sequence of a tile's cells.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Fault {
    /// The cell in this place, by share of the sequence, is left out.
    Drop(f64),
    /// Cells in these places change places.
    Swap(f64, f64),
}

impl Fault {
    pub(super) fn inject(self, sequence: &mut Vec<usize>) {
        let length = sequence.len();
        let at = |share: f64| ((share * length as f64) as usize).min(length.saturating_sub(1));
        match self {
            _ if sequence.is_empty() => {}
            Fault::Drop(share) => {
                sequence.remove(at(share));
            }
            Fault::Swap(a, b) => sequence.swap(at(a), at(b)),
        }
    }
}

use crate::field::{Association, Component, Field};
use crate::gpu::DeviceChoice;
use crate::mesh::{Mesh, generate};
use crate::render::{Engine, Renderer};
use crate::transfer::TransferFunction;
use crate::view::{Camera, Projection, View};
use fearless_simd::Level;
use glam::{DVec3, dvec3};

fn renderer(mesh: &Mesh, engine: Engine) -> Renderer {
    let mut renderer = Renderer::with_engine(1, DeviceChoice::Cpu, engine).unwrap();
    let field = Field::from_array(&mesh.point_arrays()[0], Association::Point, Component::All).unwrap();
    let [lo, hi] = field.range(0);
    let color = vec![(lo, [0.1, 0.3, 0.9]), (hi, [0.9, 0.5, 0.1])];
    let opacity = vec![(lo, 0.3), (0.6 * lo + 0.4 * hi, 1.5), (hi, 0.5)];
    renderer.set_mesh(mesh).unwrap();
    renderer.set_field(&field).unwrap();
    renderer.set_transfer(&TransferFunction::new(color, opacity, 1.0).unwrap());
    renderer
}

fn view(position: DVec3, size: [u32; 2]) -> View {
    let projection = Projection::Perspective { view_angle: 35.0 };
    View::new(Camera { position, focal_point: DVec3::ZERO, view_up: DVec3::Y, projection }, size).unwrap()
}

/// A cell that is missing or drawn too early must be noticed in every pixel in which it shows: flagged pixels are drawn again, so
/// the picture stays what it is.
#[test]
fn faults_of_the_order_are_noticed_by_every_pixel() {
    let mut seed = 1_u64;
    let mut random = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut redrawn = [0; 3];
    for mesh in [generate::tetrahedra(3), generate::islands(5), generate::demo(2), generate::ring(4)] {
        let (mut walk, mut sweep) = (renderer(&mesh, Engine::Traverse), renderer(&mesh, Engine::Project));
        for _ in 0..6 {
            let from = dvec3(random() - 0.5, random() - 0.5, random() - 0.5).normalize() * 4.5;
            let view = view(from, [32, 32]);
            let expected = walk.render(&view, &|_| ()).unwrap();
            for k in 0..30 {
                let fault = if k % 2 == 0 { Fault::Drop(random()) } else { Fault::Swap(random(), random()) };
                sweep.backend().sweep().unwrap().fault = Some(fault);
                let got = sweep.render(&view, &|_| ()).unwrap();
                let d = got.compare(&expected).unwrap();
                assert!(d.max <= 1e-5, "{fault:?} from {from}: {d:?}");
                let stats = sweep.stats().sweep.clone().unwrap();
                for (sum, n) in
                    redrawn.iter_mut().zip([stats.redrawn_overlaps, stats.redrawn_gaps, stats.redrawn_boundary])
                {
                    *sum += n;
                }
            }
        }
    }
    // A cell that is drawn too early or not at all leaves a gap first, and a pixel keeps its first flaw.
    assert!(redrawn.iter().sum::<u64>() > 1000, "{redrawn:?}");
}

/// The net is not what draws: without faults next to nothing is drawn again, holes and several parts included.
#[test]
fn the_order_is_right_nearly_everywhere() {
    let meshes = [
        ("tetrahedra", generate::tetrahedra(8)),
        ("hexahedra", generate::hexahedra(6)),
        ("islands", generate::islands(7)),
        ("demo", generate::demo(5)),
        ("ring", generate::ring(7)),
        ("t-junction", generate::t_junction(2)),
    ];
    for (name, mesh) in meshes {
        let mut sweep = renderer(&mesh, Engine::Project);
        let (mut covered, mut redrawn) = (0, 0);
        for from in [dvec3(1.3, 0.7, 4.0), dvec3(-2.9, 1.9, -2.3), dvec3(0.31, -4.1, 0.9)] {
            let image = sweep.render(&view(from, [128, 128]), &|_| ()).unwrap();
            covered += image.pixels.iter().filter(|p| p[3] > 0.0).count();
            let stats = sweep.stats().sweep.clone().unwrap();
            assert_eq!(stats.handed_over, None, "{name}");
            redrawn += stats.redrawn_overlaps + stats.redrawn_gaps + stats.redrawn_boundary;
        }
        // Some are in any mesh: 1 of the tetrahedra's 41,704 was seen.
        assert!(redrawn as f64 <= 1e-3 * covered as f64, "{name}: {redrawn} of {covered} pixels drawn again");
    }
}

/// What narrower instructions draw differs by rounding alone, for functions of few and of many points.
#[test]
#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
fn every_set_of_instructions_draws_the_same() {
    let best = Level::new();
    let lower = [best.as_avx2().map(Level::Avx2), best.as_sse2().map(Level::Sse2)];
    let mesh = generate::demo(4);
    let field = Field::from_array(&mesh.point_arrays()[0], Association::Point, Component::All).unwrap();
    let [lo, hi] = field.range(0);
    let view = view(dvec3(1.3, 0.7, 4.0), [96; 2]);
    for points in [2, 5, 300] {
        let knot = |i: u32| (lo + (hi - lo) * f64::from(i) / f64::from(points), f64::from(i % 3) * 0.4);
        let transfer =
            TransferFunction::new(vec![(lo, [0.2; 3]), (hi, [1.0; 3])], (0..=points).map(knot).collect(), 1.0);
        let transfer = transfer.unwrap();
        let draw = |engine: Engine, level: Option<Level>| {
            let mut renderer = renderer(&mesh, engine);
            renderer.set_transfer(&transfer);
            if let (Some(level), Some(sweep)) = (level, renderer.backend().sweep()) {
                sweep.level = level;
            }
            renderer.render(&view, &|_| ()).unwrap()
        };
        let walk = draw(Engine::Traverse, None);
        for level in lower.into_iter().flatten().chain([best]) {
            let d = draw(Engine::Project, Some(level)).compare(&walk).unwrap();
            assert!(d.max <= 1e-5, "{points} points, {level:?}: {d:?}");
        }
    }
}

/// 16 bits number the lines of a function; the walk has no such limit.
#[test]
fn functions_of_very_many_points_are_left_to_the_walk() {
    let mesh = generate::hexahedra(2);
    let mut renderers = [Engine::Project, Engine::Traverse].map(|engine| renderer(&mesh, engine));
    let field = Field::from_array(&mesh.point_arrays()[0], Association::Point, Component::All).unwrap();
    let [lo, hi] = field.range(0);
    let knot = |i: u32| lo + (hi - lo) * f64::from(i) / 70_000.0;
    let opacity = (0..=70_000).map(|i| (knot(i), f64::from(i % 2))).collect();
    let transfer = TransferFunction::new(vec![(lo, [1.0; 3])], opacity, 1.0).unwrap();
    let view = view(dvec3(3.0, 2.0, 4.0), [24; 2]);
    let images = renderers.each_mut().map(|renderer| {
        renderer.set_transfer(&transfer);
        renderer.render(&view, &|_| {}).unwrap()
    });
    let handed_over = renderers[0].stats().sweep.as_ref().and_then(|s| s.handed_over.as_deref());
    assert_eq!(handed_over, Some("the transfer function has too many points"));
    assert_eq!(images[0].pixels, images[1].pixels);
}
