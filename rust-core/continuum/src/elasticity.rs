//! Isotropic linear elasticity.

use concordem_contact::math::Mat3;
use nalgebra::Matrix6;

use crate::error::ContinuumError;
use crate::voigt::{deviatoric, identity};

/// An isotropic elastic material: `σ = 3K ε_vol + 2G ε_dev`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elasticity {
    /// Bulk modulus `K = E/(3(1−2ν))`, Pa.
    pub bulk: f64,
    /// Shear modulus `G = E/(2(1+ν))`, Pa.
    pub shear: f64,
}

impl Elasticity {
    /// From Young's modulus (Pa) and Poisson's ratio.
    ///
    /// # Errors
    /// A modulus that is not positive; a ratio outside (−1, ½).
    pub fn new(young: f64, poisson: f64) -> Result<Self, ContinuumError> {
        if !(young > 0.0 && young.is_finite()) {
            let demand = "it must be positive".to_owned();
            return Err(ContinuumError::Parameter { name: "young", value: young, demand });
        }
        if !(poisson > -1.0 && poisson < 0.5) {
            let demand = "it must be greater than -1 and less than 0.5".to_owned();
            return Err(ContinuumError::Parameter { name: "poisson", value: poisson, demand });
        }
        Ok(Self { bulk: young / (3.0 * (1.0 - 2.0 * poisson)), shear: young / (2.0 * (1.0 + poisson)) })
    }

    /// Young's modulus, Pa.
    pub fn young(&self) -> f64 {
        9.0 * self.bulk * self.shear / (3.0 * self.bulk + self.shear)
    }

    /// Poisson's ratio.
    pub fn poisson(&self) -> f64 {
        0.5 * (3.0 * self.bulk - 2.0 * self.shear) / (3.0 * self.bulk + self.shear)
    }

    /// Stress of a strain, Pa.
    pub fn stress(&self, strain: &Mat3) -> Mat3 {
        let mean = strain.trace() / 3.0;
        let identity = Mat3::identity();
        (strain - identity * mean) * (2.0 * self.shear) + identity * (3.0 * self.bulk * mean)
    }

    /// Strain of a stress.
    pub fn strain(&self, stress: &Mat3) -> Mat3 {
        let mean = stress.trace() / 3.0;
        let identity = Mat3::identity();
        (stress - identity * mean) * (0.5 / self.shear) + identity * (mean / (3.0 * self.bulk))
    }

    /// Stiffness for six components, Pa.
    pub fn stiffness(&self) -> Matrix6<f64> {
        deviatoric() * (2.0 * self.shear) + identity() * identity().transpose() * self.bulk
    }
}
