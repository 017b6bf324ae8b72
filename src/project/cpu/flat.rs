//! One cell in f64, pixel by pixel: for cells whose thickness f32 cannot tell. The equations are those of `setup`.

use crate::order::screen::{Lens, NEAREST};
use glam::DVec3;

/// A cell relative to its deepest corner.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cell {
    meet: bool,
    /// Depth, column and row of the deepest corner R.
    depth: f64,
    at: [f64; 2],
    /// Which corner it is.
    first: usize,
    /// The normals a₁, a₂, a₃ of the faces that hold R over D; they give the weights of the corners opposite to them.
    normals: [DVec3; 3],
    /// v of the four faces, of 1, x and y; that opposite to R comes first.
    planes: [[f64; 3]; 4],
    /// Which are turned to the eye.
    fronts: [bool; 4],
}

impl Cell {
    pub(super) fn new(lens: &Lens, mut p: [DVec3; 4]) -> Self {
        let w = p.map(|q| lens.place(q).z);
        let first = (1..4).fold(0, |m, k| if w[k] > w[m] { k } else { m });
        p.swap(0, first);
        let h = lens.place(p[0]);
        let (depth, place) = (h.z, lens.pixel(h));
        let e = [1, 2, 3].map(|k| {
            let d = lens.turn(p[k] - p[0]);
            if lens.meet { DVec3::new(d.x - place.x * d.z, d.y - place.y * d.z, d.z) } else { d }
        });
        let mut a = [e[1].cross(e[2]), e[2].cross(e[0]), e[0].cross(e[1])];
        let det = e[0].dot(a[0]);
        if det < 0.0 {
            a = a.map(|a| -a);
        }
        let (m, q) = if lens.meet { (depth, 1.0) } else { (1.0, 0.0) };
        let (sum, volume) = (a[0] + a[1] + a[2], det.abs());
        let c = m * sum.z + q * volume;
        let guard = |v: f64, scale: f64| v.abs().max(scale * 1e-15 + 1e-280).copysign(v);
        let mut planes = [[0.0; 3]; 4];
        let f = m / guard(c, m * (sum.x.abs() + sum.y.abs()));
        planes[0] = [f * volume, -f * m * sum.x, -f * m * sum.y];
        for i in 0..3 {
            a[i].z = guard(a[i].z, a[i].x.abs() + a[i].y.abs());
            let f = m / a[i].z;
            planes[i + 1] = [0.0, -f * a[i].x, -f * a[i].y];
        }
        let fronts = [c < 0.0, a[0].z > 0.0, a[1].z > 0.0, a[2].z > 0.0];
        let normals = a.map(|a| a / volume);
        Cell { meet: lens.meet, depth, at: place.to_array(), first, normals, planes, fronts }
    }

    /// The depths at which the ray at this column and row enters and leaves.
    pub(super) fn depths(&self, column: f64, row: f64) -> Option<[f64; 2]> {
        let (x, y) = (column - self.at[0], row - self.at[1]);
        let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
        for (p, front) in self.planes.iter().zip(self.fronts) {
            let v = p[0] + p[1] * x + p[2] * y;
            if front {
                enter = enter.max(v);
            } else {
                leave = leave.min(v);
            }
        }
        // What lies behind the eye is beyond R.
        if self.meet {
            leave = leave.min(self.depth);
        }
        if enter >= leave {
            return None;
        }
        let depth = |v: f64| match self.meet {
            true if v == f64::NEG_INFINITY => NEAREST,
            true => self.depth / (1.0 - v / self.depth),
            false => self.depth + v,
        };
        Some([depth(enter), depth(leave)])
    }

    /// The weights of the corners at depth `w` of that ray, each in [0, 1].
    pub(super) fn weights(&self, column: f64, row: f64, w: f64) -> [f64; 4] {
        let scale = if self.meet { w } else { 1.0 };
        let place = DVec3::new((column - self.at[0]) * scale, (row - self.at[1]) * scale, w - self.depth);
        let [a, b, c] = self.normals.map(|n| n.dot(place).clamp(0.0, 1.0));
        let mut weights = [(1.0 - a - b - c).clamp(0.0, 1.0), a, b, c];
        let sum: f64 = weights.iter().sum();
        weights = weights.map(|b| b / sum);
        weights.swap(0, self.first);
        weights
    }
}
