//! The head of a .vtu file: which pieces and arrays it has, and where. Then: pieces to one mesh.

use super::data::{Appended, Data, DataArray, Store};
use super::number::{Kind, Number, with_kind};
use super::{Progress, refuse, validated};
use crate::error::{Error, Result};
use crate::mesh::{Array, Cells, Mesh, POLYHEDRON, Polyhedra};
use glam::DVec3;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use rayon::prelude::*;
use std::collections::{BTreeSet, HashMap};
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::AtomicU64;

/// Reads the unstructured grid in a VTK XML file, or in the files that it lists.
pub(super) fn read(path: &Path, tell: &(dyn Fn(f64) + Sync)) -> Result<Mesh> {
    let head = Head::read(path)?;
    let mut files = vec![];
    if head.is_list {
        let folder = path.parent().unwrap_or(Path::new(""));
        for source in &head.sources {
            let piece = folder.join(source);
            let missing = |e: std::io::Error| {
                let what = format!("it lists {}, which cannot be read: {e}", piece.display());
                Error::malformed(path, what)
            };
            File::open(&piece).map_err(missing)?;
            let head = Head::read(&piece)?;
            if head.is_list {
                return Err(Error::malformed(path, format!("it lists {}, which is a list itself", piece.display())));
            }
            files.push(head);
        }
    } else {
        files.push(head);
    }
    let (mut stores, mut pieces) = (vec![], vec![]);
    for file in files {
        pieces.extend(file.pieces.into_iter().map(|piece| Piece { store: stores.len(), ..piece }));
        stores.push(file.store);
    }
    let expected = pieces.iter().map(Piece::expected).sum::<f64>().max(1.0);
    let progress = Progress { tell, expected, done: Mutex::new(0) };
    Grid { path, stores, pieces, progress }.mesh()
}

/// The elements of a piece that hold data arrays.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Section {
    PointData,
    CellData,
    Points,
    /// `connectivity`, `offsets`, `types`, and what further arrays describe cells.
    Cells,
}

impl Section {
    fn from_name(name: &str) -> Option<Section> {
        [Section::PointData, Section::CellData, Section::Points, Section::Cells].into_iter().find(|s| s.name() == name)
    }

    fn name(self) -> &'static str {
        match self {
            Section::PointData => "PointData",
            Section::CellData => "CellData",
            Section::Points => "Points",
            Section::Cells => "Cells",
        }
    }
}

/// A piece of the grid as the head describes it.
#[derive(Debug, Default)]
struct Piece {
    /// Which file it is in.
    store: usize,
    points: u64,
    cells: u64,
    /// Lagrange hexahedra are numbered as before VTK 9.
    old_numbering: bool,
    /// The arrays of each section.
    arrays: [Vec<DataArray>; 4],
}

impl Piece {
    /// An array that describes cells.
    fn find(&self, name: &str) -> Option<&DataArray> {
        self.arrays(Section::Cells).iter().find(|array| array.name == name)
    }

    fn arrays(&self, section: Section) -> &[DataArray] {
        &self.arrays[section as usize]
    }

    /// The tuples that each array of point or cell data must have.
    fn tuples(&self, section: Section) -> u64 {
        if matches!(section, Section::PointData | Section::Points) { self.points } else { self.cells }
    }

    /// About how many numbers it has.
    fn expected(&self) -> f64 {
        let numbers = |section| {
            let components: f64 = self.arrays(section).iter().map(|a| a.components as f64).sum();
            components * self.tuples(section) as f64
        };
        numbers(Section::PointData) + numbers(Section::CellData) + numbers(Section::Points) + 6.0 * self.cells as f64
    }
}

/// Elements that are open while the head is read.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Element {
    File,
    Grid,
    Piece,
    Section(Section),
    /// A data array that is read.
    Array(Section),
    /// The grid of a file that lists others.
    List,
    Other,
}

/// The state of reading the head of a file.
struct Head {
    store: Store,
    pieces: Vec<Piece>,
    open: Vec<Element>,
    /// Whether it lists files, and which.
    is_list: bool,
    sources: Vec<PathBuf>,
    /// Lagrange hexahedra are numbered as before VTK 9.
    old_numbering: bool,
}

impl Head {
    /// Reads the XML up to the appended data, and skips the text of all elements.
    fn read(path: &Path) -> Result<Self> {
        let file = File::open(path).map_err(|e| Error::file(path, e))?;
        let length = file.metadata().map_err(|e| Error::file(path, e))?.len();
        let store = Store {
            path: path.to_owned(),
            length,
            big_endian: false,
            word: 4,
            compressor: None,
            appended: None,
            used: AtomicU64::new(0),
        };
        let mut head = Head {
            store,
            pieces: Vec::new(),
            open: Vec::new(),
            is_list: false,
            sources: Vec::new(),
            old_numbering: false,
        };
        let inner = BufReader::with_capacity((length as usize).clamp(1 << 10, 1 << 18), file);
        let mut reader = Reader::from_reader(Limited { inner, left: MOST_OF_A_TAG });
        let mut buffer = Vec::new();
        loop {
            buffer.clear();
            reader.get_mut().left = MOST_OF_A_TAG;
            let event = reader.read_event_into(&mut buffer).map_err(|e| head.malformed(format!("XML: {e}")))?;
            match event {
                Event::Start(tag)
                    if tag.name().as_ref() == "AppendedData" && head.open.last() == Some(&Element::File) =>
                {
                    let base64 = head.attribute(&tag, "encoding")?.as_deref() != Some("raw");
                    let start = underscore(&mut reader.get_mut().inner).map_err(|e| Error::file(path, e))?;
                    let start =
                        start.ok_or_else(|| head.malformed("<AppendedData> does not start with an underscore"))?;
                    head.store.appended = Some(Appended { start, base64 });
                    break;
                }
                Event::Start(tag) => {
                    let element = head.element(&tag)?;
                    head.open.push(element);
                }
                Event::Empty(tag) => {
                    head.element(&tag)?;
                }
                Event::End(_) => {
                    head.open.pop();
                }
                Event::Eof if head.open.is_empty() => break,
                Event::Eof => return Err(head.malformed("the file ends before its XML does: it was cut short")),
                _ => {}
            }
            let text = skip_text(&mut reader.get_mut().inner).map_err(|e| Error::file(path, e))?;
            if let Some(Element::Array(section)) = head.open.last() {
                head.add_text(*section, text);
            }
        }
        if head.pieces.is_empty() && head.sources.is_empty() {
            return Err(head.malformed("there is no <Piece> in it"));
        }
        Ok(head)
    }

    fn malformed(&self, what: impl Into<String>) -> Error {
        Error::malformed(&self.store.path, what)
    }

    /// Takes in what a tag says.
    fn element(&mut self, tag: &BytesStart<'_>) -> Result<Element> {
        let name = tag.name();
        let parent = self.open.last().copied();
        Ok(match (parent, name.as_ref()) {
            (None, "VTKFile") => self.root(tag)?,
            (None, other) => {
                let other = other.escape_debug();
                return Err(self.malformed(format!("this is no VTK file: its first element is <{other}>")));
            }
            (Some(Element::File), "UnstructuredGrid") if !self.is_list => Element::Grid,
            (Some(Element::File), "PUnstructuredGrid") if self.is_list => Element::List,
            (Some(Element::List), "Piece") => {
                let source = self.attribute(tag, "Source")?;
                let source = source.ok_or_else(|| self.malformed("a <Piece> has no Source"))?;
                self.sources.push(source.into());
                Element::Other
            }
            (Some(Element::Grid), "Piece") => {
                let piece = Piece {
                    points: self.count(tag, "NumberOfPoints")?,
                    cells: self.count(tag, "NumberOfCells")?,
                    old_numbering: self.old_numbering,
                    ..Piece::default()
                };
                self.pieces.push(piece);
                Element::Piece
            }
            (Some(Element::Piece), name) if Section::from_name(name).is_some() => {
                Section::from_name(name).map_or(Element::Other, Element::Section)
            }
            (Some(Element::Section(section)), "DataArray") => self.array(section, tag)?,
            _ => Element::Other,
        })
    }

    fn root(&mut self, tag: &BytesStart<'_>) -> Result<Element> {
        let kind = self.attribute(tag, "type")?.unwrap_or_default();
        self.is_list = kind == "PUnstructuredGrid";
        if kind != "UnstructuredGrid" && !self.is_list {
            return Err(refuse(&self.store.path, &kind));
        }
        let version = self.attribute(tag, "version")?.unwrap_or_default();
        let (major, minor) = version.split_once('.').unwrap_or((&version, "0"));
        let number = |text: &str| text.trim().parse::<u32>().unwrap_or(0);
        self.old_numbering = (number(major), number(minor)) < (2, 1);
        let one_of = |head: &Self, name: &str, first: &str, second: &str| -> Result<bool> {
            match head.attribute(tag, name)? {
                Some(value) if value == second => Ok(true),
                Some(value) if value != first => {
                    Err(head.malformed(format!("{name} is \"{}\", not {first} or {second}", value.escape_debug())))
                }
                _ => Ok(false),
            }
        };
        self.store.big_endian = one_of(self, "byte_order", "LittleEndian", "BigEndian")?;
        self.store.word = if one_of(self, "header_type", "UInt32", "UInt64")? { 8 } else { 4 };
        self.store.compressor = self.attribute(tag, "compressor")?.filter(|name| !name.is_empty());
        Ok(Element::File)
    }

    /// Notes a data array.
    fn array(&mut self, section: Section, tag: &BytesStart<'_>) -> Result<Element> {
        let name = self.attribute(tag, "Name")?.unwrap_or_default();
        let fail =
            |what: String| self.malformed(format!("{} array \"{}\": {what}", section.name(), name.escape_debug()));
        let kind = self.attribute(tag, "type")?.unwrap_or_default();
        if kind == "String" {
            tracing::warn!(
                "{}: {} array \"{name}\" is left out: its type is {kind}",
                self.store.path.display(),
                section.name()
            );
            return Ok(Element::Other);
        }
        let bits = kind == "Bit";
        let kind = Kind::from_name(if bits { "UInt8" } else { &kind })
            .ok_or_else(|| fail(format!("its type is \"{}\"", kind.escape_debug())))?;
        let components = match self.attribute(tag, "NumberOfComponents")?.filter(|text| !text.is_empty()) {
            Some(text) => {
                let components = text.trim().parse::<u32>();
                components.map_err(|_| fail(format!("NumberOfComponents is \"{}\"", text.escape_debug())))?.max(1)
            }
            None if section == Section::Points => 3,
            None => 1,
        };
        let offset = self.attribute(tag, "offset")?;
        let data = match self.attribute(tag, "format")?.as_deref() {
            Some("appended") | None if offset.is_some() => {
                let offset = offset.unwrap_or_default();
                let parsed = offset.trim().parse();
                Data::Appended(parsed.map_err(|_| fail(format!("its offset is \"{}\"", offset.escape_debug())))?)
            }
            Some("appended") => return Err(fail("it is appended, but has no offset".to_owned())),
            Some("ascii") | None => Data::Ascii(Vec::new()),
            Some("binary") => Data::Base64(Vec::new()),
            Some(other) => return Err(fail(format!("its format is \"{}\"", other.escape_debug()))),
        };
        if let Some(piece) = self.pieces.len().checked_sub(1) {
            // In text each has a number of its own.
            let bits = bits && !matches!(data, Data::Ascii(_));
            let components = components as usize;
            let array = DataArray { section: section.name(), piece, name, kind, bits, components, data };
            self.pieces[piece].arrays[section as usize].push(array);
        }
        Ok(Element::Array(section))
    }

    /// Notes where text of the newest array is.
    fn add_text(&mut self, section: Section, text: Range<u64>) {
        let array = self.pieces.last_mut().and_then(|piece| piece.arrays[section as usize].last_mut());
        if let Some(DataArray { data: Data::Ascii(ranges) | Data::Base64(ranges), .. }) = array
            && !text.is_empty()
        {
            ranges.push(text);
        }
    }

    fn count(&self, tag: &BytesStart<'_>, name: &str) -> Result<u64> {
        let value = self.attribute(tag, name)?.ok_or_else(|| self.malformed(format!("a <Piece> has no {name}")))?;
        value.trim().parse().map_err(|_| self.malformed(format!("{name} is \"{}\", not a count", value.escape_debug())))
    }

    fn attribute(&self, tag: &BytesStart<'_>, name: &str) -> Result<Option<String>> {
        let found = tag.try_get_attribute(name).map_err(|e| self.malformed(format!("XML: {e}")))?;
        // VTK writes names with a bare `&`: what cannot be unescaped is taken as it is.
        Ok(found.map(|found| match quick_xml::escape::unescape(&found.value) {
            Ok(value) => value.into_owned(),
            Err(_) => found.value.into_owned(),
        }))
    }
}

/// Bytes that a tag or comment may have. It is kept in memory as a whole: without its end, that would be the rest of the file.
const MOST_OF_A_TAG: usize = 1 << 16;

/// A file of which so many bytes may be taken.
struct Limited {
    inner: BufReader<File>,
    left: usize,
}

impl Read for Limited {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        let found = self.fill_buf()?;
        let n = found.len().min(out.len());
        out[..n].copy_from_slice(&found[..n]);
        self.consume(n);
        Ok(n)
    }
}

impl BufRead for Limited {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        if self.left == 0 {
            return Err(std::io::Error::other(format!("a tag has more than {MOST_OF_A_TAG} bytes")));
        }
        let found = self.inner.fill_buf()?;
        Ok(&found[..found.len().min(self.left)])
    }

    fn consume(&mut self, bytes: usize) {
        self.left = self.left.saturating_sub(bytes);
        self.inner.consume(bytes);
    }
}

/// Skips to the next tag without looking at the text, which may be most of the file. Returns where it is.
fn skip_text(input: &mut (impl BufRead + Seek)) -> std::io::Result<Range<u64>> {
    let start = input.stream_position()?;
    let mut end = start;
    loop {
        let bytes = input.fill_buf()?;
        let found = bytes.iter().position(|b| *b == b'<');
        let skipped = found.unwrap_or(bytes.len());
        input.consume(skipped);
        end += skipped as u64;
        if found.is_some() || skipped == 0 {
            return Ok(start..end);
        }
    }
}

/// Skips the underscore before the appended data, and returns the position after it. What follows need not be text.
fn underscore(input: &mut (impl BufRead + Seek)) -> std::io::Result<Option<u64>> {
    loop {
        match input.fill_buf()?.first() {
            Some(b'_') => {
                input.consume(1);
                return input.stream_position().map(Some);
            }
            Some(byte) if byte.is_ascii_whitespace() => input.consume(1),
            _ => return Ok(None),
        }
    }
}

/// A grid whose head has been read.
struct Grid<'a> {
    path: &'a Path,
    stores: Vec<Store>,
    pieces: Vec<Piece>,
    progress: Progress<'a>,
}

/// The cells of a piece. Offsets and all other lists are as in the file, without the 0 in front.
#[derive(Default)]
struct Topology {
    cells: Cells,
    polyhedra: Option<Polyhedra>,
}

impl Grid<'_> {
    /// Reads the arrays, and makes one mesh of all pieces.
    fn mesh(&self) -> Result<Mesh> {
        let points = self.pieces.iter().fold(0u64, |sum, piece| sum.saturating_add(piece.points));
        if points >= u64::from(u32::MAX) {
            let what = format!("{points} points are more than Halite can index (2^32 - 2)");
            return Err(Error::unsupported(self.path, what));
        }
        let data = || rayon::join(|| self.data(Section::PointData), || self.data(Section::CellData));
        let (topology, (points, (point_arrays, cell_arrays))) =
            rayon::join(|| self.topology(), || rayon::join(|| self.points(), data));
        let (points, Topology { cells, polyhedra }) = (points?, topology?);
        let mesh = Mesh::new(points, cells, point_arrays?, cell_arrays?);
        let mesh = mesh.and_then(|mesh| match polyhedra {
            Some(polyhedra) => mesh.with_polyhedra(polyhedra),
            None => Ok(mesh),
        });
        validated(self.path, mesh)
    }

    fn store(&self, piece: &Piece) -> &Store {
        &self.stores[piece.store]
    }

    fn malformed(&self, piece: &Piece, what: impl Into<String>) -> Error {
        Error::malformed(&self.store(piece).path, what)
    }

    fn points(&self) -> Result<Vec<DVec3>> {
        let read = |(i, piece): (usize, &Piece)| {
            let fail = |what: &str| self.malformed(piece, format!("the Points of piece {i} {what}"));
            match piece.arrays(Section::Points).first() {
                None if piece.points == 0 => Ok(Vec::new()),
                None => Err(fail("are missing")),
                Some(array) if array.components != 3 => {
                    Err(fail(&format!("have {} components, not 3", array.components)))
                }
                Some(array) => self.floats(piece, array, piece.points),
            }
        };
        let parts = self.pieces.par_iter().enumerate().map(read).collect::<Result<Vec<_>>>()?;
        Ok(joined(parts).par_chunks_exact(3).map(DVec3::from_slice).collect())
    }

    fn topology(&self) -> Result<Topology> {
        let bases = self.pieces.iter().scan(0, |base, piece| {
            *base += piece.points;
            Some(*base - piece.points)
        });
        let pieces: Vec<(u64, &Piece)> = bases.zip(&self.pieces).collect();
        let read = |(i, (base, piece)): (usize, &(u64, &Piece))| self.topology_of(i, piece, *base);
        let parts = pieces.par_iter().enumerate().map(read).collect::<Result<Vec<_>>>()?;
        let has_polyhedra = parts.iter().any(|part| part.polyhedra.is_some());
        let (mut types, mut connectivity, mut offsets) = (vec![], vec![], vec![]);
        let (mut of_cells, mut faces, mut points) = (vec![], vec![], vec![]);
        for Topology { cells, polyhedra } in parts {
            let n = cells.types.len();
            types.push(cells.types);
            connectivity.push(cells.connectivity);
            append(&mut offsets, cells.offsets);
            if has_polyhedra {
                let polyhedra = polyhedra.unwrap_or_default();
                append(&mut of_cells, if polyhedra.cells.is_empty() { vec![0; n] } else { polyhedra.cells });
                append(&mut faces, polyhedra.faces);
                points.push(polyhedra.points);
            }
        }
        let closed = |mut list: Vec<u64>| {
            if list.is_empty() {
                list.push(0);
            }
            list
        };
        let polyhedra = Polyhedra { cells: closed(of_cells), faces: closed(faces), points: joined(points) };
        let cells = Cells { types: joined(types), offsets: closed(offsets), connectivity: joined(connectivity) };
        Ok(Topology { cells, polyhedra: has_polyhedra.then_some(polyhedra) })
    }

    /// The cells of piece `i`, whose points come after `base` others.
    fn topology_of(&self, i: usize, piece: &Piece, base: u64) -> Result<Topology> {
        if piece.cells == 0 {
            return Ok(Topology::default());
        }
        let find = |name: &str| {
            let found = piece.find(name);
            found.ok_or_else(|| self.malformed(piece, format!("the Cells of piece {i} have no array \"{name}\"")))
        };
        let (offsets, types, connectivity) = (find("offsets")?, find("types")?, find("connectivity")?);
        let offsets = self.indices(piece, offsets, Some(piece.cells), Some, |cell, _| {
            format!("the offset of cell {cell} is not a whole number from 0 up")
        })?;
        let narrow = |kind| u8::try_from(kind).ok();
        let types = self.indices(piece, types, Some(piece.cells), narrow, |cell, _| {
            format!("the type of cell {cell} is not in 0..=255")
        })?;
        let length = offsets.last().copied().unwrap_or_default();
        let shift = |point| (point < piece.points).then(|| (base + point) as u32);
        let mut connectivity = self.indices(piece, connectivity, Some(length), shift, |entry, point| {
            let cell = offsets.partition_point(|end| *end <= entry as u64);
            format!("cell {cell} names {}, but there are {} points", told(point), piece.points)
        })?;
        if piece.old_numbering && offsets.is_sorted() && length == connectivity.len() as u64 {
            renumber(&[72], &types, &offsets, &mut connectivity);
        }
        let polyhedra = if types.contains(&POLYHEDRON) { self.polyhedra_of(piece, &types, base)? } else { None };
        Ok(Topology { cells: Cells { types, offsets, connectivity }, polyhedra })
    }

    /// The faces of a piece's polyhedra, if it has any: in the layout of VTK 9.4, or in that before.
    fn polyhedra_of(&self, piece: &Piece, types: &[u8], base: u64) -> Result<Option<Polyhedra>> {
        let point = |point| (point < piece.points).then(|| (base + point) as u32);
        let no_point =
            |face: &str, p: Option<u64>| format!("{face} names {}, but there are {} points", told(p), piece.points);
        let no_index = |_: usize, _: Option<u64>| "an entry is not a whole number from 0 up".to_owned();
        if let (Some(points), Some(faces), Some(lists), Some(cells)) = (
            piece.find("face_connectivity"),
            piece.find("face_offsets"),
            piece.find("polyhedron_to_faces"),
            piece.find("polyhedron_offsets"),
        ) {
            let cells = self.indices(piece, cells, Some(piece.cells), Some, no_index)?;
            let lists = self.indices(piece, lists, None, Some, no_index)?;
            let ends = self.indices(piece, faces, None, Some, no_index)?;
            let points = self.indices(piece, points, None, point, |i, p| {
                no_point(&format!("face {}", ends.partition_point(|end| *end <= i as u64)), p)
            })?;
            let fits =
                |ends: &[u64], length: usize| ends.is_sorted() && ends.last().is_none_or(|end| *end <= length as u64);
            if !fits(&cells, lists.len()) || !fits(&ends, points.len()) {
                return Err(self.malformed(piece, "the lists of the polyhedra's faces do not fit together"));
            }
            let mut polyhedra = Polyhedra::default();
            let mut start = 0;
            for (cell, end) in cells.iter().enumerate() {
                for face in &lists[start as usize..*end as usize] {
                    let Some(end) = ends.get(*face as usize).filter(|_| *face < ends.len() as u64) else {
                        let what = format!("polyhedron {cell} names face {face}, but there are {} faces", ends.len());
                        return Err(self.malformed(piece, what));
                    };
                    let from = if *face == 0 { 0 } else { ends[*face as usize - 1] };
                    polyhedra.points.extend_from_slice(&points[from as usize..*end as usize]);
                    // A face has two sides: what is named far more often makes much of little.
                    if polyhedra.points.len() > 8 * points.len() {
                        let what =
                            format!("by polyhedron {cell} its faces are named 8 times each, but a face has two sides");
                        return Err(self.malformed(piece, what));
                    }
                    polyhedra.faces.push(polyhedra.points.len() as u64);
                }
                start = *end;
                polyhedra.cells.push(polyhedra.faces.len() as u64);
            }
            return Ok(Some(polyhedra));
        }
        let (Some(stream), Some(ends)) = (piece.find("faces"), piece.find("faceoffsets")) else {
            return Err(self.malformed(piece, "it has polyhedra, but no arrays that tell their faces"));
        };
        // Where the faces of each polyhedron end in the stream; −1 for other cells.
        let ends = self.signed(piece, ends, piece.cells)?;
        let stream = self.indices(piece, stream, None, Some, no_index)?;
        let mut polyhedra = Polyhedra::default();
        let mut at = 0;
        for (cell, end) in ends.iter().enumerate() {
            if let (Ok(end), true) = (usize::try_from(*end), types[cell] == POLYHEDRON) {
                let short =
                    || self.malformed(piece, format!("the faces of polyhedron {cell} do not fit its offset {end}"));
                // The number of faces; for each, the number of its points, and these.
                let mut rest = stream.get(at..end).ok_or_else(short)?;
                let mut count = *rest.split_off_first().ok_or_else(short)?;
                while count > 0 {
                    let n = usize::try_from(*rest.split_off_first().ok_or_else(short)?).map_err(|_| short())?;
                    for p in rest.split_off(..n).ok_or_else(short)? {
                        let p = point(*p)
                            .ok_or_else(|| self.malformed(piece, no_point(&format!("polyhedron {cell}"), Some(*p))))?;
                        polyhedra.points.push(p);
                    }
                    polyhedra.faces.push(polyhedra.points.len() as u64);
                    count -= 1;
                }
                at = end;
            }
            polyhedra.cells.push(polyhedra.faces.len() as u64);
        }
        Ok(Some(polyhedra))
    }

    /// Reads indices of any number type, all that there are or so many. `check` turns each into what is kept, or `explain` says what
    /// is wrong with it: it gets the place of the number, and its value if it is a whole number from 0 up.
    fn indices<U: bytemuck::Pod>(
        &self,
        piece: &Piece,
        array: &DataArray,
        count: Option<u64>,
        check: impl Fn(u64) -> Option<U> + Sync,
        explain: impl Fn(usize, Option<u64>) -> String + Sync,
    ) -> Result<Vec<U>> {
        let contents = self.store(piece).array(array)?;
        let count = count.unwrap_or_else(|| contents.count());
        contents.read(count, &self.progress, &|first, numbers, out| {
            let mut out = bytemuck::cast_slice_mut::<u8, U>(out).iter_mut();
            with_kind!(array.kind, T => for (i, number) in bytemuck::cast_slice::<u8, T>(numbers).iter().enumerate() {
                let index = number.index();
                let kept = index.and_then(&check).ok_or_else(|| explain(first + i, index))?;
                if let Some(out) = out.next() {
                    *out = kept;
                }
            });
            Ok(())
        })
    }

    /// Reads numbers of any type as i64; those that are none are −1.
    fn signed(&self, piece: &Piece, array: &DataArray, count: u64) -> Result<Vec<i64>> {
        self.store(piece).array(array)?.read(count, &self.progress, &|_, numbers, out| {
            let out = bytemuck::cast_slice_mut::<u8, i64>(out);
            with_kind!(array.kind, T => for (number, out) in bytemuck::cast_slice::<u8, T>(numbers).iter().zip(out) {
                *out = number.index().and_then(|i| i64::try_from(i).ok()).unwrap_or(-1);
            });
            Ok(())
        })
    }

    /// Reads numbers of any type as f64.
    fn floats(&self, piece: &Piece, array: &DataArray, tuples: u64) -> Result<Vec<f64>> {
        let count = tuples.saturating_mul(array.components as u64);
        self.store(piece).array(array)?.read(count, &self.progress, &|_, numbers, out| {
            let out = bytemuck::cast_slice_mut::<u8, f64>(out);
            with_kind!(array.kind, T => for (number, out) in bytemuck::cast_slice::<u8, T>(numbers).iter().zip(out) {
                *out = number.float();
            });
            Ok(())
        })
    }

    /// Reads bits, the highest of a byte first, as 0 and 1; numbers of another type as what a byte holds of them.
    fn bits(&self, piece: &Piece, array: &DataArray, tuples: u64) -> Result<Vec<u8>> {
        if !array.bits {
            return Ok(self.floats(piece, array, tuples)?.into_iter().map(|x| x as u8).collect());
        }
        let count = tuples.saturating_mul(array.components as u64);
        let bytes: Vec<u8> =
            self.store(piece).array(array)?.read(count.div_ceil(8), &self.progress, &|_, numbers, out| {
                out.copy_from_slice(numbers);
                Ok(())
            })?;
        Ok((0..count as usize).map(|i| bytes[i / 8] >> (7 - i % 8) & 1).collect::<Vec<u8>>())
    }

    /// The arrays of point or cell data that all pieces have, pieces with no points (or cells) aside.
    fn data(&self, section: Section) -> Result<Vec<Array>> {
        let filled: Vec<&Piece> = self.pieces.iter().filter(|piece| piece.tuples(section) > 0).collect();
        let filled = if filled.is_empty() { self.pieces.iter().take(1).collect() } else { filled };
        let found: Vec<HashMap<Key<'_>, &DataArray>> =
            filled.iter().map(|piece| keyed(piece.arrays(section)).collect()).collect();
        let mut lost: BTreeSet<Key<'_>> = found.iter().flat_map(|arrays| arrays.keys().copied()).collect();
        let mut kept = Vec::new();
        for (key, array) in filled.iter().take(1).flat_map(|piece| keyed(piece.arrays(section))) {
            let parts = filled.iter().zip(&found).map(|(piece, arrays)| {
                let part = arrays.get(&key).filter(|part| part.components == array.components)?;
                Some((*piece, *part))
            });
            if let Some(parts) = parts.collect::<Option<Vec<_>>>() {
                lost.remove(&key);
                kept.push(parts);
            }
        }
        if !lost.is_empty() {
            let names: Vec<&str> = lost.iter().map(|key| key.0).collect();
            tracing::warn!(
                "{}: {} arrays {names:?} are left out: not every piece has them, with as many components",
                self.path.display(),
                section.name()
            );
        }
        kept.par_iter().map(|parts| self.data_array(section, parts)).collect()
    }

    /// One array of its parts in the pieces.
    fn data_array(&self, section: Section, parts: &[(&Piece, &DataArray)]) -> Result<Array> {
        let Some((_, first)) = parts.first() else {
            return Err(Error::malformed(self.path, "no piece has arrays"));
        };
        let values = if parts.iter().any(|(_, part)| part.bits) {
            let bits = parts.iter().map(|(piece, part)| self.bits(piece, part, piece.tuples(section)));
            u8::values(joined(bits.collect::<Result<Vec<_>>>()?))
        } else if parts.iter().all(|(_, part)| part.kind == first.kind) {
            with_kind!(first.kind, T => {
                let read = |(piece, part): &(&Piece, &DataArray)| {
                    let count = piece.tuples(section).saturating_mul(part.components as u64);
                    self.store(piece).array(part)?.read(count, &self.progress, &|_, numbers, out| {
                        out.copy_from_slice(numbers);
                        Ok(())
                    })
                };
                T::values(joined(parts.iter().map(read).collect::<Result<Vec<_>>>()?))
            })
        } else {
            let (path, name) = (self.path.display(), &first.name);
            tracing::warn!(
                "{path}: {} array \"{name}\" is read as Float64: its type differs from piece to piece",
                first.section
            );
            let floats = parts.iter().map(|(piece, part)| self.floats(piece, part, piece.tuples(section)));
            f64::values(joined(floats.collect::<Result<Vec<_>>>()?))
        };
        Ok(Array { name: first.name.clone(), components: first.components, values })
    }
}

/// Appends the ends of lists to those before them, which start with 0.
fn append(all: &mut Vec<u64>, ends: Vec<u64>) {
    if all.is_empty() {
        *all = ends;
        all.insert(0, 0);
    } else {
        let base = all.last().copied().unwrap_or_default();
        all.extend(ends.iter().map(|end| base.saturating_add(*end)));
    }
}

fn told(point: Option<u64>) -> String {
    point.map_or("a negative point".to_owned(), |point| format!("point {point}"))
}

/// Hexahedra of these VTK types had, before VTK 9, the third and fourth of their upright edges the other way round.
pub(super) fn renumber(of: &[u8], types: &[u8], ends: &[u64], connectivity: &mut [u32]) {
    let mut start = 0;
    for (vtk_type, end) in types.iter().zip(ends) {
        let points = &mut connectivity[start..*end as usize];
        start = *end as usize;
        let degree = (2..=10).find(|p: &usize| (p + 1).pow(3) == points.len());
        if let (true, Some(degree)) = (of.contains(vtk_type), degree) {
            let (edge, upright) = (degree - 1, 8 + 8 * (degree - 1));
            let (third, fourth) = points[upright + 2 * edge..upright + 4 * edge].split_at_mut(edge);
            third.swap_with_slice(fourth);
        }
    }
}

/// What identifies an array in each piece: its name, and how many arrays of that name come before.
type Key<'a> = (&'a str, usize);

fn keyed(arrays: &[DataArray]) -> impl Iterator<Item = (Key<'_>, &DataArray)> {
    let mut seen = HashMap::new();
    arrays.iter().map(move |array| {
        let before = seen.entry(array.name.as_str()).or_insert(0);
        *before += 1;
        ((array.name.as_str(), *before), array)
    })
}

/// One vector of several, without a copy if there is only one.
fn joined<T: Copy>(mut parts: Vec<Vec<T>>) -> Vec<T> {
    if parts.len() == 1 { parts.swap_remove(0) } else { parts.concat() }
}
