//! Fine: the pixels of a tile. Blocks of 4 × 4 of them are kept cell by cell, then [found](super::find) inside the cells, checked, and
//! [measured](super::measure).
//!
//! A pixel keeps the key where its last cell ended. The next one must begin there, or a gap must lie between the two where the ray
//! is outside the mesh, by its crossings of the boundary; at the end nothing of the mesh may be left. A pixel of which that is not
//! true is flagged, and drawn again by other means. So the picture does not rest on the order of the cells.

use super::find::Found;
use super::lanes::LANES;
use super::measure::Parts;
use super::second::Kept;
use super::setup::{Look, Record, Records, Scene};
use crate::integral::{Batch, Integral, Light};
use crate::order::crossings::{Crossings, pixel_at, place};
use crate::order::screen::{ASIDE, NEAREST, TILE};
use crate::traverse::cpu::least_transmittance;
use crate::view::{Blend, View};
use fearless_simd::Simd;

pub(super) const PIXELS: usize = (TILE * TILE) as usize;
/// Strips of a tile, of four rows.
pub(super) const STRIPS: usize = TILE as usize / 4;
/// Blocks side by side of a tile, in a strip and in all.
const ACROSS: usize = TILE as usize / 4;
const BLOCKS: usize = PIXELS / LANES;

/// How far from the end of the last cell the next may begin, in keys, of 1 and of the key; and how much of the mesh may be missed
/// in a gap.
pub(super) const SLACK: f32 = 2e-6;

/// After so many fragments it is looked for pixels that are done.
const GLANCE: u64 = 4096;

/// Why a pixel is drawn again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Flaw {
    None,
    /// A cell began before the last one ended.
    Overlap,
    /// A cell began after the last one ended, or none did, but the mesh goes on there.
    Gap,
    /// The ray enters the mesh not as often as it leaves, or a cell was drawn where it is outside.
    Boundary,
    /// Light comes through a cell so dense that f32 does not tell how much, or the largest value is of a cell whose values
    /// f32 does not tell.
    Coarse,
}

/// The pixels of a tile, by their [`place`].
#[derive(Debug)]
pub(super) struct Canvas<const N: usize> {
    /// Red, green, blue, transmittance.
    pub(super) light: Box<[[f32; PIXELS]; 4]>,
    pub(super) largest: Vec<[f32; N]>,
    pub(super) last: Box<[f32; PIXELS]>,
    limits: Box<[[f32; PIXELS]; 2]>,
    flaws: Box<[Flaw; PIXELS]>,
    /// A bit for each column of a strip through which light still comes.
    pub(super) alive: [u32; STRIPS],
    /// The number of fragments at which it is looked again for blocks that are done.
    glance: u64,
    pub(super) corner: [u32; 2],
    /// The length of each pixel's ray for each unit of depth.
    pub(super) stretch: Box<[f32; PIXELS]>,
    eye_inside: bool,
    /// The key of the nearest place that is drawn for sure.
    nearest: f64,
    pub(super) batch: Batch,
    pub(super) found: Found,
    pub(super) parts: Parts,
    pub(super) kept: Kept,
    pub(super) fragments: u64,
}

impl<const N: usize> Canvas<N> {
    pub(super) fn new() -> Self {
        Canvas {
            light: Box::new([[0.0; PIXELS]; 4]),
            largest: vec![[0.0; N]; PIXELS],
            last: Box::new([0.0; PIXELS]),
            limits: Box::new([[0.0; PIXELS]; 2]),
            flaws: Box::new([Flaw::None; PIXELS]),
            alive: [0; STRIPS],
            glance: 0,
            corner: [0; 2],
            stretch: Box::new([0.0; PIXELS]),
            eye_inside: false,
            nearest: f64::NEG_INFINITY,
            batch: Batch::default(),
            found: Found::default(),
            parts: Parts::default(),
            kept: Kept::default(),
            fragments: 0,
        }
    }

    /// Begins the tile whose first pixel is `corner`.
    pub(super) fn clear(&mut self, scene: &Scene<N>, view: &View, crossings: &Crossings, corner: [u32; 2]) {
        for (channel, light) in self.light.iter_mut().zip([0.0, 0.0, 0.0, 1.0]) {
            channel.fill(light);
        }
        if scene.blend == Blend::Maximum {
            self.largest.fill([f32::NEG_INFINITY; N]);
        }
        self.flaws.fill(Flaw::None);
        let lens = scene.lens;
        (self.alive, self.corner, self.eye_inside) = ([u32::MAX; STRIPS], corner, lens.meet);
        self.glance = self.fragments + GLANCE;
        self.nearest = if lens.meet { lens.key(4.0 * NEAREST) } else { f64::NEG_INFINITY };
        let [column, row] = corner.map(f64::from);
        let [c, x, y, xx, yy, xy] = lens.stretch(column + ASIDE.x, row + ASIDE.y).map(|v| v as f32);
        for (at, stretch) in self.stretch.iter_mut().enumerate() {
            let [i, j] = pixel_at(at).map(|v| v as f32);
            *stretch = (c + i * (x + i * xx + j * xy) + j * (y + j * yy)).sqrt();
        }
        self.last.copy_from_slice(crossings.first());
        self.kept.clear(scene, corner);
        if !lens.limited {
            return;
        }
        // Of pixels beyond the image nothing is drawn: what is decided for a block depends on all of its pixels, and must not on
        // tiles before this.
        self.limits.iter_mut().for_each(|limits| limits.fill(0.0));
        for j in 0..TILE.min(lens.size[1] - corner[1]) {
            for i in 0..TILE.min(lens.size[0] - corner[0]) {
                let at = place(i, j);
                let [low, high] = lens.limits(scene.geometry, view, corner[0] + i, corner[1] + j);
                (self.limits[0][at], self.limits[1][at]) = (low as f32, high as f32);
            }
        }
    }

    /// Whether no more light comes through any pixel.
    pub(super) fn is_done(&self) -> bool {
        self.alive == [0; STRIPS]
    }

    /// Whether light still comes through this pixel or others of its column in the strip.
    fn lives(&self, at: usize) -> bool {
        let [column, row] = pixel_at(at);
        self.alive[row as usize / 4] >> column & 1 == 1
    }

    /// Draws the cell of record `i`, or keeps its blocks until there are enough to [flush](Self::flush).
    #[inline(always)]
    pub(super) fn draw<S: Simd>(
        &mut self,
        simd: S,
        scene: &Scene<N>,
        integral: &Integral,
        crossings: &Crossings,
        records: &Records<N>,
        i: usize,
    ) {
        let r = &records.all[i];
        match r.look {
            Look::Seen | Look::Unseen => {
                if !self.found.has_room(r) {
                    self.flush(simd, scene, integral, crossings, records);
                }
                self.found.take(records, i);
            }
            Look::Flat => {
                self.flush(simd, scene, integral, crossings, records);
                self.draw_flat(scene, integral, crossings, r);
            }
            Look::Empty => {}
        }
    }

    /// Draws the blocks that were kept. One pass after the other goes through all of them: each is a short chain of operations, so that
    /// several blocks are under way at a time.
    #[inline(always)]
    pub(super) fn flush<S: Simd>(
        &mut self,
        simd: S,
        scene: &Scene<N>,
        integral: &Integral,
        crossings: &Crossings,
        records: &Records<N>,
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                self.find(simd, crossings, records);
                if scene.lens.limited {
                    self.found.limit(simd, &self.limits, records);
                }
                self.measure(simd, scene, integral, records);
            },
        );
        self.found.clear();
        if self.fragments >= self.glance {
            self.rest(least_transmittance(integral.exact.direct), scene.blend);
        }
    }

    /// Flags pixels of the `i`-th block kept through which too much light comes after a cell whose numbers f32 does not tell.
    #[cold]
    pub(super) fn doubt(&mut self, i: usize, dark: f32) {
        for l in self.found.pixels(i) {
            self.doubt_pixel(i, l, dark);
        }
    }

    /// As [`Self::doubt`], of pixel `l` of the block.
    pub(super) fn doubt_pixel(&mut self, i: usize, l: usize, dark: f32) {
        let at = self.found.place(i) + l;
        if self.flaws[at] == Flaw::None && self.light[3][at] > dark {
            self.flaws[at] = Flaw::Coarse;
        }
    }

    /// Forgets columns of strips of which no pixel lets light through.
    #[cold]
    fn rest(&mut self, least: f32, blend: Blend) {
        self.glance = self.fragments + GLANCE;
        if blend == Blend::Maximum {
            return;
        }
        let (columns, _) = self.light[3].as_chunks::<4>();
        for (strip, alive) in columns.chunks(TILE as usize).zip(&mut self.alive) {
            for (k, column) in strip.iter().enumerate() {
                let most = column.iter().fold(0.0, |most: f32, t| most.max(*t));
                *alive &= !(u32::from(most < least) << k);
            }
        }
    }

    /// Adds one segment to one pixel.
    pub(super) fn gather(
        &mut self,
        blend: Blend,
        integral: &Integral,
        at: usize,
        front: &[f32; N],
        back: &[f32; N],
        length: f32,
    ) {
        if blend == Blend::Maximum {
            for v in [front, back] {
                if v[N - 1] > self.largest[at][N - 1] {
                    self.largest[at] = *v;
                }
            }
            return;
        }
        let [r, g, b, t] = self.light_at(at);
        let mut light = Light { color: [r, g, b], transmittance: t };
        match integral.table {
            None => {
                self.batch.add(integral.exact, front, back, length, &mut light);
                self.batch.flush(integral.exact.direct, &mut light);
            }
            Some(table) => table.add_components(integral.exact, front, back, length, &mut light),
        }
        let [r, g, b] = light.color;
        let all = [r, g, b, light.transmittance];
        self.light.iter_mut().zip(all).for_each(|(channel, v)| channel[at] = v);
    }

    /// Red, green, blue and transmittance of a pixel.
    fn light_at(&self, at: usize) -> [f32; 4] {
        self.light.each_ref().map(|channel| channel[at])
    }

    /// Draws a cell whose thickness f32 cannot tell, pixel by pixel in f64.
    #[cold]
    #[inline(never)]
    fn draw_flat(&mut self, scene: &Scene<N>, integral: &Integral, crossings: &Crossings, r: &Record<N>) {
        let Scene { geometry, lens, .. } = scene;
        let corners = geometry.cells[r.cell as usize].corners;
        let values = scene.corner_values(r.cell, corners);
        let cell = super::flat::Cell::new(lens, corners.map(|p| geometry.points[p as usize]));
        let [x0, x1, y0, y1] = r.pixels.map(u32::from);
        for j in y0..=y1 {
            for i in x0..=x1 {
                let at = place(i, j);
                if !self.lives(at) {
                    continue;
                }
                let (column, row) = (f64::from(self.corner[0] + i) + ASIDE.x, f64::from(self.corner[1] + j) + ASIDE.y);
                let Some([mut enter, mut leave]) = cell.depths(column, row) else { continue };
                let key = |w: f64| lens.key(w) as f32;
                let (key_in, key_out) = (key(enter), key(leave));
                let last = &mut self.last[at];
                let from = std::mem::replace(last, last.max(key_out));
                let apart = (key_in - from).abs();
                if apart.is_nan() || apart > SLACK * (1.0 + key_in.abs()) {
                    self.check_gap(crossings, at, from, key_in);
                }
                if lens.limited {
                    enter = enter.max(lens.depth(f64::from(self.limits[0][at])));
                    leave = leave.min(lens.depth(f64::from(self.limits[1][at])));
                }
                if enter >= leave {
                    continue;
                }
                let value = |w: f64| {
                    let b = cell.weights(column, row, w);
                    std::array::from_fn(|n| {
                        let v: f64 = (0..4).map(|k| b[k] * f64::from(values[k][n])).sum();
                        (v as f32).max(r.span[n][0]).min(r.span[n][1])
                    })
                };
                let length = (leave - enter) * lens.length(column, row);
                if let Some(two) = &integral.second {
                    let ends = [value(enter), value(leave)].map(|v| v.map(f64::from));
                    self.gather_two(scene, two, at, ends, [enter, length]);
                } else {
                    self.gather(scene.blend, integral, at, &value(enter), &value(leave), length as f32);
                }
                self.fragments += 1;
                let is_doubtful = scene.blend == Blend::Maximum && self.light_at(at)[3] > r.dark;
                if is_doubtful && self.flaws[at] == Flaw::None {
                    self.flaws[at] = Flaw::Coarse;
                }
            }
        }
        if self.fragments >= self.glance {
            self.rest(least_transmittance(integral.exact.direct), scene.blend);
        }
    }

    /// [`Self::check_gap`] for some pixels of a block.
    #[cold]
    #[inline(never)]
    pub(super) fn check_gaps(
        &mut self,
        crossings: &Crossings,
        at: usize,
        lanes: u64,
        from: [f32; LANES],
        to: [f32; LANES],
    ) {
        (0..LANES).filter(|l| lanes >> l & 1 == 1).for_each(|l| self.check_gap(crossings, at + l, from[l], to[l]));
    }

    /// Flags a pixel unless the mesh is absent between two keys.
    #[cold]
    #[inline(never)]
    fn check_gap(&mut self, crossings: &Crossings, at: usize, from: f32, to: f32) {
        if self.flaws[at] != Flaw::None {
            return;
        }
        let slack = SLACK * (1.0 + to.abs());
        if to < from - slack {
            self.flaws[at] = Flaw::Overlap;
            return;
        }
        // A gap begins where the ray leaves the mesh, and ends where it enters.
        let held = |key: f32| {
            let slack = SLACK * (1.0 + key.abs());
            crossings.holds(at, f64::from(key), 2.0 * f64::from(slack))
        };
        let held = held(to) && (from == f32::NEG_INFINITY || held(from));
        // Nothing is drawn that is nearer to the eye.
        let from = f64::from(from).max(self.nearest);
        self.flaws[at] = match crossings.between(at, from, f64::from(to), self.eye_inside) {
            Some(missed) if missed > 2.0 * f64::from(slack) => Flaw::Gap,
            Some(_) if held => Flaw::None,
            _ => Flaw::Boundary,
        };
    }

    /// Checks what is left of the mesh behind the last cells, and writes the tile's pixels to `rows`. Returns how many rays meet
    /// the mesh. Pixels that must be drawn again go to `flawed`, with their column and row.
    pub(super) fn finish(
        &mut self,
        scene: &Scene<N>,
        integral: &Integral,
        crossings: &Crossings,
        rows: &mut [&mut [[f32; 4]]],
        color: &dyn Fn(&[f32; N]) -> [f32; 4],
        mut flawed: impl FnMut(u32, u32, Flaw),
    ) -> u64 {
        let least = match scene.blend {
            Blend::Composite => least_transmittance(integral.exact.direct),
            Blend::Maximum => f32::NEG_INFINITY,
        };
        let mut covered = 0;
        for block in 0..BLOCKS {
            let (column, row) = (block % ACROSS * 4, block / ACROSS * 4);
            let doubtful = self.is_doubtful(block, crossings, least);
            for (j, row) in rows.iter_mut().enumerate().skip(row).take(4) {
                for (i, pixel) in row.iter_mut().enumerate().skip(column).take(4) {
                    let at = place(i as u32, j as u32);
                    covered += u64::from(crossings.last()[at] > f32::NEG_INFINITY);
                    if doubtful {
                        self.check_end(crossings, at, least);
                        if self.flaws[at] != Flaw::None {
                            flawed(i as u32, j as u32, self.flaws[at]);
                        }
                    }
                    *pixel = match scene.blend {
                        Blend::Composite => {
                            let [r, g, b, t] = self.light_at(at);
                            [r, g, b, 1.0 - t]
                        }
                        Blend::Maximum if self.largest[at][N - 1] == f32::NEG_INFINITY => [0.0; 4],
                        Blend::Maximum => color(&self.largest[at]),
                    };
                }
            }
        }
        covered
    }

    /// Whether a pixel of a block is flawed, or may be at its end.
    fn is_doubtful(&self, block: usize, crossings: &Crossings, least: f32) -> bool {
        let range = LANES * block..LANES * (block + 1);
        let (ends, light) = (&crossings.last()[range.clone()], &self.light[3][range.clone()]);
        let (last, flaws) = (&self.last[range.clone()], &self.flaws[range]);
        let mut doubtful = false;
        for l in 0..LANES {
            let [missed, beyond] = end(last[l], ends[l]);
            doubtful |= missed & (light[l] >= least) | beyond | (flaws[l] != Flaw::None);
        }
        doubtful
    }

    /// Checks what is left of the mesh behind the last cell of a pixel.
    fn check_end(&mut self, crossings: &Crossings, at: usize, least: f32) {
        let (last, place) = (self.last[at], crossings.last()[at]);
        let [missed, beyond] = end(last, place);
        if missed && self.light_at(at)[3] >= least {
            self.check_gap(crossings, at, last, place);
        }
        if beyond && self.flaws[at] == Flaw::None {
            self.flaws[at] = Flaw::Boundary;
        }
    }
}

/// A block of these pixels, from place `at` on, which is at most `PIXELS - LANES`.
#[inline(always)]
pub(super) fn window(pixels: &[f32; PIXELS], at: usize) -> &[f32; LANES] {
    pixels[at..].first_chunk().unwrap_or(&[0.0; LANES])
}

/// As [`window`].
#[inline(always)]
pub(super) fn window_mut(pixels: &mut [f32; PIXELS], at: usize) -> &mut [f32; LANES] {
    &mut pixels[at..at + LANES].as_chunks_mut::<LANES>().0[0]
}

/// Whether the mesh goes on behind the end of the last cell, or that lies behind the end of the mesh.
#[inline(always)]
fn end(last: f32, mesh: f32) -> [bool; 2] {
    // Not compared with an end at −∞: that is where no ray meets the mesh.
    let slack = if mesh > f32::NEG_INFINITY { SLACK * (1.0 + mesh.abs()) } else { 0.0 };
    [mesh > last + slack, last > mesh + slack]
}
