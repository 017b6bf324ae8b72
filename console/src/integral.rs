//! The form of the ray integral, as options and in scenes.

use crate::output::misuse;
use crate::variant::{named, table};
use anyhow::Result;
use clap::Args;
use halite::integral::options::{Alpha, Build, Culling, IntegrationOptions, MOST_PIECES, Planes, Texels, Weights};
use halite::integral::table::Kind;

/// What of the integral's form somebody said.
#[derive(Args, Clone)]
pub struct Integral {
    /// How a ray is integrated in a cell: auto, exact, or by a table: volume, polynomial or cylindrical; of a grid's slabs
    /// between samples, second-order (of one length) or second-order-polynomial; with a second variable or light adaptive,
    /// analytic, or segmented
    #[arg(long, value_name = "FORM", value_parser = by_name, help_heading = "Integral")]
    integral: Option<String>,
    /// Texels of the table: values in front, values behind, and lengths (volume) or planes (cylindrical)
    #[arg(long, value_name = "NxN[xN]", value_parser = table, help_heading = "Integral")]
    table: Option<[u32; 3]>,
    /// Lengths of a volume: uniform, log, or log-normalised
    #[arg(long, value_name = "KIND", value_parser = named::<Kind>, help_heading = "Integral")]
    lengths: Option<Kind>,
    /// Degree of polynomials, 1 to 8 [default: 2]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=8), help_heading = "Integral")]
    degree: Option<u32>,
    /// Steps in which slabs of second order are summed [default: 64]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65_536), help_heading = "Integral")]
    iterations: Option<u32>,
    /// How the opacity of polynomials depends on the length: exponential, or linear
    #[arg(long, value_name = "KIND", value_parser = named::<Alpha>, help_heading = "Integral")]
    alpha: Option<Alpha>,
    /// Which planes of a cylinder are read: two, one, or packed (two, stored in less room)
    #[arg(long, value_name = "KIND", value_parser = named::<Planes>, help_heading = "Integral")]
    planes: Option<Planes>,
    /// Read one pair of a cylinder's planes in each interpolated cell, as parallel views always do
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true",
        help_heading = "Integral")]
    plane_per_cell: Option<bool>,
    /// What the table's texels are: float, unorm16 or unorm8
    #[arg(long, value_name = "FORMAT", value_parser = named::<Texels>, help_heading = "Integral")]
    texels: Option<Texels>,
    /// Pieces of a segmented segment in a cell [default: 10]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_PIECES)),
        help_heading = "Integral")]
    pieces: Option<u32>,
    /// Where the weights of a segmented piece's ends come from: closed (their closed form), or texture
    #[arg(long, value_name = "FORM", value_parser = named::<Weights>, help_heading = "Integral")]
    weights: Option<Weights>,
    /// Which cells are left out as empty: by the hull of the values at their corners, by the corners alone, or none
    #[arg(long, value_name = "KIND", value_parser = named::<Culling>, help_heading = "Integral")]
    culling: Option<Culling>,
    /// Where tables are built: auto (on the device, unless it is software), host or device
    #[arg(long, value_name = "WHERE", value_parser = named::<Build>, help_heading = "Integral")]
    build: Option<Build>,
}

/// A form, or a method of two variables, that there is.
fn by_name(name: &str) -> Result<String, String> {
    IntegrationOptions::default().named(name).map(|_| name.to_owned())
}

impl Integral {
    /// `choice`, with what was said in its place.
    pub fn apply(&self, choice: IntegrationOptions) -> IntegrationOptions {
        let choice = self.integral.as_deref().and_then(|name| choice.named(name).ok()).unwrap_or(choice);
        let two = choice.two;
        let two = two
            .with_pieces(self.pieces.unwrap_or(two.pieces))
            .with_weights(self.weights.unwrap_or(two.weights))
            .with_culling(self.culling.unwrap_or(two.culling));
        choice
            .with_table(self.table.or(choice.table))
            .with_lengths(self.lengths.unwrap_or(choice.lengths))
            .with_degree(self.degree.unwrap_or(choice.degree))
            .with_iterations(self.iterations.unwrap_or(choice.iterations))
            .with_alpha(self.alpha.unwrap_or(choice.alpha))
            .with_planes(self.planes.unwrap_or(choice.planes))
            .with_per_cell(self.plane_per_cell.unwrap_or(choice.per_cell))
            .with_texels(self.texels.unwrap_or(choice.texels))
            .with_build(self.build.unwrap_or(choice.build))
            .with_two(two)
    }

    /// The names of the options that were given and are not the table's size.
    pub fn given(&self) -> Vec<&'static str> {
        let all = [
            ("--integral", self.integral.is_some()),
            ("--lengths", self.lengths.is_some()),
            ("--degree", self.degree.is_some()),
            ("--iterations", self.iterations.is_some()),
            ("--alpha", self.alpha.is_some()),
            ("--planes", self.planes.is_some()),
            ("--plane-per-cell", self.plane_per_cell.is_some()),
            ("--texels", self.texels.is_some()),
            ("--build", self.build.is_some()),
            ("--pieces", self.pieces.is_some()),
            ("--weights", self.weights.is_some()),
            ("--culling", self.culling.is_some()),
        ];
        all.into_iter().filter_map(|(name, given)| given.then_some(name)).collect()
    }

    /// Refuses a size that was given and that tables as `choice` says cannot have.
    pub fn check(&self, choice: &IntegrationOptions) -> Result<()> {
        match self.table {
            Some(_) => choice.check(choice.size(0)).map_err(|e| misuse(format!("--table: {e}"))),
            None => Ok(()),
        }
    }
}
