//! The functions that the C++ shim calls (`shim/abi.h`).
//!
//! Every function that can fail returns a negative number and leaves a message in the buffer it was given; none unwinds into
//! C++. Pointers come from LIGGGHTS' own arrays; their lengths are those that the shim states.

#![allow(unsafe_code, clippy::missing_safety_doc)]

use std::ffi::{CStr, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

use concordem_contact::math::{Mat3, Vec3};
use concordem_operator::stress::{ParticleVolume, Partition, axial};

use crate::atoms::Atoms;
use crate::host_laws::HostShear;
use crate::network::{Network, TOTALS};
use crate::options::{Creation, Options};
use crate::pair::{self, Neighbours, PairForce, PairLaw, Pass, Properties, WallContact};

/// Arrays of LIGGGHTS, see [`Atoms`]; `count` atoms with the copies.
#[repr(C)]
pub struct AtomArrays {
    owned: i32,
    count: i32,
    group: i32,
    memory_width: i32,
    tag: *const i32,
    kind: *const i32,
    mask: *const i32,
    position: *const f64,
    velocity: *const f64,
    spin: *const f64,
    radius: *const f64,
    mass: *const f64,
    force: *mut f64,
    torque: *mut f64,
    memory: *mut f64,
    edge: [f64; 3],
    dt: f64,
    step: i64,
}

/// What the shim has to know of the arguments.
#[repr(C)]
pub struct Facts {
    /// Reals remembered per atom.
    atom_width: i32,
    /// How many of them, the last ones, copies need.
    communicated: i32,
    /// 0: no bonds are made, 1: by distance, 2: from a list.
    creation: i32,
    /// Whether stored energies are wanted at every step.
    sample_every_step: i32,
    /// Law of atoms that touch without a bond, by number; 0: none.
    contacts: i32,
    /// Step at which bonds are made; negative: the first one.
    at: i64,
    /// Factor on the sum of radii.
    factor: f64,
    /// Reach that the user wants, m.
    reach: f64,
}

/// Where a message goes.
#[repr(C)]
pub struct Message {
    text: *mut c_char,
    capacity: usize,
}

impl Message {
    unsafe fn put(&self, text: &str) {
        if self.capacity == 0 {
            return;
        }
        let bytes = &text.as_bytes()[..text.len().min(self.capacity - 1)];
        // SAFETY: the shim gives a buffer of `capacity` bytes.
        unsafe {
            std::ptr::copy_nonoverlapping(bytes.as_ptr(), self.text.cast(), bytes.len());
            *self.text.add(bytes.len()) = 0;
        }
    }
}

/// Run `body`; −1 and a message if it fails or panics.
unsafe fn guarded<E: std::fmt::Display>(message: &Message, body: impl FnOnce() -> Result<i64, E>) -> i64 {
    let text = match catch_unwind(AssertUnwindSafe(body)) {
        Ok(Ok(value)) => return value,
        Ok(Err(error)) => error.to_string(),
        Err(panic) => {
            let what = panic.downcast_ref::<String>().map(String::as_str);
            let what = what.or(panic.downcast_ref::<&str>().copied()).unwrap_or("unknown");
            format!("internal error of concordem, please report it: {what}")
        }
    };
    // SAFETY: as the caller's.
    unsafe { message.put(&text) };
    -1
}

unsafe fn slice<'a, T>(pointer: *const T, length: usize) -> &'a [T] {
    // SAFETY: the shim passes arrays of LIGGGHTS of this length, or of none.
    if pointer.is_null() || length == 0 { &[] } else { unsafe { std::slice::from_raw_parts(pointer, length) } }
}

unsafe fn slice_mut<'a, T>(pointer: *mut T, length: usize) -> &'a mut [T] {
    // SAFETY: as `slice`; the arrays are distinct.
    if pointer.is_null() || length == 0 { &mut [] } else { unsafe { std::slice::from_raw_parts_mut(pointer, length) } }
}

impl AtomArrays {
    unsafe fn view<'a>(&self) -> Atoms<'a> {
        let (owned, count) = (self.owned as usize, self.count as usize);
        // SAFETY: lengths of LIGGGHTS' arrays; forces exist for owned atoms and copies alike, only owned are used.
        unsafe {
            Atoms {
                owned,
                tag: slice(self.tag, count),
                kind: slice(self.kind, count),
                mask: slice(self.mask, count),
                group: self.group,
                position: slice(self.position, 3 * count),
                velocity: slice(self.velocity, 3 * count),
                spin: slice(self.spin, 3 * count),
                radius: slice(self.radius, count),
                mass: slice(self.mass, count),
                force: slice_mut(self.force, 3 * owned),
                torque: slice_mut(self.torque, 3 * owned),
                memory: slice_mut(self.memory, self.memory_width as usize * count),
                edge: self.edge,
                dt: self.dt,
                step: self.step,
            }
        }
    }
}

/// A network from the words of the script after the style; null and a message if they make no sense.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_new(
    words: *const *const c_char,
    count: i32,
    types: i32,
    facts: *mut Facts,
    message: *const Message,
) -> *mut Network {
    // Each processor is one thread.
    let _ = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global();
    let mut made = std::ptr::null_mut();
    // SAFETY: `count` strings that end in zero; `facts` and `message` are the shim's.
    unsafe {
        let words: Vec<String> = slice(words, count as usize)
            .iter()
            .map(|&word| CStr::from_ptr(word).to_string_lossy().into_owned())
            .collect();
        guarded(&*message, || {
            let options = Options::parse(&words, types as usize).map_err(|error| error.to_string())?;
            let network = Network::new(options).map_err(|error| error.to_string())?;
            let options = network.options();
            let (creation, factor) = match &options.creation {
                Creation::None => (0, 0.0),
                Creation::Distance(factor) => (1, *factor),
                Creation::List(_) => (2, 0.0),
            };
            *facts = Facts {
                atom_width: network.atom_width() as i32,
                communicated: network.communicated() as i32,
                creation,
                sample_every_step: i32::from(options.sample_every_step),
                contacts: options.contact.number(),
                at: options.at.unwrap_or(-1),
                factor,
                reach: options.reach,
            };
            made = Box::into_raw(Box::new(network));
            Ok::<_, String>(0)
        });
    }
    made
}

/// The end of a network.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_delete(network: *mut Network) {
    if !network.is_null() {
        // SAFETY: made by `concordem_network_new`, deleted once.
        drop(unsafe { Box::from_raw(network) });
    }
}

/// [`Network::initial_memory`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_initial_memory(network: *const Network, memory: *mut f64) {
    // SAFETY: `atom_width` reals.
    unsafe { (*network).initial_memory(slice_mut(memory, (*network).atom_width())) }
}

/// [`Network::rebuild`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_rebuild(
    network: *mut Network,
    atoms: *const AtomArrays,
    skin: f64,
    cutoff: f64,
    mean_radius: f64,
    message: *const Message,
) -> i64 {
    // SAFETY: the shim's own structures.
    unsafe { guarded(&*message, || (*network).rebuild(&(*atoms).view(), skin, cutoff, mean_radius).map(|()| 0)) }
}

/// [`Network::make_listed`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_make_listed(network: *mut Network) {
    // SAFETY: the shim's own.
    unsafe { (*network).make_listed() }
}

/// [`Network::make_given`]: `count` pairs of ids.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_make_given(network: *mut Network, pairs: *const [i32; 2], count: i64) {
    // SAFETY: the shim's own, `count` pairs.
    unsafe { (*network).make_given(slice(pairs, count as usize)) }
}

/// [`Network::broken_now`]: `pairs` is set to where they are, until forces are found again; their number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_broken_now(network: *const Network, pairs: *mut *const [i32; 2]) -> i64 {
    // SAFETY: the shim's own.
    unsafe {
        let broken = (*network).broken_now();
        *pairs = broken.as_ptr();
        broken.len() as i64
    }
}

/// [`Network::virial`] added to `total`, six reals, and to `per_atom`, six reals for each of `count` atoms (null: none).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_virial(
    network: *const Network,
    total: *mut f64,
    per_atom: *mut f64,
    count: i64,
) {
    // SAFETY: the shim's own, lengths as stated.
    unsafe {
        let virial = (*network).virial(slice_mut(per_atom, 6 * count as usize));
        for (sum, more) in slice_mut(total, 6).iter_mut().zip(virial) {
            *sum += more;
        }
    }
}

/// [`Network::stress`] for `count` atoms of the host: `half_branch` or at the contact points; `fraction` 0: the volume of the
/// sphere, else that over this packing fraction.
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
        guarded(&*message, || {
            (*network).stress(step, partition, volume, slice_mut(per_atom, 9 * count as usize)).map(|()| 0)
        })
    }
}

/// [`Network::couple_sums`]: 18 reals.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_couple_sums(
    network: *const Network,
    step: i64,
    sums: *mut f64,
    message: *const Message,
) -> i64 {
    // SAFETY: 18 reals.
    unsafe {
        guarded(&*message, || {
            (*network).couple_sums(step).map(|found| {
                slice_mut(sums, 18).copy_from_slice(&found);
                0
            })
        })
    }
}

/// Couple stress (N/m) about `centroid` (m), then stress (Pa), nine reals each, from the sums of all processors
/// ([`Network::couple_sums`]): `μ = M/V + x⁰⊗(1×σ)` (Stránský 2018, (4.57)).
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

/// Ids of atoms in the list of bonds, ascending, each once; their number. With a null pointer only the number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_listed_atoms(network: *const Network, ids: *mut i32) -> i64 {
    // SAFETY: the shim's own; `ids` holds as many as an earlier call told.
    unsafe {
        let Creation::List(bonds) = &(*network).options().creation else { return 0 };
        let mut listed: Vec<i32> = bonds.iter().flat_map(|bond| bond.0).collect();
        listed.sort_unstable();
        listed.dedup();
        if !ids.is_null() {
            slice_mut(ids, listed.len()).copy_from_slice(&listed);
        }
        listed.len() as i64
    }
}

/// Longest of the listed bonds, m (present or rest length), when the listed atoms are at `positions`, as ordered by
/// [`concordem_network_listed_atoms`], and the box has periodic `edges` (0: not periodic).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_longest_listed(
    network: *const Network,
    positions: *const f64,
    edges: *const f64,
) -> f64 {
    // SAFETY: three reals per listed atom, three edges.
    unsafe {
        let Creation::List(bonds) = &(*network).options().creation else { return 0.0 };
        let mut listed: Vec<i32> = bonds.iter().flat_map(|bond| bond.0).collect();
        listed.sort_unstable();
        listed.dedup();
        let positions = slice(positions, 3 * listed.len());
        let edges = slice(edges, 3);
        let mut longest = 0.0_f64;
        for (tags, length) in bonds {
            let [a, b] = tags.map(|tag| listed.partition_point(|&t| t < tag));
            let squared: f64 = (0..3)
                .map(|k| {
                    let d = positions[3 * b + k] - positions[3 * a + k];
                    let d = if edges[k] > 0.0 { d - edges[k] * (d / edges[k]).round() } else { d };
                    d * d
                })
                .sum();
            longest = longest.max(squared.sqrt()).max(length.unwrap_or(0.0));
        }
        longest
    }
}

/// [`Network::make_near`]; the number of bonds counted here.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_make_near(network: *mut Network, message: *const Message) -> i64 {
    // SAFETY: the shim's own.
    unsafe { guarded(&*message, || (*network).make_near().map(|made| made as i64)) }
}

/// [`Network::turn`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_turn(network: *const Network, atoms: *const AtomArrays) {
    // SAFETY: the shim's own.
    unsafe { (*network).turn(&mut (*atoms).view()) }
}

/// [`Network::forces`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_forces(
    network: *mut Network,
    atoms: *const AtomArrays,
    setup: i32,
    sample: i32,
    record: i32,
    message: *const Message,
) -> i64 {
    // SAFETY: the shim's own.
    unsafe {
        guarded(&*message, || (*network).forces(&mut (*atoms).view(), setup != 0, sample != 0, record != 0).map(|()| 0))
    }
}

/// [`Network::largest_pack`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_largest_pack(network: *mut Network) -> i64 {
    // SAFETY: the shim's own.
    unsafe { (*network).largest_pack() as i64 }
}

/// [`Network::pack`] into `buffer` of `capacity` reals (null: only tell the number); the number of reals.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_pack(
    network: *mut Network,
    tag: i32,
    leaves: i32,
    buffer: *mut f64,
    capacity: i64,
) -> i64 {
    let mut reals = Vec::new();
    // SAFETY: the shim's own.
    unsafe {
        (*network).pack(tag, leaves != 0, &mut reals);
        if !buffer.is_null() && reals.len() as i64 <= capacity {
            slice_mut(buffer, reals.len()).copy_from_slice(&reals);
        }
    }
    reals.len() as i64
}

/// [`Network::unpack`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_unpack(
    network: *mut Network,
    tag: i32,
    buffer: *const f64,
    count: i64,
    message: *const Message,
) -> i64 {
    // SAFETY: `count` reals.
    unsafe { guarded(&*message, || (*network).unpack(tag, slice(buffer, count as usize)).map(|()| 0)) }
}

/// Sums of what is counted on this processor: 12 reals, and the longest bond last.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_sums(network: *const Network, sums: *mut f64) {
    // SAFETY: 12 reals.
    unsafe {
        let s = (*network).sums();
        let all = [
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
        ];
        slice_mut(sums, all.len()).copy_from_slice(&all);
    }
}

/// [`Network::ends`]: 2 reals.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_ends(network: *const Network, ends: *mut f64) {
    // SAFETY: 2 reals.
    unsafe { slice_mut(ends, 2).copy_from_slice(&(*network).ends()) }
}

/// [`Network::totals`], and the step whose forces are remembered (−1: none).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_totals(network: *const Network, totals: *mut f64) -> i64 {
    // SAFETY: `TOTALS` reals.
    unsafe {
        slice_mut(totals, TOTALS).copy_from_slice(&(*network).totals());
        (*network).found_at().unwrap_or(-1)
    }
}

/// [`Network::resume`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_resume(network: *mut Network, totals: *const f64, found_at: i64) {
    let mut all = [0.0; TOTALS];
    // SAFETY: `TOTALS` reals.
    unsafe {
        all.copy_from_slice(slice(totals, TOTALS));
        (*network).resume(&all, (found_at >= 0).then_some(found_at));
    }
}

/// [`Network::rows`]: a copy to be given back to [`concordem_rows_delete`]; `count` is set to the number of rows.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_rows(network: *const Network, count: *mut i64) -> *mut f64 {
    // SAFETY: the shim's own.
    unsafe {
        let rows = (*network).rows().into_boxed_slice();
        *count = (rows.len() / Network::ROW) as i64;
        Box::into_raw(rows).cast()
    }
}

/// Give rows back.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_rows_delete(rows: *mut f64, count: i64) {
    if !rows.is_null() {
        let length = count as usize * Network::ROW;
        // SAFETY: made by `concordem_network_rows` with this count.
        drop(unsafe { Box::from_raw(std::ptr::slice_from_raw_parts_mut(rows, length)) });
    }
}

/// [`Network::histories`]: a copy to be given back to [`concordem_records_delete`]; `count` is set to the number of records,
/// `length` to the reals of each.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_network_records(
    network: *const Network,
    count: *mut i64,
    length: *mut i64,
) -> *mut f64 {
    // SAFETY: the shim's own.
    unsafe {
        let reals = (*network).histories().into_boxed_slice();
        *length = (*network).record_reals() as i64;
        *count = reals.len() as i64 / *length;
        Box::into_raw(reals).cast()
    }
}

/// Give records back.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_records_delete(reals: *mut f64, count: i64, length: i64) {
    if !reals.is_null() {
        let all = (count * length) as usize;
        // SAFETY: made by `concordem_network_records` with these numbers.
        drop(unsafe { Box::from_raw(std::ptr::slice_from_raw_parts_mut(reals, all)) });
    }
}

/// Properties of types for [`concordem_pair_new`]; null where the model does not need them.
#[repr(C)]
pub struct PairProperties {
    types: i32,
    /// 0: off, 1: no history, 2: history.
    shear: i32,
    young: *const f64,
    poisson: *const f64,
    restitution: *const f64,
    friction: *const f64,
    stiffness: [*const f64; 4],
    velocity: f64,
}

/// A law of pairs behind the pointer.
pub struct BoxedPairLaw(Box<dyn PairLaw>);

/// The law of a model, by its number; null and a message if its parameters make no sense.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_pair_new(
    model: i32,
    properties: *const PairProperties,
    message: *const Message,
) -> *mut BoxedPairLaw {
    let mut made = std::ptr::null_mut();
    // SAFETY: `types` or `types`² reals behind each pointer that the model reads.
    unsafe {
        let p = &*properties;
        let n = p.types as usize;
        let shear = match p.shear {
            0 => HostShear::Off,
            1 => HostShear::NoHistory,
            _ => HostShear::History,
        };
        let all = Properties {
            types: n,
            young: slice(p.young, n),
            poisson: slice(p.poisson, n),
            restitution: slice(p.restitution, n * n),
            friction: slice(p.friction, n * n),
            stiffness: p.stiffness.map(|values| slice(values, n * n)),
            velocity: p.velocity,
        };
        guarded(&*message, || {
            made = Box::into_raw(Box::new(BoxedPairLaw(pair::law(model as usize, shear, &all)?)));
            Ok::<_, concordem_contact::law::ParameterError>(0)
        });
    }
    made
}

/// The end of a law.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_pair_delete(law: *mut BoxedPairLaw) {
    if !law.is_null() {
        // SAFETY: made by `concordem_pair_new`, deleted once.
        drop(unsafe { Box::from_raw(law) });
    }
}

/// Number of reals in the history of model `model`, and for each whether it changes its sign when the atoms are exchanged.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_pair_history(model: i32, odd: *mut i32, capacity: i32) -> i32 {
    // Any parameters will do: the history is the law's.
    let one = [1.0];
    let half = [0.5];
    let properties = Properties {
        types: 1,
        young: &one,
        poisson: &[0.0],
        restitution: &half,
        friction: &one,
        stiffness: [&one; 4],
        velocity: 1.0,
    };
    let Ok(law) = pair::law(model as usize, HostShear::History, &properties) else { return -1 };
    let fields = law.fields();
    // SAFETY: `capacity` integers.
    let odd = unsafe { slice_mut(odd, capacity as usize) };
    for (to, field) in odd.iter_mut().zip(&fields) {
        *to = i32::from(field.1);
    }
    fields.len() as i32
}

/// Neighbour lists and atoms of a pass.
#[repr(C)]
pub struct PairArrays {
    owned: i32,
    count: i32,
    atoms: i32,
    frozen: i32,
    advance: i32,
    stride: i32,
    list: *const i32,
    numbers: *const i32,
    neighbours: *const *const i32,
    flags: *const *mut i32,
    history: *const *mut f64,
    position: *const [f64; 3],
    velocity: *const [f64; 3],
    spin: *const [f64; 3],
    radius: *const f64,
    mass: *const f64,
    kind: *const i32,
    mask: *const i32,
    force: *mut [f64; 3],
    torque: *mut [f64; 3],
    dt: f64,
}

/// Forces of all pairs; with `record` the number of contacts, whose forces [`concordem_pair_recorded`] then shows.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_pair_compute(
    law: *const BoxedPairLaw,
    arrays: *const PairArrays,
    record: *mut Vec<PairForce>,
    message: *const Message,
) -> i64 {
    // SAFETY: LIGGGHTS' arrays: `count` atoms with copies, lists of `atoms` atoms, `numbers[i]` neighbours each, as many
    // flags, and `stride` reals of history for each.
    unsafe {
        let a = &*arrays;
        guarded(&*message, || {
            let (owned, count) = (a.owned as usize, a.count as usize);
            let pass = Pass {
                position: slice(a.position, count),
                velocity: slice(a.velocity, count),
                spin: slice(a.spin, count),
                radius: slice(a.radius, count),
                mass: slice(a.mass, count),
                kind: slice(a.kind, count),
                mask: slice(a.mask, count),
                frozen: a.frozen,
                owned,
                dt: a.dt,
                advance: a.advance != 0,
            };
            let (force, torque) = (slice_mut(a.force, count), slice_mut(a.torque, count));
            let mut record = record.as_mut();
            if let Some(record) = &mut record {
                record.clear();
            }
            for &i in slice(a.list, a.atoms as usize) {
                let i = i as usize;
                let number = *a.numbers.add(i) as usize;
                let stride = a.stride as usize;
                let neighbours = Neighbours {
                    i,
                    list: slice(*a.neighbours.add(i), number),
                    flags: slice_mut(*a.flags.add(i), number),
                    history: slice_mut(*a.history.add(i), number * stride),
                    stride,
                };
                (*law).0.compute(&pass, neighbours, force, torque, record.as_deref_mut());
            }
            Ok::<_, String>(record.map_or(0, |record| record.len() as i64))
        })
    }
}

/// Force of a wall: [`PairLaw::wall`] with `width` reals of history; three reals of force and three of torque.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_pair_wall(
    law: *const BoxedPairLaw,
    contact: *const WallContact,
    history: *mut f64,
    width: i32,
    wrench: *mut f64,
    message: *const Message,
) -> i64 {
    // SAFETY: the shim's own, lengths as stated.
    unsafe {
        guarded(&*message, || {
            let [force, torque] = (*law).0.wall(&*contact, slice_mut(history, width as usize));
            let wrench = slice_mut(wrench, 6);
            wrench[..3].copy_from_slice(force.as_slice());
            wrench[3..].copy_from_slice(torque.as_slice());
            Ok::<_, String>(0)
        })
    }
}

/// Memory for [`concordem_pair_compute`]'s record.
#[unsafe(no_mangle)]
pub extern "C" fn concordem_pair_record_new() -> *mut Vec<PairForce> {
    Box::into_raw(Box::default())
}

/// Its contents.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_pair_recorded(record: *const Vec<PairForce>) -> *const PairForce {
    // SAFETY: made by `concordem_pair_record_new`.
    unsafe { (*record).as_ptr() }
}

/// Its end.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_pair_record_delete(record: *mut Vec<PairForce>) {
    if !record.is_null() {
        // SAFETY: made by `concordem_pair_record_new`, deleted once.
        drop(unsafe { Box::from_raw(record) });
    }
}
