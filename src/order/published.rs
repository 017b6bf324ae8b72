//! Orders as they were published: by depth, and depth first.
//!
//! A cell is drawn when all that is behind it has been: a search from the cells that have none before them goes to what is behind
//! first (Williams 1992). Where cells hide each other in a circle, it goes on with what it has not seen.

use super::facing::Source;
use super::graph::Graph;
use super::mpvo::Rule;
use crate::geometry::TetMesh;
use glam::DVec3;

/// All cells from front to back.
pub(super) fn depth_first(graph: &Graph, geometry: &TetMesh, source: Source, rule: Rule) -> Vec<u32> {
    let n = graph.len();
    let mut starts: Vec<u32> = (0..n as u32).filter(|&c| !graph.waits(c)).collect();
    if rule == Rule::Nonconvex {
        starts.sort_by_cached_key(|&c| std::cmp::Reverse(ordered(depth(geometry, source, c))));
    }
    let mut is_seen = vec![false; n];
    let mut cells = Vec::with_capacity(n);
    // Cells, and how many of those behind each have been gone to.
    let mut path: Vec<(u32, u32)> = vec![];
    // In circles nothing is first: the rest follows as it is stored.
    for start in starts.into_iter().chain(0..n as u32) {
        if !std::mem::replace(&mut is_seen[start as usize], true) {
            path.push((start, 0));
        }
        while let Some((cell, done)) = path.last_mut() {
            let (mut i, mut next) = (0, None);
            graph.for_each_after(*cell, |to, _| {
                if i == *done {
                    next = Some(to);
                }
                i += 1;
            });
            *done += 1;
            match next {
                Some(to) if !std::mem::replace(&mut is_seen[to as usize], true) => path.push((to, 0)),
                Some(_) => {}
                None => path.pop().into_iter().for_each(|(cell, _)| cells.push(cell)),
            }
        }
    }
    cells.reverse();
    cells
}

/// All cells from front to back by the distances of their centres.
pub(super) fn by_depth(geometry: &TetMesh, source: Source) -> Vec<u32> {
    let mut cells: Vec<u32> = (0..geometry.cells.len() as u32).collect();
    cells.sort_by_cached_key(|&c| ordered(depth(geometry, source, c)));
    cells
}

/// How far the centre of a cell is.
fn depth(geometry: &TetMesh, source: Source, cell: u32) -> f64 {
    let corners = geometry.cells[cell as usize].corners;
    source.depth(corners.iter().map(|&p| geometry.points[p as usize]).sum::<DVec3>() / 4.0)
}

/// A number that ascends with `v`, which is none of NaN.
fn ordered(v: f64) -> u64 {
    let bits = v.to_bits();
    if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
}
