//! Cohesive beam with a dashpot beside each of its springs.
//!
//! The elastic part is the [`CohesiveBeam`], with its strengths. The dashpots act on the rates of the same four deformations, for which
//! the rotations of the ends are measured from the branch vector. With the relative displacement `δ` of the centers in a step, their
//! rotations `φ_A`, `φ_B`, the unit branch vector `X`, the length `l`, the part `⊥` across `X`, and `ω = X × δ/l`,
//!
//! `e = Δl`, `a = φ_A⊥ − ω`, `b = φ_B⊥ − ω`, `t = (φ_B − φ_A)·X`
//!
//! the dashpots exert `N = c_n e/Δt`, `D_A = (c_s (½l₀)² (a+b) − c_b (b−a))/Δt`, `D_B = (c_s (½l₀)² (a+b) + c_b (b−a))/Δt`, and
//! `T = c_t t/Δt`:
//!
//! `M_A = T X − D_A`, `M_B = −T X − D_B`, `F_A = N X − X × (M_A+M_B)/l`, `F_B = −F_A`.
//!
//! Forces and moments balance, and the dissipated power `(N e + D_A·a + D_B·b + T t)/Δt` is never negative.
//!
//! A damping ratio ξ is that of one mode of an isolated pair, 1 for critical damping: `c = 2ξ√(m k)`, with the spring `k` of the mode and
//! its inertia `m`
//!
//! | mode | inertia |
//! |---|---|
//! | normal | `m_r = m_A m_B/(m_A+m_B)`, kg |
//! | bending, twist | `I_r = I_A I_B/(I_A+I_B)`, kg·m² |
//! | shear | `1/(1/m_r + (½l₀)²/I_r)`, kg |
//!
//! where `I = ⅖ m R²`. For unlike particles, shear and bending are one mode of two variables; the ratios are then those of its uncoupled
//! parts. Strengths are compared with the elastic stresses: a dashpot breaks nothing.

#[cfg(feature = "std")]
mod table;
#[cfg(test)]
mod tests;

#[cfg(feature = "std")]
pub use table::DampedBeamTable;

use super::common::{ParameterError, reciprocal_of_step, require};
use super::{
    BeamStiffness, CohesiveBeam, CohesiveBeamState, ContactGeometry, ContactLaw, Reference, Response, Status,
    Stiffness, TemperatureFactors,
};
use crate::kinematics::bond_frame::across;
use crate::kinematics::{EndLoads, FrameKinematics, PointKinematics};
#[cfg(not(feature = "std"))]
use crate::math::Real as _;
use crate::math::Vec3;

/// Damping ratios of the modes of a pair, 1; see the [module](self).
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct BeamDamping {
    /// Of elongation.
    pub normal: f64,
    /// Of shear.
    pub shear: f64,
    /// Of bending.
    pub bending: f64,
    /// Of twist.
    pub twist: f64,
}

/// Parameters of a beam with dashpots.
///
/// ```
/// use concordem_contact::law::{CohesiveBeam, ContactGeometry, ContactLaw, DampedBeam, Section};
///
/// let beam = CohesiveBeam::new(70e9, 0.3, Section::Radius(0.5e-3)).unwrap();
/// let damped = DampedBeam::new(beam, 0.05).unwrap();
/// let area = std::f64::consts::PI * 0.25e-6;
/// let geometry =
///     ContactGeometry { reference_length: 2e-3, area, radius_a: 1e-3, radius_b: 1e-3, mass_a: 1e-5, mass_b: 1e-5 };
/// let stiffness = damped.stiffness(&geometry);
/// let critical = 2.0 * (0.5e-5 * stiffness.normal).sqrt();
/// assert!((stiffness.normal_damping / critical - 0.05).abs() < 1e-15);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct DampedBeam {
    /// The springs, and when they break.
    pub beam: CohesiveBeam,
    /// The dashpots.
    pub damping: BeamDamping,
}

crate::law_state! {
    /// History of a [`DampedBeam`].
    pub struct DampedBeamState {
        /// Direction of the unloaded bond in the axes half way between those of the bodies.
        rest_direction: Vec3, "1", Odd;
        /// Vector part of the rotation from either body to these axes.
        rest_rotation: Vec3, "1", Odd;
        /// Force of the dashpots on A in the last step.
        dashpot_force: Vec3, "N", Odd;
        /// Moment of the dashpots on A about the middle of the bond in the last step.
        dashpot_moment: Vec3, "N m", Odd;
    }
}

impl DampedBeamState {
    #[inline(always)]
    fn of_springs(&self) -> CohesiveBeamState {
        CohesiveBeamState { rest_direction: self.rest_direction, rest_rotation: self.rest_rotation }
    }

    /// Loads of the dashpots in the last step, when the vector from A to B was `branch` (m).
    #[inline(always)]
    fn dashpots(&self, branch: &Vec3) -> EndLoads {
        let half = branch.cross(&self.dashpot_force) * 0.5;
        EndLoads {
            force: self.dashpot_force,
            moment_a: half + self.dashpot_moment,
            moment_b: half - self.dashpot_moment,
        }
    }
}

impl DampedBeam {
    /// `beam` with the same damping ratio in all modes.
    pub fn new(beam: CohesiveBeam, damping_ratio: f64) -> Result<Self, ParameterError> {
        let [normal, shear, bending, twist] = [damping_ratio; 4];
        let damped = Self { beam, damping: BeamDamping { normal, shear, bending, twist } };
        damped.validate()?;
        Ok(damped)
    }

    /// Check that all parameters are in their ranges.
    pub fn validate(&self) -> Result<(), ParameterError> {
        self.beam.validate()?;
        let BeamDamping { normal, shear, bending, twist } = self.damping;
        let ratios = [
            ("damping_ratio", normal),
            ("shear_damping_ratio", shear),
            ("bending_damping_ratio", bending),
            ("twist_damping_ratio", twist),
        ];
        for (key, ratio) in ratios {
            require(ratio >= 0.0 && ratio.is_finite(), Self::NAME, key, ratio, "finite and not negative")?;
        }
        Ok(())
    }

    /// Constants of the dashpots between these particles: N·s/m, and N·m·s/rad for bending and twist.
    #[inline(always)]
    fn viscosities(&self, geometry: &ContactGeometry, k: &BeamStiffness) -> BeamStiffness {
        let ContactGeometry { radius_a, radius_b, mass_a, mass_b, reference_length, .. } = *geometry;
        let by_mass = 1.0 / mass_a + 1.0 / mass_b;
        let by_inertia = 2.5 * (1.0 / (mass_a * (radius_a * radius_a)) + 1.0 / (mass_b * (radius_b * radius_b)));
        let by_shear = by_mass + 0.25 * (reference_length * reference_length) * by_inertia;
        // Between two infinite masses nothing vibrates.
        let constant =
            |ratio, k: f64, inverse: f64| if inverse > 0.0 { 2.0 * ratio * (k / inverse).sqrt() } else { 0.0 };
        BeamStiffness {
            normal: constant(self.damping.normal, k.normal, by_mass),
            shear: constant(self.damping.shear, k.shear, by_shear),
            bending: constant(self.damping.bending, k.bending, by_inertia),
            twist: constant(self.damping.twist, k.twist, by_inertia),
        }
    }

    /// Loads of the dashpots in a step of `dt` seconds.
    #[inline(always)]
    fn dashpots(&self, motion: &FrameKinematics, dt: f64) -> EndLoads {
        let PointKinematics { geometry, normal, length, length_old, .. } = &motion.point;
        let c = self.viscosities(geometry, &self.beam.stiffnesses(geometry));
        let rate = reciprocal_of_step(dt);
        let turn = normal.cross(&motion.displacement) * (1.0 / length);
        let end_a = across(normal, motion.turn_a) - turn;
        let end_b = across(normal, motion.turn_b) - turn;
        let half_length = 0.5 * geometry.reference_length;
        let from_shear = (end_a + end_b) * (c.shear * (half_length * half_length) * rate);
        let from_bending = (end_b - end_a) * (c.bending * rate);
        let torsion = normal * (c.twist * rate * normal.dot(&(motion.turn_b - motion.turn_a)));
        let moment_a = torsion - (from_shear - from_bending);
        let moment_b = -torsion - (from_shear + from_bending);
        let axial = c.normal * rate * (length - length_old);
        let force = normal * axial - normal.cross(&(moment_a + moment_b)) * (1.0 / length);
        EndLoads { force, moment_a, moment_b }
    }
}

/// Work of constant loads on the bond in a step, J. Summed so that an exchange of A and B keeps its bits.
#[inline(always)]
fn work(motion: &FrameKinematics, loads: &EndLoads) -> f64 {
    let EndLoads { force, moment_a, moment_b } = loads;
    force.dot(&motion.displacement) - (moment_a.dot(&motion.turn_a) + moment_b.dot(&motion.turn_b))
}

impl ContactLaw for DampedBeam {
    type State = DampedBeamState;
    type Kinematics = FrameKinematics;
    const NAME: &'static str = "damped_beam";
    const VARIES: bool = true;

    fn at_temperature(&self, factors: &TemperatureFactors) -> Self {
        Self { beam: self.beam.at_temperature(factors), ..*self }
    }

    #[inline(always)]
    fn respond(&self, kinematics: &FrameKinematics, old: &DampedBeamState, dt: f64) -> Response<DampedBeamState> {
        let springs = self.beam.respond(kinematics, &old.of_springs(), dt);
        let CohesiveBeamState { rest_direction, rest_rotation } = springs.state;
        let mut energy = springs.energy;
        let branch = kinematics.point.normal * kinematics.point.length;
        let before = work(kinematics, &old.dashpots(&(branch - kinematics.displacement)));
        let mut response = Response {
            force: springs.force,
            moment: springs.moment,
            state: DampedBeamState { rest_direction, rest_rotation, ..DampedBeamState::default() },
            status: springs.status,
            energy,
        };
        if springs.status == Status::Lives {
            let dashpots = self.dashpots(kinematics, dt);
            energy.add_viscous(0.5 * (before + work(kinematics, &dashpots)));
            (response.state.dashpot_force, response.state.dashpot_moment) = (dashpots.force, dashpots.moment());
            response.force += dashpots.force;
            response.moment += dashpots.moment();
        } else {
            energy.add_viscous(0.5 * before);
        }
        Response { energy, ..response }
    }

    /// The springs are not compared with the strength again.
    fn last_force(&self, still: &FrameKinematics, state: &DampedBeamState) -> (Vec3, Vec3) {
        let unbreakable = CohesiveBeam { strength: f64::INFINITY, shear: super::ShearStrength::default(), ..self.beam };
        let Response { force, moment, .. } = unbreakable.respond(still, &state.of_springs(), 0.0);
        (force + state.dashpot_force, moment + state.dashpot_moment)
    }

    #[inline(always)]
    fn viscous_force(_normal: &Vec3, state: &DampedBeamState) -> Vec3 {
        state.dashpot_force
    }

    fn stiffness(&self, geometry: &ContactGeometry) -> Stiffness {
        let c = self.viscosities(geometry, &self.beam.stiffnesses(geometry));
        Stiffness {
            normal_damping: c.normal,
            shear_damping: c.shear,
            bending_damping: c.bending,
            twist_damping: c.twist,
            ..self.beam.stiffness(geometry)
        }
    }

    fn kept_reference(&self, reference: Reference) -> Option<Reference> {
        self.beam.kept_reference(reference)
    }

    fn bonded_area(&self, radius_a: f64, radius_b: f64, mean_radius: f64) -> f64 {
        self.beam.bonded_area(radius_a, radius_b, mean_radius)
    }

    fn axial_force(&self, geometry: &ContactGeometry, length: f64) -> Option<f64> {
        self.beam.axial_force(geometry, length)
    }
}
