//! The transfer function: colour and opacity as piecewise linear functions of the scalar, and the optical model that
//! turns opacity into extinction.

mod axis;
pub mod bivariate;
pub mod colormap;
mod knots;
pub mod shading;
mod space;

pub use axis::Axis;
pub use bivariate::Bivariate;
pub use shading::Shading;

use crate::error::{Error, Result};
use bivariate::Source;
use std::sync::Arc;

/// How an opacity a and the unit distance d give the extinction τ per unit length.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Convention {
    /// τ = a/d, as VTK's unstructured-grid mappers have it; a may exceed 1.
    #[default]
    Extinction,
    /// τ = −ln(1 − a)/d, as VTK's image mappers have it: a is the opacity of a slab d thick, and a ≥ 1 is opaque.
    Opacity,
}

/// What the medium emits per unit length.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Emission {
    /// Colour times extinction: dense parts glow (VTK).
    #[default]
    Chromatic,
    /// Colour times `scale`, whatever the extinction (Röttger, Kraus & Ertl 2000; Max 1995).
    Direct {
        /// Emission per unit length of a component that is 1.
        scale: f64,
    },
}

/// Opacities from here on count as opaque in [`Convention::Opacity`].
pub const OPAQUE: f64 = 1.0 - 1e-7;

/// Colour and opacity as functions of the scalar, piecewise linear between knots. Two knots at one scalar are a step. A
/// second variable and light may be added.
#[derive(Debug, Clone, PartialEq)]
pub struct TransferFunction {
    color: Vec<(f64, [f64; 3])>,
    opacity: Vec<(f64, f64)>,
    clamp: bool,
    unit_distance: f64,
    convention: Convention,
    emission: Emission,
    /// Shared, as tables may be large.
    bivariate: Option<Arc<Bivariate>>,
    shading: Option<Arc<Shading>>,
}

impl TransferFunction {
    /// A function with the given knots `(s, value)`, ascending in s; outside the knots the end values hold. The unit
    /// distance is in world units.
    ///
    /// # Errors
    /// [`Error::Transfer`] if a list is empty or decreases in s, a number is not finite, a colour or opacity is
    /// negative, or the unit distance is not above 0.
    pub fn new(color: Vec<(f64, [f64; 3])>, opacity: Vec<(f64, f64)>, unit_distance: f64) -> Result<Self> {
        let fail = |what: String| Err(Error::Transfer(what));
        if !(unit_distance > 0.0 && unit_distance.is_finite()) {
            return fail(format!("the unit distance is {unit_distance}, not a positive length"));
        }
        knots::check("color", color.iter().map(|k| k.0))?;
        knots::check("opacity", opacity.iter().map(|k| k.0))?;
        let usable = |v: &f64| v.is_finite() && *v >= 0.0;
        if let Some((s, c)) = color.iter().find(|k| !k.1.iter().all(usable)) {
            return fail(format!("the color at {s} is {c:?}: components are 0 or more"));
        }
        if let Some((s, a)) = opacity.iter().find(|k| !usable(&k.1)) {
            return fail(format!("the opacity at {s} is {a}: it is 0 or more"));
        }
        Ok(TransferFunction {
            color,
            opacity,
            clamp: true,
            unit_distance,
            convention: Convention::default(),
            emission: Emission::default(),
            bivariate: None,
            shading: None,
        })
    }

    /// A function of two variables whose widgets or table say colour and opacity; there are none over the scalar alone.
    ///
    /// # Errors
    /// [`Error::Transfer`] if the unit distance is not above 0, or neither widgets nor a table are there.
    pub fn of_two(bivariate: Bivariate, unit_distance: f64) -> Result<Self> {
        if *bivariate.source() == Source::Scalar {
            return Err(Error::Transfer("there are neither widgets nor a table".into()));
        }
        Ok(Self::new(vec![(0.0, [1.0; 3])], vec![(0.0, 0.0)], unit_distance)?.with_bivariate(bivariate))
    }

    /// With other knots of colour and opacity.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_knots(&self, color: Vec<(f64, [f64; 3])>, opacity: Vec<(f64, f64)>) -> Result<Self> {
        let Self { color, opacity, .. } = Self::new(color, opacity, self.unit_distance)?;
        Ok(Self { color, opacity, ..self.clone() })
    }

    /// With another unit distance.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_unit_distance(&self, unit_distance: f64) -> Result<Self> {
        Self::new(vec![(0.0, [0.0; 3])], vec![(0.0, 0.0)], unit_distance)?;
        Ok(Self { unit_distance, ..self.clone() })
    }

    /// With a second variable.
    pub fn with_bivariate(mut self, bivariate: Bivariate) -> Self {
        self.bivariate = bivariate.needs_second().then(|| Arc::new(bivariate));
        self
    }

    /// With light on the gradient.
    pub fn with_shading(mut self, shading: Shading) -> Self {
        self.shading = shading.needs_normals().then(|| Arc::new(shading));
        self
    }

    /// With another opacity convention.
    pub fn with_convention(mut self, convention: Convention) -> Self {
        self.convention = convention;
        self
    }

    /// With another emission.
    ///
    /// # Errors
    /// [`Error::Transfer`] if a direct emission's scale is negative or not finite.
    pub fn with_emission(mut self, emission: Emission) -> Result<Self> {
        if let Emission::Direct { scale } = emission
            && !(scale >= 0.0 && scale.is_finite())
        {
            return Err(Error::Transfer(format!("the emission scale is {scale}: it is 0 or more")));
        }
        self.emission = emission;
        Ok(self)
    }

    /// With end values outside the knots (true, the default) or nothing there (false): no opacity, no emission.
    pub fn with_clamp(mut self, clamp: bool) -> Self {
        self.clamp = clamp;
        self
    }

    /// The colour knots `(s, [r, g, b])`, ascending.
    pub fn color(&self) -> &[(f64, [f64; 3])] {
        &self.color
    }

    /// The opacity knots `(s, a)`, ascending.
    pub fn opacity(&self) -> &[(f64, f64)] {
        &self.opacity
    }

    /// Whether end values hold outside the knots; otherwise colour and opacity are 0 there.
    pub fn clamp(&self) -> bool {
        self.clamp
    }

    /// The unit distance, in world units.
    pub fn unit_distance(&self) -> f64 {
        self.unit_distance
    }

    /// The opacity convention.
    pub fn convention(&self) -> Convention {
        self.convention
    }

    /// The emission.
    pub fn emission(&self) -> Emission {
        self.emission
    }

    /// What depends on a second variable, if anything does.
    pub fn bivariate(&self) -> Option<&Bivariate> {
        self.bivariate.as_deref()
    }

    /// The light on the gradient, if there is any.
    pub fn shading(&self) -> Option<&Shading> {
        self.shading.as_deref()
    }

    /// Whether the scalar alone says what is seen: no second variable, and no gradient.
    pub fn is_of_one_variable(&self) -> bool {
        self.bivariate.is_none() && self.shading.is_none()
    }

    /// Whether the functions of the scalar say colour and opacity; else widgets or a table do.
    pub fn has_knots(&self) -> bool {
        self.bivariate.as_ref().is_none_or(|b| *b.source() == Source::Scalar)
    }

    /// Extinction per world unit of length at opacity `a`; infinite where `a` is opaque.
    pub fn extinction(&self, a: f64) -> f64 {
        match self.convention {
            Convention::Extinction => a / self.unit_distance,
            Convention::Opacity if a >= OPAQUE => f64::INFINITY,
            Convention::Opacity => -(-a).ln_1p() / self.unit_distance,
        }
    }

    /// Colour at `s`; at a step, its upper side.
    pub fn color_at(&self, s: f64) -> [f64; 3] {
        let at = |k: usize| interpolate(&self.color, s, self.clamp, |c| c[k]);
        [at(0), at(1), at(2)]
    }

    /// Opacity at `s`; at a step, its upper side.
    pub fn opacity_at(&self, s: f64) -> f64 {
        interpolate(&self.opacity, s, self.clamp, |a| *a)
    }
}

/// The piecewise linear function through `knots` at `s`, right-continuous at steps.
pub(crate) fn interpolate<T>(knots: &[(f64, T)], s: f64, clamp: bool, value: impl Fn(&T) -> f64) -> f64 {
    let [one] = interpolate_all(knots, s, clamp, |v| [value(v)]);
    one
}

/// As [`interpolate`], for `K` functions with the same knots.
pub(crate) fn interpolate_all<T, const K: usize>(
    knots: &[(f64, T)],
    s: f64,
    clamp: bool,
    value: impl Fn(&T) -> [f64; K],
) -> [f64; K] {
    let above = knots.partition_point(|k| k.0 <= s);
    let last = knots.len() - 1;
    match above {
        _ if !clamp && (s < knots[0].0 || s > knots[last].0) => [0.0; K],
        0 => value(&knots[0].1),
        i if i > last => value(&knots[last].1),
        i => {
            let ((s0, a), (s1, b)) = (&knots[i - 1], &knots[i]);
            let (a, b, share) = (value(a), value(b), (s - s0) / (s1 - s0));
            std::array::from_fn(|k| a[k] + (b[k] - a[k]) * share)
        }
    }
}
