//! Second-order tables: of slabs along which the scalar is a parabola through three samples.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use halite::field::{Kind, Normal};
use halite::integral::table::{SecondOrder, SecondOrderPolynomial, parabola};
use halite::integral::{Exact, Light};
use halite::transfer::{Emission, TransferFunction};

fn exact(step: bool, direct: bool) -> Exact<f64> {
    let color = vec![(-1.0, [1.0, 0.0, 0.5]), (0.3, [0.2, 0.9, 0.1]), (1.0, [0.0, 0.4, 1.0])];
    let mut opacity = vec![(-0.5, 0.0), (0.1, 0.8), (0.6, 0.1), (1.2, 0.5)];
    if step {
        opacity.insert(2, (0.1, 0.2));
    }
    let transfer = TransferFunction::new(color, opacity, 0.5).unwrap();
    let emission = if direct { Emission::Direct { scale: 1.0 } } else { Emission::Chromatic };
    let transfer = transfer.with_emission(emission).unwrap();
    Exact::new(&transfer, Kind::Scalar, &[Normal { mid: 0.0, half: 1.0 }; 4], 1.0)
}

/// By many segments of the straight lines between points of the parabola.
fn marched(exact: &Exact<f64>, [f, m, b]: [f64; 3], l: f64) -> [f64; 4] {
    let n = 4000;
    let at = |i: u32| {
        let u = f64::from(i) / f64::from(n);
        ((2.0 * f - 4.0 * m + 2.0 * b) * u - 3.0 * f + 4.0 * m - b) * u + f
    };
    let mut light = Light::none();
    (0..n).for_each(|i| exact.add(&[at(i)], &[at(i + 1)], l / f64::from(n), &mut light));
    let [r, g, b] = light.color;
    [r, g, b, 1.0 - light.through]
}

fn triples(count: u32) -> impl Iterator<Item = [f64; 3]> {
    // Additive sequences (Roberts 2018).
    let steps = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3];
    (0..count).map(move |i| steps.map(|s| 2.0 * (0.5 + s * f64::from(i)).fract() - 1.0))
}

fn worst(count: u32, off: impl Fn([f64; 3]) -> [[f64; 4]; 2]) -> f64 {
    let error = |s| {
        let [a, b] = off(s);
        (0..4).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max)
    };
    triples(count).map(error).fold(0.0, f64::max)
}

#[test]
fn parabolas_are_what_many_lines_are() {
    for (step, direct) in [(false, false), (true, false), (false, true)] {
        let exact = exact(step, direct);
        for l in [0.01, 0.7, 4.0] {
            let off = worst(60, |s| [parabola(&exact, s, l), marched(&exact, s, l)]);
            assert!(off < 2e-6, "{step} {direct} {l}: {off:.1e}");
        }
    }
}

/// Texels hold the parabolas of their samples: as published the nearer the more steps are taken, on the diagonal too.
#[test]
fn published_tables_converge() {
    let exact = exact(false, false);
    let (n, l) = (9, 0.8);
    let truth = SecondOrder::new(&exact, n, l).unwrap();
    let off = |k: u32| {
        let table = SecondOrder::published(&exact, n, l, k).unwrap();
        let pairs = table.texels.as_flattened().iter().zip(truth.texels.as_flattened());
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    };
    let [few, some, many] = [8, 64, 256].map(off);
    assert!(some < few / 4.0 && many < 1e-3, "{few:.1e} {some:.1e} {many:.1e}");
    for s in [-1.0, -0.25, 0.5, 1.0] {
        let (got, want) = (truth.look_up([s; 3]), parabola(&exact, [s; 3], l));
        assert!((0..4).all(|k| (got[k] - want[k]).abs() < 1e-6), "{s}: {got:?}, not {want:?}");
    }
    let bytes = worst(200, |s| [truth.rounded(8).look_up(s), truth.look_up(s)]);
    assert!(bytes > 1e-4 && bytes <= 0.5 / 255.0 + 1e-6, "{bytes:.1e}");
}

/// For every length, with the errors that the size says.
#[test]
fn one_table_serves_all_lengths() {
    for direct in [false, true] {
        let exact = exact(false, direct);
        let longest = 1.5;
        let table = |n: u32| SecondOrderPolynomial::new(&exact, 2, n, longest).unwrap();
        let tables = [table(9), table(17), table(33)];
        let off = |t: &SecondOrderPolynomial| {
            [1.0, 0.5, 0.1, 1e-3].map(|share| {
                let l = longest * share;
                worst(300, |s| [t.look_up(s, l), parabola(&exact, s, l)])
            })
        };
        let errors = tables.each_ref().map(off);
        for (coarse, fine) in errors[0].iter().zip(&errors[2]) {
            assert!(fine * 2.0 < *coarse, "{direct}: {errors:?}");
        }
        for t in &tables {
            let alpha =
                worst(300, |s| [t.look_up(s, longest), parabola(&exact, s, longest)].map(|[.., a]| [0.0, 0.0, 0.0, a]));
            assert!(alpha <= t.bound(&exact), "{alpha:.1e} is above {:.1e}", t.bound(&exact));
        }
        // Of the order of a texel's width, as optical depth.
        let depth = tables.each_ref().map(|t| -(1.0 - t.bound(&exact)).ln());
        assert!(depth[2] < 0.26 * depth[0], "{depth:?}");
    }
    // Where texels are, opacity is exact at any length.
    let exact = exact(true, false);
    let t = SecondOrderPolynomial::new(&exact, 1, 5, 2.0).unwrap();
    for l in [1e-3, 0.3, 1.1, 2.0] {
        let off = [[-1.0, 0.5, 1.0], [0.0, 0.0, 0.0], [1.0, 1.0, -0.5]]
            .map(|s| (t.look_up(s, l)[3] - parabola(&exact, s, l)[3]).abs());
        assert!(off.iter().all(|e| *e < 1e-6), "{l}: {off:?}");
    }
}

#[test]
fn there_are_no_tables_of_nonsense() {
    let exact = exact(false, false);
    assert!(SecondOrder::published(&exact, 1, 1.0, 8).is_none());
    assert!(SecondOrder::published(&exact, 4, 1.0, 0).is_none());
    assert!(SecondOrderPolynomial::new(&exact, 0, 4, 1.0).is_none());
    assert!(SecondOrderPolynomial::new(&exact, 2, 129, 1.0).is_none());
}
