//! Strengths of bonds that differ: by chance, by the place of their particles at the start, and as the scenario gives them.

use concordem_contact::field::StrengthField;
use concordem_solver::Strengths;
use concordem_solver::state::State;
use rayon::prelude::*;

use super::{AssemblyError, Cuts, Placed, unfit};
use crate::checks::length;
use crate::schema::{Material, Problem, Scenario};

/// A correlation length over the mean diameter below which bonds, which have the mean of their two particles, vary clearly less than the field:
/// at 3, their deviation is 3 % smaller.
const FINEST: f64 = 3.0;
/// A correlation length over the thickness of a periodic cell above which few waves fit into it.
const COARSEST: f64 = 1.0 / 3.0;

/// The factors on the strengths of bonds of a state at the start.
pub(super) fn build(
    scenario: &Scenario,
    placed: &Placed,
    cuts: &Cuts,
    state: &State,
) -> Result<Strengths, AssemblyError> {
    let particles = &state.particles;
    let mut by_particle = given(scenario, placed, cuts, particles.len())?;
    let cell = state.cell.as_ref().map(|cell| &cell.matrix);
    let field = |material: &Material| StrengthField::of(material.strength_scatter.as_ref()?, cell);
    let fields: Vec<Option<StrengthField>> = scenario.materials.iter().map(field).collect();
    if fields.iter().any(Option::is_some) {
        let of = |p: usize| {
            let field = fields[particles.material[p] as usize].as_ref();
            field.map_or(1.0, |field| field.factor(&particles.position[p]))
        };
        let factors: Vec<f64> = (0..particles.len()).into_par_iter().map(of).collect();
        by_particle.resize(particles.len(), 1.0);
        for (id, factor) in particles.id.iter().zip(factors) {
            by_particle[*id as usize] *= factor;
        }
    }
    Ok(Strengths { by_bond: Material::scatter_of_strengths(&scenario.materials), by_particle })
}

/// Given factors by the ids of the particles, which number what remains of the packing, then what is added to it; empty without them.
fn given(scenario: &Scenario, placed: &Placed, cuts: &Cuts, count: usize) -> Result<Vec<f64>, AssemblyError> {
    let factors = scenario.bonds.as_ref().map_or(&[][..], |bonds| &bonds.strength_factors);
    let spheres = &placed.packing.spheres;
    if factors.is_empty() {
        return Ok(Vec::new());
    }
    if factors.len() != spheres.len() {
        let message =
            format!("{} factors for {} spheres; give one per sphere of the packing", factors.len(), spheres.len());
        return Err(unfit("bonds.strength_factors", message));
    }
    let remains = |sphere| !cuts.remaining(scenario, std::slice::from_ref(sphere)).is_empty();
    let rows = spheres.iter().zip(factors).filter(|(sphere, _)| remains(*sphere));
    let mut factors: Vec<f64> = rows.map(|(_, factor)| factor.si()).collect();
    factors.resize(count, 1.0);
    Ok(factors)
}

/// Warns about fields that are too fine for the particles, or too coarse for the periodic cell.
pub(super) fn doubtful(scenario: &Scenario, state: &State) -> Vec<Problem> {
    let diameter = 2.0 * state.particles.mean_radius();
    // Distances between opposite faces.
    let inverse = state.cell.as_ref().and_then(|cell| cell.matrix.try_inverse());
    let thinnest = inverse.map(|inverse| 1.0 / inverse.row_iter().map(|row| row.norm()).fold(0.0, f64::max));
    let of = |(at, material): (usize, &Material)| {
        let ell = material.strength_scatter.as_ref()?.correlation_length?.si();
        let path = format!("material[{at}].strength_scatter.correlation_length");
        if ell < FINEST * diameter {
            let message = format!("the mean diameter is {}; bonds average over their two particles", length(diameter));
            let help = format!(
                "at least {}, or remove the key: each bond then has a factor of its own",
                length(FINEST * diameter)
            );
            return Some(scenario.warning(&path, message, help));
        }
        let most = COARSEST * thinnest?;
        (ell > most).then(|| {
            let message = format!("the periodic cell is {} thick: few waves fit into it", length(most / COARSEST));
            scenario.warning(&path, message, format!("at most {}", length(most)))
        })
    };
    scenario.materials.iter().enumerate().filter_map(of).collect()
}
