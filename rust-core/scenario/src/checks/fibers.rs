//! Checks of fibers.

use super::{Checker, length};
use crate::schema::quantity::{Length, vector};
use crate::schema::{Aggregates, FiberGroup, Fibers, LawName, Packing, Surface};
use concordem_packing::fibers::sphere_count;

impl Checker<'_> {
    pub(super) fn fibers(&mut self) {
        let scenario = self.scenario;
        let Some(fibers) = &scenario.fibers else { return };
        self.what_fibers_exclude();
        self.surface_of_fibers(fibers);
        for (at, group) in fibers.groups.iter().enumerate() {
            let path = format!("fibers.group[{at}]");
            self.material_of_fibers(&path, &group.material);
            self.amount_of_fibers(&path, group);
        }
    }

    fn what_fibers_exclude(&mut self) {
        let scenario = self.scenario;
        if scenario.bonds.is_none() {
            let help = "add [bonds] with the law of the matrix and of its bonds with the fibers";
            self.missing("fibers", "fibers need bonds with the particles around them", help);
        }
        let planar = scenario.dimension == 2 || matches!(scenario.packing, Packing::RandomDiscs { .. });
        let corrected = scenario.packing.correction().is_some();
        for (what, given) in [
            ("the chains of fibers are beams in space", planar),
            ("the law \"cohesive_beam\" does not support deformable particles", {
                scenario.materials.iter().any(|material| material.deformable.is_some())
            }),
            ("[heat] has no network for particles that overlap fibers", scenario.heat.is_some()),
            ("[[bonding]] makes bonds later, fibers need them at the start", !scenario.bondings.is_empty()),
            ("packing.correction numbers all spheres of the packing, and fibers remove some", corrected),
        ] {
            if given {
                self.conflict("fibers", format!("cannot be combined: {what}"), "remove one of the two");
            }
        }
    }

    fn surface_of_fibers(&mut self, fibers: &Fibers) {
        let scenario = self.scenario;
        if fibers.surface.is_some() && (scenario.packing.is_periodic() || scenario.aggregates.is_some()) {
            let message = if scenario.packing.is_periodic() {
                "a periodic packing has no surface"
            } else {
                "the surface is that of [aggregates]"
            };
            self.conflict("fibers.surface", message, "remove the key");
        }
        let surface = match &scenario.aggregates {
            Some(Aggregates { surface, .. }) => *surface,
            None => fibers.surface,
        };
        if fibers.wall_gap.si() > 0.0 && (scenario.packing.is_periodic() || surface == Some(Surface::Sawn)) {
            self.conflict("fibers.wall_gap", "the specimen has no mould", "remove the key");
        }
    }

    /// Checks that a material belongs to fibers alone, and that it has the parameters of all their bonds.
    fn material_of_fibers(&mut self, path: &str, name: &str) {
        let scenario = self.scenario;
        let key = format!("{path}.material");
        self.known_material(&key, name);
        let Some(at) = scenario.materials.iter().position(|material| material.name == *name) else { return };
        let others = scenario
            .sets
            .iter()
            .filter_map(|set| set.material.as_deref())
            .chain(scenario.clumps.iter().filter_map(|clump| clump.material.as_deref()))
            .chain(scenario.materials_of_aggregates());
        let given = scenario.phases.as_ref().is_some_and(|phases| phases.materials.contains(&(at as u16)));
        if at == 0 || given || others.into_iter().any(|other| other == name) {
            let help = "give the fibers a material of their own, after that of the matrix";
            self.conflict(&key, "other particles have this material", help);
            return;
        }
        let material = &scenario.materials[at];
        match &material.cohesive_beam {
            None => {
                let message = format!("material \"{name}\" has no table of this law, which fibers require");
                let help = "add [material.cohesive_beam] below this [[material]]";
                self.missing(&format!("material[{at}].cohesive_beam"), message, help);
            }
            Some(table) => {
                let law = scenario.bonds.as_ref().map(|bonds| bonds.law);
                if table.hydrostatic_strength.is_some() && law != Some(LawName::CohesiveBeam) {
                    let help = "remove the key, or use bonds.law = \"cohesive_beam\"";
                    let message = "has no effect: only the law of [bonds] has failure of whole particles";
                    self.conflict(&format!("material[{at}].cohesive_beam.hydrostatic_strength"), message, help);
                }
            }
        }
        let Some(law) = scenario.bonds.as_ref().map(|bonds| bonds.law) else { return };
        let matrix = &scenario.materials[0].name;
        let between = scenario.interfaces.iter().find(|interface| interface.joins(matrix, name));
        let given = |interface: &crate::schema::Interface| {
            interface.of.is_some() || interface.tables().iter().any(|(other, _)| *other == law)
        };
        if !material.has(law) && !between.is_some_and(given) {
            let law = law.key();
            let help = format!(
                "add [[interface]] with between = [\"{matrix}\", \"{name}\"] and of = \"{matrix}\", or [material.{law}]"
            );
            let message = format!("no bond joins \"{name}\" with the matrix \"{matrix}\"");
            self.missing(&format!("material[{at}].{law}"), message, help);
        }
    }

    /// Checks the number and the size of the fibers of a group.
    fn amount_of_fibers(&mut self, path: &str, group: &FiberGroup) {
        let given = [
            ("length", group.length.is_some()),
            ("volume_fraction", group.volume_fraction.is_some()),
            ("count", group.count.is_some()),
            ("direction", group.direction.is_some()),
        ];
        if let Some(lines) = &group.lines {
            for (key, _) in given.iter().filter(|(_, given)| *given) {
                let help = "the lines give number, length, and direction: remove this key";
                self.conflict(&format!("{path}.{key}"), "has no effect with `lines`", help);
            }
            if lines.is_empty() {
                self.range(&format!("{path}.lines"), "no fibers", "list at least one as [[x, y, z], [x, y, z]]");
            }
            for (at, [from, to]) in lines.iter().enumerate() {
                let span = (vector(to) - vector(from)).norm();
                self.slender(&format!("{path}.lines[{at}]"), span, group.diameter);
            }
            return;
        }
        if let Some(given) = group.length {
            self.slender(&format!("{path}.length"), given.si(), group.diameter);
        } else {
            let help = "add `length = \"12 mm\"`, or list the ends in `lines`";
            self.missing(&format!("{path}.length"), "gives neither `length` nor `lines`", help);
        }
        match (group.volume_fraction, group.count) {
            (None, None) => {
                let help = "add `volume_fraction = 0.01`, `count`, or `lines`";
                self.missing(&format!("{path}.volume_fraction"), "the amount is missing", help);
            }
            (Some(_), Some(_)) => {
                self.conflict(&format!("{path}.count"), "gives both `volume_fraction` and `count`", "keep one of them");
            }
            _ => {}
        }
        if let Some(direction) = group.direction
            && direction.iter().all(|component| component.si() == 0.0)
        {
            self.range(&format!("{path}.direction"), "has no direction", "give one such as [1, 0, 0]");
        }
    }

    fn slender(&mut self, key: &str, given: f64, diameter: Length) {
        if sphere_count(given, diameter.si()).is_err() {
            let message =
                format!("a fiber of {} with a diameter of {} has no two spheres", length(given), length(diameter.si()));
            self.range(key, message, "give at least two diameters, and at most 100,000");
        }
    }
}
