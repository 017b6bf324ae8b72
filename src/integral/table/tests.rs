#![allow(clippy::unwrap_used, reason = "tests")]

mod weights;

use super::cylindrical::{coordinates, place};
use super::*;
use crate::field::Normalization;
use crate::transfer::{Convention, Emission, TransferFunction};
use rayon::prelude::*;

fn exact(opacity: &[(f64, f64)], emission: Emission) -> Exact<f64> {
    let color = vec![(-1.0, [1.0, 0.2, 0.0]), (0.3, [0.0, 0.5, 0.9]), (1.0, [0.4, 0.4, 0.4])];
    let transfer = TransferFunction::new(color, opacity.to_vec(), 1.0).unwrap().with_emission(emission).unwrap();
    Exact::new(&transfer, field::Kind::Scalar, &[Normalization { mid: 0.0, half: 1.0 }; 4], 1.0)
}

#[test]
fn slices_are_where_equation_1_puts_them() {
    for kind in [Kind::Log, Kind::LogNormalised, Kind::Uniform] {
        for n in [4, 16] {
            for k in 0..n {
                let at = coordinate(kind, n, 3.0, length(kind, n, 3.0, k)) * f64::from(n) - 0.5;
                assert!((at - f64::from(k)).abs() < 1e-12, "{kind:?}: slice {k} of {n} is at {at}");
            }
        }
    }
    // Linear up to Δl: figure 6.
    let [half, one] = [0.5, 1.0].map(|x| coordinate(Kind::Log, 8, 64.0, x) * 8.0 - 0.5);
    assert!((half - 0.5).abs() < 1e-12 && (one - 1.0).abs() < 1e-12);
}

#[test]
fn texels_hold_the_exact_integral() {
    let ramp = [(-1.0, 0.0), (0.0, 0.0), (0.2, 3.0), (1.0, 0.5)];
    for emission in [Emission::Chromatic, Emission::Direct { scale: 0.7 }] {
        let exact = exact(&ramp, emission);
        for kind in [Kind::Log, Kind::LogNormalised, Kind::Uniform] {
            let table = Table::new(&exact, kind, [17, 17, 9], 2.0).unwrap();
            for (front, back, k) in [(0, 16, 8), (3, 12, 5), (12, 3, 8), (9, 9, 2), (16, 15, 1), (2, 3, 4), (4, 4, 0)] {
                let value = |i: u32| -1.0 + f64::from(i) / 8.0;
                let l = length(kind, 9, 2.0, k);
                let (got, want) =
                    (table.look_up(value(front), value(back), l), published(&exact, value(front), value(back), l));
                for c in 0..4 {
                    assert!((got[c] - want[c]).abs() < 1e-6, "{kind:?} {front} {back} {k}: {got:?}, not {want:?}");
                }
            }
        }
    }
    assert_eq!(Table::new(&exact(&ramp, Emission::Chromatic), Kind::Log, [1, 2, 9], 1.0), None);
}

/// The bias of the published table, and that it is none of the normalised one.
#[test]
fn logarithmic_lengths_are_biased_unless_normalised() {
    let exact = exact(&[(-1.0, 0.02), (1.0, 0.02)], Emission::Chromatic);
    for n in [8, 16, 64] {
        let bias = |kind: Kind| {
            let table = Table::new(&exact, kind, [2, 2, n], 0.25).unwrap();
            let (mut sum, mut most) = (0.0, 0.0f64);
            for i in 0..1000 {
                // Thin: three slices below the last half.
                let l =
                    0.25 * (-4.0 + 3.0 * (f64::from(i) + 0.5) / 1000.0).exp2() / 16.0 * if n == 8 { 8.0 } else { 1.0 };
                let over = table.look_up(-1.0, 1.0, l)[3] / published(&exact, -1.0, 1.0, l)[3] - 1.0;
                sum += over / 1000.0;
                most = most.max(over.abs());
            }
            (sum, most)
        };
        let (mean, most) = bias(Kind::Log);
        assert!((mean - 0.0407).abs() < 2e-3 && (most - 0.0615).abs() < 2e-3, "{n}: {mean}, {most}");
        let (_, most) = bias(Kind::LogNormalised);
        assert!(most < 1e-6, "{n}: {most}");
    }
}

/// 20,000 segments anywhere.
fn segments() -> impl Iterator<Item = [f64; 3]> {
    let mut seed = 9u64;
    let mut unit = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 53) as f64
    };
    (0..20_000).map(move |_| [2.0 * unit() - 1.0, 2.0 * unit() - 1.0, unit()])
}

/// The root mean square and the greatest of the errors of all channels, for lengths up to `longest`.
fn errors(exact: &Exact<f64>, longest: f64, look_up: impl Fn(f64, f64, f64) -> [f64; 4]) -> [f64; 2] {
    let (mut sum, mut most, mut count) = (0.0, 0.0f64, 0.0);
    for [front, back, l] in segments() {
        let (got, want) = (look_up(front, back, l * longest), published(exact, front, back, l * longest));
        for k in 0..4 {
            let e = (got[k] - want[k]).abs();
            assert!(e.is_finite(), "{front} {back} {l}");
            (sum, most, count) = (sum + e * e, most.max(e), count + 1.0);
        }
    }
    [f64::sqrt(sum / count), most]
}

#[test]
fn cylinder_coordinates_lead_there_and_back() {
    for [front, back, l] in segments().map(|[f, b, l]| [(f + 1.0) / 2.0, (b + 1.0) / 2.0, l]) {
        let [a, s, t] = coordinates(front, back, l);
        assert!([a, s, t].iter().all(|x| (0.0..=1.0).contains(x)), "{a} {s} {t}");
        let [f, b, m] = place(a, s, t);
        assert!((f - front).abs() < 1e-14 && b == back && (m - l).abs() < 1e-14, "{front} {back} {l}: {f} {b} {m}");
    }
    assert_eq!(coordinates(0.3, 0.3, 0.0), [0.0, 0.0, 0.3]);
    // The borders of the four parts, from both sides.
    for (a, s, t) in [(0.25, 0.5, 0.25), (0.5, 0.5, 0.25), (0.75, 0.25, 0.5)] {
        let (below, above) = (place(a - 1e-12, s, t), place(a + 1e-12, s, t));
        assert!((0..3).all(|k| (below[k] - above[k]).abs() < 1e-11), "{a}");
    }
}

/// What the cylinder's planes cost in accuracy beside a table of three parameters, and what more of them gain.
#[test]
fn planes_stand_for_a_volume() {
    let at = |i: i32| f64::from(i) / 128.0;
    let opacity = (-128..=128).map(|i| (at(i), 1.0 + (2.0 * at(i)).sin())).collect();
    let color = (-128..=128).map(|i| (at(i), [0.5 + 0.5 * at(i), (1.5 * at(i)).cos(), 0.3])).collect();
    let transfer = TransferFunction::new(color, opacity, 1.0).unwrap();
    let smooth = Exact::new(&transfer, field::Kind::Scalar, &[Normalization { mid: 0.0, half: 1.0 }; 4], 1.0);
    let mut last = f64::INFINITY;
    for n in [16, 32, 64] {
        let volume = Table::new(&smooth, Kind::Uniform, [n; 3], 2.0).unwrap();
        let planes = Cylindrical::new(&smooth, 4 * n, n, 2.0).unwrap();
        let [of_volume, _] = errors(&smooth, 2.0, |f, b, l| volume.look_up(f, b, l));
        let [of_planes, _] = errors(&smooth, 2.0, |f, b, l| planes.look_up(f, b, l));
        assert!(of_planes <= 2.0 * of_volume, "{n}: {of_planes}, {of_volume}");
        assert!(of_planes < 0.6 * last, "{n}: {of_planes} after {last}");
        last = of_planes;
    }
    let flat = Cylindrical::new(&smooth, 64, 16, 2.0).unwrap();
    assert_eq!(flat.look_up(0.4, 0.4, 0.0), [0.0; 4]);
}

#[test]
fn polynomials_of_higher_degree_are_better() {
    let bands: Vec<(f64, f64)> =
        (0..8).map(|i| (-1.0 + 2.0 * f64::from(i) / 7.0, if i % 2 == 0 { 0.2 } else { 6.0 })).collect();
    for emission in [Emission::Chromatic, Emission::Direct { scale: 0.7 }] {
        let bands = exact(&bands, emission);
        let rms = [1, 2, 4].map(|degree| {
            let table = Polynomial::new(&bands, degree, 128, 1.0).unwrap();
            // Between texels the values' own resolution would be measured.
            let near = |s: f64| value(((s + 1.0) * 63.5).round() as u32, 128);
            let mut sum = 0.0;
            for [front, back, l] in segments().map(|[f, b, l]| [near(f), near(b), l]) {
                let (got, want) = (table.look_up(front, back, l), published(&bands, front, back, l));
                sum += (0..4).map(|k| (got[k] - want[k]).powi(2)).sum::<f64>();
            }
            sum.sqrt()
        });
        assert!(rms[1] < 0.7 * rms[0] && rms[2] < 0.7 * rms[1], "{rms:?}");
        // Opacity needs no polynomial: at texels it is exact but for rounding.
        let table = Polynomial::new(&bands, 1, 15, 1.0).unwrap();
        for (front, back, l) in [(0, 14, 0.7), (3, 9, 0.2), (14, 2, 1.0), (5, 5, 0.4)] {
            let [front, back] = [front, back].map(|i| value(i, 15));
            let (got, want) = (table.look_up(front, back, l)[3], published(&bands, front, back, l)[3]);
            assert!((got - want).abs() < 1e-6, "{front} {back} {l}: {got}, not {want}");
        }
    }
}

#[test]
fn limits_are_finite() {
    let peak = exact(&[(-1.0, 0.0), (0.0, 0.0), (0.01, 50.0), (0.02, 0.0), (1.0, 0.0)], Emission::Chromatic);
    let polynomial = Polynomial::new(&peak, 4, 33, 1.0).unwrap();
    let planes = Cylindrical::new(&peak, 32, 16, 1.0).unwrap();
    let volume = Table::new(&peak, Kind::LogNormalised, [33, 33, 8], 1.0).unwrap();
    for [front, back, l] in
        [[-1.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.5, 0.5, 1e-300], [0.01, 0.01, 0.0], [1.0, -1.0, 0.0]]
    {
        for got in [polynomial.look_up(front, back, l), planes.look_up(front, back, l), volume.look_up(front, back, l)]
        {
            assert!(got.iter().all(|c| c.is_finite()), "{front} {back} {l}: {got:?}");
        }
    }
    // A stretch of opacity 1 is as opaque as numbers allow.
    let color = vec![(-1.0, [1.0, 0.2, 0.0]), (1.0, [0.4, 0.4, 0.4])];
    let opacity = vec![(-1.0, 0.0), (-0.2, 1.0), (0.2, 1.0), (0.5, 0.0), (1.0, 0.0)];
    let opaque = TransferFunction::new(color, opacity, 1.0).unwrap().with_convention(Convention::Opacity);
    let opaque = Exact::new(&opaque, field::Kind::Scalar, &[Normalization { mid: 0.0, half: 1.0 }; 4], 1.0);
    for (exact, longest) in [(&peak, 1.0), (&opaque, 1.0), (&opaque, 1e-6), (&opaque, 1e6), (&peak, 1e-30)] {
        for kind in [Kind::Uniform, Kind::Log, Kind::LogNormalised] {
            let size = [17, 17, 12];
            let made = [Table::closed(exact, kind, size, longest), Table::incremental(exact, kind, size, longest)];
            for table in made.iter().flatten() {
                assert!(table.texels.as_flattened().iter().all(|v| v.is_finite() && *v >= 0.0), "{kind:?}, {longest}");
            }
            let want = Table::new(exact, kind, size, longest).unwrap();
            let apart = apart_texels(&made[0].as_ref().unwrap().texels, &want.texels);
            assert!(apart < 2e-5, "{kind:?}, {longest}: {apart}");
        }
        let polynomial = Polynomial::closed(exact, 4, 17, longest).unwrap();
        assert!(polynomial.texels.iter().all(|t| t.as_flattened().iter().all(|v| v.is_finite())), "{longest}");
    }
    assert_eq!(Polynomial::new(&peak, 0, 33, 1.0), None);
    assert_eq!(Cylindrical::new(&peak, 6, 33, 1.0), None);
}

fn functions() -> Vec<(&'static str, Exact<f64>)> {
    functions_of(77)
}

fn functions_of(seed: u64) -> Vec<(&'static str, Exact<f64>)> {
    let exact =
        |t: &TransferFunction| Exact::new(t, field::Kind::Scalar, &[Normalization { mid: 0.0, half: 1.0 }; 4], 1.0);
    transfers(seed).iter().map(|(name, transfer)| (*name, exact(transfer))).collect()
}

/// Functions of all kinds: ramps, a peak 1 % wide, steps, 256 random entries; which one, and whether it emits directly.
pub(crate) fn transfers(mut seed: u64) -> Vec<(&'static str, TransferFunction)> {
    let mut unit = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut all = vec![];
    for emission in [Emission::Chromatic, Emission::Direct { scale: 0.7 }] {
        for kind in ["ramps", "peak", "steps", "entries"] {
            let (mut opacity, mut color) = (vec![], vec![]);
            let mut add = |s: f64, a: f64, c: [f64; 3]| {
                opacity.push((s, a));
                color.push((s, c));
            };
            match kind {
                "ramps" => (0..6).for_each(|i| add(-1.0 + 0.4 * f64::from(i), 3.0 * unit(), [unit(), unit(), unit()])),
                "peak" => [(-1.0, 0.0), (0.123, 0.0), (0.133, 60.0), (0.143, 0.0), (1.0, 0.0)]
                    .into_iter()
                    .for_each(|(s, a)| add(s, a, [unit(), unit(), unit()])),
                "steps" => {
                    for i in 0..5 {
                        let (a, c) = (4.0 * unit(), [unit(), unit(), unit()]);
                        add(-1.0 + 0.4 * f64::from(i), a, c);
                        add(-1.0 + 0.4 * f64::from(i + 1), a, c);
                    }
                }
                _ => (0..256)
                    .for_each(|i| add(-1.0 + 2.0 * f64::from(i) / 255.0, 3.0 * unit(), [unit(), unit(), unit()])),
            }
            let transfer = TransferFunction::new(color, opacity, 1.0).unwrap().with_emission(emission).unwrap();
            all.push((kind, transfer));
        }
    }
    all
}

/// The greatest difference of two lists of texels, relative to the greatest of the channel, if that is anything:
/// opacities of f64 are 1 less what comes through, and so have no digits below 1e-16.
pub(crate) fn apart_texels(got: &[[f32; 4]], want: &[[f32; 4]]) -> f32 {
    assert_eq!(got.len(), want.len());
    let most = want.iter().fold([1e-12f32; 4], |m, t| std::array::from_fn(|k| m[k].max(t[k].abs())));
    let all = got.iter().zip(want).flat_map(|(g, w)| (0..4).map(move |k| (g[k] - w[k]).abs() / most[k]));
    all.fold(0.0, |m, e| if e > m || e.is_nan() { e } else { m })
}

#[test]
fn closed_form_agrees_with_f64() {
    for (name, exact) in functions() {
        let direct = exact.direct;
        for kind in [Kind::Uniform, Kind::Log, Kind::LogNormalised] {
            for (n, slices, longest) in [(33, 9, 2.0), (24, 17, 40.0)] {
                let [got, want] =
                    [Table::closed, Table::new].map(|make| make(&exact, kind, [n, n, slices], longest).unwrap());
                let apart = apart_texels(&got.texels, &want.texels);
                assert!(apart < 1e-5, "{name}, direct {direct}, {kind:?}, {n}: {apart}");
            }
        }
        for degree in [1, 2, 4] {
            let [got, want] = [Polynomial::closed, Polynomial::new].map(|make| make(&exact, degree, 30, 3.0).unwrap());
            // Of high degrees, coefficients are great sums of both signs: what counts is the sum.
            for [front, back, l] in segments().take(4000) {
                let [got, want] = [&got, &want].map(|t| t.look_up(front, back, 3.0 * l));
                let apart = (0..4).fold(0.0, |m: f64, k| m.max((got[k] - want[k]).abs()));
                assert!(apart < 4e-5, "{name}, direct {direct}, degree {degree}: {got:?}, not {want:?}");
            }
        }
    }
}

/// Numeric integration as published, and slices made of slices: near what they stand for, the nearer the finer.
#[test]
fn published_constructions_come_near() {
    for (name, exact) in functions() {
        for kind in [Kind::Uniform, Kind::Log] {
            let apart_from = |table: &Table, want: &Table| {
                let all =
                    table.texels.iter().zip(want.texels.iter()).flat_map(|(g, w)| (0..4).map(move |k| g[k] - w[k]));
                let sum: f64 = all.map(|d| f64::from(d).powi(2)).sum();
                assert!(sum.is_finite(), "{name} {kind:?}");
                (sum / (4 * want.texels.len()) as f64).sqrt()
            };
            let mut last = [f64::INFINITY; 3];
            for (n, m) in [(32, 256), (64, 1021)] {
                let size = [n, n, 9];
                let want = Table::closed(&exact, kind, size, 2.0).unwrap();
                let made = [
                    Table::sampled(&exact, kind, size, 2.0, Sampling::same(m, 1.0)).unwrap(),
                    Table::sampled(&exact, kind, size, 2.0, Sampling::touched(m, 2.0)).unwrap(),
                    Table::incremental(&exact, kind, size, 2.0).unwrap(),
                ];
                let now = [0, 1, 2].map(|k| apart_from(&made[k], &want));
                for k in 0..3 {
                    assert!(
                        now[k] < 0.2 && now[k] < ([0.9, 0.9, 1.0][k] * last[k]).max(1e-5),
                        "{name} {kind:?} {n} {k}: {now:?} after {last:?}"
                    );
                }
                last = now;
            }
        }
    }
}

#[test]
fn cylinders_in_closed_form_agree_with_f64() {
    for (name, exact) in functions() {
        let [got, want] = [Cylindrical::closed, Cylindrical::new].map(|make| make(&exact, 16, 24, 3.0).unwrap());
        let apart = apart_texels(&got.texels, &want.texels);
        assert!(apart < 1e-6, "{name}, direct {}: {apart}", exact.direct);
    }
}

/// What few bits cost, and what the opacity that is linear in length costs.
#[test]
fn cheaper_texels_cost_what_they_should() {
    let (_, exact) = functions().swap_remove(0);
    let whole = Polynomial::closed(&exact, 2, 64, 2.0).unwrap();
    let [of_whole, _] = errors(&exact, 2.0, |f, b, l| whole.look_up(f, b, l));
    let apart = [8, 16].map(|bits| {
        let rounded = whole.rounded(bits);
        let mut sum = 0.0;
        for [f, b, l] in segments() {
            let (got, want) = (rounded.look_up(f, b, 2.0 * l), whole.look_up(f, b, 2.0 * l));
            sum += (0..4).map(|k| (got[k] - want[k]).powi(2)).sum::<f64>() / 80_000.0;
        }
        sum.sqrt()
    });
    assert!(apart[0] < 4e-3 && apart[0] > 100.0 * apart[1] && apart[1] < 2e-5, "{apart:?}");
    let linear = Linear::closed(&exact, 64, 2.0).unwrap();
    let [of_linear, _] = errors(&exact, 2.0, |f, b, l| linear.look_up(f, b, l));
    assert!(of_linear > 10.0 * of_whole, "{of_linear} {of_whole}");
    let [a, b] = [Linear::closed, Linear::new].map(|make| make(&exact, 40, 2.0).unwrap());
    assert!(apart_texels(&a.texels, &b.texels) < 1e-5);
    let bits = |bits| Sampling { bits: Some(bits), ..Sampling::same(128, 1.0) };
    let fine = Table::closed(&exact, Kind::Uniform, [32, 32, 9], 2.0).unwrap();
    let rms = [8, 12].map(|b| {
        let table = Table::sampled(&exact, Kind::Uniform, [32, 32, 9], 2.0, bits(b)).unwrap();
        table
            .texels
            .iter()
            .zip(fine.texels.iter())
            .map(|(g, w)| (0..4).map(|k| (g[k] - w[k]).powi(2)).sum::<f32>())
            .sum::<f32>()
    });
    assert!(rms[0] > 20.0 * rms[1], "{rms:?}");
}

/// A table's errors, and the bound on them.
struct Compared<'a> {
    exact: &'a Exact<f64>,
    bound: f64,
    look_up: &'a (dyn Fn(f64, f64, f64) -> [f64; 4] + Sync),
}

impl Compared<'_> {
    fn error(&self, [f, b, l]: [f64; 3], want: [f64; 4]) -> f64 {
        let got = (self.look_up)(f, b, l);
        (0..4).fold(0.0, |m, k| m.max((got[k] - want[k]).abs()))
    }

    /// The greatest error near `at`: a climb, along one parameter after another, by ever smaller steps.
    fn climb(&self, mut at: [f64; 3], texel: f64, longest: f64) -> f64 {
        let of = |at: [f64; 3]| self.error(at, published(self.exact, at[0], at[1], at[2]));
        let (mut most, mut step) = (of(at), 0.5);
        for _ in 0..10 {
            for (k, by) in (0..3).flat_map(|k| [(k, -step), (k, step)]) {
                let mut next = at;
                next[k] = match k {
                    2 => (at[k] * (1.0 + 0.8 * by)).min(longest),
                    _ => (at[k] + by * texel).clamp(-1.0, 1.0),
                };
                let error = of(next);
                if error > most {
                    (most, at) = (error, next);
                }
            }
            step *= 0.65;
        }
        most
    }

    /// The greatest error, as a share of the bound: of `segments`, and around the worst of them.
    fn share(&self, segments: &[([f64; 3], [f64; 4])], texel: f64, longest: f64) -> f64 {
        let mut errors: Vec<_> = segments.iter().map(|(at, want)| (self.error(*at, *want), at)).collect();
        errors.select_nth_unstable_by(12, |a, b| b.0.total_cmp(&a.0));
        errors[..12].iter().map(|(_, at)| self.climb(**at, texel, longest)).fold(0.0, f64::max) / self.bound
    }
}

/// The greatest error that a search finds is within the bound, and the bound is not idle.
#[test]
fn errors_are_within_their_bounds() {
    let long = std::env::var("HALITE_LONG").is_ok_and(|v| v == "1");
    // Of 256 values, entries are at texels, and so are some steps and ramps.
    let sizes =
        [(32, 17, 2.0), (64, 33, 2.0), (128, 65, 2.0), (64, 17, 0.05), (200, 9, 0.05), (256, 33, 2.0), (256, 9, 0.05)];
    let functions = (1..if long { 13 } else { 3 }).flat_map(functions_of);
    let cases: Vec<_> = functions.flat_map(|f| sizes.map(|size| (f.clone(), size))).collect();
    let compare = |((name, exact), (n, slices, longest)): &((&str, Exact<f64>), (u32, u32, f64))| {
        let (n, longest) = (*n, *longest);
        // Half of them within two texels of the diagonal, where functions are seen as they are.
        let near = |i: usize, f: f64, b: f64| {
            if i.is_multiple_of(2) { b } else { (f + 4.0 * b / f64::from(n)).clamp(-1.0, 1.0) }
        };
        let compared = |(i, [f, b, l]): (usize, [f64; 3])| {
            let (b, l) = (near(i, f, b), longest * l);
            ([f, b, l], published(exact, f, b, l))
        };
        let segments: Vec<_> = segments().enumerate().take(10_000).map(compared).collect();
        let mut wrong = vec![];
        let mut hold = |what: &str, bound: Option<f64>, look_up: &(dyn Fn(f64, f64, f64) -> [f64; 4] + Sync)| {
            let share =
                Compared { exact, bound: bound.unwrap(), look_up }.share(&segments, 2.0 / f64::from(n - 1), longest);
            if !(0.05..=1.0).contains(&share) {
                wrong.push(format!("{name}, direct {}, {what}, {n}, {longest}: {share:.3} of the bound", exact.direct));
            }
        };
        let mut volume = |kind: Kind, slices: u32| {
            let table = Table::closed(exact, kind, [n, n, slices], longest).unwrap();
            hold(&format!("{kind:?}"), table.bound(exact), &|f, b, l| table.look_up(f, b, l));
        };
        volume(Kind::Uniform, *slices);
        volume(Kind::Log, 12);
        if exact.direct {
            assert_eq!(bound_of_volume(exact, Kind::LogNormalised, [n, 12], longest), None);
            assert_eq!(bound_of_polynomial(exact, 2, n, longest), None);
            return wrong;
        }
        volume(Kind::LogNormalised, 12);
        for degree in [1, 2, 4] {
            let table = Polynomial::closed(exact, degree, n, longest).unwrap();
            hold(&format!("degree {degree}"), table.bound(exact), &|f, b, l| table.look_up(f, b, l));
        }
        wrong
    };
    let wrong: Vec<String> = cases.par_iter().flat_map_iter(compare).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn sizes_keep_to_their_error() {
    let (_, ramps) = functions().swap_remove(0);
    let of_size = |n: u32, slices: u32| bound_of_volume(&ramps, Kind::Uniform, [n, slices], 2.0).unwrap();
    let [n, _, slices] = size(&ramps, 2.0, 0.2).unwrap();
    assert!(of_size(n, slices) <= 0.2 + 1e-5, "{n} {slices}");
    assert!(of_size(n / 2, slices) > 0.1, "{n} {slices}");
    let of_polynomial = |n: u32| bound_of_polynomial(&ramps, 2, n, 2.0).unwrap();
    assert!(of_polynomial(64) > of_polynomial(128));
    assert_eq!(values_of_polynomial(&ramps, 2, 2.0, of_polynomial(128), 512), Some(128));
    let of_normalised = |n: u32| bound_of_volume(&ramps, Kind::LogNormalised, [n, 16], 2.0).unwrap();
    assert!(of_normalised(64) > of_normalised(128));
    assert_eq!(values_of_normalised(&ramps, 16, 2.0, of_normalised(128), 512), Some(128));
    assert_eq!(values_of_polynomial(&ramps, 2, 2.0, 1e-9, 128), None);
}
