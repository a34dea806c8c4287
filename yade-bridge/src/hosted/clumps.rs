//! Rigid clumps of a host.

use std::collections::HashMap;

use concordem::math::{Quat, Vec3};
use concordem::state::{Clump, State};
use concordem_yade::assembly::HostClump;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::{get, same_length};
use concordem_python::arrays::{Indices, Rows, Scalars, Vectors, rows, vectors};

/// Rigid clumps from arrays: position, velocity, orientation (x, y, z, w), angular_momentum, mass, inertia, constraint, one row per clump;
/// member (row of the bodies), of (clump of the member), offset, relative (orientation), one row per member.
pub(super) fn of_arrays(clumps: &Bound<'_, PyDict>) -> PyResult<Vec<HostClump>> {
    let (position, velocity): (Vectors<'_>, Vectors<'_>) = (get(clumps, "position")?, get(clumps, "velocity")?);
    let (momentum, inertia): (Vectors<'_>, Vectors<'_>) = (get(clumps, "angular_momentum")?, get(clumps, "inertia")?);
    let (orientation, relative): (Rows<'_>, Rows<'_>) = (get(clumps, "orientation")?, get(clumps, "relative")?);
    let (mass, constraint): (Scalars<'_>, Indices<'_>) = (get(clumps, "mass")?, get(clumps, "constraint")?);
    let (member, of, offset): (Indices<'_>, Indices<'_>, Vectors<'_>) =
        (get(clumps, "member")?, get(clumps, "of")?, get(clumps, "offset")?);
    let (position, velocity, momentum, inertia) = (position.get()?, velocity.get()?, momentum.get()?, inertia.get()?);
    let (mass, constraint, member, of, offset) =
        (mass.get()?, constraint.get()?, member.get()?, of.get()?, offset.get()?);
    let (count, members) = (position.len(), member.len());
    for (name, found, wanted) in [
        ("velocity", velocity.len(), count),
        ("angular_momentum", momentum.len(), count),
        ("inertia", inertia.len(), count),
        ("mass", mass.len(), count),
        ("constraint", constraint.len(), count),
        ("orientation", orientation.get()?.len(), 4 * count),
        ("of", of.len(), members),
        ("offset", offset.len(), members),
        ("relative", relative.get()?.len(), 4 * members),
    ] {
        same_length(name, found, wanted)?;
    }
    let quaternions = |rows: &Rows<'_>| -> PyResult<Vec<Quat>> {
        Ok(rows.get()?.chunks_exact(4).map(|q| Quat::new(q[3], q[0], q[1], q[2])).collect())
    };
    let (orientation, relative) = (quaternions(&orientation)?, quaternions(&relative)?);
    let mut found: Vec<HostClump> = (0..count)
        .map(|k| HostClump {
            members: Vec::new(),
            offsets: Vec::new(),
            orientations: Vec::new(),
            position: position[k],
            velocity: velocity[k],
            orientation: orientation[k],
            angular_momentum: momentum[k],
            mass: mass[k],
            inertia: inertia[k],
            constraint: constraint[k],
        })
        .collect();
    for (row, &clump) in of.iter().enumerate() {
        let clump = found
            .get_mut(clump as usize)
            .ok_or_else(|| PyValueError::new_err(format!("`of` contains {clump}, but there are {count} clumps")))?;
        clump.members.push(member[row]);
        clump.offsets.push(offset[row]);
        clump.orientations.push(relative[row]);
    }
    Ok(found)
}

/// Motion of the clumps, one row each.
pub(super) fn motion<'py>(py: Python<'py>, state: &State) -> PyResult<Bound<'py, PyDict>> {
    // All members of a clump have its angular velocity.
    let spin =
        |members: &[u32]| members.first().map_or(Vec3::zeros(), |&m| state.particles.angular_velocity[m as usize]);
    let column = |of: &dyn Fn(&Clump) -> Vec3| vectors(py, &state.clumps.iter().map(of).collect::<Vec<_>>());
    let orientation: Vec<Quat> = state.clumps.iter().map(|clump| clump.orientation).collect();
    let dict = PyDict::new(py);
    dict.set_item("position", column(&|clump| clump.position)?)?;
    dict.set_item("velocity", column(&|clump| clump.velocity)?)?;
    dict.set_item("angular_velocity", column(&|clump| spin(&clump.members))?)?;
    dict.set_item("angular_momentum", column(&|clump| clump.angular_momentum)?)?;
    dict.set_item("orientation", rows::<_, f64>(py, &orientation, 4)?)?;
    Ok(dict)
}

/// Renumber the members of the clumps, which are rows of particles with the ids `before`, for the particles of `state`. A file keeps
/// the motion of clumps, but not their members.
pub(super) fn place_members(state: &mut State, before: &[u32]) -> Result<(), String> {
    let place: HashMap<u32, u32> = state.particles.id.iter().copied().zip(0..).collect();
    let State { particles, clumps, .. } = state;
    for (number, clump) in clumps.iter_mut().enumerate() {
        let mut members: Vec<_> = clump.members.iter().zip(&clump.offsets).zip(&clump.orientations).collect();
        members.sort_unstable_by_key(|((m, _), _)| place.get(&before[**m as usize]));
        let moved: Option<Vec<u32>> =
            members.iter().map(|((m, _), _)| place.get(&before[**m as usize]).copied()).collect();
        let (offsets, orientations) =
            (members.iter().map(|((_, x), _)| **x).collect(), members.iter().map(|(_, q)| **q).collect());
        let known = |m: &u32| particles.clump[*m as usize] == number as u32;
        let Some(moved) = moved.filter(|moved| moved.iter().all(known)) else {
            return Err(
                "the file contains other clumps than the scene; load the file that was saved with this scene".into()
            );
        };
        (clump.members, clump.offsets, clump.orientations) = (moved, offsets, orientations);
    }
    Ok(())
}
