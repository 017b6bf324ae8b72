//! Values at the corners of voxels, as they are in memory: pairs along x, as the bits that lanes take them from.

use super::walk::LANES;
use crate::integral::lines::Map;

/// Steps that eight rays take before what they pass is looked at.
pub(super) const STEPS: usize = 16;

/// A type of values: two of them as the bits of two f32, or, if it is an integer that f32 holds, of two i32.
pub(super) trait Texel: Copy {
    /// Whether the bits are integers'.
    const INTEGER: bool = false;
    /// Whether the bits are the values themselves, not yet mapped.
    const PLAIN: bool = true;
    /// The bits of one.
    fn bits(self, map: &Map) -> u32;
}

macro_rules! texel {
    ($($type:ty: $integer:literal, $plain:literal, $v:ident, $map:ident => $bits:expr;)*) => {
        $(impl Texel for $type {
            const INTEGER: bool = $integer;
            const PLAIN: bool = $plain;
            #[inline(always)]
            #[allow(clippy::cast_lossless, clippy::unnecessary_cast, unused_variables, reason = "one form for ten types")]
            fn bits(self, $map: &Map) -> u32 {
                let $v = self;
                $bits
            }
        })*
    };
}

texel! {
    i8: true, true, v, map => v as i32 as u32;
    u8: true, true, v, map => v as u32;
    i16: true, true, v, map => v as i32 as u32;
    u16: true, true, v, map => v as u32;
    f32: false, true, v, map => v.to_bits();
    i32: false, false, v, map => mapped(v as f64, map);
    u32: false, false, v, map => mapped(v as f64, map);
    i64: false, false, v, map => mapped(v as f64, map);
    u64: false, false, v, map => mapped(v as f64, map);
    f64: false, false, v, map => mapped(v, map);
}

#[inline(always)]
fn mapped(v: f64, map: &Map) -> u32 {
    (((v - map.mid) * map.factor) as f32).to_bits()
}

/// The pairs of the voxels of a chunk's steps: by step, by row of the voxel (y fastest), by ray.
pub(super) type Pairs = [[[u64; LANES]; 4]; STEPS];

/// Fetches the values at the corners of the voxels whose first corners have these indices; `rows` are how far the four rows
/// of a voxel are behind that. What would be beyond the array, which a ray may leave a rounding before its end, gets the
/// length 0.
#[inline(never)]
pub(super) fn fetch<T: Texel>(
    values: &[T],
    first: &[[u32; LANES]],
    rows: [usize; 4],
    map: &Map,
    pairs: &mut Pairs,
    lengths: &mut [[f32; LANES]; STEPS],
) {
    // Rows of one length: so one comparison does for all four.
    let length = values.len().saturating_sub(rows[3]);
    let row = |r: usize| values.get(rows[r]..).and_then(|row| row.get(..length)).unwrap_or_default();
    let (v0, v1, v2, v3) = (row(0), row(1), row(2), row(3));
    // All that is far in memory is asked for at once.
    let mut asked = 0;
    for first in first {
        for at in [first[0] as usize, first[LANES - 1] as usize] {
            if let (Some(a), Some(b), Some(c), Some(d)) = (v0.get(at), v1.get(at), v2.get(at), v3.get(at)) {
                asked ^= a.bits(map) ^ b.bits(map) ^ c.bits(map) ^ d.bits(map);
            }
        }
    }
    std::hint::black_box(asked);
    for ((first, [p0, p1, p2, p3]), lengths) in first.iter().zip(pairs).zip(lengths) {
        for l in 0..LANES {
            let at = first[l] as usize;
            let ends = at..at + 2;
            let (a, b, c, d) = (v0.get(ends.clone()), v1.get(ends.clone()), v2.get(ends.clone()), v3.get(ends));
            if let (Some([a, i]), Some([b, j]), Some([c, k]), Some([d, m])) = (a, b, c, d) {
                (p0[l], p1[l], p2[l], p3[l]) =
                    (pair(*a, *i, map), pair(*b, *j, map), pair(*c, *k, map), pair(*d, *m, map));
            } else {
                lengths[l] = 0.0;
            }
        }
    }
}

#[inline(always)]
fn pair<T: Texel>(a: T, b: T, map: &Map) -> u64 {
    u64::from(a.bits(map)) | u64::from(b.bits(map)) << 32
}

/// The same of values in voxels: all corners have the voxel's.
#[inline(never)]
pub(super) fn fetch_cells<T: Texel>(
    values: &[T],
    first: &[[u32; LANES]],
    map: &Map,
    pairs: &mut Pairs,
    lengths: &mut [[f32; LANES]; STEPS],
) {
    for ((first, pairs), lengths) in first.iter().zip(pairs).zip(lengths) {
        for l in 0..LANES {
            if let Some(v) = values.get(first[l] as usize) {
                let bits = u64::from(v.bits(map));
                pairs.iter_mut().for_each(|row| row[l] = bits | bits << 32);
            } else {
                lengths[l] = 0.0;
            }
        }
    }
}
