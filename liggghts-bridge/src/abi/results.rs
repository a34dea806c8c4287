//! Results of a network: sums, virial, stress, rows, records.

// Called from C++ with the shim's pointers; `abi.h` documents their lengths.
#![allow(unsafe_code, clippy::missing_safety_doc)]

use concordem_c_abi::{Message, guarded, length_of, slice, slice_mut};
use concordem_contact::math::{Mat3, Vec3};
use concordem_operator::stress::{ParticleVolume, Partition, axial};

use crate::network::{self, Network};

/// Number of reals in [`concordem_network_sums`].
pub const SUMS: usize = 15;
/// Place of the length of the longest bond among them, m; the others are to be summed over processors.
pub const LONGEST: usize = 11;
/// Number of reals in [`concordem_network_totals`].
pub const TOTALS: usize = 12;
/// Number of reals per row of [`concordem_network_take_breaks`].
pub const BREAK: usize = 12;
/// Number of reals per row of [`concordem_network_rows`].
pub const ROW: usize = 16;
/// Number of reals per line of [`concordem_network_lines`].
pub const LINE: usize = 19;

// cbindgen needs literal numbers.
const _: () =
    assert!(TOTALS == network::TOTALS && ROW == Network::ROW && LINE == Network::LINE && BREAK == network::BREAK);

/// Add the virial (J; xx, yy, zz, xy, xz, yz) to `total`, and the share of each of `count` atoms to `per_atom` unless it is null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_virial(
    network: *const Network,
    total: *mut f64,
    per_atom: *mut f64,
    count: i64,
) {
    // SAFETY: lengths as documented.
    unsafe {
        let virial = (*network).virial(slice_mut(per_atom, 6 * length_of(count)));
        for (sum, more) in slice_mut(total, 6).iter_mut().zip(virial) {
            *sum += more;
        }
    }
}

/// Write the stress (Pa, nine reals) of each of `count` atoms at `step` to `per_atom`. Each atom gets half of every branch vector
/// (`half_branch`) or the part up to the contact point. Its volume is that of the sphere, divided by the solid fraction `fraction`
/// unless that is 0. Returns 0, or −1 and a message.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_stress(
    network: *const Network,
    step: i64,
    half_branch: i32,
    fraction: f64,
    per_atom: *mut f64,
    count: i64,
    message: *const Message,
) -> i64 {
    let partition = if half_branch != 0 { Partition::HalfBranch } else { Partition::ContactPoint };
    let volume = if fraction == 0.0 { ParticleVolume::Sphere } else { ParticleVolume::Packing(fraction) };
    // SAFETY: nine reals per atom.
    unsafe {
        guarded(message, || {
            (*network).stress(step, partition, volume, slice_mut(per_atom, 9 * length_of(count))).map(|()| 0)
        })
    }
}

/// Write the sums for [`concordem_couple_of_sums`] at `step`: 18 reals, to be summed over processors. Returns 0, or −1 and a message.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_couple_sums(
    network: *const Network,
    step: i64,
    sums: *mut f64,
    message: *const Message,
) -> i64 {
    // SAFETY: 18 reals.
    unsafe {
        guarded(message, || {
            (*network).couple_sums(step).map(|found| {
                slice_mut(sums, 18).copy_from_slice(&found);
                0
            })
        })
    }
}

/// Couple stress about `centroid` (m), then stress, from the sums over all processors ([`concordem_network_couple_sums`]):
/// `μ = M/V + x⁰⊗(1×σ)` (Stránský 2018, (4.57)). `result`: nine reals in N/m, then nine in Pa. `volume` in m³.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_couple_of_sums(
    sums: *const f64,
    volume: f64,
    centroid: *const f64,
    result: *mut f64,
) {
    // SAFETY: 18, 3, 18 reals.
    unsafe {
        let sums = slice(sums, 18);
        let stress = Mat3::from_row_slice(&sums[..9]) / volume;
        let couple = Mat3::from_row_slice(&sums[9..]) / volume;
        let couple = couple + Vec3::from_column_slice(slice(centroid, 3)) * axial(&stress).transpose();
        let result = slice_mut(result, 18);
        result[..9].copy_from_slice(couple.transpose().as_slice());
        result[9..].copy_from_slice(stress.transpose().as_slice());
    }
}

/// Write sums over the contacts that this processor counts, [`SUMS`] reals; number [`LONGEST`] is the length of the longest bond, m.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_sums(network: *const Network, sums: *mut f64) {
    // SAFETY: `SUMS` reals.
    unsafe {
        let s = (*network).sums();
        let all: [f64; SUMS] = [
            s.bonds,
            s.broken,
            s.contacts,
            s.stored[0],
            s.stored[1],
            s.stored[2],
            s.stored[3],
            s.dissipated[0],
            s.dissipated[1],
            s.dissipated[2],
            s.integration,
            s.longest,
            s.heat[0],
            s.heat[1],
            s.heat[2],
        ];
        slice_mut(sums, all.len()).copy_from_slice(&all);
    }
}

/// Write the number of bonds whose first atom, and the number of those whose second atom, this processor owns: 2 reals.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_ends(network: *const Network, ends: *mut f64) {
    // SAFETY: 2 reals.
    unsafe { slice_mut(ends, 2).copy_from_slice(&(*network).ends()) }
}

/// Write totals for a restart file, [`TOTALS`] reals. Returns the step whose forces are stored, −1 if there is none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_totals(network: *const Network, totals: *mut f64) -> i64 {
    // SAFETY: `TOTALS` reals.
    unsafe {
        slice_mut(totals, TOTALS).copy_from_slice(&(*network).totals());
        (*network).found_at().unwrap_or(-1)
    }
}

/// Continue from a restart file. `totals`: [`TOTALS`] reals. `found_at`: the step whose forces the file contains, −1 if there is none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_resume(network: *mut Network, totals: *const f64, found_at: i64) {
    let mut all = [0.0; TOTALS];
    // SAFETY: `TOTALS` reals.
    unsafe {
        all.copy_from_slice(slice(totals, TOTALS));
        (*network).resume(&all, (found_at >= 0).then_some(found_at));
    }
}

/// Rows of the recorded contacts, [`ROW`] reals each. Free them with [`concordem_rows_delete`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_rows(network: *const Network, count: *mut i64) -> *mut f64 {
    // SAFETY: valid pointers from the shim.
    unsafe {
        let rows = (*network).rows().into_boxed_slice();
        *count = (rows.len() / ROW) as i64;
        Box::into_raw(rows).cast()
    }
}

/// Lines of the recorded contacts between atoms whose `mask`, one per atom of the host (`atoms`), has a bit of `group`; [`LINE`] reals each. Free
/// them with [`concordem_records_delete`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_lines(
    network: *const Network,
    mask: *const i32,
    atoms: i64,
    group: i32,
    count: *mut i64,
) -> *mut f64 {
    // SAFETY: valid pointers from the shim.
    unsafe {
        let lines = (*network).lines(slice(mask, length_of(atoms)), group).into_boxed_slice();
        *count = (lines.len() / LINE) as i64;
        Box::into_raw(lines).cast()
    }
}

/// Keep rows for [`concordem_network_take_breaks`] from now on.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_keep_breaks(network: *mut Network) {
    // SAFETY: a valid pointer from the shim.
    unsafe { (*network).keep_breaks() }
}

/// Rows of the bonds that broke since the last call, [`BREAK`] reals each. Free them with [`concordem_records_delete`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_take_breaks(network: *mut Network, count: *mut i64) -> *mut f64 {
    // SAFETY: valid pointers from the shim.
    unsafe {
        let rows = (*network).take_breaks().into_boxed_slice();
        *count = (rows.len() / BREAK) as i64;
        Box::into_raw(rows).cast()
    }
}

/// Free rows.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_rows_delete(rows: *mut f64, count: i64) {
    if !rows.is_null() {
        let length = length_of(count) * ROW;
        // SAFETY: allocated by `concordem_network_rows` with this count.
        drop(unsafe { Box::from_raw(std::ptr::slice_from_raw_parts_mut(rows, length)) });
    }
}

/// Records of all contacts, `length` reals each. Free them with [`concordem_records_delete`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_records(
    network: *const Network,
    count: *mut i64,
    length: *mut i64,
) -> *mut f64 {
    // SAFETY: valid pointers from the shim.
    unsafe {
        let reals = (*network).histories().into_boxed_slice();
        *length = (*network).record_reals() as i64;
        *count = reals.len() as i64 / *length;
        Box::into_raw(reals).cast()
    }
}

/// Free records.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_records_delete(reals: *mut f64, count: i64, length: i64) {
    if !reals.is_null() {
        let all = length_of(count * length);
        // SAFETY: allocated by `concordem_network_records` or `concordem_network_counted_rows` with these numbers.
        drop(unsafe { Box::from_raw(std::ptr::slice_from_raw_parts_mut(reals, all)) });
    }
}

/// Hash of the C header that this library was built with. The shim compares it to the hash of its own header.
#[unsafe(no_mangle)]
pub extern "C" fn concordem_header_hash() -> u64 {
    concordem_c_abi::header_hash(include_bytes!("../../shim/abi.h"))
}
