//! Atom arrays as passed by the shim.

// Called from C++ with the shim's pointers; `abi.h` documents their lengths.
#![allow(unsafe_code, clippy::missing_safety_doc)]

use std::ffi::c_void;

use concordem_c_abi::{length_of, slice, slice_mut};

use crate::atoms::{self, Atoms, Tags};

/// Mass of a frozen atom, kg.
pub const FROZEN_MASS: f64 = 1e100;

// cbindgen needs literal numbers.
const _: () = assert!(FROZEN_MASS == atoms::FROZEN_MASS);

/// Atom arrays of the host: `owned` atoms of this processor, `count` with ghosts. Vectors are three reals. See `Atoms` in
/// `src/atoms.rs`.
#[repr(C)]
#[derive(Debug)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct AtomArrays {
    owned: i32,
    count: i32,
    /// Bit of the fix's group.
    group: i32,
    /// Reals of `memory` per atom.
    memory_width: i32,
    /// Bytes of an id: 4 or 8.
    tag_bytes: i32,
    /// Ids.
    tag: *const c_void,
    kind: *const i32,
    mask: *const i32,
    position: *const f64,
    velocity: *const f64,
    angular_velocity: *const f64,
    radius: *const f64,
    mass: *const f64,
    /// Mass that resists a contact, kg; null: that of the atom.
    effective_mass: *const f64,
    force: *mut f64,
    torque: *mut f64,
    memory: *mut f64,
    /// Periodic edge lengths of the box, m; 0 where it is not periodic.
    edge: [f64; 3],
    /// Lowest coordinates of the box, m.
    low: [f64; 3],
    /// Highest coordinates of the box, m.
    high: [f64; 3],
    dt: f64,
    step: i64,
}

impl AtomArrays {
    pub(super) unsafe fn view<'a>(&self) -> Atoms<'a> {
        let (owned, count) = (length_of(self.owned), length_of(self.count));
        // SAFETY: lengths of the host's arrays. They include forces on ghosts, which we do not use.
        unsafe {
            Atoms {
                owned,
                tag: if self.tag_bytes == 8 {
                    Tags::Wide(slice(self.tag.cast(), count))
                } else {
                    Tags::Narrow(slice(self.tag.cast(), count))
                },
                kind: slice(self.kind, count),
                mask: slice(self.mask, count),
                group: self.group,
                position: slice(self.position, 3 * count),
                velocity: slice(self.velocity, 3 * count),
                angular_velocity: slice(self.angular_velocity, 3 * count),
                radius: slice(self.radius, count),
                mass: slice(self.mass, count),
                effective_mass: slice(
                    if self.effective_mass.is_null() { self.mass } else { self.effective_mass },
                    count,
                ),
                force: slice_mut(self.force, 3 * owned),
                torque: slice_mut(self.torque, 3 * owned),
                memory: slice_mut(self.memory, length_of(self.memory_width) * count),
                edge: self.edge,
                low: self.low,
                high: self.high,
                dt: self.dt,
                step: self.step,
            }
        }
    }
}
