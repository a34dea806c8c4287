//! Description of a run before its first step, and its file `header.h5`.

use std::collections::BTreeMap;
use std::path::Path;

use super::folder::header_path;
use crate::output::error::{At, OutputError};
use crate::output::hdf::{self, kind};
use crate::output::sealed;

/// Description of one series: a number sampled during the run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SeriesColumn {
    /// Name of the series and of its dataset under `/samples`.
    pub name: String,
    /// SI unit; "1" for a pure number.
    pub unit: String,
    /// Description of the series.
    pub description: String,
}

impl SeriesColumn {
    /// A series.
    pub fn new(name: &str, unit: &str, description: &str) -> Self {
        Self { name: name.to_owned(), unit: unit.to_owned(), description: description.to_owned() }
    }
}

/// An operator evaluated during the run; it has its own table, `/samples/NAME`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OperatorTable {
    /// Name of the operator and of its group under `/samples`.
    pub name: String,
    /// The operator and its region, in words.
    pub description: String,
    /// Its quantities, each with its number of components.
    pub quantities: Vec<(SeriesColumn, usize)>,
}

impl OperatorTable {
    /// Numbers per row: time, step, and the components of all quantities.
    pub fn width(&self) -> usize {
        2 + self.quantities.iter().map(|(_, components)| components).sum::<usize>()
    }
}

/// Group of the series of the run that a run continues.
pub(in crate::output) const EARLIER: &str = "earlier";

/// Description of a run before its first step.
#[derive(Debug, Clone, PartialEq)]
pub struct RunHeader {
    /// Text of the scenario file.
    pub scenario: String,
    /// Pairs of name and value, written as attributes of `/provenance`; [`crate::provenance::of_program`] is added.
    pub provenance: Vec<(String, String)>,
    /// The series, in the order of the values of a sample.
    pub series: Vec<SeriesColumn>,
    /// Operators evaluated at their own intervals.
    pub operators: Vec<OperatorTable>,
    /// Values of series of the run that this one continues, by name: one test may go through several results.
    pub earlier: BTreeMap<String, Vec<f64>>,
}

/// Writes `header.h5` into the folder `parts`.
pub(super) fn write_header(parts: &Path, header: &RunHeader, run_id: &str) -> Result<(), OutputError> {
    let path = &header_path(parts);
    sealed::write(path, parts, |file| {
        hdf::write_identity(file, kind::HEADER, path)?;
        hdf::write_text_attribute(file, "run_id", run_id, path)?;
        hdf::write_text(file, "scenario", &header.scenario, path)?;
        let texts = |name: &str, values: Vec<(&str, &str)>| -> Result<(), OutputError> {
            let group = file.create_group(name).at(path)?;
            for (k, (key, value)) in values.into_iter().enumerate() {
                let entry = group.create_group(&format!("{k:06}")).at(path)?;
                hdf::write_text_attribute(&entry, "key", key, path)?;
                hdf::write_text_attribute(&entry, "value", value, path)?;
            }
            Ok(())
        };
        texts("provenance", header.provenance.iter().map(|(key, value)| (&key[..], &value[..])).collect())?;
        texts("units", header.series.iter().map(|series| (&series.name[..], &series.unit[..])).collect())?;
        texts("descriptions", header.series.iter().map(|s| (&s.name[..], &s.description[..])).collect())?;
        for (k, table) in header.operators.iter().enumerate() {
            let group = file.create_group(&format!("operator-{k:03}")).at(path)?;
            hdf::write_text_attribute(&group, "name", &table.name, path)?;
            hdf::write_text_attribute(&group, "description", &table.description, path)?;
            for (q, (column, components)) in table.quantities.iter().enumerate() {
                let entry = group.create_group(&format!("{q:03}")).at(path)?;
                hdf::write_text_attribute(&entry, "name", &column.name, path)?;
                hdf::write_text_attribute(&entry, "unit", &column.unit, path)?;
                hdf::write_text_attribute(&entry, "description", &column.description, path)?;
                hdf::write_attribute(&entry, "components", &(*components as u64), path)?;
            }
        }
        let earlier = file.create_group(EARLIER).at(path)?;
        header.earlier.iter().try_for_each(|(name, values)| hdf::write_array(&earlier, name, values, 1, path).map(drop))
    })
}

/// Reads the header and the identity of the run from `header.h5` in the folder `parts`.
pub(super) fn read_header(parts: &Path) -> Result<(RunHeader, String), OutputError> {
    let path = &header_path(parts);
    let file = sealed::open(path)?;
    hdf::check_identity(&file, kind::HEADER, path)?;
    let texts = |name: &str| -> Result<Vec<(String, String)>, OutputError> {
        let group = file.group(name).at(path)?;
        let entry = |member: String| {
            let entry = group.group(&member).at(path)?;
            let text = |key| hdf::read_text_attribute(&entry, key, path);
            Ok((text("key")?, text("value")?))
        };
        hdf::numbered_members(&group, "", path)?.into_iter().map(entry).collect()
    };
    let series = texts("units")?
        .into_iter()
        .zip(texts("descriptions")?)
        .map(|((name, unit), (_, description))| SeriesColumn { name, unit, description })
        .collect();
    let scenario = hdf::read_text(&file, "scenario", path)?;
    let run_id = hdf::read_text_attribute(&file, "run_id", path)?;
    let mut operators = Vec::new();
    for name in hdf::numbered_members(&file, "operator-", path)? {
        let group = file.group(&name).at(path)?;
        let mut quantities = Vec::new();
        for member in hdf::numbered_members(&group, "", path)? {
            let entry = group.group(&member).at(path)?;
            let text = |key| hdf::read_text_attribute(&entry, key, path);
            let column = SeriesColumn { name: text("name")?, unit: text("unit")?, description: text("description")? };
            quantities.push((column, hdf::read_attribute::<u64>(&entry, "components", path)? as usize));
        }
        operators.push(OperatorTable {
            name: hdf::read_text_attribute(&group, "name", path)?,
            description: hdf::read_text_attribute(&group, "description", path)?,
            quantities,
        });
    }
    let group = file.group(EARLIER).at(path)?;
    let values = |name: String| Ok((name.clone(), hdf::read_array(&group, &name, path)?));
    let earlier = group.member_names().at(path)?.into_iter().map(values).collect::<Result<_, OutputError>>()?;
    Ok((RunHeader { scenario, provenance: texts("provenance")?, series, operators, earlier }, run_id))
}
