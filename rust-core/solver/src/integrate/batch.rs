//! Kick and drift of free particles, a batch at a time.

use std::marker::PhantomData;
use std::ops::Range;

use concordem_contact::columns::{Arrays, Columns, Formula, Item, Lanes, places};
use concordem_contact::leapfrog::{
    self, Body, Damped, DampedInCell, Drifted, Kick, Kicked, LocalDamping, Undamped, Work,
};
use concordem_contact::math::{Quat, SMALL_ANGLE_SQUARED, Vec3};

use super::particle::{Chunk, Shared, advance};
use super::{Damping, KickSums, NetForces};

/// Kick and drift of free particles without loads, a batch at a time. The bits are those of [`advance`].
pub(super) struct FreeKick {
    kick: Kick,
    damped: bool,
    cell: bool,
}

/// One formula per kind of local damping, see [`Kick::kick`].
struct KickFormula<D>(Kick, PhantomData<D>);

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
        /// Work of the damping on the mean motion of the cell over either half step, J.
        damped_mean: f64,
        /// Work of given forces at the start and end of the step, J.
        external_before: f64,
        external_after: f64,
        net_force_squared: f64,
        speed_squared: f64,
        net_torque_squared: f64,
    }
}

impl<D: LocalDamping> Formula for KickFormula<D> {
    type Input = Body;
    type Output = KickOutput;

    #[inline(always)]
    fn apply(&self, input: Body) -> KickOutput {
        let Body { orientation, position, .. } = input;
        let kicked = self.0.kick::<D>(&input);
        let dt = self.0.dt;
        let Work { kinetic, damping, external } = kicked.work(&input, dt);
        let damped_mean =
            if D::IN_CELL { 0.5 * dt * kicked.damping[0].dot(&(self.0.gradient * position)) } else { 0.0 };
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
            damped_mean,
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
        // Without a cell there is no convection.
        let convective = context.convective && gradient.is_some();
        let plain = plain && context.gradient_change.is_none() && !convective;
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
    pub fn advance<T: Lanes>(
        &self,
        lanes: T,
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
        let (first, count) = (range.start, range.len());
        let input = columns.input::<Body>();
        for k in (0..count).step_by(4) {
            let of_chunk = places(k, count);
            input.force.set_four(k, rows(&force[base + first..], of_chunk), lanes);
            input.torque.set_four(k, rows(&torque[base + first..], of_chunk), lanes);
            input.velocity.set_four(k, rows(&chunk.velocity[first..], of_chunk), lanes);
            input.angular_velocity.set_four(k, rows(&chunk.angular_velocity[first..], of_chunk), lanes);
            input.orientation.set_four(k, rows(&chunk.orientation[first..], of_chunk), lanes);
            input.position.set_four(k, rows(&chunk.position[first..], of_chunk), lanes);
        }
        input.mass[..count].copy_from_slice(&mass[base + first..][..count]);
        input.inertia[..count].copy_from_slice(&inertia[base + first..][..count]);
        match (self.damped, self.cell) {
            // Only the damping reads the motion of the cell.
            (false, _) => columns.apply(&KickFormula::<Undamped>(self.kick, PhantomData)),
            (true, false) => columns.apply(&KickFormula::<Damped>(self.kick, PhantomData)),
            (true, true) => columns.apply(&KickFormula::<DampedInCell>(self.kick, PhantomData)),
        }
        let output = columns.output::<KickOutput>();
        for group in (0..count).step_by(4) {
            let four = group..count.min(group + 4);
            let mut plain = four.len() == 4;
            for k in four.clone() {
                plain = plain && free(first + k) && output.angle_squared[k] < SMALL_ANGLE_SQUARED;
            }
            if plain {
                let i = first + group;
                chunk.velocity[i..i + 4].copy_from_slice(&output.velocity.get_four(group, lanes));
                chunk.angular_velocity[i..i + 4].copy_from_slice(&output.angular_velocity.get_four(group, lanes));
                chunk.position[i..i + 4].copy_from_slice(&output.position.get_four(group, lanes));
                chunk.rotation_increment[i..i + 4].copy_from_slice(&output.increment.get_four(group, lanes));
                chunk.orientation[i..i + 4].copy_from_slice(&output.orientation.get_four(group, lanes));
                for k in four {
                    add(output, k, sums);
                }
                continue;
            }
            for k in four {
                let i = first + k;
                if !free(i) {
                    advance(shared, chunk, i, sums);
                    continue;
                }
                self.store(output, k, chunk, i);
                add(output, k, sums);
            }
        }
    }

    /// Store the motion of particle `i` of a chunk, which is number `k` of the batch.
    #[inline(always)]
    fn store(&self, output: &<KickOutput as Item>::Arrays, k: usize, chunk: &mut Chunk<'_>, i: usize) {
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
    }
}

/// Four of the rows.
#[inline(always)]
fn rows<R>(rows: &[R], [a, b, c, d]: [usize; 4]) -> [&R; 4] {
    [&rows[a], &rows[b], &rows[c], &rows[d]]
}

/// Add the energies of particle `k` of the batch.
#[inline(always)]
fn add(output: &<KickOutput as Item>::Arrays, k: usize, sums: &mut KickSums) {
    sums.kinetic += output.kinetic.get(k);
    let mean = output.damped_mean.get(k);
    sums.boundary[0] += mean;
    sums.boundary[1] += mean;
    sums.damping[0] -= output.damped_before.get(k) - mean;
    sums.damping[1] -= output.damped_after.get(k) - mean;
    sums.external[0] += output.external_before.get(k);
    sums.external[1] += output.external_after.get(k);
    sums.net_force_squared += output.net_force_squared.get(k);
    sums.free_particles += 1;
    sums.net_torque_squared += output.net_torque_squared.get(k);
    sums.free_rotations += 1;
    sums.max_speed_squared = sums.max_speed_squared.max(output.speed_squared.get(k));
}
