//! Functions of two variables: the scalar s and a second one g, the length of its gradient or another array.
//!
//! Song, Chen, Maciejewski, Gaither & Ebert (Bivariate Transfer Functions on Unstructured Grids, 2009) give the widgets.
//! Where they leave the argument of a wave open, an axis in the plane of s and g says along what it runs.

use super::{interpolate, knots};
use crate::error::{Error, Result};
use std::f64::consts::PI;

/// Colour and opacity over (s, g): what takes the place of the functions of s alone, and what multiplies extinction.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Bivariate {
    source: Source,
    gradient_opacity: Option<Vec<(f64, f64)>>,
}

/// What says colour and opacity.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Source {
    /// The functions of s alone.
    #[default]
    Scalar,
    /// Widgets, whose extinctions and emissions add up.
    Widgets(Vec<Widget>),
    /// A table.
    Table(Table),
}

/// A shape in the plane of s and g, in one colour.
#[derive(Debug, Clone, PartialEq)]
pub struct Widget {
    /// How opaque it is where, as a share of `opacity`.
    pub shape: Shape,
    /// Its colour, in [0, 1].
    pub color: [f64; 3],
    /// Its greatest opacity, at least 0; above 1 only where that is extinction.
    pub opacity: f64,
    /// The box outside of which there is nothing of it: least and greatest s, least and greatest g, both included.
    /// Infinite where it is open.
    pub domain: [[f64; 2]; 2],
}

/// The box of a widget that is open on all sides.
pub const OPEN: [[f64; 2]; 2] = [[f64::NEG_INFINITY, f64::INFINITY]; 2];

/// How opaque a widget is at a place, as a share of its greatest opacity.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// As opaque everywhere (equation 5).
    Uniform,
    /// exp(−(s − s₀)²/2σ_s² − (g − g₀)²/2σ_g²) (equations 6 and 7).
    Gaussian {
        /// (s₀, g₀).
        center: [f64; 2],
        /// (σ_s, σ_g), above 0.
        sigma: [f64; 2],
    },
    /// A triangle wave: 0 where the phase is a whole number, 1 half way between (equations 8 and 9).
    Triangle(Wave),
    /// A sinusoid (equation 10).
    Sinusoid(Wave, Sine),
}

/// What a wave runs along: its phase at (s, g) is p = (axis · (s, g) − start)/period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wave {
    /// The direction in the plane of s and g, of any length but 0; its length counts.
    pub axis: [f64; 2],
    /// Where the phase is 0.
    pub start: f64,
    /// Above 0.
    pub period: f64,
    /// In [0, 1): of a wave w only max(0, (w − floor)/(1 − floor)) is left, its peaks.
    pub floor: f64,
}

/// The form of a sinusoid of phase p.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sine {
    /// |sin πp|.
    #[default]
    Abs,
    /// max(0, sin 2πp).
    Positive,
    /// (1 − cos 2πp)/2.
    Raised,
}

impl Wave {
    /// The phase at (s, g).
    pub fn phase(&self, [s, g]: [f64; 2]) -> f64 {
        // An axis that does not look at a variable does not see one that is infinite.
        let along = |axis: f64, x: f64| if axis == 0.0 { 0.0 } else { axis * x };
        (along(self.axis[0], s) + along(self.axis[1], g) - self.start) / self.period
    }

    /// By how much the phase rises where s and g rise by so much.
    pub(crate) fn rise(&self, rise: [f64; 2]) -> f64 {
        (self.axis[0] * rise[0] + self.axis[1] * rise[1]) / self.period
    }

    /// What the floor leaves of a wave of height `w`.
    fn above(&self, w: f64) -> f64 {
        if self.floor > 0.0 { ((w - self.floor) / (1.0 - self.floor)).max(0.0) } else { w }
    }
}

impl Widget {
    /// Whether `at` = (s, g) is in the box.
    pub fn holds(&self, at: [f64; 2]) -> bool {
        (0..2).all(|k| at[k] >= self.domain[k][0] && at[k] <= self.domain[k][1])
    }

    /// The opacity at (s, g), whether in the box or not.
    pub fn height(&self, at: [f64; 2]) -> f64 {
        let share = match &self.shape {
            Shape::Uniform => 1.0,
            Shape::Gaussian { center, sigma } => {
                let [x, y] = [0, 1].map(|k| (at[k] - center[k]) / sigma[k]);
                (-0.5 * (x * x + y * y)).exp()
            }
            Shape::Triangle(wave) => {
                let p = wave.phase(at);
                wave.above(1.0 - (2.0 * (p - p.floor()) - 1.0).abs())
            }
            Shape::Sinusoid(wave, sine) => {
                // Whole periods are taken off first: sines of great arguments are slow.
                let p = wave.phase(at);
                let f = p - p.floor();
                wave.above(match sine {
                    Sine::Abs => (PI * f).sin(),
                    Sine::Positive => (2.0 * PI * f).sin().max(0.0),
                    Sine::Raised => (1.0 - (2.0 * PI * f).cos()) / 2.0,
                })
            }
        };
        self.opacity * share
    }

    /// The opacity at (s, g).
    pub fn opacity_at(&self, at: [f64; 2]) -> f64 {
        if self.holds(at) { self.height(at) } else { 0.0 }
    }

    /// Says what is wrong with it, if anything.
    pub(crate) fn check(&self) -> Result<(), String> {
        if let Some(c) = self.color.iter().find(|c| !(0.0..=1.0).contains(*c)) {
            return Err(format!("color: red, green and blue are 0 to 1, and one is {c}"));
        }
        if !(self.opacity >= 0.0 && self.opacity.is_finite()) {
            return Err(format!("opacity: {} is no opacity, which is 0 or more", self.opacity));
        }
        for (name, [lo, hi]) in ["s", "g"].into_iter().zip(self.domain) {
            if lo.is_nan() || hi.is_nan() || lo > hi {
                return Err(format!("{name}: the box ends at {hi}, before it begins at {lo}"));
            }
        }
        let finite = |name: &str, values: &[f64]| match values.iter().find(|v| !v.is_finite()) {
            Some(v) => Err(format!("{name}: {v} is not finite")),
            None => Ok(()),
        };
        let positive = |name: &str, values: &[f64]| match values.iter().find(|v| !(**v > 0.0 && v.is_finite())) {
            Some(v) => Err(format!("{name}: {v} is not above 0")),
            None => Ok(()),
        };
        match &self.shape {
            Shape::Uniform => Ok(()),
            Shape::Gaussian { center, sigma } => finite("center", center).and(positive("sigma", sigma)),
            Shape::Triangle(wave) | Shape::Sinusoid(wave, _) => {
                finite("axis", &wave.axis)?;
                if wave.axis == [0.0; 2] {
                    return Err("axis: it is zero".into());
                }
                finite("v0", &[wave.start]).and(positive("period", &[wave.period]))?;
                if !(0.0..1.0).contains(&wave.floor) {
                    return Err(format!("floor: {} is not from 0 to below 1", wave.floor));
                }
                Ok(())
            }
        }
    }
}

/// Colour and opacity over (s, g) between the centres of texels, bilinear; beyond the outer centres as there.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    size: [usize; 2],
    texels: Vec<[f64; 4]>,
    ranges: [[f64; 2]; 2],
}

impl Table {
    /// A table of `size` = (columns over s, rows over g) texels, row by row from the least g: red, green and blue, in
    /// [0, 1] and not multiplied by the opacity, which is the fourth. `ranges` are those of s and g, from edge to edge of
    /// the outer texels.
    ///
    /// # Errors
    /// [`Error::Transfer`] if there are not as many texels, or none, if a colour or an opacity cannot be, or if a range
    /// does not ascend.
    pub fn new(size: [usize; 2], texels: Vec<[f64; 4]>, ranges: [[f64; 2]; 2]) -> Result<Self> {
        let fail = |what: String| Err(Error::Transfer(what));
        let [columns, rows] = size;
        if columns == 0 || rows == 0 || columns.checked_mul(rows) != Some(texels.len()) {
            return fail(format!("{} texels do not make a table of {columns} columns and {rows} rows", texels.len()));
        }
        for (name, [lo, hi]) in ["s", "g"].into_iter().zip(ranges) {
            if !(lo < hi && lo.is_finite() && hi.is_finite()) {
                return fail(format!("the table's range of {name} is from {lo} to {hi}: it must ascend"));
            }
        }
        let usable = |t: &[f64; 4]| t[..3].iter().all(|c| (0.0..=1.0).contains(c)) && t[3] >= 0.0 && t[3].is_finite();
        if let Some(i) = texels.iter().position(|t| !usable(t)) {
            let [r, g, b, a] = texels[i];
            let (column, row) = (i % columns, i / columns);
            return fail(format!(
                "the texel in column {column} of row {row} is ({r}, {g}, {b}, {a}): colours are 0 to 1, and an opacity is \
                 0 or more"
            ));
        }
        Ok(Table { size, texels, ranges })
    }

    /// Columns over s, and rows over g.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// The ranges of s and g, from edge to edge.
    pub fn ranges(&self) -> [[f64; 2]; 2] {
        self.ranges
    }

    /// All texels, row by row.
    pub(crate) fn texels(&self) -> &[[f64; 4]] {
        &self.texels
    }

    /// Whether a texel is not clear.
    pub(crate) fn is_seen(&self, column: usize, row: usize) -> bool {
        self.texels[column + self.size[0] * row][3] > 0.0
    }

    /// Where (s, g) is, counted in texels from the centre of the first; not limited to the centres.
    pub fn place(&self, at: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|k| {
            let [lo, hi] = self.ranges[k];
            (at[k] - lo) / (hi - lo) * self.size[k] as f64 - 0.5
        })
    }

    /// Red, green, blue and opacity at a [`Self::place`].
    pub fn texel(&self, place: [f64; 2]) -> [f64; 4] {
        let [columns, rows] = self.size;
        let at = |k: usize| {
            let last = self.size[k] as f64 - 1.0;
            let x = place[k].clamp(0.0, last);
            let below = x.floor().min((last - 1.0).max(0.0));
            (below as usize, x - below)
        };
        let ((i, u), (j, v)) = (at(0), at(1));
        let [right, up] = [usize::from(columns > 1), columns * usize::from(rows > 1)];
        let first = i + columns * j;
        let [a, b, c, d] = [first, first + right, first + up, first + right + up].map(|t| &self.texels[t]);
        std::array::from_fn(|k| {
            let (low, high) = (a[k] + (b[k] - a[k]) * u, c[k] + (d[k] - c[k]) * u);
            low + (high - low) * v
        })
    }

    /// Red, green, blue and opacity at (s, g).
    pub fn at(&self, at: [f64; 2]) -> [f64; 4] {
        self.texel(self.place(at))
    }
}

impl Bivariate {
    /// What says colour and opacity.
    pub fn source(&self) -> &Source {
        &self.source
    }

    /// The knots `(g, h)` of the function h(g) that multiplies extinction, ascending, if there is one. Outside of them the
    /// end values hold.
    pub fn gradient_opacity(&self) -> Option<&[(f64, f64)]> {
        self.gradient_opacity.as_deref()
    }

    /// h(g); 1 if there is no such function. At a step, its upper side.
    pub fn factor(&self, g: f64) -> f64 {
        self.gradient_opacity.as_ref().map_or(1.0, |knots| interpolate(knots, g, true, |h| *h))
    }

    /// With widgets in the place of the functions of s.
    ///
    /// # Errors
    /// [`Error::Transfer`] if there is none, or what a widget is cannot be, which is named as scenes do.
    pub fn with_widgets(mut self, widgets: Vec<Widget>) -> Result<Self> {
        if widgets.is_empty() {
            return Err(Error::Transfer("widgets: there is none".into()));
        }
        for (i, widget) in widgets.iter().enumerate() {
            widget.check().map_err(|what| Error::Transfer(format!("widgets[{i}].{what}")))?;
        }
        self.source = Source::Widgets(widgets);
        Ok(self)
    }

    /// With a table in the place of the functions of s.
    pub fn with_table(mut self, table: Table) -> Self {
        self.source = Source::Table(table);
        self
    }

    /// With extinction multiplied by a function of g with these knots `(g, h)`, ascending; two at one g are a step.
    ///
    /// # Errors
    /// [`Error::Transfer`] if there is no knot, they decrease in g, or a number is negative where it must not be, or not
    /// finite.
    pub fn with_gradient_opacity(mut self, function: Vec<(f64, f64)>) -> Result<Self> {
        knots::check("gradient_opacity", function.iter().map(|k| k.0))?;
        if let Some((g, h)) = function.iter().find(|k| !(k.1 >= 0.0 && k.1.is_finite())) {
            return Err(Error::Transfer(format!("gradient_opacity at {g} is {h}: it is 0 or more")));
        }
        self.gradient_opacity = Some(function);
        Ok(self)
    }

    /// Whether anything of it depends on g.
    pub(crate) fn needs_second(&self) -> bool {
        self.source != Source::Scalar || self.gradient_opacity.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn widget(shape: Shape) -> Widget {
        Widget { shape, color: [1.0, 0.5, 0.0], opacity: 0.8, domain: OPEN }
    }

    fn wave(axis: [f64; 2], floor: f64) -> Wave {
        Wave { axis, start: 10.0, period: 4.0, floor }
    }

    #[test]
    fn widgets_are_what_song_et_al_draw() {
        let box_only = Widget { domain: [[1.0, 2.0], [f64::NEG_INFINITY, 5.0]], ..widget(Shape::Uniform) };
        assert_eq!(
            [[1.0, 5.0], [2.0, -9.0], [0.999, 0.0], [1.5, 5.001]].map(|at| box_only.opacity_at(at)),
            [0.8, 0.8, 0.0, 0.0]
        );
        let gaussian = widget(Shape::Gaussian { center: [1.0, 2.0], sigma: [0.5, 3.0] });
        assert!((gaussian.opacity_at([1.5, 5.0]) - 0.8 * (-1.0_f64).exp()).abs() < 1e-15);
        let at = |shape: Shape, s: f64| widget(shape).opacity_at([s, 7.0]);
        let triangle = |s| at(Shape::Triangle(wave([1.0, 0.0], 0.0)), s);
        assert_eq!([10.0, 12.0, 14.0, 11.0, 9.0].map(triangle), [0.0, 0.8, 0.0, 0.4, 0.4]);
        let sine = |kind, s| at(Shape::Sinusoid(wave([1.0, 0.0], 0.0), kind), s);
        for (kind, s, wanted) in [
            (Sine::Abs, 12.0, 0.8),
            (Sine::Abs, 11.0, 0.8 * 0.5_f64.sqrt()),
            (Sine::Positive, 11.0, 0.8),
            (Sine::Positive, 13.0, 0.0),
            (Sine::Raised, 12.0, 0.8),
            (Sine::Raised, 11.0, 0.4),
            (Sine::Raised, 7.0, 0.4),
        ] {
            assert!((sine(kind, s) - wanted).abs() < 1e-15, "{kind:?} {s}");
        }
        // Along an oblique axis, 0.5 s + 2 g counts.
        let oblique = widget(Shape::Triangle(wave([0.5, 2.0], 0.0)));
        assert!((oblique.opacity_at([4.0, 5.0]) - 0.8).abs() < 1e-15);
        // Of a wave with a floor, the peaks are left, as high as before.
        let peaks = |s| at(Shape::Triangle(wave([1.0, 0.0], 0.5)), s);
        assert_eq!([12.0, 11.0, 10.5].map(peaks), [0.8, 0.0, 0.0]);
        assert!((peaks(11.5) - 0.4).abs() < 1e-15);
    }

    #[test]
    fn tables_are_bilinear_between_the_centres_of_texels() {
        let texels = vec![[0.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.5], [0.0, 1.0, 0.0, 1.0], [1.0, 1.0, 0.0, 3.5]];
        let table = Table::new([2, 2], texels, [[0.0, 4.0], [-1.0, 1.0]]).unwrap();
        assert_eq!(table.at([1.0, -0.5]), [0.0; 4]);
        assert_eq!(table.at([-7.0, -9.0]), [0.0; 4]);
        assert_eq!(table.at([3.0, 0.5]), [1.0, 1.0, 0.0, 3.5]);
        assert_eq!(table.at([9.0, 0.5]), [1.0, 1.0, 0.0, 3.5]);
        assert_eq!(table.at([2.0, 0.0]), [0.5, 0.5, 0.0, 1.25]);
        assert_eq!(table.at([1.5, -0.5]), [0.25, 0.0, 0.0, 0.125]);
        let line = Table::new([3, 1], vec![[0.0; 4], [0.5; 4], [1.0; 4]], [[0.0, 3.0], [0.0, 1.0]]).unwrap();
        assert_eq!(line.at([1.0, 40.0]), [0.25; 4]);
        assert_eq!(Table::new([1, 1], vec![[0.3; 4]], [[0.0, 1.0]; 2]).unwrap().at([0.7, 0.1]), [0.3; 4]);
    }

    #[test]
    fn what_cannot_be_is_named() {
        let told =
            |w: Widget| Bivariate::default().with_widgets(vec![widget(Shape::Uniform), w]).unwrap_err().to_string();
        let plain = || widget(Shape::Uniform);
        for (widget, part) in [
            (Widget { color: [0.0, 1.2, 0.0], ..plain() }, "widgets[1].color"),
            (Widget { opacity: -0.1, ..plain() }, "widgets[1].opacity"),
            (Widget { domain: [[0.0, 1.0], [3.0, 2.0]], ..plain() }, "widgets[1].g"),
            (widget(Shape::Gaussian { center: [0.0; 2], sigma: [1.0, 0.0] }), "widgets[1].sigma"),
            (widget(Shape::Triangle(Wave { period: 0.0, ..wave([1.0, 0.0], 0.0) })), "widgets[1].period"),
            (widget(Shape::Triangle(wave([0.0, 0.0], 0.0))), "widgets[1].axis"),
            (widget(Shape::Triangle(wave([1.0, 0.0], 1.0))), "widgets[1].floor"),
        ] {
            let message = told(widget);
            assert!(message.contains(part), "{message}");
        }
        let table = |size, texel: [f64; 4], ranges| Table::new(size, vec![texel; 2], ranges).unwrap_err().to_string();
        let ranges = [[0.0, 1.0]; 2];
        assert!(table([2, 2], [0.0; 4], ranges).contains("2 texels"));
        assert!(table([2, 1], [0.0, 0.0, 1.1, 0.0], ranges).contains("column 0 of row 0"));
        assert!(table([1, 2], [0.0; 4], [[0.0, 1.0], [1.0, 1.0]]).contains("range of g"));
        let h =
            |knots: &[(f64, f64)]| Bivariate::default().with_gradient_opacity(knots.to_vec()).unwrap_err().to_string();
        assert!(h(&[]).contains("gradient_opacity") && h(&[(1.0, 0.0), (0.0, 0.0)]).contains("ascend"));
        assert!(h(&[(1.0, -2.0)]).contains("-2"));
    }
}
