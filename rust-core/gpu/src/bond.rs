//! First kernel: a bond.

use concordem_contact::geometry::{ContactGeometry, PreviousGeometry, Reference};
use concordem_contact::kinematics::{ContactInput, ImageShift, Kinematics, Motion, MotionMeasure, torques};
use concordem_contact::law::{ContactLaw, Response, Status};
use concordem_contact::math::Vec3;

/// What a bond reads of a particle.
#[derive(Debug, Clone, Copy)]
pub struct End {
    /// Motion in the step.
    pub motion: Motion,
    /// m.
    pub radius: f64,
    /// kg.
    pub mass: f64,
}

/// A bond before the step.
#[derive(Debug, Clone, Copy)]
pub struct Bond<S> {
    /// Length and area without strain.
    pub reference: Reference,
    /// Normal and length of the last step.
    pub previous: PreviousGeometry,
    /// History of the law.
    pub history: S,
}

/// Loads of a bond on its particles.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(C)]
pub struct Loads {
    /// Force on A, N. B gets the opposite.
    pub force: Vec3,
    /// Torques on A and B about their centers, N·m.
    pub torques: [Vec3; 2],
}

/// A bond after the step.
#[derive(Debug, Clone, Copy)]
pub struct Evaluated<S> {
    /// Loads on the particles.
    pub loads: Loads,
    /// Normal and length.
    pub previous: PreviousGeometry,
    /// History of the law.
    pub history: S,
    /// Whether the bond broke. Its loads are zero then.
    pub broke: bool,
}

/// Measure and evaluate a bond in a step of `dt` (s).
#[inline(always)]
pub fn evaluate<L: ContactLaw>(law: &L, bond: &Bond<L::State>, [a, b]: [&End; 2], dt: f64) -> Evaluated<L::State> {
    let Reference { length, area } = bond.reference;
    let geometry = ContactGeometry {
        reference_length: length,
        area,
        radius_a: a.radius,
        radius_b: b.radius,
        mass_a: a.mass,
        mass_b: b.mass,
    };
    let input = ContactInput {
        a: &a.motion,
        b: &b.motion,
        image: &ImageShift::default(),
        geometry: &geometry,
        previous: &bond.previous,
        bonded: true,
        dt,
    };
    let measured = L::Kinematics::measure(MotionMeasure::Finite, &input);
    let point = *measured.point();
    let Response { force, moment, state, status, .. } = law.respond(&measured, &bond.history, dt);
    let previous = PreviousGeometry { normal: point.normal, length: point.length };
    if status != Status::Lives {
        return Evaluated { loads: Loads::default(), previous, history: state, broke: true };
    }
    let [mut torque_a, mut torque_b] = torques(&point.normal, &force, [point.arm_a, point.arm_b]);
    if L::TRANSMITS_MOMENT {
        torque_a += moment;
        torque_b -= moment;
    }
    Evaluated { loads: Loads { force, torques: [torque_a, torque_b] }, previous, history: state, broke: false }
}
