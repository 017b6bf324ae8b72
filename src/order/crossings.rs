//! Where the rays of a tile cross the boundary of the mesh.
//!
//! A boundary face is told relative to its deepest corner R: with e₁, e₂ to the others and n = e₁ × e₂, in the frame that is
//! sheared so that R's ray is the axis, its depth is v = −w_R (n.x x + n.y y)/n.z at (x, y) from R, as in
//! [`crate::project::cpu`]. The ray (w_R x, w_R y, v) = β₁ e₁ + β₂ e₂ passes through it if β₁, β₂ and 1 − κ v − β₁ − β₂ are none
//! below 0.

use super::screen::{ASIDE, Lens, PixelBox, TILE};
use crate::geometry::TetMesh;
use crate::geometry::boundary::BoundaryFace;
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, f64x4};

/// Pixels of a tile.
pub(crate) const PIXELS: usize = (TILE * TILE) as usize;

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
pub(crate) struct Crossings {
    found: Vec<Crossing>,
    sorted: Vec<Crossing>,
    /// Pixel i has `sorted[start[i]..start[i + 1]]`.
    start: Vec<u32>,
    /// Where the ray of each pixel enters the mesh first: −∞ if the eye is inside, or it never does.
    first: Vec<f32>,
    /// Where it crosses the boundary last: −∞ if it never does.
    last: Vec<f32>,
    /// How much more often it enters than it leaves.
    balance: Vec<i32>,
}

impl Crossings {
    pub(crate) fn clear(&mut self) {
        self.found.clear();
    }

    /// Finds the pixels whose rays cross `face` of those in `bounds`, in the tile whose first pixel is (`left`, `top`).
    #[inline(always)]
    pub(crate) fn add<S: Simd>(
        &mut self,
        simd: S,
        geometry: &TetMesh,
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
    pub(crate) fn sort(&mut self) {
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
        for places in [&mut self.first, &mut self.last] {
            places.clear();
            places.resize(PIXELS, f32::NEG_INFINITY);
        }
        self.balance.clear();
        self.balance.resize(PIXELS, 0);
        for (pixel, w) in self.start.windows(2).enumerate() {
            let of_pixel = &mut self.sorted[w[0] as usize..w[1] as usize];
            if of_pixel.len() > 1 {
                let place = |c: &Crossing| if c.enters { c.key } else { c.key - TOGETHER };
                of_pixel.sort_unstable_by(|a, b| place(a).total_cmp(&place(b)).then(a.cell.cmp(&b.cell)));
            }
            if let Some(first) = of_pixel.first().filter(|c| c.enters) {
                self.first[pixel] = first.key as f32;
            }
            if let Some(last) = of_pixel.last() {
                self.last[pixel] = last.key as f32;
            }
            self.balance[pixel] = of_pixel.iter().map(|c| if c.enters { 1 } else { -1 }).sum();
        }
    }

    fn of(&self, pixel: usize) -> &[Crossing] {
        &self.sorted[self.start[pixel] as usize..self.start[pixel + 1] as usize]
    }

    /// Where each pixel's ray enters the mesh first; −∞ if the eye is inside, or it never does.
    pub(crate) fn first(&self) -> &[f32] {
        &self.first
    }

    /// Where each pixel's ray crosses the boundary last; −∞ if it never does.
    pub(crate) fn last(&self) -> &[f32] {
        &self.last
    }

    /// Whether a pixel's ray crosses the boundary anywhere.
    pub(crate) fn any(&self, pixel: usize) -> bool {
        self.start[pixel] < self.start[pixel + 1]
    }

    /// How much of the mesh, in keys, a pixel's ray has between two keys; none if it enters not as often as it leaves.
    pub(crate) fn between(&self, pixel: usize, from: f64, to: f64, eye_inside: bool) -> Option<f64> {
        let all = self.of(pixel);
        let sum = self.balance[pixel];
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
    pub(crate) fn holds(&self, pixel: usize, key: f64, slack: f64) -> bool {
        let all = self.of(pixel);
        if all.iter().any(|c| (c.key - key).abs() <= slack) {
            return true;
        }
        let before: i32 = all.iter().filter(|c| c.key < key).map(|c| if c.enters { 1 } else { -1 }).sum();
        before > self.balance[pixel].min(0)
    }

    /// Calls `pair` with each two cells through which the ray of a pixel leaves the mesh and then enters it again. Leaving for the
    /// nth time comes before entering once more, also where rounding or an overlap has them the other way round.
    pub(crate) fn for_each_gap(&self, mut pair: impl FnMut(usize, u32, u32)) {
        for (pixel, w) in self.start.windows(2).enumerate() {
            let all = &self.sorted[w[0] as usize..w[1] as usize];
            if all.len() < 2 {
                continue;
            }
            let entries = all.iter().filter(|c| c.enters);
            let inside = (all.len() as i32 - 2 * entries.clone().count() as i32).max(0) as usize;
            let exits = all.iter().filter(|c| !c.enters).skip(inside.saturating_sub(1));
            for (exit, entry) in exits.zip(entries.skip(usize::from(inside == 0))) {
                if exit.cell != entry.cell {
                    pair(pixel, exit.cell, entry.cell);
                }
            }
        }
    }

    /// Whether a pixel's ray is in the mesh once at most everywhere, and in the end as often outside as it must be: only then do
    /// its cells have an order.
    pub(crate) fn alternate(&self, pixel: usize) -> bool {
        let all = self.of(pixel);
        let mut inside = -self.balance[pixel];
        let mut is_one = (0..=1).contains(&inside);
        for c in all {
            inside += if c.enters { 1 } else { -1 };
            is_one &= (0..=1).contains(&inside);
        }
        is_one
    }

    /// Finds where the rays of the tile whose first pixel is `corner` cross faces with these boxes, and sorts that, in the
    /// instructions of `level`.
    pub(crate) fn find<'a>(
        &mut self,
        level: Level,
        geometry: &TetMesh,
        lens: &Lens,
        faces: impl Iterator<Item = (&'a BoundaryFace, PixelBox)>,
        corner: [u32; 2],
    ) {
        self.clear();
        macro_rules! with {
            ($simd:expr) => {
                $simd.vectorize(
                    #[inline(always)]
                    || faces.for_each(|(face, b)| self.add($simd, geometry, lens, face, b, corner)),
                )
            };
        }
        fearless_simd::dispatch!(level, simd => with!(simd));
        self.sort();
    }
}

/// Where pixel (`i`, `j`) of a tile is in its arrays: of four rows, column by column. So 4 × 4 pixels lie together from any column on.
pub(crate) fn place(i: u32, j: u32) -> usize {
    ((j / 4 * TILE + i) * 4 + j % 4) as usize
}

/// The column and row of a place in the arrays of a tile: the inverse of [`place`].
pub(crate) fn pixel_at(place: usize) -> [u32; 2] {
    let (column, within) = (place as u32 / 4, place as u32 % 4);
    [column % TILE, column / TILE * 4 + within]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_found_again() {
        for (i, j) in (0..TILE).flat_map(|j| (0..TILE).map(move |i| (i, j))) {
            assert_eq!(pixel_at(place(i, j)), [i, j]);
        }
    }
}
