//! Elastic constants of an isotropic body.

/// Elastic constants of a particle or wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elastic {
    /// Young's modulus `E`, Pa; infinite for a rigid body.
    pub young: f64,
    /// Poisson's ratio `ν`, 1.
    pub poisson: f64,
}

impl Elastic {
    /// A rigid body.
    pub const RIGID: Self = Self { young: f64::INFINITY, poisson: 0.0 };
}
