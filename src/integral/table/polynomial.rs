//! The separated table (Guthe, Röttger, Schieber, Straßer & Ertl 2002, section 3).
//!
//! Opacity needs two parameters only: with the mean extinction ρ̂(s_f, s_b) = ∫₀¹ ρ(s_f + t (s_b − s_f)) dt it is α = 1
//! − e^{−l ρ̂}. The colour over α hardly depends on the length: it is a polynomial of degree n in l/l_max, through its
//! values at l = (i/n) l_max, the first of which is its limit. So n + 1 tables of two parameters stand for one of
//! three.

use super::closed::{self, Both, Runs};
use super::grid::Grid;
use super::volume::{OPAQUE_DEPTH, Pieces, normalised};
use super::{between, bound_of_polynomial, for_each_piece, is_tabulated, reconstructed, value};
use crate::integral::Exact;
use rayon::prelude::*;

/// Coefficients of polynomials and mean extinctions, for `size` × `size` values in front and behind.
#[derive(Debug, Clone, PartialEq)]
pub struct Polynomial {
    /// Of the polynomials: at least 1.
    pub degree: u32,
    /// Texels along both axes; the value in front varies fastest.
    pub size: u32,
    /// The length at which polynomials end, in normalised units.
    pub longest: f64,
    /// Emission is not multiplied by extinction: polynomials are of colour over what is seen of the length.
    pub direct: bool,
    /// For each power of l / l_max: red, green and blue; with the first, the mean extinction per normalised unit.
    pub texels: Vec<Vec<[f32; 4]>>,
}

/// The share of the longest length at which a mean extinction may be opaque: cells of one mesh differ much in size.
pub(crate) const THINNEST: f64 = 1.0 / 16384.0;

/// Segments of neighbouring distances that are integrated before they are written: as many as the cache holds.
const BAND: usize = 1 << 14;

/// Coefficients of the polynomials through a limit and points; with the first, the mean extinction.
#[inline(always)]
fn coefficients<const L: usize, const P: usize>(
    weights: &[[f32; P]; P],
    limit: [f32; 4],
    points: &[[f32; 4]; L],
) -> [[f32; 4]; P] {
    let mut all = [[0.0; 4]; P];
    for (c, (of, weights)) in all.iter_mut().zip(weights).enumerate() {
        *of = limit.map(|v| v * weights[0]);
        for (point, weight) in points.iter().zip(&weights[1..]) {
            for k in 0..4 {
                of[k] += point[k] * weight;
            }
        }
        of[3] = if c == 0 { limit[3] } else { 0.0 };
    }
    all
}

/// A sum of powers that goes through points at 0, 1/n, …, 1: the rows give its coefficients from the values there.
pub(crate) type Inverse = Vec<Vec<f64>>;

impl Polynomial {
    /// Integrates `exact` over segments of up to `longest` normalised units, on the current rayon pool. `None` for
    /// pairs, of which [`Exact::weights`] can be tabulated, less than 2 texels along an axis, and degrees that are not 1 to 8:
    /// points at equal distances give no better ones.
    pub fn new(exact: &Exact<f64>, degree: u32, size: u32, longest: f64) -> Option<Self> {
        if !is_tabulated(exact) || size < 2 || !(1..=8).contains(&degree) {
            return None;
        }
        let inverse = inverse(degree as usize);
        let lengths: Vec<f64> = (0..=degree).map(|i| longest * f64::from(i) / f64::from(degree)).collect();
        let columns: Vec<Vec<[f32; 4]>> = (0..size * size)
            .into_par_iter()
            .map(|at| {
                let (front, back) = (value(at % size, size), value(at / size, size));
                let mut pieces = Pieces::new();
                for_each_piece(exact, front, back, |f, b, share| pieces.push((f, b, share)));
                let points: Vec<[f64; 4]> =
                    lengths.iter().map(|&l| normalised(exact, front, back, &pieces, l, longest * THINNEST)).collect();
                let coefficient = |i: usize| {
                    let [r, g, b] =
                        [0, 1, 2].map(|k| points.iter().zip(&inverse[i]).map(|(p, w)| p[k] * w).sum::<f64>() as f32);
                    [r, g, b, if i == 0 { points[0][3] as f32 } else { 0.0 }]
                };
                (0..points.len()).map(coefficient).collect()
            })
            .collect();
        let texels = (0..=degree as usize).map(|i| columns.iter().map(|c| c[i]).collect()).collect();
        Some(Polynomial { degree, size, longest, direct: exact.direct, texels })
    }

    /// The same table, to f32, in a time per texel that does not depend on the function (`closed.rs` says how), up to
    /// degree 4.
    pub fn closed(exact: &Exact<f64>, degree: u32, size: u32, longest: f64) -> Option<Self> {
        // Of higher degrees, coefficients are great sums of both signs, which f32 does not hold.
        if size < 3 || degree > 4 {
            return Self::new(exact, degree, size, longest);
        }
        if !is_tabulated(exact) || degree == 0 {
            return None;
        }
        let texels = vec![vec![[0.0; 4]; size as usize * size as usize]; degree as usize + 1];
        let mut table = Polynomial { degree, size, longest, direct: exact.direct, texels };
        table.fill(&Grid::new(exact, size));
        Some(table)
    }

    /// This table of another function, in the memory that it has: faster than [`Polynomial::closed`], as that is then
    /// known to be there.
    pub fn rebuild(&mut self, exact: &Exact<f64>) {
        if is_tabulated(exact) && self.size > 2 && self.degree <= 4 {
            self.direct = exact.direct;
            self.fill(&Grid::new(exact, self.size));
        } else if let Some(new) = Self::new(exact, self.degree, self.size, self.longest) {
            *self = new;
        }
    }

    fn fill(&mut self, grid: &Grid) {
        match self.degree {
            1 => self.fill_of::<1, 2>(grid),
            2 => self.fill_of::<2, 3>(grid),
            _ => self.fill_of::<4, 5>(grid),
        }
    }

    /// For degrees up to `L`, with `P` = `L` + 1 points and coefficients.
    fn fill_of<const L: usize, const P: usize>(&mut self, grid: &Grid) {
        let (n, degree) = (grid.size, self.degree as usize);
        let mut weights = [[0.0; P]; P];
        for (row, of) in weights.iter_mut().zip(&inverse(degree)) {
            row.iter_mut().zip(of).for_each(|(w, of)| *w = *of as f32);
        }
        // The first point is a limit; points beyond the last have no weight.
        let lengths: [f32; L] =
            std::array::from_fn(|l| (self.longest * (l + 1).min(degree) as f64 / degree as f64) as f32);
        let most = (OPAQUE_DEPTH / (self.longest * THINNEST)) as f32;
        let mut by_row: Vec<Vec<&mut [[f32; 4]]>> = (0..n).map(|_| vec![]).collect();
        for of in &mut self.texels {
            of.chunks_exact_mut(n).zip(&mut by_row).for_each(|(row, rows)| rows.push(row));
        }
        // Coefficients of a rising scalar and of a falling one: of some distances at a time, so that they stay in the
        // cache, each written by one thread and read by another.
        let runs = Runs::new(grid, lengths);
        let band = (BAND / n).clamp(1, n);
        // Not as many as a power of 2, as then all distances of a texel would have one place in the cache.
        let stride = n + 3;
        let mut sheared = vec![[[[0.0f32; 4]; P]; 2]; stride * band];
        for first in (0..n).step_by(band) {
            let count = band.min(n - first);
            sheared[..stride * count].par_chunks_mut(stride).enumerate().for_each_init(
                || (runs.scratch(), vec![Both::NOTHING; n]),
                |(scratch, segments), (d, sheared)| {
                    let d = first + d;
                    runs.apart(d, scratch, &mut segments[..n - d]);
                    for (i, (both, of)) in segments[..n - d].iter_mut().zip(sheared).enumerate() {
                        let [limit, fallen] = closed::normalise(grid, [i, i + d], both, most);
                        *of = [(&both.rising, limit), (&both.falling, fallen)]
                            .map(|(lanes, limit)| coefficients(&weights, limit, &lanes.0));
                    }
                },
            );
            by_row.par_iter_mut().enumerate().for_each(|(j, rows)| {
                for (c, row) in rows.iter_mut().enumerate() {
                    let falling = sheared[j..].iter().step_by(stride).map(|of| of[1][c]);
                    row[j..].iter_mut().skip(first).zip(falling.take(count)).for_each(|(to, texel)| *to = texel);
                    for d in first..(first + count).min(j + 1) {
                        row[j - d] = sheared[(d - first) * stride + j - d][0][c];
                    }
                }
            });
        }
    }

    /// Premultiplied colour and opacity of a segment, as a linear filter of the texels finds them.
    pub fn look_up(&self, front: f64, back: f64, l: f64) -> [f64; 4] {
        let [f, b] = [front, back].map(|s| between((s + 1.0) / 2.0, self.size));
        let mut sums = vec![[0.0; 4]; self.texels.len()];
        for ((i, u), (j, v)) in b.into_iter().flat_map(|(j, v)| f.map(|i| (i, (j, v)))) {
            for (sum, texels) in sums.iter_mut().zip(&self.texels) {
                let texel = texels[j * self.size as usize + i];
                *sum = std::array::from_fn(|k| sum[k] + u * v * f64::from(texel[k]));
            }
        }
        let x = l / self.longest;
        let color = [0, 1, 2].map(|k| sums.iter().rev().fold(0.0, |c, s| c * x + s[k]));
        reconstructed(color, sums[0][3], l, self.direct)
    }

    /// The greatest of each coefficient's channels, by which it is divided where texels are in [−1, 1]: one scale for
    /// the colours of all powers would leave the higher ones few levels, so each has its own; with it, that of the mean
    /// extinction (which is in [0, 1]).
    pub fn scales(&self) -> Vec<[f32; 2]> {
        let most = |t: &Vec<[f32; 4]>| {
            t.iter()
                .fold([f32::MIN_POSITIVE; 2], |[c, d], t| [t[..3].iter().fold(c, |m, v| m.max(v.abs())), d.max(t[3])])
        };
        self.texels.iter().map(most).collect()
    }

    /// The same table as texels of `bits` bits hold it, scaled to their range: two's complement for coefficients, as
    /// they have a sign.
    pub fn rounded(&self, bits: u32) -> Self {
        let levels = (2f32).powi(bits as i32) - 1.0;
        let half = ((2f32).powi(bits as i32 - 1) - 1.0).max(1.0);
        let mut rounded = self.clone();
        for (texels, [color, density]) in rounded.texels.iter_mut().zip(self.scales()) {
            for t in texels {
                t[..3].iter_mut().for_each(|v| *v = (*v / color * half).round() / half * color);
                t[3] = (t[3] / density * levels).round() / levels * density;
            }
        }
        rounded
    }

    /// [`bound_of_polynomial`] of a table of this size.
    pub fn bound(&self, exact: &Exact<f64>) -> Option<f64> {
        bound_of_polynomial(exact, self.degree, self.size, self.longest)
    }

    /// Bytes of its texels as 32-bit floats.
    pub fn bytes(&self) -> u64 {
        16 * u64::from(self.size).pow(2) * u64::from(self.degree + 1)
    }
}

/// Lagrange's polynomials, multiplied out.
pub(crate) fn inverse(degree: usize) -> Inverse {
    let at = |i: usize| i as f64 / degree as f64;
    let mut rows = vec![vec![]; degree + 1];
    for j in 0..=degree {
        // The polynomial that is 1 at j and 0 at the other points.
        let mut powers = vec![1.0];
        for i in (0..=degree).filter(|&i| i != j) {
            let mut next = vec![0.0; powers.len() + 1];
            for (k, p) in powers.iter().enumerate() {
                next[k + 1] += p / (at(j) - at(i));
                next[k] -= p * at(i) / (at(j) - at(i));
            }
            powers = next;
        }
        rows.iter_mut().zip(powers).for_each(|(row, p)| row.push(p));
    }
    rows
}
