//! `halite tables`: pre-integrated tables of a function.

mod second;

use anyhow::{Context, Result};
use clap::Args;
use halite::field::Kind;
use halite::geometry::TetMesh;
use halite::gpu::DeviceChoice;
use halite::gpu::construct::{Construction, Constructor};
use halite::image::{Backdrop, Image};
use halite::integral::table::{self, Cylindrical, Linear, Polynomial, Sampling, Table};
use halite::integral::{Exact, Light};
use halite::reference;
use halite::render::Renderer;
use halite_console::request::{self, Request};
use halite_console::{output, parse, progress};
use rayon::prelude::*;
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;

/// Compare pre-integrated tables of a scene's transfer function
///
/// Builds each published form of table for the scene's cells, in each way that is known, and tells its size, the time
/// that took, and its errors against adaptive integration in 64 bits, over segments with any values and lengths. With
/// --device, a device builds them too. Second-order tables are for slabs along which the value is a parabola.
#[derive(Args)]
pub struct Options {
    #[command(flatten)]
    request: Request,
    /// Texels along each axis of the values; of 256, the largest table takes 1 GiB
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = clap::value_parser!(u32).range(2..=256))]
    values: u32,
    /// Choose values and lengths so that the bound of the uniform volume's error is this, if up to 256 values reach it
    #[arg(long, value_name = "ERROR", value_parser = parse::positive, conflicts_with = "values")]
    error: Option<f64>,
    /// Entries of the function where it is sampled
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(2..=65_536))]
    entries: u32,
    /// Segments that are compared
    #[arg(long, value_name = "N", default_value_t = 10_000, value_parser = clap::value_parser!(u32).range(1..))]
    segments: u32,
    /// How much differences are magnified
    #[arg(long, value_name = "GAIN", default_value_t = 8.0, value_parser = parse::gain)]
    gain: f32,
    /// A sheet, a row for each line: the table at four lengths, each beside its difference from the exact integral
    /// (.png)
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// The planes of the cylindrical table as tiles of one picture (.png)
    #[arg(long, value_name = "FILE")]
    tiles: Option<PathBuf>,
    /// Write sizes, times and errors as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Premultiplied colour and opacity by the values in front and behind and the length of a segment.
type LookUp = Box<dyn Fn(f64, f64, f64) -> [f64; 4] + Sync>;

/// A table that was built: its bytes, the milliseconds where a device says them, and how it is looked up.
struct Built {
    bytes: u64,
    ms: Option<f64>,
    look_up: LookUp,
}

/// Builds a table; `None` if there is none of the size.
type Build<'a> = Box<dyn Fn() -> Result<Option<Built>> + 'a>;

/// A form of table, and a way to build it.
struct Form<'a> {
    name: &'static str,
    construction: &'static str,
    size: String,
    /// What errors are below.
    bound: Option<f64>,
    build: Build<'a>,
}

/// A table that was built, and its errors.
struct Row {
    name: &'static str,
    construction: String,
    size: String,
    bound: Option<f64>,
    bytes: u64,
    build_ms: f64,
    /// None for slabs of three samples, which the sheet does not show.
    look_up: Option<LookUp>,
    rms: f64,
    max: f64,
}

/// Logarithmic lengths.
const OCTAVES: u32 = 16;

const POLYNOMIALS: [(&str, u32); 3] =
    [("polynomial, degree 1", 1), ("polynomial, degree 2", 2), ("polynomial, degree 4", 4)];

/// Pixels of one picture of the sheet, along both axes, and between two of them.
const SIDE: usize = 96;
const MARGIN: usize = 4;

/// Lengths that the sheet shows, in longest ones.
const LENGTHS: [f64; 4] = [0.0625, 0.25, 0.5, 1.0];

/// Builds the tables, and writes what is asked for of them.
///
/// # Errors
/// Misuse of options, scenes that cannot be read, and files that cannot be written.
pub fn run(options: &Options, threads: usize) -> Result<()> {
    for path in options.out.iter().chain(&options.tiles) {
        output::check_picture(path)?;
    }
    if let Some(path) = &options.json {
        output::check(path)?;
    }
    let given = options.request.scene()?;
    let device = options.request.device(given.as_ref()).or_environment();
    let renderer = Renderer::with_device(threads, DeviceChoice::Cpu)?;
    renderer.install(|| {
        let job = request::prepare(&options.request, given)?.of_mesh("tables")?;
        let points = job.tetrahedra.points(job.mesh.points());
        let geometry = TetMesh::unconnected(&points, &job.tetrahedra);
        let normal = [0, 1, 2, 3].map(|k| job.field.normal(k));
        if job.field.kind() != Kind::Scalar {
            anyhow::bail!("this compares tables of fields of one component; choose one with --component");
        }
        let transfer = &job.scene.transfer;
        let exact = Exact::<f64>::new(transfer, Kind::Scalar, &normal, geometry.scale);
        let constructor = Constructor::open(&device, transfer, &normal, geometry.scale)?;
        let longest = geometry.longest_edge();
        let adaptive = |[front, back, l]: [f64; 3]| {
            reference::segment(transfer, normal[0].invert(front), normal[0].invert(back), l / geometry.scale)
        };
        let of_error = options.error.and_then(|error| table::size(&exact, longest, error));
        let [n, _, lengths] = of_error.unwrap_or([options.values, options.values, 64]);
        let rows = progress::during("building", |progress| -> Result<Vec<Row>> {
            let truth: Vec<_> = segments(options.segments, longest).into_par_iter().map(|s| (s, adaptive(s))).collect();
            let forms = forms(&exact, constructor.as_ref(), longest, [n, lengths], options);
            let count = forms.len() as f64;
            let mut rows = Vec::new();
            for (i, form) in forms.into_iter().enumerate() {
                progress(i as f64 / count);
                rows.extend(row(form, &truth)?);
            }
            rows.extend(second::rows(&exact, constructor.as_ref(), longest, options.values, options.segments)?);
            Ok(rows)
        })?;
        output::print(&text(&rows))?;
        if let Some(path) = &options.out {
            sheet(&rows, &exact, longest, options.gain).save(path, Backdrop::Color([0.0; 3]))?;
        }
        if let Some(path) = &options.tiles {
            let planes = options.values.next_multiple_of(4);
            let table =
                Cylindrical::closed(&exact, planes, options.values, longest).context("there is no such table")?;
            tiled(&table).save(path, Backdrop::Color([0.0; 3]))?;
        }
        if let Some(path) = &options.json {
            let all: Vec<_> = rows
                .iter()
                .map(|r| {
                    json!({
                        "form": r.name, "construction": r.construction, "size": r.size, "bytes": r.bytes,
                        "build_ms": r.build_ms, "rms": r.rms, "max": r.max, "bound": r.bound,
                    })
                })
                .collect();
            std::fs::write(path, format!("{:#}\n", json!({ "tables": all })))
                .with_context(|| path.display().to_string())?;
        }
        Ok(())
    })
}

/// Builds a table, several times if that is quick, and measures its errors.
fn row(form: Form<'_>, truth: &[([f64; 3], [f64; 4])]) -> Result<Option<Row>> {
    let (mut times, begun) = (vec![], Instant::now());
    let mut last;
    loop {
        let start = Instant::now();
        let Some(built) = (form.build)()? else { return Ok(None) };
        times.push(built.ms.unwrap_or_else(|| start.elapsed().as_secs_f64() * 1e3));
        last = built;
        if times.len() == 5 || begun.elapsed().as_secs_f64() > 0.5 {
            break;
        }
    }
    times.sort_by(f64::total_cmp);
    let Form { name, size, bound, .. } = form;
    let construction = form.construction.into();
    let Built { bytes, look_up, .. } = last;
    let [rms, max] = errors(truth, &look_up);
    let build_ms = times[times.len() / 2];
    Ok(Some(Row { name, construction, size, bound, bytes, build_ms, look_up: Some(look_up), rms, max }))
}

/// All forms and constructions.
fn forms<'a>(
    exact: &'a Exact<f64>,
    device: Option<&'a Constructor>,
    longest: f64,
    [n, lengths]: [u32; 2],
    options: &Options,
) -> Vec<Form<'a>> {
    let m = options.entries;
    let mut forms = vec![];
    let mut add = |name, construction: &'static str, size: String, bound: Option<f64>, build: Build<'a>| {
        // Bounds are those of texels that hold the integral, as few bits and numeric integration do not let them.
        let bound = bound.filter(|_| construction == "f64" || construction.ends_with("closed"));
        forms.push(Form { name, construction, size, bound, build });
    };
    for (name, kind, slices) in [
        ("volume, uniform", table::Kind::Uniform, lengths),
        ("volume, log", table::Kind::Log, OCTAVES),
        ("volume, log-normalised", table::Kind::LogNormalised, OCTAVES),
    ] {
        let (size, text) = ([n, n, slices], format!("{n}x{n}x{slices}"));
        let bound = table::bound_of_volume(exact, kind, [n, slices], longest);
        let sampling = [Sampling::same(m, 1.0), Sampling::touched(m, 2.0)];
        let mut volume = |construction, make: Box<dyn Fn() -> Option<Table> + 'a>| {
            add(name, construction, text.clone(), bound, Box::new(move || Ok(make().map(of_volume))));
        };
        volume("f64", Box::new(move || Table::new(exact, kind, size, longest)));
        volume("closed", Box::new(move || Table::closed(exact, kind, size, longest)));
        if kind != table::Kind::LogNormalised {
            volume("sliced", Box::new(move || Table::sampled(exact, kind, size, longest, sampling[0])));
            volume("software", Box::new(move || Table::sampled(exact, kind, size, longest, sampling[1])));
            volume("incremental", Box::new(move || Table::incremental(exact, kind, size, longest)));
        }
        for (construction, how) in [
            ("device, closed", Construction::Closed),
            ("device, sliced", Construction::Sampled(sampling[0])),
            ("device, software", Construction::Sampled(sampling[1])),
            ("device, incremental", Construction::Incremental),
        ] {
            let Some(device) = device else { break };
            let build = move || {
                let built = device.volume(kind, size, longest, how)?;
                Ok(built.map(|(table, ms)| Built { ms: Some(ms), ..of_volume(table) }))
            };
            add(name, construction, text.clone(), bound, Box::new(build));
        }
    }
    let size = format!("{n}x{n}");
    add(
        "linear opacity",
        "f64",
        size.clone(),
        None,
        Box::new(move || Ok(Linear::new(exact, n, longest).map(of_linear))),
    );
    add("linear opacity", "closed", size, None, Box::new(move || Ok(Linear::closed(exact, n, longest).map(of_linear))));
    for (name, degree) in POLYNOMIALS {
        let size = format!("{n}x{n}x{}", degree + 1);
        let bound = table::bound_of_polynomial(exact, degree, n, longest);
        let mut polynomial = |construction, bits: u32, make: Box<dyn Fn() -> Option<Polynomial> + 'a>| {
            let build = move || Ok(make().map(|table| of_polynomial(table, bits)));
            add(name, construction, size.clone(), bound, Box::new(build));
        };
        let closed = move || Polynomial::closed(exact, degree, n, longest);
        polynomial("f64", 32, Box::new(move || Polynomial::new(exact, degree, n, longest)));
        polynomial("closed", 32, Box::new(closed));
        polynomial("closed, 16 bits", 16, Box::new(move || closed().map(|t| t.rounded(16))));
        polynomial("closed, 8 bits", 8, Box::new(move || closed().map(|t| t.rounded(8))));
        if let Some(device) = device {
            let build = move || {
                let built = device.polynomial(degree, n, longest)?;
                Ok(built.map(|(table, ms)| Built { ms: Some(ms), ..of_polynomial(table, 32) }))
            };
            add(name, "device, closed", size, bound, Box::new(build));
        }
    }
    // A cylinder has a plane at each bend of its mapping, which are a quarter apart.
    let planes = n.next_multiple_of(4);
    for (name, planes) in [
        ("cylindrical, n planes", planes),
        ("cylindrical, 2 n planes", 2 * planes),
        ("cylindrical, 4 n planes", 4 * planes),
    ] {
        let size = format!("{n}x{n}x{planes}");
        let f64 = move || Ok(Cylindrical::new(exact, planes, n, longest).map(of_cylinder));
        let closed = move || Ok(Cylindrical::closed(exact, planes, n, longest).map(of_cylinder));
        add(name, "f64", size.clone(), None, Box::new(f64));
        add(name, "closed", size.clone(), None, Box::new(closed));
        if let Some(device) = device {
            let build = move || {
                let built = device.cylindrical(planes, n, longest)?;
                Ok(built.map(|(table, ms)| Built { ms: Some(ms), ..of_cylinder(table) }))
            };
            add(name, "device, closed", size, None, Box::new(build));
        }
    }
    forms
}

fn of_volume(table: Table) -> Built {
    Built { bytes: table.bytes(), ms: None, look_up: Box::new(move |f, b, l| table.look_up(f, b, l)) }
}

fn of_polynomial(table: Polynomial, bits: u32) -> Built {
    let bytes = table.bytes() * u64::from(bits) / 32;
    Built { bytes, ms: None, look_up: Box::new(move |f, b, l| table.look_up(f, b, l)) }
}

fn of_cylinder(table: Cylindrical) -> Built {
    Built { bytes: table.bytes(), ms: None, look_up: Box::new(move |f, b, l| table.look_up(f, b, l)) }
}

fn of_linear(table: Linear) -> Built {
    Built { bytes: table.bytes(), ms: None, look_up: Box::new(move |f, b, l| table.look_up(f, b, l)) }
}

fn truth(exact: &Exact<f64>, front: f64, back: f64, l: f64) -> [f64; 4] {
    let mut light = Light::none();
    exact.add(&[front], &[back], l, &mut light);
    let [r, g, b] = light.color;
    [r, g, b, 1.0 - light.transmittance]
}

/// Values in front and behind and lengths of segments along three additive sequences (Roberts 2018).
fn segments(count: u32, longest: f64) -> Vec<[f64; 3]> {
    let steps = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3];
    let segment = |i: u32| {
        let [front, back, l] = steps.map(|s| (0.5 + s * f64::from(i)).fract());
        [2.0 * front - 1.0, 2.0 * back - 1.0, l * longest]
    };
    (0..count).map(segment).collect()
}

/// The root mean square and the greatest error of all channels.
fn errors(truth: &[([f64; 3], [f64; 4])], look_up: &LookUp) -> [f64; 2] {
    let (mut sum, mut most) = (0.0, 0.0f64);
    for ([front, back, l], want) in truth {
        let got = look_up(*front, *back, *l);
        for k in 0..4 {
            let e = (got[k] - want[k]).abs();
            (sum, most) = (sum + e * e, most.max(e));
        }
    }
    [(sum / (4.0 * truth.len() as f64)).sqrt(), most]
}

fn text(rows: &[Row]) -> String {
    let mut text = format!(
        "{:24} {:20} {:>12} {:>10} {:>10} {:>9} {:>9} {:>9}\n",
        "table", "built", "texels", "bytes", "build ms", "rms", "max", "bound"
    );
    for r in rows {
        let bound = r.bound.map_or("-".into(), |b| format!("{b:.1e}"));
        text += &format!(
            "{:24} {:20} {:>12} {:>10} {:>10.1} {:>9.1e} {:>9.1e} {:>9}\n",
            r.name, r.construction, r.size, r.bytes, r.build_ms, r.rms, r.max, bound
        );
    }
    text
}

/// The planes beside and below each other, each with s to the right and t downward.
fn tiled(table: &Cylindrical) -> Image {
    let (size, planes) = (table.size as usize, table.planes as usize);
    let columns = (planes as f64).sqrt().ceil() as usize;
    let [width, height] = [columns * size, planes.div_ceil(columns) * size];
    let mut picture = Image::new([width as u32, height as u32]);
    for (at, &texel) in table.texels.iter().enumerate() {
        let (s, t, plane) = (at % size, at / size % size, at / size / size);
        picture.pixels[(plane / columns * size + t) * width + plane % columns * size + s] = texel;
    }
    picture
}

/// A row for each table: at each length the table, values in front to the right and values behind downward, and its
/// difference from the exact integral times `gain`.
fn sheet(rows: &[Row], exact: &Exact<f64>, longest: f64, gain: f32) -> Image {
    let step = SIDE + MARGIN;
    let shown = rows.iter().filter(|r| r.look_up.is_some()).count();
    let size = [2 * LENGTHS.len() * step + MARGIN, shown * step + MARGIN];
    let mut sheet = Image::new(size.map(|n| n as u32));
    sheet.pixels.fill([0.2, 0.2, 0.2, 1.0]);
    for (row, look_up) in rows.iter().filter_map(|r| r.look_up.as_ref()).enumerate() {
        for (column, length) in LENGTHS.iter().enumerate() {
            for (i, j) in (0..SIDE).flat_map(|j| (0..SIDE).map(move |i| (i, j))) {
                let [front, back] = [i, j].map(|k| (2.0 * k as f64 + 1.0) / SIDE as f64 - 1.0);
                let got = look_up(front, back, length * longest);
                let want = truth(exact, front, back, length * longest);
                let at = (MARGIN + row * step + j) * size[0] + MARGIN + 2 * column * step + i;
                let [r, g, b] = [0, 1, 2].map(|k| got[k] as f32);
                sheet.pixels[at] = [r, g, b, 1.0];
                let [r, g, b] = [0, 1, 2].map(|k| (got[k] - want[k]).abs() as f32 * gain);
                sheet.pixels[at + step] = [r, g, b, 1.0];
            }
        }
    }
    sheet
}
