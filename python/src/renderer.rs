//! The renderer, and what is drawn when nobody says.

use crate::mesh::{Given, Mesh, drawn};
use crate::transfer::TransferFunction;
use crate::view::{View, matrix};
use crate::{Error, raised};
use halite::field::{Association, Component, Field};
use halite::host::{Log, Session};
use halite::image::{Backdrop, Image};
use halite::io::DataSet;
use halite::mesh::Array;
use halite::mesh::cells::Tetrahedra;
use halite::project::ProjectionOptions;
use halite::scene::{self, Scalars};
use numpy::{IntoPyArray, PyArray3, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde_json::Value;
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

/// The name of an array, and its numbers if it is not the mesh's own.
type Named<'py> = (String, Option<Bound<'py, PyAny>>);

/// What a field is made of.
enum Source<'a> {
    Own(&'a Array, Component),
    /// What is drawn of an array of Python.
    Copy(Array, Component),
}

impl<'a> Source<'a> {
    fn new(mesh: &'a Mesh, (name, given): Named<'_>, of_cells: bool, part: Component) -> PyResult<Self> {
        let Some(given) = given else {
            let array = mesh.array(&name, of_cells)?;
            let is_one = part == Component::Magnitude && array.components == 1;
            return Ok(Source::Own(array, if is_one { Component::Index(0) } else { part }));
        };
        drawn(name, &given, part).map(|(array, part)| Source::Copy(array, part))
    }

    fn field(self, association: Association) -> halite::Result<Field> {
        match self {
            Source::Own(array, part) => Field::from_array(array, association, part),
            Source::Copy(array, part) => Field::taking(array, association, part),
        }
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

    /// Draws an array, by its name that of the mesh itself; with a second variable, likewise. Returns the range of what is drawn; of
    /// several components, of the last, which the opacity depends on.
    fn set_field(
        &self,
        py: Python<'_>,
        mesh: &Mesh,
        values: Named<'_>,
        of_cells: bool,
        code: i64,
        second: Option<Named<'_>>,
    ) -> PyResult<[f64; 2]> {
        let first = Source::new(mesh, values, of_cells, component(code))?;
        let second = second.map(|second| Source::new(mesh, second, of_cells, Component::Magnitude)).transpose()?;
        let field = || {
            let field = first.field(association(of_cells))?;
            match second {
                Some(second) => field.with_second(second.field(association(of_cells))?),
                None => Ok(field),
            }
        };
        let mut range = [0.0; 2];
        let measured = || {
            let field = field()?;
            range = field.range(field.kind().components() - 1);
            Ok(field)
        };
        self.with(py, |session| session.set_field(measured))?;
        Ok(range)
    }

    /// How rays are integrated, how grids are rebuilt along them, and the projection's options; the first and the last are texts
    /// of JSON, as scenes have them.
    fn set_options(
        &self,
        py: Python<'_>,
        integral: Option<&str>,
        reconstruction: &str,
        sampling: f64,
        projection: Option<&str>,
    ) -> PyResult<()> {
        fn parsed<T>(what: &str, text: &str, read: impl Fn(&Value) -> Result<T, String>) -> PyResult<T> {
            let value = serde_json::from_str(text).map_err(|e| e.to_string());
            value.and_then(|v| read(&v)).map_err(|e| Error::new_err(format!("{what}: {e}")))
        }
        let integral = integral.map(|text| parsed("integral", text, scene::integral)).transpose()?;
        let projection =
            projection.map(|text| parsed("projection", text, scene::read::<ProjectionOptions>)).transpose()?;
        self.with(py, |session| {
            session.set_reconstruction(reconstruction, sampling)?;
            if let Some(projection) = projection {
                session.set_projection(projection);
            }
            integral.map_or(Ok(()), |choice| session.set_integral(choice))
        })
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
        kind: &str,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Option<Bound<'py, PyArray3<f32>>>> {
        let view = view.ended(depth, kind)?;
        let [w, h] = view.size().map(|n| n as usize);
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

/// So many points of a grid are looked at to choose colours and a view.
const MOST_SAMPLES: usize = 1 << 16;

/// The array, the view and the transfer function that show something of a mesh with these arrays.
#[pyfunction]
pub(crate) fn automatic(
    py: Python<'_>,
    mesh: &Mesh,
    point_data: Vec<Given<'_>>,
    cell_data: Vec<Given<'_>>,
    name: Option<(String, bool)>,
    size: [u32; 2],
) -> PyResult<(String, bool, View, TransferFunction)> {
    let all = mesh.with_arrays(point_data, cell_data)?;
    let chosen = py.detach(|| {
        let own;
        let mesh = match &*all {
            DataSet::Mesh(mesh) => mesh,
            DataSet::Grid(grid) => {
                own = grid.coarse(MOST_SAMPLES)?.into_mesh()?;
                &own
            }
        };
        let scalars = match name {
            Some((name, of_cells)) => Scalars { name, association: Some(association(of_cells)), component: None },
            None => scene::automatic::scalars(mesh, None)?,
        };
        let tetrahedra = Tetrahedra::new(mesh)?;
        let field = scalars.field(mesh)?;
        let wishes = scene::automatic::Wishes::default().with_size(Some(size));
        let scene = scene::automatic::scene(mesh, &tetrahedra, scalars, &field, wishes)?;
        let view = halite::view::View::new(scene.camera, size)?;
        Ok((scene.scalars, field.association() == Association::Cell, view, scene.transfer))
    });
    let (scalars, of_cells, view, transfer) = chosen.map_err(raised)?;
    Ok((scalars.name, of_cells, View { view, opaque: vec![] }, TransferFunction(transfer)))
}

/// A picture as the bytes of a .png, or written to a .png, .exr or .npy file; over a colour, or one for each pixel.
#[pyfunction]
pub(crate) fn encode<'py>(
    py: Python<'py>,
    pixels: PyReadonlyArray3<'py, f32>,
    background: Option<[f32; 3]>,
    behind: Option<PyReadonlyArray3<'py, f32>>,
    path: Option<PathBuf>,
) -> PyResult<Bound<'py, PyBytes>> {
    let &[h, w, 4] = pixels.shape() else {
        return Err(Error::new_err("a picture has the shape (height, width, 4)"));
    };
    let image = Image { size: [w as u32, h as u32], pixels: pixels.as_slice()?.as_chunks().0.to_vec() };
    let backdrop = match (&behind, background) {
        (Some(behind), _) if behind.shape() == [h, w, 3] => Backdrop::Pixels(behind.as_slice()?.as_chunks().0),
        (Some(_), _) => {
            let what = format!("a background is a colour, or has the shape of the picture, ({h}, {w}, 3)");
            return Err(Error::new_err(what));
        }
        (None, Some(color)) => Backdrop::Color(color),
        (None, None) => Backdrop::Transparent,
    };
    let bytes = match path {
        Some(path) => image.save(&path, backdrop).map(|()| vec![]),
        None => image.encode("png", backdrop),
    };
    Ok(PyBytes::new(py, &bytes.map_err(raised)?))
}
