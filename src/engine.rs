//! The engines by name: what scenes, the program and hosts ask for.

use serde::Deserialize;

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
