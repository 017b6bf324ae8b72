//! How far tables may be off between their texels: bounds on the greatest error of any channel, from the function and
//! the size alone.
//!
//! A linear filter weighs the texels around a segment. *Along the values*, the scalar of the four segments around is on
//! average that of the segment meant. Their mean of a function that is linear is so too; at a kink it is off by at most
//! a quarter of the change of slope per texel (Peano's kernel), at a step by its height, and never by more than the
//! function varies over three texels: the *gap* g of ρ, and of κ. A *shift* o is how much the function varies over one
//! texel: at each place of the segments their values have a variance of o²/4 at most (Popoviciu), and from their mean
//! one is (1 − w) o away, w its weight, the square of which is 9/16 on average. Means over a segment have bars. All is
//! found for each cell of four texels, of which that counts which says most; with c what colours vary by in a cell.
//!
//! Between two functions the error is integrated along the straight line from one to the other, on which everything
//! below holds: D is the depth of what is in front, X that of all, and where ρ changes by δρ = γ ρ at most, D does by γ
//! D at most. There ∂(ρ e^{−D}) = (δρ − ρ δD) e^{−D} and ∂²(ρ e^{−D}) = (ρ δD² − 2 δρ δD) e^{−D}.
//!
//! **Premultiplied tables** keep C = ∫ κ dA, over the opacity A gathered so far, dA = l ρ e^{−D} dt. With γ and ω the
//! greatest g/ρ and o/ρ, and q = 1 + min(1, lρ), in C̄ − C = Σ w ∫ (κ − κ̄)(dA − dĀ) + ∫ (κ̄ − κ) dĀ + ∫ κ (dĀ − dA)
//!
//! - the first is the covariance of κ and dA, and at most ½ o_κ times the deviation ½ min(l ō, ω) (1 + min(lρ, 1 + ω));
//! - the second is at most g_κ α;
//! - the third is that of opacity (below) of a constant in the middle of the colours, and of the rest, which is ½ c at
//!   most, q min(l ḡ, γ) as the mean extinction is off and ½ · 9/16 min(q (l ō)², 4 ω²) as the exponential is curved.
//!
//! And segments whose scalars stay where ρ and κ are within ρ₀ … ρ₁ and κ₀ … κ₁ differ by no more than κ₁ (1 −
//! e^{−lρ₁}) − κ₀ (1 − e^{−lρ₀}): near the diagonal this tells a function of many knots, a peak or a step. Along the
//! length, opacity is 1 − e^{−lρ̂}, whose chord over Δl is off by at most φ(ρ Δl), φ(x) = max_u (1 − e^{−xu}) − u (1 −
//! e^{−x}), with the greatest ρ, and C by at most that times the greatest κ: from no length on, each part of it is off
//! to the same side, and later less. *Logarithmic* lengths are linear over an octave: off by ln²2/8 of the second
//! derivative by ln l, ∫ κ (1 − 3D + D²) e^{−D} dD, which is κ times min(X, 0.94) at most.
//!
//! **Direct emission** is C = l ∫ κ e^{−D} dt, of which l ∫ e^{−D} dt ≤ (1 − e^{−lρ₀})/ρ₀ is seen, of that at most g_κ +
//! ¼ o_κ l ō as the colour is off and varies with D, and κ (l ḡ + ⅛ (l ō)²) as D is off. Along the length it is off by
//! ⅛ ρ Δl² κ, and over an octave by ln²2/8 l κ, as |1 − 3D + D²| e^{−D} ≤ 1.
//!
//! **Normalised tables** keep ρ̂ and Ĉ = C/α. Of ρ̂ = (R(s_b) − R(s_f))/(s_b − s_f), R = ∫ρ, the numerator is a sum of
//! functions of one value each, whose chords are off by ε ≤ ¼ of what ρ varies over the texel (⅛ where it is linear):
//! what lies between the ends does not count. So E[ρ̂] is off by at most (ε_f + ε_b + r/√8)/d, d the least distance of
//! the values in texels and r what ρ̂ varies over the cell: the last is the covariance of ρ̂ and d. From an error δ of
//! ρ̂ ≥ ρ₀, opacity is off by at most e^{−lρ₀} − e^{−l(ρ₀+δ)}, and a mean of opacities by ⅛ (l r)² e^{−lρ₀} more. Where
//! one kink, of a change of slope σ per texel, is between two neighbouring intervals, E[ρ̂] is off by σ/16 at most.
//!
//! Ĉ is a mean of κ, with weights p = l ρ e^{−D}/α, and so off by no more than c; all of it counts times α. As p changes
//! by p (a − ∫ p a), a = δρ/ρ − δD, Ĉ does by the covariance of κ and a: at most the product of their deviations. That of
//! a is γ x at most, x = 1 + √(1 − (½X/sinh ½X)²), the root being that of D itself. So Ĉ is off by at most
//!
//! - g_κ as the colour is off, and ½ c γ x as the mean extinction is;
//! - 9/16 o_κ ω x as both vary together;
//! - ½ · 9/16 c (ω x)² as p is curved: ∂²p = p (y − ∫ p y) with y = (a − ∫ p a)² − (δρ/ρ)².
//!
//! Or else Ĉ = ∫ κ ρ e^{−λR} ds / ∫ ρ e^{−λR} ds over the values, λ = l/(s_b − s_f), of which only the ends and λ move:
//! an error of ⅛ of both second derivatives, which follow from ∂Ĉ/∂s_b = (κ_b − Ĉ) h, h = λρ_b/(e^X − 1), ∂Ĉ/∂s_f = (Ĉ −
//! κ_f) h, h = λρ_f/(1 − e^{−X}), and λ ∂Ĉ/∂λ = X dĈ/dX (below). With r = ρ/(ρ̂ d) at an end and r′ = ρ′/(ρ̂ d), h ≤ r
//! and |∂h/∂s_b| ≤ r′ + r² behind; h ≤ r (1 + X) and |∂h/∂s_f| ≤ r′ (1 + X) + r² in front.
//!
//! Along the length, Ĉ depends on the depth X = lρ̂ alone: with z the share of the depth it is ∫ κ X e^{−Xz}/(1 −
//! e^{−X}) dz, of which the factor's m-th derivative at X = 0 is, but for its sign, the Bernoulli polynomial B_m(z),
//! and less beyond; so |dᵐĈ/dXᵐ| ≤ ½ ∫|B_m| of what κ varies by. *Polynomials* of degree n through equal distances are
//! off by that for m = n + 1 times max|Π (X − X_k)|/(n + 1)!, and by no more than (1 + Λ)/2 of what κ varies by, Λ
//! their Lebesgue constant. A filter's mean of them is the polynomial through means, so that is added to what these are
//! off, and nothing counts Λ times. *Logarithmic* lengths are linear over an octave: ⅛ of the second derivative by
//! log₂ l, ln²2 (X² Ĉ″ + X Ĉ′), where X Ĉ′ ≤ 1/e and X² Ĉ″ ≤ 4/e² of what κ varies by.

//!
//! **Weights** of colours at a segment's ends are tables like these, of a colour that goes from 0 to 1 along the segment, wherever its
//! values move: so κ is not off and does not shift, c is 1, and all above holds but what follows from κ over the values ("or else").
//! As texels are weighed linearly, a bound of them is one of every colour from 0 to 1 that is linear along the segment.

mod cell;
mod function;

use super::volume::{Kind, length};
use super::{is_scalar, is_tabulated};
use crate::integral::Exact;
use cell::TexelCell;
use std::f64::consts::{E, LN_2};

/// Errors of rounding texels to f32 and of what builds them, relative to the greatest colour.
pub(super) const ROUNDING: f64 = 2e-6;

/// For degrees from 1: ½ ∫|B_{n+1}| max|Π (x − i/n)|/(n + 1)!, and the Lebesgue constant of n + 1 points at equal
/// distances.
pub(super) const DEGREES: [[f64; 2]; 8] = [
    [4.010e-3, 1.0],
    [1.253e-4, 1.25],
    [5.033e-6, 1.6312],
    [2.309e-7, 2.2079],
    [1.119e-8, 3.1064],
    [5.640e-10, 4.5494],
    [2.914e-11, 6.9298],
    [1.533e-12, 10.9457],
];

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

/// The greatest of `error` over the cells of a table of `values`², as far as one is beyond `limit`.
fn worst(exact: &Exact<f64>, values: u32, limit: f64, error: impl Fn(&TexelCell) -> f64) -> f64 {
    let n = values as usize - 1;
    let intervals = function::intervals(&exact.opacity, n);
    let mut sums = vec![0.0];
    intervals.iter().for_each(|k| sums.push(sums[sums.len() - 1] + k.rise));
    let mut greatest = 0.0f64;
    let of = |cell: TexelCell| if is_scalar(exact) { cell } else { cell.of_weights() };
    for i in 0..n {
        greatest = cell::row(&intervals, &sums, i).fold(greatest, |m, cell| m.max(error(&of(cell))));
        if greatest > limit {
            break;
        }
    }
    greatest
}

/// Whether there are bounds for tables of so many values.
fn is_bounded(exact: &Exact<f64>, values: u32) -> bool {
    is_tabulated(exact) && values >= 3
}

/// The greatest of the function's colours.
pub(super) fn brightest(exact: &Exact<f64>) -> f64 {
    // Weights are of a colour of 1.
    let least = if is_scalar(exact) { 0.0 } else { 1.0 };
    exact.opacity.value.iter().flat_map(|v| &v[1..]).fold(least, |m: f64, &c| m.max(c))
}

/// The greatest colour or opacity of a segment: at least 1.
fn scale(exact: &Exact<f64>, longest: f64) -> f64 {
    (brightest(exact) * if exact.direct { longest } else { 1.0 }).max(1.0)
}

/// A bound on the error of a table of `kind` and `values`² × `slices` texels for segments of up to `longest` normalised
/// units, looked up anywhere. `None` for pairs, for less than 3 values, and for direct emission
/// if the table is normalised: the weights of what is seen then add up to more than 1.
pub fn bound_of_volume(exact: &Exact<f64>, kind: Kind, [values, slices]: [u32; 2], longest: f64) -> Option<f64> {
    if kind == Kind::LogNormalised {
        return of_normalised(exact, values, slices, longest, f64::INFINITY);
    }
    let of_values = along_values(exact, values, longest, f64::INFINITY)?;
    let most = scale(exact, longest);
    Some((of_values + along_lengths(exact, kind, slices, longest) + ROUNDING * most).min(most))
}

/// The same for [`super::Polynomial`]s of `degree`, 1 to 8, and `values`² texels. `None` also for direct emission.
pub fn bound_of_polynomial(exact: &Exact<f64>, degree: u32, values: u32, longest: f64) -> Option<f64> {
    of_polynomial(exact, degree, values, longest, f64::INFINITY)
}

fn of_polynomial(exact: &Exact<f64>, degree: u32, values: u32, longest: f64, limit: f64) -> Option<f64> {
    let [slope, lebesgue] = *DEGREES.get(degree.checked_sub(1)? as usize)?;
    let (lengths, beyond) = (|depth: f64| slope * depth.powi(degree as i32 + 1), (lebesgue - 1.0) / 2.0);
    let most = (is_bounded(exact, values) && !exact.direct).then(|| scale(exact, longest))?;
    let error = worst(exact, values, limit, |cell| cell.normalised(longest, lengths, beyond));
    Some((error + ROUNDING * most * lebesgue).min(most * (1.0 + beyond)))
}

fn of_normalised(exact: &Exact<f64>, values: u32, slices: u32, longest: f64, limit: f64) -> Option<f64> {
    // From no length to the thinnest slice it is linear in the length.
    let thinnest = length(Kind::LogNormalised, slices.max(3), 1.0, 1);
    let lengths = |depth: f64| {
        let octave = LN_2 * LN_2 / 8.0 * ((0.125 * depth).min(1.0 / E) + (0.0321 * depth * depth).min(4.0 / (E * E)));
        octave.max(DEGREES[0][0] * (thinnest * depth).powi(2))
    };
    let most = (is_bounded(exact, values) && !exact.direct).then(|| scale(exact, longest))?;
    let error = worst(exact, values, limit, |cell| cell.normalised(longest, lengths, 0.0));
    Some((error + ROUNDING * most).min(most))
}

/// The smallest powers of 2, of at most 256 values and 128 lengths, whose bounds are half of `error` each for a uniform
/// volume; the greatest where none is. `None` for pairs.
pub fn size(exact: &Exact<f64>, longest: f64, error: f64) -> Option<[u32; 3]> {
    let [mut n, mut slices] = [16, 8];
    while n < 256 && along_values(exact, n, longest, error)? > error / 2.0 {
        n *= 2;
    }
    while slices < 128 && along_lengths(exact, Kind::Uniform, slices, longest) > error / 2.0 {
        slices *= 2;
    }
    is_tabulated(exact).then_some([n, n, slices])
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

/// The bound of premultiplied tables along the values, as far as it is beyond `limit`.
fn along_values(exact: &Exact<f64>, values: u32, longest: f64, limit: f64) -> Option<f64> {
    let error = |cell: &TexelCell| if exact.direct { cell.emitted(longest) } else { cell.premultiplied(longest) };
    is_bounded(exact, values).then(|| worst(exact, values, limit, error))
}

/// The same along the lengths.
fn along_lengths(exact: &Exact<f64>, kind: Kind, slices: u32, longest: f64) -> f64 {
    let densest = exact.opacity.value.iter().fold(0.0f64, |m, v| m.max(v[0]));
    let (brightest, step) = (brightest(exact), length(kind, slices.max(3), longest, 1));
    let (of_opacity, depth) = (chord(densest * step), (densest * longest).min(0.94));
    let [first, octaves] = match exact.direct {
        true => [(densest * step / 8.0).min(1.0) * brightest * step, brightest * longest],
        false => [of_opacity * brightest, depth * brightest],
    };
    let octaves = if kind == Kind::Uniform { 0.0 } else { LN_2 * LN_2 / 8.0 * octaves.max(depth) };
    first.max(of_opacity).max(octaves)
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
