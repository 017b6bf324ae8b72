//! Pieces against their integrals, and segments against sums of many short ones.

use super::*;
use crate::transfer::Convention;

/// α, β, Ψ and Φ by many Gauss panels in f64.
fn truth(x: f64, y: f64) -> [f64; 4] {
    let n = 10_000;
    let mut sum = [0.0; 3];
    for p in 0..n {
        for [node, weight] in GAUSS_6 {
            // Panels shrink towards u = 0, where e^{−T} falls fastest when x is great.
            let (a, b) = ((p as f64 / n as f64).powi(4), ((p + 1) as f64 / n as f64).powi(4));
            let u = a + (b - a) * node;
            let (slope, e) = (x + (y - x) * u, (-(x * u + (y - x) * u * u / 2.0)).exp());
            for (s, v) in sum.iter_mut().zip([u * slope * e, e, u * e]) {
                *s += v * weight * (b - a);
            }
        }
    }
    [-(-(x + y) / 2.0).exp_m1(), sum[0], sum[1], sum[2]]
}

#[test]
fn pieces_match_their_integrals() {
    let depths = [
        0.0, 1e-30, 1e-12, 1e-6, 1e-3, 0.03, 0.2, 0.24, 0.26, 0.41, 0.9, 1.0, 1.01, 2.0, 3.9, 4.1, 9.0, 17.0, 40.0,
        300.0,
    ];
    for x in depths {
        for y in depths {
            let [alpha, beta, psi, phi] = truth(x, y);
            let near = |got: f32, want: f64, what: &str| {
                let error = (f64::from(got) - want).abs();
                assert!(
                    error <= 1e-6 && error <= 1e-5 * alpha.max(1e-300) + 2e-7 * want,
                    "{what} at {x}, {y}: {got}, not {want}"
                );
            };
            let p = Piece::new(x as f32, y as f32, false);
            near(p.alpha, alpha, "alpha");
            near(p.back, beta, "beta");
            near(p.front, alpha - beta, "alpha - beta");
            let p = Piece::new(x as f32, y as f32, true);
            for (got, want) in [(p.front, psi - phi), (p.back, phi)] {
                assert!((f64::from(got) - want).abs() <= 1e-6, "direct at {x}, {y}: {got}, not {want}");
            }
        }
    }
}

#[test]
fn limits_are_finite() {
    for x in [0.0, f32::MIN_POSITIVE, 1e-38, 1.0, 1e6, 4e15] {
        for y in [0.0, f32::MIN_POSITIVE, 1e-38, 1.0, 1e6, 4e15] {
            for direct in [false, true] {
                let p = Piece::new(x, y, direct);
                assert!(p.alpha >= 0.0 && p.alpha <= 1.0, "{x} {y} {p:?}");
                assert!(p.front >= 0.0 && p.front <= 1.0 && p.back >= 0.0 && p.back <= 1.0, "{x} {y} {p:?}");
            }
        }
    }
}

fn exact<R: Real>(transfer: &TransferFunction, kind: Kind) -> Exact<R> {
    Exact::new(transfer, kind, &[Normalization { mid: 0.0, half: 1.0 }; 4], 1.0)
}

fn tent() -> TransferFunction {
    let color = vec![(-1.0, [1.0, 0.0, 0.5]), (0.3, [0.2, 0.9, 0.1]), (1.0, [0.0, 0.4, 1.0])];
    TransferFunction::new(color, vec![(-0.5, 0.0), (0.1, 0.8), (0.1, 0.3), (0.6, 0.0)], 0.5).unwrap()
}

/// The integral by 200,000 midpoint steps.
fn marched(transfer: &TransferFunction, front: f64, back: f64, length: f64) -> Light<f64> {
    let n = 200_000;
    let mut light = Light::none();
    for i in 0..n {
        let s = front + (back - front) * (i as f64 + 0.5) / n as f64;
        let (c, t) = (transfer.color_at(s), transfer.extinction(transfer.opacity_at(s)) * length / n as f64);
        let alpha = -(-t).exp_m1();
        for (sum, c) in light.color.iter_mut().zip(c) {
            *sum += light.transmittance * alpha * c;
        }
        light.transmittance *= 1.0 - alpha;
    }
    light
}

#[test]
fn segments_are_split_at_knots() {
    let transfer = tent();
    let (fast, slow) = (exact::<f32>(&transfer, Kind::Scalar), exact::<f64>(&transfer, Kind::Scalar));
    for (f, b, l) in
        [(-1.0, 1.0, 2.0), (1.0, -1.0, 0.7), (-0.2, 0.3, 1.0), (0.1, 0.1, 3.0), (0.1, 0.0, 1.0), (0.9, 0.95, 5.0)]
    {
        let want = marched(&transfer, f, b, l);
        let mut got = Light::<f64>::none();
        slow.add(&[f], &[b], l, &mut got);
        let mut quick = Light::<f32>::none();
        fast.add(&[f as f32], &[b as f32], l as f32, &mut quick);
        for k in 0..3 {
            assert!((got.color[k] - want.color[k]).abs() < 1e-6, "{f} {b} {l}: {got:?}, not {want:?}");
            assert!((f64::from(quick.color[k]) - want.color[k]).abs() < 2e-6, "{f} {b} {l}: {quick:?}, not {want:?}");
        }
        assert!((got.transmittance - want.transmittance).abs() < 1e-6);
        assert!((f64::from(quick.transmittance) - want.transmittance).abs() < 2e-6);
    }
}

#[test]
fn pairs_and_rgba_agree_with_the_scalar_they_repeat() {
    let transfer = tent();
    let (scalar, pair) = (exact::<f64>(&transfer, Kind::Scalar), exact::<f64>(&transfer, Kind::Pair));
    let (mut a, mut b) = (Light::none(), Light::none());
    scalar.add(&[-0.8], &[0.9], 1.3, &mut a);
    pair.add(&[-0.8, -0.8], &[0.9, 0.9], 1.3, &mut b);
    for k in 0..3 {
        assert!((a.color[k] - b.color[k]).abs() < 1e-7);
    }
    let white = TransferFunction::new(vec![(0.0, [0.25, 0.5, 0.75])], transfer.opacity().to_vec(), 0.5).unwrap();
    let (scalar, rgba) = (exact::<f64>(&white, Kind::Scalar), exact::<f64>(&white, Kind::Rgba));
    let (mut a, mut b) = (Light::none(), Light::none());
    scalar.add(&[-0.8], &[0.9], 1.3, &mut a);
    rgba.add(&[0.25, 0.5, 0.75, -0.8], &[0.25, 0.5, 0.75, 0.9], 1.3, &mut b);
    for k in 0..3 {
        assert!((a.color[k] - b.color[k]).abs() < 1e-7);
    }
}

#[test]
fn a_stretch_of_opacity_1_ends_the_ray_and_a_point_does_not() {
    let color = vec![(-1.0, [1.0, 0.0, 0.0]), (1.0, [0.0, 1.0, 0.0])];
    let make = |opacity: &[(f64, f64)]| {
        let t = TransferFunction::new(color.clone(), opacity.to_vec(), 1e6).unwrap();
        exact::<f32>(&t.with_convention(Convention::Opacity), Kind::Scalar)
    };
    let through = |exact: &Exact<f32>, f: f32, b: f32| {
        let mut light = Light::<f32>::none();
        exact.add(&[f], &[b], 1e-4, &mut light);
        light
    };
    let stretches = [
        make(&[(-1.0, 0.0), (0.2, 1.0), (0.3, 1.0), (1.0, 0.0)]),
        make(&[(-1.0, 0.0), (0.0, 0.0), (0.4, 2.0), (0.401, 0.0)]),
    ];
    for exact in &stretches {
        for (f, b) in [(-0.9, 0.9), (0.9, -0.9), (0.25, 0.25), (0.21, 0.22)] {
            let light = through(exact, f, b);
            assert!(light.transmittance < 1e-6, "{f} to {b} lets {} through", light.transmittance);
        }
        assert!(through(exact, -0.9, 0.1).transmittance > 0.99);
    }
    let point = make(&[(-1.0, 0.0), (0.2, 1.0), (1.0, 0.0)]);
    assert!(through(&point, -0.9, 0.9).transmittance > 0.99);
    assert!(through(&point, 0.2, 0.2).transmittance < 1e-6, "a constant field at the point is a stretch");
    let outside = make(&[(-0.5, 1.0), (0.0, 0.0), (0.5, 1.0)]);
    for (f, b) in [(-0.9, -0.8), (0.6, 0.7), (0.9, -0.9)] {
        assert!(through(&outside, f, b).transmittance < 1e-6);
    }
}

#[test]
fn invisible_and_empty_segments_add_nothing() {
    let exact = exact::<f32>(&tent(), Kind::Scalar);
    for (f, b) in [(f32::NAN, 0.0), (0.0, f32::INFINITY), (0.7, 0.9), (-1.0, -0.6)] {
        let mut light = Light::none();
        exact.add(&[f], &[b], 1.0, &mut light);
        assert_eq!(light, Light::none());
    }
}
