//! Second-order tables (El Hajjar, Marchesin, Dischler & Mongenet 2008): what a slab does along which the scalar is the
//! parabola through three samples, in front, in the middle and behind.
//!
//! With A = 2 s_f − 4 s_m + 2 s_b, B = −3 s_f + 4 s_m − s_b and C = s_f it is s(u) = (A u + B) u + C.
//! [`SecondOrder`] is the published table, of slabs of one length: colour and opacity, summed from back to front in K steps
//! of one value each. [`SecondOrderPolynomial`] holds for all lengths: the mean extinction ρ̂ = ∫₀¹ ρ(s(u)) du depends on
//! the samples alone, so that α = 1 − e^{−l ρ̂} is exact for every l, and the colour over α, which hardly depends on the
//! length, is a polynomial in l/l_max (as Guthe et al. 2002 have it for two samples).
//!
//! Between samples in [−1, 1] parabolas reach ±1.25; the function is what it is there. How far off such a table may be
//! between its texels: three samples that move by a texel's width h each move the parabola by 1.25 h at most, the Lebesgue
//! constant of three points, and a filter's mean of ρ̂ is off by no more than ρ varies over that ([`SecondOrderPolynomial::
//! bound`]): of order h where ρ is continuous. At a step of height r it is off by r times the share of the slab that is within
//! 1.25 h of the step, which is of order √h where a parabola touches it.

use super::polynomial::inverse;
use super::{Storage, between, is_scalar, reconstructed, value};
use crate::integral::cubic::Cubic;
use crate::integral::{Exact, Light};
use rayon::prelude::*;

/// How far parabolas reach through samples in [−1, 1].
const REACH: f64 = 1.25;

/// The least entries of the function where it is summed in steps.
const ENTRIES: u32 = 2048;

/// The published table: colour and opacity of slabs of one length.
#[derive(Debug, Clone, PartialEq)]
pub struct SecondOrder {
    /// Texels along each axis: the sample in front varies fastest, then the middle one.
    pub size: u32,
    /// The length of the slabs, in normalised units.
    pub length: f64,
    /// Premultiplied red, green, blue and opacity.
    pub texels: Storage,
}

/// The same for all lengths up to one.
#[derive(Debug, Clone, PartialEq)]
pub struct SecondOrderPolynomial {
    /// Of the polynomials: at least 1.
    pub degree: u32,
    /// Texels along each axis, as in [`SecondOrder`].
    pub size: u32,
    /// The length at which polynomials end, in normalised units.
    pub longest: f64,
    /// Emission is not multiplied by extinction: polynomials are of colour over what is seen of the length.
    pub direct: bool,
    /// For each power of l / l_max: red, green and blue; with the first, the mean extinction per normalised unit.
    pub texels: Vec<Storage>,
}

/// The samples of texel `at` of size³.
fn samples(at: usize, size: u32) -> [f64; 3] {
    let n = size as usize;
    [at % n, at / n % n, at / (n * n)].map(|i| value(i as u32, size))
}

/// Premultiplied colour and opacity of a slab `length` normalised units long, as parabolas are integrated exactly.
pub fn parabola(exact: &Exact<f64>, samples: [f64; 3], length: f64) -> [f64; 4] {
    let mut light = Light::none();
    exact.add_cubic(&Cubic::parabola(samples), length, |_| true, &mut light);
    let [r, g, b] = light.color;
    [r, g, b, 1.0 - light.through]
}

/// What a linear filter makes of the texels around three samples.
fn filtered(texels: &[[f32; 4]], size: u32, samples: [f64; 3]) -> [f64; 4] {
    let [f, m, b] = samples.map(|s| between((s + 1.0) / 2.0, size));
    let n = size as usize;
    let mut sum = [0.0; 4];
    for ((k, w), (j, v)) in b.into_iter().flat_map(|b| m.map(|m| (b, m))) {
        for (i, u) in f {
            let texel = texels[(k * n + j) * n + i];
            sum = std::array::from_fn(|c| sum[c] + u * v * w * f64::from(texel[c]));
        }
    }
    sum
}

impl SecondOrder {
    /// As published: `iterations` values of each parabola are evaluated by Horner's scheme and composited from back to
    /// front, each as a slice of constant colour and extinction. Runs on the current rayon pool. `None` for fields of
    /// several components, fewer than 2 texels along an axis, and no iteration.
    pub fn published(exact: &Exact<f64>, size: u32, length: f64, iterations: u32) -> Option<Self> {
        if !is_scalar(exact) || size < 2 || iterations == 0 {
            return None;
        }
        // Emission and transmittance of a slice by its value. Between two texels are as many entries as let each texel's
        // value have one, by a multiple of 8.
        let between_texels = 8 * ENTRIES.div_ceil(10 * (size - 1));
        let per_unit = f64::from((size - 1) * between_texels) / 2.0;
        let last = (2.0 * REACH * per_unit).round() as usize;
        let slice = length / f64::from(iterations);
        let of_value = |i: usize| {
            let s = i as f64 / per_unit - REACH;
            let [r, g, b, a] = parabola(exact, [s; 3], slice);
            [r, g, b, 1.0 - a].map(|v| v as f32)
        };
        let slices: Vec<[f32; 4]> = (0..=last).map(of_value).collect();
        let n = size as usize;
        let mut texels = Storage::zeroed(n * n * n);
        // From a value to its entry, rounded to the nearest.
        let scale = per_unit as f32;
        let shift = (REACH * per_unit) as f32 + 0.5;
        texels.par_chunks_mut(n).enumerate().for_each(|(row, texels)| {
            for (i, texel) in texels.iter_mut().enumerate() {
                let [f, m, b] = samples(row * n + i, size).map(|s| s as f32 * scale);
                let (second, first) = (2.0 * f - 4.0 * m + 2.0 * b, -3.0 * f + 4.0 * m - b);
                let mut color = [0.0f32, 0.0, 0.0];
                let mut through = 1.0f32;
                for step in (0..iterations).rev() {
                    let u = (step as f32 + 0.5) / iterations as f32;
                    let entry = ((second * u + first) * u + f + shift) as usize;
                    let [r, g, b, passes] = slices[entry.min(last)];
                    color = [r + passes * color[0], g + passes * color[1], b + passes * color[2]];
                    through *= passes;
                }
                *texel = [color[0], color[1], color[2], 1.0 - through];
            }
        });
        Some(SecondOrder { size, length, texels })
    }

    /// The same table, of parabolas that are integrated exactly.
    pub fn new(exact: &Exact<f64>, size: u32, length: f64) -> Option<Self> {
        if !is_scalar(exact) || size < 2 {
            return None;
        }
        let mut texels = Storage::zeroed((size as usize).pow(3));
        texels.par_iter_mut().enumerate().for_each(|(at, texel)| {
            *texel = parabola(exact, samples(at, size), length).map(|v| v as f32);
        });
        Some(SecondOrder { size, length, texels })
    }

    /// The same table as texels of `bits` bits hold it, which are in [0, 1].
    pub fn rounded(&self, bits: u32) -> Self {
        let levels = 2f32.powi(bits as i32) - 1.0;
        let mut rounded = self.clone();
        rounded.texels.as_flattened_mut().iter_mut().for_each(|v| *v = (v.clamp(0.0, 1.0) * levels).round() / levels);
        rounded
    }

    /// Premultiplied colour and opacity of a slab of the table's length, as a linear filter of the texels finds them.
    pub fn look_up(&self, samples: [f64; 3]) -> [f64; 4] {
        filtered(&self.texels, self.size, samples)
    }

    /// Bytes of its texels as 32-bit floats.
    pub fn bytes(&self) -> u64 {
        16 * u64::from(self.size).pow(3)
    }
}

impl SecondOrderPolynomial {
    /// Integrates `exact` over slabs of up to `longest` normalised units, on the current rayon pool. `None` for fields of
    /// several components, fewer than 2 texels along an axis or more than 128, and degrees that are not 1 to 4.
    pub fn new(exact: &Exact<f64>, degree: u32, size: u32, longest: f64) -> Option<Self> {
        if !is_scalar(exact) || !(2..=128).contains(&size) || !(1..=4).contains(&degree) {
            return None;
        }
        let inverse = inverse(degree as usize);
        let count = (size as usize).pow(3);
        let mut texels: Vec<Storage> = (0..=degree).map(|_| Storage::zeroed(count)).collect();
        let made: Vec<[[f32; 4]; 5]> = (0..count)
            .into_par_iter()
            .map(|at| {
                let parabola = Cubic::parabola(samples(at, size));
                let (density, limit) = exact.means(&parabola);
                // The first is the limit for short slabs: the mean colour by its share of the extinction.
                let points: Vec<[f64; 3]> = (0..=degree)
                    .map(|i| match i {
                        0 => limit,
                        _ => {
                            let l = longest * f64::from(i) / f64::from(degree);
                            let mut light = Light::none();
                            exact.add_cubic(&parabola, l, |_| true, &mut light);
                            let seen = reconstructed([1.0; 3], density, l, exact.direct)[0];
                            light.color.map(|c| if seen > 0.0 { c / seen } else { 0.0 })
                        }
                    })
                    .collect();
                let mut coefficients = [[0.0; 4]; 5];
                for (i, of) in coefficients.iter_mut().enumerate().take(points.len()) {
                    for k in 0..3 {
                        of[k] = points.iter().zip(&inverse[i]).map(|(p, w)| p[k] * w).sum::<f64>() as f32;
                    }
                }
                coefficients[0][3] = density as f32;
                coefficients
            })
            .collect();
        for (i, of) in texels.iter_mut().enumerate() {
            of.iter_mut().zip(&made).for_each(|(texel, made)| *texel = made[i]);
        }
        Some(SecondOrderPolynomial { degree, size, longest, direct: exact.direct, texels })
    }

    /// Premultiplied colour and opacity of a slab, as a linear filter of the texels finds them.
    pub fn look_up(&self, samples: [f64; 3], l: f64) -> [f64; 4] {
        let sums: Vec<[f64; 4]> = self.texels.iter().map(|of| filtered(of, self.size, samples)).collect();
        let x = l / self.longest;
        let color = [0, 1, 2].map(|k| sums.iter().rev().fold(0.0, |c, s| c * x + s[k]));
        reconstructed(color, sums[0][3], l, self.direct)
    }

    /// What its opacity is off by at most, from the greatest change of extinction over the reach of a texel: of the order of
    /// a texel's width where extinction is continuous.
    pub fn bound(&self, exact: &Exact<f64>) -> f64 {
        let reach = REACH * 2.0 / f64::from(self.size - 1);
        1.0 - (-self.longest * exact.opacity.variation(reach)).exp()
    }

    /// Bytes of its texels as 32-bit floats.
    pub fn bytes(&self) -> u64 {
        16 * u64::from(self.size).pow(3) * u64::from(self.degree + 1)
    }
}
