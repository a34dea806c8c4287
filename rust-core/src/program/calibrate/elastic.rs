//! `concordem calibrate elastic`: stiffnesses of bonds for wanted elastic constants.

use std::path::PathBuf;

use toml_edit::{DocumentMut, InlineTable, Item, TableLike, Value};

use super::super::drive::{Meter, build};
use super::super::{Console, Facts, Failure, Work};
use super::{elastic_failure, positive, replace, stress, with_values};
use crate::assembly::{Assembly, AssemblyError, deformable, settles};
use crate::calibration::elastic::{ElasticCalibrationError, ElasticFit, fit};
use crate::output::OutputError;
use crate::output::sealed::write_text;
use crate::scenario::quantity::TimeStep;
use crate::scenario::{BeamModel, LawName, ProblemKind, Scenario};
use crate::solver::Model;
use crate::solver::coupling::convergence;
use crate::state::State;
use crate::statics::{Accuracy, LinkNetwork};

/// The packing in place of a scenario.
const CELL: &str = r#"# A periodic cell, bonded for wanted elastic constants by `concordem calibrate elastic`.
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
density = "2500 kg/m^3"     # of the particles; of no account to elastic constants

[contacts]
law = "none"

[stop]
steps = 1
"#;

/// Normal stiffness over radius and modulus of a deformable particle, where none is given. Strains and forces settle up to 0.6
/// or more in packings with 8 to 14 bonds per particle; Madan 2019 has 0.09 to 0.35.
const SOFTNESS: f64 = 0.2;

/// Arguments of `concordem calibrate elastic`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Scenario with a periodic packing and one material; the stiffnesses in it do not matter. Without it, with --law, 1000
    /// equal spheres of 1 mm
    scenario: Option<PathBuf>,
    /// Wanted Young's modulus, "30 GPa"
    #[arg(long, value_name = "STRESS", value_parser = stress)]
    young: f64,
    /// Wanted Poisson's ratio
    #[arg(long, value_name = "NUMBER", allow_negative_numbers = true)]
    poisson: f64,
    /// Law of the bonds; that of the scenario if left out. What a scenario does not say about this law is filled in: bonds that
    /// never break
    #[arg(long, value_enum)]
    law: Option<Law>,
    /// Particles deform, too; with linear_bond
    #[arg(long)]
    deformable: bool,
    /// Poisson's ratio of deformable particles; the wanted one if left out
    #[arg(long, value_name = "NUMBER", allow_negative_numbers = true, requires = "deformable")]
    particle_poisson: Option<f64>,
    /// Normal stiffness of a bond over mean radius (of discs: unit depth) and Young's modulus of deformable particles; 0.2 if
    /// left out
    #[arg(long, value_name = "NUMBER", requires = "deformable", value_parser = number)]
    particle_softness: Option<f64>,
    /// Write the scenario with the found parameters to this file
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Overwrite an existing file
    #[arg(long, short)]
    force: bool,
    #[command(flatten)]
    work: Work,
}

/// Laws whose bonds have elastic constants.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Law {
    /// Concrete particle model
    #[value(name = "cpm")]
    Cpm,
    /// Linear bond between points
    #[value(name = "linear_bond")]
    LinearBond,
    /// Euler-Bernoulli beam
    #[value(name = "cohesive_beam")]
    CohesiveBeam,
}

impl From<Law> for LawName {
    fn from(law: Law) -> Self {
        match law {
            Law::Cpm => Self::Cpm,
            Law::LinearBond => Self::LinearBond,
            Law::CohesiveBeam => Self::CohesiveBeam,
        }
    }
}

fn number(text: &str) -> Result<f64, String> {
    positive(text.parse().map_err(|_| format!("`{text}` is no number"))?)
}

pub(super) fn calibrate(arguments: &Arguments, console: &mut Console<'_>) -> Result<(), Failure> {
    if let Some(path) = arguments.output.as_ref().filter(|path| path.exists() && !arguments.force) {
        return Err(OutputError::Exists { path: path.clone() }.into());
    }
    if let Some(poisson) = arguments.particle_poisson.filter(|poisson| !(*poisson > -1.0 && *poisson <= 0.5)) {
        return Err(Failure::Usage(format!("--particle-poisson is {poisson}; it is more than -1 and at most 0.5")));
    }
    let mut scenario = asked(arguments)?;
    let visible = console.interactive && !arguments.work.quiet;
    let (found, radius) = arguments.work.install(|| {
        let meter = Meter::new(visible);
        let given = arguments.particle_poisson.is_some() || arguments.particle_softness.is_some();
        let to_deform = arguments.deformable && (given || scenario.materials[0].deformable.is_none());
        let mut built = scenario.clone();
        // A given time step belongs to the stiffnesses before.
        built.integration.time_step = TimeStep::Auto;
        if to_deform {
            built.materials[0].deformable = None;
        }
        let Assembly { state, mut model, .. } = build(&built, &meter)?;
        let found = if to_deform { deform(&mut scenario, arguments, &state, &mut model).map(Some) } else { Ok(None) };
        let found = found.and_then(|radius| {
            let network = LinkNetwork::of_model(&state, &model).map_err(ElasticCalibrationError::from);
            let found = network.and_then(|network| {
                fit(&network, arguments.young, arguments.poisson, Accuracy::default(), &mut |solutions| {
                    meter.stage("statics", (solutions as f64 / 14.0).min(0.99));
                })
            });
            Ok((found.map_err(|error| elastic_failure(&scenario, error))?, radius))
        });
        meter.finish();
        found
    })?;
    let mut facts = Facts::default();
    let keys = parameters(&scenario, &found, &mut facts);
    if let Some(spectral_radius) = radius {
        facts.add("spectral radius", format!("{spectral_radius:.4} of strains and forces; below 1 they settle"));
    }
    if let (Some(_), Some(bonds)) = (arguments.law, &scenario.bonds) {
        let many = bonds.coordination.map_or(format!("interaction ratio {}", bonds.interaction_ratio.si()), |number| {
            format!("{} per particle", number.si())
        });
        facts.add("bonds", many);
        facts.add("contacts", format!("law = \"{}\"", scenario.contacts.law.law().map_or("none", LawName::key)));
    }
    let achieved = &found.achieved;
    facts.add(
        "achieved, static network",
        format!("young {:.6e} Pa, poisson {:.6}", achieved.mean_young, achieved.mean_poisson),
    );
    let anisotropy = achieved.anisotropy();
    facts.add("directions differ by", format!("{:.4} of E, {:.4} in poisson", anisotropy.young, anisotropy.poisson));
    facts.add("reach of this packing", format!("poisson {:.4} to {:.4}", found.reach.0, found.reach.1));
    if let Some((ratio, share)) = found.prior {
        facts.add("closed form", format!("would take shear_ratio {ratio:.5}; gives {share:.4} of the wanted modulus"));
    }
    facts.add("left out", format!("{} rattlers", found.cell.loose.rattlers));
    let Some(path) = &arguments.output else {
        return console.print(&facts.to_string());
    };
    let text = with_values(&scenario, &keys).ok_or_else(|| uneditable(&scenario))?;
    write_text(path, &text)?;
    console.print(&format!("{}\n{facts}", path.display()))
}

/// The found parameters: tables and keys of the material, and what to tell.
fn parameters(scenario: &Scenario, found: &ElasticFit, facts: &mut Facts) -> Vec<(&'static str, &'static str, Value)> {
    let material = &scenario.materials[0];
    let mut keys: Vec<(&str, &str, Value)> = Vec::new();
    match scenario.bonds.as_ref().map(|bonds| bonds.law) {
        Some(LawName::Cpm) => {
            let young = material.cpm.as_ref().map_or(f64::NAN, |cpm| cpm.young.si()) * found.normal_factor;
            facts.add("young of the links", format!("{young:.8e} Pa"));
            facts.add("shear_ratio", format!("{:.8}", found.shear_ratio));
            keys.push(("cpm", "young", young.into()));
            keys.push(("cpm", "shear_ratio", found.shear_ratio.into()));
        }
        Some(LawName::LinearBond) => {
            let normal = material.linear_bond.as_ref().map_or(f64::NAN, |bond| bond.normal_stiffness.si());
            let normal = normal * found.normal_factor;
            facts.add("normal_stiffness", format!("{normal:.8e} N/m"));
            facts.add("shear_stiffness", format!("{:.8e} N/m", normal * found.shear_ratio));
            keys.push(("linear_bond", "normal_stiffness", normal.into()));
            keys.push(("linear_bond", "shear_stiffness", (normal * found.shear_ratio).into()));
            if let Some(particles) = &material.deformable {
                let young = particles.young.si() * found.normal_factor;
                facts.add("young of the particles", format!("{young:.8e} Pa, in proportion to normal_stiffness"));
                facts.add("poisson of the particles", format!("{}", particles.poisson.si()));
                keys.push(("deformable", "young", young.into()));
            }
        }
        _ => {
            if let (Some(beam), Some((radius_factor, young_factor))) = (&material.cohesive_beam, found.beam_factors) {
                let young = beam.young.si() * young_factor;
                facts.add("young of the beams", format!("{young:.8e} Pa"));
                keys.push(("cohesive_beam", "young", young.into()));
                if let Some(ratio) = beam.radius_ratio {
                    let ratio = ratio.si() * radius_factor;
                    facts.add("radius_ratio", format!("{ratio:.8}"));
                    keys.push(("cohesive_beam", "radius_ratio", ratio.into()));
                } else if let Some(radius) = beam.radius {
                    let radius = radius.si() * radius_factor;
                    facts.add("radius of the beams", format!("{radius:.8e} m"));
                    keys.push(("cohesive_beam", "radius", radius.into()));
                }
            }
        }
    }
    keys
}

/// The scenario, or the cell in its place, with bonds of the law that is asked for.
fn asked(arguments: &Arguments) -> Result<Scenario, Failure> {
    let scenario = match &arguments.scenario {
        Some(path) => Scenario::read(path)?,
        None if arguments.law.is_some() => Scenario::parse("the built-in cell", CELL)?,
        None => {
            let message =
                "name a scenario, or a law for a packing that is made here: --law cpm, linear_bond, or cohesive_beam";
            return Err(Failure::Usage(message.into()));
        }
    };
    let problem = |scenario: &Scenario, key: &str, message: &str, help: &str| {
        Failure::Scenario(scenario.problem(ProblemKind::Conflict, key, message.to_owned(), help))
    };
    let own = scenario.bonds.as_ref().map(|bonds| bonds.law);
    let Some(law) = arguments.law.map(LawName::from).or(own) else {
        let message = "the scenario has no bonds, so its law is not known";
        return Err(problem(&scenario, "bonds", message, "add [bonds], or say which law: --law linear_bond"));
    };
    let [material] = &scenario.materials[..] else {
        let message = "one material is calibrated at a time; the scenario has several";
        let help = "leave one [[material]] and calibrate each phase by itself";
        return Err(problem(&scenario, "material", message, help));
    };
    if law != LawName::LinearBond {
        if arguments.deformable {
            let help = if arguments.law.is_some() { "take" } else { "leave it out, or take" };
            let message = format!("--deformable: the law \"{}\" does not know deformable particles", law.key());
            return Err(Failure::Usage(format!("{message}; {help} --law linear_bond")));
        }
        if material.deformable.is_some() {
            let message = format!("--law {}: this law does not know deformable particles", law.key());
            let help = "remove this table, or take --law linear_bond";
            return Err(problem(&scenario, "material[0].deformable", &message, help));
        }
    }
    let scenario = if own == Some(law) { scenario } else { with_law(&scenario, law, arguments.young)? };
    let beam = scenario.materials[0].cohesive_beam.as_ref();
    if law == LawName::CohesiveBeam && beam.is_some_and(|beam| beam.model != BeamModel::EulerBernoulli) {
        let message =
            "only the radius of Euler-Bernoulli beams is sought: of others the stiffnesses have other powers of it";
        let key = "material[0].cohesive_beam.model";
        return Err(problem(&scenario, key, message, "write model = \"euler-bernoulli\""));
    }
    Ok(scenario)
}

/// A scenario after a change of its text.
fn edited(
    scenario: &Scenario,
    name: &str,
    edit: impl FnOnce(&mut DocumentMut) -> Option<()>,
) -> Result<Scenario, Failure> {
    let mut document: DocumentMut = scenario.source.text.parse().map_err(|_| uneditable(scenario))?;
    edit(&mut document).ok_or_else(|| uneditable(scenario))?;
    Ok(Scenario::parse(name, &document.to_string())?)
}

fn uneditable(scenario: &Scenario) -> Failure {
    let message = "the material's table cannot be edited";
    Failure::Scenario(scenario.problem(ProblemKind::Conflict, "material", message, "write it as [[material]]"))
}

/// The only material's table.
fn material_of(document: &mut DocumentMut) -> Option<&mut dyn TableLike> {
    document.get_mut("material")?.get_mut(0)?.as_table_like_mut()
}

/// Add a table: with a header where the one around it has one, else in braces. `comment` stands before the header.
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

/// The scenario with bonds of another law, on the same pairs: that law's table with stiffnesses to start from, if there is none,
/// and contacts that follow. What belonged to the old law alone goes.
///
/// Bonds where there were none: the usual interaction ratio, of beams the usual number (Jebahi et al. 2015).
fn with_law(scenario: &Scenario, law: LawName, young: f64) -> Result<Scenario, Failure> {
    let old = scenario.bonds.as_ref().map(|bonds| bonds.law);
    let follow = old.is_some() && scenario.contacts.law.law() == old;
    let name = format!("{} with --law {}", scenario.source.name, law.key());
    edited(scenario, &name, |document| {
        if follow {
            // There are no contacts of the law of beams.
            let word = if law == LawName::CohesiveBeam { "none" } else { law.key() };
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
            let (values, comment) = start(law, young);
            add_table(material, has_header, law.key(), comment, values);
        }
        Some(())
    })
}

/// Parameters to start from, and what to say about them.
fn start(law: LawName, young: f64) -> (InlineTable, &'static str) {
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
            (values, "# Elastic: no damage, no slip. Strengths come from `concordem calibrate concrete`.\n")
        }
        LawName::CohesiveBeam => {
            let values = table(&[("young", young), ("poisson", 0.3), ("radius_ratio", 0.5)]);
            (values, "# Elastic: bonds break only with a tensile_strength.\n")
        }
        _ => {
            let values = table(&[("normal_stiffness", 1e7), ("shear_stiffness", 2e6)]);
            (values, "# Elastic: bonds break only with a normal_strength or shear_strength.\n")
        }
    }
}

/// Make the particles deformable, in the scenario and in the model, by what is given, the scenario's own, or defaults; returns the
/// spectral radius of the iteration between their strains and forces, which is the same before and after the search.
fn deform(scenario: &mut Scenario, arguments: &Arguments, state: &State, model: &mut Model) -> Result<f64, Failure> {
    let material = &scenario.materials[0];
    let stiffness = material.linear_bond.as_ref().ok_or_else(|| uneditable(scenario))?.normal_stiffness.si();
    let radii = &state.particles.radius;
    let size = if scenario.dimension == 2 { 1.0 } else { radii.iter().sum::<f64>() / radii.len() as f64 };
    let own = material.deformable.as_ref();
    let own_softness = own.map_or(SOFTNESS, |particles| stiffness / (size * particles.young.si()));
    let softness = arguments.particle_softness.unwrap_or(own_softness);
    let own_poisson = own.map_or(arguments.poisson, |particles| particles.poisson.si());
    let poisson = arguments.particle_poisson.unwrap_or(own_poisson);
    let values = InlineTable::from_iter([("young", stiffness / (softness * size)), ("poisson", poisson)]);
    let name = format!("{} with --deformable", scenario.source.name);
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
            Err(Failure::Calibration(format!(
                "--particle-softness {softness}: strains and forces of these particles would not settle, the spectral radius \
                 of their iteration is {spectral_radius:.4}; take one below {most:.4}"
            )))
        }
        Err(other) => Err(Failure::of_assembly(scenario, other)),
        Ok(()) => Ok(convergence.spectral_radius),
    }
}
