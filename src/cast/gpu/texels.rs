//! A grid's values as devices hold them: in the file's own type where f32 holds that, else as f32.

use crate::error::Result;
use crate::gpu::Gpu;
use crate::gpu::arrays::INVISIBLE;
use crate::gpu::buffers::Chunks;
use crate::integral::lines::Map;
use crate::mesh::{Values, with_values};

/// How values lie in the words of the array.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Texel {
    U8,
    I8,
    U16,
    I16,
    F32,
    /// As an f32 that a map made of it.
    Mapped,
}

impl Texel {
    /// That of `values`.
    pub(super) fn of(values: &Values) -> Self {
        match values {
            Values::U8(_) => Texel::U8,
            Values::I8(_) => Texel::I8,
            Values::U16(_) => Texel::U16,
            Values::I16(_) => Texel::I16,
            Values::F32(_) => Texel::F32,
            _ => Texel::Mapped,
        }
    }

    /// Whether the words hold the values themselves.
    pub(super) fn is_plain(self) -> bool {
        self != Texel::Mapped
    }

    /// The function `raw`, which looks value `i` up in `words`.
    pub(super) fn accessor(self) -> String {
        let body = match self {
            Texel::U8 => "f32(extractBits(words(i >> 2u), (i & 3u) * 8u, 8u))",
            Texel::I8 => "f32(extractBits(bitcast<i32>(words(i >> 2u)), (i & 3u) * 8u, 8u))",
            Texel::U16 => "f32(extractBits(words(i >> 1u), (i & 1u) * 16u, 16u))",
            Texel::I16 => "f32(extractBits(bitcast<i32>(words(i >> 1u)), (i & 1u) * 16u, 16u))",
            // What is not finite is told by its bits: compilers may take for granted that there is no such value.
            Texel::F32 | Texel::Mapped => {
                return format!(
                    "fn raw(i: u32) -> f32 {{\n    let w = words(i);\n    let is_finite = (w & 0x7f800000u) != \
                     0x7f800000u;\n    return select({INVISIBLE:?}f, bitcast<f32>(w), is_finite);\n}}\n"
                );
            }
        };
        format!("fn raw(i: u32) -> f32 {{\n    return {body};\n}}\n")
    }
}

/// Values of `components` in words of 32 bits; those that f32 does not hold as `maps` make them.
///
/// # Errors
/// Those of [`Chunks::new`].
pub(super) fn upload(gpu: &Gpu, values: &Values, components: usize, maps: &[Map; 4]) -> Result<Chunks> {
    let byte = |v: &[u8], i: usize| u32::from(v.get(i).copied().unwrap_or(0));
    let short = |v: &[u16], i: usize| u32::from(v.get(i).copied().unwrap_or(0));
    match values {
        Values::U8(v) => bytes(gpu, v, byte),
        Values::I8(v) => bytes(gpu, bytemuck::cast_slice(v), byte),
        Values::U16(v) => shorts(gpu, v, short),
        Values::I16(v) => shorts(gpu, bytemuck::cast_slice(v), short),
        Values::F32(v) => Chunks::new(gpu, "words", v, |v| v.to_bits()),
        other => with_values!(other, v => Chunks::generated(gpu, "words", v.len(), |i| {
            #[allow(clippy::unnecessary_cast, clippy::cast_lossless, reason = "one cast for ten types")]
            let value = maps[i % components].apply(v[i] as f64);
            if value.is_finite() { value.clamp(-1e30, 1e30) as f32 } else { INVISIBLE }
        })),
    }
}

fn bytes(gpu: &Gpu, v: &[u8], at: impl Fn(&[u8], usize) -> u32) -> Result<Chunks> {
    let word = |w: usize| (0..4).fold(0, |word, k| word | at(v, 4 * w + k) << (8 * k));
    Chunks::generated(gpu, "words", v.len().div_ceil(4), word)
}

fn shorts(gpu: &Gpu, v: &[u16], at: impl Fn(&[u16], usize) -> u32) -> Result<Chunks> {
    Chunks::generated(gpu, "words", v.len().div_ceil(2), |w| at(v, 2 * w) | at(v, 2 * w + 1) << 16)
}
