//! Keys of cells on the host: which are seen, how deep they are, and in how many parts they are drawn.
//!
//! `classify` finds them on devices that sort, in the same way. Devices in software look up each corner of each cell for
//! itself, lane by lane; here, what is needed of a point is found once.

use super::frame::{GROWTH, Seen};
use super::lines::{self, BINS, Lines};
use super::ordering::Sequencing;
use crate::geometry::{Cell, Geometry, Values};
use crate::gpu::rays::FAR;
use crate::order::MOST_PARTS;
use crate::order::depth::HIDDEN;
use crate::project::{Fragments, Order, Switches};
use glam::{DVec2, DVec3, Vec2, Vec3};
use rayon::prelude::*;

/// Points or cells that one task handles at least.
const LEAST: usize = 1 << 12;

/// Which cells are drawn in parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Parts {
    /// None.
    None,
    /// Those of more lines of the function than this.
    OfLines(u32),
    /// Those around the eye, in three.
    AroundEye,
}

impl Parts {
    pub(super) fn new(switches: &Switches, lines: Lines) -> Self {
        match (switches.fragments, lines) {
            (Fragments::Intersected, Lines::All { count, .. }) => Parts::OfLines(count as u32),
            (Fragments::Intersected, _) => Parts::None,
            _ => Parts::AroundEye,
        }
    }
}

/// What keys need of a point.
#[derive(Debug, Clone, Copy)]
struct Place {
    /// From the frame's base.
    p: Vec3,
    /// In the image, in pixels; of no use if it is near.
    pixel: Vec2,
    /// Bits of what it is: a cell is hidden if its corners share one; but for the first, [`NEAR`].
    beyond: u32,
}

/// Less deep than cells may be that are not special.
const NEAR: u32 = 1;

/// Places of points, in the order of the points.
fn places(points: &[DVec3], seen: &Seen) -> Vec<Place> {
    let frame = &seen.frame;
    let base = frame.base();
    let [right, up, forward] = frame.axes().map(Vec3::as_dvec3);
    let [size, offset] = [frame.size, frame.offset].map(|v| Vec2::from(v).as_dvec2());
    let edge = 1.0 + offset.abs() + 4.0 / size;
    let [near, far, nearest] = [frame.near, frame.far, frame.nearest].map(f64::from);
    let ahead = f64::from(frame.ahead());
    // In f64: a picture may show a millionth of the mesh.
    let place = |p: &DVec3| {
        let d = p - base;
        let z = d.dot(forward);
        let w = if seen.perspective { z + ahead } else { 1.0 };
        let (x, y) = (d.dot(right), d.dot(up));
        let beside = [x > edge.x * w, x < -edge.x * w, y > edge.y * w, y < -edge.y * w];
        let cut = [w <= 0.0, z < near, z > far];
        let p = d.as_vec3();
        // There are more bits than planes; what planes beyond that cut off is drawn, and fragments find nothing.
        let planes = seen.planes.iter().map(|&[a, b, c, d]| p.dot(Vec3::new(a, b, c)) + d < 0.0);
        let all = [w < nearest].into_iter().chain(beside).chain(cut).chain(planes);
        let beyond = all.zip(0..u32::BITS).fold(0, |bits, (is, i)| bits | u32::from(is) << i);
        let pixel = DVec2::new(x / w - offset.x + 1.0, 1.0 + offset.y - y / w) * 0.5 * size;
        Place { p, pixel: pixel.as_vec2(), beyond }
    };
    points.par_iter().with_min_len(LEAST).map(place).collect()
}

/// The least and the greatest of the last component of a cell's values; none if any value is not finite.
fn range_of<const N: usize>(v: [[f32; N]; 4]) -> Option<[f32; 2]> {
    let finite = v.as_flattened().iter().all(|v| v.is_finite());
    let last = v.map(|v| v[N - 1]);
    finite.then(|| [last.into_iter().fold(f32::MAX, f32::min), last.into_iter().fold(f32::MIN, f32::max)])
}

/// In how many parts a cell is drawn whose values are in a range, of which `bins` tell what is seen; 0 if nothing is.
fn parts_of([low, high]: [f32; 2], bins: &[lines::End], parts: Parts) -> u32 {
    // One further than needed: rounding.
    let end_below = |s: f32| (((s + 1.0) * (BINS as f32 / 2.0)).clamp(0.0, BINS as f32) as usize).saturating_sub(1);
    let (below, above) = (bins[end_below(low)], bins[(end_below(high) + 3).min(BINS)]);
    match parts {
        _ if above.shown == below.shown => 0,
        Parts::OfLines(lines) => ((above.line - below.line) / lines + 1).min(MOST_PARTS),
        _ => 1,
    }
}

/// How far a cell is for [`Order::Circumsphere`]: the power of the eye with respect to the sphere through the corners, which
/// are seen from the eye; in a parallel view, whose eye is beyond all, how deep the sphere's centre is. Of a cell that is all
/// but flat, the same of its middle.
fn power(p: [DVec3; 4], forward: Option<DVec3>) -> f64 {
    let [b, c, d] = [p[1] - p[0], p[2] - p[0], p[3] - p[0]];
    let sum = b.length_squared() * c.cross(d) + c.length_squared() * d.cross(b) + d.length_squared() * b.cross(c);
    let centre = sum / (2.0 * b.dot(c.cross(d)));
    if centre.length_squared() < f64::from(FAR) {
        // Without the radius, whose square is that of the way from the first corner to the centre.
        return forward.map_or_else(|| p[0].dot(p[0] + 2.0 * centre), |forward| (p[0] + centre).dot(forward));
    }
    let middle = p.iter().sum::<DVec3>() / 4.0;
    forward.map_or_else(|| middle.length_squared(), |forward| middle.dot(forward))
}

/// Keys by rank, from the farthest cell on, of cells of these distances and numbers of parts; none of those that are not seen.
fn ranked(cells: Vec<Option<(f64, u32)>>) -> Vec<u32> {
    let mut seen: Vec<(f64, u32)> = (0..).zip(&cells).filter_map(|(i, c)| c.map(|c| (c.0, i))).collect();
    seen.par_sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut keys = vec![HIDDEN; cells.len()];
    for (rank, (_, i)) in (0..).zip(seen) {
        let count = cells[i as usize].map_or(1, |c| c.1);
        keys[i as usize] = (rank * MOST_PARTS) | (count - 1);
    }
    keys
}

/// Whether no pixel's centre is within the rectangle around points of the image.
fn between_pixels(at: [Vec2; 4]) -> bool {
    let low = at[0].min(at[1]).min(at[2].min(at[3])) - (0.5 + 2.0 * GROWTH);
    let high = at[0].max(at[1]).max(at[2].max(at[3])) - (0.5 - 2.0 * GROWTH);
    // In place of floor, which is a call on old processors. Far outside the image, integers end, and nothing is hidden.
    let none = |low: f32, high: f32| {
        let floor = high as i32 as f32;
        floor - f32::from(u8::from(floor > high)) < low
    };
    none(low.x, high.x) || none(low.y, high.y)
}

/// The key of each cell, for [`depth::order`](crate::order::depth::order).
pub(super) fn keys<const N: usize>(
    geometry: &Geometry,
    values: &Values<N>,
    bins: &[lines::End],
    seen: &Seen,
    Sequencing { by, parts, all }: Sequencing,
) -> Vec<u32> {
    let places = places(&geometry.points, seen);
    let [.., forward] = seen.frame.axes();
    let ahead = seen.frame.ahead();
    let count = |i: usize, cell: &Cell| {
        let corners = cell.corners.map(|c| places[c as usize]);
        let beyond = corners.iter().fold(!NEAR, |bits, c| bits & c.beyond);
        let is_near = corners.iter().any(|c| c.beyond & NEAR != 0);
        if beyond != 0 || !is_near && between_pixels(corners.map(|c| c.pixel)) {
            return 0;
        }
        let range = match values {
            Values::Point(v) => range_of(cell.corners.map(|c| v[c as usize])),
            Values::Corner(v) => range_of(v[i]),
            Values::Cell(v) => range_of([v[i]; 4]),
        };
        match range.map_or(0, |range| if all { 1 } else { parts_of(range, bins, parts) }) {
            0 => 0,
            _ if is_near && parts == Parts::AroundEye => 3,
            count => count,
        }
    };
    let cells = geometry.cells.par_iter().with_min_len(LEAST).enumerate();
    if by == Order::Circumsphere {
        // In f64, which spheres of slivers and of cells far away ask for.
        let (eye, parallel) = (seen.eye.unwrap_or_default(), seen.eye.is_none().then_some(seen.direction));
        let power = |cell: &Cell| power(cell.corners.map(|c| geometry.points[c as usize] - eye), parallel);
        return ranked(
            cells.map(|(i, cell)| Some(count(i, cell)).filter(|&n| n > 0).map(|n| (power(cell), n))).collect(),
        );
    }
    let key = |(i, cell): (usize, &Cell)| {
        let count = count(i, cell);
        if count == 0 {
            return HIDDEN;
        }
        let p = cell.corners.map(|c| places[c as usize].p);
        let middle = (p[0] + p[1] + p[2] + p[3]) * 0.25;
        // Of the squared distance from the eye; its digits are kept where the eye is far.
        let mut depth = middle.dot(forward);
        if seen.perspective {
            depth = (middle.length_squared() + 2.0 * ahead * depth) / f32::max(2.0 * ahead, 1.0);
        }
        let bits = depth.to_bits();
        let descending = if depth.is_sign_negative() { bits } else { !(bits | 1 << 31) };
        // No finite depth gives HIDDEN.
        descending & !(MOST_PARTS - 1) | (count - 1)
    };
    cells.map(key).collect()
}
