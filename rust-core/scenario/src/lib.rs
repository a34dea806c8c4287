//! From a scenario file to a run.
//!
//! A scenario passes through these modules; each module uses only the ones above it:
//!
//! ```text
//! scenario.toml
//!   │
//! sampling   operators and columns of the time series: names, units, evaluation
//! walls      kinds of walls: keys, checks, surfaces
//! schema     types of the scenario, JSON Schema, templates, problem reports
//! checks     Scenario::parse and Scenario::read: structure, then meaning; all faults at once
//! schedule   loading, samples, and stop conditions of a run; Simulation::advance
//! assembly   packing, particles, bonds, walls, model, time step → State + Model + Schedule
//!   │
//! Simulation::new(state, model, schedule)
//! ```
//!
//! ```
//! use concordem_scenario::assembly::assemble;
//! use concordem_scenario::schedule::{Simulation, StopReason};
//! use concordem_scenario::schema::Scenario;
//!
//! // A glass sphere hits another one at 1 m/s.
//! let scenario = Scenario::parse("impact.toml", r#"
//!     version = 1
//!     [packing]
//!     kind = "spheres"
//!     spheres = [[0, 0, 0, "10 mm"], ["20.1 mm", 0, 0, "10 mm"]]
//!     [[material]]
//!     name = "glass"
//!     density = "2500 kg/m^3"
//!     hertz_mindlin = { young = "70 GPa", poisson = 0.22, restitution = 0.9 }
//!     [contacts]
//!     law = "hertz_mindlin"
//!     [[set]]
//!     name = "first"
//!     selection = { kind = "ids", ids = [0] }
//!     [[initial]]
//!     set = "first"
//!     velocity = ["1 m/s", 0, 0]
//!     [integration]
//!     safety = 0.1
//!     [stop]
//!     time = "0.3 ms"
//! "#)?;
//! let assembly = assemble(&scenario, &scenario.directory(), &mut |_, _| ())?;
//! let mut simulation = Simulation::new(assembly.state, assembly.model, assembly.schedule)?;
//! let reason = loop {
//!     if let Some(reason) = simulation.advance()?.stopped {
//!         break reason;
//!     }
//! };
//! assert_eq!(reason, StopReason::Time);
//! // The rebound speed is the impact speed times the restitution.
//! let velocity = &simulation.state.particles.velocity;
//! assert!((velocity[1].x - velocity[0].x - 0.9).abs() < 0.01);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod assembly;
pub mod checks;
pub mod sampling;
pub mod schedule;
pub mod schema;
pub mod walls;

/// The code of the README is tested.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
