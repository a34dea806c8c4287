//! Export for VTK, ParaView, and pyvista: one file with the particles, one with the bonds, and a macro of ParaView.

use std::ffi::OsStr;
use std::path::Path;

use super::bonds::AllLines;
use super::script::{filled, literal};
use super::{Exported, beside, free, name_of, particles_of};
use crate::output::error::OutputError;
use crate::output::result::ResultFile;
use crate::output::sealed;
use crate::output::stream::StoredField;
use crate::output::vtk::{Cells, VtkWriter};

/// The macro of ParaView.
const MACRO: &str = include_str!("paraview.py");

/// Writes `STEM.particles.vtkhdf`, `STEM.bonds.vtkhdf` if there are bonds, and `STEM.paraview.py`.
///
/// # Errors
/// A file exists and `overwrite` is not set, the result has no snapshots, or a file cannot be written.
pub fn write(result: &ResultFile, stem: &Path, overwrite: bool) -> Result<Exported, OutputError> {
    let [particles, bonds, script] =
        [".particles.vtkhdf", ".bonds.vtkhdf", ".paraview.py"].map(|ending| beside(stem, ending));
    free(&[particles.clone(), bonds.clone(), script.clone()], overwrite)?;
    let frames = particles_of(result)?;
    sealed::write(&particles, &sealed::folder_of(&particles), |file| {
        let mut writer = VtkWriter::new(file, Cells::Vertices, "Centers of the particles.", &particles)?;
        for k in 0..frames.len() {
            let frame = frames.read(k)?;
            let fields: Vec<&StoredField> = frame.fields.iter().collect();
            writer.append(&[frame.time], &[frame.step], &frame.points, &fields)?;
        }
        writer.finish()
    })?;
    let lines = AllLines::of(result)?;
    let mut any = false;
    sealed::write(&bonds, &sealed::folder_of(&bonds), |file| {
        let mut writer = VtkWriter::new(file, Cells::Lines, "Centers of the two particles of each bond.", &bonds)?;
        any = lines.for_each(result, &mut |lines| {
            let fields: Vec<&StoredField> = lines.fields.iter().collect();
            writer.append(&[lines.time], &[lines.step], &lines.points, &fields)
        })?;
        writer.finish()
    })?;
    let mut files = vec![particles.clone()];
    if any {
        files.push(bonds.clone());
    } else {
        std::fs::remove_file(&bonds).map_err(|error| OutputError::io(&bonds, "remove", error))?;
    }
    let values = [
        ("PARTICLES", literal(name_of(&particles))),
        ("BONDS", literal(if any { name_of(&bonds) } else { OsStr::new("") })),
    ];
    sealed::write_text(&script, &filled(MACRO, &values))?;
    files.push(script);
    Ok(Exported { files, snapshots: frames.len(), only_final_bonds: any && lines.are_final() })
}
