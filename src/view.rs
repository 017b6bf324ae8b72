//! The view: camera, image size, and what limits each ray: clipping range, clipping planes, a depth buffer.

mod cropping;
mod framing;

pub use cropping::{Cropping, REGIONS};
pub(crate) use framing::hull_area;

use crate::error::{Error, Result};
use glam::{DMat3, DMat4, DVec2, DVec3};

/// How the camera maps the world to the image plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// Rays start at the camera's position and fan out.
    Perspective {
        /// The vertical angle of view, in degrees, in (0, 180).
        view_angle: f64,
    },
    /// Rays are parallel.
    Parallel {
        /// Half the height of the view, in world units.
        parallel_scale: f64,
    },
}

/// VTK's camera, in world coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Where the camera is.
    pub position: DVec3,
    /// The point in the middle of the image.
    pub focal_point: DVec3,
    /// A direction that points up in the image; need not be perpendicular to the view.
    pub view_up: DVec3,
    /// Perspective or parallel.
    pub projection: Projection,
}

/// A plane that keeps the half space `(x − origin) · normal ≥ 0`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClippingPlane {
    /// A point of the plane, in world coordinates.
    pub origin: DVec3,
    /// The normal, of any length but 0; it points into what is kept.
    pub normal: DVec3,
}

/// What the numbers of a depth buffer are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DepthKind {
    /// OpenGL's window z, in [0, 1], with the view's clipping range.
    Window,
    /// Distance from the camera along the view direction, in world units.
    Eye,
    /// Distance along the ray, from the camera (perspective) or the plane through it (parallel), in world units.
    Ray,
}

/// A depth for each pixel, at which its ray ends.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthBuffer {
    /// What the values are.
    pub kind: DepthKind,
    /// One value per pixel, row by row, row 0 at the top; infinite where nothing ends the ray.
    pub values: Vec<f64>,
}

/// How what lies along a ray becomes one pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Blend {
    /// Emission and absorption, integrated.
    #[default]
    Composite,
    /// The colour and opacity of the largest value along the ray (of the last component, if there are several).
    Maximum,
}

/// One pixel's ray `origin + t direction`, and the part of it that is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where t is 0, in world coordinates.
    pub origin: DVec3,
    /// A unit vector.
    pub direction: DVec3,
    /// Where the ray starts; may be −∞.
    pub t_min: f64,
    /// Where it ends; may be ∞, and nothing is seen where it is not above `t_min`.
    pub t_max: f64,
}

/// All rays of a view in one affine form, in normalised coordinates: at (x, y), each in [−1, 1] across the image, a ray
/// starts at origin · (1, x, y) and runs along direction · (1, x, y), which is not of unit length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fan {
    /// Where rays start: for the middle of the image, and per x and y.
    pub origin: [DVec3; 3],
    /// Where they run: any of them advances by 1 along the view direction.
    pub direction: [DVec3; 3],
    /// From the camera to where the rays start, along the view direction.
    pub ahead: f64,
    /// Where what is seen of a ray starts, in lengths of its direction from its origin; may be −∞.
    pub near: f64,
    /// Where it ends; may be ∞. Clipping planes and depths are not in it.
    pub far: f64,
    /// Where in a pixel its ray passes, in x and y from its centre.
    pub offset: DVec2,
}

impl Fan {
    /// `v`, one of the fan's two forms, per column and row of an image of `size` pixels: pixel (i, j) has v · (1, i,
    /// j).
    pub fn by_pixel(&self, v: [DVec3; 3], size: [u32; 2]) -> [DVec3; 3] {
        let [w, h] = size.map(f64::from);
        let first = v[0] + v[1] * (1.0 / w - 1.0 + self.offset.x) + v[2] * (1.0 - 1.0 / h + self.offset.y);
        [first, v[1] * (2.0 / w), v[2] * (-2.0 / h)]
    }
}

/// All rays of a camera, in world coordinates: at (x, y), each in [−1, 1] across the image and y up, a ray starts at
/// origin · (1, x, y) and runs along direction · (1, x, y), which advances by 1 along `forward`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Lens {
    origin: [DVec3; 3],
    direction: [DVec3; 3],
    /// The view direction, along which depths count from `origin`; a unit vector.
    forward: DVec3,
    /// Whether rays meet in `origin[0]`; they are parallel else.
    meet: bool,
    /// From `p − origin[0]` to (x, y, 1) times the depth, or (x, y, depth) if rays are parallel.
    inverse: DMat3,
}

/// What to draw: the camera, the size of the image and everything that limits the rays.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    camera: Option<Camera>,
    lens: Lens,
    size: [u32; 2],
    pixel_offset: DVec2,
    clipping_range: Option<[f64; 2]>,
    clipping_planes: Vec<ClippingPlane>,
    cropping: Option<Cropping>,
    depth: Option<DepthBuffer>,
    blend: Blend,
}

impl Lens {
    fn new(origin: [DVec3; 3], direction: [DVec3; 3], forward: DVec3, meet: bool) -> Option<Self> {
        let [x, y] = if meet { [direction[1], direction[2]] } else { [origin[1], origin[2]] };
        let across = DMat3::from_cols(x, y, direction[0]);
        let inverse = across.inverse();
        let usable = across.determinant() != 0.0 && inverse.is_finite() && origin[0].is_finite();
        usable.then_some(Lens { origin, direction, forward, meet, inverse })
    }

    /// The rays of a camera whose images are `aspect` times as wide as high.
    fn of_camera(camera: &Camera, [right, up, forward]: [DVec3; 3], aspect: f64) -> Option<Self> {
        let zero = DVec3::ZERO;
        let (origin, direction) = match camera.projection {
            Projection::Perspective { view_angle } => {
                let tan = (view_angle.to_radians() / 2.0).tan();
                ([camera.position, zero, zero], [forward, right * (tan * aspect), up * tan])
            }
            Projection::Parallel { parallel_scale: s } => {
                ([camera.position, right * (s * aspect), up * s], [forward, zero, zero])
            }
        };
        Self::new(origin, direction, forward, matches!(camera.projection, Projection::Perspective { .. }))
    }

    /// The rays of OpenGL's matrices, and the depths of their near and far planes; none if the matrices are singular,
    /// or the planes not parallel to each other and to the image.
    ///
    /// Rays follow from the rows of x, y and w alone, so that a far plane very far away costs no digits.
    fn of_matrices(view: DMat4, projection: DMat4) -> Option<(Self, [f64; 2])> {
        if view.row(3).to_array() != [0.0, 0.0, 0.0, 1.0] {
            return None;
        }
        let [x, y, z, w] = [0, 1, 2, 3].map(|k| projection.row(k));
        let meet = w.truncate() != DVec3::ZERO;
        let [x, y, z] = if meet { [x, y, z] } else { [x, y, z].map(|row| row / w.w) };
        // What depth is measured by: w, or z where that is constant.
        let along = if meet { w } else { z.truncate().try_normalize()?.extend(0.0) };
        let rows = DMat3::from_cols(x.truncate(), y.truncate(), along.truncate()).transpose();
        let [right, up, ahead] = rows.inverse().to_cols_array_2d().map(DVec3::from_array);
        let start = -(right * x.w + up * y.w + ahead * along.w);
        let (across, step) = if meet { ([right, up], ahead) } else { ([DVec3::ZERO; 2], ahead) };
        // z along a ray at depth t is a + b t, before it is divided by w = t where rays meet.
        let (a, b) = (z.truncate().dot(start) + z.w, z.truncate().dot(step));
        if across.iter().any(|d| z.truncate().dot(*d).abs() > 1e-9 * b.abs()) {
            return None;
        }
        let range = if meet { [-a / (1.0 + b), a / (1.0 - b)] } else { [(-1.0 - a) / b, (1.0 - a) / b] };
        // To the world, where lengths may be others.
        let to_world = view.inverse();
        let gradient = view.transpose().transform_vector3(along.truncate());
        let stretch = gradient.length();
        let [d0, d1, d2] = [step, across[0], across[1]].map(|d| to_world.transform_vector3(d) * stretch);
        let [o1, o2] = if meet { [DVec3::ZERO; 2] } else { [right, up].map(|d| to_world.transform_vector3(d)) };
        let origin = [to_world.transform_point3(start), o1, o2];
        let lens = Self::new(origin, [d0, d1, d2], gradient / stretch, meet)?;
        // An infinite far plane is what 1 − b = 0 means; rounding may make it negative.
        let far = if meet && range[1] < 0.0 { f64::INFINITY } else { range[1] };
        Some((lens, [range[0] / stretch, far / stretch]))
    }
}

impl View {
    /// A view of `size` (width, height) pixels.
    ///
    /// # Errors
    /// [`Error::View`] if the size is 0 or above 2²⁸ pixels, a camera parameter is not finite, the camera looks nowhere
    /// (position equals focal point, or view up lies along the view), or the angle or scale is out of range.
    pub fn new(camera: Camera, size: [u32; 2]) -> Result<Self> {
        let fail = |what: String| Err(Error::View(what));
        check_size(size)?;
        for (what, v) in
            [("position", camera.position), ("focal point", camera.focal_point), ("view up", camera.view_up)]
        {
            if !v.is_finite() {
                return fail(format!("the camera's {what} is {v}"));
            }
        }
        match camera.projection {
            Projection::Perspective { view_angle: a } if !(a > 0.0 && a < 180.0) => {
                return fail(format!("the view angle is {a} degrees: it lies between 0 and 180"));
            }
            Projection::Parallel { parallel_scale: s } if !(s > 0.0 && s.is_finite()) => {
                return fail(format!("the parallel scale is {s}: it is above 0"));
            }
            _ => {}
        }
        let Some(forward) = direction(camera.focal_point - camera.position) else {
            return fail("the camera's position and focal point are the same".into());
        };
        let Some(right) = direction(camera.view_up).and_then(|up| direction(forward.cross(up))) else {
            return fail("the view up vector is zero or lies along the view".into());
        };
        let axes = [right, right.cross(forward), forward];
        let Some(lens) = Lens::of_camera(&camera, axes, f64::from(size[0]) / f64::from(size[1])) else {
            return fail("the camera's numbers are too large or too small".into());
        };
        Ok(Self::through(lens, Some(camera), size))
    }

    /// A view of `size` (width, height) pixels as OpenGL's matrices have it: `view` from the world to the eye (affine),
    /// `projection` from there to clip coordinates. So cameras off the axis, of one eye of two, sheared or of one tile
    /// of an image can be had. Near and far plane become the clipping range.
    ///
    /// # Errors
    /// [`Error::View`] if the size is 0 or above 2²⁸ pixels, a matrix is singular or not finite, `view` is not affine,
    /// or the near and far planes do not ascend or are not parallel to the image.
    pub fn from_matrices(view: DMat4, projection: DMat4, size: [u32; 2]) -> Result<Self> {
        check_size(size)?;
        let fail = |what: &str| Err(Error::View(what.into()));
        if !(view.is_finite() && projection.is_finite()) {
            return fail("the camera's matrices are not finite");
        }
        match Lens::of_matrices(view, projection) {
            Some((lens, range)) => Self::through(lens, None, size).with_clipping_range(range),
            None => fail("the camera's matrices are singular, or their near and far planes not parallel to the image"),
        }
    }

    fn through(lens: Lens, camera: Option<Camera>, size: [u32; 2]) -> Self {
        View {
            camera,
            lens,
            size,
            pixel_offset: DVec2::ZERO,
            clipping_range: None,
            clipping_planes: Vec::new(),
            cropping: None,
            depth: None,
            blend: Blend::default(),
        }
    }

    /// Samples each pixel at this offset from its centre, in pixels (right, up).
    pub fn with_pixel_offset(mut self, offset: DVec2) -> Self {
        self.pixel_offset = offset;
        self
    }

    /// Keeps what lies between two distances from the camera along the view direction, in world units.
    ///
    /// # Errors
    /// [`Error::View`] if they do not ascend, or the near one is not above 0 in a perspective view.
    pub fn with_clipping_range(mut self, [near, far]: [f64; 2]) -> Result<Self> {
        if near.is_nan() || far.is_nan() || near >= far || (self.lens.meet && near <= 0.0) {
            return Err(Error::View(format!("the clipping range is {near} to {far}")));
        }
        self.clipping_range = Some([near, far]);
        Ok(self)
    }

    /// Keeps what all of `planes` keep.
    ///
    /// # Errors
    /// [`Error::View`] if a plane is not finite or its normal is zero.
    pub fn with_clipping_planes(mut self, planes: Vec<ClippingPlane>) -> Result<Self> {
        if let Some(p) = planes.iter().find(|p| !p.origin.is_finite() || direction(p.normal).is_none()) {
            return Err(Error::View(format!("the clipping plane at {} has the normal {}", p.origin, p.normal)));
        }
        self.clipping_planes = planes;
        Ok(self)
    }

    /// Ends each pixel's ray at a depth.
    ///
    /// # Errors
    /// [`Error::View`] if there is not one value for each pixel, or window depths come without a clipping range.
    pub fn with_depth(mut self, depth: DepthBuffer) -> Result<Self> {
        let [w, h] = self.size;
        if depth.values.len() != w as usize * h as usize {
            return Err(Error::View(format!("{} depths for an image of {w}x{h} pixels", depth.values.len())));
        }
        if depth.kind == DepthKind::Window && self.clipping_range.is_none_or(|r| !r[1].is_finite()) {
            return Err(Error::View("window depths mean nothing without a finite clipping range".into()));
        }
        self.depth = Some(depth);
        Ok(self)
    }

    /// Blends another way.
    pub fn with_blend(mut self, blend: Blend) -> Self {
        self.blend = blend;
        self
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The camera; none if matrices say where rays run.
    pub fn camera(&self) -> Option<&Camera> {
        self.camera.as_ref()
    }

    /// The point that all rays come from; none if they are parallel.
    pub fn eye(&self) -> Option<DVec3> {
        self.lens.meet.then_some(self.lens.origin[0])
    }

    /// The view direction, along which depths count; a unit vector.
    pub fn forward(&self) -> DVec3 {
        self.lens.forward
    }

    /// The blending.
    pub fn blend(&self) -> Blend {
        self.blend
    }

    /// The clipping planes.
    pub fn clipping_planes(&self) -> &[ClippingPlane] {
        &self.clipping_planes
    }

    /// Whether a depth buffer ends rays.
    pub fn has_depth(&self) -> bool {
        self.depth.is_some()
    }

    /// The sampling offset, in pixels.
    pub fn pixel_offset(&self) -> DVec2 {
        self.pixel_offset
    }

    /// Where the world point `p` is in the image, in pixels from its upper left corner; none if it is not in front of a
    /// perspective camera.
    pub fn pixel(&self, p: DVec3) -> Option<DVec2> {
        let [w, h] = self.size.map(f64::from);
        let from_camera = p - self.lens.origin[0];
        let at = self.lens.inverse * from_camera;
        let depth = match self.lens.meet {
            true if at.z <= 1e-6 * from_camera.length() => return None,
            true => at.z,
            false => 1.0,
        };
        Some(DVec2::new(0.5 * w * (1.0 + at.x / depth), 0.5 * h * (1.0 - at.y / depth)))
    }

    /// The ray through pixel coordinates `x` (from the left) and `y` (from the top), in pixels; the centre of the first
    /// pixel is at 0.5. Nothing but the camera limits it.
    pub fn ray_through(&self, x: f64, y: f64) -> Ray {
        let [w, h] = self.size.map(f64::from);
        let (x, y) = (2.0 * x / w - 1.0, 1.0 - 2.0 * y / h);
        let at = |[middle, right, up]: [DVec3; 3]| middle + right * x + up * y;
        let (origin, direction) = (at(self.lens.origin), at(self.lens.direction).normalize());
        let t_min = if self.lens.meet { 0.0 } else { f64::NEG_INFINITY };
        Ray { origin, direction, t_min, t_max: f64::INFINITY }
    }

    /// The view's rays as one affine form, in coordinates (world − `centre`) · `scale`. They start near the centre, so
    /// that f32 can tell their places; but at the eye of a perspective view if that is not beyond `near_eye` from it.
    pub fn fan(&self, centre: DVec3, scale: f64, near_eye: f64) -> Fan {
        let [w, h] = self.size.map(f64::from);
        let Lens { origin, direction, forward, meet, .. } = self.lens;
        let eye = (origin[0] - centre) * scale;
        let offset = DVec2::new(2.0 * self.pixel_offset.x / w, 2.0 * self.pixel_offset.y / h);
        let mut ahead = -eye.dot(forward);
        let [mut near, far] = self.clipping_range.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        if meet {
            near = near.max(0.0);
            if eye.length() <= near_eye || ahead < 0.0 {
                ahead = 0.0;
            }
        }
        let middle = eye + direction[0] * ahead;
        let aside = [1, 2].map(|k| origin[k] * scale + direction[k] * ahead);
        let origin = [middle, aside[0], aside[1]];
        Fan { origin, direction, ahead, near: near * scale - ahead, far: far * scale - ahead, offset }
    }

    /// The ray of pixel (column `i`, row `j`), with the part of it that clipping and depth leave.
    pub fn ray(&self, i: u32, j: u32) -> Ray {
        let (x, y) = (f64::from(i) + 0.5 + self.pixel_offset.x, f64::from(j) + 0.5 - self.pixel_offset.y);
        let mut ray = self.ray_through(x, y);
        let cos = ray.direction.dot(self.lens.forward);
        if let Some([near, far]) = self.clipping_range {
            ray.t_min = ray.t_min.max(near / cos);
            ray.t_max = ray.t_max.min(far / cos);
        }
        for p in &self.clipping_planes {
            let (height, slope) = ((ray.origin - p.origin).dot(p.normal), ray.direction.dot(p.normal));
            let t = -height / slope;
            if slope > 0.0 {
                ray.t_min = ray.t_min.max(t);
            } else if slope < 0.0 {
                ray.t_max = ray.t_max.min(t);
            } else if height < 0.0 {
                ray.t_max = f64::NEG_INFINITY;
            }
        }
        if let Some(depth) = &self.depth {
            let d = depth.values[j as usize * self.size[0] as usize + i as usize];
            let t = match (depth.kind, self.clipping_range) {
                (DepthKind::Window, Some([near, far])) if self.lens.meet => near * far / (far - d * (far - near)) / cos,
                (DepthKind::Window, Some([near, far])) => (near + d * (far - near)) / cos,
                (DepthKind::Ray, _) => d,
                _ => d / cos,
            };
            // A NaN depth ends nothing.
            ray.t_max = ray.t_max.min(t);
        }
        ray
    }
}

/// Pixels of an image.
const MOST_PIXELS: u64 = 1 << 28;

fn check_size([w, h]: [u32; 2]) -> Result<()> {
    if w == 0 || h == 0 || u64::from(w) * u64::from(h) > MOST_PIXELS {
        return Err(Error::View(format!(
            "an image of {w}x{h} pixels; it has at least 1x1, and not more than {MOST_PIXELS} together"
        )));
    }
    Ok(())
}

/// `v` scaled to length 1, whatever its length; none if it is zero or not finite.
fn direction(v: DVec3) -> Option<DVec3> {
    (v / v.abs().max_element()).try_normalize()
}

#[cfg(test)]
mod tests;
