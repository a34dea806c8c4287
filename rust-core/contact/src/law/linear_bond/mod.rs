//! Brittle bond of linear springs and dashpots: Madan 2019, (2.20)–(2.40).
//!
//! With the elongation `u` of the bond and the shear displacement `u_t` of B relative to A, which rotates with the
//! contact,
//!
//! | | | |
//! |---|---|---|
//! | normal force | `f_n = k_n u + c_n u̇` | (2.23), (2.25), (2.33) |
//! | shear force | `f_t = k_t u_t + c_t u̇_t` | (2.24), (2.27), (2.34) |
//! | dashpots | `c = ξ·2√(m k)`, `m = m_A m_B/(m_A+m_B)` | (2.35)–(2.37) |
//! | failure | `f_n ≥ φ_n` or `‖f_t‖ ≥ φ_t` | (2.38)–(2.39) |
//!
//! in N, m, s, kg. Forces are those on A, positive in tension. (2.38) is printed with `‖f_n‖`, but its text says
//! tension; this law breaks in tension only. Failure compares total forces, dashpots included, as printed. It is
//! instantaneous: the stored energy at that moment is released as [`EnergySplit::damage`], and the pair continues as an
//! unbonded contact. A bond that particle-level failure has released ([`PointKinematics::bonded`] false) breaks under
//! any force. Rates are mean rates of the step.
//!
//! Madan 2019 does not say whether the springs start unstressed; see [`LinearBond::subtract_initial_gap`].

#[cfg(feature = "std")]
mod table;
#[cfg(test)]
mod tests;

#[cfg(feature = "std")]
pub use table::LinearBondTable;

use super::common::{ParameterError, reciprocal_of_step, require};
use super::{
    ColumnUse, ContactGeometry, ContactLaw, EnergySplit, Given, Masses, Reference, Response, Status, Stiffness,
    TemperatureFactors,
};
use crate::kinematics::PointKinematics;
#[cfg(not(feature = "std"))]
use crate::math::Real as _;
use crate::math::{Vec3, norm};

/// Parameters of the brittle linear bond.
///
/// ```
/// use concordem_contact::kinematics::{PointKinematics, Transport};
/// use concordem_contact::law::{ContactGeometry, ContactLaw, LinearBond, LinearBondState};
/// use concordem_contact::math::Vec3;
///
/// let bond = LinearBond::new(2.0e6, 1.0e6, 0.0, 500.0, 300.0).unwrap();
/// let geometry =
///     ContactGeometry { reference_length: 2.0, area: 1.0, radius_a: 1.0, radius_b: 1.0, mass_a: 1.0, mass_b: 1.0 };
/// let stretched = PointKinematics {
///     geometry,
///     length: 2.0001,
///     length_old: 2.0,
///     elongation: 1.0e-4,
///     elongation_old: 0.0,
///     gap: 1.0e-4,
///     normal: Vec3::x(),
///     shear_increment: Vec3::zeros(),
///     arm_a: 1.00005,
///     arm_b: 1.00005,
///     bonded: true,
///     transport: Transport::identity(Vec3::x()),
/// };
/// let response = bond.respond(&stretched, &LinearBondState::default(), 1.0e-6);
/// assert_eq!(response.force, Vec3::x() * 200.0);
/// assert_eq!(response.energy.stored_normal, 0.5 * 200.0 * 1.0e-4);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct LinearBond {
    /// Normal stiffness `k_n`, N/m.
    pub normal_stiffness: f64,
    /// Shear stiffness `k_t`, N/m.
    pub shear_stiffness: f64,
    /// Damping ratio `ξ` of both dashpots, 1; 1 is critical damping of an isolated pair.
    pub damping_ratio: f64,
    /// Tensile strength `φ_n`, N; infinite for a bond that never fails in tension.
    pub normal_strength: f64,
    /// Shear strength `φ_t`, N; infinite for a bond that never fails in shear.
    pub shear_strength: f64,
    /// Whether the normal spring is unstressed at the length at bonding (default). Otherwise it is unstressed at the
    /// length at which the spheres touch, so an initial gap or overlap loads the bond from the start.
    pub subtract_initial_gap: bool,
}

crate::law_state! {
    /// History of a [`LinearBond`].
    pub struct LinearBondState {
        /// Shear displacement of B relative to A since bonding, Madan 2019 (2.28).
        shear_displacement: Vec3, "m", Odd;
        /// Normal dashpot force of the last step.
        normal_dashpot: f64, "N", Even;
        /// Shear dashpot force of the last step.
        shear_dashpot: Vec3, "N", Odd;
    }
}

impl LinearBond {
    /// A bond with the given stiffnesses (N/m), damping ratio, and strengths (N; may be infinite), unstressed at its
    /// length at bonding.
    pub fn new(
        normal_stiffness: f64,
        shear_stiffness: f64,
        damping_ratio: f64,
        normal_strength: f64,
        shear_strength: f64,
    ) -> Result<Self, ParameterError> {
        let bond = Self {
            normal_stiffness,
            shear_stiffness,
            damping_ratio,
            normal_strength,
            shear_strength,
            subtract_initial_gap: true,
        };
        bond.validate()?;
        Ok(bond)
    }

    /// Check that all parameters are in their ranges.
    pub fn validate(&self) -> Result<(), ParameterError> {
        let Self { normal_stiffness: kn, shear_stiffness: kt, damping_ratio: xi, .. } = *self;
        let (normal, shear) = (self.normal_strength, self.shear_strength);
        require(kn > 0.0 && kn.is_finite(), Self::NAME, "normal_stiffness", kn, "positive and finite (N/m)")?;
        require(kt >= 0.0 && kt.is_finite(), Self::NAME, "shear_stiffness", kt, "finite and not negative (N/m)")?;
        require(xi >= 0.0 && xi.is_finite(), Self::NAME, "damping_ratio", xi, "finite and not negative")?;
        require(normal > 0.0, Self::NAME, "normal_strength", normal, "positive (N; inf for an unbreakable bond)")?;
        require(shear > 0.0, Self::NAME, "shear_strength", shear, "positive (N; inf for an unbreakable bond)")
    }

    /// Dashpot constants `(c_n, c_t)`, N·s/m, Madan 2019 (2.35)–(2.37).
    #[inline(always)]
    fn dashpots(&self, geometry: &ContactGeometry) -> (f64, f64) {
        if self.damping_ratio == 0.0 {
            return (0.0, 0.0);
        }
        let mass = geometry.reduced_mass();
        (
            2.0 * self.damping_ratio * (mass * self.normal_stiffness).sqrt(),
            2.0 * self.damping_ratio * (mass * self.shear_stiffness).sqrt(),
        )
    }
}

impl LinearBond {
    /// Elongation of the normal spring, m.
    #[inline(always)]
    fn stretch(&self, kinematics: &PointKinematics) -> f64 {
        if self.subtract_initial_gap { kinematics.elongation } else { kinematics.gap }
    }

    /// Response of the unbroken bond, and whether it fails in tension, and in shear. `DASHPOTS`: false if neither the law nor the last step has dashpot forces; then the
    /// response leaves them out. For finite motion, the bits are the same.
    #[inline(always)]
    fn intact<const DASHPOTS: bool>(
        &self,
        kinematics: &PointKinematics,
        old: &LinearBondState,
        (normal_viscosity, shear_viscosity): (f64, f64),
        dt: f64,
    ) -> (Response<LinearBondState>, [bool; 2]) {
        let rate = reciprocal_of_step(dt);
        let stretch = self.stretch(kinematics);
        let lengthening = kinematics.length - kinematics.length_old;
        let elastic_normal = self.normal_stiffness * stretch;
        let slide = kinematics.shear_increment;
        let shear_displacement = kinematics.transport.apply(&old.shear_displacement) + slide;
        let elastic_shear = shear_displacement * self.shear_stiffness;
        let (normal_dashpot, shear_dashpot) = if DASHPOTS {
            // + 0: without viscosity, they are 0 instead of -0.
            (normal_viscosity * lengthening * rate + 0.0, slide * (shear_viscosity * rate) + Vec3::zeros())
        } else {
            (0.0, Vec3::zeros())
        };

        let normal_force = elastic_normal + normal_dashpot;
        let shear_force = elastic_shear + shear_dashpot;
        let fails = [normal_force >= self.normal_strength, norm(&shear_force) >= self.shear_strength];
        let stored_normal = 0.5 * elastic_normal * stretch;
        let stored_shear = 0.5 * elastic_shear.dot(&shear_displacement);
        let mut energy = EnergySplit { stored_normal, stored_shear, ..EnergySplit::default() };
        if DASHPOTS {
            energy.add_viscous(0.5 * (old.normal_dashpot + normal_dashpot) * lengthening);
            let old_shear_dashpot = kinematics.transport.apply(&old.shear_dashpot);
            energy.add_viscous(0.5 * (old_shear_dashpot + shear_dashpot).dot(&slide));
        }
        let response = Response {
            force: kinematics.normal * normal_force + shear_force,
            moment: Vec3::zeros(),
            state: LinearBondState { shear_displacement, normal_dashpot, shear_dashpot },
            status: Status::Lives,
            energy,
        };
        (response, fails)
    }
}

impl ContactLaw for LinearBond {
    fn kept_reference(&self, reference: Reference) -> Option<Reference> {
        self.subtract_initial_gap.then_some(reference)
    }

    fn unstrained_length(&self, geometry: &ContactGeometry) -> f64 {
        if self.subtract_initial_gap { geometry.reference_length } else { geometry.radius_a + geometry.radius_b }
    }

    type State = LinearBondState;
    type Kinematics = PointKinematics;
    const NAME: &'static str = "linear_bond";
    const DEFORMS: bool = true;
    const READS_OLD_ELONGATION: bool = false;
    const VARIES: bool = true;

    fn at_temperature(&self, factors: &TemperatureFactors) -> Self {
        Self {
            normal_stiffness: self.normal_stiffness * factors.stiffness,
            shear_stiffness: self.shear_stiffness * factors.stiffness,
            normal_strength: self.normal_strength * factors.strength,
            shear_strength: self.shear_strength * factors.strength,
            ..*self
        }
    }

    #[inline(always)]
    fn respond(&self, kinematics: &PointKinematics, old: &LinearBondState, dt: f64) -> Response<LinearBondState> {
        let (response, [tension, shear]) =
            self.intact::<true>(kinematics, old, self.dashpots(&kinematics.geometry), dt);
        if !(tension || shear) && kinematics.bonded {
            return response;
        }
        // The forces of this step are void, and the stored energy is released. It contains the half of this step's work
        // that the void elastic force would have done. That work was not done; it is booked as integration. The
        // `stored_*` fields keep the modes of the released energy.
        let EnergySplit { stored_normal, stored_shear, .. } = response.energy;
        let damage = stored_normal + stored_shear;
        let elastic_normal = self.normal_stiffness * self.stretch(kinematics);
        let elastic_shear = response.state.shear_displacement * self.shear_stiffness;
        let (slide, stretching) = (kinematics.shear_increment, kinematics.elongation - kinematics.elongation_old);
        let integration = -0.5 * (elastic_normal * stretching + elastic_shear.dot(&slide));
        let mut energy = EnergySplit { stored_normal, stored_shear, damage, integration, ..EnergySplit::default() };
        let old_shear_dashpot = kinematics.transport.apply(&old.shear_dashpot);
        energy.add_viscous(0.5 * old.normal_dashpot * (kinematics.length - kinematics.length_old));
        energy.add_viscous(0.5 * old_shear_dashpot.dot(&slide));
        Response {
            force: Vec3::zeros(),
            moment: Vec3::zeros(),
            state: LinearBondState::default(),
            status: if shear && !tension { Status::BrokeInShear } else { Status::Broke },
            energy,
        }
    }

    const COLUMNS: Option<ColumnUse> = Some(ColumnUse {
        masses: Masses::WithOptionalPart,
        // The dashpot forces.
        optional: 4,
        damage: false,
        friction: false,
        ..ColumnUse::ALL
    });

    /// Bonds that hold.
    #[inline(always)]
    fn straight(
        &self,
        kinematics: &PointKinematics,
        old: &LinearBondState,
        given: &Given,
        dt: f64,
    ) -> (Response<LinearBondState>, bool) {
        let (response, [tension, shear]) = if given.reduced {
            self.intact::<false>(kinematics, old, (0.0, 0.0), dt)
        } else {
            self.intact::<true>(kinematics, old, self.dashpots(&kinematics.geometry), dt)
        };
        (response, !(tension | shear) & kinematics.bonded)
    }

    #[inline(always)]
    fn uses_optional_part(&self) -> bool {
        self.damping_ratio != 0.0
    }

    /// A dashpot may have kept the springs below the strength, so the strength is not checked.
    fn last_force(&self, still: &PointKinematics, state: &LinearBondState) -> (Vec3, Vec3) {
        let elastic = still.normal * (self.normal_stiffness * self.stretch(still))
            + state.shear_displacement * self.shear_stiffness;
        (elastic + Self::viscous_force(&still.normal, state), Vec3::zeros())
    }

    #[inline(always)]
    fn viscous_force(normal: &Vec3, state: &Self::State) -> Vec3 {
        normal * state.normal_dashpot + state.shear_dashpot
    }

    fn stiffness(&self, geometry: &ContactGeometry) -> Stiffness {
        let (normal_damping, shear_damping) = self.dashpots(geometry);
        Stiffness {
            normal: self.normal_stiffness,
            shear: self.shear_stiffness,
            normal_damping,
            shear_damping,
            ..Stiffness::default()
        }
    }
}
