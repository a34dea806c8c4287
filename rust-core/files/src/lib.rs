//! File formats, without what a scenario or a result makes of them.
//!
//! * [`paths`]: regular files, and files that get their name when they are complete.
//! * [`leftovers`]: what killed processes did not finish.
//! * [`seal`]: a hash at the end of a file, which shows whether it is complete and unchanged.
//! * [`sphere_pack`]: packings in HDF5.
//! * [`checked_hdf5`]: the HDF5 library, with checks before it allocates memory.
//! * [`hdf5_text`], [`hdf5_groups`], [`flat_hdf5`]: what the library would read without checks, read without it.

pub mod checked_hdf5;
pub mod flat_hdf5;
pub mod hdf5_groups;
pub mod hdf5_text;
pub mod leftovers;
pub mod paths;
pub mod seal;
pub mod sphere_pack;

/// The code of the README is tested.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
