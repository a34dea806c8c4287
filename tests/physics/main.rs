//! The solver's physics, one file per question.

mod beams;
mod bodies;
mod concrete;
mod deformable;
mod determinism;
mod energy;
mod lattices;
mod scaling;
mod statics;
mod time_step;
mod yade_trajectory;
