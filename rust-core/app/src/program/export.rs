//! `concordem export`: particles and bonds for ParaView, OVITO, and LAMMPS; crack surfaces; heat networks.

use std::path::{Path, PathBuf};

use clap::ValueEnum;

use super::drive::build;
use super::meter::{Display, Meter};
use super::recording::{INITIAL_HASH, SCENARIO_FILE, check_initial_state};
use super::resume::CHANGED_LATER;
use super::so_far::open_result;
use super::{Console, Failure};
use crate::output::export::{write_cracks, write_heat_network, write_lammps, write_vtk};
use crate::output::result::ResultFile;
use concordem_contact::heat::HeatNetwork;
use concordem_scenario::schema::Scenario;

/// Arguments of `concordem export`.
#[derive(Debug, clap::Args)]
pub(super) struct ExportArguments {
    /// Result
    file: PathBuf,
    /// Format
    #[arg(long, value_enum, default_value_t = Format::Vtk)]
    format: Format,
    /// Beginning of the names of the files, without an extension; by default the name of the result without its extension
    #[arg(long, short, value_name = "STEM")]
    output: Option<PathBuf>,
    /// Overwrite existing files
    #[arg(long, short)]
    force: bool,
}

/// Format of an export.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// STEM.particles.vtkhdf and STEM.bonds.vtkhdf for VTK, pyvista, and ParaView, and a macro of ParaView
    Vtk,
    /// STEM.data, STEM.dump, and STEM.bonds.dump for OVITO and LAMMPS, and a script of OVITO
    Lammps,
    /// STEM.cracks.vtp: the crack surfaces, one polygon for each broken bond, for VTK, pyvista, and ParaView
    Cracks,
    /// STEM.heat.txt: heat capacities of the particles and areas of their bonds at the start, for `heat_network` in LIGGGHTS and LAMMPS
    HeatNetwork,
}

pub(super) fn export(arguments: &ExportArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    let written = write(arguments, console)?;
    written.notes.iter().for_each(|note| console.tell(note));
    let files: Vec<String> = written.files.iter().map(|file| format!("{}\n", file.display())).collect();
    console.print(&files.concat())
}

/// Files that were written, and what their reader must know.
pub struct Exported {
    /// The files.
    pub files: Vec<PathBuf>,
    /// Notes.
    pub notes: Vec<String>,
}

/// Exports a result as the command does, for a host. `output`: beginning of the names of the files.
///
/// # Errors
/// The errors of the command.
pub fn export_result(
    file: &Path,
    format: &str,
    output: Option<&Path>,
    overwrite: bool,
    console: &mut Console<'_>,
) -> Result<Exported, Failure> {
    let format = Format::from_str(format, false).map_err(|_| {
        let formats = Format::value_variants().iter().filter_map(Format::to_possible_value);
        let names: Vec<String> = formats.map(|value| value.get_name().to_owned()).collect();
        Failure::Usage(format!("format is \"{format}\"; give one of {}", names.join(", ")))
    })?;
    let output = output.map(Path::to_owned);
    write(&ExportArguments { file: file.to_owned(), format, output, force: overwrite }, console)
}

fn write(arguments: &ExportArguments, console: &mut Console<'_>) -> Result<Exported, Failure> {
    let result = open_result(&arguments.file, console)?;
    let stem = arguments.output.clone().unwrap_or_else(|| arguments.file.with_extension(""));
    if result.snapshot_times()?.is_empty() && arguments.format != Format::HeatNetwork {
        return Err(Failure::Usage(format!("{} has no snapshots", arguments.file.display())));
    }
    let written = match arguments.format {
        Format::HeatNetwork => {
            let file = heat_network(&result, &stem, arguments.force, console)?;
            return Ok(Exported { files: vec![file], notes: Vec::new() });
        }
        Format::Vtk => write_vtk(&result, &stem, arguments.force)?,
        Format::Lammps => write_lammps(&result, &stem, arguments.force)?,
        Format::Cracks => {
            let written = write_cracks(&result, &stem, arguments.force)?;
            let left_out = match written.without_face {
                0 => String::new(),
                count => format!("; {count} more such bonds have none, because their cells do not touch"),
            };
            let note = format!(
                "{} faces of bonds that broke or were damaged, with an area of {:.6e} m²{left_out}",
                written.faces, written.area
            );
            return Ok(Exported { files: vec![written.file], notes: vec![note] });
        }
    };
    let mut notes = Vec::new();
    if written.only_final_bonds {
        notes.push(
            "the snapshots have no bonds, so only those of the final state are exported; write bond_snapshots = true in [output] and \
             run again for all"
                .to_owned(),
        );
    }
    Ok(Exported { files: written.files, notes })
}

/// Writes the heat network of the body at the start, which is made again.
fn heat_network(result: &ResultFile, stem: &Path, force: bool, console: &Console<'_>) -> Result<PathBuf, Failure> {
    let unfit = |problem: &str| Failure::Usage(format!("{}: {problem}", result.path().display()));
    let provenance = result.provenance()?;
    let entry = |wanted: &str| provenance.iter().find(|(name, _)| name == wanted).map(|(_, value)| value.as_str());
    let scenario = Scenario::parse(entry(SCENARIO_FILE).unwrap_or("scenario"), &result.scenario()?)?;
    let Some(model) = scenario.heat.as_ref().map(|heat| heat.model) else {
        return Err(unfit("the scenario has no [heat]"));
    };
    if model == HeatNetwork::Contacts || scenario.dimension == 2 || scenario.bonds.is_none() {
        return Err(unfit(
            "a heat network for LIGGGHTS and LAMMPS needs [bonds], dimension = 3, and a model other than \"contacts\" in [heat] (which needs \
             no file)",
        ));
    }
    let assembly = build(&scenario, console.cache().as_ref(), &Meter::new(Display::Nothing))?;
    // An edited scenario builds another state than the first one.
    let recorded = entry(INITIAL_HASH).filter(|_| entry(CHANGED_LATER).is_none());
    check_initial_state(recorded, &assembly.state, result.path(), "exported as a heat network")?;
    let Some(heat) = &assembly.model.heat else { return Err(unfit("the scenario has no [heat]")) };
    match write_heat_network(model, &assembly.state, heat, stem, force)? {
        Ok(path) => Ok(path),
        Err(count) => Err(unfit(&format!(
            "heat flows along {count} links without a bond of their own, which LIGGGHTS and LAMMPS cannot have; choose \"disordered\" or \
             \"ordered\" with pairs = \"bonds\" in [heat]"
        ))),
    }
}
