//! The walk on the CPU: the twin of the GPU's, for machines without one.
//!
//! Positions are f64, so that thin layers and great distances cost no accuracy; segments are integrated in f32.

mod segments;

use crate::cell::{Face, RayFrame};
use crate::geometry::boundary::{Beam, Candidate};
use crate::geometry::{TetMesh, Values};
use crate::image::Image;
use crate::integral::second::Second;
use crate::integral::{Integral, Light};
use crate::memory::prefetch;
use crate::mesh::faces::BOUNDARY;
use crate::real::Real;
use crate::view::{Blend, View};
use glam::DVec2;
use rayon::prelude::*;
use segments::{One, Segments, Two};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};

/// Width and height of the square of pixels whose rays share their search for entries.
const TILE: u32 = 8;

/// Transmittance below which a ray ends: what lies behind adds less than this times its colour to any channel. Direct
/// emission has no such bound, and goes on as long as f32 can tell.
pub const fn least_transmittance(direct: bool) -> f32 {
    if direct { f32::MIN_POSITIVE } else { 1e-6 }
}

/// A ray that passes a boundary face this close to its edge (as a barycentric weight) is traced again beside it: where
/// boundary faces only meet without sharing their corners, rounding could let it slip through.
const TOO_CLOSE: f64 = 1e-12;

/// How far rays that are traced again are moved, in normalised units.
const PERTURBATION: f64 = 1e-9;

/// What a frame took.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Tetrahedra visited, over all rays.
    pub steps: u64,
    /// Rays that were traced again beside an edge.
    pub retraced: u64,
    /// Rays that a device left to the CPU.
    pub unfinished: u64,
    /// Panels that segments of two variables, or with light, were summed up in.
    pub panels: u64,
}

/// Draws a frame on the current rayon pool. `pixel` turns the largest values along a ray into a premultiplied colour
/// for [`Blend::Maximum`]; `progress` is told the share that is done, and may say that no more is wanted: the rest
/// stays empty.
pub fn render<const N: usize>(
    geometry: &TetMesh,
    values: &Values<N>,
    integral: Integral,
    pixel: &(dyn Fn(&[f32; N]) -> [f32; 4] + Sync),
    view: &View,
    progress: &(dyn Fn(f64) -> ControlFlow<()> + Sync),
) -> (Image, Counts) {
    render_with(geometry, values, &|| One::new(integral), pixel, view, progress)
}

/// Draws a frame whose segments are of two variables, or with light: `values` are s and g, or those and the gradient;
/// `seen` has a bit for each cell that may be seen.
pub(crate) fn render_two<const N: usize>(
    geometry: &TetMesh,
    values: &Values<N>,
    second: &Second,
    seen: Option<&[u64]>,
    view: &View,
    progress: &(dyn Fn(f64) -> ControlFlow<()> + Sync),
) -> (Image, Counts) {
    render_with(geometry, values, &|| Two::new(second, seen), &|_| [0.0; 4], view, progress)
}

fn render_with<const N: usize, S: Segments<N>>(
    geometry: &TetMesh,
    values: &Values<N>,
    segments: &(impl Fn() -> S + Sync),
    pixel: &(dyn Fn(&[S::Value; N]) -> [f32; 4] + Sync),
    view: &View,
    progress: &(dyn Fn(f64) -> ControlFlow<()> + Sync),
) -> (Image, Counts) {
    let mut image = Image::new(view.size());
    let [w, h] = view.size();
    let (done, bands) = (AtomicUsize::new(0), h.div_ceil(TILE) as usize);
    let stopped = AtomicBool::new(false);
    let counts = image
        .pixels
        .par_chunks_mut((w * TILE) as usize)
        .enumerate()
        .map(|(band, rows)| {
            let mut tracer = Tracer::new(geometry, values, segments(), view);
            if stopped.load(Relaxed) {
                return tracer.counts;
            }
            for left in (0..w).step_by(TILE as usize) {
                tracer.draw(left, band as u32 * TILE, rows, pixel);
            }
            if progress((done.fetch_add(1, Relaxed) + 1) as f64 / bands as f64).is_break() {
                stopped.store(true, Relaxed);
            }
            Counts { panels: tracer.segments.panels(), ..tracer.counts }
        })
        .reduce(Counts::default, |a, b| Counts {
            steps: a.steps + b.steps,
            retraced: a.retraced + b.retraced,
            unfinished: 0,
            panels: a.panels + b.panels,
        });
    (image, counts)
}

/// Draws only the pixels with these indices.
pub(crate) fn render_pixels<const N: usize>(
    geometry: &TetMesh,
    values: &Values<N>,
    integral: Integral,
    pixel: &(dyn Fn(&[f32; N]) -> [f32; 4] + Sync),
    view: &View,
    indices: &[usize],
) -> Vec<[f32; 4]> {
    pixels_with(geometry, values, &|| One::new(integral), pixel, view, indices)
}

/// As [`render_pixels`], of segments of two variables, or with light.
pub(crate) fn render_pixels_of_two<const N: usize>(
    geometry: &TetMesh,
    values: &Values<N>,
    second: &Second,
    seen: Option<&[u64]>,
    view: &View,
    indices: &[usize],
) -> Vec<[f32; 4]> {
    pixels_with(geometry, values, &|| Two::new(second, seen), &|_| [0.0; 4], view, indices)
}

fn pixels_with<const N: usize, S: Segments<N>>(
    geometry: &TetMesh,
    values: &Values<N>,
    segments: &(impl Fn() -> S + Sync),
    pixel: &(dyn Fn(&[S::Value; N]) -> [f32; 4] + Sync),
    view: &View,
    indices: &[usize],
) -> Vec<[f32; 4]> {
    let w = view.size()[0];
    let new = || Tracer::new(geometry, values, segments(), view);
    let draw = |tracer: &mut Tracer<N, S>, &index: &usize| {
        let (i, j) = ((index % w as usize) as u32, (index / w as usize) as u32);
        tracer.find_candidates([i, j], [i + 1, j + 1]);
        tracer.pixel(i, j, pixel)
    };
    indices.par_iter().map_init(new, draw).collect()
}

/// A place where a ray enters the mesh.
struct Entry {
    t: f64,
    points: [u32; 3],
    cell: u32,
    face: Face,
}

/// What a ray has gathered.
struct Gathered<V, const N: usize> {
    light: Light<f32>,
    largest: Option<[V; N]>,
}

/// Traces rays, one after another.
struct Tracer<'a, const N: usize, S> {
    geometry: &'a TetMesh,
    values: &'a Values<N>,
    segments: S,
    view: &'a View,
    both_ways: bool,
    candidates: Vec<Candidate>,
    entries: Vec<Entry>,
    counts: Counts,
}

impl<'a, const N: usize, S: Segments<N>> Tracer<'a, N, S> {
    fn new(geometry: &'a TetMesh, values: &'a Values<N>, segments: S, view: &'a View) -> Self {
        let [low, high] = geometry.boundary.bounds();
        let both_ways = view.eye().is_some_and(|eye| {
            let eye = (eye - geometry.centre) * geometry.scale;
            eye.cmpge(low).all() && eye.cmple(high).all()
        });
        Tracer {
            geometry,
            values,
            segments,
            view,
            both_ways,
            candidates: vec![],
            entries: vec![],
            counts: Counts::default(),
        }
    }

    /// As [`Self::tile`], in the widest instructions that the processor has; their results are the same.
    fn draw(
        &mut self,
        left: u32,
        top: u32,
        rows: &mut [[f32; 4]],
        pixel: &(dyn Fn(&[S::Value; N]) -> [f32; 4] + Sync),
    ) {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            #[target_feature(enable = "avx2")]
            fn wide<const N: usize, S: Segments<N>>(
                tracer: &mut Tracer<N, S>,
                left: u32,
                top: u32,
                rows: &mut [[f32; 4]],
                pixel: &(dyn Fn(&[S::Value; N]) -> [f32; 4] + Sync),
            ) {
                tracer.tile(left, top, rows, pixel);
            }
            #[allow(unsafe_code, reason = "vector instructions that the processor was just asked about")]
            // SAFETY: the processor has AVX2.
            return unsafe { wide(self, left, top, rows, pixel) };
        }
        self.tile(left, top, rows, pixel);
    }

    /// Draws the tile whose upper left pixel is (`left`, `top`) into `rows`, which start with row `top` of the image.
    #[inline(always)]
    fn tile(
        &mut self,
        left: u32,
        top: u32,
        rows: &mut [[f32; 4]],
        pixel: &(dyn Fn(&[S::Value; N]) -> [f32; 4] + Sync),
    ) {
        let w = self.view.size()[0];
        let (right, bottom) = ((left + TILE).min(w), top + (rows.len() as u32 / w).min(TILE));
        self.find_candidates([left, top], [right, bottom]);
        if self.candidates.is_empty() {
            return;
        }
        for j in top..bottom {
            for i in left..right {
                rows[((j - top) * w + i) as usize] = self.pixel(i, j, pixel);
            }
        }
    }

    /// Draws one pixel, whose candidates were found.
    #[inline(always)]
    fn pixel(&mut self, i: u32, j: u32, pixel: &(dyn Fn(&[S::Value; N]) -> [f32; 4] + Sync)) -> [f32; 4] {
        let gathered = self.trace(i, j);
        match (self.view.blend(), gathered.largest) {
            (Blend::Composite, _) => {
                let Light { color: [r, g, b], transmittance } = gathered.light;
                [r, g, b, 1.0 - transmittance]
            }
            (Blend::Maximum, Some(values)) => pixel(&values),
            (Blend::Maximum, None) => [0.0; 4],
        }
    }

    /// Collects the boundary faces that rays of the pixels `low..high` may enter through.
    fn find_candidates(&mut self, low: [u32; 2], high: [u32; 2]) {
        let TetMesh { centre, scale, points, boundary, .. } = self.geometry;
        let ([l, t], [r, b]) = (low.map(f64::from), high.map(f64::from));
        // Rays pass through pixel centres, but an offset may move them.
        let margin = 0.5 + self.view.pixel_offset().abs().max_element();
        let rays = [(l, t), (r, t), (r, b), (l, b)].map(|(x, y)| {
            let outward = |v: f64, low: f64| if v == low { v - margin } else { v + margin };
            let ray = self.view.ray_through(outward(x, l), outward(y, t));
            ((ray.origin - centre) * scale, ray.direction)
        });
        self.candidates.clear();
        let beam = Beam::new(rays, self.both_ways);
        let everywhere = [DVec2::NEG_INFINITY, DVec2::INFINITY];
        boundary.for_each_in(&beam, |face| {
            let corners = boundary.faces[face].points.map(|p| self.view.pixel(points[p as usize] / scale + centre));
            let pixels = match corners {
                [Some(a), Some(b), Some(c)] => [a.min(b).min(c) - margin, a.max(b).max(c) + margin],
                _ => everywhere,
            };
            self.candidates.push(Candidate { face, pixels });
        });
    }

    /// Traces the ray of pixel (`i`, `j`).
    #[inline(always)]
    fn trace(&mut self, i: u32, j: u32) -> Gathered<S::Value, N> {
        let ray = self.view.ray(i, j);
        let TetMesh { centre, scale, .. } = *self.geometry;
        let origin = (ray.origin - centre) * scale;
        // From the point of the ray that is nearest to the middle of the mesh, so that no distance is great.
        let start = -origin.dot(ray.direction);
        let (t_min, t_max) = (ray.t_min * scale - start, ray.t_max * scale - start);
        let straight = RayFrame::new(origin + ray.direction * start, ray.direction);
        let none = || Gathered { light: Light::none(), largest: None };
        if t_min.max(-4.0) >= t_max.min(4.0) {
            return none();
        }
        let pixel = DVec2::new(f64::from(i) + 0.5, f64::from(j) + 0.5);
        let mut frame = straight;
        for attempt in 1..=3 {
            let mut gathered = none();
            if self.walk(&frame, pixel, [t_min, t_max], attempt == 3, &mut gathered) {
                return gathered;
            }
            self.counts.retraced += u64::from(attempt == 1);
            frame = straight.shifted(PERTURBATION * f64::from(attempt), PERTURBATION * 0.618 * f64::from(attempt));
        }
        none()
    }

    /// Follows one ray; false if it passed too close to an edge of the boundary, unless `accept_grazing`.
    #[inline(always)]
    fn walk(
        &mut self,
        frame: &RayFrame,
        pixel: DVec2,
        [t_min, t_max]: [f64; 2],
        accept_grazing: bool,
        gathered: &mut Gathered<S::Value, N>,
    ) -> bool {
        let (origin, along) = frame.ray();
        self.segments.begin(origin, along);
        if !self.find_entries(frame, pixel) && !accept_grazing {
            return false;
        }
        for e in 0..self.entries.len() {
            if self.entries[e].t >= t_max || self.is_terminated(gathered) {
                break;
            }
            let exit = self.follow(frame, e, [t_min, t_max], gathered);
            if exit.is_some_and(is_close) && !accept_grazing {
                return false;
            }
        }
        self.segments.end(&mut gathered.light);
        true
    }

    /// Collects where the ray enters the mesh, in order; false if any of it is too close to an edge.
    #[inline(always)]
    fn find_entries(&mut self, frame: &RayFrame, pixel: DVec2) -> bool {
        let TetMesh { points, boundary, .. } = self.geometry;
        let mut clear = true;
        self.entries.clear();
        for c in &self.candidates {
            if pixel.cmplt(c.pixels[0]).any() || pixel.cmpgt(c.pixels[1]).any() {
                continue;
            }
            let outer = &boundary.faces[c.face];
            let [a, b, c] = outer.points;
            // Seen along a ray that enters, the face turns clockwise: its mirror image does not.
            let Some(face) = Face::enter([a, c, b].map(|p| frame.project(points[p as usize]))) else { continue };
            let weights = face.weights();
            clear &= !is_close(weights);
            self.entries.push(Entry { t: face.t(&weights), points: [a, c, b], cell: outer.cell, face });
        }
        self.entries.sort_unstable_by(|a, b| a.t.total_cmp(&b.t).then(a.points.cmp(&b.points)));
        clear
    }

    /// Walks from entry `e` until the ray leaves the mesh or ends; the weights at the exit in the first case.
    #[inline(always)]
    fn follow(
        &mut self,
        frame: &RayFrame,
        e: usize,
        [t_min, t_max]: [f64; 2],
        gathered: &mut Gathered<S::Value, N>,
    ) -> Option<[f64; 3]> {
        let TetMesh { points, cells, .. } = self.geometry;
        let Entry { t, points: mut ids, mut cell, mut face } = self.entries[e];
        let (mut t, mut reached, mut weights) = (t, t_min, face.weights());
        let mut front = self.value(cell, &ids, &weights);
        // Values that jump between cells are not those of the cell before, nor are they where that was skipped.
        let own = !matches!(self.values, Values::Point(_));
        let mut skipped = false;
        loop {
            self.counts.steps += 1;
            let c = cells.get(cell as usize)?;
            c.neighbours.iter().for_each(|&n| prefetch(cells, n as usize));
            let apex = c.corners.iter().fold(ids[0] ^ ids[1] ^ ids[2], |x, p| x ^ p);
            let dropped = face.step(frame.project(points[apex as usize]));
            let left_behind = std::mem::replace(&mut ids[dropped], apex);
            let skips = self.segments.skips(cell);
            if !skips && (own || skipped) {
                front = self.value(cell, &ids_before(ids, dropped, left_behind), &weights);
            }
            weights = face.weights();
            let (entered, left) = (t, face.t(&weights));
            let back = if skips { front } else { self.value(cell, &ids, &weights) };
            skipped = skips;
            if left > reached {
                let (from, to) = (entered.max(reached), left.min(t_max));
                if from < to && !skips {
                    let at = |x: f64| {
                        if x == entered {
                            front
                        } else if x == left {
                            back
                        } else {
                            mix(&front, &back, (x - entered) / (left - entered))
                        }
                    };
                    self.gather(at(from), at(to), [from, to], gathered);
                }
                reached = left;
                if reached >= t_max || self.is_terminated(gathered) {
                    return None;
                }
            }
            (t, front) = (left, back);
            let k = c.corners.iter().position(|&p| p == left_behind).unwrap_or(0);
            cell = c.neighbours[k];
            if cell == BOUNDARY {
                return Some(weights);
            }
        }
    }

    /// Whether nothing behind can be seen.
    #[inline(always)]
    fn is_terminated(&self, gathered: &Gathered<S::Value, N>) -> bool {
        gathered.light.transmittance < self.segments.least_transmittance()
    }

    #[inline(always)]
    fn gather(&mut self, front: [S::Value; N], back: [S::Value; N], t: [f64; 2], gathered: &mut Gathered<S::Value, N>) {
        if self.view.blend() == Blend::Composite {
            self.segments.add(&front, &back, t, &mut gathered.light);
        } else if front.iter().chain(&back).all(|v| v.is_finite()) {
            for v in [front, back] {
                if gathered.largest.is_none_or(|l| v[N - 1] > l[N - 1]) {
                    gathered.largest = Some(v);
                }
            }
        }
    }

    /// The field at `weights` on the face `ids` of `cell`.
    #[inline(always)]
    fn value(&self, cell: u32, ids: &[u32; 3], weights: &[f64; 3]) -> [S::Value; N] {
        let corners: [&[f32; N]; 3] = match self.values {
            Values::Cell(v) => return v[cell as usize].map(|v| Real::of(v.into())),
            Values::Point(v) => ids.map(|p| &v[p as usize]),
            Values::Corner(v) => {
                let own = &self.geometry.cells[cell as usize].corners;
                ids.map(|p| &v[cell as usize][own.iter().position(|&c| c == p).unwrap_or(0)])
            }
        };
        std::array::from_fn(|k| Real::of((0..3).map(|i| f64::from(corners[i][k]) * weights[i]).sum::<f64>()))
    }
}

fn is_close(weights: [f64; 3]) -> bool {
    weights.iter().any(|w| *w < TOO_CLOSE)
}

fn ids_before(mut ids: [u32; 3], dropped: usize, left_behind: u32) -> [u32; 3] {
    ids[dropped] = left_behind;
    ids
}

fn mix<R: Real, const N: usize>(a: &[R; N], b: &[R; N], w: f64) -> [R; N] {
    let w = R::of(w);
    std::array::from_fn(|k| a[k] + (b[k] - a[k]) * w)
}
