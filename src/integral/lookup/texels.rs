//! Texels: what they stand for, and what linear filters make of them.

use crate::integral::table::mix;

/// What texels between 0 and 1 stand for, channel by channel: so much, and so much more for each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Range {
    pub(crate) least: [f32; 4],
    pub(crate) span: [f32; 4],
}

impl Range {
    /// A texel in units of this.
    pub(crate) fn share(&self, texel: [f32; 4]) -> [f32; 4] {
        std::array::from_fn(|k| ((texel[k] - self.least[k]) / self.span[k]).clamp(0.0, 1.0))
    }

    pub(super) fn value(&self, share: [f32; 4]) -> [f32; 4] {
        std::array::from_fn(|k| share[k] * self.span[k] + self.least[k])
    }
}

pub(super) fn from_zero(greatest: [f32; 4]) -> Range {
    Range { least: [0.0; 4], span: greatest.map(|v| v.max(f32::MIN_POSITIVE)) }
}

pub(super) fn greatest(texels: &[[f32; 4]]) -> [f32; 4] {
    texels.iter().fold([f32::MIN_POSITIVE; 4], |m, t| std::array::from_fn(|k| m[k].max(t[k])))
}

/// The range of each channel.
pub(super) fn within(texels: &[[f32; 4]]) -> Range {
    let first = texels.first().copied().unwrap_or_default();
    let least = texels.iter().fold(first, |m, t| std::array::from_fn(|k| m[k].min(t[k])));
    let most = texels.iter().fold(first, |m, t| std::array::from_fn(|k| m[k].max(t[k])));
    Range { least, span: std::array::from_fn(|k| (most[k] - least[k]).max(f32::MIN_POSITIVE)) }
}

/// The first of the two texels of `n` that a place in [0, 1] is between, and the share of the second.
#[inline(always)]
pub(super) fn between(x: f32, n: u32) -> (usize, f32) {
    let at = x.clamp(0.0, 1.0) * (n - 1) as f32;
    let low = (at as u32).min(n - 2);
    (low as usize, at - low as f32)
}

#[inline(always)]
pub(super) fn bilinear(texels: &[[f32; 4]], width: u32, (i, u): (usize, f32), (j, v): (usize, f32)) -> [f32; 4] {
    let row = |j: usize| {
        let at = j * width as usize + i;
        mix(texels[at], texels[at + 1], u)
    };
    mix(row(j), row(j + 1), v)
}

#[inline(always)]
pub(super) fn trilinear(texel: impl Fn(usize) -> [f32; 4], n: u32, samples: [f32; 3]) -> [f32; 4] {
    let [(i, u), (j, v), (k, w)] = samples.map(|s| between(s * 0.5 + 0.5, n));
    let n = n as usize;
    let row = |j: usize, k: usize| {
        let at = (k * n + j) * n + i;
        mix(texel(at), texel(at + 1), u)
    };
    let layer = |k: usize| mix(row(j, k), row(j + 1, k), v);
    mix(layer(k), layer(k + 1), w)
}

/// The same parts, of which the first holds mean extinctions up to `most`, if that is known.
pub(super) fn with_density(
    mut parts: Vec<(Range, &mut [[f32; 4]])>,
    most: Option<f32>,
) -> Vec<(Range, &mut [[f32; 4]])> {
    if let (Some((range, _)), Some(most)) = (parts.first_mut(), most) {
        (range.least[3], range.span[3]) = (0.0, most);
    }
    parts
}
