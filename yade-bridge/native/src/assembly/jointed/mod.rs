//! YADE's jointed cohesive frictional spheres (`JCFpmMat`), and the cracks of a step.

mod cracks;
mod law;
#[cfg(test)]
mod tests;

pub use cracks::{Crack, CrackKind, Happenings};
pub use law::{JointedFriction, JointedFrictionState, Material, Rules};
