//! Series and sampled operators as comma-separated text.

use std::fmt::Write;
use std::path::Path;

use super::error::OutputError;
use super::result::ResultFile;
use super::sealed;
use concordem_scenario::sampling::Operator;
use concordem_solver::state::columns::{ColumnData, StoredColumn};

/// A column: its header, its steps, and one value per step.
struct Column {
    head: String,
    steps: std::rc::Rc<Vec<u64>>,
    values: Vec<f64>,
}

/// Text of all series and sampled operators of a result: a header with names and units in square brackets, then one line per
/// step with samples. Columns of an operator are called `OPERATOR QUANTITY`, with the axes of a component (`_xx`, `_y`); the
/// cells of a grid are numbered. A field is empty if its column has no sample at this step. Numbers read back have the same
/// bits.
pub fn text(result: &ResultFile) -> Result<String, OutputError> {
    let mut columns = Vec::new();
    let steps_of = |values: &[f64]| std::rc::Rc::new(values.iter().map(|step| *step as u64).collect::<Vec<u64>>());
    for series in result.series() {
        // Without a series `step` (every run of a scenario has one), number the records.
        let steps = if result.has_series("step") {
            steps_of(&result.samples("step")?)
        } else {
            std::rc::Rc::new((0..result.samples(&series.name)?.len() as u64).collect())
        };
        let head = format!("{} [{}]", series.name, series.unit);
        let values = result.samples(&series.name)?;
        if values.len() != steps.len() {
            let problem =
                format!("`samples/{}` has {} values, but there are {} steps", series.name, values.len(), steps.len());
            return Err(OutputError::Damaged { path: result.path().to_owned(), problem });
        }
        columns.push(Column { head, steps, values });
    }
    for operator in result.operators()? {
        let table = result.rows(&format!("samples/{operator}"))?;
        let steps = table.iter().find(|(name, _)| name == "step").map_or_else(Vec::new, |(_, column)| reals(column));
        let steps = steps_of(&steps);
        for (quantity, column) in table.iter().filter(|(name, _)| name != "step" && name != "time") {
            let unit = result.unit(&format!("samples/{operator}"), quantity)?;
            columns.extend(components([&operator, quantity, &unit], column, &steps));
        }
    }
    let mut rows: Vec<u64> = columns.iter().flat_map(|column| column.steps.iter().copied()).collect();
    rows.sort_unstable();
    rows.dedup();
    let heads: Vec<String> = columns.iter().map(|column| field(&column.head)).collect();
    let mut text = heads.join(",");
    text.push('\n');
    let mut next = vec![0; columns.len()];
    for step in rows {
        for (k, column) in columns.iter().enumerate() {
            if k > 0 {
                text.push(',');
            }
            if column.steps.get(next[k]) == Some(&step) {
                // The shortest digits that restore the number. Writing to a string cannot fail.
                let _ = write!(text, "{:?}", column.values[next[k]]);
                next[k] += 1;
            }
        }
        text.push('\n');
    }
    Ok(text)
}

/// The numbers of a column.
fn reals(column: &StoredColumn) -> Vec<f64> {
    match &column.data {
        ColumnData::F64(data) => data.clone(),
        ColumnData::U64(data) => data.iter().map(|&number| number as f64).collect(),
        _ => Vec::new(),
    }
}

/// The components of an operator's quantity as columns; `names`: operator, quantity, unit.
fn components(names: [&str; 3], column: &StoredColumn, steps: &std::rc::Rc<Vec<u64>>) -> Vec<Column> {
    const AXES: [&str; 3] = ["x", "y", "z"];
    let [operator, quantity, unit] = names;
    let (data, count) = (reals(column), column.components.max(1));
    let quantities = Operator::ALL.into_iter().flat_map(|operator| operator.quantities().iter());
    let each = quantities.clone().find(|q| q.name == quantity && q.unit == unit).map_or(1, |q| q.components);
    let suffix = |k: usize| {
        let axes = match each {
            3 => format!("_{}", AXES[k % 3]),
            9 => format!("_{}{}", AXES[k % 9 / 3], AXES[k % 3]),
            _ => String::new(),
        };
        // Cells of a grid, x fastest.
        if count == each { axes } else { format!("{axes}_{}", k / each) }
    };
    let of = |k: usize| Column {
        head: format!("{operator} {quantity}{} [{unit}]", suffix(k)),
        steps: steps.clone(),
        values: data.iter().skip(k).step_by(count).copied().collect(),
    };
    (0..count).map(of).collect()
}

/// Writes all series of a result to a file; fails if the file exists, unless `overwrite` is set.
pub fn write(result: &ResultFile, path: &Path, overwrite: bool) -> Result<(), OutputError> {
    if !overwrite && path.exists() {
        return Err(OutputError::Exists { path: path.to_owned() });
    }
    sealed::write_text(path, &text(result)?)
}

/// A field of the header, quoted if necessary (RFC 4180).
fn field(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}
