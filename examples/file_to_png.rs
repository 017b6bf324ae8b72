//! Draws a file as the program does when nobody says how: `cargo run --release --example file_to_png -- MESH.vtu PICTURE.png`

use halite::image::Backdrop;
use halite::mesh::cells::Tetrahedra;
use halite::render::Renderer;
use halite::scene::automatic::{self, Wishes};
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [mesh, picture] = &arguments[..] else { return Err("usage: file_to_png MESH.vtu PICTURE.png".into()) };

    let mesh = halite::io::open(Path::new(mesh), &|_| ())?;
    let tetrahedra = Tetrahedra::new(&mesh)?;
    // Which array, from where, and in which colours: each may be chosen by hand instead.
    let scalars = automatic::scalars(&mesh, None)?;
    let field = scalars.field(&mesh)?;
    let scene = automatic::scene(&mesh, &tetrahedra, scalars, &field, Wishes::default())?;
    let (view, _) = scene.view()?;

    let mut renderer = Renderer::new(0)?;
    renderer.set_mesh(&mesh, tetrahedra);
    renderer.set_field(&field)?;
    renderer.set_transfer(&scene.transfer);
    let image = renderer.render(&view, &|_| ())?;
    let background = scene.background.unwrap_or_default().map(|c| c as f32);
    Ok(image.save(Path::new(picture), Backdrop::Color(background))?)
}
