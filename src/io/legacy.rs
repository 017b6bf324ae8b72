//! Legacy .vtk files, versions 1 to 5.1, ascii or binary (VTK File Formats, "Simple Legacy Formats").
//!
//! vtkio parses them (`parsed`). What it cannot, or would lose, is scanned here: a file is a list of sections, each a
//! keyword, a line that says what follows, and arrays. Nothing is skipped that has no name: what is not known is an
//! error, as nobody could tell where it ends.

mod parsed;
mod scan;

use super::vtu::renumber;
use super::{refuse, validated};
use crate::error::{Error, Result};
use crate::mesh::{Array, Cells, Mesh, POLYHEDRON, Polyhedra, Values};
use glam::DVec3;
use scan::{Fault, Scanner, Type};
use std::fs::File;
use std::io::{Read, Seek};
use std::path::Path;

/// Reads the unstructured grid in a legacy file.
pub(super) fn read(path: &Path, file: &mut File) -> Result<Mesh> {
    let mut bytes = Vec::new();
    file.rewind().and_then(|()| file.read_to_end(&mut bytes)).map_err(|e| Error::file(path, e))?;
    let mut scanner = Scanner::new(&bytes);
    // "# vtk DataFile Version 4.2", a title, and how it is written.
    let version = scanner.line();
    let version: f64 = version.rsplit(' ').next().and_then(|word| word.parse().ok()).unwrap_or(1.0);
    scanner.line();
    scanner.binary = match scanner.line().to_ascii_uppercase().as_str() {
        "ASCII" => false,
        "BINARY" => true,
        other => {
            let what = format!("its third line is \"{}\", not ASCII or BINARY", other.escape_debug());
            return Err(Error::malformed(path, what));
        }
    };
    let kind = if scanner.pass("DATASET") { scanner.word("the kind of data set").ok() } else { None };
    match kind.map(|kind| kind.to_ascii_uppercase()).as_deref() {
        Some("UNSTRUCTURED_GRID") => {}
        Some("STRUCTURED_POINTS") => return Err(refuse(path, "ImageData")),
        Some("STRUCTURED_GRID") => return Err(refuse(path, "StructuredGrid")),
        Some("RECTILINEAR_GRID") => return Err(refuse(path, "RectilinearGrid")),
        Some("POLYDATA") => return Err(refuse(path, "PolyData")),
        Some(other) => return Err(refuse(path, other)),
        None => return Err(Error::malformed(path, "there is no data set in it")),
    }
    if let Some(parts) = Parts::parsed(&bytes) {
        return parts.mesh(path, version);
    }
    let mut parts = Parts::default();
    while !scanner.is_at_end() {
        let at = scanner.at();
        let mut section = "a section".to_owned();
        parts
            .section(&mut scanner, &mut section)
            .map_err(|what| Error::malformed(path, format!("{section}, at byte {at}: {what}")))?;
    }
    parts.mesh(path, version)
}

/// What was read so far.
#[derive(Default)]
struct Parts {
    points: Vec<DVec3>,
    offsets: Vec<u64>,
    connectivity: Vec<u32>,
    types: Vec<u8>,
    /// Of points and of cells.
    arrays: [Vec<Array>; 2],
    /// Which of these come now, and how many tuples they have.
    current: Option<(usize, usize)>,
}

impl Parts {
    /// Reads one section, and tells its name.
    fn section(&mut self, from: &mut Scanner<'_>, section: &mut String) -> Result<(), Fault> {
        let keyword = from.word("a keyword")?.to_ascii_uppercase();
        *section = if keyword.chars().all(|c| c.is_ascii_graphic()) && keyword.len() < 40 {
            keyword.clone()
        } else {
            "a section".into()
        };
        match keyword.as_str() {
            "POINTS" => {
                let count = from.count("the number of points")?;
                let kind = Type::from_name(&from.word("their type")?, from.binary)?;
                let values = from.values(kind, count.checked_mul(3))?.ok_or("they are strings")?;
                let coordinate = |i| values.get(i);
                self.points = (0..count).map(|p| DVec3::from_array([0, 1, 2].map(|i| coordinate(3 * p + i)))).collect();
            }
            "CELLS" => self.cells(from)?,
            "CELL_TYPES" => {
                let count = from.count("the number of cells")?;
                from.enter_numbers();
                let types = from.numbers::<i32>(count)?.into_iter().enumerate();
                let narrow = |(c, kind)| u8::try_from(kind).map_err(|_| format!("the type of cell {c} is {kind}"));
                self.types = types.map(narrow).collect::<Result<_, _>>()?;
            }
            "POINT_DATA" => self.current = Some((0, from.count("the number of points")?)),
            "CELL_DATA" => self.current = Some((1, from.count("the number of cells")?)),
            "FIELD" => {
                let name = from.word("its name")?;
                for _ in 0..from.count(&format!("the number of arrays of {name}"))? {
                    self.field(from, section)?;
                }
            }
            _ => self.attribute(from, &keyword, section)?,
        }
        from.pass_metadata();
        Ok(())
    }

    /// Cells: the number of points of each, and these; from version 5 on where each ends, and all points.
    fn cells(&mut self, from: &mut Scanner<'_>) -> Result<(), Fault> {
        let (count, size) = (from.count("the number of cells")?, from.count("the size of the list")?);
        if count == 0 {
            return Ok(());
        }
        if !from.pass("OFFSETS") {
            from.enter_numbers();
            let list = from.numbers::<i32>(size)?;
            // What is negative is out of range in any case.
            let list: Vec<u32> = list.into_iter().map(|n| u32::try_from(n).unwrap_or(u32::MAX)).collect();
            self.unpack(&list)?;
            return Ok(());
        }
        let list = |from: &mut Scanner<'_>, count| -> Result<Values, Fault> {
            let kind = Type::from_name(&from.word("the type of the list")?, from.binary)?;
            from.values(kind, Some(count))?.ok_or_else(|| "it is a list of strings".to_owned())
        };
        let offsets = list(from, count)?;
        if !from.pass("CONNECTIVITY") {
            return Err("no CONNECTIVITY follows".to_owned());
        }
        let points = list(from, size)?;
        // Exact to 2^53; what is negative is out of range, as is what is larger.
        let index = |x: f64| if x < 0.0 { u64::MAX } else { x as u64 };
        self.offsets = (0..offsets.len()).map(|i| index(offsets.get(i))).collect();
        let point = |i| u32::try_from(index(points.get(i))).unwrap_or(u32::MAX);
        self.connectivity = (0..points.len()).map(point).collect();
        Ok(())
    }

    /// Takes apart a list of cells: the number of points of each, and these.
    fn unpack(&mut self, list: &[u32]) -> Result<(), Fault> {
        let mut rest = list;
        self.offsets = vec![0];
        while let Some((own, after)) = rest.split_first() {
            let cell = self.offsets.len() - 1;
            let (points, after) = after
                .split_at_checked(*own as usize)
                .ok_or_else(|| format!("cell {cell} has more points than it lists"))?;
            self.connectivity.extend_from_slice(points);
            self.offsets.push(self.connectivity.len() as u64);
            rest = after;
        }
        Ok(())
    }

    /// One array of field data: its name, components, tuples and type. What comes before any point or cell data is of
    /// the file, and left out.
    fn field(&mut self, from: &mut Scanner<'_>, section: &mut String) -> Result<(), Fault> {
        let name = from.word("the name of an array")?;
        if name == "NULL_ARRAY" {
            return Ok(());
        }
        *section = format!("array \"{}\"", name.escape_debug());
        let (components, tuples) = (from.count("its number of components")?, from.count("its number of tuples")?);
        let kind = Type::from_name(&from.word("its type")?, from.binary)?;
        let values = from.values(kind, components.checked_mul(tuples))?;
        self.keep(&name, components, values);
        from.pass_metadata();
        Ok(())
    }

    /// An array of points or cells that says by its keyword what it is for.
    fn attribute(&mut self, from: &mut Scanner<'_>, keyword: &str, section: &mut String) -> Result<(), Fault> {
        let fixed = match keyword {
            "SCALARS" | "COLOR_SCALARS" | "TEXTURE_COORDINATES" | "LOOKUP_TABLE" => 0,
            "GLOBAL_IDS" | "PEDIGREE_IDS" | "EDGE_FLAGS" => 1,
            "VECTORS" | "NORMALS" | "TANGENTS" => 3,
            "TENSORS6" => 6,
            "TENSORS" => 9,
            _ => return Err("Halite does not know such a section".to_owned()),
        };
        let name = from.word("its name")?;
        *section = format!("array \"{}\"", name.escape_debug());
        let colors = Type::from_name(if from.binary { "unsigned_char" } else { "float" }, from.binary)?;
        if keyword == "LOOKUP_TABLE" {
            let size = from.count("its size")?;
            from.values(colors, size.checked_mul(4))?;
            return Ok(());
        }
        let Some((_, tuples)) = self.current else { return Err("it comes before POINT_DATA or CELL_DATA".to_owned()) };
        let (components, kind) = match keyword {
            "COLOR_SCALARS" => (from.count("its number of components")?, colors),
            "TEXTURE_COORDINATES" => {
                let components = from.count("its number of components")?;
                (components, Type::from_name(&from.word("its type")?, from.binary)?)
            }
            "SCALARS" => {
                let kind = Type::from_name(&from.word("its type")?, from.binary)?;
                // On the same line, or there is one; a table of colours may be named on the next.
                (from.count_on_line().unwrap_or(1), kind)
            }
            _ => (fixed, Type::from_name(&from.word("its type")?, from.binary)?),
        };
        if keyword == "SCALARS" {
            from.pass_table()?;
        }
        let mut values = from.values(kind, components.checked_mul(tuples))?;
        if let ("COLOR_SCALARS", Some(Values::F32(shares))) = (keyword, &values) {
            values = Some(Values::U8(shares.iter().map(|share| (share * 255.0).round() as u8).collect()));
        }
        self.keep(&name, components, values);
        Ok(())
    }

    fn keep(&mut self, name: &str, components: usize, values: Option<Values>) {
        match (values, self.current) {
            (Some(values), Some((of, _))) if components > 0 => {
                self.arrays[of].push(Array { name: decoded(name), components, values });
            }
            (None, Some(_)) => tracing::warn!("array \"{name}\" is left out: it is of strings"),
            _ => {}
        }
    }

    fn mesh(self, path: &Path, version: f64) -> Result<Mesh> {
        let Parts { points, mut offsets, mut connectivity, types, arrays: [of_points, of_cells], .. } = self;
        if offsets.is_empty() {
            offsets.push(0);
        }
        let fits = offsets.is_sorted() && offsets.last() == Some(&(connectivity.len() as u64));
        if version < 5.1 && fits && offsets.len() == types.len() + 1 {
            // From 5.1 on Lagrange hexahedra are numbered as now. VTK's reader takes Bézier hexahedra for such too.
            renumber(&[72, 79], &types, &offsets[1..], &mut connectivity);
        }
        let cells = Cells { types, offsets, connectivity };
        let (cells, polyhedra) = unfold(cells).map_err(|c| {
            let what = format!("the faces of polyhedron {c} do not fit the numbers that CELLS lists for it");
            Error::malformed(path, what)
        })?;
        let mesh = Mesh::new(points, cells, of_points, of_cells);
        validated(path, mesh.and_then(|mesh| if let Some(p) = polyhedra { mesh.with_polyhedra(p) } else { Ok(mesh) }))
    }
}

/// In these files a polyhedron has no points, but its faces: their number, and for each the number of its points, and
/// these. Takes them apart; the error is the cell for which that fails.
fn unfold(cells: Cells) -> Result<(Cells, Option<Polyhedra>), usize> {
    if !cells.types.contains(&POLYHEDRON) || cells.offsets.len() != cells.types.len() + 1 {
        return Ok((cells, None));
    }
    let (mut connectivity, mut offsets) = (Vec::new(), vec![0]);
    let mut polyhedra = Polyhedra { cells: vec![0], faces: vec![0], points: vec![] };
    for (c, &vtk_type) in cells.types.iter().enumerate() {
        let range = (cells.offsets[c] as usize)..(cells.offsets[c + 1] as usize);
        let mut rest = cells.connectivity.get(range).ok_or(c)?;
        if vtk_type == POLYHEDRON {
            let first = polyhedra.points.len();
            for _ in 0..*rest.split_off_first().ok_or(c)? {
                let n = *rest.split_off_first().ok_or(c)? as usize;
                polyhedra.points.extend_from_slice(rest.split_off(..n).ok_or(c)?);
                polyhedra.faces.push(polyhedra.points.len() as u64);
            }
            let mut own = polyhedra.points[first..].to_vec();
            own.sort_unstable();
            own.dedup();
            connectivity.extend(own);
        } else {
            connectivity.extend_from_slice(rest);
        }
        offsets.push(connectivity.len() as u64);
        polyhedra.cells.push(polyhedra.faces.len() as u64 - 1);
    }
    Ok((Cells { types: cells.types, offsets, connectivity }, Some(polyhedra)))
}

/// VTK writes the spaces and other odd characters of a name as `%20`.
fn decoded(name: &str) -> String {
    let mut bytes = Vec::with_capacity(name.len());
    let mut rest = name.as_bytes();
    while let Some((byte, after)) = rest.split_first() {
        let code = after.get(..2).and_then(|hex| u8::from_str_radix(std::str::from_utf8(hex).ok()?, 16).ok());
        match code {
            Some(code) if *byte == b'%' => {
                bytes.push(code);
                rest = &after[2..];
            }
            _ => {
                bytes.push(*byte);
                rest = after;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}
