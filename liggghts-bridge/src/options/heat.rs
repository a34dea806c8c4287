//! Heat conduction: the file of `heat FILE`, which has the table `[heat]` of a scenario, and the thermal constants of the materials.
//!
//! Sets of a scenario are groups of the host here. What needs more than an atom and its neighbors is rejected.

use std::fmt::Write as _;

use concordem_contact::heat::{
    Convection, Heat, HeatBoundary, HeatContact, HeatInitial, HeatNetwork, HeatPairs, HeatScheme, HeatSource, Radiation,
};
use concordem_contact::law::LawName;
use concordem_contact::material::{Material, Thermal, ThermalVariation};
use concordem_contact::quantity::Quantity;
use concordem_solver::heat::{MaterialCurves, ThermalMaterial};
use serde::Deserialize;
use toml::de::{DeTable, DeValue};

use super::OptionError;
use crate::heat_network::HeatNetworkFile;

/// Heat conduction as given by the user.
#[derive(Debug, Clone)]
pub struct HeatTables {
    /// The table `[heat]`.
    pub heat: Heat,
    /// Heat capacities and areas from a file; `None`: those of a lattice, or of grains.
    pub network: Option<HeatNetworkFile>,
    /// Names of the groups that the table names as sets, without duplicates.
    pub groups: Vec<String>,
    /// Thermal constants by atom type.
    pub materials: Vec<ThermalMaterial>,
    /// How they vary with the temperature, by atom type.
    pub curves: Vec<MaterialCurves>,
    /// Density that the volumes refer to, by atom type, kg/m³; `None`: heat capacities follow from the masses.
    pub bulk_density: Vec<Option<f64>>,
}

/// The file of `heat FILE`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct HeatFile {
    heat: Heat,
}

/// A step on the way to a key of a file.
#[derive(Clone, Copy)]
enum Step {
    Key(&'static str),
    At(usize),
}

/// A file whose keys are rejected with their lines.
struct Place<'a> {
    file: &'a str,
    text: &'a str,
}

impl Place<'_> {
    /// Reject the key at the end of `path`; its line and value are those of the file.
    fn refuse(&self, path: &[Step], message: &str, remedy: &str) -> OptionError {
        let mut key = String::new();
        for step in path {
            match step {
                Step::Key(name) if key.is_empty() => key.push_str(name),
                Step::Key(name) => key.extend([".", name]),
                Step::At(at) => {
                    let _ = write!(key, "[{at}]");
                }
            }
        }
        let found = DeTable::parse(self.text).ok().and_then(|table| {
            let mut value = DeValue::Table(table.into_inner());
            let mut span = None;
            for step in path {
                let next = match step {
                    Step::Key(name) => value.get(*name)?.clone(),
                    Step::At(at) => value.get(*at)?.clone(),
                };
                span = Some(next.span());
                value = next.into_inner();
            }
            span
        });
        let line = found.as_ref().map(|span| self.text[..span.start].matches('\n').count() + 1);
        // Tables need no value in the message.
        if let Some(value) = found.and_then(|span| self.text.get(span)).filter(|value| !value.contains('\n')) {
            key = format!("`{key} = {value}`");
        } else {
            key = format!("`{key}`");
        }
        let (file, message, remedy) = (self.file.to_owned(), message.to_owned(), remedy.to_owned());
        OptionError::Heat { file, line, key, message, remedy }
    }
}

const OWN_SOLVER: &str = "remove the key, or use ConcorDEM's own solver";

impl HeatTables {
    /// Read the files; `None` without `heat FILE`. `[contacts, deforms]`: whether there is a contact law, and whether particles deform.
    pub(super) fn read(
        file: Option<&str>,
        network: Option<&str>,
        materials: &[Material],
        [contacts, deforms]: [bool; 2],
        law: Option<LawName>,
    ) -> Result<Option<Self>, OptionError> {
        let Some(file) = file else {
            if let Some(material) = materials.iter().find(|material| material.thermal.is_some()) {
                return Err(OptionError::NoHeat { of: material.name.clone() });
            }
            return match network {
                Some(_) => Err(OptionError::Missing { key: "heat_network".into(), wanted: "`heat FILE` beside it" }),
                None => Ok(None),
            };
        };
        let text = std::fs::read_to_string(file)
            .map_err(|error| OptionError::File { path: file.to_owned(), message: error.to_string() })?;
        let HeatFile { heat } = toml::from_str(&text)
            .map_err(|error| OptionError::Parameters { place: file.to_owned(), message: error.to_string() })?;
        let place = Place { file, text: &text };
        let network = network.map(HeatNetworkFile::read).transpose()?;
        check_heat(&place, &heat, network.as_ref(), contacts, law)?;
        if deforms {
            let message = "not with `deformable`";
            return Err(place.refuse(
                &[Step::Key("heat")],
                message,
                "remove `deformable`, or use ConcorDEM's own solver",
            ));
        }
        let groups = groups(&place, &heat)?;
        for material in materials {
            check_thermal(material, network.is_some())?;
        }
        let expands = materials.iter().any(|m| m.thermal.as_ref().is_some_and(|t| t.expansion.si() != 0.0));
        if expands && law.is_none() {
            let message = "has no effect: only bonds expand, and the law is `none`";
            return Err(of_material(
                &materials[0].name,
                "thermal.expansion",
                message,
                "remove it, or choose a bond law",
            ));
        }
        Ok(Some(Self {
            groups,
            materials: materials.iter().map(ThermalMaterial::of).collect(),
            curves: materials.iter().map(MaterialCurves::of).collect(),
            bulk_density: materials
                .iter()
                .map(|material| material.thermal.as_ref()?.bulk_density.map(Quantity::si))
                .collect(),
            network,
            heat,
        }))
    }

    /// Number of a group that the table names.
    pub fn group(&self, name: &str) -> usize {
        self.groups.iter().position(|group| group == name).expect("all names are in the list")
    }
}

/// Whether a number is positive; NaN is not.
fn positive(number: f64) -> bool {
    number > 0.0
}

/// Whether a number is zero or positive; NaN is not.
fn not_negative(number: f64) -> bool {
    number >= 0.0
}

/// Reject a constant of a material.
fn of_material(name: &str, key: &str, message: &str, remedy: &str) -> OptionError {
    let key = format!("`{key}`");
    let (file, message, remedy) = (format!("material `{name}`"), message.to_owned(), remedy.to_owned());
    OptionError::Heat { file, line: None, key, message, remedy }
}

/// The keys of `[heat]` that work here, in their ranges.
fn check_heat(
    place: &Place<'_>,
    heat: &Heat,
    network: Option<&HeatNetworkFile>,
    contacts: bool,
    law: Option<LawName>,
) -> Result<(), OptionError> {
    // All keys, so that a new one is not ignored.
    let Heat {
        model,
        pairs: _, // check_model
        contact_ratio,
        temperature,
        reference_temperature,
        steady,
        scheme,
        time_factor,
        motion,
        dissipation,
        crack_resistance,
        contact,
        initials,
        sources,
        boundaries,
    } = heat;
    let refuse = |key: &'static str, message: &str, remedy: &str| {
        Err(place.refuse(&[Step::Key("heat"), Step::Key(key)], message, remedy))
    };
    if *steady {
        return refuse(
            "steady",
            "the steady state needs all processors at once",
            "give the temperatures as `initial`, or use ConcorDEM's own solver",
        );
    }
    if *scheme == HeatScheme::Implicit {
        return refuse(
            "scheme",
            "implicit steps need all processors at once",
            "remove the key: steps are then explicit",
        );
    }
    if !motion {
        return refuse("motion", "the host moves the atoms", "remove the key; without `fix nve` atoms rest");
    }
    if *dissipation {
        return refuse("dissipation", "heat of dissipation is not available here", OWN_SOLVER);
    }
    if crack_resistance.is_some() {
        return refuse("crack_resistance", "here, cracks insulate", "remove the key, or use ConcorDEM's own solver");
    }
    if contact_ratio.is_some() {
        return refuse("contact_ratio", "here, heat flows along bonds", "remove the key");
    }
    if !(time_factor.si() > 0.0 && time_factor.si().is_finite()) {
        return refuse("time_factor", "must be positive", "give a positive number");
    }
    for (key, given) in [("temperature", Some(*temperature)), ("reference_temperature", *reference_temperature)] {
        if given.is_some_and(|t| !not_negative(t.si())) {
            return refuse(key, "must be at least 0 K", "give an absolute temperature");
        }
    }
    check_model(place, heat, network, law)?;
    check_contact(place, contact.as_ref(), contacts)?;
    for (at, initial) in initials.iter().enumerate() {
        let HeatInitial { set: _, temperature } = initial;
        if !not_negative(temperature.si()) {
            let path = [Step::Key("heat"), Step::Key("initial"), Step::At(at), Step::Key("temperature")];
            return Err(place.refuse(&path, "must be at least 0 K", "give an absolute temperature"));
        }
    }
    for (at, source) in sources.iter().enumerate() {
        check_source(place, at, source)?;
    }
    for (at, boundary) in boundaries.iter().enumerate() {
        check_boundary(place, at, boundary, *model == HeatNetwork::Contacts)?;
    }
    Ok(())
}

/// The network: what conducts along bonds.
fn check_model(
    place: &Place<'_>,
    heat: &Heat,
    network: Option<&HeatNetworkFile>,
    law: Option<LawName>,
) -> Result<(), OptionError> {
    let Heat { model, pairs, contact, .. } = heat;
    let refuse = |key: &'static str, message: &str, remedy: &str| {
        Err(place.refuse(&[Step::Key("heat"), Step::Key(key)], message, remedy))
    };
    if let Some(file) = network {
        if file.model != *model {
            let message = format!("the file of `heat_network` has the model {}", file.name());
            return refuse("model", &message, "give the same model");
        }
    } else if matches!(model, HeatNetwork::Power | HeatNetwork::Disordered) {
        let remedy = "give heat capacities and areas with `heat_network FILE`, as `concordem export --format heat-network` writes them; or \
                      choose \"ordered\" with pairs = \"bonds\", or \"contacts\"";
        return refuse("model", "the areas depend on more than the two atoms of a bond (default: \"power\")", remedy);
    }
    let grains = *model == HeatNetwork::Contacts;
    if grains && pairs.is_some() {
        return refuse("pairs", "has no effect with the model \"contacts\"", "remove the key");
    }
    if !grains && *model != HeatNetwork::Power && *pairs != Some(HeatPairs::Bonds) {
        return refuse("pairs", "here, heat flows along bonds (default: \"contacts\")", "give pairs = \"bonds\"");
    }
    if grains && contact.is_none() {
        return refuse(
            "contact",
            "the model \"contacts\" needs to know how contacts conduct",
            "add `contact = { resistance = 0 }` or `contact = { constriction = true }`",
        );
    }
    if !grains && law.is_none() {
        return refuse("model", "there are no bonds along which heat could flow", "choose \"contacts\", or a bond law");
    }
    Ok(())
}

/// Heat between atoms that touch.
fn check_contact(place: &Place<'_>, contact: Option<&HeatContact>, contacts: bool) -> Result<(), OptionError> {
    let refuse =
        |message: &str, remedy: &str| Err(place.refuse(&[Step::Key("heat"), Step::Key("contact")], message, remedy));
    if let Some(HeatContact { resistance, constriction }) = contact {
        if resistance.is_some() == *constriction {
            return refuse("needs exactly one of `resistance` and `constriction = true`", "give one of them");
        }
        if resistance.is_some_and(|r| !not_negative(r.si())) {
            return refuse("the resistance must be at least 0", "give a resistance of 0 or more");
        }
        if !contacts {
            return refuse(
                "has no effect: without a contact law no atoms touch",
                "add `contact LAW`, or remove the key",
            );
        }
    }
    Ok(())
}

fn check_source(place: &Place<'_>, at: usize, source: &HeatSource) -> Result<(), OptionError> {
    let HeatSource { set, spot, power, density, history } = source;
    let refuse = |key: &'static str, message: &str, remedy: &str| {
        Err(place.refuse(&[Step::Key("heat"), Step::Key("source"), Step::At(at), Step::Key(key)], message, remedy))
    };
    if spot.is_some() {
        return refuse("spot", "spots need all processors at once", "give `set` with the name of a group");
    }
    if history.is_some() {
        return refuse(
            "history",
            "there are no histories here",
            "remove the key; change the source between runs with another `heat FILE`",
        );
    }
    if set.is_none() {
        return refuse("set", "nothing is heated", "give `set` with the name of a group");
    }
    if power.is_some() == density.is_some() {
        return refuse("power", "needs exactly one of `power` and `density`", "give one of them");
    }
    Ok(())
}

fn check_boundary(place: &Place<'_>, at: usize, boundary: &HeatBoundary, grains: bool) -> Result<(), OptionError> {
    let HeatBoundary { face, set, wall, temperature, flux, convection, radiation, history } = boundary;
    let refuse = |key: &'static str, message: &str, remedy: &str| {
        Err(place.refuse(&[Step::Key("heat"), Step::Key("boundary"), Step::At(at), Step::Key(key)], message, remedy))
    };
    if face.is_some() {
        return refuse(
            "face",
            "the body has no faces here",
            "give `set` with the name of a group: each of its atoms has a face of 4 R^2",
        );
    }
    if wall.is_some() {
        return refuse(
            "wall",
            "walls exchange no heat here",
            "remove the table, or give `set` with the name of a group",
        );
    }
    if history.is_some() {
        return refuse(
            "history",
            "there are no histories here",
            "remove the key; change the boundary between runs with another `heat FILE`",
        );
    }
    if set.is_none() {
        return refuse("set", "the group is missing", "give `set` with the name of a group");
    }
    let given = [temperature.is_some(), flux.is_some(), convection.is_some(), radiation.is_some()];
    if given.iter().filter(|given| **given).count() != 1 {
        return refuse(
            "temperature",
            "needs exactly one of `temperature`, `flux`, `convection`, and `radiation`",
            "give one of them",
        );
    }
    if grains && temperature.is_none() {
        return refuse(
            "set",
            "with the model \"contacts\", atoms have no surface",
            "give `temperature`, or another model",
        );
    }
    if temperature.is_some_and(|t| !not_negative(t.si())) {
        return refuse("temperature", "must be at least 0 K", "give an absolute temperature");
    }
    if convection
        .as_ref()
        .is_some_and(|Convection { coefficient, ambient }| !(coefficient.si() > 0.0 && ambient.si() >= 0.0))
    {
        return refuse(
            "convection",
            "needs a positive coefficient, and an ambient temperature of at least 0 K",
            "change them",
        );
    }
    let possible = |Radiation { emissivity, ambient }: &Radiation| {
        emissivity.si() > 0.0 && emissivity.si() <= 1.0 && ambient.si() >= 0.0
    };
    if radiation.as_ref().is_some_and(|radiation| !possible(radiation)) {
        return refuse(
            "radiation",
            "needs an emissivity above 0 and at most 1, and an ambient temperature of at least 0 K",
            "change them",
        );
    }
    Ok(())
}

/// The thermal constants of a material, in their ranges.
fn check_thermal(material: &Material, has_network: bool) -> Result<(), OptionError> {
    let refuse = |key: &str, message: &str, remedy: &str| Err(of_material(&material.name, key, message, remedy));
    let Some(thermal) = &material.thermal else {
        return refuse(
            "thermal",
            "heat conduction needs the thermal constants of every material",
            "add `thermal.specific_heat VALUE thermal.conductivity VALUE`, or [material.thermal] in the materials file",
        );
    };
    let Thermal { specific_heat, conductivity, expansion: _, bulk_density, variation } = thermal;
    if !positive(specific_heat.si()) {
        return refuse("thermal.specific_heat", "must be positive", "give a positive heat capacity, J/(kg K)");
    }
    if !not_negative(conductivity.si()) {
        return refuse("thermal.conductivity", "must not be negative", "give 0 or more, W/(m K)");
    }
    if has_network && bulk_density.is_some() {
        return refuse("thermal.bulk_density", "has no effect: `heat_network` gives the heat capacities", "remove it");
    }
    if bulk_density.is_some_and(|density| !positive(density.si())) {
        return refuse("thermal.bulk_density", "must be positive", "give a positive density, or remove it");
    }
    let Some(variation) = variation else { return Ok(()) };
    let ThermalVariation { temperature, specific_heat, conductivity, expansion, stiffness, strength } = variation;
    for (key, given) in [("stiffness", stiffness), ("strength", strength)] {
        if given.is_some() {
            return refuse(&format!("thermal.variation.{key}"), "is not available here", OWN_SOLVER);
        }
    }
    let ascend = temperature.windows(2).all(|pair| pair[0].si() < pair[1].si());
    if temperature.len() < 2 || !ascend || !temperature.iter().all(|t| t.si() >= 0.0) {
        return refuse(
            "thermal.variation.temperature",
            "must ascend from 0 K or more",
            "give at least two temperatures",
        );
    }
    let columns = [("specific_heat", specific_heat), ("conductivity", conductivity), ("expansion", expansion)];
    for (key, factors) in columns {
        let Some(factors) = factors else { continue };
        let positive = key == "expansion" || factors.iter().all(|factor| factor.si() > 0.0);
        if factors.len() != temperature.len() || !positive {
            return refuse(
                &format!("thermal.variation.{key}"),
                "needs one positive factor for each temperature",
                "write factors on the constant, such as [1, 1.4]",
            );
        }
    }
    Ok(())
}

/// Names of the groups, without duplicates.
fn groups(place: &Place<'_>, heat: &Heat) -> Result<Vec<String>, OptionError> {
    let initials = heat.initials.iter().map(|one| Some(&one.set));
    let sources = heat.sources.iter().map(|one| one.set.as_ref());
    let boundaries = heat.boundaries.iter().map(|one| one.set.as_ref());
    let mut names: Vec<String> = Vec::new();
    for name in initials.chain(sources).chain(boundaries).flatten() {
        if name.is_empty() || name.contains('\0') {
            return Err(place.refuse(&[Step::Key("heat")], "a `set` has no name", "give the name of a group"));
        }
        if !names.contains(name) {
            names.push(name.clone());
        }
    }
    Ok(names)
}
