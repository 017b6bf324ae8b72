//! How far tables may be off between their texels: bounds on the greatest error of any channel, from the function and
//! the size alone.
//!
//! A linear filter weighs the texels around a segment. *Along the values*, the scalar of the four segments around is on
//! average that of the segment meant. Their mean of a function that is linear is so too; at a kink it is off by at most
//! a quarter of the change of slope per texel (Peano's kernel), at a step by its height, and never by more than the
//! function varies over three texels: the *gap* g of ρ, and of κ. A *shift* o is how much the function varies over one
//! texel. Means over a segment have bars; sums over it grow like l ḡ while little is hidden, and end at g/ρ, as what
//! hides is ρ itself. All is found for each cell of four texels, of which that counts which says most.
//!
//! **A uniform volume** keeps premultiplied colour C = ∫ κ dA, over the opacity A gathered so far. With κ₀ the greatest
//! colour (at least 1), from C − C̄ = Σ w (κ − κ̄)(dA − dĀ) + (κ̄ − κ) dĀ + κ (dĀ − dA), a cell is off by at most
//!
//! - q κ₀ min(l ḡ, g/ρ) as the extinction is off, and of that q κ₀ (l ō)²/4 e^{−lρ̂} more as the exponential is curved;
//! - q g_κ min(1, l ρ) as the colour is off;
//! - ½ q o_κ min(l ō, o/ρ, 1) as both vary together,
//!
//! where q = 1 + min(1, l ρ): what is off of the extinction is itself hidden, wrongly. And segments whose scalars stay
//! where ρ and κ are within ρ₀ … ρ₁ and κ₀ … κ₁ differ by no more than κ₁ (1 − e^{−lρ₁}) − κ₀ (1 − e^{−lρ₀}): near the
//! diagonal this tells a function of many knots, a peak or a step. Along the length, opacity is 1 − e^{−lρ̂}, whose
//! chord over Δl is off by at most φ(ρ Δl), φ(x) = max_u (1 − e^{−xu}) − u (1 − e^{−x}), with the greatest ρ, and C by
//! at most that times the greatest κ.
//!
//! **Normalised tables** keep ρ̂ and Ĉ = C/α. Of ρ̂ = (R(s_b) − R(s_f))/(s_b − s_f), R = ∫ρ, the numerator is a sum of
//! functions of one value each, whose chords are off by ε ≤ ¼ of what ρ varies over the texel (⅛ where it is linear):
//! what lies between the ends does not count. So E[ρ̂] is off by at most (ε_f + ε_b + r/√8)/d, d the least distance of
//! the values in texels and r what ρ̂ varies over the cell: the last is the covariance of ρ̂ and d. From an error δ of
//! ρ̂ ≥ ρ₀, opacity is off by at most e^{−lρ₀} − e^{−l(ρ₀+δ)}.
//!
//! Where one kink, of a change of slope σ per texel, is between two neighbouring intervals, E[ρ̂] is off by σ/16 at
//! most.
//!
//! Ĉ is a mean of κ, and so off by no more than κ varies over the cell. Its weights p = lρ e^{−D}/α are off by ∫|p −
//! p̄| ≤ (q + 1) l ō/α one by one, and on average by that of the gap and (1.5 + (q + 1)/α)(l ō)²; the first counts
//! times the shift of κ, the second times half of what κ varies by over the segment, as a constant is seen as it is.
//! All of it counts times α. Or else Ĉ = ∫ κ ρ e^{−λR} ds / ∫ ρ e^{−λR} ds over the values, λ = l/(s_b − s_f), of which
//! only the ends and λ move: an error of ⅛ of both second derivatives, which follow from ∂Ĉ/∂s_b = (κ_b − Ĉ) h, h =
//! λρ_b/(e^X − 1), ∂Ĉ/∂s_f = (Ĉ − κ_f) h, h = λρ_f/(1 − e^{−X}), and λ ∂Ĉ/∂λ = X dĈ/dX (below). With r = ρ/(ρ̂ d) at an
//! end and r′ = ρ′/(ρ̂ d), h ≤ r and |∂h/∂s_b| ≤ r′ + r² behind; h ≤ r (1 + X) and |∂h/∂s_f| ≤ r′ (1 + X) + r² in
//! front.
//!
//! Along the length, Ĉ depends on the depth X = lρ̂ alone: with z the share of the depth it is ∫ κ X e^{−Xz}/(1 −
//! e^{−X}) dz, of which the factor's m-th derivative at X = 0 is, but for its sign, the Bernoulli polynomial B_m(z),
//! and less beyond; so |dᵐĈ/dXᵐ| ≤ ½ ∫|B_m| of what κ varies by. *Polynomials* of degree n through equal distances are
//! off by that for m = n + 1 times max|Π (X − X_k)|/(n + 1)!, and by no more than (1 + Λ)/2 of what κ varies by, Λ
//! their Lebesgue constant; what is off of the values counts Λ times. *Logarithmic* lengths are linear over an octave:
//! ⅛ of the second derivative by log₂ l, ln²2 (X² Ĉ″ + X Ĉ′), where X Ĉ′ ≤ 1/e and X² Ĉ″ ≤ 4/e² of what κ varies by.

use super::volume::{Kind, Table};
use super::{Polynomial, is_scalar};
use crate::integral::{Exact, Knots};

/// Errors of rounding texels to f32 and of what builds them, relative to the greatest colour.
const ROUNDING: f64 = 2e-6;

/// For degrees from 1: ½ ∫|B_{n+1}| max|Π (x − i/n)|/(n + 1)!, and the Lebesgue constant of n + 1 points at equal
/// distances.
const DEGREES: [[f64; 2]; 8] = [
    [4.010e-3, 1.0],
    [1.253e-4, 1.25],
    [5.033e-6, 1.6312],
    [2.309e-7, 2.2079],
    [1.119e-8, 3.1064],
    [5.640e-10, 4.5494],
    [2.914e-11, 6.9298],
    [1.533e-12, 10.9457],
];

/// What is known of the function between two values, and around them.
#[derive(Debug, Clone, Copy, Default)]
struct Interval {
    gap: f64,
    shift: f64,
    gap_colour: f64,
    shift_colour: f64,
    least: f64,
    most: f64,
    /// Between the two values themselves: gaps, and from what to what extinction and colours go.
    own_gap: f64,
    own_gap_colour: f64,
    own: [[f64; 2]; 4],
    /// By how much the chord of the integral of extinction is off, and its rise.
    bend: f64,
    rise: f64,
    end: End,
    /// The kink of extinction at the lower value, a quarter of its change of slope per texel; endless if it is a step.
    /// And gaps there.
    kink: f64,
    between: [f64; 2],
}

/// What is known of the function where segments of a cell end: the greatest extinction, and slopes of extinction and
/// colours per texel, endless if there is a step.
#[derive(Debug, Clone, Copy, Default)]
struct End {
    most: f64,
    slope: f64,
    slope_colour: f64,
}

/// What is known of the segments between four values, two neighbours in front and two behind.
struct Cell {
    gap: f64,
    shift: f64,
    gap_colour: f64,
    shift_colour: f64,
    /// The greatest gap and shift relative to what hides there.
    over: f64,
    shift_over: f64,
    least: f64,
    most: f64,
    /// From what to what extinction and colours go in all of it.
    hull: [[f64; 2]; 4],
    /// Least and greatest mean extinction of a segment, by how much the texels differ in it, and by how much their mean
    /// is off.
    density: [f64; 2],
    spread: f64,
    off: f64,
    /// Its two ends, and how many texels these are apart at least.
    ends: [End; 2],
    apart: f64,
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

/// sup over lengths up to `longest` of κ₁ (1 − e^{−lρ₁}) − κ₀ (1 − e^{−lρ₀}).
fn apart([low, high]: [f64; 2], [dim, bright]: [f64; 2], longest: f64) -> f64 {
    let steepest = [dim * low, bright * high];
    let l = match steepest[0] > 0.0 && high > low {
        true => ((steepest[1] / steepest[0]).ln() / (high - low)).min(longest),
        false => longest,
    };
    dim * (-l * low).exp_m1() - bright * (-l * high).exp_m1()
}

impl Cell {
    /// What colours of the hull differ by at most.
    fn contrast(&self) -> f64 {
        self.hull[1..].iter().fold(0.0, |m: f64, [lo, hi]| m.max(hi - lo))
    }

    /// The error of premultiplied colour and opacity along the values, for lengths up to `longest` and colours up to
    /// `brightest`, unless it is below `enough`.
    fn published(&self, longest: f64, brightest: f64, enough: f64) -> f64 {
        let curve = (self.shift * self.shift / 4.0 * curved(self.least, longest)).min(1.0);
        let hidden = 1.0 + (longest * self.most).min(1.0);
        let sum = hidden * brightest * ((longest * self.gap).min(self.over) + curve)
            + hidden * self.gap_colour * (longest * self.most).min(1.0)
            + hidden / 2.0 * self.shift_colour * (longest * self.shift).min(self.shift_over).min(1.0);
        if sum <= enough {
            return sum;
        }
        // As of normalised tables; the filter's mean of αĈ is not that of α times that of Ĉ, and that of e^{−lρ̂} is
        // curved.
        let depth = longest * self.density[1];
        let curve = (self.spread * self.spread / 8.0 * curved(self.density[0], longest)).min(1.0);
        let mixed = self.of_values(longest) + self.moved(depth) / 4.0 * (longest * self.spread).min(1.0);
        sum.min(self.hulls(longest)).min(mixed + brightest * (self.opacity(longest) + curve))
    }

    /// By how much segments of the hull differ, of lengths up to `longest`.
    fn hulls(&self, longest: f64) -> f64 {
        let [density, colours @ ..] = &self.hull;
        colours.iter().fold(apart(*density, [1.0; 2], longest), |m, c| m.max(apart(*density, *c, longest)))
    }

    /// The error of an opacity from the mean extinction.
    fn opacity(&self, longest: f64) -> f64 {
        let least = self.density[0];
        let error = match least * longest > 1.0 {
            true => self.off / (std::f64::consts::E * least),
            false => self.off * longest * (-longest * least).exp(),
        };
        error.min(1.0)
    }

    /// By how much Ĉ differs over the cell, by its first derivatives.
    fn moved(&self, depth: f64) -> f64 {
        let share = |end: &End| end.most / (self.density[0] * self.apart);
        let ends = self.ends.iter().map(share).sum::<f64>() * (1.0 + depth);
        let lengths = 2.0 * (depth / 8.0).min(1.0 / std::f64::consts::E) / self.apart;
        let all = ends + lengths;
        self.contrast() * if all < 1.0 { all } else { 1.0 }
    }

    /// Between texels, by how much the mean of Ĉ is off of which the second derivatives by its ends are known, `depth`
    /// being the greatest.
    fn bent(&self, depth: f64) -> f64 {
        let (d, contrast, thin) = (self.apart, self.contrast(), depth.min(1.0));
        let e = std::f64::consts::E;
        let of_length = (4.0 / (e * e) + 2.0 / e) * thin / (d * d);
        let share = |of: f64| of / (self.density[0] * d);
        let one_way = |front: &End, back: &End| {
            let (r, bend) = (share(back.most), share(back.slope));
            let behind = back.slope_colour * r + contrast * (2.0 * r * r + bend + 2.04 * r / d * thin + of_length);
            let (r, bend, seen) = (share(front.most), share(front.slope), 1.0 + depth);
            let moved = 2.0 * r / d * ((depth / 8.0).min(1.0 / e) * seen + depth);
            let before = front.slope_colour * r * seen
                + contrast * (r * r * (1.0 + seen * seen) + bend * seen + moved + of_length);
            (behind + before) / 8.0
        };
        let [a, b] = &self.ends;
        one_way(a, b).max(one_way(b, a))
    }

    /// By how much the mean of Ĉ is off between texels, times the opacity that it counts with.
    fn of_values(&self, longest: f64) -> f64 {
        let ([least, densest], contrast) = (self.density, self.contrast());
        let alpha = (longest * densest).min(1.0);
        let hidden = 2.0 + alpha;
        let seen = -(-longest * least).exp_m1();
        let (gap, shift) = ((longest * self.gap).min(self.over), (longest * self.shift).min(self.shift_over));
        let weights = hidden * gap + (1.5 + hidden / seen) * shift * shift;
        let by_weights = alpha * self.gap_colour
            + (1.0 + self.off / least) * (self.shift_colour * hidden * shift + contrast / 2.0 * weights);
        let by_ends = alpha * self.bent(longest * densest);
        // Without extinction there is neither.
        [by_weights, by_ends].iter().fold(alpha * contrast, |m, &v| if v < m { v } else { m })
    }

    /// The error of colour and opacity from a mean extinction and a mean colour, which along the length is off by
    /// `lengths` (of a depth) of what it varies by, and through whose points it goes with a Lebesgue constant of
    /// `times`.
    fn normalised(&self, longest: f64, lengths: impl Fn(f64) -> f64, times: f64) -> f64 {
        let (depth, contrast, opacity) = (longest * self.density[1], self.contrast(), self.opacity(longest));
        let (alpha, of_values) = (depth.min(1.0), self.of_values(longest));
        let of_points = (times * of_values).min(of_values + times * alpha * contrast * depth / 4.0);
        let most = ((1.0 + times) / 2.0).min(1.0 + (1.0 + times) * depth / 8.0);
        let colour = (of_points + alpha * contrast * lengths(depth)).min(alpha * contrast * most);
        let brightest = self.hull[1..].iter().fold(1.0, |m: f64, c| m.max(c[1]));
        // Polynomials leave the hull of the colours.
        let beyond = alpha * contrast * ((times - 1.0) / 2.0).min(times * depth / 8.0);
        (colour + brightest * opacity).min(self.hulls(longest) + beyond)
    }
}

/// The greatest of `error`, which is told the greatest so far, over the cells of a table of `values`², as far as one is
/// beyond `limit`; and the greatest colour, at least 1.
fn worst(exact: &Exact<f64>, values: u32, limit: f64, mut error: impl FnMut(&Cell, f64) -> f64) -> Option<[f64; 2]> {
    if !is_scalar(exact) || exact.direct || values < 3 {
        return None;
    }
    let n = values as usize - 1;
    let intervals = intervals(&exact.opacity, n);
    let mut sums = vec![0.0];
    intervals.iter().for_each(|k| sums.push(sums[sums.len() - 1] + k.rise));
    let brightest = (1..4).flat_map(|c| exact.opacity.value.iter().map(move |v| v[c])).fold(1.0, f64::max);
    let mut greatest = 0.0f64;
    for i in 0..n {
        if greatest > limit {
            break;
        }
        let (mut gaps, mut shifts) = (0.0, 0.0);
        let mut most = Interval { least: f64::INFINITY, own: [[f64::INFINITY, 0.0]; 4], ..Interval::default() };
        let (mut over, mut shift_over) = (0.0f64, 0.0f64);
        for (j, k) in (i..n).map(|j| (j, &intervals[j])) {
            let ratio = |x: f64| if x > 0.0 { x / k.least } else { 0.0 };
            (gaps, shifts) = (gaps + k.gap, shifts + k.shift);
            (most.gap, most.shift) = (most.gap.max(k.gap), most.shift.max(k.shift));
            (over, shift_over) = (over.max(ratio(k.gap)), shift_over.max(ratio(k.shift)));
            (most.least, most.most) = (most.least.min(k.least), most.most.max(k.most));
            most.gap_colour = most.gap_colour.max(k.gap_colour);
            most.shift_colour = most.shift_colour.max(k.shift_colour);
            for (hull, own) in most.own.iter_mut().zip(&k.own) {
                *hull = [hull[0].min(own[0]), hull[1].max(own[1])];
            }
            // Segments of the cell are at least so many texels long, and lie in these intervals.
            let apart = (j - i).saturating_sub(1) as f64;
            let mut cell = Cell {
                gap: most.gap.min(gaps / apart),
                shift: most.shift.min(shifts / apart),
                gap_colour: most.gap_colour,
                shift_colour: most.shift_colour,
                over,
                shift_over,
                least: most.least,
                most: most.most,
                hull: most.own,
                density: most.own[0],
                spread: most.own[0][1] - most.own[0][0],
                off: 0.0,
                ends: [intervals[i].end, k.end],
                apart,
            };
            if i == j {
                // Nothing beyond the interval is seen.
                (cell.gap, cell.gap_colour, cell.least, cell.most) =
                    (k.own_gap, k.own_gap_colour, k.own[0][0], k.own[0][1]);
                cell.over = if k.own_gap > 0.0 { k.own_gap / k.own[0][0] } else { 0.0 };
            }
            if j == i + 1 {
                let before = &intervals[i];
                cell.gap = cell.gap.min(before.own_gap + k.between[0] + k.own_gap);
                cell.gap_colour = cell.gap_colour.min(before.own_gap_colour + k.between[1] + k.own_gap_colour);
            }
            cell.off = cell.gap.min(cell.hull[0][1] - cell.hull[0][0]);
            if j == i + 1 && intervals[i].own_gap == 0.0 && k.own_gap == 0.0 {
                // One kink between two lines: a quarter of what is seen at the worst place.
                cell.off = cell.off.min(k.kink / 4.0);
            }
            if apart > 0.0 {
                let mean = |a: usize, b: usize| (sums[j + b] - sums[i + a]) / (j + b - i - a) as f64;
                let corners = [mean(0, 0), mean(0, 1), mean(1, 0), mean(1, 1)];
                let [lo, hi] =
                    corners.iter().fold([f64::INFINITY, 0.0], |[lo, hi]: [f64; 2], &v| [lo.min(v), hi.max(v)]);
                cell.off = cell.off.min((intervals[i].bend + k.bend + (hi - lo) * 8f64.sqrt().recip()) / apart);
                cell.spread = hi - lo;
                cell.density = [(lo - cell.off).max(cell.density[0]), (hi + cell.off).min(cell.density[1])];
            }
            greatest = greatest.max(error(&cell, greatest));
        }
    }
    Some([greatest, brightest])
}

/// A bound on the error of a uniform table of `values`² × `slices` texels for segments of up to `longest` normalised
/// units, looked up anywhere. `None` for fields of several components, for direct emission, which has no greatest
/// colour, and for less than 3 values.
pub fn bound(exact: &Exact<f64>, values: u32, slices: u32, longest: f64) -> Option<f64> {
    let [of_values, brightest] = along_values(exact, values, longest, f64::INFINITY)?;
    Some((of_values + along_lengths(exact, slices, longest, brightest) + ROUNDING * brightest).min(brightest))
}

/// The same for [`Polynomial`]s of `degree`, 1 to 8, and `values`² texels.
pub fn bound_of_polynomial(exact: &Exact<f64>, degree: u32, values: u32, longest: f64) -> Option<f64> {
    of_polynomial(exact, degree, values, longest, f64::INFINITY)
}

/// The same for logarithmic lengths, normalised: [`Kind::LogNormalised`], of `values`² × `slices` texels.
pub fn bound_of_normalised(exact: &Exact<f64>, values: u32, slices: u32, longest: f64) -> Option<f64> {
    of_normalised(exact, values, slices, longest, f64::INFINITY)
}

fn of_polynomial(exact: &Exact<f64>, degree: u32, values: u32, longest: f64, limit: f64) -> Option<f64> {
    let [slope, lebesgue] = *DEGREES.get(degree.checked_sub(1)? as usize)?;
    let lengths = |depth: f64| slope * depth.powi(degree as i32 + 1);
    let [error, brightest] = worst(exact, values, limit, |cell, _| cell.normalised(longest, lengths, lebesgue))?;
    Some((error + ROUNDING * brightest * lebesgue).min(brightest * (1.0 + lebesgue) / 2.0))
}

fn of_normalised(exact: &Exact<f64>, values: u32, slices: u32, longest: f64, limit: f64) -> Option<f64> {
    const OCTAVE: f64 = std::f64::consts::LN_2 * std::f64::consts::LN_2 / 8.0;
    // From no length to the thinnest slice it is linear in the length.
    let thinnest = super::length(Kind::LogNormalised, slices.max(3), 1.0, 1);
    let lengths = |depth: f64| {
        let e = std::f64::consts::E;
        let octave = OCTAVE * ((0.125 * depth).min(1.0 / e) + (0.0321 * depth * depth).min(4.0 / (e * e)));
        octave.max(DEGREES[0][0] * (thinnest * depth).powi(2))
    };
    let [error, brightest] = worst(exact, values, limit, |cell, _| cell.normalised(longest, lengths, 1.0))?;
    Some((error + ROUNDING * brightest).min(brightest))
}

/// The smallest powers of 2, of at most 256 values and 128 lengths, whose bounds are half of `error` each; the greatest
/// where none is. `None` as [`bound`].
pub fn size(exact: &Exact<f64>, longest: f64, error: f64) -> Option<[u32; 3]> {
    let [mut n, mut slices] = [16, 8];
    let mut of_values = along_values(exact, n, longest, error)?;
    while n < 256 && of_values[0] > error / 2.0 {
        n *= 2;
        of_values = along_values(exact, n, longest, error)?;
    }
    while slices < 128 && along_lengths(exact, slices, longest, of_values[1]) > error / 2.0 {
        slices *= 2;
    }
    Some([n, n, slices])
}

/// The fewest of the powers of 2 from 64 to `most` values whose bound is `error` for polynomials of `degree`; `None` if
/// none is.
pub fn values_of_polynomial(exact: &Exact<f64>, degree: u32, longest: f64, error: f64, most: u32) -> Option<u32> {
    fewest(most, error, |n| of_polynomial(exact, degree, n, longest, error))
}

/// The same for logarithmic lengths, normalised.
pub fn values_of_normalised(exact: &Exact<f64>, slices: u32, longest: f64, error: f64, most: u32) -> Option<u32> {
    fewest(most, error, |n| of_normalised(exact, n, slices, longest, error))
}

fn fewest(most: u32, error: f64, bound: impl Fn(u32) -> Option<f64>) -> Option<u32> {
    let sizes = std::iter::successors(Some(64), |n| Some(2 * n)).take_while(|&n| n <= most);
    sizes.into_iter().find(|&n| bound(n).is_some_and(|b| b <= error))
}

/// The bound along the values, as far as it is beyond `limit`, and the greatest colour.
fn along_values(exact: &Exact<f64>, values: u32, longest: f64, limit: f64) -> Option<[f64; 2]> {
    let brightest = worst(exact, values.min(3), 0.0, |_, _| 0.0)?[1];
    worst(exact, values, limit, |cell, enough| cell.published(longest, brightest, enough))
}

fn along_lengths(exact: &Exact<f64>, slices: u32, longest: f64, brightest: f64) -> f64 {
    let densest = exact.opacity.value.iter().fold(0.0f64, |m, v| m.max(v[0]));
    brightest * chord(densest * longest / f64::from(slices.max(2) - 1))
}

/// What bounds need to know of the `n` intervals.
fn intervals(knots: &Knots<f64>, n: usize) -> Vec<Interval> {
    // Of all channels: kinks and steps inside of an interval and at its lower end, the greatest slope, least and most.
    let mut inside = vec![[0.0f64; 4]; n];
    let mut at_end = vec![[0.0f64; 4]; n];
    let mut steep = vec![[0.0f64; 4]; n];
    let mut range = vec![[[f64::INFINITY, f64::NEG_INFINITY]; 4]; n];
    let mut rise = vec![0.0f64; n];
    let mut stepped = vec![[false; 4]; n];
    // From what to what steps at the values go: a texel may hold either.
    let mut steps = vec![[[f64::INFINITY, f64::NEG_INFINITY]; 4]; n + 1];
    let per_texel = 2.0 / n as f64;
    let place = |s: f64| (s + 1.0) / per_texel;
    for (k, s) in knots.s.windows(2).enumerate() {
        let [x0, x1] = [s[0], s[1]].map(|s| place(s.clamp(-1.0, 1.0)));
        let value = |c: usize, x: f64| knots.value[k][c] + knots.slope[k][c] * (x * per_texel - 1.0 - s[0]);
        for i in (x0 as usize)..(x1.ceil() as usize).min(n) {
            let ends = [x0.max(i as f64), x1.min(i as f64 + 1.0)];
            if ends[0] < ends[1] {
                rise[i] += (ends[1] - ends[0]) * (value(0, ends[0]) + value(0, ends[1])) / 2.0;
            }
            for c in (0..4).filter(|_| ends[0] < ends[1]) {
                for v in ends.map(|x| value(c, x)) {
                    range[i][c] = [range[i][c][0].min(v), range[i][c][1].max(v)];
                }
                steep[i][c] = steep[i][c].max((knots.slope[k][c] * per_texel).abs());
            }
        }
        let node = (x0 - x0.round()).abs() < 1e-9;
        if node && s[0] == s[1] {
            let m = x0.round() as usize;
            for (c, step) in steps[m].iter_mut().enumerate() {
                *step = [knots.value[k][c], knots.value[k + 1][c]]
                    .iter()
                    .fold(*step, |[lo, hi], &v| [lo.min(v), hi.max(v)]);
            }
        }
        if k == 0 || s[0] <= -1.0 || s[0] >= 1.0 {
            continue;
        }
        if !node && s[0] == s[1] {
            for (c, stepped) in stepped[x0 as usize].iter_mut().enumerate() {
                *stepped |= knots.value[k + 1][c] != knots.value[k][c];
            }
        }
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
        let ends = [&steps[i], &steps[i + 1]];
        let own: [[f64; 2]; 4] = std::array::from_fn(|c| {
            ends.iter().fold(range[i][c], |[lo, hi], step| [lo.min(step[c][0]), hi.max(step[c][1])])
        });
        let own_gap = |c: usize| {
            let steps: f64 = ends.iter().map(|step| (step[c][1] - step[c][0]).max(0.0)).sum();
            (inside[i][c] + steps).min(own[c][1] - own[c][0])
        };
        let varied = range[i][0][1] - range[i][0][0];
        Interval {
            gap: gap(0),
            shift: shift(0),
            gap_colour,
            shift_colour,
            least,
            most,
            own_gap: own_gap(0),
            own_gap_colour: colours(&own_gap),
            own,
            bend: varied / if inside[i][0] > 0.0 { 4.0 } else { 8.0 },
            rise: rise[i],
            end: End {
                most: own[0][1],
                slope: if stepped[i][0] { f64::INFINITY } else { steep[i][0] },
                slope_colour: colours(&|c| if stepped[i][c] { f64::INFINITY } else { steep[i][c] }),
            },
            kink: if steps[i][0][1] > steps[i][0][0] { f64::INFINITY } else { at_end[i][0] },
            between: [at_end[i][0], colours(&|c| at_end[i][c])],
        }
    };
    (0..n).map(interval).collect()
}

impl Table {
    /// A bound on the error of a table of this kind and size, where there is one: [`bound`] or [`bound_of_normalised`].
    pub fn bound(&self, exact: &Exact<f64>) -> Option<f64> {
        let [values, other, slices] = self.size;
        let of = match self.kind {
            Kind::Uniform => bound,
            Kind::LogNormalised => bound_of_normalised,
            Kind::Log => return None,
        };
        (values == other).then(|| of(exact, values, slices, self.longest)).flatten()
    }
}

impl Polynomial {
    /// [`bound_of_polynomial`] of a table of this size.
    pub fn bound(&self, exact: &Exact<f64>) -> Option<f64> {
        bound_of_polynomial(exact, self.degree, self.size, self.longest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bernoulli's polynomials by B_m′ = m B_{m−1} and ∫ B_m = 0; Lagrange's by their definition.
    #[test]
    fn constants_of_degrees_are_what_they_say() {
        let at = |powers: &[f64], x: f64| powers.iter().rev().fold(0.0, |v, p| v * x + p);
        let places = || (0..=20_000).map(|i| f64::from(i) / 20_000.0);
        let mut bernoulli = vec![1.0];
        for (n, [slope, lebesgue]) in (1..).zip(DEGREES) {
            let m = n + 1;
            while bernoulli.len() < m + 1 {
                let k = bernoulli.len() as f64;
                let mut next: Vec<f64> = (0..).zip(&bernoulli).map(|(i, c)| k * c / f64::from(i + 1)).collect();
                next.insert(0, -(0..).zip(&next).map(|(i, c)| c / f64::from(i + 2)).sum::<f64>());
                bernoulli = next;
            }
            let mean = places().map(|x| at(&bernoulli, x).abs()).sum::<f64>() / 20_001.0;
            let nodes: Vec<f64> = (0..=n).map(|i| i as f64 / n as f64).collect();
            let product = places().fold(0.0, |m: f64, x| m.max(nodes.iter().map(|k| (x - k).abs()).product()));
            let factorial: f64 = (1..=m).map(|k| k as f64).product();
            assert!((slope / (mean / 2.0 * product / factorial) - 1.0).abs() < 2e-3, "{n}: {slope}");
            let lagrange = |x: f64, i: usize| -> f64 {
                (0..=n).filter(|&k| k != i).map(|k| ((x - nodes[k]) / (nodes[i] - nodes[k])).abs()).product()
            };
            let most = places().fold(0.0, |m: f64, x| m.max((0..=n).map(|i| lagrange(x, i)).sum()));
            assert!(lebesgue >= most && lebesgue < 1.001 * most, "{n}: {lebesgue}, not {most}");
        }
    }
}
