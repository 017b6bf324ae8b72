//! The ray caster: regular and rectilinear grids, drawn without cells.
//!
//! Each ray goes from voxel to voxel of the dual grid, the cells between sample points, by a digital differential analyser:
//! where it crosses the planes of an axis is computed from the axis's own table, never added up, so nothing drifts, and
//! ties are steps of no length. Inside a voxel the trilinear field is a cubic along the ray (`integral::cubic`), which is
//! split where it meets a knot of the transfer function. Cell data are constant in a voxel. Blocks of voxels that the function
//! makes empty are passed without a look at their values (`volume`). Scalars are drawn eight rays at a time in f32
//! (`lanes`), all else ray by ray in f64 (`ray`; `second` with two variables or light, by the `gradient` at points).
//!
//! It is the exact counterpart of the ray caster of El Hajjar, Marchesin, Dischler & Mongenet (Second Order Pre-integrated
//! Volume Rendering, 2008), which follows such a field by quadratic polynomials: their orders are there by name
//! ([`Reconstruction`]), with their tables in the place of integrals (`tabulated`). It runs on the CPU, and, but for tables and
//! second variables, on graphics devices (`gpu`).

pub(crate) mod gpu;
mod gradient;
mod histogram;
mod lanes;
mod ray;
pub(crate) mod reconstruction;
pub(crate) mod second;
pub(crate) mod tabulated;
mod volume;

pub(crate) use gradient::Gradients;
pub use histogram::histogram;
pub(crate) use ray::{Frame, render};
pub use reconstruction::{Reconstruction, ReconstructionOrder, Sampling};
pub(crate) use volume::{Samples, Volume};
