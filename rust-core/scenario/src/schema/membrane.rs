//! Flexible membranes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::packing::Axis;
use super::quantity::{Length, Stress};

/// A flexible membrane, as the rubber around a triaxial specimen: it spans the outer particles by triangles between their centers (in
/// two dimensions lines), and presses on them. Each triangle gives a third of its pressure times its present area to each of its
/// corners. The triangles are found at the start and move with their particles. One that is drawn out wider than twice its reach presses
/// less, and from four times on not at all: its particle has left the body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Membrane {
    /// Pressure on the specimen, Pa. Required. Example: `pressure = "2 MPa"`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub pressure: Stress,
    /// Name of a history that multiplies the pressure; default: constant.
    pub history: Option<String>,
    /// Axis at whose two ends the membrane is open, because plates or end layers press there: triangles between particles of the
    /// outermost layer, one mean diameter thick, are left out. Default: none, the membrane is closed. Example: `open_along = "z"`.
    pub open_along: Option<Axis>,
    /// Largest radius of an empty sphere (disc) through the centers of particles that the membrane leaves inside. Into wider gaps at
    /// the surface it sinks. Default: 2.5 times the largest radius of a particle.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub reach: Option<Length>,
}
