mod grid;

use anyhow::Result;
use clap::Args;
use halite::field::{Association, Gradient};
use halite::geometry::TetMesh;
use halite::geometry::contacts::Contacts;
use halite::io::DataSet;
use halite::mesh::cells::{self, Listed, Tetrahedra};
use halite::mesh::faces::Faces;
use halite::mesh::{Array, Attributes, LeftOut, Mesh, Role, Values};
use halite::scene::automatic;
use halite_console::{input, output, parse, progress};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::PathBuf;

/// So many time steps are listed one by one.
const MOST_STEPS: usize = 24;

/// Tell what a mesh holds, and what of it would be drawn; or which devices there are
#[derive(Args)]
pub(crate) struct Options {
    /// The mesh
    #[arg(value_name = "MESH.vtu|-", required_unless_present = "devices")]
    mesh: Option<PathBuf>,
    /// The time step: its number from 0, a time such as 2.0, or "last" [default: the first]
    #[arg(long, value_name = "STEP|TIME", value_parser = parse::time, allow_hyphen_values = true, conflicts_with = "devices")]
    time: Option<halite::io::Time>,
    /// List the devices that `render --device` knows, by index
    #[arg(long, conflicts_with = "mesh")]
    devices: bool,
}

pub(crate) fn run(options: &Options) -> Result<()> {
    let mut text = String::new();
    if let Some(path) = &options.mesh {
        let source = input::source(path)?;
        let step = options.time.map_or(Ok(0), |time| source.step(time))?;
        let read = progress::during("reading", |p| source.read_data_set(step, p))?;
        let name = if input::is_standard(path) { "standard input".to_owned() } else { path.display().to_string() };
        match read {
            DataSet::Grid(grid) => grid::describe(&mut text, &name, &grid, (source.times(), step))?,
            DataSet::Mesh(mesh) => {
                writeln!(text, "{name}: {} cells, {} points", mesh.cells().len(), mesh.points().len())?;
                describe(&mut text, &mesh, (source.times(), step))?;
            }
        }
    } else {
        list_devices(&mut text)?;
    }
    output::print(&text)
}

fn list_devices(out: &mut String) -> Result<()> {
    for d in halite::gpu::devices() {
        writeln!(out, "{:>3}  {}  ({}, {})", d.index, d.name, d.kind, d.driver)?;
        if !d.uuid.is_empty() {
            writeln!(out, "     UUID {}", d.uuid)?;
        }
        if let Some(lacks) = d.lacks {
            writeln!(out, "     not used: {lacks}")?;
        }
    }
    Ok(writeln!(out, "cpu  {} threads", rayon::current_num_threads())?)
}

/// The time steps that a file has, of which `at` is what is described.
fn list_steps(out: &mut String, times: &[f64], at: usize) -> Result<()> {
    if times.is_empty() {
        return Ok(());
    }
    writeln!(out, "\ntime steps")?;
    for (step, time) in times.iter().enumerate() {
        // Of many, those around the ends and this one.
        if times.len() <= MOST_STEPS || step < 3 || step + 3 >= times.len() || step.abs_diff(at) <= 1 {
            let note = if step == at { "  described here" } else { "" };
            writeln!(out, "  {step:>12}  {time}{note}")?;
        } else if step == 3 || step == at + 2 {
            writeln!(out, "  {:>12}", "...")?;
        }
    }
    Ok(())
}

/// The arrays of points, or of cells.
fn list_arrays(out: &mut String, what: &str, arrays: &[Array], known: &Attributes) -> Result<()> {
    if arrays.is_empty() && known.left_out.is_empty() {
        return Ok(());
    }
    writeln!(out, "\n{what}")?;
    let names = arrays.iter().map(|a| &a.name).chain(known.left_out.iter().map(|a| &a.name));
    let wide = names.map(|name| name.chars().count()).max().unwrap_or(0).min(40);
    for a in arrays {
        let kind = if a.components > 1 {
            format!("{} x {}", a.components, type_name(&a.values))
        } else {
            type_name(&a.values).into()
        };
        let role = known.role(&a.name).and_then(|role| Role::ALL.iter().find(|(of, _)| *of == role));
        let note = role.map_or(String::new(), |(_, name)| format!("   ({name})"));
        writeln!(out, "  {:wide$}  {kind:8}  {}{note}", a.name, ranges(a).join("   "))?;
    }
    for LeftOut { name, why } in &known.left_out {
        writeln!(out, "  {name:wide$}  left out: {why}")?;
    }
    Ok(())
}

fn describe(out: &mut String, mesh: &Mesh, (times, step): (&[f64], usize)) -> Result<()> {
    let finite = mesh.points().iter().filter(|p| p.is_finite());
    let (lo, hi) =
        finite.clone().fold((glam::DVec3::INFINITY, glam::DVec3::NEG_INFINITY), |(lo, hi), &p| (lo.min(p), hi.max(p)));
    let broken = mesh.points().len() - finite.count();
    if lo.x <= hi.x {
        for (axis, lo, hi) in [("x", lo.x, hi.x), ("y", lo.y, hi.y), ("z", lo.z, hi.z)] {
            writeln!(out, "  {axis}  {} to {}", short(lo), short(hi))?;
        }
    }
    if broken > 0 {
        writeln!(out, "  {broken} points are not finite")?;
    }

    writeln!(out, "\ncells")?;
    let mut types = BTreeMap::new();
    for &t in &mesh.cells().types {
        *types.entry(t).or_insert(0_usize) += 1;
    }
    let split = Tetrahedra::new(mesh);
    let unsupported = split.as_ref().map(|t| t.skipped.unsupported.clone()).unwrap_or_default();
    for (&t, count) in &types {
        let note = match cells::dimension(t) {
            Some(0..3) => "  not drawn: no volume",
            _ if unsupported.contains_key(&t) => "  not drawn yet",
            _ => "",
        };
        writeln!(out, "  {count:>12}  {}{note}", cells::name(t))?;
    }

    list_steps(out, times, step)?;
    list_arrays(out, "point arrays", mesh.point_arrays(), mesh.point_attributes())?;
    list_arrays(out, "cell arrays", mesh.cell_arrays(), mesh.cell_attributes())?;

    writeln!(out, "\ndrawn")?;
    let tetrahedra = match split {
        Ok(t) => t,
        Err(e) => return Ok(writeln!(out, "  nothing: {e}")?),
    };
    let listed = |cells: &Listed, what: &str| format!("{what} ({cells})");
    let mut row = |count: usize, what: &str| if count > 0 { writeln!(out, "  {count:>12}  {what}") } else { Ok(()) };
    let points = tetrahedra.points(mesh.points());
    let faces = Faces::new(&points, &tetrahedra.corners);
    let geometry = TetMesh::new(&points, &tetrahedra, &faces);
    let contacts = Contacts::new(&geometry);
    let skipped = &tetrahedra.skipped;
    row(tetrahedra.cells, "cells")?;
    row(tetrahedra.corners.len(), "tetrahedra")?;
    row(tetrahedra.added.len(), "points added to split cells")?;
    row(faces.components(), "components")?;
    row(faces.boundary.len(), "boundary faces")?;
    row(skipped.lower_dimensional, "cells left out: no volume")?;
    row(skipped.unsupported.values().sum(), "cells left out: of a type that is not drawn yet")?;
    row(skipped.ghost, "cells left out: ghosts")?;
    row(skipped.invisible, "cells left out: a point is not finite")?;
    row(skipped.empty, "cells left out: polyhedra without faces")?;
    row(skipped.open.count, &listed(&skipped.open, "cells left out: polyhedra whose faces do not close a surface"))?;
    row(skipped.flat.count, &listed(&skipped.flat, "cells left out: polyhedra without volume"))?;
    let inverted = faces.orientation.iter().filter(|o| **o < 0).count();
    row(inverted.min(tetrahedra.corners.len() - inverted), "tetrahedra turned inside out against the others")?;
    row(faces.degenerate, "tetrahedra with two corners at one place, left out")?;
    row(faces.flat, "tetrahedra of no volume")?;
    let crooked = &tetrahedra.crooked;
    row(crooked.count, &listed(crooked, "polyhedra that cross themselves: drawn with overlaps"))?;
    row(faces.non_manifold, "faces of more than two tetrahedra")?;
    row(faces.folded, "faces with both tetrahedra on one side")?;
    let of = if contacts.faces < faces.boundary.len() {
        format!(", of {} looked at", contacts.faces)
    } else {
        String::new()
    };
    row(contacts.touching, &format!("boundary faces that lie on other cells without sharing a face{of}"))?;
    row(contacts.overlapping, &format!("boundary faces inside other cells: cells overlap{of}"))?;
    let choice = automatic::chosen(mesh, None).ok();
    let tuples = match choice.as_ref().and_then(|(scalars, _)| scalars.association) {
        Some(Association::Cell) => tetrahedra.corners.len(),
        _ => points.len(),
    };
    writeln!(out, "  {} of memory to render one scalar", size((geometry.bytes() + 4 * tuples as u64) as f64))?;
    let Some((scalars, why)) = choice else { return Ok(()) };
    writeln!(out, "  \"{}\" if no other array is asked for: {why}", scalars.name)?;
    let gradient = scalars.field(mesh).and_then(|field| Gradient::new(&points, &tetrahedra, &field));
    if let Ok(gradient) = gradient {
        let [lo, hi] = gradient.range().map(short);
        writeln!(
            out,
            "  its gradient is {lo} to {hi} long, and takes {} where it is drawn",
            size(gradient.bytes() as f64)
        )?;
    }
    Ok(())
}

/// The range of each component, and of the magnitude if there are several.
fn ranges(array: &Array) -> Vec<String> {
    let n = array.components;
    let component = |k: usize| move |t: usize| array.values.get(t * n + k);
    let magnitude = |t: usize| (0..n).fold(0.0_f64, |m, k| m.hypot(array.values.get(t * n + k)));
    match n {
        1 => vec![range(array.tuples(), component(0))],
        2..=9 => (0..n)
            .map(|k| format!("{k}: {}", range(array.tuples(), component(k))))
            .chain([format!("magnitude: {}", range(array.tuples(), magnitude))])
            .collect(),
        _ => vec![format!("magnitude: {}", range(array.tuples(), magnitude))],
    }
}

fn range(tuples: usize, value: impl Fn(usize) -> f64 + Sync) -> String {
    let empty = || (f64::INFINITY, f64::NEG_INFINITY, 0_usize, 0_usize);
    let (lo, hi, nan, infinite) = (0..tuples)
        .into_par_iter()
        .fold(empty, |(lo, hi, nan, infinite), t| match value(t) {
            v if v.is_nan() => (lo, hi, nan + 1, infinite),
            v if v.is_infinite() => (lo, hi, nan, infinite + 1),
            v => (lo.min(v), hi.max(v), nan, infinite),
        })
        .reduce(empty, |a, b| (a.0.min(b.0), a.1.max(b.1), a.2 + b.2, a.3 + b.3));
    let mut text = if lo <= hi { format!("{} to {}", short(lo), short(hi)) } else { "no value".into() };
    for (count, what) in [(nan, "NaN"), (infinite, "infinite")] {
        if count > 0 {
            text += &format!(" ({count} {what})");
        }
    }
    text
}

/// Six digits, as short as they get.
fn short(x: f64) -> String {
    let rounded: f64 = format!("{x:.5e}").parse().unwrap_or(x);
    if rounded == 0.0 || (1e-4..1e7).contains(&rounded.abs()) { format!("{rounded}") } else { format!("{rounded:e}") }
}

fn size(bytes: f64) -> String {
    match bytes {
        b if b >= 1e9 => format!("{:.1} GB", b / 1e9),
        b if b >= 1e6 => format!("{:.0} MB", b / 1e6),
        b => format!("{:.0} kB", (b / 1e3).ceil()),
    }
}

fn type_name(values: &Values) -> &'static str {
    match values {
        Values::I8(_) => "i8",
        Values::U8(_) => "u8",
        Values::I16(_) => "i16",
        Values::U16(_) => "u16",
        Values::I32(_) => "i32",
        Values::U32(_) => "u32",
        Values::I64(_) => "i64",
        Values::U64(_) => "u64",
        Values::F32(_) => "f32",
        Values::F64(_) => "f64",
    }
}
