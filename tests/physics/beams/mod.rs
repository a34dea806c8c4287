//! Beams: chains agree with their closed forms; cantilevers, damping by the integrator, and energy and determinism through
//! fracture.

mod cantilevers;
mod damping;
mod dashpots;
mod fracture;
mod rotating_ends;
mod softening;
mod vibrations;

use std::f64::consts::PI;

use concordem::law::CohesiveBeam;
use concordem::math::Vec3;
use concordem::state::{Constraint, Particles, Sphere, State};
use concordem_tests::bonded;

/// A chain of `count` touching spheres along x, the first one clamped, bonded by `beam`.
fn chain(count: usize, radius: f64, density: f64, beam: CohesiveBeam) -> State {
    let mut particles = Particles::default();
    for p in 0..count {
        let position = Vec3::new(2.0 * radius * p as f64, 0.0, 0.0);
        let mass = density * 4.0 / 3.0 * PI * radius.powi(3);
        particles.push(Sphere { position, radius }, 0, mass, 0.4 * mass * radius * radius);
    }
    particles.constraint[0] = Constraint::ALL;
    bonded(particles, None, beam, 1.01)
}

/// Two touching spheres along x, of radius and mass 1.
fn pair() -> Particles {
    let mut particles = Particles::default();
    for x in [0.0, 2.0] {
        particles.push(Sphere { position: Vec3::new(x, 0.0, 0.0), radius: 1.0 }, 0, 1.0, 0.4);
    }
    particles
}
