//! The options of the projection engine, as options and in scenes.

use clap::Args;
use halite::project::{CellOrder, Compositing, Cycles, Fragments, ProjectionOptions, Target, Thickness};
use halite::scene::read;
use serde::de::DeserializeOwned;

/// What of the projection engine's variant somebody said.
#[derive(Args, Clone)]
pub struct Variant {
    /// Where a fragment's values come from: intersected, interpolated, or linear (wrong in perspective)
    #[arg(long, value_name = "FORM", value_parser = named::<Fragments>, help_heading = "Projection engine")]
    fragments: Option<Fragments>,
    /// How long a ray's way through an interpolated cell is: distance, or depth
    #[arg(long, value_name = "KIND", value_parser = named::<Thickness>, help_heading = "Projection engine")]
    thickness: Option<Thickness>,
    /// In which sequence cells are drawn: mpvo (right for every pixel), mpvo-convex, mpvonc and xmpvo (as published), depth,
    /// circumsphere (for Delaunay meshes, as exact as f64), or none
    #[arg(long, value_name = "KIND", value_parser = named::<CellOrder>, help_heading = "Projection engine")]
    order: Option<CellOrder>,
    /// What draws pixels that see cells which hide each other in a circle: walk, or cut (they stay wrong)
    #[arg(long, value_name = "KIND", value_parser = named::<Cycles>, help_heading = "Projection engine")]
    cycles: Option<Cycles>,
    /// What cells are blended into: rgba32float, rgba16float or rgba8
    #[arg(long, value_name = "FORMAT", value_parser = named::<Target>, help_heading = "Projection engine")]
    target: Option<Target>,
    /// Round opacities at random when they are blended into rgba8; =false switches off what a scene asks for
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true",
        help_heading = "Projection engine")]
    dither: Option<bool>,
    /// How a cell joins what lies behind it: over, or additive
    #[arg(long, value_name = "KIND", value_parser = named::<Compositing>, help_heading = "Projection engine")]
    compositing: Option<Compositing>,
}

impl Variant {
    /// `projection`, with what was said in its place.
    pub fn apply(&self, projection: ProjectionOptions) -> ProjectionOptions {
        projection
            .with_fragments(self.fragments.unwrap_or(projection.fragments))
            .with_thickness(self.thickness.unwrap_or(projection.thickness))
            .with_order(self.order.unwrap_or(projection.order))
            .with_cycles(self.cycles.unwrap_or(projection.cycles))
            .with_target(self.target.unwrap_or(projection.target))
            .with_dither(self.dither.unwrap_or(projection.dither))
            .with_compositing(self.compositing.unwrap_or(projection.compositing))
    }

    /// The names of the options that were given.
    pub fn given(&self) -> Vec<&'static str> {
        let all = [
            ("--fragments", self.fragments.is_some()),
            ("--thickness", self.thickness.is_some()),
            ("--order", self.order.is_some()),
            ("--cycles", self.cycles.is_some()),
            ("--target", self.target.is_some()),
            ("--dither", self.dither.is_some()),
            ("--compositing", self.compositing.is_some()),
        ];
        all.into_iter().filter_map(|(name, given)| given.then_some(name)).collect()
    }
}

/// A variant by the name that scenes know it by.
pub fn named<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    read(&text.into())
}

/// `NxN` or `NxNxN`; the third is 0 in the first, which only polynomials are.
pub fn table(text: &str) -> Result<[u32; 3], String> {
    let parts: Result<Vec<u32>, _> = text.split('x').map(str::parse).collect();
    match parts.as_deref() {
        Ok([a, b]) => Ok([*a, *b, 0]),
        Ok([a, b, c]) => Ok([*a, *b, *c]),
        _ => Err("the size is two or three numbers, such as 256x256x16".into()),
    }
}
