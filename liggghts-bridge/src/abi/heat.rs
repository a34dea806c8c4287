//! Heat conduction of a network.

// Called from C++ with the shim's pointers; `abi.h` documents their lengths.
#![allow(unsafe_code, clippy::missing_safety_doc)]

use std::ffi::c_char;

use concordem_c_abi::{Message, guarded, slice, slice_mut};

use super::atoms::AtomArrays;
use super::guarded_with_line;
use crate::heat_network::HeatEntry;
use crate::network::{Asked, Network};

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

/// Read the next atoms and bonds of the file of `heat_network`, at most `capacity`, on one processor. Returns their number, 0 at the end
/// of the file, or −1 and a message.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_read_heat_network(
    network: *mut Network,
    entries: *mut HeatEntry,
    capacity: i64,
    message: *const Message,
) -> i64 {
    // SAFETY: room for `capacity` entries.
    unsafe { guarded(message, || (*network).read_heat_network(slice_mut(entries, capacity)).map(|count| count as i64)) }
}

/// Keep `count` atoms and bonds of the file of `heat_network` on this processor.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_keep_heat_entries(
    network: *mut Network,
    entries: *const HeatEntry,
    count: i64,
) {
    // SAFETY: `count` entries.
    unsafe { (*network).keep_heat_entries(slice(entries, count)) }
}

/// All that this processor keeps of the file of `heat_network` is here. Returns 0; or −1 and a message if two lines have the same atom or
/// bond, and sets `line` to the lowest second one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_sort_heat_entries(
    network: *mut Network,
    line: *mut i64,
    message: *const Message,
) -> i64 {
    // SAFETY: valid pointers from the shim.
    unsafe { guarded_with_line(message, line, || (*network).sort_heat_entries()) }
}

/// Find `count` atoms and bonds, two `ids` each, among those that this processor keeps.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_heat_entries(
    network: *const Network,
    ids: *const [i64; 2],
    count: i64,
    entries: *mut HeatEntry,
) {
    // SAFETY: `count` ids, and room for as many entries.
    unsafe {
        let (ids, entries) = (slice(ids, count), slice_mut(entries, count));
        for (to, &ids) in entries.iter_mut().zip(ids) {
            *to = (*network).heat_entry(ids);
        }
    }
}

/// What a processor asks for, by its number in the shim ([`Asked`]).
fn asked_for(asked: i32) -> Asked {
    match asked {
        0 => Asked::NewAtoms,
        1 => Asked::Atoms,
        2 => Asked::NewBonds,
        3 => Asked::Bonds,
        // An error of the shim: the process ends here, since no panic may cross to C++.
        _ => std::process::abort(),
    }
}

/// Number of atoms or bonds that this processor asks for. 0: atoms without numbers of the file of `heat_network`; 1: all atoms, whose
/// numbers are compared; 2: bonds that the next rebuild creates; 3: all bonds, whose numbers are compared. Writes their ids to `ids` unless
/// it is null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_asked_heat_entries(
    network: *const Network,
    atoms: *const AtomArrays,
    asked: i32,
    ids: *mut [i64; 2],
) -> i64 {
    // SAFETY: `ids` has the size that an earlier call returned.
    unsafe {
        let found = (*network).asked_heat_entries(&(*atoms).view(), asked_for(asked));
        if !ids.is_null() {
            slice_mut(ids, found.len()).copy_from_slice(&found);
        }
        found.len() as i64
    }
}

/// Take `count` answers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_take_heat_entries(
    network: *mut Network,
    entries: *const HeatEntry,
    count: i64,
) {
    // SAFETY: `count` entries.
    unsafe { (*network).take_heat_entries(slice(entries, count)) }
}

/// All answers to what `concordem_network_asked_heat_entries` returned are here: use them, or compare them. Returns 0, or −1 and a message.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_use_heat_entries(
    network: *mut Network,
    atoms: *const AtomArrays,
    asked: i32,
    message: *const Message,
) -> i64 {
    // SAFETY: valid pointers from the shim.
    unsafe { guarded(message, || (*network).use_heat_entries(&mut (*atoms).view(), asked_for(asked)).map(|()| 0)) }
}

/// Drop the bonds of the file of `heat_network` that this processor keeps.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_drop_heat_bonds(network: *mut Network) {
    // SAFETY: valid pointers from the shim.
    unsafe { (*network).drop_heat_bonds() }
}

/// Write the numbers of atoms and bonds of the file of `heat_network` that this processor keeps, and of the atoms and bonds that it counts:
/// 4 numbers; zeros without a file.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_heat_counts(network: *const Network, counts: *mut i64) {
    // SAFETY: 4 numbers.
    unsafe { slice_mut(counts, 4).copy_from_slice(&(*network).heat_network_counts().map(|count| count as i64)) }
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
