//! Pieces to one mesh: points, and the arrays of points and cells.

use super::head::{Piece, Section};
use super::topology::Topology;
use crate::error::{Error, Result};
use crate::io::data::{DataArray, Store};
use crate::io::number::{Number, with_kind};
use crate::io::{Progress, validated};
use crate::memory;
use crate::mesh::{Array, LeftOut, Mesh};
use glam::DVec3;
use rayon::prelude::*;
use std::collections::{BTreeSet, HashMap};
use std::fmt::Display;
use std::path::Path;

/// A grid whose head has been read.
pub(super) struct Grid<'a> {
    pub(super) path: &'a Path,
    pub(super) stores: Vec<&'a Store>,
    pub(super) pieces: Vec<Piece>,
    pub(super) progress: Progress<'a>,
}

/// The arrays of points or cells, and those that had to be left out.
pub(super) type Data = (Vec<Array>, Vec<LeftOut>);

/// Which arrays of points and of cells were left out.
pub(super) type LeftOutBoth = [Vec<LeftOut>; 2];

impl Grid<'_> {
    /// Reads the arrays, and makes one mesh of all pieces. Also says which arrays of points and of cells it left out.
    pub(super) fn mesh(&self) -> Result<(Mesh, LeftOutBoth)> {
        let points = self.pieces.iter().fold(0u64, |sum, piece| sum.saturating_add(piece.points));
        if points >= u64::from(u32::MAX) {
            let what = format!("{points} points are more than Halite can index (2^32 - 2)");
            return Err(Error::unsupported(self.path, what));
        }
        let data = || rayon::join(|| self.data(Section::PointData), || self.data(Section::CellData));
        let (topology, (points, (point_arrays, cell_arrays))) =
            rayon::join(|| self.topology(), || rayon::join(|| self.points(), data));
        let (points, Topology { cells, polyhedra }) = (points?, topology?);
        let ((point_arrays, of_points), (cell_arrays, of_cells)) = (point_arrays?, cell_arrays?);
        let mesh = Mesh::new(points, cells, point_arrays, cell_arrays);
        let mesh = mesh.and_then(|mesh| match polyhedra {
            Some(polyhedra) => mesh.with_polyhedra(polyhedra),
            None => Ok(mesh),
        });
        Ok((validated(self.path, mesh)?, [of_points, of_cells]))
    }

    pub(super) fn store(&self, piece: &Piece) -> &Store {
        self.stores[piece.store]
    }

    pub(super) fn malformed(&self, piece: &Piece, what: impl Into<String>) -> Error {
        Error::malformed(&self.store(piece).input.path, what)
    }

    pub(super) fn points(&self) -> Result<Vec<DVec3>> {
        let read = |(i, piece): (usize, &Piece)| {
            let fail = |what: &str| self.malformed(piece, format!("the Points of piece {i} {what}"));
            match piece.arrays(Section::Points).first() {
                None if piece.points == 0 => Ok(Vec::new()),
                None => Err(fail("are missing")),
                Some(array) if array.components != 3 => {
                    Err(fail(&format!("have {} components, not 3", array.components)))
                }
                Some(array) => self.floats(piece, array, piece.points),
            }
        };
        let parts = self.pieces.par_iter().enumerate().map(read).collect::<Result<Vec<_>>>()?;
        let numbers = joined("its points", parts)?;
        memory::check_array::<f64>("its points", numbers.len())?;
        Ok(numbers.par_chunks_exact(3).map(DVec3::from_slice).collect())
    }

    /// Reads indices of any number type, all that there are or so many. `check` turns each into what is kept, or
    /// `explain` says what is wrong with it: it gets the place of the number, and its value if it is a whole number
    /// from 0 up.
    pub(super) fn indices<U: bytemuck::Pod>(
        &self,
        piece: &Piece,
        array: &DataArray,
        count: Option<u64>,
        check: impl Fn(u64) -> Option<U> + Sync,
        explain: impl Fn(usize, Option<u64>) -> String + Sync,
    ) -> Result<Vec<U>> {
        let contents = self.store(piece).array(array)?;
        let count = count.unwrap_or_else(|| contents.count());
        contents.read(count, &self.progress, &|first, numbers, out| {
            let mut out = bytemuck::cast_slice_mut::<u8, U>(out).iter_mut();
            with_kind!(array.kind, T => for (i, number) in bytemuck::cast_slice::<u8, T>(numbers).iter().enumerate() {
                let index = number.index();
                let kept = index.and_then(&check).ok_or_else(|| explain(first + i, index))?;
                if let Some(out) = out.next() {
                    *out = kept;
                }
            });
            Ok(())
        })
    }

    /// Reads numbers of any type as f64.
    pub(super) fn floats(&self, piece: &Piece, array: &DataArray, tuples: u64) -> Result<Vec<f64>> {
        let count = tuples.saturating_mul(array.components as u64);
        self.store(piece).array(array)?.read(count, &self.progress, &|_, numbers, out| {
            let out = bytemuck::cast_slice_mut::<u8, f64>(out);
            with_kind!(array.kind, T => for (number, out) in bytemuck::cast_slice::<u8, T>(numbers).iter().zip(out) {
                *out = number.float();
            });
            Ok(())
        })
    }

    /// Reads bits, the highest of a byte first, as 0 and 1; numbers of another type as what a byte holds of them.
    fn bits(&self, piece: &Piece, array: &DataArray, tuples: u64) -> Result<Vec<u8>> {
        if !array.bits {
            let floats = self.floats(piece, array, tuples)?;
            memory::check_array::<u8>(array, floats.len())?;
            return Ok(floats.into_iter().map(|x| x as u8).collect());
        }
        let count = tuples.saturating_mul(array.components as u64);
        let bytes: Vec<u8> =
            self.store(piece).array(array)?.read(count.div_ceil(8), &self.progress, &|_, numbers, out| {
                out.copy_from_slice(numbers);
                Ok(())
            })?;
        memory::check_array::<u8>(array, count as usize)?;
        Ok((0..count as usize).map(|i| bytes[i / 8] >> (7 - i % 8) & 1).collect::<Vec<u8>>())
    }

    /// The arrays of point or cell data that all pieces have, pieces with no points (or cells) aside, as far as they are
    /// whole.
    pub(super) fn data(&self, section: Section) -> Result<Data> {
        let filled: Vec<&Piece> = self.pieces.iter().filter(|piece| piece.tuples(section) > 0).collect();
        let filled = if filled.is_empty() { self.pieces.iter().take(1).collect() } else { filled };
        let found: Vec<HashMap<Key<'_>, &DataArray>> =
            filled.iter().map(|piece| keyed(piece.arrays(section)).collect()).collect();
        let mut lost: BTreeSet<Key<'_>> = found.iter().flat_map(|arrays| arrays.keys().copied()).collect();
        let mut kept = Vec::new();
        for (key, array) in filled.iter().take(1).flat_map(|piece| keyed(piece.arrays(section))) {
            let parts = filled.iter().zip(&found).map(|(piece, arrays)| {
                let part = arrays.get(&key).filter(|part| part.components == array.components)?;
                Some((*piece, *part))
            });
            if let Some(parts) = parts.collect::<Option<Vec<_>>>() {
                lost.remove(&key);
                kept.push(parts);
            }
        }
        let lost = lost.iter().map(|key| {
            let (of, name) = (section.name(), key.0.to_owned());
            let why =
                format!("not every piece has the {of} array \"{}\", with as many components", name.escape_debug());
            LeftOut { name, why }
        });
        let mut left_out: Vec<LeftOut> = lost.collect();
        let read = |parts: &Vec<(&Piece, &DataArray)>| self.data_array(section, parts);
        let mut arrays = Vec::new();
        for (read, parts) in kept.par_iter().map(read).collect::<Vec<_>>().into_iter().zip(&kept) {
            match read {
                Ok(array) => arrays.push(array),
                // Without it the grid is still whole.
                Err(Error::Malformed { what, .. } | Error::Unsupported { what, .. }) => {
                    let name = parts.first().map(|(_, array)| array.name.clone()).unwrap_or_default();
                    left_out.push(LeftOut { name, why: what });
                }
                Err(error) => return Err(error),
            }
        }
        Ok((arrays, left_out))
    }

    /// One array of its parts in the pieces.
    fn data_array(&self, section: Section, parts: &[(&Piece, &DataArray)]) -> Result<Array> {
        let Some((_, first)) = parts.first() else {
            return Err(Error::malformed(self.path, "no piece has arrays"));
        };
        let values = if parts.iter().any(|(_, part)| part.bits) {
            let bits = parts.iter().map(|(piece, part)| self.bits(piece, part, piece.tuples(section)));
            u8::values(joined(first, bits.collect::<Result<Vec<_>>>()?)?)
        } else if parts.iter().all(|(_, part)| part.kind == first.kind) {
            with_kind!(first.kind, T => {
                let read = |(piece, part): &(&Piece, &DataArray)| {
                    let count = piece.tuples(section).saturating_mul(part.components as u64);
                    self.store(piece).array(part)?.read(count, &self.progress, &|_, numbers, out| {
                        out.copy_from_slice(numbers);
                        Ok(())
                    })
                };
                T::values(joined(first, parts.iter().map(read).collect::<Result<Vec<_>>>()?)?)
            })
        } else {
            let (path, name) = (self.path.display(), &first.name);
            tracing::warn!(
                "{path}: {} array \"{name}\" is read as Float64: its type differs from piece to piece",
                first.section
            );
            let floats = parts.iter().map(|(piece, part)| self.floats(piece, part, piece.tuples(section)));
            f64::values(joined(first, floats.collect::<Result<Vec<_>>>()?)?)
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
pub(super) fn joined<T: Copy>(what: impl Display, mut parts: Vec<Vec<T>>) -> Result<Vec<T>> {
    if parts.len() == 1 {
        return Ok(parts.swap_remove(0));
    }
    let mut all = Vec::new();
    memory::reserve(what, &mut all, parts.iter().map(Vec::len).sum())?;
    parts.iter().for_each(|part| all.extend_from_slice(part));
    Ok(all)
}
