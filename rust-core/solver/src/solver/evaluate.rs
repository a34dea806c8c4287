//! Evaluation of all contact forces at the present positions and strains.

use concordem_contact::kinematics::deformable::{Deformable, ParticleVirials};
use concordem_contact::math::Mat3;
use concordem_contact::wrench::Wrench;

use super::Solver;
use super::stages::Stopwatch;
use crate::StepReport;
use crate::deformation::{self, DeformationPass};
use crate::evaluation::ContactFactors;
use crate::forces::{ParticleSums, StepContext, TileMap, Totals};
use crate::heat::expansion::Expansion;
use crate::heat::softening::Softening;
use crate::integrate;
use crate::record::Forces;
use crate::state::{Constraint, State};

impl Solver {
    /// Evaluate all contacts: net forces and torques, particle virials, and the report's sums; histories advance.
    /// Returns `Σ f⊗image` (N) over contacts across the periodic border.
    pub(super) fn evaluate(&mut self, state: &mut State, sample: bool, report: &mut StepReport) -> Mat3 {
        let mut watch = Stopwatch::start();
        // `gather` leaves them zero, unless a panic came before it.
        if !self.net_is_zero {
            self.net.fill(Wrench::default());
        }
        self.net_is_zero = false;
        self.net.resize(state.particles.len(), Wrench::default());
        self.pass.clear();
        report.evaluations += 1;
        let deformable = self.model.deformable.as_ref();
        let DeformationPass { surface_displacement, surface_displacement_before, virials, reaction_sums, .. } =
            &mut self.pass;
        let virials =
            if deformable.is_some() { ParticleVirials { virials, reaction_sums } } else { ParticleVirials::default() };
        let mut sums = ParticleSums { net: &mut self.net, virials };
        let reacting = deformable.map_or(Constraint::FREE, Deformable::reacting);
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
            deformable,
            dashpots_strain: deformable.is_some_and(|d| d.dashpots),
            expansion: self.expansion.as_ref().map(Expansion::rates),
            factors: ContactFactors::new(self.softening.as_ref().map(Softening::factors), Some(&self.model.strengths)),
            heats: self.model.heat.as_ref().is_some_and(|heat| heat.dissipation),
            evaluated: false,
            reacting,
        };
        let mut crossing = Mat3::zeros();
        for (k, (block, map)) in state.bonds.iter_mut().zip(&mut self.bond_maps).enumerate() {
            let totals = block.evaluate(&context, map, sums.reborrow());
            report.bond_events.extend(totals.bond_events.iter().map(|event| (k, *event)));
            add(report, &totals, 0, &mut crossing);
        }
        watch.lap(&mut self.stages.bonds);
        // Only bonds scatter: contacts without one stay in their fast loops.
        let softened = context.factors.and_then(|factors| factors.softened);
        let context = StepContext { factors: ContactFactors::new(softened, None), ..context };
        // Unbonded contacts and contacts with walls have no bond events.
        if let Some(block) = &mut state.contacts {
            let totals = block.evaluate(&context, &mut self.contact_map, sums.reborrow());
            add(report, &totals, 1, &mut crossing);
            report.opened.extend(totals.opened);
            report.begun[0].extend(totals.begun);
        }
        if let Some(block) = &mut state.wall_contacts {
            let totals = block.evaluate_walls(&context, &mut state.walls, sums.reborrow());
            add(report, &totals, 2, &mut crossing);
            report.begun[1].extend(totals.begun);
        }
        watch.lap(&mut self.stages.contacts);
        let maps = maps(&self.bond_maps, &self.contact_map, state);
        integrate::gather(&mut self.net, &maps, &mut self.force, &mut self.torque);
        self.net_is_zero = true;
        // Without iterations, [`DeformationPass::finish`] adds the halo.
        if deformation::iteration(deformable).is_some() {
            self.pass.gather(&maps, &state.particles, reacting);
        }
        watch.lap(&mut self.stages.gather);
        crossing
    }

    /// The forces of [`Solver::record`], with the present neighbor list, or with `evaluated` those of
    /// [`Solver::last_forces`].
    pub(super) fn record_forces(&self, state: &State, evaluated: bool, border: Option<&[bool]>) -> Forces {
        let softening = self.softening_of(state, evaluated);
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
            // The strains of an evaluated step are those that the particles used last.
            surface_displacement_before: if evaluated { &[] } else { &self.pass.surface_displacement_before },
            deformable: self.model.deformable.as_ref(),
            dashpots_strain: false,
            expansion: None,
            factors: ContactFactors::new(softening.as_ref().map(Softening::factors), Some(&self.model.strengths)),
            heats: false,
            evaluated,
            reacting: Constraint::FREE,
        };
        let mut forces = Forces::default();
        for block in state.bonds.iter().chain(&state.contacts) {
            block.record(&context, border, &mut forces.contacts);
        }
        if let Some(block) = &state.wall_contacts
            && !evaluated
        {
            block.record_walls(&context, &state.walls, &mut forces.walls);
        }
        forces
    }
}

/// Add the totals of a block to the report. `kind`: 0 for bonds, 1 for unbonded contacts, 2 for wall contacts.
fn add(report: &mut StepReport, totals: &Totals, kind: usize, crossing: &mut Mat3) {
    report.energy += totals.energy;
    report.virial += totals.virial;
    *crossing += totals.crossing;
    report.active[kind] += totals.active;
    report.force_squared += totals.force_squared;
    report.moment_squared += totals.moment_squared;
    report.expansion[0] += totals.expansion[0];
    report.expansion[1] += totals.expansion[1];
    report.stiffness_work += totals.stiffness_work;
    report.dissipated.extend(&totals.dissipated);
}

/// Tile maps of all blocks of contacts between particles.
pub(super) fn maps<'a>(bonds: &'a [TileMap], contacts: &'a TileMap, state: &State) -> Vec<&'a TileMap> {
    bonds.iter().chain(state.contacts.is_some().then_some(contacts)).collect()
}
