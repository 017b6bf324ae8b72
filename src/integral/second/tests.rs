//! Segments against the reference's.

use super::*;
use crate::reference::segment_of_two;
use crate::transfer::bivariate::{OPEN, Sine, Wave};

/// Blackman & Vigna's numbers would do as well; these are Knuth's.
struct Random(u64);

impl Random {
    fn within(&mut self, lo: f64, hi: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        lo + (hi - lo) * (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// As [`segment_of_two`], by what engines do.
fn added(transfer: &TransferFunction, front: [f64; 2], back: [f64; 2], length: f64) -> [f64; 4] {
    let normal = Normal { mid: 0.0, half: 1.0 };
    let second = Second::new(transfer, [normal; 2], DVec3::ZERO, 1.0);
    let segment = Segment {
        at: front,
        rise: [back[0] - front[0], back[1] - front[1]],
        vector: DVec3::ZERO,
        turn: DVec3::ZERO,
        place: DVec3::ZERO,
        along: DVec3::Z,
        length,
    };
    let mut light = Gathered::<f32>::none();
    second.add(&segment, &mut Scratch::default(), &mut light);
    let [r, g, b] = light.color.map(f64::from);
    [r, g, b, 1.0 - f64::from(light.through)]
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
    let rounds = if std::env::var("HALITE_LONG").is_ok_and(|v| v == "1") { 3000 } else { 60 };
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
        let second = Second::new(&transfer, [Normal { mid: 0.0, half: 1.0 }; 2], DVec3::ZERO, 1.0);
        let (mut scratch, mut light) = (Scratch::default(), Gathered::none());
        let segment = Segment {
            at: [0.0; 2],
            rise: [1.0; 2],
            vector: DVec3::ZERO,
            turn: DVec3::ZERO,
            place: DVec3::ZERO,
            along: DVec3::Z,
            length: 0.3,
        };
        second.add(&segment, &mut scratch, &mut light);
        (scratch.panels, light.through)
    };
    let triangle = Shape::Triangle(wave);
    let (panels, through) = count(&[&triangle]);
    assert!(panels == 0 && (f64::from(through) - (-0.3 * 0.5 * 0.5_f64).exp()).abs() < 1e-7);
    assert_eq!(count(&[&triangle, &far]), (0, through));
    assert!(count(&[&triangle, &Shape::Uniform]).0 >= 2000, "a panel for each side of each wave");
}
