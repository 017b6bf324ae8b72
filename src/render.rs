//! The whole flow behind one door: mesh, field, transfer function and view in, image out.

mod answer;
mod automatic;
mod backend;
mod cropped;
mod frame;
mod grid;
mod largest;
mod loaded;
mod naming;
mod neighbours;
mod prepared;
mod recover;
mod second;
mod stats;
mod tables;

use crate::cast::Reconstruction;
use crate::cast::gpu::Caster;
pub use crate::engine::Engine;
use crate::error::{Error, Result};
use crate::field::{Field, Kind};
use crate::geometry::TetMesh;
use crate::gpu::Part;
use crate::gpu::table::builds;
use crate::gpu::{DeviceChoice, Gpu};
use crate::image::Image;
use crate::integral::{Exact, Form, IntegrationOptions, lookup};
use crate::memory;
use crate::mesh::Mesh;
use crate::mesh::cells::Tetrahedra;
use crate::project::ProjectionOptions;
use crate::project::cpu::Sweep;
use crate::transfer::TransferFunction;
use crate::view::{Blend, View};
pub use answer::Answer;
use backend::{Backend, DrawnFrame};
use frame::Frame;
use glam::DVec3;
use grid::LoadedGrid;
use loaded::Loaded;
use neighbours::Stay;
use prepared::{AnyValues, Prepared};
use second::Extra;
pub use stats::{ProjectionStats, Stats, SweepStats};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::Instant;
use tables::{TableKey, Tables};

/// The most threads of a renderer: more take minutes to start, and gain nothing.
pub const MOST_THREADS: usize = 4096;

/// Draws one mesh, as often as wanted; keeps what did not change between frames.
#[derive(Debug)]
pub struct Renderer {
    pool: rayon::ThreadPool,
    choice: DeviceChoice,
    engine: Engine,
    backend: Backend,
    projection: ProjectionOptions,
    mesh: Option<Loaded>,
    stay: Stay,
    /// The grid that is drawn, in place of a mesh.
    grid: Option<LoadedGrid>,
    /// What the device that draws holds of it.
    caster: Caster,
    reconstruction: Reconstruction,
    field: Option<Prepared>,
    transfer: Option<TransferFunction>,
    exact: Option<Exact<f32>>,
    /// What a second variable, or light, needs.
    extra: Extra,
    /// The projection on the CPU that draws that in the place of a device's.
    sweep: Option<Box<Sweep>>,
    /// The engine that was said to draw neither.
    lacking: Option<String>,
    integral: IntegrationOptions,
    tables: Tables,
    /// What of a table is needed, once that is known: none for the exact integral.
    key: Option<Option<Arc<TableKey>>>,
    /// Whether the next frame waits for its table.
    waits: bool,
    /// The device failed to build a table: others are built on the host.
    host_builds: bool,
    /// Pixels of largest values are these values.
    as_values: bool,
    stats: Stats,
}

/// What a caller is told of, and answers to.
type Progress<'a> = dyn Fn(f64) -> ControlFlow<()> + Sync + 'a;

impl Renderer {
    /// A renderer on `threads` threads of its own (0: one for each core) and the best device.
    ///
    /// # Errors
    /// As [`Self::with_device`].
    pub fn new(threads: usize) -> Result<Self> {
        Self::with_device(threads, DeviceChoice::Auto)
    }

    /// A renderer on `threads` threads of its own and the chosen device.
    ///
    /// # Errors
    /// [`Error::Render`] if the threads cannot be started, or are more than [`MOST_THREADS`]; [`Error::Device`] if the device is none of this machine's,
    /// or cannot be used. With [`DeviceChoice::Auto`] the CPU draws then.
    pub fn with_device(threads: usize, choice: DeviceChoice) -> Result<Self> {
        Self::with_engine(threads, choice, Engine::Auto)
    }

    /// A renderer on `threads` threads of its own and the chosen device, which draws with `engine`.
    ///
    /// # Errors
    /// As [`Self::with_device`]; and [`Error::Device`] if the engine is [`Engine::Project`] and there is no graphics
    /// device.
    pub fn with_engine(threads: usize, choice: DeviceChoice, engine: Engine) -> Result<Self> {
        if threads > MOST_THREADS {
            return Err(Error::Render(format!("there are {MOST_THREADS} threads at most, and not {threads}")));
        }
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|i| format!("halite-{i}"))
            .build()
            .map_err(|e| Error::Render(format!("cannot start {threads} threads: {e}")))?;
        let choice = choice.or_environment();
        let backend = Backend::open(engine, &choice)?;
        let mut renderer = Renderer {
            pool,
            choice,
            engine,
            backend,
            projection: ProjectionOptions::default(),
            mesh: None,
            stay: Stay::default(),
            grid: None,
            caster: Caster::default(),
            reconstruction: Reconstruction::default(),
            field: None,
            transfer: None,
            exact: None,
            extra: Extra::default(),
            sweep: None,
            lacking: None,
            integral: IntegrationOptions::default(),
            tables: Tables::default(),
            key: None,
            waits: true,
            host_builds: false,
            as_values: false,
            stats: Stats::default(),
        };
        renderer.name_device();
        Ok(renderer)
    }

    #[cfg(test)]
    pub(crate) fn backend(&mut self) -> &mut Backend {
        &mut self.backend
    }

    /// Takes `part` for changed, wherever it is kept.
    fn invalidate(&mut self, part: Part) {
        (self.exact, self.key) = (None, None);
        match part {
            Part::Function => self.extra.invalidate_function(),
            Part::Mesh | Part::Field | Part::Points => self.extra.invalidate_field(),
        }
        self.caster.invalidate(part);
        self.backend.invalidate(part);
        self.backend.invalidate(Part::Function);
    }

    /// Draws with other variants of the projection engine from now on; nothing to other engines.
    pub fn set_projection(&mut self, projection: ProjectionOptions) {
        self.projection = projection;
        self.name_device();
    }

    /// Integrates segments in another form from now on. The next frame waits for its table, if one was named; with
    /// [`Form::Auto`] frames are exact until there is a table.
    pub fn set_integral(&mut self, integral: IntegrationOptions) {
        if self.integral != integral {
            self.integral = integral;
            // Values may have to be in the range of tables.
            self.exact = None;
            self.extra.invalidate_function();
            self.grid.iter_mut().for_each(LoadedGrid::invalidate_function);
            (self.key, self.waits, self.host_builds) = (None, integral.form != Form::Auto, false);
            self.name_device();
        }
    }

    /// Has the next frame wait for its table. Else one that follows a change of the transfer function is drawn with the
    /// exact integral while its table is built, and so are those after it until that is done.
    pub fn wait_for_table(&mut self) {
        self.waits = true;
    }

    /// Runs `work`, such as reading a file, on the renderer's threads.
    pub fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.pool.install(work)
    }

    /// Draws another mesh from now on; the field must be set again.
    ///
    /// # Errors
    /// Those of [`Tetrahedra::new`], and [`Error::NoMemory`] if there is no room for the mesh as engines read it.
    pub fn set_mesh(&mut self, mesh: &Mesh) -> Result<()> {
        let tetrahedra = self.install(|| Tetrahedra::new(mesh))?;
        tetrahedra.log();
        self.check_room(mesh.points().len(), &tetrahedra)?;
        self.set_tetrahedra(mesh, tetrahedra);
        Ok(())
    }

    /// As [`Self::set_mesh`], of a mesh that is split into `tetrahedra` already.
    pub fn set_tetrahedra(&mut self, mesh: &Mesh, tetrahedra: Tetrahedra) {
        self.set_tetrahedra_with_progress(mesh, tetrahedra, &|_| {});
    }

    /// As [`Self::set_tetrahedra`]; `report` is called, on any thread, with the share of the work that is done: from 0 to 1,
    /// never falling.
    pub fn set_tetrahedra_with_progress(&mut self, mesh: &Mesh, tetrahedra: Tetrahedra, report: &(dyn Fn(f64) + Sync)) {
        self.load(mesh.points(), mesh.cells().len(), tetrahedra, report);
    }

    /// As [`Self::set_tetrahedra_with_progress`], of a mesh of so many `cells` and these points.
    pub(crate) fn load(
        &mut self,
        points: &[DVec3],
        cells: usize,
        tetrahedra: Tetrahedra,
        report: &(dyn Fn(f64) + Sync),
    ) {
        self.grid = None;
        let start = Instant::now();
        self.stay.change();
        let mut needs = self.backend.needs();
        needs.neighbours |= self.orders_by_neighbours();
        let mesh = self.pool.install(|| Loaded::new(points, cells, tetrahedra, needs, report));
        report(1.0);
        self.stats.faces_ms = ms(start);
        self.stats.cells = cells as u64;
        self.stats.tetrahedra = mesh.tetrahedra.corners.len() as u64;
        self.stats.device_bytes = mesh.geometry.bytes();
        self.field = None;
        self.invalidate(Part::Mesh);
        self.mesh = Some(mesh);
        self.name_device();
        self.waits = self.integral.form != Form::Auto;
    }

    /// Moves the points of the mesh; cells, fields and values stay. Cells keep their neighbours, so none may turn
    /// inside out, and points that shared a position still must; else set the mesh.
    ///
    /// # Errors
    /// [`Error::Render`] if there is no mesh; [`Error::Mesh`] if it has another number of points, or a cell that is
    /// drawn has one that is not finite.
    pub fn set_points(&mut self, points: &[DVec3]) -> Result<()> {
        let mesh = self.mesh.as_mut().ok_or_else(|| Error::Render("points need a mesh first".into()))?;
        if points.len() != mesh.points {
            let [now, before] = [points.len(), mesh.points];
            return Err(Error::Mesh(format!("{now} points cannot take the place of {before}")));
        }
        let scale = mesh.geometry.scale;
        let moved = self.pool.install(|| mesh.tetrahedra.points(points));
        if let Some(p) = mesh.geometry.point_of.iter().find(|&&p| !moved[p as usize].is_finite()) {
            return Err(Error::Mesh(format!("a cell that is drawn has the point {p}, which is not finite any more")));
        }
        self.pool.install(|| mesh.geometry.set_points(&moved));
        let scaled = mesh.geometry.scale != scale;
        self.key = None;
        mesh.judge_again(self.backend.needs());
        if mesh.left_to_walk && !mesh.connected {
            return self.connect(points);
        }
        self.name_device();
        self.extra.invalidate_field();
        self.backend.invalidate(Part::Points);
        // Extinction counts per normalised length.
        if scaled {
            self.invalidate(Part::Function);
        }
        Ok(())
    }

    /// Finds the neighbours of cells of a mesh that the backend leaves to the walk now; its points are these.
    fn connect(&mut self, points: &[DVec3]) -> Result<()> {
        let field = self.field.take();
        if let Some(Loaded { tetrahedra, cells, .. }) = self.mesh.take() {
            self.load(points, cells, tetrahedra, &|_| {});
        }
        if let (Some(mut field), Some(mesh)) = (field, &self.mesh) {
            self.pool.install(|| field.bring_to(mesh))?;
            self.field = Some(field);
        }
        Ok(())
    }

    /// Draws another field of the mesh, or grid, from now on.
    ///
    /// # Errors
    /// [`Error::Render`] if there is neither; [`Error::Field`] if the field does not fit it.
    pub fn set_field(&mut self, field: &Field) -> Result<()> {
        if self.grid.is_some() {
            return self.set_grid_field(field);
        }
        let start = Instant::now();
        let mesh = self.mesh.as_ref().ok_or_else(|| Error::Render("a field needs a mesh first".into()))?;
        let tables = self.integral.form != Form::Exact;
        let transfer = self.transfer.as_ref();
        let prepared = self.pool.install(|| Prepared::new(mesh, field, transfer, tables))?;
        self.stats.device_bytes = mesh.geometry.bytes() + prepared.values.bytes();
        self.field = Some(prepared);
        self.invalidate(Part::Field);
        self.waits = self.integral.form != Form::Auto;
        self.stats.upload_ms = ms(start);
        Ok(())
    }

    /// Draws with another transfer function from now on.
    pub fn set_transfer(&mut self, transfer: &TransferFunction) {
        self.transfer = Some(transfer.clone());
        if let Some(grid) = &mut self.grid {
            grid.invalidate_function();
        }
        self.invalidate(Part::Function);
        self.name_device();
    }

    /// Draws a frame. `progress` is told the share that is done, in [0, 1], and may be called from several threads. It
    /// may answer [`ControlFlow::Break`]: the frame is then given up, on the CPU soon.
    ///
    /// A device that is lost is opened again, once a frame; where that fails, the CPU draws from then on.
    ///
    /// # Errors
    /// [`Error::Render`] if mesh, field or transfer function were never set; [`Error::Memory`] if they do not fit the
    /// device, and [`Error::Device`] if it refuses them, unless it was not named; [`Error::Aborted`] if `progress`
    /// wanted no more.
    pub fn render<A: Answer>(&mut self, view: &View, progress: &(dyn Fn(f64) -> A + Sync)) -> Result<Image> {
        let stopped = AtomicBool::new(false);
        let tell = |share: f64| {
            if progress(share).stops() {
                stopped.store(true, Relaxed);
            }
            if stopped.load(Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let image = self.render_cropped(view, &tell)?;
        self.stay.draw();
        if stopped.load(Relaxed) { Err(Error::Aborted) } else { Ok(image) }
    }

    /// Whether there is memory to draw so many tetrahedra, in a mesh of so many points.
    ///
    /// # Errors
    /// [`Error::NoMemory`] if there is not.
    pub fn check_room(&self, points: usize, tetrahedra: &Tetrahedra) -> Result<()> {
        let (points, count) = (points + tetrahedra.added.len(), tetrahedra.corners.len());
        memory::check(&format!("{count} tetrahedra of {points} points"), TetMesh::room(points, count))
    }

    /// Normalises the values anew if the transfer function has changed and asks for it.
    fn fit_values(&mut self) -> Result<()> {
        let (None, Some(mesh), Some(field), Some(transfer)) =
            (&self.exact, &self.mesh, &mut self.field, &self.transfer)
        else {
            return Ok(());
        };
        let tables = self.integral.form != Form::Exact;
        let changed = self.pool.install(|| field.fit(mesh, transfer, tables))?;
        field.warn(transfer);
        if changed {
            self.invalidate(Part::Field);
        }
        Ok(())
    }

    fn try_render(&mut self, view: &View, progress: &Progress) -> Result<Image> {
        if self.grid.is_some() {
            return self.cast(view, progress);
        }
        if self.transfer.as_ref().is_some_and(|t| !t.is_of_one_variable()) {
            return self.render_second(view, progress);
        }
        let start = Instant::now();
        self.connect_for_order()?;
        let walks = self.mesh.as_ref().is_some_and(|m| m.left_to_walk);
        let on_device =
            !walks && !self.host_builds && self.backend.gpu().is_some_and(|gpu| builds(gpu, &self.integral));
        self.fit_values()?;
        let mesh = self.mesh.as_mut().ok_or_else(|| missing("mesh"))?;
        let field = self.field.as_ref().ok_or_else(|| missing("field"))?;
        let transfer = self.transfer.as_ref().ok_or_else(|| missing("transfer function"))?;
        let (kind, normal) = (field.kind(), field.normal());
        let exact = self.exact.get_or_insert_with(|| Exact::new(transfer, kind, normal, mesh.geometry.scale));
        let key = match &self.key {
            Some(key) => key,
            None => {
                let mut choice = self.integral;
                self.stats.knots_per_cell = 0.0;
                if choice.form == Form::Auto {
                    self.stats.knots_per_cell = match &field.values {
                        AnyValues::Scalar(v) => tables::knots_in_cells(&mesh.geometry, v, exact),
                        AnyValues::Pair(v) => tables::knots_in_cells(&mesh.geometry, v, exact),
                        AnyValues::Rgba(v) => tables::knots_in_cells(&mesh.geometry, v, exact),
                    };
                    choice = self.integral.resolved(self.stats.knots_per_cell, exact.opacity.len());
                    if choice.check_function(exact).is_err() {
                        choice.form = Form::Exact;
                    }
                }
                if choice.form.is_of_second_order() {
                    let form = choice.form.name();
                    return Err(Error::Render(format!("{form}: such tables are for regular and rectilinear grids")));
                }
                lookup::check(&choice, choice.size(exact.opacity.len()), kind)?;
                choice.check_function(exact)?;
                let key = (choice.form != Form::Exact).then(|| {
                    let (pool, geometry) = (&self.pool, &mesh.geometry);
                    let longest = *mesh.longest.get_or_insert_with(|| pool.install(|| geometry.longest_edge()));
                    let exact = Exact::new(transfer, kind, normal, geometry.scale);
                    // Devices build colours, and no weights of such.
                    let on_device = on_device && kind == Kind::Scalar;
                    Arc::new(TableKey { exact, choice, longest, on_device })
                });
                self.key.insert(key)
            }
        };
        // The largest value along a ray is found without an integral.
        let built = match key.as_ref().filter(|_| view.blend() == Blend::Composite) {
            Some(key) => self.tables.get(key, self.waits, &self.pool)?,
            None => None,
        };
        if let (Some(key), Some(built)) = (key, built.as_ref().filter(|b| b.table.source().is_some())) {
            let asked = Instant::now();
            match self.backend.ensure_resident(exact, &built.table, self.waits) {
                Err(e @ Error::Lost(_)) => return Err(e),
                Err(e) => {
                    tracing::warn!("{e}; building the table on the CPU");
                    (self.host_builds, self.key) = (true, None);
                    return self.try_render(view, progress);
                }
                Ok(()) if self.waits => self.tables.took(key, ms(asked)),
                Ok(()) => {}
            }
        }
        let late = key.as_ref().filter(|_| view.blend() == Blend::Composite && built.is_none()).cloned();
        let (mesh, table) = (&*mesh, built.as_ref().map(|b| &b.table));
        self.waits = false;
        self.stats.integral = table.map_or(Form::Exact, |t| t.options().form).name().into();
        self.stats.table_ms = built.as_ref().map_or(0.0, |b| b.ms);
        self.stats.table_bytes = table.map_or(0, |t| IntegrationOptions::bytes(t.size()));
        // What draws by itself is exact: variants are for those who ask for the projection.
        let none = ProjectionOptions::default();
        let projection = if self.engine == Engine::Auto { &none } else { &self.projection };
        let as_values = self.as_values;
        let frame = Frame { mesh, field, transfer, exact, table, view, projection, as_values, progress };
        let uploaded = self.backend.gpu().map_or(0, Gpu::uploaded);
        let mut walk = Backend::Walk;
        let backend = if mesh.left_to_walk { &mut walk } else { &mut self.backend };
        let drawn = self.pool.install(|| match &field.values {
            AnyValues::Scalar(v) => backend.draw(&frame, v),
            AnyValues::Pair(v) => backend.draw(&frame, v),
            AnyValues::Rgba(v) => backend.draw(&frame, v),
        })?;
        if let Some(gpu) = self.backend.gpu() {
            self.stats.uploaded_bytes = gpu.uploaded() - uploaded;
            self.stats.device_bytes = gpu.allocated();
        }
        let DrawnFrame { pixels, counts, device_ms, projection, sweep } = drawn;
        self.stats.device_ms = device_ms;
        self.stats.steps = counts.steps;
        self.stats.retraced_rays = counts.retraced;
        (self.stats.cpu_rays, self.stats.panels, self.stats.culled_cells) = (counts.unfinished, 0, 0);
        (self.stats.projection, self.stats.sweep) = (projection, sweep);
        self.stats.frame_ms = ms(start);
        self.build_next(late)?;
        Ok(Image { size: view.size(), pixels })
    }

    /// What the last calls did.
    pub fn stats(&self) -> &Stats {
        &self.stats
    }
}

fn missing(what: &str) -> Error {
    Error::Render(format!("there is no {what} to draw"))
}

fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
