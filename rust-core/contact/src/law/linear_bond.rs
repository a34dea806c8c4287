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

use super::batch::{Batch, BatchResult, ColumnResult, ColumnResults, commit_columns, evaluate_batch};
use super::common::{ParameterError, reciprocal_of_step, require};
use super::{ContactGeometry, ContactLaw, EnergySplit, Reference, Response, Status, Stiffness, TemperatureFactors};
use crate::columns::{Arrays, BATCH, Columns, Formula, Item, Lanes};
use crate::geometry::PreviousGeometry;
use crate::kinematics::deformable::ParticleVirial;
use crate::kinematics::sphere_sphere::FiniteInput;
use crate::kinematics::{BranchVector, MotionMeasure, PointKinematics};
#[cfg(not(feature = "std"))]
use crate::math::Real as _;
use crate::math::{Symmetric, Vec3, norm};
use crate::wrench::{Wrenches, wrenches_of_four};
#[cfg(feature = "std")]
use {
    super::{
        Factors,
        common::mean_strength,
        factors::times,
        frictional::{Frictional, FrictionalTable},
        table::{Fault, LawTable, RegisteredLaw},
    },
    crate::quantity::{self, Force, Number},
    schemars::JsonSchema,
    serde::{Deserialize, Serialize},
};

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

    /// Response of the unbroken bond, and whether it fails.
    #[inline(always)]
    fn intact(
        &self,
        kinematics: &PointKinematics,
        old: &LinearBondState,
        (normal_viscosity, shear_viscosity): (f64, f64),
        dt: f64,
    ) -> (Response<LinearBondState>, bool) {
        let rate = reciprocal_of_step(dt);
        let stretch = self.stretch(kinematics);
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
        let fails = normal_force >= self.normal_strength || norm(&shear_force) >= self.shear_strength;
        let stored_normal = 0.5 * elastic_normal * stretch;
        let stored_shear = 0.5 * elastic_shear.dot(&shear_displacement);
        let mut energy = EnergySplit { stored_normal, stored_shear, ..EnergySplit::default() };
        energy.add_viscous(0.5 * (old.normal_dashpot + normal_dashpot) * lengthening);
        energy.add_viscous(0.5 * (old_shear_dashpot + shear_dashpot).dot(&slide));
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

crate::columns! {
    /// Input of [`Intact`].
    struct IntactInput {
        motion: FiniteInput,
        /// Its length is NaN for a contact that is not a bond.
        reference: Reference,
        /// Mass, kg; of no meaning without dashpots.
        mass_a: f64,
        mass_b: f64,
        history: LinearBondState,
    }

    /// Output of [`Intact`].
    struct IntactOutput {
        /// 1 if the bond survives, else 0.
        holds: f64,
        /// Normal and length at the end of the step.
        geometry: PreviousGeometry,
        wrenches: Wrenches,
        /// J.
        viscous: f64,
        /// J.
        integration: f64,
        history: LinearBondState,
    }

    /// Input of [`IntactStraining`].
    struct StrainingInput {
        bond: IntactInput,
        /// Sum of the surface displacements of both particles, m.
        surface_displacement: Symmetric,
    }

    /// Output of [`IntactStraining`].
    struct StrainingOutput {
        bond: IntactOutput,
        /// Elastic normal force, N.
        pressure: f64,
        /// Other forces that strain the particle, N.
        other: Vec3,
    }
}

/// Measures and evaluates unbroken bonds with equal parameters in columns.
struct Intact<'a, const DAMPED: bool> {
    bond: &'a LinearBond,
    dt: f64,
}

impl<const DAMPED: bool> Intact<'_, DAMPED> {
    /// Output and response for one bond. `surface_displacement` gives the sum of both particles' surface displacements
    /// along a normal, m.
    #[inline(always)]
    fn evaluate(
        &self,
        input: &IntactInput,
        surface_displacement: impl FnOnce(&Vec3) -> f64,
    ) -> (IntactOutput, Response<LinearBondState>) {
        let IntactInput { motion, reference: Reference { length: reference_length, area }, mass_a, mass_b, history } =
            *input;
        let FiniteInput { a, b, previous, .. } = motion;
        let (radius_a, radius_b) = (a.radius, b.radius);
        let geometry = ContactGeometry { reference_length, area, radius_a, radius_b, mass_a, mass_b };
        let viscosities = if DAMPED { self.bond.dashpots(&geometry) } else { (0.0, 0.0) };
        let point = motion.measure().point(&geometry, &previous, true);
        let point = point.with_surface_displacement(surface_displacement(&point.normal), f64::NAN);
        let (response, fails) = self.bond.intact(&point, &history, viscosities, self.dt);
        let (normal, force, energy) = (point.normal, response.force, response.energy);
        let output = IntactOutput {
            // A NaN reference length marks a contact that is not a bond.
            holds: if fails | reference_length.is_nan() { 0.0 } else { 1.0 },
            geometry: PreviousGeometry { normal, length: point.length },
            wrenches: Wrenches::of(&normal, &force, [point.arm_a, point.arm_b]),
            viscous: energy.viscous,
            integration: energy.integration,
            history: response.state,
        };
        (output, response)
    }
}

impl<const DAMPED: bool> Formula for Intact<'_, DAMPED> {
    type Input = IntactInput;
    type Output = IntactOutput;

    #[inline(always)]
    fn apply(&self, input: IntactInput) -> IntactOutput {
        self.evaluate(&input, |_| 0.0).0
    }
}

/// [`Intact`] for bonds between particles that deform.
struct IntactStraining<'a, const DAMPED: bool> {
    bond: &'a LinearBond,
    dt: f64,
    dashpots_strain: bool,
}

impl<const DAMPED: bool> Formula for IntactStraining<'_, DAMPED> {
    type Input = StrainingInput;
    type Output = StrainingOutput;

    #[inline(always)]
    fn apply(&self, input: StrainingInput) -> StrainingOutput {
        let intact = Intact::<DAMPED> { bond: self.bond, dt: self.dt };
        let (bond, Response { force, state, .. }) =
            intact.evaluate(&input.bond, |normal| input.surface_displacement.quadratic(normal));
        let normal = bond.geometry.normal;
        let viscous = LinearBond::viscous_force(&normal, &state);
        let ParticleVirial { pressure, other, .. } =
            ParticleVirial::of(&normal, &force, &viscous, self.dashpots_strain);
        StrainingOutput { bond, pressure, other }
    }
}

/// Results of all bonds of a batch; those that deform particles have virials.
struct Results<'a, const DEFORM: bool>(&'a mut <StrainingOutput as Item>::Arrays);

impl<const DEFORM: bool> ColumnResults<LinearBond> for Results<'_, DEFORM> {
    #[inline(always)]
    fn need_scalar_path<B: Batch<LinearBond>>(&self, i: usize, _batch: &B) -> bool {
        self.0.bond.holds[i] == 0.0
    }

    #[inline(always)]
    fn all_plain<B: Batch<LinearBond>>(&self, _batch: &B) -> bool {
        let mut hold = true;
        for holds in &self.0.bond.holds {
            hold &= *holds != 0.0;
        }
        hold
    }

    #[inline(always)]
    fn geometries(&mut self) -> &mut <PreviousGeometry as Item>::Arrays {
        &mut self.0.bond.geometry
    }

    #[inline(always)]
    fn histories(&mut self) -> Option<&mut <LinearBondState as Item>::Arrays> {
        Some(&mut self.0.bond.history)
    }

    #[inline(always)]
    fn wrenches(&self, i: usize, lanes: impl Lanes) -> [Wrenches; 4] {
        wrenches_of_four(&self.0.bond.wrenches, i, lanes)
    }

    #[inline(always)]
    fn result(&self, i: usize) -> impl ColumnResult {
        let Self(columns) = self;
        let bond = &columns.bond;
        let PreviousGeometry { normal, length } = bond.geometry.get(i);
        let virial =
            DEFORM.then(|| ParticleVirial { normal, pressure: columns.pressure.get(i), other: columns.other.get(i) });
        BatchResult {
            branch: BranchVector { length, normal },
            wrenches: bond.wrenches.get(i),
            energy: Some([bond.viscous.get(i), bond.integration.get(i)]),
            friction: None,
            virial,
        }
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
        let (response, fails) = self.intact(kinematics, old, self.dashpots(&kinematics.geometry), dt);
        if !fails && kinematics.bonded {
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
            status: Status::Broke,
            energy,
        }
    }

    /// Uses columns for bonds with equal parameters under the finite measure. Bonds that break then take the scalar
    /// path.
    #[inline(always)]
    fn respond_batch<B: Batch<Self>>(mode: MotionMeasure, count: usize, dt: f64, batch: &mut B, columns: &mut Columns) {
        let count = count.min(BATCH);
        if count == 0 {
            return;
        }
        let bond = *batch.law(0);
        // `evaluate_batch` covers steps with a sample, for rigid and deformable particles.
        if mode != MotionMeasure::Finite || B::SAMPLE || !batch.alike(count) {
            evaluate_batch(mode, count, dt, batch, columns);
            return;
        }
        let damped = bond.damping_ratio != 0.0;
        // The input for rigid particles is the beginning of the input for deformable ones.
        let arrays = columns.input::<StrainingInput>();
        let input = &mut arrays.bond;
        FiniteInput::write(&mut input.motion, count, batch);
        batch.read_histories(count, &mut input.history);
        batch.read_references(count, &mut input.reference);
        if !batch.all_bonded() {
            for i in 0..count {
                if !batch.bonded(i) {
                    input.reference.length[i] = f64::NAN;
                }
            }
        }
        if damped {
            batch.read_masses(count, [&mut input.mass_a, &mut input.mass_b]);
        }
        if B::DEFORM {
            for i in 0..count {
                arrays.surface_displacement.set(i, batch.surface_displacement(i));
            }
        }
        let dashpots_strain = B::DEFORM && batch.dashpots_strain();
        // Separate formulas, so that undamped bonds compute no square roots and rigid particles no strains.
        match (damped, B::DEFORM) {
            (false, false) => columns.apply(&Intact::<false> { bond: &bond, dt }),
            (true, false) => columns.apply(&Intact::<true> { bond: &bond, dt }),
            (false, true) => columns.apply(&IntactStraining::<false> { bond: &bond, dt, dashpots_strain }),
            (true, true) => columns.apply(&IntactStraining::<true> { bond: &bond, dt, dashpots_strain }),
        }
        if B::DEFORM {
            commit_columns(mode, count, dt, batch, &mut Results::<true>(columns.output_mut::<StrainingOutput>()));
        } else {
            commit_columns(mode, count, dt, batch, &mut Results::<false>(columns.output_mut::<StrainingOutput>()));
        }
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

/// Linear elastic bond with dashpots and brittle failure; after failure a contact with Coulomb friction.
#[cfg(feature = "std")]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "LinearBond", deny_unknown_fields)]
pub struct LinearBondTable {
    /// Normal stiffness of a bond, N/m.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub normal_stiffness: quantity::Stiffness,
    /// Shear stiffness of a bond, N/m.
    #[schemars(extend("minimum" = 0))]
    pub shear_stiffness: quantity::Stiffness,
    /// Dashpots as a fraction of critical damping.
    #[serde(default)]
    #[schemars(extend("minimum" = 0))]
    pub damping_ratio: Number,
    /// Tensile force at which a bond breaks, N; unbreakable if left out. Between two materials: the mean, or the only
    /// one given.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub normal_strength: Option<Force>,
    /// Shear force at which a bond breaks, N; unbreakable if left out. Between two materials: the mean, or the only one
    /// given.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub shear_strength: Option<Force>,
    /// Friction coefficient (tangent of the angle) after failure.
    #[serde(default)]
    #[schemars(extend("minimum" = 0))]
    pub friction_coefficient: Number,
    /// Whether a bond is unstressed at its length at bonding.
    #[serde(default = "yes")]
    pub subtract_initial_gap: bool,
}

#[cfg(feature = "std")]
fn yes() -> bool {
    true
}

#[cfg(feature = "std")]
impl LawTable for LinearBondTable {
    fn keys_of_bonds(&self) -> Vec<&'static str> {
        let keys = [
            ("normal_strength", self.normal_strength.is_some()),
            ("shear_strength", self.shear_strength.is_some()),
            ("subtract_initial_gap", !self.subtract_initial_gap),
        ];
        keys.into_iter().filter(|(_, given)| *given).map(|(key, _)| key).collect()
    }

    fn fault_of_variation(&self) -> Option<Fault> {
        None
    }

    fn fault_in_plane(&self) -> Option<Fault> {
        None
    }
}

#[cfg(feature = "std")]
impl LinearBondTable {
    /// The contact that replaces a broken bond: the same springs and dashpots, with friction.
    fn after_breaking(&self) -> FrictionalTable {
        FrictionalTable {
            young: None,
            stiffness_ratio: None,
            normal_stiffness: Some(self.normal_stiffness),
            shear_stiffness: Some(self.shear_stiffness),
            friction_coefficient: self.friction_coefficient,
            damping_ratio: self.damping_ratio,
        }
    }
}

#[cfg(feature = "std")]
impl RegisteredLaw for LinearBond {
    type Table = LinearBondTable;
    type Unbonded = Frictional;
    const TITLE: &'static str = "linear bond";
    const AS_BOND: Option<&'static str> = Some("Linear elastic bond, brittle; after failure a frictional contact.");
    const AS_CONTACT: Option<&'static str> = Some("Linear bond after failure: linear contact with friction.");

    fn row(a: &LinearBondTable, b: &LinearBondTable) -> Result<Self, ParameterError> {
        let mean = |of: fn(&LinearBondTable) -> f64| 0.5 * (of(a) + of(b));
        let strength =
            |of: fn(&LinearBondTable) -> Option<Force>| mean_strength(of(a).map(Force::si), of(b).map(Force::si));
        let mut bond = Self::new(
            mean(|t| t.normal_stiffness.si()),
            mean(|t| t.shear_stiffness.si()),
            mean(|t| t.damping_ratio.si()),
            strength(|t| t.normal_strength),
            strength(|t| t.shear_strength),
        )?;
        bond.subtract_initial_gap = a.subtract_initial_gap && b.subtract_initial_gap;
        Ok(bond)
    }

    fn unbonded_row(a: &LinearBondTable, b: &LinearBondTable) -> Result<Frictional, ParameterError> {
        Frictional::row(&a.after_breaking(), &b.after_breaking())
    }

    fn scaled(table: &LinearBondTable, factors: &Factors) -> Result<LinearBondTable, Fault> {
        factors.refuse_ductility()?;
        let has_strength = table.normal_strength.is_some() || table.shear_strength.is_some();
        factors.refuse_strength(has_strength, "`normal_strength` or `shear_strength`")?;
        Ok(LinearBondTable {
            normal_stiffness: times(table.normal_stiffness, factors.stiffness),
            shear_stiffness: times(table.shear_stiffness, factors.stiffness),
            normal_strength: table.normal_strength.map(|strength| times(strength, factors.strength)),
            shear_strength: table.shear_strength.map(|strength| times(strength, factors.strength)),
            ..table.clone()
        })
    }
}

#[cfg(test)]
#[path = "linear_bond_tests.rs"]
mod tests;
