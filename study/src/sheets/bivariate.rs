//! Functions of two variables: table 1, the figures and the equations of Song, Chen, Maciejewski, Gaither & Ebert (2009), with
//! errors.

mod places;
mod published;

use super::{Options, Row, Sheet, Variant, check, set};
use anyhow::{Context, Result};
use halite::gpu::DeviceChoice;
use halite::image::{Backdrop, Image};
use halite::integral::options::{Culling, IntegrationOptions, Method, Silhouettes, Two, Weights};
use halite::project::ProjectionOptions;
use halite::render::{Engine, Renderer};
use halite::scene::Scene;
use halite::transfer::TransferFunction;
use halite::view::View;
use halite_console::request::{self, Job};
use halite_console::{output, progress};
use places::{As, Places};
use published::Published;
use serde_json::{Value, json};
use std::path::Path;

/// Frames in a second of one variable, of a Gaussian in closed form and of one in pieces, by what the names of files begin with:
/// Song et al. 2009, table 1, on a graphics card of 2007.
const TABLE_1: [(&str, [f64; 3]); 3] = [
    ("bluntfin_tet", [1.27, 0.16, 0.91]),
    ("synth_heat_sink", [1.91, 0.23, 1.00]),
    ("synth_tapered_cylinder", [0.42, 0.07, 0.36]),
];

/// Pieces of a segment in their figure 7.
const PIECES: u32 = 10;

/// Pictures side by side on the sheet, and the room around them and for their text, in pixels.
const COLUMNS: usize = 6;
const MARGIN: usize = 6;
const LINES: usize = 24;

/// What a mesh gave.
struct Studied {
    name: String,
    tetrahedra: u64,
    rows: Vec<Row>,
    culled: Vec<u64>,
    /// Gradients of all points, in ms.
    gradients_ms: f64,
    published: Vec<Published>,
}

/// A picture of the sheet, and what it should be.
struct Figure {
    name: &'static str,
    place: &'static str,
    image: Image,
    truth: Image,
    max: f64,
    rmse: f64,
    frame_ms: f64,
}

/// A segment's integral in another form.
fn two(method: Method, weights: Weights, culling: Culling) -> IntegrationOptions {
    IntegrationOptions::default()
        .with_two(Two::default().with_method(method).with_pieces(PIECES).with_weights(weights).with_culling(culling))
}

/// The rows of the table: those after the first are of the Gaussian.
fn variants() -> Vec<Variant> {
    let (adaptive, closed, hull) = (Method::Adaptive, Weights::Closed, Culling::Hull);
    let variant = |name, place, integral| Variant { name, place, projection: ProjectionOptions::default(), integral };
    vec![
        variant("one variable", "table 1, 1D", IntegrationOptions::default()),
        variant("adaptive", "", two(adaptive, closed, hull)),
        variant("analytic", "table 1, analytic", two(Method::Analytic, closed, hull)),
        variant("10 pieces, texture", "table 1, approximate", two(Method::Segmented, Weights::Texture, hull)),
        variant("10 pieces, closed form", "equations 2 and 3", two(Method::Segmented, closed, hull)),
        variant("culled by corners", "section 3.1", two(adaptive, closed, Culling::Corners)),
        variant("not culled", "", two(adaptive, closed, Culling::None)),
    ]
}

pub(super) fn run(options: &Options, threads: usize) -> Result<()> {
    let given = options.request.scene()?;
    let mut judge = Renderer::with_engine(threads, DeviceChoice::Cpu, Engine::Traverse)?;
    let mut renderer = Renderer::with_engine(threads, DeviceChoice::Cpu, Engine::Project)?;
    let job = judge.install(|| request::prepare(&options.request, given.clone())?.of_mesh("study"))?;
    let first = given.as_ref().map_or(&options.request.input, |scene: &Scene| &scene.mesh).clone();
    let (studied, places) = studied(options, &first, &job, &mut judge, &mut renderer)?;
    output::print(&table(&studied))?;
    let mut all = vec![studied];
    let figures = figures(options, &job, &places, &mut judge, &mut renderer)?;
    output::print(&described(&figures))?;
    let background = job.scene.background.unwrap_or_default().map(|c| c as f32);
    drop(job);
    for path in &options.also {
        let request = options.request.of(path.clone());
        let job = judge.install(|| request::prepare(&request, None))?;
        if job.grid.is_some() {
            tracing::warn!("{}: passed over, as it is a regular or rectilinear grid", path.display());
            continue;
        }
        let (studied, _) = self::studied(options, path, &job, &mut judge, &mut renderer)?;
        output::print(&table(&studied))?;
        all.push(studied);
    }
    output::print(&rates(&all))?;
    sheet(&figures, background, options.gain).save(&options.out, Backdrop::Color(background))?;
    if let Some(path) = &options.json {
        let whole = json!({
            "meshes": all.iter().map(Studied::report).collect::<Vec<_>>(),
            "figures": figures.iter().map(Figure::report).collect::<Vec<_>>(),
        });
        std::fs::write(path, format!("{whole:#}\n")).with_context(|| path.display().to_string())?;
    }
    Ok(())
}

/// The mesh at `path` with one variable, and with a Gaussian in each form.
fn studied(
    options: &Options,
    path: &Path,
    job: &Job,
    judge: &mut Renderer,
    renderer: &mut Renderer,
) -> Result<(Studied, Places)> {
    let (view, _) = job.scene.view()?;
    let (places, gradient, gradients_ms) = judge.install(|| Places::new(job))?;
    let published = Published::all(job, &places, &gradient);
    drop(gradient);
    set(judge, job)?;
    set(renderer, job)?;
    let (one, gaussian) = (places.bands()?, places.gaussian()?);
    let (mut rows, mut culled) = (vec![], vec![]);
    progress::during("drawing", |p| {
        let mut truth = None;
        let all = variants();
        let count = all.len() as f64;
        for (i, variant) in all.into_iter().enumerate() {
            p(i as f64 / count);
            let transfer = if i == 0 { &one } else { &gaussian };
            if i < 2 {
                truth = Some(picture(judge, transfer, IntegrationOptions::default(), &view)?);
            }
            let image = picture(renderer, transfer, variant.integral, &view)?;
            culled.push(renderer.stats().culled_cells);
            if let Some(truth) = &truth {
                rows.push(Row::measured(variant, image, truth, options.frames, renderer, &view)?);
            }
        }
        Ok::<_, halite::Error>(())
    })?;
    check(&rows)?;
    let name = path.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
    let tetrahedra = renderer.stats().tetrahedra;
    Ok((Studied { name, tetrahedra, rows, culled, gradients_ms, published }, places))
}

fn picture(
    renderer: &mut Renderer,
    transfer: &TransferFunction,
    integral: IntegrationOptions,
    view: &View,
) -> halite::Result<Image> {
    renderer.set_integral(integral);
    renderer.set_transfer(transfer);
    renderer.render(view, &|_| ())
}

/// Their figures on this mesh.
fn figures(
    options: &Options,
    job: &Job,
    places: &Places,
    judge: &mut Renderer,
    renderer: &mut Renderer,
) -> Result<Vec<Figure>> {
    let (view, _) = job.scene.view()?;
    let all = places.figures()?;
    let count = all.len() as f64;
    let drawn = progress::during("drawing figures", |p| {
        let draw = |(i, (name, place, transfer, drawn)): (usize, places::Shown)| {
            p(i as f64 / count);
            let truth = picture(judge, &transfer, IntegrationOptions::default(), &view)?;
            let mut integral = match drawn {
                As::Pieces => two(Method::Segmented, Weights::Texture, Culling::Hull),
                As::Exact | As::Silhouettes => IntegrationOptions::default(),
            };
            if drawn == As::Silhouettes {
                integral.two.silhouettes = Silhouettes::Published;
            }
            let image = picture(renderer, &transfer, integral, &view)?;
            let variant = Variant { name, place, projection: ProjectionOptions::default(), integral };
            let Row { image, max, rmse, frame_ms, .. } =
                Row::measured(variant, image, &truth, options.frames, renderer, &view)?;
            Ok(Figure { name, place, image, truth, max, rmse, frame_ms })
        };
        all.into_iter().enumerate().map(draw).collect::<halite::Result<Vec<_>>>()
    })?;
    Ok(drawn)
}

impl Studied {
    /// Frames in a second of the row of this name.
    fn rate(&self, name: &str) -> Option<f64> {
        self.rows.iter().find(|r| r.variant.name == name).map(|r| 1e3 / r.frame_ms)
    }

    fn report(&self) -> Value {
        let row = |(r, culled): (&Row, &u64)| {
            json!({
                "variant": r.variant.name, "stands_in": r.variant.place, "integral": r.variant.integral,
                "max": r.max, "rmse": r.rmse, "frame_ms": r.frame_ms, "culled_cells": culled,
            })
        };
        let rows: Vec<_> = self.rows.iter().zip(&self.culled).map(row).collect();
        let reported = TABLE_1.iter().find(|(name, _)| self.name.starts_with(name)).map(|known| known.1);
        json!({
            "mesh": self.name, "tetrahedra": self.tetrahedra, "gradients_ms": self.gradients_ms, "variants": rows,
            "reported_frames_per_s": reported, "published": self.published.iter().map(Published::report).collect::<Vec<_>>(),
        })
    }
}

impl Figure {
    fn report(&self) -> Value {
        let Figure { name, place, max, rmse, frame_ms, .. } = self;
        json!({"figure": name, "stands_in": place, "max": max, "rmse": rmse, "frame_ms": frame_ms})
    }
}

fn table(studied: &Studied) -> String {
    let mut text = format!(
        "{}: {} tetrahedra, gradients {:.1} ms\n{:24} {:>9} {:>9} {:>10} {:>7} {:>10}  {}\n",
        studied.name,
        studied.tetrahedra,
        studied.gradients_ms,
        "variant",
        "max",
        "rmse",
        "frame ms",
        "ratio",
        "culled",
        "as in"
    );
    for (r, culled) in studied.rows.iter().zip(&studied.culled) {
        text += &format!(
            "{:24} {:>9.1e} {:>9.1e} {:>10.1} {:>7.2} {:>10}  {}\n",
            r.variant.name,
            r.max,
            r.rmse,
            r.frame_ms,
            r.frame_ms / studied.rows[0].frame_ms,
            culled,
            r.variant.place
        );
    }
    text + "\n" + &published::described(&studied.published)
}

fn described(figures: &[Figure]) -> String {
    let mut text = format!("{:28} {:>9} {:>9} {:>10}  {}\n", "figure", "max", "rmse", "frame ms", "as in");
    for f in figures {
        text += &format!("{:28} {:>9.1e} {:>9.1e} {:>10.1}  {}\n", f.name, f.max, f.rmse, f.frame_ms, f.place);
    }
    text + "\n"
}

/// Frames in a second, beside theirs.
fn rates(all: &[Studied]) -> String {
    let mut text = format!(
        "frames per second; Song et al. 2009, table 1, on a GeForce 8800 GTS: one variable, analytic, approximate\n\
         {:32} {:>10} {:>8} {:>8} {:>8}  {}\n",
        "mesh", "tetrahedra", "one", "analytic", "pieces", "table 1"
    );
    for studied in all {
        let known = TABLE_1.iter().find(|(name, _)| studied.name.starts_with(name));
        let reported = known.map_or("-".into(), |(_, [one, analytic, pieces])| format!("{one} {analytic} {pieces}"));
        let [one, analytic, pieces] = ["one variable", "analytic", "10 pieces, texture"]
            .map(|name| studied.rate(name).map_or("-".into(), |rate| format!("{rate:.2}")));
        let tetrahedra = studied.tetrahedra;
        text += &format!("{:32} {tetrahedra:>10} {one:>8} {analytic:>8} {pieces:>8}  {reported}\n", studied.name);
    }
    text
}

/// All figures, each above its difference from the truth times `gain`.
fn sheet(figures: &[Figure], background: [f32; 3], gain: f32) -> Image {
    let Some(Figure { truth, .. }) = figures.first() else { return Image::new([1, 1]) };
    let step = truth.size[0].div_ceil(super::WIDEST) as usize;
    let [w, h] = truth.size.map(|n| (n as usize / step).max(1));
    let (across, down) = (w.max(150) + MARGIN, LINES + 2 * (h + MARGIN));
    let columns = COLUMNS.min(figures.len());
    let size = [columns * across + MARGIN, figures.len().div_ceil(columns) * down + MARGIN];
    let mut sheet = Sheet(Image::new(size.map(|n| n as u32)));
    sheet.0.pixels.fill([0.2, 0.2, 0.2, 1.0]);
    for (i, figure) in figures.iter().enumerate() {
        let at = [MARGIN + i % columns * across, MARGIN + i / columns * down];
        let line = format!("{} {:.0e} {:.0} ms", figure.place, figure.max, figure.frame_ms);
        sheet.write(at, [figure.name, &line]);
        sheet.put(at, &figure.image, step, background);
        if let Some(difference) = figure.image.difference(&figure.truth, gain) {
            sheet.put([at[0], at[1] + h + MARGIN], &difference, step, [0.0; 3]);
        }
    }
    sheet.0
}
