//! Colour maps: those with a name, and ParaView's presets from a file.

mod named;
mod preset;

use super::Axis;
use super::space::Space;
use crate::error::{Error, Result};

/// A colour map over [0, 1], piecewise linear in RGB; two points at one place are a step.
#[derive(Debug, Clone, PartialEq)]
pub struct ColorMap {
    points: Vec<(f64, [f64; 3])>,
    opacity: Option<Vec<(f64, f64)>>,
    /// How far knots may be off where an axis makes more of them.
    tolerance: f64,
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
        let map = ColorMap { points, opacity: None, tolerance: TOLERANCE_NAMED, log: false };
        Ok(if reversed { map.reversed() } else { map })
    }

    /// One colour, whose components are in [0, 1].
    pub fn solid(color: [f64; 3]) -> Self {
        ColorMap { points: vec![(0.0, color), (1.0, color)], opacity: None, tolerance: TOLERANCE_NAMED, log: false }
    }

    /// The map from its end to its beginning; so is the opacity that came with it.
    pub fn reversed(&self) -> Self {
        fn turned<T: Copy>(points: &[(f64, T)]) -> Vec<(f64, T)> {
            points.iter().rev().map(|&(x, v)| (1.0 - x, v)).collect()
        }
        ColorMap { points: turned(&self.points), opacity: self.opacity.as_deref().map(turned), ..*self }
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
        self.on(&self.axis(range))
    }

    /// The knots of a colour function that has this map on `axis`: within 1e-4 of a preset's colours, also by logarithms,
    /// and within 1/255 of those of a map with a name.
    pub fn on(&self, axis: &Axis) -> Vec<(f64, [f64; 3])> {
        axis.knots(&self.points, self.tolerance)
    }

    /// The knots of the opacity function that came with a preset, on `axis`: within 1e-4 of its largest opacity.
    pub fn opacity_on(&self, axis: &Axis) -> Option<Vec<(f64, f64)>> {
        let knots = self.opacity()?;
        let largest = knots.iter().fold(0.0, |most, k| k.1.max(most));
        Some(axis.knots(knots, self.tolerance * largest))
    }
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
        let warm = ColorMap::named("cool to warm").unwrap();
        close(color(&warm, 0.25), [0.553318, 0.688635, 0.995188], 1.0 / 255.0);
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
}
