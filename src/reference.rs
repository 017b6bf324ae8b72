//! The reference: a slow renderer in f64 that shares no code with the engines, so that no bug can hide in both.
//!
//! It tests every tetrahedron (or, of a grid, every voxel: `grid`) against every ray, sorts the intervals by entry, and integrates each piece between two
//! knots numerically: ∫ c τ exp(−∫τ) by Gauss–Legendre with halving, to about 1e-10.

mod grid;
mod second;

pub use grid::render_grid;
pub use second::segment_of_two;

use crate::error::{Error, Result};
use crate::field::{Association, Field, Kind};
use crate::image::Image;
use crate::mesh::{Mesh, cells::Tetrahedra};
use crate::transfer::{Convention, Emission, OPAQUE, TransferFunction};
use crate::view::{Blend, Ray, View};
use glam::DVec3;
use rayon::prelude::*;

/// Draws `view`, as [`Reference::render`] does, in f32.
///
/// # Errors
/// As [`Reference::new`].
pub fn render(
    mesh: &Mesh,
    tetrahedra: &Tetrahedra,
    field: &Field,
    transfer: &TransferFunction,
    view: &View,
) -> Result<Image> {
    let pixels = Reference::new(mesh, tetrahedra, field, transfer)?.render(view);
    Ok(Image { size: view.size(), pixels: pixels.iter().map(|p| p.map(|v| v as f32)).collect() })
}

/// A scene that single rays can be asked of.
#[derive(Debug)]
pub struct Reference<'a> {
    transfer: &'a TransferFunction,
    kind: Kind,
    cells: Vec<Tetrahedron>,
    /// The voxels of a grid, in place of cells.
    boxes: Option<grid::Boxes>,
    /// Middle of the bounds, which coordinates are relative to, and half their diagonal.
    centre: DVec3,
    extent: f64,
    /// The greatest length of a gradient.
    steepest: f64,
}

/// Components of a sample: those of the field; or the scalar, the second variable and the gradient.
const COMPONENTS: usize = 5;

/// What a segment of `length` world units emits and absorbs, premultiplied RGBA, whose field of one component, in the
/// array's own units, is linear from `front`, where the ray enters, to `back`.
pub fn segment(transfer: &TransferFunction, front: f64, back: f64, length: f64) -> [f64; 4] {
    let alone = Reference {
        transfer,
        kind: Kind::Scalar,
        cells: vec![],
        boxes: None,
        centre: DVec3::ZERO,
        extent: 0.0,
        steepest: 0.0,
    };
    let interval = Interval { t: [0.0, length], values: [front, back].map(|s| [s, 0.0, 0.0, 0.0, 0.0]) };
    alone.composite(std::iter::once(interval))
}

/// One visible tetrahedron.
#[derive(Debug)]
struct Tetrahedron {
    corners: [DVec3; 4],
    /// The field's components at each corner, in the array's own units.
    values: [[f64; COMPONENTS]; 4],
    /// A sphere around it.
    centre: DVec3,
    radius: f64,
}

/// The part of a ray inside one tetrahedron.
struct Interval {
    t: [f64; 2],
    /// The field's components at both ends.
    values: [[f64; COMPONENTS]; 2],
}

/// What a ray has gathered: emitted light and transmittance.
struct Light {
    color: [f64; 3],
    transmittance: f64,
}

impl<'a> Reference<'a> {
    /// Prepares a scene. Tetrahedra that touch a position or value that is not finite are invisible.
    ///
    /// # Errors
    /// [`Error::Field`] if the field does not fit the mesh, [`Error::Mesh`] if the tetrahedra do not.
    pub fn new(mesh: &Mesh, tetrahedra: &Tetrahedra, field: &Field, transfer: &'a TransferFunction) -> Result<Self> {
        let (points, n) = (mesh.points(), field.kind().components());
        let count = if field.association() == Association::Point { points.len() } else { mesh.cells().len() };
        let of_mesh = field.values();
        if of_mesh.len() != count * n {
            return Err(Error::Field(format!("the field has {} values for {count} tuples", of_mesh.len())));
        }
        // What the split adds is part of what is given.
        let (points, values) = (
            tetrahedra.points(points),
            match field.association() {
                Association::Point => tetrahedra.values(of_mesh, n),
                Association::Cell => of_mesh,
            },
        );
        let second = field.second().map(|f| match f.association() {
            Association::Point => tetrahedra.values(f.values(), 1).into_owned(),
            Association::Cell => f.values().into_owned(),
        });
        let variables = second::variables(&points, &tetrahedra.corners, &values, second, field, transfer);
        let variables = variables.map_err(Error::Field)?;
        let lengths = variables.iter().flatten().map(|[_, x, y, z]| DVec3::new(*x, *y, *z).length());
        let steepest = lengths.fold(0.0, f64::max);
        let used = || tetrahedra.corners.iter().flatten().filter_map(|&p| points.get(p as usize));
        let finite = || used().filter(|p| p.is_finite());
        let (lo, hi) = finite().fold((DVec3::MAX, DVec3::MIN), |(lo, hi), p| (lo.min(*p), hi.max(*p)));
        let (middle, extent) = (lo / 2.0 + hi / 2.0, (hi / 2.0 - lo / 2.0).length());
        let mut cells = Vec::new();
        for (i, corners) in tetrahedra.corners.iter().enumerate() {
            let cell = tetrahedra.cell.as_ref().map_or(Some(i), |of| of.get(i).map(|&c| c as usize));
            let tuple =
                |corner: u32| if field.association() == Association::Point { Some(corner as usize) } else { cell };
            let value = |corner: u32| {
                let start = tuple(corner)? * n;
                let values = values.get(start..start + n)?;
                let full = if field.kind() == Kind::Rgba { field.normal(0).half } else { 1.0 };
                let at = |k: usize| values.get(k).map_or(0.0, |&v| if k < 3 { v / full } else { v });
                if let Some(variables) = &variables {
                    let [g, x, y, z] = *variables.get(start)?;
                    return Some([at(0), g, x, y, z]);
                }
                Some([at(0), at(1), at(2), at(3), 0.0])
            };
            let mut tet = Tetrahedron {
                corners: [DVec3::ZERO; 4],
                values: [[0.0; COMPONENTS]; 4],
                centre: DVec3::ZERO,
                radius: 0.0,
            };
            for (k, &c) in corners.iter().enumerate() {
                let (Some(point), Some(values)) = (points.get(c as usize), value(c)) else {
                    return Err(Error::Mesh(format!("tetrahedron {i} names a point or cell that does not exist")));
                };
                (tet.corners[k], tet.values[k]) = (*point - middle, values);
            }
            tet.centre = tet.corners.iter().sum::<DVec3>() / 4.0;
            // A little larger, for rounding and for rays that are moved off an edge.
            let farthest = tet.corners.iter().fold(0.0, |r: f64, p| r.max(p.distance(tet.centre)));
            tet.radius = farthest * (1.0 + 1e-9) + 1e-9 * extent;
            if tet.values.as_flattened().iter().all(|v| v.is_finite()) && tet.corners.iter().all(|p| p.is_finite()) {
                cells.push(tet);
            }
        }
        Ok(Reference { transfer, kind: field.kind(), cells, boxes: None, centre: middle, extent, steepest })
    }

    /// Premultiplied RGBA of every pixel, row by row from the top. Runs on the current rayon pool.
    pub fn render(&self, view: &View) -> Vec<[f64; 4]> {
        let [w, h] = view.size().map(u64::from);
        let pixel = |i: u64| self.ray(&view.ray((i % w) as u32, (i / w) as u32), view.blend());
        (0..w * h).into_par_iter().map(pixel).collect()
    }

    /// Premultiplied RGBA of one ray.
    pub fn ray(&self, ray: &Ray, blend: Blend) -> [f64; 4] {
        let origin = ray.origin - self.centre;
        // t counts from the point nearest to the middle: far cameras then lose no digits.
        let shift = -origin.dot(ray.direction);
        let origin = origin + ray.direction * shift;
        let aside = DVec3::new(0.86, -0.19, 0.47) * (self.extent * 1e-11);
        let tries = (0..8).map(|n| self.intervals(origin + aside * f64::from((1 << n) - 1), ray.direction));
        // A ray that lies in a face or an edge belongs to no cell, or to several: it is moved off.
        let mut intervals = match &self.boxes {
            Some(boxes) => boxes.intervals(origin, ray.direction),
            None => tries.flatten().next().unwrap_or_default(),
        };
        intervals.sort_by(|a, b| a.t[0].total_cmp(&b.t[0]).then(a.t[1].total_cmp(&b.t[1])));
        let [start, end] = [ray.t_min - shift, ray.t_max - shift];
        let visible = intervals.iter().filter_map(|i| i.clip(start, end));
        match blend {
            Blend::Composite if !self.transfer.is_of_one_variable() => {
                self.composite_two(visible, origin, ray.direction)
            }
            Blend::Composite => self.composite(visible),
            Blend::Maximum => self.maximum(visible),
        }
    }

    /// The ray's intervals in all cells; none if it lies in a face.
    fn intervals(&self, origin: DVec3, direction: DVec3) -> Option<Vec<Interval>> {
        let mut found = Vec::new();
        for tet in &self.cells {
            let offset = tet.centre - origin;
            let squared = offset.length_squared() - offset.dot(direction).powi(2);
            if squared <= tet.radius * tet.radius + 1e-14 * offset.length_squared() {
                found.extend(tet.interval(origin, direction, self.extent)?);
            }
        }
        Some(found)
    }

    fn composite(&self, intervals: impl Iterator<Item = Interval>) -> [f64; 4] {
        let mut light = Light { color: [0.0; 3], transmittance: 1.0 };
        for interval in intervals {
            for [u0, u1] in self.pieces(&interval) {
                if light.transmittance > 0.0 {
                    light.add(&self.piece(&interval, u0, u1), self.transfer);
                }
            }
        }
        let [r, g, b] = light.color;
        [r, g, b, 1.0 - light.transmittance]
    }

    /// The colour and opacity of the largest value of the last component; of equal ones, the first.
    fn maximum(&self, intervals: impl Iterator<Item = Interval>) -> [f64; 4] {
        let last = self.kind.components() - 1;
        let ends = intervals.flat_map(|i| i.values);
        let largest = ends.reduce(|best, v| if v[last] > best[last] { v } else { best });
        largest.map_or([0.0; 4], |v| {
            let ([r, g, b], a) = (self.color(&v), self.transfer.opacity_at(v[last]).min(1.0));
            [r * a, g * a, b * a, a]
        })
    }

    fn color(&self, values: &[f64; COMPONENTS]) -> [f64; 3] {
        match self.kind {
            Kind::Rgba => [values[0], values[1], values[2]],
            _ => self.transfer.color_at(values[0]),
        }
    }

    /// Splits the interval, as [0, 1], where a value crosses a knot or the opacity becomes opaque.
    fn pieces(&self, interval: &Interval) -> Vec<[f64; 2]> {
        let last = self.kind.components() - 1;
        let mut cuts = vec![0.0, 1.0];
        let mut cut = |k: usize, s: f64| {
            let u = (s - interval.values[0][k]) / (interval.values[1][k] - interval.values[0][k]);
            if u > 0.0 && u < 1.0 {
                cuts.push(u);
            }
        };
        if self.kind != Kind::Rgba {
            self.transfer.color().iter().for_each(|k| cut(0, k.0));
        }
        let knots = self.transfer.opacity();
        knots.iter().for_each(|k| cut(last, k.0));
        if self.transfer.convention() == Convention::Opacity {
            for k in knots.windows(2).filter(|k| (k[0].1 - 1.0) * (k[1].1 - 1.0) < 0.0) {
                cut(last, k[0].0 + (k[1].0 - k[0].0) * ((1.0 - k[0].1) / (k[1].1 - k[0].1)));
            }
        }
        cuts.sort_by(f64::total_cmp);
        // What is shorter is rounding, and might take a peak that touches 1 for a plateau.
        cuts.windows(2).map(|c| [c[0], c[1]]).filter(|c| c[1] - c[0] > 1e-12).collect()
    }

    /// Colour and opacity at the ends of a piece, as its inside has them: at a step the ends belong to either side.
    fn piece(&self, interval: &Interval, u0: f64, u1: f64) -> Piece {
        let last = self.kind.components() - 1;
        let at = |x: f64| {
            let u = u0 + (u1 - u0) * x;
            let v: [f64; COMPONENTS] =
                std::array::from_fn(|k| interval.values[0][k] * (1.0 - u) + interval.values[1][k] * u);
            let [r, g, b] = self.color(&v);
            [r, g, b, self.transfer.opacity_at(v[last])]
        };
        let [p, q] = [at(0.25), at(0.75)];
        let ends = [0.0, 1.0].map(|x| std::array::from_fn(|k| (p[k] + (q[k] - p[k]) * (2.0 * x - 0.5)).max(0.0)));
        Piece { length: (u1 - u0) * (interval.t[1] - interval.t[0]), ends }
    }
}

impl Interval {
    /// The part from `start` to `end`; none if it is empty.
    fn clip(&self, start: f64, end: f64) -> Option<Interval> {
        let [t0, t1] = self.t;
        let at = |t: f64| {
            let u = (t - t0) / (t1 - t0);
            std::array::from_fn(|k| self.values[0][k] * (1.0 - u) + self.values[1][k] * u)
        };
        let t = [t0.max(start), t1.min(end)];
        (t[1] > t[0]).then(|| Interval { t, values: t.map(at) })
    }
}

/// Heights of a tetrahedron, relative to the mesh, that are nothing but rounding.
const FLAT: f64 = 2e-15;

impl Tetrahedron {
    /// Where the ray is inside. Outer none: it lies in a face; inner none: it misses.
    fn interval(&self, origin: DVec3, direction: DVec3, extent: f64) -> Option<Option<Interval>> {
        let mut t = [f64::NEG_INFINITY, f64::INFINITY];
        // The corners opposite to the faces that the ray passes: their values do not count there.
        let mut opposite = [4, 4];
        let mut faces = [(DVec3::ZERO, DVec3::ZERO); 4];
        let mut lies = false;
        for (k, weight) in faces.iter_mut().enumerate() {
            // In the order of their positions, so that both cells of a face compute the same bits.
            let mut face = [1, 2, 3].map(|j| self.corners[(k + j) % 4]);
            face.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z)));
            let normal = (face[1] - face[0]).cross(face[2] - face[0]).normalize_or_zero();
            let side = normal.dot(self.corners[k] - face[0]);
            // What is as flat as coordinates are rounded has no inside that could be told.
            if side.abs() <= FLAT * extent {
                return Some(None);
            }
            let (height, slope) = (normal.dot(face[0] - origin), normal.dot(direction));
            *weight = (face[0], normal / side);
            if height.abs() <= 1e-12 * extent && slope.abs() <= 1e-10 {
                // Rounding would place the crossing: the other faces tell whether the ray meets this one.
                lies = true;
            } else if slope == 0.0 {
                if (height > 0.0) == (side > 0.0) {
                    return Some(None);
                }
            } else {
                let (end, at) = (usize::from((slope > 0.0) != (side > 0.0)), height / slope);
                if (end == 0 && at > t[0]) || (end == 1 && at < t[1]) {
                    (t[end], opposite[end]) = (at, k);
                }
            }
        }
        if t[1] <= t[0] {
            return Some(None);
        }
        let values = [0, 1].map(|end| {
            let mut weights = faces.map(|(p, n)| n.dot(origin + direction * t[end] - p).clamp(0.0, 1.0));
            if let Some(weight) = weights.get_mut(opposite[end]) {
                *weight = 0.0;
            }
            let sum: f64 = weights.iter().sum();
            std::array::from_fn(|c| (0..4).map(|k| weights[k] / sum * self.values[k][c]).sum())
        });
        (!lies).then_some(Some(Interval { t, values }))
    }
}

/// A piece of a ray in which colour and opacity are linear.
struct Piece {
    length: f64,
    /// Red, green, blue and opacity at its ends.
    ends: [[f64; 4]; 2],
}

impl Piece {
    fn at(&self, x: f64) -> [f64; 4] {
        std::array::from_fn(|k| self.ends[0][k] * (1.0 - x) + self.ends[1][k] * x)
    }
}

impl Light {
    fn add(&mut self, piece: &Piece, transfer: &TransferFunction) {
        let (scale, direct) = match transfer.emission() {
            Emission::Chromatic => (1.0, false),
            Emission::Direct { scale } => (scale, true),
        };
        let [a0, a1] = [piece.ends[0][3], piece.ends[1][3]];
        // Beyond this nothing is seen of a depth, and 0 times it stays 0.
        let per_unit = (piece.length / transfer.unit_distance()).min(1e25);
        let logarithmic = transfer.convention() == Convention::Opacity;
        // Pieces end where the opacity passes 1, so its mean tells on which side they are; their ends are off by
        // rounding.
        if logarithmic && (a0 + a1 >= 2.0 || (a0 == a1 && a0 >= OPAQUE)) {
            for k in 0..3 {
                self.color[k] += if direct { 0.0 } else { self.transmittance * piece.ends[0][k] };
            }
            self.transmittance = 0.0;
            return;
        }
        // Not `transfer.extinction`, which is infinite from OPAQUE on: −ln(1 − a) is integrable up to a = 1.
        let extinction = |a: f64| if logarithmic { -(1.0 - a).max(1e-300).ln() } else { a } * per_unit;
        let depth = |x: f64| {
            let a = a0 + (a1 - a0) * x;
            if !logarithmic {
                return (a0 + a) / 2.0 * x * per_unit;
            }
            let (y0, y) = ((1.0 - a0).max(1e-300), (1.0 - a).max(1e-300));
            if (y - y0).abs() < 1e-3 * y.min(y0) {
                return gauss(|z| [extinction(a0 + (a - a0) * z); 3], 0.0, 1.0)[0] * x;
            }
            // The integral of −ln y is y − y ln y.
            ((y - y * y.ln()) - (y0 - y0 * y0.ln())) / (y - y0) * x * per_unit
        };
        // Beyond depth 50 nothing is seen, and a quadrature over what is not seen would miss what is.
        let (mut seen, mut unseen) = (1.0, 0.0);
        if depth(1.0) > 50.0 {
            for _ in 0..100 {
                let middle = (seen + unseen) / 2.0;
                *if depth(middle) > 50.0 { &mut seen } else { &mut unseen } = middle;
            }
        }
        let emission = |x: f64| {
            let [r, g, b, a] = piece.at(x);
            let density = if direct { scale * piece.length } else { extinction(a) } * (-depth(x)).exp();
            [r * density, g * density, b * density]
        };
        let sum = adaptive(&emission, 0.0, seen, gauss(emission, 0.0, seen), 60);
        for (color, sum) in self.color.iter_mut().zip(sum) {
            *color += self.transmittance * sum;
        }
        self.transmittance *= (-depth(1.0)).exp();
        if self.transmittance < 1e-20 {
            self.transmittance = 0.0;
        }
    }
}

/// ∫ f over [a, b], of which `whole` is the estimate: halves until two halves agree with the whole.
fn adaptive(f: &impl Fn(f64) -> [f64; 3], a: f64, b: f64, whole: [f64; 3], halvings: u32) -> [f64; 3] {
    let middle = (a + b) / 2.0;
    let (left, right) = (gauss(f, a, middle), gauss(f, middle, b));
    let sum: [f64; 3] = std::array::from_fn(|k| left[k] + right[k]);
    // What is NaN never agrees.
    let open = (0..3).any(|k| (sum[k] - whole[k]).abs() > 1e-13);
    if halvings == 0 || !open {
        return sum;
    }
    let (left, right) = (adaptive(f, a, middle, left, halvings - 1), adaptive(f, middle, b, right, halvings - 1));
    std::array::from_fn(|k| left[k] + right[k])
}

/// ∫ f over [a, b] by eight-point Gauss–Legendre (Abramowitz & Stegun, table 25.4).
fn gauss(f: impl Fn(f64) -> [f64; 3], a: f64, b: f64) -> [f64; 3] {
    const NODES: [[f64; 2]; 4] = [
        [0.183_434_642_495_649_8, 0.362_683_783_378_362],
        [0.525_532_409_916_329, 0.313_706_645_877_887_3],
        [0.796_666_477_413_626_7, 0.222_381_034_453_374_48],
        [0.960_289_856_497_536_3, 0.101_228_536_290_376_26],
    ];
    let (middle, half) = ((a + b) / 2.0, (b - a) / 2.0);
    let mut sum = [0.0; 3];
    for [x, weight] in NODES {
        let (left, right) = (f(middle - half * x), f(middle + half * x));
        sum = std::array::from_fn(|k| sum[k] + half * weight * (left[k] + right[k]));
    }
    sum
}
