//! The pass over deformable particles: from the forces of a step to the strains that the contacts see
//! ([`kinematics::deformable`](crate::kinematics::deformable)), and their share of the ledger.
//!
//! **Ledger.** In a step the centres come nearer by what the contacts and the particles give way. Of the trapezoidal work
//! of a contact's normal force, `½(f_o+f)Δu_c` is the contact's own business, and the rest, summed over the contacts of a
//! particle, is `½(N_o+N):ΔW` with the dyads `N` of elastic normal forces and `W = Rε`. With `T` all that strains the
//! particle, `S` the dyad `W` was computed from, `O = T − N − X` what strains it without feeling the strain (shear
//! forces), and `X` given loads and reactions:
//!
//! `½(N_o+N):ΔW = ½Δ(S:W) + ½[(T_o+T) − (S_o+S)]:ΔW − ½(O_o+O):ΔW − ½(X_o+X):ΔW`,
//!
//! which are, in this order, the change of the energy stored in particles, what the lag of the strains behind the forces
//! dissipates, what shear makes or loses, and the work of loads and reactions on the particle's outer half. Exact up to
//! the turn of the normals in one step.

use rayon::prelude::*;

use super::forces::{HeldContact, TILE, TileMap};
use crate::kinematics::deformable::{Deformable, Update, Widening};
use crate::math::{Symmetric, Vec3};
use crate::state::particles::load_dyad;
use crate::state::{Constraint, Deformation, Particles};

/// What the contacts of a particle do to its shape: dyads `Σ ½(n⊗f + f⊗n)`, N.
#[derive(Debug, Clone, Copy, Default)]
pub struct Dyads {
    /// Of elastic normal forces.
    pub normal: Symmetric,
    /// Of all other forces that strain the particle.
    pub other: Symmetric,
}

impl Dyads {
    /// The dyads of a contact with the force `force` on the particle from whose centre `normal` points to it, of which
    /// dashpots exert `viscous` (N), and its elastic normal force; `dashpots_strain`: whether `viscous` strains particles.
    #[inline(always)]
    pub fn of_contact(normal: &Vec3, force: &Vec3, viscous: &Vec3, dashpots_strain: bool) -> (Self, Vec3) {
        let elastic = force - viscous;
        let pressure = normal * elastic.dot(normal);
        let other = if dashpots_strain { *force } else { elastic } - pressure;
        (Self { normal: Symmetric::product(normal, &pressure), other: Symmetric::product(normal, &other) }, pressure)
    }
}

/// Sums over the contacts of a particle whose translation is prescribed; nothing for others.
#[derive(Debug, Clone, Copy, Default)]
struct Held {
    /// Sum of the directions of the contacts, `Σ n`.
    side: Vec3,
    /// Sum of the elastic normal forces, N.
    net: Vec3,
}

impl std::ops::AddAssign for Dyads {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        self.normal += other.normal;
        self.other += other.other;
    }
}

/// Sums over particles of one step, J; see the [module](self).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct DeformationSums {
    /// Energy stored in particles.
    pub stored: f64,
    /// Dissipated in the step by the lag.
    pub lag: f64,
    /// Lost in the step to forces that strain particles and do not feel it.
    pub other: f64,
    /// Work of given forces in the step.
    pub loads: f64,
    /// Work of reactions in the step.
    pub reactions: f64,
}

/// Scratch of the pass.
#[derive(Default)]
pub struct DeformationPass {
    /// What the contacts see, by particle; empty if particles do not deform.
    pub widening: Vec<Widening>,
    /// What the contacts did, by particle.
    pub dyads: Vec<Dyads>,
    /// What the reaction of held particles needs to know.
    held: Vec<Held>,
    /// The dyads that the present strains were computed from, while they are iterated.
    guess: Vec<Symmetric>,
    /// What stays as in the first evaluation of a step while the strains are iterated.
    kept: Vec<Kept>,
}

/// What acts on a particle besides elastic normal forces.
#[derive(Debug, Clone, Copy, Default)]
struct Kept {
    /// Dyad of the other forces that strain it, N.
    other: Symmetric,
    /// Sum of the directions of its contacts, if it is held.
    side: Vec3,
    /// Sum of the other contact forces, N.
    rest: Vec3,
}

impl DeformationPass {
    /// Strains of a step before its forces are known: from the forces of the last one. Returns the largest size of any
    /// particle's strain.
    pub fn begin(&mut self, deformable: &Deformable, particles: &mut Particles) -> f64 {
        let n = particles.len();
        particles.deformation.resize(n, Deformation::default());
        self.guess.clear();
        self.guess.extend(particles.deformation.iter().map(|d| d.dyad));
        self.dyads.resize(n, Dyads::default());
        self.held.resize(n, Held::default());
        self.widening.resize(n, Widening::default());
        let compliance = |p: usize| deformable.compliance(particles.material[p], particles.radius[p]);
        self.widening
            .par_iter_mut()
            .zip(&particles.deformation)
            .enumerate()
            .with_min_len(TILE)
            .for_each(|(p, (widening, d))| widening.before = compliance(p).widening(&d.used));
        self.widen(deformable, particles)
    }

    /// Strains from the present guess. Returns the largest size of any particle's strain.
    fn widen(&mut self, deformable: &Deformable, particles: &Particles) -> f64 {
        let largest = |a: f64, b: f64| if a.is_nan() || a > b { a } else { b };
        self.widening
            .par_iter_mut()
            .zip(&self.guess)
            .enumerate()
            .with_min_len(TILE)
            .map(|(p, (widening, guess))| {
                let radius = particles.radius[p];
                widening.now = deformable.compliance(particles.material[p], radius).widening(guess);
                widening.now.contract(&widening.now).sqrt() / radius
            })
            .reduce(|| 0.0, largest)
    }

    /// Forget the dyads of the last evaluation.
    pub fn clear(&mut self) {
        self.dyads.fill(Dyads::default());
        self.held.fill(Held::default());
    }

    /// Add contacts of held particles.
    pub fn hold(&mut self, contacts: &[HeldContact]) {
        for contact in contacts {
            let held = &mut self.held[contact.particle as usize];
            held.side += contact.normal;
            held.net += contact.pressure;
        }
    }

    /// Add what contacts of other tiles did, in fixed order.
    pub fn gather(&mut self, maps: &[&TileMap]) {
        self.dyads.par_chunks_mut(TILE).enumerate().for_each(|(chunk, dyads)| {
            for map in maps {
                for (i, dyads) in dyads.iter_mut().enumerate() {
                    for incoming in map.incoming_dyads(chunk * TILE + i) {
                        *dyads += *incoming;
                    }
                }
            }
        });
    }

    /// Keep all but the elastic normal forces as they are now for the iterations that follow. Other forces depend on the
    /// strains only through the limit of friction, which jumps when a contact closes against its dashpot, and the lever of a
    /// reaction jumps with every contact that opens or closes: iterated, they would not settle.
    pub fn keep_others(&mut self, force: &[Vec3]) {
        let mut kept = std::mem::take(&mut self.kept);
        kept.clear();
        kept.extend((0..self.dyads.len()).map(|p| self.others(p, &force[p])));
        self.kept = kept;
    }

    /// All but the elastic normal forces on particle `p`; `force` is the net contact force.
    #[inline(always)]
    fn others(&self, p: usize, force: &Vec3) -> Kept {
        let Held { side, net } = self.held[p];
        Kept { other: self.dyads[p].other, side, rest: force - net }
    }

    /// All that strains particle `p` with the elastic normal forces of now and what was `kept`, and the part of it that is
    /// reaction, N.
    #[inline(always)]
    fn total(&self, p: usize, kept: &Kept, particles: &Particles) -> (Symmetric, Symmetric) {
        let reaction = reaction(particles, p, &(self.held[p].net + kept.rest), &kept.side);
        (self.dyads[p].normal + kept.other + load_dyad(&particles.loads, p as u32) + reaction, reaction)
    }

    /// Difference between the dyads that the forces of the last evaluation give and those that its strains were computed
    /// from: root of the sum of squares, by that of the former.
    pub fn disagreement(&self, particles: &Particles) -> f64 {
        let (mut change, mut size) = (0.0, 0.0);
        for (p, guess) in self.guess.iter().enumerate() {
            let (result, _) = self.total(p, &self.kept[p], particles);
            let difference = result - *guess;
            change += difference.contract(&difference);
            size += result.contract(&result);
        }
        // No force at all is a solution.
        if change == 0.0 { 0.0 } else { (change / size).sqrt() }
    }

    /// Take over a share `relaxation` of that difference. Returns the largest size of any particle's strain.
    pub fn relax(&mut self, deformable: &Deformable, relaxation: f64, particles: &Particles) -> f64 {
        let mut relaxed = std::mem::take(&mut self.guess);
        for (p, guess) in relaxed.iter_mut().enumerate() {
            let (result, _) = self.total(p, &self.kept[p], particles);
            *guess += (result - *guess) * relaxation;
        }
        self.guess = relaxed;
        self.widen(deformable, particles)
    }

    /// Note the forces of the step, for the next one, and sum up what the deformation did in this one.
    pub fn finish(&self, particles: &mut Particles, force: &[Vec3]) -> DeformationSums {
        let mut deformation = std::mem::take(&mut particles.deformation);
        let parts: Vec<DeformationSums> = deformation
            .par_chunks_mut(TILE)
            .enumerate()
            .map(|(chunk, deformation)| {
                let mut sums = DeformationSums::default();
                for (i, deformation) in deformation.iter_mut().enumerate() {
                    let p = chunk * TILE + i;
                    let (dyad, reaction) = self.total(p, &self.others(p, &force[p]), particles);
                    let new = Deformation { dyad, used: self.guess[p], other: self.dyads[p].other, reaction };
                    let old = std::mem::replace(deformation, new);
                    let Widening { now, before } = self.widening[p];
                    let change = now - before;
                    sums.stored += 0.5 * new.used.contract(&now);
                    sums.lag += 0.5 * ((old.dyad + new.dyad) - (old.used + new.used)).contract(&change);
                    sums.other -= 0.5 * (old.other + new.other).contract(&change);
                    sums.loads += load_dyad(&particles.loads, p as u32).contract(&change);
                    sums.reactions += 0.5 * (old.reaction + new.reaction).contract(&change);
                }
                sums
            })
            .collect();
        particles.deformation = deformation;
        parts.iter().fold(DeformationSums::default(), |a, b| DeformationSums {
            stored: a.stored + b.stored,
            lag: a.lag + b.lag,
            other: a.other + b.other,
            loads: a.loads + b.loads,
            reactions: a.reactions + b.reactions,
        })
    }

    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        self.widening.len() * size_of::<Widening>()
            + self.dyads.len() * size_of::<Dyads>()
            + self.held.len() * size_of::<Held>()
            + self.guess.len() * size_of::<Symmetric>()
            + self.kept.len() * size_of::<Kept>()
    }
}

/// Dyad of the reaction of a prescribed translation, N.
#[inline(always)]
fn reaction(particles: &Particles, p: usize, force: &Vec3, side: &Vec3) -> Symmetric {
    let held = particles.constraint[p].0 & Constraint::TRANSLATION.0;
    if held == 0 {
        return Symmetric::default();
    }
    let (load, _) = particles.load(p as u32);
    let reaction = Vec3::from_fn(|i, _| if held >> i & 1 == 1 { -(force[i] + load[i]) } else { 0.0 });
    Symmetric::product(&reaction_lever(side), &reaction)
}

/// Lever of the reaction of a prescribed translation, by the radius: see
/// [`kinematics::deformable`](crate::kinematics::deformable). `side` is the sum of the directions of the contacts.
pub fn reaction_lever(side: &Vec3) -> Vec3 {
    side / -side.norm().max(1.0)
}

/// Tolerance, limit, and share of the iteration, if there is one.
pub(super) fn iteration(deformable: Option<&Deformable>) -> Option<(f64, u32, f64)> {
    match deformable?.update {
        Update::Lagged => None,
        Update::Iterated { tolerance, maximum, relaxation } => Some((tolerance, maximum, relaxation)),
    }
}
