//! Everything that changes during a run: particles, contacts, cell, walls, clock, ledger. Complete and serializable.

pub mod clumps;
pub mod columns;
pub mod contacts;
pub mod mesh;
mod pairs;
pub mod particles;
mod persistence;
pub mod surface;
pub mod table;
mod triangle;
pub mod walls;

pub use clumps::Clump;
pub use columns::{Column, ColumnError, ColumnSink, ColumnSource, WriteColumns};
pub use concordem_contact::Cell;
pub use mesh::{Mesh, MeshError};
pub use particles::{Constraint, Deformation, Load, Particles, PointOfAction, Sphere};
pub use surface::Surface;
pub use walls::{Turning, Wall, WallShape};

use concordem_contact::math::Vec3;

use crate::energy::Ledger;
use crate::evaluation::EvaluatedContacts;
use crate::heat::HeatState;
use contacts::BrokenBond;

/// Time of a run.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Clock {
    /// Number of steps done.
    pub step: u64,
    /// Time step, s.
    pub dt: f64,
}

impl Clock {
    /// Time, s.
    pub fn time(&self) -> f64 {
        self.step as f64 * self.dt
    }
}

/// The complete state of a simulation.
#[derive(Default)]
pub struct State {
    /// Particles.
    pub particles: Particles,
    /// Periodic cell, if any.
    pub cell: Option<Cell>,
    /// Bonds, one block per law.
    pub bonds: Vec<Box<dyn EvaluatedContacts>>,
    /// Broken bonds, in the order in which they broke.
    pub broken: Vec<BrokenBond>,
    /// Unbonded contacts and candidates, if unbonded pairs interact.
    pub contacts: Option<Box<dyn EvaluatedContacts>>,
    /// Walls.
    pub walls: Vec<Wall>,
    /// Contacts with walls.
    pub wall_contacts: Option<Box<dyn EvaluatedContacts>>,
    /// Rigid clumps.
    pub clumps: Vec<Clump>,
    /// Time.
    pub clock: Clock,
    /// Energies.
    pub ledger: Ledger,
    /// Temperatures, if heat flows.
    pub heat: Option<HeatState>,
    /// Velocities (m/s) and angular velocities (rad/s) that prescribed degrees of freedom take in the next step, by particle, if
    /// they were set since the last one.
    pub motion: Option<Vec<(Vec3, Vec3)>>,
    /// Memory of the schedule: peaks, servo terms, and other numbers of the loading, by position.
    pub schedule_memory: Vec<f64>,
}

impl Clone for State {
    fn clone(&self) -> Self {
        Self {
            particles: self.particles.clone(),
            cell: self.cell,
            bonds: self.bonds.iter().map(|b| b.boxed_clone()).collect(),
            broken: self.broken.clone(),
            contacts: self.contacts.as_ref().map(|b| b.boxed_clone()),
            walls: self.walls.clone(),
            wall_contacts: self.wall_contacts.as_ref().map(|b| b.boxed_clone()),
            clumps: self.clumps.clone(),
            clock: self.clock,
            ledger: self.ledger,
            heat: self.heat.clone(),
            motion: self.motion.clone(),
            schedule_memory: self.schedule_memory.clone(),
        }
    }
}

impl State {
    /// The bonds that broke, without those that were open from the start.
    pub fn broken_bonds(&self) -> impl Iterator<Item = &BrokenBond> {
        self.broken.iter().filter(|bond| !bond.open)
    }

    /// Displacement from the position of particle `p` to its position without the moves back by whole cells, m.
    pub fn unwrapping(&self, p: usize) -> Vec3 {
        self.particles.unwrapping(p, self.cell.as_ref())
    }

    /// Positions as if no particle had been moved back by whole cells, m.
    pub fn unwrapped_positions(&self) -> Vec<Vec3> {
        self.particles.position.iter().enumerate().map(|(p, x)| x + self.unwrapping(p)).collect()
    }

    /// Number of bonds that have not broken.
    pub fn bond_count(&self) -> usize {
        self.bonds
            .iter()
            .map(|b| (0..b.len()).filter(|&k| !b.view(k).flags.has(contacts::ContactFlags::BROKEN)).count())
            .sum()
    }
}
