//! Equations 7, 9 and 10 of Song et al. (2009) as published: the light of a segment is a difference of values of a table, all of it in
//! f32, and of a wave at most one peak is in a cell. How many segments of a mesh that fails for, and by how much.

use super::places::Places;
use halite::field::Gradient;
use halite_console::request::Job;
use serde_json::{Value, json};
use std::f64::consts::PI;

/// Segments that are tried.
const TRIED: usize = 6000;
/// Texels of a table along each axis.
const TEXELS: usize = 512;
/// The greatest P of equation 7, and α/k of equation 10, in tables: of greater ones f32 does not hold the exponential.
const GREATEST: f64 = 80.0;
/// By how many √2 σ tables go to either side of a Gaussian.
const ASIDE: f64 = 6.0;
/// Steps of sums that stand for the truth.
const STEPS: usize = 1500;
/// Depth of segments that are as good as empty, and share of a wave, or of √2 σ, along which nothing changes: those are uniform.
const EMPTY: f64 = 1e-4;
const STILL: f64 = 1e-4;
/// Shares of its light by which a segment is off: more than closed forms here may be, and more than one sees.
const OFF: [f64; 2] = [1e-5, 1e-2];

/// A segment in a cell: s, g and its length.
struct Segment {
    s: [f64; 2],
    g: [f64; 2],
    length: f64,
}

/// A widget of these equations.
#[derive(Clone, Copy, PartialEq)]
enum Widget {
    Gaussian,
    Triangle,
    Sinusoid,
}

/// How much of a segment's length is seen: truly, of what the equations hold for; by values in f32; by texels; and truly of all.
struct Tried {
    truth: f64,
    values: f32,
    texels: f32,
    all: f64,
    is_more: bool,
}

/// What came out of a widget's segments.
pub(super) struct Published {
    name: &'static str,
    equation: &'static str,
    segments: usize,
    values: Errors,
    texels: Errors,
    /// The share of segments with more than one peak, and the light behind that, of all.
    several: f64,
    lost: f64,
}

/// The shares of segments that are off, by either bound, or no number; and the error of half and of nine tenths of them, of their
/// light.
struct Errors {
    off: [f64; 2],
    none: f64,
    half: f64,
    most: f64,
}

/// A function's integral from 0 on, in steps: exact in between as far as a cubic is.
struct Sums {
    step: f64,
    from: f64,
    value: Vec<f64>,
    slope: Vec<f64>,
}

impl Sums {
    fn new(f: impl Fn(f64) -> f64, [from, to]: [f64; 2], steps: usize) -> Self {
        let step = (to - from) / steps as f64;
        let slope: Vec<f64> = (0..=steps).map(|i| f(from + i as f64 * step)).collect();
        let mut value = vec![0.0];
        for i in 0..steps {
            let middle = f(from + (i as f64 + 0.5) * step);
            value.push(value[i] + step / 6.0 * (slope[i] + 4.0 * middle + slope[i + 1]));
        }
        Sums { step, from, value, slope }
    }

    fn at(&self, x: f64) -> f64 {
        let place = ((x - self.from) / self.step).clamp(0.0, (self.value.len() - 1) as f64);
        let i = (place as usize).min(self.value.len() - 2);
        let (u, h) = (place - i as f64, self.step);
        let ([a, b], [c, d]) = ([self.value[i], self.value[i + 1]], [self.slope[i] * h, self.slope[i + 1] * h]);
        a + u * (c + u * (3.0 * (b - a) - 2.0 * c - d + u * (2.0 * (a - b) + c + d)))
    }
}

/// A table over (row, column), read as textures are.
struct Table {
    rows: f64,
    columns: [f64; 2],
    texels: Vec<f32>,
}

impl Table {
    /// Of the integral of `f` of a row's number from 0 on, along its columns.
    fn new(f: impl Fn(f64, f64) -> f64, rows: f64, columns: [f64; 2]) -> Self {
        let mut texels = vec![];
        for i in 0..TEXELS {
            let row = rows * i as f64 / (TEXELS - 1) as f64;
            let sums = Sums::new(|x| f(row, x), columns, 8 * (TEXELS - 1));
            let zero = sums.at(0.0);
            texels.extend((0..TEXELS).map(|j| (sums.value[8 * j] - zero) as f32));
        }
        Table { rows, columns, texels }
    }

    fn at(&self, row: f32, x: f32) -> f32 {
        let last = (TEXELS - 1) as f32;
        let place = |share: f32| {
            let at = share.clamp(0.0, 1.0) * last;
            let below = at.floor().min(last - 1.0);
            (below as usize, at - below)
        };
        let [low, high] = self.columns.map(|c| c as f32);
        let ((i, u), (j, v)) = (place(row / self.rows as f32), place((x - low) / (high - low)));
        let texel = |i: usize, j: usize| self.texels[TEXELS * i + j];
        let of = |i: usize| texel(i, j) + (texel(i, j + 1) - texel(i, j)) * v;
        of(i) + (of(i + 1) - of(i)) * u
    }
}

/// What is seen of a length of 1 whose depth is the integral of `depth`.
fn seen(depth: impl Fn(f64) -> f64, [from, to]: [f64; 2]) -> f64 {
    let h = (to - from) / STEPS as f64;
    let (mut before, mut sum, mut last) = (0.0_f64, 0.0, depth(from));
    for i in 0..STEPS {
        let u = from + i as f64 * h;
        let (middle, next) = (depth(u + 0.5 * h), depth(u + h));
        let to_middle = h / 24.0 * (5.0 * last + 8.0 * middle - next);
        let all = h / 6.0 * (last + 4.0 * middle + next);
        sum += h / 6.0 * (-before).exp() * (1.0 + 4.0 * (-to_middle).exp() + (-all).exp());
        (before, last) = (before + all, next);
    }
    sum
}

/// The equations, and what they look up.
struct Equations {
    center: [f64; 2],
    sigma: [f64; 2],
    start: f64,
    period: f64,
    /// α_max of Gaussians and of waves, per length.
    alpha: [f64; 2],
    erf: Sums,
    of_gaussian: Table,
    of_falling: Table,
    of_sine: Table,
}

impl Equations {
    fn new(places: &Places, edge: f64) -> Self {
        let ([center, sigma, [start, period]], alpha) = places.published();
        let erf = Sums::new(|t| 2.0 / PI.sqrt() * (-t * t).exp(), [0.0, ASIDE], 6000);
        let signed = |t: f64| erf.at(t.abs()).copysign(t);
        let of_gaussian = Table::new(|p, t| (-p * signed(t)).exp(), GREATEST, [-ASIDE, ASIDE]);
        // As bounded by the longest edge; of one α_max.
        let of_falling = Table::new(|_, v| (alpha[1] * v * v).exp(), 1.0, [0.0, (edge / 2.0).sqrt()]);
        let of_sine = Table::new(|q, t| (q * t.cos()).exp(), GREATEST, [0.0, PI]);
        Equations { center, sigma, start, period, alpha, erf, of_gaussian, of_falling, of_sine }
    }

    fn erf(&self, t: f64) -> f64 {
        self.erf.at(t.abs()).copysign(t)
    }

    /// What the equation of `widget` makes of a segment; none where that is empty, or uniform.
    fn of(&self, widget: Widget, segment: &Segment) -> Option<Tried> {
        if widget == Widget::Gaussian { self.gaussian(segment) } else { self.wave(widget, segment) }
    }

    /// Equation 7: (c/A) e^{P erf B} (table(P, A D + B) − table(P, B)).
    fn gaussian(&self, segment: &Segment) -> Option<Tried> {
        let ends = [segment.s, segment.g];
        let [ds, dg] = [0, 1].map(|k| (ends[k][0] - self.center[k]) / (self.sigma[k] * 2_f64.sqrt()));
        let [ks, kg] = [0, 1].map(|k| (ends[k][1] - ends[k][0]) / (self.sigma[k] * 2_f64.sqrt() * segment.length));
        let a = ks.hypot(kg);
        if a * segment.length < STILL {
            return None;
        }
        let b = (ks * ds + kg * dg) / a;
        let rest = ds * ds + dg * dg - b * b;
        let p = self.alpha[0] * PI.sqrt() * (-rest).exp() / (2.0 * a);
        let end = a * segment.length + b;
        if p * (self.erf(end) - self.erf(b)) < EMPTY {
            return None;
        }
        let depth = |u: f64| {
            let t = a * segment.length * u + b;
            self.alpha[0] * segment.length * (-rest - t * t).exp()
        };
        let all = seen(depth, [0.0, 1.0]);
        let [a, b, p, end, length] = [a, b, p, end, segment.length].map(|x| x as f32);
        let (low, high) = (self.exact(p, b), self.exact(p, end));
        let front = (p * self.erf(b.into()) as f32).exp() / a / length;
        let (texel_low, texel_high) = (self.of_gaussian.at(p, b), self.of_gaussian.at(p, end));
        let (values, texels) = (front * (high - low), front * (texel_high - texel_low));
        Some(Tried { truth: all, values, texels, all, is_more: false })
    }

    /// ∫₀ᵗ e^{−P erf τ} dτ, rounded.
    fn exact(&self, p: f32, t: f32) -> f32 {
        let (p, end) = (f64::from(p), f64::from(t.abs()));
        let sign = if t < 0.0 { -1.0 } else { 1.0 };
        // Steps in which the exponent changes little; beyond where it is great, there is nothing, or no number.
        let (mut x, mut sum) = (0.0, 0.0);
        let f = |x: f64| (-sign * p * self.erf(x)).exp();
        while x < end {
            if p * self.erf(x) > 95.0 {
                return if sign < 0.0 { f32::NEG_INFINITY } else { sum as f32 };
            }
            let h = (0.3 / (1.0 + p * (-x * x).exp())).min(0.05).min(end - x);
            sum += h / 6.0 * (f(x) + 4.0 * f(x + h / 2.0) + f(x + h));
            x += h;
        }
        (sign * sum) as f32
    }

    /// Equations 9 and 10, of one peak.
    fn wave(&self, widget: Widget, segment: &Segment) -> Option<Tried> {
        let [from, to] = segment.s.map(|s| (s - self.start) / self.period);
        let travel = (to - from).abs();
        if travel < STILL {
            return None;
        }
        let height = |phase: f64| {
            let z = phase - phase.round();
            if widget == Widget::Triangle { 2.0 * z.abs() } else { (PI * z).sin().abs() }
        };
        let depth = |u: f64| self.alpha[1] * segment.length * height(from + (to - from) * u);
        let total: f64 = (0..64).map(|i| depth((f64::from(i) + 0.5) / 64.0) / 64.0).sum();
        if total < EMPTY {
            return None;
        }
        // A side of a triangle, or an arch of a sine, is half a phase, or one. A triangle's peak has two.
        let (side, most) = if widget == Widget::Triangle { (0.5, 2) } else { (1.0, 1) };
        let sign = (to - from).signum();
        let mut ends = vec![0.0];
        let next = |phase: f64| {
            let turns = phase / side * sign;
            let whole = (turns + 1e-9).floor() + 1.0;
            whole * side * sign
        };
        let mut phase = from;
        while ends.len() <= most {
            phase = next(phase);
            let u = (phase - from) / (to - from);
            ends.push(u.min(1.0));
            if u >= 1.0 {
                break;
            }
        }
        let last = ends[ends.len() - 1];
        let (truth, all) = (seen(depth, [0.0, last]), seen(depth, [0.0, 1.0]));
        let [mut values, mut texels, mut through] = [0.0_f32, 0.0, 1.0];
        for part in ends.windows(2) {
            let [a, b] = [part[0], part[1]].map(|u| from + (to - from) * u);
            let of = |by_texels: bool| match widget {
                Widget::Triangle => self.side(segment.length / travel, [a, b], by_texels),
                _ => self.arch(segment.length / travel, [a, b], by_texels),
            };
            (values, texels) = (values + through * of(false), texels + through * of(true));
            let passed = Sums::new(depth, [part[0], part[1]], 64).value[64];
            through *= (-passed).exp() as f32;
        }
        let length = segment.length as f32;
        Some(Tried { truth, values: values / length, texels: texels / length, all, is_more: last < 1.0 })
    }

    /// Equation 9, and that of the falling side: between two phases, of which each is so long.
    fn side(&self, length: f64, [a, b]: [f64; 2], by_texels: bool) -> f32 {
        let alpha = self.alpha[1];
        let whole = 0.5 * length;
        let height = |phase: f64| 2.0 * (phase - phase.round()).abs();
        let inside = [0.75 * a + 0.25 * b, 0.25 * a + 0.75 * b].map(height);
        if inside[1] > inside[0] {
            let k = (alpha / whole) as f32;
            let [d1, d2] = [a, b].map(|phase| (height(phase) * whole) as f32);
            let root = (k / 2.0).sqrt();
            let erf = |x: f32| self.erf(f64::from(x).min(ASIDE)) as f32;
            return (PI as f32 / (2.0 * k)).sqrt() * (k / 2.0 * d1 * d1).exp() * (erf(root * d2) - erf(root * d1));
        }
        let root = (2.0 * whole) as f32;
        // (D_t − λ)/√(2 D_t)
        let [v3, v4] = [a, b].map(|phase| (height(phase) * whole) as f32 / root.sqrt());
        let value = |v: f32| {
            if by_texels {
                return self.of_falling.at(0.0, v);
            }
            // e^{αv²} of more than 95 is no number.
            let v = f64::from(v);
            if alpha * v * v > 95.0 {
                return f32::INFINITY;
            }
            let sums = Sums::new(|x| (alpha * x * x).exp(), [0.0, v.max(1e-30)], 200);
            sums.value[200] as f32
        };
        root.sqrt() * (-(alpha as f32) * v3 * v3).exp() * (value(v3) - value(v4))
    }

    /// Equation 10, between two phases of an arch, of which each is so long.
    fn arch(&self, length: f64, [a, b]: [f64; 2], by_texels: bool) -> f32 {
        let q = self.alpha[1] * length / PI;
        let middle = (0.5 * (a + b)).floor();
        // From the side where it begins.
        let angle = |phase: f64| (if b > a { phase - middle } else { middle + 1.0 - phase }).clamp(0.0, 1.0) * PI;
        let [from, to] = [angle(a) as f32, angle(b) as f32];
        let value = |t: f32| {
            if by_texels {
                return self.of_sine.at(q as f32, t);
            }
            if q > 95.0 {
                return f32::INFINITY;
            }
            Sums::new(|x| (q * x.cos()).exp(), [0.0, f64::from(t).max(1e-30)], 400).value[400] as f32
        };
        (length / PI) as f32 * (-(q as f32) * from.cos()).exp() * (value(to) - value(from))
    }
}

/// Segments through cells chosen at random, between places chosen at random on two of their faces; and the longest edge of these.
fn segments(job: &Job, gradient: &Gradient) -> (Vec<Segment>, f64) {
    let points = job.tetrahedra.points(job.mesh.points());
    let values = job.tetrahedra.values(job.field.values(), 1);
    let mut state = 9_u64;
    let mut random = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let cells = &job.tetrahedra.corners;
    let (mut all, mut longest) = (vec![], 0.0_f64);
    for _ in 0..TRIED {
        let corners = cells[((random() * cells.len() as f64) as usize).min(cells.len() - 1)].map(|p| p as usize);
        for (i, &p) in corners.iter().enumerate() {
            longest = corners[..i].iter().fold(longest, |m, &q| m.max(points[p].distance(points[q])));
        }
        let first = (random() * 4.0) as usize % 4;
        let second = (first + 1 + (random() * 3.0) as usize % 3) % 4;
        let ends = [first, second].map(|face| {
            let mut weights: [f64; 4] = std::array::from_fn(|_| -(1.0 - random()).ln());
            weights[face] = 0.0;
            let sum: f64 = weights.iter().sum();
            weights.map(|w| w / sum)
        });
        let mix = |of: &dyn Fn(usize) -> f64| ends.map(|w| (0..4).map(|k| w[k] * of(corners[k])).sum::<f64>());
        let [from, to] = ends.map(|w| (0..4).map(|k| points[corners[k]] * w[k]).sum::<glam::DVec3>());
        let segment =
            Segment { s: mix(&|p| values[p]), g: mix(&|p| gradient.vectors()[p].length()), length: from.distance(to) };
        if segment.length > 0.0 && segment.s.iter().chain(&segment.g).all(|v| v.is_finite()) {
            all.push(segment);
        }
    }
    (all, longest)
}

impl Errors {
    fn new(tried: &[Tried], of: impl Fn(&Tried) -> f32) -> Self {
        let count = tried.len().max(1) as f64;
        let mut errors: Vec<f64> = tried
            .iter()
            .map(|t| {
                let error = (f64::from(of(t)) - t.truth).abs() / t.truth;
                if error.is_finite() { error } else { f64::INFINITY }
            })
            .collect();
        errors.sort_unstable_by(f64::total_cmp);
        let at = |share: f64| errors.get((share * count) as usize).copied().unwrap_or(0.0);
        let share = |wanted: &dyn Fn(f64) -> bool| errors.iter().filter(|e| wanted(**e)).count() as f64 / count;
        Errors {
            off: OFF.map(|most| share(&|e| e > most)),
            none: share(&f64::is_infinite),
            half: at(0.5),
            most: at(0.9),
        }
    }

    fn report(&self) -> Value {
        json!({"off": self.off, "no_number": self.none, "half": self.half, "nine_tenths": self.most})
    }
}

impl Published {
    /// Of each widget of `places` on the mesh of `job`.
    pub(super) fn all(job: &Job, places: &Places, gradient: &Gradient) -> Vec<Self> {
        let (segments, edge) = segments(job, gradient);
        let equations = Equations::new(places, edge);
        let widgets = [
            (Widget::Gaussian, "Gaussian", "equation 7"),
            (Widget::Triangle, "triangle", "equation 9"),
            (Widget::Sinusoid, "sinusoid", "equation 10"),
        ];
        let all = widgets.map(|(widget, name, equation)| {
            let tried: Vec<Tried> = segments.iter().filter_map(|s| equations.of(widget, s)).collect();
            let count = tried.len().max(1) as f64;
            let whole: f64 = tried.iter().map(|t| t.all).sum();
            let lost: f64 = tried.iter().map(|t| t.all - t.truth).sum();
            Published {
                name,
                equation,
                segments: tried.len(),
                values: Errors::new(&tried, |t| t.values),
                texels: Errors::new(&tried, |t| t.texels),
                several: tried.iter().filter(|t| t.is_more).count() as f64 / count,
                lost: if whole > 0.0 { lost / whole } else { 0.0 },
            }
        });
        all.into()
    }

    pub(super) fn report(&self) -> Value {
        json!({
            "widget": self.name, "stands_in": self.equation, "segments": self.segments, "values": self.values.report(),
            "texels": self.texels.report(), "several_peaks": self.several, "light_behind": self.lost,
        })
    }
}

/// What is printed of them.
pub(super) fn described(all: &[Published]) -> String {
    let mut text = String::from(
        "tables as published, in f32, on random segments: shares of them, and the error of half, of their light\n",
    );
    let heads = ["", "exact values, rounded", "512 x 512 texels", "more than one peak"];
    text += &format!("{:20}  {:^35}  {:^35}  {:^22}\n", heads[0], heads[1], heads[2], heads[3]);
    let of_each = format!("{:>8} {:>8} {:>9} {:>7}", "> 1e-5", "> 1 %", "no number", "half");
    text += &format!(
        "{:10} {:>9}  {of_each}  {of_each}  {:>10} {:>11}  {}\n",
        "widget", "segments", "segments", "light lost", "as in"
    );
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    for p in all {
        text += &format!("{:10} {:>9}  ", p.name, p.segments);
        for e in [&p.values, &p.texels] {
            let [some, many] = e.off.map(percent);
            text += &format!("{some:>8} {many:>8} {:>9} {:>7.0e}  ", percent(e.none), e.half);
        }
        text += &format!("{:>10} {:>11}  {}\n", percent(p.several), percent(p.lost), p.equation);
    }
    text + "\n"
}
