//! Transfer functions, as C++ describes them.

use super::bridge::{LightKind, LightSpec, ShadeSpec, TransferSpec};
use halite::error::{Error, Result};
use halite::scene::widget;
use halite::transfer::bivariate::Table;
use halite::transfer::shading::{Cone, Highlight, Light, Origin, Shade, Shading};
use halite::transfer::{Bivariate, Convention, TransferFunction};

/// The function that a specification describes.
///
/// # Errors
/// [`Error::Transfer`], with what is wrong.
pub(super) fn transfer(spec: &TransferSpec) -> Result<TransferFunction> {
    let bivariate = bivariate(spec)?;
    let convention = if spec.slab { Convention::Opacity } else { Convention::Extinction };
    let function = if spec.widgets.is_empty() && spec.table.is_empty() {
        let color = spec.color.as_chunks().0.iter().map(|&[x, r, g, b]| (x, [r, g, b])).collect();
        let opacity = spec.opacity.as_chunks().0.iter().map(|&[x, a]| (x, a)).collect();
        TransferFunction::new(color, opacity, spec.unit_distance)?.with_bivariate(bivariate)
    } else {
        TransferFunction::of_two(bivariate, spec.unit_distance)?
    };
    Ok(function.with_convention(convention).with_shading(shading(spec)?))
}

fn bivariate(spec: &TransferSpec) -> Result<Bivariate> {
    let mut bivariate = Bivariate::default();
    if !spec.widgets.is_empty() {
        if !spec.table.is_empty() {
            return Err(Error::Transfer(
                "there are widgets and a table: one of the two says colour and opacity".into(),
            ));
        }
        let read = |(i, text): (usize, &String)| {
            let value = serde_json::from_str(text).map_err(|e| e.to_string());
            value.and_then(|value| widget(&value)).map_err(|e| Error::Transfer(format!("widgets[{i}]: {e}")))
        };
        bivariate = bivariate.with_widgets(spec.widgets.iter().enumerate().map(read).collect::<Result<_>>()?)?;
    }
    if !spec.table.is_empty() {
        let [s_low, s_high, g_low, g_high] = spec.table_ranges;
        let texels = spec.table.as_chunks().0.to_vec();
        bivariate = bivariate.with_table(Table::new(spec.table_size, texels, [[s_low, s_high], [g_low, g_high]])?);
    }
    if spec.gradient_opacity.is_empty() {
        return Ok(bivariate);
    }
    bivariate.with_gradient_opacity(spec.gradient_opacity.as_chunks().0.iter().map(|&[g, h]| (g, h)).collect())
}

fn shading(spec: &TransferSpec) -> Result<Shading> {
    let mut shading = Shading::default();
    if spec.has_silhouette {
        shading = shading.with_silhouette(spec.silhouette)?;
    }
    let shade = &spec.shade;
    if !shade.is_lit {
        return Ok(shading);
    }
    let highlight = if shade.reflected { Highlight::Reflected } else { Highlight::Half };
    let &ShadeSpec { ambient, diffuse, specular, power, two_sided, .. } = shade;
    let shade = Shade { ambient, diffuse, specular, power, two_sided, highlight };
    shading.with_lights(shade, spec.lights.iter().map(light).collect())
}

fn light(spec: &LightSpec) -> Light {
    let vector = spec.vector.into();
    let origin = match spec.kind {
        LightKind::Direction => Origin::Direction(vector),
        LightKind::Position => Origin::Position(vector),
        _ => Origin::Headlight,
    };
    let cone = Cone { axis: spec.axis.into(), angle: spec.angle, exponent: spec.exponent };
    Light {
        origin,
        color: spec.color,
        intensity: spec.intensity,
        attenuation: spec.attenuation,
        cone: spec.has_cone.then_some(cone),
    }
}
