//! Beginning of contacts.

use concordem_contact::kinematics::PreviousGeometry;
use concordem_contact::law::{ContactLaw, Reference};
use concordem_contact::math::Vec3;

use crate::state::contacts::ContactFlags;

/// Activate a candidate if its surfaces meet, or those of its broken bond; returns whether they do.
///
/// `between` and `before` are the branch vectors now and one step ago (m); `surface_displacement` is how far the surfaces
/// have moved towards each other (m), 0 for rigid particles.
#[cold]
#[inline(never)]
pub(super) fn activate<L: ContactLaw>(
    flags: &mut ContactFlags,
    reference: &mut Reference,
    previous: &mut PreviousGeometry,
    between: &Vec3,
    before: &Vec3,
    [radius_a, radius_b]: [f64; 2],
    surface_displacement: f64,
) -> bool {
    let length = between.norm();
    let opening =
        if flags.has(ContactFlags::KEPT_REFERENCE) { length - reference.length } else { length - radius_a - radius_b };
    if opening - surface_displacement >= 0.0 {
        return false;
    }
    let length_before = before.norm();
    *previous = PreviousGeometry { normal: before / length_before, length: length_before };
    flags.bits |= ContactFlags::ACTIVE;
    if !flags.has(ContactFlags::KEPT_REFERENCE) {
        *reference = L::unbonded_reference(length, radius_a, radius_b);
    }
    true
}
