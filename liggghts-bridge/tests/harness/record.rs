//! What long runs of random and public decks found: `validation/results/host-decks.json`, written by `make host-decks`.

use std::path::PathBuf;

use serde::Serialize;
use serde_json::{Map, Value};

/// Put `value` at `keys` of the file that `CONCORDEM_HOST_RECORD` names; without it, nothing is recorded.
pub fn put(keys: &[&str], value: impl Serialize) {
    let Some(file) = std::env::var_os("CONCORDEM_HOST_RECORD").map(PathBuf::from) else { return };
    let text = std::fs::read_to_string(&file).unwrap_or_else(|_| "{}".to_owned());
    let mut all: Value = serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let mut at = &mut all;
    for key in keys {
        if !at.is_object() {
            *at = Value::Object(Map::new());
        }
        at = &mut at[*key];
    }
    *at = serde_json::to_value(value).unwrap();
    std::fs::write(&file, serde_json::to_string_pretty(&all).unwrap() + "\n").unwrap();
}
