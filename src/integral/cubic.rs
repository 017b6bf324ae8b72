//! Stretches of a ray along which the scalar is a cubic, in Bernstein form: a trilinear field in one voxel, or what stands for
//! it between samples.
//!
//! A trilinear function is affine in each coordinate by itself. So its blossom along the straight line from p to q is what
//! it is at points that take some coordinates from p and the others from q, and the coefficients of the cubic are means of
//! the eight corners of the box that p and q span. Nothing cancels, and the least and the greatest coefficient bound the
//! cubic.

mod piece;
pub(crate) mod stretch;

pub(crate) use piece::Piece;

use super::{Exact, GAUSS_6, Light};

/// The trilinear function with these values at the corners of the unit cube, at `p`.
#[inline(always)]
pub(crate) fn trilinear(corners: &[f64; 8], p: [f64; 3]) -> f64 {
    let mix = |a: f64, b: f64, w: f64| a + (b - a) * w;
    let x = [0, 2, 4, 6].map(|i| mix(corners[i], corners[i + 1], p[0]));
    mix(mix(x[0], x[1], p[1]), mix(x[2], x[3], p[1]), p[2])
}

/// A cubic over [0, 1] by its Bernstein coefficients.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cubic(pub(crate) [f64; 4]);

impl Cubic {
    /// The trilinear function with these values at the corners of the unit cube (x fastest, then y), from `p` to `q`.
    #[inline(always)]
    pub(crate) fn along(corners: &[f64; 8], p: [f64; 3], q: [f64; 3]) -> Self {
        let mix = |a: f64, b: f64, w: f64| a + (b - a) * w;
        let x = [0, 2, 4, 6].map(|i| [p[0], q[0]].map(|w| mix(corners[i], corners[i + 1], w)));
        let ends = [p[1], q[1]];
        // First index z, then y, then x: of the ends that the coordinates are taken from.
        let y = [0, 2].map(|i| ends.map(|w| [0, 1].map(|e| mix(x[i][e], x[i + 1][e], w))));
        let at = |z: f64, b: usize, a: usize| mix(y[0][b][a], y[1][b][a], z);
        let third = 1.0 / 3.0;
        Cubic([
            at(p[2], 0, 0),
            (at(p[2], 0, 1) + at(p[2], 1, 0) + at(q[2], 0, 0)) * third,
            (at(p[2], 1, 1) + at(q[2], 0, 1) + at(q[2], 1, 0)) * third,
            at(q[2], 1, 1),
        ])
    }

    /// The parabola through three samples: at 0, ½ and 1.
    #[inline(always)]
    pub(crate) fn parabola([front, middle, back]: [f64; 3]) -> Self {
        // Its own middle coefficient, and its degree raised.
        let bend = 2.0 * middle - 0.5 * (front + back);
        Cubic([front, (front + 2.0 * bend) / 3.0, (2.0 * bend + back) / 3.0, back])
    }

    /// The same value everywhere.
    pub(crate) fn constant(s: f64) -> Self {
        Cubic([s; 4])
    }

    /// What it is not below and not above.
    #[inline(always)]
    pub(crate) fn bounds(&self) -> [f64; 2] {
        let [a, b, c, d] = self.0;
        [a.min(b).min(c.min(d)), a.max(b).max(c.max(d))]
    }

    /// Its value at `u`.
    #[inline(always)]
    pub(crate) fn at(&self, u: f64) -> f64 {
        let ([a, b, c, d], v) = (self.0, 1.0 - u);
        v * v * (v * a + 3.0 * u * b) + u * u * (3.0 * v * c + u * d)
    }

    /// The part from `u` to `v`, over [0, 1], by de Casteljau's construction.
    pub(crate) fn part(&self, u: f64, v: f64) -> Self {
        let blossom = |r: f64, s: f64, t: f64| {
            let mix = |a: f64, b: f64, w: f64| a * (1.0 - w) + b * w;
            let [a, b, c, d] = self.0;
            let (e, f, g) = (mix(a, b, r), mix(b, c, r), mix(c, d, r));
            mix(mix(e, f, s), mix(f, g, s), t)
        };
        Cubic([blossom(u, u, u), blossom(u, u, v), blossom(u, v, v), blossom(v, v, v)])
    }

    /// Where in ]0, 1[ it turns, ascending; 1 in place of what is not there.
    pub(crate) fn turns(&self) -> [f64; 2] {
        let [a, b, c, d] = self.0;
        // The derivative's Bernstein coefficients, but for a factor of 3: p (1−u)² + 2 q u (1−u) + r u².
        let (p, q, r) = (b - a, c - b, d - c);
        let inside = |u: f64| if u > 0.0 && u < 1.0 { u } else { 1.0 };
        // With w = u / (1 − u) it is p + 2 q w + r w² = 0; the stable of the two formulas for each root.
        let square = q * q - p * r;
        if square < 0.0 {
            return [1.0; 2];
        }
        let h = -(q + square.sqrt().copysign(q));
        let root = |above: f64, below: f64| inside(above / (above + below));
        let [u, v] = [root(h, r), root(p, h)];
        [u.min(v), u.max(v)]
    }

    /// Where in [`from`, `to`], between which it is monotone, it has the value `s`, which is between those at the ends; by
    /// Newton's steps, and by halves where these leave the bracket or are slow.
    pub(crate) fn root(&self, s: f64, mut from: f64, mut to: f64) -> f64 {
        let rises = self.at(to) > self.at(from);
        let ([a, b, c, d], mut u) = (self.0, f64::midpoint(from, to));
        for _ in 0..80 {
            let off = self.at(u) - s;
            if (off > 0.0) == rises {
                to = u;
            } else {
                from = u;
            }
            let v = 1.0 - u;
            let slope = 3.0 * (v * v * (b - a) + 2.0 * u * v * (c - b) + u * u * (d - c));
            let newton = u - off / slope;
            if (newton - u).abs() <= 1e-15 || to - from <= 1e-15 || off == 0.0 {
                return u;
            }
            u = if newton > from && newton < to { newton } else { f64::midpoint(from, to) };
        }
        u
    }
}

impl Exact<f64> {
    /// Calls `line` for each part of a cubic that is on one interval of the opacity function, in order: with its ends in
    /// [0, 1] and the interval. Parts that `shows` says nothing is seen of may be left out.
    #[inline(always)]
    pub(crate) fn for_each_line(
        &self,
        s: &Cubic,
        shows: impl Fn(usize) -> bool,
        mut line: impl FnMut(f64, f64, usize),
    ) {
        let [low, high] = s.bounds();
        let (knots, [first, last]) = (&self.opacity, self.opacity.intervals(low, high));
        if first == last {
            if shows(first) {
                line(0.0, 1.0, first);
            }
            return;
        }
        let places = &knots.s;
        let turns = s.turns();
        let mut from = 0.0;
        for to in [turns[0], turns[1], 1.0] {
            if to <= from {
                continue;
            }
            let (front, back) = (s.at(from), s.at(to));
            let rises = back >= front;
            let mut i = knots.interval(front);
            while !rises && i > 0 && places[i] >= front {
                i -= 1;
            }
            loop {
                let ahead = if rises { i + 1 } else { i };
                let passes = if rises { places[ahead] < back } else { places[ahead] > back };
                let end = if passes { s.root(places[ahead], from, to) } else { to };
                // An interval of no width is a step, which has no length either.
                if end > from && places[i] < places[i + 1] && shows(i) {
                    line(from, end, i);
                }
                from = end;
                if !passes || !rises && i == 0 || rises && ahead + 1 >= places.len() {
                    break;
                }
                i = if rises { i + 1 } else { i - 1 };
            }
            from = to;
        }
    }

    /// Adds a stretch `length` normalised units long along which a scalar is `s`; parts that `shows` says nothing is seen
    /// of may be left out.
    #[inline(always)]
    pub(crate) fn add_cubic(&self, s: &Cubic, length: f64, shows: impl Fn(usize) -> bool, light: &mut Light<f64>) {
        self.for_each_line(s, shows, |from, to, i| {
            let part = if from == 0.0 && to == 1.0 { *s } else { s.part(from, to) };
            self.add_line(&part, i, length * (to - from), light);
        });
    }

    /// Adds a stretch on interval `i` of the function.
    #[inline(always)]
    fn add_line(&self, s: &Cubic, i: usize, length: f64, light: &mut Light<f64>) {
        let (value, slope) = (&self.opacity.value[i], &self.opacity.slope[i]);
        let (offset, extinction) = self.on_line(s, i);
        let depth = Cubic(extinction.0.map(|c| c * length));
        if self.direct {
            let sum = Piece { depth, emission: [Cubic::constant(1.0), offset] }.integrate(true);
            light.add([1, 2, 3].map(|k| (value[k] * sum.emitted[0] + slope[k] * sum.emitted[1]) * length), sum.alpha);
        } else {
            let sum = Piece { depth, emission: [offset] }.integrate(false);
            light.add([1, 2, 3].map(|k| value[k] * sum.alpha + slope[k] * sum.emitted[0]), sum.alpha);
        }
    }

    /// How far a cubic is above the start of interval `i`, and the extinction along it there.
    #[inline(always)]
    fn on_line(&self, s: &Cubic, i: usize) -> (Cubic, Cubic) {
        let (start, value, slope) = (self.opacity.s[i], self.opacity.value[i][0], self.opacity.slope[i][0]);
        let offset = Cubic(s.0.map(|c| c - start));
        (offset, Cubic(offset.0.map(|c| value + slope * c)))
    }

    /// The mean extinction along a cubic, per normalised unit; and of the colour there (direct: emission), the mean by what
    /// each part adds to the extinction, or, where that is nothing or emission is direct, to the length.
    pub(crate) fn means(&self, s: &Cubic) -> (f64, [f64; 3]) {
        let (mut density, mut weighed, mut plain) = (0.0, [0.0; 3], [0.0; 3]);
        self.for_each_line(
            s,
            |_| true,
            |from, to, i| {
                let (value, slope) = (&self.opacity.value[i], &self.opacity.slope[i]);
                let (offset, extinction) = self.on_line(&s.part(from, to), i);
                // Exact for the product of two cubics.
                for [u, weight] in GAUSS_6 {
                    let (w, rho) = (weight * (to - from), extinction.at(u).max(0.0));
                    density += w * rho;
                    for k in 0..3 {
                        let color = value[k + 1] + slope[k + 1] * offset.at(u);
                        plain[k] += w * color;
                        weighed[k] += w * rho * color;
                    }
                }
            },
        );
        let by_extinction = density > 0.0 && !self.direct;
        (density, if by_extinction { weighed.map(|c| c / density) } else { plain })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn random(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn by_weights(c: &[f64; 8], [x, y, z]: [f64; 3]) -> f64 {
        let weight = |k: usize, i: usize, w: f64| if i >> k & 1 == 1 { w } else { 1.0 - w };
        (0..8).map(|i| c[i] * weight(0, i, x) * weight(1, i, y) * weight(2, i, z)).sum()
    }

    #[test]
    fn it_is_the_trilinear_function() {
        let mut seed = 7;
        for _ in 0..2000 {
            let corners: [f64; 8] = std::array::from_fn(|_| random(&mut seed) * 2.0 - 1.0);
            let [p, q]: [[f64; 3]; 2] = std::array::from_fn(|_| std::array::from_fn(|_| random(&mut seed)));
            let cubic = Cubic::along(&corners, p, q);
            assert!((trilinear(&corners, p) - by_weights(&corners, p)).abs() < 1e-15 * 8.0);
            let [low, high] = cubic.bounds();
            let part = cubic.part(0.25, 0.75);
            for i in 0..=20 {
                let u = f64::from(i) / 20.0;
                let at = |u: f64| by_weights(&corners, [0, 1, 2].map(|k| p[k] + (q[k] - p[k]) * u));
                assert!((cubic.at(u) - at(u)).abs() < 1e-15 * 8.0);
                assert!((part.at(u) - at(0.25 + 0.5 * u)).abs() < 1e-15 * 8.0);
                assert!(cubic.at(u) >= low - 1e-15 && cubic.at(u) <= high + 1e-15);
            }
        }
    }

    /// Between turns it is monotone, and values between the ends are found: clusters and tangents too.
    #[test]
    fn turns_and_roots() {
        let mut seed = 11;
        let mut cubics: Vec<Cubic> =
            (0..5000).map(|_| Cubic(std::array::from_fn(|_| random(&mut seed) * 2.0 - 1.0))).collect();
        cubics.extend(
            [[0.0; 4], [0.0, 1.0, 0.0, 1.0], [0.0, 1.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.0]]
                .map(Cubic),
        );
        // (u − ½)³, a tangent of order three; (u − ½)² u, of order two.
        cubics.extend([[-0.125, 0.125, -0.125, 0.125], [0.0, 1.0 / 12.0, -1.0 / 12.0, 0.25]].map(Cubic));
        for cubic in cubics {
            let turns = cubic.turns();
            let ends: Vec<f64> = [0.0].into_iter().chain(turns).chain([1.0]).collect();
            assert!(ends.is_sorted(), "{cubic:?}: {turns:?}");
            for w in ends.windows(2) {
                let (s, t) = (cubic.at(w[0]), cubic.at(w[1]));
                let values: Vec<f64> = (0..=50).map(|i| cubic.at(w[0] + (w[1] - w[0]) * f64::from(i) / 50.0)).collect();
                let slack = 1e-12;
                assert!(
                    values.windows(2).all(|v| if t >= s { v[1] >= v[0] - slack } else { v[1] <= v[0] + slack }),
                    "{cubic:?}"
                );
                for share in [1e-9, 0.1, 0.5, 0.500_000_001, 0.999] {
                    let wanted = s + (t - s) * share;
                    let u = cubic.root(wanted, w[0], w[1]);
                    assert!(u >= w[0] && u <= w[1]);
                    assert!((cubic.at(u) - wanted).abs() < 2e-14, "{cubic:?}: {wanted} at {u}");
                }
            }
        }
    }
}
