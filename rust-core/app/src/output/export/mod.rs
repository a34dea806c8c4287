//! Exports of results: particles and bonds at every snapshot for ParaView and OVITO, cracks, and the heat network for MPI hosts.

mod bonds;
mod cracks;
mod heat_network;
mod lammps;
mod script;
mod vtk;

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use super::error::OutputError;
use super::frames::Frames;
use super::result::ResultFile;
pub(crate) use bonds::Lines;
pub use cracks::{Cracks, write as write_cracks};
pub use heat_network::write as write_heat_network;
pub use lammps::write as write_lammps;
pub use vtk::write as write_vtk;

/// Files that an export wrote.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Exported {
    /// The files.
    pub files: Vec<PathBuf>,
    /// Number of snapshots of the particles.
    pub snapshots: usize,
    /// Whether the snapshots have no bonds, so that those of the final state were exported.
    pub only_final_bonds: bool,
}

/// A file beside the result: `NAME.particles.vtkhdf` for `NAME.h5`.
fn beside(stem: &Path, ending: &str) -> PathBuf {
    let mut name = stem.as_os_str().to_owned();
    name.push(ending);
    PathBuf::from(name)
}

/// The name of a file without its folder.
fn name_of(path: &Path) -> &OsStr {
    path.file_name().unwrap_or_default()
}

/// Refuses to overwrite files.
fn free(files: &[PathBuf], overwrite: bool) -> Result<(), OutputError> {
    match files.iter().find(|file| file.exists()) {
        Some(file) if !overwrite => Err(OutputError::Exists { path: file.clone() }),
        _ => Ok(()),
    }
}

fn particles_of(result: &ResultFile) -> Result<Frames, OutputError> {
    Frames::of_particles(result.root(), result.path())
}
