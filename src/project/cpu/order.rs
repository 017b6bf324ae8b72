//! Order: a sequence of a tile's cells from front to back.
//!
//! Cells follow one another by Kahn's algorithm (1962). A cell comes before the neighbours beyond its faces that are turned away; a
//! cell through which a ray leaves the mesh comes before the one through which that ray enters it again (Silva, Mitchell & Williams
//! 1998, XMPVO). Both hold for every ray, so the sequence is right for all of the tile's pixels, unless cells hide each other in a
//! circle or overlap.

use super::setup::{Look, Records};
use crate::order::crossings::Crossings;

/// The order of a tile's cells, being drawn. Cells are numbered from 1 here; 0 stands for none, and is never free. So there is nothing to
/// decide for most faces, which processors would foresee badly.
#[derive(Debug, Default)]
pub(super) struct Order {
    /// Cells behind each cell's faces.
    next: Vec<[u32; 4]>,
    /// Number of cells that come before each cell and have not been drawn.
    before: Vec<u32>,
    /// Pairs of cells that boundary faces order, by the first.
    gaps: Vec<(u32, u32)>,
    /// One more than the place of each cell's first pair among the gaps, or 0; empty if there are no gaps.
    first_gap: Vec<u32>,
    /// Cells that no other comes before, in the order in which they became so: `free` of them, of which `taken` have been drawn.
    queue: Vec<u32>,
    free: usize,
    taken: usize,
    search: usize,
    left: usize,
}

/// More than cells that come before any.
const NEVER: u32 = 1 << 31;

impl Order {
    /// Finds which of a tile's cells come after which. `place` is all zeros, one for each cell of the mesh and one more, and is again.
    pub(super) fn find<const N: usize>(
        &mut self,
        records: &Records<N>,
        cells: &[u32],
        crossings: &Crossings,
        place: &mut [u32],
    ) {
        let count = records.all.len();
        let none = place.len() - 1;
        for (i, &cell) in cells.iter().enumerate() {
            place[cell as usize] = i as u32 + 1;
        }
        self.before.clear();
        self.before.resize(count + 1, 0);
        self.next.clear();
        self.next.push([0; 4]);
        for (r, around) in records.all.iter().zip(&records.around) {
            let away = if r.look == Look::Empty { 0 } else { r.away };
            let mut next = [0; 4];
            for k in 0..4 {
                let other = if away >> k & 1 == 1 { around[k] as usize } else { none };
                next[k] = place[other.min(none)];
                self.before[next[k] as usize] += 1;
            }
            self.next.push(next);
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
                gaps.push((a, b));
            }
        });
        self.gaps.sort_unstable();
        self.gaps.dedup();
        self.first_gap.clear();
        if !self.gaps.is_empty() {
            self.first_gap.resize(count + 1, 0);
        }
        for (at, &(a, b)) in self.gaps.iter().enumerate() {
            self.before[b as usize] += 1;
            if at == 0 || self.gaps[at - 1].0 != a {
                self.first_gap[a as usize] = at as u32 + 1;
            }
        }
        for &cell in cells {
            place[cell as usize] = 0;
        }
        self.before[0] = NEVER;
        // One more: what is not free is written after what is.
        self.queue.clear();
        self.queue.resize(count + 2, 0);
        self.free = 0;
        for i in 1..self.before.len() {
            self.queue[self.free] = i as u32;
            self.free += usize::from(self.before[i] == 0);
        }
        (self.taken, self.search, self.left) = (0, 1, count);
    }

    /// The cell that comes after so many others, if that is known yet. (The longest free comes first: cells one behind the other are
    /// not drawn one after the other then, each of which would wait for the light of the last one.)
    pub(super) fn after(&self, others: usize) -> Option<usize> {
        self.queue[..self.free].get(self.taken + others).map(|&i| i as usize - 1)
    }

    /// The next cell. Where all that are left wait for each other, the first of them goes on.
    pub(super) fn next(&mut self) -> Option<usize> {
        if self.left == 0 {
            return None;
        }
        let i = if self.taken < self.free {
            self.taken += 1;
            self.queue[self.taken - 1] as usize
        } else {
            // Those that have been drawn wait for none, or never again.
            while !(1..NEVER / 2).contains(&self.before[self.search]) {
                self.search += 1;
            }
            self.before[self.search] = NEVER;
            self.search
        };
        self.left -= 1;
        for n in self.next[i] {
            self.release(n);
        }
        if let Some(from) = self.first_gap.get(i).and_then(|g| (*g as usize).checked_sub(1)) {
            for g in from..self.gaps.len() {
                let (before, after) = self.gaps[g];
                if before as usize != i {
                    break;
                }
                self.release(after);
            }
        }
        Some(i - 1)
    }

    /// One of the cells before cell `n` has been drawn.
    #[inline(always)]
    fn release(&mut self, n: u32) {
        let before = &mut self.before[n as usize];
        *before -= 1;
        self.queue[self.free] = n;
        self.free += usize::from(*before == 0);
    }
}
