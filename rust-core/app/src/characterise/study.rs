//! The structure of a packing as a point of a sweep.

use super::{Body, CharacteriseError, Choice, characterise};
use crate::sweep::outcome::Outcome;
use crate::sweep::point::{Study, numbers_of};
use concordem_packing::cooker::BOUNDARY_DEPTH;
use concordem_scenario::assembly::Placed;
use concordem_scenario::schema::Scenario;

/// Structure of the packing of a scenario.
pub(crate) fn structure(scenario: &Scenario, placed: &Placed) -> Outcome {
    let mut outcome = Outcome::new(numbers_of(Study::Structure));
    if let Err(problem) = fill(&mut outcome, scenario, placed) {
        outcome.problem = Some(problem.to_string());
    }
    outcome
}

fn fill(outcome: &mut Outcome, scenario: &Scenario, placed: &Placed) -> Result<(), CharacteriseError> {
    let body = Body::of_placed(String::new(), scenario, placed, &Choice::default())?;
    let found = characterise(&body, BOUNDARY_DEPTH)?;
    let coordination = &found.network.coordination;
    let density = &found.density;
    outcome.set("spheres", found.spheres as f64);
    outcome.set("spheres_inside", coordination.particles_inside as f64);
    outcome.set("links_per_sphere", coordination.inside);
    outcome.set("links_at_boundary", coordination.at_boundary);
    if let Some(cooked) = placed.walled.as_ref().and_then(|walled| walled.cooked) {
        outcome.set("contacts_filled", cooked.filled.coordination);
        outcome.set("overlap_filled", cooked.filled.overlap);
    }
    outcome.set("overlap", found.network.overlap[0]);
    outcome.set("hull_fraction", density.hull.map_or(f64::NAN, |v| v[1]));
    outcome.set("shape_fraction", density.shape.or(density.cell).map_or(f64::NAN, |v| v[1]));
    outcome.set("effective_fraction", density.effective.unwrap_or(f64::NAN));
    outcome.set("mean_radius", found.sizes.mean);
    outcome.set("dispersion", found.sizes.dispersion);
    let directions = &found.network.orientations;
    outcome.set("isotropy", directions.deviation());
    outcome.set("isotropy_percent", directions.deviation_percent());
    outcome.set("isotropy_floor_percent", 1e4 * directions.floor);
    outcome.set("isotropy_noise_percent", 1e4 * directions.noise());
    Ok(())
}
