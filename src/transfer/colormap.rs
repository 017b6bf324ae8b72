//! Colour maps: those with a name, and ParaView's presets from a file.

mod named;

use super::Axis;
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

/// The names that [`ColorMap::named`] knows; each may have `_r` behind it.
pub const NAMES: [&str; 10] =
    ["viridis", "plasma", "inferno", "magma", "cividis", "turbo", "twilight", "jet", "cool to warm", "grey"];

/// How far a resampled preset may be from the original, in a component of RGB or in opacity.
const TOLERANCE: f64 = 1e-4;

/// How far a named map may be: below what 8 bits show, because every point costs time inside every cell that it is in.
const TOLERANCE_NAMED: f64 = 1.0 / 255.0;

impl ColorMap {
    /// One of [`NAMES`], accurate to 1/255; with `_r` behind it, from its end to its beginning. Case, and whether words
    /// are joined by spaces, `-` or `_`, do not matter.
    ///
    /// # Errors
    /// [`Error::Transfer`], with the names that exist.
    pub fn named(name: &str) -> Result<Self> {
        let words = name.to_lowercase().replace(['-', '_'], " ");
        let (word, reversed) = match words.strip_suffix(" r") {
            Some(word) => (word, true),
            None => (words.as_str(), false),
        };
        let points = match word {
            "cool to warm" | "coolwarm" => resample(0.0, 1.0, TOLERANCE_NAMED, &|u| {
                Space::Diverging.mix([0.231373, 0.298039, 0.752941], [0.705882, 0.0156863, 0.14902], u)
            }),
            "grey" | "gray" | "grayscale" | "greyscale" => vec![(0.0, [0.0; 3]), (1.0, [1.0; 3])],
            _ => named::table(word).ok_or_else(|| {
                let names = NAMES.join("\", \"");
                Error::Transfer(format!(
                    "no colour map is called \"{name}\"; there are \"{names}\", each also with _r, reversed"
                ))
            })?,
        };
        let map = ColorMap { points, opacity: None, log: false };
        Ok(if reversed { map.reversed() } else { map })
    }

    /// One colour, whose components are in [0, 1].
    pub fn solid(color: [f64; 3]) -> Self {
        ColorMap { points: vec![(0.0, color), (1.0, color)], opacity: None, log: false }
    }

    /// The map from its end to its beginning; so is the opacity that came with it.
    pub fn reversed(&self) -> Self {
        fn turned<T: Copy>(points: &[(f64, T)]) -> Vec<(f64, T)> {
            points.iter().rev().map(|&(x, v)| (1.0 - x, v)).collect()
        }
        ColorMap { points: turned(&self.points), opacity: self.opacity.as_deref().map(turned), log: self.log }
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

    /// The points `(place in [0, 1], opacity)` of the opacity function that came with a preset.
    pub fn opacity(&self) -> Option<&[(f64, f64)]> {
        self.opacity.as_deref()
    }

    /// How the map's places lie on a range: evenly in the logarithms if the preset says so and both ends are above 0, and
    /// else, with a warning, evenly.
    pub fn axis(&self, range: [f64; 2]) -> Axis {
        if self.log {
            match Axis::logarithmic(range) {
                Ok(axis) => return axis,
                Err(e) => tracing::warn!("the colour map is for logarithms, and is drawn without: {e}"),
            }
        }
        Axis::linear(range)
    }

    /// The knots of a colour function that has this map over a range of scalars; see [`Self::axis`].
    pub fn over(&self, range: [f64; 2]) -> Vec<(f64, [f64; 3])> {
        self.axis(range).knots(&self.points, TOLERANCE)
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
        close(color(&ColorMap::named("grey_r").unwrap(), 0.3), [0.7; 3], 1e-12);
        let message = ColorMap::named("bone").unwrap_err().to_string();
        assert!(message.contains("bone") && message.contains("viridis"), "{message}");
        for name in NAMES {
            let (map, turned) = (ColorMap::named(name).unwrap(), ColorMap::named(&format!("{name}_r")).unwrap());
            for x in [0.0, 0.11, 0.4, 0.77, 1.0] {
                close(color(&turned, x), color(&map, 1.0 - x), 1e-12);
            }
            let knots = ColorMap::named(name).unwrap().over([-2.0, 6.0]);
            assert_eq!((knots[0].0, knots[knots.len() - 1].0), (-2.0, 6.0));
            assert!(knots.len() < 40, "{name} has {} knots", knots.len());
            TransferFunction::new(knots, vec![(0.0, 1.0)], 1.0).unwrap();
        }
    }

    /// Entries of matplotlib 3.11's tables, which have 256 or (twilight) 510 of them; its jet between them.
    #[test]
    fn maps_are_matplotlibs() {
        for (name, x, wanted) in [
            ("viridis", 89.0 / 255.0, [0.183898, 0.422383, 0.556944]),
            ("viridis", 222.0 / 255.0, [0.657642, 0.860219, 0.203082]),
            ("plasma", 26.0 / 255.0, [0.261183, 0.013308, 0.617911]),
            ("plasma", 158.0 / 255.0, [0.896131, 0.415712, 0.366407]),
            ("inferno", 89.0 / 255.0, [0.497257, 0.119379, 0.424488]),
            ("inferno", 222.0 / 255.0, [0.977497, 0.782258, 0.185923]),
            ("magma", 26.0 / 255.0, [0.083446, 0.056225, 0.220755]),
            ("magma", 158.0 / 255.0, [0.8947, 0.309773, 0.393995]),
            ("cividis", 89.0 / 255.0, [0.356418, 0.375896, 0.430823]),
            ("cividis", 222.0 / 255.0, [0.862105, 0.782494, 0.350011]),
            ("turbo", 26.0 / 255.0, [0.27103, 0.35926, 0.81156]),
            ("turbo", 158.0 / 255.0, [0.92004, 0.82806, 0.22456]),
            ("twilight", 178.0 / 509.0, [0.362876, 0.225841, 0.618804]),
            ("twilight", 443.0 / 509.0, [0.796939, 0.626849, 0.519626]),
            ("jet", 0.1, [0.0, 0.0, 0.5 + 0.5 / 0.11 * 0.1]),
            ("jet", 0.3, [0.0, 0.7, 1.0]),
            ("jet", 0.5, [0.15 / 0.31, 1.0, 0.15 / 0.31]),
            ("jet", 0.95, [1.0 - 0.5 * 0.06 / 0.11, 0.0, 0.0]),
        ] {
            close(color(&ColorMap::named(name).unwrap(), x), wanted, 1.0 / 255.0);
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
        let map = map.unwrap();
        let knots = map.axis([0.0, 3.0]).knots(map.opacity().unwrap(), TOLERANCE);
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
