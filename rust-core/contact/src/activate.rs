//! Beginning of contacts.

use crate::geometry::{PreviousGeometry, Reference};
use crate::kinematics::MotionMeasure;
use crate::law::ContactLaw;
use crate::math::{Vec3, norm, yade_order};
use crate::pair::ContactFlags;

/// Length of a branch vector (m), with the bits of the measure that evaluates the contact. A contact that begins unstrained, as
/// those of the concrete law, must not see a strain of its rounding: that would open it again.
#[inline(always)]
pub fn length_of(branch: &Vec3, mode: MotionMeasure) -> f64 {
    match mode {
        MotionMeasure::Finite | MotionMeasure::FirstOrder => norm(branch),
        MotionMeasure::Yade | MotionMeasure::YadeRatcheting => yade_order::norm(branch),
    }
}

/// Activate a candidate if its surfaces meet, or those of its broken bond; returns whether they do.
///
/// `length` is the [`length_of`] the branch vector (m), `before` that vector one step ago (m); `surface_displacement` is how far
/// the surfaces have moved towards each other (m), 0 for rigid particles.
// On a graphics processor a call would put the contact into memory.
#[cfg_attr(not(target_arch = "nvptx64"), cold, inline(never))]
#[cfg_attr(target_arch = "nvptx64", inline(always))]
pub fn activate<L: ContactLaw>(
    flags: &mut ContactFlags,
    reference: &mut Reference,
    previous: &mut PreviousGeometry,
    length: f64,
    before: &Vec3,
    [radius_a, radius_b]: [f64; 2],
    surface_displacement: f64,
) -> bool {
    let opening =
        if flags.has(ContactFlags::KEPT_REFERENCE) { length - reference.length } else { length - radius_a - radius_b };
    if opening - surface_displacement >= 0.0 {
        return false;
    }
    let length_before = norm(before);
    *previous = PreviousGeometry { normal: before / length_before, length: length_before };
    flags.bits |= ContactFlags::ACTIVE;
    if !flags.has(ContactFlags::KEPT_REFERENCE) {
        *reference = L::unbonded_reference(length, radius_a, radius_b);
    }
    true
}
