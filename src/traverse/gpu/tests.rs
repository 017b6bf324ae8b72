#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stderr, reason = "tests")]

mod frames;
mod kernels;
mod random;
mod second;
mod twins;

use crate::image::Image;
use crate::render::Renderer;
use crate::view::View;

fn draw(renderer: &mut Renderer, view: &View) -> Image {
    renderer.render(view, &|_| ()).unwrap()
}
