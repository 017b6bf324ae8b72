//! Pictures of volumes by the orders, with and without tables, and what tables take.

use super::Volume;
use anyhow::Result;
use halite::cast::{Reconstruction, ReconstructionOrder, Sampling};
use halite::gpu::DeviceChoice;
use halite::gpu::construct::Constructor;
use halite::image::Image;
use halite::integral::options::{Form, IntegrationOptions, Texels};
use halite::integral::table::Kind;
use halite::render::Renderer;
use halite::view::View;
use serde_json::{Value, json};

/// Texels along each axis of a table of second order, and steps of its construction, with the seconds that it took the authors:
/// on a processor and on a graphics card (figure 6).
const TEXELS: u32 = 256;
const ITERATIONS: [(u32, [f64; 2]); 6] = [
    (8, [28.0, 0.53]),
    (16, [50.0, 0.93]),
    (32, [90.0, 1.52]),
    (64, [165.0, 2.74]),
    (128, [328.0, 5.14]),
    (256, [663.0, 10.88]),
];

/// Of the three pictures of a figure the order, and the voxels from sample to sample.
type Parts = [(ReconstructionOrder, f64); 3];

/// Names of volumes, and the figures that they are in.
const FIGURES: [(&str, &str, Parts); 3] = [
    (
        "neghip",
        "figure 7",
        [(ReconstructionOrder::One, 2.0), (ReconstructionOrder::One, 1.0), (ReconstructionOrder::Two, 2.0)],
    ),
    (
        "fuel",
        "figure 8",
        [(ReconstructionOrder::One, 2.0), (ReconstructionOrder::One, 1.0), (ReconstructionOrder::Two, 2.0)],
    ),
    (
        "bucky",
        "figure 9",
        [(ReconstructionOrder::One, 4.0), (ReconstructionOrder::One, 1.0), (ReconstructionOrder::Two, 4.0)],
    ),
];

/// A picture, and what is said of it.
pub(super) struct Picture {
    pub(super) image: Image,
    pub(super) caption: String,
    pub(super) figures: String,
    pub(super) background: [f32; 3],
    row: Value,
}

/// What the study drew.
pub(super) struct Pictures {
    pictures: Vec<Picture>,
    tables: Vec<Value>,
    voxels: Vec<Value>,
    text: String,
}

/// A picture of one reconstruction.
struct Drawn {
    image: Image,
    max: f64,
    rmse: f64,
    frame_ms: f64,
    table_ms: f64,
}

/// Draws everything on the CPU; on `device`, if that is another, tables are built, too.
pub(super) fn draw(
    volumes: &[Volume],
    threads: usize,
    frames: u32,
    device: &DeviceChoice,
    report: &dyn Fn(f64),
) -> Result<Pictures> {
    let mut renderer = Renderer::with_device(threads, DeviceChoice::Cpu)?;
    let mut all = Pictures { pictures: vec![], tables: vec![], voxels: vec![], text: String::new() };
    for (i, volume) in volumes.iter().enumerate() {
        report(i as f64 / volumes.len() as f64);
        renderer.set_integral(IntegrationOptions::default());
        renderer.set_grid(&volume.grid)?;
        renderer.set_field(&volume.field)?;
        renderer.set_transfer(&volume.scene.transfer);
        let (view, _) = volume.scene.view()?;
        let truth = reconstructed(
            &mut renderer,
            &view,
            ReconstructionOrder::Exact,
            Sampling::Voxels,
            IntegrationOptions::default(),
            frames,
            None,
        )?;
        let background = volume.scene.background.unwrap_or_default().map(|c| c as f32);
        let mut studio = Studio { renderer: &mut renderer, view, truth: &truth.image, volume, frames, background };
        studio.by_voxels(&mut all)?;
        if i == 0 {
            studio.tables(&mut all, device)?;
        }
        studio.figures(&mut all, &truth)?;
    }
    Ok(all)
}

/// A frame of one reconstruction and form, and the median time of `frames` more.
fn reconstructed(
    renderer: &mut Renderer,
    view: &View,
    order: ReconstructionOrder,
    sampling: Sampling,
    choice: IntegrationOptions,
    frames: u32,
    truth: Option<&Image>,
) -> Result<Drawn> {
    renderer.set_reconstruction(Reconstruction { order, sampling });
    renderer.set_integral(choice);
    let image = renderer.render(view, &|_| ())?;
    let table_ms = renderer.stats().table_ms;
    let mut times = vec![];
    for _ in 0..frames {
        renderer.render(view, &|_| ())?;
        times.push(renderer.stats().frame_ms);
    }
    times.sort_by(f64::total_cmp);
    let difference = truth.and_then(|truth| image.compare(truth));
    let (max, rmse) = difference.map_or((0.0, 0.0), |d| (d.max, d.rmse));
    Ok(Drawn { image, max, rmse, frame_ms: times[times.len() / 2], table_ms })
}

/// What draws one volume.
struct Studio<'a> {
    renderer: &'a mut Renderer,
    view: View,
    truth: &'a Image,
    volume: &'a Volume,
    frames: u32,
    background: [f32; 3],
}

impl Studio<'_> {
    fn draw(&mut self, order: ReconstructionOrder, sampling: Sampling, choice: IntegrationOptions) -> Result<Drawn> {
        reconstructed(self.renderer, &self.view, order, sampling, choice, self.frames, Some(self.truth))
    }

    /// Orders 1 and 2 with samples at the faces of voxels.
    fn by_voxels(&mut self, all: &mut Pictures) -> Result<()> {
        let first = self.draw(ReconstructionOrder::One, Sampling::Voxels, IntegrationOptions::default())?;
        let second = self.draw(ReconstructionOrder::Two, Sampling::Voxels, IntegrationOptions::default())?;
        let ratio = first.rmse / second.rmse;
        if all.voxels.is_empty() {
            all.text += "pictures, samples at faces of voxels      rmse of order 1, of order 2, ratio, ms, ms\n";
        }
        all.text += &format!(
            "  {:38} {:>12.2e} {:>12.2e} {ratio:>6.2} {:>7.1} {:>7.1}\n",
            self.volume.label(),
            first.rmse,
            second.rmse,
            first.frame_ms,
            second.frame_ms
        );
        all.voxels.push(json!({
            "volume": self.volume.name, "stand_in": self.volume.stands_in, "rmse_1": first.rmse, "rmse_2": second.rmse,
            "max_1": first.max, "max_2": second.max, "ratio": ratio,
            "frame_ms_1": first.frame_ms, "frame_ms_2": second.frame_ms,
        }));
        Ok(())
    }

    /// Figure 6: what tables take by their steps, and from how many on pictures of bytes are the same.
    fn tables(&mut self, all: &mut Pictures, device: &DeviceChoice) -> Result<()> {
        let sampling = Sampling::Steps(2.0 * self.volume.samples.width());
        let choice = |iterations| {
            IntegrationOptions::of(Form::SecondOrder).with_iterations(iterations).with_table(Some([TEXELS; 3]))
        };
        let mut drawn = vec![];
        for (iterations, theirs) in ITERATIONS {
            drawn.push((iterations, theirs, self.draw(ReconstructionOrder::Two, sampling, choice(iterations))?));
        }
        let normal = [0, 1, 2, 3].map(|k| self.volume.field.normal(k));
        let device = Constructor::open(device, &self.volume.scene.transfer, &normal, 1.0)?;
        let there = device.as_ref().map_or("no device", Constructor::name);
        all.text += &format!(
            "figure 6: {TEXELS}^3 texels, steps    seconds: processor, {there}, the authors' (processor, card), apart from 256 steps\n"
        );
        let best = drawn.last().map(|d| d.2.image.clone());
        let mut agree = None;
        for (iterations, [processor, card], drawn) in drawn.iter().rev() {
            let apart = best.as_ref().and_then(|best| drawn.image.compare(best)).map_or(0.0, |d| d.max);
            if apart <= 1.0 / 255.0 {
                agree = Some(*iterations);
            }
            let seconds = drawn.table_ms * 1e-3;
            let length = 4.0 * self.volume.samples.width();
            let on_device = match &device {
                Some(device) => device.second_order(TEXELS, length, *iterations, false)?.map(|(_, ms)| ms * 1e-3),
                None => None,
            };
            let there = on_device.map_or("-".into(), |s| format!("{s:.3}"));
            all.text +=
                &format!("  {iterations:>10} {seconds:>28.3} {there:>9} {processor:>8} {card:>6} {apart:>12.1e}\n");
            all.tables.push(json!({
                "iterations": iterations, "seconds": seconds, "seconds_on_device": on_device,
                "device": device.as_ref().map(Constructor::name), "published_processor": processor, "published_card": card,
                "apart_from_256": apart, "rmse": drawn.rmse, "max": drawn.max, "texels": TEXELS,
            }));
        }
        if let Some(iterations) = agree {
            all.text += &format!("  pictures agree within a byte's step from {iterations} steps on\n");
        }
        let own = self.draw(ReconstructionOrder::Two, sampling, IntegrationOptions::of(Form::SecondOrderPolynomial))?;
        let seconds = own.table_ms * 1e-3;
        all.text += &format!("  of all lengths, 64^3, degree 2: {seconds:>16.3} s, rmse {:.1e}\n", own.rmse);
        all.tables
            .push(json!({ "form": "second-order-polynomial", "seconds": seconds, "rmse": own.rmse, "max": own.max }));
        Ok(())
    }

    /// Figures 7 to 9: by tables of 16 bits of order 1 and of 8 bits of order 2, and by integrals.
    fn figures(&mut self, all: &mut Pictures, truth: &Drawn) -> Result<()> {
        let Some((_, figure, parts)) = FIGURES.iter().find(|f| self.volume.name.contains(f.0)) else { return Ok(()) };
        let label = self.volume.label();
        all.text +=
            &format!("{figure}, {label:30} bits, voxels from sample to sample, max, rmse, ms, ms of the table\n");
        all.pictures.push(Picture {
            image: truth.image.clone(),
            caption: format!("{figure}: {label}, the field itself"),
            figures: format!("{:.1} ms", truth.frame_ms),
            background: self.background,
            row: json!({ "figure": figure, "volume": self.volume.name, "order": "exact", "frame_ms": truth.frame_ms }),
        });
        for (letter, (order, voxels)) in ["a", "b", "c"].into_iter().zip(parts) {
            let sampling = Sampling::Steps(voxels * self.volume.samples.width());
            let (number, table, bits) = match order {
                ReconstructionOrder::One => {
                    let form = IntegrationOptions::of(Form::Volume)
                        .with_lengths(Kind::LogNormalised)
                        .with_table(Some([256, 256, 16]));
                    (1, form.with_texels(Texels::Unorm16), "16")
                }
                _ => {
                    let form = IntegrationOptions::of(Form::SecondOrder).with_table(Some([TEXELS; 3]));
                    (2, form.with_texels(Texels::Unorm8), "8")
                }
            };
            for (choice, bits) in [(table, bits), (IntegrationOptions::default(), "none")] {
                let drawn = self.draw(*order, sampling, choice)?;
                let by = if bits == "none" { "integral".to_owned() } else { format!("{bits}-bit table") };
                let Drawn { max, rmse, frame_ms, table_ms, .. } = drawn;
                all.text += &format!(
                    "  order {number} {bits:>36} {voxels:>3} {max:>9.1e} {rmse:>9.1e} {frame_ms:>8.1} {table_ms:>8.1}\n"
                );
                all.pictures.push(Picture {
                    image: drawn.image,
                    caption: format!("{figure} ({letter}): order {number}, {voxels} voxels, {by}"),
                    figures: format!("max {max:.1e} rmse {rmse:.1e} {frame_ms:.0} ms"),
                    background: self.background,
                    row: json!({
                        "figure": figure, "part": letter, "volume": self.volume.name, "stand_in": self.volume.stands_in,
                        "order": number, "voxels": voxels, "table_bits": bits, "max": max, "rmse": rmse,
                        "frame_ms": frame_ms, "table_ms": table_ms,
                    }),
                });
            }
        }
        Ok(())
    }
}

impl Pictures {
    pub(super) fn text(&self) -> String {
        self.text.clone()
    }

    /// Those of the sheet.
    pub(super) fn shown(&self) -> Vec<&Picture> {
        self.pictures.iter().collect()
    }

    pub(super) fn rows(&self) -> Vec<&Value> {
        self.pictures.iter().map(|p| &p.row).collect()
    }

    pub(super) fn tables(&self) -> &[Value] {
        &self.tables
    }

    pub(super) fn voxels(&self) -> &[Value] {
        &self.voxels
    }
}
