use anyhow::Result;
use clap::Args;
use halite::mesh::{cells::Tetrahedra, generate};
use halite::render::Renderer;
use halite::scene::{Scalars, automatic};
use halite_console::request::Job;
use halite_console::{drawn, output};
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

pub(crate) fn run(options: &Options, renderer: &mut Renderer) -> Result<()> {
    output::check_picture(&options.out)?;
    let job = renderer.install(prepare)?;
    let background = job.scene.background;
    let picture = drawn::draw(job, renderer)?;
    picture.image.save(&options.out, drawn::backdrop(background, None))?;
    output::print(&format!("{}\n", options.out.display()))
}

fn prepare() -> Result<Job> {
    let mesh = generate::demo(SIDE);
    let tetrahedra = Tetrahedra::new(&mesh)?;
    let scalars = Scalars { name: "s".into(), association: None, component: None };
    let field = scalars.field(&mesh)?;
    let scene = automatic::scene(&mesh, &tetrahedra, scalars, &field, Default::default())?;
    Ok(Job { mesh, grid: None, tetrahedra, field, scene, legend: None, load_ms: 0.0, split_ms: 0.0 })
}
