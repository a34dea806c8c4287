//! Bond parameters of a scenario for target elastic constants, for the command `calibrate elastic` and Python's
//! `calibrate_elastic`.

use std::path::Path;

use toml_edit::{DocumentMut, InlineTable, Item, TableLike, Value};

use super::super::Failure;
use super::{elastic_failure, replace, with_values};
use crate::calibration::elastic::{ElasticCalibrationError, ElasticFit, fit};
use concordem_scenario::assembly::{Assembly, AssemblyError, Progress, assemble, deformable, settles};
use concordem_scenario::schema::quantity::TimeStep;
use concordem_scenario::schema::{BeamModel, LawName, ProblemKind, Scenario, large};
use concordem_solver::Model;
use concordem_solver::coupling::convergence;
use concordem_solver::state::State;
use concordem_statics::{Accuracy, LinkNetwork};

/// The built-in scenario, used if no scenario is given.
const CELL: &str = r#"# A periodic cell, bonded for target elastic constants by `concordem calibrate elastic`.
version = 1
title = "Periodic cell for elastic constants"

[packing]
kind = "random-dense"
count = 1000
radius = "1 mm"
seed = 1

[packing.shape]
kind = "periodic"

[[material]]
name = "material"
density = "2500 kg/m^3"     # of the particles; no effect on elastic constants

[contacts]
law = "none"

[stop]
steps = 1
"#;

/// Default of the normal stiffness over radius and modulus of a deformable particle. The iteration between strains and
/// forces converges up to 0.6 or more in packings with 8 to 14 bonds per particle; Madan 2019 uses 0.09 to 0.35.
const SOFTNESS: f64 = 0.2;

/// Laws whose stiffnesses can be calibrated: the search knows their elastic keys.
pub const CALIBRATED: [LawName; 4] = [LawName::Cpm, LawName::LinearBond, LawName::CohesiveBeam, LawName::Jointed];

/// The law with this name, if it is in `CALIBRATED`.
///
/// # Errors
/// Another name; the message lists the names to choose from.
pub fn calibrated_law(name: &str) -> Result<LawName, String> {
    CALIBRATED.into_iter().find(|law| law.key() == name).ok_or_else(|| {
        let [first, second, third, fourth] = CALIBRATED.map(LawName::key);
        format!("law is \"{name}\"; choose \"{first}\", \"{second}\", \"{third}\", or \"{fourth}\"")
    })
}

/// Target properties of the bonds of a scenario.
#[derive(Debug, Clone, Copy)]
pub struct ElasticRequest {
    /// Target Young's modulus, Pa.
    pub young: f64,
    /// Target Poisson's ratio.
    pub poisson: f64,
    /// Law of the bonds; `None`: that of the scenario. Missing parameters are filled in.
    pub law: Option<LawName>,
    /// Whether particles deform; for `linear_bond`.
    pub deformable: bool,
    /// Poisson's ratio of deformable particles; `None`: the scenario's, else the target one.
    pub particle_poisson: Option<f64>,
    /// Normal stiffness of a bond over mean radius (of discs: unit depth) and Young's modulus of deformable particles;
    /// `None`: the scenario's, else 0.2.
    pub particle_softness: Option<f64>,
    /// Notation of options in messages.
    pub spelling: Spelling,
}

/// Notation of options in messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spelling {
    /// `--particle-softness 0.2`
    Options,
    /// `particle_softness=0.2`
    Keywords,
}

impl Spelling {
    fn name(self, name: &str) -> String {
        match self {
            Self::Options => format!("--{}", name.replace('_', "-")),
            Self::Keywords => name.to_owned(),
        }
    }

    fn with(self, name: &str, value: &str) -> String {
        match self {
            Self::Options => format!("{} {value}", self.name(name)),
            Self::Keywords if value.parse::<f64>().is_ok() => format!("{name}={value}"),
            Self::Keywords => format!("{name}=\"{value}\""),
        }
    }
}

/// Result of the search.
#[derive(Debug, Clone)]
pub struct ElasticSearch {
    /// The scenario with the found parameters.
    pub scenario: Scenario,
    /// Factors of the stiffnesses, and the resulting constants.
    pub fit: ElasticFit,
    /// Found parameters in SI units: table of the material, key, value.
    pub parameters: Vec<(&'static str, &'static str, f64)>,
    /// Spectral radius of the iteration between strains and forces, if the request made particles deformable.
    pub spectral_radius: Option<f64>,
}

/// Finds bond stiffnesses of a scenario for target elastic constants; without a scenario, for 1000 equal spheres of radius
/// 1 mm in a periodic cell. Paths in the scenario are relative to `folder`. Its stiffnesses and time step are ignored.
///
/// # Errors
/// The request contradicts itself or the scenario, there is no static solution, or the constants are out of reach.
pub fn calibrate_elastic(
    scenario: Option<&Scenario>,
    folder: &Path,
    request: &ElasticRequest,
    progress: Progress<'_>,
) -> Result<ElasticSearch, Failure> {
    check(request)?;
    let mut scenario = requested(scenario, request)?;
    let given = request.particle_poisson.is_some() || request.particle_softness.is_some();
    let to_deform = request.deformable && (given || scenario.materials[0].deformable.is_none());
    let mut built = scenario.clone();
    // A given time step was chosen for the old stiffnesses.
    built.integration.time_step = TimeStep::Auto;
    if to_deform {
        built.materials[0].deformable = None;
    }
    let Assembly { state, mut model, .. } =
        assemble(&built, folder, progress).map_err(|error| Failure::of_assembly(&built, error))?;
    let spectral_radius = if to_deform { Some(deform(&mut scenario, request, &state, &mut model)?) } else { None };
    let found = LinkNetwork::of_model(&state, &model).map_err(ElasticCalibrationError::from).and_then(|network| {
        fit(&network, request.young, request.poisson, Accuracy::default(), &mut |solutions| {
            progress("statics", (solutions as f64 / 14.0).min(0.99));
        })
    });
    let fit = found.map_err(|error| elastic_failure(&scenario, error))?;
    let parameters = parameters(&scenario, &fit);
    let values: Vec<_> = parameters.iter().map(|&(table, key, value)| (table, key, value.into())).collect();
    let text = with_values(&scenario, &values).ok_or_else(|| uneditable(&scenario))?;
    let scenario = Scenario::parse(&scenario.source.name, &text)?;
    Ok(ElasticSearch { scenario, fit, parameters, spectral_radius })
}

/// Refuses requests that no scenario can fulfill.
fn check(request: &ElasticRequest) -> Result<(), Failure> {
    let ElasticRequest { deformable, particle_poisson, particle_softness, spelling, .. } = *request;
    let refuse = |name: &str, message: String| Err(Failure::Usage(format!("{} {message}", spelling.name(name))));
    if let Some(poisson) = particle_poisson.filter(|poisson| !(*poisson > -1.0 && *poisson <= 0.5)) {
        return refuse("particle_poisson", format!("is {poisson}; it must be more than -1 and at most 0.5"));
    }
    if let Some(softness) = particle_softness.filter(|softness| !(*softness > 0.0 && softness.is_finite())) {
        return refuse("particle_softness", format!("is {softness}; it must be positive and finite"));
    }
    for (name, given) in
        [("particle_poisson", particle_poisson.is_some()), ("particle_softness", particle_softness.is_some())]
    {
        if given && !deformable {
            let wanted = spelling.name("deformable");
            return refuse(name, format!("is for deformable particles; add {wanted}, or omit it"));
        }
    }
    Ok(())
}

/// The parameters found: table and key of the material, value.
fn parameters(scenario: &Scenario, found: &ElasticFit) -> Vec<(&'static str, &'static str, f64)> {
    let material = &scenario.materials[0];
    match scenario.bonds.as_ref().map(|bonds| bonds.law) {
        Some(LawName::Cpm) => {
            let young = material.cpm.as_ref().map_or(f64::NAN, |cpm| cpm.young.si());
            vec![("cpm", "young", young * found.normal_factor), ("cpm", "shear_ratio", found.shear_ratio)]
        }
        Some(LawName::LinearBond) => {
            let normal = material.linear_bond.as_ref().map_or(f64::NAN, |bond| bond.normal_stiffness.si());
            let normal = normal * found.normal_factor;
            let mut parameters = vec![
                ("linear_bond", "normal_stiffness", normal),
                ("linear_bond", "shear_stiffness", normal * found.shear_ratio),
            ];
            if let Some(particles) = &material.deformable {
                parameters.push(("deformable", "young", particles.young.si() * found.normal_factor));
            }
            parameters
        }
        Some(LawName::CohesiveBeam) => {
            let (Some(beam), Some((radius_factor, young_factor))) = (&material.cohesive_beam, found.beam_factors)
            else {
                return Vec::new();
            };
            let mut parameters = vec![("cohesive_beam", "young", beam.young.si() * young_factor)];
            if let Some(ratio) = beam.radius_ratio {
                parameters.push(("cohesive_beam", "radius_ratio", ratio.si() * radius_factor));
            } else if let Some(radius) = beam.radius {
                parameters.push(("cohesive_beam", "radius", radius.si() * radius_factor));
            }
            parameters
        }
        Some(LawName::Jointed) => {
            let young = material.jointed.as_ref().map_or(f64::NAN, |bond| bond.young.si());
            vec![("jointed", "young", young * found.normal_factor), ("jointed", "stiffness_ratio", found.shear_ratio)]
        }
        // `requested` refuses all other laws.
        Some(_) | None => Vec::new(),
    }
}

/// The given or built-in scenario with bonds of the requested law.
fn requested(scenario: Option<&Scenario>, request: &ElasticRequest) -> Result<Scenario, Failure> {
    let spelling = request.spelling;
    let scenario = match scenario {
        Some(scenario) => scenario.clone(),
        None if request.law.is_some() => Scenario::parse("the built-in cell", CELL)?,
        None => {
            let law = spelling.with("law", "cpm");
            let message = format!(
                "give a scenario, or choose a law for the built-in packing: {law}, linear_bond, cohesive_beam, or jointed"
            );
            return Err(Failure::Usage(message));
        }
    };
    let problem = |scenario: &Scenario, key: &str, message: &str, help: &str| {
        Failure::Scenario(scenario.problem(ProblemKind::Conflict, key, message.to_owned(), help))
    };
    let own = scenario.bonds.as_ref().map(|bonds| bonds.law);
    let Some(law) = request.law.or(own) else {
        let message = "the scenario has no bonds, so their law is unknown";
        let help = format!("add [bonds], or choose a law: {}", spelling.with("law", "linear_bond"));
        return Err(problem(&scenario, "bonds", message, &help));
    };
    if !CALIBRATED.contains(&law) {
        let message = format!("the elastic keys of law \"{}\" are not known to the search", law.key());
        let help = format!("choose one of the laws {}", CALIBRATED.map(LawName::key).join(", "));
        return Err(problem(&scenario, "bonds.law", &message, &help));
    }
    let [material] = &scenario.materials[..] else {
        let message = "the scenario has several materials; only one can be calibrated at a time";
        let help = "keep one [[material]], and calibrate each phase separately";
        return Err(problem(&scenario, "material", message, help));
    };
    if !law.facts().deforms {
        let right = spelling.with("law", "linear_bond");
        if request.deformable {
            let help = if request.law.is_some() { "use" } else { "omit it, or use" };
            let (option, law) = (spelling.name("deformable"), law.key());
            let message = format!("{option}: the law \"{law}\" does not support deformable particles; {help} {right}");
            return Err(Failure::Usage(message));
        }
        if material.deformable.is_some() {
            let message =
                format!("{}: this law does not support deformable particles", spelling.with("law", law.key()));
            let help = format!("remove this table, or use {right}");
            return Err(problem(&scenario, "material[0].deformable", &message, &help));
        }
    }
    let scenario = if own == Some(law) { scenario } else { with_law(&scenario, law, request)? };
    let beam = scenario.materials[0].cohesive_beam.as_ref();
    if law == LawName::CohesiveBeam && beam.is_some_and(|beam| beam.model != BeamModel::EulerBernoulli) {
        let message = "only the radius of Euler-Bernoulli beams can be calibrated; the stiffnesses of other beams depend on other powers of it";
        let key = "material[0].cohesive_beam.model";
        return Err(problem(&scenario, key, message, "write model = \"euler-bernoulli\""));
    }
    Ok(scenario)
}

/// The scenario with edited text.
fn edited(
    scenario: &Scenario,
    name: &str,
    edit: impl FnOnce(&mut DocumentMut) -> Option<()>,
) -> Result<Scenario, Failure> {
    let mut document: DocumentMut = large::protect(&scenario.source.text).parse().map_err(|_| uneditable(scenario))?;
    edit(&mut document).ok_or_else(|| uneditable(scenario))?;
    Ok(Scenario::parse(name, &large::restore(&document.to_string()))?)
}

fn uneditable(scenario: &Scenario) -> Failure {
    let message = "the material's table cannot be edited";
    Failure::Scenario(scenario.problem(ProblemKind::Conflict, "material", message, "write it as [[material]]"))
}

/// Table of the only material.
fn material_of(document: &mut DocumentMut) -> Option<&mut dyn TableLike> {
    document.get_mut("material")?.get_mut(0)?.as_table_like_mut()
}

/// Adds a table: with a header if `has_header`, else inline. `comment` precedes the header.
fn add_table(parent: &mut dyn TableLike, has_header: bool, key: &str, comment: &str, values: InlineTable) {
    if has_header {
        let mut table = values.into_table();
        for (mut key, value) in table.iter_mut() {
            key.leaf_decor_mut().clear();
            if let Some(value) = value.as_value_mut() {
                value.decor_mut().clear();
            }
        }
        table.decor_mut().set_prefix(format!("\n{comment}"));
        parent.insert(key, Item::Table(table));
    } else {
        parent.insert(key, Item::Value(Value::InlineTable(values)));
    }
}

/// The scenario with bonds of another law on the same pairs. Adds initial stiffnesses if the table of the law is missing,
/// changes the law of contacts if it was the law of the bonds, and removes the table of the old law.
///
/// A scenario without bonds gets the usual interaction ratio, or for beams the usual coordination number (Jebahi et al.
/// 2015).
fn with_law(scenario: &Scenario, law: LawName, request: &ElasticRequest) -> Result<Scenario, Failure> {
    let old = scenario.bonds.as_ref().map(|bonds| bonds.law);
    let follow = old.is_some() && scenario.contacts.law.law() == old;
    let name = format!("{} with {}", scenario.source.name, request.spelling.with("law", law.key()));
    edited(scenario, &name, |document| {
        if follow {
            let word = if law.facts().as_contact.is_some() { law.key() } else { "none" };
            replace(document.get_mut("contacts")?.get_mut("law")?, word.into())?;
        }
        if let Some(bonds) = document.get_mut("bonds") {
            replace(bonds.get_mut("law")?, law.key().into())?;
        } else {
            let mut bonds = InlineTable::from_iter([("law", law.key())]);
            if law == LawName::CohesiveBeam {
                bonds.insert("coordination", 6.2.into());
            } else {
                bonds.insert("interaction_ratio", 1.5.into());
            }
            add_table(document.as_table_mut(), true, "bonds", "", bonds);
        }
        let has_header = document.get("material")?.is_array_of_tables();
        let material = material_of(document)?;
        if let Some(old) = old {
            material.remove(old.key());
        }
        if !scenario.materials[0].has(law) {
            let (values, comment) = start(law, request.young)?;
            add_table(material, has_header, law.key(), comment, values);
        }
        Some(())
    })
}

/// Initial parameters, and a comment on them; `None` for a law whose elastic keys the search does not know.
fn start(law: LawName, young: f64) -> Option<(InlineTable, &'static str)> {
    let table = |values: &[(&str, f64)]| values.iter().map(|(key, value)| (*key, *value)).collect::<InlineTable>();
    match law {
        LawName::Cpm => {
            // A cohesion as large as the modulus is never reached.
            let mut values = table(&[
                ("young", young),
                ("shear_ratio", 0.2),
                ("crack_onset_strain", 1e-4),
                ("relative_ductility", 30.0),
                ("cohesion", young),
                ("friction_coefficient", 0.8),
            ]);
            values.insert("never_damage", true.into());
            Some((values, "# Elastic: no damage, no slip. Strengths come from `concordem calibrate concrete`.\n"))
        }
        LawName::CohesiveBeam => {
            let values = table(&[("young", young), ("poisson", 0.3), ("radius_ratio", 0.5)]);
            Some((values, "# Elastic: bonds break only with a tensile_strength.\n"))
        }
        LawName::LinearBond => {
            let values = table(&[("normal_stiffness", 1e7), ("shear_stiffness", 2e6)]);
            Some((values, "# Elastic: bonds break only with a normal_strength or shear_strength.\n"))
        }
        LawName::Jointed => {
            // Strengths as large as the modulus are never reached.
            let values = table(&[
                ("young", young),
                ("stiffness_ratio", 0.3),
                ("tensile_strength", young),
                ("cohesion", young),
                ("friction_coefficient", 0.5),
            ]);
            Some((values, "# Elastic: strengths come from `concordem calibrate rock`.\n"))
        }
        _ => None,
    }
}

/// Makes the particles deformable in the scenario and in the model, with given parameters, those of the scenario, or
/// defaults. Returns the spectral radius of the iteration between strains and forces, which the search does not change.
fn deform(scenario: &mut Scenario, request: &ElasticRequest, state: &State, model: &mut Model) -> Result<f64, Failure> {
    let material = &scenario.materials[0];
    let stiffness = material.linear_bond.as_ref().ok_or_else(|| uneditable(scenario))?.normal_stiffness.si();
    let radii = &state.particles.radius;
    let size = if scenario.dimension == 2 { 1.0 } else { radii.iter().sum::<f64>() / radii.len() as f64 };
    let own = material.deformable.as_ref();
    let own_softness = own.map_or(SOFTNESS, |particles| stiffness / (size * particles.young.si()));
    let softness = request.particle_softness.unwrap_or(own_softness);
    let own_poisson = own.map_or(request.poisson, |particles| particles.poisson.si());
    let poisson = request.particle_poisson.unwrap_or(own_poisson);
    let values = InlineTable::from_iter([("young", stiffness / (softness * size)), ("poisson", poisson)]);
    let name = format!("{} with {}", scenario.source.name, request.spelling.name("deformable"));
    *scenario = edited(scenario, &name, |document| {
        let has_header = document.get("material")?.is_array_of_tables();
        let material = material_of(document)?;
        material.remove("deformable");
        add_table(material, has_header, "deformable", "", values);
        Some(())
    })?;
    model.deformable = deformable(scenario);
    let Some(particles) = &model.deformable else { return Err(uneditable(scenario)) };
    let convergence = convergence(state, particles);
    match settles(particles, &convergence, scenario.integration.allow_unstable) {
        Err(AssemblyError::NotConvergent { spectral_radius, young, .. }) => {
            let most = softness * particles.elasticity[0].young / young;
            let option = request.spelling.with("particle_softness", &softness.to_string());
            Err(Failure::Calibration(format!(
                "{option}: the iteration between strains and forces of these particles would not converge (spectral radius \
                 {spectral_radius:.4}); use a softness below {most:.4}"
            )))
        }
        Err(other) => Err(Failure::of_assembly(scenario, other)),
        Ok(()) => Ok(convergence.spectral_radius),
    }
}
