//! Physics of the solver, one file per topic.

mod beams;
mod bodies;
mod breaking;
mod chung_ooi;
mod concrete;
mod cracks;
mod deformable;
mod determinism;
mod dissipated_heat;
mod energy;
mod flows;
mod heat;
mod heat_of_contacts;
mod impacts;
mod lattices;
mod periodic_walls;
mod rest;
mod scaling;
mod scatter;
mod softening;
mod statics;
mod time_step;
mod yade_trajectory;
