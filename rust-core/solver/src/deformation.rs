//! Strains of deformable particles from the forces on them
//! ([`kinematics::deformable`](concordem_contact::kinematics::deformable)), and their energies.
//!
//! **Ledger.** In a step the centers approach by the deformation of the contacts and of the particles. Of the
//! trapezoidal work of a contact's normal force, `½(f_o+f)Δu_c` belongs to the contact. The rest, summed over the
//! contacts of a particle, is `½(N_o+N):ΔW` with the particle virial `N` of elastic normal forces and `W = Rε`. Let `T`
//! be the whole particle virial, `S` the virial from which `W` was computed, `X` the part of external loads and
//! reactions, and `O = T − N − X` the part of forces that strain the particle but do not depend on its strain (shear
//! forces). Then
//!
//! `½(N_o+N):ΔW = ½Δ(S:W) + ½[(T_o+T) − (S_o+S)]:ΔW − ½(O_o+O):ΔW − ½(X_o+X):ΔW`.
//!
//! The terms are the change of the energy stored in particles, the dissipation by the lag of the strains behind the forces,
//! the energy gained or lost by shear forces, and the work of loads and reactions on the outer half of the particle. Exact
//! up to the rotation of the normals in one step.

use rayon::prelude::*;

use crate::evaluation::{TILE, TileMap};
use crate::state::particles::load_virial;
use crate::state::{Constraint, Deformation, Particles};
pub use crate::step_sums::DeformationSums;
use concordem_contact::kinematics::deformable::{Deformable, ReactionSums, SurfaceDisplacement, Update, VirialParts};
use concordem_contact::math::{Symmetric, Vec3};

/// Computes the strains of deformable particles. Holds scratch data only.
#[derive(Default)]
pub struct DeformationPass {
    /// Surface displacement of each particle, m; empty if particles are rigid.
    pub surface_displacement: Vec<SurfaceDisplacement>,
    /// Surface displacements one step ago, m. Stored only if most contacts need them, otherwise empty.
    pub surface_displacement_before: Vec<Symmetric>,
    /// Particle virials over the contacts, by particle.
    pub virials: Vec<VirialParts>,
    /// Sums for the reactions of prescribed translations, by particle.
    pub reaction_sums: Vec<ReactionSums>,
    /// Whether `virials` and `reaction_sums` are zero.
    clean: bool,
    /// Particle virials from which the present strains were computed, if strains are iterated; otherwise empty, and
    /// those of the last step apply.
    guess: Vec<Symmetric>,
    /// Forces that keep their values from the first iteration of a step.
    kept: Vec<Kept>,
    /// Sum of squares of the first guess of a step, N²m².
    first_guess: f64,
}

/// Forces on a particle besides elastic normal forces.
#[derive(Debug, Clone, Copy, Default)]
struct Kept {
    /// Virial of the other forces that strain the particle, N.
    other: Symmetric,
    /// Sum of the directions of its contacts, if its translation is prescribed (1).
    side: Vec3,
    /// Sum of the other contact forces, N.
    rest: Vec3,
}

/// The halo is prefetched this many particles ahead.
const PREFETCH_DISTANCE: usize = 8;

impl DeformationPass {
    /// Compute the strains of a step from the forces of the last one, and with `before` also the strains of the last step.
    /// Returns the largest norm of a particle's strain.
    pub fn begin(&mut self, deformable: &Deformable, particles: &mut Particles, before: bool) -> f64 {
        let n = particles.len();
        particles.deformation.resize(n, Deformation::default());
        self.guess.clear();
        if deformable.update != Update::Lagged {
            self.guess.extend(particles.deformation.iter().map(|d| d.virial));
        }
        self.virials.resize(n, VirialParts::default());
        self.reaction_sums.resize(n, ReactionSums::default());
        self.surface_displacement.resize(n, SurfaceDisplacement::default());
        let of = |p: usize, virial: &Symmetric| {
            deformable.compliance(particles.material[p], particles.radius[p]).surface_displacement(virial)
        };
        self.surface_displacement_before.clear();
        if before {
            let rows = particles.deformation.par_iter().enumerate().with_min_len(TILE);
            rows.map(|(p, d)| of(p, &d.used)).collect_into_vec(&mut self.surface_displacement_before);
        }
        let chunks =
            self.surface_displacement.par_chunks_mut(TILE).zip(particles.deformation.par_chunks(TILE)).enumerate();
        chunks
            .map(|(chunk, (surface_displacement, deformation))| {
                pulp::Arch::new().dispatch(
                    #[inline(always)]
                    || {
                        let mut largest = 0.0;
                        for (i, (now, d)) in surface_displacement.iter_mut().zip(deformation).enumerate() {
                            let p = chunk * TILE + i;
                            now.0 = of(p, &d.virial);
                            largest = larger(largest, strain_squared(&now.0, particles.radius[p]));
                        }
                        largest
                    },
                )
            })
            .reduce(|| 0.0, larger)
            .sqrt()
    }

    /// Compute the strains from the present guess. Returns the largest norm of a particle's strain.
    fn update_surface_displacement(&mut self, deformable: &Deformable, particles: &Particles) -> f64 {
        self.surface_displacement
            .par_iter_mut()
            .zip(&self.guess)
            .enumerate()
            .with_min_len(TILE)
            .map(|(p, (surface_displacement, guess))| {
                let radius = particles.radius[p];
                surface_displacement.0 =
                    deformable.compliance(particles.material[p], radius).surface_displacement(guess);
                strain_squared(&surface_displacement.0, radius)
            })
            .reduce(|| 0.0, larger)
            .sqrt()
    }

    /// Reset the sums over contacts before an evaluation.
    pub fn clear(&mut self) {
        if !self.clean {
            self.virials.par_chunks_mut(TILE).for_each(|virials| virials.fill(VirialParts::default()));
            self.reaction_sums
                .par_chunks_mut(TILE)
                .for_each(|reaction_sums| reaction_sums.fill(ReactionSums::default()));
        }
        self.clean = false;
    }

    /// Add the particle virials in the halos, in fixed order.
    pub fn gather(&mut self, maps: &[&TileMap], particles: &Particles, reacting: Constraint) {
        let rows = self.virials.par_iter_mut().zip(&mut self.reaction_sums).enumerate().with_min_len(TILE);
        rows.for_each(|(p, (virials, reaction_sums))| {
            add_incoming(maps, p, virials, particles.constraint[p].any(reacting).then_some(reaction_sums));
        });
    }

    /// Freeze all forces except the elastic normal ones for the iterations that follow. The other forces depend on the
    /// strains only through the friction limit, which jumps when a contact closes against its dashpot, and the arm of a
    /// reaction jumps with every contact that opens or closes. Iterated, they would not converge.
    pub fn keep_others(&mut self, force: &[Vec3]) {
        let mut kept = std::mem::take(&mut self.kept);
        kept.clear();
        kept.extend((0..self.virials.len()).map(|p| others(&self.virials[p].other, &self.reaction_sums[p], &force[p])));
        self.kept = kept;
        self.first_guess = self.guess.iter().map(|guess| guess.contract(guess)).sum();
    }

    /// Relative difference between the particle virials of the last evaluation and those from which its strains were
    /// computed (root of sums of squares). It is relative to the larger of these virials and those at the start of the step:
    /// if all bonds break in a step, the present ones vanish.
    pub fn disagreement(&self, particles: &Particles) -> f64 {
        let (mut change, mut size) = (0.0, 0.0);
        for (p, guess) in self.guess.iter().enumerate() {
            let reaction = reaction_of(p, &self.reaction_sums[p], &self.kept[p], particles);
            let result = total(
                &self.virials[p].normal,
                &self.kept[p].other,
                &load_virial(&particles.loads, p as u32),
                &reaction,
            );
            let difference = result - *guess;
            change += difference.contract(&difference);
            size += result.contract(&result);
        }
        // Without any force, zero strain is the solution.
        if change == 0.0 { 0.0 } else { (change / size.max(self.first_guess)).sqrt() }
    }

    /// Add the fraction `relaxation` of that difference to the guess. Returns the largest norm of a particle's strain.
    pub fn relax(&mut self, deformable: &Deformable, relaxation: f64, particles: &Particles) -> f64 {
        let mut relaxed = std::mem::take(&mut self.guess);
        for (p, guess) in relaxed.iter_mut().enumerate() {
            let reaction = reaction_of(p, &self.reaction_sums[p], &self.kept[p], particles);
            let result = total(
                &self.virials[p].normal,
                &self.kept[p].other,
                &load_virial(&particles.loads, p as u32),
                &reaction,
            );
            *guess += (result - *guess) * relaxation;
        }
        self.guess = relaxed;
        self.update_surface_displacement(deformable, particles)
    }

    /// Store the particle virials for the next step, and sum the energies of this one. Adds the halos in `maps` first;
    /// pass none if [`Self::gather`] has already added them.
    pub fn finish(
        &mut self,
        deformable: &Deformable,
        particles: &mut Particles,
        force: &[Vec3],
        maps: &[&TileMap],
    ) -> DeformationSums {
        let mut deformation = std::mem::take(&mut particles.deformation);
        let Self { virials, reaction_sums, guess, .. } = self;
        let (particles_now, guess, reacting) = (&*particles, &*guess, deformable.reacting());
        let chunks =
            deformation.par_chunks_mut(TILE).zip(virials.par_chunks_mut(TILE)).zip(reaction_sums.par_chunks_mut(TILE));
        // Uses the widest instructions of the processor. The bits are the same, because nothing is fused or reordered.
        let parts = chunks.enumerate().map(|(chunk, ((deformation, virials), reaction_sums))| {
            pulp::Arch::new().dispatch(
                #[inline(always)]
                || {
                    let mut sums = DeformationSums::default();
                    for (i, ((deformation, virials), reaction_sums)) in
                        deformation.iter_mut().zip(virials).zip(reaction_sums).enumerate()
                    {
                        let p = chunk * TILE + i;
                        for map in maps {
                            map.prefetch_virials(p + PREFETCH_DISTANCE);
                        }
                        let mut reaction = Symmetric::default();
                        if particles_now.constraint[p].any(reacting) {
                            add_incoming(maps, p, virials, Some(reaction_sums));
                            let reaction_sums = std::mem::take(reaction_sums);
                            reaction = reaction_of(
                                p,
                                &reaction_sums,
                                &others(&virials.other, &reaction_sums, &force[p]),
                                particles_now,
                            );
                        } else {
                            add_incoming(maps, p, virials, None);
                        }
                        let VirialParts { normal, other } = std::mem::take(virials);
                        let load = load_virial(&particles_now.loads, p as u32);
                        let virial = total(&normal, &other, &load, &reaction);
                        let used = guess.get(p).copied().unwrap_or(deformation.virial);
                        let new = Deformation { virial, used, other, reaction };
                        let old = std::mem::replace(deformation, new);
                        let compliance = deformable.compliance(particles_now.material[p], particles_now.radius[p]);
                        let now = compliance.surface_displacement(&new.used);
                        let change = now - compliance.surface_displacement(&old.used);
                        sums.stored += 0.5 * new.used.contract(&now);
                        sums.lag += 0.5 * ((old.virial + new.virial) - (old.used + new.used)).contract(&change);
                        sums.other -= 0.5 * (old.other + new.other).contract(&change);
                        sums.loads += load.contract(&change);
                        sums.reactions += 0.5 * (old.reaction + new.reaction).contract(&change);
                    }
                    sums
                },
            )
        });
        let parts: Vec<DeformationSums> = parts.collect();
        self.clean = true;
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
        self.surface_displacement.len() * size_of::<SurfaceDisplacement>()
            + self.surface_displacement_before.len() * size_of::<Symmetric>()
            + self.virials.len() * size_of::<VirialParts>()
            + self.reaction_sums.len() * size_of::<ReactionSums>()
            + self.guess.len() * size_of::<Symmetric>()
            + self.kept.len() * size_of::<Kept>()
    }
}

/// Add the halos' contributions to the virial of particle `p`, in fixed order. Pass `reaction_sums` if its translation is
/// prescribed.
#[inline(always)]
fn add_incoming(maps: &[&TileMap], p: usize, virials: &mut VirialParts, mut reaction_sums: Option<&mut ReactionSums>) {
    for map in maps {
        for incoming in map.incoming_virials(p) {
            *virials += incoming.parts();
            if let Some(reaction_sums) = &mut reaction_sums {
                reaction_sums.add_opposite(incoming);
            }
        }
    }
}

/// All forces on a particle except the elastic normal ones. `other`: virial of the other contact forces, N; `force`:
/// net contact force, N.
#[inline(always)]
fn others(other: &Symmetric, reaction_sums: &ReactionSums, force: &Vec3) -> Kept {
    Kept { other: *other, side: reaction_sums.side, rest: force - reaction_sums.net }
}

/// The whole particle virial, N: elastic normal forces, other contact forces, external loads, and the reaction.
#[inline(always)]
fn total(normal: &Symmetric, other: &Symmetric, load: &Symmetric, reaction: &Symmetric) -> Symmetric {
    *normal + *other + *load + *reaction
}

/// `ε:ε` of a particle with the surface displacement `Rε` (m) and radius (m).
#[inline(always)]
fn strain_squared(surface_displacement: &Symmetric, radius: f64) -> f64 {
    surface_displacement.contract(surface_displacement) / (radius * radius)
}

/// The larger number; NaN counts as the largest.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

/// Virial of the reaction of a prescribed translation, N, from the present elastic normal forces and the `kept` others.
#[inline(always)]
fn reaction_of(p: usize, reaction_sums: &ReactionSums, kept: &Kept, particles: &Particles) -> Symmetric {
    let prescribed = particles.constraint[p].0 & Constraint::TRANSLATION.0;
    if prescribed == 0 {
        return Symmetric::default();
    }
    let force = reaction_sums.net + kept.rest;
    let (load, _) = particles.load(p as u32);
    let reaction = Vec3::from_fn(|i, _| if prescribed >> i & 1 == 1 { -(force[i] + load[i]) } else { 0.0 });
    Symmetric::product(&reaction_arm(&kept.side), &reaction)
}

/// Arm of the reaction of a prescribed translation over the radius: see
/// [`kinematics::deformable`](concordem_contact::kinematics::deformable). `side` is the sum of the directions of the
/// contacts.
pub fn reaction_arm(side: &Vec3) -> Vec3 {
    side / -side.norm().max(1.0)
}

/// Tolerance, largest number of iterations, and relaxation factor, if strains are iterated.
pub(super) fn iteration(deformable: Option<&Deformable>) -> Option<(f64, u32, f64)> {
    match deformable?.update {
        Update::Lagged => None,
        Update::Iterated { tolerance, maximum, relaxation } => Some((tolerance, maximum, relaxation)),
    }
}
