//! How a field's values become 32-bit floats: by an affine map that keeps apart what the transfer function tells apart.
//!
//! An f32 is off by up to 2⁻²⁴ of its distance from 0. So what a map must keep apart may lie anywhere, if only that is near
//! the map's middle which is close together: between outliers, or among knots of very different distances. The map is
//! therefore chosen by the function's knots, not by the values.

use super::{Field, Kind};
use crate::transfer::TransferFunction;

/// An affine map of a field's values: `(s − mid) / half`, computed in f64 so that nothing is lost in a field like
/// 1e9 ± 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Normalization {
    /// What becomes 0.
    pub mid: f64,
    /// What is this far above that becomes 1. Positive.
    pub half: f64,
}

/// The greatest normalised value: what is farther from 0 is taken to be here. No function tells values apart there, and a
/// segment that reaches so far passes all knots in its first 1e-12.
pub(crate) const MOST: f64 = (1u64 << 40) as f64;

/// The greatest normalised component of a colour.
pub(crate) const MOST_COLOUR: f64 = 1e30;

/// How far a value may be off, of the distance of two knots that it is between or of a step to the values around it.
const SHARP: f64 = 2e-5;

/// By how much another map must be better to be worth handing all values over again.
const BETTER: f64 = 4.0;

/// What an f32 may be off, relative to itself.
const ROUNDING: f64 = 1.0 / (1u64 << 24) as f64;

/// Of ±1, how much a map leaves to knots that move apart in edits, where no table is asked for, which has few texels.
const ROOM: f64 = 2.0;

impl Normalization {
    /// The map of `[lo, hi]` to [−1, 1].
    pub fn new(lo: f64, hi: f64) -> Self {
        let (mid, half) = (lo / 2.0 + hi / 2.0, hi / 2.0 - lo / 2.0);
        Normalization { mid, half: if half > 0.0 { half } else { mid.abs().max(1.0) } }
    }

    /// `(s − mid) / half`.
    pub fn apply(self, s: f64) -> f64 {
        (s - self.mid) / self.half
    }

    /// `mid + half · s`.
    pub fn invert(self, s: f64) -> f64 {
        self.mid + self.half * s
    }

    /// As [`Self::apply`], in f32 and within ±`most`; not finite if `s` is not.
    pub(crate) fn bounded(self, s: f64, most: f64) -> f32 {
        if s.is_finite() { self.apply(s).clamp(-most, most) as f32 } else { f32::NAN }
    }
}

/// What the values of one component must be told apart by.
#[derive(Debug, Clone, Default)]
struct Resolution {
    /// Places from and to which values may be off by some share of a distance, and this distance.
    needs: Vec<[f64; 3]>,
}

impl Resolution {
    /// Those of functions with knots at these places, ascending, and steps at those that come twice, of a component with
    /// values in `range`, of which `sample` are some. Unless the functions `clamp`, they step at their ends, too.
    fn new(functions: &[Vec<f64>], clamp: bool, [lo, hi]: [f64; 2], sample: &[f64]) -> Self {
        let mut needs = vec![];
        for places in functions {
            for w in places.windows(2).filter(|w| w[0] < w[1] && w[0] <= hi && w[1] >= lo) {
                needs.push([w[0].max(lo), w[1].min(hi), w[1] - w[0]]);
            }
            let steps = places.windows(2).filter(|w| w[0] == w[1]).map(|w| w[0]);
            let ends = [places.first(), places.last()].into_iter().flatten().filter(|_| !clamp).copied();
            for k in steps.chain(ends).filter(|k| (lo..=hi).contains(k)) {
                if let Some(near) = nearness(sample, k) {
                    needs.push([k, k, near]);
                }
            }
        }
        Resolution { needs }
    }

    /// How far values may be off at most, of the distances that they must be told apart by, if `mid` becomes 0.
    fn blur(&self, mid: f64) -> f64 {
        let blur = |&[from, to, apart]: &[f64; 3]| (from - mid).abs().max((to - mid).abs()) / apart;
        self.needs.iter().map(blur).fold(0.0, f64::max) * ROUNDING
    }

    /// The outermost of all places.
    fn hull(&self) -> [f64; 2] {
        self.needs.iter().fold([f64::MAX, f64::MIN], |[lo, hi], n| [lo.min(n[0]), hi.max(n[1])])
    }

    /// The map that blurs least, and maps all places to ±1/`room`.
    fn best(&self, room: f64) -> Normalization {
        let [lo, hi] = self.hull();
        // `blur` is the greatest of convex functions, so it has one valley.
        let (mut a, mut b) = (lo, hi);
        for _ in 0..400 {
            let third = b / 3.0 - a / 3.0;
            let (p, q) = (a + third, b - third);
            if !(a < p && p < q && q < b) {
                break;
            }
            if self.blur(p) <= self.blur(q) {
                b = q;
            } else {
                a = p;
            }
        }
        let ends = self.needs.iter().flat_map(|n| [n[0], n[1]]);
        // A place itself, if one is as good: what is there is then told exactly.
        let middle = ends
            .filter(|s| (a..=b).contains(s))
            .fold(a / 2.0 + b / 2.0, |best, s| if self.blur(s) <= self.blur(best) { s } else { best });
        let half = (hi - middle).max(middle - lo);
        Normalization { mid: middle, half: if half > 0.0 { half * room } else { 1.0 } }
    }

    /// Whether all places are within ±1 under `normal`.
    fn fit(&self, normal: Normalization) -> bool {
        let [lo, hi] = self.hull();
        self.needs.is_empty() || (normal.apply(lo) >= -1.0 && normal.apply(hi) <= 1.0)
    }
}

/// How near to `place` the nearest quarter of a sample of different values is; none if no value is elsewhere.
fn nearness(sample: &[f64], place: f64) -> Option<f64> {
    let mut distances: Vec<f64> = sample.iter().map(|s| (s - place).abs()).filter(|d| *d > 0.0).collect();
    if distances.is_empty() {
        return None;
    }
    let quarter = distances.len() / 4;
    Some(*distances.select_nth_unstable_by(quarter, f64::total_cmp).1)
}

/// Chooses how the values of a field are mapped for transfer functions, one after another.
#[derive(Debug, Clone)]
pub(crate) struct Chooser {
    kind: Kind,
    range: [[f64; 2]; 4],
    /// Of each component that a function is asked of, some different values, ascending.
    samples: [Vec<f64>; 4],
    normal: [Normalization; 4],
    /// The knots that were last found to be too close.
    close: Option<[f64; 2]>,
}

impl Chooser {
    /// At first, components are mapped as [`Field::normal`] says.
    pub(crate) fn new(field: &Field) -> Self {
        let components = [0, 1, 2, 3];
        let own = |k: usize| k < field.kind().components() && (field.kind() != Kind::Rgba || k == 3);
        Chooser {
            kind: field.kind(),
            range: components.map(|k| field.range(k)),
            samples: components.map(|k| if own(k) { field.sample(k) } else { vec![] }),
            normal: components.map(|k| field.normal(k)),
            close: None,
        }
    }

    /// How components are mapped now.
    pub(crate) fn normal(&self) -> &[Normalization; 4] {
        &self.normal
    }

    /// Chooses other maps if the values under the present ones are not told apart well enough for `transfer`, or not
    /// all that it tells is within ±1; with less room to spare where `tables` may be read. True if one has changed.
    pub(crate) fn choose(&mut self, transfer: &TransferFunction, tables: bool) -> bool {
        let color: Vec<f64> = transfer.color().iter().map(|k| k.0).collect();
        let opacity: Vec<f64> = transfer.opacity().iter().map(|k| k.0).collect();
        let functions = match self.kind {
            Kind::Scalar => vec![(0, vec![color, opacity])],
            Kind::Pair => vec![(0, vec![color]), (1, vec![opacity])],
            Kind::Rgba => vec![(3, vec![opacity])],
        };
        let mut changed = false;
        for (k, functions) in functions {
            let needs = Resolution::new(&functions, transfer.clamp(), self.range[k], &self.samples[k]);
            let (now, fits) = (needs.blur(self.normal[k].mid), needs.fit(self.normal[k]));
            if fits && now <= SHARP {
                continue;
            }
            let best = needs.best(if tables { 1.0 } else { ROOM });
            if !fits || needs.blur(best.mid) * BETTER < now {
                changed |= self.normal[k] != best;
                self.normal[k] = best;
            }
        }
        changed
    }

    /// Says, once for the same two, which knots of the opacity function are closer than values can be told apart.
    pub(crate) fn warn(&mut self, transfer: &TransferFunction) {
        let last = self.kind.components() - 1;
        let close = too_close(transfer.opacity(), self.normal[last], self.range[last]);
        if let Some([a, b]) = close.filter(|_| self.close != close) {
            let [lo, hi] = self.range[last];
            tracing::warn!(
                "the knots of the opacity function at {a} and {b} are too close to each other for 32-bit floats, as values are \
                 from {lo} to {hi} and other knots are far away; between the two the picture may be wrong"
            );
        }
        self.close = close;
    }
}

/// Two neighbouring knots within `range` that are closer than values there can be told apart, if the function turns there:
/// what only rises or falls between them is as good as a step.
fn too_close(knots: &[(f64, f64)], normal: Normalization, [lo, hi]: [f64; 2]) -> Option<[f64; 2]> {
    (1..knots.len()).find_map(|i| {
        let [(s0, _), (s1, _)] = [knots[i - 1], knots[i]];
        let off = (s0 - normal.mid).abs().max((s1 - normal.mid).abs()) * ROUNDING;
        let unclear = s0 < s1 && s0 <= hi && s1 >= lo && off > (s1 - s0) / 8.0;
        let around = &knots[knots.partition_point(|k| k.0 < s0).saturating_sub(1)
            ..(knots.partition_point(|k| k.0 <= s1) + 1).min(knots.len())];
        let turns = !around.windows(2).all(|w| w[0].1 <= w[1].1) && !around.windows(2).all(|w| w[0].1 >= w[1].1);
        (unclear && turns).then_some([s0, s1])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn needs(places: &[f64]) -> Resolution {
        Resolution::new(&[places.to_vec()], true, [-1e30, 1e30], &[0.0, 0.25, 0.5, 0.75, 1.0])
    }

    #[test]
    fn a_map_is_for_what_is_close_together() {
        let even = needs(&[0.0, 1.0, 2.0, 3.0]).best(1.0);
        assert!((even.mid - 1.5).abs() < 1e-6 && (even.half - 1.5).abs() < 1e-6, "{even:?}");
        let peak = needs(&[-2.0, 0.1, 0.1 + 1e-9, 0.1 + 2e-9, 2.0]);
        let best = peak.best(1.0);
        assert!((best.mid - 0.1).abs() < 1e-7 && peak.fit(best) && peak.blur(best.mid) < 1e-6, "{best:?}");
        let far = needs(&[0.0, 0.25, 0.5, 1e6]);
        assert!(far.blur(far.best(1.0).mid) < 1e-7 && far.blur(Normalization::new(0.0, 1e6).mid) > 1e-2);
        // A step says where it is, and is told from the values around it.
        let step = needs(&[0.4, 0.4]);
        assert_eq!(step.best(1.0), Normalization { mid: 0.4, half: 1.0 });
        assert!(step.blur(-1e9) > 1.0);
        // Nothing to tell.
        assert_eq!(needs(&[0.4]).blur(1e30), 0.0);
    }

    #[test]
    fn only_what_turns_is_too_close() {
        let normal = Normalization::new(0.0, 1.0);
        let of = |knots: &[(f64, f64)]| too_close(knots, normal, [0.0, 1.0]);
        assert_eq!(of(&[(0.0, 0.0), (0.9, 0.0), (0.9 + 1e-9, 1.0), (1.0, 1.0)]), None);
        let peak = [(0.0, 0.0), (0.9, 0.0), (0.9 + 1e-9, 1.0), (0.9 + 2e-9, 0.0), (1.0, 0.0)];
        assert_eq!(of(&peak), Some([0.9, 0.9 + 1e-9]));
        assert_eq!(too_close(&peak, normal, [0.0, 0.5]), None);
        assert_eq!(too_close(&peak, Normalization { mid: 0.9, half: 1.0 }, [0.0, 1.0]), None);
    }

    #[test]
    fn what_is_finite_stays_so() {
        let normal = Normalization::new(-1.0, 1.0);
        for s in [1e38, -1e38, f64::MAX, f64::MIN] {
            assert_eq!(normal.bounded(s, MOST), (MOST * s.signum()) as f32);
        }
        for s in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(!normal.bounded(s, MOST).is_finite());
        }
        assert_eq!(Normalization::new(f64::MIN, f64::MAX).bounded(f64::MAX, MOST), 1.0);
    }

    proptest! {
        #[test]
        fn no_knot_is_a_better_middle(
            mut places in prop::collection::vec((-30..30i32, -1.0..1.0f64).prop_map(|(e, m)| m * f64::from(e).exp2()), 2..30),
        ) {
            places.sort_by(f64::total_cmp);
            let needs = needs(&places);
            let best = needs.best(1.0);
            prop_assert!(needs.fit(best));
            for &s in &places {
                prop_assert!(needs.blur(best.mid) <= needs.blur(s) * 1.001 + 1e-30, "{best:?}, {s}");
            }
        }
    }
}
