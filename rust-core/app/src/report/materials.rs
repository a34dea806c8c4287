//! Section of the report: the materials of the runs, as their scenarios give them.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::html::escape;
use super::{OutputError, Run};

/// A table for all runs with the same materials: one column for each material, one row for each of their keys.
pub(super) fn section(runs: &[Run]) -> Result<String, OutputError> {
    let mut kinds: Vec<(toml::Value, Vec<&str>)> = Vec::new();
    for run in runs {
        let scenario: toml::Table = toml::from_str(&run.file.scenario()?).unwrap_or_default();
        let Some(materials) = scenario.get("material") else { continue };
        match kinds.iter_mut().find(|(other, _)| other == materials) {
            Some((_, names)) => names.push(&run.name),
            None => kinds.push((materials.clone(), vec![&run.name])),
        }
    }
    let mut html = String::new();
    let is_one = kinds.len() == 1;
    for (materials, files) in &kinds {
        let Some(materials) = materials.as_array() else { continue };
        if !is_one {
            let _ = writeln!(html, "<h3>{}</h3>", escape(&files.join(", ")));
        }
        html += &table(materials);
    }
    Ok(if html.is_empty() { html } else { format!("<h2>Materials</h2>\n{html}") })
}

fn table(materials: &[toml::Value]) -> String {
    let name = |material: &toml::Value| material.get("name").and_then(toml::Value::as_str).unwrap_or("–").to_owned();
    let mut rows: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for (at, material) in materials.iter().enumerate() {
        for (key, value) in material.as_table().into_iter().flatten().filter(|(key, _)| *key != "name") {
            let mut set = |key: String, value: &toml::Value| {
                let row = rows.entry(key).or_insert_with(|| vec!["–".to_owned(); materials.len()]);
                row[at] = shown(value);
            };
            let words = key.replace('_', " ");
            match value.as_table() {
                Some(table) => {
                    for (own, value) in table {
                        set(format!("{words}: {}", own.replace('_', " ")), value);
                    }
                }
                None => set(words, value),
            }
        }
    }
    let cells = |tag: &str, values: Vec<String>| -> String {
        let cell = |value: &String| format!("<{tag} class=\"number\">{}</{tag}>", escape(value));
        values.iter().map(cell).collect::<Vec<String>>().concat()
    };
    let head = cells("th", materials.iter().map(name).collect());
    let mut html = format!("<div class=\"scroll\" tabindex=\"0\"><table>\n<tr><th>property</th>{head}</tr>\n");
    for (key, values) in rows {
        let _ = writeln!(html, "<tr><td>{}</td>{}</tr>", escape(&key), cells("td", values));
    }
    html + "</table></div>\n"
}

/// A value as the scenario has it: texts, which have their unit, without quotes.
fn shown(value: &toml::Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), |text| text.replace("^2", "²").replace("^3", "³"))
}
