//! Contact laws: force and moment between two particles from their relative motion.
//!
//! A law is a pure function: parameters are `self`, history is [`ContactLaw::State`], everything else is an argument.
//! The same inputs give the same bits for every caller: the solver, a host code, or a test.
//!
//! A law is one file here and one line in the list of [`registry`]. Scenarios and hosts read everything else from the law
//! ([`RegisteredLaw`]).

pub mod common;
pub mod contract;
#[cfg(feature = "std")]
pub mod factors;
#[cfg(feature = "std")]
pub mod names;
pub mod registry;
pub mod restitution;
pub mod state;
pub mod straight_form;
#[cfg(feature = "std")]
pub mod table;

// `cargo fmt` does not see these files; `make check` formats them by name.
macro_rules! laws {
    ($($key:ident: $Law:ident,)*) => { $(
        pub mod $key;
        pub use $key::$Law;
    )* };
}
crate::for_each_law!(laws);

pub use crate::elastic::Elastic;
pub use crate::geometry::{ContactGeometry, Reference};
pub use crate::kinematics::Kinematics;
pub use cohesive_beam::{BeamModel, BeamStiffness, BendingTerm, CohesiveBeamState, PairRadius, Section, ShearStrength};
pub use common::ParameterError;
pub use contract::{ContactLaw, EnergySplit, Response, Status, Stiffness, TemperatureFactors};
pub use cpm::{CpmParameters, CpmState};
pub use damped_beam::{BeamDamping, DampedBeamState};
#[cfg(feature = "std")]
pub use factors::Factors;
pub use frictional::{ContactStiffness, FrictionalState};
pub use hertz_mindlin::HertzMindlinState;
pub use jointed::JointedState;
pub use linear_bond::LinearBondState;
#[cfg(feature = "std")]
pub use names::{ContactLawName, LawName};
pub use softening_beam::{BeamFractureEnergy, Softening, SofteningBeamState};
pub use state::{Field, LawState, Parity};
pub use straight_form::{ColumnUse, Given, Masses};
#[cfg(feature = "std")]
pub use table::{Fault, FaultKind, HasTable, LawFacts, LawTable, RegisteredLaw};
