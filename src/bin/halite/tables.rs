use crate::render::{self, Request};
use crate::{output, progress};
use anyhow::{Context, Result};
use clap::Args;
use halite::field::Kind;
use halite::geometry::Geometry;
use halite::gpu::DeviceChoice;
use halite::image::{Backdrop, Image};
use halite::integral::table::{self, Cylindrical, Polynomial, Table};
use halite::integral::{Exact, Light};
use halite::render::Renderer;
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;

/// Compare pre-integrated tables of a scene's transfer function
///
/// Builds each published form of table for the scene's cells, and tells its size, the time that took, and its errors against the
/// exact integral, over segments with any values and lengths.
#[derive(Args)]
pub(crate) struct Options {
    #[command(flatten)]
    request: Request,
    /// Texels along each axis of the values; of 256, the largest table takes 1 GiB
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = clap::value_parser!(u32).range(2..=256))]
    values: u32,
    /// Segments that are compared
    #[arg(long, value_name = "N", default_value_t = 50_000, value_parser = clap::value_parser!(u32).range(1..))]
    segments: u32,
    /// How much differences are magnified
    #[arg(long, value_name = "GAIN", default_value_t = 8.0)]
    gain: f32,
    /// A sheet, a row for each form: the table at four lengths, each beside its difference from the exact integral (.png)
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write sizes, times and errors as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Premultiplied colour and opacity by the values in front and behind and the length of a segment.
type LookUp = Box<dyn Fn(f64, f64, f64) -> [f64; 4] + Sync>;

/// A table that was built.
struct Row {
    name: String,
    size: String,
    bytes: u64,
    build_ms: f64,
    look_up: LookUp,
    rms: f64,
    max: f64,
}

/// Pixels of one picture of the sheet, along both axes, and between two of them.
const SIDE: usize = 96;
const MARGIN: usize = 4;

/// Lengths that the sheet shows, in longest ones.
const LENGTHS: [f64; 4] = [0.0625, 0.25, 0.5, 1.0];

pub(crate) fn run(options: &Options, threads: usize) -> Result<()> {
    if let Some(path) = &options.out {
        output::check_picture(path)?;
    }
    if let Some(path) = &options.json {
        output::check(path)?;
    }
    let given = options.request.scene()?;
    let renderer = Renderer::with_device(threads, DeviceChoice::Cpu)?;
    renderer.install(|| {
        let job = render::prepare(&options.request, given)?;
        let points = job.tetrahedra.points(job.mesh.points());
        let geometry = Geometry::unconnected(&points, &job.tetrahedra);
        let normal = [0, 1, 2, 3].map(|k| job.field.normal(k));
        let exact = Exact::<f64>::new(&job.scene.transfer, job.field.kind(), &normal, geometry.scale);
        if job.field.kind() != Kind::Scalar {
            anyhow::bail!("tables are for fields of one component; choose one with --component");
        }
        let rows = progress::during("building", |p| rows(&exact, geometry.longest_edge(), options, p));
        output::print(&text(&rows))?;
        if let Some(path) = &options.out {
            sheet(&rows, &exact, geometry.longest_edge(), options.gain).save(path, Backdrop::Color([0.0; 3]))?;
        }
        if let Some(path) = &options.json {
            let all: Vec<_> = rows
                .iter()
                .map(|r| {
                    json!({
                        "form": r.name, "size": r.size, "bytes": r.bytes, "build_ms": r.build_ms, "rms": r.rms, "max": r.max,
                    })
                })
                .collect();
            std::fs::write(path, format!("{:#}\n", json!({ "tables": all }))).with_context(|| path.display().to_string())?;
        }
        Ok(())
    })
}

/// Builds and judges all forms.
fn rows(exact: &Exact<f64>, longest: f64, options: &Options, progress: &dyn Fn(f64)) -> Vec<Row> {
    let n = options.values;
    // A cylinder has a plane at each bend of its mapping, which are a quarter apart.
    let planes = n.next_multiple_of(4);
    let forms: [(&str, String, Build); 9] = [
        ("volume, uniform", format!("{n}x{n}x64"), volume(table::Kind::Uniform, [n, n, 64])),
        ("volume, log", format!("{n}x{n}x16"), volume(table::Kind::Log, [n, n, 16])),
        ("volume, log-normalised", format!("{n}x{n}x16"), volume(table::Kind::LogNormalised, [n, n, 16])),
        ("polynomial, degree 1", format!("{n}x{n}x2"), polynomial(1, n)),
        ("polynomial, degree 2", format!("{n}x{n}x3"), polynomial(2, n)),
        ("polynomial, degree 4", format!("{n}x{n}x5"), polynomial(4, n)),
        ("cylindrical, n planes", format!("{n}x{n}x{planes}"), cylindrical(planes, n)),
        ("cylindrical, 2 n planes", format!("{n}x{n}x{}", 2 * planes), cylindrical(2 * planes, n)),
        ("cylindrical, 4 n planes", format!("{n}x{n}x{}", 4 * planes), cylindrical(4 * planes, n)),
    ];
    let mut rows = Vec::new();
    for (i, (name, size, build)) in forms.into_iter().enumerate() {
        progress(i as f64 / 9.0);
        let start = Instant::now();
        let Some((bytes, look_up)) = build(exact, longest) else { continue };
        let build_ms = start.elapsed().as_secs_f64() * 1e3;
        let [rms, max] = errors(exact, longest, options.segments, &look_up);
        rows.push(Row { name: name.into(), size, bytes, build_ms, look_up, rms, max });
    }
    rows
}

/// Builds a table, if there is one of the size: its bytes, and how it is looked up.
type Build = Box<dyn Fn(&Exact<f64>, f64) -> Option<(u64, LookUp)>>;

fn volume(kind: table::Kind, size: [u32; 3]) -> Build {
    Box::new(move |exact, longest| {
        let table = Table::new(exact, kind, size, longest)?;
        Some((table.bytes(), Box::new(move |f, b, l| table.look_up(f, b, l))))
    })
}

fn polynomial(degree: u32, size: u32) -> Build {
    Box::new(move |exact, longest| {
        let table = Polynomial::new(exact, degree, size, longest)?;
        Some((table.bytes(), Box::new(move |f, b, l| table.look_up(f, b, l))))
    })
}

fn cylindrical(planes: u32, size: u32) -> Build {
    Box::new(move |exact, longest| {
        let table = Cylindrical::new(exact, planes, size, longest)?;
        Some((table.bytes(), Box::new(move |f, b, l| table.look_up(f, b, l))))
    })
}

fn truth(exact: &Exact<f64>, front: f64, back: f64, l: f64) -> [f64; 4] {
    let mut light = Light::none();
    exact.add(&[front], &[back], l, &mut light);
    let [r, g, b] = light.color;
    [r, g, b, 1.0 - light.through]
}

/// The root mean square and the greatest error of all channels, over segments along three additive sequences (Roberts 2018).
fn errors(exact: &Exact<f64>, longest: f64, segments: u32, look_up: &LookUp) -> [f64; 2] {
    let steps = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3];
    let (mut sum, mut most) = (0.0, 0.0f64);
    for i in 0..segments {
        let [front, back, l] = steps.map(|s| (0.5 + s * f64::from(i)).fract());
        let (front, back, l) = (2.0 * front - 1.0, 2.0 * back - 1.0, l * longest);
        let (got, want) = (look_up(front, back, l), truth(exact, front, back, l));
        for k in 0..4 {
            let e = (got[k] - want[k]).abs();
            (sum, most) = (sum + e * e, most.max(e));
        }
    }
    [(sum / (4.0 * f64::from(segments))).sqrt(), most]
}

fn text(rows: &[Row]) -> String {
    let mut text =
        format!("{:24} {:>12} {:>10} {:>10} {:>9} {:>9}\n", "table", "texels", "bytes", "build ms", "rms", "max");
    for r in rows {
        text += &format!(
            "{:24} {:>12} {:>10} {:>10.1} {:>9.1e} {:>9.1e}\n",
            r.name, r.size, r.bytes, r.build_ms, r.rms, r.max
        );
    }
    text
}

/// A row for each table: at each length the table, values in front to the right and values behind downward, and its difference from
/// the exact integral times `gain`.
fn sheet(rows: &[Row], exact: &Exact<f64>, longest: f64, gain: f32) -> Image {
    let step = SIDE + MARGIN;
    let size = [2 * LENGTHS.len() * step + MARGIN, rows.len() * step + MARGIN];
    let mut sheet = Image::new(size.map(|n| n as u32));
    sheet.pixels.fill([0.2, 0.2, 0.2, 1.0]);
    for (row, of_row) in rows.iter().enumerate() {
        for (column, length) in LENGTHS.iter().enumerate() {
            for (i, j) in (0..SIDE).flat_map(|j| (0..SIDE).map(move |i| (i, j))) {
                let [front, back] = [i, j].map(|k| (2.0 * k as f64 + 1.0) / SIDE as f64 - 1.0);
                let got = (of_row.look_up)(front, back, length * longest);
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
