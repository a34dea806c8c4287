//! `concordem pack`: only the packing of a scenario.

use std::path::PathBuf;

use super::check::count;
use super::drive::Meter;
use super::{Console, Failure, Work};
use crate::assembly::packing::{DirectionHistogram, Packing, PackingError, PackingSummary, export_text, link_vectors};
use crate::scenario::{ProblemKind, Scenario};

/// Arguments of `concordem pack`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Scenario file
    scenario: PathBuf,
    /// Text file to write, columns x y z r in metres; SCENARIO.spheres.txt by default
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Overwrite an existing file
    #[arg(long, short)]
    force: bool,
    #[command(flatten)]
    work: Work,
}

pub(super) fn pack(arguments: &Arguments, console: &mut Console<'_>) -> Result<(), Failure> {
    let scenario = Scenario::read(&arguments.scenario)?;
    let path = arguments.output.clone().unwrap_or_else(|| arguments.scenario.with_extension("spheres.txt"));
    if path.exists() && !arguments.force {
        let message = format!("{} exists already. Choose another name, or overwrite it with --force.", path.display());
        return Err(Failure::Usage(message));
    }
    let visible = console.interactive && !arguments.work.quiet;
    let (packing, text) = arguments.work.install(|| {
        let meter = Meter::new(visible);
        let packing =
            crate::assembly::pack(&scenario, &scenario.directory(), &mut |stage, share| meter.stage(stage, share))
                .map_err(|error| Failure::of_assembly(&scenario, error))?;
        meter.finish();
        let text = facts(&scenario, &packing)?;
        Ok((packing, text))
    })?;
    let mut bytes = Vec::new();
    export_text(&packing, &mut bytes).map_err(|error| failed(&scenario, &error))?;
    crate::output::sealed::write_text(&path, &String::from_utf8_lossy(&bytes))?;
    console.print(&format!("{}\n{text}", path.display()))
}

fn failed(scenario: &Scenario, error: &PackingError) -> Failure {
    Failure::Scenario(scenario.problem(ProblemKind::Conflict, "packing", error.to_string(), ""))
}

fn facts(scenario: &Scenario, packing: &Packing) -> Result<String, Failure> {
    let failed = |error: PackingError| failed(scenario, &error);
    let ratio = scenario.bonds.as_ref().map_or(1.0, |bonds| bonds.interaction_ratio.si());
    let touching = PackingSummary::new(packing, 1.0).map_err(failed)?;
    let linked = PackingSummary::new(packing, ratio).map_err(failed)?;
    let links = link_vectors(packing, ratio).map_err(failed)?;
    let mut text = format!("  {:28}{}\n", "spheres", count(touching.count));
    if let Some(fraction) = touching.packing_fraction {
        text += &format!("  {:28}{fraction:.4}\n", "solid fraction");
    }
    text += &format!("  {:28}{:.3}\n", "contacts per sphere", touching.coordination);
    text += &format!("  {:28}{}\n", "spheres that nothing holds", count(touching.rattlers));
    text += &format!("  {:28}{:.3e} of the radii's sum\n", "largest overlap", touching.largest_overlap);
    if ratio > 1.0 {
        text += &format!("  {:28}{:.3}\n", format!("links per sphere at {ratio}"), linked.coordination);
    }
    if !links.is_empty() {
        let histogram = DirectionHistogram::new(&links, DirectionHistogram::BINS);
        let deviation = histogram.relative_deviation();
        let expected = 1.0 / histogram.mean().sqrt();
        text += &format!(
            "  {:28}{:.3} of the mean ({expected:.3} for random directions)\n",
            "scatter of link directions", deviation
        );
    }
    Ok(text)
}
