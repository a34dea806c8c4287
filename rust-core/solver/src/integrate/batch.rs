//! Kick and drift of free particles, a batch at a time.

use std::ops::Range;

use concordem_contact::kinematics::Columns;
use concordem_contact::kinematics::batch::Formula;
use concordem_contact::math::{
    Quat, SMALL_ANGLE_SQUARED, Vec3, normalized, quaternion_of_rotation_vector, quaternion_of_small_rotation_vector,
};

use super::damping::local_damping;
use super::particle::{Chunk, Shared, advance};
use super::{Damping, KickSums, NetForces};

/// Kick and drift of free particles without a cell or loads, a batch at a time; the bits are those of [`advance`].
pub(super) struct FreeKick {
    dt: f64,
    /// Time of the kick, s.
    step: f64,
    gravity: Vec3,
    /// λ of local damping for translation and rotation, if there is any.
    damping: Option<[f64; 2]>,
}

/// Input: force (N), torque (N·m), velocity (m/s), angular velocity (rad/s), orientation, position (m), mass (kg), moment of
/// inertia (kg·m²).
const KICK_INPUT: usize = 21;
/// Output: velocity, angular velocity, rotation of the step, orientation, position, angle of the step squared; terms of
/// kinetic energy, damping, external work, net force squared, speed squared.
const KICK_OUTPUT: usize = 25;

impl Formula<KICK_INPUT, KICK_OUTPUT> for FreeKick {
    #[inline(always)]
    fn apply(&self, input: [f64; KICK_INPUT]) -> [f64; KICK_OUTPUT] {
        let &Self { dt, step, gravity, damping } = self;
        let vector = |at: usize| Vec3::new(input[at], input[at + 1], input[at + 2]);
        let (force, torque, v, w, position) = (vector(0), vector(3), vector(6), vector(9), vector(16));
        let orientation = Quat::new(input[15], input[12], input[13], input[14]);
        let [mass, inertia] = [input[19], input[20]];
        // Add a load of zero, as [`advance`] does: it changes the sign of zeros.
        let applied = gravity * mass + Vec3::zeros();
        let (net, net_torque) = (force + applied, torque + Vec3::zeros());
        let (f_damping, t_damping) = damping.map_or_else(Default::default, |[translation, rotation]| {
            let of_torque = local_damping(&net_torque, inertia, &w, rotation, dt);
            (local_damping(&net, mass, &v, translation, dt), of_torque)
        });
        let v_new = v + (net + f_damping) * (step / mass);
        let w_new = w + (net_torque + t_damping) * (step / inertia);
        let theta = w_new * dt;
        let increment = quaternion_of_small_rotation_vector(&theta);
        let turned = normalized(&(increment * orientation));
        let moved = position + v_new * dt;
        let half = 0.5 * dt;
        [
            v_new.x,
            v_new.y,
            v_new.z,
            w_new.x,
            w_new.y,
            w_new.z,
            increment.i,
            increment.j,
            increment.k,
            increment.w,
            turned.i,
            turned.j,
            turned.k,
            turned.w,
            moved.x,
            moved.y,
            moved.z,
            theta.norm_squared(),
            0.5 * (mass * v.dot(&v_new) + inertia * w.dot(&w_new)),
            half * (f_damping.dot(&v) + t_damping.dot(&w)),
            half * (f_damping.dot(&v_new) + t_damping.dot(&w_new)),
            half * applied.dot(&v),
            half * applied.dot(&v_new),
            net.x * net.x + net.y * net.y + net.z * net.z,
            v_new.norm_squared(),
        ]
    }
}

impl FreeKick {
    /// The batched kick, if it supports everything that acts on the particles.
    #[inline(always)]
    pub fn of(shared: &Shared<'_>, chunk: &Chunk<'_>) -> Option<Self> {
        let &Shared { context, gradient, loads, .. } = shared;
        let plain = gradient.is_none() && loads.is_empty() && chunk.previous.is_empty();
        let plain = plain && context.gradient_change.is_none() && !context.convective;
        let damping = match context.damping {
            Damping::None => None,
            Damping::Local { translation, rotation } => Some([translation, rotation]),
            Damping::NonViscous { .. } | Damping::TchamwaWielgosz { .. } => return None,
        };
        plain.then_some(Self { dt: context.dt, step: context.step(), gravity: context.gravity, damping })
    }

    /// Advance at most [`BATCH`] particles of a chunk. Members of clumps and particles with prescribed components take the
    /// scalar path.
    #[inline(always)]
    pub fn advance(
        &self,
        columns: &mut Columns,
        shared: &Shared<'_>,
        chunk: &mut Chunk<'_>,
        range: Range<usize>,
        sums: &mut KickSums,
    ) {
        let &Shared { mass, inertia, clump, constraint, net: NetForces { force, torque }, .. } = shared;
        let base = chunk.base;
        let free = |i: usize| clump[base + i] == u32::MAX && constraint[base + i].0 == 0;
        // Common: discs in a plane, grips.
        if !range.clone().any(free) {
            for i in range {
                advance(shared, chunk, i, sums);
            }
            return;
        }
        for (k, i) in range.clone().enumerate() {
            let p = chunk.base + i;
            columns.set_from::<3>(0, k, force[p].into());
            columns.set_from::<3>(3, k, torque[p].into());
            columns.set_from::<3>(6, k, chunk.velocity[i].into());
            columns.set_from::<3>(9, k, chunk.angular_velocity[i].into());
            columns.set_from::<4>(12, k, chunk.orientation[i].coords.into());
            columns.set_from::<3>(16, k, chunk.position[i].into());
            columns.set_from(19, k, [mass[p], inertia[p]]);
        }
        columns.apply(self);
        for (k, i) in range.enumerate() {
            if !free(i) {
                advance(shared, chunk, i, sums);
                continue;
            }
            chunk.velocity[i] = columns.get_from::<3>(0, k).into();
            chunk.angular_velocity[i] = columns.get_from::<3>(3, k).into();
            chunk.position[i] = columns.get_from::<3>(14, k).into();
            let [angle_squared, kinetic, damped_before, damped_after] = columns.get_from(17, k);
            let [external_before, external_after, net_force_squared, speed_squared] = columns.get_from(21, k);
            if angle_squared < SMALL_ANGLE_SQUARED {
                chunk.rotation_increment[i] = Quat::from_vector(columns.get_from::<4>(6, k).into());
                chunk.orientation[i] = Quat::from_vector(columns.get_from::<4>(10, k).into());
            } else {
                let increment = quaternion_of_rotation_vector(&(chunk.angular_velocity[i] * self.dt));
                chunk.rotation_increment[i] = increment;
                chunk.orientation[i] = normalized(&(increment * chunk.orientation[i]));
            }
            sums.kinetic += kinetic;
            sums.damping[0] -= damped_before;
            sums.damping[1] -= damped_after;
            sums.external[0] += external_before;
            sums.external[1] += external_after;
            sums.net_force_squared += net_force_squared;
            sums.free_particles += 1;
            sums.max_speed_squared = sums.max_speed_squared.max(speed_squared);
        }
    }
}
