//! The tables of the papers, made again: `cargo bench --bench papers` prints them beside what the papers report, and
//! `cargo bench --bench papers -- bits`, `sizes`, `polynomials` or `targets` one part. What would take more than a
//! minute, going by what the same took for a smaller table, is left out, and that is said.
//!
//! Numbers of the papers are those of their machines of 2002: Röttger & Ertl, "A Two-Step Approach for Interactive
//! Pre-Integrated Volume Rendering of Unstructured Grids", and Guthe, Röttger, Schieber, Straßer & Ertl, "High-Quality
//! Unstructured Volume Rendering on the PC Platform". Their functions are not published: these are bands and random
//! entries like those that they draw.

#![allow(clippy::expect_used, clippy::print_stdout, reason = "a benchmark that cannot start has nothing to tell")]

use halite::field::{Kind as FieldKind, Normalization};
use halite::gpu::DeviceChoice;
use halite::gpu::construct::{Construction, Constructor};
use halite::integral::Exact;
use halite::integral::table::{Kind, Linear, Polynomial, Sampling, Steps, Table};
use halite::reference;
use halite::transfer::TransferFunction;
use rayon::prelude::*;
use std::time::Instant;

const NORMAL: [Normalization; 4] = [Normalization { mid: 0.0, half: 1.0 }; 4];

/// Lengths of segments reach this far; extinctions are up to 4.
const LONGEST: f64 = 2.0;

/// A function of `m` entries: smooth noise in colour and opacity, a band wide for every eight entries.
fn function(m: u32) -> TransferFunction {
    let mut seed = 2002u64;
    let mut unit = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 53) as f64
    };
    let s = |i: u32| -1.0 + 2.0 * f64::from(i) / f64::from(m - 1);
    let opacity = (0..m).map(|i| (s(i), if i / 8 % 2 == 0 { 4.0 * unit() } else { 0.3 * unit() })).collect();
    let color = (0..m).map(|i| (s(i), [unit(), unit(), unit()])).collect();
    TransferFunction::new(color, opacity, 1.0).expect("a valid function")
}

fn exact(transfer: &TransferFunction) -> Exact<f64> {
    Exact::new(transfer, FieldKind::Scalar, &NORMAL, 1.0)
}

/// What one table may take, in seconds, going by a smaller one.
const BEARABLE: f64 = 60.0;

/// What some runs took, in seconds.
struct Took {
    best: f64,
    median: f64,
    /// Of all processors, on average; 0 where the system does not say.
    processors: f64,
}

/// Some runs; one where that takes long.
fn took<T>(most: usize, mut work: impl FnMut() -> T) -> Took {
    let (mut times, begun, before) = (vec![], Instant::now(), processor_seconds());
    while times.is_empty() || (times.len() < most && begun.elapsed().as_secs_f64() < 3.0) {
        let start = Instant::now();
        std::hint::black_box(work());
        times.push(start.elapsed().as_secs_f64());
    }
    let processors = (processor_seconds() - before) / times.len() as f64;
    Took { best: times.iter().fold(f64::INFINITY, |m, &t| m.min(t)), median: median(times), processors }
}

/// The median of some runs, in seconds.
fn seconds<T>(work: impl FnMut() -> T) -> f64 {
    took(9, work).median
}

/// What all threads took of processors so far, in seconds, where Linux counts it.
fn processor_seconds() -> f64 {
    let Ok(threads) = std::fs::read_dir("/proc/self/task") else { return 0.0 };
    let of = |path: std::path::PathBuf| -> Option<f64> {
        let text = std::fs::read_to_string(path.join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse().ok()
    };
    threads.flatten().filter_map(|t| of(t.path())).sum::<f64>() * 1e-9
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// The same for what a device says that it took.
fn seconds_of(mut work: impl FnMut() -> f64) -> f64 {
    let (mut times, begun) = (vec![], Instant::now());
    while times.is_empty() || (times.len() < 5 && begun.elapsed().as_secs_f64() < 3.0) {
        times.push(work() / 1e3);
    }
    median(times)
}

/// The root mean square and the greatest difference of all texels and channels.
fn apart(got: &[[f32; 4]], want: &[[f32; 4]]) -> [f64; 2] {
    let [sum, most] = got.iter().zip(want).fold([0.0, 0.0f64], |[sum, most], (g, w)| {
        let d = [0, 1, 2, 3].map(|k| f64::from(g[k] - w[k]).abs());
        [sum + d.iter().map(|d| d * d).sum::<f64>(), d.iter().fold(most, |m, &d| m.max(d))]
    });
    [(sum / (4 * want.len()) as f64).sqrt(), most]
}

/// The root mean square error of some thousand texels against adaptive integration.
fn rms_error(transfer: &TransferFunction, table: &Table) -> f64 {
    let [w, h, n] = table.size;
    let sum: f64 = (0..2000u32)
        .into_par_iter()
        .map(|i| {
            let [x, y, z] = [0.819_172_513, 0.671_043_607, 0.549_700_478].map(|s| (0.5 + s * f64::from(i)).fract());
            let at = |x: f64, n: u32| (x * f64::from(n)) as u32;
            let (i, j, k) = (at(x, w), at(y, h), at(z, n));
            let value = |i: u32, n: u32| -1.0 + 2.0 * f64::from(i) / f64::from(n - 1);
            let l = halite::integral::table::length(table.kind, n, table.longest, k);
            let want = reference::segment(transfer, value(i, w), value(j, h), l);
            let got = table.texels[((k * h + j) * w + i) as usize];
            (0..4).map(|c| (f64::from(got[c]) - want[c]).powi(2)).sum::<f64>()
        })
        .sum();
    (sum / 8000.0).sqrt()
}

fn device(transfer: &TransferFunction) -> Option<Constructor> {
    let choice = DeviceChoice::parse(&std::env::var("HALITE_TEST_DEVICE").unwrap_or_else(|_| "0".into()));
    Constructor::open(&choice, transfer, &NORMAL, 1.0).ok().flatten()
}

/// Röttger & Ertl, table 1: RMS and greatest error by steps and bits.
fn errors_by_bits() {
    const PUBLISHED: [(u32, u32, f64, f64); 10] = [
        (12, 32, 0.1348, 13.9828),
        (12, 64, 0.1515, 13.9661),
        (12, 128, 0.2445, 13.8732),
        (12, 256, 0.4565, 14.4455),
        (12, 512, 0.9102, 19.8741),
        (12, 1024, 1.8131, 24.0693),
        (8, 32, 1.1050, 18.5028),
        (8, 64, 2.0477, 27.3640),
        (8, 128, 3.4929, 43.9580),
        (8, 256, 5.0901, 70.5962),
    ];
    let exact = exact(&function(64));
    let size = [64, 64, 32];
    let sampled = |sampling| Table::sampled(&exact, Kind::Uniform, size, LONGEST, sampling).expect("a table");
    let software = sampled(Sampling::touched(64, 2.0));
    let closed = Table::closed(&exact, Kind::Uniform, size, LONGEST).expect("a table");
    println!("\nErrors of slices integrated in parallel, 64 entries, 64x64x32, against the software's integration");
    println!("(Roettger & Ertl 2002, table 1; last: in floats, and against the closed form)\n");
    println!("bits steps   RMS paper    here     max paper    here     float RMS   float, exact RMS");
    for (bits, steps, rms, max) in PUBLISHED {
        let with = |bits| sampled(Sampling { entries: 64, steps: Steps::Same(steps), bits });
        let [of_bits, most] = apart(&with(Some(bits)).texels, &software.texels);
        let floats = with(None);
        let ([of_floats, _], [of_exact, _]) =
            (apart(&floats.texels, &software.texels), apart(&floats.texels, &closed.texels));
        println!(
            "{bits:>4} {steps:>5}   {rms:>7.4} % {:>7.4} %  {max:>7.3} % {:>7.3} %   {:>7.4} %   {:>7.4} %",
            1e2 * of_bits,
            1e2 * most,
            1e2 * of_floats,
            1e2 * of_exact
        );
    }
}

/// Röttger & Ertl, table 2: seconds by size.
fn seconds_by_size() {
    println!(
        "\nSeconds to build a volume (Roettger & Ertl 2002, table 2), and RMS error against adaptive integration\n"
    );
    println!("size         by                         seconds    RMS");
    // What each way took for the size before, here and on the device.
    let mut last = [[0.0; 5]; 2];
    for (size, software, hardware) in
        [([64, 64, 32], 13.499, 0.188), ([128, 128, 64], 216.204, 2.859), ([256, 256, 128], 3413.444, 35.550)]
    {
        let [m, _, steps] = size;
        let transfer = function(m);
        let exact = exact(&transfer);
        let name = format!("{}x{}x{}", size[0], size[1], size[2]);
        println!("{name:12} paper, software         {software:>10.4}");
        println!("{name:12} paper, hardware         {hardware:>10.4}");
        let touched = Sampling::touched(m, 1.0);
        // As many samples as the paper's hardware took, and as many as there are entries, which it says is enough.
        let [fewer, all] = [steps, m].map(|n| Sampling { entries: m, steps: Steps::Same(n), bits: None });
        let make = |how: Construction| match how {
            Construction::Closed => Table::closed(&exact, Kind::Uniform, size, LONGEST),
            Construction::Incremental => Table::incremental(&exact, Kind::Uniform, size, LONGEST),
            Construction::Sampled(sampling) => Table::sampled(&exact, Kind::Uniform, size, LONGEST, sampling),
        };
        let ways = [
            ("closed form", Construction::Closed),
            ("incremental", Construction::Incremental),
            ("software", Construction::Sampled(touched)),
            ("slices, as many steps", Construction::Sampled(fewer)),
            ("slices, o = 1", Construction::Sampled(all)),
        ];
        let mut table = Table::closed(&exact, Kind::Uniform, size, LONGEST).expect("a table");
        let time = seconds(|| table.rebuild(&exact));
        println!("{name:12} {:23} {time:>10.4}    {:.1e}", "closed form, in place", rms_error(&transfer, &table));
        let device = device(&transfer);
        let places = std::iter::once(None).chain(device.as_ref().map(Some));
        for (device, last) in places.zip(&mut last) {
            let on = device.map_or(String::new(), |d| format!("  {}", d.name()));
            for ((way, how), last) in ways.into_iter().zip(last) {
                // Of the next size there are 8 times as many texels, of twice as many samples.
                let expected = *last * if matches!(how, Construction::Sampled(_)) { 16.0 } else { 8.0 };
                if expected > BEARABLE {
                    println!("{name:12} {way:23}   left out: some {expected:.0} s, going by the size before{on}");
                    *last = expected;
                    continue;
                }
                let mut made = None;
                *last = match device {
                    None => seconds(|| made = make(how)),
                    Some(device) => seconds_of(|| {
                        let built = device.volume(Kind::Uniform, size, LONGEST, how).expect("a device");
                        let (table, ms) = built.expect("a table");
                        made = Some(table);
                        ms
                    }),
                };
                let rms = rms_error(&transfer, &made.expect("a table"));
                println!("{name:12} {way:23} {last:>10.4}    {rms:.1e}{on}");
            }
        }
    }
}

/// Guthe et al., table 4: seconds at 512².
fn seconds_of_polynomials() {
    println!("\nSeconds to build polynomials, 512x512 (Guthe et al. 2002, table 4; Pentium 4, Radeon 8500)\n");
    println!("degree   paper, software   paper, hardware   f64, exact    closed form   device");
    let transfer = function(256);
    let exact = exact(&transfer);
    let device = device(&transfer);
    for (degree, software, hardware) in [(1, 4.4, 0.6), (2, 6.6, 1.0), (4, 11.0, 1.7)] {
        let slow = seconds(|| Polynomial::new(&exact, degree, 512, LONGEST));
        let fast = seconds(|| Polynomial::closed(&exact, degree, 512, LONGEST));
        let of_device = device
            .as_ref()
            .map(|d| seconds_of(|| d.polynomial(degree, 512, LONGEST).expect("a device").map_or(0.0, |(_, ms)| ms)));
        let of_device = of_device.map_or("none".into(), |s| format!("{s:.4}"));
        println!("{degree:>6} {software:>17.1} {hardware:>17.1} {slow:>12.4} {fast:>14.4}   {of_device}");
    }
    let [a, b] = [1, 2].map(|degree| Polynomial::closed(&exact, degree, 512, LONGEST).expect("a table"));
    let linear = Linear::closed(&exact, 512, LONGEST).expect("a table");
    let mut sums = [0.0; 3];
    for i in 0..4000u32 {
        let [f, b_, l] = [0.819_172_513, 0.671_043_607, 0.549_700_478].map(|s| (0.5 + s * f64::from(i)).fract());
        let (f, b_, l) = (2.0 * f - 1.0, 2.0 * b_ - 1.0, l * LONGEST);
        let want = reference::segment(&transfer, f, b_, l);
        for (sum, got) in sums.iter_mut().zip([linear.look_up(f, b_, l), a.look_up(f, b_, l), b.look_up(f, b_, l)]) {
            *sum += (0..4).map(|c| (got[c] - want[c]).powi(2)).sum::<f64>() / 16_000.0;
        }
    }
    let [linear, one, two] = sums.map(f64::sqrt);
    println!(
        "\nRMS error between texels: opacity linear in length {linear:.1e}, degree 1 {one:.1e}, degree 2 {two:.1e}"
    );
}

/// What Halite itself asks for: 256 entries, to an RMS error of 1e-3, within 100 ms and 20 ms on two cores.
fn targets() {
    println!("\nClosed form on the CPU, 256 entries (asked for: 0.1 s of the volume, 0.02 s of degree 2)");
    println!(
        "(new, and in the memory of the table before; seconds: the best and the median, and those of all processors)\n"
    );
    println!("table                  new: best   median     CPU     in place: best   median     CPU   RMS of texels");
    let transfer = function(256);
    let exact = exact(&transfer);
    let row = |name: &str, fresh: Took, again: Took, rms: String| {
        let Took { best, median, processors } = fresh;
        let times = format!("{best:>8.4} {median:>8.4} {processors:>8.4}");
        let Took { best, median, processors } = again;
        println!("{name:22} {times}         {best:>8.4} {median:>8.4} {processors:>8.4}   {rms}");
    };
    let size = [256, 256, 128];
    let fresh = took(25, || Table::closed(&exact, Kind::Uniform, size, LONGEST));
    let mut table = Table::closed(&exact, Kind::Uniform, size, LONGEST).expect("a table");
    let again = took(25, || table.rebuild(&exact));
    row("volume 256x256x128", fresh, again, format!("{:.1e}", rms_error(&transfer, &table)));
    for degree in [1, 2, 4] {
        let fresh = took(50, || Polynomial::closed(&exact, degree, 512, LONGEST));
        let mut table = Polynomial::closed(&exact, degree, 512, LONGEST).expect("a table");
        let again = took(50, || table.rebuild(&exact));
        row(
            &format!("512x512, degree {degree}"),
            fresh,
            again,
            format!("{:.1e}", judged_polynomial(&transfer, &table)),
        );
    }
}

/// The root mean square error of some thousand texels of polynomials against adaptive integration, at the lengths of
/// their points.
fn judged_polynomial(transfer: &TransferFunction, table: &Polynomial) -> f64 {
    let (n, degree) = (table.size, table.degree);
    let sum: f64 = (0..2000u32)
        .into_par_iter()
        .map(|i| {
            let [x, y, z] = [0.819_172_513, 0.671_043_607, 0.549_700_478].map(|s| (0.5 + s * f64::from(i)).fract());
            let value = |x: f64| -1.0 + 2.0 * (x * f64::from(n)).floor() / f64::from(n - 1);
            let l = table.longest * (1.0 + (z * f64::from(degree)).floor()) / f64::from(degree);
            let want = reference::segment(transfer, value(x), value(y), l);
            let got = table.look_up(value(x), value(y), l);
            (0..4).map(|c| (got[c] - want[c]).powi(2)).sum::<f64>()
        })
        .sum();
    (sum / 8000.0).sqrt()
}

fn main() {
    let chosen: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let wanted = |name: &str| chosen.is_empty() || chosen.iter().any(|c| name.contains(c.as_str()));
    if wanted("targets") {
        targets();
    }
    if wanted("bits") {
        errors_by_bits();
    }
    if wanted("polynomials") {
        seconds_of_polynomials();
    }
    if wanted("sizes") {
        seconds_by_size();
    }
}
