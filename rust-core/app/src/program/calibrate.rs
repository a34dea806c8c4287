//! `concordem calibrate`: bond parameters for target material properties.

mod concrete;
mod elastic;
mod elastic_search;
mod rock;
mod table;

use std::path::PathBuf;

use super::meter::Meter;
use super::{Console, Facts, Failure, Work};
use crate::calibration::cohesive_beam::{
    CalibrationError, CylinderLoad, CylinderRecipe, CylinderSpecimen, FractureCriterion, elastic as elastic_response,
    match_elastic, scenario_text, strength,
};
use crate::calibration::elastic::ElasticCalibrationError;
use crate::output::OutputError;
use concordem_contact::law::{BendingTerm, Section};
use concordem_scenario::schema::quantity::{Angle, Density, Quantity, Stress};
use concordem_scenario::schema::{Scenario, large};

pub use elastic_search::{ElasticRequest, ElasticSearch, Spelling, calibrate_elastic, calibrated_law};

/// Arguments of `concordem calibrate`.
#[derive(Debug, clap::Args)]
pub(super) struct CalibrateArguments {
    #[command(subcommand)]
    target: Target,
}

#[derive(Debug, clap::Subcommand)]
enum Target {
    /// Young's modulus, Poisson's ratio, and strength of cohesive beams, by the procedure of Jebahi et al. 2015
    #[command(name = "cohesive_beam")]
    CohesiveBeam(CalibrateBeamArguments),
    /// Young's modulus and Poisson's ratio of cpm, linear_bond, cohesive_beam, or jointed bonds, on the packing of a scenario or
    /// a built-in one, optionally with deformable particles
    Elastic(elastic::CalibrateElasticArguments),
    /// Moduli, strengths, and fracture energy of cpm concrete, on the specimen of a scenario and similar packings
    Concrete(concrete::CalibrateConcreteArguments),
    /// Moduli, strengths, and angle of friction of rock with jointed bonds or cohesive beams, on periodic cells
    Rock(rock::CalibrateRockArguments),
}

/// Arguments of `concordem calibrate cohesive_beam`.
#[derive(Debug, clap::Args)]
struct CalibrateBeamArguments {
    /// Target Young's modulus, "75 GPa"
    #[arg(long, value_name = "STRESS", value_parser = stress)]
    young: f64,
    /// Target Poisson's ratio
    #[arg(long, value_name = "NUMBER")]
    poisson: f64,
    /// Target tensile strength, "50 MPa"; by default the bonds never break
    #[arg(long, value_name = "STRESS", value_parser = stress)]
    tensile_strength: Option<f64>,
    /// Density of the material, "2200 kg/m^3"
    #[arg(long, value_name = "DENSITY", value_parser = density)]
    density: f64,
    /// Poisson's ratio of the beams
    #[arg(long, value_name = "NUMBER", default_value_t = 0.3)]
    beam_poisson: f64,
    /// Bonds per particle
    #[arg(long, value_name = "NUMBER", default_value_t = 6.2)]
    coordination: f64,
    /// Dispersion of the radii: (largest - smallest)/mean
    #[arg(long, value_name = "NUMBER", default_value_t = 0.25)]
    dispersion: f64,
    /// Number of spheres of the largest specimen; specimens with a third and a ninth of them show the convergence
    #[arg(long, value_name = "NUMBER", default_value_t = 5000, value_parser = clap::value_parser!(u64).range(1000..=1_000_000))]
    count: u64,
    /// Seed of the packings
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    seed: u64,
    /// Scenario to write
    #[arg(long, short, value_name = "FILE", default_value = "cohesive-beam.toml")]
    output: PathBuf,
    /// Overwrite an existing file
    #[arg(long, short)]
    force: bool,
    #[command(flatten)]
    work: Work,
}

/// A plain number below this, Pa, is probably in GPa or MPa: no solid is so soft or weak.
const SOFT: f64 = 1e3;

fn stress(text: &str) -> Result<f64, String> {
    let Ok(plain) = text.parse::<f64>() else {
        return positive(Stress::parse(text).map(Quantity::si).map_err(|error| error.to_string())?);
    };
    if plain > 0.0 && plain < SOFT {
        return Err(format!(
            "plain numbers are Pa, and no solid is so soft or weak: write \"{text} GPa\" or \"{text} MPa\", or \"{text} Pa\" if pascals are meant"
        ));
    }
    positive(plain)
}

/// An angle below a right one, rad.
fn angle(text: &str) -> Result<f64, String> {
    let value = positive(Angle::parse(text).map(Quantity::si).map_err(|error| error.to_string())?)?;
    if value < std::f64::consts::FRAC_PI_2 {
        Ok(value)
    } else {
        Err(format!("{text} is not below a right angle: write \"{text} deg\""))
    }
}

fn density(text: &str) -> Result<f64, String> {
    positive(text.parse().map_or_else(|_| Density::parse(text).map(Quantity::si).map_err(|e| e.to_string()), Ok)?)
}

fn positive(value: f64) -> Result<f64, String> {
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err(format!("{value} must be positive and finite")) }
}

pub(super) fn calibrate(arguments: &CalibrateArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    match &arguments.target {
        Target::CohesiveBeam(arguments) => calibrate_beam(arguments, console),
        Target::Elastic(arguments) => elastic::calibrate(arguments, console),
        Target::Concrete(arguments) => concrete::calibrate(arguments, console),
        Target::Rock(arguments) => rock::calibrate(arguments, console),
    }
}

fn elastic_failure(scenario: &Scenario, error: ElasticCalibrationError) -> Failure {
    match error {
        ElasticCalibrationError::Statics(error) => super::elastic::failed(scenario, error),
        other => Failure::Elastic(other),
    }
}

/// Text of the scenario with new values in the tables of its first material, with comments and order preserved.
fn with_values(scenario: &Scenario, keys: &[(&str, &str, toml_edit::Value)]) -> Option<String> {
    with_values_and_without(scenario, keys, &[])
}

/// The same, without some keys. A key that the table lacks is added.
fn with_values_and_without(
    scenario: &Scenario,
    keys: &[(&str, &str, toml_edit::Value)],
    without: &[(&str, &str)],
) -> Option<String> {
    let mut document: toml_edit::DocumentMut = large::protect(&scenario.source.text).parse().ok()?;
    let material = document.get_mut("material")?.get_mut(0)?;
    for (law, key, new) in keys {
        let table = material.get_mut(law)?.as_table_like_mut()?;
        match table.get_mut(key) {
            Some(old) => replace(old, new.clone())?,
            None => {
                table.insert(key, toml_edit::value(new.clone()));
            }
        }
    }
    for (law, key) in without {
        material.get_mut(law)?.as_table_like_mut()?.remove(key);
    }
    Some(large::restore(&document.to_string()))
}

/// Replaces a value and keeps its comments.
fn replace(old: &mut toml_edit::Item, mut new: toml_edit::Value) -> Option<()> {
    let old = old.as_value_mut()?;
    *new.decor_mut() = old.decor().clone();
    *old = new;
    Some(())
}

fn calibrate_beam(arguments: &CalibrateBeamArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    if arguments.output.exists() && !arguments.force {
        return Err(OutputError::Exists { path: arguments.output.clone() }.into());
    }
    let display = console.display(&arguments.work);
    let meter = Meter::new(display);
    let (facts, text) = arguments
        .work
        .install(|| cohesive_beam(arguments, &meter).map_err(|error| Failure::Calibration(error.to_string())))?;
    crate::output::sealed::write_text(&arguments.output, &text)?;
    console.print(&format!("{}\n{facts}", arguments.output.display()))
}

fn cohesive_beam(arguments: &CalibrateBeamArguments, meter: &Meter) -> Result<(Facts, String), CalibrationError> {
    let recipe = |count: usize| CylinderRecipe {
        coordination: arguments.coordination,
        dispersion: arguments.dispersion,
        ..CylinderRecipe::book(count, arguments.seed)
    };
    let make = |count: usize| {
        CylinderSpecimen::new(&recipe(count), &mut |now| {
            meter.stage("compaction", (now.packing_fraction / 0.65).min(0.99));
        })
    };
    let largest = arguments.count as usize;
    let sample = make(largest)?;
    let mut tried = 0;
    let found = match_elastic(&sample, arguments.young, arguments.poisson, arguments.beam_poisson, &mut |_, _| {
        tried += 1;
        meter.stage("elastic constants", (f64::from(tried) / 8.0).min(0.99));
    })?;
    let mut facts = Facts::default();
    let section = match found.beam.section {
        Section::Ratio(ratio) => format!("radius ratio {ratio:.5}"),
        Section::RatioOfPair { ratio, radius } => format!("radius ratio {ratio:.5} ({})", radius.key()),
        Section::Radius(radius) => format!("radius {radius:.5e} m"),
    };
    facts.add("beam", format!("young {:.5e} Pa, poisson {}, {section}", found.beam.young, found.beam.poisson));
    let density = sample.sphere_density(arguments.density);
    facts.add("density of spheres", format!("{density:.2} kg/m³"));
    let criterion = match arguments.tensile_strength {
        None => FractureCriterion::Beam(f64::MAX, BendingTerm::MidSection),
        Some(wanted) => {
            // The strength is proportional to that of the beams: one trial run, and one run to check the result.
            let trial = 6.0 * wanted;
            meter.stage("strength", 0.3);
            let first = strength(
                &sample,
                &found.beam,
                FractureCriterion::Beam(trial, BendingTerm::MidSection),
                density,
                CylinderLoad::Tension,
            )?;
            let right = FractureCriterion::Beam(trial * wanted / first.strength, BendingTerm::MidSection);
            meter.stage("strength", 0.7);
            let second = strength(&sample, &found.beam, right, density, CylinderLoad::Tension)?;
            if let FractureCriterion::Beam(value, _) = right {
                facts.add("strength of beams", format!("{value:.5e} Pa, mid-section"));
            }
            facts.add("achieved strength", format!("{:.4e} Pa, target {wanted:.4e} Pa", second.strength));
            right
        }
    };
    facts.add("specimen", sample_facts(&sample));
    let achieved = &found.achieved;
    facts.add("achieved", format!("young {:.5e} Pa, poisson {:.4}", achieved.modulus, achieved.poisson));
    let bounding = format!("young {:.5e} Pa, poisson {:.4}", achieved.bounding_modulus, achieved.bounding_poisson);
    facts.add("with the bounding section", bounding);
    for part in [9, 3] {
        let smaller = make(largest / part)?;
        let response = elastic_response(&smaller, &found.beam, CylinderLoad::Tension)?;
        let name = format!("{} spheres", smaller.spheres.len());
        facts.add(&name, format!("young {:.5e} Pa, poisson {:.4}", response.modulus, response.poisson));
    }
    meter.finish();
    let mut text = scenario_text(&sample, None, &found.beam, criterion, density, CylinderLoad::Tension);
    if arguments.tensile_strength.is_none() {
        text = text
            .lines()
            .filter(|line| !line.starts_with("tensile_strength"))
            .fold(String::new(), |all, line| all + line + "\n");
    }
    Ok((facts, text))
}

fn sample_facts(sample: &CylinderSpecimen) -> String {
    format!(
        "{} spheres, solid fraction {:.4}, dispersion {}, {:.3} bonds per particle in the bulk",
        sample.spheres.len(),
        sample.solid_fraction,
        sample.recipe.dispersion,
        sample.coordination
    )
}
