//! The transfer function as the kernel reads it: knots over the normalised scalar.

use super::OPAQUE_EXTINCTION;
use crate::field::Normalization;
use crate::real::Real;
use crate::transfer::{Convention, OPAQUE, TransferFunction};

/// A piecewise linear function of the normalised scalar with four channels: extinction per normalised unit of length,
/// and red, green, blue of the colour (or, for direct emission, of the emission per normalised unit of length).
#[derive(Debug, Clone, PartialEq)]
pub struct Knots<R> {
    /// Ascending; the first and the last lie beyond every scalar.
    pub(crate) s: Vec<R>,
    /// Value at each knot; at a step, two knots share their s.
    pub(crate) value: Vec<[R; 4]>,
    /// Slope of each interval; 0 for intervals of no width.
    pub(crate) slope: Vec<[R; 4]>,
    /// For each of [`BUCKETS`] equal parts of [−1, 1], the interval that its lower end lies in.
    pub(crate) bucket: Vec<u32>,
}

/// A line of the function, between which values it is that, and, where a constant that is opaque as a single value is the
/// least of them, the number of the line of that; else 0.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Line<R> {
    pub(crate) value: [R; 4],
    pub(crate) slope: [R; 4],
    pub(crate) ends: [R; 2],
    pub(crate) single: usize,
}

/// Number of entries of the look-up that finds the interval of a scalar.
pub(crate) const BUCKETS: usize = 512;

/// Knots in a bucket that are looked through one by one.
const CROWD: usize = 8;

/// Greater than any slope, and finite in f32, so that its product with an interval of no width is 0.
const STEEPEST: f64 = 1e38;

/// The greatest colour, or emission per normalised unit of length.
pub(super) const BRIGHTEST: f64 = 1e30;

/// Beyond every normalised scalar.
const FAR: f64 = 1e30;

impl<R: Real> Knots<R> {
    /// The function through `knots` `(s, value)`, ascending; constant outside them.
    fn new(mut knots: Vec<(f64, [f64; 4])>) -> Self {
        let (first, last) = (knots.first().map_or([0.0; 4], |k| k.1), knots.last().map_or([0.0; 4], |k| k.1));
        knots.insert(0, (-FAR, first));
        knots.push((FAR, last));
        let s: Vec<R> = knots.iter().map(|k| R::of(k.0.clamp(-FAR, FAR))).collect();
        let value: Vec<[R; 4]> = knots.iter().map(|k| k.1.map(R::of)).collect();
        let slope = (0..knots.len())
            .map(|i| match knots.get(i + 1) {
                Some(next) if s[i] < s[i + 1] => {
                    let slope = |k: usize| (next.1[k] - knots[i].1[k]) / (next.0 - knots[i].0);
                    [0, 1, 2, 3].map(|k| R::of(slope(k).clamp(-STEEPEST, STEEPEST)))
                }
                _ => [R::of(0.0); 4],
            })
            .collect();
        let bucket = (0..BUCKETS)
            .map(|b| {
                let low = R::of(2.0 * b as f64 / BUCKETS as f64 - 1.0);
                (s.partition_point(|&k| k <= low).max(1) - 1) as u32
            })
            .collect();
        Knots { s, value, slope, bucket }
    }

    /// Number of knots, those beyond every scalar included.
    pub fn len(&self) -> usize {
        self.s.len()
    }

    /// Where they are, ascending.
    pub(crate) fn places(&self) -> &[R] {
        &self.s
    }

    /// Never true: there are at least the two outer knots.
    pub fn is_empty(&self) -> bool {
        self.s.is_empty()
    }

    /// Channel `k` at `s`.
    pub(crate) fn color_at(&self, s: R, k: usize) -> R {
        let i = self.interval(s);
        self.value[i][k] + self.slope[i][k] * (s - self.s[i])
    }

    /// The lines, ascending, and after them those of constants that are opaque as single values.
    pub(crate) fn lines(&self) -> Vec<Line<R>> {
        let line = |i: usize, ends: [R; 2]| Line { value: self.value[i], slope: self.slope[i], ends, single: 0 };
        let intervals: Vec<usize> = (1..self.s.len()).filter(|&i| self.s[i - 1] < self.s[i]).map(|i| i - 1).collect();
        let mut lines: Vec<_> = intervals.iter().map(|&i| line(i, [self.s[i], self.s[i + 1]])).collect();
        for (k, &i) in intervals.iter().enumerate() {
            let single = self.of_constant(i, self.s[i]);
            if single != i {
                lines[k].single = lines.len();
                lines.push(line(single, [self.s[i], R::of(FAR)]));
            }
        }
        lines
    }

    /// The greatest extinction.
    pub(crate) fn steepest(&self) -> R {
        self.value.iter().fold(R::of(0.0), |most, v| most.max(v[0]))
    }

    /// How much channel `k` varies at most over a stretch of values `width` wide.
    pub(crate) fn variation(&self, k: usize, width: R) -> R {
        let mut most = R::of(0.0);
        for (i, &s) in self.s.iter().enumerate() {
            // The extremes of a piecewise linear function are at knots and at the stretch's ends; one end may be taken to be
            // at a knot.
            for [from, to] in [[s, s + width], [s - width, s]] {
                let (mut low, mut high) = (self.value[i][k], self.value[i][k]);
                let mut take = |v: R| (low, high) = (low.min(v), high.max(v));
                let inside = self.s.iter().zip(&self.value).filter(|(s, _)| from <= **s && **s <= to);
                inside.for_each(|(_, v)| take(v[k]));
                [from, to].into_iter().for_each(|end| take(self.color_at(end, k)));
                most = most.max(high - low);
            }
        }
        most
    }

    /// The greatest extinction on the intervals from the first to the last of `lines`.
    pub(crate) fn densest(&self, [first, last]: [u16; 2]) -> R {
        let on = usize::from(first)..(usize::from(last) + 2).min(self.value.len());
        self.value[on].iter().fold(R::of(0.0), |most, v| most.max(v[0]))
    }

    /// Whether anything between `low` and `high` has extinction, or, if `direct`, a colour.
    pub(crate) fn shows(&self, low: f32, high: f32, direct: bool) -> bool {
        let channels = if direct { 4 } else { 1 };
        let [low, high] = [low, high].map(|s| R::of(f64::from(s)));
        let mut first = self.interval(low);
        while first > 0 && self.s[first] >= low {
            first -= 1;
        }
        let beyond = self.interval(high) + 1;
        let positive = |v: &[R; 4]| v[..channels].iter().any(|&c| c > R::of(0.0));
        // Linear in between: from the knot below to the one above.
        self.value[first..=beyond].iter().any(positive)
    }

    /// The first and the last interval that values from `low` to `high` are on, both finite.
    pub(crate) fn intervals(&self, low: R, high: R) -> [usize; 2] {
        let first = self.interval(low);
        if low == high {
            return [self.of_constant(first, low); 2];
        }
        let mut last = self.interval(high);
        // What only ends there is on the interval below.
        while last > first && self.s[last] >= high {
            last -= 1;
        }
        [first, last]
    }

    /// The interval that says what a constant `s` in the interval `i` is: if it is opaque as a single value, it is opaque all
    /// along.
    #[inline(always)]
    fn of_constant(&self, mut i: usize, s: R) -> usize {
        let opaque = |k: &[R; 4]| k[0] >= R::of(OPAQUE_EXTINCTION);
        while i > 0 && self.s[i - 1] == s && opaque(&self.value[i - 1]) && !opaque(&self.value[i]) {
            i -= 1;
        }
        i
    }

    /// The interval that `s` lies in: the last whose lower end is not above it.
    #[inline(always)]
    pub(crate) fn interval(&self, s: R) -> usize {
        let scaled = (s + R::of(1.0)) * R::of(BUCKETS as f64 / 2.0);
        let b = scaled.max(R::of(0.0)).min(R::of((BUCKETS - 1) as f64));
        let b = b.truncate() as usize;
        let mut i = self.bucket[b] as usize;
        // Where many knots are in one bucket, by halves.
        let mut above = self.bucket.get(b + 1).map_or(self.s.len() - 1, |&next| next as usize + 1);
        while above > i + CROWD {
            let middle = usize::midpoint(i, above);
            if self.s[middle] <= s {
                i = middle;
            } else {
                above = middle;
            }
        }
        while i > 0 && self.s[i] > s {
            i -= 1;
        }
        while i + 2 < self.s.len() && self.s[i + 1] <= s {
            i += 1;
        }
        i
    }
}

/// One linear value along a segment, the interval of its function that it is in, and how far it has come.
///
/// Pieces of a segment are measured by values, not by shares of the segment: those of knots far nearer to each other than
/// to the segment's ends have no share that could be told as the difference of two.
pub(super) struct Track<'a, R> {
    knots: &'a Knots<R>,
    i: usize,
    front: R,
    back: R,
    pub(super) rise: R,
    /// The value so far, and whether it is one of the segment's ends or a knot, and not computed.
    pub(super) at: R,
    known: bool,
}

impl<'a, R: Real> Track<'a, R> {
    #[inline(always)]
    pub(super) fn new(knots: &'a Knots<R>, front: R, back: R) -> Self {
        let (mut i, rise) = (knots.interval(front), back - front);
        if rise == R::of(0.0) {
            i = knots.of_constant(i, front);
        }
        Track { knots, i, front, back, rise, at: front, known: true }
    }

    /// The knot that the value moves to.
    #[inline(always)]
    fn ahead(&self) -> R {
        self.knots.s[if self.rise > R::of(0.0) { self.i + 1 } else { self.i }]
    }

    /// Where the value leaves the interval, or the segment's end if that comes first, and whether it does.
    #[inline(always)]
    pub(super) fn next(&self) -> (R, bool) {
        let (ahead, zero) = (self.ahead(), R::of(0.0));
        let ends = if self.rise > zero { ahead >= self.back } else { self.rise == zero || ahead <= self.back };
        (if ends { self.back } else { ahead }, ends)
    }

    /// How much of the segment lies before the value `s`.
    #[inline(always)]
    pub(super) fn share_before(&self, s: R) -> R {
        if self.rise == R::of(0.0) { R::of(0.0) } else { (s - self.front) / self.rise }
    }

    /// Where in [0, 1] the value leaves the interval; above 1 if it does not.
    #[inline(always)]
    pub(super) fn end(&self) -> R {
        if self.rise == R::of(0.0) { R::of(2.0) } else { self.share_before(self.ahead()) }
    }

    /// The value at `u`, which is not beyond [`Self::end`], and whether it is known exactly.
    #[inline(always)]
    pub(super) fn value(&self, u: R, end: R) -> (R, bool) {
        if u >= R::of(1.0) {
            (self.back, true)
        } else if end <= u {
            (self.ahead(), true)
        } else {
            let (low, high) = (self.knots.s[self.i], self.knots.s[self.i + 1]);
            ((self.front + self.rise * u).max(low).min(high), false)
        }
    }

    /// The share of the segment from the value so far to `to`, if both are known exactly.
    #[inline(always)]
    pub(super) fn share_to(&self, (to, known): (R, bool)) -> Option<R> {
        (self.known && known && self.rise != R::of(0.0)).then(|| (to - self.at) / self.rise)
    }

    /// The function at `s`, by the line of the interval.
    #[inline(always)]
    pub(super) fn line(&self, s: R) -> [R; 4] {
        let offset = s - self.knots.s[self.i];
        let (value, slope) = (&self.knots.value[self.i], &self.knots.slope[self.i]);
        [0, 1, 2, 3].map(|k| value[k] + slope[k] * offset)
    }

    /// Moves on to a value, known exactly or not.
    #[inline(always)]
    pub(super) fn move_to(&mut self, (at, known): (R, bool)) {
        (self.at, self.known) = (at, known);
    }

    /// Steps to the next interval; false if there is none.
    #[inline(always)]
    pub(super) fn advance(&mut self) -> bool {
        if self.rise > R::of(0.0) {
            self.i += 1;
            self.i + 1 < self.knots.s.len()
        } else {
            self.i = self.i.wrapping_sub(1);
            self.i != usize::MAX
        }
    }
}

/// Which of its values a function has at a step.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Side {
    Below,
    Above,
    /// The greatest of all knots there, in the first channel.
    Densest,
}

/// The limit of the piecewise linear function through `knots` at `s`; outside them the end value, or 0 without `clamp`.
pub(super) fn sample<const N: usize>(knots: &[(f64, [f64; N])], clamp: bool, s: f64, side: Side) -> [f64; N] {
    let (below, above) = (knots.partition_point(|k| k.0 < s), knots.partition_point(|k| k.0 <= s));
    let above = match side {
        Side::Below => below,
        Side::Above => above,
        Side::Densest => match knots[below..above].iter().max_by(|a, b| a.1[0].total_cmp(&b.1[0])) {
            Some(k) => return k.1,
            None => above,
        },
    };
    match (above, knots) {
        (_, []) => [0.0; N],
        (0, [first, ..]) => first.1.map(|v| if clamp { v } else { 0.0 }),
        (i, [.., last]) if i == knots.len() => last.1.map(|v| if clamp { v } else { 0.0 }),
        (i, _) => {
            let ((s0, a), (s1, b)) = (knots[i - 1], knots[i]);
            let w = (s - s0) / (s1 - s0);
            std::array::from_fn(|k| a[k] + (b[k] - a[k]) * w)
        }
    }
}

/// The knots of `value` over the normalised scalar, at `places` in the field's own units; both limits at each.
pub(super) fn compile<R: Real>(
    mut places: Vec<f64>,
    normal: Normalization,
    value: impl Fn(f64, Side) -> [f64; 4],
) -> Knots<R> {
    places.sort_by(f64::total_cmp);
    places.dedup();
    let mut knots = Vec::with_capacity(2 * places.len());
    for s in places {
        let (x, below, above) = (normal.apply(s), value(s, Side::Below), value(s, Side::Above));
        let densest = value(s, Side::Densest);
        knots.push((x, below));
        if densest[0] > below[0].max(above[0]) {
            knots.push((x, densest));
        }
        if above != below || densest[0] > below[0] {
            knots.push((x, above));
        }
    }
    Knots::new(knots)
}

/// Extinction per world unit of length as a piecewise linear function of the field, by the transfer function's
/// convention; `opaque` on every stretch where opacity is 1 or more. A value that reaches 1 alone lets light through:
/// the logarithm's integral is finite there. Between its knots a logarithm has more, where opacity, on its way up, has risen by
/// `step`, and at the values `also`.
pub(super) fn extinction(
    transfer: &TransferFunction,
    opaque: f64,
    step: fn(f64) -> f64,
    also: &[f64],
) -> Vec<(f64, [f64; 1])> {
    let mut knots = transfer.opacity().to_vec();
    if transfer.convention() == Convention::Extinction {
        return knots.iter().map(|&(s, a)| (s, [transfer.extinction(a).min(opaque)])).collect();
    }
    let between = |s: f64| {
        let at = knots.partition_point(|k| k.0 < s);
        at > 0 && knots.get(at).is_some_and(|k| k.0 > s)
    };
    let mut added: Vec<f64> = also.iter().copied().filter(|&s| between(s)).collect();
    added.sort_by(f64::total_cmp);
    added.dedup();
    knots.extend(added.into_iter().map(|s| (s, transfer.opacity_at(s))));
    // Stable, so that knots at one place stay in sequence.
    knots.sort_by(|a, b| a.0.partial_cmp(&b.0).unwrap_or(std::cmp::Ordering::Equal));
    // On its way to 1: what lies beyond `OPAQUE` has no length that f32 could tell. Where the unit distance is tiny, all that
    // is not transparent is opaque.
    let tau = |a: f64| [(-(-a.min(OPAQUE)).ln_1p() / transfer.unit_distance()).min(opaque)];
    let mut curve = vec![];
    for w in knots.windows(2) {
        let [(s0, a0), (s1, a1)] = [w[0], w[1]];
        let (low, high) = (a0.min(a1), a0.max(a1));
        let place = |a: f64| s0 + (s1 - s0) * ((a - a0) / (a1 - a0));
        if low >= OPAQUE {
            curve.extend([(s0, [opaque]), (s1, [opaque])]);
            continue;
        }
        if a0 >= OPAQUE {
            curve.push((s0, [opaque]));
        }
        let mut rise: Vec<_> = std::iter::successors(Some(low), |&a| Some(a + step(a)))
            .take_while(|&a| a < high.min(OPAQUE))
            .chain([high.min(OPAQUE)])
            .map(|a| (place(a), tau(a)))
            .collect();
        if high > 1.0 {
            rise.extend([(place(1.0), tau(1.0)), (place(1.0), [opaque]), (place(high), [opaque])]);
        } else {
            rise.push((place(high), tau(high)));
        }
        if a1 < a0 {
            rise.reverse();
        }
        match s0 < s1 && a0 != a1 {
            true => curve.extend(rise),
            false => curve.extend([(s0, tau(a0)), (s1, tau(a1))]),
        }
    }
    // Beyond the outer knots their values hold: there an opaque one is a stretch.
    for (k, end) in [knots.first(), knots.last()].into_iter().enumerate() {
        if let Some(&(s, a)) = end {
            let value = if a >= OPAQUE { [opaque] } else { tau(a) };
            curve.insert(if k == 0 { 0 } else { curve.len() }, (s, value));
        }
    }
    curve
}

/// How far opacity may rise from `a` before the chord of −ln(1 − a) is off by 1e-5 of it.
pub(super) fn chord(a: f64) -> f64 {
    (0.9 * (8e-5 * -(-a).ln_1p()).sqrt() * (1.0 - a)).max(1.8e-5 * (1.0 - a))
}

/// How far opacity may rise from `a` on one part of a [`Curved`] function.
pub(super) fn part(a: f64) -> f64 {
    MOST_OF_PART * (1.0 - a)
}

/// The share of what is not opaque at the beginning of a part that is opaque at its end.
pub(crate) const MOST_OF_PART: f64 = 0.4;

/// A function under [`Convention::Opacity`]: between its knots (1 − a) is linear, of which extinction is the logarithm, and
/// falls to 1 − [`MOST_OF_PART`] of itself at most, but where it becomes opaque.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Curved<R> {
    pub(crate) knots: Knots<R>,
    /// The unit distance, normalised.
    pub(crate) unit: R,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opacity_convention_stays_near_its_logarithm() {
        let color = vec![(0.0, [1.0; 3])];
        let opacity = vec![(-1.0, 0.0), (0.0, 0.7), (0.5, 0.2), (0.9, 0.999)];
        let transfer = TransferFunction::new(color, opacity, 0.3).unwrap().with_convention(Convention::Opacity);
        let curve = extinction(&transfer, 1e15, chord, &[]);
        for i in 0..100_000 {
            let s = -1.0 + 1.9 * (f64::from(i) + 0.37) / 1e5;
            let (got, want) = (sample(&curve, true, s, Side::Above)[0], transfer.extinction(transfer.opacity_at(s)));
            assert!((got - want).abs() <= 1.01e-5 * want, "{s}: {got}, not {want}");
        }
    }
}
