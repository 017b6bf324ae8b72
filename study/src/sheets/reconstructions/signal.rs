//! A trilinear field along straight lines, and what stands for it between samples: by itself, without the engine that is
//! studied.

use halite::cast::{ReconstructionOrder, Sampling};

/// A field on a grid, from 0 to 1.
pub(super) struct Samples {
    pub(super) axes: [Vec<f64>; 3],
    /// x fastest, then y.
    pub(super) values: Vec<f64>,
}

/// A line through a field: from a place, in voxels of mean width per unit of t.
pub(super) struct Line<'a> {
    field: &'a Samples,
    from: [f64; 3],
    along: [f64; 3],
    /// Where it crosses faces of voxels, its ends among these, ascending.
    pub(super) faces: Vec<f64>,
}

/// Points at which a slab is compared.
const DENSE: usize = 64;

/// Numbers from 0 to 1 that look random.
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

impl Samples {
    /// A volume of `n`³ values that know nothing of each other.
    pub(super) fn random(n: usize, random: &mut Random) -> Self {
        let axis = || (0..n).map(|i| i as f64).collect::<Vec<_>>();
        Samples { axes: [axis(), axis(), axis()], values: (0..n * n * n).map(|_| random.next()).collect() }
    }

    /// Its mean voxel's width.
    pub(super) fn width(&self) -> f64 {
        self.axes.iter().map(|axis| (axis[axis.len() - 1] - axis[0]).abs() / (axis.len() - 1) as f64).sum::<f64>() / 3.0
    }

    fn at(&self, p: [f64; 3]) -> f64 {
        let place = [0, 1, 2].map(|a| {
            let axis = &self.axes[a];
            let i = (axis.partition_point(|c| *c <= p[a]).max(1) - 1).min(axis.len() - 2);
            (i, ((p[a] - axis[i]) / (axis[i + 1] - axis[i])).clamp(0.0, 1.0))
        });
        let [nx, ny] = [self.axes[0].len(), self.axes[1].len()];
        let corner = |c: usize| {
            let [i, j, k] = [0, 1, 2].map(|a| place[a].0 + (c >> a & 1));
            let weight: f64 = (0..3).map(|a| if c >> a & 1 == 1 { place[a].1 } else { 1.0 - place[a].1 }).product();
            weight * self.values[(k * ny + j) * nx + i]
        };
        (0..8).map(corner).sum()
    }

    /// A line between two places inside.
    pub(super) fn line(&self, from: [f64; 3], to: [f64; 3]) -> Line<'_> {
        let way: [f64; 3] = [0, 1, 2].map(|a| to[a] - from[a]);
        let length = way.iter().map(|d| d * d).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
        let end = length / self.width();
        let along = way.map(|d| d / end);
        let mut faces = vec![0.0, end];
        for a in (0..3).filter(|&a| along[a] != 0.0) {
            faces.extend(self.axes[a].iter().map(|c| (c - from[a]) / along[a]).filter(|t| *t > 0.0 && *t < end));
        }
        faces.sort_by(f64::total_cmp);
        Line { field: self, from, along, faces }
    }

    /// A line between two random places of the boundary's faces across an axis.
    pub(super) fn random_line(&self, random: &mut Random) -> Line<'_> {
        let across = (random.next() * 3.0) as usize;
        let mut ends = [0.0, 1.0].map(|side| {
            [0, 1, 2].map(|a| {
                let (first, last) = (self.axes[a][0], self.axes[a][self.axes[a].len() - 1]);
                first + (last - first) * if a == across { side } else { random.next() }
            })
        });
        if random.next() < 0.5 {
            ends.reverse();
        }
        self.line(ends[0], ends[1])
    }
}

/// What stands for the field at `u` of a slab with these samples.
fn rebuilt(order: ReconstructionOrder, [f, m, b]: [f64; 3], u: f64) -> f64 {
    let (first, second) = (u < 0.5, (u * 2.0).fract());
    match order {
        ReconstructionOrder::Two | ReconstructionOrder::Exact => {
            ((2.0 * f - 4.0 * m + 2.0 * b) * u - 3.0 * f + 4.0 * m - b) * u + f
        }
        ReconstructionOrder::One if first => f + (m - f) * second,
        ReconstructionOrder::One => m + (b - m) * (2.0 * u - 1.0),
        ReconstructionOrder::Midpoint => m,
        ReconstructionOrder::Left => {
            if first {
                f
            } else {
                m
            }
        }
        ReconstructionOrder::Right => {
            if first {
                m
            } else {
                b
            }
        }
    }
}

impl Line<'_> {
    pub(super) fn end(&self) -> f64 {
        self.faces[self.faces.len() - 1]
    }

    /// The field at t.
    pub(super) fn at(&self, t: f64) -> f64 {
        self.field.at([0, 1, 2].map(|a| self.from[a] + self.along[a] * t))
    }

    /// Slabs, whose samples are at their ends and midway.
    pub(super) fn slabs(&self, sampling: Sampling) -> Vec<[f64; 2]> {
        match sampling {
            Sampling::Voxels => self.faces.windows(2).map(|w| [w[0], w[1]]).filter(|[a, b]| b > a).collect(),
            Sampling::Steps(step) => {
                let count = (self.end() / (2.0 * step)).ceil().max(1.0) as usize;
                let at = |i: usize| (2.0 * step * i as f64).min(self.end());
                (0..count).map(|i| [at(i), at(i + 1)]).filter(|[a, b]| b > a).collect()
            }
        }
    }

    /// What stands for the field, as points (t, value) at equal distances in each slab.
    pub(super) fn rebuilt(&self, order: ReconstructionOrder, sampling: Sampling) -> Vec<[f64; 2]> {
        let mut points = vec![];
        for [a, b] in self.slabs(sampling) {
            let samples = [a, f64::midpoint(a, b), b].map(|t| self.at(t));
            let point = |i: usize| (i as f64 + 0.5) / DENSE as f64;
            points.extend((0..DENSE).map(|i| [a + (b - a) * point(i), rebuilt(order, samples, point(i))]));
        }
        points
    }

    /// The integral of how far that is from the field, with both behind a function.
    pub(super) fn deviation(&self, order: ReconstructionOrder, sampling: Sampling, of: impl Fn(f64) -> f64) -> f64 {
        let slabs = self.slabs(sampling);
        let points = self.rebuilt(order, sampling);
        let width = |i: usize| (slabs[i / DENSE][1] - slabs[i / DENSE][0]) / DENSE as f64;
        points.iter().enumerate().map(|(i, [t, s])| (of(self.at(*t)) - of(*s)).abs() * width(i)).sum()
    }

    /// Slabs that a face of a voxel crosses, of all.
    pub(super) fn crossed(&self, sampling: Sampling) -> [usize; 2] {
        let slabs = self.slabs(sampling);
        let crossed = slabs.iter().filter(|[a, b]| self.faces.iter().any(|t| a + 1e-9 < *t && *t < b - 1e-9)).count();
        [crossed, slabs.len()]
    }

    /// Segments in voxels along which the field turns twice, and all along which it changes.
    pub(super) fn turns(&self) -> [usize; 2] {
        let mut counts = [0; 2];
        for [a, b] in self.slabs(Sampling::Voxels).into_iter().filter(|[a, b]| b - a > 1e-6) {
            // The cubic through four places, which the field is.
            let [p, q, r, s] = [0.0, 1.0, 2.0, 3.0].map(|k| self.at(a + (b - a) * k / 3.0));
            let third = 4.5 * (s - 3.0 * r + 3.0 * q - p);
            let second = 4.5 * (2.0 * p - 5.0 * q + 4.0 * r - s);
            let first = -5.5 * p + 9.0 * q - 4.5 * r + s;
            let greatest = first.abs().max(second.abs()).max(third.abs());
            if greatest < 1e-9 {
                continue;
            }
            counts[1] += 1;
            let (x, y, z) = (3.0 * third, 2.0 * second, first);
            let square = y * y - 4.0 * x * z;
            if x.abs() < 1e-9 * greatest || square <= 0.0 {
                continue;
            }
            let inside =
                [-1.0, 1.0].map(|sign| (-y + sign * square.sqrt()) / (2.0 * x)).map(|u| 1e-6 < u && u < 1.0 - 1e-6);
            counts[0] += usize::from(inside[0] && inside[1]);
        }
        counts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line() -> Samples {
        Samples::random(9, &mut Random(3))
    }

    #[test]
    fn parabolas_are_nearer_than_lines_and_these_than_rectangles() {
        let (samples, mut random) = (line(), Random(5));
        let mut sums = [0.0; 3];
        for _ in 0..200 {
            let line = samples.random_line(&mut random);
            for (sum, order) in
                sums.iter_mut().zip([ReconstructionOrder::Midpoint, ReconstructionOrder::One, ReconstructionOrder::Two])
            {
                *sum += line.deviation(order, Sampling::Voxels, |s| s);
            }
        }
        assert!(sums[0] > 2.0 * sums[1] && sums[1] > 4.0 * sums[2] && sums[2] > 0.0, "{sums:?}");
    }

    /// (x − ⅓)(y − ½)(z − ⅔) along the diagonal turns twice; a field that is linear never.
    #[test]
    fn turns_are_counted() {
        let values = |f: &dyn Fn([f64; 3]) -> f64| {
            (0..8).map(|c| f([0, 1, 2].map(|a| f64::from(c >> a & 1)))).collect::<Vec<f64>>()
        };
        let axis = || vec![0.0, 1.0];
        let field = |f: &dyn Fn([f64; 3]) -> f64| Samples { axes: [axis(), axis(), axis()], values: values(f) };
        let cubic = field(&|[x, y, z]: [f64; 3]| (x - 1.0 / 3.0) * (y - 0.5) * (z - 2.0 / 3.0));
        assert_eq!(cubic.line([0.0; 3], [1.0; 3]).turns(), [1, 1]);
        assert_eq!(field(&|[x, y, z]: [f64; 3]| x + y - z).line([0.0; 3], [1.0, 0.9, 0.2]).turns(), [0, 1]);
        assert_eq!(field(&|_| 0.5).line([0.0; 3], [1.0; 3]).turns(), [0, 0]);
    }

    #[test]
    fn slabs_cover_lines() {
        let samples = line();
        let line = samples.line([0.2, 0.4, 0.3], [7.9, 6.1, 7.7]);
        for sampling in [Sampling::Voxels, Sampling::Steps(0.7), Sampling::Steps(100.0)] {
            let slabs = line.slabs(sampling);
            assert!(slabs[0][0] == 0.0 && slabs[slabs.len() - 1][1] == line.end(), "{slabs:?}");
            assert!(slabs.windows(2).all(|w| w[0][1] == w[1][0]), "{slabs:?}");
        }
        assert_eq!(line.crossed(Sampling::Voxels)[0], 0);
        assert_eq!(line.crossed(Sampling::Steps(100.0)), [1, 1]);
    }
}
