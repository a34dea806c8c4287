//! A scenario is built and run; what the oracles need is kept.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use concordem::assembly::{Assembly, assemble, restart};
use concordem::math::{Mat3, Vec3};
use concordem::output::hash::state_hash;
use concordem::sampling::{Record, ScheduledOperator};
use concordem::scenario::Scenario;
use concordem::schedule::simulation::OperatorRow;
use concordem::schedule::{Advance, Simulation};
use concordem::state::columns::ColumnStore;
use concordem::state::{Clump, State};
use concordem_tests::noise_vector;

use crate::balance::Balance;
use crate::case::Case;

/// How a scenario ended.
pub enum Outcome {
    /// It was not built; the message.
    Refused(String),
    /// It ended in an error; the message, and the run until then.
    Failed(String, Box<Run>),
    /// It ran to its end.
    Done(Box<Run>),
}

/// What is kept of a run.
pub struct Run {
    /// What servos had not reached at the end, in words.
    pub unmet: Vec<String>,
    /// `Σ l⊗f` of the last step, J.
    pub virial: Mat3,
    pub operators: Vec<ScheduledOperator>,
    /// Rows by operator and step.
    pub rows: BTreeMap<(usize, u64), Vec<f64>>,
    pub records: Vec<Record>,
    /// The state at the start and at the end.
    pub initial: State,
    pub state: State,
    pub balance: Balance,
    pub dt: f64,
    /// Largest speed during the run, m/s.
    pub fastest: f64,
}

impl Run {
    /// Index in the state of every particle, by id.
    pub fn by_id(&self) -> Vec<usize> {
        let ids = &self.state.particles.id;
        let mut order: Vec<usize> = (0..ids.len()).collect();
        order.sort_by_key(|&p| ids[p]);
        order
    }

    /// Bits of everything: records, rows, and the state.
    pub fn bits(&self) -> (Vec<Vec<u64>>, Vec<Vec<u64>>, String) {
        let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<u64>>();
        let records = self.records.iter().map(|record| bits(&record.to_row())).collect();
        let rows = self.rows.values().map(|values| bits(values)).collect();
        (records, rows, state_hash(&self.state).expect("a hash"))
    }
}

/// Changes of a run beside its scenario.
#[derive(Clone, Copy, Default)]
pub struct Options {
    /// Size of random changes of position at the start, m.
    pub noise: f64,
    /// Number of their direction.
    pub direction: usize,
    /// Step at which the state goes through columns into a new assembly.
    pub restart: Option<u64>,
}

/// Builds a scenario. Its files are written to `folder`.
pub fn build(case: &Case, folder: &Path) -> Result<(Scenario, Assembly), String> {
    let text = case.text(&|name, bytes| {
        std::fs::write(folder.join(name), bytes).expect("a file");
        name.to_owned()
    });
    let scenario = Scenario::parse("combination.toml", &text).map_err(|error| error.to_string())?;
    let assembly = assemble(&scenario, folder, &mut |_, _| ()).map_err(|error| error.to_string())?;
    Ok((scenario, assembly))
}

/// Runs a scenario; a panic is an error of its own.
pub fn run(case: &Case, folder: &Path, options: Options) -> Result<Outcome, String> {
    catch_unwind(AssertUnwindSafe(|| run_inside(case, folder, options))).map_err(|panic| {
        let text = panic.downcast_ref::<String>().cloned();
        text.or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned())).unwrap_or_default()
    })
}

fn run_inside(case: &Case, folder: &Path, options: Options) -> Outcome {
    let (scenario, mut assembly) = match build(case, folder) {
        Ok(built) => built,
        Err(message) => return Outcome::Refused(message),
    };
    disturb(&mut assembly.state, options, case.dimension == 2);
    let operators = assembly.schedule.operators.clone();
    let (initial, dt) = (assembly.state.clone(), assembly.state.clock.dt);
    let mut simulation = match Simulation::new(assembly.state, assembly.model, assembly.schedule) {
        Ok(simulation) => simulation,
        Err(error) => return Outcome::Refused(error.to_string()),
    };
    let mut balance = Balance::new(case, &simulation.state);
    let (mut records, mut rows) = (Vec::new(), BTreeMap::new());
    let speed = |state: &State| state.particles.velocity.iter().map(Vec3::norm).fold(0.0, f64::max);
    let mut fastest = speed(&initial);
    let error = loop {
        if options.restart == Some(simulation.state.clock.step) {
            simulation = restarted(&scenario, folder, &simulation.state);
        }
        let before = Balance::before(&simulation.state);
        let Advance { sample, operators: values, last, stopped, .. } = match simulation.advance() {
            Ok(advance) => advance,
            Err(error) => break Some(error.to_string()),
        };
        balance.step(&before, &simulation);
        fastest = speed(&simulation.state).max(fastest);
        records.extend(sample);
        for OperatorRow { operator, step, values, .. } in values {
            if step < simulation.state.clock.step {
                balance.check_stress(&simulation, &operators[operator], &values);
            }
            rows.insert((operator, step), values);
        }
        if stopped.is_some() {
            records.extend(last);
            break None;
        }
    };
    balance.end(&simulation.state);
    let (unmet, virial) = (simulation.unmet(), simulation.last_report().virial);
    let run = Box::new(Run {
        unmet,
        virial,
        operators,
        rows,
        records,
        initial,
        state: simulation.state,
        balance,
        dt,
        fastest,
    });
    match error {
        None => Outcome::Done(run),
        Some(message) => Outcome::Failed(message, run),
    }
}

/// A simulation that continues the state, which goes through columns.
fn restarted(scenario: &Scenario, folder: &Path, state: &State) -> Simulation {
    let mut columns = ColumnStore::of(state).expect("columns");
    let mut assembly = assemble(scenario, folder, &mut |_, _| ()).expect("it was assembled before");
    restart::apply(&mut assembly, &mut columns, scenario, &[], false).expect("the same scenario");
    Simulation::new(assembly.state, assembly.model, assembly.schedule).expect("the same scenario")
}

/// Moves particles and clumps by random vectors, and changes velocities by as much in one second (spins over a length of 1 mm): some
/// hundred roundings of 1 m/s.
fn disturb(state: &mut State, Options { noise, direction, .. }: Options, planar: bool) {
    let change = |id: u32| {
        let change = noise_vector(id as usize, 5 + direction) * noise;
        if planar { Vec3::new(change.x, change.y, 0.0) } else { change }
    };
    let first = |clump: &Clump| state.particles.id[clump.members[0] as usize];
    let of_clumps: Vec<Vec3> = state.clumps.iter().map(|clump| change(first(clump))).collect();
    for p in 0..state.particles.len() {
        let of_clump = of_clumps.get(state.particles.clump[p] as usize).copied();
        let (id, constraint) = (state.particles.id[p], state.particles.constraint[p]);
        state.particles.position[p] += of_clump.unwrap_or_else(|| change(id));
        if of_clump.is_some() {
            continue;
        }
        // Where a component of the motion is exactly zero, its sign, by which damping acts, is that of a rounding in another frame.
        let (slide, spin) = (change(id), noise_vector(id as usize, 50 + direction) * (noise / 1e-3));
        for i in 0..3 {
            if !constraint.translation(i) {
                state.particles.velocity[p][i] += slide[i];
            }
            if !constraint.rotation(i) && (!planar || i == 2) {
                state.particles.angular_velocity[p][i] += spin[i];
            }
        }
    }
    for (clump, change) in state.clumps.iter_mut().zip(&of_clumps) {
        clump.position += change;
    }
}

/// A tensor of nine values, row by row.
pub fn tensor(values: &[f64]) -> Mat3 {
    Mat3::from_row_slice(values)
}
