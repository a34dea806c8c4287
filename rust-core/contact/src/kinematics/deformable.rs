//! Particles that deform under the forces on their surface: the deformable discrete element method (Madan 2019, chapter
//! 2; Rojek, Zubelewicz, Madan & Nosewicz 2018, Int. J. Numer. Methods Eng. 114:828).
//!
//! Each particle has one uniform strain; contacts add their own local overlap. With the unit vectors `n_c` from the center
//! to the contact points, forces `f_c` on the particle, radius `R` and volume `V`:
//!
//! | | | |
//! |---|---|---|
//! | stress | `σ = (1/V) Σ ½(s⊗f + f⊗s)`, `s = R n`; `R T/V` with `T = Σ ½(n⊗f + f⊗n)` | (2.41), (2.44) |
//! | strain | `ε = D σ` | (2.47) |
//! | plane strain | `ε = ((1+ν)/E)(σ − ν tr σ 1)` in the plane | (2.48) |
//! | plane stress | `ε = ((1+ν)σ − ν tr σ 1)/E` in the plane | (2.49) |
//! | solid | the same in space | extension |
//! | displacement of a contact point | `u = ε s` | (2.52) |
//! | corrected elongation | `u_c = u − n·(R_A ε_A + R_B ε_B)·n` | (2.53) |
//!
//! in Pa, m, N; tension positive. Discs have unit depth. The arm is the whole radius, as in all closed forms of the
//! source. Contact points and normals are those of the undeformed particles, and the deformation does not change shear
//! increments. Forces depend on the strains of the same step, and strains on the forces; see [`Update`].
//!
//! **Forces that strain a particle.** Contacts with particles and walls; external loads that act on the surface
//! (`Load::virial` of the solver); reactions of prescribed translations. The point where a reaction acts is unknown.
//! The model places it opposite to the contacts, with the arm `−R Σn/max(1, |Σn|)`: exactly opposite to a single
//! contact, on the outer side at a surface, and zero if contacts surround the particle. Gravity and inertia are body
//! forces without an arm.
//!
//! **Energy.** Shear forces strain the particles, but this strain does not change shear increments, so the scheme has no
//! potential under shear. The ledger books the difference as a term of its own (`Ledger::deformation_other`).

#[cfg(feature = "std")]
use core::f64::consts::PI;

#[cfg(feature = "std")]
use crate::Constraint;
#[cfg(feature = "std")]
use crate::elastic::Elastic;
use crate::math::{Symmetric, Vec3};

/// Relation between the strains and stresses of a particle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(
    feature = "std",
    derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema),
    serde(rename_all = "kebab-case")
)]
pub enum Condition {
    /// Spheres.
    #[default]
    Solid,
    /// Discs without out-of-plane strain.
    PlaneStrain,
    /// Discs without out-of-plane stress.
    PlaneStress,
}

impl Condition {
    /// Whether particles are discs.
    #[inline(always)]
    pub fn is_planar(self) -> bool {
        self != Self::Solid
    }
}

/// When the strains of a step are computed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Update {
    /// From the forces of the previous step (Madan 2019, (3.17)). Stable only while the spectral radius of the iteration
    /// matrix is below 1; dissipates vibrations, `ζ ≈ ω₀Δt ρ/(2(1+ρ)^{3/2})` for a mode of undeformed frequency `ω₀`.
    #[default]
    Lagged,
    /// By iteration at fixed positions until strains and forces agree (Madan 2019, section 3.2).
    Iterated {
        /// Largest relative change of the particle virials in the last iteration (root of sums of squares), 1.
        tolerance: f64,
        /// Iterations after which the run stops with an error.
        maximum: u32,
        /// Relaxation factor of the change, 1. Converges below `2/(1+ρ)`, where `ρ` is the spectral radius, so a small
        /// factor removes the limit on `ρ`.
        relaxation: f64,
    },
}

/// Parameters of the deformation of particles.
///
/// ```
/// use concordem_contact::kinematics::deformable::{Condition, Deformable, Update};
/// use concordem_contact::law::Elastic;
/// use concordem_contact::math::Symmetric;
///
/// let elasticity = vec![Elastic { young: 1e6, poisson: 0.25 }];
/// let bodies = Deformable { elasticity, condition: Condition::Solid, update: Update::Lagged, dashpots: true };
/// // Two opposite forces of 2 N press a sphere of radius 0.1 m along x: the virial is −2 N, the stress −2 N · R/V.
/// let virial = Symmetric([-2.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
/// let stress = bodies.stress(&virial, 0.1);
/// let moved = bodies.compliance(0, 0.1).surface_displacement(&virial);
/// // The surface moves by R σ/E along the force, and outwards across it.
/// assert!((moved.0[0] - 0.1 * stress.0[0] / 1e6).abs() < 1e-12);
/// assert!((moved.0[1] + 0.25 * moved.0[0]).abs() < 1e-12);
/// ```
#[cfg(feature = "std")]
#[derive(Debug, Clone, PartialEq)]
pub struct Deformable {
    /// Elastic constants by material; [`Elastic::RIGID`] for particles that keep their shape.
    pub elasticity: Vec<Elastic>,
    /// Plane strain, plane stress, or solid.
    pub condition: Condition,
    /// When the strains are computed.
    pub update: Update,
    /// Whether dashpot forces strain the particles too; in statics it makes no difference. If off, only elastic forces do,
    /// as in section 2.8 of the source.
    pub dashpots: bool,
}

/// Displacement of a particle's surface per particle virial; see [`Deformable::compliance`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Compliance {
    /// Factor of `T`, m/N.
    direct: f64,
    /// Factor of `−tr T 1`, m/N.
    volumetric: f64,
    condition: Condition,
}

#[cfg(feature = "std")]
impl Deformable {
    /// Volume of a sphere, or of a disc of unit depth, m³; `radius` in m.
    #[inline(always)]
    pub fn volume(&self, radius: f64) -> f64 {
        if self.condition.is_planar() { PI * (radius * radius) } else { 4.0 / 3.0 * PI * (radius * radius * radius) }
    }

    /// Compliance of a particle of the given material and radius (m).
    #[inline(always)]
    pub fn compliance(&self, material: u16, radius: f64) -> Compliance {
        let Elastic { young, poisson } = self.elasticity.get(material as usize).copied().unwrap_or(Elastic::RIGID);
        // R²/(V E)
        let shape = if self.condition.is_planar() { 1.0 / (PI * young) } else { 0.75 / (PI * (radius * young)) };
        let volumetric = match self.condition {
            Condition::PlaneStrain => poisson * (1.0 + poisson),
            Condition::PlaneStress | Condition::Solid => poisson,
        };
        Compliance { direct: shape * (1.0 + poisson), volumetric: shape * volumetric, condition: self.condition }
    }

    /// Prescribed translations whose reactions strain particles.
    pub fn reacting(&self) -> Constraint {
        if self.condition.is_planar() { Constraint::IN_PLANE } else { Constraint::TRANSLATION }
    }

    /// Stress of a particle with the particle virial `T` (N), Pa.
    pub fn stress(&self, virial: &Symmetric, radius: f64) -> Symmetric {
        *virial * (radius / self.volume(radius))
    }
}

impl Compliance {
    /// Outward displacement of the surface `R ε`, m, at the particle virial `T` (N).
    #[inline(always)]
    pub fn surface_displacement(&self, virial: &Symmetric) -> Symmetric {
        let [xx, yy, zz, yz, xz, xy] = virial.0;
        let (a, b) = (self.direct, self.volumetric * virial.trace());
        let out_of_plane = if self.is_planar() { 0.0 } else { a * zz - b };
        Symmetric([a * xx - b, a * yy - b, out_of_plane, a * yz, a * xz, a * xy])
    }

    /// Compliance of a particle whose modulus is `factor` times as large.
    #[must_use]
    pub fn stiffened(&self, factor: f64) -> Self {
        Self { direct: self.direct / factor, volumetric: self.volumetric / factor, condition: self.condition }
    }

    /// Derivative with respect to the particle's Poisson's ratio: `direct = s(1+ν)` and `volumetric = sν`, in plane
    /// strain `sν(1+ν)`.
    #[must_use]
    pub fn by_poisson(&self) -> Self {
        let (direct, volumetric) = match self.condition {
            Condition::PlaneStrain if self.direct == 0.0 => (0.0, 0.0),
            Condition::PlaneStrain => {
                let poisson = self.volumetric / self.direct;
                let shape = self.direct / (1.0 + poisson);
                (shape, shape * (1.0 + 2.0 * poisson))
            }
            Condition::PlaneStress | Condition::Solid => {
                let shape = self.direct - self.volumetric;
                (shape, shape)
            }
        };
        Self { direct, volumetric, condition: self.condition }
    }

    /// Whether the particle is a disc.
    #[inline(always)]
    pub fn is_planar(&self) -> bool {
        self.condition.is_planar()
    }

    /// Factors of the trace-free part of a particle virial and of its isotropic part (in the plane, or in space), m/N.
    pub fn principal(&self) -> (f64, f64) {
        let dimension = if self.is_planar() { 2.0 } else { 3.0 };
        (self.direct, self.direct - dimension * self.volumetric)
    }
}

/// What one contact adds to the particle virials. It is the same for both particles, because force and direction both
/// change sign. One cache line.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
pub struct ParticleVirial {
    /// Unit vector from the center of the particle to the contact.
    pub normal: Vec3,
    /// Elastic normal force on the particle along `normal`, N.
    pub pressure: f64,
    /// All other forces that strain the particle, N.
    pub other: Vec3,
}

impl ParticleVirial {
    /// For a contact that exerts `force` (N) on the particle; `viscous` is its part from dashpots (N), which strains
    /// particles if `dashpots_strain`.
    #[inline(always)]
    pub fn of(normal: &Vec3, force: &Vec3, viscous: &Vec3, dashpots_strain: bool) -> Self {
        let elastic = force - viscous;
        let pressure = elastic.dot(normal);
        let other = if dashpots_strain { *force } else { elastic } - normal * pressure;
        Self { normal: *normal, pressure, other }
    }

    /// Contribution `½(n⊗f + f⊗n)` to the particle virial, in its two parts, N.
    #[inline(always)]
    pub fn parts(&self) -> VirialParts {
        let Self { normal, other, pressure } = self;
        VirialParts { normal: Symmetric::square(normal) * *pressure, other: Symmetric::product(normal, other) }
    }

    /// Elastic normal force on the particle, N.
    #[inline(always)]
    pub fn elastic(&self) -> Vec3 {
        self.normal * self.pressure
    }
}

/// Particle virial `Σ ½(n⊗f + f⊗n)` over the contacts of a particle, in two parts, N. Aligned to cache lines.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
pub struct VirialParts {
    /// Part of elastic normal forces.
    pub normal: Symmetric,
    /// Part of all other forces that strain the particle.
    pub other: Symmetric,
}

impl core::ops::AddAssign for VirialParts {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        self.normal += other.normal;
        self.other += other.other;
    }
}

/// Sums over the contacts of a particle with prescribed translation; zero for other particles.
#[derive(Debug, Clone, Copy, Default)]
pub struct ReactionSums {
    /// Sum of the directions of the contacts, `Σ n`.
    pub side: Vec3,
    /// Sum of the elastic normal forces, N.
    pub net: Vec3,
}

impl ReactionSums {
    /// Add a contact.
    #[inline(always)]
    pub fn add(&mut self, virial: &ParticleVirial) {
        self.side += virial.normal;
        self.net += virial.elastic();
    }

    /// Add a contact whose virial is that of the other particle.
    #[inline(always)]
    pub fn add_opposite(&mut self, virial: &ParticleVirial) {
        self.side -= virial.normal;
        self.net -= virial.elastic();
    }
}

/// Sums by particle to which contacts add; empty if particles do not deform.
#[derive(Default)]
pub struct ParticleVirials<'a> {
    /// Particle virials.
    pub virials: &'a mut [VirialParts],
    /// Sums for the reactions of prescribed translations.
    pub reaction_sums: &'a mut [ReactionSums],
}

impl ParticleVirials<'_> {
    /// Split off the first particles, at most `length`; the others stay.
    pub fn split_off(&mut self, length: usize) -> Self {
        let length = length.min(self.virials.len());
        Self {
            virials: self.virials.split_off_mut(..length).unwrap_or_default(),
            reaction_sums: self.reaction_sums.split_off_mut(..length).unwrap_or_default(),
        }
    }

    /// The same sums, borrowed for a shorter time.
    pub fn reborrow(&mut self) -> ParticleVirials<'_> {
        ParticleVirials { virials: self.virials, reaction_sums: self.reaction_sums }
    }
}

/// Surface displacement `R ε` of a particle, m, in one cache line.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
pub struct SurfaceDisplacement(pub Symmetric);

#[cfg(test)]
mod tests {
    use super::*;

    fn disc(condition: Condition, young: f64, poisson: f64) -> Deformable {
        let elasticity = vec![Elastic { young, poisson }];
        Deformable { elasticity, condition, update: Update::Lagged, dashpots: false }
    }

    /// Every printed digit of Madan 2019, section 2.9: two discs in plane stress, with (2.53).
    #[test]
    fn two_discs_of_the_source() {
        let (radius, force, approach) = (1e-3, 1e4, 3.65e-7);
        let deformable = disc(Condition::PlaneStress, 2e11, 0.35);
        // Pressed between two opposite contacts along y.
        let virial = Symmetric::product(&Vec3::y(), &Vec3::y()) * (-2.0 * force);
        let stress = deformable.stress(&virial, radius);
        assert!((stress.0[1] * 1e-6 + 6.37).abs() < 0.005, "{stress:?}");
        let surface_displacement = deformable.compliance(0, radius).surface_displacement(&virial);
        assert!((surface_displacement.0[1] / radius * 1e5 + 3.18).abs() < 0.005);
        assert!((surface_displacement.0[0] / radius * 1e5 - 1.11).abs() < 0.005);
        // The two half discs between the centers.
        assert!((2.0 * surface_displacement.0[1] * 1e8 + 6.37).abs() < 0.005);
        assert!((2.0 * surface_displacement.0[0] * 1e8 - 2.23).abs() < 0.005);
        let overlap = approach + 2.0 * surface_displacement.0[1];
        assert!((overlap * 1e7 - 3.01).abs() < 0.005);
        assert!((force / overlap * 1e-10 - 3.32).abs() < 0.005);
    }

    /// Stiffness of a particle between two opposite contacts in closed form: `πE/(2(1−ν²))` in plane strain (2.72), `πE/2` in
    /// plane stress, `2πRE/3` for a sphere. Tolerance: a few roundings.
    #[test]
    fn stiffness_between_two_contacts() {
        let (young, poisson, radius) = (2e11, 0.35, 1e-3);
        for (condition, expected) in [
            (Condition::PlaneStrain, PI * young / (2.0 * (1.0 - poisson * poisson))),
            (Condition::PlaneStress, 0.5 * PI * young),
            (Condition::Solid, 2.0 / 3.0 * PI * radius * young),
        ] {
            let virial = Symmetric::product(&Vec3::x(), &Vec3::x()) * 2.0;
            let surface_displacement =
                disc(condition, young, poisson).compliance(0, radius).surface_displacement(&virial);
            assert!((1.0 / surface_displacement.0[0] / expected - 1.0).abs() < 4e-16 * 4.0, "{condition:?}");
        }
    }

    /// Compared with central differences of a quadratic in ν, which are exact up to rounding: 1e-16/h.
    #[test]
    fn compliance_by_poisson_is_its_derivative() {
        let virial = Symmetric([1.0, -2.0, 3.0, 0.4, 0.5, 0.6]);
        let h = 1e-3;
        for condition in [Condition::PlaneStrain, Condition::PlaneStress, Condition::Solid] {
            for poisson in [-0.4, 0.0, 0.35] {
                let at = |poisson: f64| disc(condition, 2.0, poisson).compliance(0, 0.7);
                let found = at(poisson).by_poisson().surface_displacement(&virial);
                let difference =
                    at(poisson + h).surface_displacement(&virial) - at(poisson - h).surface_displacement(&virial);
                for (found, difference) in found.0.iter().zip(difference.0) {
                    assert!((found - difference / (2.0 * h)).abs() < 1e-12, "{condition:?} {poisson}");
                }
            }
        }
        let rigid = disc(Condition::PlaneStrain, f64::INFINITY, 0.3).compliance(0, 1.0);
        assert_eq!(rigid.by_poisson().surface_displacement(&virial), Symmetric::default());
    }

    /// The surface of a rigid particle does not move, exactly.
    #[test]
    fn rigid_particles_keep_their_surface() {
        let rigid = disc(Condition::Solid, f64::INFINITY, 0.0).compliance(0, 1.0);
        assert_eq!(rigid.surface_displacement(&Symmetric([1.0, -2.0, 3.0, 4.0, 5.0, 6.0])), Symmetric::default());
    }
}
