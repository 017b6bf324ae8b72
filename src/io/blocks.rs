//! Blocks of grids whose points are counted along axes: pieces of files, and the whole that they make.

use crate::error::{Error, Result};
use crate::memory;
use crate::mesh::{Array, Values};
use std::path::Path;

/// How many times as many points the whole may have as its pieces: what lies between them is left out, and takes memory.
const SPARSEST: u64 = 64;

/// The points of a grid from one index to another along each axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Block {
    /// The first index along each axis.
    pub(super) low: [i64; 3],
    /// Points along each axis; all 0 if there is none.
    pub(super) size: [u64; 3],
}

/// What is counted: points, or the cells between them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Of {
    Points,
    Cells,
}

/// Where no piece has a point or cell of the whole.
pub(super) const NOWHERE: usize = usize::MAX;

impl Block {
    /// From a first to a last index along each axis; without points if one of these is before the first.
    pub(super) fn new(extent: [[i64; 2]; 3]) -> Self {
        let size = extent.map(|[low, high]| u64::try_from(high - low + 1).unwrap_or(0));
        Block { low: extent.map(|e| e[0]), size: if size.contains(&0) { [0; 3] } else { size } }
    }

    fn is_empty(&self) -> bool {
        self.size[0] == 0
    }

    /// Number of points; none if that overflows.
    pub(super) fn points(&self) -> Option<u64> {
        product(self.counted(Of::Points))
    }

    /// Number of cells, of as many dimensions as there are axes with more than one point.
    pub(super) fn cells(&self) -> Option<u64> {
        product(self.counted(Of::Cells))
    }

    /// Points or cells along each axis.
    fn counted(&self, of: Of) -> [u64; 3] {
        if of == Of::Points || self.is_empty() { self.size } else { self.size.map(|n| (n - 1).max(1)) }
    }

    /// The smallest block around others, those without points aside.
    pub(super) fn around(blocks: &[Block]) -> Option<Block> {
        let filled = blocks.iter().filter(|block| !block.is_empty());
        filled.copied().reduce(|a, b| {
            let low = [0, 1, 2].map(|i| a.low[i].min(b.low[i]));
            let end = |block: &Block, i: usize| block.low[i] + block.size[i] as i64;
            Block { low, size: [0, 1, 2].map(|i| (end(&a, i).max(end(&b, i)) - low[i]) as u64) }
        })
    }

    /// For each point or cell, in sequence, its place in a list of those of all `pieces`, one piece after another; of
    /// several, the first that `ghost` does not mark; [`NOWHERE`] if there is none.
    ///
    /// # Errors
    /// [`Error::Malformed`] if pieces are far apart, [`Error::NoMemory`].
    pub(super) fn sources(
        &self,
        path: &Path,
        pieces: &[Block],
        of: Of,
        ghost: &dyn Fn(usize) -> bool,
    ) -> Result<Vec<usize>> {
        let size = self.counted(of);
        let there: u64 = pieces.iter().filter_map(Block::points).fold(0, u64::saturating_add);
        let Some(count) = product(size).filter(|n| n / SPARSEST <= there) else {
            return Err(Error::malformed(path, "its pieces are far apart"));
        };
        let mut sources = memory::filled("the pieces of a grid", NOWHERE, count as usize)?;
        let mut base = 0;
        for piece in pieces {
            let own = piece.counted(of);
            // A piece without cells of the whole's dimensions has none of its cells.
            let fits = of == Of::Points || (0..3).all(|i| piece.size[i] > 1 || self.size[i] <= 1);
            let start = [0, 1, 2].map(|i| (piece.low[i] - self.low[i]) as u64);
            for row in 0..if fits { own[1] * own[2] } else { 0 } {
                let (j, k) = (row % own[1], row / own[1]);
                let to = (((start[2] + k) * size[1] + start[1] + j) * size[0] + start[0]) as usize;
                let from = base + (row * own[0]) as usize;
                for (i, place) in sources[to..to + own[0] as usize].iter_mut().enumerate() {
                    if *place == NOWHERE || ghost(*place) && !ghost(from + i) {
                        *place = from + i;
                    }
                }
            }
            base += product(own).unwrap_or_default() as usize;
        }
        Ok(sources)
    }
}

fn product(size: [u64; 3]) -> Option<u64> {
    size.iter().try_fold(1_u64, |product, n| product.checked_mul(*n))
}

/// The name of VTK's array that marks ghosts.
pub(super) const GHOSTS: &str = "vtkGhostType";

/// The mark of points and cells that another piece has, too.
const DUPLICATE: u8 = 1;

/// The mark of cells that are not there.
const HIDDEN: u8 = 32;

/// Which of the points or cells that these arrays describe another piece has.
pub(super) fn duplicates(arrays: &[Array]) -> impl Fn(usize) -> bool + '_ {
    let marks = arrays.iter().find(|array| array.name == GHOSTS && array.components == 1);
    move |i| marks.is_some_and(|marks| i < marks.values.len() && marks.values.get(i) as u8 & DUPLICATE != 0)
}

/// Brings arrays of all pieces into the sequence of the whole.
pub(super) fn gather(arrays: &mut [Array], sources: &[usize]) {
    for array in arrays {
        array.values = array.values.gathered(array.components, sources);
    }
}

/// Marks cells that no piece has.
pub(super) fn hide_missing(arrays: &mut Vec<Array>, sources: &[usize]) {
    if !sources.contains(&NOWHERE) {
        return;
    }
    let known = arrays.iter().position(|array| array.name == GHOSTS && array.components == 1);
    let mark = |(i, source): (usize, &usize)| match known {
        _ if *source == NOWHERE => HIDDEN,
        Some(known) => arrays[known].values.get(i) as u8,
        None => 0,
    };
    let values = Values::U8(sources.iter().enumerate().map(mark).collect());
    match known {
        Some(known) => arrays[known].values = values,
        None => arrays.push(Array { name: GHOSTS.to_owned(), components: 1, values }),
    }
}
