//! A colour bar, with numbers, title and opacities, drawn into a picture.

use embedded_graphics::mono_font::iso_8859_1::{FONT_6X10, FONT_9X15, FONT_10X20};
use embedded_graphics::mono_font::{MonoFont, MonoTextStyle};
use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::prelude::{DrawTarget, Drawable, OriginDimensions, Pixel, Point, RgbColor, Size};
use embedded_graphics::text::{Baseline, Text};
use halite::field::{Component, Field, Kind};
use halite::image::Image;
use halite::scene::Scalars;
use halite::transfer::{Axis, TransferFunction};

/// What a legend tells.
#[derive(Clone)]
pub struct Legend {
    /// What the numbers are of.
    pub title: String,
    /// The scalars that the bar ranges over.
    pub axis: Axis,
    /// Their colours, and opacities.
    pub transfer: TransferFunction,
    /// Whether the scalars drive the opacity, too.
    pub opacities: bool,
}

/// How much of what is behind the legend its panel hides.
const PANEL: f32 = 0.6;

/// Numbers on the bar, about.
const NUMBERS: f64 = 6.5;

impl Legend {
    /// The legend of `field`, which `scalars` are; none if its colours are its own, or there is one at most.
    pub fn new(scalars: &Scalars, field: &Field, transfer: &TransferFunction, log: bool) -> Option<Self> {
        let (first, last) = (transfer.color().first()?.0, transfer.color().last()?.0);
        if field.kind() == Kind::Rgba || first >= last || !transfer.has_knots() {
            return None;
        }
        let axis = if log { Axis::logarithmic([first, last]).ok()? } else { Axis::linear([first, last]) };
        let title = match scalars.component {
            Some(Component::Index(k)) if k > 0 => format!("{} [{k}]", scalars.name),
            _ => scalars.name.clone(),
        };
        Some(Legend { title, axis, transfer: transfer.clone(), opacities: field.kind() == Kind::Scalar })
    }

    /// Draws it at the right of `image`, whose `background` says whether it is light or dark.
    pub fn draw(&self, image: &mut Image, background: [f32; 3]) {
        let [w, h] = image.size.map(|n| n as usize);
        // Letters of pictures of many pixels are made of several each.
        let scale = (h / 1000).max(1);
        let font = match h / scale {
            0..360 => &FONT_6X10,
            360..760 => &FONT_9X15,
            _ => &FONT_10X20,
        };
        let light = background.iter().sum::<f32>() > 1.5;
        let ink = if light { [0.0; 3] } else { [1.0; 3] };
        let panel = if light { [1.0; 3] } else { [0.0; 3] };
        let [cw, ch] = [font.character_size.width, font.character_size.height].map(|n| n as usize * scale);
        let numbers: Vec<(f64, String)> = numbers(&self.axis);
        let most = self.most();
        let footer = if self.opacities { format!("opacity to {}", short(most)) } else { String::new() };
        let letters = numbers.iter().map(|n| n.1.chars().count()).max().unwrap_or(0);
        let (bar, plot) = (2 * cw, if self.opacities { 4 * cw } else { 0 });
        let wide =
            (plot + bar + cw + letters * cw).max(cw * self.title.chars().count()).max(cw * footer.chars().count());
        let high = h * 6 / 10;
        let margin = cw;
        let [left, top] = [w.saturating_sub(wide + 3 * margin), h.saturating_sub(high) / 2];
        let outer = [left, top.saturating_sub(2 * ch), w.saturating_sub(margin), (top + high + 2 * ch).min(h)];
        let mut canvas = Canvas { image, scale };
        canvas.fill(outer, panel, PANEL);
        let x = left + margin;
        canvas.write(font, [x, top.saturating_sub(ch + ch / 2)], &self.title, ink);
        for j in 0..high {
            let place = 1.0 - (j as f64 + 0.5) / high as f64;
            let s = self.axis.scalar(place);
            let color = self.transfer.color_at(s).map(|c| c.min(1.0) as f32);
            canvas.fill([x + plot, top + j, x + plot + bar, top + j + 1], color, 1.0);
            if self.opacities && most > 0.0 {
                let length = (self.transfer.opacity_at(s) / most * plot as f64) as usize;
                canvas.fill([x + plot - length.min(plot), top + j, x + plot, top + j + 1], ink, 0.45);
            }
        }
        for (place, number) in numbers {
            let y = top + ((1.0 - place) * (high as f64 - 1.0)).round() as usize;
            canvas.fill([x + plot + bar, y, x + plot + bar + cw / 2, y + scale], ink, 1.0);
            canvas.write(font, [x + plot + bar + cw, y.saturating_sub(ch / 2)], &number, ink);
        }
        canvas.write(font, [x, top + high + ch / 2], &footer, ink);
    }

    /// The largest opacity in the range.
    fn most(&self) -> f64 {
        let [lo, hi] = self.axis.range();
        let inner = self.transfer.opacity().iter().filter(|k| (lo..=hi).contains(&k.0)).map(|k| k.1);
        inner.chain([lo, hi].map(|s| self.transfer.opacity_at(s))).fold(0.0, f64::max)
    }
}

/// Places on the bar, and the numbers there: round ones.
pub fn numbers(axis: &Axis) -> Vec<(f64, String)> {
    let [lo, hi] = axis.range();
    if axis.is_logarithmic() {
        let decades = (hi / lo).log10();
        let every = (decades / NUMBERS).ceil().max(1.0) as i32;
        let (first, last) = (lo.log10().floor() as i32, hi.log10().ceil() as i32);
        let parts: &[f64] = if decades < 2.0 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let all = (first..=last).filter(|k| k % every == 0).flat_map(|k| parts.iter().map(move |p| p * 10_f64.powi(k)));
        let within = |s: &f64| *s >= lo * (1.0 - 1e-9) && *s <= hi * (1.0 + 1e-9);
        let numbers: Vec<(f64, String)> =
            all.filter(within).map(|s| (axis.place(s).clamp(0.0, 1.0), short(s))).collect();
        if numbers.len() > 1 {
            return numbers;
        }
        return [lo, hi].map(|s| (axis.place(s), short(s))).into();
    }
    let rough = (hi - lo) / NUMBERS;
    let power = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * power).find(|s| *s >= rough).unwrap_or(rough);
    let (first, count) = ((lo / step - 1e-9).ceil(), ((hi - lo) / step + 1e-9).floor() as i32);
    let value = |k: i32| (first + f64::from(k)) * step;
    let all = (0..=count).map(value).filter(|s| *s <= hi + 1e-9 * (hi - lo));
    let digits = digits_apart(step, lo.abs().max(hi.abs()));
    all.map(|s| (axis.place(s).clamp(0.0, 1.0), with_digits(s, step, digits))).collect()
}

/// Digits that tell numbers apart that differ by `step`, of which the largest is `most`.
fn digits_apart(step: f64, most: f64) -> usize {
    ((most / step).log10().floor() as i32 + 2).clamp(1, 17) as usize
}

/// `s` as a multiple of `step`, by so many digits.
fn with_digits(s: f64, step: f64, digits: usize) -> String {
    if s.abs() < 1e-9 * step {
        return "0".into();
    }
    let rounded: f64 = format!("{s:.*e}", digits - 1).parse().unwrap_or(s);
    plain(rounded)
}

/// Three digits.
fn short(s: f64) -> String {
    plain(format!("{s:.2e}").parse().unwrap_or(s))
}

fn plain(s: f64) -> String {
    if s == 0.0 || (1e-4..1e6).contains(&s.abs()) { format!("{s}") } else { format!("{s:e}") }
}

/// A picture that letters of several pixels are written on.
pub struct Canvas<'a> {
    /// What is drawn into.
    pub image: &'a mut Image,
    /// Pixels of a dot of the font.
    pub scale: usize,
}

impl Canvas<'_> {
    /// Covers what is between two corners with a colour, as opaque as `alpha`.
    pub fn fill(&mut self, [left, top, right, bottom]: [usize; 4], color: [f32; 3], alpha: f32) {
        let [w, h] = self.image.size.map(|n| n as usize);
        for y in top..bottom.min(h) {
            for p in &mut self.image.pixels[y * w..][left.min(w)..right.clamp(left.min(w), w)] {
                let behind = 1.0 - alpha;
                *p = [0, 1, 2, 3].map(|k| if k < 3 { alpha * color[k] + behind * p[k] } else { alpha + behind * p[3] });
            }
        }
    }

    /// Writes `text` below and right of a corner.
    pub fn write(&mut self, font: &MonoFont, [x, y]: [usize; 2], text: &str, ink: [f32; 3]) {
        let [r, g, b] = ink.map(|c| (c * 255.0) as u8);
        let style = MonoTextStyle::new(font, Rgb888::new(r, g, b));
        let at = [x, y].map(|n| (n / self.scale) as i32);
        // Writing on a picture in memory cannot fail.
        let Ok(_) = Text::with_baseline(text, Point::new(at[0], at[1]), style, Baseline::Top).draw(self);
    }
}

impl OriginDimensions for Canvas<'_> {
    fn size(&self) -> Size {
        let scale = self.scale as u32;
        Size::new(self.image.size[0] / scale, self.image.size[1] / scale)
    }
}

impl DrawTarget for Canvas<'_> {
    type Color = Rgb888;
    type Error = std::convert::Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb888>>>(&mut self, pixels: I) -> Result<(), Self::Error> {
        for Pixel(Point { x, y }, color) in pixels {
            if x >= 0 && y >= 0 {
                let [x, y] = [x, y].map(|n| n as usize * self.scale);
                let color = [color.r(), color.g(), color.b()].map(|c| f32::from(c) / 255.0);
                self.fill([x, y, x + self.scale, y + self.scale], color, 1.0);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_round() {
        let of = |axis: Axis| numbers(&axis).into_iter().map(|n| n.1).collect::<Vec<_>>();
        assert_eq!(of(Axis::linear([0.0, 1.0])), ["0", "0.2", "0.4", "0.6", "0.8", "1"]);
        assert_eq!(of(Axis::linear([-3.3, 8.8])), ["-2", "0", "2", "4", "6", "8"].map(String::from));
        assert_eq!(of(Axis::linear([293.15, 913.15])), ["300", "400", "500", "600", "700", "800", "900"]);
        assert_eq!(of(Axis::linear([1e6 + 0.25, 1e6 + 0.75])).len(), 5);
        assert_eq!(of(Axis::linear([0.0, 5e9]))[1], "1e9");
        assert_eq!(of(Axis::logarithmic([1e-3, 1e3]).unwrap()), ["0.001", "0.01", "0.1", "1", "10", "100", "1000"]);
        assert_eq!(of(Axis::logarithmic([0.9, 12.0]).unwrap()), ["1", "2", "5", "10"]);
        assert_eq!(of(Axis::logarithmic([1.1, 1.3]).unwrap()), ["1.1", "1.3"]);
        assert!(of(Axis::logarithmic([1e-20, 1.0]).unwrap()).len() < 8);
    }
}
