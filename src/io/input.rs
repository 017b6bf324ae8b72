//! Where the bytes of a file are: on a disk, or in memory.

use std::borrow::Cow;
use std::fs::File;
use std::io::{Cursor, Read, Result, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A file that can be opened as often as wanted.
#[derive(Debug, Clone)]
pub(super) struct Input {
    /// Names it in messages; what it lists is looked for in the folder of this.
    pub(super) path: PathBuf,
    /// Its bytes, if they do not come from the path.
    bytes: Option<Arc<[u8]>>,
}

impl Input {
    pub(super) fn file(path: &Path) -> Self {
        Input { path: path.to_owned(), bytes: None }
    }

    pub(super) fn memory(name: &Path, bytes: Arc<[u8]>) -> Self {
        Input { path: name.to_owned(), bytes: Some(bytes) }
    }

    pub(super) fn open(&self) -> Result<Opened> {
        Ok(match &self.bytes {
            Some(bytes) => Opened::Memory(Cursor::new(Arc::clone(bytes))),
            None => Opened::File(File::open(&self.path)?),
        })
    }

    /// All of its bytes.
    pub(super) fn bytes(&self) -> Result<Cow<'_, [u8]>> {
        Ok(match &self.bytes {
            Some(bytes) => Cow::Borrowed(bytes),
            None => Cow::Owned(std::fs::read(&self.path)?),
        })
    }
}

/// An opened file.
#[derive(Debug)]
pub(super) enum Opened {
    File(File),
    Memory(Cursor<Arc<[u8]>>),
}

impl Opened {
    /// Its length in bytes.
    pub(super) fn length(&self) -> Result<u64> {
        match self {
            Opened::File(file) => Ok(file.metadata()?.len()),
            Opened::Memory(bytes) => Ok(bytes.get_ref().len() as u64),
        }
    }

    /// Fills `out` from position `at` on.
    pub(super) fn read_at(&self, at: u64, out: &mut [u8]) -> Result<()> {
        match self {
            Opened::File(file) => read_at(file, at, out),
            Opened::Memory(bytes) => copy_at(bytes.get_ref(), at, out),
        }
    }
}

/// Fills `out` from position `at` of `bytes` on.
pub(super) fn copy_at(bytes: &[u8], at: u64, out: &mut [u8]) -> Result<()> {
    let from = usize::try_from(at).ok().and_then(|at| bytes.get(at..)?.get(..out.len()));
    out.copy_from_slice(from.ok_or(std::io::ErrorKind::UnexpectedEof)?);
    Ok(())
}

impl Read for Opened {
    fn read(&mut self, out: &mut [u8]) -> Result<usize> {
        match self {
            Opened::File(file) => file.read(out),
            Opened::Memory(bytes) => bytes.read(out),
        }
    }
}

impl Seek for Opened {
    fn seek(&mut self, to: SeekFrom) -> Result<u64> {
        match self {
            Opened::File(file) => file.seek(to),
            Opened::Memory(bytes) => bytes.seek(to),
        }
    }
}

#[cfg(unix)]
fn read_at(file: &File, at: u64, out: &mut [u8]) -> Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, out, at)
}

#[cfg(windows)]
fn read_at(file: &File, mut at: u64, mut out: &mut [u8]) -> Result<()> {
    while !out.is_empty() {
        match std::os::windows::fs::FileExt::seek_read(file, out, at)? {
            0 => return Err(std::io::ErrorKind::UnexpectedEof.into()),
            n => (at, out) = (at + n as u64, &mut out[n..]),
        }
    }
    Ok(())
}

/// Where a file is that another one lists.
pub(super) enum Place {
    /// Where the list says.
    There(PathBuf),
    /// Elsewhere: the list, or the files, were moved.
    Moved(PathBuf),
    /// Where it should be, and what the system says of that.
    Missing(PathBuf, std::io::Error),
}

/// Looks for the file that `list` calls `name`: at that path, from the folder of the list if it is relative; with
/// slashes for backslashes; else in the folder of the list, under the longest end of the path that is there.
pub(super) fn find(list: &Path, name: &str) -> Place {
    let folder = list.parent().unwrap_or(Path::new(""));
    let is_file = |path: &Path| path.metadata().is_ok_and(|found| !found.is_dir());
    let said = folder.join(name);
    if is_file(&said) {
        return Place::There(said);
    }
    let parts: Vec<&str> = name.split(['/', '\\']).filter(|part| !part.is_empty() && *part != ".").collect();
    // What comes before the last ".." or drive says nothing of where it is now.
    let first = parts.iter().rposition(|part| *part == ".." || part.ends_with(':')).map_or(0, |i| i + 1);
    for start in first..parts.len() {
        let candidate = folder.join(parts[start..].iter().collect::<PathBuf>());
        if is_file(&candidate) {
            // The same path, written as another system does, is no move.
            let relative = start == 0 && !name.starts_with(['/', '\\']);
            return if relative { Place::There(candidate) } else { Place::Moved(candidate) };
        }
    }
    let answer = match File::open(&said) {
        Err(answer) => answer,
        Ok(_) => std::io::ErrorKind::IsADirectory.into(),
    };
    Place::Missing(said, answer)
}
