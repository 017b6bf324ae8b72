//! What the program says and writes.

use crate::input::is_standard;
use anyhow::{Context, Result, bail};
use halite::image::{Backdrop, Image};
use std::io::{ErrorKind, IsTerminal, Write};
use std::path::{Path, PathBuf};

/// The endings that a picture can have.
const PICTURES: [&str; 3] = ["png", "exr", "npy"];

/// Says why the program failed, in one line.
pub fn error(error: &anyhow::Error) {
    let line = format!("{error:#}").replace('\n', " ");
    // A closed stderr is no reason to panic.
    let _ = writeln!(std::io::stderr(), "halite: {line}");
}

/// Options that do not go together: the program exits with 2 and says so.
pub fn misuse(what: impl std::fmt::Display) -> anyhow::Error {
    clap::Error::raw(clap::error::ErrorKind::ArgumentConflict, format!("{what}\n")).into()
}

/// Writes `text` to stdout. A reader that has seen enough is no error.
pub fn print(text: &str) -> Result<()> {
    match std::io::stdout().write_all(text.as_bytes()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(e).context("stdout"),
        _ => Ok(()),
    }
}

/// Writes a picture to `path`, or as `format` to stdout.
pub fn picture(image: &Image, path: &Path, format: &str, backdrop: Backdrop) -> Result<()> {
    if !is_standard(path) {
        return Ok(image.save(path, backdrop)?);
    }
    let bytes = image.encode(format, backdrop)?;
    let mut out = std::io::stdout().lock();
    out.write_all(&bytes).and_then(|()| out.flush()).context("stdout")
}

/// The path of the picture of a time step, of `count`: `name_0007.png` for `name.png`.
pub fn numbered(path: &Path, step: usize, count: usize) -> PathBuf {
    let digits = count.saturating_sub(1).to_string().len().max(4);
    let part = |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
    path.with_file_name(format!("{}_{step:0digits$}.{}", part(path.file_stem()), part(path.extension())))
}

/// As [`check_picture`], where stdout may take a picture, too: a format is what that gets.
pub fn check_stream(path: &Path, format: Option<&str>) -> Result<()> {
    match format {
        _ if is_standard(path) && std::io::stdout().is_terminal() => {
            bail!("stdout is a terminal, which shows no pictures: --out FILE.png, or > FILE.png")
        }
        _ if is_standard(path) => Ok(()),
        Some(_) => Err(misuse("--format says what standard output gets (--out -); files are what their endings say")),
        None => check_picture(path),
    }
}

/// Fails now if a picture could not be written to `path` later.
pub fn check_picture(path: &Path) -> Result<()> {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    if !PICTURES.contains(&ending.as_str()) {
        bail!("{}: the picture can be written as .png, .exr or .npy", path.display());
    }
    check(path)
}

/// Fails now if nothing could be written to `path` later.
pub fn check(path: &Path) -> Result<()> {
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
