//! YADE's cohesive and frictional spheres (`CohFrictMat`).

mod law;
#[cfg(test)]
mod tests;

pub use law::{CohesiveFriction, CohesiveFrictionState, Material, Rules, Version};
