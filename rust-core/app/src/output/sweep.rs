//! The files of a finished sweep: HDF5 (all data) and comma-separated text.
//!
//! | In the HDF5 file | |
//! |---|---|
//! | `sweep`, `scenario` | both files, as text |
//! | `axes/NAME` | values of an axis: numbers, or lines of text; of a sampled axis with `sampled` = 1, `from`, `to`, `scale` |
//! | `points/axis_K` | index of the value of axis K (from 0) at each point; all sampled axes have the same one |
//! | `points/young`, … | the quantities of [`outcome`](crate::sweep::outcome), one number per point, with unit and meaning |
//! | `points/stiffness` | of elastic sweeps: 36 numbers per point, Pa (11, 22, 33, 23, 31, 12; engineering shear strains) |
//! | `curves/NAME/x`, `curves/NAME/y` | of runs: abscissas, and ordinates with one row per point; each with name and unit |
//! | `problems` | one line per failed point: number and message |

use std::fmt::Write as _;
use std::path::Path;

use super::error::{At, OutputError};
use super::{hdf, sealed};
use crate::provenance;
use crate::sweep::outcome::{Outcome, STIFFNESS};
use crate::sweep::point::{Study, columns};
use crate::sweep::{Axis, Sweep};
use concordem_solver::state::columns::Column;

/// Writes the HDF5 file completely or not at all. Its content does not depend on when and how the points were computed.
///
/// # Errors
/// The file cannot be written.
pub fn write(path: &Path, sweep: &Sweep, outcomes: &[Outcome]) -> Result<(), OutputError> {
    sealed::write(path, &sealed::folder_of(path), |file| {
        hdf::write_identity(file, hdf::kind::SWEEP, path)?;
        for (name, value) in provenance::of_program() {
            hdf::write_text_attribute(file, &name, &value, path)?;
        }
        hdf::write_text(file, "sweep", &sweep.source.text, path)?;
        hdf::write_text(file, "scenario", &sweep.scenario_text, path)?;
        let axes = file.create_group("axes").at(path)?;
        for (k, axis) in sweep.axes.iter().enumerate() {
            let name = dataset_name(axis, k);
            if let Some(numbers) = numbers(axis) {
                let dataset = hdf::write_array(&axes, &name, &numbers, 1, path)?;
                if let Some(range) = axis.sampled {
                    hdf::write_attribute(&dataset, "sampled", &1_u8, path)?;
                    hdf::write_attribute(&dataset, "from", &range.from, path)?;
                    hdf::write_attribute(&dataset, "to", &range.to, path)?;
                    hdf::write_text_attribute(&dataset, "scale", range.scale.name(), path)?;
                }
            } else {
                let lines: Vec<String> = (0..axis.values.len()).map(|k| axis.text(k)).collect();
                hdf::write_text(&axes, &name, &lines.join("\n"), path)?;
            }
        }
        let points = file.create_group("points").at(path)?;
        for (k, axis) in sweep.axes.iter().enumerate() {
            let places: Vec<u32> = (0..outcomes.len()).map(|point| sweep.place(point)[k] as u32).collect();
            let description = format!("Value of the axis {}, counted from 0", axis.name);
            hdf::write_column(&points, &format!("axis_{k}"), &Column::u32(&places), "1", &description, path)?;
        }
        for (k, quantity) in sweep.quantities().iter().enumerate() {
            let values: Vec<f64> = outcomes.iter().map(|outcome| outcome.values[k]).collect();
            // Results of operators have names of several words.
            let name = quantity.name.replace(' ', "_");
            let column = Column::f64(&values, 1, "1");
            hdf::write_column(&points, &name, &column, &quantity.unit, &quantity.description, path)?;
        }
        if sweep.study == Study::Elastic {
            let first = sweep.quantities().len();
            let stiffness: Vec<f64> =
                outcomes.iter().flat_map(|outcome| outcome.values[first..].iter().copied()).collect();
            let description = "Stiffness, 6 by 6, row by row; 11, 22, 33, 23, 31, 12, engineering shear strains";
            hdf::write_column(&points, STIFFNESS, &Column::f64(&stiffness, 36, "Pa"), "Pa", description, path)?;
        }
        write_curves(file, sweep, outcomes, path)?;
        hdf::write_text(file, "problems", &problems(outcomes), path)
    })
}

fn write_curves(file: &hdf5::File, sweep: &Sweep, outcomes: &[Outcome], path: &Path) -> Result<(), OutputError> {
    for (k, curve) in sweep.curves.iter().enumerate() {
        let group = file.create_group(&format!("curves/{}", curve.name)).at(path)?;
        let ordinates: Vec<f64> = outcomes.iter().flat_map(|outcome| sweep.ordinates(k, outcome)).copied().collect();
        let x = hdf::write_array(&group, "x", &curve.abscissas, 1, path)?;
        let y = hdf::write_array(&group, "y", &ordinates, curve.abscissas.len(), path)?;
        for (dataset, series) in [(x, &curve.x), (y, &curve.y)] {
            hdf::write_text_attribute(&dataset, "name", &series.name, path)?;
            hdf::write_text_attribute(&dataset, "unit", &series.unit, path)?;
        }
    }
    Ok(())
}

/// One line per failed point.
pub fn problems(outcomes: &[Outcome]) -> String {
    outcomes.iter().enumerate().fold(String::new(), |mut text, (point, outcome)| {
        if let Some(problem) = &outcome.problem {
            let _ = writeln!(text, "{point}: {}", problem.replace('\n', " "));
        }
        text
    })
}

/// All points as comma-separated text: axes, quantities, stiffness, problem; without curves.
pub fn csv(sweep: &Sweep, outcomes: &[Outcome]) -> String {
    let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\"").replace('\n', " "));
    let mut heads: Vec<String> = sweep.axes.iter().map(|axis| quoted(&axis.name)).collect();
    let columns = columns(sweep);
    let count = columns.len();
    heads.extend(columns);
    heads.push("problem".into());
    let mut text = heads.join(",") + "\n";
    for (point, outcome) in outcomes.iter().enumerate() {
        for (axis, value) in sweep.axes.iter().zip(sweep.place(point)) {
            let _ = match axis.number(value) {
                Some(number) => write!(text, "{number:?},"),
                None => write!(text, "{},", quoted(&axis.text(value))),
            };
        }
        for value in &outcome.values[..count] {
            // As few digits as restore the number; empty for NaN.
            let _ = if value.is_nan() { write!(text, ",") } else { write!(text, "{value:?},") };
        }
        let _ = writeln!(text, "{}", outcome.problem.as_deref().map(quoted).unwrap_or_default());
    }
    text
}

fn numbers(axis: &Axis) -> Option<Vec<f64>> {
    (0..axis.values.len()).map(|k| axis.number(k)).collect()
}

/// A valid HDF5 name.
fn dataset_name(axis: &Axis, k: usize) -> String {
    format!("{k} {}", axis.name.replace(['/', '\0'], " over "))
}
