//! Second kernel: a particle.

use concordem_contact::leapfrog::{self, Body, Damped, Drifted, Kick, Kicked, Undamped, Work};
use concordem_contact::math::Vec3;

use crate::arguments::Squares;
use crate::contact::Loads;

/// A particle after the step.
#[derive(Debug, Clone, Copy)]
pub struct Advanced {
    /// m/s.
    pub velocity: Vec3,
    /// rad/s.
    pub angular_velocity: Vec3,
    /// Position and orientation.
    pub drifted: Drifted,
    /// Kinetic energy and work of the kick.
    pub work: Work,
    /// Work of the reactions of the prescribed components over the half steps before and after the kick, J: by axis, of the translation
    /// and then of the rotation. Zero for free components.
    pub reactions: [[f64; 2]; 6],
    /// Force (N) and torque (N·m) of the contacts.
    pub net: [Vec3; 2],
    /// Squares of the net force (N²) and moment (N²·m²) over the free components.
    pub squares: Squares,
}

/// Sum the loads of a particle's contacts in the order of `entries`, then kick and drift it.
///
/// `entries`: twice the index of a contact, plus 1 if the particle is its B. `loads` gives the loads of a contact. `constraint`: prescribed
/// components, one bit each, first those of the velocity; they keep their velocity. `damped`: whether there is local damping. Force and
/// torque of `body` are replaced.
#[inline(always)]
pub fn advance<'a>(
    kick: &Kick,
    damped: bool,
    body: &Body,
    constraint: u8,
    entries: &[u32],
    loads: impl Fn(usize) -> &'a Loads,
) -> Advanced {
    let (mut force, mut torque) = (Vec3::zeros(), Vec3::zeros());
    for &entry in entries {
        // Without branches, because neighboring threads are at different ends. Adding the opposite has the bits of subtracting.
        let Loads { force: on_a, torques } = loads((entry >> 1) as usize);
        let at_b = entry & 1 == 1;
        force += if at_b { -on_a } else { *on_a };
        torque += torques[usize::from(at_b)];
    }
    let body = Body { force, torque, ..*body };
    let free = if damped { kick.kick::<Damped>(&body) } else { kick.kick::<Undamped>(&body) };
    let [f, t] = &free.damping;
    let damping = [keep(constraint, &Vec3::zeros(), f), keep(constraint >> 3, &Vec3::zeros(), t)];
    let velocity = keep(constraint, &body.velocity, &free.velocity);
    let angular_velocity = keep(constraint >> 3, &body.angular_velocity, &free.angular_velocity);
    let kicked = Kicked { velocity, angular_velocity, damping, ..free };
    Advanced {
        velocity,
        angular_velocity,
        drifted: leapfrog::drift(kick.dt, &velocity, &angular_velocity, &body.position, &body.orientation),
        work: kicked.work(&body, kick.dt),
        reactions: reactions(kick, constraint, &body, &kicked),
        net: [force, torque],
        squares: [of_free(constraint, &kicked.net), of_free(constraint >> 3, &kicked.net_torque)],
    }
}

/// The new vector, in which prescribed components are the old ones.
#[inline(always)]
fn keep(prescribed: u8, old: &Vec3, new: &Vec3) -> Vec3 {
    let component = |bit: u8, old: f64, new: f64| if prescribed >> bit & 1 == 1 { old } else { new };
    Vec3::new(component(0, old.x, new.x), component(1, old.y, new.y), component(2, old.z, new.z))
}

/// Sum of the squares of the components that are not prescribed.
#[inline(always)]
fn of_free(prescribed: u8, v: &Vec3) -> f64 {
    let square = |axis: usize| if prescribed >> axis & 1 == 0 { v[axis] * v[axis] } else { 0.0 };
    square(0) + square(1) + square(2)
}

/// [`Advanced::reactions`]: of the forces that keep the prescribed velocities.
#[inline(always)]
fn reactions(kick: &Kick, constraint: u8, body: &Body, kicked: &Kicked) -> [[f64; 2]; 6] {
    let mut works = [[0.0; 2]; 6];
    let half = 0.5 * kick.dt;
    let translation = (&kicked.net, body.mass, &body.velocity, &kicked.velocity);
    let rotation = (&kicked.net_torque, body.inertia, &body.angular_velocity, &kicked.angular_velocity);
    for axis in 0..3 {
        for (which, (force, mass, old, new)) in [translation, rotation].into_iter().enumerate() {
            if constraint >> (3 * which + axis) & 1 == 1 {
                let reaction = mass * (new[axis] - old[axis]) / kick.step - force[axis];
                works[2 * axis + which] = [half * reaction * old[axis], half * reaction * new[axis]];
            }
        }
    }
    works
}
