//! Regular and rectilinear grids of C++.

use super::bridge::Numbers;
use super::numbers::values;
use super::own::{Grid, Session};
use super::rows;
use glam::{DMat3, DMat4, DVec3};
use halite::error::Result;
use halite::host::guard;
use halite::mesh::Array;

pub(super) fn new_grid(x: Numbers, y: Numbers, z: Numbers, origin: [f64; 3], direction: [f64; 9]) -> Result<Box<Grid>> {
    guard(|| {
        let floats = |axis: Numbers| {
            let axis = values(&axis)?;
            Ok((0..axis.len()).map(|i| axis.get(i)).collect::<Vec<_>>())
        };
        let mut place = DMat4::from_mat3(DMat3::from_cols_array(&direction).transpose());
        place.w_axis = DVec3::from_array(origin).extend(1.0);
        halite::Grid::rectilinear([floats(x)?, floats(y)?, floats(z)?], vec![], vec![])?
            .transformed(place)
            .map(Box::from)
    })
}

pub(super) fn add_grid_array(grid: &mut Grid, name: &str, of_cells: bool, n: usize, numbers: Numbers) -> Result<()> {
    guard(|| {
        let array = Array { name: name.to_owned(), components: n, values: values(&numbers)? };
        if of_cells { grid.add_cell_array(array) } else { grid.add_point_array(array) }
    })
}

pub(super) fn set_grid(session: &mut Session, grid: &Grid, matrix: [f64; 16]) -> Result<()> {
    session.guarded(|s| s.set_grid(grid, rows(matrix)))
}
