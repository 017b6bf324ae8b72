#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "tests")]

use super::*;
use crate::field::Normalization;
use crate::transfer::{Convention, Emission, TransferFunction};

const UNIT: [Normalization; 4] = [Normalization { mid: 0.0, half: 1.0 }; 4];

/// Ramps and a peak.
pub(crate) fn transfer(emission: Emission) -> TransferFunction {
    let color = vec![(-1.0, [1.0, 0.2, 0.0]), (0.3, [0.0, 0.5, 0.9]), (1.0, [0.4, 0.4, 0.4])];
    let opacity = vec![(-1.0, 0.1), (0.0, 0.3), (0.2, 3.0), (0.4, 0.2), (1.0, 1.5)];
    TransferFunction::new(color, opacity, 1.0).unwrap().with_emission(emission).unwrap()
}

pub(crate) fn exact(emission: Emission) -> Exact<f64> {
    Exact::new(&transfer(emission), field::Kind::Scalar, &UNIT, 1.0)
}

/// A table in the memory of another function's is the same, and so is one that does not fit there.
#[test]
fn tables_are_renewed() {
    let [one, other] = [Emission::Chromatic, Emission::Direct { scale: 0.7 }].map(exact);
    for options in choices() {
        for texels in [Texels::Float, Texels::Unorm8] {
            let options = IntegrationOptions { texels, ..options };
            for longest in [2.0, 1.5] {
                let (old, want) = (
                    PreintegratedTable::new(&one, &options, 2.0).unwrap(),
                    PreintegratedTable::new(&other, &options, longest),
                );
                assert!(
                    PreintegratedTable::renewed(old, &other, &options, longest).unwrap() == want.unwrap(),
                    "{options:?}"
                );
            }
        }
    }
}

/// Every form and variant, small.
pub(crate) fn choices() -> Vec<IntegrationOptions> {
    let mut all = vec![];
    for lengths in [Kind::Uniform, Kind::Log, Kind::LogNormalised] {
        all.push(IntegrationOptions { lengths, table: Some([17, 9, 8]), ..IntegrationOptions::of(Form::Volume) });
    }
    for degree in [1, 2, 4, 7] {
        all.push(IntegrationOptions { degree, table: Some([33, 33, 0]), ..IntegrationOptions::of(Form::Polynomial) });
    }
    for planes in [Planes::Two, Planes::Packed, Planes::One] {
        all.push(IntegrationOptions { planes, table: Some([15, 15, 24]), ..IntegrationOptions::of(Form::Cylindrical) });
    }
    all
}

/// Values in [−1, 1] and lengths up to 2: at the ends, equal, nearly equal, and anywhere.
pub(crate) fn segments(n: usize) -> Vec<[f32; 3]> {
    let mut seed = 7u64;
    let mut unit = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 40) as f32 / (1u32 << 24) as f32
    };
    let mut all = vec![[0.0, 0.0, 0.0], [-1.0, 1.0, 2.0], [1.0, -1.0, 2.0], [1.0, 1.0, 0.0], [-1.0, -1.0, 2.0]];
    for i in 0..n {
        let (front, back, l) = (2.0 * unit() - 1.0, 2.0 * unit() - 1.0, 2.0 * unit());
        all.push(match i % 4 {
            0 => [front, front, l],
            1 => [front, (front + 0.01 * back).clamp(-1.0, 1.0), l * 0.01],
            2 => [front, back, l * l * l / 4.0],
            _ => [front, back, l],
        });
    }
    all
}

/// What f64 finds in the same table.
pub(crate) fn exact_light(table: &PreintegratedTable, [front, back, l]: [f32; 3]) -> [f64; 4] {
    let [front, back, l] = [front, back, l].map(f64::from);
    match table.stored() {
        TableData::Volume(t) => t.look_up(front, back, l),
        TableData::Polynomial(t) => t.look_up(front, back, l),
        TableData::Cylindrical(t) => t.look_up(front, back, l),
        TableData::SecondOrder(t) => t.look_up([front, (front + back) / 2.0, back]),
        TableData::SecondOrderPolynomial(t) => t.look_up([front, (front + back) / 2.0, back], l),
    }
}

/// The greatest of the errors of `got` against f64's look-ups, over emission where that is direct and so has no bound.
pub(crate) fn worst(table: &PreintegratedTable, segments: &[[f32; 3]], got: &[[f32; 4]]) -> f64 {
    let errors = segments.iter().zip(got).map(|(s, got)| {
        let want = exact_light(table, *s);
        (0..4).map(|k| (f64::from(got[k]) - want[k]).abs()).fold(0.0, f64::max)
    });
    errors.fold(0.0, f64::max)
}

#[test]
fn look_ups_are_those_of_f64() {
    let segments = segments(20_000);
    for emission in [Emission::Chromatic, Emission::Direct { scale: 0.7 }] {
        for options in choices() {
            if options.planes == Planes::One {
                continue;
            }
            let table = PreintegratedTable::new(&exact(emission), &options, 2.0).unwrap();
            let got: Vec<_> = segments.iter().map(|&[f, b, l]| table.look_up(f, b, l)).collect();
            let worst = worst(&table, &segments, &got);
            assert!(worst < 4e-6, "{options:?}, {emission:?}: {worst}");
        }
    }
}

#[test]
fn one_plane_is_the_nearer_of_two() {
    let exact = exact(Emission::Chromatic);
    let of = |planes| {
        let options =
            IntegrationOptions { planes, table: Some([15, 15, 24]), ..IntegrationOptions::of(Form::Cylindrical) };
        PreintegratedTable::new(&exact, &options, 2.0).unwrap()
    };
    let (one, two) = (of(Planes::One), of(Planes::Two));
    // On a plane both read the same: a = k / 24, at the border of the first part and in it.
    for [front, back, l] in [[0.5, 0.0, 0.5], [0.5, 0.0, 1.0 / 6.0], [-0.5, 0.5, 2.0]] {
        let [a, b] = [&one, &two].map(|t| t.look_up(front, back, l));
        assert!((0..4).all(|k| (a[k] - b[k]).abs() < 1e-5), "{a:?}, {b:?}");
    }
    let between = |t: &PreintegratedTable| t.look_up(0.5, 0.0, 0.57);
    assert!((between(&one)[3] - between(&two)[3]).abs() > 1e-5);
}

#[test]
fn fewer_bits_round_texels() {
    let exact = exact(Emission::Chromatic);
    let segments = segments(2000);
    for options in choices() {
        let error = |texels| {
            let table = PreintegratedTable::new(&exact, &IntegrationOptions { texels, ..options }, 2.0).unwrap();
            let fine = PreintegratedTable::new(&exact, &options, 2.0).unwrap();
            let got: Vec<_> = segments.iter().map(|&[f, b, l]| table.look_up(f, b, l)).collect();
            let want: Vec<_> = segments.iter().map(|&[f, b, l]| fine.look_up(f, b, l)).collect();
            let error = |(a, b): (&[f32; 4], &[f32; 4])| (0..4).map(|k| (a[k] - b[k]).abs()).fold(0.0, f32::max);
            got.iter().zip(&want).map(error).fold(0.0, f32::max)
        };
        let [eight, sixteen] = [Texels::Unorm8, Texels::Unorm16].map(error);
        assert!(eight > 20.0 * sixteen && sixteen > 0.0 && eight < 0.2, "{options:?}: {eight}, {sixteen}");
    }
}

/// What is opaque has a mean extinction beyond all bounds: it must not take the levels of what is not.
#[test]
fn an_opaque_stretch_leaves_levels_to_the_rest() {
    let color = vec![(-1.0, [0.1, 0.2, 0.9]), (0.0, [0.1, 0.9, 0.6]), (1.0, [1.0, 0.1, 0.1])];
    let opacity = vec![(-1.0, 0.0), (-0.4, 0.0), (-0.1, 0.9), (0.1, 0.1), (0.6, 1.0), (1.0, 1.0)];
    let transfer = TransferFunction::new(color, opacity, 0.5).unwrap().with_convention(Convention::Opacity);
    let exact = Exact::<f64>::new(&transfer, field::Kind::Scalar, &UNIT, 1.0);
    let segments: Vec<_> = segments(20_000).into_iter().filter(|s| s[2] > 0.05).collect();
    for form in [Form::Volume, Form::Polynomial, Form::Cylindrical] {
        let options = IntegrationOptions { table: Some([128, 128, 16]), ..IntegrationOptions::of(form) };
        let [float, sixteen, eight] = [Texels::Float, Texels::Unorm16, Texels::Unorm8].map(|texels| {
            let table = PreintegratedTable::new(&exact, &IntegrationOptions { texels, ..options }, 2.0).unwrap();
            segments.iter().map(|&[f, b, l]| table.look_up(f, b, l)).collect::<Vec<_>>()
        });
        let rmse = |a: &[[f32; 4]]| {
            let squares = a.iter().flatten().zip(float.iter().flatten()).map(|(a, b)| f64::from(a - b).powi(2));
            (squares.sum::<f64>() / (4 * segments.len()) as f64).sqrt()
        };
        let (sixteen, eight) = (rmse(&sixteen), rmse(&eight));
        eprintln!("{form:?}: 16 bits {sixteen:.1e}, 8 bits {eight:.1e}");
        assert!(sixteen < 4e-3 && eight < 0.03, "{form:?}: {sixteen}, {eight}");
    }
}

#[test]
fn linear_opacity_meets_the_exponential_at_the_ends() {
    let exact = exact(Emission::Chromatic);
    let of = |opacity| {
        let options =
            IntegrationOptions { alpha: opacity, table: Some([33, 33, 0]), ..IntegrationOptions::of(Form::Polynomial) };
        PreintegratedTable::new(&exact, &options, 2.0).unwrap()
    };
    let alpha = |opacity, l| of(opacity).look_up(0.3, 0.1, l)[3];
    for l in [0.0, 2.0] {
        assert!((alpha(Alpha::Linear, l) - alpha(Alpha::Exponential, l)).abs() < 1e-6, "{l}");
    }
    assert!(alpha(Alpha::Linear, 0.6) < 0.8 * alpha(Alpha::Exponential, 0.6));
}

#[test]
fn limits_are_finite() {
    let color = vec![(0.0, [1.0; 3])];
    let opacity = vec![(-1.0, 0.0), (0.0, 0.0), (0.0, 1e20), (0.01, 1e20), (0.01, 0.0)];
    let transfer = TransferFunction::new(color, opacity, 1.0).unwrap();
    let exact = Exact::<f64>::new(&transfer, field::Kind::Scalar, &UNIT, 1.0);
    for options in choices() {
        for texels in [Texels::Float, Texels::Unorm8] {
            let table = PreintegratedTable::new(&exact, &IntegrationOptions { texels, ..options }, 2.0).unwrap();
            for [f, b, l] in segments(500).into_iter().chain([[2.0, -2.0, 5.0], [0.005, 0.005, 1e-30]]) {
                let c = table.look_up(f, b, l);
                assert!(
                    c.iter().all(|v| v.is_finite()) && c[3] >= 0.0 && c[3] <= 1.0,
                    "{options:?} {f} {b} {l}: {c:?}"
                );
            }
        }
    }
    let pair = Exact::<f64>::new(&transfer, field::Kind::Pair, &UNIT, 1.0);
    let refused =
        PreintegratedTable::new(&pair, &IntegrationOptions::of(Form::SecondOrder), 1.0).unwrap_err().to_string();
    assert!(refused.contains("one component"), "{refused}");
}

/// What a segment of a field of several components does by a table, against the exact integral of f64.
fn worst_of_components<const N: usize>(
    exact: &Exact<f64>,
    narrow: &Exact<f32>,
    options: &IntegrationOptions,
) -> [f64; 2] {
    let table = PreintegratedTable::new(exact, options, 2.0).unwrap();
    let (mut colours, mut opacities) = (0.0f64, 0.0f64);
    let all = segments(4000);
    for (i, [s, t, l]) in all.iter().copied().enumerate() {
        let other = all[(7 * i + 3) % all.len()];
        // Of colours, beyond ±1 too; of opacities in a third.
        let reach = if i % 3 == 0 { 1.8 } else { 1.0 };
        let values = |last: f32, from: usize| {
            std::array::from_fn(|k| if k + 1 == N { last * reach } else { 0.5 + 0.7 * other[(k + from) % 2] })
        };
        let (front, back): ([f32; N], [f32; N]) = (values(s, 0), values(t, 1));
        let (mut got, mut want) = (Light::none(), Light::none());
        table.add_components(narrow, &front, &back, l, &mut got);
        exact.add(&front.map(f64::from), &back.map(f64::from), f64::from(l), &mut want);
        for k in 0..3 {
            colours = colours.max((f64::from(got.color[k]) - want.color[k]).abs());
        }
        opacities = opacities.max((f64::from(got.transmittance) - want.transmittance).abs());
    }
    [colours, opacities]
}

/// Pairs and RGBA by weights: within the bound of their table, and finer tables are nearer.
#[test]
fn weights_stand_for_colours_of_their_own() {
    for emission in [Emission::Chromatic, Emission::Direct { scale: 0.7 }] {
        let color =
            vec![(-1.0, [1.0, 0.2, 0.0]), (0.3, [0.0, 0.5, 0.9]), (0.3, [0.9, 0.9, 0.1]), (1.0, [0.4, 0.4, 0.4])];
        let opacity = vec![(-1.0, 0.2), (0.1, 0.4), (0.4, 0.1), (1.0, 0.5)];
        let transfer = TransferFunction::new(color, opacity, 1.0).unwrap().with_emission(emission).unwrap();
        let of =
            |kind| (Exact::<f64>::new(&transfer, kind, &UNIT, 1.0), Exact::<f32>::new(&transfer, kind, &UNIT, 1.0));
        let (pair, rgba) = (of(field::Kind::Pair), of(field::Kind::Rgba));
        let weights = pair.0.weights().unwrap();
        for (form, small, large) in [
            (Form::Volume, [33, 33, 10], [129, 129, 14]),
            (Form::Polynomial, [33, 33, 0], [129, 129, 0]),
            (Form::Cylindrical, [33, 33, 32], [129, 129, 128]),
        ] {
            let errors = [small, large].map(|size| {
                let options = IntegrationOptions { table: Some(size), degree: 3, ..IntegrationOptions::of(form) };
                let bound = match PreintegratedTable::new(&pair.0, &options, 2.0).unwrap().stored() {
                    TableData::Volume(t) => t.bound(&weights),
                    TableData::Polynomial(t) => t.bound(&weights),
                    _ => None,
                };
                let [pairs, colours] = [
                    worst_of_components::<2>(&pair.0, &pair.1, &options),
                    worst_of_components::<4>(&rgba.0, &rgba.1, &options),
                ];
                eprintln!("{form:?}, {size:?}, {emission:?}: pairs {pairs:?}, RGBA {colours:?}, bound {bound:?}");
                if let Some(bound) = bound {
                    // Colours up to 1.2; of pairs up to four look-ups.
                    assert!(
                        pairs[0] < 4.0 * bound && colours[0] < 1.2 * bound && pairs[1] < bound && colours[1] < bound
                    );
                }
                [pairs[0], pairs[1], colours[0], colours[1]]
            });
            for (small, large) in errors[0].iter().zip(errors[1]) {
                assert!(large < 1e-2 && large < 0.5 * small + 2e-6, "{form:?}, {emission:?}: {errors:?}");
            }
        }
    }
}

/// A cell that is 1000 times shorter than another, and dense.
#[test]
fn small_cells_beside_huge_ones_keep_their_extinction() {
    let transfer = TransferFunction::new(vec![(0.0, [0.2, 0.5, 1.0])], vec![(-1.0, 500.0), (1.0, 900.0)], 1.0).unwrap();
    let exact = Exact::<f64>::new(&transfer, field::Kind::Scalar, &UNIT, 1.0);
    for form in [Form::Volume, Form::Polynomial] {
        let table = PreintegratedTable::new(&exact, &IntegrationOptions::of(form), 2.0).unwrap();
        for l in [2e-4, 2e-3, 1e-2] {
            let [.., blue, alpha] = table.look_up(0.0, 0.0, l);
            let want = -(-700.0 * f64::from(l)).exp_m1();
            assert!((f64::from(alpha) - want).abs() < 1e-5, "{form:?}, {l}: {alpha}, not {want}");
            assert!((f64::from(blue) - want).abs() < 1e-5, "{form:?}, {l}: {blue}, not {want}");
        }
    }
}
