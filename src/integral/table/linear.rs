//! What the separated table was compared with (Guthe et al. 2002, figure 3): a table of two parameters, for the longest
//! segments, in which colour and opacity of shorter ones are proportional to the length.

use super::grid::Grid;
use super::{between, closed, is_scalar, value};
use crate::integral::Exact;

/// Premultiplied colour and opacity of the longest segments, for `size` × `size` values in front and behind.
#[derive(Debug, Clone, PartialEq)]
pub struct Linear {
    /// Texels along both axes; the value in front varies fastest.
    pub size: u32,
    /// The length of the segments, in normalised units.
    pub longest: f64,
    /// Premultiplied colour and opacity.
    pub texels: Vec<[f32; 4]>,
}

impl Linear {
    /// Integrates `exact` over segments of `longest` normalised units, in f64. `None` for fields of several components
    /// and sizes less than 2.
    pub fn new(exact: &Exact<f64>, size: u32, longest: f64) -> Option<Self> {
        let texel = |at: u32| {
            super::published(exact, value(at % size, size), value(at / size, size), longest).map(|c| c as f32)
        };
        (is_scalar(exact) && size >= 2).then(|| Linear { size, longest, texels: (0..size * size).map(texel).collect() })
    }

    /// The same table, to f32, in a time per texel that does not depend on the function.
    pub fn closed(exact: &Exact<f64>, size: u32, longest: f64) -> Option<Self> {
        if size < 3 {
            return Self::new(exact, size, longest);
        }
        is_scalar(exact).then(|| Linear { size, longest, texels: closed::slice(&Grid::new(exact, size), longest) })
    }

    /// Premultiplied colour and opacity of a segment, as a linear filter of the texels finds them.
    pub fn look_up(&self, front: f64, back: f64, l: f64) -> [f64; 4] {
        let [f, b] = [front, back].map(|s| between((s + 1.0) / 2.0, self.size));
        let mut sum = [0.0; 4];
        for ((i, u), (j, v)) in b.into_iter().flat_map(|(j, v)| f.map(|i| (i, (j, v)))) {
            let texel = self.texels[j * self.size as usize + i];
            sum = std::array::from_fn(|k| sum[k] + u * v * f64::from(texel[k]));
        }
        sum.map(|c| c * l / self.longest)
    }

    /// Bytes of its texels as 32-bit floats.
    pub fn bytes(&self) -> u64 {
        size_of_val(&*self.texels) as u64
    }
}
