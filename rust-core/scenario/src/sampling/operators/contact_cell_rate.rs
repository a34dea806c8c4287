//! Velocity gradient from the contact cells of the periodic cell.
//!
//! Page: [Strain](strain.md#contact-cells)

use super::contact_cell_strain::{self, FACES, evaluate};
use crate::sampling::definition::{OperatorDefinition, SampledQuantity, VOLUME, tensor};
use crate::sampling::state::MotionKind;

const QUANTITIES: &[SampledQuantity] =
    &[tensor("gradient", "1/s", "dv_i/dx_j + e_ijk w_k: the transposed Cosserat strain rate"), VOLUME, FACES];

pub(super) const DEFINITION: OperatorDefinition = OperatorDefinition {
    name: "contact-cell-rate",
    meaning: "Velocity gradient with angular velocities, from the contact cells of the periodic cell.",
    quantities: QUANTITIES,
    needs: &[],
    evaluate: |sampling, row| evaluate(sampling, MotionKind::Rate, row),
    ..contact_cell_strain::DEFINITION
};
