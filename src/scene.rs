//! The scene file: one JSON object that says what to draw, and nothing about how.
//!
//! ```json
//! {
//!   "mesh": "ball.vtu", "scalars": {"name": "s", "association": "point"},
//!   "color": [[0, 0.2, 0.3, 0.8], [1, 0.9, 0.3, 0.1]], "opacity": [[0, 0], [1, 0.5]], "unit_distance": 0.1,
//!   "camera": {"position": [3, 2, 4], "focal_point": [0, 0, 0], "view_up": [0, 1, 0], "view_angle": 30},
//!   "size": [640, 480]
//! }
//! ```

use crate::error::{Error, Result};
use crate::field::{Association, Component, Field};
use crate::image::npy::Npy;
use crate::mesh::Mesh;
use crate::transfer::{Convention, Emission, TransferFunction};
use crate::view::{Blend, Camera, ClippingPlane, DepthBuffer, DepthKind, Projection, Ray, View};
use glam::{DVec2, DVec3};
use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// What to draw. The parts are public, so that a program can change one before it asks for the [`Scene::view`].
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// The mesh's file; relative to the working directory, not to the scene's file.
    pub mesh: PathBuf,
    /// The array that is drawn.
    pub scalars: Scalars,
    /// Colour and opacity.
    pub transfer: TransferFunction,
    /// The camera.
    pub camera: Camera,
    /// Width and height of the image, in pixels.
    pub size: [u32; 2],
    /// Where in a pixel its ray is, from the centre, in pixels (right, up).
    pub pixel_offset: DVec2,
    /// What is seen lies between two distances along the view, in world units.
    pub clipping_range: Option<[f64; 2]>,
    /// What all of them keep is seen.
    pub clipping_planes: Vec<ClippingPlane>,
    /// Opaque objects, at which rays end.
    pub opaque: Vec<Opaque>,
    /// A depth image, at which rays end.
    pub depth: Option<DepthImage>,
    /// How the values along a ray become a pixel.
    pub blend: Blend,
    /// What an 8-bit picture shows behind everything, in [0, 1].
    pub background: Option<[f64; 3]>,
    /// The name of an engine, for the program to choose.
    pub engine: Option<String>,
    /// A device, for the program to choose.
    pub device: Option<Value>,
    /// A form of the ray integral, for the program to choose.
    pub integral: Option<Value>,
    /// The projection engine's switches.
    pub projection: Option<Value>,
}

/// Which array of the mesh is drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Scalars {
    /// Its name.
    pub name: String,
    /// Whether it belongs to points or cells; without, points are searched first.
    pub association: Option<Association>,
    /// What of it; without, a vector's magnitude.
    pub component: Option<Component>,
}

impl Scalars {
    /// The field that these are in `mesh`.
    ///
    /// # Errors
    /// [`Error::Field`] if there is no such array or component, or nothing finite in it.
    pub fn field(&self, mesh: &Mesh) -> Result<Field> {
        let wanted = |a| self.association.is_none_or(|w| w == a);
        let points = mesh.point_arrays().iter().filter(|_| wanted(Association::Point));
        let cells = mesh.cell_arrays().iter().filter(|_| wanted(Association::Cell));
        let array = points.chain(cells).find(|a| a.name == self.name);
        let default = match array {
            Some(a) if a.components > 1 => Component::Magnitude,
            _ => Component::Index(0),
        };
        Field::new(mesh, &self.name, self.association, self.component.unwrap_or(default))
    }
}

/// An opaque object.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "lowercase", deny_unknown_fields)]
pub enum Opaque {
    /// An infinite plane.
    Plane {
        /// A point in it, in world coordinates.
        point: [f64; 3],
        /// Its normal, of any length but 0.
        normal: [f64; 3],
        /// Its colour, in [0, 1].
        #[serde(default = "white")]
        color: [f64; 3],
    },
    /// A sphere, seen from outside or inside.
    Sphere {
        /// Its centre, in world coordinates.
        center: [f64; 3],
        /// Its radius, in world units.
        radius: f64,
        /// Its colour, in [0, 1].
        #[serde(default = "white")]
        color: [f64; 3],
    },
}

impl Opaque {
    /// Where `ray` meets it first, and its colour.
    fn hit(&self, ray: &Ray) -> Option<(f64, [f64; 3])> {
        let (t, color) = match *self {
            Opaque::Plane { point, normal, color } => {
                let normal = DVec3::from(normal);
                ((DVec3::from(point) - ray.origin).dot(normal) / ray.direction.dot(normal), color)
            }
            Opaque::Sphere { center, radius, color } => {
                let to = DVec3::from(center) - ray.origin;
                let middle = to.dot(ray.direction);
                // The distance of the centre from the line, not its square's difference: that cancels far away.
                let across = (to - ray.direction * middle).length();
                let half = ((radius - across) * (radius + across)).sqrt();
                (if middle - half >= ray.t_min { middle - half } else { middle + half }, color)
            }
        };
        (t >= ray.t_min && t < ray.t_max).then_some((t, color))
    }
}

/// A depth buffer and its width and height in pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthImage {
    /// Width and height.
    pub size: [u32; 2],
    /// The depths.
    pub buffer: DepthBuffer,
}

/// The colour of what lies behind the volume, for each pixel, row by row from the top.
pub type Backdrop = Vec<[f32; 3]>;

impl Scene {
    /// Reads a scene, and its depth image if it has one; the mesh is not opened.
    ///
    /// # Errors
    /// [`Error::File`]; [`Error::Malformed`], which names the key; [`Error::Unsupported`] for bivariate widgets.
    pub fn open(path: &Path) -> Result<Self> {
        let text = std::fs::read(path).map_err(|e| Error::file(path, e))?;
        let mut json = serde_json::Deserializer::from_slice(&text);
        let file: File = serde_path_to_error::deserialize(&mut json).map_err(|e| {
            let key = e.path().to_string();
            let what = e.into_inner().to_string();
            Error::malformed(path, if key == "." { what } else { format!("{key}: {what}") })
        })?;
        json.end().map_err(|e| Error::malformed(path, format!("after the scene: {e}")))?;
        file.scene(path)
    }

    /// The view, and the backdrop of the picture if there are opaque objects.
    ///
    /// # Errors
    /// [`Error::View`] if camera, size, clipping or depth image cannot be used together.
    pub fn view(&self) -> Result<(View, Option<Backdrop>)> {
        let mut view = View::new(self.camera, self.size)?
            .with_pixel_offset(self.pixel_offset)
            .with_clipping_planes(self.clipping_planes.clone())?
            .with_blend(self.blend);
        if let Some(range) = self.clipping_range {
            view = view.with_clipping_range(range)?;
        }
        if let Some(DepthImage { size, buffer }) = &self.depth {
            if *size != self.size {
                let ([w, h], [x, y]) = (*size, self.size);
                return Err(Error::View(format!("the depth image has {w}x{h} pixels, the picture {x}x{y}")));
            }
            view = view.with_depth(buffer.clone())?;
        }
        if self.opaque.is_empty() {
            return Ok((view, None));
        }
        let behind = self.background.unwrap_or_default().map(|c| c as f32);
        let [w, h] = self.size;
        let (mut values, mut backdrop) = (Vec::new(), Vec::new());
        for (j, i) in (0..h).flat_map(|j| (0..w).map(move |i| (j, i))) {
            let mut ray = view.ray(i, j);
            let mut color = behind;
            for object in &self.opaque {
                if let Some((t, c)) = object.hit(&ray) {
                    ray.t_max = t;
                    color = c.map(|c| c as f32);
                }
            }
            values.push(ray.t_max);
            backdrop.push(color);
        }
        Ok((view.with_depth(DepthBuffer { kind: DepthKind::Ray, values })?, Some(backdrop)))
    }
}

fn white() -> [f64; 3] {
    [1.0; 3]
}

/// The file as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
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

impl File {
    fn scene(self, path: &Path) -> Result<Scene> {
        let malformed = |what: &str| Error::malformed(path, what);
        if self.widgets.is_some() {
            let what = "widgets: bivariate transfer functions are not drawn yet; use color and opacity";
            return Err(Error::unsupported(path, what));
        }
        let (color, opacity) = match (self.color, self.opacity) {
            (Some(c), Some(o)) => (c, o),
            (Some(_), None) => return Err(malformed("there is color but no opacity")),
            (None, Some(_)) => return Err(malformed("there is opacity but no color")),
            (None, None) => return Err(malformed("there is neither color nor opacity")),
        };
        let emission = match (self.emission, self.emission_scale) {
            (EmissionJson::Direct, scale) => Emission::Direct { scale: scale.unwrap_or(1.0) },
            (EmissionJson::Chromatic, None) => Emission::Chromatic,
            (EmissionJson::Chromatic, Some(_)) => {
                return Err(malformed("emission_scale: only \"emission\": \"direct\" has a scale"));
            }
        };
        let projection = match (self.camera.projection, self.camera.view_angle, self.camera.parallel_scale) {
            (ProjectionJson::Perspective, angle, _) => Projection::Perspective { view_angle: angle.unwrap_or(30.0) },
            (ProjectionJson::Parallel, _, Some(parallel_scale)) => Projection::Parallel { parallel_scale },
            (ProjectionJson::Parallel, _, None) => {
                return Err(malformed(
                    "camera: a parallel projection needs parallel_scale, half the height of the view",
                ));
            }
        };
        if let Some(c) = self.background.filter(|c| !c.iter().all(|v| (0.0..=1.0).contains(v))) {
            return Err(malformed(&format!("background: {c:?} is not in 0 to 1")));
        }
        for (i, object) in self.opaque.iter().enumerate() {
            let wrong = match *object {
                Opaque::Plane { normal, .. } if normal == [0.0; 3] => Some("the normal is zero"),
                Opaque::Sphere { radius, .. } if radius <= 0.0 => Some("the radius is not above 0"),
                _ => None,
            };
            if let Some(wrong) = wrong {
                return Err(malformed(&format!("opaque[{i}]: {wrong}")));
            }
        }
        let folder = path.parent().unwrap_or(Path::new(""));
        let depth = match &self.depth {
            Some(d) => Some(depth_image(&folder.join(&d.file), &d.kind)?),
            None => None,
        };
        let scene = Scene {
            mesh: folder.join(&self.mesh),
            scalars: Scalars {
                name: self.scalars.name,
                association: self.scalars.association.map(|a| match a {
                    AssociationJson::Point => Association::Point,
                    AssociationJson::Cell => Association::Cell,
                }),
                component: self.scalars.component.map(|c| match c {
                    ComponentJson::Index(i) => Component::Index(i),
                    ComponentJson::Name(ComponentName::Magnitude) => Component::Magnitude,
                }),
            },
            transfer: TransferFunction::new(
                color.into_iter().map(|[s, r, g, b]| (s, [r, g, b])).collect(),
                opacity.into_iter().map(|[s, a]| (s, a)).collect(),
                self.unit_distance,
            )
            .and_then(|t| t.with_emission(emission))
            .map_err(|e| malformed(&e.to_string()))?
            .with_clamp(self.clamp.unwrap_or(true))
            .with_convention(match self.convention {
                ConventionJson::Extinction => Convention::Extinction,
                ConventionJson::Opacity => Convention::Opacity,
            }),
            camera: Camera {
                position: self.camera.position.into(),
                focal_point: self.camera.focal_point.into(),
                view_up: self.camera.view_up.into(),
                projection,
            },
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
            .map_err(|e| malformed(&e.to_string()))?;
        Ok(scene)
    }
}

/// Reads a depth image: an array (h, w), row 0 at the top.
fn depth_image(path: &Path, kind: &DepthKindJson) -> Result<DepthImage> {
    let Npy { shape, values } = Npy::open(path)?;
    let size = match shape[..] {
        [h, w] => u32::try_from(w).ok().zip(u32::try_from(h).ok()),
        _ => None,
    };
    let Some((w, h)) = size else {
        return Err(Error::malformed(path, format!("an array of shape {shape:?} is no (height, width) depth image")));
    };
    let kind = match kind {
        DepthKindJson::Gl => DepthKind::Window,
        DepthKindJson::Eye => DepthKind::Eye,
        DepthKindJson::Ray => DepthKind::Ray,
    };
    Ok(DepthImage { size: [w, h], buffer: DepthBuffer { kind, values } })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = r#"{
        "mesh": "sub/ball.vtu", "scalars": {"name": "s", "component": 1, "association": "cell"},
        "color": [[0, 0.2, 0.3, 0.8], [1, 0.9, 0.3, 0.1]], "opacity": [[0, 0], [1, 0.5]], "unit_distance": 0.1,
        "camera": {"position": [0, 0, 10], "focal_point": [0, 0, 0], "view_up": [0, 1, 0]},
        "size": [3, 5]
    }"#;

    /// [`SCENE`] with `from` replaced by `to`.
    fn open(from: &str, to: &str) -> Result<Scene> {
        assert!(SCENE.contains(from), "{from}");
        let dir = tempfile::tempdir().unwrap();
        let depths = (0..15).flat_map(|i| (i as f32).to_le_bytes());
        let header = b"\x93NUMPY\x01\x00\x76\x00{'descr': '<f4', 'fortran_order': False, 'shape': (5, 3), }";
        let mut npy = header.to_vec();
        npy.resize(127, b' ');
        npy.push(b'\n');
        npy.extend(depths);
        std::fs::write(dir.path().join("depth.npy"), npy).unwrap();
        let path = dir.path().join("scene.json");
        std::fs::write(&path, SCENE.replace(from, to)).unwrap();
        let scene = Scene::open(&path)?;
        assert_eq!(scene.mesh, dir.path().join("sub/ball.vtu"));
        Ok(scene)
    }

    /// [`SCENE`] with more keys.
    fn with(keys: &str) -> Result<Scene> {
        open("\"mesh\"", &format!("{keys}, \"mesh\""))
    }

    #[test]
    fn defaults() {
        let scene = open("", "").unwrap();
        let component = Some(Component::Index(1));
        let scalars = Scalars { name: "s".into(), association: Some(Association::Cell), component };
        assert_eq!(scene.scalars, scalars);
        assert_eq!(scene.camera.projection, Projection::Perspective { view_angle: 30.0 });
        assert_eq!((scene.transfer.convention(), scene.transfer.emission()), Default::default());
        assert!(scene.transfer.clamp());
        let (view, backdrop) = scene.view().unwrap();
        assert_eq!((view.size(), view.blend(), backdrop), ([3, 5], Blend::Composite, None));
        assert_eq!(view.ray(1, 2).t_max, f64::INFINITY);
    }

    #[test]
    fn every_key_is_known() {
        let scene = with(
            r#""cells": "tets", "clamp": false, "convention": "opacity", "emission": "direct", "emission_scale": 0.3,
            "gradient_array": "g", "pixel_offset": [0.1, 0.2], "clipping_range": [0.5, 50], "blend": "maximum",
            "clipping_planes": [{"origin": [0, 0, 1], "normal": [0, 0, -1]}], "background": [0, 0.5, 1], "tol": 1e-9,
            "truth_of": "x", "engine": "traverse", "device": "cpu", "integral": {"kind": "exact"}, "projection": {},
            "depth": {"file": "depth.npy", "kind": "ray"}, "opaque": []"#,
        )
        .unwrap();
        assert_eq!(scene.transfer.emission(), Emission::Direct { scale: 0.3 });
        assert_eq!(scene.transfer.convention(), Convention::Opacity);
        assert!(!scene.transfer.clamp());
        assert_eq!(scene.engine.as_deref(), Some("traverse"));
        let (view, _) = scene.view().unwrap();
        assert_eq!(view.blend(), Blend::Maximum);
        let ray = view.ray(2, 4);
        assert_eq!(ray.t_max, 14.0);
        assert!((ray.t_min * -ray.direction.z - 9.0).abs() < 1e-12);
        let parallel =
            open("\"camera\": {", "\"camera\": {\"projection\": \"parallel\", \"parallel_scale\": 2, ").unwrap();
        assert_eq!(parallel.camera.projection, Projection::Parallel { parallel_scale: 2.0 });
    }

    #[test]
    fn opaque_objects_end_rays() {
        let scene = with(
            r#""background": [0.5, 0.5, 0.5], "depth": {"file": "depth.npy", "kind": "eye"}, "opaque": [
            {"type": "plane", "point": [0, 0, -2], "normal": [0, 0, 3], "color": [0, 0, 1]},
            {"type": "sphere", "center": [0, 0, 0], "radius": 1, "color": [1, 0, 0]}]"#,
        )
        .unwrap();
        let (view, backdrop) = scene.view().unwrap();
        let (mut sphere, backdrop) = (scene.clone(), backdrop.unwrap());
        // Depth 7, before the sphere; 14, behind the plane at 12.
        assert_eq!((view.ray(1, 2).t_max, backdrop[7]), (7.0, [0.5; 3]));
        let ray = view.ray(2, 4);
        assert!((ray.t_max * -ray.direction.z - 12.0).abs() < 1e-12);
        assert_eq!(backdrop[14], [0.0, 0.0, 1.0]);
        sphere.depth = None;
        let (view, backdrop) = sphere.view().unwrap();
        assert!((view.ray(1, 2).t_max - 9.0).abs() < 1e-12);
        assert_eq!(backdrop.unwrap()[7], [1.0, 0.0, 0.0]);
        // From inside, its far side.
        sphere.camera.position.z = 0.5;
        assert!((sphere.view().unwrap().0.ray(1, 2).t_max - 1.5).abs() < 1e-12);
    }

    #[test]
    fn mistakes_are_named() {
        for (from, to, parts) in [
            ("\"mesh\"", "\"mash\"", vec!["mash", "unknown field", "`mesh`"]),
            ("\"view_up\"", "\"up\"", vec!["camera", "unknown field `up`"]),
            ("[1, 0.9, 0.3, 0.1]", "[1, 0.9, 0.3]", vec!["color[1]", "length 3"]),
            ("[1, 0.9, 0.3, 0.1]", "[1, 0.9, 0.3, 0.1, 1]", vec!["color[1]"]),
            ("\"s\"", "7", vec!["scalars.name", "7"]),
            ("\"component\": 1", "\"component\": \"x\"", vec!["scalars.component", "magnitude"]),
            ("\"cell\"", "\"edge\"", vec!["scalars.association", "edge", "point"]),
            (", \"opacity\": [[0, 0], [1, 0.5]]", "", vec!["color but no opacity"]),
            ("\"color\": [[0, 0.2, 0.3, 0.8], [1, 0.9, 0.3, 0.1]],", "", vec!["opacity but no color"]),
            ("\"unit_distance\": 0.1,", "", vec!["missing field `unit_distance`"]),
            ("\"unit_distance\": 0.1", "\"unit_distance\": 0", vec!["unit distance"]),
            ("[[0, 0], [1, 0.5]]", "[[1, 0], [0, 0.5]]", vec!["ascend"]),
            ("[3, 5]", "[0, 5]", vec!["0x5"]),
            ("[3, 5]", "[3.5, 5]", vec!["size"]),
            ("\"view_up\": [0, 1, 0]", "\"view_up\": [0, 0, 1]", vec!["view up"]),
            ("\"size\"", "\"engine\": 1, \"size\"", vec!["engine"]),
            ("\"size\"", "\"emission_scale\": 1, \"size\"", vec!["emission_scale"]),
            ("\"size\"", "\"background\": [0, 0, 255], \"size\"", vec!["background", "255"]),
            ("\"size\"", "\"clipping_range\": [0, 1], \"size\"", vec!["clipping range"]),
            ("\"size\"", "\"depth\": {\"file\": \"no.npy\"}, \"size\"", vec!["no.npy"]),
            ("\"size\"", "\"opaque\": [{\"type\": \"cone\"}], \"size\"", vec!["opaque[0]", "cone"]),
            ("\"size\"", "\"opaque\": [{\"type\": \"sphere\", \"radius\": 1}], \"size\"", vec!["opaque[0]", "center"]),
            ("[3, 5]\n    }", "[3, 5]\n    } x", vec!["after the scene"]),
            ("[3, 5]\n    }", "[3, 5]", vec!["EOF"]),
        ] {
            let message = open(from, to).unwrap_err().to_string();
            assert!(parts.iter().all(|p| message.contains(p)), "{parts:?}: {message}");
        }
        let widgets = with(r#""widgets": [{"type": "uniform"}]"#).unwrap_err();
        assert!(matches!(&widgets, Error::Unsupported { what, .. } if what.contains("widgets")), "{widgets}");
        let mut scene = with(r#""depth": {"file": "depth.npy", "kind": "ray"}"#).unwrap();
        scene.size = [5, 3];
        assert!(scene.view().unwrap_err().to_string().contains("3x5"));
    }
}
