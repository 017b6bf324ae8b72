//! The orders of cells side by side: where each is wrong, and what it takes.

use super::{Options, Row, Variant, check, draw, set, sheet};
use anyhow::{Context, Result};
use halite::geometry::TetMesh;
use halite::gpu::DeviceChoice;
use halite::image::{Backdrop, Image};
use halite::integral::options::IntegrationOptions;
use halite::mesh::faces::Faces;
use halite::order::check::{self, Verdict};
use halite::order::mpvo::{Mpvo, Rule, Sequence};
use halite::project::{CellOrder, Cycles, ProjectionOptions};
use halite::render::{Engine, Renderer};
use halite::scene::Scene;
use halite::view::View;
use halite_console::request::{self, Job};
use halite_console::{output, progress};
use serde_json::{Value, json};
use std::path::Path;

/// The orders: the rule that the checker asks, and what draws.
const ORDERS: [(&str, &str, Rule, CellOrder); 5] = [
    ("numeric", "by the distances of centres", Rule::Depth, CellOrder::Depth),
    ("MPVO", "Williams 1992", Rule::Convex, CellOrder::MpvoConvex),
    ("MPVONC", "Williams 1992", Rule::Nonconvex, CellOrder::Mpvonc),
    ("XMPVO", "Silva, Mitchell & Williams 1998", Rule::Xmpvo, CellOrder::Xmpvo),
    ("mpvo", "Halite's", Rule::Mpvo, CellOrder::Mpvo),
];

/// Frames in a second with numeric, MPVO and XMPVO sorting, by what the names of files begin with, on two graphics cards: Guthe et
/// al. 2002, table 5.
const TABLE_5: [(&str, [[f64; 3]; 2]); 2] =
    [("bluntfin_tet", [[3.18, 2.64, 2.35], [2.51, 2.20, 1.99]]), ("bucky", [[2.46, 2.19, 2.05], [2.09, 1.98, 1.87]])];

/// What an order gave.
struct Line {
    verdict: Verdict,
    row: Row,
}

impl Line {
    /// A frame of a camera that moves: order and picture, in ms.
    fn whole(&self) -> f64 {
        self.row.order_ms + self.row.frame_ms
    }
}

/// What is known of a mesh.
struct Studied {
    name: String,
    size: [u32; 2],
    background: [f32; 3],
    truth: Image,
    lines: Vec<Line>,
    ours: Sequence,
}

pub(super) fn run(options: &Options, threads: usize) -> Result<()> {
    let given = options.request.scene()?;
    options.request.studied(given.as_ref())?;
    let device = options.request.device(given.as_ref());
    let mut reference = Renderer::with_device(threads, DeviceChoice::Cpu)?;
    let mut renderer = Renderer::with_engine(threads, device, Engine::Project)?;
    let job = reference.install(|| request::prepare(&options.request, given.clone())?.of_mesh("study"))?;
    let first = given.as_ref().map_or(&options.request.input, |scene: &Scene| &scene.mesh).clone();
    let mut all = vec![studied(options, &first, &job, &mut reference, &mut renderer)?];
    drop(job);
    output::print(&table(&all[0]))?;
    for path in &options.also {
        let request = options.request.of(path.clone());
        let job = reference.install(|| request::prepare(&request, None))?;
        if job.grid.is_some() {
            tracing::warn!("{}: passed over, as it is a regular or rectilinear grid", path.display());
            continue;
        }
        all.push(studied(options, path, &job, &mut reference, &mut renderer)?);
        output::print(&table(&all[all.len() - 1]))?;
    }
    output::print(&ratios(&all))?;
    if let Some(path) = &options.json {
        let mut whole = all[0].report();
        if !options.also.is_empty() {
            whole["also"] = all[1..].iter().map(Studied::report).collect();
        }
        std::fs::write(path, format!("{whole:#}\n")).with_context(|| path.display().to_string())?;
    }
    let Studied { background, truth, lines, .. } = all.swap_remove(0);
    let pictures: Vec<Row> = lines.into_iter().map(|l| l.row).collect();
    sheet(&pictures, &truth, background, options.gain).save(&options.out, Backdrop::Color(background))?;
    Ok(())
}

/// Draws the mesh at `path`, and checks each order of its cells.
fn studied(
    options: &Options,
    path: &Path,
    job: &Job,
    reference: &mut Renderer,
    renderer: &mut Renderer,
) -> Result<Studied> {
    let (view, _) = job.scene.view()?;
    let geometry = reference.install(|| {
        let points = job.tetrahedra.points(job.mesh.points());
        TetMesh::new(&points, &job.tetrahedra, &Faces::new(&points, &job.tetrahedra.corners))
    });
    let truth = progress::during("judging", |p| {
        set(reference, job)?;
        reference.render(&view, p)
    })?;
    set(renderer, job)?;
    let (mut mpvo, mut lines, mut ours) = (Mpvo::default(), Vec::new(), Sequence::default());
    progress::during("drawing", |p| {
        for (i, (name, place, rule, order)) in ORDERS.into_iter().enumerate() {
            p(i as f64 / ORDERS.len() as f64);
            // Cycles are not left to the walk: what is wrong shows.
            let projection = ProjectionOptions::default().with_order(order).with_cycles(Cycles::Cut);
            let variant = Variant { name, place, projection, integral: IntegrationOptions::default() };
            match draw(variant, options.frames, renderer, &view, &truth) {
                Ok(row) => {
                    let (sequence, verdict) = reference.install(|| checked(&mut mpvo, &geometry, &view, rule));
                    lines.push(Line { verdict, row });
                    ours = sequence;
                }
                Err(e) => tracing::warn!("{name}: {}", e.to_string().replace('\n', " ")),
            }
        }
    });
    check(&lines)?;
    Ok(Studied {
        name: path.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned()),
        size: job.scene.size,
        background: job.scene.background.unwrap_or_default().map(|c| c as f32),
        truth,
        lines,
        ours,
    })
}

/// The sequence by a rule, and what is wrong with it.
fn checked(mpvo: &mut Mpvo, geometry: &TetMesh, view: &View, rule: Rule) -> (Sequence, Verdict) {
    let sequence = mpvo.sequence(geometry, view, rule);
    let entries: Vec<u32> = sequence.cells.iter().rev().copied().collect();
    let verdict = check::check(geometry, view, &entries);
    (sequence, verdict)
}

impl Studied {
    fn report(&self) -> Value {
        let row = |Line { verdict: v, row }: &Line| {
            json!({
                "order": row.variant.name, "switches": row.variant.projection, "pairs": v.pairs,
                "inversions": v.inversions, "overlaps": v.overlaps, "pixels": v.pixels,
                "wrong_pixels": v.wrong.len(), "max": row.max, "rmse": row.rmse, "order_ms": row.order_ms,
                "frame_ms": row.frame_ms,
            })
        };
        let rows: Vec<_> = self.lines.iter().map(row).collect();
        json!({"mesh": self.name, "size": self.size, "tetrahedra": self.ours.cells.len(), "orders": rows})
    }

    /// How long a frame in the order of this name takes, the numeric one being 1.
    fn ratio(&self, name: &str) -> Option<f64> {
        let of = |name: &str| self.lines.iter().find(|l| l.row.variant.name == name).map(Line::whole);
        Some(of(name)? / of("numeric")?)
    }
}

/// What each order gave, and a line on what has no order.
fn table(studied: &Studied) -> String {
    let Studied { name, lines, ours: s, .. } = studied;
    let mut text = format!(
        "{name}\n{:8} {:>12} {:>10} {:>14} {:>9} {:>9} {:>10} {:>10} {:>6}  {}\n",
        "order", "inversions", "overlaps", "pixels", "max", "rmse", "order ms", "frame ms", "ratio", "by"
    );
    for line in lines {
        let Line { verdict: v, row } = line;
        text += &format!(
            "{:8} {:>12} {:>10} {:>14} {:>9.1e} {:>9.1e} {:>10.1} {:>10.1} {:>6.2}  {}\n",
            row.variant.name,
            v.inversions,
            v.overlaps,
            format!("{}/{}", v.wrong.len(), v.pixels),
            row.max,
            row.rmse,
            row.order_ms,
            line.whole(),
            line.whole() / lines[0].whole(),
            row.variant.place
        );
    }
    text += &format!(
        "{} cells; {} cycles of {} cells, cut in {} places that {} pixels see; {} pixels of overlapping cells\n\n",
        s.cells.len(),
        s.cycles,
        s.cycle_cells,
        s.cuts,
        s.disordered.len(),
        s.overlapping
    );
    text
}

/// Frames of a camera that moves, in each order, beside what Guthe et al. 2002 have in table 5.
fn ratios(all: &[Studied]) -> String {
    let mut text = format!(
        "frame times, numeric = 1; Guthe et al. 2002, table 5: MPVO and XMPVO on a GeForce4 and a Radeon 8500\n{:32} {:>10} {:>7} {:>7} \
         {:>7}  {}\n",
        "mesh", "cells", "MPVO", "XMPVO", "mpvo", "table 5"
    );
    for studied in all {
        let known = TABLE_5.iter().find(|(name, _)| studied.name.starts_with(name)).map(|(_, cards)| cards);
        let reported = known.map_or("-".into(), |cards| {
            let of = |[numeric, mpvo, xmpvo]: &[f64; 3]| format!("{:.2} {:.2}", numeric / mpvo, numeric / xmpvo);
            cards.iter().map(of).collect::<Vec<_>>().join(", ")
        });
        let [mpvo, xmpvo, ours] =
            ["MPVO", "XMPVO", "mpvo"].map(|name| studied.ratio(name).map_or("-".into(), |ratio| format!("{ratio:.2}")));
        let cells = studied.ours.cells.len();
        text += &format!("{:32} {cells:>10} {mpvo:>7} {xmpvo:>7} {ours:>7}  {reported}\n", studied.name);
    }
    text
}
