//! Particles and meshes that repeat a recorded motion.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Particles or a mesh that repeat the motion in a file, such as that of a run coupled with finite elements.
///
/// The file has NumPy's format .npy with 64-bit numbers and three axes: steps plus one, particles or vertices, components. Entry 0 is
/// the motion before the first step, entry k that of step k, counted from 1. `[stop]` needs `steps`, at most those of the file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Slave {
    /// Name of a set. A `[[prescribe]]` without a history prescribes all components of velocity and angular velocity of its particles;
    /// the file gives their values, by ascending id: six components, m/s and rad/s. Give either `set` or `wall`.
    pub set: Option<String>,
    /// Name of a wall of the kind "mesh" without `motion`. Three components: velocities of the vertices in each step, m/s. Six: their
    /// places (m) after each step, and the velocities (m/s) with which they came there.
    pub wall: Option<String>,
    /// File with the motion. Required. Example: `path = "slaves.npy"`.
    pub path: String,
}

impl Slave {
    /// Name of the set or the wall.
    pub fn name(&self) -> &str {
        self.set.as_deref().or(self.wall.as_deref()).unwrap_or_default()
    }
}
