//! Views.

use crate::raised;
use glam::{DMat4, DVec3};
use halite::view::{Blend, Camera, ClippingPlane, Projection};
use pyo3::prelude::*;

/// From where a mesh is seen, and how large the picture is; it never changes.
#[pyclass(module = "halite._halite", frozen)]
pub(crate) struct View(pub(crate) halite::view::View);

#[pymethods]
impl View {
    #[staticmethod]
    #[allow(clippy::too_many_arguments, reason = "all have names in Python")]
    fn from_camera(
        position: [f64; 3],
        focal_point: [f64; 3],
        view_up: [f64; 3],
        view_angle: f64,
        parallel_scale: Option<f64>,
        clipping_range: Option<[f64; 2]>,
        size: [u32; 2],
    ) -> PyResult<Self> {
        let projection = match parallel_scale {
            Some(parallel_scale) => Projection::Parallel { parallel_scale },
            None => Projection::Perspective { view_angle },
        };
        let camera =
            Camera { position: position.into(), focal_point: focal_point.into(), view_up: view_up.into(), projection };
        let view = halite::view::View::new(camera, size).map_err(raised)?;
        let view = clipping_range.map_or(Ok(view.clone()), |range| view.with_clipping_range(range));
        view.map(View).map_err(raised)
    }

    #[staticmethod]
    fn from_matrices(world_to_eye: [[f64; 4]; 4], eye_to_clip: [[f64; 4]; 4], size: [u32; 2]) -> PyResult<Self> {
        let [eye, clip] = [world_to_eye, eye_to_clip].map(matrix);
        halite::view::View::from_matrices(eye, clip, size).map(View).map_err(raised)
    }

    /// The same view, of which what lies before planes (origin, normal) alone is seen.
    fn clipped(&self, planes: Vec<[[f64; 3]; 2]>) -> PyResult<Self> {
        let plane = |[origin, normal]: [[f64; 3]; 2]| ClippingPlane {
            origin: DVec3::from(origin),
            normal: DVec3::from(normal),
        };
        let view = self.0.clone().with_clipping_planes(planes.into_iter().map(plane).collect());
        view.map(View).map_err(raised)
    }

    /// The same view, of the largest values along rays.
    fn of_maxima(&self) -> Self {
        View(self.0.clone().with_blend(Blend::Maximum))
    }

    #[getter]
    fn size(&self) -> [u32; 2] {
        self.0.size()
    }
}

/// A matrix whose rows these are.
pub(crate) fn matrix(rows: [[f64; 4]; 4]) -> DMat4 {
    DMat4::from_cols_array_2d(&rows).transpose()
}
