//! What may go wrong outside of the physics: changed scenarios, damaged files, places that must not be written to, sizes that
//! cannot be, kills before the first checkpoint.

mod files;
mod program;
mod restart;
mod sizes;
