//! Where the particle arrays are in memory, of which Python has views.

use concordem::state::Particles;

/// Addresses and lengths of the particle arrays that have views.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Addresses([(usize, usize); 11]);

impl Addresses {
    /// The addresses for `particles`.
    pub fn of(particles: &Particles) -> Self {
        fn of<T>(data: &[T]) -> (usize, usize) {
            (data.as_ptr() as usize, data.len())
        }
        let p = particles;
        Self([
            of(&p.id),
            of(&p.position),
            of(&p.velocity),
            of(&p.orientation),
            of(&p.angular_velocity),
            of(&p.radius),
            of(&p.mass),
            of(&p.inertia),
            of(&p.material),
            of(&p.clump),
            of(&p.tags),
        ])
    }
}
