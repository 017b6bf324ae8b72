//! Segments side by side against the same ones one by one.

use super::*;
use crate::integral::Light;
use crate::integral::floats::LANES;
use crate::integral::options::Two;
use crate::integral::second::{Scratch, Segment};
use crate::transfer::bivariate::{OPEN, Sine, Wave, Widget as Shown};
use crate::transfer::shading::{Highlight, Light as Lamp, Shade};
use crate::transfer::{Bivariate, Emission, TransferFunction};
use fearless_simd::{Level, dispatch};
use glam::DVec3;

struct Random(u64);

impl Random {
    fn within(&mut self, lo: f64, hi: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        lo + (hi - lo) * (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

fn functions() -> Vec<(&'static str, TransferFunction)> {
    let widget = |shape, color| Shown { shape, color, opacity: 0.7, domain: OPEN };
    let of = |all: Vec<Shown>| TransferFunction::of_two(Bivariate::default().with_widgets(all).unwrap(), 0.3).unwrap();
    let gaussian = || widget(Shape::Gaussian { center: [0.2, -0.1], sigma: [0.2, 0.3] }, [0.2, 0.8, 0.3]);
    let wave = |period, floor| Wave { axis: [1.0, -0.4], start: 0.13, period, floor };
    let boxed = Shown { domain: [[-0.3, 0.4], [-0.2, f64::INFINITY]], ..widget(Shape::Uniform, [0.9, 0.5, 0.2]) };
    let triangle = |floor| widget(Shape::Triangle(wave(0.5, floor)), [0.3, 0.5, 1.0]);
    let sine = |kind, floor| widget(Shape::Sinusoid(wave(0.4, floor), kind), [1.0, 0.4, 0.8]);
    let mix = || vec![gaussian(), triangle(0.0), sine(Sine::Abs, 0.0), boxed.clone()];
    let color = vec![(-0.6, [0.1, 0.2, 0.9]), (0.2, [0.1, 0.9, 0.4]), (0.9, [1.0, 0.3, 0.1])];
    let opacity = vec![(-0.6, 0.4), (-0.2, 0.0), (0.0, 0.0), (0.2, 0.8), (0.2, 0.1), (0.9, 0.6)];
    let knots = || TransferFunction::new(color.clone(), opacity.clone(), 0.3).unwrap();
    let h = |b: Bivariate| b.with_gradient_opacity(vec![(-0.5, 0.1), (0.0, 1.0), (0.0, 0.3), (0.7, 1.2)]).unwrap();
    let texel =
        |i: usize| [(i % 7) as f64 / 7.0, 0.5, (i % 5) as f64 / 5.0, if i.is_multiple_of(3) { 0.0 } else { 0.6 }];
    let table = || Table::new([7, 5], (0..35).map(texel).collect(), [[-0.7, 0.9], [-0.8, 0.8]]).unwrap();
    let direct = |t: TransferFunction| t.with_emission(Emission::Direct { scale: 0.4 }).unwrap();
    let logarithmic = |t: TransferFunction| t.with_convention(Convention::Opacity);
    let shade =
        |power, two_sided, highlight| Shade { ambient: 0.2, diffuse: 0.7, specular: 0.5, power, two_sided, highlight };
    let lamp = |origin| Lamp { origin, color: [1.0, 0.7, 0.4], intensity: 0.9, ..Lamp::default() };
    let lit = |t: TransferFunction, shade, origins: &[Origin]| {
        let lamps = origins.iter().map(|&o| lamp(o)).collect();
        t.with_shading(Shading::default().with_lights(shade, lamps).unwrap())
    };
    let far = Origin::Direction(DVec3::new(-1.0, -2.0, 0.5));
    let silhouette = |t: TransferFunction| t.with_shading(Shading::default().with_silhouette(3.0).unwrap());
    vec![
        ("gaussian", of(vec![gaussian()])),
        ("gaussian, direct", direct(of(vec![gaussian()]))),
        ("gaussian, opacity", logarithmic(of(vec![gaussian()]))),
        ("box", of(vec![boxed.clone()])),
        ("triangle", of(vec![triangle(0.0)])),
        ("peaks", of(vec![triangle(0.6), sine(Sine::Abs, 0.5)])),
        ("sines", of(vec![sine(Sine::Positive, 0.0), sine(Sine::Raised, 0.3)])),
        ("mix", of(mix())),
        ("mix, direct", direct(of(mix()))),
        ("mix, opacity", logarithmic(of(mix()))),
        ("table", TransferFunction::of_two(Bivariate::default().with_table(table()), 0.3).unwrap()),
        (
            "table with h(g), direct",
            direct(TransferFunction::of_two(h(Bivariate::default().with_table(table())), 0.3).unwrap()),
        ),
        ("h(g)", knots().with_bivariate(h(Bivariate::default()))),
        ("h(g), opacity", logarithmic(knots().with_bivariate(h(Bivariate::default())))),
        ("headlight", lit(knots(), shade(20.0, true, Highlight::Half), &[Origin::Headlight])),
        ("one side", lit(of(mix()), shade(7.5, false, Highlight::Half), &[Origin::Headlight, far])),
        ("reflected", direct(lit(of(vec![gaussian()]), shade(10.0, true, Highlight::Reflected), &[far]))),
        ("silhouette", silhouette(of(mix()))),
        ("silhouette of knots", silhouette(knots())),
    ]
}

/// Of cells of all sizes, with sixteen segments in each.
#[test]
fn side_by_side_is_one_by_one() {
    let normal = [Normalization { mid: 0.1, half: 0.8 }, Normalization { mid: -0.05, half: 1.1 }];
    for (name, transfer) in functions() {
        let second = Second::new(&transfer, normal, DVec3::ZERO, 1.0, Two::default());
        let wide = second.wide();
        let mut random = Random(9);
        let (mut left, mut worst) = (0, 0.0_f64);
        for round in 0..400 {
            let size = 10_f64.powf(random.within(-2.5, 0.0));
            let middle: [f64; 5] = std::array::from_fn(|_| random.within(-0.8, 0.8));
            let corners: [[f32; 5]; 4] =
                std::array::from_fn(|_| middle.map(|m| (m + size * random.within(-0.5, 0.5)) as f32));
            let span: [[f32; 2]; 5] = std::array::from_fn(|k| {
                let of = corners.map(|c| c[k]);
                [of.into_iter().fold(f32::INFINITY, f32::min), of.into_iter().fold(f32::NEG_INFINITY, f32::max)]
            });
            let mut ends = [[[0.0_f32; LANES]; 5]; 2];
            for (end, l) in (0..2).flat_map(|end| (0..LANES).map(move |l| (end, l))) {
                let weights: [f64; 4] = std::array::from_fn(|_| -random.within(1e-9, 1.0).ln());
                let sum: f64 = weights.iter().sum();
                for k in 0..5 {
                    let v: f64 = (0..4).map(|i| weights[i] / sum * f64::from(corners[i][k])).sum();
                    ends[end][k][l] = (v as f32).clamp(span[k][0], span[k][1]);
                }
            }
            let length: [f32; LANES] = std::array::from_fn(|_| (0.3 * size * random.within(0.01, 1.0)) as f32);
            let along = DVec3::new(random.within(-1.0, 1.0), random.within(-1.0, 1.0), 1.0).normalize();
            let (cell, densest) = wide.cell(&span);
            let (lit, count) = (transfer.shading().is_some(), if round % 3 == 0 { 11 } else { LANES });
            // From some place in a row on, as segments of cells lie there.
            let mut room = Room::default();
            let rows = [Row::<5>::AT, Row::<5>::RISE, Row::<5>::LENGTH, Row::<5>::ALONG];
            let of_two = [Row::<2>::AT, Row::<2>::RISE, Row::<2>::LENGTH, Row::<2>::ALONG];
            let [at, rise, of_length, of_along] = if lit { rows } else { of_two };
            for l in 0..count {
                for k in 0..if lit { 5 } else { 2 } {
                    room.rows[at + k][37 + l] = ends[0][k][l];
                    room.rows[rise + k][37 + l] = ends[1][k][l] - ends[0][k][l];
                }
                room.rows[of_length][37 + l] = length[l];
                along.to_array().iter().enumerate().for_each(|(k, x)| room.rows[of_along + k][37 + l] = *x as f32);
            }
            let (mut kept, there) = (u64::MAX >> (64 - count), u64::MAX >> (64 - count));
            let range = [37, 37 + count];
            dispatch!(Level::new(), simd => {
                let mut leave = |i: usize| kept &= !(1 << (i - 37));
                match lit {
                    true => wide.integrate::<_, 5>(simd, &cell, &mut room, range, &mut leave),
                    false => wide.integrate::<_, 2>(simd, &cell, &mut room, range, &mut leave),
                }
            });
            let color = [0, 1, 2].map(|k| *window(&room.rows[k], 37));
            let alpha = *window(&room.rows[3], 37);
            left += (there & !kept).count_ones();
            for l in (0..count).filter(|l| kept >> l & 1 == 1) {
                let values = |end: usize| -> [f64; 5] { std::array::from_fn(|k| f64::from(ends[end][k][l])) };
                let segment =
                    Segment::new(&second, &values(0), &values(1), DVec3::ZERO, along, f64::from(length[l])).unwrap();
                let (mut light, mut scratch) = (Light::none(), Scratch::default());
                second.add(&segment, &mut scratch, &mut light);
                let wanted = [light.color[0], light.color[1], light.color[2], 1.0 - light.transmittance];
                let got = [color[0][l], color[1][l], color[2][l], alpha[l]];
                let error = (0..4).map(|c| f64::from((got[c] - wanted[c]).abs())).fold(0.0, f64::max);
                // Of values that f32 rounds, before and after.
                assert!(error <= 1.5e-5, "{name}, size {size}: {got:?} is not {wanted:?}: {segment:?}");
                worst = worst.max(error);
                let depth = -(-f64::from(wanted[3])).ln_1p();
                assert!(depth <= f64::from(densest * length[l]) * 1.001 + 1e-6, "{name}: {depth} is deeper than known");
            }
        }
        assert!(worst > 0.0, "{name}: something is compared");
        let most = if name.ends_with("opacity") { 3000 } else { 400 };
        assert!(left < most, "{name}: {left} of 5730 segments are left");
    }
}
