//! Strengths of bonds that differ.

use concordem_contact::scatter::Scatter;

use crate::state::Particles;
use crate::state::contacts::Pair;

/// Factors on the strengths of bonds. They are no state: they follow from the numbers of the particles and the places at the start.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Strengths {
    /// Factors of single bonds, by material; empty if there are none. A bond between two materials has the mean of both factors.
    pub by_bond: Vec<Option<Scatter>>,
    /// Factors of particles, by their ids; empty if there are none. A bond has the mean of its two particles.
    pub by_particle: Vec<f64>,
}

impl Strengths {
    /// Whether all factors are 1.
    pub fn are_equal(&self) -> bool {
        self.by_bond.is_empty() && self.by_particle.is_empty()
    }

    /// Factor on the strength of a bond with the cross-section `area` (m²).
    pub fn of_bond(&self, particles: &Particles, Pair { a, b }: Pair, area: f64) -> f64 {
        let ends = [a as usize, b as usize];
        let ids = ends.map(|p| particles.id[p]);
        let by_chance = |p: usize| {
            let scatter = self.by_bond.get(particles.material[p] as usize).copied().flatten();
            scatter.map_or(1.0, |scatter| scatter.factor(ids, area))
        };
        let [a, b] = ends;
        let same = particles.material[a] == particles.material[b];
        let by_chance = if same { by_chance(a) } else { 0.5 * (by_chance(a) + by_chance(b)) };
        if self.by_particle.is_empty() {
            return by_chance;
        }
        let [of_a, of_b] = ids.map(|id| self.of_particle(id));
        by_chance * (0.5 * (of_a + of_b))
    }

    /// Factor of the particle with this id.
    pub fn of_particle(&self, id: u32) -> f64 {
        self.by_particle.get(id as usize).copied().unwrap_or(1.0)
    }
}
