//! Pre-integrated tables: what a segment does, looked up by its values in front and behind and its length.
//!
//! Each form is compared with the exact integral, and read here as a device's linear filter reads it: [`Table`] has all
//! three parameters, [`Polynomial`] the values only, and [`Cylindrical`] planes of two parameters that hold a projected
//! cell each. [`SecondOrder`], [`SecondOrderLengths`] and [`SecondOrderPolynomial`] are for slabs along which the value is a parabola.
//!
//! Where a component of its own is the colour, a table cannot know it: it then holds the *weights* of the colours at a segment's two
//! ends, between which these are linear ([`Exact::weights`]): in place of red that of the colour behind, in place of green that of the
//! colour in front. They are integrals of the opacity's component alone, as opacity is.

mod bound;
mod closed;
mod cylindrical;
mod grid;
mod incremental;
mod linear;
mod polynomial;
mod sampled;
mod second_order;
mod storage;
mod volume;

pub use bound::{bound_of_polynomial, bound_of_volume, size, values_of_normalised, values_of_polynomial};
pub use cylindrical::Cylindrical;
pub use linear::Linear;
pub use polynomial::Polynomial;
pub use sampled::{Sampling, Steps};
pub use second_order::{
    MOST_OF_ALL_LENGTHS, MOST_OF_ONE_LENGTH, SecondOrder, SecondOrderLengths, SecondOrderPolynomial, Slabs, parabola,
};
pub use storage::Storage;
pub use volume::{Kind, Table, coordinate, length};

pub(crate) use grid::Nodes;
pub(crate) use polynomial::{THINNEST, inverse};
pub(crate) use sampled::entries;
pub(crate) use second_order::{Slices, samples, span};
pub(crate) use volume::OPAQUE_DEPTH;

use super::{Exact, Light};
use crate::field;

/// Whether a function is of one component, so that a table holds its colours.
fn is_scalar(exact: &Exact<f64>) -> bool {
    exact.kind == field::Kind::Scalar
}

/// Whether a function can be tabulated: that of one component, or the weights of the colours of several.
fn is_tabulated(exact: &Exact<f64>) -> bool {
    exact.kind != field::Kind::Pair
}

/// Calls `piece` with each piece of a segment between two values of the component that opacity is of: see
/// [`Exact::for_each_piece`]. Of weights, the colours are how far behind and before the ends of the segment it is.
fn for_each_piece(exact: &Exact<f64>, front: f64, back: f64, piece: impl FnMut([f64; 4], [f64; 4], f64)) {
    match exact.kind {
        field::Kind::Scalar => exact.for_each_piece(&[front], &[back], piece),
        _ => exact.for_each_piece(&[0.0, 1.0, 0.0, front], &[1.0, 0.0, 0.0, back], piece),
    }
}

/// The normalised scalar of texel `i` of `n`.
fn value(i: u32, n: u32) -> f64 {
    -1.0 + 2.0 * f64::from(i) / f64::from(n - 1)
}

/// Between which two of `n` texels a place in [0, 1] lies, and the weight of the second.
fn between(x: f64, n: u32) -> [(usize, f64); 2] {
    let at = x.clamp(0.0, 1.0) * f64::from(n - 1);
    let low = (at as u32).min(n - 2);
    let share = at - f64::from(low);
    [(low as usize, 1.0 - share), (low as usize + 1, share)]
}

/// `a`, and as much of the way to `b` as `share` says.
#[inline(always)]
pub(crate) fn mix(a: [f32; 4], b: [f32; 4], share: f32) -> [f32; 4] {
    std::array::from_fn(|k| a[k] + (b[k] - a[k]) * share)
}

/// Colour and opacity of a segment `l` long, from its colour over what is seen of it and its mean extinction.
fn reconstructed(color: [f64; 3], density: f64, l: f64, direct: bool) -> [f64; 4] {
    let alpha = -(-l * density).exp_m1();
    let seen = if !direct {
        alpha
    } else if density > 0.0 {
        alpha / density
    } else {
        l
    };
    let [r, g, b] = color.map(|c| c * seen);
    [r, g, b, alpha]
}

fn light(exact: &Exact<f64>, front: f64, back: f64, l: f64) -> Light<f64> {
    let mut light = Light::none();
    match exact.kind {
        field::Kind::Scalar => exact.add(&[front], &[back], l, &mut light),
        _ => exact.add(&[0.0, 1.0, 0.0, front], &[1.0, 0.0, 0.0, back], l, &mut light),
    }
    light
}

/// Premultiplied colour and opacity.
fn published(exact: &Exact<f64>, front: f64, back: f64, l: f64) -> [f64; 4] {
    let Light { color: [r, g, b], transmittance } = light(exact, front, back, l);
    [r, g, b, 1.0 - transmittance]
}

#[cfg(test)]
pub(crate) mod tests;
