//! The field that is drawn, normalised for the transfer function that it is drawn with.

use super::loaded::Loaded;
use crate::error::Result;
use crate::field::normalization::{Chooser, Normalization};
use crate::field::{Field, Kind};
use crate::geometry::Values;
use crate::transfer::TransferFunction;

/// The field that is drawn.
#[derive(Debug)]
pub(super) struct Prepared {
    field: Field,
    chooser: Chooser,
    pub(super) values: AnyValues,
}

#[derive(Debug)]
pub(super) enum AnyValues {
    Scalar(Values<1>),
    Pair(Values<2>),
    Rgba(Values<4>),
}

impl Prepared {
    /// `field` on `mesh`, for `transfer` if that is known, and for tables if such may be read.
    ///
    /// # Errors
    /// Those of [`Values::new`].
    pub(super) fn new(mesh: &Loaded, field: &Field, transfer: Option<&TransferFunction>, tables: bool) -> Result<Self> {
        let mut chooser = Chooser::new(field);
        if let Some(transfer) = transfer {
            chooser.choose(transfer, tables);
        }
        let values = AnyValues::new(mesh, field, chooser.normal())?;
        Ok(Prepared { field: field.clone(), chooser, values })
    }

    /// Normalises the values anew if `transfer` asks for that; true if it does.
    ///
    /// # Errors
    /// Those of [`Values::new`].
    pub(super) fn fit(&mut self, mesh: &Loaded, transfer: &TransferFunction, tables: bool) -> Result<bool> {
        let changed = self.chooser.choose(transfer, tables);
        if changed {
            self.bring_to(mesh)?;
        }
        Ok(changed)
    }

    /// Says which knots of `transfer` are too close, once for the same.
    pub(super) fn warn(&mut self, transfer: &TransferFunction) {
        self.chooser.warn(transfer);
    }

    /// Brings the values into the order of `mesh`.
    ///
    /// # Errors
    /// Those of [`Values::new`].
    pub(super) fn bring_to(&mut self, mesh: &Loaded) -> Result<()> {
        self.values = AnyValues::new(mesh, &self.field, self.chooser.normal())?;
        Ok(())
    }

    /// The field as it was set.
    pub(super) fn field(&self) -> &Field {
        &self.field
    }

    pub(super) fn kind(&self) -> Kind {
        self.field.kind()
    }

    /// The map of each component.
    pub(super) fn normal(&self) -> &[Normalization; 4] {
        self.chooser.normal()
    }
}

impl AnyValues {
    fn new(mesh: &Loaded, field: &Field, normal: &[Normalization; 4]) -> Result<Self> {
        fn of<const N: usize>(mesh: &Loaded, field: &Field, normal: &[Normalization; 4]) -> Result<Values<N>> {
            Values::new(&mesh.geometry, &mesh.tetrahedra, mesh.points, mesh.cells, field, normal)
        }
        Ok(match field.kind() {
            Kind::Scalar => AnyValues::Scalar(of(mesh, field, normal)?),
            Kind::Pair => AnyValues::Pair(of(mesh, field, normal)?),
            Kind::Rgba => AnyValues::Rgba(of(mesh, field, normal)?),
        })
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> u64 {
        match self {
            AnyValues::Scalar(v) => v.bytes(),
            AnyValues::Pair(v) => v.bytes(),
            AnyValues::Rgba(v) => v.bytes(),
        }
    }
}
