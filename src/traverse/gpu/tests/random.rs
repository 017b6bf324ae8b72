//! Functions, views and meshes that nobody chose.

pub(super) use crate::mesh::generate::Random;
use crate::mesh::{Array, Mesh, Values, generate};
use crate::transfer::{Convention, Emission, TransferFunction};
use crate::view::{Camera, ClippingPlane, DepthBuffer, DepthKind, Projection, View};
use glam::DVec3;

impl Random {
    pub(super) fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(super) fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub(super) fn direction(&mut self) -> DVec3 {
        loop {
            let v = DVec3::from([(); 3].map(|()| self.within(-1.0, 1.0)));
            if v.length() > 0.1 && v.length() < 1.0 {
                return v.normalize();
            }
        }
    }
}

pub(super) fn random_transfer(random: &mut Random, direct: bool) -> TransferFunction {
    // Ramps no steeper than values of 32 bits can tell.
    let mut places = |n: usize| {
        let mut places: Vec<f64> = (0..n).map(|_| random.within(-1.1, 1.1)).collect();
        places.sort_by(f64::total_cmp);
        places.into_iter().enumerate().map(|(i, s)| s + 0.02 * i as f64).collect::<Vec<f64>>()
    };
    let (colors, opacities) = (places(5), places(6));
    let color = colors.into_iter().map(|s| (s, [random.unit(), random.unit(), random.unit()])).collect();
    let mut opacity: Vec<_> = opacities.into_iter().map(|s| (s, (random.unit() * 1.5 - 0.5).max(0.0))).collect();
    // A step.
    opacity[3].0 = opacity[2].0;
    let convention = if random.below(2) == 0 { Convention::Extinction } else { Convention::Opacity };
    let emission = if direct { Emission::Direct { scale: random.within(0.2, 2.0) } } else { Emission::Chromatic };
    let distance = 10f64.powf(random.within(-1.5, 0.3));
    TransferFunction::new(color, opacity, distance)
        .unwrap()
        .with_convention(convention)
        .with_clamp(random.below(4) > 0)
        .with_emission(emission)
        .unwrap()
}

pub(super) fn random_view(random: &mut Random, size: [u32; 2]) -> View {
    let focal_point = random.direction() * 0.3;
    let distance = [0.2, 1.5, 4.0, 6.0, 40.0][random.below(5)];
    let mut away = random.direction();
    if random.below(4) == 0 {
        // Along an axis, so that faces are seen edge-on.
        away = [DVec3::X, DVec3::NEG_Y, DVec3::Z][random.below(3)];
    }
    let projection = if random.below(3) == 0 {
        Projection::Parallel { parallel_scale: random.within(0.5, 2.0) }
    } else {
        let fit = 2.0 * (1.8f64 / distance).atan().to_degrees();
        Projection::Perspective { view_angle: fit.min(random.within(60.0, 110.0)) }
    };
    let camera =
        Camera { position: focal_point + away * distance, focal_point, view_up: random.direction(), projection };
    let mut view = View::new(camera, size).unwrap();
    if random.below(4) == 0 {
        view = view.with_clipping_range([distance * 0.8, distance * 1.1]).unwrap();
    }
    if random.below(4) == 0 {
        let plane = ClippingPlane { origin: random.direction() * 0.4, normal: random.direction() * 3.0 };
        view = view.with_clipping_planes(vec![plane]).unwrap();
    }
    if random.below(4) == 0 {
        let pixels = size[0] as usize * size[1] as usize;
        let kind = [DepthKind::Eye, DepthKind::Ray, DepthKind::Window][random.below(3)];
        let mut far = 1.0;
        if kind == DepthKind::Window {
            view = view.with_clipping_range([distance * 0.6, distance * 1.2]).unwrap();
        } else {
            far = distance + 0.5;
        }
        let values = (0..pixels).map(|_| far * random.within(0.5, 1.2)).collect();
        view = view.with_depth(DepthBuffer { kind, values }).unwrap();
    }
    view
}

/// `mesh` with arrays "scalar", "pair" and "rgba" at its points and cells; `change` may change the i-th value at
/// points.
fn with_arrays(mesh: Mesh, change: impl Fn(usize, usize, f64) -> f64) -> Mesh {
    let fields = |p: DVec3| {
        let (x, y, z) = (p.x, p.y, p.z);
        [0.5 + 0.5 * (3.0 * x).sin(), 0.5 + 0.5 * (2.0 * y).cos(), 0.5 + 0.4 * z, (4.0 * x * y).sin()]
    };
    let array = |(name, n): (&str, usize), places: &[DVec3], change: &dyn Fn(usize, usize, f64) -> f64| {
        let values = places.iter().flat_map(|&p| fields(p).into_iter().skip(4 - n));
        let values = values.enumerate().map(|(i, v)| change(i, n, v)).collect();
        Array { name: name.into(), components: n, values: Values::F64(values) }
    };
    let (points, cells) = (mesh.points().to_vec(), mesh.cells().clone());
    let firsts: Vec<DVec3> = (0..cells.len()).map(|c| points[cells.points(c)[0] as usize]).collect();
    let names = [("scalar", 1), ("pair", 2), ("rgba", 4)];
    let at_points = names.map(|n| array(n, &points, &change)).to_vec();
    let at_cells = names.map(|n| array(n, &firsts, &|_, _, v| v)).to_vec();
    Mesh::new(points, cells, at_points, at_cells).unwrap()
}

pub(super) fn plain(mesh: Mesh) -> Mesh {
    with_arrays(mesh, |_, _, v| v)
}

/// One of each kind, of random size, bent at random: points of one place stay together.
pub(super) fn meshes(random: &mut Random) -> Vec<(&'static str, Mesh)> {
    let mut size = |least: usize, most: usize| least + random.below(most + 1 - least);
    let tetrahedra = generate::tetrahedra(size(4, 10));
    let hexahedra = generate::hexahedra(size(3, 7));
    let islands = generate::islands(size(9, 14));
    let parts = generate::unwelded(&generate::tetrahedra(size(3, 6)));
    let junction = generate::t_junction(size(2, 3));
    let ring = generate::ring(size(3, 11));
    let demo = generate::demo(size(4, 6));
    let holed = generate::hexahedra(size(4, 6));
    let [wave, phase] = [(); 2].map(|()| random.direction() * 3.0);
    let bend = random.direction() * random.within(0.0, 0.1);
    let bent = |mesh: Mesh| {
        let points = mesh.points().iter().map(|&p| p + bend * (wave.dot(p) + phase.x).sin()).collect();
        Mesh::new(points, mesh.cells().clone(), mesh.point_arrays().to_vec(), mesh.cell_arrays().to_vec()).unwrap()
    };
    vec![
        ("tetrahedra", plain(bent(tetrahedra))),
        ("hexahedra", plain(bent(hexahedra))),
        ("islands", plain(bent(islands))),
        ("unwelded", with_arrays(bent(parts), |i, n, v| v + 0.05 * ((i / (4 * n)) % 3) as f64)),
        ("t_junction", plain(bent(junction))),
        ("ring", plain(bent(ring))),
        ("demo", plain(bent(demo))),
        ("invalid values", with_arrays(bent(holed), |i, _, v| if i % 37 == 0 { f64::NAN } else { v })),
    ]
}
