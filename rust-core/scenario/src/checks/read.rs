//! Reads a scenario from text or a file.

use std::path::Path;
use std::sync::Arc;

use super::{check_meaning, files, structure};
use crate::schema::{Document, Given, ReadError, Scenario, ScenarioError, Setting, Source};

/// Reads the text of a scenario or a sweep.
///
/// # Errors
/// The file cannot be read, is HDF5, or is not UTF-8.
pub fn read_text(path: &Path) -> Result<String, ReadError> {
    let bytes =
        concordem_files::paths::read_short(path).map_err(|error| ReadError::Io { path: path.to_owned(), error })?;
    if bytes.starts_with(b"\x89HDF\r\n\x1a\n") {
        return Err(ReadError::Hdf5 { path: path.to_owned() });
    }
    if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
        return Err(ReadError::Utf16 { path: path.to_owned() });
    }
    String::from_utf8(bytes).map_err(|error| {
        let start = error.utf8_error().valid_up_to();
        let line = error.as_bytes()[..start].split(|byte| *byte == b'\n').count();
        ReadError::NotText { path: path.to_owned(), line }
    })
}

/// The JSON Schema, built once.
fn own_schema() -> &'static serde_json::Value {
    static SCHEMA: std::sync::OnceLock<serde_json::Value> = std::sync::OnceLock::new();
    SCHEMA.get_or_init(crate::schema::schema)
}

impl Scenario {
    /// Reads and checks a scenario; `source_name` names it in messages. Does not check that the files it names exist.
    ///
    /// # Errors
    /// All problems of the scenario, each with line, key, value, and remedy.
    ///
    /// ```
    /// use concordem_scenario::schema::Scenario;
    ///
    /// let error = Scenario::parse("wrong.toml", "version = 2\n").unwrap_err();
    /// assert!(error.to_string().starts_with("wrong.toml:1:1: contacts: missing key"));
    /// assert_eq!(error.problems.len(), 4);
    /// ```
    pub fn parse(source_name: &str, text: &str) -> Result<Self, ScenarioError> {
        Self::parse_source(source(source_name, text), None)
    }

    /// Reads and checks a scenario file, and checks that the files it names exist.
    ///
    /// # Errors
    /// The file cannot be read, is not UTF-8, or contains an invalid scenario.
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        Self::read_with(path, &[])
    }

    /// Reads a scenario file with settings that replace its keys. Problems of a setting are reported at the setting, all others at
    /// their position in the file.
    ///
    /// # Errors
    /// Those of [`Self::read`]; a setting whose key leads nowhere.
    pub fn read_with(path: &Path, settings: &[Setting]) -> Result<Self, ReadError> {
        let name = path.display().to_string();
        let text = read_text(path)?;
        let directory = path.parent().unwrap_or(Path::new("")).to_owned();
        let source = with_settings(source(&name, &text), settings)?;
        Ok(Self::parse_source(source, Some(&directory))?)
    }

    /// Changes keys of a scenario.
    ///
    /// # Errors
    /// A setting whose key leads nowhere, and all problems of the changed scenario.
    pub fn with_settings(&self, settings: &[Setting]) -> Result<Self, ReadError> {
        let source = with_settings(self.source.clone(), settings)?;
        Ok(Self::parse_source(source, None)?)
    }

    fn parse_source(source: Source, directory: Option<&Path>) -> Result<Self, ScenarioError> {
        let document = Document::parse(&source).map_err(|problems| ScenarioError::new(&source, problems))?;
        let mut problems = structure::check(&document, own_schema());
        let scenario = match document.deserialize::<Self>() {
            Ok(scenario) => scenario,
            Err(problem) => {
                // Serde stops at its first problem; the check of structure has already reported it together with all others.
                if problems.is_empty() {
                    problems.push(problem);
                }
                return Err(ScenarioError::new(&source, problems));
            }
        };
        if scenario.materials.is_empty() {
            return Err(ScenarioError::new(&source, problems));
        }
        problems.extend(check_meaning(&document, &scenario));
        if let Some(directory) = directory {
            problems.extend(files::check(&document, &scenario, directory));
        }
        if problems.is_empty() { Ok(Self { source, ..scenario }) } else { Err(ScenarioError::new(&source, problems)) }
    }
}

/// The source of a text. Files from Windows may begin with a byte order mark; lines of old files end with a carriage return alone.
fn source(name: &str, text: &str) -> Source {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    if text.contains('\r') && !text.contains('\n') {
        return Source::new(name, &text.replace('\r', "\n"));
    }
    Source::new(name, text)
}

/// A source with settings. A text that is not TOML stays as it is, because its own problems are reported first.
fn with_settings(source: Source, settings: &[Setting]) -> Result<Source, ReadError> {
    if settings.is_empty() || Document::parse(&source).is_err() {
        return Ok(source);
    }
    let (text, located) = Setting::apply_located(&source.text, settings).map_err(ReadError::Setting)?;
    let mut given = Given { text: source.text.clone(), settings: Vec::new() };
    if let Some(earlier) = &source.given {
        given = Given::clone(earlier);
    }
    given.settings.extend(located);
    Ok(Source { text: text.into(), given: Some(Arc::new(given)), ..source })
}
