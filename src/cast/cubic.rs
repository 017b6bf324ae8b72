//! The trilinear field along a ray inside one voxel: a cubic, in Bernstein form.
//!
//! A trilinear function is affine in each coordinate by itself. So its blossom along the straight line from p to q is what
//! it is at points that take some coordinates from p and the others from q, and the coefficients of the cubic are means of
//! the eight corners of the box that p and q span. Nothing cancels, and the least and the greatest coefficient bound the
//! cubic.

/// The trilinear function with these values at the corners of the unit cube, at `p`.
#[inline(always)]
pub(super) fn trilinear(corners: &[f64; 8], p: [f64; 3]) -> f64 {
    let mix = |a: f64, b: f64, w: f64| a + (b - a) * w;
    let x = [0, 2, 4, 6].map(|i| mix(corners[i], corners[i + 1], p[0]));
    mix(mix(x[0], x[1], p[1]), mix(x[2], x[3], p[1]), p[2])
}

/// A cubic over [0, 1] by its Bernstein coefficients.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cubic(pub(super) [f64; 4]);

impl Cubic {
    /// The trilinear function with these values at the corners of the unit cube (x fastest, then y), from `p` to `q`.
    #[inline(always)]
    pub(super) fn along(corners: &[f64; 8], p: [f64; 3], q: [f64; 3]) -> Self {
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

    /// The same value everywhere.
    pub(super) fn constant(s: f64) -> Self {
        Cubic([s; 4])
    }

    /// What it is not below and not above.
    #[inline(always)]
    pub(super) fn bounds(&self) -> [f64; 2] {
        let [a, b, c, d] = self.0;
        [a.min(b).min(c.min(d)), a.max(b).max(c.max(d))]
    }

    /// Its value at `u`.
    #[inline(always)]
    pub(super) fn at(&self, u: f64) -> f64 {
        let ([a, b, c, d], v) = (self.0, 1.0 - u);
        v * v * (v * a + 3.0 * u * b) + u * u * (3.0 * v * c + u * d)
    }

    /// The part from `u` to `v`, over [0, 1], by de Casteljau's construction.
    pub(super) fn part(&self, u: f64, v: f64) -> Self {
        let blossom = |r: f64, s: f64, t: f64| {
            let mix = |a: f64, b: f64, w: f64| a * (1.0 - w) + b * w;
            let [a, b, c, d] = self.0;
            let (e, f, g) = (mix(a, b, r), mix(b, c, r), mix(c, d, r));
            mix(mix(e, f, s), mix(f, g, s), t)
        };
        Cubic([blossom(u, u, u), blossom(u, u, v), blossom(u, v, v), blossom(v, v, v)])
    }

    /// Where in ]0, 1[ it turns, ascending; 1 in place of what is not there.
    pub(super) fn turns(&self) -> [f64; 2] {
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
    pub(super) fn root(&self, s: f64, mut from: f64, mut to: f64) -> f64 {
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
