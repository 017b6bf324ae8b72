//! Tables in closed form, at a cost per texel that does not depend on the number of knots.
//!
//! Texels whose values are d apart have d intervals of the function between them, each l/d long: what an interval does
//! then depends on l/d alone, and not on the texel. So for each length and distance, the intervals are integrated once,
//! in closed form, and the texels are all runs of d neighbours of them. Compositing is associative, and runs of one
//! length over anything associative take three steps each (van Herk 1992; Gil & Werman 1993): the intervals are cut
//! into blocks of d; a run is the end of one block and the beginning of the next. Nothing is divided or subtracted, so
//! nothing is lost: errors are those of f32.
//!
//! A falling scalar passes the intervals of a rising one in reverse: both are integrated at once, as they share most of
//! it.

use super::grid::{Grid, Part};
use crate::integral::{GAUSS_6, GAUSS_DEPTH, Piece, SERIES_DEPTH};
use crate::real::Real;

/// Premultiplied colour and opacity (or what stands for both) of segments of several lengths.
#[derive(Debug, Clone, Copy)]
#[repr(align(32))]
pub(super) struct Lanes<const L: usize>(pub(super) [[f32; 4]; L]);

impl<const L: usize> Lanes<L> {
    pub(super) const NOTHING: Self = Lanes([[0.0; 4]; L]);

    /// This in front of `behind`.
    #[inline(always)]
    fn over(&self, behind: &Self) -> Self {
        let mut sum = *self;
        for (sum, behind) in sum.0.iter_mut().zip(&behind.0) {
            let transmittance = 1.0 - sum[3];
            for k in 0..4 {
                sum[k] += transmittance * behind[k];
            }
        }
        sum
    }

    /// Counts the weights of one end of so many intervals more from there: red's end is the first, green's the last.
    #[inline(always)]
    fn moved(mut self, [red, green]: [f32; 2]) -> Self {
        for of in &mut self.0 {
            of[0] += red * of[2];
            of[1] += green * of[2];
        }
        self
    }

    /// The weights of a segment of this share of an interval's length: behind is green if the scalar falls.
    #[inline(always)]
    fn ended(mut self, share: f32, falls: bool) -> Self {
        for of in &mut self.0 {
            let [r, g, _, alpha] = *of;
            *of = if falls { [g * share, r * share, 0.0, alpha] } else { [r * share, g * share, 0.0, alpha] };
        }
        self
    }
}

/// The same segments as a rising scalar passes them, and as a falling one does.
#[derive(Debug, Clone, Copy)]
pub(super) struct Both<const L: usize> {
    pub(super) rising: Lanes<L>,
    pub(super) falling: Lanes<L>,
}

impl<const L: usize> Both<L> {
    pub(super) const NOTHING: Self = Both { rising: Lanes::NOTHING, falling: Lanes::NOTHING };

    /// This, and after it in the order in which the scalar rises, `next`.
    #[inline(always)]
    fn then(&self, next: &Self) -> Self {
        Both { rising: self.rising.over(&next.rising), falling: next.falling.over(&self.falling) }
    }

    /// The same of weights, of runs of so many intervals.
    #[inline(always)]
    fn joined<const WEIGHTS: bool>(&self, next: &Self, [own, nexts]: [usize; 2]) -> Self {
        if !WEIGHTS {
            return self.then(next);
        }
        let both = |both: &Self, by: [f32; 2]| Both { rising: both.rising.moved(by), falling: both.falling.moved(by) };
        both(self, [0.0, nexts as f32]).then(&both(next, [own as f32, 0.0]))
    }
}

/// The function between the values of a table, ready for segments of `L` lengths.
pub(super) struct Runs<'a, const L: usize> {
    grid: &'a Grid,
    pub(super) lengths: [f32; L],
    /// Optical depths at both ends of each part, for each length, where there is one interval.
    depths: [Vec<f32>; 2],
    /// Colours at both ends, and what opacity comes from in the same way.
    colours: Vec<[[f32; 4]; 2]>,
    steepest: f32,
}

/// What a thread needs to find runs.
pub(super) struct Scratch<const L: usize> {
    intervals: Vec<Both<L>>,
    ends: Vec<Both<L>>,
}

/// Parts times lengths that are integrated at a time: a multiple of all numbers of lengths.
const AT_ONCE: usize = 128;

/// For each part and length: optical depths at its ends, its opacity, and the weights of the emission at its ends, seen
/// by a rising scalar and by a falling one.
struct Weights {
    x: [f32; AT_ONCE],
    y: [f32; AT_ONCE],
    alpha: [f32; AT_ONCE],
    rising: [[f32; AT_ONCE]; 2],
    falling: [[f32; AT_ONCE]; 2],
}

impl Weights {
    const EMPTY: Self = Weights {
        x: [0.0; AT_ONCE],
        y: [0.0; AT_ONCE],
        alpha: [0.0; AT_ONCE],
        rising: [[0.0; AT_ONCE]; 2],
        falling: [[0.0; AT_ONCE]; 2],
    };

    /// As [`Piece::new`], both ways, for depths up to [`SERIES_DEPTH`]. This and the next take no decisions, so that they
    /// become vector instructions.
    #[inline(always)]
    fn expand<const DIRECT: bool>(&mut self) {
        for q in 0..AT_ONCE {
            let (x, y) = (self.x[q], self.y[q]);
            self.set(q, Piece::by_series(x, y, DIRECT), Piece::by_series(y, x, DIRECT));
        }
    }

    /// The same for depths up to [`GAUSS_DEPTH`], a node at a time.
    #[inline(always)]
    fn integrate<const DIRECT: bool>(&mut self) {
        let Weights { x, y, alpha, rising: [rising_front, rising_back], falling: [falling_front, falling_back] } = self;
        for of in [&mut *alpha, rising_front, rising_back, falling_front, falling_back] {
            of.fill(0.0);
        }
        for [u, weight] in GAUSS_6 {
            let (u, weight) = (u as f32, weight as f32);
            for q in 0..AT_ONCE {
                let rise = (y[q] - x[q]) * u;
                let (slope, depth) = (x[q] + rise, (x[q] + rise * 0.5) * u);
                let [rising, falling] = [depth, (x[q] + y[q]) * 0.5 - depth].map(|t| weight * <f32 as Real>::exp(-t));
                let absorbed = slope * rising;
                let [rising, falling] = if DIRECT { [rising, falling] } else { [absorbed, slope * falling] };
                alpha[q] += absorbed;
                rising_front[q] += (1.0 - u) * rising;
                rising_back[q] += u * rising;
                falling_front[q] += (1.0 - u) * falling;
                falling_back[q] += u * falling;
            }
        }
    }

    #[inline(always)]
    fn set(&mut self, q: usize, rising: Piece<f32>, falling: Piece<f32>) {
        self.alpha[q] = rising.alpha;
        (self.rising[0][q], self.rising[1][q]) = (rising.front, rising.back);
        (self.falling[0][q], self.falling[1][q]) = (falling.back, falling.front);
    }

    /// The same for any depths.
    fn integrate_deep(&mut self, direct: bool) {
        for q in 0..AT_ONCE {
            // Squares must be finite, however long a segment of what is opaque.
            let (x, y) = (self.x[q].min(1e18), self.y[q].min(1e18));
            if x.max(y) > GAUSS_DEPTH as f32 {
                self.set(q, Piece::new(x, y, direct), Piece::new(y, x, direct));
            }
        }
    }

    #[inline(always)]
    fn all<const DIRECT: bool>(&mut self, steepest: f32) {
        match steepest <= SERIES_DEPTH as f32 {
            true => self.expand::<DIRECT>(),
            false => self.integrate::<DIRECT>(),
        }
        if steepest > GAUSS_DEPTH as f32 {
            self.integrate_deep(DIRECT);
        }
    }
}

impl<'a, const L: usize> Runs<'a, L> {
    pub(super) fn new(grid: &'a Grid, lengths: [f32; L]) -> Self {
        Self::of(grid, &grid.parts, lengths)
    }

    fn of(grid: &'a Grid, parts: &[Part], lengths: [f32; L]) -> Self {
        let depths = [0, 1].map(|end| {
            let of = |p: &Part| [p.front, p.back][end][0] * p.share;
            parts.iter().flat_map(|p| lengths.map(|l| of(p) * l)).collect::<Vec<f32>>()
        });
        let colour = |p: &Part| {
            [p.front, p.back].map(|[_, r, g, b]| {
                let scale = if grid.direct { p.share } else { 1.0 };
                [r * scale, g * scale, b * scale, 1.0]
            })
        };
        let steepest = depths.iter().flatten().fold(0.0, |m: f32, &d| m.max(d));
        Runs { grid, lengths, colours: parts.iter().map(colour).collect(), depths, steepest }
    }

    pub(super) fn scratch(&self) -> Scratch<L> {
        let empty = vec![Both::NOTHING; self.grid.size];
        Scratch { intervals: empty.clone(), ends: empty }
    }

    /// Segments between values that are `d` texels apart, by the lower of the two; of those with d = 0, that which
    /// rises is what counts. As many as there are: the table's size less d.
    pub(super) fn apart(&self, d: usize, scratch: &mut Scratch<L>, segments: &mut [Both<L>]) {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            #[target_feature(enable = "avx2")]
            fn wide<const L: usize>(runs: &Runs<'_, L>, d: usize, scratch: &mut Scratch<L>, segments: &mut [Both<L>]) {
                runs.any(d, scratch, segments);
            }
            #[allow(unsafe_code, reason = "vector instructions that the processor was just asked about")]
            // SAFETY: the processor has AVX2.
            return unsafe { wide(self, d, scratch, segments) };
        }
        self.any(d, scratch, segments);
    }

    #[inline(always)]
    fn any(&self, d: usize, scratch: &mut Scratch<L>, segments: &mut [Both<L>]) {
        if !self.grid.weights {
            return self.whole::<false>(d, scratch, segments);
        }
        self.whole::<true>(d, scratch, segments);
        let share = 1.0 / d.max(1) as f32;
        let count = self.grid.size - d;
        for both in &mut segments[..count] {
            *both = Both { rising: both.rising.ended(share, false), falling: both.falling.ended(share, true) };
        }
    }

    #[inline(always)]
    fn whole<const WEIGHTS: bool>(&self, d: usize, scratch: &mut Scratch<L>, segments: &mut [Both<L>]) {
        if d == 0 {
            let part = |c: &[f32; 4]| match c {
                [tau, ..] if WEIGHTS => Part { front: [*tau, 0.0, 1.0, 1.0], back: [*tau, 1.0, 0.0, 1.0], share: 1.0 },
                _ => Part { front: *c, back: *c, share: 1.0 },
            };
            let parts: Vec<Part> = self.grid.constant.iter().map(part).collect();
            Runs::of(self.grid, &parts, self.lengths).integrate(1.0, |i, both| segments[i] = both);
            return;
        }
        let Scratch { intervals, ends } = scratch;
        let over = 1.0 / d as f32;
        if self.grid.plain {
            self.integrate(over, |i, both| intervals[i] = both);
        } else {
            intervals.fill(Both::NOTHING);
            self.integrate(over, |i, both| {
                let of = &mut intervals[self.grid.interval[i] as usize];
                *of = of.then(&both);
            });
        }
        let runs = self.grid.size - d;
        for block in (0..runs).step_by(d) {
            let mut end = intervals[block + d - 1];
            ends[block + d - 1] = end;
            let block_of = block..block + d - 1;
            for (k, (interval, of)) in (1..d).zip(intervals[block_of.clone()].iter().zip(&mut ends[block_of]).rev()) {
                end = interval.joined::<WEIGHTS>(&end, [1, k]);
                *of = end;
            }
            segments[block] = end;
            let rest = block + 1..(block + d).min(runs);
            let next = &intervals[rest.start + d - 1..rest.end + d - 1];
            let mut beginning = Both::NOTHING;
            for (k, ((segment, end), next)) in (0..).zip(segments[rest.clone()].iter_mut().zip(&ends[rest]).zip(next)) {
                beginning = beginning.joined::<WEIGHTS>(next, [k, 1]);
                *segment = end.joined::<WEIGHTS>(&beginning, [d - 1 - k, k + 1]);
            }
        }
    }

    /// Calls `part` with the number of each part and what it does where an interval is `over` of the lengths long.
    #[inline(always)]
    fn integrate(&self, over: f32, mut part: impl FnMut(usize, Both<L>)) {
        let direct = self.grid.direct;
        let scale = if direct { self.lengths.map(|l| l * over) } else { [1.0; L] };
        let mut weights = Weights::EMPTY;
        let depths = self.depths[0].chunks(AT_ONCE).zip(self.depths[1].chunks(AT_ONCE));
        for (chunk, ((front, back), colours)) in depths.zip(self.colours.chunks(AT_ONCE / L)).enumerate() {
            for (to, from) in [(&mut weights.x, front), (&mut weights.y, back)] {
                to.iter_mut().zip(from).for_each(|(to, from)| *to = from * over);
            }
            match direct {
                true => weights.all::<true>(self.steepest * over),
                false => weights.all::<false>(self.steepest * over),
            }
            for (i, [front, back]) in colours.iter().enumerate() {
                let mut both = Both::NOTHING;
                for (lanes, of) in [(&mut both.rising, &weights.rising), (&mut both.falling, &weights.falling)] {
                    for l in 0..L {
                        let [of_front, of_back] = [of[0][i * L + l], of[1][i * L + l]].map(|w| w * scale[l]);
                        for k in 0..4 {
                            lanes.0[l][k] = front[k] * of_front + back[k] * of_back;
                        }
                        if direct {
                            lanes.0[l][3] = weights.alpha[i * L + l];
                        }
                    }
                }
                part(chunk * (AT_ONCE / L) + i, both);
            }
        }
    }
}

/// Opacities below this have no colour over them but the limit.
const THIN: f32 = 1e-30;

/// What stands for colour and opacity, between the values `i` and `j`: colour over opacity (direct: over the length
/// that is seen), and the mean extinction, at most `most`; and the same at the limit where nothing hides anything, for a scalar that rises and one
/// that falls.
#[inline(always)]
pub(super) fn normalise<const L: usize>(
    grid: &Grid,
    [i, j]: [usize; 2],
    both: &mut Both<L>,
    most: f32,
) -> [[f32; 4]; 2] {
    let [r, g, b, density] = grid.limit(i, j);
    let scale = if grid.direct { density } else { 1.0 };
    let limit = [r, g, b, density.min(most)];
    let fallen = if grid.weights { [g, r, b, limit[3]] } else { limit };
    for (lanes, limit) in [(&mut both.rising, limit), (&mut both.falling, fallen)] {
        for texel in &mut lanes.0 {
            let over = scale / texel[3];
            *texel = if texel[3] > THIN { texel.map(|c| c * over) } else { limit };
            texel[3] = limit[3];
        }
    }
    [limit, fallen]
}

/// Premultiplied colour and opacity of all segments of one length; the value in front varies fastest.
pub(super) fn slice(grid: &Grid, length: f64) -> Vec<[f32; 4]> {
    let n = grid.size;
    let mut texels = vec![[0.0; 4]; n * n];
    let runs = Runs::new(grid, [length as f32]);
    let (mut scratch, mut segments) = (runs.scratch(), vec![Both::NOTHING; n]);
    for d in 0..n {
        runs.apart(d, &mut scratch, &mut segments[..n - d]);
        for (i, Both { rising, falling }) in segments[..n - d].iter().enumerate() {
            texels[i * n + i + d] = falling.0[0];
            texels[(i + d) * n + i] = rising.0[0];
        }
    }
    texels
}
