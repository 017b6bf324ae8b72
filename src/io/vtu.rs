//! The head of a .vtu file: which pieces and arrays it has, and where. Then: pieces to one mesh.

use super::data::{Appended, Data, DataArray, Store};
use super::number::{Kind, Number, with_kind};
use super::{Progress, refuse, validated};
use crate::error::{Error, Result};
use crate::mesh::{Array, Cells, Mesh};
use glam::DVec3;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use rayon::prelude::*;
use std::collections::{BTreeSet, HashMap};
use std::fs::File;
use std::io::{BufRead, BufReader, Seek};
use std::ops::Range;
use std::path::Path;
use std::sync::Mutex;

/// Reads the unstructured grid in a VTK XML file.
pub(super) fn read(path: &Path, file: &mut File, tell: &(dyn Fn(f64) + Sync)) -> Result<Mesh> {
    let length = file.metadata().and_then(|metadata| file.rewind().map(|()| metadata.len()));
    let length = length.map_err(|e| Error::file(path, e))?;
    let (store, pieces) = Head::read(path, file, length)?;
    let expected = pieces.iter().map(Piece::expected).sum::<f64>().max(1.0);
    let progress = Progress { tell, expected, done: Mutex::new(0) };
    Grid { store, pieces, progress }.mesh()
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
    points: u64,
    cells: u64,
    /// The arrays of each section.
    arrays: [Vec<DataArray>; 4],
}

impl Piece {
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
    Other,
}

/// The state of reading the head of a file.
struct Head<'a> {
    store: Store<'a>,
    pieces: Vec<Piece>,
    open: Vec<Element>,
}

impl<'a> Head<'a> {
    /// Reads the XML up to the appended data, and skips the text of all elements.
    fn read(path: &'a Path, file: &'a File, length: u64) -> Result<(Store<'a>, Vec<Piece>)> {
        let store = Store { path, file, length, big_endian: false, word: 4, compressor: None, appended: None };
        let mut head = Head { store, pieces: Vec::new(), open: Vec::new() };
        let mut reader = Reader::from_reader(BufReader::with_capacity(1 << 18, file));
        let mut buffer = Vec::new();
        loop {
            buffer.clear();
            let event = reader.read_event_into(&mut buffer).map_err(|e| head.malformed(format!("XML: {e}")))?;
            match event {
                Event::Start(tag)
                    if tag.name().as_ref() == "AppendedData" && head.open.last() == Some(&Element::File) =>
                {
                    let base64 = head.attribute(&tag, "encoding")?.as_deref() != Some("raw");
                    let start = underscore(reader.get_mut()).map_err(|e| Error::file(path, e))?;
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
            let text = skip_text(reader.get_mut()).map_err(|e| Error::file(path, e))?;
            if let Some(Element::Array(section)) = head.open.last() {
                head.add_text(*section, text);
            }
        }
        if head.pieces.is_empty() {
            return Err(head.malformed("there is no <Piece> in it"));
        }
        Ok((head.store, head.pieces))
    }

    fn malformed(&self, what: impl Into<String>) -> Error {
        Error::malformed(self.store.path, what)
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
            (Some(Element::File), "UnstructuredGrid") => Element::Grid,
            (Some(Element::Grid), "Piece") => {
                let piece = Piece {
                    points: self.count(tag, "NumberOfPoints")?,
                    cells: self.count(tag, "NumberOfCells")?,
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
        if kind != "UnstructuredGrid" {
            return Err(refuse(self.store.path, &kind));
        }
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
        if kind == "String" || kind == "Bit" {
            tracing::warn!(
                "{}: {} array \"{name}\" is left out: its type is {kind}",
                self.store.path.display(),
                section.name()
            );
            return Ok(Element::Other);
        }
        let kind = Kind::from_name(&kind).ok_or_else(|| fail(format!("its type is \"{}\"", kind.escape_debug())))?;
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
            let array = DataArray { section: section.name(), piece, name, kind, components: components as usize, data };
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
    store: Store<'a>,
    pieces: Vec<Piece>,
    progress: Progress<'a>,
}

impl Grid<'_> {
    /// Reads the arrays, and makes one mesh of all pieces.
    fn mesh(&self) -> Result<Mesh> {
        let path = self.store.path;
        let points = self.pieces.iter().fold(0u64, |sum, piece| sum.saturating_add(piece.points));
        if points >= u64::from(u32::MAX) {
            return Err(Error::unsupported(path, format!("{points} points are more than Halite can index (2^32 - 2)")));
        }
        let data = || rayon::join(|| self.data(Section::PointData), || self.data(Section::CellData));
        let (cells, (points, (point_arrays, cell_arrays))) =
            rayon::join(|| self.cells(), || rayon::join(|| self.points(), data));
        validated(path, Mesh::new(points?, cells?, point_arrays?, cell_arrays?))
    }

    fn points(&self) -> Result<Vec<DVec3>> {
        let read = |(i, piece): (usize, &Piece)| {
            let fail = |what: &str| Error::malformed(self.store.path, format!("the Points of piece {i} {what}"));
            match piece.arrays(Section::Points).first() {
                None if piece.points == 0 => Ok(Vec::new()),
                None => Err(fail("are missing")),
                Some(array) if array.components != 3 => {
                    Err(fail(&format!("have {} components, not 3", array.components)))
                }
                Some(array) => self.floats(array, piece.points),
            }
        };
        let parts = self.pieces.par_iter().enumerate().map(read).collect::<Result<Vec<_>>>()?;
        Ok(joined(parts).par_chunks_exact(3).map(DVec3::from_slice).collect())
    }

    fn cells(&self) -> Result<Cells> {
        let bases = self.pieces.iter().scan(0, |base, piece| {
            *base += piece.points;
            Some(*base - piece.points)
        });
        let pieces: Vec<(u64, &Piece)> = bases.zip(&self.pieces).collect();
        let read = |(i, (base, piece)): (usize, &(u64, &Piece))| self.cells_of(i, piece, *base);
        let parts = pieces.par_iter().enumerate().map(read).collect::<Result<Vec<_>>>()?;
        let (mut types, mut connectivity, mut offsets) = (Vec::new(), Vec::new(), vec![]);
        for part in parts {
            types.push(part.types);
            connectivity.push(part.connectivity);
            if offsets.is_empty() {
                offsets = part.offsets;
                offsets.insert(0, 0);
            } else {
                let base = offsets.last().copied().unwrap_or_default();
                offsets.extend(part.offsets.iter().map(|end| base.saturating_add(*end)));
            }
        }
        Ok(Cells { types: joined(types), offsets, connectivity: joined(connectivity) })
    }

    /// The cells of piece `i`, whose points come after `base` others. Their offsets are the ends of cells, as in the file.
    fn cells_of(&self, i: usize, piece: &Piece, base: u64) -> Result<Cells> {
        if piece.cells == 0 {
            return Ok(Cells::default());
        }
        let find = |name: &str| {
            let found = piece.arrays(Section::Cells).iter().find(|array| array.name == name);
            found.ok_or_else(|| {
                Error::malformed(self.store.path, format!("the Cells of piece {i} have no array \"{name}\""))
            })
        };
        let (offsets, types, connectivity) = (find("offsets")?, find("types")?, find("connectivity")?);
        let offsets = self.indices(offsets, piece.cells, Some, |cell, _| {
            format!("the offset of cell {cell} is not a whole number from 0 up")
        })?;
        let narrow = |kind| u8::try_from(kind).ok();
        let types =
            self.indices(types, piece.cells, narrow, |cell, _| format!("the type of cell {cell} is not in 0..=255"))?;
        let length = offsets.last().copied().unwrap_or_default();
        let shift = |point| (point < piece.points).then(|| (base + point) as u32);
        let connectivity = self.indices(connectivity, length, shift, |entry, point| {
            let cell = offsets.partition_point(|end| *end <= entry as u64);
            let point = point.map_or("a negative point".to_owned(), |point| format!("point {point}"));
            format!("cell {cell} names {point}, but there are {} points", piece.points)
        })?;
        Ok(Cells { types, offsets, connectivity })
    }

    /// Reads indices of any number type. `check` turns each into what is kept, or `explain` says what is wrong with it: it gets
    /// the place of the number, and its value if it is a whole number from 0 up.
    fn indices<U: bytemuck::Pod + Send>(
        &self,
        array: &DataArray,
        count: u64,
        check: impl Fn(u64) -> Option<U> + Sync,
        explain: impl Fn(usize, Option<u64>) -> String + Sync,
    ) -> Result<Vec<U>> {
        with_kind!(array.kind, T => self.store.read(array, count, &self.progress, |first, numbers: &[T], out| {
            for (i, (number, out)) in numbers.iter().zip(out).enumerate() {
                let index = number.index();
                *out = index.and_then(&check).ok_or_else(|| explain(first + i, index))?;
            }
            Ok(())
        }))
    }

    /// Reads numbers of any type as f64.
    fn floats(&self, array: &DataArray, tuples: u64) -> Result<Vec<f64>> {
        let count = tuples.saturating_mul(array.components as u64);
        with_kind!(array.kind, T => self.store.read(array, count, &self.progress, |_, numbers: &[T], out| {
            numbers.iter().zip(out).for_each(|(number, out)| *out = number.float());
            Ok(())
        }))
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
                Some((piece.tuples(section), *part))
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
                self.store.path.display(),
                section.name()
            );
        }
        kept.par_iter().map(|parts| self.data_array(parts)).collect()
    }

    /// One array of its parts in the pieces, each with the tuples that it has there.
    fn data_array(&self, parts: &[(u64, &DataArray)]) -> Result<Array> {
        let Some((_, first)) = parts.first() else {
            return Err(Error::malformed(self.store.path, "no piece has arrays"));
        };
        let values = if parts.iter().all(|(_, part)| part.kind == first.kind) {
            with_kind!(first.kind, T => {
                let read = |(tuples, part): &(u64, &DataArray)| {
                    let count = tuples.saturating_mul(part.components as u64);
                    self.store.read(part, count, &self.progress, |_, numbers: &[T], out| {
                        out.copy_from_slice(numbers);
                        Ok(())
                    })
                };
                T::values(joined(parts.par_iter().map(read).collect::<Result<Vec<_>>>()?))
            })
        } else {
            let (path, name) = (self.store.path.display(), &first.name);
            tracing::warn!(
                "{path}: {} array \"{name}\" is read as Float64: its type differs from piece to piece",
                first.section
            );
            let floats = parts.par_iter().map(|(tuples, part)| self.floats(part, *tuples));
            f64::values(joined(floats.collect::<Result<Vec<_>>>()?))
        };
        Ok(Array { name: first.name.clone(), components: first.components, values })
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
