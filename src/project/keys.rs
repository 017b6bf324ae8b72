//! Keys of cells on the host: which are seen, how deep they are, and in how many parts they are drawn.
//!
//! `classify` finds them on devices that sort, in the same way. Devices in software look up each corner of each cell for
//! itself, lane by lane; here, what is needed of a point is found once.

use super::frame::{GROWTH, Seen};
use super::lines::{self, BINS, Lines};
use super::{Fragments, Order, Switches};
use crate::geometry::{Cell, Geometry, Values};
use crate::gpu::rays::FAR;
use crate::order::MOST_PARTS;
use crate::order::depth::HIDDEN;
use glam::{DVec3, Vec2, Vec3};
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
    let [right, up, forward] = frame.axes();
    let [size, offset] = [frame.size, frame.offset].map(Vec2::from);
    let edge = 1.0 + offset.abs() + 4.0 / size;
    let place = |p: &DVec3| {
        let p = (p - base).as_vec3();
        let z = p.dot(forward);
        let w = if seen.perspective { z + frame.ahead() } else { 1.0 };
        let (x, y) = (p.dot(right), p.dot(up));
        let beside = [x > edge.x * w, x < -edge.x * w, y > edge.y * w, y < -edge.y * w];
        let cut = [w <= 0.0, z < frame.near, z > frame.far];
        // There are more bits than planes; what planes beyond that cut off is drawn, and fragments find nothing.
        let planes = seen.planes.iter().map(|&[a, b, c, d]| p.dot(Vec3::new(a, b, c)) + d < 0.0);
        let all = [w < frame.nearest].into_iter().chain(beside).chain(cut).chain(planes);
        let beyond = all.zip(0..u32::BITS).fold(0, |bits, (is, i)| bits | u32::from(is) << i);
        let pixel = (Vec2::new(x / w - offset.x + 1.0, 1.0 + offset.y - y / w)) * 0.5 * size;
        Place { p, pixel, beyond }
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
    let end_below = |s: f32| (((s + 1.0) * (BINS as f32 / 2.0)) as i32 - 1).clamp(0, BINS as i32 - 1) as usize;
    let (below, above) = (bins[end_below(low)], bins[(end_below(high) + 3).min(BINS)]);
    match parts {
        _ if above.shown == below.shown => 0,
        Parts::OfLines(lines) => ((above.line - below.line) / lines + 1).min(MOST_PARTS),
        _ => 1,
    }
}

/// The centre of the sphere through the corners, from the first of them, and the square of its radius; none if the
/// cell is all but flat.
fn circumsphere(p: [Vec3; 4]) -> Option<(Vec3, f32)> {
    let [b, c, d] = [p[1] - p[0], p[2] - p[0], p[3] - p[0]];
    let sum = b.length_squared() * c.cross(d) + c.length_squared() * d.cross(b) + d.length_squared() * b.cross(c);
    let centre = sum / (2.0 * b.dot(c.cross(d)));
    let square = centre.length_squared();
    (square < FAR).then_some((centre, square))
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
    by: Order,
    parts: Parts,
) -> Vec<u32> {
    let places = places(&geometry.points, seen);
    let [.., forward] = seen.frame.axes();
    let ahead = seen.frame.ahead();
    let key = |(i, cell): (usize, &Cell)| {
        let corners = cell.corners.map(|c| places[c as usize]);
        let all = corners.iter().fold(!NEAR, |bits, c| bits & c.beyond);
        let is_near = corners.iter().any(|c| c.beyond & NEAR != 0);
        if all != 0 || !is_near && between_pixels(corners.map(|c| c.pixel)) {
            return HIDDEN;
        }
        let range = match values {
            Values::Point(v) => range_of(cell.corners.map(|c| v[c as usize])),
            Values::Corner(v) => range_of(v[i]),
            Values::Cell(v) => range_of([v[i]; 4]),
        };
        let count = match range.map_or(0, |range| parts_of(range, bins, parts)) {
            0 => return HIDDEN,
            _ if is_near && parts == Parts::AroundEye => 3,
            count => count,
        };
        let p = corners.map(|c| c.p);
        let sphere = if by == Order::Circumsphere { circumsphere(p) } else { None };
        let (middle, square) = match sphere {
            Some((centre, square)) => (p[0] + centre, square),
            None => ((p[0] + p[1] + p[2] + p[3]) * 0.25, 0.0),
        };
        // Of the squared distance from the eye, with a sphere's radius taken away; its digits are kept where the eye
        // is far.
        let mut depth = middle.dot(forward);
        if seen.perspective {
            depth = (middle.length_squared() - square + 2.0 * ahead * depth) / f32::max(2.0 * ahead, 1.0);
        }
        let bits = depth.to_bits();
        let descending = if depth.is_sign_negative() { bits } else { !(bits | 1 << 31) };
        // No finite depth gives HIDDEN.
        descending & !(MOST_PARTS - 1) | (count - 1)
    };
    geometry.cells.par_iter().with_min_len(LEAST).enumerate().map(key).collect()
}
