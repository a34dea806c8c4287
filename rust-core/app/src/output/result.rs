//! Reading a finished result.

use std::path::{Path, PathBuf};

use super::error::{At, OutputError};
use super::hdf::{self, kind};
use super::run_files::{EARLIER, Kept, SeriesColumn};
use super::{events, sealed};
use concordem_contact::math::Vec3;
use concordem_solver::fracture::Event;
use concordem_solver::state::columns::StoredColumn;

/// A finished result, verified against its seal and opened.
#[derive(Debug)]
pub struct ResultFile {
    path: PathBuf,
    file: hdf5::File,
    series: Vec<SeriesColumn>,
    /// The folder of the result of an unfinished run.
    _kept: Option<Kept>,
}

impl ResultFile {
    /// Opens a result and verifies it.
    pub fn open(path: &Path) -> Result<Self, OutputError> {
        let parts =
            |path: &Path| super::run_files::parts_folder(&sealed::target(path).unwrap_or_else(|_| path.to_owned()));
        let file = sealed::open(path).map_err(|error| match error {
            OutputError::Missing { path } if parts(&path).is_dir() => OutputError::Unfinished { path: parts(&path) },
            other => other,
        })?;
        hdf::check_identity(&file, kind::RESULT, path)?;
        let group = file.group("samples").at(path)?;
        let mut series = Vec::new();
        for name in group.member_names().at(path)? {
            // Skip the groups of operators.
            let Ok(dataset) = group.dataset(&name) else { continue };
            let order: u64 = hdf::read_attribute(&dataset, "order", path)?;
            let (unit, description) = hdf::read_description(&dataset, path)?;
            series.push((order, SeriesColumn { name, unit, description }));
        }
        series.sort_by_key(|(order, _)| *order);
        let series = series.into_iter().map(|(_, series)| series).collect();
        Ok(Self { path: path.to_owned(), file, series, _kept: None })
    }

    /// The same result, which keeps the folder that it lies in as long as it is open.
    pub(crate) fn keeping(self, kept: Kept) -> Self {
        Self { _kept: Some(kept), ..self }
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The root of the file.
    pub(crate) fn root(&self) -> &hdf5::File {
        &self.file
    }

    /// The sampled series, in the order of the run.
    pub fn series(&self) -> &[SeriesColumn] {
        &self.series
    }

    /// Whether there is a series with this name.
    pub fn has_series(&self, name: &str) -> bool {
        self.series.iter().any(|series| series.name == name)
    }

    /// The samples of one series.
    pub fn samples(&self, name: &str) -> Result<Vec<f64>, OutputError> {
        if !self.has_series(name) {
            return Err(OutputError::NoDataset {
                path: self.path.clone(),
                name: format!("samples/{name}"),
                available: self.series.iter().map(|series| series.name.clone()).collect(),
            });
        }
        hdf::read_array(&self.file.group("samples").at(&self.path)?, name, &self.path)
    }

    /// The samples of one series from the start of the test: also those of the runs that this one continues.
    pub fn history(&self, name: &str) -> Result<Vec<f64>, OutputError> {
        let later = self.samples(name)?;
        if !self.file.link_exists(EARLIER) {
            return Ok(later);
        }
        let group = self.group(EARLIER)?;
        let mut values: Vec<f64> =
            if group.link_exists(name) { hdf::read_array(&group, name, &self.path)? } else { Vec::new() };
        values.extend(later);
        Ok(values)
    }

    /// Names of the sampled operators; their columns are in the table `samples/NAME`.
    pub fn operators(&self) -> Result<Vec<String>, OutputError> {
        let group = self.file.group("samples").at(&self.path)?;
        let names = group.member_names().at(&self.path)?;
        Ok(names.into_iter().filter(|name| group.group(name).is_ok()).collect())
    }

    /// The event log.
    pub fn events(&self) -> Result<Vec<Event>, OutputError> {
        events::read_events(&self.file, &self.path)
    }

    /// Hash of the state at the end.
    pub fn state_hash(&self) -> Result<String, OutputError> {
        hdf::read_text_attribute(&self.file, "state_hash", &self.path)
    }

    /// Text of the scenario.
    pub fn scenario(&self) -> Result<String, OutputError> {
        hdf::read_text(&self.file.group("provenance").at(&self.path)?, "scenario", &self.path)
    }

    /// Provenance: pairs of name and value, sorted by name.
    pub fn provenance(&self) -> Result<Vec<(String, String)>, OutputError> {
        let group = self.file.group("provenance").at(&self.path)?;
        let mut names = hdf::attribute_names(&group, &self.path)?;
        names.sort();
        names
            .into_iter()
            .map(|name| {
                let value = hdf::read_text_attribute(&group, &name, &self.path)?;
                Ok((name, value))
            })
            .collect()
    }

    /// Columns of a table (`particles`, `contacts/cpm`, …) by name.
    pub fn table(&self, table: &str) -> Result<Vec<(String, StoredColumn)>, OutputError> {
        let group = self.group(table)?;
        let names = group.member_names().at(&self.path)?;
        names
            .into_iter()
            .filter(|name| group.dataset(name).is_ok())
            .map(|name| {
                let kind = group.dataset(&name).and_then(|dataset| dataset.dtype()?.to_descriptor()).at(&self.path)?;
                if kind == hdf5::types::TypeDescriptor::VarLenUnicode {
                    let problem = format!("`{table}/{name}` is a string");
                    return Err(OutputError::NoTable { path: self.path.clone(), name: table.to_owned(), problem });
                }
                let column = hdf::read_column(&group, &name, &self.path)?;
                Ok((name, column))
            })
            .collect()
    }

    /// [`Self::table`] for tables with one row per particle, contact, or sample.
    ///
    /// # Errors
    /// Those of [`Self::table`], and columns of different length.
    pub fn rows(&self, table: &str) -> Result<Vec<(String, StoredColumn)>, OutputError> {
        let columns = self.table(table)?;
        let rows = |column: &StoredColumn| column.borrow().len() / column.components;
        if let [(first, one), others @ ..] = &columns[..]
            && let Some((name, other)) = others.iter().find(|(_, other)| rows(other) != rows(one))
        {
            let problem = format!("`{table}/{first}` has {} rows, `{table}/{name}` has {}", rows(one), rows(other));
            return Err(OutputError::Damaged { path: self.path.clone(), problem });
        }
        Ok(columns)
    }

    /// Unit of a column of a table.
    pub fn unit(&self, table: &str, column: &str) -> Result<String, OutputError> {
        let dataset = self.group(table)?.dataset(column).at(&self.path)?;
        Ok(hdf::read_description(&dataset, &self.path)?.0)
    }

    /// Names of the laws with contacts in the result.
    pub fn laws(&self) -> Result<Vec<String>, OutputError> {
        if self.file.link_exists("contacts") {
            self.group("contacts")?.member_names().at(&self.path)
        } else {
            Ok(Vec::new())
        }
    }

    /// Times of the snapshots in `/VTKHDF`, s.
    pub fn snapshot_times(&self) -> Result<Vec<f64>, OutputError> {
        if !self.file.link_exists("VTKHDF") {
            return Ok(Vec::new());
        }
        hdf::read_array(&self.group("VTKHDF/Steps")?, "Values", &self.path)
    }

    /// Box around the particle centers in all snapshots, m: lowest and highest corner; `None` without snapshots.
    pub fn bounds(&self) -> Result<Option<(Vec3, Vec3)>, OutputError> {
        if !self.file.link_exists("VTKHDF") {
            return Ok(None);
        }
        let points: Vec<f64> = hdf::read_array(&self.group("VTKHDF")?, "Points", &self.path)?;
        let points =
            points.chunks_exact(3).map(Vec3::from_column_slice).filter(|point| point.iter().all(|x| x.is_finite()));
        Ok(points.fold(None, |bounds, point| {
            Some(bounds.map_or((point, point), |(low, high): (Vec3, Vec3)| (low.inf(&point), high.sup(&point))))
        }))
    }

    fn group(&self, name: &str) -> Result<hdf5::Group, OutputError> {
        self.file.group(name).or_else(|_| {
            let available = self.file.member_names().at(&self.path)?;
            Err(OutputError::NoDataset { path: self.path.clone(), name: name.to_owned(), available })
        })
    }
}
