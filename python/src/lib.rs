//! Halite for Python: what the package `halite` in `python/halite` is made of. Its modules have the documentation.

mod late;
mod mesh;
mod renderer;
mod transfer;
mod view;

use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;

create_exception!(halite, Error, PyException, "What Halite cannot do, or what is wrong with what it was given.");

/// Halite's errors as Python's.
fn raised(error: halite::Error) -> PyErr {
    match error {
        halite::Error::File { .. } => pyo3::exceptions::PyOSError::new_err(error.to_string()),
        halite::Error::NoMemory { .. } => pyo3::exceptions::PyMemoryError::new_err(error.to_string()),
        _ => Error::new_err(error.to_string()),
    }
}

#[pymodule]
fn _halite(py: Python<'_>, module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("Error", py.get_type::<Error>())?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<late::LateError>()?;
    module.add_class::<mesh::Mesh>()?;
    module.add_class::<renderer::Renderer>()?;
    module.add_class::<transfer::TransferFunction>()?;
    module.add_class::<view::View>()?;
    module.add_function(wrap_pyfunction!(renderer::automatic, module)?)?;
    module.add_function(wrap_pyfunction!(renderer::encode, module)?)?;
    module.add_function(wrap_pyfunction!(transfer::colormap, module)?)
}
