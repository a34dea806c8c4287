//! Rules of heat conduction that hold in scenarios and in hosts: keys that exclude or require each other. The schema has the ranges of
//! single keys.

use super::{Heat, HeatBoundary, HeatContact, HeatNetwork, HeatSource};
use crate::law::Fault;
use crate::law::linear_bond::LinearBondTable;
use crate::material::{Material, Thermal};

const LATTICES: &str = "remove the key, or use the model \"ordered\" or \"disordered\"";

impl Heat {
    /// Faults of keys of `[heat]` itself.
    pub fn faults(&self, materials: &[Material]) -> Vec<Fault> {
        let mut faults = Vec::new();
        if self.model == HeatNetwork::Contacts {
            for (key, given) in [("pairs", self.pairs.is_some()), ("contact_ratio", self.contact_ratio.is_some())] {
                if given {
                    let message = "has no effect: heat flows through bonds and present contacts";
                    faults.push(Fault::conflict(key, message, LATTICES));
                }
            }
            if self.contact.is_none() {
                let help = "add `contact = { resistance = \"1e-5 m^2*K/W\" }` or `contact = { constriction = true }`";
                let message = "the model \"contacts\" needs to know how contacts conduct";
                faults.push(Fault::missing("contact", message, help));
            }
        }
        if self.reference_temperature.is_some() && !materials.iter().any(Material::expands) {
            let help = "give a material `thermal.expansion`, or remove the key";
            faults.push(Fault::conflict("reference_temperature", "has no effect: no material expands", help));
        }
        faults
    }
}

impl HeatContact {
    /// A fault of the table.
    pub fn fault(&self) -> Option<Fault> {
        let message = "needs exactly one of `resistance` and `constriction = true`";
        (self.resistance.is_some() == self.constriction).then(|| Fault::conflict("", message, "give one of them"))
    }
}

impl HeatSource {
    /// A fault of the power.
    pub fn fault(&self) -> Option<Fault> {
        match (self.power, self.density) {
            (None, None) => Some(Fault::missing("power", "the power is missing", "give `power` or `density`")),
            (Some(_), Some(_)) => {
                Some(Fault::conflict("density", "the power is given, too", "give one of `power` and `density`"))
            }
            _ => None,
        }
    }
}

impl HeatBoundary {
    /// A fault of the table.
    pub fn fault(&self) -> Option<Fault> {
        let Self { temperature, flux, convection, radiation, .. } = self;
        let given = [temperature.is_some(), flux.is_some(), convection.is_some(), radiation.is_some()];
        let message = "needs exactly one of `temperature`, `flux`, `convection`, and `radiation`";
        let help = "give one of them; write a [[heat.boundary]] for each";
        (given.iter().filter(|given| **given).count() != 1).then(|| Fault::conflict("", message, help))
    }
}

impl Material {
    /// Whether bonds of this material expand when they are heated.
    pub fn expands(&self) -> bool {
        self.thermal.as_ref().is_some_and(|thermal| thermal.expansion.si() != 0.0)
    }
}

impl LinearBondTable {
    /// Why bonds with these parameters cannot expand; `None` if they can.
    pub fn fault_of_expansion(&self) -> Option<Fault> {
        let help = "remove the key: bonds are then without force at their length at bonding";
        let message = "bonds that are without force where spheres touch cannot expand";
        (!self.subtract_initial_gap).then(|| Fault::conflict("subtract_initial_gap", message, help))
    }
}

impl Thermal {
    /// Faults of `variation`.
    pub fn faults(&self) -> Vec<Fault> {
        let Some(variation) = &self.variation else { return Vec::new() };
        let temperatures: Vec<f64> = variation.temperature.iter().map(|t| t.si()).collect();
        if temperatures.len() < 2
            || temperatures.windows(2).any(|pair| pair[0] >= pair[1])
            || temperatures.iter().any(|t| *t < 0.0)
        {
            let help = "write at least two temperatures in K, such as [\"300 K\", \"900 K\"]";
            return vec![Fault::range("variation.temperature", "must ascend from 0 K or more", help)];
        }
        let columns = [
            ("variation.specific_heat", &variation.specific_heat),
            ("variation.conductivity", &variation.conductivity),
            ("variation.expansion", &variation.expansion),
            ("variation.stiffness", &variation.stiffness),
            ("variation.strength", &variation.strength),
        ];
        let mut faults = Vec::new();
        if columns.iter().all(|(_, factors)| factors.is_none()) {
            let help = "add `specific_heat`, `conductivity`, `expansion`, `stiffness`, or `strength` with a factor for each \
                        temperature";
            faults.push(Fault::missing("variation", "has no factors", help));
        }
        for (key, factors) in columns {
            let Some(factors) = factors else { continue };
            let of_expansion = key == "variation.expansion";
            if factors.len() != temperatures.len() {
                let message = format!("has {} factors for {} temperatures", factors.len(), temperatures.len());
                faults.push(Fault::conflict(key, message, "write one factor for each temperature"));
            } else if !of_expansion && factors.iter().any(|factor| factor.si() <= 0.0) {
                let help = "write factors on the constant, such as [1, 1.4]";
                faults.push(Fault::range(key, "factors must be positive", help));
            } else if of_expansion && self.expansion.si() == 0.0 {
                let help = "give `expansion`, or remove the key";
                faults.push(Fault::conflict(key, "has no effect: the material does not expand", help));
            }
        }
        faults
    }
}
