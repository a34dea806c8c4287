//! Choice of the time step, with the stability bounds of the assembled system.

use super::{AssemblyError, unfit};
use crate::schema::{Material, Scenario, TimeStep};
use concordem_contact::kinematics::deformable::{Deformable, Update};
use concordem_solver::coupling::Convergence;
use concordem_solver::state::{Particles, State};
use concordem_solver::time_step::{self, TimeStepBounds};
use concordem_solver::{Model, Solver};

/// The time step and what it follows from.
pub(super) struct Step {
    /// Time step, s.
    pub(super) dt: f64,
    /// Stability bounds.
    pub(super) bounds: TimeStepBounds,
    /// Convergence between strains and forces of deformable particles.
    pub(super) convergence: Option<Convergence>,
    /// Whether the time step exceeds the bound.
    pub(super) unstable: bool,
    /// Estimated memory of state and solver, bytes.
    pub(super) memory: usize,
}

/// The time step of a scenario.
///
/// # Errors
/// The given time step is unstable, no contact gives a bound, or deformable particles do not converge.
pub(super) fn choose(scenario: &Scenario, model: &Model, state: &State) -> Result<Step, AssemblyError> {
    let integration = &scenario.integration;
    // The solver finds candidate pairs; near pairs count as if they touched.
    let mut probe = state.clone();
    Solver::new(model.clone(), &mut probe).map_err(|error| unfit("packing", error.to_string()))?;
    let (bounds, convergence) = time_step::bounds_with(&probe, model.deformable.as_ref());
    if let (Some(deformable), Some(convergence)) = (&model.deformable, convergence) {
        settles(deformable, &convergence, integration.allow_unstable)?;
    }
    let limit = bounds.spectral.max(bounds.per_particle) * model.damping.stability();
    let (dt, unstable) = match integration.time_step {
        TimeStep::Auto if limit.is_finite() => (limit * integration.safety.si(), false),
        TimeStep::Auto => return Err(AssemblyError::NoTimeStep),
        TimeStep::Given(step) => (step.si(), step.si() > limit),
    };
    if unstable && !integration.allow_unstable {
        return Err(AssemblyError::Unstable { given: dt, bound: limit, frequency: bounds.frequency });
    }
    Ok(Step { dt, bounds, convergence, unstable, memory: memory(&probe) })
}

/// Refuses deformable particles whose strains would not converge, unless `allow` is set.
///
/// # Errors
/// The iteration between strains and forces diverges.
pub fn settles(deformable: &Deformable, convergence: &Convergence, allow: bool) -> Result<(), AssemblyError> {
    let radius = convergence.spectral_radius;
    let relaxation = match deformable.update {
        Update::Lagged => 1.0,
        Update::Iterated { relaxation, .. } => relaxation,
    };
    if allow || relaxation * (1.0 + radius) < 2.0 {
        return Ok(());
    }
    let softest = deformable.elasticity.iter().map(|e| e.young).fold(f64::INFINITY, f64::min);
    Err(AssemblyError::NotConvergent {
        spectral_radius: radius,
        lagged: deformable.update == Update::Lagged,
        relaxation: 2.0 / (1.0 + radius),
        young: softest * radius / (2.0 / relaxation - 1.0).max(f64::MIN_POSITIVE),
    })
}

/// `min r √(ρ/E)`, s, with the stiffest modulus of all materials.
pub(super) fn p_wave(scenario: &Scenario, particles: &Particles) -> Option<f64> {
    let tables = scenario.materials.iter().flat_map(Material::tables);
    let stiffest = tables.filter_map(|(_, table)| table.modulus()).reduce(f64::max)?;
    Some(time_step::p_wave(particles, stiffest))
}

/// Estimated memory of a state and its solver, bytes.
fn memory(state: &State) -> usize {
    // Deformable particles add strains and virials: 192 bytes of state, 264 of scratch.
    let each = if state.particles.deformation.is_empty() { 272 } else { 272 + 456 };
    let particles = state.particles.len() * each;
    let contacts: usize = state
        .bonds
        .iter()
        .chain(&state.contacts)
        .chain(&state.wall_contacts)
        // About half a halo slot and its index per contact.
        .map(|block| block.len() * (block.bytes_per_contact() + 26))
        .sum();
    particles + contacts
}
