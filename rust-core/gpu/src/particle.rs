//! Second kernel: a particle.

use concordem_contact::leapfrog::{self, Body, Drifted, Kick};
use concordem_contact::math::Vec3;

use crate::bond::Loads;

/// A particle after the step.
#[derive(Debug, Clone, Copy)]
pub struct Advanced {
    /// m/s.
    pub velocity: Vec3,
    /// rad/s.
    pub angular_velocity: Vec3,
    /// Position and orientation.
    pub drifted: Drifted,
}

/// Sum the loads of a particle's bonds in the order of `entries`, then kick and drift it.
///
/// `entries`: twice the index of a bond, plus 1 if the particle is its B. `loads` gives the loads of a bond. `constraint`: prescribed
/// components, one bit each, first those of the velocity; they keep their velocity. `damped`: whether there is local damping. Force and
/// torque of `body` are replaced.
#[inline(always)]
pub fn advance(
    kick: &Kick,
    damped: bool,
    body: &Body,
    constraint: u8,
    entries: &[u32],
    loads: impl Fn(usize) -> Loads,
) -> Advanced {
    let (mut force, mut torque) = (Vec3::zeros(), Vec3::zeros());
    for &entry in entries {
        let of_bond = loads((entry >> 1) as usize);
        if entry & 1 == 0 {
            force += of_bond.force;
            torque += of_bond.torques[0];
        } else {
            force -= of_bond.force;
            torque += of_bond.torques[1];
        }
    }
    let body = Body { force, torque, ..*body };
    let kicked = if damped { kick.kick::<true, false>(&body) } else { kick.kick::<false, false>(&body) };
    let velocity = keep(constraint, &body.velocity, &kicked.velocity);
    let angular_velocity = keep(constraint >> 3, &body.angular_velocity, &kicked.angular_velocity);
    let drifted = leapfrog::drift(kick.dt, &velocity, &angular_velocity, &body.position, &body.orientation);
    Advanced { velocity, angular_velocity, drifted }
}

/// The new vector, in which prescribed components are the old ones.
#[inline(always)]
fn keep(prescribed: u8, old: &Vec3, new: &Vec3) -> Vec3 {
    let component = |bit: u8, old: f64, new: f64| if prescribed >> bit & 1 == 1 { old } else { new };
    Vec3::new(component(0, old.x, new.x), component(1, old.y, new.y), component(2, old.z, new.z))
}
