//! Reads the states of earlier runs that `run --from` and `resume` continue.

use std::path::{Path, PathBuf};

use super::Failure;
use crate::output::checkpoint::{self, Checkpoint};
use crate::output::{OutputError, ResultFile, RunHeader};
use crate::report::Coverage;
use concordem_scenario::assembly::Assembly;
use concordem_scenario::assembly::restart::{Change, Continuation, RestartError, apply, check};
use concordem_scenario::schema::Scenario;

/// Name of the provenance entry with the file that a run continues.
pub(super) const CONTINUES: &str = "continues";
/// Name of the provenance entry with the hash of the state that a run continues.
pub(super) const CONTINUED_HASH: &str = "continued_state_hash";
/// Name of the provenance entry with the keys in which the scenario differs from that of the state it continues.
pub(super) const CHANGED: &str = "changed_keys";

/// The state that a run continues, and the changes of the scenario.
pub(super) struct Origin {
    file: PathBuf,
    checkpoint: Checkpoint,
    changes: Vec<Change>,
    /// Whether the loading goes on: its kind, its axis, and what strain and stress refer to are those of before.
    same_test: bool,
}

/// Keys of a loading that say what strain and stress mean.
const MEANING: [&str; 8] = ["", ".axis", ".about", ".across", ".area", ".gauge_length", ".span", ".inner_span"];

impl Origin {
    /// Reads a result or a checkpoint, and compares its scenario with that of the new run.
    pub(super) fn read(file: &Path, scenario: &Scenario) -> Result<Self, Failure> {
        let checkpoint = checkpoint::read(file)?;
        let before = Scenario::parse(&file.display().to_string(), &checkpoint.provenance)?;
        let changes = check(&before, scenario, Continuation::NewResult)?;
        let other = |change: &Change| change.key.strip_prefix("loading").is_some_and(|key| MEANING.contains(&key));
        let same_test = !changes.iter().any(other);
        let file = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
        Ok(Self { file, checkpoint, changes, same_test })
    }

    /// Adds the records of the continued run to the description of the new one, so that its result covers the whole test. The last
    /// record is left out: the new run begins with one at the same step.
    ///
    /// # Errors
    /// The records cannot be read.
    pub(super) fn add_records(&self, header: &mut RunHeader) -> Result<Coverage, Failure> {
        let coverage = if self.same_test { self.copy_records(header)? } else { Coverage::OtherLoading };
        header.provenance.push((Coverage::ENTRY.to_owned(), coverage.to_string()));
        Ok(coverage)
    }

    fn copy_records(&self, header: &mut RunHeader) -> Result<Coverage, Failure> {
        let result = match ResultFile::open(&self.file) {
            Ok(result) => result,
            // A checkpoint has no records.
            Err(OutputError::Kind { .. }) => return Ok(Coverage::Unknown),
            Err(error) => return Err(error.into()),
        };
        let coverage = Coverage::of(&result.provenance()?);
        if coverage != Coverage::Unknown {
            for series in result.series() {
                let mut values = result.history(&series.name)?;
                values.pop();
                header.earlier.insert(series.name.clone(), values);
            }
        }
        Ok(coverage)
    }

    /// Entries of the provenance.
    pub(super) fn provenance(&self) -> Vec<(String, String)> {
        let entries = [
            (CONTINUES, self.file.display().to_string()),
            (CONTINUED_HASH, self.checkpoint.state_hash.clone()),
            (CHANGED, listed(&self.changes)),
        ];
        entries.map(|(name, value)| (name.to_owned(), value)).to_vec()
    }

    /// Hash of the state.
    pub(super) fn state_hash(&self) -> &str {
        &self.checkpoint.state_hash
    }

    /// Replaces the initial state of `assembly`.
    pub(super) fn apply(mut self, assembly: &mut Assembly, scenario: &Scenario) -> Result<(), Failure> {
        apply_changes(&mut self.checkpoint, assembly, scenario, &self.changes, &self.file, true)
    }
}

/// Replaces the initial state of `assembly` by that of a checkpoint. `further`: continue a run that had ended.
pub(super) fn apply_changes(
    checkpoint: &mut Checkpoint,
    assembly: &mut Assembly,
    scenario: &Scenario,
    changes: &[Change],
    file: &Path,
    further: bool,
) -> Result<(), Failure> {
    apply(assembly, &mut checkpoint.columns, scenario, changes, further).map_err(|error| match error {
        RestartError::Scenario(error) => Failure::Scenario(error),
        RestartError::Column(source) => OutputError::Column { path: file.to_owned(), source }.into(),
        RestartError::Assembly(error) => Failure::of_assembly(scenario, error),
        other => Failure::Usage(other.to_string()),
    })
}

/// Changes on one line.
pub(super) fn listed(changes: &[Change]) -> String {
    if changes.is_empty() {
        return "none".to_owned();
    }
    changes.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
}
