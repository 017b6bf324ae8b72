//! The projection on a device with functions of two variables, and light.

use super::frame::SeenView;
use super::primitive::Layout;
use super::program::{DrawSettings, LEFT, program_of_two};
use super::{ARRAYS, Pass, Project, lines, unprepared};
use crate::error::Result;
use crate::geometry::TetMesh;
use crate::gpu::buffers::{Buffer, Chunks};
use crate::gpu::second::{self, SecondScene};
use crate::gpu::shader::ShaderArray;
use crate::gpu::{arrays, raster};
use crate::integral::Exact;
use crate::project::{Fragments, ProjectionCounts, ProjectionOptions, Target};
use crate::transfer::TransferFunction;
use crate::view::{Blend, View};
use rayon::prelude::*;
use wgpu::{BufferUsages as Usage, ShaderStages as Stages};

/// The pixels with fragments that f32 is too coarse for, as indices.
pub(crate) fn left(pixels: &[[f32; 4]]) -> Vec<usize> {
    // What is no number came of several such.
    pixels.par_iter().enumerate().filter(|(_, p)| p[3] <= LEFT || p[3].is_nan()).map(|(i, _)| i).collect()
}

impl Project {
    /// What of `transfer` it does not draw in this way, though other shaders do.
    pub(crate) fn lacks(transfer: &TransferFunction, options: &ProjectionOptions) -> Option<&'static str> {
        if options.fragments != Fragments::Intersected && transfer.shading().is_some() {
            return Some("light and silhouettes with fragments that are interpolated");
        }
        if options.target == Target::Rgba8 {
            return Some("two variables and light in pictures of 8 bits");
        }
        None
    }

    /// Draws a frame of two variables, or with light, as [`Self::render`]; [`left`] says which pixels are not drawn. `even` stands
    /// where functions of one variable are read.
    ///
    /// # Errors
    /// Those of [`Self::render`].
    pub(crate) fn render_second<const N: usize>(
        &mut self,
        geometry: &TetMesh,
        scene: &SecondScene<'_, N>,
        even: &Exact<f32>,
        view: &View,
        options: &ProjectionOptions,
    ) -> Result<(Vec<[f32; 4]>, ProjectionCounts)> {
        let format = self.format(options.target)?;
        (self.values, self.function) = (None, None);
        self.upload_mesh(geometry)?;
        if self.second.prepare(&self.gpu, scene, geometry.cells.len(), even)? {
            self.ordered = None;
        }
        if self.even.is_none() {
            let bins = Buffer::holding(&self.gpu, "bins", &lines::bins(even), Usage::STORAGE)?;
            self.even = Some((lines::image(&self.gpu, even)?, bins));
        }
        self.table.prepare(&self.gpu, None, self.second.buffers()?.1)?;
        let arrays = self.arrays_of_two()?;
        let seen = SeenView::new(geometry, view);
        let lit = scene.rows.forms.lit;
        let is_rare = options.fragments == Fragments::Intersected && (lit || seen.limits().any());
        let layout = Layout::of_two(options.fragments, is_rare, lit);
        let drawn = DrawSettings { options, blend: Blend::Composite };
        let association = arrays::association(scene.values);
        let source = program_of_two(scene.rows, association, drawn, &layout, seen.limits(), &arrays);
        self.prepare_canvas(&layout, view.size(), format, false)?;
        let group = raster::layout(&self.gpu, Stages::FRAGMENT, &second::SLOTS);
        self.compile(&arrays, source, drawn, layout, format, Some(&group))?;
        let ((function, even), Some((lines, bins))) = (self.second.buffers()?, &self.even) else {
            return Err(unprepared());
        };
        let group = raster::group_of(&self.gpu, &group, function);
        let frame = Pass::new(self, &seen, even, (lines, bins), &self.chunks_of_two()?, Some(group))?;
        self.finish(geometry, view, &seen, frame, options)
    }

    /// The arrays of group 1 of the compute stages.
    fn chunks_of_two(&self) -> Result<Vec<&Chunks>> {
        match (&self.cells, &self.points) {
            (Some(cells), Some(points)) => Ok([cells, points].into_iter().chain(self.second.chunks()?).collect()),
            _ => Err(unprepared()),
        }
    }

    /// The same as the shader sees them.
    fn arrays_of_two(&self) -> Result<Vec<ShaderArray>> {
        let names = ARRAYS[..2].iter().chain(&second::ARRAYS);
        Ok(names.zip(self.chunks_of_two()?).map(|(&name, chunks)| arrays::of_name(name, chunks)).collect())
    }
}
