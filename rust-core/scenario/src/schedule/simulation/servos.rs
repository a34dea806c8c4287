//! Servos of a run: of walls, and of the cell.

use super::{RunError, Simulation, memory};
use crate::schedule::cell_servo::CellServoMemory;
use crate::schedule::watch::Watch;
use crate::schedule::{Aim, Loading, Swinging};
use concordem_solver::StepReport;
use concordem_solver::state::Clock;

/// Number of stresses that the servo of a cell controls. Their watches come before those of the walls.
const STRESSES: usize = 6;

impl Simulation {
    /// Sets the velocities of the walls with servos.
    pub(super) fn apply_servos(&mut self) {
        let mut openings = 0;
        for servo in &self.schedule.servos {
            let mut lasting = self.state.schedule_memory[memory::OPENING + 1 + openings];
            servo.apply(&mut self.state, &mut lasting);
            if let Aim::Opening(..) = servo.aim {
                self.state.schedule_memory[memory::OPENING + 1 + openings] = lasting;
                openings += 1;
            }
        }
    }

    /// Ends a run whose servo swings about its target. `factor`, `by_stress`: of the present stage.
    pub(super) fn watch_servos(
        &mut self,
        (factor, by_stress): (f64, bool),
        report: &StepReport,
    ) -> Result<(), RunError> {
        let clock = self.state.clock;
        self.watches.resize(STRESSES + self.schedule.servos.len(), Watch::default());
        let mut found = None;
        let of_cell = self.schedule.loading.cell_errors(&self.state, report, (factor, by_stress));
        for (watch, error) in self.watches.iter_mut().zip(of_cell.into_iter().flatten()) {
            found = watch.book(clock.step, error).or(found);
        }
        if let Some(errors) = found {
            let remedy = "integration.time_step, or loading.maximum_strain_rate";
            return Err(swings(clock, "the servo of the cell".to_owned(), remedy, errors));
        }
        for (watch, servo) in self.watches[STRESSES..].iter_mut().zip(&self.schedule.servos) {
            if let Some(errors) = watch.book(clock.step, servo.standing(&self.state).error()) {
                let what = format!("the servo of wall `{}`", self.state.walls[servo.wall].name);
                return Err(swings(clock, what, "integration.time_step, or servo.maximum_speed of the wall", errors));
            }
        }
        Ok(())
    }

    /// Renews the stiffness that bounds the gain of the servo of a cell.
    pub(super) fn look_at_cell(&mut self) {
        let place = memory::LASTING + CellServoMemory::STIFFNESS;
        if let Some(stiffness) = self.schedule.loading.look(&self.state, self.state.schedule_memory[place]) {
            self.state.schedule_memory[place] = stiffness;
        }
    }

    /// Whether the servos of walls have reached their targets.
    pub(super) fn servos_stand(&self) -> bool {
        self.schedule.servos.iter().all(|servo| servo.standing(&self.state).is_met())
    }

    /// What servos have not reached after the last step, in words.
    pub fn unmet(&self) -> Vec<String> {
        let mut all = Vec::new();
        let (factor, by_stress) = (self.stage_factor(), self.stage().is_some_and(|(stage, _)| stage.by_stress));
        // After the last stage the factor is that of its end; what it was is no longer known.
        if !self.schedule.stages.is_empty() && self.stage().is_none() {
            return all;
        }
        let state = (factor.unwrap_or(1.0), by_stress);
        if let (Loading::CellStress { tolerance, .. }, Some(errors)) =
            (&self.schedule.loading, self.schedule.loading.cell_errors(&self.state, &self.last, state))
        {
            let largest = errors.iter().fold(0.0, |largest: f64, error| largest.max(error.abs()));
            if largest > *tolerance {
                all.push(format!("the stress of the cell is off by {:.2} % of its target", 100.0 * largest));
            }
        }
        for servo in &self.schedule.servos {
            let (standing, name) = (servo.standing(&self.state), &self.state.walls[servo.wall].name);
            if !standing.is_met() {
                let unit = if matches!(servo.aim, Aim::Opening(..)) { "m of opening" } else { "N" };
                all.push(format!(
                    "the servo of wall `{name}` has {:.4e} of {:.4e} {unit}",
                    standing.found + 0.0,
                    standing.wanted
                ));
            }
        }
        all
    }

    /// Membranes that have torn after the last step, in words.
    pub fn torn(&self) -> Vec<String> {
        let position = &self.state.particles.position;
        let membranes = self.schedule.histories.membranes.iter().enumerate();
        let torn = membranes.map(|(number, membrane)| (number, membrane.torn(position), membrane.faces.len()));
        torn.filter(|(_, torn, _)| *torn > 0)
            .map(|(number, torn, all)| {
                format!("membrane[{number}] has torn at {torn} of {all} faces, which press less or not at all")
            })
            .collect()
    }
}

/// The error of a servo that swings.
fn swings(clock: Clock, what: String, remedy: &'static str, errors: [f64; 2]) -> RunError {
    let swinging = Box::new(Swinging { what, remedy, errors });
    RunError::Servo { step: clock.step, time: clock.time(), swinging }
}
