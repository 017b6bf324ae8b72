//! Writes files as other programs do, sound and damaged.

#![allow(dead_code, reason = "each test uses a part")]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use halite::mesh::{Array, Values};
use std::fmt::Write as _;
use std::io::Write as _;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Mode {
    Ascii,
    Inline,
    AppendedBase64,
    AppendedRaw,
}

/// How a file is written.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Style {
    pub(crate) mode: Mode,
    pub(crate) big_endian: bool,
    pub(crate) wide: bool,
    /// Bytes per packed block.
    pub(crate) block: Option<usize>,
    pub(crate) codec: Codec,
    /// Header and data of uncompressed base64 in one piece, as VTK does, or each on its own, as FEniCS does.
    pub(crate) together: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Codec {
    ZLib,
    LZ4,
    Lzma,
}

pub(crate) const PLAIN: Style =
    Style { mode: Mode::Ascii, big_endian: false, wide: false, block: None, codec: Codec::ZLib, together: true };

macro_rules! bytes_of {
    ($v:expr, $big:expr) => {
        $v.iter().flat_map(|x| if $big { x.to_be_bytes().to_vec() } else { x.to_le_bytes().to_vec() }).collect()
    };
}

/// Type name, bytes and text of values.
pub(crate) fn told(values: &Values, big: bool) -> (&'static str, Vec<u8>, String) {
    macro_rules! arms {
        ($($variant:ident $name:literal),*) => {
            match values {
                $(Values::$variant(v) => ($name, bytes_of!(v, big), v.iter().map(|x| format!(" {x}")).collect())),*
            }
        };
    }
    arms!(I8 "Int8", U8 "UInt8", I16 "Int16", U16 "UInt16", I32 "Int32", U32 "UInt32", I64 "Int64", U64 "UInt64",
        F32 "Float32", F64 "Float64")
}

impl Codec {
    fn pack(self, bytes: &[u8]) -> Vec<u8> {
        match self {
            Codec::ZLib => {
                let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
                encoder.write_all(bytes).unwrap();
                encoder.finish().unwrap()
            }
            Codec::LZ4 => lz4_flex::block::compress(bytes),
            Codec::Lzma => {
                let mut encoder = lzma_rust2::XzWriter::new(Vec::new(), lzma_rust2::XzOptions::with_preset(1)).unwrap();
                encoder.write_all(bytes).unwrap();
                encoder.finish().unwrap()
            }
        }
    }
}

impl Style {
    fn words(&self, words: &[usize]) -> Vec<u8> {
        match self.wide {
            true => bytes_of!(words.iter().map(|w| *w as u64).collect::<Vec<_>>(), self.big_endian),
            false => bytes_of!(words.iter().map(|w| *w as u32).collect::<Vec<_>>(), self.big_endian),
        }
    }

    /// Header and body of an array.
    fn parts(&self, bytes: &[u8]) -> (Vec<u8>, Vec<u8>) {
        let Some(block) = self.block else { return (self.words(&[bytes.len()]), bytes.to_vec()) };
        let blocks: Vec<Vec<u8>> = bytes.chunks(block).map(|part| self.codec.pack(part)).collect();
        let mut head = vec![blocks.len(), block, bytes.len() % block];
        head.extend(blocks.iter().map(Vec::len));
        (self.words(&head), blocks.concat())
    }

    fn encoded(&self, bytes: &[u8]) -> Vec<u8> {
        let (head, body) = self.parts(bytes);
        match self.mode {
            Mode::AppendedRaw => [head, body].concat(),
            _ if self.together && self.block.is_none() => BASE64_STANDARD.encode([head, body].concat()).into_bytes(),
            _ => (BASE64_STANDARD.encode(head) + &BASE64_STANDARD.encode(body)).into_bytes(),
        }
    }
}

/// A piece to be written: points as an array, cells as arrays of any type, data.
#[derive(Clone)]
pub(crate) struct Piece {
    pub(crate) points: Values,
    pub(crate) connectivity: Values,
    pub(crate) offsets: Values,
    pub(crate) types: Values,
    pub(crate) point_data: Vec<Array>,
    pub(crate) cell_data: Vec<Array>,
}

pub(crate) fn array(name: &str, components: usize, values: Values) -> Array {
    Array { name: name.to_owned(), components, values }
}

/// A tetrahedron and a wedge that share no point, and enough values to fill several blocks.
pub(crate) fn piece() -> Piece {
    Piece {
        points: Values::F64((0..30).map(|i| f64::from(i * i % 17) * 0.375 - 1.0).collect()),
        connectivity: Values::I64((0..10).collect()),
        offsets: Values::I64(vec![4, 10]),
        types: Values::U8(vec![10, 13]),
        point_data: vec![
            array("T", 1, Values::F32((0..10u8).map(|i| f32::from(i) * 0.125).collect())),
            array("v", 9, Values::F64((0..90).map(|i| f64::from(i).sqrt()).collect())),
        ],
        cell_data: vec![array("id", 1, Values::I32(vec![-7, 1 << 30]))],
    }
}

/// A piece of any kind of grid to be written: the attributes of its tag, and the arrays of each section.
pub(crate) type Written = (String, Vec<(&'static str, Vec<Array>)>);

pub(crate) fn write(style: Style, pieces: &[Piece]) -> Vec<u8> {
    let written = |piece: &Piece| {
        let (points, cells) = (piece.points.len() / 3, piece.types.len());
        let topology = vec![
            array("connectivity", 1, piece.connectivity.clone()),
            array("offsets", 1, piece.offsets.clone()),
            array("types", 1, piece.types.clone()),
        ];
        let sections = vec![
            ("PointData", piece.point_data.clone()),
            ("CellData", piece.cell_data.clone()),
            ("Points", vec![array("Points", 3, piece.points.clone())]),
            ("Cells", topology),
        ];
        (format!("NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\""), sections)
    };
    write_grid(style, "UnstructuredGrid", "", &pieces.iter().map(written).collect::<Vec<_>>())
}

/// A file of a `kind` of grid whose element has these `attributes`.
pub(crate) fn write_grid(style: Style, kind: &str, attributes: &str, pieces: &[Written]) -> Vec<u8> {
    let mut appended: Vec<u8> = Vec::new();
    let mut head = format!("<?xml version=\"1.0\"?>\n<VTKFile type=\"{kind}\" version=\"0.1\"");
    write!(head, " byte_order=\"{}Endian\"", if style.big_endian { "Big" } else { "Little" }).unwrap();
    write!(head, " header_type=\"UInt{}\"", if style.wide { 64 } else { 32 }).unwrap();
    if style.block.is_some() {
        let name = match style.codec {
            Codec::ZLib => "ZLib",
            Codec::LZ4 => "LZ4",
            Codec::Lzma => "LZMA",
        };
        write!(head, " compressor=\"vtk{name}DataCompressor\"").unwrap();
    }
    let space = if attributes.is_empty() { "" } else { " " };
    write!(head, ">\n<{kind}{space}{attributes}>\n").unwrap();
    for (attributes, sections) in pieces {
        writeln!(head, "<Piece {attributes}>").unwrap();
        for (section, arrays) in sections {
            writeln!(head, "<{section}>").unwrap();
            for Array { name, components, values } in arrays {
                let (kind, bytes, text) = told(values, style.big_endian);
                write!(head, "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" ")
                    .unwrap();
                match style.mode {
                    Mode::Ascii => writeln!(head, "format=\"ascii\">\n{text}\n</DataArray>").unwrap(),
                    Mode::Inline => {
                        let text = String::from_utf8(style.encoded(&bytes)).unwrap();
                        writeln!(head, "format=\"binary\">\n   {text}\n  </DataArray>").unwrap();
                    }
                    Mode::AppendedBase64 | Mode::AppendedRaw => {
                        writeln!(head, "format=\"appended\" offset=\"{}\"/>", appended.len()).unwrap();
                        appended.extend(style.encoded(&bytes));
                    }
                }
            }
            writeln!(head, "</{section}>").unwrap();
        }
        head += "</Piece>\n";
    }
    writeln!(head, "</{kind}>").unwrap();
    let mut file = head.into_bytes();
    if matches!(style.mode, Mode::AppendedRaw | Mode::AppendedBase64) {
        let encoding = if style.mode == Mode::AppendedRaw { "raw" } else { "base64" };
        file.extend(format!("<AppendedData encoding=\"{encoding}\">\n   _").bytes());
        file.extend(appended);
        file.extend(b"\n</AppendedData>\n");
    }
    file.extend(b"</VTKFile>\n");
    file
}

pub(crate) fn ascii(pieces: &[Piece]) -> String {
    String::from_utf8(write(PLAIN, pieces)).unwrap()
}

/// Every way to write a file that is read. Blocks of 72 bytes hold whole numbers of any type and end with the array
/// "v", those of 100 bytes do not, and those of 50 bytes cut numbers in two.
pub(crate) fn styles() -> Vec<Style> {
    let mut styles = Vec::new();
    for mode in [Mode::Ascii, Mode::Inline, Mode::AppendedBase64, Mode::AppendedRaw] {
        for big_endian in [false, true] {
            for wide in [false, true] {
                let style = Style { mode, big_endian, wide, ..PLAIN };
                for block in [Some(72), Some(100), Some(50), Some(1 << 15)] {
                    styles.push(Style { block, together: false, ..style });
                }
                for codec in [Codec::LZ4, Codec::Lzma] {
                    styles.push(Style { block: Some([50, 72][usize::from(wide)]), codec, together: false, ..style });
                }
                for together in [true, false] {
                    styles.push(Style { together, ..style });
                }
            }
        }
    }
    styles
}

/// A generator of pseudo-random numbers (xorshift64*).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        ((self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 32) % limit.max(1) as u64) as usize
    }
}

/// Damages a file in one to four places.
pub(crate) fn mutated(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..=random.below(4) {
        let at = random.below(bytes.len());
        match random.below(8) {
            0 => bytes.truncate(at),
            1 => drop(bytes.drain(at..(at + random.below(20)).min(bytes.len()))),
            2 => drop(bytes.splice(at..at, b"<&>\"'_-9"[random.below(8)..].to_vec())),
            3 | 4 => bytes.iter_mut().skip(at).take(1 + random.below(8)).for_each(|b| *b = 0xff),
            _ => bytes.iter_mut().skip(at).take(1).for_each(|b| *b = random.below(256) as u8),
        }
    }
    bytes
}

pub(crate) const LEGACY: &str = "# vtk DataFile Version 3.0\ntitle\nASCII\nDATASET UNSTRUCTURED_GRID\n\
    POINTS 5 float\n0 0 0 1 0 0 0 1 0 0 0 1\n1 1 1\nCELLS 2 10\n4 0 1 2 3\n4 1 2 3 4\nCELL_TYPES 2\n10 10\n\
    CELL_DATA 2\nSCALARS id int 1\nLOOKUP_TABLE default\n7 8\n\
    POINT_DATA 5\nVECTORS v%20x double\n0 0 0 0 0 1 0 1 0 0 1 1 2 2 2\nFIELD FieldData 1\nT 1 5 float\n1 2 3 4 5\n";
