//! Gradient of motion with rotations, from the contact cells (power diagram) of the periodic cell.
//!
//! Page: [Strain](strain.md#contact-cells)

use crate::sampling::definition::{
    Need, OperatorDefinition, RegionRule, Row, SampledQuantity, Sampling, VOLUME, scalar, tensor,
};
use crate::sampling::state::MotionKind;
use concordem_operator::OperatorError;
use concordem_operator::strain::satake_strain;
use concordem_operator::tessellation::{Domain, power_diagram};

pub(super) const FACES: SampledQuantity = scalar("faces", "1", "Faces between contact cells");

const QUANTITIES: &[SampledQuantity] =
    &[tensor("gradient", "1", "du_i/dx_j + e_ijk phi_k: the transposed Cosserat strain"), VOLUME, FACES];

pub(super) const DEFINITION: OperatorDefinition = OperatorDefinition {
    name: "contact-cell-strain",
    meaning: "Displacement gradient with rotations since the start, from the contact cells (power diagram) of the periodic cell.",
    quantities: QUANTITIES,
    region: RegionRule::PeriodicCell,
    needs: &[Need::InitialPositions],
    evaluate: |sampling, row| evaluate(sampling, MotionKind::Displacement, row),
    ..OperatorDefinition::PLAIN
};

pub(super) fn evaluate(sampling: &Sampling<'_>, kind: MotionKind, row: &mut Row) -> Result<(), OperatorError> {
    let state = sampling.state;
    let m = state.motion(kind);
    let edges = m.period.map(|period| period.edges).ok_or(OperatorError::Singular {
        what: "the strain of contact cells",
        reason: "without a periodic cell the motion of their border is not known",
    })?;
    let domain = Domain::Periodic(edges);
    let diagram = power_diagram(&m.position, &state.particles.radius, &domain, state.dimension())?;
    let strain = satake_strain(&diagram, &m.displacement, &m.rotation, &[], m.period.as_ref())?;
    row.tensor(&strain.gradient).scalars([strain.volume, diagram.faces.len() as f64]);
    Ok(())
}
