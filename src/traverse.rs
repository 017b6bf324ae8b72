//! The traverse engine: each pixel's ray walks from cell to neighbouring cell through shared faces.
//!
//! A ray enters a connected part of the mesh through each boundary face that it meets from outside, and walks until it
//! leaves. [`cpu`] walks; `gpu` does so on a GPU.

pub mod cpu;
pub(crate) mod gpu;
