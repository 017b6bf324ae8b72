//! Halite draws unstructured grids as volumes: every pixel is the emission–absorption integral of the field that the
//! mesh defines.
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
//! [`render::Renderer`] is the whole flow behind one door, [`host::Session`] that door inside another program; with the
//! feature `ffi` it opens to C++. [`scene`] describes a picture in a JSON file, and
//! [`mod@reference`] is the slow float64 renderer that the tests compare the engines with.

pub mod cast;
pub mod cell;
pub mod engine;
pub mod error;
#[cfg(feature = "ffi")]
pub mod ffi;
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

pub use error::{Error, Result};
