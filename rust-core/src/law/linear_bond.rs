//! Brittle bond of linear springs and dashpots: Madan 2019, (2.20)–(2.40).
//!
//! With `u` the elongation of the bond and `u_t` the shear displacement of B relative to A, carried with the contact,
//!
//! | | | |
//! |---|---|---|
//! | normal force | `f_n = k_n u + c_n u̇` | (2.23), (2.25), (2.33) |
//! | shear force | `f_t = k_t u_t + c_t u̇_t` | (2.24), (2.27), (2.34) |
//! | dashpots | `c = ξ·2√(m k)`, `m = m_A m_B/(m_A+m_B)` | (2.35)–(2.37) |
//! | failure | `f_n ≥ φ_n` or `‖f_t‖ ≥ φ_t` | (2.38)–(2.39) |
//!
//! in N, m, s, kg. Forces are those on A, positive in tension. (2.38) is printed with `‖f_n‖`, its prose says tension;
//! tension is implemented. Failure compares the whole forces, dashpots included, as printed. It is instantaneous;
//! the stored energy at that moment is released as [`EnergySplit::damage`], and the pair goes on as an unbonded
//! contact. Rates are the mean rates of the step.
//!
//! Whether the springs start unstressed is open in Madan 2019; see [`LinearBond::subtract_initial_gap`].

use super::common::{ParameterError, reciprocal_of_step, require};
use super::{ContactGeometry, ContactLaw, EnergySplit, Fate, Reference, Response, Stiffness};
use crate::kinematics::PointKinematics;
use crate::math::Vec3;

/// Parameters of the brittle linear bond.
///
/// ```
/// use concordem::kinematics::{PointKinematics, Transport};
/// use concordem::law::{ContactGeometry, ContactLaw, LinearBond, LinearBondState};
/// use concordem::math::Vec3;
///
/// let bond = LinearBond::new(2.0e6, 1.0e6, 0.0, 500.0, 300.0).unwrap();
/// let geometry =
///     ContactGeometry { reference_length: 2.0, area: 1.0, radius_a: 1.0, radius_b: 1.0, mass_a: 1.0, mass_b: 1.0 };
/// let stretched = PointKinematics {
///     geometry,
///     length: 2.0001,
///     length_old: 2.0,
///     elongation: 1.0e-4,
///     gap: 1.0e-4,
///     normal: Vec3::x(),
///     shear_increment: Vec3::zeros(),
///     arm_a: 1.00005,
///     arm_b: 1.00005,
///     bonded: true,
///     transport: Transport::identity(Vec3::x()),
/// };
/// let answer = bond.respond(&stretched, &LinearBondState::default(), 1.0e-6);
/// assert_eq!(answer.force, Vec3::x() * 200.0);
/// assert_eq!(answer.energy.stored_normal, 0.5 * 200.0 * 1.0e-4);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearBond {
    /// Normal stiffness `k_n`, N/m.
    pub normal_stiffness: f64,
    /// Shear stiffness `k_t`, N/m.
    pub shear_stiffness: f64,
    /// Damping ratio `ξ` of both dashpots, 1; 1 is critical for the pair alone.
    pub damping_ratio: f64,
    /// Tensile strength `φ_n`, N; infinite for a bond that never fails in tension.
    pub normal_strength: f64,
    /// Shear strength `φ_t`, N; infinite for a bond that never fails in shear.
    pub shear_strength: f64,
    /// Whether the normal spring is unstressed at the distance of bonding (default), or at the distance at which the
    /// spheres touch, so that an initial gap or overlap loads the bond from the start.
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
    /// A bond with the given stiffnesses (N/m), damping ratio, and strengths (N; may be infinite), unstressed at the
    /// distance of bonding.
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

    /// Refuse parameters without meaning.
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

impl ContactLaw for LinearBond {
    fn kept_reference(&self, reference: Reference) -> Option<Reference> {
        self.subtract_initial_gap.then_some(reference)
    }

    type State = LinearBondState;
    type Kinematics = PointKinematics;
    const NAME: &'static str = "linear_bond";

    #[inline(always)]
    fn respond(&self, kinematics: &PointKinematics, old: &LinearBondState, dt: f64) -> Response<LinearBondState> {
        let (normal_viscosity, shear_viscosity) = self.dashpots(&kinematics.geometry);
        let rate = reciprocal_of_step(dt);

        let stretch = if self.subtract_initial_gap { kinematics.elongation } else { kinematics.gap };
        let lengthening = kinematics.length - kinematics.length_old;
        let elastic_normal = self.normal_stiffness * stretch;
        let normal_dashpot = normal_viscosity * lengthening * rate;

        let slide = kinematics.shear_increment;
        let shear_displacement = kinematics.transport.apply(&old.shear_displacement) + slide;
        let old_shear_dashpot = kinematics.transport.apply(&old.shear_dashpot);
        let elastic_shear = shear_displacement * self.shear_stiffness;
        let shear_dashpot = slide * (shear_viscosity * rate);

        let normal_force = elastic_normal + normal_dashpot;
        let shear_force = elastic_shear + shear_dashpot;
        let stored_normal = 0.5 * elastic_normal * stretch;
        let stored_shear = 0.5 * elastic_shear.dot(&shear_displacement);

        let mut energy = EnergySplit::default();
        if normal_force >= self.normal_strength || shear_force.norm() >= self.shear_strength {
            // The force of this step is void. The energy stored by now is released; it contains the half of this
            // step's work that the void elastic force would have taken in, which nobody did: the integration term.
            energy.damage = stored_normal + stored_shear;
            energy.integration = -0.5 * (elastic_normal * lengthening + elastic_shear.dot(&slide));
            energy.add_viscous(0.5 * old.normal_dashpot * lengthening);
            energy.add_viscous(0.5 * old_shear_dashpot.dot(&slide));
            return Response {
                force: Vec3::zeros(),
                moment: Vec3::zeros(),
                state: LinearBondState::default(),
                fate: Fate::Broke,
                energy,
            };
        }
        energy.stored_normal = stored_normal;
        energy.stored_shear = stored_shear;
        energy.add_viscous(0.5 * (old.normal_dashpot + normal_dashpot) * lengthening);
        energy.add_viscous(0.5 * (old_shear_dashpot + shear_dashpot).dot(&slide));
        Response {
            force: kinematics.normal * normal_force + shear_force,
            moment: Vec3::zeros(),
            state: LinearBondState { shear_displacement, normal_dashpot, shear_dashpot },
            fate: Fate::Lives,
            energy,
        }
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
