//! Values of operators: those that the scenario has recorded, and any other at the current positions.

use concordem::assembly::samples;
use concordem::program::Failure;
use concordem::sampling::{Operator, ScheduledOperator};
use concordem::scenario::{ReadError, Scenario, Setting};
use concordem::schedule::simulation::OperatorRow;
use concordem::state::{Cell, Particles};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{TableColumn, scalars, table};
use crate::errors::{OrRaise, Raise, caught, of_call};
use crate::scenario::{shown, table_of};

/// Shape of the values of a quantity with this number of components: per row and per cell if there are several.
fn shape(rows: Option<usize>, cells: usize, components: usize) -> Vec<usize> {
    let tail: &[usize] = match components {
        1 => &[],
        9 => &[3, 3],
        n => &[n],
    };
    rows.into_iter().chain((cells > 1).then_some(cells)).chain(tail.iter().copied()).collect()
}

/// The records of the operators so far, by name.
pub fn recorded<'py>(
    py: Python<'py>,
    operators: &[ScheduledOperator],
    records: &[Vec<OperatorRow>],
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (operator, entries) in operators.iter().zip(records) {
        let times: Vec<f64> = entries.iter().map(|row| row.time).collect();
        let steps: Vec<u64> = entries.iter().map(|row| row.step).collect();
        let mut columns = vec![
            TableColumn { name: "time".into(), unit: "s".into(), values: scalars(py, &times).into_any() },
            TableColumn { name: "step".into(), unit: "1".into(), values: scalars(py, &steps).into_any() },
        ];
        let (cells, mut first) = (operator.cells(), 0);
        for quantity in operator.operator.quantities() {
            let last = first + quantity.components * cells;
            let values: Vec<f64> = entries.iter().flat_map(|row| row.values[first..last].iter().copied()).collect();
            let shape = shape(Some(entries.len()), cells, quantity.components);
            let values = scalars(py, &values).call_method1("reshape", (shape,))?;
            columns.push(TableColumn { name: quantity.name.into(), unit: quantity.unit.into(), values });
            first = last;
        }
        dict.set_item(&operator.name, table(py, columns)?)?;
    }
    Ok(dict)
}

/// The values of one evaluation, by quantity.
pub fn by_quantity<'py>(py: Python<'py>, sample: &ScheduledOperator, values: &[f64]) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let (cells, mut rest) = (sample.cells(), values);
    for quantity in sample.operator.quantities() {
        let (own, others) = rest.split_at(quantity.components * cells);
        rest = others;
        let shape = shape(None, cells, quantity.components);
        if shape.is_empty() {
            dict.set_item(quantity.name, own[0])?;
        } else {
            dict.set_item(quantity.name, scalars(py, own).call_method1("reshape", (shape,))?)?;
        }
    }
    Ok(dict)
}

/// An operator with options as in a table `[[sample]]`, for particles of a scenario; `function`: what was called. The scenario with this table in addition is checked as any
/// other, so that the options mean what they mean there.
pub fn scheduled(
    py: Python<'_>,
    inner: &Scenario,
    (particles, cell): (&Particles, Option<&Cell>),
    (function, operator): (&str, &str),
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<ScheduledOperator> {
    // Messages begin with the call.
    let mut call = format!("{function}({operator:?}");
    for (key, value) in options.into_iter().flatten() {
        call.extend([", ".into(), key.to_string(), "=".into(), shown(&value)?]);
    }
    call += ")";
    let mut own = options.map_or_else(|| Ok(toml::Table::new()), |options| table_of(options.as_any(), ""))?;
    if let Some(key) = ["name", "interval"].into_iter().find(|key| own.contains_key(*key)) {
        return Err(PyValueError::new_err(format!("{call}: {key} is for tables [[sample]] of a scenario; remove it")));
    }
    let taken = |name: &String| inner.samples.iter().any(|sample| sample.name() == name);
    // One of these names is free.
    let mut names = (0..=inner.samples.len()).map(|k| format!("sample {k}"));
    let name = names.find(|name| !taken(name)).unwrap_or_default();
    own.insert("operator".into(), operator.into());
    own.insert("name".into(), name.into());
    let tables: toml::Table =
        toml::from_str(&inner.source.text).map_err(|error| PyValueError::new_err(error.to_string()))?;
    let mut list = tables.get("sample").and_then(toml::Value::as_array).cloned().unwrap_or_default();
    list.push(own.into());
    let path = format!("sample[{}]", list.len() - 1);
    let setting = Setting::of_python("sample", toml::Value::from(list).to_string(), "[...]");
    let with = match caught(|| setting.map_err(ReadError::Setting).and_then(|setting| inner.with_settings(&[setting])))?
    {
        Err(ReadError::Scenario(error)) => return Err(of_call(&call, &path, &error)),
        other => other.or_raise()?,
    };
    let sample = with.samples.last().ok_or_else(|| PyValueError::new_err("the scenario has no [[sample]]"))?;
    let made = py.detach(|| samples::one(&with, particles, cell, &path, sample));
    made.map_err(|error| match Failure::of_assembly(&with, error) {
        Failure::Scenario(error) => of_call(&call, &path, &error),
        other => other.raise(),
    })
}

/// The operators that `Simulation.sample` and tables `[[sample]]` accept: what each gives, by its name.
#[pyfunction]
fn sampled_operators(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let dict = PyDict::new(py);
    for operator in Operator::ALL {
        dict.set_item(operator.name(), operator.definition().meaning)?;
    }
    Ok(dict)
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(sampled_operators, module)?)
}
