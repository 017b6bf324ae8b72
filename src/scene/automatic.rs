//! What is drawn when nobody says: an array, a range, colours, opacities and a view that show something of any mesh.

mod array;
mod range;

pub use array::chosen;
pub use range::range;

use super::{Scalars, Scene};
use crate::error::Result;
use crate::field::{Association, Field};
use crate::mesh::{Mesh, cells::Tetrahedra};
use crate::transfer::TransferFunction;
use crate::transfer::colormap::ColorMap;
use crate::view::{Blend, Camera, Projection};
use glam::DVec3;
use std::path::PathBuf;

/// Behind the volume: dark, but not so that black parts of it vanish.
const BACKGROUND: [f64; 3] = [0.11, 0.12, 0.14];

const SIZE: [u32; 2] = [1024, 768];

/// At most so many tetrahedra are looked at.
const SAMPLES: usize = 1 << 20;

/// Opacity bands over the range.
const BANDS: usize = 7;

/// Optical depth of the mean ray through the whole mesh, and that of the mesh's depth at opacity 1.
const DEPTH: f64 = 1.6;
const DEPTH_SOLID: f64 = 10.0;

/// What of the look somebody did say.
#[derive(Debug, Clone, Default)]
pub struct Wishes {
    /// The scalars that colours and opacities range over.
    pub range: Option<[f64; 2]>,
    /// The colours.
    pub map: Option<ColorMap>,
    /// The opacities.
    pub opacity: Option<Opacity>,
    /// The length that opacities are meant for, in world units.
    pub unit_distance: Option<f64>,
    /// How the values along a ray become a pixel.
    pub blend: Blend,
}

/// Where a knot of an opacity function is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Place {
    /// At a scalar.
    Scalar(f64),
    /// At this share of the range: 0 is its start, 1 its end.
    Share(f64),
}

/// An opacity function whose knots may move with the range of scalars.
#[derive(Debug, Clone, PartialEq)]
pub struct Opacity(pub Vec<(Place, f64)>);

impl Opacity {
    /// Its knots, scalar and opacity, for a range of scalars.
    pub fn over(&self, [lo, hi]: [f64; 2]) -> Vec<(f64, f64)> {
        let at = |place| match place {
            Place::Scalar(s) => s,
            Place::Share(share) => lo + (hi - lo) * share,
        };
        self.0.iter().map(|&(place, a)| (at(place), a)).collect()
    }
}

/// The array to draw; see [`chosen`]. Says in the log which, and why.
///
/// # Errors
/// [`Error::Field`] if there is no array.
///
/// [`Error::Field`]: crate::Error::Field
pub fn scalars(mesh: &Mesh, of: Option<Association>) -> Result<Scalars> {
    let (scalars, why) = chosen(mesh, of)?;
    let of = if scalars.association == Some(Association::Cell) { "cells" } else { "points" };
    tracing::info!("array \"{}\" of {of} is drawn: {why}", scalars.name);
    Ok(scalars)
}

/// A view of the whole mesh: perspective, from the front right and above, z up.
pub fn camera(mesh: &Mesh, tetrahedra: &Tetrahedra) -> Camera {
    let (lo, hi) = bounds(mesh, tetrahedra);
    let center = lo.midpoint(hi);
    let points = tetrahedra.points(mesh.points());
    let far = |r: f64, p: u32| r.max(points[p as usize].distance(center));
    let radius = tetrahedra.corners.as_flattened().iter().fold(0.0, |r, &p| far(r, p));
    let view_angle = 30.0_f64;
    // All cells may be flat at one place, and still need a camera.
    let radius = if radius > 0.0 { radius } else { 1.0 };
    Camera {
        position: center + direction() * (1.05 * radius / (view_angle.to_radians() / 2.0).sin()),
        focal_point: center,
        view_up: DVec3::Z,
        projection: Projection::Perspective { view_angle },
    }
}

/// From the mesh to the camera.
fn direction() -> DVec3 {
    let (azimuth, elevation) = (30.0_f64.to_radians(), 25.0_f64.to_radians());
    DVec3::new(azimuth.sin() * elevation.cos(), -azimuth.cos() * elevation.cos(), elevation.sin())
}

/// The box around all tetrahedra.
pub fn bounds(mesh: &Mesh, tetrahedra: &Tetrahedra) -> (DVec3, DVec3) {
    let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let points = tetrahedra.points(mesh.points());
    tetrahedra.corners.as_flattened().iter().fold(empty, |(lo, hi), &p| {
        let p = points[p as usize];
        (lo.min(p), hi.max(p))
    })
}

/// A scene that shows `field`, which `scalars` are in `mesh`.
///
/// # Errors
/// [`Error::Transfer`] if what was wished for is no transfer function.
pub fn scene(mesh: &Mesh, tetrahedra: &Tetrahedra, scalars: Scalars, field: &Field, wishes: Wishes) -> Result<Scene> {
    Ok(Scene {
        mesh: PathBuf::new(),
        transfer: transfer(mesh, tetrahedra, &scalars, field, &wishes)?,
        scalars,
        camera: camera(mesh, tetrahedra),
        size: SIZE,
        pixel_offset: Default::default(),
        clipping_range: None,
        clipping_planes: Vec::new(),
        opaque: Vec::new(),
        depth: None,
        blend: wishes.blend,
        background: Some(BACKGROUND),
        engine: None,
        device: None,
        integral: None,
        projection: None,
    })
}

/// What the mesh and the field are like, from a sample of the tetrahedra.
struct Sample {
    /// Scalar somewhere in a tetrahedron, and its volume; ascending.
    values: Vec<(f64, f64)>,
    /// Volume of the mesh over the area that its box shows to the camera: the length of a mean ray in it.
    depth: f64,
}

impl Sample {
    fn new(mesh: &Mesh, tetrahedra: &Tetrahedra, field: &Field) -> Self {
        let step = tetrahedra.corners.len().div_ceil(SAMPLES).max(1);
        let (mut values, mut volume) = (Vec::new(), 0.0);
        let points = tetrahedra.points(mesh.points());
        let (at_points, components) = (field.association() == Association::Point, field.kind().components());
        let scalars = if at_points { tetrahedra.values(field.values(), components) } else { field.values() };
        for t in (0..tetrahedra.corners.len()).step_by(step) {
            let corners = tetrahedra.corners[t];
            let [a, b, c, d] = corners.map(|p| points[p as usize]);
            let v = (b - a).cross(c - a).dot(d - a).abs() / 6.0 * step as f64;
            volume += v;
            let at = match field.association() {
                Association::Cell => tetrahedra.cell.as_ref().map_or(t, |cell| cell[t] as usize),
                // One corner, not their mean: that would lose the extremes.
                Association::Point => corners[t / step % 4] as usize,
            };
            let s = scalars[at * components];
            if s.is_finite() {
                values.push((s, v));
            }
        }
        values.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (lo, hi) = bounds(mesh, tetrahedra);
        let (e, d) = (hi - lo, direction().abs());
        let depth = volume / (d.x * e.y * e.z + d.y * e.z * e.x + d.z * e.x * e.y);
        Sample { values, depth: if depth > 0.0 && depth.is_finite() { depth } else { 1.0 } }
    }

    /// Soft bands of opacity. What fills the mesh is clearer than what is rare, so that no value hides the others;
    /// scaled so that the mean ray has the optical depth [`DEPTH`] at a unit distance of a [`DEPTH_SOLID`]th of the
    /// mesh.
    fn bands(&self, [lo, hi]: [f64; 2]) -> Vec<(f64, f64)> {
        let width = (hi - lo) / BANDS as f64;
        let mut share = [0.0; BANDS];
        for &(s, v) in &self.values {
            share[(((s - lo) / width).max(0.0) as usize).min(BANDS - 1)] += v;
        }
        let total = share.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let peak = share.map(|v| {
            // Twice as steep above the mean frequency, or what fills the mesh would veil it.
            let frequency = v / total * BANDS as f64;
            1.0 / ((frequency + 0.1) * (1.0 + frequency))
        });
        let mut knots = Vec::new();
        for (i, p) in peak.into_iter().enumerate() {
            let (from, next) = (lo + width * i as f64, peak[(i + 1).min(BANDS - 1)]);
            if i == 0 {
                knots.push((lo, p));
            }
            knots.push((from + width * 0.5, p));
            knots.push((if i + 1 < BANDS { from + width } else { hi }, 0.1 * p.min(next)));
        }
        if let Some(last) = knots.last_mut() {
            last.1 = peak[BANDS - 1];
        }
        knots
    }

    /// Optical depth of the mean ray, with a unit distance of a [`DEPTH_SOLID`]th of the mesh.
    fn optical_depth(&self, transfer: &TransferFunction) -> f64 {
        let (sum, volume) = self
            .values
            .iter()
            .fold((0.0, 0.0), |(sum, volume), &(s, v)| (sum + v * transfer.opacity_at(s), volume + v));
        if volume > 0.0 { DEPTH_SOLID * sum / volume } else { 0.0 }
    }
}

fn transfer(
    mesh: &Mesh,
    tetrahedra: &Tetrahedra,
    scalars: &Scalars,
    field: &Field,
    wishes: &Wishes,
) -> Result<TransferFunction> {
    let sample = Sample::new(mesh, tetrahedra, field);
    let (mut range, note) = match wishes.range {
        Some(range) => (range, "as asked for".to_owned()),
        None => {
            let (range, note) = range(mesh, tetrahedra, scalars)
                .unwrap_or_else(|| (field.range(0), "the values of the array".to_owned()));
            (widened(range), note)
        }
    };
    let [lo, hi] = range;
    // Values on both sides of zero are told apart by colour.
    let signed = lo < 0.0 && hi > 0.0 && lo.abs().min(hi.abs()) > 0.25 * lo.abs().max(hi.abs());
    if signed && wishes.range.is_none() && wishes.map.is_none() {
        let most = hi.max(-lo);
        range = [-most, most];
    }
    let map = match &wishes.map {
        Some(map) => map.clone(),
        None => ColorMap::named(if signed { "cool to warm" } else { "viridis" })?,
    };
    let unit = wishes.unit_distance.unwrap_or_else(|| rounded(sample.depth / DEPTH_SOLID));
    let said = wishes.opacity.as_ref().map(|o| o.over(range)).or_else(|| map.opacity_over(range));
    let mut opacity = match (&said, wishes.blend) {
        (Some(knots), _) => knots.clone(),
        (None, Blend::Maximum) => vec![(range[0], 0.0), (range[1], 1.0)],
        (None, Blend::Composite) => sample.bands(range),
    };
    if said.is_none() && wishes.blend == Blend::Composite {
        let depth = sample.optical_depth(&TransferFunction::new(map.over(range), opacity.clone(), unit)?);
        let scale = if depth > 0.0 { DEPTH / depth } else { 1.0 };
        let unit_scale = unit / (sample.depth / DEPTH_SOLID);
        opacity.iter_mut().for_each(|k| k.1 = rounded(k.1 * scale * unit_scale));
    }
    let name = &scalars.name;
    tracing::info!("drawing \"{name}\" from {} to {} ({note}), unit distance {unit}", range[0], range[1]);
    TransferFunction::new(map.over(range), opacity, unit)
}

/// A range of a single value is made one around it.
pub fn widened([lo, hi]: [f64; 2]) -> [f64; 2] {
    if hi > lo { [lo, hi] } else { [lo - 0.5 * lo.abs().max(1.0), hi + 0.5 * hi.abs().max(1.0)] }
}

/// To three digits.
fn rounded(x: f64) -> f64 {
    format!("{x:.2e}").parse().unwrap_or(x)
}
