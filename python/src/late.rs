//! Exceptions of code that a C++ library calls, and whose exceptions it swallows.

use pyo3::ffi;
use pyo3::prelude::*;
use std::ffi::{c_int, c_void};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// An exception that the main thread's Python code raises as soon as it goes on: where whatever called the library returns.
///
/// It is called where the library's work ends. That it is no code in Python matters: it would raise the exception itself, which
/// the library would swallow again.
#[pyclass(module = "halite._halite", frozen)]
#[derive(Default)]
pub(crate) struct LateError(Mutex<Option<PyErr>>);

impl LateError {
    fn error(&self) -> MutexGuard<'_, Option<PyErr>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl LateError {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    /// Keeps an exception, if there is none yet.
    fn hold(&self, error: &Bound<'_, PyAny>) {
        self.error().get_or_insert_with(|| PyErr::from_value(error.clone()));
    }

    /// What was kept, which is not raised any more.
    fn take<'py>(&self, py: Python<'py>) -> Option<Bound<'py, pyo3::exceptions::PyBaseException>> {
        self.error().take().map(|e| e.into_value(py).into_bound(py))
    }

    /// The end of the library's work. Arguments are those of VTK's observers.
    #[pyo3(signature = (*_arguments))]
    fn __call__(slf: Bound<'_, Self>, _arguments: &Bound<'_, pyo3::types::PyTuple>) {
        if slf.get().error().is_some() {
            let pointer = slf.into_ptr().cast::<c_void>();
            // SAFETY: `pointer` is a reference that `raise` takes over; where the list of calls is full it is given back.
            unsafe {
                if ffi::Py_AddPendingCall(Some(raise), pointer) != 0 {
                    ffi::Py_DECREF(pointer.cast());
                }
            }
        }
    }
}

/// Called by the interpreter between two instructions of the main thread.
extern "C" fn raise(late: *mut c_void) -> c_int {
    Python::attach(|py| {
        // SAFETY: the reference that was handed to `Py_AddPendingCall`, whose calls hold the interpreter's lock.
        let late = unsafe { Bound::from_owned_ptr(py, late.cast()) };
        let Ok(late) = late.cast::<LateError>() else { return 0 };
        // In another frame of the same work, by which the exception would be swallowed: its end comes here again.
        if runs_halite(py).unwrap_or(false) {
            return 0;
        }
        match late.get().error().take() {
            None => 0,
            Some(error) => {
                error.restore(py);
                -1
            }
        }
    })
}

/// Whether the Python code that goes on is this package's.
fn runs_halite(py: Python<'_>) -> PyResult<bool> {
    let frame = py.import("sys")?.call_method0("_getframe")?;
    let name: String = frame.getattr("f_globals")?.get_item("__name__")?.extract()?;
    Ok(name.starts_with("halite."))
}
