//! Files of measured values.

use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::super::Failure;
use crate::calibration::measured::Measured;
use crate::output::OutputError;
use crate::output::sealed::write_text;
use crate::provenance;
use concordem_scenario::schema::{Output, Packing, Scenario};

/// Identity of a table: the program, and the scenario without the seed and without keys that no run of a specimen uses. Files are
/// identified by their contents.
pub(super) fn described(scenario: &Scenario) -> Result<String, Failure> {
    let mut described = scenario.clone();
    if let Packing::RandomDense { seed, .. } = &mut described.packing {
        *seed = 0;
    }
    described.title.clear();
    described.samples.clear();
    described.output = Output { sample_interval: described.output.sample_interval, ..Output::default() };
    let mut files = Vec::new();
    for (_, file) in scenario.files() {
        let path = scenario.directory().join(file);
        let bytes = std::fs::read(&path).map_err(|error| Failure::File { path, action: "read", error })?;
        files.push(blake3::hash(&bytes).to_string());
    }
    let parts = (provenance::PROGRAM, provenance::COMMIT, &described, files);
    serde_json::to_string(&parts)
        .map_err(|error| Failure::Calibration(format!("the scenario cannot be serialized: {error}")))
}

/// The table in a file; an empty one if there is no file.
pub(super) fn read<V: DeserializeOwned>(path: &Path, specimen: String) -> Result<Measured<V>, Failure> {
    match std::fs::read_to_string(path) {
        Ok(text) => {
            let known: Measured<V> = serde_json::from_str(&text).map_err(|error| {
                let path = path.display();
                Failure::Calibration(format!(
                    "{path} is not a table of strengths: {error}; remove it, or choose another file with --table"
                ))
            })?;
            if known.specimen == specimen {
                return Ok(known);
            }
            let path = path.display();
            Err(Failure::Calibration(format!(
                "{path} belongs to another specimen, other moduli, or another version of the program; remove it, or choose \
                 another file with --table"
            )))
        }
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(Measured { specimen, ..Measured::default() }),
        Err(error) => Err(Failure::File { path: path.to_owned(), action: "read", error }),
    }
}

/// Replaces the table in a file.
pub(super) fn save<V: Serialize>(path: &Path, table: &Measured<V>) -> Result<(), OutputError> {
    write_text(path, &serde_json::to_string_pretty(table).unwrap_or_default())
}
