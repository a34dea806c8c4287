//! Checks of heat conduction.

use super::Checker;
use super::structure::wording::listing;
use crate::schema::{
    Heat, HeatBoundary, HeatNetwork, HeatPairs, HeatSource, Loading, Material, Packing, ProblemKind, Shape,
};
use concordem_contact::law::linear_bond::LinearBondTable;
use concordem_contact::law::{Factors, LawName};
use concordem_contact::quantity::{Number, Quantity};

impl crate::schema::Scenario {
    /// Names of the faces of the body, by number; a periodic packing has none.
    pub fn heat_faces(&self) -> Vec<&'static str> {
        if self.packing.is_periodic() {
            return Vec::new();
        }
        if let Some(Shape::Cylinder { axis, .. }) = self.packing.shape() {
            let ends =
                [["x minimum", "x maximum"], ["y minimum", "y maximum"], ["z minimum", "z maximum"]][axis.index()];
            return vec![ends[0], ends[1], "side"];
        }
        let faces = ["x minimum", "x maximum", "y minimum", "y maximum", "z minimum", "z maximum"];
        faces[..if self.dimension == 2 { 4 } else { 6 }].to_vec()
    }
}

impl Checker<'_> {
    /// The table `[heat]`, and the thermal constants of the materials.
    pub(super) fn heat(&mut self) {
        let scenario = self.scenario;
        let Some(heat) = &scenario.heat else { return };
        for (at, material) in scenario.materials.iter().enumerate() {
            if material.thermal.is_none() {
                let help = "add `thermal = { specific_heat = \"880 J/kg/K\", conductivity = \"134 W/m/K\" }`";
                let message = "heat conduction needs the thermal constants of every material";
                self.missing(&format!("material[{at}].thermal"), message, help);
            }
        }
        self.thermal_variation();
        self.heat_network(heat);
        for fault in heat.faults(&scenario.materials) {
            self.fault("heat", fault);
        }
        self.heat_contact(heat);
        self.expansion(heat);
        for (at, initial) in heat.initials.iter().enumerate() {
            self.known_set(&format!("heat.initial[{at}].set"), &initial.set);
        }
        for (at, source) in heat.sources.iter().enumerate() {
            self.heat_source(&format!("heat.source[{at}]"), source);
        }
        for (at, boundary) in heat.boundaries.iter().enumerate() {
            self.heat_boundary(&format!("heat.boundary[{at}]"), boundary);
        }
    }

    /// Tables of the thermal constants over the temperature.
    fn thermal_variation(&mut self) {
        for (at, material) in self.scenario.materials.iter().enumerate() {
            let Some(thermal) = &material.thermal else { continue };
            let of_thermal = format!("material[{at}].thermal");
            let faults = thermal.faults();
            let unordered = faults.iter().any(|fault| fault.key == "variation.temperature");
            for fault in faults {
                self.fault(&of_thermal, fault);
            }
            let Some(variation) = thermal.variation.as_ref().filter(|_| !unordered) else { continue };
            for (name, factors) in [("stiffness", &variation.stiffness), ("strength", &variation.strength)] {
                if factors.is_some() {
                    self.softening(&format!("{of_thermal}.variation.{name}"), material, name == "strength");
                }
            }
        }
    }

    /// Factors on the stiffness or the strength of a material: laws that take them, and an effect.
    fn softening(&mut self, key: &str, material: &Material, of_strength: bool) {
        let scenario = self.scenario;
        if scenario.heat.as_ref().is_some_and(|heat| !heat.motion) {
            self.conflict(key, "has no effect: with heat.motion = false nothing moves", "remove one of the two");
            return;
        }
        if let Some(at) = scenario.materials.iter().position(|material| material.deformable.is_some()) {
            let message = format!("not with deformable particles (material[{at}].deformable)");
            self.conflict(key, message, "remove one of the two");
            return;
        }
        let bonds = scenario.bonds.as_ref().map(|bonds| bonds.law);
        let contacts = scenario.contacts.law.law();
        if of_strength && bonds.is_none() {
            self.conflict(key, "has no effect: only bonds have a strength", "add [bonds], or remove the key");
            return;
        }
        if bonds.is_none() && contacts.is_none() {
            let help = "add [bonds], name a law in [contacts], or remove the key";
            self.conflict(key, "has no effect: particles exert no forces", help);
            return;
        }
        for law in bonds.into_iter().chain(contacts.filter(|_| !of_strength)) {
            let Some(table) = material.table_of(law) else { continue };
            let Some(fault) = table.fault_of_variation() else { continue };
            let path = if fault.key.is_empty() { law.key().to_owned() } else { format!("{}.{}", law.key(), fault.key) };
            self.conflict(key, format!("`{path}`: {}", fault.message), fault.help);
        }
        let factors = Factors { strength: Number::new(0.5), ..Factors::default() };
        let fault = bonds.filter(|_| of_strength).and_then(|law| material.fault_of_factors(law, &factors));
        if let Some(fault) = fault {
            self.conflict(key, format!("has no effect: {}", fault.message), fault.help);
        }
    }

    fn heat_network(&mut self, heat: &Heat) {
        let scenario = self.scenario;
        let bonds = heat.pairs == Some(HeatPairs::Bonds);
        if heat.model == HeatNetwork::Power {
            for (key, given) in
                [("heat.pairs", heat.pairs.is_some()), ("heat.contact_ratio", heat.contact_ratio.is_some())]
            {
                if given {
                    let help = "remove the key, or use the model \"ordered\" or \"disordered\"";
                    self.conflict(key, "has no effect: all neighbors in the power diagram exchange heat", help);
                }
            }
            let shape = scenario.packing.shape();
            if matches!(shape, Some(Shape::Mesh { .. } | Shape::Hyperboloid { .. })) {
                let help = "use the model \"disordered\", or a box or a cylinder";
                self.conflict("heat.model", "the power diagram is not available for this shape of the packing", help);
            }
        }
        if heat.model == HeatNetwork::Disordered && scenario.dimension == 2 {
            let help = "use \"power\", or \"ordered\" for a square lattice";
            self.conflict("heat.model", "table 3.1 of Jebahi et al. 2015 holds for spheres, not for discs", help);
        }
        if heat.model == HeatNetwork::Ordered
            && !matches!(scenario.packing, Packing::Lattice { .. } | Packing::Spheres { .. } | Packing::File { .. })
        {
            let help = "use \"power\" or \"disordered\"";
            self.conflict("heat.model", "holds for simple cubic and square lattices, not for random packings", help);
        }
        if bonds && scenario.bonds.is_none() {
            self.conflict("heat.pairs", "there are no bonds", "add [bonds], or use \"contacts\"");
        }
        if bonds && heat.contact_ratio.is_some() {
            let help = "remove the key, or use pairs = \"contacts\"";
            self.conflict("heat.contact_ratio", "has no effect with pairs = \"bonds\"", help);
        }
        let contacts = heat.model == HeatNetwork::Contacts;
        if !bonds && !contacts && !scenario.cuts.is_empty() {
            let help = "use the model \"disordered\" or \"ordered\" with pairs = \"bonds\", which no cut leaves";
            self.conflict("heat.model", "heat would flow across the cuts", help);
        }
        if heat.steady && !heat.initials.is_empty() {
            let help = "remove one of the two";
            self.conflict("heat.steady", "the steady state does not depend on the initial temperatures of sets", help);
        }
        if heat.crack_resistance.is_some() && scenario.bonds.is_none() {
            self.conflict("heat.crack_resistance", "has no effect without bonds", "add [bonds], or remove the key");
        }
        if !heat.motion {
            let help = "remove the key, or write motion = true";
            for (key, given) in [
                ("loading", !matches!(scenario.loading, Loading::None)),
                ("heat.crack_resistance", heat.crack_resistance.is_some()),
                ("heat.dissipation", heat.dissipation),
                ("heat.reference_temperature", heat.reference_temperature.is_some()),
                ("prescribe", !scenario.prescribed.is_empty()),
                ("force", !scenario.forces.is_empty()),
                ("initial", !scenario.initials.is_empty()),
                ("integration.gravity", scenario.integration.gravity.iter().any(|g| g.si() != 0.0)),
                ("stop.unbalanced", scenario.stop.unbalanced.is_some()),
                ("stop.strain", scenario.stop.strain.is_some()),
            ] {
                if given {
                    self.conflict(key, "has no effect: with heat.motion = false nothing moves", help);
                }
            }
        }
    }

    /// Heat through present contacts.
    fn heat_contact(&mut self, heat: &Heat) {
        let scenario = self.scenario;
        let Some(contact) = &heat.contact else { return };
        if let Some(fault) = contact.fault() {
            self.fault("heat.contact", fault);
        }
        if scenario.contacts.law.law().is_none() {
            let help = "name a law in [contacts], or remove the key";
            self.conflict("heat.contact", "has no effect: without a law in [contacts] no particles touch", help);
        }
        if contact.constriction && scenario.dimension == 2 {
            let help = "give `resistance`, or use spheres in a plane with dimension = 3";
            self.conflict("heat.contact.constriction", "holds for spheres, not for discs", help);
        }
        if let (Some(closed), Some(open)) = (contact.resistance, heat.crack_resistance)
            && closed.si() > open.si()
        {
            let message = format!(
                "is {} m^2*K/W, more than heat.crack_resistance, {} m^2*K/W: a crack that closes would conduct less than an open one",
                closed.si(),
                open.si()
            );
            self.conflict("heat.contact.resistance", message, "give the crack the larger resistance");
        }
    }

    /// Thermal expansion: of bonds that have a length at which they are without force.
    fn expansion(&mut self, heat: &Heat) {
        let scenario = self.scenario;
        let Some(at) = scenario.materials.iter().position(Material::expands) else { return };
        let key = format!("material[{at}].thermal.expansion");
        let Some(bonds) = &scenario.bonds else {
            self.conflict(&key, "has no effect: only bonds expand", "add [bonds], or remove the key");
            return;
        };
        if !heat.motion {
            self.conflict(&key, "has no effect: with heat.motion = false nothing moves", "remove one of the two");
        }
        if bonds.law == LawName::LinearBond {
            let materials = scenario.materials.iter().map(|material| material.linear_bond.as_ref()).enumerate();
            let interfaces = scenario.interfaces.iter().map(|interface| interface.linear_bond.as_ref()).enumerate();
            let tables = materials.map(|(at, table)| (format!("material[{at}]"), table));
            for (owner, table) in tables.chain(interfaces.map(|(at, table)| (format!("interface[{at}]"), table))) {
                if let Some(fault) = table.and_then(LinearBondTable::fault_of_expansion) {
                    self.fault(&format!("{owner}.linear_bond"), fault);
                }
            }
        }
    }

    fn heat_source(&mut self, key: &str, source: &HeatSource) {
        match (&source.set, &source.spot) {
            (None, None) => self.missing(&format!("{key}.set"), "nothing is heated", "give `set` or `spot`"),
            (Some(_), Some(_)) => {
                self.conflict(&format!("{key}.spot"), "a set is given, too", "give one of `set` and `spot`");
            }
            (Some(set), None) => self.known_set(&format!("{key}.set"), set),
            (None, Some(_)) => {}
        }
        if let Some(fault) = source.fault() {
            self.fault(key, fault);
        } else if source.density.is_some() && source.spot.is_some() {
            self.conflict(&format!("{key}.density"), "a spot has no volume", "give `power`");
        }
    }

    /// Heat through the contacts with a wall.
    fn heat_wall(&mut self, key: &str, wall: &str, boundary: &HeatBoundary) {
        let scenario = self.scenario;
        let names = scenario.wall_names();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        self.known(&format!("{key}.wall"), "wall", wall, &names);
        for (other, given) in [("face", boundary.face.is_some()), ("set", boundary.set.is_some())] {
            if given {
                let message = "not with `wall`, whose heat flows into the particles that touch it";
                self.conflict(&format!("{key}.{other}"), message, "remove one of the two");
            }
        }
        for (other, given) in [("flux", boundary.flux.is_some()), ("radiation", boundary.radiation.is_some())] {
            if given {
                let help = "give `temperature`, or `convection` with the coefficient of the contact";
                self.conflict(&format!("{key}.{other}"), "not with `wall`: contacts conduct", help);
            }
        }
        if scenario.contacts.law.law().is_none() {
            let help = "name a law in [contacts], or use `face`";
            self.conflict(
                &format!("{key}.wall"),
                "has no effect: without a law in [contacts] no particle touches a wall",
                help,
            );
        }
    }

    fn heat_boundary(&mut self, key: &str, boundary: &HeatBoundary) {
        let scenario = self.scenario;
        if let Some(set) = &boundary.set {
            self.known_set(&format!("{key}.set"), set);
        }
        if let Some(fault) = boundary.fault() {
            self.fault(key, fault);
        }
        if let Some(wall) = &boundary.wall {
            self.heat_wall(key, wall, boundary);
        }
        let faces = scenario.heat_faces();
        let on_particles = boundary.set.is_some() && boundary.face.is_none() && boundary.temperature.is_some();
        if scenario.heat.as_ref().is_some_and(|heat| heat.model == HeatNetwork::Contacts) {
            if !on_particles && boundary.wall.is_none() {
                let help = "give `set` with `temperature`, or `wall`";
                self.conflict(key, "with the model \"contacts\", the body has no surface", help);
            }
        } else if faces.is_empty() && !on_particles && boundary.wall.is_none() {
            let help = "give `set` with `temperature`, or use a packing that is not periodic";
            self.conflict(key, "a periodic packing has no surface", help);
        } else if let Some(face) = &boundary.face
            && face != "all"
            && !faces.contains(&&face[..])
        {
            let quoted: Vec<String> = faces.iter().map(|name| format!("\"{name}\"")).collect();
            let help = format!("choose \"all\", {}", listing(&quoted));
            self.add(ProblemKind::UnknownName, &format!("{key}.face"), "the body has no such face", help);
        }
        if boundary.temperature.map(Quantity::si) == Some(0.0) && boundary.history.is_some() {
            let help = "give a temperature that the history multiplies";
            self.conflict(&format!("{key}.history"), "multiplies a temperature of zero", help);
        }
    }
}
