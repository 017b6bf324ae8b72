//! Second-order tables (El Hajjar, Marchesin, Dischler & Mongenet 2008): what a slab does along which the scalar is the
//! parabola through three samples, in front, in the middle and behind.
//!
//! With A = 2 s_f − 4 s_m + 2 s_b, B = −3 s_f + 4 s_m − s_b and C = s_f it is s(u) = (A u + B) u + C.
//! [`SecondOrder`] is the published table, of slabs of one length: colour and opacity, summed from back to front in K steps
//! of one value each; several of these, for lengths at equal distances, are the table of four parameters that the authors
//! start from ([`SecondOrderLengths`]). [`SecondOrderPolynomial`] holds for all lengths: the mean extinction ρ̂ = ∫₀¹ ρ(s(u)) du
//! depends on the samples alone, so that α = 1 − e^{−l ρ̂} is exact for every l, and the colour over α, which hardly depends
//! on the length, is a polynomial in l/l_max (as Guthe et al. 2002 have it for two samples).
//!
//! Between samples in [−1, 1] parabolas reach ±1.25; the function is what it is there. How far off such a table may be
//! between its texels: three samples that move by a texel's width h each move the parabola by 1.25 h at most, the Lebesgue
//! constant of three points, and a filter's mean of ρ̂ is off by no more than ρ varies over that ([`SecondOrderPolynomial::
//! bound`]): of order h where ρ is continuous. At a step of height r it is off by r times the share of the slab that is within
//! 1.25 h of the step, which is of order √h where a parabola touches it. In K steps a parabola, whose slope is 8 at most, is
//! 4/K away from the value of a step at most, which counts likewise ([`SecondOrder::bound`]).

mod bounds;
mod parabolas;
mod slices;

use super::polynomial::inverse;
use super::{Storage, between, is_scalar, reconstructed, value};
use crate::integral::cubic::Cubic;
use crate::integral::{Exact, Light};
use parabolas::Parabolas;
use rayon::prelude::*;
pub(crate) use slices::Slices;

/// How far parabolas reach through samples in [−1, 1].
pub(crate) const REACH: f64 = 1.25;

/// The greatest slope of such.
const STEEPEST: f64 = 8.0;

/// The most texels along each axis of a table for all lengths: with 256, one of degree 2 would take 805 MB.
pub const MOST_OF_ALL_LENGTHS: u32 = 128;

/// The same of one length: of more, floats would take more than 1 GB.
pub const MOST_OF_ONE_LENGTH: u32 = 406;

/// The published table: colour and opacity of slabs of one length.
#[derive(Debug, Clone, PartialEq)]
pub struct SecondOrder {
    /// Texels along each axis: the sample in front varies fastest, then the middle one.
    pub size: u32,
    /// The length of the slabs, in normalised units.
    pub length: f64,
    /// Steps in which slabs are summed; none if they are integrated exactly.
    pub iterations: Option<u32>,
    /// Premultiplied red, green, blue and opacity.
    pub texels: Slabs,
}

/// How a [`SecondOrder`]'s texels are stored.
#[derive(Debug, Clone, PartialEq)]
pub enum Slabs {
    /// As 32-bit floats.
    Float(Storage),
    /// In bytes, as published: a quarter of the memory.
    Bytes {
        /// 255 stands for 1 in opacities.
        texels: Vec<[u8; 4]>,
        /// What 255 stands for in colours: the greatest that there can be, at least 1.
        span: f32,
    },
}

/// The published table of all four parameters: tables for lengths at equal distances, the first of which is 0 and has none.
#[derive(Debug, Clone, PartialEq)]
pub struct SecondOrderLengths {
    /// By length, ascending.
    pub tables: Vec<SecondOrder>,
}

/// The same for all lengths up to one.
#[derive(Debug, Clone, PartialEq)]
pub struct SecondOrderPolynomial {
    /// Of the polynomials: from 1 to 4.
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
pub(crate) fn samples(at: usize, size: u32) -> [f64; 3] {
    let n = size as usize;
    [at % n, at / n % n, at / (n * n)].map(|i| value(i as u32, size))
}

/// Premultiplied colour and opacity of a slab `length` normalised units long, as parabolas are integrated exactly.
pub fn parabola(exact: &Exact<f64>, samples: [f64; 3], length: f64) -> [f64; 4] {
    let mut light = Light::none();
    exact.add_cubic(&Cubic::parabola(samples), length, |_| true, &mut light);
    let [r, g, b] = light.color;
    [r, g, b, 1.0 - light.transmittance]
}

/// What a linear filter makes of the texels around three samples.
fn filtered(texel: impl Fn(usize) -> [f32; 4], size: u32, samples: [f64; 3]) -> [f64; 4] {
    let [f, m, b] = samples.map(|s| between((s + 1.0) / 2.0, size));
    let n = size as usize;
    let mut sum = [0.0; 4];
    for ((k, w), (j, v)) in b.into_iter().flat_map(|b| m.map(|m| (b, m))) {
        for (i, u) in f {
            let texel = texel((k * n + j) * n + i);
            sum = std::array::from_fn(|c| sum[c] + u * v * w * f64::from(texel[c]));
        }
    }
    sum
}

impl Slabs {
    /// Texel `i`.
    #[inline(always)]
    pub fn get(&self, i: usize) -> [f32; 4] {
        match self {
            Slabs::Float(texels) => texels[i],
            Slabs::Bytes { texels, span } => {
                let [r, g, b, a] = texels[i].map(|v| f32::from(v) * (1.0 / 255.0));
                [r * span, g * span, b * span, a]
            }
        }
    }
}

/// What 255 stands for in the colours of slabs of this length.
pub(crate) fn span(exact: &Exact<f64>, length: f64) -> f32 {
    let brightest = exact.opacity.value.iter().flat_map(|v| &v[1..]).fold(0.0, |most: f64, c| most.max(*c));
    (if exact.direct { brightest * length } else { brightest }).max(1.0) as f32
}

impl SecondOrder {
    /// As published: `iterations` values of each parabola are evaluated by Horner's scheme and composited from back to
    /// front, each as a slice of constant colour and extinction. Runs on the current rayon pool. `None` for fields of
    /// several components, fewer than 2 texels along an axis or more than [`MOST_OF_ONE_LENGTH`], and no iteration.
    pub fn published(exact: &Exact<f64>, size: u32, length: f64, iterations: u32) -> Option<Self> {
        Self::stepped(exact, size, length, iterations, false)
    }

    /// The same in bytes.
    pub fn published_in_bytes(exact: &Exact<f64>, size: u32, length: f64, iterations: u32) -> Option<Self> {
        Self::stepped(exact, size, length, iterations, true)
    }

    fn stepped(exact: &Exact<f64>, size: u32, length: f64, iterations: u32, bytes: bool) -> Option<Self> {
        if !is_scalar(exact) || !(2..=MOST_OF_ONE_LENGTH).contains(&size) || iterations == 0 {
            return None;
        }
        let count = (size as usize).pow(3);
        let texels = match bytes {
            false => Slabs::Float(Storage::zeroed(count)),
            true => Slabs::Bytes { texels: vec![[0; 4]; count], span: 1.0 },
        };
        let mut table = SecondOrder { size, length, iterations: Some(iterations), texels };
        table.rebuild(exact);
        Some(table)
    }

    /// This table of another function, in the memory that it has.
    pub fn rebuild(&mut self, exact: &Exact<f64>) {
        let Some(iterations) = self.iterations.filter(|_| is_scalar(exact)) else { return };
        let slices = Slices::new(exact, self.size, self.length, iterations);
        match &mut self.texels {
            Slabs::Float(texels) => slices.fill(texels),
            Slabs::Bytes { texels, span: of } => {
                *of = span(exact, self.length);
                slices.fill_bytes(texels, *of);
            }
        }
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
        Some(SecondOrder { size, length, iterations: None, texels: Slabs::Float(texels) })
    }

    /// Premultiplied colour and opacity of a slab of the table's length, as a linear filter of the texels finds them.
    pub fn look_up(&self, samples: [f64; 3]) -> [f64; 4] {
        filtered(|i| self.texels.get(i), self.size, samples)
    }

    /// What it is off by at most, in any channel, but for the rounding of bytes: of the order of a texel's width, and of
    /// that of a step, where the function is continuous.
    pub fn bound(&self, exact: &Exact<f64>) -> f64 {
        let step = self.iterations.map_or(0.0, |k| STEEPEST / 2.0 / f64::from(k) + Slices::rounding(self.size));
        bounds::premultiplied(exact, REACH * 2.0 / f64::from(self.size - 1) + step, self.length)
    }

    /// Bytes of its texels.
    pub fn bytes(&self) -> u64 {
        let each = if matches!(self.texels, Slabs::Float(_)) { 16 } else { 4 };
        each * u64::from(self.size).pow(3)
    }
}

impl SecondOrderLengths {
    /// Tables for `lengths` lengths, the last of which is `longest`, of parabolas that are integrated exactly. `None` as
    /// [`SecondOrder::new`], and for no length.
    pub fn new(exact: &Exact<f64>, size: u32, lengths: u32, longest: f64) -> Option<Self> {
        let table = |i: u32| SecondOrder::new(exact, size, longest * f64::from(i + 1) / f64::from(lengths));
        let tables: Option<Vec<_>> = (0..lengths).map(table).collect();
        tables.filter(|t| !t.is_empty()).map(|tables| SecondOrderLengths { tables })
    }

    /// Premultiplied colour and opacity of a slab, linear in the length between tables.
    pub fn look_up(&self, samples: [f64; 3], l: f64) -> [f64; 4] {
        let at = (l / self.tables[0].length).clamp(0.0, self.tables.len() as f64);
        let low = (at as usize).min(self.tables.len() - 1);
        let of = |i: usize| if i == 0 { [0.0; 4] } else { self.tables[i - 1].look_up(samples) };
        let (a, b, share) = (of(low), of(low + 1), at - low as f64);
        std::array::from_fn(|k| a[k] + (b[k] - a[k]) * share)
    }

    /// Bytes of its texels.
    pub fn bytes(&self) -> u64 {
        self.tables.iter().map(SecondOrder::bytes).sum()
    }
}

impl SecondOrderPolynomial {
    /// Integrates `exact` over slabs of up to `longest` normalised units, on the current rayon pool. `None` for fields of
    /// several components, fewer than 2 texels along an axis or more than [`MOST_OF_ALL_LENGTHS`], and degrees that are
    /// not 1 to 4.
    pub fn new(exact: &Exact<f64>, degree: u32, size: u32, longest: f64) -> Option<Self> {
        let mut table = Self::empty(exact, degree, size, longest)?;
        let inverse = inverse(degree as usize);
        let made: Vec<[[f32; 4]; 5]> = (0..(size as usize).pow(3))
            .into_par_iter()
            .map(|at| Self::texel(exact, &inverse, samples(at, size), longest))
            .collect();
        for (i, of) in table.texels.iter_mut().enumerate() {
            of.iter_mut().zip(&made).for_each(|(texel, made)| *texel = made[i]);
        }
        Some(table)
    }

    /// Coefficients of a texel of these samples; `inverse` makes them of points.
    pub(crate) fn texel(exact: &Exact<f64>, inverse: &[Vec<f64>], samples: [f64; 3], longest: f64) -> [[f32; 4]; 5] {
        let (parabola, degree) = (Cubic::parabola(samples), inverse.len() - 1);
        let (density, limit) = exact.means(&parabola);
        // The first is the limit for short slabs: the mean colour by its share of the extinction.
        let points: Vec<[f64; 3]> = (0..=degree)
            .map(|i| match i {
                0 => limit,
                _ => {
                    let l = longest * i as f64 / degree as f64;
                    let mut light = Light::none();
                    exact.add_cubic(&parabola, l, |_| true, &mut light);
                    let seen = reconstructed([1.0; 3], density, l, exact.direct)[0];
                    if seen > 0.0 { light.color.map(|c| c / seen) } else { limit }
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
    }

    /// The same table, to f32, in a fraction of the time (`parabolas.rs` says how).
    pub fn closed(exact: &Exact<f64>, degree: u32, size: u32, longest: f64) -> Option<Self> {
        let mut table = Self::empty(exact, degree, size, longest)?;
        table.rebuild(exact);
        Some(table)
    }

    /// This table of another function, in the memory that it has.
    pub fn rebuild(&mut self, exact: &Exact<f64>) {
        if is_scalar(exact) {
            self.direct = exact.direct;
            Parabolas::new(exact, self.degree, self.size, self.longest).fill(&mut self.texels);
        }
    }

    fn empty(exact: &Exact<f64>, degree: u32, size: u32, longest: f64) -> Option<Self> {
        if !is_scalar(exact) || !(2..=MOST_OF_ALL_LENGTHS).contains(&size) || !(1..=4).contains(&degree) {
            return None;
        }
        let count = (size as usize).pow(3);
        let texels = (0..=degree).map(|_| Storage::zeroed(count)).collect();
        Some(SecondOrderPolynomial { degree, size, longest, direct: exact.direct, texels })
    }

    /// Premultiplied colour and opacity of a slab, as a linear filter of the texels finds them.
    pub fn look_up(&self, samples: [f64; 3], l: f64) -> [f64; 4] {
        let sums: Vec<[f64; 4]> = self.texels.iter().map(|of| filtered(|i| of[i], self.size, samples)).collect();
        let x = l / self.longest;
        let color = [0, 1, 2].map(|k| sums.iter().rev().fold(0.0, |c, s| c * x + s[k]));
        reconstructed(color, sums[0][3], l, self.direct)
    }

    /// What it is off by at most, in any channel: of the order of a texel's width where the function is continuous, but for
    /// what polynomials are off by. `None` for direct emission.
    pub fn bound(&self, exact: &Exact<f64>) -> Option<f64> {
        bounds::normalised(exact, self.degree, REACH * 2.0 / f64::from(self.size - 1), self.longest)
    }

    /// Bytes of its texels as 32-bit floats.
    pub fn bytes(&self) -> u64 {
        16 * u64::from(self.size).pow(3) * u64::from(self.degree + 1)
    }
}
