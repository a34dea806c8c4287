//! The log of events in a file: columns below `/events`.

use std::path::Path;

use hdf5::{Group, H5Type};

use super::error::{At, OutputError};
use super::hdf;
use concordem_contact::math::Vec3;
use concordem_solver::fracture::Event;

/// Writes the event log as columns below `/events`.
pub(super) fn write_events(file: &Group, events: &[Event], path: &Path) -> Result<(), OutputError> {
    fn column<T: H5Type + bytemuck::NoUninit>(
        group: &Group,
        (name, unit, components): (&str, &str, usize),
        values: impl Iterator<Item = T>,
        description: &str,
        path: &Path,
    ) -> Result<(), OutputError> {
        let values: Vec<T> = values.collect();
        let dataset = hdf::write_array(group, name, &values, components, path)?;
        hdf::describe(&dataset, unit, description, path)
    }
    let group = &file.create_group("events").at(path)?;
    let all = || events.iter();
    column(
        group,
        ("time", "s", 1),
        all().map(|e| e.time),
        "Time of the event, at the same instant of the step as the time of samples.",
        path,
    )?;
    column(group, ("step", "1", 1), all().map(|e| e.step), "Number of steps done before the event.", path)?;
    column(group, ("id_a", "1", 1), all().map(|e| e.id_a), "Stable id of particle A.", path)?;
    column(group, ("id_b", "1", 1), all().map(|e| e.id_b), "Stable id of particle B, or of the wall.", path)?;
    let position = all().flat_map(|e| e.position.iter().copied().collect::<Vec<f64>>());
    column(group, ("position", "m", 3), position, "Contact point.", path)?;
    let shares = all().flat_map(|e| e.mode_shares);
    let meaning = "Shares of normal, shear, bending, and twist deformation in the energy stored before the event.";
    column(group, ("mode_shares", "1", 4), shares, meaning, path)?;
    let in_shear = all().map(|e| u8::from(e.in_shear));
    let meaning =
        "1 if shear made the bond fail, where its law has a criterion of shear besides one of tension; else 0.";
    column(group, ("in_shear", "1", 1), in_shear, meaning, path)?;
    let meaning = "Energy dissipated by damage of the bond in this step, including what it still stored if it broke; of softening beams in all steps so far.";
    column(group, ("energy", "J", 1), all().map(|e| e.energy), meaning, path)?;
    let meaning = "Damage after the event: 0 intact, 1 without strength.";
    column(group, ("damage", "1", 1), all().map(|e| e.damage), meaning, path)?;
    let meaning = "Number of the [[joint]] that the bond lies across, from 0; 65535 off joints.";
    column(group, ("joint", "1", 1), all().map(|e| e.joint.unwrap_or(u16::MAX)), meaning, path)
}

/// Reads the event log.
pub(super) fn read_events(file: &Group, path: &Path) -> Result<Vec<Event>, OutputError> {
    let group = &file.group("events").at(path)?;
    let time: Vec<f64> = hdf::read_array(group, "time", path)?;
    let step: Vec<u64> = hdf::read_array(group, "step", path)?;
    let id_a: Vec<u32> = hdf::read_array(group, "id_a", path)?;
    let id_b: Vec<u32> = hdf::read_array(group, "id_b", path)?;
    let position: Vec<f64> = hdf::read_array(group, "position", path)?;
    let shares: Vec<f64> = hdf::read_array(group, "mode_shares", path)?;
    let in_shear: Vec<u8> = hdf::read_array(group, "in_shear", path)?;
    let energy: Vec<f64> = hdf::read_array(group, "energy", path)?;
    let damage: Vec<f64> = hdf::read_array(group, "damage", path)?;
    let joint: Vec<u16> = hdf::read_array(group, "joint", path)?;
    let count = time.len();
    let lengths = [step.len(), id_a.len(), id_b.len(), in_shear.len(), energy.len(), damage.len(), joint.len()];
    if lengths.iter().any(|&n| n != count) || position.len() != 3 * count || shares.len() != 4 * count {
        let problem = "the columns of `events` have different lengths".to_owned();
        return Err(OutputError::Damaged { path: path.to_owned(), problem });
    }
    let event = |k: usize| Event {
        time: time[k],
        step: step[k],
        id_a: id_a[k],
        id_b: id_b[k],
        position: Vec3::from_column_slice(&position[3 * k..3 * k + 3]),
        mode_shares: [shares[4 * k], shares[4 * k + 1], shares[4 * k + 2], shares[4 * k + 3]],
        in_shear: in_shear[k] != 0,
        energy: energy[k],
        damage: damage[k],
        joint: (joint[k] != u16::MAX).then_some(joint[k]),
    };
    Ok((0..count).map(event).collect())
}
