//! How places in [0, 1] lie on a range of scalars: evenly, or evenly in their logarithms.

use crate::error::{Error, Result};

/// Pieces between two knots on a logarithmic axis, at most.
const MOST_PIECES: f64 = 1024.0;

/// A range of scalars, and what is even on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    range: [f64; 2],
    logarithmic: bool,
}

/// What functions on an axis have as values.
pub trait Value: Copy {
    /// The value at the share `u` of the way from this one to `to`.
    fn mix(self, to: Self, u: f64) -> Self;
    /// The largest difference of a component.
    fn distance(self, to: Self) -> f64;
}

impl Value for f64 {
    fn mix(self, to: Self, u: f64) -> Self {
        self + (to - self) * u
    }

    fn distance(self, to: Self) -> f64 {
        (to - self).abs()
    }
}

impl Value for [f64; 3] {
    fn mix(self, to: Self, u: f64) -> Self {
        std::array::from_fn(|k| self[k].mix(to[k], u))
    }

    fn distance(self, to: Self) -> f64 {
        (0..3).map(|k| self[k].distance(to[k])).fold(0.0, f64::max)
    }
}

impl Axis {
    /// Scalars evenly from `range[0]` to `range[1]`.
    pub fn linear(range: [f64; 2]) -> Self {
        Axis { range, logarithmic: false }
    }

    /// Logarithms of scalars evenly from that of `range[0]` to that of `range[1]`.
    ///
    /// # Errors
    /// [`Error::Transfer`] if the range does not ascend or holds numbers that have no logarithm.
    pub fn logarithmic(range: [f64; 2]) -> Result<Self> {
        let [lo, hi] = range;
        if lo > 0.0 && lo < hi && hi.is_finite() {
            return Ok(Axis { range, logarithmic: true });
        }
        Err(Error::Transfer(format!(
            "there is no logarithmic scale from {lo} to {hi}: both ends are above 0 and ascend"
        )))
    }

    /// The range of scalars.
    pub fn range(&self) -> [f64; 2] {
        self.range
    }

    /// True if logarithms are even.
    pub fn is_logarithmic(&self) -> bool {
        self.logarithmic
    }

    /// The scalar at a place; 0 is the start of the range, 1 its end.
    pub fn scalar(&self, place: f64) -> f64 {
        let [lo, hi] = self.range;
        match (self.logarithmic, place) {
            (_, 0.0) => lo,
            (_, 1.0) => hi,
            (true, u) => (lo.ln() + (hi.ln() - lo.ln()) * u).exp(),
            (false, u) => lo + (hi - lo) * u,
        }
    }

    /// The place of a scalar. On a logarithmic axis scalars that have no logarithm are at its start.
    pub fn place(&self, scalar: f64) -> f64 {
        let [lo, hi] = self.range;
        match self.logarithmic {
            true if scalar > 0.0 => (scalar.ln() - lo.ln()) / (hi.ln() - lo.ln()),
            true => 0.0,
            false => (scalar - lo) / (hi - lo),
        }
    }

    /// Knots in scalars of a function that is linear between `knots` in places. On a logarithmic axis there are more of
    /// them, so that it is missed by at most `tolerance`.
    ///
    /// A line between scalars whose logarithms are r apart misses their logarithm's by r/8 of its own rise at most; so m
    /// even pieces of an interval of logarithms L and rise v miss it by v L / (8 m²).
    pub fn knots<T: Value>(&self, knots: &[(f64, T)], tolerance: f64) -> Vec<(f64, T)> {
        let mut out: Vec<(f64, T)> = Vec::with_capacity(knots.len());
        for (i, &(place, value)) in knots.iter().enumerate() {
            if self.logarithmic && i > 0 {
                let (from, first) = knots[i - 1];
                let (length, rise) = ((self.range[1] / self.range[0]).ln() * (place - from), first.distance(value));
                let pieces = (rise * length / (8.0 * tolerance.max(f64::MIN_POSITIVE)))
                    .max(0.0)
                    .sqrt()
                    .ceil()
                    .clamp(1.0, MOST_PIECES) as u32;
                for k in 1..pieces {
                    let u = f64::from(k) / f64::from(pieces);
                    out.push((self.scalar(from + (place - from) * u), first.mix(value, u)));
                }
            }
            out.push((self.scalar(place), value));
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transfer::TransferFunction;

    #[test]
    fn places_and_scalars() {
        let even = Axis::linear([-2.0, 6.0]);
        assert_eq!((even.scalar(0.25), even.place(0.0), even.scalar(1.0)), (0.0, 0.25, 6.0));
        let log = Axis::logarithmic([1e-3, 1e3]).unwrap();
        assert!((log.scalar(0.5) - 1.0).abs() < 1e-12 && (log.place(10.0) - 4.0 / 6.0).abs() < 1e-12);
        assert_eq!((log.scalar(0.0), log.scalar(1.0), log.place(-5.0)), (1e-3, 1e3, 0.0));
        for range in [[0.0, 1.0], [-1.0, 1.0], [2.0, 1.0], [1.0, f64::INFINITY], [f64::NAN, 1.0]] {
            assert!(Axis::logarithmic(range).unwrap_err().to_string().contains("logarithmic"));
        }
    }

    /// A function of the logarithm, as the knots have it, within the tolerance everywhere.
    #[test]
    fn logarithms_are_met() {
        for (range, tolerance) in [([1e-6, 1.0], 1e-3), ([0.5, 2.0], 1e-4), ([3.0, 4e9], 4e-3)] {
            let axis = Axis::logarithmic(range).unwrap();
            let places = [(0.0, 0.1), (0.3, 1.0), (0.3, 0.2), (1.0, 0.7)];
            let knots = axis.knots(&places, tolerance);
            assert!(knots.len() < 200, "{}", knots.len());
            let f = TransferFunction::new(vec![(0.0, [1.0; 3])], knots, 1.0).unwrap();
            let even = TransferFunction::new(vec![(0.0, [1.0; 3])], places.to_vec(), 1.0).unwrap();
            for i in 0..2000 {
                let u = f64::from(i) / 2000.0 + 1e-9;
                let (got, wanted) = (f.opacity_at(axis.scalar(u)), even.opacity_at(u));
                assert!((got - wanted).abs() <= 1.1 * tolerance, "{range:?} at {u}: {got} is not {wanted}");
            }
        }
        assert_eq!(Axis::linear([0.0, 2.0]).knots(&[(0.0, 1.0), (1.0, 0.0)], 1e-3), [(0.0, 1.0), (2.0, 0.0)]);
    }
}
