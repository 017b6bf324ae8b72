//! What a frame's shaders need to know of a view and a transfer function.

use crate::geometry::TetMesh;
use crate::gpu::rays::{self, FAR};
use crate::view::View;
use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DVec3};

/// Up to this distance from the mesh's centre, in normalised units, rays start at the eye.
const NEAR_EYE: f64 = 2.0;

/// How much an outline is grown, in pixels: rasterisers round corners to this.
pub(super) const GROWTH: f32 = 1.0 / 256.0;

/// Cells that reach nearer to the plane through the eye of a perspective view than this, in normalised units, are
/// special.
const NEAREST: f64 = 1e-4;

/// `ViewUniforms` in the shaders.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct ViewUniforms {
    base: [f32; 4],
    base_low: [f32; 4],
    across: [[f32; 4]; 2],
    forward: [f32; 4],
    origin: [[f32; 4]; 2],
    direction: [[f32; 4]; 3],
    starts: [[[f32; 4]; 2]; 3],
    ways: [[[f32; 4]; 2]; 3],
    pub(super) size: [f32; 2],
    pub(super) offset: [f32; 2],
    pub(super) near: f32,
    pub(super) far: f32,
    pub(super) nearest: f32,
    planes: u32,
    pixel: [f32; 2],
    unused: [f32; 2],
}

/// A view as the shaders see it.
pub(super) struct SeenView {
    pub(super) frame: ViewUniforms,
    pub(super) perspective: bool,
    /// The eye of a perspective view in normalised coordinates, and the direction of the view.
    pub(super) eye: Option<DVec3>,
    pub(super) direction: DVec3,
    pub(super) planes: Vec<[f32; 4]>,
    /// Where a depth buffer ends each pixel's ray; empty without one.
    pub(super) ends: Vec<f32>,
}

/// What there is of the limits of rays, and of shortcuts: shaders are compiled without the others.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Limits {
    pub(super) ends: bool,
    pub(super) planes: bool,
    /// By a clipping range.
    pub(super) range: bool,
    /// Whether rays meet at the eye.
    pub(super) perspective: bool,
    /// One pair of a table's planes serves all fragments of a cell.
    pub(super) plane_per_cell: bool,
}

impl Limits {
    /// Whether anything ends rays.
    pub(super) fn any(&self) -> bool {
        self.ends || self.planes || self.range
    }
}

impl SeenView {
    pub(super) fn limits(&self) -> Limits {
        let frame = &self.frame;
        // In perspective views the eye is a limit anyway.
        let near = if self.perspective { -frame.forward[3] } else { -FAR };
        Limits {
            ends: !self.ends.is_empty(),
            planes: !self.planes.is_empty(),
            range: frame.near > near || frame.far < FAR,
            perspective: self.perspective,
            plane_per_cell: false,
        }
    }

    pub(super) fn new(geometry: &TetMesh, view: &View) -> Self {
        let fan = view.fan(geometry.centre, geometry.scale, NEAR_EYE);
        let base = fan.origin[0];
        let four = |v: DVec3, w: f64| v.extend(w).as_vec4().to_array();
        let high = base.as_vec3().as_dvec3();
        let perspective = view.eye().is_some();
        // What the image spans at depth 1 (perspective) or at any (parallel).
        let spans = if perspective { [fan.direction[1], fan.direction[2]] } else { [fan.origin[1], fan.origin[2]] };
        let inverse = DMat3::from_cols(spans[0], spans[1], fan.direction[0]).inverse();
        let planes = rays::planes(view, geometry, base);
        let ends = rays::ends(view, &fan, geometry.scale, false);
        let frame = ViewUniforms {
            base: four(high, 0.0),
            base_low: four(base - high, 0.0),
            across: [0, 1].map(|k| four(inverse.row(k), 0.0)),
            forward: four(inverse.row(2), if perspective { fan.ahead } else { 0.0 }),
            origin: [fan.origin[1], fan.origin[2]].map(|v| four(v, 0.0)),
            direction: fan.direction.map(|v| four(v, 0.0)),
            starts: rays::affine(fan.by_pixel(fan.origin, view.size())),
            ways: rays::affine(fan.by_pixel(fan.direction, view.size())),
            size: view.size().map(|n| n as f32),
            offset: fan.offset.as_vec2().to_array(),
            near: rays::limit(fan.near),
            far: rays::limit(fan.far),
            nearest: if perspective { (fan.near + fan.ahead).max(NEAREST) as f32 } else { 0.0 },
            planes: planes.len() as u32,
            unused: [0.0; 2],
            pixel: [2.0 / view.size()[0] as f32, -2.0 / view.size()[1] as f32],
        };
        let eye = view.eye().map(|eye| (eye - geometry.centre) * geometry.scale);
        SeenView { frame, perspective, eye, direction: view.forward(), planes, ends }
    }
}
