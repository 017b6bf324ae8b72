//! One field of options after the other.

use super::{Alpha, Build, Culling, Form, IntegrationOptions, Method, Planes, Silhouettes, Texels, Two, Weights};
use crate::integral::table::Kind;

impl IntegrationOptions {
    /// The same with another [`IntegrationOptions::form`].
    #[must_use]
    pub fn with_form(self, form: Form) -> Self {
        IntegrationOptions { form, ..self }
    }

    /// The same with another [`IntegrationOptions::lengths`].
    #[must_use]
    pub fn with_lengths(self, lengths: Kind) -> Self {
        IntegrationOptions { lengths, ..self }
    }

    /// The same with another [`IntegrationOptions::table`].
    #[must_use]
    pub fn with_table(self, table: Option<[u32; 3]>) -> Self {
        IntegrationOptions { table, ..self }
    }

    /// The same with another [`IntegrationOptions::degree`].
    #[must_use]
    pub fn with_degree(self, degree: u32) -> Self {
        IntegrationOptions { degree, ..self }
    }

    /// The same with another [`IntegrationOptions::iterations`].
    #[must_use]
    pub fn with_iterations(self, iterations: u32) -> Self {
        IntegrationOptions { iterations, ..self }
    }

    /// The same with another [`IntegrationOptions::alpha`].
    #[must_use]
    pub fn with_alpha(self, alpha: Alpha) -> Self {
        IntegrationOptions { alpha, ..self }
    }

    /// The same with another [`IntegrationOptions::planes`].
    #[must_use]
    pub fn with_planes(self, planes: Planes) -> Self {
        IntegrationOptions { planes, ..self }
    }

    /// The same with another [`IntegrationOptions::per_cell`].
    #[must_use]
    pub fn with_per_cell(self, per_cell: bool) -> Self {
        IntegrationOptions { per_cell, ..self }
    }

    /// The same with another [`IntegrationOptions::texels`].
    #[must_use]
    pub fn with_texels(self, texels: Texels) -> Self {
        IntegrationOptions { texels, ..self }
    }

    /// The same with another [`IntegrationOptions::build`].
    #[must_use]
    pub fn with_build(self, build: Build) -> Self {
        IntegrationOptions { build, ..self }
    }

    /// The same with another [`IntegrationOptions::two`].
    #[must_use]
    pub fn with_two(self, two: Two) -> Self {
        IntegrationOptions { two, ..self }
    }
}

impl Two {
    /// The same with another [`Two::method`].
    #[must_use]
    pub fn with_method(self, method: Method) -> Self {
        Two { method, ..self }
    }

    /// The same with another [`Two::pieces`].
    #[must_use]
    pub fn with_pieces(self, pieces: u32) -> Self {
        Two { pieces, ..self }
    }

    /// The same with another [`Two::weights`].
    #[must_use]
    pub fn with_weights(self, weights: Weights) -> Self {
        Two { weights, ..self }
    }

    /// The same with another [`Two::culling`].
    #[must_use]
    pub fn with_culling(self, culling: Culling) -> Self {
        Two { culling, ..self }
    }

    /// The same with another [`Two::silhouettes`].
    #[must_use]
    pub fn with_silhouettes(self, silhouettes: Silhouettes) -> Self {
        Two { silhouettes, ..self }
    }
}
