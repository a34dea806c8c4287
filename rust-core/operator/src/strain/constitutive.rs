//! Strain of a particle from its own stress, and strain from platens.

use crate::error::OperatorError;
use concordem_contact::math::{Mat3, Vec3};

/// State of strain or stress of a deformable particle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ElasticState {
    /// Three dimensions.
    #[default]
    Solid,
    /// Disc of constant depth (Madan 2019, (2.48)).
    PlaneStrain,
    /// Disc without stress across its plane (Madan 2019, (2.49)).
    PlaneStress,
}

/// Isotropic elastic constants of a particle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElasticConstants {
    young: f64,
    poisson: f64,
    state: ElasticState,
}

impl ElasticConstants {
    /// Young's modulus (Pa, positive) and Poisson's ratio (−1 to ½).
    pub fn new(young: f64, poisson: f64, state: ElasticState) -> Result<Self, OperatorError> {
        if !(young > 0.0 && young.is_finite()) {
            return Err(OperatorError::Constant {
                name: "Young's modulus",
                value: young,
                demand: "it must be positive",
            });
        }
        if !(poisson > -1.0 && poisson <= 0.5) {
            let demand = "it must be more than -1 and at most 0.5";
            return Err(OperatorError::Constant { name: "Poisson's ratio", value: poisson, demand });
        }
        Ok(Self { young, poisson, state })
    }

    /// Strain `ε_p = D : sym(σ_p)` of a particle under the stress `σ_p` (Pa) (operator O19; Madan 2019, (2.46)–(2.49)).
    ///
    /// This is the particle's own elastic strain, not the assembly's. Shear components are tensor components (half of
    /// the thesis' vector components).
    pub fn strain(&self, stress: &Mat3) -> Mat3 {
        let s = (stress + stress.transpose()) * 0.5;
        let (e, nu) = (self.young, self.poisson);
        match self.state {
            ElasticState::Solid => (s * (1.0 + nu) - Mat3::identity() * (nu * s.trace())) / e,
            ElasticState::PlaneStrain => {
                let c = (1.0 + nu) / e;
                let mut strain = s * c;
                strain[(0, 0)] = c * ((1.0 - nu) * s[(0, 0)] - nu * s[(1, 1)]);
                strain[(1, 1)] = c * ((1.0 - nu) * s[(1, 1)] - nu * s[(0, 0)]);
                in_plane(strain)
            }
            ElasticState::PlaneStress => {
                let mut strain = s * ((1.0 + nu) / e);
                strain[(0, 0)] = (s[(0, 0)] - nu * s[(1, 1)]) / e;
                strain[(1, 1)] = (s[(1, 1)] - nu * s[(0, 0)]) / e;
                in_plane(strain)
            }
        }
    }
}

fn in_plane(mut strain: Mat3) -> Mat3 {
    for k in 0..3 {
        strain[(2, k)] = 0.0;
        strain[(k, 2)] = 0.0;
    }
    strain
}

/// Displacement (m) of a particle's contact point with the arm `s` (m) from its strain: `u_c = ε_p s` (Madan 2019,
/// (2.52)).
pub fn contact_point_shift(strain: &Mat3, arm: &Vec3) -> Vec3 {
    strain * arm
}

/// Strain `Δh/h` between two platens from their displacements along the axis (m) and their distance at the start (m)
/// (operator O20; Madan 2019, (4.20)).
pub fn platen_strain(lower: f64, upper: f64, length: f64) -> Result<f64, OperatorError> {
    if length > 0.0 && length.is_finite() {
        Ok((upper - lower) / length)
    } else {
        Err(OperatorError::Constant { name: "distance of the platens", value: length, demand: "it must be positive" })
    }
}
