//! Second-order tables, over slabs of three samples.

use super::Row;
use anyhow::Result;
use halite::gpu::construct::Constructor;
use halite::integral::Exact;
use halite::integral::table::{SecondOrder, SecondOrderLengths, SecondOrderPolynomial, parabola};
use rayon::prelude::*;
use std::time::Instant;

/// The most texels along each axis: of tables of one length, of those of all, and of that of four parameters, with its lengths.
const MOST: [u32; 3] = [256, 64, 16];
const LENGTHS: u32 = 16;

/// Steps of the published construction.
const ITERATIONS: [(&str, u32); 3] = [("8 steps", 8), ("64 steps", 64), ("256 steps", 256)];

const DEGREES: [(&str, u32); 2] = [("second order, degree 1", 1), ("second order, degree 2", 2)];

/// A slab: its samples and its length.
type Slab = ([f64; 3], f64);

/// The tables that were built, also on a device if there is one, with so many `values` along each axis at most, and their
/// errors over `count` slabs.
pub(super) fn rows(
    exact: &Exact<f64>,
    device: Option<&Constructor>,
    longest: f64,
    values: u32,
    count: u32,
) -> Result<Vec<Row>> {
    let [n, m, few] = MOST.map(|most| most.min(values));
    let mut rows = vec![];
    let of_one = slabs(exact, count, |_| longest);
    for (construction, iterations) in ITERATIONS {
        let ways = [SecondOrder::published, SecondOrder::published_in_bytes];
        for (build, bits) in ways.into_iter().zip(["", ", 8 bits"]) {
            let start = Instant::now();
            let Some(table) = build(exact, n, longest, iterations) else { continue };
            let build_ms = start.elapsed().as_secs_f64() * 1e3;
            let row =
                row("second order, 1 length", format!("{construction}{bits}"), &of_one, |(s, _)| table.look_up(s));
            let bound = bits.is_empty().then(|| table.bound(exact));
            rows.push(Row { size: format!("{n}x{n}x{n}"), bytes: table.bytes(), build_ms, bound, ..row });
            let built = match device {
                Some(device) => device.second_order(n, longest, iterations, !bits.is_empty())?,
                None => None,
            };
            if let Some((table, build_ms)) = built {
                let construction = format!("device, {construction}{bits}");
                let row = self::row("second order, 1 length", construction, &of_one, |(s, _)| table.look_up(s));
                rows.push(Row { size: format!("{n}x{n}x{n}"), bytes: table.bytes(), build_ms, bound, ..row });
            }
        }
    }
    let of_all = slabs(exact, count, |share| longest * share);
    let start = Instant::now();
    if let Some(table) = SecondOrderLengths::new(exact, few, LENGTHS, longest) {
        let build_ms = start.elapsed().as_secs_f64() * 1e3;
        let row = row("second order, lengths", "f64".into(), &of_all, |(s, l)| table.look_up(s, l));
        rows.push(Row { size: format!("{few}x{few}x{few}x{LENGTHS}"), bytes: table.bytes(), build_ms, ..row });
    }
    for (name, degree) in DEGREES {
        let ways = [SecondOrderPolynomial::new, SecondOrderPolynomial::closed];
        for (build, construction) in ways.into_iter().zip(["f64", "closed"]) {
            let start = Instant::now();
            let Some(table) = build(exact, degree, m, longest) else { continue };
            let build_ms = start.elapsed().as_secs_f64() * 1e3;
            let row = row(name, construction.into(), &of_all, |(s, l)| table.look_up(s, l));
            let (size, bound) = (format!("{m}x{m}x{m}x{}", degree + 1), table.bound(exact));
            rows.push(Row { size, bytes: table.bytes(), build_ms, bound, ..row });
        }
        let built = match device {
            Some(device) => device.second_order_polynomial(degree, m, longest)?,
            None => None,
        };
        if let Some((table, build_ms)) = built {
            let row = row(name, "device".into(), &of_all, |(s, l)| table.look_up(s, l));
            let (size, bound) = (format!("{m}x{m}x{m}x{}", degree + 1), table.bound(exact));
            rows.push(Row { size, bytes: table.bytes(), build_ms, bound, ..row });
        }
    }
    Ok(rows)
}

/// Slabs along four additive sequences (Roberts 2018), and what they do.
fn slabs(exact: &Exact<f64>, count: u32, length: impl Fn(f64) -> f64 + Sync) -> Vec<(Slab, [f64; 4])> {
    let steps = [0.856_674_883_854_502_9, 0.733_891_856_627_126, 0.628_706_721_038_086_8, 0.538_597_257_223_612_2];
    let slab = |i: u32| {
        let [f, m, b, l] = steps.map(|s| (0.5 + s * f64::from(i)).fract());
        let (samples, length) = ([f, m, b].map(|s| 2.0 * s - 1.0), length(l));
        ((samples, length), parabola(exact, samples, length))
    };
    (0..count).into_par_iter().map(slab).collect()
}

/// A table, compared with what slabs do.
fn row(
    name: &'static str,
    construction: String,
    slabs: &[(Slab, [f64; 4])],
    look_up: impl Fn(Slab) -> [f64; 4],
) -> Row {
    let (mut sum, mut max) = (0.0, 0.0f64);
    for (slab, want) in slabs {
        for (got, want) in look_up(*slab).into_iter().zip(want) {
            let e = (got - want).abs();
            (sum, max) = (sum + e * e, max.max(e));
        }
    }
    let rms = (sum / (4 * slabs.len().max(1)) as f64).sqrt();
    Row { name, construction, size: String::new(), bound: None, bytes: 0, build_ms: 0.0, look_up: None, rms, max }
}
