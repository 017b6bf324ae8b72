//! What a backend is handed for a frame.

use super::Progress;
use super::largest::Largest;
use super::loaded::Loaded;
use super::prepared::Prepared;
use crate::integral::{Exact, PreintegratedTable};
use crate::project::ProjectionOptions;
use crate::transfer::TransferFunction;
use crate::view::View;
use std::sync::Arc;

/// Everything that a frame depends on.
pub(super) struct Frame<'a> {
    pub(super) mesh: &'a Loaded,
    pub(super) field: &'a Prepared,
    pub(super) transfer: &'a TransferFunction,
    pub(super) exact: &'a Exact<f32>,
    pub(super) table: Option<&'a Arc<PreintegratedTable>>,
    pub(super) view: &'a View,
    pub(super) projection: &'a ProjectionOptions,
    /// Largest values become pixels as [`Largest`] says.
    pub(super) as_values: bool,
    pub(super) progress: &'a Progress<'a>,
}

impl Frame<'_> {
    /// The pixel of a ray whose largest values are `v`: colour and opacity there, premultiplied.
    pub(super) fn largest<const N: usize>(&self, v: &[f32; N]) -> [f32; 4] {
        let (kind, normal) = (self.field.kind(), self.field.normal());
        let largest = Largest { kind, normal, transfer: self.transfer, as_values: self.as_values };
        largest.pixel(&v.map(f64::from))
    }
}
