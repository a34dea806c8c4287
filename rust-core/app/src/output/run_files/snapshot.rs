//! Snapshots: the particles at one time, in memory until the next commit, then in a segment.

use std::path::Path;
use std::sync::Arc;

use super::folder::numbered;
use crate::output::error::{At, OutputError};
use crate::output::stream::StoredField;
use crate::output::{hdf, sealed};
use concordem_contact::math::{Mat3, Vec3};
use concordem_solver::state::columns::{Column, ColumnData, ColumnError, ColumnSink, ColumnStore, StoredColumn};
use rayon::prelude::*;

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
    /// Edge vectors of the periodic cell as columns, m; in all snapshots of a run or in none.
    pub cell: Option<Mat3>,
    /// Further fields, such as radius and velocity; the same in every snapshot of a run.
    pub fields: Vec<SnapshotField<'a>>,
}

/// The bonds at one time, for `/bonds`.
#[derive(Debug, Clone)]
pub struct BondSnapshot<'a> {
    /// Time, s.
    pub time: f64,
    /// Number of steps done.
    pub step: u64,
    /// Stable ids of the two particles of each bond; rows are written in their order, so that a row is the same bond in every snapshot.
    pub ids: &'a [[u32; 2]],
    /// Further fields; the same in every snapshot of a run.
    pub fields: Vec<SnapshotField<'a>>,
}

/// One field of a snapshot, a row per particle or bond.
#[derive(Debug, Clone)]
pub struct SnapshotField<'a> {
    /// Name.
    pub name: &'a str,
    /// Description of the field.
    pub description: &'a str,
    /// Values with unit.
    pub column: Column<'a>,
}

/// A snapshot of particles or bonds, checked and in the order of the ids: kept in memory until it is written.
#[derive(Debug)]
pub struct StoredSnapshot {
    time: f64,
    step: u64,
    /// Number of particles or bonds.
    rows: usize,
    cell: Option<Mat3>,
    pub(super) fields: Vec<StoredField>,
}

/// Name of the positions among the fields of a stored snapshot.
pub(super) const POSITION: &str = "position";
const POSITION_MEANING: &str = "Center of the particle.";
/// Name of the ids among the fields of a stored snapshot.
const ID: &str = "id";
const ID_MEANING: &str = "Stable id of the particle.";
/// Name of the ids among the fields of stored bonds.
const IDS: &str = "ids";
const IDS_MEANING: &str = "Stable ids of the two particles.";

/// Name of the edges of the cell in a batch.
const CELL: &str = "cell";

/// Group of a segment that holds the batches of snapshots.
const BATCHES: &str = "snapshot_batches";
/// The same for bonds; segments without bonds have none.
const BOND_BATCHES: &str = "bond_batches";
/// Rows of a batch, unless a single snapshot has more. Small runs with many snapshots would otherwise spend most of their
/// time in creating objects of HDF5; large ones need not hold more than a snapshot in memory when segments are merged.
const ROWS_OF_BATCH: usize = 1 << 18;

/// Names and shapes of the fields of the first snapshot of the run, if there is one.
pub(super) fn snapshot_fields(parts: &Path, segments: u64) -> Result<Option<Vec<(String, String)>>, OutputError> {
    for k in 0..segments {
        let path = numbered(parts, "segment", k);
        let file = sealed::open(&path)?;
        let (group, names) = batches_of(&file, &path)?;
        if let Some(first) = names.first() {
            let batch = SnapshotBatch::read(&group.group(first).at(&path)?, &path)?;
            return Ok(Some(batch.fields.iter().map(|field| (field.name.clone(), field.shape())).collect()));
        }
    }
    Ok(None)
}

/// The group of the batches of a segment, and their names in order.
pub(super) fn batches_of(segment: &hdf5::Group, path: &Path) -> Result<(hdf5::Group, Vec<String>), OutputError> {
    let group = segment.group(BATCHES).map_err(|_| OutputError::Damaged {
        path: path.to_owned(),
        problem: "it has no batches of snapshots; if another version of concordem began this run, finish it with that version"
            .to_owned(),
    })?;
    let names = hdf::numbered_members(&group, "", path)?;
    Ok((group, names))
}

/// Paths of the batches of bonds of a segment, in order.
pub(super) fn bond_batches_of(segment: &hdf5::Group, path: &Path) -> Result<Vec<String>, OutputError> {
    if !segment.link_exists(BOND_BATCHES) {
        return Ok(Vec::new());
    }
    let group = segment.group(BOND_BATCHES).at(path)?;
    let names = hdf::numbered_members(&group, "", path)?;
    Ok(names.into_iter().map(|name| format!("{BOND_BATCHES}/{name}")).collect())
}

/// Writes snapshots of particles into a segment.
pub(super) fn write_batches(
    file: &hdf5::Group,
    snapshots: &[Arc<StoredSnapshot>],
    path: &Path,
) -> Result<(), OutputError> {
    write_in(&file.create_group(BATCHES).at(path)?, snapshots, path)
}

/// Writes snapshots of bonds into a segment.
pub(super) fn write_bond_batches(
    file: &hdf5::Group,
    bonds: &[Arc<StoredSnapshot>],
    path: &Path,
) -> Result<(), OutputError> {
    if bonds.is_empty() {
        return Ok(());
    }
    write_in(&file.create_group(BOND_BATCHES).at(path)?, bonds, path)
}

/// Writes snapshots into a group, in batches of equal numbers of rows.
fn write_in(group: &hdf5::Group, snapshots: &[Arc<StoredSnapshot>], path: &Path) -> Result<(), OutputError> {
    let mut rest = snapshots;
    let mut number = 0;
    while let Some(first) = rest.first() {
        let rows = first.rows;
        let most = (ROWS_OF_BATCH / rows.max(1)).max(1);
        let count = rest.iter().take(most).take_while(|snapshot| snapshot.rows == rows).count();
        let (batch, others) = rest.split_at(count);
        write_batch(&group.create_group(&format!("{number:06}")).at(path)?, batch, path)?;
        (rest, number) = (others, number + 1);
    }
    Ok(())
}

/// Writes each field of all snapshots as one array.
fn write_batch(group: &hdf5::Group, batch: &[Arc<StoredSnapshot>], path: &Path) -> Result<(), OutputError> {
    let time: Vec<f64> = batch.iter().map(|snapshot| snapshot.time).collect();
    let step: Vec<u64> = batch.iter().map(|snapshot| snapshot.step).collect();
    hdf::write_array(group, "time", &time, 1, path)?;
    hdf::write_array(group, "step", &step, 1, path)?;
    let cells: Vec<f64> =
        batch.iter().filter_map(|snapshot| snapshot.cell).flat_map(|cell| cell.data.0).flatten().collect();
    if !cells.is_empty() {
        hdf::write_array(group, CELL, &cells, 9, path)?;
    }
    let fields = group.create_group("fields").at(path)?;
    for (k, field) in batch[0].fields.iter().enumerate() {
        let columns: Vec<&ColumnData> = batch.iter().map(|snapshot| &snapshot.fields[k].column.data).collect();
        let column = StoredColumn { data: concatenated(&columns), components: field.column.components };
        // The number preserves the order of the fields.
        let name = format!("{k:03} {}", field.name);
        hdf::write_column(&fields, &name, &column.borrow(), &field.unit, &field.description, path)?;
    }
    Ok(())
}

/// Arrays of one type, one after the other.
fn concatenated(columns: &[&ColumnData]) -> ColumnData {
    macro_rules! of_kind {
        ($($kind:ident),*) => {
            match columns[0] {
                $(ColumnData::$kind(_) => ColumnData::$kind(
                    columns.iter().flat_map(|c| if let ColumnData::$kind(data) = c { &data[..] } else { &[] }).copied().collect(),
                ),)*
            }
        };
    }
    of_kind!(F64, U64, U32, U16, U8, I8)
}

/// Snapshots with equal numbers of particles, as read from a segment.
#[derive(Debug)]
pub(super) struct SnapshotBatch {
    pub time: Vec<f64>,
    pub step: Vec<u64>,
    /// Edge vectors of the cell, m, nine numbers per snapshot; empty without a cell.
    pub cells: Vec<f64>,
    /// Each field of all snapshots, one after the other.
    pub fields: Vec<StoredField>,
}

impl SnapshotBatch {
    pub(super) fn read(group: &hdf5::Group, path: &Path) -> Result<Self, OutputError> {
        let inner = group.group("fields").at(path)?;
        let mut fields = Vec::new();
        for name in hdf::numbered_members(&inner, "", path)? {
            let (unit, description) = hdf::read_description(&inner.dataset(&name).at(path)?, path)?;
            fields.push(StoredField {
                name: name.split_once(' ').map_or(&name[..], |(_, name)| name).to_owned(),
                unit,
                description,
                column: hdf::read_column(&inner, &name, path)?,
            });
        }
        let (time, step) = (hdf::read_array(group, "time", path)?, hdf::read_array(group, "step", path)?);
        let cells = if group.link_exists(CELL) { hdf::read_array(group, CELL, path)? } else { Vec::new() };
        Ok(Self { time, step, cells, fields })
    }
}

impl StoredSnapshot {
    /// Steps done before it.
    pub fn step(&self) -> u64 {
        self.step
    }

    /// Bytes of its fields in memory.
    pub fn bytes(&self) -> usize {
        self.fields.iter().map(|field| field.column.borrow().bytes().len()).sum()
    }

    /// Writes it as columns below `path`, for a checkpoint.
    ///
    /// # Errors
    /// The errors of the sink.
    pub fn write(&self, path: &str, sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
        sink.column(&format!("{path}/time"), Column::f64(&[self.time], 1, "s"))?;
        sink.column(&format!("{path}/step"), Column::u64(&[self.step]))?;
        if let Some(cell) = &self.cell {
            sink.column(&format!("{path}/cell"), Column::f64(cell.as_slice(), 9, "m"))?;
        }
        let mut fields = self.fields.iter().enumerate();
        // The number preserves the order.
        fields.try_for_each(|(k, field)| sink.column(&format!("{path}/{k:03} {}", field.name), field.column.borrow()))
    }

    /// The snapshot that [`Self::write`] has written below `path`, if there is one. `meaning`: unit and description of a field by its name.
    pub fn read(
        path: &str,
        store: &ColumnStore,
        meaning: impl Fn(&str) -> (&'static str, &'static str),
    ) -> Option<Self> {
        let reals = |name: &str| match &store.get(&format!("{path}/{name}"))?.data {
            ColumnData::F64(reals) => Some(reals.as_slice()),
            _ => None,
        };
        let time = *reals("time")?.first()?;
        let step = match &store.get(&format!("{path}/step"))?.data {
            ColumnData::U64(steps) => *steps.first()?,
            _ => return None,
        };
        let cell = reals("cell").filter(|cell| cell.len() == 9).map(Mat3::from_column_slice);
        let meaning = |name: &str| match name {
            POSITION => ("m", POSITION_MEANING),
            ID => ("1", ID_MEANING),
            IDS => ("1", IDS_MEANING),
            other => meaning(other),
        };
        let own = |(name, column): (&str, &StoredColumn)| {
            let (_, name) = name.strip_prefix(path)?.strip_prefix('/')?.split_once(' ')?;
            let (unit, description) = meaning(name);
            let (data, components) = (column.data.clone(), column.components);
            Some(field(name, unit, description, components, data))
        };
        let fields: Vec<StoredField> = store.iter().filter_map(own).collect();
        let rows = fields.first()?.column.borrow().rows(path).ok()?;
        Some(Self { time, step, rows, cell, fields })
    }

    /// Checks a snapshot and sorts its rows by id.
    ///
    /// # Errors
    /// The fields do not fit the ids, or two have the same name.
    pub fn of(snapshot: &Snapshot<'_>) -> Result<Self, OutputError> {
        let wrong = |problem: String| OutputError::Snapshot { step: snapshot.step, problem };
        let count = snapshot.id.len();
        if snapshot.position.len() != count {
            return Err(wrong(format!("it has {} positions for {count} ids", snapshot.position.len())));
        }
        let mut order: Vec<usize> = (0..count).collect();
        order.par_sort_by_key(|&k| snapshot.id[k]);
        let order = &order;
        let position = pick(bytemuck::cast_slice(snapshot.position), 3, order);
        let id = pick(snapshot.id, 1, order);
        let fields = vec![
            field(POSITION, "m", POSITION_MEANING, 3, ColumnData::F64(position)),
            field(ID, "1", ID_MEANING, 1, ColumnData::U32(id)),
        ];
        let stored = Self::with(snapshot.time, snapshot.step, order, fields, &snapshot.fields)?;
        Ok(Self { cell: snapshot.cell, ..stored })
    }

    /// Checks a snapshot of bonds and sorts its rows by the ids of the particles.
    ///
    /// # Errors
    /// As [`Self::of`].
    pub fn of_bonds(snapshot: &BondSnapshot<'_>) -> Result<Self, OutputError> {
        let mut order: Vec<usize> = (0..snapshot.ids.len()).collect();
        order.par_sort_by_key(|&k| snapshot.ids[k]);
        let ids = pick(snapshot.ids.as_flattened(), 2, &order);
        let fields = vec![field(IDS, "1", IDS_MEANING, 2, ColumnData::U32(ids))];
        Self::with(snapshot.time, snapshot.step, &order, fields, &snapshot.fields)
    }

    /// A snapshot with further fields, whose rows are brought into `order`.
    fn with(
        time: f64,
        step: u64,
        order: &[usize],
        mut fields: Vec<StoredField>,
        further: &[SnapshotField<'_>],
    ) -> Result<Self, OutputError> {
        let wrong = |problem: String| OutputError::Snapshot { step, problem };
        let count = order.len();
        for given in further {
            hdf::check_name(given.name, "a field of a snapshot")?;
            if fields.iter().any(|field| field.name == given.name) {
                return Err(wrong(format!("the field `{}` appears twice", given.name)));
            }
            let rows = given.column.rows(given.name).map_err(|error| wrong(error.to_string()))?;
            if rows != count {
                return Err(wrong(format!("the field `{}` has {rows} rows for {count} particles", given.name)));
            }
            let column = sorted(&given.column, order);
            fields.push(field(given.name, given.column.unit(), given.description, given.column.components(), column));
        }
        Ok(Self { time, step, rows: count, cell: None, fields })
    }
}

fn field(name: &str, unit: &str, description: &str, components: usize, data: ColumnData) -> StoredField {
    StoredField {
        name: name.to_owned(),
        unit: unit.to_owned(),
        description: description.to_owned(),
        column: StoredColumn { data, components },
    }
}

/// Rows with this number of components in another order.
fn pick<T: Copy + Default + Send + Sync>(data: &[T], components: usize, order: &[usize]) -> Vec<T> {
    let mut rows = vec![T::default(); order.len() * components];
    rows.par_chunks_mut(components.max(1))
        .zip(order)
        .with_min_len(1 << 12)
        .for_each(|(row, &k)| row.copy_from_slice(&data[k * components..(k + 1) * components]));
    rows
}

/// The rows of a column in another order.
fn sorted(column: &Column<'_>, order: &[usize]) -> ColumnData {
    match *column {
        Column::F64 { data, components, .. } => ColumnData::F64(pick(data, components, order)),
        Column::U64 { data, components, .. } => ColumnData::U64(pick(data, components, order)),
        Column::U32 { data, components, .. } => ColumnData::U32(pick(data, components, order)),
        Column::U16 { data, components, .. } => ColumnData::U16(pick(data, components, order)),
        Column::U8 { data, components, .. } => ColumnData::U8(pick(data, components, order)),
        Column::I8 { data, components, .. } => ColumnData::I8(pick(data, components, order)),
    }
}
