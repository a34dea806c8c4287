//! Checks of given phases.

use super::Checker;

impl Checker<'_> {
    pub(super) fn phases(&mut self) {
        let scenario = self.scenario;
        let Some(phases) = &scenario.phases else { return };
        if scenario.aggregates.is_some() {
            let help = "keep one of the two: both determine the materials of the particles";
            self.conflict("phases", "cannot be combined with [aggregates]", help);
        }
        let count = scenario.materials.len();
        if let Some(at) = phases.materials.iter().position(|&material| usize::from(material) >= count) {
            let help = format!("the scenario has {count} materials, which count from 0");
            self.range(&format!("phases.materials[{at}]"), "no material has this number", help);
        }
        if !phases.aggregates.is_empty() && phases.aggregates.len() != phases.materials.len() {
            let message = format!("{} numbers for {} materials", phases.aggregates.len(), phases.materials.len());
            self.conflict("phases.aggregates", message, "give one number per sphere, or none");
            return;
        }
        // One aggregate has one material; the numbers are small in practice, but may be any.
        let mut of = std::collections::HashMap::new();
        for (at, (&aggregate, &material)) in phases.aggregates.iter().zip(&phases.materials).enumerate() {
            if aggregate > 0 && *of.entry(aggregate).or_insert(material) != material {
                let message = format!("aggregate {aggregate} has spheres of two materials");
                self.conflict(&format!("phases.aggregates[{at}]"), message, "give each aggregate one material");
                return;
            }
        }
    }
}
