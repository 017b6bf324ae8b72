//! Cells to tetrahedra: every 3D cell is split so that two neighbours split their shared face by the same diagonal.
//!
//! The rule needs no adjacency, only a total order of the points that all cells agree on (Dompierre, Labbé, Vallet &
//! Camarero, How to Subdivide Pyramids, Prisms and Hexahedra into Tetrahedra, 1999): a cell is coned from its smallest
//! point, and each face without that point is fanned from its own smallest point. A face is thus always fanned from
//! its smallest point, whichever cell looks at it. The order is that of exact positions (x, then y, then z), so cells
//! that do not share point indices agree too; indices only break ties.

use crate::error::{Error, Result};
use crate::mesh::{Array, Mesh};
use glam::DVec3;
use rayon::prelude::*;
use std::cmp::Ordering;
use std::collections::BTreeMap;

/// The most tetrahedra that can be indexed: a face is numbered by four times its tetrahedron plus its corner.
pub const MAX_TETRAHEDRA: usize = (1 << 30) - 1;

/// Cells that one task splits.
const CHUNK: usize = 1 << 14;

/// The name of VTK's array that marks ghosts, and its bits (`vtkDataSetAttributes.h`).
const GHOST_ARRAY: &str = "vtkGhostType";
/// DUPLICATECELL | REFINEDCELL | HIDDENCELL.
const GHOST_CELL: u8 = 1 | 8 | 32;
/// HIDDENPOINT.
const GHOST_POINT: u8 = 2;

/// The tetrahedra that a mesh's 3D cells are split into.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Tetrahedra {
    /// The four points of each tetrahedron: indices into [`Mesh::points`]. A cell that is not inverted gives
    /// tetrahedra with det(p1 − p0, p2 − p0, p3 − p0) > 0, but meshes hold cells of both kinds: [`super::faces`] finds
    /// out which is which.
    pub corners: Vec<[u32; 4]>,
    /// The cell that each tetrahedron is a part of, ascending; `None` if tetrahedron `i` is cell `i`.
    pub cell: Option<Vec<u32>>,
    /// Number of cells that `corners` holds.
    pub cells: usize,
    /// The cells that were left out, by reason.
    pub skipped: Skipped,
}

/// How many cells were left out, by reason; each cell counts once, for the first reason that holds.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Skipped {
    /// Cells of dimension 0, 1 or 2.
    pub lower_dimensional: usize,
    /// 3D cells of a type that is not drawn yet, by VTK cell type; see [`name`].
    pub unsupported: BTreeMap<u8, usize>,
    /// Cells that the array `vtkGhostType` marks as duplicate, refined or hidden, or with a point that it hides.
    pub ghost: usize,
    /// Cells with a point that is NaN or infinite.
    pub invisible: usize,
}

impl Skipped {
    /// The number of cells left out for any reason.
    pub fn total(&self) -> usize {
        self.lower_dimensional + self.unsupported.values().sum::<usize>() + self.ghost + self.invisible
    }

    fn merge(mut self, other: Self) -> Self {
        self.lower_dimensional += other.lower_dimensional;
        self.ghost += other.ghost;
        self.invisible += other.invisible;
        for (t, n) in other.unsupported {
            *self.unsupported.entry(t).or_default() += n;
        }
        self
    }
}

/// How a cell type is split: its faces, as local points, seen counter-clockwise from outside a cell that is numbered as
/// VTK documents it (`vtkTetra.h` and so on; the wedge's triangle 0 1 2 looks outward).
struct Shape {
    points: usize,
    /// Tetrahedra that the cell gives, whichever of its points is smallest.
    tetrahedra: usize,
    faces: &'static [&'static [u8]],
}

static TETRA: Shape = Shape { points: 4, tetrahedra: 1, faces: &[&[0, 1, 3], &[1, 2, 3], &[2, 0, 3], &[0, 2, 1]] };
static VOXEL: Shape = Shape {
    points: 8,
    tetrahedra: 6,
    faces: &[&[0, 4, 6, 2], &[1, 3, 7, 5], &[0, 1, 5, 4], &[2, 6, 7, 3], &[0, 2, 3, 1], &[4, 5, 7, 6]],
};
static HEXAHEDRON: Shape = Shape {
    points: 8,
    tetrahedra: 6,
    faces: &[&[0, 4, 7, 3], &[1, 2, 6, 5], &[0, 1, 5, 4], &[3, 7, 6, 2], &[0, 3, 2, 1], &[4, 5, 6, 7]],
};
static WEDGE: Shape =
    Shape { points: 6, tetrahedra: 3, faces: &[&[0, 1, 2], &[3, 5, 4], &[0, 3, 4, 1], &[1, 4, 5, 2], &[2, 5, 3, 0]] };
static PYRAMID: Shape =
    Shape { points: 5, tetrahedra: 2, faces: &[&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]] };

/// How `vtk_type` is split, if it is supported.
fn shape(vtk_type: u8) -> Option<&'static Shape> {
    match vtk_type {
        10 => Some(&TETRA),
        11 => Some(&VOXEL),
        12 => Some(&HEXAHEDRON),
        13 => Some(&WEDGE),
        14 => Some(&PYRAMID),
        _ => None,
    }
}

/// What happens to a cell.
enum Fate {
    Drawn(&'static Shape),
    LowerDimensional,
    Unsupported,
    Ghost,
    Invisible,
}

/// A mesh, and which of its cells and points are not to be drawn.
struct Splitter<'a> {
    mesh: &'a Mesh,
    ghost_cells: Option<&'a Array>,
    /// [`HIDDEN`] and [`NOT_FINITE`] bits of each point; `None` if all are 0.
    marks: Option<Vec<u8>>,
}

const HIDDEN: u8 = 1;
const NOT_FINITE: u8 = 2;

impl Tetrahedra {
    /// Splits the cells of `mesh`, on the current rayon pool.
    ///
    /// # Errors
    /// [`Error::Empty`] if no 3D cell is left to draw; [`Error::Mesh`] if a cell has not the number of points that its type
    /// demands, or if there would be more than [`MAX_TETRAHEDRA`].
    pub fn new(mesh: &Mesh) -> Result<Self> {
        let splitter = Splitter::new(mesh);
        let n = mesh.cells().len();
        let chunks: Vec<(usize, Skipped)> =
            (0..n.div_ceil(CHUNK)).into_par_iter().map(|i| splitter.count(chunk(i, n))).collect::<Result<_>>()?;
        let (counts, skipped): (Vec<usize>, Vec<Skipped>) = chunks.into_iter().unzip();
        let skipped = skipped.into_iter().fold(Skipped::default(), Skipped::merge);
        let total: usize = counts.iter().sum();
        if total == 0 {
            return Err(Error::Empty(nothing_left(mesh, &skipped)));
        }
        if total > MAX_TETRAHEDRA {
            let what = format!("its cells make {total} tetrahedra, more than Halite can index ({MAX_TETRAHEDRA})");
            return Err(Error::Mesh(what));
        }
        let mut corners = vec![[0; 4]; total];
        let one_to_one = skipped.total() == 0 && mesh.cells().types.par_iter().all(|&t| t == 10);
        let mut cell = if one_to_one { Vec::new() } else { vec![0; total] };
        split_by(&mut corners, &counts)
            .into_par_iter()
            .zip(if one_to_one {
                counts.iter().map(|_| <&mut [u32]>::default()).collect()
            } else {
                split_by(&mut cell, &counts)
            })
            .enumerate()
            .for_each(|(i, (corners, cell))| splitter.fill(chunk(i, n), corners, cell));
        let cells = n - skipped.total();
        Ok(Tetrahedra { corners, cell: (!one_to_one).then_some(cell), cells, skipped })
    }
}

/// The cells of chunk `i` of `n`.
fn chunk(i: usize, n: usize) -> std::ops::Range<usize> {
    i * CHUNK..n.min((i + 1) * CHUNK)
}

/// Cuts `all` into parts of the given lengths.
fn split_by<'a, T>(mut all: &'a mut [T], lengths: &[usize]) -> Vec<&'a mut [T]> {
    lengths
        .iter()
        .map(|&n| {
            let (part, rest) = std::mem::take(&mut all).split_at_mut(n);
            all = rest;
            part
        })
        .collect()
}

impl<'a> Splitter<'a> {
    fn new(mesh: &'a Mesh) -> Self {
        let ghosts = |arrays: &'a [Array]| arrays.iter().find(|a| a.name == GHOST_ARRAY && a.components == 1);
        let hidden = ghosts(mesh.point_arrays());
        let mark = |(i, p): (usize, &DVec3)| {
            let hide = hidden.is_some_and(|a| a.values.get(i) as u8 & GHOST_POINT != 0);
            (if hide { HIDDEN } else { 0 }) | if p.is_finite() { 0 } else { NOT_FINITE }
        };
        let points = || mesh.points().par_iter().enumerate();
        let marks = points().any(|p| mark(p) != 0).then(|| points().map(mark).collect());
        Splitter { mesh, ghost_cells: ghosts(mesh.cell_arrays()), marks }
    }

    fn fate(&self, c: usize) -> Result<Fate> {
        let cells = self.mesh.cells();
        let vtk_type = cells.types[c];
        let Some(shape) = shape(vtk_type) else {
            return Ok(if dimension(vtk_type).is_some_and(|d| d < 3) {
                Fate::LowerDimensional
            } else {
                Fate::Unsupported
            });
        };
        let points = cells.points(c);
        if points.len() != shape.points {
            return Err(Error::Mesh(format!(
                "cell {c} is a {} with {} points, but that has {}",
                name(vtk_type),
                points.len(),
                shape.points
            )));
        }
        let marks = self.marks.as_ref().map_or(0, |marks| points.iter().fold(0, |m, &p| m | marks[p as usize]));
        let ghost = self.ghost_cells.is_some_and(|a| a.values.get(c) as u8 & GHOST_CELL != 0);
        Ok(if ghost || marks & HIDDEN != 0 {
            Fate::Ghost
        } else if marks & NOT_FINITE != 0 {
            Fate::Invisible
        } else {
            Fate::Drawn(shape)
        })
    }

    /// How many tetrahedra the cells `range` give, and what is left out.
    fn count(&self, range: std::ops::Range<usize>) -> Result<(usize, Skipped)> {
        let (mut tetrahedra, mut skipped) = (0, Skipped::default());
        for c in range {
            match self.fate(c)? {
                Fate::Drawn(shape) => tetrahedra += shape.tetrahedra,
                Fate::LowerDimensional => skipped.lower_dimensional += 1,
                Fate::Unsupported => *skipped.unsupported.entry(self.mesh.cells().types[c]).or_default() += 1,
                Fate::Ghost => skipped.ghost += 1,
                Fate::Invisible => skipped.invisible += 1,
            }
        }
        Ok((tetrahedra, skipped))
    }

    /// Writes the tetrahedra of the cells `range` to `corners`, and to `cell` (empty if not wanted) where they are from.
    fn fill(&self, range: std::ops::Range<usize>, corners: &mut [[u32; 4]], cell: &mut [u32]) {
        let mut at = 0;
        for c in range {
            let Ok(Fate::Drawn(shape)) = self.fate(c) else { continue };
            let end = at + shape.tetrahedra;
            split(shape, self.mesh.cells().points(c), self.mesh.points(), &mut corners[at..end]);
            if !cell.is_empty() {
                cell[at..end].fill(c as u32);
            }
            at = end;
        }
    }
}

/// Splits one cell with the points `ids` into `out`, by the rule that the module describes.
fn split(shape: &Shape, ids: &[u32], points: &[DVec3], out: &mut [[u32; 4]]) {
    if let ([out], &[a, b, c, d]) = (&mut *out, ids) {
        *out = [a, b, c, d];
        return;
    }
    let smaller = |&a: &u8, &b: &u8| order(points, ids[a as usize], ids[b as usize]);
    let apex = (0..ids.len() as u8).min_by(smaller).unwrap_or(0);
    let mut at = 0;
    for face in shape.faces.iter().filter(|f| !f.contains(&apex)) {
        let first = (0..face.len()).min_by(|&i, &j| smaller(&face[i], &face[j])).unwrap_or(0);
        let corner = |i: usize| ids[face[(first + i) % face.len()] as usize];
        for i in 2..face.len() {
            out[at] = [ids[apex as usize], corner(0), corner(i - 1), corner(i)];
            at += 1;
        }
    }
}

/// The order of all points: by x, then y, then z, then index.
fn order(points: &[DVec3], a: u32, b: u32) -> Ordering {
    let (p, q) = (points[a as usize], points[b as usize]);
    // Points of drawn cells are finite, so that a comparison always has an answer; −0 equals 0.
    let by = |x: f64, y: f64| x.partial_cmp(&y).unwrap_or(Ordering::Equal);
    by(p.x, q.x).then_with(|| by(p.y, q.y)).then_with(|| by(p.z, q.z)).then_with(|| a.cmp(&b))
}

/// Says what a mesh has instead of 3D cells to draw.
fn nothing_left(mesh: &Mesh, skipped: &Skipped) -> String {
    if mesh.cells().is_empty() {
        return format!("it has no cells, only {} points", mesh.points().len());
    }
    let mut types = BTreeMap::<u8, usize>::new();
    for &t in &mesh.cells().types {
        *types.entry(t).or_default() += 1;
    }
    let types: Vec<String> = types.into_iter().map(|(t, n)| format!("{n} of type {}", name(t))).collect();
    let unsupported: usize = skipped.unsupported.values().sum();
    let reasons: Vec<String> = [
        (skipped.lower_dimensional, "below three dimensions"),
        (unsupported, "of a type that Halite does not draw"),
        (skipped.ghost, "ghosts or hidden"),
        (skipped.invisible, "with points that are NaN or infinite"),
    ]
    .into_iter()
    .filter(|(n, _)| *n > 0)
    .map(|(n, why)| format!("{n} {why}"))
    .collect();
    format!("it has no 3D cell to draw; its cells are {}: {}", types.join(", "), reasons.join(", "))
}

/// Names and dimensions of VTK's cell types (`vtkCellType.h`).
static TYPES: &[(u8, u8, &str)] = &[
    (0, 0, "empty cell"),
    (1, 0, "vertex"),
    (2, 0, "poly-vertex"),
    (3, 1, "line"),
    (4, 1, "poly-line"),
    (5, 2, "triangle"),
    (6, 2, "triangle strip"),
    (7, 2, "polygon"),
    (8, 2, "pixel"),
    (9, 2, "quad"),
    (10, 3, "tetrahedron"),
    (11, 3, "voxel"),
    (12, 3, "hexahedron"),
    (13, 3, "wedge"),
    (14, 3, "pyramid"),
    (15, 3, "pentagonal prism"),
    (16, 3, "hexagonal prism"),
    (21, 1, "quadratic edge"),
    (22, 2, "quadratic triangle"),
    (23, 2, "quadratic quad"),
    (24, 3, "quadratic tetrahedron"),
    (25, 3, "quadratic hexahedron"),
    (26, 3, "quadratic wedge"),
    (27, 3, "quadratic pyramid"),
    (28, 2, "biquadratic quad"),
    (29, 3, "triquadratic hexahedron"),
    (30, 2, "quadratic linear quad"),
    (31, 3, "quadratic linear wedge"),
    (32, 3, "biquadratic quadratic wedge"),
    (33, 3, "biquadratic quadratic hexahedron"),
    (34, 2, "biquadratic triangle"),
    (35, 1, "cubic line"),
    (36, 2, "quadratic polygon"),
    (37, 3, "triquadratic pyramid"),
    (41, 3, "convex point set"),
    (42, 3, "polyhedron"),
    (51, 1, "parametric curve"),
    (52, 2, "parametric surface"),
    (53, 2, "parametric triangle surface"),
    (54, 2, "parametric quad surface"),
    (55, 3, "parametric tetrahedron region"),
    (56, 3, "parametric hexahedron region"),
    (60, 1, "higher-order edge"),
    (61, 2, "higher-order triangle"),
    (62, 2, "higher-order quad"),
    (63, 2, "higher-order polygon"),
    (64, 3, "higher-order tetrahedron"),
    (65, 3, "higher-order wedge"),
    (66, 3, "higher-order pyramid"),
    (67, 3, "higher-order hexahedron"),
    (68, 1, "Lagrange curve"),
    (69, 2, "Lagrange triangle"),
    (70, 2, "Lagrange quadrilateral"),
    (71, 3, "Lagrange tetrahedron"),
    (72, 3, "Lagrange hexahedron"),
    (73, 3, "Lagrange wedge"),
    (74, 3, "Lagrange pyramid"),
    (75, 1, "Bezier curve"),
    (76, 2, "Bezier triangle"),
    (77, 2, "Bezier quadrilateral"),
    (78, 3, "Bezier tetrahedron"),
    (79, 3, "Bezier hexahedron"),
    (80, 3, "Bezier wedge"),
    (81, 3, "Bezier pyramid"),
];

/// What VTK calls a cell type, in words; "unknown cell type" if it has none of that number.
pub fn name(vtk_type: u8) -> &'static str {
    TYPES.iter().find(|t| t.0 == vtk_type).map_or("unknown cell type", |t| t.2)
}

/// The dimension of a cell type, 0 to 3; `None` if VTK has none of that number.
pub fn dimension(vtk_type: u8) -> Option<u8> {
    TYPES.iter().find(|t| t.0 == vtk_type).map(|t| t.1)
}
