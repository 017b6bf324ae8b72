//! Meshes that need no file, for the demo, tests and benchmarks. Each is the same on every machine and in every run.
//!
//! Lattices have `n` points along each axis of [−1, 1]³, so (n − 1)³ hexahedra; points inside are moved by up to a
//! tenth of the spacing, those on the outside stay. Every mesh has a point array "s" and a cell array "c" of f64, of
//! the same smooth function at points and at cell centres.

use crate::mesh::{Array, Cells, Mesh, Values};
use glam::{DVec3, dvec3};
use std::f64::consts::TAU;

const TETRAHEDRON: u8 = 10;
const VOXEL: u8 = 11;
const HEXAHEDRON: u8 = 12;
const WEDGE: u8 = 13;
const PYRAMID: u8 = 14;

/// Quads of a hexahedron, counter-clockwise as seen from inside: the bases of the six pyramids around its centre.
const INWARD: [[usize; 4]; 6] = [[0, 3, 7, 4], [1, 5, 6, 2], [0, 4, 5, 1], [3, 2, 6, 7], [0, 1, 2, 3], [4, 7, 6, 5]];

/// The six tetrahedra along the diagonal from corner 0 to corner 6 of a hexahedron (Kuhn 1960): all hexahedra of a
/// lattice split like this fit together.
const KUHN: [[usize; 4]; 6] = [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]];

/// The two wedges on either side of a hexahedron's diagonal plane through its points 1, 3, 5, 7.
const WEDGES: [[usize; 6]; 2] = [[0, 3, 1, 4, 7, 5], [2, 1, 3, 6, 5, 7]];

/// A lattice of hexahedra.
pub fn hexahedra(n: usize) -> Mesh {
    lattice(n, |_, hexahedron, add, _| add.cell(HEXAHEDRON, &hexahedron))
}

/// A lattice of tetrahedra, six to a hexahedron: 119 points along each axis make 9.9 million.
pub fn tetrahedra(n: usize) -> Mesh {
    lattice(n, |_, hexahedron, add, _| kuhn(hexahedron, add))
}

/// A lattice of wedges, two to a hexahedron.
pub fn wedges(n: usize) -> Mesh {
    lattice(n, |_, hexahedron, add, _| WEDGES.iter().for_each(|w| add.cell(WEDGE, &w.map(|i| hexahedron[i]))))
}

/// A lattice of pyramids, six to a hexahedron, which meet in one more point in its middle.
pub fn pyramids(n: usize) -> Mesh {
    lattice(n, |_, hexahedron, add, _| pyramid_split(hexahedron, add, false))
}

/// A lattice of hexahedra, voxels, wedges, pyramids and tetrahedra side by side, whose faces fit together. As voxels
/// are no longer boxes when their points are moved, they are only numbered like voxels.
pub fn mixed(n: usize) -> Mesh {
    lattice(n, |at, hexahedron, add, random| {
        // A column is all wedges or has none: their triangles would not fit to a quad above or below.
        if (at[0] + 2 * at[1]) % 3 == 0 {
            WEDGES.iter().for_each(|w| add.cell(WEDGE, &w.map(|i| hexahedron[i])));
            return;
        }
        match random.below(4) {
            0 => add.cell(HEXAHEDRON, &hexahedron),
            1 => add.cell(VOXEL, &[0, 1, 3, 2, 4, 5, 7, 6].map(|i: usize| hexahedron[i])),
            2 => pyramid_split(hexahedron, add, false),
            _ => pyramid_split(hexahedron, add, true),
        }
    })
}

/// Tetrahedra of a lattice without a slab (so that two components are left), a tunnel through one of these, a cavity in
/// the other and a bay in the side of each.
pub fn islands(n: usize) -> Mesh {
    lattice(n, |at, hexahedron, add, _| {
        let centre = DVec3::from(at.map(|i| 2.0 * (i as f64 + 0.5) / (n as f64 - 1.0) - 1.0));
        let slab = centre.x.abs() < 0.15;
        let tunnel = dvec3(centre.x - 0.6, 0.0, centre.z).length() < 0.22;
        let cavity = (centre - dvec3(-0.6, 0.0, 0.0)).length() < 0.28;
        let bay = (centre.z > 0.4 || centre.z < -0.7) && centre.y.abs() < 0.3;
        if !(slab || tunnel || cavity || bay) {
            kuhn(hexahedron, add);
        }
    })
}

/// The same cells, each with points of its own, as discontinuous fields have them.
pub fn unwelded(mesh: &Mesh) -> Mesh {
    let (cells, from) = (mesh.cells(), &mesh.cells().connectivity);
    let own = Cells {
        types: cells.types.clone(),
        offsets: cells.offsets.clone(),
        connectivity: (0..from.len() as u32).collect(),
    };
    let arrays = mesh.point_arrays().iter().map(|a| {
        let tuples = from.iter().flat_map(|&p| (0..a.components).map(move |k| p as usize * a.components + k));
        let values = Values::F64(tuples.map(|i| a.values.get(i)).collect());
        Array { name: a.name.clone(), components: a.components, values }
    });
    Mesh {
        points: from.iter().map(|&p| mesh.points[p as usize]).collect::<Vec<_>>().into(),
        cells: own.into(),
        polyhedra: None,
        point_arrays: arrays.collect(),
        cell_arrays: mesh.cell_arrays().to_vec(),
        ..Mesh::default()
    }
}

/// Two blocks of hexahedra that touch at x = 0 without sharing points: n³ of them below, (2n)³ half as large above. A
/// face of the coarse block lies beside four of the fine one, so both stay boundary.
pub fn t_junction(n: usize) -> Mesh {
    let mut add = Builder::default();
    for (cells, from) in [(n, -1.0), (2 * n, 0.0)] {
        let h = 1.0 / cells as f64;
        let first = add.points.len();
        let side = cells + 1;
        for (i, j, k) in indices(side) {
            add.points.push(dvec3(from + i as f64 * h, j as f64 * h - 0.5, k as f64 * h - 0.5));
        }
        for (i, j, k) in indices(cells) {
            let point = |[i, j, k]: [usize; 3]| (first + i + side * (j + side * k)) as u32;
            add.cell(HEXAHEDRON, &corners([i, j, k]).map(point));
        }
    }
    add.mesh(smooth)
}

/// A ring of `n` ≥ 3 long tetrahedra around the z axis. Each passes over the start of the next one, all the way round,
/// so seen along z none of them can be drawn first.
pub fn ring(n: usize) -> Mesh {
    let n = n.max(3);
    let mut add = Builder::default();
    for i in 0..n {
        let at = |i: usize| {
            let (y, x) = (TAU * i as f64 / n as f64).sin_cos();
            dvec3(x, y, 0.0) * 0.8
        };
        let (from, to) = (at(i), at(i + 1));
        let along = (to - from) * 0.2;
        let across = dvec3(-along.y, along.x, 0.0).normalize() * 0.08;
        let (low, high) = (from - along - DVec3::Z * 0.2, to + along + DVec3::Z * 0.2);
        let first = add.points.len() as u32;
        add.points.extend([low - across, low + across, high - DVec3::Z * 0.05, high + DVec3::Z * 0.05]);
        add.cell(TETRAHEDRON, &[first, first + 2, first + 1, first + 3]);
    }
    add.mesh(smooth)
}

/// A ball with a hole along z, finer towards the hole: about 6 · 3 n · n² tetrahedra. In it lies a vortex tube, tied
/// into a trefoil knot: "s" is large in the tube, negative in the counter-rotating sheath around it, and fades to 0.
pub fn demo(n: usize) -> Mesh {
    let (around, side) = (3 * n, n + 1);
    let mut add = Builder::default();
    let mut random = Random(11);
    for (j, k, i) in (0..around).flat_map(|i| (0..side).flat_map(move |k| (0..side).map(move |j| (j, k, i)))) {
        let inside = j > 0 && j < n && k > 0 && k < n;
        let mut moved = |amount: f64| if inside { amount * random.symmetric() } else { 0.0 };
        let step = 1.0 / n as f64;
        let z = 0.88 * (2.0 * (k as f64 * step + moved(0.2 * step)) - 1.0);
        let outward = (j as f64 * step + moved(0.2 * step)).powf(1.3);
        let rho = HOLE + ((1.0 - z * z).sqrt() - HOLE) * outward;
        let (y, x) = (TAU * (i as f64 + moved(0.2)) / around as f64).sin_cos();
        add.points.push(dvec3(rho * x, rho * y, z));
    }
    for i in 0..around {
        for (j, k) in (0..n).flat_map(|k| (0..n).map(move |j| (j, k))) {
            let point = |[j, i, k]: [usize; 3]| (j + side * (k + side * (i % around))) as u32;
            kuhn(corners([j, i, k]).map(point), &mut add);
        }
    }
    add.mesh(trefoil)
}

/// Radius of the demo's hole.
const HOLE: f64 = 0.16;

/// Two strands that wind three times around the ring ρ = 0.55, z = 0 while they go around it twice are one knot.
fn trefoil(p: DVec3) -> f64 {
    let (rho, theta) = (p.x.hypot(p.y), p.y.atan2(p.x));
    let (from, z) = (rho - 0.55, p.z);
    let (distance, phi) = (from.hypot(z), z.atan2(from));
    let strand = 0.5 + 0.5 * (2.0 * phi - 3.0 * theta).cos();
    let bell = |x: f64, width: f64| (-(x / width).powi(2)).exp();
    // At the middle of the ring the angle phi is undefined: the bells are 0 there to 1e-3.
    let tube = strand.powi(3) * bell(distance - 0.23, 0.085);
    let sheath = (1.0 - strand).powi(3) * bell(distance - 0.27, 0.10);
    tube - 0.45 * sheath
}

/// The field of all meshes but the demo's.
fn smooth(p: DVec3) -> f64 {
    (3.0 * p.x).sin() + (4.0 * p.y + p.x).cos() * p.z + 0.5 * p.z
}

fn kuhn(hexahedron: [u32; 8], add: &mut Builder) {
    for t in KUHN {
        add.cell(TETRAHEDRON, &t.map(|i| hexahedron[i]));
    }
}

/// Six pyramids around the middle of a hexahedron, or twelve tetrahedra with the diagonals of [`crate::mesh::cells`].
fn pyramid_split(hexahedron: [u32; 8], add: &mut Builder, tetrahedra: bool) {
    let centre = hexahedron.iter().map(|&p| add.points[p as usize]).sum::<DVec3>() / 8.0;
    let apex = add.points.len() as u32;
    add.points.push(centre);
    for quad in INWARD.map(|q| q.map(|i| hexahedron[i])) {
        if !tetrahedra {
            add.cell(PYRAMID, &[quad[0], quad[1], quad[2], quad[3], apex]);
            continue;
        }
        let key = |i: &usize| add.points[quad[*i] as usize].to_array();
        let first = (0..4).min_by(|i, j| key(i).partial_cmp(&key(j)).unwrap_or(std::cmp::Ordering::Equal)).unwrap_or(0);
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| quad[(first + i) % 4]);
        add.cell(TETRAHEDRON, &[a, b, c, apex]);
        add.cell(TETRAHEDRON, &[a, c, d, apex]);
    }
}

fn lattice(n: usize, fill: impl Fn([usize; 3], [u32; 8], &mut Builder, &mut Random)) -> Mesh {
    let mut add = Builder::default();
    let mut random = Random(7);
    let h = 2.0 / (n.max(2) - 1) as f64;
    for (i, j, k) in indices(n) {
        let axis = |i: usize, random: &mut Random| {
            // The last point exactly at 1, so that the outside is flat.
            let x = if i == n - 1 { 1.0 } else { i as f64 * h - 1.0 };
            if i == 0 || i == n - 1 { x } else { x + 0.1 * h * random.symmetric() }
        };
        add.points.push(dvec3(axis(i, &mut random), axis(j, &mut random), axis(k, &mut random)));
    }
    for (i, j, k) in indices(n.saturating_sub(1)) {
        let point = |[i, j, k]: [usize; 3]| (i + n * (j + n * k)) as u32;
        fill([i, j, k], corners([i, j, k]).map(point), &mut add, &mut random);
    }
    add.mesh(smooth)
}

/// All (i, j, k) below `n`, i fastest.
fn indices(n: usize) -> impl Iterator<Item = (usize, usize, usize)> {
    (0..n).flat_map(move |k| (0..n).flat_map(move |j| (0..n).map(move |i| (i, j, k))))
}

/// The lattice indices of a hexahedron's corners, in VTK's order.
fn corners([i, j, k]: [usize; 3]) -> [[usize; 3]; 8] {
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
        .map(|[a, b, c]| [i + a, j + b, k + c])
}

/// A mesh in the making.
#[derive(Default)]
struct Builder {
    points: Vec<DVec3>,
    types: Vec<u8>,
    offsets: Vec<u64>,
    connectivity: Vec<u32>,
}

impl Builder {
    fn cell(&mut self, vtk_type: u8, points: &[u32]) {
        self.types.push(vtk_type);
        self.offsets.push(self.connectivity.len() as u64);
        self.connectivity.extend_from_slice(points);
    }

    fn mesh(mut self, field: fn(DVec3) -> f64) -> Mesh {
        self.offsets.push(self.connectivity.len() as u64);
        let cells = Cells { types: self.types, offsets: self.offsets, connectivity: self.connectivity };
        let array = |name: &str, values| Array { name: name.into(), components: 1, values: Values::F64(values) };
        let at_centre = |c: usize| {
            let ids = cells.points(c);
            field(ids.iter().map(|&p| self.points[p as usize]).sum::<DVec3>() / ids.len() as f64)
        };
        let s = array("s", self.points.iter().map(|&p| field(p)).collect());
        let c = array("c", (0..cells.len()).map(at_centre).collect());
        Mesh {
            points: self.points.into(),
            cells: cells.into(),
            polyhedra: None,
            point_arrays: vec![s],
            cell_arrays: vec![c],
            ..Mesh::default()
        }
    }
}

/// Marsaglia's xorshift64 (2003).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// A number in [−1, 1).
    fn symmetric(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    pub(crate) fn below(&mut self, n: usize) -> usize {
        (self.next() >> 33) as usize % n
    }
}
