//! `halite histogram`: how much of a mesh has which scalar and gradient, as a picture.

use anyhow::{Context, Result};
use clap::Args;
use embedded_graphics::mono_font::iso_8859_1::FONT_6X10;
use halite::field::histogram::Histogram;
use halite::gpu::DeviceChoice;
use halite::image::{Backdrop, Image};
use halite::render::Renderer;
use halite::transfer::Axis;
use halite::transfer::bivariate::{Bivariate, Source, Widget};
use halite_console::legend::{Canvas, numbers};
use halite_console::output;
use halite_console::request::{self, Request};
use std::path::PathBuf;

/// Draw the joint histogram of a scalar and its gradient's length
///
/// Each pixel is as bright as the logarithm of the volume that has such values: shapes of it are where --widget finds
/// something to show. Widgets that are given, or that a scene has, are drawn on it. --gradient-array takes the gradient's place.
#[derive(Args)]
pub(crate) struct Options {
    #[command(flatten)]
    request: Request,
    /// The picture: .png, .exr or .npy
    #[arg(short, long, value_name = "FILE")]
    out: PathBuf,
}

/// Columns and rows of bins, if nobody says a size: each is a pixel.
const BINS: [u32; 2] = [512, 384];

/// Pixels left of and below the bins, for numbers, and on the other sides.
const NUMBERS: [usize; 2] = [56, 28];
const MARGIN: usize = 16;

/// Of the greatest volume, what is as dark as nothing: six decades are seen.
const LEAST: f64 = 1e-6;

pub(crate) fn run(options: &Options, threads: usize) -> Result<()> {
    output::check_picture(&options.out)?;
    let given = options.request.scene()?;
    let size = options.request.size.unwrap_or(BINS).map(|n| n as usize);
    let renderer = Renderer::with_device(threads, DeviceChoice::Cpu)?;
    let image = renderer.install(|| {
        let job = request::prepare(&options.request, given)?;
        let histogram = match &job.grid {
            Some(grid) => halite::cast::histogram(grid, &job.field, size),
            None => {
                let points = job.tetrahedra.points(job.mesh.points());
                Histogram::new(&points, &job.tetrahedra, &job.field, size)
            }
        };
        let histogram = histogram.with_context(|| options.request.name().display().to_string())?;
        let widgets = match job.scene.transfer.bivariate().map(Bivariate::source) {
            Some(Source::Widgets(widgets)) => &widgets[..],
            _ => &[],
        };
        Ok::<_, anyhow::Error>(picture(&histogram, widgets))
    })?;
    Ok(image.save(&options.out, Backdrop::Color([0.0; 3]))?)
}

/// The histogram, from the least g below, with axes and widgets.
fn picture(histogram: &Histogram, widgets: &[Widget]) -> Image {
    let [columns, rows] = histogram.size;
    let [left, below] = NUMBERS;
    let mut image = Image::new([left + columns + MARGIN, MARGIN + rows + below].map(|n| n as u32));
    let wide = image.size[0] as usize;
    image.pixels.fill([0.0, 0.0, 0.0, 1.0]);
    let most = histogram.volumes.iter().fold(0.0, |most: f64, v| most.max(*v));
    let place = |k: usize, share: f64| {
        let [lo, hi] = histogram.ranges[k];
        lo + (hi - lo) * share
    };
    for row in 0..rows {
        for column in 0..columns {
            let volume = histogram.volumes[column + columns * row];
            let bright = if volume > 0.0 { 1.0 - (volume / most).log10() / LEAST.log10() } else { 0.0 };
            let at = [place(0, (column as f64 + 0.5) / columns as f64), place(1, (row as f64 + 0.5) / rows as f64)];
            // Grey of at least a tenth wherever there is anything, and the widgets' light over it.
            let grey = if volume > 0.0 { (0.1 + 0.9 * bright.max(0.0)) * 0.8 } else { 0.0 };
            let mut color = [grey; 3];
            for widget in widgets {
                let a = 0.6 * (widget.opacity_at(at) / widget.opacity.max(f64::MIN_POSITIVE)).min(1.0);
                color = std::array::from_fn(|k| a * widget.color[k] + (1.0 - a) * color[k]);
            }
            let [r, g, b] = color.map(|c| c as f32);
            image.pixels[(MARGIN + rows - 1 - row) * wide + left + column] = [r, g, b, 1.0];
        }
    }
    axes(&mut image, histogram);
    image
}

/// Lines along the bins, with round numbers.
fn axes(image: &mut Image, histogram: &Histogram) {
    let [columns, rows] = histogram.size;
    let [left, _] = NUMBERS;
    let (ink, letter) = ([0.8; 3], 6);
    let bottom = MARGIN + rows;
    let mut canvas = Canvas { image, scale: 1 };
    canvas.fill([left - 1, MARGIN, left, bottom + 1], ink, 1.0);
    canvas.fill([left - 1, bottom, left + columns, bottom + 1], ink, 1.0);
    for (share, text) in numbers(&Axis::linear(histogram.ranges[0])) {
        let x = left + (share * (columns as f64 - 1.0)).round() as usize;
        canvas.fill([x, bottom, x + 1, bottom + 5], ink, 1.0);
        canvas.write(&FONT_6X10, [x.saturating_sub(text.len() * letter / 2), bottom + 8], &text, ink);
    }
    for (share, text) in numbers(&Axis::linear(histogram.ranges[1])) {
        let y = MARGIN + ((1.0 - share) * (rows as f64 - 1.0)).round() as usize;
        canvas.fill([left - 5, y, left, y + 1], ink, 1.0);
        canvas.write(&FONT_6X10, [left.saturating_sub(8 + text.len() * letter), y.saturating_sub(5)], &text, ink);
    }
}
