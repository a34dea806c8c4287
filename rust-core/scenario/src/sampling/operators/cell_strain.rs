//! Displacement or velocity gradient, averaged over Delaunay cells whose corners are the particles.
//!
//! Page: [Strain](strain.md#space-cells)

use crate::sampling::definition::{
    CELLS, Need, OperatorDefinition, RegionRule, Row, SampledQuantity, Sampling, VOLUME, tensor,
};
use crate::sampling::state::MotionKind;
use concordem_operator::OperatorError;
use concordem_operator::strain::cell_strain;

const QUANTITIES: &[SampledQuantity] =
    &[tensor("gradient", "1", "Displacement gradient du_i/dx_j in the initial cells"), VOLUME, CELLS];

pub(super) const DEFINITION: OperatorDefinition = OperatorDefinition {
    name: "cell-strain",
    meaning: "Displacement gradient since the start, averaged over the Delaunay cells of the initial positions.",
    quantities: QUANTITIES,
    region: RegionRule::Shape,
    needs: &[Need::InitialPositions],
    evaluate: |sampling, row| evaluate(sampling, MotionKind::Displacement, row),
    ..OperatorDefinition::PLAIN
};

pub(super) fn evaluate(sampling: &Sampling<'_>, kind: MotionKind, row: &mut Row) -> Result<(), OperatorError> {
    let mesh = sampling.state.initial_mesh()?;
    let m = sampling.state.motion_of_mesh(kind);
    let all = cell_strain(mesh, &m.position, &m.displacement, m.period.as_ref())?;
    let mean = all.within(mesh, &m.position, sampling.region, m.period.as_ref())?;
    row.tensor(&mean.gradient).scalars([mean.volume, mean.cells.len() as f64]);
    Ok(())
}
