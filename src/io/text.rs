//! The numbers of an array that is text.

use super::data::{ArrayFault, CHUNK, Put};
use super::input::Opened;
use super::number::{Kind, Number, with_kind};
use crate::memory;
use rayon::prelude::*;
use std::ops::Range;

/// The text of an array between its tags, parts separated by a space.
pub(super) fn read(file: &Opened, ranges: &[Range<u64>]) -> Result<Vec<u8>, ArrayFault> {
    let mut text = Vec::new();
    let length: u64 = ranges.iter().map(|range| range.end - range.start + 1).sum();
    memory::reserve("the text of an array", &mut text, length as usize)?;
    for range in ranges {
        let (at, start) = (text.len(), range.start);
        text.resize(at + (range.end - start) as usize, 0);
        text[at..]
            .par_chunks_mut(CHUNK)
            .enumerate()
            .try_for_each(|(i, chunk)| file.read_at(start + (i * CHUNK) as u64, chunk))?;
        text.push(b' ');
    }
    Ok(text)
}

/// How many words there are.
pub(super) fn count(text: &[u8]) -> u64 {
    parts(text).par_iter().map(|part| tokens(part).count() as u64).sum()
}

/// Cuts a text into chunks, between numbers.
fn parts(mut text: &[u8]) -> Vec<&[u8]> {
    let mut parts = Vec::new();
    while !text.is_empty() {
        let end = text.iter().skip(CHUNK).position(u8::is_ascii_whitespace).map_or(text.len(), |i| CHUNK + i);
        let (part, rest) = text.split_at(end);
        parts.push(part);
        text = rest;
    }
    parts
}

/// Parses the numbers of an ascii array, as many as `out` has place for.
pub(super) fn parse(kind: Kind, text: &[u8], out: &mut [u8], size: usize, put: &Put<'_>) -> Result<(), String> {
    let parts = parts(text);
    let counts: Vec<usize> = parts.par_iter().map(|part| tokens(part).count()).collect();
    let (mut rest, mut first) = (out, 0);
    let mut jobs = Vec::new();
    for (part, count) in parts.iter().zip(counts) {
        let (place, after) = rest.split_at_mut(count * size);
        jobs.push((first, *part, place));
        (rest, first) = (after, first + count);
    }
    jobs.into_par_iter().try_for_each(
        |(first, part, place)| with_kind!(kind, T => put(first, bytemuck::cast_slice(&numbers::<T>(part)?), place)),
    )
}

fn numbers<T: Number>(text: &[u8]) -> Result<Vec<T>, String> {
    let number = |token: &[u8]| {
        std::str::from_utf8(token).ok().and_then(T::parse).ok_or_else(|| {
            let token = String::from_utf8_lossy(&token[..token.len().min(40)]);
            format!("\"{}\" is not a number of its type", token.escape_debug())
        })
    };
    tokens(text).map(number).collect()
}

fn tokens(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    text.split(u8::is_ascii_whitespace).filter(|token| !token.is_empty())
}
