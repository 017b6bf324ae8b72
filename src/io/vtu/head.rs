//! The head of a file: which pieces and arrays it has, and where.

use super::place::Kind;
use crate::error::{Error, Result};
use crate::grid::Lattice;
use crate::io::blocks::Block;
use crate::io::data::{Appended, Data, DataArray, Store};
use crate::io::input::{Input, Opened};
use crate::io::number::Kind as NumberKind;
use crate::io::refuse;
use crate::mesh::{Attributes, LeftOut, Role};
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use std::io::{BufRead, BufReader, Read, Seek};
use std::ops::Range;
use std::sync::atomic::AtomicU64;

/// The elements of a piece that hold data arrays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Section {
    PointData,
    CellData,
    Points,
    /// `connectivity`, `offsets`, `types`, and what further arrays describe cells.
    Cells,
    /// Those along each axis of a rectilinear grid.
    Coordinates,
}

impl Section {
    fn from_name(name: &str) -> Option<Section> {
        const ALL: [Section; 5] =
            [Section::PointData, Section::CellData, Section::Points, Section::Cells, Section::Coordinates];
        ALL.into_iter().find(|s| s.name() == name)
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Section::PointData => "PointData",
            Section::CellData => "CellData",
            Section::Points => "Points",
            Section::Cells => "Cells",
            Section::Coordinates => "Coordinates",
        }
    }

    /// Whether its arrays are data of points (0) or cells (1), without which the grid is still whole.
    fn of_data(self) -> Option<usize> {
        match self {
            Section::PointData => Some(0),
            Section::CellData => Some(1),
            _ => None,
        }
    }
}

/// A piece of the grid as the head describes it.
#[derive(Debug, Clone, Default)]
pub(super) struct Piece {
    /// Which file it is in.
    pub(super) store: usize,
    pub(super) points: u64,
    pub(super) cells: u64,
    /// Where it is in a grid that is not unstructured.
    pub(super) block: Option<Block>,
    /// Lagrange hexahedra are numbered as before VTK 9.
    pub(super) old_numbering: bool,
    /// The arrays of each section.
    pub(super) arrays: [Vec<DataArray>; 5],
}

impl Piece {
    /// An array that describes cells.
    pub(super) fn find(&self, name: &str) -> Option<&DataArray> {
        self.arrays(Section::Cells).iter().find(|array| array.name == name)
    }

    pub(super) fn arrays(&self, section: Section) -> &[DataArray] {
        &self.arrays[section as usize]
    }

    /// The piece at a time step: of the arrays that are given for some steps only those that are for this one, or the
    /// last ones before it.
    pub(super) fn at_step(&self, step: usize) -> Piece {
        let mut piece = self.clone();
        for (kept, all) in piece.arrays.iter_mut().zip(&self.arrays) {
            kept.retain(|array| {
                let last = |of: &DataArray| of.steps.iter().copied().filter(|s| *s <= step).max();
                let others = all.iter().filter(|other| other.name == array.name && !other.steps.is_empty());
                array.steps.is_empty() || (last(array).is_some() && last(array) == others.filter_map(last).max())
            });
        }
        piece
    }

    /// The steps that its arrays name.
    pub(super) fn steps(&self) -> impl Iterator<Item = usize> + '_ {
        self.arrays.iter().flatten().flat_map(|array| array.steps.iter().copied())
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
    /// The list of a `.pvd` file.
    Collection,
    Other,
}

/// A file of a collection.
#[derive(Debug)]
pub(super) struct Entry {
    /// None if it does not say.
    pub(super) time: Option<f64>,
    pub(super) file: String,
}

/// The state of reading the head of a file.
pub(super) struct Head {
    pub(super) store: Store,
    pub(super) pieces: Vec<Piece>,
    open: Vec<Element>,
    /// Whether it lists files, and which.
    pub(super) is_list: bool,
    pub(super) sources: Vec<String>,
    /// The files of a collection, if it is one.
    pub(super) collection: Option<Vec<Entry>>,
    /// The times of its steps, if it says them.
    pub(super) times: Vec<f64>,
    /// What it says of the arrays of points, and of cells.
    pub(super) attributes: [Attributes; 2],
    /// Lagrange hexahedra are numbered as before VTK 9.
    pub(super) old_numbering: bool,
    pub(super) kind: Kind,
    /// Where image data is.
    pub(super) lattice: Lattice,
    /// The whole of a grid that is not unstructured, which a piece is that says no extent.
    pub(super) whole: Option<Block>,
}

impl Head {
    /// Reads the XML up to the appended data, and skips the text of all elements.
    pub(super) fn read(input: &Input) -> Result<Self> {
        let path = &input.path;
        let file = input.open().map_err(|e| Error::file(path, e))?;
        let length = file.length().map_err(|e| Error::file(path, e))?;
        let store = Store {
            input: input.clone(),
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
            collection: None,
            times: Vec::new(),
            attributes: Default::default(),
            old_numbering: false,
            kind: Kind::default(),
            lattice: Lattice::default(),
            whole: None,
        };
        let inner = BufReader::with_capacity((length as usize).clamp(1 << 10, 1 << 16), file);
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
                    // Whatever follows is no part of the file.
                    if head.open.is_empty() {
                        break;
                    }
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
        if head.pieces.is_empty() && head.sources.is_empty() && head.collection.is_none() {
            return Err(head.malformed("there is no <Piece> in it"));
        }
        Ok(head)
    }

    pub(super) fn malformed(&self, what: impl Into<String>) -> Error {
        Error::malformed(&self.store.input.path, what)
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
            (Some(Element::File), name) if name == self.kind.name() && !self.is_list && self.collection.is_none() => {
                self.add_whole(tag)?;
                let times = self.attribute(tag, "TimeValues")?.unwrap_or_default();
                self.times = times.split_ascii_whitespace().map(|t| self.time(t)).collect::<Result<_>>()?;
                Element::Grid
            }
            (Some(Element::File), "Collection") if self.collection.is_some() => Element::Collection,
            (Some(Element::Collection), "DataSet") => {
                let time = self.attribute(tag, "timestep")?.filter(|time| !time.trim().is_empty());
                let time = time.map(|time| self.time(time.trim())).transpose()?;
                let file = self.attribute(tag, "file")?;
                let file = file.ok_or_else(|| self.malformed("a <DataSet> has no file"))?;
                self.collection.get_or_insert_default().push(Entry { time, file });
                Element::Other
            }
            (Some(Element::List), "PPointData" | "PCellData") => {
                self.add_roles(usize::from(name.as_ref() == "PCellData"), tag)?;
                Element::Other
            }
            (Some(Element::File), name) if self.is_list && name.strip_prefix('P') == Some(self.kind.name()) => {
                Element::List
            }
            (Some(Element::List), "Piece") => {
                let source = self.attribute(tag, "Source")?;
                let source = source.ok_or_else(|| self.malformed("a <Piece> has no Source"))?;
                self.sources.push(source);
                Element::Other
            }
            (Some(Element::Grid), "Piece") => {
                let piece = self.piece(tag)?;
                self.pieces.push(piece);
                Element::Piece
            }
            (Some(Element::Piece), name) => match Section::from_name(name) {
                Some(section) => {
                    section.of_data().map_or(Ok(()), |of| self.add_roles(of, tag))?;
                    Element::Section(section)
                }
                None => Element::Other,
            },
            (Some(Element::Section(section)), "DataArray") => self.array(section, tag)?,
            _ => Element::Other,
        })
    }

    fn root(&mut self, tag: &BytesStart<'_>) -> Result<Element> {
        let kind = self.attribute(tag, "type")?.unwrap_or_default();
        self.collection = (kind == "Collection").then(Vec::new);
        match Kind::from_type(&kind) {
            Some(found) => (self.kind, self.is_list) = found,
            None if self.collection.is_some() => {}
            None => return Err(refuse(&self.store.input.path, &kind)),
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

    /// Notes a data array. One of point or cell data that is not described as it must be is left out.
    fn array(&mut self, section: Section, tag: &BytesStart<'_>) -> Result<Element> {
        let name = self.attribute(tag, "Name")?.unwrap_or_default();
        match (self.described(section, &name, tag), section.of_data()) {
            (Ok(Some(array)), _) => {
                if let Some(piece) = self.pieces.last_mut() {
                    piece.arrays[section as usize].push(array);
                }
                Ok(Element::Array(section))
            }
            (Ok(None), _) => Ok(Element::Other),
            (Err(Error::Malformed { what, .. }), Some(of)) => {
                self.attributes[of].left_out.push(LeftOut { name, why: what });
                Ok(Element::Other)
            }
            (Err(error), _) => Err(error),
        }
    }

    /// A data array as its tag describes it; none if it is of no use.
    fn described(&self, section: Section, name: &str, tag: &BytesStart<'_>) -> Result<Option<DataArray>> {
        let fail =
            |what: String| self.malformed(format!("{} array \"{}\": {what}", section.name(), name.escape_debug()));
        let kind = self.attribute(tag, "type")?.unwrap_or_default();
        if kind == "String" && section.of_data().is_none() {
            return Ok(None);
        }
        let bits = kind == "Bit";
        let kind = NumberKind::from_name(if bits { "UInt8" } else { &kind })
            .ok_or_else(|| fail(format!("its type is \"{}\"", kind.escape_debug())))?;
        let components = match self.attribute(tag, "NumberOfComponents")?.filter(|text| !text.is_empty()) {
            Some(text) => {
                let components = text.trim().parse::<u32>();
                components.map_err(|_| fail(format!("NumberOfComponents is \"{}\"", text.escape_debug())))?.max(1)
            }
            None if section == Section::Points => 3,
            None => 1,
        } as usize;
        let steps = self.attribute(tag, "TimeStep")?.unwrap_or_default();
        let steps = steps.split_ascii_whitespace().map(|step| {
            step.parse().map_err(|_| fail(format!("its TimeStep \"{}\" is not a count", step.escape_debug())))
        });
        let steps = steps.collect::<Result<Vec<usize>>>()?;
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
        // In text each has a number of its own.
        let bits = bits && !matches!(data, Data::Ascii(_));
        let (piece, name) = (self.pieces.len().saturating_sub(1), name.to_owned());
        Ok(Some(DataArray { section: section.name(), piece, name, kind, bits, components, steps, data }))
    }

    /// Notes which arrays of points (0) or cells (1) are for what.
    fn add_roles(&mut self, of: usize, tag: &BytesStart<'_>) -> Result<()> {
        for (role, attribute) in Role::ALL {
            if let Some(name) = self.attribute(tag, attribute)? {
                self.attributes[of].add_role(role, &name);
            }
        }
        Ok(())
    }

    fn time(&self, text: &str) -> Result<f64> {
        let time = text.parse().ok().filter(|time: &f64| time.is_finite());
        time.ok_or_else(|| self.malformed(format!("the time \"{}\" is not a number", text.escape_debug())))
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

    pub(super) fn count(&self, tag: &BytesStart<'_>, name: &str) -> Result<u64> {
        let value = self.attribute(tag, name)?.ok_or_else(|| self.malformed(format!("a <Piece> has no {name}")))?;
        value.trim().parse().map_err(|_| self.malformed(format!("{name} is \"{}\", not a count", value.escape_debug())))
    }

    pub(super) fn attribute(&self, tag: &BytesStart<'_>, name: &str) -> Result<Option<String>> {
        let found = tag.try_get_attribute(name).map_err(|e| self.malformed(format!("XML: {e}")))?;
        // VTK writes names with a bare `&`: what cannot be unescaped is taken as it is.
        Ok(found.map(|found| match quick_xml::escape::unescape(&found.value) {
            Ok(value) => value.into_owned(),
            Err(_) => found.value.into_owned(),
        }))
    }
}

/// Bytes that a tag or comment may have. It is kept in memory as a whole: without its end, that would be the rest of
/// the file. A little less than a power of two, to which the place for it grows.
const MOST_OF_A_TAG: usize = (1 << 18) - (1 << 10);

/// A file of which so many bytes may be taken.
struct Limited {
    inner: BufReader<Opened>,
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
