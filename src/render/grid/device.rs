//! Frames of grids on a device, and who draws them where it cannot.

use crate::cast::Frame;
use crate::cast::gpu::Caster;
use crate::error::Result;
use crate::gpu::Gpu;
use crate::integral::Form;
use crate::render::{Renderer, Stats};

/// Draws a frame on a device; nothing if it has too few digits for it. What it leaves unfinished, the CPU draws.
pub(super) fn draw(
    caster: &mut Caster,
    gpu: &Gpu,
    frame: &Frame,
    pool: &rayon::ThreadPool,
    stats: &mut Stats,
) -> Result<Option<Vec<[f32; 4]>>> {
    let uploaded = gpu.uploaded();
    let Some(drawn) = pool.install(|| caster.draw(gpu, frame))? else { return Ok(None) };
    stats.device_bytes = gpu.allocated();
    stats.uploaded_bytes = gpu.uploaded() - uploaded;
    (stats.device_ms, stats.steps, stats.panels) = (drawn.device_ms, drawn.steps, 0);
    stats.cpu_rays = drawn.by_cpu;
    Ok(Some(drawn.pixels))
}

impl Renderer {
    /// What the ray caster on devices does not draw of what it is asked for.
    fn caster_lacks(&self) -> Option<&'static str> {
        if self.transfer.as_ref().is_some_and(|t| !t.is_of_one_variable()) {
            return Some("a second variable or light");
        }
        (!matches!(self.integral.form, Form::Auto | Form::Exact)).then_some("tables")
    }

    /// Names what draws grids, and says what the CPU draws in the place of a device.
    pub(in crate::render) fn name_caster(&mut self) {
        let lacking = self.caster_lacks().filter(|_| self.backend.gpu().is_some());
        if let (Some(what), true) = (lacking, lacking != self.lacking.as_deref()) {
            tracing::warn!("the ray caster of grids draws no {what} on a device yet; the CPU does");
        }
        self.lacking = lacking.map(str::to_owned);
        self.stats.engine = "grid".into();
        (self.stats.device, self.stats.adapter) = match self.backend.gpu().filter(|_| lacking.is_none()) {
            Some(gpu) => ("gpu".into(), gpu.adapter.name.clone()),
            None => ("cpu".into(), format!("{} threads", self.pool.current_num_threads())),
        };
    }

    /// Names the CPU, which drew what the device has too few digits for; says so unless that was `said`.
    pub(super) fn name_fine(&mut self, said: bool) {
        if !said {
            tracing::warn!(
                "the grid, or its transfer function, is too fine for the 32-bit floats of the device; the CPU draws it"
            );
        }
        (self.stats.device, self.stats.adapter) =
            ("cpu".into(), format!("{} threads", self.pool.current_num_threads()));
    }
}
