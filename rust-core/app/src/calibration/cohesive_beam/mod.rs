//! Cylinders of cohesive beams: their elastic constants, vibration, and strength, and the search for beam parameters that
//! give target properties (Jebahi, André, Terreros, Iordanoff 2015, sections 2.3, 2.4.2, 4.2).
//!
//! A specimen is cut from a periodic packing that was compacted without friction. Its radii are uniform with a dispersion
//! `κ = (R_max−R_min)/R̄`; the interaction ratio follows from the target bonds per particle. Elastic constants are static:
//! all particles get the displacements of a uniform strain, the ends are held, and the rest relaxes. They are measured in
//! two ways: from the loads on the ends and the deformation of the middle half; and in tension, as in the book, from the
//! distance of the ends and the change of the surface (both in [`CylinderResponse`]).
//!
//! The search follows the book: `ν_μ` is given; `r̃` follows from the target `ν_M`, which does not depend on `E_μ`; `E_μ`
//! follows from the target `E_M`, which is proportional to it, as `σ_μf` follows from the target strength;
//! and the density of the spheres follows from equal mass, `ρ_μ = ρ_M V_M/ΣV_μ` \[2.26\].

mod error;
mod failure;
mod pulse;
mod response;
mod search;
mod specimen;
#[cfg(test)]
mod tests;
mod vibration;

pub use error::CalibrationError;
pub use failure::{CylinderFailure, FractureCriterion, scenario_text, strength};
pub use pulse::{PulseSpeed, impact};
pub use response::{CylinderLoad, CylinderResponse, ParticlePressures, elastic};
pub use search::{ElasticMatch, match_elastic};
pub use specimen::{CylinderRecipe, CylinderSpecimen};
pub use vibration::{FreeVibration, vibration};
