//! The projection engine: cells are put in order, projected to triangles, and blended from back to front.
//!
//! Shirley & Tuchman's projected tetrahedra (1990) as Kraus, Qiao & Ebert made them right (Projecting Tetrahedra
//! without Rendering Artifacts, 2004). Its order is that of [`crate::order::mpvo`]; sorted by depth it needs no neighbours, so it also
//! draws meshes whose topology moves. It is a test bed, in which each published variant can be switched on: [`ProjectionOptions`] are what differs.

pub(crate) mod cpu;
pub(crate) mod gpu;

use crate::order::mpvo::Rule;
use serde::{Deserialize, Serialize};

/// Which variant of the engine draws. The default is the most accurate.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub struct ProjectionOptions {
    /// Where the values and lengths of a fragment come from.
    pub fragments: Fragments,
    /// How long a ray's way through a cell is; not for [`Fragments::Intersected`].
    pub thickness: Thickness,
    /// In which sequence cells are drawn.
    pub order: CellOrder,
    /// What becomes of pixels that see cells which hide each other in a circle, with [`CellOrder::Mpvo`].
    pub cycles: Cycles,
    /// What cells are blended into.
    pub target: Target,
    /// Alpha dithering (Kraus et al. 2004, section 4.2): before they are blended into 8 bits, opacities are rounded up
    /// with a probability of the fraction that is lost else. Nothing for other targets.
    pub dither: bool,
    /// How a cell joins what lies behind it.
    pub compositing: Compositing,
}

impl ProjectionOptions {
    /// Whether the walk may draw pixels of the picture.
    pub(crate) fn walks(&self) -> bool {
        self.cycles == Cycles::Walk && self.compositing == Compositing::Over && self.target == Target::Rgba32float
    }

    /// Whether anything is rounded at random.
    pub(crate) fn dithers(&self) -> bool {
        self.dither && self.target == Target::Rgba8
    }
}

impl ProjectionOptions {
    /// The same with another [`ProjectionOptions::fragments`].
    #[must_use]
    pub fn with_fragments(self, fragments: Fragments) -> Self {
        ProjectionOptions { fragments, ..self }
    }

    /// The same with another [`ProjectionOptions::thickness`].
    #[must_use]
    pub fn with_thickness(self, thickness: Thickness) -> Self {
        ProjectionOptions { thickness, ..self }
    }

    /// The same with another [`ProjectionOptions::order`].
    #[must_use]
    pub fn with_order(self, order: CellOrder) -> Self {
        ProjectionOptions { order, ..self }
    }

    /// The same with another [`ProjectionOptions::cycles`].
    #[must_use]
    pub fn with_cycles(self, cycles: Cycles) -> Self {
        ProjectionOptions { cycles, ..self }
    }

    /// The same with another [`ProjectionOptions::target`].
    #[must_use]
    pub fn with_target(self, target: Target) -> Self {
        ProjectionOptions { target, ..self }
    }

    /// The same with another [`ProjectionOptions::dither`].
    #[must_use]
    pub fn with_dither(self, dither: bool) -> Self {
        ProjectionOptions { dither, ..self }
    }

    /// The same with another [`ProjectionOptions::compositing`].
    #[must_use]
    pub fn with_compositing(self, compositing: Compositing) -> Self {
        ProjectionOptions { compositing, ..self }
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
pub enum CellOrder {
    /// From back to front by the faces between them, and by the rays that leave the mesh and enter it again: right for every pixel
    /// ([`crate::order::mpvo`]). It needs the cells' neighbours; in a mesh that changes with each frame it is [`Self::Depth`].
    #[default]
    Mpvo,
    /// By the faces between them, depth first, as Williams (1992) has it for convex meshes.
    MpvoConvex,
    /// The same, for meshes that are not convex: from the farthest on, by the distance of their centres (Williams' MPVONC).
    Mpvonc,
    /// The same, and by the rays that leave the mesh and enter it again (Silva, Mitchell & Williams 1998).
    Xmpvo,
    /// From back to front by the distance of their centres.
    Depth,
    /// From back to front by the power of the eye with respect to their circumspheres, in f64: right for all cells of a
    /// Delaunay mesh whose powers differ by more than rounding, and far off for slivers of others.
    Circumsphere,
    /// As they are stored.
    None,
}

impl CellOrder {
    /// The rule of the mesh's order; none for sequences that need no neighbours.
    pub(crate) fn rule(self) -> Option<Rule> {
        match self {
            CellOrder::Mpvo => Some(Rule::Mpvo),
            CellOrder::MpvoConvex => Some(Rule::Convex),
            CellOrder::Mpvonc => Some(Rule::Nonconvex),
            CellOrder::Xmpvo => Some(Rule::Xmpvo),
            CellOrder::Depth | CellOrder::Circumsphere | CellOrder::None => None,
        }
    }
}

/// What becomes of pixels that see cells which hide each other in a circle. The circle is cut where the fewest pixels see it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Cycles {
    /// The walk draws those that see the cut, in pictures that are blended by their opacity into 32-bit floats.
    #[default]
    Walk,
    /// They stay as they are: wrong.
    Cut,
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
pub(crate) struct ProjectionCounts {
    /// Cells that were drawn.
    pub(crate) cells: u64,
    /// What they were ordered by.
    pub(crate) order: CellOrder,
    /// Finding the cells that are seen and sorting them; 0 where the order was known.
    pub(crate) order_ms: f64,
    /// How often cells were sorted.
    pub(crate) sorts: u32,
    /// Groups of cells that hide each other in a circle, and these cells; what was cut of them; and pixels whose cells overlap.
    pub(crate) cycles: u32,
    pub(crate) cycle_cells: u64,
    pub(crate) cuts: u64,
    pub(crate) overlapping: u64,
    /// By the device's own clock, where it has one: projecting all cells of the order, and drawing them.
    pub(crate) project_ms: Option<f64>,
    pub(crate) draw_ms: Option<f64>,
    /// Fragments that were computed, where the device counts them.
    pub(crate) fragments: Option<u64>,
}
