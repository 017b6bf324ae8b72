//! Functions of two variables, and with light, as `shaders/second.wgsl` reads them.

use super::buffers::{Buffer, Chunks};
use super::raster::Slot;
use super::{Gpu, arrays, function, shader};
use crate::error::{Error, Result};
use crate::geometry::Values;
use crate::integral::Exact;
use crate::integral::second::{Forms, Kind, Rows};
use std::fmt::Write;
use wgpu::BufferUsages as Usage;

const SECOND: &str = include_str!("../../shaders/second.wgsl");
const SOURCES: &str = include_str!("../../shaders/second_sources.wgsl");
const PIECES: &str = include_str!("../../shaders/second_pieces.wgsl");
const LIGHT: &str = include_str!("../../shaders/second_light.wgsl");

/// The bindings of group 2: `Second` and the rows.
pub(crate) const SLOTS: [Slot; 2] = [Slot::Uniform, Slot::Read];

/// An element of the gradients.
pub(crate) const VECTOR: &str = "struct Vector { x: f32, y: f32, z: f32 }\n";

/// What of two variables, or with light, is drawn.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SecondScene<'a, const N: usize> {
    /// s and g; or those and the gradient.
    pub(crate) values: &'a Values<N>,
    pub(crate) rows: &'a Rows,
    /// A bit for each cell that may be seen; without, all may.
    pub(crate) seen: Option<&'a [u64]>,
    /// Numbers that differ where the values, the function and the bits do.
    pub(crate) stamps: [u64; 3],
}

/// What the device holds of such scenes.
#[derive(Debug, Default)]
pub(crate) struct Held {
    values: Option<(u64, Chunks, Option<Chunks>)>,
    function: Option<(u64, [Buffer; 2])>,
    seen: Option<(u64, Chunks)>,
    even: Option<[Buffer; 3]>,
}

impl Held {
    /// Hands over what the device does not hold yet of a scene of so many cells, and says whether that was anything. `even` stands
    /// where functions of one variable are read.
    ///
    /// # Errors
    /// Those of [`Chunks::new`].
    pub(crate) fn prepare<const N: usize>(
        &mut self,
        gpu: &Gpu,
        scene: &SecondScene<N>,
        cells: usize,
        even: &Exact<f32>,
    ) -> Result<bool> {
        let [of_values, of_function, of_seen] = scene.stamps;
        let holds =
            [self.values.as_ref().map(|v| v.0), self.function.as_ref().map(|f| f.0), self.seen.as_ref().map(|s| s.0)];
        let is_new = holds != scene.stamps.map(Some);
        if self.values.as_ref().is_none_or(|v| v.0 != of_values) {
            self.values = None;
            let pairs = arrays::some_of(gpu, "values", scene.values, |v: &[f32; N]| [v[0], v[1]])?;
            let vector = |v: &[f32; N]| [3, 2, 1].map(|k| v[N.saturating_sub(k)]);
            let gradients = if N == 5 { Some(arrays::some_of(gpu, "gradients", scene.values, vector)?) } else { None };
            self.values = Some((of_values, pairs, gradients));
        }
        if self.function.as_ref().is_none_or(|f| f.0 != of_function) {
            self.function = None;
            let head = Buffer::holding(gpu, "second", &[scene.rows.head], Usage::UNIFORM)?;
            let rows = Buffer::holding(gpu, "rows", &scene.rows.rows, Usage::STORAGE)?;
            self.function = Some((of_function, [head, rows]));
        }
        if self.seen.as_ref().is_none_or(|s| s.0 != of_seen) {
            self.seen = None;
            let seen = match scene.seen {
                Some(bits) => Chunks::new(gpu, "shown cells", bytemuck::cast_slice::<u64, u32>(bits), |w| *w)?,
                None => Chunks::new(gpu, "shown cells", &vec![u32::MAX; cells.div_ceil(32)], |w| *w)?,
            };
            self.seen = Some((of_seen, seen));
        }
        if self.even.is_none() {
            self.even = Some(function::upload(gpu, even)?);
        }
        Ok(is_new)
    }

    /// The pairs (s, g), the bits of the cells, and the gradients, if there are any.
    pub(crate) fn chunks(&self) -> Result<Vec<&Chunks>> {
        let (Some((_, pairs, gradients)), Some((_, seen))) = (&self.values, &self.seen) else {
            return Err(Error::Render("the device does not hold the values".into()));
        };
        Ok([pairs, seen].into_iter().chain(gradients).collect())
    }

    /// The buffers of group 2, and what stands in the place of a function of one variable.
    pub(crate) fn buffers(&self) -> Result<(&[Buffer; 2], &[Buffer; 3])> {
        match (&self.function, &self.even) {
            (Some((_, function)), Some(even)) => Ok((function, even)),
            _ => Err(Error::Render("the device does not hold the transfer function".into())),
        }
    }
}

/// What shaders call the arrays of [`Held::chunks`], and their elements.
pub(crate) const ARRAYS: [(&str, &str); 3] = [("values", "Value"), ("shown_cells", "u32"), ("gradients", "Vector")];

/// The names that parts of the shaders ask for.
pub(crate) fn defined(forms: &Forms) -> Vec<&'static str> {
    let Forms { source, factor, logarithmic, direct, lit, pieces, whole } = *forms;
    let of = match source {
        Kind::Scalar => "SCALAR",
        Kind::Widgets => "WIDGETS",
        Kind::Texels => "TEXELS",
    };
    let others = [
        ("SECOND", true),
        ("FACTOR", factor),
        ("LOGARITHMIC", logarithmic),
        ("LIT", lit),
        ("LOGS", logarithmic || lit),
        ("KNOTS", factor || source == Kind::Scalar),
        ("ONE_EACH", source != Kind::Widgets),
        ("PIECES", pieces),
        ("PANELS", !pieces),
        ("WHOLE", whole),
        ("CLOSED", source == Kind::Widgets && !(factor || logarithmic || direct || lit)),
    ];
    others.iter().filter(|o| o.1).map(|o| o.0).chain([of]).collect()
}

/// The function that finds what segments emit and absorb, and all that it needs, but for what it shares with other integrals.
pub(crate) fn program(rows: &Rows) -> String {
    let Rows { forms, panels, .. } = rows;
    let defined = defined(forms);
    let vector = |v: [f32; 3]| format!("vec3f({:?}, {:?}, {:?})", v[0], v[1], v[2]);
    let mut text = String::new();
    let _ = writeln!(text, "const GAUSS_NODES = {};", vector(panels.nodes));
    let _ = writeln!(text, "const GAUSS_WEIGHTS = {};", vector(panels.weights));
    let _ = writeln!(text, "const TO_NODES = mat3x3f({});", panels.to_node.map(vector).join(", "));
    let _ = writeln!(text, "const BENDS = vec2f({:?}, {:?});", panels.bends[0], panels.bends[1]);
    let _ = writeln!(text, "const CLOSED_FORMS = {};", defined.contains(&"CLOSED"));
    text += &shader::with(SECOND, &defined);
    text += &shader::with(SOURCES, &defined);
    text += &shader::with(PIECES, &defined);
    if forms.lit {
        text += LIGHT;
    }
    text
}
