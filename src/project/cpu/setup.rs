//! Set-up: what the sweep knows of a cell, formed in f64 and kept in f32, four cells at a time.
//!
//! A cell is told relative to one of its corners R, at depth w_R, seen at (X_R, Y_R). In the frame that is sheared so that R's
//! ray is the axis, corner k minus R is e_k = (Δh.x − X_R Δh.z, Δh.y − Y_R Δh.z, Δh.z) with Δh = h_k − h_R ([`super::coarse`]). On
//! the ray of a pixel at (x, y) from (X_R, Y_R) let τ be the depth beyond w_R and v = w_R τ/(w_R + τ) = w_R − w_R²/w: like 1/w it is
//! linear on the screen on each face, but as small as the cell is, so f32 keeps its digits. With a₁ = e₂ × e₃ and so on, S = Σ a_i and
//! D = e₁ · a₁, all of the sign that makes D > 0, the face opposite to corner i (which holds R) has
//!     v = −w_R (a_i.x x + a_i.y y)/a_i.z,                 and is turned to the eye if a_i.z > 0;
//! the face opposite to R has, with c = w_R S.z + D,
//!     v = w_R (D − w_R (S.x x + S.y y))/c,                and is turned to the eye if c < 0.
//! A ray is inside between the greatest v of faces turned to the eye and the least of the others. With κ = 1/w_R, τ = v/(1 − κ v), so
//! τ_out − τ_in = (v_out − v_in)/((1 − κ v_in)(1 − κ v_out)) without cancellation. The field is s_R + (w_R + τ)(g.x x + g.y y) + τ g.z
//! with g = Σ (s_i − s_R) a_i/D. The key of a depth (`coarse`) is V_R + (w₀/w_R)² v.
//!
//! Parallel views are the same with e_k = Δh, 1 for w_R, κ = 0, c = S.z and V = V_R + v.

use super::coarse::{ASIDE, Lens, TILE};
use crate::geometry::{Geometry, Values};
use crate::integral::Exact;
use crate::view::Blend;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x4};
use glam::DVec3;

/// A cell whose thickest place is less than this share of its extent in depth is intersected in f64: f32 could not tell its
/// thickness.
const FLAT: f64 = 2e-3;

/// A face whose area on the screen is less than this share of the terms that it is the difference of is edge-on: no order follows.
const EDGE_ON: f64 = 1e-10;

/// Optical depth over a cell's extent in depth from which on rounding of lengths shows in pixels that light comes through.
const DENSE: f64 = 30.0;

/// Size of normalised values from which on rounding of others in the same cell shows where one value makes the pixel.
const WIDE: f32 = 4.0;

/// How far apart the values of a cell may be, where all of the field may span 2: beside an outlier, f32 places within the cell
/// are too coarse for a function over the rest of the values.
const STEEP: f32 = 0.25;

/// A cell of one tile.
#[derive(Debug, Clone, Copy)]
pub(super) struct Record<const N: usize> {
    /// v = plane[0] + plane[1] x + plane[2] y of the four faces; those turned to the eye come first.
    pub(super) plane: [[f32; 4]; 3],
    /// (X_R, Y_R) in pixels from the tile's first pixel: whole ones, and the rest.
    pub(super) at: [f32; 2],
    pub(super) rest: [f32; 2],
    /// 1/w_R, or 0.
    pub(super) kappa: f32,
    /// V_R, (w₀/w_R)², and one over that.
    pub(super) key: [f32; 3],
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
    /// f32's lengths are too coarse for its extinction, where that lets light through, or f32's values for the largest.
    pub(super) coarse: bool,
    /// First and last interval of the transfer function (scalar fields).
    pub(super) lines: [u16; 2],
    /// Index into the mesh.
    pub(super) cell: u32,
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

/// Face indices by the mask of faces turned to the eye: these first.
static FRONTS_FIRST: [[u8; 4]; 16] = {
    let mut table = [[0; 4]; 16];
    let mut mask = 0;
    while mask < 16 {
        let (mut at, mut pass) = (0, 0);
        while pass < 2 {
            let mut k = 0;
            while k < 4 {
                if (mask >> k & 1 == 1) == (pass == 0) {
                    table[mask][at] = k as u8;
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
    pub(super) geometry: &'a Geometry,
    pub(super) values: &'a Values<N>,
    pub(super) exact: &'a Exact<f32>,
    /// The greatest extinction of the function.
    pub(super) steepest: f32,
    pub(super) blend: Blend,
    pub(super) lens: &'a Lens,
    pub(super) places: &'a [[f32; 2]],
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

    /// What of a cell with these values is seen, and on which lines of the function they are.
    #[inline(always)]
    fn look(&self, span: &[[f32; 2]; N], finite: bool) -> (Look, [u16; 2]) {
        if !finite {
            return (Look::Unseen, [0; 2]);
        }
        let [low, high] = span[N - 1];
        if self.blend == Blend::Maximum {
            return (Look::Seen, [0; 2]);
        }
        let opacity = &self.exact.opacity;
        let direct = self.exact.direct;
        // The colours of direct emission are elsewhere for other fields.
        if !(direct && N > 1 || opacity.shows(low, high, direct)) {
            return (Look::Unseen, [0; 2]);
        }
        (Look::Seen, opacity.intervals(low, high).map(|i| i as u16))
    }
}

/// Appends the records of up to four cells that meet the tile whose first pixel is (`left`, `top`).
#[inline(always)]
pub(super) fn set_up<S: Simd, const N: usize>(
    simd: S,
    scene: &Scene<N>,
    cells: &[u32],
    [left, top]: [u32; 2],
    records: &mut Vec<Record<N>>,
) {
    let Scene { geometry, lens, .. } = scene;
    let zero = [0.0; 4];
    let mut edge = [[zero; 3]; 3];
    let (mut at, mut depth) = ([zero; 2], [1.0; 4]);
    let mut values = [[[0.0_f32; N]; 4]; 4];
    let mut first = [0_usize; 4];
    for (l, &cell) in cells.iter().enumerate() {
        let corners = geometry.cells[cell as usize].corners;
        let mut p = corners.map(|c| geometry.points[c as usize]);
        values[l] = scene.corner_values(cell, corners);
        let mut h = lens.place(p[0]);
        if lens.meet {
            // The deepest corner, if the first is near the eye.
            let w = p.map(|q| lens.place(q).z);
            let deepest = (1..4).fold(0, |m, k| if w[k] > w[m] { k } else { m });
            if w[0] < 0.25 * w[deepest] {
                first[l] = deepest;
                p.swap(0, deepest);
                values[l].swap(0, deepest);
                h = lens.place(p[0]);
            }
        }
        let place = lens.pixel(h) - ASIDE;
        (at[0][l], at[1][l], depth[l]) = (place.x, place.y, h.z);
        for k in 0..3 {
            let d = p[k + 1] - p[0];
            (edge[k][0][l], edge[k][1][l], edge[k][2][l]) = (d.x, d.y, d.z);
        }
    }
    let of = |v: f64| f64x4::splat(simd, v);
    let load = |v: &[f64; 4]| f64x4::from_slice(simd, v);
    let w_r = load(&depth);
    let [m, q] = if lens.meet { [w_r, of(1.0)] } else { [of(1.0), of(0.0)] };
    let rows = lens.rows();
    let (ax, ay) = (load(&at[0]) + ASIDE.x, load(&at[1]) + ASIDE.y);
    let e = edge.map(|d| {
        let [x, y, z] = [load(&d[0]), load(&d[1]), load(&d[2])];
        let [hx, hy, hz] = rows.map(|r: DVec3| x * r.x + y * r.y + z * r.z);
        if lens.meet { [hx - ax * hz, hy - ay * hz, hz] } else { [hx, hy, hz] }
    });
    let cross = |a: [f64x4<S>; 3], b: [f64x4<S>; 3]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let mut a = [cross(e[1], e[2]), cross(e[2], e[0]), cross(e[0], e[1])];
    let det = e[0][0] * a[0][0] + e[0][1] * a[0][1] + e[0][2] * a[0][2];
    let sign = of(1.0).copysign(det);
    a = a.map(|a| a.map(|c| c * sign));
    let det = det.abs();
    let sum = [0, 1, 2].map(|k| a[0][k] + a[1][k] + a[2][k]);
    let c = m * sum[2] + q * det;
    // Never 0, of the same sign.
    let guard = |v: f64x4<S>, scale: f64x4<S>| v.abs().max(scale * 1e-12 + 1e-280).copysign(v);
    let safe = guard(c, m * (sum[0].abs() + sum[1].abs()));
    let f = m / safe;
    let mut planes = [[of(0.0); 4]; 3];
    (planes[0][0], planes[1][0], planes[2][0]) = (f * det, -(f * m * sum[0]), -(f * m * sum[1]));
    for i in 0..3 {
        // What is 0 counts as turned to the eye, here and for the mask below.
        a[i][2] = guard(a[i][2], a[i][0].abs() + a[i][1].abs());
        let f = m / a[i][2];
        (planes[1][i + 1], planes[2][i + 1]) = (-(f * a[i][0]), -(f * a[i][1]));
    }
    let terms = |p: [f64x4<S>; 3], r: [f64x4<S>; 3]| (p[0] * r[1]).abs() + (p[1] * r[0]).abs();
    let scale = [terms(e[1], e[2]), terms(e[2], e[0]), terms(e[0], e[1])];
    let fronts = [of(0.0) - c, a[0][2], a[1][2], a[2][2]].map(|v| v.simd_gt(of(0.0)).to_bitmask());
    let doubtful = |v: f64x4<S>, scale: f64x4<S>| v.abs().simd_le(scale * EDGE_ON).to_bitmask();
    let doubts = [
        doubtful(c, m * (scale[0] + scale[1] + scale[2])),
        doubtful(a[0][2], scale[0]),
        doubtful(a[1][2], scale[1]),
        doubtful(a[2][2], scale[2]),
    ];
    // The chord through the thickest place is at least D over the greatest area.
    let area = (sum[2].abs()).max(a[0][2].abs()).max(a[1][2].abs().max(a[2][2].abs()));
    let none = of(0.0);
    let extent = e[0][2].max(e[1][2]).max(e[2][2].max(none)) - e[0][2].min(e[1][2]).min(e[2][2].min(none));
    let flat = det.simd_lt(area * extent * FLAT).to_bitmask();
    let extents: [f64; 4] = extent.into();
    let over = of(1.0) / det.max(of(f64::MIN_POSITIVE));
    let normals: [[[f64; 4]; 3]; 3] = a.map(|a| [a[0] * over * m, a[1] * over * m, a[2] * over].map(Into::into));
    let planes: [[[f64; 4]; 4]; 3] = planes.map(|p| p.map(Into::into));
    let det: [f64; 4] = det.into();
    let kappa = if lens.meet { of(1.0) / w_r } else { of(0.0) };
    let kappa: [f64; 4] = kappa.into();
    let end = lens.size.map(|n| n - 1);
    for (l, &cell) in cells.iter().enumerate() {
        let corners = geometry.cells[cell as usize].corners;
        // Cells that were dealt have bounds.
        let b = super::coarse::bounds(lens, &geometry.points, scene.places, corners).unwrap_or([0; 4]);
        let inside = |v: u32, from: u32, end: u32| v.clamp(from, (from + TILE - 1).min(end)) - from;
        let pixels = [
            inside(b[0], left, end[0]),
            inside(b[1], left, end[0]),
            inside(b[2], top, end[1]),
            inside(b[3], top, end[1]),
        ];
        let mask = |m: &[u64; 4]| (0..4).fold(0_usize, |all, k| all | ((m[k] >> l & 1) as usize) << k);
        let (front, doubt) = (mask(&fronts), mask(&doubts));
        let mut away = !(front | doubt) & 15;
        if first[l] != 0 {
            // Faces 0 and `first` were exchanged.
            let (bit, other) = (away & 1, away >> first[l] & 1);
            away = away & !(1 | 1 << first[l]) | other | bit << first[l];
        }
        let v = &values[l];
        let mut span = [[f32::INFINITY, f32::NEG_INFINITY]; N];
        let mut field = [[0.0; 4]; N];
        let mut finite = true;
        for n in 0..N {
            for corner in v {
                finite &= corner[n].is_finite();
                span[n] = [span[n][0].min(corner[n]), span[n][1].max(corner[n])];
            }
            let rise = [1, 2, 3].map(|k| f64::from(v[k][n]) - f64::from(v[0][n]));
            let g = [0, 1, 2].map(|x| (0..3).map(|k| rise[k] * normals[k][x][l]).sum::<f64>() as f32);
            field[n] = [v[0][n], g[0], g[1], g[2]];
        }
        let (mut look, lines) = scene.look(&span, finite);
        if det[l] == 0.0 || !det[l].is_finite() {
            look = Look::Empty;
        } else if flat >> l & 1 == 1 {
            // What is not seen is checked in f64, too.
            look = if look == Look::Seen { Look::Flat } else { look };
        }
        let order = FRONTS_FIRST[front];
        let ratio = lens.reference * kappa[l];
        let ratio = if lens.meet { ratio * ratio } else { 1.0 };
        records.push(Record {
            plane: planes.map(|p| order.map(|k| p[k as usize][l] as f32)),
            at: [at[0][l].round() - f64::from(left), at[1][l].round() - f64::from(top)].map(|v| v as f32),
            rest: [at[0][l] - at[0][l].round(), at[1][l] - at[1][l].round()].map(|v| v as f32),
            kappa: kappa[l] as f32,
            key: [lens.key(depth[l]) as f32, ratio as f32, (1.0 / ratio) as f32],
            field,
            span,
            pixels: pixels.map(|p| p as u8),
            fronts: front.count_ones() as u8,
            away: away as u8,
            look,
            coarse: match scene.blend {
                Blend::Composite => {
                    f64::from(scene.steepest) * extents[l] > DENSE
                        && f64::from(scene.exact.opacity.densest(lines)) * extents[l] > DENSE
                }
                Blend::Maximum => {
                    span.iter().any(|s| s[0] < s[1] && (s[0] < -WIDE || s[1] > WIDE || s[1] - s[0] > STEEP))
                }
            },
            lines,
            cell,
        });
    }
}
