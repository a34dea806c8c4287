//! The particles of a result at one time, with the fragments that they belong to.

use std::collections::HashMap;

use super::error::OutputError;
use super::frames::Frames;
use super::hdf;
use super::result::ResultFile;
use concordem_contact::math::Vec3;
use concordem_solver::state::columns::{ColumnData, StoredColumn};

/// Particles at one time, one entry each.
#[derive(Debug, Clone, Default)]
pub struct ParticlesAt {
    /// Time, s.
    pub time: f64,
    /// Center, m, without the turns of a periodic cell.
    pub position: Vec<Vec3>,
    /// Radius, m.
    pub radius: Vec<f64>,
    /// Mass, kg.
    pub mass: Vec<f64>,
    /// Velocity, m/s.
    pub velocity: Vec<Vec3>,
    /// Smallest id of the particles that intact bonds connect.
    pub fragment: Vec<u32>,
    /// Sets that it belongs to, one bit each.
    pub sets: Vec<u64>,
    /// Whether they lie in a periodic cell.
    pub is_periodic: bool,
}

impl ParticlesAt {
    /// Those at the end, or in a snapshot, by its number.
    ///
    /// # Errors
    /// A column is missing or cannot be read.
    pub fn read(result: &ResultFile, snapshot: Option<usize>) -> Result<Self, OutputError> {
        let table: HashMap<String, StoredColumn> = result.rows("particles")?.into_iter().collect();
        let missing = |name: &str| hdf::damaged(result.path(), format!("`particles/{name}` is missing"));
        let reals = |name: &str| match table.get(name).map(|column| &column.data) {
            Some(ColumnData::F64(data)) => Ok(data.clone()),
            _ => Err(missing(name)),
        };
        let Some(ColumnData::U32(id)) = table.get("id").map(|column| &column.data) else { return Err(missing("id")) };
        let sets = match table.get("sets").map(|column| &column.data) {
            Some(ColumnData::U64(sets)) => sets.clone(),
            _ => vec![0; id.len()],
        };
        let is_periodic = result.root().link_exists("cell");
        let Some(snapshot) = snapshot else {
            let Some(ColumnData::U32(fragment)) = table.get("fragment").map(|column| &column.data) else {
                return Err(missing("fragment"));
            };
            return Ok(Self {
                time: result.snapshot_times()?.last().copied().unwrap_or_default(),
                position: vectors(&reals("position")?),
                radius: reals("radius")?,
                mass: reals("mass")?,
                velocity: vectors(&reals("velocity")?),
                fragment: fragment.clone(),
                sets,
                is_periodic,
            });
        };
        let frame = Frames::of_particles(result.root(), result.path())?.read(snapshot)?;
        let missing = |name: &str| hdf::damaged(result.path(), format!("the snapshots have no `{name}`"));
        let field = |name: &str| match frame.field(name) {
            Some(ColumnData::F64(data)) => Ok(data.clone()),
            _ => Err(missing(name)),
        };
        let whole = |name: &str| match frame.field(name) {
            Some(ColumnData::U32(data)) => Ok(data.clone()),
            _ => Err(missing(name)),
        };
        // Masses and sets do not change.
        let row_of: HashMap<u32, usize> = id.iter().enumerate().map(|(row, id)| (*id, row)).collect();
        let rows = whole("id")?.iter().map(|id| row_of.get(id).copied()).collect::<Option<Vec<usize>>>();
        let rows = rows.ok_or_else(|| hdf::damaged(result.path(), "a snapshot has other particles".to_owned()))?;
        let mass = reals("mass")?;
        Ok(Self {
            time: frame.time,
            position: vectors(&frame.points),
            radius: field("radius")?,
            mass: rows.iter().map(|&row| mass[row]).collect(),
            velocity: vectors(&field("velocity")?),
            fragment: whole("fragment")?,
            sets: rows.iter().map(|&row| sets[row]).collect(),
            is_periodic,
        })
    }

    /// Those that belong to a set, by its bit.
    #[must_use]
    pub fn of_set(&self, bit: u64) -> Self {
        fn picked<T: Copy>(rows: &[usize], values: &[T]) -> Vec<T> {
            rows.iter().map(|&row| values[row]).collect()
        }
        let rows: Vec<usize> = (0..self.sets.len()).filter(|&row| self.sets[row] & bit != 0).collect();
        Self {
            time: self.time,
            position: picked(&rows, &self.position),
            radius: picked(&rows, &self.radius),
            mass: picked(&rows, &self.mass),
            velocity: picked(&rows, &self.velocity),
            fragment: picked(&rows, &self.fragment),
            sets: picked(&rows, &self.sets),
            is_periodic: self.is_periodic,
        }
    }
}

fn vectors(values: &[f64]) -> Vec<Vec3> {
    values.chunks_exact(3).map(Vec3::from_column_slice).collect()
}
