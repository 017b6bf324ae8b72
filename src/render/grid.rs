//! Frames of regular and rectilinear grids: by the ray caster, whatever the renderer's engine is, on its device.

mod device;
mod second;

use super::largest::Largest;
use super::tables::TableKey;
use super::{Progress, Renderer, ms};
use crate::cast::tabulated::{self, Tabulated};
use crate::cast::{self, Reconstruction, ReconstructionOrder, Samples, Sampling, Volume};
use crate::error::{Error, Result};
use crate::field::normalization::Chooser;
use crate::field::{Field, Kind, Normalization};
use crate::gpu::Part;
use crate::grid::Grid;
use crate::image::Image;
use crate::integral::{Exact, Form, IntegrationOptions, lookup};
use crate::transfer::TransferFunction;
use crate::view::{Blend, View};
use second::Extra;
use std::sync::Arc;
use std::time::Instant;

/// The grid that is drawn.
#[derive(Debug)]
pub(super) struct LoadedGrid {
    volume: Volume,
    field: Option<OnGrid>,
    /// The device was said to lack digits for it.
    is_fine: bool,
}

/// The field that is drawn of it.
#[derive(Debug)]
struct OnGrid {
    field: Field,
    normal: [Normalization; 4],
    samples: Samples,
    /// How values are mapped for tables.
    chooser: Chooser,
    /// The transfer function for it, once a frame needed that.
    exact: Option<Exact<f64>>,
    /// What frames with a second variable, or light, need.
    extra: Extra,
}

impl LoadedGrid {
    /// Takes the transfer function for changed.
    pub(super) fn invalidate_function(&mut self) {
        if let Some(field) = &mut self.field {
            field.exact = None;
            field.extra.invalidate_function();
        }
    }
}

impl OnGrid {
    fn kind(&self) -> Kind {
        self.field.kind()
    }

    /// What is needed of a table; nothing for the integral itself.
    fn key(
        &mut self,
        choice: &IntegrationOptions,
        transfer: &TransferFunction,
        how: Reconstruction,
        volume: &Volume,
    ) -> Result<Option<TableKey>> {
        if matches!(choice.form, Form::Auto | Form::Exact) {
            return Ok(None);
        }
        self.chooser.choose(transfer, true);
        let own = Exact::new(transfer, self.kind(), self.chooser.normal(), volume.scale);
        if self.kind() != Kind::Scalar {
            return Err(Error::Render(
                "tables of grids are for fields of one component; use the exact integral".into(),
            ));
        }
        lookup::check(choice, choice.size(own.opacity.len()), self.kind())?;
        choice.check_function(&Exact::new(transfer, self.kind(), self.chooser.normal(), volume.scale))?;
        let slab = match how.sampling {
            Sampling::Voxels => volume.longest_chord(),
            Sampling::Steps(step) => 2.0 * step,
        };
        let longest = volume.scale * if how.order == ReconstructionOrder::One { slab / 2.0 } else { slab };
        Ok(Some(TableKey { exact: own, choice: *choice, longest, on_device: false }))
    }

    fn largest<'a>(&'a self, transfer: &'a TransferFunction, as_values: bool) -> Largest<'a> {
        Largest { kind: self.kind(), normal: &self.normal, transfer, as_values }
    }
}

impl Renderer {
    /// Draws a regular or rectilinear grid from now on; the field must be set again. Whatever the engine is, the ray caster
    /// draws it, on the renderer's device: on the CPU with tables, a second variable or light.
    ///
    /// # Errors
    /// [`Error::Empty`] if none of its cells can be drawn.
    pub fn set_grid(&mut self, grid: &Grid) -> Result<()> {
        let start = Instant::now();
        let volume = self.pool.install(|| Volume::new(grid))?;
        (self.mesh, self.field) = (None, None);
        self.invalidate(Part::Mesh);
        (self.stats.cells, self.stats.tetrahedra) = (volume.cell_count() as u64, 0);
        self.stats.faces_ms = ms(start);
        self.grid = Some(LoadedGrid { volume, field: None, is_fine: false });
        self.name_device();
        Ok(())
    }

    /// Rebuilds the field of a grid another way along rays from now on; nothing to meshes.
    pub fn set_reconstruction(&mut self, reconstruction: Reconstruction) {
        if self.reconstruction != reconstruction {
            (self.reconstruction, self.key) = (reconstruction, None);
            self.waits = self.integral.form != Form::Auto;
        }
    }

    /// Gives pixels that hold largest values the colours and opacities of these.
    pub(super) fn color(&self, image: &mut Image) {
        let Some(transfer) = &self.transfer else { return };
        let largest = match (&self.grid, &self.field) {
            (Some(LoadedGrid { field: Some(field), .. }), _) => field.largest(transfer, false),
            (None, Some(field)) => Largest { kind: field.kind(), normal: field.normal(), transfer, as_values: false },
            _ => return,
        };
        image.pixels.iter_mut().for_each(|p| *p = largest.of_values(*p));
    }

    /// Draws another field of the grid from now on.
    pub(super) fn set_grid_field(&mut self, field: &Field) -> Result<()> {
        let start = Instant::now();
        let Some(grid) = &mut self.grid else { return Err(Error::Render("a field needs a grid first".into())) };
        let samples = self.pool.install(|| Samples::new(&grid.volume, field))?;
        self.stats.device_bytes = grid.volume.bytes() + samples.bytes();
        self.caster.invalidate(Part::Field);
        let normal = [0, 1, 2, 3].map(|k| field.normal(k));
        let chooser = Chooser::new(field);
        grid.field =
            Some(OnGrid { field: field.clone(), normal, samples, chooser, exact: None, extra: Extra::default() });
        self.waits = self.integral.form != Form::Auto;
        self.key = None;
        self.stats.upload_ms = ms(start);
        Ok(())
    }

    /// Draws a frame of the grid.
    pub(super) fn cast(&mut self, view: &View, progress: &Progress) -> Result<Image> {
        let start = Instant::now();
        let missing = |what: &str| Error::Render(format!("there is no {what} to draw"));
        let reconstruction = self.reconstruction;
        self.name_caster();
        let steps = matches!(reconstruction.sampling, Sampling::Steps(_));
        tabulated::check(self.integral.form, reconstruction.order, steps)?;
        let grid = self.grid.as_mut().ok_or_else(|| missing("grid"))?;
        let field = grid.field.as_mut().ok_or_else(|| missing("field"))?;
        let transfer = self.transfer.as_ref().ok_or_else(|| missing("transfer function"))?;
        let of_two = !transfer.is_of_one_variable();
        if of_two && reconstruction.order != ReconstructionOrder::Exact {
            let what = "reconstructions are of one variable; with a second, or light, use --reconstruction exact";
            return Err(Error::Render(what.into()));
        }
        let (kind, normal, scale) = (field.kind(), field.normal, grid.volume.scale);
        reconstruction.check(grid.volume.diagonal())?;
        if field.exact.is_none() {
            field.exact = Some(Exact::new(transfer, kind, &normal, scale));
        }
        let key = match &self.key {
            Some(key) => key.clone(),
            None if of_two => None,
            None => {
                let key = field.key(&self.integral, transfer, reconstruction, &grid.volume)?;
                self.key.insert(key.map(Arc::new)).clone()
            }
        };
        // The largest value along a ray is found without an integral.
        let key = key.filter(|_| view.blend() == Blend::Composite);
        let built = match &key {
            Some(key) => self.tables.get(key, self.waits, &self.pool)?,
            None => None,
        };
        if of_two {
            let OnGrid { field, samples, extra, .. } = &mut *field;
            super::second::check(field, transfer, view.blend())?;
            self.pool.install(|| extra.prepare(&grid.volume, samples, field, transfer, self.integral.two))?;
        }
        let field = &*field;
        let exact = field.exact.as_ref().ok_or_else(|| missing("transfer function"))?;
        let largest = field.largest(transfer, self.as_values);
        let pixel = |v: &[f64]| largest.pixel(v);
        let table = key.as_ref().zip(built.as_ref()).map(|(key, built)| {
            let normal = [field.normal[0], field.chooser.normal()[0]];
            Tabulated::new(&built.table, &key.exact, normal, reconstruction.order)
        });
        let frame = cast::Frame {
            volume: &grid.volume,
            samples: &field.samples,
            exact,
            reconstruction,
            table,
            view,
            pixel: &pixel,
            progress,
        };
        let on_device = match self.backend.gpu().filter(|_| self.lacking.is_none()) {
            Some(gpu) => device::draw(&mut self.caster, gpu, &frame, &self.pool, &mut self.stats)?,
            None => None,
        };
        let is_fine = on_device.is_none() && self.lacking.is_none() && self.backend.gpu().is_some();
        let pixels = match on_device {
            Some(pixels) => pixels,
            None => {
                let (pixels, [steps, panels]) = self.pool.install(|| match of_two {
                    true => field.extra.draw(&frame, &field.field, transfer),
                    false => Ok({
                        let (pixels, steps) = cast::render(&frame);
                        (pixels, [steps, 0])
                    }),
                })?;
                let stats = &mut self.stats;
                stats.device_bytes = grid.volume.bytes() + field.samples.bytes() + field.extra.bytes();
                (stats.steps, stats.panels, stats.cpu_rays) = (steps, panels, 0);
                (stats.device_ms, stats.uploaded_bytes) = (None, 0);
                pixels
            }
        };
        let said = std::mem::replace(&mut grid.is_fine, is_fine);
        let stats = &mut self.stats;
        stats.retraced_rays = 0;
        let own = if of_two { self.integral.two.method.name() } else { Form::Exact.name() };
        stats.integral = built.as_ref().map_or(own, |b| b.table.options().form.name()).into();
        stats.table_ms = built.as_ref().map_or(0.0, |b| b.ms);
        stats.table_bytes = built.as_ref().map_or(0, |b| b.table.bytes());
        (stats.projection, stats.sweep) = (None, None);
        stats.frame_ms = ms(start);
        self.waits = false;
        if let Some(key) = key.filter(|_| built.is_none()) {
            self.tables.start(&key, &self.pool)?;
        }
        if is_fine {
            self.name_fine(said);
        }
        Ok(Image { size: view.size(), pixels })
    }
}
