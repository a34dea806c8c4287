//! Aggregates and pores of concrete on the mesoscale: their sizes, shapes, and places.
//!
//! A [`Grading`] and a volume give [`sizes`]; a [`Form`] gives each size a body; [`place()`] puts all [`Inclusion`]s at random
//! places in a [`Region`] so that none overlap; [`Field::at`] tells which of them contains a point. [`mix`] converts the
//! quantities of a mix design to volume fractions.
//!
//! ```
//! use concordem_contact::math::Vec3;
//! use concordem_packing::{Random, Shape, aggregates::{Form, Grading, Placement, Region, Request, place, sizes}};
//!
//! // 20 % of a cube are spheres of 4 to 16 mm, sizes after Fuller.
//! let cube = Shape::new_box(Vec3::zeros(), Vec3::repeat(0.05))?;
//! let region = Region::mould(cube, false)?;
//! let grading = Grading::fuller(4e-3, 16e-3, 0.5)?;
//! let mut random = Random::new(1);
//! let bodies = sizes::descending(&grading, 0.2 * region.volume(), 3, &mut || Form::Sphere)?;
//! let requests = bodies.into_iter().map(|(form, size)| Request { form, size, group: 0 }).collect();
//! let field = place(region, requests, &[], &Placement::default(), &mut random)?;
//! assert!((field.volume() / field.region().volume() - 0.2).abs() < 0.001);
//! # Ok::<(), concordem_packing::PackingError>(())
//! ```

mod field;
mod form;
mod grading;
pub mod mix;
mod placing;
mod polyhedron;
mod region;
mod separation;
pub mod sizes;
#[cfg(test)]
mod tests;

pub use field::Field;
pub use form::{Form, Inclusion, MeshForm};
pub use grading::Grading;
pub use placing::{Placement, Request, place};
pub use polyhedron::Polyhedron;
pub use region::Region;
pub use separation::apart;
