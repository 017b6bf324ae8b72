//! What scenes, the program and hosts ask for by name: engines, and orders of reconstruction.

use crate::cast;
use serde::Deserialize;
use std::str::FromStr;

/// How frames are drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Engine {
    /// [`Engine::Traverse`] on a graphics device, [`Engine::Project`] on the CPU.
    #[default]
    Auto,
    /// Rays walk from cell to cell; exact for every mesh. See [`crate::traverse`].
    Traverse,
    /// Cells are sorted, projected and blended. See [`crate::project`].
    Project,
}

impl FromStr for cast::ReconstructionOrder {
    type Err = String;

    /// The order that options know by this name. What is wrong with another names those that there are.
    fn from_str(name: &str) -> Result<Self, String> {
        let found = cast::ReconstructionOrder::ALL.into_iter().find(|(known, _)| *known == name);
        found.map(|(_, order)| order).ok_or_else(|| {
            let known = cast::ReconstructionOrder::ALL.map(|(known, _)| known).join(", ");
            format!("\"{name}\" is not known here; there is {known}")
        })
    }
}
