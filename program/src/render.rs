//! `halite render`: a picture, or one of each time step.

use crate::steps;
use anyhow::{Context, Result};
use clap::Args;
use halite::render::Renderer;
use halite_console::drawn::{backdrop, draw};
use halite_console::request::{Job, Request, prepare};
use halite_console::{input, output};
use std::path::{Path, PathBuf};

/// Draw a mesh, or what a scene file describes, into a picture
///
/// With a mesh alone, scalars, colours, opacities and view are chosen so that something is seen. With a scene file, its
/// values hold unless an option says otherwise.
#[derive(Args)]
pub(crate) struct Options {
    #[command(flatten)]
    pub(crate) request: Request,
    /// The picture: .png (8-bit), .exr or .npy (linear premultiplied RGBA, 32-bit float); - is standard output
    #[arg(short, long, value_name = "FILE|-")]
    pub(crate) out: PathBuf,
    /// What standard output gets [default: png]
    #[arg(long, value_name = "FORMAT", value_parser = ["png", "exr", "npy"])]
    format: Option<String>,
    /// Draw all time steps into pictures with numbers, name_0000.png and so on, with one range of colours
    #[arg(long, conflicts_with = "time")]
    all_times: bool,
    /// Write what was done, and the time and memory it took, as JSON
    #[arg(long, value_name = "FILE")]
    stats: Option<PathBuf>,
    /// Draw a colour bar with numbers, title and opacities into the picture (.png)
    #[arg(long, help_heading = "Look")]
    legend: bool,
}

pub(crate) fn run(options: &Options, threads: usize) -> Result<()> {
    output::check_stream(&options.out, options.format.as_deref())?;
    let format = if input::is_standard(&options.out) { options.format.as_deref() } else { None };
    let ending = options.out.extension().and_then(|e| e.to_str());
    if options.legend && !format.or(ending).unwrap_or("png").eq_ignore_ascii_case("png") {
        return Err(output::misuse("--legend: a legend is drawn into a .png picture, others hold the integral alone"));
    }
    if let Some(path) = &options.stats {
        output::check(path)?;
    }
    let request = &options.request;
    let given = request.scene()?;
    request.check_second(given.as_ref())?;
    let mut renderer = request.renderer(threads, given.as_ref(), request.device(given.as_ref()))?;
    request.check_room(given.as_ref())?;
    let report = if options.all_times {
        steps::draw(options, given, &mut renderer)?
    } else {
        let job = renderer.install(|| prepare(request, given))?;
        picture(options, &options.out, job, &mut renderer)?
    };
    if let Some(path) = &options.stats {
        std::fs::write(path, format!("{report:#}\n")).with_context(|| path.display().to_string())?;
    }
    Ok(())
}

/// Draws a picture into a file, and says what it took.
pub(crate) fn picture(options: &Options, out: &Path, job: Job, renderer: &mut Renderer) -> Result<serde_json::Value> {
    let background = job.scene.background;
    let legend = if options.legend { Some(job.legend()?) } else { None };
    let mut drawn = draw(job, renderer)?;
    if let Some(legend) = legend {
        legend.draw(&mut drawn.image, background.unwrap_or_default().map(|c| c as f32));
    }
    let format = options.format.as_deref().unwrap_or("png");
    output::picture(&drawn.image, out, format, backdrop(background, drawn.behind.as_deref()))?;
    Ok(drawn.report())
}
