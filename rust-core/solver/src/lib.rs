//! One step after the other: find, measure, respond, accumulate, integrate.
//!
//! The solver holds scratch only. It can be dropped and made anew from a [`State`] without changing the next step by
//! one bit.

pub mod coupling;
pub mod deformation;
pub mod energy;
pub mod forces;
pub mod fracture;
pub mod integrate;
mod lanczos;
pub mod laws;
pub mod neighbor;
pub mod record;
pub mod state;
pub mod time_step;
pub mod walls;

use crate::fracture::virial::{self, HydrostaticStrength};
use crate::neighbor::{NeighborError, VerletList, candidate_pairs};
use crate::state::contacts::{BrokenBond, ContactFlags, Contacts, Pair};
use crate::state::{Cell, Constraint, Particles, State};
use concordem_contact::kinematics::deformable::{Deformable, ParticleVirials};
use concordem_contact::kinematics::{MotionMeasure, Pose, PreviousGeometry, sphere_sphere};
use concordem_contact::law::EnergySplit;
use concordem_contact::math::{Mat3, Vec3};
use deformation::{DeformationPass, DeformationSums};
use forces::{BondEvent, EvaluatedContacts, StepContext, TileMap};
use integrate::{Damping, KickContext, KickSums};
use rayon::prelude::*;

/// Integration scheme.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// Central differences, velocities given at −½Δt.
    #[default]
    Leapfrog,
    /// The same recursion, velocities given at time 0 (first kick half a step).
    VelocityVerlet,
}

/// Which row of a law's parameter table serves which pair of materials.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PairCoefficients {
    count: usize,
    rows: Vec<u16>,
}

impl PairCoefficients {
    /// No interaction.
    pub const NONE: u16 = u16::MAX;

    /// Table of `count` materials without any interaction.
    pub fn new(count: usize) -> Self {
        Self { count, rows: vec![Self::NONE; count * count] }
    }

    /// Let a particle of material `a` and one of `b`, in this order, interact by `row`.
    pub fn set(&mut self, a: u16, b: u16, row: u16) {
        self.rows[a as usize * self.count + b as usize] = row;
    }

    /// Row of materials `a`, `b`.
    pub fn get(&self, a: u16, b: u16) -> Option<u16> {
        self.rows.get(a as usize * self.count + b as usize).copied().filter(|&row| row != Self::NONE)
    }
}

/// What stays constant while the solver steps.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// How motion is measured.
    pub mode: MotionMeasure,
    /// Integration scheme.
    pub scheme: Scheme,
    /// Artificial damping.
    pub damping: Damping,
    /// Gravity, m/s².
    pub gravity: Vec3,
    /// Damage at which a bond enters the event log.
    pub damage_threshold: f64,
    /// Parameter rows of unbonded contacts by material.
    pub contact_rows: PairCoefficients,
    /// Parameter rows of wall contacts by material.
    pub wall_rows: PairCoefficients,
    /// Skin of the neighbour search, as a share of the smallest radius.
    pub skin: f64,
    /// Thresholds of the failure of whole particles.
    pub hydrostatic_strength: HydrostaticStrength,
    /// How particles deform, if they do.
    pub deformable: Option<Deformable>,
}

impl Default for Model {
    fn default() -> Self {
        Self {
            mode: MotionMeasure::Finite,
            scheme: Scheme::Leapfrog,
            damping: Damping::None,
            gravity: Vec3::zeros(),
            damage_threshold: 0.9,
            contact_rows: PairCoefficients::default(),
            wall_rows: PairCoefficients::default(),
            skin: 0.2,
            hydrostatic_strength: HydrostaticStrength::default(),
            deformable: None,
        }
    }
}

/// What can go wrong in a step.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SolverError {
    /// The neighbour search refused.
    #[error("neighbour search at step {step}: {source}")]
    Neighbor {
        /// Step.
        step: u64,
        /// Why.
        source: NeighborError,
    },
    /// The strains of deformable particles do not settle.
    #[error(
        "at step {step} the strains of the deformable particles did not settle: after {iterations} iterations they still \
         change by {change:.3e} of their size. The spectral radius of the iteration may be too large for the relaxation: \
         `concordem check` prints it; lower deformable.relaxation below 2/(1 + spectral radius), or raise \
         deformable.maximum_iterations"
    )]
    NotConverged {
        /// Step.
        step: u64,
        /// Iterations done.
        iterations: u32,
        /// Relative change in the last of them.
        change: f64,
    },
    /// A contact law that knows nothing of deformable particles.
    #[error(
        "the law \"{law}\" does not know deformable particles; use \"linear_bond\", \"frictional\", or \
         \"hertz_mindlin\", or particles that do not deform"
    )]
    NotDeformable {
        /// Name of the law.
        law: &'static str,
    },
    /// Something is no longer a number.
    #[error(
        "at step {step} (t = {time} s) the motion is no longer finite; the particle with id {id} is the first one. \
         The time step may be too large: `concordem check` prints its bound"
    )]
    NotFinite {
        /// Step.
        step: u64,
        /// Time, s.
        time: f64,
        /// Id of the first particle concerned.
        id: u32,
    },
}

/// What a step reports.
#[derive(Debug, Clone, Default)]
pub struct StepReport {
    /// Energies of all contacts.
    pub energy: EnergySplit,
    /// `Σ l⊗f` over all particle contacts, J (periodic scenes only).
    pub virial: Mat3,
    /// Sums of the kick.
    pub kick: KickSums,
    /// Contacts that carry something: bonds, unbonded, walls.
    pub active: [u64; 3],
    /// Incidents by bond block.
    pub bond_events: Vec<(usize, BondEvent)>,
    /// `Σ|f|²` over all contacts, N², if sampled.
    pub force_squared: f64,
    /// Whether neighbours were searched anew in this step.
    pub searched: bool,
    /// Evaluations of the contact forces, more than one where strains are iterated.
    pub evaluations: u32,
    /// What the deformation of particles did.
    pub deformation: DeformationSums,
}

/// Steps a state. Scratch only.
pub struct Solver {
    model: Model,
    bond_maps: Vec<TileMap>,
    contact_map: TileMap,
    verlet: Option<VerletList>,
    wall_positions: Vec<Vec3>,
    force: Vec<Vec3>,
    torque: Vec<Vec3>,
    poses: Vec<Pose>,
    /// Whether they have orientations.
    oriented: bool,
    pass: DeformationPass,
    /// Strain of particles up to which the candidates are complete.
    strain_margin: f64,
    gradient_change: Option<Mat3>,
    targets: Option<Vec<(Vec3, Vec3)>>,
    searches: u64,
    /// Particles per tile.
    tile: usize,
    /// Which particles are of this solver's share, see [`Self::for_subdomain`]; empty: all.
    owned: Vec<bool>,
}

impl Solver {
    /// A solver for `state`.
    pub fn new(model: Model, state: &mut State) -> Result<Self, SolverError> {
        Self::with_tiles(model, state, forces::TILE, Vec::new())
    }

    /// A solver that finds the forces of one share of a distributed computation ([`Self::find_forces`]); motion is its host's.
    ///
    /// `owned` tells which particles are of this share; the others are copies of neighbours from other shares. The state
    /// must hold every contact of an owned particle. A contact of particles from two shares is evaluated in both, which
    /// finds the same bits, and its energies are counted where A is owned (elsewhere the link has
    /// [`ContactFlags::NOT_OWNED`], which the search sets on the contacts it begins; on bonds the host sets it). Net forces
    /// are complete on owned particles only.
    ///
    /// Contacts are added in the order of their pairs, one after the other. With particles in the order of names that
    /// all shares know, the net forces do not depend on how the particles are shared out, not by a bit.
    pub fn for_subdomain(model: Model, state: &mut State, owned: Vec<bool>) -> Result<Self, SolverError> {
        let tile = state.particles.len().max(1);
        Self::with_tiles(model, state, tile, owned)
    }

    fn with_tiles(model: Model, state: &mut State, tile: usize, owned: Vec<bool>) -> Result<Self, SolverError> {
        let n = state.particles.len();
        let mut solver = Self {
            model,
            tile,
            owned,
            bond_maps: Vec::new(),
            contact_map: TileMap::default(),
            verlet: None,
            wall_positions: Vec::new(),
            force: vec![Vec3::zeros(); n],
            torque: vec![Vec3::zeros(); n],
            poses: Vec::new(),
            oriented: false,
            pass: DeformationPass::default(),
            strain_margin: 0.0,
            gradient_change: None,
            targets: None,
            searches: 0,
        };
        for block in &mut state.bonds {
            block.contacts_mut().sort();
        }
        if solver.model.deformable.is_some() {
            let mut blocks = state.bonds.iter().chain(&state.contacts).map(|block| block.contacts());
            if let Some(block) = blocks.find(|block| !block.deforms()) {
                return Err(SolverError::NotDeformable { law: block.law() });
            }
        }
        let strain = solver.begin_deformation(state);
        solver.search(state, strain)?;
        Ok(solver)
    }

    /// The model.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The model, to change damping or gravity between steps.
    pub fn model_mut(&mut self) -> &mut Model {
        &mut self.model
    }

    /// Net contact force on each particle in the last step, N.
    pub fn forces(&self) -> &[Vec3] {
        &self.force
    }

    /// Net contact torque on each particle in the last step, N·m.
    pub fn torques(&self) -> &[Vec3] {
        &self.torque
    }

    /// Number of neighbour searches so far.
    pub fn searches(&self) -> u64 {
        self.searches
    }

    /// Memory of the solver's scratch in bytes.
    pub fn scratch_bytes(&self) -> usize {
        self.bond_maps.iter().map(TileMap::bytes).sum::<usize>()
            + self.contact_map.bytes()
            + (48 + size_of::<Pose>()) * self.force.len()
            + self.pass.bytes()
    }

    /// From the next kick on, the cell deforms with this velocity gradient (1/s) and all particles with it, but for
    /// constrained components (see [`KickContext::gradient_change`]).
    pub fn set_velocity_gradient(&mut self, cell: &Cell, gradient: Mat3) {
        self.gradient_change = Some(gradient - cell.velocity_gradient);
    }

    /// Velocities (translation, rotation) that constrained degrees of freedom take at the next kick, by particle;
    /// `None`: they keep what they have.
    pub fn set_targets(&mut self, targets: Option<Vec<(Vec3, Vec3)>>) {
        self.targets = targets;
    }

    /// Those velocities, to be changed in place; to begin with they are the present ones of `particles`.
    pub fn targets_mut(&mut self, particles: &Particles) -> &mut [(Vec3, Vec3)] {
        self.targets.get_or_insert_with(|| {
            particles.velocity.iter().copied().zip(particles.angular_velocity.iter().copied()).collect()
        })
    }

    /// Strains that the forces of the last step make; the largest of them.
    fn begin_deformation(&mut self, state: &mut State) -> f64 {
        match &self.model.deformable {
            Some(deformable) => {
                // What few ask for is found for them alone.
                let blocks = state.bonds.iter().chain(&state.contacts).chain(&state.wall_contacts);
                let asking =
                    blocks.filter(|block| block.reads_old_elongation()).map(|block| block.len()).sum::<usize>();
                let particles = &mut state.particles;
                self.pass.begin(deformable, particles, asking > particles.len())
            }
            None => 0.0,
        }
    }

    /// Find neighbours anew: drop broken bonds, hand their pairs to the unbonded contacts, renew candidates, and renew
    /// the maps. Candidates hold while no strain of a particle is larger than twice `strain`, or 1e-4.
    fn search(&mut self, state: &mut State, strain: f64) -> Result<(), SolverError> {
        self.searches += 1;
        let step = state.clock.step;
        let particles = &state.particles;
        let n = particles.len();
        let smallest = particles.radius.iter().copied().fold(f64::INFINITY, f64::min);
        let largest = particles.radius.iter().copied().fold(0.0, f64::max);
        let skin = if n > 0 { self.model.skin * smallest } else { 0.0 };
        self.strain_margin = if self.model.deformable.is_some() { (2.0 * strain).max(1e-4) } else { 0.0 };
        let widest = 1.0 + self.strain_margin;
        let neighbor = |source| SolverError::Neighbor { step, source };
        // Pairs that are bonded do not interact otherwise; broken ones with a kept reference go on from it.
        let mut bonded: Vec<(Pair, [i8; 3])> = Vec::new();
        let mut kept = Vec::new();
        for (place, block) in state.bonds.iter_mut().enumerate() {
            let block = block.contacts_mut();
            let mut any_broken = false;
            for k in 0..block.len() {
                let view = block.view(k);
                if view.link.has(ContactFlags::BROKEN) {
                    any_broken = true;
                    // The host of a share keeps its own account, over all shares.
                    if self.owned.is_empty() {
                        let (image, block) = (view.link.image, place as u16);
                        let (pair, reference, frame) = (view.pair, view.reference, view.frame);
                        state.broken.push(BrokenBond { block, pair, image, reference, frame });
                    }
                    if let Some(reference) = block.kept_reference(k) {
                        kept.push(((view.pair, view.link.image), reference, view.frame));
                    }
                } else if state.contacts.is_some() {
                    bonded.push((view.pair, view.link.image));
                }
            }
            if any_broken {
                block.retain_links(&|link| !link.has(ContactFlags::BROKEN));
            }
        }
        bonded.sort_unstable();
        kept.sort_unstable_by_key(|k| k.0);
        if let Some(block) = &mut state.contacts {
            let block = block.contacts_mut();
            let reach: Vec<f64> = particles.radius.iter().map(|r| r * widest + 0.5 * skin).collect();
            let candidates = candidate_pairs(&particles.position, &reach, state.cell.as_ref()).map_err(neighbor)?;
            // Contacts with history stay, those with a kept reference as well while they may touch again.
            block.retain_links(&|link| link.has(ContactFlags::ACTIVE) || link.has(ContactFlags::KEPT_REFERENCE));
            let present: Vec<(Pair, [i8; 3])> = (0..block.len())
                .map(|k| {
                    let view = block.view(k);
                    (view.pair, view.link.image)
                })
                .collect();
            for ((pair, image), reference, frame) in kept {
                if present.binary_search(&(pair, image)).is_err()
                    && let Some(row) = self
                        .model
                        .contact_rows
                        .get(particles.material[pair.a as usize], particles.material[pair.b as usize])
                {
                    let flags = ContactFlags::KEPT_REFERENCE | self.elsewhere(pair);
                    let link = ContactFlags { row, flags, image, padding: 0 };
                    block.push(pair, link, reference, frame);
                    bonded.push((pair, image));
                }
            }
            bonded.sort_unstable();
            for candidate in candidates {
                let pair = Pair { a: candidate.a, b: candidate.b };
                let (a, b) = (pair.a as usize, pair.b as usize);
                let key = (pair, candidate.image);
                if bonded.binary_search(&key).is_ok() || present.binary_search(&key).is_ok() {
                    continue;
                }
                if particles.clump[a] == particles.clump[b] && particles.clump[a] != u32::MAX {
                    continue;
                }
                if !self.owned.is_empty() && !self.owned[a] && !self.owned[b] {
                    continue;
                }
                let Some(row) = self.model.contact_rows.get(particles.material[a], particles.material[b]) else {
                    continue;
                };
                let shift = state.cell.map_or(Vec3::zeros(), |cell| cell.shift(candidate.image));
                let frame = sphere_sphere::initial_geometry(&particles.position[a], &particles.position[b], &shift);
                let link = ContactFlags { row, flags: self.elsewhere(pair), image: candidate.image, padding: 0 };
                block.push(pair, link, concordem_contact::law::Reference::default(), frame);
            }
            block.sort();
            self.contact_map = TileMap::new(block, n, self.tile);
        }
        if let Some(block) = &mut state.wall_contacts {
            let wall_skin = skin + self.strain_margin * largest;
            search_walls(block.contacts_mut(), &self.model, &state.walls, &state.particles, wall_skin)
                .map_err(neighbor)?;
        }
        self.wall_positions = state.walls.iter().map(|wall| wall.displacement).collect();
        self.bond_maps = state.bonds.iter().map(|block| TileMap::new(block.contacts(), n, self.tile)).collect();
        self.verlet = (state.contacts.is_some() || state.wall_contacts.is_some()).then(|| {
            // The longest distance that matters is that of touching spheres.
            VerletList::new(&state.particles.position, state.cell.as_ref(), skin, 2.0 * largest * widest)
        });
        Ok(())
    }

    /// The flag of a contact that begins and is counted in another share, if it is.
    fn elsewhere(&self, pair: Pair) -> u8 {
        let counted = self.owned.is_empty() || self.owned[pair.a as usize];
        if counted { 0 } else { ContactFlags::NOT_OWNED }
    }

    fn needs_search(&self, state: &State, strain: f64) -> bool {
        let Some(verlet) = &self.verlet else { return false };
        // A NaN is found when the motion is looked at.
        if strain > self.strain_margin {
            return true;
        }
        if state.wall_contacts.is_some() && self.walls_may_be_missed(state, verlet) {
            return true;
        }
        verlet.needs_rebuild(&state.particles.position, state.cell.as_ref())
    }

    /// Wall candidates were sought within one skin: particle and wall together must not have moved that far.
    fn walls_may_be_missed(&self, state: &State, verlet: &VerletList) -> bool {
        let wall = state
            .walls
            .iter()
            .zip(&self.wall_positions)
            .map(|(wall, old)| (wall.displacement - old).norm())
            .fold(0.0, f64::max);
        let allowed = verlet.skin - wall;
        let moved = |(now, then): (&Vec3, &Vec3)| (now - then).norm_squared() < allowed * allowed;
        allowed <= 0.0 || !state.particles.position.par_iter().zip(&verlet.positions).all(moved)
    }

    /// Forces of all contacts at the present positions: those that the next step will find (with iterated deformation, for
    /// the strains it begins with). Changes nothing but that neighbours are searched now if the next step would search
    /// them.
    pub fn record(&mut self, state: &mut State) -> Result<record::Forces, SolverError> {
        let strain = self.begin_deformation(state);
        if self.needs_search(state, strain) {
            self.search(state, strain)?;
        }
        let context = StepContext {
            particles: &state.particles,
            poses: &[],
            oriented: false,
            cell: state.cell.as_ref(),
            mode: self.model.mode,
            dt: state.clock.dt,
            damage_threshold: self.model.damage_threshold,
            sample: false,
            surface_displacement: &self.pass.surface_displacement,
            surface_displacement_before: &self.pass.surface_displacement_before,
            deformable: self.model.deformable.as_ref(),
            dashpots_strain: false,
            reacting: Constraint::FREE,
        };
        let mut forces = record::Forces::default();
        for block in state.bonds.iter().chain(&state.contacts) {
            block.record(&context, &mut forces.contacts);
        }
        if let Some(block) = &state.wall_contacts {
            block.record_walls(&context, &state.walls, &mut forces.walls);
        }
        Ok(forces)
    }

    /// For hosts that integrate the motion themselves: forces at the present positions ([`Self::forces`],
    /// [`Self::torques`]), to which the host has moved the particles (with the velocities, and `rotation_increment` and
    /// orientation, of the step that led there). Histories advance by one step; pairs whose bond broke are handed to the
    /// unbonded contacts. Clock, ledger, walls, cell, and external loads are left to the host. [`Self::step`] is this
    /// followed by kick and drift, with the same bits.
    ///
    /// With `sample`, stored energies are summed up, too; see [`Self::step_with`].
    pub fn find_forces(&mut self, state: &mut State, sample: bool) -> Result<StepReport, SolverError> {
        let mut report = StepReport::default();
        let (_, strain) = self.search_and_evaluate(state, sample, &mut report)?;
        if report.bond_events.iter().any(|(_, bond_event)| bond_event.broke) {
            self.search(state, strain)?;
        }
        Ok(report)
    }

    /// The part of a step before the kick: strains, neighbours, forces, and particles that fail. Returns
    /// `Σ f⊗image` over contacts across the periodic border and the largest strain.
    fn search_and_evaluate(
        &mut self,
        state: &mut State,
        sample: bool,
        report: &mut StepReport,
    ) -> Result<(Mat3, f64), SolverError> {
        let mut strain = self.begin_deformation(state);
        if self.needs_search(state, strain) {
            self.search(state, strain)?;
            report.searched = true;
        }
        let mut blocks = state.bonds.iter().chain(&state.contacts);
        self.oriented = blocks.any(|block| block.reads_orientations());
        state.particles.poses(self.oriented, &mut self.poses);
        let iterated = deformation::iteration(self.model.deformable.as_ref()).is_some();
        let crossing = if iterated {
            self.evaluate_iterated(state, sample, report, &mut strain)?
        } else {
            self.evaluate(state, sample, report)
        };
        if let Some(deformable) = &self.model.deformable {
            let maps = if iterated { Vec::new() } else { maps(&self.bond_maps, &self.contact_map, state) };
            report.deformation = self.pass.finish(deformable, &mut state.particles, &self.force, &maps);
        }
        if self.model.hydrostatic_strength.is_active()
            && let Some(stress) = virial::mean_stress(state, self.model.hydrostatic_strength.planar)
        {
            virial::release(state, &self.model.hydrostatic_strength, &stress);
        }
        Ok((crossing, strain))
    }

    /// Advance the state by one step: forces at the present positions, kick, drift.
    pub fn step(&mut self, state: &mut State) -> Result<StepReport, SolverError> {
        self.step_with(state, true)
    }

    /// [`Self::step`]; stored energies and the sum of squares of the contact forces are only valid if `sample` (the
    /// ledger's residual too). Leaving them out saves time; what is dissipated is booked at every step.
    pub fn step_with(&mut self, state: &mut State, sample: bool) -> Result<StepReport, SolverError> {
        let mut report = StepReport::default();
        // The first step sets the ledger's initial energy.
        let sample = sample || !state.ledger.started;
        let dt = state.clock.dt;
        let (crossing, strain) = self.search_and_evaluate(state, sample, &mut report)?;
        let bonds_changed = report.bond_events.iter().any(|(_, bond_event)| bond_event.broke);
        // What the damping remembers; particles that come into it start from nothing.
        let remembered = if self.model.damping.remembers() { state.particles.len() } else { 0 };
        if state.particles.previous.len() != remembered {
            state.particles.previous = vec![[Vec3::zeros(); 2]; remembered];
        }

        let fraction = if self.model.scheme == Scheme::VelocityVerlet && state.clock.step == 0 { 0.5 } else { 1.0 };
        let kick = KickContext {
            dt,
            fraction,
            gravity: self.model.gravity,
            damping: self.model.damping,
            cell: state.cell.as_ref(),
            gradient_change: self.gradient_change,
            convective: matches!(self.model.mode, MotionMeasure::Yade | MotionMeasure::YadeRatcheting),
            targets: self.targets.as_deref(),
        };
        report.kick = integrate::kick_and_drift(&kick, &mut state.particles, &self.force, &self.torque);
        integrate::advance_clumps(
            &kick,
            state.clumps.as_mut_slice(),
            &mut state.particles,
            &self.force,
            &self.torque,
            &mut report.kick,
        );

        let mut others = [0.0; 2];
        report.kick.external[0] += report.deformation.loads;
        if let Some(cell) = &mut state.cell {
            if let Some(change) = self.gradient_change.take() {
                cell.velocity_gradient += change;
            }
            let half_before = 0.5 * crossing.component_mul(&cell.matrix_change).sum();
            cell.matrix_change = cell.velocity_gradient * cell.matrix * dt;
            cell.matrix += cell.matrix_change;
            cell.deformation_gradient += cell.velocity_gradient * cell.deformation_gradient * dt;
            others = [half_before, 0.5 * crossing.component_mul(&cell.matrix_change).sum()];
        }
        for wall in &mut state.walls {
            let half = -0.5 * wall.force.dot(&wall.velocity) * dt;
            others[0] += half;
            others[1] += half;
            wall.displacement += wall.velocity * dt;
        }
        others[0] += report.deformation.reactions;
        state.ledger.book(&report.energy, &report.kick, &report.deformation, others);
        state.clock.step += 1;
        if !report.kick.max_speed_squared.is_finite() || !report.kick.kinetic.is_finite() {
            let bad = state
                .particles
                .velocity
                .iter()
                .zip(&state.particles.angular_velocity)
                .position(|(v, w)| !(v.norm_squared() + w.norm_squared()).is_finite());
            return Err(SolverError::NotFinite {
                step: state.clock.step,
                time: state.clock.time(),
                id: bad.map_or(u32::MAX, |p| state.particles.id[p]),
            });
        }
        if bonds_changed {
            self.search(state, strain)?;
        }
        Ok(report)
    }

    /// All contact forces at the present positions and strains: net forces and torques, dyads, and the report's sums;
    /// histories advance. Returns `Σ f⊗image` over contacts across the periodic border.
    fn evaluate(&mut self, state: &mut State, sample: bool, report: &mut StepReport) -> Mat3 {
        self.force.fill(Vec3::zeros());
        self.torque.fill(Vec3::zeros());
        self.pass.clear();
        report.evaluations += 1;
        let (force, torque, pass) = (&mut self.force[..], &mut self.torque[..], &mut self.pass);
        let DeformationPass { surface_displacement, surface_displacement_before, dyads, held, .. } = pass;
        let mut virials =
            if self.model.deformable.is_some() { ParticleVirials { dyads, held } } else { ParticleVirials::default() };
        let reacting = self.model.deformable.as_ref().map_or(Constraint::FREE, Deformable::reacting);
        let context = StepContext {
            particles: &state.particles,
            poses: &self.poses,
            oriented: self.oriented,
            cell: state.cell.as_ref(),
            mode: self.model.mode,
            dt: state.clock.dt,
            damage_threshold: self.model.damage_threshold,
            sample,
            surface_displacement,
            surface_displacement_before,
            deformable: self.model.deformable.as_ref(),
            dashpots_strain: self.model.deformable.as_ref().is_some_and(|d| d.dashpots),
            reacting,
        };
        let mut crossing = Mat3::zeros();
        let mut merge = |totals: forces::Totals, kind: usize, block: usize| {
            report.energy += totals.energy;
            report.virial += totals.virial;
            crossing += totals.crossing;
            report.active[kind] += totals.active;
            report.force_squared += totals.force_squared;
            report.bond_events.extend(totals.bond_events.into_iter().map(|bond_event| (block, bond_event)));
        };
        for (k, (block, map)) in state.bonds.iter_mut().zip(&mut self.bond_maps).enumerate() {
            merge(block.evaluate(&context, map, force, torque, virials.reborrow()), 0, k);
        }
        if let Some(block) = &mut state.contacts {
            let mut totals = block.evaluate(&context, &mut self.contact_map, force, torque, virials.reborrow());
            totals.bond_events.clear();
            merge(totals, 1, usize::MAX);
        }
        if let Some(block) = &mut state.wall_contacts {
            let mut totals = block.evaluate_walls(&context, &mut state.walls, force, torque, virials.reborrow());
            totals.bond_events.clear();
            merge(totals, 2, usize::MAX);
        }
        let maps = maps(&self.bond_maps, &self.contact_map, state);
        integrate::gather(force, torque, &maps);
        // Otherwise [`DeformationPass::finish`] gathers.
        if deformation::iteration(self.model.deformable.as_ref()).is_some() {
            pass.gather(&maps, &state.particles, reacting);
        }
        crossing
    }

    /// [`Self::evaluate`] again and again, each time from the histories at the beginning of the step, until strains and
    /// forces agree.
    fn evaluate_iterated(
        &mut self,
        state: &mut State,
        sample: bool,
        report: &mut StepReport,
        strain: &mut f64,
    ) -> Result<Mat3, SolverError> {
        let Some((tolerance, maximum, relaxation)) = deformation::iteration(self.model.deformable.as_ref()) else {
            return Ok(self.evaluate(state, sample, report));
        };
        let mut change = f64::INFINITY;
        let mut start = Histories::of(state);
        for iteration in 0..maximum {
            if iteration > 0 {
                if let Some(deformable) = &self.model.deformable {
                    *strain = self.pass.relax(deformable, relaxation, &state.particles);
                }
                // A bond that broke once stays so: bonds that break and heal in turn would keep strains from settling.
                start.release(&report.bond_events);
                start.restore(state);
                if self.needs_search(state, *strain) {
                    self.search(state, *strain)?;
                    report.searched = true;
                    start = Histories::of(state);
                }
            }
            let StepReport { searched, evaluations, .. } = *report;
            *report = StepReport { searched, evaluations, ..StepReport::default() };
            let crossing = self.evaluate(state, sample, report);
            if iteration == 0 {
                self.pass.keep_others(&self.force);
            }
            change = self.pass.disagreement(&state.particles);
            if change <= tolerance {
                return Ok(crossing);
            }
        }
        Err(SolverError::NotConverged { step: state.clock.step, iterations: maximum, change })
    }
}

/// Maps of all blocks between particles.
fn maps<'a>(bonds: &'a [TileMap], contacts: &'a TileMap, state: &State) -> Vec<&'a TileMap> {
    bonds.iter().chain(state.contacts.is_some().then_some(contacts)).collect()
}

/// Contacts as they were.
struct Histories {
    bonds: Vec<Box<dyn EvaluatedContacts>>,
    contacts: Option<Box<dyn EvaluatedContacts>>,
    wall_contacts: Option<Box<dyn EvaluatedContacts>>,
}

impl Histories {
    fn of(state: &State) -> Self {
        Self {
            bonds: state.bonds.iter().map(|block| block.boxed_clone()).collect(),
            contacts: state.contacts.as_ref().map(|block| block.boxed_clone()),
            wall_contacts: state.wall_contacts.as_ref().map(|block| block.boxed_clone()),
        }
    }

    /// Let go of the bonds that broke among `bond_events`: they break when they are evaluated.
    fn release(&mut self, bond_events: &[(usize, BondEvent)]) {
        for (k, block) in self.bonds.iter_mut().enumerate() {
            let broke = |(at, bond_event): &&(usize, BondEvent)| *at == k && bond_event.broke;
            let mut pairs: Vec<Pair> =
                bond_events.iter().filter(broke).map(|(_, bond_event)| bond_event.pair).collect();
            if !pairs.is_empty() {
                pairs.sort_unstable();
                block.contacts_mut().release(&|pair| pairs.binary_search(pair).is_ok());
            }
        }
    }

    fn restore(&self, state: &mut State) {
        state.bonds = self.bonds.iter().map(|block| block.boxed_clone()).collect();
        state.contacts = self.contacts.as_ref().map(|block| block.boxed_clone());
        state.wall_contacts = self.wall_contacts.as_ref().map(|block| block.boxed_clone());
    }
}

/// Renew the candidates of wall contacts; those with history stay.
fn search_walls(
    block: &mut dyn Contacts,
    model: &Model,
    walls: &[state::Wall],
    particles: &Particles,
    skin: f64,
) -> Result<(), NeighborError> {
    block.retain_links(&|link| link.has(ContactFlags::ACTIVE));
    let present: Vec<Pair> = (0..block.len()).map(|k| block.view(k).pair).collect();
    let elements = walls::element_table(walls);
    let mut pairs = Vec::new();
    let n = particles.len();
    let mut bounded = Vec::new();
    for (number, &(w, e)) in elements.iter().enumerate() {
        let wall = &walls[w as usize];
        if let Some(ball) = wall.bounds(e as usize) {
            bounded.push((number as u32, ball));
            continue;
        }
        for p in 0..n {
            if wall
                .closest_point(e as usize, &particles.position[p])
                .is_some_and(|f| f.distance < particles.radius[p] + skin)
            {
                pairs.push(Pair { a: p as u32, b: number as u32 });
            }
        }
    }
    if !bounded.is_empty() {
        // Triangles join the search as balls behind the particles.
        let positions: Vec<Vec3> = particles.position.iter().copied().chain(bounded.iter().map(|b| b.1.0)).collect();
        let reach: Vec<f64> = particles.radius.iter().map(|r| r + skin).chain(bounded.iter().map(|b| b.1.1)).collect();
        for candidate in candidate_pairs(&positions, &reach, None)? {
            let (a, b) = (candidate.a as usize, candidate.b as usize);
            if a < n && b >= n {
                pairs.push(Pair { a: candidate.a, b: bounded[b - n].0 });
            }
        }
    }
    pairs.sort_unstable();
    for pair in pairs {
        if present.binary_search(&pair).is_ok() {
            continue;
        }
        let a = pair.a as usize;
        let wall = &walls[elements[pair.b as usize].0 as usize];
        if let Some(row) = model.wall_rows.get(particles.material[a], wall.material) {
            let link = ContactFlags { row, flags: 0, image: [0; 3], padding: 0 };
            block.push(pair, link, concordem_contact::law::Reference::default(), PreviousGeometry::default());
        }
    }
    block.sort();
    Ok(())
}
