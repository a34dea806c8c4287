//! Values that runs have measured, stored so that they are not measured again.

use std::collections::BTreeMap;

/// Measured values by their arguments.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Measured<V> {
    /// Everything else that the values depend on, as text: specimen, motion, elastic parameters, program.
    pub specimen: String,
    /// Values.
    pub values: BTreeMap<String, V>,
}

impl<V> Default for Measured<V> {
    fn default() -> Self {
        Self { specimen: String::new(), values: BTreeMap::new() }
    }
}
