//! The camera that options ask for.

use crate::parse;
use clap::Args;
use glam::{DQuat, DVec3};
use halite::view::{Camera, Projection};

/// From where a picture is seen.
#[derive(Args, Clone)]
#[group(skip)]
#[command(next_help_heading = "Camera")]
pub struct Options {
    /// Turn around the view-up axis, in degrees to the right
    #[arg(long, value_name = "DEGREES", value_parser = parse::finite, allow_hyphen_values = true)]
    azimuth: Option<f64>,
    /// Rise above the focal point, in degrees
    #[arg(long, value_name = "DEGREES", value_parser = parse::finite, allow_hyphen_values = true)]
    elevation: Option<f64>,
    /// Enlarge by a factor
    #[arg(long, value_name = "FACTOR", value_parser = parse::positive)]
    zoom: Option<f64>,
    /// Where the camera is
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vector, allow_hyphen_values = true)]
    position: Option<DVec3>,
    /// The point in the middle of the picture
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vector, allow_hyphen_values = true)]
    focal_point: Option<DVec3>,
    /// The direction that points up
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vector, allow_hyphen_values = true)]
    view_up: Option<DVec3>,
    /// A perspective view of this many degrees from bottom to top
    #[arg(long, value_name = "DEGREES", value_parser = parse::positive, conflicts_with = "parallel_scale")]
    view_angle: Option<f64>,
    /// A parallel view of this half height, in world units
    #[arg(long, value_name = "LENGTH", value_parser = parse::positive)]
    parallel_scale: Option<f64>,
}

impl Options {
    /// `camera`, with what the options change.
    pub fn apply(&self, camera: Camera) -> Camera {
        self.zoomed(self.aimed(camera))
    }

    /// As [`Self::apply`], with the camera moved by `fill` before it is zoomed, if no option says where it is.
    pub fn framed(&self, camera: Camera, fill: impl FnOnce(Camera) -> Camera) -> Camera {
        let camera = self.aimed(camera);
        let placed = self.position.is_some() || self.focal_point.is_some();
        self.zoomed(if placed { camera } else { fill(camera) })
    }

    fn aimed(&self, mut camera: Camera) -> Camera {
        camera.position = self.position.unwrap_or(camera.position);
        camera.focal_point = self.focal_point.unwrap_or(camera.focal_point);
        camera.view_up = self.view_up.unwrap_or(camera.view_up);
        if let Some(view_angle) = self.view_angle {
            camera.projection = Projection::Perspective { view_angle };
        }
        if let Some(parallel_scale) = self.parallel_scale {
            camera.projection = Projection::Parallel { parallel_scale };
        }
        if let (Some(degrees), Some(axis)) = (self.azimuth, camera.view_up.try_normalize()) {
            turn(&mut camera, axis, degrees);
        }
        let across = (camera.focal_point - camera.position).cross(camera.view_up);
        if let (Some(degrees), Some(right)) = (self.elevation, across.try_normalize()) {
            turn(&mut camera, right, -degrees);
        }
        camera
    }

    fn zoomed(&self, mut camera: Camera) -> Camera {
        if let Some(zoom) = self.zoom {
            match &mut camera.projection {
                Projection::Perspective { view_angle } => *view_angle /= zoom,
                Projection::Parallel { parallel_scale } => *parallel_scale /= zoom,
            }
        }
        camera
    }
}

/// `camera`, so many `degrees` further around its view-up axis.
pub fn turned(mut camera: Camera, degrees: f64) -> Camera {
    if let Some(axis) = camera.view_up.try_normalize() {
        turn(&mut camera, axis, degrees);
    }
    camera
}

/// Turns position and view up around the focal point.
fn turn(camera: &mut Camera, axis: DVec3, degrees: f64) {
    let by = DQuat::from_axis_angle(axis, degrees.to_radians());
    camera.position = camera.focal_point + by * (camera.position - camera.focal_point);
    camera.view_up = by * camera.view_up;
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Cli {
        #[command(flatten)]
        camera: Options,
    }

    fn apply(arguments: &[&str]) -> Camera {
        let camera = Camera {
            position: DVec3::new(0.0, 0.0, 2.0),
            focal_point: DVec3::ZERO,
            view_up: DVec3::Y,
            projection: Projection::Perspective { view_angle: 30.0 },
        };
        Cli::parse_from([&["halite"], arguments].concat()).camera.apply(camera)
    }

    #[test]
    fn turns_are_vtks() {
        let near = |a: DVec3, b: DVec3| assert!(a.distance(b) < 1e-12, "{a} is not {b}");
        near(apply(&["--azimuth", "90"]).position, DVec3::new(2.0, 0.0, 0.0));
        near(apply(&["--elevation", "90"]).position, DVec3::new(0.0, 2.0, 0.0));
        near(apply(&["--elevation", "90"]).view_up, -DVec3::Z);
        near(apply(&["--azimuth", "-90", "--elevation", "30"]).position, DVec3::new(-(3.0f64.sqrt()), 1.0, 0.0));
        assert_eq!(apply(&["--zoom", "2"]).projection, Projection::Perspective { view_angle: 15.0 });
        let parallel = apply(&["--parallel-scale", "4", "--zoom", "2"]);
        assert_eq!(parallel.projection, Projection::Parallel { parallel_scale: 2.0 });
    }
}
