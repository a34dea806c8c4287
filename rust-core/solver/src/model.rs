//! The model: parameters of the laws, and settings that stay constant while the solver steps.

use concordem_contact::kinematics::MotionMeasure;
use concordem_contact::kinematics::deformable::Deformable;
use concordem_contact::math::Vec3;

use crate::PairCoefficients;
use crate::fracture::virial::HydrostaticStrength;
use crate::heat::HeatModel;
use crate::integrate::Damping;
use crate::joints::Joints;
use crate::state::Particles;
use crate::state::contacts::Pair;
use crate::strengths::Strengths;

/// Integration scheme.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// Central differences, velocities given at −½Δt.
    #[default]
    Leapfrog,
    /// The same recursion, velocities given at time 0 (first kick half a step).
    VelocityVerlet,
}

/// Everything that stays constant while the solver steps.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// How relative motion is measured.
    pub mode: MotionMeasure,
    /// Integration scheme.
    pub scheme: Scheme,
    /// Artificial damping.
    pub damping: Damping,
    /// Gravity, m/s².
    pub gravity: Vec3,
    /// Damage at which a bond enters the event log.
    pub damage_threshold: f64,
    /// Pair coefficients of unbonded contacts by material.
    pub contact_rows: PairCoefficients,
    /// Pair coefficients of wall contacts by material.
    pub wall_rows: PairCoefficients,
    /// Joints, whose pair coefficients go before those of the materials.
    pub joints: Joints,
    /// Skin of the neighbor list, as a fraction of the smallest radius.
    pub skin: f64,
    /// Thresholds of particle-level failure.
    pub hydrostatic_strength: HydrostaticStrength,
    /// Factors on the strengths of bonds.
    pub strengths: Strengths,
    /// How particles deform, if they do.
    pub deformable: Option<Deformable>,
    /// How heat flows, if it does.
    pub heat: Option<HeatModel>,
    /// Whether [`Solver::step`](crate::Solver::step) fails if the stiffness of a contact has outgrown the time step
    /// ([`collision::outgrown`](crate::collision::outgrown)).
    pub watch_contacts: bool,
}

impl Model {
    /// Pair coefficients of an unbonded contact of two particles; `None` if they do not interact.
    pub fn contact_row(&self, particles: &Particles, pair: Pair) -> Option<u16> {
        let [a, b] = [pair.a, pair.b].map(|p| particles.material[p as usize]);
        let row = self.contact_rows.get(a, b)?;
        Some(self.joints.row(particles, pair).unwrap_or(row))
    }
}

impl Default for Model {
    fn default() -> Self {
        Self {
            mode: MotionMeasure::Finite,
            scheme: Scheme::Leapfrog,
            damping: Damping::None,
            gravity: Vec3::zeros(),
            damage_threshold: 0.9,
            contact_rows: PairCoefficients::default(),
            wall_rows: PairCoefficients::default(),
            joints: Joints::default(),
            skin: 0.2,
            hydrostatic_strength: HydrostaticStrength::default(),
            strengths: Strengths::default(),
            deformable: None,
            heat: None,
            watch_contacts: false,
        }
    }
}
