//! Snapshots of a run: its particles and bonds at one time.

use std::sync::Arc;

use super::Recording;
use super::tables::{BondRows, bond_damage};
use crate::output::{BondSnapshot, Snapshot, SnapshotField, StoredSnapshot};
use crate::program::Failure;
use concordem_scenario::schedule::Simulation;
use concordem_solver::fracture::fragments::fragments;
use concordem_solver::state::columns::{Column, ColumnError, ColumnSink, ColumnStore};

/// The particles at one time, and the bonds if the scenario asks for them.
#[derive(Debug, Clone)]
pub struct Moment {
    /// The particles.
    pub particles: Arc<StoredSnapshot>,
    /// The bonds.
    pub bonds: Option<Arc<StoredSnapshot>>,
}

/// Name, unit, and description of the fields of particles.
const PARTICLES: [(&str, &str, &str); 10] = [
    ("radius", "m", "Radius"),
    ("displacement", "m", "Displacement since the start"),
    ("velocity", "m/s", "Velocity"),
    ("angular_velocity", "rad/s", "Angular velocity"),
    ("damage", "1", "Mean damage of the particle's bonds; broken bonds count as 1"),
    ("material", "1", "Number of the material in the scenario, from 0"),
    ("fragment", "1", "Smallest id of the particles that intact bonds connect"),
    ("temperature", "K", "Temperature"),
    ("aggregate", "1", "Number of the aggregate, from 1; 0 outside of all"),
    ("strength_factor", "1", "Factor on the strengths of the particle's bonds"),
];

/// Name, unit, and description of the fields of bonds.
const BONDS: [(&str, &str, &str); 6] = [
    ("damage", "1", "Damage, 0 intact, 1 without strength"),
    ("normal_force", "N", "Force along the bond, positive in tension"),
    ("shear_force", "N", "Magnitude of the force across the bond"),
    ("opening", "m", "Length less the length without strain"),
    ("broken", "1", "1 if the bond has broken, otherwise 0"),
    ("branch", "m", "From the center of the first particle to the center of the second or its periodic image"),
];

/// Unit and description of a field.
fn meaning(table: &[(&'static str, &'static str, &'static str)], name: &str) -> (&'static str, &'static str) {
    table.iter().find(|(other, ..)| *other == name).map_or(("1", ""), |&(_, unit, description)| (unit, description))
}

/// A field of reals in this table.
fn reals<'a>(
    table: &[(&'static str, &'static str, &'static str)],
    name: &'a str,
    data: &'a [f64],
    components: usize,
) -> SnapshotField<'a> {
    let (unit, description) = meaning(table, name);
    SnapshotField { name, description, column: Column::f64(data, components, unit) }
}

impl Moment {
    /// Steps done before it.
    pub fn step(&self) -> u64 {
        self.particles.step()
    }

    /// Writes it as columns below `path`, for a checkpoint.
    ///
    /// # Errors
    /// The errors of the sink.
    pub fn write(&self, path: &str, sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
        self.particles.write(&format!("{path}/particles"), sink)?;
        self.bonds.as_ref().map_or(Ok(()), |bonds| bonds.write(&format!("{path}/bonds"), sink))
    }

    /// The moment that [`Self::write`] has written below `path`, if there is one.
    pub fn read(path: &str, store: &ColumnStore) -> Option<Self> {
        let particles = StoredSnapshot::read(&format!("{path}/particles"), store, |name| meaning(&PARTICLES, name))?;
        let bonds = StoredSnapshot::read(&format!("{path}/bonds"), store, |name| meaning(&BONDS, name));
        Some(Self { particles: Arc::new(particles), bonds: bonds.map(Arc::new) })
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> usize {
        self.particles.bytes() + self.bonds.as_ref().map_or(0, |bonds| bonds.bytes())
    }
}

impl Recording {
    /// Whether a snapshot is due before the next step of `simulation`. `any`: whether there is one already.
    pub fn is_due(simulation: &Simulation, any: bool) -> bool {
        let step = simulation.state.clock.step;
        !any || simulation.schedule.snapshot_interval.is_some_and(|every| step.is_multiple_of(every))
    }

    /// The present particles and bonds.
    ///
    /// # Errors
    /// The forces of the bonds cannot be evaluated.
    pub fn snapshot(&self, simulation: &mut Simulation) -> Result<Moment, Failure> {
        let bonds = if self.with_bonds { Some(Arc::new(bonds(simulation)?)) } else { None };
        Ok(Moment { particles: Arc::new(self.particles(simulation)?), bonds })
    }

    fn particles(&self, simulation: &Simulation) -> Result<StoredSnapshot, Failure> {
        let state = &simulation.state;
        let particles = &state.particles;
        let displacement = self.displacement(state);
        let position = state.unwrapped_positions();
        let fragments = fragments(state);
        let damage = bond_damage(state);
        let reals = |name, data, components| reals(&PARTICLES, name, data, components);
        let whole = |name, column| SnapshotField { name, description: meaning(&PARTICLES, name).1, column };
        let mut fields = vec![
            reals("radius", &particles.radius, 1),
            reals("displacement", bytemuck::cast_slice(&displacement), 3),
            reals("velocity", bytemuck::cast_slice(&particles.velocity), 3),
            reals("angular_velocity", bytemuck::cast_slice(&particles.angular_velocity), 3),
            reals("damage", &damage, 1),
            whole("material", Column::u16(&particles.material)),
        ];
        if !state.bonds.is_empty() {
            fields.push(whole("fragment", Column::u32(&fragments)));
        }
        if let Some(heat) = &state.heat {
            fields.push(reals("temperature", &heat.temperature, 1));
        }
        if !particles.aggregate.is_empty() {
            fields.push(whole("aggregate", Column::u32(&particles.aggregate)));
        }
        let strengths = &simulation.solver.model().strengths;
        let of_particles: Vec<f64>;
        if !strengths.by_particle.is_empty() {
            of_particles = particles.id.iter().map(|id| strengths.of_particle(*id)).collect();
            fields.push(reals("strength_factor", &of_particles, 1));
        }
        Ok(StoredSnapshot::of(&Snapshot {
            time: state.clock.time(),
            step: state.clock.step,
            id: &particles.id,
            position: &position,
            cell: state.cell.as_ref().map(|cell| cell.matrix),
            fields,
        })?)
    }
}

/// The bonds, with their forces at the present positions.
fn bonds(simulation: &mut Simulation) -> Result<StoredSnapshot, Failure> {
    let forces = simulation.solver.record(&mut simulation.state)?;
    let state = &simulation.state;
    let rows = BondRows::of(state, &forces);
    let reals = |name, data, components| reals(&BONDS, name, data, components);
    let mut fields = vec![
        reals("damage", &rows.damage, 1),
        reals("normal_force", &rows.normal_force, 1),
        reals("shear_force", &rows.shear_force, 1),
        reals("opening", &rows.opening, 1),
        SnapshotField { name: "broken", description: meaning(&BONDS, "broken").1, column: Column::u8(&rows.broken) },
    ];
    if state.cell.is_some() {
        fields.push(reals("branch", bytemuck::cast_slice(&rows.branch), 3));
    }
    let (time, step) = (state.clock.time(), state.clock.step);
    Ok(StoredSnapshot::of_bonds(&BondSnapshot { time, step, ids: &rows.ids, fields })?)
}
