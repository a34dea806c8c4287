//! `concordem events`: cracks by mode, their area, width, and direction; acoustic emission, b-value, and memory of the load.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::ValueEnum;

use super::readable::count;
use super::so_far::open_result;
use super::{Console, Facts, Failure};
use crate::output::ResultFile;
use crate::output::crack_faces::{CrackFace, CrackFaces};
use crate::signals::emission::{Rule, is_gradual, is_sheared, once_per_bond};
use concordem_contact::math::Vec3;
use concordem_operator::OperatorError;
use concordem_operator::acoustic::load::{Reloading, cumulative, reloadings};
use concordem_operator::acoustic::{BValue, Emission, b_value};
use concordem_operator::crack_directions::{crack_directions, rose};
use concordem_scenario::schema::Scenario;
use concordem_scenario::schema::quantity::{Length, Time};
use concordem_solver::fracture::Event;

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
    #[arg(long, value_name = "M", value_parser = magnitude)]
    completeness: Option<f64>,
    /// Series of the result that is the load; by default "stress"
    #[arg(long, value_name = "SERIES")]
    load: Option<String>,
    /// Fall of the load, as a share of the largest one, from which on the specimen is unloaded; by default 0.1
    #[arg(long, value_name = "SHARE", value_parser = share)]
    unloading: Option<f64>,
    /// Which emission of a reloading shows that emission begins again; by default the first
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    onset: Option<u32>,
    /// Also area, width, and direction of the cracks, from the faces between the particles
    #[arg(long)]
    faces: bool,
    /// Axis across the plane of the rose; by default z
    #[arg(long, value_enum, value_name = "AXIS")]
    across: Option<Axis>,
    /// Print comma-separated values: emissions, or another table
    #[arg(long, value_enum, value_name = "TABLE", num_args = 0..=1, require_equals = true, default_missing_value = "emissions")]
    csv: Option<Table>,
}

/// An axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Axis {
    X,
    Y,
    Z,
}

/// A table of comma-separated values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Table {
    /// One line per emission
    Emissions,
    /// Strain, load, emissions so far and their energy, at each record of the run
    Load,
    /// One line per broken bond: place, area, normal, opening, slip, mode, time
    Faces,
    /// Area of the cracks by the angle of their normal in a plane
    Rose,
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

fn share(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "write a number".to_owned())?;
    if value > 0.0 && value < 1.0 { Ok(value) } else { Err("must lie between 0 and 1".into()) }
}

fn positive<Q>(text: &str, quantity: Q, si: fn(&Q) -> f64) -> Result<Q, String> {
    let value = si(&quantity);
    if value > 0.0 && value.is_finite() { Ok(quantity) } else { Err(format!("{text} must be positive")) }
}

/// Fall of the load from which on a specimen is unloaded.
const UNLOADING: f64 = 0.1;

/// Bins of a rose, 7.5° each: multiples of 15° lie in their middle.
const BINS: usize = 24;

pub(super) fn events(arguments: &EventsArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    refuse_unused(arguments)?;
    let result = open_result(&arguments.file, console)?;
    let name = arguments.file.display().to_string();
    let unfit = |what: &str| {
        let name = name.clone();
        let what = what.to_owned();
        move |error: OperatorError| Failure::Usage(format!("{name}: {what}: {error}"))
    };
    if let Some(table @ (Table::Faces | Table::Rose)) = arguments.csv {
        let faces = CrackFaces::of(&result)?.faces;
        if table == Table::Faces {
            return console.print(&face_table(&faces));
        }
        let axis = arguments.across.unwrap_or(Axis::Z) as usize;
        let areas: Vec<Vec3> = faces.iter().map(|face| face.area).collect();
        return console.print(&rose_table(&rose(&areas, axis, BINS).map_err(unfit("cracks"))?));
    }
    let all = result.events()?;
    let events = once_per_bond(&all);
    let scenario = Scenario::parse(&name, &result.scenario()?)?;
    let (distance, duration) = (arguments.distance.map(Length::si), arguments.duration.map(Time::si));
    let Some(rule) = Rule::of(&result, &scenario, distance, duration)? else {
        let message = "the law of the bonds has no modulus, from which a speed of waves would follow; give --duration, such as \
                       --duration \"1 us\": the time that a wave takes through a source";
        return Err(Failure::Usage(message.into()));
    };
    let found = rule.emissions(&events).map_err(unfit("events"))?;
    match arguments.csv {
        Some(Table::Load) => return console.print(&load_table(&result, arguments, &found, unfit("load"))?),
        Some(_) => return console.print(&emission_table(&found)),
        None => {}
    }
    let mut facts = Facts::default();
    add_counts(&mut facts, &events);
    if arguments.faces {
        add_faces(&mut facts, &CrackFaces::of(&result)?).map_err(unfit("cracks"))?;
    }
    if !found.is_empty() {
        add_emissions(&mut facts, &found, rule, arguments.completeness);
    }
    add_reloadings(&mut facts, &result, arguments, &found, unfit("load"))?;
    let note = if is_gradual(&all) && !found.is_empty() {
        "\n  Bonds soften gradually here. The energy of an event is not all that its bond takes, and magnitudes say little.\n"
    } else {
        ""
    };
    console.print(&format!("{name}\n{facts}{note}"))
}

/// Refuses options that do not change the table that is asked for.
fn refuse_unused(arguments: &EventsArguments) -> Result<(), Failure> {
    let table = arguments.csv;
    let of_faces = matches!(table, Some(Table::Faces | Table::Rose));
    let given = [
        ("--distance", arguments.distance.is_some(), !of_faces),
        ("--duration", arguments.duration.is_some(), !of_faces),
        ("--completeness", arguments.completeness.is_some(), table.is_none()),
        ("--load", arguments.load.is_some(), table.is_none() || table == Some(Table::Load)),
        ("--unloading", arguments.unloading.is_some(), table.is_none()),
        ("--onset", arguments.onset.is_some(), table.is_none()),
        ("--faces", arguments.faces, table.is_none()),
        ("--across", arguments.across.is_some(), table == Some(Table::Rose)),
    ];
    let Some((option, ..)) = given.iter().find(|(_, is_given, is_used)| *is_given && !is_used) else { return Ok(()) };
    let shown = table.and_then(|table| Some(format!("--csv={}", table.to_possible_value()?.get_name())));
    let shown = shown.unwrap_or_else(|| "the summary".to_owned());
    let hint = if *option == "--across" { "; it belongs to --csv=rose" } else { "; leave it out" };
    Err(Failure::Usage(format!("{option} changes nothing in {shown}{hint}")))
}

fn add_counts(facts: &mut Facts, events: &[Event]) {
    let broken: Vec<&Event> = events.iter().filter(|event| event.damage >= 1.0).collect();
    let by_shear = broken.iter().filter(|event| is_sheared(event)).count();
    facts.add("broken bonds", count(broken.len()));
    facts.add("  in tension", count(broken.len() - by_shear));
    facts.add("  in shear", count(by_shear));
    let last = broken.iter().filter_map(|event| event.joint).max();
    for joint in last.map_or(0..0, |last| 0..last + 1) {
        let across = broken.iter().filter(|event| event.joint == Some(joint)).count();
        facts.add(&format!("  across joint[{joint}]"), count(across));
    }
    if broken.len() < events.len() {
        facts.add("damaged bonds", count(events.len() - broken.len()));
    }
}

fn add_faces(facts: &mut Facts, cracks: &CrackFaces) -> Result<(), OperatorError> {
    let area = |faces: &[&CrackFace]| faces.iter().map(|face| face.area.norm()).sum::<f64>();
    let all: Vec<&CrackFace> = cracks.faces.iter().collect();
    let left_out = match cracks.without_face {
        0 => String::new(),
        without => format!("; {} more bonds have no face", count(without)),
    };
    facts.add("area of cracks", format!("{:.4e} m², {} faces{left_out}", area(&all), count(all.len())));
    let (sheared, pulled): (Vec<&CrackFace>, Vec<&CrackFace>) = all.iter().partition(|face| is_sheared(&face.event));
    for (name, faces) in [("  in tension", pulled), ("  in shear", sheared)] {
        let total = area(&faces);
        if total > 0.0 {
            let mean = |of: fn(&CrackFace) -> f64| {
                1e6 * faces.iter().map(|face| face.area.norm() * of(face)).sum::<f64>() / total
            };
            let (width, slip) = (mean(CrackFace::opening), mean(CrackFace::slip));
            facts.add(name, format!("{total:.4e} m², {width:.3} µm wide and slipped by {slip:.3} µm in the mean"));
        }
    }
    let areas: Vec<Vec3> = cracks.faces.iter().map(|face| face.area).collect();
    let found = crack_directions(&areas)?;
    for (k, (share, x)) in found.principal.iter().zip(found.directions).enumerate() {
        let name = if k == 0 { "  share across directions" } else { "" };
        // Without the sign of a zero.
        let x = x.map(|part| (100.0 * part).round() / 100.0 + 0.0);
        facts.add(name, format!("{share:.3} across ({:.2}, {:.2}, {:.2})", x.x, x.y, x.z));
    }
    Ok(())
}

fn add_emissions(facts: &mut Facts, found: &[Emission], Rule { distance, duration }: Rule, completeness: Option<f64>) {
    // As many digits as restore the counts with the options, or in Python.
    let rule = format!("within {distance:.3e} m and {duration:.3e} s");
    facts.add("emissions", format!("{}, of breaks {rule}", count(found.len())));
    let most = found.iter().map(|event| event.breaks).max().unwrap_or(0);
    facts.add("  breaks of the largest", count(most));
    let energy: f64 = found.iter().map(|event| event.energy).sum();
    facts.add("  energy", format!("{energy:.4e} J"));
    let magnitudes: Vec<f64> = found.iter().map(Emission::magnitude).collect();
    let finite = magnitudes.iter().filter(|magnitude| magnitude.is_finite());
    let (least, greatest) =
        finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), m| (low.min(*m), high.max(*m)));
    if least <= greatest {
        facts.add("  magnitudes", format!("{least:.2} to {greatest:.2}"));
    }
    // The option takes finite numbers only.
    match b_value(&magnitudes, completeness).ok().flatten() {
        Some(BValue { b, error, completeness, count: number }) => {
            let counting = format!("{} emissions from magnitude {completeness:.2} on", count(number));
            facts.add("b-value", format!("{b:.3} ± {error:.3}, {counting}"));
        }
        None => facts.add("b-value", "too few emissions"),
    }
}

/// Load of a run over its records, positive where it is largest in magnitude.
struct Load {
    /// Time, s.
    time: Vec<f64>,
    values: Vec<f64>,
    unit: String,
}

impl Load {
    /// The load that is asked for, or the stress; `None` if the result has no stress.
    fn of(result: &ResultFile, name: Option<&str>) -> Result<Option<Self>, Failure> {
        let name = match name {
            None if !(result.has_series("stress") && result.has_series("time")) => return Ok(None),
            name => name.unwrap_or("stress"),
        };
        if !result.has_series(name) {
            let names: Vec<&str> = result.series().iter().map(|series| series.name.as_str()).collect();
            return Err(Failure::Usage(format!(
                "--load {name}: there is no such series; there are: {}",
                names.join(", ")
            )));
        }
        let mut load = result.samples(name)?;
        let largest =
            load.iter().copied().fold(0.0, |most: f64, load| if load.abs() > most.abs() { load } else { most });
        if largest < 0.0 {
            for load in &mut load {
                *load = -*load;
            }
        }
        Ok(Some(Self { time: result.samples("time")?, values: load, unit: result.unit("samples", name)? }))
    }
}

fn add_reloadings(
    facts: &mut Facts,
    result: &ResultFile,
    arguments: &EventsArguments,
    found: &[Emission],
    unfit: impl Fn(OperatorError) -> Failure,
) -> Result<(), Failure> {
    let Some(Load { time, values: load, unit }) = Load::of(result, arguments.load.as_deref())? else { return Ok(()) };
    let times: Vec<f64> = found.iter().map(|event| event.time).collect();
    let (unloading, onset) = (arguments.unloading.unwrap_or(UNLOADING), arguments.onset.unwrap_or(1) as usize);
    let turns = reloadings(&time, &load, &times, unloading, onset).map_err(unfit)?;
    if turns.is_empty() {
        return Ok(());
    }
    facts.add("reloadings", count(turns.len()));
    for turn in &turns {
        let Reloading { former, least, onset, .. } = *turn;
        let again = onset.zip(turn.felicity()).map_or_else(
            || "no emission".to_owned(),
            |(onset, ratio)| format!("emission from {onset:.4e} {unit} on, Felicity ratio {ratio:.3}"),
        );
        facts.add(&format!("  after {former:.4e} {unit}"), format!("unloaded to {least:.4e} {unit}, {again}"));
    }
    Ok(())
}

/// Emissions, one per line.
fn emission_table(found: &[Emission]) -> String {
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

fn load_table(
    result: &ResultFile,
    arguments: &EventsArguments,
    found: &[Emission],
    unfit: impl Fn(OperatorError) -> Failure,
) -> Result<String, Failure> {
    let Some(Load { time, values: load, unit }) = Load::of(result, arguments.load.as_deref())? else {
        return Err(Failure::Usage("the result has no stress over the time; name another series with --load".into()));
    };
    let strain = if result.has_series("strain") { result.samples("strain")? } else { vec![f64::NAN; time.len()] };
    let emissions: Vec<[f64; 2]> = found.iter().map(|event| [event.time, event.energy]).collect();
    let sums = cumulative(&time, &emissions).map_err(unfit)?;
    let mut text = format!("time [s],strain,load [{unit}],emissions,energy [J]\n");
    for (((time, strain), load), sum) in time.iter().zip(strain).zip(load).zip(sums) {
        let _ = writeln!(text, "{time:e},{strain:e},{load:e},{},{:e}", sum.count, sum.energy);
    }
    Ok(text)
}

fn face_table(faces: &[CrackFace]) -> String {
    let mut text =
        "time [s],id_a,id_b,x [m],y [m],z [m],area [m²],nx,ny,nz,opening [m],slip [m],shear,damage,joint\n".to_owned();
    for face in faces {
        let Event { time, id_a, id_b, position: x, damage, joint, .. } = face.event;
        let n = face.normal;
        let _ = writeln!(
            text,
            "{time:e},{id_a},{id_b},{:e},{:e},{:e},{:e},{},{},{},{:e},{:e},{},{damage},{}",
            x.x,
            x.y,
            x.z,
            face.area.norm(),
            n.x,
            n.y,
            n.z,
            face.opening(),
            face.slip(),
            u8::from(is_sheared(&face.event)),
            joint.unwrap_or(u16::MAX)
        );
    }
    text
}

fn rose_table(areas: &[f64]) -> String {
    let mut text = "angle [deg],area [m²]\n".to_owned();
    for (k, area) in areas.iter().enumerate() {
        let _ = writeln!(text, "{},{area:e}", 180.0 * k as f64 / areas.len() as f64);
    }
    text
}
