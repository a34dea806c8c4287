//! Restart: continues the state of an earlier run with a scenario that may differ from the earlier one.
//!
//! Keys that define the specimen cannot change: packing, particles, bonds, laws, clumps, walls, time step. Keys that
//! drive it may change: the end of the run, output, samples, loading, prescribed motions, forces, gravity, damping,
//! velocities, angular velocities, and servos of walls, and numbers in the tables of laws. Any other changed key is an error; no change is ignored
//! silently.

use super::{Assembly, AssemblyError, unfit};
use crate::schedule::simulation;
use crate::schema::{Document, Loading, Problem, ProblemKind, Scenario, ScenarioError};
use concordem_solver::energy::Ledger;
use concordem_solver::state::columns::{ColumnError, ColumnSource};
use concordem_solver::state::{Constraint, State};
use serde_json::Value;

/// A key whose value differs between two scenarios.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Change {
    /// Path of the key, such as `stop.steps` or `material[0].cpm.young`.
    pub key: String,
    /// Value before; `none` if not given.
    pub before: String,
    /// Value after; `none` if not given.
    pub after: String,
}

impl std::fmt::Display for Change {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{}: {} -> {}", self.key, self.before, self.after)
    }
}

/// Where the continued run writes its result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Continuation {
    /// To the same result; its columns are already defined, so `[[sample]]` and `output.file` cannot change.
    SameResult,
    /// To a new result.
    NewResult,
}

/// Why a state cannot be continued.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RestartError {
    /// The scenario changes keys that cannot change.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// The state has other columns than the scenario needs.
    #[error(transparent)]
    Column(#[from] ColumnError),
    /// The state does not fit the scenario.
    #[error(transparent)]
    Assembly(#[from] AssemblyError),
}

/// Keys whose values differ, in the order of the scenario's tables. The notation does not matter: `"1 mm"` equals `0.001`.
pub fn changes(before: &Scenario, after: &Scenario) -> Vec<Change> {
    let [before, after] = [before, after].map(|scenario| serde_json::to_value(scenario).unwrap_or(Value::Null));
    let mut found = Vec::new();
    compare("", &before, &after, &mut found);
    found
}

fn compare(path: &str, before: &Value, after: &Value, found: &mut Vec<Change>) {
    if before == after {
        return;
    }
    match (before, after) {
        (Value::Object(old), Value::Object(new)) if old.get("kind") == new.get("kind") => {
            let others = new.keys().filter(|key| !old.contains_key(*key));
            for key in old.keys().chain(others) {
                let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                let of = |table: &serde_json::Map<String, Value>| table.get(key).cloned().unwrap_or(Value::Null);
                compare(&path, &of(old), &of(new), found);
            }
        }
        (Value::Array(old), Value::Array(new)) if old.len() == new.len() => {
            for (k, (old, new)) in old.iter().zip(new).enumerate() {
                compare(&format!("{path}[{k}]"), old, new, found);
            }
        }
        _ => found.push(Change { key: path.to_owned(), before: shown(before), after: shown(after) }),
    }
}

/// A value on one line, shortened to 60 characters.
fn shown(value: &Value) -> String {
    let text = match value {
        Value::Null => "none".to_owned(),
        other => other.to_string(),
    };
    if text.chars().count() > 60 { text.chars().take(57).chain("...".chars()).collect() } else { text }
}

/// Whether a restart may make this change.
fn allowed(change: &Change, [before, after]: [&Scenario; 2], continuation: Continuation) -> bool {
    let first = change.key.split(['.', '[']).next().unwrap_or_default();
    match first {
        "title" | "author" | "stop" | "prescribe" | "force" => true,
        "output" => continuation == Continuation::NewResult || change.key != "output.file",
        // A result describes one program of loading.
        "history" if places_mesh(change, before) || places_mesh(change, after) => false,
        "sample" | "stage" | "history" => continuation == Continuation::NewResult,
        "loading" => loading_allowed(change, &before.loading, &after.loading),
        "integration" => {
            let keys = ["integration.damping", "integration.gravity", "integration.allow_unstable"];
            keys.iter().any(|key| change.key.starts_with(key))
        }
        "wall" => {
            let keys = ["].velocity", "].servo", "].rotation.angular_velocity"];
            keys.iter().any(|key| change.key.contains(key))
        }
        // Numbers in the tables of laws.
        "material" | "interface" => {
            let number = |text: &str| text == "none" || text.parse::<f64>().is_ok();
            let fixed = [".density", ".deformable", ".name", ".between", ".thermal"];
            change.key.matches('.').count() >= 2
                && !fixed.iter().any(|key| change.key.contains(key))
                && number(&change.before)
                && number(&change.after)
        }
        _ => false,
    }
}

/// Whether the change is that of a history by which a mesh moves: its vertices would jump to other places.
fn places_mesh(change: &Change, scenario: &Scenario) -> bool {
    let number = change.key.strip_prefix("history[").and_then(|rest| rest.split(']').next()?.parse::<usize>().ok());
    let named = |name: &str| scenario.walls.iter().filter_map(|wall| wall.motion.as_ref()).any(|m| m.history == name);
    match number {
        Some(number) => scenario.histories.get(number).is_some_and(|history| named(&history.name)),
        None => scenario.walls.iter().any(|wall| wall.motion.is_some()),
    }
}

fn loading_allowed(change: &Change, before: &Loading, after: &Loading) -> bool {
    // The elongation at which the gauge should be counts from the start of the run.
    if before.opening() != after.opening() && (change.key == "loading" || change.key.starts_with("loading.opening")) {
        return false;
    }
    // The strain in bending and torsion is the rate times the time since the start, so the rate cannot change.
    let turning = |loading: &Loading| matches!(loading, Loading::Bending { .. } | Loading::Torsion { .. });
    let platens = |loading: &Loading| matches!(loading, Loading::Platens { .. } | Loading::Flexure { .. });
    if turning(before) || turning(after) || platens(before) != platens(after) {
        return false;
    }
    // The surfaces and the laws of platens and rollers are made at the start.
    !platens(before) || matches!(&change.key[..], "loading.closing_velocity" | "loading.area")
}

/// The changes from `before` to `after`, if a restart may make all of them.
///
/// # Errors
/// Every key that cannot change, with its position in `after`.
pub fn check(before: &Scenario, after: &Scenario, continuation: Continuation) -> Result<Vec<Change>, ScenarioError> {
    let changes = changes(before, after);
    let refused: Vec<&Change> =
        changes.iter().filter(|change| !allowed(change, [before, after], continuation)).collect();
    if refused.is_empty() {
        return Ok(changes);
    }
    let document = Document::parse(&after.source);
    let problem = |change: &Change| {
        let (span, value) = document.as_ref().map_or((0..0, None), |document| document.locate(&change.key));
        let message = format!("the scenario of the state has {}; a restart cannot change this key", change.before);
        let help = "restore the value, or start a new run. A restart may change stop, output, loading (not bending, torsion, or \
                    the kind of platens), prescribe, force, gravity, damping, velocities, angular velocities, and servos of walls, numbers in the tables of \
                    laws, and in a new result sample, stage, and history";
        let key = change.key.clone();
        Problem { kind: ProblemKind::Conflict, key, value, span, message, help: help.to_owned() }
    };
    Err(ScenarioError::new(&after.source, refused.into_iter().map(problem).collect()))
}

/// Replaces the initial state of `assembly` by a stored one, and applies the `changes` of the scenario.
///
/// Without changes the run continues bit for bit. `further`: continue a run that had ended.
///
/// # Errors
/// The state belongs to other particles, its columns do not fit, or its time step is above the stability bound of the
/// changed scenario.
pub fn apply(
    assembly: &mut Assembly,
    source: &mut dyn ColumnSource,
    scenario: &Scenario,
    changes: &[Change],
    further: bool,
) -> Result<(), RestartError> {
    let fresh = assembly.state.clone();
    assembly.state.read(source)?;
    let state = &mut assembly.state;
    same_particles(&fresh, state)?;
    state.check_indices()?;
    check_clock(state)?;
    let changed = |table: &str| changes.iter().any(|change| change.key.split(['.', '[']).next() == Some(table));
    if changed("loading") || changed("prescribe") {
        prescribe(&fresh, state);
        state.motion = None;
    }
    if changed("force") {
        state.particles.loads.clone_from(&fresh.particles.loads);
    }
    if changed("wall") || changed("loading") {
        for (wall, fresh) in state.walls.iter_mut().zip(&fresh.walls) {
            wall.velocity = fresh.velocity;
            if let (Some(turning), Some(fresh)) = (&mut wall.turning, &fresh.turning) {
                turning.angular_velocity = fresh.angular_velocity;
            }
        }
    }
    if ["material", "interface", "loading", "prescribe", "wall", "history"].into_iter().any(changed) {
        // These changes make stored and kinetic energy jump without work, so the energy balance starts again.
        state.ledger = Ledger::default();
        simulation::forget_turnover(&mut state.schedule_memory);
    }
    if further {
        not_over(state, scenario)?;
        let clock = state.clock;
        let new_stages = changed("stage").then_some((clock.time(), clock.step));
        simulation::continue_memory(&mut state.schedule_memory, changed("loading"), new_stages);
    }
    if !changes.is_empty() {
        stable(assembly, scenario)?;
    }
    Ok(())
}

/// More steps than any run takes; far from the largest number, so that numbers of later steps do not wrap.
const MOST_STEPS: u64 = 1 << 62;

/// Refuses a number of steps that no run has done.
fn check_clock(state: &State) -> Result<(), ColumnError> {
    if state.clock.step <= MOST_STEPS {
        return Ok(());
    }
    let problem = format!("has {} steps, more than any run takes", state.clock.step);
    Err(ColumnError::Value { path: "clock/step".to_owned(), row: 0, problem })
}

/// Refuses a state that is already past the end of the scenario.
fn not_over(state: &State, scenario: &Scenario) -> Result<(), AssemblyError> {
    let (step, time) = (state.clock.step, state.clock.time());
    if scenario.stop.steps.is_some_and(|steps| steps <= step) {
        let message =
            format!("the state is already at step {step}; steps count from the first start: give a larger number");
        return Err(unfit("stop.steps", message));
    }
    if scenario.stop.time.is_some_and(|end| end.si() <= time) {
        let message =
            format!("the state is already at {time:e} s; time counts from the first start: give a larger time");
        return Err(unfit("stop.time", message));
    }
    Ok(())
}

/// Refuses a state whose particles are not those of the scenario, in the same order.
fn same_particles(fresh: &State, state: &State) -> Result<(), AssemblyError> {
    let (a, b) = (&fresh.particles, &state.particles);
    let other = |what: String| {
        let message = format!(
            "the state does not belong to this packing: {what}. Use the packing, sets, and clumps of the run that wrote the \
             state"
        );
        Err(unfit("packing", message))
    };
    if a.len() != b.len() {
        return other(format!("it has {} particles, but the scenario has {}", b.len(), a.len()));
    }
    for p in 0..a.len() {
        let same = a.id[p] == b.id[p]
            && a.radius[p].to_bits() == b.radius[p].to_bits()
            && a.mass[p].to_bits() == b.mass[p].to_bits()
            && a.material[p] == b.material[p]
            && a.clump[p] == b.clump[p]
            && a.aggregate_of(p) == b.aggregate_of(p)
            && a.tags[p] == b.tags[p];
        if !same {
            return other(format!(
                "particle {} differs in id, radius, mass, material, clump, aggregate, or sets",
                a.id[p]
            ));
        }
    }
    if fresh.cell.is_some() != state.cell.is_some() {
        return other("only one of them has a periodic cell".to_owned());
    }
    Ok(())
}

/// Applies the prescribed motions of the new scenario; components that become free keep their velocity.
fn prescribe(fresh: &State, state: &mut State) {
    let (new, particles) = (&fresh.particles, &mut state.particles);
    for p in 0..particles.len() {
        let constraint: Constraint = new.constraint[p];
        particles.constraint[p] = constraint;
        for i in 0..3 {
            if constraint.translation(i) {
                particles.velocity[p][i] = new.velocity[p][i];
            }
            if constraint.rotation(i) {
                particles.angular_velocity[p][i] = new.angular_velocity[p][i];
            }
        }
    }
}

/// Keeps the time step of the state, and refuses it if it is unstable with the new parameters.
fn stable(assembly: &Assembly, scenario: &Scenario) -> Result<(), AssemblyError> {
    let bounds = &assembly.summary.bounds;
    let bound = bounds.spectral.max(bounds.per_particle) * assembly.model.damping.stability();
    let given = assembly.state.clock.dt;
    if given > bound && !scenario.integration.allow_unstable {
        return Err(AssemblyError::Unstable { given, bound, frequency: bounds.frequency });
    }
    Ok(())
}
