//! Heat conduction: the file of `heat FILE`, which has the table `[heat]` of a scenario, and the thermal constants of the materials.
//!
//! Sets of a scenario are groups of the host here. What needs more than an atom and its neighbors is rejected.

use concordem_contact::heat::{Heat, HeatBoundary, HeatContact, HeatNetwork, HeatPairs, HeatScheme, HeatSource};
use concordem_contact::law::{Fault, LawName};
use concordem_contact::material::Material;
use concordem_contact::quantity::Quantity;
use concordem_contact::ranges;
use concordem_solver::heat::{MaterialCurves, ThermalMaterial};
use serde::Deserialize;
use toml::de::{DeTable, DeValue};

use super::OptionError;

/// Heat conduction as given by the user.
#[derive(Debug, Clone)]
pub struct HeatTables {
    /// The table `[heat]`.
    pub heat: Heat,
    /// File with heat capacities and areas; `None`: those of a lattice, or of grains.
    pub network: Option<String>,
    /// Names of the groups that the table names as sets, without duplicates.
    pub groups: Vec<String>,
    /// Thermal constants by atom type.
    pub materials: Vec<ThermalMaterial>,
    /// How they vary with the temperature, by atom type.
    pub curves: Vec<MaterialCurves>,
    /// Density that the volumes refer to, by atom type, kg/m³; `None`: heat capacities follow from the masses.
    pub bulk_density: Vec<Option<f64>>,
    /// Name and text of `heat FILE`, for messages.
    file: String,
    text: String,
}

/// The file of `heat FILE`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct HeatFile {
    heat: Heat,
}

/// What the host computes beside heat conduction.
pub(super) struct Beside {
    /// Law of the bonds.
    pub bond_law: Option<LawName>,
    /// Whether there is a contact law.
    pub contacts: bool,
    /// Whether particles deform.
    pub deforms: bool,
}

/// A file whose keys are rejected with their lines.
struct Place<'a> {
    file: &'a str,
    text: &'a str,
}

impl Place<'_> {
    /// Reject the key `heat.KEY`, such as `source[0].power`; its line and value are those of the file.
    fn refuse(&self, key: &str, message: &str, remedy: &str) -> OptionError {
        let path = if key.is_empty() { "heat".to_owned() } else { format!("heat.{key}") };
        let found = DeTable::parse(self.text).ok().and_then(|table| {
            let mut value = DeValue::Table(table.into_inner());
            let mut span = None;
            for step in path.split(['.', '[']) {
                let next = match step.strip_suffix(']').and_then(|at| at.parse::<usize>().ok()) {
                    Some(at) => value.get(at)?.clone(),
                    None => value.get(step)?.clone(),
                };
                span = Some(next.span());
                value = next.into_inner();
            }
            span
        });
        let line = found.as_ref().map(|span| self.text[..span.start].matches('\n').count() + 1);
        // Tables need no value in the message.
        let value = found.and_then(|span| self.text.get(span)).filter(|value| !value.contains('\n'));
        let key = value.map_or_else(|| format!("`{path}`"), |value| format!("`{path} = {value}`"));
        let (file, message, remedy) = (self.file.to_owned(), message.to_owned(), remedy.to_owned());
        OptionError::Heat { file, line, key, message, remedy }
    }

    /// Reject the table `heat.PATH`, or a key in it, if it has a fault.
    fn without_fault(&self, path: &str, fault: Option<Fault>) -> Result<(), OptionError> {
        let Some(Fault { key, message, help, .. }) = fault else { return Ok(()) };
        let dot = if path.is_empty() || key.is_empty() { "" } else { "." };
        Err(self.refuse(&format!("{path}{dot}{key}"), &message, &help))
    }
}

const OWN_SOLVER: &str = "remove the key, or use ConcorDEM's own solver";

impl HeatTables {
    /// Read the files; `None` without `heat FILE`.
    pub(super) fn read(
        file: Option<&str>,
        network: Option<&str>,
        materials: &[Material],
        beside: &Beside,
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
        check_heat(&place, &heat, network.is_some(), materials, beside)?;
        if beside.deforms {
            let message = "not with `deformable`";
            return Err(place.refuse("", message, "remove `deformable`, or use ConcorDEM's own solver"));
        }
        let groups = groups(&place, &heat)?;
        for material in materials {
            check_thermal(material, network.is_some())?;
        }
        let expands = materials.iter().any(Material::expands);
        if expands && beside.bond_law.is_none() {
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
            network: network.map(str::to_owned),
            heat,
            file: file.to_owned(),
            text,
        }))
    }

    /// Reject the model of the file of `heat_network` if it is not that of the table.
    ///
    /// # Errors
    /// It is another one.
    pub fn check_model_of_network(&self, model: HeatNetwork) -> Result<(), OptionError> {
        if model == self.heat.model {
            return Ok(());
        }
        let message = format!("the file of `heat_network` has the model {model}");
        Err(Place { file: &self.file, text: &self.text }.refuse("model", &message, "give the same model"))
    }

    /// Number of a group that the table names.
    pub fn group(&self, name: &str) -> usize {
        self.groups.iter().position(|group| group == name).expect("all names are in the list")
    }
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
    has_network: bool,
    materials: &[Material],
    beside: &Beside,
) -> Result<(), OptionError> {
    // All keys, so that a new one is not ignored.
    let Heat {
        model,
        pairs: _, // check_model
        contact_ratio,
        temperature: _,           // its range
        reference_temperature: _, // its range
        steady,
        scheme,
        time_factor: _, // its range
        motion,
        dissipation,
        crack_resistance,
        contact,
        initials: _, // their ranges
        sources,
        boundaries,
    } = heat;
    let refuse = |key: &str, message: &str, remedy: &str| Err(place.refuse(key, message, remedy));
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
    if let Some((key, message)) = ranges::first_violation(heat) {
        return refuse(&key, &message, "change it");
    }
    // Here, the heat content refers to this temperature, whether or not bonds expand, and restarts compare it.
    let fault = heat.faults(materials).into_iter().find(|fault| fault.key != "reference_temperature");
    place.without_fault("", fault)?;
    check_model(place, heat, has_network, beside.bond_law)?;
    check_contact(place, contact.as_ref(), beside.contacts)?;
    for (at, source) in sources.iter().enumerate() {
        check_source(place, at, source)?;
    }
    for (at, boundary) in boundaries.iter().enumerate() {
        check_boundary(place, at, boundary, *model == HeatNetwork::Contacts)?;
    }
    Ok(())
}

/// The network: what conducts along bonds.
fn check_model(place: &Place<'_>, heat: &Heat, has_network: bool, law: Option<LawName>) -> Result<(), OptionError> {
    let Heat { model, pairs, .. } = heat;
    let refuse = |key: &str, message: &str, remedy: &str| Err(place.refuse(key, message, remedy));
    if !has_network && matches!(model, HeatNetwork::Power | HeatNetwork::Disordered) {
        let remedy = "give heat capacities and areas with `heat_network FILE`, as `concordem export --format heat-network` writes them; or \
                      choose \"ordered\" with pairs = \"bonds\", or \"contacts\"";
        return refuse("model", "the areas depend on more than the two atoms of a bond (default: \"power\")", remedy);
    }
    let grains = *model == HeatNetwork::Contacts;
    if !grains && *model != HeatNetwork::Power && *pairs != Some(HeatPairs::Bonds) {
        return refuse("pairs", "here, heat flows along bonds (default: \"contacts\")", "give pairs = \"bonds\"");
    }
    if !grains && law.is_none() {
        return refuse("model", "there are no bonds along which heat could flow", "choose \"contacts\", or a bond law");
    }
    Ok(())
}

/// Heat between atoms that touch.
fn check_contact(place: &Place<'_>, contact: Option<&HeatContact>, contacts: bool) -> Result<(), OptionError> {
    let Some(contact) = contact else { return Ok(()) };
    place.without_fault("contact", contact.fault())?;
    if !contacts {
        let message = "has no effect: without a contact law no atoms touch";
        return Err(place.refuse("contact", message, "add `contact LAW`, or remove the key"));
    }
    Ok(())
}

fn check_source(place: &Place<'_>, at: usize, source: &HeatSource) -> Result<(), OptionError> {
    let HeatSource { set, spot, power: _, density: _, history } = source;
    let path = format!("source[{at}]");
    let refuse = |key: &str, message: &str, remedy: &str| Err(place.refuse(&format!("{path}.{key}"), message, remedy));
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
    place.without_fault(&path, source.fault())
}

fn check_boundary(place: &Place<'_>, at: usize, boundary: &HeatBoundary, grains: bool) -> Result<(), OptionError> {
    let HeatBoundary { face, set, wall, temperature, flux: _, convection: _, radiation: _, history } = boundary;
    let path = format!("boundary[{at}]");
    let refuse = |key: &str, message: &str, remedy: &str| Err(place.refuse(&format!("{path}.{key}"), message, remedy));
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
    place.without_fault(&path, boundary.fault())?;
    if grains && temperature.is_none() {
        return refuse(
            "set",
            "with the model \"contacts\", atoms have no surface",
            "give `temperature`, or another model",
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
    if let Some((key, message)) = ranges::first_violation(thermal) {
        return refuse(&format!("thermal.{key}"), &message, "change it");
    }
    if has_network && thermal.bulk_density.is_some() {
        return refuse("thermal.bulk_density", "has no effect: `heat_network` gives the heat capacities", "remove it");
    }
    let variation = thermal.variation.as_ref();
    for (key, given) in
        [("stiffness", variation.map(|of| &of.stiffness)), ("strength", variation.map(|of| &of.strength))]
    {
        if given.is_some_and(Option::is_some) {
            return refuse(&format!("thermal.variation.{key}"), "is not available here", OWN_SOLVER);
        }
    }
    if let Some(Fault { key, message, help, .. }) = thermal.faults().into_iter().next() {
        return refuse(&format!("thermal.{key}"), &message, &help);
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
            return Err(place.refuse("", "a `set` has no name", "give the name of a group"));
        }
        if !names.contains(name) {
            names.push(name.clone());
        }
    }
    Ok(names)
}
