//! Transfer functions.

use crate::mesh::shape;
use crate::{Error, raised};
use halite::scene::look;
use halite::transfer::bivariate::{Source, Table};
use halite::transfer::colormap::ColorMap;
use halite::transfer::{Convention, Emission};
use numpy::{PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;

/// Colour and opacity of a scalar; it never changes.
#[pyclass(module = "halite._halite", frozen)]
pub(crate) struct TransferFunction(pub(crate) halite::transfer::TransferFunction);

/// Texels of shape (rows over g, columns over s, 4), and the ranges of s and g.
type Texels<'py> = (PyReadonlyArray3<'py, f64>, [[f64; 2]; 2]);

#[pymethods]
impl TransferFunction {
    /// `second` is a text of JSON: what scenes have of widgets, gradient opacity, silhouettes, light and lights.
    #[new]
    #[allow(clippy::too_many_arguments, reason = "all have names in Python")]
    fn new(
        color: Vec<[f64; 4]>,
        opacity: Vec<[f64; 2]>,
        unit_distance: f64,
        convention: &str,
        emission_scale: Option<f64>,
        clamp: bool,
        second: &str,
        table: Option<Texels<'_>>,
    ) -> PyResult<Self> {
        let convention = match convention {
            "extinction" => Convention::Extinction,
            "opacity" => Convention::Opacity,
            other => {
                let what =
                    format!("no opacity convention is called \"{other}\"; there are \"extinction\" and \"opacity\"");
                return Err(Error::new_err(what));
            }
        };
        let value = serde_json::from_str(second).map_err(|e| Error::new_err(e.to_string()))?;
        let (mut two, shading) = look(&value).map_err(raised)?;
        if let Some((texels, ranges)) = table {
            let &[rows, columns, 4] = texels.shape() else {
                let what = format!("a table has the shape (rows, columns, 4), and not {}", shape(texels.shape()));
                return Err(Error::new_err(what));
            };
            let texels = texels.as_slice()?.as_chunks().0.to_vec();
            two = two.with_table(Table::new([columns, rows], texels, ranges).map_err(raised)?);
        }
        let function = if *two.source() == Source::Scalar {
            let color = color.into_iter().map(|[s, r, g, b]| (s, [r, g, b])).collect();
            let opacity = opacity.into_iter().map(|[s, a]| (s, a)).collect();
            halite::transfer::TransferFunction::new(color, opacity, unit_distance).map_err(raised)?.with_bivariate(two)
        } else {
            halite::transfer::TransferFunction::of_two(two, unit_distance).map_err(raised)?
        };
        let mut function = function.with_convention(convention).with_clamp(clamp).with_shading(shading);
        if let Some(scale) = emission_scale {
            function = function.with_emission(Emission::Direct { scale }).map_err(raised)?;
        }
        Ok(TransferFunction(function))
    }

    #[getter]
    fn color(&self) -> Vec<[f64; 4]> {
        self.0.color().iter().map(|&(s, [r, g, b])| [s, r, g, b]).collect()
    }

    #[getter]
    fn opacity(&self) -> Vec<[f64; 2]> {
        self.0.opacity().iter().map(|&(s, a)| [s, a]).collect()
    }

    #[getter]
    fn unit_distance(&self) -> f64 {
        self.0.unit_distance()
    }
}

/// The knots (scalar, red, green, blue) of a colour map over a range.
#[pyfunction]
pub(crate) fn colormap(name: &str, low: f64, high: f64) -> PyResult<Vec<[f64; 4]>> {
    let map = ColorMap::named(name).map_err(raised)?;
    Ok(map.over([low, high]).into_iter().map(|(s, [r, g, b])| [s, r, g, b]).collect())
}
