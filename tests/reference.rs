//! The reference against closed forms.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use glam::DVec3;
use halite::error::Error;
use halite::field::{Association, Component, Field};
use halite::mesh::cells::Tetrahedra;
use halite::mesh::{Array, Cells, Mesh, Values};
use halite::reference::{Reference, render};
use halite::transfer::{Convention, Emission, TransferFunction};
use halite::view::{Blend, Camera, ClippingPlane, DepthBuffer, DepthKind, Projection, Ray, View};

const TETRA: u8 = 10;

/// `n` unit cubes, the i-th at z in [i·step, i·step + 1], each split into six tetrahedra around its diagonal and each
/// with its own points. `value(cube, position)` gives the tuples of a point field.
fn cubes<const N: usize>(n: u32, step: f64, value: impl Fn(u32, DVec3) -> [f64; N]) -> (Mesh, Tetrahedra, Field) {
    let (mut points, mut values, mut corners, mut cell) = (vec![], vec![], vec![], vec![]);
    for cube in 0..n {
        for bits in 0..8 {
            let at = |axis: u32| f64::from(bits >> axis & 1_u32);
            let p = DVec3::new(at(0), at(1), at(2) + step * f64::from(cube));
            points.push(p);
            values.extend(value(cube, p));
        }
        for [a, b] in [[1, 2], [1, 4], [2, 1], [2, 4], [4, 1], [4, 2]] {
            corners.push([0, a, a | b, 7].map(|k| 8 * cube + k));
            cell.push(cube);
        }
    }
    let cells = Cells {
        types: vec![TETRA; corners.len()],
        offsets: (0..=corners.len() as u64).map(|i| 4 * i).collect(),
        connectivity: corners.as_flattened().to_vec(),
    };
    let array = Array { name: "s".into(), components: N, values: Values::F64(values) };
    let field = Field::from_array(&array, Association::Point, Component::All).unwrap();
    (Mesh::new(points, cells, vec![array], vec![]).unwrap(), Tetrahedra { corners, ..Default::default() }, field)
}

fn transfer(color: &[(f64, [f64; 3])], opacity: &[(f64, f64)], unit: f64) -> TransferFunction {
    TransferFunction::new(color.to_vec(), opacity.to_vec(), unit).unwrap()
}

/// A ray along z that enters the first cube at t = 1.
fn along_z(x: f64, y: f64) -> Ray {
    Ray { origin: DVec3::new(x, y, -1.0), direction: DVec3::Z, t_min: 0.0, t_max: f64::INFINITY }
}

const WHITE: &[(f64, [f64; 3])] = &[(0.0, [1.0; 3])];
const GREY_RAMP: &[(f64, [f64; 3])] = &[(0.0, [0.0; 3]), (1.0, [1.0; 3])];

/// The grey value and opacity that `ray` gives through a cube whose scalar is z.
fn through_ramp(transfer: &TransferFunction, ray: Ray) -> [f64; 2] {
    let (mesh, tets, field) = cubes(1, 0.0, |_, p| [p.z]);
    let p = Reference::new(&mesh, &tets, &field, transfer).unwrap().ray(&ray, Blend::Composite);
    assert_eq!((p[0], p[0]), (p[1], p[2]));
    [p[0], p[3]]
}

#[track_caller]
fn near<const N: usize>(got: [f64; N], expected: [f64; N]) {
    let close = got.iter().zip(&expected).all(|(a, b)| (a - b).abs() <= 1e-10);
    assert!(close, "{got:?}, not {expected:?}");
}

#[test]
fn uniform_cube_absorbs_exponentially() {
    let alpha = 1.0 - (-1.4_f64).exp();
    let tf = transfer(&[(0.0, [0.5; 3])], &[(0.0, 0.7)], 0.5);
    near(through_ramp(&tf, along_z(0.3, 0.4)), [alpha / 2.0, alpha]);
    assert_eq!(through_ramp(&tf, along_z(1.3, 0.4)), [0.0, 0.0], "beside the cube");
}

#[test]
fn rays_in_faces_and_edges_lose_nothing() {
    let tf = transfer(WHITE, &[(0.0, 0.7)], 0.5);
    let alpha = 1.0 - (-1.4_f64).exp();
    near(through_ramp(&tf, along_z(0.5, 0.5)), [alpha; 2]);
    let ray = |origin: DVec3, direction: DVec3| Ray { origin, direction: direction.normalize(), ..along_z(0.0, 0.0) };
    let beside = |d: DVec3| through_ramp(&tf, ray(DVec3::splat(0.5) - d * 2.0, d))[1];
    near([beside(DVec3::ONE)], [1.0 - (-1.4 * 3_f64.sqrt()).exp()]);
    near([beside(DVec3::new(1.0, 1.0, 0.0))], [1.0 - (-1.4 * 2_f64.sqrt()).exp()]);
    // Rounding decides on which side of the cube's own edge a ray lies, but never what is inside.
    for i in 0..200 {
        let x = f64::from(i) / 200.0 + 1e-3;
        near([through_ramp(&tf, along_z(x, x))[1], through_ramp(&tf, along_z(x, 0.5))[1]], [alpha; 2]);
    }
}

#[test]
fn linear_extinction_gives_the_error_function() {
    // ∫ z k z exp(−k z²/2) = sqrt(π/2k) erf(sqrt(k/2)) − exp(−k/2), with k = 8 and erf(2).
    let expected = (std::f64::consts::PI / 16.0).sqrt() * 0.995_322_265_018_952_7 - (-4.0_f64).exp();
    let tf = transfer(GREY_RAMP, &[(0.0, 0.0), (1.0, 8.0)], 1.0);
    near(through_ramp(&tf, along_z(0.3, 0.4)), [expected, 1.0 - (-4.0_f64).exp()]);
}

#[test]
fn a_dense_front_hides_what_is_behind() {
    // As the extinction grows, the colour is that of the front plus c'/τ.
    let tf = transfer(GREY_RAMP, &[(0.0, 1e6)], 1.0);
    near(through_ramp(&tf, along_z(0.3, 0.4)), [1e-6, 1.0]);
}

#[test]
fn a_step_and_a_narrow_peak_are_not_missed() {
    let step = transfer(&[(0.5, [1.0; 3]), (0.5, [0.0; 3])], &[(0.25, 0.0), (0.25, 2.0)], 1.0);
    near(through_ramp(&step, along_z(0.3, 0.4)), [1.0 - (-0.5_f64).exp(), 1.0 - (-1.5_f64).exp()]);
    let peak = transfer(WHITE, &[(0.4, 0.0), (0.4001, 1e4), (0.4002, 0.0)], 1.0);
    near([through_ramp(&peak, along_z(0.3, 0.4))[1]], [1.0 - (-1.0_f64).exp()]);
}

#[test]
fn outside_the_knots_clamp_decides() {
    let tf = transfer(WHITE, &[(0.25, 1.0), (0.5, 1.0)], 1.0);
    near([through_ramp(&tf, along_z(0.3, 0.4))[1]], [1.0 - (-1.0_f64).exp()]);
    let tf = transfer(&[(0.0, [1.0; 3]), (1.0, [1.0; 3])], &[(0.25, 1.0), (0.5, 1.0)], 1.0).with_clamp(false);
    near(through_ramp(&tf, along_z(0.3, 0.4)), [1.0 - (-0.25_f64).exp(); 2]);
}

#[test]
fn direct_emission_is_not_multiplied_by_extinction() {
    let direct = |a: f64| transfer(WHITE, &[(0.0, a)], 1.0).with_emission(Emission::Direct { scale: 0.3 }).unwrap();
    near(through_ramp(&direct(0.0), along_z(0.3, 0.4)), [0.3, 0.0]);
    let alpha = 1.0 - (-2.0_f64).exp();
    near(through_ramp(&direct(2.0), along_z(0.3, 0.4)), [0.3 * alpha / 2.0, alpha]);
}

#[test]
fn opacity_is_that_of_a_slab() {
    let opacity = |knots| transfer(GREY_RAMP, knots, 0.5).with_convention(Convention::Opacity);
    near([through_ramp(&opacity(&[(0.0, 0.75)]), along_z(0.3, 0.4))[1]], [0.9375]);
    // −ln(1 − z) is integrable: a peak that only touches 1 lets light through.
    near([through_ramp(&opacity(&[(0.0, 0.0), (1.0, 1.0)]), along_z(0.3, 0.4))[1]], [1.0 - (-2.0_f64).exp()]);
    let peak = opacity(&[(0.0, 0.0), (0.5, 1.0), (1.0, 0.0)]);
    near([through_ramp(&peak, along_z(0.3, 0.4))[1]], [1.0 - (-2.0_f64).exp()]);
    // Nearly constant opacity: no digits are lost to the difference.
    let flat = opacity(&[(0.0, 0.75), (1.0, 0.75 + 1e-9)]);
    near([through_ramp(&flat, along_z(0.3, 0.4))[1]], [1.0 - (0.25_f64 - 0.5e-9).powi(2)]);
}

#[test]
fn opacity_one_ends_the_ray() {
    let opacity = |knots| transfer(GREY_RAMP, knots, 0.5).with_convention(Convention::Opacity);
    let wall = opacity(&[(0.25, 0.0), (0.25, 1.0)]);
    near(through_ramp(&wall, along_z(0.3, 0.4)), [0.25, 1.0]);
    // In white, all that is emitted before the wall and at it adds up to 1.
    let slope = transfer(WHITE, &[(0.0, 0.0), (1.0, 2.0)], 0.5).with_convention(Convention::Opacity);
    near(through_ramp(&slope, along_z(0.3, 0.4)), [1.0, 1.0]);
    // A stretch at 1 and above is a wall also where rounding puts its end a little below 1.
    for i in 0..50 {
        let s = 0.3 + f64::from(i) * 1e-3;
        let knots = [(0.0, 0.2), (s, 1.0), (s + 0.1, 1.3), (1.0, 0.0)];
        let wall = transfer(WHITE, &knots, 0.5).with_convention(Convention::Opacity);
        near(through_ramp(&wall, along_z(0.3, 0.4)), [1.0, 1.0]);
    }
    let direct = wall.with_emission(Emission::Direct { scale: 2.0 }).unwrap();
    near(through_ramp(&direct, along_z(0.3, 0.4)), [2.0 * 0.25 * 0.25 / 2.0, 1.0]);
}

#[test]
fn a_ray_sees_only_its_own_part() {
    let tf = transfer(WHITE, &[(0.0, 1.0)], 1.0);
    let absorbed = |t_min, t_max| through_ramp(&tf, Ray { t_min, t_max, ..along_z(0.3, 0.4) })[1];
    near([absorbed(0.0, 1.25), absorbed(1.25, 1.5)], [1.0 - (-0.25_f64).exp(); 2]);
    near([absorbed(f64::NEG_INFINITY, f64::INFINITY)], [1.0 - (-1.0_f64).exp()]);
    assert_eq!(absorbed(1.5, 1.25), 0.0);
    let inside = Ray { origin: DVec3::new(0.3, 0.4, 0.5), ..along_z(0.0, 0.0) };
    near([through_ramp(&tf, inside)[1]], [1.0 - (-0.5_f64).exp()]);
    let back = Ray { direction: -DVec3::Z, ..inside };
    near([through_ramp(&tf, back)[1]], [1.0 - (-0.5_f64).exp()]);
}

#[test]
fn a_view_is_clipped_by_planes_and_depth() {
    let (mesh, tets, field) = cubes(1, 0.0, |_, p| [p.z]);
    let tf = transfer(WHITE, &[(0.0, 1.0)], 1.0);
    let camera = Camera {
        position: DVec3::new(0.5, 0.5, -1.0),
        focal_point: DVec3::new(0.5, 0.5, 0.0),
        view_up: DVec3::Y,
        projection: Projection::Parallel { parallel_scale: 0.5 },
    };
    let view = View::new(camera, [2, 2]).unwrap();
    let plane = ClippingPlane { origin: DVec3::new(0.0, 0.0, 0.5), normal: DVec3::new(0.0, 0.0, 3.0) };
    let depth = DepthBuffer { kind: DepthKind::Eye, values: vec![1.75, f64::INFINITY, 1.25, f64::NAN] };
    let view = view.with_clipping_planes(vec![plane]).unwrap().with_depth(depth).unwrap();
    let alpha = Reference::new(&mesh, &tets, &field, &tf).unwrap().render(&view).into_iter().map(|p| p[3]);
    let expected = [0.25_f64, 0.5, 0.0, 0.5].map(|l| 1.0 - (-l).exp());
    near(alpha.collect::<Vec<_>>().try_into().unwrap(), expected);
    let image = render(&mesh, &tets, &field, &tf, &view).unwrap();
    assert_eq!((image.size, image.pixels[0][3]), ([2, 2], expected[0] as f32));
}

#[test]
fn layers_and_overlaps_are_composited_by_entry() {
    let tf = transfer(&[(0.0, [1.0, 0.0, 0.0]), (1.0, [0.0, 1.0, 0.0])], &[(0.0, 1.0), (1.0, 2.0)], 1.0);
    for step in [1.0, 0.5, 5.0] {
        for flip in [0, 1] {
            let (mesh, tets, field) = cubes(2, step, |cube, _| [f64::from(cube ^ flip)]);
            let p = Reference::new(&mesh, &tets, &field, &tf).unwrap().ray(&along_z(0.3, 0.2), Blend::Composite);
            let (red, green) = (1.0 - (-1.0_f64).exp(), 1.0 - (-2.0_f64).exp());
            // Overlapping cubes interleave: their tetrahedra are sorted, not they.
            if step >= 1.0 {
                let [front, back] = if flip == 0 { [red, green] } else { [green, red] };
                let (first, second) = (front, back * (1.0 - front));
                near(
                    p,
                    if flip == 0 {
                        [first, second, 0.0, 1.0 - (-3.0_f64).exp()]
                    } else {
                        [second, first, 0.0, 1.0 - (-3.0_f64).exp()]
                    },
                );
            } else {
                near([p[3]], [1.0 - (-3.0_f64).exp()]);
            }
        }
    }
}

#[test]
fn cell_values_are_constant_in_their_cell() {
    let (mesh, mut tets, _) = cubes(2, 1.0, |_, p| [p.z]);
    tets.cell = Some((0..12).map(|t| t / 6).collect());
    let cells =
        Array { name: "c".into(), components: 1, values: Values::F64([vec![0.0, 1.0], vec![0.0; 10]].concat()) };
    let field = Field::from_array(&cells, Association::Cell, Component::Index(0)).unwrap();
    let tf = transfer(WHITE, &[(0.0, 0.5), (1.0, 3.0)], 1.0);
    let reference = Reference::new(&mesh, &tets, &field, &tf).unwrap();
    near([reference.ray(&along_z(0.3, 0.4), Blend::Composite)[3]], [1.0 - (-3.5_f64).exp()]);
}

#[test]
fn two_and_four_components_drive_color_and_opacity() {
    let alpha = 1.0 - (-1.0_f64).exp();
    let (mesh, tets, field) = cubes(1, 0.0, |_, p| [p.x, p.z]);
    let tf = transfer(GREY_RAMP, &[(0.0, 0.0), (1.0, 2.0)], 1.0);
    let p = Reference::new(&mesh, &tets, &field, &tf).unwrap().ray(&along_z(0.25, 0.4), Blend::Composite);
    near(p, [0.25 * alpha, 0.25 * alpha, 0.25 * alpha, alpha]);
    let (mesh, tets, field) = cubes(1, 0.0, |_, p| [p.x, 1.0, p.y, p.z]);
    let p = Reference::new(&mesh, &tets, &field, &tf).unwrap().ray(&along_z(0.25, 0.5), Blend::Composite);
    near(p, [0.25 * alpha, alpha, 0.5 * alpha, alpha]);
}

#[test]
fn maximum_shows_the_largest_visible_value() {
    let (mesh, tets, field) = cubes(1, 0.0, |_, p| [p.z]);
    let tf = transfer(GREY_RAMP, &[(0.0, 0.0), (1.0, 1.6)], 7.0);
    let reference = Reference::new(&mesh, &tets, &field, &tf).unwrap();
    let largest = |t_max: f64| reference.ray(&Ray { t_max, ..along_z(0.3, 0.4) }, Blend::Maximum);
    near(largest(1.5), [0.4, 0.4, 0.4, 0.8]);
    near(largest(f64::INFINITY), [1.0; 4]);
    assert_eq!(largest(0.5), [0.0; 4]);
}

#[test]
fn cells_that_touch_nan_are_invisible() {
    let tf = transfer(WHITE, &[(0.0, 1.0)], 1.0);
    let value = |cube, p: DVec3| if cube == 0 && p == DVec3::X { [f64::NAN] } else { [1.0] };
    let (mesh, tets, field) = cubes(2, 1.0, value);
    let reference = Reference::new(&mesh, &tets, &field, &tf).unwrap();
    // The corner belongs to the two tetrahedra with x ≥ y, x ≥ z.
    near([reference.ray(&along_z(0.3, 0.4), Blend::Composite)[3]], [1.0 - (-2.0_f64).exp()]);
    near([reference.ray(&along_z(0.9, 0.1), Blend::Composite)[3]], [1.0 - (-1.1_f64).exp()]);
}

#[test]
fn far_from_the_origin_nothing_changes() {
    let tf = transfer(WHITE, &[(0.0, 0.0), (1.0, 8.0)], 1.0);
    let ray = Ray { origin: DVec3::new(0.3, 0.4, -1e6), ..along_z(0.0, 0.0) };
    near([through_ramp(&tf, ray)[1]], [1.0 - (-4.0_f64).exp()]);
}

#[test]
fn what_does_not_fit_is_refused() {
    let (mesh, tets, _) = cubes(1, 0.0, |_, p| [p.z]);
    let (_, _, other) = cubes(2, 1.0, |_, p| [p.z]);
    let tf = transfer(WHITE, &[(0.0, 1.0)], 1.0);
    assert!(matches!(Reference::new(&mesh, &tets, &other, &tf), Err(Error::Field(_))));
    let (mesh, _, field) = cubes(1, 0.0, |_, p| [p.z]);
    let tets = Tetrahedra { corners: vec![[0, 1, 2, 8]], ..Default::default() };
    assert!(matches!(Reference::new(&mesh, &tets, &field, &tf), Err(Error::Mesh(_))));
}
