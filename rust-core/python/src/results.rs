//! Result files of finished runs.

use std::path::{Path, PathBuf};

use concordem::fracture::Event;
use concordem::output::ResultFile;
use concordem::output::crack_faces::{CrackFace, CrackFaces};
use concordem::state::columns::{ColumnData, StoredColumn};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{TableColumn, rows, scalars, table, vectors};
use crate::errors::{OrRaise, caught};

/// A result file of a finished run. Opening it verifies the file.
#[pyclass(frozen, name = "Result", module = "concordem")]
pub struct PyResultFile(ResultFile);

impl PyResultFile {
    /// Open and verify a file.
    pub fn of_path(path: &Path) -> PyResult<Self> {
        caught(|| ResultFile::open(path))?.or_raise().map(Self)
    }

    /// The file.
    pub fn file(&self) -> &ResultFile {
        &self.0
    }
}

fn array<'py>(py: Python<'py>, column: &StoredColumn) -> PyResult<Bound<'py, PyAny>> {
    let flat = match &column.data {
        ColumnData::F64(data) => scalars(py, data).into_any(),
        ColumnData::U64(data) => scalars(py, data).into_any(),
        ColumnData::U32(data) => scalars(py, data).into_any(),
        ColumnData::U16(data) => scalars(py, data).into_any(),
        ColumnData::U8(data) => scalars(py, data).into_any(),
        ColumnData::I8(data) => scalars(py, data).into_any(),
    };
    if column.components == 1 { Ok(flat) } else { flat.call_method1("reshape", (-1_i64, column.components)) }
}

#[pymethods]
impl PyResultFile {
    #[new]
    fn new(path: PathBuf) -> PyResult<Self> {
        Self::of_path(&path)
    }
    /// Path of the file.
    #[getter]
    fn path(&self) -> PathBuf {
        self.0.path().to_owned()
    }
    /// The time series, a structured array; `concordem.units` gives the units.
    #[getter]
    fn samples<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let columns: PyResult<Vec<_>> = self
            .0
            .series()
            .iter()
            .map(|series| {
                let values = caught(|| self.0.samples(&series.name))?.or_raise()?;
                let values = scalars(py, &values).into_any();
                Ok(TableColumn { name: series.name.clone(), unit: series.unit.clone(), values })
            })
            .collect();
        table(py, columns?)
    }
    /// The event log, a structured array.
    #[getter]
    fn events<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        events(py, &caught(|| self.0.events())?.or_raise()?)
    }
    /// The crack faces, a structured array with one row for each bond that broke or whose damage passed `output.events_damage`, and whose particles
    /// have a common face: `time`, ids `a` and `b`, `position`, `area` times normal, `opening` along it and `slip` across it until the last snapshot.
    #[getter]
    fn cracks<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        cracks(py, &caught(|| CrackFaces::of(&self.0))?.or_raise()?.faces)
    }
    /// Names of the recorded operators; `table("samples/NAME")` returns their columns.
    #[getter]
    fn operators(&self) -> PyResult<Vec<String>> {
        caught(|| self.0.operators())?.or_raise()
    }
    /// Names of the laws with contacts.
    #[getter]
    fn laws(&self) -> PyResult<Vec<String>> {
        caught(|| self.0.laws())?.or_raise()
    }
    /// Properties of the specimen by symbol, in SI units, as `concordem info` prints and a sweep records them: `E`, `E_gauge` (of the middle
    /// half), `f_t`, `f_c`, `strain_at_peak`, `f_fl`, `f_st`, `K_Ic`, `G_F`, as far as the test defines them. `rises_at_end` is 1 if the
    /// stress still rises at the end of the run, so that its largest value is no strength, else 0. Empty without a test.
    #[getter]
    fn properties<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for (symbol, value) in caught(|| concordem::report::properties(&self.0))?.or_raise()? {
            dict.set_item(symbol, value)?;
        }
        Ok(dict)
    }
    /// Columns of a table by name.
    fn table<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for (name, column) in caught(|| self.0.table(name))?.or_raise()? {
            dict.set_item(name, array(py, &column)?)?;
        }
        Ok(dict)
    }
    /// Times of the snapshots, s.
    #[getter]
    fn snapshot_times<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(scalars(py, &caught(|| self.0.snapshot_times())?.or_raise()?).into_any())
    }
    /// Text of the scenario.
    #[getter]
    fn scenario_text(&self) -> PyResult<String> {
        caught(|| self.0.scenario())?.or_raise()
    }
    /// Hash of the state at the end.
    #[getter]
    fn state_hash(&self) -> PyResult<String> {
        caught(|| self.0.state_hash())?.or_raise()
    }
    /// Provenance of the result: names and values.
    #[getter]
    fn provenance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for (name, value) in caught(|| self.0.provenance())?.or_raise()? {
            dict.set_item(name, value)?;
        }
        Ok(dict)
    }
    /// Table of the main facts, for notebooks.
    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("concordem._html")?.call_method1("result", (slf,))
    }

    fn __repr__(&self) -> String {
        format!("<concordem.Result {}>", self.0.path().display())
    }
}

/// The event log as a table.
pub fn events<'py>(py: Python<'py>, events: &[Event]) -> PyResult<Bound<'py, PyAny>> {
    fn of<'py, T: numpy::Element + Copy>(py: Python<'py>, events: &[Event], get: fn(&Event) -> T) -> Bound<'py, PyAny> {
        let values: Vec<T> = events.iter().map(get).collect();
        scalars(py, &values).into_any()
    }
    let positions: Vec<_> = events.iter().map(|event| event.position).collect();
    let shares: Vec<[f64; 4]> = events.iter().map(|event| event.mode_shares).collect();
    let columns = [
        ("time", "s", of(py, events, |e| e.time)),
        ("step", "1", of(py, events, |e| e.step)),
        ("a", "1", of(py, events, |e| e.id_a)),
        ("b", "1", of(py, events, |e| e.id_b)),
        ("position", "m", vectors(py, &positions)?.into_any()),
        ("mode_shares", "1", rows::<_, f64>(py, &shares, 4)?.into_any()),
        ("in_shear", "1", of(py, events, |e| e.in_shear)),
        ("energy", "J", of(py, events, |e| e.energy)),
        ("damage", "1", of(py, events, |e| e.damage)),
        ("joint", "1", of(py, events, |e| e.joint.unwrap_or(u16::MAX))),
    ];
    let column = |(name, unit, values): (&str, &str, _)| TableColumn { name: name.into(), unit: unit.into(), values };
    table(py, columns.into_iter().map(column).collect())
}

fn cracks<'py>(py: Python<'py>, faces: &[CrackFace]) -> PyResult<Bound<'py, PyAny>> {
    fn of<'py, T: numpy::Element + Copy>(
        py: Python<'py>,
        all: &[CrackFace],
        get: fn(&CrackFace) -> T,
    ) -> Bound<'py, PyAny> {
        let values: Vec<T> = all.iter().map(get).collect();
        scalars(py, &values).into_any()
    }
    let positions: Vec<_> = faces.iter().map(|face| face.event.position).collect();
    let areas: Vec<_> = faces.iter().map(|face| face.area).collect();
    let shares: Vec<[f64; 4]> = faces.iter().map(|face| face.event.mode_shares).collect();
    let columns = [
        ("time", "s", of(py, faces, |face| face.event.time)),
        ("a", "1", of(py, faces, |face| face.event.id_a)),
        ("b", "1", of(py, faces, |face| face.event.id_b)),
        ("position", "m", vectors(py, &positions)?.into_any()),
        ("area", "m^2", vectors(py, &areas)?.into_any()),
        ("opening", "m", of(py, faces, CrackFace::opening)),
        ("slip", "m", of(py, faces, CrackFace::slip)),
        ("mode_shares", "1", rows::<_, f64>(py, &shares, 4)?.into_any()),
        ("energy", "J", of(py, faces, |face| face.event.energy)),
        ("damage", "1", of(py, faces, |face| face.event.damage)),
    ];
    let column = |(name, unit, values): (&str, &str, _)| TableColumn { name: name.into(), unit: unit.into(), values };
    table(py, columns.into_iter().map(column).collect())
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PyResultFile>()
}
