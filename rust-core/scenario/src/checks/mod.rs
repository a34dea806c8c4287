//! Reads a scenario from text or a file, and checks it.
//!
//! [`Scenario::parse`] and [`Scenario::read`] parse the TOML text, check its structure against the JSON Schema (keys, types,
//! units, ranges), and then check its meaning: values that contradict each other, names that do not exist, spheres that
//! overlap. They report all problems at once, each with line, key, value, and remedy.

mod aggregates;
mod bodies;
mod bonding;
mod cuts;
mod device;
mod faces;
mod fibers;
mod files;
mod heat;
mod histories;
mod joints;
mod laws;
mod loading;
mod opening;
mod packing;
mod phases;
mod plane;
mod plausible;
mod read;
mod samples;
mod scatter;
mod structure;
mod unused;
mod walls;

use crate::schema::quantity::{Dimension, Length, corner_faults};
use crate::schema::{Document, Problem, ProblemKind, Quantity, Scenario};
use concordem_contact::law::{Fault, FaultKind};
use structure::wording::{listing, nearest};

pub(crate) use packing::{OVERLAP_BONDED, OVERLAP_DEEP, OVERLAP_UNBONDED};
pub use read::read_text;
pub use samples::Misuse;
pub use structure::keys::{KeyInfo, find as find_keys, keys};

/// Relative difference up to which two components of a tensor count as equal; allows for rounding in unit conversion.
const SYMMETRY: f64 = 1e-12;

/// All problems that only the meaning of the values reveals.
fn check_meaning(document: &Document<'_>, scenario: &Scenario) -> Vec<Problem> {
    let mut checker = Checker { document, scenario, problems: Vec::new() };
    checker.packing();
    checker.materials();
    checker.laws();
    checker.strength_scatter();
    checker.strength_factors();
    checker.face_correction();
    checker.loading();
    checker.stages();
    checker.bondings();
    checker.stop();
    checker.histories();
    checker.walls();
    checker.opening_walls();
    checker.membranes();
    checker.cuts();
    checker.joints();
    checker.aggregates();
    checker.phases();
    checker.fibers();
    checker.sets();
    checker.clumps();
    checker.heat();
    checker.samples();
    checker.output();
    if scenario.dimension == 2 {
        checker.plane();
    }
    checker.deformable();
    checker.problems
}

/// Collects the problems of a scenario.
struct Checker<'a> {
    document: &'a Document<'a>,
    scenario: &'a Scenario,
    problems: Vec<Problem>,
}

impl Checker<'_> {
    fn add(&mut self, kind: ProblemKind, key: &str, message: impl Into<String>, help: impl Into<String>) {
        let (span, value) = self.document.locate(key);
        let (message, help) = (message.into(), help.into());
        self.problems.push(Problem { kind, key: key.to_owned(), value, span, message, help });
    }

    fn missing(&mut self, key: &str, message: impl Into<String>, help: impl Into<String>) {
        self.add(ProblemKind::MissingKey, key, message, help);
    }

    fn conflict(&mut self, key: &str, message: impl Into<String>, help: impl Into<String>) {
        self.add(ProblemKind::Conflict, key, message, help);
    }

    fn range(&mut self, key: &str, message: impl Into<String>, help: impl Into<String>) {
        self.add(ProblemKind::OutOfRange, key, message, help);
    }

    /// A fault of the table at `path`.
    fn fault(&mut self, path: &str, fault: Fault) {
        let key = if fault.key.is_empty() { path.to_owned() } else { format!("{path}.{}", fault.key) };
        let kind = match fault.kind {
            FaultKind::Missing => ProblemKind::MissingKey,
            FaultKind::Conflict => ProblemKind::Conflict,
            FaultKind::Range => ProblemKind::OutOfRange,
        };
        self.add(kind, &key, fault.message, fault.help);
    }

    /// Checks that `name` is one of `names`, the names of the tables `[[table]]`.
    fn known(&mut self, key: &str, table: &str, name: &str, names: &[&str]) {
        if names.contains(&name) {
            return;
        }
        let help = match (nearest(name, names.iter().copied()), names) {
            (_, []) => format!("the scenario has no {table}: add [[{table}]] with name = \"{name}\""),
            (Some(other), _) => format!("did you mean \"{other}\"?"),
            (None, _) => {
                let quoted: Vec<String> = names.iter().map(|name| format!("\"{name}\"")).collect();
                format!("choose {}, or add a [[{table}]] with this name", listing(&quoted))
            }
        };
        self.add(ProblemKind::UnknownName, key, format!("no {table} has this name"), help);
    }

    /// Checks that names are unique and not empty.
    fn unique(&mut self, table: &str, names: &[&str]) {
        for (at, name) in names.iter().enumerate() {
            let key = format!("{table}[{at}].name");
            if name.trim().is_empty() {
                self.range(&key, "the name is empty", "give it a name");
            } else if names[..at].contains(name) {
                self.conflict(&key, format!("another [[{table}]] has this name"), "give each its own name");
            }
        }
    }

    fn known_material(&mut self, key: &str, name: &str) {
        let scenario = self.scenario;
        let names: Vec<&str> = scenario.materials.iter().map(|material| material.name.as_str()).collect();
        self.known(key, "material", name, &names);
    }

    fn known_set(&mut self, key: &str, name: &str) {
        let scenario = self.scenario;
        let names: Vec<&str> = scenario.sets.iter().map(|set| set.name.as_str()).collect();
        self.known(key, "set", name, &names);
    }

    /// Checks that `minimum` and `maximum` span a box.
    fn corners(&mut self, path: &str, minimum: &[Length; 3], maximum: &[Length; 3]) {
        for fault in corner_faults(minimum, maximum) {
            self.fault(path, fault);
        }
    }
}

/// The values of a vector in SI units.
fn components<D: Dimension>(quantities: &[Quantity<D>; 3]) -> [f64; 3] {
    quantities.map(Quantity::si)
}

/// A length for messages, in m, mm, or um.
pub(crate) fn length(meters: f64) -> String {
    let (scale, unit) = if meters >= 1.0 {
        (1.0, "m")
    } else if meters >= 1e-4 {
        (1e3, "mm")
    } else {
        (1e6, "um")
    };
    let text = format!("{:.4}", meters * scale);
    format!("{} {unit}", text.trim_end_matches('0').trim_end_matches('.'))
}

#[cfg(test)]
mod tests {
    use crate::schema::{Scenario, TEMPLATES};

    #[test]
    fn templates_are_valid() {
        for template in TEMPLATES {
            if let Err(error) = Scenario::parse(template.name, template.text) {
                panic!("{error}");
            }
        }
    }
}
