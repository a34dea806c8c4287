//! Stress and couple stress of the whole body from its external loads: `(1/V) Σ x_i f_j` over walls, supports, and given
//! forces.
//!
//! Page: [Stress](stress.md#boundary), [couple stress](couple-stress.md#body)

use crate::sampling::definition::{
    OperatorDefinition, RegionRule, Row, SampledQuantity, Sampling, scalar, tensor, vector,
};
use concordem_contact::math::Vec3;
use concordem_operator::stress::boundary_stress;
use concordem_operator::{OperatorError, couple_stress};

const QUANTITIES: &[SampledQuantity] = &[
    tensor(
        "stress",
        "Pa",
        "Sum of x f/V over the forces f of walls, supports, and [[force]] at positions x from the center of mass",
    ),
    tensor("couple_stress", "N/m", "Couple stress of these forces about the mean position of all particles"),
    vector("force", "N", "Sum of these forces, balanced by weight and inertia"),
    scalar("loads", "1", "Contacts with walls, particles with a given load, and particles whose motion is prescribed"),
];

pub(super) const DEFINITION: OperatorDefinition = OperatorDefinition {
    name: "boundary-stress",
    meaning: "Stress and couple stress of the whole body from the forces of walls and supports.",
    quantities: QUANTITIES,
    region: RegionRule::WholeBody,
    evaluate,
    ..OperatorDefinition::PLAIN
};

fn evaluate(sampling: &Sampling<'_>, row: &mut Row) -> Result<(), OperatorError> {
    let state = sampling.state;
    let loads = state.external_loads(&sampling.contacts);
    let set = loads.set(state.particles.len())?;
    let volume = sampling.region.volume()?;
    let couple = couple_stress::external(&state.particles.position, &set, volume, &state.mean_position())?;
    let force: Vec3 = loads.force.iter().sum();
    // Relative to the center of mass, weight adds nothing.
    let stress = boundary_stress(&set, volume)? + (loads.surface - state.center_of_mass() * force.transpose()) / volume;
    row.tensor(&stress).tensor(&couple).vector(&force).scalars([set.len() as f64]);
    Ok(())
}
