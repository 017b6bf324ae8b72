//! What the largest value along a ray looks like.

use crate::field::{Kind, Normalization};
use crate::transfer::TransferFunction;

/// Turns largest values, as they are mapped, into pixels.
pub(super) struct Largest<'a> {
    pub(super) kind: Kind,
    pub(super) normal: &'a [Normalization; 4],
    pub(super) transfer: &'a TransferFunction,
    /// Pixels hold the values themselves, to be compared with others of the same ray: those of up to three components that
    /// have a say in the colour, then that which drives the opacity, which is not 0.
    pub(super) as_values: bool,
}

impl Largest<'_> {
    /// The pixel of a ray whose largest values are `v`: colour and opacity there, premultiplied.
    pub(super) fn pixel(&self, v: &[f64]) -> [f32; 4] {
        let last = v[v.len() - 1];
        if self.as_values {
            let of = |k: usize| v.get(k).map_or(0.0, |v| *v as f32);
            let last = last as f32;
            return [of(0), of(1), of(2), if last == 0.0 { f32::MIN_POSITIVE } else { last }];
        }
        let own = |k: usize, v: f64| self.normal[k].invert(v);
        // Colours of the field's own are normalised so that a full one is 1, whatever the array's type.
        let [r, g, b] = match self.kind {
            Kind::Rgba => [0, 1, 2].map(|k| v[k].clamp(0.0, 1.0)),
            Kind::Scalar | Kind::Pair => self.transfer.color_at(own(0, v[0])),
        };
        let a = self.transfer.opacity_at(own(v.len() - 1, last)).min(1.0);
        [r * a, g * a, b * a, a].map(|c| c as f32)
    }

    /// The pixel of what another holds as values.
    pub(super) fn of_values(&self, pixel: [f32; 4]) -> [f32; 4] {
        let [a, b, c, last] = pixel.map(f64::from);
        if last == 0.0 {
            return [0.0; 4];
        }
        match self.kind {
            Kind::Scalar => self.pixel(&[last]),
            Kind::Pair => self.pixel(&[a, last]),
            Kind::Rgba => self.pixel(&[a, b, c, last]),
        }
    }
}
