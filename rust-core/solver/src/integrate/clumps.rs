//! Kick and drift of rigid clumps.

use concordem_contact::math::Vec3;

use super::Damping;
use super::damping::{changes, local_damping_at};
use super::kick::Freedom;
use super::{KickContext, KickSums, NetForces};
use crate::state::{Clump, Constraint, Particles};

/// Forces and torques on a clump.
struct Resultant {
    /// All forces, N.
    force: Vec3,
    /// All torques about the center of mass, N·m.
    torque: Vec3,
    /// Gravity and loads alone, N.
    applied: Vec3,
    /// Torque of the loads alone, N·m.
    applied_torque: Vec3,
}

impl Resultant {
    fn of(clump: &Clump, gravity: &Vec3, particles: &Particles, net: NetForces<'_>) -> Self {
        let mut sum = Self {
            force: Vec3::zeros(),
            torque: Vec3::zeros(),
            applied: gravity * clump.mass,
            applied_torque: Vec3::zeros(),
        };
        for &m in &clump.members {
            let m = m as usize;
            let arm = particles.position[m] - clump.position;
            let (load, moment) = particles.load(m as u32);
            let f = net.force[m] + load;
            sum.force += f;
            sum.torque += net.torque[m] + moment + arm.cross(&f);
            sum.applied += load;
            sum.applied_torque += moment + arm.cross(&load);
        }
        sum.force += gravity * clump.mass;
        sum
    }
}

/// Advance rigid clumps under the forces on their members, and book their energies like those of particles.
///
/// The rotational kinetic energy is booked as the mean of its values before and after the kick, so a tumbling clump
/// leaves a residual of second order in the step in the ledger. Damping acts on force and torque of the clump; the sign of local
/// damping is that of the mean angular velocity of the step, with all three moments of inertia: with a smaller inertia it would
/// drive rotations that turn back.
pub fn advance_clumps(
    context: &KickContext<'_>,
    clumps: &mut [Clump],
    particles: &mut Particles,
    net: NetForces<'_>,
    sums: &mut KickSums,
) {
    for clump in clumps {
        advance(context, clump, particles, net, sums);
    }
}

fn advance(
    context: &KickContext<'_>,
    clump: &mut Clump,
    particles: &mut Particles,
    net: NetForces<'_>,
    sums: &mut KickSums,
) {
    let dt = context.dt;
    let Resultant { force, torque, applied, applied_torque } = Resultant::of(clump, &context.gravity, particles, net);
    // The entry of the first member stores force and torque of the clump.
    let first = clump.members.first().map_or(usize::MAX, |&m| m as usize);
    let [change, torque_change] = changes(particles.previous.get_mut(first), &force, &torque);
    let angular_velocity = clump.angular_velocity(&clump.angular_momentum, &clump.orientation);
    let velocity = clump.velocity;
    let translation = Freedom {
        force: &force,
        mass: clump.mass,
        velocity: &velocity,
        fluctuation: &velocity,
        change: &change,
        constrained: clump.constraint.0 & 7,
        target: None,
        is_rotation: false,
    };
    let rotation = Freedom {
        force: &torque,
        mass: clump.inertia.min(),
        velocity: &angular_velocity,
        fluctuation: &angular_velocity,
        change: &torque_change,
        constrained: clump.constraint.0 >> 3,
        target: None,
        is_rotation: true,
    };
    let (_, f_damping) = translation.kick(context);
    let t_damping = match context.damping {
        Damping::Local { rotation, .. } => {
            let change = clump.angular_velocity(&torque, &clump.orientation) * (0.5 * dt);
            let mut damping = local_damping_at(&torque, &(angular_velocity + change), rotation);
            (0..3).filter(|&axis| clump.constraint.rotation(axis)).for_each(|axis| damping[axis] = 0.0);
            damping
        }
        _ => rotation.kick(context).1,
    };
    // Angular velocity of the members in the last step, half a step ago, like their displacements.
    let w = particles.angular_velocity.get(first).copied().unwrap_or(angular_velocity);
    let (v, rotation_before) = (velocity, clump.rotational_energy());
    clump.advance(&(force + f_damping), &(torque + t_damping), dt, context.step(), particles);
    let w_new = particles.angular_velocity.get(first).copied().unwrap_or(angular_velocity);
    sums.kinetic += 0.5 * clump.mass * v.dot(&clump.velocity) + 0.5 * (rotation_before + clump.rotational_energy());
    let half = 0.5 * dt;
    sums.damping[0] -= half * (f_damping.dot(&v) + t_damping.dot(&w));
    sums.damping[1] -= half * (f_damping.dot(&clump.velocity) + t_damping.dot(&w_new));
    sums.external[0] += half * (applied.dot(&v) + applied_torque.dot(&w));
    sums.external[1] += half * (applied.dot(&clump.velocity) + applied_torque.dot(&w_new));
    for axis in 0..3 {
        if clump.constraint.translation(axis) {
            sums.boundary[0] -= half * force[axis] * v[axis];
            sums.boundary[1] -= half * force[axis] * clump.velocity[axis];
        }
    }
    if clump.constraint.0 & Constraint::TRANSLATION.0 != Constraint::TRANSLATION.0 {
        let free = (0..3).filter(|&axis| !clump.constraint.translation(axis));
        sums.net_force_squared += free.map(|axis| force[axis] * force[axis]).sum::<f64>();
        sums.free_particles += 1;
    }
    if clump.constraint.0 & Constraint::ROTATION.0 != Constraint::ROTATION.0 {
        let free = (0..3).filter(|&axis| !clump.constraint.rotation(axis));
        sums.net_torque_squared += free.map(|axis| torque[axis] * torque[axis]).sum::<f64>();
        sums.free_rotations += 1;
    }
    sums.max_speed_squared = sums.max_speed_squared.max(clump.velocity.norm_squared());
}
