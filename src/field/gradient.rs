//! The gradient of a scalar field, for the points of a mesh.
//!
//! In a tetrahedron with the edges e₁, e₂, e₃ from one corner, along which the scalar rises by d₁, d₂, d₃, the gradient is
//! (d₁ e₂×e₃ + d₂ e₃×e₁ + d₃ e₁×e₂)/det with det = e₁·(e₂×e₃), six times its volume. The gradient at a point is the mean
//! of those in the tetrahedra around it, weighted by their volumes: so the division cancels, and slivers, whatever their
//! gradient, count for as little as they are. Cells that are no tetrahedra give it by the split that is drawn: it depends
//! on the diagonals there.
//!
//! Points that share position and value are one point, as between the pieces of a file; where values jump between cells,
//! each side has a gradient of its own.

use super::{Association, Field, Kind};
use crate::error::{Error, Result};
use crate::memory;
use crate::mesh::cells::Tetrahedra;
use crate::mesh::faces::weld;
use glam::DVec3;
use rayon::prelude::*;
use robust::Coord3D;

/// The gradient at each point of a mesh and those that its split added, as [`Tetrahedra::points`] counts them.
#[derive(Debug, Clone, PartialEq)]
pub struct Gradient {
    vectors: Vec<DVec3>,
    range: [f64; 2],
}

/// By what share of its terms a determinant may be off.
const DOUBT: f64 = 1e-14;

/// Points that one task sums up for, at least: cells between those of two tasks are computed twice.
const FEWEST: usize = 1 << 13;

/// Cells of which it is known where their points are, so that tasks pass over what is not theirs.
const TOGETHER: usize = 1 << 10;

/// A sum of gradients times volumes, and of volumes.
type Sum = [f64; 4];

/// Nothing yet: its volume is −0, which no sum is.
const NONE: Sum = [0.0, 0.0, 0.0, -0.0];

impl Gradient {
    /// The gradient of `field` on `tetrahedra`, whose corners index into `points`: see [`Tetrahedra::points`]. On the
    /// current rayon pool; its bits do not depend on the number of threads. Zero at points without a cell that is drawn.
    ///
    /// # Errors
    /// [`Error::Field`] if the field is one of cells, or not of one component, or does not fit the points;
    /// [`Error::NoMemory`].
    pub fn new(points: &[DVec3], tetrahedra: &Tetrahedra, field: &Field) -> Result<Self> {
        Self::of(points, tetrahedra, field, false)
    }

    /// The same; no two points that cells use share a position, if they are told to be `apart`.
    pub(crate) fn of(points: &[DVec3], tetrahedra: &Tetrahedra, field: &Field, apart: bool) -> Result<Self> {
        if field.association() == Association::Cell {
            return Err(Error::Field(
                "values of cells have no gradient, as they are constant inside; choose an array of points".into(),
            ));
        }
        if field.kind() != Kind::Scalar {
            return Err(Error::Field("a field of several components has no gradient; choose one of them".into()));
        }
        let (own, all) = (field.len(), points.len());
        if own + tetrahedra.added.len() != all {
            return Err(Error::Field(format!("the field has {own} values for {all} points")));
        }
        let values = tetrahedra.values(field.values(), 1);
        let same = if apart { None } else { same(points, &values) };
        // Neither lengths nor differences of values may leave the range of f64 in a product of three.
        let normal = field.normal(0);
        let scale = 1.0 / extent(points).max(f64::MIN_POSITIVE * 4.0);
        let summer = Summer { points, values: &values, scale, inverse: 1.0 / normal.half, size: normal.half * scale };
        let mut vectors = memory::filled("the gradient", DVec3::ZERO, all)?;
        let corners = &tetrahedra.corners;
        let range = match &same {
            None => summer.all(corners, &|p| p, &mut vectors),
            Some(same) => summer.all(corners, &|p| same[p as usize], &mut vectors),
        };
        if let Some(same) = same {
            let firsts = (0..all).into_par_iter().filter(|&p| same[p] as usize != p);
            let copies: Vec<(usize, DVec3)> = firsts.map(|p| (p, vectors[same[p] as usize])).collect();
            copies.into_iter().for_each(|(p, v)| vectors[p] = v);
        }
        Ok(Gradient { vectors, range: if range[0] <= range[1] { range } else { [0.0; 2] } })
    }

    /// The vector at each point, in units of the field per world unit, towards greater values.
    pub fn vectors(&self) -> &[DVec3] {
        &self.vectors
    }

    /// The least and the greatest length where anything is drawn.
    pub fn range(&self) -> [f64; 2] {
        self.range
    }

    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        Self::room(self.vectors.len())
    }

    /// Bytes that the gradient at so many points takes.
    pub fn room(points: usize) -> u64 {
        (points * size_of::<DVec3>()) as u64
    }
}

/// The length of a vector, also where its square leaves the range of f64.
pub(crate) fn length(v: DVec3) -> f64 {
    let square = v.length_squared();
    if (1e-280..1e280).contains(&square) { square.sqrt() } else { v.x.hypot(v.y).hypot(v.z) }
}

/// For each point the first of those at its position that have its value; none if no two points share a position.
fn same(points: &[DVec3], values: &[f64]) -> Option<Vec<u32>> {
    let mut same = weld(points)?;
    // −0 + 0 = 0, so that both zeros are one value.
    let bits = |p: u32| (values[p as usize] + 0.0).to_bits();
    let mut shared: Vec<u32> = (0..points.len() as u32).into_par_iter().filter(|&p| same[p as usize] != p).collect();
    let firsts: Vec<u32> = shared.iter().map(|&p| same[p as usize]).collect();
    shared.extend(firsts);
    shared.par_sort_unstable();
    shared.dedup();
    shared.par_sort_unstable_by_key(|&p| (same[p as usize], bits(p), p));
    let first_of = |group: &[u32]| group.iter().map(|&p| (p, group[0])).collect::<Vec<_>>();
    let groups = shared.chunk_by(|&a, &b| same[a as usize] == same[b as usize] && bits(a) == bits(b));
    let firsts: Vec<(u32, u32)> = groups.flat_map(first_of).collect();
    firsts.into_iter().for_each(|(p, first)| same[p as usize] = first);
    Some(same)
}

/// The longest side of the bounds of all finite points.
fn extent(points: &[DVec3]) -> f64 {
    let none = || [DVec3::INFINITY, DVec3::NEG_INFINITY];
    let [lo, hi] = points
        .par_iter()
        .filter(|p| p.is_finite())
        .fold(none, |[lo, hi], &p| [lo.min(p), hi.max(p)])
        .reduce(none, |a, b| [a[0].min(b[0]), a[1].max(b[1])]);
    if lo.x <= hi.x { (hi - lo).max_element() } else { 0.0 }
}

/// Adds up the gradients around points.
struct Summer<'a> {
    points: &'a [DVec3],
    values: &'a [f64],
    /// What lengths are multiplied by.
    scale: f64,
    /// What values are multiplied by.
    inverse: f64,
    /// What gradients in these units are multiplied by.
    size: f64,
}

impl Summer<'_> {
    /// Finds the means at all points, and the least and the greatest length where anything is drawn. What stands for a point is
    /// `same` of it.
    ///
    /// A task has some of the points, and adds up for each of them in the sequence of the cells, whatever the tasks are.
    fn all(&self, corners: &[[u32; 4]], same: &(impl Fn(u32) -> u32 + Sync), vectors: &mut [DVec3]) -> [f64; 2] {
        let points = vectors.len();
        let hull = |some: &[[u32; 4]]| {
            let join = |[lo, hi]: [u32; 2], p: u32| [lo.min(p), hi.max(p)];
            some.iter().flatten().map(|&p| same(p)).fold([u32::MAX, 0], join)
        };
        let hulls: Vec<[u32; 2]> = corners.par_chunks(TOGETHER).with_min_len(16).map(hull).collect();
        let tasks = rayon::current_num_threads().min(points / FEWEST + 1);
        let share = points.div_ceil(tasks).max(1);
        let none = || [f64::INFINITY, f64::NEG_INFINITY];
        let ranges = vectors.par_chunks_mut(share).enumerate().map(|(i, vectors)| {
            let (first, end) = (i * share, i * share + vectors.len());
            let mut sums = vec![NONE; vectors.len()];
            for (some, [low, high]) in corners.chunks(TOGETHER).zip(&hulls) {
                if (*low as usize) < end && *high as usize >= first {
                    self.add(some, same, first as u32, &mut sums);
                }
            }
            self.means(&sums, vectors)
        });
        ranges.reduce(none, |a, b| [a[0].min(b[0]), a[1].max(b[1])])
    }

    /// Adds what cells have to the sums of the points from `first` on.
    fn add(&self, corners: &[[u32; 4]], same: &impl Fn(u32) -> u32, first: u32, sums: &mut [Sum]) {
        for corners in corners {
            let at = corners.map(|p| same(p).wrapping_sub(first) as usize);
            if at.iter().all(|&i| i >= sums.len()) {
                continue;
            }
            let Some(cell) = self.of(corners) else { continue };
            for i in at {
                if let Some(sum) = sums.get_mut(i) {
                    (0..4).for_each(|k| sum[k] += cell[k]);
                }
            }
        }
    }

    /// Makes means of sums, and says how long the least and the greatest are where anything is drawn.
    fn means(&self, sums: &[Sum], vectors: &mut [DVec3]) -> [f64; 2] {
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        for ([x, y, z, weight], to) in sums.iter().zip(vectors) {
            if *weight > 0.0 {
                *to = DVec3::new(*x, *y, *z) / *weight * self.size;
            }
            if weight.is_sign_positive() {
                let length = length(*to);
                range = [range[0].min(length), range[1].max(length)];
            }
        }
        range
    }

    /// Gradient times volume, and volume, of one tetrahedron, all times 6, 0 without a volume; none if it is not drawn.
    #[inline(always)]
    fn of(&self, corners: &[u32; 4]) -> Option<Sum> {
        let values = corners.map(|p| self.values[p as usize] * self.inverse);
        let points = corners.map(|p| self.points[p as usize]);
        let [a, b, c] = [1, 2, 3].map(|k| (points[k] - points[0]) * self.scale);
        let [across, beside, over] = [b.cross(c), c.cross(a), a.cross(b)];
        let mut det = a.dot(across);
        // Not finite if anything is not.
        if !(det + values[0] + values[1] + values[2] + values[3]).is_finite() {
            return None;
        }
        // The sign of what is flat but for rounding is that of the points as they are: far from that, by six products of lengths.
        let products = a.length_squared() * b.length_squared() * c.length_squared();
        if det * det <= 36.0 * DOUBT * DOUBT * products {
            det = self.sure(&points, [a, b, c], det);
        }
        let [d, e, f] = [1, 2, 3].map(|k| values[k] - values[0]);
        let DVec3 { x, y, z } = (across * d + beside * e + over * f) * det.signum();
        Some(if det == 0.0 { [0.0; 4] } else { [x, y, z, det.abs()] })
    }

    /// The determinant of a tetrahedron that may be flat but for rounding, of the sign that its points have.
    #[cold]
    #[inline(never)]
    fn sure(&self, points: &[DVec3; 4], [a, b, c]: [DVec3; 3], det: f64) -> f64 {
        let doubt = DOUBT
            * a.abs().dot(DVec3::new(
                b.y.abs() * c.z.abs() + b.z.abs() * c.y.abs(),
                b.z.abs() * c.x.abs() + b.x.abs() * c.z.abs(),
                b.x.abs() * c.y.abs() + b.y.abs() * c.x.abs(),
            ));
        if det.abs() > doubt {
            return det;
        }
        let [p, q, r, s] = points.map(|p| {
            let DVec3 { x, y, z } = p * self.scale;
            Coord3D { x, y, z }
        });
        // Shewchuk's sign is that of det(p − s, q − s, r − s), the opposite of ours.
        -robust::orient3d(p, q, r, s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Component;
    use crate::mesh::{Mesh, generate};

    fn field(mesh: &Mesh, f: impl Fn(DVec3) -> f64) -> Field {
        let values: Vec<f64> = mesh.points().iter().map(|&p| f(p)).collect();
        Field::from_slice("s", &values, 1, Association::Point, Component::Index(0)).unwrap()
    }

    fn gradient(mesh: &Mesh, field: &Field) -> Gradient {
        let tetrahedra = Tetrahedra::new(mesh).unwrap();
        Gradient::new(&tetrahedra.points(mesh.points()), &tetrahedra, field).unwrap()
    }

    /// On every kind of cell, at any size and place, in any unit.
    #[test]
    fn linear_fields_have_their_gradient() {
        let wanted = DVec3::new(3.0, -1.0, 0.5);
        for mesh in [generate::demo(3), generate::hexahedra(3), generate::mixed(2)] {
            for (size, unit) in [(1.0, 1.0), (1e-120, 1e30), (1e90, 1e-200)] {
                let moved = mesh.clone().scaled(DVec3::splat(size)).unwrap();
                let of = gradient(&moved, &field(&moved, |p| wanted.dot(p / size) * unit + 7.0 * unit));
                for &p in Tetrahedra::new(&moved).unwrap().corners.iter().flatten() {
                    let v = of.vectors()[p as usize] / unit * size;
                    assert!((v - wanted).length() < 1e-9, "{size} {unit}: {v} is not {wanted}");
                }
                let [lo, hi] = of.range().map(|l| l / unit * size);
                assert!((lo - wanted.length()).abs() < 1e-9 && (hi - wanted.length()).abs() < 1e-9);
            }
        }
    }

    /// Two tetrahedra by hand: the mean is weighted by volume, and an outer point has its own cell's alone.
    #[test]
    fn means_are_weighted_by_volume() {
        let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -3.0]];
        let cells = crate::mesh::Cells {
            types: vec![10, 10],
            offsets: vec![0, 4, 8],
            connectivity: vec![0, 1, 2, 3, 0, 1, 2, 4],
        };
        let mesh = Mesh::new(points.map(DVec3::from).to_vec(), cells, vec![], vec![]).unwrap();
        let values = [0.0, 0.0, 0.0, 2.0, 3.0];
        let field = Field::from_slice("s", &values, 1, Association::Point, Component::Index(0)).unwrap();
        let of = gradient(&mesh, &field);
        assert_eq!(of.vectors()[3], DVec3::new(0.0, 0.0, 2.0));
        assert_eq!(of.vectors()[4], DVec3::new(0.0, 0.0, -1.0));
        for v in &of.vectors()[..3] {
            assert!((*v - DVec3::new(0.0, 0.0, (2.0 - 3.0) / 4.0)).length() < 1e-15, "{v}");
        }
        assert_eq!(of.range(), [0.25, 2.0]);
    }

    /// A mesh in pieces, each with points of its own, is one mesh where values agree, and none where they jump.
    #[test]
    fn seams_are_invisible_and_jumps_are_not() {
        let whole = generate::demo(3);
        let curved = |p: DVec3| p.x * p.y + 2.0 * p.z * p.z;
        let wanted = gradient(&whole, &field(&whole, curved));
        let corners = Tetrahedra::new(&whole).unwrap().corners;
        let alone = |jump: f64| {
            let points: Vec<DVec3> = corners.iter().flatten().map(|&p| whole.points()[p as usize]).collect();
            let values: Vec<f64> = points.iter().enumerate().map(|(i, &p)| curved(p) + jump * (i / 4) as f64).collect();
            let cells = crate::mesh::Cells {
                types: vec![10; corners.len()],
                offsets: (0..=corners.len() as u64).map(|i| 4 * i).collect(),
                connectivity: (0..points.len() as u32).collect(),
            };
            let mesh = Mesh::new(points, cells, vec![], vec![]).unwrap();
            let field = Field::from_slice("s", &values, 1, Association::Point, Component::Index(0)).unwrap();
            gradient(&mesh, &field)
        };
        let split = alone(0.0);
        for (i, &p) in corners.iter().flatten().enumerate() {
            assert!((split.vectors()[i] - wanted.vectors()[p as usize]).length() < 1e-12);
        }
        let jumps = alone(100.0);
        let mut different = 0;
        for (t, corners) in corners.iter().enumerate() {
            let own = jumps.vectors()[4 * t];
            for k in 1..4 {
                assert!((jumps.vectors()[4 * t + k] - own).length() < 1e-9, "a cell on its own is linear");
            }
            different += usize::from((own - wanted.vectors()[corners[0] as usize]).length() > 1e-3);
        }
        assert!(different > corners.len() / 2);
    }

    #[test]
    fn its_bits_do_not_depend_on_threads_and_missing_values_touch_no_other() {
        let mesh = generate::demo(16);
        let mut values: Vec<f64> = mesh.points().iter().map(|p| (p.x * 3.0).sin() + p.y * p.z).collect();
        let of = |values: &[f64], threads: usize| {
            let field = Field::from_slice("s", values, 1, Association::Point, Component::Index(0)).unwrap();
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| gradient(&mesh, &field))
        };
        let one = of(&values, 1);
        assert!(mesh.points().len() > FEWEST, "several tasks");
        assert_eq!(one, of(&values, 5));
        let corners = Tetrahedra::new(&mesh).unwrap().corners;
        let hole = corners[7][1];
        values[hole as usize] = f64::NAN;
        let missing = of(&values, 2);
        assert!(missing.vectors().iter().all(|v| v.is_finite()));
        let near: Vec<u32> = corners.iter().filter(|c| c.contains(&hole)).flatten().copied().collect();
        for p in (0..mesh.points().len() as u32).filter(|p| !near.contains(p)) {
            assert_eq!(missing.vectors()[p as usize], one.vectors()[p as usize]);
        }
    }

    #[test]
    fn cells_have_no_gradient() {
        let mesh = generate::demo(2);
        let tetrahedra = Tetrahedra::new(&mesh).unwrap();
        let told = |field: &Field| Gradient::new(mesh.points(), &tetrahedra, field).unwrap_err().to_string();
        let values = vec![1.0; mesh.cells().len()];
        let cells = Field::from_slice("c", &values, 1, Association::Cell, Component::Index(0)).unwrap();
        assert!(told(&cells).contains("values of cells have no gradient"));
        let pairs = vec![1.0; 2 * mesh.points().len()];
        let pairs = Field::from_slice("p", &pairs, 2, Association::Point, Component::All).unwrap();
        assert!(told(&pairs).contains("several components"));
        let few = Field::from_slice("f", &[1.0; 3], 1, Association::Point, Component::Index(0)).unwrap();
        assert!(told(&few).contains("3 values"));
    }
}
