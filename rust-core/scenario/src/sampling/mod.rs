//! Operators that a run samples: the tables `[[sample]]` of a scenario.
//!
//! An [`Operator`] turns particles and contact forces into a continuum field such as a stress. Its
//! [`OperatorDefinition`] lists the quantities with units, the regions and keys it accepts, the data it needs, and the
//! function that evaluates it. The scenario schema, the checks, the columns of results, `concordem measure`, and Python
//! all use this definition.
//!
//! To add an operator: write a file in `operators/` with a `DEFINITION`, and add a line to the list in `operators/mod.rs`.
//!
//! ```
//! use concordem_scenario::sampling::Operator;
//!
//! let columns: Vec<_> = Operator::Porosity.quantities().iter().map(|q| (q.name, q.unit, q.components)).collect();
//! assert_eq!(columns, [("solid_fraction", "1", 1), ("porosity", "1", 1), ("volume", "m^3", 1)]);
//! assert_eq!(Operator::of_name("fabric"), Some(Operator::Fabric));
//! ```

mod definition;
mod operators;
mod record;
mod scheduled;
mod state;

pub use definition::{Need, OperatorDefinition, Refusal, RegionRule, SampleKey, SampledQuantity, Surroundings};
pub use operators::Operator;
pub use record::{Record, SeriesColumn};
pub use scheduled::{SampledRegion, SampledWall, ScheduledOperator};
pub use state::{Bonds, SampledHeat, SampledState, rigid_links, rotation_vector};
