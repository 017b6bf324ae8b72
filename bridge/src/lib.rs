//! The bridge to C++: what `cpp/core/halite.h` is made of, which is the face that programs see. No logic is here.
//!
//! A panic that crossed the border would abort the host, so every function is guarded, and returns a `Result`: in C++
//! an exception.

#![allow(unsafe_code, reason = "cxx makes unsafe code of the bridge")]
#![allow(clippy::needless_pass_by_value, reason = "the bridge hands structs over by value")]
#![allow(unreachable_pub, unused_qualifications, reason = "cxx makes names of its own public, and says where they are")]

mod grids;
mod meshes;
mod numbers;
mod own;
mod transfer;
mod views;

use bridge::{FieldSpec, IntegralSpec, Numbers, Stats, TransferSpec, Type, ViewSpec};
use glam::DMat4;
use grids::{add_grid_array, new_grid, set_grid};
use halite::error::{Error, Result};
use halite::field::{Association, Component, Field};
use halite::host::{carried, guard, named};
use halite::image::{Backdrop, Image};
use halite::integral::IntegrationOptions;
use halite::integral::options::Form;
use halite::memory;
use halite::mesh::{Array, Cells, Polyhedra};
use meshes::{array, array_values, arrays, cell_counts, connectivity, offsets, points, types};
use numbers::{cast, indices, point_ids, triples, values};
use own::{Grid, Log, Mesh, Session};
use std::path::Path;
use transfer::transfer;
use views::view;

#[cxx::bridge(namespace = "halite::bridge")]
#[allow(missing_docs, reason = "private to the library; halite.h documents what it offers")]
mod bridge {
    #[derive(Debug, Clone, Copy)]
    enum Type {
        I8,
        U8,
        I16,
        U16,
        I32,
        U32,
        I64,
        U64,
        F32,
        F64,
    }

    /// Numbers of a type that is known only when the program runs, borrowed for the call.
    #[derive(Clone, Copy)]
    struct Numbers<'a> {
        kind: Type,
        bytes: &'a [u8],
    }

    struct ArrayInfo {
        name: String,
        of_cells: bool,
        kind: Type,
        components: usize,
        tuples: usize,
    }

    struct CellCount {
        vtk_type: u8,
        name: String,
        count: usize,
    }

    struct FieldSpec<'a> {
        name: &'a str,
        of_cells: bool,
        components: usize,
        /// From 0; −1 is the magnitude, −2 all of them.
        component: i32,
    }

    struct TransferSpec<'a> {
        /// (s, red, green, blue) for each knot.
        color: &'a [f64],
        /// (s, opacity) for each knot.
        opacity: &'a [f64],
        unit_distance: f64,
        /// VTK's convention of image data, not that of unstructured grids.
        slab: bool,
        /// (g, factor) for each knot of the function of the second variable that multiplies extinction; none if empty.
        gradient_opacity: &'a [f64],
        /// As scenes write them, in the place of colour and opacity; none if empty.
        widgets: Vec<String>,
        /// Red, green, blue and opacity of each texel over the scalar and the second variable, in the place of colour and
        /// opacity; none if empty. Columns and rows, and the ranges of both variables.
        table: &'a [f64],
        table_size: [usize; 2],
        table_ranges: [f64; 4],
        /// The power of silhouettes, if such are drawn.
        has_silhouette: bool,
        silhouette: f64,
        shade: ShadeSpec,
        lights: Vec<LightSpec>,
    }

    struct ShadeSpec {
        /// Without it, the rest says nothing.
        is_lit: bool,
        ambient: f64,
        diffuse: f64,
        specular: f64,
        power: f64,
        two_sided: bool,
        reflected: bool,
    }

    #[derive(Debug, Clone, Copy)]
    enum LightKind {
        Headlight,
        Direction,
        Position,
    }

    struct LightSpec {
        kind: LightKind,
        /// Where it goes, or where it is.
        vector: [f64; 3],
        color: [f64; 3],
        intensity: f64,
        attenuation: [f64; 3],
        /// The angle is in degrees; without a cone the rest says nothing.
        has_cone: bool,
        axis: [f64; 3],
        angle: f64,
        exponent: f64,
    }

    /// Names are those of scenes; empty ones, and a table of 0 x 0 x 0 texels, mean the default.
    struct IntegralSpec<'a> {
        form: &'a str,
        table: [i32; 3],
        texels: &'a str,
        degree: i32,
        reconstruction: &'a str,
        sample_distance: f64,
    }

    struct CameraSpec {
        position: [f64; 3],
        focal_point: [f64; 3],
        view_up: [f64; 3],
        parallel: bool,
        /// In degrees, or half the height of the view.
        angle_or_scale: f64,
        /// From `near` to `far` if `near` < `far`.
        near: f64,
        far: f64,
    }

    struct ViewSpec<'a> {
        width: u32,
        height: u32,
        /// Row 0 of depths and pixels is the lowest, as in OpenGL.
        bottom_up: bool,
        maximum: bool,
        /// World to eye and eye to clip coordinates, rows first; the camera is not asked then.
        by_matrices: bool,
        to_eye: [f64; 16],
        to_clip: [f64; 16],
        camera: CameraSpec,
        /// Origin and normal of each.
        planes: &'a [f64],
        /// One window depth per pixel, or none.
        depths: &'a [f32],
        /// Two coordinates along each axis of a space, and rows of the matrix from there to the world: none, or 22 numbers.
        crop: &'a [f64],
        regions: u32,
    }

    struct Stats {
        engine: String,
        device: String,
        adapter: String,
        cells: u64,
        tetrahedra: u64,
        faces_ms: f64,
        upload_ms: f64,
        frame_ms: f64,
        steps: u64,
        retraced_rays: u64,
        device_bytes: u64,
        uploaded_bytes: u64,
    }

    unsafe extern "C++" {
        include!("progress.h");
        type Progress;
        fn tell(self: &Progress, share: f64) -> Result<bool>;
    }

    extern "Rust" {
        type Log;
        type Grid;
        type Mesh;
        type Session;

        fn new_log() -> Result<Box<Log>>;
        fn take_lines(log: &Log) -> Result<Vec<String>>;

        fn open_mesh(path: &str, threads: usize, log: &Log) -> Result<Box<Mesh>>;
        fn new_mesh(points: Numbers, types: &[u8], offsets: Numbers, connectivity: Numbers) -> Result<Box<Mesh>>;
        fn add_polyhedra(mesh: &mut Mesh, cells: Numbers, faces: Numbers, points: Numbers) -> Result<()>;
        fn add_array(mesh: &mut Mesh, name: &str, of_cells: bool, components: usize, numbers: Numbers) -> Result<()>;
        fn new_grid(x: Numbers, y: Numbers, z: Numbers, origin: [f64; 3], direction: [f64; 9]) -> Result<Box<Grid>>;
        fn add_grid_array(grid: &mut Grid, name: &str, of_cells: bool, n: usize, numbers: Numbers) -> Result<()>;
        fn arrays(mesh: &Mesh) -> Result<Vec<ArrayInfo>>;
        fn array_values(mesh: &Mesh, index: usize) -> Result<Vec<f64>>;
        fn cell_counts(mesh: &Mesh) -> Result<Vec<CellCount>>;
        fn points(mesh: &Mesh) -> Result<Vec<f64>>;
        fn types(mesh: &Mesh) -> Result<Vec<u8>>;
        fn offsets(mesh: &Mesh) -> Result<Vec<u64>>;
        fn connectivity(mesh: &Mesh) -> Result<Vec<u32>>;

        fn new_session(threads: usize, device: &str, engine: &str, log: &Log) -> Result<Box<Session>>;
        fn set_integral(session: &mut Session, spec: IntegralSpec) -> Result<()>;
        fn set_mesh(session: &mut Session, mesh: &Mesh, matrix: [f64; 16]) -> Result<()>;
        fn set_grid(session: &mut Session, grid: &Grid, matrix: [f64; 16]) -> Result<()>;
        fn move_points(session: &mut Session, points: Numbers, matrix: [f64; 16]) -> Result<bool>;
        fn move_mesh(session: &mut Session, mesh: &Mesh, matrix: [f64; 16]) -> Result<bool>;
        fn set_field(session: &mut Session, spec: FieldSpec, numbers: Numbers, second: Numbers) -> Result<()>;
        fn set_mesh_field(session: &mut Session, mesh: &Mesh, index: usize, component: i32) -> Result<()>;
        fn set_transfer(session: &mut Session, spec: TransferSpec) -> Result<()>;
        fn render(session: &mut Session, spec: ViewSpec, pixels: &mut [f32], progress: &Progress) -> Result<bool>;
        fn stats(session: &Session) -> Result<Stats>;

        fn save_image(path: &str, width: u32, height: u32, pixels: &[f32], background: &[f32]) -> Result<()>;
    }
}
use bridge::Progress;

fn new_log() -> Result<Box<Log>> {
    guard(|| Ok(halite::host::Log::default().into()))
}

fn take_lines(log: &Log) -> Result<Vec<String>> {
    guard(|| Ok(log.take()))
}

fn open_mesh(path: &str, threads: usize, log: &Log) -> Result<Box<Mesh>> {
    guard(|| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(|e| Error::Render(format!("cannot start {threads} threads: {e}")))?;
        let open = || halite::io::open(Path::new(path), &|_| ());
        log.collect(|| pool.install(carried(open))).map(Box::from)
    })
}

fn new_mesh(points: Numbers, types: &[u8], offsets: Numbers, connectivity: Numbers) -> Result<Box<Mesh>> {
    guard(|| {
        let connectivity = point_ids(connectivity)?;
        let cells = Cells {
            types: memory::copied("the types of cells", types)?,
            offsets: indices("offsets", offsets)?,
            connectivity,
        };
        halite::Mesh::new(triples(&points)?, cells, vec![], vec![]).map(Box::from)
    })
}

fn add_polyhedra(mesh: &mut Mesh, cells: Numbers, faces: Numbers, points: Numbers) -> Result<()> {
    guard(|| {
        mesh.set_polyhedra(Polyhedra {
            cells: indices("starts of cells", cells)?,
            faces: indices("starts of faces", faces)?,
            points: point_ids(points)?,
        })
    })
}

fn add_array(mesh: &mut Mesh, name: &str, of_cells: bool, components: usize, numbers: Numbers) -> Result<()> {
    guard(|| {
        let array = Array { name: name.into(), components, values: values(&numbers)? };
        if of_cells { mesh.add_cell_array(array) } else { mesh.add_point_array(array) }
    })
}

fn new_session(threads: usize, device: &str, engine: &str, log: &Log) -> Result<Box<Session>> {
    guard(|| halite::host::Session::new(threads, device, engine, halite::host::Log::clone(log)).map(Box::from))
}

fn set_integral(session: &mut Session, spec: IntegralSpec) -> Result<()> {
    session.guarded(|s| {
        s.set_integral(choice(&spec)?)?;
        s.set_reconstruction(spec.reconstruction, spec.sample_distance)
    })
}

/// What the form reads of a specification, and nothing else of it.
fn choice(spec: &IntegralSpec) -> Result<IntegrationOptions> {
    let form = named("integral", spec.form)?;
    let mut choice = IntegrationOptions::of(form);
    if form == Form::Exact {
        return Ok(choice);
    }
    choice.table = table(spec.table)?;
    choice.texels = named("kind of a table's texels", spec.texels)?;
    if matches!(form, Form::Polynomial | Form::SecondOrderPolynomial | Form::Auto) {
        let degree = spec.degree;
        let negative = |_| Error::Render(format!("polynomials have a degree from 1 to 8, and not {degree}"));
        choice.degree = u32::try_from(degree).map_err(negative)?;
    }
    Ok(choice)
}

fn table(size: [i32; 3]) -> Result<Option<[u32; 3]>> {
    if size == [0, 0, 0] {
        return Ok(None);
    }
    match size.map(u32::try_from) {
        [Ok(front), Ok(back), Ok(depth)] => Ok(Some([front, back, depth])),
        _ => {
            let size = size.map(|n| n.to_string()).join(" x ");
            Err(Error::Render(format!("there can be no table of {size} texels; 0 x 0 x 0 chooses the default size")))
        }
    }
}

fn set_mesh(session: &mut Session, mesh: &Mesh, matrix: [f64; 16]) -> Result<()> {
    session.guarded(|s| s.set_mesh(mesh, rows(matrix)))
}

fn move_points(session: &mut Session, points: Numbers, matrix: [f64; 16]) -> Result<bool> {
    session.guarded(|s| s.set_points(&triples(&points)?, rows(matrix)))
}

fn move_mesh(session: &mut Session, mesh: &Mesh, matrix: [f64; 16]) -> Result<bool> {
    session.guarded(|s| s.set_points(mesh.points(), rows(matrix)))
}

fn association(of_cells: bool) -> Association {
    if of_cells { Association::Cell } else { Association::Point }
}

fn component(code: i32) -> Component {
    match usize::try_from(code) {
        Ok(i) => Component::Index(i),
        Err(_) if code == -1 => Component::Magnitude,
        Err(_) => Component::All,
    }
}

/// Draws an array; `second`, if there is any of it, is the second variable, with one value each.
fn set_field(session: &mut Session, spec: FieldSpec, numbers: Numbers, second: Numbers) -> Result<()> {
    session.guarded(|s| {
        s.set_field(|| {
            let own = field(&spec, &numbers)?;
            if second.bytes.is_empty() {
                return Ok(own);
            }
            let of_second = FieldSpec { name: "the second variable", components: 1, component: 0, ..spec };
            own.with_second(field(&of_second, &second)?)
        })
    })
}

fn field(spec: &FieldSpec, numbers: &Numbers) -> Result<Field> {
    let (of, what) = (association(spec.of_cells), component(spec.component));
    macro_rules! from {
        ($t:ty) => {
            cast::<$t>(numbers).and_then(|v| Field::from_slice(spec.name, v, spec.components, of, what))
        };
    }
    match numbers.kind {
        Type::I8 => from!(i8),
        Type::U8 => from!(u8),
        Type::I16 => from!(i16),
        Type::U16 => from!(u16),
        Type::I32 => from!(i32),
        Type::U32 => from!(u32),
        Type::I64 => from!(i64),
        Type::U64 => from!(u64),
        Type::F32 => from!(f32),
        _ => from!(f64),
    }
}

fn set_mesh_field(session: &mut Session, mesh: &Mesh, index: usize, code: i32) -> Result<()> {
    session.guarded(|s| {
        let (of_cells, array) = array(mesh, index)?;
        s.set_field(|| Field::from_array(array, association(of_cells), component(code)))
    })
}

fn set_transfer(session: &mut Session, spec: TransferSpec) -> Result<()> {
    session.guarded(|s| {
        s.set_transfer(&transfer(&spec)?);
        Ok(())
    })
}

/// False if `progress` ended the frame.
fn render(session: &mut Session, spec: ViewSpec, pixels: &mut [f32], progress: &Progress) -> Result<bool> {
    session.guarded(|s| {
        let view = view(&spec)?;
        let (w, h) = (spec.width as usize, spec.height as usize);
        if pixels.len() != 4 * w * h {
            return Err(Error::View(format!(
                "the buffer has {} numbers; {w}x{h} pixels need {}",
                pixels.len(),
                4 * w * h
            )));
        }
        let mut tell = |share| progress.tell(share).map_err(|e| Error::Render(e.to_string()));
        let image = match s.render(&view, &mut tell) {
            Err(Error::Aborted) => return Ok(false),
            image => image?,
        };
        let rows = image.pixels.chunks(w);
        for (j, row) in rows.enumerate() {
            let to = if spec.bottom_up { h - 1 - j } else { j };
            pixels[4 * w * to..4 * w * (to + 1)].copy_from_slice(row.as_flattened());
        }
        Ok(true)
    })
}

fn stats(session: &Session) -> Result<Stats> {
    guard(|| {
        let s = session.stats().clone();
        Ok(Stats {
            engine: s.engine,
            device: s.device,
            adapter: s.adapter,
            cells: s.cells,
            tetrahedra: s.tetrahedra,
            faces_ms: s.faces_ms,
            upload_ms: s.upload_ms,
            frame_ms: s.frame_ms,
            steps: s.steps,
            retraced_rays: s.retraced_rays,
            device_bytes: s.device_bytes,
            uploaded_bytes: s.uploaded_bytes,
        })
    })
}

fn save_image(path: &str, width: u32, height: u32, pixels: &[f32], background: &[f32]) -> Result<()> {
    guard(|| {
        let pixels = pixels.as_chunks().0.to_vec();
        if pixels.len() as u64 != u64::from(width) * u64::from(height) {
            return Err(Error::View(format!("{} pixels are no image of {width}x{height}", pixels.len())));
        }
        let backdrop = match *background {
            [r, g, b] => Backdrop::Color([r, g, b]),
            _ => Backdrop::Transparent,
        };
        Image { size: [width, height], pixels }.save(Path::new(path), backdrop)
    })
}

/// A matrix whose rows lie one after another.
fn rows(matrix: [f64; 16]) -> DMat4 {
    DMat4::from_cols_array(&matrix).transpose()
}
