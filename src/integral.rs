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
pub(crate) mod cubic;
pub(crate) mod floats;
mod knots;
pub(crate) mod lines;
pub mod lookup;
pub mod options;
pub(crate) mod second;
pub mod table;
#[cfg(test)]
mod tests;

pub use batch::Batch;
pub(crate) use knots::BUCKETS;
pub use knots::Knots;
pub(crate) use knots::{Line, MOST_OF_PART};
pub use lookup::{Integral, PreintegratedTable};
pub use options::{Form, IntegrationOptions};

use crate::field::{Kind, Normalization};
use crate::real::Real;
use crate::transfer::{Convention, Emission, TransferFunction};
use knots::{BRIGHTEST, Curved, Side, Track, chord, compile, extinction, part, sample};

/// Extinction that stands for "opaque", per normalised unit of length: even the thinnest slab that f32 can tell from
/// nothing is then opaque, and its square is still finite.
pub(crate) const OPAQUE_EXTINCTION: f64 = 1e15;

/// Optical depth beyond which e^{−T} is nothing in f32.
pub(crate) const OPAQUE_DEPTH: f64 = 18.0;

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
pub(crate) const GAUSS_DEPTH: f64 = 4.0;
/// Optical depth up to which [`Piece::by_series`] holds.
pub(crate) const SERIES_DEPTH: f64 = 1.0;

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

    /// As [`Piece::new`] for depths up to [`SERIES_DEPTH`]; takes no decisions, so that a loop over it becomes vector
    /// instructions.
    ///
    /// With the mean depth D = (x + y)/2, δ = y − x and v = u − ½ it is e^{−T(u)} = e^{−D/2} e^{−Dv} e^{δ(¼−v²)/2}. So
    /// Ψ = ∫ e^{−T} du is e^{−D/2} (N₀ + δ/2 N₁ + δ²/8 N₂ + …) with the even series N_k = ∫ (¼ − v²)ᵏ cosh(D v) dv,
    /// which converge fast. By parts, ∫ v e^{−T} du = −D (Ψ − e^{−D/2} N₀)/δ and ∫ u T′ e^{−T} du = Ψ − e^{−D}, of
    /// whose terms the ones of N₀ and of q = 1 − e^{−D/2} cancel by hand.
    #[inline(always)]
    fn by_series(x: R, y: R, direct: bool) -> Self {
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

    /// As [`Piece::new`] for depths up to [`GAUSS_DEPTH`], as [`Self::by_series`].
    #[inline(always)]
    fn by_gauss(x: R, y: R, direct: bool) -> Self {
        gauss(&GAUSS_6, x, y, R::of(0.0), R::of(1.0), direct, Self::NONE())
    }

    /// A piece of optical depths `x` (τ_f l) and `y` (τ_b l), both finite; what is below 0 is taken for 0, as rounding
    /// beside great depths may be. Error at most 1e-6, and 1e-5 of α.
    #[inline(always)]
    pub fn new(x: R, y: R, direct: bool) -> Self {
        let (zero, one) = (R::of(0.0), R::of(1.0));
        let (x, y) = (x.max(zero), y.max(zero));
        let steepest = x.max(y);
        if steepest <= R::of(SERIES_DEPTH) {
            return Piece::by_series(x, y, direct);
        }
        if steepest <= R::of(GAUSS_DEPTH) {
            return Piece::by_gauss(x, y, direct);
        }
        // Beyond T(u) = OPAQUE_DEPTH nothing is seen: x u + (y − x) u²/2 = OPAQUE_DEPTH.
        let deep = R::of(2.0 * OPAQUE_DEPTH);
        let end = if x + y > deep { (deep / (x + (x * x + deep * (y - x)).max(zero).sqrt())).min(one) } else { one };
        let panels = (x.max(x + (y - x) * end) * end / R::of(GAUSS_DEPTH)).truncate() + 1;
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
    pub transmittance: R,
}

impl<R: Real> Light<R> {
    /// Nothing gathered yet.
    pub fn none() -> Self {
        Light { color: [R::of(0.0); 3], transmittance: R::of(1.0) }
    }

    /// Adds something behind: the light that it emits, and its opacity.
    #[inline(always)]
    pub fn add(&mut self, emitted: [R; 3], alpha: R) {
        for (color, emitted) in self.color.iter_mut().zip(emitted) {
            *color = *color + self.transmittance * emitted;
        }
        self.transmittance = self.transmittance * (R::of(1.0) - alpha);
    }
}

/// A transfer function made ready for the fields of one mesh: the integral of a segment in its exact form.
#[derive(Debug, Clone, PartialEq)]
pub struct Exact<R> {
    /// What drives colour and opacity.
    pub(crate) kind: Kind,
    /// Extinction over the last component; for a scalar field with the colour in the other channels.
    pub(crate) opacity: Knots<R>,
    /// The same as it is, where `opacity` has chords of a logarithm.
    pub(crate) curved: Option<Curved<R>>,
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
    pub fn new(transfer: &TransferFunction, kind: Kind, normal: &[Normalization; 4], scale: f64) -> Self {
        let direct = matches!(transfer.emission(), Emission::Direct { .. });
        let emission = match transfer.emission() {
            Emission::Direct { scale: e } => (e / scale).min(BRIGHTEST),
            Emission::Chromatic => 1.0,
        };
        let last = normal[kind.components() - 1];
        let colored = |s: f64, side: Side| {
            sample(transfer.color(), transfer.clamp(), s, side).map(|c| (c * emission).min(BRIGHTEST))
        };
        let colors = if kind == Kind::Scalar { transfer.color() } else { &[] };
        let colors: Vec<f64> = colors.iter().map(|k| k.0).collect();
        let function = |step: fn(f64) -> f64, also: &[f64]| {
            let extinction = extinction(transfer, OPAQUE_EXTINCTION * scale, step, also);
            let places = extinction.iter().map(|k| k.0).chain(colors.iter().copied()).collect();
            compile(places, last, |s, side| {
                let [tau] = sample(&extinction, transfer.clamp(), s, side);
                let [r, g, b] = if kind == Kind::Scalar { colored(s, side) } else { [0.0; 3] };
                [tau / scale, r, g, b]
            })
        };
        let opacity = function(chord, &[]);
        let curved = (transfer.convention() == Convention::Opacity)
            .then(|| Curved { knots: function(part, &colors), unit: R::of(transfer.unit_distance() * scale) });
        let color = (kind == Kind::Pair).then(|| {
            compile(transfer.color().iter().map(|k| k.0).collect(), normal[0], |s, side| {
                let [r, g, b] = colored(s, side);
                [0.0, r, g, b]
            })
        });
        Exact { kind, opacity, curved, color, scale: R::of(emission), direct }
    }

    /// What a table is of: this function, if it is of one component; else one whose "colours", those of an RGBA field, are the
    /// weights of the colours at the two ends of a segment, along which colours are linear. `None` of one component.
    ///
    /// With colours c_f and c_b, a segment emits C = c_f W_f + c_b W_b, W_b = ∫ u dA and W_f = ∫ (1 − u) dA over the opacity A that
    /// is gathered at the share u of its length (direct: over what is seen of the length).
    pub fn weights(&self) -> Option<Self> {
        (self.kind != Kind::Scalar).then(|| Exact {
            kind: Kind::Rgba,
            opacity: self.opacity.clone(),
            curved: None,
            color: None,
            scale: R::of(1.0),
            direct: self.direct,
        })
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
