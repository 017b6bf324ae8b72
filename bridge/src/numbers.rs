//! Numbers of a type that is known only when the program runs, as Rust's.

use super::bridge::{Numbers, Type};
use glam::DVec3;
use halite::error::{Error, Result};
use halite::memory;
use halite::mesh::Values;
use rayon::prelude::*;

/// The numbers of a slice that is known to hold some type.
pub(super) fn cast<'a, T: bytemuck::Pod>(numbers: &Numbers<'a>) -> Result<&'a [T]> {
    if numbers.bytes.is_empty() {
        return Ok(&[]);
    }
    bytemuck::try_cast_slice(numbers.bytes).map_err(|e| {
        Error::Mesh(format!("the address or the size of an array does not fit the type of its numbers: {e}"))
    })
}

/// Bytes of one number.
fn size_of(kind: Type) -> usize {
    match kind {
        Type::I8 | Type::U8 => 1,
        Type::I16 | Type::U16 => 2,
        Type::I32 | Type::U32 | Type::F32 => 4,
        _ => 8,
    }
}

/// A copy of numbers.
pub(super) fn values(numbers: &Numbers) -> Result<Values> {
    Ok(match numbers.kind {
        Type::I8 => Values::I8(copied(numbers)?),
        Type::U8 => Values::U8(copied(numbers)?),
        Type::I16 => Values::I16(copied(numbers)?),
        Type::U16 => Values::U16(copied(numbers)?),
        Type::I32 => Values::I32(copied(numbers)?),
        Type::U32 => Values::U32(copied(numbers)?),
        Type::I64 => Values::I64(copied(numbers)?),
        Type::U64 => Values::U64(copied(numbers)?),
        Type::F32 => Values::F32(copied(numbers)?),
        _ => Values::F64(copied(numbers)?),
    })
}

fn copied<T: bytemuck::Pod>(numbers: &Numbers) -> Result<Vec<T>> {
    memory::copied("a copy of an array", cast(numbers)?)
}

/// Points, of coordinates of any type.
pub(super) fn triples(numbers: &Numbers) -> Result<Vec<DVec3>> {
    let count = numbers.bytes.len() / size_of(numbers.kind);
    if !count.is_multiple_of(3) {
        return Err(Error::Mesh(format!("points have three coordinates each, and here are {count} numbers")));
    }
    memory::check_array::<f64>("a copy of the points", count)?;
    match numbers.kind {
        Type::F64 => Ok(cast::<f64>(numbers)?.as_chunks().0.par_iter().map(|&p| DVec3::from_array(p)).collect()),
        Type::F32 => {
            let points = cast::<f32>(numbers)?.as_chunks().0;
            Ok(points.par_iter().map(|p: &[f32; 3]| DVec3::from_array(p.map(f64::from))).collect())
        }
        _ => {
            let values = values(numbers)?;
            Ok((0..count / 3).map(|p| DVec3::from_array([0, 1, 2].map(|k| values.get(3 * p + k)))).collect())
        }
    }
}

/// Integers from 0 on.
pub(super) fn indices(what: &str, numbers: Numbers) -> Result<Vec<u64>> {
    let negative = || Error::Mesh(format!("{what} are negative, or no integers"));
    memory::check_array::<u64>(format_args!("a copy of the {what}"), numbers.bytes.len() / size_of(numbers.kind))?;
    match numbers.kind {
        Type::I32 => cast::<i32>(&numbers)?.par_iter().map(|&i| u64::try_from(i).map_err(|_| negative())).collect(),
        Type::I64 => cast::<i64>(&numbers)?.par_iter().map(|&i| u64::try_from(i).map_err(|_| negative())).collect(),
        Type::U32 => Ok(cast::<u32>(&numbers)?.iter().map(|&i| u64::from(i)).collect()),
        Type::U64 => copied(&numbers),
        _ => Err(negative()),
    }
}

pub(super) fn point_ids(numbers: Numbers) -> Result<Vec<u32>> {
    let narrow = |i: u64| u32::try_from(i).map_err(|_| Error::Mesh(format!("a cell names point {i}")));
    match numbers.kind {
        Type::U32 => copied(&numbers),
        _ => {
            let wide = indices("point indices", numbers)?;
            memory::check_array::<u32>("a copy of the point indices", wide.len())?;
            wide.into_par_iter().map(narrow).collect()
        }
    }
}
