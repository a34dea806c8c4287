//! Bonds made during the run.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::quantity::{Energy, Number, Time};

/// Bonds made during the run between the particles that are near each other at that moment. They start without force, at the present
/// distance. It happens once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Bonding {
    /// Name of the stage at whose end the bonds are made. Required unless `time` or `kinetic_energy` is given.
    pub stage: Option<String>,
    /// Time from which on the bonds are made, s: at once, or as soon as the kinetic energy is small enough. Example: `time = "20 ms"`.
    #[schemars(extend("minimum" = 0))]
    pub time: Option<Time>,
    /// Kinetic energy of all particles, J, below which the bonds are made, from `time` on. Example: `kinetic_energy = "1 uJ"`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub kinetic_energy: Option<Energy>,
    /// Two particles are bonded if their center distance is at most this ratio times the sum of their radii; default: 1, particles that
    /// touch.
    #[serde(default = "one")]
    #[schemars(extend("minimum" = 1, "maximum" = 10))]
    pub interaction_ratio: Number,
    /// Names of the two materials that are bonded, which may be the same; default: all materials. Example:
    /// `between = ["cement", "sand"]`.
    pub between: Option<[String; 2]>,
}

fn one() -> Number {
    Number::new(1.0)
}
