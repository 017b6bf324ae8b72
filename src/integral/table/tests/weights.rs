//! Weights of colours that have components of their own.

use super::*;

const UNIT: [Normalization; 4] = [Normalization { mid: 0.0, half: 1.0 }; 4];

/// Functions whose weights are tabulated: ramps, a peak between texels, steps at and between them, and a stretch without extinction.
fn all() -> Vec<(&'static str, Exact<f64>)> {
    let functions: [(&str, &[(f64, f64)]); 4] = [
        ("ramps", &[(-1.0, 0.1), (-0.3, 2.0), (0.2, 0.5), (1.0, 3.0)]),
        ("peak", &[(-1.0, 0.2), (0.31, 0.2), (0.33, 6.0), (0.35, 0.2), (1.0, 0.2)]),
        ("steps", &[(-1.0, 0.5), (-0.25, 0.5), (-0.25, 4.0), (0.13, 4.0), (0.13, 1.0), (1.0, 1.0)]),
        ("gap", &[(-1.0, 2.0), (-0.4, 0.0), (0.3, 0.0), (1.0, 1.0)]),
    ];
    let mut all = vec![];
    for (name, opacity) in functions {
        for (kind, emission) in
            [(field::Kind::Pair, Emission::Chromatic), (field::Kind::Rgba, Emission::Direct { scale: 0.7 })]
        {
            let color = vec![(-1.0, [1.0, 0.2, 0.0]), (0.3, [0.0, 0.5, 0.9])];
            let transfer =
                TransferFunction::new(color, opacity.to_vec(), 1.0).unwrap().with_emission(emission).unwrap();
            all.push((name, Exact::<f64>::new(&transfer, kind, &UNIT, 1.0).weights().unwrap()));
        }
    }
    all
}

/// Weights of the two ends are those of what emits in all, and of equal ones where extinction is the same all along and thin.
#[test]
fn weights_are_shares_of_what_emits() {
    for (name, exact) in all() {
        for [front, back, l] in segments().take(500) {
            let [behind, before, none, alpha] = published(&exact, front, back, l);
            assert!(none == 0.0 && behind >= 0.0 && before >= 0.0, "{name}");
            let all = if exact.direct { behind + before } else { alpha };
            assert!((behind + before - all).abs() < 2e-6, "{name}: {behind} + {before}, not {alpha}");
        }
        let [behind, before, ..] = published(&exact, 0.5, 0.5, 1e-4);
        assert!((behind / before - 1.0).abs() < 1e-3, "{name}");
    }
    let of = |exact: Exact<f64>| exact.weights();
    assert_eq!(of(exact(&[(-1.0, 1.0)], Emission::Chromatic)), None);
}

/// The constructions whose time does not depend on the function hold what those hold that integrate each texel.
#[test]
fn weights_in_closed_form_are_the_integrated_ones() {
    for (name, exact) in all() {
        for size in [17, 40] {
            for kind in [Kind::Uniform, Kind::Log, Kind::LogNormalised] {
                let [got, want] = [Table::closed, Table::new].map(|f| f(&exact, kind, [size, size, 9], 2.0).unwrap());
                let apart = apart_texels(&got.texels, &want.texels);
                assert!(apart < 2e-5, "{name}, direct {}, {kind:?}, {size}: {apart:.1e}", exact.direct);
            }
            for degree in [1, 2, 4] {
                let [got, want] = [Polynomial::closed, Polynomial::new].map(|f| f(&exact, degree, size, 2.0).unwrap());
                let mut worst = 0.0f64;
                for [front, back, l] in segments().take(2000) {
                    let [a, b] = [&got, &want].map(|t| t.look_up(front, back, 2.0 * l));
                    worst = (0..4).fold(worst, |m, k| m.max((a[k] - b[k]).abs()));
                }
                assert!(worst < 2e-5, "{name}, direct {}, degree {degree}, {size}: {worst:.1e}", exact.direct);
            }
            let [got, want] = [Cylindrical::closed, Cylindrical::new].map(|f| f(&exact, 16, size, 2.0).unwrap());
            let apart = apart_texels(&got.texels, &want.texels);
            assert!(apart < 2e-5, "{name}, direct {}, planes, {size}: {apart:.1e}", exact.direct);
        }
    }
}

/// No colour that is linear along a segment is farther off than the bound says.
#[test]
fn weights_are_within_their_bounds() {
    let mut shares = vec![];
    for (name, exact) in all() {
        let longest = 2.0;
        for n in [24, 96] {
            let mut hold = |what: String, bound: Option<f64>, look_up: &dyn Fn(f64, f64, f64) -> [f64; 4]| {
                let Some(bound) = bound else {
                    assert!(exact.direct, "{name}, {what}");
                    return;
                };
                let mut worst = 0.0f64;
                for [front, back, l] in segments() {
                    let (got, want) = (look_up(front, back, longest * l), published(&exact, front, back, longest * l));
                    // Those of both ends together and of each are all that linear colours from 0 to 1 can make of them.
                    let error =
                        [got[0] - want[0], got[1] - want[1], got[0] + got[1] - want[0] - want[1], got[3] - want[3]];
                    worst = error.iter().fold(worst, |m, e| m.max(e.abs()));
                }
                assert!(worst <= bound, "{name}, direct {}, {what}, {n}: {worst:.1e}, bound {bound:.1e}", exact.direct);
                shares.push(worst / bound);
            };
            for kind in [Kind::Uniform, Kind::Log, Kind::LogNormalised] {
                let table = Table::closed(&exact, kind, [n, n, 16], longest).unwrap();
                hold(format!("{kind:?}"), table.bound(&exact), &|f, b, l| table.look_up(f, b, l));
            }
            for degree in [1, 2, 4] {
                let table = Polynomial::closed(&exact, degree, n, longest).unwrap();
                hold(format!("degree {degree}"), table.bound(&exact), &|f, b, l| table.look_up(f, b, l));
            }
        }
    }
    // Nor are all bounds idle.
    assert!(shares.len() > 60 && shares.iter().any(|&s| s > 0.1), "{shares:.2?}");
}
