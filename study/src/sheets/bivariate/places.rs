//! Where on a field the functions of the study are: by the values that most of its points have.

use anyhow::Result;
use halite::field::Gradient;
use halite::transfer::bivariate::{OPEN, Shape, Sine, Wave, Widget};
use halite::transfer::shading::{Light, Shade};
use halite::transfer::{Bivariate, Shading, TransferFunction};
use halite_console::drawn::ms;
use halite_console::request::Job;
use std::time::Instant;

/// A function, what it is called, the published figure that it stands in, and how it is drawn.
pub(super) type Shown = (&'static str, &'static str, TransferFunction, As);

/// How a figure is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum As {
    /// As it should be.
    Exact,
    /// In pieces.
    Pieces,
    /// With silhouettes of whole segments.
    Silhouettes,
}

/// Bands between the values that nearly all points have.
const BANDS: f64 = 6.0;

/// The greatest opacities of Gaussians and of waves.
const GAUSSIAN: f64 = 0.9;
const WAVES: f64 = 0.6;

/// Colours of widgets.
const ORANGE: [f64; 3] = [0.95, 0.6, 0.2];
const BLUE: [f64; 3] = [0.3, 0.6, 0.95];

/// Of s and of g the values that a tenth, half and nine tenths of the points are below; and the unit distance.
#[derive(Debug, Clone, Copy)]
pub(super) struct Places {
    s: [f64; 3],
    g: [f64; 3],
    unit: f64,
}

/// The values that a tenth, half and nine tenths are below; apart from each other.
fn shares(mut values: Vec<f64>) -> [f64; 3] {
    values.retain(|v| v.is_finite());
    values.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| values.get((share * values.len() as f64) as usize).copied().unwrap_or(0.0);
    let [low, middle, high] = [0.1, 0.5, 0.9].map(at);
    // What differs by rounding alone is one value.
    let apart = high - low > 1e-6 * low.abs().max(high.abs());
    if apart { [low, middle, high] } else { [low, low + 0.5, low + 1.0] }
}

impl Places {
    /// Of the field of `job`; its gradients, and how long they took, in ms.
    pub(super) fn new(job: &Job) -> Result<(Self, Gradient, f64)> {
        let points = job.tetrahedra.points(job.mesh.points());
        let start = Instant::now();
        let gradient = Gradient::new(&points, &job.tetrahedra, &job.field)?;
        let taken = ms(start);
        let lengths = gradient.vectors().iter().map(|v| v.length()).collect();
        let (s, unit) = (shares(job.field.values().into_owned()), job.scene.transfer.unit_distance());
        Ok((Places { s, g: shares(lengths), unit }, gradient, taken))
    }

    /// How wide the values of most points are: of s and of g.
    fn width(&self) -> [f64; 2] {
        [self.s, self.g].map(|[low, _, high]| high - low)
    }

    /// A function of one variable: as bands of a sinusoid, linear between knots.
    pub(super) fn bands(&self) -> Result<TransferFunction> {
        let ([low, _, high], [width, _]) = (self.s, self.width());
        let steps = (BANDS * 16.0) as usize;
        let opacity = (0..=steps).map(|i| {
            let share = i as f64 / steps as f64;
            (low + share * width, 0.9 * (std::f64::consts::PI * BANDS * share).sin().abs())
        });
        let color = vec![(low, [0.2, 0.4, 0.95]), (high, [0.95, 0.5, 0.2])];
        Ok(TransferFunction::new(color, opacity.collect(), self.unit)?)
    }

    fn of(&self, widgets: Vec<Widget>) -> Result<TransferFunction> {
        Ok(TransferFunction::of_two(Bivariate::default().with_widgets(widgets)?, self.unit)?)
    }

    pub(super) fn gaussian(&self) -> Result<TransferFunction> {
        let [center, sigma] = self.center_sigma();
        self.of(vec![Widget {
            shape: Shape::Gaussian { center, sigma },
            color: ORANGE,
            opacity: GAUSSIAN,
            domain: OPEN,
        }])
    }

    fn center_sigma(&self) -> [[f64; 2]; 2] {
        let [s, g] = self.width();
        [[self.s[1], self.g[1]], [0.15 * s, 0.3 * g]]
    }

    /// What the published equations are of: a Gaussian's centre and σ, where waves along s start, and their period; and the greatest
    /// extinctions of both, per unit of length.
    pub(super) fn published(&self) -> ([[f64; 2]; 3], [f64; 2]) {
        let ([center, sigma], [width, _]) = (self.center_sigma(), self.width());
        ([center, sigma, [self.s[0], width / BANDS]], [GAUSSIAN / self.unit, WAVES / self.unit])
    }

    /// A wave along s, whose g is above the median if `steep`.
    fn wave(&self, shape: impl Fn(Wave) -> Shape, floor: f64, steep: bool) -> Result<TransferFunction> {
        let [s, _] = self.width();
        let wave = Wave { axis: [1.0, 0.0], start: self.s[0], period: s / BANDS, floor };
        let domain = if steep { [OPEN[0], [self.g[1], f64::INFINITY]] } else { OPEN };
        self.of(vec![Widget { shape: shape(wave), color: BLUE, opacity: WAVES, domain }])
    }

    /// The functions of their figures.
    pub(super) fn figures(&self) -> Result<Vec<Shown>> {
        let [low, middle, high] = self.s;
        let domain = [[(low + middle) / 2.0, (middle + high) / 2.0], [self.g[1], f64::INFINITY]];
        let uniform = self.of(vec![Widget { shape: Shape::Uniform, color: ORANGE, opacity: 0.4, domain }])?;
        let sine = |w| Shape::Sinusoid(w, Sine::Abs);
        let (gaussian, triangle) = (self.gaussian()?, self.wave(Shape::Triangle, 0.0, false)?);
        let (sinusoid, steep) = (self.wave(sine, 0.0, false)?, self.wave(sine, 0.0, true)?);
        let layers = self.wave(Shape::Triangle, 0.9, false)?;
        let shade = Shade { ambient: 0.2, diffuse: 0.7, specular: 0.3, power: 20.0, ..Shade::default() };
        let lit = |t: &TransferFunction| -> Result<TransferFunction> {
            Ok(t.clone().with_shading(Shading::default().with_lights(shade, vec![Light::default()])?))
        };
        let silhouette = triangle.clone().with_shading(Shading::default().with_silhouette(2.0)?);
        Ok(vec![
            ("uniform", "figure 5", uniform.clone(), As::Exact),
            ("uniform, lit", "figure 5", lit(&uniform)?, As::Exact),
            ("Gaussian", "figures 5 7", gaussian.clone(), As::Exact),
            ("Gaussian, 10 pieces", "figure 7", gaussian.clone(), As::Pieces),
            ("Gaussian, lit", "figure 5", lit(&gaussian)?, As::Exact),
            ("triangle", "figure 6a", triangle.clone(), As::Exact),
            ("triangle, 10 pieces", "figure 6a", triangle.clone(), As::Pieces),
            ("triangle, lit", "", lit(&triangle)?, As::Exact),
            ("sinusoid", "", sinusoid.clone(), As::Exact),
            ("sinusoid, lit", "figure 6b", lit(&sinusoid)?, As::Exact),
            ("one variable", "figures 2a 8a", self.bands()?, As::Exact),
            ("two variables", "figures 2b 8b", steep, As::Exact),
            ("layers", "figure 9", layers.clone(), As::Exact),
            ("layers, lit", "figure 9", lit(&layers)?, As::Exact),
            ("silhouettes", "figure 9", silhouette.clone(), As::Exact),
            ("silhouettes, published", "figure 9", silhouette, As::Silhouettes),
        ])
    }
}
