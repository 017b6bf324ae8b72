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

pub mod automatic;
mod file;
pub mod missing;
mod opaque;
mod reader;
mod regions;
mod second;

pub use opaque::Opaque;
pub use reader::read;
pub use regions::regions;
pub use second::{look, widget};

use crate::cast::Reconstruction;
use crate::engine::Engine;
use crate::error::{Error, Result};
use crate::field::{Association, Component, Field};
use crate::gpu::DeviceChoice;
use crate::grid::Grid;
use crate::integral::IntegrationOptions;
use crate::memory;
use crate::mesh::{Array, Arrays};
use crate::project::ProjectionOptions;
use crate::transfer::TransferFunction;
use crate::view::{Blend, Camera, ClippingPlane, Cropping, DepthBuffer, DepthKind, View};
use glam::DVec2;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// What to draw. The parts are public, so that a program can change one before it asks for the [`Scene::view`].
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// The mesh's file; relative to the working directory, not to the scene's file.
    pub mesh: PathBuf,
    /// The array that is drawn.
    pub scalars: Scalars,
    /// The array that is the second variable, of points or cells as the first; without, the gradient's length.
    pub gradient_array: Option<String>,
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
    /// Some regions alone are seen.
    pub cropping: Option<Cropping>,
    /// Opaque objects, at which rays end.
    pub opaque: Vec<Opaque>,
    /// A depth image, at which rays end.
    pub depth: Option<DepthImage>,
    /// How the values along a ray become a pixel.
    pub blend: Blend,
    /// What an 8-bit picture shows behind everything, in [0, 1].
    pub background: Option<[f64; 3]>,
    /// How it is drawn, unless the program chooses.
    pub engine: Option<Engine>,
    /// Where it is drawn.
    pub device: DeviceChoice,
    /// How segments of rays are integrated.
    pub integral: IntegrationOptions,
    /// How fields of regular and rectilinear grids are rebuilt along rays.
    pub reconstruction: Option<Reconstruction>,
    /// The projection engine's options.
    pub projection: ProjectionOptions,
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
    /// The field that these are in `mesh`, or in a grid.
    ///
    /// # Errors
    /// [`Error::Field`] if there is no such array or component, or nothing finite in it.
    pub fn field(&self, mesh: &impl Arrays) -> Result<Field> {
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

    /// The same of a grid, with its second variable as [`Self::field_with`] has it. An array of single values moves to the field:
    /// the grid has it no more.
    ///
    /// # Errors
    /// As [`Self::field_with`].
    pub fn taken_of(&self, grid: &mut Grid, second: Option<&str>) -> Result<Field> {
        let second = second.map(|name| {
            let association = self.field(grid).ok().map(|field| field.association());
            Scalars { name: name.to_owned(), association, component: None }.field(grid)
        });
        let wanted = |a| self.association.is_none_or(|w| w == a);
        let is_one = |a: &Array| a.name == self.name && a.components == 1;
        let of_points = wanted(Association::Point) && grid.point_arrays().iter().any(|a| a.name == self.name);
        let arrays = if of_points { grid.point_arrays() } else { grid.cell_arrays() };
        let association = if of_points { Association::Point } else { Association::Cell };
        // Of several components, as of none, what is said of all fields.
        let plain = matches!(self.component, None | Some(Component::Index(0) | Component::All));
        if !(wanted(association) && plain && arrays.iter().any(is_one)) {
            return match second {
                Some(second) => self.field(grid)?.with_second(second?),
                None => self.field(grid),
            };
        }
        let array = grid.take_array(&self.name, !of_points);
        let array = array.ok_or_else(|| Error::Field(format!("there is no array \"{}\"", self.name)))?;
        let field = Field::taking(array, association, Component::Index(0))?;
        match second {
            Some(second) => field.with_second(second?),
            None => Ok(field),
        }
    }

    /// The same, with the array called `second`, or the magnitude of its vectors, as second variable.
    ///
    /// # Errors
    /// Likewise, and those of [`Field::with_second`].
    pub fn field_with(&self, mesh: &impl Arrays, second: Option<&str>) -> Result<Field> {
        let field = self.field(mesh)?;
        let Some(name) = second else { return Ok(field) };
        let association = Some(field.association());
        let second = Scalars { name: name.to_owned(), association, component: None }.field(mesh)?;
        field.with_second(second)
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
    /// The field that the scene draws of `mesh`, with its second variable if an array is named for that.
    ///
    /// # Errors
    /// Those of [`Scalars::field`] and [`Field::with_second`].
    pub fn field(&self, mesh: &impl Arrays) -> Result<Field> {
        self.scalars.field_with(mesh, self.gradient_array.as_deref())
    }

    /// Reads a scene, and its depth image if it has one; the mesh is not opened.
    ///
    /// # Errors
    /// [`Error::File`]; [`Error::Malformed`], which names the key, or the line and column.
    pub fn open(path: &Path) -> Result<Self> {
        let text = std::fs::read(path).map_err(|e| Error::file(path, e))?;
        Self::parse(path, &text)
    }

    /// Reads a scene from its text. `path` is what messages call it; what it names is looked for in the folder of that.
    ///
    /// # Errors
    /// As [`Scene::open`].
    pub fn parse(path: &Path, text: &[u8]) -> Result<Self> {
        let malformed = |what| Error::malformed(path, what);
        let value = reader::parse(text).map_err(malformed)?;
        if !value.is_object() {
            return Err(malformed("a scene is an object: {\"mesh\": ...}".into()));
        }
        let file: file::File = read(&value).map_err(malformed)?;
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
        if let Some(cropping) = self.cropping {
            view = view.with_cropping(cropping);
        }
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
        behind_volume(view, &self.opaque, behind).map(|(view, backdrop)| (view, Some(backdrop)))
    }
}

/// `view`, whose rays end at opaque objects too, and what is seen of these, over a background.
///
/// # Errors
/// [`Error::NoMemory`] if the picture is too large.
pub fn behind_volume(view: View, opaque: &[Opaque], background: [f32; 3]) -> Result<(View, Backdrop)> {
    let [w, h] = view.size();
    let pixels = u64::from(w) * u64::from(h) * (size_of::<f64>() + size_of::<[f32; 3]>()) as u64;
    memory::check(&format!("the opaque objects in {w}x{h} pixels"), pixels)?;
    let (mut values, mut backdrop) = (Vec::new(), Vec::new());
    for (j, i) in (0..h).flat_map(|j| (0..w).map(move |i| (j, i))) {
        let mut ray = view.ray(i, j);
        let mut color = background;
        for object in opaque {
            if let Some((t, c)) = object.hit(&ray) {
                ray.t_max = t;
                color = c.map(|c| c as f32);
            }
        }
        values.push(ray.t_max);
        backdrop.push(color);
    }
    Ok((view.with_depth(DepthBuffer { kind: DepthKind::Ray, values })?, backdrop))
}

/// A form of the ray integral as scenes say it: by its name, or as an object.
///
/// # Errors
/// What is wrong, and where in the value.
pub fn integral(value: &Value) -> std::result::Result<IntegrationOptions, String> {
    let choice: IntegrationOptions = match value {
        Value::String(name) => return IntegrationOptions::default().named(name),
        Value::Object(_) => read(value)?,
        other => return Err(format!("an object is meant, or the name of a form, and not {}", reader::kind(other))),
    };
    choice.two.check().map_err(|what| format!("two: {what}"))?;
    Ok(choice)
}

#[cfg(test)]
mod tests;

#[cfg(test)]
mod second_tests;
