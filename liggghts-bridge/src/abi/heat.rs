//! Heat conduction of a network.

// Called from C++ with the shim's pointers; `abi.h` documents their lengths.
#![allow(unsafe_code, clippy::missing_safety_doc)]

use std::ffi::c_char;

use concordem_c_abi::{Message, guarded, slice, slice_mut};

use super::atoms::AtomArrays;
use crate::network::Network;

/// Length of the name of group `k` of the tables of heat conduction. Writes it to `name` unless it is null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_heat_group(network: *const Network, k: i32, name: *mut c_char) -> i64 {
    // SAFETY: `name` has the length that an earlier call returned.
    unsafe {
        let group = &(*network).heat_groups()[k as usize];
        if !name.is_null() {
            std::ptr::copy_nonoverlapping(group.as_ptr(), name.cast(), group.len());
        }
        group.len() as i64
    }
}

/// Set the bits of the groups of the tables of heat conduction, `ConcordemFacts::heat_groups` numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_set_heat_groups(network: *mut Network, bits: *const i32) {
    // SAFETY: one number per group.
    unsafe {
        let count = (*network).heat_groups().len();
        (*network).set_heat_groups(slice(bits, count));
    }
}

/// Number of owned atoms in group `k`. Writes their volumes (m³) to `volumes` unless it is null. Returns −1 if no source heats the group.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_heat_volumes(
    network: *const Network,
    atoms: *const AtomArrays,
    k: i32,
    volumes: *mut f64,
) -> i64 {
    // SAFETY: `volumes` has the size that an earlier call returned.
    unsafe {
        if !(*network).heated_groups().contains(&(k as usize)) {
            return -1;
        }
        let found = (*network).heat_volumes(&(*atoms).view(), k as usize);
        if !volumes.is_null() {
            slice_mut(volumes, found.len()).copy_from_slice(&found);
        }
        found.len() as i64
    }
}

/// Set the volume of all atoms of group `k`, m³.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_set_heat_volume(network: *mut Network, k: i32, volume: f64) {
    // SAFETY: valid pointers from the shim.
    unsafe { (*network).set_heat_volume(k as usize, volume) }
}

/// Write the numbers of atoms and bonds in the file of `heat_network`, and of those that this processor counts: 4 reals; zeros without
/// a file.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_heat_counts(network: *const Network, counts: *mut f64) {
    // SAFETY: 4 reals.
    unsafe { slice_mut(counts, 4).copy_from_slice(&(*network).heat_network_counts()) }
}

/// Fail if the time step (s) is beyond the bound of heat conduction. Returns 0, or −1 and a message.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_check_heat_step(
    network: *const Network,
    dt: f64,
    message: *const Message,
) -> i64 {
    // SAFETY: valid pointers from the shim.
    unsafe { guarded(message, || (*network).check_heat_step(dt).map(|()| 0)) }
}

/// Conduct heat for one time step. Returns 0, or −1 and a message.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_conduct(
    network: *mut Network,
    atoms: *const AtomArrays,
    message: *const Message,
) -> i64 {
    // SAFETY: valid pointers from the shim.
    unsafe { guarded(message, || (*network).conduct(&mut (*atoms).view()).map(|()| 0)) }
}

/// Set the temperature (K) of the owned atoms with the bit of a group.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_set_temperature(
    network: *mut Network,
    atoms: *const AtomArrays,
    bit: i32,
    temperature: f64,
) {
    // SAFETY: valid pointers from the shim.
    unsafe { (*network).set_temperature(&mut (*atoms).view(), bit, temperature) }
}
