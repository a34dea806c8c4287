//! Warnings about a scenario: tables and keys that have no effect, and implausible numbers.
//!
//! Keys that contradict each other are errors. Unused input that may be intended, such as the table of a law for the next
//! run, gives a warning.

use super::Checker;
use crate::schema::{Document, LawName, Problem, ProblemKind, Scenario, TimeStep};
use concordem_solver::state::PointOfAction;

impl Scenario {
    /// Warnings about keys and tables that have no effect, and about implausible numbers, in the order of the text.
    ///
    /// ```
    /// use concordem_scenario::schema::Scenario;
    ///
    /// let scenario = Scenario::parse("two.toml", r#"
    ///     version = 1
    ///     [packing]
    ///     kind = "spheres"
    ///     spheres = [[0, 0, 0, 1], [2.5, 0, 0, 1]]
    ///     [[material]]
    ///     name = "glass"
    ///     density = 2500
    ///     hertz_mindlin = { young = "70 GPa", poisson = 0.2 }
    ///     frictional = { normal_stiffness = 1e6, shear_stiffness = 1e6 }
    ///     [contacts]
    ///     law = "hertz_mindlin"
    ///     [stop]
    ///     steps = 100
    /// "#)?;
    /// let keys: Vec<_> = scenario.warnings().into_iter().map(|warning| warning.key).collect();
    /// assert_eq!(keys, ["material[0].frictional"]);
    /// # Ok::<(), concordem_scenario::schema::ScenarioError>(())
    /// ```
    pub fn warnings(&self) -> Vec<Problem> {
        let Ok(document) = Document::parse(&self.source) else { return Vec::new() };
        let mut checker = Checker { document: &document, scenario: self, problems: Vec::new() };
        checker.unused_tables();
        checker.unused_materials();
        checker.unused_keys();
        checker.unused_histories();
        checker.strains_behind();
        checker.unused_thermal();
        checker.implausible();
        checker.deep_overlaps();
        let mut problems = checker.problems;
        problems.sort_by_key(|problem| (problem.span.start, problem.span.end));
        problems
    }
}

impl Checker<'_> {
    pub(super) fn warn(&mut self, key: &str, message: impl Into<String>, help: impl Into<String>) {
        self.add(ProblemKind::Warning, key, message, help);
    }

    /// Whether the text gives a value at the key path.
    fn gives(&self, key: &str) -> bool {
        self.document.locate(key).1.is_some()
    }

    /// Warns about tables of laws that neither bonds nor contacts use, and about keys of bonds in the tables of
    /// unbonded contacts.
    fn unused_tables(&mut self) {
        let scenario = self.scenario;
        let bonds = scenario.bonds.as_ref().map(|bonds| bonds.law);
        let contacts = scenario.contacts.law.law();
        let materials = scenario.materials.iter().enumerate();
        let interfaces = scenario.interfaces.iter().enumerate();
        let tables = materials
            .map(|(at, material)| (format!("material[{at}]"), material.tables()))
            .chain(interfaces.map(|(at, interface)| (format!("interface[{at}]"), interface.tables())));
        let fibers: Vec<String> = (0..scenario.materials.len())
            .filter(|&at| scenario.fibers_of(&scenario.materials[at].name).next().is_some())
            .map(|at| format!("material[{at}]"))
            .collect();
        let in_fibers = |owner: &String, law: LawName| {
            let of_fiber = fibers.contains(owner) || owner.starts_with("interface") && !fibers.is_empty();
            law == LawName::CohesiveBeam && of_fiber
        };
        for (owner, tables) in tables {
            for (law, table) in tables {
                let path = format!("{owner}.{}", law.key());
                if bonds == Some(law) || in_fibers(&owner, law) {
                    continue;
                }
                if contacts != Some(law) {
                    let help = "name the law in bonds.law or contacts.law, or remove the table";
                    self.warn(&path, "neither bonds nor contacts use this law, so the table has no effect", help);
                    continue;
                }
                for key in table.keys_of_bonds() {
                    let help = format!("write law = \"{}\" in [bonds], or remove the key", law.key());
                    self.warn(
                        &format!("{path}.{key}"),
                        "has no effect: only bonds use this key, and the bonds have another law or none",
                        help,
                    );
                }
            }
        }
    }

    /// Warns about materials that no particle and no wall has.
    fn unused_materials(&mut self) {
        let scenario = self.scenario;
        let in_use = super::laws::materials_of_contacts(scenario);
        for (at, material) in scenario.materials.iter().enumerate() {
            if !in_use.contains(&material.name.as_str()) {
                let help =
                    "name it in a [[set]], [[clump]], [[wall]], or group of [aggregates] or [fibers], or remove it";
                self.warn(&format!("material[{at}].name"), "no particle and no wall has this material", help);
            }
        }
    }

    /// Warns about thermal constants without heat conduction.
    fn unused_thermal(&mut self) {
        let scenario = self.scenario;
        for (at, material) in scenario.materials.iter().enumerate() {
            if material.thermal.is_some() && scenario.heat.is_none() {
                let help = "add [heat] with `temperature`, or remove the table";
                self.warn(&format!("material[{at}].thermal"), "has no effect without heat conduction", help);
            }
        }
    }

    /// Warns about single keys without effect.
    fn unused_keys(&mut self) {
        let scenario = self.scenario;
        if matches!(scenario.integration.time_step, TimeStep::Given(_)) && self.gives("integration.safety") {
            let help = "write time_step = \"auto\", or remove the key";
            self.warn("integration.safety", "has no effect with a given time step", help);
        }
        if scenario.materials.iter().all(|material| material.deformable.is_none()) {
            for (at, _) in scenario.forces.iter().enumerate().filter(|(_, f)| f.acts != PointOfAction::Body) {
                let help = "add `deformable = { young = \"200 GPa\", poisson = 0.3 }` to a material, or remove the key";
                self.warn(&format!("force[{at}].acts"), "has no effect: no material is deformable", help);
            }
        }
        let laws = || scenario.bonds.iter().map(|bonds| bonds.law).chain(scenario.contacts.law.law());
        let by_orientation = |law: LawName| law.facts().reads_orientations;
        if self.gives("kinematics") && laws().count() > 0 && laws().all(by_orientation) {
            let help = "remove the key";
            self.warn("kinematics", "has no effect: the law measures relative motion from orientations", help);
        }
        if scenario.bonds.is_none() && scenario.output.bond_snapshots {
            self.warn("output.bond_snapshots", "has no effect without bonds", "add [bonds], or remove the key");
        }
        if scenario.bonds.is_none() && self.gives("output.events_damage") {
            self.warn("output.events_damage", "has no effect without bonds", "add [bonds], or remove the key");
        }
    }
}
