//! Contacts: one contiguous block per law, sorted by particle index, hence along the space-filling curve.

mod editing;
mod law;
mod order;
mod reading;
mod stiffness;
mod storage;
mod temperature;

use std::any::Any;

use super::particles::Particles;
use super::table::Table;
use concordem_contact::kinematics::PreviousGeometry;
use concordem_contact::law::{ContactGeometry, ContactLaw, Reference};

pub use super::pairs::{BrokenBond, ContactFlags, Pair};
pub use editing::EditContacts;
pub use law::{LawOfContacts, is_open};
pub use reading::ReadContacts;
pub use stiffness::ContactStiffness;
pub use storage::StoreContacts;
pub use temperature::ContactTemperature;

/// All contacts under one law.
#[derive(Debug, Clone, Default)]
pub struct ContactBlock<L: ContactLaw> {
    /// Pair coefficients (part of the model; constant).
    pub rows: Vec<L>,
    /// The particles.
    pub pair: Vec<Pair>,
    /// Image, pair coefficients, flags.
    pub flags: Vec<ContactFlags>,
    /// Reference length and area.
    pub reference: Table<Reference>,
    /// Normal and length of the last step.
    pub previous: Table<PreviousGeometry>,
    /// History.
    pub history: Table<L::State>,
    /// Reference lengths of the bonds at the reference temperature, m; empty if bonds do not expand.
    pub rest_length: Vec<f64>,
    /// Largest factor on the stiffness by material, over all temperatures (part of the model); empty if it is constant.
    pub largest_factor: Vec<f64>,
}

/// One contact, whatever its law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactView {
    /// Particles.
    pub pair: Pair,
    /// Image, pair coefficients, flags.
    pub flags: ContactFlags,
    /// Reference length and area.
    pub reference: Reference,
    /// Normal and length of the last step.
    pub previous: PreviousGeometry,
}

impl<L: ContactLaw> ContactBlock<L> {
    /// An empty block with the given pair coefficients.
    pub fn new(rows: Vec<L>) -> Self {
        Self {
            rows,
            pair: Vec::new(),
            flags: Vec::new(),
            reference: Table::default(),
            previous: Table::default(),
            history: Table::default(),
            rest_length: Vec::new(),
            largest_factor: Vec::new(),
        }
    }

    /// Number of contacts, broken and inactive ones included.
    pub fn len(&self) -> usize {
        self.pair.len()
    }

    /// Whether there are no contacts.
    pub fn is_empty(&self) -> bool {
        self.pair.is_empty()
    }

    /// Add a contact without history; call [`Self::sort`] after the last one.
    pub fn push(&mut self, pair: Pair, flags: ContactFlags, reference: Reference, previous: PreviousGeometry) {
        self.pair.push(pair);
        self.flags.push(flags);
        self.reference.push(reference);
        self.previous.push(previous);
        self.history.push(L::State::default());
        if !self.rest_length.is_empty() {
            self.rest_length.push(reference.length);
        }
    }

    /// Geometry of contact `k`. With a wall, B has zero radius and infinite mass.
    #[inline(always)]
    pub fn geometry(&self, k: usize, particles: &Particles, with_wall: bool) -> ContactGeometry {
        let (a, b) = (self.pair[k].a as usize, self.pair[k].b as usize);
        let Reference { length: reference_length, area } = self.reference.get(k);
        ContactGeometry {
            reference_length,
            area,
            radius_a: particles.radius[a],
            radius_b: if with_wall { 0.0 } else { particles.radius[b] },
            mass_a: particles.mass[a],
            mass_b: if with_wall { f64::INFINITY } else { particles.mass[b] },
        }
    }
}

/// A block of contacts, whatever its law, for everything but the force evaluation. A `dyn Contacts` has the methods of all these traits;
/// a block of a known law has those of the traits in scope.
pub trait Contacts:
    ReadContacts + EditContacts + LawOfContacts + ContactStiffness + ContactTemperature + StoreContacts
{
    /// For downcasting to the typed block.
    fn as_any(&self) -> &dyn Any;
    /// For downcasting to the typed block.
    fn as_any_mut(&mut self) -> &mut dyn Any;
}

impl<L: ContactLaw> Contacts for ContactBlock<L> {
    fn as_any(&self) -> &dyn Any {
        self
    }
    fn as_any_mut(&mut self) -> &mut dyn Any {
        self
    }
}
