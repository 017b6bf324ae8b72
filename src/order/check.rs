//! Counts where an order is wrong, in f64 and pixel by pixel; by means of its own.

use super::PART;
use super::screen::{self, Dealt, Lens, TILE};
use crate::geometry::TetMesh;
use crate::view::View;
use glam::DVec3;
use rayon::prelude::*;

/// Of two cells on a ray, how much of it they must share to overlap, and how long a ray's way through one must be to be seen: of the
/// diagonal of the mesh's bounds.
const TOLERANCE: f64 = 1e-9;

/// Not in the order.
const NONE: u32 = u32::MAX;

/// What is wrong with an order.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Verdict {
    /// Pairs of cells on the ray of one pixel, over all pixels.
    pub pairs: u64,
    /// Those of which the farther cell is drawn later.
    pub inversions: u64,
    /// Those that are on the same part of the ray: no order is right.
    pub overlaps: u64,
    /// Pixels that see any cell.
    pub pixels: u64,
    /// Those of inversions, row by row and ascending.
    pub wrong: Vec<u32>,
}

impl Verdict {
    fn plus(mut self, mut other: Self) -> Self {
        self.wrong.append(&mut other.wrong);
        Verdict {
            pairs: self.pairs + other.pairs,
            inversions: self.inversions + other.inversions,
            overlaps: self.overlaps + other.overlaps,
            pixels: self.pixels + other.pixels,
            wrong: self.wrong,
        }
    }
}

/// Compares `entries`, cells from back to front as [`super::VisibilityOrder`] has them, with what the rays of the view's pixels meet,
/// on the current rayon pool.
pub fn check(geometry: &TetMesh, view: &View, entries: &[u32]) -> Verdict {
    let Some(lens) = Lens::new(geometry, view) else { return Verdict::default() };
    let mut rank = vec![NONE; geometry.cells.len()];
    for (&entry, r) in entries.iter().zip(0..) {
        rank[(entry & ((1 << PART) - 1)) as usize] = r;
    }
    let (mut places, mut boxes) = (vec![], vec![]);
    screen::project(&lens, &geometry.points, &mut places);
    let cells = &geometry.cells;
    screen::all_bounds(&lens, &geometry.points, &places, cells.len(), |i| cells[i].corners, &mut boxes);
    let dealt = Dealt::new(&lens, &boxes);
    let [low, high] = geometry.boundary.bounds();
    let tolerance = TOLERANCE * (high - low).length();
    let [columns, tiles] = lens.tiles();
    let of_tile = |tile: usize| {
        let (left, top) = ((tile % columns) as u32 * TILE, (tile / columns) as u32 * TILE);
        let own: Vec<u32> = dealt.of(tile).filter(|&c| rank[c as usize] != NONE).collect();
        let mut verdict = Verdict::default();
        let mut met: Vec<([f64; 2], u32)> = vec![];
        for j in top..lens.size[1].min(top + TILE) {
            for i in left..lens.size[0].min(left + TILE) {
                met.clear();
                let ray = view.ray_through(
                    f64::from(i) + 0.5 + view.pixel_offset().x,
                    f64::from(j) + 0.5 - view.pixel_offset().y,
                );
                let eye = (ray.origin - geometry.centre) * geometry.scale;
                // From where the ray is nearest to the middle of the mesh: as accurate as the mesh is small.
                let ahead = -eye.dot(ray.direction);
                let first = if view.eye().is_some() { -ahead } else { f64::NEG_INFINITY };
                let origin = eye + ray.direction * ahead;
                for &c in &own {
                    let b = boxes[c as usize].map(u32::from);
                    if (b[0]..=b[1]).contains(&i) && (b[2]..=b[3]).contains(&j) {
                        let p = cells[c as usize].corners.map(|p| geometry.points[p as usize]);
                        let [enter, leave] = interval(p, origin, ray.direction, first);
                        if leave - enter > tolerance {
                            met.push(([enter, leave], rank[c as usize]));
                        }
                    }
                }
                let before = verdict.inversions;
                for (k, &(a, ra)) in met.iter().enumerate() {
                    for &(b, rb) in &met[..k] {
                        if a[1].min(b[1]) - a[0].max(b[0]) > tolerance {
                            verdict.overlaps += 1;
                        } else if (a[0] < b[0]) == (ra < rb) {
                            verdict.inversions += 1;
                        }
                    }
                }
                verdict.pairs += (met.len() * met.len().saturating_sub(1) / 2) as u64;
                verdict.pixels += u64::from(!met.is_empty());
                if verdict.inversions > before {
                    verdict.wrong.push(j * lens.size[0] + i);
                }
            }
        }
        verdict
    };
    let mut all = (0..tiles).into_par_iter().with_max_len(1).map(of_tile).reduce(Verdict::default, Verdict::plus);
    all.wrong.sort_unstable();
    all
}

/// Between which t from `first` on a ray is in a tetrahedron (Cyrus & Beck 1978); the second is less than the first if it is not.
fn interval(p: [DVec3; 4], origin: DVec3, direction: DVec3, first: f64) -> [f64; 2] {
    let [mut enter, mut leave] = [first, f64::INFINITY];
    for k in 0..4 {
        let [a, b, c, apex] = [p[(k + 1) % 4], p[(k + 2) % 4], p[(k + 3) % 4], p[k]];
        let normal = (b - a).cross(c - a);
        let side = normal.dot(apex - a);
        let (height, slope) = (normal.dot(origin - a), normal.dot(direction));
        let (height, slope) = if side < 0.0 { (-height, -slope) } else { (height, slope) };
        if side == 0.0 {
            return [0.0, 0.0];
        } else if slope > 0.0 {
            enter = enter.max(-height / slope);
        } else if slope < 0.0 {
            leave = leave.min(-height / slope);
        } else if height < 0.0 {
            return [0.0, 0.0];
        }
    }
    [enter, leave]
}
