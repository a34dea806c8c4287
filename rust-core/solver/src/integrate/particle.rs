//! Kick and drift of a particle of a chunk.

use concordem_contact::math::{Mat3, Quat, Vec3, normalized, quaternion_of_rotation_vector};

use super::damping::changes;
use super::kick::Freedom;
use super::{KickContext, KickSums, NetForces};
use crate::state::particles::load_of;
use crate::state::{Constraint, Load};

/// The particles of a chunk.
pub(super) struct Chunk<'a> {
    /// Index of its first particle.
    pub base: usize,
    pub position: &'a mut [Vec3],
    pub velocity: &'a mut [Vec3],
    pub orientation: &'a mut [Quat],
    pub rotation_increment: &'a mut [Quat],
    pub angular_velocity: &'a mut [Vec3],
    /// Force and torque of the last step; empty unless the damping reads them.
    pub previous: &'a mut [[Vec3; 2]],
}

/// Inputs that all chunks share; slices are by particle.
pub(super) struct Shared<'a> {
    pub context: &'a KickContext<'a>,
    pub mass: &'a [f64],
    pub inertia: &'a [f64],
    pub clump: &'a [u32],
    pub constraint: &'a [Constraint],
    pub loads: &'a [Load],
    pub net: NetForces<'a>,
    /// Velocity gradient of the cell, 1/s.
    pub gradient: Option<Mat3>,
}

/// Kick and drift of particle `i` of a chunk, unless it belongs to a clump.
#[inline(always)]
pub(super) fn advance(shared: &Shared<'_>, chunk: &mut Chunk<'_>, i: usize, sums: &mut KickSums) {
    let &Shared { context, mass, inertia, clump, constraint, loads, net: NetForces { force, torque }, gradient } =
        shared;
    let dt = context.dt;
    let p = chunk.base + i;
    if clump[p] != u32::MAX {
        return;
    }
    let (mass, inertia, constrained) = (mass[p], inertia[p], constraint[p].0);
    let (load, moment) = load_of(loads, p as u32);
    let applied = context.gravity * mass + load;
    let net = force[p] + applied;
    let net_torque = torque[p] + moment;
    let [change, torque_change] = changes(chunk.previous.get_mut(i), &net, &net_torque);
    let (v, w) = (chunk.velocity[i], chunk.angular_velocity[i]);
    let fluctuation = gradient.map_or(v, |l| v - l * chunk.position[i]);
    let target = context.targets.map(|t| &t[p]);
    let translation = Freedom {
        force: &net,
        mass,
        velocity: &v,
        fluctuation: &fluctuation,
        change: &change,
        constrained: constrained & 7,
        target: target.map(|t| &t.0),
        is_rotation: false,
    };
    let (mut v_new, f_damping) = translation.kick(context);
    let imposed = impose_cell_motion(shared, &chunk.position[i], constrained, &mut v_new);
    let rotation = Freedom {
        force: &net_torque,
        mass: inertia,
        velocity: &w,
        fluctuation: &w,
        change: &torque_change,
        constrained: constrained >> 3,
        target: target.map(|t| &t.1),
        is_rotation: true,
    };
    let (w_new, t_damping) = rotation.kick(context);
    sums.kinetic += 0.5 * (mass * v.dot(&v_new) + inertia * w.dot(&w_new));
    let half = 0.5 * dt;
    // What damping does to the mean motion of a cell is work of its boundary.
    let mean = gradient.map_or_else(Default::default, |l| {
        let change = context.gradient_change.unwrap_or_else(Mat3::zeros);
        let motions = [l, l + change].map(|l| half * f_damping.dot(&(l * chunk.position[i])));
        sums.boundary[0] += motions[0];
        sums.boundary[1] += motions[1];
        motions
    });
    sums.damping[0] -= half * (f_damping.dot(&v) + t_damping.dot(&w)) - mean[0];
    sums.damping[1] -= half * (f_damping.dot(&v_new) + t_damping.dot(&w_new)) - mean[1];
    sums.external[0] += half * (applied.dot(&v) + moment.dot(&w));
    sums.external[1] += half * (applied.dot(&v_new) + moment.dot(&w_new));
    if context.convective || context.gradient_change.is_some() {
        let impulse = imposed * (0.5 * mass);
        sums.boundary[0] += impulse.dot(&v);
        sums.boundary[1] += impulse.dot(&v_new);
    }
    if constrained != 0 {
        let freedoms = [(&translation, v_new - imposed, v_new), (&rotation, w_new, w_new)];
        book_reactions(context, constrained, &freedoms, sums);
    }
    // By component: a disc is free in its plane.
    if constrained & Constraint::TRANSLATION.0 != Constraint::TRANSLATION.0 {
        let free = |axis: usize| if constrained >> axis & 1 == 0 { net[axis] * net[axis] } else { 0.0 };
        sums.net_force_squared += free(0) + free(1) + free(2);
        sums.free_particles += 1;
    }
    if constrained & Constraint::ROTATION.0 != Constraint::ROTATION.0 {
        let free = |axis: usize| {
            if constrained >> (3 + axis) & 1 == 0 { net_torque[axis] * net_torque[axis] } else { 0.0 }
        };
        sums.net_torque_squared += free(0) + free(1) + free(2);
        sums.free_rotations += 1;
    }
    sums.max_speed_squared = sums.max_speed_squared.max(v_new.norm_squared());
    chunk.velocity[i] = v_new;
    chunk.angular_velocity[i] = w_new;
    chunk.position[i] += v_new * dt;
    let increment = quaternion_of_rotation_vector(&(w_new * dt));
    chunk.rotation_increment[i] = increment;
    chunk.orientation[i] = normalized(&(increment * chunk.orientation[i]));
}

/// Add the imposed motion of the cell to `velocity` of a free or constrained particle; returns the change, m/s.
#[inline(always)]
fn impose_cell_motion(shared: &Shared<'_>, position: &Vec3, constrained: u8, velocity: &mut Vec3) -> Vec3 {
    let context = shared.context;
    let mut imposed = Vec3::zeros();
    if let Some(gradient) = shared.gradient.filter(|_| context.convective) {
        imposed = gradient * *velocity * context.dt;
        *velocity += imposed;
    }
    if let Some(change) = &context.gradient_change {
        let mut change = change * position;
        for axis in (0..3).filter(|axis| constrained >> axis & 1 == 1 && !context.convective) {
            change[axis] = 0.0;
        }
        imposed += change;
        *velocity += change;
    }
    imposed
}

/// Book the work of the reactions of prescribed components.
///
/// `freedoms`: translation and rotation, each with the velocity after the kick without and with the motion imposed by
/// the cell, whose work is booked separately. The order of the sums is by axis, then by freedom.
#[inline(always)]
fn book_reactions(
    context: &KickContext<'_>,
    constrained: u8,
    freedoms: &[(&Freedom<'_>, Vec3, Vec3); 2],
    sums: &mut KickSums,
) {
    let (half, step) = (0.5 * context.dt, context.step());
    for axis in 0..3 {
        for (which, (freedom, unimposed, new)) in freedoms.iter().enumerate() {
            if constrained >> (3 * which + axis) & 1 == 1 {
                let Freedom { force, mass, velocity, .. } = freedom;
                let reaction = mass * (unimposed[axis] - velocity[axis]) / step - force[axis];
                sums.boundary[0] += half * reaction * velocity[axis];
                sums.boundary[1] += half * reaction * new[axis];
            }
        }
    }
}
