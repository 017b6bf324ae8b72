//! Which cells may be seen after an edit: those whose pairs of values may meet what is not empty.
//!
//! s and g are linear inside a tetrahedron, so its pairs fill the convex hull of those of its corners. A widget is met
//! where the hull meets its box, the ellipse outside of which a Gaussian's depth along the longest ray is below
//! [`super::TAIL`], and the phases at which its wave is not 0; a table where the hull's box has a texel that is not
//! clear. What is culled is within that bound for each Gaussian, and nothing else is lost.

use super::closed::{Profile, Turn};
use super::{Bounded, Ready, Second};
use crate::transfer::bivariate::{Shape, Sine, Table, Wave};

/// s and g at a tetrahedron's corners, in their own units.
pub(crate) type Pairs = [[f64; 2]; 4];

/// What of a function is not empty, as culling asks.
#[derive(Debug, Clone)]
pub(super) struct Solid {
    of: Of,
    /// Where the function h(g) is above 0; none where there is no such function.
    factor: Option<Vec<[f64; 2]>>,
}

#[derive(Debug, Clone)]
enum Of {
    /// Light is emitted whatever is absorbed.
    All,
    /// The intervals of s at which opacity is above 0.
    Scalar(Vec<[f64; 2]>),
    Widgets(Vec<Reach>),
    /// How many texels above 0 there are in columns and rows before each.
    Table(Table, Vec<u32>),
}

/// Where a widget may be seen.
#[derive(Debug, Clone)]
struct Reach {
    support: [[f64; 2]; 2],
    /// Of a Gaussian: its centre, and the half axes of its ellipse.
    ellipse: Option<[[f64; 2]; 2]>,
    /// Of a wave that is 0 somewhere else than at points: the phases, from 0 to 1, between which it is not.
    phases: Option<(Wave, [f64; 2])>,
}

/// Least and greatest of a number over corners.
fn range(of: impl Fn(usize) -> f64) -> [f64; 2] {
    (1..4).fold([of(0); 2], |[lo, hi], i| [lo.min(of(i)), hi.max(of(i))])
}

/// Whether two intervals have nothing in common; false where a number is none.
fn apart(a: [f64; 2], b: [f64; 2]) -> bool {
    a[1] < b[0] || a[0] > b[1]
}

/// The intervals between knots at which a function is above 0; the outer ones go on where it is clamped.
fn above_zero(knots: &[(f64, f64)], clamp: bool) -> Vec<[f64; 2]> {
    let mut all: Vec<[f64; 2]> = vec![];
    for pair in knots.windows(2).filter(|k| k[0].1 > 0.0 || k[1].1 > 0.0) {
        match all.last_mut() {
            Some(last) if last[1] == pair[0].0 => last[1] = pair[1].0,
            _ => all.push([pair[0].0, pair[1].0]),
        }
    }
    match knots {
        [(k, height)] if *height > 0.0 && !clamp => all.push([*k, *k]),
        [first, .., last] if clamp => {
            let ends = [(first.1, [f64::NEG_INFINITY, first.0]), (last.1, [last.0, f64::INFINITY])];
            all.extend(ends.into_iter().filter(|e| e.0 > 0.0).map(|e| e.1));
        }
        [(_, height)] if *height > 0.0 => all.push([f64::NEG_INFINITY, f64::INFINITY]),
        _ => {}
    }
    all
}

impl Reach {
    fn new(bounded: &Bounded, tails: bool) -> Self {
        let Bounded { widget, support, wave, reach } = bounded;
        // The support is the ellipse's box, where that is inside of the widget's.
        let ellipse = match (&widget.shape, reach) {
            (Shape::Gaussian { center, sigma }, Some(reach)) if tails => Some([*center, sigma.map(|s| s * reach)]),
            _ => None,
        };
        let phases = wave.as_ref().and_then(|(wave, profile)| Some((*wave, profile.seen()?)));
        Reach { support: *support, ellipse, phases: phases.filter(|_| tails) }
    }

    fn meets(&self, pairs: &Pairs) -> bool {
        if (0..2).any(|k| apart(range(|i| pairs[i][k]), self.support[k])) {
            return false;
        }
        if let Some((wave, [from, to])) = &self.phases {
            let [lo, hi] = range(|i| wave.phase(pairs[i]));
            // The first phase from `lo` on at which it may be seen.
            let begun = lo - lo.floor();
            let next = if begun <= *to { lo.max(lo.floor() + from) } else { lo.floor() + 1.0 + from };
            if next > hi {
                return false;
            }
        }
        let holds = |p: &[f64; 2]| (0..2).all(|k| p[k] >= self.support[k][0] && p[k] <= self.support[k][1]);
        match self.ellipse {
            Some(ellipse) => meets_ellipse(pairs, ellipse),
            None => pairs.iter().any(holds) || meets_box(pairs, self.support),
        }
    }
}

/// For each of the lines through two corners: their direction turned by a right angle, and where corners are along that.
fn across(pairs: &Pairs) -> impl Iterator<Item = ([f64; 2], [f64; 2])> {
    let ends = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
    ends.into_iter().map(|(i, j)| {
        let normal = [pairs[i][1] - pairs[j][1], pairs[j][0] - pairs[i][0]];
        (normal, range(|k| normal[0] * pairs[k][0] + normal[1] * pairs[k][1]))
    })
}

/// Whether the hull may meet a box, whose range it meets in both variables: no line through two corners is between.
fn meets_box(pairs: &Pairs, support: [[f64; 2]; 2]) -> bool {
    across(pairs).all(|(normal, hull)| {
        let side = |k: usize, end: usize| if normal[k] == 0.0 { 0.0 } else { normal[k] * support[k][end] };
        let of = |k: usize| [side(k, 0).min(side(k, 1)), side(k, 0).max(side(k, 1))];
        let ([a, b], [c, d]) = (of(0), of(1));
        // Rounding must not part what touches.
        let slack = 1e-12 * (hull[0].abs() + hull[1].abs());
        !apart([hull[0] - slack, hull[1] + slack], [a + c, b + d])
    })
}

/// Whether the hull may meet an ellipse.
fn meets_ellipse(pairs: &Pairs, [center, axes]: [[f64; 2]; 2]) -> bool {
    let around: Pairs = pairs.map(|p| [0, 1].map(|k| (p[k] - center[k]) / axes[k]));
    if around.iter().any(|p| p[0] * p[0] + p[1] * p[1] <= 1.0) {
        return true;
    }
    // And no line through a corner, at a right angle to the way there.
    let behind = |p: &[f64; 2]| {
        let far = p[0] * p[0] + p[1] * p[1];
        range(|k| p[0] * around[k][0] + p[1] * around[k][1])[0] >= far * (1.0 - 1e-12)
    };
    across(&around).all(|(n, hull)| {
        let length = (n[0] * n[0] + n[1] * n[1]).sqrt() * (1.0 + 1e-9);
        !apart(hull, [-length, length])
    }) && !around.iter().any(behind)
}

impl Profile {
    /// The phases, from 0 to 1, between which the wave is not 0; none where that is all but points.
    fn seen(&self) -> Option<[f64; 2]> {
        if self.floor > 0.0 {
            return Some(self.above);
        }
        (self.turn == Turn::Sine(Sine::Positive)).then_some([0.0, 0.5])
    }
}

impl Solid {
    pub(super) fn new(source: &Ready, factor: &[(f64, f64)], direct: bool) -> Self {
        let of = match source {
            Ready::Widgets(widgets) => Of::Widgets(widgets.iter().map(|w| Reach::new(w, !direct)).collect()),
            _ if direct => Of::All,
            Ready::Scalar { opacity, clamp, .. } => Of::Scalar(above_zero(opacity, *clamp)),
            Ready::Table(table) => {
                let [columns, rows] = table.size();
                let mut counts = vec![0; (columns + 1) * (rows + 1)];
                for j in 0..rows {
                    for i in 0..columns {
                        let at = |i: usize, j: usize| i + (columns + 1) * j;
                        let seen = u32::from(table.is_seen(i, j));
                        counts[at(i + 1, j + 1)] =
                            seen + counts[at(i, j + 1)] + counts[at(i + 1, j)] - counts[at(i, j)];
                    }
                }
                Of::Table(table.clone(), counts)
            }
        };
        let factor = (!factor.is_empty() && !direct).then(|| above_zero(factor, true));
        Solid { of, factor }
    }

    fn meets(&self, pairs: &Pairs) -> bool {
        let some = |all: &[[f64; 2]], k: usize| {
            let hull = range(|i| pairs[i][k]);
            all.iter().any(|&interval| !apart(hull, interval))
        };
        if self.factor.as_ref().is_some_and(|f| !some(f, 1)) {
            return false;
        }
        match &self.of {
            Of::All => true,
            Of::Scalar(intervals) => some(intervals, 0),
            Of::Widgets(all) => all.iter().any(|w| w.meets(pairs)),
            Of::Table(table, counts) => {
                let size = table.size();
                let places = pairs.map(|p| table.place(p));
                // Between two texels both count, outside the outer ones.
                let [[i, m], [j, n]] = [0, 1].map(|k| {
                    let [lo, hi] = range(|c| places[c][k]);
                    let last = size[k] as f64 - 1.0;
                    [lo.floor().clamp(0.0, last) as usize, hi.ceil().clamp(0.0, last) as usize + 1]
                });
                let at = |i: usize, j: usize| i64::from(counts[i + (size[0] + 1) * j]);
                at(m, n) - at(i, n) - at(m, j) + at(i, j) > 0
            }
        }
    }
}

impl Second {
    /// Whether a cell with these values at its corners may be seen; true where one is not finite.
    pub(crate) fn may_be_seen(&self, pairs: &Pairs) -> bool {
        !pairs.as_flattened().iter().all(|x| x.is_finite()) || self.solid.meets(pairs)
    }

    /// The test as published, of the corners alone (Song et al. 2009, §3.1): it misses what is between them.
    pub(crate) fn is_seen_at_a_corner(&self, pairs: &Pairs) -> bool {
        pairs.iter().any(|&p| self.solid.meets(&[p; 4]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Normalization;
    use crate::integral::options::Two;
    use crate::reference::segment_of_two;
    use crate::transfer::bivariate::{OPEN, Widget};
    use crate::transfer::{Bivariate, TransferFunction};
    use glam::DVec3;

    fn second(transfer: &TransferFunction) -> Second {
        Second::new(transfer, [Normalization { mid: 0.0, half: 1.0 }; 2], DVec3::ZERO, 1.0, Two::default())
    }

    fn functions() -> Vec<(&'static str, TransferFunction)> {
        let of = |shape: Shape, domain| {
            let widget = Widget { shape, color: [1.0; 3], opacity: 0.9, domain };
            TransferFunction::of_two(Bivariate::default().with_widgets(vec![widget]).unwrap(), 1.0).unwrap()
        };
        let wave = |floor| Wave { axis: [1.0, 0.7], start: 0.1, period: 2.3, floor };
        let boxed = [[-0.2, 0.4], [-0.5, 0.1]];
        let texels = (0..36).map(|i| [1.0, 1.0, 1.0, if i == 8 || i == 27 { 0.7 } else { 0.0 }]).collect();
        let table = Table::new([6, 6], texels, [[-1.0, 1.0]; 2]).unwrap();
        let knots = TransferFunction::new(
            vec![(0.0, [1.0; 3])],
            vec![(-0.9, 0.0), (-0.7, 0.5), (-0.6, 0.0), (0.2, 0.0), (0.3, 1.0), (0.4, 0.0)],
            1.0,
        );
        let h = |b: Bivariate| b.with_gradient_opacity(vec![(-0.4, 0.0), (0.0, 1.0), (0.3, 0.0)]).unwrap();
        vec![
            ("uniform", of(Shape::Uniform, boxed)),
            ("gaussian", of(Shape::Gaussian { center: [0.1, -0.3], sigma: [0.03, 0.08] }, OPEN)),
            ("boxed gaussian", of(Shape::Gaussian { center: [0.1, -0.3], sigma: [0.3, 0.8] }, boxed)),
            ("peaks", of(Shape::Triangle(wave(0.8)), OPEN)),
            ("positive", of(Shape::Sinusoid(Wave { period: 0.9, ..wave(0.0) }, Sine::Positive), OPEN)),
            ("positive peaks", of(Shape::Sinusoid(wave(0.9), Sine::Positive), OPEN)),
            ("table", TransferFunction::of_two(Bivariate::default().with_table(table), 1.0).unwrap()),
            ("h(g)", knots.unwrap().with_bivariate(h(Bivariate::default()))),
        ]
    }

    /// Of what is culled, no segment inside shows anything; some is culled, and corners alone miss some that is seen.
    #[test]
    fn what_is_culled_is_not_seen() {
        let mut seed = 3_u64;
        let mut random = move || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        for (name, transfer) in functions() {
            let second = second(&transfer);
            let (mut culled, mut missed) = (0, 0);
            for _ in 0..400 {
                let size = 0.1 + 0.8 * random();
                let middle = [0, 1].map(|_| 2.0 * random() - 1.0);
                let pairs: Pairs = std::array::from_fn(|_| [0, 1].map(|k| middle[k] + size * (random() - 0.5)));
                let mut inside = || {
                    let weights: [f64; 4] = std::array::from_fn(|_| -random().max(1e-300).ln());
                    let sum: f64 = weights.iter().sum();
                    [0, 1].map(|k| (0..4).map(|i| weights[i] / sum * pairs[i][k]).sum::<f64>())
                };
                let segments: Vec<_> = (0..12).map(|_| (inside(), inside())).collect();
                let seen = segments.iter().any(|(a, b)| segment_of_two(&transfer, *a, *b, 3.5)[3] > 2e-6);
                let kept = second.may_be_seen(&pairs);
                assert!(kept || !seen, "{name}: {pairs:?} is seen");
                culled += u32::from(!kept);
                missed += u32::from(seen && !second.is_seen_at_a_corner(&pairs));
                assert!(kept || !second.is_seen_at_a_corner(&pairs), "{name}: corners are of the hull");
            }
            assert!(culled > 20, "{name}: {culled} culled");
            assert!(missed > 0, "{name}: {missed} missed by corners");
        }
    }

    #[test]
    fn what_is_not_finite_and_what_shines_by_itself_stays() {
        for (name, transfer) in functions() {
            let mut pairs = [[50.4, 50.0]; 4];
            let direct = crate::transfer::Emission::Direct { scale: 1.0 };
            let (dark, shining) = (second(&transfer), second(&transfer.with_emission(direct).unwrap()));
            // Between the peaks of waves, and beyond everything else.
            assert!(!dark.may_be_seen(&pairs), "{name}");
            let has_a_box = name == "uniform" || name == "boxed gaussian";
            assert_eq!(shining.may_be_seen(&pairs), !has_a_box, "{name}");
            pairs[2][1] = f64::NAN;
            assert!(dark.may_be_seen(&pairs), "{name}");
        }
    }
}
