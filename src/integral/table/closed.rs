//! Tables in closed form, at a cost per texel that does not depend on the number of knots.
//!
//! Texels whose values are d apart have d intervals of the function between them, each l/d long: what an interval does then depends
//! on l/d alone, and not on the texel. So for each length and distance, the intervals are integrated once, in closed form, and the
//! texels are all runs of d neighbours of them. Compositing is associative, and runs of one length over anything associative take
//! three steps each (van Herk 1992; Gil & Werman 1993): the intervals are cut into blocks of d; a run is the end of one block and the
//! beginning of the next. Nothing is divided or subtracted, so nothing is lost: errors are those of f32.
//!
//! Lengths are the lanes of vector instructions.

use super::grid::{Grid, Part};
use crate::integral::{GAUSS_3, GAUSS_6, PANEL, Piece, SHALLOW};
use crate::real::Real;

/// Premultiplied colour and transmittance (in the end opacity, or what stands for both) of segments of several lengths.
#[derive(Debug, Clone, Copy)]
#[repr(align(32))]
pub(super) struct Lanes<const L: usize>(pub(super) [[f32; L]; 4]);

impl<const L: usize> Lanes<L> {
    pub(super) const NOTHING: Self = Lanes([[0.0; L], [0.0; L], [0.0; L], [1.0; L]]);

    /// This in front of `behind`.
    #[inline(always)]
    fn over(&self, behind: &Self) -> Self {
        let mut sum = *self;
        for k in 0..3 {
            for l in 0..L {
                sum.0[k][l] += self.0[3][l] * behind.0[k][l];
            }
        }
        for l in 0..L {
            sum.0[3][l] *= behind.0[3][l];
        }
        sum
    }
}

/// What the texels of one row of the sheared table share: see [`Rows::row`].
pub(super) struct Rows<'a, const L: usize> {
    grid: &'a Grid,
    lengths: [f32; L],
    weights: Weights,
    intervals: Vec<Lanes<L>>,
    ends: Vec<Lanes<L>>,
}

/// For each piece and lane: optical depths at its ends, weights of the emission there, transmittance.
#[derive(Debug, Clone)]
struct Weights {
    x: Vec<f32>,
    y: Vec<f32>,
    front: Vec<f32>,
    back: Vec<f32>,
    through: Vec<f32>,
}

/// (1 − e^{−t})/t for t up to [`SHALLOW`], to f32.
#[inline(always)]
fn slope_of_opacity(t: f32) -> f32 {
    1.0 - t * (1.0 / 2.0 - t * (1.0 / 6.0 - t * (1.0 / 24.0 - t * (1.0 / 120.0 - t * (1.0 / 720.0)))))
}

impl Weights {
    /// As [`Piece::new`] for depths that `rule` is for. Takes no decisions, so that it becomes vector instructions.
    #[inline(always)]
    fn integrate<const N: usize, const SHALLOW: bool, const DIRECT: bool>(&mut self, rule: &[[f64; 2]; N]) {
        let n = self.x.len();
        let (x, y) = (&self.x[..n], &self.y[..n]);
        let (front, back, through) = (&mut self.front[..n], &mut self.back[..n], &mut self.through[..n]);
        let fade = |t: f32| if SHALLOW { 1.0 - t * slope_of_opacity(t) } else { Real::exp(-t) };
        for q in 0..n {
            let (mut of_front, mut of_back) = (0.0, 0.0);
            for [u, weight] in rule {
                let (u, weight) = (*u as f32, *weight as f32);
                let rise = (y[q] - x[q]) * u;
                let seen = fade((x[q] + rise * 0.5) * u) * weight;
                let emitted = if DIRECT { seen } else { (x[q] + rise) * seen };
                of_front += (1.0 - u) * emitted;
                of_back += u * emitted;
            }
            (front[q], back[q]) = (of_front, of_back);
            through[q] = fade((x[q] + y[q]) * 0.5);
        }
    }

    /// The same for depths up to [`SHALLOW`], of chromatic emission, by the series of β in the mean depth D and the rise δ = y − x. With
    /// T(u) = D u − ½ δ (u − u²) it is β = Ψ − e^{−D}, and the term of δᵏ Dᵐ in Ψ is (−1)ᵐ (m + k)! / (2ᵏ m! (m + 2k + 1)!).
    #[inline(always)]
    fn expand(&mut self) {
        let n = self.x.len();
        let (x, y) = (&self.x[..n], &self.y[..n]);
        let (front, back, through) = (&mut self.front[..n], &mut self.back[..n], &mut self.through[..n]);
        for q in 0..n {
            let (d, rise) = ((x[q] + y[q]) * 0.5, y[q] - x[q]);
            let even = d
                * (1.0 / 2.0
                    - d * (1.0 / 3.0 - d * (1.0 / 8.0 - d * (1.0 / 30.0 - d * (1.0 / 144.0 - d * (1.0 / 840.0))))));
            let once = 1.0 / 12.0 - d * (1.0 / 24.0 - d * (1.0 / 80.0 - d * (1.0 / 360.0 - d * (1.0 / 2016.0))));
            let twice = 1.0 / 240.0 - d * (1.0 / 480.0 - d * (1.0 / 1680.0 - d * (1.0 / 8064.0)));
            let thrice = 1.0 / 6720.0 - d * (1.0 / 13_440.0);
            let beta = even + rise * (once + rise * (twice + rise * thrice));
            let alpha = d * slope_of_opacity(d);
            (front[q], back[q], through[q]) = (alpha - beta, beta, 1.0 - alpha);
        }
    }

    /// The same for any depths.
    fn integrate_deep(&mut self, direct: bool) {
        for q in 0..self.x.len() {
            // Squares must be finite, however long a segment of what is opaque.
            let (x, y) = (self.x[q].min(1e18), self.y[q].min(1e18));
            if x.max(y) > PANEL as f32 {
                let piece = Piece::new(x, y, direct);
                (self.front[q], self.back[q]) = (piece.front, piece.back);
                self.through[q] = Real::exp(-((x + y) * 0.5));
            }
        }
    }

    #[inline(always)]
    fn all<const DIRECT: bool>(&mut self, steepest: f32) {
        if steepest <= SHALLOW as f32 && !DIRECT {
            self.expand();
        } else if steepest <= SHALLOW as f32 {
            self.integrate::<3, true, DIRECT>(&GAUSS_3);
        } else {
            self.integrate::<6, false, DIRECT>(&GAUSS_6);
        }
        if steepest > PANEL as f32 {
            self.integrate_deep(DIRECT);
        }
    }
}

impl<'a, const L: usize> Rows<'a, L> {
    pub(super) fn new(grid: &'a Grid, lengths: [f32; L]) -> Self {
        let empty = vec![Lanes::NOTHING; grid.size];
        let zero = vec![0.0; grid.rising.0.len().max(grid.size) * L];
        let [x, y, front, back, through] = [(); 5].map(|()| zero.clone());
        Rows { grid, lengths, weights: Weights { x, y, front, back, through }, intervals: empty.clone(), ends: empty }
    }

    /// Fills `row` with premultiplied colour and transmittance of those texels whose value behind is `r` texels on, counted around the
    /// end, by their value in front: so all rows are equally long, and can be made side by side.
    pub(super) fn row(&mut self, r: usize, row: &mut [Lanes<L>]) {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            #[target_feature(enable = "avx2")]
            fn wide<const L: usize>(rows: &mut Rows<'_, L>, r: usize, row: &mut [Lanes<L>]) {
                rows.whole(r, row);
            }
            #[allow(unsafe_code, reason = "vector instructions that the processor was just asked about")]
            // SAFETY: the processor has AVX2.
            return unsafe { wide(self, r, row) };
        }
        self.whole(r, row);
    }

    #[inline(always)]
    fn whole(&mut self, r: usize, row: &mut [Lanes<L>]) {
        let n = self.grid.size;
        if r == 0 {
            let part = |c: &[f32; 4]| Part { front: *c, back: *c, share: 1.0 };
            let parts: Vec<Part> = self.grid.constant.iter().map(part).collect();
            self.integrate(&parts, self.lengths, |i, lanes| row[i] = lanes);
            return;
        }
        self.runs::<true>(r, row);
        self.runs::<false>(n - r, row);
    }

    /// Calls `piece` with the number of each part and what it does where an interval is `steps` long.
    #[inline(always)]
    fn integrate(&mut self, parts: &[Part], steps: [f32; L], mut piece: impl FnMut(usize, Lanes<L>)) {
        let direct = self.grid.direct;
        let longest = steps.iter().fold(0.0, |m: f32, &l| m.max(l));
        let mut steepest = 0.0f32;
        let lanes = self.weights.x.as_chunks_mut::<L>().0.iter_mut().zip(self.weights.y.as_chunks_mut::<L>().0);
        for (part, (x, y)) in parts.iter().zip(lanes) {
            let (f, b) = (part.front[0] * part.share, part.back[0] * part.share);
            steepest = steepest.max(f).max(b);
            let (mut of_front, mut of_back) = ([0.0; L], [0.0; L]);
            for l in 0..L {
                (of_front[l], of_back[l]) = (f * steps[l], b * steps[l]);
            }
            (*x, *y) = (of_front, of_back);
        }
        match direct {
            true => self.weights.all::<true>(steepest * longest),
            false => self.weights.all::<false>(steepest * longest),
        }
        let Weights { front, back, through, .. } = &self.weights;
        let weights = front.as_chunks::<L>().0.iter().zip(back.as_chunks::<L>().0).zip(through.as_chunks::<L>().0);
        for (i, (part, ((front, back), through))) in parts.iter().zip(weights).enumerate() {
            let (f, b, front, back) = (part.front, part.back, *front, *back);
            let mut sum = Lanes([[0.0; L]; 4]);
            for k in 0..3 {
                for l in 0..L {
                    let length = if direct { part.share * steps[l] } else { 1.0 };
                    sum.0[k][l] = (f[k + 1] * front[l] + b[k + 1] * back[l]) * length;
                }
            }
            sum.0[3] = *through;
            piece(i, sum);
        }
    }

    /// All runs of `d` intervals, of a scalar that rises or falls.
    #[inline(always)]
    fn runs<const RISING: bool>(&mut self, d: usize, row: &mut [Lanes<L>]) {
        let n = self.grid.size;
        let grid = self.grid;
        let (parts, interval) = if RISING { &grid.rising } else { &grid.falling };
        let steps = self.lengths.map(|l| l / d as f32);
        let mut intervals = std::mem::take(&mut self.intervals);
        if grid.plain {
            self.integrate(parts, steps, |i, lanes| intervals[i] = lanes);
        } else {
            intervals.fill(Lanes::NOTHING);
            self.integrate(parts, steps, |i, lanes| {
                let of = &mut intervals[interval[i] as usize];
                *of = of.over(&lanes);
            });
        }
        let ends = &mut self.ends;
        let runs = n - d;
        // A falling scalar passes the intervals from the last to the first.
        let mut texel = |i: usize, lanes: Lanes<L>| row[if RISING { i } else { n - 1 - i }] = lanes;
        for block in (0..runs).step_by(d) {
            let mut end = intervals[block + d - 1];
            ends[block + d - 1] = end;
            let block_of = block..block + d - 1;
            for (interval, of) in intervals[block_of.clone()].iter().zip(&mut ends[block_of]).rev() {
                end = interval.over(&end);
                *of = end;
            }
            texel(block, end);
            let mut beginning = Lanes::NOTHING;
            for i in block + 1..(block + d).min(runs) {
                beginning = beginning.over(&intervals[i + d - 1]);
                texel(i, ends[i].over(&beginning));
            }
        }
        self.intervals = intervals;
    }
}

/// 1 − e^{−depth}, accurate relative to itself.
#[inline(always)]
pub(super) fn opacity(depth: f32) -> f32 {
    if depth < SHALLOW as f32 { depth * slope_of_opacity(depth) } else { 1.0 - Real::exp(-depth) }
}

/// Depths below this have no colour over opacity but the limit.
const THIN: f32 = 1e-30;

/// What stands for colour and opacity, from values `i` to `j`: colour over opacity (direct: over the length that is seen), and the
/// mean extinction, at most `most`.
#[inline(always)]
pub(super) fn normalise<const L: usize>(
    grid: &Grid,
    [i, j]: [usize; 2],
    lanes: &mut Lanes<L>,
    lengths: &[f32; L],
    most: f32,
) {
    let density = grid.density(i, j) as f32;
    let scale = if grid.direct { density } else { 1.0 };
    let mut over = [0.0; L];
    for l in 0..L {
        let depth = density * lengths[l];
        over[l] = if depth > THIN { scale / opacity(depth) } else { 0.0 };
    }
    for color in &mut lanes.0[..3] {
        for (color, over) in color.iter_mut().zip(over) {
            *color *= over;
        }
    }
    lanes.0[3] = [density.min(most); L];
    if lengths.iter().any(|l| density * l <= THIN) {
        let limit = grid.limit(i, j);
        for (color, limit) in lanes.0.iter_mut().zip(limit) {
            for (color, _) in color.iter_mut().zip(lengths).filter(|(_, l)| density * **l <= THIN) {
                *color = limit as f32;
            }
        }
    }
}

/// The last channel of all of `row`: opacity, not transmittance.
#[inline(always)]
pub(super) fn publish<const L: usize>(row: &mut [Lanes<L>]) {
    for lanes in row {
        lanes.0[3] = lanes.0[3].map(|t| 1.0 - t);
    }
}

/// Premultiplied colour and opacity of all segments of one length; the value in front varies fastest.
pub(super) fn slice(grid: &Grid, length: f64) -> Vec<[f32; 4]> {
    let n = grid.size;
    let mut texels = vec![[0.0; 4]; n * n];
    let mut rows = Rows::new(grid, [length as f32]);
    let mut row = vec![Lanes::NOTHING; n];
    for r in 0..n {
        rows.row(r, &mut row);
        publish(&mut row);
        for (i, Lanes(texel)) in row.iter().enumerate() {
            texels[behind(i, r, n) * n + i] = texel.map(|[c]| c);
        }
    }
    texels
}

/// The value behind, `r` texels on from the one in front.
#[inline(always)]
pub(super) fn behind(i: usize, r: usize, n: usize) -> usize {
    if i + r < n { i + r } else { i + r - n }
}
