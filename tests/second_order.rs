//! Second-order tables: of slabs along which the scalar is a parabola through three samples.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use halite::field::{Kind, Normalization};
use halite::integral::table::{SecondOrder, SecondOrderLengths, SecondOrderPolynomial, parabola};
use halite::integral::{Exact, Light};
use halite::transfer::{Emission, TransferFunction};

fn exact(step: bool, direct: bool) -> Exact<f64> {
    exact_of(step, direct, 0.5)
}

fn exact_of(step: bool, direct: bool, unit_distance: f64) -> Exact<f64> {
    let color = vec![(-1.0, [1.0, 0.0, 0.5]), (0.3, [0.2, 0.9, 0.1]), (1.0, [0.0, 0.4, 1.0])];
    let mut opacity = vec![(-0.5, 0.0), (0.1, 0.8), (0.6, 0.1), (1.2, 0.5)];
    if step {
        opacity.insert(2, (0.1, 0.2));
    }
    let transfer = TransferFunction::new(color, opacity, unit_distance).unwrap();
    let emission = if direct { Emission::Direct { scale: 1.0 } } else { Emission::Chromatic };
    let transfer = transfer.with_emission(emission).unwrap();
    Exact::new(&transfer, Kind::Scalar, &[Normalization { mid: 0.0, half: 1.0 }; 4], 1.0)
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
    [r, g, b, 1.0 - light.transmittance]
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
    let apart = |a: &SecondOrder, b: &SecondOrder| {
        let texels = (0..(n as usize).pow(3)).flat_map(|i| a.texels.get(i).into_iter().zip(b.texels.get(i)));
        texels.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    };
    let off = |k: u32| {
        let table = SecondOrder::published(&exact, n, l, k).unwrap();
        let (off, bound) = (worst(300, |s| [table.look_up(s), parabola(&exact, s, l)]), table.bound(&exact));
        assert!(off <= bound, "{k} steps: {off:.1e} is above {bound:.1e}");
        apart(&table, &truth)
    };
    let [few, some, many] = [8, 64, 256].map(off);
    let bounds = [8, 64, 256].map(|k| SecondOrder::published(&exact, 257, 0.1, k).unwrap().bound(&exact));
    assert!(bounds[2] < bounds[1] && bounds[1] < bounds[0] && bounds[2] < 0.1, "{bounds:?}");
    assert!(some < few / 4.0 && many < 1e-3, "{few:.1e} {some:.1e} {many:.1e}");
    for s in [-1.0, -0.25, 0.5, 1.0] {
        let (got, want) = (truth.look_up([s; 3]), parabola(&exact, [s; 3], l));
        assert!((0..4).all(|k| (got[k] - want[k]).abs() < 1e-6), "{s}: {got:?}, not {want:?}");
    }
    let [float, bytes] =
        [SecondOrder::published, SecondOrder::published_in_bytes].map(|t| t(&exact, n, l, 64).unwrap());
    let off = apart(&float, &bytes);
    assert!(off > 1e-4 && off <= 0.5 / 255.0 + 1e-6, "{off:.1e}");
    assert_eq!(bytes.bytes() * 4, float.bytes());
    // What it is rebuilt to is what it would be at first.
    let mut other = SecondOrder::published(&self::exact(true, true), n, l, 64).unwrap();
    assert_ne!(other, float);
    other.rebuild(&exact);
    assert_eq!(other, float);
}

/// Rows of texels that are no multiple of eight are whole, and colours beyond 1 fit into bytes.
#[test]
fn rows_and_bytes_have_room() {
    let exact = exact(true, true);
    for n in [2, 7, 12] {
        let table = SecondOrder::published_in_bytes(&exact, n, 3.0, 64).unwrap();
        let want = SecondOrder::new(&exact, n, 3.0).unwrap();
        let most = (0..(n as usize).pow(3)).flat_map(|i| want.texels.get(i)).fold(0.0, f32::max);
        assert!(n == 2 || most > 1.1, "{most}");
        // A step of the function that a parabola touches is met a step too early or late.
        let off = worst(300, |s| [table.look_up(s), want.look_up(s)]);
        assert!(off < 0.03, "{n}: {off:.1e}");
    }
}

/// Closed forms give what adaptive ones do: with steps, opaque functions, direct emission, and functions that count from
/// what is far.
#[test]
fn closed_forms_are_what_integrals_are() {
    let random = |seed: u64| {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1u64 << 53) as f64
        }
    };
    for seed in 0..24 {
        let mut next = random(seed + 1);
        let count = 2 + (next() * 15.0) as usize;
        let mut places: Vec<f64> = (0..count).map(|_| next() * 2.4 - 1.2).collect();
        places.sort_by(f64::total_cmp);
        // Steps, and knots at texels.
        if seed % 3 == 0 {
            (places[1], places[0]) = (0.25, 0.25);
            places.sort_by(f64::total_cmp);
        }
        let most = [0.3, 4.0, 1.0][seed as usize % 3];
        let opacity: Vec<(f64, f64)> =
            places.iter().map(|s| (*s, if next() < 0.3 { 0.0 } else { next() * most })).collect();
        let color = vec![(-1.0, [next(), next(), next()]), (0.2, [next(), next(), next()]), (0.9, [next(), 0.0, 1.0])];
        let transfer = TransferFunction::new(color, opacity, [1.0, 0.02][seed as usize % 2]).unwrap();
        let direct = seed % 4 == 3;
        let transfer = match direct {
            true => transfer.with_emission(Emission::Direct { scale: 0.7 }).unwrap(),
            false => transfer.with_clamp(seed % 5 != 0),
        };
        let exact = Exact::new(&transfer, Kind::Scalar, &[Normalization { mid: 0.0, half: 1.0 }; 4], 1.0);
        for degree in [1, 2, 4] {
            let (longest, n) = (1.3, 9);
            let want = SecondOrderPolynomial::new(&exact, degree, n, longest).unwrap();
            let got = SecondOrderPolynomial::closed(&exact, degree, n, longest).unwrap();
            let mut worst = [0.0f64; 2];
            for (i, (a, b)) in want.texels[0].iter().zip(got.texels[0].iter()).enumerate() {
                let off = f64::from((a[3] - b[3]).abs() / a[3].max(1.0));
                assert!(off < 2e-7, "{seed}, texel {i}: a mean extinction of {}, not {}", b[3], a[3]);
            }
            for at in 0..n.pow(3) {
                let s = [at % n, at / n % n, at / (n * n)].map(|i| f64::from(i) / 4.0 - 1.0);
                for (k, share) in [1.0, 0.5, 1e-3].into_iter().enumerate() {
                    let (a, b) = (want.look_up(s, longest * share), got.look_up(s, longest * share));
                    let off = (0..4).map(|c| (a[c] - b[c]).abs()).fold(0.0, f64::max);
                    worst[k.min(1)] = worst[k.min(1)].max(off);
                }
            }
            // A slab has up to some thirty pieces, each of which is as good as 1e-6 of its light.
            assert!(worst.iter().all(|e| *e < 4e-5), "{seed}, degree {degree}: {worst:?}");
        }
    }
}

/// The published table of four parameters, of as many lengths as there is room for.
#[test]
fn several_lengths_are_one_table() {
    let exact = exact(false, false);
    let table = SecondOrderLengths::new(&exact, 9, 4, 1.2).unwrap();
    for (s, l) in [([-0.5, 0.25, 1.0], 0.3), ([1.0, 0.0, -1.0], 1.2), ([0.5; 3], 0.9), ([0.0, 0.75, 0.25], 0.0)] {
        let (got, want) = (table.look_up(s, l), parabola(&exact, s, l));
        assert!((0..4).all(|k| (got[k] - want[k]).abs() < 1e-6), "{s:?} {l}: {got:?}, not {want:?}");
    }
    assert_eq!(table.bytes(), 4 * 9 * 9 * 9 * 16);
    assert!(SecondOrderLengths::new(&exact, 9, 0, 1.0).is_none());
}

/// For every length, with the errors that the size says.
#[test]
fn one_table_serves_all_lengths() {
    for direct in [false, true] {
        let exact = exact(false, direct);
        let longest = 1.5;
        let table = |n: u32| SecondOrderPolynomial::closed(&exact, 2, n, longest).unwrap();
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
        let bounds = tables.each_ref().map(|t| t.bound(&exact));
        if direct {
            assert_eq!(bounds, [None; 3]);
            continue;
        }
        for (t, bound) in tables.iter().zip(bounds.map(Option::unwrap)) {
            let off = worst(300, |s| [t.look_up(s, longest), parabola(&exact, s, longest)]);
            assert!(off <= bound, "{off:.1e} is above {bound:.1e}");
        }
    }
    // Of the order of a texel's width.
    let thin = exact_of(false, false, 100.0);
    let bounds =
        [9, 17, 33, 65].map(|n| SecondOrderPolynomial::closed(&thin, 2, n, 1.0).unwrap().bound(&thin).unwrap());
    assert!(bounds.windows(2).all(|w| w[1] < 0.6 * w[0]), "{bounds:?}");
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
    assert!(SecondOrder::published(&exact, 407, 1.0, 8).is_none());
    assert!(SecondOrderPolynomial::new(&exact, 0, 4, 1.0).is_none());
    assert!(SecondOrderPolynomial::new(&exact, 2, 129, 1.0).is_none());
}
