//! A polyhedron that no point inside sees whole, cut by planes into pieces that each have such a point.
//!
//! A plane is chosen by how deep points of either side could lie: mostly one through an edge where the polyhedron is
//! notched, as in Chazelle's decomposition (Convex Partitions of Polyhedra, 1984). Unlike there, pieces need not be
//! convex. The points where planes meet the surface are added to it here, and moved inside afterwards (`inward`).

use super::kernel::{Deepest, Plane, deepest};
use super::region;
use glam::{DVec2, DVec3};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// No piece, or no face of the polyhedron.
pub(super) const NONE: u32 = u32::MAX;

/// How far from a plane points count as in it; the polyhedron reaches about 1 from the origin.
const NEAR: f64 = 1e-9;

/// A piece is done if a point is deeper in it than this.
const DEEP: f64 = 1e-7;

/// What a plane gains no more by points that lie deeper on a side than this.
const DEEP_ENOUGH: f64 = 0.05;

/// Notched edges that planes are laid through, the sharpest first.
const MOST_NOTCHES: usize = 24;

/// Pieces times triangles of the surface; beyond that it would take minutes.
const MOST_WORK: usize = 4_000_000;

/// Planes that are tried in turn, the best first.
const MOST_PLANES: usize = 6;

/// A triangle between two pieces, or one and the outside.
#[derive(Debug, Clone, Copy)]
pub(super) struct Triangle {
    pub(super) corners: [u32; 3],
    /// The piece from which the corners are counter-clockwise as seen from outside of it, and the one beyond.
    sides: [u32; 2],
    /// The triangle of the polyhedron's surface that it is a part of.
    pub(super) parent: u32,
}

/// A polyhedron in pieces.
#[derive(Debug, Clone)]
pub(super) struct Pieces {
    pub(super) places: Vec<DVec3>,
    pub(super) triangles: Vec<Triangle>,
    pieces: u32,
}

/// A triangle of a piece's surface, outward, with its number and the side of it.
type Face = ([u32; 3], usize, usize);

impl Pieces {
    /// Cuts up the polyhedron with these points, within a distance of 2 from the origin, and a closed surface of
    /// triangles, counter-clockwise as seen from outside; the best `skip` planes are not the first. Returns the pieces,
    /// and a point inside each; `None` if that fails.
    pub(super) fn new(places: &[DVec3], surface: &[[u32; 3]], mut skip: usize) -> Option<(Self, Vec<(u32, DVec3)>)> {
        let triangle = |(i, t): (usize, &[u32; 3])| Triangle { corners: *t, sides: [0, NONE], parent: i as u32 };
        let triangles: Vec<Triangle> = surface.iter().enumerate().map(triangle).collect();
        let mut all = Pieces { places: places.to_vec(), triangles, pieces: 1 };
        let mut waiting = all.parts(0)?;
        let most = (64 + 2 * surface.len()).min(MOST_WORK / surface.len());
        let mut done = vec![];
        while let Some(piece) = waiting.pop() {
            let faces = all.surface(piece);
            let planes: Vec<Plane> = faces.iter().filter_map(|f| Plane::of(all.at(f.0))).collect();
            let kernel = deepest(&planes);
            if kernel.depth > DEEP {
                done.push((piece, kernel.place));
                continue;
            }
            if all.pieces as usize > most {
                return None;
            }
            let mut ways = all.planes(&faces, &planes, &kernel).into_iter().skip(skip).take(MOST_PLANES);
            let parts = ways.find_map(|plane| {
                let mut tried = all.clone();
                let parts = tried.cut(piece, plane)?;
                all = tried;
                Some(parts)
            });
            waiting.extend(parts?);
            skip = 0;
        }
        Some((all, done))
    }

    /// The surface of a piece.
    pub(super) fn surface(&self, piece: u32) -> Vec<Face> {
        let mut faces = vec![];
        for (i, t) in self.triangles.iter().enumerate() {
            let [a, b, c] = t.corners;
            if t.sides[0] == piece {
                faces.push(([a, b, c], i, 0));
            }
            if t.sides[1] == piece {
                faces.push(([a, c, b], i, 1));
            }
        }
        faces
    }

    fn at(&self, corners: [u32; 3]) -> [DVec3; 3] {
        corners.map(|p| self.places[p as usize])
    }

    /// Planes that might cut a piece well, the best first.
    fn planes(&self, faces: &[Face], planes: &[Plane], kernel: &Deepest) -> Vec<Plane> {
        let place = |p: u32| self.places[p as usize];
        let edges: HashMap<(u32, u32), [u32; 3]> =
            faces.iter().flat_map(|(t, ..)| (0..3).map(|i| ((t[i], t[(i + 1) % 3]), *t))).collect();
        let mut notches: Vec<(f64, DVec3, DVec3, [Plane; 2])> = vec![];
        for (t, ..) in faces {
            for i in 0..3 {
                let (a, b) = (t[i], t[(i + 1) % 3]);
                let Some(u) = edges.get(&(b, a)).filter(|_| a < b) else { continue };
                let (Some(one), Some(other)) = (Plane::of(self.at(*t)), Plane::of(self.at(*u))) else { continue };
                let beyond = u.iter().copied().find(|p| *p != a && *p != b).map_or(0.0, |p| -one.depth(place(p)));
                if beyond > NEAR {
                    let bend = one.normal.distance(other.normal) * place(a).distance(place(b));
                    notches.push((bend, place(a), place(b), [one, other]));
                }
            }
        }
        notches.sort_by(|a, b| b.0.total_cmp(&a.0));
        notches.truncate(MOST_NOTCHES);
        let through =
            |normal: DVec3, p: DVec3| normal.try_normalize().map(|normal| Plane { normal, offset: normal.dot(p) });
        let mut ways: Vec<Plane> = vec![];
        for (_, a, b, [one, other]) in &notches {
            ways.extend([*one, *other]);
            // Contains the edge and halves the notch.
            ways.extend(through((*b - *a).cross(one.normal + other.normal), *a));
        }
        // Between those faces that no point is behind both of.
        let held: Vec<Plane> = kernel.held_by.iter().filter_map(|i| planes.get(*i).copied()).collect();
        let centre = |plane: &Plane| {
            let of = |f: &Face| self.at(f.0).iter().sum::<DVec3>() / 3.0;
            faces.iter().find(|f| Plane::of(self.at(f.0)) == Some(*plane)).map(of)
        };
        for (i, one) in held.iter().enumerate() {
            for other in &held[..i] {
                if let (Some(a), Some(b)) = (centre(one), centre(other)) {
                    ways.extend(through(b - a, (a + b) / 2.0));
                }
            }
        }
        let mut ways: Vec<(f64, Plane)> = ways.into_iter().filter_map(|w| Some((self.worth(faces, w)?, w))).collect();
        ways.sort_by(|a, b| b.0.total_cmp(&a.0));
        ways.into_iter().map(|w| w.1).collect()
    }

    /// How good it is to cut by a plane: how deep points can lie on both sides, less for every edge that is cut and for
    /// points that are near the plane, but not in it. `None` if all is on one side.
    fn worth(&self, faces: &[Face], plane: Plane) -> Option<f64> {
        let (mut inner, mut outer) = (vec![plane], vec![plane.turned()]);
        let (mut crossed, mut nearest) = (0, f64::INFINITY);
        for (t, ..) in faces {
            let depths = self.at(*t).map(|p| plane.depth(p));
            let [is_in, is_out] = [depths.iter().any(|d| *d > NEAR), depths.iter().any(|d| *d < -NEAR)];
            crossed += usize::from(is_in && is_out);
            nearest = depths.iter().map(|d| d.abs()).filter(|d| *d > NEAR).fold(nearest, f64::min);
            let own = Plane::of(self.at(*t));
            inner.extend(own.filter(|_| is_in));
            outer.extend(own.filter(|_| is_out));
        }
        if inner.len() == 1 || outer.len() == 1 {
            return None;
        }
        let depth = |planes: &[Plane]| deepest(planes).depth.min(DEEP_ENOUGH);
        let slivers = DEEP_ENOUGH * (1.0 - nearest / 0.01).max(0.0);
        Some(depth(&inner) + depth(&outer) - slivers - 1e-3 * crossed as f64)
    }

    /// Cuts a piece by a plane, and returns its parts.
    fn cut(&mut self, piece: u32, plane: Plane) -> Option<Vec<u32>> {
        let mut added = BTreeSet::new();
        let side = |all: &Self, added: &BTreeSet<u32>, p: u32| {
            let depth = plane.depth(all.places[p as usize]);
            if added.contains(&p) || depth.abs() <= NEAR { 0 } else { depth.signum() as i32 }
        };
        let edges: BTreeSet<(u32, u32)> = self
            .surface(piece)
            .iter()
            .flat_map(|(t, ..)| (0..3).map(|i| (t[i], t[(i + 1) % 3])))
            .map(|(a, b)| (a.min(b), a.max(b)))
            .collect();
        for (a, b) in edges {
            if side(self, &added, a) * side(self, &added, b) < 0 {
                let [p, q] = [a, b].map(|p| self.places[p as usize]);
                let m = self.places.len() as u32;
                self.places.push(p.lerp(q, plane.depth(p) / (plane.depth(p) - plane.depth(q))));
                added.insert(m);
                self.halve(a, b, m);
            }
        }
        // No triangle is on both sides now.
        let (inner, outer) = (self.pieces, self.pieces + 1);
        self.pieces += 2;
        let mut open: BTreeMap<(u32, u32), i32> = BTreeMap::new();
        for (t, i, k) in self.surface(piece) {
            let sides = t.map(|p| side(self, &added, p));
            let is_in = if sides == [0; 3] {
                Plane::of(self.at(t))?.normal.dot(plane.normal) > 0.0
            } else {
                sides.contains(&1)
            };
            self.triangles[i].sides[k] = if is_in { inner } else { outer };
            if is_in {
                for e in 0..3 {
                    let (a, b) = (t[e], t[(e + 1) % 3]);
                    *open.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
                }
            }
        }
        open.retain(|_, count| *count != 0);
        // What closes the inner part runs the other way, seen from outside of it.
        let mut outline = vec![];
        for ((a, b), count) in open {
            if count.abs() > 1 || side(self, &added, a) != 0 || side(self, &added, b) != 0 {
                return None;
            }
            outline.push(if count > 0 { (b, a) } else { (a, b) });
        }
        let (u, v) = plane.normal.any_orthonormal_pair();
        let flip = if u.cross(v).dot(plane.normal) < 0.0 { -1.0 } else { 1.0 };
        let places = &self.places;
        let seen = |p: u32| DVec2::new(u.dot(places[p as usize]), flip * v.dot(places[p as usize]));
        let between = region::triangulate(seen, &outline)?;
        let triangle = |corners: [u32; 3]| Triangle { corners, sides: [inner, outer], parent: NONE };
        self.triangles.extend(between.into_iter().map(triangle));
        let mut parts = self.parts(inner)?;
        parts.extend(self.parts(outer)?);
        Some(parts)
    }

    /// Puts point `m` into the edge from `a` to `b`, in all triangles that have it.
    fn halve(&mut self, a: u32, b: u32, m: u32) {
        for i in 0..self.triangles.len() {
            let t = self.triangles[i];
            if t.corners.contains(&a) && t.corners.contains(&b) {
                let with = |from: u32| t.corners.map(|p| if p == from { m } else { p });
                self.triangles[i].corners = with(a);
                self.triangles.push(Triangle { corners: with(b), ..t });
            }
        }
    }

    /// Makes a piece for each part of `piece` that hangs together; hollows belong to what is around them.
    fn parts(&mut self, piece: u32) -> Option<Vec<u32>> {
        let faces = self.surface(piece);
        let (shells, count) = shells(&faces.iter().map(|f| f.0).collect::<Vec<_>>());
        if count < 2 {
            return Some(vec![piece]);
        }
        let of = |shell: usize| {
            let own = faces.iter().zip(&shells).filter(move |f| *f.1 == shell);
            own.map(|f| self.at(f.0.0)).collect::<Vec<_>>()
        };
        let surfaces: Vec<Vec<[DVec3; 3]>> = (0..count).map(of).collect();
        let volumes: Vec<f64> = surfaces.iter().map(|s| volume(s)).collect();
        let mut home = vec![NONE; count];
        let solid: Vec<usize> = (0..count).filter(|s| volumes[*s] > 0.0).collect();
        for (k, s) in solid.iter().enumerate() {
            home[*s] = if k == 0 { piece } else { self.pieces + k as u32 - 1 };
        }
        self.pieces += solid.len().saturating_sub(1) as u32;
        for hollow in (0..count).filter(|s| volumes[*s] <= 0.0) {
            let place = surfaces[hollow][0].iter().sum::<DVec3>() / 3.0;
            let around = |s: &&usize| winding(&surfaces[**s], place) > 0.5;
            let smallest = solid.iter().filter(around).min_by(|a, b| volumes[**a].total_cmp(&volumes[**b]))?;
            home[hollow] = home[*smallest];
        }
        for ((_, i, k), shell) in faces.into_iter().zip(shells) {
            self.triangles[i].sides[k] = home[shell];
        }
        let mut parts: Vec<u32> = home.into_iter().collect();
        parts.sort_unstable();
        parts.dedup();
        Some(parts)
    }
}

/// Which triangles hang together by edges: the number of a shell for each, and how many there are.
fn shells(triangles: &[[u32; 3]]) -> (Vec<usize>, usize) {
    let mut first: HashMap<(u32, u32), usize> = HashMap::new();
    let mut parent: Vec<usize> = (0..triangles.len()).collect();
    fn root(parent: &mut [usize], mut i: usize) -> usize {
        while parent[i] != i {
            parent[i] = parent[parent[i]];
            i = parent[i];
        }
        i
    }
    for (i, t) in triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            let other = *first.entry((a.min(b), a.max(b))).or_insert(i);
            let (a, b) = (root(&mut parent, i), root(&mut parent, other));
            parent[a.max(b)] = a.min(b);
        }
    }
    let mut numbers: Vec<usize> = vec![usize::MAX; triangles.len()];
    let mut count = 0;
    for i in 0..triangles.len() {
        let r = root(&mut parent, i);
        if numbers[r] == usize::MAX {
            numbers[r] = count;
            count += 1;
        }
        numbers[i] = numbers[r];
    }
    (numbers, count)
}

/// Six times the volume within a closed surface of outward triangles.
pub(super) fn volume(surface: &[[DVec3; 3]]) -> f64 {
    surface.iter().map(|[a, b, c]| a.dot(b.cross(*c))).sum()
}

/// How often a closed surface goes around a point: the sum of the solid angles of its triangles (van Oosterom &
/// Strackee 1983) over that of a sphere.
pub(super) fn winding(surface: &[[DVec3; 3]], x: DVec3) -> f64 {
    let angle = |t: &[DVec3; 3]| {
        let [a, b, c] = t.map(|p| p - x);
        let [i, j, k] = [a, b, c].map(DVec3::length);
        a.dot(b.cross(c)).atan2(i * j * k + a.dot(b) * k + b.dot(c) * i + c.dot(a) * j)
    };
    surface.iter().map(angle).sum::<f64>() / (2.0 * std::f64::consts::PI)
}
