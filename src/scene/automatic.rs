//! What is drawn when nobody says: an array, a range, colours, opacities and a view that show something of any mesh.

mod array;
mod framing;
mod look;
mod range;

pub use array::chosen;
pub use framing::{camera, framed};
pub use range::range;

use super::{Scalars, Scene};
use crate::error::Result;
use crate::field::{Association, Component, Field};
use crate::gpu::DeviceChoice;
use crate::integral::IntegrationOptions;
use crate::mesh::{Arrays, Mesh, cells::Tetrahedra};
use crate::project::ProjectionOptions;
use crate::transfer::Axis;
use crate::transfer::colormap::ColorMap;
use crate::view::{Blend, Camera};
use std::path::PathBuf;

/// Behind the volume: dark, but not so that black parts of it vanish.
const BACKGROUND: [f64; 3] = [0.11, 0.12, 0.14];

/// Width and height of pictures, in pixels.
pub const SIZE: [u32; 2] = [1024, 768];

/// What a mesh without arrays is drawn in.
const SOLID: [f64; 3] = [0.78, 0.82, 0.88];

/// What of the look somebody did say.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub struct Wishes {
    /// The scalars that colours and opacities range over.
    pub range: Option<[f64; 2]>,
    /// Smallest and largest value, where pictures of other meshes, such as those of other time steps, share the range.
    pub values: Option<[f64; 2]>,
    /// The colours.
    pub map: Option<ColorMap>,
    /// The opacities.
    pub opacity: Option<Opacity>,
    /// The length that opacities are meant for, in world units.
    pub unit_distance: Option<f64>,
    /// Whether colours and opacities are even over the logarithm of the scalars.
    pub logarithmic: bool,
    /// How the values along a ray become a pixel.
    pub blend: Blend,
    /// Width and height of the picture; [`SIZE`] if nobody says.
    pub size: Option<[u32; 2]>,
    /// From where the mesh is seen; [`camera`] if nobody says.
    pub camera: Option<Camera>,
}

impl Wishes {
    /// The same with another [`Wishes::range`].
    #[must_use]
    pub fn with_range(self, range: Option<[f64; 2]>) -> Self {
        Wishes { range, ..self }
    }

    /// The same with another [`Wishes::values`].
    #[must_use]
    pub fn with_values(self, values: Option<[f64; 2]>) -> Self {
        Wishes { values, ..self }
    }

    /// The same with another [`Wishes::map`].
    #[must_use]
    pub fn with_map(self, map: Option<ColorMap>) -> Self {
        Wishes { map, ..self }
    }

    /// The same with another [`Wishes::opacity`].
    #[must_use]
    pub fn with_opacity(self, opacity: Option<Opacity>) -> Self {
        Wishes { opacity, ..self }
    }

    /// The same with another [`Wishes::unit_distance`].
    #[must_use]
    pub fn with_unit_distance(self, unit_distance: Option<f64>) -> Self {
        Wishes { unit_distance, ..self }
    }

    /// The same with another [`Wishes::logarithmic`].
    #[must_use]
    pub fn with_logarithmic(self, logarithmic: bool) -> Self {
        Wishes { logarithmic, ..self }
    }

    /// The same with another [`Wishes::blend`].
    #[must_use]
    pub fn with_blend(self, blend: Blend) -> Self {
        Wishes { blend, ..self }
    }

    /// The same with another [`Wishes::size`].
    #[must_use]
    pub fn with_size(self, size: Option<[u32; 2]>) -> Self {
        Wishes { size, ..self }
    }

    /// The same with another [`Wishes::camera`].
    #[must_use]
    pub fn with_camera(self, camera: Option<Camera>) -> Self {
        Wishes { camera, ..self }
    }
}

/// Where a knot of an opacity function is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Place {
    /// At a scalar.
    Scalar(f64),
    /// At this share of the range: 0 is its start, 1 its end.
    Share(f64),
}

/// An opacity function whose knots may move with the range of scalars.
#[derive(Debug, Clone, PartialEq)]
pub struct Opacity(pub Vec<(Place, f64)>);

impl Opacity {
    /// Its knots, scalar and opacity, for a range of scalars.
    pub fn over(&self, [lo, hi]: [f64; 2]) -> Vec<(f64, f64)> {
        let at = |place| match place {
            Place::Scalar(s) => s,
            Place::Share(share) => lo + (hi - lo) * share,
        };
        self.0.iter().map(|&(place, a)| (at(place), a)).collect()
    }

    /// Its knots on `axis`, within the share `tolerance` of its largest opacity.
    pub fn on(&self, axis: &Axis, tolerance: f64) -> Vec<(f64, f64)> {
        if !axis.is_logarithmic() {
            return self.over(axis.range());
        }
        let at = |place| match place {
            Place::Scalar(s) => axis.place(s),
            Place::Share(share) => share,
        };
        let knots: Vec<(f64, f64)> = self.0.iter().map(|&(place, a)| (at(place), a)).collect();
        axis.knots(&knots, tolerance * look::largest(&knots))
    }
}

/// The array to draw; see [`chosen`]. Says in the log which, and why.
///
/// # Errors
/// [`Error::Field`] if there is no array.
///
/// [`Error::Field`]: crate::Error::Field
pub fn scalars(mesh: &Mesh, of: Option<Association>) -> Result<Scalars> {
    let (scalars, why) = chosen(mesh, of)?;
    let of = if scalars.association == Some(Association::Cell) { "cells" } else { "points" };
    tracing::info!("array \"{}\" of {of} is drawn: {why}", scalars.name);
    Ok(scalars)
}

/// What a mesh, or a grid, without arrays is drawn as: one value everywhere, for a colour map of one colour.
///
/// # Errors
/// [`Error::Field`] if there is no cell.
///
/// [`Error::Field`]: crate::Error::Field
pub fn solid(mesh: &impl Arrays) -> Result<(Field, ColorMap)> {
    let field = Field::from_slice("", &vec![0_u8; mesh.cell_count()], 1, Association::Cell, Component::Index(0))?;
    Ok((field, ColorMap::solid(SOLID)))
}

/// A scene that shows `field`, which `scalars` are in `mesh`.
///
/// # Errors
/// [`Error::Transfer`] if what was wished for is no transfer function, or there is no logarithm of the range.
///
/// [`Error::Transfer`]: crate::Error::Transfer
pub fn scene(mesh: &Mesh, tetrahedra: &Tetrahedra, scalars: Scalars, field: &Field, wishes: Wishes) -> Result<Scene> {
    let size = wishes.size.unwrap_or(SIZE);
    let camera = wishes.camera.unwrap_or_else(|| camera(mesh, tetrahedra, Some(field), size));
    Ok(Scene {
        gradient_array: None,
        mesh: PathBuf::new(),
        transfer: look::transfer(mesh, tetrahedra, &scalars, field, camera, &wishes)?,
        scalars,
        camera,
        size,
        pixel_offset: Default::default(),
        clipping_range: None,
        clipping_planes: Vec::new(),
        cropping: None,
        opaque: Vec::new(),
        depth: None,
        blend: wishes.blend,
        background: Some(BACKGROUND),
        engine: None,
        device: DeviceChoice::Auto,
        integral: IntegrationOptions::default(),
        reconstruction: None,
        projection: ProjectionOptions::default(),
    })
}

/// A range of a single value is made one around it.
pub fn widened([lo, hi]: [f64; 2]) -> [f64; 2] {
    if hi > lo { [lo, hi] } else { [lo - 0.5 * lo.abs().max(1.0), hi + 0.5 * hi.abs().max(1.0)] }
}
