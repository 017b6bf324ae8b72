use super::*;
use crate::integral::MOST_OF_PART;
use crate::mesh::generate::Random;
use fearless_simd::{Level, dispatch};

/// A stretch along which opacity is a line of the value: from `opacity[0]` at 0 to `opacity[1]` at 1.
#[derive(Clone, Copy)]
struct Logarithm {
    opacity: [f64; 2],
    unit: f64,
    /// The value as Bernstein coefficients, in [0, 1].
    value: [f64; 4],
    length: f64,
    color: [f64; 2],
}

impl Logarithm {
    fn random(random: &mut Random) -> Self {
        let mut share = || (random.next() >> 11) as f64 / (1_u64 << 53) as f64;
        let first = [0.0, 1e-4, 0.02, 0.5, 0.97][(5.0 * share()) as usize];
        let last = first + MOST_OF_PART * (1.0 - first) * share();
        let width = [1e-3, 0.1, 0.5, 1.0][(4.0 * share()) as usize];
        let low = (1.0 - width) * share();
        let unit = [0.01, 1.0, 30.0][(3.0 * share()) as usize];
        Logarithm {
            opacity: [first, last],
            unit,
            value: [0; 4].map(|_| low + width * share()),
            length: 0.9 * share() * unit / -(-last).ln_1p(),
            color: [share(), share()],
        }
    }

    /// Opacity and colour, as sums over small steps.
    fn truth(&self, direct: bool) -> [f64; 2] {
        const STEPS: usize = 4000;
        let (mut color, mut depth, h) = (0.0, 0.0, 1.0 / STEPS as f64);
        for i in 0..STEPS {
            let u = (i as f64 + 0.5) * h;
            let [a, b, c, d] = self.value;
            let v = 1.0 - u;
            let s = a * v * v * v + 3.0 * b * v * v * u + 3.0 * c * v * u * u + d * u * u * u;
            let opacity = self.opacity[0] + (self.opacity[1] - self.opacity[0]) * s;
            let own = -(-opacity).ln_1p() / self.unit * self.length * h;
            let shown = self.color[0] + (self.color[1] - self.color[0]) * s;
            let weight =
                if direct { (-(depth + own / 2.0)).exp() * self.length * h } else { (-depth).exp() * -(-own).exp_m1() };
            color += weight * shown;
            depth += own;
        }
        [-(-depth).exp_m1(), color]
    }
}

/// What lanes make of eight, and which are too bent for them.
#[inline(always)]
fn lanes<S: Simd>(simd: S, all: &[Logarithm; LANES], direct: bool) -> ([[f32; LANES]; 2], u64) {
    let row = |of: &dyn Fn(&Logarithm) -> f64| f32x8::load_array(simd, all.each_ref().map(|one| of(one) as f32));
    let zero = f32x8::splat(simd, 0.0);
    let stretch = Stretch {
        offset: row(&|one| one.value[0]),
        rise: [
            row(&|one| 3.0 * (one.value[1] - one.value[0])),
            row(&|one| 3.0 * (one.value[0] - 2.0 * one.value[1] + one.value[2])),
            row(&|one| one.value[3] - 3.0 * one.value[2] + 3.0 * one.value[1] - one.value[0]),
        ],
        length: row(&|one| one.length),
        value: [row(&|one| -(-one.opacity[0]).ln_1p() / one.unit), row(&|one| one.color[0]), zero, zero],
        slope: [
            row(&|one| (one.opacity[1] - one.opacity[0]) / (1.0 - one.opacity[0]) / one.unit),
            row(&|one| one.color[1] - one.color[0]),
            zero,
            zero,
        ],
        curve: row(&|one| (one.opacity[1] - one.opacity[0]) / (1.0 - one.opacity[0])),
    };
    let light = stretch.integrate_logarithm(simd, direct);
    ([light.alpha.into(), light.color[0].into()], stretch.is_bent(simd).to_bitmask())
}

#[test]
fn logarithms_of_lines_are_integrated() {
    let mut random = Random(7);
    let mut seen = 0;
    for round in 0..500 {
        let (all, direct) = ([0; LANES].map(|_| Logarithm::random(&mut random)), round % 2 == 1);
        let (got, bent) = dispatch!(Level::new(), simd => lanes(simd, &all, direct));
        for (l, one) in all.iter().enumerate().filter(|(l, _)| bent >> l & 1 == 0) {
            seen += 1;
            let want = one.truth(direct);
            let scale = if direct { one.length.max(1.0) } else { 1.0 };
            for k in 0..2 {
                let error = (f64::from(got[k][l]) - want[k]).abs() / scale;
                // Colours that change much along a bent stretch: the rule's five points, with any extinction.
                assert!(
                    error < [1e-6, 1.5e-5][k],
                    "{}: {} instead of {}, {round}",
                    ["opacity", "colour"][k],
                    got[k][l],
                    want[k]
                );
            }
        }
    }
    assert!(seen > 1000);
}
