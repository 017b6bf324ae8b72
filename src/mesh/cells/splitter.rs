//! What becomes of each cell, and the tetrahedra of a range of them.

use super::curved::{self, Node, Recipe};
use super::linear::{PRISM_5, PRISM_6, Shape, order, shape, split};
use super::polyhedron::{Corner, Cut, Solved, Split};
use super::{Listed, Skipped, SteinerPoints, dimension, ghosts, mean, name};
use crate::error::{Error, Result};
use crate::mesh::{Array, Mesh, POLYHEDRON, Polyhedra};
use glam::DVec3;
use rayon::prelude::*;
use std::collections::HashMap;
use std::ops::Range;

/// The cell array that tells the degrees of Lagrange and Bézier cells, and the point array that makes the latter
/// rational.
pub(super) const DEGREES_ARRAY: &str = "HigherOrderDegrees";
pub(super) const WEIGHTS_ARRAY: &str = "RationalWeights";

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
pub(super) struct Splitter<'a> {
    mesh: &'a Mesh,
    polyhedra: Option<&'a Polyhedra>,
    /// Which cells are ghosts; none if none is.
    ghosts: Option<Box<dyn Fn(usize) -> bool + Sync + 'a>>,
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
pub(super) struct Count {
    pub(super) tetrahedra: usize,
    pub(super) added: usize,
    pub(super) skipped: Skipped,
    /// The polyhedra that are not simple, ascending, and their splits, without tetrahedra for those that are left out.
    pub(super) solved: Vec<(usize, Solved)>,
}

impl<'a> Splitter<'a> {
    pub(super) fn new(mesh: &'a Mesh) -> Self {
        let find = |arrays: &'a [Array], name: &str, components: usize| {
            arrays.iter().find(|a| a.name == name && a.components == components)
        };
        let hidden = ghosts::of_points(mesh.point_arrays());
        let mark = |(i, p): (usize, &DVec3)| {
            let hide = hidden.as_ref().is_some_and(|hides| hides(i));
            (if hide { HIDDEN } else { 0 }) | if p.is_finite() { 0 } else { NOT_FINITE }
        };
        let points = || mesh.points().par_iter().enumerate();
        let marks = points().any(|p| mark(p) != 0).then(|| points().map(mark).collect());
        let mut splitter = Splitter {
            mesh,
            polyhedra: mesh.polyhedra(),
            ghosts: ghosts::of_cells(mesh.cell_arrays()).map(|of| Box::new(of) as Box<dyn Fn(usize) -> bool + Sync>),
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
        let ghost = self.ghosts.as_ref().is_some_and(|of| of(c));
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
    pub(super) fn count(&self, range: Range<usize>, cut: &mut Cut) -> Result<Count> {
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
                    let solved = match cut.split(self.mesh.points()) {
                        Split::Simple => {
                            count.tetrahedra += cut.tetrahedra();
                            count.added += usize::from(cut.needs_middle());
                            continue;
                        }
                        Split::Solved(solved) => {
                            count.tetrahedra += solved.tetrahedra.len();
                            count.added += solved.added.len();
                            solved
                        }
                        left_out => {
                            match left_out {
                                Split::Open => skipped.open.add(c),
                                Split::Flat => skipped.flat.add(c),
                                _ => skipped.empty += 1,
                            }
                            Solved::default()
                        }
                    };
                    count.solved.push((c, solved));
                }
                Fate::LowerDimensional => skipped.lower_dimensional += 1,
                Fate::Unsupported => *skipped.unsupported.entry(self.mesh.cells().types[c]).or_default() += 1,
                Fate::Ghost => skipped.ghost += 1,
                Fate::Invisible => skipped.invisible += 1,
            }
        }
        Ok(count)
    }

    /// Writes the tetrahedra of the cells `range` to `corners`, and to `cell` (empty if not wanted) where they are
    /// from; `solved` is what counting them found. Returns the points that they add, numbered from `first` on, and the
    /// polyhedra that are crooked.
    pub(super) fn fill(
        &self,
        range: Range<usize>,
        mut solved: &[(usize, Solved)],
        first: u32,
        corners: &mut [[u32; 4]],
        cell: &mut [u32],
    ) -> (SteinerPoints, Listed) {
        let points = self.mesh.points();
        let (mut at, mut added, mut crooked) = (0, SteinerPoints::default(), Listed::default());
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
                Ok(Fate::Polyhedron(_)) if solved.first().is_some_and(|s| s.0 == c) => {
                    let split = &solved[0].1;
                    solved = &solved[1..];
                    let end = at + split.tetrahedra.len();
                    let corner = |corner: Corner| match corner {
                        Corner::Own(p) => p,
                        Corner::Added(i) => next + i,
                    };
                    for (out, t) in corners[at..end].iter_mut().zip(&split.tetrahedra) {
                        *out = t.map(corner);
                    }
                    split.added.iter().for_each(|weights| added.push(weights.iter().copied()));
                    if split.crooked {
                        crooked.add(c);
                    }
                    end
                }
                Ok(Fate::Polyhedron(faces)) => {
                    self.cut(c, faces, &mut cut);
                    let end = at + cut.tetrahedra();
                    cut.fill(points, next, &mut corners[at..end]);
                    if cut.needs_middle() {
                        let equal = 1.0 / cut.points.len() as f64;
                        added.push(cut.points.iter().map(|p| (*p, equal)));
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
    fn place(&self, recipe: &Recipe, ids: &[u32], mut next: u32, added: &mut SteinerPoints, local: &mut Local) {
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
