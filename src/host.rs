//! What a program that embeds Halite needs around a [`Renderer`]: calls that never unwind, progress reported on the
//! caller's own thread, points under a matrix, and a log of its own.

mod grid;
mod log;
#[cfg(test)]
mod tests;

pub use log::{Log, carried};

use crate::cast::{Reconstruction, ReconstructionOrder, Sampling};
use crate::error::{Error, Result};
use crate::field::Field;
use crate::gpu::DeviceChoice;
use crate::image::Image;
use crate::integral::IntegrationOptions;
use crate::mesh::Mesh;
use crate::mesh::cells::Tetrahedra;
use crate::project::ProjectionOptions;
use crate::render::{Renderer, Stats};
use crate::transfer::TransferFunction;
use crate::view::View;
use glam::{DMat4, DVec3};
use rayon::prelude::*;
use serde::de::value::StrDeserializer;
use serde::de::{DeserializeOwned, IntoDeserializer};
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// How often the caller is told the progress of a frame.
const TELL: Duration = Duration::from_millis(20);

/// What scenes call `name`, in letters of either case; the default if it is empty.
///
/// # Errors
/// [`Error::Render`] if there is no such `what`, with the names that there are.
pub fn named<T: DeserializeOwned + Default>(what: &str, name: &str) -> Result<T> {
    if name.is_empty() {
        return Ok(T::default());
    }
    let lower = name.to_ascii_lowercase();
    let known: StrDeserializer<'_, Known> = lower.as_str().into_deserializer();
    T::deserialize(known).map_err(|known| Error::Render(format!("no {what} is called \"{name}\"; {known}")))
}

/// The names that there are, where one was asked for that there is not.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct Known(String);

impl serde::de::Error for Known {
    fn custom<T: std::fmt::Display>(said: T) -> Self {
        Known(said.to_string())
    }

    fn unknown_variant(_: &str, names: &'static [&'static str]) -> Self {
        Known(format!("there are \"{}\"", names.join("\", \"")))
    }
}

/// Runs `work`; a panic in it is an error.
///
/// # Errors
/// That of `work`, or [`Error::Render`] with what the panic said.
pub fn guard<T>(work: impl FnOnce() -> Result<T>) -> Result<T> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        let said = panic.downcast_ref::<&str>().map(ToString::to_string);
        let said = said.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default();
        Err(Error::Render(format!("Halite failed, which is a bug: {}", said.replace('\n', " "))))
    })
}

/// A renderer inside another program. After a panic it refuses all further work.
#[derive(Debug)]
pub struct Session {
    renderer: Renderer,
    state: State,
    /// Whether the matrix of the mesh that is drawn turns right hands into left ones.
    mirrored: bool,
    /// Points of the mesh that are not finite, ascending: their cells were left out when it was set.
    hidden: Vec<usize>,
    log: Log,
    failed: bool,
}

/// What a session has to draw.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    NoMesh,
    /// The mesh has no cell that could be seen: its pictures are empty.
    Empty,
    Mesh,
    Grid,
}

impl Session {
    /// A session with `threads` threads of its own (0: one for each core), on a device as [`DeviceChoice::parse`] reads
    /// it. What it logs, now and in [`Session::guarded`], goes to `log`.
    ///
    /// # Errors
    /// Those of [`Renderer::with_engine`]; [`Error::Render`] if no [`crate::engine::Engine`] is called `engine`; empty is the default.
    pub fn new(threads: usize, device: &str, engine: &str, log: Log) -> Result<Self> {
        let engine = named("engine", engine)?;
        let renderer = log.collect(|| Renderer::with_engine(threads, DeviceChoice::parse(device), engine))?;
        Ok(Session { renderer, state: State::NoMesh, mirrored: false, hidden: vec![], log, failed: false })
    }

    /// Integrates in another form from now on; as at first, exactly, until this is called.
    ///
    /// # Errors
    /// [`Error::Render`] if there can be no table of that form. What the form does not read is not checked.
    pub fn set_integral(&mut self, choice: IntegrationOptions) -> Result<()> {
        choice.check(choice.size(0))?;
        self.renderer.set_integral(choice);
        Ok(())
    }

    /// Draws by another variant of the projection engine from now on; nothing to other engines.
    pub fn set_projection(&mut self, projection: ProjectionOptions) {
        self.renderer.set_projection(projection);
    }

    /// Rebuilds the fields of regular and rectilinear grids between samples by an order that options know by this name, or
    /// `exact`ly if it is empty; with samples so many world units apart, or, if that is 0, at the faces of voxels and midway.
    ///
    /// # Errors
    /// [`Error::Render`] if no order is called so, or the distance is negative or not finite.
    pub fn set_reconstruction(&mut self, order: &str, distance: f64) -> Result<()> {
        let order = match order {
            "" => ReconstructionOrder::Exact,
            name => name.parse().map_err(|e| Error::Render(format!("reconstruction: {e}")))?,
        };
        if !(distance >= 0.0 && distance.is_finite()) {
            return Err(Error::Render(format!(
                "the distance of samples is {distance}; it must be 0 or more world units"
            )));
        }
        let sampling = if distance > 0.0 { Sampling::Steps(distance) } else { Sampling::Voxels };
        self.renderer.set_reconstruction(Reconstruction { order, sampling });
        Ok(())
    }

    /// Runs `work` on this session, and collects what it logs. After a panic it is not what it should be, and says so.
    ///
    /// # Errors
    /// Those of [`guard`]; [`Error::Render`] after a panic.
    pub fn guarded<T>(&mut self, work: impl FnOnce(&mut Self) -> Result<T>) -> Result<T> {
        if self.failed {
            return Err(Error::Render("this renderer failed before and cannot go on; make another".into()));
        }
        self.failed = true;
        let mut finished = false;
        let log = self.log.clone();
        let result = guard(|| {
            let result = log.collect(|| work(self));
            finished = true;
            result
        });
        self.failed = !finished;
        result
    }

    /// Draws `mesh`, under a matrix, from now on; the field must be set again. A mesh with nothing to draw is no error:
    /// its pictures are empty.
    ///
    /// # Errors
    /// [`Error::Mesh`] as [`Tetrahedra::new`], or if the matrix is not affine or not finite.
    pub fn set_mesh(&mut self, mesh: &Mesh, matrix: DMat4) -> Result<()> {
        check_matrix(matrix)?;
        self.hidden = self.renderer.install(|| not_finite(mesh.points()));
        // Cells are split where the mesh has them, so that its pictures under a matrix do not depend on those before.
        let tetrahedra = match self.renderer.install(|| Tetrahedra::new(mesh)) {
            Err(Error::Empty(why)) => {
                if !mesh.cells().is_empty() {
                    tracing::warn!("nothing is drawn of the mesh: {why}");
                }
                self.state = State::Empty;
                return Ok(());
            }
            other => other?,
        };
        tetrahedra.log();
        self.mirrored = matrix.determinant() < 0.0;
        let moved = (matrix != DMat4::IDENTITY).then(|| self.renderer.install(|| transformed(mesh.points(), matrix)));
        let moved = moved.transpose()?;
        self.renderer.check_room(mesh.points().len(), &tetrahedra)?;
        match moved {
            None => self.renderer.set_tetrahedra(mesh, tetrahedra),
            Some(moved) if self.mirrored => self.renderer.load(&moved, mesh.cells().len(), tetrahedra, &|_| {}),
            Some(moved) => {
                self.renderer.set_tetrahedra(mesh, tetrahedra);
                self.renderer.set_points(&moved)?;
            }
        }
        self.state = State::Mesh;
        Ok(())
    }

    /// Draws the mesh with its points moved, under another matrix. False if that cannot be, because the matrix makes a
    /// mirror image of what was drawn, other points are not finite than were, or a grid is drawn: it must then be set again.
    ///
    /// # Errors
    /// [`Error::Mesh`] if there are not as many points as before, or the matrix is not affine or not finite.
    pub fn set_points(&mut self, points: &[DVec3], matrix: DMat4) -> Result<bool> {
        check_matrix(matrix)?;
        match self.state {
            State::NoMesh | State::Grid => Ok(false),
            _ if self.renderer.install(|| not_finite(points)) != self.hidden => Ok(false),
            State::Empty => Ok(true),
            State::Mesh if self.mirrored != (matrix.determinant() < 0.0) => Ok(false),
            State::Mesh => {
                let moved = self.renderer.install(|| transformed(points, matrix))?;
                self.renderer.set_points(&moved).map(|()| true)
            }
        }
    }

    /// Draws another field of the mesh.
    ///
    /// # Errors
    /// Those of `field`, and of [`Renderer::set_field`].
    pub fn set_field(&mut self, field: impl FnOnce() -> Result<Field> + Send) -> Result<()> {
        if self.state == State::Empty {
            return Ok(());
        }
        let field = self.renderer.install(field)?;
        self.renderer.set_field(&field)
    }

    /// Draws with another transfer function.
    pub fn set_transfer(&mut self, transfer: &TransferFunction) {
        self.renderer.set_transfer(transfer);
    }

    /// Draws a frame. While that takes, `progress` is told every 20 ms, on this thread, the share that is done; false
    /// ends it.
    ///
    /// # Errors
    /// Those of [`Renderer::render`], and of `progress`.
    pub fn render(&mut self, view: &View, progress: &mut dyn FnMut(f64) -> Result<bool>) -> Result<Image> {
        if self.state == State::Empty {
            return Ok(Image::new(view.size()));
        }
        let (share, stop) = (AtomicU64::new(0), AtomicBool::new(false));
        let (sender, receiver) = channel();
        let renderer = &mut self.renderer;
        let mut trouble = None;
        let drawn = std::thread::scope(|scope| {
            let tell = |done: f64| {
                share.store(done.to_bits(), Relaxed);
                if stop.load(Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            };
            let worker = scope.spawn(carried(move || {
                // The receiver outlives this thread.
                let _ = sender.send(renderer.render(view, &tell));
            }));
            loop {
                match receiver.recv_timeout(TELL) {
                    Ok(drawn) => break drawn,
                    Err(RecvTimeoutError::Timeout) => match progress(f64::from_bits(share.load(Relaxed))) {
                        Ok(true) => {}
                        Ok(false) => stop.store(true, Relaxed),
                        Err(e) => {
                            stop.store(true, Relaxed);
                            trouble.get_or_insert(e);
                        }
                    },
                    Err(RecvTimeoutError::Disconnected) => match worker.join() {
                        Err(panic) => std::panic::resume_unwind(panic),
                        Ok(()) => break Err(Error::Render("the frame was lost".into())),
                    },
                }
            }
        });
        trouble.map_or(drawn, Err)
    }

    /// What the last calls did.
    pub fn stats(&self) -> &Stats {
        self.renderer.stats()
    }
}

fn check_matrix(matrix: DMat4) -> Result<()> {
    if matrix.is_finite() && matrix.row(3).to_array() == [0.0, 0.0, 0.0, 1.0] {
        return Ok(());
    }
    Err(Error::Mesh("the matrix of the mesh is not affine, or not finite".into()))
}

/// Which points are not finite, ascending.
fn not_finite(points: &[DVec3]) -> Vec<usize> {
    points.par_iter().enumerate().filter(|(_, p)| !p.is_finite()).map(|(i, _)| i).collect()
}

/// `points` under an affine matrix; those that are not finite stay so.
fn transformed(points: &[DVec3], matrix: DMat4) -> Result<Vec<DVec3>> {
    crate::memory::check_array::<DVec3>("the points where they are drawn", points.len())?;
    Ok(points.par_iter().map(|&p| matrix.transform_point3(p)).collect())
}
