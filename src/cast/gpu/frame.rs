//! What a frame of a grid tells `shaders/cast.wgsl` of its view: rays in voxels, or along uneven axes.

use crate::cast::Volume;
use crate::cast::volume::BLOCK;
#[cfg(test)]
use crate::gpu::offsets;
use crate::gpu::rays::{self, FAR};
use crate::integral::lines::Map;
use crate::view::{ClippingPlane, Fan, View};
use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DVec3};

/// Up to this distance from the grid's centre, in normalised units, rays start at the eye.
const NEAR_EYE: f64 = 2.0;

/// How far rays may move across an axis, in the least width of a voxel, and yet count as being between two planes.
const STILL: f64 = 1e-8;

/// Voxels that places along a ray are from their base at most, and the same in units of t.
const REACH: [f64; 2] = [8.0, 2.0 / 1024.0];

/// Voxels in a unit of t from which on places are known too badly: bases of rays are 1/1024 apart.
pub(super) const FINEST: f64 = 1e6;

/// `CastUniforms` in the shader.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct CastUniforms {
    origin: [[[f32; 4]; 2]; 3],
    direction: [[[f32; 4]; 2]; 3],
    along: [[f32; 4]; 3],
    maps: [[f32; 4]; 4],
    still: [f32; 3],
    reach: f32,
    cells: [u32; 3],
    planes: u32,
    axes: [u32; 3],
    has_ends: u32,
    strides: [u32; 4],
    size: [u32; 2],
    pub(super) first_row: u32,
    pub(super) rows: u32,
    near: [f32; 2],
    far: [f32; 2],
    pub(super) most_work: u32,
    pub(super) pace: f32,
    pub(super) missing: f32,
    pub(super) skips: u32,
}

/// Coordinates of rays: along each axis those of the grid, times the first, plus the second.
struct Coordinates {
    times: DVec3,
    plus: DVec3,
    /// Units of them in the least width of a voxel, along each axis.
    least: DVec3,
}

impl Coordinates {
    fn new(volume: &Volume) -> Self {
        let axes = &volume.axes;
        let of = |f: &dyn Fn(usize) -> f64| DVec3::new(f(0), f(1), f(2));
        if volume.even {
            let per = of(&|a| volume.cells[a] as f64 / (axes[a][volume.cells[a]] - axes[a][0]));
            return Coordinates { times: per, plus: of(&|a| -axes[a][0] * per[a]), least: DVec3::ONE };
        }
        let least = of(&|a| 1.0 / volume.inverse[a].iter().fold(0.0, |most: f64, i| most.max(*i)));
        Coordinates { times: DVec3::splat(volume.scale), plus: DVec3::ZERO, least: least * volume.scale }
    }
}

/// Where planes of uneven axes are, as sums of two, one axis behind another.
pub(super) fn planes_of(volume: &Volume) -> Vec<[f32; 2]> {
    if volume.even {
        return vec![];
    }
    let halves = |c: &f64| {
        let high = (c * volume.scale) as f32;
        [high, (c * volume.scale - f64::from(high)) as f32]
    };
    volume.axes.iter().flatten().map(halves).collect()
}

/// Voxels in a unit of t at most.
pub(super) fn fineness(volume: &Volume) -> f64 {
    let Coordinates { times, least, .. } = Coordinates::new(volume);
    // How far a direction of length 1 may lead along an axis of the grid.
    let row = |a: usize| volume.to_axes.row(a).length() / volume.scale * times[a] / least[a];
    row(0).max(row(1)).max(row(2))
}

/// What a frame tells, the clipping planes, and where rays end.
pub(super) fn uniforms(
    volume: &Volume,
    view: &View,
    of_cells: bool,
    maps: &[Map; 4],
) -> (CastUniforms, Vec<[f32; 4]>, Vec<f32>) {
    let Coordinates { times, plus, least } = Coordinates::new(volume);
    let size = view.size();
    let fan = view.fan(volume.centre, volume.scale, NEAR_EYE);
    let turned = |v: DVec3| volume.to_axes * (v / volume.scale) * times;
    let mut origin = fan.by_pixel(fan.origin, size).map(turned);
    origin[0] += plus;
    let along = fan.by_pixel(fan.direction, size);
    let planes = clipping(volume, view, times, plus);
    let ends = rays::ends(view, &fan, volume.scale, true);
    let halves = |t: f64| {
        let high = rays::limit(t);
        let low = if high.abs() < FAR { (t - f64::from(high)) as f32 } else { 0.0 };
        [high, low]
    };
    let points = volume.cells.map(|n| n as u32 + u32::from(!of_cells));
    let blocks = volume.cells.map(|n| n.div_ceil(1 << BLOCK) as u32);
    let lengths = volume.axes.each_ref().map(|axis| axis.len() as u32);
    let (Fan { near, far, .. }, finest) = (fan, fineness(volume));
    let frame = CastUniforms {
        origin: rays::affine(origin),
        direction: rays::affine(along.map(turned)),
        along: along.map(|v| v.extend(0.0).as_vec4().to_array()),
        maps: maps.map(|m| [m.mid as f32, m.factor as f32, 0.0, 0.0]),
        still: (least * STILL).as_vec3().to_array(),
        reach: (REACH[0] / finest).max(REACH[1]) as f32,
        cells: volume.cells.map(|n| n as u32),
        planes: planes.len() as u32,
        axes: [0, lengths[0], lengths[0] + lengths[1]],
        has_ends: u32::from(!ends.is_empty()),
        strides: [points[0], points[0] * points[1], blocks[0], blocks[0] * blocks[1]],
        size,
        first_row: 0,
        rows: 0,
        near: halves(near),
        far: halves(far),
        most_work: u32::MAX,
        pace: 0.0,
        missing: 0.0,
        skips: 0,
    };
    (frame, planes, ends)
}

/// Clipping planes: dot(p, plane.xyz) + plane.w ≥ 0 is kept of what is at `p`.
fn clipping(volume: &Volume, view: &View, times: DVec3, plus: DVec3) -> Vec<[f32; 4]> {
    let to_world: DMat3 = volume.to_axes.inverse();
    let plane = |p: &ClippingPlane| {
        let normal = (p.normal / p.normal.abs().max_element()).normalize();
        let across = to_world.transpose() * normal * volume.scale / times;
        let height = normal.dot(volume.centre - p.origin) * volume.scale - across.dot(plus);
        across.extend(height).as_vec4().to_array()
    };
    view.clipping_planes().iter().map(plane).collect()
}

/// Where fields of [`CastUniforms`] are.
#[cfg(test)]
pub(super) const OFFSETS: &[(&str, usize)] = &offsets!(
    CastUniforms: origin, direction, along, maps, still, reach, cells, planes, axes, has_ends, strides, size, first_row, rows,
    near, far, most_work, pace, missing, skips
);
