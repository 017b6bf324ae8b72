//! Tables in the place of integrals: of order 1 over two samples, of order 2 over three.

use super::reconstruction::ReconstructionOrder;
use crate::error::{Error, Result};
use crate::field::Normalization;
use crate::integral::{Exact, Form, PreintegratedTable};

/// A table, and what makes its values of a field's.
pub(crate) struct Tabulated<'a> {
    lookup: &'a PreintegratedTable,
    /// From values as the caster has them to those of the table: times the first, plus the second.
    map: [f64; 2],
    /// The function over the table's values, for those beyond them.
    exact: &'a Exact<f64>,
    order: ReconstructionOrder,
}

/// How much shorter than its table's slabs one may be, relative to these.
const SHORTER: f64 = 1e-5;

/// Which tables an order of reconstruction reads.
///
/// # Errors
/// [`Error::Render`], with what there is, for a `form` that `order` has no samples for; and for a table of one length
/// where samples are not `even`ly apart.
pub(crate) fn check(form: Form, order: ReconstructionOrder, even: bool) -> Result<()> {
    let name = form.name();
    let what = match (form, order) {
        (Form::Auto | Form::Exact, _) => return Ok(()),
        (Form::SecondOrder, ReconstructionOrder::Two) if !even => format!(
            "{name}: this table is of slabs of one length, and those from face to face of voxels have any; use --sampling \
             LENGTH, or second-order-polynomial, which serves all lengths"
        ),
        (Form::SecondOrder | Form::SecondOrderPolynomial, ReconstructionOrder::Two) => return Ok(()),
        (Form::SecondOrder | Form::SecondOrderPolynomial, _) => {
            format!("{name}: this table is of parabolas through three samples; use --reconstruction 2")
        }
        (_, ReconstructionOrder::One) => return Ok(()),
        (_, ReconstructionOrder::Two) => {
            format!("{name}: parabolas are in tables of second order; use second-order or second-order-polynomial")
        }
        (_, ReconstructionOrder::Exact) => format!(
            "{name}: the field of a grid as it is has no table; use --integral exact, or --reconstruction 1 or 2, whose \
             samples have"
        ),
        _ => format!("{name}: one sample needs no table; use --integral exact"),
    };
    Err(Error::Render(what))
}

impl<'a> Tabulated<'a> {
    /// `lookup`, of the function `exact` over values that `of_table` maps, read with samples that `own` maps.
    pub(crate) fn new(
        lookup: &'a PreintegratedTable,
        exact: &'a Exact<f64>,
        [own, of_table]: [Normalization; 2],
        order: ReconstructionOrder,
    ) -> Self {
        let map = [own.half / of_table.half, (own.mid - of_table.mid) / of_table.half];
        Tabulated { lookup, map, exact, order }
    }

    /// Premultiplied colour and opacity of a part of a slab, `length` normalised units long, of which these are the samples.
    /// A slab that is shorter than those of a table of one length is not drawn, as published: there is none for it.
    #[inline(always)]
    pub(super) fn part(&self, samples: [f64; 3], part: usize, length: f64) -> [f32; 4] {
        let [scale, shift] = self.map;
        let [front, middle, back] = samples.map(|s| s * scale + shift);
        let samples = match (self.order, part) {
            (ReconstructionOrder::Two, _) => [front, middle, back],
            (_, 0) => [front, f64::midpoint(front, middle), middle],
            _ => [middle, f64::midpoint(middle, back), back],
        };
        let one = self.lookup.options().form == Form::SecondOrder;
        if one && length < self.lookup.longest() * (1.0 - SHORTER) || !samples.iter().all(|s| s.is_finite()) {
            return [0.0; 4];
        }
        self.lookup.slab(self.exact, samples, length)
    }
}
