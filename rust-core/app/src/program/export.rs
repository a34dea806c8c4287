//! `concordem export`: particles and bonds for ParaView, OVITO, and LAMMPS.

use std::path::PathBuf;

use clap::ValueEnum;

use super::drive::open_result;
use super::{Console, Failure};
use crate::output::export::{write_cracks, write_lammps, write_vtk};

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
}

pub(super) fn export(arguments: &ExportArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    let result = open_result(&arguments.file)?;
    if result.snapshot_times()?.is_empty() {
        return Err(Failure::Usage(format!("{} has no snapshots", arguments.file.display())));
    }
    let stem = arguments.output.clone().unwrap_or_else(|| arguments.file.with_extension(""));
    let written = match arguments.format {
        Format::Vtk => write_vtk(&result, &stem, arguments.force)?,
        Format::Lammps => write_lammps(&result, &stem, arguments.force)?,
        Format::Cracks => {
            let written = write_cracks(&result, &stem, arguments.force)?;
            let left_out = match written.without_face {
                0 => String::new(),
                count => format!("; {count} more bonds broke whose particles have no common face"),
            };
            console.tell(&format!("{} faces with an area of {:.6e} m²{left_out}", written.faces, written.area));
            return console.print(&format!("{}\n", written.file.display()));
        }
    };
    if written.only_final_bonds {
        console.tell(
            "the snapshots have no bonds, so only those of the final state are exported; write bond_snapshots = true in [output] and \
             run again for all",
        );
    }
    let files: Vec<String> = written.files.iter().map(|file| format!("{}\n", file.display())).collect();
    console.print(&files.concat())
}
