//! What draws a renderer's frames: one variant for each engine and where it runs. An engine is added by a variant here, and by
//! what it does in each of these methods.

use super::frame::Frame;
use super::stats::{ProjectionStats, SweepStats};
use crate::error::{Error, Result};
use crate::geometry::{TetMesh, Values};
use crate::gpu::scene::DeviceScene;
use crate::gpu::second::SecondScene;
use crate::gpu::{DeviceChoice, Gpu, Part};
use crate::integral::options::Two;
use crate::integral::{Exact, Integral, PreintegratedTable, second};
use crate::project::cpu::{self as sweep, Sweep};
use crate::project::{self, ProjectionOptions, gpu::Project};
use crate::render::Engine;
use crate::transfer::TransferFunction;
use crate::traverse::cpu;
use crate::traverse::gpu::{Traverse, WalkedFrame};
use crate::view::{Blend, View};
use rayon::prelude::*;
use std::sync::Arc;

/// An engine, and where it runs.
#[derive(Debug)]
pub(crate) enum Backend {
    /// The walk on the CPU.
    Walk,
    /// The walk on a device.
    WalkOnDevice(Box<Traverse>),
    /// Projected cells on the CPU.
    Project(Box<Sweep>),
    /// Projected cells on a device.
    ProjectOnDevice(Box<Project>),
}

/// What a backend needs of a mesh. One without that is left to the walk on the CPU, which draws all.
#[derive(Debug, Clone, Copy)]
pub(super) struct Needs {
    /// It reads the neighbours of cells and the boundary.
    pub(super) neighbours: bool,
    /// It reads neighbours if it is to draw in an order that needs them.
    pub(super) order: bool,
    /// It draws meshes that are flat: see [`TetMesh::is_flat`].
    sheets: bool,
    /// It draws meshes that are as thin in two directions: see [`TetMesh::is_needle`].
    needles: bool,
}

impl Needs {
    /// Whether the backend can draw the mesh.
    pub(super) fn are_met_by(self, geometry: &TetMesh) -> bool {
        (self.sheets || !geometry.is_flat()) && (self.needles || !geometry.is_needle())
    }
}

/// A frame, and what it took.
#[derive(Debug, Default)]
pub(super) struct DrawnFrame {
    pub(super) pixels: Vec<[f32; 4]>,
    /// What walks did.
    pub(super) counts: cpu::Counts,
    /// By the device's own clock, in ms.
    pub(super) device_ms: Option<f64>,
    /// What a projection did.
    pub(super) projection: Option<ProjectionStats>,
    /// What a projection on the CPU did.
    pub(super) sweep: Option<SweepStats>,
}

impl Backend {
    /// The backend of `engine` on the chosen device. Where nobody named a device and none can be opened, the CPU draws.
    ///
    /// # Errors
    /// [`Error::Device`] if the device is none of this machine's or cannot be used, or if the engine needs one and there
    /// is none.
    pub(super) fn open(engine: Engine, choice: &DeviceChoice) -> Result<Self> {
        if engine == Engine::Project && *choice == DeviceChoice::Cpu {
            return Ok(Self::without_device(engine));
        }
        if engine == Engine::Project {
            return Ok(Backend::ProjectOnDevice(Box::new(Project::open(choice)?)));
        }
        let device = match Gpu::open(choice) {
            Err(e) if *choice == DeviceChoice::Auto => {
                tracing::warn!("drawing on the CPU: {e}");
                None
            }
            opened => opened?,
        };
        Ok(match device {
            Some(gpu) => Backend::WalkOnDevice(Box::new(Traverse::new(gpu))),
            None => Self::without_device(engine),
        })
    }

    #[cfg(test)]
    pub(crate) fn traverse(&mut self) -> Option<&mut Traverse> {
        if let Backend::WalkOnDevice(traverse) = self { Some(traverse) } else { None }
    }

    #[cfg(test)]
    pub(crate) fn project(&mut self) -> Option<&mut Project> {
        if let Backend::ProjectOnDevice(project) = self { Some(project) } else { None }
    }

    #[cfg(test)]
    pub(crate) fn sweep(&mut self) -> Option<&mut Sweep> {
        if let Backend::Project(sweep) = self { Some(sweep) } else { None }
    }

    /// What draws where no device does.
    pub(super) fn without_device(engine: Engine) -> Self {
        match engine {
            Engine::Traverse => Backend::Walk,
            Engine::Auto | Engine::Project => Backend::Project(Box::new(Sweep::new())),
        }
    }

    /// The name of the engine, as [`super::Stats`] has it.
    pub(super) fn engine(&self) -> &'static str {
        match self {
            Backend::Walk | Backend::WalkOnDevice(_) => "traverse",
            Backend::Project(_) | Backend::ProjectOnDevice(_) => "project",
        }
    }

    /// The device that draws; none if it is the CPU.
    pub(super) fn gpu(&self) -> Option<&Gpu> {
        match self {
            Backend::Walk | Backend::Project(_) => None,
            Backend::WalkOnDevice(traverse) => Some(traverse.gpu()),
            Backend::ProjectOnDevice(project) => Some(project.gpu()),
        }
    }

    /// Whether the CPU may take the place of a device that fails, if nobody named it.
    pub(super) fn may_fall_back(&self) -> bool {
        matches!(self, Backend::WalkOnDevice(_))
    }

    /// What of a second variable, light or silhouettes it cannot draw of `transfer`, integrated as `two` says; none if all.
    pub(super) fn lacks_second(
        &self,
        transfer: &TransferFunction,
        two: &Two,
        projection: &ProjectionOptions,
    ) -> Option<String> {
        match self {
            Backend::Walk | Backend::Project(_) => None,
            Backend::WalkOnDevice(_) => {
                second::lacks(transfer, two).map(|what| format!("the walk on a device lacks {what}"))
            }
            Backend::ProjectOnDevice(_) => second::lacks(transfer, two)
                .or_else(|| Project::lacks(transfer, projection))
                .map(|what| format!("the projection on a device lacks {what}")),
        }
    }

    /// Whether a second variable and light are drawn by the projection on the CPU, with `engine` asked for; else by the walk.
    pub(super) fn projects_second(&self, engine: Engine) -> bool {
        match self {
            Backend::Walk => false,
            Backend::WalkOnDevice(_) => engine == Engine::Auto,
            Backend::Project(_) | Backend::ProjectOnDevice(_) => true,
        }
    }

    /// What it needs of a mesh.
    pub(super) fn needs(&self) -> Needs {
        match self {
            Backend::Walk | Backend::Project(_) => {
                Needs { neighbours: true, order: false, sheets: true, needles: true }
            }
            Backend::WalkOnDevice(_) => Needs { neighbours: true, order: false, sheets: false, needles: false },
            Backend::ProjectOnDevice(_) => Needs { neighbours: false, order: true, sheets: true, needles: false },
        }
    }

    /// Takes `part` for changed.
    pub(super) fn invalidate(&mut self, part: Part) {
        match self {
            Backend::Walk => {}
            Backend::Project(sweep) if part != Part::Points => sweep.invalidate_values(),
            Backend::Project(_) => {}
            Backend::WalkOnDevice(traverse) => traverse.invalidate(part),
            Backend::ProjectOnDevice(project) => project.invalidate(part),
        }
    }

    /// Has the device that draws hold `table`, or build it; `wait`s until that is done.
    pub(super) fn ensure_resident(
        &mut self,
        exact: &Exact<f32>,
        table: &Arc<PreintegratedTable>,
        wait: bool,
    ) -> Result<()> {
        let gpu = match self {
            Backend::Walk | Backend::Project(_) => {
                return Err(Error::Device("there is no device to build a table".into()));
            }
            Backend::WalkOnDevice(traverse) => {
                traverse.prepare_table(exact, Some(table))?;
                traverse.gpu()
            }
            Backend::ProjectOnDevice(project) => {
                project.prepare_table(exact, Some(table))?;
                project.gpu()
            }
        };
        if wait { gpu.wait() } else { Ok(()) }
    }

    /// Draws a frame on the current rayon pool.
    pub(super) fn draw<const N: usize>(&mut self, frame: &Frame, values: &Values<N>) -> Result<DrawnFrame> {
        match self {
            Backend::Walk => Ok(walk(frame, values)),
            Backend::WalkOnDevice(traverse) => walk_on(traverse, frame, values),
            Backend::Project(sweep) => project_by(sweep, frame, values),
            Backend::ProjectOnDevice(project) => project_on(project, frame, values),
        }
    }

    /// Draws a frame of two variables, or with light, on the device, of which nothing is [lacking](Self::lacks_second); and says
    /// which pixels are left to the CPU.
    pub(super) fn draw_second<const N: usize>(
        &mut self,
        geometry: &TetMesh,
        scene: &SecondScene<N>,
        even: &Exact<f32>,
        view: &View,
        projection: &ProjectionOptions,
    ) -> Result<(DrawnFrame, Vec<usize>)> {
        match self {
            Backend::Walk | Backend::Project(_) => {
                Err(Error::Device("there is no device that draws two variables".into()))
            }
            Backend::ProjectOnDevice(project) => {
                let (pixels, counts) = project.render_second(geometry, scene, even, view, projection)?;
                let mut left = project::gpu::left(&pixels);
                if projection.walks() {
                    left.extend(project.disordered().iter().map(|&p| p as usize));
                    left.sort_unstable();
                    left.dedup();
                }
                let (device_ms, stats) = projected(&counts, left.len());
                Ok((DrawnFrame { pixels, device_ms, projection: Some(stats), ..DrawnFrame::default() }, left))
            }
            Backend::WalkOnDevice(traverse) => {
                let WalkedFrame { pixels, counts, device_ms } = traverse.render_second(geometry, scene, even, view)?;
                let left = Traverse::unfinished(&pixels);
                Ok((DrawnFrame { pixels, counts, device_ms, ..DrawnFrame::default() }, left))
            }
        }
    }
}

/// The integral as the CPU reads it: exact where a device alone has the table.
fn integral<'a>(frame: &Frame<'a>) -> Integral<'a> {
    let table = frame.table.map(|t| &**t).filter(|t| t.source().is_none());
    Integral { exact: frame.exact, table, second: None }
}

fn on_device<'a, const N: usize>(frame: &Frame<'a>, values: &'a Values<N>) -> DeviceScene<'a, N> {
    let Frame { mesh, exact, table, view, .. } = *frame;
    DeviceScene { geometry: &mesh.geometry, values, exact, table, view }
}

fn walk<const N: usize>(frame: &Frame, values: &Values<N>) -> DrawnFrame {
    let pixel = |v: &[f32; N]| frame.largest(v);
    let geometry = &frame.mesh.geometry;
    let (image, counts) = cpu::render(geometry, values, integral(frame), &pixel, frame.view, frame.progress);
    DrawnFrame { pixels: image.pixels, counts, ..DrawnFrame::default() }
}

fn walk_on<const N: usize>(traverse: &mut Traverse, frame: &Frame, values: &Values<N>) -> Result<DrawnFrame> {
    let geometry = &frame.mesh.geometry;
    let pixel = |v: &[f32; N]| frame.largest(v);
    let mut drawn = traverse.render(&on_device(frame, values))?;
    let unfinished = Traverse::unfinished(&drawn.pixels);
    if frame.view.blend() == Blend::Maximum {
        drawn.pixels.par_iter_mut().for_each(|p| *p = Traverse::largest(p).map_or([0.0; 4], |v: [f32; N]| pixel(&v)));
    }
    let by_cpu = cpu::render_pixels(geometry, values, integral(frame), &pixel, frame.view, &unfinished);
    unfinished.iter().zip(by_cpu).for_each(|(&i, p)| drawn.pixels[i] = p);
    drawn.counts.unfinished = unfinished.len() as u64;
    let _ = (frame.progress)(1.0);
    Ok(DrawnFrame { pixels: drawn.pixels, counts: drawn.counts, device_ms: drawn.device_ms, ..DrawnFrame::default() })
}

fn project_by<const N: usize>(sweep: &mut Sweep, frame: &Frame, values: &Values<N>) -> Result<DrawnFrame> {
    if *frame.projection != ProjectionOptions::default() {
        return Err(Error::Device("the projection engine has variants on a graphics device only".into()));
    }
    let color = |v: &[f32; N]| frame.largest(v);
    Ok(swept(sweep.render(&sweep::Frame {
        geometry: &frame.mesh.geometry,
        values,
        integral: integral(frame),
        view: frame.view,
        color: &color,
        progress: frame.progress,
    })))
}

/// What the projection on the CPU drew.
pub(super) fn swept((pixels, counts): (Vec<[f32; 4]>, sweep::Counts)) -> DrawnFrame {
    let [overlaps, gaps, boundary, dense] = counts.redrawn;
    let sweep = SweepStats {
        dealt_cells: counts.cells,
        fragments: counts.fragments,
        redrawn_overlaps: overlaps,
        redrawn_gaps: gaps,
        redrawn_boundary: boundary,
        redrawn_dense: dense,
        handed_over: counts.handed_over.map(Into::into),
    };
    let mut walked = counts.walked;
    walked.steps += counts.fragments;
    walked.panels += counts.panels;
    DrawnFrame { pixels, counts: walked, sweep: Some(sweep), ..DrawnFrame::default() }
}

fn project_on<const N: usize>(project: &mut Project, frame: &Frame, values: &Values<N>) -> Result<DrawnFrame> {
    let Frame { mesh, view, projection, .. } = frame;
    let (mut pixels, counts) = project.render(&on_device(frame, values), projection)?;
    let mut walked = vec![];
    if view.blend() == Blend::Maximum {
        let color = |p: &[f32; 4]| Traverse::largest(p).map_or([0.0; 4], |v: [f32; N]| frame.largest(&v));
        pixels.par_iter_mut().for_each(|p| *p = color(p));
    } else if projection.walks() {
        walked.extend(project.disordered().iter().map(|&p| p as usize));
        let color = |v: &[f32; N]| frame.largest(v);
        let by_cpu = cpu::render_pixels(&mesh.geometry, values, integral(frame), &color, view, &walked);
        walked.iter().zip(by_cpu).for_each(|(&i, p)| pixels[i] = p);
    }
    let _ = (frame.progress)(1.0);
    let (device_ms, stats) = projected(&counts, walked.len());
    Ok(DrawnFrame { pixels, device_ms, projection: Some(stats), ..DrawnFrame::default() })
}

/// What a projection on a device that left so many pixels to the walk took, by its own clock, in ms; and what is said of it.
fn projected(counts: &project::ProjectionCounts, walked: usize) -> (Option<f64>, ProjectionStats) {
    let project::ProjectionCounts { project_ms, draw_ms, .. } = *counts;
    let stats = ProjectionStats {
        drawn_cells: counts.cells,
        order: counts.order,
        order_ms: counts.order_ms,
        sorts: counts.sorts,
        cycles: counts.cycles,
        cycle_cells: counts.cycle_cells,
        cuts: counts.cuts,
        walked_pixels: walked as u64,
        overlapping_pixels: counts.overlapping,
        project_ms,
        draw_ms,
        fragments: counts.fragments,
    };
    (project_ms.zip(draw_ms).map(|(p, d)| p + d), stats)
}
