//! Warnings about numbers that are valid but probably have the wrong unit or sign: a density of 4.8, a radius of 1 m, a modulus of
//! 25 Pa, an angle of friction instead of its tangent, a lateral tension beside compression.

use super::{Checker, length};
use crate::schema::quantity::{Component, Stress};
use crate::schema::{LawName, Loading};
use concordem_contact::law::cpm::YieldSurface;
use concordem_contact::quantity::Quantity;
use toml::de::DeValue;

/// Densities of solids (kg/m³): from aerogel to osmium.
const DENSITIES: [f64; 2] = [50.0, 25e3];
/// A radius given as a plain number of at least this size, m, may be meant in millimeters.
const LARGE_RADIUS: f64 = 0.2;
/// A modulus below this, Pa, is softer than gelatin.
const SOFT: f64 = 1e3;
/// A modulus of the concrete model below this, Pa, is softer than any concrete, mortar, or rock.
const SOFT_CONCRETE: f64 = 1e9;
/// Tangents of friction angles that are probably angles in degrees. Larger ones keep contacts from slipping on purpose.
const DEGREES: std::ops::Range<f64> = 10.0..90.0;
/// Concrete has no strength at larger strains.
const LARGE_STRAIN: f64 = 0.1;
/// Brittle materials crack at strains far below this.
const LARGE_ONSET: f64 = 0.01;
/// A bond that breaks at a smaller strain has no strength.
const NO_STRENGTH: f64 = 1e-8;
/// Beams are hardly thicker than their particles.
const THICK_BEAM: f64 = 2.0;
/// Strengths with a smaller Weibull modulus, or a larger variation, differ by orders of magnitude.
const WIDEST_SCATTER: [f64; 2] = [0.5, 2.0];
/// From this onset on, no bond is meant to break: a model of elasticity, not of concrete.
const NO_CRACKS: f64 = 1.0;

impl Checker<'_> {
    /// Warns about implausible numbers.
    pub(super) fn implausible(&mut self) {
        self.densities();
        self.moduli();
        self.frictions();
        self.onsets();
        self.strengths();
        self.beams();
        self.scatters();
        self.lateral_tension();
        self.large_strain();
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

    /// The stress at a key, Pa, with or without a unit.
    fn stress(&self, key: &str) -> Option<f64> {
        let with_unit = || {
            let text = self.document.locate(key).1?;
            Stress::parse(text.trim_matches(['"', '\''])).ok().map(Quantity::si)
        };
        self.plain_number(key).or_else(with_unit)
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

    /// The tables of all laws, with their key paths.
    fn tables_of_laws(&self) -> Vec<(String, String)> {
        let mut found = Vec::new();
        for at in 0..self.scenario.materials.len() {
            let Some(tables) = self.document.root.get_ref().get("material") else { break };
            let Some(material) = tables.get_ref().as_array().and_then(|array| array.get(at)) else { continue };
            for (law, table) in material.get_ref().as_table().into_iter().flatten() {
                if let DeValue::Table(_) = table.get_ref() {
                    found.push((law.get_ref().to_string(), format!("material[{at}].{}", law.get_ref())));
                }
            }
        }
        found
    }

    /// The plain numbers of a key in the tables of all laws, with their key paths.
    fn of_laws(&self, key: &str) -> Vec<(String, f64)> {
        let paths = self.tables_of_laws().into_iter().map(|(_, path)| format!("{path}.{key}"));
        paths.filter_map(|path| self.plain_number(&path).map(|number| (path, number))).collect()
    }

    fn never_cracks(&self, path: &str) -> bool {
        self.plain_number(&format!("{path}.crack_onset_strain")).is_some_and(|strain| strain >= NO_CRACKS)
    }

    fn moduli(&mut self) {
        for (law, path) in self.tables_of_laws() {
            let key = format!("{path}.young");
            let plain = self.plain_number(&key);
            let Some(young) = self.stress(&key) else { continue };
            let concrete = law == "cpm" && young < SOFT_CONCRETE && !self.never_cracks(&path);
            if young < SOFT && plain.is_some() {
                let help =
                    format!("write \"{young} GPa\", or \"{young} Pa\" if pascals are meant; plain numbers are Pa");
                self.warn(&key, format!("{young} Pa is softer than any solid"), help);
            } else if concrete {
                let message = format!("{} is softer than any concrete, mortar, or rock", stress(young));
                self.warn(&key, message, "check the unit: concrete has some \"25 GPa\"");
            } else if young < SOFT {
                let message = format!("{young} Pa is softer than any solid");
                self.warn(&key, message, "check the unit: concrete has some \"25 GPa\", rubber some \"5 MPa\"");
            }
        }
    }

    /// Warns about strengths, given as plain numbers, that are nothing beside the modulus.
    fn strengths(&mut self) {
        for (_, path) in self.tables_of_laws() {
            let Some(young) = self.stress(&format!("{path}.young")) else { continue };
            for key in ["tensile_strength", "cohesion", "hydrostatic_strength"] {
                let key = format!("{path}.{key}");
                let Some(strength) =
                    self.plain_number(&key).filter(|given| *given > 0.0 && *given < NO_STRENGTH * young)
                else {
                    continue;
                };
                let message = format!("{strength} Pa is reached at a strain of {:.0e}", strength / young);
                let help = format!(
                    "write \"{strength} MPa\", or \"{strength} Pa\" if pascals are meant; plain numbers are Pa"
                );
                self.warn(&key, message, help);
            }
        }
    }

    /// Warns about beams thicker than particles, and about the shear strength of beams without shear.
    fn beams(&mut self) {
        for (key, ratio) in self.of_laws("radius_ratio") {
            if ratio > THICK_BEAM {
                let help = "it is the radius of the beam over that of the particles, such as 0.8";
                self.warn(&key, format!("the beams are {ratio} times as thick as the particles"), help);
            }
        }
        for (_, path) in self.tables_of_laws() {
            let text = |key: &str| self.document.locate(&format!("{path}.{key}")).1;
            if text("model").is_some_and(|model| model.trim_matches(['"', '\'']) == "spring")
                && text("cohesion").is_some()
            {
                let help = "choose another model, such as \"timoshenko\", or remove `cohesion`";
                self.warn(&format!("{path}.cohesion"), "beams of the model \"spring\" bear no shear", help);
            }
        }
    }

    /// Warns about strengths that differ by orders of magnitude.
    fn scatters(&mut self) {
        let [modulus, variation] = WIDEST_SCATTER;
        for (at, material) in self.scenario.materials.iter().enumerate() {
            let Some(scatter) = &material.strength_scatter else { continue };
            let path = format!("material[{at}].strength_scatter");
            let message = "the strengths of bonds differ by orders of magnitude";
            if scatter.weibull_modulus.is_some_and(|given| given.si() < modulus) {
                let help = "brittle materials have a modulus of some 3 to 20";
                self.warn(&format!("{path}.weibull_modulus"), message, help);
            }
            if scatter.log_normal_variation.is_some_and(|given| given.si() > variation) {
                let help = "it is the standard deviation over the mean, such as 0.2";
                self.warn(&format!("{path}.log_normal_variation"), message, help);
            }
        }
    }

    /// Warns about a run of concrete that ends at a strain at which concrete is rubble.
    fn large_strain(&mut self) {
        let scenario = self.scenario;
        let is_concrete = scenario.bonds.as_ref().is_some_and(|bonds| bonds.law == LawName::Cpm);
        if let Some(strain) = self.plain_number("stop.strain").filter(|_| is_concrete)
            && strain.abs() > LARGE_STRAIN
        {
            let message =
                format!("is {} %; concrete breaks at 0.01 % in tension and at 0.2 % in compression", strain * 100.0);
            let help = format!("write \"{strain} %\" if percent are meant, or the strain itself, such as 1e-3");
            self.warn("stop.strain", message, help);
        }
    }

    /// Warns about an axis that is pulled, although another one is compressed, or although nothing holds the particles together.
    fn lateral_tension(&mut self) {
        let scenario = self.scenario;
        let Loading::CellStress { stress: target, strain_rate, .. } = &scenario.loading else { return };
        let compressed = strain_rate.iter().any(|rate| rate.si().is_some_and(|rate| rate < 0.0));
        let loose = scenario.bonds.is_none();
        for axis in (0..3).filter(|&axis| strain_rate[axis] == Component::Free) {
            let value = target[axis][axis].si();
            if value > 0.0 && (compressed || loose) {
                let message = format!(
                    "pulls along {}, because tension is positive, although {}",
                    ["x", "y", "z"][axis],
                    if loose { "no bonds hold the particles together" } else { "another axis is compressed" }
                );
                let help = format!("write \"-{}\" for a pressure", stress(value));
                self.warn(&format!("loading.stress[{axis}][{axis}]"), message, help);
            }
        }
    }

    fn frictions(&mut self) {
        // The slope of a logarithmic surface at no pressure is not the friction beyond.
        let surfaces = self.scenario.materials.iter().map(|material| material.cpm.as_ref()?.yield_surface);
        let logarithmic: Vec<String> = (surfaces.enumerate())
            .filter(|(_, surface)| matches!(surface, Some(YieldSurface::Logarithmic | YieldSurface::LogarithmicLinear)))
            .map(|(k, _)| format!("material[{k}].cpm.friction_coefficient"))
            .collect();
        for (key, friction) in self.of_laws("friction_coefficient") {
            if DEGREES.contains(&friction) && !logarithmic.contains(&key) {
                let tangent = friction.to_radians().tan();
                let help = format!("write the tangent of the angle: {tangent:.2} for {friction} degrees");
                self.warn(&key, "is the tangent of the friction angle; no solid is so rough", help);
            }
        }
    }

    fn onsets(&mut self) {
        for (key, strain) in self.of_laws("crack_onset_strain") {
            if (LARGE_ONSET..NO_CRACKS).contains(&strain) {
                let help = "write the strain itself, such as 1e-4 for 0.1 per mille";
                self.warn(&key, format!("a brittle material breaks long before a strain of {strain}"), help);
            }
        }
    }
}

/// A stress for messages, in Pa, kPa, MPa, or GPa.
fn stress(pascals: f64) -> String {
    let units = [(1e9, "GPa"), (1e6, "MPa"), (1e3, "kPa")];
    let (scale, unit) = units.into_iter().find(|(scale, _)| pascals >= *scale).unwrap_or((1.0, "Pa"));
    // Rounding of the division by the scale.
    format!("{} {unit}", (pascals / scale * 1e9).round() / 1e9)
}
