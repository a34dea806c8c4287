//! Extensometer between two sets of particles: with the mean positions `x_1`, `x_2` of the sets, the length is `l = |x_2 − x_1|`,
//! the strain `(l − l_0)/l_0`, and the opening the change of `x_2 − x_1`.
//!
//! Two sets on both sides of a notch give the crack mouth opening displacement.
//!
//! Page: [Laboratory tests](../how-to/laboratory-tests.md)

use crate::sampling::definition::{
    Need, OperatorDefinition, RegionRule, Row, SampleKey, SampledQuantity, Sampling, scalar, vector,
};
use crate::sampling::state::SampledState;
use concordem_operator::OperatorError;

const QUANTITIES: &[SampledQuantity] = &[
    scalar("length", "m", "Distance between the mean positions of the two sets"),
    scalar("elongation", "m", "Length minus its value at the start"),
    scalar("strain", "1", "Elongation divided by the length at the start"),
    vector("opening", "m", "Mean displacement of the second set minus that of the first"),
];

pub(super) const DEFINITION: OperatorDefinition = OperatorDefinition {
    name: "gauge",
    meaning: "Length, elongation, strain, and opening between two sets of particles.",
    quantities: QUANTITIES,
    region: RegionRule::TwoSets,
    keys: &[SampleKey::Sets],
    needs: &[Need::InitialPositions],
    evaluate,
    ..OperatorDefinition::PLAIN
};

fn evaluate(sampling: &Sampling<'_>, row: &mut Row) -> Result<(), OperatorError> {
    let state = sampling.state;
    let [first, second] = &sampling.sample.sets[..] else {
        return Err(OperatorError::EmptyRegion { what: "pair of sets" });
    };
    let initial = |set: &[u32]| SampledState::mean_over(set, |p| state.initial_positions[p as usize]);
    let start = initial(second) - initial(first);
    let opening = state.mean_displacement(second) - state.mean_displacement(first);
    // Not the difference of two lengths, which would lose the digits of small strains.
    let length = (start + opening).norm();
    let elongation = opening.dot(&(start * 2.0 + opening)) / (length + start.norm());
    row.scalars([length, elongation, elongation / start.norm()]).vector(&opening);
    Ok(())
}
