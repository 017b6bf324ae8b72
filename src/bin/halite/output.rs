//! What the program says and writes.

use anyhow::{Context, Result, bail};
use std::io::{ErrorKind, Write};
use std::path::Path;

/// The endings that a picture can have.
const PICTURES: [&str; 3] = ["png", "exr", "npy"];

/// Says why the program failed, in one line.
pub(crate) fn error(error: &anyhow::Error) {
    let line = format!("{error:#}").replace('\n', " ");
    // A closed stderr is no reason to panic.
    let _ = writeln!(std::io::stderr(), "halite: {line}");
}

/// Options that do not go together: the program exits with 2 and says so.
pub(crate) fn misuse(what: impl std::fmt::Display) -> anyhow::Error {
    clap::Error::raw(clap::error::ErrorKind::ArgumentConflict, format!("{what}\n")).into()
}

/// Writes `text` to stdout. A reader that has seen enough is no error.
pub(crate) fn print(text: &str) -> Result<()> {
    match std::io::stdout().write_all(text.as_bytes()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(e).context("stdout"),
        _ => Ok(()),
    }
}

/// Fails now if a picture could not be written to `path` later.
pub(crate) fn check_picture(path: &Path) -> Result<()> {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    if !PICTURES.contains(&ending.as_str()) {
        bail!("{}: the picture can be written as .png, .exr or .npy", path.display());
    }
    check(path)
}

/// Fails now if nothing could be written to `path` later.
pub(crate) fn check(path: &Path) -> Result<()> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        bail!("{}: there is no folder {}", path.display(), folder.display());
    }
    if path.is_dir() {
        bail!("{}: this is a folder", path.display());
    }
    if path.exists() {
        std::fs::OpenOptions::new().append(true).open(path).with_context(|| path.display().to_string())?;
    }
    Ok(())
}
