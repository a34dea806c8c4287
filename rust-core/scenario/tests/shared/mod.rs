//! What several tests of scenarios share: short scenarios, simulations, and the values of operators.

#![allow(dead_code, reason = "every test program uses a part of it")]

use std::ops::Range;
use std::path::Path;

use concordem_scenario::assembly::{Assembly, AssemblyError, assemble};
use concordem_scenario::sampling::ScheduledOperator;
use concordem_scenario::schedule::Simulation;
use concordem_scenario::schema::Scenario;

/// The parameters of springs that bond spheres.
pub const SPRING: &str = "{ normal_stiffness = 1e6, shear_stiffness = 5e5 }";

/// The start of a scenario of one material, in which spheres that touch are bonded by `law` and nothing else acts.
pub fn bonded(packing: &str, law: &str, parameters: &str) -> String {
    format!(
        "version = 1
        [packing]
        {packing}
        [[material]]
        name = \"m\"
        density = 2500
        {law} = {parameters}
        [bonds]
        law = \"{law}\"
        interaction_ratio = 1.01
        [contacts]
        law = \"none\"
        "
    )
}

/// A packing of listed spheres: centers and radii, m.
pub fn spheres(list: &[[f64; 4]]) -> String {
    format!("kind = \"spheres\"\nspheres = {list:?}")
}

/// A set of the particles with these numbers.
pub fn set(name: &str, ids: &[usize]) -> String {
    format!("[[set]]\nname = \"{name}\"\nselection = {{ kind = \"ids\", ids = {ids:?} }}\n")
}

/// A sound scenario.
pub fn read(text: &str) -> Scenario {
    Scenario::parse("test.toml", text).unwrap_or_else(|error| panic!("{error}"))
}

/// What a sound scenario without files becomes.
pub fn try_assembled(text: &str) -> Result<Assembly, AssemblyError> {
    assemble(&read(text), Path::new(""), &mut |_, _| ())
}

/// As [`try_assembled`], for a scenario that can be assembled.
pub fn assembled(text: &str) -> Assembly {
    try_assembled(text).unwrap_or_else(|error| panic!("{error}"))
}

/// The simulation of a sound scenario without files.
pub fn simulation(text: &str) -> Simulation {
    let assembly = assembled(text);
    let names: Vec<String> = assembly.state.walls.iter().map(|wall| wall.name.clone()).collect();
    assert_eq!(names, read(text).wall_names());
    Simulation::new(assembly.state, assembly.model, assembly.schedule).unwrap()
}

/// Number of the operator `name`.
pub fn number(operators: &[ScheduledOperator], name: &str) -> usize {
    operators.iter().position(|sample| sample.name == name).unwrap_or_else(|| panic!("no operator {name}"))
}

/// Where a row of an operator has the values of a quantity.
pub fn place(sample: &ScheduledOperator, quantity: &str) -> Range<usize> {
    let mut first = 0;
    for q in sample.operator.quantities() {
        let last = first + q.components * sample.cells();
        if q.name == quantity {
            return first..last;
        }
        first = last;
    }
    panic!("{} has no {quantity}", sample.name)
}
