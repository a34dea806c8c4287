//! The step of YADE's `NewtonIntegrator` for one sphere.
//!
//! The operations are those of YADE 2023.02a to 2025.2.0 in their order, so that results have YADE's bits: kick
//! `v⁺ = v⁻ + aΔt` with Cundall's damping of the acceleration, drift `x' = x + v⁺Δt`, `q' = exp(ω⁺Δt) q`.

use concordem_contact::math::Vec3;

/// Mask of a body none of whose degrees of freedom is free (`State::DOF_ALL`).
const ALL_BLOCKED: u32 = 0b11_1111;

/// Settings of the integrator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Newton {
    /// Time step, s.
    pub dt: f64,
    /// Coefficient of the damping.
    pub damping: f64,
    /// m/s².
    pub gravity: Vec3,
    /// Whether damping acts on gravity, too (`dampGravity`).
    pub damp_gravity: bool,
}

/// What acts on a body in a step.
#[derive(Debug, Clone, Copy)]
pub struct Acting {
    /// N.
    pub force: Vec3,
    /// N·m.
    pub torque: Vec3,
    /// kg.
    pub mass: f64,
    /// Moments of inertia, kg·m².
    pub inertia: Vec3,
    /// Bit mask of the degrees of freedom that keep their velocity (`State::blockedDOFs`).
    pub blocked: u32,
    /// Whether damping acts on the body (`State::isDamped`).
    pub damped: bool,
}

/// Motion of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moving {
    /// m.
    pub position: Vec3,
    /// m/s.
    pub velocity: Vec3,
    /// rad/s.
    pub angular_velocity: Vec3,
    /// x, y, z, w; body to world.
    pub orientation: [f64; 4],
}

/// Sum of squares, in the order of Eigen.
#[inline(always)]
fn squares(v: &Vec3) -> f64 {
    v.x * v.x + (v.y * v.y + v.z * v.z)
}

/// Sine and cosine of half the angle of a rotation, as those of the C library, which YADE uses.
#[inline(always)]
fn half_angle(half: f64) -> (f64, f64) {
    // Below, the sine is rounded to its argument and the cosine to 1: the next terms are less than half of the last bit.
    const SMALL: f64 = 1.0 / (1_u64 << 27) as f64;
    if half.abs() < SMALL { (half, 1.0) } else { half.sin_cos() }
}

/// `a b` in the order of Eigen; components x, y, z, w.
#[inline(always)]
fn product([ax, ay, az, aw]: [f64; 4], [bx, by, bz, bw]: [f64; 4]) -> [f64; 4] {
    [
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by + ay * bw + az * bx - ax * bz,
        aw * bz + az * bw + ax * by - ay * bx,
        aw * bw - ax * bx - ay * by - az * bz,
    ]
}

impl Newton {
    /// Acceleration `a` after damping: `a (1 − λ sign(a (v + ½aΔt)))`.
    #[inline(always)]
    fn damped(&self, coefficient: f64, a: f64, v: f64) -> f64 {
        let trend = a * (v + 0.5 * self.dt * a);
        // Without a branch, because a processor cannot predict it.
        let sign = f64::from(u8::from(trend > 0.0)) - f64::from(u8::from(trend < 0.0));
        a * (1.0 - coefficient * sign)
    }

    #[inline(always)]
    fn kick(&self, on: &Acting, body: &mut Moving) {
        let coefficient = if on.damped { self.damping } else { 0.0 };
        // YADE adds to zero unless all are free, which changes the sign of a zero.
        let zero = if on.blocked == 0 { -0.0 } else { 0.0 };
        for i in 0..3 {
            let free = on.blocked >> i & 1 == 0;
            let (of_force, gravity) = if free { (on.force[i] / on.mass, self.gravity[i]) } else { (0.0, 0.0) };
            let v = &mut body.velocity[i];
            let a = if self.damp_gravity {
                self.damped(coefficient, if free { zero + (of_force + gravity) } else { 0.0 }, *v)
            } else {
                self.damped(coefficient, if free { zero + of_force } else { 0.0 }, *v) + gravity
            };
            *v += self.dt * a;
        }
        for i in 0..3 {
            let free = on.blocked >> (3 + i) & 1 == 0;
            let w = &mut body.angular_velocity[i];
            let a = if free { zero + on.torque[i] / on.inertia[i] } else { 0.0 };
            *w += self.dt * self.damped(coefficient, a, *w);
        }
    }

    #[inline(always)]
    fn drift(&self, body: &mut Moving) {
        body.position += body.velocity * self.dt;
        let w = body.angular_velocity;
        let square = squares(&w);
        let mut q = body.orientation;
        if square != 0.0 {
            let norm = square.sqrt();
            let (sine, cosine) = half_angle(0.5 * (norm * self.dt));
            let axis = [w.x / norm, w.y / norm, w.z / norm];
            q = product([sine * axis[0], sine * axis[1], sine * axis[2], cosine], q);
        }
        let square = (q[0] * q[0] + q[1] * q[1]) + (q[2] * q[2] + q[3] * q[3]);
        if square > 0.0 {
            let norm = square.sqrt();
            q = q.map(|part| part / norm);
        }
        body.orientation = q;
    }

    /// Kick and drift of a body.
    #[inline(always)]
    pub fn step(&self, on: &Acting, body: &mut Moving) {
        if on.blocked != ALL_BLOCKED {
            self.kick(on, body);
        }
        self.drift(body);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A power of two, so that the products below are exact.
    const DT: f64 = 1.0 / 1024.0;
    const NEWTON: Newton = Newton { dt: DT, damping: 0.25, gravity: Vec3::new(0.0, 0.0, -8.0), damp_gravity: true };

    fn acting() -> Acting {
        Acting {
            force: Vec3::new(4.0, -6.0, 0.0),
            torque: Vec3::new(0.0, 2.0, 0.0),
            mass: 2.0,
            inertia: Vec3::new(1.0, 0.5, 0.25),
            blocked: 0,
            damped: true,
        }
    }

    fn resting() -> Moving {
        Moving {
            position: Vec3::zeros(),
            velocity: Vec3::zeros(),
            angular_velocity: Vec3::zeros(),
            orientation: [0.0, 0.0, 0.0, 1.0],
        }
    }

    /// Damping takes a quarter of an acceleration along the motion and adds a quarter to one against it.
    #[test]
    fn accelerations_are_damped_against_the_motion() {
        let mut body = resting();
        NEWTON.step(&acting(), &mut body);
        assert_eq!(body.velocity, Vec3::new(1.5, -2.25, -6.0) * DT);
        assert_eq!(body.angular_velocity, Vec3::new(0.0, 3.0, 0.0) * DT);
        assert_eq!(body.position, body.velocity * DT);
        let mut against = Moving { velocity: Vec3::new(-1.0, 0.0, 0.0), ..resting() };
        NEWTON.step(&acting(), &mut against);
        assert_eq!(against.velocity.x, -1.0 + DT * 2.5);
    }

    #[test]
    fn gravity_can_act_without_damping() {
        let mut body = resting();
        Newton { damp_gravity: false, ..NEWTON }.step(&acting(), &mut body);
        assert_eq!(body.velocity, Vec3::new(1.5, -2.25, -8.0) * DT);
    }

    #[test]
    fn undamped_bodies_are_kicked_in_full() {
        let mut body = resting();
        NEWTON.step(&Acting { damped: false, ..acting() }, &mut body);
        assert_eq!(body.velocity, Vec3::new(2.0, -3.0, -8.0) * DT);
    }

    #[test]
    fn blocked_velocities_stay() {
        let velocity = Vec3::new(1.0, 2.0, 3.0);
        let start = Moving { velocity, angular_velocity: Vec3::new(0.5, 0.25, 0.125), ..resting() };
        // x of the velocity and y of the angular velocity.
        let mut body = start;
        NEWTON.step(&Acting { blocked: 0b01_0001, ..acting() }, &mut body);
        assert_eq!((body.velocity.x, body.angular_velocity.y), (1.0, 0.25));
        assert!(body.velocity.y != 2.0 && body.velocity.z != 3.0);
        let mut body = start;
        NEWTON.step(&Acting { blocked: ALL_BLOCKED, ..acting() }, &mut body);
        assert_eq!((body.velocity, body.angular_velocity), (velocity, start.angular_velocity));
        assert_eq!(body.position, velocity * DT, "it moves on");
    }

    /// A constant angular velocity turns the body by `ωt`; a thousand products round by less than 1e-13.
    #[test]
    fn bodies_turn_by_their_angular_velocity() {
        for rate in [2.0, 1e-6] {
            let mut body = Moving { angular_velocity: Vec3::new(0.0, 0.0, rate), ..resting() };
            for _ in 0..1024 {
                NEWTON.step(&Acting { blocked: ALL_BLOCKED, ..acting() }, &mut body);
            }
            let half = 0.5 * rate;
            let error = (body.orientation[2] - half.sin()).abs() + (body.orientation[3] - half.cos()).abs();
            assert!(error < 1e-13, "{rate}: {error:e}");
        }
    }

    /// The short form of small angles has the bits of the C library.
    #[test]
    fn small_angles_have_the_bits_of_the_library() {
        let mut half = 1.0 / (1_u64 << 27) as f64;
        while half > 1e-300 {
            let below = f64::from_bits(half.to_bits() - 1);
            for x in [below, -below] {
                assert_eq!(half_angle(x), (x.sin(), x.cos()));
            }
            half *= 0.37;
        }
    }
}
