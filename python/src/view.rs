//! Views.

use crate::{Error, raised};
use glam::{DMat4, DVec2, DVec3};
use halite::scene::{Opaque, behind_volume, read, regions};
use halite::view::{Blend, Camera, ClippingPlane, Cropping, DepthBuffer, DepthKind, Projection};
use numpy::{IntoPyArray, PyArray3, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

/// From where a mesh is seen, and how large the picture is; it never changes.
#[pyclass(module = "halite._halite", frozen)]
pub(crate) struct View {
    pub(crate) view: halite::view::View,
    /// Where rays end, besides depths.
    pub(crate) opaque: Vec<Opaque>,
}

impl View {
    fn changed(&self, view: halite::Result<halite::view::View>) -> PyResult<Self> {
        Ok(View { view: view.map_err(raised)?, opaque: self.opaque.clone() })
    }

    /// The view whose rays end at depths of shape (height, width), and at opaque objects.
    pub(crate) fn ended(&self, depth: Option<PyReadonlyArray2<'_, f32>>, kind: &str) -> PyResult<halite::view::View> {
        let mut view = self.view.clone();
        let [w, h] = view.size().map(|n| n as usize);
        if let Some(depth) = depth {
            let kind = match kind {
                "window" => DepthKind::Window,
                "eye" => DepthKind::Eye,
                "ray" => DepthKind::Ray,
                other => {
                    let what = format!("no depths are called \"{other}\"; there are \"window\", \"eye\" and \"ray\"");
                    return Err(Error::new_err(what));
                }
            };
            if depth.shape() != [h, w] {
                let [rows, columns] = [depth.shape()[0], depth.shape()[1]];
                let what = format!("depth has the shape ({rows}, {columns}), and the view ({h}, {w})");
                return Err(Error::new_err(what));
            }
            // The far plane ends nothing that the clipping range does not end.
            let far = if kind == DepthKind::Window { 1.0 } else { f64::INFINITY };
            let values = depth.as_slice()?.iter().map(|&d| if f64::from(d) < far { f64::from(d) } else { far });
            view = view.with_depth(DepthBuffer { kind, values: values.collect() }).map_err(raised)?;
        }
        if self.opaque.is_empty() {
            return Ok(view);
        }
        let (view, _) = behind_volume(view, &self.opaque, [0.0; 3]).map_err(raised)?;
        Ok(view)
    }
}

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
        Ok(View { view: view.map_err(raised)?, opaque: vec![] })
    }

    #[staticmethod]
    fn from_matrices(world_to_eye: [[f64; 4]; 4], eye_to_clip: [[f64; 4]; 4], size: [u32; 2]) -> PyResult<Self> {
        let [eye, clip] = [world_to_eye, eye_to_clip].map(matrix);
        let view = halite::view::View::from_matrices(eye, clip, size).map_err(raised)?;
        Ok(View { view, opaque: vec![] })
    }

    /// The same view, of which what lies before planes (origin, normal) alone is seen.
    fn clipped(&self, planes: Vec<[[f64; 3]; 2]>) -> PyResult<Self> {
        let plane = |[origin, normal]: [[f64; 3]; 2]| ClippingPlane {
            origin: DVec3::from(origin),
            normal: DVec3::from(normal),
        };
        self.changed(self.view.clone().with_clipping_planes(planes.into_iter().map(plane).collect()))
    }

    /// The same view, of some of the 27 regions between two planes across each axis: by a name, or bits.
    fn cropped(&self, planes: [[f64; 2]; 3], kept: &Bound<'_, PyAny>) -> PyResult<Self> {
        let bits = match kept.extract::<u32>() {
            Ok(bits) => bits,
            Err(_) => regions(&kept.extract::<String>()?).map_err(Error::new_err)?,
        };
        let cropping = Cropping::new(planes, bits, DMat4::IDENTITY).map_err(raised)?;
        self.changed(Ok(self.view.clone().with_cropping(cropping)))
    }

    /// The same view, with rays so far from the centres of pixels, in pixels to the right and up.
    fn offset(&self, by: [f64; 2]) -> PyResult<Self> {
        self.changed(Ok(self.view.clone().with_pixel_offset(DVec2::from(by))))
    }

    /// The same view, with opaque objects as scenes have them, each a text of JSON.
    fn before(&self, objects: Vec<String>) -> PyResult<Self> {
        let object = |(i, text): (usize, &String)| {
            let value = serde_json::from_str(text).map_err(|e| e.to_string());
            value.and_then(|v| read(&v)).map_err(|e| Error::new_err(format!("opaque[{i}]: {e}")))
        };
        let opaque = objects.iter().enumerate().map(object).collect::<PyResult<_>>()?;
        Ok(View { view: self.view.clone(), opaque })
    }

    /// The colours of the opaque objects over a background, of shape (height, width, 3).
    fn backdrop<'py>(&self, py: Python<'py>, background: [f32; 3]) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let [w, h] = self.view.size().map(|n| n as usize);
        let behind = py.detach(|| behind_volume(self.view.clone(), &self.opaque, background)).map_err(raised)?.1;
        behind.into_flattened().into_pyarray(py).reshape([h, w, 3])
    }

    /// The same view, of the largest values along rays.
    fn of_maxima(&self) -> PyResult<Self> {
        self.changed(Ok(self.view.clone().with_blend(Blend::Maximum)))
    }

    #[getter]
    fn size(&self) -> [u32; 2] {
        self.view.size()
    }
}

/// A matrix whose rows these are.
pub(crate) fn matrix(rows: [[f64; 4]; 4]) -> DMat4 {
    DMat4::from_cols_array_2d(&rows).transpose()
}
