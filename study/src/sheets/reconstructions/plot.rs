//! The sheet of the study: curves along rays, and pictures.

use super::pictures::Pictures;
use super::signal::Line;
use crate::sheets::Sheet;
use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::prelude::{Drawable, Point, Primitive, RgbColor, WebColors};
use embedded_graphics::primitives::{Line as Stroke, PrimitiveStyle};
use halite::cast::{ReconstructionOrder, Sampling};
use halite::image::Image;

/// Pixels of a plot.
const SIZE: [usize; 2] = [250, 130];

/// Around plots and pictures, and the height of text above them.
const MARGIN: usize = 8;
const LINES: usize = 24;

/// Plots and pictures next to each other.
const COLUMNS: usize = 5;

/// A field along a ray, what stands for it, and where its samples are.
pub(super) struct Plot {
    caption: String,
    field: Vec<[f64; 2]>,
    rebuilt: Vec<[f64; 2]>,
    samples: Vec<[f64; 2]>,
    end: f64,
}

impl Plot {
    pub(super) fn new(
        caption: String,
        line: &Line,
        order: ReconstructionOrder,
        sampling: Sampling,
        of: impl Fn(f64) -> f64,
    ) -> Self {
        let rebuilt = line.rebuilt(order, sampling).into_iter().map(|[t, s]| [t, of(s)]).collect();
        let at = |t: f64| [t, of(line.at(t))];
        let field = (0..=1000).map(|i| at(line.end() * f64::from(i) / 1000.0)).collect();
        let ends = line.slabs(sampling).into_iter().flat_map(|[a, b]| [a, f64::midpoint(a, b)]);
        Plot { caption, field, rebuilt, samples: ends.map(at).collect(), end: line.end() }
    }

    fn draw(&self, sheet: &mut Sheet, [x, y]: [usize; 2]) {
        let all = || self.field.iter().chain(&self.rebuilt).map(|p| p[1]);
        let [lo, hi] = [all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max)];
        let over = 1.0 / (hi - lo).max(1e-9);
        let place = |[t, s]: [f64; 2]| {
            let [w, h] = SIZE.map(|n| n as f64 - 1.0);
            let down = (1.0 - (s - lo) * over) * h;
            Point::new((x as f64 + t / self.end * w) as i32, (y as f64 + LINES as f64 + down) as i32)
        };
        let curves = [(&self.field, Rgb888::WHITE), (&self.rebuilt, Rgb888::CSS_TOMATO)];
        for (curve, color) in curves {
            for w in curve.windows(2) {
                let stroke = Stroke::new(place(w[0]), place(w[1])).into_styled(PrimitiveStyle::with_stroke(color, 1));
                // Drawing on a picture in memory cannot fail.
                let Ok(()) = stroke.draw(sheet);
            }
        }
        for p in &self.samples {
            let at = place(*p);
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (-1, 0), (0, -1)] {
                let to = Point::new(at.x + dx, at.y + dy);
                let Ok(()) =
                    Stroke::new(to, to).into_styled(PrimitiveStyle::with_stroke(Rgb888::CSS_GOLD, 1)).draw(sheet);
            }
        }
        sheet.write([x, y], [&self.caption, "white: the field; red: what stands for it"]);
    }
}

/// All plots, and under them all pictures.
pub(super) fn sheet(plots: &[Plot], pictures: &Pictures) -> Image {
    let shown = pictures.shown();
    let [w, h] = shown.first().map_or([1, 1], |p| p.image.size.map(|n| n as usize));
    let across = [SIZE[0], w].map(|n| n + MARGIN);
    let wide = across[0].max(across[1]) * COLUMNS + MARGIN;
    let of_plots = plots.len().div_ceil(COLUMNS) * (SIZE[1] + LINES + MARGIN);
    let of_pictures = shown.len().div_ceil(COLUMNS) * (h + LINES + MARGIN);
    let mut sheet = Sheet(Image::new([wide as u32, (of_plots + of_pictures + MARGIN) as u32]));
    sheet.0.pixels.fill([0.2, 0.2, 0.2, 1.0]);
    for (i, plot) in plots.iter().enumerate() {
        let at = [MARGIN + i % COLUMNS * across[0], MARGIN + i / COLUMNS * (SIZE[1] + LINES + MARGIN)];
        plot.draw(&mut sheet, at);
    }
    for (i, picture) in shown.iter().enumerate() {
        let at = [MARGIN + i % COLUMNS * across[1], MARGIN + of_plots + i / COLUMNS * (h + LINES + MARGIN)];
        sheet.write(at, [&picture.caption, &picture.figures]);
        sheet.put(at, &picture.image, 1, picture.background);
    }
    sheet.0
}
