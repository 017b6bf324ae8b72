//! The mesh as engines read it: coordinates near 0, points and cells where memory is near, and the field's values in
//! that order.
//!
//! [`boundary`] finds the faces through which rays enter, [`contacts`] what touches without sharing faces.

pub mod boundary;
pub mod contacts;

use crate::buckets::Buckets;
use crate::error::{Error, Result};
use crate::field::normalization::{self, Normalization};
use crate::field::{Association, Field};
use crate::mesh::cells::Tetrahedra;
use crate::mesh::faces::{BOUNDARY, Faces};
use boundary::Boundary;
use bytemuck::Zeroable;
use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// Meshes that are less thick than this, of what they are wide, are too flat for f32.
const FLATTEST: f64 = 5e-5;

/// One tetrahedron as engines see it: 32 bytes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, bytemuck::Pod, Zeroable)]
#[repr(C)]
pub struct Cell {
    /// Indices into [`TetMesh::points`].
    pub corners: [u32; 4],
    /// `neighbours[k]` lies beyond the face opposite to corner k; [`BOUNDARY`] if nothing does.
    pub neighbours: [u32; 4],
}

/// A mesh made ready to be drawn: coordinates relative to its centre and within [−1, 1], points and cells along a
/// space-filling curve, points at one position made one.
#[derive(Debug, Clone, Default)]
pub struct TetMesh {
    /// The middle of the mesh's bounds, in world coordinates.
    pub centre: DVec3,
    /// Normalised coordinates are (world − centre) · scale; a power of two.
    pub scale: f64,
    /// Normalised positions.
    pub points: Vec<DVec3>,
    /// The tetrahedra.
    pub cells: Vec<Cell>,
    /// The boundary faces.
    pub boundary: Boundary,
    /// The mesh's point that each point is; of several at one position, one of them.
    pub(crate) point_of: Vec<u32>,
    /// The tetrahedron, as [`Tetrahedra`] counts, that each cell is.
    tetrahedron_of: Vec<u32>,
    /// True if several points of the mesh share a position.
    welded: bool,
    /// A bit for each cell, 64 in a word, where cells have neighbours: its corners are a left-handed system, for flat cells by what
    /// their neighbours are.
    left_handed: Vec<u64>,
}

impl TetMesh {
    /// Prepares `tetrahedra`, whose corners index into `points`: see [`Tetrahedra::points`].
    pub fn new(points: &[DVec3], tetrahedra: &Tetrahedra, faces: &Faces) -> Self {
        let corners = &tetrahedra.corners;
        let weld = |p: u32| faces.weld.as_ref().map_or(p, |w| w[p as usize]);
        let mut used = vec![false; points.len()];
        corners.iter().flatten().for_each(|&p| used[weld(p) as usize] = true);
        let used: Vec<u32> = (0..points.len() as u32).filter(|&p| used[p as usize]).collect();
        let (centre, scale) = match bounds(used.par_iter().map(|&p| points[p as usize])) {
            [low, high] if low.x <= high.x => normalisation(low, high),
            _ => normalisation(DVec3::ZERO, DVec3::ZERO),
        };
        let normalised = |p: u32| (points[p as usize] - centre) * scale;
        let point_of = along_curve(&used, normalised);
        let mut new_point = vec![0; points.len()];
        point_of.iter().enumerate().for_each(|(new, &old)| new_point[old as usize] = new as u32);

        let all: Vec<u32> = (0..corners.len() as u32).collect();
        let tetrahedron_of =
            along_curve(&all, |t| corners[t as usize].iter().map(|&p| normalised(p)).sum::<DVec3>() / 4.0);
        let mut new_cell = vec![0; corners.len()];
        tetrahedron_of.iter().enumerate().for_each(|(new, &old)| new_cell[old as usize] = new as u32);
        let cells: Vec<Cell> = tetrahedron_of
            .par_iter()
            .map(|&t| Cell {
                corners: corners[t as usize].map(|p| new_point[weld(p) as usize]),
                neighbours: faces.neighbours[t as usize]
                    .map(|n| if n == BOUNDARY { BOUNDARY } else { new_cell[n as usize] }),
            })
            .collect();
        let points: Vec<DVec3> = point_of.par_iter().map(|&p| normalised(p)).collect();
        let boundary = faces
            .boundary
            .par_iter()
            .map(|&(t, k)| boundary::BoundaryFace {
                points: faces.outward(corners, (t, k)).map(|p| new_point[p as usize]),
                cell: new_cell[t as usize],
            })
            .collect();
        let boundary = Boundary::new(&points, boundary);
        let left_handed = left_handed(&faces.orientation, |i| tetrahedron_of[i] as usize);
        let welded = faces.weld.is_some();
        TetMesh { centre, scale, points, cells, boundary, point_of, tetrahedron_of, welded, left_handed }
    }

    /// Prepares `tetrahedra` for engines that do not walk: cells have no neighbours, and there is no boundary.
    pub fn unconnected(points: &[DVec3], tetrahedra: &Tetrahedra) -> Self {
        let neighbours = vec![[BOUNDARY; 4]; tetrahedra.corners.len()];
        Self::new(points, tetrahedra, &Faces { neighbours, ..Faces::default() })
    }

    /// Finds the neighbours of cells and the boundary of what [`Self::unconnected`] made, as it is now.
    pub(crate) fn connect(&mut self) {
        let mut corners: Vec<[u32; 4]> = self.cells.par_iter().map(|c| c.corners).collect();
        let faces = Faces::new(&self.points, &corners);
        // Points whose positions were rounded to one are one.
        if let Some(weld) = &faces.weld {
            corners.par_iter_mut().for_each(|c| *c = c.map(|p| weld[p as usize]));
        }
        let cells = self.cells.par_iter_mut().zip(&corners).zip(&faces.neighbours);
        cells.for_each(|((cell, corners), neighbours)| *cell = Cell { corners: *corners, neighbours: *neighbours });
        let boundary = faces
            .boundary
            .par_iter()
            .map(|&(t, k)| boundary::BoundaryFace { points: faces.outward(&corners, (t, k)), cell: t })
            .collect();
        self.boundary = Boundary::new(&self.points, boundary);
        self.welded |= faces.weld.is_some();
        self.left_handed = left_handed(&faces.orientation, |i| i);
    }

    /// Whether cells know their neighbours.
    pub(crate) fn is_connected(&self) -> bool {
        self.left_handed.len() == self.cells.len().div_ceil(64)
    }

    /// Whether it is known that no two points of the mesh share a position.
    pub(crate) fn is_apart(&self) -> bool {
        self.is_connected() && !self.welded
    }

    /// Whether the corners of a cell, of a mesh whose cells have neighbours, are a left-handed system.
    #[inline(always)]
    pub(crate) fn is_left_handed(&self, cell: usize) -> bool {
        self.left_handed[cell / 64] >> (cell % 64) & 1 == 1
    }

    /// The positions of the points of the mesh and those that its split added, so many, normalised: as far as cells use
    /// them, else NaN.
    pub(crate) fn points_of_mesh(&self, tetrahedra: &Tetrahedra, count: usize) -> Vec<DVec3> {
        let mut points = vec![DVec3::NAN; count];
        if !self.welded {
            self.point_of.iter().zip(&self.points).for_each(|(&p, &at)| points[p as usize] = at);
            return points;
        }
        for (cell, &t) in self.cells.iter().zip(&self.tetrahedron_of) {
            for (own, p) in cell.corners.iter().zip(tetrahedra.corners[t as usize]) {
                points[p as usize] = self.points[*own as usize];
            }
        }
        points
    }

    /// Moves the points: `points` are as many as before, in world coordinates. Cells keep their neighbours, so none may
    /// turn inside out, and points that shared a position still must.
    pub fn set_points(&mut self, points: &[DVec3]) {
        let [low, high] = bounds(self.point_of.par_iter().map(|&p| points[p as usize]));
        if low.x <= high.x {
            (self.centre, self.scale) = normalisation(low, high);
        }
        let (centre, scale) = (self.centre, self.scale);
        self.points = self.point_of.par_iter().map(|&p| (points[p as usize] - centre) * scale).collect();
        self.boundary.refit(&self.points);
    }

    /// Whether the mesh is so flat, or so thin a needle, that f32 tells no lengths across it: the variance of its points
    /// along one of their principal axes is next to nothing beside that along another.
    pub fn is_flat(&self) -> bool {
        let [least, greatest] = outer_eigenvalues(self.covariance());
        !self.cells.is_empty() && least < FLATTEST * FLATTEST * greatest
    }

    /// Whether the mesh is so thin a needle that f32 tells no places across it: as [`Self::is_flat`], along two axes.
    pub fn is_needle(&self) -> bool {
        let covariance = self.covariance();
        let [least, greatest] = outer_eigenvalues(covariance);
        let middle = covariance.x_axis.x + covariance.y_axis.y + covariance.z_axis.z - least - greatest;
        !self.cells.is_empty() && middle < FLATTEST * FLATTEST * greatest
    }

    /// How the points vary about their mean.
    fn covariance(&self) -> DMat3 {
        let n = self.points.len().max(1) as f64;
        let mean = self.points.par_iter().copied().reduce(|| DVec3::ZERO, |a, b| a + b) / n;
        let product = |p: &DVec3| {
            let d = *p - mean;
            DMat3::from_cols(d * d.x, d * d.y, d * d.z)
        };
        self.points.par_iter().map(product).reduce(|| DMat3::ZERO, |a, b| a + b) * (1.0 / n)
    }

    /// The longest edge of a cell, in normalised units: no segment of a ray is longer.
    pub fn longest_edge(&self) -> f64 {
        let edges = |c: &Cell| {
            let p = c.corners.map(|i| self.points[i as usize]);
            let pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
            pairs.iter().map(|&(i, j)| p[i].distance_squared(p[j])).fold(0.0, f64::max)
        };
        self.cells.par_iter().map(edges).reduce(|| f64::MIN_POSITIVE, f64::max).sqrt()
    }

    /// Bytes that it takes at most to make one of so many points and tetrahedra, with what [`Faces::new`] needs and leaves.
    pub(crate) fn room(points: usize, tetrahedra: usize) -> u64 {
        120 * tetrahedra as u64 + 60 * points as u64
    }

    /// Bytes that a walk reads.
    pub fn bytes(&self) -> u64 {
        (size_of_val(&*self.points) + size_of_val(&*self.cells)) as u64 + self.boundary.bytes()
    }
}

/// The values of a field with `N` components, in the order of a [`TetMesh`], normalised: what the transfer function tells
/// apart is in [−1, 1] or near it, and outliers are up to 2⁴⁰ away.
#[derive(Debug, Clone)]
pub enum Values<const N: usize> {
    /// One for each point.
    Point(Vec<[f32; N]>),
    /// One for each corner of each cell: the field jumps between cells that share a position.
    Corner(Vec<[[f32; N]; 4]>),
    /// One for each cell.
    Cell(Vec<[f32; N]>),
}

impl<const N: usize> Values<N> {
    /// Brings the values of `field`, as `normal` maps each component, into the order of `geometry`, made from
    /// `tetrahedra`.
    ///
    /// # Errors
    /// [`Error::Field`] if there are not as many values as points or cells.
    pub fn new(
        geometry: &TetMesh,
        tetrahedra: &Tetrahedra,
        points: usize,
        cells: usize,
        field: &Field,
        normal: &[Normalization; 4],
    ) -> Result<Self> {
        let (what, count) = match field.association() {
            Association::Point => ("points", points),
            Association::Cell => ("cells", cells),
        };
        if field.kind().components() != N || field.len() != count * N {
            return Err(Error::Field(format!("the field has {} values for {count} {what}", field.len() / N)));
        }
        let limits: [f64; N] =
            std::array::from_fn(|k| if N == 4 && k < 3 { normalization::MOST_COLOUR } else { normalization::MOST });
        let brought = |value: &dyn Fn(usize) -> f64| std::array::from_fn(|k| normal[k].bounded(value(k), limits[k]));
        if field.association() == Association::Cell {
            return Ok(Self::of_cells(geometry, tetrahedra, |c| brought(&|k| field.value(c * N + k))));
        }
        let added = tetrahedra.added_values(N, |i| field.value(i));
        Ok(Self::of_points(geometry, tetrahedra, |i: u32| {
            let first = i as usize * N;
            brought(&|k| first.checked_sub(count * N).map_or_else(|| field.value(first + k), |i| added[i + k]))
        }))
    }

    /// The values of the cells of the mesh, in the order of `geometry`, made from `tetrahedra`.
    pub(crate) fn of_cells(
        geometry: &TetMesh,
        tetrahedra: &Tetrahedra,
        value: impl Fn(usize) -> [f32; N] + Sync,
    ) -> Self {
        let cell = |t: u32| tetrahedra.cell.as_ref().map_or(t, |c| c[t as usize]) as usize;
        Values::Cell(geometry.tetrahedron_of.par_iter().map(|&t| value(cell(t))).collect())
    }

    /// The values of the points of the mesh and those that its split added, likewise.
    pub(crate) fn of_points(
        geometry: &TetMesh,
        tetrahedra: &Tetrahedra,
        value: impl Fn(u32) -> [f32; N] + Sync,
    ) -> Self {
        let at_points: Vec<[f32; N]> = geometry.point_of.par_iter().map(|&p| value(p)).collect();
        let own = |t: u32| tetrahedra.corners[t as usize].map(&value);
        let bits = |v: [f32; N]| v.map(f32::to_bits);
        let continuous = !geometry.welded
            || geometry.cells.par_iter().zip(&geometry.tetrahedron_of).all(|(cell, &t)| {
                let own = own(t);
                (0..4).all(|k| bits(at_points[cell.corners[k] as usize]) == bits(own[k]))
            });
        if continuous {
            return Values::Point(at_points);
        }
        Values::Corner(geometry.tetrahedron_of.par_iter().map(|&t| own(t)).collect())
    }

    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        match self {
            Values::Point(v) | Values::Cell(v) => size_of_val(&**v) as u64,
            Values::Corner(v) => size_of_val(&**v) as u64,
        }
    }
}

/// The bits of [`TetMesh::left_handed`], of the signs of the volumes of tetrahedra and the one that each cell is.
fn left_handed(orientation: &[i8], tetrahedron: impl Fn(usize) -> usize + Sync) -> Vec<u64> {
    let n = orientation.len();
    let word = |w: usize| {
        let cells = 64 * w..n.min(64 * w + 64);
        cells.fold(0, |bits, i| bits | u64::from(orientation[tetrahedron(i)] < 0) << (i % 64))
    };
    (0..n.div_ceil(64)).into_par_iter().with_min_len(1024).map(word).collect()
}

/// The least and the greatest eigenvalue of a symmetric matrix, by Jacobi's rotations (1846).
fn outer_eigenvalues(m: DMat3) -> [f64; 2] {
    let mut a = m.to_cols_array_2d();
    for (p, q) in [(0, 1), (0, 2), (1, 2)].into_iter().cycle().take(36) {
        if a[p][q] == 0.0 {
            continue;
        }
        let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
        let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
        let c = 1.0 / t.hypot(1.0);
        let turned = |x: f64, y: f64| (c * (x - t * y), c * (t * x + y));
        for row in &mut a {
            (row[p], row[q]) = turned(row[p], row[q]);
        }
        let turned: [(f64, f64); 3] = std::array::from_fn(|k| turned(a[p][k], a[q][k]));
        (a[p], a[q]) = (turned.map(|t| t.0), turned.map(|t| t.1));
    }
    let values = [a[0][0], a[1][1], a[2][2]];
    [values.into_iter().fold(f64::MAX, f64::min), values.into_iter().fold(f64::MIN, f64::max)]
}

/// Centre and scale that bring what lies between two corners into [−1, 1]³.
fn normalisation(low: DVec3, high: DVec3) -> (DVec3, f64) {
    let (centre, radius) = (low / 2.0 + high / 2.0, (high / 2.0 - low / 2.0).max_element());
    // A power of two scales without rounding; f64 has none for radii below 1e-307, which no mesh has.
    let scale = if radius > 0.0 { (-radius.log2().ceil()).clamp(-1000.0, 1000.0).exp2() } else { 1.0 };
    (centre, scale)
}

/// Smallest and largest coordinates of points: infinite and the wrong way round if there are none.
fn bounds(points: impl IndexedParallelIterator<Item = DVec3>) -> [DVec3; 2] {
    let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    points.fold(|| none, |[l, h], p| [l.min(p), h.max(p)]).reduce(|| none, |a, b| [a[0].min(b[0]), a[1].max(b[1])])
}

/// Bits of a place on the Morton curve by which items are dealt into buckets.
const BUCKET_BITS: u32 = 11;

/// Items that are sorted on several threads.
const LARGE: usize = 1 << 17;

/// `items` ordered along the Morton curve through their places in [−1, 1]³; equal places keep their order.
fn along_curve(items: &[u32], place: impl Fn(u32) -> DVec3 + Sync) -> Vec<u32> {
    // A number has the first bits of an item's place on the curve, and the item's index: half of what both would take is sorted.
    let index_bits = usize::BITS - items.len().leading_zeros();
    let start = |key: u64| key >> index_bits;
    let item = |key: u64| items[(key & ((1 << index_bits) - 1)) as usize];
    let key = |(n, &i): (usize, &u32)| (morton(place(i)) << 1) >> index_bits << index_bits | n as u64;
    let keys: Vec<u64> = items.par_iter().enumerate().map(key).collect();
    let buckets =
        Buckets::new(items.len(), 1 << BUCKET_BITS, |n| [Some((keys[n as usize] >> (64 - BUCKET_BITS)) as usize)]);
    let sorted = |b: usize| {
        let mut keys: Vec<u64> = buckets.items(b).map(|n| keys[n as usize]).collect();
        if keys.len() < LARGE {
            keys.sort_unstable();
        } else {
            keys.par_sort_unstable();
        };
        // Items so near to each other that the first bits are alike.
        let alike = keys.chunk_by_mut(|a, b| start(*a) == start(*b)).filter(|same| same.len() > 1);
        alike.for_each(|same| same.sort_by_cached_key(|&key| morton(place(item(key)))));
        keys.into_iter().map(item).collect::<Vec<u32>>()
    };
    (0..buckets.len()).into_par_iter().map(sorted).collect::<Vec<_>>().concat()
}

/// The index of `p`, in [−1, 1]³, on the Morton curve of 2²¹ steps per axis.
fn morton(p: DVec3) -> u64 {
    let spread = |x: f64| {
        let mut x = ((x + 1.0) * f64::from(1 << 20)).clamp(0.0, f64::from((1 << 21) - 1)) as u64;
        x = (x | x << 32) & 0x1f_0000_0000_ffff;
        x = (x | x << 16) & 0x1f_0000_ff00_00ff;
        x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
        x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
        (x | x << 2) & 0x1249_2492_4924_9249
    };
    spread(p.x) << 2 | spread(p.y) << 1 | spread(p.z)
}
