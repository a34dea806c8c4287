//! Contact laws for LIGGGHTS' neighbor lists.

// Called from C++ with the shim's pointers; `abi.h` documents their lengths.
#![allow(unsafe_code, clippy::missing_safety_doc)]

use std::ffi::c_char;

use concordem_c_abi::{Message, guarded, length_of, slice, slice_mut};

use crate::host_laws::HostShear;
use crate::pair::{
    self, MODELS, Neighbors, PairForce, PairLaw, Pass, Properties, SingleContact, SingleResponse, WallContact,
};

/// Properties of `types` atom types for [`concordem_pair_new`]: one real per type (`young`, `poisson`) or per pair of types; null if
/// the model does not need them.
#[repr(C)]
#[derive(Debug)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
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

/// Recorded contact forces.
pub struct PairRecord(Vec<PairForce>);

/// A contact law for all pairs of types.
pub struct PairLawHandle(Box<dyn PairLaw>);

/// A normal model of `pair_style gran`, see `Model` in `src/pair.rs`.
#[repr(C)]
#[derive(Debug)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct PairModel {
    name: *const c_char,
    /// Number in LIGGGHTS' model hash.
    number: i32,
    /// Properties that the model reads: bits `CONCORDEM_ELASTIC` to `CONCORDEM_VELOCITY`.
    properties: u32,
    hertzian: i32,
    is_law: i32,
}

/// Property: Young's modulus and Poisson's ratio.
pub const ELASTIC: u32 = 1;
/// Property: coefficient of restitution.
pub const RESTITUTION: u32 = 2;
/// Property: stiffnesses `kn`, `kt`.
pub const STIFFNESS: u32 = 4;
/// Property: damping `gamman`, `gammat`.
pub const DAMPING: u32 = 8;
/// Property: characteristic velocity.
pub const VELOCITY: u32 = 16;

// cbindgen needs literal numbers.
const _: () = {
    use pair::property as p;
    assert!(ELASTIC == p::ELASTIC && RESTITUTION == p::RESTITUTION && STIFFNESS == p::STIFFNESS);
    assert!(DAMPING == p::DAMPING && VELOCITY == p::VELOCITY);
};

/// Returns the number of models. Writes model `index` to `model` if it exists.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_pair_model(index: i32, model: *mut PairModel) -> i32 {
    if let Some(found) = usize::try_from(index).ok().and_then(|index| MODELS.get(index)) {
        let pair::Model { name, number, properties, hertzian, is_law } = *found;
        let (hertzian, is_law) = (i32::from(hertzian), i32::from(is_law));
        // SAFETY: valid pointer from the shim.
        unsafe { *model = PairModel { name: name.as_ptr(), number, properties, hertzian, is_law } };
    }
    MODELS.len() as i32
}

/// Create the law of model `model`. Returns null and a message if the parameters are invalid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_pair_new(
    model: i32,
    properties: *const PairProperties,
    message: *const Message,
) -> *mut PairLawHandle {
    let mut made = std::ptr::null_mut();
    // SAFETY: `types` or `types`² reals behind each pointer that the model reads.
    unsafe {
        let p = &*properties;
        let n = length_of(p.types);
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
        guarded(message, || {
            made = Box::into_raw(Box::new(PairLawHandle(pair::law(model as usize, shear, &all)?)));
            Ok::<_, concordem_contact::law::ParameterError>(0)
        });
    }
    made
}

/// Delete a law.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_pair_delete(law: *mut PairLawHandle) {
    if !law.is_null() {
        // SAFETY: created by `concordem_pair_new`, deleted once.
        drop(unsafe { Box::from_raw(law) });
    }
}

/// Returns the number of reals in the history of model `model`, or −1 if there is no such model. Writes 1 to `odd` for every real
/// that changes sign when the two atoms are swapped, else 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_pair_history(model: i32, odd: *mut i32, capacity: i32) -> i32 {
    // Any valid parameters: the history does not depend on them.
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
    let odd = unsafe { slice_mut(odd, capacity) };
    for (to, field) in odd.iter_mut().zip(&fields) {
        *to = i32::from(field.1);
    }
    fields.len() as i32
}

/// Neighbor lists and atoms: `count` atoms with ghosts; `list` holds the indices of the `atoms` atoms that have neighbor lists.
#[repr(C)]
#[derive(Debug)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct PairArrays {
    owned: i32,
    count: i32,
    atoms: i32,
    frozen: i32,
    advance: i32,
    stride: i32,
    list: *const i32,
    numbers: *const i32,
    neighbors: *const *const i32,
    flags: *const *mut i32,
    history: *const *mut f64,
    position: *const [f64; 3],
    velocity: *const [f64; 3],
    angular_velocity: *const [f64; 3],
    radius: *const f64,
    mass: *const f64,
    kind: *const i32,
    mask: *const i32,
    force: *mut [f64; 3],
    torque: *mut [f64; 3],
    /// 1 for each entry of the lists, in order, that is left out; null: none.
    skip: *const u8,
    dt: f64,
}

/// Add the forces of all pairs. Returns the number of contacts in `record`, 0 if `record` is null, or −1 and a message.
/// [`concordem_pair_recorded`] returns the recorded forces.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_pair_compute(
    law: *const PairLawHandle,
    arrays: *const PairArrays,
    record: *mut PairRecord,
    message: *const Message,
) -> i64 {
    // SAFETY: LIGGGHTS' arrays: `count` atoms with ghosts, lists of `atoms` atoms, `numbers[i]` neighbors each, as many
    // flags, and `stride` reals of history for each.
    unsafe {
        let a = &*arrays;
        guarded(message, || {
            let (owned, count) = (length_of(a.owned), length_of(a.count));
            let pass = Pass {
                position: slice(a.position, count),
                velocity: slice(a.velocity, count),
                angular_velocity: slice(a.angular_velocity, count),
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
                record.0.clear();
            }
            let mut entry = 0;
            for &i in slice(a.list, a.atoms) {
                let i = i as usize;
                let number = length_of(*a.numbers.add(i));
                let stride = length_of(a.stride);
                let skip = if a.skip.is_null() { &[] } else { slice(a.skip.add(entry), number) };
                entry += number;
                let neighbors = Neighbors {
                    i,
                    list: slice(*a.neighbors.add(i), number),
                    flags: slice_mut(*a.flags.add(i), number),
                    history: slice_mut(*a.history.add(i), number * stride),
                    stride,
                    skip,
                };
                (*law).0.compute(&pass, neighbors, force, torque, record.as_deref_mut().map(|record| &mut record.0));
            }
            Ok::<_, String>(record.map_or(0, |record| record.0.len() as i64))
        })
    }
}

/// Write the response of a contact of two overlapping particles to `response`. `history` has `width` reals. A cohesion model adds the
/// normal force `added` (N, compression positive) to the force that limits friction; it must be 0 for ConcorDEM laws. Returns 0, or −1
/// and a message.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_pair_single(
    law: *const PairLawHandle,
    contact: *const SingleContact,
    added: f64,
    history: *mut f64,
    width: i32,
    response: *mut SingleResponse,
    message: *const Message,
) -> i64 {
    // SAFETY: lengths as documented.
    unsafe {
        guarded(message, || {
            *response = (*law).0.single(&*contact, added, slice_mut(history, width));
            Ok::<_, String>(0)
        })
    }
}

/// As [`concordem_pair_single`], for a particle that overlaps a wall.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_pair_wall(
    law: *const PairLawHandle,
    contact: *const WallContact,
    added: f64,
    history: *mut f64,
    width: i32,
    response: *mut SingleResponse,
    message: *const Message,
) -> i64 {
    // SAFETY: lengths as documented.
    unsafe {
        guarded(message, || {
            *response = (*law).0.wall(&*contact, added, slice_mut(history, width));
            Ok::<_, String>(0)
        })
    }
}

/// Create a record for [`concordem_pair_compute`].
#[unsafe(no_mangle)]
pub extern "C" fn concordem_pair_record_new() -> *mut PairRecord {
    Box::into_raw(Box::new(PairRecord(Vec::new())))
}

/// The forces in the record, valid until the next computation.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_pair_recorded(record: *const PairRecord) -> *const PairForce {
    // SAFETY: created by `concordem_pair_record_new`.
    unsafe { (*record).0.as_ptr() }
}

/// Delete a record.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_pair_record_delete(record: *mut PairRecord) {
    if !record.is_null() {
        // SAFETY: created by `concordem_pair_record_new`, deleted once.
        drop(unsafe { Box::from_raw(record) });
    }
}
