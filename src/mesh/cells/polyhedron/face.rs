//! The cut of a polygon into triangles: by its own points alone, so that two cells cut the face between them alike.

use glam::{DVec2, DVec3};
use std::cmp::Ordering;

/// The best cut takes the third power of the corners' number; beyond so many, ears are cut off instead.
const MOST_CORNERS: usize = 64;

/// Ears take the second power; a face of more corners, which no writer makes, is a fan.
const MOST_EARS: usize = 1 << 13;

/// A triangle below this quality counts as turned over.
const FLAT: f64 = 1e-9;

/// What the cut of a face works with, kept from face to face.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    place: Vec<DVec3>,
    best: Vec<(f64, u32)>,
    stack: Vec<(usize, usize)>,
    triangles: Vec<[usize; 3]>,
}

/// Cuts a face into triangles that turn like it. `order` is that of points.
pub(super) fn cut_face(
    face: &[u32],
    place: impl Fn(u32) -> DVec3,
    order: impl Fn(u32, u32) -> Ordering,
    scratch: &mut Scratch,
    out: &mut Vec<[u32; 3]>,
) {
    let n = face.len();
    if let &[a, b, c] = face {
        return out.push([a, b, c]);
    }
    let (first, turned) = start(face, &place, &order);
    let corner = |i: usize| face[if turned { first + n - i } else { first + i } % n];
    scratch.place.clear();
    scratch.place.extend((0..n).map(|i| place(corner(i))));
    scratch.cut();
    out.extend(scratch.triangles.iter().map(|t| {
        let [a, b, c] = t.map(corner);
        if turned { [a, c, b] } else { [a, b, c] }
    }));
}

/// Cuts a polygon into triangles of its corners' numbers, which turn like it.
pub(super) fn cut_polygon(places: impl Iterator<Item = DVec3>) -> Vec<[usize; 3]> {
    let mut scratch = Scratch::default();
    scratch.place.extend(places);
    match scratch.place.len() {
        0..3 => vec![],
        3 => vec![[0, 1, 2]],
        _ => {
            scratch.cut();
            scratch.triangles
        }
    }
}

/// Where to start, and whether to go backwards: from the smallest point towards its smaller neighbour, the same from
/// both sides.
fn start(face: &[u32], place: &impl Fn(u32) -> DVec3, order: &impl Fn(u32, u32) -> Ordering) -> (usize, bool) {
    let n = face.len();
    let first = (0..n).min_by(|&i, &j| order(face[i], face[j])).unwrap_or(0);
    let again = (0..n).filter(|&i| place(face[i]) == place(face[first]));
    let (next, last) = (face[(first + 1) % n], face[(first + n - 1) % n]);
    if again.clone().count() == 1 && place(next) != place(last) {
        return (first, order(next, last).is_gt());
    }
    // A face that passes a point twice: the smallest of all sequences.
    let corner = |(first, turned): (usize, bool), i: usize| face[if turned { first + n - i } else { first + i } % n];
    let ways = again.flat_map(|i| [(i, false), (i, true)]);
    let smaller = |a: &(usize, bool), b: &(usize, bool)| {
        (0..n)
            .map(|i| [corner(*a, i), corner(*b, i)])
            .find(|[p, q]| place(*p) != place(*q))
            .map_or(Ordering::Equal, |[p, q]| order(p, q))
    };
    ways.min_by(smaller).unwrap_or((first, false))
}

impl Scratch {
    /// Cuts the polygon `place` of four corners or more.
    fn cut(&mut self) {
        self.triangles.clear();
        let n = self.place.len();
        let base = self.place[0];
        self.place.iter_mut().for_each(|p| *p -= base);
        let place = &self.place;
        let normal = (0..n).map(|i| place[i].cross(place[(i + 1) % n])).sum::<DVec3>();
        let size = normal.length();
        // How far a triangle is from being flat or turned over.
        let quality = |i: usize, j: usize, k: usize| {
            let [a, b, c] = [place[i], place[j], place[k]];
            let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
            (b - a).cross(c - a).dot(normal) / (longest * size)
        };
        if n == 4 {
            // From the smallest point, like a face of any cell, unless that is wrong.
            let from = |i: usize| quality(i, (i + 1) % 4, (i + 2) % 4).min(quality(i, (i + 2) % 4, (i + 3) % 4));
            let own = from(0);
            let other = own.is_nan() || own > FLAT || own >= from(1);
            return self.triangles.extend(if other { [[0, 1, 2], [0, 2, 3]] } else { [[1, 2, 3], [0, 1, 3]] });
        }
        if n > MOST_EARS {
            return self.triangles.extend((2..n).map(|i| [0, i - 1, i]));
        }
        if n > MOST_CORNERS {
            return self.ears(normal);
        }
        // The best worst triangle of the corners from i to k, and the corner that it has between them (Klincsek 1980).
        let best = &mut self.best;
        best.clear();
        best.resize(n * n, (f64::INFINITY, 0));
        for width in 2..n {
            for i in 0..n - width {
                let k = i + width;
                let mut found = (f64::NEG_INFINITY, i as u32 + 1);
                for j in i + 1..k {
                    let so_far = best[i * n + j].0.min(best[j * n + k].0);
                    if so_far > found.0 {
                        let worst = quality(i, j, k).min(so_far);
                        if worst > found.0 {
                            found = (worst, j as u32);
                        }
                    }
                }
                best[i * n + k] = found;
            }
        }
        self.stack.push((0, n - 1));
        while let Some((i, k)) = self.stack.pop() {
            if k - i >= 2 {
                let j = best[i * n + k].1 as usize;
                self.triangles.push([i, j, k]);
                self.stack.extend([(i, j), (j, k)]);
            }
        }
    }

    /// Cuts off the best ear again and again (Meisters 1975), as seen along the axis that is nearest to `normal`.
    fn ears(&mut self, normal: DVec3) {
        let axis = normal.abs().max_position();
        let flat = |p: &DVec3| {
            let [x, y, z] = p.to_array();
            let seen = [DVec2::new(y, z), DVec2::new(z, x), DVec2::new(x, y)][axis];
            if normal[axis] < 0.0 { DVec2::new(seen.y, seen.x) } else { seen }
        };
        let at: Vec<DVec2> = self.place.iter().map(flat).collect();
        let turn = |i: usize, j: usize, k: usize| orient(at[i], at[j], at[k]);
        let mut left: Vec<usize> = (0..at.len()).collect();
        // The quality of the triangle at each corner that is left; `None` if not known.
        let mut ear: Vec<Option<f64>> = vec![None; at.len()];
        while left.len() > 3 {
            let n = left.len();
            let around = |i: usize| [left[(i + n - 1) % n], left[i], left[(i + 1) % n]];
            let shape = |[a, b, c]: [usize; 3]| {
                let longest = [(a, b), (b, c), (c, a)].map(|(i, j)| at[i].distance_squared(at[j]));
                turn(a, b, c) / longest.into_iter().fold(0.0, f64::max)
            };
            let empty = |[a, b, c]: [usize; 3]| {
                left.iter().all(|&p| {
                    [a, b, c].iter().any(|&q| at[p] == at[q])
                        || turn(a, b, p) < 0.0
                        || turn(b, c, p) < 0.0
                        || turn(c, a, p) < 0.0
                })
            };
            let mut found: Option<(usize, f64)> = None;
            for i in 0..n {
                let t = around(i);
                let quality = *ear[left[i]].get_or_insert_with(|| {
                    let shape = shape(t);
                    if shape > 0.0 && empty(t) { shape } else { f64::NEG_INFINITY }
                });
                if quality > found.map_or(f64::NEG_INFINITY, |f| f.1) {
                    found = Some((i, quality));
                }
            }
            let best = || (0..n).max_by(|&i, &j| shape(around(i)).total_cmp(&shape(around(j)))).unwrap_or(0);
            let i = found.map_or_else(best, |f| f.0);
            let t = around(i);
            self.triangles.push(t);
            ear[t[0]] = None;
            ear[t[2]] = None;
            if found.is_none() {
                ear.fill(None);
            }
            left.remove(i);
        }
        self.triangles.push([left[0], left[1], left[2]]);
    }
}

/// Twice the area of a triangle, of the exact sign: above 0 if it turns counter-clockwise.
pub(super) fn orient(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let [a, b, c] = [a, b, c].map(|p| robust::Coord { x: p.x, y: p.y });
    robust::orient2d(a, b, c)
}
