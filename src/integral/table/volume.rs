//! The table of three parameters. Röttger, Kraus & Ertl (2000) have uniform lengths. Kraus, Qiao & Ebert (2004, section
//! 3) have logarithmic ones, in slices for 0, Δl, 2 Δl, 4 Δl, … up to l_max, with Δl = 2^−(n_r−2) l_max; their equation
//! 1 maps a length l to the coordinate r = (max(log₂(l/Δl), 0) + min(l/Δl, 1)) / n_r + 1 / (2 n_r).
//!
//! Between slices the table is interpolated linearly in r, but in thin cells colour and opacity rise linearly with l:
//! at l = 2^(k+f) Δl they come out (1 + f) 2^−f times too great, 4.1 % on average and up to 6.1 %, however many slices
//! there are. What hardly depends on the length has no such bias: [`Kind::LogNormalised`] keeps the mean extinction ρ̂
//! = −ln(1−α)/l and the colour C/α, so that α = 1 − e^{−l ρ̂}.

use super::closed::{self, Both, Runs};
use super::grid::Grid;
use super::{
    Storage, between, bound_of_volume, for_each_piece, is_scalar, is_tabulated, light, published, reconstructed, value,
};
use crate::integral::{Exact, Light};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// What a table holds, and for which lengths.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Premultiplied colour and opacity, for lengths that are equally far apart.
    Uniform,
    /// The same for logarithmic lengths, as published.
    Log,
    /// Colour over opacity (for direct emission: over the length that is seen) and mean extinction, for logarithmic
    /// lengths.
    #[default]
    LogNormalised,
}

/// A table of `size[0]` values in front, `size[1]` values behind and `size[2]` lengths.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Its kind.
    pub kind: Kind,
    /// Texels along each axis.
    pub size: [u32; 3],
    /// The length of the last slice, in normalised units.
    pub longest: f64,
    /// Emission is not multiplied by extinction.
    pub direct: bool,
    /// Colour and opacity, or what stands for them; the value in front varies fastest, the length slowest. f32 would
    /// not change what f64 finds, but for rounding it once.
    pub texels: Storage,
}

/// Lengths that are integrated side by side, and distances of values of which texels are written at a time.
const LANES: usize = 8;
const DISTANCES: usize = 8;

/// Optical depths beyond this are opaque, and so is a mean extinction that gives it to the thinnest slice but 0.
pub(crate) const OPAQUE_DEPTH: f64 = 100.0;

/// The piecewise linear function along one segment: extinction and colour in front and behind of each piece, and its
/// share of the length.
pub(super) type Pieces = Vec<([f64; 4], [f64; 4], f64)>;

impl Table {
    /// Integrates `exact` over segments of up to `longest` normalised units, on the current rayon pool. `None` for
    /// pairs, of which [`Exact::weights`] can be tabulated, and for sizes that are no table: less than 2 × 2 × 3
    /// texels.
    pub fn new(exact: &Exact<f64>, kind: Kind, size: [u32; 3], longest: f64) -> Option<Self> {
        if !is_tabulated(exact) || size[0] < 2 || size[1] < 2 || size[2] < 3 {
            return None;
        }
        let lengths: Vec<f64> = (0..size[2]).map(|k| length(kind, size[2], longest, k)).collect();
        let slice = size[0] as usize * size[1] as usize;
        let columns: Vec<Vec<[f32; 4]>> = (0..slice)
            .into_par_iter()
            .map(|at| {
                let (front, back) = (value(at as u32 % size[0], size[0]), value(at as u32 / size[0], size[1]));
                let mut pieces = Pieces::new();
                for_each_piece(exact, front, back, |f, b, share| pieces.push((f, b, share)));
                let column = lengths.iter().map(|&l| match kind {
                    Kind::LogNormalised => normalised(exact, front, back, &pieces, l, lengths[1]),
                    _ => published(exact, front, back, l),
                });
                column.map(|t| t.map(|c| c as f32)).collect()
            })
            .collect();
        let texels: Vec<_> = (0..lengths.len()).flat_map(|k| columns.iter().map(move |c| c[k])).collect();
        Some(Table { kind, size, longest, direct: exact.direct, texels: texels.into() })
    }

    /// The same table, to f32, in a time per texel that does not depend on the function (`closed.rs` says how), where
    /// there are as many values behind as in front; other sizes as [`Table::new`] has them.
    pub fn closed(exact: &Exact<f64>, kind: Kind, size: [u32; 3], longest: f64) -> Option<Self> {
        if size[0] != size[1] || size[0] < 3 {
            return Self::new(exact, kind, size, longest);
        }
        if !is_tabulated(exact) || size[2] < 3 {
            return None;
        }
        let texels = Storage::zeroed(size.iter().map(|&n| n as usize).product());
        let mut table = Table { kind, size, longest, direct: exact.direct, texels };
        table.fill(&Grid::new(exact, size[0]));
        Some(table)
    }

    /// This table of another function, in the memory that it has: faster than [`Table::closed`], as that is then known
    /// to be there.
    pub fn rebuild(&mut self, exact: &Exact<f64>) {
        let [w, h, _] = self.size;
        if is_tabulated(exact) && w == h && w > 2 {
            self.direct = exact.direct;
            self.fill(&Grid::new(exact, w));
        } else if let Some(new) = Self::new(exact, self.kind, self.size, self.longest) {
            *self = new;
        }
    }

    fn fill(&mut self, grid: &Grid) {
        let (n, slices, normalised) = (grid.size, self.size[2], self.kind == Kind::LogNormalised);
        let length = |k: u32| length(self.kind, slices, self.longest, k.min(slices - 1));
        let most = (OPAQUE_DEPTH / length(1)) as f32;
        let fill = |(group, texels): (usize, &mut [[f32; 4]])| {
            let lengths: [f32; LANES] = std::array::from_fn(|l| length((group * LANES + l) as u32) as f32);
            let runs = Runs::new(grid, lengths);
            let (mut scratch, mut segments) = (runs.scratch(), vec![Both::NOTHING; DISTANCES * n]);
            let mut slices: Vec<_> = texels.chunks_exact_mut(n * n).collect();
            for first in (0..n).step_by(DISTANCES) {
                let count = DISTANCES.min(n - first);
                for (d, row) in (first..first + count).zip(segments.chunks_exact_mut(n)) {
                    runs.apart(d, &mut scratch, &mut row[..n - d]);
                    if normalised {
                        for (i, both) in row[..n - d].iter_mut().enumerate() {
                            closed::normalise(grid, [i, i + d], both, most);
                        }
                    }
                }
                // Several distances at a time, as then texels that are written one after another are neighbours.
                for j in 0..n {
                    for d in first..(first + count).min(n - j) {
                        let at = j * n + j + d;
                        let texels = &segments[(d - first) * n + j].falling.0;
                        slices.iter_mut().zip(texels).for_each(|(slice, texel)| slice[at] = *texel);
                    }
                    for d in first..(first + count).min(j + 1) {
                        let at = j * n + j - d;
                        let texels = &segments[(d - first) * n + j - d].rising.0;
                        slices.iter_mut().zip(texels).for_each(|(slice, texel)| slice[at] = *texel);
                    }
                }
            }
        };
        self.texels.par_chunks_mut(n * n * LANES).enumerate().for_each(fill);
    }

    /// Premultiplied colour and opacity of a segment, as a linear filter of the texels finds them.
    pub fn look_up(&self, front: f64, back: f64, l: f64) -> [f64; 4] {
        let [w, h, n] = self.size;
        let slices = coordinate(self.kind, n, self.longest, l) * f64::from(n) - 0.5;
        let mut sum = [0.0; 4];
        for (slice, of_slice) in between(slices / f64::from(n - 1), n) {
            for (j, v) in between((back + 1.0) / 2.0, h) {
                for (i, u) in between((front + 1.0) / 2.0, w) {
                    let texel = self.texels[(slice * h as usize + j) * w as usize + i];
                    sum = std::array::from_fn(|k| sum[k] + of_slice * u * v * f64::from(texel[k]));
                }
            }
        }
        if self.kind != Kind::LogNormalised {
            return sum;
        }
        let [r, g, b, density] = sum;
        reconstructed([r, g, b], density, l, self.direct)
    }

    /// [`bound_of_volume`] of a table of this kind and size, with as many values behind as in front.
    pub fn bound(&self, exact: &Exact<f64>) -> Option<f64> {
        let [values, behind, slices] = self.size;
        (values == behind).then(|| bound_of_volume(exact, self.kind, [values, slices], self.longest)).flatten()
    }

    /// Bytes of its texels as 32-bit floats.
    pub fn bytes(&self) -> u64 {
        size_of_val(&*self.texels) as u64
    }

    /// The largest of each channel, by which it is divided where texels are in [0, 1].
    pub fn greatest(&self) -> [f32; 4] {
        let most = self.texels.iter().fold([0.0f32; 4], |m, t| [0, 1, 2, 3].map(|k| m[k].max(t[k])));
        let colour = most[0].max(most[1]).max(most[2]).max(f32::MIN_POSITIVE);
        [colour, colour, colour, if self.kind == Kind::LogNormalised { most[3].max(f32::MIN_POSITIVE) } else { 1.0 }]
    }
}

/// The length of slice `k` of `n`.
pub fn length(kind: Kind, n: u32, longest: f64, k: u32) -> f64 {
    match kind {
        Kind::Uniform => longest * f64::from(k) / f64::from(n - 1),
        Kind::Log | Kind::LogNormalised if k == 0 => 0.0,
        Kind::Log | Kind::LogNormalised => longest * (f64::from(k) - f64::from(n - 1)).exp2(),
    }
}

/// Where in a table of `n` slices, as a texture coordinate, the length `l` is: equation 1, or its uniform counterpart.
pub fn coordinate(kind: Kind, n: u32, longest: f64, l: f64) -> f64 {
    let n = f64::from(n);
    let slices = match kind {
        Kind::Uniform => l / longest * (n - 1.0),
        Kind::Log | Kind::LogNormalised => {
            let steps = l / (longest * (2.0 - n).exp2());
            steps.log2().max(0.0) + steps.min(1.0)
        }
    };
    (slices + 0.5) / n
}

pub(super) fn normalised(
    exact: &Exact<f64>,
    front: f64,
    back: f64,
    pieces: &Pieces,
    l: f64,
    thinnest: f64,
) -> [f64; 4] {
    let sum =
        |of: &dyn Fn(&[f64; 4], &[f64; 4]) -> f64| pieces.iter().map(|(f, b, share)| share * of(f, b)).sum::<f64>();
    let extinction = sum(&|f, b| (f[0] + b[0]) / 2.0);
    let density = extinction.min(OPAQUE_DEPTH / thinnest);
    let depth = extinction * l;
    // Without length or extinction: the limit, in which nothing hides anything.
    if depth < 1e-9 {
        let mean = |k: usize| {
            if exact.direct || extinction <= 0.0 {
                return colour_of(exact, front, back, pieces, k);
            }
            let weighed =
                |f: &[f64; 4], b: &[f64; 4]| (2.0 * f[0] * f[k] + f[0] * b[k] + b[0] * f[k] + 2.0 * b[0] * b[k]) / 6.0;
            sum(&weighed) / extinction
        };
        return [mean(1), mean(2), mean(3), density];
    }
    let Light { color, transmittance } = light(exact, front, back, l);
    let alpha = if depth > 1e-3 { 1.0 - transmittance } else { -(-depth).exp_m1() };
    let seen = if exact.direct { alpha / extinction } else { alpha };
    let [r, g, b] = color.map(|c| c / seen);
    [r, g, b, density]
}

/// The mean colour of a segment that may have no extinction, and so no pieces.
fn colour_of(exact: &Exact<f64>, front: f64, back: f64, pieces: &Pieces, k: usize) -> f64 {
    if pieces.is_empty() && !is_scalar(exact) {
        // Half of the way, as where extinction is the same all along.
        return if k < 3 { 0.5 } else { 0.0 };
    }
    if pieces.is_empty() {
        return (exact.opacity.color_at(front, k) + exact.opacity.color_at(back, k)) / 2.0;
    }
    pieces.iter().map(|(f, b, share)| share * (f[k] + b[k]) / 2.0).sum()
}
