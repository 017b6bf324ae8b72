//! Polyhedra: any number of faces, each with any number of points.
//!
//! A polyhedron with the faces of a linear cell is split like that. Any other becomes the tetrahedra between a point in
//! its middle and its faces, cut into triangles. How a face is cut depends on its own points alone, so two neighbours
//! agree, and a quad is cut like that of any cell. Nodes that hang on the edges of a face are corners of it like all
//! others.

use super::linear::order;
use glam::{DMat3, DVec3};

/// Faces with more corners are cut into a fan: the best cut takes their third power.
const MOST_CORNERS: usize = 32;

/// Steps of the search for a point that sees all faces.
const STEPS: usize = 200;

/// A polyhedron, cut up.
#[derive(Debug, Default)]
pub(super) struct Cut {
    /// Its points, each once, in the order of positions.
    pub(super) points: Vec<u32>,
    /// The triangles of its faces.
    triangles: Vec<[u32; 3]>,
    /// Its smallest point, if the tetrahedra meet there; else they meet in the middle.
    apex: Option<u32>,
    scratch: Vec<u32>,
}

/// The point in the middle of a polyhedron.
#[derive(Debug)]
pub(super) struct Middle {
    /// The weight of each of [`Cut::points`]; all equal if there is none.
    pub(super) weights: Option<Vec<f64>>,
    /// Whether it sees all faces from inside.
    pub(super) sees_all: bool,
}

impl Cut {
    /// Cuts the faces of a cell; those of fewer than three points are none.
    pub(super) fn take<'a>(&mut self, faces: impl Iterator<Item = &'a [u32]>, points: &[DVec3]) {
        self.points.clear();
        self.triangles.clear();
        let (mut triangles, mut quads, mut others) = (0, 0, 0);
        for face in faces {
            self.scratch.clear();
            for &p in face {
                if self.scratch.last() != Some(&p) {
                    self.scratch.push(p);
                }
            }
            while self.scratch.len() > 1 && self.scratch.first() == self.scratch.last() {
                self.scratch.pop();
            }
            match self.scratch.len() {
                0..3 => continue,
                3 => triangles += 1,
                4 => quads += 1,
                _ => others += 1,
            }
            self.points.extend_from_slice(&self.scratch);
            cut_face(&self.scratch, points, &mut self.triangles);
        }
        self.points.sort_unstable();
        self.points.dedup();
        self.points.sort_unstable_by(|a, b| order(points, *a, *b));
        let linear = [(4, 4, 0), (8, 0, 6), (6, 2, 3), (5, 4, 1)];
        let is_linear = others == 0 && linear.contains(&(self.points.len(), triangles, quads));
        self.apex = self.points.first().copied().filter(|_| is_linear);
        if let Some(apex) = self.apex {
            self.triangles.retain(|t| !t.contains(&apex));
        }
    }

    /// The number of tetrahedra.
    pub(super) fn tetrahedra(&self) -> usize {
        self.triangles.len()
    }

    /// Whether the tetrahedra meet in a point that has to be added.
    pub(super) fn needs_middle(&self) -> bool {
        self.apex.is_none() && !self.triangles.is_empty()
    }

    /// Writes the tetrahedra, which meet in the point `middle` if they need one.
    pub(super) fn fill(&self, middle: u32, out: &mut [[u32; 4]]) {
        let apex = self.apex.unwrap_or(middle);
        out.iter_mut().zip(&self.triangles).for_each(|(out, [a, b, c])| *out = [apex, *a, *b, *c]);
    }

    /// The point in the middle: the mean of all points if it sees all faces, else one that does, if any is found.
    pub(super) fn middle(&self, points: &[DVec3]) -> Middle {
        let place = |p: u32| points[p as usize];
        let mean = self.points.iter().map(|p| place(*p) / self.points.len() as f64).sum::<DVec3>();
        // Relative to the mean, and of a size near 1.
        let reach = self.points.iter().map(|p| place(*p).distance(mean)).fold(0.0, f64::max);
        let local = |p: u32| (place(p) - mean) / reach;
        let planes: Vec<(DVec3, DVec3)> = self
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(local);
                (a, (b - a).cross(c - a))
            })
            .filter(|(_, n)| n.length() > 1e-12)
            .map(|(a, n)| (a, n.normalize()))
            .collect();
        let volume: f64 =
            self.triangles.iter().map(|t| DMat3::from_cols(local(t[0]), local(t[1]), local(t[2])).determinant()).sum();
        let sign = if volume < 0.0 { -1.0 } else { 1.0 };
        // The face that is seen worst: its distance, and the way inwards.
        let worst = |x: DVec3| {
            let depth = |(a, n): &(DVec3, DVec3)| (sign * n.dot(*a - x), -sign * *n);
            planes.iter().map(depth).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, DVec3::ZERO))
        };
        let first = worst(DVec3::ZERO);
        if !reach.is_finite() || first.0 >= -1e-12 {
            return Middle { weights: None, sees_all: first.0 >= -1e-12 };
        }
        let (mut x, mut best) = (DVec3::ZERO, (first.0, DVec3::ZERO));
        for step in 0..STEPS {
            let (depth, inwards) = worst(x);
            if depth > best.0 {
                best = (depth, x);
            }
            x += inwards * 0.5 / (step as f64 + 1.0).sqrt() * (0.1 - depth).clamp(0.02, 1.0);
        }
        let sees_all = best.0 > 0.0;
        let weights = sees_all.then(|| {
            // The weights nearest to equal ones whose mean is that point.
            let spread = self
                .points
                .iter()
                .map(|p| local(*p))
                .fold(DMat3::ZERO, |m, l| m + DMat3::from_cols(l * l.x, l * l.y, l * l.z));
            let pull = spread.inverse() * best.1;
            self.points.iter().map(|p| 1.0 / self.points.len() as f64 + local(*p).dot(pull)).collect::<Vec<f64>>()
        });
        let weights = weights.filter(|w| w.iter().all(|w| w.is_finite()));
        Middle { sees_all: sees_all && weights.is_some(), weights }
    }
}

/// Cuts a face into triangles that turn like it.
fn cut_face(face: &[u32], points: &[DVec3], out: &mut Vec<[u32; 3]>) {
    let n = face.len();
    let first = (0..n).min_by(|&i, &j| order(points, face[i], face[j])).unwrap_or(0);
    // From the smallest point towards its smaller neighbour: the same from both sides.
    let turned = order(points, face[(first + 1) % n], face[(first + n - 1) % n]).is_gt();
    let corner = |i: usize| face[if turned { first + n - i } else { first + i } % n];
    let mut add = |[a, b, c]: [usize; 3]| {
        let [a, b, c] = [a, b, c].map(corner);
        out.push(if turned { [a, c, b] } else { [a, b, c] });
    };
    if !(5..=MOST_CORNERS).contains(&n) {
        return (2..n).for_each(|i| add([0, i - 1, i]));
    }
    let base = points[corner(0) as usize];
    let place: Vec<DVec3> = (0..n).map(|i| points[corner(i) as usize] - base).collect();
    let normal = (0..n).map(|i| place[i].cross(place[(i + 1) % n])).sum::<DVec3>();
    // How far a triangle is from being flat or turned over.
    let quality = |i: usize, j: usize, k: usize| {
        let [a, b, c] = [place[i], place[j], place[k]];
        let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
        (b - a).cross(c - a).dot(normal) / (longest * normal.length())
    };
    // The best worst triangle of the corners from i to k, and the corner that it has between them (Klincsek 1980).
    let mut best = vec![(f64::INFINITY, 0); n * n];
    for width in 2..n {
        for i in 0..n - width {
            let k = i + width;
            let mut found = (f64::NEG_INFINITY, i + 1);
            for j in i + 1..k {
                let worst = quality(i, j, k).min(best[i * n + j].0).min(best[j * n + k].0);
                if worst > found.0 {
                    found = (worst, j);
                }
            }
            best[i * n + k] = found;
        }
    }
    let mut stack = vec![(0, n - 1)];
    while let Some((i, k)) = stack.pop() {
        if k - i >= 2 {
            let j = best[i * n + k].1;
            add([i, j, k]);
            stack.extend([(i, j), (j, k)]);
        }
    }
}
