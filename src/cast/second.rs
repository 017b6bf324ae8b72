//! Functions of two variables, and light, along rays through grids: voxel by voxel, in f64.
//!
//! In a voxel the scalar, the second variable and the gradient are trilinear, and cubics along a ray. These are cut into parts
//! in which the line through two points of Gauss's rule stands for each: a line with the cubic's own mean and, but for
//! the fourth order, first moment. So the integral of what is smooth is off by the square of what the line is off by, and that
//! is at most [`OFF`] of what the function spans.

use super::gradient::Gradients;
use super::ray::{Frame, Line, Visible, draw, enter, for_each_voxel, least_light};
use super::volume::Samples;
use crate::integral::Light;
use crate::integral::cubic::Cubic;
use crate::integral::second::{LONGEST, Scratch, Second, Segment, places};
use crate::transfer::TransferFunction;
use crate::transfer::bivariate::{Bivariate, Source};
use glam::DVec3;
use std::ops::ControlFlow;

/// How far a line may be off the cubic that it stands for: of the spread of the function's knots, or of the gradient's own
/// length.
const OFF: f64 = 5e-4;

/// Parts of a voxel at most.
const MOST: f64 = 32.0;

/// The first point of Gauss's rule on [0, 1].
const NODE: f64 = 0.211_324_865_405_187_1;

/// What frames of two variables need besides: the second variable, if it is an array, and the gradient.
pub(crate) struct Two<'a> {
    pub(crate) second: &'a Second,
    pub(crate) array: Option<&'a Samples>,
    pub(crate) gradients: Option<&'a Gradients>,
    /// One over what the function spans: of s, and of g.
    pub(crate) over: [f64; 2],
}

/// One over the spread of the knots of `transfer` within the ranges of s and g.
pub(crate) fn spreads(transfer: &TransferFunction, ranges: [[f64; 2]; 2], scale: f64) -> [f64; 2] {
    let wanted = places(transfer, LONGEST / scale);
    [0, 1].map(|k| {
        let [lo, hi] = [ranges[k][0].max(wanted[k][0]), ranges[k][1].min(wanted[k][1])];
        let [lo, hi] = if lo < hi { [lo, hi] } else { ranges[k] };
        if hi > lo { 1.0 / (hi - lo) } else { 0.0 }
    })
}

/// Draws a frame on the current rayon pool; also says how many voxels its rays passed, and how many panels were summed up.
pub(crate) fn render(frame: &Frame, two: &Two, transfer: &TransferFunction) -> (Vec<[f32; 4]>, [u64; 2]) {
    let normal = frame.samples.normal[0];
    let visible = Visible::new(frame.exact, 1);
    let shows = |low: f64, high: f64| match transfer.bivariate().map(Bivariate::source) {
        None | Some(Source::Scalar) => visible.shows(frame.exact.opacity.intervals(low, high)),
        Some(Source::Widgets(widgets)) => {
            let [low, high] = [low, high].map(|s| normal.invert(s));
            widgets.iter().any(|w| w.domain[0][0] <= high && w.domain[0][1] >= low)
        }
        Some(Source::Table(_)) => true,
    };
    let seen = frame.samples.seen(shows);
    draw(frame, |i, j| {
        let mut ray = Ray { frame, two, scratch: Scratch::default(), light: Light::none() };
        let steps = ray.trace(i, j, &seen);
        let Light { color: [r, g, b], transmittance: through } = ray.light;
        ([r, g, b, 1.0 - through], [steps, ray.scratch.panels])
    })
}

struct Ray<'a> {
    frame: &'a Frame<'a>,
    two: &'a Two<'a>,
    scratch: Scratch,
    light: Light<f32>,
}

impl Ray<'_> {
    fn trace(&mut self, i: u32, j: u32, seen: &[bool]) -> u64 {
        let Frame { volume, samples, view, .. } = self.frame;
        let Some((o, d, ends)) = enter(self.frame, i, j) else { return 0 };
        let line = Line { o, d };
        let ray = view.ray(i, j);
        // `enter` counts from the point of the ray that is nearest to the middle.
        let offset = ray.origin - volume.centre;
        let origin = offset - ray.direction * offset.dot(ray.direction);
        let least = least_light(self.two.second.is_direct()) as f32;
        let mut steps = 0;
        for_each_voxel(volume, &line, ends, |at, t, to| {
            steps += 1;
            let c = (at[2] * volume.cells[1] + at[1]) * volume.cells[0] + at[0];
            if seen[samples.block(at)] && !volume.is_hidden(c) {
                let [p, q] = [t, to].map(|t| line.place(volume, at, t).to_array());
                let place = (origin + ray.direction * t) * volume.scale;
                self.voxel(at, [p, q], place, ray.direction, (to - t) * volume.scale);
            }
            if self.light.transmittance < least { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        steps
    }

    /// Adds what lies in a voxel between two places of its unit cube, `length` apart.
    fn voxel(&mut self, at: [usize; 3], [p, q]: [[f64; 3]; 2], place: DVec3, along: DVec3, length: f64) {
        let Frame { volume, samples, .. } = self.frame;
        let c = (at[2] * volume.cells[1] + at[1]) * volume.cells[0] + at[0];
        let of = |samples: &Samples| {
            let normal = samples.normal[0];
            if samples.of_cells {
                return Cubic::constant(normal.invert(samples.of_cell(c, 0)));
            }
            Cubic::along(&samples.corners(at, 0).map(|s| normal.invert(s)), p, q)
        };
        let s = of(samples);
        let mut g = self.two.array.map_or(Cubic::constant(0.0), of);
        let mut vector = [Cubic::constant(0.0); 3];
        if let Some(gradients) = self.two.gradients {
            let [row, layer] = samples.stride;
            let first = at[2] * layer + at[1] * row + at[0];
            let ends = [0, 1, row, row + 1, layer, layer + 1, layer + row, layer + row + 1];
            let corners = ends.map(|i| gradients.at(first + i));
            vector = std::array::from_fn(|k| Cubic::along(&corners.map(|v| v[k]), p, q));
            if self.two.array.is_none() {
                g = Cubic::along(&corners.map(|v| v.length() * gradients.longest()), p, q);
            }
        }
        if ![s, g].iter().chain(&vector).all(|c| c.0.iter().all(|v| v.is_finite())) {
            return;
        }
        let parts = self.parts(&s, &g, &vector);
        for part in 0..parts as usize {
            let [from, to] = [part as f64 / parts, (part + 1) as f64 / parts];
            let line = |c: &Cubic| {
                let [a, b] = [NODE, 1.0 - NODE].map(|x| c.at(from + (to - from) * x));
                let rise = (b - a) / (1.0 - 2.0 * NODE);
                [a - rise * NODE, rise]
            };
            let ([s, g], v) = ([s, g].map(|c| line(&c)), vector.map(|c| line(&c)));
            let segment = Segment {
                at: [s[0], g[0]],
                rise: [s[1], g[1]],
                vector: DVec3::from_array(v.map(|v| v[0])),
                turn: DVec3::from_array(v.map(|v| v[1])),
                place: place + along * (length * from),
                along,
                length: length * (to - from),
            };
            self.two.second.add(&segment, &mut self.scratch, &mut self.light);
        }
    }

    /// Into how many parts a voxel is cut: a line is off by h²/12 times the second derivative, which is six times the greatest
    /// second difference of coefficients, at most.
    fn parts(&self, s: &Cubic, g: &Cubic, vector: &[Cubic; 3]) -> f64 {
        let bend = |c: &Cubic| {
            let [a, b, c, d] = c.0;
            0.5 * (a - 2.0 * b + c).abs().max((b - 2.0 * c + d).abs())
        };
        let turn = DVec3::from_array([0, 1, 2].map(|k| bend(&vector[k]))).length();
        let middle = DVec3::from_array([0, 1, 2].map(|k| vector[k].at(0.5))).length();
        let turned = if turn > 0.0 { turn / (middle + turn) } else { 0.0 };
        let [of_s, of_g] = self.two.over;
        let most = (bend(s) * of_s).max(bend(g) * of_g).max(turned);
        (most / OFF).sqrt().ceil().clamp(1.0, MOST)
    }
}
