//! Frames whose transfer function has a second variable, or light: what they need besides the field, kept as long as it
//! holds. The engine of the renderer draws them; what a device lacks for them, the CPU does: the projection, or the walk.

use super::backend::{Backend, swept};
use super::{DrawnFrame, Loaded, Progress, Renderer, Stats, missing, ms};
use crate::error::{Error, Result};
use crate::field::gradient::length;
use crate::field::normalization::MOST;
use crate::field::{Association, Field, Gradient, Kind, Normalization};
use crate::geometry::{TetMesh, Values};
use crate::gpu::Gpu;
use crate::gpu::second::SecondScene;
use crate::image::Image;
use crate::integral::options::{Culling, Two};
use crate::integral::second::{LONGEST, OfTwo, Pairs, Rows, Second, Wide, places};
use crate::integral::{Exact, Integral};
use crate::project::ProjectionOptions;
use crate::project::cpu::{self as sweep, Sweep, UNSEEN};
use crate::transfer::TransferFunction;
use crate::transfer::bivariate::{Bivariate, Source};
use crate::traverse::cpu::{render_pixels_of_two, render_two};
use crate::view::{Blend, View};
use glam::DVec3;
use rayon::prelude::*;
use std::sync::OnceLock;
use std::time::Instant;

/// By how much less of the range of values must count for other maps to be better.
const BETTER: f64 = 4.0;

/// What such frames need, as far as it was made.
#[derive(Debug, Default)]
pub(super) struct Extra {
    /// The gradient in world units, for the field and the points of now; the scale that it was made under.
    gradient: Option<Gradient>,
    /// What was made so far: each has its number, by which devices know it.
    made: u64,
    values: Option<Ready>,
    function: Option<Function>,
    seen: Option<Seen>,
    /// Of each cell, whether it may be seen, as the sweep reads it; none for the walk.
    lines: Vec<[u16; 2]>,
}

/// The function, ready for the values.
#[derive(Debug)]
pub(super) struct Function {
    stamp: u64,
    second: Second,
    wide: Wide,
    /// What devices read, once one asked for it.
    rows: OnceLock<Rows>,
    /// What the sweep reads in the place of a function of one variable: one value.
    even: Exact<f32>,
}

/// What a frame is drawn from.
#[derive(Debug)]
struct Made<'a> {
    values: &'a TwoOrFive,
    /// The number of the values.
    stamp: u64,
    function: &'a Function,
    seen: Option<&'a Seen>,
    lines: &'a [[u16; 2]],
}

/// Which cells may be seen with the function of now.
#[derive(Debug)]
pub(super) struct Seen {
    stamp: u64,
    culling: Culling,
    /// A bit for each.
    bits: Vec<u64>,
    culled: u64,
    ms: f64,
}

/// Values, and how they are mapped: s and g.
#[derive(Debug)]
struct Ready {
    stamp: u64,
    normal: [Normalization; 2],
    values: TwoOrFive,
}

/// What draws a frame.
enum Painter<'a> {
    /// The walk on the CPU.
    Walk,
    /// The projection on the CPU.
    Sweep(&'a mut Sweep),
    /// The device of a backend, with the projection's options.
    Device(&'a mut Backend, &'a ProjectionOptions),
}

/// The values of a frame.
#[derive(Debug)]
pub(super) enum TwoOrFive {
    /// s and g.
    Two(Values<2>),
    /// Those and the gradient, of which the longest is 1.
    Five(Values<5>),
}

impl Renderer {
    /// Draws a frame with a second variable, or light.
    pub(super) fn render_second(&mut self, view: &View, progress: &Progress) -> Result<Image> {
        let start = Instant::now();
        if self.mesh.as_ref().is_some_and(|m| !m.connected) {
            self.connect_in_place()?;
        }
        let mesh = self.mesh.as_mut().ok_or_else(|| missing("mesh"))?;
        let field = self.field.as_ref().ok_or_else(|| missing("field"))?.field();
        let transfer = self.transfer.as_ref().ok_or_else(|| missing("transfer function"))?;
        let (extra, two) = (&mut self.extra, self.integral.two);
        let by_device = self.backend.gpu().is_some() && !mesh.left_to_walk;
        let by_device = by_device && self.backend.lacks_second(transfer, &two, &self.projection).is_none();
        let projects = !by_device && !mesh.left_to_walk && self.backend.projects_second(self.engine);
        let uploaded = self.backend.gpu().map_or(0, Gpu::uploaded);
        let painter = match (&mut self.backend, projects) {
            (backend, _) if by_device => Painter::Device(backend, &self.projection),
            (_, false) => Painter::Walk,
            (Backend::Project(sweep), _) => Painter::Sweep(sweep),
            _ => Painter::Sweep(self.sweep.get_or_insert_with(|| Box::new(Sweep::new()))),
        };
        let drawn = self.pool.install(|| {
            let longest = *mesh.longest.get_or_insert_with(|| mesh.geometry.longest_edge());
            let made = extra.prepare(mesh, field, transfer, view.blend(), two, projects)?;
            let culled = made.seen.map_or((0, 0.0), |s| (s.culled, s.ms));
            Ok::<_, Error>((made.draw(mesh, longest, painter, view, progress)?, culled))
        });
        let (DrawnFrame { pixels, counts, sweep, device_ms, projection }, (culled_cells, culling_ms)) = drawn?;
        let (mut device_bytes, mut uploaded_bytes) = (mesh.geometry.bytes() + self.extra.bytes(), 0);
        if let Some(gpu) = self.backend.gpu().filter(|_| by_device) {
            (device_bytes, uploaded_bytes) = (gpu.allocated(), gpu.uploaded() - uploaded);
        }
        self.stats = Stats {
            integral: two.method.name().into(),
            table_ms: 0.0,
            table_bytes: 0,
            knots_per_cell: 0.0,
            steps: counts.steps,
            retraced_rays: counts.retraced,
            cpu_rays: counts.unfinished,
            panels: counts.panels,
            culled_cells,
            culling_ms,
            device_bytes,
            uploaded_bytes,
            device_ms,
            projection,
            sweep,
            frame_ms: ms(start),
            ..std::mem::take(&mut self.stats)
        };
        Ok(Image { size: view.size(), pixels })
    }
}

impl TwoOrFive {
    fn bytes(&self) -> u64 {
        match self {
            TwoOrFive::Two(v) => v.bytes(),
            TwoOrFive::Five(v) => v.bytes(),
        }
    }
}

impl Extra {
    /// Points have moved, or the field is another.
    pub(super) fn invalidate_field(&mut self) {
        *self = Extra { made: self.made, ..Self::default() };
    }

    /// The transfer function is another.
    pub(super) fn invalidate_function(&mut self) {
        (self.function, self.seen) = (None, None);
        self.lines.clear();
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> u64 {
        let seen = self.seen.as_ref().map_or(0, |s| 8 * s.bits.len() as u64) + 4 * self.lines.len() as u64;
        self.gradient.as_ref().map_or(0, Gradient::bytes) + self.values.as_ref().map_or(0, |v| v.values.bytes()) + seen
    }

    /// Makes what is missing to draw `field` on `mesh` with `transfer`, for the projection or for the walk, on the current
    /// rayon pool.
    ///
    /// # Errors
    /// [`Error::Field`] if the field has no gradient, or more than one component; [`Error::Render`] for a maximum;
    /// [`Error::NoMemory`].
    fn prepare(
        &mut self,
        mesh: &Loaded,
        field: &Field,
        transfer: &TransferFunction,
        blend: Blend,
        two: Two,
        projects: bool,
    ) -> Result<Made<'_>> {
        check(field, transfer, blend)?;
        two.check()?;
        let lit = transfer.shading().is_some();
        let needs = lit || transfer.bivariate().is_some() && field.second().is_none();
        if needs && self.gradient.is_none() && field.association() == Association::Point {
            let count = mesh.points + mesh.tetrahedra.added.len();
            let points = mesh.geometry.points_of_mesh(&mesh.tetrahedra, count);
            self.gradient = Some(Gradient::of(&points, &mesh.tetrahedra, field, mesh.geometry.is_apart())?);
        }
        // Gradients are per normalised length so far.
        let scale = mesh.geometry.scale;
        let lengths = self.gradient.as_ref().map_or([0.0; 2], |g| g.range().map(|l| l * scale));
        let ranges = [field.range(0), field.second().map_or(lengths, |g| g.range(0))];
        let wanted = places(transfer, LONGEST / scale);
        let short = [field.is_short(), field.second().is_some_and(Field::is_short)];
        let normal = [0, 1].map(|k| {
            let [lo, hi] = [ranges[k][0].max(wanted[k][0]), ranges[k][1].min(wanted[k][1])];
            let normal =
                if lo <= hi { Normalization::new(lo, hi) } else { Normalization::new(ranges[k][0], ranges[k][1]) };
            // What f32 holds as it is, a power of two does not round.
            if short[k] {
                Normalization { mid: 0.0, half: (normal.mid.abs() + normal.half).log2().ceil().exp2() }
            } else {
                normal
            }
        });
        let good = |ready: &Ready| {
            let close = |old: Normalization, new: Normalization| {
                old.half <= BETTER * new.half && (old.mid - new.mid).abs() + new.half <= old.half * (1.0 + 1e-9)
            };
            matches!(ready.values, TwoOrFive::Five(_)) == lit && (0..2).all(|k| close(ready.normal[k], normal[k]))
        };
        if !self.values.as_ref().is_some_and(good) {
            self.invalidate_function();
            let values = self.gather(mesh, field, normal, lit);
            self.made += 1;
            self.values = Some(Ready { stamp: self.made, normal, values });
        }
        let Some(ready) = &self.values else { return Err(Error::Render("there are no values to draw".into())) };
        let TetMesh { centre, scale, .. } = mesh.geometry;
        let function = match self.function.take() {
            Some(function) => function,
            None => {
                self.made += 1;
                Function::new(transfer, ready.normal, centre, scale, two, self.made)?
            }
        };
        let second = &self.function.insert(function).second;
        if two.culling == Culling::None {
            self.seen = None;
        } else if self.seen.as_ref().is_none_or(|s| s.culling != two.culling) {
            self.made += 1;
            self.seen = Some(match &ready.values {
                TwoOrFive::Two(v) => Seen::new(&mesh.geometry, v, second, two.culling, self.made),
                TwoOrFive::Five(v) => Seen::new(&mesh.geometry, v, second, two.culling, self.made),
            });
        }
        let cells = mesh.geometry.cells.len();
        if projects && self.lines.len() != cells {
            match &self.seen {
                None => self.lines = vec![[0; 2]; cells],
                Some(seen) => seen.tell(cells, &mut self.lines),
            }
        }
        let Some(function) = &self.function else { return Err(Error::Render("there is no function to draw".into())) };
        let (values, stamp) = (&ready.values, ready.stamp);
        Ok(Made { values, stamp, function, seen: self.seen.as_ref(), lines: &self.lines })
    }

    /// The values in the order of the mesh.
    fn gather(&self, mesh: &Loaded, field: &Field, normal: [Normalization; 2], lit: bool) -> TwoOrFive {
        let (geometry, tetrahedra) = (&mesh.geometry, &mesh.tetrahedra);
        let scale = geometry.scale;
        let vector = |p: u32| self.gradient.as_ref().map(|g| g.vectors()[p as usize]).unwrap_or_default();
        if field.association() == Association::Cell {
            let pair = |c: usize| {
                let g = field.second().map_or(0.0, |g| g.value(c));
                [normal[0].bounded(field.value(c), MOST), normal[1].bounded(g, MOST)]
            };
            return TwoOrFive::Two(Values::of_cells(geometry, tetrahedra, pair));
        }
        let own = field.len();
        let added = |of: &Field| tetrahedra.added_values(1, |i| of.value(i));
        let (of_s, of_g) = (added(field), field.second().map(added));
        let at = |of: &Field, added: &[f64], p: u32| {
            (p as usize).checked_sub(own).map_or_else(|| of.value(p as usize), |i| added[i])
        };
        let pair = |p: u32| {
            let g = match (field.second(), &of_g) {
                (Some(of), Some(added)) => at(of, added, p),
                _ => length(vector(p)) * scale,
            };
            [normal[0].bounded(at(field, &of_s, p), MOST), normal[1].bounded(g, MOST)]
        };
        if !lit {
            return TwoOrFive::Two(Values::of_points(geometry, tetrahedra, pair));
        }
        let longest = self.gradient.as_ref().map_or(1.0, |g| g.range()[1]).max(f64::MIN_POSITIVE);
        TwoOrFive::Five(Values::of_points(geometry, tetrahedra, |p| {
            let ([s, g], v) = (pair(p), vector(p) / longest);
            [s, g, v.x as f32, v.y as f32, v.z as f32]
        }))
    }
}

impl Seen {
    /// Judges all cells, on the current rayon pool.
    fn new<const N: usize>(
        geometry: &TetMesh,
        values: &Values<N>,
        second: &Second,
        culling: Culling,
        stamp: u64,
    ) -> Self {
        let start = Instant::now();
        let cells = geometry.cells.len();
        let own = |v: &[f32; N]| second.own([v[0], v[1]].map(f64::from));
        let is_seen = |cell: usize| {
            let pairs: Pairs = match values {
                Values::Point(v) => geometry.cells[cell].corners.map(|p| own(&v[p as usize])),
                Values::Corner(v) => v[cell].each_ref().map(own),
                Values::Cell(v) => [own(&v[cell]); 4],
            };
            if culling == Culling::Corners { second.is_seen_at_a_corner(&pairs) } else { second.may_be_seen(&pairs) }
        };
        let word = |word: usize| {
            let bit = |i: usize| u64::from(is_seen(64 * word + i)) << i;
            (0..(cells - 64 * word).min(64)).map(bit).sum::<u64>()
        };
        let bits: Vec<u64> = (0..cells.div_ceil(64)).into_par_iter().with_min_len(64).map(word).collect();
        let seen: u64 = bits.iter().map(|w| u64::from(w.count_ones())).sum();
        Seen { stamp, culling, bits, culled: cells as u64 - seen, ms: ms(start) }
    }

    /// Which of so many `cells` may be seen, as the sweep reads it.
    fn tell(&self, cells: usize, lines: &mut Vec<[u16; 2]>) {
        let line = |i: usize| if self.bits[i / 64] >> (i % 64) & 1 == 1 { [0; 2] } else { UNSEEN };
        (0..cells).into_par_iter().with_min_len(4096).map(line).collect_into_vec(lines);
    }
}

impl Function {
    fn new(
        transfer: &TransferFunction,
        normal: [Normalization; 2],
        centre: DVec3,
        scale: f64,
        two: Two,
        stamp: u64,
    ) -> Result<Self> {
        let second = Second::new(transfer, normal, centre, scale, two);
        let even =
            TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, 1.0)], 1.0)?.with_emission(transfer.emission())?;
        let even = Exact::new(&even, Kind::Scalar, &[normal[0]; 4], scale);
        Ok(Function { stamp, wide: second.wide(), second, rows: OnceLock::new(), even })
    }
}

/// Refuses what has no second variable and no light: a maximum, fields of several components, and what fields of cells have
/// not.
pub(super) fn check(field: &Field, transfer: &TransferFunction, blend: Blend) -> Result<()> {
    if blend == Blend::Maximum {
        let what = "a maximum along rays knows neither a second variable nor light; a composite does";
        return Err(Error::Render(what.into()));
    }
    if field.kind() != Kind::Scalar {
        let what = "a second variable and light are for fields of one component";
        return Err(Error::Field(what.into()));
    }
    let widgets = |b: &Bivariate| matches!(b.source(), Source::Widgets(_)) && b.gradient_opacity().is_none();
    let fits = transfer.shading().is_none() && (field.second().is_some() || transfer.bivariate().is_none_or(widgets));
    if field.association() == Association::Point || fits {
        return Ok(());
    }
    Err(Error::Field(
        "values of cells have no gradient, as they are constant inside: light, and functions of the gradient's length, \
         need an array of points"
            .into(),
    ))
}

impl Made<'_> {
    /// Draws a frame on the current rayon pool.
    fn draw(
        &self,
        mesh: &Loaded,
        longest: f64,
        painter: Painter,
        view: &View,
        progress: &Progress,
    ) -> Result<DrawnFrame> {
        match self.values {
            TwoOrFive::Two(v) => self.draw_values(v, mesh, longest, painter, view, progress),
            TwoOrFive::Five(v) => self.draw_values(v, mesh, longest, painter, view, progress),
        }
    }

    fn draw_values<const N: usize>(
        &self,
        values: &Values<N>,
        mesh: &Loaded,
        longest: f64,
        painter: Painter,
        view: &View,
        progress: &Progress,
    ) -> Result<DrawnFrame> {
        let (geometry, seen) = (&mesh.geometry, self.seen.map(|s| &s.bits[..]));
        let Function { second, wide, even, .. } = self.function;
        Ok(match painter {
            Painter::Walk => {
                let (image, counts) = render_two(geometry, values, second, seen, view, progress);
                DrawnFrame { pixels: image.pixels, counts, ..DrawnFrame::default() }
            }
            Painter::Sweep(sweep) => {
                let second = Some(OfTwo { second, wide, seen, lines: self.lines, longest });
                let integral = Integral { exact: even, table: None, second };
                swept(sweep.render(&sweep::Frame { geometry, values, integral, view, color: &|_| [0.0; 4], progress }))
            }
            Painter::Device(backend, projection) => self.draw_on(backend, values, mesh, view, projection, progress)?,
        })
    }

    /// Draws a frame on a device; pixels that f32, or the device, is not enough for are those of the walk on the CPU.
    fn draw_on<const N: usize>(
        &self,
        backend: &mut Backend,
        values: &Values<N>,
        mesh: &Loaded,
        view: &View,
        projection: &ProjectionOptions,
        progress: &Progress,
    ) -> Result<DrawnFrame> {
        let (geometry, seen) = (&mesh.geometry, self.seen.map(|s| &s.bits[..]));
        let Function { stamp, second, wide, rows, even } = self.function;
        let rows = rows.get_or_init(|| wide.rows(second));
        let stamps = [self.stamp, *stamp, self.seen.map_or(0, |s| s.stamp)];
        let scene = SecondScene { values, rows, seen, stamps };
        let (mut drawn, left) = backend.draw_second(geometry, &scene, even, view, projection)?;
        let by_cpu = render_pixels_of_two(geometry, values, second, seen, view, &left);
        left.iter().zip(by_cpu).for_each(|(&i, p)| drawn.pixels[i] = p);
        drawn.counts.unfinished = left.len() as u64;
        let _ = progress(1.0);
        Ok(drawn)
    }
}
