//! Reading meshes from files.

mod data;
mod legacy;
mod number;
mod unpack;
mod vtu;

use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::progress::Progress;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// What Halite knows of but does not read: extension, type attribute of the XML file, and what would help.
const REFUSED: [(&str, &str, &str); 24] = [
    ("pvd", "Collection", "a list of files, which Halite cannot read; open one of the .vtu that it lists"),
    ("vtm", "vtkMultiBlockDataSet", MULTIBLOCK),
    ("vtmb", "vtkMultiBlockDataSet", MULTIBLOCK),
    ("vtpc", "vtkPartitionedDataSetCollection", MULTIBLOCK),
    ("vtkhdf", "vtkHDF", "a VTKHDF file, which Halite cannot read; save it as .vtu"),
    ("hdf", "HDF", "an HDF5 file, which Halite cannot read; save it as .vtu"),
    ("vti", "ImageData", STRUCTURED),
    ("vtr", "RectilinearGrid", STRUCTURED),
    ("vts", "StructuredGrid", STRUCTURED),
    ("pvti", "PImageData", STRUCTURED),
    ("vtp", "PolyData", "surfaces without volume; Halite reads unstructured grids (.vtu)"),
    ("vth", "HierarchicalBoxDataSet", STRUCTURED),
    ("htg", "HyperTreeGrid", STRUCTURED),
    ("pvtr", "PRectilinearGrid", STRUCTURED),
    ("pvts", "PStructuredGrid", STRUCTURED),
    ("pvtp", "PPolyData", "surfaces without volume; Halite reads unstructured grids (.vtu)"),
    ("vtpd", "vtkPartitionedDataSet", MULTIBLOCK),
    ("vthb", "vtkOverlappingAMR", STRUCTURED),
    ("ex2", "Exodus", FOREIGN),
    ("exo", "Exodus", FOREIGN),
    ("e", "Exodus", FOREIGN),
    ("cgns", "CGNS", FOREIGN),
    ("msh", "mesh", FOREIGN),
    ("case", "EnSight", FOREIGN),
];
const FOREIGN: &str = "a file of another format, which Halite cannot read; open it in ParaView, save it as .vtu";
const STRUCTURED: &str =
    "a structured grid; convert it to an unstructured grid (in ParaView: Append Datasets), save that as .vtu";
const MULTIBLOCK: &str =
    "a list of blocks, which Halite cannot read; merge them (in ParaView: Merge Blocks), save that as .vtu";

/// Reads a mesh: the file's grid as it is, nothing welded, dropped or repaired. `progress` is told the share of the
/// work that is done, in [0, 1], never less than before.
///
/// The content decides: `.vtu` XML of every data mode, uncompressed or packed, or a legacy `.vtk` file. Several pieces
/// become one mesh, with the arrays that all pieces with points (or cells) have: of one number type if they agree, as
/// f64 if not. Arrays of strings, and field data, are left out. The work is done in the current rayon pool.
///
/// # Errors
/// [`Error::File`], [`Error::Malformed`] or [`Error::Unsupported`], naming the file and the place in it.
pub fn open(path: &Path, progress: &(dyn Fn(f64) + Sync)) -> Result<Mesh> {
    let mut file = File::open(path).map_err(|e| Error::file(path, e))?;
    let mut start = Vec::new();
    (&mut file).take(1024).read_to_end(&mut start).map_err(|e| Error::file(path, e))?;
    let text = start.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&start).trim_ascii_start();
    progress(0.0);
    let mesh = if text.first() == Some(&b'<') {
        vtu::read(path, progress)?
    } else if text.get(..14).is_some_and(|tag| tag.eq_ignore_ascii_case(b"# vtk DataFile")) {
        legacy::read(path, &mut file)?
    } else {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let known = REFUSED.iter().find(|known| known.0 == extension);
        return Err(match known {
            _ if start.is_empty() => Error::malformed(path, "the file is empty"),
            Some((_, _, what)) => Error::unsupported(path, format!("this is {what}")),
            None => {
                let what =
                    "this is neither a VTK XML file (.vtu) nor a legacy VTK file (.vtk), and Halite reads no others";
                Error::malformed(path, what)
            }
        });
    };
    progress(1.0);
    Ok(mesh)
}

/// [`Error::Unsupported`] for a kind of data set that is not an unstructured grid.
fn refuse(path: &Path, kind: &str) -> Error {
    let known = REFUSED.iter().find(|known| known.1.eq_ignore_ascii_case(kind));
    let what = known.map_or("a kind that Halite does not read; it reads unstructured grids (.vtu)", |known| known.2);
    Error::unsupported(path, format!("it holds \"{}\": {what}", kind.escape_debug()))
}

/// A mesh of parts that were read from a file: if they contradict each other, the file is to blame.
fn validated(path: &Path, mesh: Result<Mesh>) -> Result<Mesh> {
    mesh.map_err(|error| match error {
        Error::Mesh(what) => Error::malformed(path, what),
        other => other,
    })
}
