//! Contact forces: parallel, and bit-identical for any number of threads.
//!
//! Particles are cut into tiles of [`TILE`] consecutive indices; since the indices follow a space-filling curve, a tile is a
//! compact region of space. A tile owns the contacts whose particle A lies in it. It adds forces to its own particles
//! directly and writes the force on a B of another tile to a slot of its halo. Afterwards every particle adds the halo
//! slots addressed to it, in ascending order ([`TileMap`]). So the operations and their order depend on the numbering of
//! the particles alone, never on the threads.
//!
//! * [`context`](StepContext): inputs of a force evaluation besides the contacts;
//! * `tile_map`: the division of a block of contacts into tiles and halo slots;
//! * `tile`: the loop over the contacts of a tile, in several `kinds`; `batch`: contacts in columns or one by one; `commit` is its
//!   last stage; `temperature`: contacts whose constants depend on the temperature; `blocks`: laws in another language;
//! * `block`: the interface of a block to the solver, whatever its law; `laws`: the loops compiled for each law;
//! * [`walls`]: contacts with walls; [`record`]: forces as operators read them, without a step.

mod batch;
mod block;
mod blocks;
mod commit;
mod context;
mod kinds;
mod laws;
pub mod record;
mod temperature;
mod tile;
mod tile_map;
mod totals;
pub mod walls;

pub use block::{EvaluatedContacts, ParticleSums};
pub use blocks::{BlockLaw, Moved, evaluate_tile_in_blocks};
pub use context::{ExpansionRates, Softened, StepContext, motion_of};
pub use laws::LawLoops;
pub use tile::{Tile, evaluate_tile};
pub use tile_map::TileMap;
pub use totals::{BegunContact, BondEvent, Totals};

/// Particles per tile. The solver of a subdomain has a single tile instead
/// ([`Solver::for_subdomain`](super::Solver::for_subdomain)).
pub const TILE: usize = 1024;
