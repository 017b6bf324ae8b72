//! Order: where the rays of a tile cross the boundary of the mesh, and a sequence of its cells from front to back.
//!
//! Cells follow one another by Kahn's algorithm (1962). A cell comes before the neighbours beyond its faces that are turned away; a
//! cell through which a ray leaves the mesh comes before the one through which that ray enters it again (Silva, Mitchell & Williams
//! 1998, XMPVO). Both hold for every ray, so the sequence is right for all of the tile's pixels, unless cells hide each other in a
//! circle or overlap.
//!
//! A boundary face is told relative to its deepest corner R, as a cell is (`setup`): with e₁, e₂ to the others and n = e₁ × e₂ its
//! depth is v = −w_R (n.x x + n.y y)/n.z. The ray (w_R x, w_R y, v) = β₁ e₁ + β₂ e₂ passes through it if β₁, β₂ and 1 − κ v − β₁ − β₂
//! are none below 0.

use super::coarse::{ASIDE, Lens, PixelBox, TILE};
use super::setup::{Look, Record};
use crate::geometry::Geometry;
use crate::geometry::boundary::BoundaryFace;
use crate::mesh::faces::BOUNDARY;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x4};

const PIXELS: usize = (TILE * TILE) as usize;

/// A place where a ray crosses the boundary.
#[derive(Debug, Clone, Copy)]
struct Crossing {
    pixel: u16,
    enters: bool,
    cell: u32,
    key: f64,
}

/// Keys of crossings that are as near as this are one place, where a ray leaves before it enters.
const TOGETHER: f64 = 1e-9;

/// Where the rays of a tile cross the boundary, pixel by pixel from front to back.
#[derive(Debug, Default)]
pub(super) struct Crossings {
    found: Vec<Crossing>,
    sorted: Vec<Crossing>,
    /// Pixel i has `sorted[start[i]..start[i + 1]]`.
    start: Vec<u32>,
}

impl Crossings {
    pub(super) fn clear(&mut self) {
        self.found.clear();
    }

    /// Finds the pixels whose rays cross `face` of those in `bounds`, in the tile whose first pixel is (`left`, `top`).
    #[inline(always)]
    pub(super) fn add<S: Simd>(
        &mut self,
        simd: S,
        geometry: &Geometry,
        lens: &Lens,
        face: &BoundaryFace,
        b: PixelBox,
        [left, top]: [u32; 2],
    ) {
        let mut h = face.points.map(|p| lens.place(geometry.points[p as usize]));
        let mut p = face.points.map(|p| geometry.points[p as usize]);
        let deepest = (1..3).fold(0, |m, k| if h[k].z > h[m].z { k } else { m });
        h.rotate_left(deepest);
        p.rotate_left(deepest);
        let (at, w) = (lens.pixel(h[0]), h[0].z);
        let shear = |d: glam::DVec3| {
            let d = lens.turn(d);
            if lens.meet { [d.x - at.x * d.z, d.y - at.y * d.z, d.z] } else { [d.x, d.y, d.z] }
        };
        let ([ax, ay, az], [bx, by, bz]) = (shear(p[1] - p[0]), shear(p[2] - p[0]));
        let area = ax * by - ay * bx;
        if area == 0.0 || !area.is_finite() {
            return;
        }
        let (m, kappa) = if lens.meet { (w, 1.0 / w) } else { (1.0, 0.0) };
        let f = m / area;
        // Per column and row: v, and the weights of both corners.
        let v = [-f * (ay * bz - az * by), -f * (az * bx - ax * bz)];
        let (one, two) = ([f * by, -f * bx], [-f * ay, f * ax]);
        let zero = [-kappa * v[0] - one[0] - two[0], -kappa * v[1] - one[1] - two[1]];
        let ratio = if lens.meet { (lens.reference * kappa).powi(2) } else { 1.0 };
        let base = lens.key(w);
        // Columns run right and rows down: a face that turns counter-clockwise seen from outside turns clockwise there when it
        // is turned to the eye.
        let enters = (area < 0.0) != lens.mirrored();
        let b = b.map(u32::from);
        let (right, bottom) = (b[1].min(left + TILE - 1), b[3].min(top + TILE - 1));
        let of = |v: f64| f64x4::splat(simd, v);
        let ramp = f64x4::load_array(simd, [0.0, 1.0, 2.0, 3.0]) + (ASIDE.x - at.x);
        let weights = [(0.0, one), (0.0, two), (1.0, zero)];
        for j in b[2].max(top)..=bottom {
            let y = f64::from(j) + ASIDE.y - at.y;
            let row = weights.map(|(c, p)| of(c + p[1] * y));
            for i in (b[0].max(left)..=right).step_by(4) {
                let x = ramp + f64::from(i);
                let [one, two, zero] = [0, 1, 2].map(|k| x.mul_add(of(weights[k].1[0]), row[k]).simd_ge(of(0.0)));
                let mut inside = (one & two & zero).to_bitmask() & ((2 << (right - i).min(3)) - 1);
                while inside != 0 {
                    let i = i + inside.trailing_zeros();
                    inside &= inside - 1;
                    let x = f64::from(i) + ASIDE.x - at.x;
                    let key = base + ratio * (v[0] * x + v[1] * y);
                    self.found.push(Crossing { pixel: place(i - left, j - top) as u16, enters, cell: face.cell, key });
                }
            }
        }
    }

    /// Sorts what was found.
    pub(super) fn sort(&mut self) {
        self.start.clear();
        self.start.resize(PIXELS + 1, 0);
        for c in &self.found {
            self.start[c.pixel as usize + 1] += 1;
        }
        for i in 0..PIXELS {
            self.start[i + 1] += self.start[i];
        }
        let none = Crossing { pixel: 0, enters: false, cell: 0, key: 0.0 };
        self.sorted.clear();
        self.sorted.resize(self.found.len(), none);
        let mut next = self.start.clone();
        for c in &self.found {
            let at = &mut next[c.pixel as usize];
            self.sorted[*at as usize] = *c;
            *at += 1;
        }
        for w in self.start.windows(2) {
            let of_pixel = &mut self.sorted[w[0] as usize..w[1] as usize];
            if of_pixel.len() > 1 {
                let place = |c: &Crossing| if c.enters { c.key } else { c.key - TOGETHER };
                of_pixel.sort_unstable_by(|a, b| place(a).total_cmp(&place(b)).then(a.cell.cmp(&b.cell)));
            }
        }
    }

    fn of(&self, pixel: usize) -> &[Crossing] {
        &self.sorted[self.start[pixel] as usize..self.start[pixel + 1] as usize]
    }

    /// Where a pixel's ray enters the mesh first; −∞ if the eye is inside, or it never does.
    pub(super) fn first(&self, pixel: usize) -> f32 {
        self.of(pixel).first().filter(|c| c.enters).map_or(f32::NEG_INFINITY, |c| c.key as f32)
    }

    /// Where a pixel's ray crosses the boundary last.
    pub(super) fn last(&self, pixel: usize) -> f32 {
        self.of(pixel).last().map_or(f32::NEG_INFINITY, |c| c.key as f32)
    }

    /// Whether a pixel's ray crosses the boundary anywhere.
    pub(super) fn any(&self, pixel: usize) -> bool {
        self.start[pixel] < self.start[pixel + 1]
    }

    /// How much of the mesh, in keys, a pixel's ray has between two keys; none if it enters not as often as it leaves.
    pub(super) fn between(&self, pixel: usize, from: f64, to: f64, eye_inside: bool) -> Option<f64> {
        let all = self.of(pixel);
        let sum: i32 = all.iter().map(|c| if c.enters { 1 } else { -1 }).sum();
        if sum > 0 || (sum < 0 && !eye_inside) {
            return None;
        }
        let (mut inside, mut since, mut length) = (-sum, f64::NEG_INFINITY, 0.0);
        for c in all {
            if inside > 0 {
                length += (c.key.min(to) - since.max(from)).max(0.0);
            }
            inside += if c.enters { 1 } else { -1 };
            if inside < 0 {
                return None;
            }
            since = c.key;
        }
        Some(length)
    }

    /// Whether a pixel's ray is inside the mesh at this key, or crosses the boundary as near to it as `slack`.
    pub(super) fn holds(&self, pixel: usize, key: f64, slack: f64) -> bool {
        let all = self.of(pixel);
        let step = |c: &Crossing| if c.enters { 1 } else { -1 };
        let before: i32 = all.iter().filter(|c| c.key < key).map(step).sum();
        let sum: i32 = all.iter().map(step).sum();
        before > sum.min(0) || all.iter().any(|c| (c.key - key).abs() <= slack)
    }

    /// Calls `pair` with each two cells through which some ray leaves the mesh and then enters it again.
    fn for_each_gap(&self, mut pair: impl FnMut(u32, u32)) {
        let mut last = (u32::MAX, u32::MAX);
        for w in self.sorted.windows(2) {
            let gap = (w[0].cell, w[1].cell);
            if w[0].pixel == w[1].pixel && !w[0].enters && w[1].enters && gap != last && gap.0 != gap.1 {
                last = gap;
                pair(gap.0, gap.1);
            }
        }
    }
}

/// Where pixel (`i`, `j`) of a tile is in its arrays: blocks of 4 × 2 pixels lie together.
pub(super) fn place(i: u32, j: u32) -> usize {
    ((j / 2 * (TILE / 4) + i / 4) * 8 + j % 2 * 4 + i % 4) as usize
}

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
        self.nodes.resize(records.len(), Node { next: [BOUNDARY; 4], before: 0 });
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
        crossings.for_each_gap(|a, b| {
            let (a, b) = (place[a as usize], place[b as usize]);
            if a > 0 && b > 0 {
                gaps.push((a - 1, b - 1));
            }
        });
        self.gaps.sort_unstable();
        self.gaps.dedup();
        for &(_, b) in &self.gaps {
            self.nodes[b as usize].before += 1;
        }
        for &cell in cells {
            place[cell as usize] = 0;
        }
        self.free.clear();
        self.free.extend((0..records.len() as u32).rev().filter(|&i| self.nodes[i as usize].before == 0));
        (self.search, self.left) = (0, records.len());
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
        if !self.gaps.is_empty() {
            let from = self.gaps.partition_point(|g| (g.0 as usize) < i);
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
