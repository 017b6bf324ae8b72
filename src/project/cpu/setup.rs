//! Set-up: what the sweep knows of a cell, formed in f64 and kept in f32, eight cells at a time.
//!
//! A cell is told relative to one of its corners R, at depth w_R, seen at (X_R, Y_R). In the frame that is sheared so that R's
//! ray is the axis, corner k minus R is e_k = (Δh.x − X_R Δh.z, Δh.y − Y_R Δh.z, Δh.z) with Δh = h_k − h_R ([`crate::order::screen`]). On
//! the ray of a pixel at (x, y) from (X_R, Y_R) let τ be the depth beyond w_R and v = w_R τ/(w_R + τ) = w_R − w_R²/w: like 1/w it is
//! linear on the screen on each face, but as small as the cell is, so f32 keeps its digits. With a₁ = e₂ × e₃ and so on, S = Σ a_i and
//! D = e₁ · a₁, all of the sign that makes D > 0, the face opposite to corner i (which holds R) has
//!     v = −w_R (a_i.x x + a_i.y y)/a_i.z,                 and is turned to the eye if a_i.z > 0;
//! the face opposite to R has, with c = w_R S.z + D,
//!     v = w_R (D − w_R (S.x x + S.y y))/c,                and is turned to the eye if c < 0.
//! A ray is inside between the greatest v of faces turned to the eye and the least of the others. With κ = 1/w_R, τ = v/(1 − κ v), so
//! τ_out − τ_in = (v_out − v_in)/((1 − κ v_in)(1 − κ v_out)) without cancellation. The field is s_R + (w_R + τ)(g.x x + g.y y) + τ g.z
//! with g = Σ (s_i − s_R) a_i/D. The key of a depth (`screen`) is V_R + (w₀/w_R)² v.
//!
//! Parallel views are the same with e_k = Δh, 1 for w_R, κ = 0, c = S.z and V = V_R + v.

use super::doubles::{by_cell, cross, guard, single, singles, terms, turn, wide};
use super::outline::{Blocks, add_blocks};
use super::runs::Runs;
use crate::geometry::{Cell, TetMesh, Values};
use crate::integral::Exact;
use crate::memory::prefetch;
use crate::order::screen::{ASIDE, Lens, NEAREST, PixelBox, TILE};
use crate::view::Blend;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4, f32x8, f64x8, i32x8, u8x16};
use glam::DVec3;
use rayon::prelude::*;

/// A cell whose thickest place is less than this share of its extent in depth is intersected in f64: f32 could not tell its
/// thickness.
const FLAT: f64 = 2e-3;

/// A face whose area on the screen is less than this share of the terms that it is the difference of is edge-on: no order follows.
const EDGE_ON: f64 = 1e-10;

/// Optical depth over a cell's extent in depth, times the transmittance behind it, from which on rounding of lengths shows.
const DENSE: f64 = 30.0;

/// Transmittance below which it is not seen.
const DARK: f32 = 1e-3;

/// Size of normalised values from which on rounding of others in the same cell shows where one value makes the pixel.
const WIDE: f32 = 4.0;

/// How far apart the values of a cell may be, where all of the field may span 2: beside an outlier, f32 places within the cell
/// are too coarse for a function over the rest of the values.
const STEEP: f32 = 0.25;

/// The lines of a cell of which nothing is seen.
pub(super) const UNSEEN: [u16; 2] = [1, 0];

/// Cells that are set up at a time: as wide as the widest instructions, and others do it in parts.
pub(super) const EIGHT: usize = 8;

/// The last column or row of a tile.
const MOST: u16 = TILE as u16 - 1;

/// Cells that are read together, so that memory has many of them to find at a time.
const TOGETHER: usize = 32;

/// A cell of one tile.
#[derive(Debug, Clone, Copy)]
#[repr(align(128))]
pub(super) struct Record<const N: usize> {
    /// v = plane[0] + plane[1] x + plane[2] y of the four faces; those turned to the eye come first.
    pub(super) plane: [[f32; 4]; 3],
    /// (X_R, Y_R) in pixels from the tile's first pixel: whole ones, and the rest.
    pub(super) at: [f32; 2],
    pub(super) rest: [f32; 2],
    /// 1/w_R, or 0.
    pub(super) kappa: f32,
    /// v beyond which the ray is behind the eye.
    pub(super) end: f32,
    /// V_R, (w₀/w_R)².
    pub(super) key: [f32; 2],
    /// s_R, w_R (g.x, g.y), g.z.
    pub(super) field: [[f32; 4]; N],
    /// Least and greatest value.
    pub(super) span: [[f32; 2]; N],
    /// First and last column and row of the tile's pixels that it may cover.
    pub(super) pixels: [u8; 4],
    /// How many faces are turned to the eye.
    pub(super) fronts: u8,
    /// A bit for each corner whose opposite face is turned away for sure: the cell beyond it comes later.
    pub(super) away: u8,
    pub(super) look: Look,
    /// Transmittance behind the cell beyond which f32's lengths are too coarse for its extinction, or f32's values for the largest;
    /// infinite for most cells.
    pub(super) dark: f32,
    /// First and last interval of the transfer function (scalar fields).
    pub(super) lines: [u16; 2],
    /// Where its blocks begin in the tile's, and how many they are.
    pub(super) first_block: u32,
    pub(super) blocks: u8,
    /// Index into the mesh.
    pub(super) cell: u32,
}

/// The cells of a tile, and their blocks: bytes, and some more at the end.
#[derive(Debug)]
pub(super) struct Records<const N: usize> {
    pub(super) all: Vec<Record<N>>,
    pub(super) blocks: Blocks,
    /// The neighbours of each.
    pub(super) around: Vec<[u32; 4]>,
}

/// What of a cell is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Look {
    /// Nothing, but it stays in the order, and pixels check that it was there.
    Unseen,
    /// Its pixels, in f32.
    Seen,
    /// Its pixels, one by one in f64.
    Flat,
    /// It has no volume: nothing, and no pixel misses it.
    Empty,
}

/// Bytes of four floats by the mask of faces turned to the eye: those of these faces first.
static FRONTS_FIRST: [[u8; 16]; 16] = {
    let mut table = [[0; 16]; 16];
    let mut mask = 0;
    while mask < 16 {
        let (mut at, mut pass) = (0, 0);
        while pass < 2 {
            let mut k = 0;
            while k < 4 {
                if (mask >> k & 1 == 1) == (pass == 0) {
                    let mut byte = 0;
                    while byte < 4 {
                        table[mask][4 * at + byte] = (4 * k + byte) as u8;
                        byte += 1;
                    }
                    at += 1;
                }
                k += 1;
            }
            pass += 1;
        }
        mask += 1;
    }
    table
};

/// What records are made from.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scene<'a, const N: usize> {
    pub(super) geometry: &'a TetMesh,
    pub(super) values: &'a Values<N>,
    pub(super) exact: &'a Exact<f32>,
    /// The lines of the function.
    pub(super) runs: &'a Runs,
    /// The greatest extinction of the function.
    pub(super) steepest: f32,
    pub(super) blend: Blend,
    /// Those of all cells, for pictures that composite.
    pub(super) lines: &'a [[u16; 2]],
    pub(super) lens: &'a Lens,
    /// The pixels that cells, and boundary faces, may cover.
    pub(super) boxes: &'a [PixelBox],
    pub(super) face_boxes: &'a [PixelBox],
}

impl<const N: usize> Scene<'_, N> {
    /// The values at the corners of a cell.
    #[inline(always)]
    pub(super) fn corner_values(&self, cell: u32, corners: [u32; 4]) -> [[f32; N]; 4] {
        match self.values {
            Values::Point(v) => corners.map(|p| v[p as usize]),
            Values::Corner(v) => v[cell as usize],
            Values::Cell(v) => [v[cell as usize]; 4],
        }
    }

    /// On which lines of the function the values of a cell are; [`UNSEEN`] if it is not seen.
    fn lines(&self, cell: usize) -> [u16; 2] {
        let v = self.corner_values(cell as u32, self.geometry.cells[cell].corners);
        if !v.iter().flatten().all(|v| v.is_finite()) {
            return UNSEEN;
        }
        let [low, high] = [f32::min, f32::max].map(|pick| v.iter().map(|v| v[N - 1]).reduce(pick).unwrap_or(0.0));
        let (opacity, direct) = (&self.exact.opacity, self.exact.direct);
        // The colours of direct emission are elsewhere for other fields.
        if direct && N > 1 || opacity.shows(low, high, direct) {
            opacity.intervals(low, high).map(|i| i as u16)
        } else {
            UNSEEN
        }
    }

    /// See [`Record::dark`]. What light comes through changes by its product with the extinction and the error of the length.
    #[inline(always)]
    fn dark(&self, span: &[[f32; 2]; N], lines: [u16; 2], extent: f64) -> f32 {
        match self.blend {
            Blend::Composite if f64::from(self.steepest) * extent > DENSE => {
                let depth = f64::from(self.exact.opacity.densest(lines)) * extent;
                if depth > DENSE { ((DENSE / depth) as f32).max(DARK) } else { f32::INFINITY }
            }
            Blend::Composite => f32::INFINITY,
            Blend::Maximum => {
                let wide = |s: &[f32; 2]| s[0] < s[1] && (s[0] < -WIDE || s[1] > WIDE || s[1] - s[0] > STEEP);
                if span.iter().any(wide) { 0.0 } else { f32::INFINITY }
            }
        }
    }

    /// Of each cell the lines of the function that its values are on, or [`UNSEEN`].
    pub(super) fn all_lines(&self, lines: &mut Vec<[u16; 2]>) {
        let cells = 0..self.geometry.cells.len();
        cells.into_par_iter().with_min_len(4096).map(|i| self.lines(i)).collect_into_vec(lines);
    }
}

/// Puts the first corner, relative to the lens's origin, and the edges from there into lane `l`.
#[inline(always)]
fn relative(lens: &Lens, p: &[DVec3; 4], l: usize, from: &mut [[f64; EIGHT]; 3], edge: &mut [[[f64; EIGHT]; 3]; 3]) {
    let d = p[0] - lens.origin();
    (from[0][l], from[1][l], from[2][l]) = (d.x, d.y, d.z);
    for k in 0..3 {
        let d = p[k + 1] - p[0];
        (edge[k][0][l], edge[k][1][l], edge[k][2][l]) = (d.x, d.y, d.z);
    }
}

/// Makes the records of cells that meet the tile whose first pixel is `corner`.
#[inline(always)]
pub(super) fn set_up<S: Simd, const N: usize>(
    simd: S,
    scene: &Scene<N>,
    cells: &[u32],
    corner: [u32; 2],
    records: &mut Records<N>,
) {
    let mut read = [Read { corners: [DVec3::ZERO; 4], values: [[0.0; N]; 4] }; TOGETHER];
    records.all.clear();
    records.blocks.clear();
    records.around.clear();
    let geometry = scene.geometry;
    for (part, some) in cells.chunks(TOGETHER).enumerate() {
        // Where memory is slow the cells of the part after the next are on their way, and the points of the next.
        let coming = |k: usize| cells.iter().skip((part + k) * TOGETHER).take(TOGETHER);
        coming(2).for_each(|&cell| prefetch(&geometry.cells, cell as usize));
        for &cell in coming(1) {
            geometry.cells[cell as usize].corners.iter().for_each(|&p| prefetch(&geometry.points, p as usize));
        }
        for (&cell, read) in some.iter().zip(&mut read) {
            let Cell { corners, neighbours } = geometry.cells[cell as usize];
            records.around.push(neighbours);
            for (to, from) in read.corners.iter_mut().zip(corners) {
                *to = geometry.points[from as usize];
            }
            read.values = scene.corner_values(cell, corners);
        }
        for (eight, read) in some.chunks(EIGHT).zip(read.chunks_mut(EIGHT)) {
            simd.vectorize(
                #[inline(always)]
                || set_up_eight(simd, scene, eight, read, corner, records),
            );
        }
    }
}

/// What memory has of a cell.
#[derive(Clone, Copy)]
struct Read<const N: usize> {
    corners: [DVec3; 4],
    values: [[f32; N]; 4],
}

/// Appends the records of up to eight cells.
#[inline(always)]
fn set_up_eight<S: Simd, const N: usize>(
    simd: S,
    scene: &Scene<N>,
    cells: &[u32],
    read: &mut [Read<N>],
    [left, top]: [u32; 2],
    records: &mut Records<N>,
) {
    let lens = scene.lens;
    let zero = [0.0; EIGHT];
    // The first corner from the lens's origin, the others from it: x, y, z.
    let mut from = [zero, zero, [1.0; EIGHT]];
    let mut edge = [[zero; 3]; 3];
    let mut first = [0_usize; EIGHT];
    for (l, read) in read[..cells.len()].iter().enumerate() {
        relative(lens, &read.corners, l, &mut from, &mut edge);
    }
    let of = |v: f64| f64x8::splat(simd, v);
    let (none, one) = (of(0.0), of(1.0));
    let rows = lens.rows();
    let mut h = turn(simd, &rows, &from);
    let mut e = [turn(simd, &rows, &edge[0]), turn(simd, &rows, &edge[1]), turn(simd, &rows, &edge[2])];
    if lens.meet {
        let rise = e[0][2].max(e[1][2]).max(e[2][2]);
        let near = rise.simd_gt(h[2] * 3.0).to_bitmask();
        if near != 0 {
            // The deepest corner, if the first is near the eye.
            for l in (0..cells.len()).filter(|l| near >> l & 1 == 1) {
                let rise = [0, 1, 2].map(|k| e[k][2].to_array()[l]);
                first[l] = (1..4).fold(1, |m, k| if rise[k - 1] > rise[m - 1] { k } else { m });
                read[l].corners.swap(0, first[l]);
                read[l].values.swap(0, first[l]);
                relative(lens, &read[l].corners, l, &mut from, &mut edge);
            }
            h = turn(simd, &rows, &from);
            e = [turn(simd, &rows, &edge[0]), turn(simd, &rows, &edge[1]), turn(simd, &rows, &edge[2])];
        }
    }
    let w = h[2];
    let (over_w, mut place) = (one / w, [h[0], h[1]]);
    let (m, q, kappa) = if lens.meet { (w, one, over_w) } else { (one, none, none) };
    if lens.meet {
        place = [place[0] * over_w, place[1] * over_w];
        for [x, y, z] in &mut e {
            (*x, *y) = (*x - place[0] * *z, *y - place[1] * *z);
        }
    }
    // Corners on the screen, in pixels of the tile.
    let aside = [place[0] - f64::from(left), place[1] - f64::from(top)];
    let mut outline = [[single(simd, aside[0]); 4], [single(simd, aside[1]); 4]];
    for k in 0..3 {
        let along = if lens.meet {
            let along = w + e[k][2];
            along.simd_gt(of(NEAREST)).select(one / along, of(f64::INFINITY))
        } else {
            one
        };
        for x in 0..2 {
            outline[x][k + 1] = single(simd, e[k][x].mul_add(along, aside[x]));
        }
    }
    let mut a = [cross(e[1], e[2]), cross(e[2], e[0]), cross(e[0], e[1])];
    let det = e[0][0] * a[0][0] + e[0][1] * a[0][1] + e[0][2] * a[0][2];
    let sign = one.copysign(det);
    for a in &mut a {
        *a = [a[0] * sign, a[1] * sign, a[2] * sign];
    }
    let det = det.abs();
    let sum = |k: usize| a[0][k] + a[1][k] + a[2][k];
    let sum = [sum(0), sum(1), sum(2)];
    let c = m * sum[2] + q * det;
    let safe = guard(c, m * (sum[0].abs() + sum[1].abs()));
    let f = m / safe;
    let mut planes = [[none; 4]; 3];
    (planes[0][0], planes[1][0], planes[2][0]) = (f * det, none - f * m * sum[0], none - f * m * sum[1]);
    for i in 0..3 {
        // What is 0 counts as turned to the eye, here and for the mask below.
        a[i][2] = guard(a[i][2], a[i][0].abs() + a[i][1].abs());
        let f = m / a[i][2];
        (planes[1][i + 1], planes[2][i + 1]) = (none - f * a[i][0], none - f * a[i][1]);
    }
    let scale = [terms(e[1], e[2]), terms(e[2], e[0]), terms(e[0], e[1])];
    // A bit for each face: turned to the eye, and edge-on.
    let turned = |v: f64x8<S>, bit: f64| v.simd_gt(none).select(of(bit), none);
    let fronts = turned(none - c, 1.0) + turned(a[0][2], 2.0) + (turned(a[1][2], 4.0) + turned(a[2][2], 8.0));
    let doubtful = |v: f64x8<S>, scale: f64x8<S>, bit: f64| v.abs().simd_le(scale * EDGE_ON).select(of(bit), none);
    let doubts = doubtful(c, m * (scale[0] + scale[1] + scale[2]), 1.0)
        + doubtful(a[0][2], scale[0], 2.0)
        + (doubtful(a[1][2], scale[1], 4.0) + doubtful(a[2][2], scale[2], 8.0));
    let faces = [fronts, doubts].map(|v| i32x8::truncate_from(single(simd, v)).to_array());
    // The chord through the thickest place is at least D over the greatest area.
    let area = (sum[2].abs()).max(a[0][2].abs()).max(a[1][2].abs().max(a[2][2].abs()));
    let extent = e[0][2].max(e[1][2]).max(e[2][2].max(none)) - e[0][2].min(e[1][2]).min(e[2][2].min(none));
    let flat = det.simd_lt(area * extent * FLAT).to_bitmask();
    let empty = !(det.simd_gt(none) & det.simd_lt(of(f64::INFINITY))).to_bitmask();
    let over = one / det.max(of(f64::MIN_POSITIVE));
    let reference = of(lens.reference);
    let [key, ratio] = if lens.meet {
        let share = reference * kappa;
        [reference - reference * share, share * share]
    } else {
        [w - reference, one]
    };

    // From here on in f32, and cell by cell: four numbers of each lie together.
    let [right, down] = [place[0] - ASIDE.x, place[1] - ASIDE.y];
    let (column, row) = (right.round_ties_even(), down.round_ties_even());
    let corner = [f64::from(left), f64::from(top)];
    let places = singles(simd, [column - corner[0], row - corner[1], right - column, down - row]);
    let keys = singles(simd, [key, ratio, one / kappa, kappa]);
    let planes = [singles(simd, planes[0]), singles(simd, planes[1]), singles(simd, planes[2])];
    let mut fields = [[[0.0; 4]; EIGHT]; N];
    let mut spans = [[[0.0; EIGHT]; 2]; N];
    let mut finite = f32x8::splat(simd, 0.0);
    for n in 0..N {
        let mut v = [[0.0; EIGHT]; 4];
        for (l, read) in read[..cells.len()].iter().enumerate() {
            for (v, value) in v.iter_mut().zip(&read.values) {
                v[l] = value[n];
            }
        }
        let start = wide(simd, v[0]);
        let rise = [wide(simd, v[1]) - start, wide(simd, v[2]) - start, wide(simd, v[3]) - start];
        let v = [
            f32x8::load_array(simd, v[0]),
            f32x8::load_array(simd, v[1]),
            f32x8::load_array(simd, v[2]),
            f32x8::load_array(simd, v[3]),
        ];
        let slope = |x: usize| (rise[0] * a[0][x] + rise[1] * a[1][x] + rise[2] * a[2][x]) * over;
        fields[n] =
            by_cell(simd, [v[0], single(simd, slope(0) * m), single(simd, slope(1) * m), single(simd, slope(2))]);
        let (low, high) = (v[0].min(v[1]).min(v[2].min(v[3])), v[0].max(v[1]).max(v[2].max(v[3])));
        spans[n] = [low.to_array(), high.to_array()];
        // NaN if any is not finite.
        finite += v[0] * 0.0 + v[1] * 0.0 + v[2] * 0.0 + v[3] * 0.0;
    }
    let finite = finite.simd_eq(f32x8::splat(simd, 0.0)).to_bitmask();
    let extents = extent.to_array();
    let mut pixels = [[0; 4]; EIGHT];
    let [left, top] = [left as u16, top as u16];
    for (&cell, pixels) in cells.iter().zip(&mut pixels) {
        let b = scene.boxes[cell as usize];
        let (first, last) =
            (|v: u16, from: u16| v.saturating_sub(from) as u8, |v: u16, from: u16| (v - from).min(MOST) as u8);
        *pixels = [first(b[0], left), last(b[1], left), first(b[2], top), last(b[3], top)];
    }
    let own_blocks = add_blocks(simd, outline[0], outline[1], &pixels[..cells.len()], &mut records.blocks);
    for (l, &cell) in cells.iter().enumerate() {
        let [front, doubt] = faces.map(|bits| bits[l] as usize & 15);
        let mut away = !(front | doubt) & 15;
        if first[l] != 0 {
            // Faces 0 and `first` were exchanged.
            let (bit, other) = (away & 1, away >> first[l] & 1);
            away = away & !(1 | 1 << first[l]) | other | bit << first[l];
        }
        let span = spans.map(|s| [s[0][l], s[1][l]]);
        let lines = if scene.blend == Blend::Composite { scene.lines[cell as usize] } else { [0; 2] };
        let mut look = if finite >> l & 1 == 1 && lines != UNSEEN { Look::Seen } else { Look::Unseen };
        if empty >> l & 1 == 1 {
            look = Look::Empty;
        } else if flat >> l & 1 == 1 && look == Look::Seen {
            look = Look::Flat;
        }
        let order = u8x16::load_array(simd, FRONTS_FIRST[front]);
        let sorted = |p: [f32; 4]| f32x4::load_array(simd, p).swizzle_dyn_within_blocks(order).to_array();
        let [x, y, beside, below] = places[l];
        let [key, ratio, end, kappa] = keys[l];
        records.all.push(Record {
            plane: [sorted(planes[0][l]), sorted(planes[1][l]), sorted(planes[2][l])],
            at: [x, y],
            rest: [beside, below],
            kappa,
            end,
            key: [key, ratio],
            field: fields.map(|f| f[l]),
            span,
            pixels: pixels[l],
            fronts: front.count_ones() as u8,
            away: away as u8,
            look,
            dark: scene.dark(&span, lines, extents[l]),
            lines,
            first_block: own_blocks[l].0,
            blocks: own_blocks[l].1,
            cell,
        });
    }
}
