//! `concordem info`: contents of a result file.

use std::path::PathBuf;
use std::time::SystemTime;

use super::drive::scenario_instead;
use super::readable::{count, seconds};
use super::{Console, Facts, Failure};
use crate::output::run_files::{Unfinished, look};
use crate::output::{OutputError, ResultFile, checkpoint, csv};
use crate::report::summary;
use concordem_scenario::schema::Scenario;
use concordem_solver::state::columns::{ColumnData, StoredColumn};

/// Arguments of `concordem info`.
#[derive(Debug, clap::Args)]
pub(super) struct InfoArguments {
    /// Result or checkpoint
    file: PathBuf,
    /// Print only the hash of the state; equal hashes mean bitwise equal states
    #[arg(long, conflicts_with_all = ["scenario", "csv"])]
    hash: bool,
    /// Print only the scenario
    #[arg(long, conflicts_with = "csv")]
    scenario: bool,
    /// Print the time series and operator samples as comma-separated values
    #[arg(long)]
    csv: bool,
}

pub(super) fn info(arguments: &InfoArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    scenario_instead(&arguments.file)?;
    if !arguments.file.is_file()
        && let Some(run) = look(&arguments.file)?
    {
        return info_of_unfinished(arguments, &run, console);
    }
    let result = match ResultFile::open(&arguments.file) {
        Err(OutputError::Kind { .. }) if !arguments.csv => return info_of_checkpoint(arguments, console),
        other => other?,
    };
    if arguments.hash {
        return console.print(&format!("{}\n", result.state_hash()?));
    }
    if arguments.scenario {
        return console.print(&result.scenario()?);
    }
    if arguments.csv {
        return console.print(&csv::text(&result)?);
    }
    let mut facts = Facts::default();
    let particles = result.rows("particles")?;
    if let Some((_, ids)) = particles.iter().find(|(name, _)| name == "id") {
        facts.add("particles", count(ids.borrow().len()));
    }
    add_phases(&mut facts, &result, &particles)?;
    for law in result.laws()? {
        let table = result.rows(&format!("contacts/{law}"))?;
        let rows = table.first().map_or(0, |(_, column)| column.borrow().len() / column.components.max(1));
        facts.add(&format!("contacts, {law}"), count(rows));
    }
    let mut samples = 0;
    for series in result.series() {
        let values = result.samples(&series.name)?;
        samples = values.len();
        // Omit stress and strain of runs without loading.
        let absent = ["strain", "stress"].contains(&&*series.name) && values.iter().all(|value| *value == 0.0);
        if absent {
            continue;
        }
        if let (Some(last), true) = (values.last(), ["time", "step", "strain", "stress"].contains(&&*series.name)) {
            let unit = if series.unit == "1" { String::new() } else { format!(" {}", series.unit) };
            let whole = last.fract() == 0.0 && last.abs() < 1e15;
            let last = if whole { format!("{last:.0}") } else { format!("{last:.6e}") };
            facts.add(&format!("last {}", series.name), format!("{last}{unit}"));
        }
        if series.name == "stress" {
            let peak = result
                .history(&series.name)?
                .iter()
                .copied()
                .fold(0.0_f64, |peak, x| if x.abs() > peak.abs() { x } else { peak });
            facts.add("peak stress", format!("{peak:.6e} Pa"));
        }
    }
    for property in summary(&result)? {
        facts.add(&property.symbol, property.value);
    }
    facts.add("samples", count(samples));
    facts.add("events", count(result.events()?.len()));
    facts.add("snapshots", count(result.snapshot_times()?.len()));
    facts.add("state hash", result.state_hash()?);
    for (name, value) in result.provenance()? {
        facts.add(&name.replace('_', " "), value);
    }
    console.print(&format!("{}: finished run\n{facts}", arguments.file.display()))
}

/// Particles by material, if there are several, and the number of aggregates with particles.
fn add_phases(facts: &mut Facts, result: &ResultFile, particles: &[(String, StoredColumn)]) -> Result<(), Failure> {
    let data = |name: &str| particles.iter().find(|(column, _)| column == name).map(|(_, column)| &column.data);
    let Some(ColumnData::U16(materials)) = data("material") else { return Ok(()) };
    let last = materials.iter().copied().max().unwrap_or(0);
    if last == 0 {
        return Ok(());
    }
    let scenario = toml::from_str::<toml::Table>(&result.scenario()?).unwrap_or_default();
    let name = |material: u16| {
        let table = scenario.get("material")?.get(usize::from(material))?;
        Some(table.get("name")?.as_str()?.to_owned())
    };
    for material in 0..=last {
        let own = materials.iter().filter(|&&one| one == material).count();
        facts.add(&format!("of \"{}\"", name(material).unwrap_or_else(|| material.to_string())), count(own));
    }
    if let Some(ColumnData::U32(numbers)) = data("aggregate") {
        let mut numbers: Vec<u32> = numbers.iter().copied().filter(|number| *number > 0).collect();
        numbers.sort_unstable();
        numbers.dedup();
        facts.add("aggregates", count(numbers.len()));
    }
    Ok(())
}

/// The state of a run that still goes on, or was interrupted.
fn info_of_unfinished(arguments: &InfoArguments, run: &Unfinished, console: &mut Console<'_>) -> Result<(), Failure> {
    let file = arguments.file.display();
    if arguments.hash || arguments.csv {
        return Err(Failure::Usage(format!("{file} is not finished; only its progress and its scenario can be shown")));
    }
    if arguments.scenario {
        return console.print(&run.header.scenario);
    }
    let mut facts = Facts::default();
    let state = if run.is_running { "running" } else { "interrupted; continue with `concordem resume`" };
    facts.add("state", state);
    let age = |time: Option<SystemTime>| time.and_then(|time| time.elapsed().ok()).map(|age| age.as_secs_f64());
    if let Some(age) = age(run.times[0]) {
        facts.add("begun", format!("{} ago", seconds(age)));
    }
    if let Some(age) = age(run.times[1]) {
        facts.add(
            "last written",
            format!("{} ago; a run writes every few seconds at first, later every minute", seconds(age)),
        );
    }
    for (series, unit) in [("step", ""), ("time", " s"), ("strain", ""), ("stress", " Pa")] {
        if let Some(value) = run.value(series) {
            let value = if series == "step" { count(value as usize) } else { format!("{value:.6e}") };
            facts.add(series, format!("{value}{unit}"));
        }
    }
    if let Some(share) = share_of(&run.header.scenario, |series| run.value(series)) {
        facts.add("done", format!("{:.0} %", 100.0 * share));
    }
    facts.add("samples", count(run.samples));
    for (name, value) in &run.header.provenance {
        facts.add(&name.replace('_', " "), value.clone());
    }
    console.print(&format!("{file}: unfinished run\n{facts}"))
}

/// Completed share of an unfinished run, by the stop condition nearest to being met. `last`: the last value of a series.
pub(super) fn share_of(scenario: &str, last: impl Fn(&str) -> Option<f64>) -> Option<f64> {
    let stop = Scenario::parse("run", scenario).ok()?.stop;
    let shares = [
        stop.steps.zip(last("step")).map(|(end, now)| now / end as f64),
        stop.time.zip(last("time")).map(|(end, now)| now / end.si()),
        stop.strain.zip(last("strain")).map(|(end, now)| now.abs() / end.si()),
    ];
    shares.into_iter().flatten().reduce(f64::max).map(|share| share.min(1.0))
}

fn info_of_checkpoint(arguments: &InfoArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    let checkpoint = checkpoint::read(&arguments.file)?;
    if arguments.hash {
        return console.print(&format!("{}\n", checkpoint.state_hash));
    }
    if arguments.scenario {
        return console.print(&checkpoint.provenance);
    }
    console.print(&format!(
        "{}: checkpoint\n  {:20}{}\n",
        arguments.file.display(),
        "state hash",
        checkpoint.state_hash
    ))
}
