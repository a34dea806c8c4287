//! Section of the report: the operators that were evaluated during the run (`[[sample]]`).

use std::fmt::Write as _;

use super::Run;
use super::chart::{Axis, Chart, Series, Style};
use super::hopkinson::Bars;
use super::html::{escape, number};
use crate::output::OutputError;
use concordem_scenario::sampling::Operator;
use concordem_solver::state::columns::{ColumnData, StoredColumn};

/// Colors of the components of a quantity.
const COLORS: [&str; 6] = ["#1f6fb4", "#c8501e", "#3f8f5a", "#7d57a8", "#b08a00", "#4a5560"];

/// One chart per operator and quantity, over the strain of the specimen, or over time if it is not strained. Maps (`grid`) have no chart.
pub(super) fn section(runs: &[Run]) -> Result<String, OutputError> {
    let mut charts = String::new();
    let (mut maps, mut constants) = (Vec::new(), Vec::new());
    for (r, run) in runs.iter().enumerate() {
        let bars = run.scenario.as_ref().and_then(Bars::of);
        // The pulses of a Hopkinson bar have their own charts.
        let is_pulse = |name: &String| bars.as_ref().is_some_and(|bars| bars.names().contains(name));
        for operator in run.file.operators()?.into_iter().filter(|name| !is_pulse(name)) {
            let group = format!("samples/{operator}");
            let table = run.file.rows(&group)?;
            let reals = |name: &str| table.iter().find(|(other, _)| other == name).map(|(_, column)| numbers(column));
            let (Some(time), Some(step)) = (reals("time"), reals("step")) else { continue };
            let (along, x) = abscissa(run, &time, &step)?;
            for (quantity, column) in table.iter().filter(|(name, _)| name != "time" && name != "step") {
                let Some(parts) = components(quantity, column.components) else {
                    maps.push(format!("{operator} {quantity}"));
                    continue;
                };
                let (unit, factor) = readable(&run.file.unit(&group, quantity)?);
                let words = quantity.replace('_', " ");
                let values: Vec<f64> = numbers(column).into_iter().map(|value| value * factor).collect();
                let of = if runs.len() > 1 { format!(", {}", run.label()) } else { String::new() };
                if let Some(constant) = constant(&values, column.components) {
                    let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
                    constants.push(format!("{operator}, {words}{of}: {}{unit}", number(constant)));
                    continue;
                }
                let series = parts.iter().zip(COLORS).map(|((part, at), color)| Series {
                    name: part.clone(),
                    color,
                    style: Style::Line,
                    points: (along.iter().copied())
                        .zip(values.iter().skip(*at).step_by(column.components).copied())
                        .collect(),
                    in_legend: parts.len() > 1,
                    marks_peak: false,
                });
                let chart = Chart {
                    id: format!("sample-{r}-{}", identifier(&format!("{operator}-{quantity}"))),
                    title: format!("{operator}, {words}, of {}", run.name),
                    x: Axis::new(&x),
                    y: Axis::new(&if unit == "1" { words.clone() } else { format!("{words}, {unit}") }),
                    series: series.collect(),
                    legend: parts.len() > 1,
                    ..Chart::default()
                };
                let heading = escape(&format!("{operator}, {words}{of}"));
                let _ = writeln!(charts, "<div><h3>{heading}</h3>{}</div>", chart.html());
            }
        }
    }
    if charts.is_empty() && maps.is_empty() && constants.is_empty() {
        return Ok(String::new());
    }
    let mut html = format!("<h2>Samples</h2>\n<div class=\"pair\">\n{charts}</div>\n");
    if !constants.is_empty() {
        let list = escape(&constants.join("; "));
        let _ = writeln!(html, "<p class=\"quiet\">Constant in all samples: {list}.</p>");
    }
    if !maps.is_empty() {
        let list = escape(&maps.join(", "));
        let _ = writeln!(html, "<p class=\"quiet\">Maps are in the result and in its CSV table only: {list}.</p>");
    }
    Ok(html)
}

/// The value of a single number that never changes; `None` for others, and for a single sample.
fn constant(values: &[f64], components: usize) -> Option<f64> {
    let (first, rest) = values.split_first()?;
    (components == 1 && !rest.is_empty() && rest.iter().all(|value| value == first)).then_some(*first)
}

/// A unit that fits specimens of the laboratory, and the factor of the values.
fn readable(unit: &str) -> (String, f64) {
    match unit {
        "Pa" => ("MPa".to_owned(), 1e-6),
        "m" => ("mm".to_owned(), 1e3),
        "m^2" => ("mm²".to_owned(), 1e6),
        "m^3" => ("mm³".to_owned(), 1e9),
        other => (other.to_owned(), 1.0),
    }
}

/// Abscissas of the samples, and the label of their axis.
fn abscissa(run: &Run, time: &[f64], step: &[f64]) -> Result<(Vec<f64>, String), OutputError> {
    if run.strain.iter().all(|strain| *strain == 0.0) || !run.file.has_series("step") {
        let is_short = time.iter().all(|time| *time < 1e-3);
        let (unit, factor) = if is_short { ("µs", 1e6) } else { ("ms", 1e3) };
        return Ok((time.iter().map(|time| time * factor).collect(), format!("time, {unit}")));
    }
    let steps = run.file.samples("step")?;
    let strain = |at: &f64| at_step(&steps, &run.strain, *at) * 1e3;
    let label = format!("{}, ‰", run.meaning.strain());
    Ok((step.iter().map(strain).collect(), label))
}

/// A series of records at a step: operators may be evaluated between two records.
pub(super) fn at_step(steps: &[f64], values: &[f64], at: f64) -> f64 {
    let next = steps.partition_point(|step| *step < at).min(steps.len().saturating_sub(1));
    let last = next.saturating_sub(1);
    let (from, to) = (steps[last], steps[next]);
    let share = if to > from { ((at - from) / (to - from)).clamp(0.0, 1.0) } else { 1.0 };
    values[last] + share * (values[next] - values[last])
}

/// The numbers of a column.
fn numbers(column: &StoredColumn) -> Vec<f64> {
    match &column.data {
        ColumnData::F64(data) => data.clone(),
        ColumnData::U64(data) => data.iter().map(|&number| number as f64).collect(),
        _ => Vec::new(),
    }
}

/// Names and places of the components to draw: of a tensor its symmetric part in six lines, if it has nine. `None` for maps.
fn components(quantity: &str, width: usize) -> Option<Vec<(String, usize)>> {
    let quantities = Operator::ALL.into_iter().flat_map(|operator| operator.quantities().iter());
    let mut single = quantities.filter(|q| q.name == quantity).map(|q| q.components);
    if !single.any(|components| components == width) {
        return None;
    }
    let named =
        |names: &[&str], at: &[usize]| names.iter().zip(at).map(|(name, at)| ((*name).to_owned(), *at)).collect();
    match width {
        1 => Some(vec![(quantity.replace('_', " "), 0)]),
        3 => Some(named(&["x", "y", "z"], &[0, 1, 2])),
        9 => Some(named(&["xx", "yy", "zz", "xy", "yz", "zx"], &[0, 4, 8, 1, 5, 6])),
        _ => None,
    }
}

/// A name as an identifier of the page.
pub(super) fn identifier(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '-' }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A number that never changes has no chart; a single sample, and a vector, have.
    #[test]
    fn constants_have_no_chart() {
        assert_eq!(constant(&[3.0, 3.0, 3.0], 1), Some(3.0));
        assert_eq!((constant(&[3.0, 3.1], 1), constant(&[3.0], 1), constant(&[0.0; 9], 9)), (None, None, None));
        assert_eq!(readable("m^3"), ("mm³".to_owned(), 1e9));
    }
}
