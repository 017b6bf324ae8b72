//! A scene as its file has it: what may be written, and what is wrong with what was.

use super::{DepthImage, Opaque, Scalars, Scene};
use crate::error::{Error, Result};
use crate::field::{Association, Component};
use crate::image::npy::Npy;
use crate::transfer::{Convention, Emission, TransferFunction};
use crate::view::{Blend, Camera, ClippingPlane, DepthBuffer, DepthKind, Projection, View};
use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// The file as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    mesh: PathBuf,
    scalars: ScalarsJson,
    #[serde(default, rename = "cells")]
    _cells: CellsJson,
    color: Option<Vec<[f64; 4]>>,
    opacity: Option<Vec<[f64; 2]>>,
    clamp: Option<bool>,
    unit_distance: f64,
    #[serde(default)]
    convention: ConventionJson,
    #[serde(default)]
    emission: EmissionJson,
    emission_scale: Option<f64>,
    widgets: Option<IgnoredAny>,
    camera: CameraJson,
    size: [u32; 2],
    #[serde(default)]
    pixel_offset: [f64; 2],
    clipping_range: Option<[f64; 2]>,
    #[serde(default)]
    clipping_planes: Vec<PlaneJson>,
    #[serde(default)]
    opaque: Vec<Opaque>,
    depth: Option<DepthJson>,
    #[serde(default)]
    blend: BlendJson,
    background: Option<[f64; 3]>,
    engine: Option<String>,
    device: Option<Value>,
    integral: Option<Value>,
    projection: Option<Value>,
    #[serde(rename = "gradient_array")]
    _gradient_array: Option<IgnoredAny>,
    #[serde(rename = "tol")]
    _tol: Option<IgnoredAny>,
    #[serde(rename = "truth_of")]
    _truth_of: Option<IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ScalarsJson {
    name: String,
    association: Option<AssociationJson>,
    component: Option<ComponentJson>,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum AssociationJson {
    Point,
    Cell,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "the component is an index from 0, or \"magnitude\"")]
enum ComponentJson {
    Index(usize),
    Name(ComponentName),
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum ComponentName {
    Magnitude,
}

/// Both are drawn split: curved cells are not drawn as such yet.
#[derive(Deserialize, Default)]
#[serde(rename_all = "lowercase")]
enum CellsJson {
    #[default]
    True,
    Tets,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "lowercase")]
enum ConventionJson {
    #[default]
    Extinction,
    Opacity,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "lowercase")]
enum EmissionJson {
    #[default]
    Chromatic,
    Direct,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "lowercase")]
enum BlendJson {
    #[default]
    Composite,
    Maximum,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraJson {
    #[serde(default)]
    projection: ProjectionJson,
    position: [f64; 3],
    focal_point: [f64; 3],
    view_up: [f64; 3],
    view_angle: Option<f64>,
    parallel_scale: Option<f64>,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "lowercase")]
enum ProjectionJson {
    #[default]
    Perspective,
    Parallel,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlaneJson {
    origin: [f64; 3],
    normal: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DepthJson {
    file: PathBuf,
    #[serde(default)]
    kind: DepthKindJson,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "lowercase")]
enum DepthKindJson {
    #[default]
    Gl,
    Eye,
    Ray,
}

/// Refuses lists where an object is meant, of which serde would take the items for its keys in sequence, and null,
/// which it would take for a key that is not there.
pub(super) fn check(scene: &Value) -> Result<(), String> {
    let Value::Object(keys) = scene else { return Err("a scene is an object".into()) };
    let object = |at: &str, value: &Value| {
        if value.is_object() { Ok(()) } else { Err(format!("{at}: an object is meant, and not {}", kind(value))) }
    };
    for (key, value) in keys {
        // What is for others may be anything.
        if !["widgets", "gradient_array", "tol", "truth_of"].contains(&key.as_str()) {
            refuse_null(key, value)?;
        }
        match (key.as_str(), value) {
            ("scalars" | "camera" | "depth" | "projection", _) => object(key, value)?,
            ("integral", Value::String(_)) => {}
            ("integral", _) => object(key, value).map_err(|e| e + "; or the name of a form")?,
            ("clipping_planes" | "opaque", Value::Array(items)) => {
                for (i, item) in items.iter().enumerate() {
                    object(&format!("{key}[{i}]"), item)?;
                }
            }
            _ => {}
        }
    }
    Ok(())
}

fn refuse_null(at: &str, value: &Value) -> Result<(), String> {
    match value {
        Value::Null => Err(format!("{at}: null says nothing; leave the key out")),
        Value::Array(items) => items.iter().enumerate().try_for_each(|(i, v)| refuse_null(&format!("{at}[{i}]"), v)),
        Value::Object(keys) => keys.iter().try_for_each(|(k, v)| refuse_null(&format!("{at}.{k}"), v)),
        _ => Ok(()),
    }
}

fn kind(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "true or false",
        Value::Number(_) => "a number",
        Value::String(_) => "a text",
        Value::Array(_) => "a list",
        Value::Object(_) => "an object",
    }
}

impl File {
    /// Makes sense of it; files that it names are relative to the folder of `path`.
    pub(super) fn scene(mut self, path: &Path) -> Result<Scene> {
        let malformed = |what: String| Error::malformed(path, what);
        if self.widgets.is_some() {
            let what = "widgets: bivariate transfer functions are not drawn yet; use color and opacity";
            return Err(Error::unsupported(path, what));
        }
        let transfer = self.transfer().map_err(malformed)?;
        let camera = self.camera.camera().map_err(malformed)?;
        if let Some(c) = self.background.filter(|c| !c.iter().all(|v| (0.0..=1.0).contains(v))) {
            return Err(malformed(format!("background: {c:?} is not in 0 to 1")));
        }
        for (i, object) in self.opaque.iter().enumerate() {
            object.check().map_err(|what| malformed(format!("opaque[{i}]: {what}")))?;
        }
        let folder = path.parent().unwrap_or(Path::new(""));
        let depth = self.depth.map(|depth| depth.image(folder)).transpose()?;
        let scene = Scene {
            mesh: folder.join(&self.mesh),
            scalars: self.scalars.into(),
            transfer,
            camera,
            size: self.size,
            pixel_offset: self.pixel_offset.into(),
            clipping_range: self.clipping_range,
            clipping_planes: self
                .clipping_planes
                .into_iter()
                .map(|p| ClippingPlane { origin: p.origin.into(), normal: p.normal.into() })
                .collect(),
            opaque: self.opaque,
            depth,
            blend: match self.blend {
                BlendJson::Composite => Blend::Composite,
                BlendJson::Maximum => Blend::Maximum,
            },
            background: self.background,
            engine: self.engine,
            device: self.device,
            integral: self.integral,
            projection: self.projection,
        };
        // Whatever is wrong with the view is the file's mistake, and is best said before the mesh is read.
        View::new(scene.camera, scene.size)
            .and_then(|v| v.with_clipping_planes(scene.clipping_planes.clone()))
            .and_then(|v| scene.clipping_range.map_or(Ok(v.clone()), |r| v.with_clipping_range(r)))
            .map_err(|e| malformed(e.to_string()))?;
        Ok(scene)
    }

    /// Takes the transfer function, or says what is wrong with it.
    fn transfer(&mut self) -> Result<TransferFunction, String> {
        let (color, opacity) = match (self.color.take(), self.opacity.take()) {
            (Some(c), Some(o)) => (c, o),
            (Some(_), None) => return Err("there is color but no opacity".into()),
            (None, Some(_)) => return Err("there is opacity but no color".into()),
            (None, None) => return Err("there is neither color nor opacity".into()),
        };
        let emission = match (&self.emission, self.emission_scale) {
            (EmissionJson::Direct, scale) => Emission::Direct { scale: scale.unwrap_or(1.0) },
            (EmissionJson::Chromatic, None) => Emission::Chromatic,
            (EmissionJson::Chromatic, Some(_)) => {
                return Err("emission_scale: only \"emission\": \"direct\" has a scale".into());
            }
        };
        let convention = match self.convention {
            ConventionJson::Extinction => Convention::Extinction,
            ConventionJson::Opacity => Convention::Opacity,
        };
        let color = color.into_iter().map(|[s, r, g, b]| (s, [r, g, b])).collect();
        let opacity = opacity.into_iter().map(|[s, a]| (s, a)).collect();
        let transfer =
            TransferFunction::new(color, opacity, self.unit_distance).and_then(|t| t.with_emission(emission));
        Ok(transfer.map_err(|e| e.to_string())?.with_clamp(self.clamp.unwrap_or(true)).with_convention(convention))
    }
}

impl From<ScalarsJson> for Scalars {
    fn from(scalars: ScalarsJson) -> Self {
        Scalars {
            name: scalars.name,
            association: scalars.association.map(|a| match a {
                AssociationJson::Point => Association::Point,
                AssociationJson::Cell => Association::Cell,
            }),
            component: scalars.component.map(|c| match c {
                ComponentJson::Index(i) => Component::Index(i),
                ComponentJson::Name(ComponentName::Magnitude) => Component::Magnitude,
            }),
        }
    }
}

impl CameraJson {
    /// The camera, or what is wrong with it.
    fn camera(&self) -> Result<Camera, String> {
        let projection = match (&self.projection, self.view_angle, self.parallel_scale) {
            (ProjectionJson::Perspective, angle, _) => Projection::Perspective { view_angle: angle.unwrap_or(30.0) },
            (ProjectionJson::Parallel, _, Some(parallel_scale)) => Projection::Parallel { parallel_scale },
            (ProjectionJson::Parallel, _, None) => {
                return Err("camera: a parallel projection needs parallel_scale, half the height of the view".into());
            }
        };
        Ok(Camera {
            position: self.position.into(),
            focal_point: self.focal_point.into(),
            view_up: self.view_up.into(),
            projection,
        })
    }
}

impl DepthJson {
    /// Reads the image: an array (h, w), row 0 at the top.
    fn image(&self, folder: &Path) -> Result<DepthImage> {
        let path = folder.join(&self.file);
        let Npy { shape, values } = Npy::open(&path)?;
        let size = match shape[..] {
            [h, w] => u32::try_from(w).ok().zip(u32::try_from(h).ok()),
            _ => None,
        };
        let Some((w, h)) = size else {
            let what = format!("an array of shape {shape:?} is no (height, width) depth image");
            return Err(Error::malformed(&path, what));
        };
        let kind = match self.kind {
            DepthKindJson::Gl => DepthKind::Window,
            DepthKindJson::Eye => DepthKind::Eye,
            DepthKindJson::Ray => DepthKind::Ray,
        };
        Ok(DepthImage { size: [w, h], buffer: DepthBuffer { kind, values } })
    }
}
