//! Views, as C++ describes them.

use super::bridge::{CameraSpec, ViewSpec};
use super::rows;
use glam::DVec3;
use halite::error::{Error, Result};
use halite::view::{Blend, Camera, ClippingPlane, Cropping, DepthBuffer, DepthKind, Projection, View};

/// The view that a specification describes.
///
/// # Errors
/// Those of [`View`].
pub(super) fn view(spec: &ViewSpec) -> Result<View> {
    let size = [spec.width, spec.height];
    let view = if spec.by_matrices {
        View::from_matrices(rows(spec.to_eye), rows(spec.to_clip), size)?
    } else {
        camera(&spec.camera, size)?
    };
    let blend = if spec.maximum { Blend::Maximum } else { Blend::Composite };
    let vectors =
        |p: &[f64; 6]| ClippingPlane { origin: DVec3::new(p[0], p[1], p[2]), normal: DVec3::new(p[3], p[4], p[5]) };
    let view = view.with_blend(blend).with_clipping_planes(spec.planes.as_chunks().0.iter().map(vectors).collect())?;
    let view = match *spec.crop {
        [] => view,
        [a, b, c, d, e, f, ref matrix @ ..] => {
            let matrix = matrix.try_into().map_err(|_| Error::View("a cropping without its matrix".into()))?;
            view.with_cropping(Cropping::new([[a, b], [c, d], [e, f]], spec.regions, rows(matrix))?)
        }
        _ => return Err(Error::View("a cropping without six planes".into())),
    };
    if spec.depths.is_empty() {
        return Ok(view);
    }
    let w = spec.width as usize;
    // The far plane ends nothing that the clipping range does not end.
    let values = |row: &[f32]| row.iter().map(|&d| if d < 1.0 { f64::from(d) } else { 1.0 }).collect::<Vec<_>>();
    let rows = spec.depths.chunks(w);
    let values = if spec.bottom_up { rows.rev().flat_map(values).collect() } else { rows.flat_map(values).collect() };
    view.with_depth(DepthBuffer { kind: DepthKind::Window, values })
}

fn camera(spec: &CameraSpec, size: [u32; 2]) -> Result<View> {
    let [position, focal_point, view_up] = [spec.position, spec.focal_point, spec.view_up].map(DVec3::from_array);
    let number = spec.angle_or_scale;
    let projection = if spec.parallel {
        Projection::Parallel { parallel_scale: number }
    } else {
        Projection::Perspective { view_angle: number }
    };
    let view = View::new(Camera { position, focal_point, view_up, projection }, size)?;
    if spec.near < spec.far { view.with_clipping_range([spec.near, spec.far]) } else { Ok(view) }
}
