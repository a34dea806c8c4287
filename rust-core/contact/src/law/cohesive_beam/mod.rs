//! Cohesive beam: a massless elastic cylinder between the centers of two particles, brittle (Jebahi, André, Terreros,
//! Iordanoff 2015, "Discrete element method to model 3D continuous materials", sections 2.4.1 and 4.2.1). The signs of
//! [2.9], [2.11], [2.12] are corrected: with the printed ones, forces and moments do not balance.
//!
//! With the unit branch vector `X`, its length `l`, the reference length `l₀`, the elongation `Δl`, the end rotations
//! `θ` and the twist `τ` of [`bond_frame`](crate::kinematics::bond_frame), the section `S = πr²`, `I = πr⁴/4`,
//! `I_O = 2I`, and `G = E/2(1+ν)`:
//!
//! | | | |
//! |---|---|---|
//! | energy | `U = ½k_n Δl² + ½k_s (½l₀)²‖θ_A+θ_B‖² + ½k_b ‖θ_B−θ_A‖² + ½k_t τ²` | J |
//! | stiffnesses | `k_n = ES/l₀`, `k_s = 12EI/l₀³(1+Φ)`, `k_b = EI/l₀`, `k_t = GI_O/l₀` | |
//! | Euler-Bernoulli | `Φ = 0`: `U` is `½(ES/l₀)Δl² + (2EI/l₀)(θ_A²+θ_A·θ_B+θ_B²) + ½(GI_O/l₀)τ²` | |
//! | Timoshenko | `Φ = 12EI/(κGS l₀²)`, κ the shear coefficient | |
//! | dual spring | `k_s = ratio·k_n`, `k_b = k_t = 0` | |
//! | spring | `k_s = k_b = k_t = 0` | |
//!
//! Forces are the exact derivatives of `U`, so a bond conserves energy at rotations of any size. For rotations in one
//! plane, and to first order for all others, they are the four formulas of the source with corrected signs,
//!
//! `F_A = k_n Δl X − (6EI/l₀l)[(θ_Az+θ_Bz)Y − (θ_Ay+θ_By)Z]`,
//! `M_A = k_t τ X − (2EI/l₀)(2θ_A+θ_B)`, `M_B = −k_t τ X − (2EI/l₀)(θ_A+2θ_B)`, `F_B = −F_A`
//!
//! with moments about the centers. The source assumes small strain and has a single length. Here the shear force
//! contains the present length `l`, because moments balance at the present branch vector: `M_A + M_B = l X × F_A`.
//!
//! **Failure** (Rankine, [4.1]–[4.3]): `σ_max = ½(σ_n + √(σ_n²+4τ²)) ≥ σ_f` breaks the beam, with
//! `σ_n = k_n Δl/S + M r/I` and `τ = (r/I_O)·½(M_A−M_B)·X`. [4.2] prints `M = ½‖M_A+M_B‖`, which is zero for a beam
//! bent to a circle; [`BendingTerm`] selects the interpretation. A beam that particle-level failure has released (no
//! longer bonded; see `fracture::virial` of the solver) breaks at its next evaluation. A beam also breaks, whatever its
//! strength, if its twist or an end rotation exceeds 3 rad: orientations are unique up to half a turn, π, beyond which
//! the moment would change its sign. The stored energy is released as damage.
//!
//! **Failure of rock** (a [`ShearStrength`] with a finite cohesion; Potyondy and Cundall 2004, "A bonded-particle model for rock"): the
//! beam breaks in tension at `N/S + β M r/I ≥ σ_f`, or in shear at `Q/S + β |T| r/I_O ≥ c − (N/S) tan φ`, with the normal force `N`
//! (tension positive), the shear force `Q`, the bending moment `M`, the twisting moment `T`, and the share β of the moments (Potyondy
//! 2011).

#[cfg(feature = "std")]
pub(crate) mod table;
#[cfg(test)]
mod tests;

#[cfg(feature = "std")]
pub use table::{BeamKind, CohesiveBeamTable, RadiusRule};

use core::f64::consts::{FRAC_2_SQRT_PI, PI};

use super::common::{ParameterError, require};
use super::{
    ColumnUse, ContactGeometry, ContactLaw, EnergySplit, Given, Reference, Response, Status, Stiffness,
    TemperatureFactors,
};
use crate::kinematics::bond_frame::across;
use crate::kinematics::{BranchVector, EndLoads, EndRotations, FrameKinematics, MotionMeasure, RestFrame};
#[cfg(not(feature = "std"))]
use crate::math::Real as _;
use crate::math::{Vec3, is_zero, norm};

/// Deformations that the bond resists.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub enum BeamModel {
    /// Slender beam: sections stay normal to the axis.
    EulerBernoulli,
    /// Beam with shear deformation.
    Timoshenko {
        /// Shear coefficient κ of the section, 1 (circle: 0.9, or `6(1+ν)/(7+6ν)`; infinite: Euler-Bernoulli).
        shear_coefficient: f64,
    },
    /// Normal and tangential spring without moments of its own.
    DualSpring {
        /// Tangential over normal stiffness, 1.
        ratio: f64,
    },
    /// Normal spring only.
    Spring,
}

/// Bending moment in the failure criterion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(
    feature = "std",
    derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema),
    serde(rename_all = "kebab-case")
)]
#[repr(C)]
pub enum BendingTerm {
    /// At the middle section, `½‖(M_A−M_B)_⊥‖`.
    #[default]
    MidSection,
    /// `½‖M_A+M_B‖`, as Jebahi et al. 2015 print it (4.2): only the part from the shear force.
    HalfSum,
    /// At the end with the larger moment, `max(‖M_A⊥‖, ‖M_B⊥‖)`.
    LargerEnd,
}

/// Radius of the section.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub enum Section {
    /// Radius over the mean radius of all bonded particles, r̃; every bond gets the same radius ([2.22] ff.).
    Ratio(f64),
    /// Radius over a radius of the two particles, as in bonded-particle models (λ̄ of Potyondy and Cundall 2004, with the smaller one).
    RatioOfPair {
        /// Radius of the beam over that radius, 1.
        ratio: f64,
        /// Which radius.
        radius: PairRadius,
    },
    /// Radius, m.
    Radius(f64),
}

/// A radius of two particles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub enum PairRadius {
    /// `min(r_A, r_B)`.
    Smaller,
    /// `½(r_A + r_B)`.
    Mean,
    /// `2 r_A r_B/(r_A + r_B)`.
    HarmonicMean,
}

impl PairRadius {
    /// Its value of `radius_rule`.
    pub fn key(self) -> &'static str {
        match self {
            Self::Smaller => "smaller",
            Self::Mean => "mean",
            Self::HarmonicMean => "harmonic-mean",
        }
    }

    /// Its value for particles of the radii `a` and `b`, m.
    pub fn of(self, a: f64, b: f64) -> f64 {
        match self {
            Self::Smaller => a.min(b),
            Self::Mean => 0.5 * (a + b),
            Self::HarmonicMean => 2.0 * (a * b) / (a + b),
        }
    }
}

/// Strength in shear by Mohr and Coulomb.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct ShearStrength {
    /// Cohesion `c`, Pa; infinite: the beam has none, and breaks at its largest principal stress.
    pub cohesion: f64,
    /// Tangent of the angle of friction φ, 1.
    pub friction_coefficient: f64,
    /// Share β of bending and twisting moments in the stresses, from 0 (mean over the section) to 1 (extreme fiber).
    pub moment_share: f64,
}

impl Default for ShearStrength {
    fn default() -> Self {
        Self { cohesion: f64::INFINITY, friction_coefficient: 0.0, moment_share: 1.0 }
    }
}

impl ShearStrength {
    /// Whether it decides when a beam breaks.
    #[inline(always)]
    pub fn is_given(&self) -> bool {
        self.cohesion.is_finite()
    }

    /// Largest shear stress under the mean normal stress `normal` (Pa, tension positive), Pa.
    #[inline(always)]
    pub fn limit(&self, normal: f64) -> f64 {
        self.cohesion - self.friction_coefficient * normal
    }
}

/// Parameters of a beam.
///
/// ```
/// use concordem_contact::law::{CohesiveBeam, ContactGeometry, ContactLaw, Section};
///
/// let glass = CohesiveBeam::new(70e9, 0.3, Section::Radius(0.5e-3)).unwrap();
/// // Two spheres of radius 1 mm touch; the area of a beam belongs to its section.
/// let area = std::f64::consts::PI * 0.25e-6;
/// let geometry =
///     ContactGeometry { reference_length: 2e-3, area, radius_a: 1e-3, radius_b: 1e-3, mass_a: 1e-5, mass_b: 1e-5 };
/// let stiffness = glass.stiffness(&geometry);
/// assert!((stiffness.normal / (70e9 * area / 2e-3) - 1.0).abs() < 1e-12);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct CohesiveBeam {
    /// Young's modulus `E_μ` of the beam, Pa.
    pub young: f64,
    /// Poisson's ratio `ν_μ` of the beam, 1; affects only the stiffness in twist (and in shear, for Timoshenko).
    pub poisson: f64,
    /// Radius of the section. [`ContactGeometry::area`] of a bond is `πr²`.
    pub section: Section,
    /// Deformations that the beam resists.
    pub model: BeamModel,
    /// Tensile strength `σ_f`, Pa; infinite for a beam that never breaks.
    pub strength: f64,
    /// Bending moment in the criterion.
    pub bending_term: BendingTerm,
    /// Strength in shear.
    pub shear: ShearStrength,
}

crate::law_state! {
    /// History of a [`CohesiveBeam`]: its unloaded state, see [`RestFrame`]. All zero before the first evaluation, which
    /// defines it.
    pub struct CohesiveBeamState {
        /// Direction of the unloaded bond in the axes half way between those of the bodies.
        rest_direction: Vec3, "1", Odd;
        /// Vector part of the rotation from either body to these axes.
        rest_rotation: Vec3, "1", Odd;
    }
}

/// Stiffnesses of a bond, for elongation, shear, bending, and twist about its middle section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeamStiffness {
    /// Normal stiffness `k_n`, N/m.
    pub normal: f64,
    /// Shear stiffness `k_s`, N/m.
    pub shear: f64,
    /// Bending stiffness `k_b`, N·m/rad.
    pub bending: f64,
    /// Twist stiffness `k_t`, N·m/rad.
    pub twist: f64,
}

impl CohesiveBeam {
    /// An unbreakable Euler-Bernoulli beam with the given modulus (Pa), Poisson's ratio, and section.
    pub fn new(young: f64, poisson: f64, section: Section) -> Result<Self, ParameterError> {
        let beam = Self {
            young,
            poisson,
            section,
            model: BeamModel::EulerBernoulli,
            strength: f64::INFINITY,
            bending_term: BendingTerm::default(),
            shear: ShearStrength::default(),
        };
        beam.validate()?;
        Ok(beam)
    }

    /// Check that all parameters are in their ranges.
    pub fn validate(&self) -> Result<(), ParameterError> {
        let positive = |value: f64| value > 0.0 && value.is_finite();
        require(positive(self.young), Self::NAME, "young", self.young, "positive and finite (Pa)")?;
        let poisson = self.poisson;
        require(poisson > -1.0 && poisson <= 0.5, Self::NAME, "poisson", poisson, "above -1 and at most 0.5")?;
        match self.section {
            Section::Ratio(ratio) | Section::RatioOfPair { ratio, .. } => {
                require(positive(ratio), Self::NAME, "radius_ratio", ratio, "positive and finite")?;
            }
            Section::Radius(radius) => {
                require(positive(radius), Self::NAME, "radius", radius, "positive and finite (m)")?;
            }
        }
        match self.model {
            BeamModel::Timoshenko { shear_coefficient: kappa } => {
                require(kappa > 0.0, Self::NAME, "shear_coefficient", kappa, "positive")?;
            }
            BeamModel::DualSpring { ratio } => {
                require(ratio >= 0.0 && ratio.is_finite(), Self::NAME, "shear_ratio", ratio, "finite, not negative")?;
            }
            BeamModel::EulerBernoulli | BeamModel::Spring => {}
        }
        let ShearStrength { cohesion, friction_coefficient, moment_share } = self.shear;
        require(cohesion > 0.0, Self::NAME, "cohesion", cohesion, "positive (Pa; inf for none)")?;
        let friction = friction_coefficient;
        require(
            friction >= 0.0 && friction.is_finite(),
            Self::NAME,
            "friction_coefficient",
            friction,
            "finite, not negative",
        )?;
        require((0.0..=1.0).contains(&moment_share), Self::NAME, "moment_share", moment_share, "from 0 to 1")?;
        require(
            self.strength > 0.0,
            Self::NAME,
            "tensile_strength",
            self.strength,
            "positive (Pa; inf for unbreakable)",
        )
    }

    /// Stiffnesses of a bond of the given reference length and area.
    #[inline(always)]
    pub fn stiffnesses(&self, geometry: &ContactGeometry) -> BeamStiffness {
        match self.model {
            BeamModel::EulerBernoulli => self.stiffnesses_of_beam(geometry, f64::INFINITY),
            BeamModel::Timoshenko { shear_coefficient } => self.stiffnesses_of_beam(geometry, shear_coefficient),
            BeamModel::DualSpring { ratio } => {
                let normal = self.young / geometry.reference_length * geometry.area;
                BeamStiffness { normal, shear: ratio * normal, bending: 0.0, twist: 0.0 }
            }
            BeamModel::Spring => {
                let normal = self.young / geometry.reference_length * geometry.area;
                BeamStiffness { normal, shear: 0.0, bending: 0.0, twist: 0.0 }
            }
        }
    }

    /// Shear coefficient of a Timoshenko beam; infinite for all others.
    #[inline(always)]
    pub(in crate::law) fn shear_coefficient(&self) -> f64 {
        if let BeamModel::Timoshenko { shear_coefficient } = self.model { shear_coefficient } else { f64::INFINITY }
    }

    /// Stiffnesses of a Timoshenko beam; an infinite shear coefficient gives the Euler-Bernoulli beam to the last bit.
    #[inline(always)]
    pub(in crate::law) fn stiffnesses_of_beam(
        &self,
        geometry: &ContactGeometry,
        shear_coefficient: f64,
    ) -> BeamStiffness {
        let (area, inverse) = (geometry.area, 1.0 / geometry.reference_length);
        let per_length = self.young * inverse;
        let normal = per_length * area;
        // I = S²/4π
        let bending = per_length * (area * area) * (1.0 / (4.0 * PI));
        let inverse_squared = inverse * inverse;
        let slender = 12.0 * bending * inverse_squared;
        // Φ = 12EI/κGSl², G = E/2(1+ν)
        let phi = 6.0 * (1.0 + self.poisson) / (PI * shear_coefficient) * (area * inverse_squared);
        // G I_O/l = E/2(1+ν)·2I/l
        let twist = bending * (1.0 / (1.0 + self.poisson));
        BeamStiffness { normal, shear: slender / (1.0 + phi), bending, twist }
    }

    /// Maximal principal stress on the surface of the beam, Pa, by [4.1]–[4.3] with the chosen [`BendingTerm`]; `axial`
    /// is the normal force, N, `branch` the unit branch vector.
    #[inline(always)]
    pub fn rankine_stress(&self, area: f64, axial: f64, branch: &Vec3, forces: &EndLoads) -> f64 {
        let bending = self.bending(branch, forces);
        SectionStresses::of(area, axial, branch, forces, bending).principal()
    }

    /// The bending moment of the criterion, N·m.
    #[inline(always)]
    pub(in crate::law) fn bending(&self, branch: &Vec3, forces: &EndLoads) -> f64 {
        match self.bending_term {
            BendingTerm::MidSection => forces.bending(branch),
            BendingTerm::HalfSum => 0.5 * norm(&(forces.moment_a + forces.moment_b)),
            BendingTerm::LargerEnd => {
                norm(&across(branch, forces.moment_a)).max(norm(&across(branch, forces.moment_b)))
            }
        }
    }

    /// Whether these stresses and this force (N) break the beam: in tension, and in shear.
    #[inline(always)]
    fn breaks(&self, area: f64, stresses: &SectionStresses, branch: &Vec3, force: &Vec3) -> [bool; 2] {
        if self.shear.is_given() {
            let share = self.shear.moment_share;
            let tension = stresses.normal + share * stresses.bending;
            let shear = norm(&across(branch, *force)) / area + share * stresses.torsion.abs();
            [tension >= self.strength, shear >= self.shear.limit(stresses.normal)]
        } else {
            [stresses.principal() >= self.strength, false]
        }
    }
}

/// Stresses in the section of a beam, Pa.
pub(in crate::law) struct SectionStresses {
    /// Mean normal stress, tension positive.
    pub(in crate::law) normal: f64,
    /// Of bending, in the extreme fiber.
    pub(in crate::law) bending: f64,
    /// Of twist, in the extreme fiber.
    pub(in crate::law) torsion: f64,
}

impl SectionStresses {
    #[inline(always)]
    pub(in crate::law) fn of(area: f64, axial: f64, branch: &Vec3, forces: &EndLoads, bending: f64) -> Self {
        let torsion = 0.5 * (forces.moment_a - forces.moment_b).dot(branch);
        let inverse = 1.0 / area;
        // r/I = 4πr/S² = 4√π S^(−3/2), and half of it for I_O.
        let by_section = (8.0 / FRAC_2_SQRT_PI) * (inverse * inverse.sqrt());
        Self { normal: axial * inverse, bending: bending * by_section, torsion: 0.5 * by_section * torsion }
    }

    /// The largest principal stress.
    #[inline(always)]
    pub(in crate::law) fn principal(&self) -> f64 {
        let normal = self.normal + self.bending;
        0.5 * (normal + (normal * normal + 4.0 * self.torsion * self.torsion).sqrt())
    }
}

/// Forces and energies of an unbroken beam.
pub(in crate::law) struct BeamResponse {
    pub(in crate::law) forces: EndLoads,
    /// Normal force, N.
    pub(in crate::law) axial: f64,
    /// Energy stored by elongation, shear, bending, twist, J.
    pub(in crate::law) stored: [f64; 4],
}

#[inline(always)]
pub(in crate::law) fn beam_response(
    k: &BeamStiffness,
    reference_length: f64,
    branch: &BranchVector,
    rotations: &EndRotations,
) -> BeamResponse {
    let elongation = branch.length - reference_length;
    let half_length = 0.5 * reference_length;
    let sum = rotations.a + rotations.b;
    let difference = rotations.b - rotations.a;
    let by_shear = k.shear * (half_length * half_length);
    let (from_shear, from_bending) = (sum * by_shear, difference * k.bending);
    let axial = k.normal * elongation;
    let by_ends = [from_shear - from_bending, from_shear + from_bending];
    let forces = rotations.loads(branch.length, axial, by_ends, k.twist * rotations.twist);
    let stored = [
        0.5 * axial * elongation,
        0.5 * by_shear * sum.norm_squared(),
        0.5 * from_bending.dot(&difference),
        0.5 * k.twist * (rotations.twist * rotations.twist),
    ];
    BeamResponse { forces, axial, stored }
}

impl ContactLaw for CohesiveBeam {
    type State = CohesiveBeamState;
    type Kinematics = FrameKinematics;
    const NAME: &'static str = "cohesive_beam";
    const VARIES: bool = true;

    fn at_temperature(&self, factors: &TemperatureFactors) -> Self {
        let shear = ShearStrength { cohesion: self.shear.cohesion * factors.strength, ..self.shear };
        Self { young: self.young * factors.stiffness, strength: self.strength * factors.strength, shear, ..*self }
    }

    #[inline(always)]
    fn respond(&self, kinematics: &FrameKinematics, old: &CohesiveBeamState, _dt: f64) -> Response<CohesiveBeamState> {
        let point = &kinematics.point;
        let rest = if is_zero(&old.rest_direction) {
            kinematics.rest()
        } else {
            RestFrame { direction: old.rest_direction, rotation: old.rest_rotation }
        };
        let (geometry, branch) = (&point.geometry, BranchVector { length: point.length, normal: point.normal });
        let rotations = kinematics.rotations(&rest);
        let BeamResponse { forces, axial, stored } =
            beam_response(&self.stiffnesses(geometry), geometry.reference_length, &branch, &rotations);
        let EndLoads { force, moment_a, moment_b } = forces;
        let [stored_normal, stored_shear, stored_bending, stored_twist] = stored;
        let mut energy =
            EnergySplit { stored_normal, stored_shear, stored_bending, stored_twist, ..EnergySplit::default() };
        let state = CohesiveBeamState { rest_direction: rest.direction, rest_rotation: rest.rotation };
        let can_fail = self.strength.is_finite() || self.shear.is_given();
        let [tension, shear] = if can_fail {
            let bending = self.bending(&point.normal, &forces);
            let stresses = SectionStresses::of(geometry.area, axial, &point.normal, &forces, bending);
            self.breaks(geometry.area, &stresses, &point.normal, &force)
        } else {
            [false; 2]
        };
        if tension || shear || rotations.turned_too_far() || !point.bonded {
            // The forces of this step are void, and the stored energy is released. It contains the half of this step's
            // work that the void forces would have done. That work was not done; it is booked as integration.
            energy.damage = energy.stored();
            energy.integration = -0.5 * kinematics.work(&force, &moment_a, &moment_b);
            let status = if shear && !tension { Status::BrokeInShear } else { Status::Broke };
            return Response { force: Vec3::zeros(), moment: Vec3::zeros(), state, status, energy };
        }
        Response { force, moment: forces.moment(), state, status: Status::Lives, energy }
    }

    const COLUMNS: Option<ColumnUse> = Some(ColumnUse {
        // The rotation of the rest frame, zero where the orientations did not differ at bonding.
        optional: 3,
        ..ColumnUse::ELASTIC
    });

    /// Beams whose ends have turned little, and that hold. A direction of zero marks the first evaluation of a bond.
    #[inline(always)]
    fn straight(
        &self,
        kinematics: &FrameKinematics,
        old: &CohesiveBeamState,
        given: &Given,
        _dt: f64,
    ) -> (Response<CohesiveBeamState>, bool) {
        let FrameKinematics { point, orientation_a, orientation_b, .. } = kinematics;
        let rest = RestFrame { direction: old.rest_direction, rotation: old.rest_rotation };
        let branch = BranchVector { length: point.length, normal: point.normal };
        let (rotations, small) = branch.small_rotations([*orientation_a, *orientation_b], &rest, !given.reduced);
        let k = self.stiffnesses_of_beam(&point.geometry, self.shear_coefficient());
        let BeamResponse { forces, axial, .. } =
            beam_response(&k, point.geometry.reference_length, &branch, &rotations);
        let bending = forces.bending(&branch.normal);
        let area = point.geometry.area;
        let stresses = SectionStresses::of(area, axial, &branch.normal, &forces, bending);
        let [tension, shear] = self.breaks(area, &stresses, &branch.normal, &forces.force);
        let known = rest.direction.norm_squared() > 0.0;
        let response = Response { moment: forces.moment(), ..Response::of_force(forces.force, *old) };
        (response, !(tension | shear) & small & known & point.bonded)
    }

    /// Slender and Timoshenko beams with the default criterion.
    #[inline(always)]
    fn is_straight(&self, _measure: MotionMeasure) -> bool {
        matches!(self.model, BeamModel::EulerBernoulli | BeamModel::Timoshenko { .. })
            && self.bending_term == BendingTerm::MidSection
    }

    fn stiffness(&self, geometry: &ContactGeometry) -> Stiffness {
        let k = self.stiffnesses(geometry);
        Stiffness { normal: k.normal, shear: k.shear, bending: k.bending, twist: k.twist, ..Stiffness::default() }
    }

    /// The faces of the crack touch again at the length at which they separated.
    fn kept_reference(&self, reference: Reference) -> Option<Reference> {
        Some(reference)
    }

    fn bonded_area(&self, radius_a: f64, radius_b: f64, mean_radius: f64) -> f64 {
        let radius = match self.section {
            Section::Ratio(ratio) => ratio * mean_radius,
            Section::RatioOfPair { ratio, radius } => ratio * radius.of(radius_a, radius_b),
            Section::Radius(radius) => radius,
        };
        PI * (radius * radius)
    }

    fn axial_force(&self, geometry: &ContactGeometry, length: f64) -> Option<f64> {
        Some(self.young * geometry.area / geometry.reference_length * (length - geometry.reference_length))
    }
}
