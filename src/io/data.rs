//! Data arrays of a VTK XML file: from ascii, base64 or raw bytes, packed or not, to typed numbers.
//!
//! Every size that a file states is checked against the bytes that it has before memory is taken. Arrays are decoded in
//! chunks, in parallel, each chunk converted while it is in cache: an `Int64` connectivity never exists as such. What
//! decodes deals with bytes; number types come up only where a chunk is parsed or converted, which keeps the code
//! small.

use super::Progress;
use super::input::{Input, Opened, copy_at};
use super::number::Kind;
use super::text;
use super::unpack::{Codec, Unpacker};
use crate::error::{Error, Result};
use crate::memory;
use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use rayon::prelude::*;
use std::fmt::{Display, Formatter};
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Bytes of a chunk of an array that is not packed: small enough for the cache, large enough for a system call.
pub(super) const CHUNK: usize = 1 << 18;

/// Writers differ in how they end a base64 text.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_allow_trailing_bits(true)
        .with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// A data array as the head of the file describes it.
#[derive(Debug, Clone)]
pub(super) struct DataArray {
    /// The element that it is in: `PointData`, `Cells` and so on.
    pub(super) section: &'static str,
    /// The piece that it is in, from 0.
    pub(super) piece: usize,
    pub(super) name: String,
    pub(super) kind: Kind,
    /// Whether each number is a bit, of bytes.
    pub(super) bits: bool,
    pub(super) components: usize,
    /// The time steps that it is for; all of them if it says none.
    pub(super) steps: Vec<usize>,
    pub(super) data: Data,
}

impl Display for DataArray {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} array \"{}\"", self.section, self.name.escape_debug())?;
        if self.piece > 0 { write!(f, " of piece {}", self.piece) } else { Ok(()) }
    }
}

/// Where the numbers of a data array are.
#[derive(Debug, Clone)]
pub(super) enum Data {
    /// Between the element's tags, as text; comments may part it.
    Ascii(Vec<Range<u64>>),
    /// Between the element's tags, in base64.
    Base64(Vec<Range<u64>>),
    /// This many bytes or characters into the appended data.
    Appended(u64),
}

/// Converts a chunk: gets the index of its first number, the numbers as aligned bytes in the order of this machine, and
/// the place of the results. Says what is wrong with them, if anything.
pub(super) type Put<'p> = dyn Fn(usize, &[u8], &mut [u8]) -> Result<(), String> + Sync + 'p;

/// The file that the arrays are in, and what its root element says of them all.
#[derive(Debug)]
pub(super) struct Store {
    pub(super) input: Input,
    /// Length of the file in bytes.
    pub(super) length: u64,
    pub(super) big_endian: bool,
    /// Bytes of a number in the header of an array: 4 or 8.
    pub(super) word: u64,
    pub(super) compressor: Option<String>,
    pub(super) appended: Option<Appended>,
    /// Bytes of the file that arrays were made of so far, some perhaps more than once.
    pub(super) used: AtomicU64,
}

/// How often the bytes of a file may be read into arrays: some writers let equal arrays share theirs, but what many
/// share makes much of little.
const MOST_USES: u64 = 8;

/// The appended data of a file.
#[derive(Debug)]
pub(super) struct Appended {
    /// Position in the file of the byte after the underscore.
    pub(super) start: u64,
    pub(super) base64: bool,
}

/// Why an array cannot be read; [`Store`] adds its name.
pub(super) enum ArrayFault {
    Io(std::io::Error),
    Malformed(String),
    Unsupported(String),
    /// There is no memory for it.
    Lacking(Error),
}

impl From<Error> for ArrayFault {
    fn from(error: Error) -> Self {
        ArrayFault::Lacking(error)
    }
}

impl From<std::io::Error> for ArrayFault {
    fn from(error: std::io::Error) -> Self {
        ArrayFault::Io(error)
    }
}

impl From<String> for ArrayFault {
    fn from(what: String) -> Self {
        ArrayFault::Malformed(what)
    }
}

impl Store {
    /// Opens an array, to be counted or read.
    pub(super) fn array<'a>(&'a self, array: &'a DataArray) -> Result<Contents<'a>> {
        let named = |fault| self.named(array, fault);
        let file = self.input.open().map_err(|e| named(ArrayFault::Io(e)))?;
        let body = self.body(array, file).map_err(named)?;
        Ok(Contents { store: self, array, body })
    }

    fn named(&self, array: &DataArray, fault: ArrayFault) -> Error {
        match fault {
            ArrayFault::Io(source) => Error::file(&self.input.path, source),
            ArrayFault::Malformed(what) => Error::malformed(&self.input.path, format!("{array}: {what}")),
            ArrayFault::Unsupported(what) => Error::unsupported(&self.input.path, format!("{array}: {what}")),
            ArrayFault::Lacking(error) => error,
        }
    }

    fn body(&self, array: &DataArray, file: Opened) -> Result<Body, ArrayFault> {
        let bytes = match &array.data {
            Data::Ascii(ranges) => return Ok(Body::Text(text::read(&file, ranges)?)),
            Data::Base64(ranges) => {
                let mut text = text::read(&file, ranges)?;
                text.retain(|c| !c.is_ascii_whitespace());
                let end = text.len() as u64;
                Bytes { source: Source::Memory(text), base64: true, start: 0, end, skip: 0 }
            }
            Data::Appended(offset) => {
                let appended = self.appended.as_ref().ok_or_else(|| "the file has no <AppendedData>".to_owned())?;
                let start = appended
                    .start
                    .checked_add(*offset)
                    .filter(|start| *start <= self.length)
                    .ok_or_else(|| format!("its offset {offset} lies past the end of the file"))?;
                let source = Source::File(file);
                Bytes { source, base64: appended.base64, start, end: self.length, skip: 0 }
            }
        };
        Ok(Body::Blocks(match self.compressor.as_deref() {
            None => self.plain(bytes)?,
            Some(name) => {
                let codec = Codec::from_name(name).ok_or_else(|| {
                    let name = name.escape_debug();
                    ArrayFault::Unsupported(format!(
                        "it is compressed with {name}, which Halite does not know; write the file anew"
                    ))
                })?;
                self.packed(bytes, codec)?
            }
        }))
    }

    /// The blocks of an array that is not compressed. Its header says how many bytes it has.
    fn plain(&self, bytes: Bytes) -> Result<Blocks, ArrayFault> {
        let total = self.words(&bytes, 1)?[0];
        Ok(Blocks { body: bytes.after(self.word)?, total, size: CHUNK, packed: None })
    }

    /// The blocks of a compressed array. Its header: number of blocks, bytes of each once unpacked, bytes of the last
    /// if it is not full (or 0), then the packed bytes of each.
    fn packed(&self, bytes: Bytes, codec: Codec) -> Result<Blocks, ArrayFault> {
        let count = self.words(&bytes, 1)?[0];
        if count == 0 {
            return Ok(Blocks { body: bytes, total: 0, size: 1, packed: Some((codec, vec![0])) });
        }
        if count > bytes.length() / self.word {
            return Err(format!("it says that it has {count} blocks, more than the file has bytes for").into());
        }
        let head = self.words(&bytes, 3)?;
        let (size, partial) = (head[1], head[2]);
        let last = if partial == 0 { size } else { partial };
        if count > 1 && (last > size || size == 0) {
            return Err(format!("its last block of {last} bytes is larger than the others of {size}").into());
        }
        let mut end = 0u64;
        let packed = &self.words(&bytes, 3 + count)?[3..];
        let ends = packed.iter().map(|packed| {
            end = end.saturating_add(*packed);
            end
        });
        let starts: Vec<u64> = std::iter::once(0).chain(ends).collect();
        let body = bytes.after((3 + count) * self.word)?;
        if end > body.length() {
            return Err(format!("its blocks have {end} bytes, but the file ends after {}", body.length()).into());
        }
        for (i, packed) in packed.iter().enumerate() {
            let size = if i as u64 + 1 == count { last } else { size };
            if size > codec.most(*packed) {
                return Err(format!("its block {i} of {packed} bytes cannot unpack to {size}").into());
            }
        }
        let total = (count - 1).saturating_mul(size).saturating_add(last);
        let size = if count == 1 { last } else { size };
        let size = usize::try_from(size).map_err(|_| format!("a block of {size} bytes is too large"))?;
        Ok(Blocks { body, total, size, packed: Some((codec, starts)) })
    }

    /// The first `count` numbers of an array's header.
    fn words(&self, bytes: &Bytes, count: u64) -> Result<Vec<u64>, ArrayFault> {
        let size = count.saturating_mul(self.word);
        if size > bytes.length() {
            return Err("the file ends inside its header".to_owned().into());
        }
        let mut head = memory::zeroed("the sizes of an array's blocks", size as usize)?;
        bytes.read(0, &mut head)?;
        let word = |word: &[u8]| {
            let digit = |value: u64, byte: &u8| value << 8 | u64::from(*byte);
            if self.big_endian { word.iter().fold(0, digit) } else { word.iter().rev().fold(0, digit) }
        };
        Ok(head.chunks_exact(self.word as usize).map(word).collect())
    }
}

/// Random access to the bytes of an array, header included.
#[derive(Debug)]
struct Bytes {
    source: Source,
    base64: bool,
    /// Where in the source the bytes, or their base64 text, start.
    start: u64,
    /// Where in the source they end at the latest.
    end: u64,
    /// Bytes to leave out from there, once decoded from base64.
    skip: u64,
}

#[derive(Debug)]
enum Source {
    File(Opened),
    Memory(Vec<u8>),
}

impl Source {
    fn read(&self, at: u64, out: &mut [u8]) -> std::io::Result<()> {
        match self {
            Source::File(file) => file.read_at(at, out),
            Source::Memory(bytes) => copy_at(bytes, at, out),
        }
    }
}

impl Bytes {
    /// How many bytes there are at most.
    fn length(&self) -> u64 {
        let stored = self.end - self.start;
        let decoded = if self.base64 { stored / 4 * 3 + stored % 4 } else { stored };
        decoded.saturating_sub(self.skip)
    }

    /// What follows the first `header` bytes. In base64 these may be encoded together with what follows, or on their
    /// own, which their padding tells.
    fn after(mut self, header: u64) -> Result<Self, ArrayFault> {
        let characters = header.div_ceil(3) * 4;
        let mut padding = *b"=";
        if self.base64 && !header.is_multiple_of(3) {
            padding = *b"A";
            let at = self.start + characters - (3 - header % 3);
            if at < self.end {
                self.source.read(at, &mut padding)?;
            }
        }
        if self.base64 && padding == *b"=" {
            self.start = (self.start + characters).min(self.end);
        } else {
            self.skip += header;
        }
        Ok(self)
    }

    /// Reads bytes from position `at` on.
    fn read(&self, at: u64, out: &mut [u8]) -> Result<(), ArrayFault> {
        let first = self.skip + at;
        if !self.base64 {
            return Ok(self.source.read(self.start + first, out)?);
        }
        let (quad, end) = (first / 3, (first + out.len() as u64).div_ceil(3));
        let from = (self.start + quad * 4).min(self.end);
        let mut text = vec![0; ((self.start + end * 4).min(self.end) - from) as usize];
        self.source.read(from, &mut text)?;
        let decoded = BASE64.decode(&text).map_err(|error| format!("it is not valid base64: {error}"))?;
        let lead = (first - quad * 3) as usize;
        let bytes = decoded.get(lead..).and_then(|bytes| bytes.get(..out.len()));
        out.copy_from_slice(bytes.ok_or_else(|| "its base64 text ends too early".to_owned())?);
        Ok(())
    }
}

/// An array that was opened.
#[derive(Debug)]
pub(super) struct Contents<'a> {
    store: &'a Store,
    array: &'a DataArray,
    body: Body,
}

#[derive(Debug)]
enum Body {
    Text(Vec<u8>),
    Blocks(Blocks),
}

/// The numbers of an array as blocks that can be decoded one by one.
#[derive(Debug)]
struct Blocks {
    body: Bytes,
    /// Bytes of all blocks, unpacked.
    total: u64,
    /// Bytes of a block, unpacked; the last may have less.
    size: usize,
    /// If they are packed: how, where each starts in the body, and the end of the last.
    packed: Option<(Codec, Vec<u64>)>,
}

impl Contents<'_> {
    /// How many numbers the array says it has.
    pub(super) fn count(&self) -> u64 {
        match &self.body {
            Body::Text(text) => text::count(text),
            Body::Blocks(blocks) => blocks.total / self.array.kind.size() as u64,
        }
    }

    /// Reads the first `count` numbers, of all that there must be, and converts them.
    pub(super) fn read<U: bytemuck::Pod>(self, count: u64, progress: &Progress<'_>, put: &Put<'_>) -> Result<Vec<U>> {
        let mut out = Vec::new();
        let result = self.check(count).and_then(|()| {
            let what = format_args!("{}, {}", self.store.input.path.display(), self.array);
            out = memory::zeroed(what, usize::try_from(count).map_err(|_| "it is too large".to_owned())?)?;
            let (bytes, size) = (bytemuck::cast_slice_mut(&mut out), size_of::<U>());
            let put = |first, numbers: &[u8], out: &mut [u8]| {
                progress.add(out.len() / size);
                put(first, numbers, out)
            };
            match &self.body {
                _ if count == 0 => Ok(()),
                Body::Text(text) => Ok(text::parse(self.array.kind, text, bytes, size, &put)?),
                Body::Blocks(blocks) => blocks.fill(
                    self.array.kind,
                    self.store.big_endian != cfg!(target_endian = "big"),
                    bytes,
                    size,
                    &put,
                ),
            }
        });
        result.map(|()| out).map_err(|fault| self.store.named(self.array, fault))
    }

    /// Checks the array for `count` numbers. In point and cell data there may be more bytes, as some writers count
    /// wrongly (GetFEM) and VTK does not mind.
    fn check(&self, count: u64) -> Result<(), ArrayFault> {
        let Body::Blocks(blocks) = &self.body else {
            let found = self.count();
            return if found == count { Ok(()) } else { Err(format!("it holds {found} numbers, not {count}").into()) };
        };
        let total = count
            .checked_mul(self.array.kind.size() as u64)
            .ok_or_else(|| format!("{count} numbers are more than any file can hold"))?;
        let stated = blocks.total;
        let spare = blocks.packed.is_none() && stated > total && self.array.section.ends_with("Data");
        if spare && count > 0 {
            let path = self.store.input.path.display();
            tracing::warn!("{path}: {} has {stated} bytes; only {total} of them are needed and read", self.array);
        } else if !spare && stated != total {
            let hint = match stated {
                _ if (stated as u32).swap_bytes() as u64 == total || stated.swap_bytes() == total => {
                    "; the file's byte_order seems to be wrong"
                }
                _ if stated & u64::from(u32::MAX) == total => "; the file's header_type seems to be wrong",
                _ => "",
            };
            return Err(format!("it holds {stated} bytes, but its numbers need {total}{hint}").into());
        }
        if blocks.packed.is_none() && total > blocks.body.length() {
            return Err(format!("the file ends after {} of its {total} bytes", blocks.body.length()).into());
        }
        let own = blocks.packed.as_ref().map_or(total, |(_, starts)| starts.last().copied().unwrap_or_default());
        let used = self.store.used.fetch_add(own, Relaxed).saturating_add(own);
        if used > MOST_USES.saturating_mul(self.store.length) {
            return Err(
                format!("it shares its bytes with so many arrays that they hold {MOST_USES} times the file").into()
            );
        }
        Ok(())
    }
}

/// What a thread keeps from chunk to chunk.
struct Scratch {
    /// In words, for the alignment.
    numbers: Vec<u64>,
    unpacker: Unpacker,
}

impl Blocks {
    /// Decodes and converts numbers of `kind` until `out` is full, `size` bytes for each.
    fn fill(&self, kind: Kind, swap: bool, out: &mut [u8], size: usize, put: &Put<'_>) -> Result<(), ArrayFault> {
        if self.packed.is_some() && !self.size.is_multiple_of(kind.size()) && self.total > self.size as u64 {
            // Blocks that cut numbers in two are put together first.
            let count = self.total as usize;
            let mut whole = memory::zeroed("the blocks of an array", count)?;
            self.fill(Kind::U8, false, &mut whole, 1, &|_, from: &[u8], to: &mut [u8]| {
                to.copy_from_slice(from);
                Ok(())
            })?;
            let body = Bytes { source: Source::Memory(whole), base64: false, start: 0, end: self.total, skip: 0 };
            return Blocks { body, total: self.total, size: CHUNK, packed: None }.fill(kind, swap, out, size, put);
        }
        let per_block = (self.size / kind.size()).max(1);
        let per_chunk = CHUNK / kind.size();
        let most = per_block.min(per_chunk).min(out.len() / size);
        let scratch = || Scratch { numbers: vec![0; most * kind.size() / 8 + 1], unpacker: Unpacker::default() };
        out.par_chunks_mut(per_block * size).enumerate().try_for_each_init(scratch, |scratch, (block, out)| {
            let Scratch { numbers, unpacker } = scratch;
            if let Some((codec, starts)) = &self.packed {
                let mut packed = unpacker.buffer((starts[block + 1] - starts[block]) as usize)?;
                self.body.read(starts[block], &mut packed)?;
                let whole = if block as u64 == (self.total - 1) / self.size as u64 {
                    self.total as usize - block * self.size
                } else {
                    self.size
                };
                let is_valid = unpacker.start(*codec, packed, whole)?;
                is_valid.map_err(|why| format!("its block {block} {why}"))?;
            }
            for (chunk, out) in out.chunks_mut(per_chunk * size).enumerate() {
                let first = block * per_block + chunk * per_chunk;
                let bytes = &mut bytemuck::cast_slice_mut(numbers)[..out.len() / size * kind.size()];
                match self.packed {
                    None => self.body.read((first * kind.size()) as u64, bytes)?,
                    Some(_) => unpacker.more(bytes).map_err(|why| format!("its block {block} {why}"))?,
                }
                if swap {
                    reverse(bytes, kind.size());
                }
                put(first, bytes, out)?;
            }
            if self.packed.is_some() {
                unpacker.end().map_err(|why| format!("its block {block} {why}"))?;
            }
            Ok(())
        })
    }
}

/// Reverses the bytes of each number.
pub(super) fn reverse(bytes: &mut [u8], size: usize) {
    if size > 1 {
        bytes.chunks_exact_mut(size).for_each(<[u8]>::reverse);
    }
}
