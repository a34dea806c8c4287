//! Position and motion of a YADE body, and the outcome of a step of a bond.

#![allow(unsafe_code)] // pointers into YADE's objects

use concordem_contact::kinematics::sphere_sphere::Motion;
use concordem_contact::math::{Quat, Symmetric, Vec3};

/// Addresses of the position (m), velocity (m/s), angular velocity (rad/s), three reals each, and orientation (x, y, z, w) of a
/// body.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct BodyMotion {
    position: *const f64,
    velocity: *const f64,
    angular_velocity: *const f64,
    orientation: *const f64,
}

/// Outcome of a step of one bond.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BondOutcome {
    /// The bond is intact.
    Lives = 0,
    /// The bond broke.
    Broke = 1,
    /// The contact without a bond opened, or was never closed.
    Opened = 2,
    /// The force is not finite.
    NotANumber = -1,
    /// The library panicked.
    Internal = -3,
}

/// # Safety
/// `p` must point to three reals.
pub(crate) unsafe fn vector(p: *const f64) -> Vec3 {
    // SAFETY: guaranteed by the caller.
    unsafe { Vec3::new(*p, *p.add(1), *p.add(2)) }
}

/// Tensor stored as xx, yy, zz, yz, xz, xy.
///
/// # Safety
/// `p` must point to six reals.
pub(crate) unsafe fn symmetric(p: *const f64) -> Symmetric {
    // SAFETY: guaranteed by the caller.
    Symmetric(std::array::from_fn(|k| unsafe { *p.add(k) }))
}

impl BodyMotion {
    /// The motion, without the rotation increment.
    ///
    /// # Safety
    /// The addresses must be those of an existing body.
    pub(crate) unsafe fn read(&self) -> Motion {
        // SAFETY: guaranteed by the caller.
        unsafe {
            let q = self.orientation;
            Motion {
                position: vector(self.position),
                velocity: vector(self.velocity),
                angular_velocity: vector(self.angular_velocity),
                rotation_increment: Quat::identity(),
                orientation: Quat::new(*q.add(3), *q, *q.add(1), *q.add(2)),
            }
        }
    }
}
