//! Checks of materials, interfaces, and the laws in use.

use super::Checker;
use super::structure::wording::listing;
use crate::schema::{DeformableUpdate, Interface, LawName, Loading, Scenario};
use concordem_contact::law::LawTable;

/// Names of the materials that particles may have, but those of fibers, whose bonds have other rules.
pub(super) fn materials_of_particles(scenario: &Scenario) -> Vec<&str> {
    let mut names = vec![scenario.materials[0].name.as_str()];
    names.extend(scenario.sets.iter().filter_map(|set| set.material.as_deref()));
    names.extend(scenario.materials_of_aggregates());
    let given = scenario.phases.iter().flat_map(|phases| &phases.materials);
    let mut given: Vec<u16> = given.copied().collect();
    given.sort_unstable();
    given.dedup();
    names.extend(given.iter().filter_map(|&at| Some(&scenario.materials.get(usize::from(at))?.name[..])));
    names.extend(scenario.clumps.iter().filter_map(|clump| clump.material.as_deref()));
    names
}

/// Names of the materials that particles or walls may have.
pub(super) fn materials_of_contacts(scenario: &Scenario) -> Vec<&str> {
    let mut names = materials_of_particles(scenario);
    names.extend(scenario.fibers.iter().flat_map(|fibers| &fibers.groups).map(|group| group.material.as_str()));
    names.extend(scenario.walls.iter().map(|wall| wall.material.as_str()));
    if let Loading::Platens { material: Some(material), .. } = &scenario.loading {
        names.push(material);
    }
    names
}

impl Checker<'_> {
    /// Checks the names of materials, and the parameter tables of materials and interfaces.
    pub(super) fn materials(&mut self) {
        let scenario = self.scenario;
        let names: Vec<&str> = scenario.materials.iter().map(|material| material.name.as_str()).collect();
        self.unique("material", &names);
        let materials = scenario.materials.iter().map(|material| material.tables()).enumerate();
        let interfaces = scenario.interfaces.iter().map(|interface| interface.tables()).enumerate();
        let tables = materials
            .map(|(at, tables)| (format!("material[{at}]"), tables))
            .chain(interfaces.map(|(at, tables)| (format!("interface[{at}]"), tables)));
        let mut first: Vec<(LawName, String, String)> = Vec::new();
        for (owner, tables) in tables {
            for (law, table) in tables {
                self.law_table(&format!("{owner}.{}", law.key()), law, table, &mut first);
            }
        }
        for (at, interface) in scenario.interfaces.iter().enumerate() {
            self.interface(at, interface);
            for (law, table) in interface.tables() {
                for key in table.keys_of_particles() {
                    let help = "give it in the [[material]] of the particles, or remove it here";
                    let message =
                        "has no effect in an interface: it is a property of particles, not of a pair of materials";
                    self.conflict(&format!("interface[{at}].{}.{key}", law.key()), message, help);
                }
            }
        }
    }

    /// Checks the table of a law at `path`. `first` holds the keys on which all tables of a law must agree: law, value,
    /// path.
    fn law_table(
        &mut self,
        path: &str,
        law: LawName,
        table: &dyn LawTable,
        first: &mut Vec<(LawName, String, String)>,
    ) {
        for fault in table.faults() {
            self.fault(path, fault);
        }
        let Some((key, value)) = table.uniform_key() else { return };
        match first.iter().find(|(other, _, _)| *other == law) {
            None => first.push((law, value, path.to_owned())),
            Some((_, same, other)) if *same != value => {
                let help = format!("use one {key} in a scenario: write that of `{other}` here, too");
                self.conflict(&format!("{path}.{key}"), format!("`{other}` has another {key}"), help);
            }
            Some(_) => {}
        }
    }

    fn interface(&mut self, at: usize, interface: &Interface) {
        let [a, b] = &interface.between;
        for (side, name) in [a, b].into_iter().enumerate() {
            self.known_material(&format!("interface[{at}].between[{side}]"), name);
        }
        let key = format!("interface[{at}].between");
        if a == b && !self.scenario.materials_of_aggregates().contains(&a.as_str()) {
            let help =
                "give the parameters in the material itself; only aggregates have an interface with their own material";
            self.conflict(&key, "the interface joins a material with itself", help);
        }
        self.factors(at, interface);
        let same = |[x, y]: &[String; 2]| (x == a && y == b) || (x == b && y == a);
        if self.scenario.interfaces[..at].iter().any(|other| same(&other.between)) {
            self.conflict(&key, "another [[interface]] joins the same materials", "merge the two");
        }
    }

    /// Checks the material and the factors from which an interface takes its parameters.
    fn factors(&mut self, at: usize, interface: &Interface) {
        let scenario = self.scenario;
        let path = format!("interface[{at}]");
        let Some(of) = &interface.of else {
            if interface.factors.is_some() {
                let help =
                    format!("add `of = \"{}\"`, the material whose parameters they multiply", interface.between[0]);
                self.missing(&format!("{path}.of"), "missing key, required by `factors`", help);
            }
            return;
        };
        self.known_material(&format!("{path}.of"), of);
        let Some(material) = scenario.materials.iter().find(|material| material.name == *of) else { return };
        let bonds = scenario.bonds.as_ref().map(|bonds| bonds.law);
        let own = |law: LawName| interface.tables().iter().any(|(name, _)| *name == law);
        if bonds.into_iter().chain(scenario.contacts.law.law()).all(own) {
            let help = "remove `of` and `factors`, or the tables";
            self.conflict(&format!("{path}.of"), "has no effect: the interface has a table of every law in use", help);
        }
        let factors = interface.factors.unwrap_or_default();
        let bonds = bonds.filter(|law| !own(*law)).map(|law| (law, factors));
        let contacts = scenario.contacts.law.law().filter(|law| !own(*law)).map(|law| (law, factors.of_contacts()));
        for (law, factors) in bonds.into_iter().chain(contacts) {
            if let Some(fault) = material.fault_of_factors(law, &factors) {
                let key = if fault.key.is_empty() { String::new() } else { format!(".{}", fault.key) };
                self.conflict(&format!("{path}.factors{key}"), fault.message, fault.help);
            }
        }
    }

    /// Checks the laws of bonds and contacts, and that every material in use has their parameters.
    pub(super) fn laws(&mut self) {
        let scenario = self.scenario;
        let (of_particles, of_contacts) = (materials_of_particles(scenario), materials_of_contacts(scenario));
        let mut required: Vec<(&str, LawName, &[&str])> = Vec::new();
        if let Some(bonds) = &scenario.bonds {
            if bonds.coordination.is_some() && bonds.interaction_ratio.si() != 1.0 {
                let help = "`coordination` determines the ratio: remove one of the two keys";
                self.conflict("bonds.interaction_ratio", "has no effect with `coordination`", help);
            }
            required.push(("bonds.law", bonds.law, &of_particles));
        }
        if let Some(law) = scenario.contacts.law.law() {
            required.push(("contacts.law", law, &of_contacts));
        } else {
            let help = "choose a contact law such as \"frictional\"";
            if !scenario.walls.is_empty() {
                self.conflict("contacts.law", "without a contact law, particles pass through the walls", help);
            }
            if matches!(scenario.loading, Loading::Platens { strip_width: None, .. }) {
                self.conflict("contacts.law", "without a contact law, particles pass through the platens", help);
            }
        }
        self.parameters(&required);
        self.excluded();
    }

    /// Checks the pairs of materials without contact.
    fn excluded(&mut self) {
        let scenario = self.scenario;
        let pairs = &scenario.contacts.exclude;
        if pairs.is_empty() {
            return;
        }
        if scenario.contacts.law.law().is_none() {
            self.conflict("contacts.exclude", "has no effect without a contact law", "remove the key");
        }
        if scenario.heat.is_some() {
            let help = "remove the key, or [heat]";
            self.conflict("contacts.exclude", "heat would flow between particles that do not touch", help);
        }
        for (at, [a, b]) in pairs.iter().enumerate() {
            for (side, name) in [a, b].into_iter().enumerate() {
                self.known_material(&format!("contacts.exclude[{at}][{side}]"), name);
            }
            let same = |[x, y]: &[String; 2]| (x == a && y == b) || (x == b && y == a);
            if pairs[..at].iter().any(same) {
                self.conflict(&format!("contacts.exclude[{at}]"), "names the same pair twice", "remove one");
            }
        }
    }

    /// Checks that every material in use has a table of each law in use. `required`: key that chooses a law, the law,
    /// its materials.
    fn parameters(&mut self, required: &[(&str, LawName, &[&str])]) {
        for (at, material) in self.scenario.materials.iter().enumerate() {
            let missing: Vec<_> = required
                .iter()
                .filter(|(_, law, names)| names.contains(&material.name.as_str()) && !material.has(*law))
                .collect();
            for (rank, (key, law, _)) in missing.iter().enumerate() {
                if missing[..rank].iter().any(|(_, other, _)| other == law) {
                    continue;
                }
                let law = law.key();
                let message = format!("material \"{}\" has no table of this law, which {key} requires", material.name);
                let help = format!("add [material.{law}] below this [[material]]");
                self.missing(&format!("material[{at}].{law}"), message, help);
            }
        }
    }

    /// Checks deformable particles: their options, and laws and bodies that exclude them.
    pub(super) fn deformable(&mut self) {
        let scenario = self.scenario;
        let first = scenario.materials.iter().position(|material| material.deformable.is_some());
        self.deformable_options(first.is_some());
        let Some(first) = first else { return };
        let key = format!("material[{first}].deformable");
        for law in scenario.bonds.iter().map(|bonds| bonds.law).chain(scenario.contacts.law.law()) {
            if !law.facts().deforms {
                let message = format!("the law \"{}\" does not support deformable particles", law.key());
                let deforming = LawName::ALL.iter().filter(|law| law.facts().deforms);
                let quoted: Vec<String> = deforming.map(|law| format!("\"{}\"", law.key())).collect();
                let help = format!("use {}, or remove this table", listing(&quoted));
                self.conflict(&key, message, help);
            }
        }
        if !scenario.clumps.is_empty() {
            let help = "the solver does not know the forces inside a clump; remove the clumps, or this table";
            self.conflict(&key, "members of clumps cannot deform", help);
        }
    }

    fn deformable_options(&mut self, any_material: bool) {
        let dimension = self.scenario.dimension;
        let Some(options) = &self.scenario.deformable else { return };
        if !any_material {
            let help =
                "add `deformable = { young = \"200 GPa\", poisson = 0.3 }` to a material, or remove [deformable]";
            self.conflict("deformable", "no material is deformable", help);
        }
        if let Some(condition) = options.condition
            && condition.is_planar() != (dimension == 2)
        {
            let help = if dimension == 2 {
                "use \"plane-strain\" or \"plane-stress\""
            } else {
                "use \"solid\" or omit the key; or use dimension = 2"
            };
            self.conflict("deformable.condition", format!("not possible with dimension = {dimension}"), help);
        }
        if options.update == DeformableUpdate::Lagged {
            let given = [
                ("tolerance", options.tolerance.is_some()),
                ("maximum_iterations", options.maximum_iterations.is_some()),
                ("relaxation", options.relaxation.is_some()),
            ];
            for (key, _) in given.into_iter().filter(|(_, given)| *given) {
                let help = "write update = \"iterated\", or remove this key";
                self.conflict(&format!("deformable.{key}"), "has no effect without iteration", help);
            }
        }
    }
}
