//! The screen: what a frame does once for all points, cells and boundary faces. Points are projected, and each cell is dealt to the
//! tiles of the image whose pixel centres its outline may hold.
//!
//! In a perspective view p − eye = w (d₀ + X d₁ + Y d₂): w is the depth along the view direction, (X, Y) the place on the image in
//! pixels, counted from the centre of the first one. In a parallel view p − o₀ = X o₁ + Y o₂ + w d₀. The inverse of either 3 × 3
//! matrix gives h = (X w, Y w, w), or (X, Y, w).
//!
//! Depths along a pixel's ray are compared as keys, V = w₀ − w₀²/w in perspective (parallel: w − w₀), which are linear on the
//! screen on every plane. w₀ is near the near side of the mesh, so keys are as small as the mesh is, wherever the camera is.

use crate::geometry::TetMesh;
use crate::view::View;
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, f32x4, i32x4};
use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;
use std::ops::Range;

/// Width and height of a tile in pixels.
pub(crate) const TILE: u32 = 32;

/// Parts that cells are dealt out in: bits do not depend on the number of threads.
const PARTS: usize = 64;

/// Cells that are bounded by one thread at a time.
const SOME: usize = 4096;

/// Depth, in normalised units, in front of which nothing in perspective views is drawn.
pub(crate) const NEAREST: f64 = 1e-7;

/// How far from its centre, in columns and rows, the ray of a pixel passes: edges of meshes that are aligned with the
/// view do not run through rays then.
pub(crate) const ASIDE: DVec2 = DVec2::new(1.3e-7, 0.9e-7);

/// How points become places on the image.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lens {
    origin: DVec3,
    inverse: DMat3,
    forward: DMat3,
    direction: [DVec3; 3],
    /// Rays meet in the eye.
    pub(crate) meet: bool,
    /// The depth that keys count from.
    pub(crate) reference: f64,
    /// Columns and rows of pixels.
    pub(crate) size: [u32; 2],
    /// Whether anything but the eye limits rays where the mesh is.
    pub(crate) limited: bool,
}

impl Lens {
    /// None if the mesh lies behind the eye.
    pub(crate) fn new(geometry: &TetMesh, view: &View) -> Option<Self> {
        let fan = view.fan(geometry.centre, geometry.scale, f64::INFINITY);
        let (origin, direction) = (fan.by_pixel(fan.origin, view.size()), fan.by_pixel(fan.direction, view.size()));
        let meet = view.eye().is_some();
        let across = if meet { [direction[1], direction[2]] } else { [origin[1], origin[2]] };
        let forward = DMat3::from_cols(across[0], across[1], direction[0]);
        let mut lens = Lens {
            origin: origin[0],
            inverse: forward.inverse(),
            forward,
            direction,
            meet,
            reference: 0.0,
            size: view.size(),
            limited: false,
        };
        let [low, high] = geometry.boundary.bounds();
        let corners = (0..8).map(|k| {
            let pick = |bit: usize, l: f64, h: f64| if k >> bit & 1 == 1 { h } else { l };
            lens.place(DVec3::new(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z))).z
        });
        let (near, far) = corners.fold((f64::INFINITY, f64::NEG_INFINITY), |(n, f), w| (n.min(w), f.max(w)));
        if meet && far <= NEAREST {
            return None;
        }
        lens.reference = if meet { near.max(0.5 * far) } else { near };
        let cut = (fan.near > near && (fan.near > 0.0 || !meet)) || fan.far < far;
        lens.limited = cut || !view.clipping_planes().is_empty() || view.has_depth();
        Some(lens)
    }

    /// What h counts from.
    pub(crate) fn origin(&self) -> DVec3 {
        self.origin
    }

    /// h of a point.
    #[inline(always)]
    pub(crate) fn place(&self, p: DVec3) -> DVec3 {
        self.inverse * (p - self.origin)
    }

    /// h of a difference of points.
    #[inline(always)]
    pub(crate) fn turn(&self, d: DVec3) -> DVec3 {
        self.inverse * d
    }

    /// Rows of the matrix that [`Self::turn`] is.
    pub(crate) fn rows(&self) -> [DVec3; 3] {
        [0, 1, 2].map(|k| self.inverse.row(k))
    }

    /// Column and row of h.
    #[inline(always)]
    pub(crate) fn pixel(&self, h: DVec3) -> DVec2 {
        if self.meet { h.truncate() / h.z } else { h.truncate() }
    }

    /// The point at depth `w` of the ray at a column and row.
    pub(crate) fn point(&self, column: f64, row: f64, w: f64) -> DVec3 {
        let scale = if self.meet { w } else { 1.0 };
        self.origin + self.forward * DVec3::new(column * scale, row * scale, w)
    }

    /// The direction of the ray at a column and row, of length 1.
    pub(crate) fn direction(&self, column: f64, row: f64) -> DVec3 {
        let [middle, across, down] = self.direction;
        if self.meet { (middle + across * column + down * row).normalize() } else { middle.normalize() }
    }

    /// Whether columns, rows and depth are a left-handed system.
    pub(crate) fn mirrored(&self) -> bool {
        self.inverse.determinant() < 0.0
    }

    /// The key of a depth.
    pub(crate) fn key(&self, w: f64) -> f64 {
        match self.meet {
            true if w <= 0.0 => f64::NEG_INFINITY,
            true => self.reference - self.reference * (self.reference / w),
            false => w - self.reference,
        }
    }

    /// The depth of a key: the inverse of [`Self::key`].
    pub(crate) fn depth(&self, key: f64) -> f64 {
        match self.meet {
            true if key >= self.reference => f64::INFINITY,
            true => self.reference * (self.reference / (self.reference - key)),
            false => key + self.reference,
        }
    }

    /// The length of the ray at a column and row for each unit of depth.
    pub(crate) fn length(&self, column: f64, row: f64) -> f64 {
        self.stretch(column, row)[0].sqrt()
    }

    /// The square of that length at columns and rows (x, y) from there: of 1, x, y, x², y², x y.
    pub(crate) fn stretch(&self, column: f64, row: f64) -> [f64; 6] {
        let [middle, across, down] = self.direction;
        if !self.meet {
            return [middle.length_squared(), 0.0, 0.0, 0.0, 0.0, 0.0];
        }
        let d = middle + across * column + down * row;
        let [x, y] = [across, down].map(|a| 2.0 * d.dot(a));
        [d.length_squared(), x, y, across.length_squared(), down.length_squared(), 2.0 * across.dot(down)]
    }

    /// The keys between which pixel (`i`, `j`) is drawn.
    pub(crate) fn limits(&self, geometry: &TetMesh, view: &View, i: u32, j: u32) -> [f64; 2] {
        let ray = view.ray(i, j);
        if ray.t_min >= ray.t_max {
            return [f64::INFINITY, f64::NEG_INFINITY];
        }
        let start = self.place((ray.origin - geometry.centre) * geometry.scale).z;
        let slope = self.turn(ray.direction).z * geometry.scale;
        [ray.t_min, ray.t_max].map(|t| match (self.meet, t.is_finite()) {
            (_, false) => t,
            (true, _) => self.key(t * slope),
            (false, _) => self.key(start + t * slope),
        })
    }

    /// Number of tiles in a row and in all.
    pub(crate) fn tiles(&self) -> [usize; 2] {
        let [columns, rows] = self.size.map(|n| n.div_ceil(TILE) as usize);
        [columns, columns * rows]
    }
}

/// First and last column, first and last row of pixels; the first is beyond the last if there are none.
pub(crate) type PixelBox = [u16; 4];

/// No pixels.
pub(crate) const NONE: PixelBox = [1, 0, 1, 0];

/// The points of the mesh on the image, in columns and rows; NaN where they are not before the eye.
pub(crate) fn project(lens: &Lens, points: &[DVec3], places: &mut Vec<[f32; 2]>) {
    points
        .par_iter()
        .with_min_len(4096)
        .map(|&p| {
            let h = lens.place(p);
            let at = if lens.meet && h.z <= NEAREST { DVec2::NAN } else { lens.pixel(h) };
            [at.x as f32, at.y as f32]
        })
        .collect_into_vec(places);
}

/// Of each of `n` cells or faces with these corners the pixels whose centres its outline may hold.
pub(crate) fn all_bounds<const K: usize>(
    lens: &Lens,
    points: &[DVec3],
    places: &[[f32; 2]],
    n: usize,
    corners: impl Fn(usize) -> [u32; K] + Sync,
    boxes: &mut Vec<PixelBox>,
) {
    let level = Level::new();
    boxes.resize(n, NONE);
    boxes.par_chunks_mut(SOME).enumerate().for_each(|(part, boxes)| {
        fearless_simd::dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || {
                for (i, pixels) in boxes.iter_mut().enumerate() {
                    *pixels = bounds_of(simd, lens, points, places, corners(part * SOME + i));
                }
            }
        ));
    });
}

/// As [`all_bounds`], of one cell or face.
pub(crate) fn bounds<const K: usize>(
    lens: &Lens,
    points: &[DVec3],
    places: &[[f32; 2]],
    corners: [u32; K],
) -> PixelBox {
    fearless_simd::dispatch!(Level::baseline(), simd => bounds_of(simd, lens, points, places, corners))
}

#[inline(always)]
fn bounds_of<S: Simd, const K: usize>(
    simd: S,
    lens: &Lens,
    points: &[DVec3],
    places: &[[f32; 2]],
    corners: [u32; K],
) -> PixelBox {
    // The least column and row, and the greatest, of which the sign is turned.
    let both = |[x, y]: [f32; 2]| f32x4::load_array(simd, [x, y, -x, -y]);
    let mut low = both(places[corners[0] as usize]);
    let mut sum = low;
    for &corner in &corners[1..] {
        let at = both(places[corner as usize]);
        (low, sum) = (low.min(at), sum + at);
    }
    if sum[0].is_nan() {
        match clipped(lens, &corners.map(|p| points[p as usize])) {
            Some([[left, top], [right, bottom]]) => low = f32x4::load_array(simd, [left, top, -right, -bottom]),
            None => return NONE,
        }
    }
    let [right, bottom] = lens.size.map(|n| (n - 1) as f32);
    // Single floats round places far aside to thousandths of a pixel.
    let low = low - 0.01 - low.abs() * 1e-6;
    let whole = low.max(f32x4::load_array(simd, [0.0, 0.0, -right, -bottom])).ceil().min(f32x4::splat(simd, 65535.0));
    let [left, top, right, bottom] = i32x4::truncate_from(whole).to_array();
    if left + right > 0 || top + bottom > 0 {
        return NONE;
    }
    [left as u16, -right as u16, top as u16, -bottom as u16]
}

/// Least and greatest places of what of a cell or face lies before the eye; none if nothing does.
#[cold]
fn clipped(lens: &Lens, corners: &[DVec3]) -> Option<[[f32; 2]; 2]> {
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    let mut take = |h: DVec3| {
        let at = lens.pixel(h);
        (low, high) = (low.min(at), high.max(at));
    };
    for (k, &p) in corners.iter().enumerate() {
        let a = lens.place(p);
        if a.z > NEAREST {
            take(a);
        }
        for &q in &corners[..k] {
            let b = lens.place(q);
            if (a.z > NEAREST) != (b.z > NEAREST) {
                let cut = a + (b - a) * ((NEAREST - a.z) / (b.z - a.z));
                take(DVec3::new(cut.x, cut.y, NEAREST));
            }
        }
    }
    let far = DVec2::splat(1e9);
    let float = |v: DVec2| v.clamp(-far, far).to_array().map(|v| v as f32);
    (low.x <= high.x).then(|| [float(low), float(high)])
}

/// What was dealt to each tile, in ascending order.
#[derive(Debug, Default)]
pub(crate) struct Dealt {
    parts: Vec<Part>,
}

/// What was dealt of one part of the items: tile t has `items[start[t]..start[t + 1]]`.
#[derive(Debug, Default)]
struct Part {
    start: Vec<u32>,
    items: Vec<u32>,
}

impl Dealt {
    /// Deals items to the tiles that their boxes meet.
    pub(crate) fn new(lens: &Lens, boxes: &[PixelBox]) -> Self {
        let [columns, tiles] = lens.tiles();
        let n = boxes.len();
        let parts = (0..PARTS).into_par_iter().map(|k| deal(columns, tiles, n * k / PARTS..n * (k + 1) / PARTS, boxes));
        Dealt { parts: parts.collect() }
    }

    /// The items of tile `t`.
    pub(crate) fn of(&self, t: usize) -> impl Iterator<Item = u32> + '_ {
        let range = move |p: &Part| p.start[t] as usize..p.start[t + 1] as usize;
        self.parts.iter().flat_map(move |p| p.items[range(p)].iter().copied())
    }

    /// How many items tile `t` has.
    pub(crate) fn len(&self, t: usize) -> usize {
        self.parts.iter().map(|p| (p.start[t + 1] - p.start[t]) as usize).sum()
    }
}

fn deal(columns: usize, tiles: usize, range: Range<usize>, boxes: &[PixelBox]) -> Part {
    let mut start = vec![0_u32; tiles + 1];
    let tiles_of = |b: &PixelBox| {
        let [l, r, t, b] = b.map(|v| usize::from(v) / TILE as usize);
        (t..=b).flat_map(move |y| (l..=r).map(move |x| y * columns + x))
    };
    let seen = |i: &usize| boxes[*i][0] <= boxes[*i][1];
    for i in range.clone().filter(seen) {
        tiles_of(&boxes[i]).for_each(|t| start[t + 1] += 1);
    }
    for t in 0..tiles {
        start[t + 1] += start[t];
    }
    let mut next = start.clone();
    let mut items = vec![0; start[tiles] as usize];
    for i in range.filter(seen) {
        for t in tiles_of(&boxes[i]) {
            items[next[t] as usize] = i as u32;
            next[t] += 1;
        }
    }
    Part { start, items }
}
