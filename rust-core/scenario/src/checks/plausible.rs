//! Warnings about numbers that are valid but probably have the wrong unit: a density of 4.8, a radius of 1 m, a modulus of 25 Pa,
//! an angle of friction instead of its tangent.

use super::{Checker, length};
use toml::de::DeValue;

/// Densities of solids (kg/m³): from aerogel to osmium.
const DENSITIES: [f64; 2] = [50.0, 25e3];
/// A radius given as a plain number of at least this size, m, may be meant in millimeters.
const LARGE_RADIUS: f64 = 0.2;
/// A modulus below this, Pa, is softer than gelatin.
const SOFT: f64 = 1e3;
/// Tangents of friction angles that are probably angles in degrees. Larger ones keep contacts from slipping on purpose.
const DEGREES: std::ops::Range<f64> = 10.0..90.0;
/// Brittle materials crack at strains far below this.
const LARGE_ONSET: f64 = 0.01;

impl Checker<'_> {
    /// Warns about implausible numbers.
    pub(super) fn implausible(&mut self) {
        self.densities();
        self.moduli();
        self.frictions();
        self.onsets();
        for key in ["packing.radius", "packing.radii.minimum", "packing.radii.median"] {
            // A number with a unit is meant as written.
            if let Some(radius) = self.plain_number(key)
                && radius >= LARGE_RADIUS
            {
                let message = format!("a radius of {}; plain numbers are meters", length(radius));
                let help = format!("write \"{radius} mm\", or \"{radius} m\" if meters are meant");
                self.warn(key, message, help);
                return;
            }
        }
    }

    /// The number at a key, if it is given without a unit.
    fn plain_number(&self, key: &str) -> Option<f64> {
        self.document.locate(key).1?.replace('_', "").parse().ok()
    }

    fn densities(&mut self) {
        let scenario = self.scenario;
        for (at, material) in scenario.materials.iter().enumerate() {
            let (key, density) = (format!("material[{at}].density"), material.density.si());
            let likely = |factor: f64| (500.0..=DENSITIES[1]).contains(&(density * factor));
            let help = "write kg/m^3, such as 2500, or a string with a unit: \"2.5 g/cm^3\"";
            if density < DENSITIES[0] {
                let help = if likely(1e3) {
                    format!("write {}, or \"{density} g/cm^3\"; plain numbers are kg/m^3", density * 1e3)
                } else {
                    help.to_owned()
                };
                self.warn(&key, format!("{density} kg/m^3 is less than any solid has"), help);
            } else if density > DENSITIES[1] {
                self.warn(&key, format!("{density} kg/m^3 is more than any solid has"), help);
            }
        }
    }

    /// The plain numbers of a key in the tables of all laws, with their key paths.
    fn of_laws(&self, key: &str) -> Vec<(String, f64)> {
        let mut found = Vec::new();
        for at in 0..self.scenario.materials.len() {
            let Some(tables) = self.document.root.get_ref().get("material") else { break };
            let Some(material) = tables.get_ref().as_array().and_then(|array| array.get(at)) else { continue };
            for (law, table) in material.get_ref().as_table().into_iter().flatten() {
                if let DeValue::Table(_) = table.get_ref() {
                    let path = format!("material[{at}].{}.{key}", law.get_ref());
                    found.extend(self.plain_number(&path).map(|number| (path, number)));
                }
            }
        }
        found
    }

    fn moduli(&mut self) {
        for (key, young) in self.of_laws("young") {
            if (1.0..SOFT).contains(&young) {
                let help =
                    format!("write \"{young} GPa\", or \"{young} Pa\" if pascals are meant; plain numbers are Pa");
                self.warn(&key, format!("{young} Pa is softer than any solid"), help);
            }
        }
    }

    fn frictions(&mut self) {
        for (key, friction) in self.of_laws("friction_coefficient") {
            if DEGREES.contains(&friction) {
                let tangent = friction.to_radians().tan();
                let help = format!("write the tangent of the angle: {tangent:.2} for {friction} degrees");
                self.warn(&key, "is the tangent of the friction angle; no solid is so rough", help);
            }
        }
    }

    fn onsets(&mut self) {
        for (key, strain) in self.of_laws("crack_onset_strain") {
            // From 1 on, no bond is meant to break.
            if (LARGE_ONSET..1.0).contains(&strain) {
                let help = "write the strain itself, such as 1e-4 for 0.1 per mille";
                self.warn(&key, format!("a brittle material breaks long before a strain of {strain}"), help);
            }
        }
    }
}
