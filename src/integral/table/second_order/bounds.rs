//! How far off second-order tables may be.
//!
//! Let ρ and κ vary by g and g_κ at most over the reach of a texel, and κ ≤ K. Between a parabola and one that is so near,
//! opacity changes by 1 − e^{−l g} at most, and C = ∫ κ dA, dA = l ρ e^{−D} du, by g_κ in κ and, as ∂(l ρ e^{−D}) = l (δρ −
//! ρ δD) e^{−D}, of which both terms have integrals up to l g, by 2 K l g in A. So has the mean of *premultiplied* texels.
//! Direct emission C = l ∫ κ e^{−D} du changes by l (g_κ + K min(1, l g)).
//!
//! Of *normalised* ones with C = Ĉ α, Σ w Ĉ_i ᾱ − C = Σ w Ĉ_i (ᾱ − α) + Σ w Ĉ_i (α − α_i) + Σ w (C_i − C): K (1 − e^{−l g}) twice, and
//! the former. Polynomials of Ĉ add what `bound.rs` says of them, for the greatest depth l max ρ, times α.

use super::super::bound::{DEGREES, ROUNDING, brightest};
use crate::integral::Exact;

/// How much the function varies at most over values `reach` wide: extinction, and colours.
fn variations(exact: &Exact<f64>, reach: f64) -> [f64; 2] {
    let of = |k: usize| exact.opacity.variation(k, reach);
    [of(0), of(1).max(of(2)).max(of(3))]
}

fn opacity(depth: f64) -> f64 {
    -(-depth).exp_m1()
}

/// Of premultiplied colours and opacities of slabs `l` long.
pub(super) fn premultiplied(exact: &Exact<f64>, reach: f64, l: f64) -> f64 {
    let ([g, of_colours], brightest) = (variations(exact, reach), brightest(exact));
    let scale = if exact.direct { l } else { 1.0 };
    let by_extinction = if exact.direct { (l * g).min(1.0) } else { 2.0 * l * g };
    let colours = scale * (of_colours + brightest * by_extinction).min(brightest);
    colours.max(opacity(l * g)) + ROUNDING * (scale * brightest).max(1.0)
}

/// Of polynomials of colour over opacity, and mean extinctions, for slabs up to `l` long. `None` for direct emission: the
/// weights of what is seen of the length then add up to more than 1.
pub(super) fn normalised(exact: &Exact<f64>, degree: u32, reach: f64, l: f64) -> Option<f64> {
    let [slope, lebesgue] = *DEGREES.get(degree.checked_sub(1)? as usize)?;
    if exact.direct {
        return None;
    }
    let ([g, _], brightest) = (variations(exact, reach), brightest(exact));
    let [steepest, of_all] = variations(exact, f64::INFINITY);
    let polynomial = (slope * (l * steepest).powi(degree as i32 + 1)).min((1.0 + lebesgue) / 2.0) * of_all;
    let colours =
        premultiplied(exact, reach, l) + 2.0 * brightest * opacity(l * g) + polynomial * opacity(l * steepest);
    Some(colours.min(brightest.max(1.0) * (1.0 + lebesgue)))
}
