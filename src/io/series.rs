//! Files that list others: each for a time, or several that make one mesh together.

use super::input::{Input, Place, find};
use super::{DataSet, Source, join, validated};
use crate::error::{Error, Result};
use serde::Deserialize;
use serde_json::error::Category;
use std::path::{Path, PathBuf};

/// A list of files (`.pvd`, `.series`), by time.
pub(super) struct Series {
    path: PathBuf,
    /// Ascending, no two the same.
    times: Vec<f64>,
    /// The files of each time.
    files: Vec<Vec<String>>,
}

/// A `.series` file, as ParaView has them.
#[derive(Deserialize)]
struct Listed {
    files: Vec<ListedFile>,
}

#[derive(Deserialize)]
struct ListedFile {
    name: String,
    #[serde(default)]
    time: f64,
}

impl Series {
    /// Of files and the time that each is for.
    pub(super) fn new(path: &Path, mut entries: Vec<(f64, String)>) -> Result<Self> {
        if entries.is_empty() {
            return Err(Error::malformed(path, "it lists no file"));
        }
        entries.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut series = Series { path: path.to_owned(), times: vec![], files: vec![] };
        for (time, file) in entries {
            match series.files.last_mut() {
                Some(files) if series.times.last() == Some(&time) => files.push(file),
                _ => {
                    series.times.push(time);
                    series.files.push(vec![file]);
                }
            }
        }
        Ok(series)
    }

    /// Of a `.series` file.
    pub(super) fn parse(input: &Input) -> Result<Self> {
        let path = &input.path;
        let text = input.bytes().map_err(|e| Error::file(path, e))?;
        let broken = |e: serde_json::Error| match e.classify() {
            Category::Data => "it holds no list \"files\", of objects with a \"name\" and a \"time\"".to_owned(),
            _ => format!("it is no JSON: line {}, column {}", e.line(), e.column()),
        };
        let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&text);
        let listed: Listed = serde_json::from_slice(text).map_err(|e| Error::malformed(path, broken(e)))?;
        Self::new(path, listed.files.into_iter().map(|file| (file.time, file.name)).collect())
    }

    /// The times of its steps.
    pub(super) fn times(&self) -> &[f64] {
        &self.times
    }

    /// Reads the files of a step, counted from 0. Those that hold no grid, or are missing, are left out if there are
    /// others.
    pub(super) fn read(&self, step: usize, tell: &(dyn Fn(f64) + Sync)) -> Result<DataSet> {
        let files = self.files.get(step).map_or(&[][..], Vec::as_slice);
        let (mut parts, mut fault) = (vec![], None);
        for (i, name) in files.iter().enumerate() {
            let share = |done: f64| tell((i as f64 + done) / files.len() as f64);
            match self.part(name, &share) {
                Ok(part) => parts.push(part),
                Err(error @ (Error::Unsupported { .. } | Error::File { .. })) => {
                    tracing::warn!("{}: a file that it lists is left out: {error}", self.path.display());
                    fault = Some(error);
                }
                Err(error) => return Err(error),
            }
        }
        match (parts.is_empty(), fault) {
            (true, Some(fault)) => Err(fault),
            _ if parts.len() == 1 => Ok(parts.swap_remove(0)),
            _ => {
                let meshes = parts.into_iter().map(|part| validated(&self.path, part.into_mesh()));
                join::joined(&self.path, meshes.collect::<Result<_>>()?).map(DataSet::Mesh)
            }
        }
    }

    fn part(&self, name: &str, tell: &(dyn Fn(f64) + Sync)) -> Result<DataSet> {
        let path = match find(&self.path, name) {
            Place::There(path) => path,
            Place::Moved(path) => {
                let (list, found) = (self.path.display(), path.display());
                tracing::warn!("{list}: {} is missing; {found} is read instead", name.escape_debug());
                path
            }
            Place::Missing(path, answer) => return Err(Error::file(&path, answer)),
        };
        let source = Source::open(&path)?;
        if source.is_series() {
            let what = format!("it lists {}, which is such a list itself", path.display());
            return Err(Error::malformed(&self.path, what));
        }
        source.read_data_set(0, tell)
    }
}
