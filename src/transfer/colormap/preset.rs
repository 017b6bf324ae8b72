//! Presets as ParaView saves them: a list of objects, each with the properties of a colour map.

use super::{ColorMap, TOLERANCE, resample};
use crate::error::{Error, Result};
use crate::transfer::space::Space;
use serde_json::{Map, Value};
use std::path::Path;

/// What a preset may say that Halite does, or that changes no picture of values that are finite.
const KNOWN: [&str; 26] = [
    "RGBPoints",
    "ColorSpace",
    "Points",
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
    "Description",
    "DefaultMap",
    "NanColor",
    "NanOpacity",
    "AllowDuplicateScalars",
    "AutomaticRescaleRangeMode",
    "ScalarRangeInitialized",
    // Of use only with a property of its own, which is named: IndexedLookup, Discretize, Use…RangeColor.
    "IndexedColors",
    "IndexedOpacities",
    "NumberOfTableValues",
    "AboveRangeColor",
    "BelowRangeColor",
    "ShowIndexedColorActiveValues",
];

/// How far a preset of logarithms, and its knots on a logarithmic axis, may each be off.
const TOLERANCE_LOG: f64 = TOLERANCE / 2.0;

/// How far beyond 0 to 1 components of colours may be that were computed.
const ROUNDING: f64 = 1e-3;

impl ColorMap {
    /// Reads a preset that ParaView saved (.json): the one called `preset`, or the first in the file.
    ///
    /// # Errors
    /// [`Error::File`], [`Error::Malformed`], or [`Error::Unsupported`] for a categorical map or an unknown colour
    /// space.
    pub fn open(path: &Path, preset: Option<&str>) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::file(path, e))?;
        let malformed = |what: String| Error::malformed(path, what);
        let text = text.trim_start_matches('\u{feff}');
        if text.trim_start().starts_with('<') {
            let what =
                "it is XML, as presets of ParaView were before version 5; ParaView reads it, and saves it as .json";
            return Err(Error::unsupported(path, what));
        }
        let broken = |e: serde_json::Error| format!("it is no JSON: line {}, column {}", e.line(), e.column());
        let list = match serde_json::from_str(&without_last_commas(text)).map_err(|e| malformed(broken(e)))? {
            Value::Array(list) => list,
            one => vec![one],
        };
        let name = |v: &Value| v["Name"].as_str().unwrap_or("").to_owned();
        let Some(chosen) = list.iter().find(|v| preset.is_none_or(|p| name(v) == p)) else {
            let names = list.iter().map(|v| format!("\"{}\"", name(v))).collect::<Vec<_>>();
            return Err(malformed(match preset {
                Some(p) => format!("no preset is called \"{p}\"; there are {}", names.join(", ")),
                None => "there is no preset in it".into(),
            }));
        };
        let Value::Object(properties) = chosen else { return Err(malformed(format!("{chosen} is no preset"))) };
        let what = format!("preset \"{}\"", name(chosen));
        let has_points = properties.get("RGBPoints").and_then(Value::as_array).is_some_and(|list| !list.is_empty());
        if !has_points && properties.contains_key("IndexedColors") {
            return Err(Error::unsupported(path, format!("{what} is categorical (IndexedColors), not a colour map")));
        }
        let space = match space(properties).map_err(|e| malformed(format!("{what}: {e}")))? {
            Ok(space) => space,
            Err(other) => {
                let what =
                    format!("{what} has the colour space \"{other}\"; save it as RGB, HSV, Lab, Diverging or Step");
                return Err(Error::unsupported(path, what));
            }
        };
        let map = map(properties, space).map_err(|e| malformed(format!("{what}: {e}")))?;
        for (name, value) in properties {
            if !KNOWN.contains(&name.as_str()) && !is_unset(value) {
                tracing::warn!("{}: {what} says {name}: {value}, which Halite does not do", path.display());
            }
        }
        for name in ["NanColor", "NanOpacity"] {
            if let Some(value) = properties.get(name) {
                let left_out = "NaN is left out, unless the program's --nan-color says a colour";
                tracing::info!("{}: {what} says {name}: {value}; {left_out}", path.display());
            }
        }
        Ok(map)
    }
}

/// JSON without the commas behind the last of a list or an object, which ParaView reads and has in its own file; what is
/// left stays in its place.
fn without_last_commas(text: &str) -> String {
    let mut bytes = text.as_bytes().to_vec();
    let (mut in_text, mut escaped, mut comma) = (false, false, None);
    for (i, &byte) in text.as_bytes().iter().enumerate() {
        match (byte, comma) {
            _ if in_text => {
                (in_text, escaped) = (escaped || byte != b'"', !escaped && byte == b'\\');
            }
            (b']' | b'}', Some(at)) => {
                bytes[at] = b' ';
                comma = None;
            }
            (b',', _) => comma = Some(i),
            (b' ' | b'\t' | b'\r' | b'\n', _) => {}
            _ => (in_text, comma) = (byte == b'"', None),
        }
    }
    String::from_utf8(bytes).unwrap_or_else(|_| text.to_owned())
}

/// The colour space of a preset, or the name of one that is not known.
fn space(properties: &Map<String, Value>) -> Result<Result<Space, String>, String> {
    let name = match properties.get("ColorSpace") {
        None => "RGB",
        Some(Value::String(name)) => name,
        Some(other) => return Err(format!("ColorSpace is {other}, no text")),
    };
    Ok(Ok(match name {
        "RGB" => Space::Rgb,
        // ParaView's default, unlike VTK's, is not to.
        "HSV" => Space::Hsv { wrap: flag(properties, "HSVWrap")? },
        "Lab" => Space::Lab,
        "Diverging" => Space::Diverging,
        "Step" => Space::Step,
        other => return Ok(Err(other.to_owned())),
    }))
}

fn map(properties: &Map<String, Value>, space: Space) -> Result<ColorMap, String> {
    let log = flag(properties, "UseLogScale")?;
    let points = |name: &str| -> Result<Option<Vec<_>>, String> {
        let Some(value) = properties.get(name).filter(|value| !value.is_null()) else { return Ok(None) };
        numbers(value).and_then(|list| tuples::<3>(&list, log)).map(Some).map_err(|e| format!("{name} {e}"))
    };
    let mut colors = points("RGBPoints")?.ok_or("it has no RGBPoints")?;
    for c in colors.iter_mut().flat_map(|p| &mut p.1) {
        if !(-ROUNDING..=1.0 + ROUNDING).contains(c) {
            return Err(format!("RGBPoints: red, green and blue are 0 to 1, and one is {c}"));
        }
        *c = c.clamp(0.0, 1.0);
    }
    let opacity = points("Points")?;
    if let Some((_, [a, ..])) = opacity.iter().flatten().find(|p| p.1[0] < 0.0) {
        return Err(format!("Points: opacities are 0 or more, and one is {a}"));
    }
    let tolerance = if log { TOLERANCE_LOG } else { TOLERANCE };
    Ok(ColorMap {
        points: color_points(&colors, space, tolerance),
        opacity: opacity.map(|p| opacity_points(&p, tolerance)),
        tolerance: TOLERANCE_LOG,
        log,
    })
}

/// Yes or no, as ParaView writes it; no if there is no such property.
fn flag(properties: &Map<String, Value>, name: &str) -> Result<bool, String> {
    let Some(value) = properties.get(name) else { return Ok(false) };
    let one = match value {
        Value::Array(list) if list.len() == 1 => &list[0],
        other => other,
    };
    let set = one.as_bool().or_else(|| one.as_f64().map(|n| n != 0.0));
    set.ok_or_else(|| format!("{name} is {value}, not 0 or 1"))
}

/// Whether a property's value is one that says nothing: no, none, or an empty list.
fn is_unset(value: &Value) -> bool {
    match value {
        Value::Null => true,
        Value::Bool(set) => !set,
        Value::Number(n) => n.as_f64() == Some(0.0),
        Value::String(s) => s.is_empty(),
        Value::Array(list) => list.iter().all(is_unset),
        Value::Object(list) => list.is_empty(),
    }
}

fn numbers(value: &Value) -> Result<Vec<f64>, String> {
    let Value::Array(list) = value else { return Err(format!("is {value}, no list of numbers")) };
    list.iter().map(|v| v.as_f64().ok_or_else(|| format!("holds {v}, which is no number"))).collect()
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

/// How far behind its point, in places, a map of steps goes on to the next colour: at the point itself it still has the
/// point's own, as values of cells may ask for.
const BEHIND: f64 = 1.0 / (1 << 20) as f64;

fn color_points(colors: &[(f64, [f64; 3])], space: Space, tolerance: f64) -> Vec<(f64, [f64; 3])> {
    let mut points = vec![colors[0]];
    for w in colors.windows(2) {
        let ((x0, a), (x1, b)) = (w[0], w[1]);
        match space {
            _ if x1 <= x0 => points.push(w[1]),
            Space::Rgb => points.push(w[1]),
            Space::Step => {
                let x = x0 + BEHIND.min((x1 - x0) / 2.0);
                points.extend([(x, a), (x, b)]);
            }
            _ => points.extend(resample(x0, x1, tolerance, &|u| space.mix(a, b, u))),
        }
    }
    let last = colors[colors.len() - 1];
    if points.last().is_some_and(|p| p.0 < last.0) {
        points.push(last);
    }
    points.dedup();
    points
}

/// Points (opacity, midpoint, sharpness) as VTK's piecewise function means them.
fn opacity_points(list: &[(f64, [f64; 3])], tolerance: f64) -> Vec<(f64, f64)> {
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
                points.extend(resample(from, to, tolerance, &f).into_iter().map(|(x, [a])| (x, a)));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::host::Log;
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
    }

    /// As vtkColorTransferFunction 9.7 has it: up to a point, and at it, there is its own colour.
    #[test]
    fn steps_are_behind_their_points() {
        let map = preset(r#"{"ColorSpace": "Step", "RGBPoints": [2,1,0,0, 3,0,1,0, 6,0,0,1]}"#).unwrap();
        let (red, green, blue) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
        for (x, wanted) in
            [(0.0, red), (1e-4, green), (0.24, green), (0.25, green), (0.2501, blue), (0.7, blue), (1.0, blue)]
        {
            assert_eq!(color(&map, x), wanted, "{x}");
        }
        assert_eq!((map.points()[0].0, map.points()[map.points().len() - 1].0), (0.0, 1.0));
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

    /// Every scalar has the colour and opacity that the preset has at its logarithm's place, within 1e-4, in every space.
    #[test]
    fn logarithms_are_met_everywhere() {
        let (blues, opacity) = ([[0.1, 0.2, 0.9], [1.0, 0.8, 0.05]], "1,0,0.3,0.4, 10,2,0.5,0, 1000,0.5,0.5,0");
        for (name, space) in [
            ("RGB", Space::Rgb),
            ("HSV", Space::Hsv { wrap: false }),
            ("Lab", Space::Lab),
            ("Diverging", Space::Diverging),
        ] {
            let map = preset(&format!(
                r#"{{"ColorSpace": "{name}", "UseLogScale": 1, "RGBPoints": [1,0.1,0.2,0.9, 1000,1,0.8,0.05], "Points": [{opacity}]}}"#
            ));
            let map = map.unwrap();
            let even = [(0.0, [0.0, 0.3, 0.4]), (1.0 / 3.0, [2.0, 0.5, 0.0]), (1.0, [0.5, 0.5, 0.0])];
            let even = TransferFunction::new(vec![(0.0, [1.0; 3])], opacity_points(&even, 1e-6), 1.0).unwrap();
            for range in [[1.0, 1e3], [2e-9, 4e-3], [0.5, 0.6], [1e-30, 1e20]] {
                let axis = map.axis(range);
                assert!(axis.is_logarithmic());
                let f = TransferFunction::new(map.over(range), map.opacity_on(&axis).unwrap(), 1.0).unwrap();
                for i in 0..=4000 {
                    let u = f64::from(i) / 4000.0;
                    let s = axis.scalar(u);
                    close(f.color_at(s), space.mix(blues[0], blues[1], u), 1.02e-4);
                    let (got, wanted) = (f.opacity_at(s), even.opacity_at(u));
                    assert!((got - wanted).abs() <= 2.0 * 1.02e-4, "{range:?} at {u}: {got} is not {wanted}");
                }
            }
        }
    }

    /// As jsoncpp reads JSON, and so ParaView, whose own file of presets ends with a comma.
    #[test]
    fn commas_may_be_last() {
        let map = preset("[\n{\"Name\": \"a,]\\\",}\", \"RGBPoints\": [0,0,0,0, 1,1,1,1 ,\n],},\n\t]").unwrap();
        assert_eq!(map.points(), [(0.0, [0.0; 3]), (1.0, [1.0; 3])]);
        for (text, left) in
            [("[1,,]", "[1, ]"), ("[,]", "[ ]"), (",", ","), (r#"{"a": "b,]\",}",}"#, r#"{"a": "b,]\",}" }"#)]
        {
            assert_eq!(without_last_commas(text), left);
        }
        assert!(preset("[1,,]").is_err());
    }

    /// What vtkPiecewiseFunction 9.7 answers.
    #[test]
    fn midpoint_and_sharpness_are_vtks() {
        let map = preset(
            r#"{"RGBPoints": [0,0,0,0, 1,1,1,1], "Points": [0,0.1,0.3,0.4, 1,0.9,0.5,0, 2,0,0.5,1, 3,0.5,0.5,0]}"#,
        );
        let map = map.unwrap();
        let knots = map.opacity_on(&map.axis([0.0, 3.0])).unwrap();
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
            ("[", "line 1, column 1"),
            ("[{\n\"Name\": }]", "line 2, column 9"),
            ("<ColorMaps/>", "XML"),
            ("[3]", "3 is no preset"),
            (r#"[{"Name": "a"}]"#, "no RGBPoints"),
            (r#"[{"Name": "a", "RGBPoints": [0, "1", 0, 0]}]"#, "RGBPoints holds \"1\", which is no number"),
            (r#"[{"Name": "a", "RGBPoints": [0, null, 0, 0]}]"#, "RGBPoints holds null"),
            (r#"[{"Name": "a", "RGBPoints": [0, 255, 0, 0]}]"#, "red, green and blue are 0 to 1, and one is 255"),
            (
                r#"[{"Name": "a", "RGBPoints": [0,0,0,0], "Points": [0, -1, 0.5, 0]}]"#,
                "opacities are 0 or more, and one is -1",
            ),
            (r#"[{"Name": "a", "RGBPoints": [0,0,0,0], "ColorSpace": 1}]"#, "ColorSpace is 1, no text"),
            (r#"[{"Name": "a", "RGBPoints": [0,0,0,0], "UseLogScale": "on"}]"#, "UseLogScale is \"on\", not 0 or 1"),
        ] {
            let message = preset(json).unwrap_err().to_string();
            assert!(message.contains(part) && message.contains("preset.json"), "{message}");
            assert!(!message.contains("expected") && !message.contains("invalid"), "{message}");
        }
    }

    /// What a preset says and Halite does not do is named, what is not in use is not.
    #[test]
    fn what_is_not_done_is_named() {
        let said = |properties: &str| {
            let log = Log::default();
            let json = format!(r#"{{"Name": "x", {properties}, "RGBPoints": [0,0,0,0, 1,1,1,1]}}"#);
            log.collect(|| preset(&json)).unwrap();
            log.take().into_iter().filter(|line| line.contains("WARN")).collect::<Vec<_>>().join("\n")
        };
        for (properties, name) in [
            (r#""UseAboveRangeColor": 1, "AboveRangeColor": [1, 0, 0]"#, "UseAboveRangeColor"),
            (r#""UseBelowRangeColor": true"#, "UseBelowRangeColor"),
            (r#""IndexedLookup": 1, "IndexedColors": [1, 0, 0]"#, "IndexedLookup"),
            (r#""Discretize": 1, "NumberOfTableValues": 8"#, "Discretize"),
            (r#""EnableOpacityMapping": 1"#, "EnableOpacityMapping"),
            (r#""SomethingNew": "x""#, "SomethingNew"),
        ] {
            let warned = said(properties);
            assert!(warned.contains(name) && warned.lines().count() == 1, "{properties}: {warned}");
        }
        for properties in [
            r#""UseAboveRangeColor": 0, "AboveRangeColor": [1, 0, 0], "BelowRangeColor": [1, 0, 0]"#,
            r#""IndexedColors": [1, 0, 0], "IndexedOpacities": [1], "NumberOfTableValues": 256, "Discretize": 0"#,
            r#""NanColor": [1, 1, 0], "NanOpacity": 1, "Annotations": [], "ScalarRangeInitialized": 1"#,
        ] {
            assert_eq!(said(properties), "", "{properties}");
        }
    }
}
