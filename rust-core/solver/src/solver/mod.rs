//! The solver: advances a state step by step.

mod conduct;
mod device;
mod evaluate;
mod excluded;
mod iterate;
mod rebuild;
mod slide;
mod stages;

use concordem_contact::kinematics::{MotionMeasure, Pose};
use concordem_contact::math::{Mat3, Vec3};
use concordem_contact::wrench::Wrench;

use crate::collision;
use crate::deformation::{self, DeformationPass};
use crate::forces::{BegunContact, TILE, TileMap};
use crate::fracture::virial;
use crate::heat::expansion::Expansion;
use crate::heat::pass::HeatPass;
use crate::heat::softening::Softening;
use crate::heat::supply::Factors;
use crate::integrate::{self, KickContext, NetForces};
use crate::neighbor::VerletList;
use crate::peculiar::Before;
use crate::record::Forces;
use crate::state::{Cell, Particles, State};
use crate::wrap;
use crate::{Model, Scheme, SolverError, StepReport};
pub use device::{StepDevice, Stretch, StretchEnd, StretchStep, TakenSteps};
pub use excluded::{Excluded, Exclusion};
pub use slide::Slider;
pub use stages::StageTimes;
use stages::Stopwatch;

/// Number of steps between two checks of all contacts whose stiffness grows with the overlap.
const STIFFNESS_INTERVAL: u64 = 128;

/// Advances a state. It holds only scratch data and can be rebuilt from the state at any time.
///
/// Use [`Solver::step`] for a run, or [`Solver::find_forces`] if the host integrates the motion.
pub struct Solver {
    model: Model,
    bond_maps: Vec<TileMap>,
    contact_map: TileMap,
    verlet: Option<VerletList>,
    /// Displacements of the walls at the last rebuild of the neighbor list, m.
    wall_positions: Vec<Vec3>,
    /// Vertices of those that are meshes, m.
    wall_vertices: Vec<Vec<Vec3>>,
    /// Smallest radius, m.
    smallest: f64,
    /// Forces and torques of the contacts of a particle's own tile.
    net: Vec<Wrench>,
    /// Whether these are all zero.
    net_is_zero: bool,
    /// Those of all contacts.
    force: Vec<Vec3>,
    torque: Vec<Vec3>,
    poses: Vec<Pose>,
    /// Whether `poses` hold orientations.
    oriented: bool,
    pass: DeformationPass,
    /// Heat conduction, if there is any.
    heat: Option<HeatPass>,
    /// Thermal expansion, if bonds expand.
    expansion: Option<Expansion>,
    /// Stiffness and strength at the temperatures, if they depend on it.
    softening: Option<Softening>,
    /// Largest particle strain for which the candidates are complete.
    strain_margin: f64,
    /// Change of the cell's velocity gradient at the next kick, 1/s.
    gradient_change: Option<Mat3>,
    targets: Option<Vec<(Vec3, Vec3)>>,
    sliders: Vec<Slider>,
    rebuilds: u64,
    stages: StageTimes,
    /// Particles per tile.
    tile: usize,
    /// Whether each particle belongs to this subdomain, see [`Self::for_subdomain`]; empty: all do.
    owned: Vec<bool>,
    /// Pairs without unbonded contacts.
    excluded: Excluded,
}

impl Solver {
    /// A solver for `state`.
    ///
    /// # Errors
    /// A law that does not support deformable particles if the model has them; input that the neighbor search rejects.
    pub fn new(model: Model, state: &mut State) -> Result<Self, SolverError> {
        Self::with_tiles(model, state, TILE, Vec::new(), Excluded::default())
    }

    /// A solver for one subdomain of a distributed computation, whose host integrates the motion
    /// ([`Self::find_forces`]).
    ///
    /// `owned` says which particles belong to this subdomain; the others are ghosts. The state must contain every
    /// contact of an owned particle. A contact between particles of two subdomains is evaluated in both, with the same
    /// bits. The subdomain that owns A counts its energies; the other one flags it
    /// [`ContactFlags::NOT_OWNED`](crate::state::contacts::ContactFlags::NOT_OWNED). The solver sets that flag on the
    /// contacts it begins, the host sets it on bonds. Net forces are complete only for owned particles. The pairs of
    /// `excluded` get no unbonded contacts.
    ///
    /// Forces are summed in the order of the pairs, in a single tile. If all subdomains number the particles in the
    /// same global order, the decomposition does not change a bit of the net forces.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn for_subdomain(
        model: Model,
        state: &mut State,
        owned: Vec<bool>,
        excluded: Excluded,
    ) -> Result<Self, SolverError> {
        let tile = state.particles.len().max(1);
        Self::with_tiles(model, state, tile, owned, excluded)
    }

    fn with_tiles(
        model: Model,
        state: &mut State,
        tile: usize,
        owned: Vec<bool>,
        excluded: Excluded,
    ) -> Result<Self, SolverError> {
        let n = state.particles.len();
        let mut solver = Self {
            model,
            tile,
            owned,
            excluded,
            bond_maps: Vec::new(),
            contact_map: TileMap::default(),
            verlet: None,
            wall_positions: Vec::new(),
            wall_vertices: Vec::new(),
            smallest: 0.0,
            net: Vec::new(),
            net_is_zero: true,
            force: vec![Vec3::zeros(); n],
            torque: vec![Vec3::zeros(); n],
            poses: Vec::new(),
            oriented: false,
            pass: DeformationPass::default(),
            heat: None,
            expansion: None,
            softening: None,
            strain_margin: 0.0,
            gradient_change: None,
            targets: None,
            sliders: Vec::new(),
            rebuilds: 0,
            stages: StageTimes::default(),
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
        refuse_long_bonds(state)?;
        if state.clock.step == 0 && solver.owned.is_empty() {
            wrap::wrap(state);
        }
        solver.start_heat(state)?;
        let strain = solver.begin_deformation(state);
        solver.rebuild_neighbor_list(state, strain)?;
        Ok(solver)
    }

    /// The model.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The model, for changes of damping or gravity between steps.
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

    /// Number of rebuilds of the neighbor list so far, the first one included.
    pub fn neighbor_rebuilds(&self) -> u64 {
        self.rebuilds
    }

    /// Time spent in each stage of the steps so far, for measurements. Results do not depend on it.
    pub fn stage_times(&self) -> &StageTimes {
        &self.stages
    }

    /// Memory of the solver's scratch in bytes.
    pub fn scratch_bytes(&self) -> usize {
        self.bond_maps.iter().map(TileMap::bytes).sum::<usize>()
            + self.contact_map.bytes()
            + (48 + size_of::<Wrench>() + size_of::<Pose>()) * self.force.len()
            + self.pass.bytes()
            + self.heat.as_ref().map_or(0, HeatPass::bytes)
    }

    /// Radii (m) of the state have grown by up to `growth` since the last call; the candidates are renewed in time.
    pub fn spheres_grew(&mut self, growth: f64) {
        if let Some(verlet) = &mut self.verlet {
            verlet.growth += growth;
        }
    }

    /// From the next kick on, deform the cell with this velocity gradient (1/s), and all particles with it except for
    /// their constrained components (see [`KickContext::gradient_change`]).
    pub fn set_velocity_gradient(&mut self, cell: &Cell, gradient: Mat3) {
        self.gradient_change = Some(gradient - cell.velocity_gradient);
    }

    /// Set the velocities (m/s) and angular velocities (rad/s) that constrained degrees of freedom take at the next kick,
    /// by particle; `None`: they keep theirs.
    pub fn set_targets(&mut self, targets: Option<Vec<(Vec3, Vec3)>>) {
        self.targets = targets;
    }

    /// The targets of [`Self::set_targets`], to be changed in place; at first, the present velocities of `particles`.
    pub fn targets_mut(&mut self, particles: &Particles) -> &mut [(Vec3, Vec3)] {
        self.targets.get_or_insert_with(|| {
            particles.velocity.iter().copied().zip(particles.angular_velocity.iter().copied()).collect()
        })
    }

    /// Set the factors of what heats from outside, for the coming step.
    pub fn set_heat_factors(&mut self, factors: Factors) {
        if let Some(pass) = &mut self.heat {
            pass.factors = factors;
        }
    }

    /// Heat conduction, if there is any.
    pub fn heat(&self) -> Option<&HeatPass> {
        self.heat.as_ref()
    }

    /// Advance the state by one step.
    ///
    /// 1. Deformable particles: strains from the forces of the last step.
    /// 2. Rebuild the neighbor list if the skin may be spent.
    /// 3. Contact forces: measure, evaluate the laws, sum by particle; with iterated strains repeat until strains and
    ///    forces agree.
    /// 4. Particle-level failure: release the bonds of particles whose mean stress exceeds a threshold.
    /// 5. Heat: conduction; bonds expand at the end of the step.
    /// 6. Kick and drift of free particles, then of clumps.
    /// 7. Move the cell and the walls.
    /// 8. Book the energies, advance the clock.
    /// 9. If bonds broke, their pairs continue as unbonded contacts. In a periodic cell, particles that have drifted far are
    ///    occasionally moved back ([`Particles::image`]), and the neighbor list is rebuilt.
    ///
    /// # Errors
    /// Input that the neighbor search rejects, strains that do not converge, velocities that are no longer finite.
    pub fn step(&mut self, state: &mut State) -> Result<StepReport, SolverError> {
        self.step_with(state, true)
    }

    /// [`Self::step`] which sums stored energies and squared contact forces only if `sample`; otherwise these and the
    /// ledger's residual are not valid. A step without a sample is faster. Dissipation is booked in every step.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn step_with(&mut self, state: &mut State, sample: bool) -> Result<StepReport, SolverError> {
        // The first step sets the ledger's initial energy.
        let first = !state.ledger.started;
        let sample = sample || first;
        let mut report = StepReport::default();
        if self.rests() {
            self.begin_heat(state)?;
            return self.only_conduct(state);
        }
        let (crossing, strain) = self.compute_forces(state, sample, &mut report)?;
        if self.model.watch_contacts {
            self.check_stiffness(state, &report.begun)?;
        }
        let mut watch = Stopwatch::start();
        let before = if sample { Before::of(state, self.gradient_change.as_ref()) } else { None };
        self.kick_and_drift(state, &mut report);
        report.affine_kinetic =
            before.map_or(0.0, |before| before.affine_kinetic(state, self.gradient_change.as_ref()));
        self.check_meshes(state)?;
        watch.lap(&mut self.stages.motion);
        let work = self.move_cell_and_walls(state, &crossing);
        book(state, &mut report, work);
        check_finite(state, &report)?;
        watch.lap(&mut self.stages.booking);
        // Depends only on the step number, so that a resumed run wraps in the same steps.
        let wrapped = state.clock.step.is_multiple_of(wrap::INTERVAL) && self.owned.is_empty() && wrap::wrap(state);
        if wrapped {
            self.rebuild_neighbor_list(state, strain)?;
            watch.lap(&mut self.stages.neighbors);
        } else if report.bonds_broke() {
            self.free_broken_pairs(state);
            watch.lap(&mut self.stages.release);
        }
        // What the first evaluation dissipates belongs to the time before.
        self.finish_heat(state, if first { &[] } else { &report.dissipated })?;
        watch.lap(&mut self.stages.booking);
        Ok(report)
    }

    /// Compute the contact forces at the present positions, for hosts that integrate the motion themselves.
    ///
    /// Read the result from [`Self::forces`] and [`Self::torques`]. Before the call, the host has moved the particles
    /// and set the velocities, the orientations, and the `rotation_increment` of the step. Histories advance by one
    /// step; pairs whose bond broke continue as unbonded contacts; heat is conducted, and bonds expand. The host handles clock, ledger,
    /// walls, cell, and external loads. [`Self::step`] is this followed by kick and drift, with the same bits.
    ///
    /// `sample`: also sum stored energies, as in [`Self::step_with`].
    ///
    /// # Errors
    /// Input that the neighbor search rejects, strains that do not converge.
    pub fn find_forces(&mut self, state: &mut State, sample: bool) -> Result<StepReport, SolverError> {
        if self.rests() {
            return Err(SolverError::Heat {
                problem: "without motion needs no forces, and no host: set heat.motion = true",
            });
        }
        let mut report = StepReport::default();
        self.compute_forces(state, sample, &mut report)?;
        if report.bonds_broke() {
            self.free_broken_pairs(state);
        }
        // What the first evaluation dissipates belongs to the time before.
        self.finish_heat(state, if state.clock.step == 0 { &[] } else { &report.dissipated })?;
        Ok(report)
    }

    /// Forces of all contacts at the present positions: those that the next step will compute.
    ///
    /// Changes nothing, except that the neighbor list is rebuilt now if the next step would rebuild it.
    ///
    /// # Errors
    /// Input that the neighbor search rejects.
    pub fn record(&mut self, state: &mut State) -> Result<Forces, SolverError> {
        self.record_of(state, None)
    }

    /// [`Self::record`] without the contacts inside a set and outside it: those between a member and another particle, and those with
    /// walls. `member`: whether each particle belongs to the set. Only these contacts are evaluated.
    ///
    /// # Errors
    /// As [`Self::record`].
    pub fn record_border(&mut self, state: &mut State, member: &[bool]) -> Result<Forces, SolverError> {
        self.record_of(state, Some(member))
    }

    fn record_of(&mut self, state: &mut State, border: Option<&[bool]>) -> Result<Forces, SolverError> {
        let strain = self.begin_deformation(state);
        if self.needs_rebuild(state, strain) {
            self.rebuild_neighbor_list(state, strain)?;
        }
        if deformation::iteration(self.model.deformable.as_ref()).is_some() {
            return self.record_iterated(state, strain, border);
        }
        Ok(self.record_forces(state, false, border))
    }

    /// Forces of all contacts between particles in the last [`Self::find_forces`]: those whose sums are [`Self::forces`]. They
    /// follow from the histories, so a state that was read from a file has them, too. Walls are not included.
    ///
    /// At the same positions, [`Self::record`] would give the forces of one more step with the same velocities, so with one shear
    /// increment too many.
    pub fn last_forces(&self, state: &State) -> Forces {
        self.record_forces(state, true, None)
    }

    /// Everything before the kick: strains, neighbor list, contact forces, and particle-level failure. Returns
    /// `Σ f⊗image` (N) over contacts across the periodic border, and the largest particle strain.
    fn compute_forces(
        &mut self,
        state: &mut State,
        sample: bool,
        report: &mut StepReport,
    ) -> Result<(Mat3, f64), SolverError> {
        let mut watch = Stopwatch::start();
        let mut strain = self.begin_deformation(state);
        watch.lap(&mut self.stages.strains);
        if self.needs_rebuild(state, strain) {
            self.rebuild_neighbor_list(state, strain)?;
            report.rebuilt = true;
        }
        watch.lap(&mut self.stages.neighbors);
        self.begin_heat(state)?;
        watch.lap(&mut self.stages.booking);
        self.find_poses(state);
        watch.lap(&mut self.stages.poses);
        let iterated = deformation::iteration(self.model.deformable.as_ref()).is_some();
        let crossing = if iterated {
            self.evaluate_iterated(state, sample, report, &mut strain)?.0
        } else {
            self.evaluate(state, sample, report)
        };
        watch = Stopwatch::start();
        if let Some(deformable) = &self.model.deformable {
            // Iterations have added the halo already.
            let maps = if iterated { Vec::new() } else { evaluate::maps(&self.bond_maps, &self.contact_map, state) };
            report.deformation = self.pass.finish(deformable, &mut state.particles, &self.force, &maps);
        }
        if self.model.hydrostatic_strength.is_active()
            && let Some(stress) = virial::mean_stress(state, self.model.hydrostatic_strength.planar)
        {
            virial::release(state, &self.model.hydrostatic_strength, &stress);
        }
        watch.lap(&mut self.stages.strains);
        Ok((crossing, strain))
    }

    /// Gather positions, and orientations if a law reads them.
    fn find_poses(&mut self, state: &State) {
        let mut blocks = state.bonds.iter().chain(&state.contacts);
        self.oriented = blocks.any(|block| block.reads_orientations());
        state.particles.poses(self.oriented, &mut self.poses);
    }

    /// Fail if the stiffness of a contact has outgrown the time step. Checks contacts that have `begun` in this step, and all others from
    /// time to time.
    fn check_stiffness(&self, state: &State, begun: &[Vec<BegunContact>; 2]) -> Result<(), SolverError> {
        let all = state.clock.step.is_multiple_of(STIFFNESS_INTERVAL);
        let outgrown = match begun {
            _ if all => collision::outgrown(state, &self.model),
            [contacts, walls] if contacts.is_empty() && walls.is_empty() => None,
            [contacts, walls] => collision::outgrown_among(state, &self.model, contacts, walls),
        };
        let Some(collision::Outgrown { a, b, with_wall, overlap, bound }) = outgrown else {
            return Ok(());
        };
        let id = |p: usize| state.particles.id[p];
        Err(SolverError::ContactOutgrown {
            step: state.clock.step,
            time: state.clock.time(),
            id: id(a),
            other: if with_wall { Ok(state.walls[b].name.clone()) } else { Err(id(b)) },
            overlap,
            bound,
            dt: state.clock.dt,
        })
    }

    /// Fail if a mesh is about to move so fast that particles could pass through it in one step, or has lost the area of a triangle.
    fn check_meshes(&self, state: &State) -> Result<(), SolverError> {
        for wall in &state.walls {
            let Some(mesh) = wall.mesh() else { continue };
            let fail = |problem: String| SolverError::Mesh {
                step: state.clock.step,
                time: state.clock.time(),
                wall: wall.name.clone(),
                problem,
            };
            mesh.check().map_err(|error| fail(error.to_string()))?;
            let (speed, vertex) = mesh.fastest();
            let path = speed * state.clock.dt;
            if path > self.smallest && self.smallest > 0.0 {
                return Err(fail(format!(
                    "vertex {vertex} moves {path:.3e} m in one step, more than the smallest radius, {:.3e} m: particles could pass \
                     through; lower its velocity or the time step",
                    self.smallest
                )));
            }
        }
        Ok(())
    }

    /// Strains of the step from the forces of the last one; returns the largest one.
    fn begin_deformation(&mut self, state: &mut State) -> f64 {
        let Some(deformable) = &self.model.deformable else { return 0.0 };
        // The strains one step ago are stored only if most contacts need them; otherwise they are computed on demand.
        let blocks = state.bonds.iter().chain(&state.contacts).chain(&state.wall_contacts);
        let readers = blocks.filter(|block| block.reads_old_elongation()).map(|block| block.len()).sum::<usize>();
        let particles = &mut state.particles;
        self.pass.begin(deformable, particles, readers > particles.len())
    }

    /// Kick and drift of free particles, then of clumps.
    fn kick_and_drift(&mut self, state: &mut State, report: &mut StepReport) {
        // Forces one step ago, if the damping needs them. A particle without them starts from zero.
        let remembered = if self.model.damping.reads_last_forces() { state.particles.len() } else { 0 };
        if state.particles.previous.len() != remembered {
            state.particles.previous = vec![[Vec3::zeros(); 2]; remembered];
        }
        let half_kick = self.model.scheme == Scheme::VelocityVerlet && state.clock.step == 0;
        let fraction = if half_kick { 0.5 } else { 1.0 };
        self.slide(state, fraction * state.clock.dt);
        let kick = KickContext {
            dt: state.clock.dt,
            fraction,
            gravity: self.model.gravity,
            damping: self.model.damping,
            cell: state.cell.as_ref(),
            gradient_change: self.gradient_change,
            convective: matches!(self.model.mode, MotionMeasure::Yade | MotionMeasure::YadeRatcheting),
            targets: self.targets.as_deref(),
        };
        let net = NetForces { force: &self.force, torque: &self.torque };
        report.kick = integrate::kick_and_drift(&kick, &mut state.particles, net);
        integrate::advance_clumps(&kick, &mut state.clumps, &mut state.particles, net, &mut report.kick);
        if kick.convective {
            // Prescribed components follow the cell from the velocities that they have now, as after a restart.
            self.targets = None;
        }
    }

    /// Move the cell and the walls. Returns the work of their prescribed motion, J, over the half steps before and after
    /// the present instant. `crossing`: `Σ f⊗image`, N.
    fn move_cell_and_walls(&mut self, state: &mut State, crossing: &Mat3) -> [f64; 2] {
        let dt = state.clock.dt;
        let mut work = [0.0; 2];
        if let Some(cell) = &mut state.cell {
            if let Some(change) = self.gradient_change.take() {
                cell.velocity_gradient += change;
            }
            let half_before = 0.5 * crossing.component_mul(&cell.matrix_change).sum();
            cell.matrix_change = cell.velocity_gradient * cell.matrix * dt;
            cell.matrix += cell.matrix_change;
            cell.deformation_gradient += cell.velocity_gradient * cell.deformation_gradient * dt;
            work = [half_before, 0.5 * crossing.component_mul(&cell.matrix_change).sum()];
        }
        for wall in &mut state.walls {
            let (now, before) = wall.turning.map_or_else(Default::default, |t| (t.angular_velocity, t.previous));
            work[0] += -0.5 * wall.power(&wall.previous_velocity, &before) * dt;
            work[1] += -0.5 * wall.power(&wall.velocity, &now) * dt;
            wall.displacement += wall.velocity * dt;
            wall.previous_velocity = wall.velocity;
            if let Some(turning) = &mut wall.turning {
                turning.previous = turning.angular_velocity;
            }
            if let Some(mesh) = wall.mesh_mut() {
                let [before, after] = mesh.drift(dt);
                work[0] += before;
                work[1] += after;
            }
        }
        work
    }
}

/// Book the energies of the step and advance the clock. `work`: of cell and walls, J.
fn book(state: &mut State, report: &mut StepReport, mut work: [f64; 2]) {
    report.kick.external[0] += report.deformation.loads;
    work[0] += report.deformation.reactions;
    state.ledger.book_expansion(report.expansion);
    state.ledger.book_stiffness(report.stiffness_work);
    state.ledger.book(&report.energy, &report.kick, &report.deformation, work, report.affine_kinetic);
    state.clock.step += 1;
}

/// Fail if a bond is too long for its law.
fn refuse_long_bonds(state: &State) -> Result<(), SolverError> {
    for block in &state.bonds {
        let block = block.contacts();
        if let Some((k, ratio)) = block.relatively_longest().filter(|(_, ratio)| *ratio >= 1.0) {
            let view = block.view(k);
            let ids = [view.pair.a, view.pair.b].map(|p| state.particles.id[p as usize]);
            return Err(SolverError::LongBond {
                ids,
                length: view.reference.length,
                longest: view.reference.length / ratio,
            });
        }
    }
    Ok(())
}

/// Fail if the motion, or a force, is NaN or infinite. The sums of the kick show it; only then are the particles read.
fn check_finite(state: &State, report: &StepReport) -> Result<(), SolverError> {
    let kick = &report.kick;
    let (step, time) = (state.clock.step, state.clock.time());
    if !(kick.max_speed_squared.is_finite() && kick.kinetic.is_finite()) {
        let Particles { velocity, angular_velocity, id, .. } = &state.particles;
        let first =
            velocity.iter().zip(angular_velocity).position(|(v, w)| !(v.norm_squared() + w.norm_squared()).is_finite());
        return Err(SolverError::NotFinite { step, time, id: first.map_or(u32::MAX, |p| id[p]) });
    }
    let fail = |what: String| Err(SolverError::NoNumber { step, time, what });
    if state.cell.is_some_and(|cell| !cell.matrix.sum().is_finite()) {
        return fail("an edge of the periodic cell".to_owned());
    }
    for wall in &state.walls {
        let turning = wall.turning.map_or_else(Vec3::zeros, |turning| turning.angular_velocity);
        let sum: Vec3 = wall.displacement + wall.velocity + turning + wall.force + wall.torque;
        if !sum.sum().is_finite() {
            return fail(format!("the motion of the wall `{}`, or the force on it,", wall.name));
        }
    }
    // Particles that are held do not show what acts on them.
    if !(kick.external.iter().sum::<f64>() + kick.boundary.iter().sum::<f64>()).is_finite() {
        return fail("the work of loads and prescribed motions".to_owned());
    }
    Ok(())
}
