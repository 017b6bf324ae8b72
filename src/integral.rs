//! The ray-segment integral: what a straight piece of a ray inside one cell emits and absorbs.
//!
//! Inside a tetrahedron the scalar is linear along the ray, so a segment is its values at both ends and its length. It
//! is split where the scalar crosses a knot of the transfer function; in such a *piece* extinction τ and colour c are
//! linear too. With optical depths x = τ_f l and y = τ_b l per piece length l, and T(u) = x u + (y − x) u²/2 for u in
//! [0, 1]:
//!
//! - opacity α = 1 − e^{−(x+y)/2};
//! - chromatic emission q = c τ: C = c_f (α − β) + c_b β with β = ∫ u T′(u) e^{−T(u)} du, which is Ψ − e^{−(x+y)/2} in
//!   the terms of Moreland & Angel (2004, partial pre-integration) without its cancellation;
//! - direct emission q: C = l (q_f (Ψ − Φ) + q_b Φ) with Ψ = ∫ e^{−T(u)} du and Φ = ∫ u e^{−T(u)} du.
//!
//! Up to an optical depth of 1 the integrals over u are series ([`Piece::new`]), beyond that Gauss–Legendre sums, both
//! as accurate as f32 can tell; pieces of great optical depth are first cut where nothing more can be seen.

mod batch;
pub mod choice;
pub(crate) mod cubic;
mod knots;
pub mod lookup;
pub mod table;

pub use batch::Batch;
pub use choice::{Choice, Form};
pub(crate) use knots::BUCKETS;
pub use knots::Knots;
pub(crate) use knots::Line;
pub use lookup::{Integral, Lookup};

use crate::field::{Kind, Normal};
use crate::real::Real;
use crate::transfer::{Emission, TransferFunction};
use knots::{BRIGHTEST, Side, Track, compile, extinction, sample};

/// Extinction that stands for "opaque", per normalised unit of length: even the thinnest slab that f32 can tell from
/// nothing is then opaque, and its square is still finite.
pub(crate) const OPAQUE_EXTINCTION: f64 = 1e15;

/// Optical depth beyond which e^{−T} is nothing in f32.
pub(crate) const DEEP: f64 = 18.0;

/// Nodes in [0, 1] and weights of the 6-point Gauss–Legendre rule.
pub(crate) const GAUSS_6: [[f64; 2]; 6] = [
    [0.033_765_242_898_423_98, 0.085_662_246_189_585_18],
    [0.169_395_306_766_867_74, 0.180_380_786_524_069_3],
    [0.380_690_406_958_401_56, 0.233_956_967_286_345_52],
    [0.619_309_593_041_598_5, 0.233_956_967_286_345_52],
    [0.830_604_693_233_132_2, 0.180_380_786_524_069_3],
    [0.966_234_757_101_576, 0.085_662_246_189_585_18],
];

/// Optical depth that one panel of 6 nodes covers.
pub(crate) const PANEL: f64 = 4.0;
/// Optical depth up to which [`Piece::mild`] holds.
pub(crate) const MILD: f64 = 1.0;

/// 1 − e^{−depth}, accurate relative to itself.
#[inline(always)]
pub(crate) fn opacity_of_depth(d: f32) -> f32 {
    if d < 0.25 {
        return d
            * (1.0 - d * (1.0 / 2.0 - d * (1.0 / 6.0 - d * (1.0 / 24.0 - d * (1.0 / 120.0 - d * (1.0 / 720.0))))));
    }
    1.0 - Real::exp(-d)
}

/// What one piece does: its opacity and the weights of the emission at its two ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece<A> {
    /// Opacity, in [0, 1].
    pub alpha: A,
    /// Weight of the front end's colour (chromatic) or of its emission times length (direct).
    pub front: A,
    /// The same for the back end.
    pub back: A,
}

/// Adds to `sum` what the panel of `width` at `from`, both in [0, 1], emits and absorbs.
#[inline(always)]
fn gauss<A: Real, const N: usize>(
    rule: &[[f64; 2]; N],
    x: A,
    y: A,
    from: A,
    width: A,
    direct: bool,
    mut sum: Piece<A>,
) -> Piece<A> {
    let (one, half) = (A::of(1.0), A::of(0.5));
    for [node, weight] in rule {
        let u = from + width * A::of(*node);
        let rise = (y - x) * u;
        let seen = (-((x + rise * half) * u)).exp() * (width * A::of(*weight));
        let absorbed = (x + rise) * seen;
        let emitted = if direct { seen } else { absorbed };
        sum.alpha = sum.alpha + absorbed;
        sum.front = sum.front + (one - u) * emitted;
        sum.back = sum.back + u * emitted;
    }
    sum
}

impl<R: Real> Piece<R> {
    const NONE: fn() -> Self = || Piece { alpha: R::of(0.0), front: R::of(0.0), back: R::of(0.0) };

    /// As [`Piece::new`] for depths up to [`MILD`]; takes no decisions, so that a loop over it becomes vector
    /// instructions.
    ///
    /// With the mean depth D = (x + y)/2, δ = y − x and v = u − ½ it is e^{−T(u)} = e^{−D/2} e^{−Dv} e^{δ(¼−v²)/2}. So
    /// Ψ = ∫ e^{−T} du is e^{−D/2} (N₀ + δ/2 N₁ + δ²/8 N₂ + …) with the even series N_k = ∫ (¼ − v²)ᵏ cosh(D v) dv,
    /// which converge fast. By parts, ∫ v e^{−T} du = −D (Ψ − e^{−D/2} N₀)/δ and ∫ u T′ e^{−T} du = Ψ − e^{−D}, of
    /// whose terms the ones of N₀ and of q = 1 − e^{−D/2} cancel by hand.
    #[inline(always)]
    fn mild(x: R, y: R, direct: bool) -> Self {
        let (one, half, of) = (R::of(1.0), R::of(0.5), R::of);
        let (depth, rise) = ((x + y) * half, y - x);
        let (square, h) = (depth * depth, depth * half);
        let mut q = h * of(1.0 / 40_320.0);
        for factorial in [5040.0, 720.0, 120.0, 24.0, 6.0, 2.0, 1.0] {
            q = h * (of(1.0 / factorial) - q);
        }
        let even = square * (of(1.0 / 24.0) + square * (of(1.0 / 1920.0) + square * of(1.0 / 322_560.0)));
        let once = of(1.0 / 12.0) + square * (of(1.0 / 480.0) + square * of(1.0 / 53_760.0));
        let twice = of(1.0 / 240.0) + square * of(1.0 / 13_440.0);
        let thrice = of(1.0 / 6720.0) + square * of(1.0 / 483_840.0) + rise * of(1.0 / 241_920.0);
        let bent = once + rise * (twice + rise * thrice);
        let e = one - q;
        let alpha = e * depth * (one + even);
        if direct {
            let seen = one + even + rise * bent;
            let back = e * (half * seen - depth * bent);
            return Piece { alpha, front: e * seen - back, back };
        }
        let back = e * (q + even + rise * bent);
        Piece { alpha, front: alpha - back, back }
    }

    /// As [`Piece::new`] for depths up to [`PANEL`], as [`Self::mild`].
    #[inline(always)]
    fn moderate(x: R, y: R, direct: bool) -> Self {
        gauss(&GAUSS_6, x, y, R::of(0.0), R::of(1.0), direct, Self::NONE())
    }

    /// A piece of optical depths `x` (τ_f l) and `y` (τ_b l), both finite and at least 0. Error at most 1e-6, and 1e-5
    /// of α.
    #[inline(always)]
    pub fn new(x: R, y: R, direct: bool) -> Self {
        let (zero, one) = (R::of(0.0), R::of(1.0));
        let steepest = x.max(y);
        if steepest <= R::of(MILD) {
            return Piece::mild(x, y, direct);
        }
        if steepest <= R::of(PANEL) {
            return Piece::moderate(x, y, direct);
        }
        // Beyond T(u) = DEEP nothing is seen: x u + (y − x) u²/2 = DEEP.
        let deep = R::of(2.0 * DEEP);
        let end = if x + y > deep { (deep / (x + (x * x + deep * (y - x)).max(zero).sqrt())).min(one) } else { one };
        let panels = (x.max(x + (y - x) * end) * end / R::of(PANEL)).truncate() + 1;
        let width = end / R::of(f64::from(panels));
        let mut sum = Self::NONE();
        for p in 0..panels {
            sum = gauss(&GAUSS_6, x, y, width * R::of(f64::from(p)), width, direct, sum);
        }
        Piece { alpha: one - (-((x + y) * R::of(0.5))).exp(), ..sum }
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

    /// Adds something behind: the light that it emits, and its opacity.
    #[inline(always)]
    pub fn add(&mut self, emitted: [R; 3], alpha: R) {
        for (color, emitted) in self.color.iter_mut().zip(emitted) {
            *color = *color + self.through * emitted;
        }
        self.through = self.through * (R::of(1.0) - alpha);
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
    /// Prepares `transfer` for a field of `kind` whose components are mapped by `normal`, on a mesh whose coordinates
    /// were multiplied by `scale`.
    pub fn new(transfer: &TransferFunction, kind: Kind, normal: &[Normal; 4], scale: f64) -> Self {
        let direct = matches!(transfer.emission(), Emission::Direct { .. });
        let emission = match transfer.emission() {
            Emission::Direct { scale: e } => (e / scale).min(BRIGHTEST),
            Emission::Chromatic => 1.0,
        };
        let last = normal[kind.components() - 1];
        let colored = |s: f64, side: Side| {
            sample(transfer.color(), transfer.clamp(), s, side).map(|c| (c * emission).min(BRIGHTEST))
        };
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

    /// Calls `piece` for each piece of a segment whose field is `front` where the ray enters and `back` where it
    /// leaves, in order: with extinction and colour at its two ends, and its share of the segment's length. Values that
    /// are not finite make the segment invisible. `N` is the number of the field's components.
    #[inline(always)]
    pub fn for_each_piece<const N: usize>(
        &self,
        front: &[R; N],
        back: &[R; N],
        mut piece: impl FnMut([R; 4], [R; 4], R),
    ) {
        if !front.iter().chain(back).all(|v| v.is_finite()) {
            return;
        }
        if let Some(color) = &self.color {
            return self.for_each_piece_of_pair(color, front, back, piece);
        }
        let mut track = Track::new(&self.opacity, front[N - 1], back[N - 1]);
        let (zero, one) = (R::of(0.0), R::of(1.0));
        loop {
            let (to, is_last) = track.next();
            let share = track.share_to((to, true)).unwrap_or(one);
            if share > zero {
                let (mut f, mut b) = (track.line(track.at), track.line(to));
                if N == 4 {
                    let (u, v) = (track.share_before(track.at), if is_last { one } else { track.share_before(to) });
                    for k in 0..3 {
                        let rise = back[k] - front[k];
                        f[k + 1] = (front[k] + rise * u) * self.scale;
                        b[k + 1] = (front[k] + rise * v) * self.scale;
                    }
                }
                if f[0] + b[0] > zero || self.direct {
                    piece(f, b, share);
                }
            }
            track.move_to((to, true));
            if is_last || !track.advance() {
                return;
            }
        }
    }

    /// The same where two values are on functions of their own.
    #[inline(always)]
    fn for_each_piece_of_pair<const N: usize>(
        &self,
        color: &Knots<R>,
        front: &[R; N],
        back: &[R; N],
        mut piece: impl FnMut([R; 4], [R; 4], R),
    ) {
        let mut opacity = Track::new(&self.opacity, front[N - 1], back[N - 1]);
        let mut color = Track::new(color, front[0], back[0]);
        let (mut u, one) = (R::of(0.0), R::of(1.0));
        loop {
            let (opacity_end, color_end) = (opacity.end(), color.end());
            let next = opacity_end.min(color_end).min(one).max(u);
            let (opacity_to, color_to) = (opacity.value(next, opacity_end), color.value(next, color_end));
            let share = opacity.share_to(opacity_to).or_else(|| color.share_to(color_to)).unwrap_or(next - u);
            let ([x, ..], [y, ..]) = (opacity.line(opacity.at), opacity.line(opacity_to.0));
            if x + y > R::of(0.0) || self.direct {
                let ([_, r, g, b], [_, s, t, v]) = (color.line(color.at), color.line(color_to.0));
                piece([x, r, g, b], [y, s, t, v], share);
            }
            if next >= one {
                return;
            }
            opacity.move_to(opacity_to);
            color.move_to(color_to);
            let more = (opacity_end > next || opacity.advance()) && (color_end > next || color.advance());
            if !more {
                return;
            }
            u = next;
        }
    }

    /// Adds a segment of `length` (normalised units) to `light`; see [`Exact::for_each_piece`].
    pub fn add<const N: usize>(&self, front: &[R; N], back: &[R; N], length: R, light: &mut Light<R>) {
        self.for_each_piece(front, back, |f, b, share| {
            let l = share * length;
            let piece = Piece::new(f[0] * l, b[0] * l, self.direct);
            let l = if self.direct { l } else { R::of(1.0) };
            light.add([1, 2, 3].map(|k| (f[k] * piece.front + b[k] * piece.back) * l), piece.alpha);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transfer::Convention;

    /// α, β, Ψ and Φ by many Gauss panels in f64.
    fn truth(x: f64, y: f64) -> [f64; 4] {
        let n = 10_000;
        let mut sum = [0.0; 3];
        for p in 0..n {
            for [node, weight] in GAUSS_6 {
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
        let depths = [
            0.0, 1e-30, 1e-12, 1e-6, 1e-3, 0.03, 0.2, 0.24, 0.26, 0.41, 0.9, 1.0, 1.01, 2.0, 3.9, 4.1, 9.0, 17.0, 40.0,
            300.0,
        ];
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
            for (sum, c) in light.color.iter_mut().zip(c) {
                *sum += light.through * alpha * c;
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
