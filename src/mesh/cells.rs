//! Cells to tetrahedra: every 3D cell is split so that two neighbours split their shared face by the same diagonal.
//!
//! The rule needs no adjacency, only a total order of the points that all cells agree on (Dompierre, Labbé, Vallet &
//! Camarero, How to Subdivide Pyramids, Prisms and Hexahedra into Tetrahedra, 1999): a cell is coned from its smallest
//! point, and each face without that point is fanned from its own smallest point. A face is thus always fanned from
//! its smallest point, whichever cell looks at it. The order is that of exact positions (x, then y, then z), so cells
//! that do not share point indices agree too; indices only break ties.

//! Cells of higher order are split through all their nodes (`curved`), polyhedra around a point in their middle
//! (`polyhedron`); both may add points to those of the mesh.

mod curved;
mod polyhedron;
mod types;

pub use types::{dimension, name};

use crate::error::{Error, Result};
use crate::mesh::{Array, Mesh, POLYHEDRON, Polyhedra};
use curved::{Node, Recipe};
use glam::DVec3;
use polyhedron::Cut;
use rayon::prelude::*;
use std::borrow::Cow;
use std::cmp::Ordering;
use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

/// The most tetrahedra that can be indexed: a face is numbered by four times its tetrahedron plus its corner.
pub const MAX_TETRAHEDRA: usize = (1 << 30) - 1;

/// Cells that one task splits.
const CHUNK: usize = 1 << 14;

/// The cell array that tells the degrees of Lagrange and Bézier cells, and the point array that makes the latter rational.
const DEGREES_ARRAY: &str = "HigherOrderDegrees";
const WEIGHTS_ARRAY: &str = "RationalWeights";

/// The name of VTK's array that marks ghosts, and its bits (`vtkDataSetAttributes.h`).
const GHOST_ARRAY: &str = "vtkGhostType";
/// Its forerunner (before VTK 6.3): more than 0 for ghosts.
const GHOST_LEVELS_ARRAY: &str = "vtkGhostLevels";
/// DUPLICATECELL | REFINEDCELL | HIDDENCELL.
const GHOST_CELL: u8 = 1 | 8 | 32;
/// HIDDENPOINT.
const GHOST_POINT: u8 = 2;

/// The tetrahedra that a mesh's 3D cells are split into.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Tetrahedra {
    /// The four points of each tetrahedron: indices into [`Tetrahedra::points`]. A cell that is not inverted gives
    /// tetrahedra with det(p1 − p0, p2 − p0, p3 − p0) > 0, but meshes hold cells of both kinds: [`super::faces`] finds
    /// out which is which.
    pub corners: Vec<[u32; 4]>,
    /// The cell that each tetrahedron is a part of, ascending; `None` if tetrahedron `i` is cell `i`.
    pub cell: Option<Vec<u32>>,
    /// Number of cells that `corners` holds.
    pub cells: usize,
    /// The points that the split added.
    pub added: Added,
    /// The cells that were left out, by reason.
    pub skipped: Skipped,
    /// Polyhedra with no point inside that sees all of their faces: some of their tetrahedra overlap.
    pub crooked: usize,
}

/// Points that a split added, each the weighted mean of points of the mesh. Values at points are made likewise.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Added {
    /// The index of the first added point: the number of points of the mesh.
    pub first: u32,
    /// Added point `i` is made of the entries `ends[i − 1]..ends[i]` of the other two, the first from 0 on.
    pub ends: Vec<u64>,
    /// Points of the mesh.
    pub sources: Vec<u32>,
    /// The weight of each, which add up to 1 for each added point.
    pub weights: Vec<f64>,
}

impl Added {
    /// Number of points.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// True if there is none.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// The points and weights that added point `i` is made of.
    ///
    /// # Panics
    /// If `i` is not below [`Added::len`].
    pub fn of(&self, i: usize) -> impl Iterator<Item = (u32, f64)> + '_ {
        let range = if i == 0 { 0 } else { self.ends[i - 1] as usize }..self.ends[i] as usize;
        self.sources[range.clone()].iter().copied().zip(self.weights[range].iter().copied())
    }

    fn push(&mut self, entries: impl Iterator<Item = (u32, f64)>) {
        for (source, weight) in entries {
            self.sources.push(source);
            self.weights.push(weight);
        }
        self.ends.push(self.sources.len() as u64);
    }
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
    /// Polyhedra without a face of three points or more.
    pub empty: usize,
}

#[cfg(test)]
impl Shape {
    fn volume(&self, places: &[[f64; 3]; 8]) -> f64 {
        let mut out = vec![[0; 4]; self.tetrahedra];
        let ids: Vec<u32> = (0..self.points as u32).collect();
        let place = |n: u32| DVec3::from(places[n as usize]);
        split(self, &ids, place, &mut out);
        let volume = |[a, b, c, d]: [DVec3; 4]| (b - a).cross(c - a).dot(d - a).abs() / 6.0;
        out.iter().map(|t| volume(t.map(place))).sum()
    }
}

impl Skipped {
    /// The number of cells left out for any reason.
    pub fn total(&self) -> usize {
        self.lower_dimensional + self.unsupported.values().sum::<usize>() + self.ghost + self.invisible + self.empty
    }

    fn merge(mut self, other: Self) -> Self {
        self.lower_dimensional += other.lower_dimensional;
        self.ghost += other.ghost;
        self.invisible += other.invisible;
        self.empty += other.empty;
        for (t, n) in other.unsupported {
            *self.unsupported.entry(t).or_default() += n;
        }
        self
    }
}

/// How a cell type is split: its faces, as local points, seen counter-clockwise from outside a cell that is numbered as
/// VTK documents it (`vtkTetra.h` and so on; the wedge's triangle 0 1 2 looks outward).
#[derive(Debug)]
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

/// Between the small tetrahedra of a lattice: corners 0 and 5, 1 and 4, 2 and 3 are opposite.
static OCTAHEDRON: Shape = Shape {
    points: 6,
    tetrahedra: 4,
    faces: &[&[0, 1, 2], &[0, 2, 4], &[0, 4, 3], &[0, 3, 1], &[5, 2, 1], &[5, 4, 2], &[5, 3, 4], &[5, 1, 3]],
};

/// The faces of prisms over a pentagon and a hexagon (`vtkPentagonalPrism.h`, `vtkHexagonalPrism.h`).
static PRISM_5: [&[u8]; 7] =
    [&[0, 4, 3, 2, 1], &[5, 6, 7, 8, 9], &[0, 1, 6, 5], &[1, 2, 7, 6], &[2, 3, 8, 7], &[3, 4, 9, 8], &[4, 0, 5, 9]];
static PRISM_6: [&[u8]; 8] = [
    &[0, 5, 4, 3, 2, 1],
    &[6, 7, 8, 9, 10, 11],
    &[0, 1, 7, 6],
    &[1, 2, 8, 7],
    &[2, 3, 9, 8],
    &[3, 4, 10, 9],
    &[4, 5, 11, 10],
    &[5, 0, 6, 11],
];

/// How `vtk_type` is split, if it is linear.
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
enum Fate<'a> {
    Linear(&'static Shape),
    Curved(&'a Recipe),
    /// Prisms, with the faces given, and polyhedra.
    Polyhedron(Option<&'static [&'static [u8]]>),
    LowerDimensional,
    Unsupported,
    Ghost,
    Invisible,
}

/// What identifies a [`Recipe`]: type, number of points, degrees.
type Key = (u8, usize, [usize; 3]);

/// A mesh, and which of its cells and points are not to be drawn.
struct Splitter<'a> {
    mesh: &'a Mesh,
    polyhedra: Option<&'a Polyhedra>,
    ghost_cells: Option<&'a Array>,
    ghost_levels: Option<&'a Array>,
    degrees: Option<&'a Array>,
    rational: Option<&'a Array>,
    recipes: HashMap<Key, Result<Recipe, String>>,
    /// [`HIDDEN`] and [`NOT_FINITE`] bits of each point; `None` if all are 0.
    marks: Option<Vec<u8>>,
}

const HIDDEN: u8 = 1;
const NOT_FINITE: u8 = 2;

/// What a range of cells gives.
#[derive(Debug, Default)]
struct Count {
    tetrahedra: usize,
    added: usize,
    skipped: Skipped,
}

impl Tetrahedra {
    /// Splits the cells of `mesh`, on the current rayon pool.
    ///
    /// # Errors
    /// [`Error::Empty`] if no 3D cell is left to draw; [`Error::Mesh`] if a cell has not the number of points that its type
    /// demands, or if there would be more than [`MAX_TETRAHEDRA`], or 2³² points.
    pub fn new(mesh: &Mesh) -> Result<Self> {
        let splitter = Splitter::new(mesh);
        let n = mesh.cells().len();
        let counts: Vec<Count> = (0..n.div_ceil(CHUNK))
            .into_par_iter()
            .map_init(Cut::default, |cut, i| splitter.count(chunk(i, n), cut))
            .collect::<Result<_>>()?;
        let skipped = counts.iter().fold(Skipped::default(), |all, count| all.merge(count.skipped.clone()));
        let counted: Vec<usize> = counts.iter().map(|count| count.tetrahedra).collect();
        let (total, first) = (counted.iter().sum::<usize>(), mesh.points().len());
        if total == 0 {
            return Err(Error::Empty(nothing_left(mesh, &skipped)));
        }
        let added: usize = counts.iter().map(|count| count.added).sum();
        if total > MAX_TETRAHEDRA || first + added >= u32::MAX as usize {
            let what = format!(
                "its cells make {total} tetrahedra of {} points, more than Halite can index ({MAX_TETRAHEDRA}, 2^32 - 2)",
                first + added
            );
            return Err(Error::Mesh(what));
        }
        let firsts = counts.iter().scan(first, |at, count| {
            *at += count.added;
            Some((*at - count.added) as u32)
        });
        let firsts: Vec<u32> = firsts.collect();
        let mut corners = vec![[0; 4]; total];
        let one_to_one = skipped.total() == 0 && mesh.cells().types.par_iter().all(|&t| t == 10);
        let mut cell = if one_to_one { Vec::new() } else { vec![0; total] };
        let parts: Vec<(Added, usize)> = split_by(&mut corners, &counted)
            .into_par_iter()
            .zip(if one_to_one {
                counts.iter().map(|_| <&mut [u32]>::default()).collect()
            } else {
                split_by(&mut cell, &counted)
            })
            .enumerate()
            .map(|(i, (corners, cell))| splitter.fill(chunk(i, n), firsts[i], corners, cell))
            .collect();
        let mut added = Added { first: first as u32, ..Added::default() };
        for (part, _) in &parts {
            let base = added.sources.len() as u64;
            added.ends.extend(part.ends.iter().map(|end| base + end));
            added.sources.extend_from_slice(&part.sources);
            added.weights.extend_from_slice(&part.weights);
        }
        let crooked = parts.iter().map(|part| part.1).sum();
        let cells = n - skipped.total();
        Ok(Tetrahedra { corners, cell: (!one_to_one).then_some(cell), cells, added, skipped, crooked })
    }

    /// The points that [`Tetrahedra::corners`] index: those of the mesh, and after them those that the split added.
    ///
    /// # Panics
    /// If there are fewer points than the mesh had that was split.
    pub fn points<'a>(&self, of_mesh: &'a [DVec3]) -> Cow<'a, [DVec3]> {
        if self.added.is_empty() {
            return Cow::Borrowed(of_mesh);
        }
        let added = (0..self.added.len()).into_par_iter().map(|i| mean(of_mesh, self.added.of(i)));
        Cow::Owned(of_mesh.par_iter().copied().chain(added).collect())
    }

    /// The same for values, `components` of them for each point.
    ///
    /// # Panics
    /// If there are fewer values than the mesh that was split has points, times `components`.
    pub fn values<'a>(&self, of_mesh: &'a [f32], components: usize) -> Cow<'a, [f32]> {
        if self.added.is_empty() {
            return Cow::Borrowed(of_mesh);
        }
        let value = |i: usize, k: usize| {
            let at = |(source, weight): (u32, f64)| weight * f64::from(of_mesh[source as usize * components + k]);
            self.added.of(i).map(at).sum::<f64>() as f32
        };
        let added = (0..self.added.len() * components).into_par_iter().map(|i| value(i / components, i % components));
        Cow::Owned(of_mesh.par_iter().copied().chain(added).collect())
    }
}

/// The weighted mean of points; of the same bits for the same entries in the same order.
fn mean(points: &[DVec3], entries: impl Iterator<Item = (u32, f64)>) -> DVec3 {
    entries.map(|(source, weight)| points[source as usize] * weight).sum()
}

/// The cells of chunk `i` of `n`.
fn chunk(i: usize, n: usize) -> Range<usize> {
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
        let find = |arrays: &'a [Array], name: &str, components: usize| {
            arrays.iter().find(|a| a.name == name && a.components == components)
        };
        let hidden = find(mesh.point_arrays(), GHOST_ARRAY, 1);
        let mark = |(i, p): (usize, &DVec3)| {
            let hide = hidden.is_some_and(|a| a.values.get(i) as u8 & GHOST_POINT != 0);
            (if hide { HIDDEN } else { 0 }) | if p.is_finite() { 0 } else { NOT_FINITE }
        };
        let points = || mesh.points().par_iter().enumerate();
        let marks = points().any(|p| mark(p) != 0).then(|| points().map(mark).collect());
        let mut splitter = Splitter {
            mesh,
            polyhedra: mesh.polyhedra(),
            ghost_cells: find(mesh.cell_arrays(), GHOST_ARRAY, 1),
            ghost_levels: find(mesh.cell_arrays(), GHOST_LEVELS_ARRAY, 1),
            degrees: find(mesh.cell_arrays(), DEGREES_ARRAY, 3),
            rational: find(mesh.point_arrays(), WEIGHTS_ARRAY, 1),
            recipes: HashMap::new(),
            marks,
        };
        for (c, t) in mesh.cells().types.iter().enumerate().filter(|(_, t)| curved::is_curved(**t)) {
            let key = splitter.key(c);
            splitter.recipes.entry(key).or_insert_with(|| Recipe::new(*t, key.1, key.2));
        }
        splitter
    }

    fn key(&self, c: usize) -> Key {
        let vtk_type = self.mesh.cells().types[c];
        let degrees = self.degrees.filter(|_| curved::has_degrees(vtk_type));
        let degree = |k: usize| degrees.map_or(0, |a| a.values.get(3 * c + k) as usize);
        (vtk_type, self.mesh.cells().points(c).len(), [0, 1, 2].map(degree))
    }

    fn fate(&self, c: usize) -> Result<Fate<'_>> {
        let cells = self.mesh.cells();
        let (vtk_type, points) = (cells.types[c], cells.points(c));
        let wrong = |what: &str| Error::Mesh(format!("cell {c} is a {} {what}", name(vtk_type)));
        let expect = |n: usize| match points.len() == n {
            true => Ok(()),
            false => Err(wrong(&format!("with {} points, but that has {n}", points.len()))),
        };
        let fate = match vtk_type {
            15 => expect(10).map(|()| Fate::Polyhedron(Some(&PRISM_5)))?,
            16 => expect(12).map(|()| Fate::Polyhedron(Some(&PRISM_6)))?,
            POLYHEDRON if self.polyhedra.is_some() => Fate::Polyhedron(None),
            t if curved::is_curved(t) => match self.recipes.get(&self.key(c)) {
                Some(Ok(recipe)) => Fate::Curved(recipe),
                Some(Err(what)) => return Err(wrong(what)),
                None => Fate::Unsupported,
            },
            t => match shape(t) {
                Some(shape) => expect(shape.points).map(|()| Fate::Linear(shape))?,
                None if dimension(t).is_some_and(|d| d < 3) => return Ok(Fate::LowerDimensional),
                None => return Ok(Fate::Unsupported),
            },
        };
        let mark = |m: u8, p: &u32| m | self.marks.as_ref().map_or(0, |marks| marks[*p as usize]);
        let mut marks = points.iter().fold(0, mark);
        if let (Fate::Polyhedron(None), Some(polyhedra)) = (&fate, self.polyhedra) {
            marks = polyhedra.faces(c).flatten().fold(marks, mark);
        }
        let ghost = self.ghost_cells.is_some_and(|a| a.values.get(c) as u8 & GHOST_CELL != 0)
            || self.ghost_levels.is_some_and(|a| a.values.get(c) > 0.0);
        Ok(if ghost || marks & HIDDEN != 0 {
            Fate::Ghost
        } else if marks & NOT_FINITE != 0 {
            Fate::Invisible
        } else {
            fate
        })
    }

    /// Cuts a polyhedron or prism.
    fn cut(&self, c: usize, faces: Option<&[&[u8]]>, cut: &mut Cut) {
        let points = self.mesh.points();
        match (faces, self.polyhedra) {
            (Some(faces), _) => {
                let ids = self.mesh.cells().points(c);
                let faces: Vec<Vec<u32>> = faces.iter().map(|f| f.iter().map(|i| ids[*i as usize]).collect()).collect();
                cut.take(faces.iter().map(Vec::as_slice), points);
            }
            (None, Some(polyhedra)) => cut.take(polyhedra.faces(c), points),
            (None, None) => {}
        }
    }

    /// How many tetrahedra the cells `range` give, and what is left out.
    fn count(&self, range: Range<usize>, cut: &mut Cut) -> Result<Count> {
        let mut count = Count::default();
        let skipped = &mut count.skipped;
        for c in range {
            match self.fate(c)? {
                Fate::Linear(shape) => count.tetrahedra += shape.tetrahedra,
                Fate::Curved(recipe) => {
                    count.tetrahedra += recipe.tetrahedra;
                    count.added += recipe.added;
                }
                Fate::Polyhedron(faces) => {
                    self.cut(c, faces, cut);
                    count.tetrahedra += cut.tetrahedra();
                    count.added += usize::from(cut.needs_middle());
                    skipped.empty += usize::from(cut.tetrahedra() == 0);
                }
                Fate::LowerDimensional => skipped.lower_dimensional += 1,
                Fate::Unsupported => *skipped.unsupported.entry(self.mesh.cells().types[c]).or_default() += 1,
                Fate::Ghost => skipped.ghost += 1,
                Fate::Invisible => skipped.invisible += 1,
            }
        }
        Ok(count)
    }

    /// Writes the tetrahedra of the cells `range` to `corners`, and to `cell` (empty if not wanted) where they are from. Returns
    /// the points that they add, numbered from `first` on, and how many polyhedra are crooked.
    fn fill(&self, range: Range<usize>, first: u32, corners: &mut [[u32; 4]], cell: &mut [u32]) -> (Added, usize) {
        let points = self.mesh.points();
        let (mut at, mut added, mut crooked) = (0, Added::default(), 0);
        let (mut cut, mut local) = (Cut::default(), Local::default());
        for c in range {
            let next = first + added.len() as u32;
            let end = match self.fate(c) {
                Ok(Fate::Linear(shape)) => {
                    let end = at + shape.tetrahedra;
                    let ids = self.mesh.cells().points(c);
                    split(shape, ids, |p| points[p as usize], &mut corners[at..end]);
                    end
                }
                Ok(Fate::Curved(recipe)) => {
                    self.place(recipe, self.mesh.cells().points(c), next, &mut added, &mut local);
                    let mut end = at;
                    for (shape, ids) in &recipe.parts {
                        let ids = ids.map(u32::from);
                        let out = &mut corners[end..end + shape.tetrahedra];
                        split(shape, &ids[..shape.points], |n| local.places[n as usize], out);
                        out.as_flattened_mut().iter_mut().for_each(|n| *n = local.ids[*n as usize]);
                        end += shape.tetrahedra;
                    }
                    end
                }
                Ok(Fate::Polyhedron(faces)) => {
                    self.cut(c, faces, &mut cut);
                    let end = at + cut.tetrahedra();
                    cut.fill(next, &mut corners[at..end]);
                    if cut.needs_middle() {
                        let middle = cut.middle(points);
                        let equal = 1.0 / cut.points.len() as f64;
                        let weight = |i: usize| middle.weights.as_ref().map_or(equal, |w| w[i]);
                        added.push(cut.points.iter().enumerate().map(|(i, p)| (*p, weight(i))));
                        crooked += usize::from(!middle.sees_all);
                    }
                    end
                }
                _ => continue,
            };
            if !cell.is_empty() {
                cell[at..end].fill(c as u32);
            }
            at = end;
        }
        (added, crooked)
    }

    /// Finds the lattice points of a curved cell with the points `ids`; those that it adds are numbered from `next` on.
    fn place(&self, recipe: &Recipe, ids: &[u32], mut next: u32, added: &mut Added, local: &mut Local) {
        let points = self.mesh.points();
        local.ids.clear();
        local.places.clear();
        for node in &recipe.nodes {
            match node {
                Node::Own(i) => {
                    local.ids.push(ids[*i as usize]);
                    local.places.push(points[ids[*i as usize] as usize]);
                }
                Node::Sum(weights) => {
                    local.entries.clear();
                    local.entries.extend(weights.iter().map(|(i, w)| (ids[*i as usize], *w)));
                    // In an order that is the same for both cells of a face, so that the sum is.
                    local.entries.sort_unstable_by(|a, b| order(points, a.0, b.0));
                    if let Some(rational) = self.rational.filter(|_| recipe.bezier) {
                        rationalise(&mut local.entries, rational);
                    }
                    local.ids.push(next);
                    local.places.push(mean(points, local.entries.iter().copied()));
                    added.push(local.entries.iter().copied());
                    next += 1;
                }
            }
        }
    }
}

/// The lattice of one curved cell.
#[derive(Debug, Default)]
struct Local {
    ids: Vec<u32>,
    places: Vec<DVec3>,
    entries: Vec<(u32, f64)>,
}

/// Multiplies weights by those of rational control points, if that makes sense.
fn rationalise(entries: &mut [(u32, f64)], rational: &Array) {
    let weight = |(source, weight): &(u32, f64)| weight * rational.values.get(*source as usize);
    let sum: f64 = entries.iter().map(weight).sum();
    if sum > 0.0 && sum.is_finite() {
        entries.iter_mut().for_each(|entry| entry.1 = weight(entry) / sum);
    }
}

/// Splits one linear cell with the points `ids` into `out`, by the rule that the module describes.
fn split(shape: &Shape, ids: &[u32], place: impl Fn(u32) -> DVec3, out: &mut [[u32; 4]]) {
    if let ([out], &[a, b, c, d]) = (&mut *out, ids) {
        *out = [a, b, c, d];
        return;
    }
    let smaller = |&a: &u8, &b: &u8| {
        let [a, b] = [a, b].map(|i| ids[i as usize]);
        by_place(place(a), place(b)).then_with(|| a.cmp(&b))
    };
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
    by_place(points[a as usize], points[b as usize]).then_with(|| a.cmp(&b))
}

fn by_place(p: DVec3, q: DVec3) -> Ordering {
    // Points of drawn cells are finite, so that a comparison always has an answer; −0 equals 0.
    let by = |x: f64, y: f64| x.partial_cmp(&y).unwrap_or(Ordering::Equal);
    by(p.x, q.x).then_with(|| by(p.y, q.y)).then_with(|| by(p.z, q.z))
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
        (skipped.empty, "polyhedra without faces"),
    ]
    .into_iter()
    .filter(|(n, _)| *n > 0)
    .map(|(n, why)| format!("{n} {why}"))
    .collect();
    format!("it has no 3D cell to draw; its cells are {}: {}", types.join(", "), reasons.join(", "))
}
