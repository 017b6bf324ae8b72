//! Which cells boundary faces put before which: for each pixel its crossings of the boundary, in sequence.
//!
//! A cell through which a ray leaves the mesh comes before the one through which that ray enters again (Silva, Mitchell & Williams 1998,
//! XMPVO). Only rays through pixels are asked, as an A-buffer has them (Cook, Max, Silva & Williams 2004): others are not drawn.

use super::crossings::{Crossings, PIXELS, pixel_at};
use super::screen::{self, Dealt, Lens, PixelBox, TILE};
use crate::geometry::TetMesh;
use crate::geometry::boundary::BoundaryFace;
use fearless_simd::Level;
use rayon::prelude::*;

/// Two cells with nothing of the mesh between them, on the rays of so many pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Gap {
    /// The nearer cell.
    pub(super) from: u32,
    /// The farther one.
    pub(super) to: u32,
    pub(super) pixels: u32,
    /// The order does not keep it.
    pub(super) is_cut: bool,
}

/// Where the rays of a view cross the boundary of a mesh.
pub(super) struct Rays<'a> {
    geometry: &'a TetMesh,
    lens: &'a Lens,
    level: Level,
    places: Vec<[f32; 2]>,
    boxes: Vec<PixelBox>,
    dealt: Dealt,
}

impl<'a> Rays<'a> {
    pub(super) fn new(geometry: &'a TetMesh, lens: &'a Lens) -> Self {
        let (mut places, mut boxes) = (vec![], vec![]);
        screen::project(lens, &geometry.points, &mut places);
        let (points, faces) = (&geometry.points, &geometry.boundary.faces);
        screen::all_bounds(lens, points, &places, faces.len(), |i| faces[i].points, &mut boxes);
        let dealt = Dealt::new(lens, &boxes);
        Rays { geometry, lens, level: Level::new(), places, boxes, dealt }
    }

    /// The first pixel of a tile.
    fn corner(&self, tile: usize) -> [u32; 2] {
        let columns = self.lens.tiles()[0];
        [tile % columns, tile / columns].map(|n| n as u32 * TILE)
    }

    /// The number of a pixel of the image, row by row.
    fn pixel(&self, [left, top]: [u32; 2], place: usize) -> u32 {
        let [i, j] = pixel_at(place);
        (top + j) * self.lens.size[0] + left + i
    }

    /// Calls `tell` for each tile with its crossings, its first pixel and what it gathers.
    fn by_tile<T: Default + Send>(&self, tell: impl Fn(&Crossings, [u32; 2], &mut T) + Sync) -> Vec<T> {
        let faces = &self.geometry.boundary.faces;
        let all = (0..self.lens.tiles()[1]).into_par_iter().with_max_len(1);
        let of_tile = |crossings: &mut Crossings, tile: usize| {
            let mut gathered = T::default();
            if self.dealt.len(tile) > 0 {
                let dealt = self.dealt.of(tile).map(|f| (&faces[f as usize], self.boxes[f as usize]));
                crossings.find(self.level, self.geometry, self.lens, dealt, self.corner(tile));
                tell(crossings, self.corner(tile), &mut gathered);
            }
            gathered
        };
        all.map_init(Crossings::default, of_tile).collect()
    }

    /// All gaps, ascending; and the pixels, ascending, whose rays are in the mesh more than once at a time: their cells have no order.
    pub(super) fn gaps(&self) -> (Vec<Gap>, Vec<u32>) {
        let tiles = self.by_tile(|crossings, corner, (gaps, pixels): &mut (Vec<(u32, u32)>, Vec<u32>)| {
            crossings.for_each_gap(|_, from, to| gaps.push((from, to)));
            gaps.sort_unstable();
            pixels.extend((0..PIXELS).filter(|&p| !crossings.alternate(p)).map(|p| self.pixel(corner, p)));
        });
        let mut pairs: Vec<Gap> = vec![];
        let mut overlapping = vec![];
        for (gaps, pixels) in tiles {
            let gap =
                |same: &[(u32, u32)]| Gap { from: same[0].0, to: same[0].1, pixels: same.len() as u32, is_cut: false };
            pairs.extend(gaps.chunk_by(|a, b| a == b).map(gap));
            overlapping.extend(pixels);
        }
        pairs.par_sort_unstable();
        pairs.dedup_by(|next, kept| {
            let same = (next.from, next.to) == (kept.from, kept.to);
            if same {
                kept.pixels += next.pixels;
            }
            same
        });
        overlapping.sort_unstable();
        (pairs, overlapping)
    }

    /// The pixels whose rays pass a gap that `gaps`, ascending, has cut.
    pub(super) fn pixels_of_cut(&self, gaps: &[Gap]) -> Vec<u32> {
        let is_cut = |from: u32, to: u32| {
            gaps.binary_search_by_key(&(from, to), |g| (g.from, g.to)).is_ok_and(|g| gaps[g].is_cut)
        };
        let tiles = self.by_tile(|crossings, corner, pixels: &mut Vec<u32>| {
            crossings.for_each_gap(|p, from, to| {
                if is_cut(from, to) {
                    pixels.push(self.pixel(corner, p));
                }
            });
        });
        tiles.concat()
    }

    /// The pixels whose rays pass a face with these corners.
    pub(super) fn pixels_of_face(&self, points: [u32; 3]) -> Vec<u32> {
        let b = screen::bounds(self.lens, &self.geometry.points, &self.places, points);
        let face = BoundaryFace { points, cell: 0 };
        let mut crossings = Crossings::default();
        let mut pixels = vec![];
        if b[0] > b[1] {
            return pixels;
        }
        let [left, right, top, bottom] = b.map(|n| u32::from(n) / TILE);
        for (i, j) in (top..=bottom).flat_map(|j| (left..=right).map(move |i| (i, j))) {
            let corner = [i * TILE, j * TILE];
            crossings.find(self.level, self.geometry, self.lens, std::iter::once((&face, b)), corner);
            pixels.extend((0..PIXELS).filter(|&p| crossings.any(p)).map(|p| self.pixel(corner, p)));
        }
        pixels
    }
}
