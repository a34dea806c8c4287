//! Histories of motions, walls, and loads, and the stages of the loading.

use super::bodies::{is_rigid, members};
use super::motions::{field, history, mesh_motion};
use super::{AssemblyError, unfit};
use crate::schedule::{Histories, Loading, Stage, Stop, TimedLoads, TimedMotion, TimedTurning, TimedWall};
use crate::schema::quantity::{Component, vector};
use crate::schema::{self, AppliedForce, Control, Prescribe, Quantity, Scenario};
use concordem_contact::math::Vec3;
use concordem_solver::state::{Particles, PointOfAction, State};

/// The stages of the loading.
pub(super) fn stages(scenario: &Scenario) -> Vec<Stage> {
    let stage = |stage: &schema::Stage| Stage {
        name: stage.name.clone(),
        rate: stage.rate.si(),
        by_stress: stage.control == Control::Stress,
        history: stage.history.as_deref().and_then(|name| history(scenario, name)),
        strain: stage.stop.strain.map(Quantity::si),
        stress: stage.stop.stress.map(Quantity::si),
        stop: Stop {
            drop_to: stage.stop.drop_to.map(Quantity::si),
            strain: None,
            time: stage.stop.time.map(Quantity::si),
            steps: stage.stop.steps,
            unbalanced: stage.stop.unbalanced.map(Quantity::si),
        },
    };
    scenario.stages.iter().map(stage).collect()
}

/// Everything that histories drive. Velocities of the state become those of the first step.
///
/// # Errors
/// A component of a motion that follows a history is prescribed twice, or belongs to an end layer.
pub(super) fn build(scenario: &Scenario, loading: &Loading, state: &mut State) -> Result<Histories, AssemblyError> {
    let mut histories = Histories::default();
    check_owners(scenario, loading, &state.particles)?;
    for prescribe in &scenario.prescribed {
        if moves_in_time(prescribe) {
            histories.motions.push(TimedMotion {
                history: prescribe.history.as_deref().and_then(|name| history(scenario, name)),
                particles: members(scenario, &state.particles, &prescribe.set).into_iter().map(|p| p as u32).collect(),
                velocity: prescribe.velocity.map(Component::si),
                angular_velocity: prescribe.angular_velocity.map(Component::si),
                displacement: prescribe.displacement.map(Component::si),
                field: prescribe.field.as_ref().map(field),
            });
        }
    }
    let mut first = 0;
    for wall in &scenario.walls {
        let faces = wall.shape.kind().faces().len();
        if let Some(history) = wall.history.as_deref().and_then(|name| history(scenario, name))
            && wall.servo.is_none()
        {
            let velocity = vector(&wall.velocity);
            let timed = |wall| TimedWall { history: history.clone(), wall, velocity };
            histories.walls.extend((first..first + faces).map(timed));
        }
        if let Some(mesh) = state.walls[first].mesh() {
            histories.meshes.extend(mesh_motion(scenario, wall, &mesh.position, first));
        }
        if let Some(rotation) = &wall.rotation
            && let Some(history) = rotation.history.as_deref().and_then(|name| history(scenario, name))
        {
            let angular_velocity = wall.shape.kind().axis().unwrap_or_default() * rotation.angular_velocity.si();
            histories.turning.push(TimedTurning { history, wall: first, angular_velocity });
        }
        first += faces;
    }
    histories.membranes = super::membranes::build(scenario, &state.particles)?;
    add_loads(scenario, &state.particles, &mut histories);
    if !histories.constant_loads.is_empty() {
        // The state stores as many loads as the run has.
        for load in &histories.constant_loads {
            state.particles.add_load_at(load.particle, Vec3::zeros(), Vec3::zeros(), PointOfAction::Body);
        }
    }
    histories.start(state);
    Ok(histories)
}

/// Refuses two motions of one component of a particle, if one of them follows a history: the later one could not simply
/// replace the velocity of the earlier one.
fn check_owners(scenario: &Scenario, loading: &Loading, particles: &Particles) -> Result<(), AssemblyError> {
    if !scenario.prescribed.iter().any(moves_in_time) {
        return Ok(());
    }
    let layers: [&[u32]; 2] = match loading {
        Loading::Uniaxial { layers, .. } | Loading::Turning { layers, .. } => [&layers[0], &layers[1]],
        Loading::Flexure(flexure) => flexure.strips(),
        _ => [&[], &[]],
    };
    // Bit `i` of the components: velocity 0 to 2, angular velocity 3 to 5.
    let mut constant = vec![0_u8; particles.len()];
    let mut timed = vec![0_u8; particles.len()];
    for &p in layers.into_iter().flatten() {
        constant[p as usize] = particles.constraint[p as usize].0;
    }
    for (number, prescribe) in scenario.prescribed.iter().enumerate() {
        let components = (0..3).fold(0_u8, |bits, i| {
            let moves = prescribe.velocity[i].si().or(prescribe.displacement[i].si()).is_some();
            let of_field = prescribe.field.as_ref().map(field);
            let moves = moves || of_field.as_ref().is_some_and(|field| field.prescribed[i]);
            let turned = of_field.is_some_and(|field| field.angular_velocity.is_some());
            let rotates = turned || prescribe.angular_velocity[i].si().is_some();
            bits | u8::from(moves) << i | u8::from(rotates) << (3 + i)
        });
        for p in members(scenario, particles, &prescribe.set) {
            let others = if moves_in_time(prescribe) { constant[p] | timed[p] } else { timed[p] };
            if others & components != 0 {
                let message = format!(
                    "particle {} has another prescribed motion of the same component, or belongs to an end layer of the loading; \
                     with a history or a field, give each component one motion",
                    particles.id[p]
                );
                return Err(unfit(&format!("prescribe[{number}].set"), message));
            }
            let bits = if moves_in_time(prescribe) { &mut timed[p] } else { &mut constant[p] };
            *bits |= components;
        }
    }
    Ok(())
}

/// The loads of `[[force]]` with a history, and the constant ones and those of membranes beside them.
fn add_loads(scenario: &Scenario, particles: &Particles, histories: &mut Histories) {
    if scenario.forces.iter().all(|force| force.history.is_none()) && histories.membranes.is_empty() {
        return;
    }
    let acts = |force: &AppliedForce| if is_rigid(scenario) { PointOfAction::Body } else { force.acts };
    // Every loaded particle has an entry, also one whose loads all follow histories. Only the list of loads is used here.
    let mut constant = Particles::default();
    for force in &scenario.forces {
        let factor = if force.history.is_none() { 1.0 } else { 0.0 };
        for p in members(scenario, particles, &force.set) {
            let (force, moment) = (vector(&force.force) * factor, vector(&force.moment) * factor);
            constant.add_load_at(p as u32, force, moment, PointOfAction::Body);
        }
    }
    for &p in histories.membranes.iter().flat_map(|membrane| &membrane.faces).flatten() {
        constant.add_load_at(p, Vec3::zeros(), Vec3::zeros(), PointOfAction::Body);
    }
    for membrane in &mut histories.membranes {
        let place = |p: u32| constant.loads.partition_point(|load| load.particle < p) as u32;
        membrane.places = membrane.faces.iter().map(|face| face.map(place)).collect();
    }
    for force in &scenario.forces {
        let mut single = Particles::default();
        single.add_load_at(0, vector(&force.force), vector(&force.moment), acts(force));
        let load = single.loads[0];
        let place = |p: usize| constant.loads.binary_search_by_key(&(p as u32), |load| load.particle).ok();
        let members = members(scenario, particles, &force.set);
        let places: Vec<_> = members.into_iter().filter_map(|p| Some((place(p)?, load))).collect();
        match force.history.as_deref().and_then(|name| history(scenario, name)) {
            Some(history) => histories.loads.push(TimedLoads { history, loads: places }),
            None => places.iter().for_each(|(at, load)| constant.loads[*at].virial += load.virial),
        }
    }
    histories.constant_loads = constant.loads;
}

/// Whether the velocities of a prescribed motion change during the run.
fn moves_in_time(prescribe: &Prescribe) -> bool {
    prescribe.history.is_some() || prescribe.field.is_some()
}
