//! The projection on the CPU: cells are dealt to tiles of the image, ordered tile by tile, and swept from front to back with
//! neighbouring pixels in vector lanes. Nothing is gathered: a cell's numbers are the same for all of its pixels.
//!
//! The stages: [`screen`] projects points and deals cells to tiles, [`setup`] makes records of a tile's cells, [`outline`] finds
//! the pixels that they may cover, [`order`] their sequence, [`fine`] finds and checks their pixels, [`measure`] integrates, line by
//! line of the function or by [`runs`] of lines, functions of two variables and light in [`mod@second`]. Each pixel checks that what it
//! composites is the mesh along its ray, piece after piece; those where it is not are drawn again by the walk. So the
//! picture is the walk's where the order fails.

mod doubles;
mod find;
mod fine;
mod flat;
mod lanes;
mod measure;
mod order;
mod outline;
mod runs;
mod second;
mod setup;
#[cfg(test)]
pub(crate) mod tests;

use crate::geometry::{TetMesh, Values};
use crate::integral::Integral;
use crate::memory::prefetch;
use crate::order::crossings::Crossings;
use crate::order::screen::{self, Dealt, Lens, PixelBox, TILE};
use crate::traverse::cpu;
use crate::view::{Blend, View};
use fearless_simd::{Level, Simd};
use fine::{Canvas, Flaw};
use order::Order;
use rayon::prelude::*;
use runs::Runs;
use setup::{Records, Scene};
use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};

/// The most columns or rows of an image: beyond, single floats do not tell places.
const MOST_PIXELS: u32 = 1 << 15;

/// The most points of a transfer function: 16 bits number the lines between them.
const MOST_KNOTS: usize = u16::MAX as usize;

/// What [`OfTwo::lines`](crate::integral::second::OfTwo::lines) has of a cell of which nothing is seen; of others it has zeros.
pub(crate) const UNSEEN: [u16; 2] = setup::UNSEEN;

/// So many cells before it is drawn, a cell's memory is brought near.
const AHEAD: usize = 2;

/// Of the pixels that the mesh covers, the share from which on the walk draws all of a frame again.
const MOST_REDRAWN: f64 = 0.25;

/// What is kept between frames.
#[derive(Debug)]
pub(crate) struct Sweep {
    level: Level,
    places: Vec<[f32; 2]>,
    /// The pixels of cells, and of boundary faces.
    boxes: [Vec<PixelBox>; 2],
    /// The lines of the function that the values of cells are on; none while they are not known.
    lines: Vec<[u16; 2]>,
    /// Memory of threads: zeros, one for each cell and one more.
    spare: Mutex<Vec<Vec<u32>>>,
    /// Tests have this done to the order of cells.
    #[cfg(test)]
    pub(crate) fault: Option<tests::Fault>,
}

/// What a frame took.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Counts {
    /// Cells dealt to tiles.
    pub(crate) cells: u64,
    /// Segments of rays in cells.
    pub(crate) fragments: u64,
    /// Panels that such segments of two variables, or with light, were summed up in.
    pub(crate) panels: u64,
    /// Pixels drawn again: as cells overlapped, as a part of the mesh was missing, as the boundary said otherwise, as f32
    /// was too coarse.
    pub(crate) redrawn: [u64; 4],
    /// What the walk did.
    pub(crate) walked: cpu::Counts,
    /// Why the walk drew all of the frame, if it did.
    pub(crate) handed_over: Option<&'static str>,
}

/// What a frame is drawn from.
pub(crate) struct Frame<'a, const N: usize> {
    pub(crate) geometry: &'a TetMesh,
    pub(crate) values: &'a Values<N>,
    pub(crate) integral: Integral<'a>,
    pub(crate) view: &'a View,
    /// Turns the largest values along a ray into a premultiplied colour.
    pub(crate) color: &'a (dyn Fn(&[f32; N]) -> [f32; 4] + Sync),
    pub(crate) progress: &'a (dyn Fn(f64) -> ControlFlow<()> + Sync),
}

/// What a thread draws tiles with.
struct Worker<const N: usize> {
    records: Records<N>,
    cells: Vec<u32>,
    faces: Vec<u32>,
    crossings: Crossings,
    order: Order,
    canvas: Canvas<N>,
}

impl<const N: usize> Worker<N> {
    fn new() -> Self {
        Worker {
            records: Records { all: vec![], blocks: vec![], around: vec![] },
            cells: vec![],
            faces: vec![],
            crossings: Crossings::default(),
            order: Order::default(),
            canvas: Canvas::new(),
        }
    }
}

/// The rows of one tile of the image.
struct Target<'a> {
    index: usize,
    rows: Vec<&'a mut [[f32; 4]]>,
}

/// What was drawn of one tile.
#[derive(Default)]
struct Done {
    cells: u64,
    fragments: u64,
    panels: u64,
    covered: u64,
    flawed: Vec<(usize, Flaw)>,
}

impl Sweep {
    pub(crate) fn new() -> Self {
        Sweep {
            level: Level::new(),
            places: vec![],
            boxes: [vec![], vec![]],
            lines: vec![],
            spare: Mutex::default(),
            #[cfg(test)]
            fault: None,
        }
    }

    /// Takes the values of cells, or the function, for changed.
    pub(crate) fn invalidate_values(&mut self) {
        self.lines.clear();
    }

    /// Draws a frame on the current rayon pool.
    pub(crate) fn render<const N: usize>(&mut self, frame: &Frame<N>) -> (Vec<[f32; 4]>, Counts) {
        let size = frame.view.size();
        let too_much = if size.iter().any(|&n| n > MOST_PIXELS) {
            Some("the image is too wide or high")
        } else if frame.integral.exact.opacity.len() > MOST_KNOTS {
            Some("the transfer function has too many points")
        } else {
            None
        };
        if too_much.is_some() {
            return walk(frame, Counts { handed_over: too_much, ..Counts::default() });
        }
        let mut pixels = vec![[0.0; 4]; size[0] as usize * size[1] as usize];
        let Some(lens) = Lens::new(frame.geometry, frame.view) else { return (pixels, Counts::default()) };
        let Frame { geometry, values, .. } = *frame;
        screen::project(&lens, &geometry.points, &mut self.places);
        let (points, places, [of_cells, of_faces]) = (&geometry.points, &self.places, &mut self.boxes);
        screen::all_bounds(&lens, points, places, geometry.cells.len(), |i| geometry.cells[i].corners, of_cells);
        let all = &geometry.boundary.faces;
        screen::all_bounds(&lens, points, places, all.len(), |i| all[i].points, of_faces);
        let (cells, faces) = (Dealt::new(&lens, of_cells), Dealt::new(&lens, of_faces));
        let (exact, blend) = (frame.integral.exact, frame.view.blend());
        // How dense functions of two variables are is known to each segment.
        let steepest = if frame.integral.second.is_some() { 0.0 } else { exact.opacity.steepest() };
        let runs = Runs::new(&exact.opacity);
        let mut scene = Scene {
            geometry,
            values,
            exact,
            runs: &runs,
            steepest,
            blend,
            lines: &[],
            lens: &lens,
            boxes: &self.boxes[0],
            face_boxes: &self.boxes[1],
        };
        let own_lines = frame.integral.second.map(|two| two.lines);
        if blend == Blend::Composite && own_lines.is_none() && self.lines.len() != geometry.cells.len() {
            scene.all_lines(&mut self.lines);
        }
        scene.lines = own_lines.unwrap_or(&self.lines);

        let mut targets = targets(&mut pixels, &lens);
        let (done, tiles, stopped) = (AtomicUsize::new(0), targets.len(), AtomicBool::new(false));
        let workers = Mutex::new(vec![]);
        let drawn: Vec<Done> = targets
            .par_iter_mut()
            .with_max_len(1)
            .map(|target| {
                if stopped.load(Relaxed) {
                    return Done::default();
                }
                let mut worker = workers.lock().ok().and_then(|mut w| w.pop()).unwrap_or_else(Worker::new);
                let tile = self.tile(&mut worker, frame, &scene, [&cells, &faces], target);
                if let Ok(mut workers) = workers.lock() {
                    workers.push(worker);
                }
                if (frame.progress)((done.fetch_add(1, Relaxed) + 1) as f64 / tiles as f64).is_break() {
                    stopped.store(true, Relaxed);
                }
                tile
            })
            .collect();
        let mut counts = Counts::default();
        let mut covered = 0;
        let mut flawed = vec![];
        for tile in drawn {
            counts.cells += tile.cells;
            counts.fragments += tile.fragments;
            counts.panels += tile.panels;
            covered += tile.covered;
            for (pixel, flaw) in tile.flawed {
                flawed.push(pixel);
                match flaw {
                    Flaw::None => {}
                    Flaw::Overlap => counts.redrawn[0] += 1,
                    Flaw::Gap => counts.redrawn[1] += 1,
                    Flaw::Boundary => counts.redrawn[2] += 1,
                    Flaw::Coarse => counts.redrawn[3] += 1,
                }
            }
        }
        #[cfg(test)]
        let covered = if self.fault.is_some() { u64::MAX } else { covered };
        if flawed.len() > 256 && flawed.len() as f64 > MOST_REDRAWN * covered as f64 {
            return walk(frame, Counts { handed_over: Some("too many pixels failed their checks"), ..counts });
        }
        let Frame { integral, color, view, .. } = *frame;
        let again = match integral.second {
            Some(two) => cpu::render_pixels_of_two(geometry, values, two.second, two.seen, view, &flawed),
            None => cpu::render_pixels(geometry, values, integral, color, view, &flawed),
        };
        flawed.iter().zip(again).for_each(|(&i, p)| pixels[i] = p);
        (pixels, counts)
    }

    /// Draws one tile.
    fn tile<const N: usize>(
        &self,
        worker: &mut Worker<N>,
        frame: &Frame<N>,
        scene: &Scene<N>,
        [cells, faces]: [&Dealt; 2],
        target: &mut Target,
    ) -> Done {
        let t = target.index;
        let mut done = Done { cells: cells.len(t) as u64, ..Done::default() };
        if done.cells == 0 && faces.len(t) == 0 {
            return done;
        }
        let columns = scene.lens.tiles()[0];
        let corner = [(t % columns) as u32 * TILE, (t / columns) as u32 * TILE];
        worker.cells.clear();
        worker.cells.extend(cells.of(t));
        worker.faces.clear();
        worker.faces.extend(faces.of(t));
        let fresh = || vec![0; scene.geometry.cells.len() + 1];
        let mut place = self.spare.lock().ok().and_then(|mut s| s.pop()).unwrap_or_else(fresh);
        if place.len() != scene.geometry.cells.len() + 1 {
            place = fresh();
        }
        #[cfg(test)]
        let fault = self.fault;
        #[cfg(not(test))]
        let fault = None;
        draw(self.level, worker, frame, scene, corner, &mut place, fault);
        if let Ok(mut spare) = self.spare.lock() {
            spare.push(place);
        }
        let Worker { canvas, crossings, .. } = worker;
        let width = scene.lens.size[0] as usize;
        let Done { covered, flawed, .. } = &mut done;
        *covered = canvas.finish(scene, &frame.integral, crossings, &mut target.rows, frame.color, |i, j, flaw| {
            flawed.push(((corner[1] + j) as usize * width + (corner[0] + i) as usize, flaw));
        });
        done.fragments = std::mem::take(&mut canvas.fragments);
        done.panels = canvas.kept.take_panels();
        done
    }
}

#[cfg(not(test))]
type Fault = Option<std::convert::Infallible>;
#[cfg(test)]
type Fault = Option<tests::Fault>;

/// As [`sweep`], in the instructions of `level`. Each set of them is another copy of all that the sweep is, so there are three
/// for x86.
fn draw<const N: usize>(
    level: Level,
    worker: &mut Worker<N>,
    frame: &Frame<N>,
    scene: &Scene<N>,
    corner: [u32; 2],
    place: &mut [u32],
    fault: Fault,
) {
    macro_rules! with {
        ($simd:expr) => {
            $simd.vectorize(
                #[inline(always)]
                || sweep($simd, worker, frame, scene, corner, place, fault),
            )
        };
    }
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(avx512) = level.as_avx512() {
        with!(avx512);
    } else if let Some(avx2) = level.as_avx2() {
        with!(avx2);
    } else if let Some(sse2) = level.as_sse2() {
        with!(sse2);
    }
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
    fearless_simd::dispatch!(level, simd => with!(simd));
}

/// Sets up, orders and draws the cells of a tile.
#[inline(always)]
fn sweep<S: Simd, const N: usize>(
    simd: S,
    worker: &mut Worker<N>,
    frame: &Frame<N>,
    scene: &Scene<N>,
    corner: [u32; 2],
    place: &mut [u32],
    #[allow(unused_variables, reason = "tests alone inject faults")] fault: Fault,
) {
    let Worker { records, cells, faces, crossings, order, canvas } = worker;
    crossings.clear();
    for &f in faces.iter() {
        let f = f as usize;
        crossings.add(simd, scene.geometry, scene.lens, &scene.geometry.boundary.faces[f], scene.face_boxes[f], corner);
    }
    crossings.sort();
    canvas.clear(scene, frame.view, crossings, corner);
    setup::set_up(simd, scene, cells, corner, records);
    order.find(records, cells, crossings, place);
    #[cfg(test)]
    if let Some(fault) = fault {
        let mut sequence = vec![];
        while let Some(i) = order.next() {
            sequence.push(i);
        }
        fault.inject(&mut sequence);
        sequence.iter().for_each(|&i| canvas.draw(simd, scene, &frame.integral, crossings, records, i));
        return canvas.flush(simd, scene, &frame.integral, crossings, records);
    }
    while let Some(i) = order.next() {
        if canvas.is_done() {
            break;
        }
        if let Some(next) = order.after(AHEAD) {
            prefetch(&records.all, next);
        }
        canvas.draw(simd, scene, &frame.integral, crossings, records, i);
    }
    canvas.flush(simd, scene, &frame.integral, crossings, records);
}

/// Has the walk draw all of a frame.
fn walk<const N: usize>(frame: &Frame<N>, mut counts: Counts) -> (Vec<[f32; 4]>, Counts) {
    let Frame { geometry, values, integral, view, color, progress } = *frame;
    let (image, walked) = match integral.second {
        Some(two) => cpu::render_two(geometry, values, two.second, two.seen, view, progress),
        None => cpu::render(geometry, values, integral, color, view, progress),
    };
    counts.walked = walked;
    (image.pixels, counts)
}

/// The tiles of an image.
fn targets<'a>(pixels: &'a mut [[f32; 4]], lens: &Lens) -> Vec<Target<'a>> {
    let [columns, tiles] = lens.tiles();
    let mut targets: Vec<Target> = (0..tiles).map(|index| Target { index, rows: vec![] }).collect();
    for (j, row) in pixels.chunks_mut(lens.size[0] as usize).enumerate() {
        for (i, part) in row.chunks_mut(TILE as usize).enumerate() {
            targets[j / TILE as usize * columns + i].rows.push(part);
        }
    }
    targets
}
