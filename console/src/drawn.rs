//! Pictures, and what is reported of them.

use crate::progress;
use crate::request::Job;
use anyhow::Result;
use halite::image::{Backdrop, Image};
use halite::render::{Renderer, Stats};
use std::time::Instant;

/// A picture, and what it took.
pub struct Drawn {
    /// Premultiplied colours.
    pub image: Image,
    /// Opaque objects behind the volume.
    pub behind: Option<halite::scene::Backdrop>,
    stats: Stats,
    times: Times,
}

/// What the renderer's own statistics do not tell, in ms.
#[derive(Default)]
pub struct Times {
    /// Reading the mesh.
    pub load: f64,
    /// Splitting its cells into tetrahedra.
    pub split: f64,
    /// The first picture, with all that is made for it.
    pub first_frame: f64,
    /// From a change of the transfer function to the frame that shows it.
    pub transfer_edit: Option<f64>,
}

/// Draws a picture.
///
/// # Errors
/// Those of the renderer.
pub fn draw(job: Job, renderer: &mut Renderer) -> Result<Drawn> {
    let Job { mesh, grid, tetrahedra, field, scene, load_ms, split_ms, .. } = job;
    let (view, behind) = scene.view()?;
    match &grid {
        Some(grid) => renderer.set_grid(grid)?,
        None => {
            renderer.check_room(mesh.points().len(), &tetrahedra)?;
            progress::during("matching faces", |p| renderer.set_tetrahedra_with_progress(&mesh, tetrahedra, p));
        }
    }
    renderer.set_field(&field)?;
    renderer.set_transfer(&scene.transfer);
    // The renderer has its own copy, and the meshes that people draw are large.
    drop((mesh, grid, field));
    let start = Instant::now();
    let image = progress::during("drawing", |p| renderer.render(&view, p))?;
    let times = Times { load: load_ms, split: split_ms, first_frame: ms(start), transfer_edit: None };
    Ok(Drawn { image, behind, stats: renderer.stats().clone(), times })
}

impl Drawn {
    /// What `--stats` writes.
    pub fn report(&self) -> serde_json::Value {
        report(&self.stats, &self.times, self.image.size, self.stats.frame_ms)
    }
}

/// What is told of frames that took `frame_ms`.
pub fn report(s: &Stats, times: &Times, size: [u32; 2], frame_ms: f64) -> serde_json::Value {
    serde_json::json!({
        "engine": s.engine, "device": s.device, "adapter": s.adapter,
        "size": size, "cells": s.cells, "tetrahedra": s.tetrahedra,
        "load_ms": times.load, "faces_ms": times.split + s.faces_ms, "upload_ms": s.upload_ms,
        "first_frame_ms": times.first_frame, "frame_ms": frame_ms, "transfer_edit_ms": times.transfer_edit,
        "integral": s.integral, "table_ms": s.table_ms, "table_bytes": s.table_bytes, "knots_per_cell": s.knots_per_cell,
        "steps": s.steps, "retraced_rays": s.retraced_rays, "cpu_rays": s.cpu_rays, "panels": s.panels,
        "culled_cells": s.culled_cells, "culling_ms": s.culling_ms,
        "device_ms": s.device_ms, "uploaded_bytes": s.uploaded_bytes, "device_bytes": s.device_bytes,
        "peak_bytes": peak_bytes(), "projection": s.projection, "sweep": s.sweep,
    })
}

/// The most memory that this process ever held, where the system says so.
fn peak_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kb| kb * 1024)
}

/// What an 8-bit picture shows behind the volume: opaque objects, if there are any.
pub fn backdrop(background: Option<[f64; 3]>, behind: Option<&[[f32; 3]]>) -> Backdrop<'_> {
    match (behind, background) {
        (Some(pixels), _) => Backdrop::Pixels(pixels),
        (None, Some(c)) => Backdrop::Color(c.map(|c| c as f32)),
        (None, None) => Backdrop::Transparent,
    }
}

/// Milliseconds since `start`.
pub fn ms(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}
