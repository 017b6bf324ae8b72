//! Order: a sequence of a tile's cells from front to back.
//!
//! Cells follow one another by Kahn's algorithm (1962). A cell comes before the neighbours beyond its faces that are turned away; a
//! cell through which a ray leaves the mesh comes before the one through which that ray enters it again (Silva, Mitchell & Williams
//! 1998, XMPVO). Both hold for every ray, so the sequence is right for all of the tile's pixels, unless cells hide each other in a
//! circle or overlap.

use super::setup::{Look, Record};
use crate::geometry::Geometry;
use crate::mesh::faces::BOUNDARY;
use crate::order::crossings::Crossings;

/// The order of a tile's cells, being drawn.
#[derive(Debug, Default)]
pub(super) struct Order {
    nodes: Vec<Node>,
    /// Pairs of cells that boundary faces order, by the first.
    gaps: Vec<(u32, u32)>,
    free: Vec<u32>,
    search: usize,
    left: usize,
}

/// A cell in the order.
#[derive(Debug, Clone, Copy)]
struct Node {
    /// Cells behind its faces.
    next: [u32; 4],
    /// Number of cells that come before it and have not been drawn.
    before: u32,
    /// One more than the place of its first pair among the gaps; 0 if it has none.
    gaps: u32,
}

/// Has been drawn.
const DONE: u32 = u32::MAX;

impl Order {
    /// Finds which of a tile's cells come after which. `place` is all zeros, one for each cell of the mesh, and is again.
    pub(super) fn find<const N: usize>(
        &mut self,
        geometry: &Geometry,
        records: &[Record<N>],
        cells: &[u32],
        crossings: &Crossings,
        place: &mut [u32],
    ) {
        for (i, &cell) in cells.iter().enumerate() {
            place[cell as usize] = i as u32 + 1;
        }
        self.nodes.clear();
        self.nodes.resize(records.len(), Node { next: [BOUNDARY; 4], before: 0, gaps: 0 });
        for (i, (r, &cell)) in records.iter().zip(cells).enumerate() {
            if r.look == Look::Empty {
                continue;
            }
            let around = geometry.cells[cell as usize].neighbours;
            for k in 0..4 {
                if r.away >> k & 1 == 1 && around[k] != BOUNDARY {
                    let behind = place[around[k] as usize];
                    if behind > 0 {
                        self.nodes[i].next[k] = behind - 1;
                        self.nodes[behind as usize - 1].before += 1;
                    }
                }
            }
        }
        self.gaps.clear();
        let gaps = &mut self.gaps;
        // Gaps of the last pixel, by their number along its ray: neighbouring pixels mostly have the same.
        let mut last = [(u32::MAX, u32::MAX); 16];
        let (mut of_pixel, mut number) = (usize::MAX, 0);
        crossings.for_each_gap(|pixel, a, b| {
            if of_pixel != pixel {
                (of_pixel, number) = (pixel, 0);
            }
            let known = std::mem::replace(&mut last[number % 16], (a, b)) == (a, b);
            number += 1;
            let (a, b) = (place[a as usize], place[b as usize]);
            if !known && a > 0 && b > 0 {
                gaps.push((a - 1, b - 1));
            }
        });
        self.gaps.sort_unstable();
        self.gaps.dedup();
        for (at, &(a, b)) in self.gaps.iter().enumerate() {
            self.nodes[b as usize].before += 1;
            if at == 0 || self.gaps[at - 1].0 != a {
                self.nodes[a as usize].gaps = at as u32 + 1;
            }
        }
        for &cell in cells {
            place[cell as usize] = 0;
        }
        self.free.clear();
        self.free.extend((0..records.len() as u32).rev().filter(|&i| self.nodes[i as usize].before == 0));
        (self.search, self.left) = (0, records.len());
    }

    /// Cells behind the faces of cell `i`, or [`BOUNDARY`].
    pub(super) fn behind(&self, i: usize) -> [u32; 4] {
        self.nodes[i].next
    }

    /// The next cell. Where all that are left wait for each other, the first of them goes on.
    pub(super) fn next(&mut self) -> Option<usize> {
        if self.left == 0 {
            return None;
        }
        let i = match self.free.pop() {
            Some(i) => i as usize,
            None => {
                while matches!(self.nodes[self.search].before, 0 | DONE) {
                    self.search += 1;
                }
                self.search
            }
        };
        self.left -= 1;
        self.nodes[i].before = DONE;
        for n in self.nodes[i].next {
            if n != BOUNDARY {
                self.release(n);
            }
        }
        if let Some(from) = (self.nodes[i].gaps as usize).checked_sub(1) {
            for g in from..self.gaps.len() {
                let (before, after) = self.gaps[g];
                if before as usize != i {
                    break;
                }
                self.release(after);
            }
        }
        Some(i)
    }

    /// One of the cells before cell `n` has been drawn.
    #[inline(always)]
    fn release(&mut self, n: u32) {
        let before = &mut self.nodes[n as usize].before;
        if *before != DONE && *before > 0 {
            *before -= 1;
            if *before == 0 {
                self.free.push(n);
            }
        }
    }
}
