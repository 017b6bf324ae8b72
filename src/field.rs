//! The field that is drawn: one array of a mesh, reduced to a scalar, a (colour, opacity) pair or RGBA.

pub mod gradient;
pub mod histogram;
pub(crate) mod normalization;

use crate::error::{Error, Result};
use crate::mesh::{Array, Arrays, Values, with_values};
pub use gradient::Gradient;
pub use normalization::Normalization;
use rayon::prelude::*;
use std::borrow::Cow;
use std::sync::Arc;

/// Values of a sample.
const SAMPLES: usize = 1 << 12;

/// Whether values belong to points (and vary linearly inside a tetrahedron) or to cells (and are constant inside).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Association {
    /// One value per point.
    Point,
    /// One value per cell.
    Cell,
}

/// What of an array's tuples is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Component {
    /// One component, counted from 0.
    Index(usize),
    /// The Euclidean length of the tuple.
    Magnitude,
    /// All of them, dependent as VTK has it: two are (colour, opacity) values, four are RGBA.
    All,
}

/// How the components of a field drive colour and opacity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// One value drives both.
    Scalar,
    /// The first value drives the colour function, the second the opacity function.
    Pair,
    /// The first three values are the colour, in [0, 1]; the fourth drives the opacity function.
    Rgba,
}

impl Kind {
    /// Values per point or cell: 1, 2 or 4.
    pub fn components(self) -> usize {
        match self {
            Kind::Scalar => 1,
            Kind::Pair => 2,
            Kind::Rgba => 4,
        }
    }
}

/// The field that is drawn: its values in the array's own units and type; magnitudes are f64.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    association: Association,
    kind: Kind,
    values: Arc<Values>,
    normal: [Normalization; 4],
    range: [[f64; 2]; 4],
    second: Option<Arc<Field>>,
    missing: Option<f64>,
}

/// How the components of an array drive colour and opacity, how they are mapped at first, and their ranges.
#[allow(clippy::type_complexity, reason = "three things of one array")]
fn measured<T: Number>(
    name: &str,
    numbers: &[T],
    n: usize,
    component: Component,
) -> Result<(Kind, [Normalization; 4], [[f64; 2]; 4])> {
    if n == 0 || !numbers.len().is_multiple_of(n) {
        return Err(Error::Field(format!(
            "array \"{name}\" has {} values, which are not a multiple of its {n} components",
            numbers.len()
        )));
    }
    let kind = match component {
        Component::Index(i) if i >= n => {
            return Err(Error::Field(format!("array \"{name}\" has {n} components, so there is no component {i}")));
        }
        Component::All => match n {
            1 => Kind::Scalar,
            2 => Kind::Pair,
            4 => Kind::Rgba,
            _ => {
                return Err(Error::Field(format!(
                    "array \"{name}\" has {n} components: choose one of them, or the magnitude"
                )));
            }
        },
        _ => Kind::Scalar,
    };
    let tuples = numbers.len() / n;
    let value = |tuple: usize, k: usize| match component {
        Component::Index(i) => numbers[tuple * n + i].to_f64(),
        Component::Magnitude if n == 1 => numbers[tuple].to_f64().abs(),
        Component::Magnitude => magnitude(&numbers[tuple * n..(tuple + 1) * n]),
        Component::All => numbers[tuple * n + k].to_f64(),
    };
    let m = kind.components();
    let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 4];
    for (k, r) in range.iter_mut().enumerate().take(m) {
        *r = (0..tuples)
            .into_par_iter()
            .map(|t| value(t, k))
            .filter(|v| v.is_finite())
            .fold(|| *r, |r, v| [r[0].min(v), r[1].max(v)])
            .reduce(|| *r, |a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        if r[0] > r[1] {
            return Err(Error::Field(format!("array \"{name}\" holds no finite value")));
        }
    }
    let mut normal = range.map(|r| Normalization::new(r[0], r[1]));
    if kind == Kind::Rgba {
        // The colour needs no function, only its own scale: bytes are 255ths, anything else is taken as it is.
        normal[..3].fill(Normalization { mid: 0.0, half: T::FULL });
    }
    Ok((kind, normal, range))
}

impl Field {
    /// Takes `component` of the array called `name` of `mesh` (or of a grid). With no association given, points are searched first.
    ///
    /// # Errors
    /// [`Error::Field`] if no such array or component exists, or it holds no finite value.
    pub fn new(mesh: &impl Arrays, name: &str, association: Option<Association>, component: Component) -> Result<Self> {
        let sources = [(Association::Point, mesh.point_arrays()), (Association::Cell, mesh.cell_arrays())];
        let wanted = |a: &Association| association.is_none_or(|w| w == *a);
        let found = sources
            .iter()
            .filter(|(a, _)| wanted(a))
            .find_map(|(a, arrays)| arrays.iter().find(|x| x.name == name).map(|x| (*a, x)));
        let Some((association, array)) = found else {
            let known = [(Association::Point, mesh.point_attributes()), (Association::Cell, mesh.cell_attributes())];
            if let Some(why) = known.iter().filter(|(a, _)| wanted(a)).find_map(|(_, known)| known.why_left_out(name)) {
                return Err(Error::Field(format!("array \"{name}\" was left out when the file was read: {why}")));
            }
            let there = sources
                .iter()
                .filter(|(a, _)| wanted(a))
                .flat_map(|(_, arrays)| arrays.iter().map(|x| format!("\"{}\"", x.name)))
                .collect::<Vec<_>>();
            let place = match association {
                Some(Association::Point) => "point array",
                Some(Association::Cell) => "cell array",
                None => "array",
            };
            let there =
                if there.is_empty() { "there is none".into() } else { format!("there are {}", there.join(", ")) };
            return Err(Error::Field(format!("no {place} is called \"{name}\"; {there}")));
        };
        Self::from_array(array, association, component)
    }

    /// Takes `component` of `array`.
    ///
    /// # Errors
    /// [`Error::Field`] if the array has no such component, or holds no finite value.
    pub fn from_array(array: &Array, association: Association, component: Component) -> Result<Self> {
        with_values!(&array.values, v => Self::from_slice(&array.name, v, array.components, association, component))
    }

    /// The same of an array that is not needed any more: one all of whose values are drawn is not copied.
    ///
    /// # Errors
    /// As [`Self::from_array`].
    pub fn taking(array: Array, association: Association, component: Component) -> Result<Self> {
        let is_whole = match component {
            Component::Index(_) => array.components == 1,
            Component::Magnitude => false,
            Component::All => true,
        };
        if !is_whole {
            return Self::from_array(&array, association, component);
        }
        let (kind, normal, range) =
            with_values!(&array.values, v => measured(&array.name, v, array.components, component))?;
        Ok(Field { association, kind, values: Arc::new(array.values), normal, range, second: None, missing: None })
    }

    /// Takes `component` of an array called `name`, whose tuples of `n` numbers lie one after another in `numbers`.
    ///
    /// # Errors
    /// [`Error::Field`] if the array is not made of such tuples, has no such component, or holds no finite value.
    pub fn from_slice<T: Number>(
        name: &str,
        numbers: &[T],
        n: usize,
        association: Association,
        component: Component,
    ) -> Result<Self> {
        let (kind, normal, range) = measured(name, numbers, n, component)?;
        let tuples = numbers.len() / n;
        let values = match component {
            Component::Index(i) => T::values((0..tuples).into_par_iter().map(|t| numbers[t * n + i]).collect()),
            Component::All => T::values(numbers.to_vec()),
            Component::Magnitude => {
                let length = |t: usize| magnitude(&numbers[t * n..(t + 1) * n]);
                Values::F64((0..tuples).into_par_iter().map(length).collect())
            }
        };
        Ok(Field { association, kind, values: Arc::new(values), normal, range, second: None, missing: None })
    }

    /// The field, with a value for what is not finite of it. Grids alone read it: a cell with such a value is drawn as if it had
    /// this one all over.
    pub fn with_missing(mut self, value: f64) -> Self {
        self.missing = Some(value);
        self
    }

    /// What stands for values that are not finite, if anything does.
    pub fn missing(&self) -> Option<f64> {
        self.missing
    }

    /// The field, with `second` as the second variable in the place of its gradient's length.
    ///
    /// # Errors
    /// [`Error::Field`] unless both have one value for each of the same points, or cells.
    pub fn with_second(mut self, second: Field) -> Result<Self> {
        let place = |of: &Field| if of.association == Association::Point { "points" } else { "cells" };
        if self.kind != Kind::Scalar || second.kind != Kind::Scalar {
            return Err(Error::Field("a field and its second variable have one value each".into()));
        }
        if self.association != second.association || self.len() != second.len() {
            let (own, other) = (place(&self), place(&second));
            let what = format!(
                "the second variable has {} values of {other}, the field {} of {own}: both must be of the same",
                second.len(),
                self.len()
            );
            return Err(Error::Field(what));
        }
        self.second = Some(Arc::new(second));
        Ok(self)
    }

    /// The field that is the second variable, if it is not the gradient's length.
    pub fn second(&self) -> Option<&Field> {
        self.second.as_deref()
    }

    /// Whether the values belong to points or to cells.
    pub fn association(&self) -> Association {
        self.association
    }

    /// How the components drive colour and opacity.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// How many values there are: [`Kind::components`] for each point or cell.
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Whether f32 holds each value exactly.
    pub(crate) fn is_short(&self) -> bool {
        matches!(*self.values, Values::F32(_) | Values::I8(_) | Values::U8(_) | Values::I16(_) | Values::U16(_))
    }

    /// Whether there is no value.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Value `i` of all, in the array's own units: component `i % n` of point or cell `i / n`, of `n` components. Not
    /// finite where the array is not.
    ///
    /// # Panics
    /// If there are not as many.
    pub fn value(&self, i: usize) -> f64 {
        self.values.get(i)
    }

    /// All values, in the array's own units.
    pub fn values(&self) -> Cow<'_, [f64]> {
        match &*self.values {
            Values::F64(v) => v.into(),
            other => (0..other.len()).into_par_iter().map(|i| other.get(i)).collect::<Vec<_>>().into(),
        }
    }

    /// All values, for whoever keeps them as they are.
    pub(crate) fn shared(&self) -> &Arc<Values> {
        &self.values
    }

    /// The map of all finite values of component `k` to [−1, 1]; for colours of [`Kind::Rgba`], of what is a full one to
    /// 1.
    pub fn normal(&self, k: usize) -> Normalization {
        self.normal[k]
    }

    /// Some different finite values of component `k`, ascending.
    fn sample(&self, k: usize) -> Vec<f64> {
        let n = self.kind.components();
        let step = (self.len() / n).div_ceil(SAMPLES).max(1);
        let all = (k..self.len()).step_by(n * step).map(|i| self.value(i));
        let mut sample: Vec<f64> = all.filter(|v| v.is_finite()).collect();
        sample.sort_by(f64::total_cmp);
        sample.dedup();
        sample
    }

    /// Smallest and largest finite value of component `k`, as the array has them.
    pub fn range(&self, k: usize) -> [f64; 2] {
        self.range[k]
    }
}

/// A type of number that arrays are made of.
pub trait Number: Copy + Send + Sync {
    /// What a colour component at its full is in this type.
    const FULL: f64;
    /// The number as f64, rounded if it must be.
    fn to_f64(self) -> f64;
    /// An array of them.
    fn values(numbers: Vec<Self>) -> Values;
}

macro_rules! numbers {
    ($($t:ty, $full:expr, $variant:ident;)*) => {
        $(impl Number for $t {
            const FULL: f64 = $full;
            #[allow(clippy::cast_lossless, clippy::unnecessary_cast, reason = "one cast for ten types")]
            fn to_f64(self) -> f64 {
                self as f64
            }
            fn values(numbers: Vec<Self>) -> Values {
                Values::$variant(numbers)
            }
        })*
    };
}
numbers! {
    i8, 1.0, I8; u8, 255.0, U8; i16, 1.0, I16; u16, 1.0, U16; i32, 1.0, I32; u32, 1.0, U32; i64, 1.0, I64;
    u64, 1.0, U64; f32, 1.0, F32; f64, 1.0, F64;
}

/// The Euclidean length of a tuple, without overflow for components up to 1e300.
pub fn magnitude<T: Number>(tuple: &[T]) -> f64 {
    tuple.iter().fold(0.0, |m: f64, x| m.hypot(x.to_f64()))
}
