//! Scenarios from text, files, dictionaries, and keyword arguments.

use std::path::PathBuf;

use concordem::assembly::pack;
use concordem::program::recording::result_path;
use concordem::scenario::{self, Setting, TEMPLATES};
use numpy::ndarray::ArrayViewD;
use numpy::{PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::PyTypeInfo;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyString};

use crate::errors::{OrRaise, caught, of_assembly};
use crate::packing::packing_of;
use crate::warnings::warn;
use crate::work::guarded;

/// A scenario: the input of a run.
#[pyclass(frozen, module = "concordem")]
pub struct Scenario {
    /// The scenario.
    pub inner: scenario::Scenario,
    /// Folder of relative paths in the scenario.
    pub folder: PathBuf,
}

/// A Python value as TOML; `None` for `None`.
fn toml_of(object: &Bound<'_, PyAny>, key: &str) -> PyResult<Option<toml::Value>> {
    if object.is_none() {
        return Ok(None);
    }
    if let Some(value) = plain(object)? {
        return Ok(Some(value));
    }
    if object.hasattr("items")? {
        return Ok(Some(toml::Value::Table(table_of(object, key)?)));
    }
    if object.hasattr("__fspath__")? {
        return Ok(Some(toml::Value::String(object.call_method0("__fspath__")?.extract()?)));
    }
    // NumPy scalars become numbers, arrays become lists.
    let scalar = !object.hasattr("__len__")?;
    if scalar && object.hasattr("__index__")? {
        return Ok(Some(toml::Value::Integer(object.extract()?)));
    }
    if scalar && let Ok(real) = object.extract::<f64>() {
        return Ok(Some(toml::Value::Float(real)));
    }
    if let Ok(items) = object.try_iter() {
        let mut list = Vec::new();
        for (k, item) in items.enumerate() {
            list.extend(toml_of(&item?, &format!("{key}[{k}]"))?);
        }
        return Ok(Some(toml::Value::Array(list)));
    }
    Err(PyTypeError::new_err(format!(
        "{key} has type {}; give a number, string, boolean, list, or dictionary",
        object.get_type().name()?
    )))
}

/// A value of one of Python's own types, or an array of reals, as TOML. Asked first, because a question for an attribute that is missing costs
/// more than the number.
fn plain(object: &Bound<'_, PyAny>) -> PyResult<Option<toml::Value>> {
    if let Ok(real) = object.cast::<PyFloat>() {
        return Ok(Some(toml::Value::Float(real.value())));
    }
    if let Ok(flag) = object.cast::<PyBool>() {
        return Ok(Some(toml::Value::Boolean(flag.is_true())));
    }
    if object.is_instance_of::<PyInt>() {
        return Ok(Some(toml::Value::Integer(object.extract()?)));
    }
    if object.is_instance_of::<PyString>() {
        return Ok(Some(toml::Value::String(object.extract()?)));
    }
    // A subclass may carry a mask or units, which its items tell.
    if !object.get_type().is(PyUntypedArray::type_object(object.py())) {
        return Ok(None);
    }
    match object.cast::<PyArrayDyn<f64>>() {
        Ok(array) if array.ndim() > 0 => Ok(Some(list_of(&array.try_readonly()?.as_array()))),
        _ => Ok(None),
    }
}

/// The rows of an array as lists.
fn list_of(array: &ArrayViewD<'_, f64>) -> toml::Value {
    if array.ndim() == 1 {
        return toml::Value::Array(array.iter().map(|&real| toml::Value::Float(real)).collect());
    }
    toml::Value::Array(array.outer_iter().map(|row| list_of(&row)).collect())
}

/// Most characters of a value in a message.
const LONGEST_SHOWN: usize = 80;

/// A value as a user may have written it, for messages.
pub fn shown(value: &Bound<'_, PyAny>) -> PyResult<String> {
    if let Ok(text) = value.cast::<PyString>() {
        return Ok(format!("{:?}", text.to_cow()?));
    }
    let text = value.repr()?.to_string();
    let is_long = text.chars().count() > LONGEST_SHOWN;
    Ok(if is_long { text.chars().take(LONGEST_SHOWN).chain("...".chars()).collect() } else { text })
}

/// The TOML table of a mapping; `path`: its key, for messages.
pub fn table_of(mapping: &Bound<'_, PyAny>, path: &str) -> PyResult<toml::Table> {
    let mut table = toml::Table::new();
    for item in mapping.call_method0("items")?.try_iter()? {
        let (key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>) = item?.extract()?;
        let name: String =
            key.extract().map_err(|_| PyTypeError::new_err(format!("{path}: the key {key} is not a string")))?;
        let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
        if let Some(value) = toml_of(&value, &path)? {
            table.insert(name, value);
        }
    }
    Ok(table)
}

impl Scenario {
    /// A scenario that Python has given; its warnings go to Python.
    pub fn with_warnings(py: Python<'_>, inner: scenario::Scenario, folder: PathBuf) -> PyResult<Self> {
        warn(py, &inner, &caught(|| inner.warnings())?)?;
        Ok(Self { inner, folder })
    }

    /// The scenario of a file.
    pub fn of_file(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let inner = caught(|| scenario::Scenario::read(&path))?.or_raise()?;
        let folder = inner.directory();
        Self::with_warnings(py, inner, folder)
    }

    /// This scenario with other values; see `with_settings`.
    pub fn changed(&self, settings: &Bound<'_, PyAny>) -> PyResult<Self> {
        if !settings.hasattr("items")? {
            return Err(PyTypeError::new_err(
                "the settings are not a mapping; give a dictionary of key paths and values",
            ));
        }
        let mut list = Vec::new();
        for item in settings.call_method0("items")?.try_iter()? {
            let (key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>) = item?.extract()?;
            let key: String =
                key.extract().map_err(|_| PyTypeError::new_err(format!("the key {key} is not a string")))?;
            let shown = shown(&value)?;
            let value = toml_of(&value, &key)?
                .ok_or_else(|| PyTypeError::new_err(format!("{key} is None; a setting cannot remove a key")))?;
            list.push(Setting::of_python(&key, value.to_string(), &shown).map_err(PyValueError::new_err)?);
        }
        let inner = caught(|| self.inner.with_settings(&list))?.or_raise()?;
        Self::with_warnings(settings.py(), inner, self.folder.clone())
    }

    /// The scenario with a name in the folder of its paths, as the program needs it.
    pub fn in_folder(&self) -> Result<scenario::Scenario, scenario::ScenarioError> {
        if self.folder == self.inner.directory() {
            return Ok(self.inner.clone());
        }
        let name = self.folder.join(&*self.inner.source.name);
        scenario::Scenario::parse(&name.display().to_string(), self.text())
    }

    /// Result file of the scenario, if it has a name.
    pub fn result_path(&self) -> PyResult<PathBuf> {
        let named = !self.inner.source.name.starts_with('<');
        match &self.inner.output.file {
            Some(file) => Ok(self.folder.join(file)),
            None if named => Ok(result_path(&self.inner)),
            None => Err(PyValueError::new_err(
                "the scenario has neither a file nor a key output.file to name its result; give a path, such as \"run.h5\"",
            )),
        }
    }

    fn parse(py: Python<'_>, name: &str, text: &str, folder: PathBuf) -> PyResult<Self> {
        Self::with_warnings(py, caught(|| scenario::Scenario::parse(name, text))?.or_raise()?, folder)
    }

    fn of_mapping(mapping: &Bound<'_, PyAny>, folder: PathBuf) -> PyResult<Self> {
        let mut table = table_of(mapping, "")?;
        table.entry("version").or_insert(toml::Value::Integer(1));
        // Allow a single table instead of a list of tables.
        for key in ["material", "interface", "wall", "set", "prescribe", "clump", "force", "initial", "sample"] {
            if let Some(value) = table.get_mut(key)
                && value.is_table()
            {
                *value = toml::Value::Array(vec![value.clone()]);
            }
        }
        let text = toml::to_string(&table).map_err(|error| PyValueError::new_err(error.to_string()))?;
        Self::parse(mapping.py(), "<scenario>", &text, folder)
    }
}

#[pymethods]
impl Scenario {
    /// A scenario from its tables as keyword arguments. Raises ScenarioError if it is invalid.
    #[new]
    #[pyo3(signature = (**tables))]
    fn new(py: Python<'_>, tables: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let empty = PyDict::new(py);
        Self::of_mapping(tables.unwrap_or(&empty).as_any(), PathBuf::new())
    }

    /// A scenario from a mapping; paths in it are relative to `folder`. Raises ScenarioError if it is invalid.
    #[staticmethod]
    #[pyo3(signature = (mapping, folder=None))]
    fn from_dict(mapping: &Bound<'_, PyAny>, folder: Option<PathBuf>) -> PyResult<Self> {
        if !mapping.hasattr("items")? {
            return Err(PyTypeError::new_err("the scenario is not a mapping; give a dictionary of tables"));
        }
        Self::of_mapping(mapping, folder.unwrap_or_default())
    }

    /// A scenario from TOML text; `name` appears in messages. Raises ScenarioError if it is invalid.
    #[staticmethod]
    #[pyo3(signature = (text, name="<text>", folder=None))]
    fn from_text(py: Python<'_>, text: &str, name: &str, folder: Option<PathBuf>) -> PyResult<Self> {
        Self::parse(py, name, text, folder.unwrap_or_default())
    }

    /// A scenario from a TOML file; paths in it are relative to its folder. Raises ScenarioError if it is invalid.
    #[staticmethod]
    fn from_file(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        Self::of_file(py, path)
    }

    /// A scenario that is included in the program; see `templates`.
    #[staticmethod]
    fn template(py: Python<'_>, name: &str) -> PyResult<Self> {
        let template = scenario::template(name).ok_or_else(|| {
            let names: Vec<_> = TEMPLATES.iter().map(|template| template.name).collect();
            PyValueError::new_err(format!("there is no template \"{name}\"; choose one of {}", names.join(", ")))
        })?;
        Self::parse(py, template.name, template.text, PathBuf::new())
    }

    /// Names of the templates.
    #[staticmethod]
    fn templates() -> Vec<&'static str> {
        TEMPLATES.iter().map(|template| template.name).collect()
    }

    /// The TOML text.
    #[getter]
    fn text(&self) -> &str {
        &self.inner.source.text
    }

    /// Name of the file, or its substitute in messages.
    #[getter]
    fn name(&self) -> &str {
        &self.inner.source.name
    }

    /// Title.
    #[getter]
    fn title(&self) -> &str {
        &self.inner.title
    }

    /// This scenario with other values: key paths as in `--set` (`"material[0].cpm.young"`), values as in the constructor. A list is
    /// replaced as a whole. Messages begin with the setting as it is given here. Raises ScenarioError if the new scenario is invalid,
    /// ValueError if a key leads nowhere.
    ///
    /// >>> import concordem
    /// >>> slow = concordem.Scenario.template("cpm-small").with_settings({"loading.strain_rate": "0.2 1/s"})
    /// >>> slow.to_dict().get("loading").get("strain_rate")
    /// '0.2 1/s'
    fn with_settings(&self, settings: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.changed(settings)
    }

    /// The tables as a dictionary.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        py.import("tomllib")?.call_method1("loads", (self.text(),))
    }

    /// Create particles and bonds. Returns a Simulation. Raises AssemblyError if this is not possible.
    ///
    /// `bond_law`, `contact_law`: laws written in Python (`concordem.laws.Law`) that replace those of the scenario; `contact_law` acts
    /// without a bond, also with walls. `snapshots`: whether steps keep the snapshots that [output] asks for, in memory, so that
    /// `Simulation.write` has them; without, a result has only the present one.
    #[pyo3(signature = (threads=None, progress=None, bond_law=None, contact_law=None, snapshots=true))]
    fn simulation<'py>(
        slf: &Bound<'py, Self>,
        threads: Option<usize>,
        progress: Option<Bound<'py, PyAny>>,
        bond_law: Option<Bound<'py, PyAny>>,
        contact_law: Option<Bound<'py, PyAny>>,
        snapshots: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let options = (slf, threads, progress, bond_law, contact_law, snapshots);
        slf.py().import("concordem._core")?.getattr("Simulation")?.call_method1("_of", options)
    }

    /// Create only the packing. Returns Packing.
    #[pyo3(signature = (threads=None, progress=None))]
    fn pack<'py>(
        &self,
        py: Python<'py>,
        threads: Option<usize>,
        progress: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let made = guarded(py, threads, progress.as_ref(), |progress| pack(&self.inner, &self.folder, progress))?;
        packing_of(py, &made.map_err(|error| of_assembly(&self.inner, error))?)
    }

    /// Its text, for notebooks.
    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("concordem._html")?.call_method1("scenario", (slf,))
    }

    fn __repr__(&self) -> String {
        format!("<concordem.Scenario {}: {}>", self.inner.source.name, self.inner.title)
    }

    /// The text contains the settings; which of them `with_settings` gave is not kept by pickle.
    fn __eq__(&self, other: &Self) -> bool {
        let [one, two] = [self, other].map(|scenario| &scenario.inner.source);
        (&one.name, &one.text) == (&two.name, &two.text)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (String, String, String))> {
        let this = slf.get();
        let folder = this.folder.display().to_string();
        Ok((slf.get_type().getattr("from_text")?, (this.text().to_owned(), this.name().to_owned(), folder)))
    }
}

/// JSON Schema of scenarios or of sweeps, as text.
#[pyfunction]
#[pyo3(signature = (kind="scenario"))]
fn schema(kind: &str) -> PyResult<String> {
    match kind {
        "scenario" => Ok(scenario::schema().to_string()),
        "sweep" => Ok(concordem::sweep::schema().to_string()),
        _ => Err(PyValueError::new_err(format!("kind is \"{kind}\"; give \"scenario\" or \"sweep\""))),
    }
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Scenario>()?;
    module.add_function(wrap_pyfunction!(schema, module)?)
}
