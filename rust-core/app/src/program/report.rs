//! `concordem report`: a web page about results.

use std::path::{Path, PathBuf};

use clap::ValueEnum;

use super::drive::check_page_name;
use super::so_far::open_result;
use super::{Console, Failure};
use crate::output::OutputError;
use crate::report::{ReferenceFigures, bonds_of, write_report};
use concordem_packing::Crop;
use concordem_scenario::schema::{Packing, Scenario, Shape};

/// Arguments of `concordem report`.
#[derive(Debug, clap::Args)]
pub(super) struct ReportArguments {
    /// Results, for example of tension and compression
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Web page to write; by default the name of the first result with .html
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Overwrite an existing page
    #[arg(long, short)]
    force: bool,
    /// Published values to compare with
    #[arg(long, value_enum, default_value_t = Reference::Auto)]
    reference: Reference,
}

/// Published values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Reference {
    /// Those that belong to the scenario of the first result, if any
    Auto,
    /// None
    None,
    /// Specimen 1 of Stránský 2018, section 2.5.3
    #[value(name = "specimen-1")]
    Specimen1,
    /// Specimen 4 of Stránský 2018, section 2.5.3
    #[value(name = "specimen-4")]
    Specimen4,
}

pub(super) fn report(arguments: &ReportArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    if let Some(path) = &arguments.output {
        check_page_name("--output ", path)?;
    }
    let path = write(arguments, console)?;
    console.print(&format!("{}\n", path.display()))
}

/// Writes the page as the command does, for a host; returns its path.
///
/// # Errors
/// The errors of the command.
pub fn report_on(
    files: &[PathBuf],
    output: Option<&Path>,
    overwrite: bool,
    reference: &str,
    console: &mut Console<'_>,
) -> Result<PathBuf, Failure> {
    if let Some(path) = output {
        check_page_name("", path)?;
    }
    if files.is_empty() {
        return Err(Failure::Usage("there is no result to report on; give at least one".to_owned()));
    }
    let reference = Reference::from_str(reference, false).map_err(|_| {
        let names: Vec<String> = Reference::value_variants()
            .iter()
            .filter_map(Reference::to_possible_value)
            .map(|v| v.get_name().to_owned())
            .collect();
        Failure::Usage(format!("reference is \"{reference}\"; give one of {}", names.join(", ")))
    })?;
    let output = output.map(Path::to_owned);
    write(&ReportArguments { files: files.to_vec(), output, force: overwrite, reference }, console)
}

fn write(arguments: &ReportArguments, console: &mut Console<'_>) -> Result<PathBuf, Failure> {
    let results = arguments.files.iter().map(|path| open_result(path, console)).collect::<Result<Vec<_>, _>>()?;
    let path = arguments.output.clone().unwrap_or_else(|| arguments.files[0].with_extension("html"));
    let path = crate::output::sealed::target(&path)?;
    if path.exists() && !arguments.force {
        return Err(OutputError::Exists { path }.into());
    }
    let scenario = results[0].scenario().map(|text| Scenario::parse("result", &text));
    let figures = match arguments.reference {
        Reference::Specimen1 => ReferenceFigures::stransky_specimen_1(),
        Reference::Specimen4 => ReferenceFigures::stransky_specimen_4(),
        Reference::None => bonds_of(scenario?.ok().as_ref()),
        Reference::Auto => published(scenario?.ok().as_ref()),
    };
    write_report(&results, &path, &figures)?;
    Ok(path)
}

/// The published figures for this scenario, if it is one of the published specimens.
fn published(scenario: Option<&Scenario>) -> ReferenceFigures {
    let specimen = scenario.and_then(|scenario| {
        let cpm = scenario.materials.first()?.cpm.as_ref()?;
        // The published spheres lie entirely inside; if their centers fill 50 mm, the specimen is stiffer and stronger.
        let whole = |shape: &Shape| {
            matches!(scenario.packing, Packing::File { .. }) || shape.keep() == Some(Crop::WholeSpheres)
        };
        let cube = scenario.packing.shape().is_some_and(|shape| match shape {
            Shape::Box { size, .. } => whole(shape) && size.iter().all(|edge| edge.si() == 0.05),
            _ => false,
        });
        let radius = match &scenario.packing {
            Packing::RandomDense { radius: Some(radius), .. } | Packing::Lattice { radius, .. } => radius.si() == 1e-3,
            Packing::File { .. } => true,
            _ => false,
        };
        let common = cube
            && radius
            && scenario.materials.len() == 1
            && cpm.crack_onset_strain.si() == 1e-4
            && cpm.relative_ductility.is_some_and(|ductility| ductility.si() == 30.0)
            && cpm.shear_ratio.si() == 0.2
            && (cpm.friction() - 0.8).abs() < 1e-12;
        match (cpm.young.si(), cpm.cohesion.si()) {
            (25e9, 3e6) if common => Some(ReferenceFigures::stransky_specimen_1()),
            (50e9, 6e6) if common => Some(ReferenceFigures::stransky_specimen_4()),
            _ => None,
        }
    });
    specimen.unwrap_or_else(|| bonds_of(scenario))
}
