//! The number types that the kernels are generic over.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A floating-point number: f32, as the engines compute, or f64, as the tests compare them with.
pub trait Real:
    Copy
    + Debug
    + PartialOrd
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + 'static
{
    /// The nearest number of this type; beyond its range, ±∞.
    fn of(x: f64) -> Self;
    /// eˣ for x ≤ 0.
    fn exp(self) -> Self;
    /// √x.
    fn sqrt(self) -> Self;
    /// The integer part of x, for 0 ≤ x < 2³².
    fn truncate(self) -> u32;
    /// Neither NaN nor infinite.
    fn is_finite(self) -> bool;

    /// The smaller of the two; `other` if either is NaN.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }

    /// The larger of the two; `other` if either is NaN.
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
}

impl Real for f64 {
    fn of(x: f64) -> Self {
        x
    }
    fn exp(self) -> Self {
        f64::exp(self)
    }
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    fn truncate(self) -> u32 {
        self as u32
    }
    fn is_finite(self) -> bool {
        f64::is_finite(self)
    }
}

impl Real for f32 {
    #[inline(always)]
    fn of(x: f64) -> Self {
        x as f32
    }
    #[inline(always)]
    fn exp(self) -> Self {
        exp(self)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f32::sqrt(self)
    }
    #[inline(always)]
    fn truncate(self) -> u32 {
        self as u32
    }
    #[inline(always)]
    fn is_finite(self) -> bool {
        f32::is_finite(self)
    }
}

/// eˣ for x ≤ 0 to 1.5 units in the last place; 0 below −87. Inlined and free of branches, unlike the C library's.
#[inline(always)]
#[allow(clippy::excessive_precision, reason = "ln 2 in two parts: the first is exact in f32")]
fn exp(x: f32) -> f32 {
    // x = k ln 2 + r with |r| ≤ ln 2 / 2; adding and subtracting 1.5·2²³ rounds to an integer.
    const ROUND: f32 = 12_582_912.0;
    let clamped = if x > -87.0 { x } else { -87.0 };
    let shifted = clamped * std::f32::consts::LOG2_E + ROUND;
    let k = shifted - ROUND;
    let r = (clamped - k * 0.693_359_375) - k * -2.121_944_4e-4;
    let p = 1.0
        + r * (1.0
            + r * (0.5
                + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * (1.0 / 120.0 + r * (1.0 / 720.0 + r * (1.0 / 5040.0)))))));
    let scale = f32::from_bits(shifted.to_bits().wrapping_sub(ROUND.to_bits()).wrapping_add(127) << 23);
    if x < -87.0 { 0.0 } else { p * scale }
}

#[cfg(test)]
mod tests {
    use super::Real;

    #[test]
    fn exp_is_accurate_to_its_last_place() {
        for i in 0..=870_000 {
            let x = -(i as f32) * 1e-4;
            let (got, want) = (f64::from(Real::exp(x)), f64::from(x).exp());
            assert!((got - want).abs() <= 1.8e-7 * want, "exp({x}) = {got}, not {want}");
        }
        assert_eq!(Real::exp(-1e30f32), 0.0);
        assert_eq!(Real::exp(f32::NEG_INFINITY), 0.0);
        assert_eq!(Real::exp(0f32), 1.0);
    }
}
