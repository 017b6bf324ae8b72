//! Pictures of all time steps.

use crate::render::{Options, picture};
use anyhow::{Context, Result};
use halite::io::Time;
use halite::mesh::cells::Tetrahedra;
use halite::render::Renderer;
use halite::scene::{Scene, automatic};
use halite_console::request::{Request, Steps, prepare_step};
use halite_console::{input, output};

/// Draws all time steps, with the colours, opacities and view of the first over the range of all.
pub(crate) fn draw(options: &Options, given: Option<Scene>, renderer: &mut Renderer) -> Result<serde_json::Value> {
    let request = &options.request;
    if input::is_standard(&options.out) {
        return Err(output::misuse("--all-times: standard output takes one picture; --out FILE.png names all of them"));
    }
    let path = given.as_ref().map_or(&request.input, |scene| &scene.mesh);
    let count = input::source(path)?.times().len().max(1);
    let mut steps = Steps::default();
    if given.is_none() && request.range.is_none() {
        steps.values = renderer.install(|| range_of_all(request, count))?;
    }
    let (mut reports, mut missing) = (vec![], None);
    for step in 0..count {
        steps.time = Some(Time::Step(step));
        let job = match renderer.install(|| prepare_step(request, given.clone(), &mut steps)) {
            Err(error) if is_missing(&error, count) => {
                tracing::warn!("{}: time step {step} is left out: {error:#}", path.display());
                missing = Some(error);
                continue;
            }
            job => job?,
        };
        reports.push(picture(options, &output::numbered(&options.out, step, count), job, renderer)?);
    }
    match missing {
        Some(error) if reports.is_empty() => Err(error),
        _ => Ok(reports.into()),
    }
}

/// Whether that is wrong with one of several steps which others can do without: its file cannot be opened.
fn is_missing(error: &anyhow::Error, count: usize) -> bool {
    count > 1 && matches!(error.downcast_ref(), Some(halite::Error::File { .. }))
}

/// The range that the values of all time steps have where they are drawn.
fn range_of_all(request: &Request, count: usize) -> Result<Option<[f64; 2]>> {
    let (mut all, mut scalars) = (None::<[f64; 2]>, None);
    for step in 0..count {
        let (mesh, _) = match input::mesh(&request.input, Some(Time::Step(step))) {
            Err(error) if is_missing(&error, count) => continue,
            read => read?,
        };
        if request.has_no_choice(&mesh) {
            return Ok(None);
        }
        let tetrahedra = Tetrahedra::new(&mesh).with_context(|| request.input.display().to_string())?;
        let scalars = match &scalars {
            Some(first) => first,
            None => scalars.insert(request.scalars(None, &mesh)?),
        };
        if let Some((range, _)) = automatic::range(&mesh, &tetrahedra, scalars) {
            all = Some(all.map_or(range, |all| [all[0].min(range[0]), all[1].max(range[1])]));
        }
    }
    Ok(all)
}
