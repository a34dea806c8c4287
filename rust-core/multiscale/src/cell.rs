//! One cell, and many in parallel.

use concordem_contact::Cell;
use concordem_contact::math::{Mat3, Vec3};
use concordem_continuum::LinkDamage;
use concordem_operator::couple_stress::conjugate;
use concordem_operator::interruption::{Watch, look, stoppable};
use concordem_operator::{Period, Region};
use concordem_scenario::assembly::Assembly;
use concordem_scenario::sampling::Bonds;
use concordem_scenario::schedule::simulation::STRESS_WORK;
use concordem_scenario::schedule::{Histories, Loading, Schedule, Simulation};
use concordem_solver::energy::Sum;
use concordem_solver::state::State;
use concordem_statics::{Accuracy, LinkNetwork, cell_stiffness};
use nalgebra::Matrix6;
use rayon::prelude::*;

use crate::error::CellError;

/// A periodic cell that follows the deformation gradient of a continuum.
pub struct RepresentativeCell {
    run: Simulation,
    bonded: bool,
}

/// What a cell answers.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    /// Stress `σ = (1/V) Σ l⊗f` at the present positions; position first, Pa.
    pub stress: Mat3,
    /// Couple stress about the center of the cell, N/m. In equilibrium it does not depend on the images at which particles are
    /// listed.
    pub couple_stress: Mat3,
    /// Volume of the cell, m³.
    pub volume: f64,
    /// Damage of the bonds, broken ones included; `None` without bonds.
    pub damage: Option<LinkDamage>,
    /// Intact bonds.
    pub bonds: usize,
    /// Work that this stress has done since the start of the cell, `∫ V σ:L dt`, J: by the trapezoidal rule over the steps.
    pub work: f64,
}

/// The complete state of a cell. A cell that is restored from it continues bit by bit.
#[derive(Clone)]
pub struct Snapshot(State);

impl Snapshot {
    /// A snapshot from a state that was read from a file.
    pub fn of(state: State) -> Self {
        Self(state)
    }
}

impl RepresentativeCell {
    /// A cell from an assembled scenario.
    ///
    /// # Errors
    /// No periodic cell; a loading, stages, histories, servos, or samples in the scenario, which would be ignored.
    pub fn new(assembly: &Assembly) -> Result<Self, CellError> {
        let Assembly { state, model, schedule, .. } = assembly;
        if state.cell.is_none() {
            return Err(CellError::NoCell);
        }
        for (holds, what) in [
            (schedule.loading != Loading::None, "a [loading]"),
            (!schedule.stages.is_empty(), "[[stage]]s"),
            (schedule.histories != Histories::default(), "motions, walls, or loads that change with time"),
            (!schedule.operators.is_empty(), "[[sample]]s"),
            (!state.walls.is_empty(), "walls"),
        ] {
            if holds {
                return Err(CellError::Driven { what });
            }
        }
        let schedule = Schedule {
            stop: schedule.stop,
            sample_interval: schedule.sample_interval,
            allow_energy_error: schedule.allow_energy_error,
            planar: schedule.planar,
            ..Schedule::default()
        };
        let run = Simulation::new(state.clone(), model.clone(), schedule)?;
        let bonded = run.state.bond_count() > 0;
        Ok(Self { run, bonded })
    }

    /// The state.
    pub fn state(&self) -> &State {
        &self.run.state
    }

    /// Deformation gradient `F = ∂x/∂X` of the cell since its start.
    pub fn deformation_gradient(&self) -> Mat3 {
        self.run.state.cell.map_or_else(Mat3::identity, |cell| cell.deformation_gradient)
    }

    /// Deform the cell to this deformation gradient in the given number of steps; the gradient changes linearly. Every step has the
    /// velocity gradient `L = (F_{k+1} F_k⁻¹ − 1)/Δt`, so that the cell ends at `F` up to rounding.
    ///
    /// # Errors
    /// An inverted gradient; no steps; a failed step; a condition of the scenario's `[stop]`; a bonded cell that loses its last bond.
    /// The cell keeps the state that it has
    /// reached.
    pub fn deform(&mut self, gradient: &Mat3, steps: u32) -> Result<(), CellError> {
        let determinant = gradient.determinant();
        if !(determinant > 0.0 && determinant.is_finite()) {
            return Err(CellError::Inverted { determinant });
        }
        if steps == 0 {
            return Err(CellError::NoSteps);
        }
        let begin = self.deformation_gradient();
        for step in 1..=steps {
            look();
            let run = &mut self.run;
            let Some(cell) = run.state.cell else { return Err(CellError::NoCell) };
            let now = cell.deformation_gradient;
            let target = begin + (gradient - begin) * (f64::from(step) / f64::from(steps));
            let Some(inverse) = now.try_inverse() else {
                return Err(CellError::Inverted { determinant: now.determinant() });
            };
            let rate = (target * inverse - Mat3::identity()) / run.state.clock.dt;
            let virial = run.last_report().virial;
            run.solver.set_velocity_gradient(&cell, rate);
            // Whole steps: a cell that stops between two of them is sound.
            let stopped = stoppable(None, || run.advance())?.stopped;
            self.book_work(&cell, &virial);
            if let Some(reason) = stopped {
                return Err(CellError::Ended { step: self.run.state.clock.step, reason });
            }
        }
        if self.bonded && self.run.state.bond_count() == 0 {
            return Err(CellError::NoBonds { step: self.run.state.clock.step });
        }
        Ok(())
    }

    /// Books the work of the step before the one that has just been taken, whose forces at the end are now known. `cell`, `virial` (J): of its end
    /// and of its begin.
    fn book_work(&mut self, cell: &Cell, virial: &Mat3) {
        let Simulation { state, .. } = &self.run;
        let mut work = work_done(state);
        work.add(work_of_step(cell, state.clock.dt, [virial, &self.run.last_report().virial]));
        self.run.state.schedule_memory[STRESS_WORK..STRESS_WORK + 2].copy_from_slice(&work.parts());
    }

    /// Stress, couple stress, and damage at the present positions. Does not change the state.
    ///
    /// # Errors
    /// The forces or averages cannot be computed.
    pub fn response(&mut self) -> Result<Response, CellError> {
        let run = &mut self.run;
        let Some(cell) = run.state.cell else { return Err(CellError::NoCell) };
        let forces = run.solver.record(&mut run.state)?;
        let volume = cell.volume();
        let contacts = &forces.contacts;
        let mut sum = Mat3::zeros();
        for (branch, force) in contacts.branch.iter().zip(&contacts.force) {
            sum += branch * force.transpose();
        }
        let last_work = work_of_step(&cell, run.state.clock.dt, [&run.last_report().virial, &sum]);
        let center = cell.matrix * Vec3::repeat(0.5);
        let couple = if contacts.pair.is_empty() {
            Mat3::zeros()
        } else {
            let set = contacts.set(&run.state.particles)?;
            conjugate(&set, &Region::All { volume }, &center, Some(&Period::of(cell.matrix)))?.couple_stress
        };
        let bonds = Bonds::of(&run.state, &forces);
        let damage =
            if bonds.normal.is_empty() { None } else { Some(LinkDamage::of(&bonds.normal, &bonds.lost_strength)?) };
        Ok(Response {
            stress: sum / volume,
            couple_stress: couple,
            volume,
            damage,
            bonds: run.state.bond_count(),
            work: work_done(&run.state).get() + last_work,
        })
    }

    /// Elastic stiffness of the intact bonds in their present geometry, all particles in equilibrium, without damage; Pa, components
    /// 11, 22, 33, 23, 31, 12 with engineering shears.
    ///
    /// # Errors
    /// No bonds, or no equilibrium.
    pub fn stiffness(&self) -> Result<Matrix6<f64>, CellError> {
        let network = LinkNetwork::of_model(&self.run.state, self.run.solver.model())?;
        Ok(cell_stiffness(&network, Accuracy::default())?.relaxed)
    }

    /// The complete state.
    pub fn snapshot(&self) -> Snapshot {
        Snapshot(self.run.state.clone())
    }

    /// Go back to a snapshot of this cell.
    ///
    /// # Errors
    /// A snapshot of another cell.
    pub fn restore(&mut self, snapshot: &Snapshot) -> Result<(), CellError> {
        let (found, wanted) = (snapshot.0.particles.len(), self.run.state.particles.len());
        if found != wanted {
            return Err(CellError::OtherCell { found, wanted });
        }
        let schedule = std::mem::take(&mut self.run.schedule);
        self.run = Simulation::new(snapshot.0.clone(), self.run.solver.model().clone(), schedule)?;
        Ok(())
    }
}

/// Work of the stress over all steps but the last one, J. Without the state's ledger, which also has the kinetic energy of the mean motion.
fn work_done(state: &State) -> Sum {
    let place = &state.schedule_memory[STRESS_WORK..];
    Sum::from_parts([place[0], place[1]])
}

/// Work of the stress over the last step of a cell (J), the trapezoid of the forces over the change of the edges. `virials`: `Σ l⊗f` at the begin and
/// at the end of the step, J.
///
/// At both ends the branches change by the same `ΔF X`: by `G l` at the begin, with `G = L Δt`, and by `G (1+G)⁻¹ l` at the end. So the work of a
/// spring that keeps its direction is exact.
fn work_of_step(cell: &Cell, dt: f64, virials: [&Mat3; 2]) -> f64 {
    let begin = cell.velocity_gradient * dt;
    // A cell that turned inside out in this step has no volume, and no work.
    let end = (Mat3::identity() + begin).try_inverse().map_or_else(Mat3::zeros, |inverse| begin * inverse);
    0.5 * ((virials[0] * begin).trace() + (virials[1] * end).trace())
}

/// Deform all cells, each to its gradient, on all processors. Cells whose deformation failed have an error; the others are deformed.
pub fn deform(cells: &mut [RepresentativeCell], gradients: &[Mat3], steps: u32) -> Vec<Result<(), CellError>> {
    let watch = Watch::here();
    let deform = |(cell, gradient): (&mut RepresentativeCell, _)| watch.part(|| cell.deform(gradient, steps));
    cells.par_iter_mut().zip(gradients).map(deform).collect()
}
