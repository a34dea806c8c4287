//! Contact mechanics: how two particles move relative to each other, and the laws that return their contact force.
//!
//! This is the lowest crate of ConcorDEM. It handles one pair of particles at a time, without neighbor lists, time
//! stepping, or files. Modules depend only on those above them in this list:
//!
//! | module | contents |
//! |---|---|
//! | [`math`], [`cell`], [`columns`](mod@columns), [`wrench`], [`prefetch`] | vectors, periodic cell, struct-of-arrays storage, forces with torques |
//! | [`geometry`], [`pair`], [`wall`], [`constraint`], [`elastic`] | data of contacts and particles |
//! | [`material`], [`scatter`], [`heat`], [`quantity`], [`ranges`] | tables of materials and of heat conduction, with units and ranges |
//! | [`kinematics`] | relative motion of the two sides in a step |
//! | [`law`], [`straight`] | force, moment, history, and energy from that motion; many contacts at once |
//! | [`step`], [`mod@activate`] | one step of a contact; beginning of an unbonded contact |
//! | [`own_loop`] | contacts in a program with its own loop over particles |
//! | [`leapfrog`] | kick and drift of a free particle |
//! | [`conformance`] | tests that every law must pass |

#![cfg_attr(not(feature = "std"), no_std)]
#![cfg_attr(target_arch = "nvptx64", feature(core_float_math))]

// Macros name it by its crate, inside it as in others.
extern crate self as concordem_contact;

pub mod activate;
pub mod cell;
pub mod columns;
#[cfg(feature = "std")]
pub mod conformance;
pub mod constraint;
pub mod elastic;
#[cfg(feature = "std")]
pub mod field;
pub mod geometry;
#[cfg(feature = "std")]
pub mod heat;
pub mod kinematics;
pub mod law;
pub mod leapfrog;
#[cfg(feature = "std")]
pub mod material;
pub mod math;
pub mod own_loop;
pub mod pair;
pub mod prefetch;
#[cfg(feature = "std")]
pub mod quantity;
#[cfg(feature = "std")]
pub mod ranges;
#[cfg(feature = "std")]
pub mod scatter;
pub mod step;
pub mod straight;
pub mod wall;
pub mod wrench;

// The macros for laws, and signatures here, use them.
pub use {bytemuck, nalgebra};

pub use cell::Cell;
pub use constraint::Constraint;

/// The code of the README is tested.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
