//! What both engines on devices draw.

use crate::geometry::{TetMesh, Values};
use crate::integral::{Exact, PreintegratedTable};
use crate::view::View;
use std::sync::Arc;

/// A mesh, the values of its field, the function with its table if there is one, and a view.
pub(crate) struct DeviceScene<'a, const N: usize> {
    pub(crate) geometry: &'a TetMesh,
    pub(crate) values: &'a Values<N>,
    pub(crate) exact: &'a Exact<f32>,
    pub(crate) table: Option<&'a Arc<PreintegratedTable>>,
    pub(crate) view: &'a View,
}
