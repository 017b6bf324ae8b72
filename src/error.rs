//! The one error type of the library.

use std::path::{Path, PathBuf};

/// What went wrong, where, and what would help. Its `Display` is one line, fit to show to a user as it is.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system could not read or write a file.
    #[error("{}: {answer}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The system's answer. It is part of the line, and so no source of the error, which would be told twice.
        answer: std::io::Error,
    },
    /// A file does not hold what its format demands.
    #[error("{}: {what}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where in the file: the array, the cell, the key.
        what: String,
    },
    /// A file is (or may be) right, but uses something that Halite does not read.
    #[error("{}: {what}", path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// The feature, by name, and what would help.
        what: String,
    },
    /// A file has no such time step.
    #[error("{}: {what}", path.display())]
    Step {
        /// The file.
        path: PathBuf,
        /// What was asked for, and what there is.
        what: String,
    },
    /// A mesh breaks a rule that every mesh must keep.
    #[error("the mesh is not valid: {0}")]
    Mesh(String),
    /// A mesh has no cell to draw.
    #[error("the mesh cannot be drawn: {0}")]
    Empty(String),
    /// The chosen array does not exist, or cannot be drawn.
    #[error("{0}")]
    Field(String),
    /// A transfer function, colour map or unit distance that cannot be used.
    #[error("the transfer function is not valid: {0}")]
    Transfer(String),
    /// A camera, image size, depth buffer or clipping that cannot be used.
    #[error("the view is not valid: {0}")]
    View(String),
    /// There is no such device, it is of no use, or it refused a call.
    #[error("{0}")]
    Device(String),
    /// A device has not enough memory.
    #[error(
        "{device}: {needed} bytes of memory are needed, {allowed} are allowed; another device, or \"cpu\", may have more"
    )]
    Memory {
        /// The device.
        device: String,
        /// Bytes that would be allocated then.
        needed: u64,
        /// Bytes that may be.
        allowed: u64,
    },
    /// The system has not enough memory.
    #[error("{0}")]
    NoMemory(String),
    /// A device is gone: unplugged, reset, or its driver failed.
    #[error("{0}")]
    Lost(String),
    /// Whoever was told the progress wanted no more of it.
    #[error("the frame was given up, as asked")]
    Aborted,
    /// The renderer was asked for a frame before it had what it needs, or after it failed.
    #[error("{0}")]
    Render(String),
}

impl Error {
    pub(crate) fn file(path: &Path, answer: std::io::Error) -> Self {
        if answer.kind() == std::io::ErrorKind::OutOfMemory {
            return Error::NoMemory(format!("there is not enough memory for {}", path.display()));
        }
        Error::File { path: path.to_owned(), answer }
    }

    pub(crate) fn malformed(path: &Path, what: impl Into<String>) -> Self {
        Error::Malformed { path: path.to_owned(), what: what.into() }
    }

    pub(crate) fn unsupported(path: &Path, what: impl Into<String>) -> Self {
        Error::Unsupported { path: path.to_owned(), what: what.into() }
    }
}

/// A result of this library.
pub type Result<T, E = Error> = std::result::Result<T, E>;
