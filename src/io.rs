//! Reading meshes and grids from files.

mod blocks;
mod data;
mod input;
mod join;
mod legacy;
mod number;
mod series;
mod text;
mod unpack;
mod vtu;

use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::mesh::{Attributes, LeftOut, Mesh};
use crate::progress::Progress;
use input::Input;
use series::Series;
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

/// What Halite knows of but does not read: extension, type attribute of the XML file, and what would help.
const REFUSED: [(&str, &str, &str); 17] = [
    ("vtm", "vtkMultiBlockDataSet", MULTIBLOCK),
    ("vtmb", "vtkMultiBlockDataSet", MULTIBLOCK),
    ("vtpc", "vtkPartitionedDataSetCollection", MULTIBLOCK),
    ("vtkhdf", "vtkHDF", "a VTKHDF file, which Halite cannot read; save it as .vtu"),
    ("hdf", "HDF", "an HDF5 file, which Halite cannot read; save it as .vtu"),
    ("vtp", "PolyData", "surfaces without volume; Halite reads unstructured grids (.vtu)"),
    ("vth", "HierarchicalBoxDataSet", REFINED),
    ("htg", "HyperTreeGrid", REFINED),
    ("pvtp", "PPolyData", "surfaces without volume; Halite reads unstructured grids (.vtu)"),
    ("vtpd", "vtkPartitionedDataSet", MULTIBLOCK),
    ("vthb", "vtkOverlappingAMR", REFINED),
    ("ex2", "Exodus", FOREIGN),
    ("exo", "Exodus", FOREIGN),
    ("e", "Exodus", FOREIGN),
    ("cgns", "CGNS", FOREIGN),
    ("msh", "mesh", FOREIGN),
    ("case", "EnSight", FOREIGN),
];
const FOREIGN: &str = "a file of another format, which Halite cannot read; open it in ParaView, save it as .vtu";
const REFINED: &str =
    "a tree of refined grids, which Halite cannot read; convert it (in ParaView: Append Datasets), save that as .vtu";
const MULTIBLOCK: &str =
    "a list of blocks, which Halite cannot read; merge them (in ParaView: Merge Blocks), save that as .vtu";

/// Reads a mesh: the file's grid as it is, nothing welded, dropped or repaired. `progress` is told the share of the
/// work that is done, in [0, 1], never less than before.
///
/// The content decides: `.vtu`, `.vti`, `.vtr` or `.vts` XML of every data mode, uncompressed or packed, or a legacy `.vtk`
/// file; or a list of such (`.pvtu` and so on, `.pvd`, `.series`). Grids without a list of cells become one of voxels or
/// hexahedra. Several pieces become one mesh, with the arrays that all pieces with points (or cells)
/// have: of one number type if they agree, as f64 if not. Arrays of strings, and field data, are left out; so are, with a
/// warning, arrays of points or cells that are not whole, and pieces that are missing. Of several time steps the first is
/// read. The work is done in the current rayon pool.
///
/// # Errors
/// [`Error::File`], [`Error::Malformed`] or [`Error::Unsupported`], naming the file and the place in it.
pub fn open(path: &Path, progress: &(dyn Fn(f64) + Sync)) -> Result<Mesh> {
    Source::open(path)?.read(0, progress)
}

/// What a file holds.
#[derive(Debug, Clone, PartialEq)]
pub enum DataSet {
    /// An unstructured grid, or a structured (curvilinear) one, whose cells are hexahedra.
    Mesh(Mesh),
    /// Image data, or a rectilinear grid.
    Grid(Grid),
}

impl DataSet {
    /// A mesh of it; of a grid, one of voxels.
    ///
    /// # Errors
    /// As [`Grid::into_mesh`].
    pub fn into_mesh(self) -> Result<Mesh> {
        match self {
            DataSet::Mesh(mesh) => Ok(mesh),
            DataSet::Grid(grid) => grid.into_mesh(),
        }
    }

    fn set_attributes(&mut self, of_points: Attributes, of_cells: Attributes) {
        match self {
            DataSet::Mesh(mesh) => mesh.set_attributes(of_points, of_cells),
            DataSet::Grid(grid) => grid.set_attributes(of_points, of_cells),
        }
    }
}

/// A file, or bytes, that hold a mesh or a list of files of such: what it is and which time steps it has is known,
/// points and arrays are not read yet.
pub struct Source {
    input: Input,
    kind: Kind,
}

/// How a mesh is written.
enum Kind {
    Xml(Box<vtu::Document>),
    Legacy,
    Series(Series),
}

/// Which time step of a file is meant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Time {
    /// The step of that number, from 0; or, where there are not as many, the one of that time.
    Step(usize),
    /// The step whose time is nearest.
    Value(f64),
    /// The last step.
    Last,
}

impl Source {
    /// Opens a file.
    ///
    /// # Errors
    /// As [`open`].
    pub fn open(path: &Path) -> Result<Self> {
        // Pipes can be read once only.
        if path.metadata().is_ok_and(|found| !found.is_file() && !found.is_dir()) {
            let bytes = std::fs::read(path).map_err(|e| Error::file(path, e))?;
            return Self::from_bytes(path, bytes);
        }
        Self::of(Input::file(path))
    }

    /// Takes bytes for a file. `name` is what messages call it; files that it lists are looked for in the folder of that.
    ///
    /// # Errors
    /// As [`open`].
    pub fn from_bytes(name: &Path, bytes: impl Into<Arc<[u8]>>) -> Result<Self> {
        Self::of(Input::memory(name, bytes.into()))
    }

    fn of(input: Input) -> Result<Self> {
        let path = &input.path;
        let mut start = Vec::new();
        let read = input.open().and_then(|file| file.take(1024).read_to_end(&mut start));
        read.map_err(|e| Error::file(path, e))?;
        let text = start.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&start).trim_ascii_start();
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let kind = if text.first() == Some(&b'<') {
            match vtu::open(&input)? {
                vtu::Opened::Grid(grid) => Kind::Xml(Box::new(grid)),
                vtu::Opened::Collection(series) => Kind::Series(series),
            }
        } else if text.get(..14).is_some_and(|tag| tag.eq_ignore_ascii_case(b"# vtk DataFile")) {
            Kind::Legacy
        } else if text.first() == Some(&b'{') && extension == "series" {
            Kind::Series(Series::parse(&input)?)
        } else {
            let known = REFUSED.iter().find(|known| known.0 == extension);
            return Err(match known {
                _ if start.is_empty() => Error::malformed(path, "the file is empty"),
                Some((_, _, what)) => Error::unsupported(path, format!("this is {what}")),
                None => {
                    let what = "this is neither a VTK XML file (.vtu, .vti) nor a legacy VTK file (.vtk), and Halite reads no others";
                    Error::malformed(path, what)
                }
            });
        };
        Ok(Source { input, kind })
    }

    /// The times of its steps, ascending in lists of files, as the file has them otherwise. None if it tells none.
    pub fn times(&self) -> &[f64] {
        match &self.kind {
            Kind::Xml(grid) => grid.times(),
            Kind::Series(series) => series.times(),
            Kind::Legacy => &[],
        }
    }

    /// Whether it lists files of meshes for different times, or parts of one mesh that are no pieces of one grid.
    fn is_series(&self) -> bool {
        matches!(self.kind, Kind::Series(_))
    }

    /// The number of the step that `time` means, from 0.
    ///
    /// # Errors
    /// [`Error::Step`] if there is none, or the time is outside of those that there are.
    pub fn step(&self, time: Time) -> Result<usize> {
        let times = self.times();
        let fail = |asked: String| {
            let there = match times {
                [] => "it has no time steps".to_owned(),
                [only] => format!("it has one step, of time {only}"),
                [first, .., last] => format!("it has steps 0 to {}, of times {first} to {last}", times.len() - 1),
            };
            Err(Error::Step { path: self.input.path.clone(), what: format!("there is no {asked}; {there}") })
        };
        match time {
            Time::Last => Ok(times.len().saturating_sub(1)),
            Time::Step(0) => Ok(0),
            Time::Step(step) if step < times.len() => Ok(step),
            Time::Step(step) => match times.iter().position(|time| *time == step as f64) {
                Some(found) => Ok(found),
                None => fail(format!("time step {step}")),
            },
            Time::Value(value) => {
                let (lo, hi) = times.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |r, t| (r.0.min(*t), r.1.max(*t)));
                // As many digits as people type.
                let slack = 1e-4 * (hi - lo).max(value.abs() * 1e-2);
                let far = |time: f64| (time - value).abs();
                let nearest = times.iter().enumerate().min_by(|a, b| far(*a.1).total_cmp(&far(*b.1)));
                match nearest {
                    Some((step, time)) if (lo - slack..=hi + slack).contains(&value) => {
                        if far(*time) > slack {
                            let path = self.input.path.display();
                            tracing::warn!(
                                "{path}: no step is of time {value}; step {step}, of {time}, is the nearest"
                            );
                        }
                        Ok(step)
                    }
                    _ => fail(format!("time {value}")),
                }
            }
        }
    }

    /// Reads the mesh at a step, counted from 0; see [`open`].
    ///
    /// # Errors
    /// As [`open`]; [`Error::Step`] if there is no such step.
    pub fn read(&self, step: usize, progress: &(dyn Fn(f64) + Sync)) -> Result<Mesh> {
        validated(&self.input.path, self.read_data_set(step, progress)?.into_mesh())
    }

    /// As [`Self::read`], but keeps regular and rectilinear grids as they are.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn read_data_set(&self, step: usize, progress: &(dyn Fn(f64) + Sync)) -> Result<DataSet> {
        let step = if step > 0 && step >= self.times().len() { self.step(Time::Step(step))? } else { step };
        progress(0.0);
        let read = match &self.kind {
            Kind::Xml(grid) => grid.read(step, progress)?,
            Kind::Series(series) => series.read(step, progress)?,
            Kind::Legacy => legacy::read(&self.input)?,
        };
        progress(1.0);
        Ok(read)
    }
}

/// So many arrays that are left out are told one by one.
const MOST_WARNINGS: usize = 8;

/// Tells the log which arrays were left out, each name once.
fn warn_of_left_out(path: &Path, arrays: &mut Vec<LeftOut>) {
    let mut names = std::collections::HashSet::new();
    arrays.retain(|array| names.insert(array.name.clone()));
    let path = path.display();
    for LeftOut { why, .. } in arrays.iter().take(MOST_WARNINGS) {
        tracing::warn!("{path}: {why}; it is left out");
    }
    if let Some(more) = arrays.len().checked_sub(MOST_WARNINGS).filter(|more| *more > 0) {
        tracing::warn!("{path}: {more} more arrays are left out");
    }
}

/// [`Error::Unsupported`] for a kind of data set that is no grid that is read.
fn refuse(path: &Path, kind: &str) -> Error {
    let known = REFUSED.iter().find(|known| known.1.eq_ignore_ascii_case(kind));
    let what = known.map_or(
        "a kind that Halite does not read; it reads unstructured and structured grids (.vtu, .vti, .vtr, .vts)",
        |known| known.2,
    );
    Error::unsupported(path, format!("it holds \"{}\": {what}", kind.escape_debug()))
}

/// What was made of parts that were read from a file: if they contradict each other, the file is to blame.
fn validated<T>(path: &Path, made: Result<T>) -> Result<T> {
    made.map_err(|error| match error {
        Error::Mesh(what) => Error::malformed(path, what),
        other => other,
    })
}
