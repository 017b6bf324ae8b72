//! Which cell of a mesh is before which, and Kahn's algorithm (1962) over all of it.
//!
//! A cell is before its neighbours beyond the faces that are turned away ([`super::facing`]), and a cell through which a ray leaves
//! the mesh before the one through which it enters again ([`super::gaps`]). Cells whose turn has come wait in buckets by depth, and
//! the nearest bucket is emptied at once: its cells do not depend on each other, so memory finds many of them at a time.

use super::facing::{Facing, Source};
use super::gaps::Gap;
use crate::geometry::{Cell, TetMesh};
use crate::mesh::faces::BOUNDARY;
use rayon::prelude::*;

/// Buckets of cells by depth.
const BUCKETS: usize = 1 << 12;

/// Cells whose neighbours are released at a time.
const AT_ONCE: usize = 64;

/// The bits of a node: its [`Facing::behind`], whether gaps begin at the cell, its bucket, and from the last one on how many cells
/// that come before it have not had their turn.
const GAPS: u64 = 1 << 4;
const BUCKET: u32 = 8;
const BEFORE: u32 = 32;
const ONE: u64 = 1 << BEFORE;

/// An edge of the graph, by what it comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Edge {
    /// The face of a cell opposite to this corner.
    Face(u32, u8),
    /// The gap of this index.
    Gap(u32),
}

/// Which cells come before which.
pub(super) struct Graph<'a> {
    cells: &'a [Cell],
    nodes: Vec<u64>,
    /// Ascending.
    pub(super) gaps: Vec<Gap>,
}

/// The cells whose turn has come, in buckets, and bits of those that are not empty.
struct Queue {
    buckets: Vec<Vec<u32>>,
    full: [u64; BUCKETS / 64],
    words: u64,
}

impl Queue {
    fn new() -> Self {
        Queue { buckets: vec![vec![]; BUCKETS], full: [0; BUCKETS / 64], words: 0 }
    }

    #[inline(always)]
    fn push(&mut self, cell: u32, node: u64) {
        let bucket = (node >> BUCKET) as usize & (BUCKETS - 1);
        self.buckets[bucket].push(cell);
        self.full[bucket / 64] |= 1 << (bucket % 64);
        self.words |= 1 << (bucket / 64);
    }

    /// Exchanges the nearest bucket for `empty`; false if all are empty.
    fn pop(&mut self, empty: &mut Vec<u32>) -> bool {
        if self.words == 0 {
            return false;
        }
        let word = self.words.trailing_zeros() as usize;
        let bucket = 64 * word + self.full[word].trailing_zeros() as usize;
        self.full[word] &= self.full[word] - 1;
        self.words &= !(u64::from(self.full[word] == 0) << word);
        std::mem::swap(empty, &mut self.buckets[bucket]);
        true
    }
}

impl<'a> Graph<'a> {
    /// The graph of a mesh whose cells know their neighbours, with these gaps, ascending.
    pub(super) fn new(geometry: &'a TetMesh, source: Source, gaps: Vec<Gap>) -> Self {
        let [near, far] = source.depths(geometry.boundary.bounds());
        let step = (BUCKETS - 1) as f64 / (far - near).max(f64::MIN_POSITIVE);
        let node = |i: usize| {
            let (facing, middle) = Facing::new(geometry, source, i);
            let bucket = ((source.depth(middle) - near) * step).clamp(0.0, (BUCKETS - 1) as f64) as u64;
            u64::from(facing.behind) | bucket << BUCKET | u64::from(facing.before.count_ones()) << BEFORE
        };
        let mut nodes = Vec::new();
        (0..geometry.cells.len()).into_par_iter().with_min_len(4096).map(node).collect_into_vec(&mut nodes);
        for gap in &gaps {
            nodes[gap.from as usize] |= GAPS;
            nodes[gap.to as usize] += ONE;
        }
        Graph { cells: &geometry.cells, nodes, gaps }
    }

    pub(super) fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether a cell waits for others.
    pub(super) fn waits(&self, cell: u32) -> bool {
        self.nodes[cell as usize] >= ONE
    }

    /// Where a cell is in depth, roughly.
    pub(super) fn bucket(&self, cell: u32) -> u64 {
        self.nodes[cell as usize] >> BUCKET & (BUCKETS as u64 - 1)
    }

    /// The indices of the gaps that begin at a cell.
    fn gaps_of(&self, cell: u32) -> std::ops::Range<usize> {
        if self.nodes[cell as usize] & GAPS == 0 {
            return 0..0;
        }
        let from = self.gaps.partition_point(|g| g.from < cell);
        from..from + self.gaps[from..].partition_point(|g| g.from == cell)
    }

    /// Calls `found` with each cell that comes after `cell`, and why it does.
    #[inline(always)]
    pub(super) fn for_each_after(&self, cell: u32, mut found: impl FnMut(u32, Edge)) {
        let mut faces = self.nodes[cell as usize] & 15;
        while faces != 0 {
            let k = faces.trailing_zeros();
            faces &= faces - 1;
            found(self.cells[cell as usize].neighbours[k as usize], Edge::Face(cell, k as u8));
        }
        for gap in self.gaps_of(cell) {
            if !self.gaps[gap].is_cut {
                found(self.gaps[gap].to, Edge::Gap(gap as u32));
            }
        }
    }

    /// The cell that an edge leads to.
    pub(super) fn end(&self, edge: Edge) -> u32 {
        match edge {
            Edge::Face(cell, k) => self.cells[cell as usize].neighbours[k as usize],
            Edge::Gap(gap) => self.gaps[gap as usize].to,
        }
    }

    /// Takes an edge away. Its two cells have not had their turns.
    pub(super) fn cut(&mut self, edge: Edge) {
        let to = self.end(edge);
        debug_assert_ne!(to, BOUNDARY);
        match edge {
            Edge::Face(cell, k) => self.nodes[cell as usize] &= !(1 << k),
            Edge::Gap(gap) => self.gaps[gap as usize].is_cut = true,
        }
        self.nodes[to as usize] -= ONE;
    }

    /// Appends all cells of `waiting` whose turn has come, and those whose turn comes by that, from front to back. Those that are in
    /// cycles, and those after them, stay.
    pub(super) fn sweep(&mut self, waiting: impl Iterator<Item = u32>, sequence: &mut Vec<u32>) {
        let mut queue = Queue::new();
        for cell in waiting {
            let node = self.nodes[cell as usize];
            if node < ONE {
                queue.push(cell, node);
            }
        }
        let (mut batch, mut after, mut left) = (vec![], [0; 4 * AT_ONCE], [0; 4 * AT_ONCE]);
        while queue.pop(&mut batch) {
            sequence.extend_from_slice(&batch);
            for cells in batch.chunks(AT_ONCE) {
                let (count, has_gaps) = self.after_all(cells, &mut after);
                for (left, &cell) in left.iter_mut().zip(&after[..count]) {
                    let node = &mut self.nodes[cell as usize];
                    *node -= ONE;
                    *left = *node;
                }
                for (&node, &cell) in left[..count].iter().zip(&after) {
                    if node < ONE {
                        queue.push(cell, node);
                    }
                }
                if has_gaps {
                    self.release_gaps(cells, &mut queue);
                }
            }
            batch.clear();
        }
    }

    /// Gathers the neighbours behind each of some cells, at most [`AT_ONCE`], and how many these are; and whether any gap begins at
    /// the cells. Nothing is decided by what memory has to find: it is asked for all of it at a time.
    #[inline(always)]
    fn after_all(&self, cells: &[u32], after: &mut [u32; 4 * AT_ONCE]) -> (usize, bool) {
        let mut known = [(0, [0; 4]); AT_ONCE];
        for (known, &cell) in known.iter_mut().zip(cells) {
            *known = (self.nodes[cell as usize], self.cells[cell as usize].neighbours);
        }
        let (mut count, mut all) = (0, 0);
        for (node, neighbours) in &known[..cells.len()] {
            all |= node;
            for (k, &neighbour) in neighbours.iter().enumerate() {
                // What is not behind is written over.
                after[count] = neighbour;
                count += (node >> k & 1) as usize;
            }
        }
        (count, all & GAPS != 0)
    }

    /// Releases the cells beyond the gaps that begin at some cells.
    fn release_gaps(&mut self, cells: &[u32], queue: &mut Queue) {
        for &cell in cells {
            for gap in self.gaps_of(cell) {
                if !self.gaps[gap].is_cut {
                    release(&mut self.nodes, queue, self.gaps[gap].to);
                }
            }
        }
    }
}

/// One of the cells before `cell` has had its turn.
#[inline(always)]
fn release(nodes: &mut [u64], queue: &mut Queue, cell: u32) {
    let node = &mut nodes[cell as usize];
    *node -= ONE;
    if *node < ONE {
        queue.push(cell, *node);
    }
}
