//! Frames of cropping regions: each of their boxes by itself, and what rays gather in one over what they do in those behind it.

use super::{Progress, Renderer, ms};
use crate::error::Result;
use crate::image::Image;
use crate::view::{Blend, View};
use rayon::prelude::*;
use std::time::Instant;

impl Renderer {
    /// Draws a frame, in parts if its view is cropped to regions.
    ///
    /// # Errors
    /// Those of [`Renderer::render`].
    pub(super) fn render_cropped(&mut self, view: &View, progress: &Progress) -> Result<Image> {
        let Some(parts) = view.parts() else { return self.render_or_recover(view, progress) };
        if let [one] = &parts[..] {
            return self.render_or_recover(one, progress);
        }
        let start = Instant::now();
        // The largest of several values is known by them, not by their colours.
        self.as_values = view.blend() == Blend::Maximum;
        let drawn = self.draw_parts(&parts, view, progress);
        let of_values = std::mem::replace(&mut self.as_values, false);
        let mut image = drawn?;
        if of_values {
            self.color(&mut image);
        }
        self.stats.frame_ms = ms(start);
        Ok(image)
    }

    fn draw_parts(&mut self, parts: &[View], whole: &View, progress: &Progress) -> Result<Image> {
        let mut image = Image::new(whole.size());
        let (mut steps, mut retraced, mut panels, count) = (0, 0, 0, parts.len() as f64);
        for (i, part) in parts.iter().enumerate() {
            let behind = self.render_or_recover(part, &|share| progress((i as f64 + share) / count))?;
            steps += self.stats.steps;
            retraced += self.stats.retraced_rays;
            panels += self.stats.panels;
            let maximum = self.as_values;
            image.pixels.par_iter_mut().zip(&behind.pixels).for_each(|(front, behind)| {
                if maximum {
                    if behind[3] != 0.0 && (front[3] == 0.0 || behind[3] > front[3]) {
                        *front = *behind;
                    }
                } else {
                    let transmittance = 1.0 - front[3];
                    (0..4).for_each(|k| front[k] += transmittance * behind[k]);
                }
            });
            if progress((i + 1) as f64 / count).is_break() {
                break;
            }
        }
        (self.stats.steps, self.stats.retraced_rays, self.stats.panels) = (steps, retraced, panels);
        Ok(image)
    }
}
