//! Velocity gradient, averaged over Delaunay cells whose corners are the particles.
//!
//! Page: [Strain](strain.md#space-cells)

use super::cell_strain::{self, evaluate};
use crate::sampling::definition::{CELLS, Need, OperatorDefinition, SampledQuantity, VOLUME, tensor};
use crate::sampling::state::MotionKind;

const QUANTITIES: &[SampledQuantity] = &[tensor("gradient", "1/s", "Velocity gradient dv_i/dx_j"), VOLUME, CELLS];

pub(super) const DEFINITION: OperatorDefinition = OperatorDefinition {
    name: "cell-rate",
    meaning: "Velocity gradient, averaged over the same Delaunay cells at their present positions.",
    quantities: QUANTITIES,
    // The rate uses the mesh of the initial positions, too.
    needs: &[Need::InitialPositions],
    evaluate: |sampling, row| evaluate(sampling, MotionKind::Rate, row),
    ..cell_strain::DEFINITION
};
