//! Mean heat flux of a region, `q = (1/V) Σ W l` over the links with the heat `W` that flows along their branch vectors `l`.
//!
//! It is the branch sum of the stress with heat in place of force. For the whole body it includes the surface: the way from a center to
//! the face. Divided by minus the gradient of the temperature it is the effective conductivity (Fourier).
//!
//! Page: [Heat](heat.md#flux)

use crate::sampling::definition::{
    Need, OperatorDefinition, RegionRule, Row, SampleKey, SampledQuantity, Sampling, VOLUME, scalar, vector,
};
use concordem_contact::math::Vec3;
use concordem_operator::stress::region_stress;
use concordem_operator::{ContactSet, OperatorError};

const QUANTITIES: &[SampledQuantity] = &[
    vector("flux", "W/m^2", "Mean heat flux, in the direction in which heat flows"),
    VOLUME,
    scalar("links", "1", "Number of links included"),
];

pub(super) const DEFINITION: OperatorDefinition = OperatorDefinition {
    name: "heat-flux",
    meaning: "Mean heat flux from the sum over the links along which heat flows, surface included; needs `[heat]`.",
    quantities: QUANTITIES,
    region: RegionRule::Any,
    keys: &[SampleKey::Truncation],
    needs: &[Need::HeatFlows],
    evaluate,
    ..OperatorDefinition::PLAIN
};

fn evaluate(sampling: &Sampling<'_>, row: &mut Row) -> Result<(), OperatorError> {
    let heat = sampling.state.heat.ok_or(OperatorError::EmptyRegion { what: "particle with a temperature" })?;
    let (position, flows) = (&sampling.state.particles.position, heat.flows);
    let flow: Vec<Vec3> = flows.flow.iter().map(|flow| Vec3::new(*flow, 0.0, 0.0)).collect();
    let point: Vec<Vec3> = flows.pair.iter().map(|pair| position[pair[0] as usize]).collect();
    let links = ContactSet::new(position, &flows.pair, &flows.branch, &point, &flow, None)?;
    let mean = region_stress(&links, sampling.region, sampling.sample.truncation, sampling.period())?;
    row.vector(&mean.stress.column(0).into_owned()).scalars([mean.volume, mean.full + mean.partial]);
    Ok(())
}
