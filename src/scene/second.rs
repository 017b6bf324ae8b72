//! What a scene says of a second variable, light and silhouettes.

use super::read;
use crate::error::{Error, Result};
use crate::image::npy::Npy;
use crate::transfer::bivariate::{Bivariate, OPEN, Shape, Sine, Table, Wave, Widget};
use crate::transfer::shading::{Cone, Highlight, Light, Origin, Shade, Shading};
use serde::de::Visitor;
use serde::{Deserialize, Deserializer};
use serde_json::Value;
use std::fmt::{self, Formatter};
use std::path::{Path, PathBuf};

/// The name by which the reader knows that null may stand in the place of a number.
pub(super) const OPEN_END: &str = "an open end";

/// The end of a range, or null where there is none.
#[derive(Clone, Copy)]
struct End(Option<f64>);

impl<'de> Deserialize<'de> for End {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct OrNull;
        impl<'de> Visitor<'de> for OrNull {
            type Value = End;

            fn expecting(&self, f: &mut Formatter) -> fmt::Result {
                f.write_str("a number, or null for an open end,")
            }

            fn visit_none<E>(self) -> Result<End, E> {
                Ok(End(None))
            }

            fn visit_newtype_struct<D: Deserializer<'de>>(self, from: D) -> Result<End, D::Error> {
                f64::deserialize(from).map(|end| End(Some(end)))
            }
        }
        from.deserialize_newtype_struct(OPEN_END, OrNull)
    }
}

/// A widget as scenes write it, such as `{"type": "uniform", "color": [1, 0, 0], "opacity": 0.5}`.
///
/// # Errors
/// What is wrong, and where in the value.
pub fn widget(value: &Value) -> Result<Widget, String> {
    let widget = read::<WidgetJson>(value)?.widget()?;
    widget.check()?;
    Ok(widget)
}

/// A range that may be open.
type Range = Option<[End; 2]>;

/// A widget as a scene's file has it: what kinds have in common, and what they have not.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WidgetJson {
    #[serde(rename = "type")]
    kind: WidgetKind,
    color: [f64; 3],
    opacity: f64,
    s: Range,
    g: Range,
    center: Option<[f64; 2]>,
    sigma: Option<[f64; 2]>,
    axis: Option<[f64; 2]>,
    v0: Option<f64>,
    period: Option<f64>,
    shape: Option<SineJson>,
    floor: Option<f64>,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "lowercase")]
enum WidgetKind {
    Uniform,
    Gaussian,
    Triangle,
    Sinusoid,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum SineJson {
    Abs,
    Positive,
    Raised,
}

impl WidgetJson {
    /// The widget, or what is wrong with it.
    fn widget(self) -> Result<Widget, String> {
        let (name, own): (_, &[&str]) = match self.kind {
            WidgetKind::Uniform => ("uniform", &[]),
            WidgetKind::Gaussian => ("gaussian", &["center", "sigma"]),
            WidgetKind::Triangle => ("triangle", &["axis", "v0", "period", "floor"]),
            WidgetKind::Sinusoid => ("sinusoid", &["axis", "v0", "period", "floor", "shape"]),
        };
        let given = [
            ("center", self.center.is_some()),
            ("sigma", self.sigma.is_some()),
            ("axis", self.axis.is_some()),
            ("v0", self.v0.is_some()),
            ("period", self.period.is_some()),
            ("shape", self.shape.is_some()),
            ("floor", self.floor.is_some()),
        ];
        if let Some((key, _)) = given.iter().find(|(key, given)| *given && !own.contains(key)) {
            return Err(format!("a widget of type \"{name}\" has no key \"{key}\""));
        }
        let missing = |key: &str| format!("the key \"{key}\" is missing");
        let wave = || {
            Ok::<_, String>(Wave {
                axis: self.axis.unwrap_or([1.0, 0.0]),
                start: self.v0.ok_or_else(|| missing("v0"))?,
                period: self.period.ok_or_else(|| missing("period"))?,
                floor: self.floor.unwrap_or(0.0),
            })
        };
        let shape = match self.kind {
            WidgetKind::Uniform => Shape::Uniform,
            WidgetKind::Gaussian => Shape::Gaussian {
                center: self.center.ok_or_else(|| missing("center"))?,
                sigma: self.sigma.ok_or_else(|| missing("sigma"))?,
            },
            WidgetKind::Triangle => Shape::Triangle(wave()?),
            WidgetKind::Sinusoid => Shape::Sinusoid(
                wave()?,
                match self.shape {
                    None | Some(SineJson::Abs) => Sine::Abs,
                    Some(SineJson::Positive) => Sine::Positive,
                    Some(SineJson::Raised) => Sine::Raised,
                },
            ),
        };
        let ends = |range: Range, [lo, hi]: [f64; 2]| match range {
            Some([a, b]) => [a.0.unwrap_or(lo), b.0.unwrap_or(hi)],
            None => [lo, hi],
        };
        let domain = [ends(self.s, OPEN[0]), ends(self.g, OPEN[1])];
        Ok(Widget { shape, color: self.color, opacity: self.opacity, domain })
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TableJson {
    pub(super) file: PathBuf,
    s: [f64; 2],
    g: [f64; 2],
}

impl TableJson {
    /// Reads the table: an array (rows, columns, 4), rows over g.
    fn table(&self, folder: &Path) -> Result<Table> {
        let path = folder.join(&self.file);
        let Npy { shape, values } = Npy::open(&path)?;
        let [rows, columns, 4] = shape[..] else {
            let what = format!("an array of shape {shape:?} is no table of (rows over g, columns over s, 4)");
            return Err(Error::malformed(&path, what));
        };
        let (texels, _) = values.as_chunks::<4>();
        Table::new([columns, rows], texels.to_vec(), [self.s, self.g])
            .map_err(|e| Error::malformed(&path, e.to_string()))
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ShadeJson {
    ambient: f64,
    diffuse: f64,
    specular: f64,
    power: f64,
    two_sided: Option<bool>,
    #[serde(default)]
    highlight: Highlight,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LightJson {
    #[serde(rename = "type")]
    kind: LightKind,
    direction: Option<[f64; 3]>,
    position: Option<[f64; 3]>,
    color: Option<[f64; 3]>,
    intensity: Option<f64>,
    attenuation: Option<[f64; 3]>,
    cone: Option<ConeJson>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ConeJson {
    direction: [f64; 3],
    angle: f64,
    #[serde(default)]
    exponent: f64,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum LightKind {
    Headlight,
    Direction,
    Position,
}

impl LightJson {
    /// The light, or what is wrong with it.
    fn light(self) -> Result<Light, String> {
        let missing = |key: &str| format!("the key \"{key}\" is missing");
        let strange = |what: &str, key: &str| Err(format!("a light of type \"{what}\" has no key \"{key}\""));
        let origin = match (self.kind, self.direction, self.position) {
            (LightKind::Headlight, Some(_), _) => return strange("headlight", "direction"),
            (LightKind::Headlight, _, Some(_)) => return strange("headlight", "position"),
            (LightKind::Direction, _, Some(_)) => return strange("direction", "position"),
            (LightKind::Position, Some(_), _) => return strange("position", "direction"),
            (LightKind::Headlight, None, None) => Origin::Headlight,
            (LightKind::Direction, d, None) => Origin::Direction(d.ok_or_else(|| missing("direction"))?.into()),
            (LightKind::Position, None, p) => Origin::Position(p.ok_or_else(|| missing("position"))?.into()),
        };
        let plain = Light::default();
        let (color, intensity) = (self.color.unwrap_or(plain.color), self.intensity.unwrap_or(plain.intensity));
        let cone = self.cone.map(|c| Cone { axis: c.direction.into(), angle: c.angle, exponent: c.exponent });
        Ok(Light { origin, color, intensity, attenuation: self.attenuation.unwrap_or(plain.attenuation), cone })
    }
}

/// What a scene says of a second variable, light and silhouettes: an object with some of the keys `widgets`, `table2d`,
/// `gradient_opacity`, `silhouette`, `shade` and `lights`. Files are relative to the working directory.
///
/// # Errors
/// [`Error::Transfer`] with what is wrong, and where in the value; those of reading a table's file.
pub fn look(value: &Value) -> Result<(Bivariate, Shading)> {
    let second: Second = read(value).map_err(Error::Transfer)?;
    match second.read(Path::new("")) {
        Err(Error::Malformed { path, what }) if path.as_os_str().is_empty() => Err(Error::Transfer(what)),
        other => other,
    }
}

/// What a scene's file has of a second variable and light.
#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct Second {
    pub(super) widgets: Option<Vec<WidgetJson>>,
    pub(super) table: Option<TableJson>,
    pub(super) gradient_opacity: Option<Vec<[f64; 2]>>,
    pub(super) silhouette: Option<f64>,
    pub(super) shade: Option<ShadeJson>,
    pub(super) lights: Option<Vec<LightJson>>,
    #[serde(skip)]
    pub(super) maximum: bool,
}

impl Second {
    /// What is lit and how; files are relative to the folder of `path`, which messages name.
    pub(super) fn read(self, path: &Path) -> Result<(Bivariate, Shading)> {
        let malformed = |what: String| Error::malformed(path, what);
        let given = [
            ("widgets", self.widgets.is_some()),
            ("table2d", self.table.is_some()),
            ("gradient_opacity", self.gradient_opacity.is_some()),
            ("silhouette", self.silhouette.is_some()),
            ("shade", self.shade.is_some()),
        ];
        if let (true, Some((key, _))) = (self.maximum, given.iter().find(|(_, given)| *given)) {
            return Err(malformed(format!("{key}: a maximum along rays has none; \"blend\": \"composite\" does")));
        }
        if self.widgets.is_some() && self.table.is_some() {
            return Err(malformed(
                "table2d: there are widgets, and only one of the two can say colour and opacity".into(),
            ));
        }
        if self.lights.is_some() && self.shade.is_none() {
            return Err(malformed("lights: nothing is lit without \"shade\"".into()));
        }
        let valid = |e: Error| match e {
            Error::Transfer(what) => malformed(what),
            other => other,
        };
        let mut bivariate = Bivariate::default();
        if let Some(widgets) = self.widgets {
            let widgets = widgets
                .into_iter()
                .enumerate()
                .map(|(i, w)| w.widget().map_err(|what| malformed(format!("widgets[{i}]: {what}"))));
            bivariate = bivariate.with_widgets(widgets.collect::<Result<_>>()?).map_err(valid)?;
        }
        if let Some(table) = self.table {
            bivariate = bivariate.with_table(table.table(path.parent().unwrap_or(Path::new("")))?);
        }
        if let Some(knots) = self.gradient_opacity {
            let knots = knots.into_iter().map(|[g, h]| (g, h)).collect();
            bivariate = bivariate.with_gradient_opacity(knots).map_err(valid)?;
        }
        let mut shading = Shading::default();
        if let Some(p) = self.silhouette {
            shading = shading.with_silhouette(p).map_err(valid)?;
        }
        if let Some(s) = self.shade {
            let shade = Shade {
                ambient: s.ambient,
                diffuse: s.diffuse,
                specular: s.specular,
                power: s.power,
                two_sided: s.two_sided.unwrap_or(true),
                highlight: s.highlight,
            };
            let lights = self.lights.map_or(Ok(vec![Light::default()]), |lights| {
                let light =
                    |(i, l): (usize, LightJson)| l.light().map_err(|what| malformed(format!("lights[{i}]: {what}")));
                lights.into_iter().enumerate().map(light).collect()
            });
            shading = shading.with_lights(shade, lights?).map_err(valid)?;
        }
        Ok((bivariate, shading))
    }
}
