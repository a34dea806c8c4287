//! Damage tensors of the bonds whose midpoints lie in a region, or of the bonds of a list of particles.
//!
//! Page: [Damage](damage.md)

use crate::sampling::definition::{
    CONTACTS, Need, OperatorDefinition, RegionRule, Row, SampledQuantity, Sampling, scalar, tensor,
};
use crate::sampling::state::Bonds;
use concordem_contact::math::{Mat3, Vec3};
use concordem_operator::{OperatorError, Period, Region, damage};

const QUANTITIES: &[SampledQuantity] = &[
    tensor("damage", "1", "Damage tensor by least squares for uniformly distributed directions"),
    tensor("damage_exact", "1", "Damage tensor by least squares for the actual directions; NaN if they are too few"),
    tensor("strength_damage", "1", "Damage tensor of the lost strength of the bonds"),
    scalar("mean_damage", "1", "Mean damage of the bonds"),
    scalar("mean_strength_damage", "1", "Mean lost strength of the bonds"),
    CONTACTS,
];

pub(super) const DEFINITION: OperatorDefinition = OperatorDefinition {
    name: "damage-tensor",
    meaning: "Damage tensors of the bonds: of their damage and of their lost strength; broken bonds count as 1.",
    quantities: QUANTITIES,
    region: RegionRule::Any,
    needs: &[Need::Bonds],
    evaluate,
    ..OperatorDefinition::PLAIN
};

fn evaluate(sampling: &Sampling<'_>, row: &mut Row) -> Result<(), OperatorError> {
    let (region, bonds) = (sampling.region, sampling.state.bonds);
    let (inside, weight) = inside(region, bonds, sampling.period());
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
    row.scalars([damages.iter().sum::<f64>() / count, lost.iter().sum::<f64>() / count, weight * count]);
    Ok(())
}

/// Bonds of a region, and the weight of each entry.
///
/// A bond belongs to a region with a shape if its midpoint lies inside; all periodic images are counted. For a list of
/// particles an entry is half a bond, as for contacts: a bond that leaves the list has one entry, a bond within it two.
fn inside(region: &Region, bonds: &Bonds, period: Option<&Period>) -> (Vec<usize>, f64) {
    let all = 0..bonds.midpoint.len();
    if let Region::Particles { member, .. } = region {
        let of = |k: usize| bonds.pair[k].map(|p| member.get(p as usize).copied().unwrap_or(false));
        return (all.flat_map(|k| of(k).into_iter().filter(|is_member| *is_member).map(move |_| k)).collect(), 0.5);
    }
    let images = region.images(period);
    (all.flat_map(|k| images.inside(0, &bonds.midpoint[k]).map(move |_| k)).collect(), 1.0)
}
