//! Transfer functions.

use crate::{Error, raised};
use halite::scene::widget;
use halite::transfer::colormap::ColorMap;
use halite::transfer::shading::{Shade, Shading};
use halite::transfer::{Bivariate, Convention, Emission};
use pyo3::prelude::*;

/// Colour and opacity of a scalar; it never changes.
#[pyclass(module = "halite._halite", frozen)]
pub(crate) struct TransferFunction(pub(crate) halite::transfer::TransferFunction);

#[pymethods]
impl TransferFunction {
    #[new]
    #[allow(clippy::too_many_arguments, reason = "all have names in Python")]
    fn new(
        color: Vec<[f64; 4]>,
        opacity: Vec<[f64; 2]>,
        unit_distance: f64,
        convention: &str,
        emission_scale: Option<f64>,
        gradient_opacity: Vec<[f64; 2]>,
        widgets: Vec<String>,
        silhouette: Option<f64>,
        shade: Option<[f64; 4]>,
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
        let mut two = Bivariate::default();
        if !gradient_opacity.is_empty() {
            let knots = gradient_opacity.into_iter().map(|[g, h]| (g, h)).collect();
            two = two.with_gradient_opacity(knots).map_err(raised)?;
        }
        let function = if widgets.is_empty() {
            let color = color.into_iter().map(|[s, r, g, b]| (s, [r, g, b])).collect();
            let opacity = opacity.into_iter().map(|[s, a]| (s, a)).collect();
            halite::transfer::TransferFunction::new(color, opacity, unit_distance).map_err(raised)?.with_bivariate(two)
        } else {
            let read = |(i, text): (usize, &String)| {
                let value = serde_json::from_str(text).map_err(|e| e.to_string());
                value.and_then(|v| widget(&v)).map_err(|e| Error::new_err(format!("widgets[{i}]: {e}")))
            };
            let widgets = widgets.iter().enumerate().map(read).collect::<PyResult<_>>()?;
            let two = two.with_widgets(widgets).map_err(raised)?;
            halite::transfer::TransferFunction::of_two(two, unit_distance).map_err(raised)?
        };
        let mut shading = Shading::default();
        if let Some(p) = silhouette {
            shading = shading.with_silhouette(p).map_err(raised)?;
        }
        if let Some([ambient, diffuse, specular, power]) = shade {
            let shade = Shade { ambient, diffuse, specular, power, ..Shade::default() };
            shading = shading.with_lights(shade, vec![Default::default()]).map_err(raised)?;
        }
        let mut function = function.with_convention(convention).with_shading(shading);
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
