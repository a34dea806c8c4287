//! Results per particle for YADE's `CpmState`.

#![allow(unsafe_code, clippy::missing_safety_doc)] // a C function

use concordem_c_abi::{Message, guarded, slice_mut};
use concordem_operator::LoadSet;
use concordem_operator::stress::{ParticleVolume, Partition, particle_stress};
use concordem_solver::forces::EvaluatedContacts;
use concordem_solver::state::State;
use concordem_solver::state::contacts::ContactFlags;

use super::{Bonds, row_by_row};

/// Lost strength of a bond: `1 − (1−ω)κ/ε₀` for concrete, as in YADE, and the damage for other laws.
fn strength_lost(block: &dyn EvaluatedContacts, k: usize, crack_onset: f64) -> f64 {
    let (fields, reals) = block.history_reals();
    let at = |name: &str| fields.iter().take_while(|f| f.name != name).map(|f| f.components).sum::<usize>();
    let width: usize = fields.iter().map(|f| f.components).sum();
    if fields.iter().all(|f| f.name != "kappa") {
        return block.damage(k);
    }
    let (kappa, omega) = (reals[k * width + at("kappa")], reals[k * width + at("omega")]);
    if kappa < crack_onset { 0.0 } else { 1.0 - (1.0 - omega) * kappa / crack_onset }
}

/// For each particle, the number of its intact bonds and the sum of their lost strengths.
fn losses_of_strength(state: &State, crack_onset: f64) -> (Vec<u32>, Vec<f64>) {
    let count = state.particles.len();
    let (mut bonds, mut sums) = (vec![0_u32; count], vec![0.0; count]);
    for block in &state.bonds {
        for k in 0..block.len() {
            let view = block.view(k);
            if view.flags.has(ContactFlags::BROKEN) {
                continue;
            }
            let lost = strength_lost(&**block, k, crack_onset);
            for p in [view.pair.a, view.pair.b] {
                bonds[p as usize] += 1;
                sums[p as usize] += lost;
            }
        }
    }
    (bonds, sums)
}

/// Compute the attributes of `CpmState` for each particle: mean lost strength of its bonds (1 for a broken one), number of broken
/// bonds, and mean stress (Pa, nine reals, symmetric). The volume is that of the sphere divided by a solid fraction of 0.62; each
/// particle gets half of every branch vector. Returns 0, or −1 and a message.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_bonds_particles(
    bonds: *mut Bonds,
    crack_onset: f64,
    damage: *mut f64,
    lost: *mut u32,
    stress_of: *mut [f64; 9],
    message: *const Message,
) -> i64 {
    // SAFETY: one entry per particle in each array.
    unsafe {
        guarded(message, || {
            let Bonds { assembly, pool } = &mut *bonds;
            let forces =
                pool.install(|| assembly.solver.record(&mut assembly.state)).map_err(|error| error.to_string())?;
            let state = &assembly.state;
            let count = state.particles.len();
            let (intact, sums) = losses_of_strength(state, crack_onset);
            let contacts = forces.contacts.set(&state.particles).map_err(|error| error.to_string())?;
            let stress = ParticleVolume::Packing(0.62)
                .of(&state.particles.radius)
                .and_then(|volumes| particle_stress(&contacts, &LoadSet::none(), Partition::HalfBranch, &volumes))
                .map_err(|error| error.to_string())?;
            let (damage, lost) = (slice_mut(damage, count), slice_mut(lost, count));
            let stress_of = slice_mut(stress_of, count);
            for p in 0..count {
                let broken = assembly.losses[p];
                let total = intact[p] + broken;
                damage[p] = if total > 0 { (sums[p] + f64::from(broken)) / f64::from(total) } else { 0.0 };
                lost[p] = broken;
                stress_of[p] = row_by_row(&((stress[p] + stress[p].transpose()) * 0.5));
            }
            Ok::<_, String>(0)
        })
    }
}
