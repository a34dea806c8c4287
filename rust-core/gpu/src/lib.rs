//! Steps on graphics processors, from the source of the laws.
//!
//! A step has three kernels without atomic operations ([`kernels`]):
//!
//! 1. one thread per contact ([`contact::evaluate`]): measure, law, history, energies, and the loads on both particles;
//! 2. one thread per particle ([`particle::advance`]): sum of the loads in the order of the solver ([`Incidence`]), kick, drift, work;
//! 3. one thread per tile and energy: sums in the order of the solver.
//!
//! The first two call pure functions of one contact or one particle. For `nvptx64` the crate has only the kernels and their entry points
//! (`entry`), which `rust-core/gpu/ptx` compiles to PTX and checks. Elsewhere it also has the host part: [`DeviceSteps`] takes steps on a
//! [`Device`](device::Device), in place of the solver. One of the devices is [emulated](device::emulated).
//!
//! **Steps with an event** are the solver's: if a bond breaks, or a contact begins that follows a broken bond, the step is
//! discarded on the device ([`concordem_solver::StepDevice`]).
//!
//! **Supported:** all laws, for bonds and unbonded contacts of rigid spheres; finite measure, local damping or none, gravity, prescribed
//! components that keep their velocity. **Not supported:** cells, walls, clumps, forces on particles, deformable particles, heat.
//! On an H200 the results had the bits of the solver (`docs/book/evidence/speed.md`); tests without a device use the emulated one.

#![cfg_attr(target_arch = "nvptx64", no_std)]
#![cfg_attr(target_arch = "nvptx64", feature(abi_ptx, stdarch_nvptx))]

pub mod arguments;
pub mod contact;
pub mod kernels;
pub mod particle;

#[cfg(target_arch = "nvptx64")]
mod entry;

#[cfg(not(target_arch = "nvptx64"))]
mod block;
#[cfg(not(target_arch = "nvptx64"))]
mod buffer;
#[cfg(not(target_arch = "nvptx64"))]
pub mod device;
#[cfg(not(target_arch = "nvptx64"))]
mod incidence;
#[cfg(not(target_arch = "nvptx64"))]
mod steps;
#[cfg(not(target_arch = "nvptx64"))]
mod sums;
#[cfg(not(target_arch = "nvptx64"))]
mod traffic;

#[cfg(not(target_arch = "nvptx64"))]
pub use {incidence::Incidence, steps::DeviceSteps, traffic::bytes_per_step};

/// The code of the README is tested.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
