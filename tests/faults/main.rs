//! Faults outside the physics: changed scenarios, damaged files, paths that must not be written to, impossible sizes, kills
//! before the first checkpoint.

mod files;
mod program;
mod restart;
mod sizes;
