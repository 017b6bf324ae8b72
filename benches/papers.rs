//! scratch
#![allow(clippy::expect_used, clippy::print_stdout, reason = "a benchmark")]
use halite::field::{Kind as K, Normal};
use halite::integral::Exact;
use halite::integral::table::{Kind, Polynomial, Table};
use halite::transfer::TransferFunction;
use std::time::Instant;

fn main() {
    let mut seed = 77u64;
    let mut unit = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 53) as f64
    };
    let s = |i: i32| -1.0 + 2.0 * f64::from(i) / 255.0;
    let opacity = (0..256).map(|i| (s(i), 5.0 * unit())).collect();
    let color =
        (0..256).map(|i| (s(i), [0.3, 0.5, 1.0].map(|c| c * (0.5 + 0.5 * (0.1 * f64::from(i) * c).sin())))).collect();
    let t = TransferFunction::new(color, opacity, 1.0).expect("function");
    let exact = Exact::<f64>::new(&t, K::Scalar, &[Normal { mid: 0.0, half: 1.0 }; 4], 1.0);
    let mut times = vec![];
    for _ in 0..7 {
        let start = Instant::now();
        let t = Table::closed(&exact, Kind::Uniform, [256, 256, 128], 2.0).expect("t");
        times.push(start.elapsed().as_secs_f64() * 1e3);
        std::hint::black_box(&t.texels);
    }
    println!("256x256x128 {times:?}");
    for degree in [1, 2, 4] {
        let mut times = vec![];
        for _ in 0..9 {
            let start = Instant::now();
            let t = Polynomial::closed(&exact, degree, 512, 2.0).expect("t");
            times.push(start.elapsed().as_secs_f64() * 1e3);
            std::hint::black_box(&t.texels);
        }
        println!("512 degree {degree} {times:?}");
    }
}
