//! The kick of one vector degree of freedom.

use concordem_contact::leapfrog::local_damping;
use concordem_contact::math::Vec3;

use super::{Damping, KickContext};

/// Translation or rotation of a body before the kick. For rotations read torque for force, moment of inertia for mass, and
/// angular velocity for velocity.
pub(super) struct Freedom<'a> {
    /// Undamped force, N.
    pub force: &'a Vec3,
    /// Mass, kg.
    pub mass: f64,
    /// Velocity, m/s.
    pub velocity: &'a Vec3,
    /// Velocity relative to the affine motion of the cell, m/s, on which the damping acts.
    pub fluctuation: &'a Vec3,
    /// Change of the force since the last step, N, for damping that reads it.
    pub change: &'a Vec3,
    /// Prescribed components, one bit each.
    pub constrained: u8,
    /// Velocity that prescribed components take, m/s; `None`: they keep theirs.
    pub target: Option<&'a Vec3>,
    /// Whether this is a rotation.
    pub is_rotation: bool,
}

impl Freedom<'_> {
    /// Velocity after the kick, and the damping force.
    #[inline(always)]
    pub fn kick(&self, context: &KickContext<'_>) -> (Vec3, Vec3) {
        let &Self { force, mass, velocity, fluctuation, change, constrained, target, is_rotation } = self;
        let mut damping_force = Vec3::zeros();
        match context.damping {
            Damping::None => {}
            Damping::Local { translation, rotation } => {
                let coefficient = if is_rotation { rotation } else { translation };
                damping_force = local_damping(force, mass, fluctuation, coefficient, context.dt);
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
        let mut new = velocity + (force + damping_force) * (context.step() / mass);
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
}
