//! Checks of bonds made during the run.

use super::Checker;
use crate::schema::Bonding;

/// Largest number of tables `[[bonding]]`: the state remembers them as bits of a number.
const MOST: usize = 50;

impl Checker<'_> {
    /// Bonds made during the run, and what they exclude.
    pub(super) fn bondings(&mut self) {
        let scenario = self.scenario;
        if let Some(bonds) = scenario.bonds.as_ref().filter(|bonds| !bonds.at_start) {
            if scenario.bondings.is_empty() {
                let help = "add [[bonding]] with `stage`, `time`, or `kinetic_energy`, or remove the key";
                self.conflict("bonds.at_start", "nothing ever makes bonds", help);
            }
            if bonds.coordination.is_some() || bonds.interaction_ratio.si() != 1.0 {
                let key = if bonds.coordination.is_some() { "bonds.coordination" } else { "bonds.interaction_ratio" };
                let help = "remove the key, and give `interaction_ratio` in [[bonding]]";
                self.conflict(key, "has no effect without bonds at the start", help);
            }
        }
        if scenario.bondings.len() > MOST {
            let help = "give two materials, or none, instead of many tables";
            self.range("bonding", format!("more than {MOST} tables"), help);
        }
        for (at, bonding) in scenario.bondings.iter().enumerate() {
            self.bonding(&format!("bonding[{at}]"), bonding);
        }
    }

    fn bonding(&mut self, key: &str, bonding: &Bonding) {
        let scenario = self.scenario;
        if scenario.bonds.is_none() {
            let help = "add [bonds] with the law, and at_start = false if there are no bonds at the start";
            self.missing(key, "the scenario has no law of bonds", help);
        }
        match &bonding.stage {
            Some(stage) => {
                let names: Vec<&str> = scenario.stages.iter().map(|stage| stage.name.as_str()).collect();
                self.known(&format!("{key}.stage"), "stage", stage, &names);
                for (name, given) in
                    [("time", bonding.time.is_some()), ("kinetic_energy", bonding.kinetic_energy.is_some())]
                {
                    if given {
                        let help = "remove it, or remove `stage`; a stage may itself end by time";
                        self.conflict(&format!("{key}.{name}"), "the bonds are made at the end of the stage", help);
                    }
                }
                if names.last() == Some(&stage.as_str()) {
                    let help = "add a stage after it";
                    self.conflict(&format!("{key}.stage"), "the run ends with this stage", help);
                }
            }
            None if bonding.time.is_none() && bonding.kinetic_energy.is_none() => {
                self.missing(key, "does not say when", "give `stage`, `time`, or `kinetic_energy`");
            }
            None => {}
        }
        for (end, name) in bonding.between.iter().flatten().enumerate() {
            self.known_material(&format!("{key}.between[{end}]"), name);
        }
        for (what, given) in [
            ("[heat] conducts along the contacts of the start", scenario.heat.is_some()),
            ("[[cut]] separates particles only at the start", !scenario.cuts.is_empty()),
            (
                "no energy balance is known for deformable particles",
                scenario.materials.iter().any(|m| m.deformable.is_some()),
            ),
        ] {
            if given {
                self.conflict(key, format!("cannot be combined: {what}"), "remove one of the two");
            }
        }
    }
}
