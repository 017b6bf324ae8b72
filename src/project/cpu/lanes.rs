//! The vectors of the sweep, and what pieces of rays emit and absorb in them: the equations are those of [`crate::integral`].

pub(super) use crate::integral::floats::{Floats, LANES};
use crate::integral::floats::{exp, series};
use crate::integral::{GAUSS_6, GAUSS_DEPTH, Piece, SERIES_DEPTH};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// Optical depth up to which the shorter series holds.
pub(super) const FAINT: f32 = 1.0 / 8.0;

/// Opacity and the weights of the emission at both ends of pieces of optical depths `x` and `y`. What is below 0 is rounding,
/// much of it beside great depths, and taken for 0.
#[inline(always)]
pub(super) fn piece<S: Simd>(simd: S, x: Floats<S>, y: Floats<S>, direct: bool) -> [Floats<S>; 3] {
    let zero = Floats::splat(simd, 0.0);
    let (x, y) = (x.max(zero), y.max(zero));
    let steepest = x.max(y);
    let most = |depth: f32| steepest.simd_gt(Floats::splat(simd, depth)).to_bitmask();
    if !direct && most(FAINT) == 0 {
        return faint(simd, x, y);
    }
    if most(SERIES_DEPTH as f32) == 0 {
        return mild(simd, x, y, direct);
    }
    let [alpha, front, back] = moderate(simd, x, y, direct);
    let deep = most(GAUSS_DEPTH as f32);
    // Faint lanes beside deeper ones keep their digits.
    let [a, f, b] = mild(simd, x, y, direct);
    let near = steepest.simd_le(Floats::splat(simd, SERIES_DEPTH as f32));
    let all = [near.select(a, alpha), near.select(f, front), near.select(b, back)];
    if deep == 0 { all } else { deeper(simd, x, y, direct, deep, all) }
}

/// Up to a depth of 1/8: [`mild`] with fewer terms; what is left out is below 1e-7 of the opacity.
#[inline(always)]
fn faint<S: Simd>(simd: S, x: Floats<S>, y: Floats<S>) -> [Floats<S>; 3] {
    let one = Floats::splat(simd, 1.0);
    let (depth, rise) = ((x + y) * 0.5, y - x);
    let (square, h) = (depth * depth, depth * 0.5);
    let q = h * series(simd, h, &[1.0, -0.5, 1.0 / 6.0, -1.0 / 24.0]);
    let even = square * series(simd, square, &[1.0 / 24.0, 1.0 / 1920.0]);
    let bent = rise
        .mul_add(series(simd, rise, &[1.0 / 240.0, 1.0 / 6720.0]), series(simd, square, &[1.0 / 12.0, 1.0 / 480.0]));
    let e = one - q;
    let scaled = e * depth;
    let alpha = scaled.mul_add(even, scaled);
    let back = e * rise.mul_add(bent, q + even);
    [alpha, alpha - back, back]
}

/// Up to a depth of 1: `Piece::by_series`.
#[inline(always)]
fn mild<S: Simd>(simd: S, x: Floats<S>, y: Floats<S>, direct: bool) -> [Floats<S>; 3] {
    const Q: [f32; 8] =
        [1.0, -1.0 / 2.0, 1.0 / 6.0, -1.0 / 24.0, 1.0 / 120.0, -1.0 / 720.0, 1.0 / 5040.0, -1.0 / 40_320.0];
    let one = Floats::splat(simd, 1.0);
    let (depth, rise) = ((x + y) * 0.5, y - x);
    let (square, h) = (depth * depth, depth * 0.5);
    let q = h * series(simd, h, &Q);
    let even = square * series(simd, square, &[1.0 / 24.0, 1.0 / 1920.0, 1.0 / 322_560.0]);
    let once = series(simd, square, &[1.0 / 12.0, 1.0 / 480.0, 1.0 / 53_760.0]);
    let twice = series(simd, square, &[1.0 / 240.0, 1.0 / 13_440.0]);
    let thrice =
        rise.mul_add(Floats::splat(simd, 1.0 / 241_920.0), series(simd, square, &[1.0 / 6720.0, 1.0 / 483_840.0]));
    let bent = rise.mul_add(rise.mul_add(thrice, twice), once);
    let e = one - q;
    let scaled = e * depth;
    let alpha = scaled.mul_add(even, scaled);
    if direct {
        let seen = even + 1.0 + rise * bent;
        let back = e * (seen * 0.5 - depth * bent);
        return [alpha, e * seen - back, back];
    }
    let back = e * rise.mul_add(bent, q + even);
    [alpha, alpha - back, back]
}

/// Up to a depth of 4: Gauss–Legendre sums.
#[inline(always)]
fn moderate<S: Simd>(simd: S, x: Floats<S>, y: Floats<S>, direct: bool) -> [Floats<S>; 3] {
    let zero = Floats::splat(simd, 0.0);
    let mut sum = [zero; 3];
    for [node, weight] in GAUSS_6 {
        let u = node as f32;
        let rise = (y - x) * u;
        let seen = exp(simd, (x + rise * 0.5) * -u) * weight as f32;
        let absorbed = (x + rise) * seen;
        let emitted = if direct { seen } else { absorbed };
        sum = [sum[0] + absorbed, sum[1] + emitted * (1.0 - u), sum[2] + emitted * u];
    }
    sum
}

/// Any depth, one lane after another.
#[inline(never)]
fn deeper<S: Simd>(
    simd: S,
    x: Floats<S>,
    y: Floats<S>,
    direct: bool,
    lanes: u64,
    all: [Floats<S>; 3],
) -> [Floats<S>; 3] {
    let (x, y): ([f32; LANES], [f32; LANES]) = (x.into(), y.into());
    let mut all: [[f32; LANES]; 3] = all.map(Into::into);
    for l in (0..LANES).filter(|l| lanes >> l & 1 == 1) {
        let piece = Piece::new(x[l], y[l], direct);
        (all[0][l], all[1][l], all[2][l]) = (piece.alpha, piece.front, piece.back);
    }
    all.map(|v| Floats::from_slice(simd, &v))
}

#[cfg(test)]
mod tests {
    use super::*;
    use fearless_simd::{Level, dispatch};

    #[test]
    fn lanes_are_pieces() {
        let depths = [0.0, 1e-30, 1e-6, 1e-3, 0.03, 0.1, 0.12, 0.13, 0.3, 0.9, 1.0, 1.1, 2.0, 3.9, 4.1, 9.0, 40.0, 1e6];
        for direct in [false, true] {
            for x in depths {
                for y in depths {
                    // Alone, and beside deeper ones.
                    for other in [0.0, 0.5, 3.0, 20.0] {
                        let lanes = |v: f32| std::array::from_fn(|l| if l % 5 == 2 { other } else { v });
                        let (a, b): ([f32; LANES], [f32; LANES]) = (lanes(x), lanes(y));
                        let got = dispatch!(Level::new(), simd => {
                            piece(simd, Floats::from_slice(simd, &a), Floats::from_slice(simd, &b), direct)
                                .map(<[f32; LANES]>::from)
                        });
                        let want = Piece::new(f64::from(x), f64::from(y), direct);
                        for (k, want) in [want.alpha, want.front, want.back].into_iter().enumerate() {
                            for l in [0, LANES - 1] {
                                let error = (f64::from(got[k][l]) - want).abs();
                                let bound = if direct && k > 0 {
                                    1e-6
                                } else {
                                    1e-5 * want.abs() + 3e-7 * want.abs().max(1e-2)
                                };
                                assert!(
                                    error <= bound.min(1e-6),
                                    "{k} at {x}, {y} beside {other}: {} not {want}",
                                    got[k][l]
                                );
                            }
                        }
                    }
                }
            }
        }
    }
}
