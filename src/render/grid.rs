//! Frames of regular and rectilinear grids: by the ray caster, on the CPU, whatever the renderer's engine and device are.

use super::{Progress, Renderer, ms};
use crate::cast::{self, Reconstruction, Samples, Volume};
use crate::error::{Error, Result};
use crate::field::{Field, Kind, Normal};
use crate::gpu::Part;
use crate::grid::Grid;
use crate::image::Image;
use crate::integral::{Exact, Form};
use crate::transfer::TransferFunction;
use crate::view::View;
use std::time::Instant;

/// The grid that is drawn.
#[derive(Debug)]
pub(super) struct LoadedGrid {
    volume: Volume,
    field: Option<OnGrid>,
}

/// The field that is drawn of it.
#[derive(Debug)]
struct OnGrid {
    kind: Kind,
    normal: [Normal; 4],
    samples: Samples,
    /// The transfer function for it, once a frame needed that.
    exact: Option<Exact<f64>>,
}

impl LoadedGrid {
    /// Takes the transfer function for changed.
    pub(super) fn forget_function(&mut self) {
        if let Some(field) = &mut self.field {
            field.exact = None;
        }
    }
}

impl OnGrid {
    /// The pixel of a ray whose largest values are `v`: colour and opacity there, premultiplied.
    fn largest(&self, transfer: &TransferFunction, v: &[f64]) -> [f32; 4] {
        let own = |k: usize| self.normal[k].invert(v[k]);
        let [r, g, b] = match self.kind {
            Kind::Rgba => [v[0], v[1], v[2]].map(|c| c.clamp(0.0, 1.0)),
            Kind::Scalar | Kind::Pair => transfer.color_at(own(0)),
        };
        let a = transfer.opacity_at(own(v.len() - 1)).min(1.0);
        [r * a, g * a, b * a, a].map(|c| c as f32)
    }
}

impl Renderer {
    /// Draws a regular or rectilinear grid from now on; the field must be set again. Whatever the engine and the device are,
    /// the CPU's ray caster draws it.
    ///
    /// # Errors
    /// [`Error::Empty`] if none of its cells can be drawn.
    pub fn set_grid(&mut self, grid: &Grid) -> Result<()> {
        let start = Instant::now();
        let volume = self.pool.install(|| Volume::new(grid))?;
        (self.mesh, self.field) = (None, None);
        self.forget(Part::Mesh);
        (self.stats.cells, self.stats.tetrahedra) = (volume.cell_count() as u64, 0);
        self.stats.faces_ms = ms(start);
        if let Some(gpu) = self.backend.gpu() {
            let name = &gpu.adapter.name;
            tracing::warn!("regular and rectilinear grids are drawn by the CPU's ray caster, not yet on {name}");
        }
        self.grid = Some(LoadedGrid { volume, field: None });
        self.name_device();
        Ok(())
    }

    /// Rebuilds the field of a grid another way along rays from now on; nothing to meshes.
    pub fn set_reconstruction(&mut self, reconstruction: Reconstruction) {
        self.reconstruction = reconstruction;
    }

    /// What draws grids.
    pub(super) fn name_caster(&mut self) {
        self.stats.engine = "grid".into();
        (self.stats.device, self.stats.adapter) =
            ("cpu".into(), format!("{} threads", self.pool.current_num_threads()));
    }

    /// Draws another field of the grid from now on.
    pub(super) fn set_grid_field(&mut self, field: &Field) -> Result<()> {
        let start = Instant::now();
        let Some(grid) = &mut self.grid else { return Err(Error::Render("a field needs a grid first".into())) };
        let samples = self.pool.install(|| Samples::new(&grid.volume, field))?;
        self.stats.device_bytes = grid.volume.bytes() + samples.bytes();
        let normal = [0, 1, 2, 3].map(|k| field.normal(k));
        grid.field = Some(OnGrid { kind: field.kind(), normal, samples, exact: None });
        self.stats.upload_ms = ms(start);
        Ok(())
    }

    /// Draws a frame of the grid.
    pub(super) fn cast(&mut self, view: &View, progress: &Progress) -> Result<Image> {
        let start = Instant::now();
        let missing = |what: &str| Error::Render(format!("there is no {what} to draw"));
        if !matches!(self.integral.form, Form::Auto | Form::Exact) {
            let form = self.integral.form.name();
            return Err(Error::Render(format!("grids have the exact integral, not {form}: --integral exact")));
        }
        let reconstruction = self.reconstruction;
        let grid = self.grid.as_mut().ok_or_else(|| missing("grid"))?;
        let field = grid.field.as_mut().ok_or_else(|| missing("field"))?;
        let transfer = self.transfer.as_ref().ok_or_else(|| missing("transfer function"))?;
        if !transfer.is_of_one_variable() {
            let what = "the caster of grids draws neither a second variable nor light yet; the mesh of the grid's voxels has both";
            return Err(Error::Render(what.into()));
        }
        let (kind, normal, scale) = (field.kind, field.normal, grid.volume.scale);
        reconstruction.check(grid.volume.diagonal())?;
        if field.exact.is_none() {
            field.exact = Some(Exact::new(transfer, kind, &normal, scale));
        }
        let field = &*field;
        let exact = field.exact.as_ref().ok_or_else(|| missing("transfer function"))?;
        let pixel = |v: &[f64]| field.largest(transfer, v);
        let frame = cast::Frame {
            volume: &grid.volume,
            samples: &field.samples,
            exact,
            reconstruction,
            view,
            pixel: &pixel,
            progress,
        };
        let (pixels, steps) = self.pool.install(|| cast::render(&frame));
        let stats = &mut self.stats;
        (stats.steps, stats.repaired_rays, stats.cpu_rays) = (steps, 0, 0);
        (stats.integral, stats.table_ms, stats.table_bytes) = (Form::Exact.name().into(), 0.0, 0);
        (stats.device_ms, stats.projection, stats.sweep, stats.uploaded_bytes) = (None, None, None, 0);
        stats.frame_ms = ms(start);
        Ok(Image { size: view.size(), pixels })
    }
}
