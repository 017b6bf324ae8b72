//! A scene as its file has it: what may be written, and what is wrong with what was.

use super::reader::kind;
use super::regions::{CroppingJson, SamplingJson, reconstruction};
use super::second::{LightJson, Second, ShadeJson, TableJson, WidgetJson};
use super::{DepthImage, Opaque, Scalars, Scene, integral, read};
use crate::engine::Engine;
use crate::error::{Error, Result};
use crate::field::{Association, Component};
use crate::gpu::DeviceChoice;
use crate::image::npy::Npy;
use crate::integral::IntegrationOptions;
use crate::project::ProjectionOptions;
use crate::transfer::bivariate::{Bivariate, Source};
use crate::transfer::{Convention, Emission, TransferFunction};
use crate::view::{Blend, Camera, ClippingPlane, DepthBuffer, DepthKind, Projection, View};
use serde::de::{IgnoredAny, Visitor};
use serde::{Deserialize, Deserializer};
use serde_json::Value;
use std::fmt::{self, Formatter};
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
    widgets: Option<Vec<WidgetJson>>,
    table2d: Option<TableJson>,
    gradient_array: Option<String>,
    gradient_opacity: Option<Vec<[f64; 2]>>,
    silhouette: Option<f64>,
    shade: Option<ShadeJson>,
    lights: Option<Vec<LightJson>>,
    camera: CameraJson,
    size: [u32; 2],
    #[serde(default)]
    pixel_offset: [f64; 2],
    clipping_range: Option<[f64; 2]>,
    #[serde(default)]
    clipping_planes: Vec<PlaneJson>,
    cropping: Option<CroppingJson>,
    #[serde(default)]
    opaque: Vec<Opaque>,
    depth: Option<DepthJson>,
    #[serde(default)]
    blend: BlendJson,
    background: Option<[f64; 3]>,
    engine: Option<Engine>,
    device: Option<Value>,
    integral: Option<Value>,
    reconstruction: Option<String>,
    sampling: Option<SamplingJson>,
    projection: Option<Value>,
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

enum ComponentJson {
    Index(usize),
    Magnitude,
}

impl<'de> Deserialize<'de> for ComponentJson {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Either;
        impl Visitor<'_> for Either {
            type Value = ComponentJson;

            fn expecting(&self, f: &mut Formatter) -> fmt::Result {
                f.write_str("an index from 0, or \"magnitude\",")
            }

            fn visit_u64<E: serde::de::Error>(self, index: u64) -> Result<ComponentJson, E> {
                usize::try_from(index).map(ComponentJson::Index).map_err(E::custom)
            }

            fn visit_str<E: serde::de::Error>(self, name: &str) -> Result<ComponentJson, E> {
                match name {
                    "magnitude" => Ok(ComponentJson::Magnitude),
                    _ => Err(E::invalid_value(serde::de::Unexpected::Str(name), &self)),
                }
            }
        }
        from.deserialize_any(Either)
    }
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

/// Refuses colours with a component beyond 0 to 1.
fn check_color(at: &str, color: &[f64]) -> Result<(), String> {
    match color.iter().find(|c| !(0.0..=1.0).contains(*c)) {
        Some(c) => Err(format!("{at}: red, green and blue are 0 to 1, and one is {c}")),
        None => Ok(()),
    }
}

/// Refuses a text that is empty, or of blanks.
fn check_name(at: &str, name: &str) -> Result<(), String> {
    if name.trim().is_empty() { Err(format!("{at}: the name is empty")) } else { Ok(()) }
}

/// A device by its name, or by its index.
fn device(value: &Value) -> Result<DeviceChoice, String> {
    match value {
        Value::String(name) if name.trim().is_empty() => Err("the name is empty".into()),
        Value::String(name) => Ok(DeviceChoice::parse(name)),
        Value::Number(index) if index.is_u64() => Ok(DeviceChoice::parse(&index.to_string())),
        other => Err(format!("the name or the index of a device is meant, and not {}", kind(other))),
    }
}

impl File {
    /// Makes sense of it; files that it names are relative to the folder of `path`.
    pub(super) fn scene(mut self, path: &Path) -> Result<Scene> {
        let malformed = |what: String| Error::malformed(path, what);
        let of = |key: &'static str| move |what: String| Error::malformed(path, format!("{key}: {what}"));
        self.check().map_err(malformed)?;
        let second = Second {
            widgets: self.widgets.take(),
            table: self.table2d.take(),
            gradient_opacity: self.gradient_opacity.take(),
            silhouette: self.silhouette,
            shade: self.shade.take(),
            lights: self.lights.take(),
            maximum: matches!(self.blend, BlendJson::Maximum),
        };
        let (bivariate, shading) = second.read(path)?;
        let transfer = self.transfer(bivariate).map_err(malformed)?.with_shading(shading);
        let camera = self.camera.camera().map_err(malformed)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let depth = self.depth.map(|depth| depth.image(folder)).transpose()?;
        let scene = Scene {
            mesh: folder.join(&self.mesh),
            scalars: self.scalars.into(),
            gradient_array: self.gradient_array,
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
            cropping: self.cropping.map(|c| c.cropping()).transpose().map_err(malformed)?,
            opaque: self.opaque,
            depth,
            blend: match self.blend {
                BlendJson::Composite => Blend::Composite,
                BlendJson::Maximum => Blend::Maximum,
            },
            background: self.background,
            engine: self.engine,
            device: self.device.as_ref().map_or(Ok(DeviceChoice::Auto), device).map_err(of("device"))?,
            integral: self
                .integral
                .as_ref()
                .map_or(Ok(IntegrationOptions::default()), integral)
                .map_err(of("integral"))?,
            reconstruction: reconstruction(self.reconstruction.as_deref(), self.sampling.as_ref())
                .map_err(malformed)?,
            projection: self
                .projection
                .as_ref()
                .map_or(Ok(ProjectionOptions::default()), read)
                .map_err(of("projection"))?,
        };
        // Whatever is wrong with the view is the file's mistake, and is best said before the mesh is read.
        View::new(scene.camera, scene.size)
            .and_then(|v| v.with_clipping_planes(scene.clipping_planes.clone()))
            .and_then(|v| scene.clipping_range.map_or(Ok(v.clone()), |r| v.with_clipping_range(r)))
            .map_err(|e| malformed(e.to_string()))?;
        Ok(scene)
    }

    /// Says what is wrong with names, colours and the like, if anything.
    fn check(&self) -> Result<(), String> {
        check_name("mesh", &self.mesh.to_string_lossy())?;
        check_name("scalars.name", &self.scalars.name)?;
        if let Some(name) = &self.gradient_array {
            check_name("gradient_array", name)?;
        }
        if let Some(table) = &self.table2d {
            check_name("table2d.file", &table.file.to_string_lossy())?;
        }
        if let Some(depth) = &self.depth {
            check_name("depth.file", &depth.file.to_string_lossy())?;
        }
        for (i, knot) in self.color.iter().flatten().enumerate() {
            check_color(&format!("color[{i}]"), &knot[1..])?;
        }
        if let Some(color) = &self.background {
            check_color("background", color)?;
        }
        for (i, object) in self.opaque.iter().enumerate() {
            check_color(&format!("opaque[{i}].color"), object.color())?;
        }
        Ok(())
    }

    /// Takes the transfer function, or says what is wrong with it.
    fn transfer(&mut self, bivariate: Bivariate) -> Result<TransferFunction, String> {
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
        let knots = |color: Vec<[f64; 4]>, opacity: Vec<[f64; 2]>| {
            let color = color.into_iter().map(|[s, r, g, b]| (s, [r, g, b])).collect();
            (color, opacity.into_iter().map(|[s, a]| (s, a)).collect())
        };
        let replaced = *bivariate.source() != Source::Scalar;
        let transfer = match (self.color.take(), self.opacity.take()) {
            (None, None) if replaced => TransferFunction::of_two(bivariate, self.unit_distance),
            (Some(c), Some(o)) => {
                let (color, opacity) = knots(c, o);
                TransferFunction::new(color, opacity, self.unit_distance).map(|t| t.with_bivariate(bivariate))
            }
            (Some(_), None) => return Err("there is color but no opacity".into()),
            (None, Some(_)) => return Err("there is opacity but no color".into()),
            (None, None) => return Err("there is neither color nor opacity".into()),
        };
        let transfer = transfer.and_then(|t| t.with_emission(emission)).map_err(|e| e.to_string())?;
        Ok(transfer.with_clamp(self.clamp.unwrap_or(true)).with_convention(convention))
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
                ComponentJson::Magnitude => Component::Magnitude,
            }),
        }
    }
}

impl CameraJson {
    /// The camera, or what is wrong with it.
    fn camera(&self) -> Result<Camera, String> {
        if let Some(angle) = self.view_angle.filter(|a| !(*a > 0.0 && *a < 180.0)) {
            return Err(format!("camera.view_angle: {angle} degrees are not between 0 and 180"));
        }
        if let Some(scale) = self.parallel_scale.filter(|s| *s <= 0.0) {
            return Err(format!("camera.parallel_scale: {scale} is no half height of a view, which is above 0"));
        }
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
