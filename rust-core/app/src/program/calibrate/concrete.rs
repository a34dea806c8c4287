//! `concordem calibrate concrete`: stiffness and strengths of CPM concrete.

use std::path::{Path, PathBuf};
use std::time::Instant;

use super::super::drive::build;
use super::super::meter::Meter;
use super::super::readable::seconds;
use super::super::settings::Settings;
use super::super::{Console, Facts, Failure, Work};
use super::{elastic_failure, stress, table, with_values};
use crate::calibration::concrete::{
    ConcreteCalibration, ConcreteFit, ConcreteSpecimen, Scatter, SpecimenPair, StrengthTable, StrengthTargets,
};
use crate::calibration::elastic::{ElasticCalibrationError, ElasticFit, fit};
use crate::output::OutputError;
use crate::output::sealed::write_text;
use concordem_contact::law::Cpm;
use concordem_scenario::assembly::PackingCache;
use concordem_scenario::schema::quantity::{FractureEnergy, Number, StrainRate, Stress};
use concordem_scenario::schema::{LawName, Loading, Packing, ProblemKind, Scenario, Shape, Stop};
use concordem_solver::state::State;
use concordem_solver::state::contacts::ContactBlock;
use concordem_statics::{Accuracy, LinkNetwork};

/// Strain rate in compression over that in tension, as in the published tests; compression needs ten times the strain.
const COMPRESSION_RATE: f64 = 7.5;

/// Number of particles across a specimen below which strengths depend on its width.
const NARROW: f64 = 15.0;

/// Arguments of `concordem calibrate concrete`.
#[derive(Debug, clap::Args)]
pub(super) struct CalibrateConcreteArguments {
    /// Scenario of a specimen in uniaxial loading, cut from a random dense packing, with cpm bonds and one material; its
    /// friction and relative ductility are kept, its moduli and strengths are ignored
    scenario: PathBuf,
    #[command(flatten)]
    settings: Settings,
    /// Target Young's modulus, "30 GPa"
    #[arg(long, value_name = "STRESS", value_parser = stress)]
    young: f64,
    /// Target Poisson's ratio
    #[arg(long, value_name = "NUMBER")]
    poisson: f64,
    /// Target tensile strength, "3 MPa"
    #[arg(long, value_name = "STRESS", value_parser = stress)]
    tensile_strength: f64,
    /// Target compressive strength, positive, "30 MPa"
    #[arg(long, value_name = "STRESS", value_parser = stress)]
    compressive_strength: f64,
    /// Target energy dissipated in tension per cross-section until the stress has fallen to a tenth of its peak, J/m^2; by
    /// default, the relative ductility of the scenario is kept. If the scenario gives bonds a fracture energy, this energy of the bonds is found
    #[arg(long, value_name = "NUMBER", value_parser = energy)]
    fracture_energy: Option<f64>,
    /// Number of packings, for the scatter; their seeds count up from the seed of the scenario
    #[arg(long, value_name = "NUMBER", default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..=100))]
    seeds: u64,
    /// File that stores measured values for reuse; by default SCENARIO.strengths.json
    #[arg(long, value_name = "FILE")]
    table: Option<PathBuf>,
    /// File for the scenario with the found parameters
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Overwrite an existing file
    #[arg(long, short)]
    force: bool,
    #[command(flatten)]
    work: Work,
}

fn energy(text: &str) -> Result<f64, String> {
    super::positive(text.parse().map_err(|_| format!("`{text}` is not a number in J/m²"))?)
}

pub(super) fn calibrate(arguments: &CalibrateConcreteArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    if let Some(path) = arguments.output.as_ref().filter(|path| path.exists() && !arguments.force) {
        return Err(OutputError::Exists { path: path.clone() }.into());
    }
    let scenario = arguments.settings.read(&arguments.scenario)?;
    fitting(&scenario, arguments)?;
    let table_path = arguments.table.clone().unwrap_or_else(|| arguments.scenario.with_extension("strengths.json"));
    let cache = console.cache();
    let display = console.display(&arguments.work);
    let found = arguments.work.install(|| {
        let meter = Meter::new(display);
        let found = find(arguments, scenario.clone(), &table_path, cache.as_ref(), &meter);
        meter.finish();
        found
    })?;
    let facts = facts(arguments, &scenario, &found, &table_path);
    let Some(path) = &arguments.output else {
        return console.print(&facts.to_string());
    };
    let parameters = &found.fit.parameters;
    let mut keys = vec![
        ("cpm", "young", parameters.young.into()),
        ("cpm", "shear_ratio", parameters.shear_ratio.into()),
        ("cpm", "crack_onset_strain", parameters.crack_onset_strain.into()),
        ("cpm", "cohesion", parameters.cohesion.into()),
    ];
    keys.push(if parameters.fracture_energy > 0.0 {
        ("cpm", "fracture_energy", parameters.fracture_energy.into())
    } else {
        ("cpm", "relative_ductility", parameters.relative_ductility.into())
    });
    if parameters.soft_strain != 0.0 {
        keys.push(("cpm", "soft_strain", parameters.soft_strain.into()));
    }
    let text = with_values(&scenario, &keys).ok_or_else(|| {
        let message = "the material's table cannot be edited".to_owned();
        Failure::Scenario(scenario.problem(ProblemKind::Conflict, "material", message, "write it as [material.cpm]"))
    })?;
    write_text(path, &text)?;
    console.print(&format!("{}\n{facts}", path.display()))
}

/// Refuses a scenario without a suitable specimen.
fn fitting(scenario: &Scenario, arguments: &CalibrateConcreteArguments) -> Result<(), Failure> {
    let refuse = |key: &str, message: &str, help: &str| {
        Err(Failure::Scenario(scenario.problem(ProblemKind::Conflict, key, message.to_owned(), help)))
    };
    if scenario.bonds.as_ref().map(|bonds| bonds.law) != Some(LawName::Cpm) {
        return refuse("bonds", "strengths can be calibrated only for cpm bonds", "write law = \"cpm\"");
    }
    if scenario.materials.len() != 1 {
        let help = "keep one [[material]], and calibrate each phase separately";
        return refuse("material", "the scenario has several materials; only one can be calibrated at a time", help);
    }
    // Strengths are measured at one onset strain and scaled to others, which these do not follow.
    if let Some(cpm) = &scenario.materials[0].cpm {
        let absolute = [
            ("isotropic_prestress", cpm.isotropic_prestress.si() != 0.0),
            ("damage_time", cpm.damage_time.is_some()),
            ("plasticity_time", cpm.plasticity_time.is_some()),
        ];
        if let Some((key, _)) = absolute.into_iter().find(|(_, given)| *given) {
            let message = "does not scale with the strength, so the parameters would miss their targets";
            return refuse(&format!("material[0].cpm.{key}"), message, "remove it, and give it again afterwards");
        }
        if cpm.fracture_energy.is_some() && arguments.fracture_energy.is_none() {
            let message = "the fracture energy of bonds scales with the strength, so it needs a target";
            return refuse(
                "material[0].cpm.fracture_energy",
                message,
                "add --fracture-energy with the energy of the concrete in J/m^2",
            );
        }
    }
    if !matches!(scenario.loading, Loading::Uniaxial { .. }) {
        let help = "write kind = \"uniaxial\", as in `concordem init --template cpm-small`";
        return refuse("loading", "strengths are measured in uniaxial tension and compression", help);
    }
    if !matches!(scenario.packing, Packing::RandomDense { .. }) || scenario.packing.is_periodic() {
        let help = "write kind = \"random-dense\" with a box or cylinder under [packing.shape]";
        return refuse("packing", "the specimens are cut from random dense packings, one for each seed", help);
    }
    Ok(())
}

/// Results of both calibrations.
struct ConcreteResult {
    elastic: ElasticFit,
    fit: ConcreteFit,
    /// Number of particles across the specimen.
    width: f64,
    known: usize,
}

/// Number of measurements that a fit usually needs per packing: 42 with three packings of the template `cpm-small`.
const TYPICAL: usize = 14;

fn find(
    arguments: &CalibrateConcreteArguments,
    mut scenario: Scenario,
    table_path: &Path,
    cache: Option<&PackingCache>,
    meter: &Meter,
) -> Result<ConcreteResult, Failure> {
    let elastic = elastic(arguments, &scenario, cache, meter)?;
    let cpm = scenario.materials[0].cpm.as_mut().ok_or_else(|| Failure::Calibration("no cpm parameters".into()))?;
    cpm.shear_ratio = Number::new(elastic.shear_ratio);
    cpm.young = Stress::new(cpm.young.si() * elastic.normal_factor);
    let onset = cpm.crack_onset_strain.si();
    let mut pairs = Vec::new();
    let mut width = f64::INFINITY;
    for number in 0..arguments.seeds {
        let Packing::RandomDense { seed, .. } = &mut scenario.packing else { break };
        *seed += u64::from(number > 0);
        let seed = *seed;
        let tension = specimen(&scenario, 1.0, cache, meter)?;
        let compression = specimen(&scenario, -COMPRESSION_RATE, cache, meter)?;
        width = width.min(tension.area.sqrt() / (2.0 * mean_radius(&tension.state)));
        pairs.push(SpecimenPair { seed, tension, compression });
    }
    let base = law_of(&pairs[0].tension.state).ok_or_else(|| Failure::Calibration("no cpm bonds".into()))?;
    let table = table::read(table_path, described(&scenario)?)?;
    let known = table.values.len();
    let mut failed = None;
    let start = Instant::now();
    let mut report = |runs: usize, table: &StrengthTable| {
        let each = start.elapsed().as_secs_f64() / runs.max(1) as f64;
        let expected = TYPICAL * pairs.len();
        meter.stage_with("strengths", Some((runs as f64 / expected as f64).min(0.99)), || {
            let left = expected.saturating_sub(runs).max(1) as f64 * each;
            format!("measurement {runs} of usually {expected}, {} each, about {} left", seconds(each), seconds(left))
        });
        if failed.is_none() {
            failed = table::save(table_path, table).err();
        }
    };
    let wanted = StrengthTargets {
        tensile_strength: arguments.tensile_strength,
        compressive_strength: arguments.compressive_strength,
        fracture_energy: arguments.fracture_energy,
    };
    let with_energy = wanted.fracture_energy.is_some();
    let mut calibration = ConcreteCalibration::new(&pairs, base, onset, with_energy, table);
    calibration.on_measurement = Box::new(&mut report);
    let fit = calibration.fit(&wanted).map_err(|error| Failure::Calibration(error.to_string()))?;
    drop(calibration);
    if let Some(error) = failed {
        return Err(error.into());
    }
    Ok(ConcreteResult { elastic, fit, width, known })
}

/// Ē and Ḡ/Ē from the periodic packing of the specimen.
fn elastic(
    arguments: &CalibrateConcreteArguments,
    scenario: &Scenario,
    cache: Option<&PackingCache>,
    meter: &Meter,
) -> Result<ElasticFit, Failure> {
    let mut periodic = scenario.clone();
    if let Packing::RandomDense { shape, .. } = &mut periodic.packing {
        *shape = Shape::Periodic { tiles: [1; 3] };
    }
    periodic.loading = Loading::None;
    let assembly = build(&periodic, cache, meter)?;
    let network = LinkNetwork::of_state(&assembly.state).map_err(ElasticCalibrationError::from);
    network
        .and_then(|network| {
            fit(&network, arguments.young, arguments.poisson, Accuracy::default(), &mut |solutions| {
                meter.stage("statics", (solutions as f64 / 14.0).min(0.99));
            })
        })
        .map_err(|error| elastic_failure(scenario, error))
}

/// A run ends when the stress falls (see [`ConcreteSpecimen::load`]), or at a strain that no specimen survives. The stop
/// conditions of the scenario are ignored: an equilibrium, for example, may occur long before the peak.
fn stop() -> Stop {
    Stop { strain: Some(Number::new(0.1)), ..Stop::default() }
}

/// The specimen of a scenario, loaded at the rate of the scenario times `factor`.
fn specimen(
    scenario: &Scenario,
    factor: f64,
    cache: Option<&PackingCache>,
    meter: &Meter,
) -> Result<ConcreteSpecimen, Failure> {
    let mut scenario = scenario.clone();
    if let Loading::Uniaxial { strain_rate, .. } = &mut scenario.loading {
        *strain_rate = StrainRate::new(strain_rate.si().abs() * factor);
    }
    scenario.stop = stop();
    let assembly = build(&scenario, cache, meter)?;
    let area = assembly.summary.specimen.map_or(f64::NAN, |(area, _)| area);
    Ok(ConcreteSpecimen { state: assembly.state, model: assembly.model, schedule: assembly.schedule, area })
}

fn law_of(state: &State) -> Option<concordem_contact::law::CpmParameters> {
    let mut blocks = state.bonds.iter();
    let block = blocks.find_map(|block| block.as_any().downcast_ref::<ContactBlock<Cpm>>())?;
    block.rows.first().map(|row| *row.parameters())
}

fn mean_radius(state: &State) -> f64 {
    let radii = &state.particles.radius;
    radii.iter().sum::<f64>() / radii.len() as f64
}

/// Identity of a table: that of the scenario without what the table's arguments replace.
fn described(scenario: &Scenario) -> Result<String, Failure> {
    let mut described = scenario.clone();
    if let Some(cpm) = &mut described.materials[0].cpm {
        cpm.cohesion = Stress::new(0.0);
        cpm.relative_ductility = cpm.relative_ductility.map(|_| Number::new(1.0));
        cpm.fracture_energy = cpm.fracture_energy.map(|_| FractureEnergy::new(1.0));
        (cpm.friction_angle, cpm.friction_coefficient) = (None, None);
    }
    described.stop = stop();
    table::described(&described)
}

fn facts(arguments: &CalibrateConcreteArguments, scenario: &Scenario, found: &ConcreteResult, table: &Path) -> Facts {
    let ConcreteResult { elastic, fit, width, known } = found;
    let p = &fit.parameters;
    let mut facts = Facts::default();
    facts.add("young of the bonds", format!("{:.6e} Pa", p.young));
    facts.add("shear_ratio", format!("{:.6}", p.shear_ratio));
    facts.add("crack_onset_strain", format!("{:.5e}", p.crack_onset_strain));
    if p.fracture_energy > 0.0 {
        facts.add("fracture_energy of the bonds", format!("{:.5e} J/m²", p.fracture_energy));
    } else {
        facts.add("relative_ductility", format!("{:.5}", p.relative_ductility));
    }
    let sure = fit
        .cohesion_deviation
        .map_or_else(String::new, |d| format!(" ± {:.0} % from the scatter of packings", 100.0 * d));
    facts.add("cohesion", format!("{:.5e} Pa{sure}", p.cohesion));
    facts.add("friction_coefficient", format!("{:.5} (from the scenario)", p.friction_coefficient));
    let achieved = &elastic.achieved;
    facts.add(
        "achieved, periodic packing",
        format!("young {:.6e} Pa, poisson {:.6}", achieved.mean_young, achieved.mean_poisson),
    );
    let several = arguments.seeds > 1;
    let row = |s: &Scatter| {
        if several { format!("{:.4e} ± {:.1e}", s.mean, s.deviation) } else { format!("{:.4e}", s.mean) }
    };
    facts.add(
        "achieved, tension",
        format!("{} Pa, target {:.4e}", row(&fit.tensile_strength), arguments.tensile_strength),
    );
    facts.add(
        "achieved, compression",
        format!("{} Pa, target {:.4e}", row(&fit.compressive_strength), arguments.compressive_strength),
    );
    facts.add("modulus of the specimen", format!("{} Pa, including its ends", row(&fit.young)));
    if let (Some(energy), Some(wanted)) = (&fit.fracture_energy, arguments.fracture_energy) {
        facts.add("fracture energy", format!("{} J/m², target {wanted:.4e}", row(energy)));
    }
    facts.add("reach of f_c/f_t", format!("{:.3} to {:.3} at this friction and ductility", fit.reach.0, fit.reach.1));
    facts.add("reach of poisson", format!("{:.4} to {:.4}", elastic.reach.0, elastic.reach.1));
    facts.add(
        "packings",
        format!(
            "{}, from seed {}{}",
            arguments.seeds,
            first_seed(scenario),
            if several { "; ± is the standard deviation of one packing" } else { "; scatter unknown" }
        ),
    );
    facts.add("pairs of runs", format!("{} new, {known} known before ({})", fit.runs, table.display()));
    if *width < NARROW {
        facts.add(
            "size",
            format!("{width:.1} particles across; below {NARROW}, strengths depend on the size of the specimen"),
        );
    }
    facts
}

fn first_seed(scenario: &Scenario) -> u64 {
    if let Packing::RandomDense { seed, .. } = &scenario.packing { *seed } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::concrete::StrengthFunctions;
    use crate::provenance;

    /// Scenario of a small specimen, with the additional text `more`.
    fn scenario(more: &str) -> Scenario {
        let template =
            concordem_scenario::schema::TEMPLATES.iter().find(|template| template.name == "cpm-small").unwrap();
        let text = template
            .text
            .replace("count = 500", "count = 60")
            .replace("\"15 mm\", \"15 mm\", \"30 mm\"", "\"7 mm\", \"7 mm\", \"18 mm\"");
        Scenario::parse("specimen.toml", &format!("{text}\n{more}")).unwrap_or_else(|error| panic!("{error}"))
    }

    fn text_of(more: &str) -> String {
        described(&scenario(more)).unwrap_or_else(|_| panic!("{more} has no description"))
    }

    /// Any change to the specimen, its motion, or the program requires another table; changes that do not affect the runs do
    /// not.
    #[test]
    fn values_of_another_specimen_are_not_reused() {
        let set = "[[set]]\nname = \"some\"\nselection = { kind = \"ids\", ids = [20, 21] }\n";
        let of_set = |more: &str| format!("{set}{more}");
        let plain = text_of("");
        let cases = [
            of_set(""),
            of_set("[[prescribe]]\nset = \"some\"\nvelocity = [0, \"free\", \"free\"]\n"),
            of_set("[[force]]\nset = \"some\"\nforce = [1, 0, 0]\n"),
            of_set("[[initial]]\nset = \"some\"\nvelocity = [1, 0, 0]\n"),
            of_set("[[clump]]\nset = \"some\"\n"),
            "[[wall]]\nmaterial = \"concrete\"\nshape = { kind = \"plane\", point = [0, 0, -1], normal = [0, 0, 1] }\n"
                .into(),
            "[[clump]]\nspheres = [[1, 0, 0, 1e-3], [1.001, 0, 0, 1e-3]]\n".into(),
        ];
        let mut texts: Vec<String> = cases.iter().map(|case| text_of(case)).collect();
        texts.push(plain.clone());
        for (k, text) in texts.iter().enumerate() {
            assert!(!texts[..k].contains(text), "the same table for two specimens: {:?}", cases.get(k));
        }
        assert!(plain.contains(provenance::PROGRAM) && plain.contains(provenance::COMMIT));
        let change = |from: &str, to: &str| {
            let other = scenario("");
            let text = other.source.text.replace(from, to);
            assert!(text != *other.source.text, "{from} is not in the template");
            described(&Scenario::parse("specimen.toml", &text).unwrap()).ok().unwrap()
        };
        assert_ne!(
            change("sample_interval = 10 ", "sample_interval = 5 "),
            plain,
            "the sample interval affects the peaks"
        );
        for (from, to) in [
            ("Small concrete prism", "The same prism"),
            ("seed = 1 ", "seed = 7 "),
            ("cohesion = \"3 MPa\"", "cohesion = \"4 MPa\""),
            ("steps = 20_000", "unbalanced = 0.1"),
            ("snapshot_interval = 2_000", "snapshot_interval = 300"),
        ] {
            assert_eq!(change(from, to), plain, "{to}");
        }
    }

    /// Saved values are read back bit for bit; 1.0005465138252987 and similar numbers used to change in the last digit.
    #[test]
    fn tables_are_read_back_bit_for_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("table.json");
        let values = (0..2000).map(|k| {
            let value = 1.0 + f64::from(k).sqrt() * 1.234_567_89e-5;
            let functions =
                StrengthFunctions { stiffness: value, tension: value / 3.0, ratio: 1.0 / value, dissipation: None };
            (format!("{k}"), functions)
        });
        let table = StrengthTable { specimen: "a specimen".into(), values: values.collect() };
        table::save(&path, &table).ok().unwrap();
        assert!(table::read(&path, "a specimen".into()).ok().unwrap() == table);
    }

    /// The identity of the table includes the content of surface files.
    #[test]
    fn files_of_surfaces_belong_to_the_specimen() {
        let folder = tempfile::tempdir().unwrap();
        let wall = "[[wall]]\nmaterial = \"concrete\"\nshape = { kind = \"facets\", path = \"wall.stl\" }\n";
        let name = folder.path().join("specimen.toml").display().to_string();
        let scenario = Scenario::parse(&name, &format!("{}\n{wall}", scenario("").source.text)).unwrap();
        let with = |content: &str| {
            std::fs::write(folder.path().join("wall.stl"), content).unwrap();
            described(&scenario).ok().unwrap()
        };
        assert_ne!(with("one"), with("two"));
    }

    /// A stop condition `unbalanced` that holds at every step does not end a strength run before its peak.
    #[test]
    fn strength_runs_ignore_the_stop_conditions_of_the_scenario() {
        let scenario = scenario("");
        let text = scenario.source.text.replace("steps = 20_000", "unbalanced = 1e6");
        let scenario = Scenario::parse("specimen.toml", &text).unwrap();
        let Ok(specimen) = specimen(&scenario, 1.0, None, &Meter::new(crate::program::meter::Display::Nothing)) else {
            panic!("no specimen")
        };
        let parameters = law_of(&specimen.state).unwrap();
        let strength = specimen.load(&parameters, 0.3).unwrap().expect("the stress falls before the run ends");
        assert!(strength.stress > 1e6, "{strength:?}");
    }
}
