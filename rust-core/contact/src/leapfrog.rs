//! One step of leapfrog for a free particle: kick and drift, without branches.
//!
//! `v⁺ = v⁻ + a Δt`, `x' = x + v⁺ Δt`, `q' = exp(ω⁺Δt) q`. The solver runs these functions in columns, a kernel for each particle.

use crate::math::{
    Mat3, Quat, SMALL_ANGLE_SQUARED, Vec3, normalized, quaternion_of_rotation_vector,
    quaternion_of_small_rotation_vector,
};

crate::columns! {
    /// A particle before the kick, and the sums of its contacts.
    pub struct Body {
        /// Net contact force, N.
        pub force: Vec3,
        /// Net contact torque, N·m.
        pub torque: Vec3,
        /// m/s.
        pub velocity: Vec3,
        /// rad/s.
        pub angular_velocity: Vec3,
        /// Body to world.
        pub orientation: Quat,
        /// m.
        pub position: Vec3,
        /// kg.
        pub mass: f64,
        /// Moment of inertia, kg·m².
        pub inertia: f64,
    }
}

/// What the kicks of all particles share.
#[derive(Debug, Clone, Copy)]
pub struct Kick {
    /// Time step, s.
    pub dt: f64,
    /// Time of the kick, s.
    pub step: f64,
    /// m/s².
    pub gravity: Vec3,
    /// λ of local damping ([`local_damping`]) for translation and rotation.
    pub damping: [f64; 2],
    /// Velocity gradient of the cell, 1/s.
    pub gradient: Mat3,
}

/// A particle after the kick.
#[derive(Debug, Clone, Copy)]
pub struct Kicked {
    /// m/s.
    pub velocity: Vec3,
    /// rad/s.
    pub angular_velocity: Vec3,
    /// Given force, N.
    pub applied: Vec3,
    /// Force of contacts and given force, N.
    pub net: Vec3,
    /// N·m.
    pub net_torque: Vec3,
    /// Damping force (N) and torque (N·m).
    pub damping: [Vec3; 2],
}

/// Kinetic energy of a step, and work of forces in it. Pairs are over the half steps before and after the instant of the kick.
#[derive(Debug, Clone, Copy)]
pub struct Work {
    /// `½ m v⁻·v⁺ + ½ I ω⁻·ω⁺`, J.
    pub kinetic: f64,
    /// Of the damping, J.
    pub damping: [f64; 2],
    /// Of given forces, J.
    pub external: [f64; 2],
}

impl Kicked {
    /// Work in a step of `dt` (s) of the particle that was `body` before the kick.
    #[inline(always)]
    pub fn work(&self, body: &Body, dt: f64) -> Work {
        let &Self { velocity: v_new, angular_velocity: w_new, applied, damping: [f, t], .. } = self;
        let &Body { velocity: v, angular_velocity: w, mass, inertia, .. } = body;
        let half = 0.5 * dt;
        Work {
            kinetic: 0.5 * (mass * v.dot(&v_new) + inertia * w.dot(&w_new)),
            damping: [half * (f.dot(&v) + t.dot(&w)), half * (f.dot(&v_new) + t.dot(&w_new))],
            external: [half * applied.dot(&v), half * applied.dot(&v_new)],
        }
    }
}

/// A particle after the drift.
#[derive(Debug, Clone, Copy)]
pub struct Drifted {
    /// m.
    pub position: Vec3,
    /// Rotation of the step.
    pub increment: Quat,
    /// Body to world.
    pub orientation: Quat,
}

/// Which velocity local damping acts on. A type, because a condition that the kick reads keeps the columns of the solver out of vector registers.
pub trait LocalDamping: Copy + Send + Sync {
    /// Whether the velocity is relative to the motion of a cell.
    const IN_CELL: bool = false;

    /// The velocity (m/s) of a body on which the damping acts; `None`: there is no damping. `gradient`: of the velocity of a cell, 1/s.
    fn fluctuation(body: &Body, gradient: &Mat3) -> Option<Vec3>;
}

/// No damping.
#[derive(Debug, Clone, Copy)]
pub struct Undamped;

/// On the velocity.
#[derive(Debug, Clone, Copy)]
pub struct Damped;

/// On the velocity relative to the motion of the cell.
#[derive(Debug, Clone, Copy)]
pub struct DampedInCell;

impl LocalDamping for Undamped {
    #[inline(always)]
    fn fluctuation(_: &Body, _: &Mat3) -> Option<Vec3> {
        None
    }
}

impl LocalDamping for Damped {
    #[inline(always)]
    fn fluctuation(body: &Body, _: &Mat3) -> Option<Vec3> {
        Some(body.velocity)
    }
}

impl LocalDamping for DampedInCell {
    const IN_CELL: bool = true;

    #[inline(always)]
    fn fluctuation(body: &Body, gradient: &Mat3) -> Option<Vec3> {
        Some(body.velocity - gradient * body.position)
    }
}

impl Kick {
    /// Kick a free particle, with local damping as `D` says.
    #[inline(always)]
    pub fn kick<D: LocalDamping>(&self, body: &Body) -> Kicked {
        let &Self { dt, step, gravity, damping, gradient } = self;
        let &Body { force, torque, velocity: v, angular_velocity: w, mass, inertia, .. } = body;
        // Add a load of zero, as particles with loads do, because it changes the sign of zeros.
        let applied = gravity * mass + Vec3::zeros();
        let (net, net_torque) = (force + applied, torque + Vec3::zeros());
        let damping = if let Some(fluctuation) = D::fluctuation(body, &gradient) {
            let [translation, rotation] = damping;
            let of_torque = local_damping(&net_torque, inertia, &w, rotation, dt);
            [local_damping(&net, mass, &fluctuation, translation, dt), of_torque]
        } else {
            Default::default()
        };
        Kicked {
            velocity: v + (net + damping[0]) * (step / mass),
            angular_velocity: w + (net_torque + damping[1]) * (step / inertia),
            applied,
            net,
            net_torque,
            damping,
        }
    }
}

/// Drift for `dt` (s) with the velocity (m/s) and the angular velocity (rad/s) after the kick. Exact only if `‖ω‖²dt²` is below
/// [`SMALL_ANGLE_SQUARED`].
#[inline(always)]
pub fn drift_slowly(dt: f64, velocity: &Vec3, angular_velocity: &Vec3, position: &Vec3, orientation: &Quat) -> Drifted {
    let increment = quaternion_of_small_rotation_vector(&(angular_velocity * dt));
    Drifted { position: position + velocity * dt, increment, orientation: turned(&increment, orientation) }
}

/// As [`drift_slowly`], at any angular velocity.
#[inline(always)]
pub fn drift(dt: f64, velocity: &Vec3, angular_velocity: &Vec3, position: &Vec3, orientation: &Quat) -> Drifted {
    let slow = drift_slowly(dt, velocity, angular_velocity, position, orientation);
    let theta = angular_velocity * dt;
    if theta.norm_squared() < SMALL_ANGLE_SQUARED {
        return slow;
    }
    let increment = quaternion_of_rotation_vector(&theta);
    Drifted { increment, orientation: turned(&increment, orientation), ..slow }
}

/// Orientation after the rotation `increment`.
#[inline(always)]
pub fn turned(increment: &Quat, orientation: &Quat) -> Quat {
    normalized(&(increment * orientation))
}

/// Force of Cundall's local damping with λ = `coefficient`, N: `−λ F_i sign(F_i (m v_i + ½Δt F_i))`, whose sign is that of
/// `a_i (v_i + ½Δt a_i)`.
#[inline(always)]
pub fn local_damping(force: &Vec3, mass: f64, fluctuation: &Vec3, coefficient: f64, dt: f64) -> Vec3 {
    let component = |i: usize| {
        let trend = force[i] * (mass * fluctuation[i] + 0.5 * dt * force[i]);
        // Without a branch, because a processor cannot predict it.
        let sign = f64::from(u8::from(trend > 0.0)) - f64::from(u8::from(trend < 0.0));
        -coefficient * sign * force[i]
    };
    Vec3::new(component(0), component(1), component(2))
}
