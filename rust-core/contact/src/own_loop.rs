//! Contacts in a program that has its own loop over particles.
//!
//! A [`PairContact`] is one contact from step to step: it begins when the surfaces meet, keeps the history of the law, and ends.
//! [`PairContact::respond`] returns the forces and torques on both particles.
//!
//! The order of a step is that of leapfrog: first kick and drift of all particles, then the contacts at the new positions, with the
//! velocities *of the step that has led there*.
//!
//! ```
//! use concordem_contact::law::{Elastic, HertzMindlin};
//! use concordem_contact::math::{Quat, Vec3};
//! use concordem_contact::own_loop::{PairContact, Particle};
//!
//! // Two glass spheres of 10 mm meet at 1 m/s; restitution 0.9.
//! let glass = Elastic { young: 70e9, poisson: 0.22 };
//! let law = HertzMindlin::new(glass, glass, 0.3, 0.9).unwrap();
//! let (radius, mass, dt) = (0.01, 0.0105, 1e-7);
//! let (mut x, mut v) = ([0.0, 0.02001], [1.0, 0.0]);
//! let mut contact = PairContact::default();
//! for _ in 0..2_000 {
//!     let [a, b] = [0, 1].map(|k| {
//!         x[k] += v[k] * dt;
//!         Particle::new(Vec3::x() * x[k], Vec3::x() * v[k], radius, mass)
//!     });
//!     let on = contact.respond(&law, &a, &b, dt);
//!     v[0] += on.a.force.x / mass * dt;
//!     v[1] += on.b.force.x / mass * dt;
//! }
//! assert!((v[1] - v[0] - 0.9).abs() < 1e-3);
//! assert!(!contact.is_active());
//! ```
//!
//! The program `examples/own_loop.rs` of this crate lets 1,000 spheres collide.

use crate::geometry::{PreviousGeometry, Reference, contact_area, initial_geometry};
use crate::kinematics::{ImageShift, Motion, MotionMeasure};
use crate::law::{ContactLaw, EnergySplit, Status};
use crate::math::{Quat, Vec3, quaternion_of_rotation_vector};
use crate::pair::ContactFlags;
use crate::step::{Contact, Ends, How, step};
use crate::wrench::Wrenches;

/// A sphere at the end of a step.
#[derive(Debug, Clone, Copy)]
pub struct Particle {
    /// Its motion in the step.
    pub motion: Motion,
    /// Radius, m.
    pub radius: f64,
    /// Mass, kg.
    pub mass: f64,
}

impl Particle {
    /// A sphere that does not turn, with its center (m) at the end of the step, velocity in the step (m/s), radius (m), and mass (kg).
    #[must_use]
    pub fn new(position: Vec3, velocity: Vec3, radius: f64, mass: f64) -> Self {
        let still = Quat::identity();
        let angular_velocity = Vec3::zeros();
        Self {
            motion: Motion { position, velocity, angular_velocity, rotation_increment: still, orientation: still },
            radius,
            mass,
        }
    }

    /// The sphere with the angular velocity in the step (rad/s) of `dt` seconds. `orientation` is the one at the end of the step, body to
    /// world; only bonds that bend and twist read it, so that spheres with other laws may pass the identity.
    #[must_use]
    pub fn turning(mut self, angular_velocity: Vec3, orientation: Quat, dt: f64) -> Self {
        let rotation_increment = quaternion_of_rotation_vector(&(angular_velocity * dt));
        self.motion = Motion { angular_velocity, rotation_increment, orientation, ..self.motion };
        self
    }
}

/// A contact of two spheres from step to step. `default()` is a pair that does not touch yet.
///
/// Keep one for each pair that may touch, and drop it when the pair is far apart and [not active](Self::is_active).
#[derive(Debug, Clone, Copy, Default)]
pub struct PairContact<S> {
    flags: ContactFlags,
    reference: Reference,
    previous: PreviousGeometry,
    history: S,
    energy: Energy,
}

/// Energies of a contact, J.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Energy {
    /// Stored now.
    pub stored: f64,
    /// Dissipated since the first step, over all touches of the pair.
    pub dissipated: f64,
}

impl<S: Copy + Default> PairContact<S> {
    /// A bond between spheres at rest, with the centers `a` and `b` (m), without force there. Its cross-section has the radius of the smaller
    /// sphere.
    #[must_use]
    pub fn bond(a: &Vec3, b: &Vec3, radii: [f64; 2]) -> Self {
        let previous = initial_geometry(a, b, &Vec3::zeros());
        Self {
            flags: ContactFlags { bits: ContactFlags::BONDED | ContactFlags::ACTIVE, ..ContactFlags::default() },
            reference: Reference { length: previous.length, area: contact_area(radii[0], radii[1]) },
            previous,
            ..Self::default()
        }
    }

    /// Whether it has a force: a whole bond, or spheres that touch.
    pub fn is_active(&self) -> bool {
        self.flags.carries()
    }

    /// Whether it is a bond that broke. It has no force any more; put a contact without bond in its place.
    pub fn is_broken(&self) -> bool {
        self.flags.has(ContactFlags::BROKEN)
    }

    /// History of the law.
    pub fn history(&self) -> &S {
        &self.history
    }

    /// Energies at the end of the last step.
    pub fn energy(&self) -> Energy {
        self.energy
    }

    /// Forces (N) and torques (N·m) on both particles at the end of a step of `dt` seconds. The contact begins, goes on, or ends; without
    /// contact they are zero.
    ///
    /// A contact that begins moves in the step in which it does, from where the velocities say the particles were one step ago.
    pub fn respond<L: ContactLaw<State = S>>(&mut self, law: &L, a: &Particle, b: &Particle, dt: f64) -> Wrenches {
        let ends = Ends {
            motion: [&a.motion, &b.motion],
            radius: [a.radius, b.radius],
            mass: [a.mass, b.mass],
            image: &ImageShift::default(),
            surface_displacement: None,
        };
        let Self { flags, reference, previous, history, energy } = self;
        let begins = !flags.has(ContactFlags::ACTIVE)
            && !flags.has(ContactFlags::BROKEN)
            && ends.begin::<L>(flags, reference, previous, MotionMeasure::Finite, dt);
        if begins {
            *history = S::default();
        }
        if !flags.carries() {
            return Wrenches::default();
        }
        let contact = Contact {
            bonded: flags.has(ContactFlags::BONDED),
            reference: *reference,
            previous: *previous,
            history: *history,
        };
        let stepped = step(law, &contact, &ends, &How::new(MotionMeasure::Finite, dt));
        let response = &stepped.response;
        *previous = stepped.geometry();
        *history = response.state;
        energy.dissipated += response.energy.dissipated();
        match response.status {
            Status::Lives => {
                energy.stored = stored(&response.energy);
                return stepped.wrenches();
            }
            Status::Broke | Status::BrokeInShear => flags.bits |= ContactFlags::BROKEN,
            Status::Opened => flags.bits &= !ContactFlags::ACTIVE,
        }
        energy.stored = 0.0;
        Wrenches::default()
    }
}

/// Stored energy of all modes, J.
fn stored(energy: &EnergySplit) -> f64 {
    energy.stored_normal + energy.stored_shear + energy.stored_bending + energy.stored_twist
}
