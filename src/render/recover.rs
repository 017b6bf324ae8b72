//! What happens when a device fails: it is opened again, or the CPU takes its place.

use super::backend::Backend;
use super::{Progress, Renderer};
use crate::cast::gpu::Caster;
use crate::error::{Error, Result};
use crate::gpu::DeviceChoice;
use crate::image::Image;
use crate::memory;
use crate::view::View;

impl Renderer {
    /// Draws a frame. A device that was lost is opened again; where a device fails that nobody named, the CPU draws.
    ///
    /// # Errors
    /// Those of [`Renderer::render`].
    pub(super) fn render_or_recover(&mut self, view: &View, progress: &Progress) -> Result<Image> {
        let [w, h] = view.size();
        let pixels = u64::from(w) * u64::from(h) * size_of::<[f32; 4]>() as u64;
        memory::check(&format!("a picture of {w}x{h} pixels"), pixels)?;
        match self.try_render(view, progress) {
            Err(Error::Lost(why)) => {
                tracing::warn!("{why}; opening it again");
                self.caster = Caster::default();
                match Backend::open(self.engine, &self.choice) {
                    Ok(backend) => self.backend = backend,
                    Err(_) if self.backend.may_fall_back() => self.backend = Backend::without_device(self.engine),
                    Err(e) => return Err(e),
                }
                self.name_device();
                tracing::warn!("now drawing on {} ({})", self.stats.device, self.stats.adapter);
            }
            Err(e @ (Error::Memory { .. } | Error::Device(_)))
                if self.choice == DeviceChoice::Auto && self.backend.may_fall_back() =>
            {
                self.draw_on_cpu(&e);
            }
            done => return done,
        }
        match self.try_render(view, progress) {
            Err(e @ Error::Lost(_)) if self.backend.may_fall_back() => {
                self.draw_on_cpu(&e);
                self.try_render(view, progress)
            }
            done => done,
        }
    }

    /// Draws on the CPU from now on.
    pub(crate) fn draw_on_cpu(&mut self, why: &Error) {
        tracing::warn!("{why}; now drawing on the CPU");
        self.caster = Caster::default();
        self.backend = Backend::without_device(self.engine);
        self.name_device();
    }
}
