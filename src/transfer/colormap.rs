//! Colour maps: those with a name, and ParaView's presets from a file.

use super::space::Space;
use crate::error::{Error, Result};
use serde::Deserialize;
use std::path::Path;

/// A colour map over [0, 1], piecewise linear in RGB; two points at one place are a step.
#[derive(Debug, Clone, PartialEq)]
pub struct ColorMap {
    points: Vec<(f64, [f64; 3])>,
    opacity: Option<Vec<(f64, f64)>>,
    /// Whether places are of the values' logarithms.
    log: bool,
}

/// The names that [`ColorMap::named`] knows.
pub const NAMES: [&str; 4] = ["viridis", "inferno", "cool to warm", "grey"];

/// How far a resampled preset may be from the original, in a component of RGB or in opacity.
const TOLERANCE: f64 = 1e-4;

/// How far a named map may be: below what 8 bits show, because every point costs time inside every cell that it is in.
const TOLERANCE_NAMED: f64 = 1.0 / 255.0;

impl ColorMap {
    /// One of [`NAMES`]; case, and whether words are joined by spaces, `-` or `_`, do not matter.
    ///
    /// # Errors
    /// [`Error::Transfer`], with the names that exist.
    pub fn named(name: &str) -> Result<Self> {
        let table = |t: &[[f64; 4]]| t.iter().map(|&[s, r, g, b]| (s / 255.0, [r, g, b])).collect::<Vec<_>>();
        let points = match name.to_lowercase().replace(['-', '_'], " ").as_str() {
            "viridis" => table(&VIRIDIS),
            "inferno" => table(&INFERNO),
            "cool to warm" | "coolwarm" => resample(0.0, 1.0, TOLERANCE_NAMED, &|u| {
                Space::Diverging.mix([0.231373, 0.298039, 0.752941], [0.705882, 0.0156863, 0.14902], u)
            }),
            "grey" | "gray" | "grayscale" | "greyscale" => vec![(0.0, [0.0; 3]), (1.0, [1.0; 3])],
            _ => {
                let names = NAMES.join("\", \"");
                return Err(Error::Transfer(format!("no colour map is called \"{name}\"; there are \"{names}\"")));
            }
        };
        Ok(ColorMap { points, opacity: None, log: false })
    }

    /// Reads a preset that ParaView saved (.json): the one called `preset`, or the first in the file.
    ///
    /// # Errors
    /// [`Error::File`], [`Error::Malformed`], or [`Error::Unsupported`] for a categorical map or an unknown colour
    /// space.
    pub fn open(path: &Path, preset: Option<&str>) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::file(path, e))?;
        let malformed = |what: String| Error::malformed(path, what);
        let json: serde_json::Value = serde_json::from_str(&text).map_err(|e| malformed(e.to_string()))?;
        let list = match json {
            serde_json::Value::Array(list) => list,
            one => vec![one],
        };
        let name = |v: &serde_json::Value| v["Name"].as_str().unwrap_or("").to_owned();
        let Some(chosen) = list.iter().find(|v| preset.is_none_or(|p| name(v) == p)) else {
            let names = list.iter().map(|v| format!("\"{}\"", name(v))).collect::<Vec<_>>();
            return Err(malformed(match preset {
                Some(p) => format!("no preset is called \"{p}\"; there are {}", names.join(", ")),
                None => "there is no preset in it".into(),
            }));
        };
        let what = format!("preset \"{}\"", name(chosen));
        let file = Preset::deserialize(chosen).map_err(|e| malformed(format!("{what}: {e}")))?;
        if file.rgb_points.is_empty() && file.indexed_colors.is_some() {
            return Err(Error::unsupported(path, format!("{what} is categorical (IndexedColors), not a colour map")));
        }
        let space = match file.color_space.as_deref().unwrap_or("RGB") {
            "RGB" => Space::Rgb,
            // ParaView's default, unlike VTK's, is not to.
            "HSV" => Space::Hsv { wrap: file.hsv_wrap.is_some_and(Flag::is_set) },
            "Lab" => Space::Lab,
            "Diverging" => Space::Diverging,
            "Step" => Space::Step,
            other => {
                let what =
                    format!("{what} has the colour space \"{other}\"; save it as RGB, HSV, Lab, Diverging or Step");
                return Err(Error::unsupported(path, what));
            }
        };
        for (name, value) in chosen.as_object().into_iter().flatten() {
            if !KNOWN.contains(&name.as_str()) && !is_unset(value) {
                tracing::warn!("{}: {what} says {name}: {value}, which Halite does not do", path.display());
            }
        }
        let log = file.use_log_scale.is_some_and(Flag::is_set);
        let colors = tuples::<3>(&file.rgb_points, log).map_err(|e| malformed(format!("{what}: RGBPoints {e}")))?;
        let opacity = file
            .points
            .map(|p| tuples::<3>(&p, log).map_err(|e| malformed(format!("{what}: Points {e}"))))
            .transpose()?
            .map(|p| opacity_points(&p));
        Ok(ColorMap { points: color_points(&colors, space), opacity, log })
    }

    /// The points `(place in [0, 1], [r, g, b])`, ascending.
    pub fn points(&self) -> &[(f64, [f64; 3])] {
        &self.points
    }

    /// The knots of a colour function that has this map over the range from `lo` to `hi`; of a map over logarithms, if
    /// both are above 0, and else, with a warning, over the values.
    pub fn over(&self, range: [f64; 2]) -> Vec<(f64, [f64; 3])> {
        if self.log && range[0] <= 0.0 {
            let [lo, hi] = range;
            tracing::warn!(
                "the colour map is for logarithms, which values from {lo} to {hi} have none of: it is linear"
            );
        }
        self.spread(&self.points, range)
    }

    /// `points` over a range.
    fn spread<const N: usize>(&self, points: &[(f64, [f64; N])], [lo, hi]: [f64; 2]) -> Vec<(f64, [f64; N])> {
        let place = |x: f64| lo + (hi - lo) * x;
        if !self.log || lo <= 0.0 || lo >= hi {
            return points.iter().map(|&(x, c)| (place(x), c)).collect();
        }
        let ratio = (hi / lo).ln();
        let place = |x: f64| if x == 1.0 { hi } else { lo * (ratio * x).exp() };
        let mut knots: Vec<_> = points.first().map(|&(x, c)| (place(x), c)).into_iter().collect();
        for w in points.windows(2) {
            let ((x0, a), (x1, b)) = (w[0], w[1]);
            let (s0, s1) = (place(x0), place(x1));
            if x1 <= x0 {
                knots.push((s1, b));
                continue;
            }
            let at = |u: f64| {
                let v = (((s0 + (s1 - s0) * u) / s0).ln() / (s1 / s0).ln()).clamp(0.0, 1.0);
                std::array::from_fn(|k| a[k] + (b[k] - a[k]) * v)
            };
            knots.extend(resample(s0, s1, TOLERANCE, &at));
        }
        knots.dedup();
        knots
    }

    /// The knots of the opacity function that came with a preset, over the range from `lo` to `hi`.
    pub fn opacity_over(&self, range: [f64; 2]) -> Option<Vec<(f64, f64)>> {
        let points: Vec<_> = self.opacity.as_ref()?.iter().map(|&(x, a)| (x, [a])).collect();
        Some(self.spread(&points, range).into_iter().map(|(s, [a])| (s, a)).collect())
    }
}

/// What Halite uses of a preset; ParaView writes more.
#[derive(Deserialize)]
#[serde(rename_all = "PascalCase")]
struct Preset {
    #[serde(default, rename = "RGBPoints")]
    rgb_points: Vec<f64>,
    color_space: Option<String>,
    points: Option<Vec<f64>>,
    indexed_colors: Option<serde::de::IgnoredAny>,
    #[serde(rename = "HSVWrap")]
    hsv_wrap: Option<Flag>,
    use_log_scale: Option<Flag>,
}

/// What a preset may say that Halite does, or that changes no picture of values that are finite.
const KNOWN: [&str; 19] = [
    "RGBPoints",
    "ColorSpace",
    "Points",
    "IndexedColors",
    "HSVWrap",
    "UseLogScale",
    "Name",
    "Creator",
    "Author",
    "License",
    "Source",
    "Category",
    "Groups",
    "Tags",
    "DefaultMap",
    "NanColor",
    "NanOpacity",
    "AllowDuplicateScalars",
    "AutomaticRescaleRangeMode",
];

/// Yes or no, as ParaView writes it.
#[derive(Clone, Copy, Deserialize)]
#[serde(untagged)]
enum Flag {
    Bool(bool),
    Number(f64),
    List([f64; 1]),
}

impl Flag {
    fn is_set(self) -> bool {
        match self {
            Flag::Bool(set) => set,
            Flag::Number(n) | Flag::List([n]) => n != 0.0,
        }
    }
}

/// Whether a property's value is one that says nothing: no, none, or an empty list.
fn is_unset(value: &serde_json::Value) -> bool {
    match value {
        serde_json::Value::Null => true,
        serde_json::Value::Bool(set) => !set,
        serde_json::Value::Number(n) => n.as_f64() == Some(0.0),
        serde_json::Value::String(s) => s.is_empty(),
        serde_json::Value::Array(list) => list.iter().all(is_unset),
        serde_json::Value::Object(list) => list.is_empty(),
    }
}

/// A list (s, N numbers, s, …) as points over [0, 1]; if `log`, of the logarithms, if they have such.
fn tuples<const N: usize>(list: &[f64], log: bool) -> Result<Vec<(f64, [f64; N])>, String> {
    if list.is_empty() || !list.len().is_multiple_of(N + 1) {
        return Err(format!("holds {} numbers, not {} for each point", list.len(), N + 1));
    }
    if !list.iter().all(|x| x.is_finite()) {
        return Err("holds a number that is not finite".into());
    }
    let points = list.chunks_exact(N + 1).map(|p| (p[0], std::array::from_fn(|k| p[k + 1])));
    let mut points: Vec<(f64, [f64; N])> = points.collect();
    if let Some(i) = points.windows(2).position(|w| w[1].0 < w[0].0) {
        return Err(format!("decreases from {} to {}", points[i].0, points[i + 1].0));
    }
    if log && points[0].0 > 0.0 {
        points.iter_mut().for_each(|p| p.0 = p.0.ln());
    }
    let (lo, hi) = (points[0].0, points[points.len() - 1].0);
    for p in &mut points {
        p.0 = if hi > lo { (p.0 - lo) / (hi - lo) } else { 0.0 };
    }
    Ok(points)
}

fn color_points(colors: &[(f64, [f64; 3])], space: Space) -> Vec<(f64, [f64; 3])> {
    let mut points = vec![colors[0]];
    for w in colors.windows(2) {
        let ((x0, a), (x1, b)) = (w[0], w[1]);
        match space {
            _ if x1 <= x0 => points.push(w[1]),
            Space::Rgb => points.push(w[1]),
            _ => points.extend(resample(x0, x1, TOLERANCE, &|u| space.mix(a, b, u))),
        }
    }
    points.dedup();
    points
}

/// Points (opacity, midpoint, sharpness) as VTK's piecewise function means them.
fn opacity_points(list: &[(f64, [f64; 3])]) -> Vec<(f64, f64)> {
    let mut points = vec![(list[0].0, list[0].1[0])];
    for w in list.windows(2) {
        let ((x0, [a, middle, sharpness]), (x1, [b, ..])) = (w[0], w[1]);
        let middle = middle.clamp(1e-5, 1.0 - 1e-5);
        let at = x0 + (x1 - x0) * middle;
        let straight = x1 <= x0 || (sharpness < 0.01 && middle == 0.5);
        if !straight && sharpness > 0.99 {
            points.extend([(at, a), (at, b)]);
        } else if !straight {
            // Each half is smooth, and so safe to bisect.
            for (from, to, half) in [(x0, at, 0.0), (at, x1, 0.5)] {
                let f = |u: f64| [sharpened(a, b, half + u / 2.0, sharpness)];
                points.extend(resample(from, to, TOLERANCE, &f).into_iter().map(|(x, [a])| (x, a)));
            }
        }
        points.push((x1, b));
    }
    points.dedup();
    points
}

/// VTK's curve from `a` to `b` at `u` in [0, 1], whose midpoint is at ½: linear for sharpness 0, nearly a step for 0.99
/// (vtkPiecewiseFunction::GetTable).
fn sharpened(a: f64, b: f64, u: f64, sharpness: f64) -> f64 {
    if sharpness < 0.01 {
        return a + (b - a) * u;
    }
    let power = 1.0 + 10.0 * sharpness;
    let u = if u < 0.5 { 0.5 * (2.0 * u).powf(power) } else { 1.0 - 0.5 * (2.0 - 2.0 * u).powf(power) };
    let (u2, u3) = (u * u, u * u * u);
    let slope = (1.0 - sharpness) * (b - a);
    let value = (2.0 * u3 - 3.0 * u2 + 1.0) * a + (3.0 * u2 - 2.0 * u3) * b + slope * (2.0 * u3 - 3.0 * u2 + u);
    value.clamp(a.min(b), a.max(b))
}

/// Points from `x0` to `x1` between which `f`, a function on [0, 1], is linear up to `tolerance`.
fn resample<const N: usize>(x0: f64, x1: f64, tolerance: f64, f: &dyn Fn(f64) -> [f64; N]) -> Vec<(f64, [f64; N])> {
    fn refine<const N: usize>(
        f: &dyn Fn(f64) -> [f64; N],
        tolerance: f64,
        ((u0, a), (u1, b)): ((f64, [f64; N]), (f64, [f64; N])),
        depth: u32,
        out: &mut Vec<(f64, [f64; N])>,
    ) {
        let off = |k: u32| {
            let w = f64::from(k) / 8.0;
            let v = f(u0 + (u1 - u0) * w);
            (0..N).map(|c| (a[c] + (b[c] - a[c]) * w - v[c]).abs()).fold(0.0, f64::max)
        };
        // Where the curve is smooth, the samples miss less than the eighth that is left to the tolerance.
        if depth > 0 && (1..8).any(|k| off(k) > tolerance * 0.875) {
            let u = (u0 + u1) / 2.0;
            let middle = (u, f(u));
            refine(f, tolerance, ((u0, a), middle), depth - 1, out);
            refine(f, tolerance, (middle, (u1, b)), depth - 1, out);
        } else {
            out.push((u1, b));
        }
    }
    let mut out = vec![(0.0, f(0.0))];
    refine(f, tolerance, ((0.0, f(0.0)), (1.0, f(1.0))), 16, &mut out);
    out.into_iter().map(|(u, c)| (if u == 1.0 { x1 } else { x0 + (x1 - x0) * u }, c)).collect()
}

/// Points `[255 x, r, g, b]` of matplotlib's table of 256 (CC0; S. van der Walt, N. Smith, E. Firing), chosen so that
/// the lines between them miss it by at most 1/255.
#[rustfmt::skip]
const VIRIDIS: [[f64; 4]; 16] = [
    [0.0, 0.2670, 0.0049, 0.3294], [19.0, 0.2831, 0.1106, 0.4316], [36.0, 0.2752, 0.1949, 0.4960],
    [54.0, 0.2486, 0.2788, 0.5346], [81.0, 0.1976, 0.3915, 0.5550], [122.0, 0.1351, 0.5449, 0.5540],
    [141.0, 0.1195, 0.6148, 0.5377], [153.0, 0.1347, 0.6586, 0.5176], [164.0, 0.1757, 0.6979, 0.4910],
    [177.0, 0.2529, 0.7422, 0.4483], [193.0, 0.3778, 0.7918, 0.3779], [213.0, 0.5655, 0.8424, 0.2629],
    [235.0, 0.7938, 0.8807, 0.1200], [242.0, 0.8660, 0.8899, 0.0960], [248.0, 0.9261, 0.8973, 0.1041],
    [255.0, 0.9932, 0.9062, 0.1439],
];

/// As [`VIRIDIS`].
#[rustfmt::skip]
const INFERNO: [[f64; 4]; 22] = [
    [0.0, 0.0015, 0.0005, 0.0139], [5.0, 0.0077, 0.0061, 0.0468], [15.0, 0.0377, 0.0259, 0.1322],
    [28.0, 0.1046, 0.0470, 0.2534], [39.0, 0.1765, 0.0414, 0.3481], [47.0, 0.2315, 0.0364, 0.3924],
    [58.0, 0.3036, 0.0494, 0.4222], [75.0, 0.4101, 0.0879, 0.4331], [95.0, 0.5347, 0.1325, 0.4167],
    [115.0, 0.6585, 0.1790, 0.3727], [137.0, 0.7859, 0.2471, 0.2955], [156.0, 0.8780, 0.3321, 0.2123],
    [174.0, 0.9415, 0.4364, 0.1254], [192.0, 0.9784, 0.5579, 0.0349], [198.0, 0.9846, 0.6011, 0.0236],
    [203.0, 0.9873, 0.6379, 0.0349], [211.0, 0.9871, 0.6979, 0.0877], [223.0, 0.9761, 0.7900, 0.1960],
    [233.0, 0.9587, 0.8666, 0.3108], [241.0, 0.9468, 0.9242, 0.4264], [248.0, 0.9545, 0.9659, 0.5404],
    [255.0, 0.9884, 0.9984, 0.6449],
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transfer::TransferFunction;

    fn preset(json: &str) -> Result<ColorMap> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("preset.json");
        std::fs::write(&path, json).unwrap();
        ColorMap::open(&path, None)
    }

    fn color(map: &ColorMap, x: f64) -> [f64; 3] {
        TransferFunction::new(map.over([0.0, 1.0]), vec![(0.0, 1.0)], 1.0).unwrap().color_at(x)
    }

    fn close(a: [f64; 3], b: [f64; 3], tolerance: f64) {
        assert!((0..3).all(|k| (a[k] - b[k]).abs() <= tolerance), "{a:?} is not {b:?}");
    }

    #[test]
    fn names() {
        close(color(&ColorMap::named("Viridis").unwrap(), 128.0 / 255.0), [0.127568, 0.566949, 0.550556], 1.0 / 255.0);
        close(color(&ColorMap::named("inferno").unwrap(), 64.0 / 255.0), [0.341500, 0.062325, 0.429425], 1.0 / 255.0);
        close(color(&ColorMap::named("gray").unwrap(), 0.3), [0.3; 3], 1e-12);
        let message = ColorMap::named("jet").unwrap_err().to_string();
        assert!(message.contains("jet") && message.contains("viridis"), "{message}");
        for name in NAMES {
            let knots = ColorMap::named(name).unwrap().over([-2.0, 6.0]);
            assert_eq!((knots[0].0, knots[knots.len() - 1].0), (-2.0, 6.0));
            assert!(knots.len() < 40, "{name} has {} knots", knots.len());
            TransferFunction::new(knots, vec![(0.0, 1.0)], 1.0).unwrap();
        }
    }

    /// What vtkColorTransferFunction 9.7 answers, for presets that ParaView could have saved.
    #[test]
    fn spaces_are_vtks() {
        let warm = "0, 0.231373, 0.298039, 0.752941, 1, 0.705882, 0.0156863, 0.14902";
        let blues = "0, 0.1, 0.2, 0.9, 1, 1, 0.8, 0.05";
        let three = "0, 1, 0, 0.2, 0.5, 0.2, 0.3, 1, 1, 1, 1, 0.1";
        let through_grey = "0, 0.2, 0.3, 0.7, 0.5, 0.86, 0.86, 0.86, 1, 0.7, 0.02, 0.15";
        for (space, points, x, wanted) in [
            ("Diverging", warm, 0.1, [0.351735, 0.468506, 0.890376]),
            ("Diverging", warm, 0.25, [0.553318, 0.688635, 0.995188]),
            ("Diverging", warm, 0.5, [0.865395, 0.865410, 0.865396]),
            ("Diverging", warm, 0.6, [0.948076, 0.795205, 0.717170]),
            ("Diverging", warm, 0.9, [0.842251, 0.326619, 0.266613]),
            ("Diverging", through_grey, 0.1, [0.264456, 0.461377, 0.835576]),
            ("Diverging", through_grey, 0.9, [0.834948, 0.324574, 0.265432]),
            ("Lab", blues, 0.2, [0.508819, 0.303608, 0.775985]),
            ("Lab", blues, 0.8, [0.913095, 0.670160, 0.356930]),
            ("HSV", three, 0.1, [1.000000, 0.040000, 0.601600]),
            ("HSV", three, 0.25, [0.853750, 0.100000, 1.000000]),
            ("HSV", three, 0.6, [0.180000, 0.754000, 1.000000]),
            ("Step", three, 0.1, [0.2, 0.3, 1.0]),
            ("Step", three, 0.6, [1.0, 1.0, 0.1]),
            ("RGB", three, 0.25, [0.6, 0.15, 0.6]),
        ] {
            let map = preset(&format!(r#"[{{"Name": "x", "ColorSpace": "{space}", "RGBPoints": [{points}]}}]"#));
            let map = map.unwrap();
            close(color(&map, x), wanted, 1.1e-4);
            assert!(space != "RGB" || map.points().len() == 3);
        }
        let named = ColorMap::named("cool to warm").unwrap();
        close(color(&named, 0.25), [0.553318, 0.688635, 0.995188], 1.0 / 255.0);
    }

    /// What vtkColorTransferFunction 9.7 answers with HSVWrap off, as ParaView has it, and on; and with log10 scale.
    #[test]
    fn hue_wraps_and_values_are_logarithms_where_a_preset_says_so() {
        let rainbow = "0, 0, 0, 1, 1, 1, 0, 0";
        for (wrap, x, wanted) in [
            ("", 0.25, [0.0, 1.0, 1.0]),
            ("", 0.5, [0.0, 1.0, 0.0]),
            (r#""HSVWrap": 0,"#, 0.75, [1.0, 1.0, 0.0]),
            (r#""HSVWrap": 1,"#, 0.5, [1.0, 0.0, 1.0]),
            (r#""HSVWrap": true,"#, 0.25, [0.5, 0.0, 1.0]),
        ] {
            let map = preset(&format!(r#"[{{"Name": "x", {wrap} "ColorSpace": "HSV", "RGBPoints": [{rainbow}]}}]"#));
            close(color(&map.unwrap(), x), wanted, 1.1e-4);
        }
        let points = "1, 1, 0, 0.2, 10, 0.2, 0.3, 1, 1000, 1, 1, 0.1";
        let map = preset(&format!(r#"[{{"Name": "x", "UseLogScale": 1, "RGBPoints": [{points}]}}]"#)).unwrap();
        let at = |range, s| TransferFunction::new(map.over(range), vec![(0.0, 1.0)], 1.0).unwrap().color_at(s);
        for (s, wanted) in [
            (2.0, [0.759176, 0.090309, 0.440824]),
            (5.0, [0.440824, 0.209691, 0.759176]),
            (100.0, [0.6, 0.65, 0.55]),
            (500.0, [0.879588, 0.89464, 0.235463]),
        ] {
            close(at([1.0, 1e3], s), wanted, 1.1e-4);
            close(at([1e-6, 1e-3], s * 1e-6), wanted, 1.1e-4);
        }
        // There are no logarithms: as if it said nothing.
        close(at([0.0, 3.0], 1.0), [0.2, 0.3, 1.0], 1e-12);
    }

    /// What vtkPiecewiseFunction 9.7 answers.
    #[test]
    fn midpoint_and_sharpness_are_vtks() {
        let map = preset(
            r#"{"RGBPoints": [0,0,0,0, 1,1,1,1], "Points": [0,0.1,0.3,0.4, 1,0.9,0.5,0, 2,0,0.5,1, 3,0.5,0.5,0]}"#,
        );
        let knots = map.unwrap().opacity_over([0.0, 3.0]).unwrap();
        let f = TransferFunction::new(vec![(0.0, [1.0; 3])], knots, 1.0).unwrap();
        for (s, wanted) in
            [(0.1, 0.100992), (0.3, 0.5), (0.5, 0.847593), (0.9, 0.9), (1.3, 0.63), (2.2, 0.0), (2.7, 0.5)]
        {
            assert!((f.opacity_at(s) - wanted).abs() < 1.1e-4, "{s}: {} is not {wanted}", f.opacity_at(s));
        }
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (json, part) in [
            (r#"[{"Name": "a", "RGBPoints": [0, 1, 2]}]"#, "3 numbers"),
            (r#"[{"Name": "a", "RGBPoints": [1,0,0,0, 0,1,1,1]}]"#, "decreases"),
            (r#"[{"Name": "a", "RGBPoints": "red"}]"#, "preset \"a\""),
            (r#"[{"Name": "a", "IndexedColors": [0,0,1]}]"#, "categorical"),
            (r#"[{"Name": "a", "ColorSpace": "Lab/CIEDE2000", "RGBPoints": [0,0,0,0]}]"#, "CIEDE2000"),
            ("[]", "no preset"),
            ("[", "EOF"),
        ] {
            let message = preset(json).unwrap_err().to_string();
            assert!(message.contains(part) && message.contains("preset.json"), "{message}");
        }
    }
}
