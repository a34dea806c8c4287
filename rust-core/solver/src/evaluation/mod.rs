//! What an evaluation of the contacts of a state reads and gives.
//!
//! This is all that the state knows of forces: its blocks of contacts can be evaluated. [`forces`](crate::forces) does it, law by law.
//!
//! * [`StepContext`]: inputs besides the contacts;
//! * [`ParticleSums`]: where forces on particles are added; [`TileMap`]: the halo between tiles of particles;
//! * [`Totals`]: energies and events; [`ContactForces`], [`WallForces`]: forces as operators read them.

mod context;
pub(crate) mod recorded;
mod sums;
pub(crate) mod tile_map;
mod totals;

pub use context::{ContactFactors, ExpansionRates, Softened, StepContext, motion_of};
pub use recorded::{ContactForces, WallForces};
pub use sums::ParticleSums;
pub use tile_map::{TILE, TileMap};
pub use totals::{BegunContact, BondEvent, Totals};

use crate::state::contacts::Contacts;
use crate::state::walls::Wall;

/// A block of contacts that the solver can evaluate.
pub trait EvaluatedContacts: Contacts {
    /// Evaluate all contacts; histories advance by one step.
    ///
    /// Adds forces on particles of a contact's own tile to `sums`; others go to the map's halo.
    fn evaluate(&mut self, context: &StepContext<'_>, map: &mut TileMap, sums: ParticleSums<'_>) -> Totals;
    /// Evaluate all contacts with walls; histories advance by one step.
    ///
    /// `b` of a pair numbers the elements of all walls. Adds forces on particles to `sums`, and forces of the particles
    /// on the walls to `walls`.
    fn evaluate_walls(&mut self, context: &StepContext<'_>, walls: &mut [Wall], sums: ParticleSums<'_>) -> Totals;
    /// Append the forces of all contacts at the present positions; histories stay. With `border` (whether each particle belongs to a
    /// set), only those of contacts between a member and another particle.
    fn record(&self, context: &StepContext<'_>, border: Option<&[bool]>, out: &mut ContactForces);
    /// Append the forces of all contacts with walls at the present positions; histories stay.
    fn record_walls(&self, context: &StepContext<'_>, walls: &[Wall], out: &mut WallForces);
    /// Copy of the block.
    fn boxed_clone(&self) -> Box<dyn EvaluatedContacts>;
    /// The block as plain contacts.
    fn contacts(&self) -> &dyn Contacts;
    /// The block as plain contacts.
    fn contacts_mut(&mut self) -> &mut dyn Contacts;
}
