//! Which form of the ray-segment integral draws.

mod setters;

use super::Exact;
use super::table::{Kind, MOST_OF_ALL_LENGTHS};
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// A form of the ray-segment integral and, for tables, what differs between the published ones. The default is exact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub struct IntegrationOptions {
    /// The form.
    pub form: Form,
    /// What a volume holds, and for which lengths.
    pub lengths: Kind,
    /// Texels: values in front, values behind, and lengths of a volume or planes of a cylinder; those of polynomials
    /// are their degree's. Values in front and behind are as many but for volumes. Without: [`IntegrationOptions::size`].
    pub table: Option<[u32; 3]>,
    /// Of polynomials, from 1 to 8: Guthe et al. (2002) have 1, 2 and 4. Those of slabs have 4 at most.
    pub degree: u32,
    /// Steps in which slabs of second order are summed, from 1 to [`MOST_ITERATIONS`]: El Hajjar et al. (2008) have 8 to 256,
    /// and find 64 enough.
    pub iterations: u32,
    /// How polynomials' opacity depends on the length.
    pub alpha: Alpha,
    /// How a cylinder's planes are stored and read.
    pub planes: Planes,
    /// Which of a cylinder's planes serve a fragment is known from its cell: true in parallel views, where it is always
    /// done, and an approximation in others. For interpolated fragments of the projection engine.
    pub per_cell: bool,
    /// What a table's texels are.
    pub texels: Texels,
    /// Where tables are built for a device.
    pub build: Build,
    /// How segments of two variables, or with light, are integrated.
    pub two: Two,
}

impl IntegrationOptions {
    /// These options with the form, or the method of two variables, that options and scenes know by `name`.
    ///
    /// # Errors
    /// With the names that there are.
    pub fn named(self, name: &str) -> std::result::Result<Self, String> {
        if let Some((_, form)) = Form::ALL.into_iter().find(|f| f.0 == name) {
            return Ok(IntegrationOptions { form, ..self });
        }
        if let Some((_, method)) = Method::ALL.into_iter().find(|m| m.0 == name) {
            return Ok(IntegrationOptions { two: Two { method, ..self.two }, ..self });
        }
        let known: Vec<&str> = Form::ALL.iter().map(|f| f.0).chain(Method::ALL.iter().map(|m| m.0)).collect();
        Err(format!("\"{name}\" is not known here; there is {}", known.join(", ")))
    }
}

impl Default for IntegrationOptions {
    fn default() -> Self {
        IntegrationOptions {
            form: Form::default(),
            lengths: Kind::default(),
            table: None,
            degree: 2,
            iterations: 64,
            alpha: Alpha::default(),
            planes: Planes::default(),
            per_cell: false,
            texels: Texels::default(),
            build: Build::default(),
            two: Two::default(),
        }
    }
}

/// A form of the ray-segment integral.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Form {
    /// The exact integral, or a table where functions have so many knots that a look-up is faster:
    /// [`IntegrationOptions::resolved`].
    Auto,
    /// The exact integral.
    #[default]
    Exact,
    /// A table of three parameters: [`super::table::Table`].
    Volume,
    /// Tables of two parameters, and a polynomial of the third: [`super::table::Polynomial`].
    Polynomial,
    /// A table of three parameters that projected cells need a plane of: [`super::table::Cylindrical`].
    Cylindrical,
    /// Of slabs of a grid between three samples, of one length: [`super::table::SecondOrder`].
    SecondOrder,
    /// The same for all lengths: [`super::table::SecondOrderPolynomial`].
    SecondOrderPolynomial,
}

impl Form {
    /// All, by the names that they have in scenes.
    pub const ALL: [(&'static str, Form); 7] = [
        ("auto", Form::Auto),
        ("exact", Form::Exact),
        ("volume", Form::Volume),
        ("polynomial", Form::Polynomial),
        ("cylindrical", Form::Cylindrical),
        ("second-order", Form::SecondOrder),
        ("second-order-polynomial", Form::SecondOrderPolynomial),
    ];

    /// The name that it has in scenes.
    pub fn name(self) -> &'static str {
        Form::ALL.into_iter().find(|f| f.1 == self).map_or("", |f| f.0)
    }

    /// Whether it is of slabs along which the value is a parabola.
    pub fn is_of_second_order(self) -> bool {
        matches!(self, Form::SecondOrder | Form::SecondOrderPolynomial)
    }
}

/// How segments of two variables, or with light, are integrated, and what differs between published variants.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub struct Two {
    /// The method.
    pub method: Method,
    /// Pieces of a segment in a cell that is [`Method::Segmented`], from 1 to [`MOST_PIECES`]; Song et al. take 10.
    pub pieces: u32,
    /// Where such a piece's weights come from.
    pub weights: Weights,
    /// Which cells are left out, as nothing of them can be seen.
    pub culling: Culling,
    /// What a silhouette multiplies.
    pub silhouettes: Silhouettes,
}

/// The most pieces of a segment.
pub const MOST_PIECES: u32 = 10_000;

impl Two {
    /// Whether a segment can be integrated so.
    ///
    /// # Errors
    /// [`Error::Render`] for no pieces, or more than [`MOST_PIECES`].
    pub fn check(&self) -> Result<()> {
        if (1..=MOST_PIECES).contains(&self.pieces) {
            return Ok(());
        }
        Err(Error::Render(format!("a segment has 1 to {MOST_PIECES} pieces, and not {}", self.pieces)))
    }
}

impl Default for Two {
    fn default() -> Self {
        Two {
            method: Method::default(),
            pieces: 10,
            weights: Weights::default(),
            culling: Culling::default(),
            silhouettes: Silhouettes::default(),
        }
    }
}

/// How a segment of two variables, or with light, is integrated.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// In closed form where that is faster, else in as many panels as the error asks for.
    #[default]
    Adaptive,
    /// In closed form wherever there is one (Song et al. 2009, §4, without their tables): where one widget emits alone,
    /// unlit, with extinction for opacity. Else as [`Method::Adaptive`].
    Analytic,
    /// In a fixed number of equal pieces, classified at their ends (Song et al. 2009, §5).
    Segmented,
}

impl Method {
    /// All, by the names that they have in scenes.
    pub const ALL: [(&'static str, Method); 3] =
        [("adaptive", Method::Adaptive), ("analytic", Method::Analytic), ("segmented", Method::Segmented)];

    /// The name that it has in scenes.
    pub fn name(self) -> &'static str {
        Method::ALL.into_iter().find(|m| m.1 == self).map_or("", |m| m.0)
    }
}

/// Where the weights of the light at a piece's ends come from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Weights {
    /// Their closed form.
    #[default]
    Closed,
    /// A texture of 256 × 256 texels over the depths at both ends, up to 8 (Song et al. 2009, equation 3).
    Texture,
}

/// Which cells are left out, as nothing of them can be seen with a function of two variables.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Culling {
    /// Those of whose values, the hull of the pairs at their corners, none meets the function.
    #[default]
    Hull,
    /// Those whose corners do not meet it (Song et al. 2009, §3.1): what is between them is lost.
    Corners,
    /// None.
    None,
}

/// What a silhouette multiplies.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Silhouettes {
    /// Extinction, everywhere along a segment.
    #[default]
    Exact,
    /// The opacity and the light of a whole segment, by the gradient in its middle (Song et al. 2009, §6.2): it depends on how the
    /// mesh is cut into cells.
    Published,
}

/// How polynomials' opacity depends on the length.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Alpha {
    /// As it does: α = 1 − e^{−l ρ̂}.
    #[default]
    Exponential,
    /// Linearly, up to what it is at the longest length: the baseline that Guthe et al. compare with.
    Linear,
}

/// How a cylinder's planes are stored and read.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Planes {
    /// The two nearest are interpolated.
    #[default]
    Two,
    /// The nearest alone is read, as by graphics cards with one texture.
    One,
    /// As [`Planes::Two`], with the two triangles that steep planes are in one tile: a quarter less memory.
    Packed,
}

/// What a table's texels are.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Texels {
    /// 32-bit floats.
    #[default]
    Float,
    /// 16 bits, of the range that there is.
    Unorm16,
    /// 8 bits, likewise.
    Unorm8,
}

/// Where tables are built that a device looks up. Devices build tables of 32-bit floats, with as many values behind as
/// in front, and not [`Planes::Packed`]; others are always built on the host.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Build {
    /// On the device, unless that is software.
    #[default]
    Auto,
    /// On the processor, from where they are handed over.
    Host,
    /// On the device, be it software: frames then wait behind that.
    Device,
}

/// Knots that the mean cell spans, up to which [`Form::Auto`] is exact.
pub const FEW_KNOTS: f64 = 8.0;

/// Extinction, per normalised unit, up to which tables of colours over what is seen of a length hold direct emission:
/// rounding is 1e-7 of it.
const OPAQUE_TEXEL: f32 = 1e4;

/// The most steps in which a slab is summed.
pub const MOST_ITERATIONS: u32 = 65_536;

/// Bytes of a table at most.
const MOST_BYTES: u64 = 1 << 30;

impl IntegrationOptions {
    /// This form with everything else as it is by default.
    pub fn of(form: Form) -> Self {
        IntegrationOptions { form, ..IntegrationOptions::default() }
    }

    /// [`Form::Auto`] decided; other forms stay. `knots` is the number of knots that the values in the mean cell span,
    /// of `all` that the function has.
    ///
    /// The exact integral takes time that grows with the knots which a segment crosses, and a look-up does not: up to
    /// [`FEW_KNOTS`] in the mean cell it is exact, beyond it is a table of polynomials, the smallest form for as many
    /// values. A table needs about two texels for each knot, so that functions of more than 512 stay exact too.
    pub fn resolved(self, knots: f64, all: usize) -> Self {
        if self.form != Form::Auto {
            return self;
        }
        let form = if knots > FEW_KNOTS && all <= 512 { Form::Polynomial } else { Form::Exact };
        IntegrationOptions { form, ..self }
    }

    /// Texels along each axis, for a function of so many knots; the last is that of lengths, coefficients or planes.
    /// Volumes of uniform lengths may be given others, by the bound on their error: [`super::table::size`].
    pub fn size(&self, knots: usize) -> [u32; 3] {
        let values = |low: u32, high: u32| (2 * knots as u32).next_power_of_two().clamp(low, high);
        match (self.form, self.table) {
            (Form::Polynomial, Some([front, ..])) => [front, front, self.degree + 1],
            (Form::Polynomial, None) => [values(512, 1024), values(512, 1024), self.degree + 1],
            (Form::SecondOrder | Form::SecondOrderPolynomial, Some([n, m, 0])) if n == m => [n; 3],
            (Form::SecondOrder, None) => [256; 3],
            (Form::SecondOrderPolynomial, None) => [64; 3],
            (_, Some(table)) => table,
            (Form::Cylindrical, None) => [256; 3],
            (_, None) if self.lengths == Kind::Uniform => [256, 256, 64],
            (_, None) => [values(256, 512), values(256, 512), 16],
        }
    }

    /// Bytes of a table of `size`, as 32-bit floats.
    pub fn bytes(size: [u32; 3]) -> u64 {
        size.iter().fold(16, |n: u64, &s| n.saturating_mul(u64::from(s)))
    }

    /// Whether such a table can hold a function.
    ///
    /// # Errors
    /// [`Error::Render`] for direct emission that is nearly opaque somewhere, if the table has colours over what is seen
    /// of a length: that is nearly nothing there, and rounding of one texel is more than all of its neighbour.
    pub fn check_function(&self, exact: &Exact<f32>) -> Result<()> {
        let is_normalised = match self.form {
            Form::Polynomial | Form::SecondOrderPolynomial => true,
            form => form == Form::Volume && self.lengths == Kind::LogNormalised,
        };
        if !is_normalised || !exact.direct || exact.opacity.steepest() <= OPAQUE_TEXEL {
            return Ok(());
        }
        let what = "this form of table cannot hold direct emission that is nearly opaque somewhere";
        Err(Error::Render(format!(
            "{what}; use a volume with lengths log or uniform, a cylinder, or the exact integral"
        )))
    }

    /// Whether there can be such a table.
    ///
    /// # Errors
    /// [`Error::Render`], with what there can be.
    pub fn check(&self, size: [u32; 3]) -> Result<()> {
        let [front, back, depth] = size;
        let wrong = match self.form {
            Form::Auto | Form::Exact => return Ok(()),
            Form::Volume if depth == 0 => Some(format!(
                "a volume has three sizes, the last for lengths, such as {front}x{back}x16, and here are two"
            )),
            Form::Cylindrical if depth == 0 => Some(format!(
                "a cylinder has three sizes, the last for planes, such as {front}x{front}x256, and here are two"
            )),
            Form::Volume if front < 2 || back < 2 || depth < 3 => {
                Some("a table has at least 2, 2 and 3 texels along its axes".to_owned())
            }
            Form::Polynomial if front < 2 => Some("a table of polynomials has at least 2 x 2 texels".to_owned()),
            Form::Polynomial if !(1..=8).contains(&self.degree) => {
                Some(format!("polynomials have a degree from 1 to 8, and not {}", self.degree))
            }
            Form::Cylindrical if front != back || front < 2 || depth == 0 || !depth.is_multiple_of(4) => {
                Some("a cylindrical table has as many texels for values in front as behind, at least 2, and a multiple of 4 planes".to_owned())
            }
            Form::SecondOrder | Form::SecondOrderPolynomial if front < 2 || back != front || depth != front => {
                Some("a table of second order has as many texels along each axis, at least 2".to_owned())
            }
            Form::SecondOrderPolynomial if front > MOST_OF_ALL_LENGTHS => {
                Some(format!("a table of second order for all lengths has at most {MOST_OF_ALL_LENGTHS} texels along each axis"))
            }
            Form::SecondOrderPolynomial if !(1..=4).contains(&self.degree) => {
                Some(format!("polynomials of slabs have a degree from 1 to 4, and not {}", self.degree))
            }
            Form::SecondOrder if !(1..=MOST_ITERATIONS).contains(&self.iterations) => {
                Some(format!("a slab is summed in 1 to {MOST_ITERATIONS} steps, and not in {}", self.iterations))
            }
            _ => None,
        };
        let bytes = IntegrationOptions::bytes(size);
        let wrong = wrong.or_else(|| {
            (bytes > MOST_BYTES)
                .then(|| format!("a table of {size:?} texels takes {bytes} bytes, and {MOST_BYTES} at most"))
        });
        wrong.map_or(Ok(()), |what| Err(Error::Render(format!("{what}; use another size, or the exact integral"))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::{self, Normalization};
    use crate::transfer::{Emission, TransferFunction};

    #[test]
    fn opaque_direct_emission_is_refused_where_colours_are_over_what_is_seen() {
        let exact = |emission, extinction| {
            let transfer = TransferFunction::new(vec![(0.0, [0.5; 3])], vec![(-1.0, 0.0), (1.0, extinction)], 1.0);
            let transfer = transfer.unwrap().with_emission(emission).unwrap();
            Exact::new(&transfer, field::Kind::Scalar, &[Normalization { mid: 0.0, half: 1.0 }; 4], 1.0)
        };
        let direct = Emission::Direct { scale: 1.0 };
        for (form, lengths, refused) in [
            (Form::Polynomial, Kind::LogNormalised, true),
            (Form::Volume, Kind::LogNormalised, true),
            (Form::Volume, Kind::Log, false),
            (Form::Cylindrical, Kind::LogNormalised, false),
            (Form::Exact, Kind::LogNormalised, false),
        ] {
            let options = IntegrationOptions { lengths, ..IntegrationOptions::of(form) };
            assert_eq!(options.check_function(&exact(direct, 1e6)).is_err(), refused, "{form:?}, {lengths:?}");
            assert!(options.check_function(&exact(direct, 10.0)).is_ok(), "{form:?}, {lengths:?}");
            assert!(options.check_function(&exact(Emission::Chromatic, 1e6)).is_ok(), "{form:?}, {lengths:?}");
        }
    }

    #[test]
    fn auto_is_exact_while_knots_are_few() {
        let form = |knots, all| IntegrationOptions::of(Form::Auto).resolved(knots, all).form;
        assert_eq!(form(0.3, 4), Form::Exact);
        assert_eq!(form(FEW_KNOTS, 254), Form::Exact);
        assert_eq!(form(FEW_KNOTS + 0.1, 254), Form::Polynomial);
        // No table resolves so many.
        assert_eq!(form(900.0, 5000), Form::Exact);
        assert_eq!(IntegrationOptions::of(Form::Volume).resolved(0.0, 1).form, Form::Volume);
    }

    #[test]
    fn sizes_follow_the_function() {
        assert_eq!(IntegrationOptions::of(Form::Polynomial).size(10), [512, 512, 3]);
        assert_eq!(
            IntegrationOptions { degree: 4, ..IntegrationOptions::of(Form::Polynomial) }.size(500),
            [1024, 1024, 5]
        );
        assert_eq!(IntegrationOptions::of(Form::Volume).size(200), [512, 512, 16]);
        assert_eq!(IntegrationOptions::of(Form::Cylindrical).size(3), [256; 3]);
        let own = IntegrationOptions { table: Some([8, 9, 10]), ..IntegrationOptions::of(Form::Volume) };
        assert_eq!(own.size(200), [8, 9, 10]);
        assert_eq!(IntegrationOptions::of(Form::SecondOrder).size(3), [256; 3]);
        let small =
            IntegrationOptions { table: Some([32, 32, 0]), ..IntegrationOptions::of(Form::SecondOrderPolynomial) };
        assert_eq!(small.size(3), [32; 3]);
        for (_, form) in Form::ALL {
            let options = IntegrationOptions::of(form);
            options.check(options.size(1_000_000)).unwrap();
        }
    }

    #[test]
    fn what_is_no_table_is_refused() {
        let refused = |form, table, degree, part: &str| {
            let options = IntegrationOptions { table: Some(table), degree, ..IntegrationOptions::of(form) };
            let message = options.check(options.size(4)).unwrap_err().to_string();
            assert!(message.contains(part) && message.contains("exact"), "{message}");
        };
        refused(Form::Volume, [1, 2, 3], 2, "at least 2, 2 and 3");
        refused(Form::Volume, [256, 256, 0], 2, "256x256x16");
        refused(Form::Cylindrical, [64, 64, 0], 2, "64x64x256");
        refused(Form::Volume, [4096, 4096, 64], 2, "bytes");
        refused(Form::Polynomial, [64, 64, 0], 9, "degree");
        refused(Form::Polynomial, [1, 64, 0], 2, "2 x 2");
        refused(Form::Cylindrical, [64, 64, 6], 2, "multiple of 4");
        refused(Form::Cylindrical, [64, 32, 8], 2, "as many");
        refused(Form::SecondOrder, [64, 64, 32], 2, "along each axis");
        refused(Form::SecondOrder, [512, 512, 512], 2, "bytes");
        refused(Form::SecondOrderPolynomial, [256, 256, 256], 2, "at most 128");
        refused(Form::SecondOrderPolynomial, [8, 8, 8], 5, "from 1 to 4");
        for iterations in [0, MOST_ITERATIONS + 1] {
            let options = IntegrationOptions { iterations, ..IntegrationOptions::of(Form::SecondOrder) };
            assert!(options.check([8; 3]).unwrap_err().to_string().contains("65536 steps"));
        }
        for pieces in [0, MOST_PIECES + 1] {
            assert!(Two { pieces, ..Two::default() }.check().unwrap_err().to_string().contains("1 to 10000 pieces"));
        }
        Two::default().check().unwrap();
    }
}
