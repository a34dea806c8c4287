//! The result of a simulation, by the writer of the program.

use std::path::{Path, PathBuf};

use concordem::output::run_files::parts_folder;
use concordem::output::sealed::target;
use concordem::output::{OutputError, RunFiles};
use concordem::program::Failure;
use concordem::program::recording::{Recording, check_result_name, refuse_existing};
use concordem::schedule::{Advance, Simulation as Run};

use super::Inner;
use super::kept::Records;

/// Name of the provenance entry with the calls of Python that have changed the run.
const CHANGED: &str = "changed_from_python";

impl Inner {
    /// Write records, snapshots, and the present state to the result `path`; `csv`: whether the scenario asks for a table. Returns the
    /// path without links.
    pub fn write(&mut self, path: &Path, csv: bool, overwrite: bool) -> Result<PathBuf, Failure> {
        check_result_name("", path)?;
        let path = target(path)?;
        if !overwrite {
            refuse_existing(&path, csv)?;
        }
        self.book_written();
        let Self { run, records, recording, .. } = self;
        let mut header = self.header.clone();
        if let Some(calls) = records.calls() {
            header.provenance.push((CHANGED.to_owned(), calls));
        }
        let mut files = RunFiles::create(&path, header, overwrite).map_err(kept)?;
        files.note("wall_time_s", &format!("{:.3}", self.wall.as_secs_f64()));
        let written = append(&mut files, run, records, recording).and_then(|()| {
            let reason = match run.stopped() {
                Some(reason) => reason.to_string(),
                None => format!("not ended: written from Python after step {}", run.state.clock.step),
            };
            recording.finish(run, files, &reason)
        });
        if let Err(error) = written {
            // The simulation still has everything; an unfinished run would be in the way.
            let _ = std::fs::remove_dir_all(parts_folder(&path));
            return Err(kept(error));
        }
        Ok(path)
    }
}

/// The failure of a write, after which there is no run to resume: the simulation has everything.
fn kept(error: impl Into<Failure>) -> Failure {
    match error.into() {
        Failure::Output(OutputError::NoSpace { path, message }) => {
            let error = std::io::Error::other(format!(
                "{message}. Free some space, and write again; the simulation keeps everything"
            ));
            Failure::File { path, action: "write", error }
        }
        other => other,
    }
}

/// Append all rows and snapshots. A run that has not ended also gets those of its present state, as a run has them at its end.
fn append(files: &mut RunFiles, run: &mut Run, records: &Records, recording: &Recording) -> Result<(), Failure> {
    let present = if run.stopped().is_none() { run.present().unwrap_or_default() } else { Advance::default() };
    for sample in records.samples.iter().chain(&present.sample) {
        files.append_sample(&sample.to_row()[..files.width()])?;
    }
    for row in records.operators.iter().flatten().chain(&present.operators) {
        files.append_operator(row.operator, row.time, row.step, &row.values)?;
    }
    for event in &records.events {
        files.append_event(*event);
    }
    let now = records.moments.last().is_none_or(|moment| moment.step() != run.state.clock.step);
    let last = if now { Some(recording.snapshot(run)?) } else { None };
    for moment in records.moments.iter().chain(&last) {
        files.append_snapshot(moment.particles.clone())?;
        if let Some(bonds) = &moment.bonds {
            files.append_bonds(bonds.clone());
        }
    }
    Ok(())
}
