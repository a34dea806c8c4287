//! Builds and runs scenarios.

use std::path::Path;

use concordem::assembly::{Assembly, AssemblyError, assemble};
use concordem::scenario::Scenario;
use concordem::schedule::{Record, Simulation};

use crate::on_threads;

/// Builds a scenario whose files are in `folder`.
pub fn built(text: &str, folder: &Path) -> Result<Assembly, AssemblyError> {
    let scenario = Scenario::parse("test.toml", text).unwrap_or_else(|error| panic!("{error}"));
    assemble(&scenario, folder, &mut |_, _| {})
}

/// Builds a sound scenario without files.
pub fn made(text: &str) -> Assembly {
    sound(built(text, Path::new(".")))
}

/// The assembly of a scenario that must not be refused.
pub fn sound(built: Result<Assembly, AssemblyError>) -> Assembly {
    built.unwrap_or_else(|error| panic!("{error}"))
}

/// Key and message of the error of a scenario that must be refused.
pub fn refusal(built: Result<Assembly, AssemblyError>) -> (String, String) {
    match built {
        Err(AssemblyError::Unfit { key, message }) => (key, message),
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("the scenario is accepted"),
    }
}

/// The simulation of an assembly.
pub fn started(assembly: Assembly) -> Simulation {
    Simulation::new(assembly.state, assembly.model, assembly.schedule).expect("a sound assembly")
}

/// Runs a simulation to its end; returns the last record, if there is one.
pub fn finish(simulation: &mut Simulation) -> Option<Record> {
    let mut last = None;
    loop {
        let advance = simulation.advance().unwrap_or_else(|error| panic!("{error}"));
        last = advance.sample.or(last);
        if advance.stopped.is_some() {
            return last;
        }
    }
}

/// Runs a scenario to its end on one thread.
pub fn run(text: &str) -> Simulation {
    on_threads(1, || {
        let mut simulation = started(made(text));
        finish(&mut simulation);
        simulation
    })
}
