//! The compressors of VTK XML files: one block after another, each in as many parts as wanted.

use crate::memory;
use flate2::{Decompress, FlushDecompress, Status};
use lzma_rust2::XzReader;
use std::io::Read;

/// How blocks are packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Codec {
    Zlib,
    Lz4,
    Lzma,
}

impl Codec {
    /// VTK's name of the class that packs it.
    pub(super) fn from_name(name: &str) -> Option<Codec> {
        Some(match name {
            "vtkZLibDataCompressor" => Codec::Zlib,
            "vtkLZ4DataCompressor" => Codec::Lz4,
            "vtkLZMADataCompressor" => Codec::Lzma,
            _ => return None,
        })
    }

    /// The most bytes that so many packed ones can unpack to.
    pub(super) fn most(self, packed: u64) -> u64 {
        // Deflate's and LZ4's formats bound the ratio; LZMA's coder cannot get below some thousandths of a bit per
        // symbol.
        packed.saturating_mul(match self {
            Codec::Zlib => 1032,
            Codec::Lz4 => 255,
            Codec::Lzma => 1 << 14,
        })
    }
}

/// Unpacks blocks, one after another.
#[derive(Default)]
pub(super) struct Unpacker {
    packed: Vec<u8>,
    /// How much of `packed`, or of `whole` if there is a block in it, was used.
    used: usize,
    inflate: Option<Decompress>,
    /// A whole block, where the codec knows no parts.
    whole: Option<Vec<u8>>,
}

impl Unpacker {
    /// A buffer for the packed bytes, to be given to [`Unpacker::start`].
    ///
    /// # Errors
    /// [`crate::error::Error::NoMemory`].
    pub(super) fn buffer(&mut self, packed: usize) -> crate::Result<Vec<u8>> {
        let mut buffer = std::mem::take(&mut self.packed);
        resize(&mut buffer, packed)?;
        Ok(buffer)
    }

    /// Starts a block of `size` bytes, and says whether it is valid.
    ///
    /// # Errors
    /// [`crate::error::Error::NoMemory`].
    pub(super) fn start(&mut self, codec: Codec, packed: Vec<u8>, size: usize) -> crate::Result<Result<(), String>> {
        (self.packed, self.used) = (packed, 0);
        if codec == Codec::Zlib {
            self.inflate.get_or_insert_with(|| Decompress::new(true)).reset(true);
            return Ok(Ok(()));
        }
        let whole = self.whole.get_or_insert_default();
        resize(whole, size)?;
        let (name, done) = match codec {
            Codec::Lz4 => ("LZ4", lz4_flex::block::decompress_into(&self.packed, whole).is_ok_and(|n| n == size)),
            _ => ("LZMA", unpack_xz(&self.packed, whole)),
        };
        Ok(if done { Ok(()) } else { Err(format!("is not valid {name} data")) })
    }

    /// Unpacks the next bytes, as many as `out` has.
    pub(super) fn more(&mut self, out: &mut [u8]) -> Result<(), String> {
        if let Some(whole) = &self.whole {
            out.copy_from_slice(&whole[self.used..][..out.len()]);
            self.used += out.len();
            return Ok(());
        }
        let mut at = 0;
        while at < out.len() {
            match self.inflate(&mut out[at..], FlushDecompress::None) {
                Some((_, n)) if n > 0 => at += n,
                _ => return Err("is not valid zlib data".to_owned()),
            }
        }
        Ok(())
    }

    /// Checks that the block holds nothing more.
    pub(super) fn end(&mut self) -> Result<(), String> {
        // One byte to spare, so that inflating has no reason to stop but the end.
        let over =
            self.whole.is_some() || self.inflate(&mut [0], FlushDecompress::Finish) == Some((Status::StreamEnd, 0));
        if over { Ok(()) } else { Err("is not valid zlib data".to_owned()) }
    }

    /// Inflates some of the next bytes, and says how many.
    fn inflate(&mut self, out: &mut [u8], flush: FlushDecompress) -> Option<(Status, usize)> {
        let inflate = self.inflate.as_mut()?;
        let before = (inflate.total_in(), inflate.total_out());
        let status = inflate.decompress(&self.packed[self.used..], out, flush).ok()?;
        self.used += (inflate.total_in() - before.0) as usize;
        Some((status, (inflate.total_out() - before.1) as usize))
    }
}

/// Makes a buffer so long; what is new is 0.
fn resize(buffer: &mut Vec<u8>, bytes: usize) -> crate::Result<()> {
    memory::reserve("a block of a compressed array", buffer, bytes.saturating_sub(buffer.len()))?;
    buffer.resize(bytes, 0);
    Ok(())
}

/// Unpacks an .xz stream of one filter, which must fill `out`.
fn unpack_xz(packed: &[u8], out: &mut [u8]) -> bool {
    let mut reader = XzReader::new(packed, false);
    has_modest_dictionary(packed) && reader.read_exact(out).is_ok() && matches!(reader.read(&mut [0]), Ok(0))
}

/// Whether the first block of an .xz stream needs a dictionary no larger than that of LZMA's highest preset (The .xz
/// File Format, sections 3.1 and 5.3.1): a decoder takes the memory before it sees any data.
fn has_modest_dictionary(packed: &[u8]) -> bool {
    // After the stream's header: size of the block's header, flags, sizes if the flags say so, then the filter.
    let Some([_, flags, rest @ ..]) = packed.get(12..) else { return false };
    let mut rest = rest;
    for bit in [0x40, 0x80] {
        if flags & bit != 0 {
            let end = rest.iter().position(|byte| byte & 0x80 == 0).map_or(rest.len(), |i| i + 1);
            rest = &rest[end..];
        }
    }
    // LZMA2, one byte of properties: 28 stands for 64 MiB. Or an empty stream, which has an index only.
    flags & 3 == 0 && matches!(rest, [0x21, 1, 0..=28, ..])
}
