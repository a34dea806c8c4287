//! The option `--set`, which replaces keys of a scenario.

use std::ffi::OsString;
use std::path::Path;

use super::Failure;
use concordem_scenario::schema::{Scenario, Setting};

/// Keys given on the command line.
#[derive(Debug, Clone, Default, clap::Args)]
pub(super) struct Settings {
    /// Replace or add a key of the scenario: --set packing.radius="2 mm" --set material[0].cpm.young="30 GPa". The result
    /// contains the scenario with these values
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = Setting::parse)]
    list: Vec<Setting>,
}

/// What is wrong if a key and its value are separate arguments: `--set KEY VALUE`.
pub(super) fn without_sign(arguments: &[OsString]) -> Option<String> {
    let texts: Vec<&str> = arguments.iter().filter_map(|argument| argument.to_str()).collect();
    texts.windows(3).find_map(|part| match part {
        ["--set", key, value] if !key.contains('=') && !value.starts_with('-') => {
            Some(format!("--set {key} {value}: write = between key and value, without spaces: --set {key}={value:?}"))
        }
        _ => None,
    })
}

/// Prefix of the names of provenance entries with settings.
const ENTRY: &str = "set_";

impl Settings {
    /// Whether there are none.
    pub(super) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// The settings, in the order given.
    pub(super) fn list(&self) -> &[Setting] {
        &self.list
    }

    /// Reads a scenario with these settings.
    pub(super) fn read(&self, path: &Path) -> Result<Scenario, Failure> {
        Ok(Scenario::read_with(path, &self.list)?)
    }

    /// A scenario that was read before, with these settings.
    pub(super) fn change(&self, scenario: &Scenario) -> Result<Scenario, Failure> {
        Ok(scenario.with_settings(&self.list)?)
    }

    /// Entries of the provenance; `before`: settings recorded earlier.
    pub(super) fn entries(&self, before: &Self) -> Vec<(String, String)> {
        let first = before.list.len() + 1;
        self.list
            .iter()
            .enumerate()
            .map(|(k, setting)| (format!("{ENTRY}{}", first + k), setting.given.clone()))
            .collect()
    }

    /// The settings recorded in a provenance.
    pub(super) fn recorded<'a>(provenance: impl IntoIterator<Item = (&'a str, &'a str)>) -> Self {
        let numbered = |(name, value): (&str, &str)| {
            let number: usize = name.strip_prefix(ENTRY)?.parse().ok()?;
            Some((number, Setting::parse(value).ok()?))
        };
        let mut list: Vec<(usize, Setting)> = provenance.into_iter().filter_map(numbered).collect();
        list.sort_by_key(|(number, _)| *number);
        Self { list: list.into_iter().map(|(_, setting)| setting).collect() }
    }

    /// These settings, then `later`, which win.
    pub(super) fn then(&self, later: &Self) -> Self {
        Self { list: self.list.iter().chain(&later.list).cloned().collect() }
    }
}
