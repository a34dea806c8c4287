//! Kick and drift of free particles, a batch at a time.

use std::ops::Range;

use concordem_contact::columns::{Arrays, Columns, Formula};
use concordem_contact::leapfrog::{self, Body, Drifted, Kick, Kicked, Work};
use concordem_contact::math::{Quat, SMALL_ANGLE_SQUARED, Vec3};

use super::particle::{Chunk, Shared, advance};
use super::{Damping, KickSums, NetForces};

/// Kick and drift of free particles without loads, a batch at a time. The bits are those of [`advance`].
pub(super) struct FreeKick {
    kick: Kick,
    damped: bool,
    cell: bool,
}

/// One formula per case, see [`Kick::kick`].
struct KickFormula<const DAMPED: bool, const CELL: bool>(Kick);

concordem_contact::columns! {
    /// Output of [`KickFormula`].
    pub(super) struct KickOutput {
        /// m/s.
        velocity: Vec3,
        /// rad/s.
        angular_velocity: Vec3,
        /// Rotation of the step.
        increment: Quat,
        orientation: Quat,
        /// m.
        position: Vec3,
        /// Angle of the step squared, rad².
        angle_squared: f64,
        /// J.
        kinetic: f64,
        /// Work of the damping at the start and end of the step, J.
        damped_before: f64,
        damped_after: f64,
        /// Work of given forces at the start and end of the step, J.
        external_before: f64,
        external_after: f64,
        net_force_squared: f64,
        speed_squared: f64,
        net_torque_squared: f64,
    }
}

impl<const DAMPED: bool, const CELL: bool> Formula for KickFormula<DAMPED, CELL> {
    type Input = Body;
    type Output = KickOutput;

    #[inline(always)]
    fn apply(&self, input: Body) -> KickOutput {
        let Body { orientation, position, .. } = input;
        let kicked = self.0.kick::<DAMPED, CELL>(&input);
        let dt = self.0.dt;
        let Work { kinetic, damping, external } = kicked.work(&input, dt);
        let Kicked { velocity: v_new, angular_velocity: w_new, net, net_torque, .. } = kicked;
        let drifted = leapfrog::drift_slowly(dt, &v_new, &w_new, &position, &orientation);
        KickOutput {
            velocity: v_new,
            angular_velocity: w_new,
            increment: drifted.increment,
            orientation: drifted.orientation,
            position: drifted.position,
            angle_squared: (w_new * dt).norm_squared(),
            kinetic,
            damped_before: damping[0],
            damped_after: damping[1],
            external_before: external[0],
            external_after: external[1],
            net_force_squared: net.x * net.x + net.y * net.y + net.z * net.z,
            speed_squared: v_new.norm_squared(),
            net_torque_squared: net_torque.norm_squared(),
        }
    }
}

impl FreeKick {
    /// The batched kick, if it supports all forces on the particles.
    #[inline(always)]
    pub fn of(shared: &Shared<'_>, chunk: &Chunk<'_>) -> Option<Self> {
        let &Shared { context, gradient, loads, .. } = shared;
        let plain = loads.is_empty() && chunk.previous.is_empty();
        let plain = plain && context.gradient_change.is_none() && !context.convective;
        let (damped, damping) = match context.damping {
            Damping::None => (false, [0.0; 2]),
            Damping::Local { translation, rotation } => (true, [translation, rotation]),
            Damping::NonViscous { .. } | Damping::TchamwaWielgosz { .. } => return None,
        };
        let (dt, step, gravity) = (context.dt, context.step(), context.gravity);
        let kick = Kick { dt, step, gravity, damping, gradient: gradient.unwrap_or_default() };
        plain.then_some(Self { kick, damped, cell: gradient.is_some() })
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
        // Common cases: discs in a plane, grips.
        if !range.clone().any(free) {
            for i in range {
                advance(shared, chunk, i, sums);
            }
            return;
        }
        for (k, i) in range.clone().enumerate() {
            let p = chunk.base + i;
            let input = columns.input::<Body>();
            input.force.set(k, force[p]);
            input.torque.set(k, torque[p]);
            input.velocity.set(k, chunk.velocity[i]);
            input.angular_velocity.set(k, chunk.angular_velocity[i]);
            input.orientation.set(k, chunk.orientation[i]);
            input.position.set(k, chunk.position[i]);
            input.mass.set(k, mass[p]);
            input.inertia.set(k, inertia[p]);
        }
        match (self.damped, self.cell) {
            // Only the damping reads the motion of the cell.
            (false, _) => columns.apply(&KickFormula::<false, false>(self.kick)),
            (true, false) => columns.apply(&KickFormula::<true, false>(self.kick)),
            (true, true) => columns.apply(&KickFormula::<true, true>(self.kick)),
        }
        for (k, i) in range.enumerate() {
            if !free(i) {
                advance(shared, chunk, i, sums);
                continue;
            }
            let output = columns.output::<KickOutput>();
            chunk.velocity[i] = output.velocity.get(k);
            chunk.angular_velocity[i] = output.angular_velocity.get(k);
            chunk.position[i] = output.position.get(k);
            if output.angle_squared.get(k) < SMALL_ANGLE_SQUARED {
                chunk.rotation_increment[i] = output.increment.get(k);
                chunk.orientation[i] = output.orientation.get(k);
            } else {
                let (w, orientation) = (chunk.angular_velocity[i], chunk.orientation[i]);
                let drifted = leapfrog::drift(self.kick.dt, &chunk.velocity[i], &w, &chunk.position[i], &orientation);
                let Drifted { increment, orientation, .. } = drifted;
                (chunk.rotation_increment[i], chunk.orientation[i]) = (increment, orientation);
            }
            sums.kinetic += output.kinetic.get(k);
            sums.damping[0] -= output.damped_before.get(k);
            sums.damping[1] -= output.damped_after.get(k);
            sums.external[0] += output.external_before.get(k);
            sums.external[1] += output.external_after.get(k);
            sums.net_force_squared += output.net_force_squared.get(k);
            sums.free_particles += 1;
            sums.net_torque_squared += output.net_torque_squared.get(k);
            sums.free_rotations += 1;
            sums.max_speed_squared = sums.max_speed_squared.max(output.speed_squared.get(k));
        }
    }
}
