//! How the field between samples along a ray is rebuilt: as it is, or as rectangles, lines and parabolas, which pre-integration
//! of order 0, 1 and 2 stands for (El Hajjar et al. 2008, section 3).
//!
//! A *slab* is what lies between a front and a back sample, with a third in the middle; the back sample of one is the front
//! of the next. So all orders take as many samples, and differ in what they make of them.

use crate::error::{Error, Result};
use crate::integral::cubic::Cubic;

/// What stands for the field between samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ReconstructionOrder {
    /// The field itself: a cubic in each voxel.
    #[default]
    Exact,
    /// The parabola through the three samples of a slab: A u² + B u + C with A = 2 s_f − 4 s_m + 2 s_b,
    /// B = −3 s_f + 4 s_m − s_b, C = s_f.
    Two,
    /// Lines from sample to sample.
    One,
    /// The middle sample all along the slab.
    Midpoint,
    /// Each sample up to the next.
    Left,
    /// Each sample back to the one before.
    Right,
}

impl ReconstructionOrder {
    /// All orders by the names that options have for them.
    pub const ALL: [(&'static str, ReconstructionOrder); 6] = [
        ("exact", ReconstructionOrder::Exact),
        ("2", ReconstructionOrder::Two),
        ("1", ReconstructionOrder::One),
        ("0", ReconstructionOrder::Midpoint),
        ("0-left", ReconstructionOrder::Left),
        ("0-right", ReconstructionOrder::Right),
    ];

    /// Parts of equal length that a slab has.
    pub(super) fn parts(self) -> usize {
        match self {
            ReconstructionOrder::Exact | ReconstructionOrder::Two | ReconstructionOrder::Midpoint => 1,
            ReconstructionOrder::One | ReconstructionOrder::Left | ReconstructionOrder::Right => 2,
        }
    }

    /// What stands for the field in a part of a slab with the samples `front`, `middle` and `back`.
    pub(super) fn part(self, part: usize, [front, middle, back]: [f64; 3]) -> Cubic {
        let [a, b] = if part == 0 { [front, middle] } else { [middle, back] };
        match self {
            ReconstructionOrder::Exact | ReconstructionOrder::Two => Cubic::parabola([front, middle, back]),
            ReconstructionOrder::One => Cubic([a, a + (b - a) / 3.0, b - (b - a) / 3.0, b]),
            ReconstructionOrder::Midpoint => Cubic::constant(middle),
            ReconstructionOrder::Left => Cubic::constant(a),
            ReconstructionOrder::Right => Cubic::constant(b),
        }
    }
}

/// Where samples are taken.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Sampling {
    /// Where the ray crosses a face of a voxel, and midway between: a slab is a voxel.
    #[default]
    Voxels,
    /// Each so many world units from where the ray enters the grid: a slab spans two steps, the last one is shortened.
    Steps(f64),
}

/// How the field of a grid is rebuilt along rays.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Reconstruction {
    /// What stands for it between samples.
    pub order: ReconstructionOrder,
    /// Where these are; of no account to [`ReconstructionOrder::Exact`].
    pub sampling: Sampling,
}

/// Steps along the diagonal of a grid.
const MOST_STEPS: f64 = 1e7;

impl Reconstruction {
    /// Refuses steps that are no lengths, or far too many for a grid of this diagonal.
    pub(crate) fn check(&self, diagonal: f64) -> Result<()> {
        match self.sampling {
            Sampling::Steps(step)
                if self.order != ReconstructionOrder::Exact && !(step * MOST_STEPS >= diagonal && step.is_finite()) =>
            {
                Err(Error::Render(format!(
                    "steps of {step} along rays: they are finite, and 1e-7 of the grid's diagonal {diagonal} at least"
                )))
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_pass_through_their_samples() {
        let samples = [0.3, -0.9, 2.0];
        let at = |order: ReconstructionOrder, u: f64| {
            let parts = order.parts() as f64;
            let part = ((u * parts) as usize).min(order.parts() - 1);
            order.part(part, samples).at(u * parts - part as f64)
        };
        for order in [ReconstructionOrder::One, ReconstructionOrder::Two] {
            for (u, s) in [0.0, 0.5, 1.0].into_iter().zip(samples) {
                assert!((at(order, u) - s).abs() < 1e-15, "{order:?}");
            }
        }
        let [f, m, b] = samples;
        let (x, y) = (2.0 * f - 4.0 * m + 2.0 * b, -3.0 * f + 4.0 * m - b);
        assert!((at(ReconstructionOrder::Two, 0.3) - (x * 0.09 + y * 0.3 + f)).abs() < 1e-15);
        assert!((at(ReconstructionOrder::One, 0.75) - f64::midpoint(m, b)).abs() < 1e-15);
        for (order, parts) in [
            (ReconstructionOrder::Midpoint, [m, m]),
            (ReconstructionOrder::Left, [f, m]),
            (ReconstructionOrder::Right, [m, b]),
        ] {
            for (u, s) in [0.2, 0.7].into_iter().zip(parts) {
                assert!((at(order, u) - s).abs() < 1e-15, "{order:?}");
            }
        }
    }
}
