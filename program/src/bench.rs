use anyhow::{Context, Result};
use clap::Args;
use halite::gpu::{self, DeviceChoice};
use halite::render::{ProjectionStats, Renderer, Stats};
use halite::view::View;
use halite_console::drawn::{self, Times, ms};
use halite_console::request::{self, Job, Request};
use halite_console::{camera, output, progress};
use serde_json::{Value, json};
use std::path::PathBuf;
use std::time::Instant;

/// Measure how long pictures take
///
/// Loads once, then draws the same view several times on the chosen device, and on each other device of this machine
/// unless one was named. Times are medians; the JSON tells those of the projection engine's passes, that of ordering by edits.
/// With --views, each frame is seen from another side, so nothing of the last one can be used again.
#[derive(Args)]
pub(crate) struct Options {
    #[command(flatten)]
    request: Request,
    /// Frames drawn on each device, besides the first
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    frames: u32,
    /// Draw from so many sides in turn, all around the view-up axis
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    views: u32,
    /// Write the figures as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Heads and widths of the table's columns: "on device" is the frame by the device's own clock.
const COLUMNS: [(&str, usize); 9] = [
    ("faces", 10),
    ("field", 10),
    ("first frame", 12),
    ("frame", 10),
    ("on device", 10),
    ("edit", 10),
    ("steps", 9),
    ("rate", 10),
    ("memory", 10),
];

/// What one device needed.
struct Run {
    stats: Stats,
    times: Times,
    frame_ms: f64,
    /// Of all threads, for the mean frame, where the system says.
    frame_cpu_ms: Option<f64>,
}

pub(crate) fn run(options: &Options, threads: usize) -> Result<()> {
    if let Some(path) = &options.json {
        output::check(path)?;
    }
    let given = options.request.scene()?;
    let choice = options.request.device(given.as_ref()).or_environment();
    // Engine and projection options of a scene hold for all devices.
    let scene = given.clone();
    let mut renderer = options.request.renderer(threads, scene.as_ref(), choice.clone())?;
    let job = renderer.install(|| request::prepare(&options.request, given))?;
    let first = measure(options, &job, &mut renderer)?;
    let mut runs = vec![first];
    drop(renderer);
    // Grids are drawn by the CPU on every device.
    if choice == DeviceChoice::Auto && job.grid.is_none() {
        for other in others(&runs[0].stats) {
            let mut renderer = options.request.renderer(threads, scene.as_ref(), other)?;
            match measure(options, &job, &mut renderer) {
                Ok(run) => runs.push(run),
                // One device that fails is no reason to keep the others' figures back.
                Err(e) => tracing::warn!("{}: {e:#}", renderer.stats().adapter),
            }
        }
    }
    let size = job.scene.size;
    output::print(&table(&runs, size))?;
    if let Some(path) = &options.json {
        let report = |r: &Run| {
            let mut report = drawn::report(&r.stats, &r.times, size, r.frame_ms);
            report["frame_cpu_ms"] = json!(r.frame_cpu_ms);
            report
        };
        let reports: Vec<Value> = runs.iter().map(report).collect();
        let mut whole = reports[0].clone();
        whole["runs"] = json!(reports[1..]);
        std::fs::write(path, format!("{whole:#}\n")).with_context(|| path.display().to_string())?;
    }
    Ok(())
}

/// The devices of this machine but the one that drew.
fn others(drew: &Stats) -> Vec<DeviceChoice> {
    let all = gpu::devices();
    let mut seen = all.iter().position(|d| drew.device == "gpu" && d.name == drew.adapter);
    let mut others: Vec<DeviceChoice> = Vec::new();
    // Only one engine knows how to do without a graphics device.
    if drew.device == "gpu" && drew.engine == "traverse" {
        others.push(DeviceChoice::Cpu);
    }
    for device in all.iter().filter(|d| d.lacks.is_none()) {
        if seen == Some(device.index) {
            seen = None;
        } else {
            others.push(DeviceChoice::Named(device.index.to_string()));
        }
    }
    others
}

fn measure(options: &Options, job: &Job, renderer: &mut Renderer) -> Result<Run> {
    let views = (0..options.views).map(|i| {
        let mut scene = job.scene.clone();
        scene.camera = camera::turned(scene.camera, 360.0 * f64::from(i) / f64::from(options.views));
        Ok(scene.view()?.0)
    });
    let views: Vec<View> = views.collect::<Result<_>>()?;
    if let Some(grid) = &job.grid {
        renderer.set_grid(grid)?;
    } else {
        renderer.check_room(job.mesh.points().len(), &job.tetrahedra)?;
        progress::during("matching faces", |p| {
            renderer.set_tetrahedra_with_progress(&job.mesh, job.tetrahedra.clone(), p);
        });
    }
    renderer.set_field(&job.field)?;
    renderer.set_transfer(&job.scene.transfer);
    let name = renderer.stats().adapter.clone();
    progress::during("measuring", |p| {
        let share = |done: u32| p(f64::from(done) / f64::from(2 * options.frames + 1));
        let draw = |renderer: &mut Renderer, i: u32| -> Result<f64> {
            let start = Instant::now();
            renderer.render(&views[i as usize % views.len()], &|_| ()).with_context(|| name.clone())?;
            Ok(ms(start))
        };
        let first_frame = draw(renderer, 0)?;
        // One that is chosen by the knots is not there yet.
        if renderer.stats().knots_per_cell > 0.0 {
            renderer.wait_for_table();
            draw(renderer, 0)?;
        }
        let tabulated = renderer.stats().table_bytes > 0;
        let old = &job.scene.transfer;
        let edited = old.with_unit_distance(old.unit_distance() * (1.0 + 1e-6))?;
        let (mut frames, mut edits) = (Vec::new(), Vec::new());
        let (mut still, mut moved) = (Vec::new(), Vec::new());
        let mut cpu_ms = Some(0.0);
        for i in 0..options.frames {
            let before = cpu_time_ms();
            frames.push(draw(renderer, i)?);
            cpu_ms = (|| Some(cpu_ms? + cpu_time_ms()? - before?))();
            still.extend(renderer.stats().projection);
            share(2 * i + 2);
            // To and fro, so that every edit is one.
            renderer.set_transfer(if i % 2 == 0 { &edited } else { &job.scene.transfer });
            edits.push(draw(renderer, i)?);
            moved.extend(renderer.stats().projection);
            if tabulated {
                renderer.wait_for_table();
                draw(renderer, i)?;
            }
            share(2 * i + 3);
        }
        // What the device did for a still view, not for an edit.
        renderer.set_transfer(&job.scene.transfer);
        renderer.wait_for_table();
        draw(renderer, 0)?;
        draw(renderer, 0)?;
        let times =
            Times { load: job.load_ms, split: job.split_ms, first_frame, transfer_edit: Some(median(&mut edits)) };
        let mut stats = renderer.stats().clone();
        if let Some(projection) = &mut stats.projection {
            *projection = medians(*projection, &still, &moved);
        }
        let frame_cpu_ms = cpu_ms.map(|ms| ms / f64::from(options.frames));
        Ok(Run { stats, times, frame_ms: median(&mut frames), frame_cpu_ms })
    })
}

/// What all threads of this process have computed for, in ms, in steps of the system's clock tick (10 ms on Linux).
fn cpu_time_ms() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name before may hold anything; user and system time are the 12th and 13th fields after it, in ticks of 1/100 s.
    let mut ticks = stat.rsplit_once(')')?.1.split_whitespace().skip(11).map(|n| n.parse::<f64>().ok());
    Some(10.0 * (ticks.next()?? + ticks.next()??))
}

/// `last` with the median times of still views, but that of ordering by views after an edit.
fn medians(last: ProjectionStats, still: &[ProjectionStats], edited: &[ProjectionStats]) -> ProjectionStats {
    let of = |time: &dyn Fn(&ProjectionStats) -> Option<f64>| {
        let mut times: Vec<f64> = still.iter().filter_map(time).collect();
        (!times.is_empty()).then(|| median(&mut times))
    };
    let mut orders: Vec<f64> = edited.iter().map(|p| p.order_ms).collect();
    ProjectionStats {
        order_ms: median(&mut orders),
        project_ms: of(&|p| p.project_ms),
        draw_ms: of(&|p| p.draw_ms),
        ..last
    }
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    let (low, high) = (values[(values.len() - 1) / 2], values[values.len() / 2]);
    (low + high) / 2.0
}

fn table(runs: &[Run], [w, h]: [u32; 2]) -> String {
    let Stats { cells, tetrahedra, .. } = &runs[0].stats;
    let times = &runs[0].times;
    let mut text = format!(
        "{w}x{h} pixels, {cells} cells, {tetrahedra} tetrahedra; loading {:.1} ms, splitting {:.1} ms\n\n",
        times.load, times.split
    );
    for (head, width) in COLUMNS {
        text += &format!("{head:>width$} ");
    }
    text += " device\n";
    for Run { stats: s, times, frame_ms, .. } in runs {
        let time = |ms: f64| format!("{ms:.1} ms");
        let cells = [
            time(s.faces_ms),
            time(s.upload_ms),
            time(times.first_frame),
            time(*frame_ms),
            s.device_ms.map_or("-".into(), time),
            time(times.transfer_edit.unwrap_or_default()),
            format!("{:.2} M", s.steps as f64 / 1e6),
            format!("{:.1} M/s", s.steps as f64 / frame_ms / 1e3),
            format!("{:.1} MB", s.device_bytes as f64 / 1e6),
        ];
        for (cell, (_, width)) in cells.iter().zip(COLUMNS) {
            text += &format!("{cell:>width$} ");
        }
        text += &format!(" {} on {}\n", s.engine, s.adapter);
    }
    text
}
