//! The orders of cells side by side: where each is wrong, and what it takes.

use super::{Options, Row, Variant, check, draw, set, sheet};
use crate::render;
use crate::{output, progress};
use anyhow::{Context, Result};
use halite::geometry::Geometry;
use halite::gpu::DeviceChoice;
use halite::image::Backdrop;
use halite::integral::choice::Choice;
use halite::mesh::faces::Faces;
use halite::order::check::{self, Verdict};
use halite::order::mpvo::{Mpvo, Rule};
use halite::project::{Cycles, Order, Switches};
use halite::render::{Engine, Renderer};
use halite::view::View;
use serde_json::json;

/// The orders: the rule that the checker asks, and what draws.
const ORDERS: [(&str, &str, Rule, Order); 5] = [
    ("numeric", "by the distances of centres", Rule::Depth, Order::Depth),
    ("MPVO", "Williams 1992", Rule::Convex, Order::MpvoConvex),
    ("MPVONC", "Williams 1992", Rule::Nonconvex, Order::Mpvonc),
    ("XMPVO", "Silva, Mitchell & Williams 1998", Rule::Xmpvo, Order::Xmpvo),
    ("mpvo", "Halite's", Rule::Mpvo, Order::Mpvo),
];

/// What an order gave.
struct Line {
    verdict: Verdict,
    row: Row,
}

pub(super) fn run(options: &Options, threads: usize) -> Result<()> {
    let given = options.request.scene()?;
    options.request.studied(given.as_ref())?;
    let device = options.request.device(given.as_ref());
    let mut judge = Renderer::with_device(threads, DeviceChoice::Cpu)?;
    let job = judge.install(|| render::prepare(&options.request, given)?.of_mesh("study"))?;
    let (view, _) = job.scene.view()?;
    let geometry = judge.install(|| {
        let points = job.tetrahedra.points(job.mesh.points());
        Geometry::new(&points, &job.tetrahedra, &Faces::new(&points, &job.tetrahedra.corners))
    });
    let truth = progress::during("judging", |p| {
        set(&mut judge, &job)?;
        judge.render(&view, p)
    })?;
    let mut renderer = Renderer::with_engine(threads, device, Engine::Project)?;
    set(&mut renderer, &job)?;
    let (mut mpvo, mut lines) = (Mpvo::default(), Vec::new());
    progress::during("drawing", |p| {
        for (i, (name, place, rule, order)) in ORDERS.into_iter().enumerate() {
            p(i as f64 / ORDERS.len() as f64);
            // Cycles are not left to the walk: what is wrong shows.
            let switches = Switches { order, cycles: Cycles::Cut, ..Switches::default() };
            let variant = Variant { name, place, switches, integral: Choice::default() };
            match draw(variant, options.frames, &mut renderer, &view, &truth) {
                Ok(row) => {
                    let verdict = judge.install(|| {
                        let mut cells = mpvo.sequence(&geometry, &view, rule).cells;
                        cells.reverse();
                        check::check(&geometry, &view, &cells)
                    });
                    lines.push(Line { verdict, row });
                }
                Err(e) => tracing::warn!("{name}: {}", e.to_string().replace('\n', " ")),
            }
        }
    });
    check(&lines)?;
    let found = circles(&mut mpvo, &geometry, &view, &judge);
    output::print(&table(&lines, &found))?;
    if let Some(path) = &options.json {
        let rows: Vec<_> = lines
            .iter()
            .map(|Line { verdict: v, row }| {
                json!({
                    "order": row.variant.name, "switches": row.variant.switches, "pairs": v.pairs,
                    "inversions": v.inversions, "overlaps": v.overlaps, "pixels": v.pixels,
                    "wrong_pixels": v.wrong.len(), "max": row.max, "rmse": row.rmse, "order_ms": row.order_ms,
                    "frame_ms": row.frame_ms,
                })
            })
            .collect();
        let whole = json!({"size": job.scene.size, "tetrahedra": geometry.cells.len(), "orders": rows});
        std::fs::write(path, format!("{whole:#}\n")).with_context(|| path.display().to_string())?;
    }
    let background = job.scene.background.unwrap_or_default().map(|c| c as f32);
    let pictures: Vec<Row> = lines.into_iter().map(|l| l.row).collect();
    sheet(&pictures, &truth, background, options.gain).save(&options.out, Backdrop::Color(background))?;
    Ok(())
}

/// A line on what has no order.
fn circles(mpvo: &mut Mpvo, geometry: &Geometry, view: &View, judge: &Renderer) -> String {
    let s = judge.install(|| mpvo.sequence(geometry, view, Rule::Mpvo));
    format!(
        "{} cells; {} cycles of {} cells, cut in {} places that {} pixels see; {} pixels of overlapping cells\n",
        s.cells.len(),
        s.cycles,
        s.cycle_cells,
        s.cuts,
        s.disordered.len(),
        s.overlapping
    )
}

/// Frames are those of a camera that moves: order and picture. Their ratio to the first one's is what Guthe et al. 2002 have in
/// table 5, with graphics cards of their time.
fn table(lines: &[Line], found: &str) -> String {
    let mut text = format!(
        "{:8} {:>12} {:>10} {:>12} {:>9} {:>9} {:>10} {:>10} {:>6}  {}\n",
        "order", "inversions", "overlaps", "pixels", "max", "rmse", "order ms", "frame ms", "ratio", "by"
    );
    let whole = |l: &Line| l.row.order_ms + l.row.frame_ms;
    for line in lines {
        let Line { verdict: v, row } = line;
        text += &format!(
            "{:8} {:>12} {:>10} {:>12} {:>9.1e} {:>9.1e} {:>10.1} {:>10.1} {:>6.2}  {}\n",
            row.variant.name,
            v.inversions,
            v.overlaps,
            format!("{}/{}", v.wrong.len(), v.pixels),
            row.max,
            row.rmse,
            row.order_ms,
            whole(line),
            whole(line) / whole(&lines[0]),
            row.variant.place
        );
    }
    text + found
}
