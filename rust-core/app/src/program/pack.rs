//! `concordem pack`: the packing of a scenario.

use std::path::PathBuf;

use super::meter::Meter;
use super::readable::count;
use super::settings::Settings;
use super::{Console, Facts, Failure, Work};
use crate::output::OutputError;
use concordem_packing::{DirectionHistogram, PackingError, PackingSummary, export_csv, export_text, link_vectors};
use concordem_scenario::assembly::{Cooking, Placed, place_cached};
use concordem_scenario::schema::{ProblemKind, Scenario};

/// Arguments of `concordem pack`.
#[derive(Debug, clap::Args)]
pub(super) struct PackArguments {
    /// Scenario file
    scenario: PathBuf,
    #[command(flatten)]
    settings: Settings,
    /// File to write: text with the columns x y z r in meters, a comma-separated table if it ends in .csv, or HDF5 if it ends in
    /// .h5; by default SCENARIO.spheres.txt
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Overwrite an existing file
    #[arg(long, short)]
    force: bool,
    #[command(flatten)]
    work: Work,
}

pub(super) fn pack(arguments: &PackArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    let scenario = arguments.settings.read(&arguments.scenario)?;
    let path = arguments.output.clone().unwrap_or_else(|| arguments.scenario.with_extension("spheres.txt"));
    let path = crate::output::sealed::target(&path)?;
    if path.exists() && !arguments.force {
        return Err(OutputError::Exists { path }.into());
    }
    let cache = console.cache();
    let display = console.display(&arguments.work);
    let (packing, text) = arguments.work.install(|| {
        let meter = Meter::new(display);
        let placed = place_cached(&scenario, &scenario.directory(), cache.as_ref(), &mut |stage, share| {
            meter.stage(stage, share);
        })
        .map_err(|error| Failure::of_assembly(&scenario, error))?;
        meter.finish();
        let text = facts(&scenario, &placed)?;
        Ok((placed.packing, text))
    })?;
    if path.extension().is_some_and(|e| e == "h5" || e == "hdf5") {
        crate::output::sphere_pack::write(&path, &packing).map_err(|message| Failure::File {
            path: path.clone(),
            action: "write",
            error: std::io::Error::other(message),
        })?;
        return console.print(&format!("{}\n{text}", path.display()));
    }
    let mut bytes = Vec::new();
    let csv = path.extension().is_some_and(|extension| extension == "csv");
    let written = if csv { export_csv(&packing, &mut bytes) } else { export_text(&packing, &mut bytes) };
    written.map_err(|error| failed(&scenario, &error))?;
    crate::output::sealed::write_text(&path, &String::from_utf8_lossy(&bytes))?;
    console.print(&format!("{}\n{text}", path.display()))
}

fn failed(scenario: &Scenario, error: &PackingError) -> Failure {
    Failure::Scenario(scenario.problem(ProblemKind::Conflict, "packing", error.to_string(), ""))
}

/// Interaction ratio of the bonds; 1 without bonds.
fn ratio(scenario: &Scenario, placed: &Placed) -> Result<f64, PackingError> {
    let Some(bonds) = &scenario.bonds else { return Ok(1.0) };
    let Some(coordination) = bonds.coordination else { return Ok(bonds.interaction_ratio.si()) };
    let found = placed.ratio_for_coordination(coordination.si())?;
    Ok(found.map_or(1.0, |(ratio, _)| ratio))
}

fn facts(scenario: &Scenario, placed: &Placed) -> Result<Facts, Failure> {
    let packing = &placed.packing;
    let failed = |error: PackingError| failed(scenario, &error);
    let ratio = ratio(scenario, placed).map_err(failed)?;
    let touching = PackingSummary::new(packing, 1.0).map_err(failed)?;
    let linked = PackingSummary::new(packing, ratio).map_err(failed)?;
    let links = link_vectors(packing, ratio).map_err(failed)?;
    let mut facts = Facts::default();
    facts.add("spheres", count(touching.count));
    if let Some(fraction) = placed.packing_fraction {
        facts.add("solid fraction", format!("{fraction:.4}"));
    }
    facts.add("contacts per sphere", format!("{:.3}", touching.coordination));
    facts.add("rattlers", count(touching.rattlers));
    facts.add("largest overlap", format!("{:.3e} of the sum of radii", touching.largest_overlap));
    if let Some(cooking) = placed.walled.as_ref().and_then(|walled| walled.cooked.as_ref()) {
        let Cooking { filled, last, .. } = cooking;
        let two = |a: f64, b: f64| format!("{a:.3}, before the walls softened {b:.3}");
        facts.add("contacts per sphere inside", two(last.coordination, filled.coordination));
        facts.add("at the boundary", two(last.at_boundary, filled.at_boundary));
        let overlap = format!("{:.3e} of the mean radius, before {:.3e}", last.overlap, filled.overlap);
        facts.add("mean overlap", overlap);
        facts.add("links per sphere inside", format!("{:.3}", cooking.links_inside));
        facts.add("forced insertions", count(cooking.packets));
        if cooking.lost > 0 {
            facts.add("spheres lost through walls", count(cooking.lost));
        }
        facts.add("time steps", count(cooking.steps as usize));
    }
    if ratio > 1.0 {
        facts.add(&format!("bonds per sphere at interaction ratio {ratio}"), format!("{:.3}", linked.coordination));
    }
    // A few bonds have no distribution.
    if links.len() > DirectionHistogram::BINS {
        let histogram = DirectionHistogram::new(&links, DirectionHistogram::BINS);
        let deviation = histogram.relative_deviation();
        let expected = 1.0 / histogram.mean().sqrt();
        let value = format!("{deviation:.3} of the mean ({expected:.3} for random directions)");
        facts.add("scatter of bond directions", value);
    }
    Ok(facts)
}
