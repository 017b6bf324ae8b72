//! What a regular or rectilinear grid holds.

use super::{list_arrays, list_steps, short, size};
use anyhow::Result;
use glam::{DMat3, DVec3};
use halite::grid::Grid;
use halite::mesh::Values;
use halite::scene::automatic;
use std::fmt::Write;

/// Points that are looked at to say which array is drawn.
const SAMPLES: usize = 1 << 16;

/// What drawing takes besides the values: of each, in bytes a value.
const BESIDES: f64 = 0.01;

pub(super) fn describe(out: &mut String, name: &str, grid: &Grid, (times, step): (&[f64], usize)) -> Result<()> {
    let kind = if grid.is_regular() { "image data" } else { "rectilinear grid" };
    let ([x, y, z], cells) = (grid.size(), grid.cell_count());
    writeln!(out, "{name}: {kind}, {cells} cells, {x} x {y} x {z} points")?;
    if let Some(spacing) = grid.spacing() {
        writeln!(out, "  spacing  {} {} {}", short(spacing.x), short(spacing.y), short(spacing.z))?;
    }
    let direction = grid.direction();
    if direction != DMat3::IDENTITY {
        let axes = [direction.x_axis, direction.y_axis, direction.z_axis];
        let axes = axes.map(|d| format!("{} {} {}", short(d.x), short(d.y), short(d.z)));
        writeln!(out, "  axes along  {}", axes.join("   "))?;
    }
    let corners = (0..8).map(|c| grid.point([0, 1, 2].map(|a| (c >> a & 1) * (grid.size()[a] - 1))));
    let (lo, hi) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)));
    for (axis, lo, hi) in [("x", lo.x, hi.x), ("y", lo.y, hi.y), ("z", lo.z, hi.z)] {
        writeln!(out, "  {axis}  {} to {}", short(lo), short(hi))?;
    }
    list_steps(out, times, step)?;
    list_arrays(out, "point arrays", grid.point_arrays(), grid.point_attributes())?;
    list_arrays(out, "cell arrays", grid.cell_arrays(), grid.cell_attributes())?;

    writeln!(out, "\ndrawn")?;
    if !grid.has_volume() {
        return Ok(writeln!(out, "  nothing: it has one point along an axis, and no volume")?);
    }
    let hidden = grid.hidden().map_or(0, |bits| bits.iter().map(|b| b.count_ones() as usize).sum());
    let mut row = |count: usize, what: &str| if count > 0 { writeln!(out, "  {count:>12}  {what}") } else { Ok(()) };
    row(cells - hidden, "cells, without a list of them")?;
    row(hidden, "cells left out: ghosts, or hidden")?;
    let looked_at = grid.coarse(SAMPLES).and_then(Grid::into_mesh)?;
    let Ok((scalars, why)) = automatic::chosen(&looked_at, None) else { return Ok(()) };
    let arrays = grid.point_arrays().iter().chain(grid.cell_arrays());
    if let Some(array) = arrays.into_iter().find(|a| a.name == scalars.name) {
        let each = match array.values {
            Values::I8(_) | Values::U8(_) => 1.0,
            Values::I16(_) | Values::U16(_) => 2.0,
            Values::I32(_) | Values::U32(_) | Values::F32(_) => 4.0,
            Values::I64(_) | Values::U64(_) | Values::F64(_) => 8.0,
        };
        let bytes = array.tuples() as f64 * each;
        writeln!(out, "  {} of memory to render one scalar", size(bytes * (1.0 + BESIDES)))?;
    }
    Ok(writeln!(out, "  \"{}\" if no other array is asked for: {why}", scalars.name)?)
}
