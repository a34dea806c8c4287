//! Chooses the time step from the stability bounds of the assembled system.

use super::{AssemblyError, heat, memory, unfit};
use crate::schema::{Material, Quantity, Scenario, TimeStep};
use concordem_contact::kinematics::deformable::{Deformable, Update};
use concordem_solver::collision::{self, Collision};
use concordem_solver::coupling::Convergence;
use concordem_solver::integrate::Damping;
use concordem_solver::state::{Particles, State};
use concordem_solver::time_step::{self, TimeStepBounds};
use concordem_solver::{Model, Solver};

/// Default of `integration.contact_safety` without bonds: a linear elastic impact takes 16 steps, and because it begins and
/// ends within a step, its energy changes by at most 0.9 % (2.6 % at 0.2).
const CONTACT_SAFETY: f64 = 0.1;

/// The same with bonds: stable also for contacts of bonded particles. The energy guard watches the few impacts.
const CONTACT_SAFETY_WITH_BONDS: f64 = 0.5;

/// Fraction of the stability bound that is used with local damping: close to the bound, vibrations decay slowly.
const LOCAL_DAMPING_MARGIN: f64 = 0.95;

/// How sharp the stability bounds must be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sharpness {
    /// The bound from the largest frequency, for reports and for states that the time step may not fit.
    Sharp,
    /// A given time step below the bound per particle needs no other bound: saves some 200 passes over all bonds.
    Sufficient,
}

/// The time step, with the bounds that it follows from.
pub(super) struct Step {
    /// Time step, s.
    pub(super) dt: f64,
    /// Stability bounds.
    pub(super) bounds: TimeStepBounds,
    /// The stiffest contact that may form.
    pub(super) collision: Option<Collision>,
    /// Largest stable time step, s.
    pub(super) limit: f64,
    /// [`time_step::stiffness_sum`], J.
    pub(super) stiffness_sum: f64,
    /// Convergence of the iteration between strains and forces of deformable particles.
    pub(super) convergence: Option<Convergence>,
    /// Largest explicit step of heat conduction, s.
    pub(super) heat: Option<f64>,
    /// Whether the time step exceeds the bound.
    pub(super) unstable: bool,
    /// Estimated peak memory of a run, bytes.
    pub(super) memory: usize,
}

/// Chooses the time step of a scenario. `look` sees the state with its candidate pairs as contacts, and their stiffness sum, J.
///
/// # Errors
/// The given time step is unstable, no contact gives a bound, or deformable particles do not converge.
pub(super) fn choose(
    scenario: &Scenario,
    model: &Model,
    state: &mut State,
    sharpness: Sharpness,
    look: &mut dyn FnMut(&State, f64),
) -> Result<Step, AssemblyError> {
    let integration = &scenario.integration;
    memory::check_run(state)?;
    let suffices = |bounds: &TimeStepBounds| match integration.time_step {
        TimeStep::Given(step) if sharpness == Sharpness::Sufficient => step.si() <= bounds.limit(&model.damping),
        _ => false,
    };
    let Measured { bounds, convergence, collision, stiffness_sum, memory } = measure(model, state, suffices, look)?;
    if let (Some(deformable), Some(convergence)) = (&model.deformable, convergence) {
        settles(deformable, &convergence, integration.allow_unstable)?;
    }
    let limit = |damping: &Damping| {
        let contact = collision.map_or(f64::INFINITY, |collision| collision.limit(damping));
        (bounds.limit(damping), contact)
    };
    let (assembled, contact) = limit(&model.damping);
    let stable = assembled.min(contact);
    let heat = heat::bound(model.heat.as_ref(), state);
    let rests = model.heat.as_ref().is_some_and(|heat| !heat.mechanics);
    let stable = if rests { f64::INFINITY } else { stable };
    let safety = integration.safety.si();
    let (dt, unstable) = match integration.time_step {
        TimeStep::Auto if rests && heat.is_finite() => (safety * heat, false),
        TimeStep::Auto if stable.is_finite() => (automatic(scenario, model, limit).min(safety * heat), false),
        TimeStep::Auto => return Err(AssemblyError::NoTimeStep),
        TimeStep::Given(step) => (step.si(), step.si() > stable),
    };
    if !dt.is_normal() {
        let message = format!(
            "the time step is {dt:e} s, which no run can use: check stiffnesses, densities, and radii, or give a time step"
        );
        return Err(unfit("integration.time_step", message));
    }
    if unstable && !integration.allow_unstable {
        if let Some(collision) = collision.filter(|_| contact < assembled) {
            let [a, b] = collision.materials.map(|m| scenario.materials[m as usize].name.clone());
            let wall = collision.wall.map(|wall| state.walls[wall].name.clone());
            let Collision { speed, overlap, .. } = collision;
            return Err(AssemblyError::UnstableContact { given: dt, bound: contact, a, b, wall, speed, overlap });
        }
        return Err(AssemblyError::Unstable { given: dt, bound: stable, frequency: bounds.frequency });
    }
    if dt > heat && !integration.allow_unstable {
        let factor = model.heat.as_ref().map_or(1.0, |heat| heat.time_factor);
        return Err(AssemblyError::UnstableHeat { given: dt, bound: heat, thermal: heat * factor });
    }
    Ok(Step {
        dt,
        bounds,
        stiffness_sum,
        collision,
        limit: stable,
        convergence,
        heat: model.heat.is_some().then_some(heat),
        unstable: unstable || dt > heat,
        memory,
    })
}

/// What the assembled system, with its candidate pairs as contacts, tells about the step.
struct Measured {
    bounds: TimeStepBounds,
    convergence: Option<Convergence>,
    collision: Option<Collision>,
    stiffness_sum: f64,
    memory: usize,
}

/// Finds the candidate pairs, and measures. The state stays as it is.
fn measure(
    model: &Model,
    state: &mut State,
    suffices: impl Fn(&TimeStepBounds) -> bool,
    look: &mut dyn FnMut(&State, f64),
) -> Result<Measured, AssemblyError> {
    // A solver adds candidate pairs, which are easily removed again. It changes more in periodic cells, with heat, and with deformable
    // particles: there it works on a copy.
    let mut copy = None;
    let changes = state.cell.is_some() || model.heat.is_some() || model.deformable.is_some();
    let state = if changes { copy.insert(state.clone()) } else { state };
    Solver::new(model.clone(), state).map_err(|error| unfit("packing", error.to_string()))?;
    let (bounds, convergence) = time_step::bounds_unless(state, model.deformable.as_ref(), suffices);
    let measured = Measured {
        bounds,
        convergence,
        collision: collision::stiffest(state, model),
        stiffness_sum: time_step::stiffness_sum(state),
        memory: memory::peak(state),
    };
    look(state, measured.stiffness_sum);
    for block in state.contacts.iter_mut().chain(&mut state.wall_contacts) {
        block.contacts_mut().retain_where(&|_| false);
    }
    Ok(measured)
}

/// The time step "auto", s; `limit`: bounds of the assembled system and of the stiffest contact that may form.
fn automatic(scenario: &Scenario, model: &Model, limit: impl Fn(&Damping) -> (f64, f64)) -> f64 {
    let safety = scenario.integration.safety.si();
    let default = if scenario.bonds.as_ref().is_some_and(|bonds| bonds.at_start) {
        CONTACT_SAFETY_WITH_BONDS
    } else {
        CONTACT_SAFETY
    };
    let contact_safety = scenario.integration.contact_safety.map_or(default, Quantity::si);
    let damped = limit(&model.damping);
    // Local damping lowers the bound but hardly changes the frequencies: use the step of the undamped system if it is
    // stable.
    let (assembled, contact) = match model.damping {
        Damping::Local { .. } | Damping::NonViscous { .. } => limit(&Damping::None),
        Damping::None | Damping::TchamwaWielgosz { .. } => damped,
    };
    let wanted = (assembled * safety).min(contact * contact_safety);
    if damped.0 < assembled { wanted.min(LOCAL_DAMPING_MARGIN * damped.0.min(damped.1)) } else { wanted }
}

/// Refuses deformable particles whose strains do not converge, unless `allow` is set.
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

#[cfg(test)]
mod tests {
    use super::*;
    use concordem_contact::elastic::Elastic;
    use concordem_contact::kinematics::deformable::Condition;

    /// With the relaxation `w` the change of the strains is multiplied by `1 − w(1+ρ)` in each iteration: it decays below
    /// `w(1+ρ) = 2`, and with the modulus that the message gives, which divides ρ, it just does.
    #[test]
    fn strains_must_settle() {
        let refusal = |update: Update, spectral_radius: f64| {
            let elasticity = vec![Elastic { young: 3e9, poisson: 0.3 }, Elastic::RIGID];
            let deformable = Deformable { elasticity, condition: Condition::Solid, update, dashpots: false };
            let found = Convergence { spectral_radius, uncertainty: 0.0, bound: 9.0, iterations: 1 };
            assert!(settles(&deformable, &found, true).is_ok());
            match settles(&deformable, &found, false) {
                Ok(()) => None,
                Err(AssemblyError::NotConvergent { relaxation, young, .. }) => Some((relaxation, young)),
                Err(other) => panic!("{other}"),
            }
        };
        let iterated = |relaxation: f64| Update::Iterated { tolerance: 1e-9, maximum: 100, relaxation };
        for (update, factor) in [(Update::Lagged, 1.0), (iterated(1.0), 1.0), (iterated(0.5), 0.5)] {
            let limit = 2.0 / factor - 1.0;
            assert_eq!(refusal(update, 0.99 * limit), None);
            let (relaxation, young) = refusal(update, 1.25 * limit).unwrap();
            // Some roundings.
            assert!((relaxation * (1.0 + 1.25 * limit) - 2.0).abs() < 1e-14, "{relaxation}");
            assert!((young / (1.25 * 3e9) - 1.0).abs() < 1e-14, "{young}");
        }
    }
}
