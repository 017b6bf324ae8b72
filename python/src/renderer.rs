//! The renderer, and what is drawn when nobody says.

use crate::mesh::{Mesh, array};
use crate::transfer::TransferFunction;
use crate::view::{View, matrix};
use crate::{Error, raised};
use halite::field::{Association, Component, Field};
use halite::host::{Log, Session};
use halite::image::{Backdrop, Image};
use halite::io::DataSet;
use halite::mesh::cells::Tetrahedra;
use halite::scene::{self, Scalars};
use halite::view::{DepthBuffer, DepthKind};
use numpy::{IntoPyArray, PyArray3, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::path::PathBuf;
use std::sync::Mutex;

/// Draws one mesh, as often as wanted; keeps what does not change. Threads may share one: each call waits for the others.
#[pyclass(module = "halite._halite", frozen)]
pub(crate) struct Renderer {
    session: Mutex<Session>,
    log: Log,
}

impl Renderer {
    /// Runs `work` without Python's lock.
    fn with<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut Session) -> halite::Result<T> + Send,
    ) -> PyResult<T> {
        let done = py.detach(|| match self.session.lock() {
            Ok(mut session) => session.guarded(work),
            Err(_) => Err(halite::Error::Render("this renderer failed before and cannot go on; make another".into())),
        });
        self.warn(py)?;
        done.map_err(raised)
    }

    /// Has Python warn of what the core warned of.
    fn warn(&self, py: Python<'_>) -> PyResult<()> {
        for line in self.log.take() {
            if let Some(text) = line.trim_start().strip_prefix("WARN ") {
                PyErr::warn(py, &py.get_type::<pyo3::exceptions::PyUserWarning>(), &std::ffi::CString::new(text)?, 2)?;
            }
        }
        Ok(())
    }
}

fn association(of_cells: bool) -> Association {
    if of_cells { Association::Cell } else { Association::Point }
}

/// A component, −1 for the length of tuples, −2 for all.
fn component(code: i64) -> Component {
    match usize::try_from(code) {
        Ok(k) => Component::Index(k),
        Err(_) if code == -1 => Component::Magnitude,
        Err(_) => Component::All,
    }
}

#[pymethods]
impl Renderer {
    #[new]
    fn new(py: Python<'_>, threads: usize, device: &str, engine: &str) -> PyResult<Self> {
        let log = Log::default();
        let session = py.detach(|| Session::new(threads, device, engine, log.clone())).map_err(raised)?;
        Ok(Renderer { session: Mutex::new(session), log })
    }

    fn set_mesh(&self, py: Python<'_>, mesh: &Mesh, placement: [[f64; 4]; 4]) -> PyResult<()> {
        let placement = matrix(placement);
        self.with(py, |session| match &mesh.0 {
            DataSet::Mesh(mesh) => session.set_mesh(mesh, placement),
            DataSet::Grid(grid) => session.set_grid(grid, placement),
        })
    }

    fn set_array(&self, py: Python<'_>, mesh: &Mesh, name: &str, of_cells: bool, code: i64) -> PyResult<()> {
        let array = mesh.array(name, of_cells)?;
        self.with(py, |s| s.set_field(|| Field::from_array(array, association(of_cells), component(code))))
    }

    fn set_values(&self, py: Python<'_>, values: &Bound<'_, PyAny>, of_cells: bool, code: i64) -> PyResult<()> {
        let array = array("values".into(), values)?;
        self.with(py, |s| s.set_field(|| Field::from_array(&array, association(of_cells), component(code))))
    }

    fn set_transfer(&self, py: Python<'_>, transfer: &TransferFunction) -> PyResult<()> {
        self.with(py, |session| {
            session.set_transfer(&transfer.0);
            Ok(())
        })
    }

    /// Premultiplied linear RGBA of shape (height, width, 4), row 0 uppermost; None if `progress` returned False.
    fn render<'py>(
        &self,
        py: Python<'py>,
        view: &View,
        depth: Option<PyReadonlyArray2<'py, f32>>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Option<Bound<'py, PyArray3<f32>>>> {
        let mut view = view.0.clone();
        let [w, h] = view.size().map(|n| n as usize);
        if let Some(depth) = depth {
            if depth.shape() != [h, w] {
                let [rows, columns] = [depth.shape()[0], depth.shape()[1]];
                return Err(Error::new_err(format!(
                    "depth has the shape ({rows}, {columns}), and the view ({h}, {w})"
                )));
            }
            // The far plane ends nothing that the clipping range does not end.
            let values = depth.as_slice()?.iter().map(|&d| if d < 1.0 { f64::from(d) } else { 1.0 }).collect();
            view = view.with_depth(DepthBuffer { kind: DepthKind::Window, values }).map_err(raised)?;
        }
        let mut thrown: Option<PyErr> = None;
        let image = {
            let thrown = &mut thrown;
            let mut report = move |share: f64| {
                let go_on = Python::attach(|py| {
                    py.check_signals()?;
                    match &progress {
                        Some(call) => Ok(!call.call1(py, (share,))?.bind(py).is(pyo3::types::PyBool::new(py, false))),
                        None => Ok(true),
                    }
                });
                Ok(go_on.unwrap_or_else(|e| {
                    thrown.get_or_insert(e);
                    false
                }))
            };
            self.with(py, move |session| match session.render(&view, &mut report) {
                Err(halite::Error::Aborted) => Ok(None),
                image => image.map(Some),
            })
        };
        if let Some(thrown) = thrown {
            return Err(thrown);
        }
        let Some(image) = image? else { return Ok(None) };
        image.pixels.into_flattened().into_pyarray(py).reshape([h, w, 4]).map(Some)
    }

    #[getter]
    fn stats(&self) -> PyResult<Vec<(&'static str, String)>> {
        let session = self.session.lock().map_err(|_| Error::new_err("this renderer failed before"))?;
        let s = session.stats();
        Ok(vec![
            ("engine", s.engine.clone()),
            ("device", s.device.clone()),
            ("adapter", s.adapter.clone()),
            ("cells", s.cells.to_string()),
            ("tetrahedra", s.tetrahedra.to_string()),
            ("frame_ms", s.frame_ms.to_string()),
        ])
    }
}

/// The array, the view and the transfer function that show something of a mesh.
#[pyfunction]
pub(crate) fn automatic(
    py: Python<'_>,
    mesh: &Mesh,
    name: Option<(String, bool)>,
    size: [u32; 2],
) -> PyResult<(String, bool, View, TransferFunction)> {
    let chosen = py.detach(|| {
        let mesh = mesh.0.clone().into_mesh()?;
        let scalars = match name {
            Some((name, of_cells)) => Scalars { name, association: Some(association(of_cells)), component: None },
            None => scene::automatic::scalars(&mesh, None)?,
        };
        let tetrahedra = Tetrahedra::new(&mesh)?;
        let field = scalars.field(&mesh)?;
        let wishes = scene::automatic::Wishes { size: Some(size), ..Default::default() };
        let scene = scene::automatic::scene(&mesh, &tetrahedra, scalars, &field, wishes)?;
        let view = halite::view::View::new(scene.camera, size)?;
        Ok((scene.scalars, field.association() == Association::Cell, view, scene.transfer))
    });
    let (scalars, of_cells, view, transfer) = chosen.map_err(raised)?;
    Ok((scalars.name, of_cells, View(view), TransferFunction(transfer)))
}

/// A picture as the bytes of a .png, .exr or .npy file, or written to one.
#[pyfunction]
pub(crate) fn encode<'py>(
    py: Python<'py>,
    pixels: PyReadonlyArray3<'py, f32>,
    background: Option<[f32; 3]>,
    path: Option<PathBuf>,
) -> PyResult<Bound<'py, PyBytes>> {
    let &[h, w, 4] = pixels.shape() else {
        return Err(Error::new_err("a picture has the shape (height, width, 4)"));
    };
    let image = Image { size: [w as u32, h as u32], pixels: pixels.as_slice()?.as_chunks().0.to_vec() };
    let backdrop = background.map_or(Backdrop::Transparent, Backdrop::Color);
    let bytes = match path {
        Some(path) => image.save(&path, backdrop).map(|()| vec![]),
        None => image.encode("png", backdrop),
    };
    Ok(PyBytes::new(py, &bytes.map_err(raised)?))
}
