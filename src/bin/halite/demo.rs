use crate::{choose, output, render};
use anyhow::Result;
use clap::Args;
use halite::mesh::{cells::Tetrahedra, generate};
use halite::render::Renderer;
use halite::scene::Scalars;
use std::path::PathBuf;

/// Draw a built-in mesh, to see that everything works
#[derive(Args)]
pub(crate) struct Options {
    /// The picture: .png, .exr or .npy
    #[arg(short, long, value_name = "FILE", default_value = "halite-demo.png")]
    out: PathBuf,
}

/// Cells along the demo's side n: 6 · 3 n · n² tetrahedra.
const SIDE: usize = 24;

pub(crate) fn run(options: &Options, threads: usize) -> Result<()> {
    output::check_picture(&options.out)?;
    let mesh = generate::demo(SIDE);
    let tetrahedra = Tetrahedra::new(&mesh)?;
    let scalars = Scalars { name: "s".into(), association: None, component: None };
    let field = scalars.field(&mesh)?;
    let scene = choose::scene(&mesh, &tetrahedra, scalars, &field, Default::default())?;
    let (view, _) = scene.view()?;
    let drawn = render::draw(Renderer::new(threads)?, &mesh, tetrahedra, &field, &scene.transfer, &view)?;
    drawn.image.save(&options.out, render::backdrop(scene.background, None))?;
    output::print(&format!("{}\n", options.out.display()))
}
