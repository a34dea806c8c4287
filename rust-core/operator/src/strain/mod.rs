//! Strain, rotation, and their rates, from the motion of particles.
//!
//! Least squares ([`affine_fit`]), volume averages on a triangulation ([`cell_strain`], [`bagi_strain`],
//! [`boundary_strain`]: three ways to the same value, P16), contact cells with particle rotations ([`satake_strain`]),
//! and the particles' own elastic strain ([`ElasticConstants`]). Displacements give strains, velocities give rates. The
//! positions passed to an operator are the configuration that its gradients refer to.

mod affine;
mod bagi;
mod boundary;
mod cells;
mod constitutive;
pub mod cosserat;
mod satake;

pub use affine::{AffineFit, Dimension, affine_fit};
pub use bagi::{BagiStrain, bagi_strain};
pub use boundary::{boundary_strain, cell_gradient};
pub use cells::{CellStrain, MeshStrain, cell_strain};
pub use constitutive::{ElasticConstants, ElasticState, contact_point_shift, platen_strain};
pub use satake::{SatakeStrain, satake_strain};
