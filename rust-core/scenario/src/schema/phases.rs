//! The table `[phases]`: materials and aggregates of given particles.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Materials and aggregates of the spheres of the packing, one number each, in the order of the packing: what `[aggregates]` finds from
/// shapes, given by another program.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Phases {
    /// Number of the material of each sphere, from 0 in the order of `[[material]]`. Required. Example: `materials = [0, 0, 1]`.
    pub materials: Vec<u16>,
    /// Number of the aggregate to which each sphere belongs, from 1; 0 for none; default: none. Bonds between two aggregates of one
    /// material have the `[[interface]]` of this material with itself, or with the first one. Example: `aggregates = [0, 0, 1]`.
    #[serde(default)]
    pub aggregates: Vec<u32>,
}
