//! Rays: from voxel to voxel, and what each adds.

use super::lanes;
use super::reconstruction::{Reconstruction, ReconstructionOrder, Sampling};
use super::tabulated::Tabulated;
use super::volume::{Samples, Volume};
use crate::integral::cubic::{Cubic, Piece, trilinear};
use crate::integral::{Exact, Knots, Light};
use crate::view::{Blend, View};
use glam::DVec3;
use rayon::prelude::*;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering::Relaxed};

/// Rows of pixels that are drawn at a time.
const BAND: usize = 4;

/// Transmittance below which a ray ends: what lies behind adds less than this times its colour to any channel. Direct
/// emission has no such bound, and goes on as long as f32 can tell.
pub(super) const fn least_light(direct: bool) -> f64 {
    if direct { f32::MIN_POSITIVE as f64 } else { 1e-6 }
}

/// What a frame depends on.
pub(crate) struct Frame<'a> {
    pub(crate) volume: &'a Volume,
    pub(crate) samples: &'a Samples,
    pub(crate) exact: &'a Exact<f64>,
    pub(crate) reconstruction: Reconstruction,
    /// What is looked up in the place of integrals.
    pub(crate) table: Option<Tabulated<'a>>,
    pub(crate) view: &'a View,
    /// Turns the largest values along a ray, normalised, into a premultiplied colour for [`Blend::Maximum`].
    pub(crate) pixel: &'a (dyn Fn(&[f64]) -> [f32; 4] + Sync),
    pub(crate) progress: &'a (dyn Fn(f64) -> ControlFlow<()> + Sync),
}

/// Draws a frame on the current rayon pool; also says how many voxels its rays passed. What progress does not want any
/// more stays empty.
pub(crate) fn render(frame: &Frame) -> (Vec<[f32; 4]>, u64) {
    let opacity = &frame.exact.opacity;
    let visible = Visible::new(frame.exact, frame.samples.components);
    let seen = match frame.view.blend() {
        Blend::Composite => frame.samples.seen(|low, high| visible.shows(opacity.intervals(low, high))),
        Blend::Maximum => frame.samples.seen(|_, _| true),
    };
    lanes::render(frame, &visible, &seen).unwrap_or_else(|| one_by_one(frame, &visible, &seen))
}

/// Draws single pixels of a frame, by their numbers, on the current rayon pool: ray by ray, in f64.
pub(super) fn render_pixels(frame: &Frame, pixels: &[usize]) -> Vec<[f32; 4]> {
    if pixels.is_empty() {
        return vec![];
    }
    let opacity = &frame.exact.opacity;
    let visible = &Visible::new(frame.exact, frame.samples.components);
    let is_maximum = frame.view.blend() == Blend::Maximum;
    let seen = &frame.samples.seen(|low, high| is_maximum || visible.shows(opacity.intervals(low, high)));
    match frame.samples.components {
        1 => Caster::<1> { frame, visible, seen }.pixels(pixels),
        2 => Caster::<2> { frame, visible, seen }.pixels(pixels),
        _ => Caster::<4> { frame, visible, seen }.pixels(pixels),
    }
}

/// Draws a frame ray by ray, in f64: what there are no lanes for, and what tests judge these by.
pub(super) fn one_by_one(frame: &Frame, visible: &Visible, seen: &[bool]) -> (Vec<[f32; 4]>, u64) {
    match frame.samples.components {
        1 => Caster::<1> { frame, visible, seen }.image(),
        2 => Caster::<2> { frame, visible, seen }.image(),
        _ => Caster::<4> { frame, visible, seen }.image(),
    }
}

/// The ray of pixel (`i`, `j`) along the axes of the grid, o + t d, and between which t it is in the grid; if it is.
pub(super) fn enter(frame: &Frame, i: u32, j: u32) -> Option<([f64; 3], [f64; 3], [f64; 2])> {
    let Volume { axes, cells, to_axes, centre, .. } = frame.volume;
    let ray = frame.view.ray(i, j);
    // From the point of the ray that is nearest to the middle of the grid, so that no distance is great.
    let offset = ray.origin - *centre;
    let shift = -offset.dot(ray.direction);
    let o = (*to_axes * (offset + ray.direction * shift)).to_array();
    let d = (*to_axes * ray.direction).to_array();
    let (mut t, mut end) = (ray.t_min - shift, ray.t_max - shift);
    for a in 0..3 {
        let [low, high] = [axes[a][0], axes[a][cells[a]]];
        if d[a] == 0.0 {
            // In a plane of the grid it belongs to the voxels behind that in index order.
            if !(low..high).contains(&o[a]) {
                return None;
            }
            continue;
        }
        let [near, far] = [(low - o[a]) / d[a], (high - o[a]) / d[a]];
        (t, end) = (t.max(near.min(far)), end.min(near.max(far)));
    }
    (t < end).then_some((o, d, [t, end]))
}

/// Which intervals of a transfer function show anything.
pub(super) struct Visible {
    /// How many intervals of the opacity function before each do.
    before: Vec<u32>,
}

impl Visible {
    /// Of a field of so many components.
    pub(super) fn new(exact: &Exact<f64>, components: usize) -> Self {
        // Emission of its own may show whatever the opacity is.
        let alone = exact.direct && components > 1;
        let channels = if exact.direct { 4 } else { 1 };
        let shows = |v: &[f64; 4]| alone || v[..channels].iter().any(|c| *c > 0.0);
        let mut before = vec![0];
        for w in exact.opacity.value.windows(2) {
            before.push(before[before.len() - 1] + u32::from(shows(&w[0]) || shows(&w[1])));
        }
        Visible { before }
    }

    /// Whether anything shows on the intervals from one to another.
    #[inline(always)]
    pub(super) fn shows(&self, [first, last]: [usize; 2]) -> bool {
        self.before[(last + 1).min(self.before.len() - 1)] > self.before[first]
    }
}

/// Draws a picture, whose pixels `trace` finds, and adds up what else it counts. What progress does not want any more stays
/// empty.
pub(super) fn draw(
    frame: &Frame,
    trace: impl Fn(u32, u32) -> ([f32; 4], [u64; 2]) + Sync,
) -> (Vec<[f32; 4]>, [u64; 2]) {
    let [w, h] = frame.view.size().map(|n| n as usize);
    let mut pixels = vec![[0.0; 4]; w * h];
    let (stopped, counts, done) = (AtomicBool::new(false), [AtomicU64::new(0), AtomicU64::new(0)], AtomicUsize::new(0));
    pixels.par_chunks_mut(w * BAND).enumerate().for_each(|(band, rows)| {
        if stopped.load(Relaxed) {
            return;
        }
        let mut own = [0, 0];
        for (p, pixel) in rows.iter_mut().enumerate() {
            let (drawn, [first, second]) = trace((p % w) as u32, (band * BAND + p / w) as u32);
            *pixel = drawn;
            own = [own[0] + first, own[1] + second];
        }
        counts.iter().zip(own).for_each(|(sum, own)| _ = sum.fetch_add(own, Relaxed));
        let share = (done.fetch_add(rows.len(), Relaxed) + rows.len()) as f64 / (w * h) as f64;
        if (frame.progress)(share).is_break() {
            stopped.store(true, Relaxed);
        }
    });
    (pixels, counts.map(AtomicU64::into_inner))
}

/// Calls `visit` with each voxel that a ray passes between two places of it, and the places where it enters and leaves it, until
/// that breaks.
#[inline(always)]
pub(super) fn for_each_voxel(
    volume: &Volume,
    line: &Line,
    [mut t, end]: [f64; 2],
    mut visit: impl FnMut([usize; 3], f64, f64) -> ControlFlow<()>,
) {
    let (Volume { axes, cells, .. }, Line { o, d }) = (volume, line);
    let mut at = line.voxel(volume, t);
    // The plane of each axis that comes next, and where.
    let plane = |a: usize, at: usize| if d[a] > 0.0 { at + 1 } else { at };
    let slope = d.map(|d| 1.0 / d);
    let crossing =
        |a: usize, at: usize| if d[a] == 0.0 { f64::INFINITY } else { (axes[a][plane(a, at)] - o[a]) * slope[a] };
    let mut next = [0, 1, 2].map(|a| crossing(a, at[a]));
    loop {
        let a = if next[0] <= next[1] && next[0] <= next[2] { 0 } else { 1 + usize::from(next[2] < next[1]) };
        let to = next[a].min(end);
        if to > t {
            if visit(at, t, to).is_break() {
                return;
            }
            t = to;
        }
        if next[a] >= end {
            return;
        }
        let behind = if d[a] > 0.0 { at[a] + 1 } else { at[a].wrapping_sub(1) };
        if behind >= cells[a] {
            return;
        }
        at[a] = behind;
        next[a] = crossing(a, behind);
    }
}

/// Casts the rays of a frame, of a field of `N` components, one by one.
struct Caster<'a, const N: usize> {
    frame: &'a Frame<'a>,
    visible: &'a Visible,
    /// Whether a block shows anything.
    seen: &'a [bool],
}

/// What a ray has gathered.
struct Gathered<const N: usize> {
    light: Light<f64>,
    largest: Option<[f64; N]>,
    steps: u64,
}

impl<const N: usize> Caster<'_, N> {
    fn image(&self) -> (Vec<[f32; 4]>, u64) {
        let (pixels, [steps, _]) = draw(self.frame, |i, j| {
            let gathered = self.trace(i, j);
            (self.finished(&gathered), [gathered.steps, 0])
        });
        (pixels, steps)
    }

    /// The pixels of these numbers.
    fn pixels(&self, pixels: &[usize]) -> Vec<[f32; 4]> {
        let w = self.frame.view.size()[0] as usize;
        let pixel = |&p: &usize| self.finished(&self.trace((p % w) as u32, (p / w) as u32));
        pixels.par_iter().map(pixel).collect()
    }

    fn finished(&self, gathered: &Gathered<N>) -> [f32; 4] {
        match (self.frame.view.blend(), &gathered.largest) {
            (Blend::Composite, _) => {
                let Light { color: [r, g, b], transmittance: through } = gathered.light;
                [r, g, b, 1.0 - through].map(|c| c as f32)
            }
            (Blend::Maximum, Some(values)) => (self.frame.pixel)(values),
            (Blend::Maximum, None) => [0.0; 4],
        }
    }

    /// Follows the ray of pixel (`i`, `j`).
    fn trace(&self, i: u32, j: u32) -> Gathered<N> {
        let mut gathered = Gathered { light: Light::none(), largest: None, steps: 0 };
        let Some((o, d, [t, end])) = enter(self.frame, i, j) else { return gathered };
        if let Reconstruction { order, sampling: Sampling::Steps(step) } = self.frame.reconstruction
            && order != ReconstructionOrder::Exact
        {
            self.march(&Line { o, d }, [t, end], step, &mut gathered);
            return gathered;
        }
        let (volume, line) = (self.frame.volume, Line { o, d });
        for_each_voxel(volume, &line, [t, end], |at, t, to| {
            gathered.steps += 1;
            if self.seen[self.frame.samples.block(at)] {
                let place = |t: f64| line.place(volume, at, t);
                self.voxel(at, place(t), place(to), (to - t) * volume.scale, &mut gathered);
                if gathered.light.transmittance < least_light(self.frame.exact.direct) {
                    return ControlFlow::Break(());
                }
            }
            ControlFlow::Continue(())
        });
        gathered
    }

    /// Adds what lies in a voxel between two places of its unit cube, `length` apart.
    #[inline(always)]
    fn voxel(&self, at: [usize; 3], p: DVec3, q: DVec3, length: f64, gathered: &mut Gathered<N>) {
        let Frame { volume, samples, .. } = self.frame;
        let c = (at[2] * volume.cells[1] + at[1]) * volume.cells[0] + at[0];
        if volume.is_hidden(c) {
            return;
        }
        let cubics: [Cubic; N] = std::array::from_fn(|k| {
            if samples.of_cells {
                return Cubic::constant(samples.of_cell(c, k));
            }
            Cubic::along(&samples.corners(at, k), p.to_array(), q.to_array())
        });
        match self.frame.reconstruction.order {
            ReconstructionOrder::Exact => self.add(&cubics, length, gathered),
            order => self.slab(order, &cubics.map(|c| [c.0[0], c.at(0.5), c.0[3]]), length, gathered),
        }
    }

    /// Follows a ray in equal steps between two places of it.
    fn march(&self, line: &Line, [mut t, end]: [f64; 2], step: f64, gathered: &mut Gathered<N>) {
        let mut front = self.sample(line, t);
        while t < end {
            let to = (t + 2.0 * step).min(end);
            let (middle, back) = (self.sample(line, f64::midpoint(t, to)), self.sample(line, to));
            let samples = std::array::from_fn(|k| [front[k], middle[k], back[k]]);
            self.slab(self.frame.reconstruction.order, &samples, (to - t) * self.frame.volume.scale, gathered);
            gathered.steps += 1;
            if gathered.light.transmittance < least_light(self.frame.exact.direct) || to <= t {
                return;
            }
            (t, front) = (to, back);
        }
    }

    /// The field at a place of a ray; NaN where it is left out.
    fn sample(&self, line: &Line, t: f64) -> [f64; N] {
        let Frame { volume, samples, .. } = self.frame;
        let at = line.voxel(volume, t);
        let c = (at[2] * volume.cells[1] + at[1]) * volume.cells[0] + at[0];
        if volume.is_hidden(c) {
            return [f64::NAN; N];
        }
        let p = line.place(volume, at, t);
        std::array::from_fn(|k| {
            if samples.of_cells { samples.of_cell(c, k) } else { trilinear(&samples.corners(at, k), p.to_array()) }
        })
    }

    /// Adds what stands for the field between the samples of a slab.
    fn slab(&self, order: ReconstructionOrder, samples: &[[f64; 3]; N], length: f64, gathered: &mut Gathered<N>) {
        let parts = order.parts();
        if let (Some(table), Blend::Composite, [samples]) = (&self.frame.table, self.frame.view.blend(), &samples[..]) {
            for part in 0..parts {
                let [r, g, b, alpha] = table.part(*samples, part, length / parts as f64).map(f64::from);
                gathered.light.add([r, g, b], alpha);
            }
            return;
        }
        for part in 0..parts {
            let cubics = samples.map(|s| order.part(part, s));
            self.add(&cubics, length / parts as f64, gathered);
        }
    }

    /// Adds a stretch of `length` along which the values are these cubics.
    #[inline(always)]
    fn add(&self, cubics: &[Cubic; N], length: f64, gathered: &mut Gathered<N>) {
        let last = &cubics[N - 1];
        let [low, high] = last.bounds();
        // Of samples, one may be left out.
        if !last.0.iter().all(|v| v.is_finite()) {
            return;
        }
        if self.frame.view.blend() == Blend::Maximum {
            if gathered.largest.is_none_or(|l| high > l[N - 1]) {
                raise(cubics, &mut gathered.largest);
            }
            return;
        }
        let intervals = self.frame.exact.opacity.intervals(low, high);
        if !self.visible.shows(intervals) {
            return;
        }
        if N == 1 {
            let shows = |i: usize| self.visible.shows([i, i]);
            self.frame.exact.add_cubic(last, length, shows, &mut gathered.light);
        } else {
            self.several(cubics, length, &mut gathered.light);
        }
    }

    /// Adds a voxel of several values: of a pair, or of colours and what their opacity is a function of.
    fn several(&self, values: &[Cubic; N], length: f64, light: &mut Light<f64>) {
        let Exact { opacity, color, scale, direct, .. } = self.frame.exact;
        if !values.iter().flat_map(|v| v.0).all(f64::is_finite) {
            return;
        }
        let (last, first) = (&values[N - 1], &values[0]);
        let mut cuts = vec![0.0, 1.0];
        crossings(last, opacity, &mut cuts);
        if let Some(color) = color {
            crossings(first, color, &mut cuts);
        }
        cuts.sort_by(f64::total_cmp);
        for w in cuts.windows(2).filter(|w| w[1] > w[0]) {
            let (share, middle) = (w[1] - w[0], f64::midpoint(w[0], w[1]));
            // The line that a value's cubic is on in this piece, over the piece.
            let line = |knots: &Knots<f64>, s: &Cubic, channel: usize| {
                let [low, high] = s.bounds();
                let i = if low == high { knots.intervals(low, low)[0] } else { knots.interval(s.at(middle)) };
                let (start, value, slope) = (knots.s[i], knots.value[i][channel], knots.slope[i][channel]);
                Cubic(s.part(w[0], w[1]).0.map(|c| value + slope * (c - start)))
            };
            let depth = Cubic(line(opacity, last, 0).0.map(|c| c * length * share));
            let emission = [1, 2, 3].map(|k| match color {
                Some(color) => line(color, first, k),
                None => Cubic(values[(k - 1).min(N - 1)].part(w[0], w[1]).0.map(|c| c * scale)),
            });
            let sum = Piece { depth, emission }.integrate(*direct);
            let factor = if *direct { length * share } else { 1.0 };
            light.add(sum.emitted.map(|e| e * factor), sum.alpha);
        }
    }
}

/// A ray o + t d in coordinates along the axes.
pub(super) struct Line {
    pub(super) o: [f64; 3],
    pub(super) d: [f64; 3],
}

impl Line {
    /// The voxel at `t`, or the nearest to it.
    fn voxel(&self, volume: &Volume, t: f64) -> [usize; 3] {
        [0, 1, 2].map(|a| {
            let x = self.o[a] + self.d[a] * t;
            (volume.axes[a].partition_point(|c| *c <= x).max(1) - 1).min(volume.cells[a] - 1)
        })
    }

    /// Where in the unit cube of a voxel it is at `t`.
    #[inline(always)]
    pub(super) fn place(&self, volume: &Volume, at: [usize; 3], t: f64) -> DVec3 {
        let along = |a: usize| (self.o[a] + self.d[a] * t - volume.axes[a][at[a]]) * volume.inverse[a][at[a]];
        DVec3::from_array([0, 1, 2].map(|a| along(a).clamp(0.0, 1.0)))
    }
}

/// Takes the largest value of the last of these cubics, and the others there, if it is larger than all before.
fn raise<const N: usize>(cubics: &[Cubic; N], largest: &mut Option<[f64; N]>) {
    let last = &cubics[N - 1];
    let places = [0.0, 1.0].into_iter().chain(last.turns());
    let Some(u) = places.max_by(|a, b| last.at(*a).total_cmp(&last.at(*b))) else { return };
    if largest.is_none_or(|l| last.at(u) > l[N - 1]) {
        let values = cubics.map(|c| c.at(u));
        if values.iter().all(|v| v.is_finite()) {
            *largest = Some(values);
        }
    }
}

/// Adds to `cuts` where a cubic meets the knots of a function.
fn crossings(s: &Cubic, knots: &Knots<f64>, cuts: &mut Vec<f64>) {
    let [low, high] = s.bounds();
    let from = knots.s.partition_point(|k| *k <= low);
    let to = knots.s.partition_point(|k| *k < high);
    if from >= to {
        return;
    }
    let turns = s.turns();
    let mut start = 0.0;
    for end in [turns[0], turns[1], 1.0] {
        if end <= start {
            continue;
        }
        let (a, b) = (s.at(start), s.at(end));
        for knot in knots.s[from..to].iter().filter(|k| a.min(b) < **k && **k < a.max(b)) {
            cuts.push(s.root(*knot, start, end));
        }
        cuts.push(end);
        start = end;
    }
}
