//! Kernels of a step of bonded particles for a graphics processor, from the source of the laws.
//!
//! A step has two kernels without atomic operations:
//!
//! 1. one thread per bond ([`bond::evaluate`]): measure, law, history, and the loads on both particles;
//! 2. one thread per particle ([`particle::advance`]): sum of the loads in the order of the solver ([`Incidence`]), kick, drift.
//!
//! Both are pure functions of one bond or one particle. For `nvptx64` the crate has entry points that call them (`entry`), which
//! `rust-core/gpu/ptx` compiles to PTX and checks. Elsewhere a loop can call them. A test does so and gets the bits of the solver.
//!
//! **Supported:** one block of bonds (`cpm`, `cohesive_beam`, `linear_bond`) between rigid spheres, finite measure, local damping or none,
//! gravity, prescribed components that keep their velocity. **Not supported:** cells, unbonded contacts, walls, clumps, loads, deformable
//! particles, heat, energies. A step in which a bond breaks is marked; the host must go on without the kernels. No host code exists yet:
//! nothing here has run on a device.

#![no_std]
#![cfg_attr(target_arch = "nvptx64", feature(abi_ptx, stdarch_nvptx))]

#[cfg(not(target_arch = "nvptx64"))]
extern crate alloc;

pub mod bond;
#[cfg(target_arch = "nvptx64")]
mod entry;
#[cfg(not(target_arch = "nvptx64"))]
mod incidence;
pub mod particle;

#[cfg(not(target_arch = "nvptx64"))]
pub use incidence::Incidence;
