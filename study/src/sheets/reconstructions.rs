//! Orders of reconstruction: the figures of El Hajjar, Marchesin, Dischler & Mongenet (2008), and what they claim.

mod pictures;
mod plot;
mod signal;

use super::Options;
use anyhow::{Context, Result, bail};
use halite::cast::{ReconstructionOrder, Sampling};
use halite::field::{Association, Field};
use halite::grid::Grid;
use halite::image::Backdrop;
use halite::mesh::cells::Tetrahedra;
use halite::scene::{Scene, automatic};
use halite_console::{input, output, progress};
use plot::Plot;
use serde_json::{Value, json};
use signal::{Random, Samples};
use std::path::Path;

/// Points along each axis of a semi-random volume, so that rays pass about eight voxels, and how many rays are averaged.
const RANDOM: usize = 9;
const RAYS: usize = 500;

/// Lines through each volume on which turns and slabs are counted.
const LINES: usize = 2000;

/// Orders, the figures where the authors show them, and how far they are off there.
const ORDERS: [(&str, ReconstructionOrder, &str, f64); 3] = [
    ("order 0", ReconstructionOrder::Midpoint, "figure 1", 0.154_418),
    ("order 1", ReconstructionOrder::One, "figure 2", 0.044_494),
    ("order 2", ReconstructionOrder::Two, "figure 4", 0.006_220),
];

/// Names of volumes in which the authors' figures 5 are, how long their lines are in voxels, and how far orders 1 and 2 are off.
const LONG: [(&str, f64, [f64; 2]); 2] =
    [("neghip", 12.5, [0.011_144, 0.003_992]), ("silicium", 17.5, [0.059_463, 0.035_572])];

/// A volume that was read.
struct Volume {
    /// Of its file, and whether it only stands for the one of the literature.
    name: String,
    stands_in: bool,
    grid: Grid,
    field: Field,
    scene: Scene,
    samples: Samples,
}

impl Volume {
    fn open(path: &Path, size: [u32; 2]) -> Result<Self> {
        let (mesh, grid) = input::mesh(path, None)?;
        let Some(grid) = grid else {
            bail!("{}: orders of reconstruction are of regular and rectilinear grids", path.display());
        };
        let tetrahedra = Tetrahedra::new(&mesh).with_context(|| path.display().to_string())?;
        let scalars = automatic::scalars(&mesh, Some(Association::Point))?;
        let field = scalars.field(&mesh)?;
        let wishes = automatic::Wishes::default().with_size(Some(size));
        let scene = automatic::scene(&mesh, &tetrahedra, scalars.clone(), &field, wishes)?;
        let field = scalars.field(&grid)?;
        let [lo, hi] = field.range(0);
        let over = 1.0 / (hi - lo).max(f64::MIN_POSITIVE);
        let samples = Samples {
            axes: grid.axes().clone(),
            values: (0..field.len()).map(|i| (field.value(i) - lo) * over).collect(),
        };
        if samples.axes.iter().any(|axis| axis[0] > axis[axis.len() - 1]) {
            bail!("{}: axes ascend in volumes that are studied", path.display());
        }
        let stem = path.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
        let name = stem.strip_prefix("synth_").unwrap_or(&stem).to_owned();
        Ok(Volume { stands_in: stem.starts_with("synth"), name, grid, field, scene, samples })
    }

    /// What it is called on a sheet.
    fn label(&self) -> String {
        if self.stands_in { format!("{} (stand-in)", self.name) } else { self.name.clone() }
    }
}

pub(super) fn run(options: &Options, threads: usize) -> Result<()> {
    if options.request.scene()?.is_some() {
        bail!("--orders: volumes are studied as they are, and not in scenes");
    }
    let size = options.request.size.unwrap_or([256, 256]);
    let paths = std::iter::once(&options.request.input).chain(&options.volumes);
    let volumes = paths.map(|path| Volume::open(path, size)).collect::<Result<Vec<_>>>()?;
    let (mut plots, mut text) = (vec![], String::new());
    let random = semi_random(&mut plots, &mut text);
    let long = steps(&volumes, &mut plots, &mut text);
    let turns = turns(&volumes, &mut text);
    let device = options.request.device(None).or_environment();
    let pictures =
        progress::during("drawing", |report| pictures::draw(&volumes, threads, options.frames, &device, report))?;
    text += &pictures.text();
    output::print(&text)?;
    plot::sheet(&plots, &pictures).save(&options.out, Backdrop::Color([0.0; 3]))?;
    if let Some(path) = &options.json {
        let stand_ins: Vec<_> = volumes.iter().filter(|v| v.stands_in).map(|v| &v.name).collect();
        let whole = json!({
            "volumes": volumes.iter().map(|v| &v.name).collect::<Vec<_>>(), "stand_ins": stand_ins,
            "semi_random": random, "equal_steps": long, "turns": turns,
            "tables": pictures.tables(), "pictures": pictures.rows(), "voxels": pictures.voxels(),
        });
        std::fs::write(path, format!("{whole:#}\n")).with_context(|| path.display().to_string())?;
    }
    Ok(())
}

/// Figures 1 to 4: how far the orders are off along rays through semi-random volumes, by themselves and behind a function of
/// sharp peaks.
fn semi_random(plots: &mut Vec<Plot>, text: &mut String) -> Vec<Value> {
    let mut random = Random(11);
    let volume = Samples::random(RANDOM, &mut random);
    let knots: Vec<f64> = (0..12).map(|_| random.next().powi(2)).collect();
    let tau = |s: f64| {
        let at = s.clamp(0.0, 1.0) * (knots.len() - 1) as f64;
        let i = (at as usize).min(knots.len() - 2);
        knots[i] + (knots[i + 1] - knots[i]) * (at - i as f64)
    };
    let lines: Vec<_> = (0..RAYS).map(|_| volume.random_line(&mut random)).collect();
    // Rays of the authors' are about eight voxels long.
    let shown = volume.line([0.05, 0.4, 1.2], [7.2, 3.1, 3.4]);
    let mut rows = vec![];
    *text += "along rays through semi-random volumes    deviation per 8 voxels, behind a function, the authors'\n";
    for (name, order, figure, theirs) in ORDERS {
        let mean = |of: &dyn Fn(f64) -> f64| {
            let sum = |l: &signal::Line| l.deviation(order, Sampling::Voxels, of);
            lines.iter().map(sum).sum::<f64>() / lines.iter().map(signal::Line::end).sum::<f64>() * 8.0
        };
        let (own, behind) = (mean(&|s| s), mean(&tau));
        *text += &format!("  {name:38} {own:>22.5} {behind:>19.5} {theirs:>14.5}\n");
        let caption = format!("{figure}: {name}, {own:.4}");
        plots.push(Plot::new(caption, &shown, order, Sampling::Voxels, |s| s));
        rows.push(json!({
            "order": name, "figure": figure, "deviation": own, "composed": behind, "published": theirs, "rays": RAYS,
        }));
    }
    plots.push(Plot::new(
        "figure 3: order 1 behind a function".into(),
        &shown,
        ReconstructionOrder::One,
        Sampling::Voxels,
        tau,
    ));
    plots.push(Plot::new("the same of order 2".into(), &shown, ReconstructionOrder::Two, Sampling::Voxels, tau));
    rows
}

/// Figure 5: the same with steps of a voxel through volumes, with the share of slabs that a face of a voxel crosses.
fn steps(volumes: &[Volume], plots: &mut Vec<Plot>, text: &mut String) -> Vec<Value> {
    let mut rows = vec![];
    *text += "along rays with equal steps               step, order 1, order 2, ratio, slabs crossed, the authors'\n";
    for volume in volumes {
        let mut random = Random(29);
        let lines: Vec<_> = (0..RAYS).map(|_| volume.samples.random_line(&mut random)).collect();
        let known = LONG.iter().find(|l| volume.name.contains(l.0));
        let length = known.map_or(12.5, |l| l.1);
        for step in [0.25, 0.5, 1.0] {
            let sampling = Sampling::Steps(step);
            let all: f64 = lines.iter().map(signal::Line::end).sum();
            let mean = |order| lines.iter().map(|l| l.deviation(order, sampling, |s| s)).sum::<f64>() / all * length;
            let [first, second] = [ReconstructionOrder::One, ReconstructionOrder::Two].map(mean);
            let [crossed, slabs] = lines.iter().fold([0, 0], |[a, b], l| {
                let [c, d] = l.crossed(sampling);
                [a + c, b + d]
            });
            let share = crossed as f64 / slabs.max(1) as f64;
            let published = known.filter(|_| step == 1.0).map(|l| l.2);
            let theirs = published.map_or("-".into(), |[a, b]| format!("{a:.4} {b:.4}"));
            *text += &format!(
                "  {:38} {step:>5} {first:>9.5} {second:>9.5} {:>6.2} {:>8.1} % {theirs:>16}\n",
                volume.label(),
                first / second,
                share * 100.0
            );
            rows.push(json!({
                "volume": volume.name, "stand_in": volume.stands_in, "step": step, "order_1": first, "order_2": second,
                "crossed": share, "per_voxels": length, "published": published,
            }));
        }
        if known.is_some() {
            // The line that the orders differ on most tells most of a figure.
            let differs =
                |l: &&signal::Line| l.deviation(ReconstructionOrder::One, Sampling::Steps(1.0), |s| s) / l.end();
            let most = lines.iter().max_by(|a, b| differs(a).total_cmp(&differs(b)));
            for (order, name) in [(ReconstructionOrder::One, "order 1"), (ReconstructionOrder::Two, "order 2")] {
                let caption = format!("figure 5: {}, {name}", volume.label());
                plots.extend(most.map(|line| Plot::new(caption, line, order, Sampling::Steps(1.0), |s| s)));
            }
        }
    }
    rows
}

/// The claim that a segment in a voxel never turns twice, counted.
fn turns(volumes: &[Volume], text: &mut String) -> Vec<Value> {
    let mut rows = vec![];
    let mut random = Random(53);
    let noise = Samples::random(17, &mut random);
    *text += "segments in voxels that turn twice        of all, share\n";
    let all = volumes.iter().map(|v| (v.label(), &v.samples)).chain([("semi-random".to_owned(), &noise)]);
    for (name, samples) in all {
        let [twice, count] = (0..LINES).fold([0, 0], |[a, b], _| {
            let [c, d] = samples.random_line(&mut random).turns();
            [a + c, b + d]
        });
        let share = twice as f64 / count.max(1) as f64;
        *text += &format!("  {name:26} {twice:>12} {count:>8} {:>6.2} %\n", share * 100.0);
        rows.push(json!({ "volume": name, "twice": twice, "segments": count, "share": share }));
    }
    rows
}
