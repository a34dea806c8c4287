//! Why a step fails.

use concordem_contact::law::LawName;
use concordem_contact::law::names::listing;

use crate::neighbor::NeighborError;

/// Why a step fails.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SolverError {
    /// The neighbor search failed.
    #[error("neighbor list at step {step}: {source}")]
    Neighbor {
        /// Step.
        step: u64,
        /// Reason.
        source: NeighborError,
    },
    /// The strains of deformable particles do not converge.
    #[error(
        "at step {step} the strains of the deformable particles did not converge: after {iterations} iterations they \
         still change by {change:.3e} relative to their size. The spectral radius of the iteration may be too large for \
         the relaxation: `concordem check` prints it; lower deformable.relaxation below 2/(1 + spectral radius), or \
         raise deformable.maximum_iterations"
    )]
    NotConverged {
        /// Step.
        step: u64,
        /// Iterations done.
        iterations: u32,
        /// Relative change in the last iteration.
        change: f64,
    },
    /// The contact law does not support deformable particles.
    #[error(
        "the law \"{law}\" does not support deformable particles; use {}, or particles that do not deform",
        listing(LawName::ALL.iter().copied().filter(|law| law.facts().deforms))
    )]
    NotDeformable {
        /// Name of the law.
        law: &'static str,
    },
    /// A bond is too long for its law.
    #[error(
        "the bond of the particles with the ids {} and {} is {length:.4e} m long. From {longest:.4e} m on, a bond of this material stores its \
         fracture energy before it softens: use smaller particles, or a larger `fracture_energy`",
        ids[0], ids[1]
    )]
    LongBond {
        /// Ids of the two particles.
        ids: [u32; 2],
        /// Length of the bond, m.
        length: f64,
        /// Length from which on bonds are too long, m.
        longest: f64,
    },
    /// The stiffness of a contact has outgrown the time step.
    #[error(
        "at step {step} (t = {time} s) the contact of the particle with id {id} with {} is about to overlap by {overlap:.4e} m, \
         where it is stable only below a time step of {bound:.4e} s; the time step is {dt:.4e} s. Lower \
         integration.contact_safety or integration.time_step; with integration.allow_unstable = true the run continues",
        other.as_ref().map_or_else(|id| format!("that with id {id}"), |wall| format!("the wall `{wall}`"))
    )]
    ContactOutgrown {
        /// Step.
        step: u64,
        /// Time, s.
        time: f64,
        /// Id of the first particle.
        id: u32,
        /// Name of the wall, or id of the second particle.
        other: Result<String, u32>,
        /// Overlap, m.
        overlap: f64,
        /// Largest stable time step, s.
        bound: f64,
        /// Time step, s.
        dt: f64,
    },
    /// The motion of a mesh is not possible.
    #[error("at step {step} (t = {time} s) the mesh `{wall}` cannot move on: {problem}")]
    Mesh {
        /// Step.
        step: u64,
        /// Time, s.
        time: f64,
        /// Name of the wall.
        wall: String,
        /// What is wrong, and the remedy.
        problem: String,
    },
    /// An implicit step of heat conduction, or a steady state, was not found.
    #[error(
        "heat conduction: conjugate gradients stopped at a relative residual of {residual:.1e} after {iterations} \
         iterations. A steady state needs a prescribed temperature, convection, or radiation on every connected part of \
         the body"
    )]
    HeatNotConverged {
        /// Relative residual reached.
        residual: f64,
        /// Iterations done.
        iterations: usize,
    },
    /// Contacts have become so many that the explicit step of heat conduction is beyond its bound.
    #[error(
        "heat conduction: the particle with id {id} has {contacts} contacts that formed later, with which explicit steps are stable only \
         below {bound:.4e} s of thermal time; the step is {dt:.4e} s. Lower integration.time_step or heat.time_factor, or write \
         heat.scheme = \"implicit\"; with integration.allow_unstable = true the run continues"
    )]
    HeatOutgrown {
        /// Id of the particle.
        id: u32,
        /// Number of its present contacts.
        contacts: usize,
        /// Largest stable step, s of thermal time.
        bound: f64,
        /// Step, s of thermal time.
        dt: f64,
    },
    /// Heat conduction where it is not supported, or without temperatures.
    #[error("heat conduction {problem}")]
    Heat {
        /// What is wrong.
        problem: &'static str,
    },
    /// The device that takes the steps failed.
    #[error("at step {step}: {source}")]
    Device {
        /// Step.
        step: u64,
        /// Reason, and remedy.
        source: DeviceError,
    },
    /// A velocity is NaN or infinite.
    #[error(
        "at step {step} (t = {time} s) the motion is no longer finite; the particle with id {id} is the first one. \
         The time step may be too large: `concordem check` prints its bound"
    )]
    NotFinite {
        /// Step.
        step: u64,
        /// Time, s.
        time: f64,
        /// Id of the first such particle.
        id: u32,
    },
    /// A temperature, a place, a force, or an energy is NaN or infinite.
    #[error(
        "at step {step} (t = {time} s) {what} is no longer a finite number. Look for a history, a table of a material, or a law that has no \
         value there"
    )]
    NoNumber {
        /// Step.
        step: u64,
        /// Time, s.
        time: f64,
        /// What is not finite.
        what: String,
    },
}

/// Why a device fails, and the remedy.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct DeviceError(pub String);
