//! Initial velocities, prescribed motions, forces, and clumps.

use super::motions::{fastest, history};
use super::particles::ClumpMembers;
use super::selection::member_of_clump;
use super::{AssemblyError, set_index, unfit};
use crate::schema::quantity::vector;
use crate::schema::{self, Scenario};
use concordem_contact::math::Vec3;
use concordem_solver::state::{Clump, Constraint, Particles, PointOfAction, State};

/// Indices of the particles of a set.
pub(super) fn members(scenario: &Scenario, particles: &Particles, name: &str) -> Vec<usize> {
    let bit = 1u64 << set_index(scenario, name);
    (0..particles.len()).filter(|&p| particles.tags[p] & bit != 0).collect()
}

/// Initial velocities, prescribed motions, and forces.
///
/// # Errors
/// A motion is prescribed for a member of a clump, which moves with the clump.
pub(super) fn apply_motions(scenario: &Scenario, state: &mut State) -> Result<(), AssemblyError> {
    for initial in &scenario.initials {
        for p in members(scenario, &state.particles, &initial.set) {
            state.particles.velocity[p] = vector(&initial.velocity);
            state.particles.angular_velocity[p] = vector(&initial.angular_velocity);
        }
    }
    for (number, prescribe) in scenario.prescribed.iter().enumerate() {
        let members = members(scenario, &state.particles, &prescribe.set);
        if let Some((id, clump)) = member_of_clump(&state.particles, &members) {
            let message = format!(
                "set `{}` contains particle {id}, which belongs to clump[{clump}] and moves with it; exclude the members \
                 of the clump from the set, or remove the clump",
                prescribe.set
            );
            return Err(unfit(&format!("prescribe[{number}].set"), message));
        }
        for p in members {
            let fastest = fastest(scenario, prescribe, &state.particles.position[p]);
            apply_prescribed(&fastest, p, &mut state.particles);
        }
    }
    apply_loads(scenario, &mut state.particles, 0.0);
    Ok(())
}

/// Whether no material is deformable.
pub(super) fn is_rigid(scenario: &Scenario) -> bool {
    scenario.materials.iter().all(|material| material.deformable.is_none())
}

/// Applies the loads of `[[force]]` at `time` (s). On rigid particles they act at the center, whatever `acts` says.
pub fn apply_loads(scenario: &Scenario, particles: &mut Particles, time: f64) {
    let rigid = is_rigid(scenario);
    for force in &scenario.forces {
        let acts = if rigid { PointOfAction::Body } else { force.acts };
        let found = force.history.as_deref().and_then(|name| history(scenario, name));
        let factor = found.map_or(1.0, |history| history.at(time));
        for p in members(scenario, particles, &force.set) {
            particles.add_load_at(p as u32, vector(&force.force) * factor, vector(&force.moment) * factor, acts);
        }
    }
}

/// Sets and constrains the prescribed components of a particle's motion: velocity (m/s) and angular velocity (rad/s).
fn apply_prescribed([velocity, angular_velocity]: &[[Option<f64>; 3]; 2], p: usize, particles: &mut Particles) {
    for i in 0..3 {
        if let Some(v) = velocity[i] {
            particles.velocity[p][i] = v;
            particles.constraint[p].0 |= 1 << i;
        }
        if let Some(w) = angular_velocity[i] {
            particles.angular_velocity[p][i] = w;
            particles.constraint[p].0 |= 8 << i;
        }
    }
}

/// Rigid bodies with their initial motion.
pub(super) fn add_clumps(scenario: &Scenario, members: &ClumpMembers, state: &mut State) -> Result<(), AssemblyError> {
    for (number, (clump, members)) in scenario.clumps.iter().zip(members).enumerate() {
        let inertia = clump.inertia.map(|i| Vec3::new(i[0].si(), i[1].si(), i[2].si()));
        let (velocity, angular_velocity) = initial_motion(clump, number, members, &state.particles)?;
        let mass = clump.mass.map(schema::Quantity::si);
        let mut body = Clump::new(members.clone(), &state.particles, mass, inertia);
        if scenario.dimension == 2 {
            body.constraint = Constraint::OUT_OF_PLANE;
        }
        body.start(velocity, angular_velocity, &mut state.particles);
        state.clumps.push(body);
    }
    Ok(())
}

/// Initial velocity (m/s) and angular velocity (rad/s) of a clump: its own, else the one that `[[initial]]` gives its
/// members.
///
/// # Errors
/// The velocities of the members are not a translation of the body.
fn initial_motion(
    clump: &schema::Clump,
    number: usize,
    members: &[u32],
    particles: &Particles,
) -> Result<(Vec3, Vec3), AssemblyError> {
    let first = particles.velocity[members[0] as usize];
    let velocity = match &clump.velocity {
        Some(velocity) => vector(velocity),
        None if members.iter().all(|&m| particles.velocity[m as usize] == first) => first,
        None => {
            let message = "[[initial]] gives its members different velocities, which no rigid body has; give the clump its \
                           own `velocity`, or include all of its members in the set of [[initial]], or none";
            return Err(unfit(&format!("clump[{number}]"), message.into()));
        }
    };
    let angular_velocity = match &clump.angular_velocity {
        Some(angular_velocity) => vector(angular_velocity),
        None if members.iter().all(|&m| particles.angular_velocity[m as usize] == Vec3::zeros()) => Vec3::zeros(),
        None => {
            let message = "[[initial]] gives its members an angular velocity, each about its own center, which no rigid \
                           body has; give the clump its own `angular_velocity`";
            return Err(unfit(&format!("clump[{number}]"), message.into()));
        }
    };
    Ok((velocity, angular_velocity))
}
