//! Displacement or velocity gradient, averaged over Delaunay cells whose corners are the particles.

use crate::sampling::definition::{
    CELLS, OperatorDefinition, RegionRule, Row, SampledQuantity, Sampling, VOLUME, tensor,
};
use crate::sampling::state::MotionKind;
use concordem_operator::OperatorError;
use concordem_operator::strain::cell_strain;

const STRAIN_QUANTITIES: &[SampledQuantity] =
    &[tensor("gradient", "1", "Displacement gradient du_i/dx_j in the initial cells"), VOLUME, CELLS];

const RATE_QUANTITIES: &[SampledQuantity] = &[tensor("gradient", "1/s", "Velocity gradient dv_i/dx_j"), VOLUME, CELLS];

pub(super) const STRAIN: OperatorDefinition = OperatorDefinition {
    quantities: STRAIN_QUANTITIES,
    region: RegionRule::Shape,
    keys: &[],
    needs_initial_positions: true,
    needs_bonds: false,
    evaluate: |sampling, row| evaluate(sampling, MotionKind::Displacement, row),
};

pub(super) const RATE: OperatorDefinition = OperatorDefinition {
    quantities: RATE_QUANTITIES,
    // The rate uses the mesh of the initial positions, too.
    needs_initial_positions: true,
    evaluate: |sampling, row| evaluate(sampling, MotionKind::Rate, row),
    ..STRAIN
};

fn evaluate(sampling: &Sampling<'_>, kind: MotionKind, row: &mut Row) -> Result<(), OperatorError> {
    let mesh = sampling.state.initial_mesh()?;
    let m = sampling.state.motion_of_mesh(kind);
    let all = cell_strain(mesh, &m.position, &m.displacement, m.period.as_ref())?;
    let mean = all.within(mesh, &m.position, sampling.region, m.period.as_ref())?;
    row.tensor(&mean.gradient).scalars([mean.volume, mean.cells.len() as f64]);
    Ok(())
}
