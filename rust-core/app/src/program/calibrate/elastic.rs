//! `concordem calibrate elastic`: bond stiffnesses for target elastic constants.

use std::path::PathBuf;

use super::super::meter::Meter;
use super::super::settings::Settings;
use super::super::{Console, Facts, Failure, Work};
use super::elastic_search::{ElasticRequest, ElasticSearch, Spelling, calibrate_elastic};
use super::{positive, stress};
use crate::output::OutputError;
use crate::output::sealed::write_text;
use concordem_scenario::schema::{LawName, Scenario};

/// Arguments of `concordem calibrate elastic`.
#[derive(Debug, clap::Args)]
pub(super) struct CalibrateElasticArguments {
    /// Scenario with a periodic packing and one material; its stiffnesses are ignored. By default, with --law, 1000 equal
    /// spheres of radius 1 mm
    scenario: Option<PathBuf>,
    #[command(flatten)]
    settings: Settings,
    /// Target Young's modulus, "30 GPa"
    #[arg(long, value_name = "STRESS", value_parser = stress)]
    young: f64,
    /// Target Poisson's ratio
    #[arg(long, value_name = "NUMBER")]
    poisson: f64,
    /// Law of the bonds; by default that of the scenario. Missing parameters are filled in such that the bonds never
    /// break
    #[arg(long, value_enum)]
    law: Option<Law>,
    /// Use deformable particles; only for linear_bond
    #[arg(long)]
    deformable: bool,
    /// Poisson's ratio of deformable particles; by default the target one
    #[arg(long, value_name = "NUMBER", requires = "deformable")]
    particle_poisson: Option<f64>,
    /// Normal stiffness of a bond, divided by the mean radius (of discs: unit depth) and by Young's modulus of deformable
    /// particles; 0.2 by default
    #[arg(long, value_name = "NUMBER", requires = "deformable", value_parser = number)]
    particle_softness: Option<f64>,
    /// File for the scenario with the found parameters
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Overwrite an existing file
    #[arg(long, short)]
    force: bool,
    #[command(flatten)]
    work: Work,
}

/// Laws of bonds with elastic constants.
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
    /// Bond with tensile strength, cohesion, and friction
    #[value(name = "jointed")]
    Jointed,
}

impl From<Law> for LawName {
    fn from(law: Law) -> Self {
        match law {
            Law::Cpm => Self::Cpm,
            Law::LinearBond => Self::LinearBond,
            Law::CohesiveBeam => Self::CohesiveBeam,
            Law::Jointed => Self::Jointed,
        }
    }
}

fn number(text: &str) -> Result<f64, String> {
    positive(text.parse().map_err(|_| format!("`{text}` is not a number"))?)
}

pub(super) fn calibrate(arguments: &CalibrateElasticArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    if let Some(path) = arguments.output.as_ref().filter(|path| path.exists() && !arguments.force) {
        return Err(OutputError::Exists { path: path.clone() }.into());
    }
    let request = ElasticRequest {
        young: arguments.young,
        poisson: arguments.poisson,
        law: arguments.law.map(LawName::from),
        deformable: arguments.deformable,
        particle_poisson: arguments.particle_poisson,
        particle_softness: arguments.particle_softness,
        spelling: Spelling::Options,
    };
    let settings = &arguments.settings;
    if arguments.scenario.is_none() && !settings.is_empty() {
        return Err(Failure::Usage("--set changes keys of a scenario; give one, or use --law alone".into()));
    }
    let scenario = arguments.scenario.as_deref().map(|path| settings.read(path)).transpose()?;
    let folder = scenario.as_ref().map(Scenario::directory).unwrap_or_default();
    let display = console.display(&arguments.work);
    let found = arguments.work.install(|| {
        let meter = Meter::new(display);
        let found =
            calibrate_elastic(scenario.as_ref(), &folder, &request, &mut |stage, share| meter.stage(stage, share));
        meter.finish();
        found
    })?;
    let facts = facts(arguments, &found);
    if arguments.law.is_some() && found.scenario.contacts.law.law().is_none() {
        console.tell(
            "warning: contacts.law = \"none\": particles without a bond pass through each other. For contacts, write another law in \
             [contacts] with its table in [[material]].",
        );
    }
    let Some(path) = &arguments.output else {
        return console.print(&facts.to_string());
    };
    write_text(path, &found.scenario.source.text)?;
    console.print(&format!("{}\n{facts}", path.display()))
}

fn facts(arguments: &CalibrateElasticArguments, found: &ElasticSearch) -> Facts {
    let ElasticSearch { scenario, fit, parameters, spectral_radius } = found;
    let mut facts = Facts::default();
    for &(table, key, value) in parameters {
        match (table, key) {
            ("cpm", "young") => facts.add("young of the bonds", format!("{value:.8e} Pa")),
            ("cohesive_beam", "young") => facts.add("young of the beams", format!("{value:.8e} Pa")),
            ("cohesive_beam", "radius") => facts.add("radius of the beams", format!("{value:.8e} m")),
            ("linear_bond", _) => facts.add(key, format!("{value:.8e} N/m")),
            ("deformable", _) => {
                facts.add("young of the particles", format!("{value:.8e} Pa, proportional to normal_stiffness"));
                let poisson = scenario.materials[0].deformable.as_ref().map_or(f64::NAN, |table| table.poisson.si());
                facts.add("poisson of the particles", format!("{poisson}"));
            }
            _ => facts.add(key, format!("{value:.8}")),
        }
    }
    if let Some(spectral_radius) = spectral_radius {
        facts.add(
            "spectral radius",
            format!("{spectral_radius:.4} of the iteration between strains and forces; it converges below 1"),
        );
    }
    if let (Some(_), Some(bonds)) = (arguments.law, &scenario.bonds) {
        let many = bonds.coordination.map_or(format!("interaction ratio {}", bonds.interaction_ratio.si()), |number| {
            format!("{} per particle", number.si())
        });
        facts.add("bonds", many);
        facts.add("contacts", format!("law = \"{}\"", scenario.contacts.law.key()));
    }
    let achieved = &fit.achieved;
    facts.add(
        "achieved, static network",
        format!("young {:.6e} Pa, poisson {:.6}", achieved.mean_young, achieved.mean_poisson),
    );
    let anisotropy = achieved.anisotropy();
    facts.add("directions differ by", format!("{:.4} of E, {:.4} in poisson", anisotropy.young, anisotropy.poisson));
    facts.add("reach of this packing", format!("poisson {:.4} to {:.4}", fit.reach.0, fit.reach.1));
    if let Some((ratio, share)) = fit.prior {
        facts.add("closed form", format!("predicts shear_ratio {ratio:.5}, and {share:.4} of the target modulus"));
    }
    facts.add("excluded", format!("{} rattlers", fit.cell.loose.rattlers));
    facts
}
