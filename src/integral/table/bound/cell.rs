//! By how much a table is off between four neighbouring texels: `bound.rs` derives these formulas.

use super::function::{End, KnotInterval};
use std::f64::consts::E;

/// What is known of the segments between four values, two neighbours in front and two behind.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct TexelCell {
    /// What extinction is off and varies by, on average over a segment; and at most, relative to what hides there.
    gap: f64,
    shift: f64,
    gap_over: f64,
    shift_over: f64,
    /// What colours are off and vary by, at most.
    gap_colour: f64,
    shift_colour: f64,
    /// The greatest extinction around the segments, and from what to what extinction and colours go in them.
    most: f64,
    hull: [[f64; 2]; 4],
    /// Least and greatest mean extinction of a segment, by how much the texels differ in it, and by how much their mean
    /// is off.
    density: [f64; 2],
    spread: f64,
    off: f64,
    /// The two ends, and how many texels these are apart at least.
    ends: [End; 2],
    apart: f64,
    /// Colours are those of places along a segment, and not of values.
    weights: bool,
}

/// The cells of segments that have one end in interval `i`, and the other there or in a later one. `sums` are the
/// integrals of extinction up to each value.
pub(super) fn row<'a>(
    intervals: &'a [KnotInterval],
    sums: &'a [f64],
    i: usize,
) -> impl Iterator<Item = TexelCell> + 'a {
    let first = &intervals[i];
    let none = TexelCell { hull: [[f64::INFINITY, 0.0]; 4], ends: [first.end; 2], ..TexelCell::default() };
    let (mut gaps, mut shifts, mut so_far) = (0.0, 0.0, none);
    (i..intervals.len()).map(move |j| {
        let k = &intervals[j];
        (gaps, shifts) = (gaps + k.gap, shifts + k.shift);
        so_far.add(k);
        let apart = (j - i).saturating_sub(1) as f64;
        let mut cell = TexelCell { ends: [first.end, k.end], apart, ..so_far };
        (cell.gap, cell.shift) = (cell.gap.min(gaps / apart), cell.shift.min(shifts / apart));
        if i == j {
            // Nothing beyond the interval is seen.
            (cell.gap, cell.gap_colour, cell.most) = (k.own_gap, k.own_gap_colour, k.own[0][1]);
            cell.gap_over = if k.own_gap > 0.0 { k.own_gap / k.own[0][0] } else { 0.0 };
        }
        if j == i + 1 {
            cell.gap = cell.gap.min(first.own_gap + k.below[0] + k.own_gap);
            cell.gap_colour = cell.gap_colour.min(first.own_gap_colour + k.below[1] + k.own_gap_colour);
        }
        let [least, most] = cell.hull[0];
        (cell.density, cell.spread, cell.off) = (cell.hull[0], most - least, cell.gap.min(most - least));
        if j == i + 1 && first.own_gap == 0.0 && k.own_gap == 0.0 {
            // One kink between two lines: a quarter of what is seen at the worst place.
            cell.off = cell.off.min(k.kink / 4.0);
        }
        if apart > 0.0 {
            let mean = |a: usize, b: usize| (sums[j + b] - sums[i + a]) / (j + b - i - a) as f64;
            let corners = [mean(0, 0), mean(0, 1), mean(1, 0), mean(1, 1)];
            let [lo, hi] = corners.iter().fold([f64::INFINITY, 0.0], |[lo, hi]: [f64; 2], &v| [lo.min(v), hi.max(v)]);
            cell.spread = hi - lo;
            cell.off = cell.off.min((first.bend + k.bend + cell.spread / 8f64.sqrt()) / apart);
            cell.density = [(lo - cell.off).max(least), (hi + cell.off).min(most)];
        }
        cell
    })
}

impl TexelCell {
    /// The same of weights: a colour goes from 0 to 1 along each segment.
    pub(super) fn of_weights(self) -> Self {
        let [density, ..] = self.hull;
        let hull = [density, [0.0, 1.0], [0.0, 1.0], [0.0, 1.0]];
        TexelCell { hull, gap_colour: 0.0, shift_colour: 0.0, weights: true, ..self }
    }

    fn add(&mut self, k: &KnotInterval) {
        let over = |x: f64| if x > 0.0 { x / k.least } else { 0.0 };
        (self.gap, self.shift) = (self.gap.max(k.gap), self.shift.max(k.shift));
        (self.gap_over, self.shift_over) = (self.gap_over.max(over(k.gap)), self.shift_over.max(over(k.shift)));
        self.gap_colour = self.gap_colour.max(k.gap_colour);
        self.shift_colour = self.shift_colour.max(k.shift_colour);
        self.most = self.most.max(k.most);
        for (hull, own) in self.hull.iter_mut().zip(&k.own) {
            *hull = [hull[0].min(own[0]), hull[1].max(own[1])];
        }
    }

    /// What colours differ by at most.
    fn contrast(&self) -> f64 {
        self.hull[1..].iter().fold(0.0, |m: f64, [lo, hi]| m.max(hi - lo))
    }

    /// The greatest colour.
    fn brightest(&self) -> f64 {
        self.hull[1..].iter().fold(0.0, |m: f64, c| m.max(c[1]))
    }

    /// The greatest opacity of segments up to `l` long.
    fn alpha(&self, l: f64) -> f64 {
        -(-l * self.density[1]).exp_m1()
    }

    /// Of premultiplied colours and opacities of segments up to `l` long.
    pub(super) fn premultiplied(&self, l: f64) -> f64 {
        let (deepest, shift) = (l * self.most, l * self.shift);
        let twice = 1.0 + deepest.min(1.0);
        let first = twice * (l * self.gap).min(self.gap_over);
        let second = 9.0 / 32.0 * (twice * shift * shift).min(4.0 * self.shift_over * self.shift_over);
        let together = (1.0 + deepest.min(1.0 + self.shift_over)) / 4.0 * shift.min(self.shift_over);
        let opacity = self.opacity(l) + self.curve(l);
        let sum = self.contrast() / 2.0 * (first + second)
            + self.alpha(l) * self.gap_colour
            + self.shift_colour * together
            + self.brightest().max(1.0) * opacity;
        sum.min(self.differ(l))
    }

    /// The same where emission is not multiplied by extinction.
    pub(super) fn emitted(&self, l: f64) -> f64 {
        let ([least, densest], shift) = (self.hull[0], l * self.shift);
        let seen = through(least, l);
        let brightest = self.brightest();
        let sum = brightest * (l * self.gap + shift * shift / 8.0) + self.gap_colour + self.shift_colour * shift / 4.0;
        let differ = |c: &[f64; 2]| c[1] * seen - c[0] * through(densest, l);
        let colour = self.hull[1..].iter().map(differ).fold(0.0, f64::max).min(seen * sum);
        let opacity = (self.opacity(l) + self.curve(l)).min(differ_by(self.hull[0], [1.0; 2], l));
        colour.max(opacity)
    }

    /// Of colours and opacities from a mean extinction and a mean colour, which along the length is off by `lengths`
    /// (of a depth) of what it varies by, and which stretches that (1 + `beyond`)-fold at most.
    pub(super) fn normalised(&self, l: f64, lengths: impl Fn(f64) -> f64, beyond: f64) -> f64 {
        let (seen, of_length) = (self.alpha(l) * self.contrast(), lengths(l * self.density[1]));
        let (of_length, beyond) = (seen * of_length.min(1.0 + beyond), seen * of_length.min(beyond));
        let colour = (self.of_values(l) + of_length).min(seen + beyond);
        (colour + self.brightest().max(1.0) * self.opacity(l)).min(self.differ(l) + beyond)
    }

    /// Of the mean colour Ĉ along the values, times the opacity that it counts with.
    fn of_values(&self, l: f64) -> f64 {
        let (contrast, depth, over) = (self.contrast(), l * self.density[1], self.shift_over);
        let by = 1.0 + deviation(depth);
        let weights = by * self.gap_over / 2.0 + 9.0 / 32.0 * (by * over).powi(2);
        let between = self.gap_colour + contrast * weights + 9.0 / 16.0 * by * over * self.shift_colour;
        let bent = if self.weights { f64::INFINITY } else { self.bent(depth) };
        // Without extinction there is neither.
        [between, bent].iter().fold(contrast, |m, &v| if v < m { v } else { m }) * self.alpha(l)
    }

    /// Of Ĉ, by its second derivatives by its ends, `depth` being the greatest.
    fn bent(&self, depth: f64) -> f64 {
        let (d, contrast, thin) = (self.apart, self.contrast(), depth.min(1.0));
        let of_length = (4.0 / (E * E) + 2.0 / E) * thin / (d * d);
        let share = |of: f64| of / (self.density[0] * d);
        let one_way = |front: &End, back: &End| {
            let (r, bend) = (share(back.most), share(back.slope));
            let behind = back.slope_colour * r + contrast * (2.0 * r * r + bend + 2.04 * r / d * thin + of_length);
            let (r, bend, seen) = (share(front.most), share(front.slope), 1.0 + depth);
            let moved = 2.0 * r / d * ((depth / 8.0).min(1.0 / E) * seen + depth);
            let before = front.slope_colour * r * seen
                + contrast * (r * r * (1.0 + seen * seen) + bend * seen + moved + of_length);
            (behind + before) / 8.0
        };
        let [a, b] = &self.ends;
        one_way(a, b).max(one_way(b, a))
    }

    /// Of an opacity from the mean extinction.
    fn opacity(&self, l: f64) -> f64 {
        let least = self.density[0];
        let error = if least * l > 1.0 { self.off / (E * least) } else { self.off * l * (-l * least).exp() };
        error.min(1.0)
    }

    /// Of a mean of opacities, beyond that.
    fn curve(&self, l: f64) -> f64 {
        let least = self.density[0];
        let l = if least * l > 2.0 { 2.0 / least } else { l };
        ((self.spread * l).powi(2) / 8.0 * (-l * least).exp()).min(1.0)
    }

    /// By how much premultiplied colours and opacities of any two segments differ.
    fn differ(&self, l: f64) -> f64 {
        let [density, colours @ ..] = &self.hull;
        colours.iter().fold(differ_by(*density, [1.0; 2], l), |m, c| m.max(differ_by(*density, *c, l)))
    }
}

/// (1 − e^{−lρ})/ρ: how much of the length `l` is seen.
fn through(density: f64, l: f64) -> f64 {
    if l * density > 1e-9 { -(-l * density).exp_m1() / density } else { l }
}

/// Of the depth, where what is seen at a depth D counts e^{−D}, up to X in all: √(1 − (½X/sinh ½X)²).
fn deviation(depth: f64) -> f64 {
    let half = depth / 2.0;
    if half > 1e-3 { (1.0 - (half / half.sinh()).powi(2)).sqrt() } else { depth / 12f64.sqrt() }
}

/// sup over lengths up to `longest` of κ₁ (1 − e^{−lρ₁}) − κ₀ (1 − e^{−lρ₀}).
fn differ_by([low, high]: [f64; 2], [dim, bright]: [f64; 2], longest: f64) -> f64 {
    let steepest = [dim * low, bright * high];
    let l = match steepest[0] > 0.0 && high > low {
        true => ((steepest[1] / steepest[0]).ln() / (high - low)).min(longest),
        false => longest,
    };
    dim * (-l * low).exp_m1() - bright * (-l * high).exp_m1()
}
