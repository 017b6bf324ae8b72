//! Polyhedra: any number of faces, each with any number of points, listed in any direction.
//!
//! A polyhedron with the faces of a linear cell is split like that. One whose middle sees all faces from inside becomes
//! the tetrahedra between that point and its faces, cut into triangles; so does one that another point sees whole. The
//! others are cut into pieces that have such a point each (`pieces`), in a way that leaves the surface as it is
//! (`inward`). How a face is cut thus depends on its own points alone, so two neighbours agree, and a quad is cut like
//! that of any cell. Nodes that hang on the edges of a face are corners of it like all others.
//!
//! Whether a split is right is decided by exact signs of volumes, whatever was rounded on the way: tetrahedra that are
//! all positive and whose faces cancel but for those of the cell tile it.

mod face;
mod inward;
mod kernel;
mod pieces;
mod shell;
mod weights;

mod region;

use super::linear::order;
use super::mean;
use face::{Scratch, cut_face};
use glam::{DMat3, DVec3};
use inward::Filling;
use kernel::{Plane, deepest};
use pieces::Pieces;
use shell::{ShellFault, ShellFrame};
use std::collections::HashMap;

/// A point sees a face well if it is so far behind it; the polyhedron reaches about 1 from the origin.
const WELL: f64 = 1e-9;

/// How far before a face a point may be that sees it: what rounding does to faces without area.
const ROUNDING: f64 = -1e-12;

/// Of the cube over a polyhedron's extent, the volume that a tetrahedron around its middle has at least in simple cases.
const CLEAR: f64 = 1e-12;

/// Ways to cut a polyhedron into pieces that are tried.
const ATTEMPTS: usize = 6;

/// A tetrahedron of this shape is one that is better avoided; a corner of a cube has 0.35.
const SLIVER: f64 = 1e-6;

/// Weights below this are left out.
const SLIGHT: f64 = 1e-10;

/// A polyhedron, its faces cut.
#[derive(Debug, Default)]
pub(super) struct Cut {
    /// Its points, each once, in the order of positions.
    pub(super) points: Vec<u32>,
    /// The triangles of its faces, as these are listed.
    triangles: Vec<[u32; 3]>,
    /// Number of faces of three corners or more.
    faces: usize,
    /// Whether each edge is gone along as often in either way: all faces look outward, or all inward.
    coherent: bool,
    /// Its smallest point, if it has the faces of a linear cell.
    apex: Option<u32>,
    face: Vec<u32>,
    scratch: Scratch,
}

/// What becomes of a polyhedron.
#[derive(Debug)]
pub(super) enum Split {
    /// What [`Cut::fill`] makes of it.
    Simple,
    /// Something else.
    Solved(Solved),
    /// It has no face, or none that spans anything.
    Empty,
    /// Its faces do not close a surface.
    Open,
    /// It has no volume.
    Flat,
}

/// A split that took some thought.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Solved {
    /// The weights of each added point: points of the mesh, and shares that add up to 1.
    pub(super) added: Vec<Vec<(u32, f64)>>,
    /// Corners are points of the mesh, or added ones.
    pub(super) tetrahedra: Vec<[Corner; 4]>,
    /// Some of the tetrahedra overlap: the surface crosses itself.
    pub(super) crooked: bool,
}

/// A corner of a tetrahedron.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) enum Corner {
    /// A point of the mesh.
    Own(u32),
    /// The number of an added point.
    Added(u32),
}

impl Cut {
    /// Cuts the faces of a cell; those of fewer than three points are none.
    pub(super) fn take<'a>(&mut self, faces: impl Iterator<Item = &'a [u32]>, points: &[DVec3]) {
        self.points.clear();
        self.triangles.clear();
        let (mut triangles, mut quads) = (0, 0);
        let mut sum = 0_u64;
        self.faces = 0;
        for face in faces {
            self.face.clear();
            for &p in face {
                if self.face.last() != Some(&p) {
                    self.face.push(p);
                }
            }
            while self.face.len() > 1 && self.face.first() == self.face.last() {
                self.face.pop();
            }
            match self.face.len() {
                0..3 => continue,
                3 => triangles += 1,
                4 => quads += 1,
                _ => {}
            }
            self.faces += 1;
            sum = sum.wrapping_add(around(&self.face));
            self.points.extend_from_slice(&self.face);
            let place = |p: u32| points[p as usize];
            cut_face(&self.face, place, |a, b| order(points, a, b), &mut self.scratch, &mut self.triangles);
        }
        self.points.sort_unstable();
        self.points.dedup();
        self.points.sort_unstable_by(|a, b| order(points, *a, *b));
        self.coherent = sum == 0;
        let linear = [(4, 4, 0), (8, 0, 6), (6, 2, 3), (5, 4, 1)];
        let is_linear = triangles + quads == self.faces && linear.contains(&(self.points.len(), triangles, quads));
        self.apex = self.points.first().copied().filter(|_| is_linear);
    }

    /// The number of tetrahedra that [`Cut::fill`] writes.
    pub(super) fn tetrahedra(&self) -> usize {
        match self.apex {
            Some(apex) => self.triangles.iter().filter(|t| !t.contains(&apex)).count(),
            None => self.triangles.len(),
        }
    }

    /// Whether the tetrahedra of [`Cut::fill`] meet in a point that has to be added: the mean of [`Cut::points`].
    pub(super) fn needs_middle(&self) -> bool {
        self.apex.is_none()
    }

    /// Writes the tetrahedra of a simple polyhedron, which meet in the point `middle` if they need one.
    pub(super) fn fill(&self, points: &[DVec3], middle: u32, out: &mut [[u32; 4]]) {
        let apex = self.apex.unwrap_or(middle);
        let signs = Signs::new(self, points);
        let from = self.apex.map_or_else(|| self.mean(points), |apex| points[apex as usize]);
        let mut turned = None;
        let far = self.triangles.iter().filter(|t| self.apex.is_none_or(|apex| !t.contains(&apex)));
        for (out, t) in out.iter_mut().zip(far) {
            // Where faces are coherent one sign is all signs.
            let inward = match turned {
                Some(turned) if self.coherent => turned,
                _ => signs.of_corner(from, *t) < 0.0,
            };
            turned = Some(inward);
            let [a, b, c] = *t;
            *out = if inward { [apex, a, c, b] } else { [apex, a, b, c] };
        }
    }

    /// Decides what becomes of the polyhedron.
    pub(super) fn split(&self, points: &[DVec3]) -> Split {
        match self.faces {
            0 => return Split::Empty,
            1..4 => return Split::Open,
            _ => {}
        }
        if self.is_simple(points) {
            return Split::Simple;
        }
        match self.solve(points) {
            Ok(solved) => Split::Solved(solved),
            Err(ShellFault::Open) => Split::Open,
            Err(ShellFault::Flat) => Split::Flat,
        }
    }

    /// Whether the tetrahedra around the smallest point or the mean are right.
    fn is_simple(&self, points: &[DVec3]) -> bool {
        // A surface like a ball's.
        if self.triangles.len() + 4 != 2 * self.points.len() {
            return false;
        }
        let signs = Signs::new(self, points);
        let clear = CLEAR * signs.extent.powi(3);
        let all_one = |from: DVec3, apex: Option<u32>| {
            let far = self.triangles.iter().filter(|t| apex.is_none_or(|apex| !t.contains(&apex)));
            let mut signs = far.map(|t| signs.of_corner(from, *t));
            let first = signs.next().unwrap_or(0.0);
            first.abs() > clear && signs.all(|s| s * first.signum() > clear)
        };
        if self.coherent {
            return match self.apex {
                Some(apex) => all_one(points[apex as usize], self.apex),
                None => all_one(self.mean(points), None),
            };
        }
        // The mean tells which way each face looks; if these then close a surface, it sees all of it.
        let from = self.mean(points);
        let mut sum = 0_u64;
        for t in &self.triangles {
            let sign = signs.of_corner(from, *t);
            if sign.abs() <= clear {
                return false;
            }
            let turn = around(t);
            sum = if sign > 0.0 { sum.wrapping_add(turn) } else { sum.wrapping_sub(turn) };
        }
        let sees = |apex: u32| {
            let far = self.triangles.iter().filter(|t| !t.contains(&apex)).copied();
            let place = points[apex as usize];
            far.into_iter().all(|t| signs.of_corner(place, t) * signs.of_corner(from, t).signum() > clear)
        };
        sum == 0 && self.apex.is_none_or(sees)
    }

    /// The mean of all points, to the bit as an added point of equal weights is.
    fn mean(&self, points: &[DVec3]) -> DVec3 {
        let equal = 1.0 / self.points.len() as f64;
        mean(points, self.points.iter().map(|p| (*p, equal)))
    }

    /// Splits a polyhedron whose faces look anywhere, and of any shape.
    fn solve(&self, points: &[DVec3]) -> Result<Solved, ShellFault> {
        // Points at one position are one.
        let mut own: Vec<u32> = vec![];
        let mut number: HashMap<u32, u32> = HashMap::new();
        for &p in &self.points {
            if own.last().is_none_or(|q| points[*q as usize] != points[p as usize]) {
                own.push(p);
            }
            number.insert(p, own.len() as u32 - 1);
        }
        let world: Vec<DVec3> = own.iter().map(|p| points[*p as usize]).collect();
        let listed: Vec<[u32; 3]> = self.triangles.iter().map(|t| t.map(|p| number[&p])).collect();
        let frame = ShellFrame::of(&world).ok_or(ShellFault::Flat)?;
        let places: Vec<DVec3> = world.iter().map(|p| frame.local(*p)).collect();
        let surface = shell::close(&places, &listed)?;
        let cell = Closed { own: &own, points, places: &places, surface: &surface, signs: Signs::new(self, points) };

        let around_middle = |weights: Vec<f64>, crooked: bool| {
            let tetrahedra = surface.iter().map(|t| [own.len() as u32, t[0], t[1], t[2]]).collect();
            cell.solved(vec![weights], tetrahedra, crooked)
        };
        // Hexahedra and the like as those are.
        if self.apex.is_some() {
            let far = surface.iter().filter(|t| !t.contains(&0));
            let solved = cell.solved(vec![], far.map(|t| [0, t[0], t[1], t[2]]).collect(), false);
            if cell.is_right(&solved) {
                return Ok(solved);
            }
        }
        let planes: Vec<Plane> = surface.iter().filter_map(|t| Plane::of(t.map(|p| places[p as usize]))).collect();
        let middle = places.iter().sum::<DVec3>() / places.len() as f64;
        let depth = planes.iter().map(|p| p.depth(middle)).fold(f64::INFINITY, f64::min);
        let around_mean = around_middle(vec![1.0 / own.len() as f64; own.len()], false);
        if depth > WELL && cell.is_right(&around_mean) {
            return Ok(around_mean);
        }
        let kernel = deepest(&planes);
        let around_kernel = around_middle(cell.weights(kernel.place), kernel.depth < ROUNDING);
        if kernel.depth > WELL && cell.is_right(&around_kernel) {
            return Ok(around_kernel);
        }
        if let Some(solved) = cell.in_pieces() {
            return Ok(solved);
        }
        // Faces without area are seen by no point, to the last bit.
        let mean_sees = cell.is_right(&around_mean) || depth >= ROUNDING;
        Ok(if mean_sees { around_mean } else { around_kernel })
    }
}

/// A polyhedron with a closed surface.
struct Closed<'a> {
    /// Points of the mesh.
    own: &'a [u32],
    points: &'a [DVec3],
    /// Where those of `own` are in a frame in which the polyhedron reaches about 1 from the origin.
    places: &'a [DVec3],
    /// Outward triangles of `own`.
    surface: &'a [[u32; 3]],
    signs: Signs<'a>,
}

impl Closed<'_> {
    /// Cuts it into pieces: the first way that is right and gives no slivers, else the right one whose worst
    /// tetrahedron is best.
    fn in_pieces(&self) -> Option<Solved> {
        let mut best: Option<(f64, Solved)> = None;
        for skip in 0..ATTEMPTS {
            let Some((worst, solved)) = self.attempt(skip) else { continue };
            if best.as_ref().is_none_or(|b| worst > b.0) && self.is_right(&solved) {
                best = Some((worst, solved));
            }
            if best.as_ref().is_some_and(|b| b.0 > SLIVER) {
                break;
            }
        }
        best.map(|b| b.1)
    }

    /// Cuts it into pieces, at first by another than the best `skip` planes. Returns how bad the worst tetrahedron is.
    fn attempt(&self, skip: usize) -> Option<(f64, Solved)> {
        let (pieces, centres) = Pieces::new(self.places, self.surface, skip)?;
        let mut filling = Filling::new(&pieces, &centres, self.own.len());
        filling.clear_surface()?;
        filling.simplify();
        filling.tidy();
        // Each place is passed once: the surface does not overlap itself.
        let corners: Vec<[DVec3; 3]> = self.surface.iter().map(|t| t.map(|p| self.places[p as usize])).collect();
        let centre = |t: &[u32; 4]| t.iter().map(|p| filling.places[*p as usize]).sum::<DVec3>() / 4.0;
        let worst = filling.worst();
        if worst <= 0.0 || filling.tetrahedra.iter().any(|t| pieces::winding(&corners, centre(t)) > 1.5) {
            return None;
        }
        let weights = weights::harmonic(&filling.places, &filling.tetrahedra, self.own.len())?;
        Some((worst, self.solved(weights, filling.tetrahedra, false)))
    }

    /// Tetrahedra of `own` points and, after them, added ones with these weights of `own` points.
    fn solved(&self, weights: Vec<Vec<f64>>, tetrahedra: Vec<[u32; 4]>, crooked: bool) -> Solved {
        let corner = |p: u32| match self.own.get(p as usize) {
            Some(own) => Corner::Own(*own),
            None => Corner::Added(p - self.own.len() as u32),
        };
        let kept = |weights: Vec<f64>| {
            let kept = || self.own.iter().copied().zip(weights.iter().copied()).filter(|w| w.1.abs() > SLIGHT);
            let whole: f64 = kept().map(|w| w.1).sum();
            kept().map(|(p, w)| (p, w / whole)).collect()
        };
        Solved {
            added: weights.into_iter().map(kept).collect(),
            tetrahedra: tetrahedra.into_iter().map(|t| t.map(corner)).collect(),
            crooked,
        }
    }

    /// Whether all tetrahedra are positive, exactly, and fill the surface: each triangle of it is the face of one, and
    /// every other face that of two, on either side.
    fn is_right(&self, solved: &Solved) -> bool {
        let added: Vec<DVec3> = solved.added.iter().map(|w| mean(self.points, w.iter().copied())).collect();
        let place = |c: Corner| match c {
            Corner::Own(p) => self.points[p as usize],
            Corner::Added(i) => added[i as usize],
        };
        if !solved.tetrahedra.iter().all(|t| self.signs.of(t.map(place)) > 0.0) {
            return false;
        }
        let mut open: HashMap<[Corner; 3], i32> = HashMap::with_capacity(2 * solved.tetrahedra.len());
        let mut count = |t: [Corner; 3], by: i32| {
            let mut sorted = t;
            sorted.sort_unstable();
            let even = t == sorted || t == [sorted[1], sorted[2], sorted[0]] || t == [sorted[2], sorted[0], sorted[1]];
            *open.entry(sorted).or_default() += if even { by } else { -by };
        };
        for t in &solved.tetrahedra {
            inward::OUTWARD.iter().for_each(|face| count(face.map(|k| t[k]), 1));
        }
        self.surface.iter().for_each(|t| count(t.map(|p| Corner::Own(self.own[p as usize])), -1));
        open.values().all(|n| *n == 0)
    }

    /// The weights of a point: positive if it sees all of the surface.
    fn weights(&self, x: DVec3) -> Vec<f64> {
        let n = self.own.len();
        let surface: Vec<[DVec3; 3]> = self.surface.iter().map(|t| t.map(|p| self.places[p as usize])).collect();
        let mut weights = vec![0.0; n];
        if let Some(shares) = weights::mean_value(x, &surface) {
            for (t, shares) in self.surface.iter().zip(shares) {
                t.iter().zip(shares).for_each(|(p, share)| weights[*p as usize] += share);
            }
            if weights.iter().all(|w| w.is_finite()) {
                return weights;
            }
        }
        // Those nearest to equal ones whose mean is that point.
        let middle = self.places.iter().sum::<DVec3>() / n as f64;
        let spread = self
            .places
            .iter()
            .map(|p| *p - middle)
            .fold(DMat3::ZERO, |m, l| m + DMat3::from_cols(l * l.x, l * l.y, l * l.z));
        let pull = spread.inverse() * (x - middle);
        self.places.iter().map(|p| 1.0 / n as f64 + (*p - middle).dot(pull)).collect()
    }
}

/// Exact signs of volumes.
struct Signs<'a> {
    points: &'a [DVec3],
    /// A power of two, which changes no sign and keeps products of three lengths from over- and underflow.
    scale: f64,
    /// The greatest extent of the polyhedron along an axis, times the scale.
    extent: f64,
}

impl<'a> Signs<'a> {
    fn new(cut: &Cut, points: &'a [DVec3]) -> Self {
        let size = cut.points.iter().map(|p| points[*p as usize].abs().max_element()).fold(0.0, f64::max);
        let usual = (1e-30..1e30).contains(&size) || size < f64::MIN_POSITIVE;
        let scale = if usual { 1.0 } else { 2f64.powi(-(size.log2().floor() as i32).clamp(-1000, 1000)) };
        let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let grown = |[l, h]: [DVec3; 2], p: &u32| [l.min(points[*p as usize]), h.max(points[*p as usize])];
        let [low, high] = cut.points.iter().fold(none, grown);
        Signs { points, scale, extent: (high * scale - low * scale).max_element() }
    }

    /// Above 0 if det(b − a, c − a, d − a) is.
    fn of(&self, t: [DVec3; 4]) -> f64 {
        let [a, b, c, d] = t.map(|p| p * self.scale).map(|p| robust::Coord3D { x: p.x, y: p.y, z: p.z });
        -robust::orient3d(a, b, c, d)
    }

    /// Above 0 if a triangle of points is counter-clockwise as seen from the far side of it.
    fn of_corner(&self, from: DVec3, t: [u32; 3]) -> f64 {
        let [a, b, c] = t.map(|p| self.points[p as usize]);
        self.of([from, a, b, c])
    }
}

/// A sum over the edges around a face, which is 0 for a closed surface, and hardly for others: each edge counts by a
/// number of its own, up if it goes from the smaller to the greater point, else down.
fn around(face: &[u32]) -> u64 {
    let mix = |a: u32, b: u32| {
        // The finaliser of SplitMix64 (Steele, Lea & Flood 2014).
        let z = (u64::from(a) << 32 | u64::from(b)).wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    };
    let mut from = face[face.len() - 1];
    let mut sum = 0_u64;
    for &to in face {
        sum = if from < to { sum.wrapping_add(mix(from, to)) } else { sum.wrapping_sub(mix(to, from)) };
        from = to;
    }
    sum
}
