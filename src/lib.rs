//! Halite draws unstructured grids as volumes: every pixel is the emission–absorption integral of the field that the
//! mesh defines.
//!
//! From a file to a picture:
//!
//! ```
//! use halite::{Backdrop, Renderer, Wishes};
//!
//! # fn main() -> halite::Result<()> {
//! # let picture = std::env::temp_dir().join(format!("halite-doc-{}.png", std::process::id()));
//! let mesh = halite::io::open("cpp/tests/cube.vtu".as_ref(), &|_| ())?;
//! let mut renderer = Renderer::new(0)?;
//! let (image, _) = renderer.draw_automatically(&mesh, Wishes::default())?;
//! image.save(&picture, Backdrop::Transparent)?;
//! # assert!(image.pixels.iter().any(|p| p[3] > 0.5));
//! # Ok(std::fs::remove_file(picture).expect("it was written"))
//! # }
//! ```
//!
//! The pipeline, stage by stage; an arrow never points back:
//!
//! 1. [`io::open`] reads a file into a [`mesh::Mesh`]: the grid as it is, validated once; [`io::Source`] also into a
//!    [`grid::Grid`], where it is regular or rectilinear.
//! 2. [`mesh::cells`] splits its cells into tetrahedra, [`mesh::faces`] finds their neighbours, [`geometry`] lays both
//!    out for engines.
//! 3. [`field::Field`] is the array that is drawn, [`transfer::TransferFunction`] says how.
//! 4. [`integral`] is the light that one straight segment of a ray inside a cell sends and lets through.
//! 5. [`traverse`] walks each pixel's ray of a [`view::View`] from cell to cell and adds those up; regular and rectilinear
//!    grids have a caster of their own.
//! 6. [`image::Image`] holds the result: linear premultiplied RGBA, 32-bit float.
//!
//! [`render::Renderer`] is the whole flow behind one door, [`host::Session`] that door inside another program. [`scene`] describes a picture in a JSON file, and
//! [`mod@reference`] is the slow float64 renderer that the tests compare the engines with.

mod buckets;
pub mod cast;
pub mod cell;
pub mod engine;
pub mod error;
pub mod field;
pub mod geometry;
pub mod gpu;
pub mod grid;
pub mod host;
pub mod image;
pub mod integral;
pub mod io;
pub mod memory;
pub mod mesh;
pub mod order;
mod progress;
pub mod project;
pub mod real;
pub mod reference;
pub mod render;
pub mod scene;
pub mod transfer;
pub mod traverse;
pub mod view;

pub use self::image::{Backdrop, Image};
pub use error::{Error, Result};
pub use field::Field;
pub use glam;
pub use gpu::DeviceChoice;
pub use grid::Grid;
pub use integral::IntegrationOptions;
pub use mesh::Mesh;
pub use project::ProjectionOptions;
pub use render::Renderer;
pub use scene::Scene;
pub use scene::automatic::Wishes;
pub use transfer::TransferFunction;
pub use view::View;
