//! The number types that the kernels are generic over.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// What arithmetic without decisions needs: a number, or several [`Lanes`] of them.
pub trait Arithmetic: Copy + Debug + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// The nearest number of this type; beyond its range, ±∞.
    fn of(x: f64) -> Self;
    /// eˣ for x ≤ 0.
    fn exp(self) -> Self;
}

/// A floating-point number: f32, as the engines compute, or f64, as the tests judge them.
pub trait Real: Arithmetic + PartialOrd + Send + Sync + Div<Output = Self> + Neg<Output = Self> + 'static {
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

impl Arithmetic for f64 {
    fn of(x: f64) -> Self {
        x
    }
    fn exp(self) -> Self {
        f64::exp(self)
    }
}

impl Real for f64 {
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

impl Arithmetic for f32 {
    #[inline(always)]
    fn of(x: f64) -> Self {
        x as f32
    }
    #[inline(always)]
    fn exp(self) -> Self {
        exp(self)
    }
}

impl Real for f32 {
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

/// `L` numbers that are computed side by side: the compiler makes vector instructions of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lanes<const L: usize>(pub [f32; L]);

macro_rules! lane_by_lane {
    ($($operator:ident $name:ident),*) => {$(
        impl<const L: usize> $operator for Lanes<L> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Lanes(std::array::from_fn(|i| self.0[i].$name(other.0[i])))
            }
        }
    )*};
}
lane_by_lane!(Add add, Sub sub, Mul mul);

impl<const L: usize> Arithmetic for Lanes<L> {
    #[inline(always)]
    fn of(x: f64) -> Self {
        Lanes([x as f32; L])
    }
    #[inline(always)]
    fn exp(self) -> Self {
        Lanes(std::array::from_fn(|i| exp(self.0[i])))
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
    let p = 1.0 + r * (1.0 + r * (0.5 + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * (1.0 / 120.0 + r * (1.0 / 720.0))))));
    let scale = f32::from_bits(shifted.to_bits().wrapping_sub(ROUND.to_bits()).wrapping_add(127) << 23);
    if x < -87.0 { 0.0 } else { p * scale }
}

#[cfg(test)]
mod tests {
    use super::Arithmetic;

    #[test]
    fn exp_is_accurate_to_its_last_place() {
        for i in 0..=870_000 {
            let x = -(i as f32) * 1e-4;
            let (got, want) = (f64::from(Arithmetic::exp(x)), f64::from(x).exp());
            assert!((got - want).abs() <= 1.8e-7 * want, "exp({x}) = {got}, not {want}");
        }
        assert_eq!(Arithmetic::exp(-1e30f32), 0.0);
        assert_eq!(Arithmetic::exp(f32::NEG_INFINITY), 0.0);
        assert_eq!(Arithmetic::exp(0f32), 1.0);
    }
}
