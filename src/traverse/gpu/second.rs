//! The walk on a device with functions of two variables, and light.

use super::{TRAVERSE, Traverse, WalkedFrame, constants, unprepared};
use crate::error::Result;
use crate::field::Kind;
use crate::geometry::TetMesh;
use crate::gpu::buffers::Chunks;
use crate::gpu::second::{self, SecondScene};
use crate::gpu::shader::{self, ShaderArray, ShaderVariant};
use crate::gpu::{arrays, raster};
use crate::integral::Exact;
use crate::integral::second::Rows;
use crate::view::{Blend, View};
use wgpu::ShaderStages as Stages;

const SECOND: &str = include_str!("../../../shaders/traverse_second.wgsl");

impl Traverse {
    /// Draws a frame of two variables, or with light. `even` stands where functions of one variable are read.
    ///
    /// # Errors
    /// Those of [`crate::gpu::Gpu::check`] and [`crate::gpu::buffers::Buffer::new`].
    pub(crate) fn render_second<const N: usize>(
        &mut self,
        geometry: &TetMesh,
        scene: &SecondScene<'_, N>,
        even: &Exact<f32>,
        view: &View,
    ) -> Result<WalkedFrame> {
        (self.values, self.function) = (None, None);
        self.upload_mesh(geometry)?;
        self.second.prepare(&self.gpu, scene, geometry.cells.len(), even)?;
        let arrays = self.arrays_of_two()?;
        let association = arrays::association(scene.values);
        let layout = raster::layout(&self.gpu, Stages::COMPUTE, &second::SLOTS);
        self.compile(program(association, scene.rows, &arrays), &arrays, Some(&layout))?;
        let (function, even) = self.second.buffers()?;
        let group = raster::group_of(&self.gpu, &layout, function);
        self.draw(geometry, even, &self.chunks_of_two()?, Some(&group), view)
    }

    /// The arrays of group 1.
    fn chunks_of_two(&self) -> Result<Vec<&Chunks>> {
        match (&self.cells, &self.points) {
            (Some(of_cells), Some(of_points)) => {
                Ok(of_cells.iter().chain(of_points).chain(self.second.chunks()?).collect())
            }
            _ => Err(unprepared()),
        }
    }

    /// The same as the shader sees them.
    fn arrays_of_two(&self) -> Result<Vec<ShaderArray>> {
        let names = super::ARRAYS[..5].iter().chain(&second::ARRAYS);
        let named = names.zip(self.chunks_of_two()?);
        Ok(named.map(|(&name, chunks)| arrays::of_name(name, chunks)).collect())
    }
}

/// The whole program.
pub(super) fn program(association: &str, rows: &Rows, arrays: &[ShaderArray]) -> String {
    let forms = &rows.forms;
    let variant = ShaderVariant { kind: Kind::Pair, direct: forms.direct };
    let mut text = String::from(second::VECTOR);
    text += &constants(&variant, association, Blend::Composite, arrays);
    let defined = second::defined(forms);
    let [walk, own] = [TRAVERSE, SECOND].map(|of| shader::with(of, &defined));
    [&text, shader::CELL, shader::INTEGRAL, &second::program(rows), &walk, &own].join("\n")
}
