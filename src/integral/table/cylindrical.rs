//! The table in sheared cylinder coordinates (Röttger & Ertl 2002, section 4).
//!
//! Where a projected cell is thin, l = 0 and s_f = s_b: all its fragments lie on a plane through the front diagonal of
//! the table. So planes around that diagonal are sampled, each a square of two parameters, and the two nearest are
//! interpolated. A place is told by (a, s, t) in [0, 1]³: which plane, how far from the diagonal, and where along it;
//! equation 9 maps it to (S_f, S_b, l), scalars in [0, 1] and l over the longest length, and equation 10 back. The
//! mapping bends at a = ¼, ½ and ¾, so planes are there; those at a = 0 and 1 have no length and so hold nothing: they
//! are one.

use super::{between, is_scalar, is_tabulated, light, published};
use crate::integral::{Exact, Light};
use rayon::prelude::*;

/// Colour and opacity on `planes` planes of `size` × `size` texels.
#[derive(Debug, Clone, PartialEq)]
pub struct Cylindrical {
    /// Planes around the diagonal, a multiple of 4: plane k is at a = k / planes.
    pub planes: u32,
    /// Texels along both axes of a plane; s varies fastest, then t, then the plane.
    pub size: u32,
    /// The longest length, in normalised units.
    pub longest: f64,
    /// Premultiplied colour and opacity; where S_f leaves [0, 1], of the function as it clamps.
    pub texels: Vec<[f32; 4]>,
}

impl Cylindrical {
    /// Integrates `exact` over segments of up to `longest` normalised units, on the current rayon pool. `None` for
    /// pairs, of which [`Exact::weights`] can be tabulated, sizes less than 2, and numbers of planes that are not multiples of 4.
    pub fn new(exact: &Exact<f64>, planes: u32, size: u32, longest: f64) -> Option<Self> {
        if !is_tabulated(exact) || planes == 0 || !planes.is_multiple_of(4) || size < 2 {
            return None;
        }
        let share = |i: u32, n: u32| f64::from(i) / f64::from(n - 1);
        let texel = |i: u32| {
            let a = f64::from(i / size / size) / f64::from(planes);
            let [front, back, l] = place(a, share(i % size, size), share(i / size % size, size));
            let [front, back] = [front, back].map(|s| 2.0 * s - 1.0);
            published(exact, front, back, l * longest).map(|c| c as f32)
        };
        let texels = (0..planes.checked_mul(size)?.checked_mul(size)?).into_par_iter().map(texel).collect();
        Some(Cylindrical { planes, size, longest, texels })
    }

    /// The same table in a time per texel that does not depend on the function. Along s, both the scalar in front and
    /// the length go on from where the texel before has them: each texel is that one behind a slab, in closed form.
    pub fn closed(exact: &Exact<f64>, planes: u32, size: u32, longest: f64) -> Option<Self> {
        if !is_tabulated(exact) || planes == 0 || !planes.is_multiple_of(4) || size < 2 {
            return None;
        }
        let (weights, share) = (!is_scalar(exact), |i: u32| f64::from(i) / f64::from(size - 1));
        let fill = |(at, row): (usize, &mut [[f32; 4]])| {
            let (a, t) = (f64::from(at as u32 / size) / f64::from(planes), share(at as u32 % size));
            let (mut front, mut length, mut sum) = (2.0 * t - 1.0, 0.0, Light::<f64>::none());
            for (i, texel) in (0..size).zip(row) {
                let [next, _, l] = place(a, share(i), t);
                let (next, l) = (2.0 * next - 1.0, l * longest);
                let slab = light(exact, next, front, l - length);
                sum = if weights { joined(&slab, &sum, (l - length) / l, exact.direct) } else { behind(slab, &sum) };
                (front, length) = (next, l);
                let [r, g, b] = sum.color;
                *texel = [r, g, b, 1.0 - sum.transmittance].map(|c| c as f32);
            }
        };
        let mut texels = vec![[0.0; 4]; planes.checked_mul(size)?.checked_mul(size)? as usize];
        texels.par_chunks_mut(size as usize).enumerate().for_each(fill);
        Some(Cylindrical { planes, size, longest, texels })
    }

    /// Premultiplied colour and opacity of a segment, as a linear filter finds them on the two nearest planes.
    pub fn look_up(&self, front: f64, back: f64, l: f64) -> [f64; 4] {
        let [a, s, t] = coordinates((front + 1.0) / 2.0, (back + 1.0) / 2.0, l / self.longest);
        let size = self.size as usize;
        let mut sum = [0.0; 4];
        for (plane, of_plane) in between(a, self.planes + 1) {
            let plane = plane % self.planes as usize;
            for (j, v) in between(t, self.size) {
                for (i, u) in between(s, self.size) {
                    let texel = self.texels[(plane * size + j) * size + i];
                    sum = std::array::from_fn(|k| sum[k] + of_plane * u * v * f64::from(texel[k]));
                }
            }
        }
        sum
    }

    /// Bytes of its texels as 32-bit floats.
    pub fn bytes(&self) -> u64 {
        size_of_val(&*self.texels) as u64
    }
}

/// `slab` and what is behind it.
fn behind(mut slab: Light<f64>, sum: &Light<f64>) -> Light<f64> {
    slab.add(sum.color, 1.0 - sum.transmittance);
    slab
}

/// The weights of the colours at the ends of both together, the slab being the `share` of the length that is in front.
fn joined(slab: &Light<f64>, sum: &Light<f64>, share: f64, direct: bool) -> Light<f64> {
    let share = if share.is_finite() { share } else { 0.0 };
    let whole = |of: &Light<f64>| if direct { of.color[0] + of.color[1] } else { 1.0 - of.transmittance };
    let back = share * slab.color[0] + slab.transmittance * (share * whole(sum) + (1.0 - share) * sum.color[0]);
    let front = share * slab.color[1] + (1.0 - share) * (whole(slab) + slab.transmittance * sum.color[1]);
    Light { color: [back, front, 0.0], transmittance: slab.transmittance * sum.transmittance }
}

/// Equation 9: (S_f, S_b, l) of (a, s, t).
pub(super) fn place(a: f64, s: f64, t: f64) -> [f64; 3] {
    match a {
        _ if a <= 0.25 => [t + s, t, 4.0 * a * s],
        _ if a <= 0.5 => [t + 4.0 * (0.5 - a) * s, t, s],
        _ if a <= 0.75 => [t - 4.0 * (a - 0.5) * s, t, s],
        _ => [t - s, t, 4.0 * (1.0 - a) * s],
    }
}

/// Equation 10: (a, s, t) of (S_f, S_b, l).
pub(super) fn coordinates(front: f64, back: f64, l: f64) -> [f64; 3] {
    let d = front - back;
    let [a, s] = match d {
        _ if d == 0.0 && l == 0.0 => [0.0, 0.0],
        _ if d >= 0.0 && l <= d => [0.25 * l / d, d],
        _ if d >= 0.0 => [0.5 - 0.25 * d / l, l],
        _ if l > -d => [0.5 - 0.25 * d / l, l],
        _ => [1.0 + 0.25 * l / d, -d],
    };
    [a, s, back]
}
