//! Results per particle for YADE's `CpmState`.

#![allow(unsafe_code, clippy::missing_safety_doc)] // a C function

use concordem_c_abi::{Message, guarded, slice_mut};

use super::{Bonds, row_by_row};

/// Compute the attributes of `CpmState` for each particle: mean lost strength of its bonds (1 for one that ended), number of bonds
/// that broke and unbonded contacts that opened, and mean stress (Pa, nine reals, symmetric). Returns 0, or −1 and a message.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_bonds_particles(
    bonds: *const Bonds,
    damage: *mut f64,
    lost: *mut u32,
    stress_of: *mut [f64; 9],
    message: *const Message,
) -> i64 {
    // SAFETY: one entry per particle in each array.
    unsafe {
        guarded(message, || {
            let Bonds { assembly, pool } = &*bonds;
            let found = pool.install(|| assembly.particle_results()).map_err(|error| error.to_string())?;
            let count = found.damage.len();
            slice_mut(damage, count).copy_from_slice(&found.damage);
            slice_mut(lost, count).copy_from_slice(&found.lost);
            for (row, stress) in slice_mut(stress_of, count).iter_mut().zip(&found.stress) {
                *row = row_by_row(stress);
            }
            Ok::<_, String>(0)
        })
    }
}
