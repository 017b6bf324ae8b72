//! What a scene says of cropping regions, and of how grids are rebuilt along rays.

use crate::cast::{Reconstruction, Sampling};
use crate::view::{Cropping, REGIONS};
use glam::DMat4;
use serde::Deserialize;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CroppingJson {
    /// Two coordinates along each axis of the world.
    planes: [[f64; 2]; 3],
    #[serde(default)]
    regions: RegionsJson,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "the name of some regions, or their bits,")]
enum RegionsJson {
    Bits(u32),
    Name(String),
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "\"voxels\", or a length,")]
pub(super) enum SamplingJson {
    Length(f64),
    Name(String),
}

impl Default for RegionsJson {
    fn default() -> Self {
        RegionsJson::Name(REGIONS[0].0.into())
    }
}

/// The bits of regions that have this name.
///
/// # Errors
/// With the names that there are.
pub fn regions(name: &str) -> Result<u32, String> {
    let named = REGIONS.into_iter().find(|r| r.0 == name).map(|r| r.1);
    named.ok_or_else(|| {
        let known = REGIONS.map(|r| r.0).join(", ");
        format!("no cropping regions are called \"{name}\"; there is {known}, or bits")
    })
}

impl CroppingJson {
    pub(super) fn cropping(&self) -> Result<Cropping, String> {
        let bits = match &self.regions {
            RegionsJson::Bits(bits) => *bits,
            RegionsJson::Name(name) => regions(name).map_err(|e| format!("cropping.regions: {e}"))?,
        };
        Cropping::new(self.planes, bits, DMat4::IDENTITY).map_err(|e| format!("cropping: {e}"))
    }
}

/// How fields of grids are rebuilt along rays; none if nobody says.
pub(super) fn reconstruction(
    order: Option<&str>,
    sampling: Option<&SamplingJson>,
) -> Result<Option<Reconstruction>, String> {
    let Some(order) = order else {
        return match sampling {
            Some(_) => {
                Err("sampling: the exact reconstruction takes no samples; \"reconstruction\": \"2\" does".into())
            }
            None => Ok(None),
        };
    };
    let order = order.parse().map_err(|e| format!("reconstruction: {e}"))?;
    let sampling = match sampling {
        None => Sampling::Voxels,
        Some(SamplingJson::Name(name)) if name == "voxels" => Sampling::Voxels,
        Some(SamplingJson::Length(l)) if *l > 0.0 && l.is_finite() => Sampling::Steps(*l),
        Some(SamplingJson::Length(l)) => return Err(format!("sampling: {l} is no length above 0")),
        Some(SamplingJson::Name(name)) => {
            return Err(format!("sampling: \"{name}\" is neither \"voxels\" nor a length"));
        }
    };
    Ok(Some(Reconstruction { order, sampling }))
}
