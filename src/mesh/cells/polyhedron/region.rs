//! Triangles of a plane region with any number of outlines and holes.

use super::face::orient;
use glam::DVec2;
use std::collections::{BTreeMap, BTreeSet};

/// Cuts the region to the left of directed `edges`, which must be closed outlines that do not cross, into triangles of
/// their ends: by the shortest diagonals. `None` if the outlines are not like that.
pub(super) fn triangulate(at: impl Fn(u32) -> DVec2, edges: &[(u32, u32)]) -> Option<Vec<[u32; 3]>> {
    let ends: BTreeSet<u32> = edges.iter().flat_map(|e| [e.0, e.1]).collect();
    let places: BTreeMap<u32, DVec2> = ends.iter().map(|&p| (p, at(p))).collect();
    let at = |p: u32| places[&p];
    let turn = |a: u32, b: u32, c: u32| orient(at(a), at(b), at(c));
    let outline: BTreeSet<(u32, u32)> = edges.iter().copied().collect();
    if outline.len() != edges.len() || edges.iter().any(|e| outline.contains(&(e.1, e.0))) {
        return None;
    }
    let inside = |m: DVec2| {
        let crossings = edges.iter().map(|&(a, b)| {
            let [a, b] = [at(a), at(b)];
            let up = a.y <= m.y && b.y > m.y;
            let down = a.y > m.y && b.y <= m.y;
            let left = orient(a, b, m);
            i32::from(up && left > 0.0) - i32::from(down && left < 0.0)
        });
        crossings.sum::<i32>() > 0
    };
    let ends: Vec<u32> = ends.into_iter().collect();
    let mut diagonals: Vec<(f64, u32, u32)> = vec![];
    for (i, &a) in ends.iter().enumerate() {
        for &b in &ends[i + 1..] {
            if !outline.contains(&(a, b)) && !outline.contains(&(b, a)) && inside((at(a) + at(b)) / 2.0) {
                diagonals.push((at(a).distance_squared(at(b)), a, b));
            }
        }
    }
    diagonals.sort_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
    let mut lines: Vec<(u32, u32)> = edges.to_vec();
    for (length, a, b) in diagonals {
        let (from, to) = (at(a), at(b));
        let passes = |&&p: &&u32| {
            let along = (at(p) - from).dot(to - from) / length;
            p != a && p != b && along > 0.0 && along < 1.0 && (from.lerp(to, along)).distance_squared(at(p)) < 1e-18
        };
        let crosses = |&(c, d): &(u32, u32)| {
            let apart = c != a && c != b && d != a && d != b;
            apart && turn(a, b, c) * turn(a, b, d) < 0.0 && turn(c, d, a) * turn(c, d, b) < 0.0
        };
        if ends.iter().find(passes).is_none() && !lines.iter().any(crosses) {
            lines.push((a, b));
        }
    }
    let mut near: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (a, b) in lines {
        near.entry(a).or_default().push(b);
        near.entry(b).or_default().push(a);
    }
    let mut triangles = vec![];
    let mut done: BTreeSet<(u32, u32)> = BTreeSet::new();
    let mut wanted: Vec<(u32, u32)> = edges.to_vec();
    while let Some((a, b)) = wanted.pop() {
        if !done.insert((a, b)) {
            continue;
        }
        // The first edge to the left.
        let lefts = near[&a].iter().copied().filter(|&c| turn(a, b, c) > 0.0);
        let c = lefts.reduce(|c, d| if turn(a, c, d) > 0.0 { c } else { d })?;
        if !near[&b].contains(&c) || !done.insert((b, c)) || !done.insert((c, a)) {
            return None;
        }
        triangles.push([a, b, c]);
        for (p, q) in [(b, c), (c, a)] {
            if !outline.contains(&(p, q)) && !done.contains(&(q, p)) {
                wanted.push((q, p));
            }
        }
    }
    let whole: f64 = edges.iter().map(|&(a, b)| at(a).perp_dot(at(b))).sum();
    let parts: f64 = triangles.iter().map(|&[a, b, c]| turn(a, b, c)).sum();
    ((whole - parts).abs() <= 1e-9 * whole.abs()).then_some(triangles)
}
