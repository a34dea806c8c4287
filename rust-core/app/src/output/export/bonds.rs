//! Bonds of a result as lines with values, at every snapshot, or at the end if the snapshots have no bonds.

use std::collections::HashMap;

use crate::output::error::OutputError;
use crate::output::frames::{Frame, Frames};
use crate::output::result::ResultFile;
use crate::output::stream::StoredField;
use concordem_solver::state::columns::{ColumnData, StoredColumn};

/// Bonds at one time.
pub(crate) struct Lines {
    pub time: f64,
    pub step: u64,
    /// Ids of both particles.
    pub ids: Vec<[u32; 2]>,
    /// Start and end of each line, m.
    pub points: Vec<f64>,
    /// Edge vectors of the periodic cell, m.
    pub cell: Option<[[f64; 3]; 3]>,
    /// Values of each line.
    pub fields: Vec<StoredField>,
}

/// All bonds of a result.
pub(super) struct AllLines {
    particles: Frames,
    /// `None`: only the final state has bonds.
    bonds: Option<Frames>,
}

impl AllLines {
    pub(super) fn of(result: &ResultFile) -> Result<Self, OutputError> {
        let particles = super::particles_of(result)?;
        let bonds = Frames::of_bonds(result.root(), result.path())?.filter(|bonds| bonds.len() > 0);
        Ok(Self { particles, bonds })
    }

    /// Whether only the final state can have bonds.
    pub(super) fn are_final(&self) -> bool {
        self.bonds.is_none()
    }

    /// Calls `take` for every snapshot with bonds, or for the final state; returns whether there was one.
    pub(super) fn for_each(
        &self,
        result: &ResultFile,
        take: &mut dyn FnMut(Lines) -> Result<(), OutputError>,
    ) -> Result<bool, OutputError> {
        let Some(bonds) = &self.bonds else {
            let last = self.particles.len().checked_sub(1).map(|last| self.particles.read(last)).transpose()?;
            let Some((last, lines)) = last.zip(final_bonds(result)?) else { return Ok(false) };
            take(lines_of(&last, Frame { time: last.time, step: last.step, ..lines }))?;
            return Ok(true);
        };
        for k in 0..bonds.len() {
            if let Some(at) = self.particles.at_step(bonds.step(k)) {
                take(lines_of(&self.particles.read(at)?, bonds.read(k)?))?;
            }
        }
        Ok(bonds.len() > 0)
    }
}

impl Lines {
    /// The bonds at the snapshot `particles`; `None` if it has none. `is_last`: whether it is the last one, whose bonds every result has.
    pub(crate) fn at(result: &ResultFile, particles: &Frame, is_last: bool) -> Result<Option<Self>, OutputError> {
        let stored = Frames::of_bonds(result.root(), result.path())?;
        if let Some(bonds) = stored
            && let Some(k) = bonds.at_step(particles.step)
        {
            return Ok(Some(lines_of(particles, bonds.read(k)?)));
        }
        let lines = if is_last { final_bonds(result)? } else { None };
        Ok(lines.map(|lines| lines_of(particles, lines)))
    }
}

/// Bonds with the positions of their particles.
fn lines_of(particles: &Frame, bonds: Frame) -> Lines {
    let id = match particles.field("id") {
        Some(ColumnData::U32(id)) => &id[..],
        _ => &[],
    };
    let row_of: HashMap<u32, usize> = id.iter().enumerate().map(|(row, id)| (*id, row)).collect();
    let position = |id: u32| -> [f64; 3] {
        let row = row_of.get(&id).copied().unwrap_or(0);
        std::array::from_fn(|axis| particles.points.get(3 * row + axis).copied().unwrap_or(f64::NAN))
    };
    let flat = match bonds.field("ids") {
        Some(ColumnData::U32(ids)) => &ids[..],
        _ => &[],
    };
    let (pairs, _) = flat.as_chunks::<2>();
    let ids = pairs.to_vec();
    let branch = match bonds.field("branch") {
        Some(ColumnData::F64(branch)) => Some(&branch[..]),
        _ => None,
    };
    let mut points = Vec::with_capacity(6 * ids.len());
    for (k, &[a, b]) in ids.iter().enumerate() {
        let start = position(a);
        // Across a periodic border the line goes to the image of the second particle.
        let end =
            branch.map_or_else(|| position(b), |branch| std::array::from_fn(|axis| start[axis] + branch[3 * k + axis]));
        points.extend(start);
        points.extend(end);
    }
    let fragment = match particles.field("fragment") {
        Some(ColumnData::U32(fragment)) => {
            let of = |id: u32| row_of.get(&id).and_then(|row| fragment.get(*row)).copied().unwrap_or(0);
            Some(ids.iter().map(|pair| of(pair[0])).collect::<Vec<u32>>())
        }
        _ => None,
    };
    let Frame { time, step, fields, .. } = bonds;
    let mut fields: Vec<StoredField> = fields.into_iter().filter(|field| field.name != "branch").collect();
    if let Some(fragment) = fragment {
        fields.push(StoredField {
            name: "fragment".into(),
            unit: "1".into(),
            description: "Fragment of the first particle.".into(),
            column: StoredColumn { data: ColumnData::U32(fragment), components: 1 },
        });
    }
    Lines { time, step, ids, points, cell: particles.cell, fields }
}

/// The bonds of the tables `contacts/LAW` of the final state, with the fields of snapshots; `None` without bonds.
fn final_bonds(result: &ResultFile) -> Result<Option<Frame>, OutputError> {
    let (mut ids, mut broken) = (Vec::new(), Vec::new());
    let [mut damage, mut normal, mut shear, mut opening, mut branch] = [const { Vec::new() }; 5];
    for law in result.laws()?.iter().filter(|law| !law.starts_with("unbonded_") && *law != "walls") {
        let table: HashMap<String, StoredColumn> = result.rows(&format!("contacts/{law}"))?.into_iter().collect();
        let reals = |name: &str| match table.get(name).map(|column| &column.data) {
            Some(ColumnData::F64(data)) => data.clone(),
            _ => Vec::new(),
        };
        if let (Some(ColumnData::U32(pairs)), Some(ColumnData::U8(flags))) =
            (table.get("ids").map(|column| &column.data), table.get("broken").map(|column| &column.data))
        {
            ids.extend_from_slice(pairs);
            broken.extend_from_slice(flags);
        }
        damage.extend(reals("damage"));
        let (force, branches, reference) = (reals("force"), reals("branch"), reals("reference_length"));
        let (forces, _) = force.as_chunks::<3>();
        let (vectors, _) = branches.as_chunks::<3>();
        for ((force, vector), reference) in forces.iter().zip(vectors).zip(reference) {
            let length = vector.iter().map(|x| x * x).sum::<f64>().sqrt();
            let along = force.iter().zip(vector).map(|(f, x)| f * x).sum::<f64>() / length;
            normal.push(along);
            shear.push((force.iter().map(|f| f * f).sum::<f64>() - along * along).max(0.0).sqrt());
            opening.push(length - reference);
        }
        branch.extend(branches);
    }
    if ids.is_empty() {
        return Ok(None);
    }
    let field = |name: &str, unit: &str, data: ColumnData, components: usize| StoredField {
        name: name.to_owned(),
        unit: unit.to_owned(),
        description: String::new(),
        column: StoredColumn { data, components },
    };
    let fields = vec![
        field("ids", "1", ColumnData::U32(ids), 2),
        field("damage", "1", ColumnData::F64(damage), 1),
        field("normal_force", "N", ColumnData::F64(normal), 1),
        field("shear_force", "N", ColumnData::F64(shear), 1),
        field("opening", "m", ColumnData::F64(opening), 1),
        field("broken", "1", ColumnData::U8(broken), 1),
        field("branch", "m", ColumnData::F64(branch), 3),
    ];
    Ok(Some(Frame { time: 0.0, step: 0, points: Vec::new(), cell: None, fields }))
}
