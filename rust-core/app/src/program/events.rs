//! `concordem events`: cracks by mode, acoustic emission, b-value.

use std::fmt::Write as _;
use std::path::PathBuf;

use super::drive::open_result;
use super::readable::{count, seconds};
use super::{Console, Facts, Failure};
use crate::output::{OutputError, ResultFile};
use concordem_operator::acoustic::{BValue, Break, Emission, b_value, emissions};
use concordem_scenario::schema::Scenario;
use concordem_scenario::schema::quantity::{Length, Time};
use concordem_solver::fracture::Event;
use concordem_solver::state::columns::ColumnData;

/// Arguments of `concordem events`.
#[derive(Debug, clap::Args)]
pub(super) struct EventsArguments {
    /// Result file
    file: PathBuf,
    /// Largest distance of breaks of one emission: "2 mm"; by default the mean diameter of the particles
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    distance: Option<Length>,
    /// Longest time between breaks of one emission: "1 us"; by default the distance over the speed √(E/ρ) of the material of the bonds
    #[arg(long, value_name = "TIME", value_parser = time)]
    duration: Option<Time>,
    /// Magnitude from which on emissions count for the b-value; by default the most frequent one and 0.2 more
    #[arg(long, value_name = "M", value_parser = magnitude, allow_negative_numbers = true)]
    completeness: Option<f64>,
    /// Print the emissions as comma-separated values
    #[arg(long)]
    csv: bool,
}

fn length(text: &str) -> Result<Length, String> {
    positive(text, Length::parse(text).map_err(|error| error.to_string())?, |length| length.si())
}

fn time(text: &str) -> Result<Time, String> {
    positive(text, Time::parse(text).map_err(|error| error.to_string())?, |time| time.si())
}

fn magnitude(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "write a number".to_owned())?;
    if value.is_finite() { Ok(value) } else { Err("must be finite".into()) }
}

fn positive<Q>(text: &str, quantity: Q, si: fn(&Q) -> f64) -> Result<Q, String> {
    let value = si(&quantity);
    if value > 0.0 && value.is_finite() { Ok(quantity) } else { Err(format!("{text} must be positive")) }
}

pub(super) fn events(arguments: &EventsArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    let result = open_result(&arguments.file)?;
    let events = result.events()?;
    let scenario = Scenario::parse(&arguments.file.display().to_string(), &result.scenario()?)?;
    let distance = match arguments.distance {
        Some(length) => length.si(),
        None => mean_diameter(&result)?,
    };
    let Some(duration) = arguments.duration.map(Time::si).or_else(|| wave_time(&scenario, distance)) else {
        let message = "the law of the bonds has no modulus, from which a speed of waves would follow; give --duration, such as \
                       --duration \"1 us\": the time that a wave takes through a source";
        return Err(Failure::Usage(message.into()));
    };
    let breaks: Vec<Break> = events.iter().map(break_of).collect();
    let found = emissions(&breaks, distance, duration)
        .map_err(|error| Failure::Usage(format!("{}: events: {error}", arguments.file.display())))?;
    if arguments.csv {
        return console.print(&table(&found));
    }
    let magnitudes: Vec<f64> = found.iter().map(Emission::magnitude).collect();
    let law = b_value(&magnitudes, arguments.completeness);
    let rule = format!("within {distance:.3e} m and {}", seconds(duration));
    console.print(&format!("{}\n{}", arguments.file.display(), facts(&events, &found, &rule, law)))
}

fn break_of(event: &Event) -> Break {
    let [_, shear, _, twist] = event.mode_shares;
    Break { time: event.time, position: event.position, energy: event.energy.max(0.0), shear_share: shear + twist }
}

/// Mean diameter of the particles, m.
fn mean_diameter(result: &ResultFile) -> Result<f64, OutputError> {
    let columns = result.rows("particles")?;
    let radii = columns.iter().find(|(name, _)| name == "radius").map(|(_, column)| &column.data);
    let Some(ColumnData::F64(radii)) = radii else { return Ok(f64::NAN) };
    Ok(2.0 * radii.iter().sum::<f64>() / radii.len() as f64)
}

/// Time that a longitudinal wave in the first material with bonds takes for a distance (m), s.
fn wave_time(scenario: &Scenario, distance: f64) -> Option<f64> {
    let law = scenario.bonds.as_ref()?.law;
    let material = scenario.materials.iter().find(|material| material.has(law))?;
    let modulus = material.table_of(law)?.modulus()?;
    Some(distance / (modulus / material.density.si()).sqrt())
}

fn facts(events: &[Event], found: &[Emission], rule: &str, law: Option<BValue>) -> String {
    let mut facts = Facts::default();
    let broken: Vec<&Event> = events.iter().filter(|event| event.damage >= 1.0).collect();
    let sheared = |event: &&&Event| break_of(event).shear_share > 0.5;
    let by_shear = broken.iter().filter(sheared).count();
    facts.add("broken bonds", count(broken.len()));
    facts.add("  in tension and bending", count(broken.len() - by_shear));
    facts.add("  in shear and twist", count(by_shear));
    if broken.len() < events.len() {
        facts.add("damaged bonds", count(events.len() - broken.len()));
    }
    if found.is_empty() {
        return facts.to_string();
    }
    facts.add("emissions", format!("{}, of breaks {rule}", count(found.len())));
    let most = found.iter().map(|event| event.breaks).max().unwrap_or(0);
    facts.add("  breaks of the largest", count(most));
    let energy: f64 = found.iter().map(|event| event.energy).sum();
    facts.add("  energy", format!("{energy:.4e} J"));
    let magnitudes = || found.iter().map(Emission::magnitude).filter(|magnitude| magnitude.is_finite());
    let (least, greatest) =
        magnitudes().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), m| (low.min(m), high.max(m)));
    if least <= greatest {
        facts.add("  magnitudes", format!("{least:.2} to {greatest:.2}"));
    }
    match law {
        Some(BValue { b, error, completeness, count: number }) => {
            let counting = format!("{} emissions from magnitude {completeness:.2} on", count(number));
            facts.add("b-value", format!("{b:.3} ± {error:.3}, {counting}"));
        }
        None => facts.add("b-value", "too few emissions"),
    }
    let gradual = events.iter().any(|event| event.damage < 1.0);
    let note = if gradual {
        "\n  Bonds soften gradually here. The energy of an event is that of one step, and magnitudes say little.\n"
    } else {
        ""
    };
    format!("{facts}{note}")
}

/// Emissions, one per line.
fn table(found: &[Emission]) -> String {
    let mut text = "time [s],duration [s],x [m],y [m],z [m],breaks,energy [J],magnitude,shear_share\n".to_owned();
    for event in found {
        let Emission { time, duration, position: x, breaks, energy, shear_share } = event;
        let _ = writeln!(
            text,
            "{time:e},{duration:e},{:e},{:e},{:e},{breaks},{energy:e},{},{shear_share}",
            x.x,
            x.y,
            x.z,
            event.magnitude()
        );
    }
    text
}
