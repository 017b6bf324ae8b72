//! Data arrays of a VTK XML file: from ascii, base64 or raw bytes, packed or not, to typed numbers.
//!
//! Every size that a file states is checked against the bytes that it has before memory is taken. Arrays are decoded in
//! chunks, in parallel, each chunk converted while it is in cache: an `Int64` connectivity never exists as such.

use super::Progress;
use super::number::{Kind, Number};
use crate::error::{Error, Result};
use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use flate2::{Decompress, FlushDecompress, Status};
use rayon::prelude::*;
use std::fmt::{Display, Formatter};
use std::fs::File;
use std::ops::Range;
use std::path::Path;

/// Bytes of a chunk of an array that is not packed: small enough for the cache, large enough for a system call.
const CHUNK: usize = 1 << 18;

/// Deflate cannot expand a byte to more than this many.
const MOST_PER_BYTE: u64 = 1032;

/// Writers differ in how they end a base64 text.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_allow_trailing_bits(true)
        .with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// A data array as the head of the file describes it.
#[derive(Debug)]
pub(super) struct DataArray {
    /// The element that it is in: `PointData`, `Cells` and so on.
    pub(super) section: &'static str,
    /// The piece that it is in, from 0.
    pub(super) piece: usize,
    pub(super) name: String,
    pub(super) kind: Kind,
    pub(super) components: usize,
    pub(super) data: Data,
}

impl Display for DataArray {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} array \"{}\"", self.section, self.name.escape_debug())?;
        if self.piece > 0 { write!(f, " of piece {}", self.piece) } else { Ok(()) }
    }
}

/// Where the numbers of a data array are.
#[derive(Debug)]
pub(super) enum Data {
    /// Between the element's tags, as text; comments may part it.
    Ascii(Vec<Range<u64>>),
    /// Between the element's tags, in base64.
    Base64(Vec<Range<u64>>),
    /// This many bytes or characters into the appended data.
    Appended(u64),
}

/// The file that the arrays are in, and what its root element says of them all.
#[derive(Debug)]
pub(super) struct Store<'a> {
    pub(super) path: &'a Path,
    pub(super) file: &'a File,
    /// Length of the file in bytes.
    pub(super) length: u64,
    pub(super) big_endian: bool,
    /// Bytes of a number in the header of an array: 4 or 8.
    pub(super) word: u64,
    pub(super) compressor: Option<String>,
    pub(super) appended: Option<Appended>,
}

/// The appended data of a file.
#[derive(Debug)]
pub(super) struct Appended {
    /// Position in the file of the byte after the underscore.
    pub(super) start: u64,
    pub(super) base64: bool,
}

/// Why an array cannot be read; [`Store::read`] adds its name.
enum Fault {
    Io(std::io::Error),
    Malformed(String),
    Unsupported(String),
}

impl From<std::io::Error> for Fault {
    fn from(error: std::io::Error) -> Self {
        Fault::Io(error)
    }
}

impl From<String> for Fault {
    fn from(what: String) -> Self {
        Fault::Malformed(what)
    }
}

impl Store<'_> {
    /// Reads the `count` numbers of an array, which must be of type `T`, and converts them: `put` gets the index of the first
    /// number of a chunk, the numbers and the place of their results, and says what is wrong with them, if anything.
    pub(super) fn read<T: Number, U: bytemuck::Pod + Send>(
        &self,
        array: &DataArray,
        count: u64,
        progress: &Progress<'_>,
        put: impl Fn(usize, &[T], &mut [U]) -> Result<(), String> + Sync,
    ) -> Result<Vec<U>> {
        let put = |first, numbers: &[T], out: &mut [U]| {
            progress.add(numbers.len());
            put(first, numbers, out)
        };
        let result = match &array.data {
            _ if count == 0 => Ok(Vec::new()),
            Data::Ascii(ranges) => self.text(ranges).map_err(Fault::Io).and_then(|text| parse(&text, count, put)),
            Data::Base64(ranges) => self.text(ranges).map_err(Fault::Io).and_then(|mut text| {
                text.retain(|c| !c.is_ascii_whitespace());
                let end = text.len() as u64;
                let source = Source::Memory(text);
                self.decode(array, Bytes { source, base64: true, start: 0, end, skip: 0 }, count, put)
            }),
            Data::Appended(offset) => self.appended(*offset).and_then(|bytes| self.decode(array, bytes, count, put)),
        };
        result.map_err(|fault| match fault {
            Fault::Io(source) => Error::file(self.path, source),
            Fault::Malformed(what) => Error::malformed(self.path, format!("{array}: {what}")),
            Fault::Unsupported(what) => Error::unsupported(self.path, format!("{array}: {what}")),
        })
    }

    /// The text of an array between its tags, parts separated by a space.
    fn text(&self, ranges: &[Range<u64>]) -> std::io::Result<Vec<u8>> {
        let mut text = Vec::new();
        for range in ranges {
            let (at, start) = (text.len(), range.start);
            text.resize(at + (range.end - start) as usize, 0);
            text[at..]
                .par_chunks_mut(CHUNK)
                .enumerate()
                .try_for_each(|(i, chunk)| read_at(self.file, start + (i * CHUNK) as u64, chunk))?;
            text.push(b' ');
        }
        Ok(text)
    }

    fn appended(&self, offset: u64) -> Result<Bytes<'_>, Fault> {
        let appended = self.appended.as_ref().ok_or_else(|| "the file has no <AppendedData>".to_owned())?;
        let start = appended
            .start
            .checked_add(offset)
            .filter(|start| *start <= self.length)
            .ok_or_else(|| format!("its offset {offset} lies past the end of the file"))?;
        let source = Source::File(self.file);
        Ok(Bytes { source, base64: appended.base64, start, end: self.length, skip: 0 })
    }

    /// Decodes binary numbers.
    fn decode<T: Number, U: bytemuck::Pod + Send>(
        &self,
        array: &DataArray,
        bytes: Bytes<'_>,
        count: u64,
        put: impl Fn(usize, &[T], &mut [U]) -> Result<(), String> + Sync,
    ) -> Result<Vec<U>, Fault> {
        let size = size_of::<T>() as u64;
        let total =
            count.checked_mul(size).ok_or_else(|| format!("{count} numbers are more than any file can hold"))?;
        let mut blocks = match self.compressor.as_deref() {
            None => self.plain(array, bytes, total)?,
            Some("vtkZLibDataCompressor") => self.packed(bytes)?,
            Some(other) => {
                return Err(Fault::Unsupported(format!(
                    "it is compressed with {other}, which Halite cannot read yet; write the file with vtkZLibDataCompressor \
                     or without compression"
                )));
            }
        };
        if blocks.total != total {
            return Err(format!("it holds {} bytes, but {count} numbers need {total}", blocks.total).into());
        }
        if !(blocks.size as u64).is_multiple_of(size) && blocks.total > blocks.size as u64 {
            let whole = blocks.fill(total, false, |_, from: &[u8], to: &mut [u8]| {
                to.copy_from_slice(from);
                Ok(())
            })?;
            let source = Source::Memory(whole);
            blocks = Blocks::plain(Bytes { source, base64: false, start: 0, end: total, skip: 0 }, total);
        }
        blocks.fill(count, self.big_endian != cfg!(target_endian = "big"), put)
    }

    /// The blocks of an array that is not compressed, and needs `total` bytes. Its header says how many it has; in point and
    /// cell data there may be more, as some writers count wrongly (GetFEM) and VTK does not mind.
    fn plain<'b>(&self, array: &DataArray, bytes: Bytes<'b>, total: u64) -> Result<Blocks<'b>, Fault> {
        let stated = self.words(&bytes, 1)?[0];
        let body = bytes.after(self.word)?;
        if stated > total && array.section.ends_with("Data") {
            tracing::warn!(
                "{}: {array} has {stated} bytes; only {total} of them are needed and read",
                self.path.display()
            );
        } else if stated != total {
            return Err(format!("it holds {stated} bytes, but its numbers need {total}").into());
        }
        if total > body.length() {
            return Err(format!("the file ends after {} of its {total} bytes", body.length()).into());
        }
        Ok(Blocks::plain(body, total))
    }

    /// The blocks of a zlib-compressed array. Its header: number of blocks, bytes of each once unpacked, bytes of the last if it
    /// is not full (or 0), then the packed bytes of each.
    fn packed<'b>(&self, bytes: Bytes<'b>) -> Result<Blocks<'b>, Fault> {
        let head = self.words(&bytes, 3)?;
        let (count, size, partial) = (head[0], head[1], head[2]);
        if count > bytes.length() / self.word {
            return Err(format!("it says that it has {count} blocks, more than the file has bytes for").into());
        }
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
            if size > packed.saturating_mul(MOST_PER_BYTE) {
                return Err(format!("its block {i} of {packed} bytes cannot unpack to {size}").into());
            }
        }
        let total = count.saturating_sub(1).saturating_mul(size).saturating_add(if count == 0 { 0 } else { last });
        let size = if count == 1 { last } else { size };
        let size = usize::try_from(size).map_err(|_| format!("a block of {size} bytes is too large"))?;
        Ok(Blocks { body, total, size, starts: Some(starts) })
    }

    /// The first `count` numbers of an array's header.
    fn words(&self, bytes: &Bytes<'_>, count: u64) -> Result<Vec<u64>, Fault> {
        let size = count.saturating_mul(self.word);
        if size > bytes.length() {
            return Err("the file ends inside its header".to_owned().into());
        }
        let mut head = vec![0; size as usize];
        bytes.read(0, &mut head)?;
        let word = |word: &[u8]| {
            let digit = |value: u64, byte: &u8| value << 8 | u64::from(*byte);
            if self.big_endian { word.iter().fold(0, digit) } else { word.iter().rev().fold(0, digit) }
        };
        Ok(head.chunks_exact(self.word as usize).map(word).collect())
    }
}

/// Random access to the bytes of an array, header included.
struct Bytes<'a> {
    source: Source<'a>,
    base64: bool,
    /// Where in the source the bytes, or their base64 text, start.
    start: u64,
    /// Where in the source they end at the latest.
    end: u64,
    /// Bytes to leave out from there, once decoded from base64.
    skip: u64,
}

enum Source<'a> {
    File(&'a File),
    Memory(Vec<u8>),
}

impl Source<'_> {
    fn read(&self, at: u64, out: &mut [u8]) -> std::io::Result<()> {
        match self {
            Source::File(file) => read_at(file, at, out),
            Source::Memory(bytes) => {
                let from = usize::try_from(at).ok().and_then(|at| bytes.get(at..)?.get(..out.len()));
                out.copy_from_slice(from.ok_or(std::io::ErrorKind::UnexpectedEof)?);
                Ok(())
            }
        }
    }
}

impl Bytes<'_> {
    /// How many bytes there are at most.
    fn length(&self) -> u64 {
        let stored = self.end - self.start;
        let decoded = if self.base64 { stored / 4 * 3 + stored % 4 } else { stored };
        decoded.saturating_sub(self.skip)
    }

    /// What follows the first `header` bytes. In base64 these may be encoded together with what follows, or on their own, which
    /// their padding tells.
    fn after(mut self, header: u64) -> Result<Self, Fault> {
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
    fn read(&self, at: u64, out: &mut [u8]) -> Result<(), Fault> {
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

/// The numbers of an array as blocks that can be decoded one by one.
struct Blocks<'a> {
    body: Bytes<'a>,
    /// Bytes of all blocks, unpacked.
    total: u64,
    /// Bytes of a block, unpacked; the last may have less.
    size: usize,
    /// If they are packed: where each starts in the body, and the end of the last.
    starts: Option<Vec<u64>>,
}

/// What a thread keeps from block to block.
struct Scratch<T> {
    numbers: Vec<T>,
    packed: Vec<u8>,
    inflate: Decompress,
}

impl<'a> Blocks<'a> {
    fn plain(body: Bytes<'a>, total: u64) -> Self {
        Blocks { body, total, size: CHUNK, starts: None }
    }

    /// Decodes and converts all `count` numbers. `T` must fit into the blocks without a rest.
    fn fill<T: Number, U: bytemuck::Pod + Send>(
        &self,
        count: u64,
        swap: bool,
        put: impl Fn(usize, &[T], &mut [U]) -> Result<(), String> + Sync,
    ) -> Result<Vec<U>, Fault> {
        let mut out = vec![U::zeroed(); usize::try_from(count).map_err(|_| "it is too large".to_owned())?];
        let per_block = (self.size / size_of::<T>()).max(1);
        let scratch = || Scratch { numbers: Vec::new(), packed: Vec::new(), inflate: Decompress::new(true) };
        out.par_chunks_mut(per_block).enumerate().try_for_each_init(scratch, |scratch, (block, out)| {
            let Scratch { numbers, packed, inflate } = scratch;
            numbers.resize(out.len(), T::zeroed());
            let bytes = bytemuck::cast_slice_mut(numbers);
            match &self.starts {
                None => self.body.read((block * self.size) as u64, bytes)?,
                Some(starts) => {
                    packed.resize((starts[block + 1] - starts[block]) as usize, 0);
                    self.body.read(starts[block], packed)?;
                    inflate.reset(true);
                    let status = inflate.decompress(packed, bytes, FlushDecompress::Finish);
                    if !matches!(status, Ok(Status::StreamEnd)) || inflate.total_out() != bytes.len() as u64 {
                        return Err(Fault::Malformed(format!("its block {block} is not valid zlib data")));
                    }
                }
            }
            if swap {
                numbers.iter_mut().for_each(|number| *number = number.swapped());
            }
            Ok(put(block * per_block, numbers, out)?)
        })?;
        Ok(out)
    }
}

/// Parses the numbers of an ascii array.
fn parse<T: Number, U: bytemuck::Pod + Send>(
    mut text: &[u8],
    count: u64,
    put: impl Fn(usize, &[T], &mut [U]) -> Result<(), String> + Sync,
) -> Result<Vec<U>, Fault> {
    let mut parts = Vec::new();
    while !text.is_empty() {
        let end = text.iter().skip(CHUNK).position(u8::is_ascii_whitespace).map_or(text.len(), |i| CHUNK + i);
        let (part, rest) = text.split_at(end);
        parts.push(part);
        text = rest;
    }
    let counts: Vec<usize> = parts.par_iter().map(|part| tokens(part).count()).collect();
    let found: usize = counts.iter().sum();
    if found as u64 != count {
        return Err(format!("it holds {found} numbers, not {count}").into());
    }
    let mut out = vec![U::zeroed(); found];
    let (mut rest, mut first) = (&mut out[..], 0);
    let mut jobs = Vec::new();
    for (part, count) in parts.iter().zip(counts) {
        let (place, after) = rest.split_at_mut(count);
        jobs.push((first, *part, place));
        (rest, first) = (after, first + count);
    }
    jobs.into_par_iter().try_for_each(|(first, part, place)| {
        let number = |token: &[u8]| {
            let number = std::str::from_utf8(token).ok().and_then(T::parse);
            number.ok_or_else(|| {
                let token = String::from_utf8_lossy(&token[..token.len().min(40)]);
                format!("\"{}\" is not a number of its type", token.escape_debug())
            })
        };
        let numbers = tokens(part).map(number).collect::<Result<Vec<T>, String>>()?;
        put(first, &numbers, place)
    })?;
    Ok(out)
}

fn tokens(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    text.split(u8::is_ascii_whitespace).filter(|token| !token.is_empty())
}

#[cfg(unix)]
fn read_at(file: &File, at: u64, out: &mut [u8]) -> std::io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, out, at)
}

#[cfg(windows)]
fn read_at(file: &File, mut at: u64, mut out: &mut [u8]) -> std::io::Result<()> {
    while !out.is_empty() {
        match std::os::windows::fs::FileExt::seek_read(file, out, at)? {
            0 => return Err(std::io::ErrorKind::UnexpectedEof.into()),
            n => (at, out) = (at + n as u64, &mut out[n..]),
        }
    }
    Ok(())
}
