//! Section of the report: program, settings, and scenarios of the runs.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::Run;
use super::html::escape;
use crate::output::OutputError;

/// Name of an entry with its unit behind a comma.
fn readable(name: &str) -> String {
    let units = [("_s", ", s"), ("_pa", ", Pa"), ("_m", ", m"), ("_utc", ", UTC")];
    let found = units.iter().find_map(|(end, unit)| Some(name.strip_suffix(end)?.replace('_', " ") + unit));
    found.unwrap_or_else(|| name.replace('_', " "))
}

pub(super) fn section(runs: &[Run]) -> Result<String, OutputError> {
    let mut names: Vec<String> = vec!["state hash".into()];
    let mut columns = Vec::new();
    for run in runs {
        let mut entries = BTreeMap::from([("state hash".to_owned(), run.file.state_hash()?)]);
        for (name, value) in run.file.provenance()? {
            let name = readable(&name);
            if !names.contains(&name) {
                names.push(name.clone());
            }
            entries.insert(name, value);
        }
        columns.push(entries);
    }
    let mut html = String::from("<h2>Provenance</h2>\n<div class=\"scroll\" tabindex=\"0\"><table>\n<tr><td></td>");
    for run in runs {
        let _ = write!(html, "<th>{}</th>", escape(&run.name));
    }
    html += "</tr>\n";
    for name in names {
        let values: Vec<&str> = columns.iter().map(|column| column.get(&name).map_or("–", String::as_str)).collect();
        let _ = write!(html, "<tr><td>{}</td>", escape(&name));
        if values.len() > 1 && values.iter().all(|value| *value == values[0]) {
            let _ = write!(html, "<td class=\"value\" colspan=\"{}\">{}</td>", values.len(), escape(values[0]));
        } else {
            for value in values {
                let _ = write!(html, "<td class=\"value\">{}</td>", escape(value));
            }
        }
        html += "</tr>\n";
    }
    html += "</table></div>\n";
    for run in runs {
        let _ = writeln!(
            html,
            "<details><summary>Scenario of {}</summary><pre>{}</pre></details>",
            escape(&run.name),
            escape(&run.file.scenario()?)
        );
    }
    Ok(html)
}
