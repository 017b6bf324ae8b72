//! The projection engine: cells are sorted by depth, projected to triangles, and blended from back to front.
//!
//! Shirley & Tuchman's projected tetrahedra (1990) as Kraus, Qiao & Ebert made them right (Projecting Tetrahedra
//! without Rendering Artifacts, 2004). It needs no neighbours, so it also draws meshes whose topology moves; and it is
//! a test bed, in which each published variant can be switched on: [`Switches`] are what differs.

pub(crate) mod cpu;
pub(crate) mod gpu;

use serde::{Deserialize, Serialize};

/// Which variant of the engine draws. The default is the most accurate.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case", deny_unknown_fields)]
pub struct Switches {
    /// Where the values and lengths of a fragment come from.
    pub fragments: Fragments,
    /// How long a ray's way through a cell is; not for [`Fragments::Intersected`].
    pub thickness: Thickness,
    /// In which sequence cells are drawn.
    pub order: Order,
    /// What cells are blended into.
    pub target: Target,
    /// Alpha dithering (Kraus et al. 2004, section 4.2): before they are blended into 8 bits, opacities are rounded up
    /// with a probability of the fraction that is lost else. Nothing for other targets.
    pub dither: bool,
    /// How a cell joins what lies behind it.
    pub compositing: Compositing,
}

impl Switches {
    /// Whether anything is rounded at random.
    pub(crate) fn dithers(&self) -> bool {
        self.dither && self.target == Target::Rgba8
    }
}

/// Where the values and lengths of a fragment come from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fragments {
    /// The pixel's ray is intersected with the cell.
    #[default]
    Intersected,
    /// Interpolated between the projected corners, with the correction for perspective (Kraus et al. 2004, section 2).
    Interpolated,
    /// Interpolated linearly on the screen, as in the earlier systems (Röttger, Kraus & Ertl 2000): wrong in
    /// perspective views.
    Linear,
}

/// How long a ray's way through a cell is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Thickness {
    /// The distance of front and back.
    #[default]
    Distance,
    /// The difference of their depths: too little beside the middle of a perspective view.
    Depth,
}

/// In which sequence cells are drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// From back to front by the distance of their centres.
    #[default]
    Depth,
    /// From back to front by the power of the eye with respect to their circumspheres, in f64: right for all cells of a
    /// Delaunay mesh whose powers differ by more than rounding, and far off for slivers of others.
    Circumsphere,
    /// As they are stored.
    None,
}

/// What cells are blended into.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Target {
    /// 32-bit floats. Not every device blends into these.
    #[default]
    Rgba32float,
    /// 16-bit floats.
    Rgba16float,
    /// 8 bits.
    Rgba8,
}

/// How a cell joins what lies behind it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Compositing {
    /// It hides a share of that: its opacity.
    #[default]
    Over,
    /// It hides nothing.
    Additive,
}

/// What a frame took.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Counts {
    /// Cells that were drawn.
    pub(crate) cells: u64,
    /// Finding the cells that are seen and sorting them; 0 where the order was known.
    pub(crate) order_ms: f64,
    /// How often cells were sorted.
    pub(crate) sorts: u32,
    /// By the device's own clock, where it has one, or in software the host's: projecting all cells of the order, and
    /// drawing them.
    pub(crate) project_ms: Option<f64>,
    pub(crate) draw_ms: Option<f64>,
    /// Fragments that were computed, where the device counts them.
    pub(crate) fragments: Option<u64>,
}
