//! Best affine fit of motion and rotation in a region, since the start or as rates.
//!
//! Page: [Strain](strain.md#affine-fit)

use crate::sampling::definition::{
    Need, OperatorDefinition, PARTICLES, RegionRule, Row, SampledQuantity, Sampling, scalar, tensor, vector,
};
use crate::sampling::state::MotionKind;
use concordem_operator::OperatorError;
use concordem_operator::strain::{AffineFit, affine_fit};

const QUANTITIES: &[SampledQuantity] = &[
    tensor("gradient", "1", "Displacement gradient du_i/dx_j at initial positions"),
    tensor("cosserat_strain", "1", "Cosserat strain du_j/dx_i - e_ijk phi_k"),
    tensor("curvature", "1/m", "Curvature dphi_j/dx_i"),
    vector("rotation", "rad", "Mean rotation of the particles"),
    scalar("residual", "m", "Root mean square of the non-affine displacement"),
    PARTICLES,
];

pub(super) const DEFINITION: OperatorDefinition = OperatorDefinition {
    name: "affine-strain",
    meaning: "Best affine fit of displacement and rotation since the start: gradient, Cosserat strain, curvature.",
    quantities: QUANTITIES,
    region: RegionRule::Any,
    needs: &[Need::InitialPositions],
    evaluate: |sampling, row| evaluate(sampling, MotionKind::Displacement, row),
    ..OperatorDefinition::PLAIN
};

pub(super) fn evaluate(sampling: &Sampling<'_>, kind: MotionKind, row: &mut Row) -> Result<(), OperatorError> {
    let fit = fit(sampling, kind)?;
    row.tensor(&fit.gradient).tensor(&fit.cosserat_strain()).tensor(&fit.curvature).vector(&fit.rotation);
    row.scalars([(fit.residual[0] / fit.particles as f64).sqrt(), fit.particles as f64]);
    Ok(())
}

/// Fits an affine motion to the particles in the region.
pub(super) fn fit(sampling: &Sampling<'_>, kind: MotionKind) -> Result<AffineFit, OperatorError> {
    let m = sampling.state.motion(kind);
    let dimension = sampling.state.dimension();
    affine_fit(&m.position, &m.displacement, &m.rotation, sampling.region, m.period.as_ref(), dimension)
}
