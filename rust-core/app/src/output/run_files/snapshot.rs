//! Snapshots: the particles at one time, in memory until the next commit, then in a segment.

use std::path::Path;

use super::folder::numbered;
use crate::output::error::{At, OutputError};
use crate::output::{hdf, sealed};
use concordem_contact::math::Vec3;
use concordem_solver::state::columns::{Column, ColumnData, StoredColumn};

/// The particles at one time, for `/VTKHDF`.
#[derive(Debug, Clone)]
pub struct Snapshot<'a> {
    /// Time, s.
    pub time: f64,
    /// Number of steps done.
    pub step: u64,
    /// Stable ids; rows are written in the order of ids, so that a row is the same particle in every snapshot.
    pub id: &'a [u32],
    /// Positions, m.
    pub position: &'a [Vec3],
    /// Further fields, such as radius and velocity; the same in every snapshot of a run.
    pub fields: Vec<SnapshotField<'a>>,
}

/// One field of a snapshot, a row per particle.
#[derive(Debug, Clone)]
pub struct SnapshotField<'a> {
    /// Name.
    pub name: &'a str,
    /// Description of the field.
    pub description: &'a str,
    /// Values with unit.
    pub column: Column<'a>,
}

/// A snapshot stored until the next commit.
#[derive(Debug)]
pub(in crate::output) struct StoredSnapshot {
    pub time: f64,
    pub step: u64,
    pub fields: Vec<StoredField>,
}

#[derive(Debug)]
pub(in crate::output) struct StoredField {
    pub name: String,
    pub unit: String,
    pub description: String,
    pub column: StoredColumn,
}

/// Name of the positions among the fields of a stored snapshot.
pub(in crate::output) const POSITION: &str = "position";
/// Name of the ids among the fields of a stored snapshot.
const ID: &str = "id";

/// Names and shapes of the fields of the first snapshot of the run, if there is one.
pub(super) fn snapshot_fields(parts: &Path, segments: u64) -> Result<Option<Vec<(String, String)>>, OutputError> {
    for k in 0..segments {
        let path = numbered(parts, "segment", k);
        let file = sealed::open(&path)?;
        let group = file.group("snapshots").at(&path)?;
        if let Some(first) = hdf::numbered_members(&group, "", &path)?.first() {
            let snapshot = StoredSnapshot::read(&group.group(first).at(&path)?, &path)?;
            return Ok(Some(snapshot.fields.iter().map(|field| (field.name.clone(), field.shape())).collect()));
        }
    }
    Ok(None)
}

impl StoredField {
    /// Type and shape of a row, as text.
    pub(super) fn shape(&self) -> String {
        format!("{} {}", self.column.components, self.column.kind())
    }
}

impl StoredSnapshot {
    /// Checks a snapshot and sorts its rows by id.
    pub(super) fn of(snapshot: &Snapshot<'_>) -> Result<Self, OutputError> {
        let wrong = |problem: String| OutputError::Snapshot { step: snapshot.step, problem };
        let count = snapshot.id.len();
        if snapshot.position.len() != count {
            return Err(wrong(format!("it has {} positions for {count} ids", snapshot.position.len())));
        }
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by_key(|&k| snapshot.id[k]);
        let position: Vec<f64> = order.iter().flat_map(|&k| snapshot.position[k].iter().copied()).collect();
        let field = |name: &str, unit: &str, description: &str, components, data| StoredField {
            name: name.to_owned(),
            unit: unit.to_owned(),
            description: description.to_owned(),
            column: StoredColumn { data, components },
        };
        let id = order.iter().map(|&k| snapshot.id[k]).collect();
        let mut fields = vec![
            field(POSITION, "m", "Center of the particle.", 3, ColumnData::F64(position)),
            field(ID, "1", "Stable id of the particle.", 1, ColumnData::U32(id)),
        ];
        for given in &snapshot.fields {
            hdf::check_name(given.name, "a field of a snapshot")?;
            if fields.iter().any(|field| field.name == given.name) {
                return Err(wrong(format!("the field `{}` appears twice", given.name)));
            }
            let rows = given.column.rows(given.name).map_err(|error| wrong(error.to_string()))?;
            if rows != count {
                return Err(wrong(format!("the field `{}` has {rows} rows for {count} particles", given.name)));
            }
            let column = sorted(&given.column, &order);
            fields.push(field(given.name, given.column.unit(), given.description, given.column.components(), column));
        }
        Ok(Self { time: snapshot.time, step: snapshot.step, fields })
    }

    pub(super) fn write(&self, group: &hdf5::Group, path: &Path) -> Result<(), OutputError> {
        hdf::write_attribute(group, "time", &self.time, path)?;
        hdf::write_attribute(group, "step", &self.step, path)?;
        // The number preserves the order of the fields.
        for (k, field) in self.fields.iter().enumerate() {
            let name = format!("{k:03} {}", field.name);
            hdf::write_column(group, &name, &field.column.borrow(), &field.unit, &field.description, path)?;
        }
        Ok(())
    }

    pub(in crate::output) fn read(group: &hdf5::Group, path: &Path) -> Result<Self, OutputError> {
        let mut fields = Vec::new();
        for name in hdf::numbered_members(group, "", path)? {
            let dataset = group.dataset(&name).at(path)?;
            let (unit, description) = hdf::read_description(&dataset, path)?;
            fields.push(StoredField {
                name: name.split_once(' ').map_or(&name[..], |(_, name)| name).to_owned(),
                unit,
                description,
                column: hdf::read_column(group, &name, path)?,
            });
        }
        Ok(Self {
            time: hdf::read_attribute(group, "time", path)?,
            step: hdf::read_attribute(group, "step", path)?,
            fields,
        })
    }
}

/// The rows of a column in another order.
fn sorted(column: &Column<'_>, order: &[usize]) -> ColumnData {
    fn pick<T: Copy>(data: &[T], components: usize, order: &[usize]) -> Vec<T> {
        order.iter().flat_map(|&k| data[k * components..(k + 1) * components].iter().copied()).collect()
    }
    match *column {
        Column::F64 { data, components, .. } => ColumnData::F64(pick(data, components, order)),
        Column::U64 { data, components, .. } => ColumnData::U64(pick(data, components, order)),
        Column::U32 { data, components, .. } => ColumnData::U32(pick(data, components, order)),
        Column::U16 { data, components, .. } => ColumnData::U16(pick(data, components, order)),
        Column::U8 { data, components, .. } => ColumnData::U8(pick(data, components, order)),
        Column::I8 { data, components, .. } => ColumnData::I8(pick(data, components, order)),
    }
}
