//! What frames of grids need with a second variable, or light, kept as long as it holds.

use crate::cast::second::{self, Two, spreads};
use crate::cast::{Frame, Gradients, Samples, Volume};
use crate::error::{Error, Result};
use crate::field::{Association, Field, Normalization};
use crate::integral::options;
use crate::integral::second::Second;
use crate::transfer::TransferFunction;

/// As far as it was made.
#[derive(Debug, Default)]
pub(super) struct Extra {
    gradients: Option<Gradients>,
    array: Option<Samples>,
    function: Option<Second>,
}

impl Extra {
    /// The transfer function is another.
    pub(super) fn invalidate_function(&mut self) {
        self.function = None;
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> u64 {
        self.gradients.as_ref().map_or(0, Gradients::bytes) + self.array.as_ref().map_or(0, Samples::bytes)
    }

    /// Makes what is missing to draw `field`, whose values are `samples`, with `transfer`, on the current rayon pool.
    ///
    /// # Errors
    /// [`Error::Field`] if the second variable does not fit the grid; [`Error::NoMemory`].
    pub(super) fn prepare(
        &mut self,
        volume: &Volume,
        samples: &Samples,
        field: &Field,
        transfer: &TransferFunction,
        how: options::Two,
    ) -> Result<()> {
        if let (None, Some(array)) = (&self.array, field.second()) {
            self.array = Some(Samples::new(volume, array)?);
        }
        let wanted = transfer.shading().is_some() || field.second().is_none();
        if self.gradients.is_none() && wanted && field.association() == Association::Point {
            self.gradients = Some(Gradients::new(volume, samples)?);
        }
        // Values are handed over in their own units.
        let own = Normalization { mid: 0.0, half: 1.0 };
        self.function.get_or_insert_with(|| Second::new(transfer, [own; 2], volume.centre(), volume.scale, how));
        Ok(())
    }

    /// Draws a frame; also says how many voxels rays passed, and how many panels were summed up.
    pub(super) fn draw(
        &self,
        frame: &Frame,
        field: &Field,
        transfer: &TransferFunction,
    ) -> Result<(Vec<[f32; 4]>, [u64; 2])> {
        let Some(second) = &self.function else { return Err(Error::Render("there are no values to draw".into())) };
        let lengths = [0.0, self.gradients.as_ref().map_or(0.0, Gradients::longest)];
        let ranges = [field.range(0), field.second().map_or(lengths, |g| g.range(0))];
        let over = spreads(transfer, ranges, frame.volume.scale);
        let two = Two { second, array: self.array.as_ref(), gradients: self.gradients.as_ref(), over };
        Ok(second::render(frame, &two, transfer))
    }
}
