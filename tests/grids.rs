//! Regular and rectilinear grids: the ray caster against the reference, the walk and, where they are at hand, the
//! oracle's pictures.

#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "a test fails by panicking")]

use glam::{DMat3, DVec3};
use halite::cast::{Reconstruction, ReconstructionOrder, Sampling};
use halite::field::{Association, Component, Field};
use halite::gpu::DeviceChoice;
use halite::grid::{Grid, Lattice};
use halite::image::Image;
use halite::io::{DataSet, Source};
use halite::mesh::{Array, Values};
use halite::render::Renderer;
use halite::scene::Scene;
use halite::transfer::{Convention, Emission, TransferFunction};
use halite::view::{Blend, Camera, ClippingPlane, DepthBuffer, DepthKind, Projection, View};
use std::path::Path;

/// The reference takes the field for linear in 1024 pieces of a voxel.
const BOUND: f64 = 5e-6;

/// As devices agree with the CPU.
const BOUND_ON_DEVICES: f64 = 2e-5;

const SIZE: [usize; 3] = [7, 6, 8];

fn array(name: &str, components: usize, values: Values) -> Array {
    Array { name: name.to_owned(), components, values }
}

/// A wave of two directions.
fn wave(p: [usize; 3]) -> f64 {
    let [x, y, z] = p.map(|i| i as f64);
    (0.9 * x + 0.4 * y * z).sin() * 0.6 + (1.1 * z - 0.8 * y).cos() * 0.4
}

fn indices([nx, ny, nz]: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (0..nz).flat_map(move |k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k])))
}

fn arrays() -> [Vec<Array>; 2] {
    let scalar = |p: [usize; 3]| wave(p);
    let pair = indices(SIZE).flat_map(|p| [scalar(p), scalar([p[2], p[0], p[1]])]).collect();
    let bytes = indices(SIZE).flat_map(|p| [0, 1, 2, 3].map(|k| (127.0 + 120.0 * wave([p[k % 3], p[1], p[2]])) as u8));
    let points = vec![
        array("s", 1, Values::F64(indices(SIZE).map(scalar).collect())),
        array("short", 1, Values::I16(indices(SIZE).map(|p| (scalar(p) * 1000.0) as i16).collect())),
        array(
            "pair",
            2,
            Values::F32(indices(SIZE).flat_map(|p| [scalar(p), wave([p[2], p[0], p[1]])]).map(|v| v as f32).collect()),
        ),
        array("wide", 2, Values::F64(pair)),
        array("rgba", 4, Values::U8(bytes.collect())),
    ];
    let cells = vec![array("c", 1, Values::F32(indices(SIZE.map(|n| n - 1)).map(|p| scalar(p) as f32).collect()))];
    [points, cells]
}

fn regular() -> Grid {
    let [points, cells] = arrays();
    let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.7);
    let lattice = Lattice {
        origin: DVec3::new(-0.2, 0.1, 0.3),
        spacing: DVec3::new(0.3, 0.35, 0.25),
        direction: turn,
        first: [-3, -2, -4],
        size: SIZE,
    };
    Grid::regular(&lattice, points, cells).unwrap()
}

fn rectilinear() -> Grid {
    let [points, cells] = arrays();
    let axis = |n: usize, power: i32| (0..n).map(|i| (1.0 + i as f64 / n as f64).powi(power) - 2.0).collect::<Vec<_>>();
    let mut y = axis(SIZE[1], 1);
    y.reverse();
    Grid::rectilinear([axis(SIZE[0], 2), y, axis(SIZE[2], 1)], points, cells).unwrap()
}

fn transfer() -> TransferFunction {
    let color = vec![(-0.8, [0.1, 0.2, 0.9]), (0.0, [0.9; 3]), (0.3, [0.9, 0.8, 0.1]), (0.9, [0.8, 0.1, 0.1])];
    // A flat part, a narrow peak, a step, and what is empty.
    let opacity =
        vec![(-0.5, 0.0), (-0.1, 0.02), (0.1, 0.02), (0.12, 0.7), (0.14, 0.02), (0.5, 0.05), (0.5, 0.4), (0.9, 0.9)];
    TransferFunction::new(color, opacity, 0.2).unwrap()
}

fn camera(projection: Projection) -> Camera {
    Camera { position: DVec3::new(2.1, -3.7, 2.4), focal_point: DVec3::ZERO, view_up: DVec3::Z, projection }
}

const NEAR: Projection = Projection::Perspective { view_angle: 30.0 };

fn view() -> View {
    View::new(camera(NEAR), [24, 18]).unwrap()
}

fn image(grid: &Grid, field: &Field, transfer: &TransferFunction, view: &View) -> Image {
    rebuilt(grid, field, transfer, view, Reconstruction::default())
}

fn rebuilt(grid: &Grid, field: &Field, transfer: &TransferFunction, view: &View, how: Reconstruction) -> Image {
    let mut renderer = Renderer::with_device(2, DeviceChoice::Cpu).unwrap();
    renderer.set_grid(grid).unwrap();
    renderer.set_field(field).unwrap();
    renderer.set_transfer(transfer);
    renderer.set_reconstruction(how);
    let image = renderer.render(view, &|_| {}).unwrap();
    assert_eq!((renderer.stats().engine.as_str(), renderer.stats().device.as_str()), ("grid", "cpu"));
    image
}

/// A renderer on `HALITE_TEST_DEVICE`, or the first device. Without any there is none, which is said loudly; with
/// `HALITE_REQUIRE_GPU=1` that is a failure.
fn device() -> Option<Renderer> {
    let name = std::env::var("HALITE_TEST_DEVICE").unwrap_or_else(|_| "0".into());
    match Renderer::with_device(2, DeviceChoice::Named(name)) {
        Ok(renderer) => Some(renderer),
        Err(e) => {
            assert!(!std::env::var("HALITE_REQUIRE_GPU").is_ok_and(|v| v == "1"), "{e}");
            eprintln!("skipped: there is no device to test: {e}");
            None
        }
    }
}

/// The greatest difference between the truth and the picture of a device, if there is one.
fn off_on_device(grid: &Grid, field: &Field, transfer: &TransferFunction, view: &View, truth: &Image) -> Option<f64> {
    let mut renderer = device()?;
    renderer.set_grid(grid).unwrap();
    renderer.set_field(field).unwrap();
    renderer.set_transfer(transfer);
    let image = renderer.render(view, &|_| {}).unwrap();
    let by = if transfer.is_of_one_variable() { "gpu" } else { "cpu" };
    assert_eq!((renderer.stats().engine.as_str(), renderer.stats().device.as_str()), ("grid", by));
    Some(difference(&image, truth))
}

/// The greatest difference of two pictures, of which the second must show something.
fn difference(a: &Image, b: &Image) -> f64 {
    let pairs = || a.pixels.as_flattened().iter().zip(b.pixels.as_flattened());
    assert_eq!(a.pixels.len(), b.pixels.len());
    assert!(pairs().any(|(_, t)| *t > 0.1), "there is something to see");
    assert!(pairs().all(|(a, _)| a.is_finite()));
    pairs().map(|(a, b)| f64::from(a - b).abs()).fold(0.0, f64::max)
}

fn check(what: &str, grid: &Grid, field: &Field, transfer: &TransferFunction, view: &View) {
    let truth = halite::reference::render_grid(grid, field, transfer, view).unwrap();
    let off = difference(&image(grid, field, transfer, view), &truth);
    eprintln!("{what}: {off:.1e}");
    assert!(off <= BOUND, "{what}: {off:.1e}");
    if let Some(off) = off_on_device(grid, field, transfer, view, &truth) {
        eprintln!("{what} on a device: {off:.1e}");
        assert!(off <= BOUND_ON_DEVICES, "{what} on a device: {off:.1e}");
    }
}

fn field(grid: &Grid, name: &str, component: Component) -> Field {
    Field::new(grid, name, None, component).unwrap()
}

#[test]
fn grids_are_drawn_as_the_reference_draws_them() {
    let (regular, uneven) = (regular(), rectilinear());
    let s = |grid: &Grid| field(grid, "s", Component::Index(0));
    let plain = transfer();
    check("regular", &regular, &s(&regular), &plain, &view());
    check("rectilinear", &uneven, &s(&uneven), &plain, &view());
    check("opacity", &uneven, &s(&uneven), &plain.clone().with_convention(Convention::Opacity), &view());
    let direct = plain.clone().with_emission(Emission::Direct { scale: 1.0 }).unwrap();
    check("direct", &regular, &s(&regular), &direct, &view());
    let dense = TransferFunction::new(plain.color().to_vec(), plain.opacity().to_vec(), 1e-3).unwrap();
    check("dense", &uneven, &s(&uneven), &dense, &view());
    check("without clamp", &regular, &s(&regular), &plain.clone().with_clamp(false), &view());
    let opaque =
        TransferFunction::new(plain.color().to_vec(), vec![(-0.3, 0.0), (0.4, 1.0), (0.6, 1.0), (0.7, 0.1)], 0.3);
    check("opaque", &regular, &s(&regular), &opaque.unwrap().with_convention(Convention::Opacity), &view());
    for of in [&regular, &uneven] {
        check("cells", of, &field(of, "c", Component::Index(0)), &plain, &view());
        check("largest", of, &s(of), &plain, &view().with_blend(Blend::Maximum));
    }
    let parallel = View::new(camera(Projection::Parallel { parallel_scale: 1.2 }), [24, 18]).unwrap();
    check("parallel", &uneven, &s(&uneven), &plain, &parallel);
    let along =
        Camera { position: DVec3::new(-0.4, -5.0, 0.1), focal_point: DVec3::new(-0.4, 0.0, 0.1), ..camera(NEAR) };
    check("along an axis", &uneven, &s(&uneven), &plain, &View::new(along, [25, 19]).unwrap());
    let inside =
        Camera { position: DVec3::new(-0.4, -0.3, 0.1), ..camera(Projection::Perspective { view_angle: 80.0 }) };
    check("inside", &uneven, &s(&uneven), &plain, &View::new(inside, [24, 18]).unwrap());
}

#[test]
fn several_components_are_drawn_as_the_reference_draws_them() {
    let (grid, plain) = (regular(), transfer());
    let direct = plain.clone().with_emission(Emission::Direct { scale: 1.0 }).unwrap();
    for name in ["pair", "wide"] {
        check(name, &grid, &field(&grid, name, Component::All), &plain, &view());
    }
    check("direct pair", &grid, &field(&grid, "wide", Component::All), &direct, &view());
    check("magnitude", &grid, &field(&grid, "wide", Component::Magnitude), &plain, &view());
    let bytes =
        TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(40.0, 0.0), (128.0, 0.4), (140.0, 0.0), (255.0, 0.6)], 0.2);
    let (bytes, rgba) = (bytes.unwrap(), field(&grid, "rgba", Component::All));
    check("rgba", &grid, &rgba, &bytes, &view());
    let shorts =
        TransferFunction::new(vec![(0.0, [0.2, 0.5, 1.0])], vec![(-500.0, 0.0), (100.0, 0.6), (700.0, 0.1)], 0.2);
    check("16 bits", &grid, &field(&grid, "short", Component::Index(0)), &shorts.unwrap(), &view());
}

#[test]
fn what_limits_rays_limits_them_in_grids() {
    let (grid, plain) = (rectilinear(), transfer());
    let s = field(&grid, "s", Component::Index(0));
    let plane = ClippingPlane { origin: DVec3::new(-0.2, 0.0, 0.0), normal: DVec3::new(1.0, -0.6, 0.3) };
    let planes = view().with_clipping_planes(vec![plane]).unwrap();
    check("plane", &grid, &s, &plain, &planes);
    check("range", &grid, &s, &plain, &view().with_clipping_range([4.4, 5.1]).unwrap());
    let values = (0..24 * 18).map(|p| 4.0 + f64::from(p % 24) * 0.066).collect();
    let depths = view().with_depth(DepthBuffer { kind: DepthKind::Ray, values }).unwrap();
    check("depths", &grid, &s, &plain, &depths);
    check("largest to depths", &grid, &s, &plain, &depths.with_blend(Blend::Maximum));
}

/// Hidden points hold what no range should see; values that are not finite make their voxels invisible.
#[test]
fn what_is_hidden_is_not_drawn() {
    let [mut points, mut cells] = arrays();
    let hidden = |p: [usize; 3]| p[0] + p[1] + p[2] < 5;
    let Values::F64(s) = &mut points[0].values else { unreachable!() };
    for (v, p) in s.iter_mut().zip(indices(SIZE)) {
        if hidden(p) {
            *v = -9999.0;
        }
    }
    s[SIZE.iter().product::<usize>() - 1] = f64::NAN;
    points.push(array("vtkGhostType", 1, Values::U8(indices(SIZE).map(|p| if hidden(p) { 2 } else { 0 }).collect())));
    let ghosts = indices(SIZE.map(|n| n - 1)).map(|p| if p[1] == 4 { 32 } else { u8::from(p[2] == 6) }).collect();
    cells.push(array("vtkGhostType", 1, Values::U8(ghosts)));
    let plain = rectilinear();
    let grid = Grid::rectilinear(plain.axes().clone(), points, cells).unwrap();
    let s = field(&grid, "s", Component::Index(0));
    check("hidden", &grid, &s, &transfer(), &view());
    let whole = image(&plain, &field(&plain, "s", Component::Index(0)), &transfer(), &view());
    assert!(difference(&image(&grid, &s, &transfer(), &view()), &whole) > 0.1);
    check("hidden cells", &grid, &field(&grid, "c", Component::Index(0)), &transfer(), &view());
}

/// Where the field is linear, or constant in cells, tetrahedra of the voxels show the same.
#[test]
fn the_walk_through_voxels_shows_the_same() {
    let [_, cells] = arrays();
    let place = |p: [usize; 3]| 0.2 * p[0] as f64 - 0.3 * p[1] as f64 + 0.15 * p[2] as f64 - 0.2;
    let linear = array("s", 1, Values::F64(indices(SIZE).map(place).collect()));
    let lattice = Lattice { origin: DVec3::splat(-0.9), spacing: DVec3::splat(0.28), size: SIZE, ..Lattice::default() };
    let grid = Grid::regular(&lattice, vec![linear], cells).unwrap();
    let mesh = grid.clone().into_mesh().unwrap();
    let mut walk = Renderer::with_device(2, DeviceChoice::Cpu).unwrap();
    walk.set_mesh(&mesh).unwrap();
    walk.set_transfer(&transfer());
    for (name, of) in [("s", Association::Point), ("c", Association::Cell)] {
        let on = |of_grid: bool| {
            let component = Component::Index(0);
            if of_grid {
                Field::new(&grid, name, Some(of), component)
            } else {
                Field::new(&mesh, name, Some(of), component)
            }
        };
        walk.set_field(&on(false).unwrap()).unwrap();
        let walked = walk.render(&view(), &|_| {}).unwrap();
        let off = difference(&image(&grid, &on(true).unwrap(), &transfer(), &view()), &walked);
        assert!(off <= BOUND, "{name}: {off:.1e}");
    }
}

#[test]
fn what_cannot_be_drawn_is_said() {
    let flat = Grid::rectilinear([vec![0.0, 1.0], vec![0.0], vec![0.0, 1.0]], vec![], vec![]).unwrap();
    let mut renderer = Renderer::with_device(1, DeviceChoice::Cpu).unwrap();
    assert!(renderer.set_grid(&flat).unwrap_err().to_string().contains("no volume"));
    let (grid, other) =
        (regular(), Grid::regular(&Lattice { size: [2; 3], ..Lattice::default() }, vec![], vec![]).unwrap());
    renderer.set_grid(&other).unwrap();
    let error = renderer.set_field(&field(&grid, "s", Component::Index(0))).unwrap_err().to_string();
    assert!(error.contains("336 values for 8 points"), "{error}");
    let error = Field::new(&grid, "t", None, Component::Index(0)).unwrap_err().to_string();
    assert!(error.contains("\"short\""), "{error}");
    for axis in [vec![], vec![0.0, 0.0], vec![0.0, 1.0, 0.5], vec![0.0, f64::NAN]] {
        assert!(Grid::rectilinear([axis, vec![0.0], vec![0.0]], vec![], vec![]).is_err());
    }
}

#[test]
fn of_large_grids_some_points_are_looked_at() {
    let grid = regular();
    assert_eq!(grid.coarse(1000).unwrap(), grid);
    let coarse = grid.coarse(40).unwrap();
    let size = coarse.size();
    assert!(coarse.point_count() <= 40 && coarse.has_volume());
    for p in [[0; 3], size.map(|n| n - 1)] {
        let same = [0, 1, 2].map(|a| if p[a] == 0 { 0 } else { SIZE[a] - 1 });
        assert!((coarse.point(p) - grid.point(same)).length() < 1e-12);
        let value = |grid: &Grid, [i, j, k]: [usize; 3]| {
            let [x, y, _] = grid.size();
            grid.point_arrays()[0].values.get((k * y + j) * x + i)
        };
        assert_eq!(value(&coarse, p), value(&grid, same));
    }
    assert_eq!(coarse.cell_arrays()[0].tuples(), coarse.cell_count());
}

/// A field by its places.
type Value = fn(DVec3) -> f64;

const SAMPLINGS: [Sampling; 3] = [Sampling::Voxels, Sampling::Steps(0.23), Sampling::Steps(0.031)];

/// Along rays a field of the form a + b x + c y + d x y is quadratic, a linear one linear, and one value one value: in a
/// single voxel slabs may be anywhere.
#[test]
fn orders_are_exact_for_their_degree() {
    let grid = |value: Value| {
        let corners = indices([2; 3]).map(|p| value(DVec3::from_array(p.map(|i| i as f64 * 2.0 - 1.0)))).collect();
        let lattice =
            Lattice { origin: DVec3::splat(-1.0), spacing: DVec3::splat(2.0), size: [2; 3], ..Lattice::default() };
        Grid::regular(&lattice, vec![array("s", 1, Values::F64(corners))], vec![]).unwrap()
    };
    let cases: [(ReconstructionOrder, Value, Value); 5] = [
        (ReconstructionOrder::Two, |p| 0.6 * p.x * p.y + 0.3 * p.z, |p| p.x * p.y * p.z),
        (ReconstructionOrder::One, |p| 0.3 * p.x - 0.4 * p.y + 0.2 * p.z, |p| 0.6 * p.x * p.y),
        (ReconstructionOrder::Midpoint, |_| 0.2, |p| 0.4 * p.x),
        (ReconstructionOrder::Left, |_| 0.2, |p| 0.4 * p.x),
        (ReconstructionOrder::Right, |_| 0.2, |p| 0.4 * p.x),
    ];
    for (order, exact, beyond) in cases {
        for sampling in SAMPLINGS {
            let off = |value: Value| {
                let grid = grid(value);
                let s = field(&grid, "s", Component::Index(0));
                let made = rebuilt(&grid, &s, &transfer(), &view(), Reconstruction { order, sampling });
                difference(&made, &image(&grid, &s, &transfer(), &view()))
            };
            // Hundreds of slabs are summed up in f32.
            assert!(off(exact) < 4e-6, "{order:?} {sampling:?}: {:.1e}", off(exact));
            if sampling == Sampling::Voxels {
                assert!(off(beyond) > 1e-3, "{order:?}: {:.1e}", off(beyond));
            }
        }
    }
}

/// Root mean square of what an order is off by from the field itself.
fn rmse(
    grid: &Grid,
    s: &Field,
    transfer: &TransferFunction,
    view: &View,
    order: ReconstructionOrder,
    sampling: Sampling,
) -> f64 {
    let (made, truth) =
        (rebuilt(grid, s, transfer, view, Reconstruction { order, sampling }), image(grid, s, transfer, view));
    let pairs = made.pixels.as_flattened().iter().zip(truth.pixels.as_flattened());
    let squares: Vec<f64> = pairs.map(|(a, b)| f64::from(a - b).powi(2)).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// What the paper claims: with as many samples, parabolas are nearer to the field than lines, and these than rectangles.
#[test]
fn higher_orders_are_nearer() {
    let n = 21;
    // Marschner & Lobb's signal (1994).
    let signal = |p: [usize; 3]| {
        let [x, y, z] = p.map(|i| i as f64 * 2.0 / (n - 1) as f64 - 1.0);
        let rho = (12.0 * std::f64::consts::PI * (std::f64::consts::FRAC_PI_2 * x.hypot(y)).cos()).cos();
        ((1.0 - (std::f64::consts::FRAC_PI_2 * z).sin()) + 0.25 * (1.0 + rho)) / 2.5
    };
    let lattice = Lattice {
        origin: DVec3::splat(-1.0),
        spacing: DVec3::splat(2.0 / (n - 1) as f64),
        size: [n; 3],
        ..Lattice::default()
    };
    let values = Values::F64(indices([n; 3]).map(signal).collect());
    let grid = Grid::regular(&lattice, vec![array("s", 1, values)], vec![]).unwrap();
    let s = field(&grid, "s", Component::Index(0));
    let smooth =
        TransferFunction::new(transfer().color().to_vec(), vec![(0.0, 0.0), (0.4, 0.5), (0.7, 0.1), (1.0, 0.8)], 0.3)
            .unwrap();
    let off = |order, sampling| rmse(&grid, &s, &smooth, &view(), order, sampling);
    let [two, one, zero] = [ReconstructionOrder::Two, ReconstructionOrder::One, ReconstructionOrder::Midpoint]
        .map(|order| off(order, Sampling::Voxels));
    eprintln!("by voxels: {two:.1e} {one:.1e} {zero:.1e}");
    assert!(two * 3.0 < one && one < zero, "{two:.1e} {one:.1e} {zero:.1e}");
    for order in [
        ReconstructionOrder::Two,
        ReconstructionOrder::One,
        ReconstructionOrder::Midpoint,
        ReconstructionOrder::Left,
        ReconstructionOrder::Right,
    ] {
        let [coarse, fine] = [0.04, 0.01].map(|step| off(order, Sampling::Steps(step)));
        eprintln!("{order:?}: {coarse:.1e} {fine:.1e}");
        assert!(fine * 2.0 < coarse, "{order:?}: {coarse:.1e} {fine:.1e}");
    }
}

#[test]
fn steps_are_lengths() {
    let grid = regular();
    for step in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-12] {
        let mut renderer = Renderer::with_device(1, DeviceChoice::Cpu).unwrap();
        renderer.set_grid(&grid).unwrap();
        renderer.set_field(&field(&grid, "s", Component::Index(0))).unwrap();
        renderer.set_transfer(&transfer());
        renderer
            .set_reconstruction(Reconstruction { order: ReconstructionOrder::One, sampling: Sampling::Steps(step) });
        let error = renderer.render(&view(), &|_| {}).unwrap_err().to_string();
        assert!(error.contains("steps of"), "{error}");
    }
}

/// What is too large to be held is refused, by an error of its own kind.
#[test]
fn grids_that_no_memory_holds_are_errors() {
    for size in [[1 << 60, 1, 1], [1, 1 << 60, 2], [2, 1, usize::MAX]] {
        let lattice = Lattice { size, first: [i64::MAX - 1; 3], ..Lattice::default() };
        let error = Grid::regular(&lattice, vec![], vec![]).unwrap_err();
        assert!(matches!(error, halite::Error::NoMemory(_)), "{size:?}: {error}");
        assert!(error.to_string().contains("points along an axis"), "{error}");
    }
    // Indices beyond all numbers are one place.
    let lattice = Lattice { size: [4, 2, 2], first: [i64::MAX - 1; 3], ..Lattice::default() };
    let error = Grid::regular(&lattice, vec![], vec![]).unwrap_err();
    assert!(error.to_string().contains("do not ascend"), "{error}");
}

/// The scenes of grids; those with light are integrated in parts of voxels.
#[test]
fn the_oracle_drew_the_same() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/reference");
    let Ok(entries) = std::fs::read_dir(&folder) else {
        return eprintln!("skipped: there is no {}", folder.display());
    };
    let mut count = 0;
    for path in entries.map(|e| e.unwrap().path()) {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let is_grid = name.starts_with("regular_") || name.starts_with("rectilinear_");
        if path.extension().is_none_or(|e| e != "json") || !is_grid {
            continue;
        }
        let scene = Scene::open(&path).unwrap();
        let read = Source::open(&scene.mesh).unwrap().read_data_set(0, &|_| ()).unwrap();
        let DataSet::Grid(grid) = read else { unreachable!("{name} is a grid") };
        let (view, _) = scene.view().unwrap();
        let (field, truth) = (scene.field(&grid).unwrap(), Image::open(&path.with_extension("npy")).unwrap());
        let off = difference(&image(&grid, &field, &scene.transfer, &view), &truth);
        let off_there = off_on_device(&grid, &field, &scene.transfer, &view, &truth);
        eprintln!("{name}: {off:.1e}, on a device {off_there:.1?}");
        let [bound, there] = if name.ends_with("_light") { [5e-4; 2] } else { [BOUND, BOUND_ON_DEVICES] };
        assert!(off <= bound, "{name}: {off:.1e}");
        assert!(off_there.is_none_or(|off| off <= there), "{name}: {off_there:.1?}");
        count += 1;
    }
    assert!(count >= 14, "{count} scenes only");
}
