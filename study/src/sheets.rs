//! `halite study`: variants beside what is published.

mod bivariate;
mod forms;
mod orders;
mod reconstructions;

use anyhow::{Context, Result, bail};
use clap::Args;
use embedded_graphics::mono_font::{MonoTextStyle, ascii::FONT_6X10};
use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::prelude::{DrawTarget, Drawable, OriginDimensions, Pixel, Point, RgbColor, Size};
use embedded_graphics::text::{Baseline, Text};
use halite::gpu::DeviceChoice;
use halite::image::{Backdrop, Image};
use halite::integral::options::{Form, IntegrationOptions, Texels};
use halite::integral::table::Kind;
use halite::project::{CellOrder, Fragments, ProjectionOptions, Target, Thickness};
use halite::render::Renderer;
use halite::view::View;
use halite_console::request::{self, Job, Request};
use halite_console::{output, parse, progress};
use serde_json::json;
use std::path::PathBuf;

/// Compare the variants of the projection engine in one picture
///
/// Draws with each published variant and its cure (Kraus, Qiao & Ebert 2004), and writes a sheet of all pictures, each
/// above its difference from the traverse engine's, with error and time.
#[derive(Args)]
pub struct Options {
    #[command(flatten)]
    request: Request,
    /// The sheet: .png
    #[arg(short, long, value_name = "FILE")]
    out: PathBuf,
    /// Frames drawn with each variant, besides the first; times are medians
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    frames: u32,
    /// How much differences are magnified
    #[arg(long, value_name = "GAIN", default_value_t = 10.0, value_parser = parse::gain)]
    gain: f32,
    /// Compare the forms of the integral instead, in both engines: the exact one and all tables
    #[arg(long)]
    integrals: bool,
    /// Compare the orders of cells instead: where each is wrong, and what it takes
    #[arg(long, conflicts_with = "integrals")]
    orders_of_cells: bool,
    /// Other meshes to compare orders of cells, or functions of two variables, on, as with the first; regular and rectilinear grids among them are passed over
    #[arg(long, value_name = "FILE", num_args = 1..)]
    also: Vec<PathBuf>,
    /// Compare the orders of reconstruction of regular and rectilinear grids instead: figures and claims of El Hajjar et al. (2008).
    /// The first volume is that of which tables are timed; names that begin with "synth" are of stand-ins
    #[arg(long, conflicts_with_all = ["integrals", "orders_of_cells"])]
    orders: bool,
    /// Compare functions of two variables with those of one instead, in closed form and in pieces: table 1 and the figures of Song et
    /// al. (2009). The figures are of the first mesh
    #[arg(long, conflicts_with_all = ["integrals", "orders_of_cells", "orders"])]
    bivariate: bool,
    /// Another volume to compare orders on; may be given again
    #[arg(long = "volume", value_name = "FILE", requires = "orders")]
    volumes: Vec<PathBuf>,
    /// Write errors and times as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// A variant, what it is called, and the published figure or table that it stands in.
struct Variant {
    name: &'static str,
    place: &'static str,
    projection: ProjectionOptions,
    integral: IntegrationOptions,
}

/// What a variant gave.
struct Row {
    variant: Variant,
    image: Image,
    max: f64,
    rmse: f64,
    order_ms: f64,
    project_ms: Option<f64>,
    /// A frame with a camera that stands still: projecting and drawing.
    frame_ms: f64,
    cells: u64,
    fragments: Option<u64>,
}

/// Pictures next to each other on a sheet, and the widest of them, in pixels.
const COLUMNS: usize = 5;
const WIDEST: u32 = 256;

/// Around a picture, and the height of its two lines of text.
const MARGIN: usize = 6;
const LINES: usize = 24;

/// From the fewest enhancements to the most, then what else can be switched; with tables of this size, if it was said.
fn variants(table: Option<[u32; 3]>) -> Vec<Variant> {
    let best = ProjectionOptions::default();
    let volume = |lengths, texels| {
        IntegrationOptions::of(Form::Volume).with_lengths(lengths).with_texels(texels).with_table(table)
    };
    let (uniform, log) = (volume(Kind::Uniform, Texels::Unorm16), volume(Kind::Log, Texels::Unorm16));
    let interpolated = best.with_fragments(Fragments::Interpolated);
    let linear = best.with_fragments(Fragments::Linear);
    let eight = |projection: ProjectionOptions| projection.with_target(Target::Rgba8);
    let frame_buffer = eight(interpolated);
    let exact = IntegrationOptions::default();
    let variant = |name, place, projection, integral| Variant { name, place, projection, integral };
    vec![
        variant("basic", "table 1 i", eight(linear), volume(Kind::Uniform, Texels::Unorm8)),
        variant("+ perspective", "table 1 ii", frame_buffer, volume(Kind::Uniform, Texels::Unorm8)),
        variant("+ 16-bit table", "table 1 iii", frame_buffer, uniform),
        variant("+ logarithmic", "table 1 iv, figure 9a", frame_buffer, log),
        variant("+ alpha dithering", "table 1, figure 9b", frame_buffer.with_dither(true), log),
        variant("+ 32-bit float target", "table 1, figures 7c 8b 9c 10b", interpolated, log),
        variant("16-bit float target", "", interpolated.with_target(Target::Rgba16float), log),
        variant("8-bit table", "figure 7a", interpolated, volume(Kind::Log, Texels::Unorm8)),
        variant("8-bit target", "figure 7b", frame_buffer, log),
        variant("screen-linear", "figure 8a", linear, log),
        variant("thickness by depth", "", interpolated.with_thickness(Thickness::Depth), log),
        variant("uniform thickness", "figure 10a", interpolated, uniform),
        variant("log-normalised, float", "", interpolated, volume(Kind::LogNormalised, Texels::Float)),
        variant("interpolated, exact", "", interpolated, exact),
        variant("intersected, exact", "", best, exact),
        variant("by depth", "", best.with_order(CellOrder::Depth), exact),
        variant("by circumspheres", "", best.with_order(CellOrder::Circumsphere), exact),
        variant("not sorted", "", best.with_order(CellOrder::None), exact),
    ]
}

/// Draws what the options ask for, and writes the sheet and the figures.
///
/// # Errors
/// Misuse of options, scenes that cannot be read or drawn, and files that cannot be written.
pub fn run(options: &Options, threads: usize) -> Result<()> {
    output::check_picture(&options.out)?;
    if let Some(path) = &options.json {
        output::check(path)?;
    }
    let of_several = options.orders_of_cells || options.bivariate;
    if !of_several && !options.also.is_empty() {
        return Err(output::misuse("--also: other meshes are for --orders-of-cells and --bivariate"));
    }
    if options.bivariate {
        return bivariate::run(options, threads);
    }
    if options.orders {
        return reconstructions::run(options, threads);
    }
    if options.integrals {
        return forms::run(options, threads);
    }
    if options.orders_of_cells {
        return orders::run(options, threads);
    }
    let given = options.request.scene()?;
    let size = options.request.studied(given.as_ref())?.or(Some([256, 256, 16]));
    let device = options.request.device(given.as_ref());
    let mut reference = Renderer::with_device(threads, DeviceChoice::Cpu)?;
    let job = reference.install(|| request::prepare(&options.request, given)?.of_mesh("study"))?;
    let (view, _) = job.scene.view()?;
    let mut renderer = Renderer::with_engine(threads, device, halite::render::Engine::Project)?;
    let truth = progress::during("judging", |p| {
        set(&mut reference, &job)?;
        reference.render(&view, p)
    })?;
    set(&mut renderer, &job)?;
    let all = variants(size);
    let (count, mut rows) = (all.len() as f64, Vec::new());
    progress::during("drawing", |p| {
        for (i, variant) in all.into_iter().enumerate() {
            p(i as f64 / count);
            let name = variant.name;
            match draw(variant, options.frames, &mut renderer, &view, &truth) {
                Ok(row) => rows.push(row),
                // A variant that the device or the field rules out is no reason to keep the others back.
                Err(e) => tracing::warn!("{name}: {}", e.to_string().replace('\n', " ")),
            }
        }
    });
    check(&rows)?;
    let tetrahedra = renderer.stats().tetrahedra;
    output::print(&table(&rows, tetrahedra))?;
    let background = job.scene.background.unwrap_or_default().map(|c| c as f32);
    sheet(&rows, &truth, background, options.gain).save(&options.out, Backdrop::Color(background))?;
    if let Some(path) = &options.json {
        let stats = renderer.stats();
        let rows: Vec<_> = rows
            .iter()
            .map(|r| {
                json!({
                    "variant": r.variant.name, "stands_in": r.variant.place, "switches": r.variant.projection,
                    "integral": r.variant.integral,
                    "max": r.max, "rmse": r.rmse, "order_ms": r.order_ms, "project_ms": r.project_ms, "frame_ms": r.frame_ms,
                    "drawn_cells": r.cells, "fragments": r.fragments, "tetrahedra_per_s": r.rate(tetrahedra),
                })
            })
            .collect();
        let whole = json!({
            "adapter": stats.adapter, "size": job.scene.size, "tetrahedra": tetrahedra, "variants": rows,
        });
        std::fs::write(path, format!("{whole:#}\n")).with_context(|| path.display().to_string())?;
    }
    Ok(())
}

/// Fails where not even one variant could be drawn: each has said why.
fn check<T>(rows: &[T]) -> Result<()> {
    if rows.is_empty() { bail!("no variant can be drawn of this scene") } else { Ok(()) }
}

fn set(renderer: &mut Renderer, job: &Job) -> halite::Result<()> {
    renderer.set_tetrahedra(&job.mesh, job.tetrahedra.clone());
    renderer.set_field(&job.field)?;
    renderer.set_transfer(&job.scene.transfer);
    Ok(())
}

fn draw(variant: Variant, frames: u32, renderer: &mut Renderer, view: &View, truth: &Image) -> halite::Result<Row> {
    renderer.set_integral(variant.integral);
    // Whatever the last variant left: each sorts for itself, and finds the sequence of the mesh if it draws in such.
    let other = match variant.projection.order {
        CellOrder::MpvoConvex => CellOrder::Mpvonc,
        CellOrder::Mpvo | CellOrder::Mpvonc | CellOrder::Xmpvo => CellOrder::MpvoConvex,
        CellOrder::Depth | CellOrder::Circumsphere | CellOrder::None => CellOrder::None,
    };
    renderer.set_projection(variant.projection.with_order(other).with_fragments(Fragments::Intersected));
    if variant.projection.order != CellOrder::None {
        renderer.render(view, &|_| ())?;
    }
    renderer.set_projection(variant.projection);
    let image = renderer.render(view, &|_| ())?;
    let order_ms = renderer.stats().projection.map_or(0.0, |p| p.order_ms);
    let row = Row::measured(variant, image, truth, frames, renderer, view)?;
    let projection = renderer.stats().projection.unwrap_or_default();
    let (cells, fragments, project_ms) = (projection.drawn_cells, projection.fragments, projection.project_ms);
    Ok(Row { order_ms, project_ms, cells, fragments, ..row })
}

impl Row {
    /// The errors of `image`, and the time of as many `frames` of it more; nothing of the projection.
    fn measured(
        variant: Variant,
        image: Image,
        truth: &Image,
        frames: u32,
        renderer: &mut Renderer,
        view: &View,
    ) -> halite::Result<Self> {
        let mut times = Vec::new();
        for _ in 0..frames {
            renderer.render(view, &|_| ())?;
            times.push(renderer.stats().frame_ms);
        }
        times.sort_by(f64::total_cmp);
        let frame_ms = times[times.len() / 2];
        let (max, rmse) = image.compare(truth).map_or((f64::INFINITY, f64::INFINITY), |d| (d.max, d.rmse));
        Ok(Row { variant, image, max, rmse, order_ms: 0.0, project_ms: None, frame_ms, cells: 0, fragments: None })
    }

    /// Tetrahedra of the mesh over the time of a frame whose camera moved, in 1/s.
    fn rate(&self, tetrahedra: u64) -> f64 {
        tetrahedra as f64 * 1e3 / (self.order_ms + self.frame_ms)
    }
}

fn table(rows: &[Row], tetrahedra: u64) -> String {
    let mut text = format!(
        "{:24} {:>9} {:>9} {:>10} {:>10} {:>10} {:>9} {:>10}  {}\n",
        "variant", "max", "rmse", "order ms", "project ms", "frame ms", "tets/s", "fragm./s", "as in"
    );
    for r in rows {
        let fragments = match r.fragments {
            Some(n) => format!("{:.1} M", n as f64 / r.frame_ms / 1e3),
            None => "-".into(),
        };
        text += &format!(
            "{:24} {:>9.1e} {:>9.1e} {:>10.1} {:>10} {:>10.1} {:>7.0} k {:>10}  {}\n",
            r.variant.name,
            r.max,
            r.rmse,
            r.order_ms,
            r.project_ms.map_or("-".into(), |ms| format!("{ms:.1}")),
            r.frame_ms,
            r.rate(tetrahedra) / 1e3,
            fragments,
            r.variant.place
        );
    }
    text
}

/// All pictures, each above its difference from `truth` times `gain`.
fn sheet(rows: &[Row], truth: &Image, background: [f32; 3], gain: f32) -> Image {
    let step = truth.size[0].div_ceil(WIDEST) as usize;
    let [w, h] = truth.size.map(|n| (n as usize / step).max(1));
    let (across, down) = (w.max(150) + MARGIN, LINES + 2 * (h + MARGIN));
    let columns = COLUMNS.min(rows.len() + 1);
    let size = [columns * across + MARGIN, (rows.len() + 1).div_ceil(columns) * down + MARGIN];
    let mut sheet = Sheet(Image::new(size.map(|n| n as u32)));
    sheet.0.pixels.fill([0.2, 0.2, 0.2, 1.0]);
    let corner = |i: usize| [MARGIN + i % columns * across, MARGIN + i / columns * down];
    sheet.write(corner(0), ["traverse", "the truth here"]);
    sheet.put(corner(0), truth, step, background);
    for (i, row) in rows.iter().enumerate() {
        let at = corner(i + 1);
        let figures = format!("{:.1e} {:.1e} {:.0} ms", row.max, row.rmse, row.order_ms + row.frame_ms);
        sheet.write(at, [row.variant.name, &figures]);
        sheet.put(at, &row.image, step, background);
        if let Some(difference) = row.image.difference(truth, gain) {
            sheet.put([at[0], at[1] + h + MARGIN], &difference, step, [0.0; 3]);
        }
    }
    sheet.0
}

/// A picture that text can be written on.
struct Sheet(Image);

impl Sheet {
    fn write(&mut self, [x, y]: [usize; 2], lines: [&str; 2]) {
        let style = MonoTextStyle::new(&FONT_6X10, Rgb888::WHITE);
        for (k, line) in lines.into_iter().enumerate() {
            let at = Point::new(x as i32, (y + 11 * k) as i32);
            // Writing on a picture in memory cannot fail.
            let Ok(_) = Text::with_baseline(line, at, style, Baseline::Top).draw(self);
        }
    }

    /// Every `step`-th pixel of `image`, over `background`, below the text at this corner.
    fn put(&mut self, [x, y]: [usize; 2], image: &Image, step: usize, background: [f32; 3]) {
        let [w, h] = image.size.map(|n| (n as usize / step).max(1));
        for (i, j) in (0..h).flat_map(|j| (0..w).map(move |i| (i, j))) {
            let p = image.pixels[j * step * image.size[0] as usize + i * step];
            let [r, g, b] = [0, 1, 2].map(|k| p[k] + (1.0 - p[3]) * background[k]);
            let at = (y + LINES + j) * self.0.size[0] as usize + x + i;
            self.0.pixels[at] = [r, g, b, 1.0];
        }
    }
}

impl OriginDimensions for Sheet {
    fn size(&self) -> Size {
        Size::new(self.0.size[0], self.0.size[1])
    }
}

impl DrawTarget for Sheet {
    type Color = Rgb888;
    type Error = std::convert::Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb888>>>(&mut self, pixels: I) -> Result<(), Self::Error> {
        let [w, h] = self.0.size;
        for Pixel(Point { x, y }, color) in pixels {
            if (0..w as i32).contains(&x) && (0..h as i32).contains(&y) {
                let [r, g, b] = [color.r(), color.g(), color.b()].map(|c| f32::from(c) / 255.0);
                self.0.pixels[y as usize * w as usize + x as usize] = [r, g, b, 1.0];
            }
        }
        Ok(())
    }
}
