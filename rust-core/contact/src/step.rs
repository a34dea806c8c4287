//! One step of one contact: measure the motion of its two sides, and let the law respond.
//!
//! The solver, records of forces, steps on graphics processors, and hosts call [`step`] or [`step_at_wall`]. Many contacts at
//! once: [`straight`](crate::straight).
//!
//! ```
//! use concordem_contact::geometry::{PreviousGeometry, Reference};
//! use concordem_contact::kinematics::{ImageShift, Motion, MotionMeasure};
//! use concordem_contact::law::{LinearBond, LinearBondState, Status};
//! use concordem_contact::math::{Quat, Vec3};
//! use concordem_contact::step::{Contact, Ends, How, step};
//!
//! let bond = LinearBond::new(2e6, 1e6, 0.0, f64::INFINITY, f64::INFINITY).unwrap();
//! let at = |x: f64, velocity: f64| Motion {
//!     position: Vec3::x() * x,
//!     velocity: Vec3::x() * velocity,
//!     angular_velocity: Vec3::zeros(),
//!     rotation_increment: Quat::identity(),
//!     orientation: Quat::identity(),
//! };
//! // B has moved by 0.5 m in the step of 1 s.
//! let (a, b) = (at(0.0, 0.0), at(2.5, 0.5));
//! let contact = Contact {
//!     bonded: true,
//!     reference: Reference { length: 2.0, area: 1.0 },
//!     previous: PreviousGeometry { normal: Vec3::x(), length: 2.0 },
//!     history: LinearBondState::default(),
//! };
//! let ends = Ends {
//!     motion: [&a, &b],
//!     radius: [1.0; 2],
//!     mass: [1.0; 2],
//!     image: &ImageShift::default(),
//!     surface_displacement: None,
//! };
//! let stepped = step(&bond, &contact, &ends, &How::new(MotionMeasure::Finite, 1.0));
//! assert_eq!(stepped.response.status, Status::Lives);
//! assert_eq!(stepped.wrenches().a.force, Vec3::x() * 1e6);
//! ```

use crate::activate::{activate, length_of};
use crate::geometry::{ContactGeometry, PreviousGeometry, Reference};
use crate::kinematics::{ContactInput, ImageShift, Kinematics, Motion, MotionMeasure, PointKinematics, WallInput};
use crate::law::{ContactLaw, Response, TemperatureFactors};
use crate::math::{Symmetric, Vec3};
use crate::pair::ContactFlags;
use crate::wrench::Wrenches;

/// A contact at the end of the previous step.
#[derive(Debug, Clone, Copy)]
pub struct Contact<S> {
    /// Whether it is a bond.
    pub bonded: bool,
    /// Unstrained geometry.
    pub reference: Reference,
    /// Normal and length.
    pub previous: PreviousGeometry,
    /// History of the law.
    pub history: S,
}

/// The two particles of a contact in a step.
#[derive(Debug, Clone, Copy)]
pub struct Ends<'a> {
    /// Motion of A and B.
    pub motion: [&'a Motion; 2],
    /// Radius of A and B, m.
    pub radius: [f64; 2],
    /// Mass of A and B, kg.
    pub mass: [f64; 2],
    /// Periodic image of B.
    pub image: &'a ImageShift,
    /// Sum of the surface displacements of both particles, now and one step ago, m; `None` if they are rigid.
    pub surface_displacement: Option<[Symmetric; 2]>,
}

impl Ends<'_> {
    /// Branch vector `l = x_B + shift − x_A`, m.
    #[inline(always)]
    pub fn branch(&self) -> Vec3 {
        let [a, b] = self.motion;
        b.position + self.image.displacement - a.position
    }

    /// Constants of a contact.
    #[inline(always)]
    pub fn geometry(&self, reference: &Reference) -> ContactGeometry {
        let Reference { length: reference_length, area } = *reference;
        let ([radius_a, radius_b], [mass_a, mass_b]) = (self.radius, self.mass);
        ContactGeometry { reference_length, area, radius_a, radius_b, mass_a, mass_b }
    }

    /// Motion of a contact in a step of `dt` seconds.
    #[inline(always)]
    pub fn measure<K: Kinematics, S>(&self, contact: &Contact<S>, measure: MotionMeasure, dt: f64) -> K {
        let ([a, b], image) = (self.motion, self.image);
        let (geometry, Contact { bonded, previous, .. }) = (&self.geometry(&contact.reference), contact);
        let input = ContactInput { a, b, image, geometry, previous, bonded: *bonded, dt };
        deformed(K::measure(measure, &input), previous, self.surface_displacement)
    }

    /// Activate a candidate if its surfaces meet; returns whether they do. See [`activate`].
    ///
    /// The velocities give the branch vector one step ago, so candidates need not store it.
    #[inline(always)]
    pub fn begin<L: ContactLaw>(
        &self,
        flags: &mut ContactFlags,
        reference: &mut Reference,
        previous: &mut PreviousGeometry,
        measure: MotionMeasure,
        dt: f64,
    ) -> bool {
        let ([a, b], branch) = (self.motion, self.branch());
        let before = branch - (b.velocity + self.image.velocity - a.velocity) * dt;
        let approach = self.surface_displacement.map_or(0.0, |[now, _]| now.quadratic(&branch.normalize()));
        let length = length_of(&branch, measure);
        activate::<L>(flags, reference, previous, length, &before, self.radius, approach)
    }
}

/// A particle and a wall in a step.
#[derive(Debug, Clone, Copy)]
pub struct AtWall<'a> {
    /// The motion of both sides.
    pub motion: WallMotion<'a>,
    /// Radius of the particle, m.
    pub radius: f64,
    /// Mass of the particle, kg.
    pub mass: f64,
    /// Surface displacement of the particle now and one step ago, m; `None` if it is rigid.
    pub surface_displacement: Option<[Symmetric; 2]>,
}

/// Motion of a particle and of the wall point closest to it.
#[derive(Debug, Clone, Copy)]
pub struct WallMotion<'a> {
    /// Motion of the particle.
    pub particle: &'a Motion,
    /// Closest point of the wall.
    pub closest_point: &'a crate::wall::ClosestPoint,
    /// Velocity of the wall there, m/s.
    pub velocity: Vec3,
    /// Rotation of the surface there in the step: identity for a wall that only translates.
    pub rotation: crate::math::Quat,
}

impl AtWall<'_> {
    /// Constants of a contact.
    #[inline(always)]
    pub fn geometry(&self, reference: &Reference) -> ContactGeometry {
        let Reference { length: reference_length, area } = *reference;
        let (radius_a, mass_a) = (self.radius, self.mass);
        ContactGeometry { reference_length, area, radius_a, radius_b: 0.0, mass_a, mass_b: f64::INFINITY }
    }

    /// Motion of a contact in a step of `dt` seconds; `None` if the kinematics has no contacts with walls.
    #[inline(always)]
    pub fn measure<K: Kinematics, S>(&self, contact: &Contact<S>, measure: MotionMeasure, dt: f64) -> Option<K> {
        let WallMotion { particle, closest_point, velocity, rotation } = &self.motion;
        let (geometry, previous) = (&self.geometry(&contact.reference), &contact.previous);
        let input = WallInput {
            a: particle,
            closest_point,
            wall_velocity: velocity,
            wall_rotation: rotation,
            geometry,
            previous,
            dt,
        };
        Some(deformed(K::measure_wall(measure, &input)?, previous, self.surface_displacement))
    }
}

/// The motion between particles that deform, if they do.
#[inline(always)]
fn deformed<K: Kinematics>(rigid: K, previous: &PreviousGeometry, surface_displacement: Option<[Symmetric; 2]>) -> K {
    let Some([now, before]) = surface_displacement else { return rigid };
    rigid.with_surface_displacement(now.quadratic(&rigid.point().normal), before.quadratic(&previous.normal))
}

/// How a contact is stepped.
#[derive(Debug, Clone, Copy)]
pub struct How {
    /// Measure of the motion.
    pub measure: MotionMeasure,
    /// Time step, s.
    pub dt: f64,
    /// Factors on stiffness and strength at the temperature of the contact, if they depend on it.
    pub factors: Option<TemperatureFactors>,
}

impl How {
    /// With constants that do not depend on the temperature.
    #[inline(always)]
    pub fn new(measure: MotionMeasure, dt: f64) -> Self {
        Self { measure, dt, factors: None }
    }
}

/// A contact after a step.
#[derive(Debug, Clone, Copy)]
pub struct Stepped<L: ContactLaw> {
    /// Its motion in the step.
    pub kinematics: L::Kinematics,
    /// The response of the law.
    pub response: Response<L::State>,
}

impl<L: ContactLaw> Stepped<L> {
    /// The response of `law` to a motion.
    #[inline(always)]
    pub fn of(law: &L, kinematics: L::Kinematics, history: &L::State, how: &How) -> Self {
        let response = match &how.factors {
            Some(factors) => law.respond_at(factors, &kinematics, history, how.dt),
            None => law.respond(&kinematics, history, how.dt),
        };
        Self { kinematics: law.acting(kinematics, history), response }
    }

    /// The motion as that of a point contact.
    #[inline(always)]
    pub fn point(&self) -> &PointKinematics {
        self.kinematics.point()
    }

    /// Normal and length, which the next step reads.
    #[inline(always)]
    pub fn geometry(&self) -> PreviousGeometry {
        let &PointKinematics { normal, length, .. } = self.point();
        PreviousGeometry { normal, length }
    }

    /// Forces and torques on A and B.
    #[inline(always)]
    pub fn wrenches(&self) -> Wrenches {
        let &PointKinematics { normal, arm_a, arm_b, .. } = self.point();
        wrenches::<L>(&normal, [arm_a, arm_b], &self.response)
    }
}

/// Forces and torques on A and B of a response, with the arms of A and B (m) along the normal.
#[inline(always)]
pub fn wrenches<L: ContactLaw>(normal: &Vec3, arms: [f64; 2], response: &Response<L::State>) -> Wrenches {
    let wrenches = Wrenches::of(normal, &response.force, arms);
    if L::TRANSMITS_MOMENT { wrenches.with_moment(&response.moment) } else { wrenches }
}

/// One step of a contact between two particles.
#[inline(always)]
pub fn step<L: ContactLaw>(law: &L, contact: &Contact<L::State>, ends: &Ends<'_>, how: &How) -> Stepped<L> {
    Stepped::of(law, ends.measure(contact, how.measure, how.dt), &contact.history, how)
}

/// One step of a contact of a particle with a wall; `None` if the law has no contacts with walls.
#[inline(always)]
pub fn step_at_wall<L: ContactLaw>(
    law: &L,
    contact: &Contact<L::State>,
    sides: &AtWall<'_>,
    how: &How,
) -> Option<Stepped<L>> {
    let kinematics = sides.measure(contact, how.measure, how.dt)?;
    Some(Stepped::of(law, kinematics, &contact.history, how))
}
