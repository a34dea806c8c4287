//! Continuum fields from particles: stress, couple stress, strain, rotation, fabric, damage, power; structure of packings.
//!
//! Every operator is a pure function over borrowed slices: the solver's state, arrays of a host program, and results on disk
//! feed the same code without copies ([`ContactSet`], [`LoadSet`], [`vectors`]). Sums run over tiles of fixed size that are
//! added in order, so a result does not depend on the number of threads.
//!
//! **Conventions.** SI units. Tension positive. Branch vector `l = x_B − x_A` with the image of B. Force and moment of
//! a contact are those on A, the moment about the contact point; B gets the opposite. Tensors are position first:
//! `σ_ij`: i normal, j force, `t_j = n_i σ_ij`; likewise `μ_ij`, `κ_ij = ∂_i φ_j`. Displacement gradients are
//! `G_ij = ∂u_i/∂x_j`, and `U = Gᵀ`. Tensors are not symmetrized; use [`stress::symmetric`] for that. Units: stress Pa,
//! couple stress N/m, curvature 1/m. In the plane, everything is per unit depth.
//!
//! **Sources.** Hodo et al. 2019 (ERDC TR-14-6 Report 3), Stránský 2018 (thesis), Jebahi et al. 2015 (book), Madan 2019
//! (thesis); equation numbers at each operator. Tests show which equations of different sources agree and which do not
//! (`operator/tests`).

pub mod acoustic;
pub mod affine_stiffness;
pub mod coarse_grain;
mod contact_set;
pub mod couple_stress;
pub mod crack_directions;
pub mod damage;
mod error;
pub mod fabric;
pub mod fragments;
pub mod interruption;
pub mod power;
mod region;
pub mod strain;
pub mod stress;
pub mod structure;
mod sum;
pub mod tessellation;
#[cfg(test)]
mod tests;

pub use contact_set::{Contact, ContactSet, LoadSet, moment_about_contact_point, pairs, vectors};
pub use error::OperatorError;
pub use region::{HalfSpace, ImageSearch, Period, Region, Truncation};

/// The code of the README is tested.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
