//! Legacy files of grids that list no cells: STRUCTURED_POINTS, RECTILINEAR_GRID and STRUCTURED_GRID.

use super::scan::{Scanner, Type};
use super::{Parts, told};
use crate::error::{Error, Result};
use crate::grid::{self, Grid, Lattice};
use crate::io::number::Number;
use crate::io::{DataSet, validated};
use crate::mesh::Mesh;
use glam::DVec3;
use std::path::Path;

/// The kinds of such grids.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Image,
    Rectilinear,
    Structured,
}

/// What the file says of the axes.
pub(super) struct Axes {
    kind: Kind,
    /// Points along each.
    size: Option<[usize; 3]>,
    lattice: Lattice,
    coordinates: [Option<Vec<f64>>; 3],
}

const COORDINATES: [&str; 3] = ["X_COORDINATES", "Y_COORDINATES", "Z_COORDINATES"];

impl Axes {
    /// Whether such a grid has a section of that name.
    pub(super) fn has(&self, keyword: &str) -> bool {
        match self.kind {
            Kind::Image => matches!(keyword, "DIMENSIONS" | "EXTENT" | "ORIGIN" | "SPACING" | "ASPECT_RATIO"),
            Kind::Rectilinear => matches!(keyword, "DIMENSIONS" | "EXTENT") || COORDINATES.contains(&keyword),
            Kind::Structured => matches!(keyword, "DIMENSIONS" | "EXTENT"),
        }
    }

    /// Numbers of points and of cells, once they are known.
    pub(super) fn counts(&self) -> [Option<usize>; 2] {
        let count = |along: fn(usize) -> usize| {
            self.size?.iter().try_fold(1_usize, |product, n| product.checked_mul(along(*n)))
        };
        let of_cells = |n: usize| if n < 2 { n } else { n - 1 };
        [count(|n| n), count(of_cells)]
    }
}

impl Parts {
    /// Reads a section that says something of the axes.
    pub(super) fn axis(&mut self, from: &mut Scanner<'_>, keyword: &str) -> Result<(), String> {
        let Some(axes) = &mut self.axes else { return Ok(()) };
        match keyword {
            "DIMENSIONS" => {
                let mut next = || from.count("the number of points along an axis");
                axes.size = Some([next()?, next()?, next()?]);
            }
            "EXTENT" => {
                let mut next = || whole(from);
                let ends = [[next()?, next()?], [next()?, next()?], [next()?, next()?]];
                axes.lattice.first = ends.map(|[low, _]| low.into());
                let size = ends.map(|[low, high]| i64::from(high) - i64::from(low) + 1);
                axes.size = Some(size.map(|n| usize::try_from(n).unwrap_or(0)));
            }
            "ORIGIN" => axes.lattice.origin = triple(from)?,
            "SPACING" | "ASPECT_RATIO" => axes.lattice.spacing = triple(from)?,
            _ => {
                let count = from.count("the number of coordinates")?;
                let kind = Type::from_name(&from.word("their type")?, from.binary)?;
                let values = from.values(kind, Some(count))?.ok_or("they are strings")?;
                let a = COORDINATES.iter().position(|known| *known == keyword).unwrap_or_default();
                axes.coordinates[a] = Some((0..count).map(|i| values.get(i)).collect());
            }
        }
        Ok(())
    }
}

fn whole(from: &mut Scanner<'_>) -> Result<i32, String> {
    let word = from.word("an index")?;
    word.parse().map_err(|_| format!("\"{}\" is not an index", word.escape_debug()))
}

fn triple(from: &mut Scanner<'_>) -> Result<DVec3, String> {
    let mut next = || {
        let word = from.word("three numbers")?;
        f64::parse(&word).ok_or_else(|| format!("\"{}\" is not a number", word.escape_debug()))
    };
    Ok(DVec3::new(next()?, next()?, next()?))
}

/// Reads what follows the kind of the data set.
pub(super) fn read(path: &Path, scanner: &mut Scanner<'_>, kind: Kind) -> Result<DataSet> {
    let axes = Axes { kind, size: None, lattice: Lattice::default(), coordinates: [const { None }; 3] };
    let mut parts = Parts { axes: Some(axes), ..Parts::default() };
    let malformed = |what: String| Error::malformed(path, what);
    parts.scan(scanner).map_err(malformed)?;
    let wrong = parts.wrong_count();
    let Parts { axes, points, arrays: [of_points, of_cells], attributes, notes, .. } = parts;
    let Some(Axes { size, mut lattice, coordinates, .. }) = axes else { return Err(malformed("no axes".into())) };
    let size = size.ok_or_else(|| malformed("it does not say its DIMENSIONS".into()))?;
    if let Some(what) = wrong {
        return Err(malformed(what));
    }
    let empty = size.contains(&0);
    let made = match kind {
        _ if empty => grid::cells([0; 3], grid::BENT)
            .and_then(|none| Mesh::new(vec![], none, of_points, of_cells))
            .map(DataSet::Mesh),
        Kind::Image => {
            lattice.size = size;
            Grid::regular(&lattice, of_points, of_cells).map(DataSet::Grid)
        }
        Kind::Rectilinear => {
            let mut axes = [const { Vec::new() }; 3];
            for (a, coordinates) in coordinates.into_iter().enumerate() {
                let given = coordinates.ok_or_else(|| malformed(format!("it has no {}", COORDINATES[a])))?;
                if given.len() != size[a] {
                    let what = format!("{} has {} numbers where there are {}", COORDINATES[a], given.len(), size[a]);
                    return Err(malformed(what));
                }
                axes[a] = given;
            }
            Grid::rectilinear(axes, of_points, of_cells).map(DataSet::Grid)
        }
        Kind::Structured => {
            let points = points.unwrap_or_default();
            let count = size.iter().try_fold(1_usize, |product, n| product.checked_mul(*n));
            if count != Some(points.len()) {
                let [x, y, z] = size;
                let what = format!("it has {} POINTS where its DIMENSIONS are {x} x {y} x {z}", points.len());
                return Err(malformed(what));
            }
            grid::cells(size, grid::BENT)
                .and_then(|cells| Mesh::new(points, cells, of_points, of_cells))
                .map(DataSet::Mesh)
        }
    };
    let mut made = validated(path, made)?;
    let [of_points, of_cells] = told(path, attributes, &notes);
    made.set_attributes(of_points, of_cells);
    Ok(made)
}
