//! Draws a file as the program does when nobody says how: `cargo run --release --example file_to_png -- MESH.vtu PICTURE.png`

use halite::{Backdrop, Renderer, Wishes};
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [mesh, picture] = &arguments[..] else { return Err("usage: file_to_png MESH.vtu PICTURE.png".into()) };

    let mesh = halite::io::open(Path::new(mesh), &|_| ())?;
    let mut renderer = Renderer::new(0)?;
    // Wishes name what is not to be chosen automatically: a range, colours, a camera.
    let (image, scene) = renderer.draw_automatically(&mesh, Wishes::default())?;
    let background = scene.background.unwrap_or_default().map(|c| c as f32);
    Ok(image.save(Path::new(picture), Backdrop::Color(background))?)
}
