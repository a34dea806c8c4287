//! Sums of a force evaluation.

use concordem_contact::law::EnergySplit;
use concordem_contact::math::{Mat3, Vec3};

use crate::state::contacts::Pair;

/// A bond that broke, or whose damage exceeded the threshold of the event log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BondEvent {
    /// The particles, by index.
    pub pair: Pair,
    /// Whether the bond broke, and its pair goes on without it; otherwise its damage exceeded the threshold.
    pub broke: bool,
    /// Whether it lost its cohesion in this step. Not if it broke and had lost it before, as an earlier event told.
    pub fails: bool,
    /// Whether shear made it fail, where its law has a criterion of shear.
    pub in_shear: bool,
    /// Damage reached.
    pub damage: f64,
    /// Contact point, m.
    pub position: Vec3,
    /// Energy dissipated by damage in this step, J.
    pub energy: f64,
    /// Energy stored in normal, shear, bending, and twist deformation, J: before the bond broke, or after it was damaged.
    pub stored: [f64; 4],
}

/// An unbonded contact that began in this step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BegunContact {
    /// Its particles, or its particle and wall element, by index.
    pub pair: Pair,
    /// Periodic image of B.
    pub image: [i8; 3],
    /// Index of its pair coefficients.
    pub row: u16,
}

/// Sums over a block of contacts, and its bond events.
#[derive(Debug, Clone, Default)]
pub struct Totals {
    /// Energies, J.
    pub energy: EnergySplit,
    /// `Σ l⊗f` with the force on A, J; divided by the volume it is the stress (tension positive, position index first).
    pub virial: Mat3,
    /// `Σ f⊗image`, N, over contacts across the periodic border.
    pub crossing: Mat3,
    /// `Σ|f|²`, N², in steps that sample.
    pub force_squared: f64,
    /// `Σ|m|²` of the moments that contacts transmit, N²·m², in steps that sample.
    pub moment_squared: f64,
    /// Work of the thermal expansion of bonds over the half steps before and after the present instant, J.
    pub expansion: [f64; 2],
    /// Work of the change of stiffness with the temperature, J.
    pub stiffness_work: f64,
    /// Energy that contacts dissipated by damage, friction, and dashpots, in the order of the contacts, J, if it becomes heat.
    pub dissipated: Vec<(Pair, f64)>,
    /// Number of contacts with a force.
    pub active: u64,
    /// Bond events in the order of the contacts.
    pub bond_events: Vec<BondEvent>,
    /// Unbonded contacts that opened, in the order of the contacts.
    pub opened: Vec<Pair>,
    /// Unbonded contacts that began, in the order of the contacts, under laws whose stiffness grows with the overlap.
    pub begun: Vec<BegunContact>,
}

impl Totals {
    /// Add other totals.
    pub fn merge(&mut self, other: Self) {
        self.energy += other.energy;
        self.virial += other.virial;
        self.crossing += other.crossing;
        self.active += other.active;
        self.force_squared += other.force_squared;
        self.moment_squared += other.moment_squared;
        self.expansion[0] += other.expansion[0];
        self.expansion[1] += other.expansion[1];
        self.stiffness_work += other.stiffness_work;
        self.bond_events.extend(other.bond_events);
        self.opened.extend(other.opened);
        self.begun.extend(other.begun);
        self.dissipated.extend(other.dissipated);
    }
}
