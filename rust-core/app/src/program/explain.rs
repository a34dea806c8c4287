//! `concordem explain`: what a key of a scenario means.

use std::fmt::Write as _;

use super::{Console, Facts, Failure};
pub use concordem_scenario::checks::KeyInfo;
use concordem_scenario::checks::{find_keys, keys};

/// Arguments of `concordem explain`.
#[derive(Debug, clap::Args)]
pub(super) struct ExplainArguments {
    /// Key: its path (`loading.strain_rate`) or its name (`young`); by default, list all tables
    key: Option<String>,
}

/// Width of the text.
const WIDTH: usize = 100;

pub(super) fn explain(arguments: &ExplainArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    let all = keys(&concordem_scenario::schema::schema());
    let Some(word) = &arguments.key else {
        return console.print(&overview(&all));
    };
    let tables: Vec<String> = explained(word)?.iter().map(|key| page(key, &all)).collect();
    console.print(&tables.join("\n"))
}

/// The keys of a scenario with this path or name.
///
/// # Errors
/// There is none; with the names that are similar.
pub fn explained(word: &str) -> Result<Vec<KeyInfo>, Failure> {
    let all = keys(&concordem_scenario::schema::schema());
    let (found, exact) = find_keys(&all, word);
    if exact {
        return Ok(found.into_iter().cloned().collect());
    }
    let hint = match &found[..] {
        [] => "`concordem explain` lists the tables".to_owned(),
        similar => {
            let paths: Vec<String> = similar.iter().map(|key| format!("`{}`", key.path)).collect();
            format!("did you mean {}?", paths.join(" or "))
        }
    };
    Err(Failure::Usage(format!("a scenario has no key `{word}`; {hint}")))
}

/// All tables, and the top-level keys.
fn overview(all: &[KeyInfo]) -> String {
    let mut facts = Facts::default();
    for key in all.iter().filter(|key| !key.path.contains('.')) {
        let meaning = key.description.split(". ").next().unwrap_or_default().trim_end_matches('.');
        facts.add(&key.path, meaning);
    }
    format!(
        "Keys of a scenario; `concordem explain KEY` explains one, `explain TABLE` lists the keys of a table:\n{facts}"
    )
}

/// The description of a key; of a table, also its keys.
fn page(key: &KeyInfo, all: &[KeyInfo]) -> String {
    let mut text = format!("{}: {}", key.path, key.value);
    if !key.kinds.is_empty() {
        let _ = write!(text, ", with kind {}", quoted(&key.kinds));
    }
    text += if key.required { "; required\n" } else { "; optional\n" };
    text += &wrapped(&key.description, "  ");
    for (word, meaning) in &key.words {
        let line = if meaning.is_empty() { format!("\"{word}\"") } else { format!("\"{word}\": {meaning}") };
        text += &wrapped(&line, "    ");
    }
    let inner = |other: &&KeyInfo| {
        other
            .path
            .strip_prefix(&key.path)
            .and_then(|rest| rest.strip_prefix('.'))
            .is_some_and(|rest| !rest.contains('.'))
    };
    let mut facts = Facts::default();
    for other in all.iter().filter(inner) {
        let name = other.path.rsplit('.').next().unwrap_or_default();
        let kinds = if other.kinds.is_empty() { String::new() } else { format!(" [{}]", other.kinds.join(", ")) };
        let meaning = other.description.split(". ").next().unwrap_or_default().trim_end_matches('.');
        facts.add(name, format!("{meaning}{kinds}"));
    }
    if facts.0.is_empty() { text } else { format!("{text}  Keys:\n{facts}") }
}

fn quoted(words: &[String]) -> String {
    words.iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(", ")
}

/// A text in lines of at most [`WIDTH`] characters.
fn wrapped(text: &str, indent: &str) -> String {
    let mut out = String::new();
    let mut line = indent.to_owned();
    for word in text.split_whitespace() {
        if line.chars().count() + word.chars().count() + 1 > WIDTH && line.trim() != "" {
            let _ = writeln!(out, "{}", line.trim_end());
            indent.clone_into(&mut line);
        }
        line += word;
        line.push(' ');
    }
    let _ = writeln!(out, "{}", line.trim_end());
    out
}
