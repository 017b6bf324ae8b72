//! NumPy's array files: float arrays of any shape, as scenes give depth images and references give pictures.
//!
//! Source: the format's description in NumPy's manual (`numpy.lib.format`), versions 1.0 to 3.0.

use crate::error::{Error, Result};
use std::path::Path;

/// An array of floats, in C order (the last index runs fastest).
#[derive(Debug, Clone, PartialEq)]
pub struct Npy {
    /// The length of each dimension.
    pub shape: Vec<usize>,
    /// The values, as many as the product of the shape; f32 files are widened.
    pub values: Vec<f64>,
}

impl Npy {
    /// Reads a file of 32- or 64-bit floats in C order.
    ///
    /// # Errors
    /// [`Error::File`] if it cannot be read, [`Error::Malformed`] if it is no such file or is cut short,
    /// [`Error::Unsupported`] for other element types and Fortran order.
    pub fn open(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(|e| Error::file(path, e))?;
        Self::parse(path, &bytes)
    }

    fn parse(path: &Path, bytes: &[u8]) -> Result<Self> {
        let bad = |what: &str| Error::malformed(path, format!("not a NumPy array file: {what}"));
        let (header, data) = split(bytes).ok_or_else(|| bad("it has no complete header"))?;
        let header = std::str::from_utf8(header).map_err(|_| bad("its header is no text"))?;
        let order = entry(header, "fortran_order").ok_or_else(|| bad("its header has no \"fortran_order\""))?;
        if !order.starts_with("False") {
            return Err(Error::unsupported(path, "the array is in Fortran order: save numpy.ascontiguousarray of it"));
        }
        let shape = entry(header, "shape").and_then(tuple).ok_or_else(|| bad("its header has no usable \"shape\""))?;
        let descr = entry(header, "descr").ok_or_else(|| bad("its header has no \"descr\""))?;
        let kind = descr.split(['\'', '"']).nth(1).unwrap_or(descr);
        let (size, value): (usize, fn(&[u8]) -> f64) = match kind {
            "<f4" => (4, |b| f32::from_le_bytes(array(b)).into()),
            ">f4" => (4, |b| f32::from_be_bytes(array(b)).into()),
            "<f8" => (8, |b| f64::from_le_bytes(array(b))),
            ">f8" => (8, |b| f64::from_be_bytes(array(b))),
            _ => {
                let what = format!("the array's type is {kind}: only f4 and f8 (float32, float64) are read");
                return Err(Error::unsupported(path, what));
            }
        };
        let length = shape.iter().try_fold(size, |n, &k| n.checked_mul(k));
        if length != Some(data.len()) {
            let what = format!("{} bytes of data do not make the shape {shape:?} of {kind}", data.len());
            return Err(Error::malformed(path, what));
        }
        Ok(Npy { shape, values: data.chunks_exact(size).map(value).collect() })
    }
}

/// The bytes of a file of little-endian 32-bit floats. `values` are as many as the product of `shape`.
pub(super) fn encode(shape: &[usize], values: &[f32]) -> Vec<u8> {
    let shape = shape.iter().map(|n| format!("{n}, ")).collect::<String>();
    let mut header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}), }}", shape.trim_end());
    // Magic, version and length are 10 bytes; data starts at a multiple of 64, after a newline.
    let padding = 64 - (10 + header.len() + 1) % 64;
    header.extend(std::iter::repeat_n(' ', padding % 64).chain(['\n']));
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
    bytes
}

/// The header's text and the data.
fn split(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let rest = bytes.strip_prefix(b"\x93NUMPY")?;
    let (version, rest) = rest.split_first_chunk::<2>()?;
    let (length, rest) = match version[0] {
        1 => rest.split_first_chunk::<2>().map(|(n, rest)| (u16::from_le_bytes(*n).into(), rest))?,
        2 | 3 => rest.split_first_chunk::<4>().map(|(n, rest)| (u32::from_le_bytes(*n) as usize, rest))?,
        _ => return None,
    };
    rest.split_at_checked(length)
}

/// What follows `'key':` in the header.
fn entry<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let after = &header[header.find(&format!("'{key}'"))? + key.len() + 2..];
    Some(after.trim_start().strip_prefix(':')?.trim_start())
}

/// The numbers of the tuple that `text` starts with.
fn tuple(text: &str) -> Option<Vec<usize>> {
    let inside = text.strip_prefix('(')?.split_once(')')?.0;
    inside.split(',').map(str::trim).filter(|n| !n.is_empty()).map(|n| n.parse().ok()).collect()
}

/// The first bytes of `b` as an array; `b` is as long as that everywhere it is called.
fn array<const N: usize>(b: &[u8]) -> [u8; N] {
    b.first_chunk().copied().unwrap_or([0; N])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(header: &str, data: &[u8]) -> Vec<u8> {
        [b"\x93NUMPY\x01\x00", &(header.len() as u16).to_le_bytes()[..], header.as_bytes(), data].concat()
    }

    fn parse(bytes: &[u8]) -> Result<Npy> {
        Npy::parse(Path::new("x.npy"), bytes)
    }

    #[test]
    fn what_is_written_is_read() {
        for shape in [vec![6], vec![2, 3], vec![1, 2, 3]] {
            let bytes = encode(&shape, &[0.0, -1.5, f32::INFINITY, 1e-40, 3.0, 7.0]);
            assert_eq!(bytes.len() % 64, 24, "data is aligned");
            let read = parse(&bytes).unwrap();
            assert_eq!(read.shape, shape);
            assert_eq!(read.values, [0.0, -1.5, f64::INFINITY, f64::from(1e-40_f32), 3.0, 7.0]);
        }
    }

    #[test]
    fn doubles_and_big_endian_are_read() {
        let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (2,), }\n";
        let data = [0.1_f64.to_le_bytes(), 2.0_f64.to_le_bytes()].concat();
        assert_eq!(parse(&file(header, &data)).unwrap().values, [0.1, 2.0]);
        let header = "{'shape': (1, 1), 'fortran_order': False, 'descr': '>f4'}\n";
        assert_eq!(parse(&file(header, &2.5_f32.to_be_bytes())).unwrap().values, [2.5]);
    }

    #[test]
    fn bad_files_say_what_is_wrong() {
        let cases: [(&[u8], &str); 6] = [
            (b"", "no complete header"),
            (b"\x93NUMPY\x01\x00\xff\xff{}", "no complete header"),
            (&file("{'fortran_order': False, 'shape': (1,)}", &[0; 4]), "descr"),
            (&file("{'descr': '<i4', 'fortran_order': False, 'shape': (1,)}", &[0; 4]), "<i4"),
            (&file("{'descr': '<f4', 'fortran_order': True, 'shape': (1,)}", &[0; 4]), "Fortran"),
            (&file("{'descr': '<f4', 'fortran_order': False, 'shape': (9999999999, 9999999999)}", &[0; 4]), "shape"),
        ];
        for (bytes, expected) in cases {
            let message = parse(bytes).unwrap_err().to_string();
            assert!(message.contains(expected) && message.starts_with("x.npy: "), "{message}");
        }
    }
}
