//! Pieces of grids whose points are counted along axes to one grid.

use super::grid::{Grid, LeftOutBoth};
use super::head::{Piece, Section};
use super::place::Kind;
use crate::error::Result;
use crate::grid::{self, Lattice};
use crate::io::blocks::{Block, Of, duplicates, gather, hide_missing};
use crate::io::{DataSet, validated};
use crate::memory;
use crate::mesh::Mesh;
use glam::DVec3;

impl Grid<'_> {
    /// Reads the arrays, and makes one grid of all pieces. Also says which arrays of points and of cells it left out.
    pub(super) fn structured(&self, kind: Kind, mut lattice: Lattice) -> Result<(DataSet, LeftOutBoth)> {
        let blocks: Vec<Block> = self.pieces.iter().filter(|p| p.points > 0).filter_map(|p| p.block).collect();
        let Some(whole) = Block::around(&blocks) else {
            let empty = Mesh::new(vec![], grid::cells([0; 3], grid::BENT)?, vec![], vec![]);
            return Ok((DataSet::Mesh(validated(self.path, empty)?), Default::default()));
        };
        let mut points = if kind == Kind::Structured { self.points()? } else { vec![] };
        let ((mut of_points, points_left_out), (mut of_cells, cells_left_out)) = {
            let (of_points, of_cells) = rayon::join(|| self.data(Section::PointData), || self.data(Section::CellData));
            (of_points?, of_cells?)
        };
        if blocks.len() > 1 {
            let at = whole.sources(self.path, &blocks, Of::Points, &duplicates(&of_points))?;
            gather(&mut of_points, &at);
            if kind == Kind::Structured {
                let there = |from: &usize| points.get(*from).copied().unwrap_or(DVec3::NAN);
                points = at.iter().map(there).collect();
            }
            let at = whole.sources(self.path, &blocks, Of::Cells, &duplicates(&of_cells))?;
            gather(&mut of_cells, &at);
            hide_missing(&mut of_cells, &at);
        }
        let size = whole.size.map(|n| n as usize);
        let made = match kind {
            Kind::Image => {
                (lattice.first, lattice.size) = (whole.low, size);
                grid::Grid::regular(&lattice, of_points, of_cells).map(DataSet::Grid)
            }
            Kind::Rectilinear => grid::Grid::rectilinear(self.axes(&whole)?, of_points, of_cells).map(DataSet::Grid),
            Kind::Structured | Kind::Unstructured => grid::cells(size, grid::BENT)
                .and_then(|cells| Mesh::new(points, cells, of_points, of_cells))
                .map(DataSet::Mesh),
        };
        Ok((validated(self.path, made)?, [points_left_out, cells_left_out]))
    }

    /// The coordinates along each axis of a rectilinear grid.
    fn axes(&self, whole: &Block) -> Result<[Vec<f64>; 3]> {
        let mut axes = [const { Vec::new() }; 3];
        for (i, piece) in self.pieces.iter().enumerate() {
            let Some(block) = piece.block.filter(|_| piece.points > 0) else { continue };
            for (a, axis) in axes.iter_mut().enumerate() {
                let own = self.axis(i, piece, a, block.size[a])?;
                // Only now is it sure that the file holds what it announces.
                if axis.is_empty() {
                    *axis = memory::filled("the coordinates of a grid", f64::NAN, whole.size[a] as usize)?;
                }
                let start = (block.low[a] - whole.low[a]) as usize;
                for (known, c) in axis[start..].iter_mut().zip(own) {
                    // Pieces may round them apart.
                    if !known.is_nan() && (*known - c).abs() > 1e-6 * c.abs().max(known.abs()) {
                        let what = format!("the Coordinates of piece {i} are not those of the pieces before");
                        return Err(self.malformed(piece, what));
                    }
                    *known = if known.is_nan() { c } else { *known };
                }
            }
        }
        axes.iter_mut().for_each(|axis| fill(axis));
        Ok(axes)
    }

    fn axis(&self, i: usize, piece: &Piece, a: usize, count: u64) -> Result<Vec<f64>> {
        let fail = |what: &str| {
            let axis = ["x", "y", "z"][a];
            self.malformed(piece, format!("the Coordinates of piece {i} along {axis} {what}"))
        };
        match piece.arrays(Section::Coordinates).get(a) {
            None => Err(fail("are missing")),
            Some(array) if array.components != 1 => Err(fail(&format!("have {} components, not 1", array.components))),
            Some(array) => self.floats(piece, array, count),
        }
    }
}

/// Puts evenly between their neighbours what no piece has.
fn fill(axis: &mut [f64]) {
    let known: Vec<usize> = (0..axis.len()).filter(|i| !axis[*i].is_nan()).collect();
    for w in known.windows(2) {
        let (from, to) = (axis[w[0]], axis[w[1]]);
        for (i, c) in axis[w[0]..w[1]].iter_mut().enumerate().skip(1) {
            *c = from + (to - from) * i as f64 / (w[1] - w[0]) as f64;
        }
    }
}
