//! Materials: density, and parameters of one or more contact laws.

pub use concordem_contact::kinematics::deformable::Condition;
pub use concordem_contact::law::cohesive_beam::BendingTerm;
pub use concordem_contact::law::cpm::{CpmFormulation, DamageLaw, YieldSurface};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::quantity::{Angle, Density, Force, Length, Number, Stiffness, Stress, Time};

/// A material.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Name, by which sets and walls refer to it. The first material is that of all particles in no other's set.
    pub name: String,
    /// Mass density of the particles themselves (not of the packing), kg/m³.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub density: Density,
    /// Parameters of the concrete particle model.
    pub cpm: Option<Cpm>,
    /// Parameters of the linear bond.
    pub linear_bond: Option<LinearBond>,
    /// Parameters of the cohesive beam.
    pub cohesive_beam: Option<CohesiveBeam>,
    /// Parameters of the linear frictional contact.
    pub frictional: Option<Frictional>,
    /// Parameters of the Hertz-Mindlin contact.
    pub hertz_mindlin: Option<HertzMindlin>,
    /// Elastic constants of the particles themselves, which deform under their contacts; rigid when left out.
    pub deformable: Option<ParticleElasticity>,
}

/// Elastic constants of particles that deform under their contacts (Madan 2019).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ParticleElasticity {
    /// Young's modulus of the particles, Pa.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub young: Stress,
    /// Poisson's ratio of the particles.
    #[schemars(extend("exclusiveMinimum" = -1, "maximum" = 0.5))]
    pub poisson: Number,
}

/// How deformable particles are computed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Deformable {
    /// Which strains go with which stresses; "plane-strain" in two dimensions, "solid" in three when left out.
    pub condition: Option<Condition>,
    /// When the strains of a step are found.
    pub update: DeformableUpdate,
    /// Largest relative change in the last iteration; with update "iterated"; 1e-10 when left out.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))]
    pub tolerance: Option<Number>,
    /// Iterations after which the run stops; with update "iterated"; 200 when left out.
    #[schemars(range(min = 1))]
    pub maximum_iterations: Option<u32>,
    /// Share of each iteration's change that is taken over; with update "iterated"; 1 when left out.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
    pub relaxation: Option<Number>,
    /// Whether the forces of dashpots strain the particles too.
    pub dashpots: bool,
}

impl Default for Deformable {
    fn default() -> Self {
        Self {
            condition: None,
            update: DeformableUpdate::Lagged,
            tolerance: None,
            maximum_iterations: None,
            relaxation: None,
            dashpots: false,
        }
    }
}

/// When the strains of deformable particles are found.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DeformableUpdate {
    /// From the forces of the step before.
    #[default]
    Lagged,
    /// By iteration in each step, until strains and forces agree.
    Iterated,
}

/// Parameters between two materials, in place of the average of theirs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Interface {
    /// Names of the two materials.
    pub between: [String; 2],
    /// Parameters of the concrete particle model.
    pub cpm: Option<Cpm>,
    /// Parameters of the linear bond.
    pub linear_bond: Option<LinearBond>,
    /// Parameters of the cohesive beam.
    pub cohesive_beam: Option<CohesiveBeam>,
    /// Parameters of the linear frictional contact.
    pub frictional: Option<Frictional>,
    /// Parameters of the Hertz-Mindlin contact.
    pub hertz_mindlin: Option<HertzMindlin>,
}

/// Contact laws, by the name of their parameter table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LawName {
    /// Concrete particle model: cohesion, damage, plastic slip.
    Cpm,
    /// Linear elastic bond, brittle; afterwards a frictional contact.
    LinearBond,
    /// Elastic beam between the centres, brittle.
    CohesiveBeam,
    /// Linear elastic contact with Coulomb friction.
    Frictional,
    /// Hertz-Mindlin contact with Coulomb friction and restitution.
    HertzMindlin,
}

impl LawName {
    /// Key of the law's table in a material.
    pub fn key(self) -> &'static str {
        match self {
            Self::Cpm => "cpm",
            Self::LinearBond => "linear_bond",
            Self::CohesiveBeam => "cohesive_beam",
            Self::Frictional => "frictional",
            Self::HertzMindlin => "hertz_mindlin",
        }
    }
}

impl Material {
    /// Whether the material has parameters of the law.
    pub fn has(&self, law: LawName) -> bool {
        match law {
            LawName::Cpm => self.cpm.is_some(),
            LawName::LinearBond => self.linear_bond.is_some(),
            LawName::CohesiveBeam => self.cohesive_beam.is_some(),
            LawName::Frictional => self.frictional.is_some(),
            LawName::HertzMindlin => self.hertz_mindlin.is_some(),
        }
    }
}

/// Which particles are bonded at the start, and how.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Bonds {
    /// Law of the bonds.
    pub law: LawName,
    /// Two particles are bonded when their centre distance is below this times the sum of their radii;
    /// 1.5 is usual for concrete.
    #[serde(default = "one")]
    #[schemars(extend("minimum" = 1, "maximum" = 10))]
    pub interaction_ratio: Number,
    /// Bonds per particle (mean) to be reached instead, counted in the periodic packing before anything is cut out of it:
    /// the nearest pairs, by centre distance through sum of radii, are bonded. 6.2 in Jebahi et al. 2015.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 100))]
    pub coordination: Option<Number>,
}

/// What particles do that touch without a bond.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Contacts {
    /// Law of the contacts.
    pub law: ContactLawName,
}

/// Law of contacts without a bond. The numbers stand in restart files of hosts: a law keeps its own, a new one takes the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ContactLawName {
    /// Particles without a bond pass through each other.
    None = 0,
    /// Concrete particle model without cohesion.
    Cpm = 1,
    /// Linear bond after failure: linear contact with friction.
    LinearBond = 2,
    /// Linear elastic contact with Coulomb friction.
    Frictional = 3,
    /// Hertz-Mindlin contact.
    HertzMindlin = 4,
}

impl ContactLawName {
    /// The law; nothing for "none".
    pub fn law(self) -> Option<LawName> {
        match self {
            Self::None => None,
            Self::Cpm => Some(LawName::Cpm),
            Self::LinearBond => Some(LawName::LinearBond),
            Self::Frictional => Some(LawName::Frictional),
            Self::HertzMindlin => Some(LawName::HertzMindlin),
        }
    }
}

/// Concrete particle model (Šmilauer 2010; Stránský 2018, section 2.5).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cpm {
    /// Normal modulus of a link, Pa.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub young: Stress,
    /// Shear modulus of a link divided by its normal modulus.
    #[schemars(extend("minimum" = 0))]
    pub shear_ratio: Number,
    /// Tensile strain at which damage begins.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub crack_onset_strain: Number,
    /// Decay strain of the softening divided by the crack onset strain.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub relative_ductility: Number,
    /// Cohesion of the undamaged link: shear strength without normal stress, Pa.
    #[schemars(extend("minimum" = 0))]
    pub cohesion: Stress,
    /// Angle of friction; or give `friction_coefficient`.
    #[schemars(extend("minimum" = 0))]
    pub friction_angle: Option<Angle>,
    /// Tangent of the angle of friction; or give `friction_angle`.
    #[schemars(extend("minimum" = 0))]
    pub friction_coefficient: Option<Number>,
    /// Which published form of the model.
    #[serde(default)]
    pub mode: CpmFormulation,
    /// Shape of the softening branch.
    #[serde(default)]
    pub damage_law: DamageLaw,
    /// Damage above which a link in tension is deleted; 1 keeps all.
    #[serde(default = "one")]
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
    pub omega_threshold: Number,
    /// Keep the links undamaged whatever their strain.
    #[serde(default)]
    pub never_damage: bool,
    /// Normal strain (negative) beyond which compression hardens plastically; elastic when left out.
    #[schemars(extend("exclusiveMaximum" = 0))]
    pub soft_strain: Option<Number>,
    /// Hardening modulus beyond `soft_strain`, divided by the normal modulus.
    #[schemars(extend("minimum" = 0, "maximum" = 1))]
    pub relative_soft_stiffness: Option<Number>,
    /// Confinement added to the normal stress of every link, Pa.
    #[serde(default)]
    pub isotropic_prestress: Stress,
    /// Weight of the shear strain in the equivalent strain that drives damage.
    #[serde(default)]
    #[schemars(extend("minimum" = 0))]
    pub shear_contribution: Number,
    /// Yield surface of the shear stress; only in mode `woo`.
    pub yield_surface: Option<YieldSurface>,
    /// Speed of the logarithmic yield surface; only in mode `woo`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub yield_log_speed: Option<Number>,
    /// Characteristic time of viscous damage, s; rate independent when left out; only in mode `woo`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub damage_time: Option<Time>,
    /// Exponent of viscous damage; only in mode `woo`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub damage_rate_exponent: Option<Number>,
    /// Characteristic time of viscous plasticity, s; rate independent when left out; only in mode `woo`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub plasticity_time: Option<Time>,
    /// Exponent of viscous plasticity; only in mode `woo`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub plasticity_rate_exponent: Option<Number>,
}

impl Cpm {
    /// Tangent of the angle of friction; 0 when neither form of it is given (such a scenario does not pass the checks).
    pub fn friction_tangent(&self) -> f64 {
        tangent(self.friction_coefficient, self.friction_angle)
    }
}

fn tangent(coefficient: Option<Number>, angle: Option<Angle>) -> f64 {
    match (coefficient, angle) {
        (Some(coefficient), _) => coefficient.si(),
        (None, Some(angle)) => {
            let (sine, cosine) = concordem_contact::math::sin_cos(angle.si());
            sine / cosine
        }
        (None, None) => 0.0,
    }
}

/// Linear elastic bond with dashpots and brittle failure; afterwards a contact with Coulomb friction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LinearBond {
    /// Normal stiffness of a bond, N/m.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub normal_stiffness: Stiffness,
    /// Shear stiffness of a bond, N/m.
    #[schemars(extend("minimum" = 0))]
    pub shear_stiffness: Stiffness,
    /// Dashpots as a fraction of critical damping.
    #[serde(default)]
    #[schemars(extend("minimum" = 0))]
    pub damping_ratio: Number,
    /// Tensile force at which a bond breaks, N; never when left out.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub normal_strength: Option<Force>,
    /// Shear force at which a bond breaks, N; never when left out.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub shear_strength: Option<Force>,
    /// Friction coefficient (tangent of the angle) after failure.
    #[serde(default)]
    #[schemars(extend("minimum" = 0))]
    pub friction_coefficient: Number,
    /// Whether a bond is free of force at the distance at which it is made.
    #[serde(default = "yes")]
    pub subtract_initial_gap: bool,
}

/// Elastic beam between the centres of two particles (Jebahi et al. 2015, section 2.4.1), brittle by its largest principal
/// stress or by the mean stress of a particle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CohesiveBeam {
    /// Young's modulus of the beam, Pa.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub young: Stress,
    /// Poisson's ratio of the beam.
    #[serde(default = "beam_poisson")]
    #[schemars(extend("exclusiveMinimum" = -1, "maximum" = 0.5))]
    pub poisson: Number,
    /// Radius of the beam divided by the mean radius of all particles; or give `radius`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub radius_ratio: Option<Number>,
    /// Radius of the beam, m; or give `radius_ratio`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub radius: Option<Length>,
    /// What the bond resists.
    #[serde(default)]
    pub model: BeamModel,
    /// Shear coefficient of the section; 0.9 when left out; only with model "timoshenko".
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub shear_coefficient: Option<Number>,
    /// Tangential stiffness divided by normal stiffness; only with model "dual-spring".
    #[schemars(extend("minimum" = 0))]
    pub shear_ratio: Option<Number>,
    /// Largest principal stress on the surface of a beam at which it breaks, Pa; never when left out.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub tensile_strength: Option<Stress>,
    /// Which bending moment enters that stress.
    #[serde(default)]
    pub bending_term: BendingTerm,
    /// Mean stress of a particle at which all its beams break, Pa; never when left out.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub hydrostatic_strength: Option<Stress>,
}

/// Models of a cohesive bond.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum BeamModel {
    /// Slender beam.
    #[default]
    EulerBernoulli,
    /// Beam that shears.
    Timoshenko,
    /// Normal and tangential spring.
    DualSpring,
    /// Normal spring.
    Spring,
}

/// Linear elastic contact with Coulomb friction; no tension.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Frictional {
    /// Modulus, Pa: the normal stiffness of two equal spheres is modulus × radius; or give both stiffnesses.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub young: Option<Stress>,
    /// Shear stiffness divided by normal stiffness; with `young`.
    #[schemars(extend("minimum" = 0))]
    pub stiffness_ratio: Option<Number>,
    /// Normal stiffness, N/m.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub normal_stiffness: Option<Stiffness>,
    /// Shear stiffness, N/m.
    #[schemars(extend("minimum" = 0))]
    pub shear_stiffness: Option<Stiffness>,
    /// Friction coefficient (tangent of the angle).
    #[serde(default)]
    #[schemars(extend("minimum" = 0))]
    pub friction_coefficient: Number,
    /// Dashpots as a fraction of critical damping.
    #[serde(default)]
    #[schemars(extend("minimum" = 0))]
    pub damping_ratio: Number,
}

/// Hertz contact with Mindlin's shear stiffness, Coulomb friction, and restitution.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HertzMindlin {
    /// Young's modulus of the particles, Pa.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub young: Stress,
    /// Poisson's ratio of the particles.
    #[schemars(extend("exclusiveMinimum" = -1, "maximum" = 0.5))]
    pub poisson: Number,
    /// Friction coefficient (tangent of the angle).
    #[serde(default)]
    #[schemars(extend("minimum" = 0))]
    pub friction_coefficient: Number,
    /// Coefficient of restitution.
    #[serde(default = "one")]
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
    pub restitution: Number,
}

fn beam_poisson() -> Number {
    Number::new(0.3)
}

fn one() -> Number {
    Number::new(1.0)
}

fn yes() -> bool {
    true
}
