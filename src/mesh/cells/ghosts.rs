//! Which points and cells VTK's arrays say are not to be drawn.

use crate::mesh::Array;

/// The name of VTK's array that marks ghosts, and its bits (`vtkDataSetAttributes.h`).
pub(super) const GHOST_ARRAY: &str = "vtkGhostType";
/// Its forerunner (before VTK 6.3): more than 0 for ghosts.
pub(super) const GHOST_LEVELS_ARRAY: &str = "vtkGhostLevels";
/// DUPLICATECELL | REFINEDCELL | HIDDENCELL.
const GHOST_CELL: u8 = 1 | 8 | 32;
/// HIDDENPOINT.
const GHOST_POINT: u8 = 2;

fn find<'a>(arrays: &'a [Array], name: &str) -> Option<&'a Array> {
    arrays.iter().find(|a| a.name == name && a.components == 1)
}

/// Which points these arrays hide; none if none says.
pub(crate) fn of_points(arrays: &[Array]) -> Option<impl Fn(usize) -> bool + '_> {
    let marks = find(arrays, GHOST_ARRAY)?;
    Some(move |p| marks.values.get(p) as u8 & GHOST_POINT != 0)
}

/// Which cells these arrays leave out; none if none says.
pub(crate) fn of_cells(arrays: &[Array]) -> Option<impl Fn(usize) -> bool + '_> {
    let (marks, levels) = (find(arrays, GHOST_ARRAY), find(arrays, GHOST_LEVELS_ARRAY));
    (marks.is_some() || levels.is_some()).then_some(move |c| {
        marks.is_some_and(|a| a.values.get(c) as u8 & GHOST_CELL != 0) || levels.is_some_and(|a| a.values.get(c) > 0.0)
    })
}
