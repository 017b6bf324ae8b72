//! How far a uniform [`Table`](super::Table) of n × n values and some lengths may be off between its texels: a bound on the greatest
//! error of any channel, from the function and the size alone.
//!
//! A linear filter weighs the eight texels around a segment. Along the length, opacity is 1 − e^{−lρ̂}, whose chord over Δl is off by at
//! most φ(ρ Δl), φ(x) = max_u (1 − e^{−xu}) − u (1 − e^{−x}), with the greatest ρ. Colour is C = ∫ κ dA over the opacity A gathered so
//! far, and what is off of A grows with the extinction gathered, so C is off by at most that times the greatest κ.
//!
//! Along the values, the scalar of the four segments around is on average that of the segment meant. Their mean of a function that is
//! linear is so too; at a kink it is off by at most a quarter of the change of slope per texel (Peano's kernel), at a step by its height,
//! and never by more than the function varies over three texels: the *gap* g of ρ, and of κ. A *shift* o is how much the function varies
//! over one texel. Means over a segment have bars; sums over it grow like l ḡ while little is hidden, and end at g/ρ, as what hides is
//! ρ itself. With κ₀ the greatest colour (at least 1), from C − C̄ = Σ w (κ − κ̄)(dA − dĀ) + (κ̄ − κ) dĀ + κ (dĀ − dA), a cell is off by at most
//!
//! - q κ₀ min(l ḡ, g/ρ) as the extinction is off, and of that q κ₀ (l ō)²/4 e^{−lρ̂} more as the exponential is curved;
//! - q g_κ min(1, l ρ) as the colour is off;
//! - ½ q o_κ min(l ō, o/ρ, 1) as both vary together,
//!
//! where q = 1 + min(1, l ρ): what is off of the extinction is itself hidden, wrongly. It is the worst case of where knots are between texels;
//! where they are at texels, as of a function that has as many entries as the table has values, errors are some 30 times less.

use super::{is_scalar, volume::Table};
use crate::integral::{Exact, Knots};

/// What is known of the function between two values, and around them.
#[derive(Debug, Clone, Copy, Default)]
struct Interval {
    gap: f64,
    shift: f64,
    gap_colour: f64,
    shift_colour: f64,
    least: f64,
    most: f64,
}

/// The greatest error of a chord of 1 − e^{−x}, relative to 1.
fn chord(x: f64) -> f64 {
    if x < 1e-6 {
        return x * x / 8.0;
    }
    let whole = -(-x).exp_m1();
    // Where the slope of the curve is that of the chord.
    let u = (x / whole).ln() / x;
    -(-x * u).exp_m1() - u * whole
}

/// (0, 1] of it: sup over lengths up to `longest` of l² e^{−lρ}.
fn curved(density: f64, longest: f64) -> f64 {
    let l = if density * longest > 2.0 { 2.0 / density } else { longest };
    l * l * (-l * density).exp()
}

/// A bound on the error of a uniform table of `values`² × `slices` texels for segments of up to `longest` normalised units, looked up
/// anywhere. `None` for fields of several components, for direct emission, which has no greatest colour, and for less than 3 values.
pub fn bound(exact: &Exact<f64>, values: u32, slices: u32, longest: f64) -> Option<f64> {
    let [of_values, of_lengths, most] = bounds(exact, values, slices, longest)?;
    Some((of_values + of_lengths).min(most))
}

/// The smallest powers of 2, of at most 256 values and 128 lengths, whose bounds are half of `error` each; the greatest where none is.
/// `None` as [`bound`].
pub fn size(exact: &Exact<f64>, longest: f64, error: f64) -> Option<[u32; 3]> {
    let find = |least: u32, most: u32, which: usize| -> Option<u32> {
        let mut n = least;
        while n < most && bounds(exact, if which == 0 { n } else { 16 }, n, longest)?[which] > error / 2.0 {
            n *= 2;
        }
        Some(n)
    };
    let (n, slices) = (find(16, 256, 0)?, find(8, 128, 1)?);
    Some([n, n, slices])
}

/// The bound along the values, that along the lengths, and the greatest value that there is.
fn bounds(exact: &Exact<f64>, values: u32, slices: u32, longest: f64) -> Option<[f64; 3]> {
    if !is_scalar(exact) || exact.direct || values < 3 || slices < 2 {
        return None;
    }
    let n = values as usize - 1;
    let greatest = |c: usize| exact.opacity.value.iter().fold(0.0f64, |m, v| m.max(v[c]));
    let brightest = greatest(1).max(greatest(2)).max(greatest(3)).max(1.0);
    let of_lengths = brightest * chord(greatest(0) * longest / f64::from(slices - 1));
    let intervals = intervals(&exact.opacity, n);
    let mut worst = 0.0f64;
    for i in 0..n {
        let (mut gaps, mut shifts) = (0.0, 0.0);
        let mut most = Interval { least: f64::INFINITY, ..Interval::default() };
        let (mut over, mut shift_over, mut colour) = (0.0f64, 0.0f64, 0.0f64);
        for (j, k) in (i..n).map(|j| (j, &intervals[j])) {
            let ratio = |x: f64| if x > 0.0 { x / k.least } else { 0.0 };
            (gaps, shifts) = (gaps + k.gap, shifts + k.shift);
            (most.gap, most.shift) = (most.gap.max(k.gap), most.shift.max(k.shift));
            (over, shift_over) = (over.max(ratio(k.gap)), shift_over.max(ratio(k.shift)));
            (most.least, most.most) = (most.least.min(k.least), most.most.max(k.most));
            most.shift_colour = most.shift_colour.max(k.shift_colour);
            colour = colour.max(k.gap_colour * (longest * k.most).min(1.0));
            // Segments of the cell are at least so many texels long, and lie in these intervals.
            let apart = (j - i).saturating_sub(1) as f64;
            let (gap, shift) = (most.gap.min(gaps / apart), most.shift.min(shifts / apart));
            let curve = (shift * shift / 4.0 * curved(most.least, longest)).min(1.0);
            let hidden = 1.0 + (longest * most.most).min(1.0);
            let sum = hidden * brightest * ((longest * gap).min(over) + curve)
                + hidden * colour
                + hidden / 2.0 * most.shift_colour * (longest * shift).min(shift_over).min(1.0);
            worst = worst.max(sum);
        }
    }
    Some([worst, of_lengths, brightest])
}

/// What bounds need to know of the `n` intervals.
fn intervals(knots: &Knots<f64>, n: usize) -> Vec<Interval> {
    // Of all channels: kinks and steps inside of an interval and at its lower end, the greatest slope, least and most.
    let mut inside = vec![[0.0f64; 4]; n];
    let mut at_end = vec![[0.0f64; 4]; n];
    let mut steep = vec![[0.0f64; 4]; n];
    let mut range = vec![[[f64::INFINITY, f64::NEG_INFINITY]; 4]; n];
    let per_texel = 2.0 / n as f64;
    let place = |s: f64| (s + 1.0) / per_texel;
    for (k, s) in knots.s.windows(2).enumerate() {
        let [x0, x1] = [s[0], s[1]].map(|s| place(s.clamp(-1.0, 1.0)));
        let value = |c: usize, x: f64| knots.value[k][c] + knots.slope[k][c] * (x * per_texel - 1.0 - s[0]);
        for i in (x0 as usize)..(x1.ceil() as usize).min(n) {
            let ends = [x0.max(i as f64), x1.min(i as f64 + 1.0)];
            for c in (0..4).filter(|_| ends[0] < ends[1]) {
                for v in ends.map(|x| value(c, x)) {
                    range[i][c] = [range[i][c][0].min(v), range[i][c][1].max(v)];
                }
                steep[i][c] = steep[i][c].max((knots.slope[k][c] * per_texel).abs());
            }
        }
        if k == 0 || s[0] <= -1.0 || s[0] >= 1.0 {
            continue;
        }
        let node = (x0 - x0.round()).abs() < 1e-9;
        let of = if node { &mut at_end[(x0.round() as usize).min(n - 1)] } else { &mut inside[x0 as usize] };
        for (c, of) in of.iter_mut().enumerate() {
            *of += match s[0] < s[1] {
                true => ((knots.slope[k][c] - knots.slope[k - 1][c]) * per_texel).abs() / 4.0,
                false => {
                    (knots.value[k + 1][c] - knots.value[k][c]).abs() + (knots.slope[k - 1][c] * per_texel).abs() / 4.0
                }
            };
        }
    }
    let interval = |i: usize| {
        let around = i.saturating_sub(1)..(i + 2).min(n);
        let hull = |c: usize| {
            let ranges = around.clone().map(|k| range[k][c]);
            ranges.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], [a, b]| [lo.min(a), hi.max(b)])
        };
        let gap = |c: usize| {
            let between: f64 = around.clone().skip(usize::from(i > 0)).map(|k| at_end[k][c]).sum();
            let [lo, hi] = hull(c);
            (around.clone().map(|k| inside[k][c]).sum::<f64>() + between).min(hi - lo)
        };
        let shift = |c: usize| {
            let [lo, hi] = hull(c);
            let steps: f64 = around.clone().map(|k| inside[k][c] + at_end[k][c]).sum();
            (around.clone().fold(0.0f64, |m, k| m.max(steep[k][c])) + steps).min(hi - lo)
        };
        let colours = |of: &dyn Fn(usize) -> f64| (1..4).map(of).fold(0.0, f64::max);
        let [least, most] = hull(0);
        let (gap_colour, shift_colour) = (colours(&gap), colours(&shift));
        Interval { gap: gap(0), shift: shift(0), gap_colour, shift_colour, least, most }
    };
    (0..n).map(interval).collect()
}

impl Table {
    /// [`bound`] of a table of this size.
    pub fn bound(&self, exact: &Exact<f64>) -> Option<f64> {
        (self.kind == super::Kind::Uniform && self.size[0] == self.size[1])
            .then(|| bound(exact, self.size[0], self.size[2], self.longest))
            .flatten()
    }
}
