//! The surface of the body of a scenario, as half-spaces.

use super::heat::planes;
use crate::schema::{HeatNetwork, Scenario};
use concordem_operator::HalfSpace;
use concordem_solver::state::Particles;

/// Half-spaces whose intersection is the body: the box or cylinder of the packing (as a prism of 32 sides, 0.3 % larger), else the box
/// around the spheres. Their normals point outward.
pub fn half_spaces(scenario: &Scenario, particles: &Particles) -> Vec<HalfSpace> {
    planes(scenario, HeatNetwork::Power, particles).into_iter().map(|plane| plane.inside).collect()
}
