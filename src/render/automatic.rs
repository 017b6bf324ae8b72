//! A mesh drawn in one call, with what is chosen where nobody says.

use super::Renderer;
use crate::error::Result;
use crate::image::Image;
use crate::mesh::Mesh;
use crate::mesh::cells::Tetrahedra;
use crate::scene::Scene;
use crate::scene::automatic::{self, Wishes};

impl Renderer {
    /// Draws `mesh` with the array, colours, opacities and view that [`automatic`] chooses where `wishes` say nothing. The scene
    /// that was chosen comes with the image; the renderer keeps mesh, field and transfer function, for frames that follow.
    ///
    /// # Errors
    /// [`Error::Field`] if the mesh has no array that can be drawn, [`Error::Transfer`] if what was wished for is no transfer
    /// function, and those of [`Tetrahedra::new`], [`Renderer::set_field`] and [`Renderer::render`].
    ///
    /// [`Error::Field`]: crate::Error::Field
    /// [`Error::Transfer`]: crate::Error::Transfer
    pub fn draw_automatically(&mut self, mesh: &Mesh, wishes: Wishes) -> Result<(Image, Scene)> {
        let (tetrahedra, field, scene) = self.install(|| {
            let tetrahedra = Tetrahedra::new(mesh)?;
            let scalars = automatic::scalars(mesh, None)?;
            let field = scalars.field(mesh)?;
            let scene = automatic::scene(mesh, &tetrahedra, scalars, &field, wishes)?;
            Result::Ok((tetrahedra, field, scene))
        })?;
        let (view, _) = scene.view()?;
        self.set_tetrahedra(mesh, tetrahedra);
        self.set_field(&field)?;
        self.set_transfer(&scene.transfer);
        Ok((self.render(&view, &|_| ())?, scene))
    }
}
