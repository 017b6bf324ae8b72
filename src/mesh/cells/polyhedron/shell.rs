//! The closed surface of a polyhedron, of faces that may be listed in any direction.

use super::pieces::{volume, winding};
use glam::DVec3;
use std::collections::{HashMap, HashSet};

/// Points nearer to each other than this are one, if the surface is open otherwise, and points as near to an edge are on
/// it. The polyhedron reaches about 1 from the origin.
const NEAR: f64 = 1e-9;

/// Points beside which one that is near is looked for, and edges that are open: more of them are no slip.
const MOST_NEAR: usize = 1 << 10;

/// What is wrong with a polyhedron.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ShellFault {
    /// Its faces do not close a surface.
    Open,
    /// It has no volume.
    Flat,
}

/// A frame in which a polyhedron reaches about 1 from the origin in each direction, however flat it is.
#[derive(Debug, Clone, Copy)]
pub(super) struct ShellFrame {
    centre: DVec3,
    axes: [DVec3; 3],
}

impl ShellFrame {
    /// The frame of some points; `None` if they lie in a plane.
    pub(super) fn of(points: &[DVec3]) -> Option<Self> {
        let centre = points.iter().sum::<DVec3>() / points.len() as f64;
        let farthest = |rest: &dyn Fn(DVec3) -> DVec3| {
            let all = points.iter().map(|p| rest(*p - centre));
            all.reduce(|a, b| if b.length_squared() > a.length_squared() { b } else { a }).unwrap_or(DVec3::ZERO)
        };
        let first = farthest(&|p| p);
        let one = first.try_normalize()?;
        let second = farthest(&|p| p - one * p.dot(one));
        let two = second.try_normalize()?;
        // Once more, as what is left is small.
        let two = (two - one * two.dot(one)).normalize();
        let three = one.cross(two);
        let height = points.iter().map(|p| (*p - centre).dot(three).abs()).fold(0.0, f64::max);
        let round = f64::EPSILON * points.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        let fits = height.is_finite() && height > 4.0 * round && second.length() > 4.0 * round;
        fits.then(|| ShellFrame { centre, axes: [one / first.length(), two / second.length(), three / height] })
    }

    /// Where a point is in the frame.
    pub(super) fn local(&self, p: DVec3) -> DVec3 {
        DVec3::from(self.axes.map(|axis| axis.dot(p - self.centre)))
    }
}

/// Orients the triangles of a cell's faces outward. Their corners are numbered by `places`, which the answer does, too;
/// points that are one have one number there.
pub(super) fn close(places: &[DVec3], triangles: &[[u32; 3]]) -> Result<Vec<[u32; 3]>, ShellFault> {
    let mut fault = ShellFault::Open;
    let mut weld: Vec<u32> = vec![];
    for try_near in [false, true] {
        if try_near {
            weld = near(places);
        }
        let welded: Vec<[u32; 3]> = triangles
            .iter()
            .map(|t| t.map(|p| if try_near { weld[p as usize] } else { p }))
            .filter(|[a, b, c]| a != b && b != c && c != a)
            .collect();
        // All of them; each once; without those that are there twice, such as a wall inside the cell.
        let mut counts: HashMap<[u32; 3], usize> = HashMap::new();
        welded.iter().for_each(|t| *counts.entry(sorted(*t)).or_default() += 1);
        for way in 0..if counts.len() < welded.len() { 3 } else { 1 } {
            let mut seen = HashSet::new();
            let kept = welded.iter().copied().filter(|t| match way {
                0 => true,
                1 => seen.insert(sorted(*t)),
                _ => counts[&sorted(*t)] == 1,
            });
            match orient(places, complete(places, kept.collect())) {
                Ok(surface) => return Ok(surface),
                Err(ShellFault::Flat) => fault = ShellFault::Flat,
                Err(ShellFault::Open) => {}
            }
        }
    }
    Err(fault)
}

/// For each place the first of those near it.
fn near(places: &[DVec3]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..places.len() as u32).collect();
    order.sort_by(|a, b| places[*a as usize].x.total_cmp(&places[*b as usize].x));
    let mut weld: Vec<u32> = (0..places.len() as u32).collect();
    for (i, &p) in order.iter().enumerate() {
        let close = order[..i].iter().rev().take_while(|q| places[p as usize].x - places[**q as usize].x < NEAR);
        let same =
            close.take(MOST_NEAR).find(|q| places[**q as usize].distance_squared(places[p as usize]) < NEAR * NEAR);
        if let Some(q) = same {
            weld[p as usize] = weld[*q as usize];
        }
    }
    weld
}

fn sorted(mut t: [u32; 3]) -> [u32; 3] {
    t.sort_unstable();
    t
}

/// For each edge the triangles that have it, and whether they go from the smaller to the greater point.
fn edges(triangles: &[[u32; 3]]) -> HashMap<(u32, u32), Vec<(usize, bool)>> {
    let mut edges: HashMap<(u32, u32), Vec<(usize, bool)>> = HashMap::with_capacity(2 * triangles.len());
    for (i, t) in triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            edges.entry((a.min(b), a.max(b))).or_default().push((i, a < b));
        }
    }
    edges
}

/// Puts points that lie on an edge of one triangle only into it.
fn complete(places: &[DVec3], mut triangles: Vec<[u32; 3]>) -> Vec<[u32; 3]> {
    let place = |p: u32| places[p as usize];
    // A triangle has three edges, and only one is mended in each round.
    for _ in 0..3 {
        let mut open: Vec<(u32, u32, usize)> =
            edges(&triangles).into_iter().filter(|(_, t)| t.len() == 1).map(|((a, b), t)| (a, b, t[0].0)).collect();
        if open.len() > MOST_NEAR {
            break;
        }
        open.sort_unstable();
        let ends: HashSet<u32> = open.iter().flat_map(|e| [e.0, e.1]).collect();
        let mut mended: HashSet<usize> = HashSet::new();
        for (a, b, t) in open {
            let (from, along) = (place(a), place(b) - place(a));
            let mut on: Vec<(f64, u32)> = ends
                .iter()
                .filter(|p| !triangles[t].contains(p))
                .map(|&p| ((place(p) - from).dot(along) / along.length_squared(), p))
                .filter(|(s, p)| (NEAR..1.0 - NEAR).contains(s) && (from + along * s).distance(place(*p)) < NEAR)
                .collect();
            if on.is_empty() || !mended.insert(t) {
                continue;
            }
            on.sort_by(|a, b| a.0.total_cmp(&b.0));
            let whole = triangles[t];
            let chain: Vec<u32> = std::iter::once(a).chain(on.iter().map(|o| o.1)).chain([b]).collect();
            let parts = chain.windows(2).map(|w| {
                whole.map(|p| {
                    if p == a {
                        w[0]
                    } else if p == b {
                        w[1]
                    } else {
                        p
                    }
                })
            });
            let parts: Vec<[u32; 3]> = parts.collect();
            triangles[t] = parts[0];
            triangles.extend(&parts[1..]);
        }
        if mended.is_empty() {
            break;
        }
    }
    triangles
}

/// Turns triangles so that they look outward.
fn orient(places: &[DVec3], mut triangles: Vec<[u32; 3]>) -> Result<Vec<[u32; 3]>, ShellFault> {
    let edges = edges(&triangles);
    if triangles.len() < 4 || edges.values().any(|t| t.len() % 2 == 1) {
        return Err(ShellFault::Open);
    }
    // Across an edge of two triangles, these go opposite ways.
    let mut flipped: Vec<Option<bool>> = vec![None; triangles.len()];
    for seed in 0..triangles.len() {
        if flipped[seed].is_some() {
            continue;
        }
        flipped[seed] = Some(false);
        let mut waiting = vec![seed];
        while let Some(i) = waiting.pop() {
            let own = flipped[i].unwrap_or(false);
            for k in 0..3 {
                let (a, b) = (triangles[i][k], triangles[i][(k + 1) % 3]);
                let [one, other] = edges[&(a.min(b), a.max(b))][..] else { continue };
                let (there, same_way) = (if one.0 == i { other.0 } else { one.0 }, one.1 == other.1);
                if there != i && flipped[there].is_none() {
                    flipped[there] = Some(own ^ same_way);
                    waiting.push(there);
                }
            }
        }
    }
    for (t, flip) in triangles.iter_mut().zip(&flipped) {
        if *flip == Some(true) {
            t.swap(1, 2);
        }
    }
    let (numbers, count) = parts(&triangles, &edges);
    let at = |t: &[u32; 3]| t.map(|p| places[p as usize]);
    let mut surfaces: Vec<Vec<[DVec3; 3]>> = vec![vec![]; count];
    triangles.iter().zip(&numbers).for_each(|(t, n)| surfaces[*n].push(at(t)));
    let mut turned: Vec<bool> = surfaces.iter().map(|s| volume(s) < 0.0).collect();
    if count > 1 {
        // A part within another is a hollow.
        let depth = |n: usize| {
            let place = surfaces[n][0].iter().sum::<DVec3>() / 3.0;
            (0..count).filter(|m| *m != n && winding(&surfaces[*m], place).abs() > 0.5).count()
        };
        let hollow: Vec<bool> = (0..count).map(|n| depth(n) % 2 == 1).collect();
        turned.iter_mut().zip(hollow).for_each(|(t, h)| *t ^= h);
    }
    for (t, n) in triangles.iter_mut().zip(&numbers) {
        if turned[*n] {
            t.swap(1, 2);
        }
    }
    // Closed if each edge is gone along as often in either way.
    let mut balance: HashMap<(u32, u32), i32> = HashMap::with_capacity(edges.len());
    for t in &triangles {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            *balance.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
        }
    }
    if balance.values().any(|b| *b != 0) {
        return Err(ShellFault::Open);
    }
    let whole: f64 = triangles.iter().map(|t| volume(&[at(t)])).sum();
    if whole.abs() < 1e-12 { Err(ShellFault::Flat) } else { Ok(triangles) }
}

/// The parts that hang together by edges of two triangles.
fn parts(triangles: &[[u32; 3]], edges: &HashMap<(u32, u32), Vec<(usize, bool)>>) -> (Vec<usize>, usize) {
    let mut numbers = vec![usize::MAX; triangles.len()];
    let mut count = 0;
    for seed in 0..triangles.len() {
        if numbers[seed] != usize::MAX {
            continue;
        }
        numbers[seed] = count;
        let mut waiting = vec![seed];
        while let Some(i) = waiting.pop() {
            for k in 0..3 {
                let (a, b) = (triangles[i][k], triangles[i][(k + 1) % 3]);
                let [one, other] = edges[&(a.min(b), a.max(b))][..] else { continue };
                for t in [one.0, other.0] {
                    if numbers[t] == usize::MAX {
                        numbers[t] = count;
                        waiting.push(t);
                    }
                }
            }
        }
        count += 1;
    }
    (numbers, count)
}
