//! What a backend is handed for a frame.

use super::Progress;
use super::loaded::Loaded;
use super::prepared::Prepared;
use crate::field::Kind;
use crate::integral::{Exact, Lookup};
use crate::project::Switches;
use crate::transfer::TransferFunction;
use crate::view::View;
use std::sync::Arc;

/// Everything that a frame depends on.
pub(super) struct Frame<'a> {
    pub(super) mesh: &'a Loaded,
    pub(super) field: &'a Prepared,
    pub(super) transfer: &'a TransferFunction,
    pub(super) exact: &'a Exact<f32>,
    pub(super) table: Option<&'a Arc<Lookup>>,
    pub(super) view: &'a View,
    pub(super) switches: &'a Switches,
    pub(super) progress: &'a Progress<'a>,
}

impl Frame<'_> {
    /// The pixel of a ray whose largest values are `v`: colour and opacity there, premultiplied.
    pub(super) fn largest<const N: usize>(&self, v: &[f32; N]) -> [f32; 4] {
        let own = |k: usize| self.field.normal()[k].invert(f64::from(v[k]));
        // Colours of the field's own are normalised so that a full one is 1, whatever the array's type.
        let [r, g, b] = match self.field.kind() {
            Kind::Rgba => [0, 1, 2].map(|k| f64::from(v[k]).clamp(0.0, 1.0)),
            Kind::Scalar | Kind::Pair => self.transfer.color_at(own(0)),
        };
        let a = self.transfer.opacity_at(own(N - 1)).min(1.0);
        [r * a, g * a, b * a, a].map(|c| c as f32)
    }
}
