//! What a sweep computes at a point, and its elastic constants.

use super::Sweep;
use super::outcome::{Outcome, QUANTITIES, Quantity, STIFFNESS, STRUCTURE};
use super::results::RunResult;
use concordem_scenario::assembly::{Placed, assemble_placed};
use concordem_scenario::schema::Scenario;
use concordem_statics::relaxed::{Relaxation, relaxed_stiffness};
use concordem_statics::{Accuracy, LinkNetwork, cell_stiffness, closed_form};

/// What a sweep computes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Study {
    /// Elastic constants of a bonded periodic packing.
    #[default]
    Elastic,
    /// Structure of a packing, as `concordem characterise`.
    Structure,
    /// Results of whole runs.
    Run,
}

/// Names of all numbers of a point: the quantities, then, of an elastic sweep, the 36 entries of the static stiffness, row by row.
pub fn columns(sweep: &Sweep) -> Vec<String> {
    let quantities = sweep.quantities();
    let names = quantities.iter().map(|quantity| quantity.name.to_string());
    if sweep.study != Study::Elastic {
        return names.collect();
    }
    names.chain((0..36).map(|k| format!("{STIFFNESS}_{}{}", k / 6 + 1, k % 6 + 1))).collect()
}

/// Numbers of a point of a study without curves and named results.
pub(crate) fn numbers_of(study: Study) -> usize {
    match study {
        Study::Elastic => QUANTITIES.len() + 36,
        Study::Structure => STRUCTURE.len(),
        Study::Run => 0,
    }
}

impl Sweep {
    /// Numbers of a point: results, and ordinates of all curves.
    pub fn numbers(&self) -> usize {
        let ordinates: usize = self.curves.iter().map(|curve| curve.abscissas.len()).sum();
        numbers_of(self.study) + self.results.len() + ordinates
    }

    /// Ordinates of curve `k` in the numbers of a point.
    pub fn ordinates<'a>(&self, k: usize, outcome: &'a Outcome) -> &'a [f64] {
        let count = |k: usize| self.curves.get(k).map_or(0, |curve| curve.abscissas.len());
        let start = numbers_of(self.study) + self.results.len() + (0..k).map(count).sum::<usize>();
        outcome.values.get(start..start + count(k)).unwrap_or_default()
    }

    /// Quantities with one number per point.
    pub fn quantities(&self) -> Vec<Quantity> {
        match self.study {
            Study::Elastic => QUANTITIES.to_vec(),
            Study::Structure => STRUCTURE.to_vec(),
            Study::Run => self.results.iter().map(RunResult::quantity).collect(),
        }
    }
}

/// Elastic constants of a scenario on a given packing.
pub(crate) fn evaluate(scenario: &Scenario, placed: &Placed, accuracy: Accuracy, dynamics: bool) -> Outcome {
    let mut outcome = Outcome::new(numbers_of(Study::Elastic));
    if let Err(problem) = fill(&mut outcome, scenario, placed, accuracy, dynamics) {
        outcome.problem = Some(problem);
    }
    outcome
}

fn fill(
    outcome: &mut Outcome,
    scenario: &Scenario,
    placed: &Placed,
    accuracy: Accuracy,
    dynamics: bool,
) -> Result<(), String> {
    let text = |error: &dyn std::error::Error| error.to_string();
    let assembly = assemble_placed(scenario, &scenario.directory(), placed, &mut |_, _| {}).map_err(|e| text(&e))?;
    let (state, model) = (&assembly.state, &assembly.model);
    let network = LinkNetwork::of_model(state, model).map_err(|e| text(&e))?;
    let (normal, shear) = network.moduli_sums();
    let dimension = if network.planar { 2.0 } else { 3.0 };
    outcome.set("particles", state.particles.len() as f64);
    outcome.set("links", network.links.len() as f64);
    outcome.set("coordination", assembly.summary.coordination);
    outcome.set("packing_fraction", assembly.summary.packing_fraction.unwrap_or(f64::NAN));
    outcome.set("stiffness_sum", normal / (dimension * network.volume.unwrap_or(f64::NAN)));
    outcome.set("shear_ratio", shear / normal);
    outcome.set("spectral_radius", assembly.summary.convergence.map_or(f64::NAN, |c| c.spectral_radius));
    if let Some(closed) = closed_form(&network) {
        outcome.set("closed_young", closed.young);
        outcome.set("closed_poisson", closed.poisson);
    }
    let cell = cell_stiffness(&network, accuracy).map_err(|e| text(&e))?;
    outcome.set("rattlers", cell.loose.rattlers as f64);
    outcome.set("mechanisms", cell.loose.mechanisms as f64);
    outcome.set("iterations", cell.iterations as f64);
    for (k, value) in outcome.values[QUANTITIES.len()..].iter_mut().enumerate() {
        *value = cell.relaxed[(k / 6, k % 6)];
    }
    let affine = cell.affine_constants().map_err(|e| text(&e))?;
    outcome.set("affine_young", affine.mean_young);
    outcome.set("affine_poisson", affine.mean_poisson);
    let constants = cell.constants().map_err(|e| text(&e))?;
    outcome.set("young", constants.mean_young);
    outcome.set("poisson", constants.mean_poisson);
    outcome.set("bulk", constants.bulk);
    outcome.set("shear", constants.mean_shear);
    let anisotropy = constants.anisotropy();
    outcome.set("anisotropy_young", anisotropy.young);
    outcome.set("anisotropy_poisson", anisotropy.poisson);
    outcome.set("anisotropy_shear", anisotropy.shear);
    outcome.set("anisotropy_coupling", anisotropy.coupling);
    if dynamics {
        let (stiffness, steps) = relaxed_stiffness(state, model, Relaxation::default()).map_err(|e| text(&e))?;
        let constants = cell.constants_of(&stiffness).map_err(|e| text(&e))?;
        outcome.set("dynamic_young", constants.mean_young);
        outcome.set("dynamic_poisson", constants.mean_poisson);
        outcome.set("dynamic_steps", steps as f64);
    }
    Ok(())
}
