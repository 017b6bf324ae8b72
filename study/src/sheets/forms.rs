//! The forms of the integral in both engines: errors and times in one table.

use super::{Options, Row, Variant, check, set, sheet};
use anyhow::{Context, Result};
use halite::gpu::DeviceChoice;
use halite::image::{Backdrop, Image};
use halite::integral::options::{Alpha, Form, IntegrationOptions, Planes};
use halite::integral::table::Kind;
use halite::project::{Fragments, ProjectionOptions};
use halite::render::{Engine, Renderer, Stats};
use halite::view::View;
use halite_console::request::{self, Job};
use halite_console::{output, progress};
use serde_json::json;

/// Planes of a cylinder, and texels along both axes of each.
const PLANES: u32 = 128;

/// A form in an engine.
struct Line {
    engine: String,
    table_ms: f64,
    bytes: u64,
    row: Row,
}

/// All forms, of tables of this size if it was said; or those that are of interest where fragments are interpolated.
fn forms(interpolated: bool, table: Option<[u32; 3]>) -> Vec<(&'static str, IntegrationOptions)> {
    let volume = |lengths, slices| {
        IntegrationOptions::of(Form::Volume).with_lengths(lengths).with_table(table.or(Some([256, 256, slices])))
    };
    let polynomial = |degree| IntegrationOptions::of(Form::Polynomial).with_degree(degree).with_table(table);
    let cylindrical = |planes, per_cell| {
        IntegrationOptions::of(Form::Cylindrical)
            .with_planes(planes)
            .with_per_cell(per_cell)
            .with_table(table.or(Some([PLANES; 3])))
    };
    let two = |per_cell| cylindrical(Planes::Two, per_cell);
    if interpolated {
        return vec![
            ("exact, interpolated", IntegrationOptions::default()),
            ("cylindrical, interpolated", two(false)),
            ("cylindrical, plane per cell", two(true)),
        ];
    }
    vec![
        ("exact", IntegrationOptions::default()),
        ("volume, uniform", volume(Kind::Uniform, 64)),
        ("volume, log", volume(Kind::Log, 16)),
        ("volume, log-normalised", volume(Kind::LogNormalised, 16)),
        ("polynomial, linear alpha", polynomial(1).with_alpha(Alpha::Linear)),
        ("polynomial, degree 1", polynomial(1)),
        ("polynomial, degree 2", polynomial(2)),
        ("polynomial, degree 4", polynomial(4)),
        ("cylindrical, two planes", two(false)),
        ("cylindrical, one plane", cylindrical(Planes::One, false)),
        ("cylindrical, packed", cylindrical(Planes::Packed, false)),
    ]
}

pub(super) fn run(options: &Options, threads: usize) -> Result<()> {
    let given = options.request.scene()?;
    let size = options.request.studied(given.as_ref())?;
    let device = options.request.device(given.as_ref());
    let mut reference = Renderer::with_device(threads, DeviceChoice::Cpu)?;
    let job = reference.install(|| request::prepare(&options.request, given)?.of_mesh("study"))?;
    let (view, _) = job.scene.view()?;
    let truth = progress::during("judging", |p| {
        set(&mut reference, &job)?;
        reference.render(&view, p)
    })?;
    let project = Renderer::with_engine(threads, device, Engine::Project)?;
    // The walk on the device that projects, be it one in software.
    let same = DeviceChoice::Named(project.stats().adapter.clone());
    let walk = Renderer::with_device(threads, same)?;
    let mut rows = vec![];
    for mut renderer in [reference, walk, project] {
        set(&mut renderer, &job)?;
        let Stats { engine, adapter, .. } = renderer.stats().clone();
        let name = format!("{engine} on {adapter}");
        let best = ProjectionOptions::default();
        let interpolated = best.with_fragments(Fragments::Interpolated);
        let mut all: Vec<_> = forms(false, size).into_iter().map(|f| (f, best)).collect();
        if engine == "project" {
            all.extend(forms(true, size).into_iter().map(|f| (f, interpolated)));
        }
        let count = all.len() as f64;
        progress::during("drawing", |p| {
            for (i, ((form, integral), projection)) in all.into_iter().enumerate() {
                p(i as f64 / count);
                let variant = Variant { name: form, place: "", projection, integral };
                match draw(variant, options.frames, &mut renderer, &view, &truth) {
                    Ok(row) => {
                        let Stats { table_ms, table_bytes, .. } = *renderer.stats();
                        rows.push(Line { engine: name.clone(), table_ms, bytes: table_bytes, row });
                    }
                    // A form that the device or the field rules out is no reason to keep the others back.
                    Err(e) => tracing::warn!("{name}, {form}: {}", e.to_string().replace('\n', " ")),
                }
            }
        });
    }
    check(&rows)?;
    output::print(&table(&rows))?;
    write(options, &job, &rows)?;
    let background = job.scene.background.unwrap_or_default().map(|c| c as f32);
    let pictures: Vec<Row> = rows.into_iter().map(|r| r.row).collect();
    sheet(&pictures, &truth, background, options.gain).save(&options.out, Backdrop::Color(background))?;
    Ok(())
}

fn draw(variant: Variant, frames: u32, renderer: &mut Renderer, view: &View, truth: &Image) -> halite::Result<Row> {
    renderer.set_integral(variant.integral);
    renderer.set_projection(variant.projection);
    let image = renderer.render(view, &|_| ())?;
    Row::measured(variant, image, truth, frames, renderer, view)
}

fn table(rows: &[Line]) -> String {
    let mut text = format!(
        "{:28} {:>9} {:>9} {:>9} {:>9} {:>10}  {}\n",
        "form", "table", "built in", "max", "rmse", "frame", "engine"
    );
    for Line { engine, table_ms, bytes, row } in rows {
        let (table, built) = match bytes {
            0 => ("-".into(), "-".into()),
            _ => (format!("{:.1} MB", *bytes as f64 / 1e6), format!("{table_ms:.0} ms")),
        };
        text += &format!(
            "{:28} {table:>9} {built:>9} {:>9.1e} {:>9.1e} {:>7.1} ms  {engine}\n",
            row.variant.name, row.max, row.rmse, row.frame_ms
        );
    }
    text
}

fn write(options: &Options, job: &Job, rows: &[Line]) -> Result<()> {
    let Some(path) = &options.json else { return Ok(()) };
    let rows: Vec<_> = rows
        .iter()
        .map(|Line { engine, table_ms, bytes, row }| {
            json!({
                "form": row.variant.name, "engine": engine, "integral": row.variant.integral,
                "switches": row.variant.projection, "table_bytes": bytes, "table_ms": table_ms, "max": row.max,
                "rmse": row.rmse, "frame_ms": row.frame_ms,
            })
        })
        .collect();
    let whole = json!({"size": job.scene.size, "forms": rows});
    std::fs::write(path, format!("{whole:#}\n")).with_context(|| path.display().to_string())
}
