//! The ray-segment integral: what a straight piece of a ray inside one cell emits and absorbs.
//!
//! Inside a tetrahedron the scalar is linear along the ray, so a segment is its values at both ends and its length. It is
//! split where the scalar crosses a knot of the transfer function; in such a *piece* extinction τ and colour c are linear
//! too. With optical depths x = τ_f l and y = τ_b l per piece length l, and T(u) = x u + (y − x) u²/2 for u in [0, 1]:
//!
//! - opacity α = 1 − e^{−(x+y)/2};
//! - chromatic emission q = c τ: C = c_f (α − β) + c_b β with β = ∫ u T′(u) e^{−T(u)} du, which is Ψ − e^{−(x+y)/2} in the
//!   terms of Moreland & Angel (2004, partial pre-integration) without its cancellation;
//! - direct emission q: C = l (q_f (Ψ − Φ) + q_b Φ) with Ψ = ∫ e^{−T(u)} du and Φ = ∫ u e^{−T(u)} du.
//!
//! The integrals over u are Gauss–Legendre sums; their nodes suffice for f32, and pieces of great optical depth are first cut
//! where nothing more can be seen.

use crate::field::{Kind, Normal};
use crate::real::Real;
use crate::transfer::{Convention, Emission, OPAQUE, TransferFunction};

/// Extinction that stands for "opaque", per normalised unit of length: even the thinnest slab that f32 can tell from
/// nothing is then opaque, and its square is still finite.
pub(crate) const OPAQUE_EXTINCTION: f64 = 1e15;

/// Optical depth beyond which e^{−T} is nothing in f32.
pub(crate) const DEEP: f64 = 18.0;

/// Nodes in [0, 1] and weights of the 3-point Gauss–Legendre rule.
pub(crate) const GAUSS_3: [[f64; 2]; 3] =
    [[0.112_701_665_379_258_31, 5.0 / 18.0], [0.5, 8.0 / 18.0], [0.887_298_334_620_741_7, 5.0 / 18.0]];

/// Nodes in [0, 1] and weights of the 6-point Gauss–Legendre rule.
pub(crate) const GAUSS_6: [[f64; 2]; 6] = [
    [0.033_765_242_898_423_98, 0.085_662_246_189_585_18],
    [0.169_395_306_766_867_74, 0.180_380_786_524_069_3],
    [0.380_690_406_958_401_56, 0.233_956_967_286_345_52],
    [0.619_309_593_041_598_5, 0.233_956_967_286_345_52],
    [0.830_604_693_233_132_2, 0.180_380_786_524_069_3],
    [0.966_234_757_101_576, 0.085_662_246_189_585_18],
];

/// Optical depth up to which 3 nodes are enough, and that one panel of 6 nodes covers.
pub(crate) const SHALLOW: f64 = 0.25;
/// See [`SHALLOW`].
pub(crate) const PANEL: f64 = 4.0;

/// What one piece does: its opacity and the weights of the emission at its two ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece<R> {
    /// Opacity, in [0, 1].
    pub alpha: R,
    /// Weight of the front end's colour (chromatic) or of its emission times length (direct).
    pub front: R,
    /// The same for the back end.
    pub back: R,
}

impl<R: Real> Piece<R> {
    /// A piece of optical depths `x` (τ_f l) and `y` (τ_b l), both finite and at least 0. Error at most 1e-6, and 1e-5 of α.
    #[inline(always)]
    pub fn new(x: R, y: R, direct: bool) -> Self {
        let alpha = opacity((x + y) * R::of(0.5));
        if direct {
            let [psi, phi] = quadrature(x, y, |_, u, e| [e, u * e]);
            Piece { alpha, front: psi - phi, back: phi }
        } else {
            let [beta] = quadrature(x, y, |slope, u, e| [u * slope * e]);
            let beta = beta.min(alpha);
            Piece { alpha, front: alpha - beta, back: beta }
        }
    }
}

/// 1 − e^{−depth}, accurate relative to itself.
#[inline(always)]
fn opacity<R: Real>(depth: R) -> R {
    let one = R::of(1.0);
    if depth < R::of(0.25) {
        let [c2, c3, c4, c5, c6] = [2.0, 3.0, 4.0, 5.0, 6.0].map(|k| R::of(-1.0 / k));
        depth * (one + depth * c2 * (one + depth * c3 * (one + depth * c4 * (one + depth * c5 * (one + depth * c6)))))
    } else {
        one - (-depth).exp()
    }
}

/// ∫₀¹ f(T′(u), u, e^{−T(u)}) du for each value of f, with T(u) = x u + (y − x) u²/2.
#[inline(always)]
fn quadrature<R: Real, const N: usize>(x: R, y: R, f: impl Fn(R, R, R) -> [R; N]) -> [R; N] {
    let half = R::of(0.5);
    let node = |from: R, width: R, [node, weight]: [f64; 2], sum: &mut [R; N]| {
        let u = from + width * R::of(node);
        let rise = (y - x) * u;
        let values = f(x + rise, u, (-(x + rise * half) * u).exp());
        for k in 0..N {
            sum[k] = sum[k] + width * R::of(weight) * values[k];
        }
    };
    let (zero, one) = (R::of(0.0), R::of(1.0));
    let mut sum = [zero; N];
    if x.max(y) <= R::of(SHALLOW) {
        for g in GAUSS_3 {
            node(zero, one, g, &mut sum);
        }
        return sum;
    }
    // Beyond T(u) = DEEP nothing is seen: x u + (y − x) u²/2 = DEEP.
    let deep = R::of(2.0 * DEEP);
    let end = if x + y > deep { (deep / (x + (x * x + deep * (y - x)).max(zero).sqrt())).min(one) } else { one };
    let panels = (x.max(x + (y - x) * end) * end / R::of(PANEL)).truncate() + 1;
    let width = end / R::of(f64::from(panels));
    for p in 0..panels {
        for g in GAUSS_6 {
            node(width * R::of(f64::from(p)), width, g, &mut sum);
        }
    }
    sum
}

/// A piecewise linear function of the normalised scalar with four channels: extinction per normalised unit of length,
/// and red, green, blue of the colour (or, for direct emission, of the emission per normalised unit of length).
#[derive(Debug, Clone, PartialEq)]
pub struct Knots<R> {
    /// Ascending; the first and the last lie beyond every scalar.
    pub(crate) s: Vec<R>,
    /// Value at each knot; at a step, two knots share their s.
    pub(crate) value: Vec<[R; 4]>,
    /// Slope of each interval; 0 for intervals of no width.
    pub(crate) slope: Vec<[R; 4]>,
    /// For each of [`BUCKETS`] equal parts of [−1, 1], the interval that its lower end lies in.
    pub(crate) bucket: Vec<u32>,
}

/// Number of entries of the look-up that finds the interval of a scalar.
pub(crate) const BUCKETS: usize = 512;

/// Beyond every normalised scalar.
const FAR: f64 = 1e30;

impl<R: Real> Knots<R> {
    /// The function through `knots` `(s, value)`, ascending; constant outside them.
    fn new(mut knots: Vec<(f64, [f64; 4])>) -> Self {
        let (first, last) = (knots.first().map_or([0.0; 4], |k| k.1), knots.last().map_or([0.0; 4], |k| k.1));
        knots.insert(0, (-FAR, first));
        knots.push((FAR, last));
        let s: Vec<R> = knots.iter().map(|k| R::of(k.0.clamp(-FAR, FAR))).collect();
        let value: Vec<[R; 4]> = knots.iter().map(|k| k.1.map(R::of)).collect();
        let slope = (0..knots.len())
            .map(|i| match knots.get(i + 1) {
                Some(next) if s[i] < s[i + 1] => {
                    [0, 1, 2, 3].map(|k| R::of((next.1[k] - knots[i].1[k]) / (next.0 - knots[i].0)))
                }
                _ => [R::of(0.0); 4],
            })
            .collect();
        let bucket = (0..BUCKETS)
            .map(|b| {
                let low = R::of(2.0 * b as f64 / BUCKETS as f64 - 1.0);
                (s.partition_point(|&k| k <= low).max(1) - 1) as u32
            })
            .collect();
        Knots { s, value, slope, bucket }
    }

    /// Number of knots, those beyond every scalar included.
    pub fn len(&self) -> usize {
        self.s.len()
    }

    /// Never true: there are at least the two outer knots.
    pub fn is_empty(&self) -> bool {
        self.s.is_empty()
    }

    /// The interval that `s` lies in: the last whose lower end is not above it.
    #[inline(always)]
    fn interval(&self, s: R) -> usize {
        let scaled = (s + R::of(1.0)) * R::of(BUCKETS as f64 / 2.0);
        let b = scaled.max(R::of(0.0)).min(R::of((BUCKETS - 1) as f64));
        let mut i = self.bucket[b.truncate() as usize] as usize;
        while i > 0 && self.s[i] > s {
            i -= 1;
        }
        while i + 2 < self.s.len() && self.s[i + 1] <= s {
            i += 1;
        }
        i
    }
}

/// One linear value along a segment, and the interval of its function that it is in.
struct Track<'a, R> {
    knots: &'a Knots<R>,
    i: usize,
    front: R,
    rise: R,
}

impl<'a, R: Real> Track<'a, R> {
    #[inline(always)]
    fn new(knots: &'a Knots<R>, front: R, back: R) -> Self {
        let (mut i, rise) = (knots.interval(front), back - front);
        if rise == R::of(0.0) {
            // A constant that is opaque as a single value is opaque all along.
            let opaque = |k: &[R; 4]| k[0] >= R::of(OPAQUE_EXTINCTION);
            while i > 0 && knots.s[i - 1] == front && opaque(&knots.value[i - 1]) && !opaque(&knots.value[i]) {
                i -= 1;
            }
        }
        Track { knots, i, front, rise }
    }

    /// Where in [0, 1] the value leaves the interval; above 1 if it does not.
    #[inline(always)]
    fn end(&self) -> R {
        let zero = R::of(0.0);
        if self.rise > zero {
            (self.knots.s[self.i + 1] - self.front) / self.rise
        } else if self.rise < zero {
            (self.knots.s[self.i] - self.front) / self.rise
        } else {
            R::of(2.0)
        }
    }

    /// The function's value at `u`, by the line of the interval.
    #[inline(always)]
    fn at(&self, u: R) -> [R; 4] {
        let (low, high) = (self.knots.s[self.i], self.knots.s[self.i + 1]);
        let offset = (self.front + self.rise * u).max(low).min(high) - low;
        let (value, slope) = (&self.knots.value[self.i], &self.knots.slope[self.i]);
        [0, 1, 2, 3].map(|k| value[k] + slope[k] * offset)
    }

    /// Steps to the next interval; false if there is none.
    #[inline(always)]
    fn advance(&mut self) -> bool {
        if self.rise > R::of(0.0) {
            self.i += 1;
            self.i + 1 < self.knots.s.len()
        } else {
            self.i = self.i.wrapping_sub(1);
            self.i != usize::MAX
        }
    }
}

/// Light gathered from front to back: premultiplied colour, and how much of what lies behind still comes through.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light<R> {
    /// Premultiplied colour.
    pub color: [R; 3],
    /// Transmittance, in [0, 1].
    pub through: R,
}

impl<R: Real> Light<R> {
    /// Nothing gathered yet.
    pub fn none() -> Self {
        Light { color: [R::of(0.0); 3], through: R::of(1.0) }
    }
}

/// A transfer function made ready for the fields of one mesh: the integral of a segment in its exact form.
#[derive(Debug, Clone, PartialEq)]
pub struct Exact<R> {
    /// What drives colour and opacity.
    pub(crate) kind: Kind,
    /// Extinction over the last component; for a scalar field with the colour in the other channels.
    pub(crate) opacity: Knots<R>,
    /// Colour over the first component of a [`Kind::Pair`].
    pub(crate) color: Option<Knots<R>>,
    /// The components of an RGBA field times this are the colour.
    pub(crate) scale: R,
    /// Emission is not multiplied by extinction.
    pub(crate) direct: bool,
}

impl<R: Real> Exact<R> {
    /// Prepares `transfer` for a field of `kind` whose components are mapped by `normal`, on a mesh whose coordinates were
    /// multiplied by `scale`.
    pub fn new(transfer: &TransferFunction, kind: Kind, normal: &[Normal; 4], scale: f64) -> Self {
        let direct = matches!(transfer.emission(), Emission::Direct { .. });
        let emission = match transfer.emission() {
            Emission::Direct { scale: e } => e / scale,
            Emission::Chromatic => 1.0,
        };
        let last = normal[kind.components() - 1];
        let colored = |s: f64, side: Side| sample(transfer.color(), transfer.clamp(), s, side).map(|c| c * emission);
        let extinction = extinction(transfer, OPAQUE_EXTINCTION * scale);
        let mut places: Vec<f64> = extinction.iter().map(|k| k.0).collect();
        if kind == Kind::Scalar {
            places.extend(transfer.color().iter().map(|k| k.0));
        }
        let opacity = compile(places, last, |s, side| {
            let [tau] = sample(&extinction, transfer.clamp(), s, side);
            let [r, g, b] = if kind == Kind::Scalar { colored(s, side) } else { [0.0; 3] };
            [tau / scale, r, g, b]
        });
        let color = (kind == Kind::Pair).then(|| {
            compile(transfer.color().iter().map(|k| k.0).collect(), normal[0], |s, side| {
                let [r, g, b] = colored(s, side);
                [0.0, r, g, b]
            })
        });
        Exact { kind, opacity, color, scale: R::of(emission), direct }
    }

    /// Adds a segment of `length` (normalised units) whose field is `front` where the ray enters and `back` where it leaves.
    /// Values that are not finite make it invisible. `N` is the number of the field's components.
    #[inline(always)]
    pub fn add<const N: usize>(&self, front: &[R; N], back: &[R; N], length: R, light: &mut Light<R>) {
        if !front.iter().chain(back).all(|v| v.is_finite()) {
            return;
        }
        let mut opacity = Track::new(&self.opacity, front[N - 1], back[N - 1]);
        let mut color = self.color.as_ref().map(|k| Track::new(k, front[0], back[0]));
        let (zero, one) = (R::of(0.0), R::of(1.0));
        let mut u = zero;
        loop {
            let (opacity_end, color_end) = (opacity.end(), color.as_ref().map_or(R::of(2.0), Track::end));
            let next = opacity_end.min(color_end).min(one).max(u);
            let (mut f, mut b) = (opacity.at(u), opacity.at(next));
            if let Some(color) = &color {
                let ([_, fc @ ..], [_, bc @ ..]) = (color.at(u), color.at(next));
                f[1..].copy_from_slice(&fc);
                b[1..].copy_from_slice(&bc);
            } else if N == 4 {
                for k in 0..3 {
                    let rise = back[k] - front[k];
                    f[k + 1] = (front[k] + rise * u) * self.scale;
                    b[k + 1] = (front[k] + rise * next) * self.scale;
                }
            }
            let l = (next - u) * length;
            self.add_piece(f, b, l, light);
            if next >= one || light.through <= zero {
                return;
            }
            let more = (opacity_end > next || opacity.advance())
                && color.as_mut().is_none_or(|c| color_end > next || c.advance());
            if !more {
                return;
            }
            u = next;
        }
    }

    /// Adds one piece of length `l` with extinction and colour `f` in front and `b` behind.
    #[inline(always)]
    fn add_piece(&self, f: [R; 4], b: [R; 4], l: R, light: &mut Light<R>) {
        let zero = R::of(0.0);
        if f[0] + b[0] <= zero && !self.direct {
            return;
        }
        let piece = Piece::new(f[0] * l, b[0] * l, self.direct);
        let emitted = if self.direct { light.through * l } else { light.through };
        for k in 0..3 {
            light.color[k] = light.color[k] + emitted * (f[k + 1] * piece.front + b[k + 1] * piece.back);
        }
        light.through = light.through * (R::of(1.0) - piece.alpha);
    }
}

/// Which of its values a function has at a step.
#[derive(Clone, Copy, PartialEq)]
enum Side {
    Below,
    Above,
    /// The greatest of all knots there, in the first channel.
    Densest,
}

/// The limit of the piecewise linear function through `knots` at `s`; outside them the end value, or 0 without `clamp`.
fn sample<const N: usize>(knots: &[(f64, [f64; N])], clamp: bool, s: f64, side: Side) -> [f64; N] {
    let (below, above) = (knots.partition_point(|k| k.0 < s), knots.partition_point(|k| k.0 <= s));
    let above = match side {
        Side::Below => below,
        Side::Above => above,
        Side::Densest => match knots[below..above].iter().max_by(|a, b| a.1[0].total_cmp(&b.1[0])) {
            Some(k) => return k.1,
            None => above,
        },
    };
    match (above, knots) {
        (_, []) => [0.0; N],
        (0, [first, ..]) => first.1.map(|v| if clamp { v } else { 0.0 }),
        (i, [.., last]) if i == knots.len() => last.1.map(|v| if clamp { v } else { 0.0 }),
        (i, _) => {
            let ((s0, a), (s1, b)) = (knots[i - 1], knots[i]);
            let w = (s - s0) / (s1 - s0);
            std::array::from_fn(|k| a[k] + (b[k] - a[k]) * w)
        }
    }
}

/// The knots of `value` over the normalised scalar, at `places` in the field's own units; both limits at each.
fn compile<R: Real>(mut places: Vec<f64>, normal: Normal, value: impl Fn(f64, Side) -> [f64; 4]) -> Knots<R> {
    places.sort_by(f64::total_cmp);
    places.dedup();
    let mut knots = Vec::with_capacity(2 * places.len());
    for s in places {
        let (x, below, above) = (normal.apply(s), value(s, Side::Below), value(s, Side::Above));
        let densest = value(s, Side::Densest);
        knots.push((x, below));
        if densest[0] > below[0].max(above[0]) {
            knots.push((x, densest));
        }
        if above != below || densest[0] > below[0] {
            knots.push((x, above));
        }
    }
    Knots::new(knots)
}

/// Extinction per world unit of length as a piecewise linear function of the field, by the transfer function's convention;
/// `opaque` on every stretch where opacity is 1 or more. A value that reaches 1 alone lets light through: the logarithm's
/// integral is finite there.
fn extinction(transfer: &TransferFunction, opaque: f64) -> Vec<(f64, [f64; 1])> {
    let knots = transfer.opacity();
    if transfer.convention() == Convention::Extinction {
        return knots.iter().map(|&(s, a)| (s, [transfer.extinction(a).min(opaque)])).collect();
    }
    // On its way to 1: what lies beyond `OPAQUE` has no length that f32 could tell.
    let tau = |a: f64| [-(-a.min(OPAQUE)).ln_1p() / transfer.unit_distance()];
    let mut curve = vec![];
    for w in knots.windows(2) {
        let [(s0, a0), (s1, a1)] = [w[0], w[1]];
        let (low, high) = (a0.min(a1), a0.max(a1));
        let place = |a: f64| s0 + (s1 - s0) * ((a - a0) / (a1 - a0));
        if low >= OPAQUE {
            curve.extend([(s0, [opaque]), (s1, [opaque])]);
            continue;
        }
        if a0 >= OPAQUE {
            curve.push((s0, [opaque]));
        }
        let mut rise: Vec<_> = std::iter::successors(Some(low), |&a| Some(a + chord(a)))
            .take_while(|&a| a < high.min(OPAQUE))
            .chain([high.min(OPAQUE)])
            .map(|a| (place(a), tau(a)))
            .collect();
        if high > 1.0 {
            rise.extend([(place(1.0), tau(1.0)), (place(1.0), [opaque]), (place(high), [opaque])]);
        } else {
            rise.push((place(high), tau(high)));
        }
        if a1 < a0 {
            rise.reverse();
        }
        match s0 < s1 && a0 != a1 {
            true => curve.extend(rise),
            false => curve.extend([(s0, tau(a0)), (s1, tau(a1))]),
        }
    }
    // Beyond the outer knots their values hold: there an opaque one is a stretch.
    for (k, end) in [knots.first(), knots.last()].into_iter().enumerate() {
        if let Some(&(s, a)) = end {
            let value = if a >= OPAQUE { [opaque] } else { tau(a) };
            curve.insert(if k == 0 { 0 } else { curve.len() }, (s, value));
        }
    }
    curve
}

/// How far opacity may rise from `a` before the chord of −ln(1 − a) is off by 1e-5 of it.
fn chord(a: f64) -> f64 {
    (0.9 * (8e-5 * -(-a).ln_1p()).sqrt() * (1.0 - a)).max(1.8e-5 * (1.0 - a))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// α, β, Ψ and Φ by many Gauss panels in f64.
    fn truth(x: f64, y: f64) -> [f64; 4] {
        let n = 20_000;
        let mut sum = [0.0; 3];
        for p in 0..n {
            for [node, weight] in GAUSS_3 {
                // Panels shrink towards u = 0, where e^{−T} falls fastest when x is great.
                let (a, b) = ((p as f64 / n as f64).powi(4), ((p + 1) as f64 / n as f64).powi(4));
                let u = a + (b - a) * node;
                let (slope, e) = (x + (y - x) * u, (-(x * u + (y - x) * u * u / 2.0)).exp());
                for (s, v) in sum.iter_mut().zip([u * slope * e, e, u * e]) {
                    *s += v * weight * (b - a);
                }
            }
        }
        [-(-(x + y) / 2.0).exp_m1(), sum[0], sum[1], sum[2]]
    }

    #[test]
    fn pieces_match_their_integrals() {
        let depths =
            [0.0, 1e-30, 1e-12, 1e-6, 1e-3, 0.03, 0.2, 0.24, 0.26, 0.41, 0.9, 2.0, 3.9, 4.1, 9.0, 17.0, 40.0, 300.0];
        for x in depths {
            for y in depths {
                let [alpha, beta, psi, phi] = truth(x, y);
                let near = |got: f32, want: f64, what: &str| {
                    let error = (f64::from(got) - want).abs();
                    assert!(
                        error <= 1e-6 && error <= 1e-5 * alpha.max(1e-300) + 2e-7 * want,
                        "{what} at {x}, {y}: {got}, not {want}"
                    );
                };
                let p = Piece::new(x as f32, y as f32, false);
                near(p.alpha, alpha, "alpha");
                near(p.back, beta, "beta");
                near(p.front, alpha - beta, "alpha - beta");
                let p = Piece::new(x as f32, y as f32, true);
                for (got, want) in [(p.front, psi - phi), (p.back, phi)] {
                    assert!((f64::from(got) - want).abs() <= 1e-6, "direct at {x}, {y}: {got}, not {want}");
                }
            }
        }
    }

    #[test]
    fn limits_are_finite() {
        for x in [0.0, f32::MIN_POSITIVE, 1e-38, 1.0, 1e6, 4e15] {
            for y in [0.0, f32::MIN_POSITIVE, 1e-38, 1.0, 1e6, 4e15] {
                for direct in [false, true] {
                    let p = Piece::new(x, y, direct);
                    assert!(p.alpha >= 0.0 && p.alpha <= 1.0, "{x} {y} {p:?}");
                    assert!(p.front >= 0.0 && p.front <= 1.0 && p.back >= 0.0 && p.back <= 1.0, "{x} {y} {p:?}");
                }
            }
        }
    }

    fn exact<R: Real>(transfer: &TransferFunction, kind: Kind) -> Exact<R> {
        Exact::new(transfer, kind, &[Normal { mid: 0.0, half: 1.0 }; 4], 1.0)
    }

    fn tent() -> TransferFunction {
        let color = vec![(-1.0, [1.0, 0.0, 0.5]), (0.3, [0.2, 0.9, 0.1]), (1.0, [0.0, 0.4, 1.0])];
        TransferFunction::new(color, vec![(-0.5, 0.0), (0.1, 0.8), (0.1, 0.3), (0.6, 0.0)], 0.5).unwrap()
    }

    /// The integral by 200,000 midpoint steps.
    fn marched(transfer: &TransferFunction, front: f64, back: f64, length: f64) -> Light<f64> {
        let n = 200_000;
        let mut light = Light::none();
        for i in 0..n {
            let s = front + (back - front) * (i as f64 + 0.5) / n as f64;
            let (c, t) = (transfer.color_at(s), transfer.extinction(transfer.opacity_at(s)) * length / n as f64);
            let alpha = -(-t).exp_m1();
            for k in 0..3 {
                light.color[k] += light.through * alpha * c[k];
            }
            light.through *= 1.0 - alpha;
        }
        light
    }

    #[test]
    fn segments_are_split_at_knots() {
        let transfer = tent();
        let (fast, slow) = (exact::<f32>(&transfer, Kind::Scalar), exact::<f64>(&transfer, Kind::Scalar));
        for (f, b, l) in
            [(-1.0, 1.0, 2.0), (1.0, -1.0, 0.7), (-0.2, 0.3, 1.0), (0.1, 0.1, 3.0), (0.1, 0.0, 1.0), (0.9, 0.95, 5.0)]
        {
            let want = marched(&transfer, f, b, l);
            let mut got = Light::<f64>::none();
            slow.add(&[f], &[b], l, &mut got);
            let mut quick = Light::<f32>::none();
            fast.add(&[f as f32], &[b as f32], l as f32, &mut quick);
            for k in 0..3 {
                assert!((got.color[k] - want.color[k]).abs() < 1e-6, "{f} {b} {l}: {got:?}, not {want:?}");
                assert!(
                    (f64::from(quick.color[k]) - want.color[k]).abs() < 2e-6,
                    "{f} {b} {l}: {quick:?}, not {want:?}"
                );
            }
            assert!((got.through - want.through).abs() < 1e-6);
            assert!((f64::from(quick.through) - want.through).abs() < 2e-6);
        }
    }

    #[test]
    fn pairs_and_rgba_agree_with_the_scalar_they_repeat() {
        let transfer = tent();
        let (scalar, pair) = (exact::<f64>(&transfer, Kind::Scalar), exact::<f64>(&transfer, Kind::Pair));
        let (mut a, mut b) = (Light::none(), Light::none());
        scalar.add(&[-0.8], &[0.9], 1.3, &mut a);
        pair.add(&[-0.8, -0.8], &[0.9, 0.9], 1.3, &mut b);
        for k in 0..3 {
            assert!((a.color[k] - b.color[k]).abs() < 1e-7);
        }
        let white = TransferFunction::new(vec![(0.0, [0.25, 0.5, 0.75])], transfer.opacity().to_vec(), 0.5).unwrap();
        let (scalar, rgba) = (exact::<f64>(&white, Kind::Scalar), exact::<f64>(&white, Kind::Rgba));
        let (mut a, mut b) = (Light::none(), Light::none());
        scalar.add(&[-0.8], &[0.9], 1.3, &mut a);
        rgba.add(&[0.25, 0.5, 0.75, -0.8], &[0.25, 0.5, 0.75, 0.9], 1.3, &mut b);
        for k in 0..3 {
            assert!((a.color[k] - b.color[k]).abs() < 1e-7);
        }
    }

    #[test]
    fn opacity_convention_stays_near_its_logarithm() {
        let color = vec![(0.0, [1.0; 3])];
        let opacity = vec![(-1.0, 0.0), (0.0, 0.7), (0.5, 0.2), (0.9, 0.999)];
        let transfer = TransferFunction::new(color, opacity, 0.3).unwrap().with_convention(Convention::Opacity);
        let curve = extinction(&transfer, 1e15);
        for i in 0..100_000 {
            let s = -1.0 + 1.9 * (f64::from(i) + 0.37) / 1e5;
            let (got, want) = (sample(&curve, true, s, Side::Above)[0], transfer.extinction(transfer.opacity_at(s)));
            assert!((got - want).abs() <= 1.01e-5 * want, "{s}: {got}, not {want}");
        }
    }

    #[test]
    fn a_stretch_of_opacity_1_ends_the_ray_and_a_point_does_not() {
        let color = vec![(-1.0, [1.0, 0.0, 0.0]), (1.0, [0.0, 1.0, 0.0])];
        let make = |opacity: &[(f64, f64)]| {
            let t = TransferFunction::new(color.clone(), opacity.to_vec(), 1e6).unwrap();
            exact::<f32>(&t.with_convention(Convention::Opacity), Kind::Scalar)
        };
        let through = |exact: &Exact<f32>, f: f32, b: f32| {
            let mut light = Light::<f32>::none();
            exact.add(&[f], &[b], 1e-4, &mut light);
            light
        };
        let stretches = [
            make(&[(-1.0, 0.0), (0.2, 1.0), (0.3, 1.0), (1.0, 0.0)]),
            make(&[(-1.0, 0.0), (0.0, 0.0), (0.4, 2.0), (0.401, 0.0)]),
        ];
        for exact in &stretches {
            for (f, b) in [(-0.9, 0.9), (0.9, -0.9), (0.25, 0.25), (0.21, 0.22)] {
                let light = through(exact, f, b);
                assert!(light.through < 1e-6, "{f} to {b} lets {} through", light.through);
            }
            assert!(through(exact, -0.9, 0.1).through > 0.99);
        }
        let point = make(&[(-1.0, 0.0), (0.2, 1.0), (1.0, 0.0)]);
        assert!(through(&point, -0.9, 0.9).through > 0.99);
        assert!(through(&point, 0.2, 0.2).through < 1e-6, "a constant field at the point is a stretch");
        let outside = make(&[(-0.5, 1.0), (0.0, 0.0), (0.5, 1.0)]);
        for (f, b) in [(-0.9, -0.8), (0.6, 0.7), (0.9, -0.9)] {
            assert!(through(&outside, f, b).through < 1e-6);
        }
    }

    #[test]
    fn invisible_and_empty_segments_add_nothing() {
        let exact = exact::<f32>(&tent(), Kind::Scalar);
        for (f, b) in [(f32::NAN, 0.0), (0.0, f32::INFINITY), (0.7, 0.9), (-1.0, -0.6)] {
            let mut light = Light::none();
            exact.add(&[f], &[b], 1.0, &mut light);
            assert_eq!(light, Light::none());
        }
    }
}
