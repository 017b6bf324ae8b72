//! Cells that hide each other in a circle: where such circles are, and where they are cut.
//!
//! What waits for itself is a strongly connected part of the graph (Tarjan 1972). Of such a part the edges are taken in again one by
//! one, those that most pixels see first, unless one would close a circle: these are cut. Whether one does is found by an order that
//! is kept up to date (Pearce & Kelly 2006).

use super::graph::{Edge, Graph};
use rayon::prelude::*;

/// Cells that are looked at, over all edges of a part, before those that contradict depth are cut without a look.
const MOST_LOOKS: usize = 1 << 24;

/// Not seen yet, and no place.
const NONE: u32 = u32::MAX;

/// The circles of a graph.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Cycles {
    /// Strongly connected parts of more than one cell.
    pub(super) parts: u32,
    /// Their cells.
    pub(super) cells: u64,
    /// The edges that were cut.
    pub(super) cut: Vec<Edge>,
}

/// Finds the circles among the cells that wait, ascending, and cuts them; `pixels` tells how many see an edge.
pub(super) fn untie(graph: &mut Graph, waiting: &[u32], pixels: impl Fn(&Graph, Edge) -> u32 + Sync) -> Cycles {
    let mut cycles = Cycles::default();
    // Where a waiting cell is in its part.
    let mut place = vec![NONE; graph.len()];
    for mut part in parts(graph, waiting) {
        cycles.parts += 1;
        cycles.cells += part.len() as u64;
        part.sort_unstable_by_key(|&c| (graph.bucket(c), c));
        part.iter().zip(0..).for_each(|(&c, i)| place[c as usize] = i);
        let mut edges = vec![];
        for (&cell, from) in part.iter().zip(0..) {
            graph.for_each_after(cell, |to, edge| {
                if place[to as usize] != NONE {
                    edges.push((from, place[to as usize], edge));
                }
            });
        }
        part.iter().for_each(|&c| place[c as usize] = NONE);
        let mut edges: Vec<_> = edges.into_par_iter().map(|e| (std::cmp::Reverse(pixels(graph, e.2)), e)).collect();
        edges.sort_unstable();
        let mut kept = Kept::new(part.len());
        for (_, (from, to, edge)) in edges {
            if !kept.take(from, to) {
                graph.cut(edge);
                cycles.cut.push(edge);
            }
        }
    }
    cycles
}

/// The strongly connected parts of more than one cell, among the cells that wait.
fn parts(graph: &Graph, waiting: &[u32]) -> Vec<Vec<u32>> {
    let mut found = vec![];
    let (mut number, mut least) = (vec![NONE; graph.len()], vec![NONE; graph.len()]);
    let mut count = 0;
    // Cells whose part is not known, and those that are being looked at with what is still to be seen from there.
    let (mut open, mut path): (Vec<u32>, Vec<(u32, Vec<u32>)>) = (vec![], vec![]);
    let mut is_open = vec![false; graph.len()];
    for &start in waiting {
        let mut next = (number[start as usize] == NONE).then_some(start);
        while let Some(cell) = next.take() {
            (number[cell as usize], least[cell as usize]) = (count, count);
            count += 1;
            open.push(cell);
            is_open[cell as usize] = true;
            let mut after = vec![];
            graph.for_each_after(cell, |to, _| after.push(to));
            path.push((cell, after));
            while let Some((cell, after)) = path.last_mut() {
                let cell = *cell;
                if let Some(to) = after.pop() {
                    if number[to as usize] == NONE {
                        next = Some(to);
                        break;
                    }
                    if is_open[to as usize] {
                        least[cell as usize] = least[cell as usize].min(number[to as usize]);
                    }
                    continue;
                }
                path.pop();
                if let Some(&(from, _)) = path.last() {
                    least[from as usize] = least[from as usize].min(least[cell as usize]);
                }
                if least[cell as usize] == number[cell as usize] {
                    let from = open.iter().rposition(|&c| c == cell).unwrap_or(0);
                    let part = open.split_off(from);
                    part.iter().for_each(|&c| is_open[c as usize] = false);
                    if part.len() > 1 {
                        found.push(part);
                    }
                }
            }
        }
    }
    found
}

/// A graph without circles, and an order of its nodes.
struct Kept {
    rank: Vec<u32>,
    after: Vec<Vec<u32>>,
    before: Vec<Vec<u32>>,
    looks: usize,
}

impl Kept {
    /// Of so many nodes in sequence, and without edges.
    fn new(n: usize) -> Self {
        Kept { rank: (0..n as u32).collect(), after: vec![vec![]; n], before: vec![vec![]; n], looks: 0 }
    }

    /// Takes an edge in; false if it would close a circle.
    fn take(&mut self, from: u32, to: u32) -> bool {
        let (low, high) = (self.rank[to as usize], self.rank[from as usize]);
        if low < high {
            if self.looks > MOST_LOOKS {
                return false;
            }
            let Some(mut behind) = self.reached(to, from, |r| r < high, true) else { return false };
            let Some(mut ahead) = self.reached(from, NONE, |r| r > low, false) else { return false };
            let by_rank = |nodes: &mut Vec<u32>, rank: &[u32]| nodes.sort_unstable_by_key(|&n| rank[n as usize]);
            by_rank(&mut behind, &self.rank);
            by_rank(&mut ahead, &self.rank);
            ahead.extend(behind);
            let mut ranks: Vec<u32> = ahead.iter().map(|&n| self.rank[n as usize]).collect();
            ranks.sort_unstable();
            ahead.into_iter().zip(ranks).for_each(|(n, r)| self.rank[n as usize] = r);
        }
        self.after[from as usize].push(to);
        self.before[to as usize].push(from);
        true
    }

    /// The nodes that are reached from `start` by those whose ranks are `within`, forward or back; none if `end` is among them.
    fn reached(&mut self, start: u32, end: u32, within: impl Fn(u32) -> bool, forward: bool) -> Option<Vec<u32>> {
        let (mut seen, mut nodes, mut i) = (std::collections::HashSet::from([start]), vec![start], 0);
        while let Some(&node) = nodes.get(i) {
            i += 1;
            self.looks += 1;
            for &n in if forward { &self.after[node as usize] } else { &self.before[node as usize] } {
                if n == end {
                    return None;
                }
                if within(self.rank[n as usize]) && seen.insert(n) {
                    nodes.push(n);
                }
            }
        }
        Some(nodes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_is_cut_where_it_closes() {
        let mut kept = Kept::new(5);
        for (from, to) in [(4, 3), (3, 2), (2, 1), (1, 0)] {
            assert!(kept.take(from, to));
        }
        assert!(!kept.take(0, 4) && !kept.take(1, 3));
        assert!(kept.take(4, 0) && kept.take(3, 1));
        let ranks: Vec<u32> = [4, 3, 2, 1, 0].map(|n: usize| kept.rank[n]).to_vec();
        assert!(ranks.is_sorted(), "{ranks:?}");
    }
}
