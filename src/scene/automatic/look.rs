//! Colours and opacities that show something of any field, from what a view sees of it.

use super::{Wishes, widened};
use crate::error::Result;
use crate::field::{Association, Field, Kind};
use crate::mesh::Mesh;
use crate::mesh::cells::Tetrahedra;
use crate::scene::Scalars;
use crate::transfer::colormap::ColorMap;
use crate::transfer::{Axis, TransferFunction};
use crate::view::{Blend, Camera, Projection, View};
use glam::DVec3;
use rayon::prelude::*;

/// Places in the mesh that are looked at.
const PLACES: usize = 1 << 18;

/// The picture that they are gathered in.
const COARSE: [u32; 2] = [64, 48];

/// Opacity bands over the range.
const BANDS: usize = 7;

/// The mean opacity of the pixels that see the mesh.
const OPACITY: f64 = 0.62;

/// Unit distances in the length of the mean ray.
const UNITS: f64 = 10.0;

/// How far opacities that nobody said may be off on a logarithmic axis, of the largest: below what 8 bits show.
const TOLERANCE: f64 = 1.0 / 255.0;

/// How far those may be off that somebody said.
const TOLERANCE_SAID: f64 = 1e-4;

/// Decades that a range on a logarithmic axis has at most when nobody says it: 32-bit floats tell no more apart.
const DECADES: i32 = 6;

/// A place in the mesh, and what it stands for.
#[derive(Clone, Copy)]
struct Place {
    /// What drives the colour there, and what the opacity.
    color: f64,
    opacity: f64,
    volume: f64,
    /// The pixel that sees it, and the length of a ray that its volume fills there; none if none does.
    seen: Option<(u32, f64)>,
}

/// What the mesh and the field are like, from places spread over the volume.
pub(super) struct Sample {
    places: Vec<Place>,
    /// The length of the mean ray through the mesh; 1 if it has no volume.
    depth: f64,
}

impl Sample {
    pub(super) fn new(mesh: &Mesh, tetrahedra: &Tetrahedra, field: &Field, camera: Camera) -> Self {
        let points = tetrahedra.points(mesh.points());
        let count = tetrahedra.corners.len();
        let volume = |t: usize| {
            let [a, b, c, d] = tetrahedra.corners[t].map(|p| points[p as usize]);
            (b - a).cross(c - a).dot(d - a).abs() / 6.0
        };
        // Of very many tetrahedra only some, each for its likes.
        let step = count.div_ceil(PLACES).max(1);
        let chosen: Vec<usize> = (0..count).step_by(step).collect();
        let total: f64 = chosen.par_iter().map(|&t| volume(t)).sum();
        let n = field.kind().components();
        let values = match field.association() {
            Association::Point => tetrahedra.values(field.values(), n),
            Association::Cell => field.values(),
        };
        let view = View::new(camera, COARSE).ok();
        let places: Vec<Place> = chosen
            .par_iter()
            .flat_map_iter(|&t| {
                let corners = tetrahedra.corners[t];
                let share = if total > 0.0 { volume(t) / total } else { 0.0 };
                let several = (share * PLACES as f64).ceil().clamp(1.0, PLACES as f64) as usize;
                let each = volume(t) * step as f64 / several as f64;
                let (points, values, view) = (&points, &values, &view);
                (0..several).map(move |i| {
                    let weights = inside(t + i);
                    let at = |k: usize| match field.association() {
                        Association::Point => (0..4).map(|c| weights[c] * values[corners[c] as usize * n + k]).sum(),
                        Association::Cell => {
                            let cell = tetrahedra.cell.as_ref().map_or(t, |cell| cell[t] as usize);
                            values[cell * n + k]
                        }
                    };
                    let point = (0..4).map(|c| points[corners[c] as usize] * weights[c]).sum();
                    let seen = view.as_ref().and_then(|view| seen(view, &camera, point, each));
                    Place { color: at(0), opacity: at(n - 1), volume: each, seen }
                })
            })
            .collect();
        let mut sample = Sample { places, depth: 1.0 };
        let lengths = sample.gathered(|_| 1.0);
        let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
        if mean > 0.0 && mean.is_finite() {
            sample.depth = mean;
        }
        // Where a value is not finite, nothing is drawn.
        sample.places.retain(|p| p.color.is_finite() && p.opacity.is_finite());
        sample
    }

    /// For each pixel that sees the mesh, the sum of lengths times what `of` says of a place.
    fn gathered(&self, of: impl Fn(&Place) -> f64) -> Vec<f64> {
        let pixels = COARSE[0] as usize * COARSE[1] as usize;
        let (mut sums, mut touched) = (vec![0.0; pixels], vec![false; pixels]);
        for place in &self.places {
            if let Some((pixel, length)) = place.seen {
                sums[pixel as usize] += length * of(place);
                touched[pixel as usize] = true;
            }
        }
        sums.into_iter().zip(touched).filter_map(|(sum, touched)| touched.then_some(sum)).collect()
    }

    /// The range to show on a logarithmic axis: that of the values above 0, of [`DECADES`] at most; none if there are
    /// none.
    fn positive_range(&self, [lo, hi]: [f64; 2]) -> Option<[f64; 2]> {
        let least = self.places.iter().map(|p| p.color).filter(|&v| v > 0.0).fold(f64::INFINITY, f64::min);
        // Of several meshes, this one may have no value above 0.
        let least = if least.is_finite() { least } else { 0.0 };
        let (least, hi) = if lo > 0.0 { (lo, hi) } else { (least, hi) };
        let lo = least.max(hi * 0.1_f64.powi(DECADES));
        if hi > 0.0 && lo < hi {
            return Some([lo, hi]);
        }
        (hi > 0.0).then_some([hi * 0.1, hi * 10.0])
    }

    /// Soft bands of opacity, by places on `axis`. What fills the mesh is clearer than what is rare, so that no value
    /// hides the others.
    fn bands(&self, axis: &Axis) -> Vec<(f64, f64)> {
        let width = 1.0 / BANDS as f64;
        let mut share = [0.0; BANDS];
        for p in &self.places {
            share[((axis.place(p.color) / width).max(0.0) as usize).min(BANDS - 1)] += p.volume;
        }
        let total = share.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let peak = share.map(|v| {
            // Twice as steep above the mean frequency, or what fills the mesh would veil it.
            let frequency = v / total * BANDS as f64;
            1.0 / ((frequency + 0.1) * (1.0 + frequency))
        });
        let mut knots = Vec::new();
        for (i, p) in peak.into_iter().enumerate() {
            let (from, next) = (width * i as f64, peak[(i + 1).min(BANDS - 1)]);
            if i == 0 {
                knots.push((0.0, p));
            }
            knots.push((from + width * 0.5, p));
            knots.push((if i + 1 < BANDS { from + width } else { 1.0 }, 0.1 * p.min(next)));
        }
        if let Some(last) = knots.last_mut() {
            last.1 = peak[BANDS - 1];
        }
        knots
    }

    /// The factor by which opacities give the pixels that see the mesh the mean opacity [`OPACITY`], by bisection of
    /// its logarithm; 1 if nothing is opaque.
    fn visible(&self, transfer: &TransferFunction) -> f64 {
        let unit = transfer.unit_distance();
        let depths = self.gathered(|p| transfer.opacity_at(p.opacity) / unit);
        let total: f64 = depths.iter().sum();
        let mean = total / depths.len() as f64;
        // Also where nothing is seen.
        if mean.is_nan() || mean <= 0.0 {
            return 1.0;
        }
        let opacity =
            |factor: f64| depths.iter().map(|depth| 1.0 - (-factor * depth).exp()).sum::<f64>() / depths.len() as f64;
        let (mut low, mut high) = ((1e-6 / mean).ln(), (1e6 / mean).ln());
        for _ in 0..60 {
            let middle = (low + high) / 2.0;
            if opacity(middle.exp()) < OPACITY { low = middle } else { high = middle }
        }
        low.exp()
    }
}

/// The pixel of a coarse picture that sees `point`, and how long a ray there is that fills `volume`.
fn seen(view: &View, camera: &Camera, point: DVec3, volume: f64) -> Option<(u32, f64)> {
    let at = view.pixel(point)?;
    let [w, h] = COARSE.map(f64::from);
    if !(at.x >= 0.0 && at.y >= 0.0 && at.x < w && at.y < h) {
        return None;
    }
    let half = match camera.projection {
        Projection::Perspective { view_angle } => {
            (view_angle.to_radians() / 2.0).tan() * (point - camera.position).dot(view.forward())
        }
        Projection::Parallel { parallel_scale } => parallel_scale,
    };
    let side = 2.0 * half / h;
    Some((at.y as u32 * COARSE[0] + at.x as u32, volume / (side * side)))
}

/// Barycentric coordinates of the `i`-th of places spread evenly over a tetrahedron: an additive sequence in the cube
/// (Roberts 2018), folded (Rocchini & Cignoni, Generating Random Points in a Tetrahedron, 2000).
fn inside(i: usize) -> [f64; 4] {
    let steps = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3];
    let [mut s, mut t, mut u] = steps.map(|step| (0.5 + step * i as f64).fract());
    if s + t > 1.0 {
        (s, t) = (1.0 - s, 1.0 - t);
    }
    if t + u > 1.0 {
        (t, u) = (1.0 - u, 1.0 - s - t);
    } else if s + t + u > 1.0 {
        (s, u) = (1.0 - t - u, s + t + u - 1.0);
    }
    [1.0 - s - t - u, s, t, u]
}

/// The transfer function for `field`, which `scalars` are in `mesh`, as `camera` sees it.
pub(super) fn transfer(
    mesh: &Mesh,
    tetrahedra: &Tetrahedra,
    scalars: &Scalars,
    field: &Field,
    camera: Camera,
    wishes: &Wishes,
) -> Result<TransferFunction> {
    let sample = Sample::new(mesh, tetrahedra, field, camera);
    let all = field.range(0);
    let (mut range, note) = match wishes.range {
        Some(range) => (range, "as asked for".to_owned()),
        None => {
            let shared = wishes.values.map(|values| (values, "the values of all time steps".to_owned()));
            let found = shared.or_else(|| super::range(mesh, tetrahedra, scalars));
            let (found, note) = found.unwrap_or_else(|| (all, "the values of the array".to_owned()));
            let positive = if wishes.logarithmic { sample.positive_range(found) } else { None };
            (positive.unwrap_or_else(|| widened(found)), note)
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
    let axis = if wishes.logarithmic { Axis::logarithmic(range)? } else { map.axis(range) };
    let color = match field.kind() {
        // Its colours are its own.
        Kind::Rgba => vec![(0.0, [1.0; 3])],
        Kind::Scalar | Kind::Pair => map.on(&axis),
    };
    // Of a pair, or of RGBA, another component drives the opacity.
    let opacity_axis = match field.kind() {
        Kind::Scalar => axis,
        Kind::Pair => {
            let [lo, hi] = field.range(1);
            Axis::linear(if hi > lo { [lo, hi] } else { [lo, lo + lo.abs().max(1.0)] })
        }
        Kind::Rgba => Axis::linear([0.0, field.range(3)[1].max(field.normal(0).half)]),
    };
    let unit = wishes.unit_distance.unwrap_or_else(|| rounded(sample.depth / UNITS));
    let said = match &wishes.opacity {
        Some(said) => Some(said.on(&opacity_axis, TOLERANCE_SAID)),
        None => map.opacity_on(&opacity_axis),
    };
    let mut opacity = match (&said, wishes.blend, field.kind()) {
        (Some(knots), _, _) => knots.clone(),
        (None, Blend::Composite, Kind::Scalar) if all[0] == all[1] => vec![(lo, 1.0), (hi, 1.0)],
        (None, Blend::Composite, Kind::Scalar) => {
            let bands = sample.bands(&axis);
            axis.knots(&bands, TOLERANCE * largest(&bands))
        }
        (None, Blend::Composite, Kind::Pair) if field.range(1)[0] == field.range(1)[1] => vec![(0.0, 1.0)],
        (None, _, _) => opacity_axis.knots(&[(0.0, 0.0), (1.0, 1.0)], TOLERANCE),
    };
    if said.is_none() && wishes.blend == Blend::Composite {
        let factor = sample.visible(&TransferFunction::new(color.clone(), opacity.clone(), unit)?);
        opacity.iter_mut().for_each(|k| k.1 = rounded(k.1 * factor));
    }
    let [lo, hi] = range;
    let how = if axis.is_logarithmic() { ", by logarithms" } else { "" };
    let name = &scalars.name;
    tracing::info!("drawing \"{name}\" from {lo} to {hi}{how} ({note}), unit distance {unit}");
    TransferFunction::new(color, opacity, unit)
}

/// The largest opacity of some knots.
pub(super) fn largest(knots: &[(f64, f64)]) -> f64 {
    knots.iter().fold(0.0, |most, k| k.1.max(most))
}

/// To three digits.
fn rounded(x: f64) -> f64 {
    format!("{x:.2e}").parse().unwrap_or(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Component;
    use crate::mesh::{Array, Values, generate};

    #[test]
    fn places_are_spread_over_a_tetrahedron() {
        let count = 4000;
        let mut sum = [0.0; 4];
        for i in 0..count {
            let w = inside(i);
            assert!(
                w.iter().all(|x| (-1e-12..=1.0 + 1e-12).contains(x)) && (w.iter().sum::<f64>() - 1.0).abs() < 1e-12
            );
            (0..4).for_each(|k| sum[k] += w[k] / count as f64);
        }
        assert!(sum.iter().all(|s| (s - 0.25).abs() < 5e-3), "{sum:?}");
    }

    /// Whatever values a mesh has, the mean ray is as opaque as it should be.
    #[test]
    fn pictures_are_visible() {
        let mesh = generate::demo(6);
        let tetrahedra = Tetrahedra::new(&mesh).unwrap();
        let size = [64, 48];
        let camera = super::super::camera(&mesh, &tetrahedra, None, size);
        let functions: [fn(DVec3) -> f64; 5] = [
            |p| p.x,
            |p| (20.0 * (p.x + p.y)).exp(),
            |_| 7.0,
            |p| if p.length() < 0.3 { 1e6 + p.z } else { 0.0 },
            |p| if p.x > 0.0 { f64::NAN } else { -p.y },
        ];
        for (i, f) in functions.into_iter().enumerate() {
            let values = Values::F64(mesh.points().iter().map(|&p| f(p)).collect());
            let array = Array { name: "f".into(), components: 1, values };
            let field = Field::from_array(&array, Association::Point, Component::Index(0)).unwrap();
            let scalars = Scalars {
                name: "f".into(),
                association: Some(Association::Point),
                component: Some(Component::Index(0)),
            };
            let wishes = Wishes::default();
            let transfer = transfer(&mesh, &tetrahedra, &scalars, &field, camera, &wishes).unwrap();
            let mut renderer = crate::render::Renderer::with_device(2, crate::gpu::DeviceChoice::Cpu).unwrap();
            renderer.set_tetrahedra(&mesh, tetrahedra.clone());
            renderer.set_field(&field).unwrap();
            renderer.set_transfer(&transfer);
            let image = renderer.render(&View::new(camera, size).unwrap(), &|_| ()).unwrap();
            let seen: Vec<f64> = image.pixels.iter().map(|p| f64::from(p[3])).filter(|a| *a > 0.0).collect();
            let mean = seen.iter().sum::<f64>() / seen.len() as f64;
            assert!((mean - OPACITY).abs() < 0.12, "{i}: {mean}");
        }
    }
}
