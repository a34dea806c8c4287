//! Damage tensors of the bonds whose midpoints lie in a region.

use crate::sampling::definition::{
    CONTACTS, OperatorDefinition, RegionRule, Row, SampledQuantity, Sampling, scalar, tensor,
};
use concordem_contact::math::{Mat3, Vec3};
use concordem_operator::{OperatorError, Region, damage};

const QUANTITIES: &[SampledQuantity] = &[
    tensor("damage", "1", "Damage tensor by least squares for uniformly distributed directions"),
    tensor("damage_exact", "1", "Damage tensor by least squares for the actual directions; NaN if they are too few"),
    tensor("strength_damage", "1", "Damage tensor of the lost strength of the bonds"),
    scalar("mean_damage", "1", "Mean damage of the bonds"),
    scalar("mean_strength_damage", "1", "Mean lost strength of the bonds"),
    CONTACTS,
];

pub(super) const DEFINITION: OperatorDefinition = OperatorDefinition {
    quantities: QUANTITIES,
    region: RegionRule::Shape,
    keys: &[],
    needs_initial_positions: false,
    needs_bonds: true,
    evaluate,
};

fn evaluate(sampling: &Sampling<'_>, row: &mut Row) -> Result<(), OperatorError> {
    let (region, bonds) = (sampling.region, sampling.state.bonds);
    // The midpoint of a bond cannot lie in a list of particles.
    if matches!(region, Region::Particles { .. }) {
        return Err(OperatorError::NoSurface);
    }
    let inside: Vec<usize> = (0..bonds.midpoint.len()).filter(|&k| region.contains(0, &bonds.midpoint[k])).collect();
    let normal: Vec<Vec3> = inside.iter().map(|&k| bonds.normal[k]).collect();
    let [damages, lost] =
        [&bonds.damage, &bonds.lost_strength].map(|all| inside.iter().map(|&k| all[k]).collect::<Vec<f64>>());
    let exact = match damage::damage_tensor_exact(&normal, &damages) {
        Err(OperatorError::Singular { .. }) => Mat3::repeat(f64::NAN),
        other => other?,
    };
    let count = inside.len() as f64;
    row.tensor(&damage::damage_tensor(&normal, &damages)?).tensor(&exact);
    row.tensor(&damage::damage_tensor(&normal, &lost)?);
    row.scalars([damages.iter().sum::<f64>() / count, lost.iter().sum::<f64>() / count, count]);
    Ok(())
}
