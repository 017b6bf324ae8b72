//! Cropping regions, as VTK's `vtkVolumeMapper` has them: two planes across each axis of a space make 27 regions, any of which
//! are drawn.
//!
//! A ray may leave what is drawn and come back. So regions are joined to boxes, each of which a ray passes in one piece: to
//! slabs across z, in these rows across y, and in these runs along x, where neighbours are alike. From any eye such boxes have
//! an order, slab by slab, row by row and run by run: those that the eye is in come first, and on either side of it nearer
//! ones before farther ones.

use super::{ClippingPlane, View};
use crate::error::{Error, Result};
use glam::{DMat4, DVec3};

/// Which of 27 regions are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cropping {
    planes: [[f64; 2]; 3],
    regions: u32,
    place: DMat4,
    to_own: DMat4,
}

/// Regions by the names that VTK has for them: bit x + 3 y + 9 z is that of region (x, y, z), each from 0 to 2.
pub const REGIONS: [(&str, u32); 5] = [
    ("subvolume", 0x0002000),
    ("fence", 0x2ebfeba),
    ("inverted fence", 0x5140145),
    ("cross", 0x0417410),
    ("inverted cross", 0x7be8bef),
];

/// All regions.
const ALL: u32 = (1 << 27) - 1;

/// From which region to which along each axis, the latter not included.
type Range = [usize; 2];

impl Cropping {
    /// The regions of these bits, between two coordinates along each axis of a space, which `place` leads to the world.
    ///
    /// # Errors
    /// [`Error::View`] if a coordinate is NaN, `place` is not affine, not finite or not invertible, or there are bits beyond
    /// the 27.
    pub fn new(planes: [[f64; 2]; 3], regions: u32, place: DMat4) -> Result<Self> {
        if planes.as_flattened().iter().any(|c| c.is_nan()) {
            return Err(Error::View(format!("the planes of the cropping regions are {planes:?}")));
        }
        if regions & !ALL != 0 {
            return Err(Error::View(format!("cropping regions {regions:#x}: there are 27, and bits up to {ALL:#x}")));
        }
        let to_own = place.inverse();
        if !(place.is_finite() && to_own.is_finite()) || place.row(3).to_array() != [0.0, 0.0, 0.0, 1.0] {
            return Err(Error::View("the matrix of the cropping regions is not affine, or flat".into()));
        }
        let planes = planes.map(|[a, b]| [a.min(b), a.max(b)]);
        Ok(Cropping { planes, regions, place, to_own })
    }

    /// The bits of the regions that are drawn.
    pub fn regions(&self) -> u32 {
        self.regions
    }

    /// What a box keeps, as planes of the world.
    fn planes_of(&self, box_of: [Range; 3]) -> Vec<ClippingPlane> {
        let mut all = vec![];
        let to_own = self.to_own.transpose();
        for (a, [from, to]) in box_of.into_iter().enumerate() {
            for (side, sign) in [(from, 1.0), (to, -1.0)] {
                // Beyond the outer regions nothing ends.
                let Some(at) = side.checked_sub(1).and_then(|k| self.planes[a].get(k)).filter(|c| c.is_finite()) else {
                    continue;
                };
                let axis = DVec3::AXES[a];
                let origin = self.place.transform_point3(axis * *at);
                all.push(ClippingPlane { origin, normal: to_own.transform_vector3(axis) * sign });
            }
        }
        all
    }

    /// Boxes of the regions that are drawn, from front to back for `view`.
    fn boxes(&self, view: &View) -> Vec<[Range; 3]> {
        // Nothing lies beyond a plane that is infinitely far.
        let is_empty = |a: usize, [from, to]: Range| {
            let plane = |side: usize| side.checked_sub(1).and_then(|k| self.planes[a].get(k));
            plane(from) == Some(&f64::INFINITY) || plane(to) == Some(&f64::NEG_INFINITY)
        };
        // The number of the region that the eye is in along each axis; beyond all where rays are parallel.
        let eye = view.eye().map(|eye| self.to_own.transform_point3(eye));
        let along = self.to_own.transform_vector3(view.forward());
        let from = |a: usize| match eye {
            Some(eye) => self.planes[a].iter().filter(|c| **c <= eye[a]).count() as i32,
            None if along[a] > 0.0 => -1,
            None => 3,
        };
        let slab = |z: usize| self.regions >> (9 * z) & 0x1ff;
        let mut boxes = vec![];
        for z in in_order(runs(slab), from(2)) {
            let row = |y: usize| slab(z[0]) >> (3 * y) & 7;
            for y in in_order(runs(row), from(1)) {
                let region = |x: usize| row(y[0]) >> x & 1;
                for x in in_order(runs(region), from(0)) {
                    boxes.push([x, y, z]);
                }
            }
        }
        boxes.retain(|of| (0..3).all(|a| !is_empty(a, of[a])));
        boxes
    }
}

/// Neighbours that are alike, without those that are 0.
fn runs(of: impl Fn(usize) -> u32) -> Vec<Range> {
    let mut all: Vec<Range> = vec![];
    for i in (0..3).filter(|&i| of(i) != 0) {
        match all.last_mut() {
            Some(last) if last[1] == i && of(last[0]) == of(i) => last[1] = i + 1,
            _ => all.push([i, i + 1]),
        }
    }
    all
}

/// Ranges by their distance from region `eye`.
fn in_order(mut ranges: Vec<Range>, eye: i32) -> Vec<Range> {
    let distance = |r: &Range| (r[0] as i32 - eye).max(eye - (r[1] as i32 - 1)).max(0);
    ranges.sort_by_key(distance);
    ranges
}

impl View {
    /// Draws some regions of a space alone.
    pub fn with_cropping(mut self, cropping: Cropping) -> Self {
        self.cropping = (cropping.regions != ALL).then_some(cropping);
        self
    }

    /// What limits it to regions, if anything does.
    pub fn cropping(&self) -> Option<&Cropping> {
        self.cropping.as_ref()
    }

    /// Views of its regions' boxes, each limited by planes, from front to back; nothing if it is not cropped.
    pub(crate) fn parts(&self) -> Option<Vec<View>> {
        let cropping = self.cropping.as_ref()?;
        let part = |box_of| {
            let mut view = View { cropping: None, ..self.clone() };
            view.clipping_planes.extend(cropping.planes_of(box_of));
            view
        };
        Some(cropping.boxes(self).into_iter().map(part).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::{Camera, Projection};

    fn view(position: DVec3, projection: Projection) -> View {
        let camera = Camera { position, focal_point: DVec3::ZERO, view_up: DVec3::new(0.1, 1.0, 0.3), projection };
        View::new(camera, [9, 7]).unwrap()
    }

    /// Along each ray, the boxes are in order, do not overlap, and are what the regions say.
    #[test]
    fn boxes_are_the_regions_in_order() {
        let place = DMat4::from_cols_array(&[
            1.2, 0.3, 0.0, 0.0, -0.2, 0.9, 0.1, 0.0, 0.0, 0.2, -1.1, 0.0, 0.1, 0.2, -0.1, 1.0,
        ]);
        let planes = [[-0.3, 0.4], [0.2, -0.5], [-0.2, 0.3]];
        let mut seed = 1u32;
        let mut shown = 0;
        for round in 0..120 {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let regions = REGIONS.get(round).map_or(seed >> 5, |r| r.1);
            let cropping = Cropping::new(planes, regions, place).unwrap();
            let angle = f64::from(round as u32) * 0.7;
            let near = if round % 3 == 0 { 0.3 } else { 4.0 };
            let position = DVec3::new(angle.sin(), (angle * 0.37).cos(), angle.cos()) * near;
            let projection = match round % 2 {
                0 => Projection::Perspective { view_angle: 50.0 },
                _ => Projection::Parallel { parallel_scale: 1.3 },
            };
            let whole = view(position, projection).with_cropping(cropping);
            let parts = whole.parts().unwrap();
            assert!(parts.len() <= 27, "{}", parts.len());
            for (i, j) in (0..7).flat_map(|j| (0..9).map(move |i| (i, j))) {
                let rays: Vec<_> = parts.iter().map(|v| v.ray(i, j)).filter(|r| r.t_min < r.t_max).collect();
                assert!(rays.windows(2).all(|r| r[0].t_max <= r[1].t_min + 1e-12), "{regions:#x}: {rays:?}");
                for k in 0..200 {
                    let t = f64::from(k) * 0.05 - if near < 1.0 { 0.0 } else { 1.0 } + 0.0123;
                    let ray = whole.ray_through(f64::from(i) + 0.5, f64::from(j) + 0.5);
                    let p = place.inverse().transform_point3(ray.origin + ray.direction * t);
                    let of = |a: usize| cropping.planes[a].iter().filter(|c| **c <= p[a]).count();
                    let want = t > ray.t_min && regions >> (of(0) + 3 * of(1) + 9 * of(2)) & 1 == 1;
                    let got = rays.iter().any(|r| r.t_min < t && t < r.t_max);
                    assert_eq!(got, want, "{regions:#x} at {t}");
                    shown += u32::from(got);
                }
            }
        }
        assert!(shown > 10_000, "{shown}");
    }

    #[test]
    fn nothing_lies_beyond_infinite_planes() {
        let (low, high) = (f64::NEG_INFINITY, f64::INFINITY);
        let whole = view(DVec3::Z * 3.0, Projection::Perspective { view_angle: 40.0 });
        for (x, shown) in [([low, high], 0b010), ([low, low], 0b100), ([high, high], 0b001), ([low, 0.0], 0b110)] {
            for region in 0..3 {
                let planes = [x, [-1.0, 1.0], [-1.0, 1.0]];
                let cropping = Cropping::new(planes, 1 << (region + 3 + 9), DMat4::IDENTITY).unwrap();
                let parts = whole.clone().with_cropping(cropping).parts().unwrap();
                assert_eq!(parts.len(), shown >> region & 1, "{x:?} {region}");
            }
        }
    }

    #[test]
    fn what_is_no_cropping_is_refused() {
        let planes = [[0.0, 1.0]; 3];
        assert!(Cropping::new([[f64::NAN, 1.0]; 3], 1, DMat4::IDENTITY).is_err());
        assert!(Cropping::new(planes, 1 << 27, DMat4::IDENTITY).is_err());
        assert!(Cropping::new(planes, 1, DMat4::from_scale(DVec3::new(1.0, 0.0, 1.0))).is_err());
        let all = view(DVec3::Z, Projection::Parallel { parallel_scale: 1.0 });
        let nothing = Cropping::new(planes, 0, DMat4::IDENTITY).unwrap();
        assert_eq!(all.clone().with_cropping(nothing).parts().unwrap().len(), 0);
        assert!(all.with_cropping(Cropping::new(planes, ALL, DMat4::IDENTITY).unwrap()).parts().is_none());
    }
}
