//! Pre-integrated tables, built on a device: the same texels as `integral::table` has, in `shaders/construct.wgsl`.
//!
//! A `Plan` says what is dispatched for a table; `TableBuilder` does it, and leaves the texels on the device. What draws
//! copies them into its texture there (`table`), and [`Constructor`] hands them back, to be compared.

mod second_order;

use super::buffers::Buffer;
use super::raster::{self, Readback, Slot};
use super::shader::{self, ShaderVariant};
use super::{DeviceChoice, Gpu, function};
use crate::error::Result;
use crate::field::{self, Normalization};
use crate::integral::lookup::TableData;
use crate::integral::table::{
    Cylindrical, Kind, Nodes, OPAQUE_DEPTH, Polynomial, Sampling, Steps, THINNEST, Table, length,
};
use crate::integral::{Exact, table};
use crate::transfer::TransferFunction;
use bytemuck::{Pod, Zeroable};
use std::time::Instant;
use wgpu::{BufferUsages as Usage, ShaderStages as Stages};

const CONSTRUCT: &str = include_str!("../../shaders/construct.wgsl");

/// Slices that one job knows the lengths of.
const MOST_SLICES: usize = 256;

/// Texels of rows that are copied to textures are a multiple of this: 256 bytes.
const ROW: u32 = 16;

/// How the texels of a volume are found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Construction {
    /// In closed form, per interval of the function.
    Closed,
    /// By numeric integration.
    Sampled(Sampling),
    /// Each slice from the one before.
    Incremental,
}

/// `BuildJob` in the shader.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct BuildJob {
    size: u32,
    slices: u32,
    first: u32,
    normalised: u32,
    entries: u32,
    samples: u32,
    oversampling: f32,
    most: f32,
    longest: f32,
    degree: u32,
    count: u32,
    pitch: u32,
    lengths: [f32; MOST_SLICES],
    weights: [[f32; 8]; 5],
}

/// Entry points, in the order of the pipelines.
const ENTRIES: [&str; 6] = ["closed", "coefficients", "sampled", "doubled", "longer", "cylinder"];
const CLOSED: usize = 0;
const COEFFICIENTS: usize = 1;
const SAMPLED: usize = 2;
const DOUBLED: usize = 3;
const LONGER: usize = 4;
const CYLINDER: usize = 5;

/// One dispatch: which pipeline, with what, and how many groups.
type Dispatch = (usize, BuildJob, [u32; 3]);

/// What builds a table.
struct Plan {
    size: u32,
    /// The function as a list of entries, where it is sampled.
    list: Vec<[f32; 4]>,
    dispatches: Vec<Dispatch>,
    /// Rows of texels, and of what is made of them in the end, if anything.
    rows: [u32; 2],
}

impl BuildJob {
    fn new(size: u32, slices: u32, longest: f64, lengths: impl Iterator<Item = f64>) -> Self {
        let mut job = BuildJob { size, slices, longest: longest as f32, ..BuildJob::zeroed() };
        job.lengths.iter_mut().zip(lengths).for_each(|(to, l)| *to = l as f32);
        // Lengths of polynomials do not begin with 0.
        let thinnest = if job.lengths[0] > 0.0 { longest * THINNEST } else { f64::from(job.lengths[1]) };
        job.most = (OPAQUE_DEPTH / thinnest) as f32;
        job
    }

    fn from(mut self, first: u32) -> Self {
        self.first = first;
        self
    }
}

impl Plan {
    /// A table of three parameters. `None` as [`Table::new`], unless there are as many values behind as in front, and
    /// for what a construction does not know.
    fn volume(
        exact: &Exact<f64>,
        kind: Kind,
        [n, h, slices]: [u32; 3],
        longest: f64,
        construction: Construction,
    ) -> Option<Self> {
        let normalised = kind == Kind::LogNormalised;
        if n != h || n < 3 || slices < 3 || slices as usize > MOST_SLICES {
            return None;
        }
        let mut job = BuildJob::new(n, slices, longest, (0..slices).map(|k| length(kind, slices, longest, k)));
        job.normalised = u32::from(normalised);
        let closed = |job: BuildJob, first: u32, count: u32| (CLOSED, job.from(first), [n.div_ceil(64), count, 1]);
        let mut list = vec![];
        let dispatches: Vec<Dispatch> = match construction {
            Construction::Closed => vec![closed(job, 0, slices)],
            _ if normalised => return None,
            Construction::Incremental => {
                let next = if kind == Kind::Uniform { LONGER } else { DOUBLED };
                let of = [n.div_ceil(64), n, 1];
                let steps = (2..slices).map(move |first| -> Dispatch { (next, job.from(first), of) });
                std::iter::once(closed(job, 0, 2)).chain(steps).collect()
            }
            Construction::Sampled(Sampling { bits: Some(_), .. }) => return None,
            Construction::Sampled(sampling) if sampling.entries < 2 => return None,
            Construction::Sampled(sampling) => {
                list = table::entries(exact, sampling.entries);
                let (samples, oversampling) = match sampling.steps {
                    Steps::Same(samples) => (samples.max(1), 0.0),
                    Steps::Touched(o) => (0, o as f32),
                };
                (job.entries, job.samples, job.oversampling) = (sampling.entries, samples, oversampling);
                vec![(SAMPLED, job, [n.div_ceil(64), n, slices])]
            }
        };
        Some(Plan { size: n, list, dispatches, rows: [n * slices, 0] })
    }

    /// Polynomials in closed form. `None` as [`Polynomial::new`], and for degrees beyond 4.
    fn polynomial(degree: u32, size: u32, longest: f64) -> Option<Self> {
        if size < 3 || !(1..=4).contains(&degree) {
            return None;
        }
        let lengths = (1..=degree).map(|i| longest * f64::from(i) / f64::from(degree));
        let mut job = BuildJob::new(size, degree, longest, lengths);
        (job.degree, job.normalised) = (degree, 1);
        for (row, of) in job.weights.iter_mut().zip(table::inverse(degree as usize)) {
            row.iter_mut().zip(of).for_each(|(w, of)| *w = of as f32);
        }
        let groups = size.div_ceil(64);
        let dispatches = vec![(CLOSED, job, [groups, degree, 1]), (COEFFICIENTS, job, [groups, size, 1])];
        Some(Plan { size, list: vec![], dispatches, rows: [size * degree, size * (degree + 1)] })
    }

    /// A table in cylinder coordinates, in closed form. `None` as [`Cylindrical::new`].
    fn cylindrical(planes: u32, size: u32, longest: f64) -> Option<Self> {
        if planes == 0 || !planes.is_multiple_of(4) || planes > 65_535 || size < 3 {
            return None;
        }
        let job = BuildJob::new(size, planes, longest, std::iter::empty());
        let dispatches = vec![(CYLINDER, job, [size.div_ceil(64), planes, 1])];
        Some(Plan { size, list: vec![], dispatches, rows: [planes * size, 0] })
    }

    /// What builds `stored`, whatever its texels are now.
    fn of(exact: &Exact<f64>, stored: &TableData) -> Option<Self> {
        match stored {
            TableData::Volume(t) => Plan::volume(exact, t.kind, t.size, t.longest, Construction::Closed),
            TableData::Polynomial(t) => Plan::polynomial(t.degree, t.size, t.longest),
            TableData::Cylindrical(t) => Plan::cylindrical(t.planes, t.size, t.longest),
            TableData::SecondOrder(_) | TableData::SecondOrderPolynomial(_) => None,
        }
    }
}

/// Texels on a device, row by row.
pub(crate) struct Texels {
    pub(crate) buffer: Buffer,
    /// Texels from one row to the next.
    pub(crate) pitch: u32,
    rows: u32,
}

/// The pipelines that build tables, for one kind of emission.
#[derive(Debug)]
pub(crate) struct TableBuilder {
    direct: bool,
    layouts: [wgpu::BindGroupLayout; 2],
    pipelines: [wgpu::ComputePipeline; 6],
}

impl TableBuilder {
    /// Compiles them.
    ///
    /// # Errors
    /// Those of [`Gpu::check`].
    pub(crate) fn new(gpu: &Gpu, direct: bool) -> Result<Self> {
        use Slot::{Read, Uniform, Write};
        let module = raster::module(gpu, "construct", &source(direct));
        let layouts = [
            raster::layout(gpu, Stages::COMPUTE, &[Uniform, Read, Read]),
            raster::layout(gpu, Stages::COMPUTE, &[Uniform, Read, Read, Read, Read, Write, Write]),
        ];
        let layout = raster::pipeline_layout(gpu, &layouts.each_ref().map(Some));
        let pipelines = ENTRIES.map(|entry| raster::compute(gpu, &module, entry, &layout));
        gpu.check()?;
        Ok(TableBuilder { direct, layouts, pipelines })
    }

    /// Whether they are those for `exact`.
    pub(crate) fn suits(&self, exact: &Exact<f64>) -> bool {
        self.direct == exact.direct
    }

    /// Has the device build `stored` of the function `exact`, which `function` tells it; it may take its time. Rows are
    /// so far apart that they can be copied to textures. None if it cannot, or has no binding so large.
    ///
    /// # Errors
    /// [`crate::Error::Memory`] if the device has no room, and those of a device that fails.
    pub(crate) fn build(
        &self,
        gpu: &Gpu,
        exact: &Exact<f64>,
        function: &[Buffer; 3],
        stored: &TableData,
    ) -> Result<Option<Texels>> {
        let Some(plan) = Plan::of(exact, stored) else { return Ok(None) };
        let pitch = plan.size.next_multiple_of(ROW);
        self.submit(gpu, exact, function, &plan, pitch)
    }

    fn submit(
        &self,
        gpu: &Gpu,
        exact: &Exact<f64>,
        function: &[Buffer; 3],
        plan: &Plan,
        pitch: u32,
    ) -> Result<Option<Texels>> {
        let bytes = plan.rows.map(|rows| 16 * u64::from(pitch) * u64::from(rows));
        if bytes.iter().any(|&b| b > gpu.binding) {
            return Ok(None);
        }
        let Nodes { parts, begin, nodes } = Nodes::new(exact, plan.size);
        let uploaded = [
            Buffer::holding(gpu, "parts", &parts, Usage::STORAGE)?,
            Buffer::holding(gpu, "begin", &begin, Usage::STORAGE)?,
            Buffer::holding(gpu, "nodes", &nodes, Usage::STORAGE)?,
            Buffer::holding(gpu, "list", &plan.list, Usage::STORAGE)?,
        ];
        let texels = Buffer::new(gpu, "texels", bytes[0], Usage::STORAGE | Usage::COPY_SRC)?;
        let result = Buffer::new(gpu, "result", bytes[1], Usage::STORAGE | Usage::COPY_SRC)?;
        let shared = raster::group_of(gpu, &self.layouts[0], function);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut jobs = vec![];
        for (pipeline, job, [x, y, z]) in &plan.dispatches {
            let job = Buffer::holding(gpu, "job", &[BuildJob { pitch, ..*job }], Usage::UNIFORM)?;
            let all = std::iter::once(&job).chain(&uploaded).chain([&texels, &result]);
            let group = raster::group_of(gpu, &self.layouts[1], all);
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&self.pipelines[*pipeline]);
            pass.set_bind_group(0, &shared, &[]);
            pass.set_bind_group(1, &group, &[]);
            pass.dispatch_workgroups(*x, *y, *z);
            drop(pass);
            jobs.push(job);
        }
        gpu.queue.submit([encoder.finish()]);
        gpu.check()?;
        let of = usize::from(bytes[1] > 0);
        let buffer = if of == 1 { result } else { texels };
        Ok(Some(Texels { buffer, pitch, rows: plan.rows[of] }))
    }
}

fn source(direct: bool) -> String {
    let variant = ShaderVariant { kind: field::Kind::Scalar, direct };
    [&shader::prelude(&variant), shader::INTEGRAL, CONSTRUCT].concat()
}

/// A device that builds tables of one function.
pub struct Constructor {
    gpu: Gpu,
    builder: TableBuilder,
    function: [Buffer; 3],
    exact: Exact<f64>,
}

impl Constructor {
    /// Opens what `choice` says, for tables of `transfer` over a field of one component that `normal` maps, on a mesh
    /// whose coordinates were multiplied by `scale`. None if `choice` is the CPU, or there is no GPU and none was
    /// named.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if no adapter bears the name, it is of no use, or it cannot be opened.
    pub fn open(
        choice: &DeviceChoice,
        transfer: &TransferFunction,
        normal: &[Normalization; 4],
        scale: f64,
    ) -> Result<Option<Self>> {
        let Some(gpu) = Gpu::open(choice)? else { return Ok(None) };
        let exact = Exact::<f64>::new(transfer, field::Kind::Scalar, normal, scale);
        let builder = TableBuilder::new(&gpu, exact.direct)?;
        let function = function::upload(&gpu, &Exact::<f32>::new(transfer, field::Kind::Scalar, normal, scale))?;
        Ok(Some(Constructor { gpu, builder, function, exact }))
    }

    /// The device's name.
    pub fn name(&self) -> &str {
        &self.gpu.adapter.name
    }

    /// A table of three parameters, and the milliseconds that the device took, without the way back. `None` as
    /// [`Table::new`], unless there are as many values behind as in front, and for what a construction does not know.
    ///
    /// # Errors
    /// [`crate::Error::Memory`] if the device has no room, and those of a device that fails.
    pub fn volume(
        &self,
        kind: Kind,
        size: [u32; 3],
        longest: f64,
        construction: Construction,
    ) -> Result<Option<(Table, f64)>> {
        let plan = Plan::volume(&self.exact, kind, size, longest, construction);
        let Some((texels, ms)) = self.run(plan)? else { return Ok(None) };
        Ok(Some((Table { kind, size, longest, direct: self.exact.direct, texels: texels.into() }, ms)))
    }

    /// Polynomials in closed form, and the milliseconds that the device took. `None` as [`Polynomial::new`], and for
    /// degrees beyond 4.
    ///
    /// # Errors
    /// As [`Self::volume`].
    pub fn polynomial(&self, degree: u32, size: u32, longest: f64) -> Result<Option<(Polynomial, f64)>> {
        let Some((texels, ms)) = self.run(Plan::polynomial(degree, size, longest))? else { return Ok(None) };
        let texels = texels.chunks_exact(size as usize * size as usize).map(<[_]>::to_vec).collect();
        Ok(Some((Polynomial { degree, size, longest, direct: self.exact.direct, texels }, ms)))
    }

    /// A table in cylinder coordinates, in closed form, and the milliseconds that the device took. `None` as
    /// [`Cylindrical::new`].
    ///
    /// # Errors
    /// As [`Self::volume`].
    pub fn cylindrical(&self, planes: u32, size: u32, longest: f64) -> Result<Option<(Cylindrical, f64)>> {
        let Some((texels, ms)) = self.run(Plan::cylindrical(planes, size, longest))? else { return Ok(None) };
        Ok(Some((Cylindrical { planes, size, longest, texels }, ms)))
    }

    /// The texels of a plan, and the time until they were there. None without a plan, and if a binding has no room for
    /// them.
    fn run(&self, plan: Option<Plan>) -> Result<Option<(Vec<[f32; 4]>, f64)>> {
        let Some(plan) = plan else { return Ok(None) };
        let (gpu, start) = (&self.gpu, Instant::now());
        let built = self.builder.submit(gpu, &self.exact, &self.function, &plan, plan.size)?;
        let Some(Texels { buffer, pitch, rows }) = built else { return Ok(None) };
        gpu.wait()?;
        let ms = start.elapsed().as_secs_f64() * 1e3;
        let bytes = 16 * u64::from(pitch) * u64::from(rows);
        let back = Readback::new(gpu, bytes)?;
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(&buffer.raw, 0, back.raw(), 0, bytes);
        let texels = back.submit(gpu, encoder, |bytes| bytemuck::cast_slice::<u8, [f32; 4]>(bytes).to_vec())?;
        Ok(Some((texels, ms)))
    }
}

impl std::fmt::Debug for Constructor {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Constructor").field("device", &self.gpu.adapter.name).finish_non_exhaustive()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "tests")]
mod tests {
    use super::*;
    use crate::gpu::testing;
    use crate::integral::table::tests::{apart_texels, transfers};
    use wgpu::naga;

    const NORMAL: [Normalization; 4] = [Normalization { mid: 0.0, half: 1.0 }; 4];

    #[test]
    fn jobs_are_laid_out_as_the_shader_has_them() {
        for direct in [false, true] {
            let module = testing::validated(&source(direct));
            let (_, job) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some("BuildJob")).unwrap();
            let naga::TypeInner::Struct { span, members } = &job.inner else { panic!("no struct") };
            assert_eq!(*span as usize, size_of::<BuildJob>());
            let got: Vec<_> = members.iter().map(|m| (m.name.as_deref().unwrap(), m.offset as usize)).collect();
            macro_rules! offsets {
                ($($field:ident),*) => { [$((stringify!($field), std::mem::offset_of!(BuildJob, $field))),*] };
            }
            let want = offsets!(
                size,
                slices,
                first,
                normalised,
                entries,
                samples,
                oversampling,
                most,
                longest,
                degree,
                count,
                pitch,
                lengths,
                weights
            );
            assert_eq!(got, want);
        }
    }

    /// What the device builds is what the CPU builds: in closed form the exact integral, else the same approximation.
    #[test]
    fn tables_are_those_of_the_cpu() {
        let Some(choice) = testing::choice() else { return };
        for (name, transfer) in transfers(77) {
            let device = Constructor::open(&choice, &transfer, &NORMAL, 1.0).unwrap().unwrap();
            let exact = &device.exact;
            let near = |got: &[[f32; 4]], want: &[[f32; 4]], most: f32, what: &str| {
                let apart = apart_texels(got, want);
                assert!(apart < most, "{name}, direct {}, {what}: {apart}", exact.direct);
            };
            for kind in [Kind::Uniform, Kind::Log, Kind::LogNormalised] {
                let size = [40, 40, 12];
                let (got, ms) = device.volume(kind, size, 2.0, Construction::Closed).unwrap().unwrap();
                near(&got.texels, &Table::new(exact, kind, size, 2.0).unwrap().texels, 1e-5, "closed");
                assert!(ms > 0.0);
                let sampling = [Sampling::same(64, 1.0), Sampling::touched(100, 2.0)];
                for how in sampling.map(Construction::Sampled).into_iter().chain([Construction::Incremental]) {
                    let got = device.volume(kind, size, 2.0, how).unwrap();
                    let want = match how {
                        Construction::Sampled(sampling) => Table::sampled(exact, kind, size, 2.0, sampling),
                        _ => Table::incremental(exact, kind, size, 2.0),
                    };
                    assert_eq!(got.is_some(), want.is_some(), "{how:?}, {kind:?}");
                    if let (Some((got, _)), Some(want)) = (got, want) {
                        near(&got.texels, &want.texels, 1e-4, &format!("{how:?}, {kind:?}"));
                    }
                }
            }
            for degree in [1, 2, 4] {
                let (got, _) = device.polynomial(degree, 33, 3.0).unwrap().unwrap();
                let want = Polynomial::new(exact, degree, 33, 3.0).unwrap();
                near(&got.texels[0], &want.texels[0], 1e-5, "limit and extinction");
                for i in 0..400u32 {
                    let [f, b, l] = [0.8191, 0.6710, 0.5497].map(|s| (0.5 + s * f64::from(i)).fract());
                    let (f, b, l) = (2.0 * f - 1.0, 2.0 * b - 1.0, 3.0 * l);
                    let (got, want) = (got.look_up(f, b, l), want.look_up(f, b, l));
                    assert!((0..4).all(|k| (got[k] - want[k]).abs() < 1e-4), "{name}, {degree}: {got:?}, not {want:?}");
                }
            }
            let (got, _) = device.cylindrical(16, 24, 3.0).unwrap().unwrap();
            near(&got.texels, &Cylindrical::new(exact, 16, 24, 3.0).unwrap().texels, 2e-5, "cylinder");
            assert!(device.cylindrical(6, 24, 3.0).unwrap().is_none());
        }
    }
}
