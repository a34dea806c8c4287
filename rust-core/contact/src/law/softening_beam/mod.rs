//! Cohesive beam that softens: it dissipates a given fracture energy per area, whatever the size of the particles.
//!
//! The springs are those of the [`CohesiveBeam`]. A scalar damage `D` weakens all of them, but not the pressed normal spring:
//!
//! | | | |
//! |---|---|---|
//! | energy | `Ψ = (1−D) U⁺ + U⁻`, `U⁻` of a shortened normal spring, `U⁺` of all others | J |
//! | forces | the derivatives of `Ψ`: `1−D` times those of the cohesive beam; normal forces under pressure are whole | |
//! | unloading | to the origin: `D` stays | |
//!
//! **Onset.** With the stresses of the undamaged beam, `σ = N/S + β M r/I` and `τ = Q/S + β |T| r/I_O` (tension positive; symbols as in
//! [`cohesive_beam`](super::cohesive_beam)), the stress ratio is
//!
//! `λ² = (⟨σ⟩/σ_f)² + (τ/τ_f)²`, `τ_f = c + ⟨−N/S⟩ tan φ`,
//!
//! the quadratic criterion of mixed modes (Camanho and Dávila 2002, NASA/TM-2002-211737, (10)). A beam without a cohesion has the ratio of
//! its largest principal stress, `λ = σ_max/σ_f`. Damage begins at λ = 1.
//!
//! **Softening.** Where all deformations grow in proportion, `U⁺ = λ² U₁`, with the energy `U₁` at onset. With the energy that the area `S`
//! shall dissipate, `g = G_c S/U₁`, the force falls over λ as
//!
//! | | | |
//! |---|---|---|
//! | linear | `(1−D) λ = (g−λ)/(g−1)` | broken at λ = g |
//! | exponential | `(1−D) λ = exp(−(λ−1)/a)`, `a = (g−1)/2(1−ρ)` | broken at `ρ` = 0.001 of the force |
//!
//! and the work until it has broken is `G_c S` in both. The damage never falls. If `g ≤ 1`, the beam stores more than it shall dissipate:
//! no softening can be that steep, and it breaks at once. Beams in tension do so beyond the length `2 E G_I/σ_f²`
//! ([`ContactLaw::longest_bond`]).
//!
//! **Mixed modes** (Benzeggagh and Kenane 1996): `G_c = G_I + (G_II − G_I) m^η`, with the share `m` of shear and twist in `U⁺`.
//!
//! The energy dissipated in a step is `√(U⁺_old U⁺) ΔD`, the difference of the trapezoidal work and the stored energy on a proportional
//! path. Friction of the damaged part under pressure is left out until the beam has broken and the contact law takes over.

#[cfg(feature = "std")]
mod table;
#[cfg(test)]
mod tests;

#[cfg(feature = "std")]
pub use table::SofteningBeamTable;

use super::cohesive_beam::{BeamResponse, SectionStresses, beam_response};
use super::common::{ParameterError, require};
use super::{
    BeamStiffness, CohesiveBeam, ColumnUse, ContactGeometry, ContactLaw, EnergySplit, Given, Reference, Response,
    Status, Stiffness, TemperatureFactors,
};
use crate::kinematics::bond_frame::across;
use crate::kinematics::{BranchVector, EndLoads, FrameKinematics, MotionMeasure, RestFrame};
use crate::math;
#[cfg(not(feature = "std"))]
use crate::math::Real as _;
use crate::math::{Vec3, is_zero, norm};

/// Force over the strength at which a beam with exponential softening has broken, 1.
const LAST_FORCE: f64 = 1e-3;

/// How the force falls over the deformation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(
    feature = "std",
    derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema),
    serde(rename_all = "kebab-case")
)]
#[repr(C)]
pub enum Softening {
    /// In proportion.
    #[default]
    Linear,
    /// Exponentially, to a thousandth of the strength.
    Exponential,
}

/// Energies that break a beam, per area.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct BeamFractureEnergy {
    /// In tension and bending, `G_I`, J/m².
    pub tension: f64,
    /// In shear and twist, `G_II`, J/m².
    pub shear: f64,
    /// Exponent η of the mixture, 1.
    pub exponent: f64,
}

impl BeamFractureEnergy {
    /// At the share `shear` of shear and twist in the elastic energy, J/m².
    #[inline(always)]
    fn at(&self, shear: f64) -> f64 {
        self.tension + (self.shear - self.tension) * math::pow(shear, self.exponent)
    }
}

/// Parameters of a softening beam.
///
/// ```
/// use concordem_contact::law::{BeamFractureEnergy, CohesiveBeam, ContactLaw, Section, Softening, SofteningBeam};
///
/// let beam = CohesiveBeam { strength: 10e6, ..CohesiveBeam::new(30e9, 0.2, Section::Radius(1e-3)).unwrap() };
/// let energy = BeamFractureEnergy { tension: 50.0, shear: 500.0, exponent: 1.0 };
/// let law = SofteningBeam::new(beam, energy, Softening::Linear).unwrap();
/// // Longer beams would store more than 50 J/m² at 10 MPa.
/// assert!((law.longest_bond() - 0.03).abs() < 1e-15);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct SofteningBeam {
    /// The springs, and the stresses at which damage begins.
    pub beam: CohesiveBeam,
    /// What the beam dissipates until it has broken.
    pub energy: BeamFractureEnergy,
    /// How it softens.
    pub softening: Softening,
}

crate::law_state! {
    /// History of a [`SofteningBeam`].
    pub struct SofteningBeamState {
        /// Direction of the unloaded bond in the axes half way between those of the bodies.
        rest_direction: Vec3, "1", Odd;
        /// Vector part of the rotation from either body to these axes.
        rest_rotation: Vec3, "1", Odd;
        /// Damage `D`: lost part of the stiffness.
        stiffness_loss: f64, "1", Even;
        /// Energy that the undamaged springs, but a pressed normal one, would store; 0 before damage begins.
        undamaged_energy: f64, "J", Even;
        /// Energy dissipated so far.
        dissipated: f64, "J", Even;
    }
}

/// What drives the damage of a beam.
struct Drive {
    /// Stress ratio λ squared, 1.
    ratio_squared: f64,
    /// Whether most of it comes from shear.
    in_shear: bool,
    /// Energy `U⁺`, J.
    energy: f64,
    /// Share of shear and twist in it, 1.
    shear: f64,
}

impl SofteningBeam {
    /// A beam that breaks by these energies.
    pub fn new(beam: CohesiveBeam, energy: BeamFractureEnergy, softening: Softening) -> Result<Self, ParameterError> {
        let law = Self { beam, energy, softening };
        law.validate()?;
        Ok(law)
    }

    /// Check that all parameters are in their ranges.
    pub fn validate(&self) -> Result<(), ParameterError> {
        self.beam.validate()?;
        let BeamFractureEnergy { tension, shear, exponent } = self.energy;
        let positive = |value: f64| value > 0.0 && value.is_finite();
        require(positive(tension), Self::NAME, "fracture_energy", tension, "positive and finite (J/m²)")?;
        require(positive(shear), Self::NAME, "shear_fracture_energy", shear, "positive and finite (J/m²)")?;
        require(positive(exponent), Self::NAME, "mixture_exponent", exponent, "positive and finite")
    }

    /// Parts of the squared stress ratio λ² of an undamaged beam under these loads: of tension, and of shear.
    #[inline(always)]
    fn ratio_squared(&self, area: f64, stresses: &SectionStresses, branch: &Vec3, force: &Vec3) -> [f64; 2] {
        let CohesiveBeam { strength, shear, .. } = &self.beam;
        if shear.is_given() {
            let share = shear.moment_share;
            let tension = (stresses.normal + share * stresses.bending).max(0.0) / strength;
            let sheared = norm(&across(branch, *force)) / area + share * stresses.torsion.abs();
            let sheared = sheared / shear.limit(stresses.normal.min(0.0));
            [tension * tension, sheared * sheared]
        } else {
            let ratio = stresses.principal() / strength;
            [ratio * ratio, 0.0]
        }
    }

    #[inline(always)]
    fn drive(&self, area: f64, branch: &Vec3, intact: &BeamResponse) -> Drive {
        let BeamResponse { forces, axial, stored: [normal, shear, bending, twist] } = intact;
        let moment = self.beam.bending(branch, forces);
        let stresses = SectionStresses::of(area, *axial, branch, forces, moment);
        let sheared = shear + twist;
        let energy = sheared + bending + if *axial > 0.0 { *normal } else { 0.0 };
        let share = if energy > 0.0 { sheared / energy } else { 0.0 };
        let [tension, in_shear] = self.ratio_squared(area, &stresses, branch, &forces.force);
        Drive { ratio_squared: tension + in_shear, in_shear: in_shear > tension, energy, shear: share }
    }

    /// Damage at the stress ratio `ratio` above 1; 1 if the beam has broken.
    #[inline(always)]
    fn damage_at(&self, area: f64, ratio: f64, drive: &Drive) -> f64 {
        let energy = self.energy.at(drive.shear) * area * drive.ratio_squared / drive.energy;
        // Also where nothing is stored, as in springs of no stiffness.
        if energy <= 1.0 || energy.is_nan() {
            return 1.0;
        }
        match self.softening {
            Softening::Linear if ratio >= energy => 1.0,
            Softening::Linear => energy * (ratio - 1.0) / (ratio * (energy - 1.0)),
            Softening::Exponential => {
                let scale = (energy - 1.0) / (2.0 * (1.0 - LAST_FORCE));
                let force = math::exp((1.0 - ratio) / scale);
                if force > LAST_FORCE { 1.0 - force / ratio } else { 1.0 }
            }
        }
    }
}

/// Stiffnesses of the springs at a damage; a pressed normal spring (`axial` force negative) keeps its own.
#[inline(always)]
fn weakened(k: &BeamStiffness, damage: f64, axial: f64) -> BeamStiffness {
    let left = 1.0 - damage;
    let normal = if axial > 0.0 { k.normal * left } else { k.normal };
    BeamStiffness { normal, shear: k.shear * left, bending: k.bending * left, twist: k.twist * left }
}

impl ContactLaw for SofteningBeam {
    type State = SofteningBeamState;
    type Kinematics = FrameKinematics;
    const NAME: &'static str = "softening_beam";
    const VARIES: bool = true;

    /// Fracture energies stay.
    fn at_temperature(&self, factors: &TemperatureFactors) -> Self {
        Self { beam: self.beam.at_temperature(factors), ..*self }
    }

    #[inline(always)]
    fn respond(
        &self,
        kinematics: &FrameKinematics,
        old: &SofteningBeamState,
        _dt: f64,
    ) -> Response<SofteningBeamState> {
        let point = &kinematics.point;
        let rest = if is_zero(&old.rest_direction) {
            kinematics.rest()
        } else {
            RestFrame { direction: old.rest_direction, rotation: old.rest_rotation }
        };
        let (area, reference) = (point.geometry.area, point.geometry.reference_length);
        let branch = BranchVector { length: point.length, normal: point.normal };
        let rotations = kinematics.rotations(&rest);
        let k = self.beam.stiffnesses(&point.geometry);
        let intact = beam_response(&k, reference, &branch, &rotations);
        let drive = self.drive(area, &point.normal, &intact);
        let ratio = drive.ratio_squared.sqrt();
        let damage =
            if ratio > 1.0 { self.damage_at(area, ratio, &drive).max(old.stiffness_loss) } else { old.stiffness_loss };
        let breaks = damage >= 1.0 || rotations.turned_too_far() || !point.bonded;
        let acting = if breaks { old.stiffness_loss } else { damage };
        // `(1−0) k` has the bits of `k`.
        let BeamResponse { forces, stored, .. } =
            beam_response(&weakened(&k, acting, intact.axial), reference, &branch, &rotations);
        let [stored_normal, stored_shear, stored_bending, stored_twist] = stored;
        let mut energy =
            EnergySplit { stored_normal, stored_shear, stored_bending, stored_twist, ..EnergySplit::default() };
        // The normal spring has a kink where the crack closes.
        let (now, before) = (point.length - reference, point.length_old - reference);
        let closing = before.min(0.0) * now.max(0.0) - now.min(0.0) * before.max(0.0);
        energy.integration = 0.5 * acting * k.normal * closing;
        let EndLoads { force, moment_a, moment_b } = forces;
        let mut state = SofteningBeamState { rest_direction: rest.direction, rest_rotation: rest.rotation, ..*old };
        if breaks {
            // As in the cohesive beam: the forces of this step are void, and their half of its work was not done.
            energy.damage = energy.stored();
            let void = 0.5 * kinematics.work(&force, &moment_a, &moment_b);
            energy.integration -= void;
            state.dissipated += energy.damage - void;
            let status = if drive.in_shear { Status::BrokeInShear } else { Status::Broke };
            return Response { force: Vec3::zeros(), moment: Vec3::zeros(), state, status, energy };
        }
        if damage > old.stiffness_loss {
            // Before its onset: the energy at the strength.
            let onset = drive.energy / drive.ratio_squared;
            let before = if old.stiffness_loss > 0.0 { old.undamaged_energy } else { onset };
            energy.damage = (before * drive.energy).sqrt() * (damage - old.stiffness_loss);
            state.dissipated += energy.damage;
            state.stiffness_loss = damage;
        }
        if damage > 0.0 {
            state.undamaged_energy = drive.energy;
        }
        Response { force, moment: forces.moment(), state, status: Status::Lives, energy }
    }

    const COLUMNS: Option<ColumnUse> = Some(ColumnUse {
        // The rotation of the rest frame, zero where the orientations did not differ at bonding.
        optional: 3,
        ..ColumnUse::ELASTIC
    });

    /// Undamaged beams whose ends have turned little, below their strength.
    #[inline(always)]
    fn straight(
        &self,
        kinematics: &FrameKinematics,
        old: &SofteningBeamState,
        given: &Given,
        _dt: f64,
    ) -> (Response<SofteningBeamState>, bool) {
        let FrameKinematics { point, orientation_a, orientation_b, .. } = kinematics;
        let rest = RestFrame { direction: old.rest_direction, rotation: old.rest_rotation };
        let branch = BranchVector { length: point.length, normal: point.normal };
        let (rotations, small) = branch.small_rotations([*orientation_a, *orientation_b], &rest, !given.reduced);
        let k = self.beam.stiffnesses_of_beam(&point.geometry, self.beam.shear_coefficient());
        let BeamResponse { forces, axial, .. } =
            beam_response(&k, point.geometry.reference_length, &branch, &rotations);
        let area = point.geometry.area;
        let stresses = SectionStresses::of(area, axial, &branch.normal, &forces, forces.bending(&branch.normal));
        let [tension, sheared] = self.ratio_squared(area, &stresses, &branch.normal, &forces.force);
        let holds = tension + sheared < 1.0;
        let undamaged = old.stiffness_loss == 0.0;
        let known = rest.direction.norm_squared() > 0.0;
        let response = Response { moment: forces.moment(), ..Response::of_force(forces.force, *old) };
        (response, holds & undamaged & small & known & point.bonded)
    }

    #[inline(always)]
    fn is_straight(&self, measure: MotionMeasure) -> bool {
        self.beam.is_straight(measure)
    }

    /// The springs at the damage of the history.
    fn last_force(&self, still: &FrameKinematics, state: &SofteningBeamState) -> (Vec3, Vec3) {
        let rest = RestFrame { direction: state.rest_direction, rotation: state.rest_rotation };
        let (geometry, length) = (&still.point.geometry, still.point.length);
        let k = weakened(&self.beam.stiffnesses(geometry), state.stiffness_loss, length - geometry.reference_length);
        let branch = BranchVector { length, normal: still.point.normal };
        let forces = beam_response(&k, geometry.reference_length, &branch, &still.rotations(&rest)).forces;
        (forces.force, forces.moment())
    }

    fn stiffness(&self, geometry: &ContactGeometry) -> Stiffness {
        self.beam.stiffness(geometry)
    }

    fn kept_reference(&self, reference: Reference) -> Option<Reference> {
        self.beam.kept_reference(reference)
    }

    fn bonded_area(&self, radius_a: f64, radius_b: f64, mean_radius: f64) -> f64 {
        self.beam.bonded_area(radius_a, radius_b, mean_radius)
    }

    fn damage(state: &SofteningBeamState) -> f64 {
        state.stiffness_loss
    }

    /// All that the beam has dissipated, and the shares of what it stores.
    #[inline(always)]
    fn event(response: &Response<SofteningBeamState>) -> (f64, [f64; 4], bool) {
        let EnergySplit { stored_normal, stored_shear, stored_bending, stored_twist, .. } = response.energy;
        let stored = [stored_normal, stored_shear, stored_bending, stored_twist];
        let mostly_shear = stored_shear + stored_twist > stored_normal + stored_bending;
        let in_shear = if response.status.is_broken() { response.status == Status::BrokeInShear } else { mostly_shear };
        (response.state.dissipated, stored, in_shear)
    }

    /// Where a beam in tension stores its fracture energy at its strength.
    fn longest_bond(&self) -> f64 {
        let CohesiveBeam { young, strength, .. } = self.beam;
        if strength.is_finite() { 2.0 * young * self.energy.tension / (strength * strength) } else { f64::INFINITY }
    }
}
