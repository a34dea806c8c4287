//! Particle-level failure (Jebahi et al. 2015, [4.23]–[4.24]): a particle whose mean tensile stress exceeds a threshold
//! releases all its bonds.
//!
//! `p_i = (1/dV_i) Σ_bonds ½ l·f`, the trace over the dimension `d` of the particle's stress `(1/2V_i)Σ ½(l⊗f+f⊗l)` with
//! `V_i` the volume of the sphere (disc: of unit depth). Shear forces are perpendicular to the branch vector, so
//! only axial forces count. The source divides by 3; it has no formula for two dimensions, where the stress has two normal
//! components and is divided by 2. The stress of all particles is compared before any bond is released. Released bonds
//! break at their next evaluation and dissipate the energy they store then.

use std::f64::consts::PI;

use crate::state::State;
use crate::state::contacts::ContactFlags;

/// Thresholds of the criterion, by material.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HydrostaticStrength {
    /// Threshold of the mean stress, Pa, tension positive; infinite for materials without one.
    pub thresholds: Vec<f64>,
    /// Whether the scene is two-dimensional.
    pub planar: bool,
}

impl HydrostaticStrength {
    /// Whether any material has a threshold.
    pub fn is_active(&self) -> bool {
        self.thresholds.iter().any(|threshold| threshold.is_finite())
    }
}

/// Mean stress of each particle from its bonds, Pa, tension positive. `None` if the axial force of a bond depends on
/// more than its length (see [`ContactLaw::axial_force`](concordem_contact::law::ContactLaw::axial_force)).
pub fn mean_stress(state: &State, planar: bool) -> Option<Vec<f64>> {
    let particles = &state.particles;
    let mut stress = vec![0.0; particles.len()];
    for block in &state.bonds {
        for k in 0..block.len() {
            let view = block.view(k);
            if view.flags.has(ContactFlags::BROKEN) {
                continue;
            }
            let half = 0.5 * block.axial_force(k, particles)? * view.previous.length;
            stress[view.pair.a as usize] += half;
            stress[view.pair.b as usize] += half;
        }
    }
    for (stress, r) in stress.iter_mut().zip(&particles.radius) {
        let volume_times_dimension = if planar { 2.0 * PI * r * r } else { 4.0 * PI * r * r * r };
        *stress /= volume_times_dimension;
    }
    Some(stress)
}

/// Release all bonds of the particles above their threshold; returns the number of these particles. `stress`: see
/// [`mean_stress`].
pub fn release(state: &mut State, strength: &HydrostaticStrength, stress: &[f64]) -> usize {
    let material = &state.particles.material;
    let over: Vec<bool> = stress
        .iter()
        .zip(material)
        .map(|(stress, m)| strength.thresholds.get(*m as usize).is_some_and(|threshold| stress > threshold))
        .collect();
    let count = over.iter().filter(|over| **over).count();
    if count > 0 {
        for block in &mut state.bonds {
            block.contacts_mut().release(&|pair| over[pair.a as usize] || over[pair.b as usize]);
        }
    }
    count
}
