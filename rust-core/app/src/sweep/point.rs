//! Quantities of a point of a sweep.

use std::borrow::Cow;

use super::Sweep;
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

/// A quantity of a point.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Quantity {
    /// Name.
    pub name: Cow<'static, str>,
    /// SI unit; "1" for a pure number.
    pub unit: Cow<'static, str>,
    /// Description.
    pub description: Cow<'static, str>,
}

macro_rules! quantities {
    ($list:ident: $($name:literal $unit:literal $description:literal,)*) => {
        const $list: &[Quantity] =
            &[$(Quantity {
                name: Cow::Borrowed($name), unit: Cow::Borrowed($unit), description: Cow::Borrowed($description),
            }),*];
    };
}

quantities! {
    QUANTITIES:
    "particles" "1" "Particles",
    "links" "1" "Bonds",
    "coordination" "1" "Bonds per particle",
    "packing_fraction" "1" "Solid fraction of the cell",
    "rattlers" "1" "Particles that carry no force; they are excluded",
    "mechanisms" "1" "Motions of single particles that strain no bond",
    "stiffness_sum" "Pa" "Sum of k_N L^2 over d V, d the dimension",
    "shear_ratio" "1" "Sum of k_T L^2 over sum of k_N L^2",
    "spectral_radius" "1" "Spectral radius of the iteration between strains and forces of deformable particles",
    "closed_young" "Pa" "Young's modulus, closed form",
    "closed_poisson" "1" "Poisson's ratio, closed form",
    "affine_young" "Pa" "Young's modulus, affine sum",
    "affine_poisson" "1" "Poisson's ratio, affine sum",
    "young" "Pa" "Young's modulus, static network",
    "poisson" "1" "Poisson's ratio, static network",
    "bulk" "Pa" "Bulk modulus, static network",
    "shear" "Pa" "Shear modulus, static network",
    "anisotropy_young" "1" "Largest deviation of a Young's modulus from the mean, divided by the mean",
    "anisotropy_poisson" "1" "Largest deviation of a Poisson's ratio from the mean",
    "anisotropy_shear" "1" "Largest deviation of a shear modulus from E/2(1+nu), divided by that",
    "anisotropy_coupling" "1" "Largest stiffness that vanishes for isotropy, divided by E",
    "iterations" "1" "Iterations of the static solution",
    "dynamic_young" "Pa" "Young's modulus, relaxed dynamics",
    "dynamic_poisson" "1" "Poisson's ratio, relaxed dynamics",
    "dynamic_steps" "1" "Steps of the longest relaxation",
}

quantities! {
    STRUCTURE:
    "spheres" "1" "Spheres",
    "spheres_inside" "1" "Spheres that do not belong to the boundary",
    "links_per_sphere" "1" "Links per sphere inside",
    "links_at_boundary" "1" "Links per sphere at the boundary",
    "contacts_filled" "1" "Contacts per sphere inside before the walls soften",
    "overlap_filled" "1" "Mean overlap over mean radius before the walls soften",
    "overlap" "1" "Mean overlap over sum of radii",
    "hull_fraction" "1" "Solid fraction of the convex hull",
    "shape_fraction" "1" "Solid fraction of the shape",
    "effective_fraction" "1" "Solid fraction of the power cells inside",
    "mean_radius" "m" "Mean radius",
    "dispersion" "1" "Largest less smallest radius over mean radius",
    "isotropy" "1" "Deviation from isotropy e, frequencies as fractions",
    "isotropy_percent" "1" "The same, frequencies in percent",
    "isotropy_floor_percent" "1" "The same for isotropy, because the faces of the geode differ",
    "isotropy_noise_percent" "1" "The same for as many independent isotropic links, less the floor",
}

/// Name of the stiffness matrix in files; it has 36 numbers per point.
pub const STIFFNESS: &str = "stiffness";

/// Numbers of a point; runs have at most as many results.
pub(crate) const MOST_RESULTS: usize = QUANTITIES.len() + 36;

/// Names of all numbers of a point: the quantities, then, of an elastic sweep, the 36 entries of the static stiffness, row by row.
pub fn columns(sweep: &Sweep) -> Vec<String> {
    let quantities = sweep.quantities();
    let names = quantities.iter().map(|quantity| quantity.name.to_string());
    if sweep.study != Study::Elastic {
        return names.collect();
    }
    names.chain((0..36).map(|k| format!("{STIFFNESS}_{}{}", k / 6 + 1, k % 6 + 1))).collect()
}

impl Sweep {
    /// Quantities with one number per point.
    pub fn quantities(&self) -> Vec<Quantity> {
        match self.study {
            Study::Elastic => QUANTITIES.to_vec(),
            Study::Structure => STRUCTURE.to_vec(),
            Study::Run => self.results.iter().map(RunResult::quantity).collect(),
        }
    }
}

/// Result of a point.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Values in the order of [`columns`]; NaN for missing numbers.
    pub values: Vec<f64>,
    /// Problem of a failed point.
    pub problem: Option<String>,
}

impl Default for Outcome {
    fn default() -> Self {
        Self { values: vec![f64::NAN; MOST_RESULTS], problem: None }
    }
}

impl Outcome {
    /// Outcome of a failed point.
    pub fn failed(problem: String) -> Self {
        Self { problem: Some(problem), ..Self::default() }
    }

    /// Value of a quantity; NaN if it is missing.
    pub fn get(&self, name: &str) -> f64 {
        place(name).map_or(f64::NAN, |k| self.values[k])
    }

    /// Sets the value of a quantity.
    pub(crate) fn set(&mut self, name: &str, value: f64) {
        if let Some(k) = place(name) {
            self.values[k] = value;
        }
    }
}

/// Place of a quantity. Those of both studies have different names and begin at the first number of a point.
fn place(name: &str) -> Option<usize> {
    let of = |list: &[Quantity]| list.iter().position(|quantity| quantity.name == name);
    of(QUANTITIES).or_else(|| of(STRUCTURE))
}

/// Elastic constants of a scenario on a given packing.
pub(crate) fn evaluate(scenario: &Scenario, placed: &Placed, accuracy: Accuracy, dynamics: bool) -> Outcome {
    let mut outcome = Outcome::default();
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
