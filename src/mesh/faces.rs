//! The faces of a tetrahedral mesh: neighbours by exact point position, the boundary, connected components.
//!
//! Two tetrahedra are neighbours if they have a face with the same three positions and lie on opposite sides of it.
//! Sides are exact: the sign of a tetrahedron's volume is Shewchuk's adaptive predicate (Adaptive Precision
//! Floating-Point Arithmetic and Fast Robust Geometric Predicates, 1997), so along any chain of neighbours the
//! orientation is coherent. Tetrahedra whose volume is exactly zero take the orientation that their neighbours demand.

mod groups;

use crate::buckets::Buckets;
use crate::progress::{Progress, Report};
use glam::DVec3;
use groups::{Groups, SidedFace};
use rayon::prelude::*;
use robust::Coord3D;
use std::collections::BTreeSet;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// Stands for "no neighbour" in [`Faces::neighbours`].
pub const BOUNDARY: u32 = u32::MAX;

/// `OUTWARD[k]`: the corners of the face opposite to corner `k`, counter-clockwise as seen from outside, of a
/// tetrahedron with det(p1 − p0, p2 − p0, p3 − p0) > 0.
pub const OUTWARD: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// How the tetrahedra of a mesh hang together.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Faces {
    /// For each point, the smallest index of a point at exactly the same position (its own, if there is no other);
    /// `None` if no two points share a position.
    pub weld: Option<Vec<u32>>,
    /// `neighbours[t][k]`: the tetrahedron beyond the face of `t` opposite to corner `k`, or [`BOUNDARY`].
    pub neighbours: Vec<[u32; 4]>,
    /// The boundary faces `(tetrahedron, opposite corner)`, ascending. Degenerate tetrahedra have none.
    pub boundary: Vec<(u32, u8)>,
    /// The sign of each tetrahedron's volume det(p1 − p0, p2 − p0, p3 − p0): 1 or −1, for flat tetrahedra the one that
    /// fits their neighbours; 0 if it is degenerate (two corners at one position) and takes no part.
    pub orientation: Vec<i8>,
    /// Faces of more than two tetrahedra. Two of them, one on each side, are neighbours; the rest is boundary.
    pub non_manifold: usize,
    /// Faces of exactly two tetrahedra that lie on the same side of it, so that both are boundary.
    pub folded: usize,
    /// Tetrahedra with two corners at one position.
    pub degenerate: usize,
    /// Tetrahedra of exactly zero volume that are not degenerate.
    pub flat: usize,
}

/// One tetrahedron's view of a face.
#[derive(Debug, Clone, Copy, Default)]
struct HalfFace {
    /// Four times the tetrahedron plus the opposite corner.
    face: u32,
    /// 1 if the sorted face is counter-clockwise seen from outside a positive tetrahedron, else −1.
    parity: i8,
}

impl HalfFace {
    fn tetrahedron(self) -> usize {
        self.face as usize / 4
    }

    /// On which side of the sorted face the tetrahedron lies; 0 if its orientation is not known yet.
    fn side(self, orientation: &[i8]) -> i8 {
        self.parity * orientation[self.tetrahedron()]
    }
}

impl Faces {
    /// Matches the faces of `corners`, at most [`super::cells::MAX_TETRAHEDRA`], on the current rayon pool. The result
    /// does not depend on its number of threads.
    ///
    /// # Panics
    /// If a corner is not an index into `points`.
    pub fn new(points: &[DVec3], corners: &[[u32; 4]]) -> Self {
        Self::with_progress(points, corners, &|_| {})
    }

    /// As [`Faces::new`]; `report` is called, on any thread, with the share of the work that is done: from 0 to 1, never
    /// falling.
    ///
    /// # Panics
    /// Likewise.
    pub fn with_progress(points: &[DVec3], corners: &[[u32; 4]], report: &(dyn Fn(f64) + Sync)) -> Self {
        report(0.0);
        let weld = weld(points);
        report(0.05);
        let matcher = Matcher { points: points.len(), corners, weld: weld.as_deref() };
        let mut orientation = matcher.orientations(points);
        report(0.15);
        let count = |sign: i8| orientation.par_iter().filter(|&&o| o == sign).count();
        let (flat, degenerate) = (count(FLAT), count(DEGENERATE));
        // From here on 0 means "not known yet" for flat tetrahedra; degenerate ones never come up.
        orientation.par_iter_mut().filter(|o| o.abs() > 1).for_each(|o| *o = 0);

        let neighbours: Vec<[AtomicU32; 4]> =
            corners.par_iter().map(|_| [const { AtomicU32::new(BOUNDARY) }; 4]).collect();
        let (mut tally, groups) = matcher.match_oriented(&orientation, degenerate, &neighbours, report);
        if !groups.is_empty() {
            matcher.orient_flat(&groups, &mut orientation);
            for group in &groups {
                tally = tally.plus(matcher.pair(group, &orientation, &neighbours));
            }
        }
        report(0.95);
        let neighbours: Vec<[u32; 4]> = neighbours.into_iter().map(|n| n.map(AtomicU32::into_inner)).collect();
        let boundary = boundary(&neighbours, &orientation);
        report(1.0);
        Faces {
            boundary,
            weld,
            neighbours,
            orientation,
            non_manifold: tally.non_manifold,
            folded: tally.folded,
            degenerate,
            flat,
        }
    }

    /// The smallest index of a point at the position of point `p`.
    pub fn welded(&self, p: u32) -> u32 {
        self.weld.as_ref().map_or(p, |w| w[p as usize])
    }

    /// The face of tetrahedron `t` opposite to corner `k`: welded points a, b, c, with (b − a) × (c − a) pointing away
    /// from that corner by the resolved [`Faces::orientation`].
    ///
    /// # Panics
    /// If `t` or `k` is not one of `corners`, the tetrahedra that the faces were made from.
    pub fn outward(&self, corners: &[[u32; 4]], (t, k): (u32, u8)) -> [u32; 3] {
        let [a, b, c] = OUTWARD[k as usize].map(|i| self.welded(corners[t as usize][i]));
        if self.orientation[t as usize] < 0 { [a, c, b] } else { [a, b, c] }
    }

    /// The number of components that hang together by faces; degenerate tetrahedra belong to none. Takes a second or
    /// so for 10 million tetrahedra.
    pub fn components(&self) -> usize {
        let mut parent: Vec<u32> = (0..self.neighbours.len() as u32).collect();
        let root = |parent: &mut [u32], mut t: u32| {
            while parent[t as usize] != t {
                parent[t as usize] = parent[parent[t as usize] as usize];
                t = parent[t as usize];
            }
            t
        };
        let mut count = self.orientation.iter().filter(|&&o| o != 0).count();
        for (t, beyond) in self.neighbours.iter().enumerate() {
            for &u in beyond.iter().filter(|&&u| u != BOUNDARY && (u as usize) < t) {
                let (a, b) = (root(&mut parent, t as u32), root(&mut parent, u));
                if a != b {
                    parent[a.max(b) as usize] = a.min(b);
                    count -= 1;
                }
            }
        }
        count
    }
}

/// Sorted points of a face, and its [`HalfFace::parity`].
fn ascending(mut points: [u32; 3]) -> ([u32; 3], i8) {
    let mut parity = 1;
    for (i, j) in [(0, 1), (1, 2), (0, 1)] {
        if points[i] > points[j] {
            points.swap(i, j);
            parity = -parity;
        }
    }
    (points, parity)
}

/// Makes the tetrahedra of two faces neighbours.
fn link(neighbours: &[[AtomicU32; 4]], a: HalfFace, b: HalfFace) {
    for (from, to) in [(a, b), (b, a)] {
        neighbours[from.tetrahedron()][from.face as usize % 4].store(to.face / 4, Relaxed);
    }
}

/// The faces without a neighbour, ascending, of tetrahedra that have an orientation.
fn boundary(neighbours: &[[u32; 4]], orientation: &[i8]) -> Vec<(u32, u8)> {
    const CHUNK: usize = 1 << 14;
    let chunks: Vec<Vec<(u32, u8)>> = neighbours
        .par_chunks(CHUNK)
        .enumerate()
        .map(|(i, chunk)| {
            let mut open = Vec::new();
            for (t, beyond) in (i * CHUNK..).zip(chunk).filter(|&(t, _)| orientation[t] != 0) {
                open.extend((0..4u8).filter(|&k| beyond[k as usize] == BOUNDARY).map(|k| (t as u32, k)));
            }
            open
        })
        .collect();
    chunks.concat()
}

/// Marks of [`Matcher::orientations`] that are no sign.
const FLAT: i8 = 2;
const DEGENERATE: i8 = 3;

/// Counts of odd faces.
#[derive(Debug, Clone, Copy, Default)]
struct Tally {
    non_manifold: usize,
    folded: usize,
}

impl Tally {
    fn plus(self, other: Self) -> Self {
        Tally { non_manifold: self.non_manifold + other.non_manifold, folded: self.folded + other.folded }
    }
}

struct Matcher<'a> {
    points: usize,
    corners: &'a [[u32; 4]],
    weld: Option<&'a [u32]>,
}

impl Matcher<'_> {
    fn welded(&self, t: usize) -> [u32; 4] {
        let c = self.corners[t];
        self.weld.map_or(c, |w| c.map(|p| w[p as usize]))
    }

    /// The exact sign of each tetrahedron's volume, [`FLAT`] or [`DEGENERATE`].
    fn orientations(&self, points: &[DVec3]) -> Vec<i8> {
        // A power of two changes no sign, and keeps the predicate's products of three lengths from over- and underflow.
        let size = points.par_iter().map(|p| p.abs().max_element()).filter(|m| m.is_finite()).reduce(|| 0.0, f64::max);
        let scale = if (1e-30..1e30).contains(&size) || size < f64::MIN_POSITIVE {
            1.0
        } else {
            2f64.powi(-(size.log2().floor() as i32).clamp(-1000, 1000))
        };
        (0..self.corners.len())
            .into_par_iter()
            .map(|t| {
                let w = self.welded(t);
                if (1..4).any(|i| w[..i].contains(&w[i])) {
                    return DEGENERATE;
                }
                let [a, b, c, d] = w.map(|p| {
                    let DVec3 { x, y, z } = points[p as usize] * scale;
                    Coord3D { x, y, z }
                });
                // Shewchuk's sign is that of det(a − d, b − d, c − d), the opposite of ours.
                let det = robust::orient3d(a, b, c, d);
                if det < 0.0 {
                    1
                } else if det > 0.0 {
                    -1
                } else {
                    FLAT
                }
            })
            .collect()
    }

    /// Pairs all faces whose tetrahedra have a known orientation, and returns the others, grouped. The share that is
    /// done goes from 0.15 to 0.9.
    fn match_oriented(
        &self,
        orientation: &[i8],
        degenerate: usize,
        neighbours: &[[AtomicU32; 4]],
        report: Report<'_>,
    ) -> (Tally, Vec<Vec<HalfFace>>) {
        // Faces are dealt into buckets by ranges of their smallest point: what is done with them then stays in the cache,
        // and so do the tetrahedra of a file that numbers neighbouring points alike.
        let count = (4 * self.corners.len() / RECORDS_PER_BUCKET).clamp(1, MAX_BUCKETS);
        let shift = (self.points / count).max(1).ilog2();
        let skip = |t: usize| degenerate > 0 && orientation[t] == 0 && self.is_degenerate(t);
        let buckets = Buckets::new(self.corners.len(), (self.points >> shift) + 1, |t| {
            if skip(t as usize) {
                return [None; 2];
            }
            // The face opposite to the smallest point has another smallest point than the other three.
            let [a, b, c, d] = self.welded(t as usize);
            let (low, high) = ([a.min(b), c.min(d)], [a.max(b), c.max(d)]);
            let least = low[0].min(low[1]);
            let next = low[0].max(low[1]).min(high[usize::from(low[1] < low[0])]);
            let (least, next) = ((least >> shift) as usize, (next >> shift) as usize);
            [Some(least), (next != least).then_some(next)]
        });
        let report = |share: f64| report(0.35 + 0.55 * share);
        report(0.0);
        let progress = Progress::new(&report, buckets.len() as f64);
        let results: Vec<(Tally, Vec<Vec<HalfFace>>)> = (0..buckets.len())
            .into_par_iter()
            .map_init(Groups::default, |groups, b| {
                groups.clear();
                for t in buckets.items(b) {
                    let (points, orientation) = (self.welded(t as usize), orientation[t as usize]);
                    for (k, face) in OUTWARD.iter().enumerate() {
                        let (points, parity) = ascending(face.map(|i| points[i]));
                        if (points[0] >> shift) as usize == b {
                            let half = HalfFace { face: 4 * t + k as u32, parity };
                            groups.push(SidedFace { points, half, side: parity * orientation });
                        }
                    }
                }
                let (mut tally, mut later) = (Tally::default(), Vec::new());
                groups.for_each(|group| {
                    let halves = || group.iter().map(|f| f.half).collect::<Vec<_>>();
                    if group.iter().any(|f| f.side == 0) {
                        later.push(halves());
                    } else if let [a, b] = group
                        && a.side != b.side
                    {
                        link(neighbours, a.half, b.half);
                    } else if group.len() > 1 {
                        tally = tally.plus(self.pair(&halves(), orientation, neighbours));
                    }
                });
                progress.add(1);
                (tally, later)
            })
            .collect();
        results.into_iter().fold((Tally::default(), Vec::new()), |(tally, mut groups), (t, g)| {
            groups.extend(g);
            (tally.plus(t), groups)
        })
    }

    fn is_degenerate(&self, t: usize) -> bool {
        let w = self.welded(t);
        (1..4).any(|i| w[..i].contains(&w[i]))
    }

    /// Makes one tetrahedron of each side of a face neighbours: on each side, the one whose opposite point has the
    /// smallest index (of cells with the same points, the first).
    fn pair(&self, group: &[HalfFace], orientation: &[i8], neighbours: &[[AtomicU32; 4]]) -> Tally {
        let first = |side: i8| {
            let opposite = |h: &HalfFace| (self.welded(h.tetrahedron())[h.face as usize % 4], h.face);
            group.iter().copied().filter(|h| h.side(orientation) == side).min_by_key(opposite)
        };
        let pair = first(1).zip(first(-1));
        if let Some((a, b)) = pair {
            link(neighbours, a, b);
        }
        Tally { non_manifold: usize::from(group.len() > 2), folded: usize::from(group.len() == 2 && pair.is_none()) }
    }

    /// Orients flat tetrahedra: round by round, those with oriented neighbours as most of these demand. Where nothing
    /// demands anything or demands are equal, the one with the smallest points goes as it is listed, like most others
    /// of the mesh do.
    fn orient_flat(&self, groups: &[Vec<HalfFace>], orientation: &mut [i8]) {
        let majority = {
            let sum: i64 = orientation.par_iter().map(|&o| i64::from(o)).sum();
            if sum < 0 { -1 } else { 1 }
        };
        let mut faces: Vec<(HalfFace, u32)> = Vec::new();
        for (g, group) in groups.iter().enumerate() {
            let flat = group.iter().filter(|h| h.side(orientation) == 0);
            faces.extend(flat.map(|&h| (h, g as u32)));
        }
        faces.sort_unstable_by_key(|(h, _)| h.face);
        // The faces of one flat tetrahedron now lie together, all four of them.
        let tetrahedra: Vec<&[(HalfFace, u32)]> = faces.chunk_by(|a, b| a.0.face / 4 == b.0.face / 4).collect();
        let of = |t: usize| tetrahedra.binary_search_by_key(&t, |f| f[0].0.tetrahedron());
        let demand = |i: usize, orientation: &[i8]| -> i64 {
            let per_face = tetrahedra[i].iter().map(|&(own, g)| {
                let others = groups[g as usize].iter().filter(|h| h.face != own.face);
                let sides: i64 = others.map(|h| i64::from(h.side(orientation))).sum();
                -sides.signum() * i64::from(own.parity)
            });
            per_face.sum()
        };
        let mut seeds: Vec<usize> = (0..tetrahedra.len()).collect();
        seeds.sort_by_cached_key(|&i| {
            let mut w = self.welded(tetrahedra[i][0].0.tetrahedron());
            w.sort_unstable();
            w
        });
        let mut seeds = seeds.into_iter();
        let mut waiting: BTreeSet<usize> = (0..tetrahedra.len()).collect();
        loop {
            let mut chosen: Vec<(usize, i8)> = waiting
                .iter()
                .map(|&i| (i, demand(i, orientation).signum() as i8))
                .filter(|(_, sign)| *sign != 0)
                .collect();
            waiting.clear();
            if chosen.is_empty() {
                let open = |&i: &usize| orientation[tetrahedra[i][0].0.tetrahedron()] == 0;
                let Some(seed) = seeds.find(open) else { return };
                chosen.push((seed, majority));
            }
            for &(i, sign) in &chosen {
                orientation[tetrahedra[i][0].0.tetrahedron()] = sign;
            }
            for &(i, _) in &chosen {
                let near = tetrahedra[i].iter().flat_map(|&(_, g)| &groups[g as usize]);
                waiting
                    .extend(near.map(|h| h.tetrahedron()).filter(|&t| orientation[t] == 0).filter_map(|t| of(t).ok()));
            }
        }
    }
}

/// Faces or points of one bucket, about: what is kept of them fits into the second-level cache.
const RECORDS_PER_BUCKET: usize = 1 << 13;
const MAX_BUCKETS: usize = 1 << 13;

/// For each point, the smallest index of a point at exactly its position; `None` if all positions differ.
pub(crate) fn weld(points: &[DVec3]) -> Option<Vec<u32>> {
    // −0 + 0 = 0, so that both zeros are one position.
    let bits = |i: u32| (points[i as usize] + 0.0).to_array().map(f64::to_bits);
    let hash = |i: u32| {
        let mixed = bits(i).into_iter().fold(0u64, |h, x| (h.rotate_left(23) ^ x).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        (mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9)
    };
    let count = (points.len() / RECORDS_PER_BUCKET).clamp(1, MAX_BUCKETS);
    let buckets = Buckets::new(points.len(), count, |i| [Some(((hash(i) >> 32) as usize * count) >> 32)]);
    let pairs: Vec<Vec<(u32, u32)>> = (0..buckets.len())
        .into_par_iter()
        .map_init(Vec::new, |keys: &mut Vec<(u64, u32)>, b| {
            keys.clear();
            keys.extend(buckets.items(b).map(|i| (hash(i), i)));
            keys.sort_unstable();
            let mut pairs = Vec::new();
            for same in keys.chunk_by_mut(|a, b| a.0 == b.0).filter(|g| g.len() > 1) {
                same.sort_unstable_by_key(|&(_, i)| (bits(i), i));
                for group in same.chunk_by(|a, b| bits(a.1) == bits(b.1)) {
                    pairs.extend(group[1..].iter().map(|&(_, i)| (i, group[0].1)));
                }
            }
            pairs
        })
        .collect();
    if pairs.iter().all(Vec::is_empty) {
        return None;
    }
    let mut weld: Vec<u32> = (0..points.len() as u32).collect();
    for (i, smallest) in pairs.into_iter().flatten() {
        weld[i as usize] = smallest;
    }
    Some(weld)
}
