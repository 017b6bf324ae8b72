//! Tetrahedra of a polyhedron in pieces, without the points that were put on its surface.
//!
//! Around each such point the tetrahedra are taken out, the flat part of the surface around it is cut anew without it, and
//! the hole is filled around another point: one of its own corners, or a new one inside. There always is one, a hair
//! inwards of the point that was taken out (cf. George, Borouchaki & Saltel, 'Ultimate' Robustness in Meshing an
//! Arbitrary Polyhedron, 2003). So the surface stays as it was given, and neighbours need not know.

use super::face::cut_polygon;
use super::kernel::{Plane, deepest};
use super::pieces::{NONE, Pieces};
use glam::{DMat3, DVec3};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// The corners of the face opposite to each corner, outward, of a tetrahedron of positive volume.
pub(super) const OUTWARD: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// A corner fills a hole if it is behind all of its faces by so much; the polyhedron reaches about 1 from the origin.
const CLEAR: f64 = 1e-3;

/// Points are taken away as long as no tetrahedron becomes flatter than this, or than those that were there.
const SHAPELY: f64 = 0.02;

/// Rounds in which added points are taken away.
const ROUNDS: usize = 4;

/// A flat part of the surface: the triangle of the polyhedron that it is in, and its own.
type Flat = (u32, Vec<[u32; 3]>);

/// Tetrahedra, positive all, and the surface that they fill.
#[derive(Debug)]
pub(super) struct Filling {
    pub(super) places: Vec<DVec3>,
    pub(super) tetrahedra: Vec<[u32; 4]>,
    /// The triangles of the surface, outward, and which of the polyhedron each is a part of.
    surface: Vec<([u32; 3], u32)>,
    /// The number of the polyhedron's own points; further ones are added.
    own: u32,
}

impl Filling {
    /// Fills all pieces around a point inside each; `own` of the points are the polyhedron's.
    pub(super) fn new(pieces: &Pieces, centres: &[(u32, DVec3)], own: usize) -> Self {
        let mut places = pieces.places.clone();
        let (mut tetrahedra, mut surface) = (vec![], vec![]);
        for (piece, centre) in centres {
            let x = places.len() as u32;
            places.push(*centre);
            for (t, i, _) in pieces.surface(*piece) {
                tetrahedra.push([x, t[0], t[1], t[2]]);
                let parent = pieces.triangles[i].parent;
                if parent != NONE {
                    surface.push((t, parent));
                }
            }
        }
        Filling { places, tetrahedra, surface, own: own as u32 }
    }

    /// Takes all added points off the surface: first from within triangles of the polyhedron, then from their edges.
    /// `None` if that fails.
    pub(super) fn clear_surface(&mut self) -> Option<()> {
        let mut on: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
        for (t, parent) in &self.surface {
            t.iter().filter(|p| **p >= self.own).for_each(|p| {
                on.entry(*p).or_default().insert(*parent);
            });
        }
        let mut points: Vec<(usize, u32)> = on.into_iter().map(|(p, parents)| (parents.len(), p)).collect();
        points.sort_unstable();
        points.into_iter().try_for_each(|(_, p)| self.clear(p))
    }

    /// Takes point `s` off the surface.
    fn clear(&mut self, s: u32) -> Option<()> {
        let mut link = self.take(s);
        // The flat parts around it, as the polygons that are left without it.
        let mut flat: BTreeMap<u32, BTreeMap<u32, u32>> = BTreeMap::new();
        self.surface.retain(|(t, parent)| {
            let Some(k) = t.iter().position(|p| *p == s) else { return true };
            flat.entry(*parent).or_default().insert(t[(k + 1) % 3], t[(k + 2) % 3]);
            false
        });
        let mut polygons: Vec<(u32, Vec<u32>)> = vec![];
        for (parent, next) in flat {
            let ends: BTreeSet<u32> = next.values().copied().collect();
            let first = next.keys().copied().find(|p| !ends.contains(p)).or(next.keys().next().copied())?;
            let mut polygon = vec![first];
            let mut at = first;
            while let Some(&to) = next.get(&at).filter(|p| **p != first) {
                if polygon.len() > next.len() {
                    return None;
                }
                polygon.push(to);
                at = to;
            }
            // Each part is one polygon.
            if polygon.len() < next.len() {
                return None;
            }
            polygons.push((parent, polygon));
        }
        let best = polygons.iter().map(|(parent, polygon)| {
            let triangles = cut_polygon(polygon.iter().map(|p| self.place(*p)));
            (*parent, triangles.into_iter().map(|t| t.map(|i| polygon[i])).collect::<Vec<_>>())
        });
        let best: Vec<Flat> = best.collect();
        // Around a corner of the hole, if that is well behind all of its faces.
        let corners: BTreeSet<u32> = link.iter().flatten().copied().collect();
        let mut found: Option<(f64, u32, Vec<Flat>)> = None;
        for v in corners {
            let cut = polygons.iter().zip(&best).map(|((parent, polygon), best)| {
                let Some(k) = polygon.iter().position(|p| *p == v) else { return best.clone() };
                let n = polygon.len();
                let fan = (1..n - 1).map(|i| [v, polygon[(k + i) % n], polygon[(k + i + 1) % n]]);
                (*parent, fan.collect())
            });
            let cut: Vec<Flat> = cut.collect();
            let normal = |t: &[u32; 3]| Plane::of(self.at(t)).map_or(DVec3::ZERO, |p| p.normal);
            let turns = cut.iter().zip(&best).all(|((_, fan), (_, best))| {
                best.first().is_some_and(|first| fan.iter().all(|t| normal(t).dot(normal(first)) > 0.5))
            });
            let far = link.iter().chain(cut.iter().flat_map(|c| &c.1)).filter(|t| !t.contains(&v));
            let depth = |t: &[u32; 3]| Plane::of(self.at(t)).map_or(f64::NEG_INFINITY, |p| p.depth(self.place(v)));
            let depth = far.map(depth).fold(f64::INFINITY, f64::min);
            if turns && depth > CLEAR && found.as_ref().is_none_or(|f| depth > f.0) {
                found = Some((depth, v, cut));
            }
        }
        let (centre, cut) = match found {
            Some((_, v, cut)) => (v, cut),
            None => {
                let all = link.iter().chain(best.iter().flat_map(|c| &c.1));
                let planes: Vec<Plane> = all.filter_map(|t| Plane::of(self.at(t))).collect();
                let kernel = deepest(&planes);
                if kernel.depth <= 0.0 {
                    return None;
                }
                self.places[s as usize] = kernel.place;
                (s, best)
            }
        };
        for (parent, triangles) in cut {
            self.surface.extend(triangles.iter().map(|t| (*t, parent)));
            link.extend(triangles);
        }
        self.fill(centre, &link);
        Some(())
    }

    /// Takes added points away where what is around them can be filled from a neighbour.
    pub(super) fn simplify(&mut self) {
        for _ in 0..ROUNDS {
            let mut gone = 0;
            for s in self.own..self.places.len() as u32 {
                let link = self.take(s);
                if link.is_empty() {
                    continue;
                }
                let worst = |v: u32, place: DVec3| {
                    let shape = |t: &[u32; 3]| shape([place, self.place(t[0]), self.place(t[1]), self.place(t[2])]);
                    link.iter().filter(|t| !t.contains(&v)).map(shape).fold(f64::INFINITY, f64::min)
                };
                let now = worst(s, self.place(s));
                let corners: BTreeSet<u32> = link.iter().flatten().copied().collect();
                let ways = corners.into_iter().map(|v| (worst(v, self.place(v)), v));
                let best = ways.reduce(|a, b| if b.0 > a.0 { b } else { a });
                let centre = best.filter(|b| b.0 > SHAPELY || b.0 > now.max(1e-9)).map_or(s, |b| b.1);
                gone += usize::from(centre != s);
                self.fill(centre, &link);
            }
            if gone == 0 {
                return;
            }
        }
    }

    /// The tetrahedra between `centre` and those triangles that do not have it.
    fn fill(&mut self, centre: u32, triangles: &[[u32; 3]]) {
        let far = triangles.iter().filter(|t| !t.contains(&centre));
        self.tetrahedra.extend(far.map(|t| [centre, t[0], t[1], t[2]]));
    }

    /// Takes the tetrahedra around point `s` out, and returns their faces opposite to it, outward.
    fn take(&mut self, s: u32) -> Vec<[u32; 3]> {
        let mut link = vec![];
        self.tetrahedra.retain(|t| {
            let Some(k) = t.iter().position(|p| *p == s) else { return true };
            link.push(OUTWARD[k].map(|i| t[i]));
            false
        });
        link
    }

    /// The shape of the worst tetrahedron.
    pub(super) fn worst(&self) -> f64 {
        let shape = |t: &[u32; 4]| shape(t.map(|p| self.place(p)));
        self.tetrahedra.iter().map(shape).fold(f64::INFINITY, f64::min)
    }

    /// Drops points that nothing uses.
    pub(super) fn tidy(&mut self) {
        let own = self.own;
        let used: BTreeSet<u32> = self.tetrahedra.iter().flatten().copied().filter(|p| *p >= own).collect();
        let number: HashMap<u32, u32> = used.iter().enumerate().map(|(i, p)| (*p, own + i as u32)).collect();
        let kept: Vec<DVec3> = used.iter().map(|p| self.place(*p)).collect();
        self.places.truncate(own as usize);
        self.places.extend(kept);
        self.tetrahedra.iter_mut().flatten().filter(|p| **p >= own).for_each(|p| *p = number[p]);
    }

    fn place(&self, p: u32) -> DVec3 {
        self.places[p as usize]
    }

    fn at(&self, t: &[u32; 3]) -> [DVec3; 3] {
        t.map(|p| self.place(p))
    }
}

/// How far a tetrahedron is from being flat: its volume over that of a corner of a cube as long as its longest edge; less
/// than 0 if it is turned inside out.
fn shape([a, b, c, d]: [DVec3; 4]) -> f64 {
    let edges = [b - a, c - a, d - a, c - b, d - b, d - c];
    let longest = edges.iter().map(|e| e.length_squared()).fold(0.0, f64::max);
    DMat3::from_cols(edges[0], edges[1], edges[2]).determinant() / longest.powf(1.5)
}
