//! A view's rays, and what limits them, as shaders of all engines read them: in normalised coordinates.

use crate::geometry::TetMesh;
use crate::view::{ClippingPlane, Fan, View};
use glam::DVec3;
use rayon::prelude::*;

/// Stands for ±∞ in limits of t, which are within ±10 else.
pub(crate) const FAR: f32 = 1e30;

/// A limit of t.
pub(crate) fn limit(t: f64) -> f32 {
    (t as f32).clamp(-FAR, FAR)
}

/// `v` as a sum of two vectors of f32.
pub(crate) fn double_single(v: DVec3) -> [[f32; 3]; 2] {
    let high = v.as_vec3();
    [high, (v - high.as_dvec3()).as_vec3()].map(|v| v.to_array())
}

/// What the shader computes v · (1, i, j) from: the products of pixels and high parts are exact.
pub(crate) fn affine([first, by_column, by_row]: [DVec3; 3]) -> [[[f32; 4]; 2]; 3] {
    let short = |v: DVec3| {
        let high = v.as_vec3().to_array().map(|x| f32::from_bits(x.to_bits() & !0x3fff));
        let low = (v - DVec3::from(high.map(f64::from))).as_vec3();
        [[high[0], high[1], high[2], 0.0], low.extend(0.0).to_array()]
    };
    [double_single(first).map(|[x, y, z]| [x, y, z, 0.0]), short(by_column), short(by_row)]
}

/// Clipping planes: dot(p, plane.xyz) + plane.w ≥ 0 is kept of what is at `p` from `base`.
pub(crate) fn planes(view: &View, geometry: &TetMesh, base: DVec3) -> Vec<[f32; 4]> {
    let plane = |p: &ClippingPlane| {
        let normal = (p.normal / p.normal.abs().max_element()).normalize();
        let height = normal.dot((geometry.centre - p.origin) * geometry.scale + base);
        normal.extend(height).as_vec4().to_array()
    };
    view.clipping_planes().iter().map(plane).collect()
}

/// Where a depth buffer ends each pixel's ray, from where `fan` has it start: how far along the ray, or, if `in_depth`,
/// along the view direction. Empty without a depth buffer.
pub(crate) fn ends(view: &View, fan: &Fan, scale: f64, in_depth: bool) -> Vec<f32> {
    if !view.has_depth() {
        return vec![];
    }
    let [w, h] = view.size();
    let pixels = 0..w as usize * h as usize;
    let end = |p: usize| {
        let ray = view.ray((p % w as usize) as u32, (p / w as usize) as u32);
        let cos = ray.direction.dot(view.forward());
        let t = ray.t_max * scale - fan.ahead / cos;
        limit(if in_depth { t * cos } else { t })
    };
    pixels.into_par_iter().map(end).collect()
}
