//! Lots that decide scenes: meshes, fields, transfer functions and views, the same in every run.

use super::Scene;
use glam::{DVec2, DVec3, dvec2, dvec3};
use halite::field::Association::{self, Cell, Point};
use halite::field::Field;
use halite::mesh::{Array, Cells, Mesh, Values, generate};
use halite::transfer::{Convention, Emission, TransferFunction};
use halite::view::{Blend, Camera, ClippingPlane, DepthBuffer, DepthKind, Projection, View};

/// Steele, Lea & Flood's SplitMix64 (2014).
pub(crate) struct Random(u64);

impl Random {
    /// The numbers of one case: they stay the same when others come or go.
    pub(crate) fn of(case: &str) -> Self {
        // Fowler, Noll & Vo's hash.
        Random(case.bytes().fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(b)).wrapping_mul(0x100_0000_01b3)))
    }

    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// A number in [lo, hi).
    pub(crate) fn within(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * ((self.next() >> 11) as f64 / (1_u64 << 53) as f64)
    }

    pub(crate) fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    /// A point of the cube [−half, half]³.
    pub(crate) fn point(&mut self, half: f64) -> DVec3 {
        DVec3::from([(); 3].map(|()| self.within(-half, half)))
    }

    /// A unit vector.
    pub(crate) fn direction(&mut self) -> DVec3 {
        loop {
            let p = self.point(1.0);
            if (0.01..1.0).contains(&p.length_squared()) {
                return p.normalize();
            }
        }
    }

    pub(crate) fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            items.swap(i, self.below(i + 1));
        }
    }
}

/// Makes a mesh.
pub(crate) type MakeMesh = fn() -> Mesh;

/// Meshes within [−1.3, 1.3]³, of some hundred to some thousand tetrahedra each.
pub(crate) const MESHES: &[(&str, MakeMesh)] = &[
    ("tetrahedra", || generate::tetrahedra(5)),
    ("hexahedra", || generate::hexahedra(5)),
    ("wedges", || generate::wedges(5)),
    ("pyramids", || generate::pyramids(4)),
    ("mixed", || generate::mixed(5)),
    ("islands", || generate::islands(9)),
    ("unwelded", || generate::unwelded(&generate::mixed(4))),
    ("t-junction", || generate::t_junction(2)),
    ("ring", || generate::ring(7)),
    ("demo", || generate::demo(4)),
];

/// A field to make up: its association, number of components, and whether some values are missing.
#[derive(Clone, Copy)]
pub(crate) struct Lot {
    pub(crate) name: &'static str,
    pub(crate) association: Association,
    pub(crate) components: usize,
    pub(crate) missing: bool,
}

pub(crate) const FIELDS: &[Lot] = &[
    Lot { name: "points", association: Point, components: 1, missing: false },
    Lot { name: "cells", association: Cell, components: 1, missing: false },
    Lot { name: "pair", association: Point, components: 2, missing: false },
    Lot { name: "rgba", association: Point, components: 4, missing: false },
    Lot { name: "missing", association: Point, components: 1, missing: true },
    Lot { name: "missing pair", association: Point, components: 2, missing: true },
    Lot { name: "cell rgba", association: Cell, components: 4, missing: true },
];

impl Lot {
    /// An array of smooth values, which jump from cell to cell if each cell has points of its own.
    pub(crate) fn array(&self, mesh: &Mesh, random: &mut Random) -> Array {
        let (points, cells) = (mesh.points(), mesh.cells());
        let centre = |c: usize| {
            let ids = cells.points(c);
            ids.iter().map(|&p| points[p as usize]).sum::<DVec3>() / ids.len() as f64
        };
        let mut places: Vec<(DVec3, f64)> = match self.association {
            Cell => (0..cells.len()).map(|c| (centre(c), 0.0)).collect(),
            Point => points.iter().map(|&p| (p, 0.0)).collect(),
        };
        if self.association == Point && points.len() == cells.connectivity.len() {
            for c in 0..cells.len() {
                let jump = random.within(-0.4, 0.4);
                cells.points(c).iter().for_each(|&p| places[p as usize].1 = jump);
            }
        }
        let waves: Vec<DVec3> = (0..self.components).map(|_| random.direction() * random.within(1.0, 4.0)).collect();
        let mut values = Vec::new();
        for (place, jump) in places {
            for (k, wave) in waves.iter().enumerate() {
                // In [0, 1], as the colours of RGBA are; what drives the opacity lies elsewhere.
                let v = 0.5 + 0.5 * ((wave.dot(place) + k as f64).sin() + jump) / 1.4;
                let v = if k == self.components - 1 { 1000.0 + 40.0 * v } else { v };
                values.push(match random.below(150) {
                    0..3 if self.missing => f64::NAN,
                    3 if self.missing => f64::INFINITY,
                    _ => v,
                });
            }
        }
        Array { name: self.name.into(), components: self.components, values: Values::F64(values) }
    }
}

/// Where the knots of a function are, as shares of the range, and how high.
#[derive(Clone, Copy)]
pub(crate) enum Shape {
    Ramp,
    Peak,
    Steps,
    Knots(usize),
    /// Up to 1 and beyond.
    Wall,
}

impl Shape {
    fn knots(self, random: &mut Random) -> Vec<(f64, f64)> {
        let mut at = |n: usize| {
            let mut at: Vec<f64> = (0..n).map(|_| random.within(0.0, 1.0)).collect();
            at.sort_by(f64::total_cmp);
            at
        };
        match self {
            Shape::Ramp => vec![(0.0, 0.0), (1.0, 1.0)],
            Shape::Peak => {
                let s = at(1)[0];
                vec![(s - 0.02, 0.0), (s, 1.0), (s + 0.03, 0.0)]
            }
            Shape::Steps => {
                let [s, h] = [at(4), at(8)];
                (0..8).map(|i| (s[i / 2], h[(5 * i) % 8])).collect()
            }
            // Never close to one another: in a steep function any value that is rounded to f32 is wrong.
            Shape::Knots(n) => {
                (0..n).map(|i| ((i as f64 + random.within(0.25, 0.75)) / n as f64, random.within(0.0, 1.0))).collect()
            }
            Shape::Wall => vec![(0.0, 0.0), (0.5, 0.4), (0.7, 1.0), (0.75, 1.3), (0.8, 0.2), (1.0, 0.1)],
        }
    }
}

/// A transfer function to make up.
#[derive(Clone, Copy)]
pub(crate) struct Look {
    pub(crate) name: &'static str,
    pub(crate) shape: Shape,
    /// The greatest opacity.
    pub(crate) peak: f64,
    pub(crate) convention: Convention,
    pub(crate) emission: Emission,
    pub(crate) clamp: bool,
}

/// An even glow in the classic optical model.
const PLAIN: Look = Look {
    name: "ramp",
    shape: Shape::Ramp,
    peak: 1.0,
    convention: Convention::Extinction,
    emission: Emission::Chromatic,
    clamp: true,
};
const DIRECT: Emission = Emission::Direct { scale: 0.4 };

pub(crate) const LOOKS: &[Look] = &[
    PLAIN,
    Look { name: "peak", shape: Shape::Peak, peak: 30.0, ..PLAIN },
    Look { name: "steps", shape: Shape::Steps, peak: 2.0, ..PLAIN },
    Look { name: "many knots", shape: Shape::Knots(60), peak: 3.0, ..PLAIN },
    Look { name: "dense", shape: Shape::Knots(6), peak: 1e4, ..PLAIN },
    Look { name: "opacity", shape: Shape::Knots(5), peak: 0.97, convention: Convention::Opacity, ..PLAIN },
    Look { name: "wall", shape: Shape::Wall, convention: Convention::Opacity, ..PLAIN },
    Look { name: "stepped wall", shape: Shape::Steps, peak: 1.3, convention: Convention::Opacity, ..PLAIN },
    Look { name: "direct", shape: Shape::Knots(5), emission: DIRECT, ..PLAIN },
    Look { name: "direct wall", shape: Shape::Wall, convention: Convention::Opacity, emission: DIRECT, ..PLAIN },
    Look { name: "unclamped", shape: Shape::Knots(5), clamp: false, ..PLAIN },
    Look { name: "unclamped direct", shape: Shape::Steps, emission: DIRECT, clamp: false, ..PLAIN },
];

impl Look {
    /// How far an engine that keeps values in f32 may be from the truth: some dozens of segments are summed, and knots
    /// are rounded by 6e-8 of the range.
    pub(crate) fn bound(&self, blend: Blend) -> f64 {
        // −ln(1 − a) is infinitely steep at 1: what a scalar is rounded by there is seen all along a cell.
        let logarithm = self.convention == Convention::Opacity && self.peak >= 1.0;
        // One value makes the pixel, and a peak rises by 750 for each half of the range.
        let slope = blend == Blend::Maximum && matches!(self.shape, Shape::Peak);
        if logarithm || slope { 5e-5 } else { 1e-5 }
    }

    /// The function for `field`, in lengths where the mesh is about 2 wide.
    pub(crate) fn transfer(&self, field: &Field, random: &mut Random) -> TransferFunction {
        let over = |k: usize, share: f64| field.range(k)[0] + (field.range(k)[1] - field.range(k)[0]) * share;
        let last = field.kind().components() - 1;
        let opacity = self.shape.knots(random).into_iter().map(|(s, a)| (over(last, s), a * self.peak)).collect();
        let mut color = Vec::new();
        for (s, _) in if matches!(self.shape, Shape::Steps) { self.shape } else { Shape::Knots(4) }.knots(random) {
            color.push((over(0, s), [(); 3].map(|()| random.within(0.0, 1.0))));
        }
        let transfer = TransferFunction::new(color, opacity, 0.7).unwrap();
        transfer.with_convention(self.convention).with_clamp(self.clamp).with_emission(self.emission).unwrap()
    }
}

/// Makes a view of [−1, 1]³.
pub(crate) type MakeView = fn(&mut Random) -> View;

/// No multiple of the engine's tiles, and not square.
pub(crate) const SIZE: [u32; 2] = [37, 29];

/// From outside and inside, near and far; what limits the rays; both blendings.
pub(crate) const VIEWS: &[(&str, MakeView)] = &[
    ("perspective", |r| perspective(r, 4.0, 30.0)),
    ("parallel", |r| parallel(r, 4.0)),
    ("close", |r| perspective(r, 1.9, 110.0)),
    ("inside", |r| perspective(r, 0.5, 100.0)),
    ("inside parallel", |r| parallel(r, 0.3)),
    ("very far", |r| perspective(r, 1e5, 0.001)),
    ("by a face", |r| {
        let at = dvec3(1.0 + [-1e-9, 1e-9, 1e-4, -1e-4][r.below(4)], r.within(-0.8, 0.8), r.within(-0.4, 0.4));
        camera(at, r.point(0.5), r.direction(), Projection::Perspective { view_angle: 100.0 })
    }),
    ("clipped", |r| {
        let planes = (0..3).map(|_| ClippingPlane { origin: r.point(0.4), normal: r.direction() * 3.0 }).collect();
        let view = perspective(r, 3.0, 40.0).with_clipping_range([2.3, r.within(2.8, 4.0)]).unwrap();
        view.with_clipping_planes(planes).unwrap()
    }),
    ("clipped parallel", |r| parallel(r, 0.5).with_clipping_range([-0.2, 0.6]).unwrap()),
    ("window depth", |r| {
        let near_far = [1.5, 6.0];
        perspective(r, 3.0, 40.0)
            .with_clipping_range(near_far)
            .unwrap()
            .with_depth(depths(r, DepthKind::Window))
            .unwrap()
    }),
    ("window depth parallel", |r| {
        let near_far = [0.5, 4.5];
        parallel(r, 3.0).with_clipping_range(near_far).unwrap().with_depth(depths(r, DepthKind::Window)).unwrap()
    }),
    ("eye depth", |r| perspective(r, 3.0, 40.0).with_depth(depths(r, DepthKind::Eye)).unwrap()),
    ("ray depth", |r| perspective(r, 3.0, 60.0).with_depth(depths(r, DepthKind::Ray)).unwrap()),
    ("pixel offset", |r| perspective(r, 4.0, 30.0).with_pixel_offset(dvec2(0.4, -0.3))),
    ("wide offset", |r| perspective(r, 4.0, 30.0).with_pixel_offset(DVec2::splat(3.0))),
    ("maximum", |r| perspective(r, 4.0, 30.0).with_blend(Blend::Maximum)),
    ("maximum behind depth", |r| {
        parallel(r, 3.0).with_depth(depths(r, DepthKind::Eye)).unwrap().with_blend(Blend::Maximum)
    }),
];

pub(crate) fn camera(position: DVec3, focal_point: DVec3, view_up: DVec3, projection: Projection) -> View {
    View::new(Camera { position, focal_point, view_up, projection }, SIZE).unwrap()
}

/// From `distance` off the middle.
fn perspective(random: &mut Random, distance: f64, view_angle: f64) -> View {
    let (at, towards, up) = (random.direction() * distance, random.point(0.2), random.direction());
    camera(at, towards, up, Projection::Perspective { view_angle })
}

fn parallel(random: &mut Random, distance: f64) -> View {
    let (at, towards, up) = (random.direction() * distance, random.point(0.2), random.direction());
    camera(at, towards, up, Projection::Parallel { parallel_scale: random.within(0.3, 1.6) })
}

/// A depth for each pixel, most of them within the mesh as seen from a distance of 3; some are infinite or NaN.
fn depths(random: &mut Random, kind: DepthKind) -> DepthBuffer {
    let value = |_| match random.below(20) {
        0 => f64::INFINITY,
        1 => f64::NAN,
        _ if kind == DepthKind::Window => random.within(0.3, 0.95),
        _ => random.within(2.0, 4.0),
    };
    DepthBuffer { kind, values: (0..SIZE[0] * SIZE[1]).map(value).collect() }
}

/// A scene for each mesh and three views of it; another `seed` gives others.
pub(crate) fn scenes(seed: usize) -> impl Iterator<Item = (String, Scene, Vec<View>)> {
    MESHES.iter().enumerate().map(move |(m, (name, mesh))| {
        let (look, lot) = (&LOOKS[(m + 5 * seed) % LOOKS.len()], &FIELDS[(m + 3 * seed) % FIELDS.len()]);
        let case = format!("{name}, {}, {}, {seed}", look.name, lot.name);
        let mut random = Random::of(&case);
        let scene = scene(&mesh(), lot, look, &mut random);
        let views = [0, 1, 2].map(|v| VIEWS[(m + 4 * seed + 6 * v) % VIEWS.len()].1(&mut random)).to_vec();
        (case, scene, views)
    })
}

/// A field and a transfer function for `mesh`.
pub(crate) fn scene(mesh: &Mesh, lot: &Lot, look: &Look, random: &mut Random) -> Scene {
    let array = lot.array(mesh, random);
    Scene::new(mesh, array, lot.association, |field| look.transfer(field, random))
}

/// A copy of `mesh` with other points; the arrays stay.
pub(crate) fn moved(mesh: &Mesh, to: impl Fn(DVec3) -> DVec3) -> Mesh {
    let points = mesh.points().iter().map(|&p| to(p)).collect();
    Mesh::new(points, mesh.cells().clone(), mesh.point_arrays().to_vec(), mesh.cell_arrays().to_vec()).unwrap()
}

/// A mesh of cells, each a VTK type and its points, without arrays.
pub(crate) fn mesh_of<'a>(points: Vec<DVec3>, cells: impl IntoIterator<Item = (u8, &'a [u32])>) -> Mesh {
    let mut all = Cells { offsets: vec![0], ..Cells::default() };
    for (vtk_type, ids) in cells {
        all.types.push(vtk_type);
        all.connectivity.extend(ids);
        all.offsets.push(all.connectivity.len() as u64);
    }
    Mesh::new(points, all, vec![], vec![]).unwrap()
}
