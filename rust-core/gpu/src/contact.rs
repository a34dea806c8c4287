//! First kernel: a contact.

use concordem_contact::geometry::{PreviousGeometry, Reference};
use concordem_contact::kinematics::{ImageShift, Motion, MotionMeasure};
use concordem_contact::law::{ContactLaw, EnergySplit, Response, Status};
use concordem_contact::math::{Mat3, Vec3};
use concordem_contact::pair::ContactFlags;
use concordem_contact::step::{self, Ends, How};

use crate::arguments::Logged;

/// What a contact reads of a particle.
#[derive(Debug, Clone, Copy)]
pub struct End {
    /// Motion in the step.
    pub motion: Motion,
    /// m.
    pub radius: f64,
    /// kg.
    pub mass: f64,
}

/// A bond, an unbonded contact, or a candidate.
#[derive(Debug, Clone, Copy)]
pub struct Contact<S> {
    /// Pair coefficients and flags.
    pub flags: ContactFlags,
    /// Length and area without strain.
    pub reference: Reference,
    /// Normal and length of the last step.
    pub previous: PreviousGeometry,
    /// History of the law.
    pub history: S,
}

/// Loads of a contact on its particles. Aligned, so that a thread writes two numbers at once.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(C, align(16))]
pub struct Loads {
    /// Force on A, N. B gets the opposite.
    pub force: Vec3,
    /// Torques on A and B about their centers, N·m.
    pub torques: [Vec3; 2],
}

/// A contact after the step, and what it did in it.
#[derive(Debug, Clone, Copy)]
pub struct Evaluated<S> {
    /// The contact.
    pub contact: Contact<S>,
    /// Loads on the particles.
    pub loads: Loads,
    /// Energies, J.
    pub energy: EnergySplit,
    /// `l⊗f`, J.
    pub virial: Mat3,
    /// Squares of force (N²) and moment (N²·m²).
    pub squares: [f64; 2],
    /// Whether it has a force.
    pub active: bool,
}

impl<S> Evaluated<S> {
    /// A contact without a force.
    #[inline(always)]
    fn without_force(contact: Contact<S>, energy: EnergySplit) -> Self {
        let (loads, virial) = (Loads::default(), Mat3::zeros());
        Self { contact, loads, energy, virial, squares: [0.0; 2], active: false }
    }
}

/// What the contacts of a step share.
#[derive(Debug, Clone, Copy)]
pub struct Step {
    /// Time step, s.
    pub dt: f64,
    /// Damage at which a bond enters the event log.
    pub threshold: f64,
    /// Whether the solver must see contacts begin whose stiffness grows.
    pub watched: bool,
}

/// Measure and evaluate a contact.
///
/// `log` writes an entry of the event log, or returns `false` if it cannot.
///
/// `None`: the contact has an event, so the solver must take the step. The bond breaks; it enters the event log, and `log` cannot write it;
/// or a contact begins that takes over the energy of a broken bond, or whose stiffness the solver must check.
#[inline(always)]
pub fn evaluate<L: ContactLaw>(
    law: &L,
    mut contact: Contact<L::State>,
    [a, b]: [&End; 2],
    shared: &Step,
    log: impl FnOnce(&Logged) -> bool,
) -> Option<Evaluated<L::State>> {
    let ends = Ends {
        motion: [&a.motion, &b.motion],
        radius: [a.radius, b.radius],
        mass: [a.mass, b.mass],
        image: &ImageShift::default(),
        surface_displacement: None,
    };
    if !contact.flags.carries() {
        if !begins::<L>(&mut contact, &ends, shared.dt) {
            return Some(Evaluated::without_force(contact, EnergySplit::default()));
        }
        if contact.flags.has(ContactFlags::KEPT_REFERENCE) || L::STIFFENS && shared.watched {
            return None;
        }
    }
    let Contact { reference, previous, history, .. } = contact;
    let before = step::Contact { bonded: contact.flags.has(ContactFlags::BONDED), reference, previous, history };
    let stepped = step::step(law, &before, &ends, &How::new(MotionMeasure::Finite, shared.dt));
    let Response { force, moment, state, status, energy } = stepped.response;
    let point = stepped.point();
    contact.previous = stepped.geometry();
    if status.is_broken() {
        return None;
    }
    if status == Status::Opened {
        contact.history = L::State::default();
        contact.flags.bits &= !(ContactFlags::ACTIVE | ContactFlags::REPORTED);
        let EnergySplit { damage, friction, viscous, integration, .. } = energy;
        let energy = EnergySplit { damage, friction, viscous, integration, ..EnergySplit::default() };
        return Some(Evaluated::without_force(contact, energy));
    }
    contact.history = state;
    let damage = L::damage(&state);
    if damage >= shared.threshold && !contact.flags.has(ContactFlags::REPORTED) {
        let [[x, y, z]] = (a.motion.position + point.normal * point.arm_a).data.0;
        let (released, [normal, shear, bending, twist], in_shear) = L::event(&stepped.response);
        let in_shear = f64::from(u8::from(in_shear));
        if !log(&[x, y, z, released, damage, normal, shear, bending, twist, in_shear]) {
            return None;
        }
        contact.flags.bits |= ContactFlags::REPORTED;
    }
    let wrenches = stepped.wrenches();
    let loads = Loads { force, torques: [wrenches.a.torque, wrenches.b.torque] };
    let virial = (point.normal * point.length) * force.transpose();
    let of_moment = if L::TRANSMITS_MOMENT { moment.norm_squared() } else { 0.0 };
    let squares = [force.norm_squared(), of_moment];
    Some(Evaluated { contact, loads, energy, virial, squares, active: true })
}

/// Whether a contact without force begins; if so, activates it.
#[inline(always)]
fn begins<L: ContactLaw>(contact: &mut Contact<L::State>, ends: &Ends<'_>, dt: f64) -> bool {
    let Contact { flags, reference, previous, .. } = contact;
    !flags.has(ContactFlags::BROKEN) && ends.begin::<L>(flags, reference, previous, MotionMeasure::Finite, dt)
}
