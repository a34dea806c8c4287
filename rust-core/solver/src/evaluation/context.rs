//! Inputs of a force evaluation besides the contacts.

use concordem_contact::Cell;
use concordem_contact::kinematics::deformable::{Deformable, SurfaceDisplacement};
use concordem_contact::kinematics::{ImageShift, Motion, MotionMeasure, Pose};
use concordem_contact::law::TemperatureFactors;
use concordem_contact::math::Symmetric;
use concordem_contact::step::Ends;

use crate::state::contacts::Pair;
use crate::state::particles::{Constraint, Particles};
use crate::strengths::Strengths;

/// Inputs of a force evaluation besides the contacts.
#[derive(Clone, Copy)]
pub struct StepContext<'a> {
    /// The particles.
    pub particles: &'a Particles,
    /// Position, rotation, and radius of each particle, packed for the contact loops.
    pub poses: &'a [Pose],
    /// Whether `poses` hold orientations (otherwise they hold the rotations of the step).
    pub oriented: bool,
    /// Periodic cell.
    pub cell: Option<&'a Cell>,
    /// How relative motion is measured.
    pub mode: MotionMeasure,
    /// Time step, s.
    pub dt: f64,
    /// Damage at which a bond enters the event log.
    pub damage_threshold: f64,
    /// Whether to sum stored energies and squared contact forces. They are functions of the state and needed only in
    /// steps that sample. (Dissipation is summed in every step.)
    pub sample: bool,
    /// Surface displacement of each particle; empty if particles are rigid.
    pub surface_displacement: &'a [SurfaceDisplacement],
    /// Surface displacements one step ago, m. Stored only if most contacts need them, otherwise empty.
    pub surface_displacement_before: &'a [Symmetric],
    /// How particles deform, if they do.
    pub deformable: Option<&'a Deformable>,
    /// Whether dashpot forces strain the particles.
    pub dashpots_strain: bool,
    /// Thermal expansion of bonds, if they expand.
    pub expansion: Option<ExpansionRates<'a>>,
    /// Factors on stiffness and strength of single contacts, if there are any.
    pub factors: Option<ContactFactors<'a>>,
    /// Whether dissipated energy becomes heat, so that each contact lists it.
    pub heats: bool,
    /// Whether the step has just been evaluated, for [`record`](crate::forces::record).
    pub evaluated: bool,
    /// Prescribed translations whose reactions strain the particles: all of them, or those in the plane.
    pub reacting: Constraint,
}

/// Changes of the thermal strains of the particles.
#[derive(Clone, Copy)]
pub struct ExpansionRates<'a> {
    /// In the last step.
    pub before: &'a [f64],
    /// In the present step.
    pub after: &'a [f64],
}

impl ExpansionRates<'_> {
    /// Work of the expansion of a bond of particles `a` and `b`, with the length `rest` (m) at the reference temperature,
    /// under the axial force `force` (N), over the half steps before and after the present instant, J.
    pub fn work(&self, a: u32, b: u32, rest: f64, force: f64) -> [f64; 2] {
        [self.before, self.after].map(|change| -0.25 * force * rest * (change[a as usize] + change[b as usize]))
    }
}

/// Factors on stiffness and strength at the temperatures of the particles.
#[derive(Clone, Copy)]
pub struct Softened<'a> {
    /// On the stiffness, in the last step.
    pub stiffness_before: &'a [f64],
    /// On the stiffness.
    pub stiffness: &'a [f64],
    /// On the strength.
    pub strength: &'a [f64],
}

/// Factors on stiffness and strength of single contacts: by the temperatures of their particles, and by chance.
#[derive(Clone, Copy)]
pub struct ContactFactors<'a> {
    /// At the temperatures of the particles, if they matter.
    pub softened: Option<Softened<'a>>,
    /// On the strengths of single bonds, if they differ.
    pub strengths: Option<&'a Strengths>,
}

impl<'a> ContactFactors<'a> {
    /// `None` if all factors are 1.
    pub fn new(softened: Option<Softened<'a>>, strengths: Option<&'a Strengths>) -> Option<Self> {
        let strengths = strengths.filter(|strengths| !strengths.are_equal());
        (softened.is_some() || strengths.is_some()).then_some(Self { softened, strengths })
    }

    /// Factors of a contact: means of its two particles, each at its temperature; `by_chance`: factor on its own strength.
    pub fn of(&self, Pair { a, b }: Pair, by_chance: f64) -> TemperatureFactors {
        let mean = |of: &[f64]| 0.5 * (of[a as usize] + of[b as usize]);
        match self.softened {
            Some(Softened { stiffness, strength, .. }) => {
                TemperatureFactors { stiffness: mean(stiffness), strength: mean(strength) * by_chance }
            }
            None => TemperatureFactors { stiffness: 1.0, strength: by_chance },
        }
    }

    /// Factor on the stiffness in the last step over that now.
    pub fn past(&self, Pair { a, b }: Pair) -> f64 {
        let sum = |of: &[f64]| of[a as usize] + of[b as usize];
        self.softened.map_or(1.0, |softened| sum(softened.stiffness_before) / sum(softened.stiffness))
    }
}

impl StepContext<'_> {
    /// Surface displacement of particle `p` one step ago, m.
    #[inline(always)]
    pub fn surface_displacement_before(&self, p: usize) -> Symmetric {
        self.surface_displacement_before.get(p).copied().unwrap_or_else(|| self.compute_surface_displacement_before(p))
    }

    #[cold]
    #[inline(never)]
    fn compute_surface_displacement_before(&self, p: usize) -> Symmetric {
        let Particles { material, radius, deformation, .. } = self.particles;
        self.deformable.map_or_else(Symmetric::default, |deformable| {
            deformable.compliance(material[p], radius[p]).surface_displacement(&deformation[p].used)
        })
    }
}

impl StepContext<'_> {
    /// Motions of the particles of a pair.
    #[inline(always)]
    pub fn motions(&self, Pair { a, b }: Pair) -> [Motion; 2] {
        [motion_of(self.particles, a as usize), motion_of(self.particles, b as usize)]
    }

    /// Both sides of a contact, given their motions, B's image, and whether particles deform.
    #[inline(always)]
    pub fn ends<'a>(&self, pair: Pair, motions: &'a [Motion; 2], image: &'a ImageShift, deforms: bool) -> Ends<'a> {
        let (a, b) = (pair.a as usize, pair.b as usize);
        let Particles { radius, mass, .. } = self.particles;
        let surface_displacement = deforms.then(|| {
            let now = self.surface_displacement[a].0 + self.surface_displacement[b].0;
            [now, self.surface_displacement_before(a) + self.surface_displacement_before(b)]
        });
        let [motion_a, motion_b] = motions;
        Ends {
            motion: [motion_a, motion_b],
            radius: [radius[a], radius[b]],
            mass: [mass[a], mass[b]],
            image,
            surface_displacement,
        }
    }
}

/// Motion of particle `p`.
#[inline(always)]
pub fn motion_of(particles: &Particles, p: usize) -> Motion {
    Motion {
        position: particles.position[p],
        velocity: particles.velocity[p],
        angular_velocity: particles.angular_velocity[p],
        rotation_increment: particles.rotation_increment[p],
        orientation: particles.orientation[p],
    }
}
