//! The network of a fix: creation, steps, and exchange between processors.

// Called from C++ with the shim's pointers; `abi.h` documents their lengths.
#![allow(unsafe_code, clippy::missing_safety_doc)]

use std::ffi::{CStr, c_char, c_void};

use concordem_c_abi::{Message, guarded, length_of, slice, slice_mut};

use super::atoms::AtomArrays;
use super::guarded_with_line;
use crate::atoms::{Atoms, Tags};
use crate::bond_list::BondOfList;
use crate::law_names;
use crate::network::{BondsOfAtom, Exclusions, NeighborLists, Network, Rules};
use crate::options::{Creation, Options, Units};

/// Settings and sizes that the shim needs.
#[repr(C)]
#[derive(Debug)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct Facts {
    /// Reals stored per atom.
    atom_width: i32,
    /// How many of these reals ghosts need in every step; they come last. At rebuilds, ghosts also need the one before.
    communicated: i32,
    /// How bonds are created. 0: not at all, 1: by distance, 2: from a list, 3: within inserted clumps.
    creation: i32,
    /// Whether to sum stored energies at every step.
    sample_every_step: i32,
    /// Reals in the record of a bond or contact.
    record_reals: i32,
    /// Place of the temperature among the reals of an atom; −1 without heat conduction.
    temperature: i32,
    /// Number of groups that the tables of heat conduction name.
    heat_groups: i32,
    /// Whether there is a file of `heat_network`.
    heat_network: i32,
    /// Length of the name of the data file to continue with, bytes; 0: none.
    state_length: i32,
    /// Whether the script names a contact law, possibly `none`.
    contact_given: i32,
    /// Whether contacts follow the exclusions of the host: 1 yes, 0 no, −1 if the script does not say.
    follows_exclusions: i32,
    /// Name of the contact law, padded with zeros.
    contacts: [c_char; 32],
    /// Step at which bonds are created; negative: the first step.
    at: i64,
    /// Bonds join atoms closer than this factor times the sum of their radii.
    factor: f64,
    /// Reach given by the user, m; 0: none.
    reach: f64,
    /// Temperature at which bonds have their reference lengths, K; 0 without heat conduction.
    reference_temperature: f64,
}

/// Create a network from the `count` script arguments after the style name. `si`: whether the host has SI units. Returns null and a message if
/// the arguments are invalid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_new(
    words: *const *const c_char,
    count: i32,
    types: i32,
    si: i32,
    facts: *mut Facts,
    message: *const Message,
) -> *mut Network {
    // MPI provides the parallelism: one thread per processor.
    let _ = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global();
    let mut made = std::ptr::null_mut();
    // SAFETY: `count` zero-terminated strings; `facts` and `message` belong to the shim.
    unsafe {
        let words: Vec<String> =
            slice(words, count).iter().map(|&word| CStr::from_ptr(word).to_string_lossy().into_owned()).collect();
        guarded(message, || {
            let units = if si != 0 { Units::Si } else { Units::Consistent };
            let options = Options::parse(&words, length_of(types), units).map_err(|error| error.to_string())?;
            let network = Network::new(options).map_err(|error| error.to_string())?;
            let options = network.options();
            let (creation, factor) = match &options.creation {
                Creation::None => (0, 0.0),
                Creation::Distance(factor) => (1, *factor),
                Creation::List(_) => (2, 0.0),
                Creation::Clumps(factor) => (3, *factor),
            };
            *facts = Facts {
                atom_width: network.atom_width() as i32,
                communicated: network.communicated() as i32,
                creation,
                sample_every_step: i32::from(options.sample_every_step),
                record_reals: network.record_reals() as i32,
                temperature: network.temperature_place().map_or(-1, |place| place as i32),
                heat_groups: network.heat_groups().len() as i32,
                heat_network: i32::from(options.heat.as_ref().is_some_and(|heat| heat.network.is_some())),
                state_length: options.state.as_ref().map_or(0, |name| name.len() as i32),
                contact_given: i32::from(options.contact_given),
                follows_exclusions: options.follows_exclusions.map_or(-1, i32::from),
                contacts: law_names::padded(options.contact.key()),
                at: options.at.unwrap_or(-1),
                factor,
                reach: options.reach,
                reference_temperature: network.reference_temperature(),
            };
            made = Box::into_raw(Box::new(network));
            Ok::<_, String>(0)
        });
    }
    made
}

/// Write the name of the data file to continue with to `name`, `Facts::state_length` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_state_file(network: *const Network, name: *mut c_char) {
    // SAFETY: `name` has that length.
    unsafe {
        let Some(file) = &(*network).options().state else { return };
        std::ptr::copy_nonoverlapping(file.as_ptr(), name.cast(), file.len());
    }
}

/// Delete a network.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_delete(network: *mut Network) {
    if !network.is_null() {
        // SAFETY: created by `concordem_network_new`, deleted once.
        drop(unsafe { Box::from_raw(network) });
    }
}

/// Initialize the data of a new atom, `ConcordemFacts::atom_width` reals. `mask`: bits of its groups.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_initial_memory(network: *const Network, mask: i32, memory: *mut f64) {
    // SAFETY: `atom_width` reals.
    unsafe { (*network).initial_memory(mask, slice_mut(memory, (*network).atom_width())) }
}

/// Give new owned atoms their place in the order of the particles. The shim must then update the ghosts, with the real before
/// `ConcordemFacts::communicated`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_place_new(network: *const Network, atoms: *const AtomArrays) {
    // SAFETY: valid pointers from the shim.
    unsafe { (*network).place_new(&mut (*atoms).view()) }
}

/// The host's bond lists of the owned atoms.
#[repr(C)]
#[derive(Debug)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct BondLists {
    /// Number of bonds of each atom.
    numbers: *const i32,
    /// Ids of the partners of each atom, as wide as those of the atoms.
    partners: *const *const c_void,
    /// Types of the bonds of each atom; one that is not positive does not count.
    types: *const *const i32,
}

impl BondLists {
    unsafe fn view<'a>(&self, atoms: &Atoms<'_>) -> Vec<BondsOfAtom<'a>> {
        // SAFETY: as many lists as owned atoms, with the lengths in `numbers`.
        let of_atom = |i: usize| unsafe {
            let count = length_of(*self.numbers.add(i));
            // Without bonds, the arrays need not exist.
            let (partners, types) = if count == 0 {
                (std::ptr::null(), std::ptr::null())
            } else {
                (*self.partners.add(i), *self.types.add(i))
            };
            let partners = match atoms.tag {
                Tags::Wide(_) => Tags::Wide(slice(partners.cast(), count)),
                Tags::Narrow(_) => Tags::Narrow(slice(partners.cast(), count)),
            };
            BondsOfAtom { tag: atoms.tag.get(i), partners, types: slice(types, count) }
        };
        (0..atoms.owned).map(of_atom).collect()
    }
}

/// Rebuild the lists of bonds and contacts after atoms have migrated. `lists`: the host's bond lists, if bonds follow them, else null.
/// `skin`, `cutoff`, `mean_radius` (of the bonded atoms) in m. Returns 0, or −1 and a message.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_rebuild(
    network: *mut Network,
    atoms: *const AtomArrays,
    lists: *const BondLists,
    skin: f64,
    cutoff: f64,
    mean_radius: f64,
    message: *const Message,
) -> i64 {
    // SAFETY: valid pointers from the shim.
    unsafe {
        guarded(message, || {
            let mut atoms = (*atoms).view();
            let lists = lists.as_ref().map(|lists| lists.view(&atoms));
            (*network).rebuild(&mut atoms, skin, cutoff, mean_radius, lists.as_deref()).map(|()| 0)
        })
    }
}

/// Read the next bonds of the user's list, at most `capacity`, on one processor. Returns their number, 0 at the end of the file, or −1 and a
/// message.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_read_bond_list(
    network: *mut Network,
    bonds: *mut BondOfList,
    capacity: i64,
    message: *const Message,
) -> i64 {
    // SAFETY: room for `capacity` bonds.
    unsafe { guarded(message, || (*network).read_bond_list(slice_mut(bonds, capacity)).map(|count| count as i64)) }
}

/// Keep `count` bonds of the user's list on this processor.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_keep_listed(network: *mut Network, bonds: *const BondOfList, count: i64) {
    // SAFETY: `count` bonds.
    unsafe { (*network).keep_listed(slice(bonds, count)) }
}

/// All bonds of the user's list that this processor keeps are here. Returns 0; or −1 and a message if two lines have the same bond, and sets
/// `line` to the lowest second one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_sort_listed(
    network: *mut Network,
    line: *mut i64,
    message: *const Message,
) -> i64 {
    // SAFETY: valid pointers from the shim.
    unsafe { guarded_with_line(message, line, || (*network).sort_listed()) }
}

/// Number of bonds of the user's list that this processor keeps. Writes them to `bonds` unless it is null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_listed(network: *const Network, bonds: *mut BondOfList) -> i64 {
    // SAFETY: `bonds` has the size that an earlier call returned.
    unsafe {
        let listed = (*network).listed();
        if !bonds.is_null() {
            slice_mut(bonds, listed.len()).copy_from_slice(listed);
        }
        listed.len() as i64
    }
}

/// Queue `count` bonds of the user's list for the next rebuild, and forget those that this processor kept.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_make_listed(network: *mut Network, bonds: *const BondOfList, count: i64) {
    // SAFETY: `count` bonds.
    unsafe { (*network).make_listed(slice(bonds, count)) }
}

/// Queue the bonds of the host's lists for the next rebuild.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_make_of_lists(
    network: *mut Network,
    atoms: *const AtomArrays,
    lists: *const BondLists,
) {
    // SAFETY: valid pointers from the shim.
    unsafe { (*network).make_of_lists(&(*lists).view(&(*atoms).view())) }
}

/// Queue the bonds that another command added to the atoms' lists for the next rebuild. Returns their number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_make_added(network: *mut Network) -> i64 {
    // SAFETY: valid pointers from the shim.
    unsafe { (*network).make_added() as i64 }
}

/// Number of atoms with a queued bond. Writes their ids in ascending order to `ids` unless it is null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_queued_atoms(network: *const Network, ids: *mut i64) -> i64 {
    // SAFETY: `ids` has the size that an earlier call returned.
    unsafe {
        let queued = (*network).queued_atoms();
        if !ids.is_null() {
            slice_mut(ids, queued.len()).copy_from_slice(&queued);
        }
        queued.len() as i64
    }
}

/// A number that increases whenever the bonds or the numbers of atoms change.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_generation(network: *const Network) -> i64 {
    // SAFETY: valid pointers from the shim.
    unsafe { (*network).generation() }
}

/// Set what the next rebuild takes out of the unbonded contacts: rules for each of `count` atoms (0: no rules), and `pair_count` pairs of ids.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_exclude(
    network: *mut Network,
    rules: *const Rules,
    count: i64,
    pairs: *const [i64; 2],
    pair_count: i64,
) {
    // SAFETY: these lengths.
    unsafe {
        let (rules, pairs) = (slice(rules, count as usize), slice(pairs, pair_count as usize));
        (*network).exclude(Exclusions { rules: rules.to_vec(), pairs: pairs.to_vec() });
    }
}

/// By how much radii may have grown since the last rebuild at most, m.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_grown(network: *const Network) -> f64 {
    // SAFETY: a valid pointer from the shim.
    unsafe { (*network).grown() }
}

/// Number of owned atoms that existed at the last rebuild.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_known(network: *const Network, atoms: *const AtomArrays) -> i64 {
    // SAFETY: valid pointers from the shim.
    unsafe { (*network).known(&(*atoms).view()) as i64 }
}

/// Number of atoms that owned atoms are bonded to or touch, and that are neither owned nor ghosts. Writes their ids in ascending order to
/// `ids` unless it is null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_absent(
    network: *const Network,
    atoms: *const AtomArrays,
    ids: *mut i64,
) -> i64 {
    // SAFETY: `ids` has the size that an earlier call returned.
    unsafe {
        let absent = (*network).absent(&(*atoms).view());
        if !ids.is_null() {
            slice_mut(ids, absent.len()).copy_from_slice(&absent);
        }
        absent.len() as i64
    }
}

/// Drop the bonds and contacts of `count` atoms that no longer exist at the next rebuild. `ids`: ascending. Returns the number of bonds
/// between them and an owned atom.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_forget(
    network: *mut Network,
    atoms: *const AtomArrays,
    ids: *const i64,
    count: i64,
) -> i64 {
    // SAFETY: `count` ids.
    unsafe { (*network).forget(&(*atoms).view(), slice(ids, count as usize)) as i64 }
}

/// A time step for which the bonds and contacts of this processor are stable, s: the largest one if `dt` is larger than a quick estimate.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_stable_step(network: *mut Network, dt: f64) -> f64 {
    // SAFETY: a valid pointer from the shim.
    unsafe { (*network).stable_step(dt) }
}

/// Neighbor lists of a pair style: `list` holds the indices of the `atoms` atoms that have one.
#[repr(C)]
#[derive(Debug)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct PairLists {
    atoms: i32,
    /// Bits of an entry that are the neighbor's index.
    index_bits: i32,
    list: *const i32,
    numbers: *const i32,
    neighbors: *const *const i32,
    /// Factors on the forces of a pair by the two upper bits of its entry.
    weights: [f64; 4],
}

/// Find the pairs of a pair style whose forces the network computes: with a contact law all pairs of the group, else the bonded ones.
/// Sets their `marks` (one per entry, in order, at least `capacity`) to 1 unless it is null. Sets `first` to the ids of the first
/// pair; returns the number of pairs.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_own_pairs(
    network: *mut Network,
    atoms: *const AtomArrays,
    lists: *const PairLists,
    marks: *mut u8,
    capacity: i64,
    first: *mut i64,
) -> i64 {
    // SAFETY: the host's neighbor lists; `capacity` marks; two ids.
    unsafe {
        let l = &*lists;
        let lists = slice(l.list, l.atoms)
            .iter()
            .map(|&i| (i as usize, slice(*l.neighbors.add(i as usize), *l.numbers.add(i as usize))))
            .collect();
        let lists = NeighborLists { lists, index_bits: l.index_bits, weights: l.weights };
        let marks = if marks.is_null() { &mut [] } else { slice_mut(marks, capacity) };
        let (count, pair) = (*network).own_pairs(&(*atoms).view(), &lists, marks);
        slice_mut(first, 2).copy_from_slice(&pair);
        count as i64
    }
}

/// Number of bonds that broke in the last force computation. Sets `pairs` to their atom ids, the lower one first, valid until the next
/// computation.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_broken_now(network: *const Network, pairs: *mut *const [i64; 2]) -> i64 {
    // SAFETY: valid pointers from the shim.
    unsafe {
        let broken = (*network).broken_now();
        *pairs = broken.as_ptr();
        broken.len() as i64
    }
}

/// Queue bonds by distance (`bond distance FACTOR`), or with `limit` the pairs among which to choose. Returns 0, or −1 and a message.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_make_near(network: *mut Network, message: *const Message) -> i64 {
    // SAFETY: valid pointers from the shim.
    unsafe { guarded(message, || (*network).make_near().map(|()| 0)) }
}

/// With `bond clumps FACTOR`: queue bonds within clumps; `clump`: a number per atom of the host (`count`), equal within a clump, 0 outside. Returns
/// the number of bonds, or −1 and a message.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_make_clumps(
    network: *mut Network,
    clump: *const f64,
    count: i64,
    message: *const Message,
) -> i64 {
    // SAFETY: valid pointers from the shim.
    unsafe { guarded(message, || (*network).make_clumps(slice(clump, count)).map(|bonds| bonds as i64)) }
}

/// With `limit`: set the ids that owned atoms name as partners, 0 for none, one real per atom and ghost. Returns the number of undecided pairs.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_name_partners(network: *const Network, named: *mut f64, count: i64) -> i64 {
    // SAFETY: valid pointers from the shim.
    unsafe { (*network).name_partners(slice_mut(named, count)) as i64 }
}

/// Queue the bonds of atoms that name each other; `named` as above, of ghosts too.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_bond_named(network: *mut Network, named: *const f64, count: i64) {
    // SAFETY: valid pointers from the shim.
    unsafe { (*network).bond_named(slice(named, count)) }
}

/// Rotate owned atoms by the angular velocity of the step.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_turn(network: *const Network, atoms: *const AtomArrays) {
    // SAFETY: valid pointers from the shim.
    unsafe { (*network).rotate(&mut (*atoms).view()) }
}

/// Compute forces at the current positions and add them to the atoms' forces. `setup`: nothing moves. `sample`: sum stored energies.
/// `record`: keep the force of every contact. Returns 0, or −1 and a message.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_forces(
    network: *mut Network,
    atoms: *const AtomArrays,
    setup: i32,
    sample: i32,
    record: i32,
    message: *const Message,
) -> i64 {
    // SAFETY: valid pointers from the shim.
    unsafe {
        guarded(message, || (*network).forces(&mut (*atoms).view(), setup != 0, sample != 0, record != 0).map(|()| 0))
    }
}

/// Largest number of reals that [`concordem_network_pack`] writes for an atom.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_largest_pack(network: *const Network) -> i64 {
    // SAFETY: valid pointers from the shim.
    unsafe { (*network).largest_pack() as i64 }
}

/// Number of reals in the records of atom `tag`. Writes them to `buffer` if it is not null and `capacity` is large enough. `leaves`:
/// the atom leaves this processor.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_pack(
    network: *mut Network,
    tag: i64,
    leaves: i32,
    buffer: *mut f64,
    capacity: i64,
) -> i64 {
    let mut reals = Vec::new();
    // SAFETY: valid pointers from the shim.
    unsafe {
        (*network).pack(tag, leaves != 0, &mut reals);
        if !buffer.is_null() && reals.len() as i64 <= capacity {
            slice_mut(buffer, reals.len()).copy_from_slice(&reals);
        }
    }
    reals.len() as i64
}

/// Read the records that [`concordem_network_pack`] wrote. Returns 0, or −1 and a message.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_unpack(
    network: *mut Network,
    tag: i64,
    buffer: *const f64,
    count: i64,
    message: *const Message,
) -> i64 {
    // SAFETY: `count` reals.
    unsafe { guarded(message, || (*network).unpack(tag, slice(buffer, count)).map(|()| 0)) }
}

/// Make room for `count` reals of a restart file.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_reserve_restored(network: *mut Network, count: i64) {
    // SAFETY: valid pointers from the shim.
    unsafe { (*network).reserve_restored(length_of(count)) }
}

/// Keep records of a restart file that came with atom `tag`; they may be of any atoms. Returns 0, or −1 and a message.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_restore(
    network: *mut Network,
    tag: i64,
    buffer: *const f64,
    count: i64,
    message: *const Message,
) -> i64 {
    // SAFETY: `count` reals.
    unsafe { guarded(message, || (*network).restore(tag, slice(buffer, count)).map(|()| 0)) }
}

/// Keep a record of a data file, `ConcordemFacts::record_reals` reals. Returns 0, or −1 and a message.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_restore_row(
    network: *mut Network,
    row: *const f64,
    message: *const Message,
) -> i64 {
    // SAFETY: `record_reals` reals.
    unsafe { guarded(message, || (*network).restore_row(slice(row, (*network).record_reals())).map(|()| 0)) }
}

/// Number of records that are kept.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_restored(network: *const Network) -> i64 {
    // SAFETY: valid pointers from the shim.
    unsafe { (*network).restored() as i64 }
}

/// Number of reals of the kept record at the place `at` (the sum of these numbers of those before); 0 at the end. Sets `ids` to its
/// two atoms, and `reals` to its reals, which are valid until [`concordem_network_drop_restored`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_next_restored(
    network: *const Network,
    at: i64,
    ids: *mut i64,
    reals: *mut *const f64,
) -> i64 {
    // SAFETY: two ids, and a pointer.
    unsafe {
        let Some((tags, found)) = (*network).next_restored(at as usize) else { return 0 };
        slice_mut(ids, 2).copy_from_slice(&tags);
        *reals = found.as_ptr();
        found.len() as i64
    }
}

/// Forget the records that are kept.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_drop_restored(network: *mut Network) {
    // SAFETY: valid pointers from the shim.
    unsafe { (*network).drop_restored() }
}

/// Take records for the next rebuild. Returns 0, or −1 and a message.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_deliver(
    network: *mut Network,
    buffer: *const f64,
    count: i64,
    message: *const Message,
) -> i64 {
    // SAFETY: `count` reals.
    unsafe { guarded(message, || (*network).deliver(slice(buffer, count)).map(|()| 0)) }
}

/// Take all records that are kept for the next rebuild, if there are no other processors.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_deliver_here(network: *mut Network) {
    // SAFETY: valid pointers from the shim.
    unsafe { (*network).deliver_here() }
}

/// Set `ends` to the numbers of bonds whose lower id, and whose higher id, belongs to an atom that this processor owns at present. Summed
/// over all processors they are equal, unless a bonded atom is gone.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_owned_ends(
    network: *const Network,
    atoms: *const AtomArrays,
    ends: *mut i64,
) {
    // SAFETY: two numbers.
    unsafe { slice_mut(ends, 2).copy_from_slice(&(*network).owned_ends(&(*atoms).view()).map(|count| count as i64)) }
}

/// Share all records that are to be stored by this processor among its atoms. Sets `most` to the most reals of an atom. Returns the
/// number of records, or −1 and a message.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_begin_restart(
    network: *mut Network,
    atoms: *const AtomArrays,
    most: *mut i64,
    message: *const Message,
) -> i64 {
    // SAFETY: valid pointers from the shim.
    unsafe {
        guarded(message, || {
            (*network).begin_restart(&(*atoms).view()).map(|[count, reals]| {
                *most = reals as i64;
                count as i64
            })
        })
    }
}

/// Number of reals that atom `i` of the host takes into the restart file.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_restart_length(network: *const Network, i: i64) -> i64 {
    // SAFETY: a valid pointer from the shim.
    unsafe { (*network).restart_length(i as usize) as i64 }
}

/// Set `reals` to those that atom `i` of the host takes into the restart file; they are valid until the next call. Returns their number, or
/// −1 and a message.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_restart_piece(
    network: *mut Network,
    i: i64,
    reals: *mut *const f64,
    message: *const Message,
) -> i64 {
    // SAFETY: valid pointers from the shim.
    unsafe {
        guarded(message, || {
            (*network).restart_piece(i as usize).map(|piece| {
                *reals = piece.as_ptr();
                piece.len() as i64
            })
        })
    }
}

/// Forget the shares of the atoms.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_end_restart(network: *mut Network) {
    // SAFETY: valid pointers from the shim.
    unsafe { (*network).end_restart() }
}

/// All records that are to be stored by this processor, `ConcordemFacts::record_reals` reals each. Free them with
/// `concordem_records_delete`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_counted_rows(
    network: *const Network,
    atoms: *const AtomArrays,
    count: *mut i64,
) -> *mut f64 {
    // SAFETY: valid pointers from the shim.
    unsafe {
        let rows = (*network).counted_rows(&(*atoms).view()).into_boxed_slice();
        *count = (rows.len() / (*network).record_reals()) as i64;
        Box::into_raw(rows).cast()
    }
}
