//! The reference for functions of two variables, and of light: formulas as scenes define them, integrated by halving.

use super::{COMPONENTS, Interval, Light, Reference};
use crate::field::{Association, Field, Kind};
use crate::transfer::bivariate::{Shape, Source, Widget};
use crate::transfer::shading::{Highlight, Origin, Shading};
use crate::transfer::{Bivariate, Convention, Emission, TransferFunction};
use glam::{DMat3, DVec3};
use std::collections::HashMap;

/// The extinction, per unit distance, of what is opaque.
const OPAQUE: f64 = 1e8;

/// Where something is on a ray: its components, by how much the first two rise over its interval, its place relative to the
/// mesh's middle, and the ray's direction.
struct Sample {
    s: f64,
    g: f64,
    rise: [f64; 2],
    vector: DVec3,
    place: DVec3,
    along: DVec3,
}

/// What a sample emits and absorbs per world unit: red, green, blue and extinction.
type Density = [f64; 4];

/// What a segment of `length` world units emits and absorbs, premultiplied RGBA, whose scalar and second variable, in
/// their own units, are linear from `front`, where the ray enters, to `back`. There is no gradient.
pub fn segment_of_two(transfer: &TransferFunction, front: [f64; 2], back: [f64; 2], length: f64) -> [f64; 4] {
    let (centre, kind) = (DVec3::ZERO, Kind::Scalar);
    let alone = Reference { transfer, kind, cells: vec![], boxes: None, centre, extent: 0.0, steepest: 0.0 };
    let interval = Interval { t: [0.0, length], values: [front, back].map(|[s, g]| [s, g, 0.0, 0.0, 0.0]) };
    alone.composite_two(std::iter::once(interval), DVec3::ZERO, DVec3::Z)
}

/// Second variable and gradient at each of `points`: of the field's own array and by brute force. None if the transfer
/// function asks for neither.
///
/// # Errors
/// What the field has not.
pub(super) fn variables(
    points: &[DVec3],
    corners: &[[u32; 4]],
    values: &[f64],
    second: Option<Vec<f64>>,
    field: &Field,
    transfer: &TransferFunction,
) -> Result<Option<Vec<[f64; 4]>>, String> {
    if transfer.is_of_one_variable() {
        return Ok(None);
    }
    if field.kind() != Kind::Scalar {
        return Err("functions of two variables and light are for fields of one component".into());
    }
    let widgets = transfer.bivariate().is_some_and(|b| matches!(b.source(), Source::Widgets(_)));
    if field.association() == Association::Cell {
        return match second {
            _ if transfer.shading().is_some() => Err("values of cells have no gradient".into()),
            None if !widgets => Err("values of cells have no gradient".into()),
            second => Ok(Some(
                values
                    .iter()
                    .enumerate()
                    .map(|(i, _)| [second.as_ref().map_or(0.0, |g| g[i]), 0.0, 0.0, 0.0])
                    .collect(),
            )),
        };
    }
    let key = |p: usize| {
        let [x, y, z] = (points[p] + 0.0).to_array().map(f64::to_bits);
        [x, y, z, (values[p] + 0.0).to_bits()]
    };
    let mut sums: HashMap<[u64; 4], (DVec3, f64)> = HashMap::new();
    for corners in corners {
        let at = corners.map(|p| p as usize);
        let edges = DMat3::from_cols(
            points[at[1]] - points[at[0]],
            points[at[2]] - points[at[0]],
            points[at[3]] - points[at[0]],
        );
        let rises = DVec3::from([1, 2, 3].map(|k| values[at[k]] - values[at[0]]));
        let volume = edges.determinant().abs();
        let gradient = edges.transpose().inverse() * rises;
        if volume > 0.0 && gradient.is_finite() {
            for p in at {
                let sum = sums.entry(key(p)).or_default();
                *sum = (sum.0 + gradient * volume, sum.1 + volume);
            }
        }
    }
    let variables = (0..points.len()).map(|p| {
        let mean = sums.get(&key(p)).map_or(DVec3::ZERO, |(sum, volume)| *sum / *volume);
        [second.as_ref().map_or(mean.length(), |g| g[p]), mean.x, mean.y, mean.z]
    });
    Ok(Some(variables.collect()))
}

/// Whether a widget's opacity varies where s and g rise by so much.
fn varies(widget: &Widget, rise: [f64; 2]) -> bool {
    match &widget.shape {
        Shape::Uniform => false,
        Shape::Gaussian { .. } => rise != [0.0; 2],
        Shape::Triangle(wave) | Shape::Sinusoid(wave, _) => wave.axis[0] * rise[0] + wave.axis[1] * rise[1] != 0.0,
    }
}

impl Reference<'_> {
    /// What the intervals of the ray from `origin` along `along` emit and absorb, premultiplied RGBA.
    pub(super) fn composite_two(
        &self,
        intervals: impl Iterator<Item = Interval>,
        origin: DVec3,
        along: DVec3,
    ) -> [f64; 4] {
        let mut light = Light { color: [0.0; 3], transmittance: 1.0 };
        for interval in intervals {
            let length = interval.t[1] - interval.t[0];
            let density = |u: f64| {
                let v: [f64; COMPONENTS] =
                    std::array::from_fn(|k| interval.values[0][k] * (1.0 - u) + interval.values[1][k] * u);
                let [s, g, x, y, z] = v;
                let place = origin + along * (interval.t[0] + length * u);
                let rise = [0, 1].map(|k| interval.values[1][k] - interval.values[0][k]);
                let sample = Sample { s, g, rise, vector: DVec3::new(x, y, z), place, along };
                self.density(&sample).map(|d| d * length)
            };
            for cut in self.cuts(&interval, origin, along).windows(2) {
                // Sides of steps belong to the piece.
                let [from, to] = [cut[0], cut[1]];
                let inside = |x: f64| density(from + (to - from) * x).map(|d| d * (to - from));
                add(&inside, [0.0, 1.0], panel(&inside, [0.0, 1.0]), 60, &mut light);
            }
        }
        let [r, g, b] = light.color;
        [r, g, b, 1.0 - light.transmittance]
    }

    fn density(&self, at: &Sample) -> Density {
        let transfer = self.transfer;
        let unit = transfer.unit_distance();
        let extinction = |a: f64| match transfer.convention() {
            Convention::Extinction => a / unit,
            Convention::Opacity if a >= 1.0 => OPAQUE / unit,
            Convention::Opacity => -(1.0 - a).ln() / unit,
        };
        let direct = match transfer.emission() {
            Emission::Chromatic => None,
            Emission::Direct { scale } => Some(scale),
        };
        // The source of light of a colour of 1, and the colours in it.
        let (mut emitted, mut white, mut tau) = (DVec3::ZERO, 0.0, 0.0);
        let mut shine = |color: DVec3, a: f64| {
            let source = direct.unwrap_or(extinction(a));
            emitted += color * source;
            white += source;
            tau += extinction(a);
        };
        match transfer.bivariate().map(Bivariate::source) {
            Some(Source::Widgets(widgets)) => {
                for widget in widgets.iter().filter(|w| w.holds([at.s, at.g])) {
                    let opacity = widget.height([at.s, at.g]);
                    // The peak that a ray passes over is solid in one place only: that adds nothing to an integral.
                    let most = if varies(widget, at.rise) { 1.0 - f64::EPSILON / 2.0 } else { 1.0 };
                    let is_peak = transfer.convention() == Convention::Opacity && opacity > most;
                    shine(widget.color.into(), if is_peak { most } else { opacity });
                }
            }
            Some(Source::Table(table)) => {
                let [r, g, b, a] = table.at([at.s, at.g]);
                shine(DVec3::new(r, g, b), a);
            }
            Some(Source::Scalar) | None => {
                shine(transfer.color_at(at.s).into(), transfer.opacity_at(at.s));
            }
        }
        let mut factor = transfer.bivariate().map_or(1.0, |b| b.factor(at.g));
        let length = at.vector.length();
        let normal = if length > 1e-12 * self.steepest { at.vector / length } else { DVec3::ZERO };
        if let Some(p) = transfer.shading().and_then(Shading::silhouette)
            && normal != DVec3::ZERO
        {
            factor *= (1.0 - normal.dot(at.along).abs().min(1.0)).powf(p);
        }
        if let Some(shading) = transfer.shading() {
            emitted = self.lit(shading, at, normal, emitted, white);
        }
        let emitted = if direct.is_some() { emitted } else { emitted * factor };
        [emitted.x, emitted.y, emitted.z, tau * factor]
    }

    /// The light that comes back of the colours `emitted`, whose white would be `white`.
    fn lit(&self, shading: &Shading, at: &Sample, normal: DVec3, emitted: DVec3, white: f64) -> DVec3 {
        let Some(shade) = shading.shade() else { return emitted };
        let side = |x: f64| if shade.two_sided { x.abs() } else { x.max(0.0) };
        let (mut diffuse, mut specular) = (DVec3::ZERO, DVec3::ZERO);
        for light in shading.lights() {
            let to = match light.origin {
                Origin::Headlight => -at.along,
                Origin::Direction(d) => -d.normalize(),
                Origin::Position(p) => (p - self.centre - at.place).normalize_or_zero(),
            };
            let falls = side(normal.dot(to));
            if falls > 0.0 {
                let mut intensity = DVec3::from(light.color) * light.intensity;
                if let Origin::Position(p) = light.origin {
                    let delta = (p - self.centre - at.place).length();
                    let [a, b, c] = light.attenuation;
                    intensity /= a + b * delta + c * delta * delta;
                    if let Some(cone) = &light.cone {
                        let cosine = -to.dot(cone.axis) / cone.axis.length();
                        let inside = cosine.acos() <= cone.angle.to_radians();
                        intensity *= if inside { cosine.max(0.0).powf(cone.exponent) } else { 0.0 };
                    }
                }
                diffuse += intensity * falls;
                let shines = match shade.highlight {
                    Highlight::Half => side(normal.dot((to - at.along).normalize_or_zero())),
                    Highlight::Reflected => (2.0 * normal.dot(to) * normal - to).dot(-at.along).max(0.0),
                };
                if shines > 0.0 || shade.highlight == Highlight::Reflected {
                    specular += intensity * shines.powf(shade.power);
                }
            }
        }
        emitted * (shade.ambient + shade.diffuse * diffuse) + shade.specular * specular * white
    }

    /// Where between 0 and 1 the interval's function may turn or jump.
    fn cuts(&self, interval: &Interval, origin: DVec3, along: DVec3) -> Vec<f64> {
        let mut cuts = vec![0.0, 1.0];
        for light in self.transfer.shading().map(Shading::lights).unwrap_or_default() {
            let (Origin::Position(p), Some(cone)) = (light.origin, light.cone) else { continue };
            let is_inside = |u: f64| {
                let t = interval.t[0] + (interval.t[1] - interval.t[0]) * u;
                (origin + along * t + self.centre - p).angle_between(cone.axis) <= cone.angle.to_radians()
            };
            for k in 0..256 {
                let [mut a, mut b] = [k, k + 1].map(|k| f64::from(k) / 256.0);
                let first = is_inside(a);
                if is_inside(b) != first {
                    for _ in 0..60 {
                        let middle = f64::midpoint(a, b);
                        if is_inside(middle) == first { a = middle } else { b = middle }
                    }
                    cuts.push(b);
                }
            }
        }
        // Where a linear function has a value.
        let mut cut = |ends: [f64; 2], value: f64| {
            let u = (value - ends[0]) / (ends[1] - ends[0]);
            if u > 0.0 && u < 1.0 {
                cuts.push(u);
            }
        };
        let [s, g] = [0, 1].map(|k| interval.values.map(|v| v[k]));
        let bivariate = self.transfer.bivariate();
        match bivariate.map(Bivariate::source) {
            Some(Source::Widgets(widgets)) => {
                for widget in widgets {
                    if let Shape::Triangle(wave) | Shape::Sinusoid(wave, _) = &widget.shape {
                        // Waves turn at halves of their phase; peaks may begin and end anywhere.
                        let per_phase = if wave.floor > 0.0 { 64.0 } else { 2.0 };
                        let ends = [0, 1].map(|end| per_phase * wave.phase([s[end], g[end]]));
                        let [lo, hi] = [ends[0].min(ends[1]).ceil(), ends[0].max(ends[1]).floor()];
                        (0..=(hi - lo).clamp(-1.0, 1e5) as i64).for_each(|i| cut(ends, lo + i as f64));
                    }
                }
                for widget in widgets {
                    let Shape::Gaussian { center, sigma } = widget.shape else { continue };
                    // Sums of eight could pass by a narrow one.
                    let ends = [(s, 0), (g, 1)].map(|(ends, k)| ends.map(|x| (x - center[k]) / sigma[k]));
                    let rise = ends.map(|[from, to]| to - from);
                    let square = rise[0] * rise[0] + rise[1] * rise[1];
                    let nearest = -(ends[0][0] * rise[0] + ends[1][0] * rise[1]) / square;
                    for away in [-8.0, -4.0, -2.0, 0.0, 2.0, 4.0, 8.0] {
                        let u = nearest + away / square.sqrt();
                        cut([-u, 1.0 - u], 0.0);
                    }
                }
                for Widget { domain, .. } in widgets {
                    domain[0].iter().for_each(|&x| cut(s, x));
                    domain[1].iter().for_each(|&x| cut(g, x));
                }
            }
            Some(Source::Table(table)) => {
                let places = [0, 1].map(|end| table.place([s[end], g[end]]));
                let [first, last] = places;
                for ((from, to), n) in first.into_iter().zip(last).zip(table.size()) {
                    (0..n).for_each(|i| cut([from, to], i as f64));
                }
            }
            Some(Source::Scalar) | None => {
                self.transfer.color().iter().for_each(|k| cut(s, k.0));
                self.transfer.opacity().iter().for_each(|k| cut(s, k.0));
            }
        }
        bivariate.and_then(Bivariate::gradient_opacity).unwrap_or_default().iter().for_each(|k| cut(g, k.0));
        cuts.sort_by(f64::total_cmp);
        cuts.dedup_by(|a, b| *a - *b < 1e-12);
        cuts
    }
}

/// Adds what `f` gives over `[a, b]`, of which `whole` is the estimate, by halves until two halves agree with the whole.
fn add(f: &impl Fn(f64) -> Density, [a, b]: [f64; 2], whole: [f64; 4], halvings: u32, light: &mut Light) {
    if light.transmittance < 1e-20 {
        light.transmittance = 0.0;
        return;
    }
    let middle = (a + b) / 2.0;
    let (front, back) = (panel(f, [a, middle]), panel(f, [middle, b]));
    let seen = (-front[3]).exp();
    let joined: [f64; 4] = std::array::from_fn(|k| front[k] + if k < 3 { seen * back[k] } else { back[k] });
    let open = |k: usize| !matches!((joined[k] - whole[k]).abs().partial_cmp(&1e-12), Some(o) if o.is_le());
    // Of great depths nothing is seen, however it is summed up.
    let deep = joined[3] > 60.0 && whole[3] > 60.0;
    if halvings == 0 || !(open(0) || open(1) || open(2) || (open(3) && !deep) || joined[3] > 4.0) {
        for (color, sum) in light.color.iter_mut().zip(joined) {
            *color += light.transmittance * sum;
        }
        light.transmittance *= (-joined[3]).exp();
        return;
    }
    add(f, [a, middle], front, halvings - 1, light);
    add(f, [middle, b], back, halvings - 1, light);
}

/// What `f` emits, dimmed by what is before it, and its depth, over `[a, b]`: sums of eight, with depths of eight each.
fn panel(f: &impl Fn(f64) -> Density, [a, b]: [f64; 2]) -> [f64; 4] {
    let depth = |x: f64| super::gauss(|y| [f(y)[3], 0.0, 0.0], a, x)[0];
    let emitted = super::gauss(
        |x| {
            let [r, g, b, _] = f(x);
            let seen = (-depth(x)).exp();
            [r * seen, g * seen, b * seen]
        },
        a,
        b,
    );
    [emitted[0], emitted[1], emitted[2], depth(b)]
}
