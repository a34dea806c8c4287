//! Integration of the equations of motion of free spheres: kick and drift.
//!
//! Leapfrog: `v⁺ = v⁻ + a Δt`, `x' = x + v⁺ Δt`, `q' = exp(ω⁺Δt) q` (central differences; Madan 2019, (2.9)–(2.13)).
//! Velocity Verlet is the same recursion whose first kick is half a step, so that the given initial velocity is the one
//! at time 0 (its on-step velocity is `½(v⁻+v⁺)`).
//!
//! **Ledger.** With kinetic energy measured as `K = ½ m v⁻·v⁺` the recursion gives, without any error of order Δt,
//! `K(n) − K(n−1) = Σ ½(F(n−1) + F(n))·Δx(n)`: the trapezoidal rule over each force. Every external agent is therefore
//! booked with half its force times the displacement before and half its force times the displacement after the
//! instant it acts.

use std::ops::Range;

use rayon::prelude::*;

use super::forces::{TILE, TileMap};
use crate::state::particles::load_of;
use crate::state::{Cell, Clump, Constraint, Load, Particles};
use concordem_contact::kinematics::batch::Formula;
use concordem_contact::kinematics::{BATCH, Columns};
use concordem_contact::math::{
    Mat3, Quat, SMALL_ANGLE_SQUARED, Vec3, normalized, quaternion_of_rotation_vector,
    quaternion_of_small_rotation_vector,
};

/// Artificial damping of the motion.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub enum Damping {
    /// None.
    #[default]
    None,
    /// Cundall's local damping per component as in YADE: `a_i ← a_i (1 − λ sign(a_i (v_i + ½Δt a_i)))`.
    Local {
        /// λ of the translation, 0 to 1.
        translation: f64,
        /// λ of the rotation, 0 to 1.
        rotation: f64,
    },
    /// Non-viscous damping of vectors, Madan 2019 (2.7)–(2.8): `F ← F − α‖F‖ v/‖v‖`, nothing at rest.
    NonViscous {
        /// α of the translation.
        translation: f64,
        /// α of the rotation.
        rotation: f64,
    },
    /// Dissipation of the fast modes by the integrator, Tchamwa & Wielgosz (1999), as used by Jebahi et al. 2015:
    /// `x' = x + vΔt + φ a Δt²`, `v' = v + a Δt`.
    ///
    /// Eliminating the velocity shows that this is leapfrog under the force `F + (φ−1)(F − F_old)` with the net force
    /// `F_old` of the step before: a dashpot on the change of force, which is how it is done and booked here (`v` of
    /// the state is the velocity of the step, `(x'−x)/Δt`). The form with φ on the position's `Δt²/2` alone
    /// (`x' = x + vΔt + φ½aΔt²`, `v' = v + ½(a+a')Δt`) is the same recursion with `½(1+φ)` in the place of φ; so
    /// [`Damping::position_term`] makes it. Stable for `ωΔt < 2/√(2φ−1)`; the spectral radius is `√(1−(φ−1)(ωΔt)²)`.
    /// With φ on the velocity, as [2.24]–[2.25] are printed, the sign of that term is the other and motion grows.
    TchamwaWielgosz {
        /// φ, 1 without dissipation; 1.3 in the book.
        phi: f64,
    },
}

impl Damping {
    /// The form with φ on the position term.
    pub fn position_term(phi: f64) -> Self {
        Self::TchamwaWielgosz { phi: 0.5 * (1.0 + phi) }
    }

    /// Factor on the largest stable time step of the undamped system.
    pub fn stability(&self) -> f64 {
        match self {
            Self::TchamwaWielgosz { phi } => 1.0 / (2.0 * phi - 1.0).sqrt(),
            _ => 1.0,
        }
    }

    /// Whether the forces of the step before are needed.
    pub fn remembers(&self) -> bool {
        matches!(self, Self::TchamwaWielgosz { .. })
    }
}

/// Constants of the kick.
#[derive(Debug, Clone, Copy)]
pub struct KickContext<'a> {
    /// Time step, s.
    pub dt: f64,
    /// Part of the time step this kick spans: 1, or ½ for the first of velocity Verlet.
    pub fraction: f64,
    /// Gravity, m/s².
    pub gravity: Vec3,
    /// Damping.
    pub damping: Damping,
    /// Periodic cell.
    pub cell: Option<&'a Cell>,
    /// Change of the cell's velocity gradient with this kick, 1/s: all particles follow it, but for constrained components,
    /// whose velocity is one in space.
    pub gradient_change: Option<Mat3>,
    /// Whether particles also get the convective acceleration `L·v` of the cell's motion, as YADE gives it to them. As there,
    /// constrained components then follow the cell, too.
    pub convective: bool,
    /// Velocities that constrained degrees of freedom take with this kick (translation, rotation), by particle; `None`:
    /// they keep theirs.
    pub targets: Option<&'a [(Vec3, Vec3)]>,
}

/// Sums over particles of one kick. `before`/`after`: work over the halves of the neighbouring steps, J.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct KickSums {
    /// `Σ ½ m v⁻·v⁺ + ½ I ω⁻·ω⁺`, J.
    pub kinetic: f64,
    /// Energy taken by artificial damping.
    pub damping: [f64; 2],
    /// Work of the prescribed degrees of freedom.
    pub boundary: [f64; 2],
    /// Work of gravity and external forces.
    pub external: [f64; 2],
    /// `Σ|F|²` of the net force over components that are not prescribed, N².
    pub net_force_squared: f64,
    /// Number of bodies with such a component: particles, and clumps instead of their members.
    pub free_particles: u64,
    /// Largest `|v|²` after the kick, m²/s².
    pub max_speed_squared: f64,
}

impl KickSums {
    fn merge(&mut self, other: &Self) {
        self.kinetic += other.kinetic;
        for i in 0..2 {
            self.damping[i] += other.damping[i];
            self.boundary[i] += other.boundary[i];
            self.external[i] += other.external[i];
        }
        self.net_force_squared += other.net_force_squared;
        self.free_particles += other.free_particles;
        self.max_speed_squared = self.max_speed_squared.max(other.max_speed_squared);
    }
}

/// [`Damping::Local`] with λ = `coefficient`: −λ F_i sign(F_i (m v_i + ½Δt F_i)), N. The sign is that of a_i (v_i + ½Δt a_i).
#[inline(always)]
fn local_damping(force: &Vec3, mass: f64, fluctuation: &Vec3, coefficient: f64, dt: f64) -> Vec3 {
    let component = |i: usize| {
        let trend = force[i] * (mass * fluctuation[i] + 0.5 * dt * force[i]);
        // Without a branch: nobody can foretell it.
        let sign = f64::from(u8::from(trend > 0.0)) - f64::from(u8::from(trend < 0.0));
        -coefficient * sign * force[i]
    };
    Vec3::new(component(0), component(1), component(2))
}

/// Velocity after the kick of one vector degree of freedom, and the damping force in it.
///
/// `force` is the undamped force (or torque), `change` what it changed by since the last step (for damping that remembers
/// it), `mass` the mass (or moment of inertia).
#[inline(always)]
fn kicked(
    force: &Vec3,
    mass: f64,
    velocity: &Vec3,
    fluctuation: &Vec3,
    change: &Vec3,
    constrained: u8,
    target: Option<&Vec3>,
    damping: Damping,
    is_rotation: bool,
    dt: f64,
    step: f64,
) -> (Vec3, Vec3) {
    let mut damping_force = Vec3::zeros();
    match damping {
        Damping::None => {}
        Damping::Local { translation, rotation } => {
            let coefficient = if is_rotation { rotation } else { translation };
            damping_force = local_damping(force, mass, fluctuation, coefficient, dt);
        }
        Damping::NonViscous { translation, rotation } => {
            let speed = fluctuation.norm();
            if speed > 0.0 {
                let coefficient = if is_rotation { rotation } else { translation };
                damping_force = fluctuation * (-coefficient * force.norm() / speed);
            }
        }
        Damping::TchamwaWielgosz { phi } => damping_force = change * (phi - 1.0),
    }
    let mut new = velocity + (force + damping_force) * (step / mass);
    if constrained != 0 {
        for i in 0..3 {
            if constrained >> i & 1 == 1 {
                damping_force[i] = 0.0;
                new[i] = target.map_or(velocity[i], |t| t[i]);
            }
        }
    }
    (new, damping_force)
}

/// Sum contact forces and halo into the net contact force and torque of each particle, in fixed order.
pub fn gather(force: &mut [Vec3], torque: &mut [Vec3], maps: &[&TileMap]) {
    force.par_chunks_mut(TILE).zip(torque.par_chunks_mut(TILE)).enumerate().for_each(|(chunk, (force, torque))| {
        for map in maps {
            for (i, (f, t)) in force.iter_mut().zip(torque.iter_mut()).enumerate() {
                for wrench in map.incoming(chunk * TILE + i) {
                    *f += wrench.force;
                    *t += wrench.torque;
                }
            }
        }
    });
}

struct Chunk<'a> {
    base: usize,
    position: &'a mut [Vec3],
    velocity: &'a mut [Vec3],
    orientation: &'a mut [Quat],
    rotation_increment: &'a mut [Quat],
    angular_velocity: &'a mut [Vec3],
    previous: &'a mut [[Vec3; 2]],
}

/// What all chunks read.
struct Shared<'a> {
    context: &'a KickContext<'a>,
    mass: &'a [f64],
    inertia: &'a [f64],
    clump: &'a [u32],
    constraint: &'a [Constraint],
    loads: &'a [Load],
    force: &'a [Vec3],
    torque: &'a [Vec3],
    /// Of the cell, 1/s.
    gradient: Option<Mat3>,
    /// Time of the kick, s.
    step: f64,
}

/// The loop over the particles of a chunk, as something that [`pulp`] can run with the newest instructions of the processor: the
/// same bits, as nothing is fused or reordered.
struct ChunkLoop<'a, 'b> {
    shared: &'a Shared<'a>,
    chunk: Chunk<'b>,
}

impl pulp::NullaryFnOnce for ChunkLoop<'_, '_> {
    type Output = KickSums;
    #[inline(always)]
    fn call(self) -> KickSums {
        let Self { shared, mut chunk } = self;
        let mut sums = KickSums::default();
        let count = chunk.position.len();
        if let Some(kick) = FreeKick::of(shared, &chunk) {
            let mut columns = Columns::default();
            for first in (0..count).step_by(BATCH) {
                kick.advance(&mut columns, shared, &mut chunk, first..count.min(first + BATCH), &mut sums);
            }
        } else {
            for i in 0..count {
                advance(shared, &mut chunk, i, &mut sums);
            }
        }
        sums
    }
}

/// The step of particle `i` of a chunk, unless it is a member of a clump.
#[inline(always)]
fn advance(shared: &Shared<'_>, chunk: &mut Chunk<'_>, i: usize, sums: &mut KickSums) {
    let &Shared { context, mass, inertia, clump, constraint, loads, force, torque, gradient, step } = shared;
    let dt = context.dt;
    let p = chunk.base + i;
    if clump[p] != u32::MAX {
        return;
    }
    let (load, moment) = load_of(loads, p as u32);
    let applied = context.gravity * mass[p] + load;
    let net = force[p] + applied;
    let net_torque = torque[p] + moment;
    let [change, torque_change] = changes(chunk.previous.get_mut(i), &net, &net_torque);
    let (v, w) = (chunk.velocity[i], chunk.angular_velocity[i]);
    let fluctuation = gradient.map_or(v, |l| v - l * chunk.position[i]);
    let constrained = constraint[p].0;
    let target = context.targets.map(|t| &t[p]);
    let (mut v_new, f_damping) = kicked(
        &net,
        mass[p],
        &v,
        &fluctuation,
        &change,
        constrained & 7,
        target.map(|t| &t.0),
        context.damping,
        false,
        dt,
        step,
    );
    let mut imposed = Vec3::zeros();
    if let Some(gradient) = gradient.filter(|_| context.convective) {
        imposed = gradient * v_new * dt;
        v_new += imposed;
    }
    if let Some(change) = &context.gradient_change {
        let mut change = change * chunk.position[i];
        for axis in (0..3).filter(|axis| constrained >> axis & 1 == 1 && !context.convective) {
            change[axis] = 0.0;
        }
        imposed += change;
        v_new += change;
    }
    let (w_new, t_damping) = kicked(
        &net_torque,
        inertia[p],
        &w,
        &w,
        &torque_change,
        constrained >> 3,
        target.map(|t| &t.1),
        context.damping,
        true,
        dt,
        step,
    );
    sums.kinetic += 0.5 * (mass[p] * v.dot(&v_new) + inertia[p] * w.dot(&w_new));
    let half = 0.5 * dt;
    sums.damping[0] -= half * (f_damping.dot(&v) + t_damping.dot(&w));
    sums.damping[1] -= half * (f_damping.dot(&v_new) + t_damping.dot(&w_new));
    sums.external[0] += half * (applied.dot(&v) + moment.dot(&w));
    sums.external[1] += half * (applied.dot(&v_new) + moment.dot(&w_new));
    if context.convective || context.gradient_change.is_some() {
        let impulse = imposed * (0.5 * mass[p]);
        sums.boundary[0] += impulse.dot(&v);
        sums.boundary[1] += impulse.dot(&v_new);
    }
    if constrained != 0 {
        for axis in 0..3 {
            if constrained >> axis & 1 == 1 {
                // What the cell imposes is booked above.
                let reaction = mass[p] * (v_new[axis] - imposed[axis] - v[axis]) / step - net[axis];
                sums.boundary[0] += half * reaction * v[axis];
                sums.boundary[1] += half * reaction * v_new[axis];
            }
            if constrained >> (3 + axis) & 1 == 1 {
                let reaction = inertia[p] * (w_new[axis] - w[axis]) / step - net_torque[axis];
                sums.boundary[0] += half * reaction * w[axis];
                sums.boundary[1] += half * reaction * w_new[axis];
            }
        }
    }
    // Components: a disc is free in its plane.
    if constrained & Constraint::TRANSLATION.0 != Constraint::TRANSLATION.0 {
        let free = |axis: usize| if constrained >> axis & 1 == 0 { net[axis] * net[axis] } else { 0.0 };
        sums.net_force_squared += free(0) + free(1) + free(2);
        sums.free_particles += 1;
    }
    sums.max_speed_squared = sums.max_speed_squared.max(v_new.norm_squared());
    chunk.velocity[i] = v_new;
    chunk.angular_velocity[i] = w_new;
    chunk.position[i] += v_new * dt;
    let increment = quaternion_of_rotation_vector(&(w_new * dt));
    chunk.rotation_increment[i] = increment;
    chunk.orientation[i] = normalized(&(increment * chunk.orientation[i]));
}

/// The step of free particles without a cell or loads, many at a time: the bits of one by one.
struct FreeKick {
    dt: f64,
    /// Time of the kick, s.
    step: f64,
    gravity: Vec3,
    /// Local damping of translation and rotation, 1, if there is any.
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
        // A load of zero is added, as it is one by one: the sign of zeros.
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
    /// If nothing acts on the particles that this does not know.
    #[inline(always)]
    fn of(shared: &Shared<'_>, chunk: &Chunk<'_>) -> Option<Self> {
        let &Shared { context, step, gradient, loads, .. } = shared;
        let plain = gradient.is_none() && loads.is_empty() && chunk.previous.is_empty();
        let plain = plain && context.gradient_change.is_none() && !context.convective;
        let damping = match context.damping {
            Damping::None => None,
            Damping::Local { translation, rotation } => Some([translation, rotation]),
            Damping::NonViscous { .. } | Damping::TchamwaWielgosz { .. } => return None,
        };
        plain.then_some(Self { dt: context.dt, step, gravity: context.gravity, damping })
    }

    /// At most [`BATCH`] particles of a chunk; members of clumps and particles with prescribed components one by one.
    #[inline(always)]
    fn advance(
        &self,
        columns: &mut Columns,
        shared: &Shared<'_>,
        chunk: &mut Chunk<'_>,
        range: Range<usize>,
        sums: &mut KickSums,
    ) {
        let &Shared { mass, inertia, clump, constraint, force, torque, .. } = shared;
        let base = chunk.base;
        let free = |i: usize| clump[base + i] == u32::MAX && constraint[base + i].0 == 0;
        // Discs in a plane, grips.
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

/// Change of force and torque since the last step where `previous` holds those, which are replaced; none otherwise.
#[inline(always)]
fn changes(previous: Option<&mut [Vec3; 2]>, force: &Vec3, torque: &Vec3) -> [Vec3; 2] {
    previous.map_or([Vec3::zeros(); 2], |previous| {
        let old = std::mem::replace(previous, [*force, *torque]);
        [force - old[0], torque - old[1]]
    })
}

/// Kick all free-standing particles (not members of clumps) with net contact forces `force`, `torque`, then drift
/// them. Returns the sums of the kick.
pub fn kick_and_drift(
    context: &KickContext<'_>,
    particles: &mut Particles,
    force: &[Vec3],
    torque: &[Vec3],
) -> KickSums {
    let Particles {
        position,
        velocity,
        orientation,
        rotation_increment,
        angular_velocity,
        mass,
        inertia,
        clump,
        constraint,
        loads,
        previous,
        ..
    } = particles;
    let (mass, inertia, clump) = (&mass[..], &inertia[..], &clump[..]);
    let (constraint, loads) = (&constraint[..], &loads[..]);
    let mut previous = &mut previous[..];
    let chunks: Vec<Chunk<'_>> = position
        .chunks_mut(TILE)
        .zip(velocity.chunks_mut(TILE))
        .zip(orientation.chunks_mut(TILE))
        .zip(rotation_increment.chunks_mut(TILE))
        .zip(angular_velocity.chunks_mut(TILE))
        .enumerate()
        .map(|(c, ((((position, velocity), orientation), rotation_increment), angular_velocity))| Chunk {
            base: c * TILE,
            position,
            velocity,
            orientation,
            rotation_increment,
            angular_velocity,
            // Empty unless the damping remembers.
            previous: previous.split_off_mut(..TILE.min(previous.len())).unwrap_or_default(),
        })
        .collect();
    let (dt, gradient) = (context.dt, context.cell.map(|cell| cell.velocity_gradient));
    let shared = Shared {
        context,
        mass,
        inertia,
        clump,
        constraint,
        loads,
        force,
        torque,
        gradient,
        step: dt * context.fraction,
    };
    let sums: Vec<KickSums> =
        chunks.into_par_iter().map(|chunk| pulp::Arch::new().dispatch(ChunkLoop { shared: &shared, chunk })).collect();
    let mut total = KickSums::default();
    for s in &sums {
        total.merge(s);
    }
    total
}

/// Advance rigid clumps with the forces on their members, and book them like particles.
///
/// The kinetic energy of rotation is booked as the mean of the values before and after the kick, so a tumbling clump
/// leaves a residual of second order in the step in the ledger. Damping acts on the body's force and torque.
pub fn advance_clumps(
    context: &KickContext<'_>,
    clumps: &mut [Clump],
    particles: &mut Particles,
    force: &[Vec3],
    torque: &[Vec3],
    sums: &mut KickSums,
) {
    let dt = context.dt;
    let step = dt * context.fraction;
    for clump in clumps {
        let mut total_force = Vec3::zeros();
        let mut total_torque = Vec3::zeros();
        let mut applied = context.gravity * clump.mass;
        let mut applied_torque = Vec3::zeros();
        for &m in &clump.members {
            let m = m as usize;
            let arm = particles.position[m] - clump.position;
            let (load, moment) = particles.load(m as u32);
            let f = force[m] + load;
            total_force += f;
            total_torque += torque[m] + moment + arm.cross(&f);
            applied += load;
            applied_torque += moment + arm.cross(&load);
        }
        total_force += context.gravity * clump.mass;
        // The place of its first member keeps what the body felt.
        let first = clump.members.first().map_or(usize::MAX, |&m| m as usize);
        let [change, torque_change] = changes(particles.previous.get_mut(first), &total_force, &total_torque);
        let spin = clump.angular_velocity(&clump.angular_momentum, &clump.orientation);
        let (_, f_damping) = kicked(
            &total_force,
            clump.mass,
            &clump.velocity,
            &clump.velocity,
            &change,
            clump.constraint.0 & 7,
            None,
            context.damping,
            false,
            dt,
            step,
        );
        let (_, t_damping) = kicked(
            &total_torque,
            clump.inertia.min(),
            &spin,
            &spin,
            &torque_change,
            clump.constraint.0 >> 3,
            None,
            context.damping,
            true,
            dt,
            step,
        );
        // That with which the members turned in the last step: half a step ago, as their displacements are.
        let turned = particles.angular_velocity.get(first).copied().unwrap_or(spin);
        let (v, rotation_before) = (clump.velocity, clump.rotational_energy());
        clump.advance(&(total_force + f_damping), &(total_torque + t_damping), dt, step, particles);
        let turning = particles.angular_velocity.get(first).copied().unwrap_or(spin);
        sums.kinetic += 0.5 * clump.mass * v.dot(&clump.velocity) + 0.5 * (rotation_before + clump.rotational_energy());
        let half = 0.5 * dt;
        sums.damping[0] -= half * (f_damping.dot(&v) + t_damping.dot(&turned));
        sums.damping[1] -= half * (f_damping.dot(&clump.velocity) + t_damping.dot(&turning));
        sums.external[0] += half * (applied.dot(&v) + applied_torque.dot(&turned));
        sums.external[1] += half * (applied.dot(&clump.velocity) + applied_torque.dot(&turning));
        for axis in 0..3 {
            if clump.constraint.translation(axis) {
                sums.boundary[0] -= half * total_force[axis] * v[axis];
                sums.boundary[1] -= half * total_force[axis] * clump.velocity[axis];
            }
        }
        if clump.constraint.0 & Constraint::TRANSLATION.0 != Constraint::TRANSLATION.0 {
            let free = (0..3).filter(|&axis| !clump.constraint.translation(axis));
            sums.net_force_squared += free.map(|axis| total_force[axis] * total_force[axis]).sum::<f64>();
            sums.free_particles += 1;
        }
        sums.max_speed_squared = sums.max_speed_squared.max(clump.velocity.norm_squared());
    }
}
