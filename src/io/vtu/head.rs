//! The head of a file: which pieces and arrays it has, and where.

use crate::error::{Error, Result};
use crate::io::data::{Appended, Data, DataArray, Store};
use crate::io::number::Kind;
use crate::io::refuse;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicU64;

/// The elements of a piece that hold data arrays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Section {
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

    pub(super) fn name(self) -> &'static str {
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
pub(super) struct Piece {
    /// Which file it is in.
    pub(super) store: usize,
    pub(super) points: u64,
    pub(super) cells: u64,
    /// Lagrange hexahedra are numbered as before VTK 9.
    pub(super) old_numbering: bool,
    /// The arrays of each section.
    arrays: [Vec<DataArray>; 4],
}

impl Piece {
    /// An array that describes cells.
    pub(super) fn find(&self, name: &str) -> Option<&DataArray> {
        self.arrays(Section::Cells).iter().find(|array| array.name == name)
    }

    pub(super) fn arrays(&self, section: Section) -> &[DataArray] {
        &self.arrays[section as usize]
    }

    /// The tuples that each array of point or cell data must have.
    pub(super) fn tuples(&self, section: Section) -> u64 {
        if matches!(section, Section::PointData | Section::Points) { self.points } else { self.cells }
    }

    /// About how many numbers it has.
    pub(super) fn expected(&self) -> f64 {
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
pub(super) struct Head {
    pub(super) store: Store,
    pub(super) pieces: Vec<Piece>,
    open: Vec<Element>,
    /// Whether it lists files, and which.
    pub(super) is_list: bool,
    pub(super) sources: Vec<PathBuf>,
    /// Lagrange hexahedra are numbered as before VTK 9.
    old_numbering: bool,
}

impl Head {
    /// Reads the XML up to the appended data, and skips the text of all elements.
    pub(super) fn read(path: &Path) -> Result<Self> {
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

/// Bytes that a tag or comment may have. It is kept in memory as a whole: without its end, that would be the rest of
/// the file.
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
