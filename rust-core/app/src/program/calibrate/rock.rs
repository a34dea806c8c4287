//! `concordem calibrate rock`: moduli and strengths of jointed bonds or cohesive beams for target ones of a rock.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use super::super::drive::Interruption;
use super::super::meter::Meter;
use super::super::settings::Settings;
use super::super::{Console, Facts, Failure, Work};
use super::elastic_search::{ElasticRequest, ElasticSearch, Spelling, calibrate_elastic};
use super::table;
use super::{angle, stress};
use crate::calibration::concrete::Scatter;
use crate::calibration::measured::Measured;
use crate::calibration::peak::Peak;
use crate::calibration::rock::{BondStrengths, RockFit, RockStrengths, RockTargets, fit};
use crate::output::OutputError;
use crate::output::sealed::write_text;
use crate::side_by_side::side_by_side;
use concordem_scenario::assembly::{PackingCache, Placed, assemble_placed, place_cached};
use concordem_scenario::schedule::Simulation;
use concordem_scenario::schema::quantity::{Angle, Number, StrainRate, Stress};
use concordem_scenario::schema::{
    Component, Control, LawName, Loading, Packing, ProblemKind, Scenario, Stage, StageStop, Stop,
};

/// Strain rate in compression over that in tension: a rock bears ten times the strain in compression.
const COMPRESSION_RATE: f64 = 5.0;
/// Parts of the largest stress to which it falls at the end of a run, in tension and in compression.
const DROPS: [f64; 2] = [0.5, 0.85];
/// A run whose stress has not fallen ends at this multiple of the strain that an elastic rock has at its target strength: bonds that are so much
/// too strong need no more.
const LONGEST: f64 = 6.0;
/// Net forces over contact forces at which the lateral pressure counts as applied.
const UNBALANCED: f64 = 1e-2;
/// Confining pressure over compressive strength, by default.
const PRESSURE: f64 = 0.1;

/// Arguments of `concordem calibrate rock`.
#[derive(Debug, clap::Args)]
pub(super) struct CalibrateRockArguments {
    /// Scenario of a periodic cell under a stress, compressed along one axis, with jointed bonds or cohesive beams and one material, such
    /// as the template rock-triaxial; its moduli, strengths, stress, stages, and stop conditions are ignored
    scenario: PathBuf,
    #[command(flatten)]
    settings: Settings,
    /// Target Young's modulus, "69 GPa"
    #[arg(long, value_name = "STRESS", value_parser = stress)]
    young: f64,
    /// Target Poisson's ratio
    #[arg(long, value_name = "NUMBER")]
    poisson: f64,
    /// Target tensile strength, in direct tension, "9 MPa"; by default, the bonds keep their ratio of cohesion to tensile strength
    #[arg(long, value_name = "STRESS", value_parser = stress)]
    tensile_strength: Option<f64>,
    /// Target uniaxial compressive strength, positive, "200 MPa"
    #[arg(long, value_name = "STRESS", value_parser = stress)]
    compressive_strength: f64,
    /// Target angle of friction, "50 deg": of the line from the uniaxial strength to that under the confining pressure; by default, the
    /// friction of the bonds is kept
    #[arg(long, value_name = "ANGLE", value_parser = angle)]
    friction_angle: Option<f64>,
    /// Pressure at which the angle of friction is measured; by default a tenth of the compressive strength
    #[arg(long, value_name = "STRESS", value_parser = stress, requires = "friction_angle")]
    confining_pressure: Option<f64>,
    /// Number of packings, for the scatter; their seeds count up from the seed of the scenario
    #[arg(long, value_name = "NUMBER", default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..=100))]
    seeds: u64,
    /// Accept the nearest strengths if the targets are out of reach
    #[arg(long)]
    nearest: bool,
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

impl CalibrateRockArguments {
    fn targets(&self) -> RockTargets {
        let pressure = self.confining_pressure.map_or(PRESSURE, |p| p / self.compressive_strength);
        RockTargets {
            tensile_strength: self.tensile_strength,
            compressive_strength: self.compressive_strength,
            gain: self.friction_angle.map(|angle| ((1.0 + angle.sin()) / (1.0 - angle.sin()), pressure)),
        }
    }
}

pub(super) fn calibrate(arguments: &CalibrateRockArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    if let Some(path) = arguments.output.as_ref().filter(|path| path.exists() && !arguments.force) {
        return Err(OutputError::Exists { path: path.clone() }.into());
    }
    let scenario = arguments.settings.read(&arguments.scenario)?;
    let cell = Cell::of(&scenario)?;
    let path = arguments.table.clone().unwrap_or_else(|| arguments.scenario.with_extension("strengths.json"));
    let cache = console.cache();
    let interruption = Interruption::listen(console.host.as_ref());
    let display = console.display(&arguments.work);
    let (elastic, found, new) = arguments.work.install(|| {
        let meter = Meter::new(display);
        let result = find(arguments, &scenario, cell, &path, cache.as_ref(), &meter, &interruption.requested);
        meter.finish();
        result
    })?;
    drop(interruption);
    if !found.in_reach && !arguments.nearest {
        return Err(Failure::Calibration(out_of_reach(arguments, &found)));
    }
    let facts = facts(arguments, &elastic, &found, new, &path);
    let Some(output) = &arguments.output else {
        return console.print(&facts.to_string());
    };
    write_text(output, &written(&elastic.scenario, cell.law, &found.bonds)?)?;
    console.print(&format!("{}\n{facts}", output.display()))
}

/// The friction coefficient that a table gives as such or by its angle.
fn friction(coefficient: Option<Number>, angle: Option<Angle>) -> f64 {
    coefficient.map_or_else(|| libm::tan(angle.map_or(0.0, Angle::si)), Number::si)
}

fn given(tensile_strength: f64, cohesion: f64, friction: f64) -> BondStrengths {
    BondStrengths { tensile_strength, cohesion_ratio: cohesion / tensile_strength, friction }
}

/// How the cell of a scenario is loaded.
#[derive(Debug, Clone, Copy)]
struct Cell {
    law: LawName,
    axis: usize,
    /// Magnitude, 1/s.
    rate: f64,
    /// Strengths of the bonds.
    given: BondStrengths,
}

impl Cell {
    /// Refuses a scenario whose strengths cannot be found.
    fn of(scenario: &Scenario) -> Result<Self, Failure> {
        let refuse = |key: &str, message: &str, help: &str| {
            Err(Failure::Scenario(scenario.problem(ProblemKind::Conflict, key, message.to_owned(), help)))
        };
        let bonds = scenario.bonds.as_ref().map(|bonds| bonds.law);
        let Some(law @ (LawName::Jointed | LawName::CohesiveBeam)) = bonds else {
            let message = "strengths of rock can be calibrated only for jointed bonds and cohesive beams";
            return refuse("bonds", message, "write law = \"jointed\"");
        };
        let [material] = &scenario.materials[..] else {
            let help = "keep one [[material]], and calibrate each phase separately";
            return refuse(
                "material",
                "the scenario has several materials; only one can be calibrated at a time",
                help,
            );
        };
        let given = match (law, &material.jointed, &material.cohesive_beam) {
            (LawName::Jointed, Some(table), _) => {
                let friction = friction(table.friction_coefficient, table.friction_angle);
                given(table.tensile_strength.si(), table.cohesion.si(), friction)
            }
            (LawName::CohesiveBeam, _, Some(table)) => {
                if table.hydrostatic_strength.is_some() {
                    let message = "does not scale with the other strengths, so the parameters would miss their targets";
                    return refuse("material[0].cohesive_beam.hydrostatic_strength", message, "remove it");
                }
                let strength = |given: Option<Stress>| given.map_or(1.0, Stress::si);
                let friction = friction(table.friction_coefficient, table.friction_angle);
                given(strength(table.tensile_strength), strength(table.cohesion), friction)
            }
            _ => return refuse("material", "the material has no table of the law of the bonds", "add the table"),
        };
        if !(given.cohesion_ratio > 0.0 && given.cohesion_ratio.is_finite()) {
            let message = "tensile strength and cohesion must be positive: their ratio is where the search begins";
            return refuse("material", message, "write some, as in `concordem init --template rock-triaxial`");
        }
        let help = "write kind = \"cell-stress\" with one strain rate, as in `concordem init --template rock-triaxial`";
        let Loading::CellStress { strain_rate, .. } = &scenario.loading else {
            return refuse("loading", "strengths are measured in a periodic cell under stress", help);
        };
        let driven: Vec<(usize, f64)> =
            strain_rate.iter().enumerate().filter_map(|(axis, rate)| Some((axis, rate.si()?))).collect();
        let [(axis, rate)] = driven[..] else {
            return refuse("loading.strain_rate", "exactly one axis must have a strain rate", help);
        };
        if rate == 0.0 {
            return refuse("loading.strain_rate", "the strain rate is zero", help);
        }
        if !matches!(scenario.packing, Packing::RandomDense { .. }) {
            let help = "write kind = \"random-dense\" with a periodic shape";
            return refuse("packing", "strengths are measured on random dense packings, one for each seed", help);
        }
        Ok(Self { law, axis, rate: rate.abs(), given })
    }

    /// The scenario under a lateral pressure (Pa, positive), pulled or pressed.
    fn loaded(self, scenario: &Scenario, pressure: f64, pulls: bool, longest: f64) -> Scenario {
        let mut loaded = scenario.clone();
        let rate = if pulls { self.rate / COMPRESSION_RATE } else { -self.rate };
        if let Loading::CellStress { stress, strain_rate, .. } = &mut loaded.loading {
            for (i, row) in stress.iter_mut().enumerate() {
                for (j, value) in row.iter_mut().enumerate() {
                    *value = Stress::new(if i == j { -pressure } else { 0.0 });
                }
            }
            strain_rate[self.axis] = Component::Value(StrainRate::new(rate));
        }
        let drop_to = Some(Number::new(DROPS[usize::from(!pulls)]));
        let stage = |name: &str, control, stop| Stage {
            name: name.to_owned(),
            rate: Number::new(1.0),
            control,
            history: None,
            stop,
        };
        if pressure > 0.0 {
            let unbalanced = Some(Number::new(UNBALANCED));
            let consolidated = StageStop { unbalanced, ..StageStop::default() };
            let failed = StageStop { strain: Some(Number::new(-longest)), drop_to, ..StageStop::default() };
            loaded.stages =
                vec![stage("consolidate", Control::Stress, consolidated), stage("load", Control::StrainRate, failed)];
            loaded.stop = Stop::default();
        } else {
            loaded.stages.clear();
            loaded.stop = Stop { strain: Some(Number::new(longest)), drop_to, ..Stop::default() };
        }
        loaded
    }
}

/// One loading up to failure; whether the stress still rises at its end.
fn load(scenario: &Scenario, placed: &Placed, stopped: &AtomicBool) -> Result<Option<(Peak, bool)>, String> {
    let assembly =
        assemble_placed(scenario, &scenario.directory(), placed, &mut |_, _| {}).map_err(|e| e.to_string())?;
    let mut simulation =
        Simulation::new(assembly.state, assembly.model, assembly.schedule).map_err(|e| e.to_string())?;
    let mut samples = Vec::new();
    while simulation.stopped().is_none() {
        if stopped.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let advance = simulation.advance().map_err(|e| e.to_string())?;
        samples.extend(advance.sample);
        samples.extend(advance.last);
    }
    let (Some(last), peak) = (samples.last(), Peak::of(&samples)) else {
        return Err("the run has no sample; lower output.sample_interval".into());
    };
    Ok(Some((peak, last.stress.abs() > 0.95 * peak.stress.abs())))
}

/// Runs of packings, and what they have measured.
struct Laboratory<'a> {
    scenario: &'a Scenario,
    cell: Cell,
    placed: Vec<Placed>,
    targets: RockTargets,
    young: f64,
    path: &'a Path,
    meter: &'a Meter,
    stopped: &'a Arc<AtomicBool>,
}

impl Laboratory<'_> {
    /// Strengths of one packing; `None` if a signal comes first.
    fn strengths(&self, bonds: &BondStrengths, packing: usize) -> Result<Option<RockStrengths>, String> {
        let scenario = with_strengths(self.scenario, self.cell.law, bonds);
        let placed = &self.placed[packing];
        let run = |pressure: f64, pulls: bool, longest: f64| {
            load(&self.cell.loaded(&scenario, pressure, pulls, longest), placed, self.stopped)
        };
        let Some((pulled, pulled_rises)) = run(0.0, true, LONGEST * bonds.tensile_strength / self.young)? else {
            return Ok(None);
        };
        let [longest, longest_confined] = self.longest();
        let Some((pressed, pressed_rises)) = run(0.0, false, longest)? else { return Ok(None) };
        let strength = -pressed.stress;
        let (mut gain, mut confined_rises) = (0.0, false);
        if let Some((_, share)) = self.targets.gain {
            let pressure = share * strength;
            let Some((confined, rises)) = run(pressure, false, longest_confined)? else {
                return Ok(None);
            };
            gain = (-confined.stress - strength) / pressure;
            confined_rises = rises;
        }
        Ok(Some(RockStrengths {
            tension: pulled.stress / bonds.tensile_strength,
            ratio: strength / pulled.stress,
            gain,
            young: pressed.young,
            rises: pulled_rises || pressed_rises || confined_rises,
        }))
    }

    /// Strengths of all these, from the table or from runs side by side.
    fn measure(
        &self,
        jobs: &[(BondStrengths, usize)],
        table: &mut Measured<RockStrengths>,
    ) -> Result<Vec<RockStrengths>, Failure> {
        let keys: Vec<String> = jobs.iter().map(|(bonds, packing)| self.key(bonds, *packing)).collect();
        let missing: Vec<usize> = (0..jobs.len()).filter(|&k| !table.values.contains_key(&keys[k])).collect();
        let known = Mutex::new((table, 0_usize, None::<Failure>));
        side_by_side(missing.len(), |k| {
            let (bonds, packing) = &jobs[missing[k]];
            if self.stopped.load(Ordering::Relaxed) {
                return;
            }
            let found = self.strengths(bonds, *packing);
            let mut known = known.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            let (table, done, failure) = &mut *known;
            match found {
                Ok(None) => {}
                Ok(Some(strengths)) => {
                    table.values.insert(keys[missing[k]].clone(), strengths);
                    *done += 1;
                    self.meter.stage("strengths", *done as f64 / missing.len() as f64);
                    if let Err(error) = table::save(self.path, table) {
                        failure.get_or_insert(error.into());
                    }
                }
                Err(message) => {
                    failure.get_or_insert(Failure::Calibration(format!("{}: {message}", keys[missing[k]])));
                }
            }
        });
        let (table, _, failure) = known.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(failure) = failure {
            return Err(failure);
        }
        if self.stopped.load(Ordering::Relaxed) {
            let path = self.path.display();
            let message = format!("interrupted; measured values are saved in {path}; repeat the command to go on");
            return Err(Failure::Interrupted(message));
        }
        Ok(keys.iter().map(|key| table.values[key]).collect())
    }

    /// Strains at which runs in compression end, without and with the confining pressure.
    fn longest(&self) -> [f64; 2] {
        let free = LONGEST * self.targets.compressive_strength / self.young;
        [free, self.targets.gain.map_or(free, |(wanted, share)| free * (1.0 + wanted * share))]
    }

    /// A strength that is cut off at the longest strain is one of these targets, hence the strains belong to the key.
    fn key(&self, bonds: &BondStrengths, packing: usize) -> String {
        let BondStrengths { tensile_strength, cohesion_ratio, friction } = bonds;
        let pressure = self.targets.gain.map_or(0.0, |(_, share)| share);
        let [free, confined] = self.longest();
        format!(
            "seed {}, tensile strength {tensile_strength:.9e}, cohesion ratio {cohesion_ratio:.9e}, friction {friction:.9e}, \
             pressure ratio {pressure:.9e}, strains up to {free:.9e} and {confined:.9e}",
            first_seed(self.scenario) + packing as u64
        )
    }
}

/// Moduli, strengths, and the number of new measurements.
fn find(
    arguments: &CalibrateRockArguments,
    scenario: &Scenario,
    cell: Cell,
    path: &Path,
    cache: Option<&PackingCache>,
    meter: &Meter,
    stopped: &Arc<AtomicBool>,
) -> Result<(ElasticSearch, RockFit, usize), Failure> {
    let request = ElasticRequest {
        young: arguments.young,
        poisson: arguments.poisson,
        law: None,
        deformable: false,
        particle_poisson: None,
        particle_softness: None,
        spelling: Spelling::Options,
    };
    let folder = scenario.directory();
    let progress = &mut |stage: &str, share: f64| meter.stage(stage, share);
    let elastic = calibrate_elastic(Some(scenario), &folder, &request, progress)?;
    let mut placed = Vec::new();
    for number in 0..arguments.seeds {
        let mut other = elastic.scenario.clone();
        if let Packing::RandomDense { seed, .. } = &mut other.packing {
            *seed += number;
        }
        let made = place_cached(&other, &folder, cache, &mut |stage, share| meter.stage(stage, share));
        placed.push(made.map_err(|error| Failure::of_assembly(&other, error))?);
    }
    let targets = arguments.targets();
    let mut table = table::read(path, table::described(&neutral(&elastic.scenario, cell))?)?;
    let before = table.values.len();
    let laboratory =
        Laboratory { scenario: &elastic.scenario, cell, placed, targets, young: arguments.young, path, meter, stopped };
    let packings = laboratory.placed.len();
    let found = fit(&targets, &cell.given, packings, &mut |jobs| laboratory.measure(jobs, &mut table))?;
    Ok((elastic, found, table.values.len() - before))
}

/// The scenario without what the measurements replace.
fn neutral(scenario: &Scenario, cell: Cell) -> Scenario {
    let bonds = BondStrengths { tensile_strength: 1.0, cohesion_ratio: 1.0, friction: 0.0 };
    cell.loaded(&with_strengths(scenario, cell.law, &bonds), 0.0, false, 1.0)
}

/// The scenario with these strengths of its bonds.
fn with_strengths(scenario: &Scenario, law: LawName, bonds: &BondStrengths) -> Scenario {
    let mut scenario = scenario.clone();
    let tensile_strength = Stress::new(bonds.tensile_strength);
    let cohesion = Stress::new(bonds.cohesion_ratio * bonds.tensile_strength);
    let friction = Some(Number::new(bonds.friction));
    let material = &mut scenario.materials[0];
    match (law, &mut material.jointed, &mut material.cohesive_beam) {
        (LawName::Jointed, Some(table), _) => {
            (table.tensile_strength, table.cohesion) = (tensile_strength, cohesion);
            (table.friction_coefficient, table.friction_angle) = (friction, None);
        }
        (_, _, Some(table)) => {
            (table.tensile_strength, table.cohesion) = (Some(tensile_strength), Some(cohesion));
            (table.friction_coefficient, table.friction_angle) = (friction, None);
        }
        _ => {}
    }
    scenario
}

/// Text of the scenario with these strengths, with comments and order preserved.
fn written(scenario: &Scenario, law: LawName, bonds: &BondStrengths) -> Result<String, Failure> {
    let cohesion = bonds.cohesion_ratio * bonds.tensile_strength;
    let values = [
        (law.key(), "tensile_strength", bonds.tensile_strength.into()),
        (law.key(), "cohesion", cohesion.into()),
        (law.key(), "friction_coefficient", bonds.friction.into()),
    ];
    super::with_values_and_without(scenario, &values, &[(law.key(), "friction_angle")]).ok_or_else(|| {
        let message = "the material's table cannot be edited".to_owned();
        Failure::Scenario(scenario.problem(ProblemKind::Conflict, "material", message, "write it as [[material]]"))
    })
}

fn first_seed(scenario: &Scenario) -> u64 {
    if let Packing::RandomDense { seed, .. } = &scenario.packing { *seed } else { 0 }
}

/// Angle of friction of a gain, degrees.
fn angle_of(gain: f64) -> f64 {
    ((gain - 1.0) / (gain + 1.0)).asin().to_degrees()
}

fn out_of_reach(arguments: &CalibrateRockArguments, found: &RockFit) -> String {
    let targets = arguments.targets();
    let mut parts = vec!["out of reach of this packing".to_owned()];
    if let Some(wanted) = targets.ratio() {
        let (least, most) = found.ratios;
        let nearest = found.reached.ratio.mean;
        parts.push(format!(
            "Wanted f_c/f_t = {wanted:.2}, the nearest is {nearest:.2}; cohesions of 0.5 to 40.5 times the tensile strength give \
             {least:.2} to {most:.2}"
        ));
    }
    if let Some((gain, _)) = targets.gain {
        let (least, most) = found.gains;
        let [wanted, nearest, least, most] = [gain, found.reached.gain.mean, least, most].map(angle_of);
        let at_ratio = found.gains_at_ratio.map_or_else(String::new, |(least, most)| {
            format!(", and at the wanted f_c/f_t {:.1}° to {:.1}°", angle_of(least), angle_of(most))
        });
        parts.push(format!(
            "Wanted angle of friction {wanted:.1}°, the nearest is {nearest:.1}°; frictions of 0 to 2 give {least:.1}° to \
             {most:.1}°{at_ratio}"
        ));
    }
    if targets.tensile_strength.is_some() {
        let more = "A larger bonds.interaction_ratio and a lower --poisson raise f_c/f_t";
        parts.push(format!("{more}. Omit --tensile-strength to meet the compressive strength alone"));
    }
    parts.push("--nearest accepts the nearest strengths".to_owned());
    parts.join(". ")
}

fn facts(
    arguments: &CalibrateRockArguments,
    elastic: &ElasticSearch,
    found: &RockFit,
    new: usize,
    table: &Path,
) -> Facts {
    let mut facts = Facts::default();
    for (_, key, value) in &elastic.parameters {
        facts.add(key, format!("{value:.6e}"));
    }
    let BondStrengths { tensile_strength, cohesion_ratio, friction } = found.bonds;
    facts.add("tensile_strength", format!("{tensile_strength:.5e} Pa"));
    facts.add("cohesion", format!("{:.5e} Pa", cohesion_ratio * tensile_strength));
    let kept = if arguments.friction_angle.is_none() { " (from the scenario)" } else { "" };
    facts.add("friction_coefficient", format!("{friction:.5}{kept}"));
    let cell = &elastic.fit.achieved;
    facts.add("reached, elastic", format!("young {:.5e} Pa, poisson {:.4}", cell.mean_young, cell.mean_poisson));
    let reached = &found.reached;
    let several = arguments.seeds > 1;
    let shown = |s: &Scatter, factor: f64, digits: usize| {
        let [mean, deviation] = [s.mean * factor, s.deviation * factor];
        if several { format!("{mean:.digits$} ± {deviation:.digits$}") } else { format!("{mean:.digits$}") }
    };
    let target = |wanted: Option<f64>| wanted.map_or_else(String::new, |wanted| format!(", target {wanted:.3}"));
    let tension = shown(&reached.tension, 1e-6 * tensile_strength, 3);
    facts.add("reached, tension", format!("{tension} MPa{}", target(arguments.tensile_strength.map(|f| 1e-6 * f))));
    let ratio = shown(&reached.ratio, 1.0, 3);
    facts.add("reached, f_c/f_t", format!("{ratio}{}", target(arguments.targets().ratio())));
    let compression = 1e-6 * reached.ratio.mean * reached.tension.mean * tensile_strength;
    facts.add(
        "reached, compression",
        format!("{compression:.2} MPa, target {:.2}", 1e-6 * arguments.compressive_strength),
    );
    if let Some((gain, share)) = arguments.targets().gain {
        let pressure = 1e-6 * share * arguments.compressive_strength;
        facts.add(
            "reached, angle of friction",
            format!(
                "{:.2}° at {pressure:.2} MPa (gain {}), target {:.2}°",
                angle_of(reached.gain.mean),
                shown(&reached.gain, 1.0, 3),
                angle_of(gain)
            ),
        );
    }
    facts.add("modulus in compression", format!("{} GPa", shown(&reached.young, 1e-9, 2)));
    if !found.meets() {
        let [ratio, gain] = found.errors.map(|error| 100.0 * error);
        let why = if found.in_reach {
            "packings break by jumps; more seeds, or more particles, come closer"
        } else {
            "out of reach; the nearest strengths"
        };
        facts.add("missed", format!("f_c/f_t by {ratio:+.1} %, gain by {gain:+.1} %: {why}"));
    }
    if reached.rising > 0 {
        facts.add(
            "warning",
            format!("{} packings had a run whose stress never fell: it is no strength", reached.rising),
        );
    }
    facts.add("reach of f_c/f_t", format!("{:.2} to {:.2}", found.ratios.0, found.ratios.1));
    if arguments.friction_angle.is_some() {
        let (least, most) = found.gains;
        facts.add("reach of the angle", format!("{:.1}° to {:.1}°", angle_of(least), angle_of(most)));
    }
    let [ratio, gain] = found.accepted.map(|error| 100.0 * error);
    facts.add("accepted errors", format!("f_c/f_t {ratio:.1} %, gain {gain:.1} %"));
    facts.add("measurements", format!("{new} new ({})", table.display()));
    facts
}
