//! From where a mesh is seen when nobody says: so that it fills the picture.

use crate::field::{Association, Field};
use crate::mesh::Mesh;
use crate::mesh::cells::Tetrahedra;
use crate::view::{Camera, Projection, View, hull_area};
use glam::{DVec2, DVec3};

/// Vertical angle of view, in degrees.
const VIEW_ANGLE: f64 = 30.0;

/// The share of width or height that the mesh spans.
const FILL: f64 = 0.94;

/// Azimuths and elevations, in degrees, from the front (−y) and the ground; the first is taken unless another shows the
/// mesh over so many times its area.
const DIRECTIONS: [[f64; 2]; 4] = [[30.0, 25.0], [60.0, 25.0], [30.0, 50.0], [60.0, 50.0]];
const BETTER: f64 = 1.25;

/// Points that the area is estimated from.
const SAMPLED: usize = 4096;

/// A view of the whole mesh for pictures of `size` (width, height): perspective, z up, from the front right and above, or
/// further from the side or above where flat or long meshes show more of themselves. What is drawn spans 94 % of the width
/// or height: all, or what has finite values of `field`.
pub fn camera(mesh: &Mesh, tetrahedra: &Tetrahedra, field: Option<&Field>, size: [u32; 2]) -> Camera {
    let points = used(mesh, tetrahedra, field);
    let projection = Projection::Perspective { view_angle: VIEW_ANGLE };
    let from = |[azimuth, elevation]: [f64; 2]| {
        let (azimuth, elevation) = (azimuth.to_radians(), elevation.to_radians());
        let direction = DVec3::new(azimuth.sin() * elevation.cos(), -azimuth.cos() * elevation.cos(), elevation.sin());
        let camera = Camera { position: direction, focal_point: DVec3::ZERO, view_up: DVec3::Z, projection };
        let camera = around(&points, camera, size);
        (shown(&points, camera, size), camera)
    };
    let mut best = from(DIRECTIONS[0]);
    for other in &DIRECTIONS[1..] {
        let other = from(*other);
        if other.0 > BETTER * best.0 {
            best = other;
        }
    }
    best.1
}

/// `camera`, moved along its view and aside so that what is drawn fills pictures of `size`, as [`camera`] has it; it stays
/// what it is if that is not possible. The scale of a parallel view stays.
pub fn framed(mesh: &Mesh, tetrahedra: &Tetrahedra, field: Option<&Field>, camera: Camera, size: [u32; 2]) -> Camera {
    around(&used(mesh, tetrahedra, field), camera, size)
}

/// The points of the tetrahedra that have finite values of `field`; of all if none has, or there is no field.
fn used(mesh: &Mesh, tetrahedra: &Tetrahedra, field: Option<&Field>) -> Vec<DVec3> {
    let points = tetrahedra.points(mesh.points());
    let mut used = vec![false; points.len()];
    for (t, corners) in tetrahedra.corners.iter().enumerate() {
        if field.is_none_or(|field| is_drawn(tetrahedra, field, t)) {
            corners.iter().for_each(|&p| used[p as usize] = true);
        }
    }
    if field.is_some() && !used.contains(&true) {
        return self::used(mesh, tetrahedra, None);
    }
    points.iter().zip(used).filter_map(|(p, used)| used.then_some(*p)).collect()
}

/// Whether all values of a tetrahedron are finite.
fn is_drawn(tetrahedra: &Tetrahedra, field: &Field, tetrahedron: usize) -> bool {
    let n = field.kind().components();
    let is_finite = |i: u32| {
        let first = i as usize * n;
        first + n <= field.len() && (first..first + n).all(|k| field.value(k).is_finite())
    };
    let added = &tetrahedra.added;
    match field.association() {
        Association::Cell => is_finite(tetrahedra.cell.as_ref().map_or(tetrahedron as u32, |c| c[tetrahedron])),
        Association::Point => tetrahedra.corners[tetrahedron].iter().all(|&p| match p.checked_sub(added.first) {
            Some(i) if !added.is_empty() => added.of(i as usize).all(|(source, _)| is_finite(source)),
            _ => is_finite(p),
        }),
    }
}

fn around(points: &[DVec3], camera: Camera, size: [u32; 2]) -> Camera {
    let towards = camera.position - camera.focal_point;
    let angle = match camera.projection {
        Projection::Perspective { view_angle } => view_angle,
        Projection::Parallel { .. } => VIEW_ANGLE,
    };
    let filled = Camera::filled(points, towards, camera.view_up, angle, size, FILL);
    filled.map_or(camera, |filled| Camera { projection: camera.projection, ..filled })
}

/// The area of the mesh's outline in a picture, in pixels, but for its bays.
fn shown(points: &[DVec3], camera: Camera, size: [u32; 2]) -> f64 {
    let Ok(view) = View::new(camera, size) else { return 0.0 };
    let step = points.len().div_ceil(SAMPLED).max(1);
    let seen = points.iter().step_by(step).filter_map(|&p| view.pixel(p));
    hull_area(&mut seen.collect::<Vec<DVec2>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Component;
    use crate::mesh::generate;

    /// Whatever is turned or stretched how: the mesh spans what it should, and nothing is cut off.
    #[test]
    fn meshes_fill_pictures() {
        for stretch in [DVec3::ONE, DVec3::new(1.0, 30.0, 1.0), DVec3::new(5.0, 5.0, 0.05), DVec3::new(0.1, 0.1, 9.0)] {
            let demo = generate::demo(3);
            let points = demo.points().iter().map(|p| *p * stretch + 1e3).collect();
            let mesh = Mesh::new(points, demo.cells().clone(), vec![], vec![]).unwrap();
            let tetrahedra = Tetrahedra::new(&mesh).unwrap();
            for size in [[1024, 768], [300, 700]] {
                let camera = camera(&mesh, &tetrahedra, None, size);
                let turned = Camera { position: camera.focal_point + DVec3::new(1.0, 2.0, -0.5), ..camera };
                for camera in [camera, framed(&mesh, &tetrahedra, None, turned, size)] {
                    let view = View::new(camera, size).unwrap();
                    let all = mesh.points().iter().map(|&p| view.pixel(p).unwrap() / DVec2::from(size.map(f64::from)));
                    let (lo, hi) = all.fold((DVec2::ONE, DVec2::ZERO), |(l, h), p| (l.min(p), h.max(p)));
                    assert!(lo.min_element() > 0.0 && hi.max_element() < 1.0, "{lo} to {hi}");
                    assert!(((hi - lo).max_element() - FILL).abs() < 1e-3, "{lo} to {hi}");
                }
            }
        }
    }

    /// What has no value is not drawn, and takes no room.
    #[test]
    fn what_is_drawn_fills_pictures() {
        let mesh = generate::mixed(4);
        let tetrahedra = Tetrahedra::new(&mesh).unwrap();
        let value = |x: f64| if x > 0.1 { f64::NAN } else { x };
        let size = [400, 300];
        let of =
            |association, values: &[f64]| Field::from_slice("s", values, 1, association, Component::Index(0)).unwrap();
        let points: Vec<f64> = mesh.points().iter().map(|p| value(p.x)).collect();
        let cells: Vec<f64> = (0..mesh.cells().len()).map(|i| if i % 3 == 0 { 1.0 } else { f64::INFINITY }).collect();
        for field in [of(Association::Point, &points), of(Association::Cell, &cells)] {
            let drawn = used(&mesh, &tetrahedra, Some(&field));
            assert!(drawn.len() < used(&mesh, &tetrahedra, None).len() && drawn.len() > 8);
            assert!(field.association() == Association::Cell || drawn.iter().all(|p| p.x <= 0.1));
            let view = View::new(camera(&mesh, &tetrahedra, Some(&field), size), size).unwrap();
            let all = drawn.iter().map(|&p| view.pixel(p).unwrap() / DVec2::from(size.map(f64::from)));
            let (lo, hi) = all.fold((DVec2::ONE, DVec2::ZERO), |(l, h), p| (l.min(p), h.max(p)));
            assert!(((hi - lo).max_element() - FILL).abs() < 1e-3, "{lo} to {hi}");
        }
        // Where nothing is drawn, all.
        let nothing: Vec<f64> = (0..points.len()).map(|i| if i == 0 { 1.0 } else { f64::NAN }).collect();
        let nothing = of(Association::Point, &nothing);
        assert_eq!(used(&mesh, &tetrahedra, Some(&nothing)), used(&mesh, &tetrahedra, None));
    }
}
