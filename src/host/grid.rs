//! Regular and rectilinear grids of another program.

use super::{Session, State, check_matrix};
use crate::error::{Error, Result};
use crate::grid::Grid;
use glam::DMat4;

impl Session {
    /// Draws a regular or rectilinear grid, under a matrix, from now on; the field must be set again. A grid with nothing to
    /// draw, or one that the matrix makes flat, is no error: its pictures are empty.
    ///
    /// # Errors
    /// [`Error::Mesh`] if the matrix is not affine or not finite.
    pub fn set_grid(&mut self, grid: &Grid, matrix: DMat4) -> Result<()> {
        check_matrix(matrix)?;
        let placed = if matrix.determinant() == 0.0 { None } else { grid.clone().transformed(matrix).ok() };
        self.state = match placed.map(|placed| self.renderer.set_grid(&placed)) {
            Some(Ok(())) => State::Grid,
            Some(Err(Error::Empty(why))) => {
                tracing::warn!("nothing is drawn of the grid: {why}");
                State::Empty
            }
            Some(Err(other)) => return Err(other),
            None => State::Empty,
        };
        Ok(())
    }
}
