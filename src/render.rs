//! The whole flow behind one door: mesh, field, transfer function and view in, image out.

use crate::error::{Error, Result};
use crate::field::{Field, Kind, Normal};
use crate::image::Image;
use crate::integral::Exact;
use crate::mesh::Mesh;
use crate::mesh::cells::Tetrahedra;
use crate::mesh::faces::Faces;
use crate::transfer::TransferFunction;
use crate::traverse::{Geometry, Values, cpu};
use crate::view::View;
use std::time::Instant;

/// Draws one mesh, as often as wanted; keeps what did not change between frames.
#[derive(Debug)]
pub struct Renderer {
    pool: rayon::ThreadPool,
    mesh: Option<Loaded>,
    field: Option<Prepared>,
    transfer: Option<TransferFunction>,
    exact: Option<Exact<f32>>,
    stats: Stats,
}

/// The mesh that is drawn.
#[derive(Debug)]
struct Loaded {
    tetrahedra: Tetrahedra,
    geometry: Geometry,
    points: usize,
    cells: usize,
}

/// The field that is drawn.
#[derive(Debug)]
struct Prepared {
    normal: [Normal; 4],
    values: AnyValues,
}

#[derive(Debug)]
enum AnyValues {
    Scalar(Values<1>),
    Pair(Values<2>),
    Rgba(Values<4>),
}

/// What a renderer did and how long it took.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct Stats {
    /// Name of the engine: "traverse".
    pub engine: String,
    /// "cpu" or "gpu".
    pub device: String,
    /// The processor or adapter.
    pub adapter: String,
    /// Cells of the mesh, of all types.
    pub cells: u64,
    /// Tetrahedra that the 3D cells were split into.
    pub tetrahedra: u64,
    /// Matching faces, ordering cells and building the boundary hierarchy, in ms.
    pub faces_ms: f64,
    /// Handing field and transfer function to the device, in ms.
    pub upload_ms: f64,
    /// The last frame, in ms.
    pub frame_ms: f64,
    /// Tetrahedra visited in the last frame, over all rays.
    pub steps: u64,
    /// Rays of the last frame that had to be traced again beside an edge.
    pub repaired_rays: u64,
    /// Memory held on the device for mesh and field, in bytes.
    pub device_bytes: u64,
}

impl Renderer {
    /// A renderer on `threads` threads of its own (0: one for each core).
    ///
    /// # Errors
    /// [`Error::Render`] if the threads cannot be started.
    pub fn new(threads: usize) -> Result<Self> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|i| format!("halite-{i}"))
            .build()
            .map_err(|e| Error::Render(format!("cannot start {threads} threads: {e}")))?;
        let stats = Stats {
            engine: "traverse".into(),
            device: "cpu".into(),
            adapter: format!("{} threads", pool.current_num_threads()),
            ..Stats::default()
        };
        Ok(Renderer { pool, mesh: None, field: None, transfer: None, exact: None, stats })
    }

    /// Runs `work`, such as reading a file, on the renderer's threads.
    pub fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.pool.install(work)
    }

    /// Draws another mesh from now on, split into `tetrahedra`; the field must be set again.
    pub fn set_mesh(&mut self, mesh: &Mesh, tetrahedra: Tetrahedra) {
        let start = Instant::now();
        let geometry = self.pool.install(|| {
            let faces = Faces::new(mesh.points(), &tetrahedra.corners);
            Geometry::new(mesh.points(), &tetrahedra, &faces)
        });
        self.stats.faces_ms = ms(start);
        self.stats.cells = mesh.cells().len() as u64;
        self.stats.tetrahedra = tetrahedra.corners.len() as u64;
        self.stats.device_bytes = geometry.bytes();
        (self.field, self.exact) = (None, None);
        self.mesh = Some(Loaded { tetrahedra, geometry, points: mesh.points().len(), cells: mesh.cells().len() });
    }

    /// Draws another field of the mesh from now on.
    ///
    /// # Errors
    /// [`Error::Render`] if there is no mesh; [`Error::Field`] if the field does not fit it.
    pub fn set_field(&mut self, field: &Field) -> Result<()> {
        let start = Instant::now();
        let mesh = self.mesh.as_ref().ok_or_else(|| Error::Render("a field needs a mesh first".into()))?;
        let values = self.pool.install(|| match field.kind() {
            Kind::Scalar => mesh.values(field).map(AnyValues::Scalar),
            Kind::Pair => mesh.values(field).map(AnyValues::Pair),
            Kind::Rgba => mesh.values(field).map(AnyValues::Rgba),
        })?;
        self.stats.device_bytes = mesh.geometry.bytes()
            + match &values {
                AnyValues::Scalar(v) => v.bytes(),
                AnyValues::Pair(v) => v.bytes(),
                AnyValues::Rgba(v) => v.bytes(),
            };
        self.field = Some(Prepared { normal: [0, 1, 2, 3].map(|k| field.normal(k)), values });
        self.exact = None;
        self.stats.upload_ms = ms(start);
        Ok(())
    }

    /// Draws with another transfer function from now on.
    pub fn set_transfer(&mut self, transfer: &TransferFunction) {
        self.transfer = Some(transfer.clone());
        self.exact = None;
    }

    /// Draws a frame. `progress` is told the share that is done, in [0, 1], and may be called from several threads.
    ///
    /// # Errors
    /// [`Error::Render`] if mesh, field or transfer function were never set.
    pub fn render(&mut self, view: &View, progress: &(dyn Fn(f64) + Sync)) -> Result<Image> {
        let start = Instant::now();
        let missing = |what: &str| Error::Render(format!("there is no {what} to draw"));
        let mesh = self.mesh.as_ref().ok_or_else(|| missing("mesh"))?;
        let field = self.field.as_ref().ok_or_else(|| missing("field"))?;
        let transfer = self.transfer.as_ref().ok_or_else(|| missing("transfer function"))?;
        let kind = match field.values {
            AnyValues::Scalar(_) => Kind::Scalar,
            AnyValues::Pair(_) => Kind::Pair,
            AnyValues::Rgba(_) => Kind::Rgba,
        };
        let exact = self.exact.get_or_insert_with(|| Exact::new(transfer, kind, &field.normal, mesh.geometry.scale));
        let frame = Frame { mesh, field, transfer, exact, view, progress };
        let (image, counts) = self.pool.install(|| match &field.values {
            AnyValues::Scalar(v) => frame.render(v),
            AnyValues::Pair(v) => frame.render(v),
            AnyValues::Rgba(v) => frame.render(v),
        });
        self.stats.steps = counts.steps;
        self.stats.repaired_rays = counts.repaired;
        self.stats.frame_ms = ms(start);
        Ok(image)
    }

    /// What the last calls did.
    pub fn stats(&self) -> &Stats {
        &self.stats
    }
}

impl Loaded {
    fn values<const N: usize>(&self, field: &Field) -> Result<Values<N>> {
        Values::new(&self.geometry, &self.tetrahedra, self.points, self.cells, field)
    }
}

/// Everything that a frame depends on.
struct Frame<'a> {
    mesh: &'a Loaded,
    field: &'a Prepared,
    transfer: &'a TransferFunction,
    exact: &'a Exact<f32>,
    view: &'a View,
    progress: &'a (dyn Fn(f64) + Sync),
}

impl Frame<'_> {
    fn render<const N: usize>(&self, values: &Values<N>) -> (Image, cpu::Counts) {
        cpu::render(&self.mesh.geometry, values, self.exact, &|v| self.largest(v), self.view, self.progress)
    }

    /// The pixel of a ray whose largest values are `v`: colour and opacity there, premultiplied.
    fn largest<const N: usize>(&self, v: &[f32; N]) -> [f32; 4] {
        let own = |k: usize| self.field.normal[k].invert(f64::from(v[k]));
        let [r, g, b] =
            if N == 4 { [own(0), own(1), own(2)].map(|c| c.clamp(0.0, 1.0)) } else { self.transfer.color_at(own(0)) };
        let a = self.transfer.opacity_at(own(N - 1)).min(1.0);
        [r * a, g * a, b * a, a].map(|c| c as f32)
    }
}

fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
