//! Segments against the reference's.

use super::*;
use crate::integral::options::Weights;
use crate::reference::segment_of_two;
use crate::transfer::bivariate::{OPEN, Sine, Wave};
use rayon::prelude::*;

/// Knuth's numbers.
struct Random(u64);

impl Random {
    fn within(&mut self, lo: f64, hi: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        lo + (hi - lo) * (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

fn segment(front: [f64; 2], back: [f64; 2], length: f64) -> Segment {
    Segment {
        at: front,
        rise: [back[0] - front[0], back[1] - front[1]],
        vector: DVec3::ZERO,
        turn: DVec3::ZERO,
        place: DVec3::ZERO,
        along: DVec3::Z,
        length,
    }
}

fn prepared(transfer: &TransferFunction, two: Two) -> Second {
    Second::new(transfer, [Normalization { mid: 0.0, half: 1.0 }; 2], DVec3::ZERO, 1.0, two)
}

/// As [`segment_of_two`], by what engines do, and in how many panels.
fn counted(transfer: &TransferFunction, method: Method, segment: &Segment) -> ([f64; 4], u64) {
    let (mut light, mut scratch) = (Gathered::<f32>::none(), Scratch::default());
    prepared(transfer, Two { method, ..Two::default() }).add(segment, &mut scratch, &mut light);
    let [r, g, b] = light.color.map(f64::from);
    ([r, g, b, 1.0 - f64::from(light.transmittance)], scratch.panels)
}

fn added(transfer: &TransferFunction, front: [f64; 2], back: [f64; 2], length: f64) -> [f64; 4] {
    counted(transfer, Method::Adaptive, &segment(front, back, length)).0
}

fn is_long() -> bool {
    std::env::var("HALITE_LONG").is_ok_and(|v| v == "1")
}

fn alone(widget: Widget) -> TransferFunction {
    TransferFunction::of_two(Bivariate::default().with_widgets(vec![widget]).unwrap(), 1.0).unwrap()
}

fn direct(transfer: TransferFunction) -> TransferFunction {
    transfer.with_emission(Emission::Direct { scale: 0.3 }).unwrap()
}

fn widgets(random: &mut Random) -> Vec<(&'static str, Widget)> {
    let period = 10_f64.powf(random.within(-1.5, 1.0));
    let wave = Wave {
        axis: [random.within(0.2, 1.0), random.within(-1.0, 1.0)],
        start: random.within(-1.0, 1.0),
        period,
        floor: 0.0,
    };
    let sigma = [0, 1].map(|_| 10_f64.powf(random.within(-2.0, 1.0)));
    let center = [0, 1].map(|_| random.within(-1.0, 1.0));
    let opacity = random.within(0.1, 0.99);
    let mut ends = || {
        let lo = random.within(-1.5, 0.5);
        [lo, lo + random.within(0.1, 2.0)]
    };
    let domain = [ends(), ends()];
    let color = [0.9, 0.5, 0.2];
    let widget = |shape, domain| Widget { shape, color, opacity, domain };
    vec![
        ("uniform", widget(Shape::Uniform, domain)),
        ("gaussian", widget(Shape::Gaussian { center, sigma }, OPEN)),
        ("gaussian in a box", widget(Shape::Gaussian { center, sigma }, domain)),
        ("triangle", widget(Shape::Triangle(wave), OPEN)),
        ("peaks", widget(Shape::Triangle(Wave { floor: 0.7, ..wave }), domain)),
        ("sine", widget(Shape::Sinusoid(wave, Sine::Abs), domain)),
        ("positive sine", widget(Shape::Sinusoid(wave, Sine::Positive), OPEN)),
        ("raised sine", widget(Shape::Sinusoid(wave, Sine::Raised), OPEN)),
    ]
}

/// Each widget alone, and two at once, in both conventions and emissions.
#[test]
fn segments_are_the_references() {
    let mut random = Random(5);
    let rounds = if is_long() { 3000 } else { 60 };
    let mut worst = (0.0, String::new());
    for i in 0..rounds {
        let all = widgets(&mut random);
        let mut ends = || [random.within(-2.0, 2.0), random.within(-2.0, 2.0)];
        let (front, back) = (ends(), ends());
        let (front, back) = match i % 6 {
            // One variable stands still, or both, or the segment is next to nothing.
            0 => (front, [front[0], back[1]]),
            1 => (front, front),
            2 => (front, [front[0] + 1e-9 * back[0], front[1] + 1e-9 * back[1]]),
            _ => (front, back),
        };
        let length = 10_f64.powf(random.within(-4.0, 1.5));
        for (k, (name, widget)) in all.iter().enumerate() {
            for (convention, emission) in [
                (Convention::Extinction, Emission::Chromatic),
                (Convention::Extinction, Emission::Direct { scale: 0.3 }),
                (Convention::Opacity, Emission::Chromatic),
                (Convention::Opacity, Emission::Direct { scale: 0.3 }),
            ] {
                let other = Widget { color: [0.1, 0.2, 1.0], ..all[(k + i) % all.len()].1.clone() };
                for list in [vec![widget.clone()], vec![widget.clone(), other]] {
                    let count = list.len();
                    let two = Bivariate::default().with_widgets(list).unwrap();
                    let transfer = TransferFunction::of_two(two, 1.0).unwrap().with_convention(convention);
                    let transfer = transfer.with_emission(emission).unwrap();
                    let (got, wanted) =
                        (added(&transfer, front, back, length), segment_of_two(&transfer, front, back, length));
                    let error = (0..4).map(|c| (got[c] - wanted[c]).abs()).fold(0.0, f64::max);
                    let what =
                        || format!("{name} of {count}, {convention:?}, {emission:?}: {front:?} to {back:?}, {length}");
                    assert!(got.iter().all(|x| x.is_finite()), "{}: {got:?}", what());
                    let most = wanted.iter().fold(1.0, |m: f64, x| m.max(*x));
                    let plain = (convention, emission) == (Convention::Extinction, Emission::Chromatic);
                    let bound = most * if plain { 2e-6 } else { 1e-5 };
                    assert!(error < bound, "{}: {got:?} is not {wanted:?}", what());
                    if error > worst.0 {
                        worst = (error, what());
                    }
                }
            }
        }
    }
    // A test that compares nothing with nothing would pass.
    assert!(worst.0 > 0.0);
}

/// Closed forms take no panels, whatever the frequency; and what nothing is seen of takes none either.
#[test]
fn single_widgets_take_no_panels() {
    let wave = Wave { axis: [1.0, 0.0], start: 0.0, period: 1e-3, floor: 0.0 };
    let far = Shape::Gaussian { center: [9.0, 9.0], sigma: [0.1, 0.1] };
    let count = |shapes: &[&Shape]| {
        let widget = |s: &&Shape| Widget { shape: (*s).clone(), color: [1.0; 3], opacity: 0.5, domain: OPEN };
        let two = Bivariate::default().with_widgets(shapes.iter().map(widget).collect()).unwrap();
        let transfer = TransferFunction::of_two(two, 1.0).unwrap();
        let ([.., opacity], panels) = counted(&transfer, Method::Adaptive, &segment([0.0; 2], [1.0; 2], 0.3));
        (panels, 1.0 - opacity)
    };
    let triangle = Shape::Triangle(wave);
    let (panels, through) = count(&[&triangle]);
    assert!(panels == 0 && (through - (-0.3 * 0.5 * 0.5_f64).exp()).abs() < 1e-7);
    assert_eq!(count(&[&triangle, &far]), (0, through));
    assert!(count(&[&triangle, &Shape::Uniform]).0 >= 2000, "a panel for each side of each wave");
}

/// Widgets alone by their closed forms, against quadrature: chromatic light to 1e-6 and direct light to 1e-5, of segments
/// from flat to steep, short to long and clear to opaque.
#[test]
fn closed_forms_are_quadrature() {
    let rounds: u64 = if is_long() { 62_500 } else { 625 };
    let worst = (0..rounds).into_par_iter().map(|i| {
        let mut random = Random(i.wrapping_mul(0x9e37_79b9_7f4a_7c15) + 1);
        let mut ends = || [random.within(-2.0, 2.0), random.within(-2.0, 2.0)];
        let (front, far) = (ends(), ends());
        // From standing still to all of the range.
        let share = if i % 8 == 0 { 0.0 } else { 10_f64.powf(random.within(-12.0, 0.0)) };
        let share = if i % 2 == 0 { share } else { 1.0 };
        let back = [0, 1].map(|k| front[k] + (far[k] - front[k]) * share);
        // No ray is longer in normalised units, and tails of Gaussians end by that.
        let length = 10_f64.powf(random.within(-8.0, 0.54));
        // Some are as good as opaque.
        let dense = if i % 3 == 0 { 10_f64.powf(random.within(0.0, 5.0)) } else { 1.0 };
        let all = widgets(&mut random);
        let mut worst = [0.0_f64; 2];
        for (name, widget) in all {
            let widget = Widget { opacity: widget.opacity * dense, ..widget };
            for (kind, (transfer, bound)) in
                [(alone(widget.clone()), 1e-6), (direct(alone(widget)), 1e-5)].into_iter().enumerate()
            {
                let (got, panels) = counted(&transfer, Method::Analytic, &segment(front, back, length));
                let wanted = segment_of_two(&transfer, front, back, length);
                let what = || format!("{name} {kind}: {front:?} to {back:?}, {length}");
                assert_eq!(panels, 0, "{}", what());
                let most = wanted.iter().fold(1.0, |m: f64, x| m.max(*x));
                let error = (0..4).map(|c| (got[c] - wanted[c]).abs()).fold(0.0, f64::max) / most;
                // NaN is no less than a bound.
                assert!(error <= bound, "{}: {got:?} is not {wanted:?}", what());
                worst[kind] = worst[kind].max(error);
            }
        }
        worst
    });
    let worst = worst.reduce(|| [0.0; 2], |a, b| [a[0].max(b[0]), a[1].max(b[1])]);
    assert!(worst.iter().all(|w| *w > 0.0), "something was compared");
}

/// Limits in which a formula divides by nothing or has no end: flat, steep, thin, thick, far and fast.
#[test]
fn limits_are_finite() {
    let tiny = [0.0, f64::MIN_POSITIVE, 1e-200, 1e-30, 1e-16, 1e-8, 1e-4];
    let huge = [1.0, 1e3, 1e8, 1e16];
    let mut random = Random(11);
    for (name, widget) in widgets(&mut random) {
        for opacity in [0.0, 1e-300, 0.5, 1e8, 1e30] {
            for rise in tiny.into_iter().chain(huge) {
                for length in tiny.into_iter().chain(huge) {
                    for rise in [[rise, 0.0], [0.0, -rise], [rise, -0.3 * rise]] {
                        let front = [0.3, -0.4];
                        let back = [front[0] + rise[0], front[1] + rise[1]];
                        let transfer = alone(Widget { opacity, ..widget.clone() });
                        for transfer in [direct(transfer.clone()), transfer] {
                            let (got, _) = counted(&transfer, Method::Analytic, &segment(front, back, length));
                            let most = 1.0 + 1e-6 + 0.3 * length;
                            let fits = got[3] <= 1.0 && got[..3].iter().all(|c| (0.0..=most).contains(c));
                            assert!(fits, "{name}, opacity {opacity}, rise {rise:?}, length {length}: {got:?}");
                        }
                    }
                }
            }
        }
    }
}

/// The three cases of their figure 4: a segment whose values are inside of a widget's box, outside, and across its side.
mod boxes {
    use super::*;

    const BOX: [[f64; 2]; 2] = [[-0.5, 0.7], [-0.4, 0.6]];

    /// Of each widget, as it is and within the box: panels, and the light of it in the box and of the open one.
    fn each(front: [f64; 2], back: [f64; 2], length: f64, mut check: impl FnMut(&str, [f64; 4], Widget, bool)) {
        for (name, widget) in widgets(&mut Random(3)) {
            let boxed = Widget { domain: BOX, ..widget.clone() };
            for is_direct in [false, true] {
                let of = |w: &Widget| if is_direct { direct(alone(w.clone())) } else { alone(w.clone()) };
                let (got, panels) = counted(&of(&boxed), Method::Analytic, &segment(front, back, length));
                assert_eq!(panels, 0, "{name}");
                let wanted = segment_of_two(&of(&boxed), front, back, length);
                assert!((0..4).all(|c| (got[c] - wanted[c]).abs() < 1e-6), "{name}: {got:?} is not {wanted:?}");
                check(name, got, Widget { domain: OPEN, ..widget.clone() }, is_direct);
            }
        }
    }

    fn open(widget: &Widget, is_direct: bool, front: [f64; 2], back: [f64; 2], length: f64) -> [f64; 4] {
        let transfer = if is_direct { direct(alone(widget.clone())) } else { alone(widget.clone()) };
        counted(&transfer, Method::Analytic, &segment(front, back, length)).0
    }

    #[test]
    fn inside_a_segment_is_what_it_is_without_a_box() {
        let (front, back, length) = ([-0.3, 0.5], [0.6, -0.2], 1.7);
        each(front, back, length, |name, got, widget, is_direct| {
            assert_eq!(got, open(&widget, is_direct, front, back, length), "{name}");
            assert!(got[3] > 1e-6, "{name} is seen");
        });
    }

    #[test]
    fn outside_there_is_nothing_also_where_the_ranges_overlap() {
        // The last passes the corner: either value is inside somewhere, never both.
        for (front, back) in [([0.8, 0.0], [1.9, 0.3]), ([0.0, 0.7], [0.1, 0.9]), ([0.4, 1.2], [1.3, 0.1])] {
            each(front, back, 1.7, |name, got, _, _| assert_eq!(got, [0.0; 4], "{name}"));
        }
    }

    #[test]
    fn across_a_side_it_is_cut_there() {
        // In by one side and out by another, at 1/4 and 3/4.
        let (front, back, length) = ([-0.8, 0.3], [0.4, -0.633_333_333_333_333_3], 2.2);
        let at = |u: f64| [0, 1].map(|k| front[k] + (back[k] - front[k]) * u);
        each(front, back, length, |name, got, widget, is_direct| {
            let part = open(&widget, is_direct, at(0.25), at(0.75), length / 2.0);
            assert!((0..4).all(|c| (got[c] - part[c]).abs() < 1e-6), "{name}: {got:?} is not {part:?}");
            assert!(got[3] > 1e-6, "{name} is seen");
        });
    }
}

/// The cost of one widget alone does not depend on its frequency, whatever it emits.
#[test]
fn frequencies_cost_nothing() {
    for shape in [Shape::Triangle, |w| Shape::Sinusoid(w, Sine::Abs), |w| Shape::Sinusoid(w, Sine::Positive)] {
        for floor in [0.0, 0.4] {
            let widget = |period| Widget {
                shape: shape(Wave { axis: [1.0, 0.5], start: 0.1, period, floor }),
                color: [1.0, 0.5, 0.2],
                opacity: 0.8,
                domain: OPEN,
            };
            let segment = segment([0.0; 2], [1.0; 2], 3.0);
            // As the mean of the wave, the more so the faster.
            let mean = |period| counted(&direct(alone(widget(period))), Method::Adaptive, &segment);
            let ((fast, none), (faster, still_none)) = (mean(1e-5), mean(1e-9));
            assert!(none == 0 && still_none == 0);
            assert!((0..4).all(|c| (fast[c] - faster[c]).abs() < 1e-4), "{fast:?} {faster:?}");
        }
    }
}

/// Equal pieces come near to the integral as they are more, in second order, by the closed form and by the texture as far
/// as that goes.
#[test]
fn segmented_pieces_converge() {
    let gaussian = Shape::Gaussian { center: [0.3, -0.2], sigma: [0.4, 0.6] };
    let sine = Wave { axis: [1.0, 0.3], start: 0.2, period: 1.7, floor: 0.0 };
    let widget = |shape, color| Widget { shape, color, opacity: 0.8, domain: OPEN };
    let two = vec![widget(gaussian, [0.9, 0.3, 0.1]), widget(Shape::Sinusoid(sine, Sine::Raised), [0.1, 0.4, 0.9])];
    let transfer = TransferFunction::of_two(Bivariate::default().with_widgets(two).unwrap(), 1.0).unwrap();
    let (front, back, length) = ([-0.7, 0.5], [1.2, -0.9], 2.0);
    for transfer in [direct(transfer.clone()), transfer] {
        let wanted = segment_of_two(&transfer, front, back, length);
        let error = |pieces, weights| {
            let second = prepared(&transfer, Two { method: Method::Segmented, pieces, weights, ..Two::default() });
            let (mut light, mut scratch) = (Gathered::<f32>::none(), Scratch::default());
            second.add(&segment(front, back, length), &mut scratch, &mut light);
            assert_eq!(scratch.panels, u64::from(pieces));
            let [r, g, b] = light.color.map(f64::from);
            let got = [r, g, b, 1.0 - f64::from(light.transmittance)];
            (0..4).map(|c| (got[c] - wanted[c]).abs()).fold(0.0, f64::max)
        };
        let [few, more, many] = [5, 10, 40].map(|n| error(n, Weights::Closed));
        assert!(few > 2.5 * more && more > 10.0 * many && many < 2e-4, "{few} {more} {many}");
        // Its texels are 0.03 of depth apart.
        let [texture, closed] = [Weights::Texture, Weights::Closed].map(|w| error(10, w));
        assert!((texture - closed).abs() < 2e-4, "{texture} {closed}");
    }
}
